/* fly_settings.h: the options of `veduta fly`: those of `render` that say what the world looks
 * like, and its own. */
#ifndef VEDUTA_APP_FLY_SETTINGS_H
#define VEDUTA_APP_FLY_SETTINGS_H

#include "path_file.h"
#include "render_settings.h"
#include "video.h"

/* Behind `render`'s, whose places in the table stay. */
enum {
    FLY_OUTPUT = OPTION_COUNT,
    FLY_FPS,
    FLY_DURATION,
    FLY_QUALITY,
    FLY_FRAMES,
    FLY_RESUME,
    FLY_ORBIT,
    FLY_SPEED,
    FLY_ABOVE,
    FLY_AHEAD,
    FLY_SMOOTH,
    FLY_PITCH,
    FLY_CLEARANCE,
    FLY_PREVIEW,
    FLY_PROGRESS,
    FLY_IN_FLIGHT,
    FLY_COUNT
};

typedef enum vd_fly_progress {
    VD_FLY_PROGRESS_AUTO = 0, /* a line on a terminal */
    VD_FLY_PROGRESS_JSON,     /* lines on standard output */
    VD_FLY_PROGRESS_OFF
} vd_fly_progress;

typedef struct vd_fly_settings {
    vd_render_settings render; /* the world and its look; the camera's fields say nothing */
    vd_path_settings path;
    const char *path_file; /* null: an orbit about everything */
    const char *output;    /* null: a preview without a map */
    vd_video_def video;
    const char *frames; /* pattern of the pictures that are kept; null: none */
    char pattern[4096]; /* the same where a folder was given */
    bool resume, preview;
    vd_fly_progress progress;
    int in_flight;
    char look[24]; /* what the pictures' look follows from, as a number */
} vd_fly_settings;

/* Fills the table; its texts live as long as the program. */
void vd_fly_make_table(vd_option table[FLY_COUNT]);

void vd_fly_print_help(void);

/* Whether an option of `render` has no meaning where a path says where the camera is. */
bool vd_fly_leaves_out(int option);

/* Refuses those of them that were given: VD_ERROR_ARGUMENT. */
VD_MUST_USE vd_status vd_fly_refuse(const vd_options *options);

/* Reads the settings; `out` borrows from `options` and the path's file (null: an orbit). Returns
 * VD_ERROR_ARGUMENT, or VD_ERROR_UNSUPPORTED where ffmpeg is needed and missing. */
VD_MUST_USE vd_status vd_fly_settings_read(vd_options *options, const char *path_file,
                                           vd_fly_settings *out);

#endif

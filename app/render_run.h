/* render_run.h: one run of `veduta render`, handed from stage to stage. */
#ifndef VEDUTA_APP_RENDER_RUN_H
#define VEDUTA_APP_RENDER_RUN_H

#include "render_settings.h"
#include "run.h"
#include "world_content.h"

typedef struct vd_render_run {
    const vd_render_settings *settings;
    const vd_world_content *content; /* of a world file; null: none */
    vd_notes notes;
    bool has_notes;
    vd_context *context;
    vd_job *job;
    double start; /* vd_seconds_now at the beginning */

    bool bad_use; /* a failure is the command line's, not the data's */

    /* What a stage leaves behind; json_t owned by the run. */
    vd_frame *frame; /* null after a dry run */
    double near_m, far_m;
    char flags[1024];   /* the camera as flags */
    json_t *camera;     /* the camera as an options file: the PNG's text, --print-camera */
    json_t *camera_all; /* the camera in every spelling, for --json */
    json_t *terrain;    /* what was drawn, for --json; null for a model */
    json_t *model;      /* likewise; null for terrain */
    json_t *objects;    /* likewise; null where nothing stands on the terrain */
    json_t *impostors;  /* likewise; null where it is drawn without them */
    vd_frame_stats stats;
    double draw_seconds;    /* drawing alone; after a dry run the estimate */
    double ready_seconds;   /* dry run: from the start until drawing would begin */
    size_t estimated_bytes; /* dry run: the most memory that the process holds */
} vd_render_run;

/* Begins the notes of a command that reads render's options, with what reading them had to say:
 * `note` (may be empty) and the warnings of a world file. */
VD_MUST_USE vd_status vd_render_notes_begin(vd_notes *notes, bool quiet, const char *note,
                                            const vd_world_content *content);

/* Begins a run of which settings and content are set: notes, context, job; signals cancel the job
 * from here on. vd_render_run_end is due also after a failure. */
VD_MUST_USE vd_status vd_render_run_begin(vd_render_run *run, const char *note);

/* Ends it, prints a failure and returns the exit status. */
int vd_render_run_end(vd_render_run *run, const vd_status *status);

/* Checks where a result is to go (vd_check_output) before anything takes long, against what the
 * settings read and `also` (may be null). No path, no failure. */
VD_MUST_USE vd_status vd_render_check_output(const vd_render_settings *settings, const char *also,
                                             const char *option, const char *path);

/* Loads and draws, or estimates where settings->dry_run: a world, a model, the classic picture.
 */
VD_MUST_USE vd_status vd_render_world(vd_render_run *run);
VD_MUST_USE vd_status vd_render_model(vd_render_run *run);
VD_MUST_USE vd_status vd_render_classic(vd_render_run *run);

/* Parses options over vd_render_table (or a table that begins with it), reads the options files
 * among them, settles presets and reads the settings; everything that is bad use is found here.
 * What a world file has beside options goes to `content`, which the caller finishes in any case;
 * null: it is left out, and options->note says so. `help`: --help was given, and the settings were
 * not read. */
VD_MUST_USE vd_status vd_render_read_options(int argc, char **argv, vd_options *options,
                                             vd_render_settings *settings,
                                             vd_world_content *content, bool *help);

/* The part of it after the options were parsed. */
VD_MUST_USE vd_status vd_render_read_parsed(vd_options *options, vd_render_settings *settings,
                                            vd_world_content *content);

/* The part of it that reads the options and world files among the arguments, the one named by
 * --options and every input that ends in .json, which then is an input no longer; and settles what
 * flags, files and preset say of one thing. */
VD_MUST_USE vd_status vd_render_read_files(vd_options *options, vd_world_content *content);

/* Takes the last of the inputs, a camera path, from them; the caller frees it. False where none is
 * left beside what is to be drawn: `nothing` where not even that was named. */
bool vd_render_take_path(vd_options *options, char **path, bool *nothing);

/* Creates the frame that the settings ask for. */
VD_MUST_USE vd_status vd_render_make_frame(vd_render_run *run);

/* Bytes of such a frame and of what writing it takes. */
size_t vd_render_frame_bytes(const vd_render_settings *settings);

/* Dry run: sets estimated_bytes from what the process held when everything was loaded and what
 * drawing takes beside the frame. */
void vd_render_estimate_memory(vd_render_run *run, const vd_process_memory *loaded,
                               size_t drawing_bytes);

#endif

/* window_path.h: recording a camera path for `veduta fly`, and names for files that are new. */
#ifndef VEDUTA_APP_WINDOW_PATH_H
#define VEDUTA_APP_WINDOW_PATH_H

#include <jansson.h>

#include "window_motion.h"

typedef struct vd_recording {
    json_t *keyframes; /* null: nothing is recorded */
    double start_s, last_s;
} vd_recording;

/* Begins; false when memory is out. */
bool vd_recording_begin(vd_recording *recording, double now_s);

/* Takes a keyframe when half a second has gone by since the last, or `always`. */
void vd_recording_note(vd_recording *recording, double now_s, const vd_motion_state *state,
                       bool always);

/* Ends it and writes {"veduta_path": 1, "keyframes": [{"time", "eye", "heading", "pitch", "fov"},
 * …]}: seconds, metres, degrees. Returns VD_ERROR_IO or VD_ERROR_MEMORY. */
VD_MUST_USE vd_status vd_recording_end(vd_recording *recording, const char *path);

/* Writes the first of NAME-0001.ENDING, NAME-0002.ENDING … that is no file yet. */
void vd_new_file_name(const char *name, const char *ending, char *out, size_t out_bytes);

#endif

/* window_path.h: recording a camera path for `veduta fly` and `veduta evaluate`, and names for
 * files that are new. */
#ifndef VEDUTA_APP_WINDOW_PATH_H
#define VEDUTA_APP_WINDOW_PATH_H

#include "window_motion.h"

/* Frames that are kept of a recording: half an hour at 60 a second, 7 MiB. Of a longer one every
 * second frame is kept, then every fourth … */
enum { VD_RECORDING_FRAMES = 1 << 17 };

/* Where the camera was. */
typedef struct vd_recorded {
    double time_s, eye[3], heading, pitch, fov; /* degrees */
} vd_recorded;

typedef struct vd_recording {
    bool on;
    double start_s, roll; /* degrees, the same all the way */
    vd_recorded *frames;  /* [room] */
    int count, room;
    int every, since; /* one frame of so many is kept; noted since the last but one that is */
} vd_recording;

/* Begins with where the camera is. False when memory is out. */
bool vd_recording_begin(vd_recording *recording, double now_s, const vd_motion_state *state,
                        double roll);

/* Takes a frame: the camera is here now. What rests for frames takes two of them. Without memory
 * for more the recording goes on with fewer of them. */
void vd_recording_note(vd_recording *recording, double now_s, const vd_motion_state *state);

/* The camera has rested until then where it was noted last. */
void vd_recording_hold(vd_recording *recording, double until_s);

/* Ends it and writes {"veduta_path": 1, "ease": false, "clearance": 0, "keyframes": [{"time",
 * "eye", "heading", "pitch", "fov"}, …]}: seconds, metres, degrees, each number to the last bit.
 * Returns VD_ERROR_IO or VD_ERROR_MEMORY. */
VD_MUST_USE vd_status vd_recording_end(vd_recording *recording, const char *path);

/* Forgets it. */
void vd_recording_finish(vd_recording *recording);

/* Writes the first of NAME-0001.ENDING, NAME-0002.ENDING … that is no file yet. */
void vd_new_file_name(const char *name, const char *ending, char *out, size_t out_bytes);

#endif

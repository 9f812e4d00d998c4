/* fly_run.h: frames along a path, drawn and encoded at once.
 *
 * One thread draws, with all threads of the context; others hand finished frames over: to ffmpeg's
 * pipe in their order, to picture files in any. A frame depends on its camera alone, so the bytes
 * are the same whatever overlaps.
 */
#ifndef VEDUTA_APP_FLY_RUN_H
#define VEDUTA_APP_FLY_RUN_H

#include "fly_settings.h"
#include "run.h"

typedef vd_status vd_fly_draw_function(void *user, const vd_camera *camera, vd_frame *frame);

typedef struct vd_flight {
    vd_context *context;
    vd_job *job; /* cancelled by a signal */
    const vd_fly_settings *settings;
    const vd_camera_path *path;
    vd_fly_draw_function *draw;
    void *draw_user;
    char look[64];       /* written with every picture: what it must have to be taken by --resume */
    const char *command; /* written too */
    int count;           /* frames */
} vd_flight;

/* What came of it; also after a failure. */
typedef struct vd_flight_result {
    int done;     /* frames that are where they should be */
    int drawn;    /* of these drawn, */
    int repeated; /* the same as the frame before, */
    int taken;    /* or there already */
    uint64_t bytes;
    double seconds, processor_seconds; /* ffmpeg's included */
} vd_flight_result;

/* Frames of a path: a frame stands for 1 / fps seconds. */
int vd_flight_count(const vd_camera_path *path, double fps);

/* The camera of a frame. */
vd_camera vd_flight_camera(const vd_flight *flight, int number);

/* Flies. VD_ERROR_CANCELLED: the frames so far are a video that plays, or pictures. */
VD_MUST_USE vd_status vd_flight_run(const vd_flight *flight, vd_flight_result *out);

/* Whether a picture file is a frame of this flight, complete, of its size, look and camera. */
bool vd_flight_has_picture(const vd_flight *flight, const char *path, const vd_camera *camera);

/* Whether two cameras are the same to the last bit. */
bool vd_camera_same(const vd_camera *a, const vd_camera *b);

/* Bytes of the frames that are held at once. */
size_t vd_flight_frame_bytes(const vd_flight *flight);

#endif

/* window_remote.h: a server's world as the window sees it. */
#ifndef VEDUTA_APP_WINDOW_REMOTE_H
#define VEDUTA_APP_WINDOW_REMOTE_H

#include "window_scene.h"

typedef struct vd_window_remote {
    const char *url; /* as `veduta serve` printed it */
    bool insecure;   /* take any certificate */
    double memory_bytes;
} vd_window_remote;

/* Connects and waits until it is known where to look from: 10 s at most for a server that does not
 * answer. `wake` is called from another thread when something new is to be seen. *out is ended by
 * its destroy. Returns VD_ERROR_ARGUMENT (the address), VD_ERROR_UNSUPPORTED (no veduta-remote),
 * VD_ERROR_IO (not reached, refused, another version: the server's sentence), VD_ERROR_FORMAT (no
 * camera in /world.json), VD_ERROR_CANCELLED or VD_ERROR_MEMORY. */
VD_MUST_USE vd_status vd_window_remote_open(vd_context *context, vd_job *job,
                                            const vd_window_remote *def,
                                            const vd_render_settings *settings,
                                            vd_window_stage_function *stage, void *stage_user,
                                            void (*wake)(void *user), void *wake_user,
                                            vd_window_scene *out);

#endif

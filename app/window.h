/* window.h: a window to fly through worlds. */
#ifndef VEDUTA_APP_WINDOW_H
#define VEDUTA_APP_WINDOW_H

#include "run.h"
#include "window_remote.h"
#include "world_content.h"

typedef struct vd_window_def {
    vd_options *options;              /* of the table of `veduta render`; the window changes them */
    vd_render_settings settings;      /* as they were read */
    const vd_impostor_def *impostors; /* while moving; null: none */
    const vd_world_content *content;  /* what a world file has beside them; null: none */
    const vd_window_remote *remote;   /* the first world is a server's; null: none is */
    bool join;                        /* all inputs are one world; else each is one */
    bool full_screen;
    int frames; /* end after so many pictures; 0: when the window is closed */
    vd_notes *notes;
} vd_window_def;

/* Opens the window and returns when it is closed, or by SIGINT or SIGTERM. Returns
 * VD_ERROR_UNSUPPORTED (built without SDL2, or it is not installed), VD_ERROR_IO (no display) or
 * VD_ERROR_MEMORY. A world that cannot be loaded or drawn is no failure: the window says so. */
VD_MUST_USE vd_status vd_window_run(const vd_window_def *def);

#endif

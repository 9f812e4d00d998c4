/* window_render.h: the render thread of the window.
 *
 *   event thread   ask(request) ────────────► render thread   open, look, draw, convert
 *                  take() ◄── newest picture ──────────────   publish, wake
 *
 * Only the newest request counts and only the newest picture is shown: three pictures go round, one
 * with each thread and one between them, and neither ever waits for the other. While the camera
 * moves, pictures have one sample a pixel and are as large as the display's rate allows; when it
 * rests, one more picture is what `veduta render` would draw. That one is cancelled when the camera
 * moves on. The thread owns the context and its parallel loops.
 */
#ifndef VEDUTA_APP_WINDOW_RENDER_H
#define VEDUTA_APP_WINDOW_RENDER_H

#include "window_look.h"
#include "window_pace.h"
#include "window_remote.h"
#include "window_scene.h"

enum { VD_WINDOW_WORLDS = 9, VD_WINDOW_TEXT = 400 };

/* What the event thread wants to see. `settings` is self-contained but for what never changes while
 * the window is open: the command line's inputs and imagery. */
typedef struct vd_window_request {
    int world;
    vd_render_settings settings;
    char input[4096];   /* the world's; empty: what settings name */
    const char *inputs; /* a list of one, for the settings */
    char colormap[256]; /* what settings.colormap is set to */
    vd_camera_settings camera;
    int width, height; /* pixels */
    bool moving;
    vd_impostor_show show; /* over impostors, and whether they are kept */
    bool frozen;
    int threads;
    double event_s;   /* vd_seconds_now of what led to it */
    char flags[2048]; /* the same picture by `veduta render` */
} vd_window_request;

typedef struct vd_window_picture {
    uint32_t *pixels; /* [height][width], 0xFFRRGGBB */
    size_t room;
    int width, height, world;
    bool exact; /* of the finished quality */
    double scale;
    double event_s;                   /* of its request */
    double look_s, draw_s, convert_s; /* what its stages took */
    bool by_impostors;                /* there are some, and what they did last: */
    vd_impostor_stats impostors;
} vd_window_picture;

typedef enum vd_world_state {
    VD_WORLD_NONE = 0, /* not asked for yet */
    VD_WORLD_LOADING,
    VD_WORLD_READY,
    VD_WORLD_FAILED
} vd_world_state;

typedef struct vd_window_render vd_window_render;

typedef struct vd_window_render_def {
    int threads;
    const vd_world_content *content;  /* of the first world; null: nothing beside its terrain */
    const vd_impostor_def *impostors; /* while moving; null: none */
    const vd_window_remote *remote;   /* the first world is a server's; null: none is */
    double period_s;                  /* of the display */
    void (*wake)(void *user);         /* called by the render thread when there is something new */
    void *wake_user;
    vd_log_function *log;
    void *log_user;
} vd_window_render_def;

/* Starts the thread. Returns the errors of vd_context_create. */
VD_MUST_USE vd_status vd_window_render_create(const vd_window_render_def *def,
                                              vd_window_render **out);

/* Cancels what runs, ends the thread and all worlds. */
void vd_window_render_destroy(vd_window_render **render);

/* The most threads that a request may ask for. */
int vd_window_render_most_threads(const vd_window_render *render);

/* Asks for a picture; the settings of the world are read when it is opened. Never waits for more
 * than a copy. */
void vd_window_render_ask(vd_window_render *render, const vd_window_request *request);

/* Forgets a world: the next request for it opens it anew. */
void vd_window_render_forget(vd_window_render *render, int world);

/* Asks for the finished picture of the last request to be written as a PNG. One at a time. */
void vd_window_render_shoot(vd_window_render *render, const char *path);

/* Returns the newest picture, which lives until the next call; null before the first. `fresh` tells
 * whether it is another one than the last. */
const vd_window_picture *vd_window_render_take(vd_window_render *render, bool *fresh);

typedef struct vd_window_news {
    vd_world_state state; /* of the requested world */
    const char *stage;    /* while it loads */
    double progress;      /* 0 … 1; of the stage */
    bool failing;         /* the last picture failed */
    char failure[VD_WINDOW_TEXT];
    bool idle;                 /* the finished picture of the last request is there */
    int shots;                 /* pictures written so far, or failed */
    char shot[VD_WINDOW_TEXT]; /* what became of the last */
    bool changes;              /* the world does so by itself: */
    vd_scene_news scene;
} vd_window_news;

void vd_window_render_news(vd_window_render *render, vd_window_news *out);

/* Gives what the event thread may know of a world; false unless it is ready. */
bool vd_window_render_world(vd_window_render *render, int world, vd_camera_settings *start,
                            vd_look_defaults *defaults);

/* Height of a world's ground, metres; −infinity where there is none or the world is not ready. */
double vd_window_render_ground(vd_window_render *render, int world, double x, double y);

#endif

/* window_scene.h: a world as the window sees it: something that is drawn, lit and stood upon.
 *
 * The window knows worlds by this table alone. All functions but `ground` are called from one
 * thread, the window's render thread, which owns the context's parallel loops; `ground` is also
 * called from the event thread, at the same time as any of the others but never `destroy`.
 */
#ifndef VEDUTA_APP_WINDOW_SCENE_H
#define VEDUTA_APP_WINDOW_SCENE_H

#include "world_content.h"

typedef enum vd_window_quality {
    VD_WINDOW_MOVING = 0, /* one sample a pixel */
    VD_WINDOW_STILL       /* what `veduta render` draws, to the byte */
} vd_window_quality;

/* How a picture is drawn. Where impostors are laid over or kept they are shown at rest, too: that
 * is what is to be seen. */
typedef struct vd_window_way {
    vd_window_quality quality;
    vd_impostor_show show; /* over impostors */
    bool frozen;           /* impostors stay as they are, whatever the camera does */
} vd_window_way;

/* Of a scene that changes by itself. */
typedef struct vd_scene_news {
    uint64_t version;   /* another one: something new is to be seen */
    char state[480];    /* a sentence while it is not as it should be; else empty */
    bool failed;        /* and will not be any more */
    char lines[2][100]; /* for the frame times */
} vd_scene_news;

typedef struct vd_window_scene {
    void *user;

    /* Draws a picture into all of the frame. */
    vd_status (*draw)(void *user, vd_job *job, const vd_camera *camera, const vd_window_way *way,
                      vd_frame *frame);

    /* What impostors did for the last picture that was drawn by them; false: none was. */
    bool (*impostors)(void *user, vd_impostor_stats *out);

    /* Takes over the settings that can change while it is looked at: sun, haze, exaggeration,
     * samples, filter, shadows, colours, method. Derives anew what hangs on a changed one, and
     * nothing else. After a failure it is drawn as it was before. `settings` and what it points to
     * need not outlive the call. */
    vd_status (*look)(void *user, vd_job *job, const vd_render_settings *settings);

    /* Height of the ground as it is drawn, metres; −infinity where there is none. */
    double (*ground)(void *user, double x, double y);

    /* What has become of it; null: nothing changes by itself. Called as `ground` is. */
    void (*news)(void *user, vd_scene_news *out);

    void (*destroy)(void *user);

    /* Where it is seen from at first (VD_SPELLING_ANGLES), and what the automatic settings came to:
     * the window names them when it prints a camera. */
    vd_camera_settings start;
    double haze_m; /* 0: none */
    bool curvature;
    double size_m; /* the diagonal, metres: speeds follow it */
} vd_window_scene;

/* What opening is about; `stage` is a constant text. Written by the render thread. */
typedef void vd_window_stage_function(void *user, const char *stage);

/* Opens what the settings name (of which `colormap` need not outlive the call) and makes it ready
 * to be drawn; *out is ended by its destroy. `content` (null: nothing beside the terrain) must
 * outlive it. `impostors` (null: none) is how pictures stand in for things while the camera moves.
 * `job` tells how far it is and may cancel it. Returns the errors of loading and of
 * vd_terrain_renderer_create. */
VD_MUST_USE vd_status vd_window_scene_open(vd_context *context, vd_job *job,
                                           const vd_render_settings *settings,
                                           const vd_world_content *content,
                                           const vd_impostor_def *impostors,
                                           vd_window_stage_function *stage, void *stage_user,
                                           vd_window_scene *out);

#endif

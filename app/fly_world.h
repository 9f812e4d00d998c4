/* fly_world.h: what a camera flies through. The one place that knows how frames are drawn. */
#ifndef VEDUTA_APP_FLY_WORLD_H
#define VEDUTA_APP_FLY_WORLD_H

#include "render_terrain.h"

typedef struct vd_fly_world {
    vd_render_run *run; /* settings, context, job */
    vd_scene scene;
    vd_colormap colormap;
    vd_terrain_def def;
    vd_terrain_renderer *renderer;
    double exaggeration;
} vd_fly_world;

/* Loads it. vd_fly_world_finish is due also after a failure. */
VD_MUST_USE vd_status vd_fly_world_load(vd_render_run *run, vd_fly_world *out);
void vd_fly_world_finish(vd_fly_world *world);

/* A vd_ground_function: the height of the ground as it is drawn; `user` is the world. */
double vd_fly_ground(void *user, double x, double y);

/* Settles what must be the same in all frames, such as the distance of the haze, and gets ready to
 * draw. */
VD_MUST_USE vd_status vd_fly_world_prepare(vd_fly_world *world, const vd_camera_path *path);

/* Draws one frame; `user` is the world. One thread at a time. */
VD_MUST_USE vd_status vd_fly_draw(void *user, const vd_camera *camera, vd_frame *frame);

/* Draws the world from straight above, without haze and curvature. */
VD_MUST_USE vd_status vd_fly_draw_map(vd_fly_world *world, const vd_camera *camera,
                                      vd_frame *frame);

#endif

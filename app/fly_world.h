/* fly_world.h: what a camera flies through: a world that is drawn many times. */
#ifndef VEDUTA_APP_FLY_WORLD_H
#define VEDUTA_APP_FLY_WORLD_H

#include "world_scene.h"

typedef struct vd_fly_world {
    vd_render_run *run; /* settings, content, context, job */
    vd_world_scene *scene;
    vd_world_renderer *renderer; /* null until it is prepared */
} vd_fly_world;

/* Loads it. vd_fly_world_finish is due also after a failure. */
VD_MUST_USE vd_status vd_fly_world_load(vd_render_run *run, vd_fly_world *out);
void vd_fly_world_finish(vd_fly_world *world);

/* Settles what must be the same in all frames, such as the distance of the haze, and gets ready to
 * draw. */
VD_MUST_USE vd_status vd_fly_world_prepare(vd_fly_world *world, const vd_camera_path *path);

/* Draws one frame; `user` is the world. One thread at a time. */
VD_MUST_USE vd_status vd_fly_draw(void *user, const vd_camera *camera, vd_frame *frame);

/* Draws the terrain from straight above, without haze and curvature. */
VD_MUST_USE vd_status vd_fly_draw_map(vd_fly_world *world, const vd_camera *camera,
                                      vd_frame *frame);

/* Bounds of the terrain as it is drawn, or of the objects where there is none. */
void vd_fly_world_bounds(const vd_fly_world *world, vd_vec3 *min, vd_vec3 *max);

#endif

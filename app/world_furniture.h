/* world_furniture.h: a world's title, north arrow, scale bar and legend. */
#ifndef VEDUTA_APP_WORLD_FURNITURE_H
#define VEDUTA_APP_WORLD_FURNITURE_H

#include "world_scene.h"

/* Makes what the run's settings ask for; nothing where they ask for nothing. Returns what opening a
 * font does. */
VD_MUST_USE vd_status vd_world_furnish(vd_world_scene *scene, const vd_render_run *run);
void vd_world_unfurnish(vd_world_scene *scene);

/* A vd_overlay_function; `user` is the vd_world_scene. */
vd_status vd_world_overlay(void *user, const vd_camera *camera, int width, int height,
                           vd_overlay *out);

#endif

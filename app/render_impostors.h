/* render_impostors.h: one picture of a world through impostors. */
#ifndef VEDUTA_APP_RENDER_IMPOSTORS_H
#define VEDUTA_APP_RENDER_IMPOSTORS_H

#include "world_scene.h"

/* Draws the run's frame, which has depth: until the picture has settled, which makes it the one
 * that is drawn without impostors; or with --show until all pictures are there. `empty`: nothing is
 * in it. Leaves what they were in run->impostors. Returns the errors of the library's impostors,
 * and VD_ERROR_LIMIT where it does not come to rest. */
VD_MUST_USE vd_status vd_render_by_impostors(vd_render_run *run, vd_world_scene *scene,
                                             vd_world_renderer *renderer, const vd_camera *camera,
                                             bool *empty);

#endif

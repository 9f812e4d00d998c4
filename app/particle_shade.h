/* particle_shade.h: light for points that have no surface. */
#ifndef VEDUTA_APP_PARTICLE_SHADE_H
#define VEDUTA_APP_PARTICLE_SHADE_H

#include <veduta/veduta.h>

/* Darkens each pixel by how much nearer its neighbours are (eye-dome lighting, Boucheny 2009,
 * §4.3), which shows edges and folds. The frame has depth; background stays. Returns
 * VD_ERROR_MEMORY. */
VD_MUST_USE vd_status vd_particle_shade(vd_context *context, vd_frame *frame,
                                        const vd_camera *camera);

#endif

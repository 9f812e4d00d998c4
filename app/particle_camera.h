/* particle_camera.h: from where particles are seen. */
#ifndef VEDUTA_APP_PARTICLE_CAMERA_H
#define VEDUTA_APP_PARTICLE_CAMERA_H

#include "particle_settings.h"

/* Makes the camera that the settings ask for; without a place it is the nearest that has all
 * particles, drawn with about `radius`, in its picture. Returns VD_ERROR_FORMAT (a damaged brick).
 */
VD_MUST_USE vd_status vd_particle_camera(const vd_bricks *bricks,
                                         const vd_particle_settings *settings, double radius,
                                         vd_camera *out);

#endif

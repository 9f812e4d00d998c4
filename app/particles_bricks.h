/* particles_bricks.h: generated particles become bricks. */
#ifndef VEDUTA_APP_PARTICLES_BRICKS_H
#define VEDUTA_APP_PARTICLES_BRICKS_H

#include <veduta/veduta.h>

/* Writes particles with radius, mass, speed and class into a brick file. Returns what importing
 * returns. */
VD_MUST_USE vd_status vd_particles_to_bricks(vd_context *context, vd_job *job,
                                             const vd_particles *particles, const char *path,
                                             vd_bricks_report *report);

#endif

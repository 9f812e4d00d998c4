/* particles_bricks.h: generated particles become bricks. */
#ifndef VEDUTA_APP_PARTICLES_BRICKS_H
#define VEDUTA_APP_PARTICLES_BRICKS_H

#include <veduta/veduta.h>

/* Where generated particles are: world = centre + size × (x, y, z); radii grow with it. */
typedef struct vd_particles_place {
    vd_vec3 centre;
    double size; /* of the cube that they fill, metres */
} vd_particles_place;

/* Moves particles there, to the rounding of floats. */
void vd_particles_move(vd_particles *particles, const vd_particles_place *place);

/* Writes particles with radius, mass, speed and class into a brick file, at a place. Returns what
 * importing returns. */
VD_MUST_USE vd_status vd_particles_to_bricks(vd_context *context, vd_job *job,
                                             const vd_particles *particles,
                                             const vd_particles_place *place, const char *path,
                                             vd_bricks_report *report);

#endif

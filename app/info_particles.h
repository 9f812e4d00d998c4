/* info_particles.h: `veduta info` of particles. */
#ifndef VEDUTA_APP_INFO_PARTICLES_H
#define VEDUTA_APP_INFO_PARTICLES_H

#include <stdbool.h>
#include <veduta/veduta.h>

/* Prints what a file of particles holds, as people or scripts (`json`) want it. Brick files are
 * described by their directory, and verified; others are read through. */
VD_MUST_USE vd_status vd_info_particles(vd_context *context, const char *path, bool json);

#endif

/* particles.h: synthetic particles, seeded, for benches, tests and trying things out.
 *
 * A snapshot as galaxy simulations make them: Plummer spheres (Plummer 1911; sampled as Aarseth,
 * Hénon & Wielen 1974) on the knots of a web of filaments, over a thin uniform background.
 * Particles come in Morton order, so that every run of them is a compact block.
 */
#ifndef VEDUTA_PARTICLES_H
#define VEDUTA_PARTICLES_H

#include <veduta/context.h>
#include <veduta/splat.h>

VD_BEGIN_DECLARATIONS

typedef struct vd_particles {
    vd_context *context;
    size_t count;
    float *x, *y, *z; /* [count], metres; in a cube of side 1 around the origin */
    float *radius;    /* [count], smoothing length: about the distance to the next few particles */
    float *mass;      /* [count]; all masses together are 1 */
    float *speed;     /* [count], escape velocity of the sphere, in units of its own */
    uint8_t *classes; /* [count]: 0 background, 1 filament, 2 sphere */
} vd_particles;

/* Makes `count` particles; the same seed gives the same ones on every machine. *out is owned by the
 * caller. Returns VD_ERROR_LIMIT (above VD_SPLATS_MAX_COUNT), VD_ERROR_MEMORY or
 * VD_ERROR_CANCELLED. `job` may be null. */
VD_API VD_MUST_USE vd_status vd_particles_generate(vd_context *context, vd_job *job, uint64_t seed,
                                                   size_t count, vd_particles **out);
VD_API void vd_particles_destroy(vd_particles **particles);

/* Writes particles, by the ending of the path: .ply (binary, little-endian: float x, y, z, radius,
 * mass, speed, uchar class), .csv (the same names in the first line), .raw or .f32 (little-endian
 * floats x, y, z, radius, mass, speed, particle after particle). "-" is standard output, as CSV.
 * Written beside and renamed. Returns VD_ERROR_ARGUMENT (another ending) or VD_ERROR_IO. */
VD_API VD_MUST_USE vd_status vd_particles_save(const vd_particles *particles, const char *path);

/* Returns the run [first, first + count) as splats with bounds: positions, radii, masses as
 * weights, speeds as values. first + count <= particles->count. The arrays stay the particles'. */
VD_API vd_splats vd_particles_splats(const vd_particles *particles, size_t first, size_t count);

VD_END_DECLARATIONS

#endif

/* bench_cloud.h: generated particles in a world, for the cases that go round them. */
#ifndef VEDUTA_APP_BENCH_CLOUD_H
#define VEDUTA_APP_BENCH_CLOUD_H

#include "bench.h"
#include "particles_bricks.h"

/* The file for a run's particles, in $TMPDIR or /tmp; for bench_cloud_write, and to unlink. */
void bench_cloud_path(char *out, size_t out_bytes);

/* Writes `count` particles into a brick file. */
VD_MUST_USE vd_status bench_cloud_write(const char *path, size_t count,
                                        const vd_particles_place *place);

/* Takes the file over into a world, coloured by speed, in objects of at most so many particles;
 * *objects becomes their number. `thin`: as large as a world's file has them; else as large as
 * their smoothing lengths, half transparent: fog, of which every pixel shows dozens. */
VD_MUST_USE vd_status bench_cloud_add(vd_context *context, vd_world *world, const char *path,
                                      bool thin, uint64_t most, size_t *objects);

#endif

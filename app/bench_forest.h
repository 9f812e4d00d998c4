/* bench_forest.h: Mont Blanc with 1,000 trees of 504 triangles and 50 names, and a flight over it.
 */
#ifndef VEDUTA_APP_BENCH_FOREST_H
#define VEDUTA_APP_BENCH_FOREST_H

#include "bench.h"

typedef struct bench_forest {
    bench_scene s;
    vd_world *world;
    vd_world_renderer *renderer; /* null until bench_forest_renderer */
} bench_forest;

/* Particles in the air over the trees, in a cube of 1 km. */
typedef struct bench_forest_cloud {
    const char *path; /* their file, which is written if there is none */
    size_t count;
} bench_forest_cloud;

/* Makes the world as it is seen from a camera: the trees stand where it looks. `cloud` may be null.
 * A failure leaves what bench_forest_finish releases. */
VD_MUST_USE vd_status bench_forest_init(bench_forest *w, const bench_run *run,
                                        const bench_camera *camera, const bench_forest_cloud *cloud,
                                        vd_isa isa, int threads, int width, int height);

/* The middle of the trees, on the ground, metres. */
vd_vec3 bench_forest_middle(const bench_forest *w);
void bench_forest_finish(bench_forest *w);

/* Makes its renderer, of so many samples a pixel; there must be none. */
VD_MUST_USE vd_status bench_forest_renderer(bench_forest *w, int samples);

/* The camera of a picture of a flight at 60 m/s, 60 pictures a second, there and back in 4 s. */
#define BENCH_FLIGHT 240
vd_camera bench_forest_camera(const bench_forest *w, int frame);

#endif

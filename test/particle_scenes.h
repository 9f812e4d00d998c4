/* particle_scenes.h: brick files for tests of worlds. */
#ifndef VEDUTA_TEST_PARTICLE_SCENES_H
#define VEDUTA_TEST_PARTICLE_SCENES_H

#include <stdio.h>
#include <veduta/veduta.h>
#include "support.h"

/* Imports `count` particles around a middle, half of them evenly in a box and half in a ball of a
 * sixth of it, into `path`, and opens that. */
static inline vd_bricks *open_cloud(vd_context *context, const char *path, size_t count,
                                    vd_vec3 middle, vd_vec3 size, uint32_t leaf) {
    double(*rows)[4] = malloc(count * sizeof *rows);
    assert_non_null(rows);
    uint64_t seed = count;
    for (size_t i = 0; i < count; i++) {
        double p[3], square;
        do {
            square = 0.0;
            for (int k = 0; k < 3; k++) {
                p[k] = test_uniform(&seed) - 0.5;
                square += p[k] * p[k];
            }
        } while (i % 2 == 1 && square > 0.25);
        const double share = i % 2 == 1 ? 1.0 / 6 : 1.0;
        rows[i][0] = middle.x + size.x * share * p[0];
        rows[i][1] = middle.y + size.y * share * p[1];
        rows[i][2] = middle.z + size.z * share * p[2];
        rows[i][3] = test_uniform(&seed);
    }
    vd_particle_source_def def = vd_particle_source_def_default();
    def.raw = "f64";
    def.columns = "x,y,z,heat";
    const vd_bricks_def bricks_def = {.leaf_particles = leaf};
    vd_particle_source *source = NULL;
    vd_bricks *bricks = NULL;
    assert_ok(
        vd_particle_source_open_memory(context, rows, count * sizeof *rows, "rows", &def, &source));
    assert_ok(vd_bricks_import(context, NULL, &source, 1, &bricks_def, path, NULL));
    vd_particle_source_destroy(&source);
    assert_ok(vd_bricks_open(context, path, &bricks));
    free(rows);
    return bricks;
}

/* Blue, of half a metre, half transparent. */
static inline vd_particle_look cloud_look(void) {
    vd_particle_look look = vd_particle_look_default();
    look.constant = (vd_rgba8){60, 90, 250, 255};
    look.radius_m = 0.5;
    look.opacity = 0.5;
    return look;
}

/* Places a brick file in a world; `bricks` stays open for as long as the world. */
static inline size_t add_cloud(vd_world *world, vd_bricks *bricks, const vd_particle_look *look,
                               uint64_t most) {
    uint32_t number = 0;
    size_t count = 0;
    vd_bricks *given = bricks;
    assert_ok(vd_world_add_bricks(world, &given, look, &number));
    assert_null(given);
    assert_ok(vd_world_add_particles(world, number, most, &count));
    return count;
}

#endif

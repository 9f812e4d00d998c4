/* The sun past the terrain: against small steps over the exact surface, on random maps and a real
 * one; at edges, seams and holes; boxes. */
#include <math.h>
#include "core/real.h"
#include "lens_scenes.h"
#include "terrain/heightfield_block.h"
#include "world/hill_shade.h"

static vd_context *context;

static int set_up(void **state) {
    (void)state;
    context = test_context(1, VD_ISA_AUTO);
    return 0;
}

static int tear_down(void **state) {
    (void)state;
    vd_context_destroy(&context);
    return 0;
}

/* The least clearance of a ray over the ground per metre, in steps of `step`. */
static double least_clearance(const vd_heightfield *map, double exaggeration, vd_vec3 sun,
                              vd_vec3 point, double step, double end) {
    double least = INFINITY;
    for (double s = step; s < end; s += step) {
        const vd_vec3 at = vd_vec3_add(point, vd_vec3_scale(sun, s));
        const double ground = vd_heightfield_height_at(map, at.x, at.y) * exaggeration;
        least = fmin(least, (at.z - ground) / s);
        if (least < 0.0 || at.z > (double)map->max * exaggeration + s * VD_SUN_WIDTH) {
            break;
        }
    }
    return least;
}

/* Compares rays from points over a map with small steps; returns how many were dark. */
static int compare(const vd_heightfield *map, double exaggeration, uint64_t *random, int rays,
                   double highest) {
    const double *m = map->world_from_sample;
    const double cell = sqrt(fabs(m[1] * m[5] - m[2] * m[4]));
    int dark = 0;
    for (int i = 0; i < rays; i++) {
        const double column = between(random, -0.05, 1.05) * map->width;
        const double row = between(random, -0.05, 1.05) * map->height;
        vd_vec3 at = world_of(map, column, row, 0);
        const double ground = vd_heightfield_height_at(map, at.x, at.y);
        const bool on_ground = ground > -INFINITY && pick(random, 2) == 0;
        at.z = exaggeration * (on_ground ? ground : between(random, map->min, map->max));
        at.z = fmax(at.z, ground * exaggeration);
        const vd_vec3 sun =
            vd_sun_direction(between(random, 0, 6.3), between(random, 0.02, highest));
        const float share = vd_hill_shade(map, exaggeration, sun, at);
        assert_true(share >= 0.0f && share <= 1.0f);
        vd_vec3 from = at;
        from.z = fmax(at.z, ground * exaggeration + 0.001 * cell);
        const double reach = cell * 1.5 * (map->width + map->height);
        const double end = reach / sqrt(1 - sun.z * sun.z);
        double truth = least_clearance(map, exaggeration, sun, from, cell / 64, end);
        if (truth > 0.0 && share == 0.0f) { /* past the corner of a map or a cell, perhaps */
            truth = least_clearance(map, exaggeration, sun, from, cell / 16384, end);
        }
        dark += truth < 0.0;
        /* Steps may miss the sharpest corner. */
        const double slack = 0.02 * exaggeration;
        if (truth < -slack && share > 0.0f) {
            fail_msg("ray %d: share %g, but %g under ground", i, (double)share, truth);
        }
        if (truth > VD_SUN_WIDTH + slack && share < 1.0f) {
            fail_msg("ray %d: share %g, but clear by %g", i, (double)share, truth);
        }
        if (truth < 0.0 ? share > 0.15f : truth > 1e9 ? share != 1.0f : false) {
            fail_msg("ray %d: share %g, clearance %g", i, (double)share, truth);
        }
    }
    return dark;
}

static void follows_small_steps_on_random_maps(void **state) {
    (void)state;
    uint64_t random = 3;
    int dark = 0;
    for (int scene = 0; scene < 300; scene++) {
        vd_heightfield *map = random_map(context, &random);
        dark +=
            compare(map, pick(&random, 2) == 0 ? 1.0 : between(&random, 0.3, 3), &random, 15, 1.5);
        vd_heightfield_destroy(context, &map);
    }
    assert_in_range(dark, 300, 4000);
}

static void follows_small_steps_on_mont_blanc(void **state) {
    (void)state;
    vd_dem *dem = NULL;
    vd_heightfield *map = NULL;
    vd_dem_def def = vd_dem_def_default();
    def.cell_size_m = 75.0;
    assert_ok(vd_dem_load(context, VEDUTA_SOURCE_DIR "/data/mont-blanc.png", &def, &dem));
    assert_ok(vd_heightfield_from_dem(dem, NULL, NULL, &map));
    uint64_t random = 5;
    assert_in_range(compare(map, 1.5, &random, 400, 0.9), 40, 360);
    vd_heightfield_destroy(context, &map);
    vd_dem_destroy(&dem);
}

/* A wall of 10 m along column 4 of 40 × 40 cells of 2 m. */
static vd_heightfield *wall(vd_height_type type, bool wraps, float hole) {
    static float heights[1600];
    static uint8_t bytes[1600];
    for (int i = 0; i < 1600; i++) {
        heights[i] = i % 40 == 4 ? (i / 40 == 20 ? hole : 10.0f) : 0.0f;
        bytes[i] = i % 40 == 4 ? 10 : 0;
    }
    vd_heightfield_def def = vd_heightfield_def_default();
    def.width = def.height = def.height_stride = 40;
    def.type = type;
    def.heights = type == VD_HEIGHT_F32 ? (const void *)heights : bytes;
    def.wraps = wraps;
    const double place[6] = {100, 2, 0, 200, 0, -2};
    memcpy(def.world_from_sample, place, sizeof place);
    vd_heightfield *map = NULL;
    assert_ok(vd_heightfield_create(context, &def, &map));
    return map;
}

static void sees_walls_through_seams_and_holes(void **state) {
    (void)state;
    vd_heightfield *ends = wall(VD_HEIGHT_U8, false, 0), *wraps = wall(VD_HEIGHT_U8, true, 0);
    vd_heightfield *gap = wall(VD_HEIGHT_F32, false, -INFINITY);
    const vd_vec3 west = vd_sun_direction(vd_radians(270), vd_radians(30));
    const vd_vec3 east = vd_sun_direction(vd_radians(90), vd_radians(30));
    const vd_vec3 near = {114, 151, 0}, far = {140, 151, 0}, by_gap = {114, 160.2, 0};
    assert_float_equal(vd_hill_shade(ends, 1, west, near), 0, 0);
    assert_float_equal(vd_hill_shade(ends, 1, west, far), 1, 0);
    assert_float_equal(vd_hill_shade(ends, 3, west, far), 0, 0); /* a wall of 30 m */
    assert_float_equal(vd_hill_shade(ends, 1, west, vd_vec3_make(114, 151, 9)), 1, 0);
    assert_float_equal(vd_hill_shade(gap, 1, west, near), 0, 0);
    assert_float_equal(vd_hill_shade(gap, 1, west, by_gap), 1, 0);
    /* 12 m from the eastern edge, and then the wall again, 8 m beyond it. */
    const vd_vec3 edge = {172, 151, 0};
    assert_float_equal(vd_hill_shade(ends, 1, east, edge), 1, 0);
    assert_float_equal(vd_hill_shade(wraps, 1, east, edge), 0, 0);
    /* From outside, towards the map. */
    assert_float_equal(vd_hill_shade(ends, 1, east, vd_vec3_make(95, 151, 1)), 0, 0);
    assert_float_equal(vd_hill_shade(ends, 1, west, vd_vec3_make(95, 151, 1)), 1, 0);
    /* No sun; a sun straight above; one on the horizon over a map without end. */
    assert_float_equal(vd_hill_shade(ends, 1, vd_vec3_make(0, 1, 0), far), 0, 0);
    assert_float_equal(vd_hill_shade(ends, 1, vd_vec3_make(0, 0, -1), far), 0, 0);
    assert_float_equal(vd_hill_shade(ends, 1, vd_vec3_make(0, 0, 1), near), 1, 0);
    assert_in_range((int)vd_hill_shade(wraps, 1, vd_vec3_make(0, 1, 1e-12), far), 0, 1);
    assert_float_equal(vd_hill_shade(wraps, 1, vd_vec3_make(NAN, 1, 0.5), far), 1, 0);
    vd_heightfield_destroy(context, &ends);
    vd_heightfield_destroy(context, &wraps);
    vd_heightfield_destroy(context, &gap);
}

static void has_a_soft_edge(void **state) {
    (void)state;
    vd_heightfield *map = wall(VD_HEIGHT_U8, false, 0);
    const vd_vec3 west = vd_sun_direction(vd_radians(270), vd_radians(30));
    /* The shadow's tip lies at 108 + 10 / tan 30° = 125.32; it softens over 0.0093 · 20 m / sin. */
    float last = 0.0f;
    int between_both = 0;
    for (double x = 124; x < 127; x += 0.01) {
        const float share = vd_hill_shade(map, 1, west, vd_vec3_make(x, 151, 0));
        assert_true(share >= last - 1e-5f);
        between_both += share > 0.0f && share < 1.0f;
        last = share;
    }
    assert_float_equal(last, 1, 0);
    assert_in_range(between_both, 10, 60);
    vd_heightfield_destroy(context, &map);
}

static void tells_boxes(void **state) {
    (void)state;
    vd_heightfield *map = wall(VD_HEIGHT_U8, false, 0);
    const vd_vec3 west = vd_sun_direction(vd_radians(270), vd_radians(30));
    float least, most;
    assert_int_equal(vd_hill_shade_box(map, 1, west, vd_vec3_make(112, 150, 0),
                                       vd_vec3_make(113, 151, 2), &least, &most),
                     VD_HILL_SHADE_DARK);
    assert_int_equal(vd_hill_shade_box(map, 1, west, vd_vec3_make(150, 150, 0),
                                       vd_vec3_make(153, 151, 2), &least, &most),
                     VD_HILL_SHADE_LIT);
    assert_int_equal(vd_hill_shade_box(map, 1, west, vd_vec3_make(112, 150, 0),
                                       vd_vec3_make(113, 151, 20), &least, &most),
                     VD_HILL_SHADE_MIXED);
    assert_float_equal(least, 0, 0);
    assert_float_equal(most, 1, 0);
    vd_heightfield_destroy(context, &map);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(follows_small_steps_on_random_maps),
        cmocka_unit_test(follows_small_steps_on_mont_blanc),
        cmocka_unit_test(sees_walls_through_seams_and_holes),
        cmocka_unit_test(has_a_soft_edge),
        cmocka_unit_test(tells_boxes),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}

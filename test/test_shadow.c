/* Shadow counts: the twin against the published loops, walls whose shadow is known, colours. */
#include <math.h>
#include <stdio.h>
#include "core/real.h"
#include "support.h"
#include "terrain/shadow_internal.h"

static int rounds(int full) {
    return test_is_reduced() ? (full + 9) / 10 : full;
}

static vd_heightfield *make_map(vd_context *context, vd_height_type type, int width, int height,
                                const void *heights, bool wraps) {
    vd_heightfield_def def = vd_heightfield_def_default();
    vd_heightfield *map = NULL;
    def.type = type;
    def.width = width;
    def.height = height;
    def.heights = heights;
    def.height_stride = (size_t)width;
    def.wraps = wraps;
    assert_ok(vd_heightfield_create(context, &def, &map));
    return map;
}

#define MAX_SIDE 330

/* Hills, cliffs, plains or noise; some float maps have holes. */
static void random_heights(uint64_t *random, vd_height_type type, int count, int width, void *out) {
    const double range = type == VD_HEIGHT_U8    ? 255
                         : type == VD_HEIGHT_U16 ? (test_random(random) % 2 ? 65535 : 900)
                                                 : 500;
    const int kind = (int)(test_random(random) % 5);
    const double a = test_uniform(random) * 0.2, b = test_uniform(random) * 0.2;
    for (int i = 0; i < count; i++) {
        const double x = i % width, y = i / width, u = test_uniform(random);
        double h = kind == 0   ? u
                   : kind == 1 ? 0.5 + 0.25 * sin(x * a) + 0.25 * cos(y * b)
                   : kind == 2 ? (u < 0.002 ? 1.0 : 0.1)
                   : kind == 3 ? (fmod(x, 40) < 2 ? 0.9 : 0.2 + 0.01 * u)
                               : 0.5;
        if (type == VD_HEIGHT_U8) {
            ((uint8_t *)out)[i] = (uint8_t)(h * range);
        } else if (type == VD_HEIGHT_U16) {
            ((uint16_t *)out)[i] = (uint16_t)(h * range);
        } else {
            ((float *)out)[i] = kind == 1 && u < 0.01 ? NAN : (float)((h - 0.5) * range);
        }
    }
}

static double random_angle(uint64_t *random, double most, int steps) {
    const uint64_t r = test_random(random);
    return r % 3 == 0 ? most * (double)((r >> 8) % (uint64_t)(steps + 1)) / steps
                      : most * test_uniform(random);
}

static vd_shadow_def random_def(uint64_t *random) {
    vd_shadow_def def = vd_shadow_def_default();
    def.azimuth_rad = random_angle(random, 2 * VD_PI, 8) - (test_random(random) % 2 ? 50 : 0);
    def.altitude_rad = random_angle(random, 0.5 * VD_PI, 4);
    if (test_random(random) % 2 == 0) {
        def.altitude_rad *= 0.1;
    }
    const uint64_t r = test_random(random);
    def.cell = r % 4 == 0 ? 0.1 + 30 * test_uniform(random) : r % 4 == 1 ? 1.0 / 64 : 1;
    def.steps = r % 3 == 0 ? 1 + (int)((r >> 8) % 255) : 255;
    def.stride = r % 5 == 0 ? 0.25 + 9 * test_uniform(random) : 4;
    def.edge = (vd_shadow_edge)((r >> 20) % 3);
    if (r >> 30 & 1) { /* the general form */
        def.step_columns = 9.0 * test_uniform(random) - 4.5;
        def.step_rows = r >> 31 & 1 ? 9.0 * test_uniform(random) - 4.5 : 0.0;
        def.step_rise = r >> 32 & 1 ? 5.0 * test_uniform(random) : 0.0;
    }
    return def;
}

static void shift_equals_the_reference(void **state) {
    (void)state;
    static const int sizes[] = {1,  2,  3,  7,   8,   15,  16,  17,  31, 33,
                                63, 64, 65, 100, 127, 129, 200, 257, 330};
    static float heights[MAX_SIDE * MAX_SIDE];
    static uint8_t expected[MAX_SIDE * (MAX_SIDE + 3)], got[MAX_SIDE * (MAX_SIDE + 3)];
    const int threads[] = {1, 2, 7};
    vd_context *contexts[VD_ISA_COUNT][3] = {{NULL}};
    for (int isa = VD_ISA_V2; isa <= (int)vd_isa_best(); isa++) {
        for (int t = 0; t < 3; t++) {
            contexts[isa][t] = test_context(threads[t], (vd_isa)isa);
        }
    }
    uint64_t random = 8, counted = 0;
    for (int round = 0; round < rounds(700); round++) {
        const int limit = round % 20 == 0 ? 19 : 14;
        const int width = sizes[test_random(&random) % (uint64_t)limit];
        const int height = sizes[test_random(&random) % (uint64_t)limit];
        const vd_height_type type = (vd_height_type)(round % 3);
        random_heights(&random, type, width * height, width, heights);
        vd_context *context = contexts[VD_ISA_V2][0];
        vd_heightfield *map =
            make_map(context, type, width, height, heights, test_random(&random) % 2 == 0);
        vd_shadow_def def = random_def(&random);
        const size_t stride = (size_t)width + test_random(&random) % 4;
        memset(expected, 0xEE, sizeof expected);
        def.method = VD_SHADOW_REFERENCE;
        assert_ok(vd_shadow_count(context, NULL, map, &def, expected, stride));
        for (int i = 0; i < width * height; i++) {
            counted += expected[(size_t)(i / width) * stride + (size_t)(i % width)];
        }
        def.method = VD_SHADOW_SHIFT;
        for (int isa = VD_ISA_V2; isa <= (int)vd_isa_best(); isa++) {
            const int t = round % 3;
            memset(got, 0xEE, sizeof got);
            assert_ok(vd_shadow_count(contexts[isa][t], NULL, map, &def, got, stride));
            if (memcmp(got, expected, sizeof got) != 0) {
                size_t at = 0;
                while (got[at] == expected[at]) {
                    at++;
                }
                fail_msg("round %d, type %d, %d × %d, azimuth %g, altitude %g, cell %g, stride %g, "
                         "edge %d, level %s: (%zu, %zu) is %d, not %d",
                         round, type, width, height, def.azimuth_rad, def.altitude_rad, def.cell,
                         def.stride, def.edge, vd_isa_name((vd_isa)isa), at % stride, at / stride,
                         got[at], expected[at]);
            }
        }
        vd_heightfield_destroy(context, &map);
    }
    assert_true(counted > 100000);
    for (int isa = VD_ISA_V2; isa <= (int)vd_isa_best(); isa++) {
        for (int t = 0; t < 3; t++) {
            vd_context_destroy(&contexts[isa][t]);
        }
    }
}

/* Large maps are counted band by band; here the bands are as short as the rays' reach allows. */
static void bands_join_without_a_seam(void **state) {
    (void)state;
    static uint8_t heights[70 * 1500], whole[70 * 1500], banded[70 * 1500];
    static _Alignas(64) uint8_t lent[400000];
    vd_context *context = test_context(2, VD_ISA_AUTO);
    uint64_t random = 9;
    int taken = 0;
    for (int round = 0; round < rounds(60); round++) {
        random_heights(&random, VD_HEIGHT_U8, 70 * 1500, 70, heights);
        vd_heightfield *map = make_map(context, VD_HEIGHT_U8, 70, 1500, heights, round % 2 == 0);
        vd_shadow_def def = random_def(&random);
        def.steps = 1 + (def.steps - 1) / (1 + round % 9);
        vd_shadow_plan plan;
        assert_ok(vd_shadow_make_plan(map, &def, 70, &plan));
        assert_ok(vd_shadow_count(context, NULL, map, &def, whole, 70));
        plan.slab_bytes = 1;
        assert_ok(vd_shadow_count_shift(context, NULL, map, &plan, banded, 70));
        assert_memory_equal(banded, whole, sizeof whole);
        /* In memory that is lent, as much as there is; what is behind it stays as it is. */
        plan.slab_bytes = 1 << 20;
        plan.scratch = lent;
        plan.scratch_bytes = (size_t)(test_random(&random) % (sizeof lent - 64));
        memset(lent, 0xA5, sizeof lent);
        memset(banded, 0xFF, sizeof banded);
        assert_ok(vd_shadow_count_shift(context, NULL, map, &plan, banded, 70));
        assert_memory_equal(banded, whole, sizeof whole);
        for (size_t i = plan.scratch_bytes; i < sizeof lent; i++) {
            assert_int_equal(lent[i], 0xA5);
        }
        taken += lent[0] != 0xA5 || lent[200] != 0xA5;
        vd_heightfield_destroy(context, &map);
    }
    assert_true(taken > 0);
    vd_context_destroy(&context);
}

/* An endless wall of height H in the row or column w, ground 0: a cell d samples behind it (seen
 * from the sun) is under at step k when dx(k) = d and k·4·sin(altitude) < H. */
static void walls_throw_shadows_of_known_length(void **state) {
    (void)state;
    enum { SIDE = 300 };
    static uint8_t heights[SIDE * SIDE], counts[SIDE * SIDE];
    vd_context *context = test_context(2, VD_ISA_AUTO);
    for (int azimuth = 0; azimuth < 360; azimuth += 90) {
        for (int altitude = 5; altitude < 90; altitude += 10) {
            const int wall = azimuth == 0 || azimuth == 270 ? 20 : SIDE - 21; /* near the sun */
            const bool along_rows = azimuth == 90 || azimuth == 270;
            memset(heights, 0, sizeof heights);
            for (int i = 0; i < SIDE; i++) {
                for (int thick = 0; thick < 4; thick++) { /* a step cannot leap over it */
                    const int w = wall < SIDE / 2 ? wall - thick : wall + thick;
                    heights[along_rows ? i * SIDE + w : w * SIDE + i] = 100;
                }
            }
            vd_heightfield *map = make_map(context, VD_HEIGHT_U8, SIDE, SIDE, heights, false);
            vd_shadow_def def = vd_shadow_def_default();
            def.azimuth_rad = vd_radians(azimuth);
            def.altitude_rad = vd_radians(altitude);
            assert_ok(vd_shadow_count(context, NULL, map, &def, counts, SIDE));
            int length = 0;
            for (int d = 1; d < SIDE - 25; d++) { /* in the middle of the wall, going away */
                const int at = wall < SIDE / 2 ? wall + d : wall - d;
                const int i = along_rows ? SIDE / 2 * SIDE + at : at * SIDE + SIDE / 2;
                int expected = 0;
                for (int k = 1; k <= 255; k++) {
                    const double moved = floor(4 * k * cos(vd_radians(altitude)) + 0.5);
                    expected +=
                        moved >= d && moved < d + 4 && 4 * k * sin(vd_radians(altitude)) < 100;
                }
                assert_int_equal(counts[i], expected);
                length = counts[i] > 0 ? d : length;
            }
            /* the analytic length H / tan(altitude), within a step */
            const double exact = 100 / tan(vd_radians(altitude));
            assert_true(exact > SIDE - 30 || fabs(length - exact) < 5);
            vd_heightfield_destroy(context, &map);
        }
    }
    vd_context_destroy(&context);
}

static void suns_at_the_ends_of_the_sky(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    float heights[64 * 64];
    uint8_t counts[64 * 64];
    for (int i = 0; i < 64 * 64; i++) {
        heights[i] = i % 64 == 40 ? 50.0f : i % 64 == 10 && i / 64 == 5 ? -INFINITY : 0.0f;
    }
    vd_heightfield *map = make_map(context, VD_HEIGHT_F32, 64, 64, heights, false);
    vd_shadow_def def = vd_shadow_def_default();
    def.altitude_rad = 0.5 * VD_PI; /* overhead: no shadow */
    assert_ok(vd_shadow_count(context, NULL, map, &def, counts, 64));
    for (int i = 0; i < 64 * 64; i++) {
        assert_int_equal(counts[i], 0);
    }
    def.altitude_rad = 0; /* level, from the east: 40 − 16 = 24 is 6 steps of 4 from column 40 */
    def.azimuth_rad = vd_radians(90);
    assert_ok(vd_shadow_count(context, NULL, map, &def, counts, 64));
    assert_int_equal(counts[20 * 64 + 16], 1);
    assert_int_equal(counts[20 * 64 + 17], 0);
    assert_int_equal(counts[20 * 64 + 44], 0);
    assert_int_equal(counts[5 * 64 + 10], 0); /* the hole */
    def.edge = VD_SHADOW_EDGE_WRAP;           /* every 16 steps around the map meet it again */
    assert_ok(vd_shadow_count(context, NULL, map, &def, counts, 64));
    assert_int_equal(counts[20 * 64 + 16], 16);
    assert_int_equal(counts[20 * 64 + 44], 16); /* 15 steps from 44 over the edge to 40 */
    vd_heightfield_destroy(context, &map);
    vd_context_destroy(&context);
}

static void published_curve_mixes_squares(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    uint8_t counts[256];
    vd_rgba8 colors[256], out[256];
    for (int i = 0; i < 256; i++) {
        counts[i] = (uint8_t)i;
        colors[i] = (vd_rgba8){255, 180, 7, (uint8_t)i};
    }
    assert_ok(
        vd_shadow_bake(context, counts, 16, VD_SHADOW_PUBLISHED, 16, 16, colors, 16, out, 16));
    assert_int_equal(out[0].r, 255);
    assert_int_equal(out[1].r, 180); /* as Matte's own example: 255/√2 */
    assert_int_equal(out[3].g, 90);
    assert_int_equal(out[48].b, 1);
    assert_int_equal(out[255].r, 15);
    assert_int_equal(out[77].a, 77);
    assert_ok(vd_shadow_bake(context, counts, 16, VD_SHADOW_SOFT, 16, 16, colors, 16, out, 16));
    for (int i = 0; i < 255; i++) {
        assert_true(out[i].r >= out[i + 1].r && out[i].g >= out[i + 1].g);
        assert_true(vd_shadow_share(VD_SHADOW_SOFT, (uint8_t)i) >= 0.35f);
    }
    assert_true(out[0].r == 255 && out[0].g == 180 && out[0].b == 7 && out[255].r == 89);
    assert_int_equal(
        vd_shadow_bake(context, counts, 15, VD_SHADOW_SOFT, 16, 16, colors, 16, out, 16).code,
        VD_ERROR_ARGUMENT);
    vd_context_destroy(&context);
}

static void heightfields_are_baked(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    vd_picture *colors = NULL;
    assert_ok(vd_picture_create(context, 8, 6, 3, 8, &colors)); /* twice the map's size */
    for (int y = 0; y < 6; y++) {
        memset((uint8_t *)colors->data + (size_t)y * colors->stride_bytes, 200, 24);
    }
    const float heights[12] = {0};
    vd_heightfield_def def = vd_heightfield_def_default();
    def.width = 4;
    def.height = 3;
    def.heights = heights;
    def.height_stride = 4;
    def.colors = colors;
    vd_heightfield *map = NULL;
    assert_ok(vd_heightfield_create(context, &def, &map));
    uint8_t counts[12] = {0};
    counts[1 * 4 + 2] = 3;
    assert_ok(vd_shadow_bake_heightfield(context, counts, 4, VD_SHADOW_PUBLISHED, map));
    assert_ok(vd_heightfield_validate(map, map->size_bytes));
    for (int y = 0; y < 6; y++) {
        for (int x = 0; x < 8; x++) {
            const vd_rgba8 c =
                vd_heightfield_colors(map)[(size_t)y * map->color_stride + (size_t)x];
            assert_int_equal(c.r, x / 2 == 2 && y / 2 == 1 ? 100 : 200);
            assert_int_equal(c.a, 255);
        }
    }
    vd_heightfield_destroy(context, &map);
    vd_picture_destroy(&colors);
    map = make_map(context, VD_HEIGHT_F32, 4, 3, heights, false);
    assert_int_equal(vd_shadow_bake_heightfield(context, counts, 4, VD_SHADOW_SOFT, map).code,
                     VD_ERROR_ARGUMENT);
    vd_heightfield_destroy(context, &map);
    vd_context_destroy(&context);
}

static void wrong_fields_are_named(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    const uint8_t heights[4] = {1, 2, 3, 4};
    uint8_t counts[4];
    vd_heightfield *map = make_map(context, VD_HEIGHT_U8, 2, 2, heights, true);
    static const struct {
        const char *name;
        double azimuth, altitude, cell, stride;
        int steps, edge;
        size_t counts_stride;
    } cases[] = {
        {"azimuth_rad", NAN, 0, 1, 4, 255, 0, 2},
        {"azimuth_rad", INFINITY, 0, 1, 4, 255, 0, 2},
        {"altitude_rad", 0, -0.1, 1, 4, 255, 0, 2},
        {"altitude_rad", 0, 1.6, 1, 4, 255, 0, 2},
        {"altitude_rad", 0, NAN, 1, 4, 255, 0, 2},
        {"cell", 0, 0, 0, 4, 255, 0, 2},
        {"stride", 0, 0, 1, 0, 255, 0, 2},
        {"stride", 0, 0, 1, 65, 255, 0, 2},
        {"steps", 0, 0, 1, 4, 0, 0, 2},
        {"steps", 0, 0, 1, 4, 256, 0, 2},
        {"edge", 0, 0, 1, 4, 255, 3, 2},
        {"stride", 0, 0, 1, 4, 255, 0, 1},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        vd_shadow_def def = vd_shadow_def_default();
        def.azimuth_rad = cases[i].azimuth;
        def.altitude_rad = cases[i].altitude;
        def.cell = cases[i].cell;
        def.stride = cases[i].stride;
        def.steps = cases[i].steps;
        def.edge = (vd_shadow_edge)cases[i].edge;
        const vd_status status =
            vd_shadow_count(context, NULL, map, &def, counts, cases[i].counts_stride);
        assert_int_equal(status.code, VD_ERROR_ARGUMENT);
        assert_non_null(strstr(status.message, cases[i].name));
    }
    assert_int_equal(vd_shadow_count(context, NULL, NULL, NULL, counts, 2).code, VD_ERROR_ARGUMENT);
    vd_heightfield_destroy(context, &map);
    vd_context_destroy(&context);
}

static void memory_may_end_and_jobs_be_cancelled(void **state) {
    (void)state;
    const uint8_t heights[4] = {1, 200, 3, 4};
    uint8_t counts[4];
    vd_shadow_def def = vd_shadow_def_default();
    for (int fail_at = 1; fail_at <= 2; fail_at++) {
        test_allocator allocator = {0, 0, 0};
        vd_context *context = test_failing_context(&allocator);
        vd_heightfield *map = make_map(context, VD_HEIGHT_U8, 2, 2, heights, true);
        const int before = allocator.live;
        allocator.calls = 0;
        allocator.fail_at = fail_at;
        const vd_status status = vd_shadow_count(context, NULL, map, &def, counts, 2);
        assert_int_equal(status.code, fail_at < 2 ? VD_ERROR_MEMORY : VD_OK);
        assert_int_equal(allocator.live, before);
        vd_heightfield_destroy(context, &map);
        vd_context_destroy(&context);
    }
    vd_context *context = test_context(2, VD_ISA_AUTO);
    vd_job *job = NULL;
    assert_ok(vd_job_create(context, &job));
    vd_job_cancel(job);
    vd_heightfield *map = make_map(context, VD_HEIGHT_U8, 2, 2, heights, true);
    for (int method = 0; method < VD_SHADOW_METHOD_COUNT; method++) {
        def.method = (vd_shadow_method)method;
        assert_int_equal(vd_shadow_count(context, job, map, &def, counts, 2).code,
                         VD_ERROR_CANCELLED);
    }
    vd_heightfield_destroy(context, &map);
    vd_job_destroy(&job);
    vd_context_destroy(&context);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(shift_equals_the_reference),
        cmocka_unit_test(bands_join_without_a_seam),
        cmocka_unit_test(walls_throw_shadows_of_known_length),
        cmocka_unit_test(suns_at_the_ends_of_the_sky),
        cmocka_unit_test(published_curve_mixes_squares),
        cmocka_unit_test(heightfields_are_baked),
        cmocka_unit_test(wrong_fields_are_named),
        cmocka_unit_test(memory_may_end_and_jobs_be_cancelled),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

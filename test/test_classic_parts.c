/* test_classic_parts.c: what the classic picture is made of: the monoids by exhaustion, exact
 * remainders, the schedules, the counts, the camera; and what must be refused. */
#include "classic_scenes.h"
#include "core/real.h"
#include "terrain/classic_internal.h"

/* ---- the pieces ------------------------------------------------------------------------------ */

static bool same_pair(vd_classic_pair a, vd_classic_pair b) {
    return memcmp(&a, &b, sizeof a) == 0;
}

/* Associativity and the neutral element of both operators over every triple of a small domain:
 * colours (the sky's among them), depths, rows, and none. */
static void operators_are_monoids(void **state) {
    (void)state;
    vd_classic_pair domain[32];
    size_t count = 0;
    domain[count++] = vd_classic_pair_none();
    for (int color = 0; color < 3; color++) {
        for (int row = 0; row < 4; row++) {
            for (int depth = 0; depth < 2; depth++) {
                vd_classic_pair pair = {{(uint8_t)color, 0, 0, 255}, (float)depth, row, 1};
                if (color == 2) {
                    pair.color = SKY;
                }
                domain[count++] = pair;
            }
        }
    }
    vd_classic_pair (*const operators[])(vd_classic_pair, vd_classic_pair) = {vd_classic_occlude,
                                                                              vd_classic_fill};
    for (size_t o = 0; o < 2; o++) {
        for (size_t i = 0; i < count; i++) {
            vd_classic_pair a = domain[i];
            assert_true(same_pair(operators[o](vd_classic_pair_none(), a), a));
            assert_true(same_pair(operators[o](a, vd_classic_pair_none()), a));
            for (size_t j = 0; j < count; j++) {
                vd_classic_pair ab = operators[o](a, domain[j]);
                for (size_t k = 0; k < count; k++) {
                    vd_classic_pair bc = operators[o](domain[j], domain[k]);
                    assert_true(same_pair(operators[o](ab, domain[k]), operators[o](a, bc)));
                }
            }
        }
    }
    /* Neither commutes: the order of the slices and rows matters. */
    assert_false(same_pair(vd_classic_occlude(domain[1], domain[9]),
                           vd_classic_occlude(domain[9], domain[1])));
    assert_false(
        same_pair(vd_classic_fill(domain[1], domain[9]), vd_classic_fill(domain[9], domain[1])));
}

static void wrap_is_exact(void **state) {
    (void)state;
    const int sizes[] = {1, 2, 3, 37, 1000, 1024, 65535};
    uint64_t seed = 5;
    for (size_t s = 0; s < sizeof sizes / sizeof sizes[0]; s++) {
        int size = sizes[s], mask = (size & (size - 1)) == 0 ? size - 1 : -1;
        for (int i = 0; i < 20000; i++) {
            /* any float at all, and whole numbers and their neighbours */
            uint32_t bits = (uint32_t)test_random(&seed);
            float p;
            memcpy(&p, &bits, sizeof p);
            if (i % 2 == 0) {
                p = (float)((int)(bits % 4001) - 2000) * (float)size;
                p = i % 4 == 0 ? nextafterf(p, -INFINITY) : p;
            }
            double rest = fmod(floor((double)p), size);
            int expected = isfinite(p) ? (int)(rest < 0.0 ? rest + size : rest) : -1;
            if (vd_classic_wrap(p, size, mask) != expected ||
                vd_classic_wrap(p, size, -1) != expected) {
                fail_msg("floor(%a) mod %d: %d, not %d", (double)p, size,
                         vd_classic_wrap(p, size, mask), expected);
            }
        }
    }
    assert_int_equal(vd_classic_wrap(NAN, 8, 7), -1);
    assert_int_equal(vd_classic_wrap(-INFINITY, 8, 7), -1);
}

static void truncation_saturates(void **state) {
    (void)state;
    assert_int_equal(vd_classic_truncate(2.9f), 2);
    assert_int_equal(vd_classic_truncate(-2.9f), -2);
    assert_int_equal(vd_classic_truncate(2147483520.0f), 2147483520);
    assert_int_equal(vd_classic_truncate(2147483648.0f), INT32_MAX);
    assert_int_equal(vd_classic_truncate(INFINITY), INT32_MAX);
    assert_int_equal(vd_classic_truncate(-2147483648.0f), INT32_MIN);
    assert_int_equal(vd_classic_truncate(-3e9f), INT32_MIN);
    assert_int_equal(vd_classic_truncate(-INFINITY), INT32_MIN);
    assert_int_equal(vd_classic_truncate(NAN), INT32_MAX);
}

/* Equations 4.1 and 4.2 of the thesis. */
static void growing_schedule(void **state) {
    (void)state;
    vd_classic_setup setup = {
        .scale = 240.0f, .z0 = 1.0f, .z0_exact = 1.0, .step_exact = 1.0, .growth = 0.005};
    const float first[] = {1.0f, 2.005f, 3.015f, 4.03f};
    vd_classic_slice slice = vd_classic_slice_first(&setup);
    for (int k = 1; k <= 2000; k++) {
        double z = k / 2.0 * (2.0 + (k - 1) * 0.005);
        assert_true(fabs(slice.z_exact - z) < 1e-9 * z);
        assert_true(slice.z == (float)slice.z_exact);
        assert_true(slice.rise == 240.0f / slice.z);
        if (k <= 4) {
            assert_true(slice.z == first[k - 1]);
        }
        vd_classic_slice_next(&setup, &slice);
    }
    const double distances[] = {10, 100, 800, 1000, 12345, 1e6};
    for (size_t i = 0; i < sizeof distances / sizeof distances[0]; i++) {
        vd_classic_def def = vd_classic_def_default();
        def.step = 1.0;
        def.growth = 0.005;
        def.distance = distances[i];
        double n = floor((sqrt(1.995 * 1.995 + 0.04 * def.distance) - 1.995) / 0.01);
        assert_int_equal(vd_classic_slice_count(&def), (uint64_t)n);
    }
}

static void constant_schedule(void **state) {
    (void)state;
    vd_classic_def def = vd_classic_def_default();
    assert_int_equal(vd_classic_slice_count(&def), 99990);
    const double steps[] = {0.1, 0.3, 1, 7, 33.3};
    for (size_t i = 0; i < sizeof steps / sizeof steps[0]; i++) {
        def.step = steps[i];
        def.distance = 3000;
        uint64_t count = 0;
        while (1.0f + (float)count * (float)def.step < 3000.0f) {
            count++;
        }
        assert_int_equal(vd_classic_slice_count(&def), count);
    }
    def.distance = 0.5;
    assert_int_equal(vd_classic_slice_count(&def), 0);
    def.step = 1.0;
    def.distance = 1e30;
    assert_int_equal(vd_classic_slice_count(&def), INT32_MAX);
}

static void counts_are_those_of_the_trees(void **state) {
    (void)state;
    vd_classic_counts expected = {.slices = 64, .columns = 33, .rows = 32, .pairs = 64 * 33};
    /* A full tree of n leaves: n − 1 up, n − 1 − log2 n down; log2 n levels up, one less down. */
    expected.occlude = 33 * (63 + 63 - 6);
    expected.fill = 33 * (31 + 31 - 5);
    expected.span = (6 + 5) + (5 + 4);
    for (int threads = 1; threads <= 4; threads++) {
        vd_context *context = test_context(threads, VD_ISA_AUTO);
        vd_heightfield *map = make_map(context, small_map);
        vd_classic_def def = small_def(78.0);
        def.step = 1.0;
        def.distance = 65.0;
        vd_frame *frame = NULL;
        assert_ok(vd_frame_create(context, 33, 32, 0, &frame));
        vd_classic_counts counts;
        memset(&counts, 0xFF, sizeof counts);
        assert_ok(vd_classic_render(context, NULL, map, &def, VD_CLASSIC_SCAN, frame, &counts));
        if (threads == 1) {
            expected.scatter = counts.scatter; /* depends on the map */
            assert_in_range(counts.scatter, 33, counts.pairs);
        }
        assert_memory_equal(&counts, &expected, sizeof counts);
        vd_frame_destroy(&frame);
        vd_heightfield_destroy(context, &map);
        vd_context_destroy(&context);
    }
}

/* The table of docs/voxel-space.md. Only the scattered pairs depend on the map. */
static void counts_are_those_of_the_docs(void **state) {
    (void)state;
    const struct {
        double distance, step, growth;
        vd_classic_counts counts; /* slices, columns, rows, pairs, occlude, scatter, fill, span */
    } rows[] = {
        {10000, 0.1, 0, {99990, 16, 512, 1599840, 3199280, 1597037, 16208, 50}},
        {10000, 0.1, 0, {99990, 32, 512, 3199680, 6398560, 3194074, 32416, 50}},
        {10000, 0.1, 0, {99990, 16, 1024, 1599840, 3199280, 1598690, 32576, 52}},
        {5000, 0.1, 0, {49990, 16, 512, 799840, 1599312, 797037, 16208, 48}},
        {800, 1, 0.005, {400, 16, 512, 6400, 12608, 6123, 16208, 34}},
        {10000, 1, 0.005, {1810, 16, 512, 28960, 57664, 28683, 16208, 38}},
        {1000000, 1, 0.005, {19801, 16, 512, 316816, 633264, 316539, 16208, 45}},
    };
    vd_context *context = test_context(2, VD_ISA_AUTO);
    vd_heightfield *map = make_map(context, (map_kind){256, 256, VD_HEIGHT_U8, 1992});
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        vd_classic_def def = vd_classic_def_default();
        def.distance = rows[i].distance;
        def.step = rows[i].step;
        def.growth = rows[i].growth;
        vd_frame *frame = NULL;
        assert_ok(vd_frame_create(context, (int)rows[i].counts.columns, (int)rows[i].counts.rows, 0,
                                  &frame));
        vd_classic_counts c;
        assert_ok(vd_classic_render(context, NULL, map, &def, VD_CLASSIC_SCAN, frame, &c));
        if (memcmp(&c, &rows[i].counts, sizeof c) != 0) {
            fail_msg("row %zu: {%llu, %llu, %llu, %llu, %llu, %llu, %llu, %llu}", i,
                     (unsigned long long)c.slices, (unsigned long long)c.columns,
                     (unsigned long long)c.rows, (unsigned long long)c.pairs,
                     (unsigned long long)c.occlude, (unsigned long long)c.scatter,
                     (unsigned long long)c.fill, (unsigned long long)c.span);
        }
        vd_frame_destroy(&frame);
    }
    vd_heightfield_destroy(context, &map);
    vd_context_destroy(&context);
}

/* Where the thesis' scan would take terrain of the background's colour for an empty pixel and let
 * what is above run over it. */
static void sky_coloured_terrain_is_kept(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    vd_heightfield *map = make_map(context, small_map);
    vd_classic_def def = small_def(200.0);
    vd_frame *frame = NULL;
    assert_ok(vd_frame_create(context, 97, 61, VD_PLANE_ID, &frame));
    assert_ok(vd_classic_render(context, NULL, map, &def, VD_CLASSIC_SCAN, frame, NULL));
    int under_other_terrain = 0;
    for (int row = 1; row < frame->height; row++) {
        for (int i = 0; i < frame->width; i++) {
            size_t at = (size_t)row * frame->stride + (size_t)i, above = at - frame->stride;
            under_other_terrain += frame->id[at] == 1 && frame->id[above] == 1 &&
                                   memcmp(frame->rgba + 4 * at, &SKY, 3) == 0 &&
                                   memcmp(frame->rgba + 4 * above, &SKY, 3) != 0;
        }
    }
    assert_true(under_other_terrain > 100);
    vd_frame_destroy(&frame);
    vd_heightfield_destroy(context, &map);
    vd_context_destroy(&context);
}

/* A map point on column i's ray lands at the column's centre, its row half a pixel above the real
 * number that the classic picture truncates, its depth the classic depth. */
static void camera_sees_the_same(void **state) {
    (void)state;
    const double yaws[] = {0, 30, 90, 200, -77};
    uint64_t seed = 11;
    for (size_t y = 0; y < sizeof yaws / sizeof yaws[0]; y++) {
        vd_classic_def def = vd_classic_def_default();
        def.yaw_rad = vd_radians(yaws[y]);
        def.view = 0.5 + (double)y * 0.4;
        const int width = 700;
        vd_camera camera = vd_classic_camera(&def, width, 512);
        assert_ok(vd_camera_validate(&camera));
        double s = sin(def.yaw_rad), c = cos(def.yaw_rad);
        double left[2] = {-c - s * def.view, s - c * def.view};
        double right[2] = {c - s * def.view, -s - c * def.view};
        for (int n = 0; n < 200; n++) {
            int i = (int)(test_random(&seed) % (unsigned)width);
            double z = 1.0 + test_uniform(&seed) * 5000.0, h = test_uniform(&seed) * 118.0;
            double px = def.x + z * (left[0] + i * (right[0] - left[0]) / width);
            double py = def.y + z * (left[1] + i * (right[1] - left[1]) / width);
            double x, row, axial;
            assert_true(vd_camera_project(&camera, vd_vec3_make(px, -py, h), &x, &row, &axial));
            assert_true(fabs(x - (i + 0.5)) < 1e-6);
            assert_true(fabs(row - ((def.height - h) * def.scale / z + def.horizon - 0.5)) < 1e-6);
            assert_true(fabs(axial - def.view * z) < 1e-6);
            assert_true(fabs((double)vd_camera_depth(&camera, axial) - def.z0 / z) < 1e-6);
        }
    }
}

/* ---- what is refused ------------------------------------------------------------------------- */

static void expect_refusal(vd_context *context, const vd_heightfield *map, vd_classic_def def,
                           vd_code code, const char *word) {
    vd_frame *frame = NULL;
    assert_ok(vd_frame_create(context, 4, 4, 0, &frame));
    for (int method = 0; method < VD_CLASSIC_METHOD_COUNT; method++) {
        vd_status status =
            vd_classic_render(context, NULL, map, &def, (vd_classic_method)method, frame, NULL);
        if (status.code != code || strstr(status.message, word) == NULL) {
            fail_msg("expected %s naming %s, got %s: %s", vd_code_name(code), word,
                     vd_code_name(status.code), status.message);
        }
        assert_int_equal(frame->rgba[0], 0);
    }
    vd_frame_destroy(&frame);
}

static void bad_defs(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    vd_heightfield *map = make_map(context, small_map);
    const struct {
        const char *word;
        size_t offset;
        double value;
        vd_code code;
    } bad[] = {
        {"x is nan", offsetof(vd_classic_def, x), NAN, VD_ERROR_ARGUMENT},
        {"y is inf", offsetof(vd_classic_def, y), INFINITY, VD_ERROR_ARGUMENT},
        {"height", offsetof(vd_classic_def, height), 1e39, VD_ERROR_ARGUMENT},
        {"yaw", offsetof(vd_classic_def, yaw_rad), NAN, VD_ERROR_ARGUMENT},
        {"horizon", offsetof(vd_classic_def, horizon), -1e300, VD_ERROR_ARGUMENT},
        {"scale", offsetof(vd_classic_def, scale), NAN, VD_ERROR_ARGUMENT},
        {"view", offsetof(vd_classic_def, view), 0, VD_ERROR_ARGUMENT},
        {"view", offsetof(vd_classic_def, view), -1, VD_ERROR_ARGUMENT},
        {"distance", offsetof(vd_classic_def, distance), INFINITY, VD_ERROR_ARGUMENT},
        {"z0", offsetof(vd_classic_def, z0), 0, VD_ERROR_ARGUMENT},
        {"z0", offsetof(vd_classic_def, z0), 1e-60, VD_ERROR_ARGUMENT},
        {"step", offsetof(vd_classic_def, step), 0, VD_ERROR_ARGUMENT},
        {"step", offsetof(vd_classic_def, step), -0.1, VD_ERROR_ARGUMENT},
        {"step", offsetof(vd_classic_def, step), 1e-60, VD_ERROR_ARGUMENT},
        {"growth", offsetof(vd_classic_def, growth), NAN, VD_ERROR_ARGUMENT},
        {"never reaches", offsetof(vd_classic_def, growth), -0.01, VD_ERROR_ARGUMENT},
        {"more than 2147483647 slices", offsetof(vd_classic_def, step), 1e-7, VD_ERROR_LIMIT},
    };
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        vd_classic_def def = vd_classic_def_default();
        memcpy((char *)&def + bad[i].offset, &bad[i].value, sizeof bad[i].value);
        expect_refusal(context, map, def, bad[i].code, bad[i].word);
    }
    /* schedules that grow but do not arrive: too small for the double they are added to, too slow
     */
    vd_classic_def def = vd_classic_def_default();
    def.z0 = 1e17;
    def.distance = 1e17 + 1000.0;
    def.step = 1.0;
    def.growth = 1e-30;
    expect_refusal(context, map, def, VD_ERROR_ARGUMENT, "never reaches");
    def = vd_classic_def_default();
    def.step = 1e-9;
    def.growth = 1e-18;
    expect_refusal(context, map, def, VD_ERROR_LIMIT, "slices");
    vd_heightfield_destroy(context, &map);
    vd_context_destroy(&context);
}

static void bad_maps(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    vd_heightfield *map = make_map(context, small_map);
    vd_classic_def def = vd_classic_def_default();
    map->wraps = 0;
    expect_refusal(context, map, def, VD_ERROR_ARGUMENT, "wraps");
    map->wraps = 1;
    map->color_width = map->color_height = 0;
    expect_refusal(context, map, def, VD_ERROR_ARGUMENT, "0 x 0 colours");
    map->color_width = map->width;
    map->color_height = map->height;
    expect_refusal(context, NULL, def, VD_ERROR_ARGUMENT, "map");
    vd_frame *frame = NULL;
    assert_ok(vd_frame_create(context, 4, 4, 0, &frame));
    vd_status status =
        vd_classic_render(context, NULL, map, &def, VD_CLASSIC_METHOD_COUNT, frame, NULL);
    assert_int_equal(status.code, VD_ERROR_ARGUMENT);
    def.step = 1e-4;
    def.distance = 3000.0; /* 2^24 slices are the most that the scan keeps */
    status = vd_classic_render(context, NULL, map, &def, VD_CLASSIC_SCAN, frame, NULL);
    assert_int_equal(status.code, VD_ERROR_LIMIT);
    assert_non_null(strstr(status.message, "columns"));
    vd_frame_destroy(&frame);
    vd_heightfield_destroy(context, &map);
    vd_context_destroy(&context);
}

/* Pictures that would take minutes stop at their time limit, also within a piece of work. */
static void jobs_stop(void **state) {
    (void)state;
    vd_context *context = test_context(2, VD_ISA_AUTO);
    vd_heightfield *map = make_map(context, small_map);
    vd_job *job = NULL;
    assert_ok(vd_job_create(context, &job));
    for (int method = 0; method < VD_CLASSIC_METHOD_COUNT; method++) {
        bool scan = method == VD_CLASSIC_SCAN;
        vd_frame *frame = NULL;
        assert_ok(vd_frame_create(context, scan ? 2000 : 4, 4, 0, &frame));
        vd_classic_def def = vd_classic_def_default();
        def.step = scan ? 0.01 : 0.0001;
        def.distance = scan ? 10000 : 200000;
        for (int limited = 0; limited < 2; limited++) {
            vd_job_reset(job);
            if (limited) {
                vd_job_set_time_limit(job, 20u * 1000 * 1000);
            } else {
                vd_job_cancel(job);
            }
            vd_status status =
                vd_classic_render(context, job, map, &def, (vd_classic_method)method, frame, NULL);
            assert_int_equal(status.code, VD_ERROR_CANCELLED);
        }
        vd_frame_destroy(&frame);
    }
    vd_job_destroy(&job);
    vd_heightfield_destroy(context, &map);
    vd_context_destroy(&context);
}

static void every_allocation_fails(void **state) {
    (void)state;
    vd_context *plain = test_context(1, VD_ISA_AUTO);
    vd_heightfield *map = make_map(plain, small_map);
    vd_frame *frame = NULL;
    assert_ok(vd_frame_create(plain, 20, 20, 0, &frame));
    vd_classic_def def = small_def(78.0);
    for (int method = 0; method < VD_CLASSIC_METHOD_COUNT; method++) {
        test_allocator allocator = {0};
        vd_context *context = test_failing_context(&allocator);
        int before = allocator.live, failures = 0;
        vd_status status;
        do {
            allocator.calls = 0;
            allocator.fail_at = failures + 1;
            status =
                vd_classic_render(context, NULL, map, &def, (vd_classic_method)method, frame, NULL);
            assert_int_equal(allocator.live, before);
            if (status.code != VD_OK) {
                assert_int_equal(status.code, VD_ERROR_MEMORY);
                failures++;
            }
        } while (status.code != VD_OK);
        assert_true(failures >= 1);
        allocator.fail_at = 0;
        vd_context_destroy(&context);
        assert_int_equal(allocator.live, 0);
    }
    vd_frame_destroy(&frame);
    vd_heightfield_destroy(plain, &map);
    vd_context_destroy(&plain);
}

static void methods_have_names(void **state) {
    (void)state;
    const char *names[] = {"reference", "slices", "columns", "scan", "march"};
    for (int method = 0; method < VD_CLASSIC_METHOD_COUNT; method++) {
        assert_string_equal(vd_classic_method_name((vd_classic_method)method), names[method]);
    }
    assert_string_equal(vd_classic_method_name(VD_CLASSIC_METHOD_COUNT), "unknown");
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(methods_have_names),
        cmocka_unit_test(wrap_is_exact),
        cmocka_unit_test(truncation_saturates),
        cmocka_unit_test(operators_are_monoids),
        cmocka_unit_test(growing_schedule),
        cmocka_unit_test(constant_schedule),
        cmocka_unit_test(counts_are_those_of_the_trees),
        cmocka_unit_test(counts_are_those_of_the_docs),
        cmocka_unit_test(sky_coloured_terrain_is_kept),
        cmocka_unit_test(camera_sees_the_same),
        cmocka_unit_test(bad_defs),
        cmocka_unit_test(bad_maps),
        cmocka_unit_test(jobs_stop),
        cmocka_unit_test(every_allocation_fails),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

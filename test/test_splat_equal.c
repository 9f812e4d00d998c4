/* The fast way gives the reference's bytes at every SIMD level and number of threads: all modes,
 * kernels, kinds of colour and of positions; numbers that are none. */
#include "splat_scenes.h"

/* Returns the reference's hash of the colours. */
static uint64_t compare_all(const vd_splat_def *base, const vd_camera *camera,
                            const vd_splats *splats, int count, int width, int height) {
    vd_context *context = test_context(1, VD_ISA_AUTO);
    vd_splat_def def = *base;
    vd_splat_stats expected_stats, stats;
    def.method = VD_SPLAT_REFERENCE;
    vd_frame *expected =
        draw_splats(context, &def, camera, splats, count, width, height, &expected_stats);
    def.method = VD_SPLAT_AUTO;
    for (int isa = VD_ISA_V2; isa <= (int)vd_isa_best(); isa++) {
        static const int threads[] = {1, 2, 7};
        for (int t = 0; t < 3; t++) {
            vd_context *other = test_context(threads[t], (vd_isa)isa);
            vd_frame *frame =
                draw_splats(other, &def, camera, splats, count, width, height, &stats);
            assert_same_frames(expected, frame);
            assert_int_equal(stats.splats, expected_stats.splats);
            assert_int_equal(stats.outside, expected_stats.outside);
            assert_int_equal(stats.not_finite, expected_stats.not_finite);
            assert_int_equal(stats.cut, expected_stats.cut);
            assert_true(stats.value_min == expected_stats.value_min);
            assert_true(stats.value_max == expected_stats.value_max);
            vd_frame_destroy(&frame);
            vd_context_destroy(&other);
        }
    }
    const uint64_t hash = vd_frame_hash(expected);
    vd_frame_destroy(&expected);
    vd_context_destroy(&context);
    return hash;
}

static void every_mode_and_kernel(void **state) {
    (void)state;
    cloud *c = malloc(sizeof *c);
    fill_cloud(c, test_is_reduced() ? 1000 : CLOUD_MOST, 1, 0.02);
    vd_splats splats = cloud_splats(c);
    splats.opacity = 0.7f;
    splats.weight = c->weight;
    const vd_camera camera = splat_camera(170, 141, 90.0);
    vd_splat_def def = vd_splat_def_default();
    def.background = (vd_rgba8){30, 60, 90, 200};
    for (int mode = 0; mode < VD_SPLAT_MODE_COUNT; mode++) {
        for (int kernel = 0; kernel < VD_SPLAT_KERNEL_COUNT; kernel++) {
            def.mode = (vd_splat_mode)mode;
            def.kernel = (vd_splat_kernel)kernel;
            def.log = kernel % 2 == 1;
            compare_all(&def, &camera, &splats, 1, 170, 141);
        }
    }
    free(c);
}

static void every_color_and_position(void **state) {
    (void)state;
    cloud *c = malloc(sizeof *c);
    fill_cloud(c, 1500, 2, 0.05);
    const vd_camera camera = splat_camera(97, 64, 60.0);
    vd_splat_def def = vd_splat_def_default();
    uint64_t hashes[10];
    for (int kind = 0; kind < 10; kind++) {
        vd_splats splats = cloud_splats(c);
        splats.color = kind == 0 ? c->color : NULL;
        splats.classes = kind == 1 ? c->classes : NULL;
        splats.value = kind == 2 || kind == 3 || kind == 6 ? c->value : NULL;
        splats.value16 = kind == 4 || kind == 5 ? c->value16 : NULL;
        splats.value_origin = -10.0f;
        splats.value_step = 0.01f;
        splats.constant = (vd_rgba8){200, 100, 50, 128};
        def.log = kind == 3 || kind == 5;
        def.range_min = kind == 6 ? 20.0 : 0.0;
        def.range_max = kind == 6 ? 30.0 : 0.0;
        def.keep_order = kind == 7;
        if (kind == 9) {
            splats.x16 = c->x16;
            splats.y16 = c->y16;
            splats.z16 = c->z16;
            for (int axis = 0; axis < 3; axis++) {
                splats.origin[axis] = axis == 1 ? -1.0f : -5.0f;
                splats.step[axis] = 10.0f / 65536.0f;
            }
        }
        if (kind == 8) {
            vd_splats_find_bounds(&splats);
        }
        hashes[kind] = compare_all(&def, &camera, &splats, 1, 97, 64);
        for (int other = 0; other < kind; other++) {
            assert_true(hashes[other] != hashes[kind] || kind == 8);
        }
    }
    free(c);
}

/* Several lists, each with a transform and anchor of its own, orthographic and perspective. */
static void many_lists(void **state) {
    (void)state;
    enum { LISTS = 40 };
    cloud *c = malloc(sizeof *c);
    fill_cloud(c, CLOUD_MOST, 3, 0.01);
    vd_splats lists[LISTS];
    vd_matrix transforms[LISTS];
    uint64_t seed = 9;
    for (int i = 0; i < LISTS; i++) {
        const size_t first = (size_t)i * 100, count = i % 5 == 0 ? 0 : (size_t)(7 * i % 101);
        lists[i] = cloud_splats(c);
        lists[i].x += first;
        lists[i].y += first;
        lists[i].z += first;
        lists[i].radius += first;
        lists[i].color += first;
        lists[i].count = count;
        lists[i].object_id = 1 + (uint64_t)(i % 4);
        transforms[i] = vd_matrix_scaling(vd_vec3_make(0.5, 0.3, 0.2 + 0.01 * i));
        transforms[i].m[0][2] = 0.2;
        lists[i].transform = i % 3 == 0 ? &transforms[i] : NULL;
        lists[i].anchor = vd_vec3_make(4 * test_uniform(&seed) - 2, 2 + 3 * test_uniform(&seed),
                                       4 * test_uniform(&seed) - 2);
        if (i % 2 == 0) {
            vd_splats_find_bounds(&lists[i]);
        }
    }
    vd_splat_def def = vd_splat_def_default();
    def.sort_splats = true;
    for (int projection = 0; projection < VD_PROJECTION_COUNT; projection++) {
        vd_camera camera = splat_camera(150, 80, projection == 0 ? 60.0 : 12.0);
        camera.projection = (vd_projection)projection;
        for (int mode = 0; mode < VD_SPLAT_MODE_COUNT; mode++) {
            def.mode = (vd_splat_mode)mode;
            compare_all(&def, &camera, lists, LISTS, 150, 80);
        }
    }
    free(c);
}

/* Splats that cover all of a picture of many tiles: more records than a chunk holds. */
static void splats_over_everything(void **state) {
    (void)state;
    cloud *c = malloc(sizeof *c);
    fill_cloud(c, 700, 4, 0.0);
    for (size_t i = 0; i < c->count; i++) {
        c->y[i] = 2.0f + 0.001f * (float)i;
        c->radius[i] = i % 2 == 0 ? 150.0f : 0.004f;
        c->color[i].a = 3;
    }
    const vd_splats splats = cloud_splats(c);
    const vd_camera camera = splat_camera(8192, 2, 200.0);
    vd_splat_def def = vd_splat_def_default();
    for (int mode = 0; mode < VD_SPLAT_MODE_COUNT; mode++) {
        def.mode = (vd_splat_mode)mode;
        def.kernel = (vd_splat_kernel)(1 + mode);
        compare_all(&def, &camera, &splats, 1, 8192, 2);
    }
    free(c);
}

/* More particles than a chunk and than insertion sorting takes; small pictures; every edge. */
static void sizes(void **state) {
    (void)state;
    static const int sides[][2] = {{1, 1}, {127, 129}, {128, 256}, {257, 2}};
    static const size_t counts[] = {0, 1, 15, 16, 17, 128, 129, 5000};
    cloud *c = malloc(sizeof *c);
    for (size_t s = 0; s < sizeof sides / sizeof sides[0]; s++) {
        const vd_camera camera = splat_camera(sides[s][0], sides[s][1], 20.0);
        for (size_t k = 0; k < sizeof counts / sizeof counts[0]; k++) {
            fill_cloud(c, counts[k], 5 + k, 0.1);
            const vd_splats splats = cloud_splats(c);
            vd_splat_def def = vd_splat_def_default();
            def.mode = (vd_splat_mode)(k % VD_SPLAT_MODE_COUNT);
            compare_all(&def, &camera, &splats, 1, sides[s][0], sides[s][1]);
        }
    }
    free(c);
}

/* ---- over what is there -----------------------------------------------------------------------*/

enum { OVER_WIDTH = 170, OVER_HEIGHT = 141 };

/* Any colours and depths; a depth of 1 hides everything, of 0 nothing. */
static vd_frame *any_frame(vd_context *context, unsigned planes, float least, float most) {
    vd_frame *frame = NULL;
    uint64_t seed = 77;
    assert_ok(vd_frame_create(context, OVER_WIDTH, OVER_HEIGHT, planes, &frame));
    for (int y = 0; y < OVER_HEIGHT; y++) {
        for (int x = 0; x < OVER_WIDTH; x++) {
            const size_t at = (size_t)y * frame->stride + (size_t)x;
            const uint64_t bits = test_random(&seed);
            const float share = (float)test_uniform(&seed);
            frame->rgba[4 * at + 3] = (uint8_t)(bits % 5 == 0 ? 0 : bits % 5 == 1 ? 255 : bits);
            for (int c = 0; c < 3; c++) {
                const unsigned value = (unsigned)(bits >> (8 * (c + 1)) & 255);
                frame->rgba[4 * at + (size_t)c] = (uint8_t)(value * frame->rgba[4 * at + 3] / 255);
            }
            if (frame->depth != NULL) {
                frame->depth[at] = least + (most - least) * share;
            }
            if (frame->id != NULL) {
                frame->id[at] = (uint32_t)(bits >> 40);
            }
        }
    }
    return frame;
}

static vd_frame *draw_over(vd_context *context, const vd_splat_def *def, const cloud *c,
                           unsigned planes, float least, float most, vd_splat_stats *stats) {
    const vd_camera camera = splat_camera(OVER_WIDTH, OVER_HEIGHT, 90.0);
    vd_splats splats = cloud_splats(c);
    splats.opacity = 0.7f;
    vd_splatter *splatter = NULL;
    vd_frame *frame = any_frame(context, planes, least, most);
    assert_ok(vd_splatter_create(context, &splatter));
    assert_ok(vd_splatter_render(splatter, NULL, def, &camera, &splats, 1, frame, stats));
    vd_splatter_destroy(&splatter);
    return frame;
}

/* All levels and numbers of threads against the reference; depth and id stay as they were. */
static void over_frames(void **state) {
    (void)state;
    const unsigned planes = VD_PLANE_DEPTH | VD_PLANE_ID;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    cloud *c = malloc(sizeof *c);
    fill_cloud(c, test_is_reduced() ? 1000 : CLOUD_MOST, 8, 0.02);
    vd_splat_def def = vd_splat_def_default();
    def.over_frame = true;
    vd_frame *before = any_frame(context, planes, 0.0f, 0.1f);
    for (int kernel = 0; kernel < VD_SPLAT_KERNEL_COUNT; kernel++) {
        vd_splat_stats expected, stats;
        def.kernel = (vd_splat_kernel)kernel;
        def.method = VD_SPLAT_REFERENCE;
        vd_frame *plain = draw_over(context, &def, c, planes, 0.0f, 0.1f, &expected);
        assert_memory_equal(plain->depth, before->depth,
                            plain->stride * OVER_HEIGHT * sizeof(float));
        assert_memory_equal(plain->id, before->id, plain->stride * OVER_HEIGHT * sizeof(uint32_t));
        assert_true(vd_frame_hash(plain) != vd_frame_hash(before));
        def.method = VD_SPLAT_AUTO;
        for (int isa = VD_ISA_V2; isa <= (int)vd_isa_best(); isa++) {
            for (int threads = 1; threads <= 7; threads += 3) {
                vd_context *other = test_context(threads, (vd_isa)isa);
                vd_frame *frame = draw_over(other, &def, c, planes, 0.0f, 0.1f, &stats);
                assert_same_frames(plain, frame);
                assert_int_equal(stats.outside, expected.outside);
                vd_frame_destroy(&frame);
                vd_context_destroy(&other);
            }
        }
        vd_frame_destroy(&plain);
    }
    vd_frame_destroy(&before);
    free(c);
    vd_context_destroy(&context);
}

/* What is near hides everything, what is far nothing, and a frame without depth nothing. */
static void frames_hide(void **state) {
    (void)state;
    vd_context *context = test_context(2, VD_ISA_AUTO);
    cloud *c = malloc(sizeof *c);
    fill_cloud(c, 3000, 9, 0.0);
    vd_splat_def def = vd_splat_def_default();
    def.over_frame = true;
    def.kernel = VD_SPLAT_DISC;
    vd_splat_stats stats;
    vd_frame *before = any_frame(context, VD_PLANE_DEPTH, 2.0f, 2.0f);
    vd_frame *near = draw_over(context, &def, c, VD_PLANE_DEPTH, 2.0f, 2.0f, &stats);
    assert_true(vd_frame_hash(near) == vd_frame_hash(before));
    vd_frame *far = draw_over(context, &def, c, VD_PLANE_DEPTH, 0.0f, 0.0f, &stats);
    vd_frame *without = draw_over(context, &def, c, 0, 0.0f, 0.0f, &stats);
    assert_true(vd_frame_hash(far) == vd_frame_hash(without));
    assert_true(vd_frame_hash(far) != vd_frame_hash(before));
    def.mode = VD_SPLAT_NEAREST;
    vd_splatter *splatter = NULL;
    const vd_camera camera = splat_camera(OVER_WIDTH, OVER_HEIGHT, 90.0);
    const vd_splats splats = cloud_splats(c);
    assert_ok(vd_splatter_create(context, &splatter));
    const vd_status status =
        vd_splatter_render(splatter, NULL, &def, &camera, &splats, 1, far, NULL);
    assert_int_equal(status.code, VD_ERROR_ARGUMENT);
    assert_non_null(strstr(status.message, "over_frame"));
    vd_splatter_destroy(&splatter);
    vd_frame_destroy(&before);
    vd_frame_destroy(&near);
    vd_frame_destroy(&far);
    vd_frame_destroy(&without);
    free(c);
    vd_context_destroy(&context);
}

/* Over a frame of one colour: as over a background of it, also where that is transparent. */
static void over_one_color(void **state) {
    (void)state;
    vd_context *context = test_context(2, VD_ISA_AUTO);
    cloud *c = malloc(sizeof *c);
    fill_cloud(c, 3000, 10, 0.0);
    const vd_camera camera = splat_camera(OVER_WIDTH, OVER_HEIGHT, 90.0);
    const vd_splats splats = cloud_splats(c);
    vd_splatter *splatter = NULL;
    assert_ok(vd_splatter_create(context, &splatter));
    for (int i = 0; i < 2; i++) {
        vd_frame *frames[2];
        vd_splat_def def = vd_splat_def_default();
        def.background = i == 0 ? (vd_rgba8){0, 0, 0, 0} : (vd_rgba8){90, 7, 200, 255};
        for (int over = 0; over < 2; over++) {
            assert_ok(vd_frame_create(context, OVER_WIDTH, OVER_HEIGHT, 0, &frames[over]));
            for (size_t k = 0; k < frames[over]->stride * OVER_HEIGHT; k++) {
                memcpy(frames[over]->rgba + 4 * k, &def.background, 4);
            }
            def.over_frame = over == 1;
            assert_ok(
                vd_splatter_render(splatter, NULL, &def, &camera, &splats, 1, frames[over], NULL));
        }
        assert_true(vd_frame_hash(frames[0]) == vd_frame_hash(frames[1]));
        vd_frame_destroy(&frames[0]);
        vd_frame_destroy(&frames[1]);
    }
    vd_splatter_destroy(&splatter);
    free(c);
    vd_context_destroy(&context);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_mode_and_kernel),
        cmocka_unit_test(every_color_and_position),
        cmocka_unit_test(many_lists),
        cmocka_unit_test(splats_over_everything),
        cmocka_unit_test(sizes),
        cmocka_unit_test(over_frames),
        cmocka_unit_test(frames_hide),
        cmocka_unit_test(over_one_color),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

/* The lens march against the plain ray caster: the same bytes of colour, depth and id for random
 * maps, cameras and options, at every SIMD level and on any number of threads. That many
 * pictures of one renderer, and a sun that moves, change nothing. And what its levels of detail are
 * for: distance that does not sparkle. */
#include "lens_scenes.h"

static void march_draws_what_raycast_draws(void **state) {
    (void)state;
    const char *scenes_text = getenv("VEDUTA_TEST_SCENES");
    const int scenes = scenes_text != NULL ? atoi(scenes_text) : test_is_reduced() ? 60 : 1200;
    vd_context *contexts[VD_ISA_COUNT] = {NULL};
    const int threads[] = {1, 2, 7};
    int showing = 0; /* scenes */
    for (int isa = VD_ISA_V2; isa <= (int)vd_isa_best(); isa++) {
        contexts[isa] = test_context(threads[isa % 3], (vd_isa)isa);
    }
    vd_colormap colormap;
    assert_true(vd_colormap_find("viridis", &colormap));
    for (int scene = 0; scene < scenes; scene++) {
        uint64_t random = (uint64_t)scene * 77 + 5;
        const int larger = scene % 40 == 0 ? 5 : 1; /* some of many tiles */
        const int width = 1 + pick(&random, 70 * larger), height = 1 + pick(&random, 50 * larger);
        vd_heightfield *map = random_map(contexts[VD_ISA_V2], &random);
        const vd_camera camera = random_camera(map, &random, width, height);
        vd_terrain_def def = random_def(map, &colormap, &random);
        def.method = VD_TERRAIN_RAYCAST;
        vd_frame_stats expected_stats, stats;
        vd_frame *expected =
            draw_lens(contexts[VD_ISA_V2], &def, &camera, width, height, &expected_stats);
        def.method = VD_TERRAIN_MARCH;
        for (int isa = VD_ISA_V2; isa <= (int)vd_isa_best(); isa++) {
            vd_frame *frame = draw_lens(contexts[isa], &def, &camera, width, height, &stats);
            assert_same(expected, frame, "march", scene, vd_isa_name((vd_isa)isa));
            assert_int_equal(stats.hits, expected_stats.hits);
            assert_int_equal(stats.samples, expected_stats.samples);
            vd_frame_destroy(&frame);
        }
        showing += expected_stats.hits > 0;
        vd_frame_destroy(&expected);
        vd_heightfield_destroy(contexts[VD_ISA_V2], &map);
    }
    assert_true(showing > scenes / 4);
    for (int isa = VD_ISA_V2; isa <= (int)vd_isa_best(); isa++) {
        vd_context_destroy(&contexts[isa]);
    }
}

/* ---- many pictures --------------------------------------------------------------------------- */

/* A renderer whose sun has moved draws what a new one draws; a warm picture takes no memory. */
static void a_moving_sun_draws_as_a_new_renderer(void **state) {
    (void)state;
    vd_context *context = test_context(2, VD_ISA_AUTO);
    vd_colormap colormap;
    assert_true(vd_colormap_find("viridis", &colormap));
    const int scenes = test_is_reduced() ? 10 : 60;
    int changed = 0;
    for (int scene = 0; scene < scenes; scene++) {
        uint64_t random = (uint64_t)scene * 83 + 1;
        const int width = 1 + pick(&random, 70), height = 1 + pick(&random, 50);
        vd_heightfield *map = random_map(context, &random);
        const vd_camera camera = random_camera(map, &random, width, height);
        vd_terrain_def def = random_def(map, &colormap, &random);
        vd_terrain_renderer *renderer = NULL;
        vd_frame_stats stats;
        assert_ok(vd_terrain_renderer_create(context, NULL, &def, &renderer));
        vd_frame *frame = NULL, *first = draw_lens(context, &def, &camera, width, height, &stats);
        assert_ok(vd_frame_create(context, width, height, VD_PLANE_DEPTH | VD_PLANE_ID, &frame));
        assert_ok(vd_terrain_renderer_draw(renderer, NULL, &camera, frame, NULL));
        assert_same(first, frame, "march", scene, "first");
        for (int hour = 0; hour < 4; hour++) {
            def.light = vd_light_daylight(between(&random, 0, 6.3), between(&random, -0.1, 1.5));
            def.light.haze_m = hour == 1 ? 300 : 0;
            assert_ok(vd_terrain_renderer_light(renderer, NULL, &def.light));
            const uint64_t allocations = vd_context_memory(context).allocations;
            assert_ok(vd_terrain_renderer_draw(renderer, NULL, &camera, frame, NULL));
            assert_int_equal(vd_context_memory(context).allocations, allocations);
        }
        vd_frame *expected = draw_lens(context, &def, &camera, width, height, &stats);
        assert_same(expected, frame, "march", scene, "moved");
        changed += memcmp(first->rgba, frame->rgba, 4) != 0;
        vd_frame_destroy(&expected);
        vd_frame_destroy(&first);
        vd_frame_destroy(&frame);
        vd_terrain_renderer_destroy(&renderer);
        vd_heightfield_destroy(context, &map);
    }
    assert_true(changed > scenes / 10); /* the light is seen */
    vd_context_destroy(&context);
}

/* ---- mip ------------------------------------------------------------------------------------- */

/* A slow pan over rough ground with colours of noise, cells of 1 m: rows 78 to 100 of the columns
 * 50 to 110 show it from 390 to 870 m away, where a pixel spans 6 to 14 cells. */
enum { PAN_SIDE = 1024, PAN_PICTURES = 64, PAN_WIDTH = 160, PAN_HEIGHT = 120 };
enum { PAN_LEFT = 50, PAN_RIGHT = 110, PAN_TOP = 78, PAN_BOTTOM = 100 };

static vd_heightfield *noise_map(vd_context *context) {
    uint64_t random = 1992;
    vd_picture *colors = NULL;
    assert_ok(vd_picture_create(context, PAN_SIDE, PAN_SIDE, 3, 8, &colors));
    uint8_t *bytes = colors->data;
    for (size_t i = 0; i < colors->stride_bytes * (size_t)PAN_SIDE; i++) {
        bytes[i] = (uint8_t)test_random(&random);
    }
    float *heights = vd_allocate(context, (size_t)PAN_SIDE * PAN_SIDE, sizeof *heights);
    assert_non_null(heights);
    for (int i = 0; i < PAN_SIDE * PAN_SIDE; i++) {
        heights[i] = (float)between(&random, 0, 12);
    }
    vd_heightfield_def def = vd_heightfield_def_default();
    def.width = def.height = PAN_SIDE;
    def.heights = heights;
    def.height_stride = PAN_SIDE;
    def.colors = colors;
    vd_heightfield *map = NULL;
    assert_ok(vd_heightfield_create(context, &def, &map));
    vd_picture_destroy(&colors);
    vd_release(context, heights);
    return map;
}

/* The mean over pixels and channels of the variance in time, from picture to picture. */
static double pan_variance(vd_context *context, const vd_terrain_def *def) {
    static float sums[PAN_HEIGHT][PAN_WIDTH][3], squares[PAN_HEIGHT][PAN_WIDTH][3];
    memset(sums, 0, sizeof sums);
    memset(squares, 0, sizeof squares);
    vd_terrain_renderer *renderer = NULL;
    vd_frame *frame = NULL;
    assert_ok(vd_terrain_renderer_create(context, NULL, def, &renderer));
    assert_ok(vd_frame_create(context, PAN_WIDTH, PAN_HEIGHT, VD_PLANE_DEPTH, &frame));
    vd_camera camera;
    memset(&camera, 0, sizeof camera);
    camera.eye = vd_vec3_make(512, -1000, 260);
    camera.lens = vd_lens_from_fov(0.5 * VD_PI, PAN_WIDTH, PAN_HEIGHT);
    camera.near_m = 1;
    for (int t = 0; t < PAN_PICTURES; t++) {
        camera.orientation = vd_orientation_from_angles(0.0005 * t, 0, 0); /* a 33rd of a pixel */
        assert_ok(vd_terrain_renderer_draw(renderer, NULL, &camera, frame, NULL));
        for (int row = PAN_TOP; row < PAN_BOTTOM; row++) {
            for (int i = PAN_LEFT; i < PAN_RIGHT; i++) {
                const size_t at = (size_t)row * frame->stride + (size_t)i;
                assert_true(frame->depth[at] > 0); /* ground */
                const uint8_t *c = (const uint8_t *)frame->rgba + 4 * at;
                const float rgb[3] = {c[0], c[1], c[2]};
                for (int k = 0; k < 3; k++) {
                    sums[row][i][k] += rgb[k];
                    squares[row][i][k] += rgb[k] * rgb[k];
                }
            }
        }
    }
    vd_frame_destroy(&frame);
    vd_terrain_renderer_destroy(&renderer);
    double variance = 0.0;
    for (int row = PAN_TOP; row < PAN_BOTTOM; row++) {
        for (int i = 3 * PAN_LEFT; i < 3 * PAN_RIGHT; i++) {
            const double mean = (double)sums[row][i / 3][i % 3] / PAN_PICTURES;
            variance += (double)squares[row][i / 3][i % 3] / PAN_PICTURES - mean * mean;
        }
    }
    return variance / ((PAN_BOTTOM - PAN_TOP) * (PAN_RIGHT - PAN_LEFT) * 3);
}

static void a_moving_sun_takes_no_memory(void **state) {
    (void)state;
    vd_context *context = test_context(2, VD_ISA_AUTO);
    vd_heightfield *map = noise_map(context);
    vd_terrain_def def = vd_terrain_def_default();
    def.heightfield = map;
    vd_terrain_renderer *renderer = NULL;
    assert_ok(vd_terrain_renderer_create(context, NULL, &def, &renderer));
    const uint64_t allocations = vd_context_memory(context).allocations;
    for (int hour = 0; hour < 4; hour++) {
        const vd_light light = vd_light_daylight(1.0 + 0.8 * hour, 0.05 + 0.3 * hour);
        assert_ok(vd_terrain_renderer_light(renderer, NULL, &light));
    }
    assert_int_equal(vd_context_memory(context).allocations, allocations);
    vd_terrain_renderer_destroy(&renderer);
    vd_heightfield_destroy(context, &map);
    vd_context_destroy(&context);
}

static void distance_does_not_sparkle(void **state) {
    (void)state;
    vd_context *context = test_context(2, VD_ISA_AUTO);
    vd_heightfield *map = noise_map(context);
    for (int i = 0; i < 4; i++) {
        vd_terrain_def def = vd_terrain_def_default();
        def.heightfield = map;
        def.filter = i % 2 == 0 ? VD_FILTER_LINEAR : VD_FILTER_NEAREST;
        def.samples = i < 2 ? 4 : 1;
        def.mip = false;
        const double without = pan_variance(context, &def);
        def.mip = true;
        const double with = pan_variance(context, &def);
        if (with > 0.25 * without || without < 100.0) {
            fail_msg("filter %d, %d samples: the variance is %.1f with mip and %.1f without",
                     (int)def.filter, def.samples, with, without);
        }
    }
    vd_heightfield_destroy(context, &map);
    vd_context_destroy(&context);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(march_draws_what_raycast_draws),
        cmocka_unit_test(a_moving_sun_draws_as_a_new_renderer),
        cmocka_unit_test(a_moving_sun_takes_no_memory),
        cmocka_unit_test(distance_does_not_sparkle),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

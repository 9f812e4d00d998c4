/* The lens march against the plain ray caster: the same bytes of colour, depth and id for random
 * maps, cameras and options, at every SIMD level and on any number of threads. */
#include "lens_scenes.h"

/* ---- equality -------------------------------------------------------------------------------- */

static void assert_same(const vd_frame *a, const vd_frame *b, int scene, const char *isa) {
    for (int y = 0; y < a->height; y++) {
        for (int x = 0; x < a->width; x++) {
            const size_t i = (size_t)y * a->stride + (size_t)x;
            if (memcmp(a->rgba + 4 * i, b->rgba + 4 * i, 4) != 0 ||
                memcmp(a->depth + i, b->depth + i, 4) != 0 || a->id[i] != b->id[i]) {
                fail_msg("scene %d, %s, pixel %d, %d: raycast %02x%02x%02x%02x depth %.9g, march "
                         "%02x%02x%02x%02x depth %.9g",
                         scene, isa, x, y, a->rgba[4 * i], a->rgba[4 * i + 1], a->rgba[4 * i + 2],
                         a->rgba[4 * i + 3], (double)a->depth[i], b->rgba[4 * i],
                         b->rgba[4 * i + 1], b->rgba[4 * i + 2], b->rgba[4 * i + 3],
                         (double)b->depth[i]);
            }
        }
    }
}

static vd_frame *draw(vd_context *context, const vd_terrain_def *def, const vd_camera *camera,
                      int width, int height, vd_frame_stats *stats) {
    vd_frame *frame = NULL;
    assert_ok(vd_frame_create(context, width, height, VD_PLANE_DEPTH | VD_PLANE_ID, &frame));
    assert_ok(vd_terrain_render(context, NULL, def, camera, frame, stats));
    return frame;
}

static void march_draws_what_raycast_draws(void **state) {
    (void)state;
    const char *scenes_text = getenv("VEDUTA_TEST_SCENES");
    const int scenes = scenes_text != NULL                     ? atoi(scenes_text)
                       : getenv("VEDUTA_TEST_REDUCED") != NULL ? 60
                                                               : 1200;
    vd_context *contexts[VD_ISA_COUNT] = {NULL};
    const int threads[] = {1, 2, 7};
    uint64_t total_hits = 0, total = 0;
    for (int isa = VD_ISA_V2; isa <= (int)vd_isa_best(); isa++) {
        contexts[isa] = test_context(threads[isa % 3], (vd_isa)isa);
    }
    vd_colormap colormap;
    assert_true(vd_colormap_find("viridis", &colormap));
    for (int scene = 0; scene < scenes; scene++) {
        uint64_t random = (uint64_t)scene * 77 + 5;
        const int width = 1 + pick(&random, 70), height = 1 + pick(&random, 50);
        vd_heightfield *map = random_map(contexts[VD_ISA_V2], &random);
        const vd_camera camera = random_camera(map, &random, width, height);
        vd_terrain_def def = random_def(map, &colormap, &random);
        def.method = VD_TERRAIN_RAYCAST;
        vd_frame_stats expected_stats, stats;
        vd_frame *expected =
            draw(contexts[VD_ISA_V2], &def, &camera, width, height, &expected_stats);
        def.method = VD_TERRAIN_MARCH;
        for (int isa = VD_ISA_V2; isa <= (int)vd_isa_best(); isa++) {
            vd_frame *frame = draw(contexts[isa], &def, &camera, width, height, &stats);
            assert_same(expected, frame, scene, vd_isa_name((vd_isa)isa));
            assert_int_equal(stats.hits, expected_stats.hits);
            assert_int_equal(stats.samples, expected_stats.samples);
            vd_frame_destroy(&frame);
        }
        total_hits += expected_stats.hits;
        total += expected_stats.samples;
        vd_frame_destroy(&expected);
        vd_heightfield_destroy(contexts[VD_ISA_V2], &map);
    }
    assert_true(total_hits > total / 20); /* the scenes show something */
    for (int isa = VD_ISA_V2; isa <= (int)vd_isa_best(); isa++) {
        vd_context_destroy(&contexts[isa]);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(march_draws_what_raycast_draws),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

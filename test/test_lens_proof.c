/* The lens march passes over no ground that is seen: whenever a beam or a ray goes on from one
 * place to another without testing the cells between, every ray that still looks is followed by the
 * plain method, and must not hit there. */
#include "lens_scenes.h"
#include "terrain/lens_cast.h"

static void check_passed(const void *packets, int count, float from, float to);
#define VD_LENS_PASSED(packets, count, from, to) check_passed(packets, count, from, to)
#define TABLE proving_methods
#include "terrain/lens_march.inl"
#include "terrain/lens_renderer.h"

static const vd_lens_view *proven_view;
static uint64_t proven_parts, proven_rays;

static void check_passed(const void *packets, int count, float from, float to) {
    const packet *p = packets;
    proven_parts++;
    for (int at = 0; at < count; at++) {
        const uint32_t alive = vd_wide_bits(p[at].alive);
        for (int lane = 0; lane < LANES; lane++) {
            const vd_lens_ray ray = vd_lens_make_ray(proven_view, p[at].x[lane], p[at].y[lane]);
            float s;
            if ((alive >> lane & 1) == 0 || !vd_lens_cast(proven_view, &ray, &s)) {
                continue;
            }
            proven_rays++;
            if (from < s && s < to) {
                fail_msg("pixel %g, %g hits at %.9g and %.9g … %.9g was passed over",
                         (double)p[at].x[lane], (double)p[at].y[lane], (double)s, (double)from,
                         (double)to);
            }
        }
    }
}

static void no_visible_ground_is_passed_over(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    const int scenes = test_is_reduced() ? 20 : 200;
    vd_colormap colormap;
    assert_true(vd_colormap_find("viridis", &colormap));
    for (int scene = 0; scene < scenes; scene++) {
        uint64_t random = (uint64_t)scene * 79 + 3;
        const int width = 1 + pick(&random, 70), height = 1 + pick(&random, 50);
        vd_heightfield *map = random_map(context, &random);
        const vd_camera camera = random_camera(map, &random, width, height);
        vd_terrain_def def = random_def(map, &colormap, &random);
        vd_terrain_renderer *renderer = NULL;
        assert_ok(vd_terrain_renderer_create(context, NULL, &def, &renderer));
        renderer->kernels = &proving_methods;
        proven_view = &renderer->view;
        vd_frame *frame = NULL;
        assert_ok(vd_frame_create(context, width, height, 0, &frame));
        assert_ok(vd_terrain_renderer_draw(renderer, NULL, &camera, frame, NULL));
        vd_frame_destroy(&frame);
        vd_terrain_renderer_destroy(&renderer);
        vd_heightfield_destroy(context, &map);
    }
    assert_true(proven_parts > (uint64_t)scenes * 10 && proven_rays > proven_parts);
    vd_context_destroy(&context);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(no_visible_ground_is_passed_over),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

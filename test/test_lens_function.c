/* Endless functions by the lens methods: the plain way and the fast one, the sampled heightfield,
 * how far they reach, holes, memory, and what is refused. */
#include <math.h>
#include "core/real.h"
#include "function_texts.h"
#include "lens_support.h"

static const char *const texts[] = {
    "h=60*cos(x/40)*sin(y/40); rgb=hsv(h/120,0.6,1)",
    "h=300*ridged(x/900,y/900,5)",
    "n=120*fbm(x/400,y/400,6); h=max(n,0); rgb=n<0?rgb(.1,.3,.6):rgb(.3,.5,.2)",
    "h=30",
    "h=0.3*x-0.1*y",
    "h=mod(floor(x/9)+floor(y/7),2)*20; rgb=rgb(mod(floor(x),2),.5,.2)",
    "h=1000/(x-50)", /* a pole: nothing is known around it */
    "h=sqrt(900-mod(x,80)^2)*(y<200?1:log(-1))",
    "h=x/0",                                   /* holes everywhere */
    "h=20*noise(x/3,y/3)+abs(x)*0.05+(x-x)*9", /* looser than it is */
};
enum { TEXTS = sizeof texts / sizeof texts[0] };

static vd_camera camera_at(double x, double y, double z, double heading, double pitch, double fov,
                           int width, int height) {
    vd_camera camera;
    memset(&camera, 0, sizeof camera);
    camera.eye = vd_vec3_make(x, y, z);
    camera.orientation = vd_orientation_from_angles(heading, pitch, 0.0);
    camera.lens = vd_lens_from_fov(fov, width, height);
    camera.near_m = 0.1;
    return camera;
}

/* Level, steep, rolled, straight down, along the axes, under ground, from high above, far away. */
static vd_camera random_camera(uint64_t *random, int width, int height) {
    const int kind = pick(random, 8);
    const bool axes = kind == 0;
    const double place = pick(random, 5) == 0 ? 9e5 : 0.0;
    vd_camera camera = camera_at(
        place + floor(between(random, -500, 500)), floor(between(random, -500, 500)) - 0.5 * place,
        kind == 2 ? between(random, 500, 50000) : between(random, -20, 300),
        axes ? pick(random, 4) * 0.5 * VD_PI : between(random, 0, 6.3),
        kind == 1   ? -0.5 * VD_PI
        : kind == 2 ? between(random, -1.5, -0.5)
        : axes      ? 0.0
                    : between(random, -1.2, 0.4),
        between(random, 0.2, 1.6), width, height);
    if (kind == 3) {
        const vd_quat roll = vd_quat_from_axis_angle(vd_vec3_make(0, 0, 1), between(random, -3, 3));
        camera.orientation = vd_quat_normalize(vd_quat_multiply(camera.orientation, roll));
    }
    camera.lens.cx += pick(random, 3) == 0 ? between(random, -40, 40) : 0.0;
    camera.near_m = pick(random, 4) == 0 ? between(random, 1, 60) : 0.1;
    if (pick(random, 6) == 0) {
        camera.projection = VD_PROJECTION_ORTHOGRAPHIC;
        camera.lens.fx = camera.lens.fy = between(random, 0.05, 4);
        camera.far_m = between(random, 100, 3000) + camera.near_m;
    }
    return camera;
}

static vd_terrain_def random_def(const vd_function *function, const vd_colormap *colormap,
                                 const vd_camera *camera, uint64_t *random) {
    vd_terrain_def def = vd_terrain_def_default();
    def.function = function;
    def.cell_m = pick(random, 3) == 0 ? between(random, 0.3, 5) : 1.0;
    def.colormap = pick(random, 3) != 0 ? colormap : NULL;
    def.light = vd_light_daylight(between(random, 0, 6.3), between(random, -0.1, 1.5));
    def.light.haze_m = pick(random, 2) == 0 ? between(random, 100, 5000) : 0;
    def.filter = (vd_filter)pick(random, VD_FILTER_COUNT);
    def.mip = pick(random, 4) != 0;
    def.samples = (int[]){1, 4, 8}[pick(random, 3)];
    def.exaggeration = pick(random, 3) == 0 ? between(random, 0.2, 3) : 1;
    def.shading = pick(random, 4) != 0;
    def.curvature = pick(random, 3) == 0;
    def.sky = pick(random, 3) != 0;
    if (pick(random, 3) == 0 || !def.mip || camera->projection == VD_PROJECTION_ORTHOGRAPHIC) {
        def.far_m = between(random, 50, 800);
    }
    return def;
}

/* The plain method samples whole windows, the fast one what the frustum may meet: equal pictures
 * tell that no sample was missed. One renderer draws all cameras of a text, so that what an earlier
 * picture left behind would be seen. */
static void march_draws_what_raycast_draws(void **state) {
    (void)state;
    const int cameras = test_is_reduced() ? 9 : 12;
    const int all = rounds(TEXTS * 4);
    uint64_t hits = 0, total = 0;
    vd_context *contexts[VD_ISA_COUNT] = {NULL};
    const int threads[] = {1, 2, 7};
    for (int isa = VD_ISA_V2; isa <= (int)vd_isa_best(); isa++) {
        contexts[isa] = test_context(threads[isa % 3], (vd_isa)isa);
    }
    vd_colormap colormap;
    assert_true(vd_colormap_find("viridis", &colormap));
    for (int i = 0; i < all; i++) {
        uint64_t random = (uint64_t)i * 91 + 3;
        char text[512] = "h=";
        random_number_text(&random, 3, text + 2);
        const char *chosen = i < TEXTS * 2 ? texts[i % TEXTS] : text;
        vd_function *functions[VD_ISA_COUNT] = {NULL};
        for (int isa = VD_ISA_V2; isa <= (int)vd_isa_best(); isa++) {
            functions[isa] = compile(contexts[isa], chosen);
        }
        for (int c = 0; c < cameras; c++) {
            const int width = 1 + pick(&random, 90), height = 1 + pick(&random, 60);
            const vd_camera camera = random_camera(&random, width, height);
            vd_terrain_def def = random_def(functions[VD_ISA_V2], &colormap, &camera, &random);
            def.method = VD_TERRAIN_RAYCAST;
            vd_frame_stats stats;
            vd_frame *expected =
                draw_lens(contexts[VD_ISA_V2], &def, &camera, width, height, &stats);
            hits += stats.hits;
            total += stats.samples;
            def.method = VD_TERRAIN_MARCH;
            for (int isa = VD_ISA_V2; isa <= (int)vd_isa_best(); isa++) {
                def.function = functions[isa];
                vd_frame *frame = draw_lens(contexts[isa], &def, &camera, width, height, &stats);
                assert_same(expected, frame, chosen, 100 * i + c, vd_isa_name((vd_isa)isa));
                vd_frame_destroy(&frame);
            }
            vd_frame_destroy(&expected);
        }
        for (int isa = VD_ISA_V2; isa <= (int)vd_isa_best(); isa++) {
            vd_function_destroy(contexts[isa], &functions[isa]);
        }
    }
    assert_true(hits > total / 10);
    for (int isa = VD_ISA_V2; isa <= (int)vd_isa_best(); isa++) {
        vd_context_destroy(&contexts[isa]);
    }
}

/* What an earlier picture left in the windows is not seen, and a warm frame allocates nothing. */
static void a_renderer_draws_as_a_new_one(void **state) {
    (void)state;
    test_allocator allocator = {0, 0, 0};
    vd_context *context = test_failing_context(&allocator);
    vd_function *function = compile(context, texts[1]);
    vd_terrain_def def = vd_terrain_def_default();
    def.function = function;
    vd_terrain_renderer *renderer = NULL;
    assert_ok(vd_terrain_renderer_create(context, NULL, &def, &renderer));
    vd_frame *frame = NULL;
    assert_ok(vd_frame_create(context, 120, 80, VD_PLANE_DEPTH | VD_PLANE_ID, &frame));
    for (int round = 0; round < 2; round++) {
        const int before = allocator.calls;
        for (int i = 0; i < (test_is_reduced() ? 5 : 16); i++) {
            const vd_camera camera =
                camera_at(i * 70.0, i * -30.0, 350.0 + i, i * 0.4, -0.1 - 0.05 * i, 0.9, 120, 80);
            assert_ok(vd_terrain_renderer_draw(renderer, NULL, &camera, frame, NULL));
            if (round == 0) {
                vd_frame *fresh = draw_lens(context, &def, &camera, 120, 80, NULL);
                assert_same(fresh, frame, texts[1], i, "renderer");
                vd_frame_destroy(&fresh);
            }
        }
        assert_true(round == 0 || allocator.calls == before);
    }
    vd_frame_destroy(&frame);
    vd_terrain_renderer_destroy(&renderer);
    vd_function_destroy(context, &function);
    vd_context_destroy(&context);
    assert_int_equal(allocator.live, 0);
}

/* The same cells as a heightfield over all that is seen. The two count positions from different
 * places, so a ray may differ by the rounding of a float: of a thousand pixels, at most two differ
 * by more than one step of a channel, those at the edge of something. */
static void it_is_the_sampled_heightfield(void **state) {
    (void)state;
    vd_context *context = test_context(2, vd_isa_best());
    for (int i = 0; i < TEXTS; i += test_is_reduced() ? 5 : 1) {
        vd_function *function = compile(context, texts[i]);
        const vd_function_grid grid = {-700.0, 700.0, 1.0, 1401, 1401};
        vd_heightfield *map = NULL;
        assert_ok(vd_function_heightfield(context, NULL, function, &grid, &map));
        for (int c = 0; c < 4; c++) {
            const vd_camera camera = camera_at(10.0 * c, -300.0 + 7 * c, 330.0, 0.3 * c - 0.5,
                                               c == 3 ? -1.5 : -1.2, 0.7, 160, 100);
            vd_terrain_def def = vd_terrain_def_default();
            def.mip = def.shadows = false;
            def.heightfield = map;
            vd_frame *expected = draw_lens(context, &def, &camera, 160, 100, NULL);
            def.heightfield = NULL;
            def.function = function;
            def.far_m = 3000.0;
            vd_frame *frame = draw_lens(context, &def, &camera, 160, 100, NULL);
            int different = 0;
            for (int y = 0; y < 100; y++) {
                for (int x = 0; x < 160; x++) {
                    const size_t at = (size_t)y * frame->stride + (size_t)x;
                    int most = 0;
                    for (int k = 0; k < 4; k++) {
                        const int d = abs(frame->rgba[4 * at + (size_t)k] -
                                          expected->rgba[4 * at + (size_t)k]);
                        most = d > most ? d : most;
                    }
                    different += most > 1;
                }
            }
            if (different > 32) {
                fail_msg("%s, camera %d: %d of 16000 pixels differ", texts[i], c, different);
            }
            vd_frame_destroy(&expected);
            vd_frame_destroy(&frame);
        }
        vd_heightfield_destroy(context, &map);
        vd_function_destroy(context, &function);
    }
    vd_context_destroy(&context);
}

/* A wall 100 km away, 3 km high, is where it belongs. */
static void the_horizon_is_far(void **state) {
    (void)state;
    vd_context *context = test_context(2, vd_isa_best());
    vd_function *function = compile(context, "h = y > 100000 ? 3000 : 0");
    vd_terrain_def def = vd_terrain_def_default();
    def.function = function;
    def.samples = 1;
    const vd_camera camera = camera_at(0, 0, 100, 0, 0, 0.5, 200, 200);
    vd_frame_stats stats;
    vd_frame *frame = draw_lens(context, &def, &camera, 200, 200, &stats);
    for (int y = 0; y < 200; y++) {
        const double rise = (100.0 - (y + 0.5)) / camera.lens.fy;
        const double z = vd_camera_distance(&camera, frame->depth[(size_t)y * frame->stride + 100]);
        if (rise > 0.0) {
            assert_true(100.0 + rise * 100000.0 < 2990.0   ? fabs(z - 100000.0) < 300.0
                        : 100.0 + rise * 100000.0 > 3010.0 ? isinf(z)
                                                           : true);
        } else if (rise < -0.002) {
            assert_true(fabs(z * -rise - 100.0) < 0.1);
        }
    }
    vd_frame_destroy(&frame);
    def.far_m = 50000.0;
    frame = draw_lens(context, &def, &camera, 200, 200, &stats);
    assert_true(frame->depth[90 * frame->stride + 100] == 0.0f);
    vd_frame_destroy(&frame);
    vd_function_destroy(context, &function);
    vd_context_destroy(&context);
}

/* ---- callbacks ------------------------------------------------------------------------------- */

static void hill(void *user, const float x[VD_FUNCTION_LANES], const float y[VD_FUNCTION_LANES],
                 float h[VD_FUNCTION_LANES], float red[VD_FUNCTION_LANES],
                 float green[VD_FUNCTION_LANES], float blue[VD_FUNCTION_LANES]) {
    (void)user, (void)red, (void)green, (void)blue;
    for (int i = 0; i < VD_FUNCTION_LANES; i++) {
        h[i] = 5000.0f / (1.0f + (x[i] * x[i] + y[i] * y[i]) * 0.01f);
    }
}

static void tight(void *user, float x0, float x1, float y0, float y1, float *min, float *max) {
    (void)user, (void)x0, (void)x1, (void)y0, (void)y1;
    *min = 0.0f;
    *max = 5000.0f;
}

/* Bounds that say nothing cost time, and change no depth. */
static void loose_bounds_draw_the_same(void **state) {
    (void)state;
    vd_context *context = test_context(2, vd_isa_best());
    vd_frame *frames[2] = {NULL, NULL};
    vd_function_bounds_callback *const bounds[2] = {NULL, tight};
    for (int i = 0; i < 2; i++) {
        const vd_function_callback_def callback = {.evaluate = hill, .bounds = bounds[i]};
        vd_function *function = NULL;
        assert_ok(vd_function_from_callback(context, &callback, &function));
        vd_terrain_def def = vd_terrain_def_default();
        def.function = function;
        def.far_m = 4000.0;
        const vd_camera camera = camera_at(50, -900, 90, 0.1, -0.05, 0.8, 160, 100);
        frames[i] = draw_lens(context, &def, &camera, 160, 100, NULL);
        vd_function_destroy(context, &function);
    }
    int different = 0;
    for (int y = 0; y < 100; y++) {
        different += memcmp(frames[0]->rgba + 4 * (size_t)y * frames[0]->stride,
                            frames[1]->rgba + 4 * (size_t)y * frames[1]->stride, 640) != 0;
    }
    assert_true(different <= 5); /* rays that begin elsewhere round elsewhere */
    vd_frame_destroy(&frames[0]);
    vd_frame_destroy(&frames[1]);
    vd_context_destroy(&context);
}

/* ---- failures -------------------------------------------------------------------------------- */

static void every_allocation_may_fail(void **state) {
    (void)state;
    for (int method = 0; method < VD_TERRAIN_METHOD_COUNT; method++) {
        bool done = false;
        for (int n = 1; !done; n++) {
            test_allocator allocator = {0, 0, 0};
            vd_context *context = test_failing_context(&allocator);
            vd_function *function = compile(context, texts[0]);
            vd_frame *frame = NULL;
            assert_ok(vd_frame_create(context, 40, 30, 0, &frame));
            vd_terrain_def def = vd_terrain_def_default();
            def.function = function;
            def.method = (vd_terrain_method)method;
            const vd_camera camera = camera_at(0, -200, 90, 0, -0.3, 0.8, 40, 30);
            allocator.fail_at = allocator.calls + n;
            const vd_status status = vd_terrain_render(context, NULL, &def, &camera, frame, NULL);
            done = status.code == VD_OK;
            assert_true(done || status.code == VD_ERROR_MEMORY);
            vd_frame_destroy(&frame);
            vd_function_destroy(context, &function);
            vd_context_destroy(&context);
            assert_int_equal(allocator.live, 0);
            assert_true(n < 100);
        }
    }
}

static void a_cancelled_job_stops(void **state) {
    (void)state;
    vd_context *context = test_context(2, vd_isa_best());
    vd_function *function = compile(context, texts[1]);
    for (int method = 0; method < VD_TERRAIN_METHOD_COUNT; method++) {
        vd_terrain_def def = vd_terrain_def_default();
        def.function = function;
        def.method = (vd_terrain_method)method;
        vd_terrain_renderer *renderer = NULL;
        assert_ok(vd_terrain_renderer_create(context, NULL, &def, &renderer));
        vd_job *job = NULL;
        assert_ok(vd_job_create(context, &job));
        vd_frame *frame = NULL, *expected = NULL;
        assert_ok(vd_frame_create(context, 80, 60, VD_PLANE_DEPTH | VD_PLANE_ID, &frame));
        const vd_camera camera = camera_at(0, -200, 400, 0, -0.3, 0.8, 80, 60);
        vd_job_cancel(job);
        assert_int_equal(vd_terrain_renderer_draw(renderer, job, &camera, frame, NULL).code,
                         VD_ERROR_CANCELLED);
        vd_job_reset(job);
        assert_ok(vd_terrain_renderer_draw(renderer, job, &camera, frame, NULL));
        expected = draw_lens(context, &def, &camera, 80, 60, NULL);
        assert_same(expected, frame, texts[1], 0, "after a cancelled job");
        vd_frame_destroy(&expected);
        vd_frame_destroy(&frame);
        vd_job_destroy(&job);
        vd_terrain_renderer_destroy(&renderer);
    }
    vd_function_destroy(context, &function);
    vd_context_destroy(&context);
}

static void assert_refused(vd_context *context, const vd_terrain_def *def, const vd_camera *camera,
                           const char *word) {
    vd_frame *frame = NULL;
    assert_ok(vd_frame_create(context, 40, 30, 0, &frame));
    const vd_status status = vd_terrain_render(context, NULL, def, camera, frame, NULL);
    assert_int_equal(status.code, VD_ERROR_ARGUMENT);
    assert_non_null(strstr(status.message, word));
    vd_frame_destroy(&frame);
}

static void wrong_defs_are_refused(void **state) {
    (void)state;
    vd_context *context = test_context(1, vd_isa_best());
    vd_function *function = compile(context, texts[0]);
    const vd_function_grid grid = {0.0, 0.0, 1.0, 4, 4};
    vd_heightfield *map = NULL;
    assert_ok(vd_function_heightfield(context, NULL, function, &grid, &map));
    vd_camera camera = camera_at(0, -200, 90, 0, -0.3, 0.8, 40, 30);
    vd_terrain_def def = vd_terrain_def_default();
    assert_refused(context, &def, &camera, "neither");
    def.function = function;
    def.heightfield = map;
    assert_refused(context, &def, &camera, "both");
    def.heightfield = NULL;
    const double cells[] = {0.0, -1.0, NAN, INFINITY};
    for (int i = 0; i < 4; i++) {
        def.cell_m = cells[i];
        assert_refused(context, &def, &camera, "cell_m");
    }
    def.cell_m = 1.0;
    def.far_m = -1.0;
    assert_refused(context, &def, &camera, "far_m");
    def.far_m = 0.0;
    def.window = (vd_terrain_window){0, 0, 1, 1};
    assert_refused(context, &def, &camera, "window");
    def.window = (vd_terrain_window){0, 0, 0, 0};
    camera.eye.x = 1e30;
    assert_refused(context, &def, &camera, "origin");
    vd_heightfield_destroy(context, &map);
    vd_function_destroy(context, &function);
    vd_context_destroy(&context);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(march_draws_what_raycast_draws),
        cmocka_unit_test(a_renderer_draws_as_a_new_one),
        cmocka_unit_test(it_is_the_sampled_heightfield),
        cmocka_unit_test(the_horizon_is_far),
        cmocka_unit_test(loose_bounds_draw_the_same),
        cmocka_unit_test(every_allocation_may_fail),
        cmocka_unit_test(a_cancelled_job_stops),
        cmocka_unit_test(wrong_defs_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

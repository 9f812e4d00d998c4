/* Quads blended into frames: every SIMD level against the reference, identity, shared edges,
 * fading, hidden parts, and numbers at their ends. */
#include <math.h>
#include <veduta/display.h>
#include "display/display_kernels.h"
#include "display_scenes.h"
#include "support.h"

static vd_frame *make_frame(vd_context *context, int width, int height) {
    vd_frame *frame = NULL;
    assert_ok(vd_frame_create(context, width, height, 0, &frame));
    return frame;
}

static void fill(vd_frame *frame, uint32_t color) {
    for (size_t i = 0; i < frame->stride * (size_t)frame->height; i++) {
        memcpy(frame->rgba + 4 * i, &color, 4);
    }
}

static void assert_same_pixels(const vd_frame *a, const vd_frame *b) {
    for (int y = 0; y < a->height; y++) {
        const size_t at = 4 * a->stride * (size_t)y;
        assert_memory_equal(a->rgba + at, b->rgba + at, 4 * (size_t)a->width);
    }
}

static void draw(vd_context *context, vd_frame *frame, const vd_quad *quads, int count,
                 bool hidden) {
    vd_display_def def = vd_display_def_default();
    def.draw_hidden = hidden;
    vd_display *display = NULL;
    assert_ok(vd_display_create(context, &display));
    assert_ok(vd_display_draw(display, NULL, frame, quads, count, &def));
    vd_display_destroy(&display);
}

/* ---- kernels ----------------------------------------------------------------------------------*/

static float any_float(uint64_t *random, double usual) {
    static const float extremes[] = {0, -0.0f, 1, -1, 1e-40f, 1e30f, -1e30f, -0.125f, 256};
    const uint64_t r = test_random(random);
    return r % 5 == 0 ? extremes[(r >> 8) % 9] : (float)(usual * (2 * test_uniform(random) - 1));
}

/* The step, or 0 where the kernel's contract forbids it. */
static float near_step(const vd_display_line *line, int begin, int end, float step) {
    for (int x = begin; x < end; x++) {
        const double n = x - line->base;
        if (!(fabs(n / (1 + n * (double)line->bend) * (double)step) < VD_DISPLAY_FAR)) {
            return 0;
        }
    }
    return step;
}

static void levels_equal_the_reference(void **state) {
    (void)state;
    static uint8_t expected[4 * 512] __attribute__((aligned(64)));
    static uint8_t got[4 * 512] __attribute__((aligned(64)));
    uint64_t random = 3;
    for (int round = 0; round < 30000; round++) {
        vd_display_line line = {0};
        line.width = 2 + (int)(test_random(&random) % 40);
        line.height = 2 + (int)(test_random(&random) % 20);
        line.stride = line.width + (int)(test_random(&random) % 3);
        /* Exactly what may be read, so that the sanitizers see a texel too many. */
        const size_t bytes = 4 * (size_t)(line.stride * (line.height - 1) + line.width);
        uint8_t *texels = malloc(bytes);
        for (size_t i = 0; i < bytes; i++) {
            texels[i] = round % 3 == 0 ? (uint8_t)(255 * (test_random(&random) & 1))
                                       : (uint8_t)test_random(&random);
        }
        line.texels = texels;
        const int begin = (int)(test_random(&random) % 512);
        const int end = begin + (int)(test_random(&random) % (uint64_t)(513 - begin));
        const int before_it = (int)(test_random(&random) % 20);
        const bool last = test_random(&random) % 2 == 0;
        line.base = last ? end - 1 + before_it : begin - before_it;
        line.whole_u = (int)(test_random(&random) % 20000) - 5000;
        line.whole_v = (int)(test_random(&random) % 10000) - 2500;
        if (round % 50 == 0) {
            line.whole_u = round % 100 == 0 ? VD_DISPLAY_FAR : -VD_DISPLAY_FAR;
        }
        line.part_u = (float)test_uniform(&random);
        line.part_v = (float)test_uniform(&random);
        float depth[512];
        for (int i = 0; i < 512; i++) {
            depth[i] = any_float(&random, 1);
        }
        line.depth = round % 3 == 1 ? depth : NULL;
        line.depth_at = any_float(&random, 1);
        line.depth_step = any_float(&random, 0.01);
        line.bend = fabsf(any_float(&random, round % 2 == 0 ? 0.01 : 1)) * (last ? -1 : 1);
        line.bend = round % 7 == 0 ? 0 : line.bend;
        line.step_u = near_step(&line, begin, end, any_float(&random, 600));
        line.step_v = near_step(&line, begin, end, any_float(&random, 600));
        line.opacity = round % 4 == 0 ? 255 : 1 + (uint32_t)(test_random(&random) % 255);
        line.opaque = round % 5 == 0;
        for (int i = 0; i < 4 * 512; i++) {
            expected[i] = round % 5 == 0 ? 255 : (uint8_t)test_random(&random);
        }
        uint8_t before[4 * 512];
        memcpy(before, expected, sizeof before);
        vd_display_kernels_reference.blend(expected, &line, begin, end);
        for (int isa = VD_ISA_V2; isa <= (int)vd_isa_best(); isa++) {
            memcpy(got, before, sizeof got);
            vd_display_kernels_for((vd_isa)isa)->blend(got, &line, begin, end);
            assert_memory_equal(got, expected, sizeof got);
        }
        free(texels);
    }
}

/* Pixels where the frame's depth is nearer than the quad's keep their bytes, others are as without
 * a test; a quad that counts as nearer is hidden less. */
static void nearer_depth_hides(void **state) {
    (void)state;
    vd_context *context = test_context(2, VD_ISA_AUTO);
    vd_frame *frame = NULL, *all = make_frame(context, 200, 100);
    assert_ok(vd_frame_create(context, 200, 100, VD_PLANE_DEPTH, &frame));
    uint8_t red[4 * 4 * 4];
    for (int i = 0; i < 16; i++) {
        memcpy(red + 4 * i, (const uint8_t[4]){255, 0, 0, 255}, 4);
    }
    /* From the left, 10 m away, to the right, 20 m. */
    vd_quad quad = {.corners = {{100, 50, 10}, {3800, 100, 20}, {3800, 1900, 20}, {100, 950, 10}},
                    .picture = {.rgba = red, .width = 4, .height = 4, .stride = 4},
                    .opacity = 255};
    vd_display *display = NULL;
    vd_display_def def = vd_display_def_default();
    def.near_m = 0.5f;
    assert_ok(vd_display_create(context, &display));
    assert_ok(vd_display_draw(display, NULL, all, &quad, 1, &def));
    def.test_depth = true;
    assert_int_equal(vd_display_draw(display, NULL, all, &quad, 1, &def).code, VD_ERROR_ARGUMENT);
    for (int k = 0; k < 2; k++) {
        quad.nearer = k == 0 ? 0.0f : 1.25f;
        fill(frame, 0);
        for (size_t i = 0; i < frame->stride * 100; i++) {
            frame->depth[i] = 0.5f / 14.0f; /* a wall 14 m away */
        }
        assert_ok(vd_display_draw(display, NULL, frame, &quad, 1, &def));
        for (int x = 12; x < 188; x++) {
            /* 1/w is straight between the corners at x = 10 and 190. */
            const double inverse = 0.1 + (x + 0.5 - 10) / 180 * (0.05 - 0.1);
            const bool seen = inverse * (k == 0 ? 1.0 : 1.25) >= 1 / 14.0;
            const size_t at = 4 * (frame->stride * 50 + (size_t)x);
            assert_memory_equal(frame->rgba + at, seen ? all->rgba + at : (uint8_t[4]){0}, 4);
        }
    }
    quad.nearer = 0.5f;
    assert_int_equal(vd_display_draw(display, NULL, frame, &quad, 1, &def).code, VD_ERROR_ARGUMENT);
    vd_display_destroy(&display);
    vd_frame_destroy(&frame);
    vd_frame_destroy(&all);
    vd_context_destroy(&context);
}

/* ---- scenes -----------------------------------------------------------------------------------*/

/* Levels, threads, and with what is hidden drawn or not: the same frame. */
static void scenes_are_the_same_everywhere(void **state) {
    (void)state;
    static const struct {
        int threads;
        vd_isa isa;
        bool hidden;
    } ways[] = {{1, VD_ISA_V2, false},
                {2, VD_ISA_V3, false},
                {7, VD_ISA_V4, false},
                {1, VD_ISA_V2, true},
                {7, VD_ISA_V3, true}};
    display_scene *scene = malloc(sizeof *scene);
    for (int seed = 0; seed < 300; seed++) {
        display_scene_make(scene, (uint64_t)seed);
        vd_frame *first = NULL;
        vd_context *contexts[5] = {0};
        for (int way = 0; way < 5; way++) {
            if (ways[way].isa > vd_isa_best()) {
                continue;
            }
            contexts[way] = test_context(ways[way].threads, ways[way].isa);
            vd_frame *frame = make_frame(contexts[way], scene->width, scene->height);
            fill(frame, scene->background);
            draw(contexts[way], frame, scene->quads, scene->quad_count, ways[way].hidden);
            if (first == NULL) {
                first = frame;
            } else {
                assert_same_pixels(first, frame);
                vd_frame_destroy(&frame);
            }
        }
        vd_frame_destroy(&first);
        for (int way = 0; way < 5; way++) {
            vd_context_destroy(&contexts[way]);
        }
    }
    free(scene);
}

/* A picture laid exactly on the pixels comes out as it is, from perspective corners too. */
static void identity(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    uint64_t random = 5;
    enum { W = 61, H = 37 };
    static uint8_t texels[4 * W * H];
    for (int round = 0; round < 200; round++) {
        for (int i = 0; i < W * H; i++) {
            const uint32_t alpha = round % 2 == 0 ? 255 : (uint32_t)(test_random(&random) % 256);
            for (int c = 0; c < 4; c++) {
                texels[4 * i + c] = (uint8_t)(c == 3 ? alpha : test_random(&random) % (alpha + 1));
            }
        }
        vd_frame *frame = make_frame(context, 100, 80);
        const int left = (int)(test_random(&random) % 60) - 20;
        const int top = (int)(test_random(&random) % 60) - 20;
        /* A power of two, so that the corners hold the place exactly. */
        const float w = round % 3 == 0 ? 1.0f : (float)(1 << test_random(&random) % 12);
        vd_quad quad = {.picture = {texels, W, H, W, {0}}, .opacity = 255};
        display_scene_screen(&quad, left, top, W, H, w);
        draw(context, frame, &quad, 1, false);
        for (int y = 0; y < 80; y++) {
            for (int x = 0; x < 100; x++) {
                const int u = x - left, v = y - top;
                static const uint8_t nothing[4] = {0};
                assert_memory_equal(
                    frame->rgba + 4 * (frame->stride * (size_t)y + (size_t)x),
                    u >= 0 && v >= 0 && u < W && v < H ? texels + 4 * (v * W + u) : nothing, 4);
            }
        }
        vd_frame_destroy(&frame);
    }
    vd_context_destroy(&context);
}

/* ---- edges ------------------------------------------------------------------------------------*/

static vd_camera random_camera(uint64_t *random, int width, int height) {
    vd_camera camera = {.near_m = 0.1, .far_m = 1e4, .projection = VD_PROJECTION_PERSPECTIVE};
    camera.eye = vd_vec3_make(4 + 4 * test_uniform(random), 4 + 4 * test_uniform(random),
                              0.2 + 3 * test_uniform(random));
    camera.orientation = vd_orientation_from_angles(
        6.28 * test_uniform(random), -1.5 * test_uniform(random), test_uniform(random) - 0.5);
    camera.lens = vd_lens_from_fov(0.3 + 1.5 * test_uniform(random), width, height);
    return camera;
}

/* A ground of quads that share corners: every pixel that its quads cover is covered once. A white
 * picture of alpha 64 gives 64 where once, 0 in a gap, 112 where twice. The same from cells that
 * are bent (the ground's corners jump up and down), seen from above, where none hides another. */
static void shared_edges_have_no_crack(void **state) {
    (void)state;
    enum { N = 12, W = 160, H = 120 };
    static uint8_t texels[4 * 4 * 4];
    memset(texels, 64, sizeof texels);
    vd_context *context = test_context(1, VD_ISA_AUTO);
    vd_frame *frame = make_frame(context, W, H);
    static vd_quad quads[N * N];
    uint64_t random = 9;
    long once = 0;
    for (int round = 0; round < 600; round++) {
        const bool snapped = round % 3 == 0; /* corners and edges through pixel centres */
        vd_camera camera = random_camera(&random, W, H);
        if (snapped) {
            camera.eye = vd_vec3_make(6, 6, 4);
            camera.orientation = vd_orientation_from_angles(0, -1.5707963267948966, 0);
            camera.lens = (vd_lens){32, 32, 80.5, 60.5};
        }
        vd_vec3 at[N + 1][N + 1];
        for (int i = 0; i <= N; i++) {
            for (int j = 0; j <= N; j++) {
                const bool bent = round % 3 == 1;
                at[i][j] = vd_vec3_make(j + (bent ? 0.3 * test_uniform(&random) : 0), i, 0);
            }
        }
        for (int i = 0; i < N * N; i++) {
            const int r = i / N, c = i % N;
            const vd_vec3 corners[4] = {at[r][c], at[r][c + 1], at[r + 1][c + 1], at[r + 1][c]};
            quads[i] = (vd_quad){.picture = {texels, 4, 4, 4, {0}}, .opacity = 255};
            assert_ok(vd_quad_place(&quads[i], &camera, corners));
        }
        fill(frame, 0);
        draw(context, frame, quads, N * N, false);
        for (int y = 0; y < H; y++) {
            for (int x = 0; x < W; x++) {
                const vd_ray ray = vd_camera_ray(&camera, x + 0.5, y + 0.5);
                const double t = -ray.origin.z / ray.direction.z;
                const double gx = ray.origin.x + t * ray.direction.x;
                const double gy = ray.origin.y + t * ray.direction.y;
                const int alpha = frame->rgba[4 * (frame->stride * (size_t)y + (size_t)x) + 3];
                assert_true(alpha == 0 || alpha == 64);
                if (t > 0.02 && gx > 0.4 && gx < N - 0.1 && gy > 0.1 && gy < N - 0.1) {
                    assert_int_equal(alpha, 64);
                    once++;
                }
            }
        }
    }
    assert_true(once > 1000000);
    vd_frame_destroy(&frame);
    vd_context_destroy(&context);
}

/* The texel that a pixel shows is where the plane is hit: a picture whose colours are its
 * coordinates, against rays. */
static void texels_stand_where_rays_hit(void **state) {
    (void)state;
    enum { W = 160, H = 120, SIDE = 200 };
    static uint8_t texels[4 * SIDE * SIDE];
    for (int i = 0; i < SIDE * SIDE; i++) {
        texels[4 * i] = (uint8_t)(i % SIDE);
        texels[4 * i + 1] = (uint8_t)(i / SIDE);
        texels[4 * i + 3] = 255;
    }
    vd_context *context = test_context(1, VD_ISA_AUTO);
    vd_frame *frame = make_frame(context, W, H);
    uint64_t random = 10;
    long compared = 0;
    for (int round = 0; round < 300; round++) {
        const vd_camera camera = random_camera(&random, W, H);
        const vd_vec3 corners[4] = {{0, 12, 0}, {12, 12, 0}, {12, 0, 0}, {0, 0, 0}};
        vd_quad quad = {.picture = {texels, SIDE, SIDE, SIDE, {0}}, .opacity = 255};
        assert_ok(vd_quad_place(&quad, &camera, corners));
        fill(frame, 0);
        draw(context, frame, &quad, 1, false);
        for (int y = 0; y < H; y++) {
            for (int x = 0; x < W; x++) {
                const vd_ray ray = vd_camera_ray(&camera, x + 0.5, y + 0.5);
                const double t = -ray.origin.z / ray.direction.z;
                const double u = (ray.origin.x + t * ray.direction.x) / 12 * SIDE - 0.5;
                const double v = (1 - (ray.origin.y + t * ray.direction.y) / 12) * SIDE - 0.5;
                if (!(t > 0.02) || u < 1 || u > SIDE - 2 || v < 1 || v > SIDE - 2) {
                    continue;
                }
                const uint8_t *p = frame->rgba + 4 * (frame->stride * (size_t)y + (size_t)x);
                /* Half a step of 8 bits, two roundings of it, and the corners' as floats. */
                assert_true(fabs(p[0] - u) < 0.6 && fabs(p[1] - v) < 0.6);
                compared++;
            }
        }
    }
    assert_true(compared > 500000);
    vd_frame_destroy(&frame);
    vd_context_destroy(&context);
}

/* ---- fading -----------------------------------------------------------------------------------*/

/* An opaque picture that goes out as the same comes in, over itself: nothing changes. Else no more
 * than opacity's own rounding, and never a colour above alpha. */
static void fading_keeps_sums(void **state) {
    (void)state;
    enum { W = 48, H = 16 };
    static uint8_t texels[4 * W * H];
    vd_context *context = test_context(1, VD_ISA_AUTO);
    vd_frame *frame = make_frame(context, W, H);
    uint64_t random = 12;
    for (int t = 0; t <= 255; t++) {
        for (int i = 0; i < W * H; i++) {
            for (int c = 0; c < 4; c++) {
                texels[4 * i + c] = c == 3 ? 255 : (uint8_t)test_random(&random);
            }
        }
        vd_quad quads[3];
        for (int i = 0; i < 3; i++) {
            quads[i] = (vd_quad){.picture = {texels, W, H, W, {0}}, .opacity = 255};
            display_scene_screen(&quads[i], 0, 0, W, H, 1);
        }
        quads[1].opacity = (uint8_t)(255 - t);
        quads[2].opacity = (uint8_t)t;
        fill(frame, 0);
        draw(context, frame, quads, 3, false);
        for (int y = 0; y < H; y++) {
            assert_memory_equal(frame->rgba + 4 * frame->stride * (size_t)y, texels + 4 * W * y,
                                4 * W);
        }
        for (int i = 0; i < W * H; i++) {
            const uint8_t alpha = (uint8_t)test_random(&random);
            for (int c = 0; c < 4; c++) {
                texels[4 * i + c] = c == 3 ? alpha : (uint8_t)(test_random(&random) % (alpha + 1u));
            }
        }
        draw(context, frame, quads, 3, false);
        for (size_t i = 0; i < frame->stride * H; i++) {
            const uint8_t *p = frame->rgba + 4 * i;
            assert_true((i % frame->stride >= W) || (p[0] <= p[3] && p[1] <= p[3] && p[2] <= p[3]));
        }
    }
    vd_frame_destroy(&frame);
    vd_context_destroy(&context);
}

/* ---- numbers at their ends --------------------------------------------------------------------*/

static void extremes_are_safe(void **state) {
    (void)state;
    static const float values[] = {0,     1,     -1,     0.5f,   100,    -100,    1e9f,
                                   -1e9f, 3e38f, -3e38f, 1e-38f, 1e-45f, -1e-45f, 0.011f};
    static uint8_t texels[4 * 3 * 3];
    memset(texels, 200, sizeof texels);
    vd_context *context = test_context(1, VD_ISA_AUTO);
    vd_context *plain = test_context(1, VD_ISA_V2);
    vd_frame *frame = make_frame(context, 77, 50), *other = make_frame(plain, 77, 50);
    uint64_t random = 14;
    for (int round = 0; round < 20000; round++) {
        vd_quad quad = {.picture = {texels, 3, 3, 3, {0, 0, 0, 0}}, .opacity = 200};
        for (int i = 0; i < 12; i++) {
            ((float *)quad.corners)[i] = values[test_random(&random) % 14];
        }
        if (round % 2 == 0) {
            vd_quad_corner *c = quad.corners;
            c[2] = (vd_quad_corner){c[1].x / 2 + c[3].x / 2, c[1].y / 2 + c[3].y / 2, c[1].w};
        }
        fill(frame, 0x40302010);
        fill(other, 0x40302010);
        draw(context, frame, &quad, 1, false);
        draw(plain, other, &quad, 1, true);
        assert_same_pixels(frame, other);
    }
    /* A billion pixels wide, seen in part: its middle texel everywhere. */
    texels[4 * 4] = 7;
    vd_quad huge = {.picture = {texels, 3, 3, 3, {0}}, .opacity = 255};
    fill(frame, 0);
    display_scene_screen(&huge, -500000000, -500000000, 1000000000, 1000000000, 1);
    draw(context, frame, &huge, 1, false);
    assert_int_equal(frame->rgba[4 * (frame->stride * 20 + 30)], 7);
    vd_frame_destroy(&frame);
    vd_frame_destroy(&other);
    vd_context_destroy(&plain);
    vd_context_destroy(&context);
}

static void refuse(vd_display *display, vd_frame *frame, const vd_quad *quad,
                   const vd_display_def *def, const char *part) {
    const vd_status status = vd_display_draw(display, NULL, frame, quad, 1, def);
    assert_int_equal(status.code, VD_ERROR_ARGUMENT);
    assert_non_null(strstr(status.message, part));
}

static void bad_input_is_refused(void **state) {
    (void)state;
    static uint8_t texels[4 * 3 * 3];
    vd_context *context = test_context(1, VD_ISA_AUTO);
    vd_frame *frame = make_frame(context, 16, 16);
    vd_display *display = NULL;
    assert_ok(vd_display_create(context, &display));
    vd_quad good = {.picture = {texels, 3, 3, 3, {0}}, .opacity = 255};
    display_scene_screen(&good, 0, 0, 3, 3, 1);
    assert_ok(vd_display_draw(display, NULL, frame, &good, 1, NULL));
    assert_ok(vd_display_draw(display, NULL, frame, NULL, 0, NULL));
    for (int i = 0; i < 12; i++) {
        vd_quad bad = good;
        ((float *)bad.corners)[i] = i % 2 == 0 ? NAN : INFINITY;
        refuse(display, frame, &bad, NULL, "quad 0: a corner is not finite");
    }
    vd_quad bad = good;
    bad.picture.rgba = NULL;
    refuse(display, frame, &bad, NULL, "no pixels");
    bad = good;
    bad.picture.width = 1;
    refuse(display, frame, &bad, NULL, "out of range");
    bad = good;
    bad.picture.stride = 2;
    refuse(display, frame, &bad, NULL, "out of range");
    bad = good;
    bad.picture.opaque[2] = 4;
    refuse(display, frame, &bad, NULL, "opaque rectangle");
    vd_display_def def = vd_display_def_default();
    def.near_m = NAN;
    refuse(display, frame, &good, &def, "near_m");
    assert_int_equal(vd_display_draw(display, NULL, frame, &good, (1 << 24) + 1, NULL).code,
                     VD_ERROR_LIMIT);
    vd_camera camera = {.near_m = 0.1, .lens = {10, 10, 8, 8}, .orientation = {1, 0, 0, 0}};
    const vd_vec3 corners[4] = {{0, 0, 0}, {1, 0, 0}, {1, NAN, 0}, {0, 1, 0}};
    const vd_status status = vd_quad_place(&good, &camera, corners);
    assert_int_equal(status.code, VD_ERROR_ARGUMENT);
    assert_non_null(strstr(status.message, "corner 2"));
    vd_display_destroy(&display);
    vd_display_destroy(&display);
    vd_frame_destroy(&frame);
    vd_context_destroy(&context);
}

/* The second frame allocates nothing; without memory nothing is drawn and nothing is lost. */
static void memory(void **state) {
    (void)state;
    static display_scene scene;
    display_scene_make(&scene, 1);
    for (int fail_at = 0; fail_at < 9; fail_at++) {
        test_allocator allocator = {0};
        vd_context *context = test_failing_context(&allocator);
        vd_frame *frame = make_frame(context, scene.width, scene.height);
        allocator.fail_at = fail_at == 0 ? 0 : allocator.calls + fail_at;
        vd_display *display = NULL;
        vd_status status = vd_display_create(context, &display);
        if (status.code == VD_OK) {
            status = vd_display_draw(display, NULL, frame, scene.quads, scene.quad_count, NULL);
        }
        assert_true(status.code == VD_OK || status.code == VD_ERROR_MEMORY);
        assert_true(fail_at != 0 || status.code == VD_OK);
        const int calls = allocator.calls;
        if (status.code == VD_OK) {
            assert_ok(vd_display_draw(display, NULL, frame, scene.quads, scene.quad_count, NULL));
            assert_int_equal(allocator.calls, calls);
        }
        vd_display_destroy(&display);
        vd_frame_destroy(&frame);
        vd_context_destroy(&context);
        assert_int_equal(allocator.live, 0);
    }
}

static void opaque_rectangles_are_opaque(void **state) {
    (void)state;
    uint64_t random = 20;
    static uint8_t texels[4 * 40 * 30];
    int found = 0;
    for (int round = 0; round < 2000; round++) {
        const int width = 2 + (int)(test_random(&random) % 38);
        const int height = 2 + (int)(test_random(&random) % 28);
        const uint64_t holes = 1 + test_random(&random) % 300;
        for (int i = 0; i < width * height; i++) {
            texels[4 * i + 3] = test_random(&random) % holes == 0 ? 254 : 255;
        }
        vd_quad_picture picture = {texels, width, height, (size_t)width, {0}};
        vd_quad_picture_find_opaque(&picture);
        const int *o = picture.opaque;
        for (int y = o[1]; y < o[3]; y++) {
            for (int x = o[0]; x < o[2]; x++) {
                assert_int_equal(texels[4 * (y * width + x) + 3], 255);
            }
        }
        found += o[2] > o[0] ? 1 : 0;
    }
    assert_true(found > 1000);
}

/* Nothing is drawn outside of what a quad is said to cover. */
static void areas_are_bounds(void **state) {
    (void)state;
    static uint8_t texels[4 * 4];
    memset(texels, 255, sizeof texels);
    vd_context *context = test_context(1, VD_ISA_AUTO);
    vd_frame *frame = make_frame(context, 60, 40);
    vd_quad quad = {.picture = {texels, 2, 2, 2, {0}}, .opacity = 255};
    const vd_display_def def = {.near_m = 0.5f};
    vd_display *display = NULL;
    assert_ok(vd_display_create(context, &display));
    uint64_t random = 8;
    int seen = 0, none = 0;
    for (int i = 0; i < (test_is_reduced() ? 500 : 20000); i++) {
        for (int k = 0; k < 4; k++) { /* a parallelogram, some of it behind the eye now and then */
            vd_quad_corner *c = &quad.corners[k];
            const vd_quad_corner *a = quad.corners;
            *c = k == 2 ? a[1]
                        : (vd_quad_corner){(float)(400 * test_uniform(&random) - 150),
                                           (float)(300 * test_uniform(&random) - 120),
                                           (float)(6 * test_uniform(&random) - 1.5)};
        }
        const vd_quad_corner *a = quad.corners;
        quad.corners[2] = (vd_quad_corner){a[1].x + a[3].x - a[0].x, a[1].y + a[3].y - a[0].y,
                                           a[1].w + a[3].w - a[0].w};
        fill(frame, 0);
        assert_ok(vd_display_draw(display, NULL, frame, &quad, 1, &def));
        int pixels = 0;
        for (int y = 0; y < 40; y++) {
            for (int x = 0; x < 60; x++) {
                pixels += frame->rgba[4 * (frame->stride * (size_t)y + (size_t)x) + 3] != 0;
            }
        }
        const double area = vd_quad_pixels(&quad, def.near_m, 60, 40);
        assert_true(area >= 0 && area <= 60 * 40);
        assert_true(pixels <= area + 60 + 40 + 1);
        assert_true(area > 0 || pixels == 0);
        seen += pixels > 0;
        none += area == 0;
    }
    assert_true(seen > 50 && none > 50);
    /* What is beside the picture covers nothing of it, though it comes through the near plane. */
    display_scene_screen(&quad, 10, 5, 20, 30, 2);
    assert_true(fabs(vd_quad_pixels(&quad, 0.5f, 60, 40) - 20 * 30) < 1e-3);
    assert_true(fabs(vd_quad_pixels(&quad, 0.5f, 20, 10) - 10 * 5) < 1e-3);
    assert_true(vd_quad_pixels(&quad, 3.0f, 60, 40) == 0.0);
    const vd_quad_corner beside[4] = {{-9, 0, 2}, {-9, 0, -2}, {-9, 9, -2}, {-9, 9, 2}};
    memcpy(quad.corners, beside, sizeof beside);
    assert_true(vd_quad_pixels(&quad, 0.5f, 60, 40) == 0.0);
    quad.corners[1].x = NAN;
    quad.corners[3].w = INFINITY;
    assert_true(vd_quad_pixels(&quad, 0.5f, 60, 40) >= 0.0);
    vd_display_destroy(&display);
    vd_frame_destroy(&frame);
    vd_context_destroy(&context);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(levels_equal_the_reference),
        cmocka_unit_test(nearer_depth_hides),
        cmocka_unit_test(scenes_are_the_same_everywhere),
        cmocka_unit_test(identity),
        cmocka_unit_test(shared_edges_have_no_crack),
        cmocka_unit_test(texels_stand_where_rays_hit),
        cmocka_unit_test(fading_keeps_sums),
        cmocka_unit_test(extremes_are_safe),
        cmocka_unit_test(bad_input_is_refused),
        cmocka_unit_test(memory),
        cmocka_unit_test(opaque_rectangles_are_opaque),
        cmocka_unit_test(areas_are_bounds),
    };
    return cmocka_run_group_tests_name("display", tests, NULL, NULL);
}

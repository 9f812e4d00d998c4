/* Drawing with exact coverage: the same bytes everywhere, blending, the seam between neighbours and
 * both its cures, memory, bad input. */
#include "coverage_scenes.h"

static const uint16_t WHITE[4] = {65535, 65535, 65535, 65535};
static const uint16_t CLEAR[4] = {0, 0, 0, 0};

static void set_color(uint16_t color[4], uint16_t r, uint16_t g, uint16_t b, uint16_t a) {
    color[0] = r;
    color[1] = g;
    color[2] = b;
    color[3] = a;
}

/* ---- a scene with everything ------------------------------------------------------------------*/

enum { LAYERS = 300, POINTS = 14 };

typedef struct scene {
    double points[LAYERS][POINTS][2];
    uint8_t verbs[8];
    vd_stroke strokes[LAYERS];
    vd_layer layers[LAYERS];
} scene;

static scene *make_scene(double size) {
    static const uint8_t verbs[] = {VD_PATH_MOVE,      VD_PATH_CUBIC, VD_PATH_LINE,
                                    VD_PATH_QUADRATIC, VD_PATH_LINE,  VD_PATH_CLOSE};
    scene *s = calloc(1, sizeof *s);
    assert_non_null(s);
    uint64_t random = 20;
    memcpy(s->verbs, verbs, sizeof verbs);
    for (int i = 0; i < LAYERS; i++) {
        vd_layer *layer = &s->layers[i];
        *layer = vd_layer_default();
        const double scale = i % 4 == 0 ? size : 9;
        random_corners(&random, scale, POINTS, s->points[i]);
        layer->path.points = (const double(*)[2])s->points[i];
        layer->path.point_count = i % 3 == 0 ? 8 : 3 + (size_t)i % 4;
        layer->path.verbs = i % 3 == 0 ? s->verbs : NULL;
        layer->path.verb_count = i % 3 == 0 ? sizeof verbs : 0;
        layer->picture_from_path.x0 = i % 4 == 0 ? 0 : test_uniform(&random) * size;
        layer->picture_from_path.y0 = i % 4 == 0 ? 0 : test_uniform(&random) * size;
        layer->rule = (vd_fill_rule)(i % 2);
        layer->expand = i % 7 == 0 ? 0.5 : 0;
        const uint16_t alpha = (uint16_t)(test_random(&random) >> 48);
        for (int c = 0; c < 4; c++) {
            layer->fill[c] = c == 3 ? alpha : (uint16_t)(alpha * test_uniform(&random));
        }
        if (i % 5 == 0) {
            s->strokes[i] = vd_stroke_default();
            s->strokes[i].width = 0.3 + i % 6;
            s->strokes[i].join = (vd_join)(i / 5 % 3);
            s->strokes[i].cap = (vd_cap)(i / 15 % 3);
            s->strokes[i].dash_count = i % 10 == 0 ? 2 : 0;
            s->strokes[i].dashes[0] = s->strokes[i].dashes[1] = 3;
            layer->stroke = &s->strokes[i];
            layer->filled = i % 10 != 0;
        }
    }
    return s;
}

static uint64_t draw_scene(int threads, vd_isa isa, const scene *s, int width, int height) {
    vd_context *context = test_context(threads, isa);
    vd_coverage *coverage = NULL;
    vd_frame *frame = NULL;
    assert_ok(vd_coverage_create(context, &coverage));
    assert_ok(vd_frame_create(context, width, height, 0, &frame));
    assert_ok(vd_coverage_draw_frame(coverage, NULL, NULL, s->layers, LAYERS, frame));
    const uint64_t hash = vd_frame_hash(frame);
    vd_frame_destroy(&frame);
    vd_coverage_destroy(&coverage);
    vd_context_destroy(&context);
    return hash;
}

static void threads_and_levels_draw_the_same(void **state) {
    (void)state;
    scene *s = make_scene(200);
    static const int threads[] = {1, 2, 7};
    const uint64_t expected = draw_scene(1, VD_ISA_V2, s, 201, 155);
    for (int isa = VD_ISA_V2; isa <= (int)vd_isa_best(); isa++) {
        for (int i = 0; i < 3; i++) {
            assert_true(draw_scene(threads[i], (vd_isa)isa, s, 201, 155) == expected);
        }
    }
    free(s);
}

/* Batches and chunks must not show: many small layers that overlap, against one call for each. */
static void layers_keep_their_order(void **state) {
    (void)state;
    enum { COUNT = 9000 };
    vd_context *context = test_context(2, VD_ISA_AUTO);
    vd_coverage *coverage = NULL;
    vd_target *a = NULL, *b = NULL;
    assert_ok(vd_coverage_create(context, &coverage));
    assert_ok(vd_target_create(context, 50, 50, 1, &a));
    assert_ok(vd_target_create(context, 50, 50, 1, &b));
    vd_layer *layers = calloc(COUNT, sizeof *layers);
    assert_non_null(layers);
    static const double corners[3][2] = {{0, 0}, {7, 1}, {2, 6}};
    uint64_t random = 21;
    for (int i = 0; i < COUNT; i++) {
        layers[i] = vd_layer_default();
        layers[i].path.points = corners;
        layers[i].path.point_count = 3;
        layers[i].picture_from_path.x0 = 48 * test_uniform(&random);
        layers[i].picture_from_path.y0 = 48 * test_uniform(&random);
        layers[i].fill[i % 3] = 65535;
    }
    vd_target_clear(a, WHITE);
    vd_target_clear(b, WHITE);
    assert_ok(vd_coverage_draw(coverage, NULL, NULL, layers, COUNT, a));
    for (int i = 0; i < COUNT; i++) {
        assert_ok(vd_coverage_draw(coverage, NULL, NULL, &layers[i], 1, b));
    }
    for (size_t y = 0; y < 50; y++) {
        assert_memory_equal(a->color + 4 * y * a->stride, b->color + 4 * y * b->stride, 50 * 8);
    }
    free(layers);
    vd_target_destroy(&a);
    vd_target_destroy(&b);
    vd_coverage_destroy(&coverage);
    vd_context_destroy(&context);
}

/* ---- blending ---------------------------------------------------------------------------------*/

static void targets_and_frames_agree(void **state) {
    (void)state;
    vd_context *context = test_context(2, VD_ISA_AUTO);
    vd_coverage *coverage = NULL;
    vd_target *target = NULL;
    vd_frame *frame = NULL, *resolved = NULL;
    scene *s = make_scene(90);
    assert_ok(vd_coverage_create(context, &coverage));
    assert_ok(vd_frame_create(context, 100, 90, 0, &frame));
    assert_ok(vd_frame_create(context, 100, 90, 0, &resolved));
    assert_ok(vd_coverage_draw_frame(coverage, NULL, NULL, s->layers, LAYERS, frame));
    for (int samples = 1; samples <= 8; samples += samples == 1 ? 3 : 4) {
        /* In two windows. */
        assert_ok(vd_target_create(context, 100, 50, samples, &target));
        for (int part = 0; part < 2; part++) {
            target->y = 40 * part;
            vd_target_clear(target, CLEAR);
            assert_ok(vd_coverage_draw(coverage, NULL, NULL, s->layers, LAYERS, target));
            vd_target_resolve(target, resolved);
        }
        assert_true(vd_frame_hash(resolved) == vd_frame_hash(frame));
        vd_target_destroy(&target);
    }
    free(s);
    vd_frame_destroy(&frame);
    vd_frame_destroy(&resolved);
    vd_coverage_destroy(&coverage);
    vd_context_destroy(&context);
}

typedef struct shading {
    const vd_coverage *coverage;
    vd_target *target;
} shading;

/* A shader: the colour of a pixel from its place. */
static void shade(void *user, const vd_span *span) {
    const shading *s = user;
    uint16_t colors[64][4];
    uint16_t *row = s->target->color + 4 * ((size_t)span->y * s->target->stride + (size_t)span->x);
    for (int i = 0; i < span->count; i++) {
        set_color(colors[i], (uint16_t)(1000 * (span->x + i)), (uint16_t)(1000 * span->y), 0,
                  65535);
    }
    if (span->stroke) {
        vd_coverage_blend(s->coverage, span, WHITE, row);
    } else {
        vd_coverage_blend_colors(s->coverage, span, (const uint16_t(*)[4])colors, row);
    }
}

static void any_shader_fills_spans(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    vd_coverage *coverage = NULL;
    vd_target *target = NULL;
    assert_ok(vd_coverage_create(context, &coverage));
    assert_ok(vd_target_create(context, 64, 64, 1, &target));
    vd_target_clear(target, CLEAR);
    static const double corners[4][2] = {{4.5, 4.5}, {40, 4.5}, {40, 30}, {4.5, 30}};
    const vd_stroke stroke = vd_stroke_default();
    vd_layer layer = vd_layer_default();
    layer.path.points = corners;
    layer.path.point_count = 4;
    layer.stroke = &stroke;
    shading s = {coverage, target};
    assert_ok(vd_coverage_spans(coverage, NULL, NULL, &layer, 1, 0, 0, 64, 64, shade, &s));
    const uint16_t *pixels = target->color;
    const size_t at = 4 * (20 * target->stride + 10);
    assert_int_equal(pixels[at], 10000);
    assert_int_equal(pixels[at + 1], 20000);
    assert_int_equal(pixels[at + 3], 65535);
    /* The corner: half a pixel each way of the stroke's miter, all of the pixel. */
    assert_int_equal(pixels[4 * (4 * target->stride + 4) + 3], 65535);
    assert_int_equal(pixels[4 * (4 * target->stride + 3) + 3], 0);
    vd_target_destroy(&target);
    vd_coverage_destroy(&coverage);
    vd_context_destroy(&context);
}

/* ---- the seam ---------------------------------------------------------------------------------*/

/* Two black neighbours whose common edge goes through a target; returns the most of the background
 * that shows in the middle of the picture. */
static int draw_neighbours(vd_coverage *coverage, vd_target *target, double slant, double expand,
                           bool divide) {
    const double top = 20.5 - 12 * slant, bottom = 20.5 + 12 * slant;
    const double left[4][2] = {{-9, -4}, {top, -4}, {bottom, 44}, {-9, 44}};
    const double right[4][2] = {{top, -4}, {49, -4}, {49, 44}, {bottom, 44}};
    vd_layer layers[2] = {vd_layer_default(), vd_layer_default()};
    layers[0].path.points = left;
    layers[1].path.points = right;
    layers[0].path.point_count = layers[1].path.point_count = 4;
    layers[0].expand = layers[1].expand = expand;
    vd_target_clear(target, divide ? CLEAR : WHITE);
    assert_ok(vd_coverage_draw(coverage, NULL, NULL, layers, 2, target));
    if (divide) {
        vd_coverage_divide(target);
    }
    int most = 0;
    for (int y = 0; y < target->height; y++) {
        for (int x = 0; x < target->width; x++) {
            const uint16_t *p = target->color + 4 * ((size_t)y * target->stride + (size_t)x);
            assert_true(divide || p[3] == 65535);
            const int seen = p[0] + (65535 - p[3]);
            most = seen > most ? seen : most;
        }
    }
    return most;
}

static void the_seam_shows_and_goes(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    vd_coverage *coverage = NULL;
    vd_target *target = NULL;
    assert_ok(vd_coverage_create(context, &coverage));
    assert_ok(vd_target_create(context, 40, 40, 1, &target));
    static const double slants[] = {0, 0.3, 1, 1.3};
    for (int i = 0; i < 4; i++) {
        /* Half of the background, twice: about a quarter is left. */
        assert_in_range(draw_neighbours(coverage, target, slants[i], 0, false), 12000, 16500);
        /* Known background: none is left. */
        assert_int_equal(draw_neighbours(coverage, target, slants[i], 0, true), 0);
        /* Unknown: half a pixel is enough for upright edges, √½ for all. */
        const int half = draw_neighbours(coverage, target, slants[i], 0.5, false);
        assert_in_range(half, 0, i == 0 ? 0 : 150);
        assert_int_equal(draw_neighbours(coverage, target, slants[i], 0.7072, false), 0);
    }
    vd_target_destroy(&target);
    vd_coverage_destroy(&coverage);
    vd_context_destroy(&context);
}

/* ---- memory -----------------------------------------------------------------------------------*/

static void warm_pictures_allocate_nothing(void **state) {
    (void)state;
    vd_context *context = test_context(2, VD_ISA_AUTO);
    vd_coverage *coverage = NULL;
    vd_frame *frame = NULL;
    scene *s = make_scene(120);
    assert_ok(vd_coverage_create(context, &coverage));
    assert_ok(vd_frame_create(context, 128, 128, 0, &frame));
    assert_ok(vd_coverage_draw_frame(coverage, NULL, NULL, s->layers, LAYERS, frame));
    const uint64_t before = vd_context_memory(context).allocations;
    assert_ok(vd_coverage_draw_frame(coverage, NULL, NULL, s->layers, LAYERS, frame));
    assert_true(vd_context_memory(context).allocations == before);
    free(s);
    vd_frame_destroy(&frame);
    vd_coverage_destroy(&coverage);
    vd_context_destroy(&context);
}

static void no_memory_is_a_status(void **state) {
    (void)state;
    scene *s = make_scene(60);
    test_allocator allocator = {0, 0, 0};
    bool finished = false;
    for (int n = 1; !finished; n++) {
        allocator = (test_allocator){0, 0, 0};
        vd_context *context = test_failing_context(&allocator);
        vd_coverage *coverage = NULL;
        vd_frame *frame = NULL;
        assert_ok(vd_frame_create(context, 64, 64, 0, &frame));
        allocator.fail_at = allocator.calls + n;
        vd_status status = vd_coverage_create(context, &coverage);
        if (status.code == VD_OK) {
            status = vd_coverage_draw_frame(coverage, NULL, NULL, s->layers, LAYERS, frame);
        }
        if (status.code == VD_OK) {
            vd_coverage_def def = vd_coverage_def_default();
            def.method = VD_COVERAGE_REFERENCE;
            status = vd_coverage_draw_frame(coverage, NULL, &def, s->layers, 3, frame);
        }
        finished = status.code == VD_OK;
        assert_true(finished || status.code == VD_ERROR_MEMORY);
        vd_coverage_destroy(&coverage);
        vd_frame_destroy(&frame);
        vd_context_destroy(&context);
        assert_int_equal(allocator.live, 0);
    }
    free(s);
}

/* ---- bad input --------------------------------------------------------------------------------*/

static vd_status try_layer(vd_layer *layers) {
    vd_context *context = test_context(1, VD_ISA_AUTO);
    vd_coverage *coverage = NULL;
    vd_frame *frame = NULL;
    assert_ok(vd_coverage_create(context, &coverage));
    assert_ok(vd_frame_create(context, 20, 20, 0, &frame));
    const uint64_t before = vd_frame_hash(frame);
    const vd_status status = vd_coverage_draw_frame(coverage, NULL, NULL, layers, 2, frame);
    assert_true(status.code == VD_OK || vd_frame_hash(frame) == before);
    vd_frame_destroy(&frame);
    vd_coverage_destroy(&coverage);
    vd_context_destroy(&context);
    return status;
}

static void expect(vd_status status, vd_code code, const char *part) {
    assert_int_equal(status.code, code);
    if (strstr(status.message, part) == NULL) {
        fail_msg("'%s' is not in: %s", part, status.message);
    }
}

/* The second of two layers is what is wrong; its first is fine. */
static void bad_layers_are_refused(void **state) {
    (void)state;
    double points[4][2] = {{1, 1}, {9, 1}, {9, 9}, {1, 9}};
    vd_layer good = vd_layer_default();
    good.path.points = (const double(*)[2])points;
    good.path.point_count = 4;
    vd_layer layers[2] = {good, good};
    static const double bad[] = {NAN, INFINITY, -INFINITY, 1e300, 6e8, -6e8};
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        double other[4][2];
        memcpy(other, points, sizeof other);
        other[2][i % 2] = bad[i];
        layers[1].path.points = (const double(*)[2])other;
        expect(try_layer(layers), i < 3 ? VD_ERROR_ARGUMENT : VD_ERROR_LIMIT, "layer 1: point 2");
    }
    layers[1] = good;
    layers[1].picture_from_path.xx = NAN;
    expect(try_layer(layers), VD_ERROR_ARGUMENT, "layer 1: point 0");
    layers[1] = good;
    layers[1].path.points = NULL;
    expect(try_layer(layers), VD_ERROR_ARGUMENT, "points are null");
    layers[1] = good;
    layers[1].rule = VD_FILL_RULE_COUNT;
    expect(try_layer(layers), VD_ERROR_ARGUMENT, "fill rule");
    layers[1] = good;
    layers[1].expand = -1;
    expect(try_layer(layers), VD_ERROR_ARGUMENT, "expanded");
    uint8_t verbs[] = {VD_PATH_LINE, VD_PATH_LINE, VD_PATH_LINE, VD_PATH_LINE};
    layers[1] = good;
    layers[1].path.verbs = verbs;
    layers[1].path.verb_count = 4;
    expect(try_layer(layers), VD_ERROR_ARGUMENT, "VD_PATH_MOVE");
    verbs[0] = VD_PATH_MOVE;
    verbs[3] = VD_PATH_CUBIC;
    expect(try_layer(layers), VD_ERROR_ARGUMENT, "6 points");
    verbs[3] = 77;
    expect(try_layer(layers), VD_ERROR_ARGUMENT, "77");
    verbs[3] = VD_PATH_LINE;
    assert_ok(try_layer(layers));
    layers[1].path.point_count = layers[1].path.verb_count = 0; /* nothing is fine */
    assert_ok(try_layer(layers));
}

static void bad_strokes_are_refused(void **state) {
    (void)state;
    const double points[4][2] = {{1, 1}, {9, 1}, {9, 9}, {1, 9}};
    vd_stroke stroke;
    vd_layer layers[2] = {vd_layer_default(), vd_layer_default()};
    for (int i = 0; i < 2; i++) {
        layers[i].path.points = points;
        layers[i].path.point_count = 4;
    }
    layers[1].stroke = &stroke;
    static const double widths[] = {0, -1, NAN, INFINITY, 1e6};
    for (size_t i = 0; i < sizeof widths / sizeof widths[0]; i++) {
        stroke = vd_stroke_default();
        stroke.width = widths[i];
        expect(try_layer(layers), VD_ERROR_ARGUMENT, "layer 1: the stroke's width");
    }
    stroke = vd_stroke_default();
    stroke.join = VD_JOIN_COUNT;
    expect(try_layer(layers), VD_ERROR_ARGUMENT, "join");
    stroke = vd_stroke_default();
    stroke.miter_limit = 0.5;
    expect(try_layer(layers), VD_ERROR_ARGUMENT, "miter");
    stroke = vd_stroke_default();
    stroke.dash_count = 3;
    expect(try_layer(layers), VD_ERROR_ARGUMENT, "3 dashes");
    stroke.dash_count = 2;
    stroke.dashes[0] = stroke.dashes[1] = 1e-9;
    expect(try_layer(layers), VD_ERROR_ARGUMENT, "paler");
    stroke.dashes[0] = -1;
    stroke.dashes[1] = 5;
    expect(try_layer(layers), VD_ERROR_ARGUMENT, "negative");
    stroke.dashes[0] = 0;
    assert_ok(try_layer(layers));
}

static void ignore_span(void *user, const vd_span *span) {
    (void)user;
    (void)span;
}

static void bad_calls_are_refused(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    vd_coverage *coverage = NULL;
    vd_frame *frame = NULL;
    vd_job *job = NULL;
    assert_ok(vd_coverage_create(context, &coverage));
    assert_ok(vd_frame_create(context, 20, 20, 0, &frame));
    assert_ok(vd_job_create(context, &job));
    static const double points[3][2] = {{1, 1}, {9, 1}, {9, 9}};
    vd_layer layer = vd_layer_default();
    layer.path.points = points;
    layer.path.point_count = 3;
    vd_coverage_def def = vd_coverage_def_default();
    assert_ok(vd_coverage_draw_frame(coverage, NULL, NULL, NULL, 0, frame));
    expect(vd_coverage_draw_frame(coverage, NULL, NULL, NULL, 1, frame), VD_ERROR_ARGUMENT, "null");
    expect(vd_coverage_draw_frame(coverage, NULL, NULL, &layer, 1, NULL), VD_ERROR_ARGUMENT,
           "null");
    expect(vd_coverage_draw(coverage, NULL, NULL, &layer, 1, NULL), VD_ERROR_ARGUMENT, "null");
    expect(vd_coverage_spans(coverage, NULL, NULL, &layer, 1, 0, 0, 9, 9, NULL, NULL),
           VD_ERROR_ARGUMENT, "null");
    expect(vd_coverage_spans(coverage, NULL, NULL, &layer, 1, 0, 0, 0, 9, ignore_span, NULL),
           VD_ERROR_ARGUMENT, "window");
    expect(
        vd_coverage_spans(coverage, NULL, NULL, &layer, 1, INT32_MIN, 0, 9, 9, ignore_span, NULL),
        VD_ERROR_LIMIT, "window");
    def.tolerance = NAN;
    expect(vd_coverage_draw_frame(coverage, NULL, &def, &layer, 1, frame), VD_ERROR_ARGUMENT,
           "tolerance");
    def.tolerance = 0;
    def.method = VD_COVERAGE_METHOD_COUNT;
    expect(vd_coverage_draw_frame(coverage, NULL, &def, &layer, 1, frame), VD_ERROR_ARGUMENT,
           "method");
    for (int method = 0; method < VD_COVERAGE_METHOD_COUNT; method++) {
        def.method = (vd_coverage_method)method;
        assert_string_not_equal(vd_coverage_method_name(def.method), "unknown");
        vd_job_reset(job);
        vd_job_cancel(job);
        expect(vd_coverage_draw_frame(coverage, job, &def, &layer, 1, frame), VD_ERROR_CANCELLED,
               "");
    }
    assert_string_equal(vd_coverage_method_name(VD_COVERAGE_METHOD_COUNT), "unknown");
    vd_coverage_destroy(NULL);
    vd_job_destroy(&job);
    vd_frame_destroy(&frame);
    vd_coverage_destroy(&coverage);
    vd_context_destroy(&context);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(threads_and_levels_draw_the_same),
        cmocka_unit_test(layers_keep_their_order),
        cmocka_unit_test(targets_and_frames_agree),
        cmocka_unit_test(any_shader_fills_spans),
        cmocka_unit_test(the_seam_shows_and_goes),
        cmocka_unit_test(warm_pictures_allocate_nothing),
        cmocka_unit_test(no_memory_is_a_status),
        cmocka_unit_test(bad_layers_are_refused),
        cmocka_unit_test(bad_strokes_are_refused),
        cmocka_unit_test(bad_calls_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

/* Map furniture: round numbers, scale bars of true length, the arrow's direction, the legend's
 * colours and heights, any picture's size, texts outlined once, bad input. Letters are boxes. */
#include "support.h"

#include <math.h>
#include <stdio.h>
#include <veduta/coverage.h>
#include "core/real.h"
#include "world/furniture_internal.h"

static vd_context *context;
static vd_coverage *coverage;

static int set_up(void **state) {
    (void)state;
    context = test_context(1, VD_ISA_AUTO);
    assert_ok(vd_coverage_create(context, &coverage));
    return 0;
}

static int tear_down(void **state) {
    (void)state;
    vd_coverage_destroy(&coverage);
    vd_context_destroy(&context);
    return 0;
}

/* ---- letters ------------------------------------------------------------------------------------
 */

/* Remembers what was outlined. */
typedef struct writer {
    vd_context *context;
    int count, fail_at;
    char texts[64][64];
} writer;

/* A box as wide as the text, half an em a byte, from the baseline up by 0.72 em. */
static vd_status outline_box(void *user, const char *utf8, double size_px, vd_outline *out) {
    writer *w = user;
    if (++w->count == w->fail_at) {
        return vd_failure(VD_ERROR_FORMAT, "no letters today");
    }
    snprintf(w->texts[w->count % 64], sizeof w->texts[0], "%s", utf8);
    const double width = 0.5 * size_px * (double)strlen(utf8), height = 0.72 * size_px;
    double(*points)[2] = vd_allocate(w->context, 4, sizeof *points);
    if (points == NULL) {
        return vd_failure(VD_ERROR_MEMORY, "no memory for letters");
    }
    const double corners[4][2] = {{0, 0}, {width, 0}, {width, -height}, {0, -height}};
    memcpy(points, corners, sizeof corners);
    *out = (vd_outline){.context = w->context,
                        .path = {.points = (const double(*)[2])points, .point_count = 4},
                        .advance = width,
                        .ascent = 0.9 * size_px,
                        .descent = 0.2 * size_px,
                        .ink = {0, -height, width, 0}};
    return vd_success();
}

static bool was_written(const writer *w, const char *text) {
    for (int i = 1; i <= w->count && i < 64; i++) {
        if (strcmp(w->texts[i], text) == 0) {
            return true;
        }
    }
    return false;
}

static vd_furniture_def make_def(writer *w) {
    *w = (writer){.context = context};
    vd_furniture_def def = vd_furniture_def_default();
    def.outline = outline_box;
    def.outline_user = w;
    return def;
}

static vd_camera make_camera(vd_projection projection, double heading, double pitch, double fx) {
    return (vd_camera){.orientation = vd_orientation_from_angles(heading, pitch, 0),
                       .projection = projection,
                       .lens = {fx, fx, 400, 300},
                       .near_m = 1,
                       .far_m = 1e6};
}

/* ---- round numbers ------------------------------------------------------------------------------
 */

static void lengths_are_round(void **state) {
    (void)state;
    static const struct {
        double most, length;
        int parts;
    } cases[] = {{1, 1, 5},         {1.99, 1, 5},     {2, 2, 4},        {4.99, 2, 4},
                 {5, 5, 5},         {9.99, 5, 5},     {10, 10, 5},      {0.3, 0.2, 4},
                 {0.001, 0.001, 5}, {123456, 1e5, 5}, {99999, 50000, 5}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        int parts = 0;
        assert_true(vd_round_length(cases[i].most, &parts) == cases[i].length);
        assert_int_equal(parts, cases[i].parts);
    }
}

static void numbers_are_written(void **state) {
    (void)state;
    static const struct {
        double value, step;
        const char *text;
    } cases[] = {{0, 500, "0"},
                 {2500, 500, "2500"},
                 {-200, 100,
                  "\xE2\x88\x92"
                  "200"},
                 {7.5, 2.5, "7.5"},
                 {5.0, 2.5, "5.0"},
                 {0.3, 0.1, "0.3"},
                 {-0.05, 0.05,
                  "\xE2\x88\x92"
                  "0.05"},
                 {1.25, 0.25, "1.25"},
                 {123456789, 1, "123456789"},
                 {-1e-12, 1, "0"}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        char text[40];
        vd_round_text(cases[i].value, cases[i].step, text, sizeof text);
        assert_string_equal(text, cases[i].text);
    }
}

static void any_range_has_round_labels(void **state) {
    (void)state;
    uint64_t random = 5;
    int plain = 0, all = 0;
    for (int round = 0; round < 20000; round++) {
        const double size = vd_exp(test_uniform(&random) * 18 - 4);
        const double min = (test_uniform(&random) - 0.5) * 4 * size, max = min + size;
        double labels[VD_ROUND_LABELS], step = 0;
        const int count = vd_round_labels(min, max, labels, &step);
        assert_in_range(count, 4, 6);
        for (int i = 0; i < count; i++) {
            assert_true(labels[i] >= min - 1e-6 * size && labels[i] <= max + 1e-6 * size);
            assert_true(fabs(labels[i] / step - floor(labels[i] / step + 0.5)) < 1e-6);
            assert_true(i == 0 || fabs(labels[i] - labels[i - 1] - step) < 1e-6 * step);
        }
        /* 1, 2 or 5 wherever one of them gives as many. */
        double mantissa = step;
        for (; mantissa >= 9.9999; mantissa /= 10) {
        }
        for (; mantissa < 0.99999; mantissa *= 10) {
        }
        plain +=
            fabs(mantissa - 1) < 1e-3 || fabs(mantissa - 2) < 1e-3 || fabs(mantissa - 5) < 1e-3;
        all++;
    }
    assert_true(plain * 10 > all * 7);
    double labels[VD_ROUND_LABELS], step;
    assert_int_equal(vd_round_labels(1, 1, labels, &step), 0);
    assert_int_equal(vd_round_labels(2, 1, labels, &step), 0);
    assert_int_equal(vd_round_labels(NAN, 1, labels, &step), 0);
    assert_int_equal(vd_round_labels(0, INFINITY, labels, &step), 0);
    assert_int_equal(vd_round_labels(1e8, 1e8 + 1, labels, &step), 0);
    assert_int_equal(vd_round_labels(0, 4810, labels, &step), 5);
    assert_true(step == 1000 && labels[4] == 4000);
}

/* ---- scale bar ----------------------------------------------------------------------------------
 */

/* The length of the bar, metres, as its text says. */
static double said_length(const writer *w) {
    double number = 0;
    char unit[8] = "";
    for (int i = 1; i <= w->count; i++) {
        if (sscanf(w->texts[i], "%lf %7s", &number, unit) == 2) {
            break;
        }
    }
    assert_true(strcmp(unit, "m") == 0 || strcmp(unit, "km") == 0);
    return strcmp(unit, "km") == 0 ? number * 1000 : number;
}

static void scale_bars_are_as_long_as_they_say(void **state) {
    (void)state;
    uint64_t random = 6;
    for (int round = 0; round < 2000; round++) {
        writer w;
        vd_furniture_def def = make_def(&w);
        def.scale = true;
        vd_furniture *furniture = NULL;
        assert_ok(vd_furniture_create(context, &def, &furniture));
        const bool flat = round % 2 == 0;
        const double pitch = -test_uniform(&random) * 1.5;
        const double fx = vd_exp(flat ? test_uniform(&random) * 16 - 8 : test_uniform(&random) * 8);
        const double ground_m = vd_exp(test_uniform(&random) * 10);
        const vd_camera camera =
            make_camera(flat ? VD_PROJECTION_ORTHOGRAPHIC : VD_PROJECTION_PERSPECTIVE,
                        test_uniform(&random) * 6, pitch, fx);
        const int width = 400 + (int)(test_random(&random) % 3000), height = 500;
        vd_overlay overlay;
        assert_ok(vd_furniture_arrange(furniture, &camera, width, height, ground_m, &overlay));
        assert_int_equal(overlay.kept_count, 1);
        /* A halo, then the bar. */
        const double(*bar)[2] = overlay.layers[1].path.points;
        const double length = bar[1][0] - bar[0][0];
        assert_float_equal(length / (flat ? fx : fx / ground_m) / said_length(&w), 1, 1e-9);
        const double room = 0.22 * width < 18 * 11 ? 0.22 * width : 18 * 11;
        assert_true(length <= room * 1.000001 && length > room / 2.51);
        assert_true(was_written(&w, "0"));
        /* Letters: "0", the length, and on slanted views a note. */
        assert_true(overlay.layers[overlay.layer_count - 1].path.point_count == 4);
        const bool slanted = !flat && pitch > vd_radians(-60);
        const vd_outline *note = &furniture->slots[VD_TEXT_SCALE_NOTE].outline;
        assert_true((overlay.layers[overlay.layer_count - 1].path.points == note->path.points) ==
                    slanted);
        vd_furniture_destroy(&furniture);
    }
}

static void without_a_distance_there_is_no_bar(void **state) {
    (void)state;
    writer w;
    vd_furniture_def def = make_def(&w);
    def.scale = true;
    vd_furniture *furniture = NULL;
    assert_ok(vd_furniture_create(context, &def, &furniture));
    static const double distances[] = {0, -5, INFINITY, NAN, 1e-300, 1e300};
    const vd_camera camera = make_camera(VD_PROJECTION_PERSPECTIVE, 0, 0, 1000);
    for (size_t i = 0; i < sizeof distances / sizeof distances[0]; i++) {
        vd_overlay overlay;
        assert_ok(vd_furniture_arrange(furniture, &camera, 800, 600, distances[i], &overlay));
        assert_true(overlay.layer_count == 0 && overlay.kept_count == 0);
    }
    vd_furniture_destroy(&furniture);
}

/* ---- north --------------------------------------------------------------------------------------
 */

static void the_arrow_points_north(void **state) {
    (void)state;
    uint64_t random = 8;
    writer w;
    vd_furniture_def def = make_def(&w);
    def.north = true;
    def.size_px = 60; /* whole pixels matter little */
    vd_furniture *furniture = NULL;
    assert_ok(vd_furniture_create(context, &def, &furniture));
    for (int round = 0; round < 500; round++) {
        const vd_projection projection = (vd_projection)(round % 2);
        const double pitch = round % 3 == 0 ? -VD_PI / 2 : (test_uniform(&random) - 0.6) * 2;
        const double heading = test_uniform(&random) * 2 * VD_PI;
        vd_camera camera = make_camera(projection, heading, pitch, 1000);
        camera.eye = vd_vec3_make(0, 0, 1000);
        vd_overlay overlay;
        assert_ok(vd_furniture_arrange(furniture, &camera, 1600, 1200, 0, &overlay));
        const float *kept = overlay.kept[0];
        const double x = 0.5 * ((double)kept[0] + (double)kept[2]);
        const double y = 0.5 * ((double)kept[1] + (double)kept[3]);
        /* The tip of the kite, the first point of every shape. */
        for (int i = 0; i < 3; i++) {
            const vd_affine *m = &overlay.layers[i].picture_from_path;
            const double *p = overlay.layers[i].path.points[0];
            const double tip_x = m->xx * p[0] + m->xy * p[1] + m->x0 - x;
            const double tip_y = m->yx * p[0] + m->yy * p[1] + m->y0 - y;
            const double length = sqrt(tip_x * tip_x + tip_y * tip_y);
            assert_float_equal(tip_x / length, -sin(heading), 1e-3);
            assert_float_equal(tip_y / length, -cos(heading), 1e-3);
        }
        /* And it is where the camera sees north, when it looks straight down. */
        if (round % 3 == 0) {
            double x0, y0, x1, y1, z;
            assert_true(vd_camera_project(&camera, vd_vec3_make(0, 0, 0), &x0, &y0, &z));
            assert_true(vd_camera_project(&camera, vd_vec3_make(0, 10, 0), &x1, &y1, &z));
            const double length = sqrt((x1 - x0) * (x1 - x0) + (y1 - y0) * (y1 - y0));
            assert_float_equal((x1 - x0) / length, -sin(heading), 1e-6);
            assert_float_equal((y1 - y0) / length, -cos(heading), 1e-6);
        }
    }
    vd_furniture_destroy(&furniture);
}

/* ---- pictures -----------------------------------------------------------------------------------
 */

static vd_frame *draw(const vd_overlay *overlay, int width, int height) {
    vd_frame *frame = NULL;
    assert_ok(vd_frame_create(context, width, height, 0, &frame));
    assert_ok(
        vd_coverage_draw_frame(coverage, NULL, NULL, overlay->layers, overlay->layer_count, frame));
    return frame;
}

static void legends_show_colors_and_heights(void **state) {
    (void)state;
    static vd_colormap map;
    static const char *const names[] = {"terrain", "viridis", "topo"};
    for (int i = 0; i < 3; i++) {
        writer w;
        vd_furniture_def def = make_def(&w);
        assert_true(vd_colormap_find(names[i], &map));
        def.legend = &map;
        def.legend_min = i == 2 ? -310 : 120;
        def.legend_max = 4810;
        def.size_px = 20;
        vd_furniture *furniture = NULL;
        assert_ok(vd_furniture_create(context, &def, &furniture));
        const vd_camera camera = make_camera(VD_PROJECTION_PERSPECTIVE, 0, 0, 1000);
        vd_overlay overlay;
        assert_ok(vd_furniture_arrange(furniture, &camera, 800, 1000, 0, &overlay));
        assert_true(was_written(&w, "1000") && was_written(&w, "4000"));
        assert_true(was_written(&w, "0") == (i == 2));
        assert_true(was_written(&w, "Height (m)"));
        vd_frame *frame = draw(&overlay, 800, 1000);
        /* Its slices come after a halo and a frame: from one's middle to another's. */
        const double(*top)[2] = overlay.layers[2].path.points;
        const int x = (int)(0.5 * (top[0][0] + top[1][0])), y0 = (int)top[0][1], rows = 220;
        for (int row = 0; row < rows; row++) {
            const double height =
                def.legend_max - (def.legend_max - def.legend_min) * ((row + 0.5) / rows);
            const vd_rgba8 right = vd_colormap_at(&map, height, def.legend_min, def.legend_max);
            const uint8_t *drawn =
                frame->rgba + 4 * ((size_t)(y0 + row) * frame->stride + (size_t)x);
            assert_int_equal(drawn[0], right.r);
            assert_int_equal(drawn[1], right.g);
            assert_int_equal(drawn[2], right.b);
        }
        vd_frame_destroy(&frame);
        /* Letters stand beside their heights. */
        for (int k = VD_TEXT_LEGEND_LABEL; k < VD_FURNITURE_TEXTS; k++) {
            const vd_furniture_slot *slot = &furniture->slots[k];
            for (size_t n = 0; n < overlay.layer_count && slot->text != NULL; n++) {
                const vd_layer *layer = &overlay.layers[n];
                if (layer->filled && layer->path.points == slot->outline.path.points) {
                    const double at = (def.legend_max - atof(slot->text)) /
                                      (def.legend_max - def.legend_min) * rows;
                    assert_float_equal(layer->picture_from_path.y0, y0 + at + 0.36 * 20, 1.0);
                }
            }
        }
        vd_furniture_destroy(&furniture);
    }
}

/* In pictures of any size: what is drawn lies in what labels keep out of, and these in the picture
 * and apart from each other. */
static void any_picture_is_furnished(void **state) {
    (void)state;
    static vd_colormap map;
    assert_true(vd_colormap_find("terrain", &map));
    uint64_t random = 9;
    writer w;
    vd_furniture_def def = make_def(&w);
    def.title = "A Title that Is Long Enough to Be Made Smaller";
    def.north = def.scale = true;
    def.legend = &map;
    def.legend_max = 3000;
    vd_furniture *furniture = NULL;
    assert_ok(vd_furniture_create(context, &def, &furniture));
    size_t most = 0;
    for (int round = 0; round < 150; round++) {
        const int width = 1 + (int)(test_random(&random) % 1200);
        const int height = 1 + (int)(test_random(&random) % 900);
        const vd_camera camera = make_camera((vd_projection)(round % 2), test_uniform(&random) * 6,
                                             -test_uniform(&random), 0.5 + test_uniform(&random));
        vd_overlay overlay;
        w.count = 0;
        assert_ok(vd_furniture_arrange(furniture, &camera, width, height, 12, &overlay));
        most = overlay.kept_count > most ? overlay.kept_count : most;
        vd_frame *frame = draw(&overlay, width, height);
        for (int i = 0; i < width * height; i++) {
            const int x = i % width, y = i / width;
            bool inside = frame->rgba[4 * ((size_t)y * frame->stride + (size_t)x) + 3] == 0;
            for (size_t k = 0; k < overlay.kept_count && !inside; k++) {
                const float *r = overlay.kept[k];
                inside = (float)(x + 1) >= r[0] && (float)x <= r[2] && (float)(y + 1) >= r[1] &&
                         (float)y <= r[3];
            }
            assert_true(inside);
        }
        vd_frame_destroy(&frame);
        for (size_t k = 0; k < overlay.kept_count; k++) {
            const float *r = overlay.kept[k];
            assert_true(r[0] >= -1 && r[1] >= -1 && r[2] <= (float)width + 1 &&
                        r[3] <= (float)height + 1);
            for (size_t n = 0; n < k; n++) {
                const float *q = overlay.kept[n];
                assert_false(r[0] < q[2] && q[0] < r[2] && r[1] < q[3] && q[1] < r[3]);
            }
        }
    }
    assert_int_equal(most, 4);
    vd_furniture_destroy(&furniture);
}

static void texts_are_outlined_once(void **state) {
    (void)state;
    static vd_colormap map;
    assert_true(vd_colormap_find("terrain", &map));
    writer w;
    vd_furniture_def def = make_def(&w);
    char title[80] = "A title";
    def.title = title;
    def.north = def.scale = true;
    def.legend = &map;
    def.legend_max = 3000;
    vd_furniture *furniture = NULL;
    assert_ok(vd_furniture_create(context, &def, &furniture));
    memset(title, 'x', sizeof title); /* it was copied, and so was the colour map */
    memset(&map, 0xFF, sizeof map);
    vd_overlay overlay;
    vd_camera camera = make_camera(VD_PROJECTION_PERSPECTIVE, 0, 0, 1000);
    assert_ok(vd_furniture_arrange(furniture, &camera, 800, 600, 1000, &overlay));
    assert_true(was_written(&w, "A title"));
    const int count = w.count;
    const uint64_t allocations = vd_context_memory(context).allocations;
    camera.orientation = vd_orientation_from_angles(1, -0.2, 0);
    assert_ok(vd_furniture_arrange(furniture, &camera, 800, 600, 1001, &overlay));
    assert_int_equal(w.count, count);
    assert_int_equal(vd_context_memory(context).allocations, allocations);
    assert_ok(vd_furniture_arrange(furniture, &camera, 800, 600, 4000, &overlay));
    assert_int_equal(w.count, count + 1); /* another length */
    vd_furniture_destroy(&furniture);
    vd_furniture_destroy(&furniture);
}

static void letters_have_halos(void **state) {
    (void)state;
    writer w = {.context = context};
    vd_outline outline;
    assert_ok(outline_box(&w, "x", 40, &outline));
    vd_letters letters = vd_letters_default(40);
    vd_stroke stroke;
    vd_layer layers[2];
    assert_int_equal(vd_outline_layers(&outline, 3, 4, &letters, &stroke, layers), 2);
    assert_false(layers[0].filled);
    assert_true(layers[0].stroke == &stroke && stroke.width == 2 * letters.halo_width);
    assert_true(layers[1].filled && layers[1].stroke == NULL);
    assert_true(layers[1].picture_from_path.x0 == 3 && layers[1].picture_from_path.y0 == 4);
    assert_int_equal(layers[1].fill[0], 65535);
    letters.halo.a = 0;
    assert_int_equal(vd_outline_layers(&outline, 0, 0, &letters, &stroke, layers), 1);
    assert_true(layers[0].filled);
    vd_outline_finish(&outline);
    uint16_t color[4];
    vd_layer_color((vd_rgba8){255, 128, 0, 255}, color);
    assert_true(color[0] == 65535 && color[1] == 128 * 257 && color[2] == 0 && color[3] == 65535);
    vd_layer_color((vd_rgba8){255, 128, 0, 51}, color);
    assert_true(color[0] == color[3] && color[3] == 51 * 257);
    assert_int_equal(color[1], (int)(128 * 51 * 257 / 255.0 + 0.5));
}

/* ---- refusals -----------------------------------------------------------------------------------
 */

static void assert_refused(vd_status status, vd_code code, const char *part) {
    assert_int_equal(status.code, code);
    if (strstr(status.message, part) == NULL) {
        fail_msg("\"%s\" does not say \"%s\"", status.message, part);
    }
}

static void bad_input_is_refused(void **state) {
    (void)state;
    static char title[5000];
    static vd_colormap map;
    memset(title, 'x', sizeof title - 1);
    writer w;
    vd_furniture *furniture = NULL;
    vd_furniture_def def = make_def(&w);
    def.outline = NULL;
    assert_ok(vd_furniture_create(context, &def, &furniture)); /* nothing has no letters */
    vd_furniture_destroy(&furniture);
    def.north = true;
    assert_refused(vd_furniture_create(context, &def, &furniture), VD_ERROR_ARGUMENT, "outline");
    def = make_def(&w);
    static const double sizes[] = {-1, 2, 5000, NAN, INFINITY};
    for (size_t i = 0; i < sizeof sizes / sizeof sizes[0]; i++) {
        def.size_px = sizes[i];
        assert_refused(vd_furniture_create(context, &def, &furniture), VD_ERROR_ARGUMENT,
                       "size_px");
    }
    def = make_def(&w);
    def.title = title;
    assert_refused(vd_furniture_create(context, &def, &furniture), VD_ERROR_LIMIT, "longer");
    def = make_def(&w);
    def.legend = &map;
    assert_refused(vd_furniture_create(context, &def, &furniture), VD_ERROR_ARGUMENT, "0 stops");
    def = make_def(&w);
    def.title = "x";
    assert_ok(vd_furniture_create(context, &def, &furniture));
    vd_overlay overlay = {.kept_count = 7};
    vd_camera camera = make_camera(VD_PROJECTION_PERSPECTIVE, 0, 0, 1000);
    assert_refused(vd_furniture_arrange(furniture, &camera, 0, 600, 0, &overlay), VD_ERROR_ARGUMENT,
                   "0 x 600");
    camera.lens.fx = NAN;
    assert_int_equal(vd_furniture_arrange(furniture, &camera, 800, 600, 0, &overlay).code,
                     VD_ERROR_ARGUMENT);
    camera.lens.fx = 1000;
    w.fail_at = w.count + 1;
    assert_refused(vd_furniture_arrange(furniture, &camera, 800, 600, 0, &overlay), VD_ERROR_FORMAT,
                   "no letters today");
    assert_int_equal(overlay.kept_count, 7);
    assert_ok(vd_furniture_arrange(furniture, &camera, 800, 600, 0, &overlay));
    vd_furniture_destroy(&furniture);
}

static void memory_runs_out_cleanly(void **state) {
    (void)state;
    static vd_colormap map;
    assert_true(vd_colormap_find("terrain", &map));
    const vd_camera camera = make_camera(VD_PROJECTION_PERSPECTIVE, 0, 0, 1000);
    bool done = false;
    for (int fail_at = 2; !done; fail_at++) {
        test_allocator allocator = {.fail_at = 0};
        vd_context *failing = test_failing_context(&allocator);
        const int live = allocator.live;
        writer w;
        vd_furniture_def def = make_def(&w);
        w.context = failing;
        def.title = "A title";
        def.north = def.scale = true;
        def.legend = &map;
        def.legend_max = 3000;
        allocator.fail_at = fail_at;
        vd_furniture *furniture = NULL;
        vd_overlay overlay;
        vd_status status = vd_furniture_create(failing, &def, &furniture);
        for (int i = 0; i < 2 && status.code == VD_OK; i++) {
            status = vd_furniture_arrange(furniture, &camera, 800, 600, 1000 + 4000 * i, &overlay);
        }
        done = status.code == VD_OK;
        assert_true(done || status.code == VD_ERROR_MEMORY);
        vd_furniture_destroy(&furniture);
        assert_int_equal(allocator.live, live);
        vd_context_destroy(&failing);
        assert_true(fail_at < 200);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(lengths_are_round),
        cmocka_unit_test(numbers_are_written),
        cmocka_unit_test(any_range_has_round_labels),
        cmocka_unit_test(scale_bars_are_as_long_as_they_say),
        cmocka_unit_test(without_a_distance_there_is_no_bar),
        cmocka_unit_test(the_arrow_points_north),
        cmocka_unit_test(legends_show_colors_and_heights),
        cmocka_unit_test(any_picture_is_furnished),
        cmocka_unit_test(texts_are_outlined_once),
        cmocka_unit_test(letters_have_halos),
        cmocka_unit_test(bad_input_is_refused),
        cmocka_unit_test(memory_runs_out_cleanly),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}

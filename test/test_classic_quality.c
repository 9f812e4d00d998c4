/* test_classic_quality.c: what the options of the classic picture do: properties of the reference,
 * which test_march.c compares the march with; methods that refuse; the distance that does not
 * sparkle. */
#include <math.h>
#include "classic_scenes.h"

static vd_frame *draw(vd_context *context, const vd_heightfield *map, const vd_classic_def *def,
                      vd_classic_method method, int width, int height) {
    vd_frame *frame = NULL;
    assert_ok(vd_frame_create(context, width, height, VD_PLANE_DEPTH | VD_PLANE_ID, &frame));
    assert_ok(vd_classic_render(context, NULL, map, def, method, frame, NULL));
    return frame;
}

static const uint8_t *pixel(const vd_frame *frame, int column, int row) {
    return frame->rgba + 4 * ((size_t)row * frame->stride + (size_t)column);
}

static float depth_at(const vd_frame *frame, int column, int row) {
    return frame->depth[(size_t)row * frame->stride + (size_t)column];
}

/* ---- the linear filter ----------------------------------------------------------------------- */

/* Whole steps along the rows of the map: every point is a sample, where linear is nearest. */
static void linear_equals_nearest_at_samples(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    for (int type = 0; type < VD_HEIGHT_TYPE_COUNT; type++) {
        vd_heightfield *map = make_map(context, (map_kind){64, 48, (vd_height_type)type, 9});
        vd_classic_def def = small_def(type == VD_HEIGHT_U16 ? 70000.0 : 140.0);
        def.scale = type == VD_HEIGHT_U16 ? 0.1 : 30.0;
        def.step = 1.0;
        def.x = 5.0;
        def.y = 70.0;
        /* One column: d = left = (−1, −1). */
        vd_frame *nearest = draw(context, map, &def, VD_CLASSIC_REFERENCE, 1, 120);
        def.filter = VD_FILTER_LINEAR;
        vd_frame *linear = draw(context, map, &def, VD_CLASSIC_REFERENCE, 1, 120);
        if (type != VD_HEIGHT_F32) { /* a hole makes holes of the cells around it */
            assert_int_equal(vd_frame_hash(nearest), vd_frame_hash(linear));
        }
        vd_frame_destroy(&linear);
        vd_frame_destroy(&nearest);
        vd_heightfield_destroy(context, &map);
    }
    vd_context_destroy(&context);
}

/* A column that goes along the diagonal of a map of four samples, by hand. */
static void linear_by_hand(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    const uint8_t heights[4] = {10, 20, 40, 80};
    const uint8_t colors[12] = {0, 0, 0, 100, 0, 0, 0, 200, 0, 255, 255, 255};
    vd_picture *picture = NULL;
    assert_ok(vd_picture_create(context, 2, 2, 3, 8, &picture));
    memcpy(picture->data, colors, 6);
    memcpy((uint8_t *)picture->data + picture->stride_bytes, colors + 6, 6);
    vd_heightfield_def map_def = vd_heightfield_def_default();
    map_def.width = map_def.height = 2;
    map_def.type = VD_HEIGHT_U8;
    map_def.heights = heights;
    map_def.height_stride = 2;
    map_def.wraps = true;
    map_def.colors = picture;
    vd_heightfield *map = NULL;
    assert_ok(vd_heightfield_create(context, &map_def, &map));
    vd_classic_def def = vd_classic_def_default();
    def.filter = VD_FILTER_LINEAR;
    /* One slice, z = 1, d = (−1, −1): p = (0.5, 0.25). Height 10 + .5·10 = 15 and 40 + .5·40 = 60,
     * between them 15 + .25·45 = 26.25. Row (126.25 − 26.25)·1 + 0 = 100. */
    def.x = 1.5;
    def.y = 1.25;
    def.height = 126.25;
    def.scale = 1.0;
    def.horizon = 0.0;
    def.step = 100.0;
    def.distance = 50.0;
    vd_frame *frame = draw(context, map, &def, VD_CLASSIC_REFERENCE, 1, 102);
    assert_int_equal(frame->id[99 * frame->stride], 0);
    assert_int_equal(frame->id[100 * frame->stride], 1);
    /* Red (0, 100, 0, 255): 50, then (0·.5 + 255·.5) = 128; 50·.75 + 128·.25 = 69.5 → 70. */
    assert_int_equal(pixel(frame, 0, 100)[0], 70);
    assert_int_equal(pixel(frame, 0, 100)[1], 57); /* (0, 0, 200, 255): 0, 228; 57 */
    assert_int_equal(pixel(frame, 0, 100)[2], 32); /* (0, 0, 0, 255): 0, 128; 32 */
    vd_frame_destroy(&frame);
    vd_heightfield_destroy(context, &map);
    vd_picture_destroy(&picture);
    vd_context_destroy(&context);
}

/* ---- smooth ---------------------------------------------------------------------------------- */

/* Depth and silhouette are as before; each run keeps its colour in its top pixel; pixels of runs
 * of one keep theirs; the others lie between two visible samples' colours. */
static void smooth_keeps_the_tops(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    vd_heightfield *map = make_map(context, small_map);
    for (int filter = 0; filter < VD_FILTER_COUNT; filter++) {
        vd_classic_def def = small_def(78.0);
        def.filter = (vd_filter)filter;
        vd_frame *flat = draw(context, map, &def, VD_CLASSIC_REFERENCE, 90, 80);
        def.smooth = true;
        vd_frame *smooth = draw(context, map, &def, VD_CLASSIC_REFERENCE, 90, 80);
        int changed = 0;
        for (int i = 0; i < 90; i++) {
            for (int row = 0; row < 80; row++) {
                const float depth = depth_at(flat, i, row);
                assert_true(depth == depth_at(smooth, i, row));
                const bool top = row == 0 || depth_at(flat, i, row - 1) != depth;
                int end = row;
                while (end < 80 && depth_at(flat, i, end) == depth) {
                    end++;
                }
                if (top || depth == 0.0f || end == 80) { /* the first run ends at the bottom */
                    assert_memory_equal(pixel(flat, i, row), pixel(smooth, i, row), 4);
                    continue;
                }
                for (int channel = 0; channel < 3; channel++) {
                    const int a = pixel(flat, i, row)[channel], b = pixel(flat, i, end)[channel];
                    const int c = pixel(smooth, i, row)[channel];
                    assert_true((a <= c && c <= b) || (b <= c && c <= a));
                    changed += c != a;
                }
            }
        }
        assert_true(changed > 100);
        vd_frame_destroy(&smooth);
        vd_frame_destroy(&flat);
    }
    vd_heightfield_destroy(context, &map);
    vd_context_destroy(&context);
}

/* ---- samples --------------------------------------------------------------------------------- */

static bool is_edge(float a, float b) {
    return a > b * 1.125f || b > a * 1.125f;
}

/* One sample is none; more change pixels at edges only, and not their depth. */
static void samples_change_edges_only(void **state) {
    (void)state;
    vd_context *context = test_context(2, VD_ISA_AUTO);
    vd_heightfield *map = make_map(context, small_map);
    vd_classic_def def = small_def(78.0);
    vd_frame *single = draw(context, map, &def, VD_CLASSIC_REFERENCE, 90, 80);
    for (int samples = 1; samples <= 8; samples *= samples == 1 ? 4 : 2) {
        def.samples = samples;
        vd_frame *frame = draw(context, map, &def, VD_CLASSIC_COLUMNS, 90, 80);
        int changed = 0, edges = 0;
        for (int row = 0; row < 80; row++) {
            for (int i = 0; i < 90; i++) {
                const float d = depth_at(single, i, row);
                const bool edge = (i > 0 && is_edge(d, depth_at(single, i - 1, row))) ||
                                  (i < 89 && is_edge(d, depth_at(single, i + 1, row))) ||
                                  (row > 0 && is_edge(d, depth_at(single, i, row - 1))) ||
                                  (row < 79 && is_edge(d, depth_at(single, i, row + 1)));
                const bool same = memcmp(pixel(single, i, row), pixel(frame, i, row), 4) == 0;
                assert_true(edge || same);
                edges += edge;
                changed += !same;
            }
        }
        assert_true(samples == 1 ? changed == 0 : changed > edges / 3);
        assert_memory_equal(single->depth, frame->depth, 80 * single->stride * sizeof(float));
        vd_frame_destroy(&frame);
    }
    def.samples = 3;
    vd_frame *frame = NULL;
    assert_ok(vd_frame_create(context, 8, 8, 0, &frame));
    assert_int_equal(
        vd_classic_render(context, NULL, map, &def, VD_CLASSIC_MARCH, frame, NULL).code,
        VD_ERROR_ARGUMENT);
    vd_frame_destroy(&frame);
    vd_frame_destroy(&single);
    vd_heightfield_destroy(context, &map);
    vd_context_destroy(&context);
}

/* ---- mip ------------------------------------------------------------------------------------- */

/* How much the pixels of rows [first, end) change from picture to picture of a slow pan, as the
 * mean over pixels and channels of the variance in time. */
#define PAN_PICTURES 64
#define PAN_WIDTH 160
#define PAN_HEIGHT 120

static double pan_variance(vd_context *context, vd_classic_renderer *renderer, vd_classic_def def,
                           int first, int end) {
    static float sums[PAN_HEIGHT * PAN_WIDTH * 3], squares[PAN_HEIGHT * PAN_WIDTH * 3];
    memset(sums, 0, sizeof sums);
    memset(squares, 0, sizeof squares);
    vd_frame *frame = NULL;
    assert_ok(vd_frame_create(context, PAN_WIDTH, PAN_HEIGHT, 0, &frame));
    for (int t = 0; t < PAN_PICTURES; t++) {
        def.yaw_rad = 0.0005 * t; /* 0.03°, a 25th of a column */
        assert_ok(vd_classic_renderer_draw(renderer, NULL, &def, frame));
        for (int row = first; row < end; row++) {
            for (int i = 0; i < 3 * PAN_WIDTH; i++) {
                const float v = pixel(frame, i / 3, row)[i % 3];
                sums[row * PAN_WIDTH * 3 + i] += v;
                squares[row * PAN_WIDTH * 3 + i] += v * v;
            }
        }
    }
    vd_frame_destroy(&frame);
    double variance = 0.0;
    for (int i = first * PAN_WIDTH * 3; i < end * PAN_WIDTH * 3; i++) {
        const double mean = (double)sums[i] / PAN_PICTURES;
        variance += (double)squares[i] / PAN_PICTURES - mean * mean;
    }
    return variance / ((end - first) * PAN_WIDTH * 3);
}

/* Rough ground with colours of noise, seen from above: rows 30 to 70 show it from 290 to 1,500
 * samples away, where a column spans 4 to 19 of them. */
static void distance_does_not_sparkle(void **state) {
    (void)state;
    vd_context *context = test_context(2, VD_ISA_AUTO);
    vd_heightfield *map = make_map(context, (map_kind){256, 256, VD_HEIGHT_U8, 1992});
    vd_classic_renderer *renderer = NULL;
    assert_ok(vd_classic_renderer_create(context, map, &renderer));
    vd_classic_def def = vd_classic_def_default();
    def.height = 300.0;
    def.horizon = 20.0;
    def.scale = 60.0;
    def.distance = 1500.0;
    for (int filter = 0; filter < VD_FILTER_COUNT; filter++) {
        def.filter = (vd_filter)filter;
        def.mip = false;
        const double without = pan_variance(context, renderer, def, 30, 70);
        def.mip = true;
        const double with = pan_variance(context, renderer, def, 30, 70);
        if (with > 0.25 * without || without < 100.0) {
            fail_msg("filter %d: the variance is %.1f with mip and %.1f without", filter, with,
                     without);
        }
    }
    vd_classic_renderer_destroy(&renderer);
    vd_heightfield_destroy(context, &map);
    vd_context_destroy(&context);
}

/* A map of odd sides has no other levels. */
static void odd_maps_have_one_level(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    vd_heightfield *map = make_map(context, (map_kind){101, 64, VD_HEIGHT_U8, 3});
    vd_classic_def def = small_def(78.0);
    vd_frame *without = draw(context, map, &def, VD_CLASSIC_REFERENCE, 40, 30);
    def.mip = true;
    vd_frame *with = draw(context, map, &def, VD_CLASSIC_REFERENCE, 40, 30);
    assert_int_equal(vd_frame_hash(with), vd_frame_hash(without));
    vd_frame_destroy(&with);
    vd_frame_destroy(&without);
    vd_heightfield_destroy(context, &map);
    vd_context_destroy(&context);
}

/* ---- methods --------------------------------------------------------------------------------- */

static void methods_agree_or_refuse(void **state) {
    (void)state;
    vd_context *context = test_context(3, VD_ISA_AUTO);
    vd_heightfield *map = make_map(context, (map_kind){96, 40, VD_HEIGHT_F32, 3});
    for (int options = 0; options < 16; options++) {
        vd_classic_def def = small_def(90.0);
        def.filter = options & 1 ? VD_FILTER_LINEAR : VD_FILTER_NEAREST;
        def.mip = (options & 2) != 0;
        def.smooth = (options & 4) != 0;
        def.samples = options & 8 ? 4 : 0;
        vd_frame *expected = draw(context, map, &def, VD_CLASSIC_REFERENCE, 33, 41);
        for (int method = 0; method < VD_CLASSIC_METHOD_COUNT; method++) {
            if (method == VD_CLASSIC_SCAN && options % 8 != 0) {
                const vd_status status =
                    vd_classic_render(context, NULL, map, &def, VD_CLASSIC_SCAN, expected, NULL);
                assert_int_equal(status.code, VD_ERROR_ARGUMENT);
                assert_non_null(strstr(status.message, "scan"));
                continue;
            }
            vd_frame *frame = draw(context, map, &def, (vd_classic_method)method, 33, 41);
            assert_int_equal(vd_frame_hash(frame), vd_frame_hash(expected));
            assert_memory_equal(frame->depth, expected->depth,
                                41 * expected->stride * sizeof(float));
            vd_frame_destroy(&frame);
        }
        vd_frame_destroy(&expected);
    }
    vd_heightfield_destroy(context, &map);
    vd_context_destroy(&context);
}

/* ---- the march's memory ---------------------------------------------------------------------- */

/* Block and renderer together, of a map that is large beside the renderer's scratch. */
static void memory_is_bounded(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    for (int type = 0; type < VD_HEIGHT_TYPE_COUNT; type++) {
        for (int filters = 1; filters < 1 << VD_FILTER_COUNT; filters++) { /* one, or both */
            const size_t before = vd_context_memory(context).bytes_now;
            const size_t heights = type == VD_HEIGHT_U8 ? 1 : type == VD_HEIGHT_U16 ? 2 : 4;
            vd_heightfield *map =
                make_map(context, (map_kind){1000, 1024, (vd_height_type)type, 4});
            vd_classic_renderer *renderer = NULL;
            vd_frame *frame = NULL;
            assert_ok(vd_classic_renderer_create(context, map, &renderer));
            assert_ok(vd_frame_create(context, 32, 20, 0, &frame));
            vd_classic_def def = small_def(78.0);
            for (int filter = 0; filter < VD_FILTER_COUNT; filter++) {
                def.filter = (vd_filter)filter;
                if ((filters >> filter & 1) != 0) {
                    assert_ok(vd_classic_renderer_draw(renderer, NULL, &def, frame));
                }
            }
            const double ratio = (double)(vd_context_memory(context).bytes_now - before) /
                                 (1000.0 * 1024.0 * (double)(heights + 4));
            if (ratio > 2.2) {
                fail_msg("type %d, filters %d: %.3f times the heights and colours", type, filters,
                         ratio);
            }
            vd_frame_destroy(&frame);
            vd_classic_renderer_destroy(&renderer);
            vd_heightfield_destroy(context, &map);
        }
    }
    vd_context_destroy(&context);
}

/* A renderer whose n-th allocation fails says so, and draws the picture the next time. */
static bool survives(int fail_at, int options) {
    test_allocator allocator = {0};
    vd_context *context = test_failing_context(&allocator);
    vd_heightfield *map =
        make_map(context, (map_kind){40, 40, options % 2 == 0 ? VD_HEIGHT_F32 : VD_HEIGHT_U8, 7});
    vd_frame *frame = NULL;
    assert_ok(vd_frame_create(context, 33, 20, VD_PLANE_DEPTH, &frame));
    vd_classic_def def = small_def(78.0);
    def.growth = options % 3 == 0 ? 0.05 : 0.0;
    def.filter = options >= 2 ? VD_FILTER_LINEAR : VD_FILTER_NEAREST;
    def.mip = def.smooth = options >= 4;
    def.samples = options >= 4 ? 4 : 0;
    allocator.calls = 0;
    allocator.fail_at = fail_at;
    vd_classic_renderer *renderer = NULL;
    vd_status status = vd_classic_renderer_create(context, map, &renderer);
    if (status.code == VD_OK) {
        status = vd_classic_renderer_draw(renderer, NULL, &def, frame);
    } else {
        assert_null(renderer);
    }
    if (status.code != VD_OK) {
        assert_int_equal(status.code, VD_ERROR_MEMORY);
        if (renderer != NULL) {
            assert_ok(vd_classic_renderer_draw(renderer, NULL, &def, frame));
        }
    }
    const bool done = allocator.calls < fail_at;
    vd_classic_renderer_destroy(&renderer);
    vd_frame_destroy(&frame);
    vd_heightfield_destroy(context, &map);
    vd_context_destroy(&context);
    assert_int_equal(allocator.live, 0);
    return done;
}

static void every_allocation_may_fail(void **state) {
    (void)state;
    for (int options = 0; options < 6; options++) {
        int fail_at = 1;
        while (!survives(fail_at, options)) {
            fail_at++;
        }
        assert_true(fail_at > 5);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(linear_equals_nearest_at_samples),
        cmocka_unit_test(linear_by_hand),
        cmocka_unit_test(smooth_keeps_the_tops),
        cmocka_unit_test(samples_change_edges_only),
        cmocka_unit_test(distance_does_not_sparkle),
        cmocka_unit_test(odd_maps_have_one_level),
        cmocka_unit_test(methods_agree_or_refuse),
        cmocka_unit_test(memory_is_bounded),
        cmocka_unit_test(every_allocation_may_fail),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

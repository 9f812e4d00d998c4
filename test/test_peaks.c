/* Peaks of a heightfield: against a flood of every threshold, on small maps. */
#include <math.h>
#include <stdio.h>
#include "support.h"
#include <veduta/peaks.h>

static vd_context *context;
static size_t bytes_at_first;

static int set_up(void **state) {
    (void)state;
    context = test_context(1, VD_ISA_AUTO);
    bytes_at_first = vd_context_memory(context).bytes_now;
    return 0;
}

static int tear_down(void **state) {
    (void)state;
    assert_int_equal(vd_context_memory(context).bytes_now, bytes_at_first);
    vd_context_destroy(&context);
    return 0;
}

static vd_heightfield *make(int width, int height, vd_height_type type, const void *heights,
                            bool wraps) {
    vd_heightfield_def def = vd_heightfield_def_default();
    def.width = width;
    def.height = height;
    def.type = type;
    def.heights = heights;
    def.height_stride = (size_t)width;
    def.wraps = wraps;
    const double m[6] = {1000.0, 30.0, 1.0, 5000.0, 2.0, -31.0};
    memcpy(def.world_from_sample, m, sizeof m);
    vd_heightfield *h = NULL;
    assert_ok(vd_heightfield_create(context, &def, &h));
    return h;
}

/* ---- the truth ------------------------------------------------------------------------------- */

#define SIDE 24

/* Marks what can be reached from a sample over heights of at least `level`; returns the lowest. */
static float reach(const vd_heightfield *h, int start, float level, bool seen[SIDE * SIDE]) {
    int stack[SIDE * SIDE], used = 0;
    float lowest = INFINITY;
    memset(seen, 0, SIDE * SIDE * sizeof *seen);
    seen[start] = true;
    stack[used++] = start;
    while (used > 0) {
        const int at = stack[--used], column = at % h->width, row = at / h->width;
        const float here = vd_heightfield_at(h, column, row);
        lowest = here < lowest ? here : lowest;
        for (int i = 0; i < 9; i++) {
            int c = column + i % 3 - 1, r = row + i / 3 - 1;
            if (h->wraps) {
                c = (c + h->width) % h->width;
                r = (r + h->height) % h->height;
            }
            if (c < 0 || r < 0 || c >= h->width || r >= h->height) {
                continue;
            }
            const float there = vd_heightfield_at(h, c, r);
            if (there > -INFINITY && there >= level && !seen[r * h->width + c]) {
                seen[r * h->width + c] = true;
                stack[used++] = r * h->width + c;
            }
        }
    }
    return lowest;
}

/* The prominence of a sample: 0 when it is no peak, or not the first of its plateau. */
static double true_prominence(const vd_heightfield *h, int sample) {
    const int samples = h->width * h->height;
    const float top = vd_heightfield_at(h, sample % h->width, sample / h->width);
    if (!(top > -INFINITY)) {
        return 0.0;
    }
    bool seen[SIDE * SIDE];
    float pass = -INFINITY; /* the highest level from which higher ground is reached */
    for (int k = 0; k < samples; k++) {
        const float level = vd_heightfield_at(h, k % h->width, k / h->width);
        if (!(level > pass && level <= top)) {
            continue;
        }
        (void)reach(h, sample, level, seen);
        for (int i = 0; i < samples; i++) {
            const float there = vd_heightfield_at(h, i % h->width, i / h->width);
            if (seen[i] && (there > top || (there == top && i < sample))) {
                pass = level;
                break;
            }
        }
    }
    const float base = pass > -INFINITY ? pass : reach(h, sample, -INFINITY, seen);
    return (double)top - (double)base;
}

static void check_all(const vd_heightfield *h) {
    const int samples = h->width * h->height;
    double expected[SIDE * SIDE];
    int peaks = 0;
    for (int i = 0; i < samples; i++) {
        expected[i] = true_prominence(h, i);
        peaks += expected[i] > 0.0;
    }
    const int counts[] = {samples, samples + 5, 1, 3, peaks > 0 ? peaks : 1};
    for (size_t k = 0; k < sizeof counts / sizeof counts[0]; k++) {
        vd_peak out[SIDE * SIDE + 5];
        int found = -1;
        assert_ok(vd_heightfield_peaks(context, NULL, h, counts[k], out, &found));
        assert_int_equal(found, peaks < counts[k] ? peaks : counts[k]);
        bool taken[SIDE * SIDE] = {false};
        for (int i = 0; i < found; i++) {
            /* The i-th is the best of those that are left. */
            int best = -1;
            for (int s = 0; s < samples; s++) {
                if (!taken[s] && expected[s] > 0.0 && (best < 0 || expected[s] > expected[best])) {
                    best = s;
                }
            }
            taken[best] = true;
            assert_int_equal(out[i].row * h->width + out[i].column, best);
            assert_true(out[i].prominence_m == expected[best]);
            assert_true(out[i].z == (double)vd_heightfield_at(h, out[i].column, out[i].row));
            assert_true(out[i].x == 1000.0 + out[i].column * 30.0 + out[i].row * 1.0);
            assert_true(out[i].y == 5000.0 + out[i].column * 2.0 + out[i].row * -31.0);
        }
    }
}

static void equals_the_truth(void **state) {
    (void)state;
    uint64_t random = 7;
    for (int scene = 0; scene < 160; scene++) {
        const int width = 1 + (int)(test_random(&random) % (scene < 120 ? 11 : SIDE));
        const int height = 1 + (int)(test_random(&random) % (scene < 120 ? 11 : SIDE));
        const vd_height_type type = (vd_height_type)(scene % 3);
        /* Few values make plateaus and ties; many make none. */
        const uint64_t values = (const uint64_t[]){2, 4, 9, 250}[test_random(&random) % 4];
        const bool holes = type == VD_HEIGHT_F32 && scene % 2 == 0;
        uint8_t u8[SIDE * SIDE];
        uint16_t u16[SIDE * SIDE];
        float f32[SIDE * SIDE];
        for (int i = 0; i < width * height; i++) {
            const uint64_t r = test_random(&random);
            u8[i] = (uint8_t)(r % values);
            u16[i] = (uint16_t)(r % values * 257);
            f32[i] = ((float)(r % values) - (float)(values / 2)) * 0.37f;
            f32[i] = f32[i] == 0.0f && r >> 63 ? -0.0f : f32[i];
            f32[i] = holes && test_random(&random) % 4 == 0 ? NAN : f32[i];
        }
        const void *heights = type == VD_HEIGHT_U8    ? (const void *)u8
                              : type == VD_HEIGHT_U16 ? (const void *)u16
                                                      : (const void *)f32;
        vd_heightfield *h = make(width, height, type, heights, test_random(&random) % 4 == 0);
        check_all(h);
        vd_heightfield_destroy(context, &h);
    }
}

static void small_and_flat_maps(void **state) {
    (void)state;
    const float holes[4] = {NAN, NAN, NAN, NAN}, flat[4] = {3, 3, 3, 3};
    const float two[5] = {5, 1, 5, 2, 4};
    vd_peak out[5];
    int found = -1;
    vd_heightfield *h = make(2, 2, VD_HEIGHT_F32, holes, false);
    assert_ok(vd_heightfield_peaks(context, NULL, h, 5, out, &found));
    assert_int_equal(found, 0);
    vd_heightfield_destroy(context, &h);
    h = make(2, 2, VD_HEIGHT_F32, flat, true);
    assert_ok(vd_heightfield_peaks(context, NULL, h, 5, out, &found));
    assert_int_equal(found, 0);
    vd_heightfield_destroy(context, &h);
    h = make(5, 1, VD_HEIGHT_F32, two, false);
    assert_ok(vd_heightfield_peaks(context, NULL, h, 5, out, &found));
    assert_int_equal(found, 3);
    assert_true(out[0].column == 0 && out[0].prominence_m == 4.0);
    assert_true(out[1].column == 2 && out[1].prominence_m == 4.0);
    assert_true(out[2].column == 4 && out[2].prominence_m == 2.0);
    vd_heightfield_destroy(context, &h);
}

/* ---- errors ---------------------------------------------------------------------------------- */

static void errors_have_sentences(void **state) {
    (void)state;
    float heights[64 * 64];
    uint64_t random = 3;
    for (int i = 0; i < 64 * 64; i++) {
        heights[i] = (float)test_uniform(&random);
    }
    vd_heightfield *h = make(64, 64, VD_HEIGHT_F32, heights, false);
    vd_peak out[4];
    int found = 77;
    vd_status status = vd_heightfield_peaks(context, NULL, h, 0, out, &found);
    assert_int_equal(status.code, VD_ERROR_ARGUMENT);
    assert_string_equal(status.message, "the count of peaks is 0; ask for 1 or more");
    vd_job *job = NULL;
    assert_ok(vd_job_create(context, &job));
    vd_job_cancel(job);
    status = vd_heightfield_peaks(context, job, h, 4, out, &found);
    assert_int_equal(status.code, VD_ERROR_CANCELLED);
    vd_job_reset(job);
    assert_ok(vd_heightfield_peaks(context, job, h, 4, out, &found));
    assert_int_equal(found, 4);
    assert_true(vd_job_progress(job) == 1.0);
    vd_job_destroy(&job);
    vd_heightfield large = *h; /* only its sizes are looked at */
    large.width = large.height = 65536;
    found = 77;
    status = vd_heightfield_peaks(context, NULL, &large, 4, out, &found);
    assert_int_equal(status.code, VD_ERROR_LIMIT);
    assert_non_null(strstr(status.message, "65536 x 65536"));
    assert_int_equal(found, 77);
    for (int fail_at = 2; fail_at <= 5; fail_at++) { /* the first is the context's own */
        test_allocator allocator = {0, 0, 0};
        vd_context *failing = test_failing_context(&allocator);
        const int live = allocator.live;
        allocator.fail_at = allocator.calls + fail_at - 1;
        status = vd_heightfield_peaks(failing, NULL, h, 4, out, &found);
        assert_int_equal(status.code, VD_ERROR_MEMORY);
        assert_int_equal(allocator.live, live);
        vd_context_destroy(&failing);
    }
    vd_heightfield_destroy(context, &h);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(equals_the_truth, set_up, tear_down),
        cmocka_unit_test_setup_teardown(small_and_flat_maps, set_up, tear_down),
        cmocka_unit_test_setup_teardown(errors_have_sentences, set_up, tear_down),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

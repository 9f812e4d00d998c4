/* Targets: sample patterns, clearing, resolving. */
#include <math.h>
#include "support.h"
#include <veduta/target.h>

static void patterns_are_balanced(void **state) {
    (void)state;
    assert_null(vd_sample_offsets(0));
    assert_null(vd_sample_offsets(2));
    assert_null(vd_sample_offsets(16));
    const int counts[] = {1, 4, 8};
    for (int c = 0; c < 3; c++) {
        const float(*offsets)[2] = vd_sample_offsets(counts[c]);
        double x = 0, y = 0;
        for (int i = 0; i < counts[c]; i++) {
            assert_true(offsets[i][0] > 0 && offsets[i][0] < 1);
            assert_true(offsets[i][1] > 0 && offsets[i][1] < 1);
            x += (double)offsets[i][0];
            y += (double)offsets[i][1];
            for (int j = 0; j < i; j++) { /* no two in one row or column: edges step S times */
                assert_true(offsets[i][0] != offsets[j][0] && offsets[i][1] != offsets[j][1]);
            }
        }
        assert_true(fabs(x / counts[c] - 0.5) <= 1.0 / 16 && fabs(y / counts[c] - 0.5) <= 1.0 / 16);
    }
}

static void bad_targets_are_refused(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    vd_target *target = NULL;
    assert_int_equal(vd_target_create(context, 0, 1, 1, &target).code, VD_ERROR_ARGUMENT);
    assert_int_equal(vd_target_create(context, 1, 1, 3, &target).code, VD_ERROR_ARGUMENT);
    assert_int_equal(vd_target_create(context, 70000, 1, 1, &target).code, VD_ERROR_LIMIT);
    assert_int_equal(vd_target_create(context, 65535, 65535, 1, &target).code, VD_ERROR_LIMIT);
    assert_null(target);
    vd_target_destroy(&target);
    vd_context_destroy(&context);
    for (int n = 2; n <= 5; n++) { /* 1 is the context itself; 2 and 3 the pool's */
        test_allocator allocator = {0, 0, 0};
        context = test_failing_context(&allocator);
        int before = allocator.live;
        allocator.fail_at = allocator.calls + n - 1;
        vd_status status = vd_target_create(context, 5, 5, 4, &target);
        assert_int_equal(status.code, VD_ERROR_MEMORY);
        assert_null(target);
        assert_int_equal(allocator.live, before);
        vd_context_destroy(&context);
        assert_int_equal(allocator.live, 0);
    }
}

static void clear_color_survives_resolving(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    const int counts[] = {1, 4, 8};
    for (int c = 0; c < 3; c++) {
        vd_target *target = NULL;
        vd_frame *frame = NULL;
        assert_ok(vd_target_create(context, 7, 5, counts[c], &target));
        assert_ok(vd_frame_create(context, 20, 10, VD_PLANE_DEPTH | VD_PLANE_ID, &frame));
        target->x = 13;
        target->y = 5;
        vd_target_clear(target, (uint16_t[4]){0, 257 * 100, 257 * 200, 65535});
        vd_target_resolve(target, frame);
        for (int y = 0; y < 10; y++) {
            for (int x = 0; x < 20; x++) {
                const uint8_t *p = frame->rgba + 4 * ((size_t)y * frame->stride + (size_t)x);
                const bool inside = x >= 13 && y >= 5;
                assert_int_equal(p[0], 0);
                assert_int_equal(p[1], inside ? 100 : 0);
                assert_int_equal(p[2], inside ? 200 : 0);
                assert_int_equal(p[3], inside ? 255 : 0);
            }
        }
        vd_target_destroy(&target);
        vd_frame_destroy(&frame);
    }
    vd_context_destroy(&context);
}

static void resolving_averages_and_keeps_the_nearest(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    vd_target *target = NULL;
    vd_frame *frame = NULL;
    assert_ok(vd_target_create(context, 1, 1, 4, &target));
    assert_ok(vd_frame_create(context, 1, 1, VD_PLANE_DEPTH | VD_PLANE_ID, &frame));
    const float depths[4] = {0.25f, 0.75f, 0.75f, 0.5f};
    const uint16_t reds[4] = {0, 65535, 65535, 257};
    for (int s = 0; s < 4; s++) {
        const size_t at = (size_t)s * target->plane;
        target->color[4 * at] = reds[s];
        target->color[4 * at + 1] = target->color[4 * at + 2] = 0;
        target->color[4 * at + 3] = 65535;
        target->depth[at] = depths[s];
        target->id[at] = 10 + (uint32_t)s;
    }
    vd_target_resolve(target, frame);
    assert_int_equal(frame->rgba[0], 128); /* (0 + 255 + 255 + 1)/4 = 127.75 */
    assert_int_equal(frame->rgba[3], 255);
    assert_true(frame->depth[0] == 0.75f);
    assert_int_equal(frame->id[0], 11);
    vd_target_destroy(&target);
    vd_frame_destroy(&frame);
    vd_context_destroy(&context);
}

typedef struct thing {
    float depth;
    uint64_t order;
    uint16_t color[4];
} thing;

static int farthest_first(const void *a, const void *b) {
    const thing *x = a, *y = b;
    return x->depth != y->depth ? (x->depth > y->depth) - (x->depth < y->depth)
                                : (x->order < y->order) - (x->order > y->order);
}

/* Any number of things at a sample, in any order and again, against sorting all of them. */
static void blended_things_are_sorted(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    vd_target *target = NULL;
    assert_ok(vd_target_create(context, 5, 3, 4, &target));
    assert_ok(vd_target_reserve_blended(target));
    assert_ok(vd_target_reserve_blended(target));
    uint64_t random = 1;
    thing things[40];
    for (int round = 0; round < 400; round++) {
        const int count = (int)(test_random(&random) % 41);
        const size_t sample = 2 * target->plane + target->stride + 3;
        const uint16_t start[4] = {100, 2000, 30000, (uint16_t)(round % 2 == 0 ? 65535 : 30000)};
        vd_target_clear(target, start);
        target->depth[sample] = round % 3 == 0 ? 0.5f : 0.0f;
        for (int i = 0; i < count; i++) {
            thing *t = &things[i];
            t->depth = (float)(test_random(&random) % 8) / 8.0f; /* many are alike */
            t->order = (test_random(&random) % 3) << 32 | (uint64_t)i;
            t->color[3] = (uint16_t)(test_random(&random) % 5 == 0 ? 65535 : test_random(&random));
            for (int c = 0; c < 3; c++) {
                t->color[c] = (uint16_t)(test_uniform(&random) * t->color[3]);
            }
        }
        vd_target_begin_blended(target);
        int passes = 0;
        do {
            const int first = count > 0 ? (int)(test_random(&random) % (uint64_t)count) : 0;
            for (int i = 0; i < count + 3 && count > 0; i++) { /* some of them twice */
                const thing *t = &things[(first + i) % count];
                vd_target_add_blended(target, sample, t->depth, t->order, t->color);
            }
            passes++;
        } while (vd_target_blend(target));
        qsort(things, (size_t)count, sizeof *things, farthest_first);
        uint16_t expected[4];
        int seen = 0;
        memcpy(expected, start, sizeof expected);
        for (int i = 0; i < count; i++) {
            seen += things[i].depth >= target->depth[sample];
            for (int c = 0; c < 4 && things[i].depth >= target->depth[sample]; c++) {
                const double left = (65535.0 - things[i].color[3]) / 65535.0;
                expected[c] = (uint16_t)(things[i].color[c] + floor(expected[c] * left + 0.49999));
            }
        }
        assert_memory_equal(target->color + 4 * sample, expected, sizeof expected);
        assert_int_equal(passes, seen <= 8 ? 1 : (seen + 7) / 8);
        assert_memory_equal(target->color, start, sizeof start);
    }
    vd_target_destroy(&target);
    vd_context_destroy(&context);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(patterns_are_balanced),
        cmocka_unit_test(bad_targets_are_refused),
        cmocka_unit_test(clear_color_survives_resolving),
        cmocka_unit_test(resolving_averages_and_keeps_the_nearest),
        cmocka_unit_test(blended_things_are_sorted),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

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

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(patterns_are_balanced),
        cmocka_unit_test(bad_targets_are_refused),
        cmocka_unit_test(clear_color_survives_resolving),
        cmocka_unit_test(resolving_averages_and_keeps_the_nearest),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

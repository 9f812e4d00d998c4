/* The kernels of paths at every SIMD level against their plain reference: random and extreme
 * values, any length and alignment; nothing outside the output is touched. */
#include "coverage/coverage_kernels.h"
#include "support.h"

#define GUARD 16
#define MOST 130

typedef struct buffers {
    uint16_t out[4 * (MOST + 2 * GUARD)];
    uint16_t coverage[MOST + GUARD];
    uint16_t colors[4 * (MOST + GUARD)];
    int32_t areas[MOST + 2 * GUARD];
} buffers;

static uint16_t extreme(uint64_t *random) {
    static const uint16_t extremes[] = {0, 1, 2, 32767, 32768, 65533, 65534, 65535};
    const uint64_t r = test_random(random);
    return r % 3 == 0 ? extremes[(r >> 8) % 8] : (uint16_t)(r >> 16);
}

static void fill(buffers *b, uint64_t *random) {
    for (size_t i = 0; i < sizeof b->out / 2; i++) {
        b->out[i] = extreme(random);
    }
    for (size_t i = 0; i < sizeof b->coverage / 2; i++) {
        b->coverage[i] = extreme(random);
    }
    for (size_t i = 0; i < sizeof b->colors / 2; i++) {
        b->colors[i] = extreme(random);
    }
    for (size_t i = 0; i < MOST + 2 * GUARD; i++) {
        b->areas[i] = (int32_t)(test_random(random) >> 38) - (1 << 25);
    }
}

static void levels_agree(void **state) {
    (void)state;
    static buffers expected, got;
    uint64_t random = 5;
    const vd_coverage_kernels *plain = &vd_coverage_kernels_reference;
    for (int isa = VD_ISA_V2; isa <= (int)vd_isa_best(); isa++) {
        const vd_coverage_kernels *kernels = vd_coverage_kernels_for((vd_isa)isa);
        for (int round = 0; round < 1500; round++) {
            const size_t count = test_random(&random) % MOST, shift = test_random(&random) % 8;
            const uint16_t *coverage = round % 2 ? got.coverage + shift : NULL;
            uint16_t color[4];
            fill(&expected, &random);
            memcpy(color, expected.colors, sizeof color);
            color[3] = round % 4 == 0 ? 65535 : color[3];
            got = expected;
            uint16_t *out = expected.out + 4 * GUARD + shift;
            uint16_t *got_out = got.out + 4 * GUARD + shift;
            switch (round % 3) {
            case 0:
                plain->sum_areas(out, expected.areas + GUARD + shift, 1 << 23, count);
                kernels->sum_areas(got_out, got.areas + GUARD + shift, 1 << 23, count);
                break;
            case 1:
                plain->blend_color(out, coverage, color, count);
                kernels->blend_color(got_out, coverage, color, count);
                break;
            default:
                plain->blend_colors(out, coverage, got.colors + shift, count);
                kernels->blend_colors(got_out, coverage, got.colors + shift, count);
            }
            assert_memory_equal(&got, &expected, sizeof got);
        }
    }
}

/* Areas become the nearest of 65535ths, but where two are equally near. */
static void areas_are_rounded_to_nearest(void **state) {
    (void)state;
    for (int32_t area = 0; area <= 1 << 24; area += 37) {
        int32_t areas[1] = {area};
        uint16_t out[1];
        vd_coverage_kernels_reference.sum_areas(out, areas, 0, 1);
        const double exact = area * (65535.0 / (1 << 24));
        assert_true(out[0] - exact <= 0.5 + 1.0 / 256 && exact - out[0] <= 0.5 + 1.0 / 256);
        assert_int_equal(areas[0], 0);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(levels_agree),
        cmocka_unit_test(areas_are_rounded_to_nearest),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

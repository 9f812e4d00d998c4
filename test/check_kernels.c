/* Every kernel of every SIMD level that this processor has, against its plain reference: random,
 * extreme, unaligned, odd-length and NaN input; nothing outside the output is touched. */
#include <math.h>
#include "image/image_kernels.h"
#include "support.h"

#define GUARD 64
#define MAX_COUNT 400

typedef void check_level(vd_isa isa);

static void for_every_level(check_level *check) {
    for (int isa = VD_ISA_V2; isa <= (int)vd_isa_best(); isa++) {
        check((vd_isa)isa);
    }
}

static uint16_t extreme_u16(uint64_t *random) {
    static const uint16_t extremes[] = {0,   1,   127,   128,   129,   255,
                                        256, 257, 32767, 32768, 65534, 65535};
    uint64_t r = test_random(random);
    return r % 3 == 0 ? extremes[(r >> 8) % 12] : (uint16_t)(r >> 16);
}

static float extreme_f32(uint64_t *random) {
    static const float extremes[] = {0.0f,  -0.0f,  1.0f,     -1.0f,    1e-45f,
                                     3e38f, -3e38f, INFINITY, -INFINITY};
    uint64_t r = test_random(random);
    if (r % 7 == 0) {
        return NAN;
    }
    return r % 3 == 0 ? extremes[(r >> 8) % 9] : (float)test_uniform(random);
}

static void check_resolve_color(vd_isa isa) {
    static uint16_t in[8 * (MAX_COUNT + 8) + 8];
    uint8_t expected[MAX_COUNT + 2 * GUARD], got[MAX_COUNT + 2 * GUARD];
    const int sample_counts[] = {1, 4, 8};
    uint64_t random = 11;
    for (int round = 0; round < 600; round++) {
        const size_t count = test_random(&random) % MAX_COUNT;
        const size_t plane = count + test_random(&random) % 8;
        const size_t shift = test_random(&random) % 8;
        const int samples = sample_counts[round % 3];
        for (size_t i = 0; i < sizeof in / sizeof in[0]; i++) {
            in[i] = extreme_u16(&random);
        }
        memset(expected, 0xCC, sizeof expected);
        memset(got, 0xCC, sizeof got);
        vd_image_kernels_reference.resolve_color(expected + GUARD - shift, in + shift, plane,
                                                 samples, count);
        vd_image_kernels_for(isa)->resolve_color(got + GUARD - shift, in + shift, plane, samples,
                                                 count);
        assert_memory_equal(got, expected, sizeof got);
    }
}

static void check_resolve_nearest(vd_isa isa) {
    static float depth[8 * (MAX_COUNT + 8) + 8];
    static uint32_t id[8 * (MAX_COUNT + 8) + 8];
    float expected_depth[MAX_COUNT + 2 * GUARD], got_depth[MAX_COUNT + 2 * GUARD];
    uint32_t expected_id[MAX_COUNT + 2 * GUARD], got_id[MAX_COUNT + 2 * GUARD];
    const int sample_counts[] = {1, 4, 8};
    uint64_t random = 12;
    for (int round = 0; round < 600; round++) {
        const size_t count = test_random(&random) % MAX_COUNT;
        const size_t plane = count + test_random(&random) % 8;
        const size_t shift = test_random(&random) % 8;
        const int samples = sample_counts[round % 3];
        for (size_t i = 0; i < sizeof depth / sizeof depth[0]; i++) {
            depth[i] = extreme_f32(&random);
            id[i] = (uint32_t)test_random(&random);
        }
        memset(expected_depth, 0xCC, sizeof expected_depth);
        memset(got_depth, 0xCC, sizeof got_depth);
        memset(expected_id, 0xCC, sizeof expected_id);
        memset(got_id, 0xCC, sizeof got_id);
        const bool with_depth = round % 5 != 0, with_id = round % 5 != 1;
        vd_image_kernels_reference.resolve_nearest(
            with_depth ? expected_depth + GUARD - shift : NULL,
            with_id ? expected_id + GUARD - shift : NULL, depth + shift, id + shift, plane, samples,
            count);
        vd_image_kernels_for(isa)->resolve_nearest(
            with_depth ? got_depth + GUARD - shift : NULL, with_id ? got_id + GUARD - shift : NULL,
            depth + shift, id + shift, plane, samples, count);
        assert_memory_equal(got_depth, expected_depth, sizeof got_depth);
        assert_memory_equal(got_id, expected_id, sizeof got_id);
    }
}

static void resolve_color_is_the_same_at_every_level(void **state) {
    (void)state;
    for_every_level(check_resolve_color);
}

static void resolve_nearest_is_the_same_at_every_level(void **state) {
    (void)state;
    for_every_level(check_resolve_nearest);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(resolve_color_is_the_same_at_every_level),
        cmocka_unit_test(resolve_nearest_is_the_same_at_every_level),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

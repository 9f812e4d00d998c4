/* The image room's memory side: colour tables, frames, pictures, comparison. */
#include <math.h>
#include <stdio.h>
#include <xxhash.h>
#include <veduta/picture.h>
#include "image/image.h"
#include "support.h"

/* IEC 61966-2-1, as the standard writes it. */
static double exact_encode(double linear) {
    return linear <= 0.0031308 ? 12.92 * linear : 1.055 * pow(linear, 1.0 / 2.4) - 0.055;
}

static double exact_decode(double encoded) {
    return encoded <= 0.04045 ? encoded / 12.92 : pow((encoded + 0.055) / 1.055, 2.4);
}

static void bytes_survive_decoding_and_encoding(void **state) {
    (void)state;
    for (int byte = 0; byte < 256; byte++) {
        const float linear = vd_srgb_decode((uint8_t)byte);
        assert_true(fabs((double)linear - exact_decode(byte / 255.0)) <= 6e-8);
        assert_int_equal(vd_round_16_to_8(vd_srgb_encode(linear)), byte);
    }
    const vd_linear linear = vd_linear_from_rgba8((vd_rgba8){0, 255, 128, 7});
    assert_true(linear.r == 0.0f && linear.g == 1.0f && linear.b == vd_srgb_decode(128));
}

static void encoding_follows_the_curve(void **state) {
    (void)state;
    /* Steps of 2^-22 cover the steep beginning; the curve is flatter than one unit a step. */
    uint16_t before = 0;
    for (uint32_t i = 0; i <= 1u << 22; i++) {
        const float linear = (float)i / (float)(1u << 22);
        const uint16_t encoded = vd_srgb_encode(linear);
        assert_true(encoded >= before);
        before = encoded;
        assert_true(fabs(encoded - 65535.0 * exact_encode((double)linear)) <= 4.0);
    }
    assert_int_equal(before, 65535);
}

static void encoding_clamps(void **state) {
    (void)state;
    const float low[] = {-0.0f, -1.0f, -INFINITY, NAN, -NAN, 1e-42f, -1e-42f};
    for (size_t i = 0; i < sizeof low / sizeof low[0]; i++) {
        assert_int_equal(vd_srgb_encode(low[i]), 0);
    }
    assert_int_equal(vd_srgb_encode(1.0f), 65535);
    assert_int_equal(vd_srgb_encode(nextafterf(1.0f, 2.0f)), 65535);
    assert_int_equal(vd_srgb_encode(INFINITY), 65535);
    assert_true(vd_srgb_encode(nextafterf(1.0f, 0.0f)) >= 65531);
}

static void rounding_to_bytes_is_nearest(void **state) {
    (void)state;
    for (uint32_t v = 0; v < 65536; v++) {
        assert_int_equal(vd_round_16_to_8(v), (v + 128) / 257);
    }
}

static void frames_start_empty(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    const size_t before = vd_context_memory(context).bytes_now;
    const int widths[] = {1, 15, 16, 17, 255, 256, 257, 1024, 1920};
    for (size_t i = 0; i < sizeof widths / sizeof widths[0]; i++) {
        vd_frame *frame = NULL;
        assert_ok(vd_frame_create(context, widths[i], 3, VD_PLANE_DEPTH | VD_PLANE_ID, &frame));
        assert_true(frame->stride >= (size_t)widths[i]);
        assert_int_equal(frame->stride % 16, 0);
        assert_int_not_equal(frame->stride * 4 % 1024, 0);
        assert_int_equal(frame->stride, vd_frame_stride(widths[i]));
        assert_int_equal((uintptr_t)frame->rgba % 64, 0);
        assert_int_equal((uintptr_t)frame->depth % 64, 0);
        assert_int_equal((uintptr_t)frame->id % 64, 0);
        assert_int_equal(frame->object_count, 1);
        assert_int_equal(frame->object_ids[0], 0);
        for (size_t p = 0; p < frame->stride * 3; p++) {
            assert_true(frame->depth[p] == 0.0f && frame->id[p] == 0);
            assert_true(frame->rgba[4 * p] == 0 && frame->rgba[4 * p + 3] == 0);
        }
        vd_frame_destroy(&frame);
        assert_null(frame);
    }
    vd_frame *plain = NULL;
    assert_ok(vd_frame_create(context, 5, 5, 0, &plain));
    assert_null(plain->depth);
    assert_null(plain->id);
    vd_frame_destroy(&plain);
    vd_frame_destroy(&plain);
    vd_frame_destroy(NULL);
    assert_int_equal(vd_context_memory(context).bytes_now, before);
    vd_context_destroy(&context);
}

static void absurd_sizes_are_refused(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    const struct {
        int width, height;
        vd_code code;
    } cases[] = {{0, 5, VD_ERROR_ARGUMENT},      {5, 0, VD_ERROR_ARGUMENT},
                 {-3, 5, VD_ERROR_ARGUMENT},     {5, INT32_MIN, VD_ERROR_ARGUMENT},
                 {65536, 1, VD_ERROR_LIMIT},     {1, INT32_MAX, VD_ERROR_LIMIT},
                 {65535, 65535, VD_ERROR_LIMIT}, {32768, 16385, VD_ERROR_LIMIT}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        vd_frame *frame = NULL;
        vd_picture *picture = NULL;
        const vd_status status =
            vd_frame_create(context, cases[i].width, cases[i].height, 0, &frame);
        char size[40];
        snprintf(size, sizeof size, "%d × %d", cases[i].width, cases[i].height);
        assert_int_equal(status.code, cases[i].code);
        assert_non_null(strstr(status.message, size));
        assert_null(frame);
        assert_int_equal(
            vd_picture_create(context, cases[i].width, cases[i].height, 3, 8, &picture).code,
            cases[i].code);
        assert_null(picture);
    }
    vd_picture *picture = NULL;
    assert_int_equal(vd_picture_create(context, 5, 5, 0, 8, &picture).code, VD_ERROR_ARGUMENT);
    assert_int_equal(vd_picture_create(context, 5, 5, 5, 8, &picture).code, VD_ERROR_ARGUMENT);
    assert_int_equal(vd_picture_create(context, 5, 5, 3, 12, &picture).code, VD_ERROR_ARGUMENT);
    assert_null(picture);
    vd_context_destroy(&context);
}

static void hash_covers_rgb_and_nothing_else(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    enum { WIDTH = 601, HEIGHT = 3 };
    vd_frame *frame = NULL;
    assert_ok(vd_frame_create(context, WIDTH, HEIGHT, 0, &frame));
    static uint8_t rgb[WIDTH * HEIGHT * 3];
    uint64_t random = 1;
    for (size_t i = 0; i < frame->stride * HEIGHT * 4; i++) {
        frame->rgba[i] = (uint8_t)test_random(&random); /* also alpha and padding */
    }
    for (int y = 0; y < HEIGHT; y++) {
        for (int x = 0; x < WIDTH; x++) {
            memcpy(rgb + 3 * (y * WIDTH + x),
                   frame->rgba + 4 * ((size_t)y * frame->stride + (size_t)x), 3);
        }
    }
    const uint64_t hash = vd_frame_hash(frame);
    assert_int_equal(hash, XXH64(rgb, sizeof rgb, 0));
    frame->rgba[3] ^= 1;
    frame->rgba[4 * WIDTH] ^= 1;
    assert_int_equal(vd_frame_hash(frame), hash);
    frame->rgba[4 * (2 * frame->stride + WIDTH - 1) + 2] ^= 1;
    assert_int_not_equal(vd_frame_hash(frame), hash);
    vd_frame_destroy(&frame);
    vd_context_destroy(&context);
}

static void colors_of_every_layout(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    for (int channels = 1; channels <= 4; channels++) {
        for (int bits = 8; bits <= 16; bits += 8) {
            vd_picture *picture = NULL;
            assert_ok(vd_picture_create(context, 3, 2, channels, bits, &picture));
            for (int y = 0; y < 2; y++) {
                for (int i = 0; i < 3 * channels; i++) {
                    const int value = 20 * y + 3 * i + 1;
                    if (bits == 8) {
                        ((uint8_t *)vd_picture_row(picture, y))[i] = (uint8_t)value;
                    } else {
                        ((uint16_t *)vd_picture_row(picture, y))[i] = (uint16_t)(257 * value + 128);
                    }
                }
            }
            const vd_rgba8 color = vd_picture_color(picture, 2, 1);
            const int first = 21 + 6 * channels;
            const bool grey = channels <= 2;
            assert_int_equal(color.r, first);
            assert_int_equal(color.g, grey ? first : first + 3);
            assert_int_equal(color.b, grey ? first : first + 6);
            assert_int_equal(color.a, channels == 2 ? first + 3 : channels == 4 ? first + 9 : 255);
            vd_picture_destroy(&picture);
        }
    }
    vd_context_destroy(&context);
}

static vd_picture *filled(vd_context *context, int width, int height, int channels, int bits,
                          int value) {
    vd_picture *picture = NULL;
    assert_ok(vd_picture_create(context, width, height, channels, bits, &picture));
    for (int y = 0; y < height; y++) {
        for (int i = 0; i < width * channels; i++) {
            if (bits == 8) {
                ((uint8_t *)vd_picture_row(picture, y))[i] = (uint8_t)value;
            } else {
                ((uint16_t *)vd_picture_row(picture, y))[i] = (uint16_t)value;
            }
        }
    }
    return picture;
}

static void comparison_counts_and_measures(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    const size_t before = vd_context_memory(context).bytes_now;
    vd_picture *a = filled(context, 10, 4, 3, 8, 100), *b = filled(context, 10, 4, 3, 8, 100);
    vd_comparison c;
    vd_picture *difference = NULL;
    assert_ok(vd_picture_compare(a, b, 0.0, &c, &difference));
    assert_true(c.rms == 0.0 && c.maximum == 0.0 && isinf(c.psnr_db));
    assert_true(c.differing_pixels == 0 && c.pixels == 40);
    assert_true(difference->channels == 3 && difference->bits == 8);
    assert_int_equal(vd_picture_color(difference, 9, 3).g, 0);
    vd_picture_destroy(&difference);

    uint8_t *row = vd_picture_row(b, 2);
    row[3 * 4 + 1] = 103;
    row[3 * 5 + 2] = 0;
    assert_ok(vd_picture_compare(a, b, 3.0, &c, &difference));
    const double rms = sqrt((9.0 + 10000.0) / 120.0);
    assert_true(fabs(c.rms - rms) < 1e-12 && c.maximum == 100.0);
    assert_true(fabs(c.psnr_db - 20.0 * log10(255.0 / rms)) < 1e-9);
    assert_int_equal(c.differing_pixels, 1); /* 3 is within the tolerance */
    assert_int_equal(vd_picture_color(difference, 4, 2).g, 24);
    assert_int_equal(vd_picture_color(difference, 5, 2).b, 255);
    assert_int_equal(vd_picture_color(difference, 5, 2).r, 0);
    vd_picture_destroy(&difference);
    assert_ok(vd_picture_compare(a, b, 2.99, &c, NULL));
    assert_int_equal(c.differing_pixels, 2);
    vd_picture_destroy(&a);
    vd_picture_destroy(&b);
    assert_int_equal(vd_context_memory(context).bytes_now, before);
    vd_context_destroy(&context);
}

static void comparison_of_unlike_layouts(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    const struct {
        int channels_a, bits_a, value_a, channels_b, bits_b, value_b;
        double rms, maximum;
    } cases[] = {
        {1, 8, 50, 3, 8, 50, 0, 0},              /* grey is spread */
        {3, 8, 50, 3, 16, 50 * 257 + 100, 0, 0}, /* rounded to 8 bits */
        {3, 16, 1000, 3, 16, 1257, 1, 1},        /* one 8-bit step */
        {3, 16, 1000, 1, 16, 1001, 1 / 257.0, 1 / 257.0},
        {4, 8, 255, 3, 8, 255, 0, 0},   /* without alpha: opaque */
        {4, 8, 0, 3, 8, 0, 127.5, 255}, /* the fourth channel counts */
        {2, 16, 65535, 4, 8, 255, 0, 0},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        vd_picture *a =
            filled(context, 7, 3, cases[i].channels_a, cases[i].bits_a, cases[i].value_a);
        vd_picture *b =
            filled(context, 7, 3, cases[i].channels_b, cases[i].bits_b, cases[i].value_b);
        vd_comparison forth, back;
        assert_ok(vd_picture_compare(a, b, 0.0, &forth, NULL));
        assert_ok(vd_picture_compare(b, a, 0.0, &back, NULL));
        assert_true(fabs(forth.rms - cases[i].rms) < 1e-12);
        assert_true(fabs(forth.maximum - cases[i].maximum) < 1e-12);
        assert_int_equal(forth.differing_pixels, cases[i].maximum > 0 ? 21 : 0);
        assert_memory_equal(&forth, &back, sizeof forth);
        vd_picture_destroy(&a);
        vd_picture_destroy(&b);
    }
    vd_context_destroy(&context);
}

static void comparison_refuses(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    vd_picture *a = filled(context, 7, 3, 3, 8, 0), *b = filled(context, 3, 7, 3, 8, 0);
    vd_picture *difference = NULL;
    vd_comparison c;
    const vd_status status = vd_picture_compare(a, b, 0.0, &c, &difference);
    assert_int_equal(status.code, VD_ERROR_ARGUMENT);
    assert_non_null(strstr(status.message, "7 × 3"));
    assert_non_null(strstr(status.message, "3 × 7"));
    assert_int_equal(vd_picture_compare(a, a, -1.0, &c, &difference).code, VD_ERROR_ARGUMENT);
    assert_int_equal(vd_picture_compare(a, a, NAN, &c, &difference).code, VD_ERROR_ARGUMENT);
    assert_null(difference);
    vd_picture_destroy(&a);
    vd_picture_destroy(&b);
    vd_context_destroy(&context);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(bytes_survive_decoding_and_encoding),
        cmocka_unit_test(encoding_follows_the_curve),
        cmocka_unit_test(encoding_clamps),
        cmocka_unit_test(rounding_to_bytes_is_nearest),
        cmocka_unit_test(frames_start_empty),
        cmocka_unit_test(absurd_sizes_are_refused),
        cmocka_unit_test(hash_covers_rgb_and_nothing_else),
        cmocka_unit_test(colors_of_every_layout),
        cmocka_unit_test(comparison_counts_and_measures),
        cmocka_unit_test(comparison_of_unlike_layouts),
        cmocka_unit_test(comparison_refuses),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

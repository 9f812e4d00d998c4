/* Textures: pyramids and filters. */
#include "raster_scenes.h"
#include <veduta/texture.h>

static vd_texture *make_texture(vd_context *context, int width, int height, int kind) {
    vd_picture *picture = NULL;
    assert_ok(vd_picture_create(context, width, height, 4, 8, &picture));
    for (int y = 0; y < height; y++) {
        uint8_t *row = (uint8_t *)picture->data + (size_t)y * picture->stride_bytes;
        for (int x = 0; x < width; x++) {
            const bool odd = ((x ^ y) & 1) != 0;
            const uint8_t value = kind == 0 ? 120 : kind == 1 ? (odd ? 255 : 0) : (uint8_t)x;
            const uint8_t texel[4] = {value, (uint8_t)(kind == 2 ? y : value), value, 255};
            memcpy(row + 4 * x, texel, 4);
        }
    }
    vd_texture *texture = NULL;
    assert_ok(vd_texture_create(context, picture, &texture));
    vd_picture_destroy(&picture);
    return texture;
}

typedef float lanes[16];

static void levels_are_means(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    static const int sizes[][3] = {{1, 1, 1}, {64, 64, 7}, {65, 33, 7}, {7, 1, 3}, {1, 100, 7}};
    for (size_t i = 0; i < sizeof sizes / sizeof sizes[0]; i++) {
        for (int kind = 0; kind < 2; kind++) {
            vd_texture *texture = make_texture(context, sizes[i][0], sizes[i][1], kind);
            assert_int_equal(vd_texture_levels(texture), sizes[i][2]);
            int width = 0, height = 0;
            const uint8_t *last =
                vd_texture_level_texels(texture, sizes[i][2] - 1, &width, &height);
            assert_int_equal(width * height, 1);
            if (kind == 0) {
                assert_int_equal(last[0], 120);
            } else if (sizes[i][0] == 64) {
                assert_true(last[0] == 127 || last[0] == 128);
            }
            assert_int_equal(last[3], 255);
            vd_texture_destroy(&texture);
        }
    }
    vd_context_destroy(&context);
}

/* Every filter of one colour is that colour, whatever the place and the change. */
static void a_constant_stays_one(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    vd_texture *texture = make_texture(context, 100, 60, 0);
    uint64_t random = 3;
    for (int round = 0; round < 400; round++) {
        lanes uv[2], dx[2], dy[2], color[4];
        for (int i = 0; i < 32; i++) {
            const float scale = (float[]){1e-4f, 0.02f, 0.3f, 5.0f}[test_random(&random) % 4];
            uv[i / 16][i % 16] = (float)((test_uniform(&random) - 0.5) * 8);
            dx[i / 16][i % 16] = (float)(test_uniform(&random) - 0.5) * scale;
            dy[i / 16][i % 16] = (float)(test_uniform(&random) - 0.5) * scale;
        }
        if (round % 10 == 0) { /* what a shader may do to it */
            uv[0][3] = NAN;
            uv[1][4] = INFINITY;
            dx[0][5] = NAN;
            dy[1][6] = -INFINITY;
            uv[0][7] = 3e38f;
        }
        for (int f = 0; f < VD_TEXTURE_FILTER_COUNT; f++) {
            vd_texture_sample(texture, (vd_texture_filter)f, (const float(*)[16])uv,
                              (const float(*)[16])dx, (const float(*)[16])dy, color);
            for (int i = 0; i < 16; i++) {
                if (round % 10 == 0 && i >= 3 && i <= 7) {
                    continue;
                }
                for (int c = 0; c < 3; c++) {
                    assert_true(fabsf(color[c][i] - 120.0f / 255.0f) < 1e-5f);
                }
                assert_true(fabsf(color[3][i] - 1.0f) < 1e-6f);
            }
        }
    }
    vd_texture_destroy(&texture);
    vd_context_destroy(&context);
}

/* A slope is read exactly between texels, and a checkerboard far away is grey. */
static void filters_do_what_they_say(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    vd_texture *slope = make_texture(context, 128, 128, 2),
               *board = make_texture(context, 128, 128, 1);
    lanes uv[2], small[2], large[2], none[2], color[4];
    for (int i = 0; i < 16; i++) {
        uv[0][i] = 0.1f + 0.05f * (float)i;
        uv[1][i] = 0.3f;
        small[0][i] = 0.25f / 128;
        large[0][i] = 16.0f / 128;
        small[1][i] = large[1][i] = none[0][i] = none[1][i] = 0.0f;
    }
    lanes small_y[2], large_y[2];
    memcpy(small_y[0], small[1], sizeof small_y[0]);
    memcpy(small_y[1], small[0], sizeof small_y[1]);
    memcpy(large_y[0], large[1], sizeof large_y[0]);
    memcpy(large_y[1], large[0], sizeof large_y[1]);
    for (int f = 0; f < VD_TEXTURE_FILTER_COUNT; f++) {
        vd_texture_sample(slope, (vd_texture_filter)f, (const float(*)[16])uv,
                          (const float(*)[16])small, (const float(*)[16])small_y, color);
        for (int i = 0; i < 16; i++) {
            const float wanted = uv[0][i] * 128 - 0.5f;
            assert_true(fabsf(color[0][i] * 255 - wanted) <=
                        (f == VD_TEXTURE_NEAREST ? 0.51f : 0.02f));
        }
        vd_texture_sample(board, (vd_texture_filter)f, (const float(*)[16])uv,
                          (const float(*)[16])large, (const float(*)[16])large_y, color);
        for (int i = 0; i < 16; i++) {
            const bool mips = f == VD_TEXTURE_TRILINEAR || f == VD_TEXTURE_ANISOTROPIC;
            assert_true(!mips || fabsf(color[0][i] - 0.5f) < 0.01f);
        }
        /* A long, thin footprint: the anisotropic filter keeps across it what trilinear blurs. */
        vd_texture_sample(slope, (vd_texture_filter)f, (const float(*)[16])uv,
                          (const float(*)[16])large, (const float(*)[16])small_y, color);
        if (f == VD_TEXTURE_ANISOTROPIC) {
            for (int i = 2; i < 14; i++) {
                assert_true(fabsf(color[1][i] * 255 - (0.3f * 128 - 0.5f)) < 1.5f);
            }
        }
    }
    vd_texture_destroy(&slope);
    vd_texture_destroy(&board);
    vd_context_destroy(&context);
}

/* As the footprint grows, trilinear goes through the levels in order, without a jump. */
static void levels_follow_the_footprint(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    vd_picture *picture = NULL;
    assert_ok(vd_picture_create(context, 64, 64, 1, 8, &picture));
    for (int y = 0; y < 64; y++) { /* white above black */
        memset((uint8_t *)picture->data + (size_t)y * picture->stride_bytes, y < 32 ? 255 : 0, 64);
    }
    vd_texture *texture = NULL;
    assert_ok(vd_texture_create(context, picture, &texture));
    lanes uv[2], dx[2], dy[2], color[4];
    float last = 1.0f;
    for (int step = 0; step < 200; step++) {
        const float texels = 0.5f * powf(2.0f, (float)step / 25.0f);
        for (int i = 0; i < 16; i++) {
            uv[0][i] = 0.5f;
            uv[1][i] = 31.0f / 64;
            dx[0][i] = texels / 64;
            dy[1][i] = texels / 64;
            dx[1][i] = dy[0][i] = 0.0f;
        }
        vd_texture_sample(texture, VD_TEXTURE_TRILINEAR, (const float(*)[16])uv,
                          (const float(*)[16])dx, (const float(*)[16])dy, color);
        assert_true(color[0][0] <= last + 1e-6f && last - color[0][0] < 0.03f);
        last = color[0][0];
    }
    assert_true(fabsf(last - 0.5f) < 0.01f);
    vd_texture_destroy(&texture);
    vd_picture_destroy(&picture);
    vd_context_destroy(&context);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(levels_are_means),
        cmocka_unit_test(a_constant_stays_one),
        cmocka_unit_test(filters_do_what_they_say),
        cmocka_unit_test(levels_follow_the_footprint),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

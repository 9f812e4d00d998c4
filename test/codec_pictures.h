/* codec_pictures.h: pictures of every kind that codecs meet, by a seed. */
#ifndef VEDUTA_TEST_CODEC_PICTURES_H
#define VEDUTA_TEST_CODEC_PICTURES_H

#include "support.h"
#include <veduta/codec.h>

typedef enum test_look {
    TEST_EMPTY = 0,
    TEST_OPAQUE, /* smooth */
    TEST_NOISE,  /* any bytes, not premultiplied */
    TEST_TREE,   /* blobs with soft edges on nothing */
    TEST_FLAT,   /* long runs */
    TEST_LOOK_COUNT
} test_look;

static inline void test_set_pixel(uint8_t *p, int r, int g, int b, int alpha) {
    p[0] = (uint8_t)(r * alpha / 255);
    p[1] = (uint8_t)(g * alpha / 255);
    p[2] = (uint8_t)(b * alpha / 255);
    p[3] = (uint8_t)alpha;
}

static inline void test_paint_tree(uint8_t *rgba, int width, int height, size_t stride,
                                   uint64_t *seed) {
    for (int blob = 0; blob < 24; blob++) {
        const double cx = width * (0.3 + 0.4 * test_uniform(seed));
        const double cy = height * (0.2 + 0.5 * test_uniform(seed));
        const double radius = 0.5 + 0.12 * width * test_uniform(seed);
        const int shade = (int)(test_random(seed) % 120);
        for (int y = 0; y < height; y++) {
            for (int x = 0; x < width; x++) {
                const double dx = x - cx, dy = y - cy;
                const double inside = radius * radius - dx * dx - dy * dy;
                if (inside > 0) {
                    const double soft = inside / radius;
                    test_set_pixel(rgba + 4 * ((size_t)y * stride + (size_t)x), shade, shade + 60,
                                   shade / 2, soft < 1 ? (int)(255 * soft) : 255);
                }
            }
        }
    }
}

/* The caller frees; the pixels beside the picture are 0xEE. */
static inline uint8_t *test_paint(test_look look, int width, int height, size_t stride,
                                  uint64_t seed) {
    uint8_t *rgba = malloc(4 * stride * (size_t)height);
    memset(rgba, 0xEE, 4 * stride * (size_t)height);
    for (int y = 0; y < height; y++) {
        uint8_t *row = rgba + 4 * stride * (size_t)y;
        for (int x = 0; x < width; x++) {
            uint8_t *p = row + 4 * x;
            memset(p, 0, 4);
            if (look == TEST_OPAQUE) {
                test_set_pixel(p, x * 255 / width, y * 255 / height, (x + y) & 255, 255);
            } else if (look == TEST_NOISE) {
                const uint32_t any = (uint32_t)test_random(&seed);
                memcpy(p, &any, 4);
            } else if (look == TEST_FLAT && x > width / 8) {
                test_set_pixel(p, 200 - 40 * (x * 3 / width), 90, y * 5 / height, 255);
            }
        }
    }
    if (look == TEST_TREE) {
        test_paint_tree(rgba, width, height, stride, &seed);
    }
    return rgba;
}

#endif

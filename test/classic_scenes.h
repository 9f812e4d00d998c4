/* classic_scenes.h: maps and a scene for the tests of the classic picture. */
#ifndef VEDUTA_TEST_CLASSIC_SCENES_H
#define VEDUTA_TEST_CLASSIC_SCENES_H

#include "support.h"
#include <math.h>
#include <veduta/classic.h>

#define SKY ((vd_rgba8){0x90, 0x90, 0xE0, 0xFF})

typedef struct map_kind {
    int width, height;
    vd_height_type type;
    uint64_t seed;
} map_kind;

static inline uint32_t lattice(uint64_t seed, int x, int y) {
    uint64_t state = seed * 1000003u + (uint64_t)y * 65536u + (uint64_t)x;
    return (uint32_t)(test_random(&state) >> 56);
}

/* Value noise in integers, 0 … 118 like the game's own maps: four octaves of a bilinear lattice
 * that repeats with the map where the map's size allows. */
static inline int noise(uint64_t seed, int x, int y, int width, int height) {
    int sum = 0;
    for (int octave = 0; octave < 4; octave++) {
        int cell = 32 >> octave;
        int across = (width + cell - 1) / cell, down = (height + cell - 1) / cell;
        int u = x / cell, v = y / cell, fx = x % cell, fy = y % cell;
        uint64_t s = seed + (uint64_t)octave;
        int top = (int)lattice(s, u, v) * (cell - fx) + (int)lattice(s, (u + 1) % across, v) * fx;
        int bottom = (int)lattice(s, u, (v + 1) % down) * (cell - fx) +
                     (int)lattice(s, (u + 1) % across, (v + 1) % down) * fx;
        sum += ((top * (cell - fy) + bottom * fy) / (cell * cell)) << (3 - octave);
    }
    return sum * 118 / (255 * 15);
}

/* A third of the colours is the sky's, and all have some alpha, which must not show. */
static inline vd_picture *make_colors(vd_context *context, map_kind kind) {
    vd_picture *picture = NULL;
    assert_ok(vd_picture_create(context, kind.width, kind.height, 4, 8, &picture));
    uint64_t state = kind.seed + 77;
    for (int y = 0; y < kind.height; y++) {
        uint8_t *row = (uint8_t *)picture->data + (size_t)y * picture->stride_bytes;
        for (int x = 0; x < kind.width; x++) {
            uint64_t r = test_random(&state);
            vd_rgba8 color = {(uint8_t)r, (uint8_t)(r >> 8), (uint8_t)(r >> 16),
                              (uint8_t)(r >> 24)};
            if ((r >> 32) % 3 == 0) {
                color = SKY;
            }
            memcpy(row + 4 * x, &color, 4);
        }
    }
    return picture;
}

/* 16-bit heights reach 118·500; floats have fractions, negative values and some holes. */
static inline vd_heightfield *make_map(vd_context *context, map_kind kind) {
    size_t count = (size_t)kind.width * (size_t)kind.height;
    uint8_t *u8 = malloc(count);
    uint16_t *u16 = malloc(count * sizeof *u16);
    float *f32 = malloc(count * sizeof *f32);
    assert_true(u8 != NULL && u16 != NULL && f32 != NULL);
    for (int y = 0; y < kind.height; y++) {
        for (int x = 0; x < kind.width; x++) {
            int h = noise(kind.seed, x, y, kind.width, kind.height);
            size_t i = (size_t)y * (size_t)kind.width + (size_t)x;
            u8[i] = (uint8_t)h;
            u16[i] = (uint16_t)(h * 500);
            f32[i] = lattice(kind.seed, y, x) < 8 ? -INFINITY : (float)h * 1.37f - 40.0f;
        }
    }
    const void *heights[] = {u8, u16, f32};
    vd_picture *colors = make_colors(context, kind);
    vd_heightfield_def def = vd_heightfield_def_default();
    def.width = kind.width;
    def.height = kind.height;
    def.type = kind.type;
    def.heights = heights[kind.type];
    def.height_stride = (size_t)kind.width;
    def.wraps = true;
    def.colors = colors;
    vd_heightfield *map = NULL;
    assert_ok(vd_heightfield_create(context, &def, &map));
    vd_picture_destroy(&colors);
    free(u8);
    free(u16);
    free(f32);
    return map;
}

/* A map and a def small enough for an oracle: 598 slices over 128 x 128 cells. */
static const map_kind small_map = {128, 128, VD_HEIGHT_U8, 1};

static inline vd_classic_def small_def(double eye_height) {
    vd_classic_def def = vd_classic_def_default();
    def.height = eye_height;
    def.horizon = 12.0;
    def.scale = 30.0;
    def.distance = 300.0;
    def.step = 0.5;
    return def;
}

#endif

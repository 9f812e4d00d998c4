/* display_scenes.h: seeded scenes of quads, for the tests here and for the one in WebAssembly. */
#ifndef VEDUTA_TEST_DISPLAY_SCENES_H
#define VEDUTA_TEST_DISPLAY_SCENES_H

#include <string.h>
#include <veduta/display.h>

enum { DISPLAY_SCENE_QUADS = 40, DISPLAY_SCENE_TEXELS = 200000 };

typedef struct display_scene {
    int width, height;
    uint32_t background;
    int quad_count;
    vd_quad quads[DISPLAY_SCENE_QUADS];
    uint8_t texels[4 * DISPLAY_SCENE_TEXELS];
    size_t texel_count;
} display_scene;

/* SplitMix64 (Steele, Lea, Flood 2014). */
static inline uint64_t display_scene_random(uint64_t *state) {
    uint64_t z = (*state += 0x9E3779B97F4A7C15u);
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    return z ^ (z >> 31);
}

/* In [low, high). */
static inline float display_scene_between(uint64_t *state, double low, double high) {
    const double t = (double)(display_scene_random(state) >> 11) * 0x1p-53;
    return (float)(low + (high - low) * t);
}

/* Lays a quad on the pixels, w metres away. */
static inline void display_scene_screen(vd_quad *quad, int left, int top, int width, int height,
                                        float w) {
    for (int i = 0; i < 4; i++) {
        const int x = left + (i == 1 || i == 2 ? width : 0), y = top + (i >= 2 ? height : 0);
        quad->corners[i] = (vd_quad_corner){(float)x * w, (float)y * w, w};
    }
}

/* A picture with a transparent edge; opaque inside, or of any alpha; a few are very
 * wide. */
static inline vd_quad_picture display_scene_picture(display_scene *scene, uint64_t *random) {
    int width = 3 + (int)(display_scene_random(random) % 60);
    int height = 3 + (int)(display_scene_random(random) % 60);
    if (display_scene_random(random) % 32 == 0 && scene->texel_count < 20000) {
        width = 20000; /* positions of more than 22 bits */
        height = 3;
    }
    const bool opaque = display_scene_random(random) % 2 == 0;
    uint8_t *texels = scene->texels + 4 * scene->texel_count;
    scene->texel_count += (size_t)width * (size_t)height;
    for (int i = 0; i < width * height; i++) {
        const int x = i % width, y = i / width;
        const bool edge = x == 0 || y == 0 || x == width - 1 || y == height - 1;
        const uint32_t r = (uint32_t)display_scene_random(random);
        const uint32_t alpha = edge ? 0 : opaque ? 255 : r >> 24;
        for (int c = 0; c < 3; c++) {
            texels[4 * i + c] = (uint8_t)((r >> (8 * c) & 255) % (alpha + 1));
        }
        texels[4 * i + 3] = (uint8_t)alpha;
    }
    vd_quad_picture picture = {texels, width, height, (size_t)width, {0}};
    if (opaque) {
        picture.opaque[0] = picture.opaque[1] = 1;
        picture.opaque[2] = width - 1;
        picture.opaque[3] = height - 1;
    }
    return picture;
}

/* A parallelogram in space, near or far, some of them through the eye's plane, some huge. */
static inline void display_scene_corners(vd_quad *quad, uint64_t *random, double size) {
    const double depth = display_scene_between(random, 0, 1) < 0.2f ? 0.05 : 5;
    const double spread = display_scene_random(random) % 9 == 0 ? 1e6 : size;
    vd_quad_corner p[3];
    for (int i = 0; i < 3; i++) {
        const float w = display_scene_between(random, i == 0 ? 0.2 : -depth, depth);
        const double reach = i == 0 ? size : spread;
        p[i].x = display_scene_between(random, i == 0 ? 0 : -reach, reach) * 2;
        p[i].y = display_scene_between(random, i == 0 ? 0 : -reach, reach) * 2;
        p[i].w = w + (i == 0 ? 1 : 0);
    }
    for (int i = 0; i < 4; i++) {
        const float along = i == 1 || i == 2 ? 1 : 0, down = i >= 2 ? 1 : 0;
        quad->corners[i].x = p[0].x + along * p[1].x + down * p[2].x;
        quad->corners[i].y = p[0].y + along * p[1].y + down * p[2].y;
        quad->corners[i].w = p[0].w + along * p[1].w + down * p[2].w;
    }
}

static inline void display_scene_make(display_scene *scene, uint64_t seed) {
    uint64_t random = seed * 77 + 1;
    scene->texel_count = 0;
    scene->width = 1 + (int)(display_scene_random(&random) % 200);
    scene->height = 1 + (int)(display_scene_random(&random) % 150);
    scene->background = display_scene_random(&random) % 2 == 0 ? 0 : 0xFF306090u;
    scene->quad_count = 1 + (int)(display_scene_random(&random) % DISPLAY_SCENE_QUADS);
    for (int i = 0; i < scene->quad_count; i++) {
        vd_quad *quad = &scene->quads[i];
        memset(quad, 0, sizeof *quad);
        quad->picture = display_scene_picture(scene, &random);
        quad->opacity = display_scene_random(&random) % 2 == 0
                            ? 255
                            : (uint8_t)(display_scene_random(&random) % 256);
        if (display_scene_random(&random) % 4 == 0) {
            display_scene_screen(quad, (int)(display_scene_random(&random) % 200) - 50,
                                 (int)(display_scene_random(&random) % 150) - 50,
                                 quad->picture.width, quad->picture.height, 1);
        } else {
            display_scene_corners(quad, &random, 100);
        }
    }
}

/* FNV-1a 64 of the RGBA rows without padding. */
static inline uint64_t display_scene_hash(const vd_frame *frame) {
    uint64_t hash = 0xCBF29CE484222325u;
    for (int y = 0; y < frame->height; y++) {
        const uint8_t *row = frame->rgba + 4 * frame->stride * (size_t)y;
        for (int i = 0; i < 4 * frame->width; i++) {
            hash = (hash ^ row[i]) * 0x100000001B3u;
        }
    }
    return hash;
}

#endif

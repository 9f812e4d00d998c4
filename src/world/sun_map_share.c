/* sun_map_share.c: looking points up in the map. */
#include <string.h>
#include "world/sun_map.h"

/* How much of the light a texel takes from a point at a height. */
static inline float taken(const vd_sun_map *map, size_t at, float height) {
    const float top = map->top[at];
    if (!(top > height)) {
        return 0.0f;
    }
    const uint8_t alpha = map->alpha[at];
    if (alpha == 255) {
        return 1.0f;
    }
    /* What lets light through takes it from its top to its bottom. */
    const float bottom = map->bottom[at];
    const float depth = bottom < top ? (top - height) / (top - bottom) : 1.0f;
    return (float)alpha * (1.0f / 255.0f) * (depth < 1.0f ? depth : 1.0f);
}

/* Four texels side by side: compilers branch on each where plain C is written. */
typedef float four __attribute__((vector_size(16)));
typedef int32_t four_bits __attribute__((vector_size(16)));

static inline four where(four_bits mask, four v) {
    return (four)(mask & (four_bits)v);
}

/* How much of each of 4 texels from *first on the box around a place covers, in parts of it. */
static inline four weigh(float place, float width, int *first) {
    const four zero = {0}, step = {0.0f, 1.0f, 2.0f, 3.0f};
    const float from = place - 0.5f * width, to = place + 0.5f * width;
    *first = (int)from; /* at least 0 */
    const four left = step + (float)*first, right = left + 1.0f;
    const four a = where(left < from, zero + from) + where(left >= from, left);
    const four b = where(right > to, zero + to) + where(right <= to, right);
    return where(b > a, b - a) * (1.0f / width);
}

/* What four texels take, weighed. */
static inline float take_four(const vd_sun_map *map, size_t at, four weight, float height) {
    four part;
    if (map->bottom == NULL) {
        memcpy(&part, map->top + at, sizeof part);
        part = where(part > height, weight);
    } else {
        for (int c = 0; c < 4; c++) {
            part[c] = weight[c] > 0.0f ? weight[c] * taken(map, at + (size_t)c, height) : 0.0f;
        }
    }
    return (part[0] + part[1]) + (part[2] + part[3]);
}

/* The share at a place whose texels are all in the map. */
static float filter(const vd_sun_map *map, float column, float row, float height, float width) {
    int x, y;
    const four across = weigh(column, width, &x), down = weigh(row, width, &y);
    float sum = 0.0f;
    for (int r = 0; r < 4; r++) {
        const size_t at = (size_t)(y + r) * map->stride + (size_t)x;
        sum += down[r] * take_four(map, at, across, height);
    }
    const float share = 1.0f - sum;
    return share > 1e-5f ? share < 1.0f ? share : 1.0f : 0.0f;
}

uint32_t vd_sun_map_shares(const vd_sun_map *map, uint32_t mask, const float column[16],
                           const float row[16], const float height[16], const float width[16],
                           float share[16]) {
    uint32_t dark = 0;
    const float end = (float)(map->side - 2), most = map->highest_of_all;
    for (int i = 0; i < 16; i++) {
        share[i] = 1.0f;
    }
    if (map->side == 0) {
        return 0;
    }
    uint32_t inside = 0;
    for (int i = 0; i < 16; i++) {
        const uint32_t in = (uint32_t)(column[i] >= 2.0f) & (uint32_t)(column[i] < end) &
                            (uint32_t)(row[i] >= 2.0f) & (uint32_t)(row[i] < end) &
                            (uint32_t)(height[i] < most);
        inside |= in << i;
    }
    const size_t blocks = (size_t)(map->side / VD_SUN_MAP_BLOCK);
    for (inside &= mask; inside != 0; inside &= inside - 1) {
        const int i = __builtin_ctz(inside);
        const size_t x = (size_t)(int)column[i] / VD_SUN_MAP_BLOCK;
        const size_t y = (size_t)(int)row[i] / VD_SUN_MAP_BLOCK;
        if (map->highest[y * blocks + x] > height[i]) {
            share[i] = filter(map, column[i], row[i], height[i], width[i]);
            dark |= (uint32_t)(share[i] < 1.0f) << i;
        }
    }
    return dark;
}

float vd_sun_map_share(const vd_sun_map *map, const float p[3], float footprint_m) {
    float place[3][16], width[16], share[16];
    for (int i = 0; i < 16; i++) {
        for (int k = 0; k < 3; k++) {
            const float *a = map->axes[k];
            place[k][i] = (a[0] * p[0] + (a[1] * p[1] + a[2] * p[2])) + map->at[k];
        }
        width[i] = map->side > 0 ? vd_sun_map_width(map, footprint_m) : 1.0f;
    }
    (void)vd_sun_map_shares(map, 1, place[0], place[1], place[2], width, share);
    return share[0];
}

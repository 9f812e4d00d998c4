/* bench_map.c: the terrain that benches run on, made from integer noise. */
#include "bench.h"

#include <string.h>

enum { SIDE = 1024, OCTAVES = 7, COARSEST = 256, HIGHEST = 118 };

/* lowbias32, an integer hash (Wellons 2018, "Prospecting for hash functions"). */
static uint32_t hash32(uint32_t x) {
    x ^= x >> 16;
    x *= 0x7feb352du;
    x ^= x >> 15;
    x *= 0x846ca68bu;
    x ^= x >> 16;
    return x;
}

/* Value noise on a lattice of the given spacing that repeats after SIDE samples: 0 … 65535. */
static uint32_t noise_at(uint32_t x, uint32_t y, uint32_t spacing, uint32_t seed) {
    uint32_t cells = SIDE / spacing;
    uint32_t corner[4];
    for (uint32_t i = 0; i < 4; i++) {
        uint32_t cx = (x / spacing + (i & 1)) % cells, cy = (y / spacing + (i >> 1)) % cells;
        corner[i] = hash32(seed * 0x9e3779b9u + cy * cells + cx) >> 16;
    }
    /* Smoothstep 3t² − 2t³ of the position in the lattice cell, in 1/256. */
    uint32_t tx = x % spacing * 256 / spacing, ty = y % spacing * 256 / spacing;
    tx = tx * tx * (768 - 2 * tx) >> 16;
    ty = ty * ty * (768 - 2 * ty) >> 16;
    uint32_t upper = (corner[0] * (256 - tx) + corner[1] * tx) >> 8;
    uint32_t lower = (corner[2] * (256 - tx) + corner[3] * tx) >> 8;
    return (upper * (256 - ty) + lower * ty) >> 8;
}

/* Mountains: octaves that halve in size and height, squared so that valleys are wide. */
static void make_heights(uint32_t *scratch, uint8_t *heights) {
    uint32_t lowest = UINT32_MAX, highest = 0;
    for (uint32_t y = 0; y < SIDE; y++) {
        for (uint32_t x = 0; x < SIDE; x++) {
            uint32_t sum = 0;
            for (uint32_t octave = 0; octave < OCTAVES; octave++) {
                sum += noise_at(x, y, (uint32_t)COARSEST >> octave, octave + 1) >> octave;
            }
            scratch[y * SIDE + x] = sum;
            lowest = sum < lowest ? sum : lowest;
            highest = sum > highest ? sum : highest;
        }
    }
    for (uint32_t i = 0; i < SIDE * SIDE; i++) {
        uint64_t t = (uint64_t)(scratch[i] - lowest) * 65535 / (highest - lowest);
        heights[i] = (uint8_t)((t * t * HIGHEST / 65535 + 32767) / 65535);
    }
}

/* Meadow, forest, rock and snow by height, darker on slopes that face east, a little noise. */
static void make_color(const uint8_t *heights, uint32_t x, uint32_t y, uint8_t rgb[3]) {
    static const struct {
        int height;
        int rgb[3];
    } stops[] = {{0, {110, 140, 80}},
                 {30, {60, 100, 50}},
                 {60, {120, 105, 90}},
                 {90, {200, 200, 205}},
                 {HIGHEST, {250, 250, 255}}};
    int here = heights[y * SIDE + x], east = heights[y * SIDE + (x + 1) % SIDE];
    int stop = 0;
    while (here > stops[stop + 1].height) {
        stop++;
    }
    int from = stops[stop].height, to = stops[stop + 1].height;
    int light = 256 - 24 * (here - east) + (int)(hash32(y * SIDE + x) % 33) - 16;
    for (int c = 0; c < 3; c++) {
        int a = stops[stop].rgb[c], b = stops[stop + 1].rgb[c];
        int value = (a + (b - a) * (here - from) / (to - from)) * light / 256;
        rgb[c] = (uint8_t)(value < 0 ? 0 : value > 255 ? 255 : value);
    }
}

vd_status bench_map_create(vd_context *context, vd_height_type type, vd_heightfield **out) {
    vd_picture *colors = NULL;
    uint32_t *scratch = vd_allocate(context, SIDE * SIDE, sizeof *scratch);
    uint8_t *heights = vd_allocate(context, SIDE * SIDE, 1);
    float *float_heights = vd_allocate(context, SIDE * SIDE, sizeof *float_heights);
    vd_status status = vd_success();
    if (scratch == NULL || heights == NULL || float_heights == NULL) {
        status = vd_failure(VD_ERROR_MEMORY, "out of memory for the bench's map");
        goto done;
    }
    status = vd_picture_create(context, SIDE, SIDE, 3, 8, &colors);
    if (status.code != VD_OK) {
        goto done;
    }
    make_heights(scratch, heights);
    for (uint32_t y = 0; y < SIDE; y++) {
        uint8_t *row = (uint8_t *)colors->data + y * colors->stride_bytes;
        for (uint32_t x = 0; x < SIDE; x++) {
            make_color(heights, x, y, row + 3 * (size_t)x);
            float_heights[y * SIDE + x] = heights[y * SIDE + x];
        }
    }
    vd_heightfield_def def = vd_heightfield_def_default();
    def.width = SIDE;
    def.height = SIDE;
    def.type = type;
    def.heights = type == VD_HEIGHT_U8 ? (const void *)heights : (const void *)float_heights;
    def.height_stride = SIDE;
    def.wraps = type == VD_HEIGHT_U8;
    def.colors = colors;
    status = vd_heightfield_create(context, &def, out);
done:
    vd_picture_destroy(&colors);
    vd_release(context, float_heights);
    vd_release(context, heights);
    vd_release(context, scratch);
    return status;
}

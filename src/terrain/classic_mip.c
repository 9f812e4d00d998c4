/* classic_mip.c: the levels of a map that far slices read: means of 2 × 2 samples, again and again
 * while both sides are even. */
#include <string.h>
#include "core/core.h"
#include "terrain/classic_internal.h"
#include "terrain/heightfield_block.h"

static int mask_of(int size) {
    return (size & (size - 1)) == 0 ? size - 1 : -1;
}

/* The mean of 2 × 2 samples at (2·column, 2·row) of `fine`; one function a type. */
#define HALVE(name, type, mean)                                                                    \
    static void halve_##name(const vd_classic_level *fine, int row, void *out_row) {               \
        const type *up = (const type *)fine->heights + 2 * (size_t)row * fine->height_stride;      \
        const type *down = up + fine->height_stride;                                               \
        type *out = out_row;                                                                       \
        for (int i = 0; i < fine->width / 2; i++) {                                                \
            out[i] = (type)(mean);                                                                 \
        }                                                                                          \
    }

HALVE(u8, uint8_t, (up[2 * i] + up[2 * i + 1] + down[2 * i] + down[2 * i + 1] + 2) >> 2)
HALVE(u16, uint16_t, (up[2 * i] + up[2 * i + 1] + down[2 * i] + down[2 * i + 1] + 2) >> 2)
HALVE(f32, float, ((up[2 * i] + up[2 * i + 1]) + (down[2 * i] + down[2 * i + 1])) * 0.25f)

static void halve_colors(const vd_classic_level *fine, int row, vd_rgba8 *out) {
    const vd_rgba8 *up = fine->colors + 2 * (size_t)row * fine->color_stride;
    const vd_rgba8 *down = up + fine->color_stride;
    for (int i = 0; i < fine->width / 2; i++) {
        const vd_rgba8 *a = up + 2 * i, *b = down + 2 * i;
        out[i].r = (uint8_t)((a[0].r + a[1].r + b[0].r + b[1].r + 2) >> 2);
        out[i].g = (uint8_t)((a[0].g + a[1].g + b[0].g + b[1].g + 2) >> 2);
        out[i].b = (uint8_t)((a[0].b + a[1].b + b[0].b + b[1].b + 2) >> 2);
        out[i].a = 255;
    }
}

static vd_classic_level whole_map(const vd_heightfield *map) {
    vd_classic_level level = {
        .heights = vd_heightfield_level_data(map, 0),
        .height_stride = map->levels[0].stride,
        .colors = vd_heightfield_colors(map),
        .color_stride = map->color_stride,
        .width = map->width,
        .height = map->height,
        .x_mask = mask_of(map->width),
        .y_mask = mask_of(map->height),
        .scale = 1.0f,
    };
    return level;
}

static size_t align(size_t bytes) {
    return (bytes + 63) / 64 * 64;
}

/* Lays level `l` out behind `at` bytes of the mips' memory; returns where it ends. */
static size_t lay_out(vd_classic_mips *mips, int l, size_t sample, size_t at) {
    const vd_classic_level *fine = &mips->levels[l - 1];
    vd_classic_level *level = &mips->levels[l];
    level->width = fine->width / 2;
    level->height = fine->height / 2;
    level->x_mask = mask_of(level->width);
    level->y_mask = mask_of(level->height);
    level->scale = 0.5f * fine->scale;
    level->height_stride = level->color_stride = (size_t)level->width;
    const size_t count = (size_t)level->width * (size_t)level->height;
    if (mips->memory != NULL) {
        level->heights = (uint8_t *)mips->memory + at;
        level->colors =
            (const vd_rgba8 *)(void *)((uint8_t *)mips->memory + at + align(count * sample));
    }
    return at + align(count * sample) + align(count * sizeof(vd_rgba8));
}

static void fill(vd_classic_mips *mips, int l, vd_height_type type, size_t sample) {
    static void (*const halves[VD_HEIGHT_TYPE_COUNT])(const vd_classic_level *, int,
                                                      void *) = {halve_u8, halve_u16, halve_f32};
    const vd_classic_level *fine = &mips->levels[l - 1], *level = &mips->levels[l];
    const size_t width = (size_t)level->width;
    for (int row = 0; row < level->height; row++) {
        halves[type](fine, row, (uint8_t *)level->heights + (size_t)row * width * sample);
        halve_colors(fine, row, (vd_rgba8 *)level->colors + (size_t)row * width);
    }
}

vd_status vd_classic_mips_init(vd_context *context, const vd_heightfield *map, bool all,
                               vd_classic_mips *out) {
    vd_classic_mips mips;
    memset(&mips, 0, sizeof mips);
    mips.levels[0] = whole_map(map);
    mips.count = 1;
    const size_t sample = vd_height_bytes(map->height_type);
    size_t bytes = 0;
    while (all && mips.count < VD_CLASSIC_MAX_LEVELS &&
           mips.levels[mips.count - 1].width % 2 == 0 &&
           mips.levels[mips.count - 1].height % 2 == 0) {
        bytes = lay_out(&mips, mips.count++, sample, bytes);
    }
    if (bytes > 0) {
        mips.memory = vd_allocate(context, bytes, 1);
        if (mips.memory == NULL) {
            return vd_out_of_memory("the map's coarser levels", bytes);
        }
    }
    bytes = 0;
    for (int l = 1; l < mips.count; l++) {
        bytes = lay_out(&mips, l, sample, bytes);
        fill(&mips, l, (vd_height_type)map->height_type, sample);
    }
    *out = mips;
    return vd_success();
}

void vd_classic_mips_finish(vd_context *context, vd_classic_mips *mips) {
    vd_release(context, mips->memory);
    mips->memory = NULL;
}

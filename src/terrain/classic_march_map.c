/* classic_march_map.c: the map in strips with its maxima, as the march walks it. */
#include <math.h>
#include <string.h>
#include "core/core.h"
#include "terrain/classic_march.h"
#include "terrain/heightfield_block.h"

/* Sides that are no power of two are repeated to at least this: a copy costs a few KiB. */
#define MIN_SIDE 64

/* What a gather of bytes may read behind the last one, rounded up. */
#define OVERREAD 64

static bool is_power_of_two(int n) {
    return (n & (n - 1)) == 0;
}

static int repeated(int side) {
    return side >= MIN_SIDE ? side : (MIN_SIDE + side - 1) / side * side;
}

static int cells(int side, int level) {
    return (int)(((int64_t)side + ((int64_t)1 << level) - 1) >> level);
}

static size_t strip_samples(int columns, int rows) {
    return ((size_t)columns + 7) / 8 * 8 * (size_t)rows;
}

static size_t index_of(const vd_march_map *map, int level, int column, int row) {
    return (size_t)map->offset[level] + (size_t)column + 8 * (size_t)row +
           (size_t)(column & ~7) * (size_t)map->mask_y[level];
}

/* Sets the levels' tables; returns the number of samples of all levels. */
static size_t lay_out(vd_march_map *map) {
    size_t samples = 0;
    int level = 0, last = 0;
    for (; level < VD_MARCH_FINITE; level++) {
        int columns = cells(map->width, level), rows = cells(map->height, level);
        bool single = last < level && columns == 1 && rows == 1 && cells(map->width, last) == 1 &&
                      cells(map->height, last) == 1;
        if (single && !map->power_of_two) {
            break;
        }
        if (!single) {
            last = level;
            map->offset[level] = (int32_t)samples;
            samples += strip_samples(columns, rows);
        } else {
            map->offset[level] = map->offset[last];
        }
        map->mask_x[level] = columns - 1;
        map->mask_y[level] = rows - 1;
        map->cell[level] = (float)(1 << level);
        map->inverse[level] = 1.0f / (float)(1 << level);
    }
    map->everything = level;
    map->offset[level] = (int32_t)samples;
    map->mask_x[level] = map->mask_y[level] = 0;
    map->cell[level] = (float)(1 << level);
    map->inverse[level] = 1.0f / (float)(1 << level);
    return samples + 8;
}

/* One function a type, so that each compiles to a plain loop: level 0 from the rows of the map, and
 * the maxima of 2 × 2 samples for each level above. */
#define BUILD(name, type, lowest)                                                                  \
    static void copy_##name(vd_march_map *map, const vd_heightfield *from) {                       \
        type *heights = map->heights;                                                              \
        const type *rows = vd_heightfield_level_data(from, 0);                                     \
        for (int row = 0; row < map->height; row++) {                                              \
            const type *in = rows + (size_t)(row % from->height) * from->levels[0].stride;         \
            for (int column = 0, source = 0; column < map->width; column++) {                      \
                heights[index_of(map, 0, column, row)] = in[source];                               \
                source = source + 1 == from->width ? 0 : source + 1;                               \
            }                                                                                      \
        }                                                                                          \
    }                                                                                              \
    static type highest_##name(const vd_march_map *map, int level, int column, int row) {          \
        const type *heights = map->heights;                                                        \
        int columns = cells(map->width, level), rows = cells(map->height, level);                  \
        type highest = lowest;                                                                     \
        for (int i = 0; i < 4; i++) {                                                              \
            int c = 2 * column + (i & 1), r = 2 * row + (i >> 1);                                  \
            if (c < columns && r < rows) {                                                         \
                type h = heights[index_of(map, level, c, r)];                                      \
                highest = highest < h ? h : highest;                                               \
            }                                                                                      \
        }                                                                                          \
        return highest;                                                                            \
    }                                                                                              \
    static float build_##name(vd_march_map *map, const vd_heightfield *from) {                     \
        type *heights = map->heights;                                                              \
        copy_##name(map, from);                                                                    \
        int level = 1;                                                                             \
        for (; level < map->everything && map->offset[level] != map->offset[level - 1]; level++) { \
            for (int row = 0; row < cells(map->height, level); row++) {                            \
                for (int column = 0; column < cells(map->width, level); column++) {                \
                    heights[index_of(map, level, column, row)] =                                   \
                        highest_##name(map, level - 1, column, row);                               \
                }                                                                                  \
            }                                                                                      \
        }                                                                                          \
        type highest = lowest;                                                                     \
        for (int row = 0; row < cells(map->height, level - 1); row++) {                            \
            for (int column = 0; column < cells(map->width, level - 1); column++) {                \
                type h = heights[index_of(map, level - 1, column, row)];                           \
                highest = highest < h ? h : highest;                                               \
            }                                                                                      \
        }                                                                                          \
        heights[map->offset[map->everything]] = highest;                                           \
        return (float)highest;                                                                     \
    }

BUILD(u8, uint8_t, 0)
BUILD(u16, uint16_t, 0)
BUILD(f32, float, -INFINITY)

static void copy_colors(vd_march_map *map, const vd_heightfield *from) {
    const vd_rgba8 *colors = vd_heightfield_colors(from);
    for (int row = 0; row < map->height; row++) {
        const vd_rgba8 *in = colors + (size_t)(row % from->height) * from->color_stride;
        for (int column = 0, source = 0; column < map->width; column++) {
            vd_rgba8 color = in[source];
            color.a = 255;
            map->colors[index_of(map, 0, column, row)] = color;
            source = source + 1 == from->width ? 0 : source + 1;
        }
    }
}

vd_status vd_march_map_init(vd_context *context, const vd_heightfield *from, vd_march_map *out) {
    static float (*const builds[VD_HEIGHT_TYPE_COUNT])(vd_march_map *, const vd_heightfield *) = {
        build_u8, build_u16, build_f32};
    vd_march_map map;
    memset(&map, 0, sizeof map);
    map.height_type = (vd_height_type)from->height_type;
    map.power_of_two = is_power_of_two(from->width) && is_power_of_two(from->height);
    map.width = map.power_of_two ? from->width : repeated(from->width);
    map.height = map.power_of_two ? from->height : repeated(from->height);
    size_t bytes = lay_out(&map) * vd_height_bytes(from->height_type) + OVERREAD;
    map.bytes = bytes;
    size_t colors = strip_samples(map.width, map.height);
    map.heights = vd_allocate_zero(context, bytes, 1);
    map.colors = vd_allocate_zero(context, colors, sizeof *map.colors);
    if (map.heights == NULL || map.colors == NULL) {
        vd_march_map_finish(context, &map);
        return vd_out_of_memory("the map in strips", bytes + colors * sizeof *map.colors);
    }
    map.highest = builds[map.height_type](&map, from);
    copy_colors(&map, from);
    *out = map;
    return vd_success();
}

void vd_march_map_finish(vd_context *context, vd_march_map *map) {
    vd_release(context, map->heights);
    vd_release(context, map->colors);
    map->heights = NULL;
    map->colors = NULL;
}

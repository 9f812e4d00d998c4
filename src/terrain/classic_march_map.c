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

static size_t index_of(const vd_march_map *map, const int32_t *offset, int level, int column,
                       int row) {
    return (size_t)offset[level] + (size_t)column + 8 * (size_t)row +
           (size_t)(column & ~7) * (size_t)map->mask_y[level];
}

/* Whether a level has maxima of its own; where the map is too small for that, the level below has
 * the same ones. */
static bool is_own(const vd_march_map *map, int level) {
    return level < map->everything && map->offset[level] != map->offset[level - 1];
}

/* Sets the levels' tables; returns the number of samples of all levels that `heights` has. */
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
    const size_t first = strip_samples(map->width, map->height);
    map->bytes = (samples + 8) * vd_height_bytes(map->height_type);
    if (map->height_type == VD_HEIGHT_U8) { /* the second pyramid stands by itself */
        return samples + 8;
    }
    for (int l = 1; l <= level; l++) { /* the second pyramid stands behind the first */
        map->shared[l] = map->offset[l] < (int32_t)first
                             ? map->offset[l]
                             : (int32_t)((size_t)map->offset[l] + samples + 8 - first);
    }
    return 2 * (samples + 8) - first;
}

/* One function a type, so that each compiles to a plain loop: level 0 from the rows of the map, and
 * the maxima of 2 × 2 samples for each level above; for the first level of the second pyramid of
 * 3 × 3, which wrap. */
#define BUILD(name, type, lowest)                                                                  \
    static void copy_##name(vd_march_map *map, const vd_classic_level *from) {                     \
        type *heights = map->heights;                                                              \
        const type *rows = from->heights;                                                          \
        for (int row = 0; row < map->height; row++) {                                              \
            const type *in = rows + (size_t)(row % from->height) * from->height_stride;            \
            for (int column = 0, source = 0; column < map->width; column++) {                      \
                heights[index_of(map, map->offset, 0, column, row)] = in[source];                  \
                source = source + 1 == from->width ? 0 : source + 1;                               \
            }                                                                                      \
        }                                                                                          \
    }                                                                                              \
    static type highest_##name(const vd_march_map *map, const int32_t *offset, int level,          \
                               int column, int row, int reach) {                                   \
        const type *heights = map->heights;                                                        \
        const int columns = cells(map->width, level), rows = cells(map->height, level);            \
        type highest = lowest;                                                                     \
        for (int r = 2 * row; r < 2 * row + reach && r < rows + reach - 2; r++) {                  \
            for (int c = 2 * column; c < 2 * column + reach && c < columns + reach - 2; c++) {     \
                type h =                                                                           \
                    heights[index_of(map, offset, level, c < columns ? c : 0, r < rows ? r : 0)];  \
                highest = highest < h ? h : highest;                                               \
            }                                                                                      \
        }                                                                                          \
        return highest;                                                                            \
    }                                                                                              \
    static void reduce_##name(vd_march_map *map, const int32_t *offset, int level, int reach) {    \
        type *heights = map->heights;                                                              \
        for (int row = 0; row < cells(map->height, level); row++) {                                \
            for (int column = 0; column < cells(map->width, level); column++) {                    \
                heights[index_of(map, offset, level, column, row)] =                               \
                    highest_##name(map, offset, level - 1, column, row, reach);                    \
            }                                                                                      \
        }                                                                                          \
    }                                                                                              \
    static float build_##name(vd_march_map *map, const vd_classic_level *from) {                   \
        type *heights = map->heights;                                                              \
        copy_##name(map, from);                                                                    \
        int level = 1;                                                                             \
        for (; is_own(map, level); level++) {                                                      \
            reduce_##name(map, map->offset, level, 2);                                             \
            if (map->height_type != VD_HEIGHT_U8) {                                                \
                reduce_##name(map, map->shared, level, level == 1 ? 3 : 2);                        \
            }                                                                                      \
        }                                                                                          \
        type highest = lowest;                                                                     \
        for (int row = 0; row < cells(map->height, level - 1); row++) {                            \
            for (int column = 0; column < cells(map->width, level - 1); column++) {                \
                type h = heights[index_of(map, map->offset, level - 1, column, row)];              \
                highest = highest < h ? h : highest;                                               \
            }                                                                                      \
        }                                                                                          \
        heights[map->offset[map->everything]] = highest;                                           \
        if (map->height_type != VD_HEIGHT_U8) {                                                    \
            heights[map->shared[map->everything]] = highest;                                       \
        }                                                                                          \
        return (float)highest;                                                                     \
    }

BUILD(u8, uint8_t, 0)
BUILD(u16, uint16_t, 0)
BUILD(f32, float, -INFINITY)

/* The colours stay where they are unless the map is repeated. */
static vd_status take_colors(vd_context *context, vd_march_map *map, const vd_classic_level *from) {
    map->colors = from->colors;
    map->color_stride = (int)from->color_stride;
    if (map->width == from->width && map->height == from->height) {
        return vd_success();
    }
    const size_t count = (size_t)map->width * (size_t)map->height;
    map->repeated = vd_allocate(context, count, sizeof *map->repeated);
    if (map->repeated == NULL) {
        return vd_out_of_memory("a small map repeated", count * sizeof *map->repeated);
    }
    for (size_t i = 0; i < count; i++) {
        const size_t row = i / (size_t)map->width % (size_t)from->height;
        const size_t column = i % (size_t)map->width % (size_t)from->width;
        map->repeated[i] = from->colors[row * from->color_stride + column];
    }
    map->colors = map->repeated;
    map->color_stride = map->width;
    return vd_success();
}

vd_status vd_march_map_init(vd_context *context, const vd_classic_level *from, vd_height_type type,
                            vd_march_map *out) {
    static float (*const builds[VD_HEIGHT_TYPE_COUNT])(vd_march_map *, const vd_classic_level *) = {
        build_u8, build_u16, build_f32};
    vd_march_map map;
    memset(&map, 0, sizeof map);
    map.height_type = type;
    map.power_of_two = is_power_of_two(from->width) && is_power_of_two(from->height);
    map.width = map.power_of_two ? from->width : repeated(from->width);
    map.height = map.power_of_two ? from->height : repeated(from->height);
    const size_t bytes = lay_out(&map) * vd_height_bytes(type) + OVERREAD;
    map.heights = vd_allocate_zero(context, bytes, 1);
    vd_status status = map.heights == NULL ? vd_out_of_memory("the map in strips", bytes)
                                           : take_colors(context, &map, from);
    if (status.code != VD_OK) {
        vd_march_map_finish(context, &map);
        return status;
    }
    map.highest = builds[type](&map, from);
    *out = map;
    return status;
}

/* Sets the tables of the pairs; returns their number. */
static size_t lay_out_pairs(vd_march_map *map) {
    size_t count = 0;
    for (int level = 0; level <= map->everything; level++) {
        const bool top = level == map->everything;
        const int columns = top ? 1 : cells(map->width, level);
        const int rows = top ? 1 : cells(map->height, level);
        if (level > 0 && !top && !is_own(map, level)) {
            map->pair_offset[level] = map->pair_offset[level - 1];
            map->pair_lead[level] = map->pair_lead[level - 1];
            continue;
        }
        map->pair_offset[level] = (int32_t)count;
        map->pair_lead[level] = level == 0 ? columns + 1 : 2 * columns;
        count += (size_t)map->pair_lead[level] * (size_t)rows;
    }
    return count;
}

static uint8_t greatest_of(uint16_t a, uint16_t b) {
    const uint8_t values[4] = {(uint8_t)a, (uint8_t)(a >> 8), (uint8_t)b, (uint8_t)(b >> 8)};
    uint8_t greatest = 0;
    for (int i = 0; i < 4; i++) {
        greatest = greatest < values[i] ? values[i] : greatest;
    }
    return greatest;
}

/* The greatest height of 2 × 2 cells of a level of pairs, of which the right and the lower ones may
 * not exist. */
static uint8_t reduce_pairs(const vd_march_map *map, int level, int column, int row) {
    const int columns = cells(map->width, level), rows = cells(map->height, level);
    const int width = level == 0 ? 1 : 2; /* of a cell, in pairs */
    uint8_t greatest = 0;
    for (int r = 2 * row; r < 2 * row + 2 && r < rows; r++) {
        for (int c = 2 * column; c < 2 * column + 2 && c < columns; c++) {
            const uint16_t *pair = map->pairs + map->pair_offset[level] +
                                   (size_t)r * (size_t)map->pair_lead[level] +
                                   (size_t)width * (size_t)c;
            const uint8_t h = greatest_of(pair[0], pair[1]);
            greatest = greatest < h ? h : greatest;
        }
    }
    return greatest;
}

static void fill_pairs(vd_march_map *map) {
    const uint8_t *heights = map->heights;
    const size_t lead = (size_t)map->pair_lead[0];
    for (int row = 0; row < map->height; row++) {
        const int below = row + 1 == map->height ? 0 : row + 1;
        uint16_t *out = map->pairs + (size_t)row * lead;
        for (int column = 0; column < map->width; column++) {
            out[column] = (uint16_t)(heights[index_of(map, map->offset, 0, column, row)] |
                                     heights[index_of(map, map->offset, 0, column, below)] << 8);
        }
        out[map->width] = out[0];
    }
    for (int level = 1; is_own(map, level); level++) {
        for (int row = 0; row < cells(map->height, level); row++) {
            uint16_t *out =
                map->pairs + map->pair_offset[level] + (size_t)row * (size_t)map->pair_lead[level];
            for (int column = 0; column < cells(map->width, level); column++) {
                const uint16_t h = reduce_pairs(map, level - 1, column, row);
                out[2 * column] = out[2 * column + 1] = (uint16_t)(h | h << 8);
            }
        }
    }
    uint16_t *top = map->pairs + map->pair_offset[map->everything];
    top[0] = top[1] = (uint16_t)((uint16_t)map->highest | (uint16_t)map->highest << 8);
}

static void fill_strips(vd_march_map *map) {
    for (int row = 0; row < map->height; row++) {
        const vd_rgba8 *in = map->colors + (size_t)row * (size_t)map->color_stride;
        for (int column = 0; column < map->width; column++) {
            map->strips[index_of(map, map->offset, 0, column, row)] = in[column];
        }
    }
}

vd_status vd_march_map_prepare(vd_context *context, vd_march_map *map, bool linear) {
    if (map->height_type != VD_HEIGHT_U8 || (linear ? map->pairs != NULL : map->strips != NULL)) {
        return vd_success();
    }
    if (map->either == NULL) {
        const size_t strips = strip_samples(map->width, map->height) * sizeof *map->strips;
        const size_t pairs = lay_out_pairs(map) * sizeof *map->pairs;
        const size_t bytes = strips > pairs ? strips : pairs;
        map->either = vd_allocate_zero(context, bytes, 1);
        if (map->either == NULL) {
            return vd_out_of_memory("the map's colours in strips", bytes);
        }
    }
    map->pairs = linear ? map->either : NULL;
    map->strips = linear ? NULL : map->either;
    (linear ? fill_pairs : fill_strips)(map);
    return vd_success();
}

void vd_march_map_finish(vd_context *context, vd_march_map *map) {
    vd_release(context, map->heights);
    vd_release(context, map->repeated);
    vd_release(context, map->either);
    map->either = NULL;
    map->heights = NULL;
    map->pairs = NULL;
    map->strips = NULL;
    map->repeated = NULL;
}

/* horizon_map.c: minima of a heightfield over blocks of cells; see horizon_map.h. */
#include "terrain/horizon_map.h"

#include <math.h>
#include "core/core.h"
#include "terrain/heightfield_block.h"

#define FIRST_LEVEL 2

/* The lowest and highest of the samples at the corners of some cells. Written out for each type:
 * walls are read by this. */
#define RANGE_OF(name, type)                                                                       \
    static void name(const type *samples, size_t stride, int columns, int rows, float *low,        \
                     float *high) {                                                                \
        type least = samples[0], most = samples[0];                                                \
        for (int r = 0; r < rows; r++, samples += stride) {                                        \
            for (int c = 0; c < columns; c++) {                                                    \
                least = samples[c] < least ? samples[c] : least;                                   \
                most = samples[c] > most ? samples[c] : most;                                      \
            }                                                                                      \
        }                                                                                          \
        *low = (float)least;                                                                       \
        *high = (float)most;                                                                       \
    }
RANGE_OF(range_u8, uint8_t)
RANGE_OF(range_u16, uint16_t)
RANGE_OF(range_f32, float)

static void range_of_samples(const vd_horizon_map *map, vd_cells in, float *low, float *high) {
    const vd_heightfield *h = map->field;
    const size_t stride = (size_t)h->levels[0].stride;
    const size_t first = (size_t)in.r0 * stride + (size_t)in.c0;
    const void *data = vd_heightfield_level_data(h, 0);
    const int columns = in.c1 - in.c0 + 2, rows = in.r1 - in.r0 + 2;
    switch (h->height_type) {
    case VD_HEIGHT_U8:
        range_u8((const uint8_t *)data + first, stride, columns, rows, low, high);
        break;
    case VD_HEIGHT_U16:
        range_u16((const uint16_t *)data + first, stride, columns, rows, low, high);
        break;
    default:
        range_f32((const float *)data + first, stride, columns, rows, low, high);
        break;
    }
}

static float block_minimum(const vd_horizon_map *map, int column, int row) {
    const int side = 1 << FIRST_LEVEL, last_c = map->field->width - 2;
    const int last_r = map->field->height - 2;
    const vd_cells block = {column * side, row * side,
                            (column + 1) * side - 1 < last_c ? (column + 1) * side - 1 : last_c,
                            (row + 1) * side - 1 < last_r ? (row + 1) * side - 1 : last_r};
    float low, high;
    range_of_samples(map, block, &low, &high);
    return low;
}

static void build_first_row(void *user, int index, int worker) {
    (void)worker;
    const vd_horizon_map *map = user;
    const vd_minima_level *l = &map->level[FIRST_LEVEL];
    for (int c = 0; c < l->columns; c++) {
        l->minima[(size_t)index * (size_t)l->columns + (size_t)c] = block_minimum(map, c, index);
    }
}

static void build_coarser(const vd_minima_level *fine, const vd_minima_level *coarse) {
    for (int row = 0; row < coarse->rows; row++) {
        for (int column = 0; column < coarse->columns; column++) {
            float least = INFINITY;
            for (int r = 2 * row; r < 2 * row + 2 && r < fine->rows; r++) {
                for (int c = 2 * column; c < 2 * column + 2 && c < fine->columns; c++) {
                    const float m = fine->minima[(size_t)r * (size_t)fine->columns + (size_t)c];
                    least = m < least ? m : least;
                }
            }
            coarse->minima[(size_t)row * (size_t)coarse->columns + (size_t)column] = least;
        }
    }
}

static vd_status allocate_levels(vd_horizon_map *map) {
    const int columns = map->field->width - 1, rows = map->field->height - 1;
    size_t total = 0, at = 0;
    int level = FIRST_LEVEL;
    for (bool last = false; !last && level < VD_HEIGHTFIELD_MAX_LEVELS; level++) {
        vd_minima_level *l = &map->level[level];
        const int side = 1 << level;
        l->columns = (columns + side - 1) / side;
        l->rows = (rows + side - 1) / side;
        total += (size_t)l->columns * (size_t)l->rows;
        last = l->columns <= 1 && l->rows <= 1;
    }
    map->levels = level;
    map->memory = vd_allocate(map->context, total, sizeof *map->memory);
    if (map->memory == NULL) {
        return vd_out_of_memory("the minima of the terrain", total * sizeof *map->memory);
    }
    for (level = FIRST_LEVEL; level < map->levels; level++) {
        map->level[level].minima = map->memory + at;
        at += (size_t)map->level[level].columns * (size_t)map->level[level].rows;
    }
    return vd_success();
}

vd_status vd_horizon_map_create(vd_context *context, vd_job *job, const vd_heightfield *heightfield,
                                const vd_terrain_window *window, vd_horizon_map **out) {
    vd_horizon_map *map = vd_allocate_zero(context, 1, sizeof *map);
    if (map == NULL) {
        return vd_out_of_memory("the horizon's map", sizeof *map);
    }
    map->context = context;
    map->field = heightfield;
    const bool all = window == NULL || window->columns == 0;
    map->column = all ? 0 : window->column;
    map->row = all ? 0 : window->row;
    map->column_end = all ? heightfield->width - 1 : window->column + window->columns;
    map->row_end = all ? heightfield->height - 1 : window->row + window->rows;
    vd_status status = allocate_levels(map);
    if (status.code == VD_OK) {
        status = vd_parallel_for(context, job, map->level[FIRST_LEVEL].rows, build_first_row, map);
    }
    for (int level = FIRST_LEVEL + 1; status.code == VD_OK && level < map->levels; level++) {
        build_coarser(&map->level[level - 1], &map->level[level]);
    }
    if (status.code != VD_OK) {
        vd_horizon_map_destroy(&map);
        return status;
    }
    *out = map;
    return status;
}

void vd_horizon_map_destroy(vd_horizon_map **map) {
    if (*map != NULL) {
        vd_release((*map)->context, (*map)->memory);
        vd_release((*map)->context, *map);
        *map = NULL;
    }
}

float vd_horizon_lowest(const vd_horizon_map *map, vd_cells in) {
    if (in.c1 - in.c0 < VD_HORIZON_DIRECT && in.r1 - in.r0 < VD_HORIZON_DIRECT) {
        float low, high;
        range_of_samples(map, in, &low, &high);
        return low;
    }
    int level = FIRST_LEVEL;
    while (level + 1 < map->levels &&
           ((in.c1 >> level) - (in.c0 >> level) > 2 || (in.r1 >> level) - (in.r0 >> level) > 2)) {
        level++;
    }
    const vd_minima_level *l = &map->level[level];
    float least = INFINITY;
    for (int r = in.r0 >> level; r <= in.r1 >> level; r++) {
        for (int c = in.c0 >> level; c <= in.c1 >> level; c++) {
            const float m = l->minima[(size_t)r * (size_t)l->columns + (size_t)c];
            least = m < least ? m : least;
        }
    }
    return least;
}

float vd_horizon_highest(const vd_horizon_map *map, vd_cells in) {
    if (in.c1 - in.c0 < VD_HORIZON_DIRECT && in.r1 - in.r0 < VD_HORIZON_DIRECT) {
        float low, high;
        range_of_samples(map, in, &low, &high);
        return high;
    }
    int level = 1;
    while (level + 1 < map->field->level_count &&
           ((in.c1 >> level) - (in.c0 >> level) > 2 || (in.r1 >> level) - (in.r0 >> level) > 2)) {
        level++;
    }
    float most = -INFINITY;
    for (int r = in.r0 >> level; r <= in.r1 >> level; r++) {
        for (int c = in.c0 >> level; c <= in.c1 >> level; c++) {
            const float m = vd_heightfield_sample(map->field, map->field, level, c, r);
            most = m > most ? m : most;
        }
    }
    return most;
}

/* lens_function.c: the windows of an endless function, sampled in parallel where the picture looks.
 * What and why: lens_function.h. */
#include "terrain/lens_function.h"
#include <string.h>
#include "core/core.h"

#define TILE VD_LENS_FUNCTION_TILE
#define CHUNK VD_LENS_FUNCTION_CHUNK
#define CHUNK_TILES (CHUNK / TILE)
#define CHUNK_LEVELS 8 /* block levels within a chunk: 2^8 cells */
#define BATCH_ROWS 4   /* rows of a tile that are evaluated in one call */

/* Squares are tested with this many cells around them, so that slopes at what is seen are whole. */
#define GROW 2

/* Heights are tested with this share of all lengths added: 16 times what rounding makes of a ray's
 * height at most (lens_view.c, ROUNDING). */
#define LIFT 0x1p-16

/* Where colour maps stretch: heights at RANGE_SIDE² points, RANGE_STEP cells apart. */
#define RANGE_SIDE 256
#define RANGE_STEP 16

struct vd_lens_function_worker {
    _Alignas(64) float lowest;
    float highest;
};

vd_status vd_lens_function_init(vd_context *context, vd_job *job, const vd_terrain_def *def,
                                vd_lens_function *out) {
    vd_lens_function f;
    memset(&f, 0, sizeof f);
    f.context = context;
    f.kernels = vd_lens_kernels_for(vd_context_isa(context));
    const double step = RANGE_STEP * def->cell_m, edge = 0.5 * RANGE_SIDE * step;
    const vd_function_grid grid = {-edge, edge, step, RANGE_SIDE, RANGE_SIDE};
    vd_heightfield *around = NULL;
    vd_status status = vd_function_heightfield(context, job, def->function, &grid, &around);
    if (status.code != VD_OK) {
        return status;
    }
    f.low = around->min;
    f.high = around->max;
    vd_heightfield_destroy(context, &around);
    f.light = vd_allocate_zero(context, 1, sizeof *f.light);
    f.workers = vd_allocate_zero(context, (size_t)vd_context_threads(context), sizeof *f.workers);
    if (f.light == NULL || f.workers == NULL) {
        vd_lens_function_finish(&f);
        return vd_out_of_memory("a function's light", sizeof *f.light);
    }
    *out = f;
    return status;
}

void vd_lens_function_finish(vd_lens_function *f) {
    if (f->context != NULL) {
        vd_release(f->context, f->light);
        vd_release(f->context, f->workers);
        f->light = NULL;
        f->workers = NULL;
    }
}

void vd_lens_function_turn(vd_lens_function *f, const vd_terrain_def *def, const vd_lens_map *map,
                           int level) {
    const vd_lens_ground *g = &map->ground[level];
    vd_lens_light *l = f->light;
    f->shape.width = g->columns + 1;
    f->shape.height = g->rows + 1;
    f->shape.min = f->low;
    f->shape.max = f->high;
    f->shape.holes = 1; /* there may be */
    l->map = &f->shape;
    l->heights = g->heights;
    l->stride = g->stride;
    const float slope = (float)(def->exaggeration / (f->cell * (double)(1 << level)));
    const float slopes[4] = {slope, 0.0f, 0.0f, -slope};
    memcpy(l->slope, slopes, sizeof slopes);
    if (level == 0) {
        vd_lens_light_constants(def, l);
        vd_lens_light_fill(l, def, 0, l->table_count);
    }
}

/* ---- sampling ---------------------------------------------------------------------------------
 */

typedef struct work {
    vd_lens_function *f;
    const vd_terrain_def *def;
    const vd_lens_map *map;
    int level;
    int chunks_x, tiles_x;
} work;

/* A rectangle of samples of a level. */
typedef struct patch {
    int column, row, columns, rows;
} patch;

static patch clip(const vd_lens_ground *g, int column, int row, int side) {
    const int columns = g->columns + 1 - column, rows = g->rows + 1 - row;
    return (patch){column, row, columns < side ? columns : side, rows < side ? rows : side};
}

static double column_x(const work *w, int column) {
    return vd_lens_function_at(w->f->first_column, w->map->ground[w->level].column, column,
                               w->level, w->f->cell);
}

static double row_y(const work *w, int row) {
    return -vd_lens_function_at(w->f->first_row, w->map->ground[w->level].row, row, w->level,
                                w->f->cell);
}

/* The square of the horizontal distance from the eye to a rectangle relative to it. */
static double distance_squared(const double low[2], const double high[2]) {
    double sum = 0.0;
    for (int i = 0; i < 2; i++) {
        const double d = low[i] > 0.0 ? low[i] : high[i] < 0.0 ? high[i] : 0.0;
        sum += d * d;
    }
    return sum;
}

/* Whether a box without a floor lies outside one of a slice's planes. */
static bool outside(const vd_lens_slice *slice, const double low[2], const double high[2],
                    double top) {
    for (int i = 0; i < 6; i++) {
        const vd_vec3 n = slice->planes[i].normal;
        if (n.z < 0.0 || (n.z > 0.0 && top == INFINITY)) {
            continue;
        }
        const double most = (n.x > 0.0 ? n.x * high[0] : n.x * low[0]) +
                            (n.y > 0.0 ? n.y * high[1] : n.y * low[1]) +
                            (n.z > 0.0 ? n.z * top : 0.0);
        if (most < slice->planes[i].offset) {
            return true;
        }
    }
    return false;
}

static bool is_seen(const work *w, const patch *p) {
    const vd_lens_function *f = w->f;
    const double x[2] = {column_x(w, p->column - GROW), column_x(w, p->column + p->columns + GROW)};
    const double y[2] = {row_y(w, p->row + p->rows + GROW), row_y(w, p->row - GROW)};
    const double low[2] = {x[0] - f->eye.x, y[0] - f->eye.y};
    const double high[2] = {x[1] - f->eye.x, y[1] - f->eye.y};
    const vd_lens_slice *slice = &f->slices[w->level];
    if (outside(slice, low, high, INFINITY)) {
        return false;
    }
    float min, max;
    vd_function_bounds(w->def->function, (float)x[0], (float)x[1], (float)y[0], (float)y[1], &min,
                       &max);
    if (!(min <= max) || max == INFINITY) {
        return true;
    }
    if (max == -INFINITY) {
        return false; /* all holes */
    }
    double top = (double)max * w->def->exaggeration;
    const double reach = -slice->planes[5].offset;
    top += LIFT * (1.0 + fabs(top) + fabs(f->eye.z) + reach) - f->eye.z;
    top -= f->perspective ? f->curve * distance_squared(low, high) : 0.0;
    return !outside(slice, low, high, top);
}

static float *height_row(const work *w, int row) {
    const vd_lens_ground *g = &w->map->ground[w->level];
    return vd_lens_heights(w->map, w->level) + (size_t)row * g->stride;
}

static uint32_t *texel_row(const work *w, int row) {
    return vd_lens_texels(w->map, w->level) + (ptrdiff_t)row * w->map->texture[w->level].stride;
}

static void measure(vd_lens_function_worker *worker, const float *heights, int count) {
    float low = worker->lowest, high = worker->highest;
    for (int i = 0; i < count; i++) {
        const float h = heights[i];
        low = h > -INFINITY && h < low ? h : low;
        high = h > high ? h : high;
    }
    worker->lowest = low;
    worker->highest = high;
}

/* Samples a tile: heights, and colours where the function has some. */
static void sample(const work *w, const patch *p, int worker) {
    float x[TILE * BATCH_ROWS], y[TILE * BATCH_ROWS], h[TILE * BATCH_ROWS];
    float color[3][TILE * BATCH_ROWS];
    float *const planes[3] = {color[0], color[1], color[2]};
    const bool colors = vd_function_has_color(w->def->function);
    for (int i = 0; i < p->columns; i++) {
        x[i] = (float)column_x(w, p->column + i);
    }
    for (int k = 1; k < BATCH_ROWS; k++) {
        memcpy(x + k * p->columns, x, (size_t)p->columns * sizeof *x);
    }
    for (int from = 0; from < p->rows; from += BATCH_ROWS) {
        const int rows = p->rows - from < BATCH_ROWS ? p->rows - from : BATCH_ROWS;
        const int count = rows * p->columns;
        for (int k = 0; k < rows; k++) {
            const float row = (float)row_y(w, p->row + from + k);
            for (int i = 0; i < p->columns; i++) {
                y[k * p->columns + i] = row;
            }
        }
        vd_function_evaluate(w->def->function, (size_t)count, x, y, h, colors ? planes : NULL);
        measure(&w->f->workers[worker], h, count);
        for (int k = 0; k < rows; k++) {
            const int row = p->row + from + k, at = k * p->columns;
            memcpy(height_row(w, row) + p->column, h + at, (size_t)p->columns * sizeof *h);
            uint32_t *to = texel_row(w, row) + p->column;
            for (int i = 0; colors && i < p->columns; i++) {
                to[i] =
                    vd_lens_function_color(color[0][at + i], color[1][at + i], color[2][at + i]);
            }
        }
    }
}

static void mark_tiles(const work *w, const patch *p, uint8_t sampled) {
    uint8_t *tiles = w->f->tiles + w->f->tile_offset[w->level];
    for (int r = p->row / TILE; r <= (p->row + p->rows - 1) / TILE; r++) {
        memset(tiles + r * w->tiles_x + p->column / TILE, sampled,
               (size_t)((p->columns - 1) / TILE + 1));
    }
}

static void leave_out(const work *w, const patch *p) {
    for (int r = p->row; r < p->row + p->rows; r++) {
        float *to = height_row(w, r) + p->column;
        for (int i = 0; i < p->columns; i++) {
            to[i] = -INFINITY;
        }
    }
    mark_tiles(w, p, 0);
}

static void explore(const work *w, int column, int row, int side, int worker) {
    const vd_lens_ground *g = &w->map->ground[w->level];
    if (column > g->columns || row > g->rows) {
        return;
    }
    const patch p = clip(g, column, row, side);
    if (!is_seen(w, &p)) {
        leave_out(w, &p);
    } else if (side == TILE) {
        sample(w, &p, worker);
        mark_tiles(w, &p, 1);
    } else {
        const int half = side / 2;
        for (int i = 0; i < 4; i++) {
            explore(w, column + i % 2 * half, row + i / 2 * half, half, worker);
        }
    }
}

static void sample_chunk(void *user, int index, int worker) {
    const work *w = user;
    explore(w, index % w->chunks_x * CHUNK, index / w->chunks_x * CHUNK, CHUNK, worker);
}

/* ---- light ------------------------------------------------------------------------------------
 */

/* Lights a run of at most TILE samples of a row, none of them the row's first or last. */
static void light_run(const work *w, int row, int first, int count) {
    const vd_lens_light *l = w->f->light;
    const vd_lens_kernels *kernels = w->f->kernels;
    uint32_t *to = texel_row(w, row) + first;
    uint32_t albedo[TILE];
    if (vd_function_has_color(w->def->function)) {
        memcpy(albedo, to, (size_t)count * sizeof *to);
    } else if (l->has_table) {
        kernels->table(l, l->heights + (size_t)row * l->stride + first, count, albedo);
    } else {
        for (int i = 0; i < count; i++) {
            albedo[i] = 0x00BEBEBEu; /* grey */
        }
    }
    if (l->shading) {
        float direct[TILE], up[TILE];
        kernels->terms(l, row, first, count, direct, up);
        kernels->shade(l, albedo, direct, up, count, to);
        return;
    }
    for (int i = 0; i < count; i++) {
        to[i] = albedo[i] | 0xFF000000u;
    }
}

static void light_tile(const work *w, const patch *p) {
    const int first = p->column > 1 ? p->column : 1;
    const int last = w->map->ground[w->level].columns;
    const int end = p->column + p->columns < last ? p->column + p->columns : last;
    for (int r = p->row; r < p->row + p->rows && first < end; r++) {
        light_run(w, r, first, end - first);
    }
}

/* ---- maxima -----------------------------------------------------------------------------------
 */

static int block_count(int cells, int level) {
    return (cells + (1 << level) - 1) >> level;
}

static float *block_row(const work *w, int level, int row) {
    const vd_lens_ground *g = &w->map->ground[w->level];
    return (float *)(uintptr_t)g->maxima + g->offset[level] + (size_t)row * (size_t)g->pitch[level];
}

/* Blocks [first, end) × [first_row, end_row) of a level. */
static void make_blocks(const work *w, int level, patch blocks) {
    const vd_lens_ground *g = &w->map->ground[w->level];
    float nothing[CHUNK / 2 + 1];
    for (int i = 0; i <= CHUNK / 2; i++) {
        nothing[i] = -INFINITY;
    }
    const float *const no_coarse[2] = {nothing, nothing};
    const bool first = level == 1; /* from samples, which are one more than cells */
    const int last = first ? g->rows : block_count(g->rows, level - 1) - 1;
    const int width = first ? g->columns + 1 : block_count(g->columns, level - 1);
    for (int r = blocks.row; r < blocks.row + blocks.rows; r++) {
        const float *rows[3];
        for (int i = 0; i < 3; i++) {
            const int wanted = 2 * r + (i < (first ? 3 : 2) ? i : 0);
            const int row = wanted < last ? wanted : last;
            rows[i] =
                (first ? height_row(w, row) : block_row(w, level - 1, row)) + 2 * blocks.column;
        }
        w->f->kernels->maxima(rows, width - 2 * blocks.column, first ? 3 : 2, no_coarse,
                              blocks.columns, block_row(w, level, r) + blocks.column);
    }
}

/* The blocks of a level that lie within cells [column, column + side), rows likewise. */
static patch blocks_within(const vd_lens_ground *g, int level, int column, int row, int side) {
    const int columns = block_count(g->columns, level), rows = block_count(g->rows, level);
    const int end = (column + side) >> level, end_row = (row + side) >> level;
    patch p = {column >> level, row >> level, 0, 0};
    p.columns = (end < columns ? end : columns) - p.column;
    p.rows = (end_row < rows ? end_row : rows) - p.row;
    return p;
}

static void finish_chunk(void *user, int index, int worker) {
    (void)worker;
    const work *w = user;
    const vd_lens_ground *g = &w->map->ground[w->level];
    const uint8_t *tiles = w->f->tiles + w->f->tile_offset[w->level];
    const int column = index % w->chunks_x * CHUNK, row = index / w->chunks_x * CHUNK;
    for (int i = 0; i < CHUNK_TILES * CHUNK_TILES; i++) {
        const int c = column + i % CHUNK_TILES * TILE, r = row + i / CHUNK_TILES * TILE;
        if (c <= g->columns && r <= g->rows && tiles[r / TILE * w->tiles_x + c / TILE]) {
            const patch p = clip(g, c, r, TILE);
            light_tile(w, &p);
        }
    }
    for (int level = 1; level <= g->top && level <= CHUNK_LEVELS; level++) {
        make_blocks(w, level, blocks_within(g, level, column, row, CHUNK));
    }
}

/* Blocks of more than a chunk: few. The kernel takes CHUNK / 2 a call. */
static void finish_maxima(const work *w) {
    const vd_lens_ground *g = &w->map->ground[w->level];
    for (int level = CHUNK_LEVELS + 1; level <= g->top; level++) {
        const int columns = block_count(g->columns, level), rows = block_count(g->rows, level);
        for (int from = 0; from < columns; from += CHUNK / 2) {
            const int some = columns - from < CHUNK / 2 ? columns - from : CHUNK / 2;
            make_blocks(w, level, (patch){from, 0, some, rows});
        }
    }
}

/* ---- all of it --------------------------------------------------------------------------------
 */

static vd_status fill_level(work *w, vd_job *job) {
    const vd_lens_ground *g = &w->map->ground[w->level];
    w->chunks_x = g->columns / CHUNK + 1;
    w->tiles_x = g->columns / TILE + 1;
    const int chunks = w->chunks_x * (g->rows / CHUNK + 1);
    vd_lens_function_turn(w->f, w->def, w->map, w->level);
    vd_status status = vd_parallel_for(w->f->context, job, chunks, sample_chunk, w);
    if (status.code == VD_OK) {
        status = vd_parallel_for(w->f->context, job, chunks, finish_chunk, w);
    }
    finish_maxima(w);
    return status;
}

vd_status vd_lens_function_aim(vd_lens_function *f, vd_job *job, const vd_terrain_def *def,
                               const vd_camera *camera, int width, int height, vd_lens_map *map) {
    vd_status status = vd_lens_function_lay_out(f, def, camera, width, height, map);
    const int threads = vd_context_threads(f->context);
    for (int i = 0; i < threads; i++) {
        f->workers[i].lowest = INFINITY;
        f->workers[i].highest = -INFINITY;
    }
    work w = {f, def, map, 0, 0, 0};
    for (; status.code == VD_OK && w.level < map->levels; w.level++) {
        status = fill_level(&w, job);
    }
    float low = INFINITY, high = -INFINITY;
    for (int i = 0; i < threads; i++) {
        low = f->workers[i].lowest < low ? f->workers[i].lowest : low;
        high = f->workers[i].highest > high ? f->workers[i].highest : high;
    }
    map->lowest = high > -INFINITY ? low + 0.0f : 0.0f;
    map->highest = high > -INFINITY ? high + 0.0f : 0.0f;
    return status;
}

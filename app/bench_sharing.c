/* bench_sharing.c: the false-sharing experiment of the published OpenMP/CUDA report.
 *
 * The report's OpenMP version, a parallel loop over the columns inside every slice, became slower
 * from 8 to 64 cores: 22 to 74 seconds for the same work. It suspects false sharing: the hidden row
 * and the pixels of neighbouring columns lie in one cache line, and a line that two cores write to
 * travels between them; padding, it says, should help, and was not tried. Here it is. The published
 * loop, slices outside, over columns that belong to threads once and for all, so that nothing but
 * the layout differs:
 *
 *     layout   columns of a thread        hidden rows      pixels
 *     dealt    t, t + T, t + 2T …         side by side     in the frame, row-major
 *     padded   the same                   a line each      a column each, merged at the end
 *     halves   W/T neighbours             side by side     in the frame
 *     tiled    blocks of 16 neighbours    side by side     in the frame
 *
 * 16 pixels of 4 bytes and 16 hidden rows of 4 bytes are one line: tiles never share one. Each runs
 * with a hidden row that is stored when it changes, and ("-store") at every sample, which is what a
 * loop without a branch does. `slices` and `columns` of the library stand beside: the first opens a
 * parallel region for every slice as published, the second opens one.
 *
 * `counters` is what the words mean at their worst: every thread adds to a number of its own, all
 * of them in one line, or in a line each.
 */
#include "bench.h"

#include <string.h>

enum { TILE = 16, LINE_BYTES = 64, LINE_ROWS = LINE_BYTES / 4 };

typedef enum layout { DEALT = 0, PADDED, HALVES, TILED, LAYOUT_COUNT } layout;

typedef struct sharing {
    bench_scene scene;
    layout layout;
    bool store; /* the hidden row, at every sample */
    int threads;
    volatile int32_t *hidden; /* [width], or [width][LINE_ROWS] padded */
    vd_rgba8 *columns;        /* [width][height up to whole lines], padded only */
    size_t column_stride;
    float *direction_x, *direction_y;
} sharing;

/* Whether a column belongs to a thread. */
static int owner_of(const sharing *s, int column) {
    switch (s->layout) {
    case HALVES: {
        int share = (s->scene.frame->width + s->threads - 1) / s->threads;
        return column / share;
    }
    case TILED:
        return column / TILE % s->threads;
    default:
        return column % s->threads;
    }
}

static inline int floor_of(float p) {
    int whole = (int)p;
    return whole - ((float)whole > p);
}

/* The cell and row of one sample, as classic.h defines them, for 8-bit heights, sides that are
 * powers of two and positions within an int. */
static inline int32_t look(const sharing *s, float z, float rise, int column, size_t *cell) {
    const vd_heightfield *map = s->scene.map;
    int x = floor_of((float)s->scene.classic.x + z * s->direction_x[column]) & (map->width - 1);
    int y = floor_of((float)s->scene.classic.y + z * s->direction_y[column]) & (map->height - 1);
    *cell = (size_t)y * map->levels[0].stride + (size_t)x;
    float height = ((const uint8_t *)vd_heightfield_level_data(map, 0))[*cell];
    float row = ((float)s->scene.classic.height - height) * rise + (float)s->scene.classic.horizon;
    return row >= (float)INT32_MAX ? INT32_MAX : row > 0 ? (int32_t)row : 0;
}

static void paint(const sharing *s, int column, int32_t from, int32_t to, vd_rgba8 color) {
    color.a = 255;
    if (s->layout == PADDED) {
        for (int32_t row = from; row < to; row++) {
            s->columns[(size_t)column * s->column_stride + (size_t)row] = color;
        }
        return;
    }
    vd_frame *frame = s->scene.frame;
    for (int32_t row = from; row < to; row++) {
        ((vd_rgba8 *)frame->rgba)[(size_t)row * frame->stride + (size_t)column] = color;
    }
}

/* All slices of the columns of one thread; `mine` lists them. */
static void march(const sharing *s, const int *mine, int count) {
    const vd_classic_def *def = &s->scene.classic;
    const vd_heightfield *map = s->scene.map;
    const vd_rgba8 *colors = vd_heightfield_colors(map);
    size_t pitch = s->layout == PADDED ? LINE_ROWS : 1;
    uint64_t slices = vd_classic_slice_count(def);
    for (uint64_t k = 0; k < slices; k++) {
        float z = (float)def->z0 + (float)k * (float)def->step;
        float rise = (float)def->scale / z;
        for (int i = 0; i < count; i++) {
            int column = mine[i];
            volatile int32_t *hidden = &s->hidden[(size_t)column * pitch];
            size_t cell = 0;
            int32_t top = look(s, z, rise, column, &cell), last = *hidden;
            if (top < last) {
                size_t color =
                    cell / map->levels[0].stride * map->color_stride + cell % map->levels[0].stride;
                paint(s, column, top, last, colors[color]);
                last = top;
                *hidden = last;
            } else if (s->store) {
                *hidden = last;
            }
        }
    }
}

static void march_thread(void *user, int index, int worker) {
    const sharing *s = user;
    (void)worker;
    int mine[1024], count = 0;
    for (int column = 0; column < s->scene.frame->width; column++) {
        if (owner_of(s, column) == index) {
            mine[count++] = column;
        }
    }
    march(s, mine, count);
}

static void fill(const sharing *s) {
    vd_frame *frame = s->scene.frame;
    vd_rgba8 background = s->scene.classic.background;
    size_t pitch = s->layout == PADDED ? LINE_ROWS : 1;
    for (int column = 0; column < frame->width; column++) {
        s->hidden[(size_t)column * pitch] = frame->height;
        for (int row = 0; row < frame->height; row++) {
            if (s->layout == PADDED) {
                s->columns[(size_t)column * s->column_stride + (size_t)row] = background;
            }
        }
    }
    for (int row = 0; row < frame->height && s->layout != PADDED; row++) {
        vd_rgba8 *pixels = (vd_rgba8 *)frame->rgba + (size_t)row * frame->stride;
        for (int column = 0; column < frame->width; column++) {
            pixels[column] = background;
        }
    }
}

/* Brings padded columns into the frame, in tiles of a line. */
static void merge(const sharing *s) {
    vd_frame *frame = s->scene.frame;
    for (int first = 0; first < frame->width; first += TILE) {
        for (int row = 0; row < frame->height; row++) {
            vd_rgba8 *pixels = (vd_rgba8 *)frame->rgba + (size_t)row * frame->stride;
            for (int c = first; c < first + TILE && c < frame->width; c++) {
                pixels[c] = s->columns[(size_t)c * s->column_stride + (size_t)row];
            }
        }
    }
}

static vd_status draw(void *user) {
    sharing *s = user;
    fill(s);
    vd_status status = vd_parallel_for(s->scene.context, NULL, s->threads, march_thread, s);
    if (s->layout == PADDED) {
        merge(s);
    }
    return status;
}

static vd_status allocate(sharing *s) {
    const vd_frame *frame = s->scene.frame;
    size_t width = (size_t)frame->width;
    s->column_stride = ((size_t)frame->height + LINE_ROWS) / LINE_ROWS * LINE_ROWS;
    s->hidden = vd_allocate(s->scene.context, width * LINE_ROWS, sizeof *s->hidden);
    s->columns = vd_allocate(s->scene.context, width * s->column_stride, sizeof *s->columns);
    s->direction_x = vd_allocate(s->scene.context, width, sizeof *s->direction_x);
    s->direction_y = vd_allocate(s->scene.context, width, sizeof *s->direction_y);
    if (s->hidden == NULL || s->columns == NULL || s->direction_x == NULL ||
        s->direction_y == NULL) {
        return vd_failure(VD_ERROR_MEMORY, "out of memory for the columns");
    }
    /* Yaw 0 and view 1: left (−1, −1), right (1, −1). */
    for (int i = 0; i < frame->width; i++) {
        s->direction_x[i] = -1.0f + (float)i * (2.0f / (float)frame->width);
        s->direction_y[i] = -1.0f;
    }
    return vd_success();
}

static void release(sharing *s) {
    vd_release(s->scene.context, (void *)s->hidden);
    vd_release(s->scene.context, s->columns);
    vd_release(s->scene.context, s->direction_x);
    vd_release(s->scene.context, s->direction_y);
}

/* The layouts, with and without the store. */
static vd_status measure_layouts(bench_run *run, const bench_case *self, sharing *s) {
    static const char *const names[LAYOUT_COUNT] = {"dealt", "padded", "halves", "tiled"};
    vd_status status = allocate(s);
    for (int i = 0; i < 2 * (int)LAYOUT_COUNT && status.code == VD_OK; i++) {
        s->layout = (layout)(i / 2);
        s->store = i % 2 == 1;
        bench_result result = bench_result_of(self, names[s->layout]);
        if (s->store) {
            snprintf(result.method, sizeof result.method, "%s-store", names[s->layout]);
        }
        result.same_picture = true;
        status = bench_picture(run, &s->scene, draw, &result);
    }
    release(s);
    return status;
}

static bool is_power_of_two(int n) {
    return (n & (n - 1)) == 0;
}

vd_status bench_sharing(bench_run *run, const bench_case *self) {
    vd_status status = vd_success();
    for (int t = 0; t < run->thread_count && status.code == VD_OK; t++) {
        sharing s = {.threads = run->threads[t]};
        status = bench_scene_init(&s.scene, run, BENCH_MAP_CLASSIC, 0, run->isas[0],
                                  run->threads[t], self->width, self->rows);
        if (status.code != VD_OK) {
            return status;
        }
        const vd_heightfield *map = s.scene.map;
        if (map->height_type != VD_HEIGHT_U8 || !is_power_of_two(map->width) ||
            !is_power_of_two(map->height)) {
            status = vd_failure(VD_ERROR_UNSUPPORTED,
                                "the case %s takes maps of 8 bits whose sides are powers of two",
                                self->name);
        }
        for (int m = t == 0 ? VD_CLASSIC_REFERENCE : VD_CLASSIC_SLICES;
             m <= (int)VD_CLASSIC_COLUMNS && status.code == VD_OK; m++) {
            vd_classic_method method = (vd_classic_method)m;
            bench_result result = bench_result_of(self, vd_classic_method_name(method));
            status = bench_classic_method(run, &s.scene, method, &result);
        }
        if (status.code == VD_OK) {
            status = measure_layouts(run, self, &s);
        }
        bench_scene_finish(&s.scene);
    }
    return status;
}

/* ---- counters ---------------------------------------------------------------------------------*/

enum { COUNTS = 10 * 1000 * 1000, MOST_COUNTERS = 1024 };

typedef struct counters {
    vd_context *context;
    volatile uint32_t *numbers;
    size_t pitch;
} counters;

static void count_up(void *user, int index, int worker) {
    counters *c = user;
    (void)worker;
    volatile uint32_t *number = c->numbers + (size_t)index * c->pitch;
    for (int i = 0; i < COUNTS; i++) {
        *number += 1;
    }
}

static vd_status count_all(void *user) {
    counters *c = user;
    return vd_parallel_for(c->context, NULL, vd_context_threads(c->context), count_up, c);
}

static vd_status measure_counters(bench_run *run, const bench_case *self, vd_context *context,
                                  bool first) {
    counters c = {.context = context};
    c.numbers = vd_allocate(context, (size_t)MOST_COUNTERS * LINE_ROWS, sizeof *c.numbers);
    if (c.numbers == NULL) {
        return vd_failure(VD_ERROR_MEMORY, "out of memory for the counters");
    }
    memset((void *)c.numbers, 0, (size_t)MOST_COUNTERS * LINE_BYTES);
    vd_status status = vd_success();
    for (int padded = 0; padded < 2 && status.code == VD_OK; padded++) {
        c.pitch = padded ? LINE_ROWS : 1;
        bench_result result = bench_result_of(self, padded ? "padded" : "adjacent");
        result.threads = vd_context_threads(context);
        result.isa = vd_context_isa(context);
        result.reference = padded && first;
        status = bench_measure(run, count_all, &c, bench_wall_ms, &result);
        if (status.code == VD_OK) {
            status = bench_add(run, &result);
        }
    }
    vd_release(context, (void *)c.numbers);
    return status;
}

vd_status bench_counters(bench_run *run, const bench_case *self) {
    vd_status status = vd_success();
    for (int t = 0; t < run->thread_count && status.code == VD_OK; t++) {
        vd_context *context = NULL;
        vd_context_def def = vd_context_def_default();
        def.threads = run->threads[t];
        def.isa = run->isas[0];
        status = vd_context_create(&def, &context);
        if (status.code == VD_OK) {
            status = measure_counters(run, self, context, t == 0);
            vd_context_destroy(&context);
        }
    }
    return status;
}

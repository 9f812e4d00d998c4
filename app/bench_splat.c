/* bench_splat.c: particles drawn, and brought into order.
 *
 * The scene: the snapshot of vd_particles_generate, seen from outside, in bricks of 2^13 particles
 * that are drawn back to front; each particle a third of a pixel wide, coloured by its speed. The
 * baseline is the loop that one writes first: in the same order, project, round, blend one pixel.
 * What a frame has to move at least stands in the notes, as bytes a splat from the arrays: position
 * (12), value (4) and order (4).
 */
#include "bench.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { PARTICLES = 50000000, QUICK_PARTICLES = 1000000, BRICK = 8192 };

#define NARROW_M 0.00017f /* radius: a third of a pixel, about */

typedef struct snapshot {
    vd_particles *particles;
    vd_context *maker; /* what the particles belong to */
    int brick_count;
    vd_splats *bricks;
    vd_splat_order *orders;
    uint32_t *index; /* of all orders */
} snapshot;

/* One way to draw. */
typedef struct drawing {
    snapshot *snapshot;
    vd_context *context;
    vd_splatter *splatter;
    vd_frame *frame;
    vd_camera camera;
    vd_splat_def def;
    bool forget;      /* orders anew for every picture */
    uint16_t *pixels; /* the loop's */
} drawing;

/* ---- scene ------------------------------------------------------------------------------------*/

static void finish_snapshot(snapshot *s) {
    vd_particles_destroy(&s->particles);
    vd_context_destroy(&s->maker);
    free(s->bricks);
    free(s->orders);
    free(s->index);
}

static vd_status make_snapshot(const bench_run *run, snapshot *s) {
    const size_t count = run->quick ? QUICK_PARTICLES : PARTICLES;
    memset(s, 0, sizeof *s);
    s->brick_count = (int)((count + BRICK - 1) / BRICK);
    s->bricks = calloc((size_t)s->brick_count, sizeof *s->bricks);
    s->orders = calloc((size_t)s->brick_count, sizeof *s->orders);
    s->index = malloc(count * sizeof *s->index);
    if (s->bricks == NULL || s->orders == NULL || s->index == NULL) {
        return vd_failure(VD_ERROR_MEMORY, "out of memory for %zu particles", count);
    }
    vd_status status = vd_context_create(NULL, &s->maker);
    if (status.code == VD_OK) {
        status = vd_particles_generate(s->maker, NULL, 1, count, &s->particles);
    }
    for (int i = 0; i < s->brick_count && status.code == VD_OK; i++) {
        const size_t first = (size_t)i * BRICK, left = count - first;
        s->bricks[i] = vd_particles_splats(s->particles, first, left < BRICK ? left : BRICK);
        s->bricks[i].radius = NULL;
        s->bricks[i].radius_m = NARROW_M;
        s->bricks[i].opacity = 0.3f;
        s->bricks[i].order = &s->orders[i];
        s->orders[i].index = s->index + first;
    }
    return status;
}

static void finish_drawing(drawing *d) {
    vd_splatter_destroy(&d->splatter);
    vd_frame_destroy(&d->frame);
    vd_context_destroy(&d->context);
    free(d->pixels);
}

static vd_status init_drawing(drawing *d, const bench_case *self, snapshot *s, vd_isa isa,
                              int threads) {
    memset(d, 0, sizeof *d);
    d->snapshot = s;
    vd_context_def context_def = vd_context_def_default();
    context_def.isa = isa;
    context_def.threads = threads;
    vd_status status = vd_context_create(&context_def, &d->context);
    if (status.code == VD_OK) {
        status = vd_splatter_create(d->context, &d->splatter);
    }
    if (status.code == VD_OK) {
        status = vd_frame_create(d->context, self->width, self->rows, 0, &d->frame);
    }
    if (status.code != VD_OK) {
        finish_drawing(d);
        return status;
    }
    d->camera = (vd_camera){.eye = {0.9, -1.2, 0.7},
                            .lens = vd_lens_from_fov(0.75, self->width, self->rows),
                            .near_m = 0.01};
    d->camera.orientation = vd_orientation_look_at(d->camera.eye, vd_vec3_make(0, 0, 0));
    d->def = vd_splat_def_default();
    d->def.background = (vd_rgba8){0, 0, 0, 255};
    d->def.range_max = 1.5;
    d->def.sort_splats = true;
    return status;
}

static void forget_orders(snapshot *s) {
    for (int i = 0; i < s->brick_count; i++) {
        memset(s->orders[i].axis, 0, sizeof s->orders[i].axis);
    }
}

static vd_status draw(void *user) {
    drawing *d = user;
    if (d->forget) {
        forget_orders(d->snapshot);
    }
    return vd_splatter_render(d->splatter, NULL, &d->def, &d->camera, d->snapshot->bricks,
                              d->snapshot->brick_count, d->frame, NULL);
}

/* The plain loop: the orders are there, the bricks drawn as they come. */
static vd_status draw_by_loop(void *user) {
    drawing *d = user;
    const snapshot *s = d->snapshot;
    const vd_matrix m = vd_camera_matrix(&d->camera);
    const vd_vec3 eye = d->camera.eye;
    const int width = d->frame->width, height = d->frame->height;
    memset(d->pixels, 0, (size_t)width * (size_t)height * 8);
    for (int b = 0; b < s->brick_count; b++) {
        const vd_splats *of = &s->bricks[b];
        for (size_t k = 0; k < of->count; k++) {
            const size_t i = of->order->index[k];
            const float x = of->x[i] - (float)eye.x, y = of->y[i] - (float)eye.y;
            const float z = of->z[i] - (float)eye.z;
            float v[3];
            for (int r = 0; r < 3; r++) {
                const double *row = m.m[r < 2 ? r : 3];
                v[r] = (float)row[0] * x + (float)row[1] * y + (float)row[2] * z;
            }
            const int px = (int)(v[0] / v[2]), py = (int)(v[1] / v[2]);
            if (!(v[2] > 0.01f) || px < 0 || px >= width || py < 0 || py >= height) {
                continue;
            }
            uint16_t *pixel = d->pixels + 4 * ((size_t)py * (size_t)width + (size_t)px);
            const int alpha = 3000, red = (int)(of->value[i] * 40000.0f);
            const int color[4] = {red, 65535 - red, 30000, 65535};
            for (int c = 0; c < 4; c++) {
                pixel[c] = (uint16_t)(pixel[c] + ((color[c] - pixel[c]) * (alpha / 2) >> 15));
            }
        }
    }
    return vd_success();
}

/* ---- cases ------------------------------------------------------------------------------------*/

static vd_status measure(bench_run *run, bench_work *work, drawing *d, int bytes,
                         bench_result *result) {
    const double millions = (double)d->snapshot->particles->count * 1e-6;
    result->isa = vd_context_isa(d->context);
    vd_context_memory_reset_peak(d->context);
    vd_status status = bench_measure(run, work, d, bench_wall_ms, result);
    if (status.code == VD_OK) {
        const double rate = millions / result->median_ms * 1e3;
        result->peak_bytes = vd_context_memory(d->context).bytes_peak;
        snprintf(result->note, sizeof result->note, "%.1f M/s, at least %d B each: %.2f GB/s", rate,
                 bytes, rate * bytes * 1e-3);
        status = bench_add(run, result);
    }
    return status;
}

/* The ways to draw; the first two share a picture. */
static const struct way {
    const char *name;
    vd_splat_mode mode;
    bool forget;
    int bytes, picture;
    double target; /* M splats/s at v4 with two threads */
} ways[] = {{"alpha", VD_SPLAT_ALPHA, false, 20, 0, 250},
            {"alpha+sort", VD_SPLAT_ALPHA, true, 20, 0, 0},
            {"density", VD_SPLAT_DENSITY, false, 16, 1, 400},
            {"nearest", VD_SPLAT_NEAREST, false, 16, 2, 0}};

static vd_status measure_ways(bench_run *run, const bench_case *self, snapshot *s, vd_isa isa,
                              int threads) {
    drawing d;
    vd_status status = init_drawing(&d, self, s, isa, threads);
    const double millions = (double)s->particles->count * 1e-6;
    for (size_t i = 0; i < sizeof ways / sizeof ways[0] && status.code == VD_OK; i++) {
        bench_result result = bench_result_of(self, ways[i].name);
        result.threads = threads;
        result.width = self->width;
        result.height = self->rows;
        result.target_fps = threads == 2 && isa == vd_isa_best() ? ways[i].target / millions : 0.0;
        result.same_picture = true;
        result.picture = ways[i].picture;
        d.def.mode = ways[i].mode;
        d.def.log = d.def.mode == VD_SPLAT_DENSITY;
        d.def.range_min = d.def.log ? 1e-10 : 0.0;
        d.def.range_max = d.def.log ? 1e-3 : 1.5;
        d.def.max_weight = (double)s->particles->mass[0];
        d.forget = ways[i].forget;
        status = measure(run, draw, &d, ways[i].bytes, &result);
        if (status.code == VD_OK) {
            bench_result *added = &run->results[run->result_count - 1];
            added->has_hash = true;
            added->hash = vd_frame_hash(d.frame);
        }
    }
    finish_drawing(&d);
    return status;
}

static vd_status measure_loop(bench_run *run, const bench_case *self, snapshot *s) {
    drawing d;
    vd_status status = init_drawing(&d, self, s, run->isas[0], 1);
    if (status.code == VD_OK) {
        d.pixels = malloc((size_t)self->width * (size_t)self->rows * 8);
        if (d.pixels == NULL) {
            status = vd_failure(VD_ERROR_MEMORY, "out of memory for the loop's picture");
        }
    }
    if (status.code == VD_OK) { /* the orders that the loop uses */
        status =
            vd_splatter_sort(d.splatter, NULL, &d.def, &d.camera, s->bricks, s->brick_count, NULL);
    }
    if (status.code == VD_OK) {
        bench_result result = bench_result_of(self, "loop, 1 pixel");
        result.reference = true;
        result.width = self->width;
        result.height = self->rows;
        status = measure(run, draw_by_loop, &d, 20, &result);
    }
    finish_drawing(&d);
    return status;
}

vd_status bench_splat(bench_run *run, const bench_case *self) {
    snapshot s;
    vd_status status = make_snapshot(run, &s);
    if (status.code == VD_OK) {
        status = measure_loop(run, self, &s);
    }
    for (int i = 0; i < run->isa_count && status.code == VD_OK; i++) {
        for (int t = 0; t < run->thread_count && status.code == VD_OK; t++) {
            status = measure_ways(run, self, &s, run->isas[i], run->threads[t]);
        }
    }
    finish_snapshot(&s);
    return status;
}

/* ---- sorting: the dissertation's figure 6.14 --------------------------------------------------*/

typedef struct sorting {
    vd_context *context;
    vd_splatter *splatter;
    vd_camera camera;
    vd_splat_def def;
    int list_count;
    vd_splats *lists;
    vd_splat_order *orders;
    size_t each;     /* particles of a list */
    const float *z;  /* what the peers sort by, lists one after the other */
    uint32_t *index; /* of all lists */
    uint64_t *pairs; /* [2][each]: the peers' */
} sorting;

static int compare_pairs(const void *a, const void *b) {
    const uint64_t x = *(const uint64_t *)a, y = *(const uint64_t *)b;
    return (x > y) - (x < y);
}

/* Depth in the upper half, so that farther ones come first; number in the lower. */
static void make_pairs(const sorting *s, int list) {
    for (size_t i = 0; i < s->each; i++) {
        const float key = 1.0f - s->z[(size_t)list * s->each + i]; /* positive: ordered as bits */
        uint32_t bits;
        memcpy(&bits, &key, sizeof bits);
        s->pairs[i] = (uint64_t)bits << 32 | i;
    }
}

static void keep_index(const sorting *s, int list, const uint64_t *pairs) {
    for (size_t i = 0; i < s->each; i++) {
        s->index[(size_t)list * s->each + i] = (uint32_t)pairs[i];
    }
}

static vd_status sort_by_qsort(void *user) {
    sorting *s = user;
    for (int list = 0; list < s->list_count; list++) {
        make_pairs(s, list);
        qsort(s->pairs, s->each, sizeof *s->pairs, compare_pairs);
        keep_index(s, list, s->pairs);
    }
    return vd_success();
}

static vd_status sort_by_merging(void *user) {
    sorting *s = user;
    for (int list = 0; list < s->list_count; list++) {
        make_pairs(s, list);
        uint64_t *from = s->pairs, *to = s->pairs + s->each;
        for (size_t run = 1; run < s->each; run *= 2) {
            for (size_t begin = 0; begin < s->each; begin += 2 * run) {
                const size_t middle = begin + run < s->each ? begin + run : s->each;
                const size_t end = middle + run < s->each ? middle + run : s->each;
                size_t a = begin, b = middle;
                for (size_t i = begin; i < end; i++) {
                    to[i] = a < middle && (b >= end || from[a] <= from[b]) ? from[a++] : from[b++];
                }
            }
            uint64_t *swap = from;
            from = to;
            to = swap;
        }
        keep_index(s, list, from);
    }
    return vd_success();
}

static vd_status sort_by_radix(void *user) {
    sorting *s = user;
    for (int i = 0; i < s->list_count; i++) {
        memset(s->orders[i].axis, 0, sizeof s->orders[i].axis);
    }
    return vd_splatter_sort(s->splatter, NULL, &s->def, &s->camera, s->lists, s->list_count, NULL);
}

static vd_status init_sorting(sorting *s, const vd_particles *p, size_t each, vd_isa isa,
                              int threads) {
    memset(s, 0, sizeof *s);
    s->each = each;
    s->list_count = (int)(p->count / each);
    s->lists = calloc((size_t)s->list_count, sizeof *s->lists);
    s->orders = calloc((size_t)s->list_count, sizeof *s->orders);
    s->index = malloc(p->count * sizeof *s->index);
    s->pairs = malloc(2 * each * sizeof *s->pairs);
    if (s->lists == NULL || s->orders == NULL || s->index == NULL || s->pairs == NULL) {
        return vd_failure(VD_ERROR_MEMORY, "out of memory for %zu keys", p->count);
    }
    s->z = p->z;
    for (int i = 0; i < s->list_count; i++) {
        s->lists[i] = vd_particles_splats(p, (size_t)i * each, each);
        s->orders[i].index = s->index + (size_t)i * each;
        s->lists[i].order = &s->orders[i];
    }
    s->camera = (vd_camera){.eye = {0, 0, -2}, /* looks up: depth is z */
                            .orientation = {0, 0, 0, 1},
                            .lens = {100, 100, 0, 0},
                            .near_m = 0.1};
    s->def = vd_splat_def_default();
    vd_context_def context_def = vd_context_def_default();
    context_def.isa = isa;
    context_def.threads = threads;
    vd_status status = vd_context_create(&context_def, &s->context);
    return status.code == VD_OK ? vd_splatter_create(s->context, &s->splatter) : status;
}

static void finish_sorting(sorting *s) {
    vd_splatter_destroy(&s->splatter);
    vd_context_destroy(&s->context);
    free(s->lists);
    free(s->orders);
    free(s->index);
    free(s->pairs);
}

static vd_status measure_sort(bench_run *run, const bench_case *self, const vd_particles *p,
                              double at, int threads) {
    static const struct {
        const char *name;
        bench_work *work;
    } sorts[] = {{"qsort", sort_by_qsort}, {"merge", sort_by_merging}, {"radix", sort_by_radix}};
    sorting s;
    vd_status status = init_sorting(&s, p, (size_t)at, run->isas[0], threads);
    for (int i = threads == 1 ? 0 : 2; i < 3 && status.code == VD_OK; i++) {
        bench_result result = bench_result_of(self, sorts[i].name);
        result.at = at;
        result.threads = threads;
        result.isa = vd_context_isa(s.context);
        result.reference = i == 0;
        status = bench_measure(run, sorts[i].work, &s, bench_wall_ms, &result);
        if (status.code == VD_OK) {
            const double keys = (double)s.list_count * at;
            snprintf(result.note, sizeof result.note, "%.1f M keys/s, %.2f ns each",
                     keys / result.median_ms * 1e-3, result.median_ms * 1e6 / keys);
            status = bench_add(run, &result);
        }
    }
    finish_sorting(&s);
    return status;
}

vd_status bench_splat_sort(bench_run *run, const bench_case *self) {
    vd_context *context = NULL;
    vd_particles *particles = NULL;
    vd_status status = vd_context_create(NULL, &context);
    if (status.code == VD_OK) {
        status = vd_particles_generate(context, NULL, 1, 1 << 22, &particles);
    }
    for (int p = 0; p < bench_sweep_points(run, self->sweep); p++) {
        for (int t = 0; t < run->thread_count && status.code == VD_OK; t++) {
            status = measure_sort(run, self, particles, self->sweep->values[p], run->threads[t]);
        }
    }
    vd_particles_destroy(&particles);
    vd_context_destroy(&context);
    return status;
}

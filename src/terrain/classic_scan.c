/* classic_scan.c: the classic picture in data-parallel form (FutSpace thesis 2020, ch. 4, listing
 * A.2).
 *
 *   slices k      0     1     2     3     4
 *   pairs        r 7   g 5   b 6    -    y 2     colour and row; "-": under the bottom edge
 *   occlude scan r 7   g 5   g 5   g 5   y 2     inclusive, front to back
 *   scatter      row 2 = y, row 5 = g, row 7 = r; the other rows are empty
 *   fill scan    - - y y y g g r                 inclusive, top to bottom; "-": background
 *
 * Nothing here runs along a column step by step: a map, two scans and a scatter, each of which a
 * machine with enough processors does in logarithmic time. What makes a scan free to combine in any
 * grouping is that its operator is associative; both are (test_classic proves it by exhaustion).
 *
 * Where we depart from the thesis: emptiness is a flag (classic_internal.h), a row is dropped and
 * not clamped when it is at or under the bottom edge, and the pairs of one column at a time are
 * kept, not of all columns: 700 columns of the published scene would take 1.1 GB.
 */
#include <stdatomic.h>
#include "core/core.h"
#include "terrain/classic_internal.h"

/* The most slices: a worker's pairs take 16 bytes each, so 256 MiB. */
#define MAX_SCAN_SLICES ((uint32_t)1 << 24)

/* Applications of an operator, and the length of the longest chain of them. */
typedef struct scan_cost {
    uint64_t work, span;
} scan_cost;

typedef vd_classic_pair combine_function(vd_classic_pair a, vd_classic_pair b);

/* Inclusive scan in place, work-efficient: an up-sweep that leaves sums of 2, 4, 8 … elements in
 * the tree's nodes and a down-sweep that completes the rest from them (Blelloch 1990, "Prefix sums
 * and their applications"; in the inclusive form of Brent & Kung 1982, which needs no shift). All
 * applications of one distance are independent of each other; there are fewer than 2n in all. */
VD_CLASSIC_INLINE scan_cost scan(vd_classic_pair *a, size_t n, combine_function *combine) {
    scan_cost cost = {0, 0};
    size_t distance = 1;
    for (; distance < n; distance *= 2) {
        for (size_t i = 2 * distance - 1; i < n; i += 2 * distance) {
            a[i] = combine(a[i - distance], a[i]);
            cost.work++;
        }
        cost.span++;
    }
    for (distance /= 2; distance >= 1; distance /= 2) {
        for (size_t i = 3 * distance - 1; i < n; i += 2 * distance) {
            a[i] = combine(a[i - distance], a[i]);
            cost.work++;
        }
        cost.span += 3 * distance - 1 < n;
    }
    return cost;
}

/* One worker's memory and tally. The tallies are sums over columns, so they do not depend on which
 * worker drew which column. A cache line each, so that workers do not share one. */
typedef struct scratch {
    _Alignas(64) vd_classic_pair *pairs; /* [slices] */
    vd_classic_pair *pixels;             /* [rows] */
    vd_classic_counts counts;
} scratch;

typedef struct picture {
    const vd_classic_setup *setup;
    scratch *workers;
    atomic_bool interrupted;
} picture;

/* All colour-height pairs of a column. */
VD_CLASSIC_INLINE void make_pairs(const vd_classic_setup *setup, int column, vd_height_type type,
                                  vd_classic_pair *pairs) {
    vd_classic_slice slice = vd_classic_slice_first(setup);
    while (slice.k < setup->slice_count) {
        vd_classic_sample sample = vd_classic_look(setup, &slice, column, type);
        vd_classic_pair pair = vd_classic_pair_none();
        if (sample.top < setup->frame->height) {
            pair.color = vd_classic_color(setup, sample.cell_x, sample.cell_y);
            pair.depth = vd_classic_depth(setup, slice.z);
            pair.row = sample.top;
            pair.occupied = 1;
        }
        pairs[slice.k] = pair;
        vd_classic_slice_next(setup, &slice);
    }
}

VD_CLASSIC_INLINE void draw_column(const vd_classic_setup *setup, int column, vd_height_type type,
                                   scratch *s) {
    uint32_t slices = setup->slice_count;
    int rows = setup->frame->height;
    make_pairs(setup, column, type, s->pairs);
    scan_cost occlude = scan(s->pairs, slices, vd_classic_occlude);
    for (int row = 0; row < rows; row++) {
        s->pixels[row] = vd_classic_pair_none();
    }
    uint64_t scattered = 0;
    for (uint32_t k = 0; k < slices; k++) {
        /* Several slices may name one row: after the scan they carry the same pair, so the order of
         * the writes does not matter. */
        if (s->pairs[k].occupied) {
            s->pixels[s->pairs[k].row] = s->pairs[k];
            scattered++;
        }
    }
    scan_cost fill = scan(s->pixels, (size_t)rows, vd_classic_fill);
    for (int row = 0; row < rows; row++) {
        if (s->pixels[row].occupied) {
            vd_classic_put(setup->frame, column, row, s->pixels[row].color, s->pixels[row].depth);
        }
    }
    s->counts.columns++;
    s->counts.pairs += slices;
    s->counts.occlude += occlude.work;
    s->counts.scatter += scattered;
    s->counts.fill += fill.work;
    s->counts.span = occlude.span + fill.span;
}

VD_CLASSIC_INLINE void draw(picture *p, int index, int worker, vd_height_type type) {
    const vd_classic_setup *setup = p->setup;
    int first = index * VD_CLASSIC_BLOCK;
    int end = first + VD_CLASSIC_BLOCK;
    end = end < setup->frame->width ? end : setup->frame->width;
    for (int column = first; column < end; column++) {
        if (vd_job_stopped(setup->job)) {
            atomic_store(&p->interrupted, true);
            return;
        }
        draw_column(setup, column, type, &p->workers[worker]);
    }
}

static void draw_u8(void *user, int index, int worker) {
    draw(user, index, worker, VD_HEIGHT_U8);
}

static void draw_u16(void *user, int index, int worker) {
    draw(user, index, worker, VD_HEIGHT_U16);
}

static void draw_f32(void *user, int index, int worker) {
    draw(user, index, worker, VD_HEIGHT_F32);
}

static void add_counts(vd_classic_counts *sum, const vd_classic_counts *part) {
    sum->columns += part->columns;
    sum->pairs += part->pairs;
    sum->occlude += part->occlude;
    sum->scatter += part->scatter;
    sum->fill += part->fill;
    sum->span = part->span > sum->span ? part->span : sum->span;
}

static vd_status draw_with(picture *p, int threads, vd_classic_counts *counts) {
    static vd_task_function *const draws[VD_HEIGHT_TYPE_COUNT] = {draw_u8, draw_u16, draw_f32};
    const vd_classic_setup *setup = p->setup;
    int blocks = (setup->frame->width + VD_CLASSIC_BLOCK - 1) / VD_CLASSIC_BLOCK;
    vd_status status =
        vd_parallel_for(setup->context, setup->job, blocks, draws[setup->height_type], p);
    if (status.code == VD_ERROR_CANCELLED || atomic_load(&p->interrupted)) {
        return vd_classic_cancelled();
    }
    if (status.code == VD_OK) {
        vd_classic_counts sum = {.slices = setup->slice_count,
                                 .rows = (uint64_t)setup->frame->height};
        for (int i = 0; i < threads; i++) {
            add_counts(&sum, &p->workers[i].counts);
        }
        *counts = sum;
    }
    return status;
}

vd_status vd_classic_draw_scan(const vd_classic_setup *setup, vd_classic_counts *counts) {
    if (setup->slice_count > MAX_SCAN_SLICES) {
        return vd_failure(VD_ERROR_LIMIT,
                          "classic: the scan method keeps every slice of a column in memory and "
                          "takes at most %u, not %u; use the method columns",
                          MAX_SCAN_SLICES, setup->slice_count);
    }
    int threads = vd_context_threads(setup->context);
    size_t pairs_each = (size_t)setup->slice_count + (size_t)setup->frame->height;
    scratch *workers = vd_allocate_zero(setup->context, (size_t)threads, sizeof *workers);
    vd_classic_pair *pairs =
        vd_allocate(setup->context, (size_t)threads * pairs_each, sizeof *pairs);
    vd_status status;
    if (workers == NULL || pairs == NULL) {
        status = vd_out_of_memory("the colour-height pairs of a column for each thread",
                                  (size_t)threads * pairs_each * sizeof *pairs);
    } else {
        for (int i = 0; i < threads; i++) {
            workers[i].pairs = pairs + (size_t)i * pairs_each;
            workers[i].pixels = workers[i].pairs + setup->slice_count;
        }
        picture p = {setup, workers, false};
        status = draw_with(&p, threads, counts);
    }
    vd_release(setup->context, pairs);
    vd_release(setup->context, workers);
    return status;
}

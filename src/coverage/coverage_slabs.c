/* coverage_slabs.c: exact areas where edges meet, overlap or cross within a row.
 *
 * Summing signed areas gives the integral of the winding number. That is the area only where the
 * number is 0 and ±1: where a shape overlaps itself, a pixel with two windings over half of it sums
 * to 1, and one with +1 and −1 to 0. So a cluster of pieces that are not plainly one behind the
 * other is cut into slabs at every y where one begins or ends; within a slab pieces run from top to
 * bottom, and only those count that have inside on one side and outside on the other:
 *
 *     ───┬──────┬─────────  y0        left to right: winding 0 │ 1 │ 2 │ 1 │ 0
 *      0 │  1  ╱ 2 ╲   1 │ 0           non-zero:             out│in │in │in │out: the outer two
 *     ───┴────┴─────┴────┴  y1         even-odd:             out│in │out│in │out: all four
 *
 * Where the order at the bottom is not that at the top, neighbours cross. Crossings are worked off
 * from neighbour to neighbour, each pair's first one when no neighbour's comes before it: both
 * lines end there, change places and begin anew. Every exchange puts one pair into its final order,
 * so it ends, whatever rounding says about where; a crossing's place is rounded to 2^-20 pixel.
 *
 * The same on whole polygons (Bentley & Ottmann 1979) would resolve a path once and for all, but
 * needs exact predicates to be safe; here a wrong place costs 2^-20 of a pixel.
 */
#include <math.h>
#include "coverage/coverage_rows.h"

static int64_t x_of(const vd_rows *rows, const vd_piece *piece, int32_t y) {
    if (y == piece->y0) {
        return piece->x0;
    }
    if (y == piece->y1) {
        return piece->x1;
    }
    const int64_t x = (int64_t)vd_edge_at(piece->edge, rows->top + y);
    return x < piece->low ? piece->low : x < piece->high ? x : piece->high;
}

static bool is_before(const vd_active *a, const vd_active *b) {
    return a->top < b->top || (a->top == b->top && a->bottom < b->bottom);
}

/* Sorts from left to right. They come nearly sorted from the slab above. */
static void sort_active(vd_active *active, size_t count) {
    for (size_t i = 1; i < count; i++) {
        const vd_active moved = active[i];
        size_t j = i;
        for (; j > 0 && is_before(&moved, &active[j - 1]); j--) {
            active[j] = active[j - 1];
        }
        active[j] = moved;
    }
}

static int step_of(const vd_rows *rows, const vd_active *a) {
    const vd_winding_pair left = {a->left_a, a->left_b};
    return vd_is_inside(rows->rule, vd_wind(left, a->piece->edge)) - vd_is_inside(rows->rule, left);
}

/* Ends a part at (x, y) and begins the next there. */
static void end_part(vd_rows *rows, vd_active *a, int64_t x, int64_t y, int64_t origin) {
    const int step = step_of(rows, a);
    if (step != 0) {
        const int64_t shift = origin << VD_UNIT_BITS;
        vd_add_area(rows->areas, a->x - shift, x - shift, (int32_t)(y - a->y), step);
    }
    a->x = x;
    a->y = y;
}

/* The part of the slab's height, 0 … 1, at which two neighbours cross; infinity if they do not. */
static double find_crossing(const vd_active *a, const vd_active *b) {
    if (a->bottom <= b->bottom) {
        return INFINITY;
    }
    const double above = (double)(b->top - a->top), below = (double)(a->bottom - b->bottom);
    return above <= 0 ? 0 : above / (above + below);
}

static void exchange(vd_rows *rows, vd_active *a, double at, int32_t y0, int32_t y1,
                     int64_t origin) {
    vd_active *b = a + 1;
    int64_t y = y0 + (int64_t)(at * (y1 - y0) + 0.5);
    int64_t x = a->top + (int64_t)floor(at * (double)(a->bottom - a->top) + 0.5);
    y = y < a->y ? a->y : y;
    y = y < b->y ? b->y : y;
    end_part(rows, a, x, y, origin);
    end_part(rows, b, x, y, origin);
    const vd_active moved = *a;
    *a = *b;
    *b = moved;
    a->left_a = moved.left_a;
    a->left_b = moved.left_b;
    const vd_winding_pair middle = vd_wind((vd_winding_pair){a->left_a, a->left_b}, a->piece->edge);
    b->left_a = middle.a;
    b->left_b = middle.b;
}

/* A tree of minima over `leaves` numbers, a power of two: node i is the lesser of 2i and 2i + 1. */
static void set_leaf(double *tree, size_t leaves, size_t i, double v) {
    i += leaves;
    tree[i] = v;
    while (i > 1) {
        i /= 2;
        tree[i] = tree[2 * i] < tree[2 * i + 1] ? tree[2 * i] : tree[2 * i + 1];
    }
}

static size_t find_least(const double *tree, size_t leaves) {
    size_t i = 1;
    while (i < leaves) {
        i = 2 * i + (tree[2 * i] == tree[i] ? 0 : 1);
    }
    return i - leaves;
}

/* Works off the crossings of a slab, from top to bottom. */
static void resolve_crossings(vd_rows *rows, vd_active *active, size_t count, int32_t y0,
                              int32_t y1, int64_t origin) {
    bool any = false;
    for (size_t i = 0; i + 1 < count; i++) {
        any = any || active[i].bottom > active[i + 1].bottom;
    }
    if (!any) {
        return;
    }
    double *tree = rows->crossing;
    size_t leaves = 2;
    while (leaves + 1 < count) {
        leaves *= 2;
    }
    for (size_t i = 0; i < leaves; i++) {
        tree[leaves + i] =
            i + 1 < count ? find_crossing(&active[i], &active[i + 1]) : (double)INFINITY;
    }
    for (size_t i = leaves; i-- > 1;) {
        tree[i] = tree[2 * i] < tree[2 * i + 1] ? tree[2 * i] : tree[2 * i + 1];
    }
    unsigned exchanges = 0;
    while (tree[1] < INFINITY) {
        if ((++exchanges & 4095) == 0 && vd_job_stopped(rows->job)) {
            return;
        }
        const size_t i = find_least(tree, leaves);
        exchange(rows, &active[i], tree[1], y0, y1, origin);
        set_leaf(tree, leaves, i, INFINITY);
        if (i > 0) {
            set_leaf(tree, leaves, i - 1, find_crossing(&active[i - 1], &active[i]));
        }
        if (i + 2 < count) {
            set_leaf(tree, leaves, i + 1, find_crossing(&active[i + 1], &active[i + 2]));
        }
    }
}

static void add_slab(vd_rows *rows, vd_active *active, size_t count, int32_t y0, int32_t y1,
                     vd_winding_pair left, int64_t origin) {
    for (size_t i = 0; i < count; i++) {
        active[i].x = active[i].top;
        active[i].y = y0;
    }
    sort_active(active, count);
    for (size_t i = 0; i < count; i++) {
        active[i].left_a = left.a;
        active[i].left_b = left.b;
        left = vd_wind(left, active[i].piece->edge);
    }
    resolve_crossings(rows, active, count, y0, y1, origin);
    for (size_t i = 0; i < count; i++) {
        end_part(rows, &active[i], active[i].bottom, y1, origin);
    }
}

/* Slab by slab: from where a piece begins or ends to where the next does. */
void vd_add_cluster(vd_rows *rows, const vd_piece *pieces, size_t count, vd_winding_pair left,
                    int64_t origin) {
    size_t waiting = 0, first = 0, present = 0;
    for (size_t i = 0; i < count; i++) {
        if (pieces[i].y0 < pieces[i].y1) {
            rows->waiting[waiting++] = (vd_sort_key){pieces[i].y0, (uint32_t)i};
        }
    }
    vd_sort_keys(rows->waiting, waiting);
    vd_active *active = rows->active;
    int32_t y = 0;
    while (present > 0 || first < waiting) {
        if (present == 0) {
            y = (int32_t)rows->waiting[first].key;
        }
        for (; first < waiting && rows->waiting[first].key == y; first++) {
            active[present++].piece = &pieces[rows->waiting[first].index];
        }
        int32_t next = first < waiting ? (int32_t)rows->waiting[first].key : VD_UNITS;
        for (size_t i = 0; i < present; i++) {
            next = active[i].piece->y1 < next ? active[i].piece->y1 : next;
        }
        for (size_t i = 0; i < present; i++) {
            active[i].top = x_of(rows, active[i].piece, y);
            active[i].bottom = x_of(rows, active[i].piece, next);
        }
        add_slab(rows, active, present, y, next, left, origin);
        if (vd_job_stopped(rows->job)) {
            return;
        }
        size_t kept = 0;
        for (size_t i = 0; i < present; i++) {
            if (active[i].piece->y1 > next) {
                active[kept++] = active[i];
            }
        }
        present = kept;
        y = next;
    }
}

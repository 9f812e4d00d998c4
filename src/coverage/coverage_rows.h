/* coverage_rows.h: a row's pieces of edges, for the two files that turn them into areas. */
#ifndef VEDUTA_COVERAGE_COVERAGE_ROWS_H
#define VEDUTA_COVERAGE_COVERAGE_ROWS_H

#include "coverage/coverage_internal.h"

/* The part of an edge in one row. Units; y from the row's top. */
typedef struct vd_piece {
    int64_t low, high; /* the smaller and larger of the x's */
    int64_t x0, x1;    /* at y0 and y1 */
    int32_t y0, y1;
    const vd_edge *edge;
} vd_piece;

/* A piece's part in a slab: a range of y in which no other piece begins or ends. */
typedef struct vd_active {
    const vd_piece *piece;
    int64_t top, bottom;    /* x at the slab's ends */
    int64_t x, y;           /* where its present part begins */
    int32_t left_a, left_b; /* winding numbers on its left */
} vd_active;

/* What windings are to the left of the first piece of a cluster, of the fill and of its expansion.
 */
typedef struct vd_winding_pair {
    int32_t a, b;
} vd_winding_pair;

/* What is sorted: by key, of equals by index. */
typedef struct vd_sort_key {
    int64_t key;
    uint32_t index;
} vd_sort_key;

/* Scratch of a thread: room for `capacity` edges of a shape in a band. */
typedef struct vd_rows {
    size_t capacity, columns;
    vd_edge *gathered, *edges; /* as they come; by the row in which they begin */
    vd_piece *pieces, *sorted;
    vd_sort_key *keys, *waiting;
    vd_active *active;
    double *crossing;   /* [4 · capacity + 4]: a tree of where neighbours cross, or infinity */
    int32_t *areas;     /* [columns + 2], zero between uses */
    int32_t *small;     /* [32][VD_SMALL_STRIDE], the same */
    uint16_t *coverage; /* [columns] */
    /* What is being drawn. */
    const vd_coverage_run *run;
    vd_colored_span span;
    vd_fill_rule rule;
    int32_t top; /* of the row, from the band's top, units */
    vd_job *job;
} vd_rows;

/* Whether a point with these windings is inside. */
static inline int vd_is_inside(vd_fill_rule rule, vd_winding_pair w) {
    return (rule == VD_FILL_RULE_EVEN_ODD ? (w.a & 1) != 0 : w.a != 0) | (w.b != 0);
}

static inline vd_winding_pair vd_wind(vd_winding_pair w, const vd_edge *edge) {
    const int second = edge->record.kind & VD_EDGE_SECOND;
    w.a += second ? 0 : edge->record.sign;
    w.b += second ? edge->record.sign : 0;
    return w;
}

static inline int64_t vd_column(int64_t x) {
    return x >> VD_UNIT_BITS;
}

/* Adds what lies to the right of a line from x0 to x1, `height` units down (at least 0), times
 * `sign`: in each column that it touches the area, and in the next what it takes to cover all that
 * follows. areas[0] is column 0 of the x's. */
void vd_add_area(int32_t *areas, int64_t x0, int64_t x1, int32_t height, int32_t sign);

/* Adds the areas of a cluster of pieces, whatever crosses what. `origin` is areas[0]'s column. */
void vd_add_cluster(vd_rows *rows, const vd_piece *pieces, size_t count, vd_winding_pair left,
                    int64_t origin);

/* Sorts what comes nearly sorted in a pass, anything in n log n. */
void vd_sort_keys(vd_sort_key *keys, size_t count);

#endif

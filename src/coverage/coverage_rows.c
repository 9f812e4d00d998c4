/* coverage_rows.c: from a band's edges to spans, row by row.
 *
 * Of a shape's edges in a row, sorted by where they begin on the left, those whose extents touch
 * make a cluster. The outline comes into a cluster and leaves it only through the row's top and
 * bottom (what is horizontal is kept to make this true), so that left and right of a cluster the
 * winding number is one whole number over the row's whole height:
 *
 *     row   │   ╲╲      winding 1, all rows of it       ╱╲   │
 *           │ 0  ╲╲         a span without coverage    ╱ 0╲  │
 *             cluster                                 cluster
 *
 * A cluster of one piece only steps from one number to the next: it adds its signed area if that
 * changes inside to outside. Any other goes through coverage_slabs.c. So long rows cost nothing in
 * their middle, simple outlines nothing but a sort, and crossings cost where they are.
 *
 * Clusters whose columns of pixels touch make a group, and a group one span: its areas are summed
 * from left to right into coverage (Duff 1989). A convex shape of few columns needs no sort at all:
 * every winding number in it is 0 or 1, so its edges are added as they come, all rows at once.
 */
#include <string.h>
#include "core/core.h"
#include "coverage/coverage_rows.h"

/* ---- areas ------------------------------------------------------------------------------------
 */

static inline void add_pair(int32_t *areas, int32_t area, int32_t height, int32_t sign) {
    areas[0] += sign * area;
    areas[1] += sign * (height - area);
}

/* A line over several columns, from low to high; height in 2^-24. */
static void add_columns(int32_t *areas, int64_t low, int64_t high, int32_t height, int32_t sign) {
    const double scale = height / (double)(high - low);
    int64_t column = vd_column(low);
    const int64_t last = vd_column(high);
    int64_t edge = (column + 1) << VD_UNIT_BITS;
    int32_t done = (int32_t)((double)(edge - low) * scale + 0.5);
    /* In the first column the line is on average half of what is left of the column away from the
     * column's right side. */
    add_pair(areas + column, (int32_t)((int64_t)done * (edge - low) >> (VD_UNIT_BITS + 1)), done,
             sign);
    for (column++; column < last; column++) {
        edge += VD_UNITS;
        const int32_t next = (int32_t)((double)(edge - low) * scale + 0.5);
        add_pair(areas + column, (next - done) >> 1, next - done, sign);
        done = next;
    }
    const int64_t from_right = 2 * VD_UNITS - (high - edge);
    const int32_t rest = height - done;
    add_pair(areas + column, (int32_t)(rest * from_right >> (VD_UNIT_BITS + 1)), rest, sign);
}

void vd_add_area(int32_t *areas, int64_t x0, int64_t x1, int32_t height, int32_t sign) {
    const int shift = VD_AREA_BITS - VD_UNIT_BITS;
    const int64_t column = vd_column(x0);
    if (column == vd_column(x1)) {
        const int64_t from_right = 2 * ((column + 1) << VD_UNIT_BITS) - x0 - x1;
        const int bits = VD_UNIT_BITS + 1 - shift;
        const int32_t area = (int32_t)((height * from_right + ((int64_t)1 << (bits - 1))) >> bits);
        add_pair(areas + column, area, height << shift, sign);
    } else if (x0 < x1) {
        add_columns(areas, x0, x1, height << shift, sign);
    } else {
        add_columns(areas, x1, x0, height << shift, sign);
    }
}

/* ---- spans ------------------------------------------------------------------------------------
 */

static void emit(vd_rows *rows, int x, int count, const uint16_t *coverage) {
    rows->span.x = rows->run->x + x;
    rows->span.count = count;
    rows->span.coverage = coverage;
    rows->run->function(rows->run->user, &rows->span);
}

/* ---- small convex shapes ----------------------------------------------------------------------
 */

static void draw_small(vd_rows *rows, const vd_shape *shape, const vd_edge *edges, size_t count,
                       int band_y) {
    const int64_t shift = (int64_t)shape->column << VD_UNIT_BITS;
    int first = VD_BAND_ROWS, last = -1;
    for (size_t i = 0; i < count; i++) {
        const vd_edge *edge = &edges[i];
        int32_t y = edge->top;
        int row = y >> VD_UNIT_BITS;
        first = row < first ? row : first;
        int64_t x = (int64_t)vd_edge_at(edge, y);
        for (; y < edge->bottom; row++) {
            const int32_t end = (row + 1) << VD_UNIT_BITS;
            const int32_t stop = edge->bottom < end ? edge->bottom : end;
            const int64_t next = (int64_t)vd_edge_at(edge, stop);
            vd_add_area(rows->small + row * VD_SMALL_STRIDE, x - shift, next - shift, stop - y,
                        edge->sign);
            x = next;
            y = stop;
        }
        last = last < row - 1 ? row - 1 : last;
    }
    for (int row = first; row <= last; row++) {
        int32_t *areas = rows->small + row * VD_SMALL_STRIDE;
        rows->run->coverage->kernels->sum_areas(rows->coverage, areas, 0, (size_t)shape->width);
        areas[shape->width] = areas[shape->width + 1] = 0;
        rows->span.y = band_y + row;
        emit(rows, shape->column, shape->width, rows->coverage);
    }
}

/* ---- any shape --------------------------------------------------------------------------------
 */

static bool is_after(const vd_sort_key *a, const vd_sort_key *b) {
    return a->key > b->key || (a->key == b->key && a->index > b->index);
}

static void sift(vd_sort_key *keys, size_t at, size_t count) {
    const vd_sort_key moved = keys[at];
    for (size_t child; (child = 2 * at + 1) < count; at = child) {
        child += child + 1 < count && is_after(&keys[child + 1], &keys[child]);
        if (!is_after(&keys[child], &moved)) {
            break;
        }
        keys[at] = keys[child];
    }
    keys[at] = moved;
}

void vd_sort_keys(vd_sort_key *keys, size_t count) {
    size_t moves = 0;
    for (size_t i = 1; i < count && moves <= 8 * count + 64; i++) {
        const vd_sort_key moved = keys[i];
        size_t j = i;
        for (; j > 0 && is_after(&keys[j - 1], &moved); j--) {
            keys[j] = keys[j - 1];
        }
        keys[j] = moved;
        moves += i - j;
    }
    if (moves <= 8 * count + 64) {
        return;
    }
    for (size_t i = count / 2; i-- > 0;) {
        sift(keys, i, count);
    }
    for (size_t i = count; i-- > 1;) {
        const vd_sort_key largest = keys[0];
        keys[0] = keys[i];
        keys[i] = largest;
        sift(keys, 0, i);
    }
}

/* A piece's numbers from where the edge is in this row. */
static void set_piece(vd_piece *piece, int32_t row_top, int64_t limit) {
    const vd_edge *edge = piece->edge;
    const int32_t top = edge->top - row_top, bottom = edge->bottom - row_top;
    piece->y0 = top < 0 ? 0 : top;
    piece->y1 = bottom < VD_UNITS ? bottom : VD_UNITS;
    if (edge->kind & VD_EDGE_LEVEL) {
        piece->x0 = (int64_t)edge->x;
        piece->x1 = (int64_t)(edge->x + edge->slope);
    } else {
        piece->x0 = (int64_t)vd_edge_at(edge, row_top + piece->y0);
        piece->x1 = (int64_t)vd_edge_at(edge, row_top + piece->y1);
    }
    /* Where an edge was cut at the window's side, y is rounded, and x may be a unit outside. */
    piece->x0 = piece->x0 < 0 ? 0 : piece->x0 < limit ? piece->x0 : limit;
    piece->x1 = piece->x1 < 0 ? 0 : piece->x1 < limit ? piece->x1 : limit;
    piece->low = piece->x0 < piece->x1 ? piece->x0 : piece->x1;
    piece->high = piece->x0 < piece->x1 ? piece->x1 : piece->x0;
}

/* Adds a group's clusters; returns the winding numbers to their right. */
static vd_winding_pair add_group(vd_rows *rows, const vd_piece *pieces, size_t count,
                                 vd_winding_pair left, int64_t column) {
    for (size_t i = 0; i < count;) {
        int64_t high = pieces[i].high;
        vd_winding_pair right = left;
        size_t end = i;
        for (; end < count && pieces[end].low <= high; end++) {
            high = high < pieces[end].high ? pieces[end].high : high;
            if (pieces[end].y0 == 0 && pieces[end].y1 > 0) {
                right = vd_wind(right, pieces[end].edge);
            }
        }
        if (end == i + 1) {
            const vd_piece *p = &pieces[i];
            const int step =
                vd_is_inside(rows->rule, vd_wind(left, p->edge)) - vd_is_inside(rows->rule, left);
            if (step != 0) {
                const int64_t shift = column << VD_UNIT_BITS;
                vd_add_area(rows->areas, p->x0 - shift, p->x1 - shift, p->y1 - p->y0, step);
            }
        } else {
            vd_add_cluster(rows, pieces + i, end - i, left, column);
        }
        left = right;
        i = end;
    }
    return left;
}

/* A row of sorted pieces: groups, and between them what is wholly inside. */
static void draw_row(vd_rows *rows, const vd_piece *pieces, size_t count, vd_winding_pair winding) {
    const int width = rows->run->width;
    int64_t done = 0; /* columns */
    for (size_t i = 0; i < count;) {
        const int64_t column = vd_column(pieces[i].low);
        int64_t last = vd_column(pieces[i].high);
        size_t end = i + 1;
        for (; end < count && vd_column(pieces[end].low) <= last; end++) {
            const int64_t high = vd_column(pieces[end].high);
            last = last < high ? high : last;
        }
        const int inside = vd_is_inside(rows->rule, winding);
        if (inside && column > done) {
            emit(rows, (int)done, (int)(column - done), NULL);
        }
        winding = add_group(rows, pieces + i, end - i, winding, column);
        const int columns = (int)((last < width ? last + 1 : width) - column);
        rows->areas[last - column + 1] = 0;
        if (columns > 0) {
            rows->run->coverage->kernels->sum_areas(rows->coverage, rows->areas,
                                                    inside << VD_AREA_BITS, (size_t)columns);
            emit(rows, (int)column, columns, rows->coverage);
        }
        if (last >= width) {
            rows->areas[width - column] = 0;
            return;
        }
        done = last + 1;
        i = end;
    }
    if (vd_is_inside(rows->rule, winding) && done < width) {
        emit(rows, (int)done, (int)(width - done), NULL);
    }
}

/* Sorts edges by the row in which they begin: those of row r are edges[starts[r]] to
 * edges[starts[r + 1] − 1]. */
static void sort_edges(vd_edge *edges, const vd_edge *from, size_t count,
                       size_t starts[VD_BAND_ROWS + 1]) {
    size_t ends[VD_BAND_ROWS] = {0};
    for (size_t i = 0; i < count; i++) {
        ends[from[i].top >> VD_UNIT_BITS]++;
    }
    starts[0] = 0;
    for (int row = 0; row < VD_BAND_ROWS; row++) {
        starts[row + 1] = starts[row] + ends[row];
        ends[row] = starts[row];
    }
    for (size_t i = 0; i < count; i++) {
        edges[ends[from[i].top >> VD_UNIT_BITS]++] = from[i];
    }
}

static void draw_shape(vd_rows *rows, const vd_edge *edges, size_t count, int band_y,
                       int band_rows) {
    const int64_t limit = (int64_t)rows->run->width << VD_UNIT_BITS;
    size_t starts[VD_BAND_ROWS + 1], present = 0;
    sort_edges(rows->edges, edges, count, starts);
    for (int row = 0; row < band_rows; row++) {
        rows->top = row << VD_UNIT_BITS;
        size_t kept = 0, pieces = 0;
        for (size_t i = 0; i < present; i++) {
            if (rows->pieces[i].edge->bottom > rows->top) {
                rows->pieces[kept++].edge = rows->pieces[i].edge;
            }
        }
        for (size_t i = starts[row]; i < starts[row + 1]; i++) {
            rows->pieces[kept++].edge = &rows->edges[i];
        }
        present = kept;
        vd_winding_pair winding = {0, 0};
        for (size_t i = 0; i < present; i++) {
            vd_piece *piece = &rows->pieces[i];
            set_piece(piece, rows->top, limit);
            if ((piece->edge->kind & VD_EDGE_LEFT) && piece->y1 - piece->y0 == VD_UNITS) {
                winding = vd_wind(winding, piece->edge);
            } else {
                rows->keys[pieces++] = (vd_sort_key){piece->low, (uint32_t)i};
            }
        }
        vd_sort_keys(rows->keys, pieces);
        for (size_t i = 0; i < pieces; i++) {
            rows->sorted[i] = rows->pieces[rows->keys[i].index];
        }
        rows->span.y = band_y + row;
        draw_row(rows, rows->sorted, pieces, winding);
    }
}

/* ---- a band -----------------------------------------------------------------------------------
 */

/* Draws the edges of one shape, gathered. */
static void draw_gathered(vd_rows *rows, size_t count, int band) {
    const vd_coverage_run *run = rows->run;
    const uint32_t number = rows->gathered[0].shape;
    const vd_shape *shape = &run->coverage->shapes[number];
    rows->span.layer = run->first + number / 2;
    rows->span.stroke = number % 2 != 0;
    rows->rule = rows->span.stroke ? VD_FILL_RULE_NON_ZERO : run->layers[rows->span.layer].rule;
    const int top = band * VD_BAND_ROWS;
    const int left = run->height - top;
    if (shape->small) {
        draw_small(rows, shape, rows->gathered, count, run->y + top);
    } else {
        draw_shape(rows, rows->gathered, count, run->y + top,
                   left < VD_BAND_ROWS ? left : VD_BAND_ROWS);
    }
}

void vd_rows_band(const vd_coverage_run *run, int chunks, int band, int worker) {
    const vd_coverage *coverage = run->coverage;
    vd_rows *rows = coverage->workers[worker].rows;
    rows->run = run;
    rows->job = run->job;
    rows->span.worker = worker;
    for (int chunk = 0; chunk < chunks; chunk++) {
        const vd_edge_list *list = &coverage->lists[(size_t)chunk * (size_t)run->bands + band];
        const vd_edge_block *block = list->count > 0 ? &coverage->blocks[list->first] : NULL;
        size_t count = 0;
        for (uint32_t i = 0; i < list->count; i++) {
            if (i > 0 && i % VD_BLOCK_EDGES == 0) {
                block = &coverage->blocks[block->next];
            }
            const vd_edge *edge = &block->edges[i % VD_BLOCK_EDGES];
            if (count > 0 && edge->shape != rows->gathered[0].shape) {
                draw_gathered(rows, count, band);
                count = 0;
            }
            rows->gathered[count++] = *edge;
        }
        if (count > 0) {
            draw_gathered(rows, count, band);
        }
    }
}

/* ---- memory -----------------------------------------------------------------------------------
 */

static void release_rows(vd_context *context, vd_rows *rows) {
    if (rows == NULL) {
        return;
    }
    vd_release(context, rows->gathered);
    vd_release(context, rows->edges);
    vd_release(context, rows->pieces);
    vd_release(context, rows->sorted);
    vd_release(context, rows->keys);
    vd_release(context, rows->waiting);
    vd_release(context, rows->active);
    vd_release(context, rows->crossing);
    vd_release(context, rows->areas);
    vd_release(context, rows->small);
    vd_release(context, rows->coverage);
    vd_release(context, rows);
}

static vd_rows *make_rows(vd_context *context, size_t edges, size_t columns) {
    vd_rows *rows = vd_allocate_zero(context, 1, sizeof *rows);
    if (rows == NULL) {
        return NULL;
    }
    rows->capacity = edges;
    rows->columns = columns;
    rows->gathered = vd_allocate(context, edges, sizeof *rows->gathered);
    rows->edges = vd_allocate(context, edges, sizeof *rows->edges);
    rows->pieces = vd_allocate(context, edges, sizeof *rows->pieces);
    rows->sorted = vd_allocate(context, edges, sizeof *rows->sorted);
    rows->keys = vd_allocate(context, edges, sizeof *rows->keys);
    rows->waiting = vd_allocate(context, edges, sizeof *rows->waiting);
    rows->active = vd_allocate(context, edges, sizeof *rows->active);
    rows->crossing = vd_allocate(context, 4 * edges + 4, sizeof *rows->crossing);
    rows->areas = vd_allocate_zero(context, columns + 2, sizeof *rows->areas);
    rows->small = vd_allocate_zero(context, VD_BAND_ROWS * VD_SMALL_STRIDE, sizeof *rows->small);
    rows->coverage = vd_allocate(context, columns, sizeof *rows->coverage);
    if (rows->gathered == NULL || rows->edges == NULL || rows->pieces == NULL ||
        rows->sorted == NULL || rows->keys == NULL || rows->waiting == NULL ||
        rows->active == NULL || rows->crossing == NULL || rows->areas == NULL ||
        rows->small == NULL || rows->coverage == NULL) {
        release_rows(context, rows);
        return NULL;
    }
    return rows;
}

vd_status vd_rows_reserve(vd_coverage *coverage, size_t edges, size_t columns) {
    for (int i = 0; i < coverage->thread_count; i++) {
        vd_rows **rows = &coverage->workers[i].rows;
        const size_t had_edges = *rows != NULL ? (*rows)->capacity : 0;
        const size_t had_columns = *rows != NULL ? (*rows)->columns : VD_SMALL_STRIDE;
        if (*rows != NULL && edges <= had_edges && columns <= had_columns) {
            continue;
        }
        release_rows(coverage->context, *rows);
        *rows = make_rows(coverage->context, edges < had_edges ? had_edges : edges,
                          columns < had_columns ? had_columns : columns);
        if (*rows == NULL) {
            return vd_out_of_memory("a coverage rasterizer's rows",
                                    edges * 4 * sizeof(vd_piece) + columns * 6);
        }
    }
    return vd_success();
}

void vd_rows_release(vd_coverage *coverage) {
    for (int i = 0; coverage->workers != NULL && i < coverage->thread_count; i++) {
        release_rows(coverage->context, coverage->workers[i].rows);
        coverage->workers[i].rows = NULL;
    }
}

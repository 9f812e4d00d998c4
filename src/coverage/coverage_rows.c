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
 * A cluster of one piece, or of several that follow one another down the row, only steps from one
 * number to the next: it adds its signed area if that changes inside to outside. Any other goes
 * through coverage_slabs.c. So long rows cost nothing in
 * their middle, simple outlines nothing but a sort, and crossings cost where they are.
 *
 * Clusters whose columns of pixels touch make a group, and a group one span: its areas are summed
 * from left to right into coverage (Duff 1989). A convex shape of few columns needs no sort at all:
 * every winding number in it is 0 or 1, so its edges are added as they come, all rows at once.
 */
#include <stddef.h>
#include <string.h>
#include "core/core.h"
#include "coverage/coverage_rows.h"

/* ---- areas ------------------------------------------------------------------------------------
 */

/* One by one: gcc makes the two sums one of 8 bytes, whose load then waits for the stores of two
 * others that overlap it; the empty asm forbids it (by itself it gained nothing that was measured).
 */
static inline void add_pair(int32_t *areas, int32_t area, int32_t height, int32_t sign) {
    areas[0] += sign * area;
    __asm__("" : "+m"(areas[0]));
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

static inline void add_area(int32_t *areas, int64_t x0, int64_t x1, int32_t height, int32_t sign) {
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

void vd_add_area(int32_t *areas, int64_t x0, int64_t x1, int32_t height, int32_t sign) {
    add_area(areas, x0, x1, height, sign);
}

/* ---- spans ------------------------------------------------------------------------------------
 */

static void emit(vd_rows *rows, int x, int count, const uint16_t *coverage) {
    vd_span *span = &rows->span.span;
    span->x = rows->run->x + x;
    span->count = count;
    span->coverage = coverage;
    rows->run->function(rows->run->user, span);
}

/* ---- small convex shapes ----------------------------------------------------------------------
 */

/* Adds the side from a to b, as far as it lies in rows first … last − 1 of the shape. */
static void add_side(vd_rows *rows, const vd_corner *a, const vd_corner *b, int sign, int first,
                     int last) {
    if (b->y < a->y) {
        const vd_corner *other = a;
        a = b;
        b = other;
        sign = -sign;
    }
    int32_t y = a->y, end = last << VD_UNIT_BITS;
    end = b->y < end ? b->y : end;
    int row = y >> VD_UNIT_BITS;
    if (row < first) {
        row = first;
        y = first << VD_UNIT_BITS;
    }
    if (y >= end) {
        return;
    }
    const double slope = (double)(b->x - a->x) / (double)(b->y - a->y);
    int32_t x = a->x + (int32_t)vd_snap((y - a->y) * slope);
    int32_t *areas = rows->small + (row - first) * VD_SMALL_STRIDE;
    for (; y < end; areas += VD_SMALL_STRIDE) {
        int32_t stop = ++row << VD_UNIT_BITS;
        stop = end < stop ? end : stop;
        const int32_t next = a->x + (int32_t)vd_snap((stop - a->y) * slope);
        add_area(areas, x, next, stop - y, sign);
        x = next;
        y = stop;
    }
}

static void draw_small(vd_rows *rows, const vd_small *small, int band) {
    const vd_coverage_kernels *kernels = rows->run->coverage->kernels;
    const vd_corner *corners = small->corners;
    const int count = small->record.corner_count, width = small->record.width;
    const int top = band * VD_BAND_ROWS - small->row; /* of the band, from the shape's row */
    const int first = top < 0 ? 0 : top, end = small->height;
    const int last = end < top + VD_BAND_ROWS ? end : top + VD_BAND_ROWS;
    for (int i = 0; i < count; i++) {
        add_side(rows, &corners[i], &corners[i + 1 < count ? i + 1 : 0], small->record.sign, first,
                 last);
    }
    int32_t *areas = rows->small;
    rows->span.span.y = rows->run->y + small->row + first;
    for (int row = first; row < last; row++) {
        kernels->sum_areas(rows->coverage, areas, 0, (size_t)width);
        areas[width] = areas[width + 1] = 0;
        emit(rows, small->column, width, rows->coverage);
        areas += VD_SMALL_STRIDE;
        rows->span.span.y++;
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
    if (edge->record.kind & VD_EDGE_LEVEL) {
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

/* Adds pieces that follow one another down the row, each stepping from `left` to what is beyond. */
static void add_chain(vd_rows *rows, const vd_piece *pieces, size_t count, vd_winding_pair left,
                      int64_t column) {
    const int step =
        vd_is_inside(rows->rule, vd_wind(left, pieces[0].edge)) - vd_is_inside(rows->rule, left);
    const int64_t shift = column << VD_UNIT_BITS;
    for (size_t i = 0; i < count && step != 0; i++) {
        const vd_piece *p = &pieces[i];
        add_area(rows->areas, p->x0 - shift, p->x1 - shift, p->y1 - p->y0, step);
    }
}

/* Adds a group's clusters; returns the winding numbers to their right. */
static vd_winding_pair add_group(vd_rows *rows, const vd_piece *pieces, size_t count,
                                 vd_winding_pair left, int64_t column) {
    const int64_t limit = (int64_t)rows->run->width << VD_UNIT_BITS;
    for (size_t i = 0; i < count;) {
        const vd_record *first = &pieces[i].edge->record;
        int64_t high = pieces[i].high, heights = 0;
        bool alike = true;
        vd_winding_pair right = left;
        size_t end = i;
        for (; end < count && pieces[end].low <= high; end++) {
            const vd_piece *p = &pieces[end];
            high = high < p->high ? p->high : high;
            heights += p->y1 - p->y0;
            alike = alike && p->edge->record.sign == first->sign &&
                    ((p->edge->record.kind ^ first->kind) & VD_EDGE_SECOND) == 0;
            if (p->y0 == 0 && p->y1 > 0) {
                right = vd_wind(right, p->edge);
            }
        }
        /* All one way, and as high as the row: then there is one at every y, since the winding
         * numbers left and right do not depend on y. What the window cuts off on its right does. */
        if (end == i + 1 || (alike && heights == VD_UNITS && high < limit)) {
            add_chain(rows, pieces + i, end - i, left, column);
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
            if ((piece->edge->record.kind & VD_EDGE_LEFT) && piece->y1 - piece->y0 == VD_UNITS) {
                winding = vd_wind(winding, piece->edge);
            } else {
                rows->keys[pieces++] = (vd_sort_key){piece->low, (uint32_t)i};
            }
        }
        vd_sort_keys(rows->keys, pieces);
        for (size_t i = 0; i < pieces; i++) {
            rows->sorted[i] = rows->pieces[rows->keys[i].index];
        }
        rows->span.span.y = band_y + row;
        draw_row(rows, rows->sorted, pieces, winding);
    }
}

/* ---- a band -----------------------------------------------------------------------------------
 */

static void begin_shape(vd_rows *rows, uint32_t number, const uint16_t *color) {
    rows->span.span.layer = rows->run->first + number / 2;
    rows->span.span.stroke = number % 2 != 0;
    rows->span.color = color;
}

/* Draws the edges of one shape, gathered. */
static void draw_gathered(vd_rows *rows, size_t count, int band) {
    const int top = band * VD_BAND_ROWS, left = rows->run->height - top;
    if (count > 0) {
        const uint32_t number = rows->gathered[0].record.shape;
        const vd_shape *shape = &rows->run->coverage->shapes[number];
        begin_shape(rows, number, shape->color);
        rows->rule = (vd_fill_rule)shape->rule;
        draw_shape(rows, rows->gathered, count, rows->run->y + top,
                   left < VD_BAND_ROWS ? left : VD_BAND_ROWS);
    }
}

static uint32_t size_of(const vd_record *record) {
    return record->kind & VD_EDGE_SMALL
               ? (uint32_t)offsetof(vd_small, corners) + 8 * (uint32_t)record->corner_count
               : (uint32_t)sizeof(vd_edge);
}

/* Draws the records of a block; the first `count` edges of a shape are gathered already. Returns
 * how many are at its end. */
static size_t draw_block(vd_rows *rows, const vd_edge_block *block, uint32_t used, size_t count,
                         int band) {
    for (uint32_t at = 0; at < used;) {
        const vd_record *record = (const vd_record *)(const void *)&block->bytes[at / 8];
        if (count > 0 && record->shape != rows->gathered[0].record.shape) {
            draw_gathered(rows, count, band);
            count = 0;
        }
        if (record->kind & VD_EDGE_SMALL) {
            const vd_small *small = (const vd_small *)(const void *)record;
            begin_shape(rows, record->shape, small->color);
            draw_small(rows, small, band);
        } else {
            memcpy(&rows->gathered[count++], record, sizeof *rows->gathered);
        }
        at += size_of(record);
    }
    return count;
}

static void draw_list(vd_rows *rows, const vd_edge_list *list, int band) {
    const vd_edge_block *blocks = rows->run->coverage->blocks;
    size_t count = 0;
    for (uint32_t i = list->first; i != list->last; i = blocks[i].next) {
        count = draw_block(rows, &blocks[i], blocks[i].used, count, band);
    }
    count = draw_block(rows, &blocks[list->last], list->used, count, band);
    draw_gathered(rows, count, band);
}

void vd_rows_band(const vd_coverage_run *run, int chunks, int band, int worker) {
    vd_rows *rows = run->coverage->workers[worker].rows;
    rows->run = run;
    rows->job = run->job;
    rows->span.span.worker = worker;
    for (int chunk = 0; chunk < chunks; chunk++) {
        const vd_edge_list *list =
            &run->coverage->lists[(size_t)chunk * (size_t)run->bands + (size_t)band];
        if (list->used > 0) {
            draw_list(rows, list, band);
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

/* coverage_edges.c: segments become edges: pointing down, cut to the window and at bands.
 *
 * Nothing moves where an edge is cut: each part keeps the line of the whole and only the range of y
 * in which it holds, so that the parts meet exactly and a shape does not depend on the window. What
 * lies left of the window still winds around what is in it, and is put at x = 0; what lies right of
 * it, above or below concerns nobody.
 */
#include <stddef.h>
#include <string.h>
#include "coverage/coverage_internal.h"

#define BAND_UNITS ((double)VD_BAND_ROWS * VD_UNITS)

/* A place at the end of a band's list; null when the blocks are used up: they are counted all the
 * same, so that the next try has enough. */
static void *append(vd_tracer *t, int band, uint32_t bytes) {
    vd_coverage *coverage = t->coverage;
    vd_edge_list *list = &t->lists[band];
    const bool empty = list->used == 0;
    if (empty || list->used + bytes > VD_BLOCK_BYTES) {
        const uint32_t block =
            atomic_fetch_add_explicit(&coverage->block_count, 1, memory_order_relaxed);
        if (empty) {
            list->first = block;
        } else if (list->last < coverage->block_capacity) {
            coverage->blocks[list->last].next = block;
            coverage->blocks[list->last].used = list->used;
        }
        list->last = block;
        list->used = 0;
    }
    const uint32_t place = list->used;
    list->used += bytes;
    return list->last < coverage->block_capacity ? &coverage->blocks[list->last].bytes[place / 8]
                                                 : NULL;
}

/* Adds the part from top to bottom of a line, cut at the bands. */
static void put(vd_tracer *t, vd_edge edge, double top, double bottom) {
    const double y = edge.y;
    for (int band = (int)(top / BAND_UNITS); top < bottom; band++) {
        const double start = band * BAND_UNITS, end = start + BAND_UNITS;
        const double stop = bottom < end ? bottom : end;
        vd_edge *to = append(t, band, sizeof edge);
        t->lists[band].edges++;
        if (to != NULL) {
            edge.y = y - start;
            edge.top = (int32_t)(top - start);
            edge.bottom = (int32_t)(stop - start);
            *to = edge;
        }
        top = stop;
    }
}

void vd_trace_small(vd_tracer *t, const vd_small *small) {
    const int top = small->row, bottom = top + small->height - 1;
    const size_t bytes =
        offsetof(vd_small, corners) + (size_t)small->record.corner_count * sizeof small->corners[0];
    for (int band = top / VD_BAND_ROWS; band <= bottom / VD_BAND_ROWS; band++) {
        void *to = append(t, band, (uint32_t)bytes);
        if (to != NULL) {
            memcpy(to, small, bytes);
        }
    }
}

/* Adds a horizontal segment, which joins what it connects into one cluster (coverage_rows.c), if it
 * lies inside a row. */
static void put_level(vd_tracer *t, vd_edge edge, double y, double left, double right) {
    const double row = y / VD_UNITS;
    left = left < 0 ? 0 : left;
    right = right < t->width ? right : t->width;
    if (y <= 0 || y >= t->height || right <= left || row == (double)(int64_t)row) {
        return;
    }
    const int band = (int)(y / BAND_UNITS);
    vd_edge *to = append(t, band, sizeof edge);
    t->lists[band].edges++;
    if (to != NULL) {
        edge.x = left;
        edge.slope = right - left;
        edge.y = y - band * BAND_UNITS;
        edge.top = edge.bottom = (int32_t)edge.y;
        edge.record.kind |= VD_EDGE_LEVEL;
        *to = edge;
    }
}

/* Where the line is at x, between top and bottom. */
static double y_at(const vd_edge *edge, double x, double top, double bottom) {
    const double y = edge->y + vd_snap((x - edge->x) / edge->slope);
    return y < top ? top : y < bottom ? y : bottom;
}

static void put_left(vd_tracer *t, vd_edge edge, double top, double bottom) {
    edge.x = 0;
    edge.slope = 0;
    edge.record.kind |= VD_EDGE_LEFT;
    put(t, edge, top, bottom);
}

/* x at y, where the edge was cut; y is rounded, so a flat edge may be far from where it should be.
 */
static double x_at(const vd_edge *edge, double y) {
    return edge->x + vd_snap((y - edge->y) * edge->slope);
}

/* An edge through the left or right side of the window, or both. What rounding left open between
 * the side and the edge is closed by a level, so that clusters see an outline without gaps. */
static void put_crossing(vd_tracer *t, vd_edge edge, double top, double bottom, bool left,
                         bool right) {
    const bool down = edge.slope > 0; /* the left end is the upper one */
    double enter = down ? top : bottom, leave = down ? bottom : top;
    if (left) {
        enter = y_at(&edge, 0, top, bottom);
        put_level(t, edge, enter, 0, x_at(&edge, enter));
    }
    if (right) {
        leave = y_at(&edge, t->width, top, bottom);
        put_level(t, edge, leave, x_at(&edge, leave), t->width);
    }
    if (down) {
        put_left(t, edge, top, enter);
        put(t, edge, enter, leave);
    } else {
        put(t, edge, leave, enter);
        put_left(t, edge, enter, bottom);
    }
}

void vd_trace_segment(vd_tracer *t, double x0, double y0, double x1, double y1) {
    if (t->segments != NULL) {
        vd_points *segments = t->kind & VD_EDGE_SECOND ? t->second : t->segments;
        if (vd_trace_push(t, segments, x0, y0)) {
            (void)vd_trace_push(t, segments, x1, y1);
        }
        return;
    }
    vd_edge edge = {.record = {.shape = t->shape, .sign = 1, .kind = t->kind}, .x = x0, .y = y0};
    double x_end = x1, y_end = y1;
    if (y1 < y0) {
        edge.x = x1;
        edge.y = y1;
        edge.record.sign = -1;
        x_end = x0;
        y_end = y0;
    }
    const double left = x0 < x1 ? x0 : x1, right = x0 < x1 ? x1 : x0;
    if (y_end <= 0 || edge.y >= t->height || left >= t->width) {
        return;
    }
    if (y0 == y1) {
        put_level(t, edge, y0, left, right);
        return;
    }
    edge.slope = (x_end - edge.x) / (y_end - edge.y);
    const double top = edge.y < 0 ? 0 : edge.y, bottom = y_end < t->height ? y_end : t->height;
    if (right <= 0) {
        put_left(t, edge, top, bottom);
    } else if (left >= 0 && right <= t->width) {
        put(t, edge, top, bottom);
    } else {
        put_crossing(t, edge, top, bottom, left<0, right> t->width);
    }
}

/* coverage_reference.c: every shape clipped to every pixel, in double, nothing rounded until the
 * end.
 *
 * The outline is cut to the pixel's rows and pushed to its left and right sides where it lies
 * beyond them, so that it winds around what it wound around. The pixel is then cut into strips at
 * every y where a line begins, ends or crosses another; in a strip lines are one behind the other,
 * and what is inside between two of them is a trapezoid.
 */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "coverage/coverage_internal.h"

/* A line within the pixel's square, 0 … 1, going down. */
typedef struct line {
    double x0, y0, x1, y1;
    int sign;
    bool second; /* counts for the expansion's winding number */
} line;

typedef struct clipper {
    vd_tracer tracer;
    vd_coverage_worker worker;
    vd_points first, second; /* segments of the fill or stroke, and of the expansion */
    line *lines;             /* of a pixel; three for every segment, at most */
    size_t line_count;
    double *cuts;
    size_t cut_count, cut_capacity;
    double *middles; /* x of each line at a strip's middle, or NaN */
    vd_fill_rule rule;
} clipper;

static int compare_doubles(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static void add_line(clipper *c, double x0, double y0, double x1, double y1, bool second) {
    if (y0 != y1) {
        c->lines[c->line_count++] =
            y0 < y1 ? (line){x0, y0, x1, y1, 1, second} : (line){x1, y1, x0, y0, -1, second};
    }
}

static double clamp(double v) {
    return v < 0 ? 0 : v < 1 ? v : 1;
}

/* Cuts a segment, relative to the pixel, to y in 0 … 1, and at x = 0 and x = 1. */
static void clip_segment(clipper *c, const double a[2], const double b[2], bool second) {
    const double dx = b[0] - a[0], dy = b[1] - a[1];
    double at[4] = {0, 1, 0, 1};
    if (dy == 0) {
        return;
    }
    const double t0 = (0 - a[1]) / dy, t1 = (1 - a[1]) / dy;
    at[0] = clamp(t0 < t1 ? t0 : t1);
    at[1] = clamp(t0 < t1 ? t1 : t0);
    at[2] = dx == 0 ? at[0] : (0 - a[0]) / dx;
    at[3] = dx == 0 ? at[0] : (1 - a[0]) / dx;
    const double first = at[0], last = at[1];
    at[2] = at[2] < first ? first : at[2] < last ? at[2] : last;
    at[3] = at[3] < first ? first : at[3] < last ? at[3] : last;
    qsort(at, 4, sizeof at[0], compare_doubles);
    for (int i = 0; i < 3; i++) {
        add_line(c, clamp(a[0] + at[i] * dx), clamp(a[1] + at[i] * dy),
                 clamp(a[0] + at[i + 1] * dx), clamp(a[1] + at[i + 1] * dy), second);
    }
}

static double x_at(const line *l, double y) {
    return l->x0 + (y - l->y0) * ((l->x1 - l->x0) / (l->y1 - l->y0));
}

static vd_status add_cut(clipper *c, vd_context *context, double y) {
    if (c->cut_count == c->cut_capacity) {
        const size_t capacity = 2 * c->cut_capacity + 64;
        double *cuts = vd_allocate(context, capacity, sizeof *cuts);
        if (cuts == NULL) {
            return vd_out_of_memory("the cuts of a pixel", capacity * sizeof *cuts);
        }
        if (c->cut_count > 0) {
            memcpy(cuts, c->cuts, c->cut_count * sizeof *cuts);
        }
        vd_release(context, c->cuts);
        c->cuts = cuts;
        c->cut_capacity = capacity;
    }
    c->cuts[c->cut_count++] = y;
    return vd_success();
}

/* All y where the order of the lines may change. */
static vd_status find_cuts(clipper *c, vd_context *context) {
    c->cut_count = 0;
    vd_status status = vd_success();
    for (size_t i = 0; i < c->line_count && status.code == VD_OK; i++) {
        const line *a = &c->lines[i];
        status = add_cut(c, context, a->y0);
        if (status.code == VD_OK) {
            status = add_cut(c, context, a->y1);
        }
        for (size_t j = 0; j < i && status.code == VD_OK; j++) {
            const line *b = &c->lines[j];
            const double top = a->y0 < b->y0 ? b->y0 : a->y0;
            const double bottom = a->y1 < b->y1 ? a->y1 : b->y1;
            const double above = x_at(a, top) - x_at(b, top);
            const double below = x_at(a, bottom) - x_at(b, bottom);
            if (top < bottom && ((above < 0 && below > 0) || (above > 0 && below < 0))) {
                status = add_cut(c, context, top + (bottom - top) * (above / (above - below)));
            }
        }
    }
    if (c->cut_count > 0) {
        qsort(c->cuts, c->cut_count, sizeof *c->cuts, compare_doubles);
    }
    return status;
}

/* The length of a strip's middle line that lies inside. */
static double measure_middle(const clipper *c, double y) {
    double inside = 0, x = 0;
    int a = 0, b = 0;
    for (size_t i = 0; i < c->line_count; i++) {
        const line *l = &c->lines[i];
        c->middles[i] = l->y0 <= y && y < l->y1 ? x_at(l, y) : NAN;
    }
    for (;;) { /* selection sort: from left to right */
        size_t next = c->line_count;
        for (size_t i = 0; i < c->line_count; i++) {
            if (c->middles[i] == c->middles[i] &&
                (next == c->line_count || c->middles[i] < c->middles[next])) {
                next = i;
            }
        }
        const double end = next < c->line_count ? c->middles[next] : 1;
        if ((c->rule == VD_FILL_RULE_EVEN_ODD ? a % 2 != 0 : a != 0) || b != 0) {
            inside += end - x;
        }
        if (next == c->line_count) {
            return inside;
        }
        x = end;
        *(c->lines[next].second ? &b : &a) += c->lines[next].sign;
        c->middles[next] = NAN;
    }
}

static vd_status measure_pixel(clipper *c, vd_context *context, int column, int row, double *area) {
    const vd_points *sets[2] = {&c->first, &c->second};
    c->line_count = 0;
    for (int s = 0; s < 2; s++) {
        for (size_t i = 0; i + 1 < sets[s]->count; i += 2) {
            double ends[2][2];
            for (int k = 0; k < 2; k++) {
                ends[k][0] = sets[s]->at[i + (size_t)k][0] / VD_UNITS - column;
                ends[k][1] = sets[s]->at[i + (size_t)k][1] / VD_UNITS - row;
            }
            clip_segment(c, ends[0], ends[1], s == 1);
        }
    }
    *area = 0;
    vd_status status = find_cuts(c, context);
    for (size_t i = 0; i + 1 < c->cut_count && status.code == VD_OK; i++) {
        const double top = c->cuts[i], bottom = c->cuts[i + 1];
        *area += (bottom - top) * measure_middle(c, 0.5 * (top + bottom));
    }
    return status;
}

/* Pixels from *first to *last − 1 of `size` that segments touch along one axis. */
static void find_range(const clipper *c, int axis, int size, int *first, int *last) {
    const vd_points *sets[2] = {&c->first, &c->second};
    double low = 0x1p60, high = -0x1p60;
    for (int s = 0; s < 2; s++) {
        for (size_t i = 0; i < sets[s]->count; i++) {
            const double v = sets[s]->at[i][axis] / VD_UNITS;
            low = v < low ? v : low;
            high = high < v ? v : high;
        }
    }
    *first = low < 0 ? 0 : low < size ? (int)low : size;
    *last = high < 0 ? 0 : high < size ? (int)high + 1 : size;
}

static vd_status draw_shape(clipper *c, vd_coverage_run *run, size_t layer, bool stroke) {
    vd_context *context = run->coverage->context;
    vd_shape shape;
    c->first.count = c->second.count = 0;
    c->rule = stroke ? VD_FILL_RULE_NON_ZERO : run->layers[layer].rule;
    c->tracer.segments = &c->first;
    c->tracer.second = &c->second;
    vd_trace_layer(&c->tracer, &run->layers[layer], stroke, &shape);
    const size_t segments = (c->first.count + c->second.count) / 2;
    vd_release(context, c->lines);
    vd_release(context, c->middles);
    c->lines = vd_allocate(context, 3 * segments, sizeof *c->lines);
    c->middles = vd_allocate(context, 3 * segments, sizeof *c->middles);
    if (c->tracer.out_of_memory || c->lines == NULL || c->middles == NULL) {
        return vd_out_of_memory("the segments of a path", segments * sizeof(line) * 3);
    }
    int x0, x1, y0, y1;
    find_range(c, 0, run->width, &x0, &x1);
    find_range(c, 1, run->height, &y0, &y1);
    for (int y = y0; y < y1; y++) {
        for (int x = x0; x < x1; x++) {
            double area;
            vd_status status = measure_pixel(c, context, x, y, &area);
            if (status.code != VD_OK) {
                return status;
            }
            if (vd_job_stopped(run->job)) {
                return vd_failure(VD_ERROR_CANCELLED, "drawing paths was cancelled");
            }
            const uint16_t coverage = (uint16_t)(clamp(area) * 65535 + 0.5);
            const vd_colored_span colored = {.span = {.x = run->x + x,
                                                      .y = run->y + y,
                                                      .count = 1,
                                                      .coverage = &coverage,
                                                      .layer = layer,
                                                      .stroke = stroke},
                                             .color = shape.color};
            run->function(run->user, &colored.span);
        }
    }
    return vd_success();
}

vd_status vd_coverage_reference(vd_coverage_run *run) {
    vd_context *context = run->coverage->context;
    clipper c;
    memset(&c, 0, sizeof c);
    vd_tracer_init(&c.tracer, run, &c.worker);
    vd_status status = vd_success();
    for (size_t i = 0; i < run->count && status.code == VD_OK; i++) {
        if (run->layers[i].filled) {
            status = draw_shape(&c, run, i, false);
        }
        if (run->layers[i].stroke != NULL && status.code == VD_OK) {
            status = draw_shape(&c, run, i, true);
        }
    }
    vd_release(context, c.worker.line.at);
    vd_release(context, c.worker.dash.at);
    vd_release(context, c.first.at);
    vd_release(context, c.second.at);
    vd_release(context, c.lines);
    vd_release(context, c.cuts);
    vd_release(context, c.middles);
    return status;
}

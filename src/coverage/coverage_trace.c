/* coverage_trace.c: from paths to segments: transform, flatten curves, close, hand over to strokes.
 *
 * A curve of degree 2 or 3 cut at n equal steps of its parameter stays within M / (8 n²) of its
 * chords, M the most of its second derivative (de Boor 1978): 2 |p0 − 2 p1 + p2|, or 6 times the
 * larger such difference of a cubic. n follows from the tolerance. Cutting in halves by flatness
 * (de Casteljau) makes fewer lines of curves whose bend varies, but no fewer of glyphs' and arcs'.
 */
#include <math.h>
#include <string.h>
#include "coverage/coverage_internal.h"

#define MOST_LINES 4096

bool vd_trace_push(vd_tracer *t, vd_points *points, double x, double y) {
    if (points->count == points->capacity) {
        const size_t capacity = points->capacity < 64 ? 64 : 2 * points->capacity;
        double(*at)[2] = vd_allocate(t->coverage->context, capacity, sizeof *at);
        if (at == NULL) {
            t->out_of_memory = true;
            return false;
        }
        for (size_t i = 0; i < points->count; i++) {
            at[i][0] = points->at[i][0];
            at[i][1] = points->at[i][1];
        }
        vd_release(t->coverage->context, points->at);
        points->at = at;
        points->capacity = capacity;
    }
    points->at[points->count][0] = x;
    points->at[points->count][1] = y;
    points->count++;
    return true;
}

/* ---- one path ---------------------------------------------------------------------------------
 */

/* Where tracing a path stands. */
typedef struct pen {
    vd_tracer *tracer;
    const vd_layer *layer;
    const vd_stroke *stroke; /* null: lines go to the segments at once */
    double x, y;             /* the current point */
    double start_x, start_y; /* of the subpath */
    bool closing;            /* close every subpath, as a fill does */
    bool drawn;              /* the subpath has a line, perhaps of no length */
} pen;

/* A point in units from the window's corner. */
static void place(const vd_tracer *t, const vd_affine *m, const double p[2], double out[2]) {
    out[0] = vd_trace_round(t, (m->xx * p[0] + m->xy * p[1] + m->x0 - t->x) * VD_UNITS);
    out[1] = vd_trace_round(t, (m->yx * p[0] + m->yy * p[1] + m->y0 - t->y) * VD_UNITS);
}

static void line_to(pen *p, double x, double y) {
    if (p->stroke == NULL) {
        vd_trace_segment(p->tracer, p->x, p->y, x, y);
    } else {
        vd_points *line = &p->tracer->worker->line;
        if (!p->drawn) {
            line->count = 0;
            (void)vd_trace_push(p->tracer, line, p->x, p->y);
        }
        if (x != p->x || y != p->y) {
            (void)vd_trace_push(p->tracer, line, x, y);
        }
    }
    p->drawn = true;
    p->x = x;
    p->y = y;
}

/* Ends a subpath: a fill closes it by itself. */
static void end_subpath(pen *p, bool close) {
    if (p->stroke == NULL) {
        if (p->x != p->start_x || p->y != p->start_y) {
            vd_trace_segment(p->tracer, p->x, p->y, p->start_x, p->start_y);
        }
    } else if (p->drawn && !p->tracer->out_of_memory) {
        vd_points *line = &p->tracer->worker->line;
        if (p->closing && !close) {
            line_to(p, p->start_x, p->start_y);
            close = true;
        }
        if (close && line->count > 1 && p->x == p->start_x && p->y == p->start_y) {
            line->count--;
        }
        const double(*at)[2] = (const double(*)[2])line->at;
        if (p->stroke->dash_count > 0) {
            vd_trace_dashes(p->tracer, p->stroke, at, line->count, close);
        } else {
            vd_trace_stroke(p->tracer, p->stroke, at, line->count, close);
        }
    }
    p->drawn = false;
    p->x = p->start_x;
    p->y = p->start_y;
}

static void move_to(pen *p, double x, double y) {
    p->x = p->start_x = x;
    p->y = p->start_y = y;
    p->drawn = false;
}

/* ---- curves -----------------------------------------------------------------------------------
 */

/* Whether nothing of a curve within its control points can be seen. */
static bool is_outside(const pen *p, const double (*c)[2], int count) {
    const vd_tracer *t = p->tracer;
    double min_x = p->x, max_x = p->x, min_y = p->y, max_y = p->y;
    for (int i = 0; i < count; i++) {
        min_x = c[i][0] < min_x ? c[i][0] : min_x;
        max_x = max_x < c[i][0] ? c[i][0] : max_x;
        min_y = c[i][1] < min_y ? c[i][1] : min_y;
        max_y = max_y < c[i][1] ? c[i][1] : max_y;
    }
    return t->segments == NULL && (max_x < -t->margin || min_x > t->width + t->margin ||
                                   max_y < -t->margin || min_y > t->height + t->margin);
}

/* The number of lines for a curve whose second derivative is at most `bend`, [0] and [1] its parts
 * in x and y. */
static int count_lines(const vd_tracer *t, double bend_x, double bend_y) {
    const double n = sqrt(sqrt(bend_x * bend_x + bend_y * bend_y) / (8 * t->tolerance));
    return n < MOST_LINES ? (int)n + 1 : MOST_LINES;
}

/* From differences to the first point, so that a moved curve is the same curve. */
static void curve_to(pen *p, const double (*c)[2], int degree) {
    const vd_tracer *t = p->tracer;
    const double x0 = p->x, y0 = p->y;
    double d[3][2];
    for (int i = 0; i < degree; i++) {
        d[i][0] = c[i][0] - x0;
        d[i][1] = c[i][1] - y0;
    }
    int lines = 1;
    if (!is_outside(p, c, degree)) {
        double bend[2];
        for (int k = 0; k < 2; k++) {
            const double first = fabs(d[1][k] - 2 * d[0][k]);
            const double second = degree == 3 ? fabs(d[2][k] - 2 * d[1][k] + d[0][k]) : 0;
            bend[k] = degree == 2 ? 2 * first : 6 * (first < second ? second : first);
        }
        lines = count_lines(t, bend[0], bend[1]);
    }
    for (int i = 1; i < lines; i++) {
        const double v = (double)i / lines, u = 1 - v;
        double at[2];
        for (int k = 0; k < 2; k++) {
            at[k] = degree == 2
                        ? 2 * u * v * d[0][k] + v * v * d[1][k]
                        : 3 * u * u * v * d[0][k] + 3 * u * v * v * d[1][k] + v * v * v * d[2][k];
        }
        line_to(p, x0 + vd_trace_round(t, at[0]), y0 + vd_trace_round(t, at[1]));
    }
    line_to(p, c[degree - 1][0], c[degree - 1][1]);
}

/* ---- whole paths ------------------------------------------------------------------------------
 */

static void trace_verbs(pen *p) {
    const vd_path *path = &p->layer->path;
    const double(*from)[2] = path->points;
    for (size_t i = 0; i < path->verb_count; i++) {
        static const int counts[VD_PATH_VERB_COUNT] = {1, 1, 2, 3, 0};
        const int verb = path->verbs[i];
        double c[3][2];
        for (int k = 0; k < counts[verb]; k++) {
            place(p->tracer, &p->layer->picture_from_path, *from++, c[k]);
        }
        if (verb == VD_PATH_MOVE) {
            if (i > 0) {
                end_subpath(p, false);
            }
            move_to(p, c[0][0], c[0][1]);
        } else if (verb == VD_PATH_LINE) {
            line_to(p, c[0][0], c[0][1]);
        } else if (verb == VD_PATH_CLOSE) {
            line_to(p, p->start_x, p->start_y);
            end_subpath(p, true);
        } else {
            curve_to(p, (const double(*)[2])c, verb == VD_PATH_QUADRATIC ? 2 : 3);
        }
    }
    end_subpath(p, false);
}

static void trace_polygon(pen *p) {
    const vd_path *path = &p->layer->path;
    for (size_t i = 0; i < path->point_count; i++) {
        double c[2];
        place(p->tracer, &p->layer->picture_from_path, path->points[i], c);
        if (i == 0) {
            move_to(p, c[0], c[1]);
        } else {
            line_to(p, c[0], c[1]);
        }
    }
    if (!path->open && p->drawn) {
        line_to(p, p->start_x, p->start_y);
    }
    end_subpath(p, !path->open);
}

static void trace_path(vd_tracer *t, const vd_layer *layer, const vd_stroke *stroke, bool closing) {
    pen p = {.tracer = t, .layer = layer, .stroke = stroke, .closing = closing};
    if (layer->path.verbs != NULL) {
        trace_verbs(&p);
    } else if (layer->path.point_count > 0) {
        trace_polygon(&p);
    }
}

/* ---- small convex polygons --------------------------------------------------------------------
 */

/* +1 (clockwise as seen) or −1: convex, and going around that way; 0: neither. All turns go one
 * way, and y goes up once and down once: more than one time around would take more. */
static int find_orientation(const double (*p)[2], int count) {
    int orientation = 0, changes = 0, last = 0, first = 0;
    for (int i = 0; i < count; i++) {
        const double *a = p[i], *b = p[i + 1 < count ? i + 1 : 0];
        const double *c = p[i + 2 < count ? i + 2 : i + 2 - count];
        const double ux = b[0] - a[0], uy = b[1] - a[1], vx = c[0] - b[0], vy = c[1] - b[1];
        const double turn = ux * vy - uy * vx;
        const int sign = (turn > 0) - (turn < 0), way = (uy > 0) - (uy < 0);
        if ((ux == 0 && uy == 0) || (sign == 0 ? ux * vx + uy * vy < 0 : sign == -orientation)) {
            return 0;
        }
        orientation = sign != 0 ? sign : orientation;
        changes += way != 0 && last != 0 && way != last;
        first = first == 0 ? way : first;
        last = way != 0 ? way : last;
    }
    return changes + (first != last) <= 2 ? orientation : 0;
}

/* Adds a polygon that is small; false when it is not. */
static bool trace_small(vd_tracer *t, const vd_layer *layer) {
    double p[VD_SMALL_CORNERS][2];
    const int count = (int)layer->path.point_count;
    double min_x = 0x1p60, max_x = -0x1p60, min_y = 0x1p60, max_y = -0x1p60;
    for (int i = 0; i < count; i++) {
        place(t, &layer->picture_from_path, layer->path.points[i], p[i]);
        min_x = p[i][0] < min_x ? p[i][0] : min_x;
        max_x = max_x < p[i][0] ? p[i][0] : max_x;
        min_y = p[i][1] < min_y ? p[i][1] : min_y;
        max_y = max_y < p[i][1] ? p[i][1] : max_y;
    }
    if (max_x <= 0 || max_y <= 0 || min_x >= t->width || min_y >= t->height) {
        return true;
    }
    const double most = VD_SMALL_PIXELS * (double)VD_UNITS - VD_UNITS;
    if (min_x < 0 || min_y < 0 || max_x > t->width || max_y > t->height || max_x - min_x > most ||
        max_y - min_y > most) {
        return false;
    }
    const int orientation = find_orientation((const double(*)[2])p, count);
    if (orientation == 0) {
        return false;
    }
    vd_small small; /* only as much as there is of it */
    small.record = (vd_record){.shape = t->shape,
                               .kind = VD_EDGE_SMALL,
                               .sign = (int8_t)-orientation,
                               .corner_count = (uint8_t)count};
    small.unused = 0;
    const int column = (int)(min_x / VD_UNITS), row = (int)(min_y / VD_UNITS);
    small.column = (uint16_t)column;
    small.row = (uint16_t)row;
    small.record.width = (uint8_t)((int)((max_x + (VD_UNITS - 1)) / VD_UNITS) - column);
    small.height = (uint16_t)((int)((max_y + (VD_UNITS - 1)) / VD_UNITS) - row);
    memcpy(small.color, layer->fill, sizeof small.color);
    for (int i = 0; i < count; i++) {
        small.corners[i].x = (int32_t)(p[i][0] - column * (double)VD_UNITS);
        small.corners[i].y = (int32_t)(p[i][1] - row * (double)VD_UNITS);
    }
    vd_trace_small(t, &small);
    return true;
}

void vd_trace_layer(vd_tracer *t, const vd_layer *layer, bool stroke, vd_shape *shape) {
    memcpy(shape->color, stroke ? layer->stroke->color : layer->fill, sizeof shape->color);
    shape->rule = (uint8_t)(stroke ? VD_FILL_RULE_NON_ZERO : layer->rule);
    t->kind = 0;
    t->margin = 0;
    if (stroke) {
        t->margin = vd_stroke_margin(layer->stroke) * VD_UNITS;
        trace_path(t, layer, layer->stroke, false);
        return;
    }
    const bool grown = layer->expand > 0;
    if (t->segments == NULL && !grown && layer->path.verbs == NULL &&
        layer->path.point_count <= VD_SMALL_CORNERS && trace_small(t, layer)) {
        return;
    }
    trace_path(t, layer, NULL, false);
    if (grown) {
        /* The union with a stroke of its outline, which has a winding number of its own: the rule
         * of the fill does not apply to it. */
        vd_stroke outline = vd_stroke_default();
        outline.width = 2 * layer->expand;
        t->margin = vd_stroke_margin(&outline) * VD_UNITS;
        t->kind = VD_EDGE_SECOND;
        trace_path(t, layer, &outline, true);
    }
}

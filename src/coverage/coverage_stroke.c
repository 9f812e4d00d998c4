/* coverage_stroke.c: from lines to the outlines of their strokes.
 *
 * A stroke is the union of a rectangle for each segment, a wedge at the outer side of each turn,
 * and caps. The outline walks along one side and back along the other:
 *
 *      p+n ───────────► a                 a ── corner          outer side of a turn: the join
 *       ▲                 ╲ join          p ── the turn
 *       │       p0 ─ ─ ─ ─ p              inner side: from the end of one side to p and on to the
 *       │                 ╱ ╲             start of the next (Skia's pivot)
 *      p−n ◄─────────── b    …
 *
 * Since the inner side goes through p, the outline is the sum of the rectangles' and wedges' own
 * outlines, all of one orientation: windings never cancel, and the non-zero rule gives the union
 * exactly, however short the segments and sharp the turns. Joining the inner sides where they cross
 * is shorter by two lines a turn, and wrong where a segment is shorter than the line is wide.
 */
#include <math.h>
#include "core/real.h"
#include "coverage/coverage_internal.h"

typedef struct pen {
    vd_tracer *tracer;
    const vd_stroke *stroke;
    double radius; /* units */
    double step;   /* radians between points of an arc */
} pen;

typedef struct vector {
    double x, y;
} vector;

static void line(const pen *p, vector a, vector b) {
    vd_trace_segment(p->tracer, a.x, a.y, b.x, b.y);
}

static vector offset(const pen *p, vector at, vector by) {
    return (vector){at.x + vd_trace_round(p->tracer, by.x), at.y + vd_trace_round(p->tracer, by.y)};
}

/* The stroke's side of the segment from a to b: a quarter turn from its direction, radius long. */
static vector side_of(const pen *p, vector a, vector b) {
    const double dx = b.x - a.x, dy = b.y - a.y;
    const double scale = p->radius / sqrt(dx * dx + dy * dy);
    return (vector){-dy * scale, dx * scale};
}

static vector minus(vector a) {
    return (vector){-a.x, -a.y};
}

/* The arc about `at` from `a` to `b` (both from the centre), against the quarter turn of side_of.
 */
static void arc(const pen *p, vector at, vector a, vector b, double angle) {
    const int steps = (int)(angle / p->step) + 1;
    const double c = vd_cos(angle / steps), s = vd_sin(angle / steps);
    vector last = offset(p, at, a), spoke = a;
    for (int i = 1; i < steps; i++) {
        spoke = (vector){c * spoke.x + s * spoke.y, c * spoke.y - s * spoke.x};
        const vector next = offset(p, at, spoke);
        line(p, last, next);
        last = next;
    }
    line(p, last, offset(p, at, b));
}

/* The outer side of a turn, from `a` to `b` (both from the corner). */
static void join(const pen *p, vector at, vector a, vector b) {
    const double r2 = p->radius * p->radius;
    const double cosine = (a.x * b.x + a.y * b.y) / r2;
    const vector from = offset(p, at, a), to = offset(p, at, b);
    if (p->stroke->join == VD_JOIN_ROUND) {
        arc(p, at, a, b, fabs(vd_atan2((a.x * b.y - a.y * b.x) / r2, cosine)));
        return;
    }
    const double limit = p->stroke->miter_limit == 0 ? 4 : p->stroke->miter_limit;
    /* The miter is sqrt(2 / (1 + cos)) widths long. */
    if (p->stroke->join == VD_JOIN_MITER && 2 <= limit * limit * (1 + cosine)) {
        const double scale = 1 / (1 + cosine);
        const vector tip = offset(p, at, (vector){(a.x + b.x) * scale, (a.y + b.y) * scale});
        line(p, from, tip);
        line(p, tip, to);
    } else {
        line(p, from, to);
    }
}

/* Both sides of a turn between segments with sides a and b. */
static void turn(const pen *p, vector at, vector a, vector b) {
    const vector left_in = offset(p, at, a), left_out = offset(p, at, b);
    const vector right_in = offset(p, at, minus(a)), right_out = offset(p, at, minus(b));
    if (a.x * b.y - a.y * b.x > 0) { /* towards this side */
        line(p, left_in, at);
        line(p, at, left_out);
        join(p, at, minus(b), minus(a));
    } else {
        join(p, at, a, b);
        line(p, right_out, at);
        line(p, at, right_in);
    }
}

/* From at + side around the end of a line to at − side. */
static void cap(const pen *p, vector at, vector side) {
    const vector along = {side.y, -side.x}; /* outwards */
    const vector from = offset(p, at, side), to = offset(p, at, minus(side));
    if (p->stroke->cap == VD_CAP_ROUND) {
        arc(p, at, side, minus(side), VD_PI);
    } else if (p->stroke->cap == VD_CAP_SQUARE) {
        const vector a = offset(p, at, (vector){side.x + along.x, side.y + along.y});
        const vector b = offset(p, at, (vector){along.x - side.x, along.y - side.y});
        line(p, from, a);
        line(p, a, b);
        line(p, b, to);
    } else {
        line(p, from, to);
    }
}

void vd_trace_stroke(vd_tracer *t, const vd_stroke *stroke, const double (*points)[2], size_t count,
                     bool closed) {
    pen p = {.tracer = t, .stroke = stroke, .radius = stroke->width * (VD_UNITS / 2)};
    p.step = sqrt(8 * t->tolerance / p.radius); /* rises r step² / 8 above its chord */
    p.step = p.step < 0.5 * VD_PI ? p.step : 0.5 * VD_PI;
#define AT(i) ((vector){points[i][0], points[i][1]})
    if (count == 1) {
        if (stroke->cap != VD_CAP_BUTT) {
            cap(&p, AT(0), (vector){0, p.radius});
            cap(&p, AT(0), (vector){0, -p.radius});
        }
        return;
    }
    const size_t segments = closed ? count : count - 1; /* count > 1 */
    const vector first = side_of(&p, AT(0), AT(1));
    vector side = first;
    for (size_t i = 0; i < segments; i++) {
        const size_t end = i + 1 < count ? i + 1 : 0;
        const vector a = AT(i), b = AT(end);
        line(&p, offset(&p, a, side), offset(&p, b, side));
        line(&p, offset(&p, b, minus(side)), offset(&p, a, minus(side)));
        if (i + 1 < segments) {
            const size_t after = end + 1 < count ? end + 1 : 0;
            const vector next = side_of(&p, b, AT(after));
            turn(&p, b, side, next);
            side = next;
        }
    }
    if (closed) {
        turn(&p, AT(0), side, first);
    } else {
        cap(&p, AT(count - 1), side);
        cap(&p, AT(0), minus(first));
    }
#undef AT
}

/* ---- dashes -----------------------------------------------------------------------------------
 */

/* Where along the dashes one is. */
typedef struct phase {
    int index;     /* of dashes[] */
    double remain; /* of that one, units */
} phase;

static phase find_phase(const vd_stroke *stroke, double total, double length) {
    phase at = {0, 0};
    length -= floor(length / total) * total;
    while (at.index + 1 < stroke->dash_count && length >= stroke->dashes[at.index] * VD_UNITS) {
        length -= stroke->dashes[at.index++] * VD_UNITS;
    }
    at.remain = stroke->dashes[at.index] * VD_UNITS - length;
    return at;
}

/* The part of a segment that may be seen, from *enter to *leave of its length; false: none. */
static bool clip_segment(const vd_tracer *t, vector a, vector d, double *enter, double *leave) {
    const double from[2] = {a.x, a.y}, by[2] = {d.x, d.y}, size[2] = {t->width, t->height};
    *enter = 0;
    *leave = 1;
    for (int k = 0; k < 2; k++) {
        const double low = -t->margin - from[k], high = size[k] + t->margin - from[k];
        if (by[k] == 0) {
            if (low > 0 || high < 0) {
                return false;
            }
            continue;
        }
        const double at_low = low / by[k], at_high = high / by[k];
        const double first = at_low < at_high ? at_low : at_high;
        const double last = at_low < at_high ? at_high : at_low;
        *enter = *enter < first ? first : *enter;
        *leave = last < *leave ? last : *leave;
    }
    return *enter < *leave;
}

static void flush(vd_tracer *t, const vd_stroke *stroke) {
    vd_points *dash = &t->worker->dash;
    if (dash->count > 0 && !t->out_of_memory) {
        vd_trace_stroke(t, stroke, (const double(*)[2])dash->at, dash->count, false);
    }
    dash->count = 0;
}

/* Adds a point to the dash that is being drawn, unless it is the last one again. */
static void extend(vd_tracer *t, double x, double y) {
    vd_points *dash = &t->worker->dash;
    if (dash->count == 0 || dash->at[dash->count - 1][0] != x ||
        dash->at[dash->count - 1][1] != y) {
        (void)vd_trace_push(t, dash, x, y);
    }
}

/* Adds the point at part `along` of a segment; at its end exactly the end, which the next segment
 * begins with. */
static void extend_to(vd_tracer *t, vector a, vector b, double along) {
    if (along < 1) {
        extend(t, a.x + vd_trace_round(t, (b.x - a.x) * along),
               a.y + vd_trace_round(t, (b.y - a.y) * along));
    } else {
        extend(t, b.x, b.y);
    }
}

/* One segment, `start` units along the line. */
static void dash_segment(vd_tracer *t, const vd_stroke *stroke, double total, vector a, vector b,
                         double start) {
    const vector d = {b.x - a.x, b.y - a.y};
    const double length = sqrt(d.x * d.x + d.y * d.y);
    double enter = 0, leave = 1;
    if (t->segments == NULL && !clip_segment(t, a, d, &enter, &leave)) {
        flush(t, stroke);
        return;
    }
    double along = enter * length;
    const double end = leave * length;
    phase at = find_phase(stroke, total, start + along);
    if (enter > 0) {
        flush(t, stroke);
    }
    while (along < end) {
        const double next = along + at.remain < end ? along + at.remain : end;
        if (at.index % 2 == 0) {
            extend_to(t, a, b, along / length);
            extend_to(t, a, b, next / length);
        }
        if (along + at.remain <= end) {
            flush(t, stroke);
            at.index = at.index + 1 < stroke->dash_count ? at.index + 1 : 0;
            at.remain = stroke->dashes[at.index] * VD_UNITS;
        }
        along = next;
    }
    if (leave < 1) {
        flush(t, stroke);
    }
}

void vd_trace_dashes(vd_tracer *t, const vd_stroke *stroke, const double (*p)[2], size_t count,
                     bool closed) {
    double total = 0, along = stroke->dash_offset * VD_UNITS;
    for (int i = 0; i < stroke->dash_count; i++) {
        total += stroke->dashes[i] * VD_UNITS;
    }
    t->worker->dash.count = 0;
    const size_t segments = closed && count > 1 ? count : count - 1;
    for (size_t i = 0; i < segments && !t->out_of_memory; i++) {
        const size_t end = i + 1 < count ? i + 1 : 0;
        const vector a = {p[i][0], p[i][1]}, b = {p[end][0], p[end][1]};
        dash_segment(t, stroke, total, a, b, along);
        along += sqrt((b.x - a.x) * (b.x - a.x) + (b.y - a.y) * (b.y - a.y));
    }
    flush(t, stroke);
}

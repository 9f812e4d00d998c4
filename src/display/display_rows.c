/* A strip of rows at a time: which pixels of which quads are seen, nearest first; then the
 * blending, farthest first. Quad by quad, so that its edges and texels are in the first cache for
 * all of the strip's rows; the strip's colours stay in the second. */
#include "display/display_rows.h"

enum { STRIP_ROWS = 16 };

/* Fewer opaque pixels of a row are not worth a call of their own, which begins and ends where all
 * levels' vectors do. */
enum { LEAST_OPAQUE = 48, ALIGNED = 16 };

/* What nearer quads hide of a row: intervals in order, apart from each other. When there are more,
 * some is drawn that could have been left out. */
#define MAX_HIDDEN 32

typedef struct hidden_row {
    int count;
    int begin[MAX_HIDDEN], end[MAX_HIDDEN];
} hidden_row;

/* ---- spans ------------------------------------------------------------------------------------*/

static bool inside(const vd_display_edge *e, double constant, int x) {
    const double distance = e->a * (x + 0.5) + constant;
    return distance > 0.0 || (distance == 0.0 && e->closed);
}

/* Narrows [*begin, *end) to what is inside all edges on row y. Whether a pixel is inside one grows
 * or falls along the row even as it is rounded, so that a guess and steps of one find the ends. */
static void narrow(const vd_display_edge *edges, int count, int y, int *begin, int *end) {
    int low = *begin, high = *end;
    for (int i = 0; i < count && low < high; i++) {
        const vd_display_edge *e = &edges[i];
        const double constant = e->b * (y + 0.5) + e->c;
        double guess = -constant * e->inverse - 0.5;
        guess = guess > low ? guess : low;
        guess = guess < high ? guess : high;
        int x = (int)guess;
        if (e->a > 0.0) {
            while (x > low && inside(e, constant, x - 1)) {
                x--;
            }
            while (x < high && !inside(e, constant, x)) {
                x++;
            }
            low = x;
        } else if (e->a < 0.0) {
            while (x > low && !inside(e, constant, x - 1)) {
                x--;
            }
            while (x < high && inside(e, constant, x)) {
                x++;
            }
            high = x;
        } else if (!inside(e, constant, low)) {
            high = low;
        }
    }
    *begin = low;
    *end = high;
}

/* ---- what is hidden ---------------------------------------------------------------------------*/

static void hide(hidden_row *h, int begin, int end) {
    int first = 0;
    while (first < h->count && h->end[first] < begin) {
        first++;
    }
    int last = first;
    while (last < h->count && h->begin[last] <= end) {
        begin = h->begin[last] < begin ? h->begin[last] : begin;
        end = h->end[last] > end ? h->end[last] : end;
        last++;
    }
    if (last == first && h->count == MAX_HIDDEN) {
        return;
    }
    const int tail = h->count - last;
    if (last == first) {
        for (int i = tail - 1; i >= 0; i--) {
            h->begin[first + 1 + i] = h->begin[last + i];
            h->end[first + 1 + i] = h->end[last + i];
        }
    } else {
        for (int i = 0; i < tail; i++) {
            h->begin[first + 1 + i] = h->begin[last + i];
            h->end[first + 1 + i] = h->end[last + i];
        }
    }
    h->begin[first] = begin;
    h->end[first] = end;
    h->count += 1 - (last - first);
}

/* Adds what is seen of a segment, split at most `spare` times. Returns the number added. */
static int add_seen(vd_display_segment *out, size_t spare, vd_display_segment whole,
                    const hidden_row *h) {
    int added = 0;
    int at = whole.begin;
    for (int i = 0; i < h->count && h->begin[i] < whole.end; i++) {
        if (h->end[i] <= at) {
            continue;
        }
        if (h->begin[i] > at) {
            if ((size_t)added == spare) {
                break;
            }
            out[added] = whole;
            out[added].begin = at;
            out[added++].end = h->begin[i];
        }
        at = h->end[i];
    }
    if (at < whole.end) {
        out[added] = whole;
        out[added++].begin = at;
    }
    return added;
}

/* ---- drawing ----------------------------------------------------------------------------------*/

static double on_plane(const double plane[3], double x, double y) {
    return plane[0] * x + (plane[1] * y + plane[2]);
}

/* A position, in 1/256 texel and rounded, as whole and part. */
static void split(double position, int32_t *whole, float *part) {
    const double rounded = position * 256.0 - 127.5;
    double v = rounded < VD_DISPLAY_FAR ? rounded : VD_DISPLAY_FAR;
    v = v > -VD_DISPLAY_FAR ? v : -VD_DISPLAY_FAR;
    *whole = (int32_t)v;
    *whole -= *whole > v ? 1 : 0;
    *part = (float)(v - *whole);
}

/* A step a pixel that stays within VD_DISPLAY_FAR for n / (1 + n·bend) of them: `n` pixels, `grown`
 * is 1 + n·bend; 0 when that is not so, or not a number: only what has no area to speak of steps so
 * far. */
static float bounded(double step, double n, double grown) {
    const double far = step * n, most = VD_DISPLAY_FAR * grown;
    const bool near = far > -most && far < most;
    return near && step > -1e30 && step < 1e30 ? (float)step : 0.0f;
}

static vd_display_line make_line(const vd_display_window *window,
                                 const vd_display_segment *segment) {
    const vd_display_setup *s = segment->setup;
    const vd_quad_picture *p = &s->quad->picture;
    const double px = segment->base + 0.5, py = segment->y + 0.5;
    const double w = 1.0 / on_plane(s->inverse_w, px, py);
    const double u = on_plane(s->u, px, py) * w, v = on_plane(s->v, px, py) * w;
    /* Both grow away from the base, so that 1 + n·bend >= 1 and the way grows with n. */
    const double bend = s->inverse_w[0] * w;
    const double n = segment->reach, grown = 1.0 + n * bend;
    vd_display_line line = {
        .texels = p->rgba,
        .stride = (int32_t)p->stride,
        .width = p->width,
        .height = p->height,
        .base = segment->base,
        .step_u = bounded(256.0 * ((s->u[0] - u * s->inverse_w[0]) * w), n, grown),
        .step_v = bounded(256.0 * ((s->v[0] - v * s->inverse_w[0]) * w), n, grown),
        .bend = n * bend >= 0.0 && n * bend < 1e30 ? (float)bend : 0.0f,
        .opacity = s->quad->opacity,
    };
    if (window->depth != NULL) {
        const float nearer = s->quad->nearer > 1.0f ? s->quad->nearer : 1.0f;
        const double near = (double)window->near_m * (double)nearer;
        line.depth = window->depth + window->stride * (size_t)segment->y;
        line.depth_at = bounded(near / w, 1.0, 1.0);
        line.depth_step = bounded(near * s->inverse_w[0], 1.0, 1.0);
    }
    split(u, &line.whole_u, &line.part_u);
    split(v, &line.whole_v, &line.part_v);
    return line;
}

/* Adds what is seen of an entry's row y. Returns the number of segments. */
static int add_row(const vd_display_list *list, const vd_display_setup *s, int y, size_t spare,
                   vd_display_segment *out, hidden_row *hidden) {
    const int width = list->window.width;
    vd_display_segment whole = {s, y, 0, 0, 0, width, 0, 0};
    if (hidden->count == 1 && hidden->begin[0] == 0 && hidden->end[0] == width) {
        return 0;
    }
    narrow(s->edges, s->edge_count, y, &whole.begin, &whole.end);
    if (whole.begin >= whole.end) {
        return 0;
    }
    /* From where w is greatest: then 1 + n·bend never cancels. */
    const bool last = s->inverse_w[0] < 0.0;
    whole.base = last ? whole.end - 1 : whole.begin;
    whole.reach = last ? whole.begin - whole.base : whole.end - 1 - whole.base;
    int begin = whole.begin, end = begin;
    if (s->opaque_count > 0) {
        end = whole.end;
        narrow(s->opaque, s->opaque_count, y, &begin, &end);
        if (end - begin >= LEAST_OPAQUE) {
            whole.opaque_begin = (begin + ALIGNED - 1) & ~(ALIGNED - 1);
            whole.opaque_end = end & ~(ALIGNED - 1);
        }
    }
    const int added = add_seen(out, spare, whole, hidden);
    if (added > 0 && begin < end && !list->draw_hidden) {
        hide(hidden, begin, end);
    }
    return added;
}

static int clamp(int v, int low, int high) {
    return v < low ? low : v < high ? v : high;
}

/* What is opaque apart from the rest: what is below it need not be read. */
static void draw_segment(const vd_display_list *list, const vd_display_segment *s) {
    uint8_t *row = list->window.rgba + 4 * list->window.stride * (size_t)s->y;
    vd_display_line line = make_line(&list->window, s);
    const int first = clamp(s->opaque_begin, s->begin, s->end);
    const int last = clamp(s->opaque_end, first, s->end);
    if (first == last) {
        list->kernels->blend(row, &line, s->begin, s->end);
        return;
    }
    if (s->begin < first) {
        list->kernels->blend(row, &line, s->begin, first);
    }
    if (last < s->end) {
        list->kernels->blend(row, &line, last, s->end);
    }
    line.opaque = true;
    list->kernels->blend(row, &line, first, last);
}

/* Draws the rows [first, end), at most STRIP_ROWS: `segments` has room for as many of every entry.
 */
static void draw_strip(const vd_display_list *list, int first, int end,
                       const vd_display_entry *active, int count, vd_display_segment *segments) {
    hidden_row hidden[STRIP_ROWS];
    for (int y = first; y < end; y++) {
        hidden[y - first].count = 0;
    }
    size_t found = 0, spare = VD_DISPLAY_SPLITS;
    for (int i = count - 1; i >= 0; i--) {
        const int from = active[i].first_row > first ? active[i].first_row : first;
        const int to = active[i].end_row < end ? active[i].end_row : end;
        for (int y = from; y < to; y++) {
            const int added =
                add_row(list, active[i].setup, y, spare, segments + found, &hidden[y - first]);
            found += (size_t)added;
            spare -= added > 1 ? (size_t)(added - 1) : 0;
        }
    }
    while (found > 0) {
        draw_segment(list, &segments[--found]);
    }
}

void vd_display_rows(const vd_display_list *list, int first, int end, vd_display_scratch scratch) {
    int count = 0;
    for (int i = 0; i < list->count; i++) {
        if (list->entries[i].first_row < end && list->entries[i].end_row > first) {
            scratch.active[count++] = list->entries[i];
        }
    }
    if (count == 0) {
        return;
    }
    const int room =
        (int)((vd_display_segment_count(list->count) - VD_DISPLAY_SPLITS) / (size_t)count);
    const int rows = room < STRIP_ROWS ? room : STRIP_ROWS;
    for (int y = first; y < end; y += rows) {
        draw_strip(list, y, y + rows < end ? y + rows : end, scratch.active, count,
                   scratch.segments);
    }
}

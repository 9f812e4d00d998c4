/* bench_display.c: quads blended into a frame: pixels a second, and time of a quad against its
 * side.
 *
 * Three ways: `plain`, an opaque picture laid on the pixels; `textured`, an opaque one in
 * perspective; `blended`, a half-transparent one in perspective. Nothing hides anything, as the
 * pictures say nothing of their opacity.
 */
#include "bench.h"
#include "random.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SIDE = 256, LAYERS = 20, MOST_QUADS = 20000 };

typedef enum look { PLAIN, TEXTURED, BLENDED, LOOKS } look;
static const char *const names[LOOKS] = {"plain", "textured", "blended"};

typedef struct canvas {
    vd_context *context;
    vd_display *display;
    vd_frame *frame;
    vd_quad *quads;
    uint8_t *texels; /* [SIDE][SIDE][4] */
    int count;
} canvas;

static void finish_canvas(canvas *v) {
    vd_display_destroy(&v->display);
    vd_frame_destroy(&v->frame);
    free(v->quads);
    free(v->texels);
    if (v->context != NULL) {
        vd_context_destroy(&v->context);
    }
}

static vd_status init_canvas(canvas *v, int width, int height, vd_isa isa, int threads) {
    memset(v, 0, sizeof *v);
    vd_context_def def = vd_context_def_default();
    def.isa = isa;
    def.threads = threads;
    v->quads = calloc(MOST_QUADS, sizeof *v->quads);
    v->texels = malloc(4 * SIDE * SIDE);
    vd_status status = vd_context_create(&def, &v->context);
    if (status.code == VD_OK) {
        status = vd_display_create(v->context, &v->display);
    }
    if (status.code == VD_OK) {
        status = vd_frame_create(v->context, width, height, 0, &v->frame);
    }
    if (status.code == VD_OK && (v->quads == NULL || v->texels == NULL)) {
        status = vd_failure(VD_ERROR_MEMORY, "out of memory for quads");
    }
    return status;
}

static void paint(canvas *v, look how) {
    for (int i = 0; i < SIDE * SIDE; i++) {
        const int alpha = how == BLENDED ? 128 : 255;
        v->texels[4 * i] = (uint8_t)(i % SIDE * alpha / 255);
        v->texels[4 * i + 1] = (uint8_t)(i / SIDE * alpha / 255);
        v->texels[4 * i + 2] = 40;
        v->texels[4 * i + 3] = (uint8_t)alpha;
    }
}

/* A quad of about side × side pixels at (x, y); in perspective but for the plain one. A picture of
 * about its size: texels a pixel as impostors have them. */
static vd_quad place(const canvas *v, look how, double x, double y, double side) {
    const int texels = side < 3 ? 3 : side < SIDE ? (int)(side + 0.5) : SIDE;
    vd_quad quad = {.picture = {v->texels, texels, texels, SIDE, {0}}, .opacity = 255};
    const double tilt = how == PLAIN ? 0 : 0.1;
    const double left = how == PLAIN ? floor(x) : x, top = how == PLAIN ? floor(y) : y;
    double p[4][3] = {{left, top, 1},
                      {(left + side) * (1 + tilt), (top + tilt * side) * (1 + tilt), 1 + tilt},
                      {0, 0, 0},
                      {left, top + side, 1}};
    for (int k = 0; k < 3; k++) {
        p[2][k] = p[1][k] + p[3][k] - p[0][k];
    }
    for (int i = 0; i < 4; i++) {
        quad.corners[i] = (vd_quad_corner){(float)p[i][0], (float)p[i][1], (float)p[i][2]};
    }
    return quad;
}

static vd_status draw(void *user) {
    canvas *v = user;
    return vd_display_draw(v->display, NULL, v->frame, v->quads, v->count, NULL);
}

/* Clears the frame and draws the first `count` quads one at a time. Returns the pixels they have.
 */
static vd_status count_pixels(canvas *v, int count, double *pixels) {
    vd_status status = vd_success();
    *pixels = 0;
    const size_t bytes = 4 * v->frame->stride * (size_t)v->frame->height;
    for (int i = 0; i < count && status.code == VD_OK; i++) {
        memset(v->frame->rgba, 0, bytes);
        status = vd_display_draw(v->display, NULL, v->frame, v->quads + i, 1, NULL);
        for (size_t b = 3; b < bytes; b += 4) {
            *pixels += v->frame->rgba[b] != 0 ? 1 : 0;
        }
    }
    memset(v->frame->rgba, 0, bytes);
    return status;
}

/* ---- pixels a second --------------------------------------------------------------------------*/

static vd_status measure_rate(bench_run *run, const bench_case *self, canvas *v, look how) {
    bench_result result = bench_result_of(self, names[how]);
    result.threads = vd_context_threads(v->context);
    result.isa = vd_context_isa(v->context);
    result.width = self->width;
    result.height = self->rows;
    paint(v, how);
    v->count = LAYERS;
    for (int i = 0; i < LAYERS; i++) {
        v->quads[i] = place(v, how, 40.3 + 7 * i, 10.2 + 2 * i, 600);
    }
    double pixels = 0;
    vd_status status = count_pixels(v, LAYERS, &pixels);
    if (status.code == VD_OK) {
        status = bench_measure(run, draw, v, bench_wall_ms, &result);
    }
    if (status.code != VD_OK) {
        return status;
    }
    memset(v->frame->rgba, 0, 4 * v->frame->stride * (size_t)v->frame->height);
    status = draw(v);
    result.has_hash = true;
    result.hash = vd_frame_hash(v->frame);
    result.same_picture = true;
    result.picture = (int)how;
    result.reference = run->result_count == 0;
    snprintf(result.note, sizeof result.note, "%.0f M pixels/s", pixels / result.median_ms * 1e-3);
    return status.code == VD_OK ? bench_add(run, &result) : status;
}

vd_status bench_quads(bench_run *run, const bench_case *self) {
    vd_status status = vd_success();
    for (int i = 0; i < run->isa_count; i++) {
        for (int t = 0; t < run->thread_count && status.code == VD_OK; t++) {
            canvas v;
            status = init_canvas(&v, self->width, self->rows, run->isas[i], run->threads[t]);
            for (int how = 0; how < LOOKS && status.code == VD_OK; how++) {
                status = measure_rate(run, self, &v, (look)how);
            }
            finish_canvas(&v);
        }
    }
    return status;
}

/* ---- time against the side --------------------------------------------------------------------*/

enum { SIDES = 8 };

/* Lawlor 2004, eq. 2.1: t = max(α, β·(s + γ·r)) for s pixels in r rows. */
typedef struct model {
    double alpha, beta, gamma;
} model;

/* The squared error of the logarithm, so that small quads count as much as large ones. */
static double model_error(const model *m, int count, const double sides[], const double ns[]) {
    double sum = 0;
    for (int i = 0; i < count; i++) {
        const double t = m->beta * (sides[i] * sides[i] + m->gamma * sides[i]);
        const double off = log((t > m->alpha ? t : m->alpha) / ns[i]);
        sum += off * off;
    }
    return sum;
}

static model fit(int count, const double sides[], const double ns[]) {
    const double last = sides[count - 1];
    model best = {ns[0], ns[count - 1] / (last * last), 3};
    double *const parts[] = {&best.alpha, &best.beta, &best.gamma};
    double error = model_error(&best, count, sides, ns);
    for (double step = 1.5; step > 1.001;) {
        bool better = false;
        for (int i = 0; i < 6; i++) {
            const double before = *parts[i / 2];
            *parts[i / 2] = i % 2 == 0 ? before * step : before / step;
            const double now = model_error(&best, count, sides, ns);
            if (now < error) {
                error = now;
                better = true;
            } else {
                *parts[i / 2] = before;
            }
        }
        step = better ? step : sqrt(step);
    }
    return best;
}

static vd_status measure_side(bench_run *run, const bench_case *self, canvas *v, look how,
                              double side, double *ns) {
    bench_result result = bench_result_of(self, names[how]);
    result.at = side;
    result.threads = vd_context_threads(v->context);
    result.isa = vd_context_isa(v->context);
    result.width = self->width;
    result.height = self->rows;
    const double wanted = 8e6 / (side * side);
    v->count = wanted < 4 ? 4 : wanted < MOST_QUADS ? (int)wanted : MOST_QUADS;
    uint64_t random = 1;
    for (int i = 0; i < v->count; i++) {
        v->quads[i] = place(v, how, vd_uniform(&random) * (self->width - 1 - 1.1 * side),
                            vd_uniform(&random) * (self->rows - 1 - 1.1 * side), side);
    }
    const vd_status status = bench_measure(run, draw, v, bench_wall_ms, &result);
    if (status.code != VD_OK) {
        return status;
    }
    *ns = result.median_ms * 1e6 / v->count;
    snprintf(result.note, sizeof result.note, "%.0f ns a quad, %.0f M pixels/s", *ns,
             1e3 * side * side / *ns);
    return bench_add(run, &result);
}

vd_status bench_quad_sides(bench_run *run, const bench_case *self) {
    const int points = bench_sweep_points(run, self->sweep);
    vd_status status = vd_success();
    for (int t = 0; t < run->thread_count && status.code == VD_OK; t++) {
        canvas v;
        status = init_canvas(&v, self->width, self->rows, VD_ISA_AUTO, run->threads[t]);
        for (int how = 0; how < LOOKS && status.code == VD_OK; how++) {
            double ns[SIDES];
            paint(&v, (look)how);
            for (int p = 0; p < points && status.code == VD_OK; p++) {
                status = measure_side(run, self, &v, (look)how, self->sweep->values[p], &ns[p]);
            }
            if (status.code == VD_OK && points > 0) {
                const model m = fit(points, self->sweep->values, ns);
                bench_result *last = &run->results[run->result_count - 1];
                snprintf(last->note, sizeof last->note, "fit: max(%.0f ns, %.2f ns x (s + %.1f r))",
                         m.alpha, m.beta, m.gamma);
            }
        }
        finish_canvas(&v);
    }
    return status;
}

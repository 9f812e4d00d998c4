/* bench_coverage.c: vector paths into a target of 16 bits: large and small polygons, crossings,
 * curves, strokes.
 *
 * The peer of the polygons is a plain loop on one thread, `accumulate`: each polygon's signed areas
 * in a float buffer of its box, summed along rows and blended pixel by pixel (Duff 1989 as he put
 * it; one fill rule, and wrong where a polygon overlaps itself).
 */
#include "bench.h"
#include "random.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

typedef struct scene {
    size_t count, corners; /* layers, points of each */
    double (*points)[2];
    vd_layer *layers;
    vd_stroke stroke;
    double pixels; /* touched by all layers together */
} scene;

typedef struct canvas {
    vd_context *context;
    vd_coverage *coverage;
    vd_target *target;
    vd_frame *frame;
    const scene *scene;
    float *areas; /* of the plain loop */
} canvas;

/* ---- scenes -----------------------------------------------------------------------------------*/

typedef enum kind { LARGE, SMALL, CROSSING, CURVES, STROKES, KINDS } kind;

static const struct {
    const char *name, *unit; /* of the case, of what its note counts */
    size_t count, corners;
} kinds[KINDS] = {{"coverage-large", "pixels", 100, 100},
                  {"coverage-small", "polygons", 500000, 4},
                  {"coverage-crossing", "polygons", 100000, 5},
                  {"coverage-curves", "curves", 20000, 13},
                  {"coverage-strokes", "segments", 2000, 20}};

/* A circle of radius 1 by four cubics. */
static const double circle[13][2] = {
    {1, 0},        {1, 0.5523},   {0.5523, 1}, {0, 1},       {-0.5523, 1}, {-1, 0.5523}, {-1, 0},
    {-1, -0.5523}, {-0.5523, -1}, {0, -1},     {0.5523, -1}, {1, -0.5523}, {1, 0}};
static const uint8_t circle_verbs[] = {VD_PATH_MOVE,  VD_PATH_CUBIC, VD_PATH_CUBIC,
                                       VD_PATH_CUBIC, VD_PATH_CUBIC, VD_PATH_CLOSE};

static void place_points(kind k, uint64_t *random, size_t count, double size, double (*out)[2]) {
    double x = size * vd_uniform(random), y = size * vd_uniform(random);
    const double start = 6.283185307179586 * vd_uniform(random);
    for (size_t i = 0; i < count; i++) {
        /* A pentagram goes around twice. */
        const double turns = (double)i * (k == CROSSING ? 2.0 : 1.0) / (double)count;
        const double c = cos(start + 6.283185307179586 * turns);
        const double s = sin(start + 6.283185307179586 * turns);
        const double radius = k == LARGE   ? (0.3 + 0.2 * vd_uniform(random)) * size
                              : k == SMALL ? 2.2
                                           : 4;
        out[i][0] = (k == LARGE ? 0.5 * size : x) + radius * c;
        out[i][1] = (k == LARGE ? 0.5 * size : y) + radius * s;
        if (k == CURVES) {
            out[i][0] = x + 8 * circle[i][0];
            out[i][1] = y + 8 * circle[i][1];
        } else if (k == STROKES) {
            out[i][0] = x += 30 * (vd_uniform(random) - 0.5);
            out[i][1] = y += 30 * (vd_uniform(random) - 0.5);
        }
    }
}

static void count_pixels(void *user, const vd_span *span) {
    *(double *)user += span->count;
}

static vd_status make_scene(scene *s, kind k, double size) {
    memset(s, 0, sizeof *s);
    s->count = kinds[k].count;
    s->corners = kinds[k].corners;
    s->points = malloc(s->count * s->corners * sizeof *s->points);
    s->layers = malloc(s->count * sizeof *s->layers);
    if (s->points == NULL || s->layers == NULL) {
        return vd_failure(VD_ERROR_MEMORY, "out of memory for %zu polygons", s->count);
    }
    s->stroke = vd_stroke_default();
    s->stroke.width = 2.5;
    s->stroke.join = VD_JOIN_ROUND;
    s->stroke.cap = VD_CAP_ROUND;
    uint64_t random = 1;
    for (size_t i = 0; i < s->count; i++) {
        vd_layer *layer = &s->layers[i];
        double(*points)[2] = s->points + i * s->corners;
        place_points(k, &random, s->corners, size, points);
        *layer = vd_layer_default();
        layer->path.points = (const double(*)[2])points;
        layer->path.point_count = s->corners;
        layer->path.verbs = k == CURVES ? circle_verbs : NULL;
        layer->path.verb_count = k == CURVES ? sizeof circle_verbs : 0;
        layer->path.open = k == STROKES;
        layer->filled = k != STROKES;
        layer->stroke = k == STROKES ? &s->stroke : NULL;
        const double alpha = k == LARGE ? 32768 : 60000;
        for (int c = 0; c < 4; c++) {
            layer->fill[c] = (uint16_t)(c == 3 ? alpha : alpha * vd_uniform(&random));
        }
    }
    return vd_success();
}

/* ---- the plain loop ---------------------------------------------------------------------------*/

/* Adds the signed areas of a line in a buffer whose pixel (0, 0) is the picture's; clipped at the
 * picture's sides by clamping. */
static void accumulate_line(float *areas, int width, int height, const double a[2],
                            const double b[2]) {
    const double *top = a[1] < b[1] ? a : b, *bottom = a[1] < b[1] ? b : a;
    const float sign = a[1] < b[1] ? 1.0f : -1.0f;
    const double slope = (bottom[0] - top[0]) / (bottom[1] - top[1]);
    const int first = top[1] > 0 ? (int)top[1] : 0;
    for (int y = first; y < height && y < bottom[1]; y++) {
        const double y0 = top[1] > y ? top[1] : y, y1 = bottom[1] < y + 1 ? bottom[1] : y + 1;
        double x0 = top[0] + (y0 - top[1]) * slope, x1 = top[0] + (y1 - top[1]) * slope;
        double low = x0 < x1 ? x0 : x1, high = x0 < x1 ? x1 : x0;
        low = low < 0 ? 0 : low < width ? low : width;
        high = high < 0 ? 0 : high < width ? high : width;
        float *row = areas + (size_t)y * (size_t)(width + 2);
        const double share = high > low ? (y1 - y0) / (high - low) : 0;
        for (int x = (int)low; x <= (int)high; x++) {
            const double from = low > x ? low : x, to = high < x + 1 ? high : x + 1;
            const double part = high > low ? (to - from) * share : y1 - y0;
            const float area = (float)(part * (x + 1 - 0.5 * (from + to)));
            row[x] += sign * area;
            row[x + 1] += sign * ((float)part - area);
        }
    }
}

static void accumulate_blend(uint16_t *pixel, float area, const uint16_t color[4]) {
    const float covered = area < 1.0f ? area : 1.0f;
    const float remains = 1.0f - covered * (float)color[3] * (1.0f / 65535);
    for (int c = 0; c < 4; c++) {
        pixel[c] = (uint16_t)(covered * (float)color[c] + remains * (float)pixel[c] + 0.5f);
    }
}

static vd_status draw_plain(void *user) {
    canvas *v = user;
    vd_target *t = v->target;
    static const uint16_t black[4] = {0, 0, 0, 65535};
    vd_target_clear(t, black);
    for (size_t i = 0; i < v->scene->count; i++) {
        const vd_path *path = &v->scene->layers[i].path;
        double low[2] = {1e9, 1e9}, high[2] = {0, 0};
        for (size_t p = 0; p < path->point_count; p++) {
            const double *a = path->points[p];
            const double *b = path->points[p + 1 < path->point_count ? p + 1 : 0];
            accumulate_line(v->areas, t->width, t->height, a, b);
            for (int k = 0; k < 2; k++) {
                low[k] = a[k] < low[k] ? a[k] : low[k];
                high[k] = high[k] < a[k] ? a[k] : high[k];
            }
        }
        const int x0 = low[0] > 0 ? (int)low[0] : 0, y0 = low[1] > 0 ? (int)low[1] : 0;
        for (int y = y0; y < t->height && y < high[1]; y++) {
            float *row = v->areas + (size_t)y * (size_t)(t->width + 2), sum = 0;
            uint16_t *pixels = t->color + 4 * (size_t)y * t->stride;
            for (int x = x0; x <= t->width + 1 && x < high[0] + 1; x++) {
                sum += row[x];
                row[x] = 0;
                if (x < t->width) {
                    accumulate_blend(pixels + 4 * x, fabsf(sum), v->scene->layers[i].fill);
                }
            }
        }
    }
    return vd_success();
}

/* ---- cases ------------------------------------------------------------------------------------*/

static vd_status draw_rows(void *user) {
    canvas *v = user;
    static const uint16_t black[4] = {0, 0, 0, 65535};
    vd_target_clear(v->target, black);
    return vd_coverage_draw(v->coverage, NULL, NULL, v->scene->layers, v->scene->count, v->target);
}

static void finish_canvas(canvas *v) {
    vd_coverage_destroy(&v->coverage);
    vd_target_destroy(&v->target);
    vd_frame_destroy(&v->frame);
    free(v->areas);
    if (v->context != NULL) {
        vd_context_destroy(&v->context);
    }
}

static vd_status init_canvas(canvas *v, const scene *s, int size, vd_isa isa, int threads) {
    memset(v, 0, sizeof *v);
    vd_context_def def = vd_context_def_default();
    def.isa = isa;
    def.threads = threads;
    v->scene = s;
    v->areas = calloc((size_t)(size + 2) * (size_t)size, sizeof *v->areas);
    vd_status status = vd_context_create(&def, &v->context);
    if (status.code == VD_OK) {
        status = vd_coverage_create(v->context, &v->coverage);
    }
    if (status.code == VD_OK) {
        status = vd_target_create(v->context, size, size, 1, &v->target);
    }
    if (status.code == VD_OK) {
        status = vd_frame_create(v->context, size, size, 0, &v->frame);
    }
    if (status.code == VD_OK && v->areas == NULL) {
        status = vd_failure(VD_ERROR_MEMORY, "out of memory for a picture");
    }
    return status;
}

/* Pixels that the layers touch, in one thread: the count is one number. */
static vd_status count_touched(const canvas *v, scene *s) {
    vd_context_def def = vd_context_def_default();
    def.threads = 1;
    vd_context *context = NULL;
    vd_coverage *coverage = NULL;
    vd_status status = vd_context_create(&def, &context);
    if (status.code == VD_OK) {
        status = vd_coverage_create(context, &coverage);
    }
    if (status.code == VD_OK) {
        status = vd_coverage_spans(coverage, NULL, NULL, s->layers, s->count, 0, 0,
                                   v->target->width, v->target->height, count_pixels, &s->pixels);
    }
    vd_coverage_destroy(&coverage);
    vd_context_destroy(&context);
    return status;
}

static vd_status measure(bench_run *run, const bench_case *self, canvas *v, kind k, bool plain) {
    const scene *s = v->scene;
    bench_result result = bench_result_of(self, plain ? "accumulate" : "rows");
    result.threads = plain ? 1 : vd_context_threads(v->context);
    result.isa = vd_context_isa(v->context);
    result.width = result.height = self->width;
    result.reference = plain;
    result.same_picture = !plain;
    vd_context_memory_reset_peak(v->context);
    vd_status status =
        bench_measure(run, plain ? draw_plain : draw_rows, v, bench_wall_ms, &result);
    if (status.code != VD_OK) {
        return status;
    }
    result.peak_bytes = vd_context_memory(v->context).bytes_peak;
    vd_target_resolve(v->target, v->frame);
    result.has_hash = true;
    result.hash = vd_frame_hash(v->frame);
    const double things = k == LARGE     ? s->pixels
                          : k == CURVES  ? 4.0 * (double)s->count
                          : k == STROKES ? (double)(s->count * (s->corners - 1))
                                         : (double)s->count;
    snprintf(result.note, sizeof result.note, "%.2f M %s/s", things / result.median_ms * 1e-3,
             kinds[k].unit);
    return bench_add(run, &result);
}

vd_status bench_coverage(bench_run *run, const bench_case *self) {
    int k = 0;
    while (strcmp(kinds[k].name, self->name) != 0) {
        k++;
    }
    scene s;
    vd_status status = make_scene(&s, (kind)k, self->width);
    for (int i = 0; i < run->isa_count; i++) {
        for (int t = 0; t < run->thread_count && status.code == VD_OK; t++) {
            canvas v;
            status = init_canvas(&v, &s, self->width, run->isas[i], run->threads[t]);
            if (status.code == VD_OK && s.pixels == 0) {
                status = count_touched(&v, &s);
            }
            if (status.code == VD_OK && t == 0 && k <= CROSSING) {
                status = measure(run, self, &v, (kind)k, true);
            }
            if (status.code == VD_OK) {
                status = measure(run, self, &v, (kind)k, false);
            }
            finish_canvas(&v);
        }
    }
    free(s.points);
    free(s.layers);
    return status;
}

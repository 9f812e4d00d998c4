/* bench_ground.c: memory that terrain takes, and formulas. */
#include "bench.h"

#include <math.h>
#include <string.h>

/* ---- memory -----------------------------------------------------------------------------------*/

/* Most bytes held while a picture of 16 × 16 pixels is drawn, beside which only the map counts,
 * then one of 700 × 512; the frames themselves left out. */
static vd_status measure_bytes(bench_run *run, bench_scene *s, bench_work *work,
                               bench_result *result) {
    static const size_t height_bytes[VD_HEIGHT_TYPE_COUNT] = {1, 2, 4};
    const double samples = (double)s->map->width * (double)s->map->height;
    const double raw = samples * (double)height_bytes[s->map->height_type] +
                       (double)s->map->color_width * (double)s->map->color_height * 4.0;
    const size_t frame_bytes = s->frame->stride * (size_t)s->frame->height * sizeof(vd_rgba8);
    vd_frame *frame = s->frame, *tiny = NULL;
    vd_status status = vd_frame_create(s->context, 16, 16, 0, &tiny);
    if (status.code != VD_OK) {
        return status;
    }
    vd_context_memory_reset_peak(s->context);
    s->frame = tiny;
    status = work(s);
    s->frame = frame;
    vd_frame_destroy(&tiny);
    const double whole = (double)(vd_context_memory(s->context).bytes_peak - frame_bytes);
    result->at = s->map->width;
    result->threads = vd_context_threads(s->context);
    result->isa = vd_context_isa(s->context);
    result->width = s->frame->width;
    result->height = s->frame->height;
    if (status.code == VD_OK) {
        status = bench_measure(run, work, s, bench_wall_ms, result);
    }
    result->peak_bytes = vd_context_memory(s->context).bytes_peak - frame_bytes;
    snprintf(result->note, sizeof result->note,
             "%.2f of heights + colours (map alone %.2f; drawing %.2f)", whole / raw,
             (double)s->map->size_bytes / raw, (double)result->peak_bytes / raw);
    return status.code == VD_OK ? bench_add(run, result) : status;
}

/* A map of one kind: the heightfield with the renderer that has drawn. */
static vd_status measure_memory(bench_run *run, const bench_case *self, bench_map_kind kind,
                                int side) {
    bench_scene s;
    vd_status status = bench_scene_init(&s, run, kind, side, run->isas[0],
                                        run->threads[run->thread_count - 1], 700, 512);
    if (status.code != VD_OK) {
        return status;
    }
    if (kind == BENCH_MAP_FLOAT) {
        bench_set_lens_view(&s);
        bench_result result = bench_result_of(self, "lens-march");
        status = measure_bytes(run, &s, bench_draw_terrain, &result);
    } else {
        s.method = VD_CLASSIC_MARCH;
        for (int filter = VD_FILTER_NEAREST; filter <= VD_FILTER_LINEAR; filter++) {
            s.classic.filter = (vd_filter)filter;
            vd_classic_renderer_destroy(&s.renderer);
            if (status.code == VD_OK) {
                status = vd_classic_renderer_create(s.context, s.map, &s.renderer);
            }
            bench_result result = bench_result_of(
                self, filter == VD_FILTER_LINEAR ? "classic-linear" : "classic-march");
            if (status.code == VD_OK) {
                status = measure_bytes(run, &s, bench_draw_classic, &result);
            }
        }
    }
    bench_scene_finish(&s);
    return status;
}

vd_status bench_memory(bench_run *run, const bench_case *self) {
    static const int sides[] = {0, 4096}; /* as it comes, and large */
    vd_status status = vd_success();
    for (int i = 0; i < (run->quick ? 1 : 2) && status.code == VD_OK; i++) {
        status = measure_memory(run, self, BENCH_MAP_CLASSIC, sides[i]);
        if (status.code == VD_OK) {
            status = measure_memory(run, self, BENCH_MAP_FLOAT, sides[i]);
        }
    }
    return status;
}

/* ---- formulas ---------------------------------------------------------------------------------*/

enum { POINTS = 1 << 16 };

typedef struct formula {
    vd_function *function;
    float *x, *y, *h, *rgb[3];
} formula;

static vd_status evaluate(void *user) {
    formula *f = user;
    vd_function_evaluate(f->function, POINTS, f->x, f->y, f->h,
                         vd_function_has_color(f->function) ? f->rgb : NULL);
    return vd_success();
}

/* The thesis' formula in C with the C library's functions, one point at a time: what a formula
 * costs who writes it down as code. */
static void thesis_in_c(void *user, const float x[VD_FUNCTION_LANES],
                        const float y[VD_FUNCTION_LANES], float h[VD_FUNCTION_LANES],
                        float red[VD_FUNCTION_LANES], float green[VD_FUNCTION_LANES],
                        float blue[VD_FUNCTION_LANES]) {
    (void)user;
    (void)red;
    (void)green;
    (void)blue;
    for (int i = 0; i < VD_FUNCTION_LANES; i++) {
        h[i] = 60 * cosf(x[i] / 40) * sinf(y[i] / 40);
    }
}

static vd_status measure_formula(bench_run *run, const bench_case *self, vd_context *context,
                                 const char *method, const char *text, formula *f) {
    const vd_function_callback_def callback = {.evaluate = thesis_in_c};
    vd_status status = text != NULL ? vd_function_compile(context, text, &f->function)
                                    : vd_function_from_callback(context, &callback, &f->function);
    if (status.code != VD_OK) {
        return status;
    }
    bench_result result = bench_result_of(self, method);
    result.isa = vd_context_isa(context);
    status = bench_measure(run, evaluate, f, bench_wall_ms, &result);
    snprintf(result.note, sizeof result.note, "%.2f ns a point", result.median_ms * 1e6 / POINTS);
    vd_function_destroy(context, &f->function);
    return status.code == VD_OK ? bench_add(run, &result) : status;
}

static vd_status measure_formulas(bench_run *run, const bench_case *self, vd_context *context,
                                  formula *f) {
    static const struct {
        const char *method, *text;
    } formulas[] = {
        {"thesis-in-c", NULL},
        {"thesis", "h=60*cos(x/40)*sin(y/40)"},
        {"thesis-rgb", "h=60*cos(x/40)*sin(y/40); rgb=hsv(h/120,0.6,1)"},
        {"fbm-8", "h=60*fbm(x/100,y/100,8)"},
        {"ridged-8", "h=60*ridged(x/100,y/100,8)"},
    };
    vd_status status = vd_success();
    for (size_t i = 0; i < sizeof formulas / sizeof formulas[0] && status.code == VD_OK; i++) {
        status = measure_formula(run, self, context, formulas[i].method, formulas[i].text, f);
    }
    return status;
}

vd_status bench_formula(bench_run *run, const bench_case *self) {
    vd_status status = vd_success();
    for (int i = 0; i < run->isa_count && status.code == VD_OK; i++) {
        vd_context *context = NULL;
        vd_context_def def = vd_context_def_default();
        def.threads = 1;
        def.isa = run->isas[i];
        status = vd_context_create(&def, &context);
        if (status.code != VD_OK) {
            return status;
        }
        float *block = vd_allocate(context, (size_t)6 * POINTS, sizeof *block);
        if (block == NULL) {
            status = vd_failure(VD_ERROR_MEMORY, "out of memory for the points");
        } else {
            formula f = {NULL, block, block + POINTS, block + 2 * POINTS, {NULL, NULL, NULL}};
            for (int c = 0; c < 3; c++) {
                f.rgb[c] = block + (size_t)(3 + c) * POINTS;
            }
            for (int p = 0; p < POINTS; p++) {
                f.x[p] = (float)(p % 256);
                f.y[p] = (float)(p / 256);
            }
            status = measure_formulas(run, self, context, &f);
        }
        vd_release(context, block);
        vd_context_destroy(&context);
    }
    return status;
}

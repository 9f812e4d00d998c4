/* coverage.c: the rasterizer object, from layers to spans and pixels.
 *
 * Layers are drawn in batches: their edges are memory that must be bounded, but every batch walks
 * over the whole picture once more. Quads of 18 pixels in 1024² took 615 ns each in batches of
 * 8,192, 500 ns of 32,768, 450 ns of 65,536, 405 ns of 262,144: the pixels, 8 MB, come from memory
 * each time. (One thread of a busy machine; fetching a shape's pixels ahead gained nothing.) */
#include <string.h>
#include "coverage/coverage_check.h"
#include "image/image.h"
#include "image/image_kernels.h"

#define BATCH_LAYERS 65536
#define BATCH_POINTS ((size_t)1 << 18)
#define CHUNKS 64
#define CHECK_LAYERS 4096

/* ---- definitions ------------------------------------------------------------------------------
 */

const char *vd_coverage_method_name(vd_coverage_method method) {
    static const char *const names[VD_COVERAGE_METHOD_COUNT] = {"rows", "reference"};
    return method >= 0 && method < VD_COVERAGE_METHOD_COUNT ? names[method] : "unknown";
}

vd_coverage_def vd_coverage_def_default(void) {
    return (vd_coverage_def){.method = VD_COVERAGE_ROWS};
}

vd_stroke vd_stroke_default(void) {
    return (vd_stroke){.width = 1, .color = {0, 0, 0, 65535}};
}

vd_layer vd_layer_default(void) {
    return (vd_layer){
        .picture_from_path = {.xx = 1, .yy = 1}, .filled = true, .fill = {0, 0, 0, 65535}};
}

/* ---- memory -----------------------------------------------------------------------------------
 */

vd_status vd_coverage_create(vd_context *context, vd_coverage **out) {
    vd_coverage *coverage = vd_allocate_zero(context, 1, sizeof *coverage);
    if (coverage == NULL) {
        return vd_out_of_memory("a coverage rasterizer", sizeof *coverage);
    }
    coverage->context = context;
    coverage->kernels = vd_coverage_kernels_for(vd_context_isa(context));
    coverage->thread_count = vd_context_threads(context);
    const size_t workers = (size_t)coverage->thread_count;
    coverage->workers = vd_allocate_zero(context, workers, sizeof *coverage->workers);
    if (coverage->workers == NULL) {
        vd_coverage_destroy(&coverage);
        return vd_out_of_memory("a coverage rasterizer", workers * sizeof *coverage->workers);
    }
    *out = coverage;
    return vd_success();
}

void vd_coverage_destroy(vd_coverage **coverage_in_out) {
    if (coverage_in_out == NULL || *coverage_in_out == NULL) {
        return;
    }
    vd_coverage *coverage = *coverage_in_out;
    *coverage_in_out = NULL;
    vd_context *context = coverage->context;
    vd_rows_release(coverage);
    for (int i = 0; coverage->workers != NULL && i < coverage->thread_count; i++) {
        vd_release(context, coverage->workers[i].line.at);
        vd_release(context, coverage->workers[i].dash.at);
    }
    vd_release(context, coverage->workers);
    vd_release(context, coverage->block_memory.memory);
    vd_release(context, coverage->list_memory.memory);
    vd_release(context, coverage->shape_memory.memory);
    vd_release(context, coverage->canvas_memory.memory);
    vd_release(context, coverage);
}

/* Memory for a batch but for its edges. */
static vd_status reserve_batch(vd_coverage *coverage, size_t lists, const vd_coverage_run *run) {
    vd_status status = vd_buffer_reserve(coverage->context, &coverage->list_memory,
                                         "lists of edges", lists, sizeof *coverage->lists);
    if (status.code == VD_OK) {
        status = vd_buffer_reserve(coverage->context, &coverage->shape_memory, "shapes",
                                   2 * run->batch_count, sizeof *coverage->shapes);
    }
    coverage->lists = coverage->list_memory.memory;
    coverage->shapes = coverage->shape_memory.memory;
    return status;
}

static vd_status reserve_blocks(vd_coverage *coverage, size_t blocks) {
    vd_status status = vd_buffer_reserve(coverage->context, &coverage->block_memory,
                                         "edges of paths", blocks, sizeof *coverage->blocks);
    coverage->blocks = coverage->block_memory.memory;
    coverage->block_capacity = coverage->block_memory.bytes / sizeof *coverage->blocks;
    return status;
}

/* ---- tracing a batch --------------------------------------------------------------------------
 */

typedef struct batch {
    const vd_coverage_run *run;
    size_t chunk_layers;
    int chunks;
    atomic_bool out_of_memory;
} batch;

void vd_tracer_init(vd_tracer *t, const vd_coverage_run *run, vd_coverage_worker *worker) {
    memset(t, 0, sizeof *t);
    t->coverage = run->coverage;
    t->worker = worker;
    t->x = run->x;
    t->y = run->y;
    t->width = (double)run->width * VD_UNITS;
    t->height = (double)run->height * VD_UNITS;
    t->tolerance = (run->def.tolerance == 0 ? 1.0 / 64 : run->def.tolerance) * VD_UNITS;
}

static void trace_chunk(void *user, int chunk, int worker) {
    batch *b = user;
    const vd_coverage_run *run = b->run;
    vd_coverage *coverage = run->coverage;
    vd_tracer t;
    vd_tracer_init(&t, run, &coverage->workers[worker]);
    t.lists = coverage->lists + (size_t)chunk * (size_t)run->bands;
    memset(t.lists, 0, (size_t)run->bands * sizeof *t.lists);
    const size_t from = (size_t)chunk * b->chunk_layers;
    const size_t left = run->batch_count - from;
    const size_t to = from + (left < b->chunk_layers ? left : b->chunk_layers);
    for (size_t i = from; i < to; i++) {
        const vd_layer *layer = &run->layers[run->first + i];
        if (layer->filled) {
            t.shape = (uint32_t)(2 * i);
            vd_trace_layer(&t, layer, false, &coverage->shapes[2 * i]);
        }
        if (layer->stroke != NULL) {
            t.shape = (uint32_t)(2 * i + 1);
            vd_trace_layer(&t, layer, true, &coverage->shapes[2 * i + 1]);
        }
    }
    if (t.out_of_memory) {
        atomic_store(&b->out_of_memory, true);
    }
}

/* Gives every thread room for the longest line that one of them has met: which thread traces what
 * is chance, and a second picture must not need more. */
static vd_status even_out(vd_coverage *coverage) {
    size_t most = 0;
    for (int i = 0; i < coverage->thread_count; i++) {
        const vd_coverage_worker *w = &coverage->workers[i];
        const size_t more =
            w->line.capacity < w->dash.capacity ? w->dash.capacity : w->line.capacity;
        most = most < more ? more : most;
    }
    for (int i = 0; i < 2 * coverage->thread_count; i++) {
        vd_coverage_worker *w = &coverage->workers[i / 2];
        vd_points *points = i % 2 == 0 ? &w->line : &w->dash;
        if (most <= points->capacity) {
            continue;
        }
        vd_buffer memory = {points->at, points->capacity * sizeof *points->at};
        const vd_status status = vd_buffer_reserve(
            coverage->context, &memory, "the points of a stroke", most, sizeof *points->at);
        points->at = memory.memory;
        points->capacity = memory.bytes / sizeof *points->at;
        if (status.code != VD_OK) {
            return status;
        }
    }
    return vd_success();
}

/* Traces the batch's layers; again when there were not enough blocks, which then are. */
static vd_status trace_batch(batch *b) {
    const vd_coverage_run *run = b->run;
    vd_coverage *coverage = run->coverage;
    for (;;) {
        atomic_store(&coverage->block_count, 0);
        vd_status status = vd_parallel_for(coverage->context, run->job, b->chunks, trace_chunk, b);
        if (status.code != VD_OK) {
            return status;
        }
        if (atomic_load(&b->out_of_memory)) {
            return vd_out_of_memory("the points of a stroke", 0);
        }
        const size_t blocks = atomic_load(&coverage->block_count);
        if (blocks <= coverage->block_capacity) {
            return even_out(coverage);
        }
        status = reserve_blocks(coverage, blocks + blocks / 4);
        if (status.code != VD_OK) {
            return status;
        }
    }
}

/* ---- drawing ----------------------------------------------------------------------------------
 */

static void draw_band(void *user, int band, int worker) {
    const batch *b = user;
    vd_rows_band(b->run, b->chunks, band, worker);
}

static vd_status draw_batch(vd_coverage_run *run) {
    vd_coverage *coverage = run->coverage;
    batch b = {.run = run};
    b.chunk_layers = run->batch_count / CHUNKS + 1;
    b.chunks = (int)((run->batch_count + b.chunk_layers - 1) / b.chunk_layers);
    const size_t lists = (size_t)b.chunks * (size_t)run->bands;
    vd_status status = reserve_batch(coverage, lists, run);
    if (status.code != VD_OK) {
        return status;
    }
    status = trace_batch(&b);
    if (status.code != VD_OK) {
        return status;
    }
    size_t most = 1;
    for (size_t i = 0; i < lists; i++) {
        most = coverage->lists[i].edges > most ? coverage->lists[i].edges : most;
    }
    status = vd_rows_reserve(coverage, most, (size_t)run->width);
    return status.code != VD_OK
               ? status
               : vd_parallel_for(coverage->context, run->job, run->bands, draw_band, &b);
}

static vd_status draw_layers(vd_coverage_run *run) {
    if (run->def.method == VD_COVERAGE_REFERENCE) {
        return vd_coverage_reference(run);
    }
    run->bands = (run->height + VD_BAND_ROWS - 1) / VD_BAND_ROWS;
    vd_status status = vd_success();
    for (run->first = 0; run->first < run->count && status.code == VD_OK;
         run->first += run->batch_count) {
        size_t points = 0, layers = 0;
        while (run->first + layers < run->count && layers < BATCH_LAYERS &&
               (layers == 0 || points < BATCH_POINTS)) {
            points += run->layers[run->first + layers++].path.point_count;
        }
        run->batch_count = layers;
        status = draw_batch(run);
    }
    return status;
}

/* ---- checking ---------------------------------------------------------------------------------
 */

typedef struct checking {
    const vd_layer *layers;
    size_t count;
    vd_coverage_worker *workers;
    _Atomic size_t bad; /* the first layer that cannot be drawn, as far as is known; count: none */
} checking;

static void check_chunk(void *user, int chunk, int worker) {
    checking *c = user;
    const size_t from = (size_t)chunk * CHECK_LAYERS, left = c->count - from;
    const size_t to = from + (left < CHECK_LAYERS ? left : CHECK_LAYERS);
    for (size_t i = from; i < to; i++) {
        if (!vd_check_layer(&c->layers[i], i, &c->workers[worker].box, NULL)) {
            size_t bad = atomic_load(&c->bad);
            while (i < bad && !atomic_compare_exchange_weak(&c->bad, &bad, i)) {
            }
            return;
        }
    }
}

static vd_status check_def(const vd_coverage_def *def) {
    if (def->method < 0 || def->method >= VD_COVERAGE_METHOD_COUNT) {
        return vd_failure(VD_ERROR_ARGUMENT, "the coverage method %d is unknown", (int)def->method);
    }
    if (!(def->tolerance == 0 || (def->tolerance >= 0x1p-12 && def->tolerance <= 16))) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "the tolerance of curves is %g pixels; give 1/4096 to 16, or 0 for 1/64",
                          def->tolerance);
    }
    return vd_success();
}

/* Checks everything before anything is drawn; *box is where the layers lie. */
static vd_status check_all(const vd_coverage_run *run, vd_box *box) {
    vd_coverage *coverage = run->coverage;
    if (run->layers == NULL && run->count > 0) {
        return vd_failure(VD_ERROR_ARGUMENT, "the layers are null, but there are %zu", run->count);
    }
    if (run->count > (size_t)INT32_MAX) {
        return vd_failure(VD_ERROR_LIMIT, "%zu layers are too many; draw them in parts",
                          run->count);
    }
    vd_status status = check_def(&run->def);
    if (status.code != VD_OK) {
        return status;
    }
    checking c = {.layers = run->layers, .count = run->count, .workers = coverage->workers};
    atomic_store(&c.bad, run->count);
    for (int i = 0; i < coverage->thread_count; i++) {
        coverage->workers[i].box = vd_box_empty();
    }
    const int chunks = (int)((run->count + CHECK_LAYERS - 1) / CHECK_LAYERS);
    status = vd_parallel_for(coverage->context, run->job, chunks, check_chunk, &c);
    const size_t bad = atomic_load(&c.bad);
    *box = vd_box_empty();
    if (status.code == VD_OK && bad < run->count) {
        (void)vd_check_layer(&run->layers[bad], bad, box, &status);
    }
    for (int i = 0; i < coverage->thread_count; i++) {
        vd_box_add(box, &coverage->workers[i].box);
    }
    return status;
}

/* ---- what is drawn into -----------------------------------------------------------------------
 */

static vd_coverage_run make_run(vd_coverage *coverage, vd_job *job, const vd_coverage_def *def,
                                const vd_layer *layers, size_t count) {
    return (vd_coverage_run){.coverage = coverage,
                             .job = job,
                             .def = def != NULL ? *def : vd_coverage_def_default(),
                             .layers = layers,
                             .count = count};
}

/* Whether a window may begin there. */
static bool is_near(int v) {
    return v >= -(1 << 28) && v <= 1 << 28;
}

static vd_status draw_window(vd_coverage_run *run) {
    if (run->coverage == NULL || run->function == NULL) {
        return vd_failure(VD_ERROR_ARGUMENT, "the %s is null",
                          run->coverage == NULL ? "coverage rasterizer" : "function for spans");
    }
    vd_status status = vd_check_size("a window for paths", run->width, run->height);
    if (status.code == VD_OK && (!is_near(run->x) || !is_near(run->y))) {
        status =
            vd_failure(VD_ERROR_LIMIT, "a window for paths cannot lie at (%d, %d)", run->x, run->y);
    }
    vd_box box;
    if (status.code == VD_OK) {
        status = check_all(run, &box);
    }
    return status.code == VD_OK ? draw_layers(run) : status;
}

vd_status vd_coverage_spans(vd_coverage *coverage, vd_job *job, const vd_coverage_def *def,
                            const vd_layer *layers, size_t count, int x, int y, int width,
                            int height, vd_span_function *function, void *user) {
    vd_coverage_run run = make_run(coverage, job, def, layers, count);
    run.x = x;
    run.y = y;
    run.width = width;
    run.height = height;
    run.function = function;
    run.user = user;
    return draw_window(&run);
}

void vd_coverage_blend(const vd_coverage *coverage, const vd_span *span, const uint16_t color[4],
                       uint16_t *pixels) {
    coverage->kernels->blend_color(pixels, span->coverage, color, (size_t)span->count);
}

void vd_coverage_blend_colors(const vd_coverage *coverage, const vd_span *span,
                              const uint16_t (*colors)[4], uint16_t *pixels) {
    coverage->kernels->blend_colors(pixels, span->coverage, colors[0], (size_t)span->count);
}

/* Blends a span into the target of a run. */
static void paint_span(void *user, const vd_span *span) {
    const vd_coverage_run *run = user;
    const uint16_t *color = ((const vd_colored_span *)span)->color;
    const vd_target *target = run->target;
    const size_t at =
        (size_t)(span->y - target->y) * target->stride + (size_t)(span->x - target->x);
    for (int s = 0; s < target->samples; s++) {
        run->coverage->kernels->blend_color(target->color + 4 * (at + (size_t)s * target->plane),
                                            span->coverage, color, (size_t)span->count);
    }
}

static void paint_into(vd_coverage_run *run, vd_target *target) {
    run->x = target->x;
    run->y = target->y;
    run->width = target->width;
    run->height = target->height;
    run->function = paint_span;
    run->user = run;
    run->target = target;
}

vd_status vd_coverage_draw(vd_coverage *coverage, vd_job *job, const vd_coverage_def *def,
                           const vd_layer *layers, size_t count, vd_target *target) {
    if (target == NULL) {
        return vd_failure(VD_ERROR_ARGUMENT, "the target for paths is null");
    }
    vd_coverage_run run = make_run(coverage, job, def, layers, count);
    paint_into(&run, target);
    return draw_window(&run);
}

/* ---- frames -----------------------------------------------------------------------------------
 */

/* The part of a frame that is drawn in, as a target. */
typedef struct canvas {
    vd_target target;
    vd_frame *frame;
} canvas;

static void widen_row(void *user, int row, int worker) {
    (void)worker;
    const canvas *c = user;
    const vd_target *t = &c->target;
    const size_t at = (size_t)(t->y + row) * c->frame->stride + (size_t)t->x;
    const uint8_t *from = c->frame->rgba + 4 * at;
    uint16_t *to = t->color + 4 * (size_t)row * t->stride;
    for (size_t i = 0; i < 4 * (size_t)t->width; i++) {
        to[i] = (uint16_t)(from[i] * 257);
    }
}

static void narrow_row(void *user, int row, int worker) {
    (void)worker;
    const canvas *c = user;
    const vd_target *t = &c->target;
    const size_t at = (size_t)(t->y + row) * c->frame->stride + (size_t)t->x;
    vd_image_kernels_for(vd_context_isa(t->context))
        ->resolve_color(c->frame->rgba + 4 * at, t->color + 4 * (size_t)row * t->stride, 0, 1,
                        4 * (size_t)t->width);
}

/* From pixel *first to *last − 1 of `size`. */
static void find_pixels(double low, double high, int size, int *first, int *last) {
    *first = low < 0 ? 0 : low < size ? (int)low : size;
    *last = high < 0 ? 0 : high < size ? (int)high + 1 : size;
    *last = *last < size ? *last : size;
}

static vd_status draw_canvas(vd_coverage_run *run, vd_frame *frame, const vd_box *box) {
    vd_coverage *coverage = run->coverage;
    int x0, x1, y0, y1;
    find_pixels(box->min_x, box->max_x, frame->width, &x0, &x1);
    find_pixels(box->min_y, box->max_y, frame->height, &y0, &y1);
    if (x0 >= x1 || y0 >= y1) {
        return vd_success();
    }
    const size_t stride = vd_frame_stride(x1 - x0), rows = (size_t)(y1 - y0);
    vd_status status = vd_buffer_reserve(coverage->context, &coverage->canvas_memory,
                                         "a frame in 16 bits", stride * rows, 4 * sizeof(uint16_t));
    if (status.code != VD_OK) {
        return status;
    }
    canvas c = {{.context = coverage->context,
                 .x = x0,
                 .y = y0,
                 .width = x1 - x0,
                 .height = y1 - y0,
                 .samples = 1,
                 .stride = stride,
                 .plane = stride * rows,
                 .color = coverage->canvas_memory.memory},
                frame};
    paint_into(run, &c.target);
    status = vd_parallel_for(coverage->context, NULL, c.target.height, widen_row, &c);
    if (status.code == VD_OK) {
        status = draw_layers(run);
    }
    if (status.code == VD_OK) {
        status = vd_parallel_for(coverage->context, NULL, c.target.height, narrow_row, &c);
    }
    return status;
}

vd_status vd_coverage_draw_frame(vd_coverage *coverage, vd_job *job, const vd_coverage_def *def,
                                 const vd_layer *layers, size_t count, vd_frame *frame) {
    if (coverage == NULL || frame == NULL) {
        return vd_failure(VD_ERROR_ARGUMENT, "the %s is null",
                          coverage == NULL ? "coverage rasterizer" : "frame for paths");
    }
    vd_coverage_run run = make_run(coverage, job, def, layers, count);
    vd_box box;
    vd_status status = check_all(&run, &box);
    return status.code == VD_OK ? draw_canvas(&run, frame, &box) : status;
}

/* ---- the seam ---------------------------------------------------------------------------------
 */

void vd_coverage_divide(vd_target *target) {
    for (int s = 0; s < target->samples; s++) {
        for (int y = 0; y < target->height; y++) {
            uint16_t *row =
                target->color + 4 * ((size_t)s * target->plane + (size_t)y * target->stride);
            for (uint16_t *p = row; p < row + 4 * (size_t)target->width; p += 4) {
                const uint32_t alpha = p[3];
                for (int c = 0; c < 4 && alpha > 0 && alpha < 65535; c++) {
                    const uint32_t v = (p[c] * 65535u + alpha / 2) / alpha;
                    p[c] = (uint16_t)(v < 65535 ? v : 65535);
                }
            }
        }
    }
}

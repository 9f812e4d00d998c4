/* function.c: the life of a function, its evaluation, and sampling it into a heightfield. */
#include <math.h>
#include <string.h>
#include "core/core.h"
#include "terrain/function_kernels.h"

vd_status vd_function_compile(vd_context *context, const char *text, vd_function **out) {
    if (context == NULL || text == NULL || out == NULL) {
        return vd_failure(VD_ERROR_ARGUMENT, "vd_function_compile: no argument may be null");
    }
    const size_t size = strlen(text);
    if (size > VD_FUNCTION_MAX_BYTES) {
        return vd_failure(VD_ERROR_LIMIT, "the function has %zu bytes, more than the %d allowed",
                          size, VD_FUNCTION_MAX_BYTES);
    }
    vd_function_builder *builder = vd_allocate(context, 1, sizeof *builder);
    if (builder == NULL) {
        return vd_out_of_memory("compiling a function", sizeof *builder);
    }
    vd_function_builder_init(builder);
    int h = 0, rgb[3] = {0, 0, 0};
    bool has_color = false;
    vd_status status = vd_function_parse(text, size, builder, &h, rgb, &has_color);
    if (status.code == VD_OK) {
        status = vd_function_emit(context, builder, h, has_color ? rgb : NULL, out);
    }
    vd_release(context, builder);
    return status;
}

vd_status vd_function_from_callback(vd_context *context, const vd_function_callback_def *def,
                                    vd_function **out) {
    if (context == NULL || def == NULL || out == NULL || def->evaluate == NULL) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "vd_function_from_callback: no argument may be null, nor def->evaluate");
    }
    vd_function *f = vd_allocate_zero(context, 1, sizeof *f);
    if (f == NULL) {
        return vd_out_of_memory("a function", sizeof *f);
    }
    f->size_bytes = sizeof *f;
    f->constants_offset = f->steps_offset = sizeof *f;
    f->has_color = def->has_color;
    f->callback = def->evaluate;
    f->bounds_callback = def->bounds;
    f->user = def->user;
    *out = f;
    return vd_success();
}

void vd_function_destroy(vd_context *context, vd_function **function) {
    if (function != NULL && *function != NULL) {
        vd_release(context, *function);
        *function = NULL;
    }
}

bool vd_function_has_color(const vd_function *function) {
    return function->has_color != 0;
}

/* A caller's function gets whole, aligned batches; what is left over repeats the last point. */
static void evaluate_callback(const vd_function *f, size_t count, const float *x, const float *y,
                              float *h, float *const rgb[3]) {
    _Alignas(64) float in[2][VD_FUNCTION_LANES], out[4][VD_FUNCTION_LANES];
    const bool color = f->has_color && rgb != NULL;
    for (size_t at = 0; at < count; at += VD_FUNCTION_LANES) {
        const size_t left = count - at < VD_FUNCTION_LANES ? count - at : VD_FUNCTION_LANES;
        for (size_t i = 0; i < VD_FUNCTION_LANES; i++) {
            in[0][i] = x[at + (i < left ? i : left - 1)];
            in[1][i] = y[at + (i < left ? i : left - 1)];
            out[1][i] = out[2][i] = out[3][i] = 1.0f;
        }
        f->callback(f->user, in[0], in[1], out[0], color ? out[1] : NULL, color ? out[2] : NULL,
                    color ? out[3] : NULL);
        for (size_t i = 0; i < left; i++) {
            h[at + i] = fabsf(out[0][i]) < INFINITY ? out[0][i] : -INFINITY;
            for (int k = 0; rgb != NULL && k < 3; k++) {
                const float v = out[1 + k][i] > 0.0f ? out[1 + k][i] : 0.0f;
                rgb[k][at + i] = v < 1.0f ? v : 1.0f;
            }
        }
    }
}

void vd_function_evaluate(const vd_function *function, size_t count, const float *x, const float *y,
                          float *h, float *const rgb[3]) {
    if (function->callback != NULL) {
        evaluate_callback(function, count, x, y, h, rgb);
    } else {
        vd_function_kernels_for((vd_isa)function->isa)->evaluate(function, count, x, y, h, rgb);
    }
}

/* ---- sampling ---------------------------------------------------------------------------------
 */

#define CHUNK 256 /* samples a call: 6 KiB of stack, and loading the constants no longer counts */

typedef struct sampling {
    const vd_function *function;
    const vd_function_grid *grid;
    float *heights;
    vd_picture *colors; /* null: none */
} sampling;

static uint8_t to_byte(float v) {
    return (uint8_t)(v * 255.0f + 0.5f);
}

static void sample_row(void *user, int row, int worker) {
    const sampling *s = user;
    const vd_function_grid *grid = s->grid;
    float x[CHUNK], y[CHUNK], color[3][CHUNK];
    float *const planes[3] = {color[0], color[1], color[2]};
    (void)worker;
    const float row_y = (float)(grid->y0 - row * grid->cell);
    for (int first = 0; first < grid->width; first += CHUNK) {
        const int count = grid->width - first < CHUNK ? grid->width - first : CHUNK;
        for (int i = 0; i < count; i++) {
            x[i] = (float)(grid->x0 + (first + i) * grid->cell);
            y[i] = row_y;
        }
        vd_function_evaluate(s->function, (size_t)count, x, y,
                             s->heights + (size_t)row * (size_t)grid->width + first,
                             s->colors != NULL ? planes : NULL);
        if (s->colors != NULL) {
            uint8_t *to = (uint8_t *)s->colors->data + (size_t)row * s->colors->stride_bytes +
                          3 * (size_t)first;
            for (int i = 0; i < count; i++) {
                to[3 * i] = to_byte(color[0][i]);
                to[3 * i + 1] = to_byte(color[1][i]);
                to[3 * i + 2] = to_byte(color[2][i]);
            }
        }
    }
}

static vd_status check_grid(const vd_function_grid *grid) {
    if (grid->width < 1 || grid->height < 1) {
        return vd_failure(VD_ERROR_ARGUMENT, "the grid of %d × %d samples must be at least 1 × 1",
                          grid->width, grid->height);
    }
    if (grid->width > VD_MAX_SIDE || grid->height > VD_MAX_SIDE ||
        (size_t)grid->width * (size_t)grid->height > VD_MAX_PIXELS) {
        return vd_failure(
            VD_ERROR_LIMIT,
            "the grid of %d × %d samples is more than a heightfield takes (%d a side)", grid->width,
            grid->height, VD_MAX_SIDE);
    }
    if (!isfinite(grid->x0) || !isfinite(grid->y0)) {
        return vd_failure(VD_ERROR_ARGUMENT, "the grid's x0 and y0 must be finite");
    }
    if (!(grid->cell > 0.0) || !isfinite(grid->cell)) {
        return vd_failure(VD_ERROR_ARGUMENT, "the grid's cell must be above 0 and finite");
    }
    return vd_success();
}

vd_status vd_function_heightfield(vd_context *context, vd_job *job, const vd_function *function,
                                  const vd_function_grid *grid, vd_heightfield **out) {
    if (context == NULL || function == NULL || grid == NULL || out == NULL) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "vd_function_heightfield: no argument but job may be null");
    }
    vd_status status = check_grid(grid);
    if (status.code != VD_OK) {
        return status;
    }
    sampling s = {function, grid, NULL, NULL};
    const size_t samples = (size_t)grid->width * (size_t)grid->height;
    s.heights = vd_allocate(context, samples, sizeof *s.heights);
    if (s.heights == NULL) {
        return vd_out_of_memory("the samples of a function", samples * sizeof *s.heights);
    }
    if (vd_function_has_color(function)) {
        status = vd_picture_create(context, grid->width, grid->height, 3, 8, &s.colors);
    }
    if (status.code == VD_OK) {
        status = vd_parallel_for(context, job, grid->height, sample_row, &s);
    }
    if (status.code == VD_OK) {
        vd_heightfield_def def = vd_heightfield_def_default();
        const double world[6] = {grid->x0, grid->cell, 0.0, grid->y0, 0.0, -grid->cell};
        def.width = grid->width;
        def.height = grid->height;
        def.heights = s.heights;
        def.height_stride = (size_t)grid->width;
        def.colors = s.colors;
        memcpy(def.world_from_sample, world, sizeof world);
        status = vd_heightfield_create(context, &def, out);
    }
    vd_picture_destroy(&s.colors);
    vd_release(context, s.heights);
    return status;
}

/* raster_reference.c: the pipeline behind the vertices, as plainly as it can be said. */
#include <math.h>
#include <string.h>
#include "raster/raster_internal.h"

/* ---- coverage and depth -----------------------------------------------------------------------*/

/* The edge function (Pineda 1988) of edge i at a sample; positive inside. */
static int64_t edge_value(const vd_setup *s, int i, int64_t x, int64_t y) {
    const int j = (i + 1) % 3;
    const int64_t dx = (int64_t)s->x[j] - s->x[i], dy = (int64_t)s->y[j] - s->y[i];
    return dx * (y - s->y[i]) - dy * (x - s->x[i]);
}

/* A sample on an edge belongs to the triangle if it is its left or top edge. */
static bool is_top_left(const vd_setup *s, int i) {
    const int j = (i + 1) % 3;
    return s->y[j] < s->y[i] || (s->y[j] == s->y[i] && s->x[j] > s->x[i]);
}

static bool covers(const vd_setup *s, int32_t x, int32_t y) {
    for (int i = 0; i < 3; i++) {
        const int64_t value = edge_value(s, i, x, y);
        if (value < 0 || (value == 0 && !is_top_left(s, i))) {
            return false;
        }
    }
    return true;
}

static float depth_at(const vd_setup *s, int32_t x, int32_t y) {
    const float dx = (float)(x - s->x[0]), dy = (float)(y - s->y[0]);
    float z = s->z0 + (dx * s->dz_dx + dy * s->dz_dy);
    z = z > s->z_min ? z : s->z_min; /* what is not a number too */
    return z < s->z_max ? z : s->z_max;
}

/* The pixels first … last on one axis that can have a sample in the triangle. */
static void pixel_range(const int32_t v[3], int low, int count, int *first, int *last) {
    int32_t min = v[0], max = v[0];
    for (int i = 1; i < 3; i++) {
        min = v[i] < min ? v[i] : min;
        max = v[i] > max ? v[i] : max;
    }
    /* A sample is up to half a pixel from its pixel's centre. */
    *first = (min - VD_SUBPIXELS) / VD_SUBPIXELS - 1;
    *last = (max + VD_SUBPIXELS) / VD_SUBPIXELS + 1;
    *first = *first > low ? *first : low;
    *last = *last < low + count - 1 ? *last : low + count - 1;
}

/* ---- shading ----------------------------------------------------------------------------------*/

const vd_drawing *vd_scene_drawing(const vd_scene *scene, uint32_t id) {
    int low = 0, high = scene->drawing_count;
    while (high - low > 1) { /* the last draw that begins at or before the id */
        const int middle = (low + high) / 2;
        if (scene->drawings[middle].first_id <= id) {
            low = middle;
        } else {
            high = middle;
        }
    }
    return &scene->drawings[low];
}

/* Encoded, straight 0 … 1 to 16 bits, premultiplied in encoded space. */
static void store_color(const vd_batch *batch, int lane, uint16_t out[4]) {
    const uint32_t alpha = (uint32_t)(batch->color[3][lane] * 65535.0f + 0.5f);
    for (int c = 0; c < 3; c++) {
        const uint32_t v = (uint32_t)(batch->color[c][lane] * 65535.0f + 0.5f);
        out[c] = (uint16_t)((v * alpha + 32767u) / 65535u);
    }
    out[3] = (uint16_t)alpha;
}

/* Runs one fragment in lane 0; returns its material. */
static const vd_material *run_one(const vd_drawing *drawing, uint32_t primitive, float depth,
                                  int32_t x, int32_t y, vd_batch *batch) {
    for (int lane = 0; lane < VD_BATCH; lane++) { /* some valid numbers in all lanes */
        vd_interpolate(drawing, primitive, x, y, lane, batch);
        batch->depth[lane] = depth;
    }
    const vd_material *material = vd_drawing_material(drawing, primitive);
    vd_batch_run(drawing, material, 1, batch);
    return material;
}

static void shade_one(const vd_scene *scene, uint32_t id, float depth, int32_t x, int32_t y,
                      vd_batch *batch, uint16_t out[4]) {
    const vd_drawing *drawing = vd_scene_drawing(scene, id);
    const uint32_t primitive = id - drawing->first_id;
    if (drawing->fragment == NULL) {
        return;
    }
    const vd_material *material = run_one(drawing, primitive, depth, x, y, batch);
    if (vd_material_kind(material) == VD_KIND_TESTED) {
        batch->color[3][0] = 1.0f;
    }
    store_color(batch, 0, out);
}

/* A pixel all of whose samples show one primitive is shaded once, at its centre, at the mean of
 * their depths (their mean position is the centre); else every sample for itself. */
static bool is_one(const vd_visible *visible, size_t at, float *depth) {
    float sum = visible->depth[at];
    for (int s = 1; s < visible->samples; s++) {
        const size_t other = (size_t)s * visible->plane + at;
        if (visible->id[other] != visible->id[at]) {
            return false;
        }
        sum = sum + visible->depth[other];
    }
    *depth = sum / (float)visible->samples;
    return true;
}

static void shade_pixel(const vd_scene *scene, const vd_visible *visible, int x, int y,
                        vd_target *target, vd_batch *batch) {
    const size_t at = (size_t)y * visible->stride + (size_t)x;
    const size_t to = (size_t)y * target->stride + (size_t)x;
    float mean = 0.0f;
    const bool one = is_one(visible, at, &mean);
    const int32_t px = (visible->x + x) * VD_SUBPIXELS, py = (visible->y + y) * VD_SUBPIXELS;
    for (int s = 0; s < visible->samples; s++) {
        const size_t from = (size_t)s * visible->plane + at;
        const size_t out = (size_t)s * target->plane + to;
        const uint32_t id = visible->id[from];
        if (id == 0) {
            continue;
        }
        target->depth[out] = visible->depth[from];
        target->id[out] = vd_scene_drawing(scene, id)->frame_id;
        int32_t shift_x = 0, shift_y = 0;
        if (!one) {
            vd_sample_shift(visible->samples, s, &shift_x, &shift_y);
        } else if (s > 0) {
            memcpy(target->color + 4 * out, target->color + 4 * to, 8);
            continue;
        }
        shade_one(scene, id, one ? mean : visible->depth[from], px + shift_x, py + shift_y, batch,
                  target->color + 4 * out);
    }
}

void vd_reference_shade(const vd_scene *scene, const vd_visible *visible, vd_target *target,
                        vd_batch *batch) {
    for (int y = 0; y < visible->height; y++) {
        for (int x = 0; x < visible->width; x++) {
            shade_pixel(scene, visible, x, y, target, batch);
        }
    }
}

/* ---- visibility -------------------------------------------------------------------------------*/

/* What is done with a sample that a triangle covers. */
typedef struct cover_run cover_run;
typedef void cover_function(const cover_run *run, uint32_t id, float z, int32_t x, int32_t y,
                            size_t at);

struct cover_run {
    const vd_drawing *drawing;
    cover_function *function;
    int x, y, width, height, samples; /* the window's */
    size_t stride, plane;
    vd_kind kind;
    vd_batch *batch;
    vd_visible *visible;
    vd_target *target;
};

/* Goes over all samples of a triangle, pixel by pixel, in 64 bits. */
static void cover(void *user, const vd_setup *setup) {
    const cover_run *run = user;
    int x0, x1, y0, y1;
    pixel_range(setup->x, run->x, run->width, &x0, &x1);
    pixel_range(setup->y, run->y, run->height, &y0, &y1);
    for (int s = 0; s < run->samples; s++) {
        int32_t shift_x, shift_y;
        vd_sample_shift(run->samples, s, &shift_x, &shift_y);
        for (int y = y0; y <= y1; y++) {
            for (int x = x0; x <= x1; x++) {
                const int32_t sx = x * VD_SUBPIXELS + shift_x, sy = y * VD_SUBPIXELS + shift_y;
                if (covers(setup, sx, sy)) {
                    run->function(run, setup->id, depth_at(setup, sx, sy), sx, sy,
                                  (size_t)s * run->plane + (size_t)(y - run->y) * run->stride +
                                      (size_t)(x - run->x));
                }
            }
        }
    }
}

/* Goes over all samples of all primitives of a scene that are of the run's kind. */
static void cover_all(const vd_scene *scene, cover_run *run) {
    for (int i = 0; i < scene->drawing_count; i++) {
        run->drawing = &scene->drawings[i];
        for (uint32_t p = 0, end; p < run->drawing->primitive_count; p++) {
            if (vd_drawing_kind(run->drawing, p, &end) == run->kind) {
                vd_assemble(run->drawing, p, cover, run);
            }
        }
    }
}

static void see(const cover_run *run, uint32_t id, float z, int32_t x, int32_t y, size_t at) {
    vd_visible *visible = run->visible;
    if (!(z > visible->depth[at] || (z == visible->depth[at] && id < visible->id[at]))) {
        return;
    }
    if (run->kind == VD_KIND_TESTED) {
        const vd_material *material =
            run_one(run->drawing, id - run->drawing->first_id, z, x, y, run->batch);
        if (!(run->batch->color[3][0] >= material->alpha_test)) {
            return;
        }
    }
    visible->depth[at] = z;
    visible->id[at] = id;
}

void vd_reference_visibility(const vd_scene *scene, vd_visible *visible, vd_batch *batch) {
    cover_run run = {.function = see,
                     .x = visible->x,
                     .y = visible->y,
                     .width = visible->width,
                     .height = visible->height,
                     .samples = visible->samples,
                     .stride = visible->stride,
                     .plane = visible->plane,
                     .batch = batch,
                     .visible = visible};
    for (int kind = VD_KIND_SOLID; kind <= VD_KIND_TESTED; kind++) {
        run.kind = (vd_kind)kind;
        cover_all(scene, &run);
    }
}

static void add_blended(const cover_run *run, uint32_t id, float z, int32_t x, int32_t y,
                        size_t at) {
    const vd_drawing *drawing = run->drawing;
    uint16_t color[4];
    if (drawing->fragment == NULL) {
        return;
    }
    const vd_material *material = run_one(drawing, id - drawing->first_id, z, x, y, run->batch);
    store_color(run->batch, 0, color);
    if (run->batch->color[3][0] >= material->alpha_test && color[3] > 0) {
        vd_target_add_blended(run->target, at, z, vd_blended_order(drawing, id), color);
    }
}

void vd_reference_blend(const vd_scene *scene, vd_target *target, vd_batch *batch) {
    cover_run run = {.function = add_blended,
                     .x = target->x,
                     .y = target->y,
                     .width = target->width,
                     .height = target->height,
                     .samples = target->samples,
                     .stride = target->stride,
                     .plane = target->plane,
                     .kind = VD_KIND_BLENDED,
                     .batch = batch,
                     .target = target};
    cover_all(scene, &run);
}

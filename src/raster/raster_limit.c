/* raster_limit.c: draws that would cover too many pixels are left out.
 *
 * Whoever draws what others have sent cannot tell from counts how long it takes: a million
 * triangles may each fill the picture. The boxes around projected primitives are an upper bound of
 * what is filled; adding them up takes a small part of the time that sorting takes.
 */
#include "raster/raster_run.h"

#define PRIMITIVES_A_TASK 4096

/* A pixel of what is tested is shaded for its alpha, of what blends for its colour, at every
 * sample; the latter is sorted too. In WebAssembly, 4 samples: 5, 185 and 135 ns. */
static const uint64_t weights[VD_KIND_COUNT] = {
    [VD_KIND_SOLID] = 1, [VD_KIND_TESTED] = 16, [VD_KIND_BLENDED] = 32};

typedef struct limit_run {
    vd_raster *raster;
    const vd_drawing *drawing;
} limit_run;

/* A sum of pixels of a picture. */
typedef struct covering {
    int width, height;
    uint64_t pixels;
} covering;

/* Pixels of a side of `pixels` between two places in subpixels. */
static uint64_t pixels_between(int32_t low, int32_t high, int pixels) {
    const int32_t first = -VD_SUBPIXELS / 2, last = VD_SUBPIXELS * pixels - VD_SUBPIXELS / 2;
    low = low < first ? first : low;
    high = high > last ? last : high;
    return low > high ? 0 : (uint64_t)((high - low) / VD_SUBPIXELS) + 1;
}

static void cover(covering *c, const int32_t x[3], const int32_t y[3]) {
    int32_t low[2] = {x[0], y[0]}, high[2] = {x[0], y[0]};
    for (int i = 1; i < 3; i++) {
        low[0] = x[i] < low[0] ? x[i] : low[0];
        low[1] = y[i] < low[1] ? y[i] : low[1];
        high[0] = x[i] > high[0] ? x[i] : high[0];
        high[1] = y[i] > high[1] ? y[i] : high[1];
    }
    c->pixels +=
        pixels_between(low[0], high[0], c->width) * pixels_between(low[1], high[1], c->height);
}

static void cover_setup(void *user, const vd_setup *setup) {
    cover(user, setup->x, setup->y);
}

/* The short way, where all corners have a place in the picture. */
static bool cover_triangle(const vd_drawing *drawing, uint32_t primitive, covering *c) {
    const uint32_t *corners = vd_mesh_indices(drawing->mesh) + 3 * (size_t)primitive;
    int32_t x[3], y[3];
    for (int i = 0; i < 3; i++) {
        const vd_vertex *v = &drawing->vertices[corners[i]];
        if (v->x < VD_FLAGGED) {
            return false;
        }
        x[i] = v->x;
        y[i] = v->y;
    }
    const int64_t area =
        (int64_t)(x[1] - x[0]) * (y[2] - y[0]) - (int64_t)(x[2] - x[0]) * (y[1] - y[0]);
    if (area > 0 ? drawing->keep_clockwise : area < 0 && drawing->keep_counter_clockwise) {
        cover(c, x, y);
    }
    return true;
}

static void measure_some(void *user, int index, int worker) {
    const limit_run *run = user;
    const vd_drawing *drawing = run->drawing;
    const vd_scene *scene = &run->raster->scene;
    uint32_t at = (uint32_t)index * PRIMITIVES_A_TASK;
    const uint32_t left = drawing->primitive_count - at;
    const uint32_t end = at + (left < PRIMITIVES_A_TASK ? left : PRIMITIVES_A_TASK);
    while (at < end) {
        uint32_t run_end;
        covering c = {scene->width, scene->height, 0};
        const vd_kind kind = vd_drawing_kind(drawing, at, &run_end);
        for (run_end = run_end < end ? run_end : end; at < run_end; at++) {
            if (drawing->topology != VD_TOPOLOGY_TRIANGLES || !cover_triangle(drawing, at, &c)) {
                (void)vd_assemble(drawing, at, cover_setup, &c);
            }
        }
        run->raster->workers[worker].covered += weights[kind] * c.pixels;
    }
}

vd_status vd_raster_limit(vd_raster *raster, vd_job *job, uint64_t most) {
    vd_status status = vd_success();
    raster->covered = 0;
    raster->left_out = 0;
    for (int i = 0; i < raster->scene.drawing_count && most > 0 && status.code == VD_OK; i++) {
        vd_drawing *drawing = &raster->scene.drawings[i];
        limit_run run = {raster, drawing};
        for (int w = 0; w < raster->thread_count; w++) {
            raster->workers[w].covered = 0;
        }
        const uint64_t tasks =
            ((uint64_t)drawing->primitive_count + PRIMITIVES_A_TASK - 1) / PRIMITIVES_A_TASK;
        status = vd_parallel_for(raster->context, job, (int)tasks, measure_some, &run);
        for (int w = 0; w < raster->thread_count; w++) {
            raster->covered += raster->workers[w].covered;
        }
        if (raster->covered > most) { /* it has ids still, and no primitive */
            drawing->primitive_count = 0;
            raster->left_out++;
        }
    }
    return status;
}

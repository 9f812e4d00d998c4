/* raster_methods.c: the methods, and which of them draws a picture. */
#include <string.h>
#include "raster/raster_run.h"

static void clear_window(vd_visible *visible) {
    for (int s = 0; s < visible->samples; s++) {
        const size_t at = (size_t)s * visible->plane;
        memset(visible->depth + at, 0, visible->plane * sizeof *visible->depth);
        memset(visible->id + at, 0, visible->plane * sizeof *visible->id);
    }
}

static void see_reference(vd_raster *raster, vd_worker *worker, int x, int y) {
    (void)x;
    (void)y;
    clear_window(&worker->visible);
    vd_reference_visibility(&raster->scene, &worker->visible);
}

static const vd_method reference = {NULL, see_reference, 256};

void vd_worker_finish(vd_context *context, vd_worker *worker) {
    vd_release(context, worker->depth.memory);
    vd_release(context, worker->id.memory);
    vd_release(context, worker->batch);
    vd_target_destroy(&worker->target);
}

static vd_status worker_prepare(vd_raster *raster, vd_worker *worker) {
    vd_context *context = raster->context;
    vd_visible *visible = &worker->visible;
    const int tile = raster->tile, samples = raster->scene.samples;
    visible->samples = samples;
    visible->stride = (size_t)tile;
    visible->plane = (size_t)tile * (size_t)tile;
    const size_t count = visible->plane * (size_t)samples;
    vd_status status = vd_buffer_reserve(context, &worker->depth, "a tile", count, sizeof(float));
    if (status.code == VD_OK) {
        status = vd_buffer_reserve(context, &worker->id, "a tile", count, sizeof(uint32_t));
    }
    if (status.code != VD_OK) {
        return status;
    }
    visible->depth = worker->depth.memory;
    visible->id = worker->id.memory;
    if (worker->batch == NULL) {
        worker->batch = vd_allocate_zero(context, 1, sizeof *worker->batch);
        if (worker->batch == NULL) {
            return vd_out_of_memory("a batch of fragments", sizeof *worker->batch);
        }
    }
    if (worker->target != NULL && (worker->target->samples != samples ||
                                   worker->target->plane < vd_frame_stride(tile) * (size_t)tile)) {
        vd_target_destroy(&worker->target);
    }
    if (worker->target == NULL) {
        status = vd_target_create(context, tile, tile, samples, &worker->target);
    }
    return status;
}

vd_status vd_raster_choose(vd_raster *raster, const vd_raster_def *def) {
    raster->method = &reference;
    raster->project = vd_project_reference;
    raster->shade = vd_reference_shade;
    raster->tile = def->tile_pixels > 0 ? def->tile_pixels : raster->method->tile;
    raster->tiles_x = (raster->scene.width + raster->tile - 1) / raster->tile;
    raster->tiles_y = (raster->scene.height + raster->tile - 1) / raster->tile;
    vd_status status = vd_success();
    for (int i = 0; i < raster->thread_count && status.code == VD_OK; i++) {
        status = worker_prepare(raster, &raster->workers[i]);
    }
    return status;
}

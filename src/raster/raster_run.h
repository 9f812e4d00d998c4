/* raster_run.h: the renderer's state, and what a method is. */
#ifndef VEDUTA_RASTER_RASTER_RUN_H
#define VEDUTA_RASTER_RASTER_RUN_H

#include "raster/raster_internal.h"

/* Memory that only grows. */
typedef struct vd_buffer {
    void *memory;
    size_t bytes;
} vd_buffer;

/* Makes room for count × size_bytes; contents are lost when it grows. */
VD_MUST_USE vd_status vd_buffer_reserve(vd_context *context, vd_buffer *buffer, const char *what,
                                        size_t count, size_t size_bytes);

typedef struct vd_slot {
    vd_buffer vertices, written, user;
} vd_slot;

/* What one thread draws with. */
typedef struct vd_worker {
    vd_visible visible; /* a tile */
    vd_buffer depth, id;
    vd_target *target; /* a tile */
    vd_batch *batch;
    uint64_t hits, clipped, drawn;
} vd_worker;

void vd_worker_finish(vd_context *context, vd_worker *worker);

/* A way from projected vertices to the visibility buffer of a tile. */
typedef struct vd_method {
    /* Does what concerns the whole picture; null: nothing. */
    vd_status (*sort)(vd_raster *raster, vd_job *job);
    /* Fills the worker's window, which lies on tile (x, y), completely. */
    void (*see)(vd_raster *raster, vd_worker *worker, int x, int y);
    int tile; /* pixels a side when the definition does not say */
} vd_method;

struct vd_raster {
    vd_context *context;
    int thread_count;
    vd_worker *workers; /* [thread_count] */
    vd_slot *slots;     /* [slot_count], by draw */
    int slot_count;
    vd_buffer drawings;
    vd_scene scene;
    uint64_t primitives;
    const vd_method *method;
    vd_kernel_project *project;
    vd_kernel_shade *shade;
    int tile, tiles_x, tiles_y;
    vd_frame *frame;
    bool prepared;
};

/* Chooses method, kernels and tile size for the scene, and makes room for the workers. */
VD_MUST_USE vd_status vd_raster_choose(vd_raster *raster, const vd_raster_def *def);

void vd_project_reference(const vd_drawing *drawing, uint32_t first, uint32_t count);

#endif

/* raster_run.h: the renderer's state, and what a method is. */
#ifndef VEDUTA_RASTER_RASTER_RUN_H
#define VEDUTA_RASTER_RASTER_RUN_H

#include "core/buffer.h"
#include "raster/raster_kernels.h"

typedef struct vd_slot {
    vd_buffer vertices, written, user;
} vd_slot;

/* What one thread draws with. */
typedef struct vd_worker {
    vd_visible visible; /* a tile */
    vd_buffer depth, id;
    vd_target *target; /* a tile */
    vd_batch *batch;
    vd_pending *pending;
    struct vd_immediate *immediate; /* null until the method is used */
    /* What this thread sorted: lists by tile, and a window of the whole picture of its own, which
     * is all 0 where `touched` is. */
    vd_sorter sorter;
    vd_buffer blocks, links, touched, window_depth, window_id;
    vd_visible window;
    int window_tile; /* the tile size that `touched` counts in */
    uint64_t hits;
    uint64_t covered; /* pixels, in raster_limit.c */
} vd_worker;

void vd_worker_finish(vd_context *context, vd_worker *worker);

/* A way from projected vertices to the visibility buffer of a tile. */
typedef struct vd_method {
    /* Sorts primitives first … first + count of a drawing; null: nothing is sorted. */
    void (*sort)(vd_raster *raster, vd_worker *worker, const vd_drawing *drawing, uint32_t first,
                 uint32_t count);
    /* Adds what was not sorted to the worker's window, which lies on tile (x, y); null: nothing. */
    void (*see)(vd_raster *raster, vd_worker *worker);
    bool windows; /* every worker has a window of the whole picture */
} vd_method;

struct vd_raster {
    vd_context *context;
    int thread_count;
    vd_worker *workers; /* [thread_count] */
    vd_slot *slots;     /* [slot_count], by draw */
    int slot_count;
    vd_buffer drawings, order;
    vd_scene scene;
    uint64_t primitives;
    uint64_t covered; /* pixels of the boxes around them; 0: not asked for */
    int left_out;     /* draws */
    int most_passes;  /* of what blends */
    const vd_method *method;
    const vd_raster_kernels *kernels;
    int bin, fine, tile, tiles_x, tiles_y;
    vd_frame *frame;
    bool stream; /* the frame is too large for the caches: store past them */
    bool prepared;
    bool bare; /* the picture is made of depths alone */
};

/* Leaves draws out, from the one on that covers more than `most` together with those before it.
 * most 0: none. */
VD_MUST_USE vd_status vd_raster_limit(vd_raster *raster, vd_job *job, uint64_t most);

/* Sorts all primitives of the scene. */
VD_MUST_USE vd_status vd_raster_sort(vd_raster *raster, vd_job *job);

/* Places the worker's window over tile (x, y), in tiles. */
void vd_raster_place(vd_raster *raster, vd_worker *worker, int x, int y);

/* Whether no triangle was sorted to a tile. */
bool vd_raster_is_empty(const vd_raster *raster, int x, int y);

/* Fills the worker's tile at (x, y), in tiles: depth and id. */
void vd_raster_see(vd_raster *raster, vd_worker *worker, int x, int y);

/* Whether something that blends was sorted to the tile. */
bool vd_raster_blends(const vd_raster *raster, int x, int y);

/* Whether anything was sorted to the raster's tiles under a window of the picture, and whether
 * something of it blends. */
bool vd_raster_window_any(const vd_raster *raster, const vd_target *window, bool *blends);

/* Adds what blends in tile (x, y), in tiles, to a target's list; the target's window lies within
 * the tile. */
void vd_raster_add_blended(vd_raster *raster, vd_worker *worker, vd_target *target, int x, int y);

/* Gives back what the workers' windows have on a tile. */
void vd_raster_forget(vd_raster *raster, int x, int y);

/* Chooses method, kernels and tile size for the scene, and makes room for the workers. */
VD_MUST_USE vd_status vd_raster_choose(vd_raster *raster, const vd_raster_def *def);

#endif

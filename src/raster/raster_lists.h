/* raster_lists.h: which triangles touch which tile.
 *
 * Every worker has lists of its own for all tiles: chains of blocks, newest first, from memory that
 * is kept from frame to frame. The order within a tile does not matter (see raster_internal.h), so
 * nothing is ever sorted or merged.
 */
#ifndef VEDUTA_RASTER_RASTER_LISTS_H
#define VEDUTA_RASTER_RASTER_LISTS_H

#include "raster/raster_internal.h"

#define VD_BLOCK_ENTRIES 64

/* Small triangles by the sides of their boxes: up to 2, up to 4, more pixels. Filling likes its
 * vectors alike. */
#define VD_CLASSES 3

/* Small triangles of one drawing and class, by number. */
typedef struct vd_block {
    struct vd_block *next;
    const vd_drawing *drawing;
    int count;
    uint32_t primitives[VD_BLOCK_ENTRIES];
} vd_block;

#define VD_LINK_ENTRIES 14

/* Triangles that are set up. */
typedef struct vd_link {
    struct vd_link *next;
    int count;
    const vd_setup *setups[VD_LINK_ENTRIES];
} vd_link;

/* Memory in slabs that stays where it is; all of it is given back at once. */
typedef struct vd_arena {
    vd_context *context;
    uint8_t **slabs;
    size_t slab_count, slab_capacity;
    size_t slab, used; /* where the next piece comes from */
    bool failed;       /* memory ran out; what was asked for since is one shared piece */
} vd_arena;

#define VD_ARENA_PIECE_MAX 4096
void *vd_arena_take(vd_arena *arena, size_t size_bytes);
void vd_arena_reset(vd_arena *arena);
void vd_arena_finish(vd_arena *arena);

/* Where one worker sorts triangles to. */
typedef struct vd_sorter {
    vd_arena arena;
    vd_block **blocks; /* [tiles][VD_CLASSES], never null: a full block where there is nothing */
    vd_link **links;   /* [tiles][VD_KIND_COUNT] */
    vd_kind kind;      /* of what vd_sorter_add_primitive adds */
    int tile_shift;    /* log2 of a tile's pixels */
    int tiles_x, tiles_y;
    int width, height; /* of the picture */
    int samples;
    int small_pixels;   /* with a window: bounding boxes up to this go to it at once */
    vd_visible *window; /* the worker's own whole picture, or null */
    uint8_t *touched;   /* [tiles]: the window has something there */
    uint64_t clipped, drawn;
} vd_sorter;

/* Adds a triangle to a list of `blocks`, or to all tiles that it may touch, of the sorter's kind.
 */
void vd_sorter_add_small(vd_sorter *sorter, const vd_drawing *drawing, uint32_t primitive,
                         int tile);
void vd_sorter_add_setup(vd_sorter *sorter, const vd_setup *setup);

/* Any primitive, the plain way. */
void vd_sorter_add_primitive(vd_sorter *sorter, const vd_drawing *drawing, uint32_t primitive);

/* A fresh block for a list. */
vd_block *vd_sorter_block(vd_sorter *sorter, const vd_drawing *drawing, int list);

#endif

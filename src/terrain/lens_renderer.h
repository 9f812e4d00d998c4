/* lens_renderer.h: the insides of vd_terrain_renderer, for terrain.c. */
#ifndef VEDUTA_TERRAIN_LENS_RENDERER_H
#define VEDUTA_TERRAIN_LENS_RENDERER_H

#include <string.h>
#include "core/buffer.h"
#include "terrain/lens_function.h"
#include "terrain/lens_view.h"

typedef struct vd_lens_worker vd_lens_worker;

struct vd_terrain_renderer {
    vd_context *context;
    vd_terrain_def def;
    vd_colormap colormap;      /* def's, if it has one */
    vd_lens_map map;           /* of a function: of the last picture */
    vd_lens_function function; /* where def has one */
    vd_lens_view view;         /* of the last picture */
    const vd_lens_methods *kernels;
    vd_lens_worker *workers; /* [threads] */
    vd_buffer depth, starts; /* see vd_lens_picture */
    vd_frame *window;     /* a target's window, one sample of each pixel; null until one is drawn */
    size_t window_pixels; /* that it has room for */
    vd_buffer mixed, list; /* see vd_terrain_composite_among */
    uint32_t sky[VD_LENS_SKY + 1];
};

/* A window of no cells, in a renderer's def: only what is behind the terrain is drawn. */
#define VD_TERRAIN_NO_CELLS ((vd_terrain_window){0, 0, -1, -1})

/* Which tiles of a picture are drawn: those of a list, or first, first + step, …, in rows. */
typedef struct vd_lens_tiles {
    int first, step, count;
    const int *list; /* [count]; null: none */
} vd_lens_tiles;

static inline int vd_lens_tile_count(int pixels) {
    return (pixels + VD_LENS_TILE - 1) / VD_LENS_TILE;
}

/* Returns VD_ERROR_ARGUMENT with the field's name when a def cannot be drawn. */
VD_MUST_USE vd_status vd_terrain_check(const vd_terrain_def *def);

/* Makes the map of a picture of a function; nothing to do for a heightfield. Before vd_lens_draw
 * of any of its tiles. Returns the errors of vd_lens_function_aim. */
VD_MUST_USE vd_status vd_lens_prepare(vd_terrain_renderer *renderer, vd_job *job,
                                      const vd_camera *camera, int width, int height);

/* Draws some tiles of a picture. All arguments but job and stats are checked and not null. */
VD_MUST_USE vd_status vd_lens_draw(vd_terrain_renderer *renderer, vd_job *job,
                                   const vd_camera *camera, uint32_t terrain_id,
                                   const vd_lens_tiles *tiles, vd_frame *frame,
                                   vd_frame_stats *stats);

/* What other rooms show in a tile of a target, 64 pixels a side. */
#define VD_TERRAIN_MIX_TILE 64
enum { VD_TERRAIN_MIX_NOTHING = 0, VD_TERRAIN_MIX_THINGS, VD_TERRAIN_MIX_BLENDED };

/* As vd_terrain_renderer_composite, for a picture of the terrain alone that is there already
 * (`ground`, with depth, of the whole picture): pixels with a sample that shows something else, and
 * all of a tile where something is blended, take every sample; others take the ground's colour and
 * depth, whose edges are smooth already. `mix` is [tiles_y][tiles_x] of the window; tiles of
 * VD_TERRAIN_MIX_NOTHING are left alone. */
VD_MUST_USE vd_status vd_terrain_composite_among(vd_terrain_renderer *renderer, vd_job *job,
                                                 const vd_camera *camera, uint32_t terrain_id,
                                                 const vd_frame *ground, const uint8_t *mix,
                                                 vd_target *target, vd_frame_stats *stats);

/* Merges the terrain's picture into a target of one sample a pixel and at most VD_TERRAIN_MIX_TILE
 * pixels a side, where it is nearer than what is there. */
void vd_terrain_merge_picture(const vd_frame *ground, uint32_t terrain_id, vd_target *target);

/* Puts a pixel of the terrain's picture at a sample of a target. */
static inline void vd_terrain_place(vd_target *to, size_t at, const uint8_t *rgba, float depth,
                                    uint32_t id) {
    uint32_t c;
    memcpy(&c, rgba, sizeof c);
    /* Eight bits a channel to sixteen: each times 257. */
    const uint64_t two = (c & 0xffffu) | (uint64_t)(c & 0xffff0000u) << 16;
    const uint64_t four = ((two & 0x000000ff000000ffu) | (two & 0x0000ff000000ff00u) << 8) * 257u;
    memcpy(to->color + 4 * at, &four, sizeof four);
    to->depth[at] = depth;
    to->id[at] = depth > 0.0f ? id : 0;
}

/* Draws the sky, and terrain if `ground`, under a frame, where pixels are not opaque; opaque tiles
 * are passed over. Returns VD_ERROR_MEMORY or VD_ERROR_CANCELLED. */
VD_MUST_USE vd_status vd_terrain_draw_under(vd_terrain_renderer *renderer, vd_job *job,
                                            const vd_camera *camera, bool ground, vd_frame *frame);

/* Returns the kernels of a level (VD_ISA_V2 … VD_ISA_V4). */
const vd_lens_methods *vd_lens_methods_for(vd_isa isa);

#endif

/* classic_march.h: what the march's parts share: the map as it walks it, a picture in the making,
 * a worker's memory, the kernels. The essay is in classic_march.inl.
 */
#ifndef VEDUTA_TERRAIN_CLASSIC_MARCH_H
#define VEDUTA_TERRAIN_CLASSIC_MARCH_H

#include <stdatomic.h>
#include "terrain/classic_internal.h"

/* ---- the map ---------------------------------------------------------------------------------
 * A copy of the heights and their maxima in strips of 8 columns: sample (c, r) of level l stands at
 *     offset + c + 8·r + (c & ~7)·(rows − 1)
 *
 *     level 0:  strip 0          strip 1
 *               0  1  … 7        8·rows …
 *               8  9  … 15
 *               …
 * so that a cache line holds 8 × 8 bytes of the map, whichever way the eye looks, for two
 * instructions more than rows would take.
 *
 * Level l has cells of 2^l samples. A map whose sides are powers of two has cells of the unwrapped
 * plane, all sizes up to 2^VD_MARCH_FINITE, the largest holding many copies of the map. On any
 * other map cells end where the map wraps, and small maps are repeated until a side is at least
 * MIN_SIDE, so that there is something to skip. The level above all, `everything`, is the plane.
 *
 * There are two pyramids over the one level 0: of the samples in a cell, and, for the linear
 * filter, of those and their right and lower neighbours, between which the surface lies. Of a map
 * of bytes the second stands by itself, with a level 0 of its own, as rows of pairs, a sample and
 * the one below it: two neighbouring pairs are the four heights of a patch, one load a lane. A row
 * of level 0 has the first pair again at its end; above level 0 a maximum stands in two pairs. */
#define VD_MARCH_LEVELS 16
#define VD_MARCH_FINITE 15 /* the most levels below `everything` */

typedef struct vd_march_map {
    _Alignas(64) int32_t offset[VD_MARCH_LEVELS];
    int32_t shared[VD_MARCH_LEVELS]; /* offset, of the second pyramid */
    int32_t pair_offset[VD_MARCH_LEVELS];
    int32_t pair_lead[VD_MARCH_LEVELS]; /* pairs from one row to the next */
    int32_t mask_x[VD_MARCH_LEVELS];    /* columns − 1 */
    int32_t mask_y[VD_MARCH_LEVELS];    /* rows − 1 */
    float cell[VD_MARCH_LEVELS];        /* 2^l */
    float inverse[VD_MARCH_LEVELS];     /* 2^−l */
    void *heights;
    /* Of a map of bytes, in the same memory: its colours as heights stand, while pictures are
     * nearest, or the pairs, while they are linear. */
    void *either;
    vd_rgba8 *strips;
    uint16_t *pairs;
    size_t bytes;           /* of heights, with the maxima of one pyramid */
    const vd_rgba8 *colors; /* [height][color_stride]; alpha is anything */
    int color_stride;
    vd_rgba8 *repeated; /* the colours, where the map is repeated; else null */
    vd_height_type height_type;
    int width, height; /* of what may be the map repeated */
    int everything;    /* its level */
    bool power_of_two;
    float highest; /* −infinity on a map of holes */
} vd_march_map;

/* Builds the copy of a level of the map (classic_mip.c), whose colours it goes on using. `out` is
 * written on success only; vd_march_map_finish ends it. Returns VD_ERROR_MEMORY. */
VD_MUST_USE vd_status vd_march_map_init(vd_context *context, const vd_classic_level *level,
                                        vd_height_type type, vd_march_map *out);

/* Makes what pictures with the filter need beside that: of a map of bytes the pairs, or the strips
 * of colours, in the place of what the other filter needs. Either leaves the whole within 2.2 times
 * heights and colours, which of larger heights strips of colours would not (1920 × 1080 from above:
 * 12 % faster). Returns VD_ERROR_MEMORY. */
VD_MUST_USE vd_status vd_march_map_prepare(vd_context *context, vd_march_map *map, bool linear);
void vd_march_map_finish(vd_context *context, vd_march_map *map);

/* ---- a picture -------------------------------------------------------------------------------
 * Tiles are 16 columns of the picture, whatever the SIMD level: a row of one is a cache line. */
#define VD_MARCH_TILE VD_CLASSIC_BLOCK
#define VD_MARCH_SLOTS 8 /* tiles that a worker has in hand at once, at most */
#define VD_MARCH_BATCH 1024

/* What a sample adds to a tile. Colours are fetched a batch at a time, when the loads of many
 * samples can wait for memory together. */
typedef struct vd_march_scratch {
    _Alignas(64) int32_t at[VD_MARCH_BATCH + 16]; /* pixel of `tiles` */
    /* index of the colour; for the linear filter column and 2^16 times row, and the weights, across
     * and 2^16 times down */
    _Alignas(64) int32_t from[VD_MARCH_BATCH + 16];
    _Alignas(64) int32_t weights[VD_MARCH_BATCH + 16];
    _Alignas(64) float depth_of[VD_MARCH_BATCH + 16];
    uint32_t *tiles; /* [SLOTS][height][TILE]: colour of the first row of a run; 0 elsewhere */
    float *depths;   /* the same for depth, or null */
    int32_t *below;  /* [height][TILE] of a tile that is smoothed, or null */
} vd_march_scratch;

/* The slices that read one level of the map, in that level's samples. */
typedef struct vd_march_segment {
    const vd_march_map *map;
    float scale; /* 2^−level */
    float eye_x, eye_y;
    float first, last; /* slices */
} vd_march_segment;

typedef struct vd_march_picture {
    const vd_classic_setup *setup;
    vd_march_segment segments[VD_CLASSIC_MAX_LEVELS]; /* front to back */
    int segment_count;
    const float *slice_z; /* [slice_count] for the sweep only */
    const float *slice_rise;
    vd_march_scratch *workers;
    int tiles;
    float inverse_scale; /* 1 / setup->scale, about */
    atomic_int next_tile;
    atomic_bool interrupted;
} vd_march_picture;

/* Draws tiles until none is left, as one of several workers. */
typedef void vd_kernel_march(vd_march_picture *picture, vd_march_scratch *scratch);

/* Nearest: by height type; by whether the sides of all maps are powers of two; by whether depth is
 * wanted. Linear: by the first two. */
typedef struct vd_march_kernels {
    vd_kernel_march *march[VD_HEIGHT_TYPE_COUNT][2][2];
    vd_kernel_march *ahead[VD_HEIGHT_TYPE_COUNT][2][2]; /* the march for maps beyond the caches */
    vd_kernel_march *sweep[VD_HEIGHT_TYPE_COUNT][2][2];
    vd_kernel_march *linear[VD_HEIGHT_TYPE_COUNT][2];
    vd_kernel_march *linear_sweep[VD_HEIGHT_TYPE_COUNT][2];
} vd_march_kernels;

/* Makes a renderer draw with these kernels instead of its context's; for tests. */
void vd_classic_renderer_use(vd_classic_renderer *renderer, const vd_march_kernels *kernels);

extern const vd_march_kernels vd_march_kernels_v2;
extern const vd_march_kernels vd_march_kernels_v3;
extern const vd_march_kernels vd_march_kernels_v4;

/* Returns the table of a level (VD_ISA_V2 … VD_ISA_V4). */
const vd_march_kernels *vd_march_kernels_for(vd_isa isa);

#endif

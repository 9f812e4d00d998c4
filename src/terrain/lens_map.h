/* lens_map.h: the terrain as the lens methods draw it: levels of detail, what they rise to, and
 * their colours in the sun.
 *
 * Everything that does not depend on the camera is done once and kept:
 *
 *   heights   level l has the samples at the map's positions that are multiples of 2^l, so that a
 *             cell of level l is exactly 4 cells of level l − 1. A sample of level l >= 1 is the
 *             mean of level l − 1 around it with the weights 1 2 1 × 1 2 1 (Burt & Adelson 1983),
 *             taken over what exists; it is a hole where the sample at its own place is one.
 *
 *        level 0   ·─·─·─·─·─·─·─·─·          level 1   ·───·───·───·───·
 *                  │ │ │ │ │ │ │ │ │                    │   │   │   │   │
 *                  ·─·─·─·─·─·─·─·─·                    │   │   │   │   │
 *                  │ │ │ │ │ │ │ │ │                    ·───·───·───·───·
 *
 *             The last column and row may reach beyond the map: a position beyond its last sample
 *             counts as that sample.
 *   maxima    over blocks of 2^r × 2^r cells of a level: at least what its surface, bilinear within
 *             each cell, gets to anywhere in the block; −infinity where all of it is holes. One
 *             pyramid serves all levels of a heightfield: M(m) is the highest of the four blocks of
 *             M(m − 1) in it and of level m's own four corners, and so bounds levels 0 … m.
 *   textures  sRGB-encoded colours with light and shadow already in them, and their half, quarter …
 *             sizes, each pixel the rounded mean of four.
 */
#ifndef VEDUTA_TERRAIN_LENS_MAP_H
#define VEDUTA_TERRAIN_LENS_MAP_H

#include <veduta/terrain.h>

#define VD_LENS_LEVELS 17 /* of detail, and of blocks within one */
#define VD_LENS_TABLE 16  /* entries of a table that kernels look up by block level */
#define VD_LENS_TEXTURES 18

/* One level of detail. Cells are counted from (column, row), in cells of the level from the map's
 * sample (0, 0): a heightfield's levels begin at (0, 0), windows of a function anywhere. */
typedef struct vd_lens_ground {
    const float *heights; /* [rows + 1][stride]: the samples at the cells' corners */
    size_t stride;
    int32_t column, row;   /* of cell (0, 0) */
    int32_t columns, rows; /* cells held, at least 1 */
    /* The block of 2^r × 2^r cells that holds cell (c, r'), 1 <= r <= top:
     *     maxima[offset[r] + (r' >> r)·pitch[r] + (c >> r)]
     * offset and pitch are int32_t tables for vd_wide_lookup_i32. Block level top is one block that
     * holds all cells, or VD_LENS_TABLE − 1 and then a few that do; top may be 0: then there is one
     * cell and no maxima. */
    const float *maxima;
    _Alignas(64) int32_t offset[VD_LENS_TABLE];
    int32_t pitch[VD_LENS_TABLE];
    int32_t top;
} vd_lens_ground;

/* One size of the lit colours, [height][stride] with a border of one texel on all sides, which
 * repeats the outermost texels: texels[-1] and texels[-stride] may be read. Bytes as vd_rgba8,
 * alpha 255. */
typedef struct vd_lens_texture {
    const uint32_t *texels; /* texel (0, 0) */
    int32_t stride;
    int32_t width, height;
    int32_t column,
        row; /* of texel (0, 0), in this size's texels from the map's; 0 of heightfields */
} vd_lens_texture;

typedef struct vd_lens_map {
    vd_context *context;
    int width, height; /* samples of the map */
    int levels;        /* of detail, at least 1: the last is one cell, or the last that is useful */
    vd_lens_ground ground[VD_LENS_LEVELS];
    float lowest, highest; /* of all samples that are not holes, of all levels; 0, 0 without any */
    int textures;          /* sizes, at least 1; the last is 1 × 1 */
    vd_lens_texture texture[VD_LENS_TEXTURES];
    /* Texture position (corner-based: texel centres at +½) of a sample position, at size 0:
     * u = t[0] + column·t[1] + row·t[2], v = t[3] + column·t[4] + row·t[5]. */
    double texture_from_sample[6];
    void *memory[4]; /* what it owns */
} vd_lens_map;

/* Builds the map of a heightfield: heights, maxima and room for textures, which are then lit by
 * vd_lens_map_light. `def->heightfield` must outlive the map: level 0's heights stay in its block.
 * *out is written on success only. Returns VD_ERROR_ARGUMENT, VD_ERROR_MEMORY, VD_ERROR_CANCELLED.
 */
VD_MUST_USE vd_status vd_lens_map_init(vd_context *context, vd_job *job, const vd_terrain_def *def,
                                       vd_lens_map *out);

/* Lights the textures anew: def's colours or colour map, light, shading, shadows, exaggeration.
 * Allocates nothing that it does not release. Returns VD_ERROR_MEMORY or VD_ERROR_CANCELLED. */
VD_MUST_USE vd_status vd_lens_map_light(vd_lens_map *map, vd_job *job, const vd_terrain_def *def);

/* The plain references: the same bytes. */
VD_MUST_USE vd_status vd_lens_map_init_reference(vd_context *context, const vd_terrain_def *def,
                                                 vd_lens_map *out);
VD_MUST_USE vd_status vd_lens_map_light_reference(vd_lens_map *map, const vd_terrain_def *def);

/* Ends a map; null members are accepted. */
void vd_lens_map_finish(vd_lens_map *map);

#endif

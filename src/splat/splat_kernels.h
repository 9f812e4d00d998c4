/* splat_kernels.h: the hot loops of this room, once per SIMD level. The plain versions are in
 * splat_reference.c and splat_sort.c; every level gives their bytes. */
#ifndef VEDUTA_SPLAT_SPLAT_KERNELS_H
#define VEDUTA_SPLAT_SPLAT_KERNELS_H

#include "splat/splat_internal.h"

/* Numbers of tiles carry what else there is to do with a record. */
#define VD_TILE_SPREAD 0x20000000      /* a large splat: several tiles, maybe none */
#define VD_TILE_RIGHT 0x40000000       /* also to the right neighbour */
#define VD_TILE_DOWN (-0x7FFFFFFF - 1) /* also to the lower one */
#define VD_TILE_MASK 0x1FFFFFFF

/* Where a chunk of particles is projected to. One scratch a thread; `large` is the chunk's own. */
typedef struct vd_splat_scratch {
    int count;
    int32_t *tiles;           /* [capacity + 16]: tile and VD_TILE_ bits; tile_count: not drawn */
    vd_splat_record *records; /* [capacity + 16] */
    const uint32_t *sequence; /* [count]: numbers of records in drawing order */
    uint32_t *own_sequence;   /* [capacity + 16] */
    bool uniform;             /* so far all are small and in `tile` alone */
    int32_t tile;
    vd_splat_large *large; /* [capacity] */
    uint32_t *counters;    /* [4][tile_count + 1] */
    uint32_t large_count;
    vd_splat_counts counts;
} vd_splat_scratch;

/* Projects particles order[first] … order[first + count − 1] of a list, or where `order` is null
 * first … first + count − 1, behind what the scratch holds. */
typedef void vd_kernel_splat_project(const vd_splat_picture *picture, const vd_placing *placing,
                                     const uint32_t *order, size_t first, size_t count,
                                     vd_splat_scratch *scratch);

/* A tile while it is drawn. */
typedef struct vd_splat_tile {
    const vd_splat_picture *picture;
    int x, y;     /* the picture's pixel that is the tile's own upper left one */
    void *pixels; /* [VD_TILE_STRIDE][VD_TILE_STRIDE], from one pixel further up and left; 64-byte
                     aligned; four floats, a uint64_t or a vd_splat_point by mode */
} vd_splat_tile;

/* The shares of the left and right pixels, four times each, by 1/256 pixel. */
typedef float vd_splat_shares[256][8];

/* Blending looks at that many records ahead, to ask for their pixels. */
#define VD_RECORDS_AHEAD 16

/* Draws records into a tile, in order. Reads VD_RECORDS_AHEAD records behind the last one, whatever
 * they are. */
typedef void vd_kernel_splat_blend(const vd_splat_tile *tile, const vd_splat_record *records,
                                   size_t count, const vd_splat_large *large,
                                   const vd_splat_shares *shares);

/* As vd_splat_resolve_reference. */
typedef void vd_kernel_splat_resolve(const vd_splat_picture *picture, const void *pixels, int count,
                                     uint8_t *rgba, float *depth, uint32_t *id);

/* keys[i] = vd_splat_key(placing, i) for all i. */
typedef void vd_kernel_splat_keys(const vd_placing *placing, uint32_t *keys);

typedef struct vd_splat_kernels {
    vd_kernel_splat_project *project;
    vd_kernel_splat_blend *blend[VD_SPLAT_MODE_COUNT];
    vd_kernel_splat_resolve *resolve;
    vd_kernel_splat_keys *keys;
} vd_splat_kernels;

extern const vd_splat_kernels vd_splat_kernels_v2;
extern const vd_splat_kernels vd_splat_kernels_v3;
extern const vd_splat_kernels vd_splat_kernels_v4;

/* Returns the table of a level (VD_ISA_V2 … VD_ISA_V4). */
const vd_splat_kernels *vd_splat_kernels_for(vd_isa isa);

#endif

/* splat_run.h: the renderer object and what its parts do. */
#ifndef VEDUTA_SPLAT_SPLAT_RUN_H
#define VEDUTA_SPLAT_SPLAT_RUN_H

#include "core/buffer.h"
#include "splat/splat_kernels.h"

/* Particles projected at a time by one thread: at most, and when several short lists are put
 * together; records that may come of them; and how many such chunks are drawn at a time. */
#define VD_CHUNK_PARTICLES 16384
#define VD_CHUNK_USUAL 8192
#define VD_CHUNK_RECORDS (VD_CHUNK_PARTICLES + VD_CHUNK_PARTICLES / 4)
#if defined(__wasm__) /* one thread, and memory that is the page's */
#define VD_BATCH_CHUNKS 4
#else
#define VD_BATCH_CHUNKS 16
#endif

/* Lists of more particles than this are sorted one by one, by one thread with memory of its own. */
#define VD_SORT_MUCH ((size_t)1 << 18)

/* A place in the sequence of all particles. */
typedef struct vd_splat_cursor {
    int list; /* of the sequence */
    size_t at;
} vd_splat_cursor;

/* Particles in drawing order, and what they leave for the tiles. */
typedef struct vd_splat_chunk {
    vd_splat_cursor from;
    size_t count;
    bool failed; /* more records than there is room for */
    int first_tile, last_tile;
    uint32_t *ends;           /* [tile_count]: tile t has records ends[t − 1] … ends[t] − 1 */
    vd_splat_record *records; /* [chunk_records] */
    vd_splat_large *large;    /* [VD_CHUNK_PARTICLES] */
    vd_splat_counts counts;
} vd_splat_chunk;

typedef struct vd_splat_batch {
    int count;
    vd_splat_chunk chunks[VD_BATCH_CHUNKS];
} vd_splat_batch;

struct vd_splatter {
    vd_context *context;
    int thread_count;
    const vd_splat_kernels *kernels;
    vd_splat_profile profiles[2];
    vd_splat_shares *shares;
    uint32_t *in_a_row; /* [VD_CHUNK_PARTICLES]: 0, 1, 2 … */
    vd_splat_picture picture;
    const vd_splat_def *def;
    const vd_camera *camera;
    const vd_splats *lists;
    int list_count;
    vd_placing *placings; /* [list_count] */
    int *sequence;        /* [sequence_count]: lists that are drawn, in order */
    int sequence_count;
    bool all; /* sort lists that are outside of the picture too */
    uint64_t sorted;
    vd_sorter *sorters;        /* [thread_count] */
    vd_splat_scratch *scratch; /* [thread_count] */
    vd_splat_batch batches[2];
    vd_splat_batch *filling, *drawing;
    uint32_t chunk_records;
    size_t tile_bytes;
    char *tiles;             /* [tile_count][tile_bytes] */
    uint8_t *touched;        /* [tile_count] */
    uint64_t (*extremes)[2]; /* [tile_count]: least sum above 0, greatest */
    vd_frame *frame;
    vd_buffer placing_memory, sequence_memory, order_memory, tile_memory, touched_memory,
        extreme_memory, chunk_memory, sort_memory, scratch_memory, counter_memory;
};

/* ---- splat_lists.c --------------------------------------------------------------------------- */

/* Places the lists before the camera, finds open ranges, chooses the sequence. */
VD_MUST_USE vd_status vd_splatter_place(vd_splatter *splatter, const vd_splat_def *def,
                                        const vd_camera *camera, const vd_splats *lists, int count,
                                        int width, int height);

/* Gives every list of the sequence its order. */
VD_MUST_USE vd_status vd_splatter_order(vd_splatter *splatter, vd_job *job);

/* ---- splat_bins.c ---------------------------------------------------------------------------- */

/* Draws the sequence into the tiles. */
VD_MUST_USE vd_status vd_splatter_draw(vd_splatter *splatter, vd_job *job, vd_splat_counts *counts);

/* A tile's pixels; the background, if nothing was drawn there. */
void *vd_splatter_tile(vd_splatter *splatter, int tile);

#endif

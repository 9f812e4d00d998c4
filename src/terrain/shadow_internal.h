/* shadow_internal.h: what the reference of the shadow counts and its twin share.
 *
 * The twin. A step of all rays is one shift of the whole map by whole samples, and a comparison:
 *
 *        the map             the map, moved by (dx, dy)        counts
 *     ┌───────────┐              ┌───────────┐             ┌───────────┐
 *     │ h h h h h │   +  t   <   │ h' h' h' …│     ──►     │ +1 0 0 +1 │
 *     └───────────┘              └───────────┘             └───────────┘
 *
 * For 8-bit heights h + t < h' is h' >= h + floor(t) + 1, that is h' > h ⊕ floor(t) with ⊕ the
 * addition that saturates at 255 (if it saturates, no byte is greater): one addition, one
 * comparison and one masked addition for 64 cells. A block of 8 rows × one vector stays in
 * registers through all steps; only h' is loaded. To make every load legal and every step
 * branchless, the rows that a band of the map can reach are first copied into a slab whose columns
 * go on (or end) on both sides.
 *
 *         ──────── reach ────────►
 *     ┌──┬─────────────────────┬──┐  rows of the band and those towards the sun
 *     │  │  copied rows        │  │  PAD columns left and right: repeated, or lowest
 *     └──┴─────────────────────┴──┘
 *
 * A ray that is above the highest ground stays there (t grows with k): a block stops at the first
 * step where its lowest cell is. Within, runs of 8 steps are skipped when the lowest cell's ray is
 * above all of the 64 × 32 tiles that the block's rays cross meanwhile; blocks narrower than a tile
 * (all but those of bytes at v4) are first asked so together, for a tile's width. All tests are
 * exact: h + t is monotone in h and t, also when rounded. Tried and not faster: two groups of 4
 * rows, so that heights and counts fit the 16 registers of v2 and v3 (v3: 6.4 ms against 5.5); a
 * masked addition for float heights at v4 (no difference); strips of 64 columns from top to bottom
 * instead of rows, to stay in the second-level cache (no difference at 1024 and 4096 samples a
 * side, 20 % slower with the sun in the east); h ⊕ floor(t) kept while floor(t) stays (Zen 4, low
 * suns: v4 1.01, which waits for loads that cross lines; v3 1.05, v2 1.14; float 0.96).
 */
#ifndef VEDUTA_TERRAIN_SHADOW_INTERNAL_H
#define VEDUTA_TERRAIN_SHADOW_INTERNAL_H

#include <veduta/shadow.h>

#define VD_SHADOW_STEPS 255
#define VD_SHADOW_ROWS 8 /* of a block */
#define VD_SHADOW_PAD 64 /* columns on each side of a slab: the widest vector */
#define VD_SHADOW_RUN 8  /* steps that are skipped together */
#define VD_SHADOW_TILE_WIDTH 64
#define VD_SHADOW_TILE_HEIGHT 32

/* The definition in numbers; element k − 1 belongs to step k. */
typedef struct vd_shadow_plan {
    int all_steps; /* as asked for */
    int steps;     /* those that can count anything: later ones are above the highest ground */
    bool wraps;
    int32_t dx[VD_SHADOW_STEPS], dy[VD_SHADOW_STEPS];
    float t[VD_SHADOW_STEPS];
    size_t slab_bytes; /* of the twin's copy, about; tests make it small */
    void *scratch;     /* memory of the caller's for it, 64-byte aligned; or null */
    size_t scratch_bytes;
} vd_shadow_plan;

/* Checks def and fills the plan. Returns VD_ERROR_ARGUMENT. */
VD_MUST_USE vd_status vd_shadow_make_plan(const vd_heightfield *map, const vd_shadow_def *def,
                                          size_t counts_stride, vd_shadow_plan *plan);

/* A band of the map and what its rays can reach, as the kernels see it. */
typedef struct vd_shadow_slab {
    const vd_shadow_plan *plan;
    const void *origin;             /* column 0 of the band's first row */
    size_t pitch;                   /* samples from one row to the next */
    int width;                      /* of the map */
    int32_t dx[VD_SHADOW_STEPS];    /* where the map wraps: modulo the width, 0 … width − 1 */
    uint32_t drop[VD_SHADOW_STEPS]; /* floor(t), at most 65535 */
    float highest;                  /* of the map */
    const float
        *tiles; /* maxima of the slab, [rows][tile_pitch], from its first row, column −PAD */
    size_t tile_pitch;
    int rows_above; /* rows of the slab above the band */
} vd_shadow_slab;

/* Writes the counts of rows [row, row + rows) of the band, rows <= VD_SHADOW_ROWS; `row` is a
 * multiple of VD_SHADOW_ROWS. `counts` is the band's first row. Reads whole blocks: the slab is as
 * many rows longer as make the band a multiple of VD_SHADOW_ROWS. */
typedef void vd_kernel_shadow(const vd_shadow_slab *slab, int row, int rows,
                              uint8_t *restrict counts, size_t stride);

/* Writes the maxima of one row of tiles: `tiles` of them, each VD_SHADOW_TILE_WIDTH samples wide,
 * from `rows` rows that begin at `first`. */
typedef void vd_kernel_tile_maxima(const void *first, size_t pitch, int rows, size_t tiles,
                                   float *restrict out);

typedef struct vd_shadow_kernels {
    vd_kernel_shadow *count[VD_HEIGHT_TYPE_COUNT];
    vd_kernel_tile_maxima *maxima[VD_HEIGHT_TYPE_COUNT];
} vd_shadow_kernels;

extern const vd_shadow_kernels vd_shadow_kernels_v2;
extern const vd_shadow_kernels vd_shadow_kernels_v3;
extern const vd_shadow_kernels vd_shadow_kernels_v4;

/* vd_shadow_count with memory of the caller's for the twin's copy of the map, which is taken from
 * the context only where the caller's is too little for rows as long and rays as far. */
VD_MUST_USE vd_status vd_shadow_count_with(vd_context *context, vd_job *job,
                                           const vd_heightfield *map, const vd_shadow_def *def,
                                           uint8_t *counts, size_t stride, void *scratch,
                                           size_t scratch_bytes);

/* The published loops. Returns VD_ERROR_CANCELLED when the job stops. */
VD_MUST_USE vd_status vd_shadow_count_reference(vd_job *job, const vd_heightfield *map,
                                                const vd_shadow_plan *plan, uint8_t *counts,
                                                size_t stride);

/* The twin. */
VD_MUST_USE vd_status vd_shadow_count_shift(vd_context *context, vd_job *job,
                                            const vd_heightfield *map, const vd_shadow_plan *plan,
                                            uint8_t *counts, size_t stride);

#endif

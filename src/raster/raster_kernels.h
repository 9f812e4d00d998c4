/* raster_kernels.h: the hot loops of this room, once per SIMD level.
 *
 * Contract: the same bytes as the plain functions of raster_internal.h at every level. A window's
 * planes must have VD_FILL_SLACK values behind their end that may be read and written back.
 */
#ifndef VEDUTA_RASTER_RASTER_KERNELS_H
#define VEDUTA_RASTER_RASTER_KERNELS_H

#include "raster/raster_lists.h"

#define VD_FILL_SLACK 64

typedef struct vd_raster_kernels {
    /* Projects vertices; the plain matrix only, else as vd_project_reference. `first` is a multiple
     * of 16; up to the next multiple of 16 behind the end is written. */
    void (*project)(const vd_drawing *drawing, uint32_t first, uint32_t count);

    /* Sorts triangles of a drawing: small ones by number into the lists of the tiles that their
     * boxes touch, or, where the sorter has a window, into that window at once; all others set up,
     * into the lists. */
    void (*sort)(vd_sorter *sorter, const vd_drawing *drawing, uint32_t first, uint32_t count);

    /* Fills small triangles (no corner flagged, boxes below VD_SMALL_SUBPIXELS) into a window. Some
     * of what they show is pending until flush. */
    void (*fill_small)(vd_visible *visible, const vd_drawing *drawing, const uint32_t *primitives,
                       int count);

    /* The same for a chain of blocks, which ends with one without a drawing. */
    void (*fill_blocks)(vd_visible *visible, const vd_block *blocks);

    void (*flush)(vd_visible *visible);

    /* Fills one triangle of any size into a window. */
    void (*fill_setup)(vd_visible *visible, const vd_setup *setup);

    /* The same for one whose material is alpha-tested, where its alpha passes. */
    void (*fill_tested)(const vd_scene *scene, vd_visible *visible, const vd_setup *setup,
                        vd_batch *batch);

    /* Adds one that blends to a target's list. */
    void (*add_blended)(const vd_scene *scene, vd_target *target, const vd_setup *setup,
                        vd_batch *batch);

    /* Takes the nearer of two windows' samples, row by row: `from` [height][from_stride]. */
    void (*merge)(vd_visible *visible, int sample, const float *depth, const uint32_t *id,
                  size_t stride);

    /* Colours a window of one sample a pixel into a frame, all planes; returns the pixels hit. */
    uint64_t (*shade_frame)(const vd_scene *scene, const vd_visible *visible, vd_frame *frame,
                            vd_batch *batch, bool stream);

    /* The same for a window that shows nothing. */
    void (*fill_frame)(const vd_scene *scene, const vd_visible *visible, vd_frame *frame,
                       bool stream);

    /* Colours a window's samples that show something into a target; returns the samples hit. */
    uint64_t (*shade)(const vd_scene *scene, const vd_visible *visible, vd_target *target,
                      vd_batch *batch);

    /* Fragment functions that are there, by vd_shading; null: the plain one. */
    vd_fragment_function *fragments[VD_SHADING_COUNT];
} vd_raster_kernels;

extern const vd_raster_kernels vd_raster_kernels_v2;
extern const vd_raster_kernels vd_raster_kernels_v3;
extern const vd_raster_kernels vd_raster_kernels_v4;

const vd_raster_kernels *vd_raster_kernels_for(vd_isa isa);

#endif

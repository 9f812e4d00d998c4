/* raster_edges.h: a triangle's edge functions over the samples of one plane, in 64 bits. */
#ifndef VEDUTA_RASTER_RASTER_EDGES_H
#define VEDUTA_RASTER_RASTER_EDGES_H

#include "raster/raster_internal.h"

/* Edge i is inside at pixel (x, y) where at[i] + x·dx[i] + y·dy[i] >= 0. Samples are whole pixels
 * apart, so that the part of the value below a pixel may be rounded down and the sign stays. */
typedef struct vd_edges {
    int64_t at[3], dx[3], dy[3];
    int x0, y0, x1, y1; /* pixels with samples in the triangle's box; x1 < x0 or y1 < y0: none */
} vd_edges;

/* The edges for sample `sample` of a window of the whole picture. */
vd_edges vd_edges_make(const vd_setup *setup, const vd_visible *window, int sample);

/* Takes a sample where it is nearer. (x, y): pixel of the window of the whole picture. */
void vd_window_take(vd_visible *window, int sample, const vd_setup *setup, int x, int y);

/* ---- raster_scanline.c, raster_immediate.c --------------------------------------------------- */

/* Fills a triangle into a window of the whole picture, span by span. */
void vd_scanline_fill(vd_visible *window, const vd_setup *setup);

/* Triangles on their way through the stages of the immediate method. */
typedef struct vd_immediate vd_immediate;

/* Returns null when memory is out. Bins and fine tiles of `bin` and `fine` pixels a side: at most
 * 256 fine tiles a bin and 256 pixels a fine tile. */
vd_immediate *vd_immediate_create(vd_context *context);
void vd_immediate_destroy(vd_context *context, vd_immediate *immediate);
void vd_immediate_begin(vd_immediate *immediate, vd_visible *window, int bin, int fine,
                        int small_pixels);
void vd_immediate_add(vd_immediate *immediate, const vd_setup *setup);
/* Draws what was added. */
void vd_immediate_flush(vd_immediate *immediate);

#endif

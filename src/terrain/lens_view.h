/* lens_view.h: one picture of a vd_lens_map: a camera turned into floats, and the plain cast.
 *
 * Everything is relative to the map: u and v count samples eastwards and southwards (columns and
 * rows) from an anchor, a whole sample near the eye; w is a height in the map's units. A ray of the
 * picture position (x, y) is, for s metres along the view axis past the plane t0,
 *
 *     u(s) = u + ut·s      v(s) = v + vt·s      w(s) = w + s·(w1 + s·w2)
 *
 *        eye ·─────────┊────────────────────►  t = t0 + s
 *                      ┊ s = 0
 *              t0 ─────┊ no ground is nearer, along the axis, than this
 *
 * and all its coefficients are affine in x and y but for the curvature's. t0 keeps floats short: a
 * position is known to 2^−22 of the map's own width, also from space. Every number that a picture
 * is made of is computed here in double and rounded once; from there on everything is float, in one
 * order, in lens_cast.h (one ray at a time: the reference) and lens_march.inl (16 at a time): the
 * same bytes.
 *
 * Levels of detail. From T(n) = 2^n · T(0) on, where a cell of level n is about a pixel, the ground
 * is level n's: between two planes across the view axis every ray walks cells of one size, and far
 * ground costs, and sparkles, no more than near ground.
 *
 *     eye ·──── level 0 ────┊── level 1 ──┊──────── level 2 ────────┊────────────── level 3 …
 *                          T(1)          T(2)                      T(3)
 *
 * A ray that comes to a plane stays in the air; where the next level's ground is higher, it meets
 * it there.
 */
#ifndef VEDUTA_TERRAIN_LENS_VIEW_H
#define VEDUTA_TERRAIN_LENS_VIEW_H

#include <math.h>
#include "terrain/lens_map.h"

/* An affine function of the picture position: (k[0] + x·k[1]) + y·k[2]. */
typedef struct vd_lens_affine {
    float k[3];
} vd_lens_affine;

/* What lies between two planes across the view axis: cells of one level. */
typedef struct vd_lens_slab {
    const vd_lens_ground *ground;
    float begin, end;       /* s */
    float scale;            /* 2^−level: cells a sample */
    float unscale;          /* 2^level */
    float shift_u, shift_v; /* samples from the slab's cell (0, 0) to the anchor */
    int32_t column, row;    /* the slab's cell (0, 0), counted in cells of the ground */
    float margin, margin_s; /* heights: what rounding may do at s is below margin + margin_s·s */
} vd_lens_slab;

typedef struct vd_lens_view {
    const vd_lens_map *map;
    vd_lens_affine u, v, w, ut, vt, w1; /* w and w1 without the curvature's part */
    vd_lens_affine east, north;         /* of the direction, per metre of s: for the curvature */
    vd_lens_affine right, down;         /* of the direction, in camera space: for lengths */
    float curve, curve_t0, curve_t0_t0; /* curvature in units of w, times 2·t0, times t0² */
    float t0, begin;                    /* metres; s of the near plane, or 0 */
    float west, east_end, north_end, south; /* the window's edges, in samples from the anchor */
    float top;                              /* above all ground */
    int slabs;
    vd_lens_slab slab[VD_LENS_LEVELS];

    /* colours */
    bool nearest;         /* VD_FILTER_NEAREST */
    float texture_t;      /* 1 / T(1): textures' size is that of the exponent of t·texture_t … */
    int32_t texture_bias; /* … plus this, */
    int32_t texture_last; /* at most this */
    const uint32_t *texels;
    _Alignas(64) int32_t texture_offset[VD_LENS_TABLE]; /* of texel (0, 0) from texels */
    _Alignas(64) int32_t texture_stride[VD_LENS_TABLE];
    _Alignas(64) int32_t texture_width[VD_LENS_TABLE], texture_height[VD_LENS_TABLE];
    _Alignas(64) float texture_u[VD_LENS_TABLE], texture_v[VD_LENS_TABLE]; /* of the anchor */
    _Alignas(64) float texture_scale[VD_LENS_TABLE];
    float texture_uu, texture_uv, texture_vu, texture_vv;
    float haze;            /* −log2(e) / haze_m, or 0 */
    int16_t haze_color[4]; /* 127 times the encoded colour, premultiplied; 127·255 */
    const uint32_t *sky;   /* [VD_LENS_SKY + 1] by the sine of the elevation; null: background */
    float sine;            /* w1 times this over the direction's length: the sine */
    uint32_t background;   /* premultiplied */

    /* depth and edges */
    bool orthographic;
    float depth_scale;            /* near; orthographic: −1 / far */
    float edge_share, edge_least; /* a pixel is on an edge where depth bends by more than
                                     edge_share · depth + edge_least */
    int samples;                  /* 1, 4 or 8 on edges */
    bool everywhere;              /* all pixels count as edges */
    uint32_t terrain_id;
} vd_lens_view;

#define VD_LENS_SKY 4096

/* Fills the table of sky colours, encoded, opaque. */
void vd_lens_make_sky(const vd_light *light, uint32_t sky[VD_LENS_SKY + 1]);

/* Sets up a picture of width × height pixels. `sky` is the table of def's light and must outlive
 * the view. All numbers of def and camera have been checked. */
void vd_lens_view_init(const vd_lens_map *map, const vd_terrain_def *def, const vd_camera *camera,
                       int width, int height, const uint32_t *sky, vd_lens_view *out);

/* ---- the two kernels -------------------------------------------------------------------------
 * A picture is drawn in two passes over its tiles: the first draws every pixel's centre and notes
 * its depth in a plane of its own, the second draws pixels on edges again with all their samples
 * and leaves the plane alone. */
#define VD_LENS_TILE 32

typedef struct vd_lens_picture {
    const vd_lens_view *view;
    vd_frame *frame;
    float *depth; /* [height][depth_stride], of pixel centres: near / t; 0 where nothing is */
    size_t depth_stride;
    float
        *starts; /* [blocks_y][blocks_x]: for each 4 × 4 pixels, an s before which nothing is hit */
    size_t starts_stride;
} vd_lens_picture;

typedef struct vd_lens_counts {
    uint64_t samples, hits;
} vd_lens_counts;

/* Draws the tile whose upper left pixel is (x, y). */
typedef void vd_kernel_lens(const vd_lens_picture *picture, int x, int y, vd_lens_counts *counts);

typedef struct vd_lens_methods {
    vd_kernel_lens *draw, *refine;
} vd_lens_methods;

extern const vd_lens_methods vd_lens_methods_reference; /* the method "raycast" */
extern const vd_lens_methods vd_lens_methods_v2;
extern const vd_lens_methods vd_lens_methods_v3;
extern const vd_lens_methods vd_lens_methods_v4;

#endif

/* splat_internal.h: what the files of this room share.
 *
 *   lists of particles ─ place, cull, sort ─► placings
 *                        │ chunk by chunk: project, 16 particles at a time
 *                        ▼
 *              records, binned by tile in drawing order ─ tile by tile: blend ─► tile pixels ─►
 * frame
 *
 * The rules that make reference and twin agree, bit for bit:
 * - A splat's place is its middle, projected in float in the order of operations of
 *   splat_reference.c, snapped to 1/256 pixel by floor(256·(s − ½) + ½): an integer whose lower
 *   eight bits are the share of the right and lower pixels.
 * - A pixel's colour is a left fold over the splats in drawing order: c·(1 − w) + splat·w, four
 *   floats, 255 is opaque. Every weight is a product in the order of the reference.
 * - Densities are integers; sums do not care for order.
 */
#ifndef VEDUTA_SPLAT_SPLAT_INTERNAL_H
#define VEDUTA_SPLAT_SPLAT_INTERNAL_H

#include <string.h>
#include <veduta/splat.h>
#include "core/core.h"

/* A tile's pixels stand in a square one pixel wider on every side, so that a splat on its edge can
 * write all of its four pixels; what falls outside belongs to the neighbour, which draws the splat
 * too. */
#define VD_TILE_LOG2 7
#define VD_TILE_SIDE (1 << VD_TILE_LOG2)
#define VD_TILE_STRIDE (VD_TILE_SIDE + 2)
#define VD_TILE_PIXELS (VD_TILE_STRIDE * VD_TILE_STRIDE)

#define VD_PALETTE_COLORS 1024
#define VD_PROFILE_STEPS 64

/* The largest weight becomes this integer of 24 bits, and 256 times it in a pixel's sum: splitting
 * it over four pixels by 1/256 loses nothing, and 2³² of them fit. */
#define VD_WEIGHT_ONE 16777208.0f
#define VD_WEIGHT_CUT 16777212.0f /* what rounds to more than this was above the largest */

/* The value at squared distance s = d²/support² from the middle is profile[64·s], linear between;
 * the middle has 1. */
typedef struct vd_splat_profile {
    float at[VD_PROFILE_STEPS + 2];
} vd_splat_profile;

/* A kernel's measures, in units of the radius and the support. */
typedef struct vd_splat_shape {
    vd_splat_kernel kernel;
    float support; /* how far it reaches, in radii */
    float small;   /* up to this support, in pixels, a splat is a box of one pixel */
    float area;    /* integral of the kernel, in squares of the support */
    const vd_splat_profile *profile; /* gaussian and sph */
} vd_splat_shape;

/* What holds for a whole picture. */
typedef struct vd_splat_picture {
    vd_splat_mode mode;
    vd_splat_shape shape;
    int width, height, tiles_x, tiles_y, tile_count;
    float background[4];  /* premultiplied, 0 … 255 */
    const vd_frame *over; /* what is drawn over; null: the background */
    const float *hider;   /* its depth, what is nearer hides; null: nothing does */
    size_t hider_stride;
    bool log;
    float value_low, value_scale; /* palette index = (value or its log₂ − low) × scale */
    float weight_scale;           /* weights to integers */
    float density_scale;          /* a pixel's sum to its density */
    uint32_t palette[VD_PALETTE_COLORS];        /* RGBA bytes, by value */
    uint32_t density_colors[VD_PALETTE_COLORS]; /* the same premultiplied */
    uint32_t class_colors[256];
    uint32_t background_bytes;   /* premultiplied */
    double range_min, range_max; /* what the palette stands for */
} vd_splat_picture;

/* Where a particle's colour comes from. */
typedef enum vd_splat_paint {
    VD_PAINT_CONSTANT = 0,
    VD_PAINT_COLOR,
    VD_PAINT_CLASS,
    VD_PAINT_VALUE,
    VD_PAINT_VALUE16
} vd_splat_paint;

/* One list of particles, placed before a camera. */
typedef struct vd_placing {
    const vd_splats *splats;
    float row[3][4];     /* x·w and y·w in pixels and z in metres, of what stands in the arrays */
    bool perspective;    /* w is z, else 1 */
    float near_z, far_z; /* what is drawn lies between */
    float depth_at, depth_by; /* depth is depth_at + depth_by / z, orthographic + depth_by · z */
    float support_scale;      /* support in pixels of a radius of 1 m, times w */
    float opacity;            /* divided by 255 */
    vd_splat_paint paint;
    uint32_t constant; /* RGBA bytes */
    uint32_t frame_id;
    bool culled;           /* nothing of it is in the picture */
    float z_back, z_scale; /* sort key: (z_back − axis·p) × z_scale is 0 … 1 */
    float middle_z;        /* of the bounds */
    float axis[3];         /* unit */
    const uint32_t *order; /* null: as they stand */
    uint32_t *sorting;     /* where to sort to; null: no need */
    double value_min, value_max, weight_max; /* found, where asked for */
} vd_placing;

/* What a small splat leaves for a tile; by mode. */
typedef struct vd_splat_record {
    uint32_t head; /* tile pixel of the upper left one, share of the right ones << 16; or VD_LARGE
                      and a number of the chunk's large splats */
    uint32_t a;    /* alpha, nearest: RGBA bytes; density: weight of the upper row */
    uint32_t b;    /* float: alpha of the upper row; nearest: depth; density: weight of the lower */
    uint32_t c;    /* float: alpha of the lower row; nearest: frame id */
} vd_splat_record;

#define VD_LARGE 0x80000000u

/* A splat of more than a pixel. */
typedef struct vd_splat_large {
    float x, y;    /* pixels */
    float support; /* pixels */
    float inverse; /* 1 / support² */
    float amount;  /* at the middle: alpha, or integer weight × 128 */
    float depth;
    uint32_t color, id;
} vd_splat_large;

/* One pixel while nearest points are drawn. */
typedef struct vd_splat_point {
    float depth;
    uint32_t color, id, unused;
} vd_splat_point;

/* ---- splat_shape.c --------------------------------------------------------------------------- */

/* How far a kernel reaches, in radii; VD_SPLAT_GAUSSIAN the farthest. */
double vd_splat_support(vd_splat_kernel kernel);

/* Fills the profile of a gaussian or sph kernel. */
void vd_splat_profile_init(vd_splat_profile *profile, vd_splat_kernel kernel);

/* `profiles` are those of VD_SPLAT_GAUSSIAN and VD_SPLAT_SPH. */
vd_splat_shape vd_splat_shape_of(vd_splat_kernel kernel, const vd_splat_profile profiles[2]);

/* Partial sums of a kernel's pixels, by column, which are then added up in their order: as many as
 * the widest vectors have lanes. */
#define VD_SUM_LANES 16

/* What the pixels of a square of `side` from (first, first) on have of a large splat, which reaches
 * none beyond it. */
typedef float vd_splat_sum_function(const vd_splat_large *large, const vd_splat_shape *shape,
                                    int first, int side);
vd_splat_sum_function vd_splat_large_sum;

/* Makes a large splat: x, y and support in pixels, `amount` the opacity at the middle, or the
 * weight as an integer. Scales it so that its pixels add up to what they must. */
void vd_splat_large_init(vd_splat_large *large, const vd_splat_picture *picture, float x, float y,
                         float support, float amount, vd_splat_sum_function *add);

/* The pixels that a large splat touches, cut at the picture: [x0, x1) × [y0, y1). */
void vd_splat_large_box(const vd_splat_large *large, const vd_splat_picture *picture, int box[4]);

/* The share of pixel (px, py) that a large splat covers, or its kernel's value there. */
float vd_splat_large_at(const vd_splat_large *large, const vd_splat_shape *shape, int px, int py);

/* Whether a point of the kernel's shape and radius, without a soft edge, holds a pixel's middle. */
bool vd_splat_large_holds(const vd_splat_large *large, const vd_splat_shape *shape, int px, int py);

/* ---- splat_place.c --------------------------------------------------------------------------- */

VD_MUST_USE vd_status vd_splat_check(const vd_splat_def *def, const vd_camera *camera,
                                     const vd_splats *splats, int count);

/* Everything of a placing but order and frame_id; finds bounds where the list has none and they are
 * needed. */
void vd_placing_init(vd_placing *placing, const vd_splats *splats, const vd_splat_def *def,
                     const vd_splat_picture *picture, const vd_camera *camera);

/* Finds the ranges of values and weights that the def leaves open. */
void vd_placing_measure(vd_placing *placing, const vd_splat_def *def);

/* Picture constants but the palette; the palette, once the range is known. */
void vd_splat_picture_init(vd_splat_picture *picture, const vd_splat_def *def, int width,
                           int height, const vd_splat_profile profiles[2]);
void vd_splat_picture_set_range(vd_splat_picture *picture, const vd_splat_def *def, double min,
                                double max);

/* The integer scale of weights of which `max` is the largest. */
void vd_splat_picture_set_weight(vd_splat_picture *picture, double max);

/* Palette index of a value: the reference's way. */
int vd_splat_palette_index(const vd_splat_picture *picture, float value);

/* What a pixel is before anything is drawn on it, by alpha. */
static inline void vd_splat_first_color(const vd_splat_picture *picture, int x, int y,
                                        float out[4]) {
    if (picture->over == NULL) {
        memcpy(out, picture->background, sizeof picture->background);
        return;
    }
    const uint8_t *from = picture->over->rgba + 4 * ((size_t)y * picture->over->stride + (size_t)x);
    for (int c = 0; c < 4; c++) {
        out[c] = (float)from[c];
    }
}

/* ---- splat_sort.c ---------------------------------------------------------------------------- */

#define VD_SORT_BITS 11
#define VD_SORT_SMALL 128 /* up to here by insertion */

/* Scratch of one sorting thread for up to `capacity` particles. */
typedef struct vd_sorter {
    size_t capacity;
    uint32_t *keys;  /* [capacity] */
    uint64_t *pairs; /* [capacity] */
    uint32_t first[2][1 << VD_SORT_BITS];
} vd_sorter;

/* The sort key of particle i: 22 bits, farthest first. */
uint32_t vd_splat_key(const vd_placing *placing, size_t i);

/* Sorts by keys[count], stable, into index[count]. */
void vd_sorter_run(vd_sorter *sorter, size_t count, uint32_t *index);

/* ---- splat_reference.c ------------------------------------------------------------------------*/

/* What drawing counts. */
typedef struct vd_splat_counts {
    uint64_t drawn, not_finite, cut;
} vd_splat_counts;

/* Colours one row of finished pixels into the frame's planes (depth and id may be null). */
void vd_splat_resolve_reference(const vd_splat_picture *picture, const void *pixels, int count,
                                uint8_t *rgba, float *depth, uint32_t *id);

/* Draws `count` placed lists in the order of `sequence` into pixels[height][width] of four floats,
 * of one uint64_t or of a vd_splat_point by mode; sorts them itself where `sorts`. `scratch` holds
 * two numbers a particle of the longest list. */
void vd_splat_draw_reference(const vd_splat_picture *picture, const vd_placing *placings,
                             const int *sequence, int count, bool sorts, uint64_t *scratch,
                             void *pixels, vd_splat_counts *counts);

#endif

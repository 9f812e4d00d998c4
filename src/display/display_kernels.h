/* display_kernels.h: the hot loop of this room, once plain and once per SIMD level.
 *
 * Contract: `row` is a frame's row of RGBA8 at a multiple of 64 bytes, readable and writable up to
 * `end` rounded up to 16 pixels; pixels outside [begin, end) keep their bytes. The picture is read
 * inside its sides only, whatever the numbers of the line are. Every table gives the same bytes.
 */
#ifndef VEDUTA_DISPLAY_KERNELS_H
#define VEDUTA_DISPLAY_KERNELS_H

#include <veduta/display.h>

/* Positions run in 1/256 texel from the centre of texel 0, which reads texels 0 and 1. */
typedef struct vd_display_line {
    const uint8_t *texels;
    int32_t stride, width, height; /* texels */
    int32_t base;                  /* the pixel that the numbers below hold for */
    int32_t whole_u, whole_v;      /* |…| <= VD_DISPLAY_FAR */
    float part_u, part_v;          /* 0 … 1: whole + part is the position at the base plus ½ */
    float step_u, step_v, bend;    /* n pixels on: + n / (1 + n·bend)·step, which is within
                                      ±VD_DISPLAY_FAR for every pixel that is drawn */
    uint32_t opacity;              /* 1 … 255 */
    bool opaque; /* filtered texels are written as they are: what the rule gives with opacity 255
                    where all of them have alpha 255 */
    /* A pixel keeps its bytes where depth[x] > depth_at + n·depth_step, n pixels on from the base.
     * The row's depths, as readable as the row is; null: none is hidden. */
    const float *depth;
    float depth_at, depth_step;
} vd_display_line;

/* Beyond all pictures, in 1/256 texel; two of them fit an int32_t. */
#define VD_DISPLAY_FAR (1 << 25)

typedef void vd_kernel_display(uint8_t *row, const vd_display_line *line, int begin, int end);

typedef struct vd_display_kernels {
    vd_kernel_display *blend;
} vd_display_kernels;

extern const vd_display_kernels vd_display_kernels_reference;
extern const vd_display_kernels vd_display_kernels_v2;
extern const vd_display_kernels vd_display_kernels_v3;
extern const vd_display_kernels vd_display_kernels_v4;

/* Returns the table of a level (VD_ISA_V2 … VD_ISA_V4). */
const vd_display_kernels *vd_display_kernels_for(vd_isa isa);

#endif

/* function_kernels.h: running a compiled formula, once plain and once per SIMD level.
 *
 * Contract: any count, any alignment of float, no access outside [0, count), no overlap between
 * inputs and outputs. `rgb` null: only the first height_steps run. Heights that are not finite
 * become −infinity, colours are clamped to 0 … 1 and NaN there becomes 0, so that no NaN, whose
 * bits depend on the order of operands, ever leaves. Every table gives the same bytes.
 */
#ifndef VEDUTA_TERRAIN_FUNCTION_KERNELS_H
#define VEDUTA_TERRAIN_FUNCTION_KERNELS_H

#include "terrain/function_program.h"

typedef void vd_kernel_function(const vd_function *function, size_t count, const float *restrict x,
                                const float *restrict y, float *restrict h, float *const rgb[3]);

typedef struct vd_function_kernels {
    vd_kernel_function *evaluate;
} vd_function_kernels;

extern const vd_function_kernels vd_function_kernels_reference;
extern const vd_function_kernels vd_function_kernels_v2;
extern const vd_function_kernels vd_function_kernels_v3;
extern const vd_function_kernels vd_function_kernels_v4;

/* Returns the table of a level (VD_ISA_V2 … VD_ISA_V4). */
const vd_function_kernels *vd_function_kernels_for(vd_isa isa);

/* One operation on one point, the plain reference (also folds constants). */
float vd_function_apply(vd_function_op op, float a, float b, float c);

/* Gradient noise of one octave: `seed` is the octave. In (−1, 1). */
float vd_function_noise(float x, float y, uint32_t seed);

/* The number of octaves that a value asks for: 1 … 16. */
float vd_function_octaves(float octaves);

#endif

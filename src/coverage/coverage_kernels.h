/* coverage_kernels.h: the hot loops of this room, once plain and once per SIMD level.
 *
 * Contract: any count >= 0, any alignment of the element type, no access outside [0, count), `out`
 * must not overlap the inputs. A product of two 16-bit values is rounded to nearest: with
 * v = a·b + 32768, (v + (v >> 16)) >> 16. Every table gives the same bytes as the reference
 * (check_kernels compares them).
 */
#ifndef VEDUTA_COVERAGE_COVERAGE_KERNELS_H
#define VEDUTA_COVERAGE_COVERAGE_KERNELS_H

#include <veduta/context.h>

/* Sums areas from left to right, sum = base + areas[0] + … + areas[i], cut to 0 … 2^24, and clears
 * them: out[i] = (sum − (sum >> 16) + 128) >> 8, that is round(65535 · sum / 2^24). */
typedef void vd_kernel_sum_areas(uint16_t *restrict out, int32_t *restrict areas, int32_t base,
                                 size_t count);

/* Per pixel and channel: s = color · coverage, out = min(s + out · (65535 − s.alpha), 65535).
 * `coverage` may be null: 65535. `out` is [count][4]. */
typedef void vd_kernel_blend_color(uint16_t *restrict out, const uint16_t *restrict coverage,
                                   const uint16_t color[4], size_t count);

/* The same, a color for each pixel: [count][4]. */
typedef void vd_kernel_blend_colors(uint16_t *restrict out, const uint16_t *restrict coverage,
                                    const uint16_t *restrict colors, size_t count);

typedef struct vd_coverage_kernels {
    vd_kernel_sum_areas *sum_areas;
    vd_kernel_blend_color *blend_color;
    vd_kernel_blend_colors *blend_colors;
} vd_coverage_kernels;

extern const vd_coverage_kernels vd_coverage_kernels_reference;
extern const vd_coverage_kernels vd_coverage_kernels_v2;
extern const vd_coverage_kernels vd_coverage_kernels_v3;
extern const vd_coverage_kernels vd_coverage_kernels_v4;

/* Returns the table of a level (VD_ISA_V2 … VD_ISA_V4). */
const vd_coverage_kernels *vd_coverage_kernels_for(vd_isa isa);

#endif

/* image_kernels.h: the hot loops of this room, once plain and once per SIMD level.
 *
 * Contract of both kernels: any count >= 0, any alignment of the element type, no access outside
 * [0, count), `out` must not overlap the inputs. Every table gives the same bytes as the reference
 * (check_kernels compares them).
 */
#ifndef VEDUTA_IMAGE_KERNELS_H
#define VEDUTA_IMAGE_KERNELS_H

#include <veduta/context.h>

/* Averages `samples` (1, 4 or 8) planes, `plane` values apart, of `count` 16-bit values each:
 *   mean = (sum + samples/2) / samples;  out = vd_round_16_to_8(mean) */
typedef void vd_kernel_resolve_color(uint8_t *restrict out, const uint16_t *restrict in,
                                     size_t plane, int samples, size_t count);

/* Picks, for each of `count` pixels, depth and id of the sample with the greatest depth, of equals
 * the first; a NaN depth is never greater. `out_depth` or `out_id` may be null. */
typedef void vd_kernel_resolve_nearest(float *restrict out_depth, uint32_t *restrict out_id,
                                       const float *restrict depth, const uint32_t *restrict id,
                                       size_t plane, int samples, size_t count);

typedef struct vd_image_kernels {
    vd_kernel_resolve_color *resolve_color;
    vd_kernel_resolve_nearest *resolve_nearest;
} vd_image_kernels;

extern const vd_image_kernels vd_image_kernels_reference;
extern const vd_image_kernels vd_image_kernels_v2;
extern const vd_image_kernels vd_image_kernels_v3;
extern const vd_image_kernels vd_image_kernels_v4;

/* Returns the table of a level (VD_ISA_V2 … VD_ISA_V4). */
const vd_image_kernels *vd_image_kernels_for(vd_isa isa);

#endif

/* target.h: where drawing happens, with S samples a pixel.
 *
 * A target is a window [x, x + width) × [y, y + height) of a picture, so that a renderer can work
 * in small tiles that stay in cache and resolve each into the frame. Three planes, sample-major:
 *   color  uint16_t [samples][height][stride][4]  sRGB-encoded, alpha premultiplied, 65535 = 1
 *   depth  float    [samples][height][stride]     reversed depth, 0 = nothing
 *   id     uint32_t [samples][height][stride]     frame id, 0 = nothing
 * Samples sit at one fixed pattern (vd_sample_offsets); with S = 1 at the pixel's centre.
 */
#ifndef VEDUTA_TARGET_H
#define VEDUTA_TARGET_H

#include <veduta/frame.h>

VD_BEGIN_DECLARATIONS

typedef struct vd_target {
    vd_context *context;
    int x, y;          /* the window's upper left pixel within the picture */
    int width, height; /* the window's size; may be lowered up to the size at creation */
    int samples;       /* 1, 4 or 8 */
    size_t stride;     /* pixels from one row to the next; fixed at creation */
    size_t plane;      /* pixels from one sample's plane to the next; fixed at creation */
    uint16_t *color;
    float *depth;
    uint32_t *id;
} vd_target;

/* Creates a target of at most width × height pixels, its contents undefined until vd_target_clear.
 * Returns VD_ERROR_ARGUMENT (size below 1, samples not 1, 4 or 8), VD_ERROR_LIMIT or
 * VD_ERROR_MEMORY. */
VD_API VD_MUST_USE vd_status vd_target_create(vd_context *context, int width, int height,
                                              int samples, vd_target **out);
VD_API void vd_target_destroy(vd_target **target);

/* Sets every sample of the window to `color` (RGBA, encoded, premultiplied, 65535 = 1), depth 0,
 * id 0. */
VD_API void vd_target_clear(vd_target *target, const uint16_t color[4]);

/* Returns the offsets of the samples from the pixel's upper left corner, in pixels, [samples][2]
 * as x, y; null unless samples is 1, 4 or 8. The patterns for 4 and 8 are the rotated grids that
 * Direct3D 11 and Vulkan call standard. */
VD_API const float (*vd_sample_offsets(int samples))[2];

/* Averages the samples of each pixel of the window into the frame at (target->x, target->y):
 * colour is the rounded mean in encoded space; depth and id are those of the nearest sample (the
 * greatest depth; of equals the first). The window must lie within the frame. Several threads may
 * resolve into one frame at once if their windows do not overlap. */
VD_API void vd_target_resolve(const vd_target *target, vd_frame *frame);

VD_END_DECLARATIONS

#endif

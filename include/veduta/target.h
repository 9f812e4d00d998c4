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

#include <stdbool.h>
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
    struct vd_blended *blended; /* [samples][height][stride]; null until reserved, see below */
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

/* ---- what lets things behind it shine through ------------------------------------------------
 * All rooms that blend add to one list of the target, which is then blended over its colours
 * sample by sample, farthest first: by depth, of equals the greater order first. The list holds a
 * fixed number of things a sample; where there are more, the farthest come first and all is added
 * again, as often as it takes:
 *
 *     vd_target_begin_blended(target);
 *     do {
 *         vd_raster_blend(raster, target, worker);   and whoever else blends, the same every time
 *     } while (vd_target_blend(target));
 *
 * Depth and id of the target stay those of what is opaque. */

/* Makes room for the list, 192 bytes a sample; a second call does nothing. Returns
 * VD_ERROR_MEMORY. */
VD_API VD_MUST_USE vd_status vd_target_reserve_blended(vd_target *target);

/* Begins the window's list. The target must have been reserved. */
VD_API void vd_target_begin_blended(vd_target *target);

/* Adds one thing at a sample, an index into the planes: `color` as the target's (encoded,
 * premultiplied). It is dropped where the target's depth is greater; of equals it is seen. `order`
 * tells things of one depth apart: what has both alike at a sample counts once. By convention it is
 * frame id · 2^32 + a number of the room's own. */
VD_API void vd_target_add_blended(vd_target *target, size_t sample, float depth, uint64_t order,
                                  const uint16_t color[4]);

/* Blends what the list holds over the window's colours: c + (65535 − alpha)·there / 65535, rounded.
 * Returns whether some sample had more than its list holds: then add everything again. */
VD_API bool vd_target_blend(vd_target *target);

VD_END_DECLARATIONS

#endif

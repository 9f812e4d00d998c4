/* texture.h: pictures on surfaces, with a pyramid of smaller ones and the filters that read it.
 *
 * Texel (i, j) covers [i, i + 1) × [j, j + 1) of the level's width × height; texture coordinates
 * (0, 0) and (1, 1) are the upper left and lower right corner of all levels, and repeat outside.
 * Texels are sRGB-encoded with alpha multiplied in, and are averaged and filtered as they are (one
 * rule for the whole library, see color.h); what a filter returns is encoded and straight.
 */
#ifndef VEDUTA_TEXTURE_H
#define VEDUTA_TEXTURE_H

#include <veduta/picture.h>

VD_BEGIN_DECLARATIONS

typedef struct vd_texture vd_texture;

typedef enum vd_texture_filter {
    VD_TEXTURE_TRILINEAR = 0, /* Williams 1983: bilinear on two levels, and between them */
    VD_TEXTURE_NEAREST,       /* the texel at the position, on the finest level */
    VD_TEXTURE_BILINEAR,      /* four texels of the finest level */
    VD_TEXTURE_ANISOTROPIC,   /* elliptical weighted average (Heckbert 1989, §3.5), at most 16:1 */
    VD_TEXTURE_FILTER_COUNT
} vd_texture_filter;

/* Makes a texture and its pyramid from a picture of 1 to 4 channels (alpha not multiplied in). Each
 * level is half the last, rounded down but at least 1, each texel the mean of what it covers. *out
 * is owned by the caller. Returns VD_ERROR_LIMIT (a side above 16384) or VD_ERROR_MEMORY. */
VD_API VD_MUST_USE vd_status vd_texture_create(vd_context *context, const vd_picture *picture,
                                               vd_texture **out);
VD_API void vd_texture_destroy(vd_texture **texture);

VD_API int vd_texture_levels(const vd_texture *texture);

/* Returns width and height of a level, and its texels: RGBA, 4 × 8 bits, alpha multiplied in,
 * [height][width]. */
VD_API const uint8_t *vd_texture_level_texels(const vd_texture *texture, int level, int *width,
                                              int *height);

/* Filters at sixteen places: `uv` [2][16], its change to the next pixel to the right and below
 * [2][16] each (may be null for NEAREST and BILINEAR; trilinear and anisotropic then read the
 * finest level), into `color` [4][16]: encoded, straight, 0 … 1. */
VD_API void vd_texture_sample(const vd_texture *texture, vd_texture_filter filter,
                              const float (*uv)[16], const float (*uv_dx)[16],
                              const float (*uv_dy)[16], float (*color)[16]);

/* Returns "trilinear", "nearest", "bilinear" or "anisotropic". */
VD_API const char *vd_texture_filter_name(vd_texture_filter filter);

VD_END_DECLARATIONS

#endif

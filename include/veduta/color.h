/* color.h: the one colour rule.
 *
 * Textures, files and frames are sRGB-encoded (IEC 61966-2-1). Lighting is computed on linear
 * values and encoded through an integer table; premultiplying, filtering, blending and resolving
 * happen on encoded values in integers, as browsers do. No libm: the same bytes everywhere.
 */
#ifndef VEDUTA_COLOR_H
#define VEDUTA_COLOR_H

#include <stdint.h>
#include <veduta/api.h>

VD_BEGIN_DECLARATIONS

/* A straight (not premultiplied) sRGB colour, 0 … 255 each. */
typedef struct vd_rgba8 {
    uint8_t r, g, b, a;
} vd_rgba8;

/* A linear colour; 1 is the brightest displayable value, more is clipped when encoding. */
typedef struct vd_linear {
    float r, g, b;
} vd_linear;

/* Returns the linear value 0 … 1 of an encoded 8-bit value. */
VD_API float vd_srgb_decode(uint8_t encoded);

/* Returns the encoded value of a linear one, 0 … 65535; values outside 0 … 1 are clamped, NaN
 * gives 0. Within 4 units of the exact curve, monotone, and exact to 8 bits for decoded bytes:
 * vd_round_16_to_8(vd_srgb_encode(vd_srgb_decode(b))) == b. */
VD_API uint16_t vd_srgb_encode(float linear);

VD_API vd_linear vd_linear_from_rgba8(vd_rgba8 color);

/* Returns round(v / 257): the 8-bit value nearest to a 16-bit one. */
static inline uint8_t vd_round_16_to_8(uint32_t v) {
    return (uint8_t)((v * 255u + 32895u) >> 16);
}

VD_END_DECLARATIONS

#endif

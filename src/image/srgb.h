/* srgb.h: between sRGB bytes and linear light by polynomials, for kernels that convert many values:
 * one order of operations, so that plain references and their wide twins agree to the bit. For
 * single values vd_srgb_encode (<veduta/color.h>) is finer. */
#ifndef VEDUTA_IMAGE_SRGB_H
#define VEDUTA_IMAGE_SRGB_H

#include <math.h>
#include <stdint.h>

/* The colours of texels between bytes and linear light, by polynomials, as tables would need six
 * gathers a texel: each is linear on the curve's toe (IEC 61966-2-1) and within 0.05 (decoding) and
 * 0.09 (encoding) of 1/255 encoded beyond it, so that an unlit byte comes back the same. Encoding
 * is one in the square root s, where the curve is nearly straight; of degree 5 it would be 0.18
 * off. Decoding, of an encoded e from 0 to 1, of degree 3 0.28. */
#define VD_SRGB_LINEAR_TOE 0.0031308f
#define VD_SRGB_ENCODED_TOE 0.041f
#define VD_SRGB_ENCODE(s)                                                                          \
    ((((((-0.58427069f * (s) + 2.2484991f) * (s)-3.5527475f) * (s) + 3.0326165f) *                 \
       (s)-1.6456115f) *                                                                           \
          (s) +                                                                                    \
      1.5423364f) *                                                                                \
     (s)-0.04086402f)
#define VD_SRGB_DECODE(e)                                                                          \
    ((((-0.11539202f * (e) + 0.52385174f) * (e) + 0.5619586f) * (e) + 0.028080607f) * (e) +        \
     0.0010636013f)

static inline float vd_srgb_byte_decode(uint32_t byte) {
    const float e = (float)byte * (1.0f / 255.0f);
    return e < VD_SRGB_ENCODED_TOE ? e * (1.0f / 12.92f) : VD_SRGB_DECODE(e);
}

static inline uint32_t vd_srgb_byte_encode(float linear) {
    linear = linear > 0.0f ? linear : 0.0f; /* also NaN */
    linear = linear < 1.0f ? linear : 1.0f;
    const float s = sqrtf(linear);
    const float encoded = linear < VD_SRGB_LINEAR_TOE ? linear * 12.92f : VD_SRGB_ENCODE(s);
    return (uint32_t)(int32_t)(encoded * 255.0f + 0.5f);
}

#endif

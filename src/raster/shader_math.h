/* shader_math.h: what fragment functions do lane by lane, in one order of operations. */
#ifndef VEDUTA_RASTER_SHADER_MATH_H
#define VEDUTA_RASTER_SHADER_MATH_H

#include <math.h>
#include "image/srgb.h"
#include "raster/raster_internal.h"

#define VD_EACH_LANE(i) for (int i = 0; i < VD_BATCH; i++)

typedef float vd_shader_lanes[VD_BATCH] __attribute__((aligned(64)));

static inline float vd_shader_clamp(float v) {
    v = v > 0.0f ? v : 0.0f;
    return v < 1.0f ? v : 1.0f;
}

/* Within 0.09 / 255 of the curve (image/srgb.h). */
static inline float vd_shader_encode(float linear) {
    const float v = vd_shader_clamp(linear), s = sqrtf(v);
    return v < VD_SRGB_LINEAR_TOE ? v * 12.92f : VD_SRGB_ENCODE(s);
}

static inline float vd_shader_power(float base, int exponent) {
    float result = 1.0f;
    for (; exponent > 0; exponent /= 2) {
        result = exponent % 2 != 0 ? result * base : result;
        base = base * base;
    }
    return result;
}

#endif

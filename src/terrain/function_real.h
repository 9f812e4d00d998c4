/* function_real.h: the numbers behind sin, cos, atan2, exp, log and noise, shared by the reference
 * and the kernels, and the plain logarithm, exponential and power in double.
 *
 * The polynomials are our own minimax fits (Remez exchange at 50 digits, weighted for relative
 * error of the function, rounded to float afterwards). The size of the relative error of the fit
 * stands beside each; half a unit of float is 6e-8.
 */
#ifndef VEDUTA_TERRAIN_FUNCTION_REAL_H
#define VEDUTA_TERRAIN_FUNCTION_REAL_H

#include <math.h>
#include <stdint.h>
#include <string.h>

/* π/2 in three parts of 8 bits and a rest (Cody & Waite 1980). n × part is exact for n up to 2^16,
 * that is for |x| up to 102,943, and so are the differences while they cancel. Beyond, the error
 * grows to the size of the float step of x itself. */
#define VD_HALF_PI_1 0x1.92p+0f
#define VD_HALF_PI_2 0x1.fap-12f
#define VD_HALF_PI_3 0x1.54p-20f
#define VD_HALF_PI_4 0x1.10b462p-30f
#define VD_TWO_OVER_PI 0.636619772f
#define VD_ANGLE_LIMIT                                                                             \
    4194304.0f             /* from here on sin is 0, cos 1: neighbouring floats are 0.5 apart */
#define VD_REST_LIMIT 0.8f /* π/4 and what rounding adds; holds sin and cos in [−1, 1] */

/* sin r = r + r z (S1 + z (S2 + z S3)), z = r²: 3.7e-9 */
#define VD_SIN_1 -0.16666655242443085f
#define VD_SIN_2 0.008332154713571072f
#define VD_SIN_3 -0.0001951407757587731f
/* cos r = 1 − (z/2 − z² (C1 + z (C2 + z C3))): 1.0e-10 */
#define VD_COS_1 0.04166664555668831f
#define VD_COS_2 -0.0013887337408959866f
#define VD_COS_3 2.4434837541775778e-05f

/* atan t = t + t z (A1 + …), |t| <= tan π/8: 2.0e-8 */
#define VD_ATAN_1 -0.33332952857017517f
#define VD_ATAN_2 0.19977807998657227f
#define VD_ATAN_3 -0.1387845277786255f
#define VD_ATAN_4 0.08055445551872253f
#define VD_TAN_EIGHTH 0.41421357f
#define VD_QUARTER_PI 0.785398163f
#define VD_HALF_PI 1.57079633f
#define VD_WHOLE_PI 3.14159265f

/* e^r = 1 + (r + r² (E2 + r (E3 + …))), |r| <= ln 2 / 2: 3.2e-9 */
#define VD_EXP_2 0.5f
#define VD_EXP_3 0.16666516661643982f
#define VD_EXP_4 0.04166619852185249f
#define VD_EXP_5 0.008369239047169685f
#define VD_EXP_6 0.0013951098080724478f
#define VD_EXP_LOW -104.0f /* e^−104 rounds to 0 */
#define VD_EXP_HIGH 89.0f  /* e^89 to infinity */
#define VD_LOG2_E 1.44269504f
#define VD_LN2_HIGH 0x1.62e4p-1f /* 15 bits: n × it is exact for |n| < 2^9 */
#define VD_LN2_LOW 0x1.7f7d1cp-20f

/* log(1+f) = 2s + s z (L1 + z (L2 + z L3)), s = f/(2+f), z = s², √½ <= 1+f < √2: 1.7e-9 */
#define VD_LOG_1 0.6666678190231323f
#define VD_LOG_2 0.3997707962989807f
#define VD_LOG_3 0.29885220527648926f
#define VD_SQRT_HALF_BITS 0x3f3504f3u

/* Hash of a lattice point: odd multipliers, then two rounds of shift and multiply. */
#define VD_HASH_X 0x9E3779B1u
#define VD_HASH_Y 0x85EBCA77u
#define VD_HASH_SEED 0xC2B2AE3Du
#define VD_HASH_1 0x2C1B3C6Du
#define VD_HASH_2 0x297A2D39u
#define VD_NOISE_LIMIT 1073741824.0f /* beyond, all points lie in lattice column 0 */

/* From one octave to the next: turned by atan(3/4) and twice as fine, so that lattice points of
 * different octaves do not coincide. */
#define VD_OCTAVE_COS 1.6f
#define VD_OCTAVE_SIN 1.2f

/* The same for double. A whole number from −1024 to 3071 becomes a double, and a double is rounded
 * to a whole number, by adding 2^52 or 1.5 · 2^52: what every SIMD level has. */
#define VD_SQRT_HALF_BITS_64 UINT64_C(0x3fe6a09e667f3bcd)
#define VD_WHOLE_BITS_64 UINT64_C(0x4330000000000000) /* of 2^52 */
#define VD_WHOLE_64 0x1p52
#define VD_ROUND_64 0x1.8p52
#define VD_LOG2_E_64 1.44269504088896340736
#define VD_LN2_64 0.69314718055994530942
#define VD_LN2_HIGH_64 6.93147180369123816490e-01
#define VD_LN2_LOW_64 1.90821492927058770002e-10

/* ln a for a > 0 finite, to 1e-14: the series of 2 artanh(f/(2+f)) on √½ … √2. */
static inline double vd_function_log_double(double a) {
    uint64_t bits;
    memcpy(&bits, &a, sizeof bits);
    const uint64_t biased = (bits - VD_SQRT_HALF_BITS_64 + (UINT64_C(1024) << 52)) >> 52;
    const uint64_t whole = biased | VD_WHOLE_BITS_64;
    double exponent, m;
    memcpy(&exponent, &whole, sizeof exponent);
    exponent = exponent - (VD_WHOLE_64 + 1024.0);
    bits -= (biased - 1024u) << 52;
    memcpy(&m, &bits, sizeof m);
    const double f = m - 1.0, s = f / (2.0 + f), z = s * s;
    double p = 1.0 / 17.0;
    p = p * z + 1.0 / 15.0;
    p = p * z + 1.0 / 13.0;
    p = p * z + 1.0 / 11.0;
    p = p * z + 1.0 / 9.0;
    p = p * z + 1.0 / 7.0;
    p = p * z + 1.0 / 5.0;
    p = p * z + 1.0 / 3.0;
    return exponent * VD_LN2_64 + 2.0 * (s + s * z * p);
}

/* e^y for |y| <= 200, to 1e-14. */
static inline double vd_function_exp_double(double y) {
    const double shifted = y * VD_LOG2_E_64 + VD_ROUND_64, n = shifted - VD_ROUND_64;
    const double r = (y - n * VD_LN2_HIGH_64) - n * VD_LN2_LOW_64;
    double p = 1.0 / 39916800.0;
    p = p * r + 1.0 / 3628800.0;
    p = p * r + 1.0 / 362880.0;
    p = p * r + 1.0 / 40320.0;
    p = p * r + 1.0 / 5040.0;
    p = p * r + 1.0 / 720.0;
    p = p * r + 1.0 / 120.0;
    p = p * r + 1.0 / 24.0;
    p = p * r + 1.0 / 6.0;
    p = p * r + 0.5;
    p = p * r + 1.0;
    p = p * r + 1.0;
    uint64_t bits;
    memcpy(&bits, &shifted, sizeof bits);
    bits = (bits + 1023u) << 52; /* the low bits of `shifted` are n */
    double scale;
    memcpy(&scale, &bits, sizeof scale);
    return p * scale;
}

/* a^b through double, so that it is right to a float's last bit but for ties (b ln a may be 88, and
 * its float would be off by 60 units of the result). 1 for b = 0; a negative base needs a whole
 * exponent, else NaN; 0 to a negative power is infinity. */
static inline float vd_function_pow(float a, float b) {
    if (b == 0.0f) {
        return 1.0f;
    }
    const double size = fabs((double)a);
    const double l = size == 0.0               ? -(double)INFINITY
                     : size < (double)INFINITY ? vd_function_log_double(size)
                                               : size; /* infinity or NaN */
    double y = (double)b * l;
    if (y != y || (a < 0.0f && floorf(b) != b)) {
        return NAN;
    }
    y = y < -200.0 ? -200.0 : y;
    y = y > 200.0 ? 200.0 : y;
    const double p = vd_function_exp_double(y);
    const bool odd = b - 2.0f * floorf(b * 0.5f) == 1.0f;
    /* 3.5e38 is beyond the largest float: the conversion must not be asked for more. */
    const float result = p > 3.5e38 ? INFINITY : (float)p;
    return a < 0.0f && odd ? -result : result;
}

#endif

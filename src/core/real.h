/* real.h: elementary functions that give the same bits on every machine.
 *
 * The C library's sin, cos, exp, atan2 may differ in the last bit between processors and versions;
 * a picture must not. These use only +, −, ×, ÷, sqrt and floor in a fixed order. Errors are below
 * 1e-15 relative for sin, cos, tan, exp on the ranges given, absolute 1e-15 for atan2.
 */
#ifndef VEDUTA_CORE_REAL_H
#define VEDUTA_CORE_REAL_H

#include <math.h>
#include <stdint.h>
#include <string.h>

#define VD_PI 3.14159265358979323846

static inline double vd_radians(double degrees) {
    return degrees * (VD_PI / 180.0);
}
static inline double vd_degrees(double radians) {
    return radians * (180.0 / VD_PI);
}

/* |x| up to 1e6; larger arguments lose accuracy gradually. NaN and infinities give NaN. */
double vd_sin(double x);
double vd_cos(double x);
double vd_tan(double x);

/* Angle of (x, y) in (−π, π]; 0 for (0, 0). */
double vd_atan2(double y, double x);

/* e^x; 0 below −708, infinity above 709. */
double vd_exp(double x);

/* Logarithm to the base 2, within 1e-13; x > 0 and finite, denormal numbers as 2^−1022. */
double vd_log2(double x);

/* 2^x for x <= 0, by the exponent and a polynomial on the fraction (minimax, 4·10^−6); what haze
 * leaves of a colour. Below −126 as at −126. */
static inline float vd_exp2_negative(float x) {
    const float clamped = -126.0f < x ? x : -126.0f;
    const float whole = floorf(clamped), f = clamped - whole;
    float p = 0.0135557f;
    p = p * f + 0.0520323f;
    p = p * f + 0.2413793f;
    p = p * f + 0.6930327f;
    p = p * f + 1.0000026f;
    const uint32_t bits = (uint32_t)((int)whole + 127) << 23;
    float scale;
    memcpy(&scale, &bits, sizeof scale);
    return p * scale;
}

#endif

#include <math.h>
#include <stdint.h>
#include <string.h>
#include "core/real.h"

/* π/2 in three parts of 33 bits (Cody & Waite 1980): n × part is exact for |n| < 2^20. */
#define HALF_PI_1 1.57079632673412561417e+00
#define HALF_PI_2 6.07710050630396597660e-11
#define HALF_PI_3 2.02226624879595063154e-21

/* Taylor series on |x| <= π/4: the first dropped term is below 1e-19. */
static double sin_small(double x) {
    double x2 = x * x;
    double p = -1.0 / 121645100408832000.0; /* −1/19! */
    p = p * x2 + 1.0 / 355687428096000.0;
    p = p * x2 - 1.0 / 1307674368000.0;
    p = p * x2 + 1.0 / 6227020800.0;
    p = p * x2 - 1.0 / 39916800.0;
    p = p * x2 + 1.0 / 362880.0;
    p = p * x2 - 1.0 / 5040.0;
    p = p * x2 + 1.0 / 120.0;
    p = p * x2 - 1.0 / 6.0;
    return x + x * x2 * p;
}

static double cos_small(double x) {
    double x2 = x * x;
    double p = -1.0 / 6402373705728000.0; /* −1/18! */
    p = p * x2 + 1.0 / 20922789888000.0;
    p = p * x2 - 1.0 / 87178291200.0;
    p = p * x2 + 1.0 / 479001600.0;
    p = p * x2 - 1.0 / 3628800.0;
    p = p * x2 + 1.0 / 40320.0;
    p = p * x2 - 1.0 / 720.0;
    p = p * x2 + 1.0 / 24.0;
    return 1.0 - (0.5 * x2 - x2 * x2 * p);
}

/* Reduces x to [−π/4, π/4] and returns the quadrant 0 … 3. */
static int reduce(double x, double *rest) {
    double n = floor(x * (2.0 / VD_PI) + 0.5);
    *rest = ((x - n * HALF_PI_1) - n * HALF_PI_2) - n * HALF_PI_3;
    double quadrant = n - 4.0 * floor(n * 0.25);
    return (int)quadrant;
}

static double sin_quadrant(int quadrant, double x) {
    switch (quadrant & 3) {
    case 0:
        return sin_small(x);
    case 1:
        return cos_small(x);
    case 2:
        return -sin_small(x);
    default:
        return -cos_small(x);
    }
}

double vd_sin(double x) {
    if (!(fabs(x) < 1e15)) {
        return (double)NAN;
    }
    double rest;
    int quadrant = reduce(x, &rest);
    return sin_quadrant(quadrant, rest);
}

double vd_cos(double x) {
    if (!(fabs(x) < 1e15)) {
        return (double)NAN;
    }
    double rest;
    int quadrant = reduce(x, &rest);
    return sin_quadrant(quadrant + 1, rest);
}

double vd_tan(double x) {
    return vd_sin(x) / vd_cos(x);
}

/* atan on [0, 1]: three half-angle steps bring the argument below 0.1, where the series ends soon.
 */
static double atan_unit(double x) {
    for (int i = 0; i < 3; i++) {
        x = x / (1.0 + sqrt(1.0 + x * x));
    }
    double x2 = x * x, p = 0.0;
    for (int k = 19; k >= 3; k -= 2) {
        p = (p + ((k & 2) != 0 ? -1.0 : 1.0) / k) * x2;
    }
    return 8.0 * (x + x * p);
}

double vd_atan2(double y, double x) {
    double ax = fabs(x), ay = fabs(y), angle;
    if (ax == 0.0 && ay == 0.0) {
        return 0.0;
    }
    angle = ax >= ay ? atan_unit(ay / ax) : 0.5 * VD_PI - atan_unit(ax / ay);
    if (x < 0.0) {
        angle = VD_PI - angle;
    }
    return y < 0.0 ? -angle : angle;
}

/* e^x = 2^n e^r with |r| <= ln 2 / 2; the Taylor series to r^13 leaves less than 1e-17. */
double vd_exp(double x) {
    if (x != x) {
        return x;
    }
    if (x < -708.0) {
        return 0.0;
    }
    if (x > 709.0) {
        return (double)INFINITY;
    }
    double n = floor(x * 1.44269504088896340736 + 0.5);
    double r = (x - n * 6.93147180369123816490e-01) - n * 1.90821492927058770002e-10;
    double p = 1.0;
    for (int k = 13; k >= 1; k--) {
        p = 1.0 + p * r / k;
    }
    return ldexp(p, (int)n);
}

double vd_log2(double x) {
    uint64_t bits;
    memcpy(&bits, &x, sizeof bits);
    int exponent = (int)(bits >> 52 & 2047) - 1023;
    if (exponent < -1022) {
        return -1022.0;
    }
    bits = (bits & 0xFFFFFFFFFFFFFu) | 0x3FF0000000000000u;
    double m;
    memcpy(&m, &bits, sizeof m);
    if (m > 1.4142135623730951) {
        m *= 0.5;
        exponent++;
    }
    /* ln m = 2 atanh s: |s| < 0.1716, the first dropped term is below 1e-14. */
    const double s = (m - 1.0) / (m + 1.0), s2 = s * s;
    double p = 1.0 / 15.0;
    p = p * s2 + 1.0 / 13.0;
    p = p * s2 + 1.0 / 11.0;
    p = p * s2 + 1.0 / 9.0;
    p = p * s2 + 1.0 / 7.0;
    p = p * s2 + 1.0 / 5.0;
    p = p * s2 + 1.0 / 3.0;
    p = p * s2 + 1.0;
    return exponent + 2.885390081777926815 * s * p; /* 2 / ln 2 */
}

/* round_numbers.c: round steps and their multiples. */
#include "world/round_numbers.h"

#include <math.h>
#include <stdio.h>

/* 10^e; powers of ten up to 10^22 are exact, so a quotient is as near as can be. */
static double scaled(double mantissa, int e) {
    double power = 1;
    for (int i = 0; i < e || i < -e; i++) {
        power *= 10;
    }
    return e < 0 ? mantissa / power : mantissa * power;
}

/* The e with 10^e <= value < 10^(e + 1), −9 … 18. */
static int exponent_of(double value) {
    int e = -9;
    while (e < 18 && scaled(1, e + 1) <= value) {
        e++;
    }
    return e;
}

double vd_round_length(double most, int *parts) {
    const int e = exponent_of(most);
    const int mantissa = scaled(5, e) <= most ? 5 : scaled(2, e) <= most ? 2 : 1;
    *parts = mantissa == 2 ? 4 : 5;
    return scaled(mantissa, e);
}

/* The multiples of a step within a range: the first and how many, a billionth aside. */
static double count_multiples(double min, double max, double step, double *first) {
    *first = ceil(min / step - 1e-9);
    return floor(max / step + 1e-9) - *first + 1;
}

int vd_round_labels(double min, double max, double out[VD_ROUND_LABELS], double *step) {
    static const struct {
        double mantissa;
        int tier;
    } steps[] = {{1, 0}, {2, 0}, {5, 0}, {2.5, 1}, {4, 1}, {3, 2}, {1.5, 2}, {7.5, 2}};
    if (!(max - min >= 1e-6 && fabs(min) < 1e9 && fabs(max) < 1e9) ||
        max - min < 1e-6 * (fabs(min) + fabs(max))) {
        return 0;
    }
    const int e = exponent_of(max - min);
    double best = 0;
    for (int tier = 0; tier < 3 && best == 0; tier++) {
        for (size_t i = 0; i < sizeof steps / sizeof steps[0]; i++) {
            for (int down = 0; down < 2 && steps[i].tier == tier; down++) {
                const double candidate = scaled(steps[i].mantissa, e - down);
                double first;
                const double count = count_multiples(min, max, candidate, &first);
                if (count > best && count >= 4 && count <= VD_ROUND_LABELS) {
                    best = count;
                    *step = candidate;
                    for (int k = 0; k < (int)count; k++) {
                        out[k] = (first + k) * candidate;
                    }
                }
            }
        }
    }
    return (int)best;
}

void vd_round_text(double value, double step, char *out, size_t out_bytes) {
    int decimals = 0;
    long long unit = 1;
    while (decimals < 6 && fabs(step * (double)unit - floor(step * (double)unit + 0.5)) > 1e-6) {
        unit *= 10;
        decimals++;
    }
    const long long all = (long long)floor(fabs(value) * (double)unit + 0.5);
    const char *sign = value < 0 && all != 0 ? "\xE2\x88\x92" : "";
    if (decimals == 0) {
        snprintf(out, out_bytes, "%s%lld", sign, all);
    } else {
        snprintf(out, out_bytes, "%s%lld.%0*lld", sign, all / unit, decimals, all % unit);
    }
}

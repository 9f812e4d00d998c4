/* function_bounds.c: what a formula can be over a rectangle, by interval arithmetic (Moore 1966).
 *
 * An interval says where the *floats* that the kernels compute can lie, not the real numbers that
 * they approximate. For + − × ÷, sqrt, floor, min, max, abs that costs nothing: correctly rounded
 * operations are monotone in each operand, so the same float operation on the ends gives exact ends
 * of the result. The functions that we approximate ourselves (sin … pow) are computed in double at
 * the ends and widened by MARGIN, which is above their error (docs/function-terrain.md: at most
 * 4e-7); so a dip between two ends by a not quite monotone approximation is inside too.
 *
 * Noise: at most the value at the centre plus steepest slope × distance, per octave, and never more
 * than its range. `nan` tells that a value may also be NaN; [lo, hi] then holds the others.
 */
#include <float.h>
#include <math.h>
#include "core/real.h"
#include "terrain/function_kernels.h"
#include "terrain/function_real.h"

#define MARGIN 1e-6

typedef struct interval {
    float lo, hi;
    bool nan;
} interval;

static const interval anything = {-INFINITY, INFINITY, true};

static interval between(float lo, float hi, bool nan) {
    if (!(lo <= hi)) { /* also NaN */
        return anything;
    }
    const interval v = {lo, hi, nan};
    return v;
}

static float lesser(float a, float b) {
    return a < b ? a : b;
}

static float greater(float a, float b) {
    return a > b ? a : b;
}

static interval hull(interval a, interval b) {
    const interval v = {lesser(a.lo, b.lo), greater(a.hi, b.hi), a.nan || b.nan};
    return v;
}

/* Doubles to floats outside them, with the margin of our own approximations. */
static interval widened(double lo, double hi, bool nan) {
    const double l = lo - MARGIN * fabs(lo) - MARGIN * 1e-30;
    const double h = hi + MARGIN * fabs(hi) + MARGIN * 1e-30;
    return between(l < -FLT_MAX ? -INFINITY : (float)l, h > FLT_MAX ? INFINITY : (float)h, nan);
}

static bool has_zero(interval v) {
    return v.lo <= 0.0f && v.hi >= 0.0f;
}

static bool has_infinity(interval v) {
    return v.lo == -INFINITY || v.hi == INFINITY;
}

/* ---- arithmetic -------------------------------------------------------------------------------
 */

static interval add(interval a, interval b) {
    const bool cancels =
        (a.lo == -INFINITY && b.hi == INFINITY) || (a.hi == INFINITY && b.lo == -INFINITY);
    return between(a.lo + b.lo, a.hi + b.hi, a.nan || b.nan || cancels);
}

static interval negate(interval a) {
    return between(-a.hi, -a.lo, a.nan);
}

/* The least and the greatest of four corners; NaN among them gives anything. */
static interval corners(float a, float b, float c, float d, bool nan) {
    if (a != a || b != b || c != c || d != d) {
        return anything;
    }
    return between(lesser(lesser(a, b), lesser(c, d)), greater(greater(a, b), greater(c, d)), nan);
}

static interval multiply(interval a, interval b, bool same) {
    if (same && !has_infinity(a)) { /* a square */
        const float low = a.lo * a.lo, high = a.hi * a.hi;
        return between(has_zero(a) ? 0.0f : lesser(low, high), greater(low, high), a.nan);
    }
    const bool undefined =
        (has_zero(a) && has_infinity(b)) || (has_zero(b) && has_infinity(a)) || a.nan || b.nan;
    return corners(a.lo * b.lo, a.lo * b.hi, a.hi * b.lo, a.hi * b.hi, undefined);
}

static interval divide(interval a, interval b) {
    if (has_zero(b)) {
        return anything;
    }
    const bool undefined = (has_infinity(a) && has_infinity(b)) || a.nan || b.nan;
    return corners(a.lo / b.lo, a.lo / b.hi, a.hi / b.lo, a.hi / b.hi, undefined);
}

/* a < b ? a : b is b when one of them is NaN. */
static interval minimum(interval a, interval b) {
    const interval v = between(lesser(a.lo, b.lo), lesser(a.hi, b.hi), b.nan);
    return a.nan || b.nan ? hull(v, b) : v;
}

static interval maximum(interval a, interval b) {
    const interval v = between(greater(a.lo, b.lo), greater(a.hi, b.hi), b.nan);
    return a.nan || b.nan ? hull(v, b) : v;
}

static interval magnitude(interval a) {
    const float low = fabsf(a.lo), high = fabsf(a.hi);
    return between(has_zero(a) ? 0.0f : lesser(low, high), greater(low, high), a.nan);
}

static interval round_down(interval a) {
    return between(floorf(a.lo), floorf(a.hi), a.nan);
}

/* a − b·floor(a/b), for b of one sign in [0, b] up to the rounding of a/b and of the product. */
static interval modulo(interval a, interval b) {
    const interval plain = add(a, negate(multiply(b, round_down(divide(a, b)), false)));
    if (has_zero(b) || has_infinity(a) || has_infinity(b)) {
        return plain;
    }
    const double slack = 1e-6 * fmax(fabs((double)a.lo), fabs((double)a.hi));
    const interval range = b.lo > 0.0f ? widened(-slack, b.hi + slack, plain.nan)
                                       : widened(b.lo - slack, slack, plain.nan);
    return between(greater(plain.lo, range.lo), lesser(plain.hi, range.hi), plain.nan);
}

static interval root(interval a) {
    const float low = a.lo > 0.0f ? sqrtf(a.lo) : 0.0f;
    if (!(a.hi >= 0.0f)) {
        return anything;
    }
    return between(low, sqrtf(a.hi), a.nan || a.lo < 0.0f);
}

/* ---- the functions that we approximate --------------------------------------------------------
 */

#define ANGLE_TRUSTED 100000.0f /* up to here the reduction is exact */

/* sin(v + shift) where shift is 0 or π/2; −1 and 1 where a crest or a trough may lie inside. */
static interval sine(interval a, double shift) {
    const bool nan = a.nan || has_infinity(a);
    interval all = widened(-1.0, 1.0, nan);
    if (a.lo < -ANGLE_TRUSTED || a.hi > ANGLE_TRUSTED || !((double)a.hi - (double)a.lo < 6.2)) {
        return all;
    }
    const double lo = (double)a.lo + shift, hi = (double)a.hi + shift;
    const double s0 = vd_sin(lo), s1 = vd_sin(hi), turn = 2.0 * VD_PI;
    const double crest = 0.5 * VD_PI + turn * ceil((lo - 1e-6 - 0.5 * VD_PI) / turn);
    const double trough = -0.5 * VD_PI + turn * ceil((lo - 1e-6 + 0.5 * VD_PI) / turn);
    const double low = trough <= hi + 1e-6 ? -1.0 : fmin(s0, s1);
    const double high = crest <= hi + 1e-6 ? 1.0 : fmax(s0, s1);
    const interval v = widened(low - MARGIN, high + MARGIN, nan); /* absolute: near 0 */
    return between(greater(v.lo, all.lo), lesser(v.hi, all.hi), nan);
}

static interval tangent(interval a) {
    if (a.lo < -ANGLE_TRUSTED || a.hi > ANGLE_TRUSTED) {
        return anything;
    }
    const double pole = 0.5 * VD_PI + VD_PI * ceil(((double)a.lo - 1e-6 - 0.5 * VD_PI) / VD_PI);
    if (pole <= (double)a.hi + 1e-6) {
        return anything;
    }
    const double low = vd_tan((double)a.lo), high = vd_tan((double)a.hi);
    return widened(low - MARGIN, high + MARGIN, a.nan);
}

/* Seen from the origin, the angles of a rectangle are extreme at its corners, unless the origin or
 * the cut along the negative x axis touches it. */
static interval angle(interval y, interval x) {
    const bool nan = y.nan || x.nan || has_infinity(y) || has_infinity(x);
    if (nan || (x.lo <= 0.0f && has_zero(y))) {
        return widened(-VD_PI, VD_PI, nan);
    }
    const double a = vd_atan2(y.lo, x.lo), b = vd_atan2(y.lo, x.hi);
    const double c = vd_atan2(y.hi, x.lo), d = vd_atan2(y.hi, x.hi);
    return widened(fmin(fmin(a, b), fmin(c, d)), fmax(fmax(a, b), fmax(c, d)), false);
}

/* Denormal results are right to one unit of theirs, 1.4e-45, not relatively. */
static double exponential(float x) {
    return x < -200.0f ? 0.0 : x > 200.0f ? (double)INFINITY : vd_function_exp_double(x);
}

static interval exponent(interval a) {
    interval v = widened(exponential(a.lo), exponential(a.hi), a.nan);
    v.lo = greater(v.lo - 0x1p-149f, 0.0f);
    v.hi = v.hi + 0x1p-149f;
    return v;
}

static interval logarithm(interval a) {
    if (!(a.hi >= 0.0f)) {
        return anything;
    }
    const double low = a.lo > 0.0f && a.lo < INFINITY ? vd_function_log_double((double)a.lo)
                       : a.lo > 0.0f                  ? (double)a.lo
                                                      : -(double)INFINITY;
    const double high = a.hi > 0.0f && a.hi < INFINITY ? vd_function_log_double((double)a.hi)
                        : a.hi > 0.0f                  ? (double)a.hi
                                                       : -(double)INFINITY;
    return widened(low - MARGIN * 1e-1, high + MARGIN * 1e-1, a.nan || a.lo < 0.0f);
}

static interval power(interval a, interval b) {
    if (!(a.lo >= 0.0f) || has_infinity(a) || has_infinity(b) || (a.lo == 0.0f && b.lo < 0.0f)) {
        return anything;
    }
    interval v = corners(vd_function_pow(a.lo, b.lo), vd_function_pow(a.lo, b.hi),
                         vd_function_pow(a.hi, b.lo), vd_function_pow(a.hi, b.hi), a.nan || b.nan);
    if (v.lo == 0.0f || v.hi == INFINITY) { /* may pass through denormals; 1 at 0^0 */
        v.hi = has_zero(b) && v.hi < 1.0f ? 1.0f : v.hi;
    }
    v = widened(v.lo, v.hi, v.nan);
    v.lo = greater(v.lo - 0x1p-149f, 0.0f);
    v.hi = v.hi + 0x1p-149f;
    return v;
}

/* ---- noise ------------------------------------------------------------------------------------
 */

/* The slope along one axis: the blend of gradient components (at most 1) plus the blend's own slope
 * (at most 15/8) times the difference of what it blends: n10 − n00 is at most |gx|·(u + 1 − u) plus
 * two |gy|·|v|, blended over v to at most 1: together 1 + 15/8 · 2. */
#define STEEPEST 4.75

/* Noise of one octave over a rectangle of centre (x, y) that reaches `reach` (|dx| + |dy|) from it,
 * floats that are off by the octave's rounding included. */
static interval noise_octave(double x, double y, double reach, uint32_t seed) {
    const double size = fabs(x) + fabs(y) + reach;
    /* Coordinates took up to 3 roundings an octave, of 2^−24 each; the noise's own error is 1e-6.
     */
    const double slack = STEEPEST * (reach + size * 3e-7 * (seed + 1.0)) + 1e-5;
    if (!(slack < 2.0)) {
        return between(-1.0f, 1.0f, !(size < (double)INFINITY));
    }
    const double n = (double)vd_function_noise((float)x, (float)y, seed);
    return between((float)fmax(n - slack, -1.0), (float)fmin(n + slack, 1.0), false);
}

static interval octave_sum(interval x, interval y, interval octaves, bool is_ridged) {
    const int least = (int)vd_function_octaves(octaves.nan ? 1.0f : octaves.lo);
    const int most = (int)vd_function_octaves(octaves.hi);
    double cx = 0.5 * ((double)x.lo + (double)x.hi), cy = 0.5 * ((double)y.lo + (double)y.hi);
    double hx = 0.5 * ((double)x.hi - (double)x.lo), hy = 0.5 * ((double)y.hi - (double)y.lo);
    /* Lengths as the centre's: NaN (from infinities) makes every octave its whole range. */
    double reach = hx + hy, low = 0.0, high = 0.0, amplitude = 1.0, weight_lo = 1.0,
           weight_hi = 1.0;
    double euclid = sqrt(hx * hx + hy * hy);
    for (int i = 0; i < most; i++) {
        const interval n = noise_octave(cx, cy, reach, (uint32_t)i);
        double lo = n.lo, hi = n.hi;
        if (is_ridged) {
            const interval size = magnitude(n);
            const double r_lo = fmax(1.0 - 2.0 * (double)size.hi, 0.0);
            const double r_hi = fmax(1.0 - 2.0 * (double)size.lo, 0.0);
            lo = r_lo * r_lo * weight_lo;
            hi = r_hi * r_hi * weight_hi;
            weight_lo = fmin(2.0 * lo, 1.0);
            weight_hi = fmin(2.0 * hi, 1.0);
        }
        low += amplitude * (i < least ? lo : fmin(lo, 0.0));
        high += amplitude * (i < least ? hi : fmax(hi, 0.0));
        amplitude *= 0.5;
        const double turned = (double)VD_OCTAVE_COS * cx - (double)VD_OCTAVE_SIN * cy;
        cy = (double)VD_OCTAVE_SIN * cx + (double)VD_OCTAVE_COS * cy;
        cx = turned;
        euclid *= 2.0;
        reach = 1.4142136 * euclid; /* |dx| + |dy| of a turned vector */
    }
    const bool nan = x.nan || y.nan || has_infinity(x) || has_infinity(y);
    /* A coordinate that overflows on the way to the last octave is infinite there. */
    const bool overflows = greater(magnitude(x).hi, magnitude(y).hi) > 1e33f;
    return widened(low - 1e-5, high + 1e-5, nan || overflows);
}

static interval noise(interval x, interval y) {
    const interval one = {1.0f, 1.0f, false};
    return octave_sum(x, y, one, false);
}

/* ---- logic: [0, 0] is no, [1, 1] is yes, [0, 1] is both ----------------------------------------
 */

static interval verdict(bool may_be_no, bool may_be_yes) {
    return between(may_be_no ? 0.0f : 1.0f, may_be_yes ? 1.0f : 0.0f, false);
}

static bool may_be_false(interval v) {
    return has_zero(v);
}

static bool may_be_true(interval v) { /* as the kernels: NaN is not 0 */
    return v.nan || v.lo != 0.0f || v.hi != 0.0f;
}

static interval compare(vd_function_op op, interval a, interval b) {
    const bool nan = a.nan || b.nan;
    const bool point = a.lo == a.hi && b.lo == b.hi && a.lo == b.lo;
    const bool apart = a.hi < b.lo || b.hi < a.lo;
    switch (op) {
    case VD_OP_LESS:
        return verdict(nan || a.hi >= b.lo, a.lo < b.hi);
    case VD_OP_LESS_EQUAL:
        return verdict(nan || a.hi > b.lo, a.lo <= b.hi);
    case VD_OP_EQUAL:
        return verdict(nan || !point, !apart);
    default:
        return verdict(!apart, nan || !point);
    }
}

static interval logic(vd_function_op op, interval a, interval b, interval c) {
    switch (op) {
    case VD_OP_AND:
        return verdict(may_be_false(a) || may_be_false(b), may_be_true(a) && may_be_true(b));
    case VD_OP_OR:
        return verdict(may_be_false(a) && may_be_false(b), may_be_true(a) || may_be_true(b));
    case VD_OP_NOT:
        return verdict(may_be_true(a), may_be_false(a));
    case VD_OP_SELECT:
        return !may_be_false(a) ? b : !may_be_true(a) ? c : hull(b, c);
    default:
        return compare(op, a, b);
    }
}

/* ---- the program ------------------------------------------------------------------------------
 */

static interval step_bounds(const vd_function_step *s, interval a, interval b, interval c) {
    switch ((vd_function_op)s->op) {
    case VD_OP_ADD:
        return add(a, b);
    case VD_OP_SUBTRACT:
        return add(a, negate(b));
    case VD_OP_MULTIPLY:
        return multiply(a, b, s->a == s->b);
    case VD_OP_DIVIDE:
        return divide(a, b);
    case VD_OP_NEGATE:
        return negate(a);
    case VD_OP_MIN:
        return minimum(a, b);
    case VD_OP_MAX:
        return maximum(a, b);
    case VD_OP_ABS:
        return magnitude(a);
    case VD_OP_FLOOR:
        return round_down(a);
    case VD_OP_MOD:
        return modulo(a, b);
    case VD_OP_SQRT:
        return root(a);
    case VD_OP_SIN:
        return sine(a, 0.0);
    case VD_OP_COS:
        return sine(a, 0.5 * VD_PI);
    case VD_OP_TAN:
        return tangent(a);
    case VD_OP_ATAN2:
        return angle(a, b);
    case VD_OP_EXP:
        return exponent(a);
    case VD_OP_LOG:
        return logarithm(a);
    case VD_OP_POW:
        return power(a, b);
    case VD_OP_NOISE:
        return noise(a, b);
    case VD_OP_FBM:
    case VD_OP_RIDGED:
        return octave_sum(a, b, c, s->op == VD_OP_RIDGED);
    default:
        return logic((vd_function_op)s->op, a, b, c);
    }
}

void vd_function_bounds(const vd_function *f, float x0, float x1, float y0, float y1, float *min,
                        float *max) {
    *min = -INFINITY;
    *max = INFINITY;
    if (!(x0 <= x1) || !(y0 <= y1)) {
        return;
    }
    if (f->callback != NULL) {
        if (f->bounds_callback != NULL) {
            f->bounds_callback(f->user, x0, x1, y0, y1, min, max);
        }
        return;
    }
    interval r[VD_FUNCTION_MAX_REGISTERS];
    const float *constants = vd_function_constants(f);
    const vd_function_step *steps = vd_function_steps(f);
    r[0] = between(x0, x1, false);
    r[1] = between(y0, y1, false);
    for (uint32_t i = 0; i < f->constant_count; i++) {
        r[2 + i] = between(constants[i], constants[i], false); /* NaN: anything */
    }
    for (uint32_t k = 0; k < f->height_steps; k++) {
        const vd_function_step *s = &steps[k];
        r[s->to] = step_bounds(s, r[s->a], r[s->b], r[s->c]);
    }
    *min = r[f->result[0]].lo;
    *max = r[f->result[0]].hi;
}

/* function_kernels.inl: formulas on many points at a time, over wide.h. A file per SIMD level
 * defines TABLE and includes this. Every function here is the twin of one in function_reference.c:
 * the same operations in the same order, with selections for its branches. Read that one first. */
#include <math.h>
#include <stdbool.h>
#include "core/wide.h"
#if defined(__x86_64__)
#include <immintrin.h>
#endif
#include "terrain/function_kernels.h"
#include "terrain/function_real.h"

/* Points that run together: two public batches, as one costs mostly the way to its operations (10.6
 * ns a point for the thesis' formula with colours; 5.4 with two; 4.5 with four, which would take
 * twice the stack). What is left over runs as one. */
#define LANES (2 * VD_FUNCTION_LANES)

typedef vd_wide_f32 wide;
typedef vd_wide_i32 mask;

static inline wide splat(float v) {
    return v - (wide){0}; /* exact, and keeps −0 */
}

static inline wide choose(mask m, wide yes, wide no) {
    return vd_wide_select_f32(m, yes, no);
}

static inline wide absolute(wide v) {
    return (wide)((vd_wide_u32)v & 0x7fffffffu);
}

static inline wide negate(wide v) {
    return (wide)((vd_wide_u32)v ^ 0x80000000u);
}

/* What vector extensions lack: one instruction each where the processor has it. */
static inline wide wide_floor(wide v) {
#if defined(__AVX512F__)
    return (wide)_mm512_roundscale_ps((__m512)v, _MM_FROUND_TO_NEG_INF | _MM_FROUND_NO_EXC);
#elif defined(__AVX2__)
    return (wide)_mm256_floor_ps((__m256)v);
#elif defined(__SSE4_1__)
    return (wide)_mm_floor_ps((__m128)v);
#else
    for (int i = 0; i < VD_WIDE_LANES; i++) {
        v[i] = floorf(v[i]);
    }
    return v;
#endif
}

static inline wide wide_sqrt(wide v) {
#if defined(__AVX512F__)
    return (wide)_mm512_sqrt_ps((__m512)v);
#elif defined(__AVX2__)
    return (wide)_mm256_sqrt_ps((__m256)v);
#elif defined(__SSE4_1__)
    return (wide)_mm_sqrt_ps((__m128)v);
#else
    for (int i = 0; i < VD_WIDE_LANES; i++) {
        v[i] = sqrtf(v[i]);
    }
    return v;
#endif
}

static inline void sin_cos(wide x, wide *sine, wide *cosine) {
    x = choose(absolute(x) >= VD_ANGLE_LIMIT, x * 0.0f, x);
    const wide n = wide_floor(x * VD_TWO_OVER_PI + 0.5f);
    wide r = (((x - n * VD_HALF_PI_1) - n * VD_HALF_PI_2) - n * VD_HALF_PI_3) - n * VD_HALF_PI_4;
    r = choose(r < -VD_REST_LIMIT, splat(-VD_REST_LIMIT), r);
    r = choose(r > VD_REST_LIMIT, splat(VD_REST_LIMIT), r);
    const wide quadrant = n - 4.0f * wide_floor(n * 0.25f);
    const wide z = r * r;
    const wide s = r + r * z * (VD_SIN_1 + z * (VD_SIN_2 + z * VD_SIN_3));
    const wide c = 1.0f - (0.5f * z - z * z * (VD_COS_1 + z * (VD_COS_2 + z * VD_COS_3)));
    const mask one = quadrant == 1.0f;
    const mask swap = one | (quadrant == 3.0f);
    const wide sine_size = choose(swap, c, s), cosine_size = choose(swap, s, c);
    *sine = choose(quadrant >= 2.0f, negate(sine_size), sine_size);
    *cosine = choose(one | (quadrant == 2.0f), negate(cosine_size), cosine_size);
}

static inline wide wide_sin(wide x) {
    wide s, c;
    sin_cos(x, &s, &c);
    return s;
}

static inline wide wide_cos(wide x) {
    wide s, c;
    sin_cos(x, &s, &c);
    return c;
}

static inline wide wide_tan(wide x) {
    wide s, c;
    sin_cos(x, &s, &c);
    return s / c;
}

static inline wide wide_atan2(wide y, wide x) {
    const wide ax = absolute(x), ay = absolute(y);
    const mask flat = ay < ax;
    const wide low = choose(flat, ay, ax), high = choose(flat, ax, ay);
    const mask far = low > high * VD_TAN_EIGHTH;
    const wide top = choose(far, low - high, low), bottom = choose(far, low + high, high);
    const wide t = choose(bottom == 0.0f, splat(0.0f), top / bottom);
    const wide z = t * t;
    const wide p = VD_ATAN_1 + z * (VD_ATAN_2 + z * (VD_ATAN_3 + z * VD_ATAN_4));
    wide angle = choose(far, splat(VD_QUARTER_PI), splat(0.0f)) + (t + t * z * p);
    angle = choose(ay > ax, VD_HALF_PI - angle, angle);
    angle = choose(x < 0.0f, VD_WHOLE_PI - angle, angle);
    return choose(y < 0.0f, negate(angle), angle);
}

static inline wide power_of_two(wide n) {
    return (wide)(((vd_wide_u32) __builtin_convertvector(n, vd_wide_i32) + 127u) << 23);
}

static inline wide wide_exp(wide x) {
    wide c = choose(x == x, x, splat(0.0f));
    c = choose(c < VD_EXP_LOW, splat(VD_EXP_LOW), c);
    c = choose(c > VD_EXP_HIGH, splat(VD_EXP_HIGH), c);
    const wide n = wide_floor(c * VD_LOG2_E + 0.5f);
    const wide r = (c - n * VD_LN2_HIGH) - n * VD_LN2_LOW;
    const wide q = VD_EXP_4 + r * (VD_EXP_5 + r * VD_EXP_6);
    const wide p = 1.0f + (r + r * r * (VD_EXP_2 + r * (VD_EXP_3 + r * q)));
    const wide half = wide_floor(n * 0.5f);
    return choose(x == x, p * power_of_two(half) * power_of_two(n - half), x);
}

static inline wide wide_log(wide x) {
    const mask tiny = x < 0x1p-126f;
    vd_wide_u32 bits = (vd_wide_u32)choose(tiny, x * 0x1p23f, x);
    const vd_wide_i32 exponent = (vd_wide_i32)(bits - VD_SQRT_HALF_BITS) >> 23;
    bits -= (vd_wide_u32)exponent << 23;
    const wide e =
        __builtin_convertvector(exponent, wide) - choose(tiny, splat(23.0f), splat(0.0f));
    const wide f = (wide)bits - 1.0f, s = f / (2.0f + f), z = s * s;
    const wide half = 0.5f * f * f;
    const wide rest = z * (VD_LOG_1 + z * (VD_LOG_2 + z * VD_LOG_3));
    wide result = e * VD_LN2_HIGH - ((half - (s * (half + rest) + e * VD_LN2_LOW)) - f);
    result = choose(x < INFINITY, result, x);
    const wide edge = choose(x == 0.0f, splat(-INFINITY), splat(NAN));
    return choose(x > 0.0f, result, edge);
}

static inline vd_wide_u32 hash(vd_wide_u32 x, vd_wide_u32 y, uint32_t seed) {
    vd_wide_u32 h = x * VD_HASH_X + y * VD_HASH_Y + seed * VD_HASH_SEED;
    h ^= h >> 15;
    h *= VD_HASH_1;
    h ^= h >> 12;
    h *= VD_HASH_2;
    return h ^ h >> 15;
}

static inline wide slope(vd_wide_u32 h, wide dx, wide dy) {
    const wide low = __builtin_convertvector((vd_wide_i32)(h & 0xffffu), wide);
    const wide high = __builtin_convertvector((vd_wide_i32)(h >> 16), wide);
    const wide gx = low * 0x1p-15f + (0x1p-16f - 1.0f), gy = high * 0x1p-15f + (0x1p-16f - 1.0f);
    return gx * dx + gy * dy;
}

static inline wide fade(wide u) {
    return u * u * u * (u * (u * 6.0f - 15.0f) + 10.0f);
}

static inline wide wide_noise(wide x, wide y, uint32_t seed) {
    const wide left = wide_floor(x), low = wide_floor(y);
    const wide u = x - left, v = y - low;
    const wide column = choose(absolute(x) < VD_NOISE_LIMIT, left, splat(0.0f));
    const wide row = choose(absolute(y) < VD_NOISE_LIMIT, low, splat(0.0f));
    const vd_wide_u32 ix = (vd_wide_u32) __builtin_convertvector(column, vd_wide_i32);
    const vd_wide_u32 iy = (vd_wide_u32) __builtin_convertvector(row, vd_wide_i32);
    const wide n00 = slope(hash(ix, iy, seed), u, v);
    const wide n10 = slope(hash(ix + 1u, iy, seed), u - 1.0f, v);
    const wide n01 = slope(hash(ix, iy + 1u, seed), u, v - 1.0f);
    const wide n11 = slope(hash(ix + 1u, iy + 1u, seed), u - 1.0f, v - 1.0f);
    const wide s = fade(u), t = fade(v);
    const wide bottom = n00 + s * (n10 - n00), top = n01 + s * (n11 - n01);
    return bottom + t * (top - bottom);
}

static inline wide octave_counts(wide octaves) {
    const wide most = splat((float)VD_FUNCTION_MAX_OCTAVES);
    const wide whole = choose(octaves < most, wide_floor(octaves), most);
    return choose(octaves >= 1.0f, whole, splat(1.0f));
}

static inline float largest(wide v) {
    float most = v[0];
    for (int i = 1; i < VD_WIDE_LANES; i++) {
        most = v[i] > most ? v[i] : most;
    }
    return most;
}

static wide wide_fbm(wide x, wide y, wide octaves) {
    const wide count = octave_counts(octaves);
    const float most = largest(count);
    wide sum = splat(0.0f);
    float amplitude = 1.0f;
    for (int i = 0; (float)i < most; i++) {
        const wide more = sum + amplitude * wide_noise(x, y, (uint32_t)i);
        sum = choose(splat((float)i) < count, more, sum);
        amplitude = amplitude * 0.5f;
        const wide turned = VD_OCTAVE_COS * x - VD_OCTAVE_SIN * y;
        y = VD_OCTAVE_SIN * x + VD_OCTAVE_COS * y;
        x = turned;
    }
    return sum;
}

static wide wide_ridged(wide x, wide y, wide octaves) {
    const wide count = octave_counts(octaves);
    const float most = largest(count);
    wide sum = splat(0.0f), weight = splat(1.0f);
    float amplitude = 1.0f;
    for (int i = 0; (float)i < most; i++) {
        wide ridge = 1.0f - 2.0f * absolute(wide_noise(x, y, (uint32_t)i));
        ridge = choose(ridge < 0.0f, splat(0.0f), ridge);
        const wide signal = ridge * ridge * weight;
        sum = choose(splat((float)i) < count, sum + amplitude * signal, sum);
        weight = 2.0f * signal;
        weight = choose(weight > 1.0f, splat(1.0f), weight);
        amplitude = amplitude * 0.5f;
        const wide turned = VD_OCTAVE_COS * x - VD_OCTAVE_SIN * y;
        y = VD_OCTAVE_SIN * x + VD_OCTAVE_COS * y;
        x = turned;
    }
    return sum;
}

/* Half as many doubles as floats fill a vector. */
typedef double wide_f64 __attribute__((vector_size(VD_WIDE_LANES * 4)));
typedef int64_t mask_f64 __attribute__((vector_size(VD_WIDE_LANES * 4)));
typedef uint64_t wide_u64 __attribute__((vector_size(VD_WIDE_LANES * 4)));
typedef float half_f32 __attribute__((vector_size(VD_WIDE_LANES * 2)));

static inline wide_f64 choose_f64(mask_f64 m, wide_f64 yes, wide_f64 no) {
    return (wide_f64)(((wide_u64)yes & (wide_u64)m) | ((wide_u64)no & ~(wide_u64)m));
}

static inline wide_f64 splat_f64(double v) {
    return v - (wide_f64){0};
}

static inline wide_f64 log_double(wide_f64 a) {
    wide_u64 bits = (wide_u64)a;
    const wide_u64 biased = (bits - VD_SQRT_HALF_BITS_64 + (UINT64_C(1024) << 52)) >> 52;
    const wide_f64 exponent = (wide_f64)(biased | VD_WHOLE_BITS_64) - (VD_WHOLE_64 + 1024.0);
    bits -= (biased - 1024u) << 52;
    const wide_f64 f = (wide_f64)bits - 1.0, s = f / (2.0 + f), z = s * s;
    wide_f64 p = splat_f64(1.0 / 17.0);
    p = p * z + 1.0 / 15.0;
    p = p * z + 1.0 / 13.0;
    p = p * z + 1.0 / 11.0;
    p = p * z + 1.0 / 9.0;
    p = p * z + 1.0 / 7.0;
    p = p * z + 1.0 / 5.0;
    p = p * z + 1.0 / 3.0;
    return exponent * VD_LN2_64 + 2.0 * (s + s * z * p);
}

static inline wide_f64 exp_double(wide_f64 y) {
    const wide_f64 shifted = y * VD_LOG2_E_64 + VD_ROUND_64, n = shifted - VD_ROUND_64;
    const wide_f64 r = (y - n * VD_LN2_HIGH_64) - n * VD_LN2_LOW_64;
    wide_f64 p = splat_f64(1.0 / 39916800.0);
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
    return p * (wide_f64)(((wide_u64)shifted + 1023u) << 52);
}

/* |a|^b; infinity and NaN as in vd_function_pow, without its cases of a < 0 and b = 0. */
static inline half_f32 half_pow(half_f32 a, half_f32 b) {
    const wide_f64 signed_a = __builtin_convertvector(a, wide_f64);
    const wide_f64 size = (wide_f64)((wide_u64)signed_a & ~(UINT64_C(1) << 63));
    wide_f64 l = choose_f64(size < (double)INFINITY, log_double(size), size);
    l = choose_f64(size == 0.0, splat_f64(-(double)INFINITY), l);
    wide_f64 y = __builtin_convertvector(b, wide_f64) * l;
    y = choose_f64(y < -200.0, splat_f64(-200.0), y);
    y = choose_f64(y > 200.0, splat_f64(200.0), y);
    const wide_f64 p = choose_f64(y == y, exp_double(y), y);
    return __builtin_convertvector(choose_f64(p > 3.5e38, splat_f64((double)INFINITY), p),
                                   half_f32);
}

static inline wide wide_pow(wide a, wide b) {
    half_f32 halves[2][2];
    memcpy(halves[0], &a, sizeof a);
    memcpy(halves[1], &b, sizeof b);
    halves[0][0] = half_pow(halves[0][0], halves[1][0]);
    halves[0][1] = half_pow(halves[0][1], halves[1][1]);
    wide p;
    memcpy(&p, halves[0], sizeof p);
    const mask odd = b - 2.0f * wide_floor(b * 0.5f) == 1.0f;
    const wide negative = choose(wide_floor(b) == b, choose(odd, negate(p), p), splat(NAN));
    p = choose(a < 0.0f, negative, p);
    return choose(b == 0.0f, splat(1.0f), p);
}

/* 1 where the mask is set, 0 elsewhere. */
static inline wide truth(mask m) {
    return choose(m, splat(1.0f), splat(0.0f));
}

/* Runs one operation on the first `lanes` floats of its registers; operands are a, b and c. */
#define EACH(expression)                                                                           \
    for (int i = 0; i < lanes; i += VD_WIDE_LANES) {                                               \
        const wide a = vd_wide_load_f32(pa + i), b = vd_wide_load_f32(pb + i),                     \
                   c = vd_wide_load_f32(pc + i);                                                   \
        (void)b;                                                                                   \
        (void)c;                                                                                   \
        vd_wide_store_f32(to + i, (expression));                                                   \
    }                                                                                              \
    break

static inline void run_step(const vd_function_step *step, float registers[][LANES], int lanes) {
    const float *pa = registers[step->a], *pb = registers[step->b], *pc = registers[step->c];
    float *to = registers[step->to];
    switch ((vd_function_op)step->op) {
    case VD_OP_ADD:
        EACH(a + b);
    case VD_OP_SUBTRACT:
        EACH(a - b);
    case VD_OP_MULTIPLY:
        EACH(a * b);
    case VD_OP_DIVIDE:
        EACH(a / b);
    case VD_OP_NEGATE:
        EACH(negate(a));
    case VD_OP_MIN:
        EACH(choose(a < b, a, b));
    case VD_OP_MAX:
        EACH(choose(a > b, a, b));
    case VD_OP_ABS:
        EACH(absolute(a));
    case VD_OP_FLOOR:
        EACH(wide_floor(a));
    case VD_OP_MOD:
        EACH(a - b * wide_floor(a / b));
    case VD_OP_SQRT:
        EACH(wide_sqrt(a));
    case VD_OP_SIN:
        EACH(wide_sin(a));
    case VD_OP_COS:
        EACH(wide_cos(a));
    case VD_OP_TAN:
        EACH(wide_tan(a));
    case VD_OP_ATAN2:
        EACH(wide_atan2(a, b));
    case VD_OP_EXP:
        EACH(wide_exp(a));
    case VD_OP_LOG:
        EACH(wide_log(a));
    case VD_OP_POW:
        EACH(wide_pow(a, b));
    case VD_OP_NOISE:
        EACH(wide_noise(a, b, 0));
    case VD_OP_FBM:
        EACH(wide_fbm(a, b, c));
    case VD_OP_RIDGED:
        EACH(wide_ridged(a, b, c));
    case VD_OP_LESS:
        EACH(truth(a < b));
    case VD_OP_LESS_EQUAL:
        EACH(truth(a <= b));
    case VD_OP_EQUAL:
        EACH(truth(a == b));
    case VD_OP_NOT_EQUAL:
        EACH(truth(a != b));
    case VD_OP_AND:
        EACH(truth((a != 0.0f) & (b != 0.0f)));
    case VD_OP_OR:
        EACH(truth((a != 0.0f) | (b != 0.0f)));
    case VD_OP_NOT:
        EACH(truth(a == 0.0f));
    case VD_OP_SELECT:
        EACH(choose(a != 0.0f, b, c));
    case VD_OP_COUNT:
        break;
    }
}

#undef EACH

/* What may leave: a finite height or −infinity; colours in 0 … 1. */
static inline void finish_height(const float *from, float to[LANES], int lanes) {
    for (int i = 0; i < lanes; i += VD_WIDE_LANES) {
        const wide v = vd_wide_load_f32(from + i);
        vd_wide_store_f32(to + i, choose(absolute(v) < INFINITY, v, splat(-INFINITY)));
    }
}

static inline void finish_color(const float *from, float to[LANES], int lanes) {
    for (int i = 0; i < lanes; i += VD_WIDE_LANES) {
        wide v = vd_wide_load_f32(from + i);
        v = choose(v > 0.0f, v, splat(0.0f));
        vd_wide_store_f32(to + i, choose(v < 1.0f, v, splat(1.0f)));
    }
}

static void evaluate(const vd_function *f, size_t count, const float *restrict x,
                     const float *restrict y, float *restrict h, float *const rgb[3]) {
    _Alignas(64) float registers[VD_FUNCTION_MAX_REGISTERS][LANES];
    const vd_function_step *steps = vd_function_steps(f);
    const float *constants = vd_function_constants(f);
    const uint32_t last = rgb != NULL ? f->step_count : f->height_steps;
    for (uint32_t i = 0; i < f->constant_count; i++) {
        for (int k = 0; k < LANES; k++) {
            registers[2 + i][k] = constants[i];
        }
    }
    for (size_t at = 0; at < count; at += LANES) {
        const size_t left = count - at < LANES ? count - at : LANES;
        if (left < LANES) {
            memset(registers[0], 0, sizeof registers[0]);
            memset(registers[1], 0, sizeof registers[1]);
        }
        memcpy(registers[0], x + at, left * sizeof(float));
        memcpy(registers[1], y + at, left * sizeof(float));
        const int lanes = left <= VD_FUNCTION_LANES ? VD_FUNCTION_LANES : LANES;
        for (uint32_t k = 0; k < last; k++) {
            run_step(&steps[k], registers, lanes);
        }
        _Alignas(64) float out[LANES];
        finish_height(registers[f->result[0]], out, lanes);
        memcpy(h + at, out, left * sizeof(float));
        for (int k = 0; rgb != NULL && k < 3; k++) {
            if (f->has_color) {
                finish_color(registers[f->result[1 + k]], out, lanes);
            } else {
                for (int i = 0; i < LANES; i++) {
                    out[i] = 1.0f;
                }
            }
            memcpy(rgb[k] + at, out, left * sizeof(float));
        }
    }
}

const vd_function_kernels TABLE = {evaluate};

/* function_reference.c: a compiled formula, one point and one operation at a time. */
#include <math.h>
#include <stdbool.h>
#include <string.h>
#include "terrain/function_kernels.h"
#include "terrain/function_real.h"

static void sin_cos(float x, float *sine, float *cosine) {
    if (fabsf(x) >= VD_ANGLE_LIMIT) {
        x = x * 0.0f; /* NaN for infinity */
    }
    const float n = floorf(x * VD_TWO_OVER_PI + 0.5f);
    float r = (((x - n * VD_HALF_PI_1) - n * VD_HALF_PI_2) - n * VD_HALF_PI_3) - n * VD_HALF_PI_4;
    r = r < -VD_REST_LIMIT ? -VD_REST_LIMIT : r;
    r = r > VD_REST_LIMIT ? VD_REST_LIMIT : r;
    const float quadrant = n - 4.0f * floorf(n * 0.25f);
    const float z = r * r;
    const float s = r + r * z * (VD_SIN_1 + z * (VD_SIN_2 + z * VD_SIN_3));
    const float c = 1.0f - (0.5f * z - z * z * (VD_COS_1 + z * (VD_COS_2 + z * VD_COS_3)));
    const bool swap = quadrant == 1.0f || quadrant == 3.0f;
    const float sine_size = swap ? c : s, cosine_size = swap ? s : c;
    *sine = quadrant >= 2.0f ? -sine_size : sine_size;
    *cosine = quadrant == 1.0f || quadrant == 2.0f ? -cosine_size : cosine_size;
}

static float atan2_plain(float y, float x) {
    const float ax = fabsf(x), ay = fabsf(y);
    const float low = ay < ax ? ay : ax, high = ay < ax ? ax : ay;
    const bool far = low > high * VD_TAN_EIGHTH;
    const float top = far ? low - high : low, bottom = far ? low + high : high;
    const float t = bottom == 0.0f ? 0.0f : top / bottom;
    const float z = t * t;
    const float p = VD_ATAN_1 + z * (VD_ATAN_2 + z * (VD_ATAN_3 + z * VD_ATAN_4));
    float angle = (far ? VD_QUARTER_PI : 0.0f) + (t + t * z * p);
    angle = ay > ax ? VD_HALF_PI - angle : angle;
    angle = x < 0.0f ? VD_WHOLE_PI - angle : angle;
    return y < 0.0f ? -angle : angle;
}

/* 2^n for −126 <= n <= 127. */
static float power_of_two(int32_t n) {
    const uint32_t bits = (uint32_t)(n + 127) << 23;
    float f;
    memcpy(&f, &bits, sizeof f);
    return f;
}

static float exp_plain(float x) {
    float c = x == x ? x : 0.0f;
    c = c < VD_EXP_LOW ? VD_EXP_LOW : c;
    c = c > VD_EXP_HIGH ? VD_EXP_HIGH : c;
    const float n = floorf(c * VD_LOG2_E + 0.5f);
    const float r = (c - n * VD_LN2_HIGH) - n * VD_LN2_LOW;
    const float q = VD_EXP_4 + r * (VD_EXP_5 + r * VD_EXP_6);
    const float p = 1.0f + (r + r * r * (VD_EXP_2 + r * (VD_EXP_3 + r * q)));
    /* n is −150 … 128: in two factors, so that denormals come out rounded and not as zero. */
    const float half = floorf(n * 0.5f);
    const float result = p * power_of_two((int32_t)half) * power_of_two((int32_t)(n - half));
    return x == x ? result : x;
}

static float log_plain(float x) {
    const bool tiny = x < 0x1p-126f;
    const float scaled = tiny ? x * 0x1p23f : x;
    uint32_t bits;
    memcpy(&bits, &scaled, sizeof bits);
    const int32_t exponent = (int32_t)(bits - VD_SQRT_HALF_BITS) >> 23;
    bits -= (uint32_t)exponent << 23;
    float m;
    memcpy(&m, &bits, sizeof m);
    const float e = (float)exponent - (tiny ? 23.0f : 0.0f);
    const float f = m - 1.0f, s = f / (2.0f + f), z = s * s;
    /* log m = f − (f²/2 − s (f²/2 + R)) keeps the bits that 2s + … would lose (Ng, fdlibm). */
    const float half = 0.5f * f * f;
    const float rest = z * (VD_LOG_1 + z * (VD_LOG_2 + z * VD_LOG_3));
    const float result = e * VD_LN2_HIGH - ((half - (s * (half + rest) + e * VD_LN2_LOW)) - f);
    if (!(x > 0.0f)) {
        return x == 0.0f ? -INFINITY : NAN;
    }
    return x < INFINITY ? result : x;
}

static uint32_t hash(uint32_t x, uint32_t y, uint32_t seed) {
    uint32_t h = x * VD_HASH_X + y * VD_HASH_Y + seed * VD_HASH_SEED;
    h ^= h >> 15;
    h *= VD_HASH_1;
    h ^= h >> 12;
    h *= VD_HASH_2;
    return h ^ h >> 15;
}

/* The product of the gradient at a lattice point, uniform in a square of side 2, with (dx, dy). */
static float slope(uint32_t h, float dx, float dy) {
    const float gx = (float)(int32_t)(h & 0xffffu) * 0x1p-15f + (0x1p-16f - 1.0f);
    const float gy = (float)(int32_t)(h >> 16) * 0x1p-15f + (0x1p-16f - 1.0f);
    return gx * dx + gy * dy;
}

/* Perlin's 2002 blend 6u⁵ − 15u⁴ + 10u³: twice continuously differentiable. */
static float fade(float u) {
    return u * u * u * (u * (u * 6.0f - 15.0f) + 10.0f);
}

float vd_function_noise(float x, float y, uint32_t seed) {
    const float left = floorf(x), low = floorf(y);
    const float u = x - left, v = y - low;
    const uint32_t ix = (uint32_t)(int32_t)(fabsf(x) < VD_NOISE_LIMIT ? left : 0.0f);
    const uint32_t iy = (uint32_t)(int32_t)(fabsf(y) < VD_NOISE_LIMIT ? low : 0.0f);
    const float n00 = slope(hash(ix, iy, seed), u, v);
    const float n10 = slope(hash(ix + 1, iy, seed), u - 1.0f, v);
    const float n01 = slope(hash(ix, iy + 1, seed), u, v - 1.0f);
    const float n11 = slope(hash(ix + 1, iy + 1, seed), u - 1.0f, v - 1.0f);
    const float s = fade(u), t = fade(v);
    const float bottom = n00 + s * (n10 - n00), top = n01 + s * (n11 - n01);
    return bottom + t * (top - bottom);
}

float vd_function_octaves(float octaves) {
    const float whole =
        octaves < (float)VD_FUNCTION_MAX_OCTAVES ? floorf(octaves) : (float)VD_FUNCTION_MAX_OCTAVES;
    return octaves >= 1.0f ? whole : 1.0f; /* NaN: 1 */
}

static float fbm(float x, float y, float octaves) {
    const float count = vd_function_octaves(octaves);
    float sum = 0.0f, amplitude = 1.0f;
    for (int i = 0; (float)i < count; i++) {
        sum = sum + amplitude * vd_function_noise(x, y, (uint32_t)i);
        amplitude = amplitude * 0.5f;
        const float turned = VD_OCTAVE_COS * x - VD_OCTAVE_SIN * y;
        y = VD_OCTAVE_SIN * x + VD_OCTAVE_COS * y;
        x = turned;
    }
    return sum;
}

static float ridged(float x, float y, float octaves) {
    const float count = vd_function_octaves(octaves);
    float sum = 0.0f, amplitude = 1.0f, weight = 1.0f;
    for (int i = 0; (float)i < count; i++) {
        float ridge = 1.0f - 2.0f * fabsf(vd_function_noise(x, y, (uint32_t)i));
        ridge = ridge < 0.0f ? 0.0f : ridge;
        const float signal = ridge * ridge * weight;
        sum = sum + amplitude * signal;
        weight = 2.0f * signal;
        weight = weight > 1.0f ? 1.0f : weight;
        amplitude = amplitude * 0.5f;
        const float turned = VD_OCTAVE_COS * x - VD_OCTAVE_SIN * y;
        y = VD_OCTAVE_SIN * x + VD_OCTAVE_COS * y;
        x = turned;
    }
    return sum;
}

static float apply_real(vd_function_op op, float a, float b, float c) {
    float sine, cosine;
    switch (op) {
    case VD_OP_SIN:
    case VD_OP_COS:
    case VD_OP_TAN:
        sin_cos(a, &sine, &cosine);
        return op == VD_OP_SIN ? sine : op == VD_OP_COS ? cosine : sine / cosine;
    case VD_OP_ATAN2:
        return atan2_plain(a, b);
    case VD_OP_EXP:
        return exp_plain(a);
    case VD_OP_LOG:
        return log_plain(a);
    case VD_OP_POW:
        return vd_function_pow(a, b);
    case VD_OP_NOISE:
        return vd_function_noise(a, b, 0);
    case VD_OP_FBM:
        return fbm(a, b, c);
    default:
        return ridged(a, b, c);
    }
}

static float apply_logic(vd_function_op op, float a, float b, float c) {
    switch (op) {
    case VD_OP_LESS:
        return a < b ? 1.0f : 0.0f;
    case VD_OP_LESS_EQUAL:
        return a <= b ? 1.0f : 0.0f;
    case VD_OP_EQUAL:
        return a == b ? 1.0f : 0.0f;
    case VD_OP_NOT_EQUAL:
        return a != b ? 1.0f : 0.0f;
    case VD_OP_AND:
        return a != 0.0f && b != 0.0f ? 1.0f : 0.0f;
    case VD_OP_OR:
        return a != 0.0f || b != 0.0f ? 1.0f : 0.0f;
    case VD_OP_NOT:
        return a == 0.0f ? 1.0f : 0.0f;
    default:
        return a != 0.0f ? b : c;
    }
}

float vd_function_apply(vd_function_op op, float a, float b, float c) {
    switch (op) {
    case VD_OP_ADD:
        return a + b;
    case VD_OP_SUBTRACT:
        return a - b;
    case VD_OP_MULTIPLY:
        return a * b;
    case VD_OP_DIVIDE:
        return a / b;
    case VD_OP_NEGATE:
        return -a;
    case VD_OP_MIN:
        return a < b ? a : b;
    case VD_OP_MAX:
        return a > b ? a : b;
    case VD_OP_ABS:
        return fabsf(a);
    case VD_OP_FLOOR:
        return floorf(a);
    case VD_OP_MOD:
        return a - b * floorf(a / b);
    case VD_OP_SQRT:
        return sqrtf(a);
    default:
        return op < VD_OP_LESS ? apply_real(op, a, b, c) : apply_logic(op, a, b, c);
    }
}

static float color_component(float v) {
    v = v > 0.0f ? v : 0.0f; /* NaN: 0 */
    return v < 1.0f ? v : 1.0f;
}

static void evaluate(const vd_function *f, size_t count, const float *restrict x,
                     const float *restrict y, float *restrict h, float *const rgb[3]) {
    const vd_function_step *steps = vd_function_steps(f);
    const float *constants = vd_function_constants(f);
    const uint32_t last = rgb != NULL ? f->step_count : f->height_steps;
    float r[VD_FUNCTION_MAX_REGISTERS];
    for (uint32_t i = 0; i < f->constant_count; i++) {
        r[2 + i] = constants[i];
    }
    for (size_t i = 0; i < count; i++) {
        r[0] = x[i];
        r[1] = y[i];
        for (uint32_t k = 0; k < last; k++) {
            const vd_function_step *s = &steps[k];
            r[s->to] = vd_function_apply((vd_function_op)s->op, r[s->a], r[s->b], r[s->c]);
        }
        const float height = r[f->result[0]];
        h[i] = fabsf(height) < INFINITY ? height : -INFINITY;
        for (int k = 0; rgb != NULL && k < 3; k++) {
            rgb[k][i] = f->has_color ? color_component(r[f->result[1 + k]]) : 1.0f;
        }
    }
}

const vd_function_kernels vd_function_kernels_reference = {evaluate};

const vd_function_kernels *vd_function_kernels_for(vd_isa isa) {
#if defined(__x86_64__)
    if (isa == VD_ISA_V4) {
        return &vd_function_kernels_v4;
    }
    if (isa == VD_ISA_V3) {
        return &vd_function_kernels_v3;
    }
#endif
    (void)isa;
    return &vd_function_kernels_v2;
}

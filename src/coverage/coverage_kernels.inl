/* coverage_kernels.inl: the kernels' bodies over wide.h. A file per SIMD level defines TABLE and
 * includes this; the table is the file's only external name. */
#include "core/wide.h"
#include "coverage/coverage_kernels.h"

/* Pixels in a vector of one channel a lane. */
#define PIXELS (VD_WIDE_LANES / 4)

static inline vd_wide_u32 multiply(vd_wide_u32 a, vd_wide_u32 b) {
    const vd_wide_u32 v = a * b + 32768u;
    return (v + (v >> 16)) >> 16;
}

static inline void store_u16(uint16_t *to, vd_wide_u32 v) {
    const vd_wide_u16 values = __builtin_convertvector(v, vd_wide_u16);
    memcpy(to, &values, sizeof values);
}

/* Each pixel's alpha in its four lanes. */
static inline vd_wide_u32 spread_alpha(vd_wide_u32 v) {
#if defined(__AVX512F__)
    return (vd_wide_u32)_mm512_shuffle_epi32((__m512i)v, _MM_PERM_DDDD);
#elif defined(__AVX2__)
    return (vd_wide_u32)_mm256_shuffle_epi32((__m256i)v, 0xFF);
#elif defined(__SSE4_1__)
    return (vd_wide_u32)_mm_shuffle_epi32((__m128i)v, 0xFF);
#else
    return (vd_wide_u32){v[3], v[3], v[3], v[3]};
#endif
}

/* PIXELS coverages, each in its pixel's four lanes. */
static inline vd_wide_u32 spread_coverage(const uint16_t *coverage) {
#if defined(__AVX512F__)
    const __m128i four =
        _mm_cvtepu16_epi32(_mm_loadl_epi64((const __m128i *)(const void *)coverage));
    return (vd_wide_u32)_mm512_permutexvar_epi32(
        _mm512_setr_epi32(0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3),
        _mm512_castsi128_si512(four));
#elif defined(__AVX2__)
    return (vd_wide_u32)_mm256_setr_m128i(_mm_set1_epi32(coverage[0]), _mm_set1_epi32(coverage[1]));
#else
    return coverage[0] + (vd_wide_u32){0};
#endif
}

static inline vd_wide_u32 over(vd_wide_u32 s, vd_wide_u32 below) {
    const vd_wide_u32 sum = s + multiply(below, 65535u - spread_alpha(s));
    return (vd_wide_u32)vd_wide_min_i32((vd_wide_i32)sum, vd_wide_splat_i32(65535));
}

static void sum_areas(uint16_t *restrict out, int32_t *restrict areas, int32_t base, size_t count) {
    /* The sum itself one by one: a sum over lanes takes four steps of two instructions at v4, and
     * most calls are for a handful of pixels. */
    int32_t sum = base;
    for (size_t i = 0; i < count; i++) {
        sum += areas[i];
        areas[i] = 0;
        const int32_t low = sum < 0 ? 0 : sum;
        const int32_t cut = low < 1 << 24 ? low : 1 << 24;
        out[i] = (uint16_t)((cut - (cut >> 16) + 128) >> 8);
    }
}

static inline vd_wide_u32 four_times(const uint16_t color[4]) {
    vd_wide_u32 v;
    for (int i = 0; i < VD_WIDE_LANES; i++) {
        v[i] = color[i % 4];
    }
    return v;
}

/* A colour over pixels that are all wholly covered. */
static void blend_solid(uint16_t *restrict out, const uint16_t color[4], size_t count) {
    const vd_wide_u32 s = four_times(color);
    size_t i = 0;
    if (color[3] == 65535) {
        const vd_wide_u16 stored = __builtin_convertvector(s, vd_wide_u16);
        for (; i + PIXELS <= count; i += PIXELS) {
            memcpy(out + 4 * i, &stored, sizeof stored);
        }
    } else {
        for (; i + PIXELS <= count; i += PIXELS) {
            store_u16(out + 4 * i, over(s, vd_wide_load_u16(out + 4 * i)));
        }
    }
    if (i < count) {
        vd_coverage_kernels_reference.blend_color(out + 4 * i, NULL, color, count - i);
    }
}

static void blend_color(uint16_t *restrict out, const uint16_t *restrict coverage,
                        const uint16_t color[4], size_t count) {
    if (coverage == NULL) {
        blend_solid(out, color, count);
        return;
    }
    const vd_wide_u32 straight = four_times(color);
    size_t i = 0;
    for (; i + PIXELS <= count; i += PIXELS) {
        const vd_wide_u32 s = multiply(straight, spread_coverage(coverage + i));
        store_u16(out + 4 * i, over(s, vd_wide_load_u16(out + 4 * i)));
    }
    if (i < count) {
        vd_coverage_kernels_reference.blend_color(out + 4 * i, coverage + i, color, count - i);
    }
}

static void blend_colors(uint16_t *restrict out, const uint16_t *restrict coverage,
                         const uint16_t *restrict colors, size_t count) {
    size_t i = 0;
    for (; i + PIXELS <= count; i += PIXELS) {
        vd_wide_u32 s = vd_wide_load_u16(colors + 4 * i);
        if (coverage != NULL) {
            s = multiply(s, spread_coverage(coverage + i));
        }
        store_u16(out + 4 * i, over(s, vd_wide_load_u16(out + 4 * i)));
    }
    if (i < count) {
        vd_coverage_kernels_reference.blend_colors(
            out + 4 * i, coverage == NULL ? NULL : coverage + i, colors + 4 * i, count - i);
    }
}

const vd_coverage_kernels TABLE = {sum_areas, blend_color, blend_colors};

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

static inline uint64_t round_area(int32_t sum) {
    const int32_t low = sum < 0 ? 0 : sum;
    const int32_t cut = low < 1 << 24 ? low : 1 << 24;
    return (uint64_t)(uint32_t)((cut - (cut >> 16) + 128) >> 8);
}

/* One by one: summing over lanes takes four steps of two instructions at v4, and most calls are for
 * a handful of pixels. Stored by fours, as they will be loaded: a load does not wait for one store,
 * but for four. */
static void sum_areas(uint16_t *restrict out, int32_t *restrict areas, int32_t base, size_t count) {
    int32_t sum = base;
    size_t i = 0;
    for (; i + 4 <= count; i += 4) {
        const int32_t a = sum + areas[i], b = a + areas[i + 1], c = b + areas[i + 2];
        sum = c + areas[i + 3];
        const uint64_t four =
            round_area(a) | round_area(b) << 16 | round_area(c) << 32 | round_area(sum) << 48;
        memcpy(out + i, &four, sizeof four);
        memset(areas + i, 0, 4 * sizeof *areas);
    }
    for (; i < count; i++) {
        sum += areas[i];
        areas[i] = 0;
        out[i] = (uint16_t)round_area(sum);
    }
}

/* ---- one pixel: most spans are a few pixels long, and what is left of a vector costs as much as
 * all of it ---------------------------------------------------------------------------------------
 */

typedef uint32_t pixel __attribute__((vector_size(16)));
typedef uint16_t pixel_u16 __attribute__((vector_size(8)));

static inline pixel load_pixel(const uint16_t *from) {
    pixel_u16 values;
    memcpy(&values, from, sizeof values);
    return __builtin_convertvector(values, pixel);
}

static inline pixel multiply_pixel(pixel a, pixel b) {
    const pixel v = a * b + 32768u;
    return (v + (v >> 16)) >> 16;
}

static inline void blend_pixel(uint16_t *out, pixel s) {
    const pixel sum = s + multiply_pixel(load_pixel(out), 65535u - (s[3] + (pixel){0}));
    const pixel over = (pixel)(sum > 65535u);
    const pixel_u16 values = __builtin_convertvector((sum & ~over) | (over & 65535u), pixel_u16);
    memcpy(out, &values, sizeof values);
}

static inline vd_wide_u32 four_times(const uint16_t color[4]) {
    uint64_t packed;
    memcpy(&packed, color, sizeof packed);
    const uint64_t again[4] = {packed, packed, packed, packed};
    vd_wide_u16 values;
    memcpy(&values, again, sizeof values);
    return __builtin_convertvector(values, vd_wide_u32);
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
    for (; i < count; i++) {
        blend_pixel(out + 4 * i, load_pixel(color));
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
    for (; i < count; i++) {
        blend_pixel(out + 4 * i, multiply_pixel(load_pixel(color), coverage[i] + (pixel){0}));
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
    for (; i < count; i++) {
        const uint32_t covered = coverage == NULL ? 65535u : coverage[i];
        blend_pixel(out + 4 * i, multiply_pixel(load_pixel(colors + 4 * i), covered + (pixel){0}));
    }
}

const vd_coverage_kernels TABLE = {sum_areas, blend_color, blend_colors};

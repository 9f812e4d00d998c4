/* wide.h: vectors as wide as the file's SIMD level, over GCC's vector extensions.
 *
 * A kernel's body is written once against these names and compiled once per level (files *_v2.c,
 * *_v3.c, *_v4.c): 4, 8 or 16 lanes of 32 bits. Lane i of a result depends on lane i of the
 * operands only, every operation rounds as the scalar one does, and min and max are `a < b ? a : b`
 * as in the plain references, so all levels give the same bytes. Nothing here has an external name.
 */
#ifndef VEDUTA_CORE_WIDE_H
#define VEDUTA_CORE_WIDE_H

#include <stdbool.h>
#include <stdint.h>
#include <string.h>
#if defined(__SSE4_1__)
#include <immintrin.h>
#elif defined(__wasm_simd128__)
#include <wasm_simd128.h>
#else
#include <math.h>
#endif

#if defined(__AVX512F__)
#define VD_WIDE_LANES 16
#elif defined(__AVX2__)
#define VD_WIDE_LANES 8
#else
#define VD_WIDE_LANES 4
#endif

typedef float vd_wide_f32 __attribute__((vector_size(VD_WIDE_LANES * 4)));
typedef int32_t vd_wide_i32 __attribute__((vector_size(VD_WIDE_LANES * 4)));
typedef uint32_t vd_wide_u32 __attribute__((vector_size(VD_WIDE_LANES * 4)));
typedef uint16_t vd_wide_u16 __attribute__((vector_size(VD_WIDE_LANES * 2)));
typedef uint8_t vd_wide_u8 __attribute__((vector_size(VD_WIDE_LANES)));

/* Loads and stores may be unaligned; memcpy of a fixed size becomes one instruction. */
static inline vd_wide_f32 vd_wide_load_f32(const float *from) {
    vd_wide_f32 v;
    memcpy(&v, from, sizeof v);
    return v;
}

static inline void vd_wide_store_f32(float *to, vd_wide_f32 v) {
    memcpy(to, &v, sizeof v);
}

static inline vd_wide_u32 vd_wide_load_u32(const uint32_t *from) {
    vd_wide_u32 v;
    memcpy(&v, from, sizeof v);
    return v;
}

static inline void vd_wide_store_u32(uint32_t *to, vd_wide_u32 v) {
    memcpy(to, &v, sizeof v);
}

/* Loads 16-bit values, one a lane. */
static inline vd_wide_u32 vd_wide_load_u16(const uint16_t *from) {
    vd_wide_u16 v;
    memcpy(&v, from, sizeof v);
    return __builtin_convertvector(v, vd_wide_u32);
}

/* Loads bytes, one a lane. */
static inline vd_wide_u32 vd_wide_load_u8(const uint8_t *from) {
    vd_wide_u8 v;
    memcpy(&v, from, sizeof v);
    return __builtin_convertvector(v, vd_wide_u32);
}

/* Stores the low 8 bits of each lane. */
static inline void vd_wide_store_u8(uint8_t *to, vd_wide_u32 v) {
    vd_wide_u8 bytes = __builtin_convertvector(v, vd_wide_u8);
    memcpy(to, &bytes, sizeof bytes);
}

/* mask lanes are all ones or all zeros, as comparisons give them. */
static inline vd_wide_u32 vd_wide_select_u32(vd_wide_i32 mask, vd_wide_u32 yes, vd_wide_u32 no) {
    const vd_wide_u32 m = (vd_wide_u32)mask;
    return (yes & m) | (no & ~m);
}

static inline vd_wide_f32 vd_wide_select_f32(vd_wide_i32 mask, vd_wide_f32 yes, vd_wide_f32 no) {
    return (vd_wide_f32)vd_wide_select_u32(mask, (vd_wide_u32)yes, (vd_wide_u32)no);
}

/* ---- masks ------------------------------------------------------------------------------------
 * One truth value a lane, in the form that the level's comparisons give and its blends take: a mask
 * register at v4, where going through vectors of all ones costs two more instructions a comparison;
 * such vectors below. */
#if defined(__AVX512F__)
typedef __mmask16 vd_wide_mask;

static inline vd_wide_mask vd_wide_less_f32(vd_wide_f32 a, vd_wide_f32 b) {
    return _mm512_cmp_ps_mask((__m512)a, (__m512)b, _CMP_LT_OQ);
}

static inline vd_wide_mask vd_wide_equal_f32(vd_wide_f32 a, vd_wide_f32 b) {
    return _mm512_cmp_ps_mask((__m512)a, (__m512)b, _CMP_EQ_OQ);
}

static inline vd_wide_mask vd_wide_equal_i32(vd_wide_i32 a, vd_wide_i32 b) {
    return _mm512_cmpeq_epi32_mask((__m512i)a, (__m512i)b);
}

static inline vd_wide_mask vd_wide_less_i32(vd_wide_i32 a, vd_wide_i32 b) {
    return _mm512_cmplt_epi32_mask((__m512i)a, (__m512i)b);
}

static inline vd_wide_mask vd_wide_less_u32(vd_wide_u32 a, vd_wide_u32 b) {
    return _mm512_cmplt_epu32_mask((__m512i)a, (__m512i)b);
}

static inline vd_wide_f32 vd_wide_blend_f32(vd_wide_mask mask, vd_wide_f32 yes, vd_wide_f32 no) {
    return (vd_wide_f32)_mm512_mask_blend_ps(mask, (__m512)no, (__m512)yes);
}

static inline vd_wide_i32 vd_wide_blend_i32(vd_wide_mask mask, vd_wide_i32 yes, vd_wide_i32 no) {
    return (vd_wide_i32)_mm512_mask_blend_epi32(mask, (__m512i)no, (__m512i)yes);
}

static inline vd_wide_mask vd_wide_not(vd_wide_mask a) {
    return (vd_wide_mask)~a;
}

/* Bit i is lane i. */
static inline uint32_t vd_wide_bits(vd_wide_mask mask) {
    return mask;
}
#else
typedef vd_wide_i32 vd_wide_mask;

static inline vd_wide_mask vd_wide_less_f32(vd_wide_f32 a, vd_wide_f32 b) {
    return a < b;
}

static inline vd_wide_mask vd_wide_equal_f32(vd_wide_f32 a, vd_wide_f32 b) {
    return a == b;
}

static inline vd_wide_mask vd_wide_equal_i32(vd_wide_i32 a, vd_wide_i32 b) {
    return a == b;
}

static inline vd_wide_mask vd_wide_less_i32(vd_wide_i32 a, vd_wide_i32 b) {
    return a < b;
}

static inline vd_wide_mask vd_wide_less_u32(vd_wide_u32 a, vd_wide_u32 b) {
    return a < b;
}

static inline vd_wide_f32 vd_wide_blend_f32(vd_wide_mask mask, vd_wide_f32 yes, vd_wide_f32 no) {
#if defined(__AVX2__)
    return (vd_wide_f32)_mm256_blendv_ps((__m256)no, (__m256)yes, (__m256)mask);
#elif defined(__SSE4_1__)
    return (vd_wide_f32)_mm_blendv_ps((__m128)no, (__m128)yes, (__m128)mask);
#else
    return vd_wide_select_f32(mask, yes, no);
#endif
}

static inline vd_wide_i32 vd_wide_blend_i32(vd_wide_mask mask, vd_wide_i32 yes, vd_wide_i32 no) {
    return (vd_wide_i32)vd_wide_blend_f32(mask, (vd_wide_f32)yes, (vd_wide_f32)no);
}

static inline vd_wide_mask vd_wide_not(vd_wide_mask a) {
    return ~a;
}

static inline uint32_t vd_wide_bits(vd_wide_mask mask) {
#if defined(__AVX2__)
    return (uint32_t)_mm256_movemask_ps((__m256)mask);
#elif defined(__SSE4_1__)
    return (uint32_t)_mm_movemask_ps((__m128)mask);
#elif defined(__wasm_simd128__)
    return wasm_i32x4_bitmask((v128_t)mask);
#else
    uint32_t bits = 0;
    for (int i = 0; i < VD_WIDE_LANES; i++) {
        bits |= (uint32_t)(mask[i] & 1) << i;
    }
    return bits;
#endif
}
#endif

static inline vd_wide_mask vd_wide_and(vd_wide_mask a, vd_wide_mask b) {
    return (vd_wide_mask)(a & b);
}

static inline vd_wide_mask vd_wide_or(vd_wide_mask a, vd_wide_mask b) {
    return (vd_wide_mask)(a | b);
}

/* ---- arithmetic ------------------------------------------------------------------------------ */

static inline vd_wide_f32 vd_wide_splat_f32(float v) {
    return v - (vd_wide_f32){0.0f};
}

static inline vd_wide_i32 vd_wide_splat_i32(int32_t v) {
    return v + (vd_wide_i32){0};
}

static inline vd_wide_f32 vd_wide_min_f32(vd_wide_f32 a, vd_wide_f32 b) {
#if defined(__AVX512F__)
    return (vd_wide_f32)_mm512_min_ps((__m512)a, (__m512)b);
#elif defined(__AVX2__)
    return (vd_wide_f32)_mm256_min_ps((__m256)a, (__m256)b);
#elif defined(__SSE4_1__)
    return (vd_wide_f32)_mm_min_ps((__m128)a, (__m128)b);
#elif defined(__wasm_simd128__)
    return (vd_wide_f32)wasm_f32x4_pmin((v128_t)b, (v128_t)a);
#else
    return vd_wide_select_f32(a < b, a, b);
#endif
}

/* b < a ? a : b */
static inline vd_wide_f32 vd_wide_max_f32(vd_wide_f32 a, vd_wide_f32 b) {
#if defined(__AVX512F__)
    return (vd_wide_f32)_mm512_max_ps((__m512)a, (__m512)b);
#elif defined(__AVX2__)
    return (vd_wide_f32)_mm256_max_ps((__m256)a, (__m256)b);
#elif defined(__SSE4_1__)
    return (vd_wide_f32)_mm_max_ps((__m128)a, (__m128)b);
#elif defined(__wasm_simd128__)
    return (vd_wide_f32)wasm_f32x4_pmax((v128_t)b, (v128_t)a);
#else
    return vd_wide_select_f32(b < a, a, b);
#endif
}

static inline vd_wide_f32 vd_wide_floor_f32(vd_wide_f32 v) {
#if defined(__AVX512F__)
    return (vd_wide_f32)_mm512_roundscale_ps((__m512)v, _MM_FROUND_TO_NEG_INF | _MM_FROUND_NO_EXC);
#elif defined(__AVX2__)
    return (vd_wide_f32)_mm256_floor_ps((__m256)v);
#elif defined(__SSE4_1__)
    return (vd_wide_f32)_mm_floor_ps((__m128)v);
#elif defined(__wasm_simd128__)
    return (vd_wide_f32)wasm_f32x4_floor((v128_t)v);
#else
    for (int i = 0; i < VD_WIDE_LANES; i++) {
        v[i] = floorf(v[i]);
    }
    return v;
#endif
}

static inline vd_wide_f32 vd_wide_sqrt_f32(vd_wide_f32 v) {
#if defined(__AVX512F__)
    return (vd_wide_f32)_mm512_sqrt_ps((__m512)v);
#elif defined(__AVX2__)
    return (vd_wide_f32)_mm256_sqrt_ps((__m256)v);
#elif defined(__SSE4_1__)
    return (vd_wide_f32)_mm_sqrt_ps((__m128)v);
#elif defined(__wasm_simd128__)
    return (vd_wide_f32)wasm_f32x4_sqrt((v128_t)v);
#else
    for (int i = 0; i < VD_WIDE_LANES; i++) {
        v[i] = sqrtf(v[i]);
    }
    return v;
#endif
}

/* Truncates. What does not fit gives some number, not the same one at every level. */
static inline vd_wide_i32 vd_wide_to_i32(vd_wide_f32 v) {
#if defined(__AVX512F__)
    return (vd_wide_i32)_mm512_cvttps_epi32((__m512)v);
#elif defined(__AVX2__)
    return (vd_wide_i32)_mm256_cvttps_epi32((__m256)v);
#elif defined(__SSE4_1__)
    return (vd_wide_i32)_mm_cvttps_epi32((__m128)v);
#elif defined(__wasm_simd128__)
    return (vd_wide_i32)wasm_i32x4_trunc_sat_f32x4((v128_t)v);
#else
    vd_wide_i32 whole;
    for (int i = 0; i < VD_WIDE_LANES; i++) {
        whole[i] = v[i] >= -0x1p31f && v[i] < 0x1p31f ? (int32_t)v[i] : INT32_MIN;
    }
    return whole;
#endif
}

/* a·b + c, rounded once where the level has that and twice where not: for estimates only, never for
 * what is seen. */
static inline vd_wide_f32 vd_wide_estimate_f32(vd_wide_f32 a, vd_wide_f32 b, vd_wide_f32 c) {
#if defined(__AVX512F__)
    return (vd_wide_f32)_mm512_fmadd_ps((__m512)a, (__m512)b, (__m512)c);
#elif defined(__AVX2__) && defined(__FMA__)
    return (vd_wide_f32)_mm256_fmadd_ps((__m256)a, (__m256)b, (__m256)c);
#else
    return a * b + c;
#endif
}

/* a + b in the lanes of the mask, a in the others. */
static inline vd_wide_i32 vd_wide_add_where_i32(vd_wide_mask mask, vd_wide_i32 a, vd_wide_i32 b) {
#if defined(__AVX512F__)
    return (vd_wide_i32)_mm512_mask_add_epi32((__m512i)a, mask, (__m512i)a, (__m512i)b);
#else
    return a + (b & mask);
#endif
}

static inline vd_wide_i32 vd_wide_min_i32(vd_wide_i32 a, vd_wide_i32 b) {
#if defined(__AVX512F__)
    return (vd_wide_i32)_mm512_min_epi32((__m512i)a, (__m512i)b);
#elif defined(__AVX2__)
    return (vd_wide_i32)_mm256_min_epi32((__m256i)a, (__m256i)b);
#elif defined(__SSE4_1__)
    return (vd_wide_i32)_mm_min_epi32((__m128i)a, (__m128i)b);
#else
    return (vd_wide_i32)vd_wide_select_u32(a < b, (vd_wide_u32)a, (vd_wide_u32)b);
#endif
}

/* b < a ? a : b */
static inline vd_wide_i32 vd_wide_max_i32(vd_wide_i32 a, vd_wide_i32 b) {
#if defined(__AVX512F__)
    return (vd_wide_i32)_mm512_max_epi32((__m512i)a, (__m512i)b);
#elif defined(__AVX2__)
    return (vd_wide_i32)_mm256_max_epi32((__m256i)a, (__m256i)b);
#elif defined(__SSE4_1__)
    return (vd_wide_i32)_mm_max_epi32((__m128i)a, (__m128i)b);
#else
    return (vd_wide_i32)vd_wide_select_u32(b < a, (vd_wide_u32)a, (vd_wide_u32)b);
#endif
}

/* The nearest float, of two the even one. */
static inline vd_wide_f32 vd_wide_to_f32(vd_wide_i32 v) {
    return __builtin_convertvector(v, vd_wide_f32);
}

/* 0, 1, 2 … Not by a loop, which clang leaves one, through memory. */
static inline vd_wide_i32 vd_wide_count_i32(void) {
#if VD_WIDE_LANES == 16
    return (vd_wide_i32){0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15};
#elif VD_WIDE_LANES == 8
    return (vd_wide_i32){0, 1, 2, 3, 4, 5, 6, 7};
#else
    return (vd_wide_i32){0, 1, 2, 3};
#endif
}

static inline vd_wide_i32 vd_wide_load_i32(const int32_t *from) {
    vd_wide_i32 v;
    memcpy(&v, from, sizeof v);
    return v;
}

static inline void vd_wide_store_i32(int32_t *to, vd_wide_i32 v) {
    memcpy(to, &v, sizeof v);
}

static inline vd_wide_f32 vd_wide_abs_f32(vd_wide_f32 v) {
    return (vd_wide_f32)((vd_wide_i32)v & 0x7FFFFFFF);
}

/* ---- memory ---------------------------------------------------------------------------------- */

/* table[i] of a table of 16; 0 <= i < 16. `table` at a multiple of 64 bytes. */
static inline vd_wide_i32 vd_wide_lookup_i32(const int32_t *table, vd_wide_i32 i) {
#if defined(__AVX512F__)
    return (vd_wide_i32)_mm512_permutexvar_epi32((__m512i)i, _mm512_load_si512(table));
#elif defined(__AVX2__)
    const __m256i low = _mm256_load_si256((const __m256i *)table);
    const __m256i high = _mm256_load_si256((const __m256i *)(table + 8));
    return (vd_wide_i32)_mm256_blendv_ps((__m256)_mm256_permutevar8x32_epi32(low, (__m256i)i),
                                         (__m256)_mm256_permutevar8x32_epi32(high, (__m256i)i),
                                         (__m256)(i << 28));
#else
    vd_wide_i32 v;
    for (int lane = 0; lane < VD_WIDE_LANES; lane++) {
        v[lane] = table[i[lane]];
    }
    return v;
#endif
}

static inline vd_wide_f32 vd_wide_lookup_f32(const float *table, vd_wide_i32 i) {
    return (vd_wide_f32)vd_wide_lookup_i32((const int32_t *)(const void *)table, i);
}

/* base[i], widened to 32 bits. The 16-bit form may read 2 bytes behind the element.
 *
 * The indices pass through memory: the empty asm keeps gcc from taking them out of the register
 * instead, which costs more than loading them. At v4 the bytes are put together in two general
 * registers (inserted into vectors one by one 0.93, a gather instruction 0.88; where gcc may
 * choose, 0.54: the march from above, Zen 4), else inserted into vectors (in general registers 1.00
 * at v3, 0.96 at v2; a gather instruction 0.92 on Zen 5). */
#if defined(__AVX512F__)
static inline __m128i vd_wide_eight_u8(const uint8_t *base, const uint32_t at[8]) {
    const uint32_t low = base[at[0]] | (uint32_t)base[at[1]] << 8 | (uint32_t)base[at[2]] << 16 |
                         (uint32_t)base[at[3]] << 24;
    const uint32_t high = base[at[4]] | (uint32_t)base[at[5]] << 8 | (uint32_t)base[at[6]] << 16 |
                          (uint32_t)base[at[7]] << 24;
    uint64_t eight = low | (uint64_t)high << 32;
    __asm__("" : "+r"(eight));
    return _mm_cvtsi64_si128((long long)eight);
}
#endif

static inline vd_wide_i32 vd_wide_gather_u8(const uint8_t *base, vd_wide_i32 i) {
#if defined(__AVX512F__)
    uint32_t at[VD_WIDE_LANES] __attribute__((aligned(sizeof(vd_wide_i32))));
    memcpy(at, &i, sizeof at);
    __asm__("" : "+m"(at));
    return (vd_wide_i32)_mm512_cvtepu8_epi32(
        _mm_unpacklo_epi64(vd_wide_eight_u8(base, at), vd_wide_eight_u8(base, at + 8)));
#elif defined(__SSE4_1__)
    int32_t at[VD_WIDE_LANES] __attribute__((aligned(sizeof(vd_wide_i32))));
    memcpy(at, &i, sizeof at);
    __asm__("" : "+m"(at));
    __m128i part[VD_WIDE_LANES / 4];
    for (int j = 0; j < VD_WIDE_LANES / 4; j++) {
        part[j] = _mm_cvtsi32_si128(base[at[4 * j]]);
        part[j] = _mm_insert_epi8(part[j], base[at[4 * j + 1]], 1);
        part[j] = _mm_insert_epi8(part[j], base[at[4 * j + 2]], 2);
        part[j] = _mm_insert_epi8(part[j], base[at[4 * j + 3]], 3);
    }
#if defined(__AVX2__)
    return (vd_wide_i32)_mm256_cvtepu8_epi32(_mm_unpacklo_epi32(part[0], part[1]));
#else
    return (vd_wide_i32)_mm_cvtepu8_epi32(part[0]);
#endif
#else
    vd_wide_i32 v;
    for (int lane = 0; lane < VD_WIDE_LANES; lane++) {
        v[lane] = base[i[lane]];
    }
    return v;
#endif
}

static inline vd_wide_i32 vd_wide_gather_u16(const uint16_t *base, vd_wide_i32 i) {
#if defined(__AVX512F__)
    return (vd_wide_i32)_mm512_i32gather_epi32((__m512i)i, base, 2) & 0xFFFF;
#elif defined(__AVX2__)
    return (vd_wide_i32)_mm256_i32gather_epi32((const int *)(const void *)base, (__m256i)i, 2) &
           0xFFFF;
#else
    vd_wide_i32 v;
    for (int lane = 0; lane < VD_WIDE_LANES; lane++) {
        v[lane] = base[i[lane]];
    }
    return v;
#endif
}

/* base[i], and base[i + 1] in the upper half. */
static inline vd_wide_u32 vd_wide_gather_pair_u16(const uint16_t *base, vd_wide_i32 i) {
#if defined(__AVX512F__)
    return (vd_wide_u32)_mm512_i32gather_epi32((__m512i)i, base, 2);
#elif defined(__AVX2__)
    return (vd_wide_u32)_mm256_i32gather_epi32((const int *)(const void *)base, (__m256i)i, 2);
#else
    vd_wide_u32 v;
    for (int lane = 0; lane < VD_WIDE_LANES; lane++) {
        v[lane] = base[i[lane]] | (uint32_t)base[i[lane] + 1] << 16;
    }
    return v;
#endif
}

/* By loads of their own, for the reason given above: a gather instruction of 16 lanes takes longer
 * than the loads on all AMD processors. */
static inline vd_wide_f32 vd_wide_gather_f32(const float *base, vd_wide_i32 i) {
#if defined(__SSE4_1__)
    int32_t at[VD_WIDE_LANES] __attribute__((aligned(sizeof(vd_wide_i32))));
    memcpy(at, &i, sizeof at);
    __asm__("" : "+m"(at));
    __m128 part[VD_WIDE_LANES / 4];
    for (int j = 0; j < VD_WIDE_LANES / 4; j++) {
        const __m128 a = _mm_load_ss(base + at[4 * j]), b = _mm_load_ss(base + at[4 * j + 1]);
        const __m128 c = _mm_load_ss(base + at[4 * j + 2]), d = _mm_load_ss(base + at[4 * j + 3]);
        part[j] = _mm_movelh_ps(_mm_unpacklo_ps(a, b), _mm_unpacklo_ps(c, d));
    }
#if defined(__AVX512F__)
    const __m256 low = _mm256_insertf128_ps(_mm256_castps128_ps256(part[0]), part[1], 1);
    const __m256 high = _mm256_insertf128_ps(_mm256_castps128_ps256(part[2]), part[3], 1);
    return (vd_wide_f32)_mm512_castpd_ps(_mm512_insertf64x4(
        _mm512_castpd256_pd512(_mm256_castps_pd(low)), _mm256_castps_pd(high), 1));
#elif defined(__AVX2__)
    return (vd_wide_f32)_mm256_insertf128_ps(_mm256_castps128_ps256(part[0]), part[1], 1);
#else
    return (vd_wide_f32)part[0];
#endif
#else
    vd_wide_f32 v;
    for (int lane = 0; lane < VD_WIDE_LANES; lane++) {
        v[lane] = base[i[lane]];
    }
    return v;
#endif
}

/* Stores the lanes of the mask one behind the other; as many lanes as there are may be written. */
static inline void vd_wide_compress_i32(int32_t *to, vd_wide_mask mask, vd_wide_i32 v) {
#if defined(__AVX512F__)
    /* To a register first: compressing to memory is microcoded on Zen 4. */
    const __m512i packed = _mm512_maskz_compress_epi32(mask, (__m512i)v);
    memcpy(to, &packed, sizeof packed);
#elif defined(__SSE4_1__)
    /* By fours. Without a branch: which lanes are wanted is as good as random. Row b moves the
     * lanes of the bits of b to the front. */
#define LANE(i) 4 * (i), 4 * (i) + 1, 4 * (i) + 2, 4 * (i) + 3
    static const uint8_t moves[16][16] __attribute__((aligned(16))) = {
        {LANE(0)},
        {LANE(0)},
        {LANE(1)},
        {LANE(0), LANE(1)},
        {LANE(2)},
        {LANE(0), LANE(2)},
        {LANE(1), LANE(2)},
        {LANE(0), LANE(1), LANE(2)},
        {LANE(3)},
        {LANE(0), LANE(3)},
        {LANE(1), LANE(3)},
        {LANE(0), LANE(1), LANE(3)},
        {LANE(2), LANE(3)},
        {LANE(0), LANE(2), LANE(3)},
        {LANE(1), LANE(2), LANE(3)},
        {LANE(0), LANE(1), LANE(2), LANE(3)},
    };
#undef LANE
    const uint32_t bits = vd_wide_bits(mask);
    for (int i = 0; i < VD_WIDE_LANES / 4; i++) {
        const uint32_t four = bits >> (4 * i) & 15;
        __m128i part, move;
        memcpy(&part, (const char *)&v + 16 * i, sizeof part);
        memcpy(&move, moves[four], sizeof move);
        part = _mm_shuffle_epi8(part, move);
        memcpy(to, &part, sizeof part);
        to += __builtin_popcount(four);
    }
#else
    for (int lane = 0; lane < VD_WIDE_LANES; lane++) {
        if (mask[lane] != 0) {
            *to++ = v[lane];
        }
    }
#endif
}

/* Stores past the caches; `to` at a multiple of the vector's size. vd_wide_fence before another
 * thread may look. */
static inline void vd_wide_stream_i32(void *to, vd_wide_i32 v) {
#if defined(__AVX512F__)
    _mm512_stream_si512(to, (__m512i)v);
#elif defined(__AVX2__)
    _mm256_stream_si256(to, (__m256i)v);
#elif defined(__SSE4_1__)
    _mm_stream_si128(to, (__m128i)v);
#else
    memcpy(to, &v, sizeof v);
#endif
}

static inline void vd_wide_fence(void) {
#if defined(__SSE4_1__)
    _mm_sfence();
#endif
}

/* 2^e; −127 < e < 128. */
static inline vd_wide_f32 vd_wide_exp2_i32(vd_wide_i32 e) {
    return (vd_wide_f32)((e + 127) << 23);
}

#endif

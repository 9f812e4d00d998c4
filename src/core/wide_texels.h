/* wide_texels.h: pairs of neighbouring 32-bit values, and RGBA texels filtered in 16 bits, over
 * wide.h's vectors; the same bytes at all levels, as there. */
#ifndef VEDUTA_CORE_WIDE_TEXELS_H
#define VEDUTA_CORE_WIDE_TEXELS_H

#include "core/wide.h"

/* ---- pairs -----------------------------------------------------------------------------------
 * Two neighbouring 32-bit values a lane: the first half of the lanes' in out[0], the second half's
 * in out[1]. A pair takes one 64-bit load, where two gathers take two loads a lane. */

/* base[at[i]] and base[at[i] + 1] of every lane i. */
static inline void vd_wide_load_pairs_at(const void *base, const int32_t at[VD_WIDE_LANES],
                                         vd_wide_i32 out[2]) {
    const uint32_t *from = base;
#if defined(__SSE4_1__)
    __m128i part[VD_WIDE_LANES / 2];
    for (int j = 0; j < VD_WIDE_LANES / 2; j++) {
        const __m128i first = _mm_loadl_epi64((const __m128i *)(const void *)(from + at[2 * j]));
        part[j] = (__m128i)_mm_loadh_pi((__m128)first,
                                        (const __m64 *)(const void *)(from + at[2 * j + 1]));
    }
#if defined(__AVX512F__)
    for (int j = 0; j < 2; j++) {
        const __m256i low =
            _mm256_inserti128_si256(_mm256_castsi128_si256(part[4 * j]), part[4 * j + 1], 1);
        const __m256i high =
            _mm256_inserti128_si256(_mm256_castsi128_si256(part[4 * j + 2]), part[4 * j + 3], 1);
        out[j] = (vd_wide_i32)_mm512_inserti64x4(_mm512_castsi256_si512(low), high, 1);
    }
#elif defined(__AVX2__)
    for (int j = 0; j < 2; j++) {
        out[j] = (vd_wide_i32)_mm256_inserti128_si256(_mm256_castsi128_si256(part[2 * j]),
                                                      part[2 * j + 1], 1);
    }
#else
    out[0] = (vd_wide_i32)part[0];
    out[1] = (vd_wide_i32)part[1];
#endif
#elif defined(__wasm_simd128__)
    for (int j = 0; j < 2; j++) {
        const v128_t first = wasm_v128_load64_zero(from + at[2 * j]);
        out[j] = (vd_wide_i32)wasm_v128_load64_lane(from + at[2 * j + 1], first, 1);
    }
#else
    for (int lane = 0; lane < VD_WIDE_LANES; lane++) {
        out[2 * lane / VD_WIDE_LANES][2 * lane % VD_WIDE_LANES] = (int32_t)from[at[lane]];
        out[2 * lane / VD_WIDE_LANES][2 * lane % VD_WIDE_LANES + 1] = (int32_t)from[at[lane] + 1];
    }
#endif
}

/* base[i] and base[i + 1] of every lane. */
static inline void vd_wide_load_pairs(const void *base, vd_wide_i32 i, vd_wide_i32 out[2]) {
    int32_t at[VD_WIDE_LANES] __attribute__((aligned(sizeof(vd_wide_i32))));
    memcpy(at, &i, sizeof at);
#if defined(__SSE4_1__)
    __asm__("" : "+m"(at));
#endif
    vd_wide_load_pairs_at(base, at, out);
}

#if defined(__wasm_simd128__)
/* 64 bits at each of two addresses, so many bytes on. */
static inline void vd_wide_load_two(int32_t first, int32_t second, intptr_t on, vd_wide_i32 *out) {
    const char *even = (const char *)(uintptr_t)(uint32_t)first + on;
    const char *odd = (const char *)(uintptr_t)(uint32_t)second + on;
    *out = (vd_wide_i32)wasm_v128_load64_lane(odd, wasm_v128_load64_zero(even), 1);
}
#endif

/* The same of two bases, as of two rows of texels. */
static inline void vd_wide_load_pairs_twice(const void *base, const void *other, vd_wide_i32 i,
                                            vd_wide_i32 out[2], vd_wide_i32 other_out[2]) {
#if defined(__wasm_simd128__)
    /* Addresses by vectors, an addition and a shift a lane less; through memory, which is faster
     * than taking lanes (by 2 %). No loop: clang 14 leaves it one. */
    const vd_wide_i32 at = (i << 2) + (int32_t)(uintptr_t)base;
    const intptr_t apart = (intptr_t)((uintptr_t)other - (uintptr_t)base);
    const volatile vd_wide_i32 stored = at;
    const volatile int32_t *lane = (const volatile int32_t *)&stored;
    const int32_t first = lane[0], second = lane[1], third = lane[2], fourth = lane[3];
    vd_wide_load_two(first, second, 0, &out[0]);
    vd_wide_load_two(third, fourth, 0, &out[1]);
    vd_wide_load_two(first, second, apart, &other_out[0]);
    vd_wide_load_two(third, fourth, apart, &other_out[1]);
#else
    int32_t at[VD_WIDE_LANES] __attribute__((aligned(sizeof(vd_wide_i32))));
    memcpy(at, &i, sizeof at);
#if defined(__SSE4_1__)
    __asm__("" : "+m"(at));
#endif
    vd_wide_load_pairs_at(base, at, out);
    vd_wide_load_pairs_at(other, at, other_out);
#endif
}

/* Takes pairs apart: the first values, and the second values. */
static inline void vd_wide_unzip(const vd_wide_i32 pairs[2], vd_wide_i32 *first,
                                 vd_wide_i32 *second) {
#if VD_WIDE_LANES == 16
    *first = __builtin_shufflevector(pairs[0], pairs[1], 0, 2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 22,
                                     24, 26, 28, 30);
    *second = __builtin_shufflevector(pairs[0], pairs[1], 1, 3, 5, 7, 9, 11, 13, 15, 17, 19, 21, 23,
                                      25, 27, 29, 31);
#elif VD_WIDE_LANES == 8
    *first = __builtin_shufflevector(pairs[0], pairs[1], 0, 2, 4, 6, 8, 10, 12, 14);
    *second = __builtin_shufflevector(pairs[0], pairs[1], 1, 3, 5, 7, 9, 11, 13, 15);
#else
    *first = __builtin_shufflevector(pairs[0], pairs[1], 0, 2, 4, 6);
    *second = __builtin_shufflevector(pairs[0], pairs[1], 1, 3, 5, 7);
#endif
}

/* Each lane twice. */
static inline void vd_wide_double(vd_wide_i32 v, vd_wide_i32 out[2]) {
#if VD_WIDE_LANES == 16
    out[0] = __builtin_shufflevector(v, v, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 5, 5, 6, 6, 7, 7);
    out[1] =
        __builtin_shufflevector(v, v, 8, 8, 9, 9, 10, 10, 11, 11, 12, 12, 13, 13, 14, 14, 15, 15);
#elif VD_WIDE_LANES == 8
    out[0] = __builtin_shufflevector(v, v, 0, 0, 1, 1, 2, 2, 3, 3);
    out[1] = __builtin_shufflevector(v, v, 4, 4, 5, 5, 6, 6, 7, 7);
#else
    out[0] = __builtin_shufflevector(v, v, 0, 0, 1, 1);
    out[1] = __builtin_shufflevector(v, v, 2, 2, 3, 3);
#endif
}

/* ---- texels ----------------------------------------------------------------------------------
 * A pair of RGBA texels as 64 bits; a filtered texel as four int16_t in 64 bits. */
typedef int16_t vd_wide_i16 __attribute__((vector_size(VD_WIDE_LANES * 4)));

/* first·(127 − w) + second·w of each channel; `weights` holds 127 − w and w in turns, as bytes. */
static inline vd_wide_i16 vd_wide_mix_pairs(vd_wide_i32 pairs, vd_wide_i32 weights) {
#if defined(__SSE4_1__)
    const __m128i order = _mm_setr_epi8(0, 4, 1, 5, 2, 6, 3, 7, 8, 12, 9, 13, 10, 14, 11, 15);
#if defined(__AVX512BW__)
    const __m512i turns = _mm512_shuffle_epi8((__m512i)pairs, _mm512_broadcast_i32x4(order));
    return (vd_wide_i16)_mm512_maddubs_epi16(turns, (__m512i)weights);
#elif defined(__AVX2__)
    const __m256i turns = _mm256_shuffle_epi8((__m256i)pairs, _mm256_broadcastsi128_si256(order));
    return (vd_wide_i16)_mm256_maddubs_epi16(turns, (__m256i)weights);
#else
    return (vd_wide_i16)_mm_maddubs_epi16(_mm_shuffle_epi8((__m128i)pairs, order),
                                          (__m128i)weights);
#endif
#else
    uint8_t texels[VD_WIDE_LANES * 4], w[VD_WIDE_LANES * 4];
    vd_wide_i16 mixed;
    memcpy(texels, &pairs, sizeof texels);
    memcpy(w, &weights, sizeof w);
    for (int i = 0; i < VD_WIDE_LANES * 2; i++) {
        const int pixel = i / 4, channel = i % 4;
        mixed[i] = (int16_t)(texels[8 * pixel + channel] * w[2 * i] +
                             texels[8 * pixel + 4 + channel] * w[2 * i + 1]);
    }
    return mixed;
#endif
}

/* (a·b + 2^14) >> 15 */
static inline vd_wide_i16 vd_wide_multiply_high(vd_wide_i16 a, vd_wide_i16 b) {
#if defined(__AVX512BW__)
    return (vd_wide_i16)_mm512_mulhrs_epi16((__m512i)a, (__m512i)b);
#elif defined(__AVX2__)
    return (vd_wide_i16)_mm256_mulhrs_epi16((__m256i)a, (__m256i)b);
#elif defined(__SSE4_1__)
    return (vd_wide_i16)_mm_mulhrs_epi16((__m128i)a, (__m128i)b);
#elif defined(__wasm_simd128__)
    return (vd_wide_i16)wasm_i16x8_q15mulr_sat((v128_t)a, (v128_t)b);
#else
    vd_wide_i16 product;
    for (int i = 0; i < VD_WIDE_LANES * 2; i++) {
        product[i] = (int16_t)((a[i] * b[i] + 16384) >> 15);
    }
    return product;
#endif
}

/* Filtered texels to bytes, saturated; a lane a texel. */
static inline vd_wide_i32 vd_wide_pack_texels(vd_wide_i16 first, vd_wide_i16 second) {
#if defined(__AVX512BW__)
    const __m512i turns = _mm512_packus_epi16((__m512i)first, (__m512i)second);
    return (vd_wide_i32)_mm512_permutexvar_epi64(_mm512_setr_epi64(0, 2, 4, 6, 1, 3, 5, 7), turns);
#elif defined(__AVX2__)
    return (vd_wide_i32)_mm256_permute4x64_epi64(
        _mm256_packus_epi16((__m256i)first, (__m256i)second), 0xD8);
#elif defined(__SSE4_1__)
    return (vd_wide_i32)_mm_packus_epi16((__m128i)first, (__m128i)second);
#elif defined(__wasm_simd128__)
    return (vd_wide_i32)wasm_u8x16_narrow_i16x8((v128_t)first, (v128_t)second);
#else
    uint8_t bytes[VD_WIDE_LANES * 4];
    for (int i = 0; i < VD_WIDE_LANES * 4; i++) {
        const int16_t v = i < VD_WIDE_LANES * 2 ? first[i] : second[i - VD_WIDE_LANES * 2];
        bytes[i] = (uint8_t)(v > 255 ? 255 : v < 0 ? 0 : v);
    }
    vd_wide_i32 packed;
    memcpy(&packed, bytes, sizeof packed);
    return packed;
#endif
}

#endif

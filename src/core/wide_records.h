/* wide_records.h: sixteen-byte records of four 32-bit values, one a lane, loaded from anywhere and
 * turned into four vectors, and back.
 *
 * A gather instruction takes a lane's four values in four instructions of a dozen and more cycles
 * each; a record is one load, and turning four vectors of records around eight shuffles. For
 * sixteen triangles' corners that is 28 instructions a corner instead of four gathers.
 */
#ifndef VEDUTA_CORE_WIDE_RECORDS_H
#define VEDUTA_CORE_WIDE_RECORDS_H

#include <stddef.h>
#include "core/wide.h"

/* Lane i of out[k] is value k of record index[at[i]]; where `at` is null, of index[3 · i]. */
static inline void vd_wide_load_records(const void *base, const uint32_t *index, const uint32_t *at,
                                        vd_wide_i32 out[4]) {
    const char *b = base;
#define RECORD(i)                                                                                  \
    (const void *)(b + 16 * (size_t)index[at != NULL ? (size_t)at[i] : 3 * (size_t)(i)])
#if defined(__AVX512F__)
    __m512i r[4];
    for (int j = 0; j < 4; j++) {
        __m512i v = _mm512_castsi128_si512(_mm_loadu_si128(RECORD(j)));
        v = _mm512_inserti32x4(v, _mm_loadu_si128(RECORD(j + 4)), 1);
        v = _mm512_inserti32x4(v, _mm_loadu_si128(RECORD(j + 8)), 2);
        r[j] = _mm512_inserti32x4(v, _mm_loadu_si128(RECORD(j + 12)), 3);
    }
    const __m512i t0 = _mm512_unpacklo_epi32(r[0], r[1]), t1 = _mm512_unpackhi_epi32(r[0], r[1]);
    const __m512i t2 = _mm512_unpacklo_epi32(r[2], r[3]), t3 = _mm512_unpackhi_epi32(r[2], r[3]);
    out[0] = (vd_wide_i32)_mm512_unpacklo_epi64(t0, t2);
    out[1] = (vd_wide_i32)_mm512_unpackhi_epi64(t0, t2);
    out[2] = (vd_wide_i32)_mm512_unpacklo_epi64(t1, t3);
    out[3] = (vd_wide_i32)_mm512_unpackhi_epi64(t1, t3);
#elif defined(__AVX2__)
    __m256i r[4];
    for (int j = 0; j < 4; j++) {
        const __m256i v = _mm256_castsi128_si256(_mm_loadu_si128(RECORD(j)));
        r[j] = _mm256_inserti128_si256(v, _mm_loadu_si128(RECORD(j + 4)), 1);
    }
    const __m256i t0 = _mm256_unpacklo_epi32(r[0], r[1]), t1 = _mm256_unpackhi_epi32(r[0], r[1]);
    const __m256i t2 = _mm256_unpacklo_epi32(r[2], r[3]), t3 = _mm256_unpackhi_epi32(r[2], r[3]);
    out[0] = (vd_wide_i32)_mm256_unpacklo_epi64(t0, t2);
    out[1] = (vd_wide_i32)_mm256_unpackhi_epi64(t0, t2);
    out[2] = (vd_wide_i32)_mm256_unpacklo_epi64(t1, t3);
    out[3] = (vd_wide_i32)_mm256_unpackhi_epi64(t1, t3);
#elif defined(__SSE4_1__)
    __m128i r[4];
    for (int j = 0; j < 4; j++) {
        r[j] = _mm_loadu_si128(RECORD(j));
    }
    const __m128i t0 = _mm_unpacklo_epi32(r[0], r[1]), t1 = _mm_unpackhi_epi32(r[0], r[1]);
    const __m128i t2 = _mm_unpacklo_epi32(r[2], r[3]), t3 = _mm_unpackhi_epi32(r[2], r[3]);
    out[0] = (vd_wide_i32)_mm_unpacklo_epi64(t0, t2);
    out[1] = (vd_wide_i32)_mm_unpackhi_epi64(t0, t2);
    out[2] = (vd_wide_i32)_mm_unpacklo_epi64(t1, t3);
    out[3] = (vd_wide_i32)_mm_unpackhi_epi64(t1, t3);
#else
    for (int i = 0; i < VD_WIDE_LANES; i++) {
        int32_t record[4];
        memcpy(record, RECORD(i), sizeof record);
        for (int k = 0; k < 4; k++) {
            out[k][i] = record[k];
        }
    }
#endif
#undef RECORD
}

/* Record i of `to`, VD_WIDE_LANES of them, is lane i of the four vectors. */
static inline void vd_wide_store_records(void *to, const vd_wide_i32 v[4]) {
#if defined(__AVX512F__)
    const __m512i t0 = _mm512_unpacklo_epi32((__m512i)v[0], (__m512i)v[1]);
    const __m512i t1 = _mm512_unpackhi_epi32((__m512i)v[0], (__m512i)v[1]);
    const __m512i t2 = _mm512_unpacklo_epi32((__m512i)v[2], (__m512i)v[3]);
    const __m512i t3 = _mm512_unpackhi_epi32((__m512i)v[2], (__m512i)v[3]);
    const __m512i r0 = _mm512_unpacklo_epi64(t0, t2), r1 = _mm512_unpackhi_epi64(t0, t2);
    const __m512i r2 = _mm512_unpacklo_epi64(t1, t3), r3 = _mm512_unpackhi_epi64(t1, t3);
    const __m512i a = _mm512_shuffle_i32x4(r0, r1, 0x44), b = _mm512_shuffle_i32x4(r0, r1, 0xEE);
    const __m512i c = _mm512_shuffle_i32x4(r2, r3, 0x44), d = _mm512_shuffle_i32x4(r2, r3, 0xEE);
    char *at = to;
    _mm512_storeu_si512(at, _mm512_shuffle_i32x4(a, c, 0x88));
    _mm512_storeu_si512(at + 64, _mm512_shuffle_i32x4(a, c, 0xDD));
    _mm512_storeu_si512(at + 128, _mm512_shuffle_i32x4(b, d, 0x88));
    _mm512_storeu_si512(at + 192, _mm512_shuffle_i32x4(b, d, 0xDD));
#elif defined(__AVX2__)
    const __m256i t0 = _mm256_unpacklo_epi32((__m256i)v[0], (__m256i)v[1]);
    const __m256i t1 = _mm256_unpackhi_epi32((__m256i)v[0], (__m256i)v[1]);
    const __m256i t2 = _mm256_unpacklo_epi32((__m256i)v[2], (__m256i)v[3]);
    const __m256i t3 = _mm256_unpackhi_epi32((__m256i)v[2], (__m256i)v[3]);
    const __m256i r0 = _mm256_unpacklo_epi64(t0, t2), r1 = _mm256_unpackhi_epi64(t0, t2);
    const __m256i r2 = _mm256_unpacklo_epi64(t1, t3), r3 = _mm256_unpackhi_epi64(t1, t3);
    __m256i *at = to;
    _mm256_storeu_si256(at, _mm256_permute2x128_si256(r0, r1, 0x20));
    _mm256_storeu_si256(at + 1, _mm256_permute2x128_si256(r2, r3, 0x20));
    _mm256_storeu_si256(at + 2, _mm256_permute2x128_si256(r0, r1, 0x31));
    _mm256_storeu_si256(at + 3, _mm256_permute2x128_si256(r2, r3, 0x31));
#else
    int32_t *at = to;
    for (int i = 0; i < VD_WIDE_LANES; i++) {
        for (int k = 0; k < 4; k++) {
            at[4 * i + k] = v[k][i];
        }
    }
#endif
}

#endif

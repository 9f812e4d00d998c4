/* shadow_kernels.inl: the shadow counts of 8-bit, 16-bit and float heights over vectors as wide as
 * the file's SIMD level. A file per level defines TABLE and includes this. The reasoning is in
 * shadow_internal.h. */
#include <math.h>
#include <stddef.h>
#include "core/wide.h"
#if defined(__x86_64__)
#include <immintrin.h>
#endif
#include "terrain/shadow_internal.h"

#define BYTES (VD_WIDE_LANES * 4)

typedef uint8_t vector_u8 __attribute__((vector_size(BYTES)));
typedef uint16_t vector_u16 __attribute__((vector_size(BYTES)));
typedef uint8_t half_u8 __attribute__((vector_size(BYTES / 2)));

static inline float highest_tile(const vd_shadow_slab *slab, int left, int right, int top,
                                 int bottom) {
    const int width = slab->width;
    float most = -INFINITY;
    int a[2] = {left, 0}, b[2] = {right, -1};
    if (!slab->plan->wraps) {
        a[0] = left < -VD_SHADOW_PAD ? -VD_SHADOW_PAD : left;
        b[0] = right >= width + VD_SHADOW_PAD ? width + VD_SHADOW_PAD - 1 : right;
    } else if (right - left >= width - 1) {
        a[0] = 0;
        b[0] = width - 1;
    } else {
        const int shift = left >= 0 ? left / width * width : -((width - 1 - left) / width) * width;
        a[0] = left - shift;
        b[0] = right - shift;
        if (b[0] >= width) {
            b[1] = b[0] - width;
            b[0] = width - 1;
        }
    }
    for (int part = 0; part < 2; part++) {
        for (int y = top; y <= bottom && a[part] <= b[part]; y++) {
            const float *tiles = slab->tiles + (size_t)y * slab->tile_pitch;
            const int first = (a[part] + VD_SHADOW_PAD) / VD_SHADOW_TILE_WIDTH;
            const int last = (b[part] + VD_SHADOW_PAD) / VD_SHADOW_TILE_WIDTH;
            for (int x = first; x <= last; x++) {
                most = tiles[x] > most ? tiles[x] : most;
            }
        }
    }
    return most;
}

/* ---- 8 bits -----------------------------------------------------------------------------------
 */

static inline vector_u8 same_u8(vector_u8 v) {
    return v;
}

static inline vector_u8 count_u8(vector_u8 count, vector_u8 base, vector_u8 there,
                                 const vd_shadow_slab *slab, int k) {
    const uint8_t drop = slab->drop[k] < 255 ? (uint8_t)slab->drop[k] : 255;
#if defined(__AVX512BW__)
    const __m512i limit = _mm512_adds_epu8((__m512i)base, _mm512_set1_epi8((char)drop));
    const __mmask64 under = _mm512_cmpgt_epu8_mask((__m512i)there, limit);
    return (vector_u8)_mm512_mask_add_epi8((__m512i)count, under, (__m512i)count,
                                           _mm512_set1_epi8(1));
#elif defined(__AVX2__)
    const __m256i limit = _mm256_adds_epu8((__m256i)base, _mm256_set1_epi8((char)drop));
    const __m256i over = _mm256_subs_epu8((__m256i)there, limit);
    return count + (vector_u8)_mm256_min_epu8(over, _mm256_set1_epi8(1));
#elif defined(__SSE4_1__)
    const __m128i limit = _mm_adds_epu8((__m128i)base, _mm_set1_epi8((char)drop));
    const __m128i over = _mm_subs_epu8((__m128i)there, limit);
    return count + (vector_u8)_mm_min_epu8(over, _mm_set1_epi8(1));
#else
    vector_u8 limit = base + drop;
    limit |= (vector_u8)(limit < base);
    return count - (vector_u8)(there > limit);
#endif
}

static inline void narrow_u8(uint8_t *out, vector_u8 count) {
    memcpy(out, &count, sizeof count);
}

/* For whole heights: lowest + t >= ground without rounding. */
static inline int above_whole(uint32_t lowest, const vd_shadow_slab *slab, int k, float ground) {
    return (float)(lowest + slab->drop[k]) >= ground;
}

#define SAMPLE uint8_t
#define VECTOR vector_u8
#define COUNTER vector_u8
#define LANES BYTES
#define COUNT count_rows_u8
#define MAXIMA maxima_u8
#define GROUND ground_u8
#define LOWEST lowest_u8
#define RUNS runs_u8
#define base_heights same_u8
#define count_under count_u8
#define is_above above_whole
#define narrow narrow_u8
#include "terrain/shadow_block.inl"
#undef SAMPLE
#undef VECTOR
#undef COUNTER
#undef LANES
#undef COUNT
#undef MAXIMA
#undef GROUND
#undef LOWEST
#undef RUNS
#undef base_heights
#undef count_under
#undef narrow

/* ---- 16 bits ----------------------------------------------------------------------------------
 */

static inline vector_u16 same_u16(vector_u16 v) {
    return v;
}

static inline vector_u16 count_u16(vector_u16 count, vector_u16 base, vector_u16 there,
                                   const vd_shadow_slab *slab, int k) {
    const uint16_t drop = (uint16_t)slab->drop[k];
#if defined(__AVX512BW__)
    const __m512i limit = _mm512_adds_epu16((__m512i)base, _mm512_set1_epi16((short)drop));
    const __mmask32 under = _mm512_cmpgt_epu16_mask((__m512i)there, limit);
    return (vector_u16)_mm512_mask_add_epi16((__m512i)count, under, (__m512i)count,
                                             _mm512_set1_epi16(1));
#elif defined(__AVX2__)
    const __m256i limit = _mm256_adds_epu16((__m256i)base, _mm256_set1_epi16((short)drop));
    const __m256i over = _mm256_subs_epu16((__m256i)there, limit);
    return count + (vector_u16)_mm256_min_epu16(over, _mm256_set1_epi16(1));
#elif defined(__SSE4_1__)
    const __m128i limit = _mm_adds_epu16((__m128i)base, _mm_set1_epi16((short)drop));
    const __m128i over = _mm_subs_epu16((__m128i)there, limit);
    return count + (vector_u16)_mm_min_epu16(over, _mm_set1_epi16(1));
#else
    vector_u16 limit = base + drop;
    limit |= (vector_u16)(limit < base);
    return count - (vector_u16)(there > limit);
#endif
}

static inline void narrow_u16(uint8_t *out, vector_u16 count) {
    const half_u8 bytes = __builtin_convertvector(count, half_u8);
    memcpy(out, &bytes, sizeof bytes);
}

#define SAMPLE uint16_t
#define VECTOR vector_u16
#define COUNTER vector_u16
#define LANES (BYTES / 2)
#define COUNT count_rows_u16
#define MAXIMA maxima_u16
#define GROUND ground_u16
#define LOWEST lowest_u16
#define RUNS runs_u16
#define base_heights same_u16
#define count_under count_u16
#define narrow narrow_u16
#include "terrain/shadow_block.inl"
#undef SAMPLE
#undef VECTOR
#undef COUNTER
#undef LANES
#undef COUNT
#undef MAXIMA
#undef GROUND
#undef LOWEST
#undef RUNS
#undef base_heights
#undef count_under
#undef is_above
#undef narrow

/* ---- float ------------------------------------------------------------------------------------
 */

/* A hole compares from infinity: it is never under. */
static inline vd_wide_f32 base_f32(vd_wide_f32 v) {
    return vd_wide_select_f32(v > -INFINITY, v, v - v + INFINITY);
}

static inline vd_wide_u32 count_f32(vd_wide_u32 count, vd_wide_f32 base, vd_wide_f32 there,
                                    const vd_shadow_slab *slab, int k) {
    return count - (vd_wide_u32)(base + slab->plan->t[k] < there);
}

static inline int above_f32(float lowest, const vd_shadow_slab *slab, int k, float ground) {
    return lowest + slab->plan->t[k] >= ground;
}

static inline void narrow_f32(uint8_t *out, vd_wide_u32 count) {
    vd_wide_store_u8(out, count);
}

#define SAMPLE float
#define VECTOR vd_wide_f32
#define COUNTER vd_wide_u32
#define LANES VD_WIDE_LANES
#define COUNT count_rows_f32
#define MAXIMA maxima_f32
#define GROUND ground_f32
#define LOWEST lowest_f32
#define RUNS runs_f32
#define base_heights base_f32
#define count_under count_f32
#define is_above above_f32
#define narrow narrow_f32
#include "terrain/shadow_block.inl"

const vd_shadow_kernels TABLE = {{count_rows_u8, count_rows_u16, count_rows_f32},
                                 {maxima_u8, maxima_u16, maxima_f32}};

/* display_vectors.h: four 16-bit channels a pixel over wide.h's vectors. Half as many pixels as
 * there are lanes in a vector; unpacking goes by 128 bits at a time, as x86 does it. */
#ifndef VEDUTA_DISPLAY_VECTORS_H
#define VEDUTA_DISPLAY_VECTORS_H

#include "core/wide_texels.h"

typedef uint8_t vd_bytes __attribute__((vector_size(VD_WIDE_LANES * 4)));
typedef uint16_t vd_channels __attribute__((vector_size(VD_WIDE_LANES * 4)));

#if defined(__AVX512BW__)
#define ON_X86(name, a, b) (vd_channels) _mm512_##name((__m512i)(a), (__m512i)(b))
#define ZERO _mm512_setzero_si512()
#elif defined(__AVX2__)
#define ON_X86(name, a, b) (vd_channels) _mm256_##name((__m256i)(a), (__m256i)(b))
#define ZERO _mm256_setzero_si256()
#elif defined(__SSE4_1__)
#define ON_X86(name, a, b) (vd_channels) _mm_##name((__m128i)(a), (__m128i)(b))
#define ZERO _mm_setzero_si128()
#endif

/* Bytes to 16 bits: the lower and the upper 8 of every 16. */
static inline vd_channels vd_channels_low(vd_wide_i32 bytes) {
#if defined(ON_X86)
    return ON_X86(unpacklo_epi8, bytes, ZERO);
#else
    const vd_bytes b = (vd_bytes)bytes, zero = {0};
    return (vd_channels)__builtin_shufflevector(b, zero, 0, 16, 1, 17, 2, 18, 3, 19, 4, 20, 5, 21,
                                                6, 22, 7, 23);
#endif
}

static inline vd_channels vd_channels_high(vd_wide_i32 bytes) {
#if defined(ON_X86)
    return ON_X86(unpackhi_epi8, bytes, ZERO);
#else
    const vd_bytes b = (vd_bytes)bytes, zero = {0};
    return (vd_channels)__builtin_shufflevector(b, zero, 8, 24, 9, 25, 10, 26, 11, 27, 12, 28, 13,
                                                29, 14, 30, 15, 31);
#endif
}

/* The lower, or upper, 64 bits of every 128 of a and b in turns. */
static inline vd_channels vd_channels_first(vd_channels a, vd_channels b) {
#if defined(ON_X86)
    return ON_X86(unpacklo_epi64, a, b);
#else
    return __builtin_shufflevector(a, b, 0, 1, 2, 3, 8, 9, 10, 11);
#endif
}

static inline vd_channels vd_channels_second(vd_channels a, vd_channels b) {
#if defined(ON_X86)
    return ON_X86(unpackhi_epi64, a, b);
#else
    return __builtin_shufflevector(a, b, 4, 5, 6, 7, 12, 13, 14, 15);
#endif
}

/* Half a vector of pixels from memory. */
static inline vd_channels vd_channels_load(const uint8_t *from) {
    typedef uint8_t bytes __attribute__((vector_size(VD_WIDE_LANES * 2)));
    bytes b;
    memcpy(&b, from, sizeof b);
    return __builtin_convertvector(b, vd_channels);
}

/* Every pixel's alpha in all of its channels. */
static inline vd_channels vd_channels_alpha(vd_channels v) {
#if defined(__AVX512BW__)
    return (vd_channels)_mm512_shufflehi_epi16(_mm512_shufflelo_epi16((__m512i)v, 0xFF), 0xFF);
#elif defined(__AVX2__)
    return (vd_channels)_mm256_shufflehi_epi16(_mm256_shufflelo_epi16((__m256i)v, 0xFF), 0xFF);
#elif defined(__SSE4_1__)
    return (vd_channels)_mm_shufflehi_epi16(_mm_shufflelo_epi16((__m128i)v, 0xFF), 0xFF);
#else
    return __builtin_shufflevector(v, v, 3, 3, 3, 3, 7, 7, 7, 7);
#endif
}

static inline vd_channels vd_channels_min(vd_channels a, vd_channels b) {
#if defined(ON_X86)
    return ON_X86(min_epu16, a, b);
#else
    const vd_channels less = (vd_channels)(a < b);
    return (a & less) | (b & ~less);
#endif
}

/* round(v / 255) for v <= 65152. */
static inline vd_channels vd_channels_divide_255(vd_channels v) {
    const vd_channels t = v + 128;
#if defined(ON_X86)
    const vd_channels scale = (vd_channels){0} + 257;
    return ON_X86(mulhi_epu16, t, scale);
#else
    return (t + (t >> 8)) >> 8;
#endif
}

/* Shares of 0 … 256 as the two below take them, twice a lane. */
static inline vd_wide_i32 vd_channels_shares(vd_wide_i32 share) {
#if defined(ON_X86)
    const vd_wide_u32 scaled = (vd_wide_u32)(share * -128) & 0xFFFF;
#else
    const vd_wide_u32 scaled = (vd_wide_u32)share;
#endif
    return (vd_wide_i32)(scaled | (scaled << 16));
}

/* a + ((b − a)·share + 128 >> 8) for bytes a and b. On x86 by its rounding multiplication, to which
 * shares are −128 times as large: +128 times would not fit. WebAssembly's saturates, which takes
 * browsers on x86 more instructions; the same sum, 256 times as large, fits 16 bits. */
static inline vd_channels vd_channels_mix(vd_channels a, vd_channels b, vd_channels share) {
#if defined(ON_X86)
    return a + (vd_channels)vd_wide_multiply_high((vd_wide_i16)(a - b), (vd_wide_i16)share);
#else
    return ((a << 8) + 128 + (b - a) * share) >> 8;
#endif
}

/* The same of the lower, or upper, 8 bytes of every 16. WebAssembly's gets 256·a + 128 by
 * unpacking. */
static inline vd_channels vd_channels_mix_low(vd_wide_i32 a, vd_wide_i32 b, vd_channels share) {
#if defined(ON_X86)
    return vd_channels_mix(vd_channels_low(a), vd_channels_low(b), share);
#else
    const vd_bytes half = (vd_bytes){0} + 128;
    const vd_channels scaled = (vd_channels)__builtin_shufflevector(
        half, (vd_bytes)a, 0, 16, 1, 17, 2, 18, 3, 19, 4, 20, 5, 21, 6, 22, 7, 23);
    return (scaled + (vd_channels_low(b) - vd_channels_low(a)) * share) >> 8;
#endif
}

static inline vd_channels vd_channels_mix_high(vd_wide_i32 a, vd_wide_i32 b, vd_channels share) {
#if defined(ON_X86)
    return vd_channels_mix(vd_channels_high(a), vd_channels_high(b), share);
#else
    const vd_bytes half = (vd_bytes){0} + 128;
    const vd_channels scaled = (vd_channels)__builtin_shufflevector(
        half, (vd_bytes)a, 8, 24, 9, 25, 10, 26, 11, 27, 12, 28, 13, 29, 14, 30, 15, 31);
    return (scaled + (vd_channels_high(b) - vd_channels_high(a)) * share) >> 8;
#endif
}

#undef ON_X86
#undef ZERO
#endif

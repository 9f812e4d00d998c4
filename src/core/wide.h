/* wide.h: vectors as wide as the file's SIMD level, over GCC's vector extensions.
 *
 * A kernel's body is written once against these names and compiled once per level (files *_v2.c,
 * *_v3.c, *_v4.c): 4, 8 or 16 lanes of 32 bits. Lane i of a result depends on lane i of the
 * operands only, every operation rounds as the scalar one does, and min and max are `a < b ? a : b`
 * as in the plain references, so all levels give the same bytes. Nothing here has an external name.
 */
#ifndef VEDUTA_CORE_WIDE_H
#define VEDUTA_CORE_WIDE_H

#include <stdint.h>
#include <string.h>

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

#endif

/* lens_map_kernels.inl: the lens map's rows over vectors as wide as the file's SIMD level. A file
 * per level defines TABLE and includes this.
 *
 * What is done once for all cameras:
 *
 *     heights ──► levels ──► maxima            vd_lens_map_init, once a map
 *        │
 *        ├──► slopes ─► N·L, N.z ┐
 *        ├──► shadow counts ─────┤ light
 *        └──► colour by height ──┴─► texels ──► halves        vd_lens_map_light, once a sun
 *               (or imagery)
 *
 * A picture then costs one fetch a sample: light and shadow are in the texels, and their half sizes
 * average what is seen, not normals. That is why the sum of four lit texels is right where the
 * light of a mean normal is not.
 *
 * Shape. Every kernel makes one row (or a run of 256 texels of it) and knows nothing of edges:
 * first and last elements, and the odd ones, are made by the reference's own functions, so there is
 * one rule for them. Rows are cut into at most 64 bands, each with one writer. Holes cost nothing
 * where there are none: the mean of a vertical triple is finite exactly when no hole is in it (the
 * weights add up to at most 1, so nothing overflows), and the few means that are not are made
 * again, one by one; slopes test for holes only in maps that have some.
 *
 * Texels at the samples (no imagery, or imagery of the map's size) need no interpolation: their
 * terms pass from slopes to light through 2 KiB. Texels between samples take the terms of two
 * sample rows, blended along the column once a row of texels, then gathered along it; a rotated
 * picture, which is rare, is made by the reference's texel in parallel.
 *
 * Shadow counts, a byte a sample, stand where the half sizes are written afterwards: lighting anew
 * holds nothing more than the shadows' slab (4 MiB and the reach of the rays), and touches no new
 * memory.
 *
 * Floor, for 2048² floats without colours: heights 16 MiB, read by the means, the maxima, the
 * shadows' slab and the light; texels 16 MiB written and read once by the halves; 16 MiB of levels,
 * maxima, halves and counts written: 0.11 GB, 7 ms of one core at 16 GB/s. The first touch of the
 * 32 MiB that stay is 8,192 page faults: vd_lens_map_init takes 10 ms cold and 4 ms in memory that
 * was touched before. Measured on two cores that others used too, AVX-512, both threads added up:
 * 52–61 ms cold, 31–44 ms warm, of which 17 are light and halves and most of the rest shadows (sun
 * 45° high; some three times as much at 1°, where all 255 steps count).
 *
 * Tried: sRGB by a table, three gathers a texel to decode: 3.1 ns a texel for the light alone,
 * against 1.8 with polynomials. A 64 MiB slab for the shadows: no faster warm, 6 ms slower cold; 2
 * MiB: more, smaller bands, 8.4 ms against 7.1–8.2 to light 1024² anew under a low sun, which is
 * within that machine's noise.
 */
#include "core/wide.h"
#include "terrain/lens_map_internal.h"

#define LANES VD_WIDE_LANES
#define CHUNK 256 /* outputs at a time, whose inputs stay in the first-level cache */

typedef vd_wide_f32 wide;
typedef vd_wide_mask mask;

/* ---- heights and maxima -----------------------------------------------------------------------
 */

/* Sums of columns, then every second sum with its neighbours. The sums are finite exactly where
 * there is no hole: the weights add up to at most 1. */
static bool lens_mean(const float *above, const float *here, const float *below, int first,
                      int count, float *restrict out) {
    const float all = 0.5f + (above != NULL ? 0.25f : 0.0f) + (below != NULL ? 0.25f : 0.0f);
    float sums[2 * CHUNK + LANES + 1];
    vd_wide_i32 bad = {0};
    for (int from = 0; from < count; from += CHUNK) {
        const int some = count - from < CHUNK ? count - from : CHUNK, columns = 2 * some + 1;
        const int at = first - 1 + 2 * from;
        int i = 0;
        for (; i + LANES <= columns; i += LANES) {
            wide sum = vd_wide_load_f32(here + at + i) * 0.5f;
            if (above != NULL) {
                sum = vd_wide_load_f32(above + at + i) * 0.25f + sum;
            }
            if (below != NULL) {
                sum = sum + vd_wide_load_f32(below + at + i) * 0.25f;
            }
            vd_wide_store_f32(sums + i, sum);
            bad |= ~(sum > -INFINITY);
        }
        for (; i < columns; i++) {
            float sum = here[at + i] * 0.5f;
            sum = above != NULL ? above[at + i] * 0.25f + sum : sum;
            sum = below != NULL ? sum + below[at + i] * 0.25f : sum;
            sums[i] = sum;
            bad[0] |= !(sum > -INFINITY);
        }
        float *to = out + from;
        for (int j = 0; j < some; j++) {
            to[j] = ((sums[2 * j] * 0.25f + sums[2 * j + 1] * 0.5f) + sums[2 * j + 2] * 0.25f) +
                    0.0f; /* not −0 */
        }
        if (all != 1.0f) {
            for (int j = 0; j < some; j++) {
                to[j] /= all;
            }
        }
    }
    int32_t any = 0;
    for (int i = 0; i < LANES; i++) {
        any |= bad[i];
    }
    return any != 0;
}

static float lens_lowest(const float *heights, int count, float low) {
    wide least = vd_wide_splat_f32(low);
    int i = 0;
    for (; i + LANES <= count; i += LANES) {
        const wide h = vd_wide_load_f32(heights + i);
        const mask hole = vd_wide_not(vd_wide_less_f32(vd_wide_splat_f32(-INFINITY), h));
        least = vd_wide_min_f32(vd_wide_blend_f32(hole, least, h), least);
    }
    for (int j = 0; j < LANES; j++) {
        low = least[j] < low ? least[j] : low;
    }
    for (; i < count; i++) {
        low = heights[i] > -INFINITY && heights[i] < low ? heights[i] : low;
    }
    return low;
}

static void lens_maxima(const float *const rows[3], int width, int reach,
                        const float *const coarse[2], int count, float *restrict out) {
    float most[2 * CHUNK + LANES + 1];
    for (int from = 0; from < count; from += CHUNK) {
        const int some = count - from < CHUNK ? count - from : CHUNK;
        const int at = 2 * from, wanted = 2 * some + reach - 2;
        const int columns = width - at < wanted ? width - at : wanted;
        int i = 0;
        for (; i + LANES <= columns; i += LANES) {
            const wide a = vd_wide_load_f32(rows[0] + at + i),
                       b = vd_wide_load_f32(rows[1] + at + i),
                       c = vd_wide_load_f32(rows[2] + at + i);
            vd_wide_store_f32(most + i, vd_wide_max_f32(vd_wide_max_f32(a, b), c));
        }
        for (; i < columns; i++) {
            const float a = rows[0][at + i], b = rows[1][at + i], c = rows[2][at + i];
            const float ab = b < a ? a : b;
            most[i] = c < ab ? ab : c;
        }
        for (; i < wanted; i++) {
            most[i] = most[columns - 1];
        }
        float *to = out + from;
        const float *top = coarse[0] + from, *bottom = coarse[1] + from;
        const int third = reach - 1;
        for (int j = 0; j < some; j++) {
            const float a = most[2 * j], b = most[2 * j + 1], c = most[2 * j + third];
            const float p = top[j] > bottom[j] ? top[j] : bottom[j];
            const float q = top[j + 1] > bottom[j + 1] ? top[j + 1] : bottom[j + 1];
            float highest = a > b ? a : b;
            highest = highest > c ? highest : c;
            highest = highest > p ? highest : p;
            highest = highest > q ? highest : q;
            to[j] = highest + 0.0f;
        }
    }
}

/* ---- light ------------------------------------------------------------------------------------
 */

static inline mask is_ground(wide h) {
    return vd_wide_less_f32(vd_wide_splat_f32(-INFINITY), h);
}

/* As the reference's, where any of the three may be a hole. */
static inline wide difference(wide before, wide here, wide after) {
    const mask b = is_ground(before), h = is_ground(here), a = is_ground(after);
    const wide one = vd_wide_splat_f32(1.0f), none = vd_wide_splat_f32(0.0f);
    const wide d = vd_wide_blend_f32(a, after, here) - vd_wide_blend_f32(b, before, here);
    const wide factor = vd_wide_blend_f32((mask)(a & b), one * 0.5f, one);
    return vd_wide_blend_f32((mask)(h | (a & b)), d * factor, none);
}

static inline wide visible_share(const vd_lens_light *l, const uint8_t *counts) {
    uint32_t words[LANES / 4], any = 0;
    memcpy(words, counts, sizeof words);
    for (int i = 0; i < LANES / 4; i++) {
        any |= words[i];
    }
    return any == 0 ? vd_wide_splat_f32(1.0f)
                    : vd_wide_gather_f32(l->visible, (vd_wide_i32)vd_wide_load_u8(counts));
}

static void lens_terms(const vd_lens_light *l, int row, int first, int count,
                       float *restrict direct, float *restrict up) {
    const float *here = l->heights + (size_t)row * l->stride;
    const bool has_above = row > 0, has_below = row + 1 < l->map->height;
    const float *above = has_above ? here - l->stride : here;
    const float *below = has_below ? here + l->stride : here;
    const float by_row = has_above && has_below ? 0.5f : 1.0f;
    const uint8_t *counts = l->counts != NULL ? l->counts + (size_t)row * l->counts_stride : NULL;
    const wide hole = vd_wide_splat_f32(-INFINITY), none = vd_wide_splat_f32(0.0f);
    const bool holes = l->map->holes > 0;
    int i = 0;
    for (; i + LANES <= count; i += LANES) {
        const int at = first + i;
        const wide west = vd_wide_load_f32(here + at - 1), east = vd_wide_load_f32(here + at + 1);
        const wide north = vd_wide_load_f32(above + at), south = vd_wide_load_f32(below + at);
        wide c = (east - west) * 0.5f, r = (south - north) * by_row;
        if (holes) {
            const wide h = vd_wide_load_f32(here + at);
            c = difference(west, h, east);
            r = difference(has_above ? north : hole, h, has_below ? south : hole);
        }
        const wide x = c * l->slope[0] + r * l->slope[1], y = c * l->slope[2] + r * l->slope[3];
        const wide z = 1.0f / vd_wide_sqrt_f32((x * x + y * y) + 1.0f);
        wide facing = (l->to_sun[2] - (x * l->to_sun[0] + y * l->to_sun[1])) * z;
        facing = vd_wide_max_f32(facing, none);
        if (counts != NULL) {
            facing *= visible_share(l, counts + at);
        }
        vd_wide_store_f32(direct + i, facing);
        vd_wide_store_f32(up + i, vd_wide_max_f32(z, none));
    }
    for (; i < count; i++) {
        const vd_lens_terms t = vd_lens_terms_at(l, first + i, row);
        direct[i] = t.direct;
        up[i] = t.up;
    }
}

/* Whole vectors of `count` elements, and the rest through copies of a vector's size. */
#define EACH_VECTOR(count) for (int i = 0; i < (count); i += LANES)

static inline size_t part_bytes(int count, int i) {
    return (size_t)(count - i < LANES ? count - i : LANES) * 4;
}

static inline wide load_part(const float *from, size_t bytes) {
    wide v = {0};
    if (bytes == sizeof v) {
        return vd_wide_load_f32(from);
    }
    memcpy(&v, from, bytes);
    return v;
}

static inline void store_part(void *to, vd_wide_u32 v, size_t bytes) {
    if (bytes == sizeof v) {
        memcpy(to, &v, sizeof v);
    } else {
        memcpy(to, &v, bytes);
    }
}

static inline vd_wide_u32 gather_u32(const uint32_t *base, vd_wide_i32 i) {
    return (vd_wide_u32)vd_wide_gather_f32((const float *)(const void *)base, i);
}

static void lens_table(const vd_lens_light *l, const float *heights, int count,
                       uint32_t *restrict out) {
    const wide last = vd_wide_splat_f32((float)(l->table_count - 1)), none = last - last;
    EACH_VECTOR(count) {
        const size_t bytes = part_bytes(count, i);
        wide at = (load_part(heights + i, bytes) - l->table_from) * l->table_scale + 0.5f;
        at = vd_wide_min_f32(vd_wide_max_f32(at, none), last);
        store_part(out + i, gather_u32(l->table, vd_wide_to_i32(at)), bytes);
    }
}

static inline wide decode(vd_wide_u32 byte) {
    const wide e = __builtin_convertvector((vd_wide_i32)byte, wide) * (1.0f / 255.0f);
    const mask toe = vd_wide_less_f32(e, vd_wide_splat_f32(VD_SRGB_ENCODED_TOE));
    return vd_wide_blend_f32(toe, e * (1.0f / 12.92f), VD_SRGB_DECODE(e));
}

static inline vd_wide_u32 encode(wide linear) {
    const wide none = vd_wide_splat_f32(0.0f), one = vd_wide_splat_f32(1.0f);
    linear = vd_wide_min_f32(vd_wide_max_f32(linear, none), one);
    const wide s = vd_wide_sqrt_f32(linear);
    const mask toe = vd_wide_less_f32(linear, vd_wide_splat_f32(VD_SRGB_LINEAR_TOE));
    const wide encoded = vd_wide_blend_f32(toe, linear * 12.92f, VD_SRGB_ENCODE(s));
    return (vd_wide_u32)vd_wide_to_i32(encoded * 255.0f + 0.5f);
}

static void lens_shade(const vd_lens_light *l, const uint32_t *albedo, const float *direct,
                       const float *up, int count, uint32_t *restrict out) {
    EACH_VECTOR(count) {
        const size_t bytes = part_bytes(count, i);
        const vd_wide_u32 color =
            (vd_wide_u32)load_part((const float *)(const void *)(albedo + i), bytes);
        const wide sun = load_part(direct + i, bytes);
        const wide sky = 0.5f + 0.5f * load_part(up + i, bytes);
        vd_wide_u32 lit = (vd_wide_u32)vd_wide_splat_i32(0) | 0xFF000000u;
        for (int c = 0; c < 3; c++) {
            const wide linear = decode(color >> (8 * c) & 255u);
            const wide light = l->sun[c] * sun + (l->ambient[c] + l->ambient_more[c] * sky);
            lit |= encode(linear * light) << (8 * c);
        }
        store_part(out + i, lit, bytes);
    }
}

static void lens_blend(const float *a, const float *b, float weight, int count,
                       float *restrict out) {
    for (int i = 0; i < count; i++) {
        out[i] = a[i] + (b[i] - a[i]) * weight;
    }
}

static void lens_spread(const float *v, const int32_t *first, const float *weight, int count,
                        float *restrict out) {
    EACH_VECTOR(count) {
        const size_t bytes = part_bytes(count, i);
        const vd_wide_i32 at =
            (vd_wide_i32)load_part((const float *)(const void *)(first + i), bytes);
        const wide a = vd_wide_gather_f32(v, at), b = vd_wide_gather_f32(v + 1, at);
        store_part(out + i, (vd_wide_u32)(a + (b - a) * load_part(weight + i, bytes)), bytes);
    }
}

/* Sums of products of whole numbers: exact in any order. */
static void lens_mix(const uint32_t *top, const uint32_t *bottom, uint32_t row_weight,
                     const vd_lens_mix *mix, int count, uint32_t *restrict out) {
    const uint32_t pairs = 0x00FF00FFu;
    for (int i = 0; i < count; i++) {
        const uint32_t a = top[mix[i].first], b = top[mix[i].second];
        const uint32_t c = bottom[mix[i].first], d = bottom[mix[i].second];
        const uint32_t w = mix[i].weight, v = 256 - w;
        const uint32_t top_rb = (a & pairs) * v + (b & pairs) * w;
        const uint32_t top_ga = (a >> 8 & pairs) * v + (b >> 8 & pairs) * w;
        const uint32_t low_rb = (c & pairs) * v + (d & pairs) * w;
        const uint32_t low_ga = (c >> 8 & pairs) * v + (d >> 8 & pairs) * w;
        const uint32_t y = row_weight, x = 256 - y, low = 0xFFFFu;
        const uint32_t red = ((top_rb & low) * x + (low_rb & low) * y + 32768) >> 16;
        const uint32_t blue = ((top_rb >> 16) * x + (low_rb >> 16) * y + 32768) >> 16;
        const uint32_t green = ((top_ga & low) * x + (low_ga & low) * y + 32768) >> 16;
        const uint32_t alpha = ((top_ga >> 16) * x + (low_ga >> 16) * y + 32768) >> 16;
        out[i] = red | green << 8 | blue << 16 | alpha << 24;
    }
}

static void lens_half(const uint32_t *top, const uint32_t *bottom, int count,
                      uint32_t *restrict out) {
    const uint32_t pairs = 0x00FF00FFu, two = 0x00020002u;
    for (int i = 0; i < count; i++) {
        const uint32_t a = top[2 * i], b = top[2 * i + 1], c = bottom[2 * i], d = bottom[2 * i + 1];
        const uint32_t rb = (a & pairs) + (b & pairs) + (c & pairs) + (d & pairs) + two;
        const uint32_t ga =
            (a >> 8 & pairs) + (b >> 8 & pairs) + (c >> 8 & pairs) + (d >> 8 & pairs) + two;
        out[i] = (rb >> 2 & pairs) | (ga >> 2 & pairs) << 8;
    }
}

const vd_lens_kernels TABLE = {lens_mean,  lens_lowest, lens_maxima, lens_terms, lens_table,
                               lens_shade, lens_blend,  lens_spread, lens_mix,   lens_half};

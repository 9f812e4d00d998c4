/* splat_kernels.inl: the kernels' bodies over wide.h. A file per SIMD level defines TABLE and
 * includes this; the table is the file's only external name.
 *
 * A particle smaller than a pixel is a box of one pixel, which touches four:
 *
 *        share of the right ones
 *          |<-->|
 *     +----+----+----+        the middle, snapped to 1/256 pixel, gives the upper left pixel and
 * two |  +-|--+ |    |  --    shares; the weight of a pixel is alpha × its share of the row × its
 *     +--|-+--|-+----+   |    share of the column (Lawlor 2004, §6.6.1.1, with a table of all four)
 *     |  +-|--+ |    |  -- share of the lower ones
 *     +----+----+----+
 *
 * Projection runs 16 particles at a time and leaves all that blending needs in 16 bytes: place in
 * the tile and the right share, colour, alpha × upper share, alpha × lower share. Blending is then,
 * twice, load two pixels, c = c · (1 − w) + splat · w, store: eight floats at once, all channels.
 * (c += (splat − c) · w is one multiplication less, but more of it waits for the pixel, and an
 * opaque splat does not come out exactly: 20 M alternating, least of three each, 150 ms against
 * 143.)
 *
 * Why floats, when targets are 16 bits a channel: with integers an alpha of 0.001, split over four
 * pixels, is 16 units of 65,536 and comes out 2 % off; rounding each of 2,000 such steps moves the
 * sum by another percent. Floats cost the same instructions (a multiplication of 32-bit integers
 * takes longer) and twice the cache, which tiles make cheap; the colour is rounded once, to 16
 * bits.
 *
 * CPU time a splat, one thread of a loaded EPYC of Zen 4 at 1024². 3 M in bricks of 8,192 (clearing
 * and rounding the picture, 1.3 ns, included): 24 ns reading arrays in drawing order; 15.5 reading
 * them in a row and taking records in order; 14 with four counters a tile; 12 with tiles of 64²
 * pixels instead of 32²; 10.5 with chunks of 8,192 instead of 16,384; pixels asked for 16 records
 * ahead are 6 % of that. 10 M: 10 ns with tiles of 64², 8.4 with 128², whose 270 KB need a second
 * level of half a megabyte; a way for chunks within one tile is 2 % of it. Loading and storing
 * pixels one by one instead of two at a time crosses no lines and lets overlapping splats be
 * forwarded; within noise. */
#include <math.h>
#include "core/wide.h"
#include "core/wide_records.h"
#include "splat/splat_kernels.h"

/* ---- reading ----------------------------------------------------------------------------------*/

/* Which particles a vector holds: those in a row from `first`, or those of `at`. */
typedef struct lanes {
    bool in_a_row;
    size_t first;
    vd_wide_i32 at;
} lanes;

static inline lanes choose_lanes(const uint32_t *order, size_t first, size_t left) {
    lanes l = {order == NULL, first, {0}};
    if (left >= VD_WIDE_LANES) {
        if (!l.in_a_row) {
            l.at = vd_wide_load_i32((const int32_t *)(const void *)(order + first));
        }
        return l;
    }
    l.in_a_row = false;
    for (size_t i = 0; i < VD_WIDE_LANES; i++) {
        const size_t k = first + (i < left ? i : left - 1);
        l.at[i] = (int32_t)(order != NULL ? order[k] : k);
    }
    return l;
}

static inline vd_wide_f32 read_f32(const float *from, const lanes *l) {
    return l->in_a_row ? vd_wide_load_f32(from + l->first) : vd_wide_gather_f32(from, l->at);
}

static inline vd_wide_u32 read_u32(const void *from, const lanes *l) {
    return (vd_wide_u32)read_f32(from, l);
}

static inline vd_wide_f32 read_u16(const uint16_t *from, const lanes *l) {
    if (l->in_a_row) {
        return vd_wide_to_f32((vd_wide_i32)vd_wide_load_u16(from + l->first));
    }
    int32_t at[VD_WIDE_LANES];
    uint16_t numbers[VD_WIDE_LANES];
    vd_wide_store_i32(at, l->at);
    for (int i = 0; i < VD_WIDE_LANES; i++) {
        numbers[i] = from[at[i]];
    }
    return vd_wide_to_f32((vd_wide_i32)vd_wide_load_u16(numbers));
}

static inline vd_wide_i32 read_u8(const uint8_t *from, const lanes *l) {
    return l->in_a_row ? (vd_wide_i32)vd_wide_load_u8(from + l->first)
                       : vd_wide_gather_u8(from, l->at);
}

static inline vd_wide_f32 read_number(const float *from, const uint16_t *from16, const lanes *l) {
    return from16 != NULL ? read_u16(from16, l) : read_f32(from, l);
}

static inline vd_wide_u32 look_up(const uint32_t *table, vd_wide_i32 i) {
    return (vd_wide_u32)vd_wide_gather_f32((const float *)(const void *)table, i);
}

/* ---- colours ----------------------------------------------------------------------------------*/

static inline vd_wide_f32 max0(vd_wide_f32 v) {
    return vd_wide_max_f32(v, vd_wide_splat_f32(0.0f));
}

static inline vd_wide_f32 log2_of(vd_wide_f32 v) {
    v = vd_wide_max_f32(v, vd_wide_splat_f32(0x1p-126f));
    const vd_wide_u32 bits = (vd_wide_u32)v;
    const vd_wide_i32 exponent = (vd_wide_i32)(bits >> 23) - 127;
    v = (vd_wide_f32)((bits & 0x7FFFFF) | 0x3F800000);
    const vd_wide_f32 y = (v - 1.0f) / (v + 1.0f), y2 = y * y;
    const vd_wide_f32 series =
        ((0.41219857f * y2 + 0.57707802f) * y2 + 0.96179669f) * y2 + 2.88539008f;
    return vd_wide_to_f32(exponent) + series * y;
}

static inline vd_wide_i32 palette_index(const vd_splat_picture *picture, vd_wide_f32 value) {
    if (picture->log) {
        value = log2_of(value);
    }
    vd_wide_f32 t = max0((value - picture->value_low) * picture->value_scale);
    t = vd_wide_min_f32(t, vd_wide_splat_f32((float)(VD_PALETTE_COLORS - 1)));
    return vd_wide_to_i32(t + 0.5f);
}

static inline vd_wide_u32 read_color(const vd_splat_picture *picture, const vd_placing *p,
                                     const lanes *l) {
    const vd_splats *s = p->splats;
    switch (p->paint) {
    case VD_PAINT_COLOR:
        return read_u32(s->color, l);
    case VD_PAINT_CLASS:
        return look_up(picture->class_colors, read_u8(s->classes, l));
    case VD_PAINT_VALUE:
        return look_up(picture->palette, palette_index(picture, read_f32(s->value, l)));
    case VD_PAINT_VALUE16:
        return look_up(
            picture->palette,
            palette_index(picture, s->value_origin + s->value_step * read_u16(s->value16, l)));
    default:
        return (vd_wide_u32)vd_wide_splat_i32((int32_t)p->constant);
    }
}

/* ---- projection -------------------------------------------------------------------------------*/

typedef struct projected {
    vd_wide_f32 x, y, depth, support, amount;
    vd_wide_u32 color;
    vd_wide_mask drawn; /* before the near plane and finite */
} projected;

static inline vd_wide_f32 row_times(const float row[4], vd_wide_f32 x, vd_wide_f32 y,
                                    vd_wide_f32 z) {
    return (row[0] * x + row[1] * y) + (row[2] * z + row[3]);
}

static inline projected project_lanes(const vd_splat_picture *picture, const vd_placing *p,
                                      const lanes *l, vd_wide_mask active,
                                      vd_splat_counts *counts) {
    const vd_splats *s = p->splats;
    const vd_wide_f32 x = read_number(s->x, s->x16, l), y = read_number(s->y, s->y16, l);
    const vd_wide_f32 z = read_number(s->z, s->z16, l);
    const vd_wide_f32 r =
        s->radius != NULL ? read_f32(s->radius, l) : vd_wide_splat_f32(s->radius_m);
    const vd_wide_mask finite = vd_wide_and(
        active, vd_wide_equal_f32(((x - x) + (y - y)) + ((z - z) + (r - r)), (vd_wide_f32){0}));
    counts->not_finite += (unsigned)__builtin_popcount(vd_wide_bits(active)) -
                          (unsigned)__builtin_popcount(vd_wide_bits(finite));
    const vd_wide_f32 depth = row_times(p->row[2], x, y, z);
    const vd_wide_mask before = vd_wide_or(vd_wide_less_f32(depth, vd_wide_splat_f32(p->near_z)),
                                           vd_wide_less_f32(vd_wide_splat_f32(p->far_z), depth));
    projected out;
    /* A depth that is not a number, from numbers too large, is neither. */
    out.drawn =
        vd_wide_and(vd_wide_and(finite, vd_wide_not(before)), vd_wide_equal_f32(depth, depth));
    const vd_wide_f32 rw = p->perspective ? 1.0f / depth : vd_wide_splat_f32(1.0f);
    out.x = row_times(p->row[0], x, y, z) * rw;
    out.y = row_times(p->row[1], x, y, z) * rw;
    out.depth = p->depth_at + p->depth_by * (p->perspective ? rw : depth);
    out.support = max0(r) * (p->support_scale * rw);
    if (picture->mode == VD_SPLAT_DENSITY) {
        vd_wide_f32 w = s->weight != NULL ? read_f32(s->weight, l) : vd_wide_splat_f32(1.0f);
        w = max0(w * picture->weight_scale + 0.5f);
        const vd_wide_mask kept = vd_wide_less_f32(w, vd_wide_splat_f32(VD_WEIGHT_CUT));
        counts->cut +=
            (unsigned)__builtin_popcount(vd_wide_bits(vd_wide_and(out.drawn, vd_wide_not(kept))));
        out.amount =
            vd_wide_floor_f32(vd_wide_blend_f32(kept, w, vd_wide_splat_f32(VD_WEIGHT_ONE)));
        out.color = (vd_wide_u32){0};
    } else {
        const vd_wide_u32 color = read_color(picture, p, l);
        out.amount = p->opacity * vd_wide_to_f32((vd_wide_i32)(color >> 24));
        out.color = color | 0xFF000000u;
    }
    return out;
}

static float sum_large(const vd_splat_large *large, const vd_splat_shape *shape, int first,
                       int side);

/* The lanes of `bits` are splats larger than a pixel. */
static void keep_large(const vd_splat_picture *picture, const vd_placing *p, const projected *dots,
                       uint32_t bits, vd_splat_scratch *scratch) {
    float x[VD_WIDE_LANES], y[VD_WIDE_LANES], depth[VD_WIDE_LANES];
    float support[VD_WIDE_LANES], amount[VD_WIDE_LANES];
    uint32_t color[VD_WIDE_LANES];
    vd_wide_store_f32(x, dots->x);
    vd_wide_store_f32(y, dots->y);
    vd_wide_store_f32(depth, dots->depth);
    vd_wide_store_f32(support, dots->support);
    vd_wide_store_f32(amount, dots->amount);
    vd_wide_store_u32(color, dots->color);
    for (; bits != 0; bits &= bits - 1) {
        const int i = __builtin_ctz(bits);
        vd_splat_large *large = &scratch->large[scratch->large_count];
        vd_splat_large_init(large, picture, x[i], y[i], support[i], amount[i], sum_large);
        int box[4];
        vd_splat_large_box(large, picture, box);
        if (box[0] >= box[1] || box[2] >= box[3] ||
            (picture->mode == VD_SPLAT_ALPHA && !(large->amount > 0.0f))) {
            continue;
        }
        large->depth = depth[i];
        large->color = color[i];
        large->id = p->frame_id;
        scratch->records[scratch->count + i].head = VD_LARGE | scratch->large_count++;
        scratch->tiles[scratch->count + i] = VD_TILE_SPREAD;
        scratch->counts.drawn++;
    }
}

/* What a record of a small splat says beside its head; returns the lanes that show at all. */
static inline vd_wide_mask fill_record(const vd_splat_picture *picture, const vd_placing *p,
                                       const projected *dots, vd_wide_i32 lower,
                                       vd_wide_i32 record[4]) {
    if (picture->mode == VD_SPLAT_DENSITY) {
        const vd_wide_u32 weight = (vd_wide_u32)vd_wide_to_i32(dots->amount);
        record[1] = (vd_wide_i32)(weight * (vd_wide_u32)(256 - lower));
        record[2] = (vd_wide_i32)(weight * (vd_wide_u32)lower);
        record[3] = (vd_wide_i32){0};
        return vd_wide_equal_i32(lower, lower);
    }
    record[1] = (vd_wide_i32)dots->color;
    if (picture->mode == VD_SPLAT_NEAREST) {
        record[2] = (vd_wide_i32)dots->depth;
        record[3] = vd_wide_splat_i32((int32_t)p->frame_id);
        return vd_wide_equal_i32(lower, lower);
    }
    const vd_wide_f32 area = picture->shape.area * (dots->support * dots->support);
    const vd_wide_f32 alpha = dots->amount * area;
    record[2] = (vd_wide_i32)(alpha * (vd_wide_to_f32(256 - lower) * (1.0f / 256.0f)));
    record[3] = (vd_wide_i32)(alpha * (vd_wide_to_f32(lower) * (1.0f / 256.0f)));
    return vd_wide_less_f32((vd_wide_f32){0}, alpha);
}

/* The pixel of a middle, of the picture's the nearest: x as snap() has it. */
static inline vd_wide_i32 middle_pixel(vd_wide_i32 x, int size) {
    const vd_wide_i32 pixel = vd_wide_max_i32((x + 128) >> 8, (vd_wide_i32){0});
    return vd_wide_min_i32(pixel, vd_wide_splat_i32(size - 1));
}

/* Of small splats those that the frame does not hide. To ask here, before they become records, is
 * one gather for 16 of them; what is hidden then costs neither bins nor blending. */
static inline vd_wide_mask not_hidden(const vd_splat_picture *picture, vd_wide_mask small,
                                      vd_wide_i32 x, vd_wide_i32 y, vd_wide_f32 depth) {
    const vd_wide_i32 at = middle_pixel(y, picture->height) * (int32_t)picture->hider_stride +
                           middle_pixel(x, picture->width);
    const vd_wide_f32 hider = vd_wide_gather_f32(picture->hider, at);
    return vd_wide_and(small, vd_wide_not(vd_wide_less_f32(depth, hider)));
}

/* The upper left pixel's coordinate in 1/256, as a float; and whether it may be in the picture. */
static inline vd_wide_f32 snap(const vd_splat_picture *picture, vd_wide_f32 at, int size,
                               vd_wide_mask *inside) {
    const bool nearest = picture->mode == VD_SPLAT_NEAREST;
    const vd_wide_f32 snapped =
        nearest ? vd_wide_floor_f32(at) * 256.0f : vd_wide_floor_f32((at - 0.5f) * 256.0f + 0.5f);
    const vd_wide_f32 least = vd_wide_splat_f32(nearest ? -1.0f : -257.0f);
    *inside = vd_wide_and(*inside, vd_wide_less_f32(least, snapped));
    *inside =
        vd_wide_and(*inside, vd_wide_less_f32(snapped, vd_wide_splat_f32((float)size * 256.0f)));
    return snapped;
}

static void project(const vd_splat_picture *picture, const vd_placing *p, const uint32_t *order,
                    size_t first, size_t count, vd_splat_scratch *scratch) {
    const vd_wide_i32 steps = vd_wide_count_i32();
    const bool spreads = picture->mode != VD_SPLAT_NEAREST;
    for (size_t i = 0; i < count; i += VD_WIDE_LANES) {
        const size_t left = count - i;
        const int lane_count = left < VD_WIDE_LANES ? (int)left : VD_WIDE_LANES;
        const lanes l = choose_lanes(order, first + i, left);
        const vd_wide_mask active = vd_wide_less_i32(steps, vd_wide_splat_i32(lane_count));
        const projected dots = project_lanes(picture, p, &l, active, &scratch->counts);
        const vd_wide_mask large = vd_wide_and(
            dots.drawn, vd_wide_less_f32(vd_wide_splat_f32(picture->shape.small), dots.support));
        vd_wide_mask small = vd_wide_and(dots.drawn, vd_wide_not(large));
        const vd_wide_f32 x_float = snap(picture, dots.x, picture->width, &small);
        const vd_wide_f32 y_float = snap(picture, dots.y, picture->height, &small);
        const vd_wide_i32 x = vd_wide_to_i32(vd_wide_blend_f32(small, x_float, (vd_wide_f32){0}));
        const vd_wide_i32 y = vd_wide_to_i32(vd_wide_blend_f32(small, y_float, (vd_wide_f32){0}));
        vd_wide_i32 record[4];
        small = vd_wide_and(small, fill_record(picture, p, &dots, y & 255, record));
        if (picture->hider != NULL) {
            small = not_hidden(picture, small, x, y, dots.depth);
        }
        const vd_wide_i32 px = x >> 8, py = y >> 8;
        const vd_wide_i32 none = {0};
        const vd_wide_i32 tx = vd_wide_max_i32(px, none) >> VD_TILE_LOG2;
        const vd_wide_i32 ty = vd_wide_max_i32(py, none) >> VD_TILE_LOG2;
        const vd_wide_i32 lx = px - (tx << VD_TILE_LOG2) + 1, ly = py - (ty << VD_TILE_LOG2) + 1;
        record[0] = (ly * VD_TILE_STRIDE + lx) | (x & 255) << 16;
        vd_wide_i32 tile = ty * picture->tiles_x + tx;
        if (spreads) {
            const vd_wide_i32 edge = vd_wide_splat_i32(VD_TILE_SIDE);
            const vd_wide_mask right =
                vd_wide_and(vd_wide_equal_i32(lx, edge),
                            vd_wide_less_i32(tx, vd_wide_splat_i32(picture->tiles_x - 1)));
            const vd_wide_mask down =
                vd_wide_and(vd_wide_equal_i32(ly, edge),
                            vd_wide_less_i32(ty, vd_wide_splat_i32(picture->tiles_y - 1)));
            tile = vd_wide_add_where_i32(right, tile, vd_wide_splat_i32(VD_TILE_RIGHT));
            tile = vd_wide_add_where_i32(down, tile, vd_wide_splat_i32(VD_TILE_DOWN));
        }
        tile = vd_wide_blend_i32(small, tile, vd_wide_splat_i32(picture->tile_count));
        vd_wide_store_i32(scratch->tiles + scratch->count, tile);
        if (scratch->count == 0) {
            scratch->tile = scratch->tiles[0];
        }
        const vd_wide_mask same = vd_wide_equal_i32(tile, vd_wide_splat_i32(scratch->tile));
        scratch->uniform &= vd_wide_bits(vd_wide_and(active, vd_wide_not(same))) == 0;
        vd_wide_store_records(scratch->records + scratch->count, record);
        scratch->counts.drawn += (unsigned)__builtin_popcount(vd_wide_bits(small));
        const uint32_t large_bits = vd_wide_bits(large);
        if (large_bits != 0) {
            keep_large(picture, p, &dots, large_bits, scratch);
        }
        scratch->count += lane_count;
    }
}

/* ---- blending ---------------------------------------------------------------------------------*/

/* Two pixels of four floats. */
typedef float pair __attribute__((vector_size(32)));
typedef int32_t pair_i32 __attribute__((vector_size(32)));
typedef uint8_t pair_u8 __attribute__((vector_size(8)));

/* Pixel by pixel: a splat that overlaps the one before finds each of its pixels in one store, which
 * goes straight from store to load; and no access crosses a cache line. */
static inline pair load_pair(const float *from) {
#if defined(__AVX2__)
    const __m256 left = _mm256_castps128_ps256(_mm_load_ps(from));
    return (pair)_mm256_insertf128_ps(left, _mm_load_ps(from + 4), 1);
#else
    pair v;
    memcpy(&v, from, sizeof v);
    return v;
#endif
}

static inline void store_pair(float *to, pair v) {
#if defined(__AVX2__)
    _mm_store_ps(to, _mm256_castps256_ps128((__m256)v));
    _mm_store_ps(to + 4, _mm256_extractf128_ps((__m256)v, 1));
#else
    memcpy(to, &v, sizeof v);
#endif
}

static inline pair color_pair(uint32_t color) {
#if defined(__AVX2__)
    const __m128i bytes = _mm_set1_epi32((int32_t)color);
    return (pair)_mm256_cvtepi32_ps(_mm256_cvtepu8_epi32(bytes));
#else
    const uint64_t twice = (uint64_t)color << 32 | color;
    pair_u8 bytes;
    memcpy(&bytes, &twice, sizeof bytes);
    return __builtin_convertvector(__builtin_convertvector(bytes, pair_i32), pair);
#endif
}

/* The part of a large splat's box that lies in the tile, in the tile's own pixels. */
static bool large_box(const vd_splat_tile *tile, const vd_splat_large *large, int box[4]) {
    vd_splat_large_box(large, tile->picture, box);
    box[0] = box[0] > tile->x ? box[0] : tile->x;
    box[1] = box[1] < tile->x + VD_TILE_SIDE ? box[1] : tile->x + VD_TILE_SIDE;
    box[2] = box[2] > tile->y ? box[2] : tile->y;
    box[3] = box[3] < tile->y + VD_TILE_SIDE ? box[3] : tile->y + VD_TILE_SIDE;
    return box[0] < box[1] && box[2] < box[3];
}

static inline size_t tile_pixel(const vd_splat_tile *tile, int x, int y) {
    return (size_t)((y - tile->y + 1) * VD_TILE_STRIDE + (x - tile->x + 1));
}

static inline vd_wide_f32 clamp01(vd_wide_f32 v) {
    return vd_wide_min_f32(max0(v), vd_wide_splat_f32(1.0f));
}

/* How much of [p, p + 1] lies in [low, high]. */
static inline vd_wide_f32 overlap(vd_wide_f32 p, float low, float high) {
    const vd_wide_f32 from = vd_wide_max_f32(vd_wide_splat_f32(low), p);
    return clamp01(vd_wide_min_f32(p + 1.0f, vd_wide_splat_f32(high)) - from);
}

/* What a row of a large splat's pixels has in common. */
typedef struct large_row {
    const vd_splat_large *large;
    vd_splat_kernel kernel;
    const float *profile; /* gaussian and sph */
    float dy;
    vd_wide_f32 high; /* share of the row, of a box */
} large_row;

static inline large_row row_of(const vd_splat_large *large, const vd_splat_shape *shape, int y) {
    const float r = large->support;
    return (large_row){large, shape->kernel,
                       shape->kernel < VD_SPLAT_GAUSSIAN ? NULL : shape->profile->at,
                       ((float)y + 0.5f) - large->y,
                       overlap(vd_wide_splat_f32((float)y), large->y - r, large->y + r)};
}

/* vd_splat_large_at of a vector of pixels from x on. */
static inline vd_wide_f32 shares_at(const large_row *row, int x) {
    const vd_splat_large *large = row->large;
    const float r = large->support;
    const vd_wide_f32 px = vd_wide_to_f32(vd_wide_count_i32() + x);
    if (row->kernel == VD_SPLAT_BOX) {
        return overlap(px, large->x - r, large->x + r) * row->high;
    }
    const vd_wide_f32 dx = (px + 0.5f) - large->x, square = dx * dx + row->dy * row->dy;
    if (row->kernel == VD_SPLAT_DISC) {
        return clamp01((r + 0.5f) - vd_wide_sqrt_f32(square));
    }
    const vd_wide_f32 s = square * large->inverse, none = {0};
    const vd_wide_mask inside = vd_wide_less_f32(s, vd_wide_splat_f32(1.0f));
    const vd_wide_f32 t = vd_wide_blend_f32(inside, s, none) * (float)VD_PROFILE_STEPS;
    const vd_wide_i32 k = vd_wide_to_i32(t);
    const vd_wide_f32 from = vd_wide_gather_f32(row->profile, k),
                      to = vd_wide_gather_f32(row->profile + 1, k);
    return vd_wide_blend_f32(inside, from + (to - from) * (t - vd_wide_to_f32(k)), none);
}

/* The same of `count` pixels; room for a vector more. */
static void find_shares(const vd_splat_large *large, const vd_splat_shape *shape, int x, int y,
                        int count, float *out) {
    const large_row row = row_of(large, shape, y);
    for (int i = 0; i < count; i += VD_WIDE_LANES) {
        vd_wide_store_f32(out + i, shares_at(&row, x + i));
    }
}

/* Takes away the shares of `count` pixels from (x, y) on where the frame is nearer. */
static void hide_shares(const vd_splat_picture *picture, const vd_splat_large *large, int x, int y,
                        int count, float *shares) {
    const float *hider = picture->hider + (size_t)y * picture->hider_stride + (size_t)x;
    for (int i = 0; i < count; i++) {
        shares[i] = hider[i] > large->depth ? 0.0f : shares[i];
    }
}

/* As vd_splat_large_sum: as many vectors as hold VD_SUM_LANES are its partial sums. */
static float sum_large(const vd_splat_large *large, const vd_splat_shape *shape, int first,
                       int side) {
    enum { VECTORS = VD_SUM_LANES / VD_WIDE_LANES };
    vd_wide_f32 parts[VECTORS] = {{0}};
    for (int y = first; y < first + side; y++) {
        const large_row row = row_of(large, shape, y);
        for (int i = 0, k = 0; i < side; i += VD_WIDE_LANES, k = (k + 1) % VECTORS) {
            parts[k] += shares_at(&row, first + i);
        }
    }
    float sums[VD_SUM_LANES], sum = 0.0f;
    memcpy(sums, parts, sizeof sums);
    for (int i = 0; i < VD_SUM_LANES; i++) {
        sum += sums[i];
    }
    return sum;
}

/* Pixels of four floats in a vector. */
#define WIDE_PIXELS (VD_WIDE_LANES / 4)

/* One value for each of them, from four that may be read. */
static inline vd_wide_f32 for_each_float(const float values[4]) {
#if defined(__AVX512F__)
    const __m512i which = _mm512_set_epi32(3, 3, 3, 3, 2, 2, 2, 2, 1, 1, 1, 1, 0, 0, 0, 0);
    return (vd_wide_f32)_mm512_permutevar_ps(_mm512_broadcast_f32x4(_mm_loadu_ps(values)), which);
#elif defined(__AVX2__)
    const __m256i which = _mm256_set_epi32(1, 1, 1, 1, 0, 0, 0, 0);
    const __m256 twice = _mm256_set_m128(_mm_loadu_ps(values), _mm_loadu_ps(values));
    return (vd_wide_f32)_mm256_permutevar_ps(twice, which);
#else
    return vd_wide_splat_f32(values[0]);
#endif
}

static void blend_large(const vd_splat_tile *tile, const vd_splat_large *large) {
    int box[4];
    if (!large_box(tile, large, box)) {
        return;
    }
    float shares[VD_TILE_SIDE + VD_WIDE_LANES];
    vd_wide_f32 color;
    for (int i = 0; i < VD_WIDE_LANES; i++) {
        color[i] = (float)(large->color >> (8 * (i % 4)) & 255);
    }
    const int count = box[1] - box[0];
    for (int y = box[2]; y < box[3]; y++) {
        float *row = (float *)tile->pixels + 4 * tile_pixel(tile, box[0], y);
        find_shares(large, &tile->picture->shape, box[0], y, count, shares);
        if (tile->picture->hider != NULL) {
            hide_shares(tile->picture, large, box[0], y, count, shares);
        }
        int i = 0;
        for (; i + WIDE_PIXELS <= count; i += WIDE_PIXELS) {
            const vd_wide_f32 weight = large->amount * for_each_float(shares + i);
            const vd_wide_f32 w = vd_wide_min_f32(weight, vd_wide_splat_f32(1.0f));
            const vd_wide_f32 under = vd_wide_load_f32(row + 4 * i);
            vd_wide_store_f32(row + 4 * i, under * (1.0f - w) + color * w);
        }
        for (; i < count; i++) {
            const float weight = large->amount * shares[i];
            const float w = weight < 1.0f ? weight : 1.0f;
            for (int c = 0; c < 4; c++) {
                row[4 * i + c] = row[4 * i + c] * (1.0f - w) + color[c] * w;
            }
        }
    }
}

static void blend_alpha(const vd_splat_tile *tile, const vd_splat_record *records, size_t count,
                        const vd_splat_large *large, const vd_splat_shares *shares) {
    float *pixels = tile->pixels;
    for (const vd_splat_record *r = records, *end = records + count; r < end; r++) {
        __builtin_prefetch(pixels + 4 * (r[VD_RECORDS_AHEAD].head & 0xFFFF));
        __builtin_prefetch(pixels + 4 * ((r[VD_RECORDS_AHEAD].head & 0xFFFF) + VD_TILE_STRIDE));
        if (r->head >= VD_LARGE) {
            blend_large(tile, &large[r->head & ~VD_LARGE]);
            continue;
        }
        float *upper = pixels + 4 * (r->head & 0xFFFF), *lower = upper + 4 * VD_TILE_STRIDE;
        float upper_alpha, lower_alpha;
        memcpy(&upper_alpha, &r->b, sizeof upper_alpha);
        memcpy(&lower_alpha, &r->c, sizeof lower_alpha);
        pair share;
        memcpy(&share, (*shares)[r->head >> 16], sizeof share);
        const pair color = color_pair(r->a);
        const pair a = load_pair(upper), b = load_pair(lower);
        const pair upper_weight = share * upper_alpha, lower_weight = share * lower_alpha;
        store_pair(upper, a * (1.0f - upper_weight) + color * upper_weight);
        store_pair(lower, b * (1.0f - lower_weight) + color * lower_weight);
    }
}

static void add_large(const vd_splat_tile *tile, const vd_splat_large *large) {
    int box[4];
    if (!large_box(tile, large, box)) {
        return;
    }
    float shares[VD_TILE_SIDE + VD_WIDE_LANES];
    for (int y = box[2]; y < box[3]; y++) {
        uint64_t *row = (uint64_t *)tile->pixels + tile_pixel(tile, box[0], y);
        find_shares(large, &tile->picture->shape, box[0], y, box[1] - box[0], shares);
        for (int i = 0; i < box[1] - box[0]; i++) {
            row[i] += 2 * (uint64_t)(int32_t)(large->amount * shares[i] + 0.5f);
        }
    }
}

static void blend_density(const vd_splat_tile *tile, const vd_splat_record *records, size_t count,
                          const vd_splat_large *large, const vd_splat_shares *shares) {
    uint64_t *pixels = tile->pixels;
    (void)shares;
    for (const vd_splat_record *r = records, *end = records + count; r < end; r++) {
        if (r->head >= VD_LARGE) {
            add_large(tile, &large[r->head & ~VD_LARGE]);
            continue;
        }
        uint64_t *upper = pixels + (r->head & 0xFFFF), *lower = upper + VD_TILE_STRIDE;
        const uint64_t left = 256 - (r->head >> 16);
        const uint64_t upper_left = r->a * left >> 8, lower_left = r->b * left >> 8;
        upper[0] += upper_left;
        upper[1] += r->a - upper_left;
        lower[0] += lower_left;
        lower[1] += r->b - lower_left;
    }
}

static inline void put_point(vd_splat_point *point, float depth, uint32_t color, uint32_t id) {
    if (depth > point->depth) {
        point->depth = depth;
        point->color = color;
        point->id = id;
    }
}

static void put_large(const vd_splat_tile *tile, const vd_splat_large *large) {
    int box[4];
    if (!large_box(tile, large, box)) {
        return;
    }
    for (int y = box[2]; y < box[3]; y++) {
        vd_splat_point *row = (vd_splat_point *)tile->pixels + tile_pixel(tile, box[0], y);
        for (int x = box[0]; x < box[1]; x++, row++) {
            if (vd_splat_large_holds(large, &tile->picture->shape, x, y)) {
                put_point(row, large->depth, large->color, large->id);
            }
        }
    }
}

static void blend_nearest(const vd_splat_tile *tile, const vd_splat_record *records, size_t count,
                          const vd_splat_large *large, const vd_splat_shares *shares) {
    vd_splat_point *pixels = tile->pixels;
    (void)shares;
    for (const vd_splat_record *r = records, *end = records + count; r < end; r++) {
        if (r->head >= VD_LARGE) {
            put_large(tile, &large[r->head & ~VD_LARGE]);
            continue;
        }
        float depth;
        memcpy(&depth, &r->b, sizeof depth);
        put_point(&pixels[r->head & 0xFFFF], depth, r->a, r->c);
    }
}

/* ---- resolving --------------------------------------------------------------------------------*/

static void resolve_alpha(const float *pixels, size_t count, uint8_t *rgba) {
    for (size_t i = 0; i < count; i += VD_WIDE_LANES) {
        const vd_wide_f32 v = vd_wide_load_f32(pixels + i);
        const vd_wide_u32 v16 = (vd_wide_u32)vd_wide_to_i32(v * 257.0f + 0.5f);
        vd_wide_store_u8(rgba + i, (v16 * 255u + 32895u) >> 16);
    }
}

static void resolve_density(const vd_splat_picture *picture, const uint64_t *sums, size_t count,
                            uint8_t *rgba) {
    for (size_t i = 0; i < count; i += VD_WIDE_LANES) {
        float density[VD_WIDE_LANES];
        int32_t index[VD_WIDE_LANES];
        for (size_t k = 0; k < VD_WIDE_LANES; k++) {
            density[k] = (float)(int64_t)sums[i + k];
        }
        vd_wide_store_i32(
            index, palette_index(picture, vd_wide_load_f32(density) * picture->density_scale));
        for (size_t k = 0; k < VD_WIDE_LANES; k++) {
            const uint32_t bytes =
                sums[i + k] > 0 ? picture->density_colors[index[k]] : picture->background_bytes;
            memcpy(rgba + 4 * (i + k), &bytes, sizeof bytes);
        }
    }
}

static void resolve(const vd_splat_picture *picture, const void *pixels, int count, uint8_t *rgba,
                    float *depth, uint32_t *id) {
    int done = 0;
    if (depth == NULL && id == NULL) {
        done = count - count % VD_WIDE_LANES;
        if (picture->mode == VD_SPLAT_ALPHA) {
            resolve_alpha(pixels, 4 * (size_t)done, rgba);
        } else if (picture->mode == VD_SPLAT_DENSITY) {
            resolve_density(picture, pixels, (size_t)done, rgba);
        } else {
            done = 0;
        }
    }
    const size_t pixel_bytes = picture->mode == VD_SPLAT_DENSITY ? sizeof(uint64_t) : 16;
    vd_splat_resolve_reference(picture, (const char *)pixels + (size_t)done * pixel_bytes,
                               count - done, rgba + 4 * (size_t)done, depth, id);
}

/* ---- sort keys --------------------------------------------------------------------------------*/

static void keys(const vd_placing *placing, uint32_t *out) {
    const vd_splats *s = placing->splats;
    const float *row = placing->row[2];
    const size_t whole = s->count - s->count % VD_WIDE_LANES;
    for (size_t i = 0; i < whole; i += VD_WIDE_LANES) {
        const lanes l = {true, i, {0}};
        const vd_wide_f32 z =
            (row[0] * read_number(s->x, s->x16, &l) + row[1] * read_number(s->y, s->y16, &l)) +
            row[2] * read_number(s->z, s->z16, &l);
        vd_wide_f32 t = max0((placing->z_back - z) * placing->z_scale);
        t = 1.0f + vd_wide_min_f32(t, vd_wide_splat_f32(1.0f - 0x1p-22f));
        vd_wide_store_u32(out + i, ((vd_wide_u32)t - 0x3F800000u) >> 1);
    }
    for (size_t i = whole; i < s->count; i++) {
        out[i] = vd_splat_key(placing, i);
    }
}

const vd_splat_kernels TABLE = {
    project, {blend_alpha, blend_density, blend_nearest}, resolve, keys};

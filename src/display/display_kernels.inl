/* display_kernels.inl: the kernel's body over wide.h. A file per SIMD level defines TABLE and
 * includes this; the table is the file's only external name. */
#include "display/display_kernels.h"
#include "display/display_vectors.h"

static inline vd_wide_i32 position(vd_wide_f32 way, int32_t whole, int32_t side) {
    /* Lanes that are not drawn may be any number: unsigned, so that these may wrap. */
    const vd_wide_u32 floor = (vd_wide_u32)vd_wide_to_i32(vd_wide_floor_f32(way));
    const vd_wide_i32 at = (vd_wide_i32)(floor + (uint32_t)whole);
    return vd_wide_max_i32(vd_wide_min_i32(at, vd_wide_splat_i32((side - 1) * 256)),
                           vd_wide_splat_i32(0));
}

/* Half a vector of pixels: from pairs of texels above and below and the shares of the lower and the
 * right ones, each four times a pixel. */
static inline vd_channels filter(vd_wide_i32 top, vd_wide_i32 bottom, vd_wide_i32 fx,
                                 vd_wide_i32 fy) {
    const vd_channels y = (vd_channels)fy;
    const vd_channels even =
        vd_channels_mix(vd_channels_low(top), vd_channels_low(bottom), vd_channels_first(y, y));
    const vd_channels odd =
        vd_channels_mix(vd_channels_high(top), vd_channels_high(bottom), vd_channels_second(y, y));
    return vd_channels_mix(vd_channels_first(even, odd), vd_channels_second(even, odd),
                           (vd_channels)fx);
}

/* With opacity 255 the rule's rounding leaves the texel's part as it is. */
static inline vd_channels over(vd_channels texels, vd_channels old, uint16_t opacity, bool full) {
    const vd_channels alpha = vd_channels_alpha(texels);
    const vd_channels color = vd_channels_min(texels, alpha);
    if (full) {
        return color + vd_channels_divide_255(old * (255 - alpha));
    }
    const vd_channels kept = 255 - vd_channels_divide_255(alpha * opacity);
    return vd_channels_divide_255(color * opacity + old * kept);
}

/* The shares of both halves' pixels as vd_channels_mix takes them. */
static inline void share_out(vd_wide_i32 share, vd_wide_i32 out[2]) {
    const vd_wide_u32 scaled = (vd_wide_u32)(share * -128);
    vd_wide_double((vd_wide_i32)((scaled & 0xFFFF) | (scaled << 16)), out);
}

/* The new colours of the vector of pixels at x. `flat`: bend is 0, and dividing by 1 changes
 * nothing. */
static inline __attribute__((always_inline)) vd_wide_i32
pixels(const vd_display_line *line, int x, const uint8_t *old, bool flat, bool full) {
    const vd_wide_f32 n = vd_wide_to_f32(vd_wide_count_i32() + (x - line->base));
    const vd_wide_f32 bent = flat ? n : n / (1.0f + n * line->bend);
    const vd_wide_i32 u = position(bent * line->step_u + line->part_u, line->whole_u, line->width);
    const vd_wide_i32 v = position(bent * line->step_v + line->part_v, line->whole_v, line->height);
    const vd_wide_i32 column = vd_wide_min_i32(u >> 8, vd_wide_splat_i32(line->width - 2));
    const vd_wide_i32 above = vd_wide_min_i32(v >> 8, vd_wide_splat_i32(line->height - 2));
    const vd_wide_i32 at = above * line->stride + column;
    vd_wide_i32 top[2], bottom[2], fx[2], fy[2];
    vd_wide_load_pairs_twice(line->texels, line->texels + 4 * (size_t)line->stride, at, top,
                             bottom);
    share_out(u - (column << 8), fx);
    share_out(v - (above << 8), fy);
    const vd_channels first = filter(top[0], bottom[0], fx[0], fy[0]);
    const vd_channels second = filter(top[1], bottom[1], fx[1], fy[1]);
    const uint16_t opacity = (uint16_t)line->opacity;
    return vd_wide_pack_texels(
        (vd_wide_i16)over(first, vd_channels_load(old), opacity, full),
        (vd_wide_i16)over(second, vd_channels_load(old + 2 * VD_WIDE_LANES), opacity, full));
}

/* Lanes that something nearer hides. */
static inline vd_wide_i32 hidden(const vd_display_line *line, int x) {
    const vd_wide_f32 n = vd_wide_to_f32(vd_wide_count_i32() + (x - line->base));
    return vd_wide_load_f32(line->depth + x) > line->depth_at + n * line->depth_step;
}

static inline __attribute__((always_inline)) void run(uint8_t *row, const vd_display_line *given,
                                                      int begin, int end, bool flat, bool full) {
    const vd_display_line copy = *given; /* the row's bytes may be anything's */
    const vd_display_line *line = &copy;
    for (int x = begin & ~(VD_WIDE_LANES - 1); x < end; x += VD_WIDE_LANES) {
        uint8_t *at = row + 4 * (size_t)x;
        vd_wide_i32 fresh = pixels(line, x, at, flat, full);
        if (x < begin || x + VD_WIDE_LANES > end) {
            const vd_wide_i32 lane = vd_wide_count_i32() + x;
            fresh = (vd_wide_i32)vd_wide_select_u32(
                (lane >= begin) & (lane < end), (vd_wide_u32)fresh,
                vd_wide_load_u32((const uint32_t *)(const void *)at));
        }
        if (line->depth != NULL) {
            fresh = (vd_wide_i32)vd_wide_select_u32(
                hidden(line, x), vd_wide_load_u32((const uint32_t *)(const void *)at),
                (vd_wide_u32)fresh);
        }
        memcpy(at, &fresh, sizeof fresh);
    }
}

static void blend(uint8_t *row, const vd_display_line *line, int begin, int end) {
    if (line->bend == 0.0f) {
        if (line->opacity == 255) {
            run(row, line, begin, end, true, true);
        } else {
            run(row, line, begin, end, true, false);
        }
    } else if (line->opacity == 255) {
        run(row, line, begin, end, false, true);
    } else {
        run(row, line, begin, end, false, false);
    }
}

const vd_display_kernels TABLE = {blend};

/* display_kernels.inl: the kernel's body over wide.h. A file per SIMD level defines TABLE and
 * includes this; the table is the file's only external name. */
#include "display/display_kernels.h"
#include "display/display_vectors.h"

/* How texels come over what is there. */
typedef enum vd_line_over {
    VD_LINE_OVER,   /* with the line's opacity */
    VD_LINE_FULL,   /* which is 255 */
    VD_LINE_OPAQUE, /* as they are */
} vd_line_over;

/* What of a line is known when the kernel is compiled: it stands once for each kind in use. */
typedef struct vd_line_kind {
    vd_line_over over;
    bool flat; /* bend is 0, and dividing by 1 changes nothing */
    bool near; /* no drawn lane's way is NEAR_WAY or more */
} vd_line_kind;

/* Below 2^22 a float plus 1.5·2^23 has its whole part in the lowest bits. WebAssembly's conversion
 * saturates, which takes browsers on x86 many instructions; x86 itself has one, for all ways. */
#if defined(__wasm_simd128__)
#define NEAR_WAY 4194000.0f
#endif

static inline vd_wide_i32 position(vd_wide_f32 way, int32_t whole, int32_t side, bool near) {
    /* Lanes that are not drawn may be any number: unsigned, so that these may wrap. */
    const vd_wide_f32 floor = vd_wide_floor_f32(way);
    vd_wide_i32 at;
#if defined(NEAR_WAY)
    if (near) {
        const vd_wide_u32 bits = (vd_wide_u32)(floor + 0x1.8p23f);
        at = (vd_wide_i32)(bits + ((uint32_t)whole - 0x4B400000u));
    } else
#endif
    {
        (void)near;
        at = (vd_wide_i32)((vd_wide_u32)vd_wide_to_i32(floor) + (uint32_t)whole);
    }
    return vd_wide_max_i32(vd_wide_min_i32(at, vd_wide_splat_i32((side - 1) * 256)),
                           vd_wide_splat_i32(0));
}

/* Half a vector of pixels: from pairs of texels above and below and the shares of the lower and the
 * right ones, each four times a pixel. */
static inline vd_channels filter(vd_wide_i32 top, vd_wide_i32 bottom, vd_channels x,
                                 vd_channels y) {
    const vd_channels even = vd_channels_mix_low(top, bottom, vd_channels_first(y, y));
    const vd_channels odd = vd_channels_mix_high(top, bottom, vd_channels_second(y, y));
    return vd_channels_mix(vd_channels_first(even, odd), vd_channels_second(even, odd), x);
}

/* With opacity 255 the rule's rounding leaves the texel's part as it is. */
static inline vd_channels over(vd_channels texels, const uint8_t *at, uint16_t opacity,
                               vd_line_over rule) {
    if (rule == VD_LINE_OPAQUE) {
        return texels;
    }
    const vd_channels old = vd_channels_load(at);
    const vd_channels alpha = vd_channels_alpha(texels);
    const vd_channels color = vd_channels_min(texels, alpha);
    if (rule == VD_LINE_FULL) {
        return color + vd_channels_divide_255(old * (255 - alpha));
    }
    const vd_channels kept = 255 - vd_channels_divide_255(alpha * opacity);
    return vd_channels_divide_255(color * opacity + old * kept);
}

/* Tried and slower (WebAssembly, 7 % on ground, no gain on trees): to leave out the rest where all
 * texels are clear.
 * The new colours of the vector of pixels that is n on from the base. */
static inline __attribute__((always_inline)) vd_wide_i32
pixels(const vd_display_line *line, vd_wide_f32 n, const uint8_t *old, vd_line_kind kind) {
    const vd_wide_f32 bent = kind.flat ? n : n / (1.0f + n * line->bend);
    const vd_wide_i32 u =
        position(bent * line->step_u + line->part_u, line->whole_u, line->width, kind.near);
    const vd_wide_i32 v =
        position(bent * line->step_v + line->part_v, line->whole_v, line->height, kind.near);
    const vd_wide_i32 column = vd_wide_min_i32(u >> 8, vd_wide_splat_i32(line->width - 2));
    const vd_wide_i32 above = vd_wide_min_i32(v >> 8, vd_wide_splat_i32(line->height - 2));
    const vd_wide_i32 at = above * line->stride + column;
    vd_wide_i32 top[2], bottom[2], fx[2], fy[2];
    vd_wide_load_pairs_twice(line->texels, line->texels + 4 * (size_t)line->stride, at, top,
                             bottom);
    vd_wide_double(vd_channels_shares(u - (column << 8)), fx);
    vd_wide_double(vd_channels_shares(v - (above << 8)), fy);
    const vd_channels first = filter(top[0], bottom[0], (vd_channels)fx[0], (vd_channels)fy[0]);
    const vd_channels second = filter(top[1], bottom[1], (vd_channels)fx[1], (vd_channels)fy[1]);
    const uint16_t opacity = (uint16_t)line->opacity;
    return vd_wide_pack_texels(
        (vd_wide_i16)over(first, old, opacity, kind.over),
        (vd_wide_i16)over(second, old + 2 * VD_WIDE_LANES, opacity, kind.over));
}

/* Lanes that something nearer hides. */
static inline vd_wide_i32 hidden(const vd_display_line *line, int x) {
    const vd_wide_f32 n = vd_wide_to_f32(vd_wide_count_i32() + (x - line->base));
    return vd_wide_load_f32(line->depth + x) > line->depth_at + n * line->depth_step;
}

/* `fresh` where it is drawn, else the bytes that are there. */
static inline __attribute__((always_inline)) vd_wide_i32 only_drawn(const vd_display_line *line,
                                                                    vd_wide_i32 fresh,
                                                                    const uint8_t *old, int x,
                                                                    int begin, int end) {
    const vd_wide_u32 kept = vd_wide_load_u32((const uint32_t *)(const void *)old);
    const vd_wide_i32 lane = vd_wide_count_i32() + x;
    const vd_wide_u32 drawn =
        vd_wide_select_u32((lane >= begin) & (lane < end), (vd_wide_u32)fresh, kept);
    return (vd_wide_i32)(line->depth == NULL ? drawn
                                             : vd_wide_select_u32(hidden(line, x), kept, drawn));
}

static inline __attribute__((always_inline)) void run(uint8_t *row, const vd_display_line *given,
                                                      int begin, int end, vd_line_kind kind) {
    const vd_display_line copy = *given; /* the row's bytes may be anything's */
    const vd_display_line *line = &copy;
    const int last = line->depth == NULL ? end - VD_WIDE_LANES : -1; /* that is drawn whole */
    int x = begin & ~(VD_WIDE_LANES - 1);
    vd_wide_f32 n = vd_wide_to_f32(vd_wide_count_i32() + (x - line->base)); /* exact as it grows */
    for (; x < end; x += VD_WIDE_LANES, n += (float)VD_WIDE_LANES) {
        uint8_t *at = row + 4 * (size_t)x;
        vd_wide_i32 fresh = pixels(line, n, at, kind);
        if (x < begin || x > last) {
            fresh = only_drawn(line, fresh, at, x, begin, end);
        }
        memcpy(at, &fresh, sizeof fresh);
    }
}

/* It grows from the base to the ends. */
static bool is_near(const vd_display_line *line, int begin, int end) {
#if defined(NEAR_WAY)
    const float step_u = line->step_u < 0.0f ? -line->step_u : line->step_u;
    const float step_v = line->step_v < 0.0f ? -line->step_v : line->step_v;
    const float step = step_u < step_v ? step_v : step_u;
    const int left = begin - line->base, right = end - 1 - line->base;
    const float n = (float)(left + right < 0 ? left : right);
    return (n < 0.0f ? -n : n) * step < NEAR_WAY * (1.0f + n * line->bend);
#else
    (void)line;
    (void)begin;
    (void)end;
    return true;
#endif
}

static void blend(uint8_t *row, const vd_display_line *line, int begin, int end) {
    const bool flat = line->bend == 0.0f;
    if (!is_near(line, begin, end)) { /* rare */
        line->opaque ? run(row, line, begin, end, (vd_line_kind){VD_LINE_OPAQUE, false, false})
                     : run(row, line, begin, end, (vd_line_kind){VD_LINE_OVER, false, false});
    } else if (line->opaque) {
        flat ? run(row, line, begin, end, (vd_line_kind){VD_LINE_OPAQUE, true, true})
             : run(row, line, begin, end, (vd_line_kind){VD_LINE_OPAQUE, false, true});
    } else if (line->opacity == 255) {
        flat ? run(row, line, begin, end, (vd_line_kind){VD_LINE_FULL, true, true})
             : run(row, line, begin, end, (vd_line_kind){VD_LINE_FULL, false, true});
    } else {
        flat ? run(row, line, begin, end, (vd_line_kind){VD_LINE_OVER, true, true})
             : run(row, line, begin, end, (vd_line_kind){VD_LINE_OVER, false, true});
    }
}

const vd_display_kernels TABLE = {blend};

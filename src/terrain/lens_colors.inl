/* lens_colors.inl: the colours and depths of 16 rays; a part of lens_march.inl. */

/* ---- colours --------------------------------------------------------------------------------- */

static inline f32 exp2_negative(f32 x) {
    const f32 clamped = vd_wide_max_f32(x, vd_wide_splat_f32(-126.0f));
    const f32 whole = vd_wide_floor_f32(clamped), f = clamped - whole;
    f32 p = vd_wide_splat_f32(0.0135557f);
    p = p * f + 0.0520323f;
    p = p * f + 0.2413793f;
    p = p * f + 0.6930327f;
    p = p * f + 1.0000026f;
    return p * (f32)((vd_wide_to_i32(whole) + 127) << 23);
}

static inline i32 texture_size(const vd_lens_view *view, f32 t) {
    const i32 bits = (i32)(t * view->texture_t);
    const i32 size = (i32)((vd_wide_u32)bits >> 23) - 127 + view->texture_bias;
    return vd_wide_max_i32(vd_wide_min_i32(size, vd_wide_splat_i32(view->texture_last)),
                           vd_wide_splat_i32(0));
}

/* A 16-bit number of every lane, four times in its texel. */
static inline void spread(i32 v, vd_wide_i16 out[2]) {
    i32 twice[2];
    vd_wide_double((v & 0xFFFF) | (v << 16), twice);
    out[0] = (vd_wide_i16)twice[0];
    out[1] = (vd_wide_i16)twice[1];
}

/* The texels (i, j), (i + 1, j) and below them of every lane, out of a window of four by four: so
 * where the texture is magnified, and a block of pixels sees a few texels. False where that is not
 * so; pairs of loads for every lane cost about three times as much. */
static inline bool read_window(const vd_lens_view *view, mask here, i32 size, i32 i, i32 j,
                               i32 upper[2], i32 lower[2]) {
    if (LANES < 8) {
        return false;
    }
    const int only = size[0], width = view->texture_width[only];
    const int height = view->texture_height[only];
    /* One texel of border: −1 … width and −1 … height may be read. */
    int i0 = i[0] < width - 2 ? i[0] - 1 : width - 3,
        j0 = j[0] < height - 2 ? j[0] - 1 : height - 3;
    i0 = i0 < -1 ? -1 : i0, j0 = j0 < -1 ? -1 : j0;
    const i32 x = i - i0, y = j - j0, none = vd_wide_splat_i32(-1), end = vd_wide_splat_i32(3);
    const mask inside = vd_wide_less_i32(none, x) & vd_wide_less_i32(x, end) &
                        vd_wide_less_i32(none, y) & vd_wide_less_i32(y, end) &
                        vd_wide_equal_i32(size, vd_wide_splat_i32(only));
    if (width < 3 || height < 3 || vd_wide_bits(here & vd_wide_not(inside)) != 0) {
        return false;
    }
    const int32_t stride = view->texture_stride[only];
    const uint32_t *from = view->texels + view->texture_offset[only] + (ptrdiff_t)j0 * stride + i0;
    int32_t window[16] __attribute__((aligned(64)));
    for (int row = 0; row < 4; row++) {
        memcpy(window + 4 * row, from + row * stride, 4 * sizeof *window);
    }
    i32 at[2], second = vd_wide_splat_i32(0);
    for (int lane = 1; lane < LANES; lane += 2) {
        second[lane] = 1;
    }
    vd_wide_double((y * 4 + x) & 15, at);
    for (int half = 0; half < 2; half++) {
        const i32 index = at[half] + second;
        upper[half] = vd_wide_lookup_i32(window, index & 15);
        lower[half] = vd_wide_lookup_i32(window, (index + 4) & 15);
    }
    return true;
}

/* The textures at sample positions; lanes that are not `here` read the first texel. */
static inline void read_textures(const vd_lens_view *view, mask here, f32 u, f32 v, f32 t,
                                 vd_wide_i16 out[2]) {
    const i32 size = texture_size(view, t), izero = vd_wide_splat_i32(0);
    const f32 scale = vd_wide_lookup_f32(view->texture_scale, size);
    const f32 x = vd_wide_lookup_f32(view->texture_u, size) +
                  (u * view->texture_uu + v * view->texture_uv) * scale;
    const f32 y = vd_wide_lookup_f32(view->texture_v, size) +
                  (u * view->texture_vu + v * view->texture_vv) * scale;
    const i32 width = vd_wide_lookup_i32(view->texture_width, size);
    const i32 height = vd_wide_lookup_i32(view->texture_height, size);
    const f32 outside = vd_wide_splat_f32(-1.0f);
    const f32 inside_x = vd_wide_max_f32(vd_wide_min_f32(x, to_f32(width)), outside);
    const f32 inside_y = vd_wide_max_f32(vd_wide_min_f32(y, to_f32(height)), outside);
    const f32 left = vd_wide_floor_f32(inside_x), top = vd_wide_floor_f32(inside_y);
    const i32 i = vd_wide_min_i32(vd_wide_to_i32(left), width - 1);
    const i32 j = vd_wide_min_i32(vd_wide_to_i32(top), height - 1);
    i32 wu = izero, wv = izero;
    if (!view->nearest) {
        wu = vd_wide_to_i32((inside_x - left) * 128.0f);
        wv = vd_wide_to_i32((inside_y - top) * 128.0f);
    }
    i32 upper[2], lower[2];
    if (!read_window(view, here, size, i, j, upper, lower)) {
        const i32 stride = vd_wide_lookup_i32(view->texture_stride, size);
        i32 index = vd_wide_lookup_i32(view->texture_offset, size) + j * stride + i;
        index = select_i32(here, index, izero);
        const i32 below = select_i32(here, index + stride, izero);
        vd_wide_load_pairs(view->texels, index, upper);
        vd_wide_load_pairs(view->texels, below, lower);
    }
    vd_wide_i16 across[2], along[2];
    spread((127 - wu) | wu << 8, across);
    spread(wv << 8, along);
    for (int half = 0; half < 2; half++) {
        const vd_wide_i16 a = vd_wide_mix_pairs(upper[half], (i32)across[half]);
        const vd_wide_i16 b = vd_wide_mix_pairs(lower[half], (i32)across[half]);
        out[half] = a + vd_wide_multiply_high(b - a, along[half]);
    }
}

static inline f32 direction_length(const vd_lens_view *view, f32 x, f32 y) {
    const f32 right = affine(&view->right, x, y), down = affine(&view->down, x, y);
    return vd_wide_sqrt_f32(1.0f + (right * right + down * down));
}

static inline i32 shade_hits(const vd_lens_view *view, const rays *r, mask hit, f32 x, f32 y,
                             f32 s) {
    const f32 t = view->t0 + s;
    vd_wide_i16 color[2];
    read_textures(view, hit, r->u + r->ut * s, r->v + r->vt * s, t, color);
    if (view->haze != 0.0f) {
        const f32 left = exp2_negative((t * direction_length(view, x, y)) * view->haze);
        vd_wide_i16 hazy[2], haze;
        spread(32767 - vd_wide_to_i32(left * 32767.0f), hazy);
        for (int lane = 0; lane < LANES * 2; lane += 4) {
            memcpy((int16_t *)&haze + lane, view->haze_color, sizeof view->haze_color);
        }
        for (int half = 0; half < 2; half++) {
            color[half] += vd_wide_multiply_high(haze - color[half], hazy[half]);
        }
    }
    const vd_wide_i16 unit = (vd_wide_i16){0} + (int16_t)258;
    return vd_wide_pack_texels(vd_wide_multiply_high(color[0], unit),
                               vd_wide_multiply_high(color[1], unit));
}

static inline i32 shade_misses(const vd_lens_view *view, f32 x, f32 y) {
    if (view->sky == NULL) {
        return vd_wide_splat_i32((int32_t)view->background);
    }
    const f32 up = affine(&view->w1, x, y) * view->sine;
    const f32 sine = up / direction_length(view, x, y);
    const f32 place = (sine + 1.0f) * (0.5f * VD_LENS_SKY) + 0.5f;
    const f32 last = vd_wide_splat_f32((float)VD_LENS_SKY), zero = vd_wide_splat_f32(0.0f);
    const i32 index = vd_wide_to_i32(vd_wide_max_f32(vd_wide_min_f32(place, last), zero));
    return (i32)vd_wide_gather_f32((const float *)(const void *)view->sky, index);
}

/* Colours, premultiplied, and depths, 0 where there is no terrain, of a packet. */
static inline void shade(const vd_lens_view *view, const rays *r, mask active, mask hit, f32 x,
                         f32 y, f32 s, i32 *color, f32 *depth) {
    const mask miss = active & vd_wide_not(hit);
    *color = vd_wide_bits(hit) != 0 ? shade_hits(view, r, hit, x, y, s) : vd_wide_splat_i32(0);
    if (vd_wide_bits(miss) != 0) {
        *color = select_i32(miss, shade_misses(view, x, y), *color);
    }
    const f32 t = view->t0 + s;
    const f32 d = view->orthographic ? 1.0f + t * view->depth_scale : view->depth_scale / t;
    *depth = vd_wide_blend_f32(hit, vd_wide_max_f32(d, vd_wide_splat_f32(0x1p-126f)),
                               vd_wide_splat_f32(0.0f));
}

/* The first slab that begins before a start ends. */
static inline int slab_of(const vd_lens_view *view, float start) {
    int n = 0;
    while (n < view->slabs && !(start < view->slab[n].end)) {
        n++;
    }
    return n;
}

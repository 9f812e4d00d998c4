/* lens_beams.inl: all rays of a square of pixels behind one beam; a part of lens_march.inl. */
#include "terrain/lens_rays.inl"

/* ---- beams -----------------------------------------------------------------------------------
 * All rays of a square of pixels at once, a square a lane: at s they lie within
 * [u0 + ut0·s, u1 + ut1·s] × [v0 + vt0·s, v1 + vt1·s] and not below w0 + s·(w1 + s·w2). */
typedef struct beams {
    f32 u0, u1, ut0, ut1, v0, v1, vt0, vt1, w0, w1, w2, w2_most;
    f32 s, hi;
} beams;

/* Cells by which rounding may move a ray, and more. */
#define SLACK 0x1p-6f

/* A beam fills at most this share of a block's side, so that two blocks hold it for a while. */
#define FILL 0.75f

/* Metres: a side of a beam that does not move comes out later than any ray is long. */
#define NEVER 1e30f

static inline void bound(const vd_lens_affine *f, f32 x, f32 y, float size, f32 *low, f32 *high) {
    const f32 at = affine(f, x, y);
    const float dx = size * f->k[1], dy = size * f->k[2];
    *low = at + ((dx < 0.0f ? dx : 0.0f) + (dy < 0.0f ? dy : 0.0f));
    *high = at + ((dx < 0.0f ? 0.0f : dx) + (dy < 0.0f ? 0.0f : dy));
}

/* The least and greatest square of a number between low and high. */
static inline void bound_square(f32 low, f32 high, f32 *least, f32 *greatest) {
    const f32 zero = vd_wide_splat_f32(0.0f);
    const f32 near = vd_wide_max_f32(zero, vd_wide_max_f32(low, -high));
    const f32 far = vd_wide_max_f32(-low, high);
    *least = near * near;
    *greatest = far * far;
}

/* When a coordinate that moves from `from` by `speed` a metre is at `edge`, if it gets there by
 * moving on; else `otherwise`. */
static inline f32 reach(f32 edge, f32 from, f32 speed, mask moves, f32 otherwise) {
    return vd_wide_blend_f32(moves, (edge - from) / speed, otherwise);
}

/* The beams of the squares whose upper left corners are (x, y), `size` pixels a side, from where
 * they may come over the map. */
static inline void make_beams(const vd_lens_view *view, f32 x, f32 y, float size, beams *b) {
    const f32 zero = vd_wide_splat_f32(0.0f), far = vd_wide_splat_f32(VD_LENS_FAR);
    const f32 begin = vd_wide_splat_f32(view->begin), top = vd_wide_splat_f32(view->top);
    const f32 west = vd_wide_splat_f32(view->west), east = vd_wide_splat_f32(view->east_end);
    const f32 north = vd_wide_splat_f32(view->north_end), south = vd_wide_splat_f32(view->south);
    f32 unused, e0, e1, n0, n1, e_least, e_most, n_least, n_most;
    bound(&view->u, x, y, size, &b->u0, &b->u1);
    bound(&view->v, x, y, size, &b->v0, &b->v1);
    bound(&view->ut, x, y, size, &b->ut0, &b->ut1);
    bound(&view->vt, x, y, size, &b->vt0, &b->vt1);
    bound(&view->w, x, y, size, &b->w0, &unused);
    bound(&view->w1, x, y, size, &b->w1, &unused);
    bound(&view->east, x, y, size, &e0, &e1);
    bound(&view->north, x, y, size, &n0, &n1);
    bound_square(e0, e1, &e_least, &e_most);
    bound_square(n0, n1, &n_least, &n_most);
    const f32 least = e_least + n_least;
    b->w0 += least * view->curve_t0_t0;
    b->w1 += least * view->curve_t0;
    b->w2 = least * view->curve;
    b->w2_most = (e_most + n_most) * view->curve;
    const mask east_all = vd_wide_less_f32(zero, b->ut0);
    const mask west_all = vd_wide_less_f32(b->ut1, zero);
    const mask south_all = vd_wide_less_f32(zero, b->vt0);
    const mask north_all = vd_wide_less_f32(b->vt1, zero);
    /* In: the foremost ray has come to the near edge. One that stands still is in, or never. */
    f32 s = vd_wide_max_f32(begin, reach(west, b->u1, b->ut1, east_all, begin));
    s = vd_wide_max_f32(s, reach(east, b->u0, b->ut0, west_all, begin));
    s = vd_wide_max_f32(s, reach(north, b->v1, b->vt1, south_all, begin));
    s = vd_wide_max_f32(s, reach(south, b->v0, b->vt0, north_all, begin));
    s = vd_wide_max_f32(s, reach(top, b->w0, b->w1, vd_wide_less_f32(b->w1, zero), begin));
    /* Out: the hindmost has. */
    f32 hi = vd_wide_min_f32(far, reach(east, b->u0, b->ut0, east_all, far));
    hi = vd_wide_min_f32(hi, reach(west, b->u1, b->ut1, west_all, far));
    hi = vd_wide_min_f32(hi, reach(south, b->v0, b->vt0, south_all, far));
    hi = vd_wide_min_f32(hi, reach(north, b->v1, b->vt1, north_all, far));
    hi = vd_wide_min_f32(hi, reach(top, b->w0, b->w1, vd_wide_less_f32(zero, b->w1), far));
    /* A little early and late: no ray may seem to have been in the air where it only comes in. */
    b->s = s - vd_wide_abs_f32(s) * 0x1p-16f;
    b->hi = hi + vd_wide_abs_f32(hi) * 0x1p-16f;
}

/* One axis of a beam within a slab. */
typedef struct span {
    f32 low, high, low_t, high_t; /* low + low_t·s … high + high_t·s, in cells of the ground */
    /* An edge beyond the side, e cells away at s = 0, is reached at e·i + never. */
    f32 low_i, high_i, low_never, high_never;
    mask forward;
} span;

static inline span make_span(f32 low, f32 high, f32 low_t, f32 high_t, float shift, float scale,
                             int32_t cell) {
    const f32 zero = vd_wide_splat_f32(0.0f), never = vd_wide_splat_f32(NEVER);
    span a;
    a.low = (low + shift) * scale + ((float)cell - SLACK);
    a.high = (high + shift) * scale + ((float)cell + SLACK);
    a.low_t = low_t * scale;
    a.high_t = high_t * scale;
    const mask low_moves = vd_wide_less_f32(a.low_t, zero);
    const mask high_moves = vd_wide_less_f32(zero, a.high_t);
    a.low_i = vd_wide_blend_f32(low_moves, -1.0f / a.low_t, zero);
    a.high_i = vd_wide_blend_f32(high_moves, 1.0f / a.high_t, zero);
    a.low_never = vd_wide_blend_f32(low_moves, zero, never);
    a.high_never = vd_wide_blend_f32(high_moves, zero, never);
    a.forward = not_less(a.low_t + a.high_t, zero);
    return a;
}

/* The first of the two blocks that hold a span, and when the span comes out of them. */
static inline i32 cover(const span *a, f32 low, f32 high, f32 side, f32 inverse, f32 *out) {
    const f32 first = vd_wide_blend_f32(a->forward, vd_wide_floor_f32(low * inverse),
                                        vd_wide_floor_f32(high * inverse) - 1.0f);
    const f32 begin = first * side, end = begin + (side + side);
    *out = vd_wide_min_f32((end - a->high) * a->high_i + a->high_never,
                           (a->low - begin) * a->low_i + a->low_never);
    return vd_wide_to_i32(first);
}

static inline i32 clamp_i32(i32 v, i32 last) {
    return vd_wide_max_i32(vd_wide_min_i32(v, last), vd_wide_splat_i32(0));
}

/* Of the blocks that beams are first held against. */
#define AIM_LEVEL 4

/* Moves the beams of `going` through a slab until two by two blocks of about their width are not
 * under them. Lanes that come out of the slab stay in `going`. */
static inline void run_beams(const vd_lens_slab *slab, beams *b, mask *going) {
    const vd_lens_ground *g = slab->ground;
    const f32 end = vd_wide_min_f32(b->hi, vd_wide_splat_f32(slab->end));
    b->s = vd_wide_blend_f32(*going, vd_wide_max_f32(b->s, vd_wide_splat_f32(slab->begin)), b->s);
    const span u =
        make_span(b->u0, b->u1, b->ut0, b->ut1, slab->shift_u, slab->scale, slab->column);
    const span v = make_span(b->v0, b->v1, b->vt0, b->vt1, slab->shift_v, slab->scale, slab->row);
    const i32 top = vd_wide_splat_i32(g->top), one = vd_wide_splat_i32(1);
    i32 level = vd_wide_splat_i32(g->top < AIM_LEVEL ? g->top : AIM_LEVEL);
    mask here = *going & vd_wide_less_f32(b->s, end);
    if (g->top == 0) {
        *going &= vd_wide_not(here);
        return;
    }
    while (vd_wide_bits(here) != 0) {
        const f32 u_low = u.low + u.low_t * b->s, u_high = u.high + u.high_t * b->s;
        const f32 v_low = v.low + v.low_t * b->s, v_high = v.high + v.high_t * b->s;
        const f32 width = vd_wide_max_f32(u_high - u_low, v_high - v_low) * (1.0f / FILL);
        const i32 least = vd_wide_max_i32((i32)((vd_wide_u32)(i32)width >> 23) - 126, one);
        level = vd_wide_min_i32(vd_wide_max_i32(level, least), top);
        const f32 side = vd_wide_exp2_i32(level), inverse = vd_wide_exp2_i32(-level);
        f32 u_out, v_out;
        const i32 column = cover(&u, u_low, u_high, side, inverse, &u_out);
        const i32 row = cover(&v, v_low, v_high, side, inverse, &v_out);
        const i32 last_column = (vd_wide_splat_i32(g->columns - 1) >> level);
        const i32 last_row = (vd_wide_splat_i32(g->rows - 1) >> level);
        const i32 offset = vd_wide_lookup_i32(g->offset, level);
        const i32 pitch = vd_wide_lookup_i32(g->pitch, level);
        const i32 from = offset + clamp_i32(column, last_column - 1);
        i32 upper[2], lower[2], p[4];
        vd_wide_load_pairs(
            g->maxima, select_i32(here, from + clamp_i32(row, last_row) * pitch, offset), upper);
        vd_wide_load_pairs(g->maxima,
                           select_i32(here, from + clamp_i32(row + 1, last_row) * pitch, offset),
                           lower);
        vd_wide_unzip(upper, &p[0], &p[1]);
        vd_wide_unzip(lower, &p[2], &p[3]);
        /* One column only: what follows it is anything, and not a number hides what it meets. */
        const mask single = vd_wide_less_i32(last_column, one);
        p[1] = select_i32(single, p[0], p[1]);
        p[3] = select_i32(single, p[2], p[3]);
        const f32 highest = vd_wide_max_f32(vd_wide_max_f32((f32)p[0], (f32)p[1]),
                                            vd_wide_max_f32((f32)p[2], (f32)p[3]));
        const f32 tb = vd_wide_min_f32(vd_wide_min_f32(u_out, v_out), end);
        const f32 length = tb - b->s;
        const f32 wa = b->w0 + b->s * (b->w1 + b->s * b->w2);
        const f32 wb = b->w0 + tb * (b->w1 + tb * b->w2);
        const f32 lowest = vd_wide_min_f32(wa, wb) - (0.25f * b->w2_most) * (length * length);
        const f32 margin = 2.0f * (slab->margin + slab->margin_s * tb);
        const mask under =
            here & vd_wide_less_f32(highest + margin, lowest) & vd_wide_less_f32(b->s, tb);
        const mask high = here & vd_wide_not(under);
        const mask down = high & vd_wide_less_i32(least, level);
        const mask stop = high & vd_wide_not(down);
        b->s = vd_wide_blend_f32(under, tb, b->s);
        level = vd_wide_add_where_i32(under, level, one);
        level = vd_wide_add_where_i32(down, level, vd_wide_splat_i32(-1));
        *going &= vd_wide_not(stop);
        here &= vd_wide_not(stop | (under & not_less(tb, end)));
    }
}

/* Moves beams on to where they may meet ground: b->s; infinity where they never do. */
static inline void aim_beams(const vd_lens_view *view, mask active, beams *b) {
    mask going = active & vd_wide_less_f32(b->s, b->hi);
    const mask misses = vd_wide_not(going);
    for (int n = 0; n < view->slabs && vd_wide_bits(going) != 0; n++) {
        run_beams(&view->slab[n], b, &going);
    }
    b->s = vd_wide_blend_f32(going | misses, vd_wide_splat_f32(INFINITY), b->s);
}

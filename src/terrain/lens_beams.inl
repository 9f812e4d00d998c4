/* lens_beams.inl: all rays of a block of pixels behind one beam; a part of lens_march.inl. */
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

/* ---- near the ground -------------------------------------------------------------------------
 * The beam of one block, in the cells of a slab's ground. While it is narrower than a cell its rays
 * go through the same few cells: cells are taken two by two, and all rays tested against each, the
 * four heights the same for all lanes. */
typedef struct thread {
    float low, high, low_t, high_t, low_i, high_i, low_never, high_never;
    bool forward;
} thread;

typedef struct tile_beams {
    float u0[64], u1[64], ut0[64], ut1[64], v0[64], v1[64], vt0[64], vt1[64];
    float w0[64], w1[64], w2[64], w2_most[64], s[64], hi[64];
} tile_beams;

static inline thread make_thread(float low, float high, float low_t, float high_t, float shift,
                                 float scale, int32_t cell) {
    thread a;
    a.low = (low + shift) * scale + ((float)cell - SLACK);
    a.high = (high + shift) * scale + ((float)cell + SLACK);
    a.low_t = low_t * scale;
    a.high_t = high_t * scale;
    a.low_i = a.low_t < 0.0f ? -1.0f / a.low_t : 0.0f;
    a.high_i = 0.0f < a.high_t ? 1.0f / a.high_t : 0.0f;
    a.low_never = a.low_t < 0.0f ? 0.0f : NEVER;
    a.high_never = 0.0f < a.high_t ? 0.0f : NEVER;
    a.forward = !(a.low_t + a.high_t < 0.0f);
    return a;
}

/* Tests the lanes of `alive` that come before `until` into the cell (i, j) of the slab, with
 * corners h, against it. */
static inline mask test_cell(const walk *k, mask alive, float i, float j, const float h[4],
                             float until, mask *air, mask *blocked, f32 *s_hit) {
    const f32 zero = vd_wide_splat_f32(0.0f), whole = vd_wide_splat_f32(1.0f);
    const f32 ua = (i - k->u) * k->iu, ub = ((i + 1.0f) - k->u) * k->iu;
    const f32 va = (j - k->v) * k->iv, vb = ((j + 1.0f) - k->v) * k->iv;
    const f32 in_u = vd_wide_min_f32(ua, ub), in_v = vd_wide_min_f32(va, vb);
    const f32 out_u = vd_wide_max_f32(ua, ub), out_v = vd_wide_max_f32(va, vb);
    const f32 ta = vd_wide_max_f32(k->lo, vd_wide_max_f32(in_u, in_v));
    const f32 tb = vd_wide_min_f32(k->hi, vd_wide_min_f32(out_u, out_v));
    const mask here = alive & vd_wide_less_f32(ta, vd_wide_min_f32(tb, vd_wide_splat_f32(until)));
    *blocked = here & vd_wide_not(here);
    if (vd_wide_bits(here) == 0) {
        return *blocked;
    }
    if (!(-INFINITY < h[0] && -INFINITY < h[1] && -INFINITY < h[2] && -INFINITY < h[3])) {
        *air &= vd_wide_not(here);
        return *blocked;
    }
    const float b = h[1] - h[0], c = h[2] - h[0], d = (h[3] - h[1]) - c;
    const f32 fu = vd_wide_max_f32(vd_wide_min_f32((k->u + k->ut * ta) - i, whole), zero);
    const f32 fv = vd_wide_max_f32(vd_wide_min_f32((k->v + k->vt * ta) - j, whole), zero);
    const f32 by_v = c + d * fu;
    const f32 f0 = (k->w + ta * (k->w1 + ta * k->w2)) - ((h[0] + b * fu) + by_v * fv);
    const f32 f1 = (k->w1 + 2.0f * ta * k->w2) - ((b + d * fv) * k->ut + by_v * k->vt);
    const f32 f2 = k->w2 - d * (k->ut * k->vt);
    const f32 discriminant = f1 * f1 - 4.0f * (f2 * f0);
    const f32 root = vd_wide_sqrt_f32(vd_wide_max_f32(discriminant, zero));
    const mask falls = not_less(zero, f1);
    const f32 q = 0.5f * (vd_wide_blend_f32(falls, root, -root) - f1);
    const f32 s = vd_wide_blend_f32(falls, f0, q) / vd_wide_blend_f32(falls, q, f2);
    const mask above = vd_wide_less_f32(zero, f0);
    const mask meets = here & vd_wide_not(above);
    const mask at_once = meets & (*air | vd_wide_equal_f32(f0, zero));
    const mask later = here & above & not_less(discriminant, zero) & vd_wide_less_f32(zero, s) &
                       not_less(tb - ta, s);
    *blocked = meets & vd_wide_not(at_once);
    const mask hit = at_once | later;
    *s_hit = vd_wide_blend_f32(hit, vd_wide_blend_f32(later, ta + s, ta), *s_hit);
    *air |= here & above;
    return hit;
}

/* Two by two blocks of a level, or cells, around a beam at s; its way through them ends at `out`.
 */
typedef struct group {
    int column, row; /* of the first, in blocks */
    float out;
} group;

static inline float come_out(const thread *a, float begin, float side) {
    return vd_lens_min((begin + (side + side) - a->high) * a->high_i + a->high_never,
                       (a->low - begin) * a->low_i + a->low_never);
}

static inline group find_group(const thread *u, const thread *v, float s, float side, float inverse,
                               float end) {
    const float u_at = u->forward ? u->low + u->low_t * s : u->high + u->high_t * s;
    const float v_at = v->forward ? v->low + v->low_t * s : v->high + v->high_t * s;
    const float first_u = floorf(u_at * inverse) - (u->forward ? 0.0f : 1.0f);
    const float first_v = floorf(v_at * inverse) - (v->forward ? 0.0f : 1.0f);
    group found = {(int)first_u, (int)first_v, 0.0f};
    found.out = vd_lens_min(
        vd_lens_min(come_out(u, first_u * side, side), come_out(v, first_v * side, side)), end);
    return found;
}

static inline int clamp_int(int v, int last) {
    return v < 0 ? 0 : v < last ? v : last;
}

static inline float highest_of(float a, float b, float c, float d) {
    return vd_lens_max(vd_lens_max(a, b), vd_lens_max(c, d));
}

/* The highest ground of a group of blocks. */
static inline float highest_block(const vd_lens_ground *g, const group *b, int level) {
    const int last_column = (g->columns - 1) >> level, last_row = (g->rows - 1) >> level;
    const int c0 = clamp_int(b->column, last_column), c1 = clamp_int(b->column + 1, last_column);
    const float *above = g->maxima + g->offset[level] +
                         (size_t)clamp_int(b->row, last_row) * (size_t)g->pitch[level];
    const float *below = g->maxima + g->offset[level] +
                         (size_t)clamp_int(b->row + 1, last_row) * (size_t)g->pitch[level];
    return highest_of(above[c0], above[c1], below[c0], below[c1]);
}

/* The nine corners of a group of cells; those beyond the ground are those at its edge. */
static inline void read_corners(const vd_lens_ground *g, const group *cells, float h[9]) {
    for (int j = 0; j < 3; j++) {
        const float *row = g->heights + (size_t)clamp_int(cells->row + j, g->rows) * g->stride;
        for (int i = 0; i < 3; i++) {
            h[3 * j + i] = row[clamp_int(cells->column + i, g->columns)];
        }
    }
}

/* Tests the rays against the cells of a group, from near to far: no ray comes back to a cell. A
 * cell under all rays on their way through the group is passed over; a cell that a ray enters after
 * that way must wait for the next group, since one before it may not be under the rays there. */
static inline mask test_group(const vd_lens_slab *slab, const walk *k, const group *cells,
                              const float h[9], const float most[4], float lowest, int near,
                              mask alive, mask *air, mask *hits, f32 *s_hit) {
    const vd_lens_ground *g = slab->ground;
    for (int n = 0; n < 4 && vd_wide_bits(alive) != 0; n++) {
        const int cell = n ^ near, i = cells->column + (cell & 1), j = cells->row + (cell >> 1);
        if (i < 0 || j < 0 || i >= g->columns || j >= g->rows ||
            (most[cell] < lowest && vd_wide_bits(alive & vd_wide_not(*air)) == 0)) {
            continue;
        }
        const float *corner = h + 3 * (cell >> 1) + (cell & 1);
        const float corners[4] = {corner[0], corner[1], corner[3], corner[4]};
        mask blocked;
        const mask hit = test_cell(k, alive, (float)(i - slab->column), (float)(j - slab->row),
                                   corners, cells->out, air, &blocked, s_hit);
        *hits |= hit;
        alive &= vd_wide_not(hit | blocked);
    }
    return alive;
}

/* Follows a block's beam and rays from *s on, while the beam is narrower than a cell. Returns lanes
 * that still look; *s is how far they came. */
static inline mask walk_near(const vd_lens_slab *slab, const tile_beams *beam, int at,
                             const walk *k, mask alive, mask *air, float *s_in_out, mask *hits,
                             f32 *s_hit) {
    const vd_lens_ground *g = slab->ground;
    const thread u = make_thread(beam->u0[at], beam->u1[at], beam->ut0[at], beam->ut1[at],
                                 slab->shift_u, slab->scale, slab->column);
    const thread v = make_thread(beam->v0[at], beam->v1[at], beam->vt0[at], beam->vt1[at],
                                 slab->shift_v, slab->scale, slab->row);
    const float w0 = beam->w0[at], w1 = beam->w1[at], w2 = beam->w2[at];
    const float w2_most = beam->w2_most[at];
    const float end = vd_lens_min(beam->hi[at], slab->end);
    const int near = (u.forward ? 0 : 1) + (v.forward ? 0 : 2);
    float s = *s_in_out;
    if ((u.low_t < 0.0f && 0.0f < u.high_t) || (v.low_t < 0.0f && 0.0f < v.high_t)) {
        return alive; /* rays of both directions: there is no order from near to far */
    }
    for (int level = 0; s < end && vd_wide_bits(alive) != 0;) {
        if (FILL < (u.high - u.low) + (u.high_t - u.low_t) * s ||
            FILL < (v.high - v.low) + (v.high_t - v.low_t) * s) {
            break;
        }
        const float side = (float)(1 << level);
        const group blocks = find_group(&u, &v, s, side, 1.0f / side, end);
        const float tb = blocks.out, length = tb - s;
        if (!(s < tb)) {
            break;
        }
        const float wa = w0 + s * (w1 + s * w2), wb = w0 + tb * (w1 + tb * w2);
        const float lowest = vd_lens_min(wa, wb) - (0.25f * w2_most) * (length * length) -
                             2.0f * (slab->margin + slab->margin_s * tb);
        bool under;
        if (level > 0) {
            under = highest_block(g, &blocks, level) < lowest;
            if (!under) {
                level--;
                continue;
            }
        } else {
            float h[9];
            read_corners(g, &blocks, h);
            const float most[4] = {
                highest_of(h[0], h[1], h[3], h[4]), highest_of(h[1], h[2], h[4], h[5]),
                highest_of(h[3], h[4], h[6], h[7]), highest_of(h[4], h[5], h[7], h[8])};
            under = highest_of(most[0], most[1], most[2], most[3]) < lowest;
            if (!under) {
                alive =
                    test_group(slab, k, &blocks, h, most, lowest, near, alive, air, hits, s_hit);
            }
        }
        if (under) {
            *air |= vd_wide_less_f32(k->lo, vd_wide_splat_f32(tb));
            level = level < g->top ? level + 1 : level;
        }
        s = tb;
    }
    *s_in_out = s;
    return alive;
}

/* lens_near.inl: beams of pixels near the ground; a part of lens_march.inl. */
#include "terrain/lens_beams.inl"

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
    float ui0[64], ui1[64], vi0[64], vi1[64]; /* 1 / |ut0| …; 0 where that side does not move out */
    float w0[64], w1[64], w2[64], w2_most[64], s[64], hi[64];
} tile_beams;

static inline thread make_thread(float low, float high, float low_t, float high_t, float low_i,
                                 float high_i, float shift, const vd_lens_slab *slab,
                                 int32_t cell) {
    thread a;
    a.low = (low + shift) * slab->scale + ((float)cell - SLACK);
    a.high = (high + shift) * slab->scale + ((float)cell + SLACK);
    a.low_t = low_t * slab->scale;
    a.high_t = high_t * slab->scale;
    a.low_i = low_i * slab->unscale;
    a.high_i = high_i * slab->unscale;
    a.low_never = 0.0f < low_i ? 0.0f : NEVER;
    a.high_never = 0.0f < high_i ? 0.0f : NEVER;
    a.forward = !(a.low_t + a.high_t < 0.0f);
    return a;
}

/* Tests the lanes of `alive` that come before `until` into the cell (i, j) of the slab, with
 * corners h, the highest of which is `most`, against it. */
static inline mask test_cell(const vd_lens_slab *slab, const walk *k, mask alive, float i, float j,
                             const float h[4], float most, float until, mask *air, mask *blocked,
                             f32 *s_hit) {
    const f32 zero = vd_wide_splat_f32(0.0f), whole = vd_wide_splat_f32(1.0f);
    const f32 ua = (i - k->u) * k->iu, ub = ((i + 1.0f) - k->u) * k->iu;
    const f32 va = (j - k->v) * k->iv, vb = ((j + 1.0f) - k->v) * k->iv;
    const f32 in_u = vd_wide_min_f32(ua, ub), in_v = vd_wide_min_f32(va, vb);
    const f32 out_u = vd_wide_max_f32(ua, ub), out_v = vd_wide_max_f32(va, vb);
    const f32 ta = vd_wide_max_f32(k->lo, vd_wide_max_f32(in_u, in_v));
    const f32 tb = vd_wide_min_f32(k->hi, vd_wide_min_f32(out_u, out_v));
    mask here = alive & vd_wide_less_f32(ta, vd_wide_min_f32(tb, vd_wide_splat_f32(until)));
    *blocked = here & vd_wide_not(here);
    if (vd_wide_bits(here) == 0) {
        return *blocked;
    }
    if (!(-INFINITY < h[0] && -INFINITY < h[1] && -INFINITY < h[2] && -INFINITY < h[3])) {
        *air &= vd_wide_not(here);
        return *blocked;
    }
    /* Rays above all of the cell, as those above a block. */
    const f32 wa = k->w + ta * (k->w1 + ta * k->w2), wb = k->w + tb * (k->w1 + tb * k->w2);
    const f32 length = tb - ta;
    const f32 lowest = vd_wide_min_f32(wa, wb) - (0.25f * k->w2) * (length * length);
    const mask over = here & vd_wide_less_f32((most + slab->margin) + slab->margin_s * tb, lowest);
    *air |= over;
    here &= vd_wide_not(over);
    if (vd_wide_bits(here) == 0) {
        return *blocked;
    }
    const float b = h[1] - h[0], c = h[2] - h[0], d = (h[3] - h[1]) - c;
    const f32 fu = vd_wide_max_f32(vd_wide_min_f32((k->u + k->ut * ta) - i, whole), zero);
    const f32 fv = vd_wide_max_f32(vd_wide_min_f32((k->v + k->vt * ta) - j, whole), zero);
    const f32 by_v = c + d * fu;
    const f32 f0 = wa - ((h[0] + b * fu) + by_v * fv);
    const f32 f1 = (k->w1 + 2.0f * ta * k->w2) - ((b + d * fv) * k->ut + by_v * k->vt);
    const f32 f2 = k->w2 - d * (k->ut * k->vt);
    const f32 discriminant = f1 * f1 - 4.0f * (f2 * f0);
    const mask above = here & vd_wide_less_f32(zero, f0);
    const mask meets = here & vd_wide_not(above);
    const mask at_once = meets & (*air | vd_wide_equal_f32(f0, zero));
    *blocked = meets & vd_wide_not(at_once);
    *air |= above;
    mask later = above & not_less(discriminant, zero);
    *s_hit = vd_wide_blend_f32(at_once, ta, *s_hit);
    if (vd_wide_bits(later) == 0) {
        return at_once;
    }
    const f32 root = vd_wide_sqrt_f32(vd_wide_max_f32(discriminant, zero));
    const mask falls = not_less(zero, f1);
    const f32 q = 0.5f * (vd_wide_blend_f32(falls, root, -root) - f1);
    const f32 s = vd_wide_blend_f32(falls, f0, q) / vd_wide_blend_f32(falls, q, f2);
    later &= vd_wide_less_f32(zero, s) & not_less(length, s);
    *s_hit = vd_wide_blend_f32(later, ta + s, *s_hit);
    return at_once | later;
}

/* 16 or fewer rays of a square, and what became of them. */
typedef struct packet {
    rays r;
    walk k;
    f32 x, y, s_hit;
    mask active, alive, air, hits;
} packet;

static inline bool any_alive(const packet *p, int count) {
    uint32_t bits = 0;
    for (int at = 0; at < count; at++) {
        bits |= vd_wide_bits(p[at].alive);
    }
    return bits != 0;
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

static inline float power_of_two(int exponent) {
    const uint32_t bits = (uint32_t)(exponent + 127) << 23;
    float power;
    memcpy(&power, &bits, sizeof power);
    return power;
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

/* Tests the rays of `count` packets against the cells `touched` of a group, from near to far: no
 * ray comes back to a cell. A cell under all rays on their way through the group is passed over; a
 * cell that a ray enters after that way must wait for the next group, since one before it may not
 * be under the rays there. Returns whether any ray still looks. */
static inline bool test_group(const vd_lens_slab *slab, const group *cells, const float h[9],
                              const float most[4], float lowest, unsigned touched, int near,
                              packet *p, int count, bool *fewer) {
    const vd_lens_ground *g = slab->ground;
    for (int n = 0; n < 4; n++) {
        const int cell = n ^ near, i = cells->column + (cell & 1), j = cells->row + (cell >> 1);
        if ((touched >> cell & 1) == 0 || i < 0 || j < 0 || i >= g->columns || j >= g->rows) {
            continue;
        }
        const float *corner = h + 3 * (cell >> 1) + (cell & 1);
        const float corners[4] = {corner[0], corner[1], corner[3], corner[4]};
        for (int at = 0; at < count; at++) {
            packet *q = p + at;
            if (vd_wide_bits(q->alive) == 0 ||
                (most[cell] < lowest && vd_wide_bits(q->alive & vd_wide_not(q->air)) == 0)) {
                continue;
            }
            mask blocked;
            const mask hit =
                test_cell(slab, &q->k, q->alive, (float)(i - slab->column), (float)(j - slab->row),
                          corners, most[cell], cells->out, &q->air, &blocked, &q->s_hit);
            q->hits |= hit;
            q->alive &= vd_wide_not(hit | blocked);
            *fewer |= vd_wide_bits(hit | blocked) != 0;
        }
    }
    return any_alive(p, count);
}

/* Rays that came in before s have been in the air. */
static inline void note_air(packet *p, int count, float s) {
    for (int at = 0; at < count; at++) {
        p[at].air |= vd_wide_less_f32(p[at].k.lo, vd_wide_splat_f32(s));
    }
}

/* The least of the lanes. */
static inline float least_of(f32 v) {
    float lane[LANES], least = v[0];
    vd_wide_store_f32(lane, v);
    for (int i = 1; i < LANES; i++) {
        least = vd_lens_min(least, lane[i]);
    }
    return least;
}

/* Raises what a beam knows of its rays' heights to the lowest of those that still look. */
static inline void raise_beam(const packet *p, int count, float *w0, float *w1, float *w2) {
    f32 w = vd_wide_splat_f32(INFINITY), slope = w, bend = w;
    const f32 none = w;
    for (int at = 0; at < count; at++) {
        w = vd_wide_min_f32(w, vd_wide_blend_f32(p[at].alive, p[at].r.w, none));
        slope = vd_wide_min_f32(slope, vd_wide_blend_f32(p[at].alive, p[at].r.w1, none));
        bend = vd_wide_min_f32(bend, vd_wide_blend_f32(p[at].alive, p[at].r.w2, none));
    }
    *w0 = least_of(w), *w1 = least_of(slope), *w2 = least_of(bend);
}

/* Which cells of a group a beam touches between `from` and `to`: bit 2·row + column. */
static inline unsigned touched_cells(const thread *u, const thread *v, const group *cells,
                                     float from, float to) {
    const float u_edge = (float)(cells->column + 1), v_edge = (float)(cells->row + 1);
    const bool west = vd_lens_min(u->low + u->low_t * from, u->low + u->low_t * to) < u_edge;
    const bool east = u_edge < vd_lens_max(u->high + u->high_t * from, u->high + u->high_t * to);
    const bool north = vd_lens_min(v->low + v->low_t * from, v->low + v->low_t * to) < v_edge;
    const bool south = v_edge < vd_lens_max(v->high + v->high_t * from, v->high + v->high_t * to);
    const unsigned columns = (unsigned)west | (unsigned)east << 1;
    return (north ? columns : 0) | (south ? columns << 2 : 0);
}

/* Follows a beam and the rays of its packets from *s on within a slab, while the beam is narrower
 * than a cell. *s is how far it came, at the slab's end or where the beam became too wide; *touch
 * is set, if infinite, to where it first came near ground. Returns whether any ray still looks. */
static inline bool walk_near(const vd_lens_slab *slab, const tile_beams *beam, int at, packet *p,
                             int count, float *s_in_out, float *touch) {
    const vd_lens_ground *g = slab->ground;
    const thread u = make_thread(beam->u0[at], beam->u1[at], beam->ut0[at], beam->ut1[at],
                                 beam->ui0[at], beam->ui1[at], slab->shift_u, slab, slab->column);
    const thread v = make_thread(beam->v0[at], beam->v1[at], beam->vt0[at], beam->vt1[at],
                                 beam->vi0[at], beam->vi1[at], slab->shift_v, slab, slab->row);
    float w0 = beam->w0[at], w1 = beam->w1[at], w2 = beam->w2[at];
    const float w2_most = beam->w2_most[at];
    const float end = vd_lens_min(beam->hi[at], slab->end);
    const int near = (u.forward ? 0 : 1) + (v.forward ? 0 : 2);
    float s = *s_in_out, passed = -INFINITY;
    if ((u.low_t < 0.0f && 0.0f < u.high_t) || (v.low_t < 0.0f && 0.0f < v.high_t)) {
        return true; /* rays of both directions: there is no order from near to far */
    }
    bool looking = true;
    for (int level = 0; s < end && looking;) {
        if (FILL < (u.high - u.low) + (u.high_t - u.low_t) * s ||
            FILL < (v.high - v.low) + (v.high_t - v.low_t) * s) {
            break;
        }
        const group blocks = find_group(&u, &v, s, power_of_two(level), power_of_two(-level), end);
        const float tb = blocks.out, length = tb - s;
        if (!(s < tb)) {
            break;
        }
        const float wa = w0 + s * (w1 + s * w2), wb = w0 + tb * (w1 + tb * w2);
        const float lost =
            (0.25f * w2_most) * (length * length) + 2.0f * (slab->margin + slab->margin_s * tb);
        const float lowest = vd_lens_min(wa, wb) - lost;
        if (level > 0) {
            if (!(highest_block(g, &blocks, level) < lowest)) {
                level--;
                continue;
            }
        } else {
            float h[9];
            read_corners(g, &blocks, h);
            const float most[4] = {
                highest_of(h[0], h[1], h[3], h[4]), highest_of(h[1], h[2], h[4], h[5]),
                highest_of(h[3], h[4], h[6], h[7]), highest_of(h[4], h[5], h[7], h[8])};
            const float highest = highest_of(most[0], most[1], most[2], most[3]);
            if (!(highest < lowest)) {
                /* The beam is above all four cells up to where the chord under it meets the highest
                 * of them; a little before that, as the division rounds. */
                const float above = (wa - lost) - highest;
                if (0.0f < above) {
                    s += length * (above / (wa - wb)) * (1.0f - 0x1p-12f);
                    passed = s;
                }
                *touch = vd_lens_min(*touch, s);
                note_air(p, count, passed);
                bool fewer = false;
                looking = test_group(slab, &blocks, h, most, lowest,
                                     touched_cells(&u, &v, &blocks, s, tb), near, p, count, &fewer);
                if (looking && fewer) {
                    raise_beam(p, count, &w0, &w1, &w2);
                }
                s = tb;
                continue;
            }
        }
        passed = tb;
        level = level < g->top ? level + 1 : level;
        s = tb;
    }
    note_air(p, count, passed);
    *s_in_out = s;
    return looking;
}

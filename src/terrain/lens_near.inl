/* lens_near.inl: beams of pixels near the ground; a part of lens_march.inl. */
#include "terrain/lens_beams.inl"

/* For the proof in test_lens_proof.c: no ray of `count` packets that still looks meets anything
 * between from and to. */
#ifndef VD_LENS_PASSED
#define VD_LENS_PASSED(packets, count, from, to)
#endif

/* ---- near the ground -------------------------------------------------------------------------
 * The beam of a square or a block, in the cells of a slab's ground. While it is narrower than two
 * cells its rays go through the same few cells: cells are taken three by three, and all rays tested
 * against those that the beam touches below their highest ground, the four heights the same for all
 * lanes. */
#define GROUP 3

/* A beam is at most this many cells wide in a group. */
#define WIDEST 1.75f

/* One axis of a beam, in cells from the ground's first; mirrored where the beam goes backwards, so
 * that both sides, low + low_t·s <= high + high_t·s, stand still or grow. A side comes to an edge e
 * ahead of it at (e − side)·i + never. */
typedef struct thread {
    float low, high, low_t, high_t, low_i, high_i, low_never, high_never;
    bool mirrored;
} thread;

typedef struct tile_beams {
    float u0[64], u1[64], ut0[64], ut1[64], v0[64], v1[64], vt0[64], vt1[64];
    float ui0[64], ui1[64], vi0[64], vi1[64]; /* 1 / |ut0| …; 0 of a side that stands still */
    float w0[64], w1[64], w2[64], w2_most[64], s[64], hi[64];
} tile_beams;

/* False if rays go both ways along the axis: there is no order from near to far. */
static inline bool make_thread(float low, float high, float low_t, float high_t, float low_i,
                               float high_i, float shift, const vd_lens_slab *slab, int32_t cell,
                               thread *a) {
    const float first = (low + shift) * slab->scale + ((float)cell - SLACK);
    const float last = (high + shift) * slab->scale + ((float)cell + SLACK);
    a->mirrored = low_t < 0.0f;
    a->low = a->mirrored ? -last : first;
    a->high = a->mirrored ? -first : last;
    a->low_t = (a->mirrored ? -high_t : low_t) * slab->scale;
    a->high_t = (a->mirrored ? -low_t : high_t) * slab->scale;
    a->low_i = (a->mirrored ? high_i : low_i) * slab->unscale;
    a->high_i = (a->mirrored ? low_i : high_i) * slab->unscale;
    a->low_never = 0.0f < a->low_i ? 0.0f : NEVER;
    a->high_never = 0.0f < a->high_i ? 0.0f : NEVER;
    return !(low_t < 0.0f && 0.0f < high_t);
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

/* When the foremost rays of a beam come to an edge, and when the hindmost have left it behind. */
static inline float comes_to(const thread *a, float edge) {
    return edge <= a->high ? -INFINITY : (edge - a->high) * a->high_i + a->high_never;
}

static inline float leaves(const thread *a, float edge) {
    return edge <= a->low ? -INFINITY : (edge - a->low) * a->low_i + a->low_never;
}

static inline float power_of_two(int exponent) {
    const uint32_t bits = (uint32_t)(exponent + 127) << 23;
    float power;
    memcpy(&power, &bits, sizeof power);
    return power;
}

static inline int clamp_int(int v, int last) {
    return v < 0 ? 0 : v < last ? v : last;
}

static inline float highest_of(float a, float b, float c, float d) {
    return vd_lens_max(vd_lens_max(a, b), vd_lens_max(c, d));
}

/* The highest ground of two by two blocks of a level from (column, row) on, counted along the beam.
 */
static inline float highest_block(const vd_lens_ground *g, const thread *u, const thread *v,
                                  int column, int row, int level) {
    const int last_column = (g->columns - 1) >> level, last_row = (g->rows - 1) >> level;
    const int first = u->mirrored ? -2 - column : column, top = v->mirrored ? -2 - row : row;
    const int c0 = clamp_int(first, last_column), c1 = clamp_int(first + 1, last_column);
    const float *above =
        g->maxima + g->offset[level] + (size_t)clamp_int(top, last_row) * (size_t)g->pitch[level];
    const float *below = g->maxima + g->offset[level] +
                         (size_t)clamp_int(top + 1, last_row) * (size_t)g->pitch[level];
    return highest_of(above[c0], above[c1], below[c0], below[c1]);
}

/* The part [from, to] of a beam's way that lies in each column, or row, of a group. */
typedef struct passage {
    float from[GROUP], to[GROUP];
} passage;

static inline passage find_passage(const thread *a, float first) {
    passage way;
    for (int i = 0; i < GROUP; i++) {
        way.from[i] = comes_to(a, first + (float)i);
        way.to[i] = leaves(a, first + (float)(i + 1));
    }
    return way;
}

/* What a beam knows of its rays: not below w0 + s·(w1 + s·w2), and how that is curved. */
typedef struct lift {
    float w0, w1, w2, w2_most;
} lift;

/* A height that the rays are above from s to tb, by twice what rounding may do. */
static inline float lowest_between(const vd_lens_slab *slab, const lift *l, float s, float tb) {
    const float wa = l->w0 + s * (l->w1 + s * l->w2), wb = l->w0 + tb * (l->w1 + tb * l->w2);
    const float length = tb - s;
    return vd_lens_min(wa, wb) - (0.25f * l->w2_most) * (length * length) -
           2.0f * (slab->margin + slab->margin_s * tb);
}

/* Three by three cells of a beam's way from s to `out`, the first counted along the beam. */
typedef struct group {
    int column, row;
    float s, out;
    passage across, along;
} group;

/* Whether any ray still looks, and whether one of them has not been seen in the air. */
static inline bool any_airless(const packet *p, int count) {
    uint32_t bits = 0;
    for (int at = 0; at < count; at++) {
        bits |= vd_wide_bits(p[at].alive & vd_wide_not(p[at].air));
    }
    return bits != 0;
}

/* Tests the rays against a cell; returns whether that ended any. */
static inline bool test_packets(const vd_lens_slab *slab, int i, int j, const float h[4],
                                float most, float until, packet *p, int count) {
    bool fewer = false;
    for (int k = 0; k < count; k++) {
        packet *q = p + k;
        if (vd_wide_bits(q->alive) != 0) {
            mask blocked;
            const mask hit =
                test_cell(slab, &q->k, q->alive, (float)(i - slab->column), (float)(j - slab->row),
                          h, most, until, &q->air, &blocked, &q->s_hit);
            q->hits |= hit;
            q->alive &= vd_wide_not(hit | blocked);
            fewer |= vd_wide_bits(hit | blocked) != 0;
        }
    }
    return fewer;
}

/* Tests a beam's rays against a group's cells, from near to far: rays only go on, so that they meet
 * cells row by row. A cell under all rays on their way through it is passed over; a cell that a ray
 * enters after `out` must wait for the next group, since one before it may not be under the rays
 * there. Returns whether any cell was tested; *fewer whether that ended any ray. */
static inline bool test_group(const vd_lens_slab *slab, const thread *u, const thread *v,
                              const lift *l, const group *cells, packet *p, int count, float *touch,
                              bool *fewer) {
    const vd_lens_ground *g = slab->ground;
    bool tested = false, airless = any_airless(p, count);
    for (int n = 0; n < GROUP * GROUP; n++) {
        const int across = n % GROUP, along = n / GROUP;
        const float from = vd_lens_max(
            cells->s, vd_lens_max(cells->across.from[across], cells->along.from[along]));
        const float to =
            vd_lens_min(cells->out, vd_lens_min(cells->across.to[across], cells->along.to[along]));
        const int i = u->mirrored ? -1 - (cells->column + across) : cells->column + across;
        const int j = v->mirrored ? -1 - (cells->row + along) : cells->row + along;
        if (!(from < to) || i < 0 || j < 0 || i >= g->columns || j >= g->rows) {
            continue;
        }
        const float *above = g->heights + (size_t)j * g->stride + i, *below = above + g->stride;
        const float h[4] = {above[0], above[1], below[0], below[1]};
        const float most = highest_of(h[0], h[1], h[2], h[3]);
        if (most < lowest_between(slab, l, from, to) && !airless) {
            continue;
        }
        *touch = vd_lens_min(*touch, from);
        tested = true;
        *fewer |= test_packets(slab, i, j, h, most, cells->out, p, count);
        airless = airless && any_airless(p, count);
    }
    return tested;
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
static inline void raise_beam(const packet *p, int count, lift *l) {
    f32 w = vd_wide_splat_f32(INFINITY), slope = w, bend = w;
    const f32 none = w;
    for (int at = 0; at < count; at++) {
        w = vd_wide_min_f32(w, vd_wide_blend_f32(p[at].alive, p[at].r.w, none));
        slope = vd_wide_min_f32(slope, vd_wide_blend_f32(p[at].alive, p[at].r.w1, none));
        bend = vd_wide_min_f32(bend, vd_wide_blend_f32(p[at].alive, p[at].r.w2, none));
    }
    l->w0 = least_of(w), l->w1 = least_of(slope), l->w2 = least_of(bend);
}

/* Follows a beam and the rays of its packets from *s on within a slab, while the beam is narrow. *s
 * is how far it came, at the slab's end or where the beam became too wide; *touch is set, if
 * infinite, to where it first came near ground. Returns whether any ray still looks. */
static inline bool walk_near(const vd_lens_slab *slab, const tile_beams *beam, int at, packet *p,
                             int count, float *s_in_out, float *touch) {
    const vd_lens_ground *g = slab->ground;
    thread u, v;
    if (!make_thread(beam->u0[at], beam->u1[at], beam->ut0[at], beam->ut1[at], beam->ui0[at],
                     beam->ui1[at], slab->shift_u, slab, slab->column, &u) ||
        !make_thread(beam->v0[at], beam->v1[at], beam->vt0[at], beam->vt1[at], beam->vi0[at],
                     beam->vi1[at], slab->shift_v, slab, slab->row, &v)) {
        return true;
    }
    lift l = {beam->w0[at], beam->w1[at], beam->w2[at], beam->w2_most[at]};
    const float end = vd_lens_min(beam->hi[at], slab->end);
    float s = *s_in_out, passed = -INFINITY;
    bool looking = true;
    for (int level = 0; s < end && looking;) {
        if (WIDEST < (u.high - u.low) + (u.high_t - u.low_t) * s ||
            WIDEST < (v.high - v.low) + (v.high_t - v.low_t) * s) {
            break;
        }
        const float side = power_of_two(level), inverse = power_of_two(-level);
        const float column = floorf((u.low + u.low_t * s) * inverse);
        const float row = floorf((v.low + v.low_t * s) * inverse);
        if (level > 0) {
            const float out = vd_lens_min(end, vd_lens_min(comes_to(&u, (column + 2.0f) * side),
                                                           comes_to(&v, (row + 2.0f) * side)));
            if (!(s < out)) {
                break;
            }
            if (!(highest_block(g, &u, &v, (int)column, (int)row, level) <
                  lowest_between(slab, &l, s, out))) {
                level--;
                continue;
            }
            VD_LENS_PASSED(p, count, s, out);
            passed = s = out;
        } else {
            group cells = {(int)column,          (int)row, s, 0.0f, find_passage(&u, column),
                           find_passage(&v, row)};
            cells.out = vd_lens_min(end, vd_lens_min(comes_to(&u, column + (float)GROUP),
                                                     comes_to(&v, row + (float)GROUP)));
            if (!(s < cells.out)) {
                break;
            }
            bool fewer = false;
            note_air(p, count, passed);
            if (test_group(slab, &u, &v, &l, &cells, p, count, touch, &fewer)) {
                if (fewer) {
                    looking = any_alive(p, count);
                    if (looking) {
                        raise_beam(p, count, &l);
                    }
                }
                s = cells.out;
                continue;
            }
            VD_LENS_PASSED(p, count, s, cells.out);
            passed = s = cells.out;
        }
        level = level < g->top ? level + 1 : level;
    }
    note_air(p, count, passed);
    *s_in_out = s;
    return looking;
}

/* lens_march.inl: the plain ray caster's fast twin over wide.h: the same bytes. A file per SIMD
 * level defines TABLE and includes this; the table is the file's only external name.
 *
 * Pixels are drawn in blocks of 4 × 4. All rays of a block lie in a beam, an interval of u, of v
 * and a lower bound of w at every s. While the beam is narrower than a cell:
 *
 *      w ▲   beam                        two by two blocks of a level around the beam whose highest
 *        │ ═══╗                          ground is under it to where it comes out of them: passed,
 *        │    ╚═══╗  ┌────┐              then a level up; not under: a level down; at cells: every
 *        │        ╚══│═╗  │ not under    ray of the block is tested against each cell, whose four
 *        │  passed   │ ╚═ │              heights are the same for all lanes.
 *        └───────────┴────┴──► s
 *
 * What is left (wide beams, rays of both directions along an axis, silhouettes, edges' samples)
 * goes a ray a lane, through blocks (step_block) and cells (step_cell).
 *
 * Why it stays exact. A cell that matters is met by the reference's own formula with the
 * reference's own crossings, which come from the line's equation: the same bits however one came
 * there. A ray is in cell (i, j) for some s exactly if max(in, lo) < min(out, hi), so a cell can be
 * tested without walking to it; groups come from near to far, and within a rectangle a ray's cells
 * follow each other, so the first hit found is the first. A block is passed when the rays are above
 * its maximum by `margin + margin_s·s`: with u = 2^−24, positions are wrong by at most 4u·(|u| +
 * |ut|·s) cells, so the ground under a ray by that times the range of heights, and w by 4u·(|w| +
 * |w1|·s); both are below 2^−20 of what margins are made of (lens_view.c). Then the reference's f
 * is above 0 in all cells passed, and whether it remembers air or a hole from them does not matter:
 * the next cell shares an edge with them, under the ray as well or part of a hole. What beams and
 * blocks pass is proved by test_lens_march.c, which compares every byte.
 *
 * Tried (Zen 4, 1920 × 1080, one thread, valley / summit / straight down): a ray a lane from its
 * entry on 124 / 127 / 105 ms; a beam a block with cells for all rays at once 78 / 100 / 80 ms. A
 * step of 16 rays through a block or a cell takes about 190 cycles, most of them for loads of 16
 * addresses and for masks.
 */
#include <string.h>
#include "core/wide.h"
#include "terrain/lens_cast.h"

#define LANES VD_WIDE_LANES
#define BLOCK 4                         /* pixels a side of a block */
#define PACKETS (BLOCK * BLOCK / LANES) /* of a block */
#define START_LEVEL 1

typedef vd_wide_f32 f32;
typedef vd_wide_i32 i32;
typedef vd_wide_mask mask;

/* ---- rays ------------------------------------------------------------------------------------ */

typedef struct rays {
    f32 u, v, w, ut, vt, w1, w2, iu, iv, lo, hi;
} rays;

static inline f32 affine(const vd_lens_affine *f, f32 x, f32 y) {
    return (f->k[0] + x * f->k[1]) + y * f->k[2];
}

static inline mask not_less(f32 a, f32 b) {
    return vd_wide_not(vd_wide_less_f32(a, b));
}

static inline f32 moving(f32 speed) {
    const f32 still = vd_wide_splat_f32(VD_LENS_STILL);
    return vd_wide_blend_f32(vd_wide_less_f32(vd_wide_abs_f32(speed), still), still, speed);
}

static inline void make_rays(const vd_lens_view *view, f32 x, f32 y, rays *r) {
    r->u = affine(&view->u, x, y);
    r->v = affine(&view->v, x, y);
    r->ut = moving(affine(&view->ut, x, y));
    r->vt = moving(affine(&view->vt, x, y));
    const f32 east = affine(&view->east, x, y), north = affine(&view->north, x, y);
    const f32 level = east * east + north * north;
    r->w = affine(&view->w, x, y) + level * view->curve_t0_t0;
    r->w1 = moving(affine(&view->w1, x, y) + level * view->curve_t0);
    r->w2 = level * view->curve;
    r->iu = 1.0f / r->ut;
    r->iv = 1.0f / r->vt;
    const f32 ua = (view->west - r->u) * r->iu, ub = (view->east_end - r->u) * r->iu;
    const f32 va = (view->north_end - r->v) * r->iv, vb = (view->south - r->v) * r->iv;
    const f32 under_top = (view->top - r->w) / r->w1;
    const mask falls = vd_wide_less_f32(r->w1, vd_wide_splat_f32(0.0f));
    const f32 begin = vd_wide_splat_f32(view->begin), far = vd_wide_splat_f32(VD_LENS_FAR);
    f32 lo =
        vd_wide_max_f32(begin, vd_wide_max_f32(vd_wide_min_f32(ua, ub), vd_wide_min_f32(va, vb)));
    f32 hi = vd_wide_min_f32(vd_wide_max_f32(ua, ub), vd_wide_max_f32(va, vb));
    r->lo = vd_wide_max_f32(lo, vd_wide_blend_f32(falls, under_top, begin));
    hi = vd_wide_min_f32(hi, vd_wide_blend_f32(falls, far, under_top));
    r->hi = vd_wide_min_f32(hi, far);
}

/* ---- the walk -------------------------------------------------------------------------------- */

/* A packet within a slab. Lanes that are not `alive` hold anything. */
typedef struct walk {
    f32 u, v, ut, vt, iu, iv, w, w1, w2;
    f32 lo, hi, s;
    i32 i, j;   /* cell of the slab */
    i32 level;  /* of the block that is looked at next; 0: the cell */
    i32 eu, ev; /* 1 where the coordinate grows, else 0 */
    i32 du, dv; /* 1 or −1 */
    mask alive, air;
} walk;

static inline f32 to_f32(i32 v) {
    return __builtin_convertvector(v, f32);
}

static inline f32 crossing(f32 edge, f32 origin, f32 inverse) {
    return (edge - origin) * inverse;
}

/* The cell along one axis at s. */
static inline i32 cell_at(f32 s, f32 origin, f32 speed, f32 inverse, f32 step, f32 ahead) {
    f32 cell = vd_wide_floor_f32(origin + speed * s);
    const mask before = not_less(s, crossing(cell + ahead, origin, inverse));
    cell = vd_wide_blend_f32(before, cell + step, cell);
    const mask beyond = vd_wide_less_f32(s, crossing(cell + (1.0f - ahead), origin, inverse));
    return vd_wide_to_i32(vd_wide_blend_f32(beyond, cell - step, cell));
}

static inline i32 select_i32(mask m, i32 yes, i32 no) {
    return vd_wide_blend_i32(m, yes, no);
}

/* Lanes whose cell is one of the ground's. */
static inline mask is_inside(const vd_lens_slab *slab, i32 i, i32 j) {
    const vd_wide_u32 columns = (vd_wide_u32){0} + (uint32_t)slab->ground->columns;
    const vd_wide_u32 rows = (vd_wide_u32){0} + (uint32_t)slab->ground->rows;
    /* Unsigned, by flipping the highest bit: negative numbers are too great as well. */
    const i32 flip = vd_wide_splat_i32(INT32_MIN);
    return vd_wide_less_i32((i + slab->column) ^ flip, (i32)columns ^ flip) &
           vd_wide_less_i32((j + slab->row) ^ flip, (i32)rows ^ flip);
}

/* One step of the lanes of `here` through blocks. */
static inline void step_block(const vd_lens_slab *slab, walk *k, mask here) {
    const vd_lens_ground *g = slab->ground;
    const i32 zero = vd_wide_splat_i32(0);
    const i32 level = k->level;
    const i32 column = (k->i + slab->column) >> level, row = (k->j + slab->row) >> level;
    i32 index =
        vd_wide_lookup_i32(g->offset, level) + row * vd_wide_lookup_i32(g->pitch, level) + column;
    index = select_i32(here, index, zero);
    const f32 highest = vd_wide_gather_f32(g->maxima, index);
    const f32 edge_u = to_f32(((column + k->eu) << level) - slab->column);
    const f32 edge_v = to_f32(((row + k->ev) << level) - slab->row);
    const f32 tu = crossing(edge_u, k->u, k->iu), tv = crossing(edge_v, k->v, k->iv);
    const f32 tb = vd_wide_min_f32(vd_wide_min_f32(tu, tv), k->hi);
    const f32 wa = k->w + k->s * (k->w1 + k->s * k->w2), wb = k->w + tb * (k->w1 + tb * k->w2);
    const f32 length = tb - k->s;
    const f32 lowest = vd_wide_min_f32(wa, wb) - (0.25f * k->w2) * (length * length);
    const f32 margin = slab->margin + slab->margin_s * tb;
    const mask under = here & vd_wide_less_f32(highest + margin, lowest);
    const mask down = here & vd_wide_not(under);
    const i32 i = cell_at(tb, k->u, k->ut, k->iu, to_f32(k->du), to_f32(k->eu));
    const i32 j = cell_at(tb, k->v, k->vt, k->iv, to_f32(k->dv), to_f32(k->ev));
    /* Up where the parent ends with the block. */
    const i32 moved =
        (((i + slab->column) ^ (k->i + slab->column)) | ((j + slab->row) ^ (k->j + slab->row))) >>
        (level + 1);
    const mask up = under & vd_wide_not(vd_wide_equal_i32(moved, zero)) &
                    vd_wide_less_i32(level, vd_wide_splat_i32(g->top));
    k->level = vd_wide_add_where_i32(up, level, vd_wide_splat_i32(1));
    k->level = vd_wide_add_where_i32(down, k->level, vd_wide_splat_i32(-1));
    k->i = select_i32(under, i, k->i);
    k->j = select_i32(under, j, k->j);
    k->s = vd_wide_blend_f32(under, tb, k->s);
    k->air |= under;
    const mask ended = under & (not_less(tb, k->hi) | vd_wide_not(is_inside(slab, i, j)));
    k->alive &= vd_wide_not(ended);
}

/* One step of the lanes of `here`, whose level is 0, through their cells. Returns lanes that hit,
 * at *s_hit; lanes that are blocked are in *blocked. */
static inline mask step_cell(const vd_lens_slab *slab, walk *k, mask here, f32 *s_hit,
                             mask *blocked) {
    const vd_lens_ground *g = slab->ground;
    const i32 izero = vd_wide_splat_i32(0), one = vd_wide_splat_i32(1);
    const f32 zero = vd_wide_splat_f32(0.0f), whole = vd_wide_splat_f32(1.0f);
    i32 index = (k->j + slab->row) * (int32_t)g->stride + (k->i + slab->column);
    index = select_i32(here, index, izero);
    i32 pairs[2], first, second;
    vd_wide_load_pairs(g->heights, index, pairs);
    vd_wide_unzip(pairs, &first, &second);
    const f32 h00 = (f32)first, h10 = (f32)second;
    vd_wide_load_pairs(g->heights + g->stride, index, pairs);
    vd_wide_unzip(pairs, &first, &second);
    const f32 h01 = (f32)first, h11 = (f32)second;
    const f32 tu = crossing(to_f32(k->i + k->eu), k->u, k->iu);
    const f32 tv = crossing(to_f32(k->j + k->ev), k->v, k->iv);
    const f32 tb = vd_wide_min_f32(vd_wide_min_f32(tu, tv), k->hi);
    const f32 lowest = vd_wide_min_f32(vd_wide_min_f32(h00, h10), vd_wide_min_f32(h01, h11));
    const mask hole = not_less(vd_wide_splat_f32(-INFINITY), lowest);

    const f32 fi = to_f32(k->i), fj = to_f32(k->j);
    const f32 in_u = crossing(to_f32(k->i + (one - k->eu)), k->u, k->iu);
    const f32 in_v = crossing(to_f32(k->j + (one - k->ev)), k->v, k->iv);
    const f32 ta = vd_wide_max_f32(k->lo, vd_wide_max_f32(in_u, in_v));
    const f32 fu = vd_wide_max_f32(vd_wide_min_f32((k->u + k->ut * ta) - fi, whole), zero);
    const f32 fv = vd_wide_max_f32(vd_wide_min_f32((k->v + k->vt * ta) - fj, whole), zero);
    const f32 b = h10 - h00, c = h01 - h00, d = (h11 - h10) - c;
    const f32 by_v = c + d * fu;
    const f32 f0 = (k->w + ta * (k->w1 + ta * k->w2)) - ((h00 + b * fu) + by_v * fv);
    const f32 f1 = (k->w1 + 2.0f * ta * k->w2) - ((b + d * fv) * k->ut + by_v * k->vt);
    const f32 f2 = k->w2 - d * (k->ut * k->vt);
    const f32 discriminant = f1 * f1 - 4.0f * (f2 * f0);
    const f32 root = vd_wide_sqrt_f32(vd_wide_max_f32(discriminant, zero));
    const mask falls = not_less(zero, f1);
    const f32 q = 0.5f * (vd_wide_blend_f32(falls, root, -root) - f1);
    const f32 s = vd_wide_blend_f32(falls, f0, q) / vd_wide_blend_f32(falls, q, f2);
    const mask inside = here & vd_wide_not(hole);
    const mask above = vd_wide_less_f32(zero, f0);
    const mask meets = inside & vd_wide_not(above);
    const mask at_once = meets & (k->air | vd_wide_equal_f32(f0, zero));
    const mask later = inside & above & not_less(discriminant, zero) & vd_wide_less_f32(zero, s) &
                       not_less(tb - ta, s);
    *blocked = meets & vd_wide_not(at_once);
    *s_hit = vd_wide_blend_f32(later, ta + s, ta);
    const mask hit = at_once | later;

    /* On to the next cell. */
    k->air = (k->air & vd_wide_not(here)) | (inside & above);
    const i32 i = vd_wide_add_where_i32(not_less(tb, tu), k->i, k->du);
    const i32 j = vd_wide_add_where_i32(not_less(tb, tv), k->j, k->dv);
    const i32 moved =
        (((i + slab->column) ^ (k->i + slab->column)) | ((j + slab->row) ^ (k->j + slab->row))) >>
        1;
    const mask up = here & vd_wide_not(vd_wide_equal_i32(moved, izero)) &
                    vd_wide_less_i32(izero, vd_wide_splat_i32(g->top));
    k->level = vd_wide_add_where_i32(up, k->level, one);
    k->i = select_i32(here, i, k->i);
    k->j = select_i32(here, j, k->j);
    k->s = vd_wide_blend_f32(here, tb, k->s);
    const mask ended = here & (not_less(tb, k->hi) | vd_wide_not(is_inside(slab, i, j)));
    k->alive &= vd_wide_not(hit | *blocked | ended);
    return hit;
}

/* The packet in the slab's cells; which lanes are in the air where their part begins. */
static inline void begin_walk(const vd_lens_slab *slab, const rays *r, walk *k) {
    const f32 begin = vd_wide_splat_f32(slab->begin);
    k->lo = vd_wide_max_f32(r->lo, begin);
    k->hi = vd_wide_min_f32(r->hi, vd_wide_splat_f32(slab->end));
    k->air = vd_wide_less_f32(r->lo, begin);
    k->u = (r->u + slab->shift_u) * slab->scale;
    k->v = (r->v + slab->shift_v) * slab->scale;
    k->ut = r->ut * slab->scale;
    k->vt = r->vt * slab->scale;
    k->iu = r->iu * slab->unscale;
    k->iv = r->iv * slab->unscale;
    k->w = r->w, k->w1 = r->w1, k->w2 = r->w2;
}

/* The cells where the lanes of `active` begin. */
static inline void begin_cells(const vd_lens_slab *slab, mask active, f32 start, walk *k) {
    const f32 zero = vd_wide_splat_f32(0.0f);
    k->s = vd_wide_max_f32(k->lo, start);
    const mask skipped = vd_wide_less_f32(k->lo, start);
    k->alive = active & vd_wide_less_f32(k->s, k->hi);
    k->air |= skipped;
    const i32 one = vd_wide_splat_i32(1), izero = vd_wide_splat_i32(0);
    k->eu = select_i32(vd_wide_less_f32(zero, k->ut), one, izero);
    k->ev = select_i32(vd_wide_less_f32(zero, k->vt), one, izero);
    k->du = k->eu + k->eu - 1;
    k->dv = k->ev + k->ev - 1;
    k->i = cell_at(k->s, k->u, k->ut, k->iu, to_f32(k->du), to_f32(k->eu));
    k->j = cell_at(k->s, k->v, k->vt, k->iv, to_f32(k->dv), to_f32(k->ev));
    const i32 first_i = vd_wide_splat_i32(-slab->column), first_j = vd_wide_splat_i32(-slab->row);
    const i32 last_i = first_i + (slab->ground->columns - 1);
    const i32 last_j = first_j + (slab->ground->rows - 1);
    /* Rounding may begin a cell beyond the ground's edge; behind a skipped part that is its end. */
    k->alive &= is_inside(slab, k->i, k->j) | vd_wide_not(skipped);
    k->i = vd_wide_max_i32(first_i, vd_wide_min_i32(k->i, last_i));
    k->j = vd_wide_max_i32(first_j, vd_wide_min_i32(k->j, last_j));
    k->level = vd_wide_splat_i32(slab->ground->top < START_LEVEL ? slab->ground->top : START_LEVEL);
}

/* Follows the lanes of `active` from `start` in slab `first` on; those of `air` have been seen to
 * be in the air there. Adds what hits to *hits and *s_hit. */
static inline void cast(const vd_lens_view *view, const rays *r, int first, mask active, f32 start,
                        mask air, mask *hits, f32 *s_hit) {
    for (int n = first; n < view->slabs && vd_wide_bits(active) != 0; n++) {
        const vd_lens_slab *slab = &view->slab[n];
        walk k;
        begin_walk(slab, r, &k);
        begin_cells(slab, active, start, &k);
        if (n == first) {
            k.air = air;
        }
        while (vd_wide_bits(k.alive) != 0) {
            const mask cells = vd_wide_equal_i32(k.level, vd_wide_splat_i32(0)) & k.alive;
            const mask blocks = k.alive & vd_wide_not(cells);
            const int cell_count = __builtin_popcount(vd_wide_bits(cells));
            const int block_count = __builtin_popcount(vd_wide_bits(blocks));
            if (cell_count < block_count) {
                step_block(slab, &k, blocks);
                continue;
            }
            f32 s;
            mask blocked;
            const mask hit = step_cell(slab, &k, cells, &s, &blocked);
            *s_hit = vd_wide_blend_f32(hit, s, *s_hit);
            *hits |= hit;
            active &= vd_wide_not(hit | blocked);
        }
    }
}

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
    const i32 stride = vd_wide_lookup_i32(view->texture_stride, size);
    i32 index = vd_wide_lookup_i32(view->texture_offset, size) + j * stride + i;
    index = select_i32(here, index, izero);
    const i32 below = select_i32(here, index + stride, izero);
    i32 upper[2], lower[2];
    vd_wide_load_pairs(view->texels, index, upper);
    vd_wide_load_pairs(view->texels, below, lower);
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

/* ---- pictures -------------------------------------------------------------------------------- */

/* A block's picture positions: pixel (x, y) of the block, from left to right, top to bottom. */
static const float block_x[BLOCK * BLOCK] = {0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2, 3};
static const float block_y[BLOCK * BLOCK] = {0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3};

/* Writes what of a block lies in the picture. */
static inline void put_block(const vd_lens_picture *picture, int x, int y, const uint32_t *color,
                             const float *depth) {
    vd_frame *frame = picture->frame;
    const int columns = frame->width - x < BLOCK ? frame->width - x : BLOCK;
    const int rows = frame->height - y < BLOCK ? frame->height - y : BLOCK;
    for (int row = 0; row < rows; row++) {
        const size_t at = (size_t)(y + row) * frame->stride + (size_t)x;
        float *depths = picture->depth + (size_t)(y + row) * picture->depth_stride + (size_t)x;
        memcpy(frame->rgba + 4 * at, color + BLOCK * row, (size_t)columns * sizeof *color);
        memcpy(depths, depth + BLOCK * row, (size_t)columns * sizeof *depth);
        if (frame->depth != NULL) {
            memcpy(frame->depth + at, depth + BLOCK * row, (size_t)columns * sizeof *depth);
        }
        for (int i = 0; frame->id != NULL && i < columns; i++) {
            frame->id[at + (size_t)i] =
                depth[BLOCK * row + i] > 0.0f ? picture->view->terrain_id : 0;
        }
    }
}

/* Draws the block at (x, y), number `at` of its tile. */
static inline void draw_block(const vd_lens_picture *picture, const tile_beams *beam, int at, int x,
                              int y, vd_lens_counts *counts) {
    const vd_lens_view *view = picture->view;
    const f32 width = vd_wide_splat_f32((float)picture->frame->width);
    const f32 height = vd_wide_splat_f32((float)picture->frame->height);
    const float start = beam->s[at];
    const int first = slab_of(view, start);
    uint32_t color[BLOCK * BLOCK];
    float depth[BLOCK * BLOCK];
    for (int packet = 0; packet < PACKETS; packet++) {
        const f32 px = vd_wide_load_f32(block_x + packet * LANES) + ((float)x + 0.5f);
        const f32 py = vd_wide_load_f32(block_y + packet * LANES) + ((float)y + 0.5f);
        const mask active = vd_wide_less_f32(px, width) & vd_wide_less_f32(py, height);
        mask hits = active & vd_wide_not(active);
        f32 s_hit = vd_wide_splat_f32(0.0f);
        rays r;
        make_rays(view, px, py, &r);
        if (first < view->slabs) {
            const vd_lens_slab *slab = &view->slab[first];
            walk k;
            begin_walk(slab, &r, &k);
            float s = vd_lens_max(start, slab->begin);
            mask air = k.air | vd_wide_less_f32(k.lo, vd_wide_splat_f32(s));
            mask alive = walk_near(slab, beam, at, &k, active & vd_wide_less_f32(r.lo, r.hi), &air,
                                   &s, &hits, &s_hit);
            if (vd_wide_bits(alive) != 0) {
                cast(view, &r, first, alive, vd_wide_splat_f32(s), air, &hits, &s_hit);
            }
        }
        i32 colors;
        f32 depths;
        shade(view, &r, active, hits, px, py, s_hit, &colors, &depths);
        counts->samples += (uint64_t)__builtin_popcount(vd_wide_bits(active));
        counts->hits += (uint64_t)__builtin_popcount(vd_wide_bits(hits));
        memcpy(color + packet * LANES, &colors, sizeof colors);
        memcpy(depth + packet * LANES, &depths, sizeof depths);
    }
    put_block(picture, x, y, color, depth);
}

static inline void store_beams(tile_beams *out, int at, const beams *b) {
    vd_wide_store_f32(out->u0 + at, b->u0);
    vd_wide_store_f32(out->u1 + at, b->u1);
    vd_wide_store_f32(out->ut0 + at, b->ut0);
    vd_wide_store_f32(out->ut1 + at, b->ut1);
    vd_wide_store_f32(out->v0 + at, b->v0);
    vd_wide_store_f32(out->v1 + at, b->v1);
    vd_wide_store_f32(out->vt0 + at, b->vt0);
    vd_wide_store_f32(out->vt1 + at, b->vt1);
    vd_wide_store_f32(out->w0 + at, b->w0);
    vd_wide_store_f32(out->w1 + at, b->w1);
    vd_wide_store_f32(out->w2 + at, b->w2);
    vd_wide_store_f32(out->w2_most + at, b->w2_most);
    vd_wide_store_f32(out->s + at, b->s);
    vd_wide_store_f32(out->hi + at, b->hi);
}

/* Where the rays of each block of a tile may come over the map: `starts` of the picture. */
static inline void aim_tile(const vd_lens_picture *picture, int tile_x, int tile_y,
                            tile_beams *out) {
    enum { SIDE = VD_LENS_TILE / BLOCK };
    for (int at = 0; at < SIDE * SIDE; at += LANES) {
        f32 x, y;
        for (int lane = 0; lane < LANES; lane++) {
            x[lane] = (float)(tile_x + (at + lane) % SIDE * BLOCK);
            y[lane] = (float)(tile_y + (at + lane) / SIDE * BLOCK);
        }
        beams b;
        make_beams(picture->view, x, y, (float)BLOCK, &b);
        store_beams(out, at, &b);
    }
    const int columns = (picture->frame->width - tile_x + BLOCK - 1) / BLOCK;
    const int rows = (picture->frame->height - tile_y + BLOCK - 1) / BLOCK;
    for (int row = 0; row < SIDE && row < rows; row++) {
        float *to = picture->starts + (size_t)(tile_y / BLOCK + row) * picture->starts_stride +
                    (size_t)(tile_x / BLOCK);
        memcpy(to, out->s + row * SIDE, sizeof *to * (size_t)(columns < SIDE ? columns : SIDE));
    }
}

static void draw(const vd_lens_picture *picture, int tile_x, int tile_y, vd_lens_counts *counts) {
    enum { SIDE = VD_LENS_TILE / BLOCK };
    const vd_frame *frame = picture->frame;
    tile_beams beam;
    aim_tile(picture, tile_x, tile_y, &beam);
    for (int row = 0; row < SIDE && tile_y + row * BLOCK < frame->height; row++) {
        for (int column = 0; column < SIDE && tile_x + column * BLOCK < frame->width; column++) {
            draw_block(picture, &beam, row * SIDE + column, tile_x + column * BLOCK,
                       tile_y + row * BLOCK, counts);
        }
    }
}

/* ---- edges ----------------------------------------------------------------------------------- */

/* Appends the pixels of one row of a tile that lie on an edge; returns their number. */
static int find_edges(const vd_lens_picture *picture, int tile_x, int y, uint16_t *found) {
    const vd_lens_view *view = picture->view;
    const int width = picture->frame->width, height = picture->frame->height;
    const int columns = width - tile_x < VD_LENS_TILE ? width - tile_x : VD_LENS_TILE;
    const float *row = picture->depth + (size_t)y * picture->depth_stride + tile_x;
    const float *above = y > 0 ? row - picture->depth_stride : row;
    const float *below = y + 1 < height ? row + picture->depth_stride : row;
    float here[VD_LENS_TILE + 2];
    here[0] = tile_x > 0 ? row[-1] : row[0];
    memcpy(here + 1, row, (size_t)columns * sizeof *row);
    here[columns + 1] = tile_x + columns < width ? row[columns] : row[columns - 1];
    uint8_t edge[VD_LENS_TILE];
    for (int x = 0; x < columns; x++) {
        const float a = here[x], b = here[x + 1], c = here[x + 2], d = above[x], e = below[x];
        const float across = vd_lens_max(a, vd_lens_max(b, c));
        const float along = vd_lens_max(d, vd_lens_max(b, e));
        edge[x] = (across * view->edge_share + view->edge_least < fabsf((a - b) + (c - b))) |
                  (along * view->edge_share + view->edge_least < fabsf((d - b) + (e - b))) |
                  view->everywhere;
    }
    int count = 0;
    for (int x = 0; x < columns; x++) {
        found[count] = (uint16_t)x;
        count += edge[x];
    }
    return count;
}

/* Draws `count` pixels of row y again. */
static void refine_pixels(const vd_lens_picture *picture, int tile_x, int y, const uint16_t *pixels,
                          int count, vd_lens_counts *counts) {
    const vd_lens_view *view = picture->view;
    vd_frame *frame = picture->frame;
    const int samples = view->samples;
    const float(*offsets)[2] = vd_sample_offsets(samples);
    /* Samples of all pixels one behind the other, LANES at a time. */
    enum { MOST = VD_LENS_TILE * 8 };
    uint32_t color[MOST + LANES];
    float depth[MOST + LANES];
    const int total = count * samples;
    for (int at = 0; at < total; at += LANES) {
        f32 x, y_positions, start;
        float nearest = INFINITY;
        for (int lane = 0; lane < LANES; lane++) {
            const int sample = at + lane < total ? at + lane : total - 1;
            const int pixel = tile_x + pixels[sample / samples];
            x[lane] = (float)pixel + offsets[sample % samples][0];
            y_positions[lane] = (float)y + offsets[sample % samples][1];
            start[lane] =
                picture->starts[(size_t)(y / BLOCK) * picture->starts_stride + pixel / BLOCK];
            nearest = vd_lens_min(nearest, start[lane]);
        }
        i32 colors;
        f32 depths;
        const mask active = vd_wide_equal_i32(vd_wide_splat_i32(0), vd_wide_splat_i32(0));
        mask hits = vd_wide_not(active);
        f32 s_hit = vd_wide_splat_f32(0.0f);
        rays r;
        make_rays(view, x, y_positions, &r);
        const int first = slab_of(view, nearest);
        if (first < view->slabs) {
            const f32 begin = vd_wide_splat_f32(view->slab[first].begin);
            const mask air = vd_wide_less_f32(r.lo, begin) |
                             vd_wide_less_f32(vd_wide_max_f32(r.lo, begin), start);
            cast(view, &r, first, active & vd_wide_less_f32(r.lo, r.hi), start, air, &hits, &s_hit);
        }
        shade(view, &r, active, hits, x, y_positions, s_hit, &colors, &depths);
        memcpy(color + at, &colors, sizeof colors);
        memcpy(depth + at, &depths, sizeof depths);
    }
    for (int p = 0; p < count; p++) {
        uint32_t sum[4] = {0, 0, 0, 0}, packed = 0;
        float nearest = 0.0f;
        for (int i = 0; i < samples; i++) {
            const uint32_t c = color[p * samples + i];
            for (int channel = 0; channel < 4; channel++) {
                sum[channel] += c >> (8 * channel) & 255;
            }
            nearest = vd_lens_max(nearest, depth[p * samples + i]);
        }
        for (int channel = 0; channel < 4; channel++) {
            packed |= (sum[channel] + (uint32_t)samples / 2) / (uint32_t)samples << (8 * channel);
        }
        const size_t to = (size_t)y * frame->stride + (size_t)(tile_x + pixels[p]);
        memcpy(frame->rgba + 4 * to, &packed, sizeof packed);
        if (frame->depth != NULL) {
            frame->depth[to] = nearest;
        }
        if (frame->id != NULL) {
            frame->id[to] = nearest > 0.0f ? view->terrain_id : 0;
        }
    }
    counts->samples += (uint64_t)total;
}

static void refine(const vd_lens_picture *picture, int tile_x, int tile_y, vd_lens_counts *counts) {
    for (int y = tile_y; y < tile_y + VD_LENS_TILE && y < picture->frame->height; y++) {
        uint16_t pixels[VD_LENS_TILE];
        const int count = find_edges(picture, tile_x, y, pixels);
        if (count > 0) {
            refine_pixels(picture, tile_x, y, pixels, count, counts);
        }
    }
}

const vd_lens_methods TABLE = {draw, refine};

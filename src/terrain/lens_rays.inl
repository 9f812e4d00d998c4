/* lens_rays.inl: 16 rays, a lane each, through blocks and cells; a part of lens_march.inl. */
#include <string.h>
#include "core/wide_texels.h"
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

/* The ground's cell of a slab's. Wraps: the cells of lanes that are done are anything. */
static inline i32 of_ground(i32 cell, int32_t first) {
    return (i32)((vd_wide_u32)cell + (uint32_t)first);
}

/* Lanes whose cell is one of the ground's. */
static inline mask is_inside(const vd_lens_slab *slab, i32 i, i32 j) {
    const vd_wide_u32 columns = (vd_wide_u32){0} + (uint32_t)slab->ground->columns;
    const vd_wide_u32 rows = (vd_wide_u32){0} + (uint32_t)slab->ground->rows;
    /* Unsigned, by flipping the highest bit: negative numbers are too great as well. */
    const i32 flip = vd_wide_splat_i32(INT32_MIN);
    return vd_wide_less_i32(of_ground(i, slab->column) ^ flip, (i32)columns ^ flip) &
           vd_wide_less_i32(of_ground(j, slab->row) ^ flip, (i32)rows ^ flip);
}

/* One step of the lanes of `here` through blocks. */
static inline void step_block(const vd_lens_slab *slab, walk *k, mask here) {
    const vd_lens_ground *g = slab->ground;
    const i32 zero = vd_wide_splat_i32(0);
    const i32 level = k->level;
    const i32 column_here = of_ground(k->i, slab->column), row_here = of_ground(k->j, slab->row);
    const i32 column = column_here >> level, row = row_here >> level;
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
        ((of_ground(i, slab->column) ^ column_here) | (of_ground(j, slab->row) ^ row_here)) >>
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

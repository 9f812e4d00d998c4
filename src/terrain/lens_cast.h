/* lens_cast.h: one ray over a vd_lens_map: what the plain method does, and what lens_march.inl does
 * to 16 at a time, in the same order.
 *
 *   v ▲      │       │       │          Cells are walked by their crossings, each from the line's
 *     ├──────┼───────┼──●────┤          equation, (edge − u)·(1/ut), never by adding up steps: a
 *     │      │   ●───┼──     │          crossing is the same number however one came there. The ray
 *     ├──────●───────┼───────┤          is in cell (i, j) at s when both of the cell's crossings
 *     │  ●   │       │       │          behind are <= s and both ahead are > s.
 *     └──────┴───────┴───────┴──► u
 *
 * Within a cell f(s) = w(s) − ground(s) is a quadratic, as the ground is bilinear and the ray
 * straight (or curved once, by the Earth). A hit is its first zero coming from above. Where
 * rounding pushes a zero over the cell's end, the next cell finds f <= 0 at its beginning and the
 * ray in the air: that is a hit as well, so there are no cracks. Amanatides & Woo (1987) for the
 * walk; the quadratic after Press et al. (2007), §5.6.
 */
#ifndef VEDUTA_TERRAIN_LENS_CAST_H
#define VEDUTA_TERRAIN_LENS_CAST_H

#include "terrain/lens_view.h"

/* No ray of the world is longer, in metres. */
#define VD_LENS_FAR 1e9f

/* A speed of 0 would divide: one of a sample in 10^20 metres does not. */
#define VD_LENS_STILL 1e-20f

typedef struct vd_lens_ray {
    float u, v, w, ut, vt, w1, w2;
    float iu, iv; /* 1/ut, 1/vt */
    float lo, hi; /* the part over the map and under its top; none when !(lo < hi) */
} vd_lens_ray;

/* What is above a ray: nothing known, air, or it came in under the ground. */
typedef enum vd_lens_state { VD_LENS_OUTSIDE, VD_LENS_AIR, VD_LENS_BLOCKED } vd_lens_state;

static inline float vd_lens_at(const vd_lens_affine *f, float x, float y) {
    return (f->k[0] + x * f->k[1]) + y * f->k[2];
}

static inline float vd_lens_min(float a, float b) {
    return a < b ? a : b;
}

static inline float vd_lens_max(float a, float b) {
    return b < a ? a : b;
}

static inline float vd_lens_moving(float speed) {
    return fabsf(speed) < VD_LENS_STILL ? VD_LENS_STILL : speed;
}

static inline vd_lens_ray vd_lens_make_ray(const vd_lens_view *view, float x, float y) {
    vd_lens_ray r;
    r.u = vd_lens_at(&view->u, x, y);
    r.v = vd_lens_at(&view->v, x, y);
    r.ut = vd_lens_moving(vd_lens_at(&view->ut, x, y));
    r.vt = vd_lens_moving(vd_lens_at(&view->vt, x, y));
    const float east = vd_lens_at(&view->east, x, y), north = vd_lens_at(&view->north, x, y);
    const float level = east * east + north * north;
    r.w = vd_lens_at(&view->w, x, y) + level * view->curve_t0_t0;
    r.w1 = vd_lens_moving(vd_lens_at(&view->w1, x, y) + level * view->curve_t0);
    r.w2 = level * view->curve;
    r.iu = 1.0f / r.ut;
    r.iv = 1.0f / r.vt;
    const float ua = (view->west - r.u) * r.iu, ub = (view->east_end - r.u) * r.iu;
    const float va = (view->north_end - r.v) * r.iv, vb = (view->south - r.v) * r.iv;
    /* The ray is nowhere under the straight line w + w1·s. */
    const float under_top = (view->top - r.w) / r.w1;
    const bool falls = r.w1 < 0.0f;
    r.lo = vd_lens_max(view->begin, vd_lens_max(vd_lens_min(ua, ub), vd_lens_min(va, vb)));
    r.lo = vd_lens_max(r.lo, falls ? under_top : view->begin);
    r.hi = vd_lens_min(vd_lens_max(ua, ub), vd_lens_max(va, vb));
    r.hi = vd_lens_min(r.hi, falls ? VD_LENS_FAR : under_top);
    r.hi = vd_lens_min(r.hi, VD_LENS_FAR);
    return r;
}

/* Above 0 for whatever is hit: what lies beyond an orthographic camera's far plane is at it. */
static inline float vd_lens_depth(const vd_lens_view *view, float t) {
    return vd_lens_max(view->orthographic ? 1.0f + t * view->depth_scale : view->depth_scale / t,
                       0x1p-126f);
}

/* A ray within a slab, in its cells. */
typedef struct vd_lens_walk {
    float u, v, ut, vt, iu, iv;
    float lo, hi;
    int du, dv; /* the step to the next cell */
    int eu, ev; /* 1 where the coordinate grows: the edge ahead of cell i is i + eu */
} vd_lens_walk;

static inline float vd_lens_crossing(float edge, float origin, float inverse) {
    return (edge - origin) * inverse;
}

/* The cell along one axis at s. `guess` is at most one off. */
static inline int vd_lens_cell(float s, float origin, float speed, float inverse, int step,
                               int ahead) {
    float cell = floorf(origin + speed * s);
    if (!(s < vd_lens_crossing(cell + (float)ahead, origin, inverse))) {
        cell += (float)step;
    }
    if (s < vd_lens_crossing(cell + (float)(1 - ahead), origin, inverse)) {
        cell -= (float)step;
    }
    return (int)cell;
}

/* Meets cell (i, j) of the slab. Returns true and *s_hit on a hit; else updates *state. */
static inline bool vd_lens_meet(const vd_lens_slab *slab, const vd_lens_ray *r,
                                const vd_lens_walk *k, int i, int j, float tb, vd_lens_state *state,
                                float *s_hit) {
    const vd_lens_ground *g = slab->ground;
    const float *at = g->heights + (size_t)(j + slab->row) * g->stride + (i + slab->column);
    const float h00 = at[0], h10 = at[1], h01 = at[g->stride], h11 = at[g->stride + 1];
    if (!(h00 > -INFINITY && h10 > -INFINITY && h01 > -INFINITY && h11 > -INFINITY)) {
        *state = VD_LENS_OUTSIDE;
        return false;
    }
    const float in_u = vd_lens_crossing((float)(i + 1 - k->eu), k->u, k->iu);
    const float in_v = vd_lens_crossing((float)(j + 1 - k->ev), k->v, k->iv);
    const float ta = vd_lens_max(k->lo, vd_lens_max(in_u, in_v));
    const float fu = vd_lens_max(vd_lens_min((k->u + k->ut * ta) - (float)i, 1.0f), 0.0f);
    const float fv = vd_lens_max(vd_lens_min((k->v + k->vt * ta) - (float)j, 1.0f), 0.0f);
    const float b = h10 - h00, c = h01 - h00, d = (h11 - h10) - c;
    const float by_v = c + d * fu;
    const float f0 = (r->w + ta * (r->w1 + ta * r->w2)) - ((h00 + b * fu) + by_v * fv);
    if (!(f0 > 0.0f)) {
        if (*state == VD_LENS_AIR || f0 == 0.0f) {
            *s_hit = ta;
            return true;
        }
        *state = VD_LENS_BLOCKED;
        return false;
    }
    *state = VD_LENS_AIR;
    const float f1 = (r->w1 + 2.0f * ta * r->w2) - ((b + d * fv) * k->ut + by_v * k->vt);
    const float f2 = r->w2 - d * (k->ut * k->vt);
    const float discriminant = f1 * f1 - 4.0f * (f2 * f0);
    const float root = sqrtf(vd_lens_max(discriminant, 0.0f));
    const bool falls = !(0.0f < f1);
    const float q = 0.5f * (falls ? root - f1 : -root - f1);
    const float s = (falls ? f0 : q) / (falls ? q : f2);
    *s_hit = ta + s;
    return !(discriminant < 0.0f) && 0.0f < s && !(tb - ta < s);
}

/* Follows a ray through one slab. Returns true on a hit. */
static inline bool vd_lens_cast_slab(const vd_lens_slab *slab, const vd_lens_ray *r,
                                     vd_lens_state *state, float *s_hit) {
    vd_lens_walk k;
    k.lo = vd_lens_max(r->lo, slab->begin);
    k.hi = vd_lens_min(r->hi, slab->end);
    if (!(k.lo < k.hi)) {
        return false;
    }
    *state = r->lo < slab->begin ? VD_LENS_AIR : VD_LENS_OUTSIDE;
    k.u = (r->u + slab->shift_u) * slab->scale;
    k.v = (r->v + slab->shift_v) * slab->scale;
    k.ut = r->ut * slab->scale;
    k.vt = r->vt * slab->scale;
    k.iu = r->iu * slab->unscale;
    k.iv = r->iv * slab->unscale;
    k.eu = 0.0f < k.ut, k.ev = 0.0f < k.vt;
    k.du = 2 * k.eu - 1, k.dv = 2 * k.ev - 1;
    int i = vd_lens_cell(k.lo, k.u, k.ut, k.iu, k.du, k.eu);
    int j = vd_lens_cell(k.lo, k.v, k.vt, k.iv, k.dv, k.ev);
    /* Rounding may begin a cell beyond the ground's edge. */
    const int first_i = -slab->column, last_i = slab->ground->columns - 1 - slab->column;
    const int first_j = -slab->row, last_j = slab->ground->rows - 1 - slab->row;
    i = i < first_i ? first_i : i > last_i ? last_i : i;
    j = j < first_j ? first_j : j > last_j ? last_j : j;
    for (;;) {
        const float tu = vd_lens_crossing((float)(i + k.eu), k.u, k.iu);
        const float tv = vd_lens_crossing((float)(j + k.ev), k.v, k.iv);
        const float tb = vd_lens_min(vd_lens_min(tu, tv), k.hi);
        if (vd_lens_meet(slab, r, &k, i, j, tb, state, s_hit)) {
            return true;
        }
        if (*state == VD_LENS_BLOCKED || !(tb < k.hi)) {
            return false;
        }
        i += !(tb < tu) ? k.du : 0;
        j += !(tb < tv) ? k.dv : 0;
        if (i < first_i || i > last_i || j < first_j || j > last_j) {
            return false;
        }
    }
}

/* Follows a ray to its first hit. */
static inline bool vd_lens_cast(const vd_lens_view *view, const vd_lens_ray *r, float *s_hit) {
    vd_lens_state state = VD_LENS_OUTSIDE;
    for (int n = 0; n < view->slabs; n++) {
        if (vd_lens_cast_slab(&view->slab[n], r, &state, s_hit)) {
            return true;
        }
        if (state == VD_LENS_BLOCKED) {
            return false;
        }
    }
    return false;
}

#endif

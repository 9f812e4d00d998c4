/* ray_walk.h: what the plain ray caster and its fast twin share: one ray over the map.
 *
 *        t_in                       t_out           The ray's shadow on the map is a straight line.
 *   ──────●─────┬───────┬─────┬──────●──            It is cut where it crosses a grid line; every
 *               │       │     │                     piece lies in one cell. Crossings are computed
 *         cell 0│ cell 1│  2  │ cell 3              from the line's equation each time (never by
 *                                                   adding up steps), so they carry no drift, and
 *                                                   do not depend on how one came there.
 *
 * Within a cell f(s) = ray height − ground height is a quadratic. A hit is its first zero coming
 * from above. Because neighbouring cells agree on their common edge, a zero that rounding pushes
 * over the edge is found at the start of the next cell. Amanatides & Woo (1987) for the walk; the
 * quadratic after Press et al. (2007), §5.6.
 */
#ifndef VEDUTA_TERRAIN_RAY_WALK_H
#define VEDUTA_TERRAIN_RAY_WALK_H

#include <math.h>
#include "terrain/surface.h"

/* What the ray has above it: nothing known (outside the map, or over a hole), or air. */
typedef enum vd_ray_state { VD_RAY_OUTSIDE, VD_RAY_IN_AIR, VD_RAY_BLOCKED } vd_ray_state;

typedef struct vd_walk {
    double u0, ut, v0, vt; /* column and row: u0 + ut·t, v0 + vt·t */
    double z0, z1, z2;     /* height: z0 + z1·t + z2·t² */
    double t_begin, t_end;
} vd_walk;

/* Cuts [t_begin, t_end] to where low <= a + b·t <= high. */
static inline bool vd_walk_clip_linear(vd_walk *w, double a, double b, double low, double high) {
    if (b == 0.0) {
        return a >= low && a <= high;
    }
    double t0 = (low - a) / b, t1 = (high - a) / b;
    double enter = t0 < t1 ? t0 : t1, leave = t0 < t1 ? t1 : t0;
    w->t_begin = enter > w->t_begin ? enter : w->t_begin;
    w->t_end = leave < w->t_end ? leave : w->t_end;
    return w->t_begin <= w->t_end;
}

/* Cuts [t_begin, t_end] to the part under `top`. The height is convex in t (z2 >= 0), so that part
 * is one interval. */
static inline bool vd_walk_clip_top(vd_walk *w, double top) {
    if (w->z2 == 0.0) {
        return w->z1 == 0.0 ? w->z0 <= top : vd_walk_clip_linear(w, w->z0, w->z1, -INFINITY, top);
    }
    double c = w->z0 - top;
    double discriminant = w->z1 * w->z1 - 4.0 * w->z2 * c;
    if (discriminant < 0.0) {
        return false;
    }
    double root = sqrt(discriminant);
    double q = -0.5 * (w->z1 + (w->z1 < 0.0 ? -root : root));
    double t0 = q / w->z2, t1 = q != 0.0 ? c / q : 0.0;
    double enter = t0 < t1 ? t0 : t1, leave = t0 < t1 ? t1 : t0;
    w->t_begin = enter > w->t_begin ? enter : w->t_begin;
    w->t_end = leave < w->t_end ? leave : w->t_end;
    return w->t_begin <= w->t_end;
}

static inline bool vd_walk_prepare(const vd_surface *s, const vd_ray *ray, double t_min,
                                   double curvature, vd_walk *w) {
    const double *m = s->sample_from_world;
    const vd_vec3 o = ray->origin, d = ray->direction;
    w->u0 = m[0] + (o.x * m[1] + o.y * m[2]);
    w->v0 = m[3] + (o.x * m[4] + o.y * m[5]);
    w->ut = d.x * m[1] + d.y * m[2];
    w->vt = d.x * m[4] + d.y * m[5];
    w->z0 = o.z;
    w->z1 = d.z;
    w->z2 = curvature * (d.x * d.x + d.y * d.y);
    w->t_begin = t_min;
    w->t_end = INFINITY;
    return vd_walk_clip_linear(w, w->u0, w->ut, 0.0, s->heightfield->width - 1) &&
           vd_walk_clip_linear(w, w->v0, w->vt, 0.0, s->heightfield->height - 1) &&
           vd_walk_clip_top(w, s->top);
}

/* Returns the smallest s in (0, length] with a·s² + b·s + c = 0, for c > 0; −1 when there is none.
 */
static inline double vd_walk_first_root(double a, double b, double c, double length) {
    double s;
    if (a == 0.0) {
        if (b >= 0.0) {
            return -1.0;
        }
        s = -c / b;
    } else {
        double discriminant = b * b - 4.0 * a * c;
        if (discriminant < 0.0) {
            return -1.0;
        }
        double root = sqrt(discriminant);
        if (b <= 0.0) {
            s = 2.0 * c / (root - b);
        } else if (a < 0.0) {
            s = (-b - root) / (2.0 * a);
        } else {
            return -1.0;
        }
    }
    return s > 0.0 && s <= length ? s : -1.0;
}

/* Meets one cell between ta and tb. Returns true and the parameter at a hit; else updates *state.
 */
static inline bool vd_walk_meet_cell(const vd_surface *surface, const vd_walk *w, int i, int j,
                                     double ta, double tb, vd_ray_state *state, double *t_hit) {
    const float *row = surface->heights + (size_t)j * surface->stride + i;
    const float h00 = row[0], h10 = row[1];
    const float h01 = row[surface->stride], h11 = row[surface->stride + 1];
    if (h00 == -INFINITY || h10 == -INFINITY || h01 == -INFINITY || h11 == -INFINITY) {
        *state = VD_RAY_OUTSIDE;
        return false;
    }
    const double length = tb - ta;
    const double za = w->z0 + ta * (w->z1 + ta * w->z2), zb = w->z0 + tb * (w->z1 + tb * w->z2);
    float highest = h00 > h10 ? h00 : h10;
    highest = highest > h01 ? highest : h01;
    highest = highest > h11 ? highest : h11;
    /* The ray is convex: between its ends it dips by at most z2·length²/4. */
    const double lowest = (za < zb ? za : zb) - 0.25 * w->z2 * length * length;
    if (lowest > highest * surface->exaggeration) {
        *state = VD_RAY_IN_AIR;
        return false;
    }
    const double e = surface->exaggeration;
    const double a = h00 * e, b = ((double)h10 - h00) * e, c = ((double)h01 - h00) * e;
    const double d = ((double)h11 - h10 - h01 + h00) * e;
    const double fu = (w->u0 + w->ut * ta) - i, fv = (w->v0 + w->vt * ta) - j;
    const double f0 = za - (a + b * fu + c * fv + d * fu * fv);
    const double f1 =
        (w->z1 + 2.0 * w->z2 * ta) - (b * w->ut + c * w->vt) - d * (fu * w->vt + fv * w->ut);
    const double f2 = w->z2 - d * w->ut * w->vt;
    if (f0 <= 0.0) {
        if (*state == VD_RAY_IN_AIR || f0 == 0.0) {
            *t_hit = ta;
            return true;
        }
        *state = VD_RAY_BLOCKED;
        return false;
    }
    *state = VD_RAY_IN_AIR;
    double s = vd_walk_first_root(f2, f1, f0, length);
    *t_hit = ta + s;
    return s > 0.0;
}

static inline int vd_walk_cell_of(double position, double speed, int cells) {
    double cell = floor(position);
    /* Exactly on a grid line and going down: the piece ahead lies in the lower cell. */
    if (speed < 0.0 && cell == position) {
        cell -= 1.0;
    }
    return cell < 0.0 ? 0 : cell > cells - 1 ? cells - 1 : (int)cell;
}

static inline double vd_walk_crossing(double origin, double speed, int cell) {
    if (speed == 0.0) {
        return INFINITY;
    }
    return ((speed > 0.0 ? cell + 1 : cell) - origin) / speed;
}

/* Where a ray is: in cell (i, j) from t on. */
typedef struct vd_walk_place {
    int i, j;
    double t;
} vd_walk_place;

static inline vd_walk_place vd_walk_begin(const vd_surface *surface, const vd_walk *w) {
    const double t = w->t_begin;
    vd_walk_place place = {
        vd_walk_cell_of(w->u0 + w->ut * t, w->ut, surface->heightfield->width - 1),
        vd_walk_cell_of(w->v0 + w->vt * t, w->vt, surface->heightfield->height - 1), t};
    return place;
}

static inline bool vd_walk_inside(const vd_surface *surface, vd_walk_place at) {
    return at.i >= 0 && at.j >= 0 && at.i < surface->heightfield->width - 1 &&
           at.j < surface->heightfield->height - 1;
}

/* The end of a piece that begins at `t` and is left at tu through a column or at tv through a row.
 * A ray that stays over one cell for ever is cut at 10^9 m. */
static inline double vd_walk_end(const vd_walk *w, double t, double tu, double tv) {
    double end = tu < tv ? tu : tv;
    end = end < w->t_end ? end : w->t_end;
    end = end > t ? end : t;
    return end < INFINITY ? end : t + 1e9;
}

/* Fills the hit from its t. */
static inline void vd_walk_finish(const vd_walk *w, vd_surface_hit *hit) {
    hit->column = w->u0 + w->ut * hit->t;
    hit->row = w->v0 + w->vt * hit->t;
    hit->height = w->z0 + hit->t * (w->z1 + hit->t * w->z2);
}

#endif

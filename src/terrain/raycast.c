/* Ray casting a heightfield: the plain reference.
 *
 *        t_in                       t_out           The ray's shadow on the map is a straight line.
 *   ──────●─────┬───────┬─────┬──────●──            It is cut where it crosses a grid line; every
 *               │       │     │                     piece lies in one cell. Crossings are computed
 *         cell 0│ cell 1│  2  │ cell 3              from the line's equation each time (never by
 *                                                   adding up steps), so they carry no drift.
 *
 * Within a cell f(s) = ray height − ground height is a quadratic. A hit is its first zero coming
 * from above. Because neighbouring cells agree on their common edge, a zero that rounding pushes
 * over the edge is found at the start of the next cell. Amanatides & Woo (1987) for the walk; the
 * quadratic after Press et al. (2007), §5.6.
 */
#include <math.h>
#include "terrain/surface.h"
#include "core/real.h"

/* What the ray has above it: nothing known (outside the map, or over a hole), or air. */
typedef enum ray_state { RAY_OUTSIDE, RAY_IN_AIR, RAY_BLOCKED } ray_state;

typedef struct walk {
    double u0, ut, v0, vt; /* column and row: u0 + ut·t, v0 + vt·t */
    double z0, z1, z2;     /* height: z0 + z1·t + z2·t² */
    double t_begin, t_end;
} walk;

double vd_curvature_drop(double distance_m) {
    return (1.0 - 0.13) / (2.0 * 6371008.8) * distance_m * distance_m;
}

/* Cuts [t_begin, t_end] to where low <= a + b·t <= high. */
static bool clip_linear(walk *w, double a, double b, double low, double high) {
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
static bool clip_top(walk *w, double top) {
    if (w->z2 == 0.0) {
        return w->z1 == 0.0 ? w->z0 <= top : clip_linear(w, w->z0, w->z1, -INFINITY, top);
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

static bool prepare(const vd_surface *s, const vd_ray *ray, double t_min, double curvature,
                    walk *w) {
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
    return clip_linear(w, w->u0, w->ut, 0.0, s->heightfield->width - 1) &&
           clip_linear(w, w->v0, w->vt, 0.0, s->heightfield->height - 1) && clip_top(w, s->top);
}

/* Returns the smallest s in (0, length] with a·s² + b·s + c = 0, for c > 0; −1 when there is none.
 */
static double first_root(double a, double b, double c, double length) {
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
static bool meet_cell(const vd_surface *surface, const walk *w, int i, int j, double ta, double tb,
                      ray_state *state, double *t_hit) {
    const float *row = surface->heights + (size_t)j * surface->stride + i;
    const float h00 = row[0], h10 = row[1];
    const float h01 = row[surface->stride], h11 = row[surface->stride + 1];
    if (h00 == -INFINITY || h10 == -INFINITY || h01 == -INFINITY || h11 == -INFINITY) {
        *state = RAY_OUTSIDE;
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
        *state = RAY_IN_AIR;
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
        if (*state == RAY_IN_AIR || f0 == 0.0) {
            *t_hit = ta;
            return true;
        }
        *state = RAY_BLOCKED;
        return false;
    }
    *state = RAY_IN_AIR;
    double s = first_root(f2, f1, f0, length);
    *t_hit = ta + s;
    return s > 0.0;
}

static int cell_of(double position, double speed, int cells) {
    double cell = floor(position);
    /* Exactly on a grid line and going down: the piece ahead lies in the lower cell. */
    if (speed < 0.0 && cell == position) {
        cell -= 1.0;
    }
    return cell < 0.0 ? 0 : cell > cells - 1 ? cells - 1 : (int)cell;
}

static double crossing(double origin, double speed, int cell) {
    if (speed == 0.0) {
        return INFINITY;
    }
    return ((speed > 0.0 ? cell + 1 : cell) - origin) / speed;
}

bool vd_surface_cast(const vd_surface *surface, const vd_ray *ray, double t_min, double curvature,
                     vd_surface_hit *hit) {
    walk w;
    if (!prepare(surface, ray, t_min, curvature, &w)) {
        return false;
    }
    const int columns = surface->heightfield->width - 1, rows = surface->heightfield->height - 1;
    double ta = w.t_begin;
    int i = cell_of(w.u0 + w.ut * ta, w.ut, columns);
    int j = cell_of(w.v0 + w.vt * ta, w.vt, rows);
    ray_state state = RAY_OUTSIDE;
    for (;;) {
        const double tu = crossing(w.u0, w.ut, i), tv = crossing(w.v0, w.vt, j);
        double tb = tu < tv ? tu : tv;
        tb = tb < w.t_end ? tb : w.t_end;
        tb = tb > ta ? tb : ta;
        double t;
        if (tb < INFINITY ? meet_cell(surface, &w, i, j, ta, tb, &state, &t)
                          : meet_cell(surface, &w, i, j, ta, ta + 1e9, &state, &t)) {
            hit->t = t;
            hit->column = w.u0 + w.ut * t;
            hit->row = w.v0 + w.vt * t;
            hit->height = (w.z0 + t * (w.z1 + t * w.z2));
            return true;
        }
        if (state == RAY_BLOCKED || tb >= w.t_end) {
            return false;
        }
        if (tu <= tv) {
            i += w.ut > 0.0 ? 1 : -1;
        } else {
            j += w.vt > 0.0 ? 1 : -1;
        }
        if (i < 0 || j < 0 || i >= columns || j >= rows) {
            return false;
        }
        ta = tb;
    }
}

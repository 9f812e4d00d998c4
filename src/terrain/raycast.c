/* raycast.c: ray casting a heightfield, the plain reference: every cell under the ray, one after
 * the other. What a cell does to a ray is in ray_walk.h; what is drawn, in <veduta/terrain.h>. */
#include "terrain/ray_walk.h"

double vd_curvature_drop(double distance_m) {
    return (1.0 - 0.13) / (2.0 * 6371008.8) * distance_m * distance_m;
}

bool vd_surface_raycast(const vd_surface *surface, const vd_ray *ray, double t_min,
                        double curvature, vd_surface_hit *hit) {
    vd_walk w;
    if (!vd_walk_prepare(surface, ray, t_min, curvature, &w)) {
        return false;
    }
    vd_walk_place at = vd_walk_begin(surface, &w);
    vd_ray_state state = VD_RAY_OUTSIDE;
    for (;;) {
        const double tu = vd_walk_crossing(w.u0, w.ut, at.i),
                     tv = vd_walk_crossing(w.v0, w.vt, at.j);
        const double tb = vd_walk_end(&w, at.t, tu, tv);
        if (vd_walk_meet_cell(surface, &w, at.i, at.j, at.t, tb, &state, &hit->t)) {
            vd_walk_finish(&w, hit);
            return true;
        }
        if (state == VD_RAY_BLOCKED || tb >= w.t_end) {
            return false;
        }
        if (tu <= tv) {
            at.i += w.ut > 0.0 ? 1 : -1;
        } else {
            at.j += w.vt > 0.0 ? 1 : -1;
        }
        if (!vd_walk_inside(surface, at)) {
            return false;
        }
        at.t = tb;
    }
}

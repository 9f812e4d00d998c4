/* lens_march.c: the ray caster's fast twin: the same bytes, at a cost that follows what is seen.
 *
 *            ray ─────●────────────────────────●            Level l of the pyramid holds the
 * highest │   block of 2^l × 2^l   │            ground over each block of cells. A block │  cells:
 * skipped whole  │            whose highest ground lies under the ray
 *     ────────────────┴──/\\──────────────/\\──┴────        is left behind in one step; the walk
 * goes up a level after a step that left the parent block, and down a level when the block is too
 * high to skip (Tevs, Ihrke & Seidel 2008).
 *
 * Why it stays exact. A cell that is entered is met by the reference's own code, with the
 * reference's own t: crossings come from the line's equation, so they do not depend on the way
 * there. Leaving a block at t through a column, the row is the one that the reference would be in:
 * it has taken every row crossing before t, and none at or after it (the reference steps columns
 * first at a tie); and the other way round. Inside a block that is skipped the ray is MARGIN above
 * every sample, many times the rounding of the reference's quadratic, so the reference finds no
 * zero there either. What the reference remembers of the last cell (air, or a hole) does not matter
 * after such a block: it asks for it only where a ray comes into a cell under its ground, and the
 * edge that the next cell shares with the block lies under the ray as well, or belongs to a hole.
 */
#include "terrain/ray_walk.h"

/* Metres; and 1e-9 of the heights compared, which are exact to 1e-15. */
#define MARGIN 1e-6
#define RELATIVE_MARGIN 1e-9
#define START_LEVEL 3

/* The last cell, in the walking direction, of the block that holds a cell. */
static inline int block_end(int cell, int level, double speed, int cells) {
    const int first = cell >> level << level;
    const int last = first + (1 << level) - 1;
    return speed > 0.0 ? (last < cells - 1 ? last : cells - 1) : first;
}

/* The walk along one axis, with the reciprocal of its speed for estimates. */
typedef struct axis {
    double origin, speed, reciprocal; /* cell position: origin + speed·t */
    int cells;
} axis;

/* The crossing at which the block that holds `cell` is left. */
typedef struct border {
    int end;         /* the last cell */
    double estimate; /* of t, good to a few units in the last place */
} border;

static inline axis make_axis(double origin, double speed, int cells) {
    axis a = {origin, speed, speed == 0.0 ? 0.0 : 1.0 / speed, cells};
    return a;
}

static inline border border_of(const axis *a, int cell, int level) {
    border b = {block_end(cell, level, a->speed, a->cells), INFINITY};
    if (a->speed != 0.0) {
        b.estimate = ((a->speed > 0.0 ? b.end + 1 : b.end) - a->origin) * a->reciprocal;
    }
    return b;
}

/* Whether the ray is above all ground of the block from at.t to about tb. */
static inline bool is_under(const vd_surface *s, const vd_walk *w, vd_walk_place at, int level,
                            double tb) {
    const vd_heightfield_level *l = &s->heightfield->levels[level];
    const float *maxima = vd_heightfield_level_data(s->heightfield, level);
    const double highest =
        (double)maxima[(size_t)(at.j >> level) * l->stride + (size_t)(at.i >> level)] *
        s->exaggeration;
    const double za = w->z0 + at.t * (w->z1 + at.t * w->z2), zb = w->z0 + tb * (w->z1 + tb * w->z2);
    const double length = tb - at.t;
    const double lowest = (za < zb ? za : zb) - 0.25 * w->z2 * length * length;
    const double margin = MARGIN + RELATIVE_MARGIN * (fabs(w->z0) + fabs(za) + fabs(zb) +
                                                      w->z2 * tb * tb + fabs(highest));
    return highest == -INFINITY || lowest > highest + margin;
}

/* Returns the cell, along one axis, that the reference is in after it has taken every crossing
 * before t, and those at t when `ties` is set. `cell` is where it was earlier. */
static inline int cell_at(const axis *a, int cell, double t, bool ties) {
    if (a->speed == 0.0) {
        return cell;
    }
    const double position = a->origin + a->speed * t;
    int guess = (int)floor(position);
    const double from_border = position - guess;
    if (from_border > 1e-6 && from_border < 1.0 - 1e-6) {
        return guess; /* far from any crossing, compared with its rounding */
    }
    /* Rounding may put the guess a cell too far or too near, never more. */
    guess = a->speed > 0.0 ? (guess - 2 > cell ? guess - 2 : cell)
                           : (guess + 2 < cell ? guess + 2 : cell);
    for (;;) {
        const double next = vd_walk_crossing(a->origin, a->speed, guess);
        if (!(next < t || (ties && next == t))) {
            return guess;
        }
        guess += a->speed > 0.0 ? 1 : -1;
    }
}

bool vd_surface_march(const vd_surface *surface, const vd_ray *ray, double t_min, double curvature,
                      vd_surface_hit *hit) {
    vd_walk w;
    if (!vd_walk_prepare(surface, ray, t_min, curvature, &w)) {
        return false;
    }
    const axis u = make_axis(w.u0, w.ut, surface->heightfield->width - 1);
    const axis v = make_axis(w.v0, w.vt, surface->heightfield->height - 1);
    const int top = surface->heightfield->level_count - 1;
    vd_walk_place at = vd_walk_begin(surface, &w);
    vd_ray_state state = VD_RAY_OUTSIDE;
    int level = top < START_LEVEL ? top : START_LEVEL;
    for (;;) {
        const border bu = border_of(&u, at.i, level), bv = border_of(&v, at.j, level);
        if (level > 0 &&
            !is_under(surface, &w, at, level, vd_walk_end(&w, at.t, bu.estimate, bv.estimate))) {
            level--;
            continue;
        }
        /* The exact crossing costs a division: only that of the border met first, unless it is
         * close. */
        const bool close = !(fabs(bu.estimate - bv.estimate) > 1e-9 * fabs(bu.estimate));
        const double tu =
            close || bu.estimate < bv.estimate ? vd_walk_crossing(w.u0, w.ut, bu.end) : INFINITY;
        const double tv =
            close || bv.estimate < bu.estimate ? vd_walk_crossing(w.v0, w.vt, bv.end) : INFINITY;
        const double tb = vd_walk_end(&w, at.t, tu, tv);
        if (level > 0) {
            state = VD_RAY_IN_AIR;
        } else if (vd_walk_meet_cell(surface, &w, at.i, at.j, at.t, tb, &state, &hit->t)) {
            vd_walk_finish(&w, hit);
            return true;
        }
        if (state == VD_RAY_BLOCKED || tb >= w.t_end) {
            return false;
        }
        const vd_walk_place from = at;
        if (tu <= tv) {
            at.j = level > 0 ? cell_at(&v, at.j, tu, false) : at.j;
            at.i = bu.end + (w.ut > 0.0 ? 1 : -1);
        } else {
            at.i = level > 0 ? cell_at(&u, at.i, tv, true) : at.i;
            at.j = bv.end + (w.vt > 0.0 ? 1 : -1);
        }
        if (!vd_walk_inside(surface, at)) {
            return false;
        }
        at.t = tb;
        const int parent = level + 1;
        if (level < top && ((from.i ^ at.i) | (from.j ^ at.j)) >> parent != 0) {
            level = parent;
        }
    }
}

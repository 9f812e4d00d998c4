/* framing.h: where a camera of given direction stands to have all of something in its picture.
 *
 * The directions of the camera's axes are given, its place is not. In coordinates along those axes
 * a point (X, Y, Z) is in the picture of an eye (ex, ey, ez) when |X − ex| <= tx·(Z − ez)   and
 * −tt·(Z − ez) <= Y − ey <= tb·(Z − ez), tx, tt, tb being the tangents of the half fields of view
 * less a margin. Each side bounds ex or ey by a line in ez over all points, so the nearest eye that
 * sees everything follows in one pass: ez = min((min(X + tx·Z) − max(X − tx·Z)) / 2tx, (min(Y +
 * tt·Z) − max(Y − tb·Z)) / (tt + tb)).
 */
#ifndef VEDUTA_APP_FRAMING_H
#define VEDUTA_APP_FRAMING_H

#include <math.h>
#include <stdbool.h>
#include <veduta/veduta.h>

typedef struct vd_framing {
    vd_vec3 x_axis, y_axis, z_axis;   /* the camera's, in the world */
    double side, top, bottom;         /* tangents */
    double low_share;                 /* of the height to spare: how much goes above, 0 … 1 */
    vd_vec3 target;                   /* where `reach` is measured from */
    double left, right, upper, lower; /* the lines' extremes: max, min, min, max */
    double reach;                     /* distance needed about a fixed target */
    double box[3][2];                 /* min and max of X, Y and Z */
} vd_framing;

/* `side`, `top` and `bottom` are the shares of the half picture that may be filled. */
vd_framing vd_framing_start(vd_quat orientation, vd_lens lens, int width, int height, double side,
                            double top, double bottom);

/* Forgets all points. */
void vd_framing_clear(vd_framing *framing);

/* The nearest eye that has all points in its picture. An orthographic picture (`flat`), whose scale
 * follows from the distance to `middle` alone, fits them at that scale. */
vd_vec3 vd_framing_eye(const vd_framing *framing, bool flat, vd_vec3 middle);

/* Of finite numbers; fmax and fmin are calls. */
static inline double vd_larger(double a, double b) {
    return a > b ? a : b;
}

static inline double vd_smaller(double a, double b) {
    return a < b ? a : b;
}

static inline void vd_framing_add(vd_framing *f, vd_vec3 p) {
    const double x = vd_vec3_dot(f->x_axis, p), y = vd_vec3_dot(f->y_axis, p),
                 z = vd_vec3_dot(f->z_axis, p);
    f->left = vd_larger(f->left, x - f->side * z);
    f->right = vd_smaller(f->right, x + f->side * z);
    f->lower = vd_larger(f->lower, y - f->bottom * z);
    f->upper = vd_smaller(f->upper, y + f->top * z);
    const double at[3] = {x, y, z};
    for (int i = 0; i < 3; i++) {
        f->box[i][0] = vd_smaller(f->box[i][0], at[i]);
        f->box[i][1] = vd_larger(f->box[i][1], at[i]);
    }
    const vd_vec3 t = f->target;
    const double tx = x - vd_vec3_dot(f->x_axis, t), ty = y - vd_vec3_dot(f->y_axis, t),
                 tz = z - vd_vec3_dot(f->z_axis, t);
    f->reach = vd_larger(f->reach, fabs(tx) / f->side - tz);
    f->reach = vd_larger(f->reach, (ty > 0.0 ? ty / f->bottom : -ty / f->top) - tz);
}

#endif

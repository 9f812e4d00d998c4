#include <math.h>
#include <veduta/vector.h>
#include "core/real.h"

double vd_vec3_length(vd_vec3 a) {
    return sqrt(vd_vec3_dot(a, a));
}

vd_vec3 vd_vec3_normalize(vd_vec3 a) {
    double length = vd_vec3_length(a);
    return length > 0.0 ? vd_vec3_make(a.x / length, a.y / length, a.z / length) : a;
}

vd_quat vd_quat_from_axis_angle(vd_vec3 axis, double angle_rad) {
    double s = vd_sin(0.5 * angle_rad);
    vd_quat q = {axis.x * s, axis.y * s, axis.z * s, vd_cos(0.5 * angle_rad)};
    return q;
}

/* Shepperd (1978): divide by the largest of the four components, so that no digits are lost. */
vd_quat vd_quat_from_axes(vd_vec3 x, vd_vec3 y, vd_vec3 z) {
    double trace = x.x + y.y + z.z;
    vd_quat q;
    if (trace >= x.x && trace >= y.y && trace >= z.z) {
        q = (vd_quat){y.z - z.y, z.x - x.z, x.y - y.x, 1.0 + trace};
    } else if (x.x >= y.y && x.x >= z.z) {
        q = (vd_quat){1.0 + x.x - y.y - z.z, x.y + y.x, z.x + x.z, y.z - z.y};
    } else if (y.y >= z.z) {
        q = (vd_quat){x.y + y.x, 1.0 + y.y - x.x - z.z, y.z + z.y, z.x - x.z};
    } else {
        q = (vd_quat){z.x + x.z, y.z + z.y, 1.0 + z.z - x.x - y.y, x.y - y.x};
    }
    return vd_quat_normalize(q);
}

vd_quat vd_quat_multiply(vd_quat a, vd_quat b) {
    vd_quat q = {a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
                 a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x,
                 a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w,
                 a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z};
    return q;
}

vd_quat vd_quat_normalize(vd_quat q) {
    double length = sqrt((q.x * q.x + q.y * q.y) + (q.z * q.z + q.w * q.w));
    if (!(length > 0.0)) {
        return (vd_quat){0.0, 0.0, 0.0, 1.0};
    }
    return (vd_quat){q.x / length, q.y / length, q.z / length, q.w / length};
}

vd_quat vd_quat_slerp(vd_quat a, vd_quat b, double t) {
    double cosine = (a.x * b.x + a.y * b.y) + (a.z * b.z + a.w * b.w);
    if (cosine < 0.0) { /* b and −b are one rotation; take the nearer */
        b = (vd_quat){-b.x, -b.y, -b.z, -b.w};
        cosine = -cosine;
    }
    double from = 1.0 - t, to = t;
    const double sine2 = 1.0 - cosine * cosine;
    if (sine2 > 1e-12) { /* below, the arc is straight to the last bit */
        const double sine = sqrt(sine2), angle = vd_atan2(sine, cosine);
        from = vd_sin(from * angle) / sine;
        to = vd_sin(to * angle) / sine;
    }
    vd_quat q = {from * a.x + to * b.x, from * a.y + to * b.y, from * a.z + to * b.z,
                 from * a.w + to * b.w};
    return vd_quat_normalize(q);
}

vd_vec3 vd_quat_rotate(vd_quat q, vd_vec3 v) {
    vd_vec3 axis = {q.x, q.y, q.z};
    vd_vec3 t = vd_vec3_scale(vd_vec3_cross(axis, v), 2.0);
    return vd_vec3_add(vd_vec3_add(v, vd_vec3_scale(t, q.w)), vd_vec3_cross(axis, t));
}

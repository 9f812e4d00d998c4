/* vector.h: vectors and quaternions of doubles.
 *
 * World axes: x east, y north, z up, right-handed, metres. Everything here is exact arithmetic in
 * a fixed order (+, -, ×, ÷, sqrt), so it gives the same bytes on every machine.
 */
#ifndef VEDUTA_VECTOR_H
#define VEDUTA_VECTOR_H

#include <veduta/api.h>

VD_BEGIN_DECLARATIONS

typedef struct vd_vec3 {
    double x, y, z;
} vd_vec3;

/* A rotation as a unit quaternion; w is the real part. */
typedef struct vd_quat {
    double x, y, z, w;
} vd_quat;

static inline vd_vec3 vd_vec3_make(double x, double y, double z) {
    vd_vec3 v = {x, y, z};
    return v;
}

static inline vd_vec3 vd_vec3_add(vd_vec3 a, vd_vec3 b) {
    return vd_vec3_make(a.x + b.x, a.y + b.y, a.z + b.z);
}

static inline vd_vec3 vd_vec3_subtract(vd_vec3 a, vd_vec3 b) {
    return vd_vec3_make(a.x - b.x, a.y - b.y, a.z - b.z);
}

static inline vd_vec3 vd_vec3_scale(vd_vec3 a, double s) {
    return vd_vec3_make(a.x * s, a.y * s, a.z * s);
}

static inline double vd_vec3_dot(vd_vec3 a, vd_vec3 b) {
    return (a.x * b.x + a.y * b.y) + a.z * b.z;
}

static inline vd_vec3 vd_vec3_cross(vd_vec3 a, vd_vec3 b) {
    return vd_vec3_make(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
}

/* The least and the greatest of each coordinate. */
static inline vd_vec3 vd_vec3_min(vd_vec3 a, vd_vec3 b) {
    return vd_vec3_make(a.x < b.x ? a.x : b.x, a.y < b.y ? a.y : b.y, a.z < b.z ? a.z : b.z);
}

static inline vd_vec3 vd_vec3_max(vd_vec3 a, vd_vec3 b) {
    return vd_vec3_make(a.x > b.x ? a.x : b.x, a.y > b.y ? a.y : b.y, a.z > b.z ? a.z : b.z);
}

/* Returns the Euclidean length, in the vector's own unit. */
VD_API double vd_vec3_length(vd_vec3 a);

/* Returns a / |a|; the zero vector for the zero vector. */
VD_API vd_vec3 vd_vec3_normalize(vd_vec3 a);

/* Returns the rotation by `angle_rad` about the unit vector `axis`, counter-clockwise seen from
 * the axis' tip. */
VD_API vd_quat vd_quat_from_axis_angle(vd_vec3 axis, double angle_rad);

/* Returns the rotation whose matrix has the given columns, which must be orthonormal and
 * right-handed (the images of the x, y and z axes). */
VD_API vd_quat vd_quat_from_axes(vd_vec3 x_axis, vd_vec3 y_axis, vd_vec3 z_axis);

/* Returns the rotation that applies b first, then a. */
VD_API vd_quat vd_quat_multiply(vd_quat a, vd_quat b);

VD_API vd_quat vd_quat_normalize(vd_quat q);

/* Returns the rotation at `t` (0 … 1) of the way from a to b, the short way round, at constant
 * speed (Shoemake 1985); unit quaternions. */
VD_API vd_quat vd_quat_slerp(vd_quat a, vd_quat b, double t);

/* Returns v rotated by q. */
VD_API vd_vec3 vd_quat_rotate(vd_quat q, vd_vec3 v);

VD_END_DECLARATIONS

#endif

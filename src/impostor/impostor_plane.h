/* impostor_plane.h: the plane that an object's picture lies in, and how wrong it has become.
 *
 *            eye ·······························  each line of sight that the picture was made
 *             ·  · · · ·            p             along meets object and plane in one pixel: from
 *             ·         · · · · ·  / ╲            its eye the picture is right. From elsewhere the
 *          eye'         plane │  q    object      picture shows p where it shows q: the angle
 *                             │                   between them, in pixels, is the screen error.
 *
 * Lawlor 2004, §2.2: for an object whose farthest part lies d behind a plane at the distance z, the
 * error after a sideways move f is k·f·d / (z (z − d)) pixels, so a picture lasts for
 * R = z (z − d) Δs H / (k d V) frames (eq. 2.4). §3.4.1: what decides is not that bound but the key
 * points themselves, projected as they are and as the picture shows them.
 */
#ifndef VEDUTA_IMPOSTOR_IMPOSTOR_PLANE_H
#define VEDUTA_IMPOSTOR_IMPOSTOR_PLANE_H

#include <stdbool.h>
#include <veduta/camera.h>

typedef struct vd_impostor_plane {
    vd_vec3 eye;       /* that the picture was made from; world, metres */
    vd_vec3 origin;    /* a point on the plane */
    vd_vec3 right, up; /* unit vectors in it */
    vd_vec3 normal;    /* unit, towards the eye */
    double extent[4];  /* x0, y0, x1, y1 in metres along right and −up: the picture's rectangle */
    double distance_m; /* from the eye to the origin */
    double depth_m;    /* d: the greatest distance of a key point behind or before the plane */
} vd_impostor_plane;

/* Fits the plane through `through`, facing the eye, to the key points' lines of sight. `normal`: of
 * a plane that does not face the eye, such as a wall's; zero: it does. False when a key point lies
 * beside or behind the eye, on the eye's side of a quarter of the distance, or the plane is seen
 * from its edge: there is no impostor then. */
bool vd_impostor_plane_fit(vd_vec3 eye, vd_vec3 through, vd_vec3 normal, const vd_vec3 *points,
                           int count, vd_impostor_plane *out);

/* Things that are deep, of which the plane's depth is more than this share of its distance, have
 * more key points than their corners. */
#define VD_IMPOSTOR_DEEP 0.2

/* Adds the middles of a box's edges to its corners, of which bit 0, 1, 2 of a number say on which
 * side they are, where the box is deep; `points` has room for 20. Returns how many there are. */
int vd_impostor_plane_more_points(const vd_impostor_plane *plane, vd_vec3 *points);

/* The largest angle between a key point and what the picture shows in its place, seen from `eye`,
 * times the focal length: screen error in pixels at the picture's middle, whatever the camera's
 * rotation. Infinity when a point cannot be seen from there. */
double vd_impostor_plane_error(const vd_impostor_plane *plane, const vd_vec3 *points, int count,
                               vd_vec3 eye, double focal_px);

/* A place on the plane, from metres along right and −up. */
vd_vec3 vd_impostor_plane_at(const vd_impostor_plane *plane, double x, double y);

/* Eq. 2.3: how far the eye may move sideways until the error is `tolerance_px`; infinity for flat
 * things (d = 0), 0 for z <= d. */
double vd_impostor_free_way(double distance_m, double depth_m, double focal_px,
                            double tolerance_px);

/* The camera that draws the picture of width × height pixels, its rectangle grown by `pad` pixels
 * on all sides; `nearest_m` is a lower bound of the distance of what is drawn. */
vd_camera vd_impostor_plane_camera(const vd_impostor_plane *plane, int width, int height, int pad,
                                   double nearest_m);

#endif

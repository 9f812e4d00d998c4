#include "impostor/impostor_plane.h"

#include <math.h>

/* Key points nearer to the eye than this share of the plane's distance spread the picture too far.
 */
#define NEAREST_SHARE 0.25

vd_vec3 vd_impostor_plane_at(const vd_impostor_plane *plane, double x, double y) {
    return vd_vec3_add(plane->origin, vd_vec3_subtract(vd_vec3_scale(plane->right, x),
                                                       vd_vec3_scale(plane->up, y)));
}

/* Where the line of sight from `eye`, `away` before the plane, through a point meets it; false when
 * it does not. */
static bool meet(const vd_impostor_plane *plane, vd_vec3 eye, double away, vd_vec3 point,
                 vd_vec3 *out) {
    const vd_vec3 way = vd_vec3_subtract(point, eye);
    const double toward = -vd_vec3_dot(way, plane->normal);
    if (!(toward > 0.0) || !(away > 0.0)) {
        return false;
    }
    *out = vd_vec3_add(eye, vd_vec3_scale(way, away / toward));
    return true;
}

/* Axes of the plane: upright, or where it is not steep with north up: rectangles of the ground's
 * cells then fill those of their pictures. */
static void set_axes(vd_impostor_plane *plane) {
    const bool level = fabs(plane->normal.z) > 0.3;
    const vd_vec3 up = level ? vd_vec3_make(0, 1, 0) : vd_vec3_make(0, 0, 1);
    const vd_vec3 right = vd_vec3_normalize(vd_vec3_cross(up, plane->normal));
    plane->right = right;
    plane->up = vd_vec3_cross(plane->normal, right);
}

bool vd_impostor_plane_fit(vd_vec3 eye, vd_vec3 through, vd_vec3 normal, const vd_vec3 *points,
                           int count, vd_impostor_plane *out) {
    vd_impostor_plane plane = {.eye = eye, .origin = through};
    const vd_vec3 back = vd_vec3_subtract(eye, through);
    plane.distance_m = vd_vec3_length(back);
    const bool given = vd_vec3_dot(normal, normal) > 0.0;
    plane.normal = vd_vec3_normalize(given ? normal : back);
    const double before = vd_vec3_dot(plane.normal, back);
    if (!(before > 0.01 * plane.distance_m) || !(plane.distance_m > 0.0)) {
        return false;
    }
    set_axes(&plane);
    for (int i = 0; i < count; i++) {
        const vd_vec3 from = vd_vec3_subtract(points[i], through);
        const double off = vd_vec3_dot(from, plane.normal);
        vd_vec3 at;
        if (!(before - off > NEAREST_SHARE * before) ||
            !meet(&plane, eye, before, points[i], &at)) {
            return false;
        }
        const vd_vec3 on = vd_vec3_subtract(at, through);
        const double x = vd_vec3_dot(on, plane.right), y = -vd_vec3_dot(on, plane.up);
        plane.extent[0] = i == 0 || x < plane.extent[0] ? x : plane.extent[0];
        plane.extent[1] = i == 0 || y < plane.extent[1] ? y : plane.extent[1];
        plane.extent[2] = i == 0 || x > plane.extent[2] ? x : plane.extent[2];
        plane.extent[3] = i == 0 || y > plane.extent[3] ? y : plane.extent[3];
        plane.depth_m = fabs(off) > plane.depth_m ? fabs(off) : plane.depth_m;
    }
    *out = plane;
    return count > 0;
}

/* What a corner is shown wrong by is how far it is off the plane times how far aside of it, and
 * along an edge both may go to 0 at opposite ends, when the eye moves towards one of them: the
 * middle is then wrong by a quarter of the product of what each is at most. */
int vd_impostor_plane_more_points(const vd_impostor_plane *plane, vd_vec3 *points) {
    int count = 8;
    if (!(plane->depth_m > VD_IMPOSTOR_DEEP * plane->distance_m)) {
        return count;
    }
    for (int axis = 1; axis < 8; axis *= 2) {
        for (int i = 0; i < 8; i++) {
            if ((i & axis) == 0) {
                points[count++] = vd_vec3_scale(vd_vec3_add(points[i], points[i | axis]), 0.5);
            }
        }
    }
    return count;
}

double vd_impostor_plane_error(const vd_impostor_plane *plane, const vd_vec3 *points, int count,
                               vd_vec3 eye, double focal_px) {
    const double away = vd_vec3_dot(vd_vec3_subtract(plane->eye, plane->origin), plane->normal);
    double worst2 = 0.0; /* squared: the root of the greatest is the greatest root */
    for (int i = 0; i < count; i++) {
        vd_vec3 shown;
        if (!meet(plane, plane->eye, away, points[i], &shown)) {
            return (double)INFINITY;
        }
        const vd_vec3 to = vd_vec3_subtract(points[i], eye);
        const vd_vec3 to_shown = vd_vec3_subtract(shown, eye);
        const double length = sqrt(vd_vec3_dot(to, to));
        const double length_shown = sqrt(vd_vec3_dot(to_shown, to_shown));
        if (!(length > 0.0) || !(length_shown > 0.0)) {
            return (double)INFINITY;
        }
        /* The chord of unit vectors: without the cancellation of a cosine. */
        const vd_vec3 chord = vd_vec3_subtract(vd_vec3_scale(to, 1.0 / length),
                                               vd_vec3_scale(to_shown, 1.0 / length_shown));
        const double chord2 = vd_vec3_dot(chord, chord);
        worst2 = chord2 > worst2 ? chord2 : worst2;
    }
    return sqrt(worst2) * focal_px;
}

double vd_impostor_free_way(double distance_m, double depth_m, double focal_px,
                            double tolerance_px) {
    if (!(depth_m > 0.0)) {
        return (double)INFINITY;
    }
    return distance_m > depth_m
               ? distance_m * (distance_m - depth_m) * tolerance_px / (focal_px * depth_m)
               : 0.0;
}

vd_camera vd_impostor_plane_camera(const vd_impostor_plane *plane, int width, int height, int pad,
                                   double nearest_m) {
    /* Camera space has y down and looks along z: against the normal. */
    const double away = vd_vec3_dot(vd_vec3_subtract(plane->eye, plane->origin), plane->normal);
    const vd_vec3 foot = vd_vec3_subtract(plane->eye, vd_vec3_scale(plane->normal, away));
    const vd_vec3 aside = vd_vec3_subtract(foot, plane->origin);
    const double x = vd_vec3_dot(aside, plane->right), y = -vd_vec3_dot(aside, plane->up);
    vd_camera camera = {.eye = plane->eye, .projection = VD_PROJECTION_PERSPECTIVE};
    camera.orientation = vd_quat_from_axes(plane->right, vd_vec3_scale(plane->up, -1.0),
                                           vd_vec3_scale(plane->normal, -1.0));
    const double scale_x = (width - 2 * pad) / (plane->extent[2] - plane->extent[0]);
    const double scale_y = (height - 2 * pad) / (plane->extent[3] - plane->extent[1]);
    camera.lens.fx = scale_x * away;
    camera.lens.fy = scale_y * away;
    camera.lens.cx = pad + (x - plane->extent[0]) * scale_x;
    camera.lens.cy = pad + (y - plane->extent[1]) * scale_y;
    camera.near_m = nearest_m;
    return camera;
}

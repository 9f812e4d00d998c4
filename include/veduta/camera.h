/* camera.h: where a picture is seen from.
 *
 * Camera space: x to the right, y down, z along the view axis, so that a lens maps
 * (x, y, z) to the pixel (cx + fx·x/z, cy + fy·y/z). Pixel (i, j)'s centre is (i + ½, j + ½).
 * Angles in radians; heading clockwise from north, pitch up, roll clockwise seen from behind.
 */
#ifndef VEDUTA_CAMERA_H
#define VEDUTA_CAMERA_H

#include <stdbool.h>
#include <veduta/matrix.h>
#include <veduta/status.h>
#include <veduta/vector.h>

VD_BEGIN_DECLARATIONS

/* Pinhole intrinsics in pixels (Hartley & Zisserman 2004, §6.1): focal lengths and principal
 * point, which may lie anywhere. Voxel Space's horizon is cy, its height scale fy. */
typedef struct vd_lens {
    double fx, fy, cx, cy;
} vd_lens;

typedef enum vd_projection {
    VD_PROJECTION_PERSPECTIVE = 0,
    VD_PROJECTION_ORTHOGRAPHIC,
    VD_PROJECTION_COUNT
} vd_projection;

typedef struct vd_camera {
    vd_vec3 eye;         /* world, metres */
    vd_quat orientation; /* rotates camera space into the world */
    vd_projection projection;
    vd_lens lens;  /* perspective: pixels; orthographic: fx and fy are pixels per metre */
    double near_m; /* > 0; perspective depth is near / z */
    double far_m;  /* orthographic depth is 1 - z / far; unused by perspective */
} vd_camera;

/* Returns the lens of a picture of width × height with the given vertical field of view, square
 * pixels and the principal point at the centre. 0 < fov_y_rad < π. */
VD_API vd_lens vd_lens_from_fov(double fov_y_rad, int width, int height);

/* Returns the orientation that looks along `heading` and `pitch` (−π/2 … π/2: straight down is
 * −π/2, then the top of the picture is towards `heading`), rolled about the view axis. */
VD_API vd_quat vd_orientation_from_angles(double heading_rad, double pitch_rad, double roll_rad);

/* The inverse: heading in [0, 2π), pitch in [−π/2, π/2], roll in (−π, π]; straight up and down
 * give roll 0. */
VD_API void vd_orientation_to_angles(vd_quat orientation, double *heading_rad, double *pitch_rad,
                                     double *roll_rad);

/* Returns the orientation that looks from eye to target, without roll; heading 0 when the target
 * is straight above or below. eye = target gives the identity of vd_orientation_from_angles. */
VD_API vd_quat vd_orientation_look_at(vd_vec3 eye, vd_vec3 target);

/* Checks that every number is finite, near and focal lengths positive. Returns VD_ERROR_ARGUMENT
 * with the field's name. */
VD_API VD_MUST_USE vd_status vd_camera_validate(const vd_camera *camera);

/* A ray: points origin + t × direction. */
typedef struct vd_ray {
    vd_vec3 origin, direction;
} vd_ray;

/* Returns the ray through the picture position (x, y) in pixels. The direction is scaled so that t
 * is the distance along the view axis (camera z) in metres; it is not a unit vector. */
VD_API vd_ray vd_camera_ray(const vd_camera *camera, double x, double y);

/* Projects a world point: returns true and the picture position and distance along the view axis
 * when it lies in front of the eye (perspective: z > 0). */
VD_API bool vd_camera_project(const vd_camera *camera, vd_vec3 point, double *x, double *y,
                              double *z);

/* Returns the matrix from the world, relative to the eye, to homogeneous picture space: a point
 * lands at the pixel position (x / w, y / w) with depth z / w; w is the distance along the view
 * axis (perspective: infinitely far away is depth 0) or 1 (orthographic). The principal point may
 * lie anywhere: an off-axis view is a lens. */
VD_API vd_matrix vd_camera_matrix(const vd_camera *camera);

/* Depth of a distance z along the view axis, and back (infinity for depth 0). */
VD_API float vd_camera_depth(const vd_camera *camera, double z);
VD_API double vd_camera_distance(const vd_camera *camera, float depth);

/* The half-spaces that bound what the picture can show, through the eye: left, right, top, bottom,
 * near. A point p is inside when dot(normal, p) >= offset for all of them. */
typedef struct vd_plane {
    vd_vec3 normal;
    double offset;
} vd_plane;

typedef struct vd_frustum {
    vd_plane planes[5];
} vd_frustum;

VD_API vd_frustum vd_camera_frustum(const vd_camera *camera, int width, int height);

/* True when the axis-aligned box [min, max] may touch the frustum (conservative: a box outside
 * none of the planes counts as touching). */
VD_API bool vd_frustum_touches_box(const vd_frustum *frustum, vd_vec3 min, vd_vec3 max);

VD_END_DECLARATIONS

#endif

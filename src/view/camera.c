#include <math.h>
#include <stddef.h>
#include <veduta/camera.h>
#include "core/real.h"

vd_lens vd_lens_from_fov(double fov_y_rad, int width, int height) {
    double f = 0.5 * height / vd_tan(0.5 * fov_y_rad);
    vd_lens lens = {f, f, 0.5 * width, 0.5 * height};
    return lens;
}

/* Camera axes in the world at heading, pitch and roll 0: right = east, down = −up, forward = north.
 */
vd_quat vd_orientation_from_angles(double heading_rad, double pitch_rad, double roll_rad) {
    const vd_quat level =
        vd_quat_from_axes(vd_vec3_make(1, 0, 0), vd_vec3_make(0, 0, -1), vd_vec3_make(0, 1, 0));
    /* Heading turns clockwise about up, pitch lifts about the right axis, roll turns clockwise
     * about the view axis (camera z, x to the right, y down: positive is clockwise from behind). */
    vd_quat heading = vd_quat_from_axis_angle(vd_vec3_make(0, 0, 1), -heading_rad);
    vd_quat pitch = vd_quat_from_axis_angle(vd_vec3_make(1, 0, 0), pitch_rad);
    vd_quat roll = vd_quat_from_axis_angle(vd_vec3_make(0, 0, 1), roll_rad);
    vd_quat q = vd_quat_multiply(heading, vd_quat_multiply(pitch, level));
    return vd_quat_normalize(vd_quat_multiply(q, roll));
}

static double wrap_turn(double angle) {
    return angle < 0.0 ? angle + 2.0 * VD_PI : angle;
}

void vd_orientation_to_angles(vd_quat orientation, double *heading_rad, double *pitch_rad,
                              double *roll_rad) {
    vd_vec3 right = vd_quat_rotate(orientation, vd_vec3_make(1, 0, 0));
    vd_vec3 down = vd_quat_rotate(orientation, vd_vec3_make(0, 1, 0));
    vd_vec3 forward = vd_quat_rotate(orientation, vd_vec3_make(0, 0, 1));
    double level = sqrt(forward.x * forward.x + forward.y * forward.y);
    *pitch_rad = vd_atan2(forward.z, level);
    if (level < 1e-9) {
        /* Straight up or down: the picture's right edge tells the heading. */
        *heading_rad = wrap_turn(vd_atan2(-right.y, right.x));
        *roll_rad = 0.0;
        return;
    }
    *heading_rad = wrap_turn(vd_atan2(forward.x, forward.y));
    *roll_rad = vd_atan2(-right.z, -down.z);
}

vd_quat vd_orientation_look_at(vd_vec3 eye, vd_vec3 target) {
    vd_vec3 d = vd_vec3_subtract(target, eye);
    double level = sqrt(d.x * d.x + d.y * d.y);
    double heading = level > 0.0 ? vd_atan2(d.x, d.y) : 0.0;
    return vd_orientation_from_angles(heading, vd_atan2(d.z, level), 0.0);
}

static vd_status check_finite(const char *field, double value) {
    return isfinite(value)
               ? vd_success()
               : vd_failure(VD_ERROR_ARGUMENT, "the camera's %s is %g; give a finite number", field,
                            value);
}

vd_status vd_camera_validate(const vd_camera *camera) {
    const struct {
        const char *name;
        double value;
    } fields[] = {{"eye x", camera->eye.x},
                  {"eye y", camera->eye.y},
                  {"eye z", camera->eye.z},
                  {"orientation x", camera->orientation.x},
                  {"orientation y", camera->orientation.y},
                  {"orientation z", camera->orientation.z},
                  {"orientation w", camera->orientation.w},
                  {"lens fx", camera->lens.fx},
                  {"lens fy", camera->lens.fy},
                  {"lens cx", camera->lens.cx},
                  {"lens cy", camera->lens.cy},
                  {"near distance", camera->near_m},
                  {"far distance", camera->far_m}};
    for (size_t i = 0; i < sizeof fields / sizeof fields[0]; i++) {
        vd_status status = check_finite(fields[i].name, fields[i].value);
        if (status.code != VD_OK) {
            return status;
        }
    }
    const vd_quat q = camera->orientation;
    double norm = (q.x * q.x + q.y * q.y) + (q.z * q.z + q.w * q.w);
    if (fabs(norm - 1.0) > 1e-6) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "the camera's orientation has the length %g; give a unit quaternion",
                          sqrt(norm));
    }
    if (camera->projection < 0 || camera->projection >= VD_PROJECTION_COUNT) {
        return vd_failure(VD_ERROR_ARGUMENT, "the camera's projection %d is unknown",
                          (int)camera->projection);
    }
    if (!(camera->lens.fx > 0.0) || !(camera->lens.fy > 0.0)) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "the camera's focal lengths are %g and %g; both must be above 0",
                          camera->lens.fx, camera->lens.fy);
    }
    if (!(camera->near_m > 0.0)) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "the camera's near distance is %g m; it must be above 0", camera->near_m);
    }
    if (camera->projection == VD_PROJECTION_ORTHOGRAPHIC && !(camera->far_m > camera->near_m)) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "the camera's far distance is %g m; it must be above near, %g m",
                          camera->far_m, camera->near_m);
    }
    return vd_success();
}

vd_ray vd_camera_ray(const vd_camera *camera, double x, double y) {
    double u = (x - camera->lens.cx) / camera->lens.fx;
    double v = (y - camera->lens.cy) / camera->lens.fy;
    vd_ray ray;
    if (camera->projection == VD_PROJECTION_ORTHOGRAPHIC) {
        vd_vec3 offset = vd_quat_rotate(camera->orientation, vd_vec3_make(u, v, 0.0));
        ray.origin = vd_vec3_add(camera->eye, offset);
        ray.direction = vd_quat_rotate(camera->orientation, vd_vec3_make(0.0, 0.0, 1.0));
    } else {
        ray.origin = camera->eye;
        ray.direction = vd_quat_rotate(camera->orientation, vd_vec3_make(u, v, 1.0));
    }
    return ray;
}

bool vd_camera_project(const vd_camera *camera, vd_vec3 point, double *x, double *y, double *z) {
    vd_quat q = camera->orientation;
    vd_quat inverse = {-q.x, -q.y, -q.z, q.w};
    vd_vec3 p = vd_quat_rotate(inverse, vd_vec3_subtract(point, camera->eye));
    *z = p.z;
    if (camera->projection == VD_PROJECTION_ORTHOGRAPHIC) {
        *x = camera->lens.cx + camera->lens.fx * p.x;
        *y = camera->lens.cy + camera->lens.fy * p.y;
        return true;
    }
    if (!(p.z > 0.0)) {
        return false;
    }
    *x = camera->lens.cx + camera->lens.fx * (p.x / p.z);
    *y = camera->lens.cy + camera->lens.fy * (p.y / p.z);
    return true;
}

vd_matrix vd_camera_matrix(const vd_camera *camera) {
    const vd_lens *lens = &camera->lens;
    vd_matrix project = {{{lens->fx, 0.0, lens->cx, 0.0},
                          {0.0, lens->fy, lens->cy, 0.0},
                          {0.0, 0.0, 0.0, camera->near_m},
                          {0.0, 0.0, 1.0, 0.0}}};
    if (camera->projection == VD_PROJECTION_ORTHOGRAPHIC) {
        project = (vd_matrix){{{lens->fx, 0.0, 0.0, lens->cx},
                               {0.0, lens->fy, 0.0, lens->cy},
                               {0.0, 0.0, -1.0 / camera->far_m, 1.0},
                               {0.0, 0.0, 0.0, 1.0}}};
    }
    const vd_quat q = camera->orientation;
    const vd_matrix turn = vd_matrix_rotation((vd_quat){-q.x, -q.y, -q.z, q.w});
    return vd_matrix_multiply(&project, &turn);
}

float vd_camera_depth(const vd_camera *camera, double z) {
    return camera->projection == VD_PROJECTION_ORTHOGRAPHIC ? (float)(1.0 - z / camera->far_m)
                                                            : (float)(camera->near_m / z);
}

double vd_camera_distance(const vd_camera *camera, float depth) {
    if (camera->projection == VD_PROJECTION_ORTHOGRAPHIC) {
        return depth > 0.0f ? (1.0 - (double)depth) * camera->far_m : (double)INFINITY;
    }
    return depth > 0.0f ? camera->near_m / (double)depth : (double)INFINITY;
}

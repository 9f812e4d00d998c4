#include <veduta/camera.h>

static vd_plane plane_through(vd_vec3 point, vd_vec3 normal) {
    vd_plane plane = {normal, vd_vec3_dot(normal, point)};
    return plane;
}

vd_frustum vd_camera_frustum(const vd_camera *camera, int width, int height) {
    const double left = -camera->lens.cx / camera->lens.fx;
    const double right = (width - camera->lens.cx) / camera->lens.fx;
    const double top = -camera->lens.cy / camera->lens.fy;
    const double bottom = (height - camera->lens.cy) / camera->lens.fy;
    /* In camera space a side's plane holds the eye and the picture's edge: inside is where
     * x >= left·z, and so on. Orthographic sides are parallel: x >= left. */
    const bool parallel = camera->projection == VD_PROJECTION_ORTHOGRAPHIC;
    const double k = parallel ? 0.0 : 1.0;
    const vd_vec3 normals[5] = {
        {1, 0, -left * k}, {-1, 0, right * k}, {0, 1, -top * k}, {0, -1, bottom * k}, {0, 0, 1}};
    const vd_vec3 points[5] = {{left, 0, 0}, {right, 0, 0}, {0, top, 0}, {0, bottom, 0}, {0, 0, 0}};
    vd_frustum frustum;
    for (int i = 0; i < 5; i++) {
        vd_vec3 normal = vd_vec3_normalize(vd_quat_rotate(camera->orientation, normals[i]));
        vd_vec3 offset = vd_vec3_make(0, 0, 0);
        if (i == 4) {
            offset = vd_vec3_make(0, 0, camera->near_m);
        } else if (parallel) {
            offset = points[i];
        }
        vd_vec3 point = vd_vec3_add(camera->eye, vd_quat_rotate(camera->orientation, offset));
        frustum.planes[i] = plane_through(point, normal);
    }
    return frustum;
}

bool vd_frustum_touches_box(const vd_frustum *frustum, vd_vec3 min, vd_vec3 max) {
    for (int i = 0; i < 5; i++) {
        const vd_plane *plane = &frustum->planes[i];
        vd_vec3 farthest = {plane->normal.x >= 0 ? max.x : min.x,
                            plane->normal.y >= 0 ? max.y : min.y,
                            plane->normal.z >= 0 ? max.z : min.z};
        if (vd_vec3_dot(plane->normal, farthest) < plane->offset) {
            return false;
        }
    }
    return true;
}

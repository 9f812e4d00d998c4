/* raster_explain.c: why a picture shows nothing. */
#include "raster/raster_internal.h"

/* The bounds of a draw's eight corners in the world. */
static void world_bounds(const vd_draw *draw, vd_vec3 *min, vd_vec3 *max) {
    vd_vec3 low, high;
    vd_mesh_bounds(draw->mesh, &low, &high);
    for (int i = 0; i < 8; i++) {
        const vd_vec3 corner = {(i & 1) != 0 ? high.x : low.x, (i & 2) != 0 ? high.y : low.y,
                                (i & 4) != 0 ? high.z : low.z};
        const vd_vec3 p = vd_matrix_transform(&draw->world_from_mesh, corner);
        if (i == 0) {
            *min = *max = p;
        }
        min->x = p.x < min->x ? p.x : min->x;
        min->y = p.y < min->y ? p.y : min->y;
        min->z = p.z < min->z ? p.z : min->z;
        max->x = p.x > max->x ? p.x : max->x;
        max->y = p.y > max->y ? p.y : max->y;
        max->z = p.z > max->z ? p.z : max->z;
    }
}

vd_status vd_raster_explain_empty(const vd_raster_def *def, const vd_camera *camera,
                                  const vd_draw *draws, int count, int width, int height) {
    bool any = false, touches = false, behind_near = false;
    bool inside = false, all_back = true;
    const vd_frustum frustum = vd_camera_frustum(camera, width, height);
    vd_frustum at_eye = frustum;
    at_eye.planes[4].offset -= camera->near_m;
    const vd_vec3 e = camera->eye;
    for (int i = 0; i < count; i++) {
        if (draws[i].mesh == NULL || draws[i].mesh->primitive_count == 0) {
            continue;
        }
        any = true;
        vd_vec3 min, max;
        world_bounds(&draws[i], &min, &max);
        const bool here = vd_frustum_touches_box(&frustum, min, max);
        touches = touches || here;
        behind_near = behind_near || (!here && vd_frustum_touches_box(&at_eye, min, max));
        inside = inside || (e.x > min.x && e.x < max.x && e.y > min.y && e.y < max.y &&
                            e.z > min.z && e.z < max.z);
        all_back = all_back && draws[i].cull != VD_CULL_NONE;
    }
    if (!any) {
        return vd_failure(VD_ERROR_EMPTY,
                          "the picture is empty: there is no triangle, line or point to draw");
    }
    if (!touches && behind_near) {
        return vd_failure(VD_ERROR_EMPTY,
                          "the picture is empty: everything lies before the near plane, %.10g m "
                          "from the camera, where nothing is drawn; bring it nearer",
                          camera->near_m);
    }
    if (!touches) {
        return vd_failure(VD_ERROR_EMPTY,
                          "the picture is empty: the camera at %.10g, %.10g, %.10g m looks away "
                          "from everything; turn or move it",
                          e.x, e.y, e.z);
    }
    if (inside && all_back) {
        return vd_failure(VD_ERROR_EMPTY,
                          "the picture is empty: the camera is inside the model and sees only back "
                          "faces, which are culled; move it out or draw both sides");
    }
    if (def->far_m > 0.0) {
        return vd_failure(VD_ERROR_EMPTY,
                          "the picture is empty: everything is culled, too small, or farther than "
                          "the far distance of %.10g m; raise it or draw both sides",
                          def->far_m);
    }
    return vd_failure(VD_ERROR_EMPTY,
                      "the picture is empty: every face is turned away and culled, or falls "
                      "between samples; draw both sides, turn the winding round, or come nearer");
}

/* serve_world.c: /world.json, and cameras of /frame.png. */
#include "serve_world.h"

#include <jansson.h>
#include <math.h>
#include <string.h>
#include <veduta/server.h>
#include <veduta/wire.h>

/* ---- cameras ----------------------------------------------------------------------------------*/

vd_status vd_serve_camera(void *user, const char *text, int width, int height, vd_camera *out) {
    const vd_serve_world *w = user;
    if (text == NULL) {
        *out = w->view.camera;
        if (width != w->settings->width || height != w->settings->height) {
            out->lens = vd_lens_from_fov(w->view.exact.fov * VD_RADIANS_PER_DEGREE, width, height);
        }
        return vd_success();
    }
    double v[6] = {0, 0, 0, 0, 0, w->view.exact.fov};
    const int count = vd_read_numbers(text, v, 6);
    if (count < 5 || !(fabs(v[0]) <= 1e9 && fabs(v[1]) <= 1e9 && fabs(v[2]) <= 1e9) ||
        !(fabs(v[3]) <= 3600.0) || !(fabs(v[4]) <= 90.0) || !(v[5] >= 0.01 && v[5] <= 179.0)) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "camera is X,Y,Z,HEADING,PITCH and perhaps FOV: metres up to 1e9, and "
                          "degrees, pitch -90 to 90, field of view 0.01 to 179");
    }
    vd_camera_settings camera = w->view.exact;
    camera.spelling = VD_SPELLING_ANGLES;
    camera.eye = (vd_position){VD_POSITION_WORLD, {v[0], v[1], v[2]}};
    camera.heading = v[3];
    camera.pitch = v[4];
    camera.roll = 0.0;
    camera.fov = v[5];
    vd_view view;
    const bool terrain = w->scene->scene.terrain != NULL;
    const vd_status status =
        vd_view_make(&w->scene->scene, &camera, terrain ? w->settings->exaggeration : 1.0,
                     terrain && w->scene->look.curvature, width, height, &view);
    if (status.code == VD_OK) {
        *out = view.camera;
    }
    return status;
}

/* ---- /world.json ------------------------------------------------------------------------------*/

static json_t *vector(vd_vec3 v) {
    return json_pack("[f, f, f]", v.x, v.y, v.z);
}

/* Terrain and all that stands on it; null where there is nothing with an end. */
static json_t *bounds_of(const vd_serve_world *w) {
    vd_vec3 min, max, low, high;
    bool any = vd_world_bounds(w->scene->world, &min, &max);
    if (w->scene->look.heightfield != NULL) {
        vd_heightfield_bounds(w->scene->look.heightfield, &low, &high);
        low.z *= w->settings->exaggeration;
        high.z *= w->settings->exaggeration;
        min = any ? vd_vec3_min(min, low) : low;
        max = any ? vd_vec3_max(max, high) : high;
        any = true;
    }
    return any && isfinite(min.x + min.y + min.z + max.x + max.y + max.z)
               ? json_pack("{s: o, s: o}", "min", vector(min), "max", vector(max))
               : json_null();
}

static json_t *camera_of(const vd_serve_world *w) {
    const vd_camera *c = &w->view.camera;
    double heading, pitch, roll;
    vd_orientation_to_angles(c->orientation, &heading, &pitch, &roll);
    const double degrees = 1.0 / VD_RADIANS_PER_DEGREE;
    return json_pack(
        "{s: o, s: [f, f, f, f], s: f, s: f, s: f, s: f, s: f, s: [f, f, f, f], s: [i, "
        "i]}",
        "eye", vector(c->eye), "orientation", c->orientation.x, c->orientation.y, c->orientation.z,
        c->orientation.w, "heading", heading * degrees, "pitch", pitch * degrees, "roll",
        roll * degrees, "fov", w->view.exact.fov, "near", c->near_m, "lens", c->lens.fx, c->lens.fy,
        c->lens.cx, c->lens.cy, "size", w->settings->width, w->settings->height);
}

char *vd_serve_world_json(const vd_serve_world *w) {
    json_t *root = json_pack("{s: s, s: s, s: i, s: {s: s, s: s, s: i}, s: o, s: o, s: I}", "name",
                             w->name, "version", vd_version(), "wire", VD_WIRE_VERSION, "socket",
                             "path", VD_SERVER_SOCKET, "protocol", VD_SERVER_PROTOCOL,
                             "batch_bytes", (int)VD_WIRE_BATCH_BYTES, "camera", camera_of(w),
                             "bounds", bounds_of(w), "objects", (json_int_t)w->scene->object_count);
    char *text = root != NULL ? json_dumps(root, JSON_INDENT(2)) : NULL;
    json_decref(root);
    return text;
}

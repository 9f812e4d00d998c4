/* model_view.c: the framing of a model, and cameras by position. */
#include "model_view.h"

#include <math.h>

#include "framing.h"

/* Shares of the half picture that a framed model fills. */
static const double filled = 0.9;

/* Nothing nearer than this share of the way to the model is drawn, unless --near says it. Depth is
 * a reversed float, whose precision a small one does not harm. */
static const double near_share = 1e-3;

vd_camera_settings vd_model_camera_default(void) {
    vd_camera_settings settings = vd_camera_settings_default();
    settings.azimuth = VD_MODEL_AZIMUTH;
    settings.elevation = VD_MODEL_ELEVATION;
    settings.near_m = 0.0;
    return settings;
}

static vd_vec3 corner(vd_vec3 min, vd_vec3 max, int i) {
    return vd_vec3_make((i & 1) != 0 ? max.x : min.x, (i & 2) != 0 ? max.y : min.y,
                        (i & 4) != 0 ? max.z : min.z);
}

vd_placed_model vd_place_model(const vd_model *model, vd_up up) {
    vd_placed_model placed = {.model = model, .world_from_model = vd_matrix_identity()};
    if (up == VD_UP_Y || (up == VD_UP_AUTO && !model->z_up)) {
        placed.world_from_model = vd_model_upright();
    }
    vd_vec3 min = {0, 0, 0}, max = {0, 0, 0};
    vd_model_bounds(model, &min, &max);
    for (int i = 0; i < 8; i++) {
        const vd_vec3 p = vd_matrix_transform(&placed.world_from_model, corner(min, max, i));
        if (i == 0) {
            placed.min = placed.max = p;
        }
        placed.min =
            vd_vec3_make(fmin(placed.min.x, p.x), fmin(placed.min.y, p.y), fmin(placed.min.z, p.z));
        placed.max =
            vd_vec3_make(fmax(placed.max.x, p.x), fmax(placed.max.y, p.y), fmax(placed.max.z, p.z));
    }
    return placed;
}

double vd_placed_diagonal(const vd_placed_model *placed) {
    return vd_vec3_length(vd_vec3_subtract(placed->max, placed->min));
}

static void frame_vertices(vd_framing *f, const vd_placed_model *placed) {
    for (int k = 0; k < VD_TOPOLOGY_COUNT; k++) {
        const vd_mesh *mesh = placed->model->meshes[k];
        for (uint32_t i = 0; mesh != NULL && i < mesh->vertex_count; i++) {
            const vd_vec3 local = {(double)vd_mesh_positions(mesh, 0)[i],
                                   (double)vd_mesh_positions(mesh, 1)[i],
                                   (double)vd_mesh_positions(mesh, 2)[i]};
            const vd_vec3 p = vd_vec3_add(mesh->anchor, local);
            vd_framing_add(f, vd_matrix_transform(&placed->world_from_model, p));
        }
    }
}

static void set_world(vd_position *position, vd_vec3 p) {
    *position = (vd_position){VD_POSITION_WORLD, {p.x, p.y, p.z}};
}

/* An orbit without a distance frames all of the model. Something without extent is seen from as far
 * as it is large elsewhere: a metre. */
static void place_orbit(const vd_placed_model *placed, vd_framing *f, vd_view *view) {
    vd_camera_settings *exact = &view->exact;
    const bool flat = exact->projection == VD_PROJECTION_ORTHOGRAPHIC;
    const bool has_target = exact->target.kind != VD_POSITION_NONE;
    const vd_vec3 middle = vd_vec3_scale(vd_vec3_add(placed->min, placed->max), 0.5);
    const double diagonal = vd_placed_diagonal(placed);
    const double least = diagonal > 0.0 ? 1e-3 * diagonal : 1.0;
    const double *v = exact->target.v;
    vd_vec3 target = has_target ? vd_vec3_make(v[0], v[1], v[2]) : middle;
    if (exact->distance_m == 0.0) {
        f->target = target;
        vd_framing_clear(f);
        frame_vertices(f, placed);
        if (has_target) {
            exact->distance_m = fmax(f->reach, least);
        } else {
            const vd_vec3 eye = vd_framing_eye(f, flat, middle);
            exact->distance_m = fmax(vd_vec3_dot(f->z_axis, vd_vec3_subtract(middle, eye)), least);
            target = vd_vec3_add(eye, vd_vec3_scale(f->z_axis, exact->distance_m));
        }
    }
    set_world(&exact->target, target);
    view->camera.eye = vd_vec3_subtract(target, vd_vec3_scale(f->z_axis, exact->distance_m));
}

static vd_status place_eye(const vd_placed_model *placed, vd_view *view) {
    vd_camera_settings *exact = &view->exact;
    vd_camera *camera = &view->camera;
    camera->eye = vd_vec3_make(exact->eye.v[0], exact->eye.v[1], exact->eye.v[2]);
    if (exact->spelling == VD_SPELLING_ANGLES) {
        return vd_success();
    }
    if (exact->target.kind == VD_POSITION_NONE) {
        set_world(&exact->target, vd_vec3_scale(vd_vec3_add(placed->min, placed->max), 0.5));
    }
    const double *v = exact->target.v;
    const vd_vec3 target = vd_vec3_make(v[0], v[1], v[2]);
    exact->distance_m = vd_vec3_length(vd_vec3_subtract(target, camera->eye));
    if (exact->distance_m == 0.0) {
        return vd_failure(VD_ERROR_ARGUMENT, "--eye and --target are the same place, which is no "
                                             "direction; move one of them");
    }
    const vd_quat roll =
        vd_quat_from_axis_angle(vd_vec3_make(0, 0, 1), exact->roll * VD_RADIANS_PER_DEGREE);
    const vd_quat look = vd_orientation_look_at(camera->eye, target);
    camera->orientation =
        exact->roll == 0.0 ? look : vd_quat_normalize(vd_quat_multiply(look, roll));
    return vd_success();
}

/* An orthographic picture keeps the scale that perspective has at the target; its eye stands back
 * far enough that all of the model is before it. --far counts from where the camera was put. */
static void make_orthographic(const vd_framing *f, vd_view *view, double nearest, double farthest) {
    vd_camera *camera = &view->camera;
    const double room = 0.05 * (farthest - nearest) + 1e-3 * view->exact.distance_m;
    const double back = fmax(0.0, room - nearest);
    camera->projection = VD_PROJECTION_ORTHOGRAPHIC;
    camera->lens.fx /= view->exact.distance_m;
    camera->lens.fy /= view->exact.distance_m;
    camera->eye = vd_vec3_subtract(camera->eye, vd_vec3_scale(f->z_axis, back));
    camera->far_m =
        back + (view->exact.far_m > 0.0 ? view->exact.far_m : fmax(farthest, 0.0) + room);
}

static vd_quat orientation_of(const vd_camera_settings *s) {
    const bool orbit = s->spelling == VD_SPELLING_ORBIT;
    return vd_orientation_from_angles((orbit ? s->azimuth : s->heading) * VD_RADIANS_PER_DEGREE,
                                      (orbit ? -s->elevation : s->pitch) * VD_RADIANS_PER_DEGREE,
                                      s->roll * VD_RADIANS_PER_DEGREE);
}

vd_status vd_model_view_make(const vd_placed_model *placed, const vd_camera_settings *settings,
                             int width, int height, vd_view *out, double *nearest,
                             double *farthest) {
    vd_view view = {.exact = *settings};
    view.camera.lens = vd_lens_from_fov(settings->fov * VD_RADIANS_PER_DEGREE, width, height);
    view.camera.orientation = orientation_of(settings);
    vd_status status = vd_success();
    if (settings->spelling != VD_SPELLING_ORBIT) {
        status = place_eye(placed, &view);
    }
    vd_framing f = vd_framing_start(view.camera.orientation, view.camera.lens, width, height,
                                    filled, filled, filled);
    if (settings->spelling == VD_SPELLING_ORBIT) {
        place_orbit(placed, &f, &view);
    }
    if (status.code != VD_OK) {
        return status;
    }
    vd_framing_clear(&f);
    frame_vertices(&f, placed);
    const double eye = vd_vec3_dot(f.z_axis, view.camera.eye);
    *nearest = f.box[2][0] - eye;
    *farthest = f.box[2][1] - eye;
    if (view.exact.near_m == 0.0) {
        const double diagonal = vd_placed_diagonal(placed);
        view.exact.near_m = near_share * (*nearest > 0.0   ? *nearest
                                          : diagonal > 0.0 ? near_share * diagonal
                                                           : 1.0);
    }
    view.camera.near_m = view.exact.near_m;
    if (settings->projection == VD_PROJECTION_ORTHOGRAPHIC) {
        const double before = vd_vec3_dot(f.z_axis, view.camera.eye);
        make_orthographic(&f, &view, *nearest, *farthest);
        const double back = before - vd_vec3_dot(f.z_axis, view.camera.eye);
        *nearest += back;
        *farthest += back;
    }
    status = vd_camera_validate(&view.camera);
    if (status.code == VD_OK) {
        *out = view;
    }
    return status;
}

json_t *vd_model_view_describe(const vd_view *view) {
    const vd_camera *camera = &view->camera;
    double heading = 0.0, pitch = 0.0, roll = 0.0;
    char flags[1024];
    vd_orientation_to_angles(camera->orientation, &heading, &pitch, &roll);
    vd_view_flags(view, flags, sizeof flags);
    return json_pack("{s: s, s: o, s: [f, f, f], s: f, s: f, s: f, s: f}", "flags", flags,
                     "options", vd_view_json(view), "eye_m", camera->eye.x, camera->eye.y,
                     camera->eye.z, "heading", heading / VD_RADIANS_PER_DEGREE, "pitch",
                     pitch / VD_RADIANS_PER_DEGREE, "roll", roll / VD_RADIANS_PER_DEGREE, "fov",
                     view->exact.fov);
}

/* view.c: camera spellings, and the framing of a terrain.
 *
 * The Earth's curvature lowers points by their distance from the eye, so the pass over the terrain
 * that frames it (framing.h) is repeated.
 */
#include "view.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "framing.h"

vd_camera_settings vd_camera_settings_default(void) {
    return (vd_camera_settings){.azimuth = strtod(vd_render_table[OPTION_AZIMUTH].fallback, NULL),
                                .elevation =
                                    strtod(vd_render_table[OPTION_ELEVATION].fallback, NULL),
                                .fov = strtod(vd_render_table[OPTION_FOV].fallback, NULL),
                                .near_m = strtod(vd_render_table[OPTION_NEAR].fallback, NULL)};
}

/* The box of the terrain, not exaggerated; of a world without one that of its objects. */
static void scene_bounds(const vd_scene *scene, vd_vec3 *low, vd_vec3 *high) {
    if (scene->terrain != NULL) {
        vd_heightfield_bounds(scene->terrain, low, high);
    } else {
        *low = scene->low;
        *high = scene->high;
    }
}

/* The height of the ground, not exaggerated; −infinity where there is none. */
static double scene_ground(const vd_scene *scene, double x, double y) {
    return scene->terrain != NULL ? vd_heightfield_height_at(scene->terrain, x, y) : -INFINITY;
}

/* What the framing needs to know. */
typedef struct framing {
    const vd_scene *scene;
    double exaggeration;
    bool curvature;
    vd_vec3 eye; /* of the last pass; curvature is seen from here */
    vd_framing frame;
} framing;

static void frame_point(framing *f, double column, double row, double height) {
    const double *w = f->scene->terrain->world_from_sample;
    vd_vec3 p = {w[0] + column * w[1] + row * w[2], w[3] + column * w[4] + row * w[5],
                 height * f->exaggeration};
    if (f->curvature) {
        double dx = p.x - f->eye.x, dy = p.y - f->eye.y;
        p.z -= vd_curvature_drop(sqrt(dx * dx + dy * dy));
    }
    vd_framing_add(&f->frame, p);
}

/* Passes over the terrain: the corners of every block of a coarse level with their own heights, and
 * the block's middle with its maximum. */
static void frame_terrain(framing *f) {
    const vd_heightfield *h = f->scene->terrain;
    int level = 0;
    while (level + 1 < h->level_count &&
           (h->levels[level].width > 64 || h->levels[level].height > 64)) {
        level++;
    }
    const vd_heightfield_level *l = &h->levels[level];
    const float *maxima = vd_heightfield_level_data(h, level);
    for (int r = 0; r < l->height; r++) {
        for (int c = 0; c < l->width; c++) {
            float highest = maxima[(size_t)r * l->stride + (size_t)c];
            if (!isfinite(highest)) {
                continue;
            }
            int first_column = c << level, first_row = r << level;
            int last_column = first_column + (1 << level) - 1;
            int last_row = first_row + (1 << level) - 1;
            last_column = last_column < h->width ? last_column : h->width - 1;
            last_row = last_row < h->height ? last_row : h->height - 1;
            frame_point(f, 0.5 * (first_column + last_column), 0.5 * (first_row + last_row),
                        highest);
            for (int corner = 0; corner < 4; corner++) {
                int column = corner & 1 ? last_column : first_column;
                int row = corner & 2 ? last_row : first_row;
                float height = vd_heightfield_at(h, column, row);
                if (isfinite(height)) {
                    frame_point(f, column, row, height);
                }
            }
        }
    }
}

/* The corners of the box of all objects. */
static void frame_objects(framing *f) {
    const vd_vec3 low = f->scene->low, high = f->scene->high;
    for (int i = 0; i < 8; i++) {
        vd_framing_add(&f->frame, vd_vec3_make(i & 1 ? high.x : low.x, i & 2 ? high.y : low.y,
                                               i & 4 ? high.z : low.z));
    }
}

static vd_vec3 scene_middle(const vd_scene *scene, double exaggeration) {
    vd_vec3 low, high;
    scene_bounds(scene, &low, &high);
    vd_vec3 middle = vd_vec3_scale(vd_vec3_add(low, high), 0.5);
    double ground = scene_ground(scene, middle.x, middle.y);
    middle.z = (isfinite(ground) ? ground : middle.z) * exaggeration;
    return middle;
}

static double scene_diagonal(const vd_scene *scene, double exaggeration) {
    vd_vec3 low, high;
    scene_bounds(scene, &low, &high);
    vd_vec3 size = vd_vec3_subtract(high, low);
    size.z *= exaggeration;
    return vd_vec3_length(size);
}

static framing framing_start(const vd_scene *scene, double exaggeration, bool curvature,
                             vd_quat orientation, vd_lens lens, int width, int height) {
    /* The terrain fills 94 % of the width and stays below the upper tenth, which is the sky's. */
    framing made = {.scene = scene,
                    .exaggeration = exaggeration,
                    .curvature = curvature,
                    .frame = vd_framing_start(orientation, lens, width, height, 0.94, 0.80, 0.94)};
    /* Where the width decides there is height to spare: more of it goes to the sky. */
    made.frame.low_share = 0.7;
    return made;
}

/* Finds target and distance of an orbit that lacks the distance, and maybe the target. */
static void frame_orbit(framing *f, const vd_scene *scene, vd_camera_settings *exact,
                        bool has_target, vd_vec3 *target) {
    vd_vec3 middle = scene_middle(scene, f->exaggeration);
    bool flat = exact->projection == VD_PROJECTION_ORTHOGRAPHIC;
    /* An orthographic picture's scale follows from the distance alone: heights do not matter. */
    double least = flat ? 1e-9 : 1e-3 * (1.0 + scene_diagonal(scene, f->exaggeration));
    const vd_vec3 z_axis = f->frame.z_axis;
    f->frame.target = has_target ? *target : middle;
    f->eye = f->frame.target;
    for (int pass = 0; pass < 4; pass++) {
        vd_framing_clear(&f->frame);
        (scene->terrain != NULL ? frame_terrain : frame_objects)(f);
        if (has_target) {
            exact->distance_m = fmax(f->frame.reach, least);
            f->eye = vd_vec3_subtract(*target, vd_vec3_scale(z_axis, exact->distance_m));
        } else {
            f->eye = vd_framing_eye(&f->frame, flat, middle);
        }
    }
    if (has_target) {
        return;
    }
    exact->distance_m = fmax(vd_vec3_dot(z_axis, vd_vec3_subtract(middle, f->eye)), least);
    *target = vd_vec3_add(f->eye, vd_vec3_scale(z_axis, exact->distance_m));
}

/* Turns a position of any spelling into one in world metres. */
static vd_status resolve(const vd_scene *scene, double exaggeration, const char *option,
                         vd_position *position, vd_vec3 *out) {
    double *v = position->v;
    if (position->kind != VD_POSITION_WORLD) {
        double x = 0.0, y = 0.0;
        vd_status status = vd_scene_world_from_latlon(scene, v[0], v[1], &x, &y);
        if (status.code != VD_OK) {
            return vd_failure(status.code, "%s: %s", option, status.message);
        }
        double z = v[2] * exaggeration;
        if (position->kind == VD_POSITION_ABOVE_GROUND) {
            double ground = scene_ground(scene, x, y);
            if (!isfinite(ground)) {
                return vd_failure(VD_ERROR_ARGUMENT,
                                  "%s: %.10g,%.10g has no ground: it lies "
                                  "outside the map or in a hole; give another place, or a height "
                                  "above sea level, such as 3000masl",
                                  option, v[0], v[1]);
            }
            z = ground * exaggeration + v[2];
        }
        *position = (vd_position){VD_POSITION_WORLD, {x, y, z}};
    }
    *out = vd_vec3_make(v[0], v[1], v[2]);
    return vd_success();
}

static void set_world(vd_position *position, vd_vec3 p) {
    *position = (vd_position){VD_POSITION_WORLD, {p.x, p.y, p.z}};
}

static vd_status place_orbit(const vd_scene *scene, double exaggeration, bool curvature, int width,
                             int height, vd_view *view) {
    vd_camera_settings *exact = &view->exact;
    vd_camera *camera = &view->camera;
    vd_vec3 target = scene_middle(scene, exaggeration);
    bool has_target = exact->target.kind != VD_POSITION_NONE;
    if (has_target) {
        vd_status status = resolve(scene, exaggeration, "--target", &exact->target, &target);
        if (status.code != VD_OK) {
            return status;
        }
    }
    camera->orientation = vd_orientation_from_angles(exact->azimuth * VD_RADIANS_PER_DEGREE,
                                                     -exact->elevation * VD_RADIANS_PER_DEGREE,
                                                     exact->roll * VD_RADIANS_PER_DEGREE);
    if (exact->distance_m == 0.0) {
        framing f = framing_start(scene, exaggeration, curvature, camera->orientation, camera->lens,
                                  width, height);
        frame_orbit(&f, scene, exact, has_target, &target);
    }
    set_world(&exact->target, target);
    vd_vec3 forward = vd_quat_rotate(camera->orientation, vd_vec3_make(0, 0, 1));
    camera->eye = vd_vec3_subtract(target, vd_vec3_scale(forward, exact->distance_m));
    return vd_success();
}

static vd_status place_eye(const vd_scene *scene, double exaggeration, vd_view *view) {
    vd_camera_settings *exact = &view->exact;
    vd_camera *camera = &view->camera;
    bool geographic = exact->eye.kind != VD_POSITION_WORLD;
    vd_status status = resolve(scene, exaggeration, "--eye", &exact->eye, &camera->eye);
    if (status.code != VD_OK) {
        return status;
    }
    if (exact->spelling == VD_SPELLING_ANGLES) {
        camera->orientation = vd_orientation_from_angles(exact->heading * VD_RADIANS_PER_DEGREE,
                                                         exact->pitch * VD_RADIANS_PER_DEGREE,
                                                         exact->roll * VD_RADIANS_PER_DEGREE);
        return vd_success();
    }
    vd_vec3 target = scene_middle(scene, exaggeration);
    if (exact->target.kind != VD_POSITION_NONE) {
        status = resolve(scene, exaggeration, "--target", &exact->target, &target);
        if (status.code != VD_OK) {
            return status;
        }
    }
    set_world(&exact->target, target);
    exact->distance_m = vd_vec3_length(vd_vec3_subtract(target, camera->eye));
    if (exact->distance_m == 0.0) {
        return vd_failure(VD_ERROR_ARGUMENT, "--eye and --target are the same place, which is no "
                                             "direction; move one of them");
    }
    double dx = target.x - camera->eye.x, dy = target.y - camera->eye.y;
    if (geographic && sqrt(dx * dx + dy * dy) < 1e-6 * exact->distance_m) {
        vd_log(scene->context, VD_LOG_WARNING,
               "--target is straight %s --eye, so the camera looks straight %s from a distance of "
               "%.4g m; give another --target, or --heading",
               target.z < camera->eye.z ? "below" : "above",
               target.z < camera->eye.z ? "down" : "up", exact->distance_m);
    }
    /* look_at knows no roll: turning about the view axis comes before it. */
    vd_quat roll =
        vd_quat_from_axis_angle(vd_vec3_make(0, 0, 1), exact->roll * VD_RADIANS_PER_DEGREE);
    vd_quat look = vd_orientation_look_at(camera->eye, target);
    camera->orientation =
        exact->roll == 0.0 ? look : vd_quat_normalize(vd_quat_multiply(look, roll));
    return vd_success();
}

/* An orthographic picture keeps the scale that perspective has at the target; its eye stands back
 * far enough that every ray starts outside the terrain. */
static void make_orthographic(const vd_scene *scene, double exaggeration, vd_view *view) {
    vd_camera *camera = &view->camera;
    vd_vec3 forward = vd_quat_rotate(camera->orientation, vd_vec3_make(0, 0, 1));
    const double *t = view->exact.target.v;
    vd_vec3 target = vd_vec3_make(t[0], t[1], t[2]);
    double size = scene_diagonal(scene, exaggeration);
    double offset = vd_vec3_length(vd_vec3_subtract(scene_middle(scene, exaggeration), target));
    double back = view->exact.distance_m + size + offset;
    camera->projection = VD_PROJECTION_ORTHOGRAPHIC;
    camera->lens.fx /= view->exact.distance_m;
    camera->lens.fy /= view->exact.distance_m;
    camera->eye = vd_vec3_subtract(target, vd_vec3_scale(forward, back));
    camera->far_m = 2.0 * (back + size + offset);
}

vd_status vd_view_make(const vd_scene *scene, const vd_camera_settings *settings,
                       double exaggeration, bool curvature, int width, int height, vd_view *out) {
    vd_view view = {.exact = *settings};
    view.camera.lens = vd_lens_from_fov(settings->fov * VD_RADIANS_PER_DEGREE, width, height);
    view.camera.near_m = settings->near_m;
    vd_status status = settings->spelling == VD_SPELLING_ORBIT
                           ? place_orbit(scene, exaggeration, curvature, width, height, &view)
                           : place_eye(scene, exaggeration, &view);
    if (status.code != VD_OK) {
        return status;
    }
    if (settings->projection == VD_PROJECTION_ORTHOGRAPHIC) {
        make_orthographic(scene, exaggeration, &view);
    }
    status = vd_camera_validate(&view.camera);
    if (status.code == VD_OK) {
        *out = view;
    }
    return status;
}

vd_status vd_view_check_ground(const vd_scene *scene, const vd_view *view, double exaggeration) {
    vd_vec3 eye = view->camera.eye;
    double ground = scene_ground(scene, eye.x, eye.y) * exaggeration;
    if (view->camera.projection == VD_PROJECTION_ORTHOGRAPHIC || !(eye.z < ground)) {
        return vd_success();
    }
    const char *remedy = view->exact.spelling == VD_SPELLING_ORBIT
                             ? "raise --elevation or --target"
                             : "raise --eye, or give it as LAT,LON,2m above ground";
    return vd_failure(VD_ERROR_EMPTY, "the camera is %.4g m under ground and would see nothing; %s",
                      ground - eye.z, remedy);
}

double vd_view_clearance_m(const vd_scene *scene, const vd_view *view, double exaggeration) {
    vd_vec3 low, high, eye = view->camera.eye;
    scene_bounds(scene, &low, &high);
    vd_vec3 outside = {
        fmax(fmax(low.x - eye.x, eye.x - high.x), 0.0),
        fmax(fmax(low.y - eye.y, eye.y - high.y), 0.0),
        fmax(fmax(low.z * exaggeration - eye.z, eye.z - high.z * exaggeration), 0.0)};
    return vd_vec3_length(outside);
}

/* ---- the way back -----------------------------------------------------------------------------
 */

static size_t add(char *out, size_t out_bytes, size_t used, const char *text) {
    int length = snprintf(out + used, out_bytes - used, "%s%s", used > 0 ? " " : "", text);
    used += (size_t)length;
    return used < out_bytes ? used : out_bytes - 1;
}

static size_t add_position(char *out, size_t out_bytes, size_t used, const char *flag,
                           const vd_position *p) {
    char text[160], v[3][32];
    for (int i = 0; i < 3; i++) {
        vd_write_number(p->v[i], v[i]);
    }
    snprintf(text, sizeof text, "--%s %s,%s,%s", flag, v[0], v[1], v[2]);
    return add(out, out_bytes, used, text);
}

static size_t add_number(char *out, size_t out_bytes, size_t used, const char *flag, double v) {
    char text[80], number[32];
    vd_write_number(v, number);
    snprintf(text, sizeof text, "--%s %s", flag, number);
    return add(out, out_bytes, used, text);
}

void vd_view_flags(const vd_view *view, char *out, size_t out_bytes) {
    const vd_camera_settings *c = &view->exact;
    size_t used = 0;
    if (c->spelling != VD_SPELLING_ORBIT) {
        used = add_position(out, out_bytes, used, "eye", &c->eye);
    }
    if (c->spelling != VD_SPELLING_ANGLES) {
        used = add_position(out, out_bytes, used, "target", &c->target);
    }
    if (c->spelling == VD_SPELLING_ORBIT) {
        used = add_number(out, out_bytes, used, "azimuth", c->azimuth);
        used = add_number(out, out_bytes, used, "elevation", c->elevation);
        used = add_number(out, out_bytes, used, "distance", c->distance_m);
    } else if (c->spelling == VD_SPELLING_ANGLES) {
        used = add_number(out, out_bytes, used, "heading", c->heading);
        used = add_number(out, out_bytes, used, "pitch", c->pitch);
    }
    used = add_number(out, out_bytes, used, "roll", c->roll);
    used = add_number(out, out_bytes, used, "fov", c->fov);
    used = add_number(out, out_bytes, used, "near", c->near_m);
    if (c->far_m > 0.0) {
        used = add_number(out, out_bytes, used, "far", c->far_m);
    }
    if (c->projection == VD_PROJECTION_ORTHOGRAPHIC) {
        used = add(out, out_bytes, used, "--projection orthographic");
    }
    if (view->flattened) {
        add(out, out_bytes, used, "--curvature off");
    }
}

static json_t *position_json(const vd_position *p) {
    return json_pack("[f, f, f]", p->v[0], p->v[1], p->v[2]);
}

json_t *vd_view_json(const vd_view *view) {
    const vd_camera_settings *c = &view->exact;
    json_t *root = json_pack("{s: s}", "veduta", vd_version());
    bool failed = root == NULL;
    if (c->spelling != VD_SPELLING_ORBIT) {
        failed |= json_object_set_new(root, "eye", position_json(&c->eye)) != 0;
    }
    if (c->spelling != VD_SPELLING_ANGLES) {
        failed |= json_object_set_new(root, "target", position_json(&c->target)) != 0;
    }
    if (c->spelling == VD_SPELLING_ORBIT) {
        failed |= json_object_set_new(root, "azimuth", json_real(c->azimuth)) != 0;
        failed |= json_object_set_new(root, "elevation", json_real(c->elevation)) != 0;
        failed |= json_object_set_new(root, "distance", json_real(c->distance_m)) != 0;
    } else if (c->spelling == VD_SPELLING_ANGLES) {
        failed |= json_object_set_new(root, "heading", json_real(c->heading)) != 0;
        failed |= json_object_set_new(root, "pitch", json_real(c->pitch)) != 0;
    }
    failed |= json_object_set_new(root, "roll", json_real(c->roll)) != 0;
    failed |= json_object_set_new(root, "fov", json_real(c->fov)) != 0;
    failed |= json_object_set_new(root, "near", json_real(c->near_m)) != 0;
    if (c->far_m > 0.0) {
        failed |= json_object_set_new(root, "far", json_real(c->far_m)) != 0;
    }
    if (c->projection == VD_PROJECTION_ORTHOGRAPHIC) {
        failed |= json_object_set_new(root, "projection", json_string("orthographic")) != 0;
    }
    if (view->flattened) {
        failed |= json_object_set_new(root, "curvature", json_false()) != 0;
    }
    if (failed) {
        json_decref(root);
        return NULL;
    }
    return root;
}

json_t *vd_view_describe(const vd_scene *scene, const vd_view *view, double exaggeration) {
    const vd_camera *camera = &view->camera;
    double heading = 0.0, pitch = 0.0, roll = 0.0, latitude = 0.0, longitude = 0.0;
    vd_orientation_to_angles(camera->orientation, &heading, &pitch, &roll);
    char flags[1024];
    vd_view_flags(view, flags, sizeof flags);
    json_t *root = json_pack("{s: s, s: o, s: [f, f, f], s: f, s: f, s: f, s: f}", "flags", flags,
                             "options", vd_view_json(view), "eye_m", camera->eye.x, camera->eye.y,
                             camera->eye.z, "heading", heading / VD_RADIANS_PER_DEGREE, "pitch",
                             pitch / VD_RADIANS_PER_DEGREE, "roll", roll / VD_RADIANS_PER_DEGREE,
                             "fov", view->exact.fov);
    if (root == NULL) {
        return NULL;
    }
    double ground = scene_ground(scene, camera->eye.x, camera->eye.y);
    bool failed = false;
    if (isfinite(ground)) {
        double above = camera->eye.z - ground * exaggeration;
        failed |= json_object_set_new(root, "above_ground_m", json_real(above)) != 0;
    }
    vd_status status =
        vd_scene_latlon_from_world(scene, camera->eye.x, camera->eye.y, &latitude, &longitude);
    if (status.code == VD_OK) {
        json_t *where = json_pack("{s: f, s: f, s: f}", "latitude", latitude, "longitude",
                                  longitude, "height_masl", camera->eye.z / exaggeration);
        failed |= json_object_set_new(root, "geographic", where) != 0;
    }
    if (failed) {
        json_decref(root);
        return NULL;
    }
    return root;
}

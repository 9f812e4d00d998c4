/* path_file.c: camera paths from files. */
#include "path_file.h"

#include <jansson.h>
#include <math.h>
#include <string.h>

#include "options.h"
#include "path_json.h"
#include "view.h"

#define COUNT(names) ((int)(sizeof(names) / sizeof(names)[0]))

static const double default_fov = 50.0, default_speed_mps = 40.0, default_orbit_s = 20.0;

vd_path_settings vd_path_settings_default(void) {
    const double unsaid = (double)NAN;
    return (vd_path_settings){.duration_s = unsaid,
                              .speed_mps = unsaid,
                              .height_m = unsaid,
                              .look_ahead_s = unsaid,
                              .smooth_s = unsaid,
                              .pitch = unsaid,
                              .fov = unsaid,
                              .clearance_m = unsaid,
                              .near_m = 0.1,
                              .exaggeration = 1.0};
}

/* What a path is read with. */
typedef struct loading {
    vd_path_reader reader;
    const vd_path_settings *settings;
    const vd_scene *scene;
    vd_ground_function *ground;
    void *ground_user;
    vd_path_notes *notes;
    vd_camera_path **out;

    /* of the whole file */
    bool loop;
    double ease_s, duration_s, speed_mps, fov;
} loading;

/* The first that is said. */
static double said(double flag, double file) {
    return flag == flag ? flag : file;
}

static bool going(const loading *l) {
    return l->reader.status.code == VD_OK;
}

static void take(loading *l, vd_status status) {
    if (status.code != VD_OK && going(l)) {
        vd_path_fail(&l->reader, status.code, status.message);
    }
}

/* Fills a place on the Earth into world metres. */
static void from_lonlat(loading *l, double lon, double lat, vd_vec3 *out) {
    if (!(fabs(lat) <= 90.0 && fabs(lon) <= 720.0)) {
        vd_path_fail(&l->reader, VD_ERROR_ARGUMENT,
                     "a longitude and latitude are not on the Earth; give [longitude, latitude] in "
                     "degrees");
        return;
    }
    take(l, vd_scene_world_from_latlon(l->scene, lat, lon, &out->x, &out->y));
}

/* Sets z to metres above the ground there. */
static void above_ground(loading *l, double height_m, vd_vec3 *place) {
    double ground = going(l) ? l->ground(l->ground_user, place->x, place->y) : 0.0;
    if (!isfinite(ground)) {
        vd_path_fail(&l->reader, VD_ERROR_ARGUMENT,
                     "there is no ground at this place: it lies outside the map or in a hole; give "
                     "\"eye\": [x, y, z], or \"masl\"");
    }
    place->z = ground + height_m;
}

/* Reads a place under three spellings: [x, y, z]; [x, y] or `lonlat` with "height" above ground;
 * `lonlat` with "masl". False where none is there. */
static bool read_place(loading *l, const json_t *object, const char *world, const char *lonlat,
                       const char *height, const char *masl, vd_vec3 *out) {
    double v[3] = {0.0, 0.0, 0.0};
    const int count = vd_path_numbers(&l->reader, object, world, 2, 3, v);
    const int degrees = vd_path_numbers(&l->reader, object, lonlat, 2, 3, v);
    if (count > 0 && degrees > 0) {
        char sentence[120];
        snprintf(sentence, sizeof sentence, "\"%s\" and \"%s\" both say where; give one of them",
                 world, lonlat);
        vd_path_fail(&l->reader, VD_ERROR_ARGUMENT, sentence);
    }
    *out = vd_vec3_make(v[0], v[1], v[2]);
    if (degrees > 0) {
        from_lonlat(l, v[0], v[1], out);
    }
    const double sea = masl != NULL
                           ? vd_path_number(&l->reader, object, masl, (double)NAN, -1e6, 1e9)
                           : (double)NAN;
    const double above =
        vd_path_number(&l->reader, object, height, degrees == 3 ? v[2] : 0.0, -1e6, 1e9);
    if (sea == sea && count < 3) {
        out->z = sea * l->settings->exaggeration;
    } else if ((count > 0 && count < 3) || degrees > 0) {
        above_ground(l, above, out);
    }
    return count > 0 || degrees > 0;
}

/* ---- keyframes --------------------------------------------------------------------------------
 */

static void read_keyframe(loading *l, json_t *object, vd_keyframe *key, bool *timed, bool *aimed,
                          double *pitch, double *roll) {
    static const char *const names[] = {"time",  "eye",  "at",  "height",  "masl",   "heading",
                                        "pitch", "roll", "fov", "look_at", "target", "look_height"};
    vd_path_reader *r = &l->reader;
    if (!json_is_object(object)) {
        vd_path_fail(r, VD_ERROR_FORMAT, "it is not an object; give {\"eye\": [x, y, z], …}");
        return;
    }
    vd_path_check_keys(r, object, names, COUNT(names));
    *timed = json_object_get(object, "time") != NULL;
    key->time_s = vd_path_number(r, object, "time", 0.0, -VD_MAX_PATH_SECONDS, VD_MAX_PATH_SECONDS);
    if (!read_place(l, object, "eye", "at", "height", "masl", &key->eye) && going(l)) {
        vd_path_fail(r, VD_ERROR_ARGUMENT,
                     "it does not say where the camera is; give \"eye\": [x, y, z] or \"at\": "
                     "[longitude, latitude] with \"height\"");
    }
    key->fov_y_rad = VD_RADIANS_PER_DEGREE * vd_path_number(r, object, "fov", l->fov, 0.001, 179.0);
    *pitch = vd_path_number(r, object, "pitch", 0.0, -90.0, 90.0);
    *roll = vd_path_number(r, object, "roll", 0.0, -360.0, 360.0);
    double heading = vd_path_number(r, object, "heading", (double)NAN, -1e6, 1e6);
    vd_vec3 target;
    *aimed = true;
    if (read_place(l, object, "target", "look_at", "look_height", NULL, &target)) {
        if (heading == heading || json_object_get(object, "pitch") != NULL) {
            vd_path_fail(r, VD_ERROR_ARGUMENT,
                         "a target and \"heading\" or \"pitch\" both say where it looks; give one "
                         "of them");
        }
        key->orientation = vd_orientation_look_at(key->eye, target);
        *aimed = vd_vec3_length(vd_vec3_subtract(target, key->eye)) > 0.0;
    } else if (heading == heading) {
        key->orientation = vd_orientation_from_angles(heading * VD_RADIANS_PER_DEGREE,
                                                      *pitch * VD_RADIANS_PER_DEGREE,
                                                      *roll * VD_RADIANS_PER_DEGREE);
    } else {
        *aimed = false;
    }
}

/* Keyframes without a direction look towards the next one; the last like the one before. */
static void aim(vd_keyframe *keys, int count, const bool *aimed, const double *pitch,
                const double *roll) {
    double heading = 0.0;
    for (int i = 0; i < count; i++) {
        double unused;
        if (aimed[i]) {
            vd_orientation_to_angles(keys[i].orientation, &heading, &unused, &unused);
            continue;
        }
        for (int next = i + 1; next < count; next++) {
            vd_vec3 d = vd_vec3_subtract(keys[next].eye, keys[i].eye);
            if (d.x * d.x + d.y * d.y > 1e-12) {
                vd_vec3 level = {keys[next].eye.x, keys[next].eye.y, keys[i].eye.z};
                vd_quat look = vd_orientation_look_at(keys[i].eye, level);
                vd_orientation_to_angles(look, &heading, &unused, &unused);
                break;
            }
        }
        keys[i].orientation = vd_orientation_from_angles(heading, pitch[i] * VD_RADIANS_PER_DEGREE,
                                                         roll[i] * VD_RADIANS_PER_DEGREE);
    }
}

typedef struct keyframe_list {
    vd_keyframe *keys;
    bool *aimed;
    double *pitch, *roll;
} keyframe_list;

static void read_keyframes(loading *l, const json_t *list, keyframe_list *k) {
    const int count = (int)json_array_size(list);
    vd_camera_path_def def = vd_camera_path_def_default();
    for (int i = 0; i < count && going(l); i++) {
        bool timed = false;
        snprintf(l->reader.where, sizeof l->reader.where, "keyframe %d", i + 1);
        read_keyframe(l, json_array_get(list, (size_t)i), &k->keys[i], &timed, &k->aimed[i],
                      &k->pitch[i], &k->roll[i]);
        if (i > 0 && timed != def.timed) {
            vd_path_fail(&l->reader, VD_ERROR_ARGUMENT,
                         timed ? "it has a \"time\" and those before have none; give all of them "
                                 "one or none"
                               : "it has no \"time\" and those before have one; give all of them "
                                 "one or none");
        }
        def.timed = timed;
    }
    l->reader.where[0] = '\0';
    if (!going(l)) {
        return;
    }
    aim(k->keys, count, k->aimed, k->pitch, k->roll);
    def.keyframes = k->keys;
    def.count = count;
    def.loop = l->loop;
    def.ease_s = l->ease_s;
    def.near_m = l->settings->near_m;
    def.duration_s = l->duration_s == l->duration_s ? l->duration_s : 0.0;
    def.speed_mps = said(l->speed_mps, default_speed_mps);
    take(l, vd_camera_path_create(l->reader.context, &def, l->out));
}

static void load_keyframes(loading *l, const json_t *list) {
    vd_context *context = l->reader.context;
    if (!json_is_array(list) || json_array_size(list) > VD_MAX_KEYFRAMES) {
        vd_path_fail(&l->reader, VD_ERROR_FORMAT,
                     "\"keyframes\" is not a list of at most 1000000 keyframes; give one");
        return;
    }
    const size_t count = json_array_size(list);
    keyframe_list k = {.keys = vd_allocate(context, count, sizeof *k.keys),
                       .aimed = vd_allocate(context, count, sizeof *k.aimed),
                       .pitch = vd_allocate(context, count, sizeof *k.pitch),
                       .roll = vd_allocate(context, count, sizeof *k.roll)};
    if (k.keys == NULL || k.aimed == NULL || k.pitch == NULL || k.roll == NULL) {
        vd_path_fail(&l->reader, VD_ERROR_MEMORY, "out of memory");
    } else {
        read_keyframes(l, list, &k);
    }
    vd_release(context, k.keys);
    vd_release(context, k.aimed);
    vd_release(context, k.pitch);
    vd_release(context, k.roll);
}

/* ---- orbit ------------------------------------------------------------------------------------
 */

/* Where an orbit is that does not say: about the middle of the terrain, seen from 25° above, as far
 * away as `render` would stand, and half as far again, since corners turn towards the camera. */
static void frame_orbit(loading *l, vd_orbit_def *def) {
    static const double elevation = 25.0, room = 1.15;
    vd_camera_settings camera = vd_camera_settings_default();
    camera.elevation = elevation;
    camera.fov = def->fov_y_rad / VD_RADIANS_PER_DEGREE;
    vd_view view;
    vd_status status =
        vd_view_make(l->scene, &camera, l->settings->exaggeration, false, 1920, 1080, &view);
    take(l, status);
    if (status.code == VD_OK) {
        const double *t = view.exact.target.v;
        vd_vec3 back = vd_vec3_subtract(view.camera.eye, vd_vec3_make(t[0], t[1], t[2]));
        def->centre = vd_vec3_make(t[0], t[1], t[2]);
        def->radius_m = room * sqrt(back.x * back.x + back.y * back.y);
        def->height_m = room * back.z;
    }
}

static void load_orbit(loading *l, json_t *object) {
    static const char *const names[] = {"centre",  "at",    "above",    "radius", "height",
                                        "heading", "turns", "duration", "fov"};
    vd_path_reader *r = &l->reader;
    vd_orbit_def def = vd_orbit_def_default();
    snprintf(r->where, sizeof r->where, "orbit");
    if (object != NULL && !json_is_object(object)) {
        vd_path_fail(r, VD_ERROR_FORMAT, "it is not an object; give {\"radius\": 1000, …}");
        return;
    }
    if (object != NULL) {
        vd_path_check_keys(r, object, names, COUNT(names));
    }
    def.fov_y_rad = VD_RADIANS_PER_DEGREE *
                    said(l->settings->fov, vd_path_number(r, object, "fov", 40.0, 0.001, 179.0));
    frame_orbit(l, &def);
    vd_vec3 centre;
    if (read_place(l, object, "centre", "at", "above", NULL, &centre)) {
        def.centre = centre;
    }
    def.radius_m = vd_path_number(r, object, "radius", def.radius_m, 1e-3, 1e9);
    def.height_m = vd_path_number(r, object, "height", def.height_m, -1e9, 1e9);
    def.heading_rad = VD_RADIANS_PER_DEGREE * vd_path_number(r, object, "heading", 0.0, -1e6, 1e6);
    def.turns = vd_path_number(r, object, "turns", 1.0, -1000.0, 1000.0);
    def.duration_s = said(l->duration_s, vd_path_number(r, object, "duration", default_orbit_s,
                                                        1e-3, VD_MAX_PATH_SECONDS));
    def.near_m = l->settings->near_m;
    def.ease_s = l->ease_s;
    if (going(l)) {
        take(l, vd_camera_path_create_orbit(r->context, &def, l->out));
    }
}

/* ---- track ------------------------------------------------------------------------------------
 */

/* Makes a path along points that are in degrees, or in metres; they are changed. */
static void make_track(loading *l, const json_t *object, double (*points)[3], int count, bool has_z,
                       bool degrees) {
    const vd_path_settings *s = l->settings;
    vd_path_reader *r = &l->reader;
    vd_track_def def = vd_track_def_default();
    for (int i = 0; i < count && degrees && going(l); i++) {
        vd_vec3 place = {0.0, 0.0, 0.0};
        from_lonlat(l, points[i][0], points[i][1], &place);
        points[i][0] = place.x;
        points[i][1] = place.y;
        points[i][2] *= s->exaggeration;
    }
    def.points = (const double(*)[3])points;
    def.count = count;
    def.has_z = has_z;
    def.ground = l->ground;
    def.ground_user = l->ground_user;
    def.follow_z = vd_path_truth(r, object, "own_heights", false);
    def.height_m = said(s->height_m, vd_path_number(r, object, "height", def.height_m, -1e6, 1e9));
    def.look_ahead_s =
        said(s->look_ahead_s, vd_path_number(r, object, "look_ahead", def.look_ahead_s, 1e-3, 1e6));
    def.smooth_s = said(s->smooth_s, vd_path_number(r, object, "smooth", def.smooth_s, 0.0, 1e6));
    def.pitch_rad = VD_RADIANS_PER_DEGREE *
                    said(s->pitch, vd_path_number(r, object, "pitch",
                                                  def.pitch_rad / VD_RADIANS_PER_DEGREE, -90, 90));
    def.pitch_free = vd_path_truth(r, object, "look_along", false);
    def.speed_mps = said(l->speed_mps, def.speed_mps);
    def.duration_s = l->duration_s == l->duration_s ? l->duration_s : 0.0;
    def.fov_y_rad = VD_RADIANS_PER_DEGREE * l->fov;
    def.ease_s = l->ease_s;
    def.near_m = s->near_m;
    if (going(l) && def.height_m < 20.0 && def.height_m >= 0.0) {
        l->notes->clearance_m = 0.5 * def.height_m;
    }
    if (going(l)) {
        take(l, vd_camera_path_create_track(r->context, &def, l->out));
    }
}

static void read_points(loading *l, const json_t *object, const char *key, double (*points)[3]) {
    const json_t *list = json_object_get(object, key);
    const int count = (int)json_array_size(list);
    bool has_z = true;
    for (int i = 0; i < count && going(l); i++) {
        const json_t *point = json_array_get(list, (size_t)i);
        const size_t size = json_array_size(point);
        bool right = size == 2 || size == 3;
        points[i][2] = 0.0;
        for (size_t axis = 0; axis < size && right; axis++) {
            const json_t *v = json_array_get(point, axis);
            right = json_is_number(v);
            points[i][axis] = json_number_value(v);
        }
        has_z = has_z && size == 3;
        if (!right) {
            char sentence[100];
            snprintf(sentence, sizeof sentence,
                     "point %d is not two or three numbers; give [x, y] or [x, y, z]", i + 1);
            vd_path_fail(&l->reader, VD_ERROR_FORMAT, sentence);
        }
    }
    if (going(l)) {
        make_track(l, object, points, count, has_z, strcmp(key, "lonlat") == 0);
    }
}

static void load_track_file(loading *l, const json_t *object, const char *file) {
    vd_track_points points = {NULL, 0, false};
    vd_status status = vd_path_load_track(l->reader.context, file, &points);
    if (status.code != VD_OK) {
        l->reader.status = status; /* it names the file itself */
        return;
    }
    make_track(l, object, points.lonlat, points.count, points.has_z, true);
    vd_release(l->reader.context, points.lonlat);
}

static void load_track(loading *l, json_t *object) {
    static const char *const names[] = {"points",     "lonlat",     "file",   "height",
                                        "speed",      "look_ahead", "smooth", "pitch",
                                        "look_along", "own_heights"};
    vd_path_reader *r = &l->reader;
    snprintf(r->where, sizeof r->where, "track");
    if (!json_is_object(object)) {
        vd_path_fail(r, VD_ERROR_FORMAT, "it is not an object; give {\"points\": [[x, y], …], …}");
        return;
    }
    vd_path_check_keys(r, object, names, COUNT(names));
    l->speed_mps =
        said(l->settings->speed_mps, vd_path_number(r, object, "speed", l->speed_mps, 1e-6, 1e9));
    const char *file = json_string_value(json_object_get(object, "file"));
    const char *key = json_object_get(object, "points") != NULL ? "points" : "lonlat";
    const json_t *list = json_object_get(object, key);
    if (file != NULL) {
        char name[4096];
        const char *slash = strrchr(r->file, '/');
        int folder = slash != NULL && file[0] != '/' ? (int)(slash - r->file) + 1 : 0;
        snprintf(name, sizeof name, "%.*s%s", folder, r->file, file);
        load_track_file(l, object, name);
        return;
    }
    if (!json_is_array(list) || json_array_size(list) > VD_MAX_KEYFRAMES) {
        vd_path_fail(r, VD_ERROR_FORMAT,
                     "it has no points; give \"points\": [[x, y], …], \"lonlat\": [[longitude, "
                     "latitude], …] or \"file\"");
        return;
    }
    double(*points)[3] = vd_allocate(r->context, json_array_size(list), sizeof *points);
    if (points == NULL) {
        vd_path_fail(r, VD_ERROR_MEMORY, "out of memory");
        return;
    }
    read_points(l, object, key, points);
    vd_release(r->context, points);
}

/* ---- the file ---------------------------------------------------------------------------------
 */

static void load_root(loading *l, json_t *root) {
    static const char *const names[] = {"veduta_path", "keyframes", "orbit", "track",
                                        "loop",        "ease",      "speed", "duration",
                                        "fov",         "clearance"};
    vd_path_reader *r = &l->reader;
    if (!json_is_object(root) || json_object_get(root, "veduta_path") == NULL) {
        vd_path_fail(r, VD_ERROR_FORMAT,
                     "it is no camera path: \"veduta_path\": 1 is missing; see docs/fly.md");
        return;
    }
    vd_path_check_keys(r, root, names, COUNT(names));
    if (!json_is_number(json_object_get(root, "veduta_path")) ||
        json_number_value(json_object_get(root, "veduta_path")) != 1.0) {
        vd_path_fail(r, VD_ERROR_UNSUPPORTED,
                     "\"veduta_path\" is not 1, the version that this program reads");
    }
    const json_t *ease = json_object_get(root, "ease");
    l->ease_s = json_is_boolean(ease) ? (json_is_true(ease) ? l->ease_s : 0.0)
                                      : vd_path_number(r, root, "ease", l->ease_s, 0.0, 1e6);
    l->loop = vd_path_truth(r, root, "loop", false);
    const double none = (double)NAN;
    l->duration_s = said(l->settings->duration_s,
                         vd_path_number(r, root, "duration", none, 1e-3, VD_MAX_PATH_SECONDS));
    l->speed_mps = said(l->settings->speed_mps, vd_path_number(r, root, "speed", none, 1e-6, 1e9));
    l->fov = said(l->settings->fov, vd_path_number(r, root, "fov", l->fov, 0.001, 179.0));
    double clearance = vd_path_number(r, root, "clearance", none, 0.0, 1e9);
    json_t *keyframes = json_object_get(root, "keyframes"), *orbit = json_object_get(root, "orbit"),
           *track = json_object_get(root, "track");
    const int given = (keyframes != NULL) + (orbit != NULL) + (track != NULL);
    if (given != 1) {
        vd_path_fail(r, VD_ERROR_ARGUMENT,
                     given == 0 ? "it has no way to fly; give one of \"keyframes\", \"orbit\" and "
                                  "\"track\""
                                : "it has several ways to fly; give one of \"keyframes\", "
                                  "\"orbit\" and \"track\"");
    }
    if (!going(l)) {
        return;
    }
    strcpy(l->notes->kind, keyframes != NULL ? "keyframes" : orbit != NULL ? "orbit" : "track");
    if (keyframes != NULL) {
        load_keyframes(l, keyframes);
    } else if (orbit != NULL) {
        load_orbit(l, orbit);
    } else {
        load_track(l, track);
    }
    l->notes->clearance_m = said(clearance, l->notes->clearance_m);
}

static void load_json(loading *l, const char *path) {
    json_error_t error;
    json_t *root = json_load_file(path, JSON_REJECT_DUPLICATES, &error);
    if (root != NULL) {
        load_root(l, root);
        json_decref(root);
        return;
    }
    if (error.line < 0) {
        l->reader.status = vd_failure(
            VD_ERROR_IO, "cannot read %.160s: it cannot be opened; check the path", path);
        return;
    }
    l->reader.status =
        vd_failure(VD_ERROR_FORMAT, "%.160s: line %d, column %d: %.120s; correct the JSON", path,
                   error.line, error.column, error.text);
}

vd_status vd_path_load(vd_context *context, const char *path, const vd_path_settings *settings,
                       const vd_scene *scene, vd_ground_function *ground, void *ground_user,
                       vd_path_notes *notes, vd_camera_path **out) {
    loading l = {.reader = {.context = context, .file = path != NULL ? path : "--orbit"},
                 .settings = settings,
                 .scene = scene,
                 .ground = ground,
                 .ground_user = ground_user,
                 .notes = notes,
                 .out = out,
                 .ease_s = 1.0,
                 .duration_s = settings->duration_s,
                 .speed_mps = settings->speed_mps,
                 .fov = said(settings->fov, default_fov)};
    l.reader.status = vd_success();
    *notes = (vd_path_notes){.clearance_m = 10.0};
    if (path == NULL) {
        strcpy(notes->kind, "orbit");
        load_orbit(&l, NULL);
    } else if (vd_ends_with(path, ".json")) {
        load_json(&l, path);
    } else {
        strcpy(notes->kind, "track");
        load_track_file(&l, NULL, path);
    }
    notes->clearance_m = said(settings->clearance_m, notes->clearance_m);
    return l.reader.status;
}

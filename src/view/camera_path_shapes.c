/* camera_path_shapes.c: paths that are given by a shape: an orbit, a track. */
#include <math.h>

#include "core/core.h"
#include "core/real.h"
#include "view/camera_path_internal.h"

static vd_status check_finite(const char *what, double value, bool positive) {
    if (fabs(value) <= 1e15 && (!positive || value > 0.0)) {
        return vd_success();
    }
    return vd_failure(VD_ERROR_ARGUMENT, "%s is %g; give %s", what, value,
                      positive ? "a number above 0" : "a finite number");
}

/* ---- orbit ------------------------------------------------------------------------------------
 */

vd_orbit_def vd_orbit_def_default(void) {
    return (vd_orbit_def){.radius_m = 1000.0,
                          .height_m = 500.0,
                          .turns = 1.0,
                          .duration_s = 20.0,
                          .fov_y_rad = vd_radians(40.0),
                          .near_m = 0.1,
                          .ease_s = 1.0};
}

/* Keyframes of a turn: the curve is within 3·10⁻⁶ of the radius. */
enum { ORBIT_KEYFRAMES = 96 };

static vd_status check_orbit(const vd_orbit_def *def) {
    const struct {
        const char *what;
        double value;
        bool positive;
    } fields[] = {{"the orbit's centre x", def->centre.x, false},
                  {"the orbit's centre y", def->centre.y, false},
                  {"the orbit's centre z", def->centre.z, false},
                  {"the orbit's radius", def->radius_m, true},
                  {"the orbit's height", def->height_m, false},
                  {"the orbit's heading", def->heading_rad, false},
                  {"the orbit's number of turns", fabs(def->turns), true},
                  {"the orbit's duration", def->duration_s, true}};
    for (size_t i = 0; i < sizeof fields / sizeof fields[0]; i++) {
        vd_status status = check_finite(fields[i].what, fields[i].value, fields[i].positive);
        if (status.code != VD_OK) {
            return status;
        }
    }
    if (fabs(def->turns) > 1000.0) {
        return vd_failure(VD_ERROR_LIMIT, "the orbit has %g turns, more than 1000; give fewer",
                          def->turns);
    }
    return vd_success();
}

vd_status vd_camera_path_create_orbit(vd_context *context, const vd_orbit_def *def,
                                      vd_camera_path **out) {
    vd_status status = check_orbit(def);
    if (status.code != VD_OK) {
        return status;
    }
    /* Whole turns are one round of a loop, flown again and again. */
    const bool loop = def->turns == floor(def->turns);
    const double turns = loop ? (def->turns < 0.0 ? -1.0 : 1.0) : def->turns;
    const int steps = (int)ceil(fabs(turns) * ORBIT_KEYFRAMES), least = steps < 2 ? 2 : steps;
    const int count = loop ? least : least + 1;
    vd_keyframe *keys = vd_allocate(context, (size_t)count, sizeof *keys);
    if (keys == NULL) {
        return vd_out_of_memory("an orbit", (size_t)count * sizeof *keys);
    }
    for (int i = 0; i < count; i++) {
        double heading = def->heading_rad + 2.0 * VD_PI * turns * i / least;
        vd_vec3 away = {-def->radius_m * vd_sin(heading), -def->radius_m * vd_cos(heading),
                        def->height_m};
        /* The heading itself, not the one that the eye's rounded place would give. */
        double pitch = vd_atan2(-def->height_m, def->radius_m);
        keys[i] = (vd_keyframe){.eye = vd_vec3_add(def->centre, away),
                                .orientation = vd_orientation_from_angles(heading, pitch, 0.0),
                                .fov_y_rad = def->fov_y_rad};
    }
    vd_camera_path_def path = vd_camera_path_def_default();
    path.keyframes = keys;
    path.count = count;
    path.loop = loop;
    path.duration_s = def->duration_s / (loop ? fabs(def->turns) : 1.0);
    path.ease_s = loop ? 0.0 : def->ease_s;
    path.near_m = def->near_m;
    status = vd_camera_path_create(context, &path, out);
    vd_release(context, keys);
    return status;
}

/* ---- track ------------------------------------------------------------------------------------
 */

vd_track_def vd_track_def_default(void) {
    return (vd_track_def){.height_m = 100.0,
                          .speed_mps = 40.0,
                          .look_ahead_s = 4.0,
                          .pitch_rad = vd_radians(-10.0),
                          .smooth_s = 1.5,
                          .fov_y_rad = vd_radians(50.0),
                          .near_m = 0.1,
                          .ease_s = 1.0};
}

/* Steps between the places that a track is resampled to: 1/8 of the smoothing's width, and so many
 * of them. */
enum { TRACK_LEAST = 32, TRACK_MOST = 16384 };

typedef struct track {
    const vd_track_def *def;
    vd_vec3 *places; /* [count] */
    double *scratch; /* [count] */
    int count;
    double step_m, length_m;
} track;

static double level_distance(const double a[3], const double b[3]) {
    double dx = b[0] - a[0], dy = b[1] - a[1];
    return sqrt(dx * dx + dy * dy);
}

static vd_status check_track(const vd_track_def *def, double *length_m) {
    if (def->points == NULL || def->count < 2) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "the track has %d point%s, and two at least are a way; give another "
                          "track",
                          def->points == NULL ? 0 : def->count, def->count == 1 ? "" : "s");
    }
    if (def->count > VD_MAX_KEYFRAMES) {
        return vd_failure(VD_ERROR_LIMIT, "the track has %d points, more than %d; thin it out",
                          def->count, VD_MAX_KEYFRAMES);
    }
    const bool z = def->has_z;
    if (!z && (def->ground == NULL || def->follow_z)) {
        return vd_failure(VD_ERROR_ARGUMENT, "the track has no heights%s",
                          def->follow_z ? " to follow; fly above the ground instead"
                                        : " and there is no ground; give one of them");
    }
    double length = 0.0;
    for (int i = 0; i < def->count; i++) {
        const double *p = def->points[i];
        if (!(fabs(p[0]) <= 1e15 && fabs(p[1]) <= 1e15 && (!z || fabs(p[2]) <= 1e15))) {
            return vd_failure(VD_ERROR_ARGUMENT,
                              "the track's point %d, at %g, %g, %g, is no place; leave it out",
                              i + 1, p[0], p[1], z ? p[2] : 0.0);
        }
        length += i > 0 ? level_distance(def->points[i - 1], p) : 0.0;
    }
    if (!(length > 0.0)) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "the track's %d points are all at one place, which is no way; give "
                          "another track",
                          def->count);
    }
    *length_m = length;
    const struct {
        const char *what;
        double value;
        bool positive;
    } fields[] = {{"the track's height above ground", def->height_m, false},
                  {"the track's pitch", def->pitch_rad, false},
                  {"the track's seconds ahead", def->look_ahead_s, true},
                  {"the track's smoothing", 1.0 + def->smooth_s, true},
                  {"the track's speed", def->duration_s > 0.0 ? 1.0 : def->speed_mps, true},
                  {"the track's duration", 1.0 + def->duration_s, true}};
    for (size_t i = 0; i < sizeof fields / sizeof fields[0]; i++) {
        vd_status status = check_finite(fields[i].what, fields[i].value, fields[i].positive);
        if (status.code != VD_OK) {
            return status;
        }
    }
    return vd_success();
}

/* Places at even level distances along the points. */
static void resample(track *t) {
    const double(*p)[3] = t->def->points;
    int i = 0;
    double behind = 0.0, here = level_distance(p[0], p[1]);
    for (int k = 0; k < t->count; k++) {
        double at = t->step_m * k;
        while (behind + here < at && i + 2 < t->def->count) {
            behind += here;
            i++;
            here = level_distance(p[i], p[i + 1]);
        }
        double u = here > 0.0 ? (at - behind) / here : 0.0;
        u = u < 0.0 ? 0.0 : u > 1.0 ? 1.0 : u;
        const double z0 = t->def->has_z ? p[i][2] : 0.0, z1 = t->def->has_z ? p[i + 1][2] : 0.0;
        t->places[k] = vd_vec3_make(p[i][0] + u * (p[i + 1][0] - p[i][0]),
                                    p[i][1] + u * (p[i + 1][1] - p[i][1]), z0 + u * (z1 - z0));
    }
}

static double *axis_of(vd_vec3 *place, int axis) {
    return axis == 0 ? &place->x : axis == 1 ? &place->y : &place->z;
}

/* Smooths one axis by a Gaussian. Beyond an end the line goes on turned by half a turn about it, so
 * that the ends stay where they are. */
static void smooth(track *t, int axis, double sigma_m) {
    const int n = t->count;
    const double sigma = sigma_m / t->step_m;
    int radius = (int)ceil(3.0 * sigma);
    radius = radius < n - 1 ? radius : n - 1;
    if (!(sigma > 0.0) || radius < 1) {
        return;
    }
    for (int i = 0; i < n; i++) {
        double sum = 0.0, weights = 0.0;
        for (int k = -radius; k <= radius; k++) {
            int j = i + k;
            double weight = vd_exp(-0.5 * (k / sigma) * (k / sigma)), value;
            if (j < 0) {
                value = 2.0 * *axis_of(&t->places[0], axis) - *axis_of(&t->places[-j], axis);
            } else if (j >= n) {
                value = 2.0 * *axis_of(&t->places[n - 1], axis) -
                        *axis_of(&t->places[2 * (n - 1) - j], axis);
            } else {
                value = *axis_of(&t->places[j], axis);
            }
            sum += weight * value;
            weights += weight;
        }
        t->scratch[i] = sum / weights;
    }
    for (int i = 0; i < n; i++) {
        *axis_of(&t->places[i], axis) = t->scratch[i];
    }
}

/* Sets the heights to the ground's, or the track's own, without the height above it. */
static vd_status find_heights(track *t) {
    const vd_track_def *def = t->def;
    double last = 0.0;
    int found = 0;
    for (int i = 0; i < t->count; i++) {
        vd_vec3 *p = &t->places[i];
        double ground = (double)-INFINITY;
        if (!def->follow_z && def->ground != NULL) {
            ground = def->ground(def->ground_user, p->x, p->y);
        }
        if (!(fabs(ground) <= 1e15)) {
            ground = def->has_z ? p->z : (double)NAN;
        }
        if (ground == ground && found++ == 0) { /* what lies before it takes the first height */
            for (int k = 0; k < i; k++) {
                t->places[k].z = ground;
            }
        }
        last = ground == ground ? ground : last;
        p->z = last;
    }
    return found > 0 ? vd_success()
                     : vd_failure(VD_ERROR_ARGUMENT,
                                  "the track has no heights and lies outside the terrain: its "
                                  "first point is at x %.10g, y %.10g; give another track, or "
                                  "terrain that it crosses",
                                  def->points[0][0], def->points[0][1]);
}

/* The place so many steps further; beyond the end the way goes straight on. */
static vd_vec3 place_ahead(const track *t, double at) {
    const int last = t->count - 1;
    int i = at < last - 1 ? (int)at : last - 1;
    const vd_vec3 a = t->places[i], b = t->places[i + 1];
    return vd_vec3_add(a, vd_vec3_scale(vd_vec3_subtract(b, a), at - i));
}

static void look_ahead(const track *t, double ahead_steps, vd_keyframe *keys) {
    const vd_track_def *def = t->def;
    double heading = 0.0, climb = 0.0;
    for (int i = 0; i < t->count; i++) {
        vd_vec3 d = vd_vec3_subtract(place_ahead(t, i + ahead_steps), t->places[i]);
        double level = sqrt(d.x * d.x + d.y * d.y);
        if (level > 1e-6 * t->step_m) { /* else the way comes back here: look on as before */
            heading = vd_atan2(d.x, d.y);
            climb = vd_atan2(d.z, level);
        }
        double pitch = def->pitch_rad + (def->pitch_free ? climb : 0.0), most = 0.5 * VD_PI;
        pitch = pitch < -most ? -most : pitch > most ? most : pitch;
        keys[i] = (vd_keyframe){.eye = t->places[i],
                                .orientation = vd_orientation_from_angles(heading, pitch, 0.0),
                                .fov_y_rad = def->fov_y_rad};
        keys[i].eye.z += def->height_m;
    }
}

/* Leaves out places that smoothing has brought onto the one before. */
static int drop_repeats(vd_keyframe *keys, int count) {
    int kept = 1;
    for (int i = 1; i < count; i++) {
        vd_vec3 moved = vd_vec3_subtract(keys[i].eye, keys[kept - 1].eye);
        if (vd_vec3_length(moved) > 1e-9 * (1.0 + vd_vec3_length(keys[i].eye))) {
            keys[kept++] = keys[i];
        }
    }
    return kept;
}

vd_status vd_camera_path_create_track(vd_context *context, const vd_track_def *def,
                                      vd_camera_path **out) {
    track t = {.def = def};
    vd_status status = check_track(def, &t.length_m);
    if (status.code != VD_OK) {
        return status;
    }
    const double speed = def->duration_s > 0.0 ? t.length_m / def->duration_s : def->speed_mps;
    const double sigma_m = def->smooth_s * speed;
    double steps = ceil(8.0 * t.length_m / (sigma_m > 0.0 ? sigma_m : speed));
    steps = steps < TRACK_LEAST ? TRACK_LEAST : steps > TRACK_MOST ? TRACK_MOST : steps;
    t.count = (int)steps + 1;
    t.step_m = t.length_m / steps;
    vd_keyframe *keys = vd_allocate(context, (size_t)t.count, sizeof *keys);
    t.places = vd_allocate(context, (size_t)t.count, sizeof *t.places);
    t.scratch = vd_allocate(context, (size_t)t.count, sizeof *t.scratch);
    if (keys == NULL || t.places == NULL || t.scratch == NULL) {
        status = vd_out_of_memory("a track", (size_t)t.count * (sizeof *keys + sizeof *t.places));
    } else {
        resample(&t);
        smooth(&t, 0, sigma_m);
        smooth(&t, 1, sigma_m);
        status = find_heights(&t);
    }
    if (status.code == VD_OK) {
        smooth(&t, 2, sigma_m);
        look_ahead(&t, def->look_ahead_s * speed / t.step_m, keys);
        vd_camera_path_def path = vd_camera_path_def_default();
        path.keyframes = keys;
        path.count = drop_repeats(keys, t.count);
        path.duration_s = def->duration_s;
        path.speed_mps = def->speed_mps;
        path.ease_s = def->ease_s;
        path.near_m = def->near_m;
        status = vd_camera_path_create(context, &path, out);
    }
    vd_release(context, t.scratch);
    vd_release(context, t.places);
    vd_release(context, keys);
    return status;
}

/* camera_path.c: curves through keyframes, and the camera at a time.
 *
 * Three functions one after the other: time → path time (ease) → metres along the curve (a monotone
 * cubic through the knots) → place (the curve by its arc length). Direction and field of view
 * follow from the path time alone, so that the camera may turn while it rests.
 */
#include "view/camera_path_internal.h"

#include <math.h>

#include "core/core.h"
#include "core/real.h"

/* ---- time -------------------------------------------------------------------------------------
 */

/* Slope at a knot between two intervals with slopes a and b: a monotone cubic's (Fritsch & Butland
 * 1984, as their weighted harmonic mean); 0 where the value turns or rests. */
static double monotone_slope(double a, double b, double before_s, double after_s) {
    if (!(a * b > 0.0)) {
        return 0.0;
    }
    double w1 = 2.0 * after_s + before_s, w2 = after_s + 2.0 * before_s;
    return (w1 + w2) / (w1 / a + w2 / b);
}

static double hermite(double p0, double p1, double m0, double m1, double x) {
    double x2 = x * x, x3 = x2 * x;
    return p0 + (p1 - p0) * (3.0 * x2 - 2.0 * x3) + m0 * (x - 2.0 * x2 + x3) + m1 * (x3 - x2);
}

static double smooth_ramp(double x) { /* the integral of 3x² − 2x³ */
    return x * x * x * (1.0 - 0.5 * x);
}

/* Path time at a time: of constant speed but for the ramps at both ends, which all of the path pays
 * for; where keyframes have times, these stay and the time around the ramps is bent. */
static double ease(const vd_camera_path *path, double t) {
    const double all = path->duration_s;
    double ramp = path->ease_s;
    if (path->loop || !(ramp > 0.0)) {
        return t;
    }
    if (!path->timed) {
        ramp = ramp < 0.5 * all ? ramp : 0.5 * all;
        const double scale = all / (all - ramp);
        if (t < ramp) {
            return scale * ramp * smooth_ramp(t / ramp);
        }
        if (t > all - ramp) {
            return all - scale * ramp * smooth_ramp((all - t) / ramp);
        }
        return scale * (t - 0.5 * ramp);
    }
    const int n = path->segment_count;
    for (int end = 0; end < 2; end++) {
        double least = end == 0 ? path->knots[1].key.time_s : all - path->knots[n - 1].key.time_s;
        least = n == 1 ? 0.5 * all : least;
        double bent = 2.0 * ramp < least ? 2.0 * ramp : least, at = end == 0 ? t : all - t;
        if (at < bent) {
            double x = at / bent, y = bent * (2.0 * x * x - x * x * x); /* slopes 0 and 1 */
            return end == 0 ? y : all - y;
        }
    }
    return t;
}

/* The time at which a path time comes: ease rises, so it is found by halving. */
static double unease(const vd_camera_path *path, double path_time) {
    double low = 0.0, high = path->duration_s;
    for (int i = 0; i < 60 && low < high; i++) {
        double middle = 0.5 * (low + high);
        if (ease(path, middle) < path_time) {
            low = middle;
        } else {
            high = middle;
        }
    }
    return high;
}

/* Metres along the curve at a path time within segment i. */
static double length_at(const vd_camera_path *path, int i, double path_time) {
    const vd_path_knot *a = &path->knots[i], *b = a + 1;
    const double span = b->key.time_s - a->key.time_s;
    double x = span > 0.0 ? (path_time - a->key.time_s) / span : 0.0;
    x = x < 0.0 ? 0.0 : x > 1.0 ? 1.0 : x;
    double s = hermite(a->length_m, b->length_m, a->speed_mps * span, b->speed_mps * span, x);
    return s < a->length_m ? a->length_m : s > b->length_m ? b->length_m : s;
}

double vd_path_time(const vd_camera_path *path, double length_m) {
    const int i = vd_path_find(path, true, length_m);
    double low = path->knots[i].key.time_s, high = path->knots[i + 1].key.time_s;
    for (int k = 0; k < 60; k++) {
        double middle = 0.5 * (low + high);
        if (length_at(path, i, middle) < length_m) {
            low = middle;
        } else {
            high = middle;
        }
    }
    return unease(path, high);
}

/* ---- direction --------------------------------------------------------------------------------
 */

/* The rotation vector of a unit quaternion, the short way round. */
static vd_vec3 rotation_vector(vd_quat q) {
    vd_vec3 v = {q.x, q.y, q.z};
    double w = q.w;
    if (w < 0.0) {
        v = vd_vec3_scale(v, -1.0);
        w = -w;
    }
    double sine = vd_vec3_length(v);
    return sine > 0.0 ? vd_vec3_scale(v, 2.0 * vd_atan2(sine, w) / sine) : vd_vec3_make(0, 0, 0);
}

static vd_quat turned(vd_quat q, vd_vec3 vector) {
    double angle = vd_vec3_length(vector);
    if (!(angle > 0.0)) {
        return q;
    }
    return vd_quat_multiply(q, vd_quat_from_axis_angle(vd_vec3_scale(vector, 1.0 / angle), angle));
}

static vd_vec3 turn_between(vd_quat a, vd_quat b) {
    return rotation_vector(vd_quat_multiply((vd_quat){-a.x, -a.y, -a.z, a.w}, b));
}

/* Turning speed at a knot: the mean of both sides, the shorter side counting more, and at most
 * three times the slower one, so that a camera that rests does not swing. */
static vd_vec3 knot_spin(vd_vec3 before, vd_vec3 after, double before_s, double after_s) {
    double slow = vd_vec3_length(before), fast = vd_vec3_length(after);
    vd_vec3 mean =
        vd_vec3_scale(vd_vec3_add(vd_vec3_scale(before, after_s), vd_vec3_scale(after, before_s)),
                      1.0 / (before_s + after_s));
    slow = 3.0 * (slow < fast ? slow : fast);
    double size = vd_vec3_length(mean);
    return size > slow ? vd_vec3_scale(mean, slow / size) : mean;
}

static bool same_turn(vd_quat p, vd_quat q) {
    return p.x == q.x && p.y == q.y && p.z == q.z && p.w == q.w;
}

/* De Casteljau's steps with slerps; the tangents at both ends are the knots' turning speeds. */
static vd_quat orientation_at(const vd_path_knot *a, const vd_path_knot *b, double span, double x) {
    vd_quat q[4] = {
        a->key.orientation, turned(a->key.orientation, vd_vec3_scale(a->spin, span / 3.0)),
        turned(b->key.orientation, vd_vec3_scale(b->spin, -span / 3.0)), b->key.orientation};
    if (same_turn(q[0], q[1]) && same_turn(q[1], q[2]) && same_turn(q[2], q[3])) {
        return q[0]; /* at rest, to the last bit: slerps round */
    }
    for (int left = 3; left > 0; left--) {
        for (int i = 0; i < left; i++) {
            q[i] = vd_quat_slerp(q[i], q[i + 1], x);
        }
    }
    return q[0];
}

/* Whether all keyframes are without roll and none looks nearly straight up or down. */
static bool is_level(const vd_camera_path *path) {
    const double steepest = vd_radians(80.0);
    for (int i = 0; i < path->count; i++) {
        double heading, pitch, roll;
        vd_orientation_to_angles(path->knots[i].key.orientation, &heading, &pitch, &roll);
        if (fabs(roll) > 1e-9 || fabs(pitch) > steepest) {
            return false;
        }
    }
    return true;
}

/* ---- making -----------------------------------------------------------------------------------
 */

vd_camera_path_def vd_camera_path_def_default(void) {
    return (vd_camera_path_def){.ease_s = 1.0, .near_m = 0.1};
}

static vd_status bad_keyframe(int index, const char *what, double value, const char *remedy) {
    return vd_failure(VD_ERROR_ARGUMENT, "keyframe %d: %s is %g; %s", index + 1, what, value,
                      remedy);
}

static vd_status check_keyframe(const vd_camera_path_def *def, int i) {
    const vd_keyframe *k = &def->keyframes[i];
    const double eye[3] = {k->eye.x, k->eye.y, k->eye.z};
    for (int axis = 0; axis < 3; axis++) {
        if (!(fabs(eye[axis]) <= 1e15)) {
            const char *const names[3] = {"the eye's x", "the eye's y", "the eye's z"};
            return bad_keyframe(i, names[axis], eye[axis], "give metres, at most 1e15");
        }
    }
    const vd_quat q = k->orientation;
    double norm = (q.x * q.x + q.y * q.y) + (q.z * q.z + q.w * q.w);
    if (!(fabs(norm - 1.0) <= 1e-6)) {
        return bad_keyframe(i, "the orientation's length", sqrt(norm), "give a unit quaternion");
    }
    if (!(k->fov_y_rad > 0.0 && k->fov_y_rad < VD_PI)) {
        return bad_keyframe(i, "the field of view in degrees", vd_degrees(k->fov_y_rad),
                            "give more than 0 and less than 180");
    }
    if (!def->timed) {
        return vd_success();
    }
    if (!(fabs(k->time_s) <= VD_MAX_PATH_SECONDS)) {
        return bad_keyframe(i, "the time", k->time_s, "give seconds, at most 1e6");
    }
    if (i > 0 && !(k->time_s - k[-1].time_s > 0.0)) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "keyframe %d: its time, %.10g s, is not after keyframe %d's, %.10g s; "
                          "give times that rise",
                          i + 1, k->time_s, i, k[-1].time_s);
    }
    return vd_success();
}

static bool same_place(vd_vec3 a, vd_vec3 b) {
    return a.x == b.x && a.y == b.y && a.z == b.z;
}

static bool same_pose(const vd_keyframe *a, const vd_keyframe *b) {
    return same_place(a->eye, b->eye) && same_turn(a->orientation, b->orientation) &&
           a->fov_y_rad == b->fov_y_rad;
}

static vd_status check_number(const char *name, double value, bool may_be_zero) {
    if (value > 0.0 ? value <= 1e15 : may_be_zero && value == 0.0) {
        return vd_success();
    }
    return vd_failure(VD_ERROR_ARGUMENT, "the path's %s is %g; give %s", name, value,
                      may_be_zero ? "0 or more" : "more than 0");
}

static vd_status check_motion(const vd_camera_path_def *def) {
    bool moves = false;
    for (int i = 1; i < def->count; i++) {
        const vd_keyframe *k = &def->keyframes[i];
        moves |= !same_pose(k, k - 1);
        if (!def->timed && same_place(k->eye, k[-1].eye)) {
            return vd_failure(VD_ERROR_ARGUMENT,
                              "keyframes %d and %d are at the same place; leave one out, or give "
                              "every keyframe a time",
                              i, i + 1);
        }
    }
    if (!moves) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "nothing moves: all %d keyframes are the same; change one", def->count);
    }
    const vd_keyframe *first = def->keyframes, *last = first + def->count - 1;
    if (def->loop && same_place(first->eye, last->eye)) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "the path is a loop, so its last keyframe, at the place of the first, "
                          "comes twice; leave it out");
    }
    return vd_success();
}

static vd_status check_def(const vd_camera_path_def *def) {
    if (def->keyframes == NULL || def->count < 2) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "a path needs two keyframes at least and has %d; add one",
                          def->keyframes == NULL ? 0 : def->count);
    }
    if (def->count > VD_MAX_KEYFRAMES) {
        return vd_failure(VD_ERROR_LIMIT, "the path has %d keyframes, more than %d; give fewer",
                          def->count, VD_MAX_KEYFRAMES);
    }
    vd_status status = check_number("near distance", def->near_m, false);
    if (status.code == VD_OK) {
        status = check_number("ease", def->ease_s, true);
    }
    if (status.code == VD_OK) {
        status = check_number("duration", def->duration_s, true);
    }
    if (status.code == VD_OK && !def->timed && def->duration_s == 0.0) {
        status = check_number("speed", def->speed_mps, false);
    }
    for (int i = 0; i < def->count && status.code == VD_OK; i++) {
        status = check_keyframe(def, i);
    }
    return status.code == VD_OK ? check_motion(def) : status;
}

/* Gives every knot its path time, from 0 to the duration. */
static vd_status set_times(vd_camera_path *path, const vd_camera_path_def *def) {
    const int n = path->segment_count;
    const double open_m = path->knots[path->count - 1].length_m;
    double duration = def->duration_s, given = 0.0;
    if (!def->timed) {
        duration = duration > 0.0 ? duration : path->curve_m / def->speed_mps;
    } else {
        const double first = def->keyframes[0].time_s;
        given = def->keyframes[path->count - 1].time_s - first;
        /* The way back of a loop at the mean speed, or where nothing moves in the mean time. */
        double back =
            open_m > 0.0 ? given * ((path->curve_m - open_m) / open_m) : given / (path->count - 1);
        given += path->loop ? back : 0.0;
        duration = duration > 0.0 ? duration : given;
    }
    if (!(duration <= VD_MAX_PATH_SECONDS)) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "the path takes %.4g s, more than %g; raise the speed, or give a shorter "
                          "duration",
                          duration, VD_MAX_PATH_SECONDS);
    }
    for (int i = 0; i <= n; i++) {
        vd_path_knot *k = &path->knots[i];
        k->key.time_s =
            def->timed
                ? (i < path->count ? (k->key.time_s - def->keyframes[0].time_s) * (duration / given)
                                   : duration)
                : duration * (k->length_m / path->curve_m);
    }
    path->knots[n].key.time_s = path->duration_s = duration;
    return vd_success();
}

/* Speeds of travel, turn and zoom at the knots. */
static void set_speeds(vd_camera_path *path) {
    const int n = path->segment_count;
    for (int i = 0; i <= n; i++) {
        vd_path_knot *k = &path->knots[i];
        double travel[2], zoom[2], span[2];
        vd_vec3 turn[2];
        for (int side = 0; side < 2; side++) {
            int s = i - 1 + side; /* the segment before, the one after */
            s = path->loop ? (s + n) % n : s < 0 ? 0 : s >= n ? n - 1 : s;
            const vd_path_knot *a = &path->knots[s], *b = a + 1;
            span[side] = b->key.time_s - a->key.time_s;
            travel[side] = (b->length_m - a->length_m) / span[side];
            zoom[side] = (b->key.fov_y_rad - a->key.fov_y_rad) / span[side];
            turn[side] = vd_vec3_scale(turn_between(a->key.orientation, b->key.orientation),
                                       1.0 / span[side]);
        }
        k->speed_mps = monotone_slope(travel[0], travel[1], span[0], span[1]);
        k->fov_per_s = monotone_slope(zoom[0], zoom[1], span[0], span[1]);
        k->spin = knot_spin(turn[0], turn[1], span[0], span[1]);
    }
}

static vd_status check_spans(const vd_camera_path *path) {
    for (int i = 0; i < path->segment_count; i++) {
        double span = path->knots[i + 1].key.time_s - path->knots[i].key.time_s;
        if (!(span > 0.0)) {
            return vd_failure(VD_ERROR_ARGUMENT,
                              "keyframes %d and %d are so near each other that no time lies "
                              "between them; leave one out",
                              i + 1, (i + 1) % path->count + 1);
        }
    }
    return vd_success();
}

vd_status vd_camera_path_create(vd_context *context, const vd_camera_path_def *def,
                                vd_camera_path **out) {
    vd_status status = check_def(def);
    if (status.code != VD_OK) {
        return status;
    }
    vd_camera_path *path = vd_allocate_zero(context, 1, sizeof *path);
    if (path == NULL) {
        return vd_out_of_memory("a camera path", sizeof *path);
    }
    path->context = context;
    path->count = def->count;
    path->segment_count = def->count - !def->loop;
    path->timed = def->timed;
    path->loop = def->loop;
    path->ease_s = def->ease_s;
    path->near_m = def->near_m;
    const size_t knots = (size_t)path->segment_count + 1;
    path->knots = vd_allocate_zero(context, knots, sizeof path->knots[0]);
    path->segments = vd_allocate_zero(context, knots, sizeof path->segments[0]);
    if (path->knots == NULL || path->segments == NULL) {
        vd_camera_path_destroy(&path);
        return vd_out_of_memory("a camera path",
                                knots * (sizeof(vd_path_knot) + sizeof(vd_path_segment)));
    }
    for (size_t i = 0; i < knots; i++) {
        path->knots[i].key = def->keyframes[i % (size_t)def->count];
        vd_quat *q = &path->knots[i].key.orientation;
        *q = vd_quat_normalize(*q);
    }
    vd_path_make_segments(path);
    status = set_times(path, def);
    if (status.code == VD_OK) {
        status = check_spans(path);
    }
    if (status.code != VD_OK) {
        vd_camera_path_destroy(&path);
        return status;
    }
    set_speeds(path);
    path->level = is_level(path);
    *out = path;
    return vd_success();
}

void vd_camera_path_destroy(vd_camera_path **path) {
    if (*path != NULL) {
        vd_context *context = (*path)->context;
        vd_release(context, (*path)->knots);
        vd_release(context, (*path)->segments);
        vd_release(context, (*path)->lifts);
        vd_release(context, *path);
        *path = NULL;
    }
}

/* ---- asking -----------------------------------------------------------------------------------
 */

double vd_camera_path_duration(const vd_camera_path *path) {
    return path->duration_s;
}

double vd_camera_path_length(const vd_camera_path *path) {
    return path->flown_m;
}

bool vd_camera_path_loops(const vd_camera_path *path) {
    return path->loop;
}

int vd_camera_path_keyframe_count(const vd_camera_path *path) {
    return path->count;
}

vd_keyframe vd_camera_path_keyframe(const vd_camera_path *path, int index) {
    vd_keyframe key = path->knots[index].key;
    const bool last = index == path->segment_count; /* where ease is flat: exactly */
    key.time_s = index == 0 ? 0.0 : last ? path->duration_s : unease(path, key.time_s);
    key.eye.z += vd_path_lift(path, path->knots[index].length_m);
    return key;
}

vd_keyframe vd_camera_path_pose(const vd_camera_path *path, double time_s) {
    const double all = path->duration_s;
    double t = time_s == time_s ? time_s : 0.0;
    if (path->loop) {
        t -= all * floor(t / all);
    }
    t = t < 0.0 ? 0.0 : t > all ? all : t;
    double path_time = ease(path, t);
    const int i = vd_path_find(path, false, path_time);
    const vd_path_knot *a = &path->knots[i], *b = a + 1;
    const double span = b->key.time_s - a->key.time_s;
    double x = (path_time - a->key.time_s) / span;
    x = x < 0.0 ? 0.0 : x > 1.0 ? 1.0 : x;
    const double s = length_at(path, i, path_time);
    const vd_path_segment *segment = &path->segments[i];
    vd_keyframe pose = {.time_s = time_s};
    pose.eye = vd_segment_place(segment, vd_segment_at_length(segment, s - a->length_m));
    pose.eye.z += vd_path_lift(path, s);
    pose.orientation = orientation_at(a, b, span, x);
    pose.fov_y_rad =
        hermite(a->key.fov_y_rad, b->key.fov_y_rad, a->fov_per_s * span, b->fov_per_s * span, x);
    if (path->level) {
        double heading, pitch, roll;
        vd_orientation_to_angles(pose.orientation, &heading, &pitch, &roll);
        pose.orientation = vd_orientation_from_angles(heading, pitch, 0.0);
    }
    return pose;
}

void vd_camera_path_at(const vd_camera_path *path, double time_s, int width, int height,
                       vd_camera *camera) {
    const vd_keyframe pose = vd_camera_path_pose(path, time_s);
    *camera = (vd_camera){.eye = pose.eye,
                          .orientation = pose.orientation,
                          .projection = VD_PROJECTION_PERSPECTIVE,
                          .lens = vd_lens_from_fov(pose.fov_y_rad, width, height),
                          .near_m = path->near_m};
}

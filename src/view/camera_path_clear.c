/* camera_path_clear.c: keeping a path above the ground.
 *
 * At many places along the curve: how much is missing to the clearance. The greatest of these
 * within r on either side, then twice the mean over r/2 on either side of that: every mean is of
 * values that are at least what is missing here, so the result is too, and it is smooth. It becomes
 * the control values of a cubic B-spline, which again is a mean of neighbours.
 */
#include <math.h>
#include <string.h>

#include "core/core.h"
#include "view/camera_path_internal.h"

enum { LEAST_STEPS = 2048, MOST_STEPS = 131072, PASSES = 6 };

static int step_count(const vd_camera_path *path, double step_m) {
    double steps = step_m > 0.0 ? ceil(path->curve_m / step_m) : LEAST_STEPS;
    return steps < LEAST_STEPS ? LEAST_STEPS : steps > MOST_STEPS ? MOST_STEPS : (int)steps;
}

/* Height above ground at a length; false where there is no ground. */
static bool height_at(const vd_camera_path *path, vd_ground_function *ground, void *user,
                      double length_m, double *height_m) {
    vd_vec3 p = vd_path_place(path, length_m);
    double below = ground(user, p.x, p.y);
    *height_m = p.z + vd_path_lift(path, length_m) - below;
    return fabs(below) <= 1e15;
}

static vd_path_clearance measure(const vd_camera_path *path, vd_ground_function *ground, void *user,
                                 int steps) {
    vd_path_clearance found = {.lowest_m = (double)INFINITY};
    double where = 0.0;
    for (int i = 0; i <= steps; i++) {
        double s = path->curve_m * ((double)i / steps), height;
        if (height_at(path, ground, user, s, &height)) {
            found.has_ground = true;
            if (height < found.lowest_m) {
                found.lowest_m = height;
                where = s;
            }
        }
    }
    if (!found.has_ground) {
        return (vd_path_clearance){0};
    }
    found.time_s = vd_path_time(path, where);
    found.unlifted_m = found.lowest_m;
    return found;
}

vd_path_clearance vd_camera_path_measure(const vd_camera_path *path, vd_ground_function *ground,
                                         void *user, double step_m) {
    return measure(path, ground, user, 2 * step_count(path, step_m));
}

/* ---- lifting ----------------------------------------------------------------------------------
 */

/* The index that stands for one beyond the ends. */
static int inside(const vd_camera_path *path, int i, int count) {
    if (path->loop) {
        return (i % count + count) % count;
    }
    return i < 0 ? 0 : i >= count ? count - 1 : i;
}

/* Replaces every value by the greatest within `radius`: windows grow threefold from pass to pass.
 */
static void spread(const vd_camera_path *path, double *values, double *scratch, int count,
                   int radius) {
    for (int reached = 0; reached < radius;) {
        int shift = 2 * reached + 1;
        shift = shift < radius - reached ? shift : radius - reached;
        for (int i = 0; i < count; i++) {
            double a = values[inside(path, i - shift, count)], b = values[i];
            double c = values[inside(path, i + shift, count)], most = a > b ? a : b;
            scratch[i] = most > c ? most : c;
        }
        memcpy(values, scratch, (size_t)count * sizeof *values);
        reached += shift;
    }
}

/* Replaces every value by the mean within `radius`. */
static void blur(const vd_camera_path *path, double *values, double *scratch, int count,
                 int radius) {
    double sum = 0.0;
    for (int k = -radius; k <= radius; k++) {
        sum += values[inside(path, k, count)];
    }
    for (int i = 0; i < count; i++) {
        scratch[i] = sum / (2 * radius + 1);
        sum +=
            values[inside(path, i + radius + 1, count)] - values[inside(path, i - radius, count)];
    }
    memcpy(values, scratch, (size_t)count * sizeof *values);
}

typedef struct lifting {
    vd_camera_path *path;
    vd_ground_function *ground;
    void *user;
    double *missing, *scratch; /* [count] */
    int steps, count;
} lifting;

/* What is missing at every place to `wanted_m`, the lift of the path included; returns the most. */
static double find_missing(lifting *l, double wanted_m) {
    double most = 0.0;
    for (int i = 0; i < l->count; i++) {
        double height, s = l->path->curve_m * ((double)i / l->steps);
        bool there = height_at(l->path, l->ground, l->user, s, &height);
        l->missing[i] = there && height < wanted_m ? wanted_m - height : 0.0;
        most = l->missing[i] > most ? l->missing[i] : most;
    }
    return most;
}

static void add_lift(lifting *l, double most_m) {
    const double step = l->path->curve_m / l->steps;
    /* A hump of so many metres over four times as many to either side; a quarter of the way is the
     * most that one is worth. */
    double reach = 4.0 * most_m / step, quarter = 0.25 * l->steps;
    reach = reach < quarter ? reach : quarter;
    const int half = reach < 4.0 ? 4 : (int)(0.5 * reach);
    spread(l->path, l->missing, l->scratch, l->count, 2 * half + 2);
    blur(l->path, l->missing, l->scratch, l->count, half);
    blur(l->path, l->missing, l->scratch, l->count, half);
    for (int i = 0; i < l->count; i++) {
        l->path->lifts[i] += l->missing[i];
    }
}

/* The length of what is flown: chords of the lifted curve. */
static double flown_length(const vd_camera_path *path, int steps) {
    double length = 0.0;
    vd_vec3 last = vd_vec3_make(0, 0, 0);
    for (int i = 0; i <= steps; i++) {
        double s = path->curve_m * ((double)i / steps);
        vd_vec3 p = vd_path_place(path, s);
        p.z += vd_path_lift(path, s);
        length += i > 0 ? vd_vec3_length(vd_vec3_subtract(p, last)) : 0.0;
        last = p;
    }
    return length;
}

vd_status vd_camera_path_clear(vd_camera_path *path, vd_ground_function *ground, void *user,
                               double clearance_m, vd_path_clearance *out) {
    if (!(clearance_m >= 0.0 && clearance_m <= 1e9)) {
        return vd_failure(VD_ERROR_ARGUMENT, "the clearance is %g m; give 0 to 1e9", clearance_m);
    }
    lifting l = {.path = path, .ground = ground, .user = user};
    l.steps = path->curve_m > 0.0 ? step_count(path, 0.125 * clearance_m) : 1;
    l.count = l.steps + !path->loop;
    vd_path_clearance before = measure(path, ground, user, 2 * l.steps), after = before;
    const size_t bytes = (size_t)l.count * sizeof(double);
    if (before.has_ground && before.lowest_m < clearance_m) {
        double *lifts = vd_allocate_zero(path->context, (size_t)l.count, sizeof(double));
        l.missing = vd_allocate(path->context, (size_t)l.count, sizeof(double));
        l.scratch = vd_allocate(path->context, (size_t)l.count, sizeof(double));
        if (lifts == NULL || l.missing == NULL || l.scratch == NULL) {
            vd_release(path->context, lifts);
            vd_release(path->context, l.missing);
            vd_release(path->context, l.scratch);
            return vd_out_of_memory("a path's lift", 3 * bytes);
        }
        vd_release(path->context, path->lifts); /* of an earlier clearance: begin anew */
        path->lifts = lifts;
        path->lift_count = l.count;
        path->lift_step_m = path->curve_m > 0.0 ? path->curve_m / l.steps : 1.0;
        /* Between the places the ground may be higher still: then ask for as much more. */
        double wanted = clearance_m;
        for (int pass = 0; pass < PASSES && after.lowest_m < clearance_m; pass++) {
            add_lift(&l, find_missing(&l, wanted));
            after = measure(path, ground, user, 2 * l.steps);
            wanted += after.lowest_m < clearance_m ? 1.5 * (clearance_m - after.lowest_m) : 0.0;
        }
        path->flown_m = flown_length(path, l.steps);
        vd_release(path->context, l.missing);
        vd_release(path->context, l.scratch);
    }
    after.unlifted_m = before.lowest_m;
    for (int i = 0; i < path->lift_count; i++) {
        after.lift_m = path->lifts[i] > after.lift_m ? path->lifts[i] : after.lift_m;
    }
    if (out != NULL) {
        *out = after;
    }
    return vd_success();
}

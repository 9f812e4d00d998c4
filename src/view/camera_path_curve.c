/* camera_path_curve.c: the curve through the knots by its arc length, and the lift over it. */
#include <math.h>

#include "view/camera_path_internal.h"

vd_vec3 vd_segment_place(const vd_path_segment *s, double u) {
    vd_vec3 p = vd_vec3_add(s->c[2], vd_vec3_scale(s->c[3], u));
    p = vd_vec3_add(s->c[1], vd_vec3_scale(p, u));
    return vd_vec3_add(s->c[0], vd_vec3_scale(p, u));
}

/* Metres per unit of u. */
static double segment_speed(const vd_path_segment *s, double u) {
    vd_vec3 d = vd_vec3_add(vd_vec3_scale(s->c[2], 2.0), vd_vec3_scale(s->c[3], 3.0 * u));
    return vd_vec3_length(vd_vec3_add(s->c[1], vd_vec3_scale(d, u)));
}

/* Length of the curve between two values of u: Gauss and Legendre's five points. */
static double gauss_length(const vd_path_segment *s, double from, double to) {
    static const double nodes[5] = {-0.906179845938664, -0.5384693101056831, 0.0,
                                    0.5384693101056831, 0.906179845938664};
    static const double weights[5] = {0.23692688505618908, 0.47862867049936647, 0.5688888888888889,
                                      0.47862867049936647, 0.23692688505618908};
    double middle = 0.5 * (from + to), half = 0.5 * (to - from), sum = 0.0;
    for (int i = 0; i < 5; i++) {
        sum += weights[i] * segment_speed(s, middle + half * nodes[i]);
    }
    return half * sum;
}

/* The same, halved where five points are not enough: a sharp turn is a kink of the speed, which
 * they miss by 1 in 1,000. */
static double arc_length(const vd_path_segment *s, double from, double to, double whole,
                         int halvings) {
    const double middle = 0.5 * (from + to);
    const double left = gauss_length(s, from, middle), right = gauss_length(s, middle, to);
    if (halvings == 0 || fabs(left + right - whole) <= 1e-10 * whole) {
        return left + right;
    }
    return arc_length(s, from, middle, left, halvings - 1) +
           arc_length(s, middle, to, right, halvings - 1);
}

static double length_between(const vd_path_segment *s, double from, double to) {
    return arc_length(s, from, to, gauss_length(s, from, to), 8);
}

/* The u at which so many metres of the segment are behind: Newton, kept inside its piece. */
double vd_segment_at_length(const vd_path_segment *s, double length_m) {
    const double whole = s->length_m[VD_PATH_PIECES];
    if (!(length_m > 0.0) || !(whole > 0.0)) {
        return 0.0;
    }
    if (length_m >= whole) {
        return 1.0;
    }
    int piece = 0;
    while (piece + 1 < VD_PATH_PIECES && s->length_m[piece + 1] <= length_m) {
        piece++;
    }
    const double step = 1.0 / VD_PATH_PIECES, start = piece * step;
    const double wanted = length_m - s->length_m[piece];
    const double all = s->length_m[piece + 1] - s->length_m[piece];
    double low = 0.0, high = step, u = all > 0.0 ? step * (wanted / all) : 0.0;
    for (int i = 0; i < 8; i++) {
        double missing = wanted - length_between(s, start, start + u);
        if (missing > 0.0) {
            low = u;
        } else {
            high = u;
        }
        double speed = segment_speed(s, start + u);
        double next = speed > 0.0 ? u + missing / speed : low;
        if (fabs(next - u) < 1e-15) {
            break;
        }
        u = next > low && next < high ? next : 0.5 * (low + high);
    }
    return start + u;
}

/* The segment from b to c between neighbours a and d as a cubic. Barry and Goldman's three steps of
 * interpolation, written out as Hermite's form: tangents times the knot interval. */
static void make_segment(vd_path_segment *s, const vd_vec3 at[4]) {
    double knot[3];
    for (int i = 0; i < 3; i++) {
        knot[i] = sqrt(vd_vec3_length(vd_vec3_subtract(at[i + 1], at[i])));
    }
    *s = (vd_path_segment){.c = {at[1]}};
    if (!(knot[1] > 0.0)) {
        return;
    }
    vd_vec3 chord = vd_vec3_subtract(at[2], at[1]), tangent[2] = {chord, chord};
    for (int i = 0; i < 2; i++) {
        const double outer = knot[2 * i];
        const vd_vec3 beside = i == 0 ? vd_vec3_subtract(at[1], at[0]) /* to the neighbour's knot */
                                      : vd_vec3_subtract(at[3], at[2]);
        if (outer > 0.0) {
            vd_vec3 both = vd_vec3_add(beside, chord);
            tangent[i] = vd_vec3_add(
                chord, vd_vec3_scale(vd_vec3_subtract(vd_vec3_scale(beside, 1.0 / outer),
                                                      vd_vec3_scale(both, 1.0 / (outer + knot[1]))),
                                     knot[1]));
        }
    }
    /* Where the curve begins or ends it is a parabola; alone between two ends, a line. */
    if (knot[0] > 0.0 && !(knot[2] > 0.0)) {
        tangent[1] = vd_vec3_subtract(vd_vec3_scale(chord, 2.0), tangent[0]);
    } else if (knot[2] > 0.0 && !(knot[0] > 0.0)) {
        tangent[0] = vd_vec3_subtract(vd_vec3_scale(chord, 2.0), tangent[1]);
    }
    s->c[1] = tangent[0];
    s->c[2] = vd_vec3_subtract(
        vd_vec3_subtract(vd_vec3_scale(chord, 3.0), vd_vec3_scale(tangent[0], 2.0)), tangent[1]);
    s->c[3] = vd_vec3_subtract(vd_vec3_add(tangent[0], tangent[1]), vd_vec3_scale(chord, 2.0));
    for (int i = 0; i < VD_PATH_PIECES; i++) {
        const double step = 1.0 / VD_PATH_PIECES;
        s->length_m[i + 1] = s->length_m[i] + length_between(s, i * step, (i + 1) * step);
    }
}

void vd_path_make_segments(vd_camera_path *path) {
    const vd_path_knot *knots = path->knots;
    const int n = path->count;
    for (int i = 0; i < path->segment_count; i++) {
        vd_vec3 at[4] = {[1] = knots[i].key.eye, [2] = knots[i + 1].key.eye};
        bool first = i == 0 && !path->loop, last = i + 2 > n - 1 && !path->loop;
        at[0] = first ? at[1] : knots[i > 0 ? i - 1 : n - 1].key.eye;
        at[3] = last ? at[2] : knots[(i + 2) % n].key.eye;
        make_segment(&path->segments[i], at);
        path->knots[i + 1].length_m =
            path->knots[i].length_m + path->segments[i].length_m[VD_PATH_PIECES];
    }
    path->curve_m = path->flown_m = knots[path->segment_count].length_m;
}

/* The last segment that begins at or before a value that rises over the knots. */
int vd_path_find(const vd_camera_path *path, bool by_length, double value) {
    int low = 0, high = path->segment_count;
    while (high - low > 1) {
        int middle = low + (high - low) / 2;
        const vd_path_knot *k = &path->knots[middle];
        if ((by_length ? k->length_m : k->key.time_s) <= value) {
            low = middle;
        } else {
            high = middle;
        }
    }
    return low;
}

vd_vec3 vd_path_place(const vd_camera_path *path, double length_m) {
    int i = vd_path_find(path, true, length_m);
    const vd_path_segment *s = &path->segments[i];
    return vd_segment_place(s, vd_segment_at_length(s, length_m - path->knots[i].length_m));
}

double vd_path_lift(const vd_camera_path *path, double length_m) {
    if (path->lifts == NULL) {
        return 0.0;
    }
    double at = length_m / path->lift_step_m, whole = floor(at), u = at - whole;
    const double v = 1.0 - u;
    const double weights[4] = {v * v * v / 6.0, (4.0 - 6.0 * u * u + 3.0 * u * u * u) / 6.0,
                               (4.0 - 6.0 * v * v + 3.0 * v * v * v) / 6.0, u * u * u / 6.0};
    double sum = 0.0;
    for (int k = 0; k < 4; k++) {
        int j = (int)whole + k - 1;
        if (path->loop) {
            j = (j % path->lift_count + path->lift_count) % path->lift_count;
        }
        j = j < 0 ? 0 : j >= path->lift_count ? path->lift_count - 1 : j;
        sum += weights[k] * path->lifts[j];
    }
    return sum;
}

/* Camera paths: keyframes are met, lengths and speeds are right, nothing jumps, nothing sinks into
 * the ground, and what is no path is refused with a sentence. */
#include <math.h>
#include <stdio.h>

#include "core/real.h"
#include "support.h"
#include <veduta/camera_path.h>

static void assert_close(double a, double b, double tolerance) {
    if (!(fabs(a - b) <= tolerance)) {
        fail_msg("%.17g is not within %g of %.17g", a, tolerance, b);
    }
}

static double distance(vd_vec3 a, vd_vec3 b) {
    return vd_vec3_length(vd_vec3_subtract(a, b));
}

/* To the last bit; between the fields there is padding. */
static void assert_same_camera(const vd_camera *a, const vd_camera *b) {
    assert_memory_equal(&a->eye, &b->eye, sizeof a->eye);
    assert_memory_equal(&a->orientation, &b->orientation, sizeof a->orientation);
    assert_memory_equal(&a->lens, &b->lens, sizeof a->lens);
    assert_true(a->projection == b->projection && a->near_m == b->near_m && a->far_m == b->far_m);
}

/* The angle between two orientations, in radians. */
static double angle_between(vd_quat a, vd_quat b) {
    vd_quat d = vd_quat_multiply((vd_quat){-a.x, -a.y, -a.z, a.w}, b);
    return 2.0 * atan2(sqrt(d.x * d.x + d.y * d.y + d.z * d.z), fabs(d.w));
}

static vd_context *context;

static int set_up(void **state) {
    (void)state;
    context = test_context(1, VD_ISA_AUTO);
    return 0;
}

static int tear_down(void **state) {
    (void)state;
    vd_context_destroy(&context);
    return 0;
}

enum { KEYS = 7 };

/* Keyframes anywhere in a cube of 1 km, level unless `rolled`. */
static void random_keyframes(uint64_t *random, vd_keyframe keys[KEYS], bool rolled) {
    double time = 3.0 * test_uniform(random);
    for (int i = 0; i < KEYS; i++) {
        keys[i].time_s = time;
        time += 0.5 + 4.0 * test_uniform(random);
        keys[i].eye = vd_vec3_make(1000.0 * test_uniform(random), 1000.0 * test_uniform(random),
                                   1000.0 * test_uniform(random));
        double heading = 2.0 * VD_PI * test_uniform(random);
        double pitch = 2.0 * (test_uniform(random) - 0.5);
        double roll = rolled ? 2.0 * (test_uniform(random) - 0.5) : 0.0;
        keys[i].orientation = vd_orientation_from_angles(heading, pitch, roll);
        keys[i].fov_y_rad = 0.3 + test_uniform(random);
    }
}

static vd_camera_path *make(const vd_keyframe *keys, int count, bool timed, bool loop,
                            double ease_s) {
    vd_camera_path_def def = vd_camera_path_def_default();
    def.keyframes = keys;
    def.count = count;
    def.timed = timed;
    def.loop = loop;
    def.ease_s = ease_s;
    def.speed_mps = timed ? 0.0 : 50.0;
    vd_camera_path *path = NULL;
    assert_ok(vd_camera_path_create(context, &def, &path));
    return path;
}

/* The length of a path as its eye says, in fine chords. */
static double brute_length(const vd_camera_path *path, int steps) {
    double length = 0.0, all = vd_camera_path_duration(path);
    vd_vec3 last = vd_camera_path_pose(path, 0.0).eye;
    for (int i = 1; i <= steps; i++) {
        double t = i == steps && vd_camera_path_loops(path) ? 0.0 : all * i / steps;
        vd_vec3 p = vd_camera_path_pose(path, t).eye;
        length += distance(last, p);
        last = p;
    }
    return length;
}

/* ---- the tests --------------------------------------------------------------------------------
 */

static void keyframes_are_met(void **state) {
    (void)state;
    uint64_t random = 1;
    vd_keyframe keys[KEYS];
    for (int round = 0; round < 200; round++) {
        const bool timed = (round & 1) != 0, loop = (round & 2) != 0, rolled = (round & 4) != 0;
        const double ease_s = (round & 8) != 0 ? 2.0 : 0.0;
        random_keyframes(&random, keys, rolled);
        vd_camera_path *path = make(keys, KEYS, timed, loop, ease_s);
        assert_int_equal(vd_camera_path_keyframe_count(path), KEYS);
        for (int i = 0; i < KEYS; i++) {
            const vd_keyframe own = vd_camera_path_keyframe(path, i);
            if (timed) { /* with or without ease: when they said */
                assert_close(own.time_s, keys[i].time_s - keys[0].time_s, 1e-9);
            }
            const vd_keyframe pose = vd_camera_path_pose(path, own.time_s);
            assert_close(distance(pose.eye, keys[i].eye), 0.0, 1e-4);
            assert_close(angle_between(pose.orientation, keys[i].orientation), 0.0, 1e-5);
            assert_close(pose.fov_y_rad, keys[i].fov_y_rad, 1e-6);
        }
        vd_camera_path_destroy(&path);
        assert_null(path);
    }
}

static void length_is_that_of_the_curve(void **state) {
    (void)state;
    uint64_t random = 2;
    vd_keyframe keys[KEYS];
    for (int round = 0; round < 8; round++) {
        random_keyframes(&random, keys, false);
        vd_camera_path *path = make(keys, KEYS, (round & 1) != 0, (round & 2) != 0, 1.0);
        double brute = brute_length(path, 40000), length = vd_camera_path_length(path);
        assert_true(brute <= length * (1.0 + 1e-9)); /* chords are shorter */
        assert_close(brute, length, 2e-6 * length);
        vd_camera_path_destroy(&path);
    }
}

static void speed_is_constant_without_times(void **state) {
    (void)state;
    uint64_t random = 3;
    vd_keyframe keys[KEYS];
    random_keyframes(&random, keys, false);
    vd_camera_path *path = make(keys, KEYS, false, false, 0.0);
    double all = vd_camera_path_duration(path);
    assert_close(all, vd_camera_path_length(path) / 50.0, 1e-9 * all);
    for (int i = 0; i < 5000; i++) {
        double t = (all - 2e-4) * i / 5000;
        vd_vec3 a = vd_camera_path_pose(path, t).eye, b = vd_camera_path_pose(path, t + 1e-4).eye;
        assert_close(distance(a, b) / 1e-4, 50.0, 0.02);
    }
    vd_camera_path_destroy(&path);
}

/* Speeds and turning speeds change by little from one short step to the next, over the keyframes
 * too. */
static void nothing_jumps(void **state) {
    (void)state;
    uint64_t random = 4;
    vd_keyframe keys[KEYS];
    for (int round = 0; round < 16; round++) {
        const bool timed = (round & 1) != 0, loop = (round & 2) != 0;
        random_keyframes(&random, keys, (round & 4) != 0);
        for (int i = 0; i < KEYS; i++) { /* around a ring: no turn is nearly a reversal */
            double r = 800.0 + 400.0 * test_uniform(&random), a = 2.0 * VD_PI * i / KEYS;
            keys[i].eye.x = r * sin(a);
            keys[i].eye.y = r * cos(a);
        }
        vd_camera_path *path = make(keys, KEYS, timed, loop, (round & 8) != 0 ? 1.0 : 0.0);
        const double all = vd_camera_path_duration(path), step = 1e-4;
        for (int i = 0; i < KEYS; i++) {
            double t = vd_camera_path_keyframe(path, i).time_s;
            if (!loop && (t < 3.0 * step || t > all - 3.0 * step)) {
                continue;
            }
            vd_keyframe p[5];
            for (int k = 0; k < 5; k++) {
                double at = t + step * (k - 2);
                p[k] = vd_camera_path_pose(path, at < 0.0 ? at + all : at);
            }
            vd_vec3 before = vd_vec3_subtract(p[1].eye, p[0].eye),
                    after = vd_vec3_subtract(p[4].eye, p[3].eye);
            double fast = vd_vec3_length(before) + vd_vec3_length(after);
            if (!(distance(before, after) < 0.03 * fast + 1e-7)) {
                fail_msg("round %d key %d: %g of %g", round, i, distance(before, after), fast);
            }
            double turn_before = angle_between(p[0].orientation, p[1].orientation);
            double turn_after = angle_between(p[3].orientation, p[4].orientation);
            assert_close(turn_before, turn_after, 0.05 * (turn_before + turn_after) + 1e-7);
        }
        /* No step anywhere is longer than the fastest speed allows. */
        vd_keyframe last = vd_camera_path_pose(path, 0.0);
        for (int i = 1; i < 4000; i++) {
            vd_keyframe here = vd_camera_path_pose(path, all * i / 4000);
            assert_true(distance(here.eye, last.eye) < 40.0 * vd_camera_path_length(path) / 4000);
            assert_true(angle_between(here.orientation, last.orientation) < 0.2);
            last = here;
        }
        vd_camera_path_destroy(&path);
    }
}

/* The published property: within a segment the centripetal curve stays by its chord and has no
 * cusp, however uneven the keyframes are. */
static void uneven_keyframes_make_no_loops(void **state) {
    (void)state;
    vd_keyframe keys[4] = {
        {.eye = {0, 0, 0}}, {.eye = {1000, 0, 0}}, {.eye = {1001, 1, 0}}, {.eye = {0, 2, 0}}};
    for (int i = 0; i < 4; i++) {
        keys[i].orientation = vd_orientation_from_angles(0, 0, 0);
        keys[i].fov_y_rad = 1.0;
    }
    vd_camera_path *path = make(keys, 4, false, false, 0.0);
    double from = vd_camera_path_keyframe(path, 1).time_s;
    double to = vd_camera_path_keyframe(path, 2).time_s, most_x = 0.0;
    for (int i = 0; i <= 1000; i++) {
        vd_vec3 p = vd_camera_path_pose(path, from + (to - from) * i / 1000).eye;
        most_x = p.x > most_x ? p.x : most_x;
        assert_true(p.x > 999.0 && p.y > -1.0 && p.y < 2.0);
    }
    assert_true(most_x < 1003.0); /* uniform knots swing out to beyond 1,060 */
    vd_camera_path_destroy(&path);
}

static void level_keyframes_keep_the_horizon(void **state) {
    (void)state;
    uint64_t random = 5;
    vd_keyframe keys[KEYS];
    random_keyframes(&random, keys, false);
    vd_camera_path *path = make(keys, KEYS, true, false, 1.0);
    for (int i = 0; i <= 1000; i++) {
        double heading, pitch, roll;
        vd_camera camera;
        vd_camera_path_at(path, vd_camera_path_duration(path) * i / 1000, 640, 360, &camera);
        vd_orientation_to_angles(camera.orientation, &heading, &pitch, &roll);
        assert_close(roll, 0.0, 1e-9);
        assert_ok(vd_camera_validate(&camera));
    }
    vd_camera_path_destroy(&path);
}

static void ease_gathers_and_loses_speed(void **state) {
    (void)state;
    uint64_t random = 6;
    vd_keyframe keys[KEYS];
    for (int round = 0; round < 8; round++) {
        const bool timed = (round & 1) != 0;
        random_keyframes(&random, keys, false);
        vd_camera_path *path = make(keys, (round & 2) != 0 ? 2 : KEYS, timed, false, 1.0);
        double all = vd_camera_path_duration(path), last = 0.0;
        vd_vec3 first = vd_camera_path_pose(path, 0.0).eye;
        double moved = distance(first, vd_camera_path_pose(path, 0.01).eye);
        double end =
            distance(vd_camera_path_pose(path, all - 0.01).eye, vd_camera_path_pose(path, all).eye);
        double mean = 0.01 * vd_camera_path_length(path) / all;
        assert_true(moved < 0.1 * mean && end < 0.1 * mean);
        for (int i = 0; i < KEYS && i < vd_camera_path_keyframe_count(path); i++) {
            double time = vd_camera_path_keyframe(path, i).time_s;
            assert_true(time >= last && time <= all);
            last = time;
        }
        vd_camera_path_destroy(&path);
    }
    /* Before the beginning and after the end the camera stands. */
    vd_camera_path *path = make(keys, KEYS, false, false, 1.0);
    double all = vd_camera_path_duration(path);
    assert_close(distance(vd_camera_path_pose(path, -5.0).eye, keys[0].eye), 0.0, 1e-9);
    assert_close(distance(vd_camera_path_pose(path, all + 5.0).eye, keys[KEYS - 1].eye), 0.0, 1e-9);
    vd_camera_path_destroy(&path);
}

static void rests_and_turns_on_the_spot(void **state) {
    (void)state;
    vd_keyframe keys[5];
    for (int i = 0; i < 5; i++) {
        keys[i] = (vd_keyframe){.time_s = 2.0 * i, .fov_y_rad = 0.8};
        keys[i].eye = vd_vec3_make(i < 1 ? 0.0 : i < 4 ? 100.0 : 200.0, 10.0, 50.0);
        keys[i].orientation = vd_orientation_from_angles(i < 3 ? 0.0 : 1.0, 0.0, 0.0);
    }
    vd_camera_path *path = make(keys, 5, true, false, 0.0);
    /* From 2 s to 4 s it stands still to the last bit; then it turns where it stands. */
    vd_camera one, other;
    vd_camera_path_at(path, 2.5, 640, 360, &one);
    for (int i = 0; i <= 50; i++) {
        vd_camera_path_at(path, 2.0 + 0.04 * i, 640, 360, &other);
        assert_same_camera(&one, &other);
    }
    vd_camera_path_at(path, 5.0, 640, 360, &other);
    assert_close(distance(one.eye, other.eye), 0.0, 1e-9);
    assert_true(angle_between(one.orientation, other.orientation) > 0.3);
    vd_camera_path_destroy(&path);
    /* A path may be a turn and nothing else; its length is 0. */
    path = make(&keys[2], 2, true, false, 1.0);
    assert_true(vd_camera_path_length(path) == 0.0);
    assert_close(vd_camera_path_duration(path), 2.0, 0.0);
    assert_close(angle_between(vd_camera_path_pose(path, 1.0).orientation,
                               vd_orientation_from_angles(0.5, 0, 0)),
                 0.0, 1e-9);
    vd_camera_path_destroy(&path);
}

static void duration_scales_times(void **state) {
    (void)state;
    uint64_t random = 7;
    vd_keyframe keys[KEYS];
    random_keyframes(&random, keys, false);
    vd_camera_path_def def = vd_camera_path_def_default();
    def.keyframes = keys;
    def.count = KEYS;
    def.timed = true;
    def.duration_s = 100.0;
    vd_camera_path *path = NULL;
    assert_ok(vd_camera_path_create(context, &def, &path));
    assert_close(vd_camera_path_duration(path), 100.0, 0.0);
    double all = keys[KEYS - 1].time_s - keys[0].time_s;
    assert_close(vd_camera_path_keyframe(path, 3).time_s,
                 100.0 * (keys[3].time_s - keys[0].time_s) / all, 1e-9);
    vd_camera_path_destroy(&path);
}

static void orbit_is_a_circle(void **state) {
    (void)state;
    vd_orbit_def def = vd_orbit_def_default();
    def.centre = vd_vec3_make(3000, -2000, 700);
    for (int round = 0; round < 4; round++) {
        def.turns = round == 0 ? 1.0 : round == 1 ? -2.0 : round == 2 ? 0.4 : 1.25;
        vd_camera_path *path = NULL;
        assert_ok(vd_camera_path_create_orbit(context, &def, &path));
        assert_int_equal(vd_camera_path_loops(path), round < 2);
        double round_s = def.duration_s / (round == 1 ? 2.0 : 1.0);
        assert_close(vd_camera_path_duration(path), round_s, 1e-12);
        double turns = round == 1 ? 1.0 : fabs(def.turns);
        assert_close(vd_camera_path_length(path), 2 * VD_PI * 1000 * turns, 0.05);
        for (int i = 0; i <= 500; i++) {
            vd_camera camera;
            double x, y, z, t = round_s * i / 500;
            vd_camera_path_at(path, t, 640, 360, &camera);
            vd_vec3 d = vd_vec3_subtract(camera.eye, def.centre);
            assert_close(sqrt(d.x * d.x + d.y * d.y), 1000.0, 0.02);
            assert_close(d.z, 500.0, 1e-9);
            assert_true(vd_camera_project(&camera, def.centre, &x, &y, &z));
            assert_close(x, 320.0, 0.02);
            assert_close(y, 180.0, 0.02);
        }
        /* It begins in the south; a quarter of a clockwise turn later it is in the west. */
        vd_vec3 start = vd_vec3_subtract(vd_camera_path_pose(path, 0.0).eye, def.centre);
        assert_close(start.x, 0.0, 1e-6);
        assert_close(start.y, -1000.0, 1e-6);
        if (round == 0) {
            vd_vec3 p = vd_vec3_subtract(vd_camera_path_pose(path, 5.0).eye, def.centre);
            assert_close(p.x, -1000.0, 0.02);
            vd_keyframe one = vd_camera_path_pose(path, 1.0), later = one;
            later = vd_camera_path_pose(path, 1.0 + 20.0);
            assert_close(distance(one.eye, later.eye), 0.0, 1e-6);
        }
        vd_camera_path_destroy(&path);
    }
}

/* ---- ground -----------------------------------------------------------------------------------
 */

/* Hills of 200 m every 500 m, a needle, and no ground beyond x = 5000. */
static double hills(void *user, double x, double y) {
    if (user != NULL) {
        ++*(int *)user;
    }
    if (x > 5000.0) {
        return (double)-INFINITY;
    }
    double needle = fabs(x - 1730.0) < 12.0 && fabs(y) < 300.0 ? 400.0 : 0.0;
    return 100.0 + 100.0 * sin(x / 80.0) * cos(y / 90.0) + needle;
}

static void clearance_is_kept(void **state) {
    (void)state;
    uint64_t random = 8;
    for (int round = 0; round < 12; round++) {
        vd_keyframe keys[KEYS];
        for (int i = 0; i < KEYS; i++) {
            double r = round & 1 ? 1500.0 : 3000.0;
            keys[i] = (vd_keyframe){.fov_y_rad = 0.8};
            keys[i].eye = vd_vec3_make(r * test_uniform(&random), r * test_uniform(&random),
                                       50.0 + 300.0 * test_uniform(&random));
            keys[i].orientation = vd_orientation_from_angles(0, 0, 0);
        }
        vd_camera_path *path = make(keys, KEYS, false, (round & 2) != 0, 1.0);
        vd_path_clearance before = vd_camera_path_measure(path, hills, NULL, 0.0), after;
        assert_true(before.has_ground && before.lowest_m < 20.0);
        /* What it says is where it says. */
        vd_vec3 p = vd_camera_path_pose(path, before.time_s).eye;
        assert_close(p.z - hills(NULL, p.x, p.y), before.lowest_m, 0.5);
        double length = vd_camera_path_length(path);
        assert_ok(vd_camera_path_clear(path, hills, NULL, 20.0, &after));
        assert_true(after.lowest_m >= 20.0 && after.lift_m >= 20.0 - before.lowest_m - 1.0);
        assert_true(vd_camera_path_length(path) != length);
        assert_close(brute_length(path, 40000), vd_camera_path_length(path), 2e-3 * length);
        vd_camera_path *low = make(keys, KEYS, false, (round & 2) != 0, 1.0);
        double all = vd_camera_path_duration(path), speed = 0.0, last = 0.0;
        for (int i = 1; i < 60000; i++) {
            vd_vec3 here = vd_camera_path_pose(path, all * i / 60000).eye;
            assert_true(here.z - hills(NULL, here.x, here.y) > 19.0);
            /* Climbing begins and ends softly. */
            double lift = here.z - vd_camera_path_pose(low, all * i / 60000).eye.z;
            double climb = (lift - last) / (all / 60000);
            assert_true(i < 3 || fabs(climb - speed) < 1.0);
            speed = climb;
            last = lift;
        }
        vd_camera_path_destroy(&low);
        vd_camera_path_destroy(&path);
    }
}

static void clear_paths_stay(void **state) {
    (void)state;
    vd_keyframe keys[3];
    for (int i = 0; i < 3; i++) {
        keys[i] = (vd_keyframe){.eye = {1000.0 * i, 500.0, 700.0}, .fov_y_rad = 0.8};
        keys[i].orientation = vd_orientation_from_angles(0, 0, 0);
    }
    vd_camera_path *path = make(keys, 3, false, false, 1.0);
    vd_camera one, other;
    vd_camera_path_at(path, 13.0, 640, 360, &one);
    vd_path_clearance found;
    assert_ok(vd_camera_path_clear(path, hills, NULL, 50.0, &found));
    vd_camera_path_at(path, 13.0, 640, 360, &other);
    assert_same_camera(&one, &other);
    assert_true(found.lift_m == 0.0 && found.lowest_m >= 500.0);
    assert_int_equal(vd_camera_path_clear(path, hills, NULL, -1.0, NULL).code, VD_ERROR_ARGUMENT);
    vd_camera_path_destroy(&path);
    /* Off the map there is nothing to be clear of. */
    for (int i = 0; i < 3; i++) {
        keys[i].eye.x += 6000.0;
        keys[i].eye.z = -100.0;
    }
    path = make(keys, 3, false, false, 1.0);
    assert_ok(vd_camera_path_clear(path, hills, NULL, 50.0, &found));
    assert_false(found.has_ground);
    assert_true(vd_camera_path_pose(path, 0.0).eye.z == -100.0);
    vd_camera_path_destroy(&path);
}

static void tracks_walk_over_the_ground(void **state) {
    (void)state;
    double points[60][3];
    for (int i = 0; i < 60; i++) { /* zigzag to the north-east, with repeats */
        points[i][0] = 60.0 * (i / 2 * 2);
        points[i][1] = 30.0 * (i / 2 * 2) + (i % 4 < 2 ? 0.0 : 60.0);
        points[i][2] = (double)NAN;
    }
    int asked = 0;
    vd_track_def def = vd_track_def_default();
    def.points = (const double(*)[3])points;
    def.count = 60;
    def.ground = hills;
    def.ground_user = &asked;
    def.smooth_s = 4.0;
    vd_camera_path *path = NULL;
    assert_ok(vd_camera_path_create_track(context, &def, &path));
    assert_true(asked > 0);
    double all = vd_camera_path_duration(path);
    assert_close(vd_camera_path_length(path) / all, 40.0, 1e-6);
    vd_vec3 end = vd_camera_path_pose(path, all).eye, begin = vd_camera_path_pose(path, 0.0).eye;
    assert_close(begin.x, points[0][0], 1e-6);
    assert_close(begin.y, points[0][1], 1e-6);
    assert_close(end.x, points[59][0], 1e-6);
    assert_close(end.y, points[59][1], 1e-6);
    double last = 0.0;
    for (int i = 0; i < 2000; i++) {
        double heading, pitch, roll;
        vd_keyframe pose = vd_camera_path_pose(path, all * i / 2000);
        vd_orientation_to_angles(pose.orientation, &heading, &pitch, &roll);
        assert_close(pitch, vd_radians(-10.0), 1e-3);
        assert_close(roll, 0.0, 1e-9);
        /* Smoothed: it looks along the whole, 63° from north, not along every zig and zag. */
        assert_true(heading > 0.3 && heading < 1.6);
        assert_true(i == 0 || fabs(heading - last) < 0.05);
        last = heading;
    }
    assert_ok(vd_camera_path_clear(path, hills, NULL, 60.0, NULL));
    assert_true(vd_camera_path_measure(path, hills, NULL, 0.0).lowest_m >= 60.0);
    vd_camera_path_destroy(&path);

    /* With a duration the speed follows; with heights of its own it needs no ground. */
    for (int i = 0; i < 60; i++) {
        points[i][2] = 1234.0;
    }
    def.has_z = def.follow_z = true;
    def.ground = NULL;
    def.duration_s = 30.0;
    assert_ok(vd_camera_path_create_track(context, &def, &path));
    assert_close(vd_camera_path_duration(path), 30.0, 1e-9);
    assert_close(vd_camera_path_pose(path, 11.0).eye.z, 1334.0, 1e-6);
    vd_camera_path_destroy(&path);
}

/* ---- what is refused --------------------------------------------------------------------------
 */

static void expect(vd_status status, vd_code code, const char *part) {
    if (status.code != code || strstr(status.message, part) == NULL) {
        fail_msg("wanted \"%s\", got %s: %s", part, vd_code_name(status.code), status.message);
    }
}

static void bad_paths_are_refused(void **state) {
    (void)state;
    uint64_t random = 9;
    vd_keyframe keys[KEYS];
    vd_camera_path *path = NULL;
    for (int kind = 0; kind < 16; kind++) {
        static const char *const parts[16] = {"two keyframes at least and has 1",
                                              "has 0",
                                              "the eye's y is nan",
                                              "the eye's z is inf",
                                              "the orientation's length",
                                              "field of view in degrees is 180",
                                              "the time is nan",
                                              "is not after keyframe 2's",
                                              "keyframes 2 and 3 are at the same place",
                                              "nothing moves",
                                              "the path's speed is 0",
                                              "the path's ease is nan",
                                              "the path's near distance is 0",
                                              "comes twice",
                                              "the path takes",
                                              "keyframes 3 and 4 are so near"};
        random_keyframes(&random, keys, false);
        vd_camera_path_def def = vd_camera_path_def_default();
        def.keyframes = keys;
        def.count = KEYS;
        def.timed = kind == 6 || kind == 7;
        def.speed_mps = 50.0;
        switch (kind) {
        case 0:
            def.count = 1;
            break;
        case 1:
            def.keyframes = NULL;
            break;
        case 2:
            keys[3].eye.y = (double)NAN;
            break;
        case 3:
            keys[3].eye.z = (double)INFINITY;
            break;
        case 4:
            keys[2].orientation.w += 1.0;
            break;
        case 5:
            keys[2].fov_y_rad = VD_PI;
            break;
        case 6:
            keys[2].time_s = (double)NAN;
            break;
        case 7:
            keys[2].time_s = keys[1].time_s;
            break;
        case 8:
            keys[2].eye = keys[1].eye;
            break;
        case 9:
            def.timed = true;
            for (int i = 1; i < KEYS; i++) {
                keys[i] = keys[0];
                keys[i].time_s = keys[0].time_s + i;
            }
            break;
        case 10:
            def.speed_mps = 0.0;
            break;
        case 11:
            def.ease_s = (double)NAN;
            break;
        case 12:
            def.near_m = 0.0;
            break;
        case 13:
            def.loop = true;
            keys[KEYS - 1].eye = keys[0].eye;
            break;
        case 14:
            def.speed_mps = 1e-9;
            break;
        default:
            def.speed_mps = 1e12;
            keys[3].eye = keys[2].eye = vd_vec3_make(0, 0, 0);
            keys[3].eye.x = 1e-9;
            keys[1].eye.x = 1e15;
            break;
        }
        expect(vd_camera_path_create(context, &def, &path), VD_ERROR_ARGUMENT, parts[kind]);
        assert_null(path);
    }
}

static void bad_shapes_are_refused(void **state) {
    (void)state;
    vd_camera_path *path = NULL;
    vd_orbit_def orbit = vd_orbit_def_default();
    orbit.radius_m = 0.0;
    expect(vd_camera_path_create_orbit(context, &orbit, &path), VD_ERROR_ARGUMENT, "radius is 0");
    orbit = vd_orbit_def_default();
    orbit.turns = (double)NAN;
    expect(vd_camera_path_create_orbit(context, &orbit, &path), VD_ERROR_ARGUMENT, "turns is nan");
    orbit.turns = 1e5;
    expect(vd_camera_path_create_orbit(context, &orbit, &path), VD_ERROR_LIMIT, "more than 1000");

    double points[3][3] = {{0, 0, 0}, {0, 0, 5}, {0, 0, 0}};
    vd_track_def track = vd_track_def_default();
    expect(vd_camera_path_create_track(context, &track, &path), VD_ERROR_ARGUMENT, "0 points");
    track.points = (const double(*)[3])points;
    track.count = 1;
    expect(vd_camera_path_create_track(context, &track, &path), VD_ERROR_ARGUMENT, "1 point,");
    track.count = 3;
    expect(vd_camera_path_create_track(context, &track, &path), VD_ERROR_ARGUMENT, "no ground");
    track.ground = hills;
    expect(vd_camera_path_create_track(context, &track, &path), VD_ERROR_ARGUMENT, "at one place");
    points[1][0] = (double)NAN;
    expect(vd_camera_path_create_track(context, &track, &path), VD_ERROR_ARGUMENT, "point 2");
    for (int i = 0; i < 3; i++) {
        points[i][0] = 9000.0 + 100.0 * i;
    }
    expect(vd_camera_path_create_track(context, &track, &path), VD_ERROR_ARGUMENT, "outside");
    track.look_ahead_s = 0.0;
    expect(vd_camera_path_create_track(context, &track, &path), VD_ERROR_ARGUMENT, "ahead is 0");
    assert_null(path);
}

static void memory_may_run_out(void **state) {
    (void)state;
    double points[4][3] = {{0, 0, 0}, {300, 0, 0}, {300, 300, 0}, {600, 300, 0}};
    vd_track_def track = vd_track_def_default();
    track.points = (const double(*)[3])points;
    track.count = 4;
    track.ground = hills;
    track.height_m = 5.0;
    for (int fail_at = 1; fail_at < 20; fail_at++) {
        test_allocator allocator = {.calls = 0};
        vd_context *failing = test_failing_context(&allocator);
        const int live = allocator.live;
        vd_camera_path *path = NULL;
        allocator.calls = 0;
        allocator.fail_at = fail_at;
        vd_status status = vd_camera_path_create_track(failing, &track, &path);
        if (status.code == VD_OK) {
            status = vd_camera_path_clear(path, hills, NULL, 50.0, NULL);
        }
        assert_int_equal(status.code, allocator.calls >= fail_at ? VD_ERROR_MEMORY : VD_OK);
        vd_camera_path_destroy(&path);
        assert_int_equal(allocator.live, live);
        vd_context_destroy(&failing);
    }
}

/* Asking takes no memory. */
static void asking_allocates_nothing(void **state) {
    (void)state;
    uint64_t random = 10;
    vd_keyframe keys[KEYS];
    random_keyframes(&random, keys, false);
    vd_camera_path *path = make(keys, KEYS, false, false, 1.0);
    uint64_t before = vd_context_memory(context).allocations;
    vd_camera camera;
    for (int i = 0; i < 1000; i++) {
        vd_camera_path_at(path, 0.01 * i, 640, 360, &camera);
    }
    vd_camera_path_at(path, (double)NAN, 640, 360, &camera);
    assert_ok(vd_camera_validate(&camera));
    assert_int_equal(vd_context_memory(context).allocations, before);
    vd_camera_path_destroy(&path);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(keyframes_are_met),
        cmocka_unit_test(length_is_that_of_the_curve),
        cmocka_unit_test(speed_is_constant_without_times),
        cmocka_unit_test(nothing_jumps),
        cmocka_unit_test(uneven_keyframes_make_no_loops),
        cmocka_unit_test(level_keyframes_keep_the_horizon),
        cmocka_unit_test(ease_gathers_and_loses_speed),
        cmocka_unit_test(rests_and_turns_on_the_spot),
        cmocka_unit_test(duration_scales_times),
        cmocka_unit_test(orbit_is_a_circle),
        cmocka_unit_test(clearance_is_kept),
        cmocka_unit_test(clear_paths_stay),
        cmocka_unit_test(tracks_walk_over_the_ground),
        cmocka_unit_test(bad_paths_are_refused),
        cmocka_unit_test(bad_shapes_are_refused),
        cmocka_unit_test(memory_may_run_out),
        cmocka_unit_test(asking_allocates_nothing),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}

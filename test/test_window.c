/* test_window.c: what stands behind the window, without one: motion, pace, options, pixels, cards.
 */
#include "support.h"

#include <jansson.h>
#include <math.h>
#include <stdio.h>
#include <unistd.h>

#include "../app/window_cards.h"
#include "../app/window_look.h"
#include "../app/window_motion.h"
#include "../app/window_pace.h"
#include "../app/window_path.h"
#include "../app/window_pixels.h"
#include "../app/window_text.h"
#include "../app/window_threads.h"

/* ---- motion ------------------------------------------------------------------------------------
 */

static vd_motion_state random_state(uint64_t *seed) {
    return (vd_motion_state){
        .eye = {1e4 * test_uniform(seed), 1e4 * test_uniform(seed), 3e3 + test_uniform(seed)},
        .heading = 360.0 * test_uniform(seed),
        .pitch = 60.0 * test_uniform(seed) - 30.0,
        .fov = 40.0,
        .exaggeration = 1.0,
        .haze_m = 1e5};
}

/* Where keys of one kind are held, the end does not hang on the number of steps. */
static void motion_is_the_same_at_every_frame_rate(void **unused) {
    (void)unused;
    const vd_motion_world world = {NULL, NULL, 1e5};
    uint64_t seed = 1;
    for (int axis = 0; axis < VD_MOTION_COUNT; axis++) {
        const vd_motion_state start = random_state(&seed);
        vd_motion_state few = start, many = start;
        vd_motion a = vd_motion_start(), b = vd_motion_start();
        a.wanted[axis] = b.wanted[axis] = 0.8;
        for (int i = 0; i < 10; i++) {
            vd_motion_advance(&a, &world, 0.05, &few);
        }
        for (int i = 0; i < 1000; i++) {
            vd_motion_advance(&b, &world, 0.0005, &many);
        }
        const double *f = (const double *)&few, *m = (const double *)&many,
                     *s = (const double *)&start;
        bool moved = false;
        for (size_t i = 0; i < sizeof few / sizeof *f; i++) {
            assert_true(fabs(f[i] - m[i]) <= 1e-9 * (1.0 + fabs(m[i])));
            moved |= f[i] != s[i];
        }
        assert_true(moved);
    }
}

static void motion_dies_down(void **unused) {
    (void)unused;
    const vd_motion_world world = {NULL, NULL, 1e5};
    uint64_t seed = 2;
    vd_motion_state state = random_state(&seed);
    vd_motion motion = vd_motion_start();
    assert_false(vd_motion_active(&motion));
    motion.wanted[VD_MOTION_FORWARD] = 1.0;
    for (int i = 0; i < 60; i++) {
        vd_motion_advance(&motion, &world, 1.0 / 60.0, &state);
    }
    motion.wanted[VD_MOTION_FORWARD] = 0.0;
    int steps = 0;
    for (; vd_motion_active(&motion) && steps < 1000; steps++) {
        vd_motion_advance(&motion, &world, 1.0 / 60.0, &state);
    }
    assert_in_range(steps, 5, 60);
}

static double hills(void *user, double x, double y) {
    (void)user;
    return x < -5e3 ? (double)-INFINITY : 900.0 * sin(x * 2e-3) * cos(y * 1.3e-3);
}

static void the_eye_stays_above_the_ground(void **unused) {
    (void)unused;
    const vd_motion_world world = {hills, NULL, 1e4};
    uint64_t seed = 3;
    vd_motion_state state = random_state(&seed);
    vd_motion motion = vd_motion_start();
    double last = state.eye[2];
    double most_step = 0.0;
    state.heading = 90.0;
    state.pitch = -80.0;
    motion.wanted[VD_MOTION_FORWARD] = 1.0;
    motion.wanted[VD_MOTION_RISE] = -1.0;
    for (int i = 0; i < 4000; i++) {
        vd_motion_advance(&motion, &world, 1.0 / 60.0, &state);
        assert_true(state.eye[2] >=
                    hills(NULL, state.eye[0], state.eye[1]) + VD_MOTION_CLEARANCE_M);
        if (i > 600) {
            most_step = fmax(most_step, fabs(state.eye[2] - last));
        }
        last = state.eye[2];
    }
    assert_true(most_step < 6.0); /* metres in a sixtieth of a second: no jumps */
}

static void turning_goes_around_and_not_over(void **unused) {
    (void)unused;
    vd_motion_state state = {.heading = 350.0, .pitch = 80.0};
    vd_motion_turn(&state, 20.0, 30.0);
    assert_true(fabs(state.heading - 10.0) < 1e-9 && state.pitch == 89.0);
    vd_motion_turn(&state, -30.0, -400.0);
    assert_true(fabs(state.heading - 340.0) < 1e-9 && state.pitch == -89.0);
}

/* ---- pace --------------------------------------------------------------------------------------
 */

/* A machine whose pictures cost by their pixels, with noise. */
static double cost(double full_s, double scale, uint64_t *seed) {
    return full_s * scale * scale * (0.95 + 0.1 * test_uniform(seed));
}

static void pace_holds_the_rate_where_it_can(void **unused) {
    (void)unused;
    const double period = 1.0 / 60.0;
    uint64_t seed = 4;
    for (double full = 0.2; full < 1.7; full += 0.1) {
        vd_pace pace = vd_pace_start(period);
        int late = 0, changes = 0;
        for (int i = 0; i < 600; i++) {
            const double taken = cost(full * period, pace.scale, &seed);
            const double before = pace.scale;
            vd_pace_note(&pace, taken);
            assert_true(pace.scale >= VD_PACE_LEAST && pace.scale <= 1.0);
            late += i >= 30 && taken > period;
            changes += i >= 200 && pace.scale != before;
        }
        const double least = full * VD_PACE_LEAST * VD_PACE_LEAST;
        assert_true(least > 0.8 || late == 0);
        assert_in_range(changes, 0, 4); /* it does not hunt */
        assert_true(full > 0.7 || pace.scale == 1.0);
        assert_true(least < 0.9 || pace.scale == VD_PACE_LEAST);
    }
}

static void pace_grows_again(void **unused) {
    (void)unused;
    vd_pace pace = vd_pace_start(1.0 / 60.0);
    for (int i = 0; i < 50; i++) {
        vd_pace_note(&pace, 0.03);
    }
    assert_true(pace.scale == VD_PACE_LEAST);
    for (int i = 0; i < 400; i++) {
        vd_pace_note(&pace, 0.004);
    }
    assert_true(pace.scale == 1.0);
}

static void shares_of_times(void **unused) {
    (void)unused;
    vd_times times = {.count = 0};
    assert_true(vd_times_share(&times, 0.5) == 0.0);
    for (int i = 100; i >= 1; i--) {
        vd_times_add(&times, i);
    }
    assert_true(vd_times_share(&times, 0.5) == 50.0);
    assert_true(vd_times_share(&times, 0.99) == 99.0);
    assert_true(vd_times_share(&times, 1.0) == 100.0);
    for (int i = 0; i < 2 * VD_TIMES_COUNT; i++) {
        vd_times_add(&times, 7.0);
    }
    assert_true(vd_times_share(&times, 0.0) == 7.0 && vd_times_share(&times, 1.0) == 7.0);
}

/* ---- options -----------------------------------------------------------------------------------
 */

static const vd_look_defaults defaults = {
    .haze_m = 5e5, .size_m = 1e5, .curvature = true, .threads = 2};

static void begin_options(vd_options *options) {
    assert_ok(vd_options_init(options, "view", vd_render_table, OPTION_COUNT));
    assert_ok(vd_options_add_input(options, "dem.tif", VD_SOURCE_FLAG));
}

static void sliders_go_where_they_are_put(void **unused) {
    (void)unused;
    vd_options options;
    vd_render_settings settings;
    begin_options(&options);
    for (int i = 0; i < VD_LIVE_COUNT; i++) {
        const vd_live live = (vd_live)i;
        char label[40];
        vd_live_label(live, label);
        assert_int_equal(strncmp(label, vd_render_table[vd_live_option(live)].key,
                                 strlen(vd_render_table[vd_live_option(live)].key)),
                         0);
        for (int k = 0; vd_live_is_slider(live) && k <= 20; k++) {
            const double position = k / 20.0;
            assert_ok(vd_live_set_position(&options, &defaults, live, position));
            assert_ok(vd_render_settings_read(&options, &settings));
            const double got = vd_live_position(&options, &defaults, live);
            assert_true(fabs(got - position) < (live == VD_LIVE_THREADS ? 0.51 : 0.01));
        }
    }
    vd_options_finish(&options);
}

static void words_come_around(void **unused) {
    (void)unused;
    vd_options options;
    vd_render_settings settings;
    begin_options(&options);
    for (int i = 0; i < VD_LIVE_COUNT; i++) {
        const vd_live live = (vd_live)i;
        if (vd_live_is_slider(live)) {
            continue;
        }
        char first[64], value[64];
        vd_live_value(&options, &defaults, live, first);
        int steps = 0;
        do {
            assert_ok(vd_live_next(&options, &defaults, live, 1));
            assert_ok(vd_render_settings_read(&options, &settings));
            vd_live_value(&options, &defaults, live, value);
            steps++;
        } while (strcmp(first, value) != 0 && steps < 100);
        assert_in_range(steps, 2, 63);
        assert_ok(vd_live_next(&options, &defaults, live, -1));
        assert_ok(vd_live_next(&options, &defaults, live, 1));
        vd_live_value(&options, &defaults, live, value);
        assert_string_equal(first, value);
    }
    vd_options_finish(&options);
}

/* The flags that are printed lead to the same settings, for random ones. */
static void flags_say_what_is_seen(void **unused) {
    (void)unused;
    uint64_t seed = 5;
    for (int round = 0; round < 50; round++) {
        vd_options options, again;
        vd_render_settings a, b;
        char flags[2048];
        begin_options(&options);
        for (int i = 0; i < VD_LIVE_COUNT; i++) {
            const vd_live live = (vd_live)i;
            if (vd_live_is_slider(live)) {
                assert_ok(vd_live_set_position(&options, &defaults, live, test_uniform(&seed)));
            } else {
                assert_ok(vd_live_next(&options, &defaults, live, (int)(test_random(&seed) % 5)));
            }
        }
        vd_look_flags(&options, &defaults, flags, sizeof flags);
        char *argv[64] = {(char *)"render", (char *)"dem.tif"};
        int argc = 2;
        for (char *at = strtok(flags, " "); at != NULL; at = strtok(NULL, " ")) {
            argv[argc++] = at;
        }
        assert_ok(vd_options_init(&again, "render", vd_render_table, OPTION_COUNT));
        assert_ok(vd_options_parse(&again, argc, argv));
        assert_ok(vd_render_settings_read(&options, &a));
        assert_ok(vd_render_settings_read(&again, &b));
        assert_true(a.sun_azimuth == b.sun_azimuth && a.sun_altitude == b.sun_altitude);
        assert_true(a.haze_m == b.haze_m && a.exaggeration == b.exaggeration);
        assert_true(a.samples == b.samples && a.filter == b.filter && a.shadows == b.shadows);
        assert_true(a.shading == b.shading && a.sky == b.sky);
        assert_true(a.terrain_method == b.terrain_method);
        assert_string_equal(a.colormap, b.colormap);
        assert_int_equal(b.curvature, a.curvature < 0 ? 1 : a.curvature);
        vd_options_finish(&options);
        vd_options_finish(&again);
    }
}

/* ---- pixels ------------------------------------------------------------------------------------
 */

static vd_frame *random_frame(vd_context *context, int width, int height, uint64_t *seed) {
    vd_frame *frame = NULL;
    assert_ok(vd_frame_create(context, width, height, 0, &frame));
    for (size_t i = 0; i < 4 * frame->stride * (size_t)height; i++) {
        frame->rgba[i] = (uint8_t)test_random(seed);
    }
    return frame;
}

static void pixels_of_the_same_size_are_the_same(void **unused) {
    (void)unused;
    uint64_t seed = 6;
    vd_context *context = test_context(2, VD_ISA_AUTO);
    vd_frame *frame = random_frame(context, 131, 77, &seed);
    uint32_t *pixels = malloc(131 * 77 * sizeof *pixels);
    assert_non_null(pixels);
    assert_ok(vd_pixels_from_frame(context, frame, 131, 77, pixels));
    for (size_t y = 0; y < 77; y++) {
        for (size_t x = 0; x < 131; x++) {
            const uint8_t *p = frame->rgba + 4 * (y * frame->stride + x);
            assert_int_equal(pixels[131 * y + x],
                             0xFF000000u | (uint32_t)p[0] << 16 | (uint32_t)p[1] << 8 | p[2]);
        }
    }
    free(pixels);
    vd_frame_destroy(&frame);
    vd_context_destroy(&context);
}

/* Against the definition in double: a bilinear mix of the four nearest centres. */
static void check_stretched(vd_context *context, uint64_t *seed, int from_width, int from_height,
                            int width, int height) {
    vd_frame *frame = random_frame(context, from_width, from_height, seed);
    uint32_t *pixels = malloc((size_t)width * (size_t)height * sizeof *pixels);
    assert_non_null(pixels);
    assert_ok(vd_pixels_from_frame(context, frame, width, height, pixels));
    for (int y = 0; y < height; y++) {
        for (int x = 0; x < width; x++) {
            double u = fmin(fmax((x + 0.5) * from_width / width - 0.5, 0.0), from_width - 1.0);
            double v = fmin(fmax((y + 0.5) * from_height / height - 0.5, 0.0), from_height - 1.0);
            const int i = (int)fmin(floor(u), fmax(from_width - 2.0, 0.0));
            const int j = (int)fmin(floor(v), fmax(from_height - 2.0, 0.0));
            u -= i;
            v -= j;
            const uint8_t *a = frame->rgba + 4 * ((size_t)j * frame->stride + (size_t)i);
            const uint8_t *b = a + (from_width > 1 ? 4 : 0);
            const uint8_t *c = a + (from_height > 1 ? 4 * frame->stride : 0);
            const uint8_t *d = c + (from_width > 1 ? 4 : 0);
            for (int k = 0; k < 3; k++) {
                const double wanted =
                    (1 - v) * ((1 - u) * a[k] + u * b[k]) + v * ((1 - u) * c[k] + u * d[k]);
                const int got = pixels[(size_t)y * (size_t)width + (size_t)x] >> (16 - 8 * k) & 255;
                assert_true(fabs(got - wanted) < 4.0);
            }
        }
    }
    free(pixels);
    vd_frame_destroy(&frame);
}

static void pixels_are_stretched(void **unused) {
    (void)unused;
    uint64_t seed = 7;
    vd_context *context = test_context(2, VD_ISA_AUTO);
    check_stretched(context, &seed, 96, 54, 128, 72);
    check_stretched(context, &seed, 480, 20, 641, 27);
    check_stretched(context, &seed, 1, 1, 300, 9);
    check_stretched(context, &seed, 300, 2, 300, 3);
    check_stretched(context, &seed, 3, 40, 4, 41);
    vd_frame *frame = random_frame(context, 5, 5, &seed);
    uint32_t pixels[20];
    assert_int_equal(vd_pixels_from_frame(context, frame, 4, 5, pixels).code, VD_ERROR_ARGUMENT);
    vd_frame_destroy(&frame);
    vd_context_destroy(&context);
}

/* What impostors do is told in three lines; in a fourth, in another colour, that some failed. */
static void failures_are_told_of(void **unused) {
    (void)unused;
    static uint32_t pixels[400 * 400];
    vd_impostor_stats stats = {.shown = 12,
                               .reused = 11,
                               .direct = 3,
                               .drawn = 2,
                               .waiting = 1,
                               .pictures = 40,
                               .dropped = 7,
                               .pixels_drawn = 10,
                               .pixels_shown = 123,
                               .overdraw = 2.5,
                               .error_px = 0.75};
    char lines[VD_CARD_IMPOSTOR_LINES][100];
    assert_int_equal(vd_cards_impostor_lines(&stats, false, lines), 3);
    assert_string_equal(lines[0], "12 shown  3 direct  1 waiting");
    assert_string_equal(lines[1], "2 drawn  11 reused  40 live");
    assert_string_equal(lines[2], "R 12.3  D 2.50  0.75 px  7 dropped");
    assert_int_equal(vd_cards_impostor_lines(&stats, true, lines), 3);
    assert_string_equal(lines[0], "12 shown  3 direct  1 waiting  kept");
    vd_context *context = test_context(1, VD_ISA_AUTO);
    vd_cards *cards = vd_cards_create(context, 1.0);
    assert_non_null(cards);
    const vd_times frames = {.count = 0};
    const vd_card_times times = {.frames = &frames, .period_s = 1.0 / 60, .impostors = &stats};
    for (uint64_t failed = 0; failed < 10; failed += 9) {
        stats.failed = failed;
        memset(pixels, 0, sizeof pixels);
        vd_cards_show_times(cards, &times);
        vd_cards_lay(cards, pixels, 400, 400, 400);
        int orange = 0;
        for (int i = 0; i < 400 * 400; i++) {
            const int red = (int)(pixels[i] >> 16 & 255u), b = (int)(pixels[i] & 255u);
            orange += red > 150 && b < red - 60;
        }
        assert_true(failed > 0 ? orange > 10 : orange == 0);
    }
    assert_int_equal(vd_cards_impostor_lines(&stats, false, lines), 4);
    assert_string_equal(lines[3], "9 failed");
    vd_cards_destroy(&cards);
    vd_context_destroy(&context);
}

static void cards_are_cut_at_the_edges(void **unused) {
    (void)unused;
    uint64_t seed = 8;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    vd_frame *frame = NULL;
    assert_ok(vd_frame_create(context, 30, 20, 0, &frame));
    memset(frame->rgba, 255, 4 * frame->stride * 20);
    for (int round = 0; round < 200; round++) {
        uint32_t pixels[50 * 40];
        const int x = (int)(test_random(&seed) % 120) - 60;
        const int y = (int)(test_random(&seed) % 120) - 60;
        memset(pixels, 0, sizeof pixels);
        vd_pixels_lay_over(pixels, 50, 50, 40, frame, x, y);
        for (int row = 0; row < 40; row++) {
            for (int column = 0; column < 50; column++) {
                const bool inside = column >= x && column < x + 30 && row >= y && row < y + 20;
                assert_int_equal(pixels[50 * row + column], inside ? 0xFFFFFFFFu : 0u);
            }
        }
    }
    vd_frame_destroy(&frame);
    vd_context_destroy(&context);
}

/* ---- recordings --------------------------------------------------------------------------------
 */

/* A path through what was recorded, as `veduta fly` makes it. */
static vd_camera_path *read_recording(vd_context *context, const char *path) {
    json_t *root = json_load_file(path, JSON_REJECT_DUPLICATES, NULL);
    assert_non_null(root);
    assert_int_equal(json_integer_value(json_object_get(root, "veduta_path")), 1);
    assert_true(json_is_false(json_object_get(root, "ease")));
    assert_true(json_number_value(json_object_get(root, "clearance")) == 0.0);
    const json_t *list = json_object_get(root, "keyframes");
    const size_t count = json_array_size(list);
    vd_keyframe *keys = calloc(count, sizeof *keys);
    assert_non_null(keys);
    for (size_t i = 0; i < count; i++) {
        double heading, pitch, roll, fov;
        assert_int_equal(json_unpack(json_array_get(list, i),
                                     "{s: F, s: [F, F, F], s: F, s: F, s: F, s: F}", "time",
                                     &keys[i].time_s, "eye", &keys[i].eye.x, &keys[i].eye.y,
                                     &keys[i].eye.z, "heading", &heading, "pitch", &pitch, "roll",
                                     &roll, "fov", &fov),
                         0);
        keys[i].orientation =
            vd_orientation_from_angles(heading * VD_RADIANS_PER_DEGREE,
                                       pitch * VD_RADIANS_PER_DEGREE, roll * VD_RADIANS_PER_DEGREE);
        keys[i].fov_y_rad = fov * VD_RADIANS_PER_DEGREE;
    }
    vd_camera_path_def def = vd_camera_path_def_default();
    vd_camera_path *out = NULL;
    def.keyframes = keys;
    def.count = (int)count;
    def.timed = true;
    def.ease_s = 0.0;
    assert_ok(vd_camera_path_create(context, &def, &out));
    free(keys);
    json_decref(root);
    return out;
}

static vd_vec3 eye_of(const vd_motion_state *state) {
    return vd_vec3_make(state->eye[0], state->eye[1], state->eye[2]);
}

enum { FLOWN = 900 };

/* Flies by keys that change at random, in frames of uneven lengths, and rests twice. */
static void fly_and_record(vd_recording *recording, double times[FLOWN],
                           vd_motion_state states[FLOWN]) {
    const vd_motion_world around = {NULL, NULL, 1e4};
    const double start_s = 1234.5;
    uint64_t seed = 8;
    vd_motion motion = vd_motion_start();
    states[0] = random_state(&seed);
    times[0] = 0.0;
    assert_true(vd_recording_begin(recording, start_s, &states[0], 3.0));
    for (int i = 1; i < FLOWN; i++) {
        const bool rested = i == 300 || i == 600;
        const double frame_s = 0.008 + 0.02 * test_uniform(&seed);
        times[i] = times[i - 1] + frame_s + (rested ? 7.0 : 0.0);
        states[i] = states[i - 1];
        if (rested) {
            vd_recording_hold(recording, start_s + times[i] - frame_s);
        }
        for (int axis = 0; axis < VD_MOTION_COUNT && i % 40 == 0; axis++) {
            motion.wanted[axis] = floor(3.0 * test_uniform(&seed)) - 1.0;
        }
        if (i % 300 > 260) { /* it comes to rest before it rests */
            motion = vd_motion_start();
        } else {
            vd_motion_advance(&motion, &around, frame_s, &states[i]);
        }
        vd_recording_note(recording, start_s + times[i], &states[i]);
    }
}

/* What is written goes through every frame at its time, and between two frames nowhere else: as a
 * stream of 100 viewpoints a second it is what was flown. */
static void recordings_are_what_was_flown(void **unused) {
    (void)unused;
    static const char file[] = VEDUTA_BINARY_DIR "/test-window-path.json";
    static double times[FLOWN];
    static vd_motion_state states[FLOWN];
    vd_recording recording;
    fly_and_record(&recording, times, states);
    assert_in_range(recording.count, FLOWN - 200, FLOWN);
    assert_ok(vd_recording_end(&recording, file));
    assert_false(recording.on);
    vd_context *context = test_context(1, VD_ISA_AUTO);
    vd_camera_path *path = read_recording(context, file);
    assert_true(fabs(vd_camera_path_duration(path) - times[FLOWN - 1]) < 1e-9);
    double worst = 0.0;
    for (int i = 0; i < FLOWN; i++) {
        const vd_keyframe at = vd_camera_path_pose(path, times[i]);
        const vd_quat is = vd_orientation_from_angles(states[i].heading * VD_RADIANS_PER_DEGREE,
                                                      states[i].pitch * VD_RADIANS_PER_DEGREE,
                                                      3.0 * VD_RADIANS_PER_DEGREE);
        const double cosine = at.orientation.x * is.x + at.orientation.y * is.y +
                              at.orientation.z * is.z + at.orientation.w * is.w;
        assert_true(vd_vec3_length(vd_vec3_subtract(at.eye, eye_of(&states[i]))) < 1e-5);
        assert_true(fabs(cosine) > 1.0 - 1e-12);
        assert_true(fabs(at.fov_y_rad - states[i].fov * VD_RADIANS_PER_DEGREE) < 1e-9);
    }
    for (int i = 0, k = 0; i / 100.0 < times[FLOWN - 1]; i++) {
        const double time_s = i / 100.0;
        while (times[k + 1] < time_s) {
            k++;
        }
        const bool rests = times[k + 1] - times[k] > 1.0; /* but for the last frame of it */
        const vd_vec3 a = eye_of(&states[k]), way = vd_vec3_subtract(eye_of(&states[k + 1]), a);
        const double share = rests ? 0.0 : (time_s - times[k]) / (times[k + 1] - times[k]);
        const vd_vec3 on = vd_vec3_add(a, vd_vec3_scale(way, share));
        const double off =
            vd_vec3_length(vd_vec3_subtract(vd_camera_path_pose(path, time_s).eye, on));
        const double step = vd_vec3_length(way);
        if (rests && time_s > times[k + 1] - 0.03) {
            continue;
        }
        assert_true(off <= 0.25 * step + 1e-5);
        worst = step > 1e-3 && off / step > worst ? off / step : worst;
    }
    assert_true(worst > 0.0);
    vd_camera_path_destroy(&path);
    vd_context_destroy(&context);
    (void)unlink(file);
}

/* However long it flies, its memory is bounded, and it keeps its beginning and its end. */
static void long_recordings_are_thinned(void **unused) {
    (void)unused;
    for (int kind = 0; kind < 2; kind++) { /* flying on and on; hopping from rest to rest */
        vd_motion_state state = {.fov = 40.0};
        vd_recording r;
        assert_true(vd_recording_begin(&r, 0.0, &state, 0.0));
        const int frames = 3 * VD_RECORDING_FRAMES;
        for (int i = 1; i <= frames; i++) {
            state.eye[0] = kind == 0 ? i : floor(i / 2.0);
            vd_recording_note(&r, i / 60.0, &state);
            assert_true(r.count <= VD_RECORDING_FRAMES && r.room <= VD_RECORDING_FRAMES);
        }
        assert_true(r.count > VD_RECORDING_FRAMES / 4);
        assert_true(r.frames[0].time_s == 0.0 && r.frames[0].eye[0] == 0.0);
        assert_true(r.frames[r.count - 1].eye[0] == state.eye[0]);
        assert_true(r.frames[r.count - 1].time_s == frames / 60.0);
        for (int i = 1; i < r.count; i++) {
            const double gap = r.frames[i].time_s - r.frames[i - 1].time_s;
            /* Where all of it is rests the early ones are thinned again and again. */
            assert_true(gap > 0.0 && gap <= (kind == 0 ? 2.0 : 16.0) * (r.every + 1) / 60.0);
        }
        vd_recording_finish(&r);
        assert_null(r.frames);
    }
}

/* ---- cards -------------------------------------------------------------------------------------
 */

static void the_panel_is_found_by_the_mouse(void **unused) {
    (void)unused;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    vd_cards *cards = vd_cards_create(context, 1.5);
    assert_non_null(cards);
    uint32_t *pixels = calloc(1280 * 720, sizeof *pixels);
    assert_non_null(pixels);
    vd_options options;
    begin_options(&options);
    vd_live live;
    double position;
    assert_false(vd_cards_panel_at(cards, 100, 100, &live, &position));
    vd_cards_show_panel(cards, &options, &defaults, VD_LIVE_COUNT);
    const unsigned version = vd_cards_version(cards);
    vd_cards_show_panel(cards, &options, &defaults, VD_LIVE_COUNT);
    assert_int_equal(version, vd_cards_version(cards)); /* the same is not drawn again */
    vd_cards_lay(cards, pixels, 1280, 1280, 720);
    bool seen[VD_LIVE_COUNT + 1] = {false};
    for (int y = 0; y < 720; y++) {
        if (vd_cards_panel_at(cards, 300, y, &live, &position)) {
            seen[live] = true;
            assert_true(position >= 0.0 && position <= 1.0);
        }
    }
    for (int i = 0; i < VD_LIVE_COUNT; i++) {
        assert_true(seen[i]);
    }
    vd_cards_hide(cards, VD_CARD_PANEL);
    assert_false(vd_cards_panel_at(cards, 100, 100, &live, &position));
    vd_options_finish(&options);
    free(pixels);
    vd_cards_destroy(&cards);
    vd_context_destroy(&context);
}

static void any_sentence_can_be_shown(void **unused) {
    (void)unused;
    uint64_t seed = 9;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    vd_cards *cards = vd_cards_create(context, 1.0);
    uint32_t *pixels = calloc(400 * 300, sizeof *pixels);
    assert_non_null(cards);
    assert_non_null(pixels);
    for (int round = 0; round < 200; round++) {
        char text[480];
        const size_t length = test_random(&seed) % (sizeof text - 1);
        for (size_t i = 0; i < length; i++) {
            text[i] = (char)(test_random(&seed) % 5 == 0 ? ' ' : 1 + test_random(&seed) % 255);
        }
        text[length] = '\0';
        vd_cards_show_message(cards, text, round % 3 == 0 ? test_uniform(&seed) : -1.0,
                              round % 2 == 0);
        assert_true(vd_cards_shown(cards, VD_CARD_MESSAGE));
        vd_cards_lay(cards, pixels, 400, 400, 300);
    }
    free(pixels);
    vd_cards_destroy(&cards);
    vd_context_destroy(&context);
}

/* ---- threads -----------------------------------------------------------------------------------
 */

static void count_piece(void *user, int index, int worker) {
    (void)worker;
    ((unsigned char *)user)[index]++;
}

static void threads_change_between_loops(void **unused) {
    (void)unused;
    vd_threads threads;
    assert_ok(vd_threads_init(&threads, 5));
    assert_true(threads.most >= 5);
    vd_context_def def = vd_context_def_default();
    def.executor = vd_threads_executor(&threads);
    vd_context *context = NULL;
    assert_ok(vd_context_create(&def, &context));
    for (int count = 1; count <= 5; count++) {
        unsigned char pieces[1000] = {0};
        assert_ok(vd_threads_set(&threads, count));
        assert_ok(vd_parallel_for(context, NULL, 1000, count_piece, pieces));
        for (int i = 0; i < 1000; i++) {
            assert_int_equal(pieces[i], 1);
        }
    }
    vd_context_destroy(&context);
    vd_threads_finish(&threads);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(motion_is_the_same_at_every_frame_rate),
        cmocka_unit_test(motion_dies_down),
        cmocka_unit_test(the_eye_stays_above_the_ground),
        cmocka_unit_test(turning_goes_around_and_not_over),
        cmocka_unit_test(pace_holds_the_rate_where_it_can),
        cmocka_unit_test(pace_grows_again),
        cmocka_unit_test(shares_of_times),
        cmocka_unit_test(sliders_go_where_they_are_put),
        cmocka_unit_test(words_come_around),
        cmocka_unit_test(flags_say_what_is_seen),
        cmocka_unit_test(pixels_of_the_same_size_are_the_same),
        cmocka_unit_test(pixels_are_stretched),
        cmocka_unit_test(recordings_are_what_was_flown),
        cmocka_unit_test(long_recordings_are_thinned),
        cmocka_unit_test(failures_are_told_of),
        cmocka_unit_test(cards_are_cut_at_the_edges),
        cmocka_unit_test(the_panel_is_found_by_the_mouse),
        cmocka_unit_test(any_sentence_can_be_shown),
        cmocka_unit_test(threads_change_between_loops),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

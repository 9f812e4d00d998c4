/* test_app_evaluate.c: `veduta evaluate` from outside: what it prints and writes, that it can be
 * repeated, that impostors do better than whole screens over a slow link, and what is refused. */
#include "app_support.h"

#include <math.h>
#include <stdlib.h>
#include <unistd.h>
#include <veduta/picture.h>

#define DEM VEDUTA_SOURCE_DIR "/data/mont-blanc.png"

static char one[1 << 16];

/* 240 m over a grove, once around in 30 s. */
static const char orbit_json[] =
    "{\"veduta_path\": 1, \"clearance\": 0, \"orbit\": {\"centre\": [25660, -6160, 1070], "
    "\"radius\": 420, \"height\": 240, \"duration\": 30}}\n";

/* Measures the grove in 2 s of 128 × 72, reduced with fewer samples and comparisons. */
static int evaluate(const char *arguments) {
    char line[1024];
    (void)snprintf(
        line, sizeof line, "evaluate grove/forest.json orbit.json -s 128x72 --seconds 2 %s %s",
        test_is_reduced() ? "--samples 1 --reference-samples 1 --compare 5" : "", arguments);
    return run("", line);
}

static void evaluates(const char *arguments) {
    const int status = evaluate(arguments);
    if (status != 0) {
        fail_msg("%s: exit status %d: %s", arguments, status, err);
    }
}

/* Of so many seconds, reduced of fewer. */
static void evaluates_for(double seconds, const char *arguments) {
    char line[512];
    (void)snprintf(line, sizeof line, "--seconds %g %s", test_is_reduced() ? 0.4 : seconds,
                   arguments);
    evaluates(line);
}

static void fails(int expected, const char *arguments, const char *sentence) {
    const int status = evaluate(arguments);
    if (status != expected || strstr(err, sentence) == NULL || strncmp(err, "veduta: ", 8) != 0) {
        fail_msg("%s: exit status %d: %s", arguments, status, err);
    }
    assert_string_equal(out, "");
}

/* The number behind a key of `text`, the first after `part` (null: of all). */
static double number_in(const char *text, const char *part, const char *key) {
    char quoted[64];
    const char *from = text;
    if (part != NULL) {
        (void)snprintf(quoted, sizeof quoted, "\"%s\": {", part);
        from = strstr(text, quoted);
        assert_non_null(from);
    }
    (void)snprintf(quoted, sizeof quoted, "\"%s\": ", key);
    const char *at = strstr(from, quoted);
    if (at == NULL) {
        fail_msg("%s is not in: %.600s", key, text);
        return 0.0;
    }
    return strtod(at + strlen(quoted), NULL);
}

static char folder[] = VEDUTA_BINARY_DIR "/test-app-evaluate-XXXXXX";

static int enter_folder(void **state) {
    (void)state;
    if (mkdtemp(folder) == NULL || chdir(folder) != 0) {
        return -1;
    }
    write_file("orbit.json", orbit_json);
    return run("", "generate forest '" DEM "' --cell-size 75 -n 150 --center 25660,-6160 "
                   "--radius 200 --tree-line 5000 -o grove");
}

static int leave_folder(void **state) {
    (void)state;
    char command[sizeof folder + 16];
    (void)snprintf(command, sizeof command, "rm -r '%s'", folder);
    return chdir(VEDUTA_BINARY_DIR) == 0 && system(command) == 0 ? 0 : -1;
}

/* ---- the tests --------------------------------------------------------------------------------*/

static void impostors_do_better_over_a_slow_link(void **state) {
    (void)state;
    evaluates("--virtual --bandwidth 200k --json");
    /* A screen takes 128 · 72 · 4 / 200,000 s: 5.4 of them a second. */
    assert_true(fabs(number_in(out, "screen", "fps") - 5.0) < 0.51);
    assert_true(number_in(out, NULL, "fps") == 60.0);
    assert_true(number_in(out, "screen", "error") > 0.0);
    assert_true(number_in(out, NULL, "error") < number_in(out, "screen", "error"));
    assert_true(number_in(out, NULL, "error") <= number_in(out, NULL, "worst_error"));
    assert_true(number_in(out, "no_reuse", "fps") < 30.0);
    assert_true(number_in(out, "no_reuse", "error") > 0.0);
    static const char *const parts[] = {NULL, "screen", "no_reuse"};
    for (int i = 0; i < 3; i++) { /* no more than the link carries */
        const double bytes = number_in(out, parts[i], "bytes_per_s");
        assert_true(bytes > 0.0 && bytes <= 200e3);
    }
    assert_true(number_in(out, NULL, "reuse") > 1.0);
    assert_true(number_in(out, NULL, "overdraw") > 0.0);
    assert_true(number_in(out, NULL, "uploads_per_s") > 1.0);
    assert_true(number_in(out, NULL, "direct_objects") >= 0.0);
    assert_true(number_in(out, NULL, "failed") == 0.0);
}

/* Without a link whole screens are wrong only by being shown for a sixtieth of a second. */
static void without_a_link_screens_are_good(void **state) {
    (void)state;
    evaluates("--virtual --bandwidth 0 --json");
    assert_true(number_in(out, "screen", "error") < 0.15);
    assert_true(number_in(out, "screen", "fps") == 60.0);
    const double error = number_in(out, NULL, "error");
    assert_true(error > 0.0 && error < 0.5);
}

static void latency_is_seen(void **state) {
    (void)state;
    evaluates("--virtual --bandwidth 0 --latency 500ms --json");
    const double screen = number_in(out, "screen", "error");
    assert_true(screen > 0.05);
    assert_true(number_in(out, "screen", "fps") == 45.0); /* those of the first 1.5 s */
    assert_true(number_in(out, "settings", "latency") == 0.5);
}

static void virtual_runs_are_the_same(void **state) {
    (void)state;
    evaluates_for(2, "--virtual --bandwidth 1M --threads 1 -o -");
    memcpy(one, out, sizeof one);
    assert_non_null(strstr(one, "\"errors\": {"));
    if (!test_is_reduced()) {
        evaluates_for(2, "--virtual --bandwidth 1M --threads 2 -o -");
        assert_string_equal(out, one);
    }
    evaluates_for(2, "--virtual --bandwidth 1M --threads 7 -o -");
    assert_string_equal(out, one);
}

/* One program alone does what it does beside the others; of these null is said. */
static void programs_run_alone(void **state) {
    (void)state;
    static const char *const parts[] = {NULL, "screen", "no_reuse"};
    static const char *const words[] = {"impostors", "screen", "no-reuse"};
    double error[3], fps[3];
    evaluates_for(1, "--virtual --bandwidth 1M --json");
    for (int i = 0; i < 3; i++) {
        error[i] = number_in(out, parts[i], "error");
        fps[i] = number_in(out, parts[i], "fps");
    }
    for (int i = 0; i < 3; i++) {
        char line[128];
        (void)snprintf(line, sizeof line, "--virtual --bandwidth 1M --only %s -o - --worst %d.png",
                       words[i], i);
        evaluates_for(1, line);
        assert_true(fabs(number_in(out, parts[i], "error") - error[i]) < 1e-8); /* 9 digits */
        assert_true(fabs(number_in(out, parts[i], "fps") - fps[i]) < 1e-6);
        assert_true((strstr(out, "\"fps\": null") != NULL) == (i != 0));
        assert_true((strstr(out, "\"screen\": null") != NULL) == (i != 1));
        assert_true((strstr(out, "\"no_reuse\": null") != NULL) == (i != 2));
        (void)snprintf(line, sizeof line, "%d.png", i);
        assert_int_equal(access(line, R_OK), 0);
    }
}

/* What is packed takes fewer bytes, and without losses shows the same where the link is not full.
 */
static void packing_saves_bytes(void **state) {
    (void)state;
    static const char *const codecs[] = {"raw", "runs-zstd", "jpeg", "auto"};
    double bytes[4], error[4], screens[4];
    for (int i = 0; i < 4; i++) {
        char line[128];
        (void)snprintf(line, sizeof line,
                       "--seconds %g --virtual --bandwidth 100M --quality 90 --codec %s --json",
                       test_is_reduced() ? 0.3 : 1.0, codecs[i]);
        evaluates(line);
        bytes[i] = number_in(out, NULL, "bytes_per_s");
        error[i] = number_in(out, NULL, "error");
        screens[i] = number_in(out, "screen", "bytes_per_s");
        (void)snprintf(line, sizeof line, "\"codec\": \"%s\"", codecs[i]);
        assert_non_null(strstr(out, line));
    }
    for (int i = 1; i < 4; i++) {
        assert_true(bytes[i] < 0.9 * bytes[0] && screens[i] < 0.9 * screens[0]);
    }
    assert_true(fabs(error[1] - error[0]) < 0.02 && error[2] != error[0]);
}

/* Drawn directly in no time nothing is wrong but what 60 frames a second cost. */
static void what_a_display_costs_is_said(void **state) {
    (void)state;
    evaluates("--seconds 1 --virtual --only direct -o -");
    assert_true(number_in(out, "direct", "fps") == 60.0);
    const double error = number_in(out, "direct", "error");
    assert_true(error > 0.0 && error < 0.3);
    evaluates("--seconds 1 --virtual --bandwidth 0 --json");
    assert_true(fabs(number_in(out, "direct", "error") - error) < 1e-8); /* 9 digits */
    assert_true(number_in(out, "screen", "error") < 0.3);
}

/* What the dissertation's tables vary is an option each, and changes what it should. */
static void the_tables_have_their_options(void **state) {
    (void)state;
    evaluates_for(1, "--virtual --only impostors --json");
    const double error = number_in(out, NULL, "error"), shown = number_in(out, NULL, "impostors");
    const double direct = number_in(out, NULL, "direct_objects");
    assert_true(number_in(out, "settings", "most_px") == 192.0);
    evaluates_for(1, "--virtual --only impostors --most-px 16 --json");
    assert_true(number_in(out, NULL, "impostors") > 1.2 * shown);
    evaluates_for(1, "--virtual --only impostors --least-reuse 1000 --json");
    assert_true(number_in(out, NULL, "direct_objects") > direct + 10.0);
    evaluates_for(1, "--virtual --only impostors --fade 200ms --json");
    assert_true(number_in(out, "settings", "fade") == 0.2);
    assert_true(number_in(out, NULL, "error") != error);
    evaluates_for(1, "--virtual --only impostors --tolerance 0 --json");
    assert_true(number_in(out, NULL, "failed") == 0.0);
    /* What a better one says of it is another number. */
    evaluates_for(1, "--virtual --bandwidth 0 --only screen --samples 1 --reference-samples 1 "
                     "--json");
    const double alike = number_in(out, "screen", "error");
    evaluates_for(1, "--virtual --bandwidth 0 --only screen --samples 1 --reference-samples 8 "
                     "--json");
    assert_true(number_in(out, "screen", "error") > alike);
    assert_true(number_in(out, "settings", "samples") == 1.0);
    assert_true(number_in(out, "settings", "reference_samples") == 8.0);
}

static void real_runs_say_what_they_took(void **state) {
    (void)state;
    evaluates(test_is_reduced() ? "--seconds 1 --compare 4 --json" : "--compare 4 --json");
    assert_true(number_in(out, NULL, "fps") > 0.0 && number_in(out, NULL, "fps") <= 60.5);
    assert_true(number_in(out, NULL, "frame_ms") > 0.0);
    assert_true(number_in(out, NULL, "slowest_ms") >= number_in(out, NULL, "frame_ms"));
    assert_true(number_in(out, "screen", "frame_ms") > 0.0);
    assert_true(number_in(out, "settings", "threads") >= 1.0);
}

static void results_are_written(void **state) {
    (void)state;
    evaluates("--virtual --worst worst.png -o report.json");
    assert_non_null(strstr(out, "impostors  "));
    assert_non_null(strstr(out, "whole screens "));
    assert_non_null(strstr(out, "no reuse "));
    assert_non_null(strstr(out, "2 s at 128x72, tolerance 1 px, a link of 10 MB/s"));
    read_back("report.json", one, sizeof one);
    const char *at = strstr(one, "\"time\": [");
    assert_non_null(at);
    int times = 0;
    for (const char *end = strchr(at, ']'); at != NULL && at < end; at = strchr(at + 1, ',')) {
        times++;
    }
    assert_int_equal(times, test_is_reduced() ? 10 : 20);
    vd_context *context = test_context(1, VD_ISA_AUTO);
    vd_picture *picture = NULL;
    assert_ok(vd_picture_load(context, "worst.png", &picture));
    assert_true(picture->width == 128 && picture->height == 72);
    vd_picture_destroy(&picture);
    vd_context_destroy(&context);
}

static void errors_are_plotted(void **state) {
    (void)state;
    if (system("gnuplot --version >/dev/null 2>&1") != 0) {
        skip();
    }
    evaluates_for(2, "--virtual --compare 2 --plot error.svg");
    read_back("error.svg", one, sizeof one);
    assert_non_null(strstr(one, "<svg"));
    assert_non_null(strstr(one, "whole screens, mean"));
    char command[1024];
    (void)snprintf(command, sizeof command,
                   "PATH=/nonexistent '%s/veduta' evaluate grove/forest.json orbit.json "
                   "--plot error.svg >out.txt 2>err.txt",
                   VEDUTA_BINARY_DIR);
    const int status = system(command);
    read_back("err.txt", err, sizeof err);
    assert_true(WIFEXITED(status) && WEXITSTATUS(status) == 1);
    assert_non_null(strstr(err, "gnuplot-nox"));
}

/* The committed paths last 30 s, clear of the ground, at their speeds. */
static void paths_are_as_they_are_said_to_be(void **state) {
    (void)state;
    static const struct {
        const char *name;
        double mps, within, lowest_m;
    } paths[] = {{"orbit", 251, 5, 35}, {"flyin", 300, 3, 35}, {"walk", 1.4, 0.05, 1.5}};
    for (int i = 0; i < 3; i++) {
        char line[1024];
        (void)snprintf(line, sizeof line,
                       "fly --preview --json '" VEDUTA_SOURCE_DIR "/data/mont-blanc.tif' "
                       "'" VEDUTA_SOURCE_DIR "/data/paths/%s.json'",
                       paths[i].name);
        if (run("", line) != 0) {
            if (strstr(err, "GDAL") != NULL) {
                skip();
            }
            fail_msg("%s: %s", paths[i].name, err);
        }
        assert_true(number_in(out, NULL, "duration") == 30.0);
        assert_true(fabs(number_in(out, NULL, "length_m") / 30 - paths[i].mps) < paths[i].within);
        assert_true(number_in(out, NULL, "lowest_m") > paths[i].lowest_m);
    }
}

static void an_interruption_is_told(void **state) {
    (void)state;
    char command[1024];
    (void)snprintf(command, sizeof command,
                   "timeout -s INT 1 '%s/veduta' evaluate grove/forest.json orbit.json "
                   "--seconds 5000 -o never.json >out.txt 2>err.txt",
                   VEDUTA_BINARY_DIR);
    const int status = system(command);
    read_back("err.txt", err, sizeof err);
    assert_true(WIFEXITED(status) && WEXITSTATUS(status) == 124); /* timeout's own */
    assert_non_null(strstr(err, "veduta: interrupted; nothing was written"));
    assert_int_equal(access("never.json", F_OK), -1);
}

static void bad_use_is_told(void **state) {
    (void)state;
    fails(2, "--tolerance -1", "--tolerance");
    fails(2, "--tolerance nan", "--tolerance");
    fails(2, "--budget 0", "--budget: \"0\" is not a time");
    fails(2, "--budget 5m", "give seconds, such as 0.005 or 5ms");
    fails(2, "--latency -1s", "--latency");
    fails(2, "--latency 61", "--latency");
    fails(2, "--bandwidth fast", "--bandwidth: \"fast\" is not a number of bytes");
    fails(2, "--bandwidth 0.5", "a link of 0.5 bytes a second brings nothing");
    fails(2, "--memory 1k", "--memory");
    fails(2, "--only screens", "give one of impostors|screen|no-reuse|direct");
    fails(2, "--codec gif", "--codec");
    fails(2, "--quality 101", "--quality");
    fails(2, "--fade nan", "--fade");
    fails(2, "--most-px 7", "--most-px");
    fails(2, "--least-reuse -1", "--least-reuse");
    fails(2, "--reference-samples 2", "--reference-samples");
    fails(2, "--rate 0", "--rate");
    fails(2, "--compare 0", "--compare");
    fails(2, "--worst worst.svg", "does not end in .png");
    fails(2, "--plot error.png", "does not end in .svg");
    fails(2, "--heading 20", "the path says where the camera is");
    fails(2, "--bandwith 3", "did you mean --bandwidth?");
    fails(1, "-o /nonexistent/report.json", "/nonexistent");
    fails(2, "-o orbit.json", "orbit.json");
    assert_int_equal(run("", "evaluate orbit.json grove/forest.json"), 1);
    assert_non_null(strstr(err, "orbit.json is a camera path, not what it flies over"));
    assert_int_equal(run("", "evaluate"), 2);
    assert_non_null(strstr(err, "there is nothing to measure"));
    assert_int_equal(run("", "evaluate grove/forest.json"), 2);
    assert_non_null(strstr(err, "no path"));
    assert_int_equal(run("", "evaluate grove/forest.json nothing.json"), 1);
    assert_non_null(strstr(err, "nothing.json"));
    write_file("bad.json", "{\"veduta_path\": 1}");
    assert_int_equal(run("", "evaluate grove/forest.json bad.json"), 1);
    assert_non_null(strstr(err, "bad.json"));
    assert_int_equal(run("", "evaluate --help"), 0);
    assert_non_null(strstr(out, "--bandwidth B"));
    assert_null(strstr(out, "--heading"));
}

/* A world's own camera is for its pictures: here the path says where it is. */
static void a_worlds_camera_is_no_mistake(void **state) {
    (void)state;
    FILE *file = fopen("low.json", "w");
    assert_non_null(file);
    (void)fputs("{\"veduta_path\": 1, \"orbit\": {\"centre\": [0, 0, 0], \"radius\": 300, "
                "\"height\": 100, \"duration\": 10}}\n",
                file);
    assert_int_equal(fclose(file), 0);
    static const char dunes[] = "evaluate " VEDUTA_SOURCE_DIR "/example/worlds/dunes.json low.json "
                                "-s 64x48 --seconds 0.2 --virtual --json -q";
    char line[1024];
    (void)snprintf(line, sizeof line, "%s", dunes);
    assert_int_equal(run("", line), 0);
    assert_true(number_in(out, NULL, "fps") > 0.0);
    (void)snprintf(line, sizeof line, "%s --azimuth 30", dunes);
    assert_int_equal(run("", line), 2);
    assert_non_null(strstr(err, "--azimuth belongs to"));
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_worlds_camera_is_no_mistake),
        cmocka_unit_test(impostors_do_better_over_a_slow_link),
        cmocka_unit_test(without_a_link_screens_are_good),
        cmocka_unit_test(latency_is_seen),
        cmocka_unit_test(virtual_runs_are_the_same),
        cmocka_unit_test(programs_run_alone),
        cmocka_unit_test(packing_saves_bytes),
        cmocka_unit_test(what_a_display_costs_is_said),
        cmocka_unit_test(the_tables_have_their_options),
        cmocka_unit_test(real_runs_say_what_they_took),
        cmocka_unit_test(results_are_written),
        cmocka_unit_test(errors_are_plotted),
        cmocka_unit_test(paths_are_as_they_are_said_to_be),
        cmocka_unit_test(an_interruption_is_told),
        cmocka_unit_test(bad_use_is_told),
    };
    return cmocka_run_group_tests(tests, enter_folder, leave_folder);
}

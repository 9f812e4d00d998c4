/* test_app_bench.c: `veduta bench` from outside: the JSON's shape, equal pictures, bad use. What it
 * measures is nobody's business here: tests never time. */
#include "support.h"

#include <stdio.h>
#include <sys/stat.h>
#include <sys/wait.h>

/* The schedule of 1992 over the committed map. */
#define MONT_BLANC_HASH "d64d641a8b7e98a1"

static char output[1 << 16];

/* Runs `veduta bench ARGUMENTS`, its standard output or error in `output`; returns the status. */
static int bench(const char *arguments) {
    char command[1024];
    snprintf(command, sizeof command, "'%s/veduta' bench %s", VEDUTA_BINARY_DIR, arguments);
    FILE *pipe = popen(command, "r");
    assert_non_null(pipe);
    size_t length = fread(output, 1, sizeof output - 1, pipe);
    output[length] = '\0';
    int status = pclose(pipe);
    assert_true(WIFEXITED(status));
    return WEXITSTATUS(status);
}

static int count(const char *part) {
    int found = 0;
    for (const char *at = output; (at = strstr(at, part)) != NULL; at += strlen(part)) {
        found++;
    }
    return found;
}

/* Every result has every field, in one object each, and nothing else. */
static void json_has_the_fields(void **state) {
    (void)state;
    static const char *const head[] = {
        "commit",           "compiler", "flags",   "cpu",
        "additions_per_ns", "map",      "results", "geomean_vs_llvmpipe",
        "raster_means"};
    static const char *const fields[] = {
        "case",         "at",        "method", "published",   "threads",
        "isa",          "width",     "height", "median_ms",   "p99_ms",
        "min_ms",       "fps",       "speed",  "target_fps",  "peak_bytes",
        "hash",         "note",      "model",  "fine_pixels", "peak_resident_bytes",
        "output_bytes", "fragments", "shaded", "vs_llvmpipe", "limited_ms"};
    enum { HEADS = sizeof head / sizeof head[0], FIELDS = sizeof fields / sizeof fields[0] };
    assert_int_equal(bench("classic-growth --threads 1,2 --repeat 1 --json - 2>/dev/null"), 0);
    char key[64];
    for (size_t i = 0; i < HEADS; i++) {
        snprintf(key, sizeof key, "\n  \"%s\": ", head[i]);
        assert_int_equal(count(key), 1);
    }
    /* The published figure, the serial reference once, four methods on one thread and on two. */
    for (size_t i = 0; i < FIELDS; i++) {
        snprintf(key, sizeof key, "\n      \"%s\": ", fields[i]);
        assert_int_equal(count(key), 10);
    }
    assert_int_equal(count("\": "), HEADS + 10 * FIELDS);
    assert_int_equal(count("\"reference\""), 1);
    assert_int_equal(count("\"threads\": 2"), 4);
    assert_int_equal(count("\"published\": true"), 1);
    assert_int_equal(count("\"threads\": null"), 1);
    /* A target belongs to the march with two threads. */
    assert_int_equal(count("\"target_fps\": null"), 9);
}

/* The bench's maps and pictures are the same on every machine: the hashes are pinned. */
static void the_pictures_are_pinned(void **state) {
    (void)state;
    static const char *const maps[][2] = {{"mont-blanc", MONT_BLANC_HASH},
                                          {"mirrored", "d3647e1a7ee4f7e5"},
                                          {"noise", "896745c4004e2cfb"}};
    const char *levels = vd_isa_best() == VD_ISA_V4   ? "v2,v3,v4"
                         : vd_isa_best() == VD_ISA_V3 ? "v2,v3"
                                                      : "v2";
    for (size_t i = 0; i < (test_is_reduced() ? 1 : sizeof maps / sizeof maps[0]); i++) {
        char arguments[128], hash[64];
        snprintf(arguments, sizeof arguments,
                 "classic-growth --map %s --threads 2 --isa %s --repeat 1 --json - 2>/dev/null",
                 maps[i][0], levels);
        assert_int_equal(bench(arguments), 0);
        int results = count("\"published\": false");
        assert_int_equal(results, 5 * (int)vd_isa_best());
        snprintf(hash, sizeof hash, "\"hash\": \"%s\"", maps[i][1]);
        assert_int_equal(count(hash), results);
    }
}

/* Any picture of heights is a map: the committed one by its path gives the built-in one's hash. */
static void a_file_is_a_map(void **state) {
    (void)state;
    assert_int_equal(bench("classic-growth --map '" VEDUTA_SOURCE_DIR
                           "/data/bench/mont-blanc-1024.png' --threads 1 --repeat 1 --json - "
                           "2>/dev/null"),
                     0);
    assert_int_equal(count("\"hash\": \"" MONT_BLANC_HASH "\""), 5);
    assert_int_equal(bench("shadow --map /nonexistent/map.png --repeat 1 2>&1"), 1);
    assert_non_null(strstr(output, "/nonexistent/map.png"));
}

static void table_list_and_groups(void **state) {
    (void)state;
    assert_int_equal(bench("startup --repeat 1"), 0);
    assert_non_null(strstr(output, "startup"));
    assert_non_null(strstr(output, "median ms"));
    assert_int_equal(bench("--list"), 0);
    static const char *const names[] = {
        "classic-default", "classic-high",  "classic-growth", "classic-default-1080p",
        "shadow",          "memory",        "function",       "function-endless",
        "false-sharing",   "classic-16384", "cold",           "sweep-distance",
        "sweep-shadow-q",  "\n  terrain",   "\n  sweeps",     "classic-high-2160p-bilinear"};
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++) {
        if (strstr(output, names[i]) == NULL) {
            fail_msg("--list does not name %s", names[i]);
        }
    }
    /* A group is its cases, each once. */
    assert_int_equal(
        bench("function memory function --quick --repeat 1 --threads 1 --json - 2>/dev/null"), 0);
    assert_int_equal(count("\"case\": \"memory\""), 3);
    assert_int_equal(count("\"case\": \"function\""), 5);
    assert_non_null(strstr(output, " ns a point"));
    assert_int_equal(bench("--help"), 0);
    assert_non_null(strstr(output, "--plot"));
}

/* A server, its clients and slower links, reduced without the last; where veduta-remote cannot be,
 * it is said. */
static void a_server_is_measured(void **state) {
    (void)state;
    char arguments[128];
    (void)snprintf(
        arguments, sizeof arguments,
        "%s remote-answer remote-messages --quick --threads 1 --json - 2>bench-remote.txt",
        test_is_reduced() ? "" : "remote remote-cloud --particles 20000");
    const int status = bench(arguments);
    if (status != 0) {
        assert_int_equal(bench("remote --quick 2>&1"), 1);
        assert_non_null(strstr(output, "without"));
        return;
    }
    assert_int_equal(count("\"case\": \"remote-messages\""), 3);
    assert_int_equal(count("messages/s"), 3);
    if (test_is_reduced()) {
        return;
    }
    assert_int_equal(count("\"case\": \"remote\""), 5);
    assert_int_equal(count("\"case\": \"remote-cloud\""), 5);
    assert_int_equal(count("pictures/s"), 10);
    assert_non_null(strstr(output, "camera to picture"));
}

/* The files of a cold start are made by the bench itself; the GeoTIFF needs veduta-io. */
static void cold_makes_its_files(void **state) {
    (void)state;
    if (test_is_reduced()) {
        skip(); /* they are large */
    }
    assert_int_equal(bench("cold --repeat 1 --threads 1 --json - 2>/dev/null"), 0);
    assert_int_equal(count("\"method\": \"hgt\""), 1);
    assert_true(count("\"method\": \"geotiff\"") <= 1);
    assert_int_equal(count("\"case\": \"cold\""), 1 + count("\"method\": \"geotiff\""));
}

/* A sweep gives a row for every point and a picture that is an SVG. */
static void sweeps_are_plotted(void **state) {
    (void)state;
    char folder[512], arguments[1200], path[600];
    snprintf(folder, sizeof folder, "%s/test_app_bench_plots", VEDUTA_BINARY_DIR);
    snprintf(arguments, sizeof arguments,
             "sweep-height sweep-shadow-steps --quick --repeat 1 --threads 1 --plot '%s' --json - "
             "2>/dev/null",
             folder);
    assert_int_equal(bench(arguments), 0);
    assert_int_equal(count("\"case\": \"sweep-height\""), 3 * 3);
    assert_int_equal(count("\"case\": \"sweep-shadow-steps\""), 3 * 2);
    assert_int_equal(count("\"at\": 1000.0"), 3);
    static const char *const names[] = {"sweep-height", "sweep-shadow-steps"};
    for (size_t i = 0; i < 2; i++) {
        snprintf(path, sizeof path, "%s/%s.svg", folder, names[i]);
        FILE *file = fopen(path, "r");
        assert_non_null(file);
        size_t length = fread(output, 1, sizeof output - 1, file);
        fclose(file);
        output[length] = '\0';
        assert_non_null(strstr(output, "<svg"));
        assert_non_null(strstr(output, "</svg>"));
        assert_non_null(strstr(output, "reference, 1 thread"));
        assert_int_equal(remove(path), 0);
    }
    assert_int_equal(remove(folder), 0);
}

/* The folder of the bench's models, with a bunny of one large and many small triangles. */
static void make_bunny(char folder[512]) {
    enum { SIDE = 24, COUNT = 2 * SIDE * SIDE };
    char path[600];
    snprintf(folder, 512, "%s/test_app_bench_models", VEDUTA_BINARY_DIR);
    mkdir(folder, 0777);
    snprintf(path, sizeof path, "%s/bunny.mesh", folder);
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    const uint32_t counts[2] = {(SIDE + 1) * (SIDE + 1), COUNT};
    fwrite("VDBENCH1", 1, 8, file);
    fwrite(counts, 4, 2, file);
    for (uint32_t i = 0; i < counts[0]; i++) {
        const float x = (float)(i % (SIDE + 1)), y = (float)(i / (SIDE + 1));
        fwrite((float[3]){x * x, y + 0.2f * x, 0.3f * x - y}, 4, 3, file);
    }
    for (uint32_t i = 0; i < COUNT; i++) {
        const uint32_t at = i / 2 % SIDE + i / 2 / SIDE * (SIDE + 1), next = at + SIDE + 1;
        fwrite(i % 2 == 0 ? (uint32_t[3]){at, at + 1, next} : (uint32_t[3]){at + 1, next + 1, next},
               4, 3, file);
    }
    fclose(file);
    setenv("VEDUTA_BENCH_MODELS", folder, 1);
}

/* All methods and tables, with whatever peer there is; the other models are left out. */
static void triangles_have_tables(void **state) {
    (void)state;
    char folder[512], path[600];
    make_bunny(folder);
    assert_int_equal(bench("'bunny-*' --quick --repeat 1 --json - 2>/dev/null"), 0);
    assert_int_equal(count("\"case\": \"bunny-1024\""), 2 * 2 * 5 + count("\"method\": \"llvm"));
    assert_int_equal(count("\"model\": \"bunny\""), count("\"case\": \"bunny-1024\""));
    assert_int_equal(count("\"auto\": "), count("\"vs_llvmpipe\": null") == 20 ? 0 : 1);
    assert_int_equal(count("\"speed_up\": null"), 2 * 5);
    assert_int_equal(bench("raster-tables --quick --repeat 1 --threads 2 --json - 2>/dev/null"), 0);
    assert_int_equal(count("\"case\": \"raster-levels\""), 2 * (int)vd_isa_best());
    assert_int_equal(count("\"case\": \"raster-triangles\""), 3 * 4);
    assert_int_equal(count("\"case\": \"raster-small\""), 10);
    assert_int_equal(count("\"case\": \"raster-tiles\""), 10);
    assert_int_equal(count("\"case\": \"raster-resolve\""), 2 * 5);
    assert_int_equal(count("M coloured, same bytes"), 2 * 5);
    setenv("__EGL_VENDOR_LIBRARY_DIRS", "/nonexistent", 1); /* as if Mesa were not installed */
    assert_int_equal(bench("bunny-1024 --repeat 1 --json - 2>&1 >/dev/null"), 0);
    assert_int_equal(count("llvmpipe is left out: "), 1);
    assert_int_equal(count("libgl1-mesa-dri"), 1);
    unsetenv("__EGL_VENDOR_LIBRARY_DIRS");
    assert_int_equal(bench("monkey-1024 --json - 2>&1 >/dev/null"), 0);
    assert_non_null(strstr(output, "script/bench-models"));
    assert_int_equal(bench("'nothing*' 2>&1"), 2);
    unsetenv("VEDUTA_BENCH_MODELS");
    snprintf(path, sizeof path, "%s/bunny.mesh", folder);
    assert_int_equal(remove(path), 0);
    assert_int_equal(remove(folder), 0);
}

/* Without gnuplot, and before anything is measured. */
static void no_gnuplot_is_told(void **state) {
    (void)state;
    char command[1024];
    snprintf(command, sizeof command,
             "PATH=/nonexistent '%s/veduta' bench sweep-map --plot '%s' 2>&1", VEDUTA_BINARY_DIR,
             VEDUTA_BINARY_DIR);
    FILE *pipe = popen(command, "r");
    assert_non_null(pipe);
    output[fread(output, 1, sizeof output - 1, pipe)] = '\0';
    int status = pclose(pipe);
    assert_true(WIFEXITED(status));
    assert_int_equal(WEXITSTATUS(status), 1);
    assert_non_null(strstr(output, "gnuplot-nox"));
    assert_int_equal(count("\n"), 1);
    assert_int_equal(bench("sweep-map --plot /nonexistent/plots 2>&1"), 1);
    assert_non_null(strstr(output, "/nonexistent/plots"));
}

static void bad_use_is_told(void **state) {
    (void)state;
    static const struct {
        const char *arguments, *part;
    } uses[] = {{"", "--list"},
                {"clasic", "did you mean classic?"},
                {"terain", "did you mean terrain?"},
                {"startup --theads 1", "--threads"},
                {"startup --threads 0", "1 to 1024"},
                {"startup --threads 1,x", "1 to 1024"},
                {"startup --isa v5", "v2, v3, v4"},
                {"startup --isa v2,", "v2, v3, v4"},
                {"startup --repeat 2000", "1000"}};
    for (size_t i = 0; i < sizeof uses / sizeof uses[0]; i++) {
        char arguments[128];
        snprintf(arguments, sizeof arguments, "%s 2>&1 >/dev/null", uses[i].arguments);
        assert_int_equal(bench(arguments), 2);
        if (strstr(output, uses[i].part) == NULL || strncmp(output, "veduta: ", 8) != 0) {
            fail_msg("bench %s: said %s", uses[i].arguments, output);
        }
        assert_int_equal(count("\n"), 1);
    }
    assert_int_equal(bench("startup --repeat 1 --json /nonexistent/x.json 2>&1 >/dev/null"), 1);
    assert_non_null(strstr(output, "/nonexistent/x.json"));
}

/* Every codec there and back for three pictures of three sides; what others published once. */
static void codecs_have_tables(void **state) {
    (void)state;
    static const char *const cases[] = {"codec-tree", "codec-building", "codec-particles"};
    char arguments[128];
    for (int i = 0; i < 3; i++) {
        snprintf(arguments, sizeof arguments, "%s --quick --repeat 1 --json - 2>&1", cases[i]);
        if (bench(arguments) == 1 && strstr(output, "VEDUTA_REMOTE=ON") != NULL) {
            skip();
        }
        snprintf(arguments, sizeof arguments, "\"case\": \"%s\"", cases[i]);
        assert_int_equal(count(arguments), 3 * 7 * 2 + (i == 0 ? 8 : 0));
        assert_int_equal(count("\"limited_ms\": ["), 3 * 7);
        assert_int_equal(count("\"output_bytes\": 4096"), 2); /* raw, 32 × 32 */
    }
}

/* Impostors: each case has its lines, and every object was decided. */
static void impostors_have_tables(void **state) {
    (void)state;
    assert_int_equal(bench("impostor-decide --quick --threads 1 --json - 2>/dev/null"), 0);
    assert_int_equal(count("\"case\": \"impostor-decide\""), 2);
    assert_int_equal(count(" us an object"), 2);
    assert_int_equal(
        bench("impostor-grain --quick --threads 1 --particles 40000 --json - 2>/dev/null"), 0);
    assert_int_equal(count("\"case\": \"impostor-grain\""), 4 + 3);
    assert_int_equal(count("\"published\": true"), 4);
    assert_int_equal(count("\"at\": 30000.0"), 1);
    assert_int_equal(
        bench(test_is_reduced()
                  ? "impostor-path --quick --threads 1 --json - 2>/dev/null"
                  : "impostor-extremes impostor-path impostor-window --quick --threads 1 --json - "
                    "2>/dev/null"),
        0);
    assert_int_equal(count("\"case\": \"impostor-path\""), 1);
    if (!test_is_reduced()) {
        assert_int_equal(count("\"case\": \"impostor-window\""), 2);
        assert_int_equal(count("\"case\": \"impostor-extremes\""), 4);
        assert_int_equal(count(" Mpx/s by B_"), 4);
    }
    assert_int_equal(bench("--list"), 0);
    assert_non_null(strstr(output, "impostor-path impostor-window quads quad-sides"));
    assert_int_equal(bench("impostor-grain --particles -1 2>&1 >/dev/null"), 2);
    assert_non_null(strstr(output, "--particles"));
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(json_has_the_fields),   cmocka_unit_test(the_pictures_are_pinned),
        cmocka_unit_test(a_file_is_a_map),       cmocka_unit_test(table_list_and_groups),
        cmocka_unit_test(cold_makes_its_files),  cmocka_unit_test(sweeps_are_plotted),
        cmocka_unit_test(no_gnuplot_is_told),    cmocka_unit_test(bad_use_is_told),
        cmocka_unit_test(triangles_have_tables), cmocka_unit_test(codecs_have_tables),
        cmocka_unit_test(impostors_have_tables), cmocka_unit_test(a_server_is_measured),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

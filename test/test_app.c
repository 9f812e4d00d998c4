/* test_app.c: the program from outside: what it writes, what it says, how it exits. */
#include "support.h"

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <stdio.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>
#include <veduta/classic.h>
#include <veduta/picture.h>

extern char **environ;

static const char *const program = VEDUTA_BINARY_DIR "/veduta";
static const char *const dem_tif = VEDUTA_SOURCE_DIR "/data/mont-blanc.tif";
static const char *const dem_png = VEDUTA_SOURCE_DIR "/data/mont-blanc.png";

/* One run: exit status and what it printed. */
typedef struct run {
    int status;
    char out[1 << 16], err[1 << 14];
} run;

static run last;

static void read_back(const char *path, char *out, size_t out_bytes) {
    FILE *file = fopen(path, "rb");
    size_t length = file != NULL ? fread(out, 1, out_bytes - 1, file) : 0;
    out[length] = '\0';
    if (file != NULL) {
        fclose(file);
    }
}

static const char *standard_input = "/dev/null"; /* of the next runs */

static pid_t start(const char *const *arguments, int count) {
    char *argv[48] = {(char *)program};
    for (int i = 0; i < count; i++) {
        argv[i + 1] = (char *)arguments[i];
    }
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_addopen(&actions, 0, standard_input, O_RDONLY, 0);
    posix_spawn_file_actions_addopen(&actions, 1, "out.txt", O_WRONLY | O_CREAT | O_TRUNC, 0644);
    posix_spawn_file_actions_addopen(&actions, 2, "err.txt", O_WRONLY | O_CREAT | O_TRUNC, 0644);
    pid_t child = 0;
    if (posix_spawn(&child, program, &actions, NULL, argv, environ) != 0) {
        fail_msg("cannot start %s; build veduta-program first", program);
    }
    posix_spawn_file_actions_destroy(&actions);
    return child;
}

static int finish(pid_t child) {
    int status = 0;
    assert_int_equal(waitpid(child, &status, 0), child);
    last.status = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    read_back("out.txt", last.out, sizeof last.out);
    read_back("err.txt", last.err, sizeof last.err);
    return last.status;
}

#define COUNT(...) ((int)(sizeof((const char *[]){__VA_ARGS__}) / sizeof(char *)))
#define RUN(...) finish(start((const char *[]){__VA_ARGS__}, COUNT(__VA_ARGS__)))

static void expect_text(const char *text, const char *part, const char *what) {
    if (strstr(text, part) == NULL) {
        fail_msg("%s lacks \"%s\": %.400s%.400s", what, part, text, last.err);
    }
}

/* Expects one sentence that holds `part`, and nothing on standard output. */
static void expect_failure(int got, int status, const char *part) {
    expect_text(last.err, part, "standard error");
    assert_int_equal(got, status);
    assert_string_equal(last.out, "");
    assert_int_equal(strncmp(last.err, "veduta: ", 8), 0);
    assert_ptr_equal(strchr(last.err, '\n'), last.err + strlen(last.err) - 1);
}

#define FAILS(status, part, ...) expect_failure(RUN(__VA_ARGS__), status, part)

static void expect_success(int status) {
    if (status != 0) {
        fail_msg("exit status %d: %s", status, last.err);
    }
}

#define SUCCEEDS(...) expect_success(RUN(__VA_ARGS__))

static bool exists(const char *path) {
    return access(path, F_OK) == 0;
}

/* Takes "hash" out of the last run's JSON. */
static void take_hash(char out[17]) {
    const char *at = strstr(last.out, "\"hash\": \"");
    assert_non_null(at);
    memcpy(out, at + 9, 16);
    out[16] = '\0';
}

static vd_picture *load(const char *path) {
    vd_context *context = NULL;
    vd_picture *picture = NULL;
    assert_ok(vd_context_create(NULL, &context));
    assert_ok(vd_picture_load(context, path, &picture));
    return picture;
}

static void unload(vd_picture *picture) {
    vd_context *context = picture->context;
    vd_picture_destroy(&picture);
    vd_context_destroy(&context);
}

/* Writes a grey PGM or colour PPM from a formula, so that the tests need no files for it. */
static void write_pnm(const char *path, int width, int height, int channels) {
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    fprintf(file, "P%d\n%d %d\n255\n", channels == 1 ? 5 : 6, width, height);
    for (int y = 0; y < height; y++) {
        for (int x = 0; x < width; x++) {
            int v = ((x * x / 7 + y * 3) ^ (x + y * y / 5)) % 97;
            for (int c = 0; c < channels; c++) {
                fputc((v + 40 * c) & 255, file);
            }
        }
    }
    fclose(file);
}

static bool has_geo(void) {
    return RUN("info", dem_tif) == 0;
}

/* ---- the tests --------------------------------------------------------------------------------
 */

static void test_front(void **state) {
    (void)state;
    SUCCEEDS("--version");
    assert_string_equal(last.out, "veduta " VEDUTA_VERSION "\n");
    SUCCEEDS("--help");
    expect_text(last.out, "render", "--help");
    static const char *const commands[] = {"render", "info", "compare", "bench"};
    for (int i = 0; i < 4; i++) {
        SUCCEEDS("help", commands[i]);
        expect_text(last.out, "  veduta ", "help"); /* an example */
        SUCCEEDS(commands[i], "--help");
        expect_text(last.out, "--json", "--help");
    }
    FAILS(2, "did you mean \"render\"", "rendr");
    FAILS(2, "there is no command \"compose\"", "compose");
    FAILS(2, "there is no command \"nothing\"", "help", "nothing");
    FAILS(2, "the command comes first", "--size");
    assert_int_equal(RUN("render"), 2);
    assert_int_equal(finish(start(NULL, 0)), 2);
}

static void test_render(void **state) {
    (void)state;
    SUCCEEDS("render", dem_png, "--cell-size", "70", "-s", "96x54", "--samples", "1");
    expect_text(last.err, "wrote veduta.png, 96x54", "standard error");
    assert_string_equal(last.out, "");
    vd_picture *picture = load("veduta.png");
    assert_int_equal(picture->width, 96);
    assert_int_equal(picture->height, 54);
    /* The framing shows sky above, land in the middle. */
    vd_rgba8 sky = vd_picture_color(picture, 48, 1), land = vd_picture_color(picture, 48, 32);
    assert_true(sky.b > sky.r);
    assert_false(memcmp(&sky, &land, sizeof sky) == 0);
    unload(picture);
    /* The file says how it was made. */
    SUCCEEDS("info", "veduta.png");
    expect_text(last.out, "Software    veduta " VEDUTA_VERSION, "info");
    expect_text(last.out, "veduta:command veduta render ", "info");
    expect_text(last.out, "\"azimuth\":0.0", "info");
}

static void test_same_picture(void **state) {
    (void)state;
    char one[17], other[17];
    SUCCEEDS("render", dem_png, "-s", "64x36", "--threads", "1", "-o", "a.png", "--json");
    take_hash(one);
    SUCCEEDS("render", dem_png, "-s", "64x36", "--threads", "7", "-o", "b.png", "-j", "-q");
    take_hash(other);
    assert_string_equal(one, other);
    assert_string_equal(last.err, "");
    SUCCEEDS("compare", "a.png", "b.png");
    SUCCEEDS("render", dem_png, "-s", "64x36", "--sun", "10,20", "-o", "b.png", "-j");
    take_hash(other);
    assert_string_not_equal(one, other);
}

/* Every spelling of a camera is printed back as flags and as JSON that give the same bytes. */
static void test_print_camera(void **state) {
    (void)state;
    static const char *const cameras[][6] = {
        {"--azimuth=33.3", "--roll=0.1", "--fov=33", "--near=0.5", "--elevation=21", NULL},
        {"--target=300,-200,1500", "--distance=0.7km", "--elevation=60", NULL},
        {"--eye=100.1,-300.3,9000", "--target=301,-202,700", "--roll=7", NULL},
        {"--eye=100.1,-300.3,9000", NULL},
        {"--eye=300,-200,7000.7", "--heading=123.4", "--pitch=-85", NULL},
        {"--projection=orthographic", "--elevation=90", NULL},
    };
    for (size_t i = 0; i < sizeof cameras / sizeof cameras[0]; i++) {
        const char *command[47] = {"render", dem_png, "-s", "48x27", "-o", "a.png", "--json", "-q"};
        int count = 8;
        for (int j = 0; cameras[i][j] != NULL; j++) {
            command[count++] = cameras[i][j];
        }
        char hash[17], again[17], text[1 << 14];
        expect_success(finish(start(command, count)));
        take_hash(hash);
        command[6] = "--print-camera";
        expect_success(finish(start(command, count)));
        strcpy(text, last.out);
        char *json = strchr(text, '{');
        assert_non_null(json);
        FILE *file = fopen("camera.json", "wb");
        fputs(json, file);
        fclose(file);
        *json = '\0';
        SUCCEEDS("render", dem_png, "camera.json", "-s", "48x27", "-o", "a.png", "--json");
        take_hash(again);
        assert_string_equal(hash, again);
        command[6] = "--json";
        count = 8;
        for (char *word = strtok(text, " \n"); word != NULL; word = strtok(NULL, " \n")) {
            command[count++] = word;
            assert_true(count < 47);
        }
        expect_success(finish(start(command, count)));
        take_hash(again);
        assert_string_equal(hash, again);
    }
}

static void test_options_file(void **state) {
    (void)state;
    char hash[17], again[17];
    write_pnm("h.pgm", 40, 30, 1);
    SUCCEEDS("render", "h.pgm", "-s", "48x27", "--sun", "80,30", "-o", "one.png", "--save",
             "view.json", "--json");
    take_hash(hash);
    SUCCEEDS("render", "view.json", "--json");
    take_hash(again);
    assert_string_equal(hash, again);
    SUCCEEDS("render", "--options", "view.json", "--json", "--sun", "200,30");
    take_hash(again);
    assert_string_not_equal(hash, again);
    SUCCEEDS("render", "view.json", "-s", "32x18", "--eye", "20,-60,300", "--pitch", "-70");
    FILE *file = fopen("newer.json", "wb");
    fputs("{\"veduta\": \"99.0\", \"inputs\": [\"h.pgm\"], \"azimuth\": 3}", file);
    fclose(file);
    SUCCEEDS("render", "newer.json", "-s", "32x18", "--eye", "20,-60,300", "--pitch", "-70");
    expect_text(last.err, "newer than this", "a note");
    /* A file in another folder brings its own paths. */
    mkdir("deeper", 0755);
    SUCCEEDS("render", "h.pgm", "-s", "48x27", "--sun", "80,30", "-o", "one.png", "--save",
             "deeper/view.json");
    remove("one.png");
    SUCCEEDS("render", "deeper/view.json", "--json");
    take_hash(again);
    assert_string_equal(hash, again);
    assert_true(exists("one.png"));
}

static void test_planes(void **state) {
    (void)state;
    write_pnm("h.pgm", 40, 30, 1);
    SUCCEEDS("render", "h.pgm", "-s", "48x27", "-o", "c.png", "--depth", "d.pfm", "--ids", "i.png");
    assert_true(exists("c.png") && exists("d.pfm") && exists("i.png"));
    vd_picture *ids = load("i.png");
    assert_int_equal(ids->bits, 16);
    unload(ids);
    SUCCEEDS("render", "h.pgm", "-s", "48x27", "-o", "c.png", "--background", "transparent");
    vd_picture *cut = load("c.png");
    assert_int_equal(cut->channels, 4);
    assert_int_equal(vd_picture_color(cut, 0, 0).a, 0);
    unload(cut);
    FAILS(2, "two results", "render", "h.pgm", "-o", "c.png", "--ids", "c.png");
    FAILS(2, "two results", "render", "h.pgm", "-o", "c.png", "--save", "c.png");
    FAILS(2, "two results", "render", "h.pgm", "-o", "c.png", "--save", "./c.png");
    FAILS(2, "two results", "render", "h.pgm", "-o", "-", "--save", "-");
}

static void test_dry_run(void **state) {
    (void)state;
    SUCCEEDS("render", dem_png, "-s", "64x36", "--dry-run", "-o", "dry.png");
    expect_text(last.out, "seconds", "--dry-run");
    expect_text(last.out, "memory", "--dry-run");
    assert_false(exists("dry.png"));
    SUCCEEDS("render", dem_png, "-s", "64x36", "--dry-run", "--json");
    const char *memory = strstr(last.out, "\"memory_bytes\": ");
    assert_non_null(memory);
    assert_true(atof(memory + 16) > 2e6); /* the program itself counts, not the picture alone */
}

static void test_bad_use(void **state) {
    (void)state;
    FAILS(2, "did you mean --size", "render", dem_png, "--sise", "3x3");
    FAILS(2, "--size", "render", dem_png, "--size", "0x5");
    FAILS(2, "--eye", "render", dem_png, "--eye", "nan,0,0");
    FAILS(2, "did you mean viridis?", "render", dem_png, "--colormap", "virids");
    FAILS(2, "would be overwritten", "render", dem_png, "-o", dem_png);
    FAILS(2, "name two", "compare", "a.png");
    FAILS(2, "there is no file", "info");
    FAILS(2, "--tolerance", "compare", "a", "b", "--tolerance", "-1");
}

static void test_standard_input(void **state) {
    (void)state;
    char hash[17], again[17];
    write_pnm("h.pgm", 40, 30, 1);
    SUCCEEDS("render", "h.pgm", "-s", "48x27", "-o", "a.png", "--json");
    take_hash(hash);
    standard_input = "h.pgm";
    SUCCEEDS("render", "-", "-s", "48x27", "-o", "a.png", "--json");
    take_hash(again);
    assert_string_equal(hash, again);
    SUCCEEDS("info", "-");
    expect_text(last.out, "format      standard input", "info");
    FAILS(2, "can be read once", "render", "-", "--color", "-");
    standard_input = dem_tif;
    FAILS(1, ".hgt", "render", "-");
    standard_input = "/dev/null";
    FAILS(1, "standard input: it is empty", "render", "-");
    FAILS(1, "it is a device", "render", "/dev/zero");
}

static void test_bad_data(void **state) {
    (void)state;
    FAILS(1, "cannot read none.png", "render", "none.png");
    FAILS(1, "cannot read none.tif", "info", "none.tif");
    FAILS(1, "there is no folder nowhere", "render", dem_png, "-o", "nowhere/x.png");
    FAILS(1, "is a folder", "render", dem_png, "-o", ".");
    FAILS(1, "cannot read none.jpg", "render", dem_png, "--color", "none.jpg");
    FAILS(1, "cannot read none.cpt", "render", dem_png, "--colormap", "none.cpt");
    FAILS(1, "no georeference", "render", dem_png, "--eye", "45,6,2m");
    FILE *file = fopen("cut.png", "wb");
    fputs("\x89PNG\r\n\x1a\n", file);
    fclose(file);
    FAILS(1, "cut.png", "render", "cut.png");
    file = fopen("holes.asc", "wb");
    fputs(
        "ncols 2\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 10\nNODATA_value -1\n-1 -1\n-1 -1\n",
        file);
    fclose(file);
    FAILS(1, "are missing", "render", "holes.asc");
    assert_false(exists("veduta.png.part"));
}

/* A picture with nothing in it is written only when asked for, and says why. */
static void test_empty(void **state) {
    (void)state;
    remove("empty.png");
    FAILS(1, "empty", "render", dem_png, "-s", "32x18", "--eye", "0,0,9000", "--pitch", "80", "-o",
          "empty.png");
    FAILS(1, "under ground", "render", dem_png, "-s", "32x18", "--eye", "300,-200,10", "-o",
          "empty.png");
    FAILS(1, "near plane", "render", dem_png, "-s", "32x18", "--near", "1e9", "-o", "empty.png");
    FAILS(1, "below the horizon", "render", dem_png, "--sun", "0,-3", "-o", "empty.png");
    assert_false(exists("empty.png"));
    SUCCEEDS("render", dem_png, "-s", "32x18", "--eye", "0,0,9000", "--pitch", "80", "-o",
             "empty.png", "--allow-empty");
    assert_true(exists("empty.png"));
}

static void test_interrupt(void **state) {
    (void)state;
    remove("long.png");
    const char *arguments[] = {"render", dem_png, "-s",       "6000x4000", "--samples",
                               "8",      "-o",    "long.png", "--save",    "long.json"};
    pid_t child = start(arguments, 10);
    /* --save is done when signals are already caught and the picture is not yet begun. */
    for (int tries = 0; !exists("long.json"); tries++) {
        if (tries == 6000) {
            kill(child, SIGKILL);
            fail_msg("long.json was never written");
        }
        usleep(10 * 1000);
    }
    kill(child, SIGINT);
    expect_failure(finish(child), 1, "nothing was written");
    assert_false(exists("long.png"));
}

static void test_holes(void **state) {
    (void)state;
    FILE *file = fopen("hole.asc", "wb");
    fputs("ncols 4\nnrows 4\nxllcorner 0\nyllcorner 0\ncellsize 10\nNODATA_value -1\n"
          "5 6 7 8\n5 -1 7 8\n5 6 7 8\n5 6 7 8\n",
          file);
    fclose(file);
    char holes[17], filled[17];
    SUCCEEDS("render", "hole.asc", "-s", "32x18", "-o", "a.png", "--json", "--elevation", "90");
    take_hash(holes);
    expect_text(last.err, "1 of 16 samples (6.25 %) are missing; they are left as holes", "a note");
    expect_text(last.out, "\"missing\": 1", "JSON");
    SUCCEEDS("render", "hole.asc", "-s", "32x18", "-o", "a.png", "--json", "--elevation", "90",
             "--missing", "fill");
    take_hash(filled);
    expect_text(last.err, "filled", "a note");
    assert_string_not_equal(holes, filled);
}

/* Writes an ESRI ASCII grid of n × n samples whose heights a function gives; NaN is missing. */
static void write_asc(const char *path, int n, const char *head, double (*height)(int, int)) {
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    fprintf(file, "ncols %d\nnrows %d\n%s\nNODATA_value -99999\n", n, n, head);
    for (int row = 0; row < n; row++) {
        for (int column = 0; column < n; column++) {
            fprintf(file, "%.10g ", height(column, row));
        }
        fputc('\n', file);
    }
    fclose(file);
}

static double ramp(int column, int row) {
    return 1024.0 * row + 16.0 * column;
}

static double needle(int column, int row) {
    return column == 10 && row == 10 ? 8848000.0 : 100.0;
}

static double every_second(int column, int row) {
    return (column + row) % 2 == 0 ? -99999.0 : 5.0;
}

static double coast(int column, int row) {
    return (column - 8) * 150.0 + row;
}

static double rift(int column, int row) {
    return (column - 8) * 50.0 + row;
}

/* Legal data without a camera always give a picture, and one camera that repeats it. */
static void test_framing(void **state) {
    (void)state;
    static const char *const metres = "xllcorner 500000\nyllcorner 5000000\ncellsize 30";
    static const char *const degrees = "xllcorner 7\nyllcorner 45\ncellsize 0.05";
    write_asc("ramp.asc", 20, metres, ramp);
    write_asc("needle.asc", 20, metres, needle);
    write_asc("degrees.asc", 17, degrees, rift);
    static const char *const cases[][3] = {{"ramp.asc", "48x27", "straight down"},
                                           {"needle.asc", "48x27", "--height-scale"},
                                           {"degrees.asc", "2x400", "curvature is left out"}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        char hash[17], again[17];
        SUCCEEDS("render", cases[i][0], "-s", cases[i][1], "-o", "a.png", "--json");
        expect_text(last.err, cases[i][2], "a note");
        take_hash(hash);
        SUCCEEDS("render", cases[i][0], "-s", cases[i][1], "-o", "a.png", "-q", "--print-camera");
        FILE *file = fopen("camera.json", "wb");
        fputs(strchr(last.out, '{'), file);
        fclose(file);
        SUCCEEDS("render", cases[i][0], "camera.json", "-s", cases[i][1], "-o", "a.png", "--json");
        take_hash(again);
        assert_string_equal(hash, again);
    }
    write_asc("sieve.asc", 20, metres, every_second);
    FAILS(1, "--missing fill", "render", "sieve.asc", "-q", "-s", "48x27", "--elevation", "90");
}

static void test_advice(void **state) {
    (void)state;
    static const char *const degrees = "xllcorner 7\nyllcorner 45\ncellsize 0.05";
    write_asc("coast.asc", 17, degrees, coast);
    write_asc("rift.asc", 17, degrees, rift);
    SUCCEEDS("render", "rift.asc", "-s", "32x18", "-o", "a.png", "--haze", "5km");
    expect_text(last.err, "--haze", "a note");
    SUCCEEDS("render", "rift.asc", "-s", "32x18", "-o", "a.png", "--haze", "900km");
    assert_null(strstr(last.err, "--haze"));
    SUCCEEDS("render", "rift.asc", "-s", "32x18", "-o", "a.png", "--eye", "45.31,7.32,2m",
             "--target", "45.31,7.32");
    expect_text(last.err, "straight down", "a note");
    /* Sea floor takes sea colours, land below the sea's level does not. */
    static const char *const maps[][2] = {{"coast.asc", "topo"}, {"rift.asc", "terrain"}};
    for (int i = 0; i < 2; i++) {
        char hash[17], again[17];
        SUCCEEDS("render", maps[i][0], "-s", "32x18", "-o", "a.png", "--json");
        take_hash(hash);
        SUCCEEDS("render", maps[i][0], "-s", "32x18", "-o", "a.png", "--json", "--colormap",
                 maps[i][1]);
        take_hash(again);
        assert_string_equal(hash, again);
    }
}

/* The command line of the acceptance checks: all methods, the same bytes. */
static void test_classic(void **state) {
    (void)state;
    write_pnm("map.pgm", 64, 64, 1);
    write_pnm("color.ppm", 64, 64, 3);
    write_pnm("small.ppm", 16, 32, 3);
    char hash[17] = "", again[17];
    for (int i = 0; i < VD_CLASSIC_METHOD_COUNT; i++) {
        const char *method = vd_classic_method_name((vd_classic_method)i);
        SUCCEEDS("render", "--height", "map.pgm", "--color", "color.ppm", "--classic",
                 "x=512,y=800,height=78,yaw=30,horizon=100,scale=240,view=1,distance=300,z0=1,"
                 "step=0.1,growth=0",
                 "--size", "70x51", "--method", method, "--threads", "2", "--background", "9090E0",
                 "-o", "out.png", "--json");
        take_hash(again);
        assert_true(i == 0 || strcmp(hash, again) == 0);
        strcpy(hash, again);
    }
    for (int i = 0; i < VD_CLASSIC_METHOD_COUNT; i++) {
        const char *method = vd_classic_method_name((vd_classic_method)i);
#define QUALITY                                                                                    \
    "render", "--height", "map.pgm", "--color", "color.ppm", "--classic",                          \
        "distance=300,mip=1,smooth=1", "--size", "70x51", "--filter", "bilinear", "--samples",     \
        "4", "--method", method, "-o", "out.png", "--json"
        if (i == VD_CLASSIC_SCAN) {
            FAILS(2, "the method scan draws no picture with the option filter", QUALITY);
            continue;
        }
        SUCCEEDS(QUALITY);
#undef QUALITY
        take_hash(again);
        assert_true(i == 0 || strcmp(hash, again) == 0);
        strcpy(hash, again);
    }
    SUCCEEDS("render", "map.pgm", "--classic", "distance=200,smooth=1", "--print-camera", "-q");
    expect_text(last.out, "growth=0,smooth=1\n", "--print-camera");
    SUCCEEDS("render", "map.pgm", "--classic", "distance=200", "--print-camera", "-q");
    expect_text(last.out,
                "--classic x=512,y=800,height=78,yaw=0,horizon=100,scale=240,view=1,"
                "distance=200,z0=1,step=0.1,growth=0\n",
                "--print-camera");
    SUCCEEDS("render", "map.pgm", "--classic", "distance=200", "--color", "small.ppm");
    expect_text(last.err, "resampled", "a note");
    FAILS(2, "step", "render", "map.pgm", "--classic", "step=0");
    FAILS(1, "background", "render", "map.pgm", "--classic", "distance=200,height=255,horizon=600");
}

static void test_function(void **state) {
    (void)state;
    const char *formula = "h=60*cos(x/40)*sin(y/40); rgb=hsv(h/120,0.6,1)";
    char first[17], second[17];
    SUCCEEDS("render", "--function", formula, "--extent", "-90,-60,90,60", "-s", "64x40", "-j",
             "--method", "march");
    take_hash(first);
    expect_text(last.out, "formula", "the result");
    SUCCEEDS("render", "--function", formula, "--extent=-90,-60,90,60", "-s", "64x40", "-j",
             "--method", "raycast", "--threads", "3");
    take_hash(second);
    assert_string_equal(first, second);
    /* Without an extent there is no end. */
    SUCCEEDS("render", "--function", formula, "--elevation", "25", "-s", "64x40", "-j");
    take_hash(first);
    expect_text(last.out, "formula without end", "the result");
    SUCCEEDS("render", "--function", formula, "--elevation", "25", "-s", "64x40", "-j", "--method",
             "raycast");
    take_hash(second);
    assert_string_equal(first, second);
    assert_null(strstr(last.err, "--shadows"));
    SUCCEEDS("render", "--function", formula, "-s", "64x40", "--shadows", "on");
    expect_text(last.err, "--shadows: a formula without end throws none", "standard error");
    assert_int_equal(RUN("render", "--function", "h=co(x)"), 1);
    expect_text(last.err, "column 3", "standard error");
    FAILS(1, "no height anywhere", "render", "--function", "h=x/0-x/0");
    FAILS(2, "X0 < X1", "render", "--function", "h=x", "--extent", "3,3,1,1");
    FAILS(2, "leave out a.png", "render", "--function", "h=x", "a.png");
    FAILS(1, "--cell-size", "render", "--function", "h=x", "--extent=-9,-9,9,9", "--cell-size",
          "1e-6");
    FAILS(2, "does not apply to --classic", "render", "--classic", "x=1", "--function", "h=x");
}

static void test_classic_shadows(void **state) {
    (void)state;
    write_pnm("shadow-h.pgm", 64, 64, 1);
    write_pnm("shadow-c.ppm", 64, 64, 3);
    char plain[17], soft[17], count[17], again[17];
#define CLASSIC                                                                                    \
    "render", "--height", "shadow-h.pgm", "--color", "shadow-c.ppm", "--classic", "distance=200",  \
        "-s", "70x50", "-j"
    SUCCEEDS(CLASSIC);
    take_hash(plain);
    SUCCEEDS(CLASSIC, "--shadows", "--sun", "250,12");
    take_hash(soft);
    SUCCEEDS(CLASSIC, "--shadows", "count", "--sun", "250,12", "--save", "shadows.json");
    take_hash(count);
    SUCCEEDS("render", "shadows.json", "-j", "--method", "reference", "--threads", "1");
    take_hash(again);
    assert_string_not_equal(plain, soft);
    assert_string_not_equal(soft, count);
    assert_string_equal(count, again);
    SUCCEEDS(CLASSIC, "--shadows", "count", "--sun", "250,90");
    take_hash(again);
    assert_string_equal(plain, again); /* a sun overhead throws none */
#undef CLASSIC
}

static void test_compare(void **state) {
    (void)state;
    write_pnm("a.ppm", 16, 16, 3);
    write_pnm("b.ppm", 16, 16, 3);
    FILE *file = fopen("b.ppm", "r+b");
    fseek(file, -1, SEEK_END);
    int byte = fgetc(file);
    fseek(file, -1, SEEK_END);
    fputc(byte > 100 ? byte - 3 : byte + 3, file);
    fclose(file);
    SUCCEEDS("compare", "a.ppm", "a.ppm");
    assert_int_equal(RUN("compare", "a.ppm", "b.ppm", "--diff", "diff.png", "--json"), 1);
    expect_text(last.out, "\"differing_pixels\": 1", "--json");
    expect_text(last.out, "\"maximum\": 3.0", "--json");
    assert_true(exists("diff.png"));
    SUCCEEDS("compare", "a.ppm", "b.ppm", "--tolerance", "3");
    FAILS(1, "sizes differ", "compare", "a.ppm", dem_png);
    FAILS(1, "cannot read none", "compare", "a.ppm", "none");
}

static void test_georeferenced(void **state) {
    (void)state;
    if (!has_geo()) {
        expect_text(last.err, "GDAL", "standard error");
        skip();
    }
    expect_text(last.out, "geographic (degrees)", "info");
    expect_text(last.out, "missing     0 samples", "info");
    expect_text(last.out, "--distance", "info");
    SUCCEEDS("info", dem_tif, "--json");
    expect_text(last.out, "\"crs_kind\": \"geographic\"", "info --json");
    char hash[17], again[17];
    SUCCEEDS("render", dem_tif, "-s", "48x27", "-o", "a.png", "--eye", "45.9237,6.8694,2m",
             "--target", "45.8326,6.8652", "--json");
    take_hash(hash);
    expect_text(last.out, "\"above_ground_m\": 2.0", "--json");
    SUCCEEDS("render", dem_tif, "-s", "48x27", "-o", "a.png", "--eye", "45.9237,6.8694,5000masl",
             "--target", "45.8326,6.8652", "--json");
    take_hash(again);
    assert_string_not_equal(hash, again);
    FAILS(1, "outside the map", "render", dem_tif, "--eye", "10,10,2m");
    SUCCEEDS("render", VEDUTA_SOURCE_DIR "/data/olinda/olinda_dem_utm25s.tif", "--color",
             VEDUTA_SOURCE_DIR "/data/olinda/L7_ETMs.tif", "--bands", "3,2,1", "-s", "48x27", "-o",
             "a.png");
    FAILS(1, "L7_ETMs.tif", "render", dem_tif, "--color",
          VEDUTA_SOURCE_DIR "/data/olinda/L7_ETMs.tif", "-q", "-o", "a.png");
}

static char folder[] = VEDUTA_BINARY_DIR "/test-app-XXXXXX";

static int enter_folder(void **state) {
    (void)state;
    return test_enter_folder(folder);
}

static int leave_folder(void **state) {
    (void)state;
    char command[sizeof folder + 16];
    snprintf(command, sizeof command, "rm -r '%s'", folder);
    return chdir(VEDUTA_BINARY_DIR) == 0 && system(command) == 0 ? 0 : -1;
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_front),         cmocka_unit_test(test_render),
        cmocka_unit_test(test_same_picture),  cmocka_unit_test(test_print_camera),
        cmocka_unit_test(test_options_file),  cmocka_unit_test(test_planes),
        cmocka_unit_test(test_dry_run),       cmocka_unit_test(test_bad_use),
        cmocka_unit_test(test_bad_data),      cmocka_unit_test(test_empty),
        cmocka_unit_test(test_interrupt),     cmocka_unit_test(test_holes),
        cmocka_unit_test(test_classic),       cmocka_unit_test(test_compare),
        cmocka_unit_test(test_function),      cmocka_unit_test(test_classic_shadows),
        cmocka_unit_test(test_georeferenced), cmocka_unit_test(test_standard_input),
        cmocka_unit_test(test_framing),       cmocka_unit_test(test_advice),
    };
    return cmocka_run_group_tests(tests, enter_folder, leave_folder);
}

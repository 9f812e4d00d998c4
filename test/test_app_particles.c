/* test_app_particles.c: the program on particles, from outside. */
#include "support.h"

#include <fcntl.h>
#include <math.h>
#include <signal.h>
#include <spawn.h>
#include <stdio.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>
#include <veduta/picture.h>

extern char **environ;

static const char *const program = VEDUTA_BINARY_DIR "/veduta";
static const char *const haystack = VEDUTA_SOURCE_DIR "/data/points/Haystack_Rock.las";
static const char *const urban = VEDUTA_SOURCE_DIR "/data/points/urban.las";
static char folder[] = VEDUTA_BINARY_DIR "/test-app-particles-XXXXXX";
static char out[1 << 16], err[1 << 14];

static void read_back(const char *path, char *text, size_t bytes) {
    FILE *file = fopen(path, "rb");
    const size_t length = file != NULL ? fread(text, 1, bytes - 1, file) : 0;
    text[length] = '\0';
    if (file != NULL) {
        fclose(file);
    }
}

static pid_t start(const char *const *arguments, int count) {
    char *argv[32] = {(char *)program};
    for (int i = 0; i < count; i++) {
        argv[i + 1] = (char *)arguments[i];
    }
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_addopen(&actions, 0, "/dev/null", O_RDONLY, 0);
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
    read_back("out.txt", out, sizeof out);
    read_back("err.txt", err, sizeof err);
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

#define COUNT(...) ((int)(sizeof((const char *[]){__VA_ARGS__}) / sizeof(char *)))
#define RUN(...) finish(start((const char *[]){__VA_ARGS__}, COUNT(__VA_ARGS__)))

static void expect(int got, int status, const char *text, const char *part) {
    if (got != status || strstr(text, part) == NULL) {
        fail_msg("status %d, expected %d and \"%s\": %s%s", got, status, part, out, err);
    }
}

#define SUCCEEDS(...) expect(RUN(__VA_ARGS__), 0, "", "")
#define SAYS(part, ...) expect(RUN(__VA_ARGS__), 0, out, part)

/* One sentence, nothing on standard output. */
static void expect_failure(int got, int status, const char *part) {
    expect(got, status, err, part);
    assert_string_equal(out, "");
    assert_int_equal(strncmp(err, "veduta: ", 8), 0);
    assert_ptr_equal(strchr(err, '\n'), err + strlen(err) - 1);
}

#define FAILS(status, part, ...) expect_failure(RUN(__VA_ARGS__), status, part)

static void write_text(const char *path, const char *text) {
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    fputs(text, file);
    fclose(file);
}

/* How many pixels of a picture differ from its first one. */
static size_t drawn_pixels(const char *path) {
    vd_context *context = test_context(1, VD_ISA_AUTO);
    vd_picture *p = NULL;
    assert_ok(vd_picture_load(context, path, &p));
    const uint8_t *first = p->data;
    size_t count = 0;
    for (int y = 0; y < p->height; y++) {
        const uint8_t *row = (const uint8_t *)p->data + (size_t)y * p->stride_bytes;
        for (int x = 0; x < p->width; x++) {
            count += memcmp(row + (size_t)x * (size_t)p->channels, first, 3) != 0;
        }
    }
    vd_picture_destroy(&p);
    vd_context_destroy(&context);
    return count;
}

static void test_scans(void **state) {
    (void)state;
    SUCCEEDS("render", haystack, "-s", "320x200", "-o", "h.png");
    assert_true(drawn_pixels("h.png") > 320 * 200 / 8);
    SUCCEEDS("import", "particles", haystack, "-o", "h.vdp");
    SUCCEEDS("render", "h.vdp", "-s", "320x200", "--color-by", "height", "-o", "v.png");
    assert_true(drawn_pixels("v.png") > 320 * 200 / 8);
    SAYS("\"color_by\": \"class\"", "render", urban, "-s", "64x64", "-j", "-o", "u.png");
    SAYS("LAS 1.2, points of format 3", "info", urban);
    SAYS("21932", "info", "h.vdp");
    SAYS("\"particles\": 21932", "info", "h.vdp", "--json");
    SAYS("usage: veduta render", "render", "h.vdp", "--help");
    SAYS("usage: veduta import", "import", "--help");
    SAYS("usage: veduta generate", "generate", "--help");
}

static void test_text(void **state) {
    (void)state;
    write_text("p.csv", "x,y,z,mass\n0,0,0,1\n1,0,0,2\n0,1,nan,3\n0,0,1,inf\n");
    SUCCEEDS("render", "p.csv", "-s", "64x64", "-o", "p.png");
    assert_non_null(strstr(err, "1 particles were left out"));
    SAYS("\"skipped\": 1", "import", "particles", "p.csv", "-o", "p.vdp", "--json");
    assert_non_null(strstr(err, "1 values are no numbers"));
    SAYS("\"missing_values\": 1", "import", "particles", "p.csv", "-o", "p.vdp", "--json");
    for (int mode = 0; mode < 3; mode++) {
        static const char *const modes[] = {"alpha", "density", "nearest"};
        SUCCEEDS("render", "p.vdp", "--mode", modes[mode], "--radius", "0.05", "-s", "64x64", "-o",
                 "p.png");
        assert_true(drawn_pixels("p.png") > 10);
    }
    SUCCEEDS("render", "p.vdp", "--color-by", "mass", "--range", "1,2", "--log", "--projection",
             "orthographic", "--background", "none", "-s", "64x64", "-o", "p.png", "--radius",
             "0.1");
    write_text("same.csv", "x,y,z\n5,5,5\n5,5,5\n");
    SUCCEEDS("render", "same.csv", "-s", "64x64", "-o", "same.png");
    assert_true(drawn_pixels("same.png") > 0);
    write_text("one.csv", "x,y,z\n5,5,5\n");
    SUCCEEDS("render", "one.csv", "-s", "64x64", "-o", "one.png");
    assert_true(drawn_pixels("one.png") > 0);
}

static void test_bad(void **state) {
    (void)state;
    write_text("p.csv", "x,y,z,mass\n0,0,0,1\n1,0,0,2\n");
    write_text("short.csv", "x,y,z\n1,2,3\n1,2\n");
    write_text("none.csv", "x,y,z\n");
    write_text("nan.csv", "x,y,z\nnan,1,2\n");
    FAILS(1, "line 3 has 2 columns", "render", "short.csv");
    FAILS(1, "0 particles", "render", "none.csv");
    FAILS(1, "NaN or infinite", "import", "particles", "nan.csv", "-o", "x.vdp");
    FAILS(1, "No such file", "import", "particles", "gone.las", "-o", "x.vdp");
    FAILS(2, "say what to import", "import", "gone.las", "-o", "x.vdp");
    FAILS(2, "there is no file to import", "import", "particles", "-o", "x.vdp");
    FAILS(2, "where the bricks go", "import", "particles", "p.csv");
    FAILS(2, "not to standard output", "import", "particles", "p.csv", "-o", "-");
    FAILS(2, "would be overwritten", "import", "particles", "p.csv", "-o", "p.csv");
    FAILS(2, "did you mean \"mass\"", "render", "p.csv", "--color-by", "mas");
    FAILS(2, "--range", "render", "p.csv", "--range", "2,1");
    FAILS(2, "--range", "render", "p.csv", "--range", "0,1", "--log");
    FAILS(2, "--size", "render", "p.csv", "--size", "0x5");
    FAILS(2, "--background", "render", "p.csv", "--background", "red");
    FAILS(2, "--eye", "render", "p.csv", "--eye", "1,2");
    FAILS(2, "give one of them", "render", "p.csv", "--eye", "1,2,3", "--azimuth", "4");
    FAILS(2, "--weight", "render", "p.csv", "--weight", "volume");
    FAILS(1, "sees no particles", "render", "p.csv", "--eye", "100,0,0", "--target", "200,0,0");
    FAILS(2, "say what to generate", "generate", "mountains", "-o", "x.vdp");
    FAILS(2, "--center", "generate", "particles", "-n", "10", "--center", "1,2", "-o", "x.vdp");
    FAILS(2, "--size", "generate", "particles", "-n", "10", "--size", "0", "-o", "x.vdp");
    SUCCEEDS("import", "particles", "p.csv", "-o", "p.vdp");
    struct stat info;
    assert_int_equal(stat("p.vdp", &info), 0);
    assert_int_equal(truncate("p.vdp", info.st_size - 1), 0);
    FAILS(1, "it should have", "render", "p.vdp");
    FAILS(1, "it should have", "info", "p.vdp");
    assert_int_equal(access("x.vdp", F_OK), -1);
}

/* Two LAS files become one; attributes that one lacks are left out, which is said. */
static void test_several(void **state) {
    (void)state;
    SAYS("\"particles\": 43864", "import", "particles", haystack, haystack, "-o", "two.vdp", "-j");
    write_text("p.csv", "x,y,z,mass\n0,0,0,1\n1,0,0,2\n");
    SUCCEEDS("import", "particles", "p.csv", haystack, "-o", "mixed.vdp");
    assert_non_null(strstr(err, "not all files have"));
    SUCCEEDS("generate", "particles", "-n", "2000", "-o", "g.vdp");
    SUCCEEDS("generate", "particles", "-n", "2000", "-o", "g2.vdp");
    SUCCEEDS("render", "g.vdp", "-s", "64x64", "-q", "-o", "g.png");
    assert_int_equal(system("cmp -s g.vdp g2.vdp"), 0);
}

/* Interrupted, nothing is left; with --resume what is sorted stays and is used. */
static void test_interrupted(void **state) {
    (void)state;
    FILE *file = fopen("large.f32", "wb");
    assert_non_null(file);
    uint64_t seed = 1;
    enum { ROWS = 3000000 };
    for (int i = 0; i < ROWS; i++) {
        const float p[3] = {(float)test_uniform(&seed), (float)test_uniform(&seed),
                            (float)test_uniform(&seed)};
        fwrite(p, sizeof p, 1, file);
    }
    fclose(file);
    const char *const arguments[] = {"import",    "particles", "large.f32", "--raw",    "f32", "-o",
                                     "large.vdp", "--resume",  "--json",    "--memory", "64"};
    bool resumed = false;
    for (int tries = 0; tries < 200 && !resumed; tries++) {
        const pid_t child = start(arguments, 11);
        for (int i = 0; i < 2000 && access("large.vdp.part.state", F_OK) != 0; i++) {
            usleep(1000);
        }
        kill(child, SIGINT);
        const int status = finish(child);
        if (status == 0) {
            remove("large.vdp");
            continue; /* it was faster */
        }
        expect(status, 1, err, "what is sorted was kept for --resume");
        assert_int_equal(access("large.vdp", F_OK), -1);
        expect(finish(start(arguments, 11)), 0, out, "\"particles\": 3000000");
        resumed = strstr(out, "\"resumed\": 0,") == NULL;
        assert_int_equal(access("large.vdp.part", F_OK), -1);
        assert_int_equal(access("large.vdp.part.state", F_OK), -1);
        assert_int_equal(rename("large.vdp", "resumed.vdp"), 0);
    }
    assert_true(resumed);
    SUCCEEDS("import", "particles", "large.f32", "--raw", "f32", "-o", "large.vdp");
    assert_int_equal(system("cmp -s large.vdp resumed.vdp"), 0);
    remove("large.vdp");
    const pid_t child = start(arguments, 7);
    for (int i = 0; i < 5000 && access("large.vdp.part", F_OK) != 0; i++) {
        usleep(1000);
    }
    kill(child, SIGINT);
    if (finish(child) != 0) {
        expect(1, 1, err, "nothing was written");
        assert_int_equal(system("ls large.vdp* >ls.txt 2>&1"), 512);
    }
}

static int set_up(void **state) {
    (void)state;
    return test_enter_folder(folder);
}

static int tear_down(void **state) {
    (void)state;
    return test_leave_folder(folder);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_scans),       cmocka_unit_test(test_text),
        cmocka_unit_test(test_bad),         cmocka_unit_test(test_several),
        cmocka_unit_test(test_interrupted),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}

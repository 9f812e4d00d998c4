/* test_app_view.c: the window, driven by keys and mouse on a display of its own (Xvfb, xdotool). */
#include "support.h"

#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <signal.h>
#include <spawn.h>
#include <stdio.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>
#include <veduta/picture.h>

extern char **environ;

static const char *const program = VEDUTA_BINARY_DIR "/veduta";
static const char *const world = VEDUTA_SOURCE_DIR "/data/mont-blanc.png";
static const char *const other_world = VEDUTA_SOURCE_DIR "/data/bench/mont-blanc-1024.png";

/* ---- processes ---------------------------------------------------------------------------------
 */

static void rest(double seconds) {
    const struct timespec time = {(time_t)seconds,
                                  (long)(1e9 * (seconds - (double)(time_t)seconds))};
    nanosleep(&time, NULL);
}

static double now(void) {
    struct timespec time;
    clock_gettime(CLOCK_MONOTONIC, &time);
    return (double)time.tv_sec + 1e-9 * (double)time.tv_nsec;
}

static pid_t spawn(const char *const *arguments, const char *out, const char *err, int kept) {
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_addopen(&actions, 0, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_addopen(&actions, 1, out, O_WRONLY | O_CREAT | O_TRUNC, 0644);
    posix_spawn_file_actions_addopen(&actions, 2, err, O_WRONLY | O_CREAT | O_TRUNC, 0644);
    if (kept >= 0) {
        posix_spawn_file_actions_adddup2(&actions, kept, 3);
    }
    pid_t child = -1;
    if (posix_spawnp(&child, arguments[0], &actions, NULL, (char **)(uintptr_t)arguments,
                     environ) != 0) {
        child = -1;
    }
    posix_spawn_file_actions_destroy(&actions);
    return child;
}

/* Waits for a process; its exit status, 128 + signal, or −1 when it still runs after `seconds`. */
static int finish(pid_t child, double seconds) {
    int status = 0;
    for (const double end = now() + seconds; waitpid(child, &status, WNOHANG) != child;) {
        if (now() > end) {
            return -1;
        }
        rest(0.01);
    }
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

#define RUN(seconds, ...)                                                                          \
    finish(spawn((const char *const[]){__VA_ARGS__, NULL}, "run.txt", "run-err.txt", -1), seconds)

static void read_back(const char *path, char *out, size_t out_bytes) {
    FILE *file = fopen(path, "rb");
    const size_t length = file != NULL ? fread(out, 1, out_bytes - 1, file) : 0;
    out[length] = '\0';
    if (file != NULL) {
        fclose(file);
    }
}

/* ---- the display -------------------------------------------------------------------------------
 */

static pid_t display = -1;
static const char *missing; /* why the window cannot be tested */

static int start_display(void **unused) {
    (void)unused;
    int ends[2];
    char folder[] = "/tmp/veduta-view-XXXXXX";
    if (mkdtemp(folder) == NULL || chdir(folder) != 0 || pipe(ends) != 0) {
        return 1;
    }
    /* What SDL's own libraries keep is not ours, where leaks are looked for. */
    FILE *file = fopen("leaks.txt", "wb");
    if (file == NULL || fputs("leak:libdbus\nleak:libX11\nleak:libSDL2\n", file) < 0 ||
        fclose(file) != 0) {
        return 1;
    }
    char option[96];
    snprintf(option, sizeof option, "suppressions=%s/leaks.txt:print_suppressions=0", folder);
    setenv("LSAN_OPTIONS", option, 0);
    if (RUN(10, program, "view", "--frames", "1", "-q", world) != 1) {
        missing = "a display was there that should not be";
    }
    char text[400];
    read_back("run-err.txt", text, sizeof text);
    if (strstr(text, "built without SDL2") != NULL || strstr(text, "does not load") != NULL) {
        missing = text[0] != '\0' ? "this veduta has no window: SDL2 is missing" : NULL;
        return 0;
    }
    if (RUN(10, "sh", "-c", "command -v xdotool") != 0) {
        missing = "xdotool is missing; script/install-packages test brings it";
        return 0;
    }
    fcntl(ends[0], F_SETFD, FD_CLOEXEC);
    display = spawn((const char *const[]){"Xvfb", "-displayfd", "3", "-screen", "0", "1280x900x24",
                                          "-nolisten", "tcp", "-noreset", NULL},
                    "xvfb.txt", "xvfb-err.txt", ends[1]);
    close(ends[1]);
    char number[16] = ":";
    size_t length = 1;
    while (display > 0 && length < sizeof number - 1 && read(ends[0], number + length, 1) == 1 &&
           number[length] != '\n') {
        length++; /* up to the line break: it comes in two pieces */
    }
    close(ends[0]);
    if (length == 1) {
        missing = "Xvfb is missing; script/install-packages test brings it";
        return 0;
    }
    number[strcspn(number, "\n")] = '\0';
    setenv("DISPLAY", number, 1);
    return 0;
}

static int end_display(void **unused) {
    (void)unused;
    if (display > 0) {
        kill(display, SIGTERM);
        (void)finish(display, 10);
    }
    return 0;
}

static bool skipped(void) {
    if (missing != NULL) {
        print_message("skipped: %s\n", missing);
    }
    return missing != NULL;
}

#define NEEDS_DISPLAY()                                                                            \
    if (skipped()) {                                                                               \
        skip();                                                                                    \
        return;                                                                                    \
    }

/* ---- the window --------------------------------------------------------------------------------
 */

static pid_t viewer = -1;
static char output[1 << 18];

static void key(const char *name) {
    assert_int_equal(RUN(10, "xdotool", "key", "--delay", "0", name), 0);
}

/* How many cameras were printed so far; `last` (may be null) receives the last of them. */
static int cameras(char last[2048]) {
    read_back("view.txt", output, sizeof output);
    int count = 0;
    for (char *line = output; *line != '\0';) {
        char *end = strchr(line, '\n');
        if (end == NULL) {
            break;
        }
        *end = '\0';
        if (last != NULL) {
            snprintf(last, 2048, "%.2047s", line);
        }
        count++;
        line = end + 1;
    }
    return count;
}

/* Presses C and waits for what it prints; again every few seconds, since a world that is being
 * loaded loses keys. */
static void ask_camera(char out[2048]) {
    const int before = cameras(NULL);
    const double start = now();
    double press = start;
    while (cameras(out) == before) {
        if (now() > start + 60.0) {
            read_back("view-err.txt", output, sizeof output);
            fail_msg("C printed nothing: %.300s", output);
        }
        if (now() >= press) {
            key("c");
            press = now() + 5.0;
        }
        rest(0.02);
    }
}

/* Waits until the camera rests. */
static void camera_at_rest(char out[2048]) {
    char again[2048];
    ask_camera(out);
    for (int i = 0; i < 100; i++) {
        rest(0.1);
        ask_camera(again);
        if (strcmp(out, again) == 0) {
            return;
        }
        snprintf(out, 2048, "%s", again);
    }
    fail_msg("the camera does not come to rest: %s", out);
}

static void open_viewer(const char *const *arguments) {
    viewer = spawn(arguments, "view.txt", "view-err.txt", -1);
    assert_true(viewer > 0);
    for (const double end = now() + 20.0; RUN(10, "xdotool", "search", "--name", "veduta") != 0;) {
        if (now() > end || kill(viewer, 0) != 0) {
            fail_msg("no window came");
        }
        rest(0.05);
    }
    /* Without a window manager keys go where the mouse is. */
    assert_int_equal(RUN(10, "xdotool", "mousemove", "640", "450"), 0);
}

#define VIEW(...)                                                                                  \
    open_viewer((const char *const[]){program, "view", "--size", "640x360", __VA_ARGS__, NULL})

static void wait_until_ready(void) {
    for (const double end = now() + 60.0; cameras(NULL) == 0; rest(0.1)) {
        key("c");
        if (now() > end) {
            fail_msg("the world did not load");
        }
    }
    rest(0.1);
}

static void close_viewer(void) {
    key("Escape");
    const int status = finish(viewer, 20);
    if (status != 0) {
        read_back("view-err.txt", output, sizeof output);
        fail_msg("the window ended with %d: %.1000s", status, output);
    }
    viewer = -1;
}

static int no_viewer(void **unused) {
    (void)unused;
    if (viewer > 0) {
        kill(viewer, SIGKILL);
        (void)finish(viewer, 10);
        viewer = -1;
    }
    return 0;
}

/* Reads value `index` behind a flag; NaN when the flag is not there. */
static double value_of(const char *camera, const char *flag, int index) {
    char wanted[64];
    snprintf(wanted, sizeof wanted, "--%s ", flag);
    const char *at = strstr(camera, wanted);
    double value = (double)NAN;
    if (at != NULL) {
        at += strlen(wanted);
        for (int i = 0; i <= index; i++) {
            char *end;
            value = strtod(at, &end);
            at = end + (*end == ',');
        }
    }
    return value;
}

/* ---- the tests ---------------------------------------------------------------------------------
 */

static void every_key_does_something(void **unused) {
    (void)unused;
    NEEDS_DISPLAY();
    static const struct {
        const char *key, *flag;
        int index;
        double direction;
    } cases[] = {
        {"w", "eye", 1, 1},      {"s", "eye", 1, -1},        {"Up", "eye", 1, 1},
        {"Down", "eye", 1, -1},  {"r", "eye", 2, 1},         {"f", "eye", 2, -1},
        {"e", "pitch", 0, 1},    {"q", "pitch", 0, -1},      {"u", "fov", 0, 1},
        {"j", "fov", 0, -1},     {"i", "exaggerate", 0, 1},  {"k", "exaggerate", 0, -1},
        {"o", "haze", 0, 1},     {"l", "haze", 0, -1},       {"d", "heading", 0, 1},
        {"a", "heading", 0, -1}, {"Right", "heading", 0, 1}, {"Left", "heading", 0, -1},
    };
    char before[2048], after[2048];
    VIEW("--eye", "300,-400,6000", "--heading", "20", "--pitch", "-30", "--exaggerate", "1", world);
    wait_until_ready();
    camera_at_rest(before);
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        key(cases[i].key);
        camera_at_rest(after);
        const double moved = value_of(after, cases[i].flag, cases[i].index) -
                             value_of(before, cases[i].flag, cases[i].index);
        if (!(moved * cases[i].direction > 0.0)) {
            fail_msg("%s: --%s moved by %g:\n%s\n%s", cases[i].key, cases[i].flag, moved, before,
                     after);
        }
        snprintf(before, sizeof before, "%s", after);
    }
    key("m");
    ask_camera(after);
    assert_non_null(strstr(after, "--method raycast"));
    key("m");
    ask_camera(after);
    assert_non_null(strstr(after, "--method march"));
    key("t");
    rest(0.5);
    key("t");
    camera_at_rest(after);
    assert_true(value_of(after, "sun", 0) > 45.0 && value_of(after, "sun", 0) < 315.0);
    /* Keys that change nothing in the camera. */
    static const char *const others[] = {"h",           "F1",           "p",   "p", "Tab",
                                         "bracketleft", "bracketright", "Tab", "h", "h"};
    for (size_t i = 0; i < sizeof others / sizeof others[0]; i++) {
        key(others[i]);
    }
    camera_at_rest(before);
    assert_string_equal(before, after);
    close_viewer();
}

static vd_picture *load(vd_context *context, const char *path) {
    vd_picture *picture = NULL;
    assert_ok(vd_picture_load(context, path, &picture));
    return picture;
}

/* Waits for a file, which is renamed into place when it is whole. */
static void wait_for_file(const char *path) {
    for (const double end = now() + 20.0; access(path, R_OK) != 0; rest(0.02)) {
        if (now() > end) {
            fail_msg("%s was not written", path);
        }
    }
}

/* Pixels of two pictures that differ by more than a threshold of 255. */
static uint64_t differing(const char *one, const char *other, double threshold) {
    vd_context *context = test_context(1, VD_ISA_AUTO);
    vd_picture *a = load(context, one), *b = load(context, other);
    vd_comparison difference;
    assert_ok(vd_picture_compare(a, b, threshold, &difference, NULL));
    vd_picture_destroy(&a);
    vd_picture_destroy(&b);
    vd_context_destroy(&context);
    return difference.differing_pixels;
}

/* Renders with the flags that C printed, to render.png. */
static void render_camera(const char *input, const char *camera) {
    const char *arguments[80] = {program, "render", input, "-q", "-o", "render.png"};
    int count = 6;
    char flags[2048];
    snprintf(flags, sizeof flags, "%s", camera);
    for (char *at = strtok(flags, " "); at != NULL; at = strtok(NULL, " ")) {
        arguments[count++] = at;
    }
    assert_int_equal(finish(spawn(arguments, "run.txt", "run-err.txt", -1), 60), 0);
}

/* Renders likewise and compares with a screenshot. */
static void compare_with_render(const char *input, const char *camera, const char *shot) {
    render_camera(input, camera);
    const uint64_t pixels = differing(shot, "render.png", 0.0);
    if (pixels != 0) {
        fail_msg("%llu pixels of %s differ from render %s", (unsigned long long)pixels, shot,
                 camera);
    }
}

static void screenshots_are_what_render_draws(void **unused) {
    (void)unused;
    NEEDS_DISPLAY();
    char camera[2048];
    remove("veduta-view-0001.png");
    remove("veduta-view-0002.png");
    remove("veduta-view-0003.png");
    VIEW(world);
    wait_until_ready();
    key("p"); /* overlays are not in it */
    key("h");
    key("F12");
    wait_for_file("veduta-view-0001.png");
    ask_camera(camera);
    compare_with_render(world, camera, "veduta-view-0001.png");

    /* Sun, heights, haze, place and view changed, and a slider and a word of the panel. */
    key("h");
    key("i");
    key("w");
    key("d");
    key("u");
    key("l");
    assert_int_equal(RUN(10, "xdotool", "mousemove", "440", "341", "click", "1"), 0);
    camera_at_rest(camera);
    key("F12");
    wait_for_file("veduta-view-0002.png");
    compare_with_render(world, camera, "veduta-view-0002.png");

    /* In the middle of a movement: what is written is one picture of the way, and whole. */
    assert_int_equal(RUN(10, "xdotool", "keydown", "s"), 0);
    rest(0.2);
    key("F12");
    wait_for_file("veduta-view-0003.png");
    assert_int_equal(RUN(10, "xdotool", "keyup", "s"), 0);
    close_viewer();
    assert_int_equal(RUN(10, program, "info", "veduta-view-0003.png"), 0);
    char text[4096];
    read_back("run.txt", text, sizeof text);
    assert_non_null(strstr(text, "veduta:command veduta render"));
    assert_non_null(strstr(text, "veduta:camera"));
}

/* A world with all kinds of things, by impostors on the way; at rest it is what render draws. */
static void worlds_are_shown_by_impostors(void **unused) {
    (void)unused;
    NEEDS_DISPLAY();
    static const char *const village = VEDUTA_SOURCE_DIR "/example/worlds/village.json";
    char camera[2048];
    remove("veduta-view-0001.png");
    VIEW(village, "--impostors", "--tolerance", "0.7");
    wait_until_ready();
    assert_int_equal(RUN(10, "xdotool", "keydown", "w"), 0);
    rest(0.5);
    assert_int_equal(RUN(10, "xdotool", "keydown", "a"), 0);
    rest(0.5);
    assert_int_equal(RUN(10, "xdotool", "keyup", "w", "keyup", "a"), 0);
    key("i"); /* a world of other heights is made anew */
    assert_int_equal(RUN(10, "xdotool", "keydown", "s"), 0);
    rest(0.3);
    assert_int_equal(RUN(10, "xdotool", "keyup", "s"), 0);
    camera_at_rest(camera);
    key("F12");
    wait_for_file("veduta-view-0001.png");
    compare_with_render(village, camera, "veduta-view-0001.png");
    close_viewer();
}

/* Processor time of a process, seconds. */
static double processor_seconds(pid_t process) {
    char path[64], text[1024];
    snprintf(path, sizeof path, "/proc/%ld/schedstat", (long)process);
    double sum = 0.0;
    snprintf(path, sizeof path, "/proc/%ld/stat", (long)process);
    read_back(path, text, sizeof text);
    const char *at = strrchr(text, ')');
    unsigned long user = 0, kernel = 0;
    assert_non_null(at);
    assert_int_equal(
        sscanf(at + 1, " %*c %*d %*d %*d %*d %*d %*u %*u %*u %*u %*u %lu %lu", &user, &kernel), 2);
    sum = (double)(user + kernel) / (double)sysconf(_SC_CLK_TCK);
    return sum;
}

/* Fails when the window goes on working although nothing happens: it may take its time to finish,
 * but must then have `seconds` of rest. */
static void expect_rest(double seconds) {
    double spent = 1.0;
    for (const double end = now() + 60.0; spent > 0.02;) {
        if (now() > end) {
            fail_msg("%.0f ms of processor time in %g s of rest", 1e3 * spent, seconds);
        }
        const double before = processor_seconds(viewer);
        rest(seconds);
        spent = processor_seconds(viewer) - before;
    }
}

/* V lays over impostors what they are, X keeps them while the camera moves. */
static void impostors_are_looked_at(void **unused) {
    (void)unused;
    NEEDS_DISPLAY();
    static const char *const village = VEDUTA_SOURCE_DIR "/example/worlds/village.json";
    static const char *const overlays[] = {"bounds", "age", "error"};
    const uint64_t all = 640 * 360;
    char camera[2048], again[2048], name[32];
    for (int i = 1; i <= 6; i++) {
        snprintf(name, sizeof name, "veduta-view-%04d.png", i);
        remove(name);
    }
    VIEW(village, "--impostors", "--budget", "2ms");
    wait_until_ready();
    key("Tab"); /* with what impostors do */
    camera_at_rest(camera);
    assert_null(strstr(camera, "--impostors"));
    for (int i = 0; i < 3; i++) {
        key("v");
        ask_camera(again);
        snprintf(name, sizeof name, "--impostors --show %s ", overlays[i]);
        assert_non_null(strstr(again, name));
        expect_rest(0.5);
        key("F12");
        snprintf(name, sizeof name, "veduta-view-%04d.png", i + 1);
        wait_for_file(name);
        if (i == 0) { /* what was made on the way is right to the tolerance */
            render_camera(village, again);
            assert_true(differing(name, "render.png", 60.0) < all / 20);
        }
        render_camera(village, camera);
        assert_true(differing(name, "render.png", 8.0) > all / 4);
    }
    expect_rest(1.0);
    key("v");
    ask_camera(again);
    assert_string_equal(again, camera);
    key("x");
    assert_int_equal(RUN(10, "xdotool", "keydown", "d"), 0);
    do { /* slowly where frames are slow */
        ask_camera(camera);
    } while (value_of(camera, "heading", 0) < value_of(again, "heading", 0) + 30.0);
    assert_int_equal(RUN(10, "xdotool", "keyup", "d"), 0);
    camera_at_rest(camera);
    key("F12");
    wait_for_file("veduta-view-0004.png");
    render_camera(village, camera);
    assert_true(differing("veduta-view-0004.png", "render.png", 8.0) > all / 20);
    expect_rest(1.0);
    key("x");
    ask_camera(again);
    key("F12");
    wait_for_file("veduta-view-0005.png");
    compare_with_render(village, camera, "veduta-view-0005.png");
    expect_rest(1.0);
    close_viewer();
    /* Without them there is nothing to be seen of them. */
    VIEW(world);
    wait_until_ready();
    key("v");
    key("x");
    key("F12");
    wait_for_file("veduta-view-0006.png");
    ask_camera(camera);
    compare_with_render(world, camera, "veduta-view-0006.png");
    close_viewer();
}

/* ---- what is on the screen ----------------------------------------------------------------------
 */

/* Loads functions of Xlib, which the window brings. */
static void load_xlib(const char *const *names, int count, void **out) {
    void *library = dlopen("libX11.so.6", RTLD_NOW);
    assert_non_null(library);
    for (int i = 0; i < count; i++) {
        out[i] = dlsym(library, names[i]);
        assert_non_null(out[i]);
    }
}

/* The pixels of a rectangle of the screen, 0x??RRGGBB. */
static void read_screen(int x, int y, int width, int height, unsigned long *out) {
    static const char *const names[6] = {"XOpenDisplay", "XDefaultRootWindow", "XGetImage",
                                         "XGetPixel",    "XDestroyImage",      "XCloseDisplay"};
    void *found[6];
    load_xlib(names, 6, found);
    void *(*open_display)(const char *);
    unsigned long (*root_window)(void *);
    void *(*get_image)(void *, unsigned long, int, int, unsigned, unsigned, unsigned long, int);
    unsigned long (*get_pixel)(void *, int, int);
    int (*destroy_image)(void *);
    int (*close_display)(void *);
    memcpy(&open_display, &found[0], sizeof(void *));
    memcpy(&root_window, &found[1], sizeof(void *));
    memcpy(&get_image, &found[2], sizeof(void *));
    memcpy(&get_pixel, &found[3], sizeof(void *));
    memcpy(&destroy_image, &found[4], sizeof(void *));
    memcpy(&close_display, &found[5], sizeof(void *));
    void *connection = open_display(NULL);
    assert_non_null(connection);
    void *image = get_image(connection, root_window(connection), x, y, (unsigned)width,
                            (unsigned)height, ~0ul, 2); /* ZPixmap */
    assert_non_null(image);
    for (int i = 0; i < width * height; i++) {
        out[i] = get_pixel(image, i % width, i / width);
    }
    destroy_image(image);
    close_display(connection);
}

/* How many pixels say in orange that something failed: the last line of the card beside the
 * window's upper right corner, which is at (960, 270). `print` receives a hash of them. */
static int failure_pixels(uint64_t *print) {
    enum { WIDE = 256, HIGH = 14 };
    static unsigned long pixels[WIDE * HIGH];
    int orange = 0;
    read_screen(960 - 16 - 276, 270 + 16 + 254, WIDE, HIGH, pixels);
    *print = 1469598103934665603u;
    for (int i = 0; i < WIDE * HIGH; i++) {
        const int red = (int)(pixels[i] >> 16 & 255u), blue = (int)(pixels[i] & 255u);
        const bool is = red > 150 && blue < red - 60;
        orange += is;
        *print = (*print ^ (is ? (uint64_t)i + 1 : 0)) * 1099511628211u;
    }
    return orange;
}

/* Bytes of the bricks are changed, as a failing disk would; head and directory stay. */
static void damage_bricks(const char *path) {
    FILE *file = fopen(path, "r+b");
    uint8_t head[64];
    assert_non_null(file);
    assert_int_equal(fread(head, 1, sizeof head, file), sizeof head);
    uint64_t directory = 0;
    for (int i = 7; i >= 0; i--) {
        directory = directory << 8 | head[56 + i];
    }
    assert_true(directory > 4096);
    for (long at = (long)directory / 4; at < (long)directory / 4 * 3; at += 64) {
        assert_int_equal(fseek(file, at, SEEK_SET), 0);
        assert_int_not_equal(fputc(0x5A, file), EOF);
    }
    assert_int_equal(fclose(file), 0);
}

static void turn_a_little(const char *name) {
    assert_int_equal(RUN(10, "xdotool", "keydown", name), 0);
    rest(0.2);
    assert_int_equal(RUN(10, "xdotool", "keyup", name), 0);
    rest(0.3);
}

/* Of particles some of which are damaged the others are shown, and how often drawing has failed is
 * said beside the frame times; it is tried again, less and less often. */
static void what_fails_is_said(void **unused) {
    (void)unused;
    NEEDS_DISPLAY();
    static const char *const cloud = "cloud.json";
    FILE *file = fopen(cloud, "wb");
    assert_non_null(file);
    assert_true(fprintf(file,
                        "{\"veduta_world\": 1, \"objects\": [{\"mesh\": "
                        "\"%s/example/worlds/house.obj\", \"position\": [0, 0]}], "
                        "\"particles\": [{\"file\": \"cloud.vdp\", \"most_particles\": 2000}]}\n",
                        VEDUTA_SOURCE_DIR) > 0);
    assert_int_equal(fclose(file), 0);
    assert_int_equal(RUN(60, program, "generate", "particles", "-n", "200000", "--center", "0,0,30",
                         "--size", "200", "-o", "cloud.vdp"),
                     0);
    for (int damaged = 0; damaged < 2; damaged++) {
        uint64_t print = 0, again = 0;
        if (damaged == 1) {
            damage_bricks("cloud.vdp");
            assert_int_equal(RUN(60, program, "render", cloud, "-q", "-o", "render.png"), 1);
        }
        VIEW("--eye", "0,-400,60", "--heading", "0", "--pitch", "0", "--impostors", cloud);
        wait_until_ready();
        key("Tab");
        key("v"); /* at rest, too, it is the impostors that are shown */
        const double end = now() + 40.0;
        int orange = 0;
        for (int i = 0; damaged == 1 ? orange == 0 && now() < end : i < 6; i++) {
            turn_a_little(i % 2 == 0 ? "a" : "d");
            orange = failure_pixels(&print);
            assert_true(damaged == 1 || orange == 0);
        }
        if (damaged == 1) {
            assert_true(orange > 20);
            do { /* tried again */
                turn_a_little("a");
                turn_a_little("d");
                assert_true(failure_pixels(&again) > 20);
            } while (again == print && now() < end);
            assert_true(again != print);
        }
        key("F12"); /* all else is shown */
        wait_for_file("veduta-view-0001.png");
        remove("veduta-view-0001.png");
        close_viewer();
    }
}

static void the_mouse_turns_and_sets(void **unused) {
    (void)unused;
    NEEDS_DISPLAY();
    char before[2048], after[2048];
    VIEW(world);
    wait_until_ready();
    camera_at_rest(before);
    assert_int_equal(RUN(10, "xdotool", "mousemove", "640", "450", "mousedown", "1", "mousemove",
                         "600", "470", "mousemove", "560", "480", "mouseup", "1"),
                     0);
    camera_at_rest(after);
    const double turned = value_of(after, "heading", 0) - value_of(before, "heading", 0);
    assert_true(turned > 1.0);
    assert_true(value_of(after, "pitch", 0) > value_of(before, "pitch", 0) + 0.5);
    /* The wheel changes how far a key goes. */
    char third[2048], fourth[2048];
    key("r");
    camera_at_rest(third);
    for (int i = 0; i < 5; i++) {
        assert_int_equal(RUN(10, "xdotool", "click", "4"), 0);
    }
    key("r");
    camera_at_rest(fourth);
    assert_true(value_of(fourth, "eye", 2) - value_of(third, "eye", 2) >
                1.5 * (value_of(third, "eye", 2) - value_of(after, "eye", 2)));
    /* Every row of the panel by a click in its middle: the window's corner is at (320, 270). */
    key("p");
    rest(0.2);
    int changed = 0;
    for (int y = 300; y < 620; y += 24) {
        char place[16];
        snprintf(place, sizeof place, "%d", y + 12);
        ask_camera(before);
        assert_int_equal(RUN(10, "xdotool", "mousemove", "560", place, "click", "1"), 0);
        rest(0.05);
        ask_camera(after);
        changed += strcmp(before, after) != 0;
    }
    assert_in_range(changed, 10, 14);
    close_viewer();
}

static void worlds_are_switched(void **unused) {
    (void)unused;
    NEEDS_DISPLAY();
    char first[2048], second[2048], again[2048];
    remove("veduta-view-0001.png");
    VIEW(world, other_world);
    wait_until_ready();
    camera_at_rest(first);
    key("2");
    rest(0.3);
    for (const double end = now() + 20.0; now() < end; rest(0.1)) {
        ask_camera(second);
        if (strcmp(first, second) != 0) {
            break;
        }
    }
    camera_at_rest(second);
    assert_string_not_equal(first, second);
    key("F12");
    wait_for_file("veduta-view-0001.png");
    compare_with_render(other_world, second, "veduta-view-0001.png");
    key("1");
    camera_at_rest(again);
    assert_string_equal(first, again);
    key("7"); /* there is none, which is said and nothing else */
    camera_at_rest(again);
    assert_string_equal(first, again);
    close_viewer();
}

static void the_window_is_resized(void **unused) {
    (void)unused;
    NEEDS_DISPLAY();
    char camera[2048];
    remove("veduta-view-0001.png");
    VIEW(world);
    wait_until_ready();
    assert_int_equal(RUN(10, "xdotool", "search", "--name", "veduta", "windowsize", "801", "417"),
                     0);
    for (const double end = now() + 10.0; now() < end; rest(0.1)) {
        ask_camera(camera);
        if (strstr(camera, "--size 801x417") != NULL) {
            break;
        }
    }
    assert_non_null(strstr(camera, "--size 801x417"));
    camera_at_rest(camera);
    key("F12");
    wait_for_file("veduta-view-0001.png");
    compare_with_render(world, camera, "veduta-view-0001.png");
    key("F11");
    rest(0.3);
    camera_at_rest(camera);
    assert_non_null(strstr(camera, "--size 1280x900"));
    key("F11");
    rest(0.3);
    camera_at_rest(camera);
    assert_non_null(strstr(camera, "--size 801x417"));
    close_viewer();
}

/* Reads a recording's times, and how far the eye went from each to the next. Returns how many. */
static int read_keyframes(const char *path, double times[], double steps[], int most) {
    static char text[1 << 18];
    double before[3] = {0, 0, 0};
    int count = 0;
    read_back(path, text, sizeof text);
    assert_non_null(strstr(text, "\"veduta_path\": 1"));
    for (const char *at = text; (at = strstr(at, "\"time\": ")) != NULL && count < most; count++) {
        double eye[3];
        assert_int_equal(sscanf(at, "\"time\": %lf, \"eye\": [%lf, %lf, %lf]", &times[count],
                                &eye[0], &eye[1], &eye[2]),
                         4);
        double square = 0.0;
        for (int i = 0; i < 3; i++) {
            square += (eye[i] - before[i]) * (eye[i] - before[i]);
            before[i] = eye[i];
        }
        steps[count] = count > 0 ? sqrt(square) : 0.0;
        at += 8;
    }
    return count;
}

/* Every frame is a keyframe, with its time; what `fly` and `evaluate` make of them ends with the
 * picture that the window ended with. */
static void paths_are_recorded(void **unused) {
    (void)unused;
    NEEDS_DISPLAY();
    enum { MOST = 1000 };
    static double times[MOST], steps[MOST];
    remove("veduta-path-0001.json");
    remove("veduta-view-0001.png");
    VIEW(world);
    wait_until_ready();
    key("F9");
    rest(0.5);
    assert_int_equal(RUN(10, "xdotool", "keydown", "w"), 0);
    rest(0.6);
    assert_int_equal(RUN(10, "xdotool", "keydown", "a"), 0);
    rest(0.7);
    assert_int_equal(RUN(10, "xdotool", "keyup", "w", "keyup", "a"), 0);
    rest(1.0);
    key("F12");
    wait_for_file("veduta-view-0001.png");
    key("F9");
    wait_for_file("veduta-path-0001.json");
    close_viewer();
    const int count = read_keyframes("veduta-path-0001.json", times, steps, MOST);
    assert_in_range(count, 12, MOST - 1);
    int moving = 0, slow = 0;
    for (int i = 1; i < count; i++) {
        assert_true(times[i] > times[i - 1]);
        moving += steps[i] > 0.0;
        slow += steps[i] > 0.0 && times[i] - times[i - 1] > 0.05;
    }
    /* A picture of the display's rate for every 17 ms, where nobody else uses the processor. */
    assert_true(moving >= 10 && 2 * slow < moving);
    assert_true(steps[1] == 0.0 && steps[count - 1] == 0.0); /* rests at both ends take no frames */
    assert_true(times[1] - times[0] > 0.1 && times[count - 1] - times[count - 2] > 0.1);
    assert_int_equal(RUN(60, program, "fly", world, "veduta-path-0001.json", "--dry-run"), 0);
    assert_int_equal(RUN(60, program, "evaluate", world, "veduta-path-0001.json", "--virtual", "-s",
                         "64x36", "--seconds", "0.3", "--only", "impostors"),
                     0);
    char text[1024], frames[32];
    assert_int_equal(RUN(200, program, "fly", world, "veduta-path-0001.json", "-q", "-s", "640x360",
                         "--fps", "2", "-o", "flown-{}.png"),
                     0);
    snprintf(frames, sizeof frames, "flown-%d.png", (int)floor(2.0 * times[count - 1] + 0.5) - 1);
    read_back("run.txt", text, sizeof text);
    if (access(frames, R_OK) != 0) {
        fail_msg("%s is not there: %s", frames, text);
    }
    assert_int_equal(differing(frames, "veduta-view-0001.png", 1.0), 0);
}

static void it_rests_when_nothing_happens(void **unused) {
    (void)unused;
    NEEDS_DISPLAY();
    VIEW(world);
    wait_until_ready();
    rest(6.0); /* the note about C goes after four seconds */
    expect_rest(test_is_reduced() ? 2.0 : 5.0);
    close_viewer();
}

static void a_failing_world_is_no_end(void **unused) {
    (void)unused;
    NEEDS_DISPLAY();
    FILE *file = fopen("broken.png", "wb");
    assert_non_null(file);
    fputs("\x89PNG\r\n\x1a\n and then nothing", file);
    fclose(file);
    VIEW("broken.png", world);
    for (const double end = now() + 20.0; now() < end; rest(0.05)) {
        read_back("view-err.txt", output, sizeof output);
        if (output[0] != '\0') {
            break;
        }
    }
    assert_non_null(strstr(output, "broken.png"));
    key("c"); /* there is no camera, and nothing happens */
    key("F12");
    key("w");
    key("p");
    key("2");
    wait_until_ready();
    close_viewer();
}

static void what_cannot_be_shown_is_refused(void **unused) {
    (void)unused;
    static const struct {
        const char *argument, *value, *part;
        int status;
    } cases[] = {
        {"no-such-file.tif", NULL, "no-such-file.tif: No such file", 1},
        {"model.obj", NULL, "model.obj is a model", 1},
        {"--depth", "d.exr", "--depth does not apply to a window", 2},
        {"--classic", "x=1", "--classic does not apply", 2},
        {"--framez", "1", "did you mean", 2},
        {"--frames", "-1", "--frames", 2},
        {"--connect", "http://127.0.0.1:1/", "--connect shows the world of a server", 2},
        {"--memory", "8M", "add --connect", 2},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        const bool alone = cases[i].value == NULL;
        const int status = alone
                               ? RUN(10, program, "view", cases[i].argument)
                               : RUN(10, program, "view", world, cases[i].argument, cases[i].value);
        char text[1024];
        read_back("run-err.txt", text, sizeof text);
        if (status != cases[i].status || strstr(text, cases[i].part) == NULL) {
            fail_msg("%s: %d, %s", cases[i].argument, status, text);
        }
        assert_ptr_equal(strchr(text, '\n'), text + strlen(text) - 1); /* one sentence */
    }
    assert_int_equal(RUN(10, program, "view", "--help"), 0);
}

/* Returns what it says where DISPLAY is `name`; null: not set. */
static int view_on(const char *name, char text[1024]) {
    const char *kept = getenv("DISPLAY");
    char copy[32] = "";
    snprintf(copy, sizeof copy, "%s", kept != NULL ? kept : "");
    unsetenv("DISPLAY");
    if (name != NULL) {
        setenv("DISPLAY", name, 1);
    }
    const int status = RUN(10, program, "view", world);
    unsetenv("DISPLAY");
    if (copy[0] != '\0') {
        setenv("DISPLAY", copy, 1);
    }
    read_back("run-err.txt", text, 1024);
    return status;
}

static void without_a_display_it_says_so(void **unused) {
    (void)unused;
    char text[1024];
    assert_int_equal(view_on(NULL, text), 1);
    assert_int_equal(strncmp(text, "veduta: ", 8), 0);
    assert_non_null(strstr(text, "veduta render"));
    assert_ptr_equal(strchr(text, '\n'), text + strlen(text) - 1);
    if (missing == NULL) {
        assert_int_equal(view_on(":9999", text), 1);
        assert_int_equal(strncmp(text, "veduta: cannot open a window", 28), 0);
        assert_ptr_equal(strchr(text, '\n'), text + strlen(text) - 1);
    }
}

/* Asks the window to close as a window manager does. */
static void delete_window(void) {
    RUN(10, "xdotool", "search", "--name", "veduta");
    char text[64];
    read_back("run.txt", text, sizeof text);
    const unsigned long window = strtoul(text, NULL, 10);
    void *addresses[5];
    static const char *const names[5] = {"XOpenDisplay", "XInternAtom", "XSendEvent", "XSync",
                                         "XCloseDisplay"};
    load_xlib(names, 5, addresses);
    void *(*open_display)(const char *);
    unsigned long (*intern_atom)(void *, const char *, int);
    int (*send_event)(void *, unsigned long, int, long, void *);
    int (*sync)(void *, int);
    int (*close_display)(void *);
    memcpy(&open_display, &addresses[0], sizeof(void *));
    memcpy(&intern_atom, &addresses[1], sizeof(void *));
    memcpy(&send_event, &addresses[2], sizeof(void *));
    memcpy(&sync, &addresses[3], sizeof(void *));
    memcpy(&close_display, &addresses[4], sizeof(void *));
    void *connection = open_display(NULL);
    assert_non_null(connection);
    union {
        struct { /* XClientMessageEvent */
            int type;
            unsigned long serial;
            int sent;
            void *connection;
            unsigned long window, message;
            int format;
            long data[5];
        } message;
        long room[24];
    } event;
    memset(&event, 0, sizeof event);
    event.message.type = 33; /* ClientMessage */
    event.message.window = window;
    event.message.message = intern_atom(connection, "WM_PROTOCOLS", 0);
    event.message.format = 32;
    event.message.data[0] = (long)intern_atom(connection, "WM_DELETE_WINDOW", 0);
    assert_int_not_equal(send_event(connection, window, 0, 0, &event), 0);
    sync(connection, 0);
    close_display(connection);
}

/* Where nothing can be served a server says so. */
static pid_t serve(char url[400]) {
    const pid_t child =
        spawn((const char *const[]){program, "serve", "-q", "--port", "0", "--cell-size", "75",
                                    "--size", "640x360", "--haze", "off", world, NULL},
              "url.txt", "serve-err.txt", -1);
    url[0] = '\0';
    for (const double until = now() + 30.0; strchr(url, '\n') == NULL && now() < until;) {
        rest(0.05);
        read_back("url.txt", url, 400);
        read_back("serve-err.txt", output, sizeof output);
        if (output[0] != '\0') {
            break;
        }
    }
    url[strcspn(url, "\n")] = '\0';
    return child;
}

static void a_servers_world_is_shown(void **unused) {
    (void)unused;
    NEEDS_DISPLAY()
    char url[400], wrong[420], text[1000];
    const pid_t server = serve(url);
    if (url[0] == '\0') {
        (void)finish(server, 10);
        skip();
        return;
    }
    snprintf(wrong, sizeof wrong, "%sx", url);
    assert_int_equal(RUN(30, program, "view", "--frames", "2", "--connect", wrong), 1);
    read_back("run-err.txt", text, sizeof text);
    assert_non_null(strstr(text, "refused: the token"));
    assert_int_equal(RUN(30, program, "view", "--frames", "2", "--connect", "no address"), 1);
    read_back("run-err.txt", text, sizeof text);
    assert_non_null(strstr(text, "veduta serve"));
    VIEW("--connect", url);
    wait_until_ready();
    key("Tab");
    assert_int_equal(RUN(60, program, "render", world, "--cell-size", "75", "--size", "640x360",
                         "--haze", "off", "-q", "-o", "direct.png"),
                     0);
    uint64_t pixels = 1;
    for (const double end = now() + 60.0; pixels != 0; rest(0.5)) { /* the exact picture comes */
        if (now() > end) {
            fail_msg("%llu pixels of the server's picture differ", (unsigned long long)pixels);
        }
        unlink("veduta-view-0001.png");
        key("F12");
        wait_for_file("veduta-view-0001.png");
        pixels = differing("direct.png", "veduta-view-0001.png", 0.0);
    }
    /* The token is in no file. */
    assert_int_equal(RUN(60, program, "info", "veduta-view-0001.png"), 0);
    read_back("run.txt", text, sizeof text);
    assert_non_null(strstr(text, "view --connect URL"));
    key("w");
    kill(server, SIGTERM);
    assert_int_equal(finish(server, 20), 0);
    key("s"); /* it goes on with what it has */
    rest(0.3);
    close_viewer();
    unlink("veduta-view-0001.png");
}

static void it_ends_cleanly(void **unused) {
    (void)unused;
    NEEDS_DISPLAY();
    static const int signals[] = {SIGTERM, SIGINT};
    for (size_t i = 0; i < 2; i++) {
        VIEW(world);
        wait_until_ready();
        kill(viewer, signals[i]);
        assert_int_equal(finish(viewer, 10), 0);
    }
    VIEW(world);
    kill(viewer, SIGTERM); /* while it loads */
    assert_int_equal(finish(viewer, 10), 0);
    VIEW(world);
    wait_until_ready();
    assert_int_equal(RUN(10, "xdotool", "keydown", "w"), 0);
    rest(0.2);
    kill(viewer, SIGTERM); /* while it moves */
    assert_int_equal(finish(viewer, 10), 0);
    assert_int_equal(RUN(10, "xdotool", "keyup", "w"), 0);
    VIEW(world);
    wait_until_ready();
    delete_window();
    assert_int_equal(finish(viewer, 10), 0);
    viewer = -1;
    assert_int_equal(RUN(60, program, "view", "-q", "--frames", "5", world), 0);
    char text[400];
    read_back("run-err.txt", text, sizeof text);
    assert_non_null(strstr(text, "5 pictures"));
}

int main(void) {
    unsetenv("DISPLAY");
    unsetenv("WAYLAND_DISPLAY");
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_cannot_be_shown_is_refused),
        cmocka_unit_test(without_a_display_it_says_so),
        cmocka_unit_test_teardown(every_key_does_something, no_viewer),
        cmocka_unit_test_teardown(screenshots_are_what_render_draws, no_viewer),
        cmocka_unit_test_teardown(worlds_are_shown_by_impostors, no_viewer),
        cmocka_unit_test_teardown(impostors_are_looked_at, no_viewer),
        cmocka_unit_test_teardown(what_fails_is_said, no_viewer),
        cmocka_unit_test_teardown(the_mouse_turns_and_sets, no_viewer),
        cmocka_unit_test_teardown(worlds_are_switched, no_viewer),
        cmocka_unit_test_teardown(the_window_is_resized, no_viewer),
        cmocka_unit_test_teardown(paths_are_recorded, no_viewer),
        cmocka_unit_test_teardown(it_rests_when_nothing_happens, no_viewer),
        cmocka_unit_test_teardown(a_failing_world_is_no_end, no_viewer),
        cmocka_unit_test_teardown(a_servers_world_is_shown, no_viewer),
        cmocka_unit_test_teardown(it_ends_cleanly, no_viewer),
    };
    return cmocka_run_group_tests(tests, start_display, end_display);
}

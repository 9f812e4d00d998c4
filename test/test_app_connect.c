/* test_app_connect.c: the native client against a real `veduta serve`: pictures, TLS, tokens,
 * coming back; and a soak: clients that wander, drop out and come back.
 *
 * VEDUTA_SOAK_SECONDS says how long the soak takes: 60 without it, a few in the reduced suite. */
#include "serve_process.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <signal.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>
#include <veduta/client.h>
#include <veduta/picture.h>

#define WORLD                                                                                      \
    VEDUTA_SOURCE_DIR "/data/mont-blanc.png --cell-size 75 --size 240x136 --haze off "             \
                      "--threads 1 --token secret"

enum { SIDE_X = 240, SIDE_Y = 136, MOST_WANDERERS = 8 };

static vd_context *context;
static serve_process server;

static int setup(void **state) {
    (void)state;
    assert_int_equal(mkdir("test-connect", 0700) == 0 || errno == EEXIST, 1);
    assert_int_equal(chdir("test-connect"), 0);
    const vd_context_def def = {.threads = 1};
    assert_ok(vd_context_create(&def, &context));
    return 0;
}

static int teardown(void **state) {
    (void)state;
    vd_context_destroy(&context);
    return 0;
}

static double clock_s(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static void rest(double seconds) {
    nanosleep(&(struct timespec){(time_t)seconds, (long)(1e9 * fmod(seconds, 1.0))}, NULL);
}

/* ---- server and clients -----------------------------------------------------------------------*/

static vd_client *join(const char *scheme, const char *token, bool insecure) {
    char url[200];
    (void)snprintf(url, sizeof url, "%s://127.0.0.1:%d/#token=%s", scheme, server.port, token);
    vd_client_def def = vd_client_def_default();
    def.url = url;
    def.insecure = insecure;
    def.wants_world = true;
    vd_client *client = NULL;
    assert_ok(vd_client_create(context, &def, &client));
    return client;
}

static vd_client_news news_of(vd_client *client) {
    vd_client_news news;
    vd_client_get_news(client, &news);
    return news;
}

/* Waits for a state and a part of its sentence. */
static void expect(vd_client *client, vd_client_state state, const char *part) {
    vd_client_news news = news_of(client);
    for (const double until_s = clock_s() + 20.0;
         news.state != state || strstr(news.sentence, part) == NULL; news = news_of(client)) {
        if (clock_s() > until_s) {
            fail_msg("%s: %s", vd_client_state_name(news.state), news.sentence);
        }
        rest(0.005);
    }
}

static vd_camera camera_of(double east, double heading) {
    vd_camera camera = {.near_m = 0.1};
    camera.eye = vd_vec3_make(24000.0 + east, -45000.0, 9000.0);
    camera.orientation = vd_orientation_from_angles(heading, -0.3, 0.0);
    camera.lens = vd_lens_from_fov(0.8, SIDE_X, SIDE_Y);
    return camera;
}

/* Looks until the exact picture is shown; its hash. */
static uint64_t settle(vd_client *client, const vd_camera *camera) {
    vd_frame *frame = NULL;
    vd_client_shown shown = {.quads = 0};
    assert_ok(vd_frame_create(context, SIDE_X, SIDE_Y, 0, &frame));
    for (const double until_s = clock_s() + 120.0; !shown.exact;) {
        vd_client_look(client, camera, SIDE_X, SIDE_Y);
        assert_ok(vd_client_draw(client, NULL, camera, frame, &shown));
        if (clock_s() > until_s) {
            const vd_client_news n = news_of(client);
            fail_msg("no exact picture: %s: %s", vd_client_state_name(n.state), n.sentence);
        }
        rest(0.01);
    }
    const uint64_t hash = vd_frame_hash(frame);
    vd_frame_destroy(&frame);
    return hash;
}

/* ---- one client -------------------------------------------------------------------------------*/

static void it_shows_what_render_draws(void **state) {
    (void)state;
    char world[65536];
    serve_start(&server, "--port 0 " WORLD);
    vd_client *client = join("http", "secret", false), *other = join("ws", "secret", false);
    const vd_camera camera = camera_of(0.0, 0.1), there = camera_of(3000.0, 0.4);
    const uint64_t hash = settle(client, &camera);
    assert_true(hash == settle(other, &camera));
    assert_true(settle(client, &there) != hash);
    assert_true(settle(client, &camera) == hash);
    /* At rest clients sleep; this process is two of them. */
    const clock_t before = clock();
    rest(0.5);
    assert_true((double)(clock() - before) / CLOCKS_PER_SEC < 0.1);
    for (int i = 0; i < 400 && !vd_client_get_world(client, world, sizeof world); i++) {
        rest(0.01);
    }
    assert_non_null(strstr(world, "\"camera\""));
    assert_false(vd_client_get_world(client, world, 4));
    /* Cut, it comes back and sends little again; killed, the server is found again. */
    vd_client_cut(client);
    expect(client, VD_CLIENT_LOST, "broke");
    assert_true(news_of(client).retry_s <= 15.0);
    expect(client, VD_CLIENT_SHOWING, "");
    char options[300];
    (void)snprintf(options, sizeof options, "--port %d " WORLD, server.port);
    (void)serve_stop(&server, SIGKILL);
    expect(client, VD_CLIENT_LOST, "");
    serve_start(&server, options);
    expect(client, VD_CLIENT_SHOWING, "");
    assert_true(settle(client, &there) != hash);
    assert_true(settle(client, &camera) == hash);
    assert_true(news_of(client).connections >= 3);
    assert_int_equal(serve_stop(&server, SIGTERM), 0);
    expect(client, VD_CLIENT_LOST, "");
    vd_client_destroy(&client);
    vd_client_destroy(&other);
}

static void refusals_say_why(void **state) {
    (void)state;
    serve_start(&server, "--port 0 --max-clients 1 " WORLD);
    vd_client *client = join("http", "wrong", false);
    expect(client, VD_CLIENT_REFUSED, "token");
    vd_client_destroy(&client);
    client = join("http", "secret", false);
    expect(client, VD_CLIENT_LOADING, "");
    vd_client *second = join("http", "secret", false);
    expect(second, VD_CLIENT_REFUSED, "as many clients");
    vd_client_destroy(&second);
    vd_client_destroy(&client);
    assert_int_equal(serve_stop(&server, SIGTERM), 0);
    client = join("http", "secret", false);
    expect(client, VD_CLIENT_LOST, "is it serving");
    vd_client_destroy(&client);
    vd_client_def def = vd_client_def_default();
    assert_int_equal(vd_client_create(context, &def, &client).code, VD_ERROR_ARGUMENT);
    def.url = "http://127.0.0.1:1/";
    def.memory_bytes = 1;
    assert_int_equal(vd_client_create(context, &def, &client).code, VD_ERROR_ARGUMENT);
}

static void tls_wants_a_certificate_that_is_trusted(void **state) {
    (void)state;
    if (system("openssl req -x509 -newkey ec -pkeyopt ec_paramgen_curve:prime256v1 -nodes "
               "-keyout key.pem -out cert.pem -days 2 -subj /CN=localhost 2>/dev/null") != 0) {
        skip();
    }
    serve_start(&server, "--port 0 --tls cert.pem --tls-key key.pem " WORLD);
    vd_client *client = join("https", "secret", false);
    expect(client, VD_CLIENT_LOST, "cannot reach");
    vd_client_destroy(&client);
    client = join("https", "secret", true);
    const vd_camera camera = camera_of(0.0, 0.1);
    (void)settle(client, &camera);
    vd_client_destroy(&client);
    assert_int_equal(serve_stop(&server, SIGTERM), 0);
}

/* ---- soak -------------------------------------------------------------------------------------*/

static long resident_kib(void) {
    char path[64], line[200];
    long kib = 0;
    (void)snprintf(path, sizeof path, "/proc/%d/status", (int)server.id);
    FILE *file = fopen(path, "r");
    while (file != NULL && fgets(line, sizeof line, file) != NULL) {
        kib = strncmp(line, "VmRSS:", 6) == 0 ? atol(line + 6) : kib;
    }
    if (file != NULL) {
        (void)fclose(file);
    }
    return kib;
}

static int descriptors(pid_t process) {
    char path[64];
    int count = 0;
    (void)snprintf(path, sizeof path, "/proc/%d/fd", (int)process);
    DIR *folder = opendir(path);
    while (folder != NULL && readdir(folder) != NULL) {
        count++;
    }
    if (folder != NULL) {
        (void)closedir(folder);
    }
    return count;
}

static double chance(void) {
    static uint64_t random = 7;
    random = random * 6364136223846793005u + 1442695040888963407u;
    return (double)(random >> 11) * 0x1p-53;
}

typedef struct wanderer {
    vd_client *client;
    double east, heading;
} wanderer;

/* Moves all for so long; now and then one loses its connection, or leaves and another comes. */
static void wander(wanderer *w, int count, double seconds, vd_frame *frame) {
    for (const double until_s = clock_s() + seconds; clock_s() < until_s; rest(1.0 / 30)) {
        for (int i = 0; i < count; i++) {
            w[i].east += 200.0 * (chance() - 0.5);
            w[i].heading += 0.04 * (chance() - 0.5);
            if (chance() < 0.002) {
                w[i].heading = 6.28 * chance(); /* turns around */
            }
            if (chance() < 0.004) {
                vd_client_cut(w[i].client);
            } else if (chance() < 0.002) {
                vd_client_destroy(&w[i].client);
                w[i].client = join("http", "secret", false);
            }
            const vd_camera camera = camera_of(w[i].east, w[i].heading);
            vd_client_look(w[i].client, &camera, SIDE_X, SIDE_Y);
            if (i == 0) {
                assert_ok(vd_client_draw(w[i].client, NULL, &camera, frame, NULL));
            }
            assert_true(news_of(w[i].client).state < VD_CLIENT_REFUSED);
        }
    }
}

static void wanderers_leave_nothing_behind(void **state) {
    (void)state;
    const char *wanted = getenv("VEDUTA_SOAK_SECONDS");
    const double seconds = wanted != NULL ? atof(wanted) : test_is_reduced() ? 4.0 : 60.0;
    serve_start(&server, "--port 0 --memory 8M --max-clients 64 " WORLD);
    rest(0.2);
    const int fds = descriptors(server.id), own = descriptors(getpid());
    const int count = test_is_reduced() ? 4 : MOST_WANDERERS;
    wanderer w[MOST_WANDERERS];
    vd_frame *frame = NULL;
    assert_ok(vd_frame_create(context, SIDE_X, SIDE_Y, 0, &frame));
    for (int i = 0; i < count; i++) {
        w[i] = (wanderer){join("http", "secret", false), 6000.0 * (chance() - 0.5), 0.0};
    }
    wander(w, count, 0.4 * seconds, frame);
    const long warm_kib = resident_kib();
    wander(w, count, 0.6 * seconds, frame);
    const long end_kib = resident_kib();
    print_message("%g s: server %ld KiB, then %ld KiB\n", seconds, warm_kib, end_kib);
    /* Those that just left are kept a while, so it is flat to some of their pictures. */
    assert_true(end_kib < warm_kib + warm_kib / 4 + 48 * 1024);
    for (int i = 0; i < count; i++) {
        const vd_camera camera = camera_of(w[i].east, w[i].heading);
        (void)settle(w[i].client, &camera);
        vd_client_news news = news_of(w[i].client);
        for (const double until_s = clock_s() + 10.0;
             news.last.error_px > 1.01 && clock_s() < until_s; rest(0.02)) {
            news = news_of(w[i].client); /* what is told comes behind the picture */
        }
        assert_true(news.most_held_bytes <= (size_t)64 << 20);
        assert_true(news.last.error_px <= 1.01); /* nothing is older than it may be */
        vd_client_destroy(&w[i].client);
    }
    for (int i = 0; i < 500 && descriptors(server.id) > fds; i++) {
        rest(0.02);
    }
    assert_true(descriptors(server.id) <= fds);
    assert_true(descriptors(getpid()) <= own);
    vd_frame_destroy(&frame);
    assert_int_equal(serve_stop(&server, SIGTERM), 0);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(it_shows_what_render_draws),
        cmocka_unit_test(refusals_say_why),
        cmocka_unit_test(tls_wants_a_certificate_that_is_trusted),
        cmocka_unit_test(wanderers_leave_nothing_behind),
    };
    return cmocka_run_group_tests(tests, setup, teardown);
}

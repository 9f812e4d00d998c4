/* test_app_serve.c: `veduta serve` from outside: a real server, real clients, curl. */
#include "serve_process.h"

#include <arpa/inet.h>
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>
#include "serve_client.h"

#define DATA VEDUTA_SOURCE_DIR "/data"
#define WORLD DATA "/mont-blanc.png --cell-size 75 --size 240x136 --haze off"

enum { SIDE_X = 240, SIDE_Y = 136 };

static vd_context *context;
static serve_process server;

static int setup(void **state) {
    (void)state;
    assert_int_equal(mkdir("test-serve", 0700) == 0 || errno == EEXIST, 1);
    assert_int_equal(chdir("test-serve"), 0);
    const vd_context_def def = {.threads = 1};
    assert_ok(vd_context_create(&def, &context));
    return 0;
}

static int teardown(void **state) {
    (void)state;
    vd_context_destroy(&context);
    return 0;
}

/* ---- the server -------------------------------------------------------------------------------*/

/* What curl says of a path, into got.txt; returns the HTTP status. */
static int get(const char *scheme, const char *path, const char *options) {
    char command[1024], number[16];
    (void)snprintf(command, sizeof command,
                   "curl -sk --max-time 60 -o got.txt -w '%%{http_code}' %s "
                   "'%s://127.0.0.1:%d%s' >code.txt",
                   options, scheme, server.port, path);
    (void)system(command);
    read_back("code.txt", number, sizeof number);
    return atoi(number);
}

static int get_with_token(const char *path) {
    char option[400];
    (void)snprintf(option, sizeof option, "-H 'Authorization: Bearer %s'", server.token);
    return get("http", path, option);
}

static void read_numbers(const char *text, const char *key, double *to, int count) {
    const char *at = strstr(text, key);
    assert_non_null(at);
    at = strchr(at, ':') + 1;
    for (int i = 0; i < count; i++) {
        char *end;
        at += strspn(at, " \n[,");
        to[i] = strtod(at, &end);
        assert_true(end > at);
        at = end;
    }
}

/* The camera that /world.json says. */
static vd_camera first_camera(void) {
    static char text[8192];
    double v[4];
    vd_camera camera = {.projection = VD_PROJECTION_PERSPECTIVE};
    assert_int_equal(get_with_token("/world.json"), 200);
    read_back("got.txt", text, sizeof text);
    read_numbers(text, "\"eye\"", v, 3);
    camera.eye = vd_vec3_make(v[0], v[1], v[2]);
    read_numbers(text, "\"orientation\"", v, 4);
    camera.orientation = (vd_quat){v[0], v[1], v[2], v[3]};
    read_numbers(text, "\"lens\"", v, 4);
    camera.lens = (vd_lens){v[0], v[1], v[2], v[3]};
    read_numbers(text, "\"near\"", v, 1);
    camera.near_m = v[0];
    return camera;
}

/* ---- clients ----------------------------------------------------------------------------------*/

static void greet(connection *c, bool tls) {
    connection_open(c, context, server.port, tls, "/socket", "veduta");
    assert_true(c->open);
    const vd_wire_message m = client_hello(server.token);
    connection_say(c, &m);
}

static void look(connection *c, const vd_camera *camera) {
    const vd_wire_message m = client_camera(&c->client, camera, SIDE_X, SIDE_Y, clock_s());
    connection_say(c, &m);
}

/* Until the exact picture of the newest camera is there. */
static void settle(connection *c) {
    const double until_s = clock_s() + 60.0;
    while (!(c->client.screen_exact && c->client.screen_camera == c->client.sequence)) {
        if (clock_s() > until_s || c->closed) {
            fail_msg("it does not settle: error %d %s", c->client.fault, c->client.sentence);
        }
        connection_poll(c);
    }
}

/* Until an error or the end. */
static void expect_end(connection *c) {
    for (const double until_s = clock_s() + 20.0; !c->closed && clock_s() < until_s;) {
        connection_poll(c);
    }
    assert_true(c->closed);
}

static void expect_fault_at(connection *c, int fault, int line) {
    for (const double until_s = clock_s() + 20.0; !c->closed && clock_s() < until_s;) {
        connection_poll(c);
    }
    if (!c->closed || c->client.fault != fault) {
        fail_msg("line %d: %s, error %d %s, not %d", line, c->closed ? "closed" : "open",
                 c->client.fault, c->client.sentence, fault);
    }
}

#define expect_fault(c, fault) expect_fault_at(c, fault, __LINE__)

static void says_pong(connection *c) {
    const int before = c->client.pongs;
    const vd_wire_message ping = {.kind = VD_WIRE_PING, .as.ping = {7}};
    connection_say(c, &ping);
    for (const double until_s = clock_s() + 10.0; c->client.pongs == before;) {
        assert_true(clock_s() < until_s && !c->closed);
        connection_poll(c);
    }
}

/* ---- HTTP -------------------------------------------------------------------------------------*/

static void test_http(void **state) {
    (void)state;
    static char text[8192];
    serve_start(&server, "--port 0 " WORLD);
    assert_int_equal(strlen(server.token), 32);
    assert_int_equal(get("http", "/health", ""), 200);
    read_back("got.txt", text, sizeof text);
    assert_non_null(strstr(text, "\"status\": \"ok\""));
    assert_int_equal(get("http", "/", ""), 200);
    read_back("got.txt", text, sizeof text);
    assert_non_null(strstr(text, "<!doctype html>"));
    static const char *const wrong[] = {"", "-H 'Authorization: Bearer 0'",
                                        "-H 'Authorization: Basic eDp5'",
                                        "-H 'Authorization: Bearer '"};
    for (int i = 0; i < 4; i++) {
        assert_int_equal(get("http", "/world.json", wrong[i]), 401);
        assert_int_equal(get("http", "/frame.png", wrong[i]), 401);
    }
    static const char *const nowhere[] = {"/nothing",
                                          "/../../../../etc/passwd",
                                          "/..%2f..%2f..%2f..%2fetc/passwd",
                                          "/%2e%2e/%2e%2e/",
                                          "//etc/passwd",
                                          "/index.html/",
                                          "/socket"};
    for (size_t i = 0; i < sizeof nowhere / sizeof nowhere[0]; i++) {
        const int code = get("http", nowhere[i], "--path-as-is");
        read_back("got.txt", text, sizeof text);
        assert_true(code >= 400 || strstr(text, "<!doctype html>") != NULL || code == 0);
        assert_null(strstr(text, "root:"));
    }
    assert_int_equal(get("http", "/health", "-X DELETE"), 405);
    static const char *const bad[] = {
        "/frame.png?size=0x5",   "/frame.png?size=99999x99999",   "/frame.png?size=12",
        "/frame.png?camera=1,2", "/frame.png?camera=nan,1,1,1,1", "/frame.png?camera=1,1,1,1,99"};
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        assert_int_equal(get_with_token(bad[i]), 400);
    }
    assert_int_equal(serve_stop(&server, SIGINT), 0);
}

static void same_picture(const char *path) {
    vd_picture *a = NULL, *b = NULL;
    vd_comparison comparison;
    assert_int_equal(get_with_token(path), 200);
    assert_ok(vd_picture_load(context, "got.txt", &a));
    assert_ok(vd_picture_load(context, "render.png", &b));
    assert_ok(vd_picture_compare(a, b, 0.0, &comparison, NULL));
    assert_int_equal(comparison.differing_pixels, 0);
    vd_picture_destroy(&a);
    vd_picture_destroy(&b);
}

static void test_frames(void **state) {
    (void)state;
    serve_start(&server, "--port 0 --token a.b-c_d~1 " WORLD);
    assert_string_equal(server.token, "a.b-c_d~1");
    assert_int_equal(run("", "render -q -o render.png " WORLD), 0);
    same_picture("/frame.png?size=240x136");
    assert_int_equal(run("", "render -q -o render.png --eye 20000,15000,6000 --heading 200 --pitch "
                             "-12 --fov 60 " WORLD),
                     0);
    same_picture("/frame.png?size=240x136&camera=20000,15000,6000,200,-12,60");
    assert_int_equal(serve_stop(&server, SIGTERM), 0);
}

/* ---- the socket -------------------------------------------------------------------------------*/

/* The exact picture over the socket is the one of `veduta render`. */
static void assert_rendered(connection *c) {
    char hash[17];
    (void)snprintf(hash, sizeof hash, "%016llx",
                   (unsigned long long)vd_frame_hash(c->client.screen));
    assert_int_equal(run("", "render -j -o render.png " WORLD), 0);
    if (strstr(out, hash) == NULL) {
        fail_msg("the client has %s, not %s", hash, out);
    }
}

static void test_settles(void **state) {
    (void)state;
    connection c, other;
    serve_start(&server, "--port 0 " WORLD);
    vd_camera camera = first_camera();
    greet(&c, false);
    greet(&other, false);
    vd_camera moved = camera;
    for (int i = 0; i < 30; i++) { /* on a way */
        moved.eye.x = camera.eye.x + 20.0 * (30 - i);
        look(&c, &moved);
        look(&other, &moved);
        connection_run(&c, 0.02);
        connection_run(&other, 0.01);
    }
    look(&c, &camera);
    settle(&c);
    look(&other, &camera);
    settle(&other);
    assert_rendered(&c);
    assert_rendered(&other);
    assert_true(c.client.orders > 0 && c.client.pictures > 6);
    /* What its pictures show is nearly that. */
    vd_frame *frame = NULL;
    assert_ok(vd_frame_create(context, SIDE_X, SIDE_Y, 0, &frame));
    client_show(&c.client, &camera, frame);
    assert_true(vd_frame_error(frame, c.client.screen) < 0.2);
    vd_frame_destroy(&frame);
    connection_close(&other);
    /* Told when the server stops. */
    assert_int_equal(kill(server.id, SIGTERM), 0);
    expect_fault(&c, 0);
    assert_int_equal(c.client.bye, VD_WIRE_STOPPING);
    connection_close(&c);
    int status = 0;
    assert_int_equal(waitpid(server.id, &status, 0), server.id);
    assert_true(WIFEXITED(status) && WEXITSTATUS(status) == 0);
}

static void test_screens(void **state) {
    (void)state;
    connection c;
    serve_start(&server, "--port 0 " WORLD);
    const vd_camera camera = first_camera();
    greet(&c, false);
    const vd_wire_message m = {.kind = VD_WIRE_SETTINGS,
                               .as.settings = {.mode = VD_WIRE_MODE_SCREENS}};
    connection_say(&c, &m);
    look(&c, &camera);
    settle(&c);
    assert_true(c.client.screens >= 2 && c.client.orders == 0);
    assert_rendered(&c);
    connection_close(&c);
    assert_int_equal(serve_stop(&server, SIGTERM), 0);
}

/* The server is killed and started again; the client comes back with what it has. */
static void come_back(connection *c, connection *again) {
    static uint64_t ids[MOST_HELD];
    static uint32_t versions[MOST_HELD];
    for (int i = 0; i < c->client.count; i++) {
        ids[i] = c->client.items[i].id;
        versions[i] = c->client.items[i].version;
    }
    vd_wire_message m = client_hello(server.token);
    m.as.hello.held = (vd_wire_ids){ids, c->client.count};
    m.as.hello.held_versions = versions;
    connection_open(again, context, server.port, false, "/socket", "veduta");
    assert_true(again->open);
    /* The pictures move over. */
    memcpy(again->client.items, c->client.items, (size_t)c->client.count * sizeof(held));
    again->client.count = c->client.count;
    again->client.bytes = c->client.bytes;
    c->client.count = 0;
    connection_say(again, &m);
}

static void test_comes_back(void **state) {
    (void)state;
    connection first, second, third;
    char options[512];
    serve_start(&server, "--port 0 --token again " WORLD);
    const vd_camera camera = first_camera();
    greet(&first, false);
    look(&first, &camera);
    settle(&first);
    /* The connection breaks; the server knows what it made. */
    const int kept = first.client.count;
    come_back(&first, &second);
    connection_close(&first);
    nanosleep(&(struct timespec){0, 200000000}, NULL);
    look(&second, &camera);
    settle(&second);
    assert_true(second.client.count >= kept / 2);
    assert_rendered(&second);
    /* The server breaks. */
    (void)serve_stop(&server, SIGKILL);
    expect_fault(&second, 0);
    (void)snprintf(options, sizeof options, "--port %d --token again " WORLD, server.port);
    serve_start(&server, options);
    const int held_before = second.client.count;
    come_back(&second, &third);
    connection_close(&second);
    look(&third, &camera);
    settle(&third);
    assert_int_equal(third.client.drops, held_before);
    assert_rendered(&third);
    connection_close(&third);
    assert_int_equal(serve_stop(&server, SIGTERM), 0);
}

static void test_tls(void **state) {
    (void)state;
    connection c;
    if (system("openssl req -x509 -newkey rsa:2048 -nodes -days 2 -subj /CN=127.0.0.1 -keyout "
               "key.pem -out cert.pem >/dev/null 2>&1") != 0) {
        skip();
    }
    serve_start(&server, "--port 0 --tls cert.pem --tls-key key.pem " WORLD);
    assert_int_equal(get("https", "/health", "--tls-max 1.3"), 200);
    assert_int_equal(get("https", "/health", "--tls-max 1.1"), 0);
    assert_int_equal(get("http", "/health", ""), 0);
    greet(&c, true);
    says_pong(&c);
    connection_close(&c);
    assert_int_equal(serve_stop(&server, SIGTERM), 0);
    assert_int_equal(run("", "serve --port 0 --tls key.pem " WORLD), 1);
    assert_non_null(strstr(err, "certificate"));
}

/* ---- hostile ----------------------------------------------------------------------------------*/

static void test_refused(void **state) {
    (void)state;
    connection c, good, more[2];
    serve_start(&server, "--port 0 --max-clients 3 " WORLD);
    greet(&good, false);
    says_pong(&good);
    /* Other paths and protocols are no socket. */
    connection_open(&c, context, server.port, false, "/other", "veduta");
    assert_false(c.open);
    connection_close(&c);
    connection_open(&c, context, server.port, false, "/socket", "chat");
    assert_false(c.open);
    connection_close(&c);
    /* Tokens. */
    static const char *const tokens[] = {"", "0", "00000000000000000000000000000000"};
    for (int i = 0; i < 3; i++) {
        connection_open(&c, context, server.port, false, "/socket", "veduta");
        const vd_wire_message m = client_hello(tokens[i]);
        connection_say(&c, &m);
        expect_fault(&c, VD_WIRE_FAULT_TOKEN);
        connection_close(&c);
    }
    /* Noise, before and after a hello. */
    uint8_t noise[512];
    uint64_t random = 3;
    for (int round = 0; round < 20; round++) {
        for (size_t i = 0; i < sizeof noise; i++) {
            noise[i] = (uint8_t)(256 * test_uniform(&random));
        }
        connection_open(&c, context, server.port, false, "/socket", "veduta");
        if (round % 2 == 1) {
            const vd_wire_message m = client_hello(server.token);
            connection_say(&c, &m);
        }
        connection_send(&c, noise, sizeof noise);
        expect_fault(&c, VD_WIRE_FAULT_MALFORMED);
        connection_close(&c);
    }
    /* Too much at once, too often. */
    uint8_t *large = calloc(1, 2 << 20);
    greet(&c, false);
    connection_send(&c, large, 2 << 20);
    expect_fault(&c, 0);
    connection_close(&c);
    free(large);
    greet(&c, false);
    static vd_wire_message pings[1000];
    for (int i = 0; i < 1000; i++) {
        pings[i] = (vd_wire_message){.kind = VD_WIRE_PING, .as.ping = {1}};
    }
    for (int i = 0; i < 4; i++) {
        assert_ok(vd_wire_encode(c.wire, VD_WIRE_CLIENT, 0, pings, 1000, &c.buffer));
        connection_send(&c, c.buffer.data, c.buffer.bytes);
    }
    /* What is still on its way when the server closes may take the error with it. */
    expect_end(&c);
    assert_true(c.client.fault == 0 || c.client.fault == VD_WIRE_FAULT_TOO_MUCH);
    connection_close(&c);
    /* One too many. */
    nanosleep(&(struct timespec){0, 300000000}, NULL);
    for (int i = 0; i < 2; i++) {
        greet(&more[i], false);
        says_pong(&more[i]);
    }
    greet(&c, false);
    expect_fault(&c, VD_WIRE_FAULT_FULL);
    connection_close(&c);
    connection_close(&more[0]);
    connection_close(&more[1]);
    /* The good one has not noticed. */
    says_pong(&good);
    const vd_camera camera = first_camera();
    look(&good, &camera);
    settle(&good);
    assert_rendered(&good);
    connection_close(&good);
    assert_int_equal(serve_stop(&server, SIGTERM), 0);
}

static int dial(void) {
    const struct sockaddr_in to = {.sin_family = AF_INET,
                                   .sin_port = htons((uint16_t)server.port),
                                   .sin_addr.s_addr = htonl(INADDR_LOOPBACK)};
    const int made = socket(AF_INET, SOCK_STREAM, 0);
    assert_true(made >= 0);
    assert_int_equal(connect(made, (const struct sockaddr *)&to, sizeof to), 0);
    return made;
}

/* Connections that say nothing, or half of something, are closed; a client does not notice. */
static void test_loris(void **state) {
    (void)state;
    enum { MANY = 300 };
    int idle[MANY];
    connection good;
    serve_start(&server, "--port 0 --max-clients 4 " WORLD);
    greet(&good, false);
    for (int i = 0; i < MANY; i++) {
        idle[i] = dial();
        if (i % 2 == 0) {
            assert_true(write(idle[i], "GET / HT", 8) == 8 || errno == EPIPE);
        }
    }
    says_pong(&good);
    int left = MANY;
    for (const double until_s = clock_s() + 30.0; left > 0 && clock_s() < until_s;) {
        connection_run(&good, 0.2);
        left = 0;
        for (int i = 0; i < MANY; i++) {
            char byte;
            const ssize_t got = recv(idle[i], &byte, 1, MSG_DONTWAIT);
            left += got > 0 || (got < 0 && errno == EAGAIN);
        }
    }
    assert_int_equal(left, 0);
    for (int i = 0; i < MANY; i++) {
        (void)close(idle[i]);
    }
    says_pong(&good);
    assert_int_equal(get("http", "/health", ""), 200);
    connection_close(&good);
    assert_int_equal(serve_stop(&server, SIGTERM), 0);
}

/* ---- bad use ----------------------------------------------------------------------------------*/

static void fails(int status, const char *part, const char *arguments) {
    char line[1024];
    (void)snprintf(line, sizeof line, "serve %s", arguments);
    const int got = run("", line);
    if (got != status || strstr(err, part) == NULL) {
        fail_msg("%s: status %d, %s, not \"%s\"", arguments, got, err, part);
    }
    assert_int_equal(strncmp(err, "veduta: ", 8), 0);
}

static void test_bad_use(void **state) {
    (void)state;
    fails(2, "--token", "--token 'a b' " WORLD);
    fails(2, "--token", "--token '' " WORLD);
    fails(2, "--tls-key", "--tls-key k.pem " WORLD);
    fails(1, "nothing.pem", "--port 0 --tls nothing.pem " WORLD);
    fails(2, "--bandwidth", "--bandwidth x " WORLD);
    fails(2, "--memory", "--memory 1k " WORLD);
    fails(2, "--max-clients", "--max-clients 0 " WORLD);
    fails(2, "--output", "-o x.png " WORLD);
    fails(2, "no address", "--port 0 --bind somewhere " WORLD);
    fails(1, "cannot listen", "--port 0 --bind 192.0.2.1 " WORLD);
    fails(1, "nowhere", "--port 0 --root nowhere " WORLD);
    fails(1, "cannot read", "--port 0 none.tif");
    /* A port that is taken. */
    serve_start(&server, "--port 0 " WORLD);
    char options[256];
    (void)snprintf(options, sizeof options, "--port %d " WORLD, server.port);
    fails(1, "cannot listen", options);
    assert_int_equal(serve_stop(&server, SIGINT), 0);
    assert_int_equal(run("", "serve --help"), 0);
    assert_non_null(strstr(out, "usage: veduta serve"));
}

static void test_root(void **state) {
    (void)state;
    static char text[4096];
    (void)mkdir("page", 0700);
    (void)mkdir("page/inner", 0700);
    write_file("page/index.html", "<p>the page</p>");
    write_file("page/inner/a.js", "let a;");
    write_file("page/.secret", "hidden");
    (void)unlink("page/link");
    assert_int_equal(symlink("/etc/passwd", "page/link"), 0);
    serve_start(&server, "--port 0 --root page " WORLD);
    assert_int_equal(get("http", "/", ""), 200);
    read_back("got.txt", text, sizeof text);
    assert_string_equal(text, "<p>the page</p>");
    assert_int_equal(get("http", "/inner/a.js", "-D head.txt"), 200);
    read_back("head.txt", text, sizeof text);
    assert_non_null(strstr(text, "text/javascript"));
    assert_non_null(strstr(text, "content-security-policy: default-src 'none'"));
    assert_int_equal(get("http", "/.secret", ""), 404);
    assert_int_equal(get("http", "/link", ""), 404);
    assert_int_equal(get("http", "/inner/../.secret", "--path-as-is"), 404);
    assert_int_equal(serve_stop(&server, SIGTERM), 0);
}

static void test_replay(void **state) {
    (void)state;
    assert_int_equal(run("", "replay " VEDUTA_SOURCE_DIR "/test/wire/exchange.vdx"), 0);
    assert_non_null(strstr(out, "12 envelopes, 22 messages, 2 pictures"));
    assert_int_equal(run("", "replay nothing.vdx"), 1);
    assert_int_equal(run("", "replay"), 2);
    write_file("bad.vdx", "VDX?");
    assert_int_equal(run("", "replay bad.vdx"), 1);
    assert_int_equal(system("head -c 300 " VEDUTA_SOURCE_DIR "/test/wire/exchange.vdx >cut.vdx"),
                     0);
    assert_int_equal(run("", "replay cut.vdx"), 1);
    assert_non_null(strstr(err, "is cut off"));
}

/* What the first client and the server say is written down, but its token. */
static void test_record(void **state) {
    (void)state;
    connection c, other;
    (void)unlink("first.vdx");
    serve_start(&server, "--port 0 --record first.vdx " WORLD);
    vd_camera camera = first_camera();
    greet(&c, false);
    look(&c, &camera);
    settle(&c);
    greet(&other, false);
    look(&other, &camera);
    settle(&other);
    assert_int_not_equal(access("first.vdx", F_OK), 0); /* it is not whole */
    connection_close(&c);
    for (int i = 0; i < 100 && access("first.vdx", F_OK) != 0; i++) {
        connection_run(&other, 0.05);
    }
    const int pictures = c.client.pictures, screens = c.client.screens;
    connection_close(&other);
    assert_int_equal(serve_stop(&server, SIGTERM), 0);
    assert_int_equal(run("", "replay first.vdx"), 0);
    assert_non_null(strstr(out, "hello version 1"));
    assert_non_null(strstr(out, "camera 1 at"));
    assert_non_null(strstr(out, ", exact"));
    char counts[64];
    (void)snprintf(counts, sizeof counts, " %d pictures", pictures + screens);
    if (strstr(out, counts) == NULL) {
        fail_msg("%s: not%s", out + strlen(out) - 80, counts);
    }
    char command[512];
    (void)snprintf(command, sizeof command, "grep -c '%s' first.vdx >/dev/null", server.token);
    assert_int_not_equal(system(command), 0);
    serve_start(&server, "--port 0 --record none.vdx " WORLD);
    assert_int_equal(serve_stop(&server, SIGTERM), 0);
    assert_int_not_equal(access("none.vdx", F_OK), 0);
    assert_int_not_equal(access("none.vdx.part", F_OK), 0);
    assert_int_equal(run("", "serve --port 0 --record no/where.vdx " WORLD), 1);
    assert_non_null(strstr(err, "name another file to record into"));
}

int main(void) {
    (void)signal(SIGPIPE, SIG_IGN);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_http),       cmocka_unit_test(test_frames),
        cmocka_unit_test(test_settles),    cmocka_unit_test(test_screens),
        cmocka_unit_test(test_comes_back), cmocka_unit_test(test_tls),
        cmocka_unit_test(test_refused),    cmocka_unit_test(test_loris),
        cmocka_unit_test(test_record),     cmocka_unit_test(test_root),
        cmocka_unit_test(test_bad_use),    cmocka_unit_test(test_replay),
    };
    return cmocka_run_group_tests(tests, setup, teardown);
}

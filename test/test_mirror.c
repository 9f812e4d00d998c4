/* The client's half of a session: against the server's half, and against servers that do wrong. */
#include <stdlib.h>
#include "mirror_ends.h"
#include "remote/client_address.h"

static void begin(size_t memory_bytes, bool serve) {
    const vd_mirror_def mirror = {.token = "secret",
                                  .memory_bytes = memory_bytes,
                                  .settings = vd_client_def_default().settings};
    begin_ends(&mirror, WIDTH, HEIGHT, serve);
}

static void assert_exact(const vd_camera *camera) {
    vd_client_shown shown;
    (void)compare(camera, &shown);
    assert_true(shown.exact);
    assert_true(vd_frame_hash(e.frame) == vd_frame_hash(e.perfect));
}

static void look(const vd_camera *camera) {
    vd_mirror_look(e.mirror, camera, WIDTH, HEIGHT);
}

/* ---- with a server ----------------------------------------------------------------------------*/

static void it_shows_the_exact_picture_at_rest(void **state) {
    (void)state;
    begin((size_t)64 << 20, true);
    vd_camera camera = looking(vd_vec3_make(0, 0, 0));
    assert_int_equal(news().state, VD_CLIENT_CONNECTING);
    look(&camera);
    pass(0.6);
    assert_int_equal(news().state, VD_CLIENT_SHOWING);
    assert_exact(&camera);
    /* Another camera gets quads at once, before anything is said. */
    camera.eye.x += 3.0;
    vd_client_shown shown;
    assert_true(compare(&camera, &shown) < 0.3);
    assert_true(shown.quads > 10 && !shown.screen);
    look(&camera);
    pass(0.6);
    assert_exact(&camera);
    /* Nothing is said again of the same view. */
    const uint64_t cameras = news().cameras;
    look(&camera);
    pass(0.2);
    assert_int_equal(news().cameras, cameras);
    end();
}

/* What a neighbour's set has made, a few steps away, is shown as if it were this one's own. */
static void it_shows_what_others_made(void **state) {
    (void)state;
    begin((size_t)64 << 20, true);
    const vd_mirror_def def = {.token = "secret",
                               .memory_bytes = (size_t)64 << 20,
                               .settings = vd_client_def_default().settings};
    vd_camera camera = looking(vd_vec3_make(0, 0, 0));
    vd_session *session = e.session;
    vd_mirror *mirror = e.mirror;
    vd_session_set_clients(session, 2);
    look(&camera);
    pass(0.6);
    e.scene.def.seed = 5000000;
    assert_ok(vd_session_create(&e.scene.def, e.now_s, &e.session));
    assert_ok(vd_mirror_create(e.context, &def, &e.mirror));
    vd_session_set_clients(e.session, 2);
    vd_mirror_open(e.mirror, e.now_s);
    double sum = 0.0, most_px = 0.0;
    for (int i = 0; i < 40; i++) {
        camera.eye = vd_vec3_add(camera.eye, vd_vec3_make(0.05, 0.02, 0.01));
        look(&camera);
        pass(1.0 / 60);
        sum += i >= 20 ? compare(&camera, NULL) : 0.0;
        const double wrong_px = vd_session_get_stats(e.session).error_px;
        most_px = wrong_px > most_px ? wrong_px : most_px;
    }
    assert_true(sum / 20 < 0.25);
    assert_true(most_px > 0.0 && most_px < 2.0);
    assert_true(vd_session_get_stats(e.session).shared > 10);
    assert_true(vd_session_get_stats(session).shared == 0);
    assert_true(e.scene.tools.sent.bytes > 0);
    vd_session_destroy(&session); /* what it made is still held here */
    vd_mirror_destroy(&mirror);
    assert_true(compare(&camera, NULL) < 0.25);
    pass(0.6);
    assert_exact(&camera);
    assert_true(vd_session_get_stats(e.session).error_px == 0.0);
    end();
}

static void it_follows_a_moving_camera(void **state) {
    (void)state;
    begin((size_t)64 << 20, true);
    vd_camera camera = looking(vd_vec3_make(0, 0, 0));
    double sum = 0.0;
    const int steps = test_is_reduced() ? 35 : 60;
    for (int i = 0; i < steps; i++) {
        camera.eye = vd_vec3_add(camera.eye, vd_vec3_make(0.3, 0.5, 0.05));
        camera.orientation = vd_orientation_from_angles(0.1 + 0.004 * i, -0.25, 0.0);
        look(&camera);
        pass(1.0 / 60);
        sum += i >= 20 ? compare(&camera, NULL) : 0.0;
    }
    assert_true(sum / (steps - 20) < 0.25);
    assert_true(news().answers > 0 && news().most_held_bytes < (size_t)64 << 20);
    end();
}

/* Of the part that both see after a small turn. */
static int difference(const vd_frame *a, const vd_frame *b) {
    int sum = 0;
    for (int y = 8; y < HEIGHT - 8; y++) {
        for (int x = 12; x < WIDTH - 12; x++) {
            const size_t at = 4 * (a->stride * (size_t)y + (size_t)x);
            sum += abs(a->rgba[at] - b->rgba[at]);
        }
    }
    return sum;
}

static void screens_are_shown_turned(void **state) {
    (void)state;
    begin((size_t)64 << 20, true);
    vd_wire_settings settings = vd_client_def_default().settings;
    settings.mode = VD_WIRE_MODE_SCREENS;
    assert_ok(vd_mirror_set(e.mirror, &settings));
    vd_camera camera = looking(vd_vec3_make(0, 0, 0));
    look(&camera);
    pass(0.6);
    assert_exact(&camera);
    vd_frame *still = NULL;
    assert_ok(vd_frame_create(e.context, WIDTH, HEIGHT, 0, &still));
    assert_ok(vd_mirror_draw(e.mirror, NULL, &camera, still, NULL));
    camera.orientation = vd_quat_normalize(
        vd_quat_multiply(camera.orientation, vd_quat_from_axis_angle(vd_vec3_make(0, 1, 0), 0.06)));
    vd_client_shown shown;
    (void)compare(&camera, &shown);
    assert_true(shown.screen && !shown.exact && shown.quads == 0);
    assert_true(2 * difference(e.frame, e.perfect) < difference(still, e.perfect));
    assert_int_equal(news().ordered, 0);
    vd_frame_destroy(&still);
    settings.tolerance_px = -1.0f;
    assert_int_equal(vd_mirror_set(e.mirror, &settings).code, VD_ERROR_ARGUMENT);
    end();
}

static void it_comes_back_with_what_it_holds(void **state) {
    (void)state;
    begin((size_t)64 << 20, true);
    const vd_camera camera = looking(vd_vec3_make(0, 0, 0));
    look(&camera);
    pass(0.6);
    const vd_client_news before = news();
    assert_true(before.held > 10);
    vd_mirror_lose(e.mirror, "the cable fell out");
    assert_int_equal(news().state, VD_CLIENT_LOST);
    assert_string_equal(news().sentence, "the cable fell out");
    assert_exact(&camera); /* it keeps showing */
    assert_true(vd_mirror_may_open(e.mirror));
    vd_session *past = e.session;
    assert_ok(vd_session_create(&e.scene.def, e.now_s, &e.session));
    vd_mirror_open(e.mirror, e.now_s);
    vd_packet *hello = vd_mirror_take(e.mirror);
    vd_session_receive(e.session, hello->data + VD_PACKET_HEAD, hello->bytes, e.now_s);
    vd_release(e.context, hello);
    assert_true(vd_session_wants_past(e.session));
    assert_true(vd_session_takes_past(e.session, past));
    vd_session_destroy(&past);
    pass(0.6);
    assert_exact(&camera);
    assert_true(news().pictures - before.pictures < before.pictures / 4 + 16);
    /* Of a server that was started again it drops all. */
    vd_mirror_lose(e.mirror, "again");
    vd_session_destroy(&e.session);
    e.scene.def.seed = 500000;
    assert_ok(vd_session_create(&e.scene.def, e.now_s, &e.session));
    vd_mirror_open(e.mirror, e.now_s);
    pass(0.8);
    assert_exact(&camera);
    assert_int_equal(news().connections, 3);
    end();
}

static void it_stays_within_its_memory(void **state) {
    (void)state;
    begin((size_t)4 << 20, true);
    vd_camera camera = looking(vd_vec3_make(0, 0, 0));
    for (int i = 0; i < (test_is_reduced() ? 25 : 60); i++) {
        camera.eye = vd_vec3_add(camera.eye, vd_vec3_make(3.0, 5.0, 0.1));
        camera.orientation = vd_orientation_from_angles(0.2 * i, -0.25, 0.0);
        look(&camera);
        pass(0.03);
    }
    assert_int_equal(news().state, VD_CLIENT_SHOWING);
    assert_true(news().most_held_bytes <= (size_t)4 << 20);
    end();
}

/* A bar that stands, and a needle that turns with the camera; one of them where labels may stand.
 */
typedef struct furniture {
    vd_layer layers[2];
    double bar[4][2], needle[3][2];
    float kept[1][4];
} furniture;

static vd_status furnish(void *user, const vd_camera *camera, int width, int height,
                         vd_overlay *out) {
    furniture *f = user;
    double heading, pitch, roll;
    vd_orientation_to_angles(camera->orientation, &heading, &pitch, &roll);
    const double x = width - 20, y = 20, s = sin(heading), c = cos(heading);
    const double bar[4][2] = {
        {8, height - 12.0}, {60, height - 12.0}, {60, height - 6.0}, {8, height - 6.0}};
    const double needle[3][2] = {
        {x + 14 * s, y - 14 * c}, {x - 5 * c, y - 5 * s}, {x + 5 * c, y + 5 * s}};
    memcpy(f->bar, bar, sizeof bar);
    memcpy(f->needle, needle, sizeof needle);
    for (int i = 0; i < 2; i++) {
        f->layers[i] = vd_layer_default();
        vd_layer_color((vd_rgba8){250, (uint8_t)(40 * i), 20, 255}, f->layers[i].fill);
    }
    f->layers[0].path = (vd_path){.points = (const double(*)[2])f->bar, .point_count = 4};
    f->layers[1].path = (vd_path){.points = (const double(*)[2])f->needle, .point_count = 3};
    const float kept[4] = {8, (float)height - 12, 60, (float)height - 6};
    memcpy(f->kept[0], kept, sizeof kept);
    *out = (vd_overlay){f->layers, 2, (const float(*)[4])f->kept, 1};
    return vd_success();
}

/* The greatest difference of two frames in one of the two places. */
static int furniture_difference(const vd_frame *a, const vd_frame *b, bool needle) {
    const int x0 = needle ? WIDTH - 38 : 9, x1 = needle ? WIDTH - 2 : 59;
    const int y0 = needle ? 2 : HEIGHT - 11, y1 = needle ? 38 : HEIGHT - 7;
    int most = 0;
    for (int y = y0; y < y1; y++) {
        for (int x = x0; x < x1; x++) {
            const uint8_t *p = a->rgba + 4 * (a->stride * (size_t)y + (size_t)x);
            const uint8_t *q = b->rgba + 4 * (b->stride * (size_t)y + (size_t)x);
            const bool red = (p[0] > 200 && p[1] < 60) || (q[0] > 200 && q[1] < 60);
            for (int c = 0; c < 3 && red; c++) {
                most = abs(p[c] - q[c]) > most ? abs(p[c] - q[c]) : most;
            }
        }
    }
    return most;
}

static int fixed_pictures;

static void count_fixed(const vd_packet *p) {
    vd_wire_envelope envelope;
    assert_ok(
        vd_wire_decode(e.wire, VD_WIRE_SERVER, p->data + VD_PACKET_HEAD, p->bytes, &envelope));
    for (int i = 0; i < envelope.count; i++) {
        fixed_pictures +=
            envelope.messages[i].kind == VD_WIRE_IMPOSTOR && envelope.messages[i].as.impostor.fixed;
    }
}

static void furniture_stays_on_screen(void **state) {
    (void)state;
    furniture f;
    vd_world_renderer_def furnished = vd_world_renderer_def_default();
    furnished.overlay = furnish;
    furnished.overlay_user = &f;
    begin((size_t)64 << 20, true);
    vd_session_destroy(&e.session);
    vd_world_renderer_destroy(&e.scene.renderer);
    assert_ok(
        vd_world_renderer_create(e.context, NULL, e.scene.world, &furnished, &e.scene.renderer));
    e.scene.def.renderer = e.scene.renderer;
    assert_ok(vd_session_create(&e.scene.def, e.now_s, &e.session));
    e.said = count_fixed;
    fixed_pictures = 0;
    vd_camera camera = looking(vd_vec3_make(0, 0, 0));
    look(&camera);
    pass(0.8);
    assert_exact(&camera);
    assert_int_equal(fixed_pictures, 2);
    /* Without a word from the server it stands where it stood, whatever the camera does. */
    vd_frame *still = NULL;
    assert_ok(vd_frame_create(e.context, WIDTH, HEIGHT, 0, &still));
    assert_ok(vd_mirror_draw(e.mirror, NULL, &camera, still, NULL));
    vd_client_shown shown;
    vd_camera other = camera;
    other.eye.x += 2.0;
    other.eye.z += 1.0;
    other.orientation = vd_orientation_from_angles(0.7, -0.3, 0.1);
    other.lens = vd_lens_from_fov(0.6, WIDTH, HEIGHT);
    other.near_m = 3.0;
    (void)compare(&other, &shown);
    assert_false(shown.exact || shown.screen);
    assert_true(furniture_difference(e.frame, still, false) <= 2);
    assert_true(furniture_difference(e.frame, still, true) <= 2);
    assert_true(furniture_difference(e.frame, e.perfect, true) > 50); /* the needle should turn, */
    for (int i = 0; i < 25; i++) {                                    /* and does */
        other.eye.x += 0.02;
        look(&other);
        pass(0.02);
    }
    (void)compare(&other, &shown);
    assert_false(shown.exact || shown.screen);
    assert_true(furniture_difference(e.frame, e.perfect, false) <= 2);
    assert_true(furniture_difference(e.frame, e.perfect, true) <= 2);
    assert_int_equal(fixed_pictures, 3); /* the bar is the same */
    /* A client that has lost them gets them again, and one that comes back. */
    pass(0.8);
    assert_exact(&other);
    const uint64_t lost[1] = {(UINT64_C(255) << 56) | 64};
    const vd_wire_message drop = {.kind = VD_WIRE_DROP, .as.drop = {lost, 1}};
    assert_ok(vd_wire_encode(e.wire, VD_WIRE_CLIENT, 0, &drop, 1, &e.buffer));
    vd_session_receive(e.session, e.buffer.data, e.buffer.bytes, e.now_s);
    other.eye.x += 0.02;
    look(&other);
    pass(0.3);
    assert_int_equal(fixed_pictures, 4);
    vd_mirror_lose(e.mirror, "again");
    vd_session_destroy(&e.session);
    e.scene.def.seed = 500000;
    assert_ok(vd_session_create(&e.scene.def, e.now_s, &e.session));
    vd_mirror_open(e.mirror, e.now_s);
    pass(0.8);
    assert_exact(&other);
    other.eye.x += 0.5;
    (void)compare(&other, &shown);
    assert_true(furniture_difference(e.frame, e.perfect, false) <= 2);
    assert_true(furniture_difference(e.frame, e.perfect, true) <= 2);
    assert_true(news().most_held_bytes < (size_t)64 << 20);
    vd_frame_destroy(&still);
    end();
}

/* Around the eye the client knows the ground as it is, wherever it flies. */
static void the_ground_is_known(void **state) {
    (void)state;
    begin((size_t)64 << 20, true);
    vd_camera camera = looking(vd_vec3_make(0, 0, 0));
    assert_true(vd_mirror_ground(e.mirror, camera.eye.x, camera.eye.y) == (double)-INFINITY);
    const vd_world *world = e.scene.world;
    for (int step = 0; step < (test_is_reduced() ? 3 : 12); step++) {
        look(&camera);
        pass(0.05);
        for (int i = 0; i < 50; i++) {
            const double x = camera.eye.x + i % 7 - 3, y = camera.eye.y + i / 7 - 3;
            const double known = vd_mirror_ground(e.mirror, x, y),
                         is = vd_world_ground(world, x, y);
            const bool coarse = step > 5 && step < 9; /* from high up the highest around */
            if (isfinite(is) && !(known > is - 2.0 && known < is + (coarse ? 40.0 : 2.0))) {
                fail_msg("step %d: %g m where the ground is at %g m", step, known, is);
            }
        }
        camera.eye.x += step % 2 == 0 ? 30.0 : 3.0;
        camera.eye.y += 4.0;
        camera.eye.z += step == 5 ? 500.0 : step == 8 ? -500.0 : 0.0;
    }
    assert_true(vd_mirror_ground(e.mirror, 1e8, 0) == (double)-INFINITY);
    assert_true(vd_mirror_ground(e.mirror, NAN, 0) == (double)-INFINITY);
    end();
}

static void a_wrong_token_is_refused(void **state) {
    (void)state;
    begin((size_t)64 << 20, true);
    vd_session_destroy(&e.session);
    e.scene.def.token = "another";
    assert_ok(vd_session_create(&e.scene.def, e.now_s, &e.session));
    pass(0.05);
    assert_int_equal(news().state, VD_CLIENT_REFUSED);
    assert_non_null(strstr(news().sentence, "token"));
    assert_false(vd_mirror_may_open(e.mirror));
    vd_mirror_lose(e.mirror, "closed"); /* the reason stays */
    assert_int_equal(news().state, VD_CLIENT_REFUSED);
    end();
}

/* ---- with servers that do wrong ---------------------------------------------------------------*/

static void greet(unsigned version) {
    const vd_wire_message m = {
        .kind = VD_WIRE_HELLO,
        .as.hello = {.version = version, .capabilities = VD_CODEC_ALL, .name = "played"}};
    say_in(0, &m);
}

static vd_wire_message picture(uint64_t id, int side, const uint8_t *rgba) {
    vd_wire_message m = {.kind = VD_WIRE_IMPOSTOR};
    m.as.impostor = (vd_wire_impostor){.id = id,
                                       .version = 1,
                                       .corners = {{-1, 9, 1}, {1, 9, 1}, {1, 9, -1}, {-1, 9, -1}},
                                       .nearer = 1.0f,
                                       .width = side,
                                       .height = side,
                                       .codec = VD_CODEC_RAW,
                                       .picture = {rgba, 4 * (size_t)side * (size_t)side}};
    return m;
}

/* Ends with a state whose sentence has a part in it. */
static void expect(vd_client_state wanted, const char *part) {
    const vd_client_news n = news();
    if (n.state != wanted || strstr(n.sentence, part) == NULL) {
        fail_msg("%s: %s", vd_client_state_name(n.state), n.sentence);
    }
    assert_true(vd_mirror_is_over(e.mirror));
    end();
}

static void start(void) {
    begin((size_t)4 << 20, false);
    const vd_camera camera = looking(vd_vec3_make(0, 0, 0));
    look(&camera);
    greet(VD_WIRE_VERSION);
    pass(0.01);
    assert_int_equal(news().state, VD_CLIENT_LOADING);
}

static void every_fault_has_a_sentence(void **state) {
    (void)state;
    static uint8_t rgba[1024 * 1024 * 4];
    const uint64_t ids[2] = {1, 2};
    begin((size_t)4 << 20, false);
    vd_mirror_receive(e.mirror, "noise", 5, e.now_s);
    expect(VD_CLIENT_REFUSED, "what it may not");
    begin((size_t)4 << 20, false);
    const vd_wire_message order = {.kind = VD_WIRE_ORDER, .as.order = {.ids = {ids, 2}}};
    say_in(0, &order);
    expect(VD_CLIENT_REFUSED, "first message is a hello");
    begin((size_t)4 << 20, false);
    greet(VD_WIRE_VERSION + 1);
    expect(VD_CLIENT_MISMATCHED, "different versions");
    start();
    greet(VD_WIRE_VERSION);
    expect(VD_CLIENT_REFUSED, "hello is said once");
    start();
    const vd_wire_message far_order = {.kind = VD_WIRE_ORDER,
                                       .as.order = {.camera = 7, .ids = {ids, 2}}};
    say_in(1, &far_order);
    expect(VD_CLIENT_REFUSED, "camera that was not sent");
    start();
    say_in(3, &order);
    say_in(3, &order);
    expect(VD_CLIENT_REFUSED, "batch's number");
    start();
    vd_wire_message large = picture(1, 1024, rgba);
    say_in(1, &large); /* just fits */
    assert_int_equal(news().held_bytes, (size_t)4 << 20);
    say_in(2, &large); /* in its own place */
    large.as.impostor.id = 2;
    say_in(3, &large);
    expect(VD_CLIENT_REFUSED, "more memory");
    start();
    vd_wire_message damaged = picture(1, 8, rgba);
    damaged.as.impostor.codec = VD_CODEC_RUNS_ZSTD;
    damaged.as.impostor.picture.bytes = 9;
    say_in(1, &damaged);
    expect(VD_CLIENT_REFUSED, "what it may not");
    start();
    vd_wire_message screen = {.kind = VD_WIRE_SCREEN};
    screen.as.screen = (vd_wire_screen){.camera = 1,
                                        .codec = VD_CODEC_RAW,
                                        .width = 512,
                                        .height = 512,
                                        .picture = {rgba, 4 * 512 * 512}};
    say_in(1, &screen);
    expect(VD_CLIENT_REFUSED, "nobody has asked");
    start();
    pass(31.0);
    expect(VD_CLIENT_LOST, "30 s");
    begin((size_t)4 << 20, false);
    pass(11.0);
    expect(VD_CLIENT_LOST, "does not answer");
}

static void goodbyes_are_told_apart(void **state) {
    (void)state;
    static const struct {
        vd_wire_message message;
        vd_client_state state;
        const char *part;
    } cases[] = {
        {{.kind = VD_WIRE_BYE, .as.bye = {VD_WIRE_STOPPING, "stops"}}, VD_CLIENT_LOST, "stops"},
        {{.kind = VD_WIRE_BYE, .as.bye = {VD_WIRE_DONE, ""}}, VD_CLIENT_ENDED, "has ended"},
        {{.kind = VD_WIRE_ERROR, .as.error = {VD_WIRE_FAULT_FULL, "is full"}},
         VD_CLIENT_REFUSED,
         "is full"},
        {{.kind = VD_WIRE_ERROR, .as.error = {VD_WIRE_FAULT_VERSION, "is old"}},
         VD_CLIENT_MISMATCHED,
         "is old"},
        {{.kind = VD_WIRE_ERROR, .as.error = {VD_WIRE_FAULT_INTERNAL, ""}},
         VD_CLIENT_LOST,
         "gave up"}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        start();
        say_in(0, &cases[i].message);
        expect(cases[i].state, cases[i].part);
    }
}

static void orders_replacements_and_drops(void **state) {
    (void)state;
    static uint8_t rgba[8 * 8 * 4];
    memset(rgba, 255, sizeof rgba);
    start();
    for (uint64_t id = 1; id <= 5; id++) {
        const vd_wire_message m = picture(id, 8, rgba);
        say_in((uint32_t)id, &m);
    }
    const uint64_t ids[] = {3, 1, 9, 1, 2}, out[] = {1, 3}, in[] = {4, 5}, gone[] = {2, 4, 77};
    const vd_wire_message order = {.kind = VD_WIRE_ORDER, .as.order = {.ids = {ids, 5}}},
                          replace = {.kind = VD_WIRE_REPLACE, .as.replace = {{out, 2}, {in, 2}}},
                          drop = {.kind = VD_WIRE_DROP, .as.drop = {gone, 3}};
    vd_camera camera = looking(vd_vec3_make(0, 0, 0));
    camera.eye = vd_vec3_make(0, 0, 0);
    camera.orientation = vd_orientation_from_angles(0.0, 0.0, 0.0);
    vd_client_shown shown;
    say_in(6, &order);
    assert_ok(vd_mirror_draw(e.mirror, NULL, &camera, e.frame, &shown));
    assert_int_equal(shown.quads,
                     4); /* what is not held is left out, what comes twice is drawn so */
    assert_int_equal(e.frame->rgba[4 * (e.frame->stride * (HEIGHT / 2) + WIDTH / 2)], 255);
    say_in(7, &replace);
    assert_int_equal(news().ordered, 4);
    assert_ok(vd_mirror_draw(e.mirror, NULL, &camera, e.frame, &shown));
    assert_int_equal(shown.quads, 3);
    say_in(8, &drop);
    assert_int_equal(news().held, 3);
    assert_int_equal(news().held_bytes, 3 * sizeof rgba);
    assert_ok(vd_mirror_draw(e.mirror, NULL, &camera, e.frame, &shown));
    assert_int_equal(shown.quads, 1);
    vd_mirror_leave(e.mirror);
    assert_true(vd_mirror_is_over(e.mirror));
    end();
}

/* A thousand replacements of a long order in one envelope. */
static void replacements_have_a_bound(void **state) {
    (void)state;
    static uint64_t ids[65000];
    static vd_wire_message many[1000];
    start();
    for (int i = 0; i < 65000; i++) {
        ids[i] = 100 + (uint64_t)i;
    }
    const vd_wire_message order = {.kind = VD_WIRE_ORDER, .as.order = {.ids = {ids, 65000}}};
    say_in(0, &order);
    for (int i = 0; i < 1000; i++) {
        many[i].kind = VD_WIRE_REPLACE;
        many[i].as.replace.out = (vd_wire_ids){ids + 3, 1};
    }
    assert_ok(vd_wire_encode(e.wire, VD_WIRE_SERVER, 0, many, 1000, &e.buffer));
    vd_mirror_receive(e.mirror, e.buffer.data, e.buffer.bytes, e.now_s);
    expect(VD_CLIENT_REFUSED, "few replacements");
}

/* Orders pictures, and returns how many are drawn. */
static int ordered(const uint64_t *ids, int count) {
    vd_camera camera = looking(vd_vec3_make(0, 0, 0));
    camera.eye = vd_vec3_make(0, 0, 0);
    camera.orientation = vd_orientation_from_angles(0.0, 0.0, 0.0);
    const vd_wire_message order = {.kind = VD_WIRE_ORDER, .as.order = {.ids = {ids, count}}};
    vd_client_shown shown;
    say_in(0, &order);
    assert_ok(vd_mirror_draw(e.mirror, NULL, &camera, e.frame, &shown));
    pass(0.01);
    return shown.quads;
}

/* The one in the picture's middle. */
static int middle(void) {
    return e.frame->rgba[4 * (e.frame->stride * (HEIGHT / 2) + WIDTH / 2)];
}

static void orders_have_a_bound(void **state) {
    (void)state;
    static uint8_t glass[8 * 8 * 4], white[8 * 8 * 4];
    static uint64_t ids[65536];
    memset(glass, 20, sizeof glass);
    memset(white, 255, sizeof white);
    start();
    vd_wire_message m = picture(1, 8, glass);
    for (int i = 0; i < 4; i++) { /* fills the screen */
        m.as.impostor.corners[i][0] *= 99;
        m.as.impostor.corners[i][2] *= 99;
    }
    say_in(0, &m);
    m.as.impostor.id = 2; /* behind the eye */
    for (int i = 0; i < 4; i++) {
        m.as.impostor.corners[i][1] = -9;
    }
    say_in(0, &m);
    m.as.impostor.id = 3; /* from behind to before the eye, but beside the picture */
    const float beside[4][3] = {{-99, -9, 9}, {-99, 9, 9}, {-99, 9, -9}, {-99, -9, -9}};
    memcpy(m.as.impostor.corners, beside, sizeof beside);
    say_in(0, &m);
    m = picture(4, 8, white);
    say_in(0, &m);
    for (int i = 0; i < 65536; i++) {
        ids[i] = 1;
    }
    ids[900] = 4; /* what comes when the screen was filled too often is left out */
    assert_int_equal(ordered(ids, 901), VD_DISPLAY_MOST_SCREENS);
    assert_true(middle() < 255);
    assert_int_equal(news().state, VD_CLIENT_SHOWING);
    assert_int_equal(news().ordered, 901);
    for (int i = 0; i < 60000; i++) {
        ids[i] = 2 + (uint64_t)(i & 1);
    }
    ids[60000] = 4; /* those before it fill nothing */
    assert_true(ordered(ids, 60001) >= 1);
    assert_int_equal(middle(), 255);
    assert_int_equal(news().state, VD_CLIENT_SHOWING);
    for (int i = 0; i < 65536; i++) {
        ids[i] = 1;
    }
    assert_int_equal(ordered(ids, 65536), VD_DISPLAY_MOST_SCREENS);
    assert_int_equal(news().ordered, 0);
    expect(VD_CLIENT_REFUSED, "a thousand times");
}

/* ---- addresses --------------------------------------------------------------------------------*/

static void addresses_are_read(void **state) {
    (void)state;
    vd_address a;
    assert_ok(vd_address_read("http://127.0.0.1:8080/#token=5c1b", &a));
    assert_true(!a.tls && a.port == 8080 && strcmp(a.host, "127.0.0.1") == 0);
    assert_string_equal(a.token, "5c1b");
    assert_string_equal(a.path, "/");
    assert_ok(vd_address_read("https://[::1]/at/here/#token=a-b_c.d~&camera=1,2", &a));
    assert_true(a.tls && a.port == 443 && strcmp(a.host, "::1") == 0);
    assert_string_equal(a.path, "/at/here/");
    assert_string_equal(a.token, "a-b_c.d~");
    assert_ok(vd_address_read("ws://host", &a));
    assert_true(a.port == 80 && a.token[0] == '\0');
    static const char *const wrong[] = {"",
                                        "host:80",
                                        "ftp://host/",
                                        "http://",
                                        "http://:80/",
                                        "http://ho st/",
                                        "http://[::1/",
                                        "http://host:0/",
                                        "http://host:99999/",
                                        "http://host:x/",
                                        "http://host/page",
                                        "http://host/a\r\nb/",
                                        "http://host/#token=",
                                        "http://host/#token=a b",
                                        "http://host/#secret"};
    for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; i++) {
        const vd_status status = vd_address_read(wrong[i], &a);
        assert_int_equal(status.code, VD_ERROR_ARGUMENT);
        assert_non_null(strstr(status.message, "veduta serve"));
    }
    char long_token[400] = "http://host/#token=";
    memset(long_token + 19, 'a', 300);
    assert_int_equal(vd_address_read(long_token, &a).code, VD_ERROR_ARGUMENT);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(it_shows_the_exact_picture_at_rest),
        cmocka_unit_test(it_shows_what_others_made),
        cmocka_unit_test(it_follows_a_moving_camera),
        cmocka_unit_test(screens_are_shown_turned),
        cmocka_unit_test(it_comes_back_with_what_it_holds),
        cmocka_unit_test(it_stays_within_its_memory),
        cmocka_unit_test(furniture_stays_on_screen),
        cmocka_unit_test(the_ground_is_known),
        cmocka_unit_test(a_wrong_token_is_refused),
        cmocka_unit_test(every_fault_has_a_sentence),
        cmocka_unit_test(goodbyes_are_told_apart),
        cmocka_unit_test(orders_replacements_and_drops),
        cmocka_unit_test(replacements_have_a_bound),
        cmocka_unit_test(orders_have_a_bound),
        cmocka_unit_test(addresses_are_read),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

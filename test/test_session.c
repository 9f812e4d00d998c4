/* One client's session, both ends in memory, over a link of a clock of its own. */
#include <math.h>
#include "session_client.h"
#include "session_scene.h"

enum { MOST_ON_LINK = 4096 };

typedef struct on_link {
    double at_s;
    vd_packet *packet; /* from the server; null: an acknowledgement of `batch` from the client */
    uint32_t batch;
} on_link;

typedef struct ends {
    vd_context *context;
    session_scene scene;
    vd_session *session;
    vd_wire *wire; /* the client's, to say things */
    vd_wire_buffer buffer;
    test_client client;
    vd_frame *frame, *perfect;
    /* The link. */
    double now_s, bytes_per_s, delay_s, free_s;
    bool silent; /* the client acknowledges nothing */
    on_link link[MOST_ON_LINK];
    int count;
    size_t most_in_flight, most_window;
} ends;

static ends e;

static void begin(const char *token) {
    memset(&e, 0, sizeof e);
    e.context = test_context(2, VD_ISA_AUTO);
    scene_begin(&e.scene, e.context, token);
    e.scene.def.name = "hills";
    e.now_s = 100.0;
    e.bytes_per_s = 10e6;
    e.delay_s = 0.01;
    assert_ok(vd_session_create(&e.scene.def, e.now_s, &e.session));
    assert_ok(vd_wire_create(e.context, &e.wire));
    assert_ok(vd_frame_create(e.context, WIDTH, HEIGHT, 0, &e.frame));
    assert_ok(vd_frame_create(e.context, WIDTH, HEIGHT, 0, &e.perfect));
    client_begin(&e.client, e.context);
}

static void end(void) {
    for (int i = 0; i < e.count; i++) {
        vd_release(e.context, e.link[i].packet);
    }
    client_end(&e.client);
    vd_session_destroy(&e.session);
    vd_wire_buffer_release(e.context, &e.buffer);
    vd_wire_destroy(&e.wire);
    vd_frame_destroy(&e.frame);
    vd_frame_destroy(&e.perfect);
    scene_end(&e.scene, e.context);
    vd_context_destroy(&e.context);
}

static void say(const vd_wire_message *message) {
    assert_ok(vd_wire_encode(e.wire, VD_WIRE_CLIENT, 0, message, 1, &e.buffer));
    vd_session_receive(e.session, e.buffer.data, e.buffer.bytes, e.now_s);
}

static void hello(const char *token) {
    const vd_wire_message m = client_hello(token);
    say(&m);
}

static void settings(vd_wire_mode mode, unsigned codecs) {
    const vd_wire_message m = {
        .kind = VD_WIRE_SETTINGS,
        .as.settings = {.mode = mode, .tolerance_px = 1.0f, .codecs = codecs}};
    say(&m);
}

static void look(const vd_camera *camera) {
    const vd_wire_message m = client_camera(&e.client, camera, WIDTH, HEIGHT, e.now_s);
    say(&m);
}

static void put(double at_s, vd_packet *packet, uint32_t batch) {
    assert_true(e.count < MOST_ON_LINK);
    e.link[e.count++] = (on_link){at_s, packet, batch};
}

/* What the session has to say goes onto the link. */
static void depart(void) {
    for (vd_packet *p = vd_session_take(e.session); p != NULL; p = vd_session_take(e.session)) {
        e.free_s = (e.free_s > e.now_s ? e.free_s : e.now_s) + (double)p->bytes / e.bytes_per_s;
        put(e.free_s + e.delay_s, p, 0);
    }
}

/* What has arrived by now is taken in, in order. */
static void arrive(void) {
    for (int i = 0; i < e.count;) {
        const on_link at = e.link[i];
        if (at.at_s > e.now_s) {
            i++;
            continue;
        }
        e.count--;
        memmove(e.link + i, e.link + i + 1, (size_t)(e.count - i) * sizeof at);
        if (at.packet == NULL) {
            const vd_wire_message m = {
                .kind = VD_WIRE_ACKNOWLEDGE,
                .as.acknowledge = {.batch = at.batch, .held_bytes = e.client.bytes}};
            say(&m);
            continue;
        }
        const uint32_t batch =
            client_receive(&e.client, at.packet->data + VD_PACKET_HEAD, at.packet->bytes);
        vd_release(e.context, at.packet);
        if (batch != 0 && !e.silent) {
            put(at.at_s + e.delay_s, NULL, batch);
        }
    }
}

/* So much time passes, in steps of 5 ms. */
static void pass(double seconds) {
    const double until_s = e.now_s + seconds;
    while (e.now_s < until_s) {
        e.now_s += 0.005;
        arrive();
        vd_session_work(e.session, NULL, e.now_s);
        const vd_session_stats stats = vd_session_get_stats(e.session);
        const size_t most = stats.window_bytes > e.most_window ? stats.window_bytes : e.most_window;
        e.most_window = most;
        if (stats.in_flight_bytes > e.most_in_flight) {
            e.most_in_flight = stats.in_flight_bytes;
        }
        depart();
    }
}

static void assert_exact(const vd_camera *camera) {
    assert_ok(vd_world_renderer_draw(e.scene.renderer, NULL, camera, e.perfect, NULL));
    assert_true(e.client.screen_exact && e.client.screen_camera == e.client.sequence);
    assert_true(vd_frame_hash(e.client.screen) == vd_frame_hash(e.perfect));
}

static void expect_fault(vd_wire_fault fault) {
    vd_session_work(e.session, NULL, e.now_s);
    depart();
    e.now_s += 1.0;
    arrive();
    if (e.client.fault != (int)fault) {
        fail_msg("error %d (%s), not %d", e.client.fault, e.client.sentence, (int)fault);
    }
    assert_true(strlen(e.client.sentence) > 10);
    assert_true(vd_session_is_over(e.session));
    /* What comes after is not looked at. */
    hello("secret");
    vd_session_work(e.session, NULL, e.now_s);
    assert_null(vd_session_take(e.session));
    end();
}

/* ---- what it is for ---------------------------------------------------------------------------*/

static void it_settles_to_the_exact_picture(void **state) {
    (void)state;
    begin("secret");
    hello("secret");
    settings(VD_WIRE_MODE_IMPOSTORS, 0);
    vd_camera camera = looking(vd_vec3_make(0, 0, 0));
    look(&camera);
    pass(0.5);
    assert_int_equal(e.client.hellos, 1);
    assert_true(e.client.orders > 0 && e.client.pictures > 10);
    assert_exact(&camera);
    client_show(&e.client, &camera, e.frame);
    assert_true(vd_frame_error(e.frame, e.perfect) < 0.25);
    /* Nothing more is said while nothing changes, not even for a new number of the same view. */
    const int batches = e.client.batches;
    const int stats = e.client.stats;
    pass(0.5);
    const vd_wire_message again = client_camera(&e.client, &camera, WIDTH, HEIGHT, e.now_s);
    say(&again);
    pass(0.2);
    assert_int_equal(e.client.batches, batches);
    assert_true(e.client.stats > stats); /* it is answered */
    /* Another one. */
    camera.eye.x += 30.0;
    look(&camera);
    pass(0.6);
    assert_exact(&camera);
    end();
}

static void it_follows_a_moving_camera(void **state) {
    (void)state;
    begin(NULL);
    hello("");
    settings(VD_WIRE_MODE_IMPOSTORS, VD_CODEC_BIT(VD_CODEC_RUNS_ZSTD));
    vd_camera camera = looking(vd_vec3_make(0, 0, 0));
    double sum = 0.0;
    int seen = 0;
    const int steps = test_is_reduced() ? 50 : 120;
    for (int i = 0; i < steps; i++) {
        camera.eye = vd_vec3_add(camera.eye, vd_vec3_make(0.3, 0.5, 0.05));
        camera.orientation = vd_orientation_from_angles(0.1 + 0.004 * i, -0.25, 0.0);
        look(&camera);
        pass(1.0 / 60);
        if (i > 20 && !e.client.screen_shown) {
            client_show(&e.client, &camera, e.frame);
            assert_ok(vd_world_renderer_draw(e.scene.renderer, NULL, &camera, e.perfect, NULL));
            sum += vd_frame_error(e.frame, e.perfect);
            seen++;
        }
    }
    assert_true(seen > steps / 2 - 10);
    assert_true(sum / seen < 0.25);
    assert_true(e.client.most_bytes < (size_t)64 << 20);
    pass(1.0);
    assert_exact(&camera);
    end();
}

static void screens_are_lossy_then_exact(void **state) {
    (void)state;
    begin(NULL);
    hello(NULL);
    settings(VD_WIRE_MODE_SCREENS, 0);
    vd_camera camera = looking(vd_vec3_make(0, 0, 0));
    for (int i = 0; i < 20; i++) {
        camera.eye.x += 1.0;
        look(&camera);
        pass(0.02);
        assert_false(e.client.screen_exact);
    }
    assert_true(e.client.screens > 5 && e.client.orders == 0 && e.client.pictures == 0);
    pass(0.4);
    assert_exact(&camera);
    /* The other mode, and back. */
    settings(VD_WIRE_MODE_IMPOSTORS, 0);
    pass(0.5);
    assert_true(e.client.orders > 0);
    settings(VD_WIRE_MODE_SCREENS, 0);
    pass(0.5);
    assert_exact(&camera);
    end();
}

/* ---- slow, silent, small ----------------------------------------------------------------------*/

static void a_slow_link_has_a_short_queue(void **state) {
    (void)state;
    begin(NULL);
    e.bytes_per_s = 300e3;
    e.delay_s = 0.075;
    hello(NULL);
    settings(VD_WIRE_MODE_IMPOSTORS, VD_CODEC_BIT(VD_CODEC_RUNS));
    vd_camera camera = looking(vd_vec3_make(0, 0, 0));
    double worst_s = 0.0;
    for (int i = 0; i < (test_is_reduced() ? 60 : 150); i++) {
        camera.eye = vd_vec3_add(camera.eye, vd_vec3_make(0.6, 1.0, 0.1));
        camera.orientation = vd_orientation_from_angles(0.1 + 0.03 * i, -0.25, 0.0);
        look(&camera);
        pass(1.0 / 30);
        worst_s = fmax(worst_s, e.free_s - e.now_s);
    }
    /* What is in the window, and the turn that filled it. */
    assert_true(e.most_in_flight < e.most_window + 3 * VD_WIRE_BATCH_BYTES);
    assert_true(worst_s < 2.0);
    const double link = vd_session_get_stats(e.session).link_bytes_per_s;
    assert_true(link > 100e3 && link < 600e3);
    pass(5.0);
    assert_exact(&camera);
    end();
}

static void a_limit_is_kept(void **state) {
    (void)state;
    begin(NULL);
    vd_session_destroy(&e.session);
    e.scene.def.bytes_per_s = 50e3;
    assert_ok(vd_session_create(&e.scene.def, e.now_s, &e.session));
    hello(NULL);
    settings(VD_WIRE_MODE_SCREENS, 0);
    vd_camera camera = looking(vd_vec3_make(0, 0, 0));
    for (int i = 0; i < (test_is_reduced() ? 60 : 300); i++) {
        camera.eye.x += 1.0;
        look(&camera);
        pass(0.02);
    }
    assert_true((double)vd_session_get_stats(e.session).bytes_sent <
                50e3 * (e.now_s - 100.0) + 50e3);
    end();
}

static void who_does_not_take_in_is_let_go(void **state) {
    (void)state;
    begin(NULL);
    e.silent = true;
    hello(NULL);
    settings(VD_WIRE_MODE_SCREENS, VD_CODEC_BIT(VD_CODEC_RAW));
    vd_camera camera = looking(vd_vec3_make(0, 0, 0));
    for (int i = 0; i < 320 && e.client.fault == 0; i++) {
        camera.eye.x += 1.0;
        look(&camera);
        pass(0.1);
        assert_true(vd_session_get_stats(e.session).in_flight_bytes < (size_t)2 << 20);
    }
    assert_int_equal(e.client.fault, VD_WIRE_FAULT_SLOW);
    assert_true(vd_session_is_over(e.session));
    end();
}

static void who_is_silent_is_asked_and_let_go(void **state) {
    (void)state;
    begin(NULL);
    pass(5.5);
    assert_int_equal(e.client.fault, VD_WIRE_FAULT_SLOW); /* no hello */
    end();
    begin(NULL);
    hello(NULL);
    pass(16.0);
    assert_true(e.client.pings == 1 && e.client.fault == 0);
    const vd_wire_message pong = {.kind = VD_WIRE_PONG, .as.pong = {1}};
    say(&pong);
    pass(29.0);
    assert_true(e.client.fault == 0);
    pass(2.0);
    assert_int_equal(e.client.fault, VD_WIRE_FAULT_SLOW);
    end();
}

static void a_small_memory_is_kept(void **state) {
    (void)state;
    begin(NULL);
    vd_wire_message m = client_hello(NULL);
    m.as.hello.memory_bytes = (uint64_t)4 << 20;
    say(&m);
    settings(VD_WIRE_MODE_IMPOSTORS, 0);
    vd_camera camera = looking(vd_vec3_make(0, 0, 0));
    camera.lens = vd_lens_from_fov(0.9, 480, 320);
    for (int i = 0; i < (test_is_reduced() ? 30 : 60); i++) {
        camera.orientation = vd_orientation_from_angles(0.1 * i, -0.25, 0.0);
        const vd_wire_message turned = client_camera(&e.client, &camera, 480, 320, e.now_s);
        say(&turned);
        pass(0.05);
    }
    assert_true(e.client.most_bytes <= (size_t)4 << 20);
    assert_true(e.client.drops > 0);
    end();
    begin(NULL);
    m.as.hello.memory_bytes = (uint64_t)1 << 20;
    say(&m);
    expect_fault(VD_WIRE_FAULT_TOO_MUCH);
}

static void what_is_forgotten_comes_again(void **state) {
    (void)state;
    begin(NULL);
    hello(NULL);
    settings(VD_WIRE_MODE_IMPOSTORS, 0);
    vd_camera camera = looking(vd_vec3_make(0, 0, 0));
    look(&camera);
    pass(0.5);
    uint64_t ids[MOST_HELD];
    const int count = e.client.count;
    for (int i = 0; i < count; i++) {
        ids[i] = e.client.items[i].id;
    }
    client_forget(&e.client);
    const vd_wire_message drop = {.kind = VD_WIRE_DROP, .as.drop = {ids, count}};
    say(&drop);
    camera.eye.x += 0.5;
    look(&camera);
    pass(0.6);
    assert_true(e.client.count > count / 2);
    client_show(&e.client, &camera, e.frame);
    assert_exact(&camera);
    end();
}

/* ---- coming back ------------------------------------------------------------------------------*/

static void who_comes_back_goes_on(void **state) {
    (void)state;
    for (int known = 0; known < 2; known++) {
        begin(NULL);
        e.scene.def.seed = 1000;
        vd_session_destroy(&e.session);
        assert_ok(vd_session_create(&e.scene.def, e.now_s, &e.session));
        hello(NULL);
        settings(VD_WIRE_MODE_IMPOSTORS, 0);
        const vd_camera camera = looking(vd_vec3_make(0, 0, 0));
        look(&camera);
        pass(0.5);
        const int pictures = e.client.pictures, count = e.client.count;
        assert_true(pictures > 10);
        /* The connection breaks. */
        vd_session *past = e.session;
        e.session = NULL;
        e.scene.def.seed = 2000;
        e.client.batch = e.client.sequence = 0;
        client_drop(&e.client, e.client.items[count / 2].id);
        assert_ok(vd_session_create(&e.scene.def, e.now_s, &e.session));
        uint64_t ids[MOST_HELD];
        uint32_t versions[MOST_HELD];
        for (int i = 0; i < e.client.count; i++) {
            ids[i] = e.client.items[i].id;
            versions[i] = e.client.items[i].version;
        }
        vd_wire_message m = client_hello(NULL);
        m.as.hello.held = (vd_wire_ids){ids, e.client.count};
        m.as.hello.held_versions = versions;
        say(&m);
        assert_true(vd_session_wants_past(e.session));
        if (known == 1) {
            assert_true(vd_session_takes_past(e.session, past));
        }
        vd_session_destroy(&past);
        settings(VD_WIRE_MODE_IMPOSTORS, 0);
        look(&camera);
        pass(0.6);
        const int again = e.client.pictures - pictures;
        assert_true(known == 1 ? again <= 4 : again > 10);
        assert_true(known == 1 ? e.client.drops == 0 : e.client.drops > 10);
        assert_exact(&camera);
        client_show(&e.client, &camera, e.frame);
        end();
    }
}

/* ---- hostile ----------------------------------------------------------------------------------*/

static void what_is_wrong_ends_it(void **state) {
    (void)state;
    vd_camera camera = looking(vd_vec3_make(0, 0, 0));
    static const char *const tokens[] = {"", "secre", "secret1", "Secret", "xxxxxx"};
    for (int i = 0; i < 5; i++) {
        begin("secret");
        hello(tokens[i]);
        expect_fault(VD_WIRE_FAULT_TOKEN);
    }
    begin("secret");
    vd_wire_message old = client_hello("secret");
    old.as.hello.version = 77;
    say(&old);
    expect_fault(VD_WIRE_FAULT_VERSION);
    begin(NULL);
    look(&camera);
    expect_fault(VD_WIRE_FAULT_OUT_OF_TURN);
    begin(NULL);
    hello(NULL);
    hello(NULL);
    expect_fault(VD_WIRE_FAULT_OUT_OF_TURN);
    begin(NULL);
    hello(NULL);
    look(&camera);
    e.client.sequence = 0;
    look(&camera);
    expect_fault(VD_WIRE_FAULT_OUT_OF_TURN);
    begin(NULL);
    hello(NULL);
    const vd_wire_message ack = {.kind = VD_WIRE_ACKNOWLEDGE, .as.acknowledge = {.batch = 7}};
    say(&ack);
    expect_fault(VD_WIRE_FAULT_OUT_OF_TURN);
    begin(NULL);
    hello(NULL);
    vd_wire_message huge = client_camera(&e.client, &camera, 16383, 16383, 0.0);
    say(&huge);
    expect_fault(VD_WIRE_FAULT_TOO_MUCH);
    begin(NULL);
    hello(NULL);
    for (int i = 0; i < 2100; i++) {
        look(&camera);
    }
    expect_fault(VD_WIRE_FAULT_TOO_MUCH);
    begin(NULL);
    uint64_t random = 4;
    uint8_t noise[300];
    for (int i = 0; i < 300; i++) {
        noise[i] = (uint8_t)(256 * test_uniform(&random));
    }
    vd_session_receive(e.session, noise, sizeof noise, e.now_s);
    expect_fault(VD_WIRE_FAULT_MALFORMED);
}

static void who_says_bye_is_gone(void **state) {
    (void)state;
    begin(NULL);
    hello(NULL);
    const vd_wire_message bye = {.kind = VD_WIRE_BYE, .as.bye = {VD_WIRE_DONE, "tab closed"}};
    say(&bye);
    assert_true(vd_session_is_over(e.session));
    end();
    begin(NULL);
    hello(NULL);
    vd_session_stop(e.session, VD_WIRE_STOPPING, "the server stops");
    depart();
    e.now_s += 1.0;
    arrive();
    assert_int_equal(e.client.bye, VD_WIRE_STOPPING);
    assert_true(vd_session_is_over(e.session));
    end();
}

/* Anything in any order: no crash, and always an end or an answer. */
static void random_messages_do_no_harm(void **state) {
    (void)state;
    uint64_t random = 11;
    for (int round = 0; round < (test_is_reduced() ? 5 : 20); round++) {
        begin(NULL);
        hello(NULL);
        for (int i = 0; i < 60 && !vd_session_is_over(e.session); i++) {
            vd_camera camera = looking(vd_vec3_make(0, 0, 0));
            const uint64_t ids[2] = {(uint64_t)(1 + 1e6 * test_uniform(&random)),
                                     (uint64_t)255 << 56 | 7};
            camera.eye.x += 1e6 * (test_uniform(&random) - 0.5);
            camera.eye.z += 1e8 * pow(test_uniform(&random), 9.0);
            camera.lens.fx *= pow(10.0, 6.0 * test_uniform(&random) - 3.0);
            camera.lens.cx += 1e3 * (test_uniform(&random) - 0.5);
            camera.orientation = vd_orientation_from_angles(6.0 * test_uniform(&random),
                                                            3.0 * test_uniform(&random) - 1.5, 0.0);
            vd_wire_message m =
                client_camera(&e.client, &camera, 1 + (int)(200 * test_uniform(&random)),
                              1 + (int)(200 * test_uniform(&random)), e.now_s);
            const vd_wire_message drop = {.kind = VD_WIRE_DROP, .as.drop = {ids, 2}};
            say(test_uniform(&random) < 0.7 ? &m : &drop);
            if (test_uniform(&random) < 0.2) {
                settings(
                    test_uniform(&random) < 0.5 ? VD_WIRE_MODE_SCREENS : VD_WIRE_MODE_IMPOSTORS, 0);
            }
            e.now_s += 0.01;
            vd_session_work(e.session, NULL, e.now_s);
            for (vd_packet *p = vd_session_take(e.session); p != NULL;
                 p = vd_session_take(e.session)) {
                vd_wire_envelope envelope;
                assert_ok(vd_wire_decode(e.client.wire, VD_WIRE_SERVER, p->data + VD_PACKET_HEAD,
                                         p->bytes, &envelope));
                if (envelope.batch != 0) {
                    const vd_wire_message ack = {.kind = VD_WIRE_ACKNOWLEDGE,
                                                 .as.acknowledge = {.batch = envelope.batch}};
                    vd_release(e.context, p);
                    say(&ack);
                } else {
                    vd_release(e.context, p);
                }
            }
        }
        end();
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(it_settles_to_the_exact_picture),
                                       cmocka_unit_test(it_follows_a_moving_camera),
                                       cmocka_unit_test(screens_are_lossy_then_exact),
                                       cmocka_unit_test(a_slow_link_has_a_short_queue),
                                       cmocka_unit_test(a_limit_is_kept),
                                       cmocka_unit_test(who_does_not_take_in_is_let_go),
                                       cmocka_unit_test(who_is_silent_is_asked_and_let_go),
                                       cmocka_unit_test(a_small_memory_is_kept),
                                       cmocka_unit_test(what_is_forgotten_comes_again),
                                       cmocka_unit_test(who_comes_back_goes_on),
                                       cmocka_unit_test(what_is_wrong_ends_it),
                                       cmocka_unit_test(who_says_bye_is_gone),
                                       cmocka_unit_test(random_messages_do_no_harm)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}

/* mirror_ends.h: both ends of a connection without one: a session and the mirror of its client. */
#ifndef VEDUTA_TEST_MIRROR_ENDS_H
#define VEDUTA_TEST_MIRROR_ENDS_H

#include "remote/mirror.h"
#include "session_scene.h"

typedef struct ends {
    vd_context *context;
    session_scene scene;
    vd_session *session; /* null: only what a test says */
    vd_mirror *mirror;
    vd_wire *wire; /* of a server that a test plays */
    vd_wire_buffer buffer;
    vd_frame *frame, *perfect;
    double now_s;
    void (*said)(const vd_packet *packet); /* looks at what the session says; null: nobody does */
} ends;

static ends e;

/* `serve`: a session stands at the other end, which wants the mirror's token. */
static inline void begin_ends(const vd_mirror_def *mirror, int width, int height, bool serve) {
    memset(&e, 0, sizeof e);
    e.now_s = 100.0;
    e.context = test_context(2, VD_ISA_AUTO);
    assert_ok(vd_mirror_create(e.context, mirror, &e.mirror));
    assert_ok(vd_wire_create(e.context, &e.wire));
    assert_ok(vd_frame_create(e.context, width, height, 0, &e.frame));
    assert_ok(vd_frame_create(e.context, width, height, 0, &e.perfect));
    if (serve) {
        scene_begin(&e.scene, e.context, mirror->token);
        e.scene.def.seed = 1000;
        assert_ok(vd_session_create(&e.scene.def, e.now_s, &e.session));
    }
    vd_mirror_open(e.mirror, e.now_s);
}

static inline void end(void) {
    vd_mirror_destroy(&e.mirror);
    vd_session_destroy(&e.session);
    vd_wire_buffer_release(e.context, &e.buffer);
    vd_wire_destroy(&e.wire);
    if (e.scene.renderer != NULL) {
        scene_end(&e.scene, e.context);
    }
    vd_frame_destroy(&e.frame);
    vd_frame_destroy(&e.perfect);
    vd_context_destroy(&e.context);
}

/* So much time passes: both work, and what they say arrives at once. */
static inline void pass(double seconds) {
    for (const double until_s = e.now_s + seconds; e.now_s < until_s; e.now_s += 0.005) {
        vd_mirror_work(e.mirror, e.now_s);
        for (vd_packet *p = vd_mirror_take(e.mirror); p != NULL; p = vd_mirror_take(e.mirror)) {
            if (e.session != NULL) {
                vd_session_receive(e.session, p->data + VD_PACKET_HEAD, p->bytes, e.now_s);
            }
            vd_release(e.context, p);
        }
        if (e.session == NULL) {
            continue;
        }
        vd_session_work(e.session, NULL, e.now_s);
        for (vd_packet *p = vd_session_take(e.session); p != NULL; p = vd_session_take(e.session)) {
            if (e.said != NULL) {
                e.said(p);
            }
            vd_mirror_receive(e.mirror, p->data + VD_PACKET_HEAD, p->bytes, e.now_s);
            vd_release(e.context, p);
        }
    }
}

static inline vd_client_news news(void) {
    vd_client_news out;
    vd_mirror_get_news(e.mirror, &out);
    return out;
}

/* Draws both and returns the error. */
static inline double compare(const vd_camera *camera, vd_client_shown *shown) {
    assert_ok(vd_mirror_draw(e.mirror, NULL, camera, e.frame, shown));
    assert_ok(vd_world_renderer_draw(e.scene.renderer, NULL, camera, e.perfect, NULL));
    return vd_frame_error(e.frame, e.perfect);
}

/* ---- a server that a test plays ---- */

static inline void say_in(uint32_t batch, const vd_wire_message *message) {
    assert_ok(vd_wire_encode(e.wire, VD_WIRE_SERVER, batch, message, 1, &e.buffer));
    vd_mirror_receive(e.mirror, e.buffer.data, e.buffer.bytes, e.now_s);
}

static inline void say(const vd_wire_message *message) {
    say_in(0, message);
}

static inline void say_hello(void) {
    const vd_wire_message hello = {.kind = VD_WIRE_HELLO,
                                   .as.hello = {.version = VD_WIRE_VERSION, .name = "played"}};
    say(&hello);
    pass(0.01);
}

/* Draws; returns how many pixels show something. */
static inline int drawn(const vd_camera *camera, vd_client_shown *shown) {
    assert_ok(vd_mirror_draw(e.mirror, NULL, camera, e.frame, shown));
    int pixels = 0;
    for (int y = 0; y < e.frame->height; y++) {
        for (int x = 0; x < e.frame->width; x++) {
            pixels += e.frame->rgba[4 * (e.frame->stride * (size_t)y + (size_t)x) + 3] != 0;
        }
    }
    return pixels;
}

/* Says something and expects to be told that it was wrong. */
static inline void refuse(const vd_wire_message *m, const char *part) {
    say(m);
    const vd_client_news n = news();
    if (n.state != VD_CLIENT_REFUSED || strstr(n.sentence, part) == NULL) {
        fail_msg("%s: %s", vd_client_state_name(n.state), n.sentence);
    }
    end();
}

#endif

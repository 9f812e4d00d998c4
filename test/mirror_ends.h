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

#endif

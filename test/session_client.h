/* session_client.h: the client's end of a session, for tests: takes envelopes in, keeps pictures,
 * shows them. It checks whatever it can. */
#ifndef VEDUTA_TEST_SESSION_CLIENT_H
#define VEDUTA_TEST_SESSION_CLIENT_H

#include <veduta/wire.h>
#include "held.h"
#include "raster_scenes.h"

typedef struct test_client {
    vd_context *context;
    vd_wire *wire;
    vd_coder *coder;
    vd_display *display;
    held items[MOST_HELD]; /* by ascending id */
    int count;
    uint64_t order[MOST_HELD];
    int order_count;
    size_t bytes, most_bytes;
    uint32_t batch;    /* the last that came */
    uint32_t sequence; /* of the last camera sent */
    vd_frame *screen;  /* the last, null: none */
    uint32_t screen_camera;
    bool screen_exact, screen_shown;
    int hellos, orders, screens, pictures, drops, pongs, pings, stats, batches;
    int fault, bye; /* of the last error or bye; 0: none */
    char sentence[VD_MESSAGE_BYTES];
} test_client;

static inline void client_begin(test_client *c, vd_context *context) {
    memset(c, 0, sizeof *c);
    c->context = context;
    assert_ok(vd_wire_create(context, &c->wire));
    assert_ok(vd_coder_create(context, &c->coder));
    assert_ok(vd_display_create(context, &c->display));
}

static inline void client_forget(test_client *c) {
    for (int i = 0; i < c->count; i++) {
        free(c->items[i].rgba);
    }
    c->count = c->order_count = 0;
    c->bytes = 0;
}

static inline void client_end(test_client *c) {
    client_forget(c);
    vd_frame_destroy(&c->screen);
    vd_display_destroy(&c->display);
    vd_coder_destroy(&c->coder);
    vd_wire_destroy(&c->wire);
}

/* Where an id is or would be. */
static inline int client_place(const test_client *c, uint64_t id) {
    int low = 0, high = c->count;
    while (low < high) {
        const int middle = (low + high) / 2;
        if (c->items[middle].id < id) {
            low = middle + 1;
        } else {
            high = middle;
        }
    }
    return low;
}

static inline held *client_find(test_client *c, uint64_t id) {
    const int at = client_place(c, id);
    return at < c->count && c->items[at].id == id ? &c->items[at] : NULL;
}

static inline void client_drop(test_client *c, uint64_t id) {
    held *h = client_find(c, id);
    if (h != NULL) {
        c->bytes -= 4 * h->picture.stride * (size_t)h->picture.height;
        free(h->rgba);
        c->count--;
        memmove(h, h + 1, (size_t)(c->count - (h - c->items)) * sizeof *h);
    }
}

static inline void client_keep(test_client *c, const vd_wire_impostor *m) {
    const size_t bytes = 4 * (size_t)m->width * (size_t)m->height;
    held made = {.id = m->id, .version = m->version, .rgba = malloc(bytes)};
    made.picture = (vd_quad_picture){
        .rgba = made.rgba, .width = m->width, .height = m->height, .stride = (size_t)m->width};
    memcpy(made.picture.opaque, m->opaque, sizeof m->opaque);
    for (int i = 0; i < 4; i++) {
        made.corners[i] =
            vd_vec3_add(m->origin, vd_vec3_make((double)m->corners[i][0], (double)m->corners[i][1],
                                                (double)m->corners[i][2]));
    }
    assert_ok(vd_coder_decode(c->coder, m->codec, m->picture.data, m->picture.bytes, m->width,
                              m->height, made.rgba, (size_t)m->width));
    client_drop(c, m->id);
    assert_true(c->count < MOST_HELD);
    const int at = client_place(c, m->id);
    memmove(c->items + at + 1, c->items + at, (size_t)(c->count - at) * sizeof made);
    c->items[at] = made;
    c->count++;
    c->bytes += bytes;
    c->most_bytes = c->bytes > c->most_bytes ? c->bytes : c->most_bytes;
    c->pictures++;
}

static inline void client_screen(test_client *c, const vd_wire_screen *m) {
    if (c->screen == NULL || c->screen->width != m->width || c->screen->height != m->height) {
        vd_frame_destroy(&c->screen);
        assert_ok(vd_frame_create(c->context, m->width, m->height, 0, &c->screen));
    }
    assert_ok(vd_coder_decode(c->coder, m->codec, m->picture.data, m->picture.bytes, m->width,
                              m->height, c->screen->rgba, c->screen->stride));
    c->screen_camera = m->camera;
    c->screen_exact = m->exact;
    c->screen_shown = true;
    c->screens++;
}

static inline void client_take(test_client *c, const vd_wire_message *m) {
    switch (m->kind) {
    case VD_WIRE_HELLO:
        c->hellos++;
        assert_int_equal(m->as.hello.version, VD_WIRE_VERSION);
        break;
    case VD_WIRE_IMPOSTOR:
        client_keep(c, &m->as.impostor);
        break;
    case VD_WIRE_ORDER:
        c->orders++;
        assert_true(m->as.order.ids.count <= MOST_HELD && m->as.order.camera <= c->sequence);
        c->order_count = m->as.order.ids.count;
        memcpy(c->order, m->as.order.ids.ids, (size_t)c->order_count * sizeof(uint64_t));
        for (int i = 0; i < c->order_count; i++) {
            assert_non_null(client_find(c, c->order[i]));
        }
        c->screen_shown = false;
        break;
    case VD_WIRE_DROP:
        for (int i = 0; i < m->as.drop.count; i++) {
            client_drop(c, m->as.drop.ids[i]);
        }
        c->drops += m->as.drop.count;
        break;
    case VD_WIRE_SCREEN:
        client_screen(c, &m->as.screen);
        break;
    case VD_WIRE_ERROR:
        c->fault = (int)m->as.error.code;
        (void)snprintf(c->sentence, sizeof c->sentence, "%s", m->as.error.sentence);
        break;
    case VD_WIRE_BYE:
        c->bye = (int)m->as.bye.reason;
        break;
    case VD_WIRE_PONG:
        c->pongs++;
        break;
    case VD_WIRE_PING:
        c->pings++;
        break;
    case VD_WIRE_STATS:
        c->stats++;
        break;
    default:
        fail_msg("a server said %s", vd_wire_kind_name(m->kind));
    }
}

/* Takes an envelope in; returns its batch. */
static inline uint32_t client_receive(test_client *c, const void *data, size_t bytes) {
    vd_wire_envelope envelope;
    assert_ok(vd_wire_decode(c->wire, VD_WIRE_SERVER, data, bytes, &envelope));
    for (int i = 0; i < envelope.count; i++) {
        client_take(c, &envelope.messages[i]);
    }
    if (envelope.batch != 0) {
        assert_int_equal(envelope.batch, c->batch + 1);
        c->batch = envelope.batch;
        c->batches++;
    }
    return envelope.batch;
}

/* What is on screen without the exact picture. */
static inline void client_show(test_client *c, const vd_camera *camera, vd_frame *frame) {
    static vd_quad quads[MOST_HELD];
    for (int i = 0; i < c->order_count; i++) {
        const held *h = client_find(c, c->order[i]);
        assert_non_null(h);
        quads[i] = (vd_quad){.picture = h->picture, .opacity = 255};
        assert_ok(vd_quad_place(&quads[i], camera, h->corners));
    }
    memset(frame->rgba, 0, 4 * frame->stride * (size_t)frame->height);
    assert_ok(vd_display_draw(c->display, NULL, frame, quads, c->order_count, NULL));
}

static inline vd_wire_message client_hello(const char *token) {
    return (vd_wire_message){.kind = VD_WIRE_HELLO,
                             .as.hello = {.version = VD_WIRE_VERSION,
                                          .capabilities = VD_CODEC_ALL | VD_WIRE_SCREENS,
                                          .token = token,
                                          .memory_bytes = (uint64_t)64 << 20,
                                          .width = 150,
                                          .height = 110,
                                          .name = "test"}};
}

static inline vd_wire_message client_camera(test_client *c, const vd_camera *camera, int width,
                                            int height, double time_s) {
    vd_wire_message m = {.kind = VD_WIRE_CAMERA};
    m.as.camera = (vd_wire_camera){.sequence = ++c->sequence,
                                   .camera = *camera,
                                   .width = width,
                                   .height = height,
                                   .time_s = time_s};
    return m;
}

#endif

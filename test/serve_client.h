/* serve_client.h: a real client of a real server: a WebSocket by libwebsockets, one connection, no
 * threads. */
#ifndef VEDUTA_TEST_SERVE_CLIENT_H
#define VEDUTA_TEST_SERVE_CLIENT_H

#include <libwebsockets.h>
#include <stdlib.h>
#include <time.h>
#include "session_client.h"

typedef struct sent {
    struct sent *next;
    size_t bytes;
    uint8_t data[]; /* LWS_PRE, then [bytes] */
} sent;

typedef struct connection {
    struct lws_context *network;
    struct lws *wsi;
    bool open, closed, silent; /* silent: nothing is acknowledged */
    test_client client;
    vd_wire *wire;
    vd_wire_buffer buffer;
    sent *first, **end;
    uint8_t *partial;
    size_t bytes, room;
} connection;

static inline double clock_s(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static inline void connection_send(connection *c, const void *data, size_t bytes) {
    sent *s = malloc(sizeof *s + LWS_PRE + bytes);
    assert_non_null(s);
    s->next = NULL;
    s->bytes = bytes;
    memcpy(s->data + LWS_PRE, data, bytes);
    *c->end = s;
    c->end = &s->next;
    if (c->open && !c->closed) {
        (void)lws_callback_on_writable(c->wsi);
    }
}

static inline void connection_say(connection *c, const vd_wire_message *message) {
    assert_ok(vd_wire_encode(c->wire, VD_WIRE_CLIENT, 0, message, 1, &c->buffer));
    connection_send(c, c->buffer.data, c->buffer.bytes);
}

static inline void connection_take(connection *c, const void *in, size_t length, bool last) {
    if (c->bytes + length > c->room) {
        c->room = 2 * (c->bytes + length);
        c->partial = realloc(c->partial, c->room);
        assert_non_null(c->partial);
    }
    memcpy(c->partial + c->bytes, in, length);
    c->bytes += length;
    if (last) {
        const uint32_t batch = client_receive(&c->client, c->partial, c->bytes);
        c->bytes = 0;
        if (batch != 0 && !c->silent) {
            const vd_wire_message m = {
                .kind = VD_WIRE_ACKNOWLEDGE,
                .as.acknowledge = {.batch = batch, .held_bytes = c->client.bytes}};
            connection_say(c, &m);
        }
    }
}

static int connection_callback(struct lws *wsi, enum lws_callback_reasons reason, void *user,
                               void *in, size_t length) {
    connection *c = lws_context_user(lws_get_context(wsi));
    (void)user;
    switch (reason) {
    case LWS_CALLBACK_CLIENT_ESTABLISHED:
        c->open = true;
        (void)lws_callback_on_writable(wsi);
        break;
    case LWS_CALLBACK_CLIENT_RECEIVE:
        connection_take(c, in, length,
                        lws_is_final_fragment(wsi) && lws_remaining_packet_payload(wsi) == 0);
        break;
    case LWS_CALLBACK_CLIENT_WRITEABLE:
        if (c->first != NULL) {
            sent *s = c->first;
            c->first = s->next;
            c->end = c->first != NULL ? c->end : &c->first;
            const int wrote = lws_write(wsi, s->data + LWS_PRE, s->bytes, LWS_WRITE_BINARY);
            free(s);
            if (wrote < 0) {
                return -1;
            }
            (void)lws_callback_on_writable(wsi);
        }
        break;
    case LWS_CALLBACK_CLIENT_CONNECTION_ERROR:
    case LWS_CALLBACK_CLIENT_CLOSED:
        c->closed = true;
        c->wsi = NULL;
        break;
    default:
        break;
    }
    return 0;
}

static const struct lws_protocols connection_protocols[] = {
    {.name = "veduta", .callback = connection_callback, .rx_buffer_size = 65536}, {.name = NULL}};

/* One look at the network, at most 10 ms long. */
static inline void connection_poll(connection *c) {
    /* Asked from inside, lws waits for nothing that is not there: a moment's sleep paces it. */
    lws_cancel_service(c->network);
    (void)lws_service(c->network, 0);
    nanosleep(&(struct timespec){0, 500000}, NULL);
}

static inline void connection_open(connection *c, vd_context *context, int port, bool tls,
                                   const char *path, const char *protocol) {
    memset(c, 0, sizeof *c);
    c->end = &c->first;
    client_begin(&c->client, context);
    assert_ok(vd_wire_create(context, &c->wire));
    lws_set_log_level(0, NULL);
    struct lws_context_creation_info info = {.port = CONTEXT_PORT_NO_LISTEN,
                                             .protocols = connection_protocols,
                                             .user = c,
                                             .gid = (gid_t)-1,
                                             .uid = (uid_t)-1};
    info.options = tls ? LWS_SERVER_OPTION_DO_SSL_GLOBAL_INIT : 0;
    c->network = lws_create_context(&info);
    assert_non_null(c->network);
    const struct lws_client_connect_info to = {.context = c->network,
                                               .address = "127.0.0.1",
                                               .host = "127.0.0.1",
                                               .origin = "127.0.0.1",
                                               .port = port,
                                               .path = path,
                                               .protocol = protocol,
                                               .local_protocol_name = "veduta",
                                               .ssl_connection =
                                                   tls ? LCCSCF_USE_SSL | LCCSCF_ALLOW_SELFSIGNED |
                                                             LCCSCF_SKIP_SERVER_CERT_HOSTNAME_CHECK
                                                       : 0,
                                               .pwsi = &c->wsi};
    if (lws_client_connect_via_info(&to) == NULL) {
        c->closed = true;
    }
    for (const double until_s = clock_s() + 10.0; !c->open && !c->closed;) {
        assert_true(clock_s() < until_s);
        connection_poll(c);
    }
}

static inline void connection_run(connection *c, double seconds) {
    for (const double until_s = clock_s() + seconds; clock_s() < until_s && !c->closed;) {
        connection_poll(c);
    }
}

static inline void connection_close(connection *c) {
    lws_context_destroy(c->network);
    while (c->first != NULL) {
        sent *next = c->first->next;
        free(c->first);
        c->first = next;
    }
    client_end(&c->client);
    vd_wire_buffer_release(c->client.context, &c->buffer);
    vd_wire_destroy(&c->wire);
    free(c->partial);
}

#endif

/* client.c: the client's thread: a WebSocket, and one question over HTTP.
 *
 * All that a connection says goes through a vd_mirror; here are the transport and when to try
 * again: after half a second, then twice as long each time, at most 15 s.
 */
#include <veduta/client.h>

#include <math.h>
#include <string.h>

const char *vd_client_state_name(vd_client_state state) {
    static const char *const names[VD_CLIENT_STATE_COUNT] = {
        "connecting", "loading", "showing", "lost", "refused", "mismatched", "ended"};
    return (unsigned)state < VD_CLIENT_STATE_COUNT ? names[state] : NULL;
}

vd_client_def vd_client_def_default(void) {
    return (vd_client_def){.memory_bytes = (size_t)64 << 20,
                           .particles = 1u << 18,
                           .settings = {.mode = VD_WIRE_MODE_IMPOSTORS, .tolerance_px = 1.0f}};
}

#if VEDUTA_HAVE_WEBSOCKETS

#include <libwebsockets.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>
#include <veduta/server.h>
#include "remote/client_address.h"
#include "remote/mirror.h"

#define TICK_US 50000
#define FIRST_RETRY_S 0.5
#define MOST_RETRY_S 15.0
#define WORLD_RETRY_S 2.0
#define WORLD_BYTES ((size_t)1 << 16)

/* How long a goodbye may take. */
#define LEAVE_S 0.3

_Static_assert(LWS_PRE <= VD_PACKET_HEAD, "packets have room for the transport's head");

struct vd_client {
    vd_context *context;
    vd_client_def def;
    vd_address address;
    vd_mirror *mirror;
    pthread_t thread;
    bool started;
    atomic_bool stopping, cut;
    struct lws_context *network;
    lws_sorted_usec_list_t timer;
    _Atomic double retry_at_s;
    pthread_mutex_t lock; /* of the next two */
    char *world;          /* by malloc: what /world.json said */
    size_t world_bytes;

    /* The thread alone. */
    struct lws *wsi, *asking;
    bool closing, ending; /* ending: the transport is given a moment to close */
    double backoff_s, world_at_s;
    uint64_t version; /* of the news that `wake` was called for */
    uint8_t *partial; /* by malloc: of a message */
    size_t partial_bytes, partial_room;
    vd_packet *packet; /* is sent next; null: the mirror had none */
    char *answer;      /* by malloc: of /world.json so far */
    size_t answer_bytes;
};

static double now_s(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static vd_client *client_of(struct lws *wsi) {
    return lws_context_user(lws_get_context(wsi));
}

/* ---- the socket -------------------------------------------------------------------------------*/

static int receive(vd_client *c, struct lws *wsi, const void *in, size_t length) {
    if (length > VD_WIRE_ENVELOPE_BYTES - c->partial_bytes || !lws_frame_is_binary(wsi)) {
        vd_mirror_refuse(c->mirror, "the server says what is no envelope of the wire");
        return -1;
    }
    if (c->partial_bytes + length > c->partial_room) {
        const size_t room = 2 * (c->partial_bytes + length);
        uint8_t *grown = realloc(c->partial, room);
        if (grown == NULL) {
            return -1;
        }
        c->partial = grown;
        c->partial_room = room;
    }
    memcpy(c->partial + c->partial_bytes, in, length);
    c->partial_bytes += length;
    if (lws_is_final_fragment(wsi) && lws_remaining_packet_payload(wsi) == 0) {
        vd_mirror_receive(c->mirror, c->partial, c->partial_bytes, now_s());
        c->partial_bytes = 0;
    }
    return 0;
}

/* Asks for a turn to write when there is something to write, or to end: a socket that can be
 * written to is no reason to wake up. */
static void ask_to_write(vd_client *c, struct lws *wsi) {
    c->packet = c->packet != NULL ? c->packet : vd_mirror_take(c->mirror);
    if (c->packet != NULL || c->closing || vd_mirror_is_over(c->mirror)) {
        (void)lws_callback_on_writable(wsi);
    }
}

static int send_next(vd_client *c, struct lws *wsi) {
    vd_packet *packet = c->packet != NULL ? c->packet : vd_mirror_take(c->mirror);
    c->packet = NULL;
    if (packet == NULL) {
        return c->closing || vd_mirror_is_over(c->mirror) ? -1 : 0;
    }
    const int wrote =
        lws_write(wsi, packet->data + VD_PACKET_HEAD, packet->bytes, LWS_WRITE_BINARY);
    vd_release(c->context, packet);
    ask_to_write(c, wsi);
    return wrote < 0 ? -1 : 0;
}

/* Is tried again, later each time. */
static void try_later(vd_client *c, const char *sentence) {
    c->wsi = NULL;
    c->partial_bytes = 0;
    vd_release(c->context, c->packet);
    c->packet = NULL;
    c->ending = false;
    c->backoff_s = c->backoff_s > 0.0 ? 2.0 * c->backoff_s : FIRST_RETRY_S;
    c->backoff_s = c->backoff_s < MOST_RETRY_S ? c->backoff_s : MOST_RETRY_S;
    atomic_store(&c->retry_at_s, now_s() + c->backoff_s);
    vd_mirror_lose(c->mirror, sentence);
}

static void not_reached(vd_client *c, const char *why, size_t length) {
    char sentence[VD_MESSAGE_BYTES];
    (void)snprintf(sentence, sizeof sentence, "cannot reach %.100s, port %d: %.*s; is it serving?",
                   c->address.host, c->address.port, (int)(why != NULL ? length % 160 : 9),
                   why != NULL ? why : "no answer");
    try_later(c, sentence);
}

static int socket_callback(struct lws *wsi, enum lws_callback_reasons reason, void *user, void *in,
                           size_t length) {
    vd_client *c = client_of(wsi);
    (void)user;
    if (c == NULL) {
        return 0;
    }
    switch (reason) {
    case LWS_CALLBACK_CLIENT_ESTABLISHED:
        vd_mirror_open(c->mirror, now_s());
        ask_to_write(c, wsi);
        break;
    case LWS_CALLBACK_CLIENT_RECEIVE:
        if (receive(c, wsi, in, length) != 0) {
            return -1;
        }
        vd_mirror_work(c->mirror, now_s());
        ask_to_write(c, wsi);
        break;
    case LWS_CALLBACK_CLIENT_WRITEABLE:
        return send_next(c, wsi);
    case LWS_CALLBACK_CLIENT_CONNECTION_ERROR:
        not_reached(c, in, length);
        break;
    case LWS_CALLBACK_CLIENT_CLOSED:
        try_later(c, "the connection broke");
        break;
    default:
        break;
    }
    return 0;
}

/* ---- /world.json ------------------------------------------------------------------------------*/

static int take_answer(vd_client *c, const char *in, size_t length) {
    if (length >= WORLD_BYTES - c->answer_bytes) {
        return -1;
    }
    char *grown = realloc(c->answer, c->answer_bytes + length + 1);
    if (grown == NULL) {
        return -1;
    }
    c->answer = grown;
    memcpy(grown + c->answer_bytes, in, length);
    c->answer_bytes += length;
    grown[c->answer_bytes] = '\0';
    return 0;
}

static void finish_answer(vd_client *c) {
    pthread_mutex_lock(&c->lock);
    if (c->answer != NULL && c->world == NULL) {
        c->world = c->answer;
        c->world_bytes = c->answer_bytes;
        c->answer = NULL;
    }
    pthread_mutex_unlock(&c->lock);
    free(c->answer);
    c->answer = NULL;
    c->answer_bytes = 0;
    c->version = 0; /* wakes */
}

static int add_token(vd_client *c, struct lws *wsi, void *in, size_t length) {
    char bearer[VD_WIRE_TOKEN_BYTES + 16];
    unsigned char **at = in;
    const int bytes = snprintf(bearer, sizeof bearer, "Bearer %s", c->address.token);
    return lws_add_http_header_by_token(wsi, WSI_TOKEN_HTTP_AUTHORIZATION,
                                        (const unsigned char *)bearer, bytes, at, *at + length)
               ? -1
               : 0;
}

static int http_callback(struct lws *wsi, enum lws_callback_reasons reason, void *user, void *in,
                         size_t length) {
    vd_client *c = client_of(wsi);
    (void)user;
    char buffer[LWS_PRE + 4096], *at = buffer + LWS_PRE;
    int room = 4096;
    switch (reason) {
    case LWS_CALLBACK_CLIENT_APPEND_HANDSHAKE_HEADER:
        return add_token(c, wsi, in, length);
    case LWS_CALLBACK_ESTABLISHED_CLIENT_HTTP:
        return lws_http_client_http_response(wsi) == 200 ? 0 : -1;
    case LWS_CALLBACK_RECEIVE_CLIENT_HTTP:
        return lws_http_client_read(wsi, &at, &room) < 0 ? -1 : 0;
    case LWS_CALLBACK_RECEIVE_CLIENT_HTTP_READ:
        return take_answer(c, in, length);
    case LWS_CALLBACK_COMPLETED_CLIENT_HTTP:
        finish_answer(c);
        return -1; /* one question a connection */
    case LWS_CALLBACK_CLIENT_CONNECTION_ERROR:
    case LWS_CALLBACK_CLOSED_CLIENT_HTTP:
        c->asking = NULL;
        free(c->answer);
        c->answer = NULL;
        c->answer_bytes = 0;
        return 0;
    default:
        return 0;
    }
}

/* ---- connecting -------------------------------------------------------------------------------*/

/* Opens one of the two connections; null when that fails at once. */
static struct lws *reach(vd_client *c, bool question, struct lws **wsi) {
    char path[VD_ADDRESS_PATH + 32], host[VD_ADDRESS_HOST + 16];
    const vd_address *a = &c->address;
    (void)snprintf(path, sizeof path, "%s%s", a->path,
                   question ? "world.json" : &VD_SERVER_SOCKET[1]);
    const bool v6 = strchr(a->host, ':') != NULL;
    (void)snprintf(host, sizeof host, "%s%s%s:%d", v6 ? "[" : "", a->host, v6 ? "]" : "", a->port);
    const struct lws_client_connect_info to = {
        .context = c->network,
        .address = a->host,
        .host = a->tls ? a->host : host, /* that of TLS is what the certificate is of */
        .origin = host,
        .port = a->port,
        .path = path,
        .method = question ? "GET" : NULL,
        .protocol = question ? NULL : VD_SERVER_PROTOCOL,
        .local_protocol_name = question ? "http" : VD_SERVER_PROTOCOL,
        .alpn = "http/1.1",
        .ssl_connection = !a->tls ? 0
                          : c->def.insecure
                              ? LCCSCF_USE_SSL | LCCSCF_ALLOW_SELFSIGNED | LCCSCF_ALLOW_INSECURE |
                                    LCCSCF_ALLOW_EXPIRED | LCCSCF_SKIP_SERVER_CERT_HOSTNAME_CHECK
                              : LCCSCF_USE_SSL,
        .pwsi = wsi};
    return lws_client_connect_via_info(&to);
}

static void connect_when_due(vd_client *c, double now) {
    vd_client_news news;
    if (c->wsi == NULL && !c->closing && now >= atomic_load(&c->retry_at_s) &&
        vd_mirror_may_open(c->mirror)) {
        atomic_store(&c->retry_at_s, now + MOST_RETRY_S); /* the callback may have set it */
        if (reach(c, false, &c->wsi) == NULL && c->wsi == NULL &&
            atomic_load(&c->retry_at_s) >= now + MOST_RETRY_S) {
            not_reached(c, NULL, 0);
        }
    }
    vd_mirror_get_news(c->mirror, &news);
    if (news.state == VD_CLIENT_LOADING || news.state == VD_CLIENT_SHOWING) {
        c->backoff_s = 0.0;
        if (c->def.wants_world && c->world == NULL && c->asking == NULL && now >= c->world_at_s) {
            c->world_at_s = now + WORLD_RETRY_S;
            (void)reach(c, true, &c->asking);
        }
    }
}

/* Looks what others want, sends what is due. */
static void look_around(vd_client *c) {
    const double now = now_s();
    if (atomic_load(&c->stopping) && !c->closing) {
        c->closing = true;
        vd_mirror_leave(c->mirror);
    }
    if (atomic_exchange(&c->cut, false) && c->wsi != NULL) {
        lws_set_timeout(c->wsi, PENDING_TIMEOUT_USER_OK, LWS_TO_KILL_ASYNC);
    }
    connect_when_due(c, now);
    if (c->wsi != NULL) {
        vd_mirror_work(c->mirror, now);
        ask_to_write(c, c->wsi);
    }
    if (c->wsi != NULL && vd_mirror_is_over(c->mirror) && !c->ending) {
        c->ending = true; /* a server that takes nothing in is not waited for */
        lws_set_timeout(c->wsi, PENDING_TIMEOUT_USER_OK, 2);
    }
    vd_client_news news;
    vd_mirror_get_news(c->mirror, &news);
    if (news.version + 1 != c->version) {
        c->version = news.version + 1;
        if (c->def.wake != NULL) {
            c->def.wake(c->def.wake_user);
        }
    }
}

static void tick(lws_sorted_usec_list_t *timer) {
    vd_client *c = lws_container_of(timer, vd_client, timer);
    lws_sul_schedule(c->network, 0, timer, tick, TICK_US);
}

static void *run(void *user) {
    vd_client *c = user;
    double leave_s = 0.0;
    lws_sul_schedule(c->network, 0, &c->timer, tick, 1);
    for (;;) {
        look_around(c);
        if (c->closing) {
            leave_s = leave_s == 0.0 ? now_s() + LEAVE_S : leave_s;
            if (c->wsi == NULL || now_s() > leave_s) {
                return NULL;
            }
        }
        if (lws_service(c->network, 0) < 0) {
            vd_mirror_refuse(c->mirror, "the network gave up; connect again");
            return NULL;
        }
    }
}

/* ---- beginning and end ------------------------------------------------------------------------*/

static const struct lws_protocols protocols[] = {
    {.name = "http", .callback = http_callback},
    {.name = VD_SERVER_PROTOCOL, .callback = socket_callback, .rx_buffer_size = 65536},
    {.name = NULL}};

static vd_status open_network(vd_client *c) {
    struct lws_context_creation_info info = {.port = CONTEXT_PORT_NO_LISTEN,
                                             .protocols = protocols,
                                             .user = c,
                                             .gid = (gid_t)-1,
                                             .uid = (uid_t)-1,
                                             .timeout_secs = 10,
                                             .fd_limit_per_thread = 16};
    if (c->address.tls) {
        info.options |= LWS_SERVER_OPTION_DO_SSL_GLOBAL_INIT;
        info.ssl_client_options_set = SSL_OP_NO_SSLv3 | SSL_OP_NO_TLSv1 | SSL_OP_NO_TLSv1_1;
    }
    lws_set_log_level(0, NULL);
    c->network = lws_create_context(&info);
    return c->network != NULL
               ? vd_success()
               : vd_failure(VD_ERROR_MEMORY, "the network cannot be opened; close something");
}

vd_status vd_client_create(vd_context *context, const vd_client_def *def, vd_client **out) {
    vd_address address;
    if (def->url == NULL) {
        return vd_failure(VD_ERROR_ARGUMENT, "url is null; give a server's address");
    }
    vd_status status = vd_address_read(def->url, &address);
    vd_client *c = status.code == VD_OK ? calloc(1, sizeof *c) : NULL;
    if (c == NULL) {
        return status.code != VD_OK
                   ? status
                   : vd_failure(VD_ERROR_MEMORY, "not enough memory for a client; free some");
    }
    c->context = context;
    c->def = *def;
    c->def.url = NULL;
    c->address = address;
    c->version = UINT64_MAX;
    pthread_mutex_init(&c->lock, NULL);
    const vd_mirror_def mirror = {.token = c->address.token[0] != '\0' ? c->address.token : NULL,
                                  .name = "veduta view",
                                  .memory_bytes = def->memory_bytes,
                                  .no_models = def->no_models,
                                  .particles = def->particles,
                                  .settings = def->settings};
    status = vd_mirror_create(context, &mirror, &c->mirror);
    if (status.code == VD_OK) {
        status = open_network(c);
    }
    if (status.code == VD_OK) {
        c->started = pthread_create(&c->thread, NULL, run, c) == 0;
        if (!c->started) {
            status = vd_failure(VD_ERROR_MEMORY, "cannot start a thread; end other programs");
        }
    }
    if (status.code != VD_OK) {
        vd_client_destroy(&c);
        return status;
    }
    *out = c;
    return status;
}

static void wake(vd_client *c) {
    if (c->network != NULL) {
        lws_cancel_service(c->network);
    }
}

void vd_client_destroy(vd_client **client) {
    vd_client *c = *client;
    if (c == NULL) {
        return;
    }
    if (c->started) {
        atomic_store(&c->stopping, true);
        wake(c);
        pthread_join(c->thread, NULL);
    }
    c->closing = true;
    if (c->network != NULL) {
        lws_context_destroy(c->network);
    }
    vd_mirror_destroy(&c->mirror);
    pthread_mutex_destroy(&c->lock);
    vd_release(c->context, c->packet);
    free(c->partial);
    free(c->answer);
    free(c->world);
    free(c);
    *client = NULL;
}

void vd_client_look(vd_client *c, const vd_camera *camera, int width, int height) {
    vd_mirror_look(c->mirror, camera, width, height);
    wake(c);
}

vd_status vd_client_set(vd_client *c, const vd_wire_settings *settings) {
    const vd_status status = vd_mirror_set(c->mirror, settings);
    wake(c);
    return status;
}

void vd_client_cut(vd_client *c) {
    atomic_store(&c->cut, true);
    wake(c);
}

vd_status vd_client_draw(vd_client *c, vd_job *job, const vd_camera *camera, vd_frame *frame,
                         vd_client_shown *shown) {
    return vd_mirror_draw(c->mirror, job, camera, frame, shown);
}

void vd_client_get_news(vd_client *c, vd_client_news *out) {
    vd_mirror_get_news(c->mirror, out);
    const double left_s = atomic_load(&c->retry_at_s) - now_s();
    out->retry_s = out->state == VD_CLIENT_LOST && left_s > 0.0 ? left_s : 0.0;
}

bool vd_client_get_world(vd_client *c, char *out, size_t room) {
    pthread_mutex_lock(&c->lock);
    const bool there = c->world != NULL && c->world_bytes < room;
    if (there) {
        memcpy(out, c->world, c->world_bytes + 1);
    }
    pthread_mutex_unlock(&c->lock);
    return there;
}

double vd_client_ground(vd_client *c, double x, double y) {
    return vd_mirror_ground(c->mirror, x, y);
}

#else

#define WITHOUT                                                                                    \
    vd_failure(VD_ERROR_UNSUPPORTED,                                                               \
               "this veduta-remote was built without libwebsockets and reaches no server; "        \
               "install libwebsockets-dev and build again")

vd_status vd_client_create(vd_context *context, const vd_client_def *def, vd_client **out) {
    (void)context, (void)def, (void)out;
    return WITHOUT;
}

void vd_client_destroy(vd_client **client) {
    *client = NULL;
}

void vd_client_look(vd_client *client, const vd_camera *camera, int width, int height) {
    (void)client, (void)camera, (void)width, (void)height;
}

vd_status vd_client_set(vd_client *client, const vd_wire_settings *settings) {
    (void)client, (void)settings;
    return WITHOUT;
}

void vd_client_cut(vd_client *client) {
    (void)client;
}

vd_status vd_client_draw(vd_client *client, vd_job *job, const vd_camera *camera, vd_frame *frame,
                         vd_client_shown *shown) {
    (void)client, (void)job, (void)camera, (void)frame, (void)shown;
    return WITHOUT;
}

void vd_client_get_news(vd_client *client, vd_client_news *out) {
    (void)client;
    memset(out, 0, sizeof *out);
}

bool vd_client_get_world(vd_client *client, char *out, size_t room) {
    (void)client, (void)out, (void)room;
    return false;
}

double vd_client_ground(vd_client *client, double x, double y) {
    (void)client, (void)x, (void)y;
    return (double)-INFINITY;
}

#endif

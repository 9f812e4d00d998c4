/* server_socket.c: the WebSocket: bytes in, bytes out. */
#include "remote/server_internal.h"

#if VEDUTA_HAVE_WEBSOCKETS

#include <libwebsockets.h>
#include <stdlib.h>
#include <string.h>

_Static_assert(LWS_PRE <= VD_PACKET_HEAD, "packets have room for the transport's head");

/* Connections beyond the clients that are let in, so that these can be told why they are not. */
#define MORE_SOCKETS 32

typedef struct socket_user {
    vd_peer *peer;
} socket_user;

size_t vd_server_socket_bytes(void) {
    return sizeof(socket_user);
}

static vd_server *server_of(struct lws *wsi) {
    return lws_context_user(lws_get_context(wsi));
}

/* Only the socket's own path, and not more than can be told off. Non-zero refuses. */
static int admit(vd_server *server, struct lws *wsi) {
    char path[32] = "";
    const int length = lws_hdr_copy(wsi, path, sizeof path, WSI_TOKEN_GET_URI);
    pthread_mutex_lock(&server->lock);
    const bool full = server->peer_count >= server->def.max_clients + MORE_SOCKETS;
    server->counters.refused += full;
    pthread_mutex_unlock(&server->lock);
    return length <= 0 || strcmp(path, VD_SERVER_SOCKET) != 0 || full ||
           atomic_load(&server->stopping);
}

static int open_peer(vd_server *server, struct lws *wsi, socket_user *user) {
    vd_peer *peer = calloc(1, sizeof *peer);
    if (peer == NULL) {
        return -1;
    }
    peer->wsi = wsi;
    peer->inbox_end = &peer->inbox;
    peer->outbox_end = &peer->outbox;
    user->peer = peer;
    pthread_mutex_lock(&server->lock);
    peer->next = server->peers;
    server->peers = peer;
    server->peer_count++;
    server->counters.accepted++;
    pthread_cond_signal(&server->work);
    pthread_mutex_unlock(&server->lock);
    return 0;
}

static void close_peer(vd_server *server, socket_user *user) {
    vd_peer *peer = user->peer;
    if (peer != NULL) {
        free(peer->partial);
        peer->partial = NULL;
        peer->wsi = NULL;
        pthread_mutex_lock(&server->lock);
        peer->gone = true; /* from here on it is the rendering thread's */
        pthread_cond_signal(&server->work);
        pthread_mutex_unlock(&server->lock);
        user->peer = NULL;
    }
}

/* Puts a whole message into the inbox; reads no more while that is full. */
static void take_in(vd_server *server, vd_peer *peer) {
    vd_received *message = peer->partial;
    peer->partial = NULL;
    peer->partial_room = 0;
    message->at_s = vd_server_now_s();
    message->next = NULL;
    pthread_mutex_lock(&server->lock);
    *peer->inbox_end = message;
    peer->inbox_end = &message->next;
    peer->inbox_bytes += message->bytes;
    peer->inbox_count++;
    peer->paused = peer->inbox_count >= VD_INBOX_MESSAGES || peer->inbox_bytes >= VD_INBOX_BYTES;
    pthread_cond_signal(&server->work);
    pthread_mutex_unlock(&server->lock);
    if (peer->paused) {
        (void)lws_rx_flow_control(peer->wsi, 0);
    }
}

static int refuse(struct lws *wsi, enum lws_close_status status, const char *why) {
    lws_close_reason(wsi, status, (unsigned char *)(uintptr_t)why, strlen(why));
    return -1;
}

static int receive(vd_server *server, struct lws *wsi, vd_peer *peer, const void *in,
                   size_t length) {
    const size_t had = peer->partial != NULL ? peer->partial->bytes : 0;
    if (!lws_frame_is_binary(wsi)) {
        return refuse(wsi, LWS_CLOSE_STATUS_UNACCEPTABLE_OPCODE, "envelopes are binary messages");
    }
    if (length > VD_MESSAGE_MOST - had) {
        return refuse(wsi, LWS_CLOSE_STATUS_MESSAGE_TOO_LARGE, "a message is at most 1 MiB");
    }
    if (had + length > peer->partial_room || peer->partial == NULL) {
        const size_t room = had + length > 4096 ? 2 * (had + length) : 4096;
        vd_received *grown = realloc(peer->partial, sizeof *grown + room);
        if (grown == NULL) {
            return -1;
        }
        grown->bytes = had;
        peer->partial = grown;
        peer->partial_room = room;
    }
    memcpy(peer->partial->data + had, in, length);
    peer->partial->bytes = had + length;
    if (lws_is_final_fragment(wsi) && lws_remaining_packet_payload(wsi) == 0) {
        take_in(server, peer);
    }
    return 0;
}

/* Sends the oldest packet. */
static int send_next(vd_server *server, struct lws *wsi, vd_peer *peer) {
    pthread_mutex_lock(&server->lock);
    vd_packet *packet = peer->outbox;
    if (packet != NULL) {
        peer->outbox = packet->next;
        peer->outbox_end = peer->outbox != NULL ? peer->outbox_end : &peer->outbox;
    }
    const bool more = peer->outbox != NULL, over = peer->over;
    pthread_mutex_unlock(&server->lock);
    int result = 0;
    if (packet != NULL) {
        result = lws_write(wsi, packet->data + VD_PACKET_HEAD, packet->bytes, LWS_WRITE_BINARY);
        vd_release(server->context, packet);
    }
    if (more || (over && packet != NULL)) {
        (void)lws_callback_on_writable(wsi);
    } else if (over) {
        return refuse(wsi, LWS_CLOSE_STATUS_NORMAL, "");
    }
    return result < 0 ? -1 : 0;
}

void vd_server_wake_peers(vd_server *server) {
    pthread_mutex_lock(&server->lock);
    for (vd_peer *peer = server->peers; peer != NULL; peer = peer->next) {
        if (peer->gone || peer->wsi == NULL) {
            continue;
        }
        if (peer->outbox != NULL || peer->over) {
            (void)lws_callback_on_writable(peer->wsi);
        }
        if (peer->paused && peer->inbox_count == 0) {
            peer->paused = false;
            (void)lws_rx_flow_control(peer->wsi, 1);
        }
    }
    pthread_mutex_unlock(&server->lock);
}

int vd_server_socket(struct lws *wsi, int reason, void *user, void *in, size_t length) {
    vd_server *server = server_of(wsi);
    socket_user *mine = user;
    switch (reason) {
    case LWS_CALLBACK_FILTER_PROTOCOL_CONNECTION:
        return admit(server, wsi);
    case LWS_CALLBACK_ESTABLISHED:
        return open_peer(server, wsi, mine);
    case LWS_CALLBACK_RECEIVE:
        return mine->peer != NULL ? receive(server, wsi, mine->peer, in, length) : -1;
    case LWS_CALLBACK_SERVER_WRITEABLE:
        return mine->peer != NULL ? send_next(server, wsi, mine->peer) : -1;
    case LWS_CALLBACK_CLOSED:
        close_peer(server, mine);
        return 0;
    default:
        return 0;
    }
}

#endif

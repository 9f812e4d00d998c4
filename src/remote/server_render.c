/* server_render.c: the rendering thread: sessions in turn. */
#include <stdlib.h>
#include <time.h>
#include "remote/server_internal.h"

#if VEDUTA_HAVE_WEBSOCKETS

#include <libwebsockets.h>

/* How long what a vanished client held is kept for its coming back. */
#define PAST_S 60.0

/* Between looks at sessions for which nothing is due. */
#define LOOK_S 0.02

/* ---- who comes and goes -----------------------------------------------------------------------*/

static void free_peer(vd_server *server, vd_peer *peer) {
    while (peer->inbox != NULL) {
        vd_received *next = peer->inbox->next;
        free(peer->inbox);
        peer->inbox = next;
    }
    while (peer->outbox != NULL) {
        vd_packet *next = peer->outbox->next;
        vd_release(server->context, peer->outbox);
        peer->outbox = next;
    }
    vd_server_end_recording(server, peer);
    vd_session_destroy(&peer->session);
    free(peer->partial);
    free(peer);
}

/* Keeps a session whose connection broke, in place of the oldest. */
static void park(vd_server *server, vd_session *session, double now_s) {
    int oldest = 0;
    for (int i = 1; i < VD_PAST_MOST; i++) {
        const vd_past *a = &server->past[i], *b = &server->past[oldest];
        if (b->session != NULL && (a->session == NULL || a->since_s < b->since_s)) {
            oldest = i;
        }
    }
    vd_session_destroy(&server->past[oldest].session);
    server->past[oldest] = (vd_past){session, now_s};
}

static void forget_past(vd_server *server, double before_s) {
    for (int i = 0; i < VD_PAST_MOST; i++) {
        if (server->past[i].session != NULL && server->past[i].since_s < before_s) {
            vd_session_destroy(&server->past[i].session);
        }
    }
}

static void look_for_past(vd_server *server, vd_session *session) {
    for (int i = 0; i < VD_PAST_MOST; i++) {
        if (server->past[i].session != NULL &&
            vd_session_takes_past(session, server->past[i].session)) {
            vd_session_destroy(&server->past[i].session);
            return;
        }
    }
}

/* Takes peers that are gone out of the list; the caller frees them. */
static vd_peer *take_gone(vd_server *server) {
    vd_peer *gone = NULL;
    pthread_mutex_lock(&server->lock);
    for (vd_peer **at = &server->peers; *at != NULL;) {
        vd_peer *peer = *at;
        if (peer->gone) {
            *at = peer->next;
            peer->next = gone;
            gone = peer;
            server->peer_count--;
        } else {
            at = &peer->next;
        }
    }
    pthread_mutex_unlock(&server->lock);
    return gone;
}

static void bury(vd_server *server, double now_s) {
    for (vd_peer *peer = take_gone(server); peer != NULL;) {
        vd_peer *next = peer->next;
        if (peer->session != NULL && vd_session_is_greeted(peer->session)) {
            park(server, peer->session, now_s);
            peer->session = NULL;
        }
        free_peer(server, peer);
        peer = next;
    }
}

/* ---- one peer ---------------------------------------------------------------------------------*/

static void begin_session(vd_server *server, vd_peer *peer, double now_s) {
    vd_session_def def = vd_session_def_default();
    def.world = server->def.world;
    def.renderer = server->def.renderer;
    def.tools = &server->tools;
    def.token = server->def.token;
    def.name = server->def.name != NULL ? server->def.name : "";
    def.memory_bytes = server->def.memory_bytes;
    def.bytes_per_s = server->def.bytes_per_s;
    /* Pictures of different sessions are told apart by their versions. */
    def.seed = (++server->sessions * 2654435761u) >> 1;
    const vd_status status = vd_session_create(&def, now_s, &peer->session);
    if (status.code != VD_OK) {
        vd_log(server->context, VD_LOG_WARNING, "%.300s", status.message);
    }
}

/* Hands what has come to the session. */
static void hand_in(vd_server *server, vd_peer *peer) {
    pthread_mutex_lock(&server->lock);
    vd_received *message = peer->inbox;
    const bool was_full =
        peer->inbox_count >= VD_INBOX_MESSAGES || peer->inbox_bytes >= VD_INBOX_BYTES;
    peer->inbox = NULL;
    peer->inbox_end = &peer->inbox;
    peer->inbox_bytes = 0;
    peer->inbox_count = 0;
    pthread_mutex_unlock(&server->lock);
    while (message != NULL) {
        vd_received *next = message->next;
        vd_session_receive(peer->session, message->data, message->bytes, message->at_s);
        vd_server_record_message(server, peer, message);
        free(message);
        message = next;
    }
    if (was_full) {
        lws_cancel_service(server->network); /* it may read on */
    }
}

/* Counts a client that has said hello; one too many is told so. */
static void admit(vd_server *server, vd_peer *peer, int *clients) {
    if (vd_session_is_greeted(peer->session)) {
        if (!peer->counted && *clients >= server->def.max_clients) {
            vd_session_fail(peer->session, VD_WIRE_FAULT_FULL,
                            "the server has as many clients as it takes; try again later");
            pthread_mutex_lock(&server->lock);
            server->counters.refused++;
            pthread_mutex_unlock(&server->lock);
            return;
        }
        *clients += 1;
        peer->counted = true;
        if (vd_session_wants_past(peer->session)) {
            look_for_past(server, peer->session);
        }
    }
}

static void hand_out(vd_server *server, vd_peer *peer) {
    vd_packet *first = vd_session_take(peer->session);
    const bool over = vd_session_is_over(peer->session);
    if (first == NULL && !over) {
        return;
    }
    vd_packet **end = &first;
    while (*end != NULL) {
        vd_server_record_packet(server, peer, *end);
        end = &(*end)->next;
        *end = vd_session_take(peer->session);
    }
    pthread_mutex_lock(&server->lock);
    const bool news = first != NULL || (over && !peer->over);
    if (first != NULL) {
        *peer->outbox_end = first;
        peer->outbox_end = end;
    }
    peer->over = over;
    pthread_mutex_unlock(&server->lock);
    if (news) {
        lws_cancel_service(server->network);
    }
}

/* Whether anything was done, or will be as soon as time passes. */
static bool serve(vd_server *server, vd_peer *peer, vd_job *job) {
    if (peer->session == NULL || vd_session_is_over(peer->session)) {
        return false;
    }
    const double now_s = vd_server_now_s();
    const bool due = vd_session_is_due(peer->session, now_s);
    vd_session_work(peer->session, job, now_s);
    hand_out(server, peer);
    return due;
}

/* ---- pictures over HTTP -----------------------------------------------------------------------*/

static vd_status draw_shot(vd_server *server, vd_job *job, vd_shot *shot) {
    vd_camera camera;
    vd_frame *frame = NULL;
    vd_status status =
        server->def.camera(server->def.camera_user, shot->camera[0] != '\0' ? shot->camera : NULL,
                           shot->width, shot->height, &camera);
    if (status.code == VD_OK) {
        status = vd_frame_create(server->context, shot->width, shot->height, 0, &frame);
    }
    if (status.code == VD_OK) {
        status = vd_world_renderer_draw(server->def.renderer, job, &camera, frame, NULL);
    }
    if (status.code == VD_OK) {
        status = vd_server_png(frame, &shot->png, &shot->png_bytes);
    }
    vd_frame_destroy(&frame);
    return status;
}

/* Draws the oldest; false when there is none. */
static bool shoot(vd_server *server, vd_job *job) {
    pthread_mutex_lock(&server->lock);
    vd_shot *shot = server->shots;
    if (shot != NULL) {
        server->shots = shot->next;
        server->shot_count--;
    }
    const bool wanted = shot != NULL && !shot->abandoned;
    pthread_mutex_unlock(&server->lock);
    if (shot == NULL) {
        return false;
    }
    const vd_status status = wanted ? draw_shot(server, job, shot) : vd_success();
    pthread_mutex_lock(&server->lock);
    shot->status = status;
    shot->done = true;
    const bool abandoned = shot->abandoned;
    server->counters.frames++;
    pthread_mutex_unlock(&server->lock);
    if (abandoned) {
        free(shot->png);
        free(shot);
    }
    lws_cancel_service(server->network);
    return true;
}

/* ---- the loop ---------------------------------------------------------------------------------*/

static void count(vd_server *server, vd_peer *const *peers, int peer_count, int clients) {
    vd_server_counters sum = {.clients = clients};
    for (int i = 0; i < peer_count; i++) {
        if (peers[i]->session != NULL) {
            const vd_session_stats stats = vd_session_get_stats(peers[i]->session);
            sum.kept_bytes += stats.kept_bytes;
            vd_session_set_clients(peers[i]->session, clients);
        }
    }
    pthread_mutex_lock(&server->lock);
    server->counters.clients = clients;
    server->counters.kept_bytes = sum.kept_bytes;
    pthread_mutex_unlock(&server->lock);
}

/* Adds what a session did since it was looked at last. */
static void count_work(vd_server *server, const vd_session_stats *before,
                       const vd_session_stats *after) {
    pthread_mutex_lock(&server->lock);
    server->counters.batches += after->batches - before->batches;
    server->counters.bytes_sent += after->bytes_sent - before->bytes_sent;
    server->counters.pictures += after->pictures - before->pictures;
    server->counters.screens += after->screens - before->screens;
    pthread_mutex_unlock(&server->lock);
}

/* Copies the list: peers stay until this thread frees them. Returns null when memory is out. */
static vd_peer **list_peers(vd_server *server, int *count) {
    pthread_mutex_lock(&server->lock);
    vd_peer **peers = calloc((size_t)server->peer_count + 1, sizeof(vd_peer *));
    *count = 0;
    for (vd_peer *peer = server->peers; peers != NULL && peer != NULL; peer = peer->next) {
        peers[(*count)++] = peer;
    }
    pthread_mutex_unlock(&server->lock);
    return peers;
}

/* One turn of all; true when it is worth going on at once. */
static bool turn(vd_server *server, vd_job *job) {
    int peer_count = 0, clients = 0;
    bool busy = shoot(server, job);
    bury(server, vd_server_now_s());
    vd_peer **peers = list_peers(server, &peer_count);
    for (int i = 0; i < peer_count; i++) {
        vd_peer *peer = peers[i];
        if (peer->session == NULL) {
            begin_session(server, peer, vd_server_now_s());
        }
        if (peer->session != NULL) {
            hand_in(server, peer);
            clients += peer->counted && vd_session_is_greeted(peer->session);
        }
    }
    for (int i = 0; i < peer_count; i++) { /* who was counted before stays */
        if (peers[i]->session != NULL && !peers[i]->counted) {
            admit(server, peers[i], &clients);
        }
    }
    count(server, peers, peer_count, clients);
    for (int i = 0; i < peer_count && !atomic_load(&server->stopping); i++) {
        if (peers[i]->session != NULL) {
            const vd_session_stats before = vd_session_get_stats(peers[i]->session);
            busy = serve(server, peers[i], job) || busy;
            hand_out(server, peers[i]);
            const vd_session_stats after = vd_session_get_stats(peers[i]->session);
            count_work(server, &before, &after);
        }
    }
    free(peers);
    forget_past(server, vd_server_now_s() - PAST_S);
    return busy;
}

/* Waits until something comes, or sessions are to be looked at again. */
static void wait_for_work(vd_server *server) {
    struct timespec until;
    clock_gettime(CLOCK_REALTIME, &until);
    pthread_mutex_lock(&server->lock);
    const double seconds = server->peers != NULL ? LOOK_S : 0.5;
    const long ns = until.tv_nsec + (long)(seconds * 1e9);
    until.tv_sec += ns / 1000000000;
    until.tv_nsec = ns % 1000000000;
    bool any = server->shots != NULL || atomic_load(&server->stopping);
    for (const vd_peer *peer = server->peers; peer != NULL; peer = peer->next) {
        any = any || peer->inbox != NULL || peer->gone;
    }
    if (!any) {
        (void)pthread_cond_timedwait(&server->work, &server->lock, &until);
    }
    pthread_mutex_unlock(&server->lock);
}

/* Tells everybody, frees what was waiting. */
static void wind_up(vd_server *server) {
    int peer_count = 0;
    vd_peer **peers = list_peers(server, &peer_count);
    for (int i = 0; i < peer_count; i++) {
        if (peers[i]->session != NULL) {
            vd_session_stop(peers[i]->session, VD_WIRE_STOPPING,
                            "the server stops; try again later");
            hand_out(server, peers[i]);
        }
    }
    free(peers);
    forget_past(server, vd_server_now_s() + 1.0);
    pthread_mutex_lock(&server->lock);
    server->rendered = true;
    vd_shot *shots = server->shots;
    server->shots = NULL;
    server->shot_count = 0;
    for (vd_shot *shot = shots, *next; shot != NULL; shot = next) {
        next = shot->next;
        shot->status = vd_failure(VD_ERROR_CANCELLED, "the server stops; try again later");
        shot->done = true;
        if (shot->abandoned) {
            free(shot);
        }
    }
    pthread_mutex_unlock(&server->lock);
    lws_cancel_service(server->network);
}

vd_status vd_server_render(vd_server *server, vd_job *job) {
    while (!atomic_load(&server->stopping)) {
        const bool busy = turn(server, job);
        if (vd_job_stopped(job)) {
            vd_server_stop(server);
        } else if (!busy) {
            wait_for_work(server);
        }
    }
    wind_up(server);
    return vd_success();
}

void vd_server_free_peers(vd_server *server) {
    while (server->peers != NULL) {
        vd_peer *next = server->peers->next;
        free_peer(server, server->peers);
        server->peers = next;
    }
    forget_past(server, 1e300);
}

#endif

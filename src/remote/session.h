/* session.h: one client of a server: what it holds, what it is sent, how fast.
 *
 *     receive ──► state, camera, settings            no sockets, no threads, no clock: bytes come
 *        work ──► decide, draw, pack ──► packets     in, packets go out, the caller says the time
 *
 * docs/wire.md says what happens when. A session never fails towards its caller: what a client does
 * wrong, and what goes wrong for it alone, ends it with an error message among its packets.
 */
#ifndef VEDUTA_REMOTE_SESSION_H
#define VEDUTA_REMOTE_SESSION_H

#include <veduta/impostor.h>
#include "remote/packed.h"
#include "remote/packet.h"

/* That a client must have: the sky and what is in front are beside the pictures of objects. */
#define VD_SESSION_LEAST_MEMORY ((uint64_t)4 << 20)

/* What sessions of one world and thread share. */
typedef struct vd_session_tools {
    vd_context *context;
    vd_wire *wire;
    vd_coder *coder;
    vd_codec_costs costs; /* of encoding, as measured here */
    uint8_t *packed;
    size_t packed_bytes;
    vd_frame *frame; /* of whole screens */
    vd_impostors
        *like; /* that all sessions' sets have the ground's tree of; null until the first */
    vd_impostor_pool *pool; /* of the pictures of all sessions' sets */
    vd_packed_cache sent;   /* of these, as they were packed last */
} vd_session_tools;

VD_MUST_USE vd_status vd_session_tools_init(vd_context *context, vd_session_tools *out);

/* After the sessions, before world and renderer. */
void vd_session_tools_finish(vd_session_tools *tools);

typedef struct vd_session_def {
    const vd_world *world;
    vd_world_renderer *renderer;
    vd_session_tools *tools; /* these three outlive the session */
    const char *token;       /* that clients must say; null: none. Borrowed */
    const char *name;        /* of the world, for people. Borrowed */
    size_t memory_bytes;     /* of a client's pictures, at most; the client may want less */
    double bytes_per_s;      /* at most; 0: as the link does */
    double budget_s;         /* of drawing pictures, a turn */
    size_t most_pixels;      /* of a client's screen */
    uint32_t seed;           /* another one for every session */
} vd_session_def;

/* 64 MiB, no limit, 15 ms, 2^23 pixels. */
vd_session_def vd_session_def_default(void);

typedef struct vd_session vd_session;

/* Returns VD_ERROR_MEMORY. */
VD_MUST_USE vd_status vd_session_create(const vd_session_def *def, double now_s, vd_session **out);
void vd_session_destroy(vd_session **session);

/* Takes an envelope in, that came at `now_s`. */
void vd_session_receive(vd_session *session, const void *data, size_t bytes, double now_s);

/* Whether a turn of work is due. */
bool vd_session_is_due(const vd_session *session, double now_s);

/* One turn: draws and packs for the newest camera, at most about a batch; nothing while the window
 * is full. Keeps watch over time. */
void vd_session_work(vd_session *session, vd_job *job, double now_s);

/* Looks only whether too much time has passed. */
void vd_session_watch(vd_session *session, double now_s);

/* The oldest packet, which is the caller's from now on; null: none. */
vd_packet *vd_session_take(vd_session *session);

/* Ends it with a bye. */
void vd_session_stop(vd_session *session, vd_wire_reason reason, const char *sentence);

/* Ends it with an error. */
void vd_session_fail(vd_session *session, vd_wire_fault code, const char *sentence);

/* Compares tokens in a time that says nothing of where they differ, nor of the wanted one's length.
 */
bool vd_token_matches(const char *wanted, const char *given);

/* Whether the connection is to be closed once its packets are sent. */
bool vd_session_is_over(const vd_session *session);

/* Whether hello was said and taken. */
bool vd_session_is_greeted(const vd_session *session);

/* ---- coming back ------------------------------------------------------------------------------
 * A client whose connection broke says what it still holds. `wants` is true after such a hello and
 * before the first work; `takes` moves the pictures of an older session that made them over; false
 * when that is not where they are from. */
bool vd_session_wants_past(const vd_session *session);
bool vd_session_takes_past(vd_session *session, vd_session *past);

/* ---- counters ---------------------------------------------------------------------------------*/

typedef struct vd_session_stats {
    uint64_t batches, bytes_sent, pictures, screens, cameras;
    uint64_t shared; /* pictures that another session's set had made */
    size_t in_flight_bytes, window_bytes, kept_bytes;
    double link_bytes_per_s, latency_s;
    double error_px; /* the greatest screen error of what the client shows */
    bool settled;
} vd_session_stats;

vd_session_stats vd_session_get_stats(const vd_session *session);

/* How many clients there are, for the stats that a client gets. */
void vd_session_set_clients(vd_session *session, int clients);

#endif

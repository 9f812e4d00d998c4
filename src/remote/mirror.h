/* mirror.h: the client's half of a session: what a server sent, kept and shown.
 *
 *     receive ──► pictures, order, screen ──► draw        no sockets, no clock: bytes come in,
 *        look ──► work ──► packets                        packets go out, the caller says the time
 *
 * The other half is session.h; docs/wire.md says what happens when. Whatever the bytes are, they
 * end in a state with a sentence. A lock stands between one thread that opens, receives, works and
 * takes, one that draws, and any that look or ask for news; it is never held while something is
 * unpacked or drawn.
 */
#ifndef VEDUTA_REMOTE_MIRROR_H
#define VEDUTA_REMOTE_MIRROR_H

#include <veduta/client.h>
#include "remote/session.h"

typedef struct vd_mirror_def {
    const char *token; /* null: none. Borrowed, as name */
    const char *name;  /* for people at the server; null: none */
    size_t memory_bytes;
    bool no_models;     /* nothing is drawn here but pictures, and: */
    uint32_t particles; /* that are drawn here for a frame; at most VD_PLACED_PARTICLES */
    vd_wire_settings settings;
} vd_mirror_def;

typedef struct vd_mirror vd_mirror;

/* Returns VD_ERROR_ARGUMENT (settings, memory_bytes) or VD_ERROR_MEMORY. */
VD_MUST_USE vd_status vd_mirror_create(vd_context *context, const vd_mirror_def *def,
                                       vd_mirror **out);
void vd_mirror_destroy(vd_mirror **mirror);

/* The transport is open: says hello, with what is still held. */
void vd_mirror_open(vd_mirror *mirror, double now_s);

/* Takes an envelope in. */
void vd_mirror_receive(vd_mirror *mirror, const void *data, size_t bytes, double now_s);

/* Sends the newest camera if none is unanswered; keeps watch over time. */
void vd_mirror_work(vd_mirror *mirror, double now_s);

/* Says goodbye. */
void vd_mirror_leave(vd_mirror *mirror);

/* The oldest packet, released by vd_release; null: none. */
vd_packet *vd_mirror_take(vd_mirror *mirror);

/* Whether the transport is to be closed. */
bool vd_mirror_is_over(vd_mirror *mirror);

/* The transport is closed, or could not be opened. A state that was reached before stays where no
 * further try will help. */
void vd_mirror_lose(vd_mirror *mirror, const char *sentence);

/* Ends for good. */
void vd_mirror_refuse(vd_mirror *mirror, const char *sentence);

/* Whether to try again. */
bool vd_mirror_may_open(vd_mirror *mirror);

/* As the functions of client.h. */
void vd_mirror_look(vd_mirror *mirror, const vd_camera *camera, int width, int height);
VD_MUST_USE vd_status vd_mirror_set(vd_mirror *mirror, const vd_wire_settings *settings);
VD_MUST_USE vd_status vd_mirror_draw(vd_mirror *mirror, vd_job *job, const vd_camera *camera,
                                     vd_frame *frame, vd_client_shown *shown);
void vd_mirror_get_news(vd_mirror *mirror, vd_client_news *out);
double vd_mirror_ground(vd_mirror *mirror, double x, double y);

#endif

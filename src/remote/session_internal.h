/* session_internal.h: the insides of a vd_session. */
#ifndef VEDUTA_REMOTE_SESSION_INTERNAL_H
#define VEDUTA_REMOTE_SESSION_INTERNAL_H

#include "remote/session.h"

typedef enum vd_session_state {
    VD_SESSION_ACCEPTED = 0, /* waits for a hello */
    VD_SESSION_SERVING,
    VD_SESSION_OVER
} vd_session_state;

enum { VD_SESSION_FLIGHTS = 64, VD_SESSION_MESSAGES = 256 };

/* A batch that was sent and not acknowledged. */
typedef struct vd_flight {
    uint32_t batch;
    size_t bytes;
    double sent_s;
} vd_flight;

/* How fast the client takes things in; see session_link.c. */
typedef struct vd_session_link {
    vd_flight flights[VD_SESSION_FLIGHTS]; /* a ring */
    int first, count;
    size_t in_flight;
    double bytes_per_s; /* as measured */
    double measured_s;  /* when that was */
    double acked_s;     /* the last acknowledgement */
    double free_s;      /* when the limit lets more through */
} vd_session_link;

enum { VD_SESSION_GROUND_SIDE = 65 };

/* Which heights the client was sent last. */
typedef struct vd_session_ground {
    bool sent;
    double x, y, reach_m; /* around there, so far to each side */
} vd_session_ground;

enum { VD_SESSION_PARTS = 6 };

/* A picture of map furniture. */
typedef struct vd_session_part {
    bool held;  /* by the client, as sent last */
    bool shown; /* belongs to the furniture of now */
    int box[4]; /* of the picture: x0, y0, x1, y1 */
    uint64_t hash;
    size_t bytes;
} vd_session_part;

struct vd_session {
    vd_session_def def;
    vd_context *context;
    vd_session_state state;
    vd_packet_queue packets; /* to be sent */
    vd_wire_buffer buffer;
    double created_s, heard_s, pinged_s, told_s; /* told: of stats */
    double counted_s;                            /* since when messages are counted */
    int counted;
    int clients;

    vd_wire_hello hello; /* without its pointers */
    uint64_t *past_ids;  /* [past_count]: what the client says it holds, until it was looked at */
    uint32_t *past_versions;
    int past_count;
    vd_wire_settings settings;
    vd_wire_camera camera; /* the newest; sequence 0: none yet */
    double camera_s;       /* when it came */
    bool camera_is_new;    /* nothing was done for it yet */

    vd_impostors *set; /* null until the first camera */
    vd_session_link link;
    uint32_t batch; /* number of the last */

    /* The batch that is being filled. */
    vd_wire_message messages[VD_SESSION_MESSAGES];
    int message_count;
    size_t message_bytes;
    uint8_t *arena; /* pictures of these messages */
    size_t arena_used;
    size_t turn_bytes; /* sent in this turn */

    vd_session_part parts[VD_SESSION_PARTS];
    vd_wire_camera part_camera; /* that they were looked at for last, */
    double part_s;              /* and when */
    uint32_t part_version;
    bool part_lost;  /* by the client */
    uint64_t *order; /* [order_room]: ids of an order that has them too */
    int order_room;

    vd_session_ground ground;
    float heights[VD_SESSION_GROUND_SIDE][VD_SESSION_GROUND_SIDE]; /* of the message */
    bool lit;                                                      /* the client knows the light */
    uint64_t order_hash;                                           /* of the last order sent */
    bool ordered;          /* what the client shows is an order, not a screen in its place */
    bool exact;            /* the client has the exact picture of its camera */
    int quality;           /* of moving screens */
    uint32_t screen;       /* sequence of the camera of the last screen */
    double screen_again_s; /* none stands in for an order before */
    double next_s;         /* nothing is due before */
    vd_session_stats stats;
};

/* ---- session_link.c ---- */
void vd_link_sent(vd_session_link *link, uint32_t batch, size_t bytes, double limit, double now_s);

/* False when the batch was never sent, or acknowledged before. */
bool vd_link_acknowledged(vd_session_link *link, uint32_t batch, double now_s);
size_t vd_link_window(const vd_session_link *link);

/* Whether more may be sent. */
bool vd_link_is_open(const vd_session_link *link, double now_s);

/* ---- session_send.c ---- */

/* Sends one message at once, outside of batches and of the window. */
void vd_session_say(vd_session *session, const vd_wire_message *message);

/* Adds a message to the batch; what is full is sent before. Pictures and ids must live until
 * vd_session_flush; vd_session_keep copies bytes to where they do. */
void vd_session_add(vd_session *session, const vd_wire_message *message, double now_s);
void vd_session_flush(vd_session *session, double now_s);

/* Packs a picture, or what the client draws itself, and adds it. */
void vd_session_add_item(vd_session *session, const vd_impostor_item *item, double now_s);

/* Wall seconds from any moment on: how long something takes here, whatever the session's clock. */
double vd_session_seconds(void);

/* Packs a picture that is fixed to the screen, without loss, and adds it. */
void vd_session_add_fixed(vd_session *session, const vd_impostor_item *item, double now_s);

/* Packs a frame and sends it as a screen; `exact` frames without loss. False when it is too large
 * for that. */
bool vd_session_send_screen(vd_session *session, const vd_frame *frame, bool exact, double now_s);

/* Codecs that the client takes. */
unsigned vd_session_codecs(const vd_session *session);

/* ---- session_ground.c ---- */

/* Adds the heights around the newest camera, where the client wants them and has others. */
void vd_session_add_ground(vd_session *session, double now_s);

/* ---- session_overlay.c ---- */

/* Of a client's memory, bytes for map furniture; 0: there is none, or none for this client. */
size_t vd_session_overlay_bytes(const vd_session *session);

/* Sends what has changed of it; `rests`: now and not in a while. */
VD_MUST_USE vd_status vd_session_add_overlay(vd_session *session, vd_job *job, bool rests,
                                             double now_s);

/* Writes the ids of what is shown of it into ids[VD_SESSION_PARTS]; returns how many. */
int vd_session_overlay_ids(const vd_session *session, uint64_t *ids);

/* The client has dropped a picture, of anything. */
void vd_session_lose_overlay(vd_session *session, uint64_t id);

/* ---- session.c ---- */
bool vd_session_same_view(const vd_wire_camera *a, const vd_wire_camera *b);

/* ---- session_work.c ---- */

/* The tools' frame, of the newest camera's size; what it shows holds until the next call. */
VD_MUST_USE vd_status vd_session_screen_frame(vd_session *session, vd_frame **out);
void vd_session_forget_pictures(vd_session *session);

#endif

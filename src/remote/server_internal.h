/* server_internal.h: the insides of a vd_server: two threads and what they hand to each other.
 *
 *   network thread                         rendering thread
 *     receives ──► inbox of a peer ──────────► session
 *     sends    ◄── outbox of a peer ◄───────── session
 *     answers  ◄── a shot ◄──► ─────────────── draws it
 *
 * The lock is held for pushing and taking pointers, nothing else. A peer is freed by the rendering
 * thread alone, after the network thread has marked it as gone and forgotten it.
 */
#ifndef VEDUTA_REMOTE_SERVER_INTERNAL_H
#define VEDUTA_REMOTE_SERVER_INTERNAL_H

#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <veduta/server.h>
#include "remote/session.h"

struct lws;
struct lws_context;
struct lws_vhost;

/* Bytes and messages of a client that wait for the rendering thread: what is beyond stays in the
 * network. */
#define VD_INBOX_BYTES ((size_t)1 << 20)
#define VD_INBOX_MESSAGES 64

/* Of one message from a client: a hello with all that can be held. */
#define VD_MESSAGE_MOST ((size_t)1 << 20)

/* Pictures asked for over HTTP that wait, and their largest size. */
#define VD_SHOTS_MOST 8
#define VD_SHOT_PIXELS ((size_t)1 << 25)

/* Something that came. */
typedef struct vd_received {
    struct vd_received *next;
    double at_s;
    size_t bytes;
    uint8_t data[];
} vd_received;

/* A client's connection. */
typedef struct vd_peer {
    struct vd_peer *next;
    vd_received *inbox, **inbox_end; /* lock */
    size_t inbox_bytes;
    int inbox_count;
    vd_packet *outbox, **outbox_end; /* lock */
    bool gone;                       /* lock; by the network thread */
    bool over;                       /* lock; by the rendering thread: close it when all is sent */

    struct lws *wsi; /* network thread */
    vd_received *partial;
    size_t partial_room;
    bool paused;

    vd_session *session; /* rendering thread */
    bool counted;        /* among the clients */
} vd_peer;

/* A picture asked for over HTTP. */
typedef struct vd_shot {
    struct vd_shot *next;
    int width, height;
    char camera[256];     /* empty: the usual one */
    bool done, abandoned; /* lock */
    vd_status status;
    uint8_t *png; /* by malloc */
    size_t png_bytes;
} vd_shot;

/* Something that is served as it is. */
typedef struct vd_server_file {
    char *path; /* from the root, with the slash */
    const char *type;
    uint8_t *data;
    size_t bytes;
} vd_server_file;

typedef struct vd_server_counters {
    int clients;
    uint64_t accepted, refused, batches, bytes_sent, pictures, screens, frames;
    size_t kept_bytes;
} vd_server_counters;

enum { VD_PAST_MOST = 8 };

/* A session whose connection broke. */
typedef struct vd_past {
    vd_session *session;
    double since_s;
} vd_past;

/* What is said to and by one client. */
typedef struct vd_recording {
    FILE *file;          /* null: nothing is recorded, or no more */
    char *name;          /* that it has until it is whole */
    const vd_peer *peer; /* null: none has come */
    double begun_s;
    uint64_t bytes;
    bool failed;
} vd_recording;

struct vd_server {
    vd_context *context;
    vd_server_def def;
    vd_server_file *files;
    size_t file_count;
    bool has_page;
    struct lws_context *network;
    void *protocols; /* of it */
    int port;
    int connections; /* network thread: of any kind */
    pthread_mutex_t lock;
    pthread_cond_t work; /* something came */
    atomic_bool stopping;
    vd_peer *peers; /* lock */
    int peer_count;
    vd_shot *shots; /* lock; newest last */
    int shot_count;
    vd_server_counters counters; /* lock */
    bool rendered;               /* lock: the rendering thread has returned */

    vd_session_tools tools; /* rendering thread */
    vd_past past[VD_PAST_MOST];
    uint32_t sessions; /* so far */
    vd_recording recording;
};

double vd_server_now_s(void);

/* ---- server_files.c ---- */

/* Reads the page. Returns VD_ERROR_IO, VD_ERROR_LIMIT or VD_ERROR_MEMORY. */
VD_MUST_USE vd_status vd_server_read_files(vd_server *server);
void vd_server_forget_files(vd_server *server);
const vd_server_file *vd_server_find_file(const vd_server *server, const char *path);

/* ---- server_png.c ---- */

/* Packs a frame as PNG; *out by malloc. */
VD_MUST_USE vd_status vd_server_png(const vd_frame *frame, uint8_t **out, size_t *bytes);

/* ---- server_http.c, server_socket.c: callbacks of libwebsockets ---- */
int vd_server_http(struct lws *wsi, int reason, void *user, void *in, size_t length);
size_t vd_server_http_bytes(void);
int vd_server_socket(struct lws *wsi, int reason, void *user, void *in, size_t length);
size_t vd_server_socket_bytes(void);

/* ---- server_record.c: the rendering thread, or before and after it ---- */

/* Opens the file of a recording, where one is wanted. Returns VD_ERROR_IO or VD_ERROR_MEMORY. */
VD_MUST_USE vd_status vd_server_record(vd_server *server);

/* Takes down what a client said, after its session has taken it in, and what it is sent. */
void vd_server_record_message(vd_server *server, const vd_peer *peer, const vd_received *message);
void vd_server_record_packet(vd_server *server, const vd_peer *peer, const vd_packet *packet);

/* Ends the recording where it is of that peer; null: where none has come. */
void vd_server_end_recording(vd_server *server, const vd_peer *peer);

/* ---- server_render.c ---- */
void vd_server_free_peers(vd_server *server);

/* Looks what the rendering thread has made. */
void vd_server_wake_peers(vd_server *server);

#endif

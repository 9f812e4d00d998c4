/* server.h: a world on one port: the page, the socket of the wire, and a few pictures over HTTP.
 *
 * Part of the library veduta-remote, where that was built with libwebsockets.
 *
 *     status = vd_server_create(context, &def, &server);       // listens from here on
 *     one thread:  status = vd_server_render(server, job);     // decides, draws and packs
 *     another:     status = vd_server_listen(server);          // receives and sends
 *     any, or a signal: vd_server_stop(server);                // both return
 *     vd_server_destroy(&server);
 *
 * The rendering thread never waits for the network: what clients say waits for it, what it has for
 * them waits for the network, and both queues have bounds. docs/serve.md describes what is served,
 * docs/wire.md what is said over the socket.
 */
#ifndef VEDUTA_SERVER_H
#define VEDUTA_SERVER_H

#include <veduta/world.h>

VD_BEGIN_DECLARATIONS

/* The path of the WebSocket and its subprotocol. */
#define VD_SERVER_SOCKET "/socket"
#define VD_SERVER_PROTOCOL "veduta"

/* Makes a camera of what `/frame.png?camera=` says (null: the usual one) for a picture's size.
 * Returns VD_ERROR_ARGUMENT with a sentence for who asked. Called by the rendering thread. */
typedef vd_status vd_server_camera_function(void *user, const char *text, int width, int height,
                                            vd_camera *out);

/* What pointers point to must outlive the server. */
typedef struct vd_server_def {
    const vd_world *world;
    vd_world_renderer *renderer;   /* of that world; the rendering thread's alone while it runs */
    const char *name;              /* of the world, for people; null: "" */
    const char *address;           /* to listen at, IPv4 or IPv6; null: 127.0.0.1 */
    int port;                      /* 0: a free one */
    const char *certificate, *key; /* PEM files: TLS 1.2 or later; null: none */
    const char *token;             /* 1 … VD_WIRE_TOKEN_BYTES bytes, that clients must say */
    const char *root; /* folder of the page, read once; null or missing: a page that says so */
    const char *world_json;            /* what /world.json answers; null: {} */
    vd_server_camera_function *camera; /* null: no /frame.png */
    void *camera_user;
    int max_clients;     /* 1 … 4096 */
    double bytes_per_s;  /* a client, at most; 0: as the link does */
    size_t memory_bytes; /* of a client's pictures, at most; at least 4 MiB */
    const char *record;  /* file for what is said to and by the first client, up to its end
                            (docs/wire.md); null: none. Its token is not in it */
} vd_server_def;

/* Loopback, any port, 32 clients, 64 MiB each. */
VD_API vd_server_def vd_server_def_default(void);

typedef struct vd_server vd_server;

/* Binds the port. Returns VD_ERROR_ARGUMENT (a field, by name), VD_ERROR_IO (the address cannot be
 * listened at, the certificate or the page cannot be read, the recording not written),
 * VD_ERROR_UNSUPPORTED (built without libwebsockets) or VD_ERROR_MEMORY. */
VD_API VD_MUST_USE vd_status vd_server_create(vd_context *context, const vd_server_def *def,
                                              vd_server **out);

/* After both threads have returned. */
VD_API void vd_server_destroy(vd_server **server);

VD_API int vd_server_port(const vd_server *server);

/* Whether a page was found at the root. */
VD_API bool vd_server_has_page(const vd_server *server);

/* Receives and sends until the server is stopped and clients have been told, at most 2 s later.
 * Returns VD_ERROR_IO when the network gives up. */
VD_API VD_MUST_USE vd_status vd_server_listen(vd_server *server);

/* Serves clients in turn until the server is stopped. Opens parallel loops of the context. `job`
 * may be null; cancelling it cuts a picture short and stops the server. */
VD_API VD_MUST_USE vd_status vd_server_render(vd_server *server, vd_job *job);

/* Any thread, more than once, and async-signal-safe. */
VD_API void vd_server_stop(vd_server *server);

VD_END_DECLARATIONS

#endif

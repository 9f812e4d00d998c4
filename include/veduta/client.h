/* client.h: a server's world on this machine: what it sends is kept and drawn here.
 *
 * Part of the library veduta-remote, where that was built with libwebsockets.
 *
 *     status = vd_client_create(context, &def, &client);      // a thread of its own connects
 *     every frame: vd_client_look(client, &camera, width, height);
 *                  status = vd_client_draw(client, job, &camera, frame, &shown);
 *     now and then: vd_client_get_news(client, &news);        // connecting, lost, refused …
 *     vd_client_destroy(&client);
 *
 * Drawing never waits for the network: it shows what is there. A connection that breaks is made
 * again, later each time, and what was there stays on show meanwhile. What a server sends is
 * checked before it is used, and takes no more memory than was stated. docs/wire.md has the states,
 * docs/serve.md the server.
 */
#ifndef VEDUTA_CLIENT_H
#define VEDUTA_CLIENT_H

#include <veduta/frame.h>
#include <veduta/job.h>
#include <veduta/wire.h>

VD_BEGIN_DECLARATIONS

typedef enum vd_client_state {
    VD_CLIENT_CONNECTING = 0, /* for the first time */
    VD_CLIENT_LOADING,        /* let in; nothing to be seen has come yet */
    VD_CLIENT_SHOWING,
    VD_CLIENT_LOST,       /* tries again; what was there is still shown */
    VD_CLIENT_REFUSED,    /* by the server, or by this side; does not try again */
    VD_CLIENT_MISMATCHED, /* of another version of the wire; does not try again */
    VD_CLIENT_ENDED,      /* the server said goodbye for good */
    VD_CLIENT_STATE_COUNT
} vd_client_state;

/* Returns "connecting", "loading", "showing", "lost", "refused", "mismatched" or "ended"; null
 * outside. */
VD_API const char *vd_client_state_name(vd_client_state state);

/* What pointers point to need not outlive vd_client_create, but for `wake`'s. */
typedef struct vd_client_def {
    const char *url;     /* http[s]://HOST[:PORT]/#token=TOKEN, as `veduta serve` prints it */
    bool insecure;       /* take any certificate */
    bool wants_world;    /* also ask for /world.json */
    size_t memory_bytes; /* of pictures and models, at most; 4 MiB … 1 TiB */
    bool no_models;      /* nothing is drawn here but pictures, and: */
    uint32_t particles;  /* that are drawn here for a frame, at most; 0 … 2^20 */
    vd_wire_settings settings;
    void (*wake)(void *user); /* something new came; called by the client's thread; null: nobody */
    void *wake_user;
} vd_client_def;

/* 64 MiB; 2^18 particles; impostors, 1 pixel, every codec, no limit. */
VD_API vd_client_def vd_client_def_default(void);

typedef struct vd_client vd_client;

/* Starts the thread; does not wait for a connection. *out is owned by the caller. Returns
 * VD_ERROR_ARGUMENT (the address, or a field by name), VD_ERROR_UNSUPPORTED (built without
 * libwebsockets) or VD_ERROR_MEMORY. The context must allow allocation from several threads. */
VD_API VD_MUST_USE vd_status vd_client_create(vd_context *context, const vd_client_def *def,
                                              vd_client **out);

/* Says goodbye, ends the thread. */
VD_API void vd_client_destroy(vd_client **client);

/* Says from where the world is seen: the newest replaces those before. Cameras that the wire cannot
 * carry (vd_wire_check) are left out. Any thread; never waits for the network. */
VD_API void vd_client_look(vd_client *client, const vd_camera *camera, int width, int height);

/* Asks to be served otherwise from now on. Any thread. Returns VD_ERROR_ARGUMENT. */
VD_API VD_MUST_USE vd_status vd_client_set(vd_client *client, const vd_wire_settings *settings);

/* Cuts the connection, as a network does that breaks, for tests: it is made again after a while. */
VD_API void vd_client_cut(vd_client *client);

typedef struct vd_client_shown {
    int quads;
    int models;  /* drawn here, and bricks of particles */
    bool screen; /* a whole screen stands in for them */
    bool exact;  /* and is the very picture of this camera, without loss */
} vd_client_shown;

/* Draws what is there into all of the frame; transparent where there is nothing. `shown` may be
 * null. One thread at a time; opens parallel loops of the context. Returns VD_ERROR_MEMORY or
 * VD_ERROR_CANCELLED. */
VD_API VD_MUST_USE vd_status vd_client_draw(vd_client *client, vd_job *job, const vd_camera *camera,
                                            vd_frame *frame, vd_client_shown *shown);

typedef struct vd_client_news {
    vd_client_state state;
    char sentence[VD_MESSAGE_BYTES]; /* of lost, refused, mismatched, ended: why, for people */
    double retry_s;                  /* lost: seconds until the next try */
    uint64_t version;                /* one more whenever something new is to be seen */
    uint64_t bytes, batches, pictures, screens, connections, cameras, answers;
    size_t held_bytes, most_held_bytes; /* of pictures; most: so far */
    int held, ordered;
    double answer_s;    /* from a camera's message to the first picture after it, the last one */
    vd_wire_stats last; /* of the server, for people; zeros before the first */
} vd_client_news;

/* Any thread. */
VD_API void vd_client_get_news(vd_client *client, vd_client_news *out);

/* Copies what /world.json answered into out[room], NUL-terminated; false before that, or when there
 * is no room. At most 64 KiB; unchecked: what a server says. Any thread. */
VD_API bool vd_client_get_world(vd_client *client, char *out, size_t room);

/* Height of the ground at a place near the eye, metres, to keep above it; −infinity where it is not
 * known, or there is none. Any thread. */
VD_API double vd_client_ground(vd_client *client, double x, double y);

VD_END_DECLARATIONS

#endif

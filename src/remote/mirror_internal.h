/* mirror_internal.h: the insides of a vd_mirror. */
#ifndef VEDUTA_REMOTE_MIRROR_INTERNAL_H
#define VEDUTA_REMOTE_MIRROR_INTERNAL_H

#include <pthread.h>
#include <veduta/display.h>
#include "remote/mirror.h"

/* Cameras that a screen may belong to: at most one is unanswered, so they are few. */
enum { VD_MIRROR_CAMERAS = 64 };

/* Pixels, a model or a brick, shared between what is held and what is being drawn. */
typedef struct vd_kept {
    int references; /* lock */
    size_t bytes;   /* that it counts */
    int width, height;
    uint8_t *rgba;   /* [height][width][4]; null: */
    vd_model *model; /* to be placed by instances; null: */
    vd_brick_block *brick;
} vd_kept;

/* What the server sent by an id: a picture, a model, a brick, or a place of a model. */
typedef struct vd_held {
    uint64_t id;
    uint32_t version;
    vd_vec3 corners[4];
    int opaque[4];
    bool fixed;             /* to the screen: corners are in camera space */
    vd_kept *kept;          /* null: a place */
    vd_wire_instance place; /* whose model may come later, or never */
} vd_held;

/* A whole frame in place of pictures. */
typedef struct vd_mirror_screen {
    vd_kept *kept; /* null: none */
    bool exact;
    bool known; /* its camera: */
    vd_wire_camera camera;
} vd_mirror_screen;

struct vd_mirror {
    vd_context *context;
    vd_mirror_def def;
    pthread_mutex_t lock;

    vd_client_news news; /* lock: of all until the next heading */
    vd_held **held;      /* [held_count], by ascending id */
    int held_count, held_room;
    uint64_t *order; /* [order_count] */
    int order_count, order_room;
    bool absurd; /* the server ordered more than a frame can be drawn of */
    vd_mirror_screen screen;
    vd_wire_ground ground; /* columns 0: none has come; its heights are: */
    float heights[VD_WIRE_GROUND_SIDE * VD_WIRE_GROUND_SIDE];
    vd_light light; /* of what is placed */
    bool has_light;
    vd_wire_camera wanted; /* the newest; width 0: none yet */
    bool wanted_is_new;
    vd_wire_settings settings;
    bool settings_are_new;

    /* The network's thread alone. */
    vd_wire *wire;
    vd_coder *coder;
    vd_wire_buffer buffer;
    vd_packet_queue packets;
    bool open, greeted, over;
    bool unanswered; /* a camera is */
    bool measuring;  /* no picture came since the camera of: */
    double camera_s, opened_s, heard_s, pinged_s;
    uint32_t sequence, batch;
    int walked; /* ids of orders, by the replacements of the envelope that is taken in */
    vd_wire_camera sent[VD_MIRROR_CAMERAS]; /* a ring, by sequence */
    size_t most_pixels;                     /* of a camera sent */
    uint64_t *ids;                          /* for hello */
    uint32_t *versions;

    /* The drawing thread alone. */
    vd_display *display;
    vd_placer *placer;
    vd_quad *quads;
    vd_placed *placed; /* [quad_room], as all of these */
    int *behind;       /* how many quads are behind each of them */
    vd_kept **drawn;   /* of quads and models */
    int quad_room;
};

/* ---- mirror.c ---- */

void vd_mirror_say(vd_mirror *mirror, const vd_wire_message *message);

/* Tells the server what it did wrong, and ends for good. */
void vd_mirror_fail(vd_mirror *mirror, vd_wire_fault code, const char *sentence);

/* Under the lock. */
void vd_mirror_end(vd_mirror *mirror, vd_client_state state, const char *sentence);

/* ---- mirror_take.c ---- */

/* Takes a message of a greeted server. */
void vd_mirror_take_message(vd_mirror *mirror, const vd_wire_message *message, double now_s);

/* Bytes that something held counts. */
size_t vd_mirror_bytes(const vd_held *held);

/* Under the lock. */
void vd_mirror_release(vd_mirror *mirror, vd_kept *kept);
vd_held *vd_mirror_find(const vd_mirror *mirror, uint64_t id);
void vd_mirror_forget(vd_mirror *mirror);

/* Whether two cameras see the same, to the bit. */
bool vd_same_view(const vd_wire_camera *a, const vd_wire_camera *b);

/* ---- mirror_geometry.c ---- */

/* Whether so many bytes more can be held under an id; asked before they are made. Tells the server
 * if not. */
bool vd_mirror_fits(vd_mirror *mirror, uint64_t id, size_t bytes);

/* Holds what `made` says in place of what its id had; takes what it keeps over. False, and told,
 * when memory is out. */
bool vd_mirror_hold(vd_mirror *mirror, const vd_held *made);

void vd_mirror_out_of_memory(vd_mirror *mirror);
void vd_mirror_take_geometry(vd_mirror *mirror, const vd_wire_geometry *geometry);
void vd_mirror_take_instance(vd_mirror *mirror, const vd_wire_instance *instance);
void vd_mirror_take_light(vd_mirror *mirror, const vd_light *light);
void vd_mirror_take_ground(vd_mirror *mirror, const vd_wire_ground *ground);

#endif

/* impostor_set.h: the insides of a vd_impostors.
 *
 * A node is one of the world's tree, or behind those a patch of the ground (impostor_ground.h). A
 * slot holds what is known of a node: its picture, if it has one, and how it was shown last, so
 * that nothing flips. Slots are made when a node is first asked about and stay; pictures come and
 * go.
 */
#ifndef VEDUTA_IMPOSTOR_IMPOSTOR_SET_H
#define VEDUTA_IMPOSTOR_IMPOSTOR_SET_H

#include <veduta/display.h>
#include <veduta/impostor.h>
#include "core/buffer.h"
#include "core/list.h"
#include "impostor/impostor_ground.h"
#include "impostor/impostor_plane.h"
#include "terrain/horizon.h"

/* Transparent pixels around each picture, so that its edge fades out when it is filtered. */
#define VD_IMPOSTOR_PAD 2

/* A picture whose pixels several sets may have; see impostor_pool.h. */
typedef struct vd_pooled vd_pooled;

/* A thread that draws pictures; see impostor_painter.h. */
typedef struct vd_impostor_painter vd_impostor_painter;

/* A picture on a plane. */
typedef struct vd_impostor_picture {
    vd_impostor_plane plane;
    uint8_t *rgba; /* [height][width][4], premultiplied; null: there is none */
    int width, height;
    int opaque[4];   /* see vd_quad_picture */
    double focal_px; /* of the camera that it was made for */
    bool empty;      /* nothing is on it */
    unsigned sides;  /* of a patch: on which it goes on beyond the patch, vd_impostor_sides */
    bool is_hidden; /* ground before it hides some of it or soon may: the nearest edge of that is …
                     */
    vd_vec3 hiding; /* … here */
    uint32_t version;
    size_t packed;     /* bytes on the link; 0: as many as the pixels take */
    vd_pooled *pooled; /* that the pixels belong to; null: they are the set's alone */
} vd_impostor_picture;

/* Of its pixels; 0 where there is none. */
static inline size_t vd_impostor_picture_bytes(const vd_impostor_picture *p) {
    return p->rgba != NULL ? 4 * (size_t)p->width * (size_t)p->height : 0;
}

typedef struct vd_impostor_slot {
    uint32_t node;
    bool split;     /* its children were shown last */
    bool empty;     /* its picture shows nothing: nothing is shown */
    bool coming;    /* a picture of it is on the link */
    bool delivered; /* the client of `ship` has one */
    bool changed;   /* what is on it has, since it was made */
    bool restless;  /* again and again */
    bool in_front;  /* of particles apart: they come before something of the picture in front … */
    uint32_t parted;   /* … as was found out for this version */
    uint64_t left_out; /* number of the last update that had no memory for its picture */
    uint64_t changes;  /* number of the update after which it changed last */
    uint32_t since;    /* version of the newest picture that shows it as it was */
    size_t bytes;      /* of the newest picture, there or given up */
    uint32_t failures;
    double retry_s;                  /* not drawn again before */
    double born_s;                   /* when the picture came */
    uint64_t born;                   /* number of the last update before that, or amidst */
    double error_px;                 /* when it was shown last */
    uint64_t used;                   /* number of the last update that showed it */
    uint64_t asked;                  /* and of the last that wished for its picture */
    vd_impostor_picture now, before; /* `before` fades out */
} vd_impostor_slot;

/* A picture on the link. */
typedef struct vd_impostor_sending {
    vd_impostor_picture picture;
    uint32_t slot;
    double arrives_s;
} vd_impostor_sending;

/* Where one of those stands that are shown. */
typedef struct vd_impostor_rank {
    double distance2; /* of the camera from the middle of its bounds, squared */
    uint32_t slot;
} vd_impostor_rank;

/* What an update wants to draw. */
typedef struct vd_impostor_wish {
    uint32_t slot;
    bool finer;   /* only because the picture there is coarser than the screen, or lacks an edge */
    double area;  /* pixels on screen, about */
    double worth; /* screen error × area; of what is not seen yet less */
} vd_impostor_wish;

/* A picture for a client that belongs to no slot: a side of the sky, or what is in front. */
typedef struct vd_impostor_extra {
    uint64_t id;
    uint32_t version; /* 0: none yet */
    bool delivered;
    vd_vec3 corners[4];
    uint8_t *rgba; /* [height][width][4]; null: there is nothing on it */
    int width, height;
    size_t room;     /* bytes of rgba */
    uint64_t shared; /* number of its pixels, which are the pool's; 0: they are the set's */
} vd_impostor_extra;

#define VD_SKY_SIDES 6

/* The last of these is what is in front. */
#define VD_EXTRAS (VD_SKY_SIDES + 1)

/* What the picture in front was made of and for. */
typedef struct vd_impostor_front {
    vd_camera camera; /* of its frame, cut nowhere */
    int width, height;
    uint64_t contents; /* hash */
    double half_range; /* half of 1 / nearest - 1 / farthest of what is in it */
    bool wanted;       /* there is something in it */
} vd_impostor_front;

/* The ground's depth, coarsely. */
typedef struct vd_impostor_relief {
    vd_frame *frame;
    size_t pixels;
} vd_impostor_relief;

/* Frames that are drawn into and used at once: sets with a pool have the pool's. */
typedef struct vd_impostor_scratch {
    vd_frame *canvas; /* where pictures are drawn, of the largest size so far */
    size_t canvas_pixels;
    vd_frame *front; /* what is drawn itself, over patches */
    size_t front_pixels;
    vd_impostor_relief relief;
    vd_frame *wide; /* what the picture in front is cut out of */
    size_t wide_pixels;
    vd_frame *still; /* the whole, aligned with the screen; see impostor_still.c */
    size_t still_pixels;
    const vd_impostors *still_of; /* that drew it last */
} vd_impostor_scratch;

/* How coarsely something is drawn with every frame, 0: as fine as the frame, and since how many
 * frames. */
typedef struct vd_impostor_pace {
    int level, frames;
    int last; /* the coarsest level that is good enough */
} vd_impostor_pace;

/* A model of the world, as a client has it. */
typedef struct vd_impostor_model {
    size_t bytes;     /* packed; 0: not asked yet */
    uint32_t version; /* of what was sent last */
    bool delivered, gone;
    bool refused;  /* the client did not keep it */
    uint64_t used; /* number of the last update that chose an instance */
} vd_impostor_model;

/* An instance, or an object of particles, that a client draws, drew or could draw. */
typedef struct vd_impostor_stand {
    uint32_t node, version;
    double distance; /* metres, when it was last looked at */
    bool chosen, delivered, gone;
    bool left; /* something hid it, or it did not fit, seen from: */
    vd_vec3 left_from;
    vd_place place;     /* of an instance, which is delivered itself; particles are as bricks */
    uint64_t chosen_at; /* number of the last update that chose it; of particles */
} vd_impostor_stand;

/* A node of a brick file, as a client has it. */
typedef struct vd_impostor_brick {
    uint32_t asset, node, version;
    size_t bytes; /* packed, about until it was */
    bool delivered, gone;
    bool refused;  /* it is damaged, or the client did not keep it */
    uint64_t used; /* number of the last update that had use for it */
} vd_impostor_brick;

/* A brick file, as a client has it. */
typedef struct vd_impostor_file {
    uint32_t *parents;  /* [node_count] of each node; null: nothing of the file was asked for */
    uint32_t *brick_of; /* [node_count]: brick + 1; 0: none */
    uint8_t *marks;     /* [node_count]: see impostor_bricks.c; zeros between choices */
    uint8_t *whole;     /* [node_count]: children that are whole, or not in sight; zeros */
} vd_impostor_file;

/* See impostor_placed.c. */
typedef struct vd_impostor_placing {
    vd_impostor_model *models; /* [assets]; null until something is chosen */
    uint32_t *stand_of;        /* [world->node_count]: stand + 1; 0: none */
    vd_list stands;            /* vd_impostor_stand */
    vd_list before;            /* `direct` before any was chosen */
    vd_list chosen;            /* uint32_t stands of instances, the nearest first */
    vd_list clouds;            /* the same of particles */
    vd_impostor_file *files;   /* [assets]; null until particles are asked for */
    vd_list bricks;            /* vd_impostor_brick */
    vd_list cut;               /* uint32_t bricks of the clouds, back to front */
    vd_list sent;              /* uint32_t bricks that go in this turn */
    vd_buffer blocks;          /* of these */
    size_t bytes;              /* of what the client has */
} vd_impostor_placing;

struct vd_impostors {
    vd_context *context;
    const vd_world *world;
    vd_world_renderer *renderer;
    vd_impostor_def def;
    vd_impostor_ground ground;
    uint32_t *slot_of; /* [nodes]: slot + 1; 0: none */
    vd_list slots;     /* vd_impostor_slot */
    vd_list far;       /* uint32_t slots of patches, back to front */
    vd_list shown;     /* the same of objects, nearer than those */
    vd_list direct;    /* uint32_t nodes */
    vd_list lines;     /* the same, of lines over ground that patches may show */
    bool any_near;     /* ground that is drawn itself: */
    vd_cells near;     /* these cells, of all of the picture's ground the nearest */
    size_t hidden;     /* pictures behind the horizon, which are not shown */
    bool by_horizon;   /* it is asked */
    size_t left_out;   /* wishes for which there is no memory */
    size_t missing;    /* of those that have no picture, though one would be good */
    bool any_loose;    /* some of it does not stand on patches: it is told from them by depth */
    vd_list quads;     /* vd_quad, of the last picture */
    vd_display *display;
    vd_impostor_scratch own_scratch, *scratch;
    vd_impostor_scratch *still_in; /* with `ship` as `scratch`: a client is sent its still picture
                                      at once; others show theirs from here for as long as the
                                      camera rests */
    uint32_t number;               /* among the pool's sets */
    uint32_t things;               /* drawn themselves for want of pictures, as decided */
    vd_impostor_pace front_pace, clouds_pace;
    vd_list over;                 /* uint32_t: `direct`, particles first, */
    size_t clouds;                /* of which there are so many */
    uint32_t shown_things;        /* and with those on patches */
    double cloud_detail;          /* factor on what particles' detail is, at least 1 */
    vd_list ranks;                /* vd_impostor_rank of each of `shown` */
    vd_buffer order;              /* for sorting these */
    vd_buffer depth;              /* of a frame that has none */
    vd_list wishes;               /* vd_impostor_wish */
    size_t bytes;                 /* of pictures */
    vd_list sending;              /* vd_impostor_sending, in the order of their arrival */
    size_t sending_bytes;         /* of these; part of `bytes` */
    double packed_share;          /* of their bytes that pictures take on the link, lately */
    double link_free_s;           /* when the last of them has left */
    double far_px_per_s;          /* that the far end draws, lately; 0: not known */
    double haste;                 /* pictures may last for so many times fewer frames, 1 … */
    double remote_free_s;         /* when the far end has drawn what it was asked for */
    vd_impostor_painter *painter; /* `background`; else null */
    size_t painting;              /* pictures that it was asked for and that have not come */
    uint64_t draws_since_ns;      /* when the last update began to draw */
    bool has_still;       /* drawn for the camera that rests; see vd_impostors_still_frame */
    double still_s;       /* when it comes */
    double still_retry_s; /* not drawn again before, since it failed */
    int resting;          /* updates with this camera and size */
    vd_camera rest_camera;
    int rest_width, rest_height;
    uint8_t *tints; /* see impostor_tint.c; null until some are shown */
    bool frozen;
    double rest_since_s; /* when the camera came to rest */
    uint32_t versions;   /* of pictures so far */
    vd_impostor_extra extras[VD_EXTRAS];
    vd_impostor_front in_front; /* `ship`; see impostor_items.c */
    vd_impostor_placing placing;
    vd_vec3 sky_eye;
    bool has_sky;  /* all sides of it, as from there */
    vd_list items; /* vd_impostor_item */
    vd_list ids;   /* uint64_t, of an order or of what is gone */
    uint64_t update;
    double time_s;         /* of the last update; before the first: none */
    double interval_s;     /* from the one before */
    bool moving;           /* there was one */
    vd_vec3 eye, velocity; /* as it is believed */
    vd_vec3 last_velocity; /* of the last step alone */
    vd_quat facing;        /* of the last update's camera */
    vd_vec3 turn;          /* radians a second about the world's axes, as it is believed */
    vd_vec3 last_turn;     /* of the last step alone */
    vd_impostor_stats stats;
};

/* How an update, or a picture for a client, sees the world. */
typedef struct vd_impostor_view {
    vd_vec3 eye;  /* where pictures are made from: where the camera will be */
    vd_vec3 seen; /* where they are judged from: the camera's eye, or with a link, whose pictures
                     come later, that other one */
    vd_camera camera; /* as it is */
    int width, height;
    vd_frustum frustum;
    const vd_horizon *horizon; /* null: no ground hides anything */
    bool turning;              /* the camera does: in a while it will see */
    vd_frustum ahead;          /* this */
    vd_vec3 velocity;          /* metres a second */
    double focal_px, drop_per_m2;
    double detail; /* pixels a side of a picture to one of the screen */
    double u, v;   /* the cell of the map that the camera is over; anywhere outside, too */
} vd_impostor_view;

/* The sides of a patch that the eye is beyond: west, east, north, south. There its picture goes on,
 * under those of its neighbours. */
static inline unsigned vd_impostor_sides(const vd_impostor_view *view, const vd_cells *cells) {
    return (view->u < cells->c0 ? 1u : 0u) | (view->u > cells->c1 + 1 ? 2u : 0u) |
           (view->v < cells->r0 ? 4u : 0u) | (view->v > cells->r1 + 1 ? 8u : 0u);
}

/* Whether a camera and a size can be shown; returns VD_ERROR_ARGUMENT. */
VD_MUST_USE vd_status vd_impostors_check(const vd_camera *camera, int width, int height);

/* Learns from a camera how it moves. */
void vd_impostors_follow(vd_impostors *set, const vd_camera *camera, double time_s);

/* The view of the last update's camera, eye and motion. */
vd_impostor_view vd_impostors_view(const vd_impostors *set, const vd_camera *camera, int width,
                                   int height);

/* Takes a picture that has arrived over. */
void vd_impostors_replace(vd_impostors *set, vd_impostor_slot *slot,
                          const vd_impostor_picture *made);

/* Forgets pictures that wait to be delivered and that the last update did not ask for. */
void vd_impostors_forget_stale(vd_impostors *set);
void vd_impostors_release_extras(vd_impostors *set);

/* Where a picture stands in the world, its transparent edge included. */
void vd_impostor_corners(const vd_impostor_picture *picture, vd_vec3 out[4]);

/* Whether object pictures are drawn into the picture in front: where there is ground, which they
 * are told from by depth; but see vd_impostor_is_apart. */
bool vd_impostors_shown_in_front(const vd_impostors *set);

/* Draws what is not on patches, over transparent black: ground that is near, what is drawn itself,
 * object pictures if they are told by depth, names and particles; nothing of the overlay. The frame
 * must have depth. */
VD_MUST_USE vd_status vd_impostors_draw_alone(vd_impostors *set, vd_job *job,
                                              const vd_camera *camera, vd_frame *frame);

/* The most key points of a node. */
#define VD_IMPOSTOR_POINTS VD_GROUND_POINTS

static inline bool vd_impostor_is_patch(const vd_impostors *set, uint32_t node) {
    return node >= set->world->node_count;
}

/* The patch that a node is. */
static inline uint32_t vd_impostor_patch(const vd_impostors *set, uint32_t node) {
    return node - (uint32_t)set->world->node_count;
}

static inline vd_impostor_slot *vd_impostor_slot_at(const vd_impostors *set, uint32_t slot) {
    return (vd_impostor_slot *)set->slots.data + slot;
}

/* Bounds of a node as they are drawn: lowered by curvature. */
void vd_impostor_bounds(const vd_impostors *set, const vd_impostor_view *view, uint32_t node,
                        vd_vec3 *min, vd_vec3 *max);

/* The points by which a node is judged; returns how many. */
int vd_impostor_key_points(const vd_impostors *set, const vd_impostor_view *view, uint32_t node,
                           vd_vec3 out[VD_IMPOSTOR_POINTS]);

/* The plane of a node's picture: a point on it, and its normal, zero for one that faces the eye; of
 * those that it could be the one whose parts lie least far from it along the line of sight. Returns
 * that depth, metres. */
double vd_impostor_best_plane(const vd_impostors *set, const vd_impostor_view *view, uint32_t node,
                              vd_vec3 *through, vd_vec3 *normal);

/* Screen error of a slot's picture for a view; infinity when it has none. */
double vd_impostor_error(const vd_impostors *set, const vd_impostor_view *view,
                         const vd_impostor_slot *slot);

/* The same of a picture that a node could have. */
double vd_impostor_picture_error(const vd_impostors *set, const vd_impostor_view *view,
                                 uint32_t node, const vd_impostor_picture *picture);

/* Decides what is shown as what: fills `far`, `shown`, `direct`, `near` and `wishes`. Returns
 * VD_ERROR_MEMORY. */
VD_MUST_USE vd_status vd_impostors_decide(vd_impostors *set, const vd_impostor_view *view);

/* Screen error of the key points alone; infinity when there is no picture. */
double vd_impostor_parallax(const vd_impostors *set, const vd_impostor_view *view,
                            const vd_impostor_slot *slot);

/* Sorts ranks, the farthest first, of equals the lower slot; `room` is for as many. Sorts `shown`
 * by `ranks`; returns VD_ERROR_MEMORY. */
void vd_impostor_ranks_sort(vd_impostor_rank *ranks, vd_impostor_rank *room, size_t count);
VD_MUST_USE vd_status vd_impostors_sort_shown(vd_impostors *set);

/* What no other try can mend. */
static inline bool vd_impostor_is_fatal(const vd_status *status) {
    return status->code == VD_ERROR_MEMORY || status->code == VD_ERROR_CANCELLED;
}

/* ---- impostor_make.c: drawing a picture, in three steps, of which a thread can do the second ---
 */

typedef enum vd_draft_of {
    VD_DRAFT_LOOSE = 0, /* a thing alone */
    VD_DRAFT_GROUNDED,  /* a thing, without what of it is in the ground */
    VD_DRAFT_CLOUDS,    /* particles for a client, without what the ground hides of them */
    VD_DRAFT_PATCH
} vd_draft_of;

/* A picture to be drawn, and when it was, the picture. */
typedef struct vd_impostor_draft {
    uint32_t node;
    vd_draft_of of;
    vd_cells ground;   /* that is drawn, or hides */
    vd_cells standing; /* of a patch: where what is drawn stands */
    vd_camera camera;
    double near_m, front_m;      /* along the line of sight: ground is not nearer; nor is it */
    vd_impostor_picture picture; /* its plane and size as they will be drawn, before margins go */
    vd_status status;
} vd_impostor_draft;

/* What draws it. */
typedef struct vd_impostor_brush {
    vd_context *context, *pictures; /* that its frames, and pictures, are allocated from */
    vd_world_renderer *renderer;
    int samples;
    vd_frame **canvas;
    size_t *canvas_pixels;
    vd_impostor_relief *relief; /* these two for VD_DRAFT_CLOUDS alone */
    vd_buffer *depth;
} vd_impostor_brush;

/* Decides how a slot's picture is drawn; false when it cannot be. */
bool vd_impostors_draft(vd_impostors *set, const vd_impostor_view *view,
                        const vd_impostor_slot *slot, vd_impostor_draft *out);

/* Draws it; how that went is told by its status. Looks at nothing of a set. */
void vd_impostor_paint(const vd_impostor_brush *brush, vd_job *job, vd_impostor_draft *draft);

/* The set has what was drawn, or counts a failure. Returns as vd_impostors_make. */
VD_MUST_USE vd_status vd_impostors_hang(vd_impostors *set, vd_impostor_draft *draft);

/* All three. A drawing that fails is counted, and is no failure of the call;
 * returns VD_ERROR_MEMORY or VD_ERROR_CANCELLED. */
VD_MUST_USE vd_status vd_impostors_make(vd_impostors *set, vd_job *job,
                                        const vd_impostor_view *view, vd_impostor_slot *slot);

/* Takes the picture of a slot from the pool; *shared tells whether there is one that will do.
 * Returns VD_ERROR_MEMORY. */
VD_MUST_USE vd_status vd_impostors_share(vd_impostors *set, const vd_impostor_view *view,
                                         vd_impostor_slot *slot, bool *shared);

/* Whether what a node shows changes all the time. */
bool vd_impostor_is_restless(const vd_impostors *set, uint32_t node);

/* Finds or makes the slot of a node; null when memory is out. */
vd_impostor_slot *vd_impostor_slot_of(vd_impostors *set, uint32_t node);

/* Counts a failure: the node is skipped, and tried again later and later. */
void vd_impostor_fail(vd_impostors *set, vd_impostor_slot *slot);

/* Whether a node is skipped because its drawing failed. */
static inline bool vd_impostor_is_skipped(const vd_impostors *set, uint32_t node) {
    const uint32_t known = set->slot_of[node];
    const vd_impostor_slot *slot = known != 0 ? vd_impostor_slot_at(set, known - 1) : NULL;
    return slot != NULL && slot->failures > 0 && set->time_s < slot->retry_s;
}

/* Takes those out of `direct` whose drawing fails, so that all else can be shown; returns
 * VD_ERROR_MEMORY or VD_ERROR_CANCELLED, and the status that it was given if there are none. */
VD_MUST_USE vd_status vd_impostors_set_aside(vd_impostors *set, vd_job *job,
                                             const vd_camera *camera, const vd_frame *frame,
                                             vd_status because);

/* Takes a picture over: shows it from now on (`set->time_s`), or sends it where there is a link.
 * Returns VD_ERROR_MEMORY; the picture is then released. */
VD_MUST_USE vd_status vd_impostors_take(vd_impostors *set, vd_impostor_slot *slot,
                                        vd_impostor_picture *made);

/* Hands over what has arrived by `set->time_s`. */
void vd_impostors_receive(vd_impostors *set);

/* Puts bytes on the link; returns when they arrive, at once where there is no link. */
double vd_impostors_send(vd_impostors *set, size_t bytes);

/* Reissues the whole while the camera rests. Returns the errors of drawing. */
VD_MUST_USE vd_status vd_impostors_settle(vd_impostors *set, vd_job *job, const vd_camera *camera,
                                          int width, int height);

/* The still picture, on its way or there; null: none, or another set of the pool has drawn over it.
 */
const vd_frame *vd_impostors_still_frame(const vd_impostors *set);

/* Copies the still picture if it is this one. */
bool vd_impostors_copy_still(const vd_impostors *set, const vd_camera *camera, vd_frame *frame);

/* What lies over a slot's picture; after vd_impostor_make_tints, which returns VD_ERROR_MEMORY. */
vd_quad_picture vd_impostor_tint(const vd_impostors *set, const vd_impostor_slot *slot);
VD_MUST_USE vd_status vd_impostor_make_tints(vd_impostors *set);

/* ---- impostor_front.c: what is drawn itself, over a picture of patches with depth -------------
 */

/* A patch that has no picture yet: its ground, and what stands on it if that is not too much. */
VD_MUST_USE vd_status vd_impostors_draw_patch(vd_impostors *set, vd_job *job,
                                              const vd_camera *camera, uint32_t node,
                                              vd_frame *frame, vd_world_stats *stats);

/* Near ground, and the objects that are drawn themselves. */
VD_MUST_USE vd_status vd_impostors_draw_front(vd_impostors *set, vd_job *job,
                                              const vd_camera *camera, vd_frame *frame,
                                              vd_world_stats *stats);
VD_MUST_USE vd_status vd_impostors_draw_lines(vd_impostors *set, vd_job *job,
                                              const vd_camera *camera, vd_frame *frame,
                                              vd_world_stats *stats);

/* Pixels a side of what is drawn at a pace to one of the frame. */
double vd_impostor_pace_scale(const vd_impostor_pace *pace);

/* Chooses how coarse the next one is: it may take a share of a frame's time. */
void vd_impostor_pace_learn(const vd_impostors *set, vd_impostor_pace *pace, double took_s,
                            double share);

/* Shows the front's frame, as large as the part x0, y0 … x1, y1 of another. */
VD_MUST_USE vd_status vd_impostors_enlarge(vd_impostors *set, vd_job *job, const int in[4],
                                           vd_frame *frame);

/* Particles and names of what is drawn itself, and the overlay. The frame must have depth. */
VD_MUST_USE vd_status vd_impostors_draw_over(vd_impostors *set, vd_job *job,
                                             const vd_camera *camera, vd_frame *frame,
                                             vd_world_stats *stats);

/* ---- impostor_relief.c: the ground's depth ---------------------------------------------------
 */

/* The depth of all ground farther than near_m, coarsely; into a frame of a camera that may have
 * another near plane. The relief has `margin` coarse pixels around the frame. */
VD_MUST_USE vd_status vd_impostor_draw_relief(vd_context *context, vd_world_renderer *renderer,
                                              vd_job *job, const vd_camera *camera, double near_m,
                                              int margin, vd_impostor_relief *relief,
                                              vd_frame *frame);
VD_MUST_USE vd_status vd_impostors_draw_relief(vd_impostors *set, vd_job *job,
                                               const vd_camera *camera, vd_frame *frame);

/* Whether a client is sent a node's picture by itself, over ground too, and nothing of it until
 * there is one: particles, which take long to draw, and are many. */
bool vd_impostor_is_apart(const vd_impostors *set, uint32_t node);

/* Whether an object's picture that a client is shown is drawn into the picture in front. */
bool vd_impostor_is_in_front(const vd_impostors *set, const vd_impostor_slot *slot);

/* VD_DRAFT_CLOUDS. */
VD_MUST_USE vd_status vd_impostor_draw_clouds(const vd_impostor_brush *brush, vd_job *job,
                                              vd_impostor_draft *draft, vd_frame *canvas);

/* Tells of those that are shown which come before something that a frame has of the picture in
 * front. */
void vd_impostors_part_objects(vd_impostors *set, const vd_camera *camera, const vd_frame *frame);

/* Whether so much waits for the link that a picture made now would come too late. */
bool vd_impostors_link_is_full(const vd_impostors *set);

/* Gives up the least valuable pictures until all fit into the memory. */
void vd_impostors_trim(vd_impostors *set);

void vd_impostor_release(vd_impostors *set, vd_impostor_picture *picture);
void vd_impostor_scratch_release(vd_impostor_scratch *scratch);

#endif

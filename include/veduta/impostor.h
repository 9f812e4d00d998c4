/* impostor.h: pictures that stand in for objects while their screen error is small.
 *
 *     status = vd_impostors_create(context, world, renderer, NULL, &impostors);
 *     for each picture:
 *         status = vd_impostors_update(impostors, NULL, &camera, width, height, time_s, &stats);
 *         status = vd_impostors_draw(impostors, NULL, &camera, frame, &stats);
 *
 * An impostor is a picture of one object of a world, a tree or all the trees of a slope, on a plane
 * through it (Lawlor 2004, chapters 2 and 3). It is drawn once and shown by perspective texture
 * mapping for as long as no key point of the object is farther from where the picture shows it than
 * a tolerance. Which objects have pictures follows the world's tree: one that would last too short
 * or covers too many pixels is split into its children, small ones that lie together are merged;
 * children replace a parent, and it them, all at once. What lasts for no time at all, being near,
 * is drawn itself. The ground is shown in patches, windows of its cells with all that stands on
 * them; a terrain that is a function or wraps around is drawn itself.
 *
 * With a link, a picture is shown from the first update on whose `time_s` is not before its
 * arrival: pictures go over it one after the other, first come, first served, so one of b bytes
 * made at the time t arrives at max(t, link free) + b / link_bytes_per_s + link_latency_s. Until
 * then what was shown goes on being shown. While more pictures wait than the link carries in
 * 0.1 s and the time between two updates none are made: they would be old when they come. What is
 * drawn itself does not go over the link.
 */
#ifndef VEDUTA_IMPOSTOR_H
#define VEDUTA_IMPOSTOR_H

#include <veduta/display.h>
#include <veduta/placed.h>
#include <veduta/world.h>

VD_BEGIN_DECLARATIONS

/* What is shown over the pictures of impostors, as a tint and an edge; dark is little. */
typedef enum vd_impostor_show {
    VD_IMPOSTOR_SHOW_PICTURES = 0, /* nothing */
    VD_IMPOSTOR_SHOW_BOUNDS,       /* where each is: patches of the ground green, others yellow */
    VD_IMPOSTOR_SHOW_AGE,          /* since it came: 0 … 4 s */
    VD_IMPOSTOR_SHOW_ERROR,        /* its screen error: 0 … twice the tolerance */
    VD_IMPOSTOR_SHOW_COUNT
} vd_impostor_show;

/* Returns "pictures", "bounds", "age" or "error". */
VD_API const char *vd_impostor_show_name(vd_impostor_show show);

typedef struct vd_impostors vd_impostors;

/* Pictures that sets of one world and renderer share, one thread at a time: before a set draws one
 * it takes another set's, if that is wrong by less than half of the tolerance where it would be
 * shown. Its pixels are then there once, until the last set that has it gives it up. With one set
 * nothing is shared, and all is as without. */
typedef struct vd_impostor_pool vd_impostor_pool;

typedef struct vd_impostor_def {
    double tolerance_px; /* screen error up to which a picture is shown; 0: drawn anew always */
    double budget_s; /* wall time of an update's drawing, above 0; one picture is always drawn, and
                        while things are drawn themselves for want of pictures these may take as
                        long as all that is drawn itself did */
    size_t memory_bytes;  /* of pictures; the least valuable go first */
    double fade_s;        /* over which a new picture takes the place of an old one; 0: at once */
    double rate_hz;       /* pictures a second that are shown: for how long a picture lasts */
    double speed_mps;     /* that is reckoned with at least, also while the camera rests */
    double least_reuse;   /* pictures: objects that would last shorter are split, or drawn
                             themselves */
    double most_px;       /* side: larger objects are split */
    int samples;          /* a pixel, of the pictures: 1, 4, 8 */
    uint32_t most_direct; /* objects drawn themselves in a frame for want of pictures; others of
                             them are not seen until theirs come. 0: all */
    int direct_samples;   /* likewise of what is drawn itself over patches, not of the still picture
                           */
    size_t budget_pixels; /* of pictures, an update: a budget that is the same on every machine;
                             0: none. One picture is always drawn */
    double link_bytes_per_s; /* a simulated link that pictures come over; 0: none */
    double link_latency_s;   /* from the last byte sent to the picture's being there */
    size_t (*pack)(void *user, uint8_t *rgba, int width, int height); /* packs a picture [height]
                                [width][4] for the link: leaves it as it comes out at the other end
                                and returns its bytes on the way, 0: width × height × 4. Null: none
                                is packed */
    void *pack_user;
    bool remote;     /* pictures are drawn by another machine, at the far end of the link: an update
                        does not wait for them, they come on after as long as drawing them took, and
                        while it draws it is asked for no others */
    bool background; /* pictures are drawn by a thread beside, with threads and a
                        renderer of its own: an update waits for none. It spends `budget_s`
                        between two updates, once begun a picture is finished. Not with a link,
                        `ship`, a pool, `no_reuse` or `budget_pixels`; the world must not change.
                        A cancelled job ends an update, not the picture that is being drawn */
    int background_threads; /* of its own, with a context like the set's; 0: half of that one's */
    bool no_reuse;          /* every update wishes for every picture anew (table 5.4) */
    bool settle; /* while the camera rests and nothing waits, the whole is one picture aligned with
                    the screen, as vd_world_renderer_draw makes it */
    vd_impostor_show show;
    bool ship;     /* pictures are for a client that shows them by itself: vd_impostors_fresh */
    double spare;  /* `ship`: share of the screen's width and height by which the view is wider on
                      each side, since the client may turn before it hears: 0 … 1 */
    double rest_s; /* how long the camera must rest before it settles */
    const vd_impostors *like; /* another set of the same world and renderer, that outlives this one:
                                 the tree of the ground is made once; null: none */
    size_t placed_bytes; /* `ship`: of models that the client draws itself, of where they stand, and
                            of bricks, at most; 0: it draws none */
    uint64_t placed_triangles; /* of models, in an order, at most; 0: none of them */
    uint64_t placed_particles; /* of bricks, likewise */
    uint32_t first_version;    /* `ship`: of pictures; another one for every set tells them apart */
    vd_impostor_pool *pool;    /* that pictures are shared through; outlives the set; null: none */
} vd_impostor_def;

/* 1 pixel, 5 ms, 256 MiB, no fading, 60 Hz, 2 m/s, 4 pictures, 192 pixels, 4 samples and 1,
 * 64 direct, 100,000 triangles and no particles; it settles. */
VD_API vd_impostor_def vd_impostor_def_default(void);

typedef struct vd_impostor_stats {
    uint64_t shown;    /* impostors in the picture */
    uint64_t reused;   /* of these, as they were in the last one: no new picture has come */
    uint64_t direct;   /* objects, and patches of the ground without a picture, drawn themselves */
    uint64_t drawn;    /* pictures made by the last update */
    uint64_t waiting;  /* pictures that its budget left for later */
    uint64_t shared;   /* pictures taken from other sets, all in all */
    uint64_t failed;   /* drawings that failed, all in all: skipped, tried again later */
    uint64_t dropped;  /* pictures given up for memory, all in all */
    uint64_t decided;  /* nodes that the last update looked at */
    uint64_t pictures; /* kept */
    size_t bytes;      /* that they take */
    uint64_t pixels_drawn, pixels_shown; /* all in all: their ratio is the reuse R */
    double overdraw;                     /* D: impostors' pixels a pixel of the last picture */
    uint64_t uploads, bytes_sent; /* pictures that have come, over the link where there is one, and
                                     their bytes on the way: all in all */
    uint64_t pixels_sent;         /* theirs: all in all */
    uint64_t in_flight;           /* pictures on the link, or being drawn in the background */
    double error_px;              /* the greatest screen error of what is shown */
    double decide_s, draw_s, direct_s, show_s; /* wall seconds of the last update and picture */
} vd_impostor_stats;

/* A pool for the sets of one world and renderer, those of the first set that is created with it. Of
 * pictures that no set has any more it keeps the last `idle_bytes`, while there are several sets.
 * Destroy it after its sets. Returns VD_ERROR_MEMORY. */
VD_API VD_MUST_USE vd_status vd_impostor_pool_create(vd_context *context, size_t idle_bytes,
                                                     vd_impostor_pool **out);
VD_API void vd_impostor_pool_destroy(vd_impostor_pool **pool);

/* Bytes of the pool's pictures, each counted once, those of sets among them. */
VD_API size_t vd_impostor_pool_bytes(const vd_impostor_pool *pool);

/* `world` and `renderer` (of that world, used by nobody else while a call runs) must outlive it.
 * `def` may be null. Returns VD_ERROR_ARGUMENT (names the field) or VD_ERROR_MEMORY. */
VD_API VD_MUST_USE vd_status vd_impostors_create(vd_context *context, const vd_world *world,
                                                 vd_world_renderer *renderer,
                                                 const vd_impostor_def *def, vd_impostors **out);
VD_API void vd_impostors_destroy(vd_impostors **impostors);

/* Decides for a camera what is shown as what, and draws pictures, the most wrong first (screen
 * error × area), within the budget. `time_s` goes forward from call to call; the camera's motion is
 * taken from the last two. Perspective cameras only. `job` and `stats` may be null. Returns
 * VD_ERROR_ARGUMENT, VD_ERROR_MEMORY or VD_ERROR_CANCELLED. */
VD_API VD_MUST_USE vd_status vd_impostors_update(vd_impostors *impostors, vd_job *job,
                                                 const vd_camera *camera, int width, int height,
                                                 double time_s, vd_impostor_stats *stats);

/* With `background`: waits until a picture of those that the last update asked for has been drawn,
 * for the next one to show; at once when none is being drawn. */
VD_API void vd_impostors_wait(vd_impostors *impostors);

/* Shows what the last update decided, from a camera that may have moved on: patches of the ground,
 * back to front; what is drawn itself over them; then pictures of objects, back to front, tested
 * against the depth of that; names and particles last. Returns the errors of drawing; what is drawn
 * itself and fails is skipped. */
VD_API VD_MUST_USE vd_status vd_impostors_draw(vd_impostors *impostors, vd_job *job,
                                               const vd_camera *camera, vd_frame *frame,
                                               vd_impostor_stats *stats);

/* Changes what is shown over the pictures, from the next one on. Returns VD_ERROR_MEMORY. */
VD_API VD_MUST_USE vd_status vd_impostors_set_show(vd_impostors *impostors, vd_impostor_show show);

/* While frozen, updates decide and draw nothing: what the last one decided is shown from wherever
 * the camera goes (Lawlor 2004, figure 3.2). */
VD_API void vd_impostors_freeze(vd_impostors *impostors, bool frozen);

/* An object has changed: its picture, and those of the groups and patches that it is in, are wrong,
 * and made anew by the next update; until those are there the old ones are shown. One that changes
 * again and again is drawn itself, patches aside, until it has rested for some updates. Of sets
 * that share a pool each has to be told. An unknown id changes nothing. */
VD_API void vd_impostors_change(vd_impostors *impostors, uint64_t id);

/* Whether the picture is the still one, of which nothing will change while the camera rests. */
VD_API bool vd_impostors_settled(const vd_impostors *impostors);

/* Returns the still picture while vd_impostors_settled, of the last update's size and with depth;
 * else null. Borrowed until the next update, with `ship` of any set of the pool: what another one
 * drew over is drawn again by the next update. */
VD_API const vd_frame *vd_impostors_still(const vd_impostors *impostors);

/* ---- for a client that has pictures and nothing else ------------------------------------------
 * With `ship` a picture counts as shown only once it was handed over, so what is ordered is always
 * something that the client has, and parents change places with their children in one order.
 *
 *     status = vd_impostors_update(set, job, &camera, width, height, time_s, &stats);
 *     status = vd_impostors_fresh(set, &items, &count);
 *     for (int i = 0; i < count && there is room; i++) {
 *         send(&items[i]);
 *         vd_impostors_deliver(set, items[i].id, items[i].version);
 *     }
 *     status = vd_impostors_finish_order(set, job, &items, &count);   // send and deliver all these
 *     status = vd_impostors_order(set, &order);
 *     status = vd_impostors_gone(set, &ids, &count);
 *
 * Besides pictures of objects and patches there are: the sky, six pictures around the eye and so
 * far away that they have no parallax; and the picture in front, of all that is drawn itself, on a
 * plane that faces the camera, made anew when it is wrong by more than the tolerance, when the
 * camera has turned beyond the spare, or when something else is in it.
 *
 * With `placed_bytes` models that would be drawn itself, and of which the ground and what else is
 * in front hides next to nothing, are not in that picture: the client gets each model once, and
 * where instances of it stand, to be drawn over the picture in front (placed.h). So it is with
 * `placed_particles` and particles, which it gets as bricks: nodes of their file's octree, as fine
 * as suits the distance. */
typedef enum vd_impostor_item_kind {
    VD_IMPOSTOR_PICTURE = 0,
    VD_IMPOSTOR_MODEL,
    VD_IMPOSTOR_INSTANCE,
    VD_IMPOSTOR_BRICK,
    VD_IMPOSTOR_ITEM_KIND_COUNT
} vd_impostor_item_kind;

/* Bytes that an instance counts at a client; a model's are vd_model_packed_bytes. */
#define VD_IMPOSTOR_INSTANCE_BYTES ((size_t)256)

typedef struct vd_impostor_item {
    vd_impostor_item_kind kind;
    const vd_model *model; /* VD_IMPOSTOR_MODEL: the world's */
    uint64_t model_id;     /* VD_IMPOSTOR_INSTANCE: the model's id, and where it stands */
    vd_place place;
    const uint8_t *block; /* VD_IMPOSTOR_BRICK: a block (brick_block.h), borrowed as `picture`; */
    size_t block_bytes;   /* its numbers begin at place.origin */
    uint64_t id;          /* of the object; of others its first byte is 251 … 255 */
    uint32_t version;     /* grows with every item of a set */
    uint64_t shared;      /* number of its pixels in the pool: equal numbers, equal pixels; 0:
                             it has none */
    vd_vec3 corners[4];   /* VD_IMPOSTOR_PICTURE: as vd_quad_place takes them */
    vd_quad_picture picture; /* borrowed until the next call, delivering aside */
} vd_impostor_item;

typedef struct vd_impostor_order {
    const uint64_t *ids; /* back to front; borrowed until the next call */
    int count;
    double missing;  /* share of the picture's area that waits for its first picture, 0 … 1 */
    double error_px; /* the greatest screen error of it */
} vd_impostor_order;

/* What was made and not delivered, the most valuable first; what a newer camera has made worthless
 * is not in it. At most about 1 MiB of pictures is made ahead. Returns VD_ERROR_MEMORY. */
VD_API VD_MUST_USE vd_status vd_impostors_fresh(vd_impostors *impostors,
                                                const vd_impostor_item **items, int *count);

/* The client has this one before anything that is sent from now on. */
VD_API void vd_impostors_deliver(vd_impostors *impostors, uint64_t id, uint32_t version);

/* Decides anew what is shown, now that pictures were delivered, and makes the sky and the picture
 * in front if they are due: these have to be delivered before the order. Returns the errors of
 * drawing. */
VD_API VD_MUST_USE vd_status vd_impostors_finish_order(vd_impostors *impostors, vd_job *job,
                                                       const vd_impostor_item **items, int *count);

/* What is to be shown: ids that were delivered. Returns VD_ERROR_MEMORY. */
VD_API VD_MUST_USE vd_status vd_impostors_order(vd_impostors *impostors, vd_impostor_order *out);

/* Ids, ascending, that were delivered and whose pictures were given up for memory since the last
 * call: for the client to forget. Returns VD_ERROR_MEMORY. */
VD_API VD_MUST_USE vd_status vd_impostors_gone(vd_impostors *impostors, const uint64_t **ids,
                                               int *count);

/* The client no longer has a picture; an unknown id changes nothing. */
VD_API void vd_impostors_lose(vd_impostors *impostors, uint64_t id);

/* Whether this very picture was delivered and is still the one. */
VD_API bool vd_impostors_holds(const vd_impostors *impostors, uint64_t id, uint32_t version);

/* A client comes back and has `count` of the pictures, by ascending id: it has lost the others. */
VD_API void vd_impostors_resume(vd_impostors *impostors, const uint64_t *ids,
                                const uint32_t *versions, int count);

/* Changes the tolerance, at least 0 and finite, from the next update on. */
VD_API void vd_impostors_set_tolerance(vd_impostors *impostors, double tolerance_px);

/* ---- the measure ------------------------------------------------------------------------------
 * e = sqrt(mean over pixels of |g − r|² / 0.1), red, green and blue in 0 … 1 as encoded (Lawlor
 * 2004, eq. 5.1). Frames of one size; 0 if and only if they are equal. */
VD_API double vd_frame_error(const vd_frame *generated, const vd_frame *reference);

VD_END_DECLARATIONS

#endif

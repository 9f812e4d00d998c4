/* impostor_placed.h: what a client draws itself: models (impostor_placed.c) and bricks of particles
 * (impostor_bricks.c), and how it gets, holds and loses them (…_items.c).
 */
#ifndef VEDUTA_IMPOSTOR_IMPOSTOR_PLACED_H
#define VEDUTA_IMPOSTOR_IMPOSTOR_PLACED_H

#include "impostor/impostor_set.h"

static inline vd_impostor_stand *vd_impostor_stand_at(const vd_impostors *set, uint32_t index) {
    return (vd_impostor_stand *)set->placing.stands.data + index;
}

/* The object of a node of particles. */
static inline const vd_cloud *vd_impostor_cloud(const vd_impostors *set, uint32_t node) {
    return (const vd_cloud *)set->world->entries[set->world->nodes[node].entry].object;
}

static inline vd_impostor_brick *vd_impostor_brick_at(const vd_impostors *set, uint32_t index) {
    return (vd_impostor_brick *)set->placing.bricks.data + index;
}

/* The particles of an asset. */
static inline const vd_brick_asset *vd_impostor_particles(const vd_impostors *set, uint32_t asset) {
    return set->world->assets[asset].bricks;
}

static inline vd_status vd_impostor_no_memory(void) {
    return vd_out_of_memory("particles that a client draws", sizeof(vd_impostor_brick));
}

/* ---- impostor_placed.c: what a client draws itself, out of what would be in the picture in front
 */

/* A client that can draw a thing itself does until its picture lasts for so many times least_reuse:
 * where it stands takes some hundred bytes, once. */
#define VD_IMPOSTOR_PLACED_REUSE 15.0

/* Whether a node is one that the client may come to draw. */
bool vd_impostors_may_place(const vd_impostors *set, uint32_t node);

/* So many bytes of new models and bricks a turn are enough: each holds up what comes after it. */
#define VD_IMPOSTOR_TURN_BYTES ((size_t)256 << 10)

/* What a turn's choice has spent. */
typedef struct vd_impostor_spent {
    uint64_t triangles, particles;
    size_t bytes; /* that the client has with what was chosen so far */
    size_t fresh; /* of these, models and bricks that it has not */
    bool full;
} vd_impostor_spent;

/* Finds or makes the stand of a node; null when memory is out. Makes room for stands first. */
VD_MUST_USE vd_status vd_impostors_begin_placing(vd_impostors *set);
vd_impostor_stand *vd_impostor_stand_of(vd_impostors *set, uint32_t node, bool *made);

/* Ranks what of `direct` is of a kind, nearest first; `slot` is the node. Returns VD_ERROR_MEMORY.
 */
VD_MUST_USE vd_status vd_impostors_rank_placed(const vd_impostors *set,
                                               const vd_impostor_view *view, vd_object_kind kind,
                                               vd_list *ranks);

/* Leaves a stand to the picture in front until the eye has moved; whether it was and has not. */
void vd_impostor_leave(vd_impostor_stand *stand, vd_vec3 eye);
bool vd_impostor_was_left(vd_impostor_stand *stand, vd_vec3 eye);

/* Whether an object's picture that is nearer may cover some of a node; those of particles, which
 * come last, do not. */
bool vd_impostor_is_behind_picture(const vd_impostors *set, const vd_impostor_view *view,
                                   const vd_node *node, double distance);

/* Share of a stand's places that may be hidden, and how much nearer what hides them is. */
#define VD_IMPOSTOR_MOST_HIDDEN 0.04
#define VD_IMPOSTOR_NEARER 1.02f

/* The pixel that shows a place, and how deep that is there; false when none does. */
bool vd_impostor_find_pixel(const vd_camera *camera, const vd_frame *frame, vd_vec3 at,
                            size_t *pixel, float *depth);

/* Counts a place if a frame shows where it is, and whether it is hidden there. */
void vd_impostor_count_hidden(const vd_camera *camera, const vd_frame *front, vd_vec3 at, int *seen,
                              int *hidden);

/* ---- impostor_bricks.c: particles among what a client draws itself ---- */

/* As the functions of the same names beside `placed`, which call these. */
VD_MUST_USE vd_status vd_impostors_choose_bricks(vd_impostors *set, const vd_impostor_view *view,
                                                 vd_impostor_spent *spent);

/* ---- impostor_brick_items.c ---- */

/* Makes a file's tables, unless they are there. Returns VD_ERROR_MEMORY. */
VD_MUST_USE vd_status vd_impostors_open_file(vd_impostors *set, uint32_t asset);

/* Finds or makes the brick of a node of an open file; its number + 1, 0 when memory is out. */
uint32_t vd_impostor_brick_of(vd_impostors *set, uint32_t asset, uint32_t node);
bool vd_impostor_cloud_is_hidden(const vd_impostors *set, const vd_impostor_stand *stand,
                                 const vd_camera *camera, const vd_frame *front);
void vd_impostors_give_up_bricks(vd_impostors *set);
VD_MUST_USE vd_status vd_impostors_list_bricks(vd_impostors *set);
VD_MUST_USE vd_status vd_impostors_order_bricks(vd_impostors *set);
VD_MUST_USE vd_status vd_impostors_gone_bricks(vd_impostors *set);
vd_impostor_brick *vd_impostor_find_brick(const vd_impostors *set, uint64_t id);
uint64_t vd_impostor_brick_id(const vd_impostor_brick *brick);
void vd_impostors_release_bricks(vd_impostors *set);

/* ---- impostor_placed.c, again ---- */

/* Takes what is to be drawn by the client out of `direct`. Returns VD_ERROR_MEMORY. */
VD_MUST_USE vd_status vd_impostors_choose_placed(vd_impostors *set, const vd_impostor_view *view);

/* Leaves those that are hidden by something of a picture in front that was drawn without them.
 * Returns whether some were: then it is to be chosen anew, after vd_impostors_unchoose_placed. */
bool vd_impostors_hide_placed(vd_impostors *set, const vd_camera *camera, const vd_frame *front);

/* Puts all that was chosen back into `direct`. */
void vd_impostors_unchoose_placed(vd_impostors *set);

/* Adds what has to be delivered to the items, chosen instances to the ids, farthest first, and what
 * was given up to the ids. Return VD_ERROR_MEMORY. */
VD_MUST_USE vd_status vd_impostors_list_placed(vd_impostors *set);
VD_MUST_USE vd_status vd_impostors_order_placed(vd_impostors *set);
VD_MUST_USE vd_status vd_impostors_gone_placed(vd_impostors *set);

/* As those of impostor.h; do nothing, and are false, for other ids. */
void vd_impostors_deliver_placed(vd_impostors *set, uint64_t id, uint32_t version);
void vd_impostors_lose_placed(vd_impostors *set, uint64_t id);
bool vd_impostors_holds_placed(const vd_impostors *set, uint64_t id, uint32_t version);
void vd_impostors_resume_placed(vd_impostors *set, const uint64_t *ids, const uint32_t *versions,
                                int count);
void vd_impostors_release_placed(vd_impostors *set);

/* ---- impostor_items.c ---- */
VD_MUST_USE vd_status vd_impostors_add_item(vd_impostors *set, const vd_impostor_item *item);
VD_MUST_USE vd_status vd_impostors_add_id(vd_impostors *set, uint64_t id);
int vd_impostor_compare_ids(const void *a, const void *b);

#endif

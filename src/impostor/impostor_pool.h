/* impostor_pool.h: pictures that several sets have.
 *
 *     set A   set B   set C           a picture is there while a set has it, and then for as long
 *       └──┬────┘       │             as there is room among the last ones that nobody has
 *      [ pixels ]   [ pixels ]
 *
 * Sets that look from near each other want the same pictures. Whether one of them will do for
 * another is for the judge to say that also says when a set's own picture is to be made anew; half
 * of the tolerance leaves half of its life. What a set made itself it does not get back: so a set
 * that is alone does what it would do without a pool.
 */
#ifndef VEDUTA_IMPOSTOR_IMPOSTOR_POOL_H
#define VEDUTA_IMPOSTOR_IMPOSTOR_POOL_H

#include "impostor/impostor_set.h"

/* A picture of the pool. */
struct vd_pooled {
    vd_pooled *next;          /* in its bucket */
    vd_pooled *newer, *older; /* of those that no set has */
    vd_impostor_pool *pool;
    vd_impostor_picture picture; /* its version is its maker's */
    uint64_t number;             /* another one for every picture, from 1 */
    uint32_t node, maker;        /* maker: number of a set */
    int holders;                 /* pictures of sets that are this one */
    int samples;
    double tolerance_px; /* that its edges were made for */
};

/* A set begins to use a pool, and ends. Joining tells the set's number; it returns
 * VD_ERROR_ARGUMENT when the pool is of another world or renderer. */
VD_MUST_USE vd_status vd_impostor_pool_join(vd_impostor_pool *pool, const vd_world *world,
                                            const vd_world_renderer *renderer, uint32_t *number);
void vd_impostor_pool_leave(vd_impostor_pool *pool);

/* Puts a picture that a set has just made into its pool, if it has one. When memory is out the
 * picture stays the set's alone. */
void vd_impostor_pool_put(vd_impostors *set, uint32_t node, vd_impostor_picture *made);

/* Finds the picture of a node that is least wrong for a view, if that is less than half of the
 * tolerance; the set then has it. False when there is none. */
bool vd_impostor_pool_get(vd_impostors *set, const vd_impostor_view *view, uint32_t node,
                          vd_impostor_picture *out);

vd_impostor_scratch *vd_impostor_pool_scratch(vd_impostor_pool *pool);

/* One picture less of some set. */
void vd_impostor_pool_give_up(vd_pooled *pooled);

/* Numbers of the sky's sides; other pictures' stay below. */
#define VD_POOLED_SKY ((uint64_t)1 << 63)

/* Where the pool keeps a side of the sky, that all see alike; null: without a pool, or where the
 * sky's pictures have ground in them. */
uint8_t **vd_impostor_pool_sky(const vd_impostors *set, int side);

#endif

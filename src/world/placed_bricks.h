/* placed_bricks.h: the bricks among what a client draws itself. */
#ifndef VEDUTA_WORLD_PLACED_BRICKS_H
#define VEDUTA_WORLD_PLACED_BRICKS_H

#include <veduta/placed.h>
#include <veduta/splat.h>
#include "core/buffer.h"
#include "core/list.h"

/* What drawing them takes, kept from call to call. All zero: nothing yet. */
typedef struct vd_placed_bricks {
    vd_context *context;
    vd_splatter *splatter; /* null until there are some */
    vd_list seen;          /* const vd_brick_block *, back to front */
    vd_list splats;        /* vd_splats, from the first on that is drawn */
    size_t first;
    vd_buffer radii;
    uint64_t radius_count; /* of those that are seen */
} vd_placed_bricks;

/* The box around a brick's particles, their sizes aside. */
void vd_placed_brick_box(const vd_brick_block *brick, vd_vec3 *min, vd_vec3 *max);

/* How far from their middles its particles show at most, metres. */
double vd_placed_brick_reach(const vd_brick_block *brick);

/* Begins a call; adds a brick that is in sight to it and to the account, unless it is one too many.
 */
void vd_placed_bricks_begin(vd_placed_bricks *bricks);
VD_MUST_USE vd_status vd_placed_bricks_add(vd_placed_bricks *bricks, const vd_brick_block *brick,
                                           vd_placed_account *account, bool *added);

/* Draws what was added over a frame, which may have depth that hides them, and is of a part of the
 * window. */
VD_MUST_USE vd_status vd_placed_bricks_draw(vd_placed_bricks *bricks, vd_job *job,
                                            const vd_camera *camera, const vd_placed_window *window,
                                            vd_placed_account *account, vd_frame *frame);
void vd_placed_bricks_finish(vd_placed_bricks *bricks);

#endif

/* brick_block.h: a brick of particles as one block, for whoever draws it far from its file.
 *
 *     status = vd_brick_block_unpack(context, received, bytes, origin, &brick);
 *     placed[i] = (vd_placed){.brick = brick};            placed.h draws it
 *     vd_brick_block_destroy(&brick);
 *
 * A block has positions of 16 bits an axis, colours or one colour, sizes or one size, and for how
 * many particles of the data one of these stands: how large and how dense they are drawn follows
 * from that for each camera, as brick_view.h has it.
 */
#ifndef VEDUTA_BRICK_BLOCK_H
#define VEDUTA_BRICK_BLOCK_H

#include <stddef.h>
#include <veduta/context.h>
#include <veduta/vector.h>

VD_BEGIN_DECLARATIONS

/* The most particles of a block. */
#define VD_BRICK_BLOCK_MOST 65536u

typedef struct vd_brick_block vd_brick_block;

/* Checks a block that came from outside and copies it; safe for any bytes, which may lie anywhere.
 * `origin`: where its numbers begin, world. *out is owned by the caller. Returns VD_ERROR_FORMAT
 * (says what is wrong) or VD_ERROR_MEMORY. */
VD_API VD_MUST_USE vd_status vd_brick_block_unpack(vd_context *context, const void *block,
                                                   size_t size_bytes, vd_vec3 origin,
                                                   vd_brick_block **out);
VD_API void vd_brick_block_destroy(vd_brick_block **block);

VD_END_DECLARATIONS

#endif

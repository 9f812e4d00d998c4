/* brick_pack.h: the bytes of a brick's block, shared by those who write and those who draw it.
 *
 *     head · x · y · z · radii, if they differ · colours, if they differ      each padded to 64
 *
 * Where things stand follows from the head's count and parts. Little-endian, as all blocks here.
 */
#ifndef VEDUTA_SPLAT_BRICK_PACK_H
#define VEDUTA_SPLAT_BRICK_PACK_H

#include <veduta/brick_block.h>
#include <veduta/brick_view.h>

enum { VD_BLOCK_RADII = 1, VD_BLOCK_COLORS = 2, VD_BLOCK_PARTS = 3 };

typedef struct vd_brick_block_head {
    uint8_t magic[8];
    uint64_t checksum; /* XXH64 of the block with this field 0 */
    double stands_for; /* particles of the data that one of these stands for */
    uint32_t count;    /* 1 … VD_BRICK_BLOCK_MOST */
    uint32_t kernel;   /* vd_splat_kernel */
    uint32_t parts;    /* VD_BLOCK_ bits */
    vd_rgba8 color;    /* of all, without VD_BLOCK_COLORS; straight */
    float step[3];     /* metres: p = step × (x, y, z), from the origin */
    float radius;      /* metres: of all; with VD_BLOCK_RADII root mean square */
    float radius_step; /* VD_BLOCK_RADII: metres of 1 */
    float opacity;     /* 0 … 1 */
    uint8_t reserved[60];
} vd_brick_block_head;

_Static_assert(sizeof(vd_brick_block_head) == 128, "the head is 128 bytes");

struct vd_brick_block {
    vd_context *context;
    vd_vec3 origin;
    vd_brick_block_head head;
    const uint16_t *x, *y, *z;
    const uint16_t *radius; /* null: one for all */
    const vd_rgba8 *color;  /* the same */
};

/* Where the arrays of a block begin. */
typedef struct vd_brick_layout {
    size_t x, y, z, radius, color, size_bytes;
} vd_brick_layout;

vd_brick_layout vd_brick_block_layout(uint32_t count, uint32_t parts);

/* The block's checksum, whatever its field says. */
uint64_t vd_brick_block_checksum(const void *block, size_t size_bytes);

/* How a particle is drawn that stands for `each` of them, of so many metres and such an opacity:
 * how many times larger, and with what opacity. Pixels of a metre: at its brick's middle, and where
 * that is nearest. */
void vd_brick_stand_in(double radius, double each, double opacity, double pixels, double nearest,
                       double *factor, float *out);

/* The attribute of the radii that a view draws; −1: one for all. */
int vd_brick_radius_of(const vd_bricks *bricks, const vd_brick_view_def *view);

/* The bytes that a node's block takes at most, looked at as `view` has it. */
size_t vd_brick_pack_bytes(const vd_bricks *bricks, uint32_t node, const vd_brick_view_def *view);

/* Writes it, coloured as `splat` colours it, into as many bytes, 8-byte aligned; *bytes gets how
 * many there are. Returns VD_ERROR_FORMAT (a damaged brick) or VD_ERROR_MEMORY. */
VD_MUST_USE vd_status vd_brick_pack(vd_context *context, const vd_bricks *bricks, uint32_t node,
                                    const vd_brick_view_def *view, const vd_splat_def *splat,
                                    uint8_t *out, size_t *bytes);

#endif

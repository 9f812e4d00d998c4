/* brick_format.h: the bytes of a brick file (docs/brick-format.md), shared by those who write and
 * those who read it.
 *
 *     ┌────────────┐ 0
 *     │ head       │ 256 bytes
 *     ├────────────┤
 *     │ bricks     │ each begins at a multiple of 64; children before their parents
 *     ├────────────┤ directory_offset
 *     │ attributes │ 128 bytes each
 *     │ nodes      │ 128 bytes each
 *     │ CRS        │ text_bytes, with its NUL
 *     └────────────┘ file_bytes
 *
 * Everything that is read is compared with what follows from counts alone; no offset is believed.
 */
#ifndef VEDUTA_SPLAT_BRICK_FORMAT_H
#define VEDUTA_SPLAT_BRICK_FORMAT_H

#include <veduta/bricks.h>

#define VD_BRICKS_MAGIC "VDBRICKS"
#define VD_BRICKS_VERSION 1u
#define VD_BRICK_ALIGNMENT 64u
#define VD_BRICK_MOST 65536u /* particles in a brick */

typedef struct vd_bricks_head {
    char magic[8];
    uint32_t version, head_bytes;
    uint64_t file_bytes;
    uint64_t checksum; /* XXH64 of the head with this field 0, then of the directory */
    uint64_t count, skipped, stored;
    uint64_t directory_offset;
    uint64_t node_count;
    uint32_t attribute_count, leaf_particles;
    double min[3], max[3];
    double spacing;
    uint64_t text_bytes;
    uint8_t reserved[112];
} vd_bricks_head;

_Static_assert(sizeof(vd_bricks_head) == 256, "the head is 256 bytes");
_Static_assert(sizeof(vd_bricks_attribute) == 128, "an attribute is 128 bytes");
_Static_assert(sizeof(vd_bricks_node) == 128, "a node is 128 bytes");

static inline size_t vd_brick_pad(size_t bytes) {
    return (bytes + VD_BRICK_ALIGNMENT - 1) / VD_BRICK_ALIGNMENT * VD_BRICK_ALIGNMENT;
}

static inline size_t vd_brick_value_bytes(uint32_t storage) {
    return storage == VD_BRICK_U8 ? 1 : 2;
}

/* Bytes of a brick of `count` particles: ranges, x, y, z, attributes, each padded. */
static inline size_t vd_brick_bytes(const vd_bricks_attribute *attributes, uint32_t attribute_count,
                                    uint32_t count) {
    size_t bytes = vd_brick_pad(8 * (size_t)attribute_count) + 3 * vd_brick_pad(2 * (size_t)count);
    for (uint32_t a = 0; a < attribute_count; a++) {
        bytes += vd_brick_pad(count * vd_brick_value_bytes(attributes[a].storage));
    }
    return bytes;
}

#endif

/* heightfield_block.h: the one shape that a heightfield block has.
 *
 *     ┌───────────────┐ 0
 *     │ vd_heightfield│
 *     ├───────────────┤ levels[0].offset_bytes
 *     │ heights       │
 *     ├───────────────┤ color_offset_bytes (absent without colours)
 *     │ colours       │
 *     ├───────────────┤ levels[1].offset_bytes …
 *     │ maxima        │
 *     └───────────────┘ size_bytes
 *
 * Every part begins at a multiple of 64 bytes and fills its last one with zeros. Offsets, strides
 * and level shapes follow from the sizes alone, so a block from outside is checked by laying it out
 * again and comparing: no arithmetic is ever done on numbers that were read.
 */
#ifndef VEDUTA_TERRAIN_HEIGHTFIELD_BLOCK_H
#define VEDUTA_TERRAIN_HEIGHTFIELD_BLOCK_H

#include <veduta/heightfield.h>

#define VD_HEIGHTFIELD_ALIGNMENT 64u

/* Fills size_bytes, color_offset_bytes, color_stride, level_count and levels from height_type,
 * width, height, color_width and color_height, which must be valid. */
void vd_heightfield_lay_out(vd_heightfield *head);

/* Returns null when the sizes and the type of `head` are ones that a block may have, else the name
 * of the field that is wrong. */
const char *vd_heightfield_wrong_size(const vd_heightfield *head);

/* Bytes of one height. */
size_t vd_height_bytes(uint32_t height_type);

/* Returns sample (column, row) of a level as float. */
float vd_heightfield_sample(const vd_heightfield *layout, const void *block, int level, int column,
                            int row);

/* Writes level `level` from the one below. */
void vd_heightfield_build_level(const vd_heightfield *layout, void *block, int level);

/* Computes min, max and holes of the heights. False when one is NaN or +infinity. */
bool vd_heightfield_measure(const vd_heightfield *layout, const void *block, float *min, float *max,
                            uint64_t *holes);

/* XXH64 of the block as if its checksum were 0. */
uint64_t vd_heightfield_checksum(const void *block, size_t size_bytes);

/* Inverts world_from_sample; false when it is singular or not finite. */
bool vd_heightfield_invert(const double m[6], double out[6]);

#endif

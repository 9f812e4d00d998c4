/* heightfield.h: terrain as one relocatable block.
 *
 * A vd_heightfield is the head of a single block of memory: this struct, then heights, colours and
 * the pyramid of maxima, found by offsets from the block's beginning. There are no pointers inside:
 * a block can be mapped from a file, sent, cached, checksummed.
 *
 * Heightfield space: column and row in samples, row 0 north; sample (c, r) sits at the integer
 * point. A hole has height −infinity (only with VD_HEIGHT_F32).
 */
#ifndef VEDUTA_HEIGHTFIELD_H
#define VEDUTA_HEIGHTFIELD_H

#include <veduta/dem.h>
#include <veduta/vector.h>

VD_BEGIN_DECLARATIONS

typedef enum vd_height_type {
    VD_HEIGHT_U8 = 0,
    VD_HEIGHT_U16,
    VD_HEIGHT_F32,
    VD_HEIGHT_TYPE_COUNT
} vd_height_type;

#define VD_HEIGHTFIELD_VERSION 1u
#define VD_HEIGHTFIELD_MAX_LEVELS 17

/* One level of the pyramid: sample (c, r) of level l >= 1 is the maximum of the heights at columns
 * [c·2^l, (c+1)·2^l] and rows likewise, both ends included, as far as they exist: the highest that
 * the surface gets over a block of 2^l × 2^l cells. ceil(size / 2^l) samples a side. Level 0 is the
 * heights themselves. The last level is 1 × 1. */
typedef struct vd_heightfield_level {
    uint64_t offset_bytes;
    int32_t width, height;
    uint64_t stride; /* samples from one row to the next */
} vd_heightfield_level;

typedef struct vd_heightfield {
    uint8_t magic[8]; /* "VDHEIGHT" */
    uint32_t version;
    uint32_t header_bytes; /* sizeof(vd_heightfield) */
    uint64_t size_bytes;   /* of the whole block */
    uint64_t checksum;     /* XXH64 of the block with this field 0 */
    uint32_t height_type;  /* vd_height_type */
    uint32_t wraps;        /* 1: the map repeats in both directions; 0: it ends at its edge */
    int32_t width, height;
    int32_t color_width, color_height; /* 0: no colours */
    uint64_t color_offset_bytes;       /* vd_rgba8 [color_height][color_stride], straight sRGB */
    uint64_t color_stride;
    /* colour pixel position (corner-based: pixel centres at +½) of a sample position, as
     * vd_dem.transform: u = c[0] + column·c[1] + row·c[2], v = c[3] + column·c[4] + row·c[5] */
    double color_from_sample[6];
    double world_from_sample[6]; /* metres, as vd_dem.transform */
    float min, max;              /* of the heights that are not holes; 0, 0 when all are */
    uint64_t holes;
    int32_t level_count, reserved;
    vd_heightfield_level levels[VD_HEIGHTFIELD_MAX_LEVELS];
} vd_heightfield;

typedef struct vd_heightfield_def {
    int width, height;
    vd_height_type type;
    const void *heights;  /* [height][stride] of the type */
    size_t height_stride; /* samples from one row to the next */
    bool wraps;
    const vd_picture *colors; /* null: none; any size, 8 or 16 bits */
    const double
        *color_from_sample;      /* [6]; null: the picture is stretched over the map, so that
                                    its outer edges meet the outer edges of the border samples */
    double world_from_sample[6]; /* all zero: column, −row, in metres */
} vd_heightfield_def;

VD_API vd_heightfield_def vd_heightfield_def_default(void);

/* Builds a block: copies heights and colours and computes the pyramid. NaN and infinite heights
 * become holes. *out is owned by the caller. Returns VD_ERROR_ARGUMENT, VD_ERROR_LIMIT or
 * VD_ERROR_MEMORY. */
VD_API VD_MUST_USE vd_status vd_heightfield_create(vd_context *context,
                                                   const vd_heightfield_def *def,
                                                   vd_heightfield **out);
VD_API void vd_heightfield_destroy(vd_context *context, vd_heightfield **heightfield);

/* Builds a block from a DEM (float heights, missing samples become holes, world coordinates from
 * vd_dem_placement) with optional colours as in vd_heightfield_def. */
VD_API VD_MUST_USE vd_status vd_heightfield_from_dem(const vd_dem *dem, const vd_picture *colors,
                                                     const double *color_from_sample,
                                                     vd_heightfield **out);

/* Checks a block that came from outside (magic, version, every offset and size, checksum, heights,
 * range, pyramid) before it is used; safe for any bytes. Cost: a few passes over the block. Returns
 * VD_ERROR_FORMAT with the field that is wrong, or VD_ERROR_ARGUMENT when `block` does not lie at a
 * multiple of 64 bytes. */
VD_API VD_MUST_USE vd_status vd_heightfield_validate(const void *block, size_t size_bytes);

/* Returns the first sample of a level, or the first colour; they live as long as the block. */
static inline const void *vd_heightfield_level_data(const vd_heightfield *h, int level) {
    return (const uint8_t *)h + h->levels[level].offset_bytes;
}

static inline const vd_rgba8 *vd_heightfield_colors(const vd_heightfield *h) {
    return (const vd_rgba8 *)((const uint8_t *)h + h->color_offset_bytes);
}

/* Returns the height of a sample as float. 0 <= column < width, 0 <= row < height. */
VD_API float vd_heightfield_at(const vd_heightfield *heightfield, int column, int row);

/* Returns the bilinear height at a world position, in metres; −infinity outside the map and in
 * holes (a cell with a hole at any corner is a hole). */
VD_API double vd_heightfield_height_at(const vd_heightfield *heightfield, double x, double y);

/* Gives the world's bounds of the map: [min, max] with heights. */
VD_API void vd_heightfield_bounds(const vd_heightfield *heightfield, vd_vec3 *min, vd_vec3 *max);

VD_END_DECLARATIONS

#endif

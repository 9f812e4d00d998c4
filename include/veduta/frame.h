/* frame.h: the finished picture that a renderer hands over.
 *
 * Three planes of one shape, row-major, top row first, all with the same stride:
 *   rgba   uint8_t  [height][stride][4]  sRGB-encoded, alpha premultiplied in encoded space
 *   depth  float    [height][stride]     reversed depth: near / z, 1 at the near plane, 0 at
 *                                        infinity (orthographic: 1 - z / far)
 *   id     uint32_t [height][stride]     index into object_ids of the nearest sample; 0 = nothing
 * The stride is in pixels: at least width, a multiple of 16 (64 bytes), and never such that a row
 * is a multiple of 1 KiB: then vertical neighbours would fall into the same cache set.
 */
#ifndef VEDUTA_FRAME_H
#define VEDUTA_FRAME_H

#include <veduta/context.h>

VD_BEGIN_DECLARATIONS

/* The largest width or height of a frame, target or picture, and the most pixels in one. */
#define VD_MAX_SIDE 65535
#define VD_MAX_PIXELS ((size_t)1 << 29)

enum {
    VD_PLANE_DEPTH = 1, /* ask for the depth plane */
    VD_PLANE_ID = 2     /* ask for the id plane */
};

typedef struct vd_frame {
    vd_context *context;
    int width, height;
    size_t stride;        /* pixels from one row to the next, in all planes */
    uint8_t *rgba;        /* never null */
    float *depth;         /* null unless asked for */
    uint32_t *id;         /* null unless asked for */
    uint64_t *object_ids; /* 64-bit object id of each frame id; entry 0 is 0: nothing */
    int object_count;     /* entries in use, at least 1 */
    int object_capacity;  /* entries there are; more are made when they are needed */
    uint32_t
        *object_slots; /* [2 × object_capacity]: frame ids by a hash of the object's; 0: free */
} vd_frame;

/* Creates a frame with the planes named in `planes` (VD_PLANE_ bits; colour always), cleared to
 * transparent black, depth 0, id 0. *out is owned by the caller.
 * Returns VD_ERROR_ARGUMENT (a side below 1), VD_ERROR_LIMIT (above VD_MAX_SIDE or VD_MAX_PIXELS)
 * or VD_ERROR_MEMORY. */
VD_API VD_MUST_USE vd_status vd_frame_create(vd_context *context, int width, int height,
                                             unsigned planes, vd_frame **out);
VD_API void vd_frame_destroy(vd_frame **frame);

/* Returns the XXH64 (seed 0) of the picture's RGB bytes, rows top to bottom without padding. */
VD_API uint64_t vd_frame_hash(const vd_frame *frame);

/* Returns the stride that vd_frame_create uses for a width, in pixels. */
VD_API size_t vd_frame_stride(int width);

VD_END_DECLARATIONS

#endif

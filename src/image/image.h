/* image.h: what the files of this room share, and what the rooms that draw need beyond the public
 * headers. */
#ifndef VEDUTA_IMAGE_IMAGE_H
#define VEDUTA_IMAGE_IMAGE_H

#include <stdbool.h>
#include <veduta/frame.h>
#include <veduta/picture.h>

/* Checks a picture's sides against 1, VD_MAX_SIDE and VD_MAX_PIXELS. `what` opens the sentence:
 * "a frame", "cannot read map.png: a picture". Returns VD_ERROR_ARGUMENT or VD_ERROR_LIMIT. */
VD_MUST_USE vd_status vd_check_size(const char *what, int width, int height);

/* The same for what a file's header says, which may not even fit an int: returns VD_ERROR_FORMAT
 * (a side of 0) or VD_ERROR_LIMIT. */
VD_MUST_USE vd_status vd_check_file_size(const char *name, uint64_t width, uint64_t height);

/* Gives the index of an object id in the frame's table, adding it if need be. Returns
 * VD_ERROR_LIMIT (2^24 objects) or VD_ERROR_MEMORY. */
VD_MUST_USE vd_status vd_frame_add_object(vd_frame *frame, uint64_t object_id, uint32_t *out);

/* Empties the table, for a new picture whose ids do not hang on those before. */
void vd_frame_forget_objects(vd_frame *frame);

/* A frame that is drawn in many sizes: *frame gets this one, and is made anew only when that needs
 * more pixels than any before; what is in it is then anything. *pixels is what it has room for;
 * begin with null and 0. Returns as vd_frame_create; *frame is then null. */
VD_MUST_USE vd_status vd_frame_fit(vd_context *context, int width, int height, unsigned planes,
                                   vd_frame **frame, size_t *pixels);

/* Makes a box x0, y0 … x1, y1 (exclusive) as small as what of the frame shows anything in it;
 * false, and the box as it was, when nothing does. */
static inline bool vd_frame_shrink(const vd_frame *frame, int box[4]) {
    int low[2] = {box[2], box[3]}, high[2] = {box[0], box[1]};
    for (int y = box[1]; y < box[3]; y++) {
        const uint8_t *row = frame->rgba + 4 * (size_t)y * frame->stride;
        int first = box[0], end = box[2];
        while (first < end && row[4 * first + 3] == 0) {
            first++;
        }
        while (end > first && row[4 * end - 1] == 0) {
            end--;
        }
        if (first < end) {
            low[0] = first < low[0] ? first : low[0];
            low[1] = y < low[1] ? y : low[1];
            high[0] = end > high[0] ? end : high[0];
            high[1] = y + 1;
        }
    }
    for (int k = 0; k < 2 && low[0] < high[0]; k++) {
        box[k] = low[k];
        box[k + 2] = high[k];
    }
    return low[0] < high[0];
}

/* One channel of the premultiplied "over" (Porter & Duff 1984), rounded; `rest` is 255 less the
 * alpha of what is on top. */
static inline uint8_t vd_over(uint8_t top, uint8_t under, unsigned rest) {
    const unsigned product = under * rest + 128u;
    return (uint8_t)(top + ((product + (product >> 8)) >> 8));
}

/* Readers of one format each: status as vd_picture_decode. */
bool vd_png_matches(const void *data, size_t size_bytes);
VD_MUST_USE vd_status vd_png_decode(vd_context *context, const void *data, size_t size_bytes,
                                    const char *name, vd_picture **out);
bool vd_pnm_matches(const void *data, size_t size_bytes);
VD_MUST_USE vd_status vd_pnm_decode(vd_context *context, const void *data, size_t size_bytes,
                                    const char *name, vd_picture **out);

bool vd_jpeg_matches(const void *data, size_t size_bytes);
VD_MUST_USE vd_status vd_jpeg_decode(vd_context *context, const void *data, size_t size_bytes,
                                     const char *name, vd_picture **out);

static inline void *vd_picture_row(const vd_picture *picture, int y) {
    return (uint8_t *)picture->data + (size_t)y * picture->stride_bytes;
}

/* Fills in row `y` of a picture that is being written: width × channels of 8 or 16 bits in the
 * machine's byte order. */
typedef void vd_row_function(const void *user, int y, void *row);

typedef struct vd_png_source {
    vd_context *context;
    int width, height, channels, bits; /* as in vd_picture */
    vd_row_function *row;
    const void *user;
} vd_png_source;

/* Writes a PNG from rows, asked for once each, top to bottom. `def` may be null. Returns
 * VD_ERROR_ARGUMENT, VD_ERROR_IO or VD_ERROR_MEMORY. */
VD_MUST_USE vd_status vd_png_write(const vd_png_source *source, const char *path,
                                   const vd_png_def *def);

#endif

/* server_png.c: a frame as a PNG in memory: RGB where it is opaque, else RGBA with alpha undone, as
 * vd_frame_save_png writes it. */
#include <spng.h>
#include <stdlib.h>
#include "remote/server_internal.h"

static bool is_opaque(const vd_frame *frame) {
    for (int y = 0; y < frame->height; y++) {
        const uint8_t *row = frame->rgba + 4 * (size_t)y * frame->stride;
        for (int x = 0; x < frame->width; x++) {
            if (row[4 * x + 3] != 255) {
                return false;
            }
        }
    }
    return true;
}

static void copy_row(const uint8_t *from, int width, int channels, uint8_t *to) {
    for (int x = 0; x < width; x++, from += 4, to += channels) {
        const unsigned alpha = from[3];
        for (int k = 0; k < 3; k++) {
            const unsigned straight = alpha > 0 ? (from[k] * 255u + alpha / 2) / alpha : 0;
            to[k] = (uint8_t)(alpha == 255 ? from[k] : straight < 255 ? straight : 255);
        }
        if (channels == 4) {
            to[3] = (uint8_t)alpha;
        }
    }
}

vd_status vd_server_png(const vd_frame *frame, uint8_t **out, size_t *bytes) {
    const int channels = is_opaque(frame) ? 3 : 4;
    const size_t row = (size_t)frame->width * (size_t)channels;
    uint8_t *pixels = malloc(row * (size_t)frame->height);
    spng_ctx *packer = spng_ctx_new(SPNG_CTX_ENCODER);
    struct spng_ihdr head = {.width = (uint32_t)frame->width,
                             .height = (uint32_t)frame->height,
                             .bit_depth = 8,
                             .color_type = channels == 3 ? SPNG_COLOR_TYPE_TRUECOLOR
                                                         : SPNG_COLOR_TYPE_TRUECOLOR_ALPHA};
    int error = pixels != NULL && packer != NULL ? 0 : SPNG_EMEM;
    for (int y = 0; error == 0 && y < frame->height; y++) {
        copy_row(frame->rgba + 4 * (size_t)y * frame->stride, frame->width, channels,
                 pixels + row * (size_t)y);
    }
    if (error == 0) {
        error = spng_set_option(packer, SPNG_ENCODE_TO_BUFFER, 1);
    }
    if (error == 0) {
        error = spng_set_option(packer, SPNG_IMG_COMPRESSION_LEVEL, 1);
    }
    if (error == 0) {
        error = spng_set_ihdr(packer, &head);
    }
    if (error == 0) {
        error = spng_encode_image(packer, pixels, row * (size_t)frame->height, SPNG_FMT_PNG,
                                  SPNG_ENCODE_FINALIZE);
    }
    uint8_t *made = error == 0 ? spng_get_png_buffer(packer, bytes, &error) : NULL;
    spng_ctx_free(packer);
    free(pixels);
    if (made == NULL) {
        return vd_failure(VD_ERROR_MEMORY, "cannot pack a picture of %d x %d pixels: %s",
                          frame->width, frame->height, spng_strerror(error));
    }
    *out = made;
    return vd_success();
}

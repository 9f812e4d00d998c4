/* jpeg_read.c: JPEG files into pictures, through libjpeg-turbo's libjpeg.
 *
 * libjpeg reports errors by a function that must not return: it jumps back. A file that ends early
 * is filled up in grey by libjpeg with a warning; here that is an error, since a texture with a
 * grey end is no texture. Decoding is integer arithmetic (the accurate DCT), the same on every
 * machine.
 */
#include "image/image.h"

bool vd_jpeg_matches(const void *data, size_t size_bytes) {
    const uint8_t *b = data;
    return size_bytes >= 3 && b[0] == 0xff && b[1] == 0xd8 && b[2] == 0xff;
}

#ifdef VEDUTA_HAVE_JPEG

#include <setjmp.h>
#include <stdio.h>
#include <jpeglib.h>
#include <jerror.h>

/* A block of 64 pixels takes two bits of Huffman code at least, 256 pixels a byte, and a little
 * less in progressive files: what promises 16 times that is refused before memory is taken for it.
 */
#define MOST_PIXELS_A_BYTE 4096

typedef struct decoder {
    struct jpeg_decompress_struct jpeg;
    struct jpeg_error_mgr errors;
    jmp_buf failed;
    char message[JMSG_LENGTH_MAX];
    vd_picture *picture;
    vd_status status; /* of what is not libjpeg's failure */
} decoder;

static void fail(j_common_ptr jpeg) {
    decoder *d = jpeg->client_data;
    jpeg->err->format_message(jpeg, d->message);
    longjmp(d->failed, 1);
}

/* Level -1 is a warning: data that end early or cannot be are damage, bytes too many are not. */
static void take_message(j_common_ptr jpeg, int level) {
    const int code = jpeg->err->msg_code;
    if (level < 0 && (code == JWRN_JPEG_EOF || code == JWRN_HIT_MARKER ||
                      code == JWRN_HUFF_BAD_CODE || code == JWRN_MUST_RESYNC)) {
        fail(jpeg);
    }
}

static void read_rows(decoder *d, vd_context *context, size_t size_bytes, const char *name) {
    struct jpeg_decompress_struct *jpeg = &d->jpeg;
    (void)jpeg_read_header(jpeg, TRUE);
    d->status = vd_check_file_size(name, jpeg->image_width, jpeg->image_height);
    if (d->status.code == VD_OK && jpeg->num_components > 3) {
        d->status =
            vd_failure(VD_ERROR_UNSUPPORTED,
                       "cannot read %s: it is a JPEG in four inks (CMYK); convert it to RGB", name);
    }
    const size_t pixels = (size_t)jpeg->image_width * jpeg->image_height;
    if (d->status.code == VD_OK && pixels / MOST_PIXELS_A_BYTE > size_bytes) {
        d->status = vd_failure(VD_ERROR_FORMAT,
                               "cannot read %s: it is too short for the %u × %u pixels that it "
                               "promises; get the file again",
                               name, jpeg->image_width, jpeg->image_height);
    }
    if (d->status.code != VD_OK) {
        return;
    }
    jpeg->out_color_space = jpeg->num_components == 1 ? JCS_GRAYSCALE : JCS_RGB;
    jpeg->dct_method = JDCT_ISLOW;
    (void)jpeg_start_decompress(jpeg);
    d->status = vd_picture_create(context, (int)jpeg->output_width, (int)jpeg->output_height,
                                  jpeg->output_components, 8, &d->picture);
    while (d->status.code == VD_OK && jpeg->output_scanline < jpeg->output_height) {
        JSAMPROW row = vd_picture_row(d->picture, (int)jpeg->output_scanline);
        (void)jpeg_read_scanlines(jpeg, &row, 1);
    }
    if (d->status.code == VD_OK) {
        (void)jpeg_finish_decompress(jpeg);
    }
}

/* What is decoded is the caller's and so outlives a jump. */
static void decode(decoder *d, vd_context *context, const void *data, size_t size_bytes,
                   const char *name) {
    if (setjmp(d->failed) != 0) {
        d->status =
            vd_failure(VD_ERROR_FORMAT,
                       "cannot read %.200s: it is a damaged JPEG (%.100s); get the file again",
                       name, d->message);
        return;
    }
    jpeg_create_decompress(&d->jpeg);
    jpeg_mem_src(&d->jpeg, data, size_bytes);
    read_rows(d, context, size_bytes, name);
}

vd_status vd_jpeg_decode(vd_context *context, const void *data, size_t size_bytes, const char *name,
                         vd_picture **out) {
    decoder d = {.picture = NULL, .status = {VD_OK, ""}};
    d.jpeg.err = jpeg_std_error(&d.errors);
    d.errors.error_exit = fail;
    d.errors.emit_message = take_message;
    d.jpeg.client_data = &d;
    decode(&d, context, data, size_bytes, name);
    jpeg_destroy_decompress(&d.jpeg);
    if (d.status.code != VD_OK) {
        vd_picture_destroy(&d.picture);
        return d.status;
    }
    *out = d.picture;
    return vd_success();
}

#else

vd_status vd_jpeg_decode(vd_context *context, const void *data, size_t size_bytes, const char *name,
                         vd_picture **out) {
    (void)context;
    (void)data;
    (void)size_bytes;
    (void)out;
    return vd_failure(VD_ERROR_UNSUPPORTED,
                      "cannot read %s: it is a JPEG, which this build does not read; convert it to "
                      "PNG, or build with libjpeg and VEDUTA_JPEG=ON",
                      name);
}

#endif

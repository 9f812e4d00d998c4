/* codec_png.c: colours as a PNG of three channels, through libspng.
 *
 * libspng's own scratch (zlib's window, two rows) comes from malloc: its hooks carry no user
 * pointer.
 */
#include "remote/coder.h"

#include <spng.h>
#include <string.h>

/* Beyond the file's own size, of ancillary chunks, which ours do not have. libspng wants no chunk
 * to be larger than all of them may be. */
#define CACHE_BYTES ((size_t)64 << 10)

static const uint8_t end_chunk[12] = {0, 0, 0, 0, 'I', 'E', 'N', 'D', 0xae, 0x42, 0x60, 0x82};

static int write_stream(spng_ctx *png, void *user, void *data, size_t bytes) {
    (void)png;
    return vd_sink_write(user, data, bytes) ? 0 : SPNG_IO_ERROR;
}

static int write_rows(spng_ctx *png, const vd_codec_picture *picture, uint8_t *row) {
    int error = spng_encode_image(png, NULL, 0, SPNG_FMT_PNG,
                                  SPNG_ENCODE_PROGRESSIVE | SPNG_ENCODE_FINALIZE);
    const size_t width = (size_t)picture->width;
    for (int y = 0; y < picture->height && error == 0; y++) {
        const uint8_t *from = picture->rgba + 4 * picture->stride * (size_t)y;
        for (size_t x = 0; x < width; x++) {
            memcpy(row + 3 * x, from + 4 * x, 3);
        }
        error = spng_encode_row(png, row, 3 * width);
    }
    return error == SPNG_EOI ? 0 : error;
}

vd_status vd_png_pack(vd_coder *coder, const vd_encode_def *def, const vd_codec_picture *picture,
                      vd_sink *sink) {
    vd_status status = vd_scratch_reserve(coder, &coder->rows, 3 * (size_t)picture->width);
    if (status.code != VD_OK) {
        return status;
    }
    spng_ctx *png = spng_ctx_new(SPNG_CTX_ENCODER);
    if (png == NULL) {
        return vd_codec_memory(VD_CODEC_PNG, picture->width, picture->height);
    }
    struct spng_ihdr header = {.width = (uint32_t)picture->width,
                               .height = (uint32_t)picture->height,
                               .bit_depth = 8,
                               .color_type = SPNG_COLOR_TYPE_TRUECOLOR};
    int error = spng_set_png_stream(png, write_stream, sink);
    if (error == 0) {
        error = spng_set_ihdr(png, &header);
    }
    if (error == 0) {
        error = spng_set_option(png, SPNG_IMG_COMPRESSION_LEVEL, def->effort);
    }
    if (error == 0) { /* choosing a filter for each row takes longer than it saves on a link */
        error = spng_set_option(png, SPNG_FILTER_CHOICE,
                                def->effort < 5 ? SPNG_FILTER_CHOICE_SUB : SPNG_FILTER_CHOICE_ALL);
    }
    if (error == 0) {
        error = write_rows(png, picture, coder->rows.memory);
    }
    spng_ctx_free(png);
    if (error == 0) {
        return vd_success();
    }
    return sink->full ? vd_no_room(VD_CODEC_PNG, sink)
                      : vd_codec_memory(VD_CODEC_PNG, picture->width, picture->height);
}

/* The bytes that libspng has not had yet. */
typedef struct png_bytes {
    const uint8_t *at;
    size_t left;
} png_bytes;

static int read_stream(spng_ctx *png, void *user, void *out, size_t bytes) {
    (void)png;
    png_bytes *b = user;
    if (bytes > b->left) {
        return SPNG_IO_EOF;
    }
    memcpy(out, b->at, bytes);
    b->at += bytes;
    b->left -= bytes;
    return 0;
}

/* Null, or what is wrong; *error is libspng's. */
static const char *read_picture(spng_ctx *png, const vd_source *source, int *error) {
    struct spng_ihdr header;
    if ((*error = spng_get_ihdr(png, &header)) != 0) {
        return spng_strerror(*error);
    }
    if (header.width != (uint32_t)source->width || header.height != (uint32_t)source->height) {
        return "the PNG in it has another size";
    }
    if (header.color_type != SPNG_COLOR_TYPE_TRUECOLOR || header.bit_depth != 8 ||
        header.interlace_method != 0) {
        return "the PNG in it is not three channels of 8 bits";
    }
    *error = spng_decode_image(png, NULL, 0, SPNG_FMT_RGBA8, SPNG_DECODE_PROGRESSIVE);
    for (int y = 0; y < source->height && *error == 0; y++) {
        *error = spng_decode_row(png, source->rgba + 4 * source->stride * (size_t)y,
                                 4 * (size_t)source->width);
    }
    if (*error != 0 && *error != SPNG_EOI) {
        return spng_strerror(*error);
    }
    *error = spng_decode_chunks(png);
    return *error != 0 ? spng_strerror(*error) : NULL;
}

vd_status vd_png_unpack(vd_coder *coder, const vd_source *source) {
    (void)coder;
    spng_ctx *png = spng_ctx_new(0);
    if (png == NULL) {
        return vd_codec_memory(VD_CODEC_PNG, source->width, source->height);
    }
    png_bytes bytes = {source->data, source->bytes};
    int error = spng_set_crc_action(png, SPNG_CRC_ERROR, SPNG_CRC_ERROR);
    if (error == 0) {
        error = spng_set_chunk_limits(png, source->bytes, source->bytes + CACHE_BYTES);
    }
    if (error == 0) {
        error = spng_set_png_stream(png, read_stream, &bytes);
    }
    const char *wrong = error != 0 ? spng_strerror(error) : read_picture(png, source, &error);
    spng_ctx_free(png);
    if (error == SPNG_EMEM) {
        return vd_codec_memory(VD_CODEC_PNG, source->width, source->height);
    }
    /* libspng takes an end that is cut within its checksum */
    if (wrong == NULL && (bytes.left != 0 || source->bytes < sizeof end_chunk ||
                          memcmp(source->data + source->bytes - sizeof end_chunk, end_chunk,
                                 sizeof end_chunk) != 0)) {
        wrong = "it is truncated, or bytes are left over";
    }
    return wrong != NULL ? vd_damaged(VD_CODEC_PNG, source, wrong) : vd_success();
}

/* png_read.c: PNG files into pictures, through libspng.
 *
 * Values are taken as they stand: gamma, colour profiles and significant bits are ignored, since
 * every picture here is sRGB or holds heights. libspng's allocation hooks carry no user pointer, so
 * its own scratch (two rows, zlib's window, ancillary chunks up to a limit) comes from malloc.
 */
#include <spng.h>
#include <string.h>

#include "core/core.h"
#include "image/image.h"

/* Of one ancillary chunk, and of all that libspng keeps. */
#define CHUNK_LIMIT_BYTES ((size_t)64 << 20)

/* Deflate yields at most 1,032 bytes from one (RFC 1951: 258 bytes from two bits). */
#define DEFLATE_MAX_RATIO 1032

static const uint8_t png_signature[8] = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};

bool vd_png_matches(const void *data, size_t size_bytes) {
    /* Four bytes: a signature whose line ends were "converted" is a damaged PNG, not a stranger. */
    return size_bytes >= 4 && memcmp(data, png_signature, 4) == 0;
}

/* The file's bytes that libspng has not had yet. As a stream, not a buffer: of a cut chunk a buffer
 * would give nothing, a stream all but the last 8 KiB, so that the row it ends in is known. */
typedef struct png_bytes {
    const uint8_t *at;
    size_t left;
} png_bytes;

static int read_stream(spng_ctx *png, void *user, void *out, size_t size_bytes) {
    (void)png;
    png_bytes *bytes = user;
    if (size_bytes > bytes->left) {
        return SPNG_IO_EOF;
    }
    memcpy(out, bytes->at, size_bytes);
    bytes->at += size_bytes;
    bytes->left -= size_bytes;
    return 0;
}

static bool ended_early(int error) {
    return error == SPNG_IO_EOF || error == SPNG_EOF || error == SPNG_EIDAT_TOO_SHORT;
}

static vd_status header_failure(const char *name, int error) {
    if (error == SPNG_EMEM) {
        return vd_failure(VD_ERROR_MEMORY, "not enough memory to read %s; free some", name);
    }
    if (ended_early(error)) {
        return vd_failure(VD_ERROR_FORMAT,
                          "cannot read %s: it is truncated within its header; get the file again",
                          name);
    }
    if (error == SPNG_ECHUNK_LIMITS) {
        return vd_failure(VD_ERROR_LIMIT,
                          "cannot read %s: a metadata chunk exceeds %zu MiB; remove its metadata",
                          name, CHUNK_LIMIT_BYTES >> 20);
    }
    return vd_failure(VD_ERROR_FORMAT,
                      "cannot read %s: its PNG header is damaged (%s); get the file again", name,
                      spng_strerror(error));
}

static vd_status row_failure(const char *name, int error, uint32_t row, uint32_t rows) {
    if (error == SPNG_EMEM) {
        return vd_failure(VD_ERROR_MEMORY, "not enough memory to read %s; free some", name);
    }
    if (ended_early(error)) {
        return vd_failure(VD_ERROR_FORMAT,
                          "cannot read %s: it is truncated after row %u of %u; get the file again",
                          name, row, rows);
    }
    return vd_failure(VD_ERROR_FORMAT,
                      "cannot read %s: it is damaged after row %u of %u (%s); get the file again",
                      name, row, rows, spng_strerror(error));
}

/* How a file's pixels come out of libspng. */
typedef struct png_layout {
    int format, flags;
    int channels, bits;
} png_layout;

static png_layout choose_layout(const struct spng_ihdr *header, bool transparent) {
    const int flags = transparent ? SPNG_DECODE_TRNS : 0;
    const int wide = header->bit_depth == 16;
    png_layout layout = {SPNG_FMT_PNG, 0, 1, wide ? 16 : 8};
    switch (header->color_type) {
    case SPNG_COLOR_TYPE_GRAYSCALE:
        layout.channels = transparent ? 2 : 1;
        layout.flags = flags;
        layout.format = transparent ? (wide ? SPNG_FMT_GA16 : SPNG_FMT_GA8)
                                    : (wide ? SPNG_FMT_PNG : SPNG_FMT_G8);
        break;
    case SPNG_COLOR_TYPE_GRAYSCALE_ALPHA:
        layout.channels = 2;
        break;
    case SPNG_COLOR_TYPE_TRUECOLOR_ALPHA:
        layout.channels = 4;
        break;
    default: /* truecolour and palettes */
        layout.channels = transparent ? 4 : 3;
        layout.flags = flags;
        layout.format = transparent ? (wide ? SPNG_FMT_RGBA16 : SPNG_FMT_RGBA8)
                                    : (wide ? SPNG_FMT_PNG : SPNG_FMT_RGB8);
        break;
    }
    return layout;
}

/* Reads the header and says how to decode. */
static vd_status read_header(spng_ctx *png, const char *name, size_t size_bytes,
                             struct spng_ihdr *header, png_layout *layout) {
    int error = spng_get_ihdr(png, header);
    if (error) {
        return header_failure(name, error);
    }
    vd_status status = vd_check_file_size(name, header->width, header->height);
    if (status.code != VD_OK) {
        return status;
    }
    struct spng_trns transparency;
    error = spng_get_trns(png, &transparency);
    if (error && error != SPNG_ECHUNKAVAIL) {
        return header_failure(name, error);
    }
    *layout = choose_layout(header, error == 0);
    size_t scanline = 0; /* bytes of all scanlines at the file's own depth */
    error = spng_decoded_image_size(png, SPNG_FMT_RAW, &scanline);
    if (error) {
        return header_failure(name, error);
    }
    if (scanline / DEFLATE_MAX_RATIO > size_bytes) {
        return vd_failure(
            VD_ERROR_FORMAT,
            "cannot read %s: it is truncated: its %zu bytes cannot hold %u × %u pixels; "
            "get the file again",
            name, size_bytes, header->width, header->height);
    }
    return vd_success();
}

static vd_status read_rows(spng_ctx *png, const char *name, const png_layout *layout,
                           vd_picture *picture) {
    const uint32_t rows = (uint32_t)picture->height;
    const size_t row_bytes =
        (size_t)picture->width * (size_t)picture->channels * (size_t)picture->bits / 8;
    int error =
        spng_decode_image(png, NULL, 0, layout->format, layout->flags | SPNG_DECODE_PROGRESSIVE);
    struct spng_row_info info = {0};
    while (!error) {
        error = spng_get_row_info(png, &info);
        if (!error) {
            error = spng_decode_row(png, vd_picture_row(picture, (int)info.row_num), row_bytes);
        }
    }
    if (error != SPNG_EOI) {
        return row_failure(name, error, info.row_num, rows);
    }
    error = spng_decode_chunks(png);
    return error ? row_failure(name, error, rows, rows) : vd_success();
}

vd_status vd_png_decode(vd_context *context, const void *data, size_t size_bytes, const char *name,
                        vd_picture **out) {
    spng_ctx *png = spng_ctx_new(0);
    if (!png) {
        return header_failure(name, SPNG_EMEM);
    }
    vd_picture *picture = NULL;
    struct spng_ihdr header = {0};
    png_layout layout = {0};
    vd_status status = vd_success();
    int error = spng_set_crc_action(png, SPNG_CRC_ERROR, SPNG_CRC_ERROR);
    if (!error) {
        error = spng_set_chunk_limits(png, CHUNK_LIMIT_BYTES, CHUNK_LIMIT_BYTES);
    }
    png_bytes bytes = {data, size_bytes};
    if (!error) {
        error = spng_set_png_stream(png, read_stream, &bytes);
    }
    if (error) {
        status = header_failure(name, error);
        goto done;
    }
    status = read_header(png, name, size_bytes, &header, &layout);
    if (status.code != VD_OK) {
        goto done;
    }
    status = vd_picture_create(context, (int)header.width, (int)header.height, layout.channels,
                               layout.bits, &picture);
    if (status.code != VD_OK) {
        goto done;
    }
    status = read_rows(png, name, &layout, picture);
    if (status.code != VD_OK) {
        goto done;
    }
    *out = picture;
    picture = NULL;
done:
    vd_picture_destroy(&picture);
    spng_ctx_free(png);
    return status;
}

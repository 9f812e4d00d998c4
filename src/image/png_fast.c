/* png_fast.c: PNG through libdeflate, which compresses about twice as fast as zlib.
 *
 * libspng cannot be given another compressor, so the few chunks of a PNG are written here: header,
 * texts, all rows as one zlib stream, end (PNG specification, §5). Every row is filtered with Sub:
 * of the five filters the fastest, and within 3 % of the smallest on terrain (docs/performance.md).
 */
#include "image/png_fast.h"

#include <string.h>

#include "core/core.h"

#ifdef VEDUTA_HAVE_DEFLATE
#include <libdeflate.h>

#define FILTER_SUB 1
#define LEVEL 1
#define MAX_BYTES ((size_t)256 << 20) /* more is streamed row by row through libspng */

static size_t row_bytes_of(const vd_png_source *source) {
    return (size_t)source->width * (size_t)source->channels * (size_t)source->bits / 8;
}

bool vd_png_fast_possible(const vd_png_source *source) {
    return (row_bytes_of(source) + 1) * (size_t)source->height <= MAX_BYTES;
}

static void store_u32(uint8_t *out, uint32_t value) {
    for (int i = 0; i < 4; i++) {
        out[i] = (uint8_t)(value >> (24 - 8 * i));
    }
}

/* Writes a chunk whose contents come in two pieces, either of which may be empty. */
static void write_chunk(vd_file *file, const char *type, const void *first, size_t first_bytes,
                        const void *second, size_t second_bytes) {
    uint8_t head[8], tail[4];
    store_u32(head, (uint32_t)(first_bytes + second_bytes));
    memcpy(head + 4, type, 4);
    uint32_t crc = libdeflate_crc32(0, head + 4, 4);
    crc = libdeflate_crc32(crc, first, first_bytes);
    crc = libdeflate_crc32(crc, second, second_bytes);
    store_u32(tail, crc);
    vd_file_write(file, head, sizeof head);
    vd_file_write(file, first, first_bytes);
    vd_file_write(file, second, second_bytes);
    vd_file_write(file, tail, sizeof tail);
}

static void write_header(const vd_png_source *source, vd_file *file) {
    static const uint8_t signature[8] = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};
    static const uint8_t color_types[5] = {0, 0, 4, 2, 6}; /* by channels */
    vd_file_write(file, signature, sizeof signature);
    uint8_t header[13] = {0};
    store_u32(header, (uint32_t)source->width);
    store_u32(header + 4, (uint32_t)source->height);
    header[8] = (uint8_t)source->bits;
    header[9] = color_types[source->channels];
    write_chunk(file, "IHDR", header, sizeof header, "", 0);
}

static void write_text(const vd_picture_text *text, vd_file *file) {
    /* Keyword, then: its NUL, not compressed (2 bytes), no language, no translated keyword. */
    uint8_t head[79 + 5] = {0};
    const size_t length = strlen(text->keyword);
    memcpy(head, text->keyword, length);
    write_chunk(file, "iTXt", head, length + 5, text->text, strlen(text->text));
}

/* 16-bit values are big-endian in the file. */
static void swap_row(uint8_t *row, size_t row_bytes) {
    for (size_t i = 0; i < row_bytes; i += 2) {
        uint16_t value;
        memcpy(&value, row + i, sizeof value);
        row[i] = (uint8_t)(value >> 8);
        row[i + 1] = (uint8_t)value;
    }
}

static void filter_rows(const vd_png_source *source, uint8_t *restrict row,
                        uint8_t *restrict filtered) {
    const size_t row_bytes = row_bytes_of(source);
    const size_t pixel = (size_t)source->channels * (size_t)source->bits / 8;
    for (int y = 0; y < source->height; y++) {
        source->row(source->user, y, row);
        if (source->bits == 16) {
            swap_row(row, row_bytes);
        }
        *filtered++ = FILTER_SUB;
        memcpy(filtered, row, pixel);
        for (size_t i = pixel; i < row_bytes; i++) {
            filtered[i] = (uint8_t)(row[i] - row[i - pixel]);
        }
        filtered += row_bytes;
    }
}

vd_status vd_png_write_fast(const vd_png_source *source, const vd_picture_text *text,
                            int text_count, vd_file *file) {
    vd_context *context = source->context;
    const size_t row_bytes = row_bytes_of(source);
    const size_t size_bytes = (row_bytes + 1) * (size_t)source->height;
    /* libdeflate's own tables come from malloc: its hook is one for the whole process. */
    struct libdeflate_compressor *compressor = libdeflate_alloc_compressor(LEVEL);
    const size_t bound = libdeflate_zlib_compress_bound(compressor, size_bytes);
    uint8_t *row = vd_allocate(context, row_bytes, 1);
    uint8_t *filtered = vd_allocate(context, size_bytes, 1);
    uint8_t *compressed = vd_allocate(context, bound, 1);
    vd_status status = vd_success();
    if (compressor == NULL || row == NULL || filtered == NULL || compressed == NULL) {
        status = vd_out_of_memory("the PNG encoder", row_bytes + size_bytes + bound);
    } else {
        filter_rows(source, row, filtered);
        const size_t bytes =
            libdeflate_zlib_compress(compressor, filtered, size_bytes, compressed, bound);
        write_header(source, file);
        for (int i = 0; i < text_count; i++) {
            if (text[i].text[0] != 0) {
                write_text(&text[i], file);
            }
        }
        write_chunk(file, "IDAT", compressed, bytes, "", 0);
        write_chunk(file, "IEND", "", 0, "", 0);
    }
    libdeflate_free_compressor(compressor);
    vd_release(context, row);
    vd_release(context, filtered);
    vd_release(context, compressed);
    return status;
}

#else

bool vd_png_fast_possible(const vd_png_source *source) {
    (void)source;
    return false;
}

vd_status vd_png_write_fast(const vd_png_source *source, const vd_picture_text *text,
                            int text_count, vd_file *file) {
    (void)source;
    (void)text;
    (void)text_count;
    (void)file;
    return vd_failure(VD_ERROR_UNSUPPORTED, "this build has no libdeflate");
}

#endif

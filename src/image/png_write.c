/* png_write.c: pictures and frames into PNG files.
 *
 * Level 1, the default, goes through libdeflate (png_fast.c) where the build has it; everything
 * else through libspng and zlib.
 */
#include <spng.h>
#include <string.h>

#include "core/core.h"
#include "core/file.h"
#include "core/utf8.h"
#include "image/image.h"
#include "image/png_fast.h"

#define FAST_LEVEL 1
#define KEYWORD_MAX 79
#define TEXT_MAX_BYTES ((size_t)16 << 20) /* of one chunk */

vd_png_def vd_png_def_default(void) {
    vd_png_def def = {FAST_LEVEL, NULL, 0};
    return def;
}

/* Printable ASCII without leading, trailing or double spaces (PNG specification, §11.3.4.2). */
static bool is_keyword(const char *keyword) {
    const size_t length = strlen(keyword);
    if (length < 1 || length > KEYWORD_MAX || keyword[0] == ' ' || keyword[length - 1] == ' ') {
        return false;
    }
    for (size_t i = 0; i < length; i++) {
        if (keyword[i] < ' ' || keyword[i] > '~' || (keyword[i] == ' ' && keyword[i + 1] == ' ')) {
            return false;
        }
    }
    return true;
}

static bool is_utf8(const char *text) {
    while (*text) {
        const int count = vd_utf8_bytes(text);
        if (count == 0) {
            return false;
        }
        text += count;
    }
    return true;
}

static vd_status check_def(const vd_png_def *def, const char *path) {
    if (def->level < 0 || def->level > 9) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "cannot write %s: the PNG level %d is not possible; give 0 to 9", path,
                          def->level);
    }
    if (def->text_count < 0 || (def->text_count > 0 && !def->text)) {
        return vd_failure(VD_ERROR_ARGUMENT, "cannot write %s: vd_png_def.text is missing", path);
    }
    for (int i = 0; i < def->text_count; i++) {
        const vd_picture_text *text = &def->text[i];
        if (!text->keyword || !is_keyword(text->keyword)) {
            return vd_failure(VD_ERROR_ARGUMENT,
                              "cannot write %s: the keyword of text chunk %d is not 1 to 79 "
                              "printable ASCII characters; change it",
                              path, i);
        }
        if (!text->text || strlen(text->text) > TEXT_MAX_BYTES || !is_utf8(text->text)) {
            return vd_failure(VD_ERROR_ARGUMENT,
                              "cannot write %s: the text \"%s\" is missing, not UTF-8 or longer "
                              "than %zu MiB; change it",
                              path, text->keyword, TEXT_MAX_BYTES >> 20);
        }
    }
    return vd_success();
}

/* ---- other levels: libspng ----------------------------------------------------------------- */

static int write_stream(spng_ctx *png, void *user, void *data, size_t size_bytes) {
    (void)png;
    vd_file_write(user, data, size_bytes);
    return 0;
}

/* Hands libspng the text chunks. It keeps the pointers: `chunks` has room for all of them and
 * lives as long as `png`. */
static int set_text(spng_ctx *png, const vd_png_def *def, struct spng_text *chunks) {
    static char none[1];
    uint32_t count = 0;
    for (int i = 0; i < def->text_count; i++) {
        if (def->text[i].text[0] == 0) { /* refused by libspng; the fast encoder does the same */
            continue;
        }
        struct spng_text *chunk = &chunks[count++];
        memset(chunk, 0, sizeof *chunk);
        memcpy(chunk->keyword, def->text[i].keyword, strlen(def->text[i].keyword));
        chunk->type = SPNG_ITXT;
        chunk->text = (char *)def->text[i].text; /* not written to */
        chunk->length = strlen(def->text[i].text);
        chunk->language_tag = none;
        chunk->translated_keyword = none;
    }
    return count ? spng_set_text(png, chunks, count) : 0;
}

static int encode(spng_ctx *png, const vd_png_source *source, const vd_png_def *def,
                  struct spng_text *chunks, uint8_t *row, vd_file *file) {
    static const uint8_t color_types[5] = {0, 0, 4, 2, 6}; /* by channels */
    struct spng_ihdr header = {0};
    header.width = (uint32_t)source->width;
    header.height = (uint32_t)source->height;
    header.bit_depth = (uint8_t)source->bits;
    header.color_type = color_types[source->channels];
    int error = spng_set_png_stream(png, write_stream, file);
    if (!error) {
        error = spng_set_ihdr(png, &header);
    }
    if (!error) {
        error = spng_set_option(png, SPNG_IMG_COMPRESSION_LEVEL, def->level);
    }
    if (!error) {
        error = set_text(png, def, chunks);
    }
    if (!error) {
        error = spng_encode_image(png, NULL, 0, SPNG_FMT_PNG,
                                  SPNG_ENCODE_PROGRESSIVE | SPNG_ENCODE_FINALIZE);
    }
    const size_t row_bytes =
        (size_t)source->width * (size_t)source->channels * (size_t)source->bits / 8;
    for (int y = 0; y < source->height && !error; y++) {
        source->row(source->user, y, row);
        error = spng_encode_row(png, row, row_bytes);
    }
    return error == SPNG_EOI ? 0 : error;
}

static vd_status write_zlib(const vd_png_source *source, const vd_png_def *def, const char *path,
                            vd_file *file) {
    vd_context *context = source->context;
    struct spng_text *chunks = vd_allocate(context, (size_t)def->text_count + 1, sizeof *chunks);
    const size_t values = (size_t)source->width * (size_t)source->channels;
    uint8_t *row = vd_allocate(context, values, (size_t)source->bits / 8);
    /* libspng's own memory comes from malloc: its hooks carry no user pointer. */
    spng_ctx *png = spng_ctx_new(SPNG_CTX_ENCODER);
    int error = SPNG_EMEM;
    if (chunks && row && png) {
        error = encode(png, source, def, chunks, row, file);
    }
    spng_ctx_free(png);
    vd_release(context, row);
    vd_release(context, chunks);
    if (error == SPNG_EMEM || error == SPNG_EZLIB_INIT) {
        return vd_out_of_memory("the PNG encoder", values);
    }
    if (error) {
        return vd_failure(VD_ERROR_IO, "cannot write %s: %s; try level %d", path,
                          spng_strerror(error), FAST_LEVEL);
    }
    return vd_success();
}

vd_status vd_png_write(const vd_png_source *source, const char *path, const vd_png_def *def) {
    const vd_png_def standard = vd_png_def_default();
    def = def ? def : &standard;
    vd_status status = check_def(def, path);
    if (status.code != VD_OK) {
        return status;
    }
    vd_file file;
    status = vd_file_create(source->context, path, &file);
    if (status.code != VD_OK) {
        return status;
    }
    status = def->level == FAST_LEVEL && vd_png_fast_possible(source)
                 ? vd_png_write_fast(source, def->text, def->text_count, &file)
                 : write_zlib(source, def, path, &file);
    if (status.code != VD_OK) {
        vd_file_discard(&file);
        return status;
    }
    return vd_file_commit(&file);
}

/* ---- what is written ----------------------------------------------------------------------- */

static void picture_row(const void *user, int y, void *row) {
    const vd_picture *picture = user;
    memcpy(row, vd_picture_row(picture, y),
           (size_t)picture->width * (size_t)picture->channels * (size_t)picture->bits / 8);
}

vd_status vd_picture_save_png(const vd_picture *picture, const char *path, const vd_png_def *def) {
    const vd_png_source source = {
        picture->context, picture->width, picture->height, picture->channels,
        picture->bits,    picture_row,    picture};
    return vd_png_write(&source, path, def);
}

static void opaque_row(const void *user, int y, void *row) {
    const vd_frame *frame = user;
    const uint8_t *in = frame->rgba + (size_t)y * frame->stride * 4;
    uint8_t *out = row;
    for (int x = 0; x < frame->width; x++, in += 4, out += 3) {
        out[0] = in[0];
        out[1] = in[1];
        out[2] = in[2];
    }
}

static void straight_row(const void *user, int y, void *row) {
    const vd_frame *frame = user;
    const uint8_t *in = frame->rgba + (size_t)y * frame->stride * 4;
    uint8_t *out = row;
    for (int x = 0; x < frame->width; x++, in += 4, out += 4) {
        const uint32_t alpha = in[3];
        for (int c = 0; c < 3; c++) {
            const uint32_t value = alpha ? (in[c] * 255u + alpha / 2) / alpha : 0;
            out[c] = (uint8_t)(value < 255 ? value : 255);
        }
        out[3] = (uint8_t)alpha;
    }
}

static bool is_opaque(const vd_frame *frame) {
    for (int y = 0; y < frame->height; y++) {
        const uint8_t *row = frame->rgba + (size_t)y * frame->stride * 4;
        uint8_t all = 255;
        for (int x = 0; x < frame->width; x++) {
            all &= row[4 * x + 3];
        }
        if (all != 255) {
            return false;
        }
    }
    return true;
}

vd_status vd_frame_save_png(const vd_frame *frame, const char *path, const vd_png_def *def) {
    const bool opaque = is_opaque(frame);
    const vd_png_source source = {frame->context,
                                  frame->width,
                                  frame->height,
                                  opaque ? 3 : 4,
                                  8,
                                  opaque ? opaque_row : straight_row,
                                  frame};
    return vd_png_write(&source, path, def);
}

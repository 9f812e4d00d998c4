/* codec.c: the one way in to every codec. */
#include "remote/codec_runs.h"
#include "remote/coder.h"

#include <limits.h>
#include <string.h>
#include <zstd.h>
#include <zstd_errors.h>

enum { QUALITY = 85, EFFORT = 1 };

static const char truncated[] = "it is truncated, or bytes are left over";

/* ---- names and sizes --------------------------------------------------------------------------*/

const char *vd_codec_name(vd_codec codec) {
    static const char *const names[VD_CODEC_COUNT] = {"auto", "raw",  "runs", "runs-zstd",
                                                      "png",  "jpeg", "webp", "webp-lossless"};
    return (unsigned)codec < VD_CODEC_COUNT ? names[codec] : NULL;
}

bool vd_codec_is_lossless(vd_codec codec) {
    return codec > VD_CODEC_AUTO && codec < VD_CODEC_COUNT && codec != VD_CODEC_JPEG &&
           codec != VD_CODEC_WEBP;
}

static bool is_size(int width, int height) {
    return width >= 1 && height >= 1 && width <= VD_CODEC_MAX_SIDE && height <= VD_CODEC_MAX_SIDE &&
           (size_t)width * (size_t)height <= VD_CODEC_MAX_PIXELS;
}

/* A dimension in whole JPEG blocks of two. */
static size_t padded(int side) {
    return ((size_t)side + 15) / 16 * 16;
}

size_t vd_codec_bound(vd_codec codec, int width, int height) {
    if (!is_size(width, height) || (unsigned)codec >= VD_CODEC_COUNT) {
        return 0;
    }
    const size_t pixels = (size_t)width * (size_t)height, rows = (size_t)height;
    size_t most = 0;
    switch (codec) {
    case VD_CODEC_RAW:
        return 4 * pixels;
    case VD_CODEC_RUNS:
        return vd_runs_bound((size_t)width, rows);
    case VD_CODEC_RUNS_ZSTD:
        return ZSTD_compressBound(vd_runs_bound((size_t)width, rows));
    case VD_CODEC_PNG: { /* deflate's stored blocks, and a chunk's frame for every 8 KiB */
        const size_t filtered = 3 * pixels + rows;
        return vd_alpha_bound(pixels) + filtered + filtered / 256 + 1024;
    }
    case VD_CODEC_JPEG: /* as libjpeg-turbo's tjBufSize at full colour */
        return vd_alpha_bound(pixels) + 6 * padded(width) * padded(height) + 2048;
    case VD_CODEC_WEBP:
        return 6 * padded(width) * padded(height) + 4096;
    case VD_CODEC_WEBP_LOSSLESS:
        return vd_alpha_bound(pixels) + 4 * pixels + 4096;
    default:
        for (int c = VD_CODEC_RAW; c < VD_CODEC_COUNT; c++) {
            const size_t bound = vd_codec_bound((vd_codec)c, width, height);
            most = bound > most ? bound : most;
        }
        return most;
    }
}

/* ---- what codecs share ------------------------------------------------------------------------*/

bool vd_sink_write(vd_sink *sink, const void *data, size_t bytes) {
    if (bytes > sink->room - sink->used) {
        sink->full = true;
        return false;
    }
    memcpy(sink->out + sink->used, data, bytes);
    sink->used += bytes;
    return true;
}

vd_status vd_scratch_reserve(vd_coder *coder, vd_scratch *scratch, size_t bytes) {
    if (bytes <= scratch->bytes) {
        return vd_success();
    }
    vd_release(coder->context, scratch->memory);
    scratch->memory = vd_allocate(coder->context, bytes, 1);
    scratch->bytes = scratch->memory != NULL ? bytes : 0;
    return scratch->memory != NULL ? vd_success()
                                   : vd_failure(VD_ERROR_MEMORY,
                                                "not enough memory for the %zu bytes of a packed "
                                                "picture; free some",
                                                bytes);
}

vd_status vd_no_room(vd_codec codec, const vd_sink *sink) {
    return vd_failure(VD_ERROR_LIMIT,
                      "cannot pack a %s picture into %zu bytes; give vd_codec_bound bytes",
                      vd_codec_name(codec), sink->room);
}

vd_status vd_damaged(vd_codec codec, const vd_source *source, const char *why) {
    return vd_failure(
        VD_ERROR_FORMAT,
        "cannot unpack a %s picture of %d × %d pixels from %zu bytes: %.160s; have it "
        "sent again",
        vd_codec_name(codec), source->width, source->height, source->bytes, why);
}

vd_status vd_codec_memory(vd_codec codec, int width, int height) {
    return vd_failure(VD_ERROR_MEMORY,
                      "not enough memory for a %s picture of %d × %d pixels; free some",
                      vd_codec_name(codec), width, height);
}

vd_status vd_zstd_pack(vd_coder *coder, vd_codec codec, int effort, const uint8_t *data,
                       size_t bytes, vd_sink *sink) {
    const size_t packed = ZSTD_compressCCtx(coder->packer, sink->out + sink->used,
                                            sink->room - sink->used, data, bytes, effort);
    if (ZSTD_isError(packed)) {
        return ZSTD_getErrorCode(packed) == ZSTD_error_memory_allocation
                   ? vd_failure(VD_ERROR_MEMORY, "not enough memory for zstd; free some")
                   : vd_no_room(codec, sink);
    }
    sink->used += packed;
    return vd_success();
}

vd_status vd_zstd_unpack(vd_coder *coder, vd_codec codec, const vd_source *source,
                         const uint8_t *data, size_t data_bytes, size_t most, size_t *bytes) {
    const unsigned long long content = ZSTD_getFrameContentSize(data, data_bytes);
    if (content == ZSTD_CONTENTSIZE_ERROR || content == ZSTD_CONTENTSIZE_UNKNOWN ||
        content > most) {
        return vd_damaged(codec, source, "its zstd frame is none, or of another size");
    }
    if (ZSTD_findFrameCompressedSize(data, data_bytes) != data_bytes) {
        return vd_damaged(codec, source, truncated);
    }
    const vd_status status = vd_scratch_reserve(coder, &coder->runs, (size_t)content + 1);
    if (status.code != VD_OK) {
        return status;
    }
    *bytes =
        ZSTD_decompressDCtx(coder->unpacker, coder->runs.memory, (size_t)content, data, data_bytes);
    if (ZSTD_isError(*bytes) || *bytes != content) {
        return vd_damaged(codec, source, "its zstd frame is damaged");
    }
    return vd_success();
}

/* ---- the coder --------------------------------------------------------------------------------*/

vd_status vd_coder_create(vd_context *context, vd_coder **out) {
    vd_coder *coder = vd_allocate(context, 1, sizeof *coder);
    if (coder != NULL) {
        *coder = (vd_coder){
            .context = context, .packer = ZSTD_createCCtx(), .unpacker = ZSTD_createDCtx()};
    }
    if (coder == NULL || coder->packer == NULL || coder->unpacker == NULL) {
        vd_coder_destroy(&coder);
        return vd_failure(VD_ERROR_MEMORY, "not enough memory for a coder of pictures; free some");
    }
    *out = coder;
    return vd_success();
}

void vd_coder_destroy(vd_coder **coder) {
    vd_coder *c = *coder;
    if (c != NULL) {
        ZSTD_freeCCtx(c->packer);
        ZSTD_freeDCtx(c->unpacker);
        vd_release(c->context, c->runs.memory);
        vd_release(c->context, c->plane.memory);
        vd_release(c->context, c->rows.memory);
        vd_release(c->context, c);
    }
    *coder = NULL;
}

vd_encode_def vd_encode_def_default(void) {
    return (vd_encode_def){.codec = VD_CODEC_AUTO};
}

/* ---- packing ----------------------------------------------------------------------------------*/

static vd_status check_encoding(const vd_encode_def *def, const vd_codec_picture *picture) {
    if ((unsigned)def->codec >= VD_CODEC_COUNT) {
        return vd_failure(VD_ERROR_ARGUMENT, "vd_encode_def.codec is %d; give 0 to %d", def->codec,
                          VD_CODEC_COUNT - 1);
    }
    if (def->quality < 0 || def->quality > 100) {
        return vd_failure(VD_ERROR_ARGUMENT, "vd_encode_def.quality is %d; give 1 to 100, or 0",
                          def->quality);
    }
    if (def->effort < 0 || def->effort > 9) {
        return vd_failure(VD_ERROR_ARGUMENT, "vd_encode_def.effort is %d; give 1 to 9, or 0",
                          def->effort);
    }
    if (picture->rgba == NULL || !is_size(picture->width, picture->height)) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "a picture to pack has %d × %d pixels%s; give sides of 1 to %d and at "
                          "most %zu pixels",
                          picture->width, picture->height, picture->rgba ? "" : " and no memory",
                          VD_CODEC_MAX_SIDE, VD_CODEC_MAX_PIXELS);
    }
    if (picture->stride < (size_t)picture->width || picture->stride > INT_MAX / 4) {
        return vd_failure(
            VD_ERROR_ARGUMENT,
            "a picture to pack has a stride of %zu pixels; give at least its width %d",
            picture->stride, picture->width);
    }
    return vd_success();
}

static vd_status pack_raw(const vd_codec_picture *picture, vd_sink *sink) {
    for (int y = 0; y < picture->height; y++) {
        if (!vd_sink_write(sink, picture->rgba + 4 * picture->stride * (size_t)y,
                           4 * (size_t)picture->width)) {
            return vd_no_room(VD_CODEC_RAW, sink);
        }
    }
    return vd_success();
}

static vd_status pack_runs(vd_coder *coder, const vd_encode_def *def,
                           const vd_codec_picture *picture, vd_sink *sink) {
    const size_t width = (size_t)picture->width, height = (size_t)picture->height;
    const size_t bound = vd_runs_bound(width, height);
    if (def->codec == VD_CODEC_RUNS && bound <= sink->room) {
        sink->used = vd_runs_encode(picture->rgba, picture->stride, width, height, sink->out);
        return vd_success();
    }
    const vd_status status = vd_scratch_reserve(coder, &coder->runs, bound);
    if (status.code != VD_OK) {
        return status;
    }
    const size_t bytes =
        vd_runs_encode(picture->rgba, picture->stride, width, height, coder->runs.memory);
    if (def->codec == VD_CODEC_RUNS_ZSTD) {
        return vd_zstd_pack(coder, def->codec, def->effort, coder->runs.memory, bytes, sink);
    }
    return vd_sink_write(sink, coder->runs.memory, bytes) ? vd_success()
                                                          : vd_no_room(def->codec, sink);
}

static vd_status pack_split(vd_coder *coder, const vd_encode_def *def,
                            const vd_codec_picture *picture, vd_sink *sink) {
    const vd_status status = vd_alpha_encode(coder, def->codec, picture, sink);
    if (status.code != VD_OK) {
        return status;
    }
    return def->codec == VD_CODEC_PNG    ? vd_png_pack(coder, def, picture, sink)
           : def->codec == VD_CODEC_JPEG ? vd_jpeg_pack(def, picture, sink)
                                         : vd_webp_pack(coder, def->codec, def, picture, sink);
}

vd_status vd_coder_encode(vd_coder *coder, const vd_encode_def *def,
                          const vd_codec_picture *picture, uint8_t *out, size_t room,
                          vd_encoded *encoded) {
    vd_encode_def d = def != NULL ? *def : vd_encode_def_default();
    vd_status status = check_encoding(&d, picture);
    if (status.code != VD_OK) {
        return status;
    }
    d.quality = d.quality > 0 ? d.quality : QUALITY;
    d.effort = d.effort > 0 ? d.effort : EFFORT;
    if (d.codec == VD_CODEC_AUTO) {
        d.codec = vd_codec_choose(d.costs, d.allowed != 0 ? d.allowed : VD_CODEC_ALL, d.lossless,
                                  d.link_bytes_per_s, picture->width, picture->height);
    }
    vd_sink sink = {out, room, 0, false};
    switch (d.codec) {
    case VD_CODEC_RAW:
        status = pack_raw(picture, &sink);
        break;
    case VD_CODEC_RUNS:
    case VD_CODEC_RUNS_ZSTD:
        status = pack_runs(coder, &d, picture, &sink);
        break;
    case VD_CODEC_WEBP:
        status = vd_webp_pack(coder, d.codec, &d, picture, &sink);
        break;
    default:
        status = pack_split(coder, &d, picture, &sink);
        break;
    }
    if (status.code == VD_OK) {
        *encoded = (vd_encoded){d.codec, sink.used};
    }
    return status;
}

/* ---- unpacking --------------------------------------------------------------------------------*/

static vd_status unpack_raw(const vd_source *s) {
    const size_t row = 4 * (size_t)s->width;
    if (s->bytes != row * (size_t)s->height) {
        return vd_damaged(VD_CODEC_RAW, s, truncated);
    }
    for (int y = 0; y < s->height; y++) {
        memcpy(s->rgba + 4 * s->stride * (size_t)y, s->data + row * (size_t)y, row);
    }
    return vd_success();
}

static vd_status unpack_runs(vd_coder *coder, vd_codec codec, const vd_source *s) {
    const uint8_t *data = s->data;
    size_t bytes = s->bytes;
    if (codec == VD_CODEC_RUNS_ZSTD) {
        const size_t most = vd_runs_bound((size_t)s->width, (size_t)s->height);
        const vd_status status = vd_zstd_unpack(coder, codec, s, data, bytes, most, &bytes);
        if (status.code != VD_OK) {
            return status;
        }
        data = coder->runs.memory;
    }
    const char *wrong =
        vd_runs_decode(data, bytes, (size_t)s->width, (size_t)s->height, s->rgba, s->stride);
    return wrong != NULL ? vd_damaged(codec, s, wrong) : vd_success();
}

static vd_status unpack_split(vd_coder *coder, vd_codec codec, const vd_source *source) {
    bool opaque = true;
    vd_source rest;
    vd_status status = vd_alpha_decode(coder, codec, source, &opaque, &rest);
    if (status.code == VD_OK) {
        status = codec == VD_CODEC_PNG    ? vd_png_unpack(coder, &rest)
                 : codec == VD_CODEC_JPEG ? vd_jpeg_unpack(&rest)
                                          : vd_webp_unpack(codec, &rest);
    }
    if (status.code == VD_OK && !opaque) {
        vd_alpha_apply(coder, &rest, codec == VD_CODEC_JPEG);
    }
    return status;
}

vd_status vd_coder_decode(vd_coder *coder, vd_codec codec, const void *data, size_t bytes,
                          int width, int height, uint8_t *rgba, size_t stride) {
    if (!is_size(width, height) || stride < (size_t)width || stride > INT_MAX / 4 || rgba == NULL ||
        (data == NULL && bytes > 0)) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "a picture to unpack has %d × %d pixels, %zu from row to row; give sides "
                          "of 1 to %d, at most %zu pixels, and memory",
                          width, height, stride, VD_CODEC_MAX_SIDE, VD_CODEC_MAX_PIXELS);
    }
    const vd_source source = {data, bytes, width, height, rgba, stride};
    switch (codec) {
    case VD_CODEC_RAW:
        return unpack_raw(&source);
    case VD_CODEC_RUNS:
    case VD_CODEC_RUNS_ZSTD:
        return unpack_runs(coder, codec, &source);
    case VD_CODEC_PNG:
    case VD_CODEC_JPEG:
    case VD_CODEC_WEBP_LOSSLESS:
        return unpack_split(coder, codec, &source);
    case VD_CODEC_WEBP:
        return vd_webp_unpack(codec, &source);
    default:
        return vd_failure(VD_ERROR_FORMAT,
                          "there is no codec %d for a picture; both sides need the same version",
                          (int)codec);
    }
}

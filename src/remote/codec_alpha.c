/* codec_alpha.c: the alpha of a picture whose colours travel as an opaque one. */
#include "remote/codec_runs.h"
#include "remote/coder.h"

#include <string.h>

#define HEAD_BYTES 4

size_t vd_alpha_bound(size_t pixels) {
    return HEAD_BYTES + vd_runs_plane_bound(pixels);
}

/* Gathers alpha; false when all of it is 255. */
static bool gather(const vd_codec_picture *picture, uint8_t *plane) {
    const size_t width = (size_t)picture->width;
    uint8_t all = 255;
    for (int y = 0; y < picture->height; y++) {
        const uint8_t *row = picture->rgba + 4 * picture->stride * (size_t)y;
        for (size_t x = 0; x < width; x++) {
            plane[x] = row[4 * x + 3];
            all &= plane[x];
        }
        plane += width;
    }
    return all != 255;
}

static void store_head(uint8_t *head, size_t bytes, bool zstd) {
    const uint32_t value = (uint32_t)bytes << 1 | (zstd ? 1u : 0u);
    for (int i = 0; i < HEAD_BYTES; i++) {
        head[i] = (uint8_t)(value >> 8 * i);
    }
}

vd_status vd_alpha_encode(vd_coder *coder, vd_codec codec, const vd_codec_picture *picture,
                          vd_sink *sink) {
    const size_t pixels = (size_t)picture->width * (size_t)picture->height;
    vd_status status = vd_scratch_reserve(coder, &coder->plane, pixels);
    if (status.code == VD_OK) {
        status = vd_scratch_reserve(coder, &coder->runs, vd_runs_plane_bound(pixels));
    }
    if (status.code != VD_OK) {
        return status;
    }
    uint8_t head[HEAD_BYTES] = {0};
    uint8_t *const head_at = sink->out + sink->used;
    if (!vd_sink_write(sink, head, sizeof head)) {
        return vd_no_room(codec, sink);
    }
    if (!gather(picture, coder->plane.memory)) {
        return vd_success();
    }
    const size_t bytes = vd_runs_encode_plane(coder->plane.memory, pixels, coder->runs.memory);
    vd_sink packed = *sink;
    if (packed.room - packed.used > bytes) { /* zstd only where it is shorter */
        packed.room = packed.used + bytes;
    }
    const size_t before = sink->used;
    if (vd_zstd_pack(coder, codec, 1, coder->runs.memory, bytes, &packed).code == VD_OK) {
        sink->used = packed.used;
        store_head(head_at, sink->used - before, true);
    } else if (vd_sink_write(sink, coder->runs.memory, bytes)) {
        store_head(head_at, bytes, false);
    } else {
        return vd_no_room(codec, sink);
    }
    return vd_success();
}

vd_status vd_alpha_decode(vd_coder *coder, vd_codec codec, const vd_source *source, bool *opaque,
                          vd_source *rest) {
    if (source->bytes < HEAD_BYTES) {
        return vd_damaged(codec, source, "it is truncated");
    }
    const uint8_t *const d = source->data;
    const uint32_t head = d[0] | (uint32_t)d[1] << 8 | (uint32_t)d[2] << 16 | (uint32_t)d[3] << 24;
    const size_t bytes = head >> 1, pixels = (size_t)source->width * (size_t)source->height;
    *rest = *source;
    rest->data += HEAD_BYTES;
    rest->bytes -= HEAD_BYTES;
    *opaque = head == 0;
    if (*opaque) {
        return vd_success();
    }
    if (bytes > rest->bytes) {
        return vd_damaged(codec, source, "its alpha is truncated");
    }
    const uint8_t *runs = rest->data;
    size_t run_bytes = bytes;
    vd_status status = vd_scratch_reserve(coder, &coder->plane, pixels);
    if (status.code == VD_OK && (head & 1u)) {
        status = vd_zstd_unpack(coder, codec, source, runs, bytes, vd_runs_plane_bound(pixels),
                                &run_bytes);
        runs = coder->runs.memory;
    }
    if (status.code != VD_OK) {
        return status;
    }
    const char *wrong = vd_runs_decode_plane(runs, run_bytes, pixels, coder->plane.memory);
    if (wrong != NULL) {
        return vd_damaged(codec, source, wrong);
    }
    rest->data += bytes;
    rest->bytes -= bytes;
    return vd_success();
}

/* Most pixels are opaque or nothing. */
static inline void clamp_pixel(uint8_t *pixel, uint8_t alpha) {
    if (alpha == 0) {
        memset(pixel, 0, 3);
    } else if (alpha != 255) {
        for (int c = 0; c < 3; c++) {
            pixel[c] = pixel[c] < alpha ? pixel[c] : alpha;
        }
    }
}

void vd_alpha_apply(const vd_coder *coder, const vd_source *source, bool clamp) {
    const uint8_t *plane = coder->plane.memory;
    for (int y = 0; y < source->height; y++) {
        uint8_t *row = source->rgba + 4 * source->stride * (size_t)y;
        for (int x = 0; x < source->width; x++, row += 4) {
            const uint8_t alpha = *plane++;
            if (clamp) {
                clamp_pixel(row, alpha);
            }
            row[3] = alpha;
        }
    }
}

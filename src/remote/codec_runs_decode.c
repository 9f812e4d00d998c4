/* codec_runs_decode.c: run-length pictures unpacked, natively and in WebAssembly. */
#include "remote/codec_runs.h"

#include <string.h>

static const char ended_early[] = "it is truncated";
static const char leaves_row[] = "a run leaves its row";
static const char left_over[] = "bytes are left over";

static inline unsigned load_u16(const uint8_t *at) {
    return at[0] | (unsigned)at[1] << 8;
}

/* Writes one pixel `count` times; pairs at once. */
static inline void fill_pixels(uint8_t *out, const uint8_t *pixel, size_t count) {
    uint8_t pair[16];
    for (int i = 0; i < 4; i++) {
        memcpy(pair + 4 * i, pixel, 4);
    }
    size_t i = 0;
    for (; i + 4 <= count; i += 4) {
        memcpy(out + 4 * i, pair, 16);
    }
    for (; i < count; i++) {
        memcpy(out + 4 * i, pair, 4);
    }
}

/* Unpacks the tokens of a row's `count` pixels and moves *data behind them. */
static const char *decode_row(const uint8_t **data, const uint8_t *end, size_t count,
                              uint8_t *out) {
    const uint8_t *at = *data;
    while (count > 0) {
        if (end - at < 6) { /* of both kinds the shortest */
            return ended_early;
        }
        const unsigned token = load_u16(at);
        const size_t length = (token >> 1) + 1u;
        at += 2;
        if (length > count) {
            return leaves_row;
        }
        if (token & 1u) {
            fill_pixels(out, at, length);
            at += 4;
        } else if ((size_t)(end - at) < 4 * length) {
            return ended_early;
        } else {
            memcpy(out, at, 4 * length);
            at += 4 * length;
        }
        out += 4 * length;
        count -= length;
    }
    *data = at;
    return NULL;
}

const char *vd_runs_decode(const uint8_t *data, size_t bytes, size_t width, size_t height,
                           uint8_t *rgba, size_t stride) {
    const uint8_t *const end = data + bytes;
    for (size_t y = 0; y < height; y++) {
        uint8_t *const row = rgba + 4 * stride * y;
        if (end - data < 4) {
            return ended_early;
        }
        const size_t skip = load_u16(data), count = load_u16(data + 2);
        data += 4;
        if (skip + count > width || (count == 0 && skip != 0)) {
            return leaves_row;
        }
        memset(row, 0, 4 * skip);
        const char *wrong = decode_row(&data, end, count, row + 4 * skip);
        if (wrong != NULL) {
            return wrong;
        }
        memset(row + 4 * (skip + count), 0, 4 * (width - skip - count));
    }
    return data == end ? NULL : left_over;
}

const char *vd_runs_decode_plane(const uint8_t *data, size_t bytes, size_t count, uint8_t *plane) {
    const uint8_t *const end = data + bytes;
    while (count > 0) {
        if (end - data < 3) {
            return ended_early;
        }
        const unsigned token = load_u16(data);
        const size_t length = (token >> 1) + 1u;
        data += 2;
        if (length > count) {
            return leaves_row;
        }
        if (token & 1u) {
            memset(plane, *data, length);
            data += 1;
        } else if ((size_t)(end - data) < length) {
            return ended_early;
        } else {
            memcpy(plane, data, length);
            data += length;
        }
        plane += length;
        count -= length;
    }
    return data == end ? NULL : left_over;
}

/* codec_runs.h: run-length coding of pictures (Lawlor 2004, §5.3), freestanding.
 *
 * The decoder is also compiled to WebAssembly: nothing but memcpy and memset is used, and no header
 * of ours is included. The bytes, numbers little-endian:
 *   picture   every row from the top: u16 skip, u16 count, then tokens for `count` pixels. What is
 *             left and right of them is zero: transparent. skip + count ≤ width; no tokens when
 *             count is 0, and then skip is 0
 *   tokens    u16: the lowest bit 0: (u >> 1) + 1 pixels follow as they are; 1: one pixel follows
 *             and stands (u >> 1) + 1 times. A token ends within its row
 *   plane     the same tokens for bytes instead of pixels, over all of the plane, no rows
 */
#ifndef VEDUTA_REMOTE_CODEC_RUNS_H
#define VEDUTA_REMOTE_CODEC_RUNS_H

#include <stddef.h>
#include <stdint.h>

/* Most bytes of a picture or plane. A run is written where it is 5 long at least and so pays for
 * its token and for that of what follows; else a row is one token for every 32768 pixels. */
static inline size_t vd_runs_bound(size_t width, size_t height) {
    return height * (4 + 2 * ((width + 32767) / 32768) + 4 * width);
}
static inline size_t vd_runs_plane_bound(size_t count) {
    return 2 * ((count + 32767) / 32768) + count;
}

/* Packs rows of RGBA, `stride` pixels apart, into out, which has room for vd_runs_bound. Sides are
 * at most 65535. Returns the bytes written. */
size_t vd_runs_encode(const uint8_t *rgba, size_t stride, size_t width, size_t height,
                      uint8_t *out);

/* Packs every fourth byte's worth of a plane already gathered: count bytes. */
size_t vd_runs_encode_plane(const uint8_t *plane, size_t count, uint8_t *out);

/* Unpacks. Writes only width × height pixels; reads only data[bytes]. Returns null, or what is
 * wrong: a piece of a sentence. */
const char *vd_runs_decode(const uint8_t *data, size_t bytes, size_t width, size_t height,
                           uint8_t *rgba, size_t stride);
const char *vd_runs_decode_plane(const uint8_t *data, size_t bytes, size_t count, uint8_t *plane);

#endif

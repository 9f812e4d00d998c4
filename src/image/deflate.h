/* deflate.h: a fast zlib stream (RFC 1950, 1951) for filtered picture rows.
 *
 * Rows that went through a PNG filter hold small residues and runs of equal bytes, and hardly any
 * longer repetition. So this encoder knows literals and runs (matches at distance 1) only, and
 * spends its time on Huffman codes fitted to each block: no hash chains, no history. Measured on a
 * 1920 × 1080 RGB view (docs/performance.md), zlib's level 1 takes three times as long.
 *
 *     filtered bytes ──► tokens (literal, run) ──► frequencies ──► codes ──► bits
 */
#ifndef VEDUTA_IMAGE_DEFLATE_H
#define VEDUTA_IMAGE_DEFLATE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Bytes that must be readable behind the data handed to vd_deflate_block. */
#define VD_DEFLATE_SLACK 8

typedef struct vd_deflate {
    uint64_t bits;      /* not yet written, the oldest lowest */
    uint32_t bit_count; /* below 8 between calls */
    uint32_t adler_low, adler_high;
} vd_deflate;

/* Starts a stream; writes its two header bytes to `out` and returns 2. */
size_t vd_deflate_begin(vd_deflate *deflate, uint8_t *out);

/* The room that vd_deflate_block needs at `out` for `size_bytes` of input. */
size_t vd_deflate_bound(size_t size_bytes);

/* Encodes one block of 1 … 2^30 bytes; the last one also ends the stream. `tokens` is scratch for
 * size_bytes entries. Returns the bytes written to `out`. Bits that do not fill a byte wait for the
 * next block. */
size_t vd_deflate_block(vd_deflate *deflate, const uint8_t *data, size_t size_bytes, bool last,
                        uint16_t *tokens, uint8_t *out);

#endif

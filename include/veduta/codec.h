/* codec.h: pictures made small for a wire, and back.
 *
 * Part of the library veduta-remote. One interface for every way to pack RGBA8 pictures with
 * premultiplied alpha, such as impostors and frames (Lawlor 2004, §5.3):
 *
 *     status = vd_coder_create(context, &coder);
 *     status = vd_coder_encode(coder, NULL, &picture, bytes, room, &encoded);
 *     status = vd_coder_decode(coder, encoded.codec, bytes, encoded.bytes, width, height, rgba,
 *                              stride);
 *
 * Packed bytes hold neither codec nor size: the message around them does (wire.h). They may come
 * from anybody: a decoder checks everything before it uses it, and takes no more memory than the
 * picture that was promised, the bytes and a constant of each library. docs/wire.md specifies the
 * bytes of each codec.
 *
 * Lossless codecs give back the same bytes for any bytes. JPEG, PNG and lossless WebP carry the
 * premultiplied colours as an opaque picture and alpha beside it, because browsers multiply colours
 * by alpha on the way to a canvas, and round; lossy WebP carries straight colours and its own
 * alpha. What lossy codecs decode is premultiplied again: no colour is above its alpha.
 */
#ifndef VEDUTA_CODEC_H
#define VEDUTA_CODEC_H

#include <stdbool.h>
#include <veduta/context.h>

VD_BEGIN_DECLARATIONS

/* The numbers are those on the wire and never change. */
typedef enum vd_codec {
    VD_CODEC_AUTO = 0,  /* for encoding: chosen by costs and link; never on the wire */
    VD_CODEC_RAW,       /* width × height × 4 bytes */
    VD_CODEC_RUNS,      /* run-length: rows without their transparent ends, runs of equal pixels */
    VD_CODEC_RUNS_ZSTD, /* that in a zstd frame */
    VD_CODEC_PNG,
    VD_CODEC_JPEG, /* with alpha beside it */
    VD_CODEC_WEBP, /* lossy with alpha */
    VD_CODEC_WEBP_LOSSLESS,
    VD_CODEC_COUNT
} vd_codec;

#define VD_CODEC_MAX_SIDE 16383                   /* WebP's */
#define VD_CODEC_MAX_PIXELS ((size_t)1 << 26)     /* 8192² */
#define VD_CODEC_BIT(codec) (1u << (codec))       /* of a set of codecs */
#define VD_CODEC_ALL ((1u << VD_CODEC_COUNT) - 2) /* every one but VD_CODEC_AUTO */

/* Returns "auto", "raw", "runs", "runs-zstd", "png", "jpeg", "webp" or "webp-lossless"; null
 * outside. */
VD_API const char *vd_codec_name(vd_codec codec);

/* Whether decoding gives the same bytes back. */
VD_API bool vd_codec_is_lossless(vd_codec codec);

/* ---- what it costs, and which to take ---------------------------------------------------------*/

/* A line: `fixed` + pixels × `per pixel`, over pictures like those sent. */
typedef struct vd_codec_cost {
    double bytes_fixed, bytes_per_pixel;
    double encode_ns_fixed, encode_ns_per_pixel;
    double decode_ns_fixed, decode_ns_per_pixel;
} vd_codec_cost;

typedef struct vd_codec_costs {
    vd_codec_cost codecs[VD_CODEC_COUNT]; /* [VD_CODEC_AUTO] is unused */
} vd_codec_costs;

/* As `veduta bench codec` measured them for a tree on one core at 2 to 3 GHz: where to begin. */
VD_API vd_codec_costs vd_codec_costs_default(void);

/* Takes a measurement into account: the parts per pixel of `codec` move an eighth of the way to
 * what explains it, the fixed parts stay. A side that did not measure gives NaN. Measurements that
 * are negative or infinite, pixels of 0 and unknown codecs change nothing. */
VD_API void vd_codec_costs_learn(vd_codec_costs *costs, vd_codec codec, size_t pixels, size_t bytes,
                                 double encode_ns, double decode_ns);

/* Returns the codec of `allowed` (VD_CODEC_BIT) whose slowest stage, encoding, sending or decoding,
 * takes the shortest for a picture: they work at the same time on different pictures (figure 5.5);
 * a tenth of the sum is added, for the one picture that somebody waits for. `costs` may be null for
 * the defaults; a link that is not above 0 counts as 10 MB/s. `lossless` leaves the lossy ones out.
 * VD_CODEC_RAW when nothing is left. */
VD_API vd_codec vd_codec_choose(const vd_codec_costs *costs, unsigned allowed, bool lossless,
                                double link_bytes_per_s, int width, int height);

/* ---- packing ----------------------------------------------------------------------------------*/

/* Borrowed. Premultiplied for lossy codecs; any bytes for the others. */
typedef struct vd_codec_picture {
    const uint8_t *rgba; /* [height][stride][4] */
    int width, height;   /* 1 … VD_CODEC_MAX_SIDE, at most VD_CODEC_MAX_PIXELS together */
    size_t stride;       /* pixels from one row to the next, at least width */
} vd_codec_picture;

typedef struct vd_encode_def {
    vd_codec codec;              /* VD_CODEC_AUTO: vd_codec_choose by what follows */
    int quality;                 /* 1 … 100 of JPEG and lossy WebP; 0: 85 */
    int effort;                  /* 1 (fastest) … 9 of zstd, PNG and WebP; 0: 1 */
    unsigned allowed;            /* VD_CODEC_AUTO: a set of codecs; 0: VD_CODEC_ALL */
    bool lossless;               /* VD_CODEC_AUTO: only such */
    double link_bytes_per_s;     /* VD_CODEC_AUTO: 0: 10 MB/s */
    const vd_codec_costs *costs; /* VD_CODEC_AUTO; borrowed; null: the defaults */
} vd_encode_def;

/* Everything zero: automatic. */
VD_API vd_encode_def vd_encode_def_default(void);

typedef struct vd_encoded {
    vd_codec codec; /* never VD_CODEC_AUTO */
    size_t bytes;
} vd_encoded;

/* Returns how many bytes encoding takes at most, for VD_CODEC_AUTO with any codec; 0 for an unknown
 * codec or a size out of range. Of PNG, JPEG and WebP it is what their worst pictures take and a
 * reserve; encoding fails when it does not do. */
VD_API size_t vd_codec_bound(vd_codec codec, int width, int height);

/* Holds what packing and unpacking need and keeps it from picture to picture: with runs and zstd a
 * picture no larger than one before allocates nothing. One call at a time. */
typedef struct vd_coder vd_coder;

/* Returns VD_ERROR_MEMORY. *out is owned by the caller. */
VD_API VD_MUST_USE vd_status vd_coder_create(vd_context *context, vd_coder **out);
VD_API void vd_coder_destroy(vd_coder **coder);

/* Packs a picture into out[room]; `def` may be null for the defaults. The same bytes on every
 * machine for raw, runs and (of one zstd version) runs-zstd. Cost: docs/wire.md.
 * Returns VD_ERROR_ARGUMENT (a field of def or the picture, by name), VD_ERROR_LIMIT (it does not
 * fit into `room`, which vd_codec_bound says) or VD_ERROR_MEMORY; out is then undefined. */
VD_API VD_MUST_USE vd_status vd_coder_encode(vd_coder *coder, const vd_encode_def *def,
                                             const vd_codec_picture *picture, uint8_t *out,
                                             size_t room, vd_encoded *encoded);

/* Unpacks data[bytes] into the caller's rgba [height][stride][4]; pixels between width and stride
 * are left alone. Returns VD_ERROR_ARGUMENT (size, stride, no memory), VD_ERROR_FORMAT (no such
 * codec, damaged, of another size than promised where the bytes tell, bytes left over) or
 * VD_ERROR_MEMORY; the picture is then undefined. */
VD_API VD_MUST_USE vd_status vd_coder_decode(vd_coder *coder, vd_codec codec, const void *data,
                                             size_t bytes, int width, int height, uint8_t *rgba,
                                             size_t stride);

VD_END_DECLARATIONS

#endif

/* coder.h: what the files of each codec share. */
#ifndef VEDUTA_REMOTE_CODER_H
#define VEDUTA_REMOTE_CODER_H

#include <veduta/codec.h>

typedef struct ZSTD_CCtx_s vd_zstd_packer;
typedef struct ZSTD_DCtx_s vd_zstd_unpacker;

/* Memory kept from picture to picture. */
typedef struct vd_scratch {
    uint8_t *memory;
    size_t bytes;
} vd_scratch;

struct vd_coder {
    vd_context *context;
    vd_zstd_packer *packer;
    vd_zstd_unpacker *unpacker;
    vd_scratch runs;  /* a picture or plane in runs, before zstd or after it */
    vd_scratch plane; /* alpha */
    vd_scratch rows;  /* what a library wants its pixels in */
};

/* Where packed bytes go: the caller's. */
typedef struct vd_sink {
    uint8_t *out;
    size_t room, used;
    bool full; /* something did not fit */
} vd_sink;

/* Appends; false when there is no room. */
bool vd_sink_write(vd_sink *sink, const void *data, size_t bytes);

/* Packed bytes and the picture they are to become. */
typedef struct vd_source {
    const uint8_t *data;
    size_t bytes;
    int width, height;
    uint8_t *rgba;
    size_t stride;
} vd_source;

/* Makes room; what is in it is lost when it grows. */
VD_MUST_USE vd_status vd_scratch_reserve(vd_coder *coder, vd_scratch *scratch, size_t bytes);

/* The sentences of all codecs. `why` is a piece of one, such as "it is truncated". */
vd_status vd_no_room(vd_codec codec, const vd_sink *sink);
vd_status vd_damaged(vd_codec codec, const vd_source *source, const char *why);
vd_status vd_codec_memory(vd_codec codec, int width, int height);

/* zstd frames with their size inside. Unpacking takes exactly one frame of at most `most` bytes
 * into coder->runs and returns its size through *bytes; null, or what is wrong. */
VD_MUST_USE vd_status vd_zstd_pack(vd_coder *coder, vd_codec codec, int effort, const uint8_t *data,
                                   size_t bytes, vd_sink *sink);
VD_MUST_USE vd_status vd_zstd_unpack(vd_coder *coder, vd_codec codec, const vd_source *source,
                                     const uint8_t *data, size_t data_bytes, size_t most,
                                     size_t *bytes);

/* Alpha beside an opaque picture: u32 head, the bytes of alpha twice, plus 1 when they are in a
 * zstd frame; 0: opaque. Then these bytes, a plane in runs. `bound`: most it takes. */
size_t vd_alpha_bound(size_t pixels);
VD_MUST_USE vd_status vd_alpha_encode(vd_coder *coder, vd_codec codec,
                                      const vd_codec_picture *picture, vd_sink *sink);

/* Reads the head and the plane, into coder->plane or, when opaque, to *opaque, and sets *rest to
 * the source without them. */
VD_MUST_USE vd_status vd_alpha_decode(vd_coder *coder, vd_codec codec, const vd_source *source,
                                      bool *opaque, vd_source *rest);

/* Puts the plane into the picture; `clamp`: and no colour above its alpha. */
void vd_alpha_apply(const vd_coder *coder, const vd_source *source, bool clamp);

/* Each codec's own part: the colours of an opaque picture (PNG, JPEG, lossless WebP) or all of it.
 * `def` has its zeros filled in. Decoders write alpha 255 where they carry none. */
VD_MUST_USE vd_status vd_png_pack(vd_coder *coder, const vd_encode_def *def,
                                  const vd_codec_picture *picture, vd_sink *sink);
VD_MUST_USE vd_status vd_png_unpack(vd_coder *coder, const vd_source *source);
VD_MUST_USE vd_status vd_jpeg_pack(const vd_encode_def *def, const vd_codec_picture *picture,
                                   vd_sink *sink);
VD_MUST_USE vd_status vd_jpeg_unpack(const vd_source *source);
VD_MUST_USE vd_status vd_webp_pack(vd_coder *coder, vd_codec codec, const vd_encode_def *def,
                                   const vd_codec_picture *picture, vd_sink *sink);
VD_MUST_USE vd_status vd_webp_unpack(vd_codec codec, const vd_source *source);

#endif

/* picture.h: picture files, and comparing two pictures.
 *
 * A vd_picture is what a picture file holds, before anything is made of it: 1 to 4 channels
 * (grey, grey + alpha, RGB, RGBA; alpha not premultiplied) of 8 or 16 bits in the machine's byte
 * order. Readers look at the contents, not at the file's name. Writers write beside and rename, so
 * that a failed or interrupted write leaves what was there before. The path "-" means standard
 * input or standard output.
 */
#ifndef VEDUTA_PICTURE_H
#define VEDUTA_PICTURE_H

#include <veduta/color.h>
#include <veduta/frame.h>

VD_BEGIN_DECLARATIONS

typedef struct vd_picture {
    vd_context *context;
    int width, height;
    int channels;        /* 1 … 4 */
    int bits;            /* 8 or 16 per channel */
    size_t stride_bytes; /* from one row to the next */
    void *data;          /* uint8_t or uint16_t [height][stride][channels] */
} vd_picture;

/* Creates a picture with undefined contents. Returns VD_ERROR_ARGUMENT, VD_ERROR_LIMIT (see
 * VD_MAX_SIDE, VD_MAX_PIXELS) or VD_ERROR_MEMORY. */
VD_API VD_MUST_USE vd_status vd_picture_create(vd_context *context, int width, int height,
                                               int channels, int bits, vd_picture **out);
VD_API void vd_picture_destroy(vd_picture **picture);

/* Reads a PNG (any colour type and depth: palettes and 1, 2, 4 bits are expanded to 8, tRNS to
 * alpha), a PGM/PPM (P2, P3, P5, P6; 8 bits up to maxval 255, else 16; values are kept as they
 * stand in the file, not scaled to the maxval) or a JPEG (grey or RGB; where the build has libjpeg,
 * else VD_ERROR_UNSUPPORTED, as for one in four inks). Returns VD_ERROR_IO, VD_ERROR_FORMAT,
 * VD_ERROR_LIMIT or VD_ERROR_MEMORY; on failure *out is untouched. */
VD_API VD_MUST_USE vd_status vd_picture_load(vd_context *context, const char *path,
                                             vd_picture **out);

/* The same from memory; `name` is what the error sentence calls it. */
VD_API VD_MUST_USE vd_status vd_picture_decode(vd_context *context, const void *data,
                                               size_t size_bytes, const char *name,
                                               vd_picture **out);

/* Returns the colour of a pixel, 16-bit channels rounded to 8, grey spread, opaque where there is
 * no alpha. 0 <= x < width, 0 <= y < height. */
VD_API vd_rgba8 vd_picture_color(const vd_picture *picture, int x, int y);

/* A text chunk: a keyword of 1 … 79 bytes of printable ASCII, without spaces at its ends or two in
 * a row, and UTF-8 text of at most 16 MiB. One with an empty text is left out. */
typedef struct vd_picture_text {
    const char *keyword;
    const char *text;
} vd_picture_text;

typedef struct vd_png_def {
    int level;                   /* 1: our own fast encoder; 0, 2 … 9: zlib's levels */
    const vd_picture_text *text; /* written as iTXt */
    int text_count;
} vd_png_def;

/* Level 1, no text. Level 1 is made for writing many pictures: it goes through libdeflate where the
 * build has it (else zlib) with the Sub filter; its figures are in docs/performance.md. */
VD_API vd_png_def vd_png_def_default(void);

/* Writes a picture as PNG. `def` may be null. Returns VD_ERROR_ARGUMENT, VD_ERROR_IO (disk full,
 * no such folder, not permitted: the sentence says which) or VD_ERROR_MEMORY. */
VD_API VD_MUST_USE vd_status vd_picture_save_png(const vd_picture *picture, const char *path,
                                                 const vd_png_def *def);

/* Writes a frame's colours: RGB when every pixel is opaque, else RGBA un-premultiplied. */
VD_API VD_MUST_USE vd_status vd_frame_save_png(const vd_frame *frame, const char *path,
                                               const vd_png_def *def);

/* Writes a frame's depth plane, by the ending of the path:
 *   .pfm  float, distance along the view axis in metres (near / depth), +infinity = nothing
 *   .exr  one float channel "Z" with the same values (OpenEXR; VD_ERROR_UNSUPPORTED without it)
 *   .png  16-bit grey: round(65535 × nearest / distance), 0 = nothing, where `nearest` is the
 *         smallest distance in the frame, given in metres in the text chunk "veduta:nearest_m";
 *         what is too far for the 16 bits is 1
 * `near_m` is the camera's near distance; `far_m` is 0 for perspective depth, else the far distance
 * of orthographic depth. Returns VD_ERROR_ARGUMENT (no depth plane, unknown ending), VD_ERROR_IO,
 * VD_ERROR_MEMORY. */
VD_API VD_MUST_USE vd_status vd_frame_save_depth(const vd_frame *frame, double near_m, double far_m,
                                                 const char *path);

/* Writes a frame's id plane as 16-bit grey PNG; the object ids stand in text chunks "veduta:id N".
 * Returns VD_ERROR_ARGUMENT (no id plane), VD_ERROR_LIMIT (an id above 65535), VD_ERROR_IO. */
VD_API VD_MUST_USE vd_status vd_frame_save_ids(const vd_frame *frame, const char *path);

/* How two pictures of one size differ, over R, G and B (and A where either has it) as 8-bit values
 * (16-bit ones when both are 16-bit, scaled to 0 … 255). */
typedef struct vd_comparison {
    double rms;                /* root of the mean squared difference, 0 … 255 */
    double maximum;            /* the largest difference of one channel, 0 … 255 */
    double psnr_db;            /* 20 log10(255 / rms); infinity when identical */
    uint64_t differing_pixels; /* pixels with any channel differing by more than the tolerance */
    uint64_t pixels;
} vd_comparison;

/* Compares a and b. When `difference` is not null, *difference receives a picture, owned by the
 * caller: RGB, |a - b| per channel × 8, clamped. `tolerance` is in 8-bit units.
 * Returns VD_ERROR_ARGUMENT (sizes differ: the sentence gives both) or VD_ERROR_MEMORY. */
VD_API VD_MUST_USE vd_status vd_picture_compare(const vd_picture *a, const vd_picture *b,
                                                double tolerance, vd_comparison *out,
                                                vd_picture **difference);

VD_END_DECLARATIONS

#endif

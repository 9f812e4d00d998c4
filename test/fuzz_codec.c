/* Any bytes as a packed picture: an error or a picture; and any bytes as a picture, which comes
 * back from every lossless codec. Three bytes first: codec, width, height. */
#include <stdlib.h>
#include <string.h>
#include <veduta/codec.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void unpack(vd_coder *coder, vd_codec codec, int width, int height, const uint8_t *data,
                   size_t bytes) {
    const size_t stride = (size_t)width + 3;
    uint8_t *rgba = malloc(4 * stride * (size_t)height);
    if (rgba == NULL) {
        return;
    }
    const vd_status status =
        vd_coder_decode(coder, codec, data, bytes, width, height, rgba, stride);
    for (int y = 0; status.code == VD_OK && y < height; y++) {
        for (int x = 0; x < width; x++) { /* every pixel is written, lossy ones premultiplied */
            const uint8_t *p = rgba + 4 * (stride * (size_t)y + (size_t)x);
            if (!vd_codec_is_lossless(codec) && (p[0] > p[3] || p[1] > p[3] || p[2] > p[3])) {
                abort();
            }
        }
    }
    free(rgba);
}

static void round_trip(vd_coder *coder, vd_codec codec, int width, int height, const uint8_t *data,
                       size_t bytes) {
    const size_t pixels = (size_t)width * (size_t)height;
    const size_t bound = vd_codec_bound(codec, width, height);
    uint8_t *rgba = calloc(pixels, 4), *back = malloc(4 * pixels), *out = malloc(bound);
    if (rgba != NULL && back != NULL && out != NULL) {
        memcpy(rgba, data, bytes < 4 * pixels ? bytes : 4 * pixels);
        const vd_encode_def def = {.codec = codec};
        const vd_codec_picture picture = {rgba, width, height, (size_t)width};
        vd_encoded encoded;
        if (vd_coder_encode(coder, &def, &picture, out, bound, &encoded).code != VD_OK ||
            vd_coder_decode(coder, codec, out, encoded.bytes, width, height, back, (size_t)width)
                    .code != VD_OK ||
            (vd_codec_is_lossless(codec) && memcmp(rgba, back, 4 * pixels) != 0)) {
            abort();
        }
    }
    free(rgba);
    free(back);
    free(out);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    /* Kept from input to input, as a client does: what one leaves must not harm the next. */
    static vd_context *context;
    static vd_coder *coder;
    vd_context_def def = vd_context_def_default();
    def.threads = 1;
    if (coder == NULL && (vd_context_create(&def, &context).code != VD_OK ||
                          vd_coder_create(context, &coder).code != VD_OK)) {
        abort();
    }
    if (size < 3) {
        return 0;
    }
    const vd_codec codec = (vd_codec)(1 + (data[0] & 127) % (VD_CODEC_COUNT - 1));
    const int width = 1 + data[1], height = 1 + data[2];
    unpack(coder, codec, width, height, data + 3, size - 3);
    if (data[0] >= 128) {
        round_trip(coder, codec, width, height, data + 3, size - 3);
    }
    return 0;
}

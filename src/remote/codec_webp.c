/* codec_webp.c: WebP, lossy with its own alpha, and lossless for the colours of an opaque picture;
 * through libwebp, whose memory comes from malloc.
 */
#include "remote/coder.h"

#include <string.h>
#include <webp/decode.h>
#include <webp/encode.h>

/* ---- packing ----------------------------------------------------------------------------------*/

static int write_bytes(const uint8_t *data, size_t bytes, const WebPPicture *webp) {
    return vd_sink_write(webp->custom_ptr, data, bytes) ? 1 : 0;
}

/* Straight colours into coder->rows, which become straight at half a step's precision. */
static vd_status make_straight(vd_coder *coder, const vd_codec_picture *picture) {
    const size_t width = (size_t)picture->width, height = (size_t)picture->height;
    const vd_status status = vd_scratch_reserve(coder, &coder->rows, 4 * width * height);
    if (status.code != VD_OK) {
        return status;
    }
    uint8_t *out = coder->rows.memory;
    for (size_t y = 0; y < height; y++) {
        const uint8_t *in = picture->rgba + 4 * picture->stride * y;
        for (size_t x = 0; x < width; x++, in += 4, out += 4) {
            const uint32_t alpha = in[3];
            if (alpha == 255 || alpha == 0) {
                memcpy(out, in, 4);
                continue;
            }
            for (int c = 0; c < 3; c++) {
                const uint32_t value = (in[c] * 255u + alpha / 2) / alpha;
                out[c] = (uint8_t)(value < 255 ? value : 255);
            }
            out[3] = (uint8_t)alpha;
        }
    }
    return status;
}

static bool configure(WebPConfig *config, vd_codec codec, const vd_encode_def *def) {
    if (!WebPConfigInit(config)) {
        return false;
    }
    if (codec == VD_CODEC_WEBP_LOSSLESS) {
        const bool good = WebPConfigLosslessPreset(config, def->effort - 1);
        config->exact = 1;
        return good;
    }
    config->quality = (float)def->quality;
    config->method = (def->effort - 1) * 6 / 8;
    config->alpha_quality = 100;
    return WebPValidateConfig(config);
}

vd_status vd_webp_pack(vd_coder *coder, vd_codec codec, const vd_encode_def *def,
                       const vd_codec_picture *picture, vd_sink *sink) {
    const bool lossy = codec == VD_CODEC_WEBP;
    vd_status status = lossy ? make_straight(coder, picture) : vd_success();
    WebPConfig config;
    WebPPicture webp;
    if (status.code != VD_OK) {
        return status;
    }
    if (!configure(&config, codec, def) || !WebPPictureInit(&webp)) {
        return vd_failure(VD_ERROR_UNSUPPORTED,
                          "cannot pack a webp picture: libwebp is not the version that Veduta was "
                          "built with; install that one");
    }
    webp.use_argb = !lossy;
    webp.width = picture->width;
    webp.height = picture->height;
    webp.writer = write_bytes;
    webp.custom_ptr = sink;
    const int good = lossy
                         ? WebPPictureImportRGBA(&webp, coder->rows.memory, 4 * picture->width)
                         : WebPPictureImportRGBX(&webp, picture->rgba, (int)(4 * picture->stride));
    const bool done = good && WebPEncode(&config, &webp);
    const bool too_large = webp.error_code == VP8_ENC_ERROR_PARTITION0_OVERFLOW ||
                           webp.error_code == VP8_ENC_ERROR_PARTITION_OVERFLOW;
    WebPPictureFree(&webp);
    if (done) {
        return vd_success();
    }
    return sink->full || too_large ? vd_no_room(codec, sink)
                                   : vd_codec_memory(codec, picture->width, picture->height);
}

/* ---- unpacking --------------------------------------------------------------------------------*/

static void premultiply(const vd_source *source) {
    for (int y = 0; y < source->height; y++) {
        uint8_t *p = source->rgba + 4 * source->stride * (size_t)y;
        for (int x = 0; x < source->width; x++, p += 4) {
            for (int c = 0; c < 3; c++) {
                p[c] = (uint8_t)((p[c] * p[3] + 127u) / 255u);
            }
        }
    }
}

/* Whether the container is as long as it says and no longer. */
static bool fills(const vd_source *source) {
    const uint8_t *d = source->data;
    return source->bytes >= 12 && memcmp(d, "RIFF", 4) == 0 &&
           (d[4] | (uint64_t)d[5] << 8 | (uint64_t)d[6] << 16 | (uint64_t)d[7] << 24) + 8 ==
               source->bytes;
}

vd_status vd_webp_unpack(vd_codec codec, const vd_source *source) {
    const bool lossy = codec == VD_CODEC_WEBP;
    WebPDecoderConfig config;
    if (!WebPInitDecoderConfig(&config)) {
        return vd_failure(VD_ERROR_UNSUPPORTED,
                          "cannot unpack a webp picture: libwebp is not the version that Veduta "
                          "was built with; install that one");
    }
    if (!fills(source)) {
        return vd_damaged(codec, source, "it is truncated, or bytes are left over");
    }
    if (WebPGetFeatures(source->data, source->bytes, &config.input) != VP8_STATUS_OK) {
        return vd_damaged(codec, source, "it is not WebP");
    }
    if (config.input.width != source->width || config.input.height != source->height) {
        return vd_damaged(codec, source, "the WebP in it has another size");
    }
    if (config.input.has_animation || config.input.format != (lossy ? 1 : 2) ||
        (!lossy && config.input.has_alpha)) {
        return vd_damaged(codec, source, "the WebP in it is of another kind");
    }
    config.output.colorspace = MODE_RGBA;
    config.output.is_external_memory = 1;
    config.output.u.RGBA.rgba = source->rgba;
    config.output.u.RGBA.stride = (int)(4 * source->stride);
    config.output.u.RGBA.size =
        4 * (source->stride * (size_t)(source->height - 1) + (size_t)source->width);
    const VP8StatusCode code = WebPDecode(source->data, source->bytes, &config);
    WebPFreeDecBuffer(&config.output);
    if (code == VP8_STATUS_OUT_OF_MEMORY) {
        return vd_codec_memory(codec, source->width, source->height);
    }
    if (code != VP8_STATUS_OK) {
        return vd_damaged(codec, source, "the WebP in it does not decode");
    }
    if (lossy) {
        premultiply(source);
    }
    return vd_success();
}

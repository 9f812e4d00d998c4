/* codec_costs.c: which codec to take for a link. */
#include <veduta/codec.h>

#include <math.h>
#include <stddef.h>

#define LINK_BYTES_PER_S 10e6
#define LEARN 0.125
#define LATENCY_SHARE 0.1

vd_codec_costs vd_codec_costs_default(void) {
    return (vd_codec_costs){.codecs = {
                                [VD_CODEC_RAW] = {0, 4, 30, 0.15, 10, 0.15},
                                [VD_CODEC_RUNS] = {16, 1.0, 40, 0.25, 30, 0.12},
                                [VD_CODEC_RUNS_ZSTD] = {30, 0.7, 800, 2.6, 90, 1},
                                [VD_CODEC_PNG] = {140, 0.75, 5000, 16, 700, 8.5},
                                [VD_CODEC_JPEG] = {660, 0.35, 4000, 3, 2800, 4},
                                [VD_CODEC_WEBP] = {110, 0.3, 106000, 42, 5000, 10},
                                [VD_CODEC_WEBP_LOSSLESS] = {110, 0.75, 51000, 25, 13000, 8},
                            }};
}

/* Moves *value towards (total - fixed) / pixels, which is at least 0. */
static void learn(double *value, double total, double fixed, double pixels) {
    if (total >= 0 && total < INFINITY) {
        const double found = (total - fixed) / pixels;
        *value += LEARN * ((found > 0 ? found : 0) - *value);
    }
}

void vd_codec_costs_learn(vd_codec_costs *costs, vd_codec codec, size_t pixels, size_t bytes,
                          double encode_ns, double decode_ns) {
    if (codec <= VD_CODEC_AUTO || codec >= VD_CODEC_COUNT || pixels == 0) {
        return;
    }
    vd_codec_cost *c = &costs->codecs[codec];
    learn(&c->bytes_per_pixel, (double)bytes, c->bytes_fixed, (double)pixels);
    learn(&c->encode_ns_per_pixel, encode_ns, c->encode_ns_fixed, (double)pixels);
    learn(&c->decode_ns_per_pixel, decode_ns, c->decode_ns_fixed, (double)pixels);
}

vd_codec vd_codec_choose(const vd_codec_costs *costs, unsigned allowed, bool lossless,
                         double link_bytes_per_s, int width, int height) {
    const vd_codec_costs standard = vd_codec_costs_default();
    costs = costs != NULL ? costs : &standard;
    const double link = link_bytes_per_s > 0 ? link_bytes_per_s : LINK_BYTES_PER_S;
    const double pixels = (double)width * height;
    vd_codec best = VD_CODEC_RAW;
    double least = INFINITY;
    for (int codec = VD_CODEC_RAW; codec < VD_CODEC_COUNT; codec++) {
        if (!(allowed & VD_CODEC_BIT(codec)) ||
            (lossless && !vd_codec_is_lossless((vd_codec)codec))) {
            continue;
        }
        const vd_codec_cost *c = &costs->codecs[codec];
        const double encode = c->encode_ns_fixed + pixels * c->encode_ns_per_pixel;
        const double decode = c->decode_ns_fixed + pixels * c->decode_ns_per_pixel;
        const double send = (c->bytes_fixed + pixels * c->bytes_per_pixel) / link * 1e9;
        const double slowest = fmax(fmax(encode, decode), send);
        const double time = slowest + LATENCY_SHARE * (encode + decode + send);
        if (time < least) {
            least = time;
            best = (vd_codec)codec;
        }
    }
    return best;
}

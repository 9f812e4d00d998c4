#include <veduta/color.h>
#include "image/image_kernels.h"

static void resolve_color(uint8_t *restrict out, const uint16_t *restrict in, size_t plane,
                          int samples, size_t count) {
    for (size_t i = 0; i < count; i++) {
        uint32_t sum = (uint32_t)samples / 2;
        for (int s = 0; s < samples; s++) {
            sum += in[(size_t)s * plane + i];
        }
        out[i] = vd_round_16_to_8(sum / (uint32_t)samples);
    }
}

static void resolve_nearest(float *restrict out_depth, uint32_t *restrict out_id,
                            const float *restrict depth, const uint32_t *restrict id, size_t plane,
                            int samples, size_t count) {
    for (size_t i = 0; i < count; i++) {
        size_t best = i;
        for (int s = 1; s < samples; s++) {
            const size_t other = (size_t)s * plane + i;
            if (depth[other] > depth[best]) {
                best = other;
            }
        }
        if (out_depth != NULL) {
            out_depth[i] = depth[best];
        }
        if (out_id != NULL) {
            out_id[i] = id[best];
        }
    }
}

const vd_image_kernels vd_image_kernels_reference = {resolve_color, resolve_nearest};

const vd_image_kernels *vd_image_kernels_for(vd_isa isa) {
#if defined(__x86_64__)
    if (isa == VD_ISA_V4) {
        return &vd_image_kernels_v4;
    }
    if (isa == VD_ISA_V3) {
        return &vd_image_kernels_v3;
    }
#endif
    (void)isa;
    return &vd_image_kernels_v2;
}

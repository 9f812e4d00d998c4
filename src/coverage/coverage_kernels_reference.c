#include "coverage/coverage_kernels.h"

static uint32_t multiply(uint32_t a, uint32_t b) {
    const uint32_t v = a * b + 32768u;
    return (v + (v >> 16)) >> 16;
}

static void sum_areas(uint16_t *restrict out, int32_t *restrict areas, int32_t base, size_t count) {
    int32_t sum = base;
    for (size_t i = 0; i < count; i++) {
        sum += areas[i];
        areas[i] = 0;
        const int32_t low = sum < 0 ? 0 : sum;
        const int32_t cut = low < 1 << 24 ? low : 1 << 24;
        out[i] = (uint16_t)((cut - (cut >> 16) + 128) >> 8);
    }
}

static void blend(uint16_t *out, uint32_t coverage, const uint16_t color[4]) {
    const uint32_t remains = 65535u - multiply(color[3], coverage);
    for (int c = 0; c < 4; c++) {
        const uint32_t sum = multiply(color[c], coverage) + multiply(out[c], remains);
        out[c] = (uint16_t)(sum < 65535u ? sum : 65535u);
    }
}

static void blend_color(uint16_t *restrict out, const uint16_t *restrict coverage,
                        const uint16_t color[4], size_t count) {
    for (size_t i = 0; i < count; i++) {
        blend(out + 4 * i, coverage == NULL ? 65535u : coverage[i], color);
    }
}

static void blend_colors(uint16_t *restrict out, const uint16_t *restrict coverage,
                         const uint16_t *restrict colors, size_t count) {
    for (size_t i = 0; i < count; i++) {
        blend(out + 4 * i, coverage == NULL ? 65535u : coverage[i], colors + 4 * i);
    }
}

const vd_coverage_kernels vd_coverage_kernels_reference = {sum_areas, blend_color, blend_colors};

const vd_coverage_kernels *vd_coverage_kernels_for(vd_isa isa) {
#if defined(__x86_64__)
    if (isa == VD_ISA_V4) {
        return &vd_coverage_kernels_v4;
    }
    if (isa == VD_ISA_V3) {
        return &vd_coverage_kernels_v3;
    }
#endif
    (void)isa;
    return &vd_coverage_kernels_v2;
}

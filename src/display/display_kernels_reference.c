#include "display/display_kernels.h"

static int32_t clamp(int32_t v, int32_t low, int32_t high) {
    return v < low ? low : v > high ? high : v;
}

/* The position on an axis, clamped to the centres of the outermost texels. */
static int32_t position(float way, int32_t whole, int32_t side) {
    int32_t floor = (int32_t)way;
    floor -= (float)floor > way ? 1 : 0;
    return clamp(whole + floor, 0, (side - 1) * 256);
}

static uint32_t mix(uint32_t a, uint32_t b, uint32_t share) {
    return (a * (256 - share) + b * share + 128) >> 8;
}

/* round(v / 255) for v <= 65152. */
static uint32_t divide_255(uint32_t v) {
    return ((v + 128) * 257) >> 16;
}

static void blend(uint8_t *row, const vd_display_line *line, int begin, int end) {
    for (int x = begin; x < end; x++) {
        const float n = (float)(x - line->base);
        if (line->depth != NULL && line->depth[x] > line->depth_at + n * line->depth_step) {
            continue;
        }
        const float bent = n / (1.0f + n * line->bend);
        const int32_t u = position(bent * line->step_u + line->part_u, line->whole_u, line->width);
        const int32_t v = position(bent * line->step_v + line->part_v, line->whole_v, line->height);
        /* The last texel's centre is all of the right one of the last pair. */
        const int32_t column = clamp(u >> 8, 0, line->width - 2);
        const int32_t line_at = clamp(v >> 8, 0, line->height - 2);
        const uint32_t fx = (uint32_t)(u - 256 * column), fy = (uint32_t)(v - 256 * line_at);
        const uint8_t *top =
            line->texels + 4 * ((size_t)line_at * (size_t)line->stride + (size_t)column);
        const uint8_t *bottom = top + 4 * (size_t)line->stride;
        uint32_t texel[4];
        for (int c = 0; c < 4; c++) {
            texel[c] = mix(mix(top[c], bottom[c], fy), mix(top[c + 4], bottom[c + 4], fy), fx);
        }
        const uint32_t alpha = texel[3], kept = 255 - divide_255(alpha * line->opacity);
        for (int c = 0; c < 4; c++) {
            const uint32_t color = texel[c] < alpha ? texel[c] : alpha;
            const uint32_t over = divide_255(color * line->opacity + row[4 * x + c] * kept);
            row[4 * x + c] = (uint8_t)(line->opaque ? texel[c] : over);
        }
    }
}

const vd_display_kernels vd_display_kernels_reference = {blend};

const vd_display_kernels *vd_display_kernels_for(vd_isa isa) {
#if defined(__x86_64__)
    if (isa == VD_ISA_V4) {
        return &vd_display_kernels_v4;
    }
    if (isa == VD_ISA_V3) {
        return &vd_display_kernels_v3;
    }
#endif
    (void)isa;
    return &vd_display_kernels_v2;
}

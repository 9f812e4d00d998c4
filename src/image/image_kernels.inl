/* image_kernels.inl: the kernels' bodies over wide.h. A file per SIMD level defines TABLE and
 * includes this; the table is the file's only external name. */
#include "core/wide.h"
#include "image/image_kernels.h"

static void resolve_color(uint8_t *restrict out, const uint16_t *restrict in, size_t plane,
                          int samples, size_t count) {
    const uint32_t half = (uint32_t)samples / 2;
    const uint32_t shift = samples == 8 ? 3 : samples == 4 ? 2 : 0;
    size_t i = 0;
    for (; i + VD_WIDE_LANES <= count; i += VD_WIDE_LANES) {
        vd_wide_u32 sum = vd_wide_load_u16(in + i) + half;
        for (int s = 1; s < samples; s++) {
            sum += vd_wide_load_u16(in + (size_t)s * plane + i);
        }
        vd_wide_store_u8(out + i, ((sum >> shift) * 255u + 32895u) >> 16);
    }
    if (i < count) {
        vd_image_kernels_reference.resolve_color(out + i, in + i, plane, samples, count - i);
    }
}

static void resolve_nearest(float *restrict out_depth, uint32_t *restrict out_id,
                            const float *restrict depth, const uint32_t *restrict id, size_t plane,
                            int samples, size_t count) {
    size_t i = 0;
    for (; i + VD_WIDE_LANES <= count; i += VD_WIDE_LANES) {
        vd_wide_f32 best = vd_wide_load_f32(depth + i);
        vd_wide_u32 best_id = vd_wide_load_u32(id + i);
        for (int s = 1; s < samples; s++) {
            const size_t other = (size_t)s * plane + i;
            const vd_wide_f32 d = vd_wide_load_f32(depth + other);
            const vd_wide_i32 nearer = d > best;
            best_id = vd_wide_select_u32(nearer, vd_wide_load_u32(id + other), best_id);
            best = vd_wide_select_f32(nearer, d, best);
        }
        if (out_depth != NULL) {
            vd_wide_store_f32(out_depth + i, best);
        }
        if (out_id != NULL) {
            vd_wide_store_u32(out_id + i, best_id);
        }
    }
    if (i < count) {
        vd_image_kernels_reference.resolve_nearest(out_depth == NULL ? NULL : out_depth + i,
                                                   out_id == NULL ? NULL : out_id + i, depth + i,
                                                   id + i, plane, samples, count - i);
    }
}

const vd_image_kernels TABLE = {resolve_color, resolve_nearest};

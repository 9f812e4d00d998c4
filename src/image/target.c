#include <string.h>
#include <veduta/target.h>
#include "core/core.h"
#include "image/image.h"
#include "image/image_kernels.h"

vd_status vd_target_create(vd_context *context, int width, int height, int samples,
                           vd_target **out) {
    vd_status status = vd_check_size("a target", width, height);
    if (status.code != VD_OK) {
        return status;
    }
    if (vd_sample_offsets(samples) == NULL) {
        return vd_failure(VD_ERROR_ARGUMENT, "a target cannot have %d samples; give 1, 4 or 8",
                          samples);
    }
    vd_target *target = vd_allocate_zero(context, 1, sizeof *target);
    if (target == NULL) {
        return vd_out_of_memory("a target", sizeof *target);
    }
    target->context = context;
    target->width = width;
    target->height = height;
    target->samples = samples;
    target->stride = vd_frame_stride(width);
    target->plane = target->stride * (size_t)height;
    const size_t values = target->plane * (size_t)samples;
    target->color = vd_allocate(context, values, 4 * sizeof *target->color);
    target->depth = vd_allocate(context, values, sizeof *target->depth);
    target->id = vd_allocate(context, values, sizeof *target->id);
    if (target->color == NULL || target->depth == NULL || target->id == NULL) {
        vd_target_destroy(&target);
        return vd_out_of_memory("a target", values * 16);
    }
    *out = target;
    return vd_success();
}

void vd_target_destroy(vd_target **target_in_out) {
    if (target_in_out == NULL || *target_in_out == NULL) {
        return;
    }
    vd_target *target = *target_in_out;
    *target_in_out = NULL;
    vd_release(target->context, target->color);
    vd_release(target->context, target->depth);
    vd_release(target->context, target->id);
    vd_release(target->context, target->blended);
    vd_release(target->context, target);
}

void vd_target_clear(vd_target *target, const uint16_t color[4]) {
    uint64_t packed;
    memcpy(&packed, color, sizeof packed);
    for (int s = 0; s < target->samples; s++) {
        for (int y = 0; y < target->height; y++) {
            const size_t row = (size_t)s * target->plane + (size_t)y * target->stride;
            for (int x = 0; x < target->width; x++) {
                memcpy(target->color + 4 * (row + (size_t)x), &packed, sizeof packed);
            }
            memset(target->depth + row, 0, (size_t)target->width * sizeof *target->depth);
            memset(target->id + row, 0, (size_t)target->width * sizeof *target->id);
        }
    }
}

const float (*vd_sample_offsets(int samples))[2] {
    /* Sixteenths of a pixel from its centre. */
#define AT(x, y)                                                                                   \
    { 0.5f + (x) / 16.0f, 0.5f + (y) / 16.0f }
    static const float one[1][2] = {AT(0, 0)};
    static const float four[4][2] = {AT(-2, -6), AT(6, -2), AT(-6, 2), AT(2, 6)};
    static const float eight[8][2] = {AT(1, -3), AT(-1, 3),  AT(5, 1), AT(-3, -5),
                                      AT(-5, 5), AT(-7, -1), AT(3, 7), AT(7, -7)};
#undef AT
    return samples == 1 ? one : samples == 4 ? four : samples == 8 ? eight : NULL;
}

void vd_target_resolve(const vd_target *target, vd_frame *frame) {
    const vd_image_kernels *kernels = vd_image_kernels_for(vd_context_isa(target->context));
    const size_t width = (size_t)target->width;
    for (int y = 0; y < target->height; y++) {
        const size_t from = (size_t)y * target->stride;
        const size_t to = (size_t)(target->y + y) * frame->stride + (size_t)target->x;
        kernels->resolve_color(frame->rgba + 4 * to, target->color + 4 * from, 4 * target->plane,
                               target->samples, 4 * width);
        if (frame->depth != NULL || frame->id != NULL) {
            kernels->resolve_nearest(frame->depth == NULL ? NULL : frame->depth + to,
                                     frame->id == NULL ? NULL : frame->id + to,
                                     target->depth + from, target->id + from, target->plane,
                                     target->samples, width);
        }
    }
}

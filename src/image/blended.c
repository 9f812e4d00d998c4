/* blended.c: a target's list of blended things.
 *
 * Blending is exact only in order, and things arrive in any order. A list of all of them, sorted at
 * the end, has no bound: smoke before a forest has hundreds a sample. So each sample keeps the
 * VD_BLENDED_LAYERS farthest that are nearer than what has been blended already, in order, and says
 * when there were more; then everything is added again. That is depth peeling (Everitt 2001) with
 * the layers of a k-buffer (Bavoil et al. 2007) at a time: memory is fixed, the result exact
 * whatever the number of layers, and the usual picture takes one pass. It also makes a pass of the
 * same things idempotent, so that nobody has to remember what was added.
 */
#include <string.h>
#include "core/core.h"
#include "image/blended.h"

vd_status vd_target_reserve_blended(vd_target *target) {
    if (target->blended != NULL) {
        return vd_success();
    }
    const size_t values = target->plane * (size_t)target->samples;
    target->blended = vd_allocate(target->context, values, sizeof *target->blended);
    return target->blended != NULL ? vd_success()
                                   : vd_out_of_memory("a target's list of blended things",
                                                      values * sizeof *target->blended);
}

void vd_target_begin_blended(vd_target *target) {
    for (int s = 0; s < target->samples; s++) {
        for (int y = 0; y < target->height; y++) {
            const size_t row = (size_t)s * target->plane + (size_t)y * target->stride;
            for (int x = 0; x < target->width; x++) {
                vd_blended *sample = &target->blended[row + (size_t)x];
                sample->last_order = 0;
                sample->last_depth = -1.0f;
                sample->count = 0;
                sample->more = false;
            }
        }
    }
}

/* Whether a thing is farther than another: less deep in reversed depth, of equals later. */
static inline bool is_farther(float depth, uint64_t order, float than_depth, uint64_t than_order) {
    return depth < than_depth || (depth == than_depth && order > than_order);
}

static void put(vd_blended *sample, int at, float depth, uint64_t order, const uint16_t *color) {
    sample->depth[at] = depth;
    sample->order[at] = order;
    memcpy(sample->color[at], color, sizeof sample->color[at]);
}

void vd_target_add_blended(vd_target *target, size_t index, float depth, uint64_t order,
                           const uint16_t color[4]) {
    vd_blended *sample = &target->blended[index];
    if (!(depth >= target->depth[index]) ||
        !is_farther(sample->last_depth, sample->last_order, depth, order)) {
        return;
    }
    int at = sample->count; /* behind the last that is farther */
    while (at > 0 && !is_farther(sample->depth[at - 1], sample->order[at - 1], depth, order)) {
        at--;
        if (depth == sample->depth[at] && order == sample->order[at]) {
            return;
        }
    }
    if (sample->count == VD_BLENDED_LAYERS) {
        sample->more = true;
        if (at == VD_BLENDED_LAYERS) {
            return;
        }
        sample->count--;
    }
    for (int i = sample->count; i > at; i--) {
        put(sample, i, sample->depth[i - 1], sample->order[i - 1], sample->color[i - 1]);
    }
    put(sample, at, depth, order, color);
    sample->count++;
}

/* `color` over what is there; both premultiplied, so that no channel exceeds 65535. */
static void blend_over(uint16_t *there, const uint16_t color[4]) {
    const uint32_t left = 65535u - color[3];
    for (int c = 0; c < 4; c++) {
        there[c] = (uint16_t)(color[c] + (there[c] * left + 32767u) / 65535u);
    }
}

bool vd_target_blend(vd_target *target) {
    bool more = false;
    for (int s = 0; s < target->samples; s++) {
        for (int y = 0; y < target->height; y++) {
            const size_t row = (size_t)s * target->plane + (size_t)y * target->stride;
            for (int x = 0; x < target->width; x++) {
                vd_blended *sample = &target->blended[row + (size_t)x];
                const int count = sample->count;
                for (int i = 0; i < count; i++) {
                    blend_over(target->color + 4 * (row + (size_t)x), sample->color[i]);
                }
                if (count > 0) {
                    sample->last_depth = sample->depth[count - 1];
                    sample->last_order = sample->order[count - 1];
                }
                more = more || sample->more;
                sample->count = 0;
                sample->more = false;
            }
        }
    }
    return more;
}

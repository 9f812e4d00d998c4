/* shadow_reference.c: the thesis' listing 6.4, with the offsets rounded once a step. */
#include <math.h>
#include "terrain/shadow_internal.h"

static int wrapped(int64_t i, int n) {
    const int64_t rest = i % n;
    return (int)(rest < 0 ? rest + n : rest);
}

/* True when the ray is under the ground at (column, row). Heights of 16 bits and a float t add up
 * without rounding in double wherever the result is near a whole number. */
static bool is_under(const vd_heightfield *map, const vd_shadow_plan *plan, float height, float t,
                     int64_t column, int64_t row) {
    if (plan->wraps) {
        column = wrapped(column, map->width);
        row = wrapped(row, map->height);
    } else if (column < 0 || row < 0 || column >= map->width || row >= map->height) {
        return false;
    }
    const float there = vd_heightfield_at(map, (int)column, (int)row);
    if (map->height_type == VD_HEIGHT_F32) {
        const float ray = height + t;
        return ray < there;
    }
    return (double)height + (double)t < (double)there;
}

vd_status vd_shadow_count_reference(vd_job *job, const vd_heightfield *map,
                                    const vd_shadow_plan *plan, uint8_t *counts, size_t stride) {
    for (int row = 0; row < map->height; row++) {
        if (vd_job_stopped(job)) {
            return vd_failure(VD_ERROR_CANCELLED, "the job was cancelled or ran out of time");
        }
        for (int column = 0; column < map->width; column++) {
            const float height = vd_heightfield_at(map, column, row);
            int count = 0;
            for (int k = 0; height > -INFINITY && k < plan->all_steps; k++) {
                count += is_under(map, plan, height, plan->t[k], (int64_t)column + plan->dx[k],
                                  (int64_t)row + plan->dy[k]);
            }
            counts[(size_t)row * stride + (size_t)column] = (uint8_t)count;
        }
    }
    return vd_success();
}

/* shadow.c: the sun's offsets, and what the counts do to colours. */
#include <math.h>
#include <string.h>
#include <veduta/light.h>
#include "core/core.h"
#include "core/real.h"
#include "terrain/heightfield_block.h"
#include "terrain/shadow_internal.h"

/* A slab of a large map; smaller maps are one slab. Less for float maps, which the lens methods
 * draw beside much else: with 64 MiB, a cold 2048² map took 6 ms more to touch the slab first. */
#define SLAB_BYTES ((size_t)64 << 20)
#define SLAB_BYTES_F32 ((size_t)4 << 20)

vd_shadow_def vd_shadow_def_default(void) {
    vd_shadow_def def;
    memset(&def, 0, sizeof def);
    def.azimuth_rad = vd_radians(315.0);
    def.altitude_rad = vd_radians(45.0);
    def.cell = 1.0;
    def.stride = 4.0;
    def.steps = VD_SHADOW_STEPS;
    return def;
}

static vd_status check_def(const vd_heightfield *map, const vd_shadow_def *def, size_t stride) {
    if (!isfinite(def->azimuth_rad)) {
        return vd_failure(VD_ERROR_ARGUMENT, "the sun's azimuth_rad must be finite");
    }
    if (!(def->altitude_rad >= 0.0) || !(def->altitude_rad <= 0.5 * VD_PI)) {
        return vd_failure(
            VD_ERROR_ARGUMENT,
            "the sun's altitude_rad is %g, but must be 0 to π/2: below the horizon it "
            "throws no shadows",
            def->altitude_rad);
    }
    if (!(def->cell > 0.0) || !isfinite(def->cell)) {
        return vd_failure(VD_ERROR_ARGUMENT, "cell is %g, but must be above 0 and finite",
                          def->cell);
    }
    if (!(def->stride > 0.0) || !(def->stride <= 64.0)) {
        return vd_failure(VD_ERROR_ARGUMENT, "stride is %g, but must be above 0 and at most 64",
                          def->stride);
    }
    if (def->steps < 1 || def->steps > VD_SHADOW_STEPS) {
        return vd_failure(VD_ERROR_ARGUMENT, "steps are %d, but must be 1 to %d", def->steps,
                          VD_SHADOW_STEPS);
    }
    if ((unsigned)def->edge >= VD_SHADOW_EDGE_COUNT ||
        (unsigned)def->method >= VD_SHADOW_METHOD_COUNT) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "edge and method must be of vd_shadow_edge and vd_shadow_method");
    }
    if (stride < (size_t)map->width) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "the counts' stride of %zu is less than the map's width of %d", stride,
                          map->width);
    }
    return vd_success();
}

/* Columns, rows and height units of one step. */
typedef struct step {
    double columns, rows, rise;
} step;

static bool is_general(const vd_shadow_def *def) {
    return def->step_columns != 0.0 || def->step_rows != 0.0 || def->step_rise != 0.0;
}

static vd_status check_step(const vd_shadow_def *def) {
    if (!(fabs(def->step_columns) <= 64.0) || !(fabs(def->step_rows) <= 64.0)) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "step_columns and step_rows are %g and %g, but must be at most 64",
                          def->step_columns, def->step_rows);
    }
    if (!(def->step_rise >= 0.0)) {
        return vd_failure(VD_ERROR_ARGUMENT, "step_rise is %g, but must be at least 0",
                          def->step_rise);
    }
    return vd_success();
}

void vd_shadow_def_aim(vd_shadow_def *def, const vd_heightfield *heightfield, vd_vec3 sun,
                       double exaggeration) {
    double m[6];
    const double level = sqrt(sun.x * sun.x + sun.y * sun.y);
    def->step_columns = def->step_rows = 0.0;
    def->step_rise = INFINITY; /* no shadow */
    if (!(sun.z > 0.0) || !vd_heightfield_invert(heightfield->world_from_sample, m)) {
        return;
    }
    /* Samples per metre towards the sun. */
    const double columns = (m[1] * sun.x + m[2] * sun.y) / level;
    const double rows = (m[4] * sun.x + m[5] * sun.y) / level;
    const double longer = fmax(fabs(columns), fabs(rows));
    const double metres = def->stride / longer, rise = metres * (sun.z / level) / exaggeration;
    if (isfinite(metres) && rise >= 0.0) { /* not straight up */
        def->step_columns = columns * metres;
        def->step_rows = rows * metres;
        def->step_rise = rise;
    }
}

vd_status vd_shadow_make_plan(const vd_heightfield *map, const vd_shadow_def *def,
                              size_t counts_stride, vd_shadow_plan *plan) {
    vd_status status = check_def(map, def, counts_stride);
    if (status.code == VD_OK) {
        status = check_step(def);
    }
    if (status.code != VD_OK) {
        return status;
    }
    const vd_vec3 sun = vd_sun_direction(def->azimuth_rad, def->altitude_rad);
    const bool general = is_general(def);
    plan->wraps =
        def->edge == VD_SHADOW_EDGE_WRAP || (def->edge == VD_SHADOW_EDGE_MAP && map->wraps != 0);
    plan->slab_bytes = map->height_type == VD_HEIGHT_F32 ? SLAB_BYTES_F32 : SLAB_BYTES;
    plan->scratch = NULL;
    plan->scratch_bytes = 0;
    plan->all_steps = def->steps;
    plan->steps = 0;
    bool above = false;
    for (int k = 1; k <= def->steps; k++) {
        const double along = k * def->stride;
        const step s = general
                           ? (step){k * def->step_columns, k * def->step_rows, k * def->step_rise}
                           : (step){along * sun.x, -along * sun.y, along * def->cell * sun.z};
        const float t = s.rise > 0.0 ? (float)fmin(s.rise, 3e38) : 0.0f;
        plan->dx[k - 1] = (int32_t)floor(s.columns + 0.5);
        plan->dy[k - 1] = (int32_t)floor(s.rows + 0.5);
        plan->t[k - 1] = t;
        /* Once above the highest ground, always; the sum of a float map is the reference's. */
        above = above || (map->height_type == VD_HEIGHT_F32
                              ? map->min + t >= map->max
                              : (double)map->min + (double)t >= (double)map->max);
        plan->steps = above ? plan->steps : k;
    }
    return status;
}

vd_status vd_shadow_count(vd_context *context, vd_job *job, const vd_heightfield *heightfield,
                          const vd_shadow_def *def, uint8_t *counts, size_t stride) {
    if (context == NULL || heightfield == NULL || def == NULL || counts == NULL) {
        return vd_failure(VD_ERROR_ARGUMENT, "vd_shadow_count: no argument but job may be null");
    }
    return vd_shadow_count_with(context, job, heightfield, def, counts, stride, NULL, 0);
}

vd_status vd_shadow_count_with(vd_context *context, vd_job *job, const vd_heightfield *heightfield,
                               const vd_shadow_def *def, uint8_t *counts, size_t stride,
                               void *scratch, size_t scratch_bytes) {
    vd_shadow_plan plan;
    const vd_status status = vd_shadow_make_plan(heightfield, def, stride, &plan);
    if (status.code != VD_OK) {
        return status;
    }
    plan.scratch = scratch;
    plan.scratch_bytes = scratch_bytes;
    return def->method == VD_SHADOW_REFERENCE
               ? vd_shadow_count_reference(job, heightfield, &plan, counts, stride)
               : vd_shadow_count_shift(context, job, heightfield, &plan, counts, stride);
}

/* ---- colours ----------------------------------------------------------------------------------
 */

float vd_shadow_share(vd_shadow_curve curve, uint8_t count) {
    return curve == VD_SHADOW_PUBLISHED
               ? sqrtf(1.0f / (1.0f + (float)count))
               : (float)(0.35 + 0.65 * vd_exp((double)count * (-1.0 / 12.0)));
}

/* What becomes of every component at every count: 64 KiB, 65,536 roots. The root of a whole number
 * of 16 bits is exact enough that its floor is. */
typedef struct curve_table {
    uint8_t value[256][256]; /* [count][component] */
} curve_table;

static void make_table(vd_shadow_curve curve, curve_table *table) {
    for (int count = 0; count < 256; count++) {
        const float share = vd_shadow_share(curve, (uint8_t)count);
        for (int c = 0; c < 256; c++) {
            table->value[count][c] = curve == VD_SHADOW_PUBLISHED
                                         ? (uint8_t)sqrtf((float)(c * c / (1 + count)))
                                         : (uint8_t)((float)c * share + 0.5f);
        }
    }
}

static vd_rgba8 darkened(const curve_table *table, uint8_t count, vd_rgba8 color) {
    const uint8_t *value = table->value[count];
    const vd_rgba8 out = {value[color.r], value[color.g], value[color.b], color.a};
    return out;
}

vd_status vd_shadow_bake(vd_context *context, const uint8_t *counts, size_t counts_stride,
                         vd_shadow_curve curve, int width, int height, const vd_rgba8 *colors,
                         size_t colors_stride, vd_rgba8 *out, size_t out_stride) {
    if (context == NULL || counts == NULL || colors == NULL || out == NULL) {
        return vd_failure(VD_ERROR_ARGUMENT, "vd_shadow_bake: no argument may be null");
    }
    if (width < 1 || height < 1 || counts_stride < (size_t)width || colors_stride < (size_t)width ||
        out_stride < (size_t)width || (unsigned)curve >= VD_SHADOW_CURVE_COUNT) {
        return vd_failure(
            VD_ERROR_ARGUMENT,
            "vd_shadow_bake: the size must be at least 1 × 1, no stride less than the "
            "width of %d, and curve of vd_shadow_curve",
            width);
    }
    curve_table *table = vd_allocate(context, 1, sizeof *table);
    if (table == NULL) {
        return vd_out_of_memory("a shadow's curve", sizeof *table);
    }
    make_table(curve, table);
    for (int row = 0; row < height; row++) {
        for (int column = 0; column < width; column++) {
            const size_t c = (size_t)column, r = (size_t)row;
            out[r * out_stride + c] =
                darkened(table, counts[r * counts_stride + c], colors[r * colors_stride + c]);
        }
    }
    vd_release(context, table);
    return vd_success();
}

static int nearest(double v, int size) {
    v = floor(v + 0.5);
    return !(v > 0.0) ? 0 : v > size - 1 ? size - 1 : (int)v;
}

vd_status vd_shadow_bake_heightfield(vd_context *context, const uint8_t *counts, size_t stride,
                                     vd_shadow_curve curve, vd_heightfield *map) {
    if (context == NULL || counts == NULL || map == NULL) {
        return vd_failure(VD_ERROR_ARGUMENT, "vd_shadow_bake_heightfield: no argument may be null");
    }
    double m[6];
    if (map->color_width < 1 || !vd_heightfield_invert(map->color_from_sample, m)) {
        return vd_failure(
            VD_ERROR_ARGUMENT,
            "vd_shadow_bake_heightfield: the heightfield has no colours, or a singular "
            "color_from_sample");
    }
    if (stride < (size_t)map->width || (unsigned)curve >= VD_SHADOW_CURVE_COUNT) {
        return vd_failure(
            VD_ERROR_ARGUMENT,
            "vd_shadow_bake_heightfield: stride must be at least the width of %d, and "
            "curve of vd_shadow_curve",
            map->width);
    }
    curve_table *table = vd_allocate(context, 1, sizeof *table);
    if (table == NULL) {
        return vd_out_of_memory("a shadow's curve", sizeof *table);
    }
    make_table(curve, table);
    vd_rgba8 *to = (vd_rgba8 *)(void *)((uint8_t *)map + map->color_offset_bytes);
    for (int y = 0; y < map->color_height; y++) {
        for (int x = 0; x < map->color_width; x++) {
            const double u = x + 0.5, v = y + 0.5;
            const int column = nearest(m[0] + (u * m[1] + v * m[2]), map->width);
            const int row = nearest(m[3] + (u * m[4] + v * m[5]), map->height);
            to[x] = darkened(table, counts[(size_t)row * stride + (size_t)column], to[x]);
        }
        to += map->color_stride;
    }
    vd_release(context, table);
    map->checksum = vd_heightfield_checksum(map, (size_t)map->size_bytes);
    return vd_success();
}

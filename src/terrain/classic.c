/* classic.c: the classic picture's def: what is accepted, how it is rounded, how many slices it
 * has, which method draws it, and which camera sees the same.
 */
#include <float.h>
#include <string.h>
#include <veduta/target.h>
#include "core/core.h"
#include "core/real.h"
#include "image/image.h"
#include "terrain/classic_internal.h"

#define MAX_SLICES ((uint64_t)INT32_MAX)

static const struct {
    const char *name;
    vd_classic_draw_function *draw;
} methods[VD_CLASSIC_METHOD_COUNT] = {
    [VD_CLASSIC_REFERENCE] = {"reference", vd_classic_draw_reference},
    [VD_CLASSIC_SLICES] = {"slices", vd_classic_draw_slices},
    [VD_CLASSIC_COLUMNS] = {"columns", vd_classic_draw_columns},
    [VD_CLASSIC_SCAN] = {"scan", vd_classic_draw_scan},
    [VD_CLASSIC_MARCH] = {"march", NULL}, /* a renderer of its own */
};

const char *vd_classic_method_name(vd_classic_method method) {
    return (unsigned)method < VD_CLASSIC_METHOD_COUNT ? methods[method].name : "unknown";
}

vd_classic_def vd_classic_def_default(void) {
    vd_classic_def def = {
        .x = 512.0,
        .y = 800.0,
        .height = 78.0,
        .yaw_rad = 0.0,
        .horizon = 100.0,
        .scale = 240.0,
        .view = 1.0,
        .distance = 10000.0,
        .z0 = 1.0,
        .step = 0.1,
        .growth = 0.0,
        .background = {0x90, 0x90, 0xE0, 0xFF},
    };
    return def;
}

/* ---- checks ---------------------------------------------------------------------------------- */

/* Every number is computed with in float, so each must be finite there too. */
static vd_status check_numbers(const vd_classic_def *def) {
    const struct {
        const char *name;
        double value;
    } fields[] = {
        {"x", def->x},
        {"y", def->y},
        {"height", def->height},
        {"yaw", def->yaw_rad},
        {"horizon", def->horizon},
        {"scale", def->scale},
        {"view", def->view},
        {"distance", def->distance},
        {"z0", def->z0},
        {"step", def->step},
        {"growth", def->growth},
    };
    for (size_t i = 0; i < sizeof fields / sizeof fields[0]; i++) {
        if (!(fabs(fields[i].value) <= FLT_MAX)) {
            return vd_failure(VD_ERROR_ARGUMENT,
                              "classic: %s is %g; give a finite number of at most %g",
                              fields[i].name, fields[i].value, (double)FLT_MAX);
        }
    }
    if (!((float)def->z0 > 0.0f)) {
        return vd_failure(VD_ERROR_ARGUMENT, "classic: z0 is %g; give a distance above 0", def->z0);
    }
    if ((unsigned)def->filter >= VD_FILTER_COUNT) {
        return vd_failure(VD_ERROR_ARGUMENT, "classic: filter %d does not exist; give 0 to %d",
                          (int)def->filter, VD_FILTER_COUNT - 1);
    }
    if (def->samples != 0 && vd_sample_offsets(def->samples) == NULL) {
        return vd_failure(VD_ERROR_ARGUMENT, "classic: samples is %d; give 1, 4 or 8",
                          def->samples);
    }
    if (!((float)def->view > 0.0f)) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "classic: view is %g; give a number above 0 (1 is a 90 degree view)",
                          def->view);
    }
    return vd_success();
}

static vd_status never_reaches(const vd_classic_def *def) {
    return vd_failure(
        VD_ERROR_ARGUMENT,
        "classic: step %g with growth %g never reaches the distance %g; give a larger "
        "step",
        def->step, def->growth, def->distance);
}

static vd_status too_many(const vd_classic_def *def) {
    return vd_failure(VD_ERROR_LIMIT,
                      "classic: step %g with growth %g takes more than %llu slices to the distance "
                      "%g; give a larger step or a smaller distance",
                      def->step, def->growth, (unsigned long long)MAX_SLICES, def->distance);
}

/* ---- how many slices ------------------------------------------------------------------------- */

/* z_k = z0 + (float)k·step never falls as k grows, because float rounding is monotone: the first
 * slice at or past the distance is found by bisection. */
static vd_status count_constant(const vd_classic_def *def, uint64_t *count) {
    float z0 = (float)def->z0, step = (float)def->step, distance = (float)def->distance;
    if (!(step > 0.0f)) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "classic: step is %g; without growth give a step above 0", def->step);
    }
    uint64_t low = 0, high = MAX_SLICES + 1;
    while (low < high) {
        uint64_t middle = low + (high - low) / 2;
        if (z0 + (float)(uint32_t)middle * step < distance) {
            low = middle + 1;
        } else {
            high = middle;
        }
    }
    if (low > MAX_SLICES) {
        return too_many(def);
    }
    *count = low;
    return vd_success();
}

/* The growing schedule is a running sum whose every rounding counts: it is walked. The sum is known
 * in closed form to within 2^31 roundings of 2^−53, so what is hopeless is refused before. */
static vd_status count_growing(const vd_classic_def *def, uint64_t *count) {
    if (def->step < 0.0 || (def->step == 0.0 && def->growth < 0.0)) {
        return never_reaches(def);
    }
    double most = (double)MAX_SLICES;
    double farthest = def->z0 + most * def->step + def->growth * (most * (most + 1.0) / 2.0);
    if (def->growth > 0.0 && farthest * (1.0 + 1e-5) < def->distance) {
        return too_many(def);
    }
    double z = def->z0, step = def->step;
    uint64_t k = 0;
    while (z < def->distance) {
        double next_step = step + def->growth;
        double next = z + next_step;
        bool stuck = next == z && next_step == step;
        if (stuck || (next_step <= 0.0 && def->growth < 0.0)) {
            return never_reaches(def);
        }
        step = next_step;
        z = next;
        if (++k > MAX_SLICES) {
            return too_many(def);
        }
    }
    *count = k;
    return vd_success();
}

static vd_status count_slices(const vd_classic_def *def, uint64_t *count) {
    vd_status status = check_numbers(def);
    if (status.code != VD_OK) {
        return status;
    }
    return def->growth == 0.0 ? count_constant(def, count) : count_growing(def, count);
}

uint64_t vd_classic_slice_count(const vd_classic_def *def) {
    uint64_t count = 0;
    vd_status status = count_slices(def, &count);
    return status.code == VD_ERROR_LIMIT ? MAX_SLICES : count;
}

/* ---- setting up ------------------------------------------------------------------------------ */

vd_status vd_classic_check_map(const vd_heightfield *map) {
    if (!map->wraps) {
        return vd_failure(VD_ERROR_ARGUMENT, "classic: the map ends at its edge; build it with "
                                             "vd_heightfield_def.wraps set");
    }
    if (map->color_width != map->width || map->color_height != map->height) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "classic: the map has %d x %d heights and %d x %d colours; give a colour "
                          "picture of the size of the heights",
                          map->width, map->height, map->color_width, map->color_height);
    }
    if (map->height_type >= VD_HEIGHT_TYPE_COUNT) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "classic: the map's height_type is %u; give a map made "
                          "by vd_heightfield_create",
                          map->height_type);
    }
    return vd_success();
}

/* d_i = left + (float)i·((right − left)/W), each operation rounded once, in this order. `shift` is
 * added to i. */
static void set_directions(const vd_classic_def *def, int width, float shift, float *x, float *y) {
    float s = (float)vd_sin(def->yaw_rad);
    float c = (float)vd_cos(def->yaw_rad);
    float view = (float)def->view;
    float left_x = -c - s * view, left_y = s - c * view;
    float right_x = c - s * view, right_y = -s - c * view;
    float across_x = (right_x - left_x) / (float)width;
    float across_y = (right_y - left_y) / (float)width;
    for (int i = 0; i < width; i++) {
        x[i] = left_x + ((float)i + shift) * across_x;
        y[i] = left_y + ((float)i + shift) * across_y;
    }
}

void vd_classic_set_objects(vd_frame *frame) {
    uint32_t id;
    vd_frame_forget_objects(frame);
    const vd_status status = vd_frame_add_object(frame, 1, &id);
    (void)status; /* the table always has room for one */
}

void vd_classic_clear(vd_frame *frame, vd_rgba8 background) {
    background.a = 255;
    for (int row = 0; row < frame->height; row++) {
        size_t first = (size_t)row * frame->stride;
        vd_rgba8 *colors = (vd_rgba8 *)frame->rgba + first;
        for (int i = 0; i < frame->width; i++) {
            colors[i] = background;
        }
        if (frame->depth != NULL) {
            memset(frame->depth + first, 0, (size_t)frame->width * sizeof *frame->depth);
        }
        if (frame->id != NULL) {
            memset(frame->id + first, 0, (size_t)frame->width * sizeof *frame->id);
        }
    }
    vd_classic_set_objects(frame);
}

vd_classic_setup vd_classic_make_setup(vd_context *context, vd_job *job, const vd_heightfield *map,
                                       const vd_classic_mips *mips, const vd_classic_view *view,
                                       uint64_t slices, float *directions) {
    const vd_classic_def *def = view->def;
    const vd_classic_level *level = &mips->levels[0];
    size_t width = (size_t)view->frame->width;
    vd_rgba8 background = def->background;
    background.a = 255;
    set_directions(def, view->frame->width, (float)view->column, directions, directions + width);
    vd_classic_setup setup = {
        .context = context,
        .job = job,
        .map = map,
        .frame = view->frame,
        .height_type = (vd_height_type)map->height_type,
        .heights = level->heights,
        .height_stride = level->height_stride,
        .colors = level->colors,
        .color_stride = level->color_stride,
        .map_width = level->width,
        .map_height = level->height,
        .x_mask = level->x_mask,
        .y_mask = level->y_mask,
        .direction_x = directions,
        .direction_y = directions + width,
        .eye_x = (float)def->x,
        .eye_y = (float)def->y,
        .eye_height = (float)def->height,
        .horizon = (float)(def->horizon + view->horizon),
        .scale = (float)def->scale,
        .z0 = (float)def->z0,
        .step = (float)def->step,
        .z0_exact = def->z0,
        .step_exact = def->step,
        .growth = def->growth,
        .slice_count = (uint32_t)slices,
        .linear = def->filter == VD_FILTER_LINEAR,
        .smooth = def->smooth,
        .plain = def->filter != VD_FILTER_LINEAR && !def->smooth && !def->mip,
        .levels = mips->levels,
        .level_count = def->mip ? mips->count : 1,
        .footprint = (float)def->view * 2.0f / (float)width,
    };
    memcpy(&setup.background, &background, sizeof background);
    return setup;
}

vd_status vd_classic_check(vd_context *context, const vd_heightfield *map,
                           const vd_classic_def *def, const vd_frame *frame, uint64_t *slices) {
    if (context == NULL || map == NULL || def == NULL || frame == NULL) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "classic: vd_classic_render needs a context, a map, a def and a frame");
    }
    vd_status status = vd_classic_check_map(map);
    return status.code == VD_OK ? count_slices(def, slices) : status;
}

/* Only the scan, which has its pairs from slices alone, leaves something to others. */
static vd_status check_method(const vd_classic_def *def, vd_classic_method method) {
    if (method == VD_CLASSIC_SCAN &&
        (def->filter != VD_FILTER_NEAREST || def->mip || def->smooth)) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "classic: the method scan draws no picture with the option %s; give "
                          "reference, slices, columns or march",
                          def->filter != VD_FILTER_NEAREST ? "filter"
                          : def->mip                       ? "mip"
                                                           : "smooth");
    }
    return vd_success();
}

static vd_status march_once(vd_context *context, vd_job *job, const vd_heightfield *map,
                            const vd_classic_def *def, vd_frame *frame) {
    vd_classic_renderer *renderer = NULL;
    vd_status status = vd_classic_renderer_create(context, map, &renderer);
    if (status.code == VD_OK) {
        status = vd_classic_renderer_draw(renderer, job, def, frame);
    }
    vd_classic_renderer_destroy(&renderer);
    return status;
}

typedef struct drawing {
    vd_context *context;
    vd_job *job;
    const vd_heightfield *map;
    vd_classic_method method;
    uint64_t slices;
    vd_classic_mips mips;
    float *directions;
    vd_classic_counts *counts;
} drawing;

static vd_status draw_view(void *user, const vd_classic_view *view) {
    drawing *d = user;
    vd_classic_clear(view->frame, view->def->background);
    vd_classic_setup setup =
        vd_classic_make_setup(d->context, d->job, d->map, &d->mips, view, d->slices, d->directions);
    vd_classic_counts unwanted;
    return methods[d->method].draw(&setup, d->counts != NULL ? d->counts : &unwanted);
}

vd_status vd_classic_render(vd_context *context, vd_job *job, const vd_heightfield *map,
                            const vd_classic_def *def, vd_classic_method method, vd_frame *frame,
                            vd_classic_counts *counts) {
    if ((unsigned)method >= VD_CLASSIC_METHOD_COUNT) {
        return vd_failure(VD_ERROR_ARGUMENT, "classic: method %d does not exist; give 0 to %d",
                          (int)method, VD_CLASSIC_METHOD_COUNT - 1);
    }
    uint64_t slices = 0;
    vd_status status = vd_classic_check(context, map, def, frame, &slices);
    if (status.code != VD_OK) {
        return status;
    }
    status = check_method(def, method);
    if (status.code != VD_OK) {
        return status;
    }
    if (method == VD_CLASSIC_MARCH) {
        return march_once(context, job, map, def, frame);
    }
    drawing d = {context, job, map, method, slices, {.count = 0}, NULL, counts};
    size_t count = 2 * (size_t)frame->width;
    d.directions = vd_allocate(context, count, sizeof *d.directions);
    status = d.directions == NULL
                 ? vd_out_of_memory("the columns' directions", count * sizeof *d.directions)
                 : vd_classic_mips_init(context, map, def->mip, &d.mips);
    if (status.code == VD_OK) {
        vd_classic_resolver resolver = {0};
        status = vd_classic_resolve(context, &resolver, def, frame, draw_view, &d);
        vd_classic_resolver_finish(context, &resolver);
        vd_classic_mips_finish(context, &d.mips);
    }
    vd_release(context, d.directions);
    return status;
}

vd_camera vd_classic_camera(const vd_classic_def *def, int width, int height) {
    (void)height; /* the horizon is a row, wherever the picture ends */
    double fx = def->view * width / 2.0;
    /* Samples sit at the left edges of their pixels and rows are truncated downwards: half a pixel
     * either way to the centres that a lens counts from. */
    vd_camera camera = {
        .eye = {def->x, -def->y, def->height},
        .orientation = vd_orientation_from_angles(-def->yaw_rad, 0.0, 0.0),
        .projection = VD_PROJECTION_PERSPECTIVE,
        .lens = {fx, def->scale * def->view, width / 2.0 + 0.5, def->horizon - 0.5},
        .near_m = def->view * def->z0,
        .far_m = def->view * def->distance,
    };
    return camera;
}

/* ---- what is rare or shared ------------------------------------------------------------------ */

int vd_classic_wrap_far(float p, int size) {
    uint32_t bits;
    memcpy(&bits, &p, sizeof bits);
    int exponent = (int)(bits >> 23 & 255);
    if (exponent == 255) {
        return -1;
    }
    /* |p| = mantissa · 2^(exponent − 150), and at |p| >= 2^31 the power is positive: take the
     * remainder of the mantissa and double it. */
    uint64_t modulus = (uint64_t)size;
    uint64_t rest = ((bits & 0x7FFFFF) | 0x800000) % modulus;
    for (int i = exponent - 150; i > 0; i--) {
        rest = rest * 2 % modulus;
    }
    if (bits >> 31 != 0 && rest != 0) {
        rest = modulus - rest;
    }
    return (int)rest;
}

void vd_classic_paint(const vd_classic_setup *setup, int column, vd_classic_sample sample,
                      int32_t hidden, float z) {
    vd_rgba8 color = vd_classic_color(setup, sample.cell_x, sample.cell_y);
    float depth = vd_classic_depth(setup, z);
    for (int32_t row = sample.top; row < hidden; row++) {
        vd_classic_put(setup->frame, column, row, color, depth);
    }
}

vd_classic_column *vd_classic_columns_create(const vd_classic_setup *setup) {
    vd_classic_column *columns =
        vd_allocate(setup->context, (size_t)setup->frame->width, sizeof *columns);
    for (int i = 0; i < setup->frame->width && columns != NULL; i++) {
        columns[i] = vd_classic_column_first(setup);
    }
    return columns;
}

vd_status vd_classic_cancelled(void) {
    return vd_failure(VD_ERROR_CANCELLED, "classic: the picture was cancelled or ran out of time, "
                                          "and is unfinished");
}

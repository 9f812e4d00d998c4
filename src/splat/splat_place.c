/* splat_place.c: from lists, def and camera to what drawing needs to know. */
#include <math.h>
#include <string.h>
#include "core/real.h"
#include "splat/splat_internal.h"

/* ---- definitions ------------------------------------------------------------------------------*/

const char *vd_splat_kernel_name(vd_splat_kernel kernel) {
    static const char *const names[VD_SPLAT_KERNEL_COUNT] = {"box", "disc", "gaussian", "sph"};
    return kernel >= 0 && kernel < VD_SPLAT_KERNEL_COUNT ? names[kernel] : "unknown";
}

const char *vd_splat_mode_name(vd_splat_mode mode) {
    static const char *const names[VD_SPLAT_MODE_COUNT] = {"alpha", "density", "nearest"};
    return mode >= 0 && mode < VD_SPLAT_MODE_COUNT ? names[mode] : "unknown";
}

vd_splats vd_splats_default(void) {
    vd_splats splats;
    memset(&splats, 0, sizeof splats);
    splats.step[0] = splats.step[1] = splats.step[2] = 1.0f;
    splats.value_step = 1.0f;
    splats.constant = (vd_rgba8){255, 255, 255, 255};
    splats.opacity = 1.0f;
    splats.object_id = 1;
    return splats;
}

vd_splat_def vd_splat_def_default(void) {
    vd_splat_def def;
    memset(&def, 0, sizeof def);
    return def;
}

void vd_splat_class_colors(vd_rgba8 out[256]) {
    /* ASPRS LAS 1.4, table 17: 0 created, 1 unclassified, 2 ground, 3–5 vegetation, 6 building,
     * 7 low noise, 8 key point, 9 water, 10 rail, 11 road, 12 overlap, 13–16 wires and towers,
     * 17 bridge, 18 high noise. */
    static const vd_rgba8 known[] = {
        {190, 190, 190, 255}, {170, 170, 170, 255}, {164, 124, 84, 255},  {150, 200, 110, 255},
        {90, 170, 80, 255},   {40, 130, 60, 255},   {215, 90, 70, 255},   {240, 60, 240, 255},
        {120, 100, 220, 255}, {70, 130, 230, 255},  {130, 110, 100, 255}, {110, 110, 120, 255},
        {220, 210, 150, 255}, {250, 210, 60, 255},  {250, 230, 120, 255}, {230, 160, 40, 255},
        {250, 190, 120, 255}, {200, 170, 140, 255}, {250, 120, 250, 255}};
    for (size_t i = 0; i < 256; i++) {
        out[i] = i < sizeof known / sizeof known[0] ? known[i] : (vd_rgba8){150, 150, 150, 255};
    }
}

/* ---- checks -----------------------------------------------------------------------------------*/

static vd_status check_def(const vd_splat_def *def) {
    if (def->mode < 0 || def->mode >= VD_SPLAT_MODE_COUNT || def->kernel < 0 ||
        def->kernel >= VD_SPLAT_KERNEL_COUNT || def->method < 0 ||
        def->method >= VD_SPLAT_METHOD_COUNT) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "the splats' mode %d, kernel %d or method %d is unknown", (int)def->mode,
                          (int)def->kernel, (int)def->method);
    }
    if (!isfinite(def->range_min) || !isfinite(def->range_max) || def->range_max < def->range_min) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "the splats' range of colours is %g to %g; give two finite numbers, the "
                          "lower one first, or 0 and 0 for the range of the data",
                          def->range_min, def->range_max);
    }
    if (def->log && def->range_max > def->range_min && !(def->range_min > 0.0)) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "the splats' range of colours begins at %g, which has no logarithm; give "
                          "a positive number",
                          def->range_min);
    }
    if (def->over_frame && def->mode != VD_SPLAT_ALPHA) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "splats are drawn over a frame by alpha alone, not by %s; leave "
                          "over_frame out",
                          vd_splat_mode_name(def->mode));
    }
    if (!(def->max_weight >= 0.0 && isfinite(def->max_weight)) || !(def->resort_rad >= 0.0)) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "the splats' largest weight is %g and their angle to sort again %g; give "
                          "numbers of at least 0",
                          def->max_weight, def->resort_rad);
    }
    return vd_success();
}

static vd_status check_splats(const vd_splats *s, int i) {
    if (s->count > VD_SPLATS_MAX_COUNT) {
        return vd_failure(VD_ERROR_LIMIT, "splats %d are %zu particles; split them at %u", i,
                          s->count, VD_SPLATS_MAX_COUNT);
    }
    const bool floats = s->x != NULL && s->y != NULL && s->z != NULL;
    const bool quantised = s->x16 != NULL && s->y16 != NULL && s->z16 != NULL;
    if (s->count > 0 && !floats && !quantised) {
        return vd_failure(VD_ERROR_ARGUMENT, "splats %d have no positions; give x, y and z", i);
    }
    if (!(s->opacity >= 0.0f && s->opacity <= 1.0f)) {
        return vd_failure(VD_ERROR_ARGUMENT, "the opacity of splats %d is %g; give 0 to 1", i,
                          (double)s->opacity);
    }
    if (!isfinite(s->anchor.x) || !isfinite(s->anchor.y) || !isfinite(s->anchor.z)) {
        return vd_failure(VD_ERROR_ARGUMENT, "the anchor of splats %d is not finite", i);
    }
    if (s->order != NULL && s->order->index == NULL && s->count > 0) {
        return vd_failure(VD_ERROR_ARGUMENT, "the order of splats %d has no memory", i);
    }
    return vd_success();
}

vd_status vd_splat_check(const vd_splat_def *def, const vd_camera *camera, const vd_splats *splats,
                         int count) {
    vd_status status = check_def(def);
    if (status.code == VD_OK && (count < 0 || (count > 0 && splats == NULL))) {
        status = vd_failure(VD_ERROR_ARGUMENT, "%d lists of splats cannot be drawn", count);
    }
    for (int i = 0; i < count && status.code == VD_OK; i++) {
        status = check_splats(&splats[i], i);
    }
    return status.code == VD_OK ? vd_camera_validate(camera) : status;
}

/* ---- bounds -----------------------------------------------------------------------------------*/

static void find_axis_bounds(const vd_splats *s, const float *at, const uint16_t *at16, int axis,
                             float *min, float *max) {
    float low = INFINITY, high = -INFINITY;
    for (size_t i = 0; i < s->count; i++) {
        const float v = at != NULL ? at[i] : s->origin[axis] + s->step[axis] * (float)at16[i];
        if (v - v == 0.0f) {
            low = v < low ? v : low;
            high = v > high ? v : high;
        }
    }
    *min = low <= high ? low : 0.0f;
    *max = low <= high ? high : 0.0f;
}

void vd_splats_find_bounds(vd_splats *s) {
    float reach = s->radius_m > 0.0f ? s->radius_m : 0.0f;
    if (s->radius != NULL) {
        reach = 0.0f;
        for (size_t i = 0; i < s->count; i++) {
            const float r = s->radius[i];
            reach = r > reach && r - r == 0.0f ? r : reach;
        }
    }
    const float *at[3] = {s->x, s->y, s->z};
    const uint16_t *at16[3] = {s->x16, s->y16, s->z16};
    for (int axis = 0; axis < 3; axis++) {
        find_axis_bounds(s, at16[axis] != NULL ? NULL : at[axis], at16[axis], axis, &s->min[axis],
                         &s->max[axis]);
        s->min[axis] -= reach;
        s->max[axis] += reach;
    }
    s->has_bounds = true;
}

/* ---- placing ----------------------------------------------------------------------------------*/

/* The matrix from p to the picture in double: x·w, y·w, z; rows of 4. */
static void make_rows(const vd_splats *s, const vd_camera *camera, double rows[3][4]) {
    const vd_matrix project = vd_camera_matrix(camera);
    const vd_vec3 axis = vd_quat_rotate(camera->orientation, vd_vec3_make(0, 0, 1));
    const double from[3][4] = {{project.m[0][0], project.m[0][1], project.m[0][2], project.m[0][3]},
                               {project.m[1][0], project.m[1][1], project.m[1][2], project.m[1][3]},
                               {axis.x, axis.y, axis.z, 0.0}};
    const vd_matrix m = s->transform != NULL ? *s->transform : vd_matrix_identity();
    const vd_vec3 at = vd_vec3_subtract(s->anchor, camera->eye);
    const double move[3] = {at.x + m.m[0][3], at.y + m.m[1][3], at.z + m.m[2][3]};
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) {
            rows[i][j] = (from[i][0] * m.m[0][j] + from[i][1] * m.m[1][j]) + from[i][2] * m.m[2][j];
        }
        rows[i][3] =
            ((from[i][0] * move[0] + from[i][1] * move[1]) + from[i][2] * move[2]) + from[i][3];
    }
}

/* x to the third root, x >= 0, by Newton: no libm. */
static double cube_root(double x) {
    double y = x > 1.0 ? x : 1.0;
    for (int i = 0; i < 200 && x > 0.0; i++) {
        const double next = (2.0 * y + x / (y * y)) / 3.0;
        if (next >= y) {
            return y;
        }
        y = next;
    }
    return x > 0.0 ? y : 0.0;
}

static double volume_scale(const vd_matrix *m) {
    if (m == NULL) {
        return 1.0;
    }
    const vd_vec3 a = {m->m[0][0], m->m[1][0], m->m[2][0]};
    const vd_vec3 b = {m->m[0][1], m->m[1][1], m->m[2][1]};
    const vd_vec3 c = {m->m[0][2], m->m[1][2], m->m[2][2]};
    return cube_root(fabs(vd_vec3_dot(a, vd_vec3_cross(b, c))));
}

/* True when all corners of the bounds are on the outer side of one edge of the picture. The bounds
 * hold radii, kernels reach `support` of them. */
static bool is_outside(const vd_placing *placing, const double rows[3][4], const double min[3],
                       const double max[3], int width, int height) {
    int out[5] = {0};
    for (int corner = 0; corner < 8; corner++) {
        double v[3];
        for (int i = 0; i < 3; i++) {
            v[i] = rows[i][3];
            for (int j = 0; j < 3; j++) {
                v[i] += rows[i][j] * (corner >> j & 1 ? max[j] : min[j]);
            }
        }
        const double w = placing->perspective ? v[2] : 1.0;
        out[0] += v[0] < -2.0 * fabs(w);
        out[1] += v[0] - (width + 2.0) * w > 0.0;
        out[2] += v[1] < -2.0 * fabs(w);
        out[3] += v[1] - (height + 2.0) * w > 0.0;
        out[4] += v[2] < placing->near_z;
    }
    return out[0] == 8 || out[1] == 8 || out[2] == 8 || out[3] == 8 || out[4] == 8;
}

/* Culling and the range of the sort keys, from bounds. */
static void use_bounds(vd_placing *placing, const vd_splats *s, const double rows[3][4],
                       const vd_splat_picture *picture) {
    const double length =
        sqrt((rows[2][0] * rows[2][0] + rows[2][1] * rows[2][1]) + rows[2][2] * rows[2][2]);
    double min[3], max[3], middle = 0.0, half = 0.0, nearest = rows[2][3];
    for (int j = 0; j < 3; j++) {
        const double more = (picture->shape.support - 1.0) * 0.5 * (s->max[j] - s->min[j]);
        min[j] = s->min[j] - more;
        max[j] = s->max[j] + more;
        middle += rows[2][j] * (0.5 * ((double)s->min[j] + s->max[j]));
        half += fabs(rows[2][j]) * (0.5 * ((double)s->max[j] - s->min[j]));
        placing->axis[j] = length > 0.0 ? (float)(rows[2][j] / length) : 0.0f;
    }
    nearest += middle;
    placing->middle_z = (float)nearest;
    placing->z_back = (float)(middle + half);
    placing->z_scale = half > 0.0 ? (float)(0.5 / half) : 0.0f;
    placing->culled = is_outside(placing, rows, min, max, picture->width, picture->height);
}

static uint32_t bytes_of(vd_rgba8 c) {
    return (uint32_t)c.r | (uint32_t)c.g << 8 | (uint32_t)c.b << 16 | (uint32_t)c.a << 24;
}

void vd_placing_init(vd_placing *placing, const vd_splats *splats, const vd_splat_def *def,
                     const vd_splat_picture *picture, const vd_camera *camera) {
    memset(placing, 0, sizeof *placing);
    placing->splats = splats;
    placing->perspective = camera->projection == VD_PROJECTION_PERSPECTIVE;
    placing->near_z = (float)camera->near_m;
    placing->far_z = placing->perspective ? INFINITY : (float)camera->far_m;
    placing->depth_at = placing->perspective ? 0.0f : 1.0f;
    placing->depth_by = (float)(placing->perspective ? camera->near_m : -1.0 / camera->far_m);
    placing->support_scale = (float)(sqrt(fabs(camera->lens.fx * camera->lens.fy)) *
                                     volume_scale(splats->transform) * picture->shape.support);
    placing->opacity = splats->opacity * (1.0f / 255.0f);
    placing->constant = bytes_of(splats->constant);
    placing->paint = splats->color != NULL     ? VD_PAINT_COLOR
                     : splats->classes != NULL ? VD_PAINT_CLASS
                     : splats->value != NULL   ? VD_PAINT_VALUE
                     : splats->value16 != NULL ? VD_PAINT_VALUE16
                                               : VD_PAINT_CONSTANT;
    double rows[3][4];
    make_rows(splats, camera, rows);
    vd_splats bounded = *splats;
    const bool sorted = def->mode == VD_SPLAT_ALPHA && (!def->keep_order || def->sort_splats);
    if (!bounded.has_bounds && sorted) {
        vd_splats_find_bounds(&bounded);
    }
    if (bounded.has_bounds) {
        use_bounds(placing, &bounded, rows, picture);
    }
    for (int i = 0; i < 3; i++) {
        double at = rows[i][3];
        for (int j = 0; j < 3; j++) {
            if (splats->x16 != NULL) {
                placing->z_back -= i == 2 ? (float)(rows[i][j] * splats->origin[j]) : 0.0f;
                at += rows[i][j] * splats->origin[j];
                rows[i][j] *= splats->step[j];
            }
            placing->row[i][j] = (float)rows[i][j];
        }
        placing->row[i][3] = (float)at;
    }
}

/* ---- ranges -----------------------------------------------------------------------------------*/

void vd_placing_measure(vd_placing *placing, const vd_splat_def *def) {
    const vd_splats *s = placing->splats;
    float low = INFINITY, high = -INFINITY, heaviest = 0.0f;
    if (def->mode == VD_SPLAT_DENSITY) {
        for (size_t i = 0; s->weight != NULL && i < s->count; i++) {
            const float w = s->weight[i];
            heaviest = w > heaviest && w - w == 0.0f ? w : heaviest;
        }
        placing->weight_max = s->weight != NULL ? heaviest : 1.0f;
        return;
    }
    for (size_t i = 0; placing->paint >= VD_PAINT_VALUE && i < s->count; i++) {
        const float v = placing->paint == VD_PAINT_VALUE
                            ? s->value[i]
                            : s->value_origin + s->value_step * (float)s->value16[i];
        if (v - v == 0.0f && (!def->log || v > 0.0f)) {
            low = v < low ? v : low;
            high = v > high ? v : high;
        }
    }
    placing->value_min = low;
    placing->value_max = high;
}

/* ---- colours ----------------------------------------------------------------------------------*/

/* log₂ of a positive number, within 2·10⁻⁵. */
static float log2_of(float v) {
    uint32_t bits;
    v = 0x1p-126f < v ? v : 0x1p-126f; /* NaN too */
    memcpy(&bits, &v, sizeof bits);
    const int32_t exponent = (int32_t)(bits >> 23) - 127;
    bits = (bits & 0x7FFFFF) | 0x3F800000;
    memcpy(&v, &bits, sizeof v);
    const float y = (v - 1.0f) / (v + 1.0f), y2 = y * y;
    const float series = ((0.41219857f * y2 + 0.57707802f) * y2 + 0.96179669f) * y2 + 2.88539008f;
    return (float)exponent + series * y;
}

int vd_splat_palette_index(const vd_splat_picture *picture, float value) {
    if (picture->log) {
        value = log2_of(value);
    }
    float t = (value - picture->value_low) * picture->value_scale;
    t = 0.0f < t ? t : 0.0f;
    t = t < (float)(VD_PALETTE_COLORS - 1) ? t : (float)(VD_PALETTE_COLORS - 1);
    return (int)(t + 0.5f);
}

static vd_rgba8 premultiplied(vd_rgba8 c) {
    c.r = (uint8_t)((c.r * c.a + 127) / 255);
    c.g = (uint8_t)((c.g * c.a + 127) / 255);
    c.b = (uint8_t)((c.b * c.a + 127) / 255);
    return c;
}

void vd_splat_picture_set_range(vd_splat_picture *picture, const vd_splat_def *def, double min,
                                double max) {
    vd_colormap map;
    if (def->colormap != NULL) {
        map = *def->colormap;
    } else {
        vd_colormap_find(def->mode == VD_SPLAT_DENSITY ? "magma" : "viridis", &map);
    }
    const float low = def->log ? log2_of((float)min) : (float)min;
    const float high = def->log ? log2_of((float)max) : (float)max;
    picture->range_min = min;
    picture->range_max = max;
    picture->value_low = low;
    picture->value_scale = high > low ? (float)(VD_PALETTE_COLORS - 1) / (high - low) : 0.0f;
    for (int i = 0; i < VD_PALETTE_COLORS; i++) {
        const double t = i / (double)(VD_PALETTE_COLORS - 1);
        /* A relative map is stretched over the palette; an absolute one is read at the value. */
        double at = t;
        if (!map.relative) {
            at = def->log ? vd_exp((low + t * (high - low)) * 0.6931471805599453)
                          : min + t * (max - min);
        }
        const vd_rgba8 color = vd_colormap_at(&map, at, 0.0, 1.0);
        picture->palette[i] = bytes_of(color);
        picture->density_colors[i] = bytes_of(premultiplied(color));
    }
}

void vd_splat_picture_set_weight(vd_splat_picture *picture, double max) {
    picture->weight_scale = max > 0.0 ? (float)(VD_WEIGHT_ONE / max) : 0.0f;
    picture->density_scale = (float)(max / (256.0 * VD_WEIGHT_ONE));
}

void vd_splat_picture_init(vd_splat_picture *picture, const vd_splat_def *def, int width,
                           int height, const vd_splat_profile profiles[2]) {
    memset(picture, 0, sizeof *picture);
    picture->mode = def->mode;
    picture->log = def->log;
    picture->shape = vd_splat_shape_of(def->kernel, profiles);
    picture->width = width;
    picture->height = height;
    picture->tiles_x = (width + VD_TILE_SIDE - 1) >> VD_TILE_LOG2;
    picture->tiles_y = (height + VD_TILE_SIDE - 1) >> VD_TILE_LOG2;
    picture->tile_count = picture->tiles_x * picture->tiles_y;
    const float alpha = (float)def->background.a / 255.0f;
    picture->background[0] = (float)def->background.r * alpha;
    picture->background[1] = (float)def->background.g * alpha;
    picture->background[2] = (float)def->background.b * alpha;
    picture->background[3] = (float)def->background.a;
    picture->background_bytes = bytes_of(premultiplied(def->background));
    vd_rgba8 classes[256];
    vd_splat_class_colors(classes);
    for (int i = 0; i < 256; i++) {
        picture->class_colors[i] =
            bytes_of(def->class_colors != NULL ? def->class_colors[i] : classes[i]);
    }
}

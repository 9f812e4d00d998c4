/* lens_view.c: the camera in floats, see lens_view.h. */
#include "terrain/lens_view.h"
#include <string.h>
#include "core/real.h"
#include "terrain/heightfield_block.h"

/* 2^−20: sixteen times the rounding of a float, for margins. */
#define ROUNDING 0x1p-20

/* A vector that is affine in the picture position: at (0, 0), and per pixel to the right and down.
 */
typedef struct affine3 {
    vd_vec3 at, x, y;
} affine3;

static affine3 affine3_add_scaled(affine3 a, affine3 b, double s) {
    a.at = vd_vec3_add(a.at, vd_vec3_scale(b.at, s));
    a.x = vd_vec3_add(a.x, vd_vec3_scale(b.x, s));
    a.y = vd_vec3_add(a.y, vd_vec3_scale(b.y, s));
    return a;
}

/* The rays' origins, relative to the eye, and directions. */
static void make_rays(const vd_camera *camera, affine3 *origin, affine3 *direction) {
    const vd_lens *lens = &camera->lens;
    const vd_quat q = camera->orientation;
    const vd_vec3 zero = {0.0, 0.0, 0.0};
    const vd_vec3 forward = vd_quat_rotate(q, vd_vec3_make(0.0, 0.0, 1.0));
    const affine3 across = {
        vd_quat_rotate(q, vd_vec3_make(-lens->cx / lens->fx, -lens->cy / lens->fy, 0.0)),
        vd_quat_rotate(q, vd_vec3_make(1.0 / lens->fx, 0.0, 0.0)),
        vd_quat_rotate(q, vd_vec3_make(0.0, 1.0 / lens->fy, 0.0))};
    const affine3 ahead = {forward, zero, zero}, nothing = {zero, zero, zero};
    if (camera->projection == VD_PROJECTION_ORTHOGRAPHIC) {
        *origin = across;
        *direction = ahead;
    } else {
        *origin = nothing;
        *direction = affine3_add_scaled(across, ahead, 1.0);
    }
}

/* a·x + b·y of a vector's horizontal components, plus an offset. */
static vd_lens_affine project(affine3 v, double a, double b, double offset) {
    vd_lens_affine f = {{(float)(offset + (a * v.at.x + b * v.at.y)),
                         (float)(a * v.x.x + b * v.x.y), (float)(a * v.y.x + b * v.y.y)}};
    return f;
}

static vd_lens_affine lift(affine3 v, double scale, double offset) {
    vd_lens_affine f = {
        {(float)(offset + scale * v.at.z), (float)(scale * v.x.z), (float)(scale * v.y.z)}};
    return f;
}

/* The greatest magnitude over the picture. */
static double greatest(const vd_lens_affine *f, int width, int height) {
    double most = 0.0;
    for (int i = 0; i < 4; i++) {
        const double x = i & 1 ? width : 0, y = i >> 1 ? height : 0;
        const double value = fabs(f->k[0] + x * f->k[1] + y * f->k[2]);
        most = value > most ? value : most;
    }
    return most;
}

/* How far along the view axis the map begins: the nearest corner of its box, or 0. */
static double nearest_axial(const vd_terrain_def *def, const vd_camera *camera,
                            const vd_lens_map *map) {
    const double *m = map->world_from_sample;
    const vd_vec3 forward = vd_quat_rotate(camera->orientation, vd_vec3_make(0.0, 0.0, 1.0));
    double least = INFINITY;
    for (int i = 0; i < 8; i++) {
        const double c = i & 1 ? map->extent.columns : 0;
        const double r = i & 2 ? map->extent.rows : 0;
        const double z = (i & 4 ? map->highest : map->lowest) * def->exaggeration;
        const vd_vec3 p = {m[0] - camera->eye.x + (c * m[1] + r * m[2]),
                           m[3] - camera->eye.y + (c * m[4] + r * m[5]), z - camera->eye.z};
        const double axial = vd_vec3_dot(p, forward);
        least = axial < least ? axial : least;
    }
    return least > 0.0 ? least : 0.0;
}

/* The whole sample at or below a position, within `first` … `last`. */
static int clamp_anchor(double position, int first, int last) {
    const double p = floor(position);
    return p > first ? p < last ? (int)p : last : first; /* also NaN */
}

/* 2^n, exactly. */
static double power_of_two(int n) {
    return ldexp(1.0, n);
}

/* Distance at which a cell of level 0 is cell_pixels wide; orthographic: the share of a level. */
static double first_distance(const vd_lens_map *map, const vd_camera *camera) {
    const double *m = map->world_from_sample;
    const double cell = sqrt(fabs(m[1] * m[5] - m[2] * m[4]));
    return cell * sqrt(camera->lens.fx * camera->lens.fy) / map->cell_pixels;
}

static void make_slabs(const vd_terrain_def *def, const vd_camera *camera, int anchor_u,
                       int anchor_v, double t0, vd_lens_view *view) {
    const vd_lens_map *map = view->map;
    const double first = first_distance(map, camera); /* T(0); T(n) = 2^n T(0) */
    int begin = 0, end = def->mip ? map->levels : 1;
    if (view->orthographic && def->mip) {
        /* One distance for all: the level whose cell is cell_pixels to half of that. */
        while (begin + 1 < map->levels && first * power_of_two(begin + 1) <= 1.0) {
            begin++;
        }
        end = begin + 1;
    }
    view->slabs = end - begin;
    for (int n = begin; n < end; n++) {
        vd_lens_slab *slab = &view->slab[n - begin];
        const vd_lens_ground *ground = &map->ground[n];
        slab->ground = ground;
        slab->begin = n == begin ? -INFINITY : (float)(first * power_of_two(n) - t0);
        slab->end = (float)((n + 1 == end ? map->far_m : first * power_of_two(n + 1)) - t0);
        slab->scale = (float)power_of_two(-n);
        slab->unscale = (float)power_of_two(n);
        const int column = anchor_u >> n, row = anchor_v >> n;
        slab->shift_u = (float)(anchor_u - column * (1 << n));
        slab->shift_v = (float)(anchor_v - row * (1 << n));
        slab->column = column - ground->column;
        slab->row = row - ground->row;
    }
}

/* What rounding may do to a ray's height over the ground: see lens_march.inl. */
static void make_margins(const vd_terrain_def *def, int width, int height, vd_lens_view *view) {
    const vd_lens_map *map = view->map;
    const double range = (double)map->highest - map->lowest;
    const double size =
        fabs(map->highest) > fabs(map->lowest) ? fabs(map->highest) : fabs(map->lowest);
    const double place = greatest(&view->u, width, height) + greatest(&view->v, width, height);
    const double speed = greatest(&view->ut, width, height) + greatest(&view->vt, width, height);
    const double bend = def->curvature ? fabs((double)view->curve_t0_t0) : 0.0;
    const double w = greatest(&view->w, width, height) + bend + size;
    const double w1 = greatest(&view->w1, width, height) + fabs((double)view->curve_t0);
    for (int i = 0; i < view->slabs; i++) {
        vd_lens_slab *slab = &view->slab[i];
        slab->margin = (float)(ROUNDING * (w + (place + 2.0) * slab->scale * range));
        slab->margin_s = (float)(ROUNDING * (w1 + speed * slab->scale * range));
    }
}

static void make_textures(const vd_terrain_def *def, const vd_camera *camera, int anchor_u,
                          int anchor_v, vd_lens_view *view) {
    const vd_lens_map *map = view->map;
    const double *m = map->texture_from_sample;
    const double per_sample = sqrt(fabs(m[1] * m[5] - m[2] * m[4]));
    view->nearest = def->filter == VD_FILTER_NEAREST;
    view->texels = map->texture[0].texels;
    view->texture_uu = (float)m[1], view->texture_uv = (float)m[2];
    view->texture_vu = (float)m[4], view->texture_vv = (float)m[5];
    const int last = map->textures < VD_LENS_TABLE ? map->textures - 1 : VD_LENS_TABLE - 1;
    view->texture_last = def->mip ? last : 0;
    /* A texel of size 0 is cell_pixels wide at T; size k begins at 2^k T. */
    const double first = first_distance(map, camera) / (per_sample > 0.0 ? per_sample : 1.0);
    if (view->orthographic) {
        view->texture_t = 0.0f; /* t·0 has the exponent of 0: see vd_lens_texture_size */
        int size = 0;
        while (size < view->texture_last && first * power_of_two(size + 1) <= 1.0) {
            size++;
        }
        view->texture_bias = 127 + size;
    } else {
        view->texture_t = (float)(1.0 / first);
        view->texture_bias = 0;
    }
    const double u = m[0] + (anchor_u * m[1] + anchor_v * m[2]);
    const double v = m[3] + (anchor_u * m[4] + anchor_v * m[5]);
    for (int k = 0; k < VD_LENS_TABLE; k++) {
        const int size = k <= last ? k : last;
        const vd_lens_texture *texture = &map->texture[size];
        view->texture_offset[k] = (int32_t)(texture->texels - view->texels);
        view->texture_stride[k] = texture->stride;
        view->texture_width[k] = texture->width;
        view->texture_height[k] = texture->height;
        view->texture_scale[k] = (float)power_of_two(-size);
        const double half = (view->nearest ? 0.0 : 0.5) - (map->windows ? 0.5 : 0.0);
        view->texture_u[k] = (float)(u * power_of_two(-size) - half - texture->column);
        view->texture_v[k] = (float)(v * power_of_two(-size) - half - texture->row);
    }
}

static uint32_t premultiplied(vd_rgba8 c) {
    const uint32_t a = c.a;
    return ((c.r * a + 127) / 255) | ((c.g * a + 127) / 255) << 8 | ((c.b * a + 127) / 255) << 16 |
           a << 24;
}

static uint32_t encode8(float linear) {
    return ((uint32_t)vd_srgb_encode(linear) * 255u + 32767u) / 65535u;
}

void vd_lens_make_sky(const vd_light *light, uint32_t sky[VD_LENS_SKY + 1]) {
    for (int i = 0; i <= VD_LENS_SKY; i++) {
        const float sine = (float)i * (2.0f / VD_LENS_SKY) - 1.0f;
        const vd_linear c = vd_light_sky(light, sine);
        sky[i] = encode8(c.r) | encode8(c.g) << 8 | encode8(c.b) << 16 | 0xFF000000u;
    }
}

static void make_colors(const vd_terrain_def *def, const uint32_t *sky, vd_lens_view *view) {
    const vd_light *light = &def->light;
    view->haze = light->haze_m > 0.0 ? (float)(-1.4426950408889634 / light->haze_m) : 0.0f;
    const float channels[3] = {light->horizon.r, light->horizon.g, light->horizon.b};
    for (int i = 0; i < 3; i++) {
        view->haze_color[i] = (int16_t)((vd_srgb_encode(channels[i]) * 32385u + 32767u) / 65535u);
    }
    view->haze_color[3] = 32385;
    view->sky = def->sky ? sky : NULL;
    view->background = premultiplied(def->background);
}

static void make_depth(const vd_terrain_def *def, const vd_camera *camera, vd_lens_view *view) {
    view->depth_scale = view->orthographic ? (float)(-1.0 / camera->far_m) : (float)camera->near_m;
    /* A step between neighbouring pixels is an edge from 1/64 of the distance on; a smooth slope,
     * whose depth is affine in the picture, never is. */
    view->edge_share = view->orthographic ? 0.0f : 0x1p-6f;
    view->edge_least =
        view->orthographic
            ? (float)(8.0 / (sqrt(camera->lens.fx * camera->lens.fy) * camera->far_m))
            : 0.0f;
    view->samples = def->samples;
    view->everywhere = def->antialias == VD_ANTIALIAS_EVERYWHERE;
}

void vd_lens_view_init(const vd_lens_map *map, const vd_terrain_def *def, const vd_camera *camera,
                       int width, int height, const uint32_t *sky, vd_lens_view *view) {
    memset(view, 0, sizeof *view);
    const double *m = map->world_from_sample;
    double inverse[6];
    (void)vd_heightfield_invert(m, inverse); /* checked by vd_lens_map_init */
    view->map = map;
    view->orthographic = camera->projection == VD_PROJECTION_ORTHOGRAPHIC;
    affine3 origin, direction;
    make_rays(camera, &origin, &direction);
    /* Curved ground is lower than the box; by how much depends on the ray. */
    const double t0 = def->curvature ? 0.0
                      : map->windows ? map->nearest
                                     : nearest_axial(def, camera, map);
    const affine3 start = affine3_add_scaled(origin, direction, t0);
    /* Differences to the map's corner first: exact, wherever in the world both are. */
    const double x = camera->eye.x - m[0], y = camera->eye.y - m[3];
    const double u = inverse[1] * x + inverse[2] * y, v = inverse[4] * x + inverse[5] * y;
    const vd_vec3 middle = vd_vec3_add(start.at, vd_vec3_add(vd_vec3_scale(start.x, 0.5 * width),
                                                             vd_vec3_scale(start.y, 0.5 * height)));
    const vd_terrain_window *e = &map->extent;
    const int anchor_u = clamp_anchor(u + (inverse[1] * middle.x + inverse[2] * middle.y),
                                      e->column, e->column + e->columns);
    const int anchor_v =
        clamp_anchor(v + (inverse[4] * middle.x + inverse[5] * middle.y), e->row, e->row + e->rows);
    view->u = project(start, inverse[1], inverse[2], u - anchor_u);
    view->v = project(start, inverse[4], inverse[5], v - anchor_v);
    view->ut = project(direction, inverse[1], inverse[2], 0.0);
    view->vt = project(direction, inverse[4], inverse[5], 0.0);
    const double per_metre = 1.0 / def->exaggeration;
    view->w = lift(start, per_metre, camera->eye.z * per_metre);
    view->w1 = lift(direction, per_metre, 0.0);
    view->east = project(direction, 1.0, 0.0, 0.0);
    view->north = project(direction, 0.0, 1.0, 0.0);
    const double curve = def->curvature ? vd_curvature_drop(1.0) * per_metre : 0.0;
    view->curve = (float)curve;
    view->curve_t0 = (float)(2.0 * t0 * curve);
    view->curve_t0_t0 = (float)(t0 * t0 * curve);
    if (!view->orthographic) {
        const vd_lens *lens = &camera->lens;
        view->right = (vd_lens_affine){{(float)(-lens->cx / lens->fx), (float)(1.0 / lens->fx), 0}};
        view->down = (vd_lens_affine){{(float)(-lens->cy / lens->fy), 0, (float)(1.0 / lens->fy)}};
    }
    view->sine = (float)def->exaggeration;
    view->t0 = (float)t0;
    view->begin = camera->near_m > t0 ? (float)(camera->near_m - t0) : 0.0f;
    const vd_terrain_window window = def->window.columns != 0 ? def->window : *e;
    view->west = (float)(window.column - anchor_u);
    view->east_end = (float)(window.column + window.columns - anchor_u);
    view->north_end = (float)(window.row - anchor_v);
    view->south = (float)(window.row + window.rows - anchor_v);
    if (window.columns < 0) { /* beyond all rays: their part over the map is none */
        view->west = view->east_end = view->north_end = view->south = INFINITY;
    }
    const double range = (double)map->highest - map->lowest;
    view->top = map->windows ? map->top : (float)(map->highest + 1e-3 * range + 1e-3);
    make_slabs(def, camera, anchor_u, anchor_v, t0, view);
    make_margins(def, width, height, view);
    make_textures(def, camera, anchor_u, anchor_v, view);
    make_colors(def, sky, view);
    make_depth(def, camera, view);
}

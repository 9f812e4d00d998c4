/* lens_function_layout.c: which cells of an endless function a picture needs. See lens_function.h.
 */
#include <string.h>
#include "core/core.h"
#include "core/real.h"
#include "terrain/lens_function.h"

#define CELL_PIXELS 2.0 /* between T(n) and T(n + 1) cells are this to half of this wide */
#define BORDER 4        /* cells around what is seen; more than the cull grows squares by */
#define PLANES 0x1p-12  /* by this share slices reach over their planes: far more than rounding */
#define FAR_M 1e6       /* where nothing says how far ground is worth drawing */
#define HAZES 7.0
#define HEIGHTS 256.0

/* The world's coordinates over those of a map are multiples of this many cells, so that all levels
 * have samples where the world's grid does. */
#define ORIGIN 65536.0

/* A picture's four corner rays, relative to the eye, and what bounds the ground. */
typedef struct scene {
    vd_ray rays[4];
    vd_frustum frustum;
    vd_vec3 forward;
    double focal; /* pixels, or pixels a metre */
    double top;   /* metres over the eye: above all ground; may be infinite */
    double near_m, far_m;
} scene;

typedef struct box {
    double low[2], high[2]; /* x, y */
    double near_m, far_m;   /* along the view axis */
    bool empty;
} box;

static void add_point(box *b, vd_vec3 p, double t) {
    b->low[0] = p.x < b->low[0] ? p.x : b->low[0];
    b->low[1] = p.y < b->low[1] ? p.y : b->low[1];
    b->high[0] = p.x > b->high[0] ? p.x : b->high[0];
    b->high[1] = p.y > b->high[1] ? p.y : b->high[1];
    b->near_m = t < b->near_m ? t : b->near_m;
    b->far_m = t > b->far_m ? t : b->far_m;
    b->empty = false;
}

/* The part of an edge whose heights lie in [bottom, top]. */
static void add_edge(box *b, vd_vec3 from, vd_vec3 to, double t0, double t1, double bottom,
                     double top) {
    double first = 0.0, last = 1.0;
    const double rise = to.z - from.z, limits[2] = {bottom, top};
    for (int i = 0; i < 2; i++) {
        const double sign = i == 0 ? 1.0 : -1.0; /* inside: sign·(z − limit) >= 0 */
        const double at0 = sign * (from.z - limits[i]), at1 = sign * (to.z - limits[i]);
        if (at0 < 0.0 && at1 < 0.0) {
            return;
        }
        if (at0 < 0.0) {
            first = fmax(first, -at0 / (sign * rise));
        } else if (at1 < 0.0) {
            last = fmin(last, -at0 / (sign * rise));
        }
    }
    if (!(first <= last)) {
        return;
    }
    const double ends[2] = {first, last};
    for (int i = 0; i < 2; i++) {
        const vd_vec3 way = vd_vec3_subtract(to, from);
        add_point(b, vd_vec3_add(from, vd_vec3_scale(way, ends[i])), t0 + (t1 - t0) * ends[i]);
    }
}

/* What holds the frustum between two planes and two heights. A vertex of what heights cut off lies
 * on one of the slice's twelve edges. */
static box bound_slice(const scene *s, double begin, double end, double bottom, double top) {
    box b = {{INFINITY, INFINITY}, {-INFINITY, -INFINITY}, INFINITY, -INFINITY, true};
    vd_vec3 p[2][4];
    for (int i = 0; i < 4; i++) {
        p[0][i] = vd_vec3_add(s->rays[i].origin, vd_vec3_scale(s->rays[i].direction, begin));
        p[1][i] = vd_vec3_add(s->rays[i].origin, vd_vec3_scale(s->rays[i].direction, end));
    }
    for (int i = 0; i < 4; i++) {
        const int next = (i + 1) % 4;
        add_edge(&b, p[0][i], p[1][i], begin, end, bottom, top);
        add_edge(&b, p[0][i], p[0][next], begin, begin, bottom, top);
        add_edge(&b, p[1][i], p[1][next], end, end, bottom, top);
    }
    return b;
}

static void make_scene(const vd_camera *camera, int width, int height, scene *s) {
    static const int corners[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    vd_camera here = *camera;
    here.eye = (vd_vec3){0.0, 0.0, 0.0};
    for (int i = 0; i < 4; i++) {
        s->rays[i] = vd_camera_ray(&here, corners[i][0] * width, corners[i][1] * height);
    }
    s->frustum = vd_camera_frustum(&here, width, height);
    s->forward = vd_quat_rotate(camera->orientation, vd_vec3_make(0.0, 0.0, 1.0));
    s->focal = sqrt(camera->lens.fx * camera->lens.fy);
    s->near_m = camera->near_m;
}

/* Heights over a rectangle around the eye. */
static void bound_heights(const vd_terrain_def *def, vd_vec3 eye, const box *b, double *low,
                          double *high) {
    float min, max;
    vd_function_bounds(def->function, (float)(eye.x + b->low[0]), (float)(eye.x + b->high[0]),
                       (float)(eye.y + b->low[1]), (float)(eye.y + b->high[1]), &min, &max);
    *low = min <= max ? (double)min * def->exaggeration : -INFINITY;
    *high = min <= max ? (double)max * def->exaggeration : INFINITY;
}

/* How far ground between two heights over the eye is worth drawing. */
static double choose_far(const vd_terrain_def *def, const vd_camera *camera, double focal,
                         double low, double high) {
    if (def->far_m > 0.0) {
        return def->far_m;
    }
    if (camera->projection == VD_PROJECTION_ORTHOGRAPHIC) {
        return camera->far_m;
    }
    const double height = fmax(fabs(low), fabs(high));
    const double most = fmax(FAR_M, isfinite(low) ? HEIGHTS * fabs(low) : 0.0);
    double far_m = fmin(2.0 * focal * height, most);
    if (def->light.haze_m > 0.0) {
        far_m = fmin(far_m, fmax(HAZES * def->light.haze_m, HEIGHTS * height));
    }
    if (def->curvature && isfinite(height)) {
        const double k = vd_curvature_drop(1.0);
        far_m = fmin(far_m, sqrt(fmax(-low, 0.0) / k) + sqrt((high - low) / k));
    }
    return fmax(far_m, 4.0 * fmax(def->cell_m, camera->near_m));
}

/* Finds out between which heights and distances the picture shows ground. */
static void bound_ground(const vd_lens_function *f, const vd_terrain_def *def,
                         const vd_camera *camera, scene *s, vd_lens_map *map) {
    double low, high;
    double most = def->far_m > 0.0 ? def->far_m : FAR_M;
    if (camera->projection == VD_PROJECTION_ORTHOGRAPHIC && !(def->far_m > 0.0)) {
        most = camera->far_m;
    }
    box all = bound_slice(s, s->near_m, most, -INFINITY, INFINITY);
    bound_heights(def, f->eye, &all, &low, &high);
    double far_m = choose_far(def, camera, s->focal, low - f->eye.z, high - f->eye.z);
    /* Of what is seen, bounds may be tighter, or with a longer way wider. */
    all = bound_slice(s, s->near_m, fmax(far_m, s->near_m), -INFINITY, INFINITY);
    bound_heights(def, f->eye, &all, &low, &high);
    const double margin = 2e-3 * (high - low) + 2e-3 * (1.0 + def->exaggeration);
    const double drop = f->curve * far_m * far_m;
    const bool finite = isfinite(low) && isfinite(high) && high - low < 1e30;
    s->top = finite ? high + margin - f->eye.z : INFINITY;
    const double bottom = finite ? low - margin - f->eye.z - drop : -INFINITY;
    const double end = fmax(far_m, s->near_m);
    const box ground = bound_slice(s, s->near_m, end, bottom, s->top);
    s->far_m = ground.empty ? s->near_m : fmin(end, ground.far_m * (1.0 + PLANES));
    map->nearest = ground.empty ? 0.0 : ground.near_m * (1.0 - PLANES);
    map->far_m = s->far_m;
    const double per_metre = 1.0 / def->exaggeration;
    const double range = (high - low) * per_metre;
    map->top = finite ? (float)(high * per_metre + 1e-3 * range + 1e-3) : 1e30f;
}

static void make_slice(const scene *s, double begin, double end, vd_lens_slice *out) {
    memcpy(out->planes, s->frustum.planes, 4 * sizeof out->planes[0]);
    out->planes[4] = (vd_plane){s->forward, begin};
    out->planes[5] = (vd_plane){vd_vec3_scale(s->forward, -1.0), -end};
}

/* The window of one level. Returns false when its cells are too many to be counted. */
static bool make_window(const vd_lens_function *f, const box *b, int level, vd_lens_ground *g) {
    *g = (vd_lens_ground){.columns = 1, .rows = 1};
    const double cell = f->cell * (double)(1 << level);
    const double x = f->eye.x - f->first_column * f->cell, y = -f->eye.y - f->first_row * f->cell;
    const double edges[4] = {
        floor((x + b->low[0]) / cell) - BORDER, floor((y - b->high[1]) / cell) - BORDER,
        ceil((x + b->high[0]) / cell) + BORDER, ceil((y - b->low[1]) / cell) + BORDER};
    const double most = 0x1p29 / (double)(1 << level);
    for (int i = 0; i < 4 && !b->empty; i++) {
        if (!(fabs(edges[i]) < most)) {
            return false;
        }
    }
    if (!b->empty) {
        g->column = (int32_t)edges[0];
        g->row = (int32_t)edges[1];
        g->columns = (int32_t)edges[2] - g->column;
        g->rows = (int32_t)edges[3] - g->row;
    }
    return true;
}

static size_t level_samples(const vd_lens_ground *g) {
    return vd_row_stride((size_t)g->columns + 1, sizeof(float)) * ((size_t)g->rows + 1);
}

/* Slices and windows of all levels. `count` is set to their samples; returns false when a window
 * cannot be counted. */
static bool make_windows(vd_lens_function *f, const scene *s, vd_lens_map *map, double first,
                         size_t *count) {
    *count = 0;
    for (int n = 0; n < map->levels; n++) {
        const double begin = n == 0 ? s->near_m : first * ldexp(1.0, n);
        const double end = n + 1 == map->levels ? s->far_m : first * ldexp(1.0, n + 1);
        const double a = begin * (1.0 - PLANES);
        const double z = fmax(end, begin) * (1.0 + PLANES);
        make_slice(s, a, z, &f->slices[n]);
        box b = bound_slice(s, a, z, -INFINITY, s->top);
        b.empty = b.empty || !(s->near_m < s->far_m) || !(begin < s->far_m);
        if (!make_window(f, &b, n, &map->ground[n])) {
            return false;
        }
        *count += level_samples(&map->ground[n]);
    }
    return true;
}

/* Chooses the cells: level 0's, how many levels, and how wide they are in pixels. */
static bool choose_cells(vd_lens_function *f, const vd_terrain_def *def, const scene *s,
                         vd_lens_map *map) {
    const bool levels = def->mip && f->perspective;
    map->cell_pixels = CELL_PIXELS;
    int coarser = 0;
    while (def->mip && !f->perspective &&
           def->cell_m * ldexp(s->focal, coarser + 1) <= CELL_PIXELS) {
        coarser++; /* one distance for all */
    }
    for (int attempt = 0; attempt < 128; attempt++) {
        f->cell = ldexp(def->cell_m, coarser);
        f->first_column = floor(f->eye.x / f->cell / ORIGIN) * ORIGIN;
        f->first_row = floor(-f->eye.y / f->cell / ORIGIN) * ORIGIN;
        const double first = f->cell * s->focal / map->cell_pixels;
        map->levels = 1;
        while (levels && map->levels < VD_LENS_FUNCTION_LEVELS &&
               first * ldexp(1.0, map->levels) < s->far_m) {
            map->levels++;
        }
        size_t count = 0;
        const bool all = !levels || first * ldexp(1.0, map->levels) >= s->far_m;
        const bool countable = make_windows(f, s, map, first, &count);
        if (all && countable && count <= VD_LENS_FUNCTION_SAMPLES) {
            return true;
        }
        if (all && countable && levels) {
            map->cell_pixels *= 2.0;
        } else {
            coarser++;
        }
    }
    return false;
}

/* ---- memory -----------------------------------------------------------------------------------
 */

static int32_t blocks(int32_t cells, int level) {
    return (cells + (1 << level) - 1) >> level;
}

/* Offsets of a level's blocks from `at` on; returns where they end. */
static size_t lay_out_maxima(vd_lens_ground *g, size_t at) {
    size_t here = 0;
    g->top = 0;
    while (g->top + 1 < VD_LENS_TABLE && (g->columns - 1) >> g->top | (g->rows - 1) >> g->top) {
        const int r = ++g->top;
        g->offset[r] = (int32_t)here;
        g->pitch[r] = (int32_t)vd_row_stride((size_t)blocks(g->columns, r) + 1, sizeof(float));
        here += (size_t)g->pitch[r] * (size_t)blocks(g->rows, r);
    }
    return at + here + 64 / sizeof(float); /* the march loads pairs */
}

/* Makes map->memory[i] hold at least `bytes`. What it held is lost when it grows. */
static vd_status reserve(vd_lens_function *f, vd_lens_map *map, int i, size_t bytes) {
    if (bytes <= f->rooms[i]) {
        return vd_success();
    }
    vd_release(f->context, map->memory[i]);
    map->memory[i] = vd_allocate(f->context, bytes, 1);
    f->rooms[i] = map->memory[i] == NULL ? 0 : bytes;
    return map->memory[i] == NULL ? vd_out_of_memory("the windows of a function", bytes)
                                  : vd_success();
}

static vd_status lay_out_memory(vd_lens_function *f, vd_lens_map *map) {
    size_t heights[VD_LENS_FUNCTION_LEVELS], maxima[VD_LENS_FUNCTION_LEVELS];
    size_t texels[VD_LENS_FUNCTION_LEVELS], height_count = 0, maxima_count = 0, texel_count = 0;
    size_t tile_count = 0;
    for (int n = 0; n < map->levels; n++) {
        vd_lens_ground *g = &map->ground[n];
        vd_lens_texture *t = &map->texture[n];
        g->stride = vd_row_stride((size_t)g->columns + 1, sizeof(float));
        heights[n] = height_count;
        height_count += level_samples(g);
        maxima[n] = maxima_count;
        maxima_count = lay_out_maxima(g, maxima_count);
        *t = (vd_lens_texture){.stride = (int32_t)vd_row_stride((size_t)g->columns + 3, 4),
                               .width = g->columns + 1,
                               .height = g->rows + 1,
                               .column = g->column,
                               .row = g->row};
        texels[n] = texel_count + (size_t)t->stride + 1;
        texel_count += (size_t)t->stride * ((size_t)t->height + 2);
        f->tile_offset[n] = tile_count;
        tile_count += (size_t)(g->columns / VD_LENS_FUNCTION_TILE + 1) *
                      (size_t)(g->rows / VD_LENS_FUNCTION_TILE + 1);
    }
    const size_t bytes[4] = {height_count * 4, maxima_count * 4, texel_count * 4, tile_count};
    for (int i = 0; i < 4; i++) {
        const vd_status status = reserve(f, map, i, bytes[i]);
        if (status.code != VD_OK) {
            return status;
        }
    }
    for (int n = 0; n < map->levels; n++) {
        map->ground[n].heights = (const float *)map->memory[0] + heights[n];
        map->ground[n].maxima = (const float *)map->memory[1] + maxima[n];
        map->texture[n].texels = (const uint32_t *)map->memory[2] + texels[n];
    }
    f->tiles = map->memory[3];
    return vd_success();
}

/* The cells of level 0 that hold all windows. */
static vd_terrain_window whole_extent(const vd_lens_map *map) {
    int32_t low[2] = {INT32_MAX, INT32_MAX}, high[2] = {INT32_MIN, INT32_MIN};
    for (int n = 0; n < map->levels; n++) {
        const vd_lens_ground *g = &map->ground[n];
        const int32_t size = 1 << n;
        const int32_t first[2] = {g->column * size, g->row * size};
        const int32_t end[2] = {first[0] + g->columns * size, first[1] + g->rows * size};
        for (int i = 0; i < 2; i++) {
            low[i] = first[i] < low[i] ? first[i] : low[i];
            high[i] = end[i] > high[i] ? end[i] : high[i];
        }
    }
    return (vd_terrain_window){low[0], low[1], high[0] - low[0], high[1] - low[1]};
}

vd_status vd_lens_function_lay_out(vd_lens_function *f, const vd_terrain_def *def,
                                   const vd_camera *camera, int width, int height,
                                   vd_lens_map *map) {
    scene s;
    f->eye = camera->eye;
    f->perspective = camera->projection == VD_PROJECTION_PERSPECTIVE;
    f->curve = def->curvature ? vd_curvature_drop(1.0) : 0.0;
    map->context = f->context;
    map->windows = true;
    const double away = fmax(fabs(f->eye.x), fabs(f->eye.y));
    if (!(away < 0x1p50 * def->cell_m)) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "the camera stands %g m from the origin, too far for the function's "
                          "cells of %g m; bring it nearer or make cells larger",
                          away, def->cell_m);
    }
    make_scene(camera, width, height, &s);
    bound_ground(f, def, camera, &s, map);
    if (!choose_cells(f, def, &s, map)) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "the picture shows more of the function than can be sampled; give a "
                          "narrower view or a nearer far distance");
    }
    static const double at_samples[6] = {0.0, 1.0, 0.0, 0.0, 0.0, 1.0};
    const double world[6] = {f->first_column * f->cell, f->cell, 0.0,
                             -f->first_row * f->cell,   0.0,     -f->cell};
    memcpy(map->texture_from_sample, at_samples, sizeof at_samples);
    memcpy(map->world_from_sample, world, sizeof world);
    map->textures = map->levels;
    map->extent = whole_extent(map);
    return lay_out_memory(f, map);
}

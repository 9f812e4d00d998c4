/* sun_map.c: the map as memory, and how it is drawn. Looking up is in sun_map_share.c. */
#include "world/sun_map.h"
#include <math.h>
#include <string.h>
#include <xxhash.h>
#include "core/core.h"
#include "image/image.h"
#include "raster/raster_run.h"
#include "raster/raster_internal.h"

#define TILE 256
#define BATCH_VERTICES ((size_t)1 << 20) /* 16 bytes each */
#define TEXELS_A_CASTER 24.0
#define BORDER 4 /* empty texels around the casters: a look-up near the edge needs no test */

/* ---- memory ---------------------------------------------------------------------------------- */

vd_status vd_sun_map_create(vd_context *context, vd_sun_map **out) {
    vd_sun_map *map = vd_allocate_zero(context, 1, sizeof *map);
    if (map == NULL) {
        return vd_out_of_memory("a map of shadows", sizeof *map);
    }
    map->context = context;
    const int threads = vd_context_threads(context);
    map->targets = vd_allocate_zero(context, (size_t)threads, sizeof *map->targets);
    vd_status status = map->targets == NULL
                           ? vd_out_of_memory("a map of shadows", (size_t)threads * sizeof(void *))
                           : vd_raster_create(context, &map->raster);
    if (status.code == VD_OK) {
        status = vd_frame_create(context, 1, 1, 0, &map->frame);
    }
    for (int i = 0; i < threads && status.code == VD_OK; i++) {
        status = vd_target_create(context, TILE, TILE, 1, &map->targets[i]);
    }
    if (status.code != VD_OK) {
        vd_sun_map_destroy(&map);
        return status;
    }
    *out = map;
    return status;
}

void vd_sun_map_destroy(vd_sun_map **map_in_out) {
    vd_sun_map *map = map_in_out != NULL ? *map_in_out : NULL;
    if (map == NULL) {
        return;
    }
    *map_in_out = NULL;
    for (int i = 0; map->targets != NULL && i < vd_context_threads(map->context); i++) {
        vd_target_destroy(&map->targets[i]);
    }
    vd_release(map->context, map->targets);
    vd_frame_destroy(&map->frame);
    vd_raster_destroy(&map->raster);
    vd_release(map->context, map->texels.memory);
    vd_release(map->context, map->blocks.memory);
    vd_release(map->context, map->draws.data);
    vd_release(map->context, map->materials.data);
    vd_release(map->context, map);
}

static vd_status reserve_texels(vd_sun_map *map, int side, bool bottom) {
    const size_t stride = vd_row_stride((size_t)side, sizeof(float));
    const size_t texels = stride * (size_t)side;
    const size_t blocks = (size_t)(side / VD_SUN_MAP_BLOCK) * (size_t)(side / VD_SUN_MAP_BLOCK);
    vd_status status = vd_buffer_reserve(map->context, &map->texels, "a map of shadows", texels,
                                         sizeof(float) * (bottom ? 2 : 1) + 1);
    if (status.code == VD_OK) {
        status = vd_buffer_reserve(map->context, &map->blocks, "a map of shadows", blocks,
                                   sizeof(float));
    }
    if (status.code == VD_OK) {
        map->stride = stride;
        map->top = map->texels.memory;
        map->bottom = bottom ? map->top + texels : NULL;
        map->alpha = (uint8_t *)(map->top + (bottom ? 2 : 1) * texels);
        map->highest = map->blocks.memory;
    }
    return status;
}

/* ---- what throws shadows --------------------------------------------------------------------- */

static bool throws(const vd_draw *draw) {
    return draw->mesh->topology == VD_TOPOLOGY_TRIANGLES && draw->fill == VD_FILL_SOLID &&
           draw->mesh->primitive_count > 0;
}

static bool blends(const vd_draw *draw) {
    bool any = false;
    for (int i = 0; i < draw->material_count; i++) {
        any = any || draw->materials[i].blend;
    }
    return any;
}

/* Leaves a fragment's alpha in its red. */
static void leave_alpha(const vd_fragments *f) {
    float albedo[3][VD_BATCH] __attribute__((aligned(64)));
    vd_surface_albedo(f, 0, albedo);
    for (int i = 0; i < VD_BATCH; i++) {
        f->color[0][i] = f->color[3][i];
        f->color[1][i] = f->color[2][i] = 0.0f;
    }
}

static const vd_shader alpha_shader = {.fragment = leave_alpha,
                                       .inputs = VD_INPUT_UV | VD_INPUT_DERIVATIVES};
static const vd_shader depth_shader = {.fragment = NULL};

/* Copies a draw's materials, those that blend as ones with holes where nothing of them is seen. */
static vd_status copy_materials(vd_sun_map *map, vd_draw *draw) {
    vd_material *to =
        vd_list_add(map->context, &map->materials, (size_t)draw->material_count, sizeof *to);
    if (to == NULL) {
        return vd_out_of_memory("the materials of what throws shadows", sizeof *to);
    }
    for (int i = 0; i < draw->material_count; i++) {
        to[i] = draw->materials[i];
        if (to[i].blend) {
            to[i].blend = false;
            to[i].alpha_test = to[i].alpha_test > 1.0f / 255.0f ? to[i].alpha_test : 1.0f / 255.0f;
        }
    }
    return vd_success();
}

static vd_status gather(vd_sun_map *map, const vd_draw *draws, int count) {
    map->draws.count = map->materials.count = 0;
    for (int i = 0; i < count; i++) {
        if (!throws(&draws[i])) {
            continue;
        }
        vd_draw *to = vd_list_add(map->context, &map->draws, 1, sizeof *to);
        if (to == NULL) {
            return vd_out_of_memory("what throws shadows", sizeof *to);
        }
        *to = draws[i];
        to->cull = VD_CULL_NONE;
        to->object_id = 1;
        to->uniforms = NULL;
        to->shader = blends(to) ? &alpha_shader : &depth_shader;
        vd_status status = to->shader == &alpha_shader ? copy_materials(map, to) : vd_success();
        if (status.code != VD_OK) {
            return status;
        }
    }
    /* The list of materials stands still now. */
    vd_draw *gathered = map->draws.data;
    const vd_material *materials = map->materials.data;
    for (size_t i = 0; i < map->draws.count; i++) {
        if (gathered[i].shader == &alpha_shader) {
            gathered[i].materials = materials;
            materials += gathered[i].material_count;
        }
    }
    return vd_success();
}

/* What tells one map from another. */
static uint64_t hash_of(vd_vec3 sun, const vd_draw *draws, int count, vd_vec3 min, vd_vec3 max) {
    const vd_vec3 head[3] = {sun, min, max};
    uint64_t hash = XXH64(head, sizeof head, (uint64_t)count);
    for (int i = 0; i < count; i++) {
        const void *pointers[2] = {draws[i].mesh, draws[i].materials};
        const int numbers[2] = {draws[i].material_count, (int)draws[i].fill};
        hash = XXH64(pointers, sizeof pointers, hash);
        hash = XXH64(numbers, sizeof numbers, hash);
        hash = XXH64(&draws[i].world_from_mesh, sizeof draws[i].world_from_mesh, hash);
    }
    return hash != 0 ? hash : 1; /* 0: empty */
}

/* ---- where the map lies ---------------------------------------------------------------------- */

/* A number's multiple of 2^−10 below, a little wide of it: moving the world by such a multiple may
 * round the number, and must not change the outcome. */
static double below(double x) {
    return floor(x * 1024.0 - 0.0625) * 0x1p-10;
}

static vd_vec3 grid(vd_vec3 v) {
    return vd_vec3_make(floor(v.x * 1024.0 + 0.5) * 0x1p-10, floor(v.y * 1024.0 + 0.5) * 0x1p-10,
                        floor(v.z * 1024.0 + 0.5) * 0x1p-10);
}

/* How large a draw is, metres: the diagonal of its box. */
static double size_of(const vd_draw *draw) {
    const vd_mesh *mesh = draw->mesh;
    double squares = 0.0;
    for (int r = 0; r < 3; r++) {
        double side = 0.0;
        for (int c = 0; c < 3; c++) {
            side += fabs(draw->world_from_mesh.m[r][c]) * ((double)mesh->max[c] - mesh->min[c]);
        }
        squares += side * side;
    }
    return sqrt(squares);
}

static int choose_side(const vd_sun_map *map, double extent) {
    const vd_draw *draws = map->draws.data;
    double sum = 0.0;
    for (size_t i = 0; i < map->draws.count; i++) {
        sum += size_of(&draws[i]);
    }
    const double wanted = extent * TEXELS_A_CASTER * (double)map->draws.count;
    int side = VD_SUN_MAP_LEAST;
    while (side < VD_SUN_MAP_MOST && side * sum < wanted) {
        side *= 2;
    }
    return side;
}

typedef struct sun_views {
    vd_camera above, below;
    double above_m, below_m; /* of the eyes, over the plane */
} sun_views;

/* Axes across the sun's rays: right, down (as the sun's picture has them) and along the rays. */
static void aim(vd_sun_map *map, vd_vec3 sun, vd_vec3 axes[3]) {
    vd_vec3 right = vd_vec3_make(-sun.y, sun.x, 0.0);
    right = vd_vec3_dot(right, right) > 1e-12 ? vd_vec3_normalize(right) : vd_vec3_make(1, 0, 0);
    const vd_vec3 along = vd_vec3_scale(sun, -1.0);
    axes[0] = right;
    axes[1] = vd_vec3_normalize(vd_vec3_cross(along, right));
    axes[2] = along;
    map->sun = sun;
}

/* Lays the map over the box [0, size] from its origin: from above through the one camera and from
 * below through the other, whose rows are the first one's from the last on. */
static void lay_out(vd_sun_map *map, vd_vec3 size, const vd_vec3 axes[3], sun_views *views) {
    double least[3] = {0, 0, 0}, most[3] = {0, 0, 0};
    for (int i = 1; i < 8; i++) {
        const vd_vec3 corner = {(i & 1) != 0 ? size.x : 0.0, (i & 2) != 0 ? size.y : 0.0,
                                (i & 4) != 0 ? size.z : 0.0};
        for (int k = 0; k < 3; k++) {
            const double x = vd_vec3_dot(axes[k], corner);
            least[k] = x < least[k] ? x : least[k];
            most[k] = x > most[k] ? x : most[k];
        }
    }
    const double width = most[0] - least[0], height = most[1] - least[1];
    const double extent = width > height ? width : height;
    map->side = choose_side(map, extent);
    const double texel = (double)(float)(extent / (map->side - 2 * BORDER)), scale = 1.0 / texel;
    const double reach = vd_vec3_length(size) + 1.0;
    const vd_vec3 middle = vd_vec3_scale(size, 0.5);
    const vd_vec3 sun = map->sun;
    const vd_vec3 up = grid(vd_vec3_add(middle, vd_vec3_scale(sun, reach)));
    const vd_vec3 down = grid(vd_vec3_subtract(middle, vd_vec3_scale(sun, reach)));
    map->texel_m = (float)texel;
    for (int k = 0; k < 2; k++) {
        map->at_exact[k] = BORDER - least[k] * scale;
    }
    map->at_exact[2] = 0.0;
    for (int k = 0; k < 3; k++) {
        const double s = k < 2 ? scale : -1.0; /* height: against the rays */
        const double row[3] = {axes[k].x * s, axes[k].y * s, axes[k].z * s};
        for (int c = 0; c < 3; c++) {
            map->axes_exact[k][c] = row[c];
            map->axes[k][c] = (float)row[c];
        }
        map->at[k] = (float)map->at_exact[k];
    }
    vd_camera camera = {.projection = VD_PROJECTION_ORTHOGRAPHIC, .near_m = 0x1p-10};
    camera.far_m = 2.0 * reach + 1.0;
    camera.eye = vd_vec3_add(map->origin, up);
    camera.orientation = vd_quat_from_axes(axes[0], axes[1], axes[2]);
    camera.lens = (vd_lens){scale, scale, map->at_exact[0] + vd_vec3_dot(axes[0], up) * scale,
                            map->at_exact[1] + vd_vec3_dot(axes[1], up) * scale};
    views->above = camera;
    views->above_m = vd_vec3_dot(sun, up);
    camera.eye = vd_vec3_add(map->origin, down);
    camera.orientation = vd_quat_from_axes(axes[0], vd_vec3_scale(axes[1], -1.0), sun);
    camera.lens.cx = map->at_exact[0] + vd_vec3_dot(axes[0], down) * scale;
    camera.lens.cy = map->side - (map->at_exact[1] + vd_vec3_dot(axes[1], down) * scale);
    views->below = camera;
    views->below_m = vd_vec3_dot(sun, down);
}

/* ---- drawing --------------------------------------------------------------------------------- */

typedef struct pass {
    vd_sun_map *map;
    const vd_camera *camera;
    double eye_m;
    bool below;
    bool first; /* nothing was drawn before */
} pass;

/* The first texel of a row of a tile. From below the rows come from the last on. */
static size_t row_of(const pass *p, const vd_target *tile, int y) {
    const int row = p->below ? p->map->side - 1 - (tile->y + y) : tile->y + y;
    return (size_t)row * p->map->stride + (size_t)tile->x;
}

static void clear(const pass *p, const vd_target *tile) {
    for (int y = 0; y < tile->height; y++) {
        const size_t at = row_of(p, tile, y);
        float *heights = (p->below ? p->map->bottom : p->map->top) + at;
        for (int x = 0; x < tile->width; x++) {
            heights[x] = -INFINITY;
        }
        if (!p->below) {
            memset(p->map->alpha + at, 0, (size_t)tile->width);
        }
    }
}

static void keep_top(const pass *p, const vd_target *tile) {
    const double far = p->camera->far_m;
    for (int y = 0; y < tile->height; y++) {
        const float *depth = tile->depth + (size_t)y * tile->stride;
        const uint16_t *color = tile->color + 4 * (size_t)y * tile->stride;
        float *top = p->map->top + row_of(p, tile, y);
        uint8_t *alpha = p->map->alpha + row_of(p, tile, y);
        for (int x = 0; x < tile->width; x++) {
            const float height = (float)(p->eye_m - (1.0 - (double)depth[x]) * far);
            if (depth[x] > 0.0f && height > top[x]) {
                /* What was drawn without a fragment function is solid, and has no colour. */
                const uint16_t *c = color + 4 * x;
                top[x] = height;
                alpha[x] = c[3] == 0 ? 255 : (uint8_t)(c[0] >> 8);
            }
        }
    }
}

static void keep_bottom(const pass *p, const vd_target *tile) {
    const double far = p->camera->far_m;
    for (int y = 0; y < tile->height; y++) {
        const float *depth = tile->depth + (size_t)y * tile->stride;
        float *bottom = p->map->bottom + row_of(p, tile, y);
        for (int x = 0; x < tile->width; x++) {
            const float height = (float)(p->eye_m + (1.0 - (double)depth[x]) * far);
            const bool lower = bottom[x] == -INFINITY || height < bottom[x];
            bottom[x] = depth[x] > 0.0f && lower ? height : bottom[x];
        }
    }
}

static void draw_tile(void *user, int index, int worker) {
    static const uint16_t nothing[4] = {0, 0, 0, 0};
    const pass *p = user;
    const int across = p->map->side / TILE;
    bool any_blends;
    vd_target *target = p->map->targets[worker];
    target->x = index % across * TILE;
    target->y = index / across * TILE;
    if (p->first) {
        clear(p, target);
    }
    if (vd_raster_window_any(p->map->raster, target, &any_blends)) {
        vd_target_clear(target, nothing);
        vd_raster_draw(p->map->raster, target, worker);
        (p->below ? keep_bottom : keep_top)(p, target);
    }
}

/* Where the casters end that are drawn with the one at `from`: the rasterizer keeps the vertices of
 * all that it draws at once. */
static size_t next_batch(const vd_sun_map *map, size_t from) {
    const vd_draw *draws = map->draws.data;
    size_t vertices = 0, to = from;
    while (to < map->draws.count && (to == from || vertices < BATCH_VERTICES)) {
        vertices += draws[to++].mesh->vertex_count;
    }
    return to;
}

static vd_status draw_side(vd_sun_map *map, vd_job *job, const sun_views *views, bool from_below) {
    pass p = {.map = map, .below = from_below, .first = true};
    p.camera = from_below ? &views->below : &views->above;
    p.eye_m = from_below ? views->below_m : views->above_m;
    const vd_raster_def def = vd_raster_def_default();
    const int across = map->side / TILE;
    const vd_draw *draws = map->draws.data;
    vd_status status = vd_success();
    for (size_t from = 0; from < map->draws.count && status.code == VD_OK; p.first = false) {
        const size_t to = next_batch(map, from);
        /* Only its size and its table of ids are looked at. */
        map->frame->width = map->frame->height = map->side;
        status = vd_raster_prepare(map->raster, job, &def, p.camera, draws + from, (int)(to - from),
                                   map->frame);
        map->frame->width = map->frame->height = 1;
        if (status.code == VD_OK) {
            status = vd_parallel_for(map->context, job, across * across, draw_tile, &p);
        }
        from = to;
    }
    return status;
}

static void find_highest(vd_sun_map *map) {
    const int blocks = map->side / VD_SUN_MAP_BLOCK;
    map->highest_of_all = -INFINITY;
    for (int i = 0; i < blocks * blocks; i++) {
        const int x0 = i % blocks * VD_SUN_MAP_BLOCK - 2, y0 = i / blocks * VD_SUN_MAP_BLOCK - 2;
        const int x1 = x0 + VD_SUN_MAP_BLOCK + 4, y1 = y0 + VD_SUN_MAP_BLOCK + 4;
        float highest = -INFINITY;
        for (int y = y0 > 0 ? y0 : 0; y < y1 && y < map->side; y++) {
            for (int x = x0 > 0 ? x0 : 0; x < x1 && x < map->side; x++) {
                const float top = map->top[(size_t)y * map->stride + (size_t)x];
                highest = top > highest ? top : highest;
            }
        }
        map->highest[i] = highest;
        map->highest_of_all = highest > map->highest_of_all ? highest : map->highest_of_all;
    }
}

vd_status vd_sun_map_draw(vd_sun_map *map, vd_job *job, vd_vec3 sun, const vd_draw *draws,
                          int count, vd_vec3 min, vd_vec3 max) {
    const uint64_t hash = hash_of(sun, draws, count, min, max);
    if (hash == map->drawn) {
        return vd_success();
    }
    map->drawn = 0;
    map->side = 0;
    vd_status status = gather(map, draws, count);
    const bool box = min.x <= max.x && min.y <= max.y && min.z <= max.z;
    if (status.code == VD_OK && sun.z > 0.0 && map->draws.count > 0 && box) {
        sun_views views;
        vd_vec3 axes[3];
        map->origin = vd_vec3_make(below(min.x), below(min.y), below(min.z));
        const vd_vec3 end = vd_vec3_make(-below(-max.x), -below(-max.y), -below(-max.z));
        aim(map, sun, axes);
        lay_out(map, vd_vec3_subtract(end, map->origin), axes, &views);
        const bool bottom = map->materials.count > 0;
        status = reserve_texels(map, map->side, bottom);
        if (status.code == VD_OK) {
            status = draw_side(map, job, &views, false);
        }
        if (status.code == VD_OK && bottom) {
            status = draw_side(map, job, &views, true);
        }
        if (status.code == VD_OK) {
            find_highest(map);
        }
        map->redraw++;
    }
    map->side = status.code == VD_OK ? map->side : 0;
    map->drawn = status.code == VD_OK ? hash : 0;
    return status;
}

/* lens_map_layout.c: shapes and memory of a lens map, and the constants of its light. */
#include <string.h>
#include "core/core.h"
#include "core/real.h"
#include "terrain/heightfield_block.h"
#include "terrain/lens_map_internal.h"

#define MAX_FACTOR 8
#define MAX_TEXTURE_SIDE 131072 /* its 18 halvings are VD_LENS_TEXTURES sizes */

/* Cells of a level along an axis. */
static int32_t cells(int samples, int level) {
    const int32_t all = samples - 1;
    const int32_t n = (int32_t)((all + ((int64_t)1 << level) - 1) >> level);
    return n > 1 ? n : 1;
}

/* Rows one behind the other, but not a multiple of 1 KiB apart: neighbours would share cache sets.
 * Whole cache lines a row would take 2.22 times the bytes of heights and colours at 1024². */
static size_t row_stride(size_t elements) {
    return elements % 256 == 0 ? elements + 1 : elements;
}

static size_t lay_out_heights(vd_lens_map *map, size_t offset[VD_LENS_LEVELS]) {
    size_t at = 0;
    int level = 0;
    do {
        vd_lens_ground *g = &map->ground[level];
        g->columns = cells(map->width, level);
        g->rows = cells(map->height, level);
        if (level > 0) {
            g->stride = row_stride((size_t)g->columns + 1);
            offset[level] = at;
            at += g->stride * ((size_t)g->rows + 1);
        }
        level++;
    } while (level < VD_LENS_LEVELS &&
             (map->ground[level - 1].columns > 1 || map->ground[level - 1].rows > 1));
    map->levels = level;
    return at;
}

/* M(m) is one table; level l's blocks of 2^r cells are M(l + r). */
static size_t lay_out_maxima(vd_lens_map *map) {
    size_t offset[VD_LENS_LEVELS], pitch[VD_LENS_LEVELS], at = 0;
    for (int m = 1; m < map->levels; m++) {
        offset[m] = at;
        pitch[m] = row_stride((size_t)map->ground[m].columns);
        at += pitch[m] * (size_t)map->ground[m].rows;
    }
    for (int l = 0; l < map->levels; l++) {
        vd_lens_ground *g = &map->ground[l];
        const int above = map->levels - 1 - l;
        g->top = above < VD_LENS_TABLE ? above : VD_LENS_TABLE - 1;
        for (int r = 1; r <= g->top; r++) {
            g->offset[r] = (int32_t)offset[l + r];
            g->pitch[r] = (int32_t)pitch[l + r];
        }
    }
    return at;
}

/* The smallest whole number of texels per colour pixel that makes a texel no larger than the
 * spacing of samples; smaller where the texture would become too large. */
static int texture_factor(const vd_heightfield *h) {
    const double *c = h->color_from_sample;
    const double a = sqrt(c[1] * c[1] + c[4] * c[4]), b = sqrt(c[2] * c[2] + c[5] * c[5]);
    const double pixels = (a < b ? a : b) * (1.0 + 1e-9); /* per sample */
    int k = 1;
    while (k < MAX_FACTOR && k * pixels < 1.0) {
        k++;
    }
    const double w = h->color_width, r = h->color_height;
    while (k > 1 && (w * k > MAX_TEXTURE_SIDE || r * k > MAX_TEXTURE_SIDE ||
                     w * k * r * k > (double)VD_MAX_PIXELS)) {
        k--;
    }
    return k;
}

static size_t lay_out_textures(const vd_heightfield *h, vd_lens_map *map,
                               size_t offset[VD_LENS_TEXTURES]) {
    static const double at_samples[6] = {0.5, 1.0, 0.0, 0.5, 0.0, 1.0};
    memcpy(map->texture_from_sample, at_samples, sizeof at_samples);
    int32_t width = map->width, height = map->height;
    if (h->color_width > 0) {
        const int k = texture_factor(h);
        for (int i = 0; i < 6; i++) {
            map->texture_from_sample[i] = k * h->color_from_sample[i];
        }
        width = k * h->color_width;
        height = k * h->color_height;
    }
    size_t at = 0;
    int size = 0;
    for (;; size++) {
        vd_lens_texture *t = &map->texture[size];
        const size_t stride = row_stride((size_t)width + 2);
        t->width = width;
        t->height = height;
        t->stride = (int32_t)stride;
        offset[size] = at + stride + 1;
        at += stride * ((size_t)height + 2);
        if (width == 1 && height == 1) {
            break;
        }
        width = (width + 1) / 2;
        height = (height + 1) / 2;
    }
    map->textures = size + 1;
    return at;
}

/* Fails with VD_ERROR_ARGUMENT when the heightfield is not drawable: not float, less than a cell,
 * or its world_from_sample is singular; else inverts that. */
static vd_status check_ground(const vd_heightfield *h, double sample_from_world[6]) {
    if (h->height_type != VD_HEIGHT_F32) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "the heightfield has %s heights; the lens methods draw "
                          "float heights, so create it as VD_HEIGHT_F32",
                          h->height_type == VD_HEIGHT_U8 ? "8-bit" : "16-bit");
    }
    if (h->width < 2 || h->height < 2) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "the heightfield has %d × %d samples; a surface needs at least 2 × 2",
                          h->width, h->height);
    }
    if (!vd_heightfield_invert(h->world_from_sample, sample_from_world)) {
        return vd_failure(VD_ERROR_ARGUMENT, "the heightfield's world_from_sample is singular; its "
                                             "columns and rows must span an area");
    }
    return vd_success();
}

vd_status vd_lens_map_lay_out(vd_context *context, const vd_terrain_def *def, vd_lens_map *out) {
    const vd_heightfield *h = def->heightfield;
    double inverse[6];
    const vd_status status = check_ground(h, inverse);
    if (status.code != VD_OK) {
        return status;
    }
    if (h->color_width > 0 && !vd_heightfield_invert(h->color_from_sample, inverse)) {
        return vd_failure(VD_ERROR_ARGUMENT, "the heightfield's color_from_sample is singular; its "
                                             "columns and rows must span an area");
    }
    vd_lens_map map;
    size_t height_at[VD_LENS_LEVELS], texture_at[VD_LENS_TEXTURES];
    memset(&map, 0, sizeof map);
    map.context = context;
    map.width = h->width;
    map.height = h->height;
    memcpy(map.world_from_sample, h->world_from_sample, sizeof map.world_from_sample);
    map.extent = (vd_terrain_window){0, 0, h->width - 1, h->height - 1};
    map.cell_pixels = 1.0;
    map.far_m = INFINITY;
    const size_t heights = lay_out_heights(&map, height_at), maxima = lay_out_maxima(&map);
    const size_t texels = lay_out_textures(h, &map, texture_at);
    map.memory[0] = vd_allocate(context, heights, sizeof(float));
    map.memory[1] = vd_allocate(context, maxima + 1, sizeof(float)); /* kernels read pairs */
    map.memory[2] = vd_allocate(context, texels, sizeof(uint32_t));
    if (map.memory[0] == NULL || map.memory[1] == NULL || map.memory[2] == NULL) {
        vd_lens_map_finish(&map);
        return vd_out_of_memory("the terrain's levels and textures",
                                (heights + maxima + texels) * sizeof(float));
    }
    map.ground[0].heights = vd_heightfield_level_data(h, 0);
    map.ground[0].stride = (size_t)h->levels[0].stride;
    for (int l = 0; l < map.levels; l++) {
        map.ground[l].maxima = map.memory[1];
        if (l > 0) {
            map.ground[l].heights = (const float *)map.memory[0] + height_at[l];
        }
    }
    for (int i = 0; i < map.textures; i++) {
        map.texture[i].texels = (const uint32_t *)map.memory[2] + texture_at[i];
    }
    *out = map;
    return status;
}

void vd_lens_map_finish(vd_lens_map *map) {
    for (size_t i = 0; i < sizeof map->memory / sizeof map->memory[0]; i++) {
        vd_release(map->context, map->memory[i]);
        map->memory[i] = NULL;
    }
}

/* ---- light ------------------------------------------------------------------------------------
 */

/* Towards the sun, one sample a step along the longer axis; more, up to 4, only where the longest
 * shadow that the range of heights throws would not end within the steps. */
static void aim_shadow(vd_lens_light *light, const vd_terrain_def *def) {
    const vd_heightfield *h = def->heightfield;
    vd_shadow_def *shadow = &light->shadow;
    *shadow = vd_shadow_def_default();
    shadow->edge = VD_SHADOW_EDGE_END;
    shadow->stride = 1.0;
    vd_shadow_def_aim(shadow, h, def->light.sun_direction, def->exaggeration);
    const double length = ((double)h->max - h->min) / shadow->step_rise;
    if (length > shadow->steps) { /* false for an overhead sun, whose rise is 0 / 0 or infinite */
        shadow->stride = length < 4.0 * shadow->steps ? length / shadow->steps : 4.0;
        vd_shadow_def_aim(shadow, h, def->light.sun_direction, def->exaggeration);
    }
}

static void scale_table(vd_lens_light *light) {
    const double low = light->map->min, range = (double)light->map->max - light->map->min;
    double step = 0x1p-100;
    const double finest = range / (VD_LENS_COLORS / 4 - 2);
    while (step < finest && !(step >= 1.0 && range <= VD_LENS_COLORS - 2)) {
        step *= 2.0;
    }
    while (step * (VD_LENS_COLORS - 2) < range) {
        step *= 2.0;
    }
    light->table_step = (float)step;
    light->table_scale = (float)(1.0 / step);
    light->table_from = (float)(floor(low / step) * step);
    const double count = ceil(((double)light->map->max - (double)light->table_from) / step) + 1.0;
    light->table_count = count < VD_LENS_COLORS ? (int)count : VD_LENS_COLORS;
}

void vd_lens_light_fill(vd_lens_light *light, const vd_terrain_def *def, int first, int end) {
    for (int i = first; i < end; i++) {
        const double height = (double)light->table_from + i * (double)light->table_step;
        const vd_rgba8 c = vd_colormap_at(def->colormap, height, light->map->min, light->map->max);
        memcpy(&light->table[i], &c, sizeof c);
    }
}

void vd_lens_light_constants(const vd_terrain_def *def, vd_lens_light *light) {
    const vd_light *from = &def->light;
    light->shading = def->shading;
    const vd_vec3 l = from->sun_direction;
    const float to_sun[3] = {(float)l.x, (float)l.y, (float)l.z};
    const float sun[3] = {from->sun.r, from->sun.g, from->sun.b};
    const float down[3] = {from->ambient_down.r, from->ambient_down.g, from->ambient_down.b};
    const float up[3] = {from->ambient_up.r, from->ambient_up.g, from->ambient_up.b};
    for (int i = 0; i < 3; i++) {
        light->to_sun[i] = to_sun[i];
        light->sun[i] = sun[i];
        light->ambient[i] = down[i];
        light->ambient_more[i] = up[i] - down[i];
    }
    light->has_table = def->colormap != NULL;
    light->table_count = 0;
    light->counts = NULL;
    if (light->has_table) {
        scale_table(light);
    }
}

vd_status vd_lens_light_init(const vd_lens_map *map, const vd_terrain_def *def,
                             vd_lens_light *light) {
    double m[6];
    const vd_status status = check_ground(def->heightfield, m);
    if (status.code != VD_OK) {
        return status;
    }
    light->map = def->heightfield;
    light->heights = vd_heightfield_level_data(light->map, 0);
    light->stride = (size_t)light->map->levels[0].stride;
    vd_lens_light_constants(def, light);
    const double slope[4] = {m[1], m[4], m[2], m[5]};
    for (int i = 0; i < 4; i++) {
        light->slope[i] = (float)(slope[i] * def->exaggeration);
    }
    for (int i = 0; i < 256; i++) {
        light->visible[i] = (float)vd_exp((double)i * (-1.0 / 12.0));
    }
    light->shadows = def->shading && def->shadows && def->light.sun_direction.z > 0.0;
    if (light->shadows) {
        aim_shadow(light, def);
    }
    (void)vd_heightfield_invert(map->texture_from_sample, light->sample_from_texture);
    light->factor =
        light->map->color_width > 0 ? map->texture[0].width / light->map->color_width : 1;
    static const double at_samples[6] = {0.5, 1.0, 0.0, 0.5, 0.0, 1.0};
    light->coincide = memcmp(map->texture_from_sample, at_samples, sizeof at_samples) == 0 &&
                      map->texture[0].width == map->width && map->texture[0].height == map->height;
    return status;
}

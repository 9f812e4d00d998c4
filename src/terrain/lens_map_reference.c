/* lens_map_reference.c: the lens map as lens_map.h says it, one sample and one texel at a time. */
#include <string.h>
#include "core/core.h"
#include "terrain/lens_map_internal.h"

/* ---- heights and maxima -----------------------------------------------------------------------
 */

/* The mean of a level around (column, row) with the weights ¼ ½ ¼, columns first, over what exists.
 */
float vd_lens_mean(const vd_lens_ground *fine, int column, int row) {
    static const float weights[3] = {0.25f, 0.5f, 0.25f};
    float sum = 0.0f, all = 0.0f;
    for (int i = 0; i < 3; i++) {
        const int c = column - 1 + i;
        float column_sum = 0.0f, column_all = 0.0f;
        for (int j = 0; c >= 0 && c <= fine->columns && j < 3; j++) {
            const int r = row - 1 + j;
            const bool exists = r >= 0 && r <= fine->rows &&
                                fine->heights[(size_t)r * fine->stride + (size_t)c] > -INFINITY;
            column_sum +=
                exists ? fine->heights[(size_t)r * fine->stride + (size_t)c] * weights[j] : 0.0f;
            column_all += exists ? weights[j] : 0.0f;
        }
        sum += column_sum * weights[i];
        all += column_all * weights[i];
    }
    return sum / all;
}

static void build_heights(vd_lens_map *map, int level) {
    const vd_lens_ground *fine = &map->ground[level - 1], *coarse = &map->ground[level];
    for (int row = 0; row <= coarse->rows; row++) {
        float *to = vd_lens_heights(map, level) + (size_t)row * coarse->stride;
        const int r = 2 * row < fine->rows ? 2 * row : fine->rows;
        for (int column = 0; column <= coarse->columns; column++) {
            const int c = 2 * column < fine->columns ? 2 * column : fine->columns;
            const float here = fine->heights[(size_t)r * fine->stride + (size_t)c];
            to[column] = here > -INFINITY ? vd_lens_mean(fine, c, r) : -INFINITY;
        }
    }
}

/* The highest of the corners of a cell. */
static float corners(const vd_lens_ground *g, int column, int row) {
    float highest = -INFINITY;
    for (int i = 0; i < 4; i++) {
        const float h = g->heights[(size_t)(row + i / 2) * g->stride + (size_t)(column + i % 2)];
        highest = h > highest ? h : highest;
    }
    return highest;
}

/* Zeros lose their sign here and below: it would depend on the order. */
static void build_maxima(vd_lens_map *map, int level) {
    const vd_lens_ground *fine = &map->ground[level - 1], *coarse = &map->ground[level];
    for (int row = 0; row < coarse->rows; row++) {
        for (int column = 0; column < coarse->columns; column++) {
            float highest = corners(coarse, column, row);
            for (int i = 0; i < 4; i++) {
                const int c = 2 * column + i % 2, r = 2 * row + i / 2;
                if (c >= fine->columns || r >= fine->rows) {
                    continue;
                }
                const float m =
                    level == 1
                        ? corners(fine, c, r)
                        : vd_lens_maxima(
                              map, level - 1)[(size_t)r * (size_t)fine[-1].pitch[1] + (size_t)c];
                highest = m > highest ? m : highest;
            }
            vd_lens_maxima(map, level)[(size_t)row * (size_t)fine->pitch[1] + (size_t)column] =
                highest + 0.0f;
        }
    }
}

static void measure(vd_lens_map *map) {
    float low = INFINITY, high = -INFINITY;
    for (int level = 0; level < map->levels; level++) {
        const vd_lens_ground *g = &map->ground[level];
        for (int row = 0; row <= g->rows; row++) {
            for (int column = 0; column <= g->columns; column++) {
                const float h = g->heights[(size_t)row * g->stride + (size_t)column];
                low = h > -INFINITY && h < low ? h : low;
                high = h > high ? h : high;
            }
        }
    }
    map->lowest = high > -INFINITY ? low + 0.0f : 0.0f;
    map->highest = high > -INFINITY ? high + 0.0f : 0.0f;
}

vd_status vd_lens_map_init_reference(vd_context *context, const vd_terrain_def *def,
                                     vd_lens_map *out) {
    vd_lens_map map;
    const vd_status status = vd_lens_map_lay_out(context, def, &map);
    if (status.code != VD_OK) {
        return status;
    }
    for (int level = 1; level < map.levels; level++) {
        build_heights(&map, level);
        build_maxima(&map, level);
    }
    measure(&map);
    *out = map;
    return status;
}

/* ---- light ------------------------------------------------------------------------------------
 */

static float at_or_hole(const vd_lens_light *l, int column, int row) {
    return column < 0 || row < 0 || column >= l->map->width || row >= l->map->height
               ? -INFINITY
               : l->heights[(size_t)row * l->stride + (size_t)column];
}

/* Central, one-sided at an edge or a hole; 0 where neither is possible. */
static float difference(float before, float here, float after) {
    const bool b = before > -INFINITY, h = here > -INFINITY, a = after > -INFINITY;
    return a && b ? (after - before) * 0.5f
           : !h   ? 0.0f
           : a    ? after - here
           : b    ? here - before
                  : 0.0f;
}

vd_lens_terms vd_lens_terms_at(const vd_lens_light *l, int column, int row) {
    const float here = at_or_hole(l, column, row);
    const float c =
        difference(at_or_hole(l, column - 1, row), here, at_or_hole(l, column + 1, row));
    const float r =
        difference(at_or_hole(l, column, row - 1), here, at_or_hole(l, column, row + 1));
    const float east = c * l->slope[0] + r * l->slope[1];
    const float north = c * l->slope[2] + r * l->slope[3];
    const float up = 1.0f / sqrtf((east * east + north * north) + 1.0f);
    const float facing = (l->to_sun[2] - (east * l->to_sun[0] + north * l->to_sun[1])) * up;
    const float visible =
        l->counts == NULL ? 1.0f
                          : l->visible[l->counts[(size_t)row * l->counts_stride + (size_t)column]];
    const vd_lens_terms t = {(facing > 0.0f ? facing : 0.0f) * visible,
                             up > 0.0f ? up : 0.0f}; /* NaN: 0 */
    return t;
}

/* Rows first: v[0] and v[1] above v[2] and v[3]. */
static float bilinear(const float v[4], float by_column, float by_row) {
    const float left = v[0] + (v[2] - v[0]) * by_row, right = v[1] + (v[3] - v[1]) * by_row;
    return left + (right - left) * by_column;
}

/* The bilinear height; that of the nearest sample at the edge of a hole. */
static float height_at(const vd_lens_light *l, vd_lens_place c, vd_lens_place r) {
    float v[4];
    bool whole = true;
    for (int i = 0; i < 4; i++) {
        v[i] = l->heights[(size_t)(r.first + i / 2) * l->stride + (size_t)(c.first + i % 2)];
        whole = whole && v[i] > -INFINITY;
    }
    return whole ? bilinear(v, c.weight, r.weight)
                 : v[(r.weight >= 0.5f ? 2 : 0) + (c.weight >= 0.5f ? 1 : 0)];
}

uint32_t vd_lens_color_at(const vd_lens_light *l, float height) {
    const float last = (float)(l->table_count - 1);
    float at = (height - l->table_from) * l->table_scale + 0.5f;
    at = at > 0.0f ? at : 0.0f; /* also NaN */
    at = at < last ? at : last;
    return l->table[(int32_t)at];
}

static uint32_t component(uint32_t color, int channel) {
    return color >> (8 * channel) & 255u;
}

/* The heightfield's colour of a texel, bilinear in encoded integers. */
static uint32_t mixed_color(const vd_lens_light *l, int x, int y) {
    const vd_heightfield *h = l->map;
    const vd_lens_mix c = vd_lens_mix_at(x, l->factor, h->color_width);
    const vd_lens_mix r = vd_lens_mix_at(y, l->factor, h->color_height);
    uint32_t p[4], mixed = 0;
    for (int i = 0; i < 4; i++) {
        const size_t row = (size_t)(i < 2 ? r.first : r.second);
        memcpy(&p[i],
               vd_heightfield_colors(h) + row * h->color_stride + (i % 2 ? c.second : c.first), 4);
    }
    for (int i = 0; i < 4; i++) {
        const uint32_t top = component(p[0], i) * (256 - c.weight) + component(p[1], i) * c.weight;
        const uint32_t bottom =
            component(p[2], i) * (256 - c.weight) + component(p[3], i) * c.weight;
        mixed |= ((top * (256 - r.weight) + bottom * r.weight + 32768) >> 16) << (8 * i);
    }
    return mixed;
}

uint32_t vd_lens_lit(const vd_lens_light *l, uint32_t albedo, vd_lens_terms terms) {
    const float sky = 0.5f + 0.5f * terms.up;
    uint32_t lit = 0xFF000000u;
    for (int i = 0; i < 3; i++) {
        const float light = l->sun[i] * terms.direct + (l->ambient[i] + l->ambient_more[i] * sky);
        lit |= vd_srgb_byte_encode(vd_srgb_byte_decode(component(albedo, i)) * light) << (8 * i);
    }
    return lit;
}

uint32_t vd_lens_texel(const vd_lens_light *l, int x, int y) {
    const double *m = l->sample_from_texture, u = x + 0.5, v = y + 0.5;
    const vd_lens_place c = vd_lens_place_at(m[0] + (u * m[1] + v * m[2]), l->map->width);
    const vd_lens_place r = vd_lens_place_at(m[3] + (u * m[4] + v * m[5]), l->map->height);
    uint32_t albedo = 0x00BEBEBEu; /* grey */
    if (l->map->color_width > 0) {
        albedo = mixed_color(l, x, y);
    }
    if (l->has_table && albedo >> 24 < 128) { /* where imagery has nothing */
        albedo = vd_lens_color_at(l, height_at(l, c, r));
    }
    if (!l->shading) {
        return albedo | 0xFF000000u;
    }
    float direct[4], up[4];
    for (int i = 0; i < 4; i++) {
        const vd_lens_terms t = vd_lens_terms_at(l, c.first + i % 2, r.first + i / 2);
        direct[i] = t.direct;
        up[i] = t.up;
    }
    const vd_lens_terms terms = {bilinear(direct, c.weight, r.weight),
                                 bilinear(up, c.weight, r.weight)};
    return vd_lens_lit(l, albedo, terms);
}

static void half(const vd_lens_texture *fine, const vd_lens_texture *coarse, uint32_t *to) {
    for (int y = 0; y < coarse->height; y++) {
        for (int x = 0; x < coarse->width; x++) {
            uint32_t mean_color = 0;
            for (int i = 0; i < 4; i++) {
                uint32_t sum = 2;
                for (int j = 0; j < 4; j++) {
                    const int c = 2 * x + j % 2, r = 2 * y + j / 2;
                    const size_t column = (size_t)(c < fine->width ? c : fine->width - 1);
                    const size_t row = (size_t)(r < fine->height ? r : fine->height - 1);
                    sum += component(fine->texels[row * (size_t)fine->stride + column], i);
                }
                mean_color |= (sum >> 2) << (8 * i);
            }
            to[(size_t)y * (size_t)coarse->stride + (size_t)x] = mean_color;
        }
    }
}

static void border(const vd_lens_texture *t, uint32_t *to) {
    for (int y = -1; y <= t->height; y++) {
        for (int x = -1; x <= t->width; x++) {
            const int c = x < 0 ? 0 : x < t->width ? x : t->width - 1;
            const int r = y < 0 ? 0 : y < t->height ? y : t->height - 1;
            to[(ptrdiff_t)y * t->stride + x] = t->texels[(ptrdiff_t)r * t->stride + c];
        }
    }
}

static vd_status light_reference(vd_lens_map *map, const vd_terrain_def *def, vd_lens_light *light,
                                 uint8_t *counts) {
    vd_status status = vd_lens_light_init(map, def, light);
    if (status.code == VD_OK && light->shadows) {
        light->shadow.method = VD_SHADOW_REFERENCE;
        status = vd_shadow_count(map->context, NULL, light->map, &light->shadow, counts,
                                 (size_t)map->width);
    }
    if (status.code != VD_OK) {
        return status;
    }
    light->counts = light->shadows ? counts : NULL;
    light->counts_stride = (size_t)map->width;
    vd_lens_light_fill(light, def, 0, light->table_count);
    const vd_lens_texture *t = map->texture;
    for (int y = 0; y < t->height; y++) {
        for (int x = 0; x < t->width; x++) {
            vd_lens_texels(map, 0)[(size_t)y * (size_t)t->stride + (size_t)x] =
                vd_lens_texel(light, x, y);
        }
    }
    border(t, vd_lens_texels(map, 0));
    for (int size = 1; size < map->textures; size++) {
        half(&t[size - 1], &t[size], vd_lens_texels(map, size));
        border(&t[size], vd_lens_texels(map, size));
    }
    return status;
}

vd_status vd_lens_map_light_reference(vd_lens_map *map, const vd_terrain_def *def) {
    vd_lens_light *light = vd_allocate(map->context, 1, sizeof *light);
    uint8_t *counts = vd_allocate(map->context, (size_t)map->width, (size_t)map->height);
    vd_status status = vd_out_of_memory("the terrain's light", sizeof *light);
    if (light != NULL && counts != NULL) {
        status = light_reference(map, def, light, counts);
    }
    vd_release(map->context, counts);
    vd_release(map->context, light);
    return status;
}

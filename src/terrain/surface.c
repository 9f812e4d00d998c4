#include <math.h>
#include "terrain/heightfield_block.h"
#include "terrain/surface.h"

vd_status vd_surface_init(const vd_terrain_def *def, vd_surface *out) {
    const vd_heightfield *h = def->heightfield;
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
    vd_surface s;
    s.heightfield = h;
    s.heights = vd_heightfield_level_data(h, 0);
    s.stride = (size_t)h->levels[0].stride;
    s.exaggeration = def->exaggeration;
    if (!vd_heightfield_invert(h->world_from_sample, s.sample_from_world)) {
        return vd_failure(VD_ERROR_ARGUMENT, "the heightfield's world_from_sample is singular; its "
                                             "columns and rows must span an area");
    }
    const double *m = h->world_from_sample;
    const double cell_area = fabs(m[1] * m[5] - m[2] * m[4]);
    const double range = ((double)h->max - h->min) * def->exaggeration;
    s.top = h->max * def->exaggeration + 1e-3 * range + 1e-3;
    s.lift = sqrt(cell_area) / 16.0;
    s.curvature = def->curvature ? vd_curvature_drop(1.0) : 0.0;
    *out = s;
    return vd_success();
}

/* The height difference per sample along one axis: central, one-sided at an edge or a hole. */
static double difference(float before, float here, float after) {
    const bool has_before = before > -INFINITY, has_after = after > -INFINITY;
    if (has_before && has_after) {
        return 0.5 * ((double)after - before);
    }
    return has_after ? (double)after - here : has_before ? (double)here - before : 0.0;
}

static float height_or_hole(const vd_surface *s, int column, int row) {
    if (column < 0 || row < 0 || column >= s->heightfield->width || row >= s->heightfield->height) {
        return -INFINITY;
    }
    return s->heights[(size_t)row * s->stride + column];
}

static void sample_slope(const vd_surface *s, int column, int row, double *by_column,
                         double *by_row) {
    const float here = height_or_hole(s, column, row);
    *by_column =
        difference(height_or_hole(s, column - 1, row), here, height_or_hole(s, column + 1, row));
    *by_row =
        difference(height_or_hole(s, column, row - 1), here, height_or_hole(s, column, row + 1));
}

static int clamp_cell(double position, int cells) {
    const double cell = floor(position);
    return cell < 0.0 ? 0 : cell > cells - 1 ? cells - 1 : (int)cell;
}

vd_vec3 vd_surface_normal(const vd_surface *s, double column, double row) {
    const int i = clamp_cell(column, s->heightfield->width - 1);
    const int j = clamp_cell(row, s->heightfield->height - 1);
    const double fu = column - i, fv = row - j;
    double c[4], r[4];
    for (int k = 0; k < 4; k++) {
        sample_slope(s, i + (k & 1), j + (k >> 1), &c[k], &r[k]);
    }
    const double w[4] = {(1.0 - fu) * (1.0 - fv), fu * (1.0 - fv), (1.0 - fu) * fv, fu * fv};
    const double by_column = (c[0] * w[0] + c[1] * w[1] + c[2] * w[2] + c[3] * w[3]);
    const double by_row = (r[0] * w[0] + r[1] * w[1] + r[2] * w[2] + r[3] * w[3]);
    const double *m = s->sample_from_world;
    const double dx = (by_column * m[1] + by_row * m[4]) * s->exaggeration;
    const double dy = (by_column * m[2] + by_row * m[5]) * s->exaggeration;
    return vd_vec3_normalize(vd_vec3_make(-dx, -dy, 1.0));
}

static vd_rgba8 texel(const vd_heightfield *h, int u, int v) {
    u = u < 0 ? 0 : u >= h->color_width ? h->color_width - 1 : u;
    v = v < 0 ? 0 : v >= h->color_height ? h->color_height - 1 : v;
    return vd_heightfield_colors(h)[(size_t)v * h->color_stride + u];
}

/* Bilinear in encoded integers: weights of 1/256, so 16 bits of weight and 8 of value. */
static vd_rgba8 filter_colors(const vd_heightfield *h, double u, double v) {
    const double fu = floor(u - 0.5), fv = floor(v - 0.5);
    const int i = (int)fu, j = (int)fv;
    const uint32_t wu = (uint32_t)((u - 0.5 - fu) * 256.0), wv = (uint32_t)((v - 0.5 - fv) * 256.0);
    const vd_rgba8 a = texel(h, i, j), b = texel(h, i + 1, j);
    const vd_rgba8 c = texel(h, i, j + 1), d = texel(h, i + 1, j + 1);
    const uint32_t wa = (256 - wu) * (256 - wv), wb = wu * (256 - wv), wc = (256 - wu) * wv,
                   wd = wu * wv;
    vd_rgba8 mixed;
    mixed.r = (uint8_t)((a.r * wa + b.r * wb + c.r * wc + d.r * wd + 32768) >> 16);
    mixed.g = (uint8_t)((a.g * wa + b.g * wb + c.g * wc + d.g * wd + 32768) >> 16);
    mixed.b = (uint8_t)((a.b * wa + b.b * wb + c.b * wc + d.b * wd + 32768) >> 16);
    mixed.a = (uint8_t)((a.a * wa + b.a * wb + c.a * wc + d.a * wd + 32768) >> 16);
    return mixed;
}

vd_rgba8 vd_surface_color(const vd_terrain_def *def, const vd_surface_hit *hit) {
    const vd_heightfield *h = def->heightfield;
    if (h->color_width > 0) {
        const double *m = h->color_from_sample;
        double u = m[0] + (hit->column * m[1] + hit->row * m[2]);
        double v = m[3] + (hit->column * m[4] + hit->row * m[5]);
        /* Clamped while still a double, so that the conversion to int is always defined. */
        u = u < 0.0 ? 0.0 : u > h->color_width ? h->color_width : u;
        v = v < 0.0 ? 0.0 : v > h->color_height ? h->color_height : v;
        const vd_rgba8 color = def->filter == VD_FILTER_LINEAR
                                   ? filter_colors(h, u, v)
                                   : texel(h, (int)floor(u), (int)floor(v));
        /* Where imagery has nothing, the ground still has a height. */
        if (color.a >= 128 || def->colormap == NULL) {
            return color;
        }
    }
    if (def->colormap == NULL) {
        return (vd_rgba8){190, 190, 190, 255};
    }
    return vd_colormap_at(def->colormap, hit->height / def->exaggeration, h->min, h->max);
}

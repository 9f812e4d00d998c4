/* texture_filter.c: reading a texture at sixteen places.
 *
 * The footprint of a pixel in texels is an ellipse whose axes come from the changes of (u, v) to
 * the next pixels. Trilinear takes a square as wide as its longer side (Williams 1983, with the
 * length as Heckbert's 1989 §2 asks). Anisotropic sums the texels of the ellipse itself on a level
 * where its shorter axis is about a texel, weighted by a Gaussian (Greene & Heckbert 1986). All
 * arithmetic is +, −, ×, ÷, sqrt and floor: the same everywhere.
 */
#include <math.h>
#include <string.h>
#include "raster/texture_internal.h"

static int wrap(float at, int size) {
    /* at is a whole number; repeats. What is no number reads texel 0. */
    const float turns = floorf(at / (float)size);
    const float rest = at - turns * (float)size;
    return rest > 0.0f && rest < (float)size ? (int)rest : 0;
}

static const uint8_t *texel(const vd_texture_level *level, int x, int y) {
    return level->texels + 4 * ((size_t)y * (size_t)level->width + (size_t)x);
}

static void nearest(const vd_texture_level *level, float u, float v, float out[4]) {
    const int x = wrap(floorf(u * (float)level->width), level->width);
    const int y = wrap(floorf(v * (float)level->height), level->height);
    const uint8_t *t = texel(level, x, y);
    for (int c = 0; c < 4; c++) {
        out[c] = (float)t[c];
    }
}

static void bilinear(const vd_texture_level *level, float u, float v, float out[4]) {
    const float x = u * (float)level->width - 0.5f, y = v * (float)level->height - 0.5f;
    const float left = floorf(x), top = floorf(y);
    const float fx = x - left, fy = y - top;
    const int x0 = wrap(left, level->width), y0 = wrap(top, level->height);
    const int x1 = x0 + 1 < level->width ? x0 + 1 : 0, y1 = y0 + 1 < level->height ? y0 + 1 : 0;
    const uint8_t *a = texel(level, x0, y0), *b = texel(level, x1, y0);
    const uint8_t *c = texel(level, x0, y1), *d = texel(level, x1, y1);
    for (int i = 0; i < 4; i++) {
        const float upper = (float)a[i] + fx * ((float)b[i] - (float)a[i]);
        const float lower = (float)c[i] + fx * ((float)d[i] - (float)c[i]);
        out[i] = upper + fy * (lower - upper);
    }
}

/* log2 of a positive, finite float, at most 0.006 off: the exponent and a parabola through the
 * mantissa. Monotone and continuous, which is what choosing a level wants. */
static float log2_estimate(float v) {
    uint32_t bits;
    memcpy(&bits, &v, sizeof bits);
    const float exponent = (float)((int32_t)(bits >> 23) - 127);
    bits = (bits & 0x007fffffu) | 0x3f800000u;
    float mantissa;
    memcpy(&mantissa, &bits, sizeof mantissa);
    const float m = mantissa - 1.0f;
    return exponent + m + 0.34f * m * (1.0f - m);
}

/* Between two levels; `lod` 0 is the finest. */
static void trilinear(const vd_texture *texture, float u, float v, float lod, float out[4]) {
    const float last = (float)(texture->level_count - 1);
    lod = lod > 0.0f ? lod : 0.0f; /* what is no number too */
    lod = lod < last ? lod : last;
    const int level = (int)lod;
    const float between = lod - (float)level;
    bilinear(&texture->levels[level], u, v, out);
    if (between > 0.0f) {
        float coarser[4];
        bilinear(&texture->levels[level + 1], u, v, coarser);
        for (int c = 0; c < 4; c++) {
            out[c] = out[c] + between * (coarser[c] - out[c]);
        }
    }
}

/* Changes of the position in texels of the finest level. */
typedef struct footprint {
    float ux, vx, uy, vy;
} footprint;

static float level_of(float texels) {
    return texels > 1.0f && texels < 1e30f ? log2_estimate(texels) : texels > 1.0f ? 100.0f : 0.0f;
}

/* The ellipse's longer and shorter radius. */
static void axes(const footprint *f, float *major, float *minor) {
    const float a = f->ux * f->ux + f->uy * f->uy, d = f->vx * f->vx + f->vy * f->vy;
    const float b = f->ux * f->vx + f->uy * f->vy;
    const float mean = 0.5f * (a + d), half = 0.5f * (a - d);
    const float spread = sqrtf(half * half + b * b);
    *major = sqrtf(mean + spread);
    *minor = mean > spread ? sqrtf(mean - spread) : 0.0f;
}

#define MOST_ANISOTROPY 16.0f

/* e^(−2q), q = 0 … 1, as a parabola's square: within 0.012, and 0 at no place inside. */
static float gaussian(float q) {
    const float p = 1.0f - q * (0.94f - 0.31f * q);
    return p * p;
}

static void anisotropic(const vd_texture *texture, float u, float v, const footprint *f,
                        float out[4]) {
    float major, minor;
    axes(f, &major, &minor);
    const float least = major / MOST_ANISOTROPY;
    const float wanted = minor > least ? minor : least;
    const float lod = level_of(wanted);
    if (!(major > 1.0f) || !(major < 1e15f)) {
        trilinear(texture, u, v, level_of(major), out);
        return;
    }
    const int last = texture->level_count - 1;
    const int chosen = (int)lod < last ? (int)lod : last;
    const vd_texture_level *level = &texture->levels[chosen];
    /* The ellipse in texels of the level; widened to at least a texel, so that it holds some. */
    const float sx = (float)level->width / (float)texture->levels[0].width;
    const float sy = (float)level->height / (float)texture->levels[0].height;
    const float ux = f->ux * sx, uy = f->uy * sx, vx = f->vx * sy, vy = f->vy * sy;
    const float a = vx * vx + vy * vy + 1.0f, b = -2.0f * (ux * vx + uy * vy);
    const float c = ux * ux + uy * uy + 1.0f, full = a * c - 0.25f * b * b;
    const float half_width = sqrtf(c), half_height = sqrtf(a);
    const float cx = u * (float)level->width - 0.5f, cy = v * (float)level->height - 0.5f;
    float sum[4] = {0, 0, 0, 0}, weights = 0.0f;
    const float bottom = floorf(cy + half_height), right = floorf(cx + half_width);
    if (!(half_width < 64.0f) || !(half_height < 64.0f)) { /* sheared beyond what 16:1 can be */
        trilinear(texture, u, v, level_of(major), out);
        return;
    }
    for (float y = floorf(cy - half_height) + 1.0f; y <= bottom; y += 1.0f) {
        const int row = wrap(y, level->height);
        for (float x = floorf(cx - half_width) + 1.0f; x <= right; x += 1.0f) {
            const float dx = x - cx, dy = y - cy;
            const float q = (a * dx * dx + b * dx * dy + c * dy * dy) / full;
            if (!(q < 1.0f)) {
                continue;
            }
            const float weight = gaussian(q);
            const uint8_t *t = texel(level, wrap(x, level->width), row);
            for (int i = 0; i < 4; i++) {
                sum[i] = sum[i] + weight * (float)t[i];
            }
            weights = weights + weight;
        }
    }
    if (!(weights > 0.0f)) {
        trilinear(texture, u, v, lod, out);
        return;
    }
    for (int i = 0; i < 4; i++) {
        out[i] = sum[i] / weights;
    }
}

/* The same place on the texture itself, 0 … 1; 0 for what is no number. */
static float within(float at) {
    const float part = at - floorf(at);
    return part >= 0.0f && part <= 1.0f ? part : 0.0f;
}

static void sample(const vd_texture *texture, vd_texture_filter filter, float u, float v,
                   const footprint *f, float out[4]) {
    u = within(u);
    v = within(v);
    if (filter == VD_TEXTURE_NEAREST) {
        nearest(&texture->levels[0], u, v, out);
    } else if (filter == VD_TEXTURE_BILINEAR) {
        bilinear(&texture->levels[0], u, v, out);
    } else if (filter == VD_TEXTURE_ANISOTROPIC) {
        anisotropic(texture, u, v, f, out);
    } else {
        const float right = sqrtf(f->ux * f->ux + f->vx * f->vx);
        const float below = sqrtf(f->uy * f->uy + f->vy * f->vy);
        trilinear(texture, u, v, level_of(right < below ? below : right), out);
    }
}

void vd_texture_sample(const vd_texture *texture, vd_texture_filter filter, const float (*uv)[16],
                       const float (*uv_dx)[16], const float (*uv_dy)[16], float (*color)[16]) {
    const float width = (float)texture->levels[0].width;
    const float height = (float)texture->levels[0].height;
    for (int i = 0; i < 16; i++) {
        footprint f = {0, 0, 0, 0};
        if (uv_dx != NULL && uv_dy != NULL) {
            f = (footprint){uv_dx[0][i] * width, uv_dx[1][i] * height, uv_dy[0][i] * width,
                            uv_dy[1][i] * height};
        }
        float texel[4];
        sample(texture, filter, uv[0][i], uv[1][i], &f, texel);
        const float alpha = texel[3] * (1.0f / 255.0f);
        for (int c = 0; c < 3; c++) {
            const float straight = texel[3] > 0.0f ? texel[c] / texel[3] : 0.0f;
            color[c][i] = straight < 1.0f ? straight : 1.0f;
        }
        color[3][i] = alpha;
    }
}

/* splat_reference.c: splatting as it is meant: one particle after the other, one pixel after the
 * other. */
#include <math.h>
#include <string.h>
#include "splat/splat_internal.h"

/* A particle before the camera. */
typedef struct dot {
    float x, y; /* pixels */
    float depth;
    float support; /* pixels */
    float amount;  /* alpha at the middle, or weight as an integer */
    uint32_t color;
} dot;

static float number_at(const float *at, const uint16_t *at16, size_t i) {
    return at16 != NULL ? (float)at16[i] : at[i];
}

static bool is_finite(float v) {
    return v - v == 0.0f;
}

static uint32_t color_at(const vd_splat_picture *picture, const vd_placing *p, size_t i) {
    const vd_splats *s = p->splats;
    switch (p->paint) {
    case VD_PAINT_COLOR: {
        uint32_t bytes;
        memcpy(&bytes, &s->color[i], sizeof bytes);
        return bytes;
    }
    case VD_PAINT_CLASS:
        return picture->class_colors[s->classes[i]];
    case VD_PAINT_VALUE:
        return picture->palette[vd_splat_palette_index(picture, s->value[i])];
    case VD_PAINT_VALUE16:
        return picture->palette[vd_splat_palette_index(
            picture, s->value_origin + s->value_step * (float)s->value16[i])];
    default:
        return p->constant;
    }
}

/* A weight as an integer of 24 bits. */
static float weight_at(const vd_splat_picture *picture, const vd_placing *p, size_t i,
                       vd_splat_counts *counts) {
    const float given = p->splats->weight != NULL ? p->splats->weight[i] : 1.0f;
    float w = given * picture->weight_scale + 0.5f;
    w = 0.0f < w ? w : 0.0f; /* NaN too */
    if (!(w < VD_WEIGHT_CUT)) {
        counts->cut++;
        w = VD_WEIGHT_ONE;
    }
    return floorf(w);
}

/* False when the particle is not drawn. */
static bool project(const vd_splat_picture *picture, const vd_placing *p, size_t i, dot *out,
                    vd_splat_counts *counts) {
    const vd_splats *s = p->splats;
    const float x = number_at(s->x, s->x16, i), y = number_at(s->y, s->y16, i);
    const float z = number_at(s->z, s->z16, i);
    float r = s->radius != NULL ? s->radius[i] : s->radius_m;
    if (!is_finite(x) || !is_finite(y) || !is_finite(z) || !is_finite(r)) {
        counts->not_finite++;
        return false;
    }
    r = 0.0f < r ? r : 0.0f;
    float v[3];
    for (int k = 0; k < 3; k++) {
        v[k] = (p->row[k][0] * x + p->row[k][1] * y) + (p->row[k][2] * z + p->row[k][3]);
    }
    if (!(v[2] >= p->near_z && v[2] <= p->far_z)) {
        return false;
    }
    const float rw = p->perspective ? 1.0f / v[2] : 1.0f;
    out->x = v[0] * rw;
    out->y = v[1] * rw;
    out->depth = p->depth_at + p->depth_by * (p->perspective ? rw : v[2]);
    out->support = r * (p->support_scale * rw);
    out->color = color_at(picture, p, i);
    if (picture->mode == VD_SPLAT_DENSITY) {
        out->amount = weight_at(picture, p, i, counts);
    } else {
        out->amount = p->opacity * (float)(out->color >> 24);
        out->color |= 0xFF000000u;
    }
    return true;
}

static bool inside(const vd_splat_picture *picture, int x, int y) {
    return x >= 0 && x < picture->width && y >= 0 && y < picture->height;
}

static void blend(float pixel[4], uint32_t color, float weight) {
    for (int c = 0; c < 4; c++) {
        pixel[c] = pixel[c] * (1.0f - weight) + (float)(color >> (8 * c) & 255) * weight;
    }
}

static void put_point(vd_splat_point *point, const dot *d, uint32_t id) {
    if (d->depth > point->depth) {
        point->depth = d->depth;
        point->color = d->color;
        point->id = id;
    }
}

/* Whether what the frame holds at a pixel is nearer. */
static bool is_hidden(const vd_splat_picture *picture, int x, int y, float depth) {
    return picture->hider != NULL &&
           picture->hider[(size_t)y * picture->hider_stride + (size_t)x] > depth;
}

/* The pixel of a middle in 1/256 of pixels beyond that of the first one's; of the picture's, the
 * nearest. */
static int middle_pixel(int at, int size) {
    const int pixel = (at + 128) >> 8;
    return pixel < 0 ? 0 : pixel < size ? pixel : size - 1;
}

/* A box of one pixel over four; false when it has no part in the picture. */
static bool draw_small(const vd_splat_picture *picture, const dot *d, uint32_t id, void *pixels) {
    if (picture->mode == VD_SPLAT_NEAREST) {
        const float x = floorf(d->x), y = floorf(d->y);
        if (!(x >= 0 && x < (float)picture->width && y >= 0 && y < (float)picture->height)) {
            return false;
        }
        put_point((vd_splat_point *)pixels + (size_t)y * (size_t)picture->width + (size_t)x, d, id);
        return true;
    }
    const float fx = floorf((d->x - 0.5f) * 256.0f + 0.5f);
    const float fy = floorf((d->y - 0.5f) * 256.0f + 0.5f);
    if (!(fx >= -256.0f && fx < (float)picture->width * 256.0f && fy >= -256.0f &&
          fy < (float)picture->height * 256.0f)) {
        return false;
    }
    const int x = (int)fx >> 8, y = (int)fy >> 8; /* of the upper left pixel */
    const uint32_t right = (uint32_t)(int)fx & 255, lower = (uint32_t)(int)fy & 255;
    const float area = picture->shape.area * (d->support * d->support);
    const float alpha = d->amount * area;
    if (picture->mode == VD_SPLAT_ALPHA &&
        (!(alpha > 0.0f) || is_hidden(picture, middle_pixel((int)fx, picture->width),
                                      middle_pixel((int)fy, picture->height), d->depth))) {
        return false;
    }
    for (int i = 0; i < 4; i++) {
        const int px = x + (i & 1), py = y + (i >> 1);
        if (!inside(picture, px, py)) {
            continue;
        }
        const size_t at = (size_t)py * (size_t)picture->width + (size_t)px;
        if (picture->mode == VD_SPLAT_DENSITY) {
            const uint64_t weight = (uint64_t)d->amount * (i >> 1 ? lower : 256 - lower);
            const uint64_t left = weight * (256 - right) >> 8;
            ((uint64_t *)pixels)[at] += i & 1 ? weight - left : left;
        } else {
            const float share_x = (float)(i & 1 ? right : 256 - right) * (1.0f / 256.0f);
            const float share_y = (float)(i >> 1 ? lower : 256 - lower) * (1.0f / 256.0f);
            blend((float *)pixels + 4 * at, d->color, share_x * (alpha * share_y));
        }
    }
    return true;
}

static bool draw_large(const vd_splat_picture *picture, const dot *d, uint32_t id, void *pixels) {
    vd_splat_large large;
    vd_splat_large_init(&large, picture, d->x, d->y, d->support, d->amount, vd_splat_large_sum);
    int box[4];
    vd_splat_large_box(&large, picture, box);
    if (box[0] >= box[1] || box[2] >= box[3] ||
        (picture->mode == VD_SPLAT_ALPHA && !(large.amount > 0.0f))) {
        return false;
    }
    for (int y = box[2]; y < box[3]; y++) {
        for (int x = box[0]; x < box[1]; x++) {
            const size_t at = (size_t)y * (size_t)picture->width + (size_t)x;
            const float share = vd_splat_large_at(&large, &picture->shape, x, y);
            if (picture->mode == VD_SPLAT_NEAREST) {
                if (vd_splat_large_holds(&large, &picture->shape, x, y)) {
                    put_point((vd_splat_point *)pixels + at, d, id);
                }
            } else if (picture->mode == VD_SPLAT_DENSITY) {
                ((uint64_t *)pixels)[at] += 2 * (uint64_t)(large.amount * share + 0.5f);
            } else if (!is_hidden(picture, x, y, d->depth)) {
                const float weight = large.amount * share;
                blend((float *)pixels + 4 * at, d->color, weight < 1.0f ? weight : 1.0f);
            }
        }
    }
    return true;
}

/* Sorts `from`, stable, by merging runs; the result is where it returns. */
static const uint64_t *merge_sort(uint64_t *from, uint64_t *to, size_t count) {
    for (size_t run = 1; run < count; run *= 2) {
        for (size_t begin = 0; begin < count; begin += 2 * run) {
            const size_t middle = begin + run < count ? begin + run : count;
            const size_t end = middle + run < count ? middle + run : count;
            size_t a = begin, b = middle;
            for (size_t i = begin; i < end; i++) {
                to[i] = a < middle && (b >= end || from[a] <= from[b]) ? from[a++] : from[b++];
            }
        }
        uint64_t *swap = from;
        from = to;
        to = swap;
    }
    return from;
}

void vd_splat_draw_reference(const vd_splat_picture *picture, const vd_placing *placings,
                             const int *sequence, int count, bool sorts, uint64_t *scratch,
                             void *pixels, vd_splat_counts *counts) {
    for (int k = 0; k < count; k++) {
        const vd_placing *p = &placings[sequence[k]];
        const size_t length = p->splats->count;
        for (size_t i = 0; i < length; i++) {
            scratch[i] = (sorts ? (uint64_t)vd_splat_key(p, i) << 32 : 0) | i;
        }
        const uint64_t *order = merge_sort(scratch, scratch + length, length);
        for (size_t i = 0; i < length; i++) {
            dot d;
            if (project(picture, p, (uint32_t)order[i], &d, counts)) {
                counts->drawn += d.support > picture->shape.small
                                     ? draw_large(picture, &d, p->frame_id, pixels)
                                     : draw_small(picture, &d, p->frame_id, pixels);
            }
        }
    }
}

void vd_splat_resolve_reference(const vd_splat_picture *picture, const void *pixels, int count,
                                uint8_t *rgba, float *depth, uint32_t *id) {
    for (int i = 0; i < count; i++) {
        const vd_splat_point *point = (const vd_splat_point *)pixels + i;
        uint32_t bytes = picture->background_bytes;
        if (picture->mode == VD_SPLAT_NEAREST) {
            bytes = point->depth > 0.0f ? point->color : bytes;
        } else if (picture->mode == VD_SPLAT_DENSITY) {
            const uint64_t sum = ((const uint64_t *)pixels)[i];
            const float density = (float)(int64_t)sum * picture->density_scale;
            bytes =
                sum > 0 ? picture->density_colors[vd_splat_palette_index(picture, density)] : bytes;
        } else {
            bytes = 0;
            for (int c = 0; c < 4; c++) {
                const float v = ((const float *)pixels)[4 * i + c];
                const uint32_t v16 = (uint32_t)(int32_t)(v * 257.0f + 0.5f);
                bytes |= (uint32_t)vd_round_16_to_8(v16) << (8 * c);
            }
        }
        memcpy(rgba + 4 * i, &bytes, sizeof bytes);
        if (depth != NULL) {
            depth[i] = picture->mode == VD_SPLAT_NEAREST ? point->depth : 0.0f;
        }
        if (id != NULL) {
            id[i] = picture->mode == VD_SPLAT_NEAREST ? point->id : 0;
        }
    }
}

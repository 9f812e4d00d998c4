/* lens_raycast.c: the plain method "raycast": every ray by itself, through every cell under it; and
 * the colours and depths of what it hits. Every number is the fast twin's (lens_march.inl), bit for
 * bit. */
#include <string.h>
#include "core/real.h"
#include "terrain/lens_cast.h"

/* (a·b + 2^14) >> 15, as the processors' pmulhrsw does. */
static int multiply_high(int a, int b) {
    return (a * b + 16384) >> 15;
}

/* Which size of the textures is read at t metres. */
static int texture_size(const vd_lens_view *view, float t) {
    const float share = t * view->texture_t;
    uint32_t bits;
    memcpy(&bits, &share, sizeof bits);
    int size = (int)(bits >> 23) - 127 + view->texture_bias;
    size = size > view->texture_last ? view->texture_last : size;
    return size > 0 ? size : 0;
}

/* A channel between four texels: seven bits of weight across, seven along; 127 times its value. */
static int filter(int a, int b, int c, int d, int wu, int wv) {
    const int upper = a * (127 - wu) + b * wu, lower = c * (127 - wu) + d * wu;
    return upper + multiply_high(lower - upper, wv << 8);
}

/* The texture at a sample position, in 127ths of encoded channels. */
static void read_texture(const vd_lens_view *view, float u, float v, float t, int16_t out[4]) {
    const int size = texture_size(view, t);
    const float scale = view->texture_scale[size];
    const float x = view->texture_u[size] + (u * view->texture_uu + v * view->texture_uv) * scale;
    const float y = view->texture_v[size] + (u * view->texture_vu + v * view->texture_vv) * scale;
    const int width = view->texture_width[size], height = view->texture_height[size];
    const float inside_x = vd_lens_max(vd_lens_min(x, (float)width), -1.0f);
    const float inside_y = vd_lens_max(vd_lens_min(y, (float)height), -1.0f);
    const float left = floorf(inside_x), top = floorf(inside_y);
    const int i = (int)left < width - 1 ? (int)left : width - 1;
    const int j = (int)top < height - 1 ? (int)top : height - 1;
    const int wu = view->nearest ? 0 : (int)((inside_x - left) * 128.0f);
    const int wv = view->nearest ? 0 : (int)((inside_y - top) * 128.0f);
    const uint32_t *at =
        view->texels + view->texture_offset[size] + j * view->texture_stride[size] + i;
    const uint32_t *below = at + view->texture_stride[size];
    for (int channel = 0; channel < 4; channel++) {
        const int shift = 8 * channel;
        out[channel] = (int16_t)filter(at[0] >> shift & 255, at[1] >> shift & 255,
                                       below[0] >> shift & 255, below[1] >> shift & 255, wu, wv);
    }
}

/* The length of the ray's direction, per metre along the view axis. */
static float direction_length(const vd_lens_view *view, float x, float y) {
    const float right = vd_lens_at(&view->right, x, y), down = vd_lens_at(&view->down, x, y);
    return sqrtf(1.0f + (right * right + down * down));
}

static uint32_t shade_hit(const vd_lens_view *view, const vd_lens_ray *r, float x, float y,
                          float s) {
    const float t = view->t0 + s;
    int16_t color[4];
    read_texture(view, r->u + r->ut * s, r->v + r->vt * s, t, color);
    if (view->haze != 0.0f) {
        const float left = vd_exp2_negative((t * direction_length(view, x, y)) * view->haze);
        const int hazy = 32767 - (int)(left * 32767.0f);
        for (int i = 0; i < 4; i++) {
            color[i] = (int16_t)(color[i] + multiply_high(view->haze_color[i] - color[i], hazy));
        }
    }
    uint32_t packed = 0;
    for (int i = 0; i < 4; i++) {
        const int byte = multiply_high(color[i], 258);
        packed |= (uint32_t)(byte > 255 ? 255 : byte < 0 ? 0 : byte) << (8 * i);
    }
    return packed;
}

static uint32_t shade_miss(const vd_lens_view *view, float x, float y) {
    if (view->sky == NULL) {
        return view->background;
    }
    const float up = vd_lens_at(&view->w1, x, y) * view->sine;
    const float sine = up / direction_length(view, x, y);
    const float place = (sine + 1.0f) * (0.5f * VD_LENS_SKY) + 0.5f;
    return view->sky[(int)vd_lens_max(vd_lens_min(place, (float)VD_LENS_SKY), 0.0f)];
}

/* A sample: its colour, premultiplied, and its depth, 0 where there is no terrain. */
static uint32_t draw_sample(const vd_lens_view *view, float x, float y, float *depth) {
    const vd_lens_ray ray = vd_lens_make_ray(view, x, y);
    float s;
    if (!vd_lens_cast(view, &ray, &s)) {
        *depth = 0.0f;
        return shade_miss(view, x, y);
    }
    *depth = vd_lens_depth(view, view->t0 + s);
    return shade_hit(view, &ray, x, y, s);
}

static void put(const vd_lens_picture *picture, int x, int y, uint32_t color, float depth) {
    vd_frame *frame = picture->frame;
    const size_t at = (size_t)y * frame->stride + (size_t)x;
    memcpy(frame->rgba + 4 * at, &color, sizeof color);
    if (frame->depth != NULL) {
        frame->depth[at] = depth;
    }
    if (frame->id != NULL) {
        frame->id[at] = depth > 0.0f ? picture->view->terrain_id : 0;
    }
}

static void draw(const vd_lens_picture *picture, int tile_x, int tile_y, vd_lens_counts *counts) {
    const vd_frame *frame = picture->frame;
    for (int y = tile_y; y < tile_y + VD_LENS_TILE && y < frame->height; y++) {
        for (int x = tile_x; x < tile_x + VD_LENS_TILE && x < frame->width; x++) {
            float depth;
            const uint32_t color =
                draw_sample(picture->view, (float)x + 0.5f, (float)y + 0.5f, &depth);
            picture->depth[(size_t)y * picture->depth_stride + (size_t)x] = depth;
            put(picture, x, y, color, depth);
            counts->samples++;
            counts->hits += depth > 0.0f;
        }
    }
}

/* Whether depth bends between three neighbours. */
static bool bends(const vd_lens_view *view, float a, float b, float c) {
    const float most = vd_lens_max(a, vd_lens_max(b, c));
    return most * view->edge_share + view->edge_least < fabsf((a - b) + (c - b));
}

static bool is_edge(const vd_lens_picture *picture, int x, int y) {
    const vd_lens_view *view = picture->view;
    const int width = picture->frame->width, height = picture->frame->height;
    const float *row = picture->depth + (size_t)y * picture->depth_stride;
    const float *above = y > 0 ? row - picture->depth_stride : row;
    const float *below = y + 1 < height ? row + picture->depth_stride : row;
    const int left = x > 0 ? x - 1 : x, right = x + 1 < width ? x + 1 : x;
    return view->everywhere || bends(view, row[left], row[x], row[right]) ||
           bends(view, above[x], row[x], below[x]);
}

/* Draws a pixel again: the rounded mean of its samples, the depth of the nearest. */
static void refine_pixel(const vd_lens_picture *picture, int x, int y, vd_lens_counts *counts) {
    const vd_lens_view *view = picture->view;
    const float(*offsets)[2] = vd_sample_offsets(view->samples);
    uint32_t sum[4] = {0, 0, 0, 0};
    float nearest = 0.0f;
    for (int i = 0; i < view->samples; i++) {
        float depth;
        const uint32_t color =
            draw_sample(view, (float)x + offsets[i][0], (float)y + offsets[i][1], &depth);
        for (int channel = 0; channel < 4; channel++) {
            sum[channel] += color >> (8 * channel) & 255;
        }
        nearest = vd_lens_max(nearest, depth);
    }
    uint32_t color = 0;
    for (int channel = 0; channel < 4; channel++) {
        const uint32_t half = (uint32_t)view->samples / 2;
        color |= (sum[channel] + half) / (uint32_t)view->samples << (8 * channel);
    }
    put(picture, x, y, color, nearest);
    counts->samples += (uint64_t)view->samples;
}

static void refine(const vd_lens_picture *picture, int tile_x, int tile_y, vd_lens_counts *counts) {
    const vd_frame *frame = picture->frame;
    for (int y = tile_y; y < tile_y + VD_LENS_TILE && y < frame->height; y++) {
        for (int x = tile_x; x < tile_x + VD_LENS_TILE && x < frame->width; x++) {
            if (is_edge(picture, x, y)) {
                refine_pixel(picture, x, y, counts);
            }
        }
    }
}

const vd_lens_methods vd_lens_methods_reference = {draw, refine};

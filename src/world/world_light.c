/* world_light.c: aiming the light of a world, and the shadows of things on the ground. */
#include "world/world_light.h"
#include <math.h>
#include <veduta/color.h>
#include <veduta/terrain.h>
#include "world/hill_shade.h"

/* What a whole shadow takes of an encoded colour: the floor of VD_SHADOW_SOFT is what is left. */
#define TAKEN 0.65f

/* ---- aiming ---------------------------------------------------------------------------------- */

static void aim_colors(vd_world_light *out, const vd_light *light) {
    const vd_linear *up = &light->ambient_up, *down = &light->ambient_down;
    const float sun[3] = {light->sun.r, light->sun.g, light->sun.b};
    const float ambient[3] = {down->r, down->g, down->b};
    const float more[3] = {up->r - down->r, up->g - down->g, up->b - down->b};
    const float horizon[3] = {light->horizon.r, light->horizon.g, light->horizon.b};
    for (int c = 0; c < 3; c++) {
        out->sun[c] = sun[c];
        out->ambient[c] = ambient[c];
        out->ambient_more[c] = more[c];
        out->haze_color[c] = (float)vd_srgb_encode(horizon[c]) * (1.0f / 65535.0f);
    }
    out->haze = light->haze_m > 0.0 ? (float)(-1.4426950408889634 / light->haze_m) : 0.0f;
}

/* The map relative to the eye: everything large cancels in double. */
static void aim_map(vd_world_light *out, const vd_camera *camera, const vd_sun_map *map,
                    const vd_vec3 axes[3]) {
    const vd_vec3 eye = vd_vec3_subtract(camera->eye, map->origin);
    for (int k = 0; k < 3; k++) {
        const double *a = map->axes_exact[k];
        const vd_vec3 row = {a[0], a[1], a[2]};
        for (int c = 0; c < 3; c++) {
            out->map_axes[k][c] = (float)vd_vec3_dot(row, axes[c]);
        }
        out->map_eye[k] = (float)(vd_vec3_dot(row, eye) + map->at_exact[k]);
        out->map_up[k] = (float)a[2];
    }
    const double focal = sqrt(camera->lens.fx * camera->lens.fy);
    out->pixel_texels = (float)(1.0 / (focal * (double)map->texel_m));
    out->map = map;
}

void vd_world_light_aim(vd_world_light *out, const vd_light *light, const vd_camera *camera,
                        const vd_sun_map *map, const vd_heightfield *heightfield,
                        double exaggeration, bool curvature) {
    *out = (vd_world_light){.heightfield = heightfield, .exaggeration = exaggeration};
    vd_vec3 axes[3];
    for (int c = 0; c < 3; c++) {
        axes[c] = vd_quat_rotate(camera->orientation, vd_vec3_make(c == 0, c == 1, c == 2));
        out->to_sun[c] = (float)vd_vec3_dot(axes[c], light->sun_direction);
        out->up[c] = (float)axes[c].z;
        out->level[0][c] = (float)axes[c].x;
        out->level[1][c] = (float)axes[c].y;
        out->world_from_camera[0][c] = axes[c].x;
        out->world_from_camera[1][c] = axes[c].y;
        out->world_from_camera[2][c] = axes[c].z;
    }
    aim_colors(out, light);
    out->parallel = camera->projection == VD_PROJECTION_ORTHOGRAPHIC;
    const double lens[4] = {camera->lens.fx, camera->lens.fy, camera->lens.cx, camera->lens.cy};
    for (int i = 0; i < 4; i++) {
        out->lens[i] = (float)lens[i];
    }
    out->near_m = (float)camera->near_m;
    out->far_m = (float)camera->far_m;
    out->drop_per_m2 = curvature ? (float)vd_curvature_drop(1.0) : 0.0f;
    out->sun_direction = light->sun_direction;
    out->eye = camera->eye;
    if (map != NULL && map->side > 0) {
        aim_map(out, camera, map, axes);
    }
}

float vd_world_light_past_hills(const vd_world_light *light, const float place[3]) {
    if (light->heightfield == NULL) {
        return 1.0f;
    }
    double at[3] = {light->eye.x, light->eye.y, light->eye.z};
    for (int r = 0; r < 3; r++) {
        const double *m = light->world_from_camera[r];
        at[r] += m[0] * (double)place[0] + (m[1] * (double)place[1] + m[2] * (double)place[2]);
    }
    if (light->drop_per_m2 != 0.0f) {
        at[2] += (double)vd_world_light_drop(light, place[0], place[1], place[2]);
    }
    return vd_hill_shade(light->heightfield, light->exaggeration, light->sun_direction,
                         vd_vec3_make(at[0], at[1], at[2]));
}

/* ---- the ground ------------------------------------------------------------------------------ */

/* Sixteen samples of a row, from picture position (x, y) on. */
typedef struct ground_lanes {
    float place[3][16] __attribute__((aligned(64)));
    float keep[16]; /* share of the colour without haze that is left */
} ground_lanes;

static inline float distance_of(const vd_world_light *light, float depth) {
    return light->parallel ? (1.0f - depth) * light->far_m : light->near_m / depth;
}

/* What hills left of the sun last time, near by. */
typedef struct hills {
    int row;     /* asked for here */
    float depth; /* of the place */
    float past;  /* below 0: some of it */
} hills;

#define HILL_ROWS 8

static bool is_near(const hills *before, float depth) {
    return fabsf(depth - before->depth) < 0.03f * before->depth;
}

/* Takes back what hills hide from the sun already. Their shadows are large: where both ends of a
 * run are alike so is what is between, and some rows more. (Every pixel asked for: 8 times as
 * long.) */
static void spare_hills(const vd_world_light *light, const float depth[16], int row, uint32_t dark,
                        hills *before, ground_lanes *lanes) {
    const int first = __builtin_ctz(dark), last = 31 - __builtin_clz(dark);
    const float(*p)[16] = (const float(*)[16])lanes->place;
    if (row >= before->row + HILL_ROWS || !is_near(before, depth[first]) ||
        !is_near(before, depth[last])) {
        const float a =
            vd_world_light_past_hills(light, (float[3]){p[0][first], p[1][first], p[2][first]});
        const float b =
            first == last
                ? a
                : vd_world_light_past_hills(light, (float[3]){p[0][last], p[1][last], p[2][last]});
        *before = (hills){row, depth[first], a == b && (a == 0.0f || a == 1.0f) ? a : -1.0f};
    }
    for (; dark != 0 && before->past != 1.0f; dark &= dark - 1) {
        const int i = __builtin_ctz(dark);
        const float past =
            before->past >= 0.0f
                ? before->past
                : vd_world_light_past_hills(light, (float[3]){p[0][i], p[1][i], p[2][i]});
        lanes->keep[i] = 1.0f - (1.0f - lanes->keep[i]) * past;
    }
}

/* Returns the lanes that are darkened. */
static uint32_t look_up(const vd_world_light *light, float x, float y, const float depth[16],
                        uint32_t mask, hills *before, ground_lanes *lanes) {
    float across[16], down[16], z[16], width[16], share[16];
    for (int i = 0; i < 16; i++) {
        across[i] = x + (float)i;
        down[i] = y;
        z[i] = distance_of(light, depth[i]);
        width[i] = vd_world_light_width(light, z[i]);
    }
    vd_world_light_place(light, across, down, z, lanes->place);
    /* A little towards the sun, or the lit foot of a thing would darken the ground before it. */
    for (int c = 0; c < 3; c++) {
        const float towards = light->to_sun[c] * (0.5f * light->map->texel_m);
        for (int i = 0; i < 16; i++) {
            lanes->place[c][i] = lanes->place[c][i] + towards * width[i];
        }
    }
    const uint32_t dark = vd_world_light_shares(light, mask, lanes->place, width, share);
    if (dark != 0) {
        for (int i = 0; i < 16; i++) {
            lanes->keep[i] = 1.0f - TAKEN * (1.0f - share[i]);
        }
        if (light->heightfield != NULL) {
            spare_hills(light, depth, (int)y, dark, before, lanes);
        }
    }
    return dark;
}

/* What is left of an encoded colour, whose haze stays. */
static inline float darken(const vd_world_light *light, float color, int channel, float keep,
                           float left) {
    const float haze = light->haze_color[channel] * (1.0f - left);
    const float result = (color - haze) * keep + haze;
    return result > 0.0f ? result : 0.0f;
}

/* Whether ground between two depths in a rectangle of the picture may be in shadow: bounds of it in
 * the map, against the map's edges and the blocks that it covers. */
static bool may_be_dark(const vd_world_light *light, const float rectangle[4], float nearest,
                        float farthest) {
    const vd_sun_map *map = light->map;
    float least[3] = {INFINITY, INFINITY, INFINITY}, most[3] = {-INFINITY, -INFINITY, -INFINITY};
    float x[16], y[16], z[16], place[3][16];
    for (int i = 0; i < 16; i++) {
        x[i] = rectangle[i & 1];
        y[i] = rectangle[2 + (i >> 1 & 1)];
        z[i] = distance_of(light, (i & 4) != 0 ? nearest : farthest);
    }
    vd_world_light_place(light, x, y, z, place);
    float drop = 0.0f;
    for (int i = 0; i < 8; i++) {
        const float here = vd_world_light_drop(light, place[0][i], place[1][i], place[2][i]);
        drop = here > drop ? here : drop;
    }
    for (int k = 0; k < 3; k++) {
        const float *a = light->map_axes[k], bend = light->map_up[k] * drop;
        for (int i = 0; i < 8; i++) {
            const float at =
                a[0] * place[0][i] + (a[1] * place[1][i] + a[2] * place[2][i]) + light->map_eye[k];
            const float low = bend < 0.0f ? at + bend : at, high = bend > 0.0f ? at + bend : at;
            least[k] = low < least[k] ? low : least[k];
            most[k] = high > most[k] ? high : most[k];
        }
    }
    const float end = (float)map->side;
    if (!(most[0] >= 0.0f && most[1] >= 0.0f && least[0] <= end && least[1] <= end &&
          least[2] <= map->highest_of_all)) {
        return false;
    }
    const int blocks = map->side / VD_SUN_MAP_BLOCK, last = blocks - 1;
    int edge[4];
    for (int i = 0; i < 4; i++) { /* a block wide of it */
        const float at = i < 2 ? least[i] - VD_SUN_MAP_BLOCK : most[i - 2] + VD_SUN_MAP_BLOCK;
        const int block = at > 0.0f ? at < end ? (int)at / VD_SUN_MAP_BLOCK : last : 0;
        edge[i] = block < last ? block : last;
    }
    for (int r = edge[1]; r <= edge[3]; r++) {
        for (int c = edge[0]; c <= edge[2]; c++) {
            if (map->highest[r * blocks + c] > least[2]) {
                return true;
            }
        }
    }
    return false;
}

/* The greatest and the least depth of the window's ground. False when there is none. */
static bool find_depths(const vd_target *t, uint32_t ground_id, float *nearest, float *farthest) {
    float most = 0.0f, least = INFINITY;
    for (int s = 0; s < t->samples; s++) {
        for (int y = 0; y < t->height; y++) {
            const size_t at = (size_t)s * t->plane + (size_t)y * t->stride;
            for (int x = 0; x < t->width; x++) {
                const float depth = t->depth[at + (size_t)x];
                const bool ground = t->id[at + (size_t)x] == ground_id && depth > 0.0f;
                most = ground && depth > most ? depth : most;
                least = ground && depth < least ? depth : least;
            }
        }
    }
    *nearest = most;
    *farthest = least;
    return most > 0.0f;
}

#define BLOCK 16

/* Shades up to 16 samples of a row from column x of the window. */
static void shade_run(const vd_world_light *light, const vd_target *t, int sample, int x, int y,
                      uint32_t ground_id, const uint8_t *wanted, hills *before) {
    const float *offset = vd_sample_offsets(t->samples)[sample];
    const size_t row = (size_t)sample * t->plane + (size_t)y * t->stride + (size_t)x;
    const int count = t->width - x < 16 ? t->width - x : 16;
    float depth[16];
    uint32_t mask = 0;
    for (int i = 0; i < 16; i++) {
        const size_t at = row + (size_t)(i < count ? i : 0);
        depth[i] = t->depth[at];
        const bool asked = i < count && (wanted == NULL || wanted[i] != 0);
        mask |= (uint32_t)(asked && t->id[at] == ground_id && depth[i] > 0.0f) << i;
    }
    if (mask == 0) {
        return;
    }
    ground_lanes lanes;
    uint32_t dark = look_up(light, (float)(t->x + x) + offset[0], (float)(t->y + y) + offset[1],
                            depth, mask, before, &lanes);
    for (; dark != 0; dark &= dark - 1) {
        const int i = __builtin_ctz(dark);
        const float left =
            vd_world_light_left(light, lanes.place[0][i], lanes.place[1][i], lanes.place[2][i]);
        uint16_t *color = t->color + 4 * (row + (size_t)i);
        for (int c = 0; c < 3; c++) {
            const float was = (float)color[c] * (1.0f / 65535.0f);
            color[c] = (uint16_t)(darken(light, was, c, lanes.keep[i], left) * 65535.0f + 0.5f);
        }
    }
}

/* Shades a part of at most BLOCK × BLOCK pixels, if any of it may be dark: things are few, and most
 * of a picture lies far from their shadows. (Parts of 64 × 64: twice as long.) */
static void shade_block(const vd_world_light *light, const vd_target *window, uint32_t ground_id,
                        const uint8_t *wanted, size_t wanted_stride) {
    float nearest, farthest;
    if (!find_depths(window, ground_id, &nearest, &farthest)) {
        return;
    }
    const float rectangle[4] = {(float)window->x, (float)(window->x + window->width),
                                (float)window->y, (float)(window->y + window->height)};
    if (!may_be_dark(light, rectangle, nearest, farthest)) {
        return;
    }
    hills before = {-HILL_ROWS, 0.0f, -1.0f};
    for (int y = 0; y < window->height; y++) {
        for (int s = 0; s < window->samples; s++) {
            shade_run(light, window, s, 0, y, ground_id,
                      wanted != NULL ? wanted + (size_t)y * wanted_stride : NULL, &before);
        }
    }
}

void vd_world_shade_ground(const vd_world_light *light, vd_target *window, uint32_t ground_id,
                           const uint8_t *wanted, size_t wanted_stride) {
    for (int y = 0; light->map != NULL && y < window->height; y += BLOCK) {
        for (int x = 0; x < window->width; x += BLOCK) {
            vd_target part = *window;
            const size_t at = (size_t)y * window->stride + (size_t)x;
            part.x += x;
            part.y += y;
            part.width = window->width - x < BLOCK ? window->width - x : BLOCK;
            part.height = window->height - y < BLOCK ? window->height - y : BLOCK;
            part.color += 4 * at;
            part.depth += at;
            part.id += at;
            shade_block(light, &part, ground_id,
                        wanted != NULL ? wanted + (size_t)y * wanted_stride + (size_t)x : NULL,
                        wanted_stride);
        }
    }
}

static void shade_picture_run(const vd_world_light *light, const float *from, uint8_t *rgba, int x,
                              int y, int count, hills *before) {
    float depth[16];
    uint32_t mask = 0;
    for (int i = 0; i < 16; i++) {
        depth[i] = from[i < count ? i : 0];
        mask |= (uint32_t)(i < count && depth[i] > 0.0f) << i;
    }
    if (mask == 0) {
        return;
    }
    ground_lanes lanes;
    uint32_t dark = look_up(light, (float)x + 0.5f, (float)y + 0.5f, depth, mask, before, &lanes);
    for (; dark != 0; dark &= dark - 1) {
        const int i = __builtin_ctz(dark);
        const float left =
            vd_world_light_left(light, lanes.place[0][i], lanes.place[1][i], lanes.place[2][i]);
        for (int c = 0; c < 3; c++) {
            const float was = (float)rgba[4 * i + c] * (1.0f / 255.0f);
            rgba[4 * i + c] = (uint8_t)(darken(light, was, c, lanes.keep[i], left) * 255.0f + 0.5f);
        }
    }
}

/* The same for a picture. */
static void shade_picture_block(const vd_world_light *light, const vd_frame *ground,
                                vd_frame *frame, int x, int y, int width, int height) {
    float nearest = 0.0f, farthest = INFINITY;
    for (int row = y; row < y + height; row++) {
        const float *depth = ground->depth + (size_t)row * ground->stride + (size_t)x;
        for (int i = 0; i < width; i++) {
            nearest = depth[i] > nearest ? depth[i] : nearest;
            farthest = depth[i] > 0.0f && depth[i] < farthest ? depth[i] : farthest;
        }
    }
    const float rectangle[4] = {(float)x, (float)(x + width), (float)y, (float)(y + height)};
    if (!(nearest > 0.0f) || !may_be_dark(light, rectangle, nearest, farthest)) {
        return;
    }
    hills before = {-HILL_ROWS, 0.0f, -1.0f};
    for (int row = y; row < y + height; row++) {
        shade_picture_run(light, ground->depth + (size_t)row * ground->stride + (size_t)x,
                          frame->rgba + 4 * ((size_t)row * frame->stride + (size_t)x), x, row,
                          width, &before);
    }
}

void vd_world_shade_picture(const vd_world_light *light, const vd_frame *ground, vd_frame *frame,
                            int x, int y, int width, int height) {
    for (int row = y; light->map != NULL && row < y + height; row += BLOCK) {
        for (int i = x; i < x + width; i += BLOCK) {
            shade_picture_block(light, ground, frame, i, row,
                                x + width - i < BLOCK ? x + width - i : BLOCK,
                                y + height - row < BLOCK ? y + height - row : BLOCK);
        }
    }
}

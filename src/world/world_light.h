/* world_light.h: light, haze and shadows of one picture, in floats relative to the eye. */
#ifndef VEDUTA_WORLD_WORLD_LIGHT_H
#define VEDUTA_WORLD_WORLD_LIGHT_H

#include <math.h>
#include <veduta/camera.h>
#include <veduta/heightfield.h>
#include <veduta/light.h>
#include <veduta/target.h>
#include "core/real.h"
#include "world/sun_map.h"

typedef struct vd_world_light {
    /* As terrain has it: albedo · (sun · max(0, n·l) · visible + ambient + more · (½ + ½ n.z)),
     * encoded, then mixed with the horizon's encoded colour by 1 − 2^(haze · metres). */
    float sun[3], ambient[3], ambient_more[3];
    float haze; /* at most 0; 0: none */
    float haze_color[3];
    float to_sun[3], up[3]; /* camera space */
    bool parallel;          /* orthographic */
    float lens[4], near_m, far_m;
    float drop_per_m2; /* curvature: what is d metres away appears lower by this times d² */
    float level[2][3]; /* east and north of a place in camera space */
    /* The map of shadows, null for none: column, row and height of a place p in camera space are
     * map_axes[i]·p + map_eye[i]; a metre up in the world adds map_up. */
    const vd_sun_map *map;
    float map_axes[3][3], map_eye[3], map_up[3];
    float pixel_texels; /* how many texels wide a pixel is, a metre along the view axis */
    /* Hills, null for none. */
    const vd_heightfield *heightfield;
    double exaggeration;
    vd_vec3 sun_direction, eye;
    double world_from_camera[3][3];
} vd_world_light;

/* Aims the light of a world at a camera. `map` and `heightfield` may be null; they and nothing else
 * must live as long as the light is used. An empty map counts as none. */
void vd_world_light_aim(vd_world_light *out, const vd_light *light, const vd_camera *camera,
                        const vd_sun_map *map, const vd_heightfield *heightfield,
                        double exaggeration, bool curvature);

/* Whether the hills let the sun reach a place in camera space, 0 … 1. */
float vd_world_light_past_hills(const vd_world_light *light, const float place[3]);

/* Darkens the ground where things throw shadows on it: of every sample of the window whose id is
 * `ground_id`, the colour without its haze to 0.35 + 0.65 · share, as the softest of the terrain's
 * own shadows (VD_SHADOW_SOFT), but not where hills hide the sun already. The colours must be
 * hazed as the light says. `wanted` [height][wanted_stride]: the pixels that are looked at, where
 * not 0; null: all. One thread a window. Cost: a nanosecond a sample where the map has nothing near
 * the window, 15 among a thousand trees. */
void vd_world_shade_ground(const vd_world_light *light, vd_target *window, uint32_t ground_id,
                           const uint8_t *wanted, size_t wanted_stride);

/* The same for the part [x, x + width) × [y, y + height) of a frame (which may be `ground`) whose
 * pixels are ground
 * wherever `ground` has a depth, at pixel centres: for what is copied from a picture of the ground
 * alone. */
void vd_world_shade_picture(const vd_world_light *light, const vd_frame *ground, vd_frame *frame,
                            int x, int y, int width, int height);

/* Camera space of 16 places from picture position and distance along the view axis. */
static inline void vd_world_light_place(const vd_world_light *light, const float x[16],
                                        const float y[16], const float z[16], float place[3][16]) {
    const float across = 1.0f / light->lens[0], down = 1.0f / light->lens[1];
    for (int i = 0; i < 16; i++) {
        const float scale = light->parallel ? 1.0f : z[i];
        place[0][i] = (x[i] - light->lens[2]) * across * scale;
        place[1][i] = (y[i] - light->lens[3]) * down * scale;
        place[2][i] = z[i];
    }
}

/* How far up a place was before the Earth's curve lowered it, metres. */
static inline float vd_world_light_drop(const vd_world_light *light, float x, float y, float z) {
    const float *e = light->level[0], *n = light->level[1];
    const float east = e[0] * x + (e[1] * y + e[2] * z), north = n[0] * x + (n[1] * y + n[2] * z);
    return light->drop_per_m2 * (east * east + north * north);
}

/* Looks 16 places of camera space up in the map: vd_sun_map_shares. */
static inline uint32_t vd_world_light_shares(const vd_world_light *light, uint32_t mask,
                                             float place[3][16], const float width[16],
                                             float share[16]) {
    float at[3][16] __attribute__((aligned(64)));
    for (int k = 0; k < 3; k++) {
        const float *a = light->map_axes[k];
        for (int i = 0; i < 16; i++) {
            at[k][i] = (a[0] * place[0][i] + (a[1] * place[1][i] + a[2] * place[2][i])) +
                       light->map_eye[k];
        }
    }
    for (int i = 0; light->drop_per_m2 != 0.0f && i < 16; i++) {
        const float up = vd_world_light_drop(light, place[0][i], place[1][i], place[2][i]);
        for (int k = 0; k < 3; k++) {
            at[k][i] = at[k][i] + light->map_up[k] * up;
        }
    }
    return vd_sun_map_shares(light->map, mask, at[0], at[1], at[2], width, share);
}

/* How much of its own colour haze leaves a place. */
static inline float vd_world_light_left(const vd_world_light *light, float x, float y, float z) {
    const float away = light->parallel ? z : sqrtf(x * x + (y * y + z * z));
    return vd_exp2_negative(away * light->haze);
}

/* The width of the box for a pixel at a distance, in texels. */
static inline float vd_world_light_width(const vd_world_light *light, float z) {
    const float width = light->pixel_texels * (light->parallel ? 1.0f : z);
    return width > 1.0f ? width < 3.0f ? width : 3.0f : 1.0f;
}

#endif

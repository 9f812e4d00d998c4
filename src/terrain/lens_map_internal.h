/* lens_map_internal.h: what the reference of the lens map and its twin share: shapes, constants of
 * the light, and the small rules that both follow to the bit. */
#ifndef VEDUTA_TERRAIN_LENS_MAP_INTERNAL_H
#define VEDUTA_TERRAIN_LENS_MAP_INTERNAL_H

#include <math.h>
#include <veduta/shadow.h>
#include "image/srgb.h"
#include "terrain/lens_map.h"

#define VD_LENS_COLORS 16384 /* entries of a table of colours by height */

/* Everything that lighting needs and that is the same for all texels. */
typedef struct vd_lens_light {
    const vd_heightfield *map;
    const float *heights; /* level 0 */
    size_t stride;
    bool shading;
    /* The surface rises by slope[0]·c + slope[1]·r to the east and slope[2]·c + slope[3]·r to the
     * north, for the differences of heights c per column and r per row. */
    float slope[4];
    float to_sun[3];                           /* east, north, up */
    float sun[3], ambient[3], ambient_more[3]; /* ambient + ambient_more·(½ + ½N.z) */
    float visible[256];                        /* share of the sun by count */
    bool shadows;
    vd_shadow_def shadow;
    const uint8_t *counts; /* [height][counts_stride], null without shadows */
    size_t counts_stride;
    double sample_from_texture[6];
    int factor;    /* texels of size 0 per colour pixel */
    bool coincide; /* texel (c, r) of size 0 lies at sample (c, r) */
    /* Colours by height: entry i is the colour map's at table_from + i·table_step, a power of two
     * that is at most 1 m wherever the range of heights allows it, so that whole metres are met. */
    bool has_table;
    int table_count;
    float table_from, table_step, table_scale; /* scale is 1 / step */
    uint32_t table[VD_LENS_COLORS];
} vd_lens_light;

/* Where a texel lies between two samples. */
typedef struct vd_lens_place {
    int32_t first; /* and first + 1, which exists */
    float weight;  /* of the second, 0 … 1 */
} vd_lens_place;

/* A place on one axis of `samples` >= 2 samples, clamped to it. */
static inline vd_lens_place vd_lens_place_at(double position, int samples) {
    const double last = samples - 1;
    const double p = position > 0.0 ? (position < last ? position : last) : 0.0;
    const int32_t cell = (int32_t)p < samples - 2 ? (int32_t)p : samples - 2;
    return (vd_lens_place){cell, (float)(p - cell)};
}

/* Where a texel lies between two colour pixels: the weight of the second in 1/256. */
typedef struct vd_lens_mix {
    int32_t first, second;
    uint32_t weight;
} vd_lens_mix;

static inline vd_lens_mix vd_lens_mix_at(int texel, int factor, int pixels) {
    const double p = (texel + 0.5) / factor - 0.5, whole = floor(p);
    const int i = (int)whole;
    vd_lens_mix mix = {i > 0 ? i : 0, i + 1, (uint32_t)((p - whole) * 256.0)};
    mix.second = mix.second < pixels ? mix.second : pixels - 1;
    return mix;
}

/* Shapes and memory of a map without contents. Returns the errors of vd_lens_map_init. */
VD_MUST_USE vd_status vd_lens_map_lay_out(vd_context *context, const vd_terrain_def *def,
                                          vd_lens_map *out);

/* All of a light but its table's colours. Fails as vd_lens_map_init. */
VD_MUST_USE vd_status vd_lens_light_init(const vd_lens_map *map, const vd_terrain_def *def,
                                         vd_lens_light *out);

/* Of these, what needs no heightfield but light->map's least and greatest height: colours of the
 * light and the table's scale. */
void vd_lens_light_constants(const vd_terrain_def *def, vd_lens_light *light);

/* Fills entries [first, end) of the table. */
void vd_lens_light_fill(vd_lens_light *light, const vd_terrain_def *def, int first, int end);

/* Single values of the reference, which the twin's borders and rare cases are made of too: the mean
 * of a level around a sample that is no hole; the two terms of the light at a sample; a lit texel.
 */
float vd_lens_mean(const vd_lens_ground *fine, int column, int row);

typedef struct vd_lens_terms {
    float direct, up; /* max(0, N·L) × visible, N.z */
} vd_lens_terms;

vd_lens_terms vd_lens_terms_at(const vd_lens_light *light, int column, int row);
uint32_t vd_lens_color_at(const vd_lens_light *light, float height); /* of the table */
uint32_t vd_lens_lit(const vd_lens_light *light, uint32_t albedo, vd_lens_terms terms);
uint32_t vd_lens_texel(const vd_lens_light *light, int x, int y);

/* The kernels of a level (VD_ISA_V2 … VD_ISA_V4). */
const struct vd_lens_kernels *vd_lens_kernels_for(vd_isa isa);

/* ---- kernels ----------------------------------------------------------------------------------
 * Arrays may lie anywhere and are read and written within the counts given only. */

/* Samples of one row of a level, out[0 … count), whose centres are fine columns first, first + 2 …
 * in `here`; all columns first − 1 … first + 2·count − 1 exist. A missing row is null. A sum with a
 * hole in it is left for the caller: returns true then, and out has −infinity or NaN there. */
typedef bool vd_kernel_lens_mean(const float *above, const float *here, const float *below,
                                 int first, int count, float *restrict out);

/* The lowest of `count` heights that are not holes, and of `low`. */
typedef float vd_kernel_lens_lowest(const float *heights, int count, float low);

/* One row of M: out[i] from columns 2i … 2i + reach − 1 of `rows` rows (the last of `width` columns
 * repeated) and samples i, i + 1 of the two coarse rows. */
typedef void vd_kernel_lens_maxima(const float *const rows[3], int width, int reach,
                                   const float *const coarse[2], int count, float *restrict out);

/* direct and up of samples [first, first + count) of a row, none of them the row's first or last:
 * to element 0 … count − 1. */
typedef void vd_kernel_lens_terms(const vd_lens_light *light, int row, int first, int count,
                                  float *restrict direct, float *restrict up);

/* The table's colours of heights. */
typedef void vd_kernel_lens_table(const vd_lens_light *light, const float *heights, int count,
                                  uint32_t *restrict out);

/* Lit texels of unlit ones. */
typedef void vd_kernel_lens_shade(const vd_lens_light *light, const uint32_t *albedo,
                                  const float *direct, const float *up, int count,
                                  uint32_t *restrict out);

/* out = a + (b − a)·weight */
typedef void vd_kernel_lens_blend(const float *a, const float *b, float weight, int count,
                                  float *restrict out);

/* out[i] = v[first[i]] + (v[first[i] + 1] − v[first[i]])·weight[i] */
typedef void vd_kernel_lens_spread(const float *v, const int32_t *first, const float *weight,
                                   int count, float *restrict out);

/* Colours bilinear between pixels of two rows, whose second weighs row_weight / 256. */
typedef void vd_kernel_lens_mix(const uint32_t *top, const uint32_t *bottom, uint32_t row_weight,
                                const vd_lens_mix *mix, int count, uint32_t *restrict out);

/* One row of a half size; all of columns 0 … 2·count − 1 exist. */
typedef void vd_kernel_lens_half(const uint32_t *top, const uint32_t *bottom, int count,
                                 uint32_t *restrict out);

typedef struct vd_lens_kernels {
    vd_kernel_lens_mean *mean;
    vd_kernel_lens_lowest *lowest;
    vd_kernel_lens_maxima *maxima;
    vd_kernel_lens_terms *terms;
    vd_kernel_lens_table *table;
    vd_kernel_lens_shade *shade;
    vd_kernel_lens_blend *blend;
    vd_kernel_lens_spread *spread;
    vd_kernel_lens_mix *mix;
    vd_kernel_lens_half *half;
} vd_lens_kernels;

extern const vd_lens_kernels vd_lens_kernels_v2;
extern const vd_lens_kernels vd_lens_kernels_v3;
extern const vd_lens_kernels vd_lens_kernels_v4;

/* The parts that a map owns, to be written. */
static inline float *vd_lens_heights(const vd_lens_map *map, int level) {
    return (float *)(uintptr_t)map->ground[level].heights;
}

/* Entry (0, 0) of M(level), level >= 1. */
static inline float *vd_lens_maxima(const vd_lens_map *map, int level) {
    return (float *)(uintptr_t)map->ground[level - 1].maxima + map->ground[level - 1].offset[1];
}

static inline uint32_t *vd_lens_texels(const vd_lens_map *map, int size) {
    return (uint32_t *)(uintptr_t)map->texture[size].texels;
}

#endif

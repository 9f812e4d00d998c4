/* surface.h: a heightfield seen as a surface over the world: what the drawing methods share.
 *
 * Along a ray, column and row are linear in the ray's parameter t, and so the height of the
 * bilinear surface within one cell is a quadratic in t. Curvature and refraction add a quadratic to
 * the ray's own height. A hit is therefore the root of one quadratic a cell: nothing is iterated.
 */
#ifndef VEDUTA_TERRAIN_SURFACE_H
#define VEDUTA_TERRAIN_SURFACE_H

#include <veduta/terrain.h>

typedef struct vd_surface vd_surface;
typedef struct vd_surface_hit vd_surface_hit;

struct vd_surface {
    const vd_heightfield *heightfield;
    const float *heights; /* level 0, VD_HEIGHT_F32 */
    size_t stride;
    double exaggeration;
    double sample_from_world[6]; /* the inverse of world_from_sample, same layout */
    double top;                  /* a height above all ground, exaggerated, with a margin */
    double lift;                 /* shadow rays start this much above the surface, metres */
    double curvature;            /* (1 − k)/(2R) per metre, or 0 */
};

/* Where a ray meets the ground. */
struct vd_surface_hit {
    double t;           /* the ray's parameter */
    double column, row; /* in samples */
    double height;      /* metres, exaggerated */
};

/* Fails with VD_ERROR_ARGUMENT when the heightfield is not drawable (not float, or its
 * world_from_sample is singular). */
VD_MUST_USE vd_status vd_surface_init(const vd_terrain_def *def, vd_surface *out);

/* Follows one ray from the parameter t_min on to its first hit; false when it hits nothing.
 * `curvature` bends the ray up relative to the ground by curvature × (horizontal distance from its
 * origin)². */
typedef bool vd_surface_cast_function(const vd_surface *surface, const vd_ray *ray, double t_min,
                                      double curvature, vd_surface_hit *hit);

vd_surface_cast_function vd_surface_raycast; /* the reference: through every cell */
vd_surface_cast_function vd_surface_march;   /* its twin: past blocks that lie under the ray */

/* The unit normal at a surface point: central differences at the samples, bilinear between. */
vd_vec3 vd_surface_normal(const vd_surface *surface, double column, double row);

/* The encoded colour of a surface point before lighting. */
vd_rgba8 vd_surface_color(const vd_terrain_def *def, const vd_surface_hit *hit);

#endif

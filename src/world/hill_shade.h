/* hill_shade.h: whether the sun is seen past the terrain, from any point.
 *
 * The terrain's own shadows are counted for its samples once (shadow.h). Things that stand on it
 * are anywhere: for them a ray is followed towards the sun, over blocks of cells that lie under it
 * by the heightfield's pyramid of maxima, down to single cells, whose bilinear surface the ray's
 * height is compared with exactly. A ray towards the sun only rises, so it ends at the highest
 * ground: some twenty blocks.
 */
#ifndef VEDUTA_WORLD_HILL_SHADE_H
#define VEDUTA_WORLD_HILL_SHADE_H

#include <stdbool.h>
#include <veduta/heightfield.h>

/* Rays that pass the ground by less than this, in metres a metre, see only part of the sun, whose
 * disc is so wide. */
#define VD_SUN_WIDTH 0.0093

typedef enum vd_hill_shade_kind {
    VD_HILL_SHADE_LIT = 0,
    VD_HILL_SHADE_DARK,
    VD_HILL_SHADE_MIXED
} vd_hill_shade_kind;

/* Returns the share of the sun that a point sees past the terrain, 0 … 1: 0 behind it, 1 where the
 * ray clears all of it by the sun's width, straight in between. `point` is in the world, metres,
 * over heights times `exaggeration` (> 0); below the ground it counts as on it, and on the ground
 * as a thousandth of a cell above. `sun` is the unit vector towards the sun; at or below the
 * horizon it gives 0. Holes and what lies beyond a map that ends at its edge hide nothing. Any
 * thread. */
float vd_hill_shade(const vd_heightfield *heightfield, double exaggeration, vd_vec3 sun,
                    vd_vec3 point);

/* The least and the greatest share at what stands for a box: its corners, its middle and the middle
 * of its foot. A shadow's edge that runs between these through a large box is not found: what is
 * asked for is the right look of a thing, at ten rays. */
vd_hill_shade_kind vd_hill_shade_box(const vd_heightfield *heightfield, double exaggeration,
                                     vd_vec3 sun, vd_vec3 min, vd_vec3 max, float *least,
                                     float *most);

#endif

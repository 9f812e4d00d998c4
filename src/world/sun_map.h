/* sun_map.h: which part of the sun reaches a point past the things that throw shadows.
 *
 * A depth map seen from the sun (Williams 1978): what it does not see is in shadow. The map lies on
 * a plane across the sun's rays and covers the casters; a texel keeps
 *
 *      sun  ╲  ╲  ╲             top      how high above the plane the first thing is that its ray
 *            ╲  ╲  ╲                     meets, metres; −infinity where there is none
 *          ┌──╲─ ─╲─ top        bottom   the same of the last, seen from the other side
 *          │ caster ╲           alpha    how much of the light the first thing takes, 255 all
 *          └───╲─────bottom
 *      ─ ─ ─ ─ ─╲─ ─ ─ ─ plane
 *
 * as Lawlor 2004 keeps them for impostors' shadows. What is solid takes all light below its top;
 * what lets light through takes its part on the way from its top to its bottom. Where all is solid
 * there is no bottom: nothing would read it.
 *
 * A point's share is the weighted part of 2 × 2 … 4 × 4 texels around it whose top is not above it
 * (percentage-closer filtering, Reeves, Salesin & Cook 1987): a box as wide as the point's
 * footprint, between one texel and three, over texels that are one wide themselves. So a shadow's
 * edge is as soft as a texel or as a pixel, whichever is larger.
 *
 * Places are floats relative to the map's origin, which stands on a multiple of 2^−10 m: a world
 * that is moved by such a multiple gives the same map to the byte.
 */
#ifndef VEDUTA_WORLD_SUN_MAP_H
#define VEDUTA_WORLD_SUN_MAP_H

#include <veduta/raster.h>
#include "core/buffer.h"
#include "core/list.h"

#define VD_SUN_MAP_LEAST 256
#define VD_SUN_MAP_MOST 4096
#define VD_SUN_MAP_BLOCK 8 /* texels a side that `highest` is over */

typedef struct vd_sun_map {
    vd_context *context;
    vd_vec3 origin, sun; /* of the world; unit vector towards the sun */
    int side;            /* texels, a multiple of VD_SUN_MAP_BLOCK; 0: nothing throws a shadow */
    float texel_m;
    /* A place p relative to the origin, in floats: column u, row v (texel centres at +½) and height
     * above the plane, metres: axes[i]·p + at[i]. */
    float axes[3][3], at[3];
    double axes_exact[3][3], at_exact[3];
    size_t stride;  /* texels from one row to the next */
    float *top;     /* [side][stride] */
    float *bottom;  /* [side][stride]; null where all casters are solid */
    uint8_t *alpha; /* [side][stride] */
    /* The highest top of the texels that a point over a block may look at: those of the block and
     * two around it. [side / 8][side / 8] */
    float *highest;
    float highest_of_all;
    /* How it is drawn. */
    vd_raster *raster;
    vd_frame *frame;
    vd_target **targets; /* [threads] */
    vd_buffer texels, blocks;
    vd_list draws, materials;
    uint64_t drawn;  /* hash of what is in it */
    uint64_t redraw; /* how often it was drawn */
} vd_sun_map;

/* An empty map: all points are lit. *out is owned by the caller. Returns VD_ERROR_MEMORY. */
VD_MUST_USE vd_status vd_sun_map_create(vd_context *context, vd_sun_map **out);
void vd_sun_map_destroy(vd_sun_map **map);

/* Draws the casters, which lie within [min, max] of the world, as the unit vector `sun` sees them;
 * does nothing when all that is given is as it was (meshes, materials and textures are told by
 * their addresses). Both faces of a draw throw shadows, whatever it culls; points and lines throw
 * none. Materials with an alpha test have holes; those that blend take as much light as their alpha
 * says, and hide from the map what is under them. The side, a power of two from 256 to 4096, is the
 * least that gives a typical caster 24 texels; the map takes 5 bytes a texel (0.3 … 84 MB), 9 with
 * a bottom, and a target of 256 × 256 pixels a thread. A sun at or below the horizon, no casters,
 * or a box whose min is above its max empty the map. Cost: 2048² texels with 1,000 boxes 45 ms on
 * one thread. Runs on the context's threads; `job` may be null. Returns the errors of
 * vd_raster_prepare or VD_ERROR_CANCELLED; the map is then empty. */
VD_MUST_USE vd_status vd_sun_map_draw(vd_sun_map *map, vd_job *job, vd_vec3 sun,
                                      const vd_draw *draws, int count, vd_vec3 min, vd_vec3 max);

/* Returns a world point relative to the map's origin. */
static inline void vd_sun_map_place(const vd_sun_map *map, vd_vec3 point, float out[3]) {
    const vd_vec3 p = vd_vec3_subtract(point, map->origin);
    out[0] = (float)p.x;
    out[1] = (float)p.y;
    out[2] = (float)p.z;
}

/* Returns the share of the sun, 0 … 1, that reaches a point, given relative to the map's origin;
 * `footprint_m` is how wide the point is. A caster's own surface must be lifted by
 * vd_sun_map_lift. Any thread. */
float vd_sun_map_share(const vd_sun_map *map, const float point[3], float footprint_m);

/* How far along its unit normal a caster's surface is moved before it is looked up, so that it is
 * not in its own shadow, metres: what it rises over the texels looked at, by the sine of the angle
 * between normal and sun, and a quarter of a texel. `width` is the box's, in texels, see below. */
static inline float vd_sun_map_lift(const vd_sun_map *map, float width, float sine) {
    return map->texel_m * (0.25f + 0.7072f * (width + 1.0f) * sine);
}

/* The width in texels of the box for a footprint: 1 … 3. */
static inline float vd_sun_map_width(const vd_sun_map *map, float footprint_m) {
    const float width = footprint_m / map->texel_m;
    return width > 1.0f ? width < 3.0f ? width : 3.0f : 1.0f;
}

/* The same for 16 points, given as column, row and height above the plane, and the width of the
 * box in texels; lanes outside the mask get 1. Returns the lanes that are in some shadow. */
uint32_t vd_sun_map_shares(const vd_sun_map *map, uint32_t mask, const float column[16],
                           const float row[16], const float height[16], const float width[16],
                           float share[16]);

#endif

/* shadow.h: the shadows that a terrain throws on itself, counted for every cell.
 *
 * FutSpace 2020, §6.2: from every cell a ray is followed towards the sun for 255 steps of 4
 * samples, and the steps at which it is under the terrain are counted. The count, not a yes or no,
 * darkens the cell: crevasses and the feet of high walls become darker, and shadows fade towards
 * their tips.
 *
 * The definition, one for the reference and its twin, for the sun's unit vector L (east, north,
 * up):
 *
 *     dx(k) = floor(k · stride · L.east + ½)            columns
 *     dy(k) = floor(−k · stride · L.north + ½)          rows (row 0 is north)
 *     t(k)  = k · stride · cell · L.up, as float        height units
 *     count(c, r) = number of k in 1 … steps with  h(c, r) + t(k) < h(c + dx(k), r + dy(k))
 *
 * computed in double, compared exactly for 8 and 16 bits and as a float sum for float heights.
 * The published code rounds each cell's own position; here a step's offset is the same integers for
 * all cells, so that the result is exact and a step is a shift of the whole map. Outside a map that
 * ends at its edge nothing is higher. A hole (float maps) throws no shadow and its count is 0.
 */
#ifndef VEDUTA_SHADOW_H
#define VEDUTA_SHADOW_H

#include <veduta/color.h>
#include <veduta/heightfield.h>
#include <veduta/job.h>

VD_BEGIN_DECLARATIONS

typedef enum vd_shadow_edge {
    VD_SHADOW_EDGE_MAP = 0, /* as the heightfield says */
    VD_SHADOW_EDGE_WRAP,    /* the map repeats (classic) */
    VD_SHADOW_EDGE_END,     /* outside counts as not under */
    VD_SHADOW_EDGE_COUNT
} vd_shadow_edge;

typedef enum vd_shadow_method {
    VD_SHADOW_SHIFT = 0, /* the fast twin; the same counts */
    VD_SHADOW_REFERENCE, /* the published loops, one thread */
    VD_SHADOW_METHOD_COUNT
} vd_shadow_method;

typedef struct vd_shadow_def {
    double azimuth_rad;  /* of the sun, clockwise from north (up in the map); any finite angle */
    double altitude_rad; /* of the sun above the horizon, 0 … π/2 */
    double cell;         /* distance of neighbouring samples, in units of height; > 0 */
    double stride;       /* samples a step, above 0, at most 64 */
    int steps;           /* 1 … 255 */
    vd_shadow_edge edge;
    vd_shadow_method method;
    /* The general form, for cells that are not square or not aligned to the compass: columns, rows
     * and height units that one step towards the sun advances. The first two at most 64, the rise
     * at least 0. All 0: those of azimuth_rad, altitude_rad, cell and stride, as above; else these
     * four are not used. */
    double step_columns, step_rows, step_rise;
} vd_shadow_def;

/* As published: cell 1, stride 4, 255 steps; the map's own edge; the sun at azimuth 315°, altitude
 * 45°; the fast method. */
VD_API vd_shadow_def vd_shadow_def_default(void);

/* Sets the general form for the sun along the unit vector `sun` (east, north, up) over a
 * heightfield with any world_from_sample, whose heights are metres to be multiplied by
 * `exaggeration`: a step advances def->stride samples along the longer of its two components, and
 * rises as the sun's rays do over as many true metres. With the sun straight up, at or below the
 * horizon, or with a singular world_from_sample, it is a sun that throws no shadow. */
VD_API void vd_shadow_def_aim(vd_shadow_def *def, const vd_heightfield *heightfield, vd_vec3 sun,
                              double exaggeration);

/* Fills counts[height][stride] of the heightfield's size; the bytes between width and stride are
 * left alone. stride >= width. `job` may be null. Heights of any type. The heightfield is only
 * read. Returns VD_ERROR_ARGUMENT (names the field), VD_ERROR_MEMORY (the twin needs a copy of part
 * of the map: all of it and the steps' reach up to 64 MiB, 4 MiB of float maps, of larger maps at
 * least twice the reach)
 * or VD_ERROR_CANCELLED (counts are then unfinished). */
VD_API VD_MUST_USE vd_status vd_shadow_count(vd_context *context, vd_job *job,
                                             const vd_heightfield *heightfield,
                                             const vd_shadow_def *def, uint8_t *counts,
                                             size_t stride);

/* How a count darkens an encoded colour. */
typedef enum vd_shadow_curve {
    /* share = 0.35 + 0.65 · e^(−count / 12): soft at the edge, never black, as sky lights shadows
     * too. */
    VD_SHADOW_SOFT = 0,
    /* As published: mixed with black in the ratio 1 : count by the Matte library, which mixes the
     * squares of components: floor(√(c² / (1 + count))). */
    VD_SHADOW_PUBLISHED,
    VD_SHADOW_CURVE_COUNT
} vd_shadow_curve;

/* Returns the share of an encoded colour that a count leaves, 0 … 1; 1 for count 0. */
VD_API float vd_shadow_share(vd_shadow_curve curve, uint8_t count);

/* Darkens `width` × `height` straight sRGB colours: out[r][c] from colors[r][c] and counts[r][c];
 * alpha stays. Strides in elements. `out` may be `colors`. Returns VD_ERROR_ARGUMENT. */
VD_API VD_MUST_USE vd_status vd_shadow_bake(vd_context *context, const uint8_t *counts,
                                            size_t counts_stride, vd_shadow_curve curve, int width,
                                            int height, const vd_rgba8 *colors,
                                            size_t colors_stride, vd_rgba8 *out, size_t out_stride);

/* Darkens a heightfield's own colours, each by the count of the sample nearest to its centre, and
 * renews the checksum. counts[height][stride] of the heightfield's size. Baking twice darkens
 * twice: keep the unshadowed colours for a sun that moves. Returns VD_ERROR_ARGUMENT (also when
 * there are no colours). */
VD_API VD_MUST_USE vd_status vd_shadow_bake_heightfield(vd_context *context, const uint8_t *counts,
                                                        size_t stride, vd_shadow_curve curve,
                                                        vd_heightfield *heightfield);

VD_END_DECLARATIONS

#endif

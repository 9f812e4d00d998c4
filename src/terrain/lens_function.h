/* lens_function.h: the lens map of an endless function, made for one camera.
 *
 * A function has no edge and no samples of its own. For a picture, level n of the lens map is a
 * window of the endless grid of cells of cell_m·2^n metres: the rectangle around what the picture
 * shows between the planes T(n) and T(n + 1) across the view axis (lens_view.h).
 *
 *                    ┌──────────────────────────┐          ┌ ─ ┐  tiles of 64 × 64 samples that the
 *                    │ · · · · · · · · · · · ·╱ │ level 2   · ·   frustum cannot meet: not sampled,
 *                    │╲· · · · · · · · · · · ╱  │          └ ─ ┘  holes
 *              T(2)  └─╲┌───────────────┐───╱───┘
 *                       ╲ : : : : : : :╱│ level 1
 *              T(1)     └╲┌─────────┐─╱─┘          samples a level: a picture's worth, whatever the
 *                        │ ╲:::::::╱│  level 0     distance; twice the distance costs one level
 * more └──╲─────╱─┘ eye
 *
 * Within a window a quadtree is followed down: a square of cells together with all that lies below
 * its highest height, by vd_function_bounds, is left out when it lies outside one of the planes
 * that bound the slice of the frustum. Heights there are −infinity.
 *
 * Why no ray of the picture notices: let a ray pass over a square that was left out. Nothing of the
 * ray's part between the level's planes lies in the square (grown by GROW cells) below its bound,
 * so the ray is above the square's ground by more than any rounding, all along. With the ground
 * there, it would leave the square in the air. Without it, it leaves it with nothing known above it
 * (VD_LENS_OUTSIDE) and then meets a cell whose beginning is still within the grown square: the ray
 * is above that cell's ground as well, f0 > 0, and so in the air. Either way the same state, and no
 * hit. Colours and slopes at a hit need samples within two cells of it, all in squares that the ray
 * does touch. The plain reference samples whole windows: the tests' equality is the proof's check.
 *
 * How far. Ground is drawn up to def->far_m, or, where that is 0, up to the distance from which all
 * of it lies within half a pixel of the horizon; with haze, no further than 7 haze lengths, where
 * less than a quarter of a step of an 8-bit channel is left of any colour, but at least 256 times
 * the eye's height, so that no line is seen where sky begins; with curvature, up to the horizon of
 * the highest ground.
 *
 * How much. All windows together hold at most VD_LENS_FUNCTION_SAMPLES samples. Where they would be
 * more, all levels are taken for nearer ground: their cells are 4 to 2 pixels wide instead of 2 to
 * 1, and so on; without levels of detail, or where there would be too many, the finest cells are
 * left out.
 *
 * Tried: cells of 1 to ½ pixel, as heightfields have: slopes of rough ground are crisper, for 3.3
 * times the memory and 2.0 to 2.3 times the processor time (1920 × 1080, two formulas; a third no
 * longer fitted and was drawn as now).
 */
#ifndef VEDUTA_TERRAIN_LENS_FUNCTION_H
#define VEDUTA_TERRAIN_LENS_FUNCTION_H

#include "terrain/lens_map_internal.h"

#define VD_LENS_FUNCTION_SAMPLES ((size_t)1 << 26) /* about 600 MiB */
#define VD_LENS_FUNCTION_LEVELS VD_LENS_TABLE
#define VD_LENS_FUNCTION_TILE 64 /* samples a side that are evaluated at once */
/* Samples a side of what one thread does at once: 4 × 4 tiles. */
#define VD_LENS_FUNCTION_CHUNK 256

/* The share of a picture's frustum between two planes across the view axis; all relative to the
 * eye. */
typedef struct vd_lens_slice {
    vd_plane planes[6]; /* inside: dot(normal, p) >= offset */
} vd_lens_slice;

typedef struct vd_lens_function_worker vd_lens_function_worker;

/* What is kept between pictures. */
typedef struct vd_lens_function {
    vd_context *context;
    const vd_lens_kernels *kernels;
    vd_lens_light *light; /* of the level in work */
    vd_heightfield shape; /* light->map: its width and height */
    float low, high;      /* between which colour maps stretch */
    size_t rooms[4];      /* bytes of map.memory */
    uint8_t *tiles;       /* of all levels, 1: sampled; in map.memory[3] */
    vd_lens_function_worker *workers;

    /* Of the picture. */
    vd_vec3 eye;
    double cell;                    /* of level 0, metres: def->cell_m or more */
    double first_column, first_row; /* of the map's sample (0, 0), in cells from the world's */
    double curve;                   /* metres a square metre */
    bool perspective;
    vd_lens_slice slices[VD_LENS_FUNCTION_LEVELS];
    size_t tile_offset[VD_LENS_FUNCTION_LEVELS];
} vd_lens_function;

/* Samples `def->function` around the origin for the range of colours. On failure nothing is owned.
 * Returns VD_ERROR_MEMORY or VD_ERROR_CANCELLED. */
VD_MUST_USE vd_status vd_lens_function_init(vd_context *context, vd_job *job,
                                            const vd_terrain_def *def, vd_lens_function *out);
void vd_lens_function_finish(vd_lens_function *f);

/* Makes the map of a picture of `width` × `height` pixels in `map`, which was zeroed before the
 * first call. Allocates only when windows are larger than any before. On failure the map may be
 * given to the next call or finished. Returns VD_ERROR_ARGUMENT (the eye is too far from the origin
 * for the cells), VD_ERROR_MEMORY or VD_ERROR_CANCELLED. */
VD_MUST_USE vd_status vd_lens_function_aim(vd_lens_function *f, vd_job *job,
                                           const vd_terrain_def *def, const vd_camera *camera,
                                           int width, int height, vd_lens_map *map);

/* The plain reference: all of every window, one row after the other. */
VD_MUST_USE vd_status vd_lens_function_aim_reference(vd_lens_function *f, vd_job *job,
                                                     const vd_terrain_def *def,
                                                     const vd_camera *camera, int width, int height,
                                                     vd_lens_map *map);

/* ---- what both share -------------------------------------------------------------------------
 */

/* Levels, windows, slices and memory of a picture; no heights. */
VD_MUST_USE vd_status vd_lens_function_lay_out(vd_lens_function *f, const vd_terrain_def *def,
                                               const vd_camera *camera, int width, int height,
                                               vd_lens_map *map);

/* Turns f->light to a level of the map. */
void vd_lens_function_turn(vd_lens_function *f, const vd_terrain_def *def, const vd_lens_map *map,
                           int level);

/* World coordinate of a level's column (or, negated, row), counted from the window's. */
static inline double vd_lens_function_at(double first, int32_t window, int i, int level,
                                         double cell) {
    return (first + (double)(((int64_t)window + i) * ((int64_t)1 << level))) * cell;
}

/* An albedo of three components 0 … 1. */
static inline uint32_t vd_lens_function_color(float r, float g, float b) {
    return (uint32_t)(r * 255.0f + 0.5f) | (uint32_t)(g * 255.0f + 0.5f) << 8 |
           (uint32_t)(b * 255.0f + 0.5f) << 16 | 0xFF000000u;
}

#endif

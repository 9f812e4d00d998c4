/* impostor_ground.h: the terrain as objects: a tree of windows of its cells.
 *
 *        level 2          level 1         level 0: leaves of `side` × `side` cells
 *      ┌───────┐         ┌───┬───┐         ┌─┬─┬─┬─┐
 *      │       │         │   │   │         ├─┼─┼─┼─┤
 *      │       │         ├───┼───┤         ├─┼─┼─┼─┤
 *      └───────┘         └───┴───┘         └─┴─┴─┴─┘
 *
 * A patch is the ground of a window together with all that stands on it: what hides what among them
 * is settled when its picture is drawn. Patches that do not overlap hide each other only in one
 * direction, which their windows tell; so pictures of patches are shown back to front without depth
 * (Lawlor 2004, §3.2). An object stands on the cell under its middle. Labels, lines and particles
 * stand on none: they are large, or above all, and are told from the ground by its depth.
 */
#ifndef VEDUTA_IMPOSTOR_IMPOSTOR_GROUND_H
#define VEDUTA_IMPOSTOR_IMPOSTOR_GROUND_H

#include "world/world_renderer.h"

#define VD_GROUND_LEVELS 20
#define VD_GROUND_POINTS 32 /* key points of a patch, at most */

typedef struct vd_patch {
    float min[3],
        max[3];      /* ground and what stands on it, from the tree's anchor; min > max: nothing */
    float normal[3]; /* of the plane through the ground's corners */
    float middle, half; /* everything lies within middle ± half along it, from the box's middle */
    uint32_t placed;    /* objects that stand on it */
    uint16_t level, column, row;
} vd_patch;

typedef struct vd_impostor_ground {
    vd_vec3 anchor;
    vd_cells map;
    double world_from_sample[6], sample_from_world[6];
    int side, levels;
    int columns[VD_GROUND_LEVELS], rows[VD_GROUND_LEVELS];
    uint32_t first[VD_GROUND_LEVELS]; /* number of a level's first patch */
    vd_patch *patches;                /* [count]; null: there is no tree */
    uint32_t count;
} vd_impostor_ground;

/* Makes the tree of a renderer's terrain; without one that has cells it is empty. Cost: O(leaves +
 * objects). Returns VD_ERROR_MEMORY. */
VD_MUST_USE vd_status vd_impostor_ground_init(vd_context *context,
                                              const vd_world_renderer *renderer,
                                              vd_impostor_ground *out);
void vd_impostor_ground_finish(vd_context *context, vd_impostor_ground *ground);

/* The number of the patch of a level at a place. */
static inline uint32_t vd_ground_number(const vd_impostor_ground *ground, int level, int column,
                                        int row) {
    return ground->first[level] + (uint32_t)(row * ground->columns[level] + column);
}

/* The cells of a patch. */
vd_cells vd_ground_cells(const vd_impostor_ground *ground, uint32_t patch);

/* Extends a box by the ground of some cells. */
void vd_ground_box(const vd_impostor_ground *ground, const vd_world_renderer *renderer,
                   const vd_cells *cells, vd_vec3 *min, vd_vec3 *max);

/* Children, those farther from an eye over the cell (u, v) first; returns how many. */
int vd_ground_children(const vd_impostor_ground *ground, uint32_t patch, double u, double v,
                       uint32_t out[4]);

/* Corners of the boxes of a patch's quarters, of a leaf its own, lowered by `drop`; returns how
 * many. */
int vd_ground_key_points(const vd_impostor_ground *ground, uint32_t patch, double drop,
                         vd_vec3 out[VD_GROUND_POINTS]);

/* Where a place is in cells of the map. */
static inline void vd_ground_at(const vd_impostor_ground *g, double x, double y, double *u,
                                double *v) {
    const double *m = g->sample_from_world;
    *u = m[0] + x * m[1] + y * m[2];
    *v = m[3] + x * m[4] + y * m[5];
}

/* Whether what stands on `a` can hide, from an eye over (u, v), what stands on `b`: it does not
 * when a line of the grid parts them and the eye is on b's side. Neither may overlap the other. */
bool vd_ground_may_hide(const vd_cells *a, const vd_cells *b, double u, double v);

static inline vd_terrain_window vd_cells_window(const vd_cells *cells) {
    return (vd_terrain_window){cells->c0, cells->r0, cells->c1 - cells->c0 + 1,
                               cells->r1 - cells->r0 + 1};
}

static inline bool vd_cells_overlap(const vd_cells *a, const vd_cells *b) {
    return a->c0 <= b->c1 && a->c1 >= b->c0 && a->r0 <= b->r1 && a->r1 >= b->r0;
}

static inline bool vd_cells_hold(const vd_cells *outer, const vd_cells *inner) {
    return outer->c0 <= inner->c0 && outer->c1 >= inner->c1 && outer->r0 <= inner->r0 &&
           outer->r1 >= inner->r1;
}

static inline vd_cells vd_cells_join(const vd_cells *a, const vd_cells *b) {
    return (vd_cells){a->c0 < b->c0 ? a->c0 : b->c0, a->r0 < b->r0 ? a->r0 : b->r0,
                      a->c1 > b->c1 ? a->c1 : b->c1, a->r1 > b->r1 ? a->r1 : b->r1};
}

#endif

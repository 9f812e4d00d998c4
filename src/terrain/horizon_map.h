/* horizon_map.h: how low and how high the ground is over a rectangle of cells. */
#ifndef VEDUTA_TERRAIN_HORIZON_MAP_H
#define VEDUTA_TERRAIN_HORIZON_MAP_H

#include "terrain/horizon.h"

#define VD_HORIZON_DIRECT 4 /* rectangles of so many cells a side are read sample by sample */

typedef struct vd_minima_level {
    float *minima; /* [rows][columns] */
    int columns, rows;
} vd_minima_level;

struct vd_horizon_map {
    vd_context *context;
    const vd_heightfield *field;
    int column, row, column_end, row_end; /* the window's outermost samples */
    int levels;                           /* 2 … levels − 1: blocks of 2^level cells a side */
    vd_minima_level level[VD_HEIGHTFIELD_MAX_LEVELS];
    float *memory;
};

/* A rectangle of cells, both ends included. */
typedef struct vd_cells {
    int c0, r0, c1, r1;
} vd_cells;

/* The lowest that the surface gets over some cells of the heightfield, at least; −infinity where
 * there is a hole. A few look-ups, whatever the size. */
float vd_horizon_lowest(const vd_horizon_map *map, vd_cells in);

/* The highest, at most; −infinity where all is holes. */
float vd_horizon_highest(const vd_horizon_map *map, vd_cells in);

#endif

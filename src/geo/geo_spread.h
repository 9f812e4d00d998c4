/* geo_spread.h: where several rasters lie together, before they are read or warped. */
#ifndef VEDUTA_GEO_GEO_SPREAD_H
#define VEDUTA_GEO_GEO_SPREAD_H

#include "geo/geo_crs.h"

/* Bounds of rasters added one after another, in coordinates of the first one's CRS. */
typedef struct vd_spread {
    bool geographic; /* longitudes: bounds are turned by 360° towards the first */
    int count;
    vd_bounds first, all;
    double area;     /* the sum of the rasters' own */
    int farthest;    /* the raster whose middle is farthest from the first one's */
    double distance; /* its distance, squared */
} vd_spread;

/* Adds a raster and returns by how many degrees (a multiple of 360) it had to be turned so that it
 * lies on the shorter way round from the first, middle to middle. */
double vd_spread_add(vd_spread *spread, vd_bounds b);

/* Returns VD_ERROR_LIMIT when the rasters lie so far apart that nearly all of their union would be
 * missing (the same limit as vd_dem_mosaic). `paths` names them in the order added. */
VD_MUST_USE vd_status vd_spread_check(const vd_spread *spread, const char *const *paths);

/* Looks at rasters without reading samples and decides at how many samples a side each is read:
 * max_side, or less when their union would exceed it in cells of the first. What cannot be judged
 * here (a file that does not open or does not say where it lies) is left to reading. Returns
 * VD_ERROR_LIMIT as vd_spread_check, VD_ERROR_MEMORY. */
VD_MUST_USE vd_status vd_geo_survey(vd_gdal_session *session, const char *const *paths, int count,
                                    int max_side, int *sides);

#endif

/* geo_crs.h: where a raster lies: its geotransform and coordinate reference system. */
#ifndef VEDUTA_GEO_GEO_CRS_H
#define VEDUTA_GEO_GEO_CRS_H

#include "geo/gdal_session.h"
#include <stdbool.h>
#include <veduta/dem.h>

#define VD_GEO_CRS_BYTES 8192

/* Bounds in coordinates of some CRS. */
typedef struct vd_bounds {
    double x0, y0, x1, y1;
} vd_bounds;

vd_bounds vd_bounds_union(vd_bounds a, vd_bounds b);

/* Empty (x1 <= x0 or y1 <= y0) where the two do not meet. */
vd_bounds vd_bounds_intersection(vd_bounds a, vd_bounds b);
bool vd_bounds_empty(vd_bounds a);

/* Bounds of a grid of width × height samples by its corner-based transform. */
vd_bounds vd_bounds_of_grid(const double corner[6], double width, double height);

/* Bounds of the same region in another CRS; false when some of it has no coordinates there. */
bool vd_bounds_transform(vd_bounds in, OGRSpatialReferenceH from, OGRSpatialReferenceH to,
                         vd_bounds *out);

/* The DEM's transform (of sample centres) as one of sample corners. */
void vd_dem_corner_transform(const vd_dem *dem, double corner[6]);

/* A raster's georeference. `corner` is GDAL's geotransform (sample corners, not centres):
 * x = corner[0] + column·corner[1] + row·corner[2], y = corner[3] + column·corner[4] +
 * row·corner[5]. Coordinates are degrees where kind is VD_CRS_GEOGRAPHIC, metres where it is
 * VD_CRS_NONE. */
typedef struct vd_georef {
    vd_crs_kind kind;
    bool placed; /* the file gives a geotransform */
    double corner[6];
    double crs_unit_m;           /* projected: metres on the map per CRS unit; otherwise 1 */
    double height_unit_m;        /* metres per unit of the vertical CRS; 0: there is none */
    OGRSpatialReferenceH crs;    /* owned, horizontal, x before y; null: unknown */
    char name[VD_GEO_CRS_BYTES]; /* authority code, else WKT; empty: unknown */
} vd_georef;

/* Reads a dataset's georeference; ends with vd_georef_finish. `path` names the file in the log.
 * Returns VD_ERROR_FORMAT (a geotransform that is not finite or has no area). */
VD_MUST_USE vd_status vd_georef_init(vd_gdal_session *session, GDALDatasetH dataset,
                                     const char *path, vd_georef *out);
void vd_georef_finish(vd_georef *georef);

/* True when a dataset is placed by control points, sensor model or coordinate arrays, or lies in a
 * rotated-pole CRS: then it has to be warped before vd_georef_init can describe it. */
bool vd_georef_needs_warp(GDALDatasetH dataset);

/* Returns the dataset to read in place of such a one (virtual, closed before `dataset`), or
 * `dataset` itself when it needs none or cannot be warped, which is logged. */
GDALDatasetH vd_georef_straighten(vd_gdal_session *session, GDALDatasetH dataset, const char *path);

/* Returns a CRS from WKT or a code, x before y; null when PROJ knows none. Never reads a file or
 * the network. */
OGRSpatialReferenceH vd_crs_open(const char *text);

/* True when two CRSs are equivalent; false when either is null. */
bool vd_crs_same(OGRSpatialReferenceH a, OGRSpatialReferenceH b);

/* Returns ground metres per metre on the map at (x, y) of a projected CRS: 1 for a map true to
 * scale, 0.69 for Web Mercator at 46° north. 1 when it cannot be computed. */
double vd_crs_ground_scale(OGRSpatialReferenceH crs, double x, double y, double crs_unit_m);

#endif

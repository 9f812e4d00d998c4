/* geo.h: everything GDAL reads (library veduta-io).
 *
 * Elevation and imagery in any of GDAL's formats and any coordinate reference system. Kept out of
 * the core library so that an embedder who does not need it does not link GDAL.
 */
#ifndef VEDUTA_GEO_H
#define VEDUTA_GEO_H

#include <veduta/dem.h>

VD_BEGIN_DECLARATIONS

typedef struct vd_geo_def {
    int band;            /* 1-based; 0: the first */
    int max_side;        /* larger rasters are read decimated (overviews are used); 0: 16384 */
    double height_scale; /* metres per stored unit after the file's own scale; 0: by its unit */
    double height_offset_m;
    bool has_nodata; /* treat `nodata` as missing beside the file's own */
    double nodata;
} vd_geo_def;

VD_API vd_geo_def vd_geo_def_default(void);

/* Reads one or several rasters as one DEM. All of one grid are joined as they are; others are
 * warped (bilinear) to the first one's CRS and cell size. Handled: every numeric type, scale and
 * offset, nodata values and mask bands, vertical units in feet, rotated geotransforms,
 * pixel-is-point and pixel-is-area, ground control points, longitudes 0 … 360, bottom-up rasters.
 * Says through the log what it did (decimated, warped, unit converted). `def` may be null.
 * Returns VD_ERROR_ARGUMENT (a field of `def` out of range, no paths), VD_ERROR_IO, VD_ERROR_FORMAT
 * (GDAL's own words included), VD_ERROR_LIMIT (also for rasters so far apart that nearly all of the
 * whole would be missing), VD_ERROR_MEMORY. */
VD_API VD_MUST_USE vd_status vd_geo_load_dem(vd_context *context, const char *const *paths,
                                             int count, const vd_geo_def *def, vd_dem **out);

/* Reads imagery as an 8-bit picture of 1 to 4 channels: 8-bit bands as they are, others stretched
 * from their 2nd to 98th percentile, palettes expanded, at most 8192 pixels a side. `bands`
 * (1-based, null or all 0: automatic) names the red, green and blue band, such as 3, 2, 1 for the
 * natural colours of a Landsat image; b, 0, 0 shows one band in grey. Automatic is by colour
 * interpretation, else 1, 2, 3, or 1 where there are fewer than three. When both it and `dem` (may
 * be null) are georeferenced it is cropped to the DEM's extent, warped to its CRS where that
 * differs, color_from_sample (see heightfield.h) is filled and *placed set; otherwise *placed is
 * false and color_from_sample untouched. Pixels without imagery have alpha 0; where the imagery
 * ends inside the DEM, the picture has an edge of such pixels, so that clamping to it gives them
 * too. Returns as vd_geo_load_dem; VD_ERROR_ARGUMENT when the two cover different places or a band
 * does not exist. */
VD_API VD_MUST_USE vd_status vd_geo_load_color(vd_context *context, const char *path,
                                               const vd_dem *dem, const int bands[3],
                                               vd_picture **out, double color_from_sample[6],
                                               bool *placed);

/* Converts longitude and latitude (degrees, WGS 84) to coordinates of `crs` (WKT or code), and
 * back. Returns VD_ERROR_ARGUMENT when PROJ cannot. */
VD_API VD_MUST_USE vd_status vd_geo_from_lonlat(vd_context *context, const char *crs, double lon,
                                                double lat, double *x, double *y);
VD_API VD_MUST_USE vd_status vd_geo_to_lonlat(vd_context *context, const char *crs, double x,
                                              double y, double *lon, double *lat);

/* Returns a short name of the raster's format and CRS for `veduta info`, as one line; the log gets
 * nothing. */
VD_API VD_MUST_USE vd_status vd_geo_describe(vd_context *context, const char *path, char *out,
                                             size_t out_bytes);

VD_END_DECLARATIONS

#endif

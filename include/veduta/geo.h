/* geo.h: everything GDAL reads (library veduta-io).
 *
 * Elevation, imagery, and points, lines and polygons in any of GDAL's formats and any coordinate
 * reference system. Kept out of the core library so that an embedder who does not need it does not
 * link GDAL.
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

/* ---- points, lines, polygons ----------------------------------------------------------------- */

typedef enum vd_feature_kind {
    VD_FEATURE_POINT = 0, /* one part of one point */
    VD_FEATURE_LINE,      /* parts of two and more points: the segments of a track */
    VD_FEATURE_POLYGON,   /* parts are rings whose last point is the first again; the first ring is
                             the outline, others are holes */
    VD_FEATURE_KIND_COUNT
} vd_feature_kind;

typedef struct vd_feature {
    vd_feature_kind kind;
    bool has_z; /* its points have heights */
    size_t first_part, part_count;
    size_t name; /* where its name begins in vd_features.names; 0: it has none */
} vd_feature;

/* What a file holds, in its order. */
typedef struct vd_features {
    vd_context *context;
    size_t count, part_count, point_count;
    vd_feature *features;
    size_t *parts;       /* [part_count + 1]: the first point of each part, then point_count */
    double (*points)[3]; /* [point_count]: x, y (longitude, latitude), height in metres or 0 */
    size_t name_bytes;
    char *names; /* UTF-8, each ended by NUL; the first is empty */
} vd_features;

typedef struct vd_geo_features_def {
    const char *name_field; /* the property that names a feature; null: the first that there is of
                               name, title, label, in any case */
    const char *crs;        /* WKT or code of what x and y are to be; null: WGS 84 longitude and
                               latitude in degrees */
    size_t max_points;      /* more are an error; 0: 10 million */
} vd_geo_features_def;

VD_API vd_geo_features_def vd_geo_features_def_default(void);

/* Reads all layers of a vector file: GeoJSON, GPX, KML, Shapefile, GeoPackage and whatever else
 * GDAL knows. *out is owned by the caller. `def` may be null. Of GPX, waypoints, routes and tracks
 * are read, a track's segments as its parts. Multipoints and multipolygons become several features
 * of one name; a line, or segment, of a single point becomes a point; curves become chords. Heights
 * that are all 0 are none: GPX without elevation and KML that lies on the ground. A file without a
 * CRS is taken as longitude and latitude when it can be, else as `crs`, which the log says.
 * Returns VD_ERROR_ARGUMENT (no path, an unknown CRS, no such property: the sentence lists those
 * that there are), VD_ERROR_IO, VD_ERROR_FORMAT (not a vector file, damaged, a position that is
 * none or that the CRS does not cover), VD_ERROR_EMPTY (no geometry), VD_ERROR_LIMIT,
 * VD_ERROR_MEMORY; *out is written on success only. Cost: about a microsecond a point. */
VD_API VD_MUST_USE vd_status vd_geo_load_features(vd_context *context, const char *path,
                                                  const vd_geo_features_def *def,
                                                  vd_features **out);

/* Ends features and sets *features to null. Null is accepted. */
VD_API void vd_features_destroy(vd_features **features);

/* ---- positions and files --------------------------------------------------------------------- */

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

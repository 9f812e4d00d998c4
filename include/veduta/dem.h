/* dem.h: digital elevation models as files hold them, before they become a heightfield.
 *
 * A vd_dem is a grid of heights in metres with its georeference: what every reader produces,
 * whether it is one of the core's own (PNG, PGM, .hgt, ESRI ASCII, raw) or GDAL's (geo.h). Missing
 * samples are NaN. Several DEMs are joined by vd_dem_mosaic; a DEM becomes drawable by
 * vd_heightfield_from_dem (heightfield.h).
 */
#ifndef VEDUTA_DEM_H
#define VEDUTA_DEM_H

#include <stdbool.h>
#include <veduta/picture.h>

VD_BEGIN_DECLARATIONS

typedef enum vd_crs_kind {
    VD_CRS_NONE = 0,   /* no georeference: x and y are samples times the cell size */
    VD_CRS_GEOGRAPHIC, /* x longitude, y latitude, degrees */
    VD_CRS_PROJECTED,  /* x easting, y northing, in units of `crs_unit_m` metres */
    VD_CRS_KIND_COUNT
} vd_crs_kind;

typedef struct vd_dem {
    vd_context *context;
    int width, height;
    size_t stride;  /* samples from one row to the next */
    float *heights; /* [height][stride], metres, row 0 first as in the file; NaN = missing */
    vd_crs_kind kind;
    /* CRS coordinates of the *centre* of sample (column, row):
     *   x = transform[0] + column × transform[1] + row × transform[2]
     *   y = transform[3] + column × transform[4] + row × transform[5] */
    double transform[6];
    double crs_unit_m;    /* projected: ground metres per CRS unit; otherwise 1 */
    char *crs;            /* owned; WKT or an authority code such as "EPSG:4326"; may be null */
    char height_type[16]; /* what the file stored: "uint8", "int16", "float32", … */
    char height_unit[16]; /* what the file said: "m", "ft", "" when it said nothing */
    float min, max;       /* of the present samples; NaN when there are none */
    uint64_t missing;     /* NaN samples */
} vd_dem;

typedef enum vd_height_encoding {
    VD_ENCODING_GREY = 0,  /* the first channel */
    VD_ENCODING_RGB24,     /* R·65536 + G·256 + B */
    VD_ENCODING_TERRARIUM, /* R·256 + G + B/256 − 32768 (Mapzen/AWS terrain tiles) */
    VD_ENCODING_MAPBOX,    /* (R·65536 + G·256 + B)/10 − 10000 (Mapbox terrain-RGB) */
    VD_ENCODING_COUNT
} vd_height_encoding;

/* How to read what a file does not say itself. */
typedef struct vd_dem_def {
    vd_height_encoding encoding; /* pictures only */
    double height_scale;         /* metres per stored unit; 0: from the file, else 1 */
    double height_offset_m;      /* added after scaling */
    double cell_size_m;          /* sample spacing of files without georeference; 0: 1 m */
    bool has_nodata;             /* treat `nodata` (a stored value) as missing, beside what the */
    double nodata;               /* file itself names */
    int raw_width, raw_height;   /* raw files only; 0: not raw */
    char raw_type[8];            /* "u8", "i16", "u16", "i32", "f32", "f64" */
    bool raw_big_endian;
    size_t raw_offset_bytes; /* bytes to skip at the beginning */
} vd_dem_def;

VD_API vd_dem_def vd_dem_def_default(void);

/* Creates a DEM with all samples missing, no georeference, transform (0, 1, 0, 0, 0, −1).
 * Returns VD_ERROR_ARGUMENT, VD_ERROR_LIMIT or VD_ERROR_MEMORY. */
VD_API VD_MUST_USE vd_status vd_dem_create(vd_context *context, int width, int height,
                                           vd_dem **out);
VD_API void vd_dem_destroy(vd_dem **dem);

/* Recomputes min, max and missing from the heights (infinities become NaN). */
VD_API void vd_dem_update_range(vd_dem *dem);

/* Reads one of the core's own formats, told apart by contents, for .hgt by name and size (the name
 * gives the south-west corner: N45E006.hgt; 1201², 3601² or 1801 × 3601 samples, big-endian, −32768
 * missing). An ESRI ASCII grid whose coordinates look like longitude and latitude is taken as such,
 * which the log says; other grids are in metres. `def` may be null. Returns VD_ERROR_UNSUPPORTED
 * when the file is none of them (GDAL may know it; a regular file is then not read whole), else
 * VD_ERROR_ARGUMENT (a field of def), VD_ERROR_IO, VD_ERROR_FORMAT, VD_ERROR_LIMIT,
 * VD_ERROR_MEMORY. */
VD_API VD_MUST_USE vd_status vd_dem_load(vd_context *context, const char *path,
                                         const vd_dem_def *def, vd_dem **out);

/* The same from memory; `name` is used for the format (.hgt) and in error sentences. */
VD_API VD_MUST_USE vd_status vd_dem_decode(vd_context *context, const void *data, size_t size_bytes,
                                           const char *name, const vd_dem_def *def, vd_dem **out);

/* Joins DEMs of one CRS and one grid (equal cell sizes, unrotated, aligned to a hundredth of a
 * cell) into one; where several have a sample the first in the list wins. Shared edges fall
 * together, so there is no seam. Returns VD_ERROR_ARGUMENT (no parts), VD_ERROR_UNSUPPORTED
 * (different CRS or grid: geo.h can warp them), VD_ERROR_LIMIT (too large a whole, or parts so far
 * apart that nearly all of it would be missing), VD_ERROR_MEMORY. */
VD_API VD_MUST_USE vd_status vd_dem_mosaic(vd_context *context, const vd_dem *const *parts,
                                           int count, vd_dem **out);

/* Fills missing samples by repeated averaging of present neighbours, coarse to fine (push-pull;
 * Gortler et al. 1996, §5.3). Nothing happens when all are missing. Returns VD_ERROR_MEMORY. */
VD_API VD_MUST_USE vd_status vd_dem_fill(vd_dem *dem);

/* How CRS coordinates become world metres: world = (crs − origin) × scale, per axis. Geographic:
 * the origin is the DEM's centre and the scale metres per degree there on the WGS 84 ellipsoid;
 * projected: origin 0 and the unit; none: origin 0, scale 1. */
typedef struct vd_placement {
    double origin_x, origin_y, scale_x, scale_y;
} vd_placement;

VD_API vd_placement vd_dem_placement(const vd_dem *dem);

/* Returns the six coefficients of world_from_sample, as in vd_dem.transform but in world metres. */
VD_API void vd_dem_world_from_sample(const vd_dem *dem, double out[6]);

VD_END_DECLARATIONS

#endif

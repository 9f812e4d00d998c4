/* geo_module.h: veduta-io, opened when a file needs it.
 *
 * GDAL takes 40 ms to load, and a build may lack it. So a shared build opens the library on the
 * first file that the core cannot read; a static one has it linked in; one without GDAL says so.
 */
#ifndef VEDUTA_APP_GEO_MODULE_H
#define VEDUTA_APP_GEO_MODULE_H

#include <veduta/geo.h>

typedef struct vd_geo_module {
    vd_geo_def (*def_default)(void);
    vd_status (*load_dem)(vd_context *context, const char *const *paths, int count,
                          const vd_geo_def *def, vd_dem **out);
    vd_status (*load_color)(vd_context *context, const char *path, const vd_dem *dem,
                            const int bands[3], vd_picture **out, double color_from_sample[6],
                            bool *placed);
    vd_geo_features_def (*features_def_default)(void);
    vd_status (*load_features)(vd_context *context, const char *path,
                               const vd_geo_features_def *def, vd_features **out);
    void (*features_destroy)(vd_features **features);
    vd_status (*from_lonlat)(vd_context *context, const char *crs, double lon, double lat,
                             double *x, double *y);
    vd_status (*to_lonlat)(vd_context *context, const char *crs, double x, double y, double *lon,
                           double *lat);
    vd_status (*describe)(vd_context *context, const char *path, char *out, size_t out_bytes);
} vd_geo_module;

/* Opens veduta-io. `purpose` says what it is needed for, such as "read dem.tif". Returns
 * VD_ERROR_UNSUPPORTED when it is not there. The library stays loaded until the program ends. */
VD_MUST_USE vd_status vd_geo_module_open(const char *purpose, vd_geo_module *out);

#endif

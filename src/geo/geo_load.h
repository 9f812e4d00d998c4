/* geo_load.h: one raster file becomes one DEM. */
#ifndef VEDUTA_GEO_GEO_LOAD_H
#define VEDUTA_GEO_GEO_LOAD_H

#include "geo/gdal_session.h"
#include <veduta/geo.h>

/* Reads one raster, north-up where it is not rotated, at most max_side samples a side. `def` has
 * been checked. crs_unit_m is the map's unit, without the ground scale: tiles of one map must
 * agree. Returns as vd_geo_load_dem. */
VD_MUST_USE vd_status vd_geo_load_one(vd_gdal_session *session, const char *path,
                                      const vd_geo_def *def, int max_side, vd_dem **out);

/* Multiplies crs_unit_m by the ground scale at the DEM's centre where that departs from 1 by more
 * than 1 %, and says so. */
void vd_geo_correct_scale(vd_gdal_session *session, const char *path, vd_dem *dem);

/* Copies a string into memory of the context; null when memory is out. */
char *vd_geo_copy_string(vd_context *context, const char *string);

#endif

/* geo_heights.h: one band's stored values become a grid of heights in metres. */
#ifndef VEDUTA_GEO_GEO_HEIGHTS_H
#define VEDUTA_GEO_GEO_HEIGHTS_H

#include "geo/gdal_session.h"
#include <stdbool.h>
#include <veduta/geo.h>

/* The most samples that are read to make one decimated grid: about a minute's work. */
#define VD_GEO_MAX_SAMPLES_READ 8589934592.0
#define VD_GEO_MAX_WIDTH_READ (1 << 25) /* a row is read whole: 256 MiB */

/* What a stored value means. */
typedef struct vd_height_rule {
    double scale, offset_m; /* metres = stored × scale + offset_m */
    bool signed_byte;       /* GDAL < 3.7 hands out int8 as uint8 */
    bool guess;             /* nothing names missing samples: known sentinels count as missing */
    int nodata_count;
    double nodata[2]; /* stored values that mean missing */
    char unit[16];    /* for vd_dem.height_unit */
    double unit_m;    /* metres per unit that `scale` contains */
} vd_height_rule;

/* Derives the rule from the band's own words, the vertical CRS (metres per unit, 0: none) and the
 * caller's wishes. Logs what is assumed. */
vd_height_rule vd_height_rule_of(vd_gdal_session *session, GDALRasterBandH band, const char *path,
                                 double crs_height_unit_m, const vd_geo_def *def);

/* Gives the size of the grid for a band of width × height samples: the same, or scaled to max_side
 * with equal factors. */
void vd_geo_fit(int width, int height, int max_side, int *out_width, int *out_height);

/* Reads a band into dem->heights, whose size is that of vd_geo_fit; where it is smaller than the
 * band, each sample is the area-weighted mean of the present samples under it, missing when less
 * than half of the area is present.
 * Returns VD_ERROR_FORMAT, VD_ERROR_LIMIT or VD_ERROR_MEMORY. */
VD_MUST_USE vd_status vd_geo_read_heights(vd_gdal_session *session, const char *path,
                                          GDALRasterBandH samples, const vd_height_rule *rule,
                                          vd_dem *dem);

#endif

/* geo_pixels.h: bands of a raster become an 8-bit picture. */
#ifndef VEDUTA_GEO_GEO_PIXELS_H
#define VEDUTA_GEO_GEO_PIXELS_H

#include "geo/gdal_session.h"
#include <stdbool.h>
#include <veduta/picture.h>

/* Which part of a raster is read, and how large. */
typedef struct vd_pixel_window {
    int x, y, width, height;   /* in pixels of the raster */
    int out_width, out_height; /* at most that: averaged where smaller */
    bool edge;                 /* surround the picture by one pixel of alpha 0 */
} vd_pixel_window;

/* Reads `count` (1 or 3) bands as grey or RGB, with alpha where a mask, nodata value or alpha band
 * says so or an edge is asked for. 8-bit bands stay as they are; others are stretched, each from
 * its 2nd to its 98th percentile. Returns VD_ERROR_FORMAT, VD_ERROR_LIMIT or VD_ERROR_MEMORY. */
VD_MUST_USE vd_status vd_geo_read_pixels(vd_gdal_session *session, const char *path,
                                         GDALDatasetH dataset, const int *bands, int count,
                                         const vd_pixel_window *window, vd_picture **out);

#endif

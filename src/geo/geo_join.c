/* geo_join.c: several rasters become one DEM.
 *
 * Tiles of one grid are put together sample by sample (vd_dem_mosaic). Anything else is resampled
 * onto one grid: that of the first raster, extended over all of them. The parts are first read as
 * DEMs, so that by then missing samples, units and odd orientations are the same for all; GDAL then
 * warps grid to grid in our memory, bilinear, without touching missing samples.
 */
#include <gdal_utils.h>
#include <math.h>
#include <stdio.h>
#include <string.h>
#include <veduta/geo.h>
#include "geo/geo_crs.h"
#include "geo/geo_load.h"
#include "geo/geo_spread.h"

enum { DEFAULT_MAX_SIDE = 16384 };

/* ---- warping
 * -------------------------------------------------------------------------------------- */

/* Wraps a DEM's heights, without copying, as a dataset that GDAL reads and writes. */
static GDALDatasetH wrap_dem(const vd_dem *dem, OGRSpatialReferenceH crs) {
    GDALDriverH driver = GDALGetDriverByName("MEM");
    GDALDatasetH dataset =
        driver != NULL ? GDALCreate(driver, "", dem->width, dem->height, 0, GDT_Float32, NULL)
                       : NULL;
    if (dataset == NULL) {
        return NULL;
    }
    char pointer[64] = "", line[64], number[40] = "";
    CPLPrintPointer(number, dem->heights, (int)sizeof number - 1);
    (void)snprintf(pointer, sizeof pointer, "DATAPOINTER=%s", number);
    (void)snprintf(line, sizeof line, "LINEOFFSET=%zu", dem->stride * sizeof *dem->heights);
    const char *options[] = {pointer, "PIXELOFFSET=4", line, NULL};
    double t[6];
    vd_dem_corner_transform(dem, t);
    if (GDALAddBand(dataset, GDT_Float32, (CSLConstList)options) != CE_None ||
        GDALSetRasterNoDataValue(GDALGetRasterBand(dataset, 1), NAN) != CE_None ||
        GDALSetGeoTransform(dataset, t) != CE_None ||
        (crs != NULL && GDALSetSpatialRef(dataset, crs) != CE_None)) {
        GDALClose(dataset);
        return NULL;
    }
    return dataset;
}

/* Warps one part into the whole, over what is there already. */
static bool warp_into(const vd_dem *part, OGRSpatialReferenceH part_crs, const vd_dem *whole,
                      OGRSpatialReferenceH crs) {
    GDALDatasetH source = wrap_dem(part, part_crs != NULL ? part_crs : crs);
    GDALDatasetH target = wrap_dem(whole, crs);
    bool done = false;
    if (source != NULL && target != NULL) {
        char *arguments[] = {"-r",  "bilinear",   "-et", "0.05", "-srcnodata",
                             "nan", "-dstnodata", "nan", NULL};
        GDALWarpAppOptions *options = GDALWarpAppOptionsNew(arguments, NULL);
        done = options != NULL && GDALWarp(NULL, target, 1, &source, options, NULL) != NULL;
        GDALWarpAppOptionsFree(options);
    }
    if (target != NULL) {
        GDALClose(target);
    }
    if (source != NULL) {
        GDALClose(source);
    }
    return done;
}

/* Bounds of a part in the coordinates of the whole. */
static bool part_bounds(const vd_dem *part, OGRSpatialReferenceH part_crs, OGRSpatialReferenceH crs,
                        vd_bounds *out) {
    double t[6];
    vd_dem_corner_transform(part, t);
    vd_bounds b = vd_bounds_of_grid(t, part->width, part->height);
    if (part_crs != NULL && crs != NULL && !vd_crs_same(part_crs, crs)) {
        return vd_bounds_transform(b, part_crs, crs, out);
    }
    *out = b;
    return true;
}

/* Creates the grid of the whole: the first part's, extended over `all` by whole cells; with larger
 * cells where it would exceed max_side. */
static vd_status create_whole(vd_context *context, const vd_dem *first, vd_bounds all, int max_side,
                              vd_dem **out) {
    double t[6];
    vd_dem_corner_transform(first, t);
    double cell_x = fabs(t[1]), cell_y = fabs(t[5]), x = t[0], y = t[3];
    if (t[2] != 0.0 || t[4] != 0.0) {
        cell_x = cell_y = sqrt(fabs(t[1] * t[5] - t[2] * t[4]));
        x = all.x0;
        y = all.y1;
    }
    double columns = (all.x1 - all.x0) / cell_x, rows = (all.y1 - all.y0) / cell_y;
    double side = columns > rows ? columns : rows;
    if (side > max_side - 2) {
        cell_x *= side / (max_side - 2);
        cell_y *= side / (max_side - 2);
    }
    /* A hundredth of a cell is rounding, not another column. */
    double west = floor((all.x0 - x) / cell_x + 0.01), east = ceil((all.x1 - x) / cell_x - 0.01);
    double north = floor((y - all.y1) / cell_y + 0.01), south = ceil((y - all.y0) / cell_y - 0.01);
    vd_dem *dem = NULL;
    vd_status status = vd_dem_create(context, (int)(east - west), (int)(south - north), &dem);
    if (status.code != VD_OK) {
        return status;
    }
    dem->transform[0] = x + (west + 0.5) * cell_x;
    dem->transform[1] = cell_x;
    dem->transform[3] = y - (north + 0.5) * cell_y;
    dem->transform[5] = -cell_y;
    dem->kind = first->kind;
    dem->crs_unit_m = first->crs_unit_m;
    (void)snprintf(dem->height_type, sizeof dem->height_type, "%s", first->height_type);
    (void)snprintf(dem->height_unit, sizeof dem->height_unit, "%s", first->height_unit);
    if (first->crs != NULL) {
        dem->crs = vd_geo_copy_string(context, first->crs);
        if (dem->crs == NULL) {
            vd_dem_destroy(&dem);
            return vd_failure(VD_ERROR_MEMORY,
                              "out of memory: the name of a CRS takes %zu bytes; "
                              "free memory",
                              strlen(first->crs) + 1);
        }
    }
    *out = dem;
    return vd_success();
}

static vd_status warp_all(vd_gdal_session *session, const char *const *paths, vd_dem *const *parts,
                          int count, int max_side, vd_dem **out) {
    OGRSpatialReferenceH crs = vd_crs_open(parts[0]->crs);
    vd_dem *whole = NULL;
    vd_status status = vd_success();
    vd_spread spread = {.geographic = parts[0]->kind == VD_CRS_GEOGRAPHIC};
    for (int i = 0; i < count && status.code == VD_OK; i++) {
        OGRSpatialReferenceH part_crs = vd_crs_open(parts[i]->crs);
        vd_bounds b;
        vd_gdal_clear(session);
        if (parts[i]->kind == VD_CRS_NONE) {
            status = vd_failure(VD_ERROR_FORMAT,
                                "cannot join %s with the others: it does not say where it lies; "
                                "give it a georeference (gdal_edit.py -a_srs -a_ullr)",
                                paths[i]);
        } else if (!part_bounds(parts[i], part_crs, crs, &b)) {
            status = vd_gdal_failure(session, VD_ERROR_FORMAT, paths[i],
                                     "it does not fit into the projection of the first raster",
                                     "render it alone");
        } else {
            double turn = vd_spread_add(&spread, b);
            if (parts[i]->kind == VD_CRS_GEOGRAPHIC) {
                parts[i]->transform[0] += turn; /* GDAL does not look on the other side of 180° */
            }
        }
        OSRDestroySpatialReference(part_crs);
    }
    if (status.code == VD_OK) {
        status = vd_spread_check(&spread, paths);
    }
    if (status.code == VD_OK) {
        status = create_whole(session->context, parts[0], spread.all, max_side, &whole);
    }
    /* Last to first, so that where several have a sample the first in the list wins. */
    for (int i = count - 1; i >= 0 && status.code == VD_OK; i--) {
        OGRSpatialReferenceH part_crs = vd_crs_open(parts[i]->crs);
        vd_gdal_clear(session);
        if (!warp_into(parts[i], part_crs, whole, crs)) {
            status = vd_gdal_failure(session, VD_ERROR_FORMAT, paths[i],
                                     "it cannot be warped to the grid of the first raster",
                                     "render it alone");
        }
        OSRDestroySpatialReference(part_crs);
    }
    OSRDestroySpatialReference(crs);
    if (status.code != VD_OK) {
        vd_dem_destroy(&whole);
        return status;
    }
    vd_dem_update_range(whole);
    vd_log(session->context, VD_LOG_INFO,
           "%d rasters differ in CRS or grid: warped to %d × %d samples in the CRS of %s", count,
           whole->width, whole->height, paths[0]);
    *out = whole;
    return status;
}

/* ---- public
 * --------------------------------------------------------------------------------------- */

vd_geo_def vd_geo_def_default(void) {
    vd_geo_def def = {.band = 0};
    return def;
}

static vd_status check(const char *const *paths, int count, const vd_geo_def *def, vd_dem **out) {
    if (paths == NULL || count < 1 || out == NULL) {
        return vd_failure(VD_ERROR_ARGUMENT, "no elevation file is named; give at least one path");
    }
    if (def->band < 0) {
        return vd_failure(VD_ERROR_ARGUMENT, "band is %d; give 1 or more, or 0 for the first",
                          def->band);
    }
    if (def->max_side < 0 || def->max_side > VD_MAX_SIDE ||
        (def->max_side > 0 && def->max_side < 16)) {
        return vd_failure(VD_ERROR_ARGUMENT, "max_side is %d; give 16 … %d, or 0 for %d",
                          def->max_side, VD_MAX_SIDE, (int)DEFAULT_MAX_SIDE);
    }
    if (!isfinite(def->height_scale)) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "height_scale is not a number; give metres per stored unit, or 0");
    }
    if (!isfinite(def->height_offset_m)) {
        return vd_failure(VD_ERROR_ARGUMENT, "height_offset_m is not a number; give metres");
    }
    return vd_success();
}

static vd_status load_parts(vd_gdal_session *session, const char *const *paths, int count,
                            const vd_geo_def *def, int max_side, vd_dem **parts, vd_dem **out) {
    int *sides = vd_allocate(session->context, (size_t)count, sizeof *sides);
    if (sides == NULL) {
        return vd_failure(VD_ERROR_MEMORY, "out of memory: the sizes of %d files; free memory",
                          count);
    }
    vd_status status = vd_geo_survey(session, paths, count, max_side, sides);
    for (int i = 0; i < count && status.code == VD_OK; i++) {
        status = vd_geo_load_one(session, paths[i], def, sides[i], &parts[i]);
    }
    vd_release(session->context, sides);
    if (status.code != VD_OK) {
        return status;
    }
    status = vd_dem_mosaic(session->context, (const vd_dem *const *)parts, count, out);
    if (status.code == VD_ERROR_UNSUPPORTED) {
        status = warp_all(session, paths, parts, count, max_side, out);
    }
    return status;
}

vd_status vd_geo_load_dem(vd_context *context, const char *const *paths, int count,
                          const vd_geo_def *def, vd_dem **out) {
    const vd_geo_def defaults = vd_geo_def_default();
    def = def != NULL ? def : &defaults;
    vd_status status = check(paths, count, def, out);
    if (status.code != VD_OK) {
        return status;
    }
    const int max_side = def->max_side > 0 ? def->max_side : DEFAULT_MAX_SIDE;
    vd_dem **parts = vd_allocate(context, (size_t)count, sizeof(vd_dem *));
    if (parts == NULL) {
        return vd_failure(VD_ERROR_MEMORY, "out of memory: a list of %d files; free memory", count);
    }
    for (int i = 0; i < count; i++) {
        parts[i] = NULL;
    }
    vd_gdal_session session;
    vd_gdal_begin(&session, context);
    vd_dem *dem = NULL;
    if (count == 1) {
        status = vd_geo_load_one(&session, paths[0], def, max_side, &dem);
    } else {
        status = load_parts(&session, paths, count, def, max_side, parts, &dem);
    }
    if (status.code == VD_OK) {
        vd_geo_correct_scale(&session, paths[0], dem);
        *out = dem;
    }
    for (int i = 0; i < count; i++) {
        vd_dem_destroy(&parts[i]);
    }
    vd_release(context, parts);
    vd_gdal_end(&session);
    return status;
}

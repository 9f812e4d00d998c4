/* geo_load.c: see geo_load.h. */
#include "geo/geo_load.h"

#include <math.h>
#include <stdio.h>
#include <string.h>
#include "geo/geo_crs.h"
#include "geo/geo_heights.h"

char *vd_geo_copy_string(vd_context *context, const char *string) {
    size_t size_bytes = strlen(string) + 1;
    char *copy = vd_allocate(context, size_bytes, 1);
    if (copy != NULL) {
        memcpy(copy, string, size_bytes);
    }
    return copy;
}

/* ---- orientation
 * --------------------------------------------------------------------------------- */

static void flip_rows(vd_dem *dem) {
    double *t = dem->transform;
    for (int top = 0, bottom = dem->height - 1; top < bottom; top++, bottom--) {
        float *a = dem->heights + (size_t)top * dem->stride;
        float *b = dem->heights + (size_t)bottom * dem->stride;
        for (int c = 0; c < dem->width; c++) {
            float kept = a[c];
            a[c] = b[c];
            b[c] = kept;
        }
    }
    t[0] += (dem->height - 1) * t[2];
    t[3] += (dem->height - 1) * t[5];
    t[2] = -t[2];
    t[5] = -t[5];
}

static void reverse(float *values, int count) {
    for (int a = 0, b = count - 1; a < b; a++, b--) {
        float kept = values[a];
        values[a] = values[b];
        values[b] = kept;
    }
}

static void flip_columns(vd_dem *dem) {
    double *t = dem->transform;
    for (int r = 0; r < dem->height; r++) {
        reverse(dem->heights + (size_t)r * dem->stride, dem->width);
    }
    t[0] += (dem->width - 1) * t[1];
    t[3] += (dem->width - 1) * t[4];
    t[1] = -t[1];
    t[4] = -t[4];
}

/* Unrotated: north row and west column first. Rotated: not mirrored, else left as it is. */
static void turn_north(vd_dem *dem) {
    const double *t = dem->transform;
    if (t[2] != 0.0 || t[4] != 0.0) {
        if (t[1] * t[5] - t[2] * t[4] > 0.0) {
            flip_rows(dem);
        }
        return;
    }
    if (t[1] < 0.0) {
        flip_columns(dem);
    }
    if (t[5] > 0.0) {
        flip_rows(dem);
    }
}

/* Moves the first k columns behind the others: three reversals, no memory. */
static void roll_columns(vd_dem *dem, int k) {
    for (int r = 0; r < dem->height; r++) {
        float *row = dem->heights + (size_t)r * dem->stride;
        reverse(row, k);
        reverse(row + k, dem->width - k);
        reverse(row, dem->width);
    }
}

/* Longitudes of 0 … 360 become −180 … 180: a part of the globe is shifted so that its centre is in
 * there, the whole globe is cut at the date line. */
static void normalize_longitude(vd_context *context, const char *path, vd_dem *dem) {
    double *t = dem->transform;
    if (dem->kind != VD_CRS_GEOGRAPHIC) {
        return;
    }
    bool whole = t[2] == 0.0 && t[4] == 0.0 && fabs(t[1] * dem->width - 360.0) < 0.5 * t[1];
    if (whole) {
        double first = t[0] - 360.0 * floor((t[0] + 180.0) / 360.0);
        int k = (int)floor((180.0 - first) / t[1]) + 1; /* the first column past the date line */
        if (k < dem->width && k > 0) {
            roll_columns(dem, k);
            t[0] = first + k * t[1] - 360.0;
            vd_log(context, VD_LOG_INFO, "%s: cut at the date line instead of at %.6g° east", path,
                   first);
        } else {
            t[0] = first;
        }
        return;
    }
    double centre = t[0] + 0.5 * (dem->width - 1) * t[1] + 0.5 * (dem->height - 1) * t[2];
    if (centre > 180.0 || centre < -180.0) {
        double shift = -360.0 * floor((centre + 180.0) / 360.0);
        t[0] += shift;
        vd_log(context, VD_LOG_INFO, "%s: longitudes shifted by %.0f°", path, shift);
    }
}

/* ---- one raster
 * ----------------------------------------------------------------------------------- */

/* The band that is asked for, if it can hold heights. */
static vd_status pick_band(vd_gdal_session *session, GDALDatasetH dataset, const char *path,
                           int wanted, GDALRasterBandH *out) {
    int count = GDALGetRasterCount(dataset), number = wanted > 0 ? wanted : 1;
    if (number > count) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "cannot read band %d of %s: it has %d; name one of 1 … %d", number, path,
                          count, count);
    }
    GDALRasterBandH band = GDALGetRasterBand(dataset, number);
    const char *type = vd_gdal_type_name(band);
    if (strcmp(type, "complex") == 0 || strcmp(type, "unknown") == 0) {
        return vd_failure(VD_ERROR_FORMAT,
                          "cannot read %s: its samples are of type %s, which are no heights; "
                          "choose another band",
                          path, type);
    }
    GDALColorInterp color = GDALGetRasterColorInterpretation(band);
    if (wanted == 0 && (color == GCI_PaletteIndex || (color == GCI_RedBand && count >= 3))) {
        vd_log(session->context, VD_LOG_WARNING,
               "%s: its first band is marked as colour; it is read as heights all the same", path);
    }
    *out = band;
    return vd_success();
}

/* Fills everything but heights, range and final orientation. */
static vd_status describe(vd_dem *dem, const vd_georef *georef, GDALRasterBandH band,
                          const vd_height_rule *rule, double columns_each, double rows_each) {
    double *t = dem->transform;
    memcpy(t, georef->corner, sizeof dem->transform);
    t[1] *= columns_each;
    t[4] *= columns_each;
    t[2] *= rows_each;
    t[5] *= rows_each;
    t[0] += 0.5 * (t[1] + t[2]); /* from the corner of the first sample to its centre */
    t[3] += 0.5 * (t[4] + t[5]);
    dem->kind = georef->kind;
    dem->crs_unit_m = georef->crs_unit_m;
    (void)snprintf(dem->height_type, sizeof dem->height_type, "%s", vd_gdal_type_name(band));
    (void)snprintf(dem->height_unit, sizeof dem->height_unit, "%s", rule->unit);
    if (georef->name[0] != '\0') {
        dem->crs = vd_geo_copy_string(dem->context, georef->name);
        if (dem->crs == NULL) {
            return vd_failure(VD_ERROR_MEMORY,
                              "out of memory: the name of a CRS takes %zu bytes; "
                              "free memory",
                              strlen(georef->name) + 1);
        }
    }
    return vd_success();
}

static vd_status read_dem(vd_gdal_session *session, const char *path, GDALDatasetH dataset,
                          GDALRasterBandH rule_band, int number, const vd_geo_def *def,
                          int max_side, vd_dem **out) {
    vd_georef georef = {.crs = NULL};
    vd_dem *dem = NULL;
    vd_status status = vd_georef_init(session, dataset, path, &georef);
    if (status.code != VD_OK) {
        return status;
    }
    vd_height_rule rule = vd_height_rule_of(session, rule_band, path, georef.height_unit_m, def);
    const int full_width = GDALGetRasterXSize(dataset), full_height = GDALGetRasterYSize(dataset);
    int width, height;
    vd_geo_fit(full_width, full_height, max_side, &width, &height);
    while ((size_t)width * (size_t)height > VD_MAX_PIXELS) {
        max_side -= max_side / 8;
        vd_geo_fit(full_width, full_height, max_side, &width, &height);
    }
    status = vd_dem_create(session->context, width, height, &dem);
    if (status.code == VD_OK) {
        status = describe(dem, &georef, rule_band, &rule, (double)full_width / width,
                          (double)full_height / height);
    }
    if (status.code == VD_OK) {
        status = vd_geo_read_heights(session, path, GDALGetRasterBand(dataset, number), &rule, dem);
    }
    vd_georef_finish(&georef);
    if (status.code != VD_OK) {
        vd_dem_destroy(&dem);
        return status;
    }
    if (width != full_width || height != full_height) {
        vd_log(session->context, VD_LOG_INFO,
               "%s: read at %d × %d of its %d × %d samples, each the mean of those it covers", path,
               width, height, full_width, full_height);
    }
    turn_north(dem);
    normalize_longitude(session->context, path, dem);
    vd_dem_update_range(dem);
    *out = dem;
    return vd_success();
}

vd_status vd_geo_load_one(vd_gdal_session *session, const char *path, const vd_geo_def *def,
                          int max_side, vd_dem **out) {
    GDALDatasetH dataset = NULL;
    vd_status status = vd_gdal_open(session, path, &dataset);
    if (status.code != VD_OK) {
        return status;
    }
    GDALRasterBandH band = NULL;
    status = pick_band(session, dataset, path, def->band, &band);
    if (status.code == VD_OK) {
        GDALDatasetH straight = vd_georef_straighten(session, dataset, path);
        status = read_dem(session, path, straight, band, def->band > 0 ? def->band : 1, def,
                          max_side, out);
        if (straight != dataset) {
            GDALClose(straight);
        }
    }
    GDALClose(dataset);
    return status;
}

void vd_geo_correct_scale(vd_gdal_session *session, const char *path, vd_dem *dem) {
    if (dem->kind != VD_CRS_PROJECTED || dem->crs == NULL) {
        return;
    }
    const double *t = dem->transform;
    double column = 0.5 * (dem->width - 1), row = 0.5 * (dem->height - 1);
    OGRSpatialReferenceH crs = vd_crs_open(dem->crs);
    double scale = vd_crs_ground_scale(crs, t[0] + column * t[1] + row * t[2],
                                       t[3] + column * t[4] + row * t[5], dem->crs_unit_m);
    OSRDestroySpatialReference(crs);
    vd_gdal_clear(session);
    if (fabs(scale - 1.0) > 0.01) {
        dem->crs_unit_m *= scale;
        vd_log(
            session->context, VD_LOG_INFO,
            "%s: its projection is not true to scale; a metre on the map is %.4g m on the ground "
            "at its centre, and distances are corrected by that",
            path, scale);
    }
}

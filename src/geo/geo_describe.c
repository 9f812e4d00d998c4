/* geo_describe.c: what a raster is, in one line. */
#include <stdio.h>
#include <string.h>
#include <veduta/geo.h>
#include "geo/geo_crs.h"

/* Names the bands' types: "1 band of int16", "6 bands of uint8", "4 bands of mixed types". */
static void describe_bands(GDALDatasetH dataset, char *out, size_t out_bytes) {
    const int count = GDALGetRasterCount(dataset);
    const char *type = vd_gdal_type_name(GDALGetRasterBand(dataset, 1));
    for (int b = 2; b <= count; b++) {
        if (strcmp(type, vd_gdal_type_name(GDALGetRasterBand(dataset, b))) != 0) {
            type = "mixed types";
            break;
        }
    }
    (void)snprintf(out, out_bytes, "%d band%s of %s", count, count == 1 ? "" : "s", type);
}

static void describe_crs(const vd_georef *georef, GDALDatasetH dataset, char *out,
                         size_t out_bytes) {
    OGRSpatialReferenceH crs = GDALGetSpatialRef(dataset);
    const char *name = crs != NULL ? OSRGetName(crs) : NULL;
    if (!georef->placed) {
        (void)snprintf(out, out_bytes, "no georeference");
    } else if (name == NULL) {
        (void)snprintf(out, out_bytes, "no CRS named%s%.60s",
                       georef->name[0] != '\0' ? ", taken as " : "", georef->name);
    } else if (strchr(georef->name, ':') != NULL && strchr(georef->name, '[') == NULL) {
        (void)snprintf(out, out_bytes, "%.150s (%.60s)", name, georef->name);
    } else {
        (void)snprintf(out, out_bytes, "%s", name);
    }
}

vd_status vd_geo_describe(vd_context *context, const char *path, char *out, size_t out_bytes) {
    if (out == NULL || out_bytes == 0) {
        return vd_failure(VD_ERROR_ARGUMENT, "vd_geo_describe: there is no room for the answer; "
                                             "give at least one byte");
    }
    vd_gdal_session session;
    vd_gdal_begin(&session, context);
    session.quiet = true; /* what there is to say about the file, loading says */
    GDALDatasetH dataset = NULL;
    vd_status status = vd_gdal_open(&session, path, &dataset);
    if (status.code == VD_OK) {
        GDALDatasetH straight = vd_georef_straighten(&session, dataset, path);
        vd_georef georef = {.crs = NULL};
        status = vd_georef_init(&session, straight, path, &georef);
        if (status.code == VD_OK) {
            char bands[64], crs[256];
            describe_bands(dataset, bands, sizeof bands);
            describe_crs(&georef, straight, crs, sizeof crs);
            (void)snprintf(out, out_bytes, "%s, %d × %d, %s, %s",
                           GDALGetDriverShortName(GDALGetDatasetDriver(dataset)),
                           GDALGetRasterXSize(dataset), GDALGetRasterYSize(dataset), bands, crs);
            vd_georef_finish(&georef);
        }
        if (straight != dataset) {
            GDALClose(straight);
        }
        GDALClose(dataset);
    }
    vd_gdal_end(&session);
    return status;
}

/* geo_support.h: rasters made by GDAL itself, and a context that keeps its log. */
#ifndef VEDUTA_TEST_GEO_SUPPORT_H
#define VEDUTA_TEST_GEO_SUPPORT_H

#include "support.h"

#include <gdal.h>
#include <gdal_alg.h>
#include <math.h>
#include <ogr_srs_api.h>
#include <stdio.h>
#include <sys/stat.h>
#include <unistd.h>
#include <veduta/geo.h>

/* Each test has a folder of its own, so that they can run at once. */
#define FOLDER VEDUTA_BINARY_DIR "/" GEO_FOLDER

/* ---- making rasters
 * ------------------------------------------------------------------------------ */

/* What a raster to be made is like; zero fields are left to GDAL. */
typedef struct raster {
    const char *driver; /* null: GTiff */
    int width, height, bands;
    GDALDataType type;
    const double *transform;
    const char *crs;
    const char *unit;
    const double *nodata;
    double scale, offset;
    char **options;
    double (*value)(int band, int column, int row); /* null: plane */
} raster;

static inline double plane(int band, int column, int row) {
    return 20.0 * band + 2.0 * column + 3.0 * row;
}

static const double utm[6] = {500000.0, 30.0, 0.0, 5100000.0, 0.0, -30.0};

static inline GDALDatasetH create_raster(const char *name, const raster *r) {
    char path[512];
    (void)snprintf(path, sizeof path, "%s/%s", FOLDER, name);
    GDALDriverH driver = GDALGetDriverByName(r->driver != NULL ? r->driver : "GTiff");
    const int bands = r->bands > 0 ? r->bands : 1;
    const GDALDataType type = r->type != GDT_Unknown ? r->type : GDT_Float32;
    GDALDatasetH dataset = GDALCreate(driver, path, r->width, r->height, bands, type, r->options);
    assert_non_null(dataset);
    if (r->transform != NULL) {
        double t[6];
        memcpy(t, r->transform, sizeof t);
        assert_int_equal(GDALSetGeoTransform(dataset, t), CE_None);
    }
    if (r->crs != NULL) {
        OGRSpatialReferenceH crs = OSRNewSpatialReference(NULL);
        assert_int_equal(OSRSetFromUserInput(crs, r->crs), OGRERR_NONE);
        OSRSetAxisMappingStrategy(crs, OAMS_TRADITIONAL_GIS_ORDER);
        assert_int_equal(GDALSetSpatialRef(dataset, crs), CE_None);
        OSRDestroySpatialReference(crs);
    }
    double *line = malloc((size_t)r->width * sizeof *line);
    assert_non_null(line);
    for (int b = 1; b <= bands; b++) {
        GDALRasterBandH band = GDALGetRasterBand(dataset, b);
        if (r->unit != NULL) {
            assert_int_equal(GDALSetRasterUnitType(band, r->unit), CE_None);
        }
        if (r->nodata != NULL) {
            assert_int_equal(GDALSetRasterNoDataValue(band, *r->nodata), CE_None);
        }
        if (r->scale != 0.0) {
            assert_int_equal(GDALSetRasterScale(band, r->scale), CE_None);
            assert_int_equal(GDALSetRasterOffset(band, r->offset), CE_None);
        }
        for (int y = 0; y < r->height; y++) {
            for (int x = 0; x < r->width; x++) {
                line[x] = r->value != NULL ? r->value(b, x, y) : plane(b, x, y);
            }
            assert_int_equal(GDALRasterIO(band, GF_Write, 0, y, r->width, 1, line, r->width, 1,
                                          GDT_Float64, 0, 0),
                             CE_None);
        }
    }
    free(line);
    return dataset;
}

static inline void make_raster(const char *name, const raster *r) {
    GDALClose(create_raster(name, r));
}

static inline void write_text(const char *name, const char *text) {
    char path[512];
    (void)snprintf(path, sizeof path, "%s/%s", FOLDER, name);
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    (void)fputs(text, file);
    assert_int_equal(fclose(file), 0);
}

/* ---- a context that keeps its log
 * ---------------------------------------------------------------- */

static char log_text[4096];

static inline void keep_log(void *user, vd_log_level level, const char *sentence) {
    (void)user;
    if (level > VD_LOG_DEBUG) {
        size_t used = strlen(log_text);
        (void)snprintf(log_text + used, sizeof log_text - used, "%s\n", sentence);
    }
}

static vd_context *context;
static size_t bytes_before; /* the context itself */

static inline int setup(void **state) {
    (void)state;
    GDALAllRegister();
    (void)mkdir(FOLDER, 0777);
    vd_context_def def = vd_context_def_default();
    def.threads = 1;
    def.log = keep_log;
    assert_ok(vd_context_create(&def, &context));
    bytes_before = vd_context_memory(context).bytes_now;
    return 0;
}

static inline int teardown(void **state) {
    (void)state;
    assert_int_equal(vd_context_memory(context).bytes_now, bytes_before);
    vd_context_destroy(&context);
    GDALDestroyDriverManager();
    return 0;
}

static inline vd_status try_load(const char *name, const vd_geo_def *def, vd_dem **out) {
    char path[512];
    (void)snprintf(path, sizeof path, "%s%s%s", name[0] == '/' ? "" : FOLDER,
                   name[0] == '/' ? "" : "/", name);
    const char *paths[] = {path};
    log_text[0] = '\0';
    return vd_geo_load_dem(context, paths, 1, def, out);
}

static inline vd_dem *load_with(const char *name, const vd_geo_def *def) {
    vd_dem *dem = NULL;
    assert_ok(try_load(name, def, &dem));
    return dem;
}

static inline vd_dem *load(const char *name) {
    return load_with(name, NULL);
}

static inline float at(const vd_dem *dem, int column, int row) {
    return dem->heights[(size_t)row * dem->stride + (size_t)column];
}

static inline void assert_logged(const char *words) {
    if (strstr(log_text, words) == NULL) {
        fail_msg("\"%s\" is not in the log: %s", words, log_text);
    }
}

static inline void assert_plane(const vd_dem *dem, double tolerance) {
    for (int row = 0; row < dem->height; row++) {
        for (int column = 0; column < dem->width; column++) {
            assert_true(fabs((double)at(dem, column, row) - plane(1, column, row)) <= tolerance);
        }
    }
}

static inline void assert_transform(const vd_dem *dem, double x, double dx, double rx, double y,
                                    double ry, double dy) {
    const double expected[6] = {x, dx, rx, y, ry, dy};
    for (int i = 0; i < 6; i++) {
        if (!(fabs(dem->transform[i] - expected[i]) <= 1e-9 * (1.0 + fabs(expected[i])))) {
            fail_msg("transform[%d] is %.17g, not %.17g", i, dem->transform[i], expected[i]);
        }
    }
}

static inline vd_dem *load_placed(const char *name, const double transform[6], const char *crs) {
    raster r = {.width = 40, .height = 20, .transform = transform, .crs = crs};
    make_raster(name, &r);
    return load(name);
}

static inline double real_plane(int band, int column, int row) {
    (void)band;
    return 100.0 + 0.25 * column + 0.5 * row;
}

/* The mean of a plane over a cell is the plane at its centre, so any slip of weights or of the
 * transform shows: exactly where a cell covers whole samples; else samples that are cut by its two
 * edges put the mean off by up to 1/8 of a sample each. */
static inline void assert_real_plane(const vd_dem *dem, double cell, double tolerance) {
    for (int row = 0; row < dem->height; row++) {
        for (int column = 0; column < dem->width; column++) {
            double x = dem->transform[0] + column * dem->transform[1];
            double y = dem->transform[3] + row * dem->transform[5];
            double expected =
                100.0 + 0.25 * ((x - 500000.0) / cell - 0.5) + 0.5 * ((5100000.0 - y) / cell - 0.5);
            if (!(fabs((double)at(dem, column, row) - expected) < tolerance)) {
                fail_msg("(%d, %d): %g, not %g", column, row, (double)at(dem, column, row),
                         expected);
            }
        }
    }
}

#endif

/* test_geo_vectors.c: points, lines and polygons, from files written by hand and by OGR. */
#define GEO_FOLDER "test-geo-vectors"
#include "geo_support.h"
#include <cpl_conv.h>
#include <ogr_api.h>

#define VECTORS VEDUTA_SOURCE_DIR "/test/vectors/"

static vd_status try_features(const char *path, const vd_geo_features_def *def, vd_features **out) {
    log_text[0] = '\0';
    return vd_geo_load_features(context, path, def, out);
}

static vd_features *features_of(const char *path, const vd_geo_features_def *def) {
    vd_features *f = NULL;
    assert_ok(try_features(path, def, &f));
    /* What holds of all. */
    assert_true(f->count > 0 && f->names[0] == '\0');
    size_t part = 0;
    for (size_t i = 0; i < f->count; i++) {
        const vd_feature *one = &f->features[i];
        assert_true(one->first_part == part && one->part_count > 0);
        assert_true(one->name < f->name_bytes);
        for (; part < one->first_part + one->part_count; part++) {
            const size_t from = f->parts[part], to = f->parts[part + 1], count = to - from;
            assert_true(from < to && to <= f->point_count);
            assert_true(one->kind != VD_FEATURE_POINT || (count == 1 && one->part_count == 1));
            assert_true(one->kind != VD_FEATURE_LINE || count >= 2);
            assert_true(one->kind != VD_FEATURE_POLYGON ||
                        (count >= 4 &&
                         memcmp(f->points[from], f->points[to - 1], 2 * sizeof(double)) == 0));
            for (size_t k = from; k < to; k++) {
                assert_true(one->has_z || f->points[k][2] == 0.0);
            }
        }
    }
    assert_true(part == f->part_count && f->parts[0] == 0 && f->parts[part] == f->point_count);
    return f;
}

static void assert_feature(const vd_features *f, size_t index, vd_feature_kind kind,
                           const char *name, bool has_z, size_t parts) {
    assert_true(index < f->count);
    const vd_feature *one = &f->features[index];
    assert_int_equal(one->kind, kind);
    assert_string_equal(f->names + one->name, name);
    assert_int_equal(one->has_z, has_z);
    assert_int_equal(one->part_count, parts);
}

static void assert_point(const vd_features *f, size_t feature, size_t part, size_t point, double x,
                         double y, double z) {
    const double *p = f->points[f->parts[f->features[feature].first_part + part] + point];
    if (!(fabs(p[0] - x) < 1e-9 && fabs(p[1] - y) < 1e-9 && fabs(p[2] - z) < 1e-9)) {
        fail_msg("feature %zu, part %zu, point %zu: %.12g, %.12g, %.12g", feature, part, point,
                 p[0], p[1], p[2]);
    }
}

/* ---- files written by hand ------------------------------------------------------------------- */

static void geojson_of_every_kind(void **state) {
    (void)state;
    vd_features *f = features_of(VECTORS "places.geojson", NULL);
    assert_int_equal(f->count, 9);
    assert_feature(f, 0, VD_FEATURE_POINT, "Mont Blanc", true, 1);
    assert_point(f, 0, 0, 0, 6.8652, 45.8326, 4808);
    assert_feature(f, 1, VD_FEATURE_POINT, "Chamonix", false, 1);
    assert_feature(f, 2, VD_FEATURE_LINE, "", false, 1);
    assert_point(f, 2, 0, 2, 6.90, 45.95, 0);
    assert_feature(f, 3, VD_FEATURE_POLYGON, "Mer de Glace", true, 2);
    assert_point(f, 3, 0, 1, 6.96, 45.85, 2300);
    assert_point(f, 3, 1, 0, 6.92, 45.87, 2000);
    assert_feature(f, 4, VD_FEATURE_POINT, "Les Drus", true, 1);
    assert_feature(f, 5, VD_FEATURE_POINT, "Les Drus", true, 1);
    assert_int_equal(f->features[4].name, f->features[5].name);
    assert_feature(f, 6, VD_FEATURE_POINT, "Both", false, 1);
    assert_feature(f, 7, VD_FEATURE_POLYGON, "Both", false, 1);
    assert_feature(f, 8, VD_FEATURE_POLYGON, "Both", false, 1);
    assert_logged("1 of its features have no place");
    vd_features_destroy(&f);
    assert_null(f);
    vd_features_destroy(&f);
}

static void names_from_another_property(void **state) {
    (void)state;
    vd_geo_features_def def = vd_geo_features_def_default();
    def.name_field = "height";
    vd_features *f = features_of(VECTORS "places.geojson", &def);
    assert_feature(f, 0, VD_FEATURE_POINT, "4808", true, 1);
    assert_feature(f, 4, VD_FEATURE_POINT, "", true, 1);
    vd_features_destroy(&f);
    def.name_field = "altitude";
    vd_status status = try_features(VECTORS "places.geojson", &def, &f);
    assert_int_equal(status.code, VD_ERROR_ARGUMENT);
    assert_non_null(
        strstr(status.message, "places.geojson has no property altitude; it has name, height"));
    assert_null(f);
}

static void gpx_with_and_without_heights(void **state) {
    (void)state;
    vd_features *f = features_of(VECTORS "walk.gpx", NULL);
    assert_int_equal(f->count, 4);
    assert_feature(f, 0, VD_FEATURE_POINT, "Chamonix – départ", true, 1);
    assert_point(f, 0, 0, 0, 6.8694, 45.9237, 1035);
    assert_feature(f, 1, VD_FEATURE_LINE, "plan", false, 1);
    assert_point(f, 1, 0, 1, 6.88, 45.90, 0);
    assert_feature(f, 2, VD_FEATURE_LINE, "walk", true, 2);
    assert_point(f, 2, 0, 0, 6.8694, 45.9237, 1035.5);
    assert_point(f, 2, 1, 1, 6.88, 45.905, 1700);
    assert_feature(f, 3, VD_FEATURE_POINT, "walk", true, 1); /* its segment of one point */
    assert_point(f, 3, 0, 0, 6.885, 45.9, 1800);
    vd_features_destroy(&f);
    f = features_of(VECTORS "flat.gpx", NULL);
    assert_int_equal(f->count, 2);
    assert_feature(f, 0, VD_FEATURE_LINE, "no heights", false, 1);
    assert_feature(f, 1, VD_FEATURE_POINT, "one point", false, 1);
    assert_point(f, 1, 0, 0, 6.88, 45.90, 0);
    vd_features_destroy(&f);
    assert_null(CPLGetThreadLocalConfigOption("GPX_ELE_AS_25D", NULL));
}

static void kml(void **state) {
    (void)state;
    vd_features *f = features_of(VECTORS "area.kml", NULL);
    assert_int_equal(f->count, 3);
    assert_feature(f, 0, VD_FEATURE_POINT, "Refuge du Goûter", true, 1);
    assert_point(f, 0, 0, 0, 6.8307, 45.8511, 3835);
    assert_feature(f, 1, VD_FEATURE_POLYGON, "meadow", false, 1);
    assert_feature(f, 2, VD_FEATURE_LINE, "path", false, 1);
    assert_point(f, 2, 0, 1, 6.81, 45.81, 0);
    vd_features_destroy(&f);
}

/* ---- other coordinate reference systems ------------------------------------------------------ */

static void into_another_system(void **state) {
    (void)state;
    vd_geo_features_def def = vd_geo_features_def_default();
    def.crs = "EPSG:32632";
    vd_features *f = features_of(VECTORS "places.geojson", &def);
    double x, y;
    assert_ok(vd_geo_from_lonlat(context, "EPSG:32632", 6.8652, 45.8326, &x, &y));
    assert_point(f, 0, 0, 0, x, y, 4808);
    vd_features_destroy(&f);
    def.crs = "EPSG:999999";
    vd_status status = try_features(VECTORS "places.geojson", &def, &f);
    assert_int_equal(status.code, VD_ERROR_ARGUMENT);
    assert_non_null(strstr(status.message, "PROJ does not know"));
}

typedef struct written {
    const char *driver, *name, *crs;
    OGRwkbGeometryType type;
    const char *wkt[2];
} written;

/* Has OGR write two layers into a file or, of Shapefile, the first into one. */
static const char *write_vectors(const written *w) {
    static char path[512];
    (void)snprintf(path, sizeof path, "%s/%s", FOLDER, w->name);
    GDALDriverH driver = GDALGetDriverByName(w->driver);
    assert_non_null(driver);
    if (access(path, F_OK) == 0) {
        assert_int_equal(GDALDeleteDataset(driver, path), CE_None);
    }
    GDALDatasetH dataset = GDALCreate(driver, path, 0, 0, 0, GDT_Unknown, NULL);
    assert_non_null(dataset);
    OGRSpatialReferenceH crs = NULL;
    if (w->crs != NULL) {
        crs = OSRNewSpatialReference(NULL);
        assert_int_equal(OSRSetFromUserInput(crs, w->crs), OGRERR_NONE);
        OSRSetAxisMappingStrategy(crs, OAMS_TRADITIONAL_GIS_ORDER);
    }
    for (int i = 0; i < 2 && w->wkt[i] != NULL; i++) {
        OGRLayerH layer =
            GDALDatasetCreateLayer(dataset, i == 0 ? "first" : "second", crs, w->type, NULL);
        assert_non_null(layer);
        OGRFieldDefnH field = OGR_Fld_Create("TITLE", OFTString);
        assert_int_equal(OGR_L_CreateField(layer, field, TRUE), OGRERR_NONE);
        OGR_Fld_Destroy(field);
        OGRFeatureH feature = OGR_F_Create(OGR_L_GetLayerDefn(layer));
        OGR_F_SetFieldString(feature, 0, i == 0 ? "Rêve" : "second");
        char *wkt = CPLStrdup(w->wkt[i]), *rest = wkt;
        OGRGeometryH geometry = NULL;
        assert_int_equal(OGR_G_CreateFromWkt(&rest, NULL, &geometry), OGRERR_NONE);
        CPLFree(wkt);
        assert_int_equal(OGR_F_SetGeometryDirectly(feature, geometry), OGRERR_NONE);
        assert_int_equal(OGR_L_CreateFeature(layer, feature), OGRERR_NONE);
        OGR_F_Destroy(feature);
    }
    GDALClose(dataset);
    if (crs != NULL) {
        OSRDestroySpatialReference(crs);
    }
    return path;
}

static void shapefile_and_geopackage(void **state) {
    (void)state;
    const written shape = {"ESRI Shapefile",
                           "line.shp",
                           "EPSG:32632",
                           wkbLineString25D,
                           {"LINESTRING Z (334000 5078000 1000, 335000 5079000 1100)", NULL}};
    vd_geo_features_def def = vd_geo_features_def_default();
    def.crs = "EPSG:32632";
    vd_features *f = features_of(write_vectors(&shape), &def);
    assert_int_equal(f->count, 1);
    assert_feature(f, 0, VD_FEATURE_LINE, "Rêve", true, 1);
    assert_point(f, 0, 0, 1, 335000, 5079000, 1100);
    vd_features_destroy(&f);
    f = features_of(write_vectors(&shape), NULL);
    double lon, lat;
    assert_ok(vd_geo_to_lonlat(context, "EPSG:32632", 335000, 5079000, &lon, &lat));
    assert_point(f, 0, 0, 1, lon, lat, 1100);
    vd_features_destroy(&f);
    /* Several layers, and a curve. */
    const written package = {"GPKG",
                             "two.gpkg",
                             "EPSG:2154",
                             wkbUnknown,
                             {"CIRCULARSTRING (999000 6540000, 1000000 6541000, 1001000 6540000)",
                              "POINT (1000000 6540000)"}};
    f = features_of(write_vectors(&package), NULL);
    assert_int_equal(f->count, 2);
    assert_feature(f, 0, VD_FEATURE_LINE, "Rêve", false, 1);
    assert_true(f->parts[1] - f->parts[0] > 20);
    assert_feature(f, 1, VD_FEATURE_POINT, "second", false, 1);
    assert_ok(vd_geo_to_lonlat(context, "EPSG:2154", 1000000, 6540000, &lon, &lat));
    assert_point(f, 1, 0, 0, lon, lat, 0);
    vd_features_destroy(&f);
}

static void without_a_system(void **state) {
    (void)state;
    const written degrees = {
        "ESRI Shapefile", "degrees.shp", NULL, wkbPoint, {"POINT (6.5 45.5)", NULL}};
    vd_features *f = features_of(write_vectors(&degrees), NULL);
    assert_point(f, 0, 0, 0, 6.5, 45.5, 0);
    assert_logged("names no CRS; its coordinates are taken as longitude and latitude");
    vd_features_destroy(&f);
    const written metres = {
        "ESRI Shapefile", "metres.shp", NULL, wkbPoint, {"POINT (334000 5078000)", NULL}};
    vd_status status = try_features(write_vectors(&metres), NULL, &f);
    assert_int_equal(status.code, VD_ERROR_FORMAT);
    assert_non_null(strstr(status.message, "its coordinates are not degrees; set one"));
    vd_geo_features_def def = vd_geo_features_def_default();
    def.crs = "EPSG:32632";
    f = features_of(write_vectors(&metres), &def);
    assert_point(f, 0, 0, 0, 334000, 5078000, 0);
    assert_logged("taken as they are wanted");
    vd_features_destroy(&f);
}

/* ---- what cannot be read --------------------------------------------------------------------- */

static void assert_fails(const char *path, vd_code code, const char *words) {
    vd_features *f = NULL;
    const vd_status status = try_features(path, NULL, &f);
    if (status.code != code || strstr(status.message, words) == NULL) {
        fail_msg("%s: %s (%s), not \"%s\"", path != NULL ? path : "no path", status.message,
                 vd_code_name(status.code), words);
    }
    assert_null(f);
}

static void failures_have_sentences(void **state) {
    (void)state;
    assert_fails(NULL, VD_ERROR_ARGUMENT, "the path of a vector file is empty; name a file");
    assert_fails(FOLDER "/none.gpx", VD_ERROR_IO, "there is no such file; check the path");
    assert_fails(VEDUTA_SOURCE_DIR "/include", VD_ERROR_IO,
                 "it is a folder, and not one that GDAL knows as a vector file; give a file");
    assert_fails(VECTORS "empty.gpx", VD_ERROR_EMPTY, "it holds no points, lines or polygons");
    assert_fails(VECTORS "cut.gpx", VD_ERROR_FORMAT, "it is damaged (GDAL says: XML parsing");
    assert_fails(VECTORS "swapped.geojson", VD_ERROR_FORMAT,
                 "feature 2 has the longitude 45.9 and the latitude 166.9, which is nowhere");
    assert_fails(VECTORS "README.md", VD_ERROR_FORMAT,
                 "GDAL does not know its format; convert it to GeoJSON or GPX");
    assert_fails(VEDUTA_SOURCE_DIR "/data/mont-blanc.tif", VD_ERROR_FORMAT,
                 "it is a raster (GeoTIFF), and holds no points, lines or polygons");
    write_text("empty.geojson", "");
    assert_fails(FOLDER "/empty.geojson", VD_ERROR_FORMAT, "it is empty; get the file again");
    write_text("damaged.geojson", "{\"type\": \"FeatureCollection\", \"features\": [{");
    assert_fails(FOLDER "/damaged.geojson", VD_ERROR_FORMAT, "cannot read");
    write_text("nothing.geojson", "{\"type\": \"FeatureCollection\", \"features\": []}");
    assert_fails(FOLDER "/nothing.geojson", VD_ERROR_EMPTY, "it holds no points");
    write_text("beyond.geojson", "{\"type\": \"Point\", \"coordinates\": [1e400, 5]}");
    assert_fails(FOLDER "/beyond.geojson", VD_ERROR_FORMAT, "no number");
    vd_geo_features_def def = vd_geo_features_def_default();
    def.max_points = 12;
    vd_features *f = NULL;
    vd_status status = try_features(VECTORS "places.geojson", &def, &f);
    assert_int_equal(status.code, VD_ERROR_LIMIT);
    assert_non_null(strstr(status.message, "it has more than 12 points"));
    def.crs = "EPSG:3035"; /* an area that does not reach so far */
    def.max_points = 0;
    write_text("far.geojson", "{\"type\": \"Point\", \"coordinates\": [-170, -89.999999999]}");
    status = try_features(FOLDER "/far.geojson", &def, &f);
    assert_true(status.code == VD_OK || status.code == VD_ERROR_FORMAT);
    vd_features_destroy(&f);
}

static void memory_runs_out(void **state) {
    (void)state;
    int failures = 0;
    for (int fail_at = 1; fail_at < 100; fail_at++) {
        test_allocator allocator = {0, 0, 0};
        vd_context *failing = test_failing_context(&allocator);
        const int live = allocator.live;
        allocator.fail_at = allocator.calls + fail_at;
        vd_features *f = NULL;
        vd_status status = vd_geo_load_features(failing, VECTORS "places.geojson", NULL, &f);
        const bool done = status.code == VD_OK;
        if (!done) {
            assert_int_equal(status.code, VD_ERROR_MEMORY);
            assert_null(f);
            failures++;
        }
        vd_features_destroy(&f);
        assert_int_equal(allocator.live, live);
        vd_context_destroy(&failing);
        if (done) {
            break;
        }
    }
    assert_int_equal(failures, 6); /* the struct, layers, names, features, points, parts */
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(geojson_of_every_kind),
        cmocka_unit_test(names_from_another_property),
        cmocka_unit_test(gpx_with_and_without_heights),
        cmocka_unit_test(kml),
        cmocka_unit_test(into_another_system),
        cmocka_unit_test(shapefile_and_geopackage),
        cmocka_unit_test(without_a_system),
        cmocka_unit_test(failures_have_sentences),
        cmocka_unit_test(memory_runs_out),
    };
    return cmocka_run_group_tests(tests, setup, teardown);
}

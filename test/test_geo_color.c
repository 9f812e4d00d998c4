/* test_geo_color.c: imagery on elevation, points and descriptions. */
#define GEO_FOLDER "test-geo-color"
#include "geo_support.h"

/* ---- helpers
 * ------------------------------------------------------------------------------------- */

static vd_status try_color(const char *path, const vd_dem *dem, const int bands[3],
                           vd_picture **out, double map[6], bool *placed) {
    log_text[0] = '\0';
    return vd_geo_load_color(context, path, dem, bands, out, map, placed);
}

static const uint8_t *pixel(const vd_picture *picture, int x, int y) {
    return (const uint8_t *)picture->data + (size_t)y * picture->stride_bytes +
           (size_t)x * (size_t)picture->channels;
}

static double ramp(int band, int column, int row) {
    return band * 50 + column + row;
}

static double gentle_ramp(int band, int column, int row) {
    (void)band;
    return 10.0 + 0.4 * (column + row);
}

/* A DEM of 20 × 10 samples of 30 m, and imagery of 10 m whose corner lies `x`, `y` metres from its.
 */
static vd_dem *make_ground(void) {
    raster r = {.width = 20, .height = 10, .transform = utm, .crs = "EPSG:32632"};
    make_raster("ground.tif", &r);
    return load("ground.tif");
}

static void make_image(const char *name, int width, int height, double x, double y, int bands,
                       GDALDataType type, const double *nodata) {
    const double t[6] = {utm[0] + x, 10.0, 0.0, utm[3] - y, 0.0, -10.0};
    raster r = {.width = width,
                .height = height,
                .bands = bands,
                .type = type,
                .transform = t,
                .crs = "EPSG:32632",
                .value = ramp,
                .nodata = nodata};
    make_raster(name, &r);
}

/* ---- placing
 * ------------------------------------------------------------------------------------- */

static void same_grid_is_kept(void **state) {
    (void)state;
    vd_dem *dem = make_ground();
    /* Larger than the DEM on all sides by 5 pixels. */
    make_image("wide.tif", 70, 40, -50.0, -50.0, 3, GDT_Byte, NULL);
    vd_picture *picture = NULL;
    double map[6] = {0};
    bool placed = false;
    assert_ok(try_color(FOLDER "/wide.tif", dem, NULL, &picture, map, &placed));
    assert_true(placed);
    assert_int_equal(picture->channels, 3);
    assert_int_equal(picture->bits, 8);
    assert_int_equal(picture->width, 62); /* 60 under the DEM and one more on each side */
    assert_int_equal(picture->height, 32);
    assert_true(map[1] == 3.0 && map[2] == 0.0 && map[4] == 0.0 && map[5] == 3.0);
    assert_true(fabs(map[0] - 2.5) < 1e-9 && fabs(map[3] - 2.5) < 1e-9);
    /* The pixel that the first sample points at is the sixth of the file, as it was. */
    const uint8_t *p = pixel(picture, (int)map[0], (int)map[3]);
    assert_true(p[0] == ramp(1, 6, 6) && p[1] == ramp(2, 6, 6) && p[2] == ramp(3, 6, 6));
    vd_picture_destroy(&picture);

    const int bgr[3] = {3, 2, 1}, one[3] = {2, 0, 0}, bad[3] = {1, 2, 9};
    assert_ok(try_color(FOLDER "/wide.tif", dem, bgr, &picture, map, &placed));
    p = pixel(picture, 2, 2);
    assert_true(p[0] == ramp(3, 6, 6) && p[2] == ramp(1, 6, 6));
    vd_picture_destroy(&picture);
    assert_ok(try_color(FOLDER "/wide.tif", dem, one, &picture, map, &placed));
    assert_true(picture->channels == 1 && pixel(picture, 2, 2)[0] == ramp(2, 6, 6));
    vd_picture_destroy(&picture);
    vd_status status = try_color(FOLDER "/wide.tif", dem, bad, &picture, map, &placed);
    assert_int_equal(status.code, VD_ERROR_ARGUMENT);
    assert_non_null(strstr(status.message, "cannot read band 9 of"));
    assert_null(picture);
    vd_dem_destroy(&dem);
}

static void image_ends_inside(void **state) {
    (void)state;
    vd_dem *dem = make_ground();
    make_image("inner.tif", 30, 20, 150.0, 50.0, 3, GDT_Byte, NULL);
    vd_picture *picture = NULL;
    double map[6] = {0};
    bool placed = false;
    assert_ok(try_color(FOLDER "/inner.tif", dem, NULL, &picture, map, &placed));
    assert_true(placed && picture->channels == 4);
    assert_true(picture->width == 32 && picture->height == 22);
    for (int x = 0; x < picture->width; x++) {
        assert_int_equal(pixel(picture, x, 0)[3], 0);
        assert_int_equal(pixel(picture, x, 21)[3], 0);
    }
    assert_true(pixel(picture, 0, 9)[3] == 0 && pixel(picture, 31, 9)[3] == 0);
    assert_int_equal(pixel(picture, 1, 1)[3], 255);
    assert_int_equal(pixel(picture, 0, 1)[0], pixel(picture, 1, 1)[0]);
    /* Sample (5, 2) lies 165 m, 75 m from the DEM's corner: 15 m and 25 m into the image. */
    assert_true(fabs(map[0] + 5.0 * map[1] - 2.5) < 1e-9);
    assert_true(fabs(map[3] + 2.0 * map[5] - 3.5) < 1e-9);
    vd_picture_destroy(&picture);
    vd_dem_destroy(&dem);
}

static void other_crs_is_warped(void **state) {
    (void)state;
    const double t[6] = {8.99, 0.0001, 0.0, 46.06, 0.0, -0.0001};
    raster r = {.width = 300,
                .height = 200,
                .bands = 1,
                .type = GDT_Byte,
                .transform = t,
                .crs = "EPSG:4326",
                .value = gentle_ramp};
    make_raster("degrees.tif", &r);
    vd_dem *dem = make_ground();
    double map[6] = {0}, lon = 0.0, lat = 0.0;
    bool placed = false;
    vd_picture *picture = NULL;
    assert_ok(try_color(FOLDER "/degrees.tif", dem, NULL, &picture, map, &placed));
    assert_true(placed && picture->channels == 2);
    assert_logged("warped from EPSG:4326");
    assert_ok(vd_geo_to_lonlat(context, dem->crs, dem->transform[0] + 10 * 30.0,
                               dem->transform[3] - 5 * 30.0, &lon, &lat));
    double expected = 10.0 + 0.4 * ((lon - t[0]) / 0.0001 + (t[3] - lat) / 0.0001 - 1.0);
    const uint8_t *p = pixel(picture, (int)(map[0] + 10 * map[1]), (int)(map[3] + 5 * map[5]));
    assert_int_equal(p[1], 255);
    assert_true(fabs(p[0] - expected) <= 1.2);
    vd_picture_destroy(&picture);
    vd_dem_destroy(&dem);
}

static void different_places(void **state) {
    (void)state;
    vd_dem *dem = make_ground();
    make_image("far.tif", 30, 20, 90000.0, 0.0, 3, GDT_Byte, NULL);
    const double t[6] = {-34.9, 0.0001, 0.0, -8.0, 0.0, -0.0001};
    raster brazil = {
        .width = 30, .height = 20, .type = GDT_Byte, .transform = t, .crs = "EPSG:4326"};
    make_raster("brazil.tif", &brazil);
    const char *const paths[] = {FOLDER "/far.tif", FOLDER "/brazil.tif"};
    for (int i = 0; i < 2; i++) {
        vd_picture *picture = NULL;
        double map[6] = {1.0};
        bool placed = false;
        vd_status status = try_color(paths[i], dem, NULL, &picture, map, &placed);
        assert_int_equal(status.code, VD_ERROR_ARGUMENT);
        assert_non_null(strstr(status.message, paths[i]));
        assert_non_null(strstr(status.message, "longitude, latitude"));
        assert_non_null(strstr(status.message, "give imagery of the same place"));
        assert_true(picture == NULL && map[0] == 1.0 && !placed);
    }
    vd_dem_destroy(&dem);
}

static void committed_places(void **state) {
    (void)state;
    const char *paths[] = {VEDUTA_SOURCE_DIR "/data/olinda/olinda_dem_utm25s.tif"};
    vd_dem *dem = NULL;
    assert_ok(vd_geo_load_dem(context, paths, 1, NULL, &dem));
    assert_true(dem->width == 111 && dem->kind == VD_CRS_PROJECTED && dem->crs_unit_m == 1.0);
    vd_picture *picture = NULL;
    double map[6] = {0};
    bool placed = false;
    const int natural[3] = {3, 2, 1};
    assert_ok(try_color(VEDUTA_SOURCE_DIR "/data/olinda/L7_ETMs.tif", dem, natural, &picture, map,
                        &placed));
    assert_int_equal(picture->channels, 4); /* warped: its alpha is the seventh of seven bands */
    /* The two share their upper left corner: half a cell of 90 m is 1.58 pixels of 28.5 m. */
    assert_true(placed && fabs(map[0] - 1.579) < 0.05 && fabs(map[3] - 1.579) < 0.05);
    assert_true(fabs(map[1] - 3.158) < 0.02 && fabs(map[5] - 3.158) < 0.02);
    vd_picture_destroy(&picture);
    assert_ok(try_color(VEDUTA_SOURCE_DIR "/data/levi/maptexture.jpg", dem, NULL, &picture, map,
                        &placed));
    assert_true(!placed && picture->width == 600 && picture->height == 600);
    assert_int_equal(picture->channels, 3);
    vd_picture_destroy(&picture);
    vd_dem_destroy(&dem);

    const char *alps[] = {VEDUTA_SOURCE_DIR "/data/mont-blanc.tif"};
    assert_ok(vd_geo_load_dem(context, alps, 1, NULL, &dem));
    assert_int_equal(dem->kind, VD_CRS_GEOGRAPHIC);
    assert_true(dem->max > 4600.0f && dem->max < 4810.0f);
    vd_dem_destroy(&dem);
}

/* ---- pixels
 * -------------------------------------------------------------------------------------- */

static double wide_values(int band, int column, int row) {
    (void)band;
    return column == 0 && row == 0 ? 60000.0 : 1000.0 + 10.0 * column;
}

static void stretched(void **state) {
    (void)state;
    raster r = {.width = 101, .height = 50, .type = GDT_UInt16, .value = wide_values};
    make_raster("deep.tif", &r);
    vd_picture *picture = NULL;
    double map[6];
    bool placed = true;
    assert_ok(try_color(FOLDER "/deep.tif", NULL, NULL, &picture, map, &placed));
    assert_true(!placed && picture->channels == 1 && picture->bits == 8);
    assert_int_equal(pixel(picture, 0, 0)[0], 255); /* the outlier is cut off */
    assert_true(pixel(picture, 0, 1)[0] == 0 && pixel(picture, 100, 0)[0] == 255);
    assert_true(abs((int)pixel(picture, 50, 7)[0] - 127) <= 2);
    assert_logged("uint16 values");
    vd_picture_destroy(&picture);
}

static void palette_and_nodata(void **state) {
    (void)state;
    raster r = {.width = 16, .height = 8, .type = GDT_Byte, .value = ramp};
    GDALDatasetH dataset = create_raster("palette.tif", &r);
    GDALColorTableH table = GDALCreateColorTable(GPI_RGB);
    for (int i = 0; i < 256; i++) {
        GDALColorEntry entry = {(short)(255 - i), (short)i, 7, 255};
        GDALSetColorEntry(table, i, &entry);
    }
    assert_int_equal(GDALSetRasterColorTable(GDALGetRasterBand(dataset, 1), table), CE_None);
    GDALDestroyColorTable(table);
    GDALClose(dataset);
    vd_picture *picture = NULL;
    double map[6];
    bool placed = false;
    assert_ok(try_color(FOLDER "/palette.tif", NULL, NULL, &picture, map, &placed));
    assert_int_equal(picture->channels, 3);
    const uint8_t *p = pixel(picture, 5, 3);
    assert_true(p[0] == 255 - 58 && p[1] == 58 && p[2] == 7);
    vd_picture_destroy(&picture);

    const double nodata = 58.0; /* band 1 at (5, 3); bands 2 and 3 have other values there */
    raster n = {.width = 16, .height = 8, .type = GDT_Byte, .value = ramp, .nodata = &nodata};
    make_raster("nodata1.tif", &n);
    assert_ok(try_color(FOLDER "/nodata1.tif", NULL, NULL, &picture, map, &placed));
    assert_true(picture->channels == 2 && pixel(picture, 5, 3)[1] == 0);
    assert_int_equal(pixel(picture, 4, 3)[1], 255);
    vd_picture_destroy(&picture);
    n.bands = 3;
    make_raster("nodata3.tif", &n);
    assert_ok(try_color(FOLDER "/nodata3.tif", NULL, NULL, &picture, map, &placed));
    assert_true(picture->channels == 4 && pixel(picture, 5, 3)[3] == 255);
    vd_picture_destroy(&picture);
}

static void large_images_are_averaged(void **state) {
    (void)state;
    raster r = {.width = 9000, .height = 3, .type = GDT_Byte, .value = ramp};
    make_raster("long.tif", &r);
    vd_picture *picture = NULL;
    double map[6];
    bool placed = false;
    assert_ok(try_color(FOLDER "/long.tif", NULL, NULL, &picture, map, &placed));
    assert_true(picture->width == 8192 && picture->height == 3);
    assert_logged("averaged to 8192 × 3");
    vd_picture_destroy(&picture);
}

/* ---- points, names, memory
 * ----------------------------------------------------------------------- */

static void points(void **state) {
    (void)state;
    double x = 0.0, y = 0.0, lon = 0.0, lat = 0.0;
    assert_ok(vd_geo_from_lonlat(context, "EPSG:32632", 9.0, 0.0, &x, &y));
    assert_true(fabs(x - 500000.0) < 1e-3 && fabs(y) < 1e-3);
    assert_ok(vd_geo_from_lonlat(context, "EPSG:4326", 7.0, 46.0, &x, &y));
    assert_true(x == 7.0 && y == 46.0); /* longitude first, whatever the authority says */
    assert_ok(vd_geo_to_lonlat(context, "EPSG:3857", 779236.4355, 5780349.2203, &lon, &lat));
    assert_true(fabs(lon - 7.0) < 1e-6 && fabs(lat - 46.0) < 1e-6);
    const char *const unknown[] = {NULL,
                                   "",
                                   "EPSG:1",
                                   "no such thing",
                                   "http://example.org/crs",
                                   VEDUTA_SOURCE_DIR "/CMakeLists.txt"};
    for (size_t i = 0; i < sizeof unknown / sizeof unknown[0]; i++) {
        vd_status status = vd_geo_from_lonlat(context, unknown[i], 7.0, 46.0, &x, &y);
        assert_int_equal(status.code, VD_ERROR_ARGUMENT);
        assert_non_null(strstr(status.message, "PROJ does not know it"));
    }
    assert_int_equal(vd_geo_from_lonlat(context, "EPSG:3857", NAN, 46.0, &x, &y).code,
                     VD_ERROR_ARGUMENT);
    assert_int_equal(vd_geo_from_lonlat(context, "EPSG:3857", 7.0, 1000.0, &x, &y).code,
                     VD_ERROR_ARGUMENT);
    assert_true(x == 7.0 && y == 46.0); /* untouched by failures */
}

static void descriptions(void **state) {
    (void)state;
    char line[200];
    assert_ok(
        vd_geo_describe(context, VEDUTA_SOURCE_DIR "/data/mont-blanc.tif", line, sizeof line));
    assert_non_null(strstr(line, "GTiff, 781 × 457, 1 band of int16, WGS 84 (EPSG:4326)"));
    assert_ok(
        vd_geo_describe(context, VEDUTA_SOURCE_DIR "/data/levi/maptexture.jpg", line, sizeof line));
    assert_string_equal(line, "JPEG, 600 × 600, 3 bands of uint8, no georeference");
    /* What loading says about a file must not be said a second time. */
    const double degrees[6] = {7.0, 0.001, 0.0, 46.0, 0.0, -0.001};
    vd_dem *dem = load_placed("unnamed.tif", degrees, NULL);
    assert_logged("it names no CRS");
    vd_dem_destroy(&dem);
    log_text[0] = '\0';
    assert_ok(vd_geo_describe(context, FOLDER "/unnamed.tif", line, sizeof line));
    assert_non_null(strstr(line, "no CRS named, taken as EPSG:4326"));
    assert_string_equal(log_text, "");
    char tiny[8];
    assert_ok(
        vd_geo_describe(context, VEDUTA_SOURCE_DIR "/data/mont-blanc.tif", tiny, sizeof tiny));
    assert_string_equal(tiny, "GTiff, ");
    assert_int_equal(vd_geo_describe(context, FOLDER "/missing", line, sizeof line).code,
                     VD_ERROR_IO);
    assert_int_equal(vd_geo_describe(context, FOLDER "/missing", line, 0).code, VD_ERROR_ARGUMENT);
}

static void every_allocation_fails(void **state) {
    (void)state;
    vd_dem *dem = make_ground();
    const double nodata = 3.0;
    make_image("u16.tif", 30, 20, 150.0, 50.0, 3, GDT_UInt16, &nodata);
    bool succeeded = false;
    for (int n = 1; n < 100 && !succeeded; n++) {
        test_allocator allocator = {.fail_at = 0};
        vd_context *failing = test_failing_context(&allocator);
        const int before = allocator.live;
        allocator.fail_at = allocator.calls + n;
        vd_picture *picture = NULL;
        double map[6];
        bool placed = false;
        vd_status status =
            vd_geo_load_color(failing, FOLDER "/u16.tif", dem, NULL, &picture, map, &placed);
        succeeded = status.code == VD_OK;
        if (!succeeded) {
            assert_int_equal(status.code, VD_ERROR_MEMORY);
            assert_true(picture == NULL && !placed);
            assert_int_equal(allocator.live, before);
        }
        vd_picture_destroy(&picture);
        vd_context_destroy(&failing);
        assert_int_equal(allocator.live, 0);
    }
    assert_true(succeeded);
    vd_dem_destroy(&dem);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(same_grid_is_kept),
        cmocka_unit_test(image_ends_inside),
        cmocka_unit_test(other_crs_is_warped),
        cmocka_unit_test(different_places),
        cmocka_unit_test(committed_places),
        cmocka_unit_test(stretched),
        cmocka_unit_test(palette_and_nodata),
        cmocka_unit_test(large_images_are_averaged),
        cmocka_unit_test(points),
        cmocka_unit_test(descriptions),
        cmocka_unit_test(every_allocation_fails),
    };
    return cmocka_run_group_tests(tests, setup, teardown);
}

/* test_geo_join.c: several rasters as one, and those that cannot be read. */
#define GEO_FOLDER "test-geo-join"
#include "geo_support.h"

/* ---- several
 * ------------------------------------------------------------------------------------- */

static double east_plane(int band, int column, int row) {
    return real_plane(band, column + 40, row);
}

static void make_tiles(void) {
    const double east[6] = {501200.0, 30.0, 0.0, 5100000.0, 0.0, -30.0};
    raster a = {.width = 41,
                .height = 30,
                .transform = utm,
                .crs = "EPSG:32632",
                .value = real_plane}; /* the last column is the other's first */
    raster b = {
        .width = 41, .height = 30, .transform = east, .crs = "EPSG:32632", .value = east_plane};
    make_raster("west.tif", &a);
    make_raster("east.tif", &b);
}

static void tiles_without_seam(void **state) {
    (void)state;
    make_tiles();
    const char *paths[] = {FOLDER "/west.tif", FOLDER "/east.tif"};
    vd_dem *dem = NULL;
    log_text[0] = '\0';
    assert_ok(vd_geo_load_dem(context, paths, 2, NULL, &dem));
    assert_true(dem->width == 81 && dem->height == 30 && dem->missing == 0);
    assert_real_plane(dem, 30.0, 1e-3);
    assert_string_equal(log_text, "");
    vd_dem_destroy(&dem);

    vd_geo_def def = vd_geo_def_default();
    def.max_side = 50; /* less than the union: every tile is reduced, then warped together */
    assert_ok(vd_geo_load_dem(context, paths, 2, &def, &dem));
    assert_true(dem->width <= 50 && dem->width >= 45 && dem->missing == 0);
    for (int column = 2; column < dem->width - 2; column++) {
        double step = (double)(at(dem, column + 1, 8) - at(dem, column, 8));
        assert_true(step > 0.25 && step < 0.6); /* no seam: 0.25 for each of 1.6 … 1.8 columns */
    }
    vd_dem_destroy(&dem);
}

/* Heights by place, so that any CRS gives the same. */
static double degree_plane(double lon, double lat) {
    return 1000.0 + 2000.0 * (lon - 9.0) + 3000.0 * (lat - 46.0);
}

static const double degree_tile[6] = {9.0, 0.001, 0.0, 46.05, 0.0, -0.001};
static const double utm_tile[6] = {503800.0, 90.0, 0.0, 5099800.0, 0.0, -90.0};

static double value_in_degrees(int band, int column, int row) {
    (void)band;
    return degree_plane(degree_tile[0] + (column + 0.5) * 0.001,
                        degree_tile[3] - (row + 0.5) * 0.001);
}

static double value_in_utm(int band, int column, int row) {
    (void)band;
    double lon = 0.0, lat = 0.0;
    assert_ok(vd_geo_to_lonlat(context, "EPSG:32632", utm_tile[0] + (column + 0.5) * 90.0,
                               utm_tile[3] - (row + 0.5) * 90.0, &lon, &lat));
    return degree_plane(lon, lat);
}

static void make_different(void) {
    raster a = {.width = 60,
                .height = 40,
                .transform = degree_tile,
                .crs = "EPSG:4326",
                .value = value_in_degrees};
    raster b = {.width = 70,
                .height = 40,
                .transform = utm_tile,
                .crs = "EPSG:32632",
                .value = value_in_utm};
    make_raster("degrees.tif", &a);
    make_raster("utm.tif", &b);
}

static void different_crs(void **state) {
    (void)state;
    make_different();
    const char *paths[] = {FOLDER "/degrees.tif", FOLDER "/utm.tif"};
    vd_dem *dem = NULL;
    log_text[0] = '\0';
    assert_ok(vd_geo_load_dem(context, paths, 2, NULL, &dem));
    assert_logged("warped to");
    assert_string_equal(dem->crs, "EPSG:4326");
    assert_true(fabs(dem->transform[1] - 0.001) < 1e-12 && dem->width > 100);
    uint64_t checked = 0;
    for (int row = 0; row < dem->height; row++) {
        for (int column = 0; column < dem->width; column++) {
            double lon = dem->transform[0] + column * dem->transform[1];
            double lat = dem->transform[3] + row * dem->transform[5];
            if (!isnan(at(dem, column, row))) {
                /* 90 m is 2.4 m of height; a border sample may be held by half a cell. */
                double error = fabs((double)at(dem, column, row) - degree_plane(lon, lat));
                assert_true(error < 2.5);
                checked += error < 0.2;
            }
        }
    }
    assert_true(checked > 4000);
    vd_dem_destroy(&dem);

    const char *nowhere[] = {FOLDER "/degrees.tif", FOLDER "/nowhere.tif"};
    dem = load_placed("nowhere.tif", NULL, NULL);
    vd_dem_destroy(&dem);
    vd_status status = vd_geo_load_dem(context, nowhere, 2, NULL, &dem);
    assert_int_equal(status.code, VD_ERROR_FORMAT);
    assert_non_null(strstr(status.message, "nowhere.tif with the others: it does not say where"));
    assert_null(dem);
}

static void rotated_first(void **state) {
    (void)state;
    make_tiles();
    const double rotated[6] = {500600.0, 24.0, 18.0, 5099700.0, 18.0, -24.0};
    vd_dem *dem = load_placed("rotated.tif", rotated, "EPSG:32632");
    vd_dem_destroy(&dem);
    const char *paths[] = {FOLDER "/rotated.tif", FOLDER "/west.tif"};
    assert_ok(vd_geo_load_dem(context, paths, 2, NULL, &dem));
    assert_true(dem->transform[2] == 0.0 && dem->transform[1] == 30.0);
    /* Where both have samples the first wins: its plane holds around its middle. */
    double x = 500600.0 + 20.0 * 24.0 + 10.0 * 18.0, y = 5099700.0 + 20.0 * 18.0 - 10.0 * 24.0;
    int column = (int)((x - dem->transform[0]) / 30.0 + 0.5);
    int row = (int)((y - dem->transform[3]) / -30.0 + 0.5);
    assert_true(fabs((double)at(dem, column, row) - plane(1, 20, 10)) < 5.0);
    vd_dem_destroy(&dem);
}

/* ---- where they lie
 * -------------------------------------------------------------------------------- */

/* Heights by degrees east of 179° and south of 16°, on either side of the date line. */
static double pacific_plane(double lon, double lat) {
    double east = lon - 179.0;
    east -= 360.0 * floor((east + 180.0) / 360.0);
    return 500.0 + 100.0 * east + 200.0 * (-16.0 - lat);
}

static double west_of_line(int band, int column, int row) {
    (void)band;
    return pacific_plane(179.0 + 0.02 * column, -16.0 - 0.02 * row);
}

static double east_of_line(int band, int column, int row) {
    (void)band;
    return pacific_plane(-180.0 + 0.02 * column, -16.0 - 0.02 * row);
}

static double east_in_utm(int band, int column, int row) {
    (void)band;
    double lon = 0.0, lat = 0.0;
    assert_ok(vd_geo_to_lonlat(context, "EPSG:32701", 190000.0 + (column + 0.5) * 2000.0,
                               8220000.0 - (row + 0.5) * 2000.0, &lon, &lat));
    return pacific_plane(lon, lat);
}

static void make_date_line(void) {
    /* Samples at whole hundredths; the last column of the west is the first of the east. */
    const double west[6] = {178.99, 0.02, 0.0, -15.99, 0.0, -0.02};
    const double east[6] = {-180.01, 0.02, 0.0, -15.99, 0.0, -0.02};
    const double east360[6] = {179.99, 0.02, 0.0, -15.99, 0.0, -0.02};
    const double between[6] = {-180.008, 0.02, 0.0, -15.995, 0.0, -0.02};
    const double zone1[6] = {190000.0, 2000.0, 0.0, 8220000.0, 0.0, -2000.0};
    raster r = {.width = 51, .height = 51, .crs = "EPSG:4326", .transform = west};
    r.value = west_of_line;
    make_raster("line-west.tif", &r);
    r.value = east_of_line;
    r.transform = east;
    make_raster("line-east.tif", &r);
    r.transform = east360;
    make_raster("line-east360.tif", &r);
    r.transform = between; /* up to a tenth of a cell beside: the heights may be off by that */
    make_raster("line-between.tif", &r);
    raster utm1 = {.width = 40, .height = 40, .crs = "EPSG:32701", .transform = zone1};
    utm1.value = east_in_utm;
    make_raster("line-utm.tif", &utm1);
}

/* Heights must follow the plane, whatever turn the longitudes got. */
static void assert_pacific(const vd_dem *dem, double tolerance) {
    for (int row = 0; row < dem->height; row++) {
        for (int column = 0; column < dem->width; column++) {
            double lon = dem->transform[0] + column * dem->transform[1];
            double lat = dem->transform[3] + row * dem->transform[5];
            double expected = pacific_plane(lon, lat), found = (double)at(dem, column, row);
            if (!isnan(found) && !(fabs(found - expected) <= tolerance)) {
                fail_msg("(%d, %d): %g, not %g", column, row, found, expected);
            }
        }
    }
}

static void across_the_date_line(void **state) {
    (void)state;
    make_date_line();
    const char *const west = FOLDER "/line-west.tif";
    const char *const others[] = {FOLDER "/line-east.tif", FOLDER "/line-east360.tif",
                                  FOLDER "/line-between.tif", FOLDER "/line-utm.tif"};
    const double tolerance[] = {1e-3, 1e-3, 4.0, 4.0};
    /* Either order; all but UTM first, where degrees do not tell the heights. */
    for (int i = 0; i < 7; i++) {
        const char *paths[] = {i & 1 ? others[i / 2] : west, i & 1 ? west : others[i / 2]};
        vd_dem *dem = NULL;
        assert_ok(vd_geo_load_dem(context, paths, 2, NULL, &dem));
        assert_true(dem->width >= 85 && dem->width <= 103); /* 101 with a degree on each side */
        assert_true(dem->height >= 50 && dem->height <= 53);
        assert_true(i >= 4 || dem->missing == 0);
        assert_true(dem->missing < (uint64_t)dem->width * (uint64_t)dem->height / 4);
        assert_pacific(dem, tolerance[i / 2]);
        vd_dem_destroy(&dem);
    }
    const char *utm_first[] = {others[3], west};
    vd_dem *dem = NULL;
    assert_ok(vd_geo_load_dem(context, utm_first, 2, NULL, &dem));
    assert_true(dem->width >= 98 && dem->width <= 104); /* 198 km */
    assert_true(dem->missing < (uint64_t)dem->width * (uint64_t)dem->height / 4);
    vd_dem_destroy(&dem);

    const char *paths[] = {west, others[0]};
    vd_geo_def def = vd_geo_def_default();
    def.max_side = 60; /* reduced by 101 / 60, not by the globe's width */
    assert_ok(vd_geo_load_dem(context, paths, 2, &def, &dem));
    assert_true(dem->width <= 60 && dem->width >= 55 && dem->missing < 200);
    assert_pacific(dem, 5.0);
    vd_dem_destroy(&dem);
}

static void far_apart(void **state) {
    (void)state;
    make_different();
    const double south[6] = {9.0, 0.001, 0.0, -33.0, 0.0, -0.001};
    vd_dem *dem = load_placed("south.tif", south, "EPSG:4326");
    vd_dem_destroy(&dem);
    const char *pairs[][2] = {{FOLDER "/degrees.tif", FOLDER "/south.tif"},
                              {FOLDER "/utm.tif", FOLDER "/south.tif"},
                              {FOLDER "/south.tif", FOLDER "/utm.tif"}};
    for (int i = 0; i < 3; i++) {
        vd_status status = vd_geo_load_dem(context, pairs[i], 2, NULL, &dem);
        assert_int_equal(status.code, VD_ERROR_LIMIT);
        assert_non_null(strstr(status.message, pairs[i][0]));
        assert_non_null(strstr(status.message, pairs[i][1]));
        assert_non_null(strstr(status.message, "they lie far apart"));
        assert_null(dem);
    }
}

/* Coarse cells beside fine ones: what is coarse already must not be reduced with the rest. */
static void fine_and_coarse(void **state) {
    (void)state;
    const double fine[6] = {500000.0, 1.0, 0.0, 5100000.0, 0.0, -1.0};
    const double coarse[6] = {500000.0, 30.0, 0.0, 5100000.0, 0.0, -30.0};
    raster a = {.width = 100, .height = 100, .transform = fine, .crs = "EPSG:32632"};
    raster b = {.width = 40, .height = 30, .transform = coarse, .crs = "EPSG:32632"};
    b.value = real_plane;
    make_raster("fine.tif", &a);
    make_raster("coarse.tif", &b);
    const char *paths[] = {FOLDER "/fine.tif", FOLDER "/coarse.tif"};
    vd_geo_def def = vd_geo_def_default();
    def.max_side = 60; /* cells of 20 m: 5 for the fine one, all of the coarse one */
    vd_dem *dem = NULL;
    log_text[0] = '\0';
    assert_ok(vd_geo_load_dem(context, paths, 2, &def, &dem));
    assert_logged("fine.tif: read at 5 × 5 of");
    assert_null(strstr(log_text, "coarse.tif: read at"));
    assert_true(dem->width >= 58 && dem->width <= 60);
    vd_dem_destroy(&dem);
}

/* ---- what cannot be read
 * ------------------------------------------------------------------------- */

static double random_value(int band, int column, int row) {
    uint64_t seed = (uint64_t)band * 1000003u + (uint64_t)column * 7919u + (uint64_t)row;
    return test_uniform(&seed) * 1000.0;
}

static void make_bad(void) {
    char path[512];
    write_text("empty.tif", "");
    write_text("words.dat", "these are words and no raster");
    write_text("points.geojson",
               "{\"type\":\"FeatureCollection\",\"features\":[{\"type\":\"Feature\","
               "\"properties\":{},\"geometry\":{\"type\":\"Point\","
               "\"coordinates\":[1,2]}}]}");
    raster whole = {.width = 300, .height = 300, .transform = utm, .value = random_value};
    make_raster("cut.tif", &whole);
    (void)snprintf(path, sizeof path, "%s/cut.tif", FOLDER);
    assert_int_equal(truncate(path, 100000), 0);
    raster complex = {.width = 4, .height = 4, .type = GDT_CFloat32};
    make_raster("complex.tif", &complex);
    const double flat[6] = {1.0, 2.0, 0.0, 3.0, 0.0, 0.0};
    raster line = {
        .width = 4, .height = 4, .transform = flat, .driver = "GTiff", .crs = "EPSG:32632"};
    make_raster("line.tif", &line);
    make_raster("small.tif", &(raster){.width = 4, .height = 4});
    char *options[] = {"SPARSE_OK=TRUE",   "BIGTIFF=YES",      "TILED=YES",
                       "BLOCKXSIZE=16384", "BLOCKYSIZE=16384", NULL};
    (void)snprintf(path, sizeof path, "%s/bomb.tif", FOLDER);
    GDALDatasetH bomb =
        GDALCreate(GDALGetDriverByName("GTiff"), path, 2000000, 2000000, 1, GDT_Byte, options);
    assert_non_null(bomb);
    GDALClose(bomb);
}

static void sentences(void **state) {
    (void)state;
    make_bad();
    const struct {
        const char *name;
        vd_code code;
        const char *words;
    } cases[] = {
        {"missing.tif", VD_ERROR_IO, "missing.tif: there is no such file; check the path"},
        {"", VD_ERROR_IO, "it is a folder"},
        {"empty.tif", VD_ERROR_FORMAT, "it is empty; get the file again"},
        {"words.dat", VD_ERROR_FORMAT, "GDAL does not know its format"},
        {"points.geojson", VD_ERROR_FORMAT, "it is a vector file (GeoJSON), not a raster"},
        {"cut.tif", VD_ERROR_FORMAT, "its samples cannot be read beyond row"},
        {"complex.tif", VD_ERROR_FORMAT, "its samples are of type complex"},
        {"line.tif", VD_ERROR_FORMAT, "has no area"},
        {"bomb.tif", VD_ERROR_LIMIT, "2000000 × 2000000 samples without overviews are too many"},
    };
    /* Nothing may reach stderr. */
    (void)fflush(stderr);
    int kept = dup(STDERR_FILENO);
    assert_non_null(freopen(FOLDER "/stderr.txt", "wb", stderr));
    vd_status statuses[sizeof cases / sizeof cases[0]];
    vd_dem *dem = NULL;
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        statuses[i] = try_load(cases[i].name, NULL, &dem);
    }
    (void)fflush(stderr);
    struct stat info;
    int found = stat(FOLDER "/stderr.txt", &info);
    assert_true(dup2(kept, STDERR_FILENO) >= 0);
    (void)close(kept);
    assert_int_equal(found, 0);
    assert_int_equal(info.st_size, 0);
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        if (statuses[i].code != cases[i].code ||
            strstr(statuses[i].message, cases[i].words) == NULL) {
            fail_msg("%s: %s (%s)", cases[i].name, statuses[i].message,
                     vd_code_name(statuses[i].code));
        }
    }
    assert_null(dem);
}

static void bad_use(void **state) {
    (void)state;
    make_raster("small.tif", &(raster){.width = 4, .height = 4});
    const char *paths[] = {FOLDER "/small.tif"}, *empty[] = {""}, *null[] = {NULL, NULL};
    vd_dem *dem = NULL;
    vd_geo_def defs[5];
    for (int i = 0; i < 5; i++) {
        defs[i] = vd_geo_def_default();
    }
    defs[0].band = 5;
    defs[1].band = -1;
    defs[2].max_side = 70000;
    defs[3].height_scale = NAN;
    defs[4].height_offset_m = INFINITY;
    const char *const words[] = {"band 5 of", "band is -1", "max_side is 70000", "height_scale",
                                 "height_offset_m"};
    for (int i = 0; i < 5; i++) {
        vd_status status = vd_geo_load_dem(context, paths, 1, &defs[i], &dem);
        assert_int_equal(status.code, VD_ERROR_ARGUMENT);
        assert_non_null(strstr(status.message, words[i]));
    }
    assert_int_equal(vd_geo_load_dem(context, paths, 0, NULL, &dem).code, VD_ERROR_ARGUMENT);
    assert_int_equal(vd_geo_load_dem(context, empty, 1, NULL, &dem).code, VD_ERROR_ARGUMENT);
    assert_int_equal(vd_geo_load_dem(context, null, 2, NULL, &dem).code, VD_ERROR_ARGUMENT);
    assert_null(dem);
}

static void subdatasets(void **state) {
    (void)state;
    if (GDALGetDriverByName("netCDF") == NULL) {
        skip();
    }
    raster two = {.driver = "netCDF", .width = 20, .height = 10, .bands = 2};
    make_raster("two.nc", &two);
    vd_dem *dem = NULL;
    vd_status status = try_load("two.nc", NULL, &dem);
    assert_int_equal(status.code, VD_ERROR_FORMAT);
    assert_non_null(strstr(status.message, "it holds 2 rasters; name one of them: NETCDF:"));
    const char *paths[] = {"NETCDF:" FOLDER "/two.nc:Band2"};
    assert_ok(vd_geo_load_dem(context, paths, 1, NULL, &dem));
    assert_true(dem->width == 20 && dem->height == 10);
    vd_dem_destroy(&dem);
}

static void ascii_with_prj(void **state) {
    (void)state;
    write_text("grid.asc", "ncols 3\nnrows 2\nxllcorner 500000\nyllcorner 5100000\ncellsize 10\n"
                           "NODATA_value -1\n1 2 3\n4 -1 6\n");
    write_text("grid.prj",
               "PROJCS[\"WGS_1984_UTM_Zone_32N\",GEOGCS[\"GCS_WGS_1984\","
               "DATUM[\"D_WGS_1984\",SPHEROID[\"WGS_1984\",6378137,298.257223563]],"
               "PRIMEM[\"Greenwich\",0],UNIT[\"Degree\",0.017453292519943295]],"
               "PROJECTION[\"Transverse_Mercator\"],PARAMETER[\"latitude_of_origin\",0],"
               "PARAMETER[\"central_meridian\",9],PARAMETER[\"scale_factor\",0.9996],"
               "PARAMETER[\"false_easting\",500000],PARAMETER[\"false_northing\",0],"
               "UNIT[\"Meter\",1]]");
    vd_dem *dem = load("grid.asc");
    assert_int_equal(dem->kind, VD_CRS_PROJECTED);
    assert_transform(dem, 500005.0, 10.0, 0.0, 5100015.0, 0.0, -10.0);
    assert_true(dem->missing == 1 && at(dem, 2, 1) == 6.0f && dem->crs != NULL);
    vd_dem_destroy(&dem);
}

/* ---- memory
 * -------------------------------------------------------------------------------------- */

static void every_allocation_fails(void **state) {
    (void)state;
    make_different();
    const char *paths[] = {FOLDER "/degrees.tif", FOLDER "/utm.tif"};
    vd_geo_def def = vd_geo_def_default();
    def.max_side = 50;
    bool succeeded = false;
    for (int n = 1; n < 100 && !succeeded; n++) {
        test_allocator allocator = {.fail_at = 0};
        vd_context *failing = test_failing_context(&allocator);
        const int before = allocator.live;
        allocator.fail_at = allocator.calls + n;
        vd_dem *dem = NULL;
        vd_status status = vd_geo_load_dem(failing, paths, 2, &def, &dem);
        succeeded = status.code == VD_OK;
        if (!succeeded) {
            assert_int_equal(status.code, VD_ERROR_MEMORY);
            assert_null(dem);
            assert_int_equal(allocator.live, before);
        }
        vd_dem_destroy(&dem);
        vd_context_destroy(&failing);
        assert_int_equal(allocator.live, 0);
    }
    assert_true(succeeded);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(tiles_without_seam),
        cmocka_unit_test(different_crs),
        cmocka_unit_test(rotated_first),
        cmocka_unit_test(across_the_date_line),
        cmocka_unit_test(far_apart),
        cmocka_unit_test(fine_and_coarse),
        cmocka_unit_test(sentences),
        cmocka_unit_test(bad_use),
        cmocka_unit_test(subdatasets),
        cmocka_unit_test(ascii_with_prj),
        cmocka_unit_test(every_allocation_fails),
    };
    return cmocka_run_group_tests(tests, setup, teardown);
}

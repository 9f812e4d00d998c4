/* test_geo.c: one raster at a time, made by GDAL itself, read back through geo.h. */
#define GEO_FOLDER "test-geo"
#include "geo_support.h"

/* ---- what is stored
 * ------------------------------------------------------------------------------ */

static void every_numeric_type(void **state) {
    (void)state;
    const struct {
        GDALDataType type;
        const char *name;
    } types[] = {{GDT_Byte, "uint8"},    {GDT_UInt16, "uint16"},   {GDT_Int16, "int16"},
                 {GDT_UInt32, "uint32"}, {GDT_Int32, "int32"},     {GDT_UInt64, "uint64"},
                 {GDT_Int64, "int64"},   {GDT_Float32, "float32"}, {GDT_Float64, "float64"}};
    for (size_t i = 0; i < sizeof types / sizeof types[0]; i++) {
        raster r = {.width = 30,
                    .height = 20,
                    .type = types[i].type,
                    .transform = utm,
                    .crs = "EPSG:32632"};
        make_raster("type.tif", &r);
        vd_dem *dem = load("type.tif");
        assert_string_equal(dem->height_type, types[i].name);
        assert_plane(dem, 0.0);
        assert_int_equal(dem->missing, 0);
        assert_true(dem->min == 20.0f && dem->max == 20.0f + 58.0f + 57.0f);
        vd_dem_destroy(&dem);
    }
}

static double signed_values(int band, int column, int row) {
    (void)band;
    double v = column - 15 + row;
    return v < 0.0 ? v + 256.0 : v; /* as GDAL before 3.7 wants int8 */
}

static void signed_bytes(void **state) {
    (void)state;
#if GDAL_VERSION_NUM < 3070000
    char *options[] = {"PIXELTYPE=SIGNEDBYTE", NULL};
    raster r = {
        .width = 30, .height = 20, .type = GDT_Byte, .options = options, .value = signed_values};
    make_raster("int8.tif", &r);
    vd_dem *dem = load("int8.tif");
    assert_string_equal(dem->height_type, "int8");
    assert_true(at(dem, 0, 0) == -15.0f && at(dem, 29, 0) == 14.0f);
    vd_dem_destroy(&dem);
#else
    (void)signed_values;
#endif
}

static void height_units(void **state) {
    (void)state;
    const struct {
        const char *unit, *crs, *name;
        double metres;
    } units[] = {{"m", "EPSG:32632", "m", 1.0},
                 {"ft", "EPSG:32632", "ft", 0.3048},
                 {"US survey foot", "EPSG:32632", "us-ft", 1200.0 / 3937.0},
                 {"cm", "EPSG:32632", "cm", 0.01},
                 {"parsec", "EPSG:32632", "parsec", 1.0},
                 {NULL, "EPSG:32632", "", 1.0},
                 {NULL, "EPSG:26911+6360", "us-ft", 1200.0 / 3937.0}}; /* NAVD88 height (ftUS) */
    for (size_t i = 0; i < sizeof units / sizeof units[0]; i++) {
        raster r = {
            .width = 8, .height = 6, .transform = utm, .crs = units[i].crs, .unit = units[i].unit};
        make_raster("unit.tif", &r);
        vd_dem *dem = load("unit.tif");
        assert_string_equal(dem->height_unit, units[i].name);
        assert_true(fabs((double)at(dem, 7, 5) - plane(1, 7, 5) * units[i].metres) < 1e-5);
        assert_int_equal(strcmp(units[i].name, "ft") == 0, strstr(log_text, "are in ft") != NULL);
        assert_int_equal(strcmp(units[i].name, "parsec") == 0,
                         strstr(log_text, "unknown and taken as metres") != NULL);
        vd_dem_destroy(&dem);
    }
}

static void scale_offset_and_wishes(void **state) {
    (void)state;
    raster r = {.width = 8,
                .height = 6,
                .type = GDT_Int16,
                .transform = utm,
                .crs = "EPSG:32632",
                .unit = "ft",
                .scale = 0.5,
                .offset = 100.0};
    make_raster("scaled.tif", &r);
    vd_dem *dem = load("scaled.tif");
    assert_true(fabs((double)at(dem, 3, 2) - (plane(1, 3, 2) * 0.5 + 100.0) * 0.3048) < 1e-5);
    vd_dem_destroy(&dem);

    vd_geo_def def = vd_geo_def_default();
    def.height_scale = 2.0; /* in place of feet, after the file's own scale */
    def.height_offset_m = -7.0;
    dem = load_with("scaled.tif", &def);
    assert_true(fabs((double)at(dem, 3, 2) - ((plane(1, 3, 2) * 0.5 + 100.0) * 2.0 - 7.0)) < 1e-5);
    vd_dem_destroy(&dem);

    raster two = {.width = 8, .height = 6, .bands = 2};
    make_raster("two.tif", &two);
    def = vd_geo_def_default();
    def.band = 2;
    dem = load_with("two.tif", &def);
    assert_true(at(dem, 3, 2) == (float)plane(2, 3, 2));
    vd_dem_destroy(&dem);
}

/* ---- missing samples
 * ----------------------------------------------------------------------------- */

static double hole_value;

static double with_holes(int band, int column, int row) {
    return (column + row) % 6 == 0 ? plane(band, column, row) : hole_value; /* 83 % missing */
}

static uint64_t missing_of(const char *name, const raster *like, double hole, const double *nodata,
                           const vd_geo_def *def) {
    raster r = *like;
    hole_value = hole;
    r.value = with_holes;
    r.nodata = nodata;
    make_raster(name, &r);
    vd_dem *dem = load_with(name, def);
    uint64_t missing = dem->missing;
    if (missing > 0) {
        assert_true(dem->min == 20.0f); /* nothing of the holes is left */
    }
    vd_dem_destroy(&dem);
    return missing;
}

static void missing_samples(void **state) {
    (void)state;
    const raster f32 = {.width = 30, .height = 30, .transform = utm, .crs = "EPSG:32632"};
    raster f64 = f32, i16 = f32;
    f64.type = GDT_Float64;
    i16.type = GDT_Int16;
    const uint64_t holes = 750;
    const double minus = -9999.0, nan_value = NAN, lowest = -3.4028234663852886e38,
                 written = -3.40282306074e38, zero = 0.0;
    assert_int_equal(missing_of("n1.tif", &f32, minus, &minus, NULL), holes);
    assert_int_equal(missing_of("n2.tif", &f32, NAN, &nan_value, NULL), holes);
    assert_int_equal(missing_of("n3.tif", &f32, NAN, NULL, NULL), holes);
    assert_int_equal(missing_of("n4.tif", &f32, lowest, &written, NULL), holes);
    assert_int_equal(missing_of("n5.tif", &f64, -1e300, NULL, NULL), holes);
    assert_logged("no place on Earth has");
    assert_int_equal(missing_of("n6.tif", &i16, -32768.0, NULL, NULL), holes);
    assert_logged("750 samples");
    assert_int_equal(missing_of("n7.tif", &i16, minus, NULL, NULL), holes);
    /* 1/10 is no float: the file's double and the stored float must still meet. */
    const double tenth = 0.1;
    assert_int_equal(missing_of("n8.tif", &f32, 0.1, &tenth, NULL), holes);

    /* Where the file names its own value, -9999 is a height like others. */
    raster deep = i16;
    hole_value = minus;
    deep.value = with_holes;
    deep.nodata = &zero;
    make_raster("deep.tif", &deep);
    vd_dem *dem = load("deep.tif");
    assert_true(dem->missing == 0 && dem->min == -9999.0f);
    vd_dem_destroy(&dem);

    vd_geo_def def = vd_geo_def_default();
    def.has_nodata = true;
    def.nodata = 7.0;
    assert_int_equal(missing_of("n9.tif", &i16, 7.0, &zero, &def), holes);
}

static void masks(void **state) {
    (void)state;
    raster r = {.width = 16, .height = 8, .type = GDT_Int16, .transform = utm, .crs = "EPSG:32632"};
    GDALDatasetH dataset = create_raster("masked.tif", &r);
    assert_int_equal(GDALCreateDatasetMaskBand(dataset, GMF_PER_DATASET), CE_None);
    uint8_t mask[8][16];
    memset(mask, 255, sizeof mask);
    mask[3][5] = 0;
    GDALRasterBandH band = GDALGetMaskBand(GDALGetRasterBand(dataset, 1));
    assert_int_equal(GDALRasterIO(band, GF_Write, 0, 0, 16, 8, mask, 16, 8, GDT_Byte, 0, 0),
                     CE_None);
    GDALClose(dataset);
    vd_dem *dem = load("masked.tif");
    assert_int_equal(dem->missing, 1);
    assert_true(isnan(at(dem, 5, 3)) && at(dem, 6, 3) == (float)plane(1, 6, 3));
    vd_dem_destroy(&dem);

    char *options[] = {"ALPHA=YES", NULL};
    raster alpha = {.width = 16, .height = 8, .bands = 2, .type = GDT_Byte, .options = options};
    dataset = create_raster("alpha.tif", &alpha);
    band = GDALGetRasterBand(dataset, 2);
    assert_int_equal(GDALRasterIO(band, GF_Write, 0, 0, 16, 8, mask, 16, 8, GDT_Byte, 0, 0),
                     CE_None);
    GDALClose(dataset);
    dem = load("alpha.tif");
    assert_true(dem->missing == 1 && isnan(at(dem, 5, 3)));
    vd_dem_destroy(&dem);
}

/* ---- where it lies
 * ------------------------------------------------------------------------------- */

static void orientation(void **state) {
    (void)state;
    vd_dem *dem = load_placed("north.tif", utm, "EPSG:32632");
    assert_int_equal(dem->kind, VD_CRS_PROJECTED);
    assert_string_equal(dem->crs, "EPSG:32632");
    assert_true(dem->crs_unit_m == 1.0);
    assert_transform(dem, 500015.0, 30.0, 0.0, 5099985.0, 0.0, -30.0);
    assert_plane(dem, 0.0);
    vd_dem_destroy(&dem);

    const double south_up[6] = {500000.0, 30.0, 0.0, 5100000.0, 0.0, 30.0};
    dem = load_placed("south.tif", south_up, "EPSG:32632");
    assert_transform(dem, 500015.0, 30.0, 0.0, 5100585.0, 0.0, -30.0);
    assert_true(at(dem, 0, 19) == (float)plane(1, 0, 0));
    vd_dem_destroy(&dem);

    const double swapped[6] = {500000.0, -30.0, 0.0, 5100000.0, 0.0, 30.0};
    dem = load_placed("swapped.tif", swapped, "EPSG:32632");
    assert_transform(dem, 500015.0 - 1200.0, 30.0, 0.0, 5100585.0, 0.0, -30.0);
    assert_true(at(dem, 39, 19) == (float)plane(1, 0, 0));
    vd_dem_destroy(&dem);

    const double rotated[6] = {500000.0, 24.0, 18.0, 5100000.0, 18.0, -24.0};
    dem = load_placed("rotated.tif", rotated, "EPSG:32632");
    assert_transform(dem, 500021.0, 24.0, 18.0, 5099997.0, 18.0, -24.0);
    assert_plane(dem, 0.0);
    vd_dem_destroy(&dem);

    const double mirrored[6] = {500000.0, 24.0, -18.0, 5100000.0, 18.0, 24.0};
    dem = load_placed("mirrored.tif", mirrored, "EPSG:32632");
    assert_transform(dem, 500003.0 - 18.0 * 19.0, 24.0, 18.0, 5100021.0 + 24.0 * 19.0, 18.0, -24.0);
    assert_true(at(dem, 7, 19) == (float)plane(1, 7, 0));
    vd_dem_destroy(&dem);

    raster point = {.width = 4, .height = 4, .transform = utm, .crs = "EPSG:32632"};
    GDALDatasetH dataset = create_raster("point.tif", &point);
    (void)GDALSetMetadataItem(dataset, "AREA_OR_POINT", "Point", NULL);
    GDALClose(dataset);
    dem = load("point.tif");
    assert_transform(dem, 500015.0, 30.0, 0.0, 5099985.0, 0.0, -30.0);
    vd_dem_destroy(&dem);
}

static void kinds_and_units(void **state) {
    (void)state;
    const double degrees[6] = {6.5, 0.001, 0.0, 46.0, 0.0, -0.001};
    vd_dem *dem = load_placed("deg.tif", degrees, "EPSG:4326");
    assert_int_equal(dem->kind, VD_CRS_GEOGRAPHIC);
    assert_string_equal(dem->crs, "EPSG:4326");
    assert_transform(dem, 6.5005, 0.001, 0.0, 45.9995, 0.0, -0.001);
    vd_dem_destroy(&dem);

    dem = load_placed("deg-unsaid.tif", degrees, NULL);
    assert_int_equal(dem->kind, VD_CRS_GEOGRAPHIC);
    assert_logged("look like degrees");
    vd_dem_destroy(&dem);

    dem = load_placed("metres-unsaid.tif", utm, NULL);
    assert_int_equal(dem->kind, VD_CRS_PROJECTED);
    assert_null(dem->crs);
    assert_true(dem->crs_unit_m == 1.0);
    assert_logged("taken as metres");
    vd_dem_destroy(&dem);

    dem = load_placed("none.tif", NULL, NULL);
    assert_int_equal(dem->kind, VD_CRS_NONE);
    assert_transform(dem, 0.0, 1.0, 0.0, 0.0, 0.0, -1.0);
    assert_string_equal(log_text, "");
    vd_dem_destroy(&dem);

    const double site[6] = {10.0, 2.0, 0.0, 20.0, 0.0, -2.0};
    dem = load_placed("site.tif", site, "LOCAL_CS[\"site\",UNIT[\"foot\",0.3048]]");
    assert_int_equal(dem->kind, VD_CRS_NONE);
    assert_transform(dem, 11.0 * 0.3048, 2.0 * 0.3048, 0.0, 19.0 * 0.3048, 0.0, -2.0 * 0.3048);
    vd_dem_destroy(&dem);

    const double feet[6] = {6000000.0, 100.0, 0.0, 2000000.0, 0.0, -100.0};
    dem = load_placed("feet.tif", feet, "EPSG:2227"); /* California zone 3, US survey feet */
    assert_true(fabs(dem->crs_unit_m - 1200.0 / 3937.0) < 1e-12);
    vd_dem_destroy(&dem);

    const double grads[6] = {5.0, 0.01, 0.0, 50.0, 0.0, -0.01};
    dem = load_placed("grads.tif", grads, "EPSG:4807"); /* NTF (Paris), grads */
    assert_int_equal(dem->kind, VD_CRS_GEOGRAPHIC);
    assert_transform(dem, 5.005 * 0.9, 0.009, 0.0, 49.995 * 0.9, 0.0, -0.009);
    double lon = 0.0, lat = 0.0;
    assert_ok(vd_geo_to_lonlat(context, dem->crs, 4.5, 45.0, &lon, &lat));
    assert_true(fabs(lon - 6.837229) < 0.01 && fabs(lat - 45.0) < 0.01); /* Paris is at 2.337° */
    vd_dem_destroy(&dem);

    /* Web Mercator at 46° north stretches by 1/cos 46° = 1.44. */
    const double mercator[6] = {760000.0, 100.0, 0.0, 5781000.0, 0.0, -100.0};
    dem = load_placed("mercator.tif", mercator, "EPSG:3857");
    assert_true(fabs(dem->crs_unit_m - 0.6951) < 0.002);
    assert_logged("not true to scale");
    vd_dem_destroy(&dem);
}

static void longitudes(void **state) {
    (void)state;
    const double part[6] = {350.0, 0.1, 0.0, 10.0, 0.0, -0.1};
    vd_dem *dem = load_placed("lon360.tif", part, "EPSG:4326");
    assert_transform(dem, -9.95, 0.1, 0.0, 9.95, 0.0, -0.1);
    assert_plane(dem, 0.0);
    vd_dem_destroy(&dem);

    const double globe[6] = {-4.5, 9.0, 0.0, 90.0, 0.0, -9.0}; /* centres 0, 9 … 351 */
    dem = load_placed("globe.tif", globe, "EPSG:4326");
    assert_transform(dem, -171.0, 9.0, 0.0, 85.5, 0.0, -9.0);
    for (int column = 0; column < 40; column++) {
        assert_true(at(dem, column, 4) == (float)plane(1, (column + 21) % 40, 4));
    }
    assert_logged("date line");
    vd_dem_destroy(&dem);

    const double usual[6] = {-180.0, 9.0, 0.0, 90.0, 0.0, -9.0};
    dem = load_placed("usual.tif", usual, "EPSG:4326");
    assert_transform(dem, -175.5, 9.0, 0.0, 85.5, 0.0, -9.0);
    assert_plane(dem, 0.0);
    vd_dem_destroy(&dem);
}

static void control_points(void **state) {
    (void)state;
    for (int bent = 0; bent < 2; bent++) {
        raster r = {.width = 40, .height = 20};
        GDALDatasetH dataset = create_raster("gcp.tif", &r);
        GDAL_GCP points[5];
        GDALInitGCPs(5, points);
        const double at_pixel[5][2] = {{0, 0}, {40, 0}, {40, 20}, {0, 20}, {20, 10}};
        for (int i = 0; i < 5; i++) {
            points[i].dfGCPPixel = at_pixel[i][0];
            points[i].dfGCPLine = at_pixel[i][1];
            points[i].dfGCPX = 500000.0 + 30.0 * at_pixel[i][0];
            points[i].dfGCPY = 5100000.0 - 30.0 * at_pixel[i][1] + (bent && i == 4 ? 60.0 : 0.0);
        }
        OGRSpatialReferenceH crs = OSRNewSpatialReference(NULL);
        assert_int_equal(OSRImportFromEPSG(crs, 32632), OGRERR_NONE);
        assert_int_equal(GDALSetGCPs2(dataset, 5, points, crs), CE_None);
        OSRDestroySpatialReference(crs);
        GDALDeinitGCPs(5, points);
        GDALClose(dataset);
        vd_dem *dem = load("gcp.tif");
        assert_int_equal(dem->kind, VD_CRS_PROJECTED);
        assert_string_equal(dem->crs, "EPSG:32632");
        if (bent == 0) {
            assert_transform(dem, 500015.0, 30.0, 0.0, 5099985.0, 0.0, -30.0);
            assert_plane(dem, 0.0);
        } else {
            assert_logged("control points");
            const double *t = dem->transform;
            int column = (int)((500600.0 - t[0]) / t[1] + 0.5),
                row = (int)((5099700.0 - t[3]) / t[5] + 0.5);
            assert_true(fabs((double)at(dem, column, row) - plane(1, 20, 10)) < 7.0);
        }
        vd_dem_destroy(&dem);
    }
}

/* ---- size
 * ---------------------------------------------------------------------------------------- */

static void decimated(void **state) {
    (void)state;
    raster r = {
        .width = 301, .height = 203, .transform = utm, .crs = "EPSG:32632", .value = real_plane};
    make_raster("large.tif", &r);
    const int sides[] = {300, 257, 100, 43, 17};
    for (size_t i = 0; i < sizeof sides / sizeof sides[0]; i++) {
        vd_geo_def def = vd_geo_def_default();
        def.max_side = sides[i];
        vd_dem *dem = load_with("large.tif", &def);
        assert_int_equal(dem->width, sides[i]);
        assert_int_equal(dem->height, (int)(203.0 * sides[i] / 301.0 + 0.5));
        assert_real_plane(dem, 30.0, sides[i] == 43 ? 1e-3 : 0.19); /* 301 = 7 · 43 */
        assert_logged("of its 301 × 203 samples");
        vd_dem_destroy(&dem);
    }
    /* With overviews. */
    GDALDatasetH dataset = GDALOpen(FOLDER "/large.tif", GA_Update);
    int levels[] = {2, 4};
    assert_int_equal(GDALBuildOverviews(dataset, "AVERAGE", 2, levels, 0, NULL, NULL, NULL),
                     CE_None);
    /* Spoil the full resolution: who reads it instead of the overview is found out. */
    assert_int_equal(GDALFillRaster(GDALGetRasterBand(dataset, 1), 0.0, 0.0), CE_None);
    GDALClose(dataset);
    vd_geo_def def = vd_geo_def_default();
    def.max_side = 100;
    vd_dem *dem = load_with("large.tif", &def);
    assert_true(fabs((double)at(dem, 50, 30) - 100.0 - 0.25 * 151.5 - 0.5 * 91.5) < 1.0);
    vd_dem_destroy(&dem);

    /* Undeclared sentinels are not averaged in. */
    raster holes = {.width = 120, .height = 120, .transform = utm, .crs = "EPSG:32632"};
    hole_value = -9999.0;
    holes.value = with_holes;
    make_raster("holes.tif", &holes);
    def.max_side = 119;
    dem = load_with("holes.tif", &def);
    assert_true(dem->min >= 20.0f && dem->missing > 0);
    vd_dem_destroy(&dem);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_numeric_type), cmocka_unit_test(signed_bytes),
        cmocka_unit_test(height_units),       cmocka_unit_test(scale_offset_and_wishes),
        cmocka_unit_test(missing_samples),    cmocka_unit_test(masks),
        cmocka_unit_test(orientation),        cmocka_unit_test(kinds_and_units),
        cmocka_unit_test(longitudes),         cmocka_unit_test(control_points),
        cmocka_unit_test(decimated),
    };
    return cmocka_run_group_tests(tests, setup, teardown);
}

/* Elevation files: every reader of the core, placement in the world, mosaics, filling. */
#include <math.h>
#include <stdio.h>
#include "support.h"
#include "terrain/dem_internal.h"
#include <veduta/dem.h>

static vd_context *context;
static size_t bytes_at_first;

static int set_up(void **state) {
    (void)state;
    context = test_context(1, VD_ISA_AUTO);
    bytes_at_first = vd_context_memory(context).bytes_now;
    return 0;
}

static int tear_down(void **state) {
    (void)state;
    assert_int_equal(vd_context_memory(context).bytes_now, bytes_at_first);
    vd_context_destroy(&context);
    return 0;
}

static vd_dem *decode_text(const char *text, const char *name, const vd_dem_def *def) {
    vd_dem *dem = NULL;
    assert_ok(vd_dem_decode(context, text, strlen(text), name, def, &dem));
    return dem;
}

/* Expects a failure whose sentence names the file and holds `part`. */
static void refuse(const void *data, size_t size, const char *name, const vd_dem_def *def,
                   vd_code code, const char *part) {
    vd_dem *dem = NULL;
    vd_status status = vd_dem_decode(context, data, size, name, def, &dem);
    if (status.code != code || !strstr(status.message, part) || !strstr(status.message, name)) {
        fail_msg("expected %s with \"%s\", got %s: %s", vd_code_name(code), part,
                 vd_code_name(status.code), status.message);
    }
    assert_null(dem);
}

static void refuse_text(const char *text, vd_code code, const char *part) {
    refuse(text, strlen(text), "grid.asc", NULL, code, part);
}

static float at(const vd_dem *dem, int column, int row) {
    return dem->heights[(size_t)row * dem->stride + (size_t)column];
}

static bool close_to(double a, double b, double tolerance) {
    return fabs(a - b) <= tolerance;
}

/* ---- placement ------------------------------------------------------------------------------- */

static void degrees_become_metres(void **state) {
    (void)state;
    /* Lengths of a degree on WGS 84 (NGA, "Length of a degree of latitude and longitude"). */
    static const double known[][3] = {{0, 111319.491, 110574.276},
                                      {45, 78846.806, 111131.745},
                                      {60, 55800.000, 111412.240},
                                      {-45, 78846.806, 111131.745}};
    for (size_t i = 0; i < 4; i++) {
        vd_dem *dem = NULL;
        assert_ok(vd_dem_create(context, 3, 3, &dem));
        dem->kind = VD_CRS_GEOGRAPHIC;
        const double t[6] = {10.0, 0.5, 0.0, known[i][0] + 0.5, 0.0, -0.5};
        memcpy(dem->transform, t, sizeof t);
        vd_placement p = vd_dem_placement(dem);
        assert_true(close_to(p.origin_x, 10.5, 1e-12) && close_to(p.origin_y, known[i][0], 1e-12));
        assert_true(close_to(p.scale_x, known[i][1], 1.0));
        assert_true(close_to(p.scale_y, known[i][2], 1.0));
        double w[6];
        vd_dem_world_from_sample(dem, w);
        assert_true(close_to(w[0] + w[1], 0.0, 1e-9) && close_to(w[3] + w[5], 0.0, 1e-9));
        assert_true(w[1] > 0.0 && w[5] < 0.0 && w[2] == 0.0 && w[4] == 0.0);
        vd_dem_destroy(&dem);
        assert_null(dem);
    }
}

static void projected_units_are_scaled(void **state) {
    (void)state;
    vd_dem *dem = NULL;
    assert_ok(vd_dem_create(context, 2, 2, &dem));
    assert_int_equal(dem->missing, 4);
    double w[6];
    vd_dem_world_from_sample(dem, w);
    const double plain[6] = {0, 1, 0, 0, 0, -1};
    assert_memory_equal(w, plain, sizeof w);
    dem->kind = VD_CRS_PROJECTED;
    dem->crs_unit_m = 0.3048;
    const double t[6] = {1000.0, 10.0, 1.0, 2000.0, 2.0, -10.0};
    memcpy(dem->transform, t, sizeof t);
    vd_dem_world_from_sample(dem, w);
    for (int i = 0; i < 6; i++) {
        assert_true(close_to(w[i], t[i] * 0.3048, 1e-9));
    }
    vd_dem_destroy(&dem);
}

static void create_checks_its_size(void **state) {
    (void)state;
    vd_dem *dem = NULL;
    assert_int_equal(vd_dem_create(context, 0, 5, &dem).code, VD_ERROR_ARGUMENT);
    assert_int_equal(vd_dem_create(context, 5, -1, &dem).code, VD_ERROR_ARGUMENT);
    assert_int_equal(vd_dem_create(context, 65536, 1, &dem).code, VD_ERROR_LIMIT);
    assert_int_equal(vd_dem_create(context, 65535, 65535, &dem).code, VD_ERROR_LIMIT);
    assert_int_equal(vd_dem_create(context, INT32_MAX, INT32_MAX, &dem).code, VD_ERROR_LIMIT);
    assert_null(dem);
}

/* ---- SRTM tiles ------------------------------------------------------------------------------ */

static uint8_t *make_tile(int width, int height, size_t *size) {
    *size = (size_t)width * (size_t)height * 2;
    uint8_t *tile = malloc(*size);
    assert_non_null(tile);
    for (int row = 0; row < height; row++) {
        for (int column = 0; column < width; column++) {
            uint16_t h = (uint16_t)(int16_t)(column - 2 * row);
            size_t i = 2 * ((size_t)row * (size_t)width + (size_t)column);
            tile[i] = (uint8_t)(h >> 8);
            tile[i + 1] = (uint8_t)h;
        }
    }
    tile[2 * 7] = 0x80; /* column 7 of row 0 is a void */
    tile[2 * 7 + 1] = 0;
    return tile;
}

static void hgt_takes_its_place_from_the_name(void **state) {
    (void)state;
    static const struct {
        const char *name;
        double west, north;
    } names[] = {{"N45E006.hgt", 6, 46},
                 {"dir.hgt/s23w043.HGT", -43, -22},
                 {"/tiles/N00E000.SRTMGL3.hgt", 0, 1},
                 {"N01W180/my-N89w001.hgt", -1, 90}};
    size_t size;
    uint8_t *tile = make_tile(1201, 1201, &size);
    for (size_t i = 0; i < 4; i++) {
        vd_dem *dem = NULL;
        assert_ok(vd_dem_decode(context, tile, size, names[i].name, NULL, &dem));
        assert_int_equal(dem->width, 1201);
        assert_int_equal(dem->kind, VD_CRS_GEOGRAPHIC);
        const double *t = dem->transform;
        assert_true(t[0] == names[i].west && t[3] == names[i].north);
        assert_true(close_to(t[0] + 1200 * t[1], names[i].west + 1.0, 1e-12));
        assert_true(close_to(t[3] + 1200 * t[5], names[i].north - 1.0, 1e-12));
        assert_true(isnan(at(dem, 7, 0)));
        assert_int_equal(dem->missing, 1);
        assert_true(at(dem, 0, 0) == 0.0f && at(dem, 8, 0) == 8.0f && at(dem, 5, 10) == -15.0f);
        assert_true(dem->max == 1200.0f && dem->min == -2400.0f);
        assert_string_equal(dem->height_type, "int16");
        assert_string_equal(dem->crs, "EPSG:4326");
        vd_dem_destroy(&dem);
    }
    refuse(tile, size, "alps.hgt", NULL, VD_ERROR_FORMAT, "south-west corner");
    refuse(tile, size, "N95E006.hgt", NULL, VD_ERROR_FORMAT, "south-west corner");
    refuse(tile, size, "N45E200.hgt", NULL, VD_ERROR_FORMAT, "south-west corner");
    refuse(tile, size, "N45E0061.hgt", NULL, VD_ERROR_FORMAT, "south-west corner");
    refuse(tile, size - 2, "N45E006.hgt", NULL, VD_ERROR_FORMAT, "2884800 bytes");
    refuse(tile, 3, "N45E006.hgt", NULL, VD_ERROR_FORMAT, "3 bytes");
    free(tile);
}

static void hgt_may_be_narrower_in_the_north(void **state) {
    (void)state;
    size_t size;
    uint8_t *tile = make_tile(1801, 3601, &size);
    vd_dem *dem = NULL;
    assert_ok(vd_dem_decode(context, tile, size, "N61E010.hgt", NULL, &dem));
    assert_true(dem->width == 1801 && dem->height == 3601);
    assert_true(close_to(dem->transform[1], 1.0 / 1800, 1e-15));
    assert_true(close_to(dem->transform[5], -1.0 / 3600, 1e-15));
    assert_true(at(dem, 1800, 3600) == 1800.0f - 7200.0f);
    vd_dem_destroy(&dem);
    free(tile);
}

/* ---- ESRI ASCII ------------------------------------------------------------------------------ */

static void ascii_places_corners_and_centres(void **state) {
    (void)state;
    vd_dem *dem = decode_text("ncols 3\nnrows 2\nxllcorner 1000\nyllcorner 2000\ncellsize 10\n"
                              "NODATA_value -1\n1 2 3\n4 -1 6.5\n",
                              "grid.asc", NULL);
    const double corner[6] = {1005, 10, 0, 2015, 0, -10};
    assert_memory_equal(dem->transform, corner, sizeof corner);
    assert_int_equal(dem->kind, VD_CRS_PROJECTED);
    assert_true(at(dem, 0, 0) == 1.0f && at(dem, 2, 1) == 6.5f && isnan(at(dem, 1, 1)));
    assert_true(dem->min == 1.0f && dem->max == 6.5f && dem->missing == 1);
    vd_dem_destroy(&dem);
    /* Any order and case, values broken over lines, other line ends, no line end at all. */
    dem = decode_text("  NODATA_VALUE nan\r\nDY 4\r\nYLLCENTER 20\r\nXllCenter 10\r\nNROWS 2\r\n"
                      "NCOLS 3\r\ndx 2\r\n1\r\n2 3 4\r\n\r\nnan -1e2",
                      "a/grid", NULL);
    const double centre[6] = {10, 2, 0, 24, 0, -4};
    assert_memory_equal(dem->transform, centre, sizeof centre);
    assert_true(at(dem, 0, 1) == 4.0f && isnan(at(dem, 1, 1)) && at(dem, 2, 1) == -100.0f);
    vd_dem_destroy(&dem);
    /* The format's own nodata value when none is named; the caller's beside it; units. */
    vd_dem_def def = vd_dem_def_default();
    def.has_nodata = true;
    def.nodata = 7.0;
    def.height_scale = 0.5;
    def.height_offset_m = 100.0;
    dem = decode_text("ncols 4\nnrows 1\nxllcorner 900\nyllcorner 0\ncellsize 1\n-9999 7 8 -0",
                      "grid.asc", &def);
    assert_true(isnan(at(dem, 0, 0)) && isnan(at(dem, 1, 0)));
    assert_true(at(dem, 2, 0) == 104.0f && at(dem, 3, 0) == 100.0f);
    vd_dem_destroy(&dem);
}

static void keep_warning(void *user, vd_log_level level, const char *sentence) {
    if (level == VD_LOG_WARNING) {
        snprintf(user, 200, "%s", sentence);
    }
}

static void ascii_recognizes_degrees_and_says_so(void **state) {
    (void)state;
    char warning[200] = "";
    vd_context_def def = vd_context_def_default();
    def.threads = 1;
    def.log = keep_warning;
    def.log_user = warning;
    vd_context *logged = NULL;
    assert_ok(vd_context_create(&def, &logged));
    const char *text = "ncols 2\nnrows 2\nxllcorner 6.5\nyllcorner 45.5\ncellsize 0.01\n1 2 3 4";
    vd_dem *dem = NULL;
    assert_ok(vd_dem_decode(logged, text, strlen(text), "grid.asc", NULL, &dem));
    assert_int_equal(dem->kind, VD_CRS_GEOGRAPHIC);
    assert_string_equal(dem->crs, "EPSG:4326");
    assert_non_null(strstr(warning, "grid.asc"));
    assert_non_null(strstr(warning, "degrees"));
    vd_dem_destroy(&dem);
    vd_context_destroy(&logged);
}

static void ascii_says_what_is_wrong(void **state) {
    (void)state;
#define HEAD "ncols 3\nnrows 2\nxllcorner 1000\nyllcorner 0\ncellsize 10\n"
    refuse_text(HEAD "1 2 3\n4 5\n", VD_ERROR_FORMAT, "row 2 of 2 after 2 of 3");
    refuse_text(HEAD "1\n", VD_ERROR_FORMAT, "row 1 of 2 after 1 of 3");
    refuse_text(HEAD "1 2 3\n4 5 6 7\n", VD_ERROR_FORMAT, "goes on");
    refuse_text(HEAD "1 2 3\n4 x 6\n", VD_ERROR_FORMAT, "row 2, column 2");
    refuse_text(HEAD "1,5 2 3\n4 5 6\n", VD_ERROR_FORMAT, "decimal comma");
    refuse_text("ncols 3\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 0,5\n1 2 3 4 5 6",
                VD_ERROR_FORMAT, "line 5");
    refuse_text("ncols 3\nxllcorner 0\nyllcorner 0\ncellsize 1\n1 2 3", VD_ERROR_FORMAT, "nrows");
    refuse_text("ncols 3\nnrows 1\nyllcorner 0\ncellsize 1\n1 2 3", VD_ERROR_FORMAT, "xllcorner");
    refuse_text("ncols 3\nnrows 1\nxllcorner 0\nyllcorner 0\n1 2 3", VD_ERROR_FORMAT, "cellsize");
    refuse_text("ncols 3\nnrows 1\nxllcorner 0\nyllcorner 0\ncellsize -1\n1 2 3", VD_ERROR_FORMAT,
                "positive");
    refuse_text("ncols 0\nnrows 1\nxllcorner 0\nyllcorner 0\ncellsize 1\n", VD_ERROR_FORMAT,
                "ncols");
    refuse_text("ncols 2.5\nnrows 1\nxllcorner 0\nyllcorner 0\ncellsize 1\n", VD_ERROR_FORMAT,
                "whole number");
    refuse_text("ncols\nnrows 1\n", VD_ERROR_FORMAT, "line 1");
    refuse_text("ncols 2\nnrovs 1\n", VD_ERROR_FORMAT, "nrovs");
    refuse_text("ncols 2", VD_ERROR_FORMAT, "nrows");
#undef HEAD
}

static void promised_sizes_take_no_memory(void **state) {
    (void)state;
    vd_context_memory_reset_peak(context);
    refuse_text("ncols 99999\nnrows 99999\nxllcorner 0\nyllcorner 0\ncellsize 1\n1", VD_ERROR_LIMIT,
                "99999");
    refuse_text("ncols 65535\nnrows 8000\nxllcorner 0\nyllcorner 0\ncellsize 1\n1 2 3",
                VD_ERROR_FORMAT, "row 1 of 8000 after 3 of 65535");
    static const char bomb[] = "P5 65000 65000 255\n";
    refuse(bomb, sizeof bomb, "bomb.pgm", NULL, VD_ERROR_LIMIT, "bomb.pgm");
    assert_true(vd_context_memory(context).bytes_peak < 100000);
}

/* ---- pictures -------------------------------------------------------------------------------- */

static void pictures_hold_grey_heights(void **state) {
    (void)state;
    vd_dem_def def = vd_dem_def_default();
    def.cell_size_m = 30.0;
    vd_dem *dem = decode_text("P2 3 2 65535\n0 1 65535\n7 8 9\n", "heights.pgm", &def);
    assert_int_equal(dem->kind, VD_CRS_NONE);
    const double t[6] = {0, 30, 0, 0, 0, -30};
    assert_memory_equal(dem->transform, t, sizeof t);
    assert_true(at(dem, 2, 0) == 65535.0f && at(dem, 0, 1) == 7.0f);
    assert_string_equal(dem->height_type, "uint16");
    vd_dem_destroy(&dem);
    refuse("P5 4 4 255\n12", 13, "short.pgm", NULL, VD_ERROR_FORMAT, "short.pgm");
    def.encoding = VD_ENCODING_TERRARIUM;
    refuse("P2 1 1 255\n1", 12, "grey.pgm", &def, VD_ERROR_FORMAT, "red, green and blue");
}

static void pictures_hold_packed_heights(void **state) {
    (void)state;
    static const struct {
        vd_height_encoding encoding;
        double expected[2];
    } cases[] = {{VD_ENCODING_GREY, {1, 130}},
                 {VD_ENCODING_RGB24, {66051, 8526208}},
                 {VD_ENCODING_TERRARIUM, {-32509.98828125, 537.5}},
                 {VD_ENCODING_MAPBOX, {-3394.9, 842620.8}}};
    for (size_t i = 0; i < 4; i++) {
        vd_dem_def def = vd_dem_def_default();
        def.encoding = cases[i].encoding;
        vd_dem *dem = decode_text("P3 2 1 255\n1 2 3 130 25 128\n", "packed.ppm", &def);
        assert_true(at(dem, 1, 0) == (float)cases[i].expected[1]);
        assert_true(at(dem, 0, 0) == (float)cases[i].expected[0]);
        vd_dem_destroy(&dem);
    }
}

static void transparent_pixels_are_missing(void **state) {
    (void)state;
    vd_picture *picture = NULL;
    assert_ok(vd_picture_create(context, 2, 1, 2, 8, &picture));
    const uint8_t pixels[4] = {50, 255, 60, 0};
    memcpy(picture->data, pixels, sizeof pixels);
    assert_ok(vd_picture_save_png(picture, VEDUTA_BINARY_DIR "/test_dem_alpha.png", NULL));
    vd_picture_destroy(&picture);
    vd_dem *dem = NULL;
    assert_ok(vd_dem_load(context, VEDUTA_BINARY_DIR "/test_dem_alpha.png", NULL, &dem));
    assert_true(at(dem, 0, 0) == 50.0f && isnan(at(dem, 1, 0)));
    vd_dem_destroy(&dem);
    remove(VEDUTA_BINARY_DIR "/test_dem_alpha.png");
}

static void shipped_pictures_have_their_ranges(void **state) {
    (void)state;
    vd_dem_def def = vd_dem_def_default();
    def.encoding = VD_ENCODING_RGB24;
    def.height_scale = 1.0 / 11983.0;
    def.cell_size_m = 20.0;
    vd_dem *dem = NULL;
    assert_ok(vd_dem_load(context, VEDUTA_SOURCE_DIR "/data/levi/topography.png", &def, &dem));
    assert_true(dem->width == 400 && dem->height == 400 && dem->missing == 0);
    assert_true(close_to((double)dem->min, 180.0, 0.5) && close_to((double)dem->max, 530.6, 0.1));
    vd_dem_destroy(&dem);
    assert_ok(vd_dem_load(context, VEDUTA_SOURCE_DIR "/data/mont-blanc.png", NULL, &dem));
    assert_true(dem->width == 657 && dem->height == 544);
    assert_true(dem->min == 516.0f && dem->max == 4671.0f);
    vd_dem_destroy(&dem);
}

/* ---- raw ------------------------------------------------------------------------------------- */

static void raw_reads_every_type(void **state) {
    (void)state;
    static const struct {
        const char *type;
        uint8_t big_endian[8];
        int bytes;
        float expected;
    } cases[] = {{"u8", {200}, 1, 200.0f},
                 {"i16", {0xFF, 0xFE}, 2, -2.0f},
                 {"u16", {0xFF, 0xFE}, 2, 65534.0f},
                 {"i32", {0xFF, 0xFF, 0xFF, 0xFD}, 4, -3.0f},
                 {"i32", {0x80, 0, 0, 0}, 4, -2147483648.0f},
                 {"f32", {0x3F, 0xC0, 0, 0}, 4, 1.5f},
                 {"f64", {0xC0, 0x04, 0, 0, 0, 0, 0, 0}, 8, -2.5f}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        for (int big = 0; big < 2; big++) {
            uint8_t data[2 + 8] = {0xEE, 0xEE};
            for (int b = 0; b < cases[i].bytes; b++) {
                data[2 + b] = cases[i].big_endian[big ? b : cases[i].bytes - 1 - b];
            }
            vd_dem_def def = vd_dem_def_default();
            def.raw_width = def.raw_height = 1;
            snprintf(def.raw_type, sizeof def.raw_type, "%s", cases[i].type);
            def.raw_big_endian = big != 0;
            def.raw_offset_bytes = 2;
            size_t size = 2 + (size_t)cases[i].bytes;
            vd_dem *dem = NULL;
            assert_ok(vd_dem_decode(context, data, size, "x.raw", &def, &dem));
            assert_true(at(dem, 0, 0) == cases[i].expected);
            vd_dem_destroy(&dem);
            def.has_nodata = true;
            def.nodata = (double)cases[i].expected;
            assert_ok(vd_dem_decode(context, data, size, "x.raw", &def, &dem));
            assert_int_equal(dem->missing, 1);
            vd_dem_destroy(&dem);
        }
    }
}

static void raw_checks_its_size(void **state) {
    (void)state;
    vd_dem_def def = vd_dem_def_default();
    uint8_t data[24] = {0};
    def.raw_width = 3;
    def.raw_height = 4;
    strcpy(def.raw_type, "i16");
    vd_dem *dem = NULL;
    assert_ok(vd_dem_decode(context, data, 24, "x.raw", &def, &dem));
    assert_true(dem->width == 3 && dem->height == 4 && dem->max == 0.0f);
    vd_dem_destroy(&dem);
    refuse(data, 23, "x.raw", &def, VD_ERROR_FORMAT, "make 24 bytes, the file has 23");
    def.raw_offset_bytes = 30;
    refuse(data, 24, "x.raw", &def, VD_ERROR_FORMAT, "make 54 bytes");
    def.raw_offset_bytes = 0;
    strcpy(def.raw_type, "i17");
    refuse(data, 24, "x.raw", &def, VD_ERROR_ARGUMENT, "raw type");
    strcpy(def.raw_type, "u8");
    def.raw_height = 0;
    refuse(data, 24, "x.raw", &def, VD_ERROR_ARGUMENT, "at least 1");
    /* Numbers that no float holds are missing. */
    const double large[1] = {1e300};
    def.raw_width = def.raw_height = 1;
    strcpy(def.raw_type, "f64");
    assert_ok(vd_dem_decode(context, large, 8, "x.raw", &def, &dem));
    assert_true(dem->missing == 1 && isnan(dem->min) && isnan(dem->max));
    vd_dem_destroy(&dem);
}

/* ---- files ----------------------------------------------------------------------------------- */

static void unknown_files_are_left_to_others(void **state) {
    (void)state;
    vd_dem *dem = NULL;
    refuse("II*\0abcdefgh", 12, "x.tif", NULL, VD_ERROR_UNSUPPORTED, "GDAL");
    refuse("ncolsx 4", 8, "x.txt", NULL, VD_ERROR_UNSUPPORTED, "x.txt");
    refuse("", 0, "x.asc", NULL, VD_ERROR_FORMAT, "empty");
    assert_int_equal(
        vd_dem_load(context, VEDUTA_SOURCE_DIR "/data/mont-blanc.tif", NULL, &dem).code,
        VD_ERROR_UNSUPPORTED);
    assert_int_equal(vd_dem_load(context, VEDUTA_BINARY_DIR "/no-such.hgt", NULL, &dem).code,
                     VD_ERROR_IO);
    assert_int_equal(vd_dem_load(context, VEDUTA_BINARY_DIR, NULL, &dem).code, VD_ERROR_IO);
    assert_int_equal(vd_dem_load(context, NULL, NULL, &dem).code, VD_ERROR_ARGUMENT);
    vd_dem_def def = vd_dem_def_default();
    def.height_scale = (double)NAN;
    assert_int_equal(vd_dem_decode(context, "P2 1 1 1 1", 10, "x", &def, &dem).code,
                     VD_ERROR_ARGUMENT);
    assert_null(dem);
}

/* ---- mosaics --------------------------------------------------------------------------------- */

static vd_dem *make_part(const vd_dem *whole, int column, int row, int width, int height,
                         bool mirrored, bool turned) {
    vd_dem *part = NULL;
    assert_ok(vd_dem_create(context, width, height, &part));
    for (int r = 0; r < height; r++) {
        for (int c = 0; c < width; c++) {
            int from_c = column + (mirrored ? width - 1 - c : c);
            int from_r = row + (turned ? height - 1 - r : r);
            part->heights[(size_t)r * part->stride + (size_t)c] = at(whole, from_c, from_r);
        }
    }
    const double *t = whole->transform;
    part->kind = whole->kind;
    part->transform[0] = t[0] + (column + (mirrored ? width - 1 : 0)) * t[1];
    part->transform[1] = mirrored ? -t[1] : t[1];
    part->transform[3] = t[3] + (row + (turned ? height - 1 : 0)) * t[5];
    part->transform[5] = turned ? -t[5] : t[5];
    vd_dem_update_range(part);
    return part;
}

static vd_dem *make_whole(int width, int height, uint64_t seed) {
    vd_dem *whole = NULL;
    assert_ok(vd_dem_create(context, width, height, &whole));
    for (int r = 0; r < height; r++) {
        for (int c = 0; c < width; c++) {
            whole->heights[(size_t)r * whole->stride + (size_t)c] =
                (float)(1000.0 * test_uniform(&seed));
        }
    }
    whole->kind = VD_CRS_GEOGRAPHIC;
    const double t[6] = {6.0, 1.0 / 1200, 0.0, 46.0, 0.0, -1.0 / 1200};
    memcpy(whole->transform, t, sizeof t);
    vd_dem_update_range(whole);
    return whole;
}

static void assert_same(const vd_dem *a, const vd_dem *b) {
    assert_true(a->width == b->width && a->height == b->height && a->missing == b->missing);
    for (int i = 0; i < 6; i++) {
        assert_true(close_to(a->transform[i], b->transform[i], 1e-9));
    }
    for (int r = 0; r < a->height; r++) {
        assert_memory_equal(a->heights + (size_t)r * a->stride, b->heights + (size_t)r * b->stride,
                            (size_t)a->width * sizeof(float));
    }
}

static void tiles_join_without_a_seam(void **state) {
    (void)state;
    vd_dem *whole = make_whole(41, 33, 5);
    for (int flips = 0; flips < 4; flips++) {
        /* Neighbours share one row or column, as SRTM tiles do; given in several orders. */
        vd_dem *parts[4] = {make_part(whole, 0, 0, 21, 17, flips & 1, flips & 2),
                            make_part(whole, 20, 0, 21, 17, false, flips & 2),
                            make_part(whole, 0, 16, 21, 17, flips & 1, false),
                            make_part(whole, 20, 16, 21, 17, flips & 1, flips & 2)};
        for (int first = 0; first < 4; first++) {
            const vd_dem *order[4] = {parts[first], parts[(first + 3) % 4], parts[(first + 1) % 4],
                                      parts[(first + 2) % 4]};
            vd_dem *joined = NULL;
            assert_ok(vd_dem_mosaic(context, order, 4, &joined));
            assert_same(joined, whole);
            assert_true(joined->min == whole->min && joined->max == whole->max);
            vd_dem_destroy(&joined);
        }
        for (int i = 0; i < 4; i++) {
            vd_dem_destroy(&parts[i]);
        }
    }
    vd_dem_destroy(&whole);
}

static void first_part_wins_unless_missing(void **state) {
    (void)state;
    vd_dem *a = make_whole(3, 3, 1), *b = make_whole(3, 3, 2);
    a->heights[1] = NAN;
    b->transform[0] += 1.0 / 1200;
    vd_dem *joined = NULL;
    const vd_dem *parts[2] = {a, b};
    assert_ok(vd_dem_mosaic(context, parts, 2, &joined));
    assert_int_equal(joined->width, 4);
    assert_true(at(joined, 1, 0) == at(b, 0, 0));
    assert_true(at(joined, 1, 1) == at(a, 1, 1) && at(joined, 2, 2) == at(a, 2, 2));
    assert_true(at(joined, 3, 2) == at(b, 2, 2));
    vd_dem_destroy(&joined);
    /* Tiles on both sides of the date line lie beside each other; a gap stays missing. */
    a->transform[0] = 180.0 - 3.0 / 1200;
    b->transform[0] = -180.0 + 1.0 / 1200;
    assert_ok(vd_dem_mosaic(context, parts, 2, &joined));
    assert_int_equal(joined->width, 7);
    assert_int_equal(joined->missing, 1 + 3);
    assert_true(at(joined, 4, 0) == at(b, 0, 0));
    vd_dem_destroy(&joined);
    vd_dem_destroy(&a);
    vd_dem_destroy(&b);
}

static void refuse_join(const vd_dem *a, const vd_dem *b, vd_code code, const char *part) {
    const vd_dem *parts[2] = {a, b};
    vd_dem *joined = NULL;
    vd_status status = vd_dem_mosaic(context, parts, 2, &joined);
    assert_null(joined);
    assert_int_equal(status.code, code);
    assert_non_null(strstr(status.message, part));
}

static void far_parts_are_refused(void **state) {
    (void)state;
    /* Two parts may span 64 times what they hold: 18 of 3 × 3 samples at most 1152. */
    const double cell = 1.0 / 1200;
    vd_dem *a = make_whole(3, 3, 1), *b = make_whole(3, 3, 2), *joined = NULL;
    const vd_dem *parts[2] = {a, b};
    b->transform[3] = 46.0 - 381.0 * cell;
    assert_ok(vd_dem_mosaic(context, parts, 2, &joined));
    assert_true(joined->width == 3 && joined->height == 384);
    vd_dem_destroy(&joined);
    b->transform[3] -= cell;
    refuse_join(a, b, VD_ERROR_LIMIT, "3 × 385 samples, 64 times as many as they hold");
    vd_dem_destroy(&a);
    vd_dem_destroy(&b);
    /* However long, a chain of parts that touch each other is one place. */
    enum { LINKS = 100 };
    vd_dem *chain[LINKS];
    for (int i = 0; i < LINKS; i++) {
        chain[i] = make_whole(2, 2, (uint64_t)i + 1);
        chain[i]->transform[0] += 2.0 * cell * i;
        chain[i]->transform[3] -= 2.0 * cell * i;
    }
    assert_ok(vd_dem_mosaic(context, (const vd_dem *const *)chain, LINKS, &joined));
    assert_true(joined->width == 2 * LINKS && joined->height == 2 * LINKS);
    vd_dem_destroy(&joined);
    for (int i = 0; i < LINKS; i++) {
        vd_dem_destroy(&chain[i]);
    }
    /* Each dense enough, but more than a side can hold. */
    a = make_whole(40000, 1, 3);
    b = make_whole(40000, 1, 4);
    b->transform[0] = a->transform[0] + 40000.0 * cell;
    refuse_join(a, b, VD_ERROR_LIMIT, "together they span 80000 × 1 samples, more than 65535");
    vd_dem_destroy(&a);
    vd_dem_destroy(&b);
}

/* A part that lies within a whole globe must not be turned out of it. */
static void part_of_a_globe_stays_inside(void **state) {
    (void)state;
    const double globe_at[6] = {-175.0, 10.0, 0.0, 85.0, 0.0, -10.0};
    for (int place = 0; place < 36; place++) {
        vd_dem *globe = make_whole(36, 18, 1), *part = make_whole(1, 1, 2), *joined = NULL;
        memcpy(globe->transform, globe_at, sizeof globe_at);
        memcpy(part->transform, globe_at, sizeof globe_at);
        part->transform[0] += 10.0 * place;
        const vd_dem *parts[2] = {globe, part};
        assert_ok(vd_dem_mosaic(context, parts, 2, &joined));
        assert_same(joined, globe);
        vd_dem_destroy(&joined);
        vd_dem_destroy(&globe);
        vd_dem_destroy(&part);
    }
}

static void different_grids_are_refused(void **state) {
    (void)state;
    vd_dem *a = make_whole(3, 3, 1), *b = make_whole(3, 3, 2), *joined = NULL;
    const double cell = 1.0 / 1200;
    b->transform[0] = 6.0 + 0.4 * cell;
    refuse_join(a, b, VD_ERROR_UNSUPPORTED, "between the samples");
    b->transform[0] = 6.0 + 0.009 * cell;
    const vd_dem *parts[2] = {a, b};
    assert_ok(vd_dem_mosaic(context, parts, 2, &joined));
    vd_dem_destroy(&joined);
    b->transform[0] = 6.0;
    b->transform[1] = cell * 1.01;
    refuse_join(a, b, VD_ERROR_UNSUPPORTED, "cell size");
    b->transform[1] = cell;
    b->transform[2] = 1e-6;
    refuse_join(a, b, VD_ERROR_UNSUPPORTED, "rotated");
    refuse_join(b, a, VD_ERROR_UNSUPPORTED, "rotated");
    b->transform[2] = 0.0;
    b->kind = VD_CRS_PROJECTED;
    refuse_join(a, b, VD_ERROR_UNSUPPORTED, "coordinate system");
    b->kind = VD_CRS_GEOGRAPHIC;
    b->transform[3] = -46.0;
    refuse_join(a, b, VD_ERROR_LIMIT, "number 2 of 2 lies far from the first: together they span");
    b->transform[3] = (double)NAN;
    refuse_join(a, b, VD_ERROR_UNSUPPORTED, "too far");
    a->kind = b->kind = VD_CRS_NONE;
    refuse_join(a, b, VD_ERROR_UNSUPPORTED, "where it lies");
    assert_int_equal(vd_dem_mosaic(context, parts, 0, &joined).code, VD_ERROR_ARGUMENT);
    /* One part alone may be rotated or without a place. */
    a->transform[2] = 0.5;
    assert_ok(vd_dem_mosaic(context, parts, 1, &joined));
    assert_same(joined, a);
    vd_dem_destroy(&joined);
    vd_dem_destroy(&a);
    vd_dem_destroy(&b);
}

/* ---- filling --------------------------------------------------------------------------------- */

static void filling_keeps_what_is_there(void **state) {
    (void)state;
    static const int sizes[][2] = {{1, 1}, {1, 9}, {17, 1}, {33, 20}, {64, 64}, {5, 97}};
    uint64_t seed = 3;
    for (size_t i = 0; i < sizeof sizes / sizeof sizes[0]; i++) {
        vd_dem *dem = make_whole(sizes[i][0], sizes[i][1], i + 1);
        vd_dem *holed = make_part(dem, 0, 0, dem->width, dem->height, false, false);
        for (int r = 0; r < dem->height; r++) {
            for (int c = r == 0 ? 1 : 0; c < dem->width; c++) {
                if (test_uniform(&seed) < 0.8) {
                    holed->heights[(size_t)r * holed->stride + (size_t)c] = NAN;
                }
            }
        }
        vd_dem_update_range(holed);
        vd_dem *filled = make_part(holed, 0, 0, dem->width, dem->height, false, false);
        assert_ok(vd_dem_fill(filled));
        assert_int_equal(filled->missing, 0);
        assert_true(filled->min == holed->min && filled->max == holed->max);
        for (int r = 0; r < dem->height; r++) {
            for (int c = 0; c < dem->width; c++) {
                assert_true(isnan(at(holed, c, r)) || at(holed, c, r) == at(filled, c, r));
                assert_false(isnan(at(filled, c, r)));
            }
        }
        vd_dem_destroy(&filled);
        vd_dem_destroy(&holed);
        vd_dem_destroy(&dem);
    }
}

static void filling_is_smooth(void **state) {
    (void)state;
    vd_dem *dem = NULL;
    assert_ok(vd_dem_create(context, 64, 64, &dem));
    assert_ok(vd_dem_fill(dem)); /* nothing to fill from */
    assert_int_equal(dem->missing, 64 * 64);
    for (int r = 0; r < 64; r++) {
        for (int c = 0; c < 64; c++) {
            bool hole = r > 20 && r < 44 && c > 20 && c < 44;
            dem->heights[(size_t)r * dem->stride + (size_t)c] = hole ? NAN : 10.0f * (float)c;
        }
    }
    assert_ok(vd_dem_fill(dem));
    /* On a slope the middle of the hole comes out at the middle's height, rising with the slope. */
    assert_true(close_to((double)at(dem, 32, 32), 320.0, 40.0));
    assert_true(at(dem, 22, 32) < at(dem, 32, 32) && at(dem, 32, 32) < at(dem, 42, 32));
    for (int c = 20; c < 44; c++) {
        assert_true(fabsf(at(dem, c + 1, 32) - at(dem, c, 32)) < 80.0f);
    }
    vd_dem_destroy(&dem);
}

/* ---- memory ---------------------------------------------------------------------------------- */

static vd_status load_case(vd_context *failing, int which, vd_dem **out) {
    static const char asc[] = "ncols 2\nnrows 2\nxllcorner 6\nyllcorner 45\ncellsize 0.01\n"
                              "1 2 -9999 4";
    static const char pgm[] = "P2 2 2 255\n1 2 3 4";
    vd_dem_def def = vd_dem_def_default();
    def.raw_width = def.raw_height = 2;
    strcpy(def.raw_type, "u8");
    vd_dem *one = NULL;
    vd_status status;
    switch (which) {
    case 0:
        return vd_dem_decode(failing, asc, sizeof asc - 1, "x.asc", NULL, out);
    case 1:
        return vd_dem_decode(failing, pgm, sizeof pgm - 1, "x.pgm", NULL, out);
    case 2:
        return vd_dem_decode(failing, "abcd", 4, "x.raw", &def, out);
    case 3:
        return vd_dem_load(failing, VEDUTA_SOURCE_DIR "/data/mont-blanc.png", NULL, out);
    case 4:
        status = vd_dem_decode(failing, asc, sizeof asc - 1, "x.asc", NULL, &one);
        if (status.code == VD_OK) {
            const vd_dem *parts[2] = {one, one};
            status = vd_dem_mosaic(failing, parts, 2, out);
        }
        vd_dem_destroy(&one);
        return status;
    default:
        status = vd_dem_decode(failing, asc, sizeof asc - 1, "x.asc", NULL, &one);
        if (status.code == VD_OK) {
            status = vd_dem_fill(one);
        }
        if (status.code == VD_OK) {
            *out = one;
            return status;
        }
        vd_dem_destroy(&one);
        return status;
    }
}

static void every_allocation_may_fail(void **state) {
    (void)state;
    for (int which = 0; which < 6; which++) {
        bool done = false;
        for (int n = 1; !done; n++) {
            test_allocator allocator = {0, 0, 0};
            vd_context *failing = test_failing_context(&allocator);
            allocator.fail_at = allocator.calls + n;
            vd_dem *dem = NULL;
            vd_status status = load_case(failing, which, &dem);
            done = status.code == VD_OK;
            assert_true(done || status.code == VD_ERROR_MEMORY);
            assert_true(done == (dem != NULL) && (!done || n > 1));
            vd_dem_destroy(&dem);
            vd_context_destroy(&failing);
            assert_int_equal(allocator.live, 0);
            assert_true(n < 100);
        }
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(degrees_become_metres),
        cmocka_unit_test(projected_units_are_scaled),
        cmocka_unit_test(create_checks_its_size),
        cmocka_unit_test(hgt_takes_its_place_from_the_name),
        cmocka_unit_test(hgt_may_be_narrower_in_the_north),
        cmocka_unit_test(ascii_places_corners_and_centres),
        cmocka_unit_test(ascii_recognizes_degrees_and_says_so),
        cmocka_unit_test(ascii_says_what_is_wrong),
        cmocka_unit_test(promised_sizes_take_no_memory),
        cmocka_unit_test(pictures_hold_grey_heights),
        cmocka_unit_test(pictures_hold_packed_heights),
        cmocka_unit_test(transparent_pixels_are_missing),
        cmocka_unit_test(shipped_pictures_have_their_ranges),
        cmocka_unit_test(raw_reads_every_type),
        cmocka_unit_test(raw_checks_its_size),
        cmocka_unit_test(unknown_files_are_left_to_others),
        cmocka_unit_test(tiles_join_without_a_seam),
        cmocka_unit_test(first_part_wins_unless_missing),
        cmocka_unit_test(different_grids_are_refused),
        cmocka_unit_test(far_parts_are_refused),
        cmocka_unit_test(part_of_a_globe_stays_inside),
        cmocka_unit_test(filling_keeps_what_is_there),
        cmocka_unit_test(filling_is_smooth),
        cmocka_unit_test(every_allocation_may_fail),
    };
    return cmocka_run_group_tests_name("dem", tests, set_up, tear_down);
}

/* Colour maps: the built-in ones, both kinds of files, lookups. */
#include <math.h>
#include <stdio.h>
#include "support.h"
#include "terrain/colormap_internal.h"

static void assert_color(vd_rgba8 c, int r, int g, int b, int a) {
    if (c.r != r || c.g != g || c.b != b || c.a != a) {
        fail_msg("expected %d %d %d %d, got %d %d %d %d", r, g, b, a, c.r, c.g, c.b, c.a);
    }
}

static vd_colormap decode(const char *text, const char *name) {
    vd_colormap map;
    assert_ok(vd_colormap_decode(text, strlen(text), name, &map));
    for (int i = 1; i < map.count; i++) {
        assert_true(map.stops[i - 1].value <= map.stops[i].value);
    }
    return map;
}

static void refuse(const char *text, const char *name, const char *part) {
    vd_colormap map;
    map.count = -7;
    vd_status status = vd_colormap_decode(text, strlen(text), name, &map);
    if (status.code != VD_ERROR_FORMAT || !strstr(status.message, part) ||
        !strstr(status.message, name)) {
        fail_msg("expected a refusal with \"%s\", got %s: %s", part, vd_code_name(status.code),
                 status.message);
    }
    assert_int_equal(map.count, -7);
}

static void builtin_maps_are_sound(void **state) {
    (void)state;
    int count = 0;
    for (; vd_colormap_name(count); count++) {
        vd_colormap map;
        assert_true(vd_colormap_find(vd_colormap_name(count), &map));
        assert_true(map.count >= 1 && map.count <= VD_COLORMAP_MAX_STOPS);
        for (int i = 0; i < map.count; i++) {
            assert_true(i == 0 || map.stops[i - 1].value < map.stops[i].value);
            assert_true(!map.relative || (map.stops[i].value >= 0 && map.stops[i].value <= 1));
            assert_int_equal(map.stops[i].color.a, 255);
            /* Exact at the stops. */
            vd_rgba8 color = vd_colormap_at(&map, map.stops[i].value, 0.0, 1.0);
            assert_memory_equal(&color, &map.stops[i].color, sizeof color);
        }
        if (map.relative) {
            assert_true(map.stops[0].value == 0.0);
            assert_true(map.count == 1 || map.stops[map.count - 1].value == 1.0);
        }
    }
    assert_true(count >= 5);
    assert_null(vd_colormap_name(-1));
    vd_colormap map;
    assert_false(vd_colormap_find("no such map", &map));
    assert_false(vd_colormap_find(NULL, &map));
    assert_true(vd_colormap_find("terrain", &map));
    assert_true(vd_colormap_find("topo", &map));
    assert_false(map.relative);
    vd_rgba8 sea = vd_colormap_at(&map, 0.0, 0.0, 1.0), land = vd_colormap_at(&map, 1.0, 0.0, 1.0);
    assert_true(sea.b > sea.g && land.g > land.b);
}

static void colors_are_interpolated(void **state) {
    (void)state;
    vd_colormap map;
    assert_true(vd_colormap_find("grey", &map));
    assert_color(vd_colormap_at(&map, 150, 100, 200), 128, 128, 128, 255);
    assert_color(vd_colormap_at(&map, 99, 100, 200), 0, 0, 0, 255);
    assert_color(vd_colormap_at(&map, 1e30, 100, 200), 255, 255, 255, 255);
    assert_color(vd_colormap_at(&map, (double)NAN, 100, 200), 0, 0, 0, 255);
    assert_color(vd_colormap_at(&map, 100, 100, 100), 0, 0, 0, 255);
    assert_true(vd_colormap_find("viridis", &map));
    assert_color(vd_colormap_at(&map, 0, 0, 1), 68, 1, 84, 255);
    assert_color(vd_colormap_at(&map, 1, 0, 1), 253, 231, 37, 255);
}

static void gmt_slices_are_read(void **state) {
    (void)state;
    vd_colormap map = decode("# a map\n# COLOR_MODEL = RGB\n"
                             "-100 0/0/255 0 200/220/255 L ; sea\n"
                             "0\tgreen\t500\t#ffcc00\tB\r\n"
                             "500 128 1000 255\n"
                             "B black\nF 255 0 255\nN gray50\n",
                             "relief.cpt");
    assert_false(map.relative);
    assert_color(vd_colormap_at(&map, -100, 0, 0), 0, 0, 255, 255);
    assert_color(vd_colormap_at(&map, -50, 0, 0), 100, 110, 255, 255);
    assert_color(vd_colormap_at(&map, 0, 0, 0), 0, 255, 0, 255);
    assert_color(vd_colormap_at(&map, -1e-9, 0, 0), 200, 220, 255, 255);
    assert_color(vd_colormap_at(&map, 500, 0, 0), 128, 128, 128, 255);
    assert_color(vd_colormap_at(&map, 499.9999999, 0, 0), 255, 204, 0, 255);
    assert_color(vd_colormap_at(&map, 1000, 0, 0), 255, 255, 255, 255);
    assert_color(vd_colormap_at(&map, 1000.001, 0, 0), 255, 0, 255, 255);
    assert_color(vd_colormap_at(&map, -100.001, 0, 0), 0, 0, 0, 255);
}

static void gmt_colors_have_many_forms(void **state) {
    (void)state;
    vd_colormap map = decode("1 255 0 0 2 0 255 0\n2 0/0/0 3 0/50/100/0\n"
                             "3 LightSkyBlue 4 red@50\n4 - 5 #f80\n5 120-1-1 6 gray20\n",
                             "forms.cpt");
    assert_color(vd_colormap_at(&map, 1, 0, 0), 255, 0, 0, 255);
    assert_color(vd_colormap_at(&map, 1.5, 0, 0), 128, 128, 0, 255);
    assert_color(vd_colormap_at(&map, 2.99999999, 0, 0), 255, 128, 0, 255);
    assert_color(vd_colormap_at(&map, 3, 0, 0), 135, 206, 250, 255);
    assert_color(vd_colormap_at(&map, 3.99999999, 0, 0), 255, 0, 0, 128);
    assert_color(vd_colormap_at(&map, 4, 0, 0), 0, 0, 0, 0);
    assert_color(vd_colormap_at(&map, 4.99999999, 0, 0), 255, 136, 0, 255);
    assert_color(vd_colormap_at(&map, 5, 0, 0), 0, 255, 0, 255);
    assert_color(vd_colormap_at(&map, 6, 0, 0), 51, 51, 51, 255);
}

static void gmt_hsv_follows_the_hue(void **state) {
    (void)state;
    vd_colormap map = decode("# COLOR_MODEL = +HSV\n0 0 1 1 360 360 1 1\n", "hue.cpt");
    assert_color(vd_colormap_at(&map, 0, 0, 0), 255, 0, 0, 255);
    assert_color(vd_colormap_at(&map, 60, 0, 0), 255, 255, 0, 255);
    assert_color(vd_colormap_at(&map, 120, 0, 0), 0, 255, 0, 255);
    assert_color(vd_colormap_at(&map, 240, 0, 0), 0, 0, 255, 255);
    assert_color(vd_colormap_at(&map, 360, 0, 0), 255, 0, 0, 255);
    map = decode("# COLOR_MODEL = HSV\n0 0 1 1 10 120 1 1\n", "plain.cpt");
    assert_color(vd_colormap_at(&map, 5, 0, 0), 128, 128, 0, 255);
    assert_int_equal(map.count, 2);
}

static void gmt_normalised_maps_are_placed(void **state) {
    (void)state;
    vd_colormap map =
        decode("# COLOR_MODEL = RGB\n0 black 0.5 red\n0.5 red 1 white\nB blue\n", "relative.cpt");
    assert_true(map.relative);
    assert_color(vd_colormap_at(&map, 300, 100, 500), 255, 0, 0, 255);
    assert_color(vd_colormap_at(&map, 0, 100, 500), 0, 0, 0, 255);
    map = decode("# RANGE = -4000/8000\n# HARD_HINGE\n-1 black 0 blue\n0 green 1 white\n",
                 "hinged.cpt");
    assert_false(map.relative);
    assert_true(map.stops[0].value == -4000.0 && map.stops[map.count - 1].value == 8000.0);
    assert_color(vd_colormap_at(&map, 0, 0, 0), 0, 255, 0, 255);
    assert_color(vd_colormap_at(&map, -2000, 0, 0), 0, 0, 128, 255);
    map = decode("# RANGE = 100/300\n0 black 1 white\n", "range.cpt");
    assert_color(vd_colormap_at(&map, 200, 0, 0), 128, 128, 128, 255);
    map = decode("-1 black 0 white\n0 white 1 black\n", "polar.cpt");
    assert_true(map.relative);
    assert_color(vd_colormap_at(&map, 5, 0, 10), 255, 255, 255, 255);
}

static void gdaldem_texts_are_read(void **state) {
    (void)state;
    vd_colormap map = decode("# heights\n1000 white\n\nnv 0 0 0 0\n0,10:20\t30\n"
                             "500 100 110 120 130\n2000 grey\n",
                             "ramp.txt");
    assert_false(map.relative);
    assert_int_equal(map.count, 4);
    assert_color(vd_colormap_at(&map, 0, 0, 0), 10, 20, 30, 255);
    assert_color(vd_colormap_at(&map, 500, 0, 0), 100, 110, 120, 130);
    assert_color(vd_colormap_at(&map, 250, 0, 0), 55, 65, 75, 193);
    assert_color(vd_colormap_at(&map, 1000, 0, 0), 255, 255, 255, 255);
    assert_color(vd_colormap_at(&map, 9999, 0, 0), 191, 191, 191, 255);
    map = decode("0% 0 0 0\n100% 200 100 50\n", "percent.txt");
    assert_true(map.relative);
    assert_color(vd_colormap_at(&map, 15, 10, 20), 100, 50, 25, 255);
    /* Two stops of one value are a step. */
    map = decode("0 0 0 0\n10 50 50 50\n10 200 200 200\n20 255 255 255\n", "step.txt");
    assert_color(vd_colormap_at(&map, 9.9999999, 0, 0), 50, 50, 50, 255);
    assert_color(vd_colormap_at(&map, 10, 0, 0), 200, 200, 200, 255);
    map = decode("# QGIS Generated Color Map Export File\nINTERPOLATION:INTERPOLATED\n"
                 "180,1,2,3,255,180 m\n530.6,4,5,6,255,530.6\n",
                 "qgis.txt");
    assert_int_equal(map.count, 2);
    assert_color(vd_colormap_at(&map, 530.6, 0, 0), 4, 5, 6, 255);
}

static void faults_name_their_line(void **state) {
    (void)state;
    refuse("", "empty.txt", "no colours");
    refuse("# only a comment\n", "comment.cpt", "no colours");
    refuse("0 1 2 3\n10 red blue green yellow\n20 x\n", "names.txt", "line 3");
    refuse("0 300 0 0\n", "range.txt", "line 1");
    refuse("0 1 2 3 256\n", "alpha.txt", "line 1");
    refuse("ten 1 2 3\n", "word.txt", "line 1");
    refuse("inf 1 2 3\n", "inf.txt", "line 1");
    refuse("0 1 2 3\n50% 1 2 3\n", "mixed.txt", "line 2");
    refuse("INTERPOLATION:DISCRETE\n", "qgis.txt", "line 1");
    refuse("\n0 red 10 blue\n10 red\n", "fields.cpt", "line 3");
    refuse("0 red 10 blue\n5 red 20 blue\n", "order.cpt", "line 2");
    refuse("10 red 0 blue\n", "order.cpt", "line 1");
    refuse("0 red nan blue\n", "nan.cpt", "line 1");
    refuse("0 reddish 10 blue\n", "name.cpt", "line 1");
    refuse("0 1/2 10 blue\n", "two.cpt", "line 1");
    refuse("0 #12 10 blue\n", "hex.cpt", "line 1");
    refuse("0 400-1-1 10 blue\n", "hsv.cpt", "line 1");
    refuse("0 red@200 10 blue\n", "transparency.cpt", "line 1");
    refuse("0 red 10 blue\nB\n", "below.cpt", "line 2");
}

static void too_many_stops_are_a_limit(void **state) {
    (void)state;
    char *text = malloc(40 * 1100);
    assert_non_null(text);
    for (int pass = 0; pass < 2; pass++) {
        size_t n = 0;
        int count = VD_COLORMAP_MAX_STOPS + pass;
        for (int i = 0; i < count; i++) {
            n += (size_t)sprintf(text + n, "%d %d 0 0\n", count - i, i & 255);
        }
        vd_colormap map;
        vd_status status = vd_colormap_decode(text, n, "many.txt", &map);
        assert_int_equal(status.code, pass ? VD_ERROR_LIMIT : VD_OK);
    }
    free(text);
}

static void files_are_loaded(void **state) {
    (void)state;
    const char *path = VEDUTA_BINARY_DIR "/test_colormap.txt";
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    fputs("0 1 2 3\n10 4 5 6", file);
    fclose(file);
    vd_colormap map;
    for (int n = 1;; n++) {
        test_allocator allocator = {0, 0, 0};
        vd_context *context = test_failing_context(&allocator);
        allocator.fail_at = allocator.calls + n;
        vd_status status = vd_colormap_load(context, path, &map);
        vd_context_destroy(&context);
        assert_int_equal(allocator.live, 0);
        if (status.code == VD_OK) {
            assert_true(n > 1);
            break;
        }
        assert_int_equal(status.code, VD_ERROR_MEMORY);
    }
    assert_color(vd_colormap_at(&map, 10, 0, 0), 4, 5, 6, 255);
    remove(path);
    vd_context *context = test_context(1, VD_ISA_AUTO);
    assert_int_equal(vd_colormap_load(context, path, &map).code, VD_ERROR_IO);
    assert_int_equal(vd_colormap_load(context, NULL, &map).code, VD_ERROR_ARGUMENT);
    vd_context_destroy(&context);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(builtin_maps_are_sound),
        cmocka_unit_test(colors_are_interpolated),
        cmocka_unit_test(gmt_slices_are_read),
        cmocka_unit_test(gmt_colors_have_many_forms),
        cmocka_unit_test(gmt_hsv_follows_the_hue),
        cmocka_unit_test(gmt_normalised_maps_are_placed),
        cmocka_unit_test(gdaldem_texts_are_read),
        cmocka_unit_test(faults_name_their_line),
        cmocka_unit_test(too_many_stops_are_a_limit),
        cmocka_unit_test(files_are_loaded),
    };
    return cmocka_run_group_tests_name("colormap", tests, NULL, NULL);
}

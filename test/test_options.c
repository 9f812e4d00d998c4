/* test_options.c: the option table, its parser, options files, and what the texts mean. */
#include "support.h"

#include <math.h>
#include <stdio.h>
#include <sys/stat.h>
#include <unistd.h>

#include "../app/render_settings.h"

/* Parses a command line for `render`; the caller finishes *options. */
static vd_status parse(vd_options *options, vd_render_settings *settings, int argc,
                       const char *const *argv) {
    char *arguments[32] = {(char *)"render"};
    for (int i = 0; i < argc; i++) {
        arguments[i + 1] = (char *)argv[i];
    }
    assert_ok(vd_options_init(options, "render", vd_render_table, OPTION_COUNT));
    vd_status status = vd_options_parse(options, argc + 1, arguments);
    if (status.code == VD_OK) {
        status = vd_render_apply_preset(options);
    }
    if (status.code == VD_OK) {
        status = vd_render_settings_read(options, settings);
    }
    return status;
}

#define PARSE(options, settings, ...)                                                              \
    parse(options, settings, (int)(sizeof((const char *[]){__VA_ARGS__}) / sizeof(char *)),        \
          (const char *[]){__VA_ARGS__})

/* Checks that a command line is bad use and that its sentence holds `part`. */
#define REFUSES(part, ...)                                                                         \
    do {                                                                                           \
        vd_options refused;                                                                        \
        vd_render_settings none;                                                                   \
        vd_status status_ = PARSE(&refused, &none, __VA_ARGS__);                                   \
        assert_int_equal(status_.code, VD_ERROR_ARGUMENT);                                         \
        if (strstr(status_.message, part) == NULL) {                                               \
            fail_msg("\"%s\" lacks \"%s\"", status_.message, part);                                \
        }                                                                                          \
        vd_options_finish(&refused);                                                               \
    } while (0)

static void test_table(void **state) {
    (void)state;
    for (int i = 0; i < OPTION_COUNT; i++) {
        const vd_option *a = &vd_render_table[i];
        assert_non_null(a->key);
        assert_non_null(a->group);
        assert_non_null(a->help);
        bool takes_value = a->type != VD_OPTION_SWITCH && a->type != VD_OPTION_FLAG;
        /* A flag may list words beside on and off. */
        assert_true(takes_value == (a->argument != NULL) || a->type == VD_OPTION_FLAG);
        if (a->type == VD_OPTION_INTEGER || a->type == VD_OPTION_REAL ||
            a->type == VD_OPTION_DISTANCE) {
            /* A number without a unit must at least be a plain factor. */
            assert_true(a->unit != NULL || strcmp(a->argument, "FACTOR") == 0);
        }
        for (int j = 0; j < i; j++) {
            const vd_option *b = &vd_render_table[j];
            assert_string_not_equal(a->key, b->key);
            assert_true(a->letter == 0 || a->letter != b->letter);
        }
    }
    /* Every default is a value that the option takes. */
    vd_options options;
    assert_ok(vd_options_init(&options, "render", vd_render_table, OPTION_COUNT));
    vd_options_finish(&options);
}

static void test_numbers(void **state) {
    (void)state;
    double v[3];
    assert_true(vd_read_number("-1.5e3", v) && v[0] == -1500.0);
    assert_false(vd_read_number("", v) || vd_read_number("nan", v) || vd_read_number("inf", v));
    assert_false(vd_read_number("1 ", v) || vd_read_number(" 1", v) || vd_read_number("0x5", v));
    assert_false(vd_read_number("1e999", v) || vd_read_number("1,5", v));
    assert_true(vd_read_distance("20km", v) && v[0] == 20000.0);
    assert_true(vd_read_distance("2m", v) && v[0] == 2.0);
    assert_true(vd_read_distance("100ft", v) && fabs(v[0] - 30.48) < 1e-12);
    assert_true(vd_read_distance("7", v) && v[0] == 7.0);
    assert_false(vd_read_distance("km", v) || vd_read_distance("1mm", v));
    assert_int_equal(vd_read_numbers("1,2,3", v, 3), 3);
    assert_int_equal(vd_read_numbers("1,2", v, 3), 2);
    assert_int_equal(vd_read_numbers("1,2,3,4", v, 3), -1);
    assert_int_equal(vd_read_numbers("1,,3", v, 3), -1);
    const double hard[] = {0.1, 1.0 / 3.0, -1e-300, 57943.106961650097, 0.0, 12345678901234567.0};
    for (size_t i = 0; i < sizeof hard / sizeof hard[0]; i++) {
        char text[32];
        vd_write_number(hard[i], text);
        assert_true(vd_read_number(text, v));
        assert_memory_equal(v, &hard[i], sizeof hard[i]);
    }
}

static void test_nearest_name(void **state) {
    (void)state;
    const char *names[] = {"render", "info", "compare", "bench"};
    assert_string_equal(vd_nearest_name("rendr", names, 4), "render");
    assert_string_equal(vd_nearest_name("ifno", names, 4), "info");
    assert_string_equal(vd_nearest_name("comp", names, 4), "compare");
    assert_null(vd_nearest_name("serve", names, 4));
    assert_null(vd_nearest_name("x", names, 4));
    assert_null(vd_nearest_name("", names, 4));
    char endless[300];
    memset(endless, 'a', sizeof endless - 1);
    endless[sizeof endless - 1] = '\0';
    assert_null(vd_nearest_name(endless, names, 4));
}

static void test_spellings(void **state) {
    (void)state;
    vd_options options;
    vd_render_settings s;
    assert_ok(PARSE(&options, &s, "a.tif", "--size=64x36", "-o", "x.png", "--shadows", "off",
                    "--shading", "b.tif", "--sun", "10,-5", "-q", "--", "--odd"));
    assert_int_equal(s.width, 64);
    assert_int_equal(s.height, 36);
    assert_string_equal(s.output, "x.png");
    assert_false(s.shadows);
    assert_true(s.shading); /* a bare flag means on and takes no file */
    assert_true(s.sun_azimuth == 10.0 && s.sun_altitude == -5.0);
    assert_true(s.quiet);
    assert_int_equal(s.input_count, 3);
    assert_string_equal(s.inputs[1], "b.tif");
    assert_string_equal(s.inputs[2], "--odd");
    vd_options_finish(&options);

    assert_ok(PARSE(&options, &s, "a.tif", "--preset", "fast", "--shadows"));
    assert_int_equal(s.samples, 1);
    assert_true(s.shadows); /* what is given wins over the preset */
    vd_options_finish(&options);

    assert_ok(PARSE(&options, &s, "a.tif", "--background", "#9090E0", "-oy.png"));
    assert_false(s.sky);
    assert_int_equal(s.background.b, 0xE0);
    assert_string_equal(s.output, "y.png");
    vd_options_finish(&options);
}

static void test_camera(void **state) {
    (void)state;
    vd_options options;
    vd_render_settings s;
    assert_ok(PARSE(&options, &s, "a", "--eye", "45.5,-6,2m", "--heading", "90"));
    assert_int_equal(s.camera.spelling, VD_SPELLING_ANGLES);
    assert_int_equal(s.camera.eye.kind, VD_POSITION_ABOVE_GROUND);
    assert_true(s.camera.eye.v[0] == 45.5 && s.camera.eye.v[1] == -6 && s.camera.eye.v[2] == 2);
    vd_options_finish(&options);
    assert_ok(PARSE(&options, &s, "a", "--eye", "45.5,-6,3000masl", "--target", "1,2,3"));
    assert_int_equal(s.camera.spelling, VD_SPELLING_LOOK_AT);
    assert_int_equal(s.camera.eye.kind, VD_POSITION_ABOVE_SEA);
    assert_true(s.camera.eye.v[2] == 3000.0);
    assert_int_equal(s.camera.target.kind, VD_POSITION_WORLD);
    vd_options_finish(&options);
    assert_ok(PARSE(&options, &s, "a", "--target", "45,6", "--distance", "12km"));
    assert_int_equal(s.camera.spelling, VD_SPELLING_ORBIT);
    assert_int_equal(s.camera.target.kind, VD_POSITION_ABOVE_GROUND);
    assert_true(s.camera.distance_m == 12000.0);
    vd_options_finish(&options);

    assert_ok(PARSE(&options, &s, "a", "--eye", "45,366.5,2m"));
    assert_true(s.camera.eye.v[1] == 366.5); /* a scene brings it into its own range */
    vd_options_finish(&options);

    REFUSES("up to 1e15", "a", "--eye", "1e300,0,0");
    REFUSES("up to 1e15", "a", "--target", "45,6,1e300m");
    REFUSES("--eye", "a", "--eye", "45,721,2m");
    REFUSES("--eye", "a", "--eye", "nan,0,0");
    REFUSES("--eye", "a", "--eye", "1,2");
    REFUSES("--eye", "a", "--eye", "95,2,2m");
    REFUSES("--target", "a", "--target", "1");
    REFUSES("needs --eye", "a", "--heading", "3");
    REFUSES("--azimuth", "a", "--eye", "0,0,0", "--azimuth", "3");
    REFUSES("--pitch", "a", "--eye", "0,0,0", "--target", "0,1,0", "--pitch", "3");
    REFUSES("0.001 to 179 degrees", "a", "--fov", "180");
    REFUSES("orthographic", "a", "--eye", "0,0,0", "--pitch", "1", "--projection", "orthographic");
}

static void test_refusals(void **state) {
    (void)state;
    REFUSES("did you mean --size", "a", "--sise", "1x1");
    REFUSES("did you mean --color", "a", "--colour", "x.png");
    REFUSES("`veduta render --help`", "a", "--zzzzzz");
    REFUSES("`veduta render --help`", "a", "-Z");
    REFUSES("needs a value", "a", "--size");
    REFUSES("needs a value", "a", "-o");
    REFUSES("--classic needs a value", "--classic", "--height", "a.png");
    REFUSES("-o needs a value", "a", "-o", "--size=4x4");
    for (int i = 0; i < 7; i++) {
        const char *sizes[] = {"0x5", "5", "5x", "-1x5", "70000x2", "65535x65535", "1x1x1"};
        REFUSES("--size", "a", "--size", sizes[i]);
    }
    REFUSES("give one of 1|4|8", "a", "--samples", "2");
    REFUSES("0 to 1024 threads", "a", "--threads", "-1");
    REFUSES("whole number", "a", "--threads", "1.5");
    REFUSES("neither on nor off", "a", "--shadows=maybe");
    REFUSES("--sun", "a", "--sun", "315");
    REFUSES("--sun", "a", "--sun", "315,91");
    REFUSES("--haze", "a", "--haze", "0");
    REFUSES("--sky", "a", "--sky", "blue");
    REFUSES("--background", "a", "--background", "12345");
    REFUSES("leave out", "a", "--background", "123456", "--sky", "on");
    REFUSES("PNG only", "a", "-o", "x.jpg");
    REFUSES("--depth", "a", "--depth", "x.tif");
    REFUSES("--ids", "a", "--ids", "x.pfm");
    REFUSES("standard output", "a", "-o", "-", "--json");
    REFUSES("raycast", "a", "--method", "fast");
    REFUSES("add --classic", "a", "--method", "scan");
    REFUSES("--colormap", "a", "--color", "c.png", "--colormap", "grey");
    REFUSES("flat", "a", "--height-scale", "0");
    REFUSES("--raw", "a", "--raw", "3x3:u9");
    REFUSES("--bands", "a", "--bands", "0,1,2");
    REFUSES("read once", "-", "-");
    REFUSES("read once", "-", "--color", "-");
    REFUSES("nothing to render", "--size", "1x1");
    REFUSES("--height", "--height", "h.png");
}

static void test_classic(void **state) {
    (void)state;
    vd_options options;
    vd_render_settings s;
    assert_ok(PARSE(&options, &s, "--height", "H.png", "--classic",
                    "x=1,y=2,height=3,yaw=90,horizon=4,scale=5,view=6,distance=7,z0=8,step=9,"
                    "growth=0.5",
                    "--method", "scan", "--background", "010203", "--shading", "off"));
    const vd_classic_def *c = &s.classic_def;
    assert_true(c->x == 1 && c->y == 2 && c->height == 3 && c->horizon == 4 && c->scale == 5);
    assert_true(c->view == 6 && c->distance == 7 && c->z0 == 8 && c->step == 9);
    assert_true(c->growth == 0.5 && fabs(c->yaw_rad - 1.5707963267948966) < 1e-15);
    assert_int_equal(c->background.g, 2);
    assert_int_equal(s.classic_method, VD_CLASSIC_SCAN);
    assert_int_equal(s.width, 700);
    assert_int_equal(s.height, 512);
    vd_options_finish(&options);
    assert_ok(PARSE(&options, &s, "--height", "H.png", "--classic="));
    vd_classic_def published = vd_classic_def_default();
    assert_true(s.classic_def.x == published.x && s.classic_def.step == published.step);
    assert_true(s.classic_def.filter == VD_FILTER_NEAREST && s.classic_def.samples <= 1);
    vd_options_finish(&options);
    assert_ok(PARSE(&options, &s, "--height", "H.png", "--classic=mip=1,smooth=1,x=3", "--filter",
                    "bilinear", "--samples", "8"));
    assert_true(s.classic_def.filter == VD_FILTER_LINEAR && s.classic_def.samples == 8);
    assert_true(s.classic_def.mip && s.classic_def.smooth && s.classic_def.x == 3);
    vd_options_finish(&options);
    assert_ok(PARSE(&options, &s, "--height", "H.png", "--classic", "x=3, y=4"));
    assert_true(s.classic_def.x == 3 && s.classic_def.y == 4);
    vd_options_finish(&options);

    REFUSES("did you mean growth", "--height", "H.png", "--classic", "grwoth=1");
    REFUSES("KEY=NUMBER", "--height", "H.png", "--classic", "x");
    REFUSES("KEY=NUMBER", "--height", "H.png", "--classic", "x=nan");
    REFUSES("smooth=1 or smooth=0", "--height", "H.png", "--classic", "smooth=2");
    REFUSES("only be off", "--height", "H.png", "--classic", "x=1", "--haze", "auto");
    REFUSES("only with --shadows", "--height", "H.png", "--classic", "x=1", "--sun", "90,30");
    REFUSES("below the horizon", "--height", "H.png", "--classic", "x=1", "--sun", "90,-3",
            "--shadows", "count");
    REFUSES("belongs to --classic", "a", "--shadows", "count");
    REFUSES("reference, slices, columns, scan", "--height", "H.png", "--classic", "x=1", "--method",
            "raycast");
    REFUSES("name one", "a", "--height", "H.png", "--classic", "x=1");
}

static vd_status read_json(vd_options *options, vd_render_settings *settings, const char *text,
                           const char *folder) {
    assert_ok(vd_options_init(options, "render", vd_render_table, OPTION_COUNT));
    vd_status status = vd_options_read_json(options, text, strlen(text), "o.json", folder);
    if (status.code == VD_OK) {
        status = vd_render_settings_read(options, settings);
    }
    return status;
}

static void test_json(void **state) {
    (void)state;
    vd_options options;
    vd_render_settings s;
    assert_ok(read_json(&options, &s,
                        "{\"veduta\": \"0.1.0\", \"inputs\": [\"a.hgt\", \"/b.hgt\"], "
                        "\"sun\": [90, 10.5], \"fov\": 0.1, \"shadows\": false, \"output\": "
                        "\"out/v.png\", \"colormap\": \"viridis\", \"samples\": 8, "
                        "\"allow-empty\": true, \"near\": \"2km\"}",
                        "folder"));
    assert_int_equal(s.input_count, 2);
    assert_string_equal(s.inputs[0], "folder/a.hgt"); /* paths start from the file */
    assert_string_equal(s.inputs[1], "/b.hgt");
    assert_string_equal(s.output, "folder/out/v.png");
    assert_string_equal(s.colormap, "viridis"); /* a name is no path */
    assert_true(s.sun_altitude == 10.5 && s.camera.fov == 0.1 && s.camera.near_m == 2000.0);
    assert_false(s.shadows);
    assert_true(s.allow_empty);
    assert_int_equal(s.samples, 8);
    /* Flags win over files, whichever comes first. */
    assert_ok(vd_options_set(&options, OPTION_FOV, "50", VD_SOURCE_FLAG));
    assert_ok(vd_options_set(&options, OPTION_FOV, "60", VD_SOURCE_FILE));
    assert_true(options.values[OPTION_FOV].number == 50.0);
    vd_options_finish(&options);

    /* A flag replaces what the file says in another spelling, and no more than that. */
    assert_ok(read_json(&options, &s,
                        "{\"veduta\": \"99.1\", \"inputs\": [\"a\"], \"azimuth\": 3, "
                        "\"target\": [1, 2, 3], \"roll\": 5, \"colormap\": \"grey\"}",
                        ""));
    assert_non_null(strstr(options.note, "99.1, which is newer"));
    assert_ok(vd_options_set(&options, OPTION_EYE, "1,2,9", VD_SOURCE_FLAG));
    assert_ok(vd_options_set(&options, OPTION_COLOR, "c.png", VD_SOURCE_FLAG));
    assert_ok(vd_render_prefer_flags(&options));
    assert_ok(vd_render_settings_read(&options, &s));
    assert_int_equal(s.camera.spelling, VD_SPELLING_LOOK_AT);
    assert_true(s.camera.target.v[2] == 3.0 && s.camera.roll == 5.0 && s.camera.azimuth == 0.0);
    assert_ok(vd_options_set(&options, OPTION_HEADING, "7", VD_SOURCE_FLAG));
    assert_ok(vd_render_prefer_flags(&options));
    assert_ok(vd_render_settings_read(&options, &s));
    assert_int_equal(s.camera.spelling, VD_SPELLING_ANGLES);
    vd_options_finish(&options);
    assert_ok(read_json(&options, &s, "{\"veduta\": \"0.1.9\", \"inputs\": [\"a\"]}", ""));
    assert_string_equal(options.note, ""); /* the third number changes no meaning */
    vd_options_finish(&options);

    static const struct {
        const char *text, *part;
        vd_code code;
    } bad[] = {
        {"", "o.json", VD_ERROR_FORMAT},
        {"{\"veduta\":1,", "line 1", VD_ERROR_FORMAT},
        {"[1]", "not an options file", VD_ERROR_FORMAT},
        {"{\"size\": \"1x1\"}", "not an options file", VD_ERROR_FORMAT},
        {"{\"veduta\":1,\"veduta\":2}", "duplicate", VD_ERROR_FORMAT},
        {"{\"veduta\":1,\"sise\":\"1x1\"}", "did you mean \"size\"", VD_ERROR_ARGUMENT},
        {"{\"veduta\":1,\"input\":\"a\"}", "did you mean \"inputs\"", VD_ERROR_ARGUMENT},
        {"{\"veduta\":1,\"inputs\":\"a\"}", "not a list", VD_ERROR_ARGUMENT},
        {"{\"veduta\":1,\"inputs\":[1]}", "item 1", VD_ERROR_ARGUMENT},
        {"{\"veduta\":1,\"fov\":null}", "\"fov\"", VD_ERROR_ARGUMENT},
        {"{\"veduta\":1,\"fov\":[[1]]}", "\"fov\"", VD_ERROR_ARGUMENT},
        {"{\"veduta\":1,\"fov\":1000}", "0.001 to 179 degrees", VD_ERROR_ARGUMENT},
        {"{\"veduta\":1,\"inputs\":[\"a\"],\"size\":\"0x5\"}", "--size", VD_ERROR_ARGUMENT},
        {"{\"veduta\":1,\"save\":\"x.json\"}", "\"save\"", VD_ERROR_ARGUMENT},
    };
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        vd_status status = read_json(&options, &s, bad[i].text, "");
        assert_int_equal(status.code, bad[i].code);
        if (strstr(status.message, bad[i].part) == NULL) {
            fail_msg("\"%s\" lacks \"%s\"", status.message, bad[i].part);
        }
        vd_options_finish(&options);
    }
}

/* What --save writes leads, read back, to the same values. */
static void test_save(void **state) {
    (void)state;
    char folder[] = VEDUTA_BINARY_DIR "/test-options-XXXXXX";
    char path[512], nowhere[512];
    assert_non_null(mkdtemp(folder));
    snprintf(path, sizeof path, "%s/saved.json", folder);
    vd_options options, again;
    vd_render_settings s, t;
    assert_ok(PARSE(&options, &s, "/data/a.tif", "b.tif", "--sun", "91.1,10", "--fov",
                    "0.1234567890123456", "--shadows", "off", "--colormap", "grey", "--near", "2km",
                    "--threads", "3", "--json", "--size", "10x20"));
    assert_ok(vd_options_save_json(&options, path));
    assert_ok(vd_options_init(&again, "render", vd_render_table, OPTION_COUNT));
    assert_ok(vd_options_load_json(&again, path));
    assert_ok(vd_render_settings_read(&again, &t));
    assert_true(t.camera.fov == s.camera.fov && t.sun_azimuth == s.sun_azimuth);
    assert_true(t.camera.near_m == s.camera.near_m && t.shadows == s.shadows);
    assert_int_equal(t.width, 10);
    assert_int_equal(t.threads, 3);
    assert_int_equal(t.input_count, 2);
    assert_string_equal(t.inputs[0], "/data/a.tif");
    assert_int_equal(t.inputs[1][0], '/'); /* relative to where the command ran */
    assert_false(t.json);                  /* about the run, not the picture */
    vd_options_finish(&again);
    snprintf(nowhere, sizeof nowhere, "%s/none/saved.json", folder);
    assert_int_equal(vd_options_save_json(&options, nowhere).code, VD_ERROR_IO);
    assert_int_equal(vd_options_load_json(&options, nowhere).code, VD_ERROR_IO);
    vd_options_finish(&options);
    remove(path);
    assert_int_equal(rmdir(folder), 0); /* nothing was left beside */
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_table),        cmocka_unit_test(test_numbers),
        cmocka_unit_test(test_nearest_name), cmocka_unit_test(test_spellings),
        cmocka_unit_test(test_camera),       cmocka_unit_test(test_refusals),
        cmocka_unit_test(test_classic),      cmocka_unit_test(test_json),
        cmocka_unit_test(test_save),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

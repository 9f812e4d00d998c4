/* test_app_world.c: world files and --save-world from outside. */
#include "app_support.h"

#include <sys/stat.h>
#include <unistd.h>
#include <veduta/world.h>

#define WORLDS VEDUTA_SOURCE_DIR "/example/worlds"
#define DATA VEDUTA_SOURCE_DIR "/data"
#define MODELS VEDUTA_SOURCE_DIR "/test/models"
#define VECTORS VEDUTA_SOURCE_DIR "/test/vectors"

/* Renders and gives the hash. */
static void renders(const char *environment, const char *arguments, char hash[17]) {
    char line[1024];
    (void)snprintf(line, sizeof line, "render -j -o x.png %s", arguments);
    if (run(environment, line) != 0) {
        fail_msg("%s: %s", arguments, err);
    }
    const char *at = strstr(out, "\"hash\": \"");
    assert_non_null(at);
    memcpy(hash, at + 9, 16);
    hash[16] = '\0';
}

static void renders_as(const char *environment, const char *arguments, const char *expected) {
    char hash[17];
    renders(environment, arguments, hash);
    if (strcmp(hash, expected) != 0) {
        fail_msg("%s %s: hash %s, not %s", environment, arguments, hash, expected);
    }
}

/* The number behind a key of the last run's JSON. */
static long number_of(const char *key) {
    char quoted[64];
    (void)snprintf(quoted, sizeof quoted, "\"%s\": ", key);
    const char *at = strstr(out, quoted);
    return at != NULL ? strtol(at + strlen(quoted), NULL, 10) : -1;
}

/* Expects the status, and a last line on standard error that holds both parts; no picture. */
static void fails(int status, const char *part, const char *other, const char *arguments) {
    (void)unlink("x.png");
    const int got = run("", arguments);
    if (got != status || strstr(err, part) == NULL || strstr(err, other) == NULL) {
        fail_msg("%s: status %d, %s, not \"%s\" and \"%s\"", arguments, got, err, part, other);
    }
    assert_int_equal(strncmp(err, "veduta: ", 8), 0);
    assert_ptr_equal(strchr(err, '\n'), err + strlen(err) - 1);
    assert_int_not_equal(access("x.png", F_OK), 0);
}

/* A world whose heights are the Mont Blanc picture, with `more` behind them. */
static const char *world(const char *more) {
    static char text[4096];
    (void)snprintf(text, sizeof text,
                   "{\"veduta_world\": 1, \"picture\": {\"size\": \"160x90\"},\n"
                   " \"terrain\": {\"heights\": \"" DATA
                   "/mont-blanc.png\", \"cell_size\": 75}%s%s}",
                   more[0] != '\0' ? ",\n " : "", more);
    return text;
}

static bool has_geo(void) {
    return run("", "info " DATA "/mont-blanc.tif") == 0;
}

static bool has_text(void) {
    write_file("t.json", world("\"title\": \"t\""));
    return run("", "render -q t.json -o t.png") == 0;
}

/* ---- pictures ---------------------------------------------------------------------------------*/

/* The examples without text; their hashes are part of the product. */
static void test_examples(void **state) {
    (void)state;
    static const struct {
        const char *arguments, *hash;
        long drawn;
    } pictures[] = {
        {WORLDS "/village.json -s 480x270", "8d09067dea885c49", 21},
        {WORLDS "/village.json -s 480x270 --camera above", "d827013eb97bbb75", 21},
        {WORLDS "/models.json", "976f378d11bcc739", 8},
        {WORLDS "/dunes.json", "18e684e970d6159f", 6},
    };
    const bool reduced = test_is_reduced();
    for (size_t i = 0; i < sizeof pictures / sizeof pictures[0]; i++) {
        char line[512];
        (void)snprintf(line, sizeof line, "%s --threads 3", pictures[i].arguments);
        renders_as("", line, pictures[i].hash);
        assert_non_null(strstr(out, "\"warnings\": []"));
        assert_int_equal(number_of("drawn"), pictures[i].drawn);
        if (!reduced) {
            renders_as("", pictures[i].arguments, pictures[i].hash);
        }
        for (int isa = VD_ISA_V2; isa <= (int)vd_isa_best() && !reduced; isa++) {
            char environment[32];
            (void)snprintf(environment, sizeof environment, "VEDUTA_CPU=%s",
                           vd_isa_name((vd_isa)isa));
            renders_as(environment, pictures[i].arguments, pictures[i].hash);
        }
    }
}

static void test_example_with_text(void **state) {
    (void)state;
    if (!has_geo() || !has_text()) {
        skip();
    }
    char one[17], other[17];
    renders("", WORLDS "/mont-blanc.json -s 480x270", one);
    assert_non_null(strstr(out, "\"warnings\": []"));
    assert_int_equal(number_of("labels"), 11 - number_of("outside"));
    assert_true(number_of("labels_shown") >= 3);
    renders("", WORLDS "/mont-blanc.json -s 480x270 --threads 1", other);
    assert_string_equal(one, other);
    renders("", WORLDS "/mont-blanc.json -s 480x270 --camera map", other);
    assert_true(number_of("labels_shown") >= 5);
    assert_string_not_equal(one, other);
}

/* A world with nothing but heights is the picture of the heights. */
static void test_terrain_alone(void **state) {
    (void)state;
    char one[17];
    renders("", DATA "/mont-blanc.png --cell-size 75 -s 160x90", one);
    write_file("w.json", world(""));
    renders_as("", "w.json", one);
    assert_null(strstr(out, "\"objects\""));
    /* Flags win over the file, and over its camera where they spell another. */
    renders("", DATA "/mont-blanc.png --cell-size 75 -s 80x45 --sun 90,10 --azimuth 90", one);
    write_file("w.json", world("\"sun\": [315, 45], \"camera\": \"c\",\n \"cameras\": {\"c\": "
                               "{\"eye\": [0, 0, 9000], \"heading\": 3}}"));
    renders_as("", "w.json -s 80x45 --sun 90,10 --azimuth 90", one);
    /* An input of the command line replaces the heights. */
    write_file("h.json", "{\"veduta_world\": 1, \"terrain\": {\"heights\": \"gone.png\"}}");
    renders("", DATA "/mont-blanc.png -s 80x45", one);
    renders_as("", "h.json " DATA "/mont-blanc.png -s 80x45", one);
    /* An options file is still one. */
    write_file("o.json", "{\"veduta\": \"0.1.0\", \"inputs\": [\"" DATA
                         "/mont-blanc.png\"], \"size\": \"80x45\"}");
    renders_as("", "o.json", one);
}

/* What the flags said, saved and drawn again. */
static void test_save(void **state) {
    (void)state;
    static const char *const flags[] = {
        "--cell-size 75 --sun 90,10 --exaggerate 1.5 --haze 30km -s 160x90",
        "--cell-size 75 --azimuth 33 --elevation 20 --samples 8 --colormap viridis -s 160x90",
        "--cell-size 75 --sky 80A0FF --shadows off --projection orthographic --preset fast -s "
        "160x90",
        "--cell-size 75 --eye 20000,-30000,9000 --target 24000,-18000,4000 --fov 30 --background "
        "FFFFFF -s 160x90",
    };
    char line[1024], hash[17];
    assert_int_equal(mkdir("sub", 0755), 0);
    for (size_t i = 0; i < sizeof flags / sizeof flags[0]; i++) {
        (void)snprintf(line, sizeof line, DATA "/mont-blanc.png %s --save-world sub/s.json",
                       flags[i]);
        renders("", line, hash);
        renders_as("", "sub/s.json", hash);
    }
    char saved[4096];
    read_back("sub/s.json", saved, sizeof saved);
    assert_non_null(strstr(saved, "\"background\": \"FFFFFF\""));
    assert_non_null(strstr(saved, "\"camera\": \"main\""));
    assert_int_equal(system(VEDUTA_SOURCE_DIR "/script/check-worlds sub/s.json >schema.txt"), 0);
    /* A world is saved with all that it has, its paths moved. */
    renders("",
            WORLDS "/village.json -s 240x135 --camera above --sun 90,20 --save-world sub/v.json",
            hash);
    renders_as("", "sub/v.json", hash);
    assert_int_equal(number_of("drawn"), 21);
    assert_int_equal(system(VEDUTA_SOURCE_DIR "/script/check-worlds sub/v.json >schema.txt"), 0);
    char again[17];
    renders("", WORLDS "/village.json -s 240x135 --camera hill --sun 90,20", again);
    renders_as("", "sub/v.json --camera hill", again);
    fails(2, "--save-world", "model", "render " MODELS "/cube.obj --save-world x.json -o x.png");
    fails(2, "--save-world", "--save", "render " WORLDS "/models.json --save x.json -o x.png");
    if (has_geo() && has_text()) {
        renders("",
                DATA "/mont-blanc.tif --sun 90,10 --label-peaks 5 --lines " VECTORS "/walk.gpx"
                     " --labels " WORLDS "/places.geojson --title Massif --north-arrow"
                     " --scale-bar --legend -s 320x180 --save-world sub/t.json",
                hash);
        renders_as("", "sub/t.json", hash);
        assert_int_equal(number_of("labels") > 0, 1);
    }
}

#define MIDDLE "24000,-17000,4500"

/* Particles over the ground: seen, beside the ground's own picture; saved with the world. */
static void test_particles(void **state) {
    (void)state;
    char bare[17], plain[17], hash[17];
    assert_int_equal(
        run("", "generate particles -n 20000 --center " MIDDLE " --size 8km -o cloud.vdp"), 0);
    write_file("w.json", world(""));
    renders("", "w.json", bare);
    write_file("w.json", world("\"particles\": [{\"file\": \"cloud.vdp\"}]"));
    renders("", "w.json", plain);
    assert_string_not_equal(bare, plain);
    assert_int_equal(number_of("count"), 2);
    assert_int_equal(number_of("particles_for"), 20000);
    assert_true(number_of("particles") > 1000);
    renders_as("VEDUTA_CPU=v2", "w.json --threads 3", plain);
    write_file("w.json", world("\"particles\": [{\"file\": \"cloud.vdp\", \"most_particles\": "
                               "1000, \"color\": \"FF8000\", \"opacity\": 0.5, \"radius\": 30, "
                               "\"kernel\": \"gaussian\", \"detail\": 0}]"));
    renders("", "w.json", hash);
    assert_string_not_equal(hash, plain);
    assert_true(number_of("count") > 5);
    assert_int_equal(number_of("particles"), 20000);
    renders("", "w.json --save-world sub/p.json", hash);
    renders_as("", "sub/p.json", hash);
    assert_int_equal(system(VEDUTA_SOURCE_DIR "/script/check-worlds sub/p.json >schema.txt"), 0);
    /* Numbers by a map, of its own or of a file. */
    write_file("map.txt", "0 255 0 0\n100 0 0 255\n");
    write_file("w.json", world("\"particles\": [{\"file\": \"cloud.vdp\", \"color_by\": "
                               "\"speed\", \"colormap\": \"map.txt\", \"range\": [0.01, 2], "
                               "\"log\": true, \"radius_scale\": 0.5}]"));
    renders("", "w.json --save-world sub/p.json", hash);
    renders_as("", "sub/p.json", hash);
    write_file("w.json", world("\"particles\": [{\"file\": \"cloud.vdp\", \"color_by\": "
                               "\"speed\", \"colormap\": \"magma\"}]"));
    renders("", "w.json --save-world sub/p.json", hash);
    renders_as("", "sub/p.json", hash);
    /* Without terrain they are framed. */
    write_file("w.json", "{\"veduta_world\": 1, \"particles\": [{\"file\": \"cloud.vdp\"}]}");
    renders("", "w.json -s 160x90", hash);
    assert_int_equal(number_of("drawn"), 1);
    /* A key that is not known is warned of. */
    write_file("w.json", world("\"particles\": [{\"file\": \"cloud.vdp\", \"colour\": 3}]"));
    renders_as("", "w.json", plain);
    assert_non_null(strstr(out, "there is no key \\\"colour\\\" (did you mean \\\"color\\\"?)"));
}

static void test_bad_particles(void **state) {
    (void)state;
    static const struct {
        const char *part, *other, *more;
    } bad[] = {
        {"w.json: particles: ", "not a list", "\"particles\": {}"},
        {"particles[0].file", "missing", "\"particles\": [{}]"},
        {"particles[0].file", "gone.vdp", "\"particles\": [{\"file\": \"gone.vdp\"}]"},
        {"particles[0].file", "import particles", "\"particles\": [{\"file\": \"w.json\"}]"},
#define CLOUD "\"particles\": [{\"file\": \"cloud.vdp\", "
        {"particles[0].color_by", "did you mean \"speed\"", CLOUD "\"color_by\": \"sped\"}]"},
        {"particles[0].color_by", "no attribute \"rgb\"", CLOUD "\"color_by\": \"rgb\"}]"},
        {"particles[0].color", "RRGGBB", CLOUD "\"color\": \"red\"}]"},
        {"particles[0].color", "both", CLOUD "\"color\": \"FF0000\", \"color_by\": \"class\"}]"},
        {"particles[0].color", "both", CLOUD "\"color\": \"FF0000\", \"colormap\": \"magma\"}]"},
        {"particles[0].colormap", "gone.cpt", CLOUD "\"colormap\": \"gone.cpt\"}]"},
        {"particles[0].range", "rising", CLOUD "\"range\": [2, 1]}]"},
        {"particles[0].range", "above 0", CLOUD "\"range\": [0, 1], \"log\": true}]"},
        {"particles[0].range", "list of 2 numbers", CLOUD "\"range\": \"auto\"}]"},
        {"particles[0].log", "true nor false", CLOUD "\"log\": 1}]"},
        {"particles[0].radius", "number", CLOUD "\"radius\": -1}]"},
        {"particles[0].radius_scale", "number", CLOUD "\"radius_scale\": 0}]"},
        {"particles[0].opacity", "number", CLOUD "\"opacity\": 2}]"},
        {"particles[0].detail", "number", CLOUD "\"detail\": -1}]"},
        {"particles[0].most_particles", "number", CLOUD "\"most_particles\": 0}]"},
        {"particles[0].kernel", "none of", CLOUD "\"kernel\": \"star\"}]"},
#undef CLOUD
    };
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        write_file("w.json", world(bad[i].more));
        fails(1, bad[i].part, bad[i].other, "render w.json -o x.png");
    }
}

/* Many instances of one mesh: one asset, and the same picture as objects one by one. */
static void test_instances(void **state) {
    (void)state;
    char hash[17];
    write_file("one.json", world("\"objects\": [\n"
                                 "{\"mesh\": \"" MODELS
                                 "/cube.obj\", \"position\": [24000, -12000], \"scale\": "
                                 "900, \"heading\": 20},\n"
                                 "{\"mesh\": \"" MODELS
                                 "/cube.obj\", \"position\": [30000, -20000], \"scale\": "
                                 "450, \"heading\": -30}]"));
    write_file("two.json",
               world("\"objects\": [{\"mesh\": \"" MODELS "/cube.obj\", \"scale\": 900,\n"
                     "\"instances\": [[24000, -12000, 20], [30000, -20000, -30, 0.5]]}]"));
    renders("", "one.json", hash);
    assert_int_equal(number_of("drawn"), 3); /* with the terrain */
    renders_as("", "two.json", hash);
    FILE *file = fopen("many.json", "wb");
    assert_non_null(file);
    const int count = test_is_reduced() ? 5000 : 200000;
    (void)fprintf(file, "{\"veduta_world\": 1, \"terrain\": {\"heights\": \"" DATA
                        "/mont-blanc.png\", \"cell_size\": 75},\n\"objects\": [{\"mesh\": \"" MODELS
                        "/cube.obj\", \"instances\": [");
    uint64_t random = 1;
    for (int i = 0; i < count; i++) {
        random = random * 6364136223846793005u + 1442695040888963407u;
        const double x = 100.0 + (double)(random >> 40 & 0xFFFF) * 0.7;
        const double y = -100.0 - (double)(random >> 20 & 0xFFFF) * 0.6;
        (void)fprintf(file, "%s[%.1f,%.1f,%d,3]", i > 0 ? ",\n" : "", x, y, i % 360);
    }
    (void)fputs("]}]}", file);
    assert_int_equal(fclose(file), 0);
    renders("", "many.json -s 160x90 --samples 1", hash);
    assert_int_equal(number_of("count"), count + 1);
    if (run("", "render many.json -s 160x90 --dry-run") != 0) {
        fail_msg("%s", err);
    }
    assert_non_null(strstr(out, "MiB of memory"));
}

/* Heights, scale, anchor: one cube said in several ways. */
static void test_places(void **state) {
    (void)state;
    char hash[17];
    static const char *const same[] = {
        "\"height\": \"ground\", \"scale\": [500, 500, 500]",
        "\"height\": {\"above_ground\": 0}, \"scale\": 500, \"up\": \"y\"",
        "\"heading\": 360, \"scale\": 500, \"shadows\": true, \"anchor\": \"origin\"",
    };
    char text[1024];
    for (size_t i = 0; i < sizeof same / sizeof same[0]; i++) {
        (void)snprintf(text, sizeof text,
                       "\"objects\": [{\"mesh\": \"" MODELS
                       "/cube.obj\", \"position\": [24000, -12000], %s}]",
                       same[i]);
        write_file("w.json", world(text));
        if (i == 0) {
            renders("", "w.json", hash);
        } else {
            renders_as("", "w.json", hash);
        }
    }
    if (!has_geo()) {
        return;
    }
    /* Longitude and latitude, and a file of points with one on the map and one off it. */
    write_file("p.geojson", "{\"type\": \"FeatureCollection\", \"features\": [\n"
                            "{\"type\": \"Feature\", \"properties\": {}, \"geometry\": {\"type\": "
                            "\"Point\", \"coordinates\": [6.88, 45.9]}},\n"
                            "{\"type\": \"Feature\", \"properties\": {}, \"geometry\": {\"type\": "
                            "\"Point\", \"coordinates\": [9, 45.9]}}]}");
    write_file("at.json", "{\"veduta_world\": 1, \"terrain\": {\"heights\": \"" DATA
                          "/mont-blanc.tif\"}, \"objects\": [{\"mesh\": \"" MODELS
                          "/cube.obj\", \"at\": [6.88, 45.9], \"scale\": 900}]}");
    write_file("in.json", "{\"veduta_world\": 1, \"terrain\": {\"heights\": \"" DATA
                          "/mont-blanc.tif\"}, \"objects\": [{\"mesh\": \"" MODELS
                          "/cube.obj\", \"instances\": \"p.geojson\", \"scale\": 900}]}");
    renders("", "at.json -s 160x90", hash);
    renders_as("", "in.json -s 160x90", hash);
    assert_non_null(strstr(err, "1 of 2 points are off the map"));
}

/* ---- sentences --------------------------------------------------------------------------------*/

static void test_unknown_keys(void **state) {
    (void)state;
    char hash[17];
    write_file("w.json",
               "{\"veduta_world\": 1, \"terrian\": {}, \"skyy\": \"on\",\n"
               " \"objects\": [{\"mesh\": \"" MODELS "/cube.obj\", \"position\": [0, 0],\n"
               " \"headin\": 3}], \"cameras\": {\"c\": {\"azimut\": 3}}, \"camera\": \"c\"}");
    renders("", "w.json -s 64x36", hash);
    assert_non_null(strstr(err, "w.json: there is no key \"terrian\" (did you mean \"terrain\"?)"));
    assert_non_null(strstr(err, "\"skyy\" (did you mean \"sky\"?)"));
    assert_non_null(
        strstr(err, "objects[0]: there is no key \"headin\" (did you mean \"heading\"?)"));
    assert_non_null(strstr(err, "cameras.c: there is no key \"azimut\""));
    assert_non_null(strstr(out, "terrian"));
}

#define CUBE "\"mesh\": \"" MODELS "/cube.obj\""
#define HERE "\"position\": [24000, -12000]"

static void test_bad_worlds(void **state) {
    (void)state;
    static const struct {
        int status;
        const char *part, *other, *more;
    } bad[] = {
        {1, "w.json: objects: ", "not a list", "\"objects\": {}"},
        {1, "w.json: objects[0]: ", "not an object", "\"objects\": [3]"},
        {1, "objects[0].mesh", "missing", "\"objects\": [{" HERE "}]"},
        {1, "objects[0].mesh", "gone.obj", "\"objects\": [{\"mesh\": \"gone.obj\", " HERE "}]"},
        {1, "objects[0].mesh", "not named", "\"objects\": [{\"mesh\": \"w.json\", " HERE "}]"},
        {1, "objects[0]: ", "no place", "\"objects\": [{" CUBE "}]"},
        {1, "objects[1].position", "off the map",
         "\"objects\": [{" CUBE ", " HERE "}, {" CUBE ", \"position\": [1, 5]}]"},
        {1, "objects[0].position", "list of 2 numbers",
         "\"objects\": [{" CUBE ", \"position\": [1, \"NaN\"]}]"},
        {1, "objects[0].position", "no place",
         "\"objects\": [{" CUBE ", \"position\": [1e300, 0]}]"},
        {1, "objects[0].at", "georeference", "\"objects\": [{" CUBE ", \"at\": [6.8, 45.9]}]"},
        {1, "objects[0].at", "no place", "\"objects\": [{" CUBE ", \"at\": [6.8, 95]}]"},
        {1, "objects[0].at", "both", "\"objects\": [{" CUBE ", " HERE ", \"at\": [6.8, 45]}]"},
        {1, "objects[0].height", "altitude", "\"objects\": [{" CUBE ", " HERE ", \"height\": 3}]"},
        {1, "objects[0].height.altitude", "not a number",
         "\"objects\": [{" CUBE ", " HERE ", \"height\": {\"altitude\": \"x\"}}]"},
        {1, "objects[0].scale", "number",
         "\"objects\": [{" CUBE ", " HERE ", \"scale\": \"big\"}]"},
        {1, "objects[0].scale", "factor",
         "\"objects\": [{" CUBE ", " HERE ", \"scale\": [1, 0, 1]}]"},
        {1, "objects[0].up", "auto|y|z", "\"objects\": [{" CUBE ", " HERE ", \"up\": \"x\"}]"},
        {1, "objects[0].instances", "item 2",
         "\"objects\": [{" CUBE ", \"instances\": [[24000, -12000], [1]]}]"},
        {1, "objects[0].instances", "item 2: 5, 5 is off the map",
         "\"objects\": [{" CUBE ", \"instances\": [[24000, -12000], [5, 5]]}]"},
        {1, "objects[0].instances", "both",
         "\"objects\": [{" CUBE ", " HERE ", \"instances\": [[24000, -12000]]}]"},
        {1, "sprites[0].height_m", "missing",
         "\"sprites\": [{\"picture\": \"" MODELS "/cube.png\", " HERE "}]"},
        {1, "sprites[0].picture", "gone.png",
         "\"sprites\": [{\"picture\": \"gone.png\", " HERE ", \"height_m\": 3}]"},
        {1, "lines[0]: ", "one thing", "\"lines\": [{\"color\": \"FF0000\"}]"},
        {1, "lines[0].points", "two points", "\"lines\": [{\"points\": [[1, 2]]}]"},
        {1, "lines[0]: ", "on the map", "\"lines\": [{\"points\": [[1, 2], [3, 4]]}]"},
        {1, "lines[0].color", "RRGGBB",
         "\"lines\": [{\"points\": [[1, -2], [3, -4]], \"color\": \"red\"}]"},
        {1, "lines[0].width", "0.1 to 64",
         "\"lines\": [{\"points\": [[1, -2], [3, -4]], \"width\": 0}]"},
        {1, "lines[0]: ", "points on the ground",
         "\"lines\": [{\"points\": [[1, -2], [1e10, -4]]}]"},
        {1, "labels[0]: ", "no place", "\"labels\": [{\"text\": \"x\"}]"},
        {1, "labels[0]: ", "one thing", "\"labels\": [{" HERE "}]"},
        {1, "labels[0].hidden", "hide|show",
         "\"labels\": [{\"text\": \"x\", " HERE ", \"hidden\": true}]"},
        {1, "labels[0].position", "off the map",
         "\"labels\": [{\"text\": \"x\", \"position\": [5, 5]}]"},
        {1, "w.json: labels.peaks: ", "whole number", "\"labels\": [{\"peaks\": \"all\"}]"},
        {1, "w.json: sun: ", "neither", "\"sun\": [[1], 2]"},
        {1, "w.json: --sun", "direction", "\"sun\": \"east\""},
        {1, "w.json: shadows: ", "neither on nor off", "\"shadows\": \"some\""},
        {1, "w.json: camera", "no camera \"d\"", "\"cameras\": {\"c\": {}}, \"camera\": \"d\""},
        {1, "w.json: cameras.c.fov: ", "out of range",
         "\"cameras\": {\"c\": {\"fov\": 200}}, \"camera\": \"c\""},
        {1, "w.json: cameras", "not an object", "\"cameras\": []"},
        {1, "w.json: cameras.c", "not an object", "\"cameras\": {\"c\": 3}"},
    };
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        write_file("w.json", world(bad[i].more));
        fails(bad[i].status, bad[i].part, bad[i].other, "render w.json -o x.png");
    }
}

static void test_bad_files(void **state) {
    (void)state;
    static const struct {
        int status;
        const char *part, *other, *text;
    } bad[] = {
        {1, "w.json: veduta_world", "not a version", "{\"veduta_world\": \"1\"}"},
        {1, "w.json: veduta_world", "newer veduta", "{\"veduta_world\": 2}"},
        {1, "w.json: there is nothing in it", "terrain", "{\"veduta_world\": 1}"},
        {1, "w.json: terrain", "not an object", "{\"veduta_world\": 1, \"terrain\": \"x.png\"}"},
        {1, "terrain.heights", "neither", "{\"veduta_world\": 1, \"terrain\": {\"heights\": 3}}"},
        {1, "terrain.heights", "item 2",
         "{\"veduta_world\": 1, \"terrain\": {\"heights\": [\"a.png\", 3]}}"},
        {1, "gone.png", "cannot read",
         "{\"veduta_world\": 1, \"terrain\": {\"heights\": \"gone.png\"}}"},
        {1, "w.json: terrain.exaggeration", "out of range",
         "{\"veduta_world\": 1, \"terrain\": {\"exaggeration\": -1}}"},
        {1, "line 1, column", "correct the JSON", "{\"veduta_world\": 1, \"sun\": [NaN, 3]}"},
        {1, "line 1, column", "correct the JSON", "{\"veduta_world\": 1, \"sun\": [1e999, 3]}"},
        {1, "line 1, column", "duplicate", "{\"veduta_world\": 1, \"sun\": 1, \"sun\": 1}"},
        {2, "dragon.ply is a model", "objects",
         "{\"veduta_world\": 1, \"terrain\": {\"heights\": \"dragon.ply\"}}"},
    };
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        write_file("w.json", bad[i].text);
        fails(bad[i].status, bad[i].part, bad[i].other, "render w.json -o x.png");
    }
    write_file("w.json", world("\"cameras\": {\"north\": {}}"));
    write_file("v.json", world(""));
    fails(2, "both worlds", "v.json", "render w.json v.json -o x.png");
    fails(2, "--camera", "did you mean north", "render w.json --camera nort -o x.png");
    fails(2, "--camera", "none", "render " DATA "/mont-blanc.png --camera c -o x.png");
    fails(2, "--classic", "world", "render w.json --classic x=1 -o x.png");
    fails(2, "--legend", "--color",
          "render w.json --legend --color " DATA "/mont-blanc.png -o x.png");
}

/* Vector files that hold little or nothing. */
static void test_bad_vectors(void **state) {
    (void)state;
    static const struct {
        const char *part, *other, *more;
    } bad[] = {
        {"w.json: lines[0]", "gone.gpx", "\"lines\": [{\"file\": \"gone.gpx\"}]"},
        {"w.json: lines[0]", "empty.gpx", "\"lines\": [{\"file\": \"" VECTORS "/empty.gpx\"}]"},
        {"w.json: lines[0]", "no line of two points", "\"lines\": [{\"file\": \"point.gpx\"}]"},
        {"w.json: lines[0]", "no line on the map", "\"lines\": [{\"file\": \"away.gpx\"}]"},
        {"w.json: labels[0]", "nothing with a name", "\"labels\": [{\"file\": \"point.gpx\"}]"},
        {"w.json: labels[0]", "nmae",
         "\"labels\": [{\"file\": \"" VECTORS "/places.geojson\", \"property\": \"nmae\"}]"},
        {"w.json: objects[0].instances", "no points",
         "\"objects\": [{" CUBE ", \"instances\": \"away.gpx\"}]"},
    };
    if (!has_geo()) {
        skip();
    }
    write_file("point.gpx", "<gpx version=\"1.1\" creator=\"t\"><trk><trkseg>"
                            "<trkpt lat=\"45.9\" lon=\"6.9\"/></trkseg></trk></gpx>");
    write_file("away.gpx", "<gpx version=\"1.1\" creator=\"t\"><trk><trkseg>"
                           "<trkpt lat=\"5\" lon=\"6\"/><trkpt lat=\"6\" lon=\"6\"/>"
                           "</trkseg></trk></gpx>");
    char text[1024];
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        (void)snprintf(text, sizeof text,
                       "{\"veduta_world\": 1, \"terrain\": {\"heights\": \"" DATA
                       "/mont-blanc.tif\"}, %s}",
                       bad[i].more);
        write_file("w.json", text);
        fails(1, bad[i].part, bad[i].other, "render w.json -o x.png");
    }
    fails(1, "--lines", "gone.gpx", "render " DATA "/mont-blanc.tif --lines gone.gpx -o x.png");
    fails(1, "--lines", "georeference",
          "render " DATA "/mont-blanc.png --lines " VECTORS "/walk.gpx -o x.png");
    /* A track without heights lies on the ground like any other. */
    char hash[17];
    renders("", DATA "/mont-blanc.tif -s 64x36 --lines " VECTORS "/flat.gpx", hash);
    assert_int_equal(number_of("drawn"), 2);
}

static char folder[] = VEDUTA_BINARY_DIR "/test-app-world-XXXXXX";

static int enter_folder(void **state) {
    (void)state;
    return test_enter_folder(folder);
}

static int leave_folder(void **state) {
    (void)state;
    char command[sizeof folder + 16];
    (void)snprintf(command, sizeof command, "rm -r '%s'", folder);
    return chdir(VEDUTA_BINARY_DIR) == 0 && system(command) == 0 ? 0 : -1;
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_examples),      cmocka_unit_test(test_example_with_text),
        cmocka_unit_test(test_terrain_alone), cmocka_unit_test(test_save),
        cmocka_unit_test(test_particles),     cmocka_unit_test(test_bad_particles),
        cmocka_unit_test(test_instances),     cmocka_unit_test(test_places),
        cmocka_unit_test(test_unknown_keys),  cmocka_unit_test(test_bad_worlds),
        cmocka_unit_test(test_bad_files),     cmocka_unit_test(test_bad_vectors),
    };
    return cmocka_run_group_tests(tests, enter_folder, leave_folder);
}

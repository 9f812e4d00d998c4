/* test_app_model.c: `veduta render MODEL` and `veduta info MODEL` from outside. */
#define APP_LIMIT_S 120
#include "app_support.h"

#include <dirent.h>
#include <sys/stat.h>
#include <unistd.h>
#include <veduta/raster.h>

#define MODELS VEDUTA_SOURCE_DIR "/test/models"
#define BAD VEDUTA_SOURCE_DIR "/test/corpus/model"

static void succeeds(const char *arguments) {
    if (run("", arguments) != 0) {
        fail_msg("%s: %s", arguments, err);
    }
}

/* Expects the status, one sentence on standard error that holds `part`, and no picture. assimp
 * leaks memory of some files that it refuses, which is not what is tested. */
static void fails(int status, const char *part, const char *arguments) {
    (void)unlink("x.png");
    const int got = run("LSAN_OPTIONS=detect_leaks=0", arguments);
    if (got != status || strstr(err, part) == NULL) {
        fail_msg("%s: status %d, %s, not \"%s\"", arguments, got, err, part);
    }
    assert_int_equal(strncmp(err, "veduta: ", 8), 0);
    assert_ptr_equal(strchr(err, '\n'), err + strlen(err) - 1);
    assert_int_not_equal(access("x.png", F_OK), 0);
}

static void take_hash(char hash[17]) {
    const char *at = strstr(out, "\"hash\": \"");
    assert_non_null(at);
    memcpy(hash, at + 9, 16);
    hash[16] = '\0';
}

/* Renders and expects this hash, or with null any; it goes to `hash`. */
static void renders(const char *environment, const char *arguments, const char *expected,
                    char hash[17]) {
    char line[1024];
    (void)snprintf(line, sizeof line, "render -q -j -o x.png %s", arguments);
    if (run(environment, line) != 0) {
        fail_msg("%s: %s", arguments, err);
    }
    take_hash(hash);
    if (expected != NULL && strcmp(expected, hash) != 0) {
        fail_msg("%s %s: hash %s, not %s", environment, arguments, hash, expected);
    }
}

static bool has_assimp(void) {
    return run("", "info " MODELS "/cube.glb") == 0;
}

/* ---- pictures ---------------------------------------------------------------------------------*/

/* One picture by every method, SIMD level and number of threads; the hash is part of the product.
 */
static void test_same_picture(void **state) {
    (void)state;
    static const struct {
        const char *arguments, *hash;
    } pictures[] = {
        {MODELS "/cube.obj -s 120x90", "f80f46f3b4124731"},
        {MODELS "/cube-little.ply -s 97x61 --samples 8 --sun 250,30", "e96c0bf13bcafecd"},
        {MODELS "/cube.obj -s 64x64 --wireframe --show-normals --projection orthographic",
         "b8fef10b3d98b68c"},
        {MODELS "/cloud.ply -s 90x60 --point-size 5 --samples 1", "54daf16183d520d6"},
        {MODELS "/cube-ascii.ply -s 80x60 --shade normals --cull back", "7308e4284d500338"},
        {MODELS "/glass.obj -s 80x60", "7658d5e976e81460"},
    };
    const bool reduced = test_is_reduced();
    for (size_t i = 0; i < sizeof pictures / sizeof pictures[0]; i++) {
        char hash[17];
        renders("", pictures[i].arguments, pictures[i].hash, hash);
        for (int m = 0; m < VD_RASTER_METHOD_COUNT; m++) {
            char line[512];
            (void)snprintf(line, sizeof line, "%s --raster %s --threads %d", pictures[i].arguments,
                           vd_raster_method_name((vd_raster_method)m), m % 2 == 0 ? 7 : 1);
            renders("", line, hash, hash);
        }
        for (int isa = VD_ISA_V2; isa <= (int)vd_isa_best() && !reduced; isa++) {
            char environment[32];
            (void)snprintf(environment, sizeof environment, "VEDUTA_CPU=%s",
                           vd_isa_name((vd_isa)isa));
            renders(environment, pictures[i].arguments, hash, hash);
        }
    }
}

static void test_jpeg_texture(void **state) {
    (void)state;
    char hash[17];
    if (run("", "render -q -o x.png " MODELS "/cube.obj --texture " MODELS "/tile.jpg") != 0) {
        assert_non_null(strstr(err, "VEDUTA_JPEG"));
        skip();
    }
    renders("", MODELS "/cube.obj -s 80x60 --texture " MODELS "/tile.jpg --filter nearest",
            "1821721635df60ab", hash);
}

/* The same cube in every format is the same picture. */
static void test_same_formats(void **state) {
    (void)state;
    char hash[17], other[17];
    renders("", MODELS "/cube-ascii.ply -s 64x48", NULL, hash);
    renders("", MODELS "/cube-little.ply -s 64x48", hash, other);
    renders("", MODELS "/cube-big.ply -s 64x48", hash, other);
    renders("", MODELS "/cube.off -s 64x48", hash, other);
    if (!has_assimp()) {
        assert_non_null(strstr(err, "assimp"));
        skip();
    }
    /* STL is taken for z up: the cube turned a quarter. */
    renders("", MODELS "/cube.stl -s 64x48 --up y", hash, other);
    renders("", MODELS "/cube-ascii.stl -s 64x48 --up y", hash, other);
    renders("", MODELS "/cube.glb -s 64x48", NULL, other);
    assert_string_not_equal(hash, other);
}

/* Every option changes the picture, and what is printed makes the same one again. */
static void test_options(void **state) {
    (void)state;
    static const char *const options[] = {"--shade flat --sun 90,0",
                                          "--shade depth",
                                          "--shade normals",
                                          "--shade uv",
                                          "--shade id",
                                          "--shade albedo",
                                          "--wireframe",
                                          "--points --point-size 9",
                                          "--show-normals",
                                          "--samples 1",
                                          "--filter nearest",
                                          "--texture none",
                                          "--up z",
                                          "--sun 0,90",
                                          "--background FF0000",
                                          "--sky 00FF00",
                                          "--projection orthographic",
                                          "--azimuth 10",
                                          "--cull front",
                                          "--fov 20 --distance 9",
                                          "--cull back --winding cw",
                                          "--far 4.5",
                                          "--near 4.5",
                                          "--line-width 4 --wireframe",
                                          "--eye 3,-5,2",
                                          "--eye 3,-5,2 --heading 330 --pitch -20",
                                          "--texture " MODELS "/cube.png"};
    enum { COUNT = sizeof options / sizeof options[0] };
    char hashes[COUNT + 1][17];
    renders("", MODELS "/cube.obj -s 64x48", NULL, hashes[COUNT]);
    for (int i = 0; i < COUNT; i++) {
        char line[512];
        (void)snprintf(line, sizeof line, MODELS "/cube.obj -s 64x48 %s", options[i]);
        renders("", line, NULL, hashes[i]);
        if (strcmp(hashes[i], hashes[COUNT]) == 0) {
            fail_msg("%s changes nothing", options[i]);
        }
        for (int k = 0; k < i; k++) {
            if (strcmp(hashes[i], hashes[k]) == 0 && strstr(options[i], "winding") == NULL &&
                strstr(options[i], "texture") == NULL) {
                fail_msg("%s is the same as %s", options[i], options[k]);
            }
        }
    }
    /* Winding the other way round swaps the faces. */
    char other[17];
    renders("", MODELS "/cube.obj -s 64x48 --cull back", NULL, other);
    renders("", MODELS "/cube.obj -s 64x48 --cull front --winding cw", other, other);
    renders("", MODELS "/cube.obj -s 64x48 --cull back --winding either", NULL, other);
}

static void test_camera_again(void **state) {
    (void)state;
    static const char *const cameras[] = {"", "--projection orthographic --far 4.5",
                                          "--eye 3,-5,2 --roll 10", "--target 1,1,1",
                                          "--eye 3,-5,2 --heading 330 --pitch -20"};
    for (size_t i = 0; i < sizeof cameras / sizeof cameras[0]; i++) {
        char line[2048], hash[17], other[17], flags[1024];
        (void)snprintf(line, sizeof line, MODELS "/cube.obj -s 64x48 %s", cameras[i]);
        renders("", line, NULL, hash);
        (void)snprintf(line, sizeof line,
                       "render -q -o x.png --print-camera -s 64x48 " MODELS "/cube.obj %s",
                       cameras[i]);
        succeeds(line);
        (void)snprintf(flags, sizeof flags, "%.*s", (int)strcspn(out, "\n"), out);
        (void)snprintf(line, sizeof line, MODELS "/cube.obj -s 64x48 %s", flags);
        renders("", line, hash, other);
    }
}

/* Depth and ids go out beside the picture; a dry run writes nothing. */
static void test_planes(void **state) {
    (void)state;
    succeeds("render -q -o x.png --depth x.pfm --ids ids.png -s 40x30 " MODELS "/cube.obj");
    assert_int_equal(access("x.pfm", F_OK), 0);
    assert_int_equal(access("ids.png", F_OK), 0);
    succeeds("render -q -o dry.png --dry-run -s 640x480 " MODELS "/cube.obj");
    assert_non_null(strstr(out, "seconds"));
    assert_int_not_equal(access("dry.png", F_OK), 0);
    succeeds("render -j -q -o x.png -s 40x30 " MODELS "/cube.obj");
    assert_non_null(strstr(out, "\"triangles\": 12"));
    assert_null(strstr(out, "\"terrain\""));
    succeeds("info " MODELS "/cube.obj");
    assert_non_null(strstr(out, "triangles   12"));
    assert_non_null(strstr(out, "cube.png, 16 x 16"));
    succeeds("info --json " MODELS "/cloud.ply");
    assert_non_null(strstr(out, "\"particles\": 27"));
}

/* ---- what cannot be ---------------------------------------------------------------------------*/

#define CUBE "render -o x.png -s 40x30 " MODELS "/cube.obj "

static void test_bad_use(void **state) {
    (void)state;
    static const char *const terrain[] = {
        "--colormap terrain", "--color a.png",  "--exaggerate 2", "--haze off",
        "--curvature off",    "--shadows off",  "--method march", "--band 1",
        "--nodata 1",         "--missing fill", "--cell-size 3",  "--height-scale 2",
        "--shading off",      "--bands 1,2,3"};
    for (size_t i = 0; i < sizeof terrain / sizeof terrain[0]; i++) {
        char line[512];
        (void)snprintf(line, sizeof line, CUBE "%s", terrain[i]);
        fails(2, "applies to terrain", line);
    }
    static const char *const model[] = {"--shade flat",   "--wireframe",   "--points",
                                        "--texture none", "--up z",        "--far 10",
                                        "--cull back",    "--winding cw",  "--raster tiled",
                                        "--show-normals", "--point-size 3"};
    for (size_t i = 0; i < sizeof model / sizeof model[0]; i++) {
        char line[512];
        (void)snprintf(line, sizeof line,
                       "render -o x.png " VEDUTA_SOURCE_DIR "/data/mont-blanc.png %s", model[i]);
        fails(2, "applies to models", line);
    }
    fails(2, "textures of models",
          "render -o x.png " VEDUTA_SOURCE_DIR "/data/mont-blanc.png --filter anisotropic");
    fails(2, "--wireframe and --points", CUBE "--wireframe --points");
    fails(2, "no latitude", CUBE "--eye 45,6,2m");
    fails(2, "drawn alone", CUBE MODELS "/cube.off");
    fails(2, "same place", CUBE "--eye 1,1,1 --target 1,1,1");
    fails(2, "not beyond", CUBE "--near 2 --far 1");
    fails(2, "--shade", CUBE "--shade gouraud");
    fails(1, "nowhere.ply", "render -o x.png nowhere.ply");
    fails(1, "nowhere.png", CUBE "--texture nowhere.png");
    fails(1, "texture coordinates",
          "render -o x.png " MODELS "/cube.off --texture " MODELS "/cube.png");
    fails(1, "texture coordinates", "render -o x.png " MODELS "/cube.off --shade uv");
    fails(1, "needs triangles", "render -o x.png " MODELS "/cloud.ply --show-normals");
}

/* An empty picture says why; --allow-empty writes it. */
static void test_empty(void **state) {
    (void)state;
    fails(1, "looks away", CUBE "--eye 0,-9,0 --heading 180 --pitch 0");
    fails(1, "inside the model", CUBE "--eye 0,0,0 --heading 0 --pitch 0 --cull back");
    fails(1, "before the near plane", CUBE "--near 100");
    fails(1, "far distance", CUBE "--far 0.5");
    succeeds(CUBE "--eye 0,-9,0 --heading 180 --pitch 0 --allow-empty");
    assert_non_null(strstr(err, "looks away"));
    assert_int_equal(access("x.png", F_OK), 0);
}

/* Every file of the corpus of bad models: exit status 1, one sentence that names it, no picture. */
static void test_bad_models(void **state) {
    (void)state;
    DIR *folder = opendir(BAD);
    assert_non_null(folder);
    int count = 0;
    for (struct dirent *entry; (entry = readdir(folder)) != NULL;) {
        const char *dot = strrchr(entry->d_name, '.');
        if (entry->d_name[0] == '.' || (dot != NULL && strcmp(dot, ".mtl") == 0)) {
            continue;
        }
        char line[1024];
        (void)snprintf(line, sizeof line, "render -o x.png -s 40x30 " BAD "/%s", entry->d_name);
        fails(1, dot == NULL ? entry->d_name : BAD "/", line);
        count++;
    }
    (void)closedir(folder);
    assert_true(count > 50);
}

static char folder[] = VEDUTA_BINARY_DIR "/test-app-model-XXXXXX";

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
        cmocka_unit_test(test_same_picture), cmocka_unit_test(test_same_formats),
        cmocka_unit_test(test_jpeg_texture), cmocka_unit_test(test_options),
        cmocka_unit_test(test_camera_again), cmocka_unit_test(test_planes),
        cmocka_unit_test(test_bad_use),      cmocka_unit_test(test_empty),
        cmocka_unit_test(test_bad_models),
    };
    return cmocka_run_group_tests(tests, enter_folder, leave_folder);
}

/* test_app_impostors.c: `veduta render --impostors` from outside. */
#include "app_support.h"

#include <unistd.h>
#include <veduta/picture.h>

#define WORLDS VEDUTA_SOURCE_DIR "/example/worlds"
#define DATA VEDUTA_SOURCE_DIR "/data"
#define VILLAGE WORLDS "/village.json -s 240x135"

/* The text behind a key of the last run's JSON; null where there is none. */
static const char *value_of(const char *key) {
    char quoted[64];
    (void)snprintf(quoted, sizeof quoted, "\"%s\": ", key);
    const char *at = strstr(out, quoted);
    return at != NULL ? at + strlen(quoted) : NULL;
}

static void renders(const char *arguments, const char *file) {
    char line[1024];
    (void)snprintf(line, sizeof line, "render -j -q -o %s %s", file, arguments);
    if (run("", line) != 0) {
        fail_msg("%s: %s", arguments, err);
    }
}

static vd_comparison compare(const char *one, const char *other, double threshold) {
    vd_context *context = test_context(1, VD_ISA_AUTO);
    vd_picture *a = NULL, *b = NULL;
    vd_comparison difference;
    assert_ok(vd_picture_load(context, one, &a));
    assert_ok(vd_picture_load(context, other, &b));
    assert_ok(vd_picture_compare(a, b, threshold, &difference, NULL));
    vd_picture_destroy(&a);
    vd_picture_destroy(&b);
    vd_context_destroy(&context);
    return difference;
}

/* Pixels that differ by more than a threshold of 255. */
static uint64_t differing(const char *one, const char *other, double threshold) {
    return compare(one, other, threshold).differing_pixels;
}

static void fails(const char *arguments, const char *sentence) {
    char line[1024];
    (void)unlink("x.png");
    (void)snprintf(line, sizeof line, "render -o x.png %s", arguments);
    const int status = run("", line);
    if (status != 2 || strstr(err, sentence) == NULL || strncmp(err, "veduta: ", 8) != 0) {
        fail_msg("%s: exit status %d: %s", arguments, status, err);
    }
    assert_ptr_equal(strchr(err, '\n'), err + strlen(err) - 1);
    assert_int_not_equal(access("x.png", F_OK), 0);
}

static char folder[] = VEDUTA_BINARY_DIR "/test-app-impostors-XXXXXX";

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

/* ---- the tests --------------------------------------------------------------------------------*/

/* Reissued for this camera the picture is the direct one, whatever the tolerance and the threads.
 */
static void a_settled_picture_is_the_direct_one(void **state) {
    (void)state;
    static const char *const worlds[] = {
        VILLAGE,
        WORLDS "/models.json -s 240x135",
        WORLDS "/dunes.json -s 240x135",
        DATA "/mont-blanc.png --cell-size 75 -s 160x90",
        VILLAGE " --samples 1 --eye 24000,-17000,5200 --heading 70 --pitch -20 --haze off",
    };
    static const char *const ways[] = {"", "--tolerance 0", "--tolerance 20 --threads 1"};
    char line[1024];
    for (size_t i = 0; i < sizeof worlds / sizeof worlds[0]; i++) {
        renders(worlds[i], "direct.png");
        assert_null(value_of("impostors"));
        for (size_t k = 0; k < (test_is_reduced() && i > 0 ? 1 : sizeof ways / sizeof ways[0]);
             k++) {
            (void)snprintf(line, sizeof line, "%s --impostors %s", worlds[i], ways[k]);
            renders(line, "impostors.png");
            assert_int_equal(strncmp(value_of("settled"), "true", 4), 0);
            assert_true(strtol(value_of("shown"), NULL, 10) > 0);
            if (differing("direct.png", "impostors.png", 0.0) != 0) {
                fail_msg("%s differs from the direct picture", line);
            }
        }
    }
}

/* Pictures that were all made for this very camera, shown as while it moves: wrong by nothing but
 * their filter and their edges. What they come to is said here, with a tenth to spare, so that it
 * is seen when it grows. */
static void moving_pictures_are_near_the_direct_one(void **state) {
    (void)state;
    static const struct {
        const char *world;
        double rms, over_16, over_64; /* of 255; shares of the pixels */
    } cases[] = {
        {VILLAGE, 9.7, 0.035, 0.0098},
        {WORLDS "/models.json -s 240x135", 4.5, 0.0206, 0.0009},
        {DATA "/mont-blanc.png --cell-size 75 -s 160x90", 4.5, 0.0231, 0.0},
        {VILLAGE " --eye 24000,-17000,5200 --heading 70 --pitch -20 --haze off", 3.2, 0.0107, 0.0},
    };
    char line[1024];
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        renders(cases[i].world, "direct.png");
        (void)snprintf(line, sizeof line, "%s --impostors --show pictures", cases[i].world);
        renders(line, "moving.png");
        assert_int_equal(strncmp(value_of("settled"), "false", 5), 0);
        assert_true(strtol(value_of("shown"), NULL, 10) > 0);
        assert_true(strtod(value_of("error_px"), NULL) < 0.01);
        const vd_comparison fine = compare("direct.png", "moving.png", 16.0);
        const vd_comparison coarse = compare("direct.png", "moving.png", 64.0);
        const double all = (double)fine.pixels, over_16 = (double)fine.differing_pixels / all,
                     over_64 = (double)coarse.differing_pixels / all;
        if (!(fine.rms <= cases[i].rms && over_16 <= cases[i].over_16 &&
              over_64 <= cases[i].over_64)) {
            fail_msg("%s: RMS %.2f of 255, %.4f of all pixels by more than 16, %.4f by 64",
                     cases[i].world, fine.rms, over_16, over_64);
        }
        /* Neither is it a picture of nothing, nor the direct one. */
        assert_true(fine.rms > 0.0);
    }
}

static void depth_is_the_direct_one(void **state) {
    (void)state;
    static char one[1 << 16], other[1 << 16];
    renders(WORLDS "/dunes.json -s 240x135 --depth one.pfm", "direct.png");
    renders(WORLDS "/dunes.json -s 240x135 --depth other.pfm --impostors", "impostors.png");
    FILE *files[2] = {fopen("one.pfm", "rb"), fopen("other.pfm", "rb")};
    assert_true(files[0] != NULL && files[1] != NULL);
    size_t count;
    do {
        count = fread(one, 1, sizeof one, files[0]);
        assert_int_equal(fread(other, 1, sizeof other, files[1]), count);
        assert_memory_equal(one, other, count);
    } while (count > 0);
    assert_int_equal(fclose(files[0]) + fclose(files[1]), 0);
}

/* As a moving camera has them: like the direct picture, and changed by every overlay. */
static void overlays_lie_over_the_pictures(void **state) {
    (void)state;
    static const char *const overlays[] = {"pictures", "bounds", "age", "error"};
    char line[1024], name[32];
    renders(VILLAGE, "direct.png");
    for (int i = 0; i < 4; i++) {
        (void)snprintf(line, sizeof line, VILLAGE " --impostors --show %s", overlays[i]);
        (void)snprintf(name, sizeof name, "%s.png", overlays[i]);
        renders(line, name);
        assert_int_equal(strncmp(value_of("settled"), "false", 5), 0);
    }
    /* Edges of pictures are softer; a tint is another colour. */
    const uint64_t all = 240 * 135;
    assert_true(differing("direct.png", "pictures.png", 60.0) < all / 50);
    for (int i = 1; i < 4; i++) {
        (void)snprintf(name, sizeof name, "%s.png", overlays[i]);
        assert_true(differing("pictures.png", name, 8.0) > all / 4);
    }
    /* Age and error are both nothing here; where they are is not. */
    assert_int_equal(differing("age.png", "error.png", 0.0), 0);
    assert_true(differing("age.png", "bounds.png", 8.0) > all / 4);
    (void)snprintf(line, sizeof line, VILLAGE " --impostors --show bounds --threads 1");
    renders(line, "again.png");
    assert_int_equal(differing("bounds.png", "again.png", 0.0), 0);
}

static void an_empty_picture_is_told(void **state) {
    (void)state;
    assert_int_equal(run("", "render -o x.png --impostors " WORLDS "/models.json --eye 0,0,500 "
                             "--heading 0 --pitch 80"),
                     1);
    assert_non_null(strstr(err, "none of the world's objects is in the picture"));
    assert_int_equal(run("", "render -q -o x.png --impostors --allow-empty " WORLDS "/models.json "
                             "--eye 0,0,500 --heading 0 --pitch 80 -s 40x30"),
                     0);
}

static void bad_use_is_told(void **state) {
    (void)state;
    fails(VILLAGE " --tolerance 2", "--tolerance is about impostors");
    fails(VILLAGE " --show age", "add --impostors");
    fails(VILLAGE " --impostors --show colors", "pictures|bounds|age|error");
    fails(VILLAGE " --impostors --tolerance nan", "--tolerance");
    fails(VILLAGE " --impostors --tolerance -1", "give 0 to 1000 pixels");
    fails(VILLAGE " --impostors --projection orthographic", "no parallax to wait for");
    fails(VILLAGE " --impostors --ids i.png", "leave out --ids");
    fails(VILLAGE " --impostors --show age --depth d.pfm", "leave out --depth or --show");
    fails(VILLAGE " --impostors --dry-run", "leave out one of them");
    fails("--impostors " VEDUTA_SOURCE_DIR "/test/models/cube.obj", "this is a model alone");
    fails("--impostors --classic x=1 --height " DATA "/mont-blanc.png --color " DATA
          "/mont-blanc.png",
          "--classic draws a map of its own");
    fails("--impostors " DATA "/points/urban.las", "--impostors does not apply to particles alone");
    write_file("o.json", "{\"veduta\": \"0.1.0\", \"impostors\": true}");
    fails(DATA "/mont-blanc.png --options o.json", "impostors");
    assert_int_equal(run("", "fly " DATA "/mont-blanc.png " DATA "/paths/walk.json --impostors"),
                     2);
    assert_non_null(strstr(err, "--impostors belongs to `veduta render`"));
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_settled_picture_is_the_direct_one),
        cmocka_unit_test(moving_pictures_are_near_the_direct_one),
        cmocka_unit_test(depth_is_the_direct_one),
        cmocka_unit_test(overlays_lie_over_the_pictures),
        cmocka_unit_test(an_empty_picture_is_told),
        cmocka_unit_test(bad_use_is_told),
    };
    return cmocka_run_group_tests(tests, enter_folder, leave_folder);
}

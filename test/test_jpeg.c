/* test_jpeg.c: JPEG pictures, whole and damaged. */
#include "support.h"

#include <stdio.h>
#include <veduta/picture.h>

static uint8_t data[4096];
static size_t size;

static int read_file(void **state) {
    (void)state;
    FILE *file = fopen(VEDUTA_SOURCE_DIR "/test/models/tile.jpg", "rb");
    size = file != NULL ? fread(data, 1, sizeof data, file) : 0;
    return file != NULL ? fclose(file) : -1;
}

/* A build without libjpeg says so. */
static bool has_jpeg(vd_context *context) {
    vd_picture *picture = NULL;
    const vd_status status = vd_picture_decode(context, data, size, "tile.jpg", &picture);
    vd_picture_destroy(&picture);
    if (status.code == VD_ERROR_UNSUPPORTED) {
        assert_non_null(strstr(status.message, "VEDUTA_JPEG"));
        return false;
    }
    assert_ok(status);
    return true;
}

/* Four fields of 12 × 8 pixels. */
static void test_colors(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    if (has_jpeg(context)) {
        vd_picture *picture = NULL;
        assert_ok(vd_picture_decode(context, data, size, "tile.jpg", &picture));
        assert_true(picture->width == 24 && picture->height == 16 && picture->channels == 3);
        for (int field = 0; field < 4; field++) {
            const vd_rgba8 c =
                vd_picture_color(picture, field % 2 == 0 ? 3 : 20, field < 2 ? 3 : 12);
            assert_true(abs(c.r - (field % 2 == 0 ? 200 : 40)) < 12);
            assert_true(abs(c.g - (field < 2 ? 60 : 180)) < 12);
            assert_true(abs(c.b - 100) < 12);
        }
        vd_picture_destroy(&picture);
    }
    vd_context_destroy(&context);
}

/* Cut anywhere but in the end mark it is refused; with any byte changed it is a picture or is
 * refused, and nothing leaks. */
static void test_damaged(void **state) {
    (void)state;
    test_allocator allocator = {0, 0, 0};
    vd_context *context = test_failing_context(&allocator);
    const int live = allocator.live;
    for (size_t cut = 3; cut + 2 < size && has_jpeg(context); cut++) {
        vd_picture *picture = NULL;
        vd_status status = vd_picture_decode(context, data, cut, "cut.jpg", &picture);
        assert_int_equal(status.code, VD_ERROR_FORMAT);
        assert_null(picture);
    }
    for (size_t at = 3; at < size; at++) {
        for (int bit = 0; bit < 8; bit++) {
            vd_picture *picture = NULL;
            data[at] ^= (uint8_t)(1 << bit);
            vd_status status = vd_picture_decode(context, data, size, "bad.jpg", &picture);
            assert_true((status.code == VD_OK) == (picture != NULL));
            vd_picture_destroy(&picture);
            assert_int_equal(allocator.live, live);
            data[at] ^= (uint8_t)(1 << bit);
        }
    }
    vd_context_destroy(&context);
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_colors),
                                       cmocka_unit_test(test_damaged)};
    return cmocka_run_group_tests(tests, read_file, NULL);
}

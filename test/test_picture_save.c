/* Writing picture files: PNG, depth, ids; and what is left when writing fails. */
#include <math.h>
#include <spng.h>
#include <stdio.h>
#include <sys/stat.h>
#include <unistd.h>
#include <veduta/picture.h>
#include "image/image.h"
#include "support.h"
#ifdef VEDUTA_HAVE_EXR
#include <OpenEXR/openexr.h>
#endif

/* A folder of this run's own. */
static char folder[200];

static const char *in_folder(const char *name) {
    static char paths[4][300];
    static int next;
    char *path = paths[next++ % 4];
    snprintf(path, sizeof paths[0], "%s/%s", folder, name);
    return path;
}

static int make_folder(void **state) {
    (void)state;
    snprintf(folder, sizeof folder, "%s/test_picture_save.XXXXXX", VEDUTA_BINARY_DIR);
    return mkdtemp(folder) ? 0 : -1;
}

static int remove_folder(void **state) {
    (void)state;
    return rmdir(folder); /* fails, as it should, when a test left a file */
}

/* Contents of several characters: noise, long runs, gradients; every filter and token is used. */
static void fill_row(uint64_t *random, int y, uint8_t *row, size_t bytes) {
    for (size_t i = 0; i < bytes; i++) {
        const uint8_t noise = (uint8_t)test_random(random);
        row[i] = y % 5 == 0   ? noise
                 : y % 5 == 1 ? (uint8_t)(i / 300 * 50)
                 : y % 5 == 2 ? (uint8_t)(i + (size_t)y + noise % 4)
                 : y % 5 == 3 ? (uint8_t)(noise < 3 ? noise : 0)
                              : (uint8_t)(noise % 3 * 60);
    }
}

static vd_picture *made(vd_context *context, int width, int height, int channels, int bits) {
    vd_picture *picture = NULL;
    assert_ok(vd_picture_create(context, width, height, channels, bits, &picture));
    uint64_t random = (uint64_t)(width * 31 + height);
    for (int y = 0; y < height; y++) {
        fill_row(&random, y, vd_picture_row(picture, y),
                 (size_t)width * (size_t)channels * (size_t)bits / 8);
    }
    return picture;
}

static void assert_same(const vd_picture *a, const vd_picture *b) {
    assert_true(a->width == b->width && a->height == b->height);
    assert_true(a->channels == b->channels && a->bits == b->bits);
    for (int y = 0; y < a->height; y++) {
        assert_memory_equal(vd_picture_row(a, y), vd_picture_row(b, y),
                            (size_t)a->width * (size_t)a->channels * (size_t)a->bits / 8);
    }
}

static void every_layout_and_level_comes_back(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    const char *path = in_folder("layout.png");
    const int sizes[][2] = {{1, 1}, {1, 9}, {2, 3}, {7, 1}, {8, 5}, {333, 41}, {3000, 130}};
    for (size_t s = 0; s < sizeof sizes / sizeof sizes[0]; s++) {
        for (int layout = 0; layout < 8; layout++) {
            vd_picture *picture =
                made(context, sizes[s][0], sizes[s][1], layout % 4 + 1, layout < 4 ? 8 : 16);
            for (int level = 0; level <= 9; level += s < 6 || layout < 1 ? 1 : 9) {
                vd_png_def def = vd_png_def_default();
                def.level = level == 0 ? def.level : level == 1 ? 0 : level;
                assert_ok(vd_picture_save_png(picture, path, &def));
                vd_picture *back = NULL;
                assert_ok(vd_picture_load(context, path, &back));
                assert_same(picture, back);
                vd_picture_destroy(&back);
            }
            vd_picture_destroy(&picture);
        }
    }
    assert_int_equal(unlink(path), 0);
    vd_context_destroy(&context);
}

/* Reads the text chunks of a PNG into `out`; returns how many there are. */
static uint32_t read_text(const char *path, struct spng_text *out, uint32_t room, spng_ctx **png) {
    static uint8_t data[1 << 20];
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    const size_t size = fread(data, 1, sizeof data, file);
    fclose(file);
    *png = spng_ctx_new(0);
    assert_int_equal(spng_set_crc_action(*png, SPNG_CRC_ERROR, SPNG_CRC_ERROR), 0);
    assert_int_equal(spng_set_png_buffer(*png, data, size), 0);
    uint32_t count = 0;
    assert_int_equal(spng_get_text(*png, NULL, &count), 0);
    assert_true(count <= room);
    assert_int_equal(spng_get_text(*png, out, &room), 0);
    return count;
}

static void text_is_kept(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    const char *path = in_folder("text.png");
    vd_picture *picture = made(context, 5, 4, 3, 8);
    const vd_picture_text text[] = {
        {"Software", "Veduta"},
        {"veduta:camera", "{\"höhe\": \"2 m – über Grund\", \"n\": 𝒩}\n"},
        {"empty", ""}};
    for (int level = 1; level <= 6; level += 5) {
        const vd_png_def def = {level, text, 3};
        assert_ok(vd_picture_save_png(picture, path, &def));
        struct spng_text chunks[5];
        spng_ctx *png = NULL;
        assert_int_equal(read_text(path, chunks, 5, &png), 2);
        for (int i = 0; i < 2; i++) {
            assert_int_equal(chunks[i].type, SPNG_ITXT);
            assert_string_equal(chunks[i].keyword, text[i].keyword);
            assert_string_equal(chunks[i].text, text[i].text);
        }
        spng_ctx_free(png);
    }
    assert_int_equal(unlink(path), 0);
    vd_picture_destroy(&picture);
    vd_context_destroy(&context);
}

static void bad_definitions_are_refused(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    const char *path = in_folder("refused.png");
    vd_picture *picture = made(context, 5, 4, 3, 8);
    char long_keyword[81];
    memset(long_keyword, 'k', 80);
    long_keyword[80] = 0;
    const vd_picture_text texts[] = {{NULL, "a"},
                                     {"", "a"},
                                     {long_keyword, "a"},
                                     {" a", "a"},
                                     {"a ", "a"},
                                     {"a  b", "a"},
                                     {"a\tb", "a"},
                                     {"ä", "a"},
                                     {"k", NULL},
                                     {"k", "\xff"},
                                     {"k", "\xc3"},
                                     {"k", "\xc0\x80"},
                                     {"k", "\xe0\x9f\xbf"},
                                     {"k", "\xed\xa0\x80"},
                                     {"k", "\xf4\x90\x80\x80"},
                                     {"k", "ab\x80"},
                                     {"k", "\xe2\x82"},
                                     {"k", "\xf0\x9f\x98"}};
    for (size_t i = 0; i < sizeof texts / sizeof texts[0]; i++) {
        const vd_png_def def = {1, &texts[i], 1};
        const vd_status status = vd_picture_save_png(picture, path, &def);
        assert_int_equal(status.code, VD_ERROR_ARGUMENT);
        assert_non_null(strstr(status.message, "refused.png"));
    }
    const vd_png_def defs[] = {{-1, NULL, 0}, {10, NULL, 0}, {1, NULL, 1}, {1, texts, -1}};
    for (size_t i = 0; i < sizeof defs / sizeof defs[0]; i++) {
        assert_int_equal(vd_picture_save_png(picture, path, &defs[i]).code, VD_ERROR_ARGUMENT);
    }
    assert_int_not_equal(access(path, F_OK), 0);
    vd_picture_destroy(&picture);
    vd_context_destroy(&context);
}

static void frames_become_rgb_or_straight_rgba(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    const char *path = in_folder("frame.png");
    vd_frame *frame = NULL;
    assert_ok(vd_frame_create(context, 256, 256, 0, &frame));
    for (int y = 0; y < 256; y++) {
        for (int x = 0; x < 256; x++) { /* alpha y, colours up to it, and one impossibly above */
            uint8_t *pixel = frame->rgba + 4 * ((size_t)y * frame->stride + (size_t)x);
            pixel[0] = (uint8_t)(x < y ? x : y);
            pixel[1] = (uint8_t)((x * y + 127) / 255);
            pixel[2] = (uint8_t)x;
            pixel[3] = (uint8_t)y;
        }
    }
    vd_picture *back = NULL;
    assert_ok(vd_frame_save_png(frame, path, NULL));
    assert_ok(vd_picture_load(context, path, &back));
    assert_int_equal(back->channels, 4);
    for (int y = 0; y < 256; y++) {
        for (int x = 0; x < 256; x++) {
            const uint8_t *in = frame->rgba + 4 * ((size_t)y * frame->stride + (size_t)x);
            const uint8_t *out = (const uint8_t *)vd_picture_row(back, y) + 4 * x;
            for (int c = 0; c < 3; c++) {
                const double exact = y == 0 ? 0.0 : fmin(255.0, in[c] * 255.0 / y);
                assert_true(fabs(out[c] - exact) <= 0.5);
            }
            assert_int_equal(out[3], y);
            if (y > 0) { /* premultiplying again gives the frame's byte */
                assert_int_equal((out[1] * y + 127) / 255, in[1]);
            }
        }
    }
    vd_picture_destroy(&back);
    for (size_t i = 0; i < 256 * frame->stride; i++) {
        frame->rgba[4 * i + 3] = 255;
    }
    assert_ok(vd_frame_save_png(frame, path, NULL));
    assert_ok(vd_picture_load(context, path, &back));
    assert_int_equal(back->channels, 3);
    assert_int_equal(((uint8_t *)vd_picture_row(back, 200))[3 * 17 + 2], 17);
    vd_picture_destroy(&back);
    vd_frame_destroy(&frame);
    assert_int_equal(unlink(path), 0);
    vd_context_destroy(&context);
}

/* A frame with depth 2^-x at near 0.5 m, so distances 0.5 · 2^x, and nothing in column 3. */
static vd_frame *depth_frame(vd_context *context, int width, int height) {
    vd_frame *frame = NULL;
    assert_ok(vd_frame_create(context, width, height, VD_PLANE_DEPTH | VD_PLANE_ID, &frame));
    for (int y = 0; y < height; y++) {
        for (int x = 0; x < width; x++) {
            const size_t i = (size_t)y * frame->stride + (size_t)x;
            frame->depth[i] = x == 3 ? 0.0f : ldexpf(1.0f, -(x % 20)) / (float)(1 + y);
            frame->id[i] = (uint32_t)(x * y);
        }
    }
    return frame;
}

/* Both the depth and the distance were rounded to float. */
static void assert_distance(float value, int x, int y) {
    const double exact = ldexp(0.5, x % 20) * (1 + y);
    assert_true(x == 3 ? isinf(value) && value > 0
                       : fabs((double)value - exact) <= exact * 0x1p-23);
}

static void pfm_holds_distances(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    const char *path = in_folder("depth.PFM");
    vd_frame *frame = depth_frame(context, 6, 4);
    assert_ok(vd_frame_save_depth(frame, 0.5, 0.0, path));
    FILE *file = fopen(path, "rb");
    uint8_t data[200];
    assert_int_equal(fread(data, 1, sizeof data, file), 12 + 6 * 4 * 4);
    fclose(file);
    assert_memory_equal(data, "Pf\n6 4\n-1.0\n", 12);
    for (int y = 0; y < 4; y++) { /* the bottom row comes first */
        for (int x = 0; x < 6; x++) {
            const uint8_t *b = data + 12 + 4 * ((3 - y) * 6 + x);
            const uint32_t bits =
                (uint32_t)b[0] | (uint32_t)b[1] << 8 | (uint32_t)b[2] << 16 | (uint32_t)b[3] << 24;
            float value;
            memcpy(&value, &bits, sizeof value);
            assert_distance(value, x, y);
        }
    }
    vd_frame_destroy(&frame);
    assert_int_equal(unlink(path), 0);
    vd_context_destroy(&context);
}

static void png_depth_is_relative_to_the_nearest(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    const char *path = in_folder("depth.png");
    vd_frame *frame = depth_frame(context, 20, 2);
    frame->depth[5] = NAN;
    vd_picture *back = NULL;
    assert_ok(vd_frame_save_depth(frame, 0.5, 0.0, path));
    assert_ok(vd_picture_load(context, path, &back));
    assert_true(back->channels == 1 && back->bits == 16);
    const uint16_t *row = vd_picture_row(back, 0);
    const int expected[20] = {65535, 32768, 16384, 0, 4096, 0, 1024, 512, 256, 128,
                              64,    32,    16,    8, 4,    2, 1,    1,   1,   1};
    for (int x = 0; x < 20; x++) {
        assert_int_equal(row[x], expected[x]);
    }
    vd_picture_destroy(&back);
    struct spng_text text[2];
    spng_ctx *png = NULL;
    assert_int_equal(read_text(path, text, 2, &png), 1);
    assert_string_equal(text[0].keyword, "veduta:nearest_m");
    assert_string_equal(text[0].text, "0.500000000");
    spng_ctx_free(png);

    /* Orthographic: depth 1 - z / far. */
    for (int x = 0; x < 20; x++) {
        frame->depth[x] = frame->depth[frame->stride + (size_t)x] = x == 0 ? 0.0f : 0.5f;
    }
    frame->depth[7] = 0.75f;
    assert_ok(vd_frame_save_depth(frame, 0.5, 1000.0, path));
    assert_ok(vd_picture_load(context, path, &back));
    row = vd_picture_row(back, 0);
    assert_int_equal(row[0], 0);
    assert_int_equal(row[1], 32768);
    assert_int_equal(row[7], 65535);
    vd_picture_destroy(&back);
    assert_int_equal(read_text(path, text, 2, &png), 1);
    assert_string_equal(text[0].text, "250.000000000");
    spng_ctx_free(png);
    vd_frame_destroy(&frame);
    assert_int_equal(unlink(path), 0);
    vd_context_destroy(&context);
}

#ifdef VEDUTA_HAVE_EXR
static void exr_holds_distances(void **state) {
    (void)state;
    enum { WIDTH = 37, HEIGHT = 35 }; /* two whole chunks of 16 rows and a part of one */
    vd_context *context = test_context(1, VD_ISA_AUTO);
    const char *path = in_folder("depth.exr");
    vd_frame *frame = depth_frame(context, WIDTH, HEIGHT);
    assert_ok(vd_frame_save_depth(frame, 0.5, 0.0, path));
    exr_context_t exr = NULL;
    assert_int_equal(exr_start_read(&exr, path, NULL), EXR_ERR_SUCCESS);
    exr_attr_box2i_t window;
    assert_int_equal(exr_get_data_window(exr, 0, &window), EXR_ERR_SUCCESS);
    assert_true(window.max.x == WIDTH - 1 && window.max.y == HEIGHT - 1);
    static float rows[16 * WIDTH];
    for (int y = 0; y < HEIGHT; y += 16) {
        exr_chunk_info_t chunk;
        exr_decode_pipeline_t decoder = EXR_DECODE_PIPELINE_INITIALIZER;
        assert_int_equal(exr_read_scanline_chunk_info(exr, 0, y, &chunk), EXR_ERR_SUCCESS);
        assert_int_equal(exr_decoding_initialize(exr, 0, &chunk, &decoder), EXR_ERR_SUCCESS);
        assert_int_equal(decoder.channel_count, 1);
        assert_string_equal(decoder.channels[0].channel_name, "Z");
        assert_int_equal(decoder.channels[0].data_type, EXR_PIXEL_FLOAT);
        decoder.channels[0].decode_to_ptr = (uint8_t *)rows;
        decoder.channels[0].user_pixel_stride = sizeof(float);
        decoder.channels[0].user_line_stride = WIDTH * sizeof(float);
        decoder.channels[0].user_bytes_per_element = sizeof(float);
        decoder.channels[0].user_data_type = EXR_PIXEL_FLOAT;
        assert_int_equal(exr_decoding_choose_default_routines(exr, 0, &decoder), EXR_ERR_SUCCESS);
        assert_int_equal(exr_decoding_run(exr, 0, &decoder), EXR_ERR_SUCCESS);
        exr_decoding_destroy(exr, &decoder);
        for (int row = 0; row < chunk.height; row++) {
            for (int x = 0; x < WIDTH; x++) {
                assert_distance(rows[row * WIDTH + x], x, y + row);
            }
        }
    }
    exr_finish(&exr);
    vd_frame_destroy(&frame);
    assert_int_equal(unlink(path), 0);
    vd_context_destroy(&context);
}
#else
static void exr_is_missing(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    vd_frame *frame = depth_frame(context, 5, 5);
    const vd_status status = vd_frame_save_depth(frame, 0.5, 0.0, in_folder("depth.exr"));
    assert_int_equal(status.code, VD_ERROR_UNSUPPORTED);
    assert_non_null(strstr(status.message, "depth.exr"));
    vd_frame_destroy(&frame);
    vd_context_destroy(&context);
}
#endif

static void ids_keep_their_objects(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    const char *path = in_folder("ids.png");
    vd_frame *frame = depth_frame(context, 300, 200);
    for (uint32_t i = 1; i < 100; i++) {
        uint32_t id = 0;
        assert_ok(vd_frame_add_object(frame, UINT64_MAX - i, &id));
        assert_int_equal(id, i);
    }
    assert_ok(vd_frame_save_ids(frame, path));
    vd_picture *back = NULL;
    assert_ok(vd_picture_load(context, path, &back));
    assert_int_equal(((uint16_t *)vd_picture_row(back, 199))[299], 299 * 199);
    vd_picture_destroy(&back);
    struct spng_text text[100];
    spng_ctx *png = NULL;
    assert_int_equal(read_text(path, text, 100, &png), 99);
    assert_string_equal(text[14].keyword, "veduta:id 15");
    assert_string_equal(text[14].text, "18446744073709551600");
    spng_ctx_free(png);
    assert_int_equal(unlink(path), 0);
    frame->id[frame->stride * 7 + 5] = 65536;
    const vd_status status = vd_frame_save_ids(frame, path);
    assert_int_equal(status.code, VD_ERROR_LIMIT);
    assert_non_null(strstr(status.message, "pixel 5, 7"));
    vd_frame_destroy(&frame);
    vd_context_destroy(&context);
}

static void planes_that_are_not_there(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    vd_frame *frame = NULL, *deep = depth_frame(context, 5, 5);
    assert_ok(vd_frame_create(context, 5, 5, 0, &frame));
    const char *path = in_folder("planes.png"), *text = in_folder("planes.txt");
    assert_int_equal(vd_frame_save_depth(frame, 1.0, 0.0, path).code, VD_ERROR_ARGUMENT);
    assert_int_equal(vd_frame_save_ids(frame, path).code, VD_ERROR_ARGUMENT);
    assert_int_equal(vd_frame_save_depth(deep, 0.0, 0.0, path).code, VD_ERROR_ARGUMENT);
    assert_int_equal(vd_frame_save_depth(deep, NAN, 0.0, path).code, VD_ERROR_ARGUMENT);
    assert_int_equal(vd_frame_save_depth(deep, 1.0, -1.0, path).code, VD_ERROR_ARGUMENT);
    const vd_status status = vd_frame_save_depth(deep, 1.0, 0.0, text);
    assert_int_equal(status.code, VD_ERROR_ARGUMENT);
    assert_non_null(strstr(status.message, ".exr, .pfm or .png"));
    assert_int_equal(vd_frame_save_depth(deep, 1.0, 0.0, "-").code, VD_ERROR_ARGUMENT);
    vd_frame_destroy(&frame);
    vd_frame_destroy(&deep);
    vd_context_destroy(&context);
}

static void places_that_cannot_be_written(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    vd_picture *picture = made(context, 500, 400, 3, 8);
    vd_frame *frame = depth_frame(context, 50, 40);
    const struct {
        const char *path, *reason;
    } cases[] = {{in_folder("no/such/folder.png"), "No such file"},
                 {folder, "Is a directory"},
                 {"/dev/full", "No space left"}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        const vd_status status = vd_picture_save_png(picture, cases[i].path, NULL);
        assert_int_equal(status.code, VD_ERROR_IO);
        assert_non_null(strstr(status.message, cases[i].path));
        assert_non_null(strstr(status.message, cases[i].reason));
        assert_int_equal(vd_frame_save_ids(frame, cases[i].path).code, VD_ERROR_IO);
    }
    const char *endings[] = {"no/depth.pfm", "no/depth.exr", "no/depth.png"};
    for (int i = 0; i < 3; i++) {
        const vd_code code = vd_frame_save_depth(frame, 0.5, 0.0, in_folder(endings[i])).code;
        assert_true(code == VD_ERROR_IO || code == VD_ERROR_UNSUPPORTED);
    }
    if (geteuid() != 0) { /* the superuser may write anywhere */
        assert_int_equal(chmod(folder, 0555), 0);
        const vd_status status = vd_picture_save_png(picture, in_folder("locked.png"), NULL);
        assert_int_equal(chmod(folder, 0755), 0);
        assert_int_equal(status.code, VD_ERROR_IO);
        assert_non_null(strstr(status.message, "Permission denied"));
    }
    vd_frame_destroy(&frame);
    vd_picture_destroy(&picture);
    vd_context_destroy(&context);
}

static void links_and_devices_stay(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    vd_picture *picture = made(context, 50, 40, 3, 8), *back = NULL;
    const char *target = in_folder("target.png"), *link = in_folder("link.png");
    assert_ok(vd_picture_save_png(picture, "/dev/null", NULL));
    struct stat info;
    assert_int_equal(stat("/dev/null", &info), 0);
    assert_true(S_ISCHR(info.st_mode));
    FILE *file = fopen(target, "wb");
    assert_non_null(file);
    fclose(file);
    assert_int_equal(symlink("target.png", link), 0);
    assert_ok(vd_picture_save_png(picture, link, NULL));
    assert_int_equal(lstat(link, &info), 0);
    assert_true(S_ISLNK(info.st_mode));
    assert_ok(vd_picture_load(context, target, &back));
    assert_same(picture, back);
    assert_int_equal(unlink(link), 0);
    assert_int_equal(unlink(target), 0);
    vd_picture_destroy(&back);
    vd_picture_destroy(&picture);
    vd_context_destroy(&context);
}

enum { SAVERS = 6 };

static vd_status save(int which, const vd_picture *picture, const vd_frame *frame,
                      const char *path) {
    const vd_picture_text text = {"k", "v"};
    const vd_png_def def = {6, &text, 1};
    vd_comparison comparison;
    vd_picture *difference = NULL;
    vd_status status;
    switch (which) {
    case 0:
        return vd_picture_save_png(picture, path, NULL);
    case 1:
        return vd_frame_save_png(frame, path, &def);
    case 2:
    case 3:
        return vd_frame_save_depth(frame, 0.5, 0.0, path);
    case 4:
        return vd_frame_save_ids(frame, path);
    default:
        status = vd_picture_compare(picture, picture, 0.0, &comparison, &difference);
        assert_int_equal(difference != NULL, status.code == VD_OK);
        vd_picture_destroy(&difference);
        return status;
    }
}

static void every_allocation_may_fail(void **state) {
    (void)state;
#ifdef VEDUTA_HAVE_EXR
    const char *exr = "memory.exr";
#else
    const char *exr = "memory.pfm";
#endif
    const char *names[SAVERS] = {"memory.png", "memory.png", "memory.png",
                                 exr,          "memory.png", "memory.png"};
    for (int which = 0; which < SAVERS; which++) {
        const char *path = in_folder(names[which]);
        FILE *file = fopen(path, "wb");
        assert_non_null(file);
        fputs("before", file);
        fclose(file);
        int failures = 0;
        for (bool done = false; !done;) {
            test_allocator allocator = {0, 0, 0};
            vd_context *context = test_failing_context(&allocator);
            vd_picture *picture = made(context, 30, 20, 3, 8);
            vd_frame *frame = depth_frame(context, 30, 20);
            allocator.fail_at = allocator.calls + failures + 1;
            const vd_status status = save(which, picture, frame, path);
            done = status.code == VD_OK;
            failures += !done;
            assert_true(done || status.code == VD_ERROR_MEMORY);
            allocator.fail_at = 0;
            vd_picture_destroy(&picture);
            vd_frame_destroy(&frame);
            vd_context_destroy(&context);
            assert_int_equal(allocator.live, 0);
            if (!done) {
                char contents[8] = "";
                file = fopen(path, "rb");
                assert_non_null(file);
                assert_int_equal(fread(contents, 1, 7, file), 6);
                fclose(file);
                assert_string_equal(contents, "before");
            }
        }
        assert_true(failures >= 2);
        assert_int_equal(unlink(path), 0);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_layout_and_level_comes_back),
        cmocka_unit_test(text_is_kept),
        cmocka_unit_test(bad_definitions_are_refused),
        cmocka_unit_test(frames_become_rgb_or_straight_rgba),
        cmocka_unit_test(pfm_holds_distances),
        cmocka_unit_test(png_depth_is_relative_to_the_nearest),
#ifdef VEDUTA_HAVE_EXR
        cmocka_unit_test(exr_holds_distances),
#else
        cmocka_unit_test(exr_is_missing),
#endif
        cmocka_unit_test(ids_keep_their_objects),
        cmocka_unit_test(planes_that_are_not_there),
        cmocka_unit_test(places_that_cannot_be_written),
        cmocka_unit_test(links_and_devices_stay),
        cmocka_unit_test(every_allocation_may_fail),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}

/* Reading picture files: every kind of PNG, PGM and PPM, whole and damaged. */
#include <spng.h>
#include <stdio.h>
#include <veduta/picture.h>
#include "image/image.h"
#include "support.h"

enum { WIDTH = 13, HEIGHT = 11, KEY = 1 };

/* One combination of what a PNG header can say. */
typedef struct png_kind {
    int color_type, bit_depth;
    bool transparent, interlaced;
} png_kind;

static const png_kind kinds[] = {
    {0, 1, false, false},  {0, 2, false, false},  {0, 4, false, false}, {0, 8, false, false},
    {0, 16, false, false}, {0, 1, true, false},   {0, 2, true, false},  {0, 4, true, false},
    {0, 8, true, false},   {0, 16, true, false},  {2, 8, false, false}, {2, 16, false, false},
    {2, 8, true, false},   {2, 16, true, false},  {3, 1, false, false}, {3, 2, false, false},
    {3, 4, false, false},  {3, 8, false, false},  {3, 1, true, false},  {3, 2, true, false},
    {3, 4, true, false},   {3, 8, true, false},   {4, 8, false, false}, {4, 16, false, false},
    {6, 8, false, false},  {6, 16, false, false},
};

static int file_channels(const png_kind *kind) {
    static const int channels[7] = {1, 0, 3, 1, 2, 0, 4};
    return channels[kind->color_type];
}

/* The stored value of channel c; about one in eight pixels has KEY in all of them. */
static int stored(const png_kind *kind, int x, int y, int c) {
    const int mask = (1 << kind->bit_depth) - 1;
    uint64_t pixel = (uint64_t)(y * WIDTH + x) * 977u;
    if (test_random(&pixel) % 8 == 0) {
        return KEY;
    }
    uint64_t value = (uint64_t)((y * WIDTH + x) * 4 + c + 1) * 7919u;
    return (int)(test_random(&value) & (uint64_t)mask);
}

static struct spng_plte_entry palette_entry(int index) {
    const struct spng_plte_entry entry = {(uint8_t)(index * 5), (uint8_t)(255 - index),
                                          (uint8_t)(index ^ 77), 0};
    return entry;
}

static uint8_t palette_alpha(int index) {
    return (uint8_t)(index * 31 + 9);
}

static void set_colors(spng_ctx *png, const png_kind *kind) {
    if (kind->color_type == 3) {
        struct spng_plte palette = {0};
        palette.n_entries = 1u << kind->bit_depth;
        for (uint32_t i = 0; i < palette.n_entries; i++) {
            palette.entries[i] = palette_entry((int)i);
        }
        assert_int_equal(spng_set_plte(png, &palette), 0);
    }
    if (kind->transparent) {
        struct spng_trns trns = {0};
        trns.gray = trns.red = trns.green = trns.blue = KEY;
        if (kind->color_type == 3) { /* the last entry stays opaque */
            trns.n_type3_entries = (1u << kind->bit_depth) - 1;
            for (uint32_t i = 0; i < trns.n_type3_entries; i++) {
                trns.type3_alpha[i] = palette_alpha((int)i);
            }
        }
        assert_int_equal(spng_set_trns(png, &trns), 0);
    }
}

/* Makes a PNG of a kind with libspng; the caller frees it. */
static void *make_png(const png_kind *kind, size_t *size) {
    static uint8_t raw[WIDTH * HEIGHT * 8];
    memset(raw, 0, sizeof raw);
    const int channels = file_channels(kind);
    const size_t row_bytes = ((size_t)(WIDTH * channels * kind->bit_depth) + 7) / 8;
    for (int y = 0; y < HEIGHT; y++) {
        for (int i = 0; i < WIDTH * channels; i++) {
            const int value = stored(kind, i / channels, y, i % channels);
            uint8_t *row = raw + (size_t)y * row_bytes;
            if (kind->bit_depth == 16) {
                ((uint16_t *)(void *)row)[i] = (uint16_t)value;
            } else {
                const int bit = i * kind->bit_depth;
                row[bit / 8] |= (uint8_t)(value << (8 - kind->bit_depth - bit % 8));
            }
        }
    }
    spng_ctx *png = spng_ctx_new(SPNG_CTX_ENCODER);
    struct spng_ihdr header = {WIDTH, HEIGHT, (uint8_t)kind->bit_depth, (uint8_t)kind->color_type,
                               0,     0,      kind->interlaced};
    spng_set_option(png, SPNG_ENCODE_TO_BUFFER, 1);
    assert_int_equal(spng_set_ihdr(png, &header), 0);
    set_colors(png, kind);
    assert_int_equal(spng_set_gama(png, 1.0), 0); /* must not matter */
    assert_int_equal(
        spng_encode_image(png, raw, row_bytes * HEIGHT, SPNG_FMT_PNG, SPNG_ENCODE_FINALIZE), 0);
    int error = 0;
    void *data = spng_get_png_buffer(png, size, &error);
    assert_int_equal(error, 0);
    spng_ctx_free(png);
    return data;
}

/* The values that a pixel must have: returns the channels. */
static int expected(const png_kind *kind, int x, int y, int out[4]) {
    const int channels = file_channels(kind), most = (1 << kind->bit_depth) - 1;
    bool key = true;
    for (int c = 0; c < channels; c++) {
        const int value = stored(kind, x, y, c);
        key = key && value == KEY;
        out[c] = kind->bit_depth < 8 ? value * 255 / most : value;
    }
    if (kind->color_type == 3) {
        const int index = stored(kind, x, y, 0);
        const struct spng_plte_entry entry = palette_entry(index);
        out[0] = entry.red;
        out[1] = entry.green;
        out[2] = entry.blue;
        out[3] = index == most ? 255 : palette_alpha(index);
        return kind->transparent ? 4 : 3;
    }
    if (kind->transparent) {
        out[channels] = key ? 0 : kind->bit_depth == 16 ? 65535 : 255;
        return channels + 1;
    }
    return channels;
}

static int value_at(const vd_picture *picture, int x, int y, int c) {
    const int i = x * picture->channels + c;
    return picture->bits == 16 ? ((uint16_t *)vd_picture_row(picture, y))[i]
                               : ((uint8_t *)vd_picture_row(picture, y))[i];
}

static void every_kind_of_png(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    for (size_t i = 0; i < 2 * (sizeof kinds / sizeof kinds[0]); i++) {
        png_kind kind = kinds[i / 2];
        kind.interlaced = i % 2 == 1;
        size_t size = 0;
        void *data = make_png(&kind, &size);
        vd_picture *picture = NULL;
        assert_ok(vd_picture_decode(context, data, size, "made.png", &picture));
        assert_true(picture->width == WIDTH && picture->height == HEIGHT);
        assert_int_equal(picture->bits, kind.bit_depth == 16 ? 16 : 8);
        for (int y = 0; y < HEIGHT; y++) {
            for (int x = 0; x < WIDTH; x++) {
                int want[5];
                assert_int_equal(picture->channels, expected(&kind, x, y, want));
                for (int c = 0; c < picture->channels; c++) {
                    if (value_at(picture, x, y, c) != want[c]) {
                        fail_msg("type %d, %d bits, trns %d, interlaced %d: (%d, %d) channel %d is "
                                 "%d, not %d",
                                 kind.color_type, kind.bit_depth, kind.transparent, kind.interlaced,
                                 x, y, c, value_at(picture, x, y, c), want[c]);
                    }
                }
            }
        }
        vd_picture_destroy(&picture);
        free(data);
    }
    vd_context_destroy(&context);
}

/* Decodes what must fail; checks that the sentence names the file. */
static vd_status refuse(vd_context *context, const void *data, size_t size) {
    vd_picture *picture = NULL;
    /* A copy of exactly this size, so that a sanitizer sees reads behind the end. */
    uint8_t *copy = malloc(size + (size == 0));
    memcpy(copy, data, size);
    const vd_status status = vd_picture_decode(context, copy, size, "bad.file", &picture);
    free(copy);
    assert_int_not_equal(status.code, VD_OK);
    assert_null(picture);
    assert_non_null(strstr(status.message, "bad.file"));
    assert_null(strchr(status.message, '\n'));
    return status;
}

static void truncated_png_says_where(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    vd_picture *picture = NULL;
    assert_ok(vd_picture_create(context, 100, 400, 3, 8, &picture));
    uint64_t random = 3;
    for (size_t i = 0; i < 400 * picture->stride_bytes; i++) {
        ((uint8_t *)picture->data)[i] = (uint8_t)test_random(&random);
    }
    const char *path = VEDUTA_BINARY_DIR "/test_picture_truncated.png";
    assert_ok(vd_picture_save_png(picture, path, NULL));
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    static uint8_t data[400 * 301 * 2];
    const size_t size = fread(data, 1, sizeof data, file);
    fclose(file);
    remove(path);
    assert_true(size > 100000 && size < sizeof data);
    for (size_t length = 0; length < size; length += length < 60 ? 1 : 997) {
        const vd_status status = refuse(context, data, length);
        assert_int_equal(status.code, VD_ERROR_FORMAT);
        if (length >= 8 && length < 60) {
            assert_non_null(strstr(status.message, "truncated"));
        }
    }
    const vd_status status = refuse(context, data, size / 2);
    const char *row = strstr(status.message, "after row ");
    assert_non_null(row);
    int after = 0;
    assert_int_equal(sscanf(row, "after row %d of 400", &after), 1);
    assert_true(after > 150 && after < 210);
    refuse(context, data, size - 12); /* all rows, but no IEND */
    vd_picture_destroy(&picture);
    vd_context_destroy(&context);
}

static void damaged_png_is_refused(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    for (size_t i = 0; i < sizeof kinds / sizeof kinds[0]; i++) {
        size_t size = 0;
        uint8_t *data = make_png(&kinds[i], &size);
        for (size_t at = 0; at < size; at++) { /* every byte counts: a CRC covers all others */
            data[at] ^= 0x10;
            const vd_status status = refuse(context, data, size);
            assert_true(status.code == VD_ERROR_FORMAT || status.code == VD_ERROR_LIMIT);
            data[at] ^= 0x10;
        }
        free(data);
    }
    vd_context_destroy(&context);
}

/* A PNG of one IHDR chunk; its CRC is right. */
static size_t header_only(uint32_t width, uint32_t height, uint8_t out[64]) {
    static const uint8_t start[16] = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n',
                                      0,    0,   0,   13,  'I',  'H',  'D',  'R'};
    memcpy(out, start, sizeof start);
    for (int i = 0; i < 4; i++) {
        out[16 + i] = (uint8_t)(width >> (24 - 8 * i));
        out[20 + i] = (uint8_t)(height >> (24 - 8 * i));
    }
    memcpy(out + 24, "\x08\x06\0\0\0", 5);
    uint32_t crc = 0xffffffffu;
    for (int i = 12; i < 29; i++) {
        crc ^= out[i];
        for (int bit = 0; bit < 8; bit++) {
            crc = crc & 1 ? 0xedb88320u ^ crc >> 1 : crc >> 1;
        }
    }
    for (int i = 0; i < 4; i++) {
        out[29 + i] = (uint8_t)(~crc >> (24 - 8 * i));
    }
    memcpy(out + 33, "\0\0\0\0IDAT\x35\xaf\x06\x1e", 12);
    return 45;
}

static void dimension_bombs_take_no_memory(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    vd_context_memory_reset_peak(context);
    const size_t before = vd_context_memory(context).bytes_peak;
    uint8_t png[64];
    assert_int_equal(refuse(context, png, header_only(65536, 1, png)).code, VD_ERROR_LIMIT);
    assert_int_equal(refuse(context, png, header_only(1, 0x7fffffff, png)).code, VD_ERROR_LIMIT);
    assert_int_equal(refuse(context, png, header_only(65535, 65535, png)).code, VD_ERROR_LIMIT);
    assert_int_equal(refuse(context, png, header_only(65535, 8000, png)).code, VD_ERROR_FORMAT);
    assert_int_equal(refuse(context, png, header_only(0, 8000, png)).code, VD_ERROR_FORMAT);
    const char *pnm[] = {"P5 65535 8000 255\n1234", "P6 8000 65535 65535\n1234",
                         "P2 65535 8000 255\n1 2 3"};
    for (size_t i = 0; i < sizeof pnm / sizeof pnm[0]; i++) {
        const vd_status status = refuse(context, pnm[i], strlen(pnm[i]));
        assert_int_equal(status.code, VD_ERROR_FORMAT);
        assert_non_null(strstr(status.message, "truncated after row 0"));
    }
    assert_int_equal(refuse(context, "P5 65536 1 255\n1", 16).code, VD_ERROR_LIMIT);
    assert_int_equal(refuse(context, "P5 99999999999 1 255\n1", 22).code, VD_ERROR_LIMIT);
    assert_int_equal(vd_context_memory(context).bytes_peak, before);
    vd_context_destroy(&context);
}

static void every_kind_of_pnm(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    const struct {
        const char *data;
        size_t size;
        int channels, bits;
        int values[12];
    } cases[] = {
        {"P2\n# made by hand\n2 3 # size\n9\n0 1\n2 3 # a comment\n4\t9",
         0,
         1,
         8,
         {0, 1, 2, 3, 4, 9}},
        {"P2 2 3 300 0 1 2 300 4 5\n", 0, 1, 16, {0, 1, 2, 300, 4, 5}},
        {"P3 2 3 255\n1 2 3 4 5 6\n7 8 9 10 11 12\n1 1 1 2 2 2 trailing",
         0,
         3,
         8,
         {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12}},
        {"P5 2 3 200\n\x01\x02\xff\x04#\n", 0, 1, 8, {1, 2, 255, 4, '#', '\n'}},
        {"P5\r\n2 3\r65535 \x01\x02\xff\xfe\0\0\0\1\0\2\0\3", 29, 1, 16, {258, 65534, 0, 1, 2, 3}},
        {"P6 2 3 255\nabcdefghijklmnopqr and more",
         0,
         3,
         8,
         {'a', 'b', 'c', 'd', 'e', 'f', 'g', 'h', 'i', 'j', 'k', 'l'}},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        const size_t size = cases[i].size ? cases[i].size : strlen(cases[i].data);
        vd_picture *picture = NULL;
        assert_ok(vd_picture_decode(context, cases[i].data, size, "made.pnm", &picture));
        assert_true(picture->width == 2 && picture->height == 3);
        assert_int_equal(picture->channels, cases[i].channels);
        assert_int_equal(picture->bits, cases[i].bits);
        const int row_values = 2 * picture->channels;
        for (int v = 0; v < 2 * row_values; v++) {
            assert_int_equal(value_at(picture, 0, v / row_values, v % row_values),
                             cases[i].values[v]);
        }
        vd_picture_destroy(&picture);
    }
    vd_context_destroy(&context);
}

static void bad_pnm_is_refused(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    const struct {
        const char *data, *sentence;
    } cases[] = {
        {"P5", "neither PNG nor PGM"},
        {"P5 ", "no width"},
        {"P5 x 3 255\nabc", "no width"},
        {"P5 3", "no height"},
        {"P5 3 -1 255\nabc", "no height"},
        {"P5 3 1", "no maxval"},
        {"P5 3 1 0\nabc", "maxval"},
        {"P5 3 1 65536\nabc", "maxval"},
        {"P5 0 1 255\nabc", "0 × 1"},
        {"P5 3 1 255abc", "does not end"},
        {"P5 3 1 255", "truncated after row 0 of 1"},
        {"P5 3 2 255\nabcde", "truncated after row 1 of 2"},
        {"P5 2 2 256\nabcdefg", "truncated after row 1 of 2"},
        {"P2 2 2 99\n 10 20 30    ", "truncated after row 1 of 2"},
        {"P2 2 2 9\n1 2 3 x", "row 2 holds something that is not a number"},
        {"P2 2 2 9\n1 2 3 -4", "row 2 holds something that is not a number"},
        {"P2 2 2 9\n1 2 10 4", "row 2 holds a value above the maxval of 9"},
        {"P2 2 2 9\n1 2 4294967297 4", "above the maxval"},
        {"P1 2 2\n1 0 0 1", "P1"},
        {"P4 8 1\nx", "P4"},
        {"P7\nWIDTH 1\n", "P7"},
        {"", "empty"},
        {"II*\0", "neither PNG nor PGM nor PPM"},
        {"Phew, a text", "neither PNG nor PGM nor PPM"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        const vd_status status = refuse(context, cases[i].data, strlen(cases[i].data));
        assert_int_equal(status.code, VD_ERROR_FORMAT);
        if (!strstr(status.message, cases[i].sentence)) {
            fail_msg("\"%s\" is not in \"%s\"", cases[i].sentence, status.message);
        }
    }
    vd_context_destroy(&context);
}

static void missing_files_are_named(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    vd_picture *picture = NULL;
    const char *paths[] = {VEDUTA_BINARY_DIR "/there-is-no/such.png", VEDUTA_BINARY_DIR};
    for (int i = 0; i < 2; i++) {
        const vd_status status = vd_picture_load(context, paths[i], &picture);
        assert_int_equal(status.code, VD_ERROR_IO);
        assert_non_null(strstr(status.message, paths[i]));
        assert_null(picture);
    }
    vd_context_destroy(&context);
}

static void every_allocation_may_fail(void **state) {
    (void)state;
    const png_kind kind = {6, 16, false, true};
    size_t size = 0;
    void *data = make_png(&kind, &size);
    const char *path = VEDUTA_BINARY_DIR "/test_picture_memory.png";
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(data, 1, size, file), size);
    fclose(file);
    free(data);
    const char *text = "P2 2 2 9\n1 2 3 4";
    bool done = false;
    int failures = 0;
    for (int n = 1; !done; n++) {
        test_allocator allocator = {0, 0, 0};
        vd_context *context = test_failing_context(&allocator);
        allocator.fail_at = allocator.calls + n;
        vd_picture *picture = NULL, *other = NULL;
        vd_status status = vd_picture_load(context, path, &picture);
        if (status.code == VD_OK) {
            status = vd_picture_decode(context, text, strlen(text), "made.pnm", &other);
        }
        done = status.code == VD_OK;
        failures += !done;
        assert_true(done || (status.code == VD_ERROR_MEMORY && !other));
        vd_picture_destroy(&picture);
        vd_picture_destroy(&other);
        vd_context_destroy(&context);
        assert_int_equal(allocator.live, 0);
    }
    assert_true(failures >= 5); /* file, picture, pixels; picture, pixels */
    remove(path);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_kind_of_png),       cmocka_unit_test(truncated_png_says_where),
        cmocka_unit_test(damaged_png_is_refused),  cmocka_unit_test(dimension_bombs_take_no_memory),
        cmocka_unit_test(every_kind_of_pnm),       cmocka_unit_test(bad_pnm_is_refused),
        cmocka_unit_test(missing_files_are_named), cmocka_unit_test(every_allocation_may_fail),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

/* test_particle_source.c: readers of particles: what they read, and what they say of bad files. */
#include "support.h"

#include <math.h>
#include <stdio.h>
#include <veduta/particle_source.h>

static vd_context *context;

static int set_up(void **state) {
    (void)state;
    context = test_context(1, VD_ISA_AUTO);
    return 0;
}

static int tear_down(void **state) {
    (void)state;
    vd_context_destroy(&context);
    return 0;
}

/* All of a small source. */
enum { MOST = 64 };
static double xs[MOST], ys[MOST], zs[MOST];
static float values[VD_MAX_ATTRIBUTES][MOST];
static vd_particle_source *source;

static vd_status read_some(size_t capacity, size_t *count) {
    vd_particle_batch batch = {.capacity = capacity, .x = xs, .y = ys, .z = zs};
    for (int a = 0; a < VD_MAX_ATTRIBUTES; a++) {
        batch.values[a] = values[a];
    }
    vd_status status = vd_particle_source_read(source, &batch);
    *count = batch.count;
    return status;
}

static void open_bytes(const void *data, size_t bytes, const vd_particle_source_def *def) {
    assert_ok(vd_particle_source_open_memory(context, data, bytes, "test", def, &source));
}

static void read_all(size_t expected) {
    size_t count = 0;
    assert_ok(read_some(MOST, &count));
    assert_int_equal(count, expected);
    assert_ok(vd_particle_source_rewind(source)); /* again, three at a time */
    size_t total = 0;
    do {
        assert_ok(read_some(3, &count));
        total += count;
    } while (count > 0);
    assert_int_equal(total, expected);
    assert_true(vd_particle_source_progress(source) == 1.0);
    assert_ok(vd_particle_source_rewind(source));
    assert_ok(read_some(MOST, &count));
}

static void done(void) {
    vd_particle_source_destroy(&source);
}

/* Expects a failure, when opened or when read, with these words. */
static void fails(const void *data, size_t bytes, const vd_particle_source_def *def, vd_code code,
                  const char *words) {
    vd_status status = vd_particle_source_open_memory(context, data, bytes, "test", def, &source);
    size_t count = 1;
    while (status.code == VD_OK && count > 0) {
        status = read_some(MOST, &count);
    }
    if (status.code != code || strstr(status.message, words) == NULL) {
        fail_msg("expected \"%s\" (%s): %s (%s)", words, vd_code_name(code), status.message,
                 vd_code_name(status.code));
    }
    vd_particle_source_destroy(&source);
}

static void fails_text(const char *text, vd_code code, const char *words) {
    fails(text, strlen(text), NULL, code, words);
}

/* ---- LAS ----------------------------------------------------------------------------------------
 */

static void put(uint8_t *at, const void *data, size_t bytes) {
    memcpy(at, data, bytes);
}

#define PUT(at, type, value)                                                                       \
    do {                                                                                           \
        type put_ = (type)(value);                                                                 \
        put(at, &put_, sizeof put_);                                                               \
    } while (0)

static const uint8_t las_bytes[11] = {20, 28, 26, 34, 57, 63, 30, 36, 38, 59, 67};

/* A LAS 1.4 of `count` points of a format, with two bytes more a point than it needs. */
static size_t make_las(uint8_t *out, int format, int count, uint32_t rgb) {
    const size_t stride = las_bytes[format] + 2u, begin = 375;
    memset(out, 0, begin + stride * (size_t)count);
    memcpy(out, "LASF", 4);
    out[24] = 1;
    out[25] = 4;
    PUT(out + 94, uint16_t, 375);
    PUT(out + 96, uint32_t, begin);
    out[104] = (uint8_t)format;
    PUT(out + 105, uint16_t, stride);
    PUT(out + 247, uint64_t, count);
    for (int k = 0; k < 3; k++) {
        PUT(out + 131 + 8 * k, double, 0.5);
        PUT(out + 155 + 8 * k, double, 1000.0 * (k + 1));
    }
    const int color_at = format == 2 ? 20 : format == 3 || format == 5 ? 28 : 30;
    for (int i = 0; i < count; i++) {
        uint8_t *p = out + begin + stride * (size_t)i;
        PUT(p, int32_t, i);
        PUT(p + 4, int32_t, -i);
        PUT(p + 8, int32_t, 2 * i);
        PUT(p + 12, uint16_t, 100 + i);
        p[14] = 2;
        p[format >= 6 ? 16 : 15] = (uint8_t)(i % 20);
        if (format == 2 || format == 3 || format == 5 || format == 7 || format == 8 ||
            format == 10) {
            PUT(p + color_at, uint16_t, rgb);
            PUT(p + color_at + 2, uint16_t, rgb / 2);
        }
    }
    return begin + stride * (size_t)count;
}

static void test_las_formats(void **state) {
    (void)state;
    static uint8_t file[8192];
    for (int format = 0; format <= 10; format++) {
        const size_t bytes = make_las(file, format, 30, 65535);
        open_bytes(file, bytes, NULL);
        read_all(30);
        assert_true(xs[7] == 1003.5 && ys[7] == 1996.5 && zs[7] == 3007.0);
        const int class_at = vd_particle_source_find(source, "class");
        assert_true(values[vd_particle_source_find(source, "intensity")][7] == 107.0f);
        assert_true(values[class_at][7] == 7.0f);
        assert_int_equal(source->attributes[class_at].kind, VD_ATTRIBUTE_CATEGORY);
        assert_true(values[vd_particle_source_find(source, "return")][7] == 2.0f);
        const bool colored =
            format == 2 || format == 3 || format == 5 || format == 7 || format == 8 || format == 10;
        assert_int_equal(vd_particle_source_find(source, "red") >= 0, colored);
        if (colored) {
            assert_true(values[vd_particle_source_find(source, "red")][7] == 255.0f);
        }
        assert_int_equal(vd_particle_source_find(source, "near_infrared") >= 0,
                         format == 8 || format == 10);
        done();
    }
}

static void test_las_colors(void **state) {
    (void)state;
    static uint8_t file[8192];
    open_bytes(file, make_las(file, 3, 30, 200), NULL); /* 8 bits */
    read_all(30);
    assert_true(values[vd_particle_source_find(source, "red")][0] == 200.0f);
    done();
    open_bytes(file, make_las(file, 3, 30, 0), NULL); /* none */
    assert_int_equal(vd_particle_source_find(source, "red"), -1);
    done();
}

static void test_las_bad(void **state) {
    (void)state;
    static uint8_t file[8192];
    size_t bytes = make_las(file, 1, 30, 0);
    fails(file, bytes - 1, NULL, VD_ERROR_FORMAT, "promises 30 points");
    fails(file, 200, NULL, VD_ERROR_FORMAT, "header");
    PUT(file + 247, uint64_t, 10000000000u);
    fails(file, bytes, NULL, VD_ERROR_FORMAT, "promises 10000000000 points");
    PUT(file + 247, uint64_t, UINT64_MAX);
    fails(file, bytes, NULL, VD_ERROR_FORMAT, "promises");
    bytes = make_las(file, 1, 30, 0);
    file[104] |= 0x80;
    fails(file, bytes, NULL, VD_ERROR_UNSUPPORTED, "laszip -i");
    file[104] = 11;
    fails(file, bytes, NULL, VD_ERROR_UNSUPPORTED, "format 11");
    file[104] = 3;
    fails(file, bytes, NULL, VD_ERROR_FORMAT, "shorter than their format");
    make_las(file, 1, 30, 0);
    file[25] = 5;
    fails(file, bytes, NULL, VD_ERROR_UNSUPPORTED, "LAS 1.5");
    make_las(file, 1, 30, 0);
    PUT(file + 131, double, NAN);
    fails(file, bytes, NULL, VD_ERROR_FORMAT, "scale");
    make_las(file, 1, 30, 0);
    PUT(file + 96, uint32_t, UINT32_MAX);
    fails(file, bytes, NULL, VD_ERROR_FORMAT, "outside the file");
    bytes = make_las(file, 1, 0, 0);
    open_bytes(file, bytes, NULL);
    read_all(0);
    done();
}

/* ---- PLY ----------------------------------------------------------------------------------------
 */

static void test_ply_ascii(void **state) {
    (void)state;
    const char *text = "ply\r\nformat ascii 1.0\ncomment made by hand\nelement vertex 3\n"
                       "property float x\nproperty float y\nproperty double z\n"
                       "property uchar red\nproperty uchar green\nproperty uchar blue\n"
                       "property float nx\nend_header\n"
                       "1 2 3 10 20 30 0\n-1e1 nan 0.5\n 1 2 3 0.25\n7 8 9 4 5 6 1";
    open_bytes(text, strlen(text), NULL);
    assert_int_equal(source->count, 3);
    read_all(3);
    assert_true(xs[1] == -10.0 && isnan(ys[1]) && zs[1] == 0.5 && zs[2] == 9.0);
    assert_true(values[vd_particle_source_find(source, "blue")][0] == 30.0f);
    assert_true(values[vd_particle_source_find(source, "nx")][1] == 0.25f);
    done();
}

static size_t make_ply(uint8_t *out, bool big, int count) {
    size_t at = (size_t)sprintf((char *)out,
                                "ply\nformat binary_%s_endian 1.0\nelement camera 2\n"
                                "property short a\nelement vertex %d\nproperty float x\n"
                                "property float y\nproperty float z\nproperty ushort class\n"
                                "property float red\nend_header\n",
                                big ? "big" : "little", count);
    at += 4;
    for (int i = 0; i < count; i++) {
        const float numbers[4] = {(float)i, -2.0f, 0.5f, 1.0f};
        const uint16_t class = 258;
        uint8_t record[18];
        for (int k = 0; k < 4; k++) {
            memcpy(record + (k < 3 ? 4 * k : 14), &numbers[k], 4);
        }
        memcpy(record + 12, &class, 2);
        static const int sizes[5] = {4, 4, 4, 2, 4};
        for (int k = 0, from = 0; k < 5; from += sizes[k++]) {
            for (int b = 0; b < sizes[k]; b++) {
                out[at + (size_t)(from + (big ? sizes[k] - 1 - b : b))] = record[from + b];
            }
        }
        at += 18;
    }
    return at;
}

static void test_ply_binary(void **state) {
    (void)state;
    static uint8_t file[4096];
    for (int big = 0; big < 2; big++) {
        open_bytes(file, make_ply(file, big != 0, 10), NULL);
        read_all(10);
        assert_true(xs[9] == 9.0 && ys[9] == -2.0 && zs[9] == 0.5);
        assert_true(values[0][3] == 258.0f && values[1][3] == 255.0f);
        assert_int_equal(source->attributes[0].kind, VD_ATTRIBUTE_CATEGORY);
        done();
    }
}

static void test_ply_bad(void **state) {
    (void)state;
    static uint8_t file[4096];
    const size_t bytes = make_ply(file, false, 10);
    fails(file, bytes - 1, NULL, VD_ERROR_FORMAT, "promises 10 vertices");
    fails_text("ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n1\n",
               VD_ERROR_FORMAT, "lack x, y or z");
    fails_text("ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\n"
               "property float z\nend_header\n1 2 3\n",
               VD_ERROR_FORMAT, "ends after 1 of 2");
    fails_text("ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
               "property float z\nend_header\n1 2 three\n",
               VD_ERROR_FORMAT, "vertex 0 is not 3 numbers");
    fails_text("ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nelement face 1\n",
               VD_ERROR_UNSUPPORTED, "it is a mesh");
    fails_text("ply\nformat ascii 1.0\n", VD_ERROR_FORMAT, "no end");
    fails_text("ply\nformat middle 1.0\nend_header\n", VD_ERROR_FORMAT, "none of ascii");
    fails_text("ply\nformat ascii 1.0\nend_header\n", VD_ERROR_FORMAT, "no vertices");
    fails_text("ply\nformat ascii 1.0\nelement vertex 1\nproperty list uchar int x\nend_header\n",
               VD_ERROR_FORMAT, "list");
    fails_text("ply\nformat binary_little_endian 1.0\nelement vertex 9000000000000000\n"
               "property float x\nproperty float y\nproperty float z\nend_header\n",
               VD_ERROR_FORMAT, "promises");
}

/* ---- text and raw -------------------------------------------------------------------------------
 */

static void test_text_names(void **state) {
    (void)state;
    static const struct {
        const char *text;
        size_t rows;
        const char *attribute;
        float first;
    } cases[] = {
        {"x,y,z,mass\n1,2,3,4\n5,6,7,8\n", 2, "mass", 4.0f},
        {"mass;z;y;x\n4;3;2;1\n8;7;6;5", 2, "mass", 4.0f},
        {"# x y z temperature\n1 2 3 4\n\n5 6 7 8\n", 2, "temperature", 4.0f},
        {"X\tY\tZ\tR\n1\t2\t3\t4\n5\t6\t7\t8\n", 2, "red", 4.0f},
        {"1 2 3 4\r\n5 6 7 8\r\n", 2, "column4", 4.0f},
        {"2\n1 2 3 4\n5 6 7 8\n", 2, "column4", 4.0f},
        {"\"x\", \"y\", \"z\", \"name\", w\n1, 2, 3, \"Sirius, A\", 4\n5,6,7,Vega,8\n", 2, "w",
         4.0f},
        {"// made by hand\nx,y,z,w\n1,2,3,4\n# in between\n5,6,7,8\n", 2, "w", 4.0f},
        {"x,y,z,w\n1,2,3,\n5,6,7,8\n", 2, "w", NAN},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        open_bytes(cases[i].text, strlen(cases[i].text), NULL);
        read_all(cases[i].rows);
        assert_true(xs[0] == 1.0 && ys[0] == 2.0 && zs[0] == 3.0 && zs[1] == 7.0);
        const int a = vd_particle_source_find(source, cases[i].attribute);
        if (a < 0) {
            fail_msg("case %zu has no %s", i, cases[i].attribute);
        }
        assert_true(values[a][0] == cases[i].first ||
                    (isnan(values[a][0]) && isnan(cases[i].first)));
        done();
    }
}

static void test_text_sky(void **state) {
    (void)state;
    const char *text = "ra_hours,dec,parallax,mag\n6,0,100,1\n0,90,10,2\n12,0,0,3\n12,0,-5,3\n";
    open_bytes(text, strlen(text), NULL);
    read_all(4);
    assert_true(fabs(xs[0]) < 1e-12 && fabs(ys[0] - 10.0) < 1e-12);
    assert_true(fabs(zs[1] - 100.0) < 1e-12);
    assert_true(fabs(xs[2] + 1.0) < 1e-12); /* without a distance: the unit sphere */
    assert_true(isnan(xs[3]));
    done();
    vd_particle_source_def def = vd_particle_source_def_default();
    def.columns = "-,z,x,y";
    open_bytes("9 3 1 2\n", 8, &def);
    read_all(1);
    assert_true(xs[0] == 1.0 && ys[0] == 2.0 && zs[0] == 3.0);
    assert_int_equal(source->attribute_count, 0);
    done();
}

static void test_text_bad(void **state) {
    (void)state;
    fails_text("x,y,z\n1,2,3\n4,5\n", VD_ERROR_FORMAT,
               "line 3 has 2 columns where the first has 3");
    fails_text("a,b,c\n1,2,3\n", VD_ERROR_FORMAT, "--columns");
    fails_text("x,y,z,w\n1,2,3\n", VD_ERROR_FORMAT, "3 columns (256 at most) and 4 names");
    fails_text("hello\n", VD_ERROR_FORMAT, "--columns");
    fails_text("\n\n", VD_ERROR_FORMAT, "no rows");
    fails("", 0, NULL, VD_ERROR_FORMAT, "empty");
    fails("\x89HDF\r\n\x1a\n", 8, NULL, VD_ERROR_UNSUPPORTED, "HDF5");
    fails("VDBRICKS", 8, NULL, VD_ERROR_UNSUPPORTED, "brick file already");
    fails("GIF89a\0\0\0", 9, NULL, VD_ERROR_UNSUPPORTED, "--raw");
    vd_particle_source_def def = vd_particle_source_def_default();
    def.columns = "x,y";
    fails("1 2 3\n", 6, &def, VD_ERROR_ARGUMENT, "2 names");
}

static void test_raw(void **state) {
    (void)state;
    const uint8_t big[] = {0, 1, 0, 2, 255, 255, 0, 9, 0, 4, 0, 5, 0, 6, 0, 7};
    vd_particle_source_def def = vd_particle_source_def_default();
    def.raw = "i16";
    def.raw_big_endian = true;
    def.columns = "x,y,z,mass";
    open_bytes(big, sizeof big, &def);
    read_all(2);
    assert_true(xs[0] == 1.0 && zs[0] == -1.0 && values[0][0] == 9.0f && values[0][1] == 7.0f);
    done();
    def.raw_offset_bytes = 8;
    open_bytes(big, sizeof big, &def);
    read_all(1);
    done();
    fails(big, 15, &def, VD_ERROR_FORMAT, "not whole particles");
    def.raw = "f16";
    fails(big, 16, &def, VD_ERROR_ARGUMENT, "f16");
    def.raw = "f32";
    def.columns = "x,y,mass";
    fails(big, 12, &def, VD_ERROR_ARGUMENT, "need x, y and z");
}

static void test_probe(void **state) {
    (void)state;
    assert_int_equal(vd_particle_file_probe("/no/such/file"), VD_PARTICLE_FILE_NONE);
    const char *path = VEDUTA_BINARY_DIR "/probe.ply";
    static const struct {
        const char *text;
        vd_particle_file kind;
    } cases[] = {
        {"ply\nelement vertex 3\nelement face 0\nend_header\n", VD_PARTICLE_FILE_PLY},
        {"ply\nelement vertex 3\nelement face 2\nend_header\n", VD_PARTICLE_FILE_NONE},
        {"LASF", VD_PARTICLE_FILE_LAS},
        {"VDBRICKS", VD_PARTICLE_FILE_BRICKS},
        {"\x89HDF\r\n\x1a\n", VD_PARTICLE_FILE_HDF5},
        {"1 2 3", VD_PARTICLE_FILE_NONE},
        {"", VD_PARTICLE_FILE_NONE},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        FILE *file = fopen(path, "wb");
        assert_non_null(file);
        fwrite(cases[i].text, 1, strlen(cases[i].text), file);
        fclose(file);
        assert_int_equal(vd_particle_file_probe(path), cases[i].kind);
    }
    remove(path);
    path = VEDUTA_BINARY_DIR "/probe.txt";
    static const char *const texts[] = {"1 2 3\n", "NCOLS 3\nnrows 2\n", "DSAA\n"};
    for (int i = 0; i < 3; i++) {
        FILE *file = fopen(path, "wb");
        assert_non_null(file);
        fputs(texts[i], file);
        fclose(file);
        assert_int_equal(vd_particle_file_probe(path),
                         i == 0 ? VD_PARTICLE_FILE_TEXT : VD_PARTICLE_FILE_NONE);
    }
    remove(path);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_las_formats), cmocka_unit_test(test_las_colors),
        cmocka_unit_test(test_las_bad),     cmocka_unit_test(test_ply_ascii),
        cmocka_unit_test(test_ply_binary),  cmocka_unit_test(test_ply_bad),
        cmocka_unit_test(test_text_names),  cmocka_unit_test(test_text_sky),
        cmocka_unit_test(test_text_bad),    cmocka_unit_test(test_raw),
        cmocka_unit_test(test_probe),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}

/* test_snapshot.c: HDF5 snapshots as Gadget, AREPO and SWIFT lay them out. */
#include "support.h"

#include <hdf5.h>
#include <math.h>
#include <stdio.h>
#include <unistd.h>
#include <veduta/snapshot.h>

static vd_context *context;
static char folder[] = VEDUTA_BINARY_DIR "/test-snapshot-XXXXXX";

static int set_up(void **state) {
    (void)state;
    context = test_context(1, VD_ISA_AUTO);
    return test_enter_folder(folder);
}

static int tear_down(void **state) {
    (void)state;
    vd_context_destroy(&context);
    return test_leave_folder(folder);
}

/* ---- writing ------------------------------------------------------------------------------------
 */

static void write_dataset(hid_t group, const char *name, hsize_t rows, hsize_t width,
                          double first) {
    const hsize_t dims[2] = {rows, width};
    double *data = malloc((size_t)(rows * width) * sizeof *data);
    for (hsize_t i = 0; i < rows * width; i++) {
        data[i] = first + (double)i;
    }
    const hid_t space = H5Screate_simple(width == 1 ? 1 : 2, dims, NULL);
    const hid_t set =
        H5Dcreate2(group, name, H5T_IEEE_F32LE, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
    assert_true(H5Dwrite(set, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, data) >= 0);
    H5Dclose(set);
    H5Sclose(space);
    free(data);
}

static void write_header(hid_t group, const char *name, hsize_t count, const double *numbers) {
    const hid_t space = H5Screate_simple(1, &count, NULL);
    const hid_t attribute =
        H5Acreate2(group, name, H5T_IEEE_F64LE, space, H5P_DEFAULT, H5P_DEFAULT);
    assert_true(H5Awrite(attribute, H5T_NATIVE_DOUBLE, numbers) >= 0);
    H5Aclose(attribute);
    H5Sclose(space);
}

typedef struct layout {
    int type, files;
    const char *smoothing; /* null: none */
    bool masses, table;
} layout;

static void write_snapshot(const char *path, const layout *l, hsize_t rows, double first) {
    const hid_t file = H5Fcreate(path, H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
    assert_true(file >= 0);
    const hid_t header = H5Gcreate2(file, "Header", H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
    const double files = l->files, table[6] = {0, 2.5, 0, 0, 0, 0};
    double total[6] = {0};
    total[l->type] = (double)rows * files;
    write_header(header, "NumFilesPerSnapshot", 1, &files);
    write_header(header, "NumPart_Total", 6, total);
    if (l->table) {
        write_header(header, "MassTable", 6, table);
    }
    H5Gclose(header);
    char name[16];
    snprintf(name, sizeof name, "PartType%d", l->type);
    const hid_t group = H5Gcreate2(file, name, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
    if (rows > 0) {
        write_dataset(group, "Coordinates", rows, 3, first);
        write_dataset(group, "Velocities", rows, 3, 3.0);
        write_dataset(group, "ParticleIDs", rows, 1, 1.0);
        write_dataset(group, "Density", rows, 1, 10.0);
        write_dataset(group, "Flags", rows, 2, 10.0);
        if (l->masses) {
            write_dataset(group, "Masses", rows, 1, 100.0);
        }
        if (l->smoothing != NULL) {
            write_dataset(group, l->smoothing, rows, 1, 8.0);
        }
    }
    H5Gclose(group);
    H5Fclose(file);
}

/* ---- reading ------------------------------------------------------------------------------------
 */

enum { MOST = 100 };
static double xs[MOST], ys[MOST], zs[MOST];
static float values[VD_MAX_ATTRIBUTES][MOST];

static size_t read_all(vd_particle_source *source, size_t capacity) {
    vd_particle_batch batch = {.capacity = 0, .x = xs, .y = ys, .z = zs};
    for (int a = 0; a < VD_MAX_ATTRIBUTES; a++) {
        batch.values[a] = values[a];
    }
    size_t before;
    assert_ok(vd_particle_source_rewind(source));
    do {
        before = batch.count;
        batch.capacity = before + capacity < MOST ? before + capacity : MOST;
        assert_ok(vd_particle_source_read(source, &batch));
    } while (batch.count > before);
    assert_true(vd_particle_source_progress(source) == 1.0);
    return batch.count;
}

static vd_particle_source *open_snapshot(const char *path, int type, bool whole) {
    const vd_snapshot_def def = {type, whole};
    vd_particle_source *source = NULL;
    assert_ok(vd_snapshot_open(context, path, &def, &source));
    return source;
}

static float value_of(vd_particle_source *source, const char *name, size_t i) {
    const int at = vd_particle_source_find(source, name);
    if (at < 0) {
        fail_msg("there is no %s", name);
    }
    return values[at][i];
}

static void test_layouts(void **state) {
    (void)state;
    static const struct {
        layout layout;
        float radius, mass; /* of particle 2; NaN: none */
    } cases[] = {
        {{0, 1, "SmoothingLength", true, false}, 5.0f, 102.0f},   /* Gadget */
        {{0, 1, "SmoothingLengths", true, false}, 10.0f, 102.0f}, /* SWIFT */
        {{0, 1, NULL, true, false}, NAN, 102.0f},                 /* AREPO */
        {{1, 1, NULL, false, true}, NAN, 2.5f},                   /* dark matter */
        {{1, 1, NULL, false, false}, NAN, NAN},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        write_snapshot("snap.hdf5", &cases[i].layout, 10, 1.0);
        vd_particle_source *source = open_snapshot("snap.hdf5", -1, true);
        assert_int_equal(source->count, 10);
        assert_int_equal(read_all(source, 3), 10);
        assert_int_equal(read_all(source, MOST), 10);
        assert_true(xs[2] == 7.0 && ys[2] == 8.0 && zs[2] == 9.0);
        assert_true(value_of(source, "Density", 2) == 12.0f);
        assert_true(fabs((double)value_of(source, "Velocities", 0) - sqrt(9 + 16 + 25)) < 1e-6);
        assert_int_equal(vd_particle_source_find(source, "ParticleIDs"), -1);
        assert_int_equal(vd_particle_source_find(source, "Flags"), -1);
        if (isnan(cases[i].radius)) {
            assert_int_equal(vd_particle_source_find(source, "radius"), -1);
        } else {
            assert_true(value_of(source, "radius", 2) == cases[i].radius);
        }
        if (isnan(cases[i].mass)) {
            assert_int_equal(vd_particle_source_find(source, "mass"), -1);
        } else {
            assert_true(value_of(source, "mass", 2) == cases[i].mass);
        }
        vd_particle_source_destroy(&source);
    }
}

static void test_several_files(void **state) {
    (void)state;
    const layout l = {0, 3, "SmoothingLength", true, false};
    write_snapshot("snap_9.0.hdf5", &l, 10, 0.0);
    write_snapshot("snap_9.1.hdf5", &l, 0, 0.0); /* a file without particles */
    write_snapshot("snap_9.2.hdf5", &l, 20, 500.0);
    vd_particle_source *source = open_snapshot("snap_9.2.hdf5", -1, true);
    assert_int_equal(read_all(source, 7), 30);
    assert_true(xs[9] == 27.0 && xs[10] == 500.0 && zs[29] == 559.0);
    vd_particle_source_destroy(&source);
    source = open_snapshot("snap_9.0.hdf5", -1, false);
    assert_int_equal(read_all(source, MOST), 10);
    vd_particle_source_destroy(&source);
    assert_int_equal(remove("snap_9.1.hdf5"), 0);
    source = open_snapshot("snap_9.0.hdf5", 0, true);
    vd_particle_batch batch = {.capacity = MOST, .x = xs, .y = ys, .z = zs};
    for (int a = 0; a < VD_MAX_ATTRIBUTES; a++) {
        batch.values[a] = values[a];
    }
    vd_status status = vd_particle_source_read(source, &batch);
    assert_int_equal(status.code, VD_ERROR_IO);
    assert_non_null(strstr(status.message, "snap_9.1.hdf5"));
    vd_particle_source_destroy(&source);
}

static void fails(const char *path, int type, vd_code code, const char *words) {
    const vd_snapshot_def def = {type, true};
    vd_particle_source *source = NULL;
    vd_status status = vd_snapshot_open(context, path, &def, &source);
    if (status.code != code || strstr(status.message, words) == NULL) {
        fail_msg("expected \"%s\": %s (%s)", words, status.message, vd_code_name(status.code));
    }
    assert_null(source);
}

static void test_bad(void **state) {
    (void)state;
    fails("nothing.hdf5", -1, VD_ERROR_IO, "nothing.hdf5");
    FILE *file = fopen("text.hdf5", "wb");
    fputs("hello", file);
    fclose(file);
    fails("text.hdf5", -1, VD_ERROR_FORMAT, "no HDF5 file");
    hid_t handle = H5Fcreate("empty.hdf5", H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
    H5Fclose(handle);
    fails("empty.hdf5", -1, VD_ERROR_FORMAT, "PartType0 to 5 has no Coordinates");
    const layout l = {1, 1, NULL, false, false};
    write_snapshot("snap.hdf5", &l, 10, 0.0);
    fails("snap.hdf5", 0, VD_ERROR_FORMAT, "PartType0 has no Coordinates");
    fails("snap.hdf5", 6, VD_ERROR_ARGUMENT, "not 6");
    write_snapshot("none.hdf5", &l, 0, 0.0);
    fails("none.hdf5", -1, VD_ERROR_FORMAT, "no Coordinates");
    /* Coordinates that are not [n][3]. */
    handle = H5Fcreate("flat.hdf5", H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
    const hid_t group = H5Gcreate2(handle, "PartType0", H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
    write_dataset(group, "Coordinates", 10, 2, 0.0);
    H5Gclose(group);
    H5Fclose(handle);
    fails("flat.hdf5", -1, VD_ERROR_FORMAT, "no Coordinates of shape [n][3]");
}

/* Damaged files give an error or other numbers, never a crash. */
static void test_damaged(void **state) {
    (void)state;
    const layout l = {0, 1, "SmoothingLength", true, false};
    write_snapshot("good.hdf5", &l, 20, 0.0);
    static uint8_t data[1 << 16];
    FILE *file = fopen("good.hdf5", "rb");
    const size_t bytes = fread(data, 1, sizeof data, file);
    fclose(file);
    for (size_t cut = 0; cut < bytes; cut += 997) {
        file = fopen("cut.hdf5", "wb");
        fwrite(data, 1, cut, file);
        fclose(file);
        vd_particle_source *source = NULL;
        vd_status status = vd_snapshot_open(context, "cut.hdf5", NULL, &source);
        assert_int_not_equal(status.code, VD_OK);
        assert_null(source);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_layouts),
        cmocka_unit_test(test_several_files),
        cmocka_unit_test(test_bad),
        cmocka_unit_test(test_damaged),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}

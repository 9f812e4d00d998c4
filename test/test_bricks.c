/* test_bricks.c: brick files: what goes in comes out, the tree keeps areas, damage is said. */
#include "support.h"

#include <math.h>
#include <stdio.h>
#include <sys/stat.h>
#include <unistd.h>
#include <veduta/bricks.h>
#include "splat/brick_format.h"

static vd_context *context;
static size_t bytes_at_first;
static char folder[] = VEDUTA_BINARY_DIR "/test-bricks-XXXXXX";

static int set_up(void **state) {
    (void)state;
    context = test_context(2, VD_ISA_AUTO);
    bytes_at_first = vd_context_memory(context).bytes_now;
    return test_enter_folder(folder);
}

static int tear_down(void **state) {
    (void)state;
    assert_int_equal(vd_context_memory(context).bytes_now, bytes_at_first);
    vd_context_destroy(&context);
    return test_leave_folder(folder);
}

/* ---- particles ----------------------------------------------------------------------------------
 */

/* What a test imports: rows of x, y, z, mass, class, radius as doubles. */
enum { COLUMNS = 6, MOST = 60000 };
static double rows[MOST][COLUMNS];

static void fill_rows(size_t count, uint64_t seed) {
    for (size_t i = 0; i < count; i++) {
        const bool clustered = i % 2 == 0;
        for (int k = 0; k < 3; k++) {
            const double u = test_uniform(&seed);
            rows[i][k] = 1000.0 * k + (clustered ? 3.0 + 0.01 * u : 100.0 * u);
        }
        rows[i][3] = 1.0 + test_uniform(&seed);
        rows[i][4] = (double)(test_random(&seed) % 19);
        rows[i][5] = 0.5 + test_uniform(&seed);
    }
}

static vd_particle_source *open_rows(size_t count) {
    vd_particle_source_def def = vd_particle_source_def_default();
    def.raw = "f64";
    def.columns = "x,y,z,mass,class,radius";
    vd_particle_source *source = NULL;
    assert_ok(vd_particle_source_open_memory(context, rows, count * sizeof rows[0], "rows", &def,
                                             &source));
    return source;
}

static vd_status import(vd_context *with, size_t count, uint32_t leaf, size_t memory,
                        const char *path, vd_bricks_report *report) {
    vd_particle_source *source = open_rows(count);
    vd_bricks_def def = vd_bricks_def_default();
    def.leaf_particles = leaf;
    def.memory_bytes = memory;
    vd_status status = vd_bricks_import(with, NULL, &source, 1, &def, path, report);
    vd_particle_source_destroy(&source);
    return status;
}

static vd_bricks *import_and_open(size_t count, uint32_t leaf) {
    vd_bricks *bricks = NULL;
    vd_bricks_report report;
    assert_ok(import(context, count, leaf, 0, "a.vdp", &report));
    assert_int_equal(report.count + report.skipped, count);
    assert_ok(vd_bricks_open(context, "a.vdp", &bricks));
    assert_ok(vd_bricks_verify(bricks, NULL));
    assert_int_equal(report.file_bytes, bricks->file_bytes);
    return bricks;
}

static double error_bound(const vd_bricks *b, const vd_brick *brick, int axis) {
    double size = 0.0;
    for (int k = 0; k < 3; k++) {
        const double extent = b->max[k] - b->min[k];
        size = extent > size ? extent : size;
    }
    return 0.5 * brick->step[axis] + size * 0x1p-31;
}

/* ---- round trips --------------------------------------------------------------------------------
 */

/* Every particle comes back once, near where it was, with its numbers: masses tell which is which.
 */
static void test_round_trip(void **state) {
    (void)state;
    enum { COUNT = 20000 };
    fill_rows(COUNT, 1);
    for (size_t i = 0; i < COUNT; i++) {
        rows[i][3] = 1.0 + (double)i / COUNT;
    }
    vd_bricks *b = import_and_open(COUNT, 500);
    static bool seen[COUNT];
    memset(seen, 0, sizeof seen);
    static float mass[65536], class[65536], radius[65536];
    const int mass_at = vd_bricks_find(b, "mass"), class_at = vd_bricks_find(b, "class"),
              radius_at = vd_bricks_find(b, "radius");
    for (uint32_t n = 0; n < b->node_count; n++) {
        vd_brick brick;
        assert_ok(vd_bricks_brick(b, n, &brick));
        if (b->nodes[n].child_count > 0) {
            continue;
        }
        assert_true(b->nodes[n].spread == 0.0f);
        vd_bricks_values(b, &brick, mass_at, mass);
        vd_bricks_values(b, &brick, class_at, class);
        vd_bricks_values(b, &brick, radius_at, radius);
        for (uint32_t i = 0; i < brick.count; i++) {
            const size_t k = (size_t)floor(((double)mass[i] - 1.0) * COUNT + 0.5);
            assert_true(k < COUNT && !seen[k]);
            seen[k] = true;
            const uint16_t q[3] = {brick.x[i], brick.y[i], brick.z[i]};
            for (int axis = 0; axis < 3; axis++) {
                const double p = brick.origin[axis] + brick.step[axis] * q[axis];
                assert_true(fabs(p - rows[k][axis]) <= error_bound(b, &brick, axis));
            }
            assert_true((double)class[i] == rows[k][4]);
            assert_true(fabs((double)radius[i] - rows[k][5]) < 1e-4);
        }
    }
    for (size_t i = 0; i < COUNT; i++) {
        assert_true(seen[i]);
    }
    assert_true(b->attributes[mass_at].min == 1.0);
    assert_true(b->spacing > 0.0);
    vd_bricks_close(&b);
}

/* The file is the same for any number of threads and any memory. */
static void test_same_file(void **state) {
    (void)state;
    fill_rows(MOST, 2);
    void *first = NULL;
    long first_bytes = 0;
    for (int threads = 1; threads <= 7; threads += threads == 1 ? 1 : 5) {
        vd_context *with = test_context(threads, VD_ISA_AUTO);
        vd_particle_source_def def = vd_particle_source_def_default();
        def.raw = "f64";
        def.columns = "x,y,z,mass,class,radius";
        vd_particle_source *source = NULL;
        assert_ok(vd_particle_source_open_memory(with, rows, sizeof rows, "rows", &def, &source));
        vd_bricks_def bricks_def = {.memory_bytes = (size_t)64 << 20, .leaf_particles = 1000};
        assert_ok(vd_bricks_import(with, NULL, &source, 1, &bricks_def, "b.vdp", NULL));
        vd_particle_source_destroy(&source);
        vd_context_destroy(&with);
        FILE *file = fopen("b.vdp", "rb");
        assert_non_null(file);
        fseek(file, 0, SEEK_END);
        const long bytes = ftell(file);
        rewind(file);
        void *data = malloc((size_t)bytes);
        assert_int_equal(fread(data, 1, (size_t)bytes, file), bytes);
        fclose(file);
        if (first == NULL) {
            first = data;
            first_bytes = bytes;
        } else {
            assert_int_equal(bytes, first_bytes);
            assert_memory_equal(data, first, (size_t)bytes);
            free(data);
        }
    }
    free(first);
}

/* ---- the tree -----------------------------------------------------------------------------------
 */

typedef struct sums {
    double count, mass, area;
} sums;

static sums sum_brick(const vd_bricks *b, uint32_t node) {
    static float mass[65536], radius[65536];
    vd_brick brick;
    assert_ok(vd_bricks_brick(b, node, &brick));
    vd_bricks_values(b, &brick, vd_bricks_find(b, "mass"), mass);
    vd_bricks_values(b, &brick, vd_bricks_find(b, "radius"), radius);
    const double each = (double)b->nodes[node].leaves / brick.count;
    sums s = {0};
    for (uint32_t i = 0; i < brick.count; i++) {
        s.count += each;
        s.mass += each * (double)mass[i];
        s.area += each * (double)radius[i] * (double)radius[i];
    }
    return s;
}

/* What any cut through the tree draws is the same number, mass and area: node by node. */
static void test_tree_keeps_sums(void **state) {
    (void)state;
    fill_rows(MOST, 3);
    vd_bricks *b = import_and_open(MOST, 300);
    assert_true(b->node_count > 200);
    for (uint32_t n = 0; n < b->node_count; n++) {
        const vd_bricks_node *node = &b->nodes[n];
        if (node->child_count == 0) {
            continue;
        }
        const sums own = sum_brick(b, n);
        sums children = {0};
        uint64_t particles = 0;
        for (uint32_t c = node->child_first; c < node->child_first + node->child_count; c++) {
            const sums s = sum_brick(b, c);
            children.count += s.count;
            children.mass += s.mass;
            children.area += s.area;
            particles += b->nodes[c].count;
            assert_true(b->nodes[c].level > node->level);
            assert_true(b->nodes[c].spread < node->spread);
            for (int k = 0; k < 3; k++) {
                assert_true(b->nodes[c].min[k] >= node->min[k]);
                assert_true(b->nodes[c].max[k] <= node->max[k]);
            }
        }
        assert_true(fabs(own.count - children.count) < 1e-6 * own.count);
        assert_true(fabs(own.mass - children.mass) < 2e-5 * own.mass);
        assert_true(fabs(own.area - children.area) < 4e-5 * own.area);
        assert_true(node->count <= (particles + 1) / 2);
        assert_true(node->count <= (particles + 7) / 8 || node->count <= 300 / 8);
    }
    assert_true(b->stored < b->count + b->count / 2);
    vd_bricks_close(&b);
}

/* Samples are particles of the data, and spread over all of it. */
static void test_samples(void **state) {
    (void)state;
    fill_rows(MOST, 4);
    vd_bricks *b = import_and_open(MOST, 1000);
    vd_brick root;
    assert_ok(vd_bricks_brick(b, 0, &root));
    unsigned octants = 0;
    for (uint32_t i = 0; i < root.count; i++) {
        octants |= 1u << ((root.x[i] >> 15) + 2 * (root.y[i] >> 15) + 4 * (root.z[i] >> 15));
        double best = INFINITY;
        for (size_t k = 0; k < MOST && i % 16 == 0; k++) {
            const double dx = root.origin[0] + root.step[0] * root.x[i] - rows[k][0];
            const double dy = root.origin[1] + root.step[1] * root.y[i] - rows[k][1];
            const double dz = root.origin[2] + root.step[2] * root.z[i] - rows[k][2];
            const double d = dx * dx + dy * dy + dz * dz;
            best = d < best ? d : best;
        }
        assert_true(i % 16 != 0 || sqrt(best) < 2.0 * root.step[2]);
    }
    assert_int_equal(octants, 255);
    vd_bricks_close(&b);
}

static void test_one_point(void **state) {
    (void)state;
    fill_rows(MOST, 5);
    for (size_t i = 0; i < MOST; i++) {
        rows[i][0] = 5.0;
        rows[i][1] = rows[i][2] = -1e9;
    }
    vd_bricks *b = import_and_open(MOST, 100);
    assert_true(b->spacing == 0.0);
    for (uint32_t n = 0; n < b->node_count; n++) {
        assert_true(b->nodes[n].count <= 8 * 100 && b->nodes[n].child_count <= 8);
        assert_true(b->nodes[n].max[1] == b->nodes[n].min[1]);
    }
    vd_brick brick;
    assert_ok(vd_bricks_brick(b, 0, &brick));
    assert_true(fabs(brick.origin[0] - 5.0) < 1e-6 && brick.step[0] == 0.0);
    vd_bricks_close(&b);
    b = import_and_open(1, 64); /* a single particle */
    assert_int_equal(b->node_count, 1);
    vd_bricks_close(&b);
}

static void test_not_finite(void **state) {
    (void)state;
    enum { COUNT = 1000 };
    fill_rows(COUNT, 6);
    for (size_t i = 0; i < COUNT; i += 10) {
        rows[i][i / 10 % 3] = i % 20 == 0 ? (double)NAN : -(double)INFINITY;
    }
    rows[1][3] = NAN;
    vd_bricks_report report;
    assert_ok(import(context, COUNT, 64, 0, "a.vdp", &report));
    assert_int_equal(report.skipped, COUNT / 10);
    assert_int_equal(report.count, COUNT - COUNT / 10);
    assert_int_equal(report.missing_values, 1);
    vd_bricks *b = NULL;
    assert_ok(vd_bricks_open(context, "a.vdp", &b));
    assert_int_equal(b->skipped, COUNT / 10);
    assert_true(b->max[0] <= 100.0);
    vd_bricks_close(&b);
    for (size_t i = 0; i < COUNT; i++) {
        rows[i][1] = INFINITY;
    }
    vd_status status = import(context, COUNT, 64, 0, "none.vdp", NULL);
    assert_int_equal(status.code, VD_ERROR_EMPTY);
    assert_non_null(strstr(status.message, "all 1000 particles"));
    status = import(context, 0, 64, 0, "none.vdp", NULL);
    assert_int_equal(status.code, VD_ERROR_EMPTY);
    assert_non_null(strstr(status.message, "0 particles"));
    assert_int_equal(access("none.vdp", F_OK), -1);
    assert_int_equal(access("none.vdp.part", F_OK), -1);
}

/* Numbers over many octaves keep their small ones. */
static void test_log_values(void **state) {
    (void)state;
    enum { COUNT = 5000 };
    fill_rows(COUNT, 7);
    for (size_t i = 0; i < COUNT; i++) {
        rows[i][3] = exp(20.0 * (double)i / COUNT - 10.0);
        rows[i][0] = (double)i;
        rows[i][1] = rows[i][2] = 0.0;
    }
    vd_bricks *b = import_and_open(COUNT, 8192);
    assert_int_equal(b->attributes[vd_bricks_find(b, "mass")].storage, VD_BRICK_LOG);
    vd_brick brick;
    static float mass[8192];
    assert_ok(vd_bricks_brick(b, 0, &brick));
    vd_bricks_values(b, &brick, vd_bricks_find(b, "mass"), mass);
    for (uint32_t i = 0; i < brick.count; i++) {
        assert_true(fabs((double)mass[i] / rows[i][3] - 1.0) < 3e-4);
    }
    vd_bricks_close(&b);
}

/* ---- files that are not as they should be -------------------------------------------------------
 */

static uint8_t *load(const char *path, size_t *bytes) {
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    fseek(file, 0, SEEK_END);
    *bytes = (size_t)ftell(file);
    rewind(file);
    uint8_t *data = malloc(*bytes);
    assert_int_equal(fread(data, 1, *bytes, file), *bytes);
    fclose(file);
    return data;
}

/* Opens and looks at everything; returns what failed first. */
static vd_status use(const void *data, size_t bytes) {
    vd_bricks *b = NULL;
    vd_status status = vd_bricks_open_memory(context, data, bytes, "bad.vdp", &b);
    if (status.code == VD_OK) {
        status = vd_bricks_verify(b, NULL);
        vd_bricks_close(&b);
    }
    return status;
}

static void test_cut_short(void **state) {
    (void)state;
    fill_rows(3000, 8);
    assert_ok(import(context, 3000, 200, 0, "a.vdp", NULL));
    size_t bytes = 0;
    uint8_t *data = load("a.vdp", &bytes);
    assert_ok(use(data, bytes));
    for (size_t n = 0; n < bytes; n += 1 + n / 50) {
        vd_status status = use(data, n);
        assert_int_equal(status.code, VD_ERROR_FORMAT);
    }
    for (size_t n = 0; n < 300; n += 37) {
        assert_int_equal(truncate("a.vdp", (off_t)n), 0);
        vd_bricks *b = NULL;
        assert_int_equal(vd_bricks_open(context, "a.vdp", &b).code, VD_ERROR_FORMAT);
        assert_null(b);
    }
    free(data);
}

/* Every flipped bit is found out: the sums cover the padding too. */
static void test_flipped_bits(void **state) {
    (void)state;
    fill_rows(600, 9);
    assert_ok(import(context, 600, 100, 0, "a.vdp", NULL));
    size_t bytes = 0;
    uint8_t *data = load("a.vdp", &bytes);
    uint64_t seed = 10;
    for (size_t i = 0; i < bytes; i++) {
        const uint8_t bit = (uint8_t)(1u << (test_random(&seed) % 8));
        data[i] ^= bit;
        vd_status status = use(data, bytes);
        if (status.code != VD_ERROR_FORMAT && status.code != VD_ERROR_UNSUPPORTED) {
            fail_msg("byte %zu: %s", i, status.message);
        }
        data[i] ^= bit;
    }
    assert_ok(use(data, bytes));
    free(data);
}

static void test_promises(void **state) {
    (void)state;
    fill_rows(600, 11);
    assert_ok(import(context, 600, 100, 0, "a.vdp", NULL));
    size_t bytes = 0;
    uint8_t *data = load("a.vdp", &bytes);
    vd_bricks_head *head = (vd_bricks_head *)data;
    const vd_bricks_head kept = *head;
    head->count = 10000000000u;
    head->file_bytes = 100000000000u;
    vd_status status = use(data, bytes);
    assert_int_equal(status.code, VD_ERROR_FORMAT);
    assert_non_null(strstr(status.message, "10000000000 particles"));
    *head = kept;
    head->node_count = UINT64_MAX / 128;
    assert_int_equal(use(data, bytes).code, VD_ERROR_FORMAT);
    *head = kept;
    head->version = 2;
    status = use(data, bytes);
    assert_int_equal(status.code, VD_ERROR_UNSUPPORTED);
    assert_non_null(strstr(status.message, "version 2"));
    *head = kept;
    head->magic[0] = 'X';
    assert_non_null(strstr(use(data, bytes).message, "no brick file"));
    free(data);
}

/* ---- interruption, memory -----------------------------------------------------------------------
 */

static void test_cancelled(void **state) {
    (void)state;
    fill_rows(MOST, 12);
    FILE *old = fopen("kept.vdp", "wb");
    assert_non_null(old);
    fputs("as it was", old);
    fclose(old);
    vd_job *job = NULL;
    assert_ok(vd_job_create(context, &job));
    vd_job_cancel(job);
    vd_particle_source *source = open_rows(MOST);
    vd_status status = vd_bricks_import(context, job, &source, 1, NULL, "kept.vdp", NULL);
    assert_int_equal(status.code, VD_ERROR_CANCELLED);
    vd_particle_source_destroy(&source);
    vd_job_destroy(&job);
    struct stat info;
    assert_int_equal(stat("kept.vdp", &info), 0);
    assert_int_equal(info.st_size, 9);
    assert_int_equal(access("kept.vdp.part", F_OK), -1);
}

static void test_failing_allocations(void **state) {
    (void)state;
    fill_rows(3000, 13);
    for (int n = 1;; n++) {
        test_allocator allocator = {0};
        vd_context *failing = test_failing_context(&allocator);
        const int before = allocator.live;
        allocator.fail_at = allocator.calls + n;
        vd_particle_source_def def = vd_particle_source_def_default();
        def.raw = "f64";
        def.columns = "x,y,z,mass,class,radius";
        vd_particle_source *source = NULL;
        vd_bricks *b = NULL;
        vd_status status = vd_particle_source_open_memory(failing, rows, 3000 * sizeof rows[0],
                                                          "rows", &def, &source);
        if (status.code == VD_OK) {
            vd_bricks_def bricks_def = {.leaf_particles = 200};
            status = vd_bricks_import(failing, NULL, &source, 1, &bricks_def, "f.vdp", NULL);
        }
        if (status.code == VD_OK) {
            status = vd_bricks_open(failing, "f.vdp", &b);
        }
        vd_bricks_close(&b);
        vd_particle_source_destroy(&source);
        assert_int_equal(allocator.live, before);
        const bool all = allocator.calls < allocator.fail_at;
        vd_context_destroy(&failing);
        assert_int_equal(access("f.vdp.part", F_OK), -1);
        if (all) {
            assert_ok(status);
            break;
        }
        assert_int_equal(status.code, VD_ERROR_MEMORY);
    }
}

static void test_arguments(void **state) {
    (void)state;
    fill_rows(10, 14);
    assert_int_equal(import(context, 10, 63, 0, "x.vdp", NULL).code, VD_ERROR_ARGUMENT);
    assert_int_equal(import(context, 10, 64, 1000, "x.vdp", NULL).code, VD_ERROR_ARGUMENT);
    assert_int_equal(vd_bricks_import(context, NULL, NULL, 0, NULL, "x.vdp", NULL).code,
                     VD_ERROR_ARGUMENT);
    assert_int_equal(import(context, 10, 64, 0, "no/such/folder/x.vdp", NULL).code, VD_ERROR_IO);
    vd_bricks *b = NULL;
    assert_int_equal(vd_bricks_open(context, "nothing.vdp", &b).code, VD_ERROR_IO);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_round_trip),      cmocka_unit_test(test_same_file),
        cmocka_unit_test(test_tree_keeps_sums), cmocka_unit_test(test_samples),
        cmocka_unit_test(test_one_point),       cmocka_unit_test(test_not_finite),
        cmocka_unit_test(test_log_values),      cmocka_unit_test(test_cut_short),
        cmocka_unit_test(test_flipped_bits),    cmocka_unit_test(test_promises),
        cmocka_unit_test(test_cancelled),       cmocka_unit_test(test_failing_allocations),
        cmocka_unit_test(test_arguments),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}

/* The core: status, context, memory, pool, jobs, files, text, elementary functions, vectors. */
#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <sys/stat.h>
#include <unistd.h>
#include "core/core.h"
#include "core/file.h"
#include "core/real.h"
#include "core/text.h"
#include "support.h"
#include <veduta/vector.h>

static void status_keeps_its_sentence(void **state) {
    (void)state;
    vd_status status = vd_failure(VD_ERROR_IO, "cannot read %s", "a.png");
    assert_int_equal(status.code, VD_ERROR_IO);
    assert_string_equal(status.message, "cannot read a.png");
    assert_string_equal(vd_code_name(VD_ERROR_EMPTY), "empty");
    assert_string_equal(vd_code_name((vd_code)99), "unknown");
    char text[1000];
    memset(text, 0, sizeof text);
    for (int i = 0; i < 300; i++) {
        strcat(text, "ä");
    }
    for (int shift = 0; shift < 2; shift++) {
        status = vd_failure(VD_ERROR_IO, "%s%s", shift ? "x" : "", text);
        size_t length = strlen(status.message);
        assert_true(length >= VD_MESSAGE_BYTES - 3);
        assert_int_equal((unsigned char)status.message[length - 1], 0xA4); /* a whole ä */
    }
}

static void context_refuses_bad_definitions(void **state) {
    (void)state;
    vd_context *context = NULL;
    vd_context_def def = vd_context_def_default();
    def.threads = -1;
    assert_int_equal(vd_context_create(&def, &context).code, VD_ERROR_ARGUMENT);
    def = vd_context_def_default();
    def.allocator.allocate = test_allocate;
    assert_int_equal(vd_context_create(&def, &context).code, VD_ERROR_ARGUMENT);
    def = vd_context_def_default();
    def.isa = (vd_isa)77;
    assert_int_equal(vd_context_create(&def, &context).code, VD_ERROR_ARGUMENT);
    assert_int_equal(vd_context_create(NULL, NULL).code, VD_ERROR_ARGUMENT);
    setenv("VEDUTA_CPU", "v9", 1);
    vd_status status = vd_context_create(NULL, &context);
    assert_int_equal(status.code, VD_ERROR_ARGUMENT);
    assert_non_null(strstr(status.message, "VEDUTA_CPU"));
    setenv("VEDUTA_CPU", "v2", 1);
    assert_ok(vd_context_create(NULL, &context));
    assert_int_equal(vd_context_isa(context), VD_ISA_V2);
    assert_string_equal(vd_isa_name(vd_context_isa(context)), "v2");
    vd_context_destroy(&context);
    assert_null(context);
    vd_context_destroy(&context);
    vd_context_destroy(NULL);
    unsetenv("VEDUTA_CPU");
}

static void every_failing_allocation_is_survived(void **state) {
    (void)state;
    for (int n = 1; n < 10; n++) {
        test_allocator allocator = {0, n, 0};
        vd_context_def def = vd_context_def_default();
        def.threads = 3;
        def.allocator = (vd_allocator){&allocator, test_allocate, test_release};
        vd_context *context = NULL;
        vd_status status = vd_context_create(&def, &context);
        if (status.code == VD_OK) {
            vd_context_destroy(&context);
            assert_int_equal(allocator.live, 0);
            assert_true(n > 3);
            return;
        }
        assert_int_equal(status.code, VD_ERROR_MEMORY);
        assert_null(context);
        assert_int_equal(allocator.live, 0);
    }
    fail_msg("creating a context never succeeded");
}

static void memory_is_counted_and_aligned(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    vd_memory_stats before = vd_context_memory(context);
    assert_null(vd_allocate(context, SIZE_MAX / 2, 3));
    assert_null(vd_allocate(context, SIZE_MAX, 1));
    void *a = vd_allocate(context, 1000, 7), *b = vd_allocate(context, 0, 8);
    assert_non_null(a);
    assert_non_null(b);
    assert_int_equal((uintptr_t)a % 64, 0);
    vd_memory_stats during = vd_context_memory(context);
    assert_true(during.bytes_now >= before.bytes_now + 7000);
    assert_int_equal(during.allocations, before.allocations + 2);
    vd_release(context, a);
    vd_release(context, b);
    vd_release(context, NULL);
    assert_int_equal(vd_context_memory(context).bytes_now, before.bytes_now);
    assert_int_equal(vd_context_memory(context).bytes_peak, during.bytes_now);
    vd_context_memory_reset_peak(context);
    assert_int_equal(vd_context_memory(context).bytes_peak, before.bytes_now);
    unsigned char *zero = vd_allocate_zero(context, 100, 1);
    for (int i = 0; i < 100; i++) {
        assert_int_equal(zero[i], 0);
    }
    vd_release(context, zero);
    vd_context_destroy(&context);
}

static void strides_avoid_cache_aliasing(void **state) {
    (void)state;
    for (size_t size = 1; size <= 8; size *= 2) {
        for (size_t width = 1; width < 3000; width++) {
            size_t stride = vd_row_stride(width, size);
            assert_true(stride >= width && stride * size % 64 == 0 && stride * size % 1024 != 0);
            assert_true(stride * size < width * size + 128);
        }
    }
}

/* ---- loops ------------------------------------------------------------------------------------
 */

typedef struct counted {
    atomic_int *seen;
    atomic_int busy[64];
    atomic_bool clash;
    int threads;
    vd_job *job;
    int cancel_at;
} counted;

static void count_piece(void *user, int index, int worker) {
    counted *c = user;
    if (worker < 0 || worker >= c->threads || atomic_fetch_add(&c->busy[worker], 1) != 0) {
        atomic_store(&c->clash, true);
    }
    atomic_fetch_add(&c->seen[index], 1);
    if (c->job != NULL && index == c->cancel_at) {
        vd_job_cancel(c->job);
    }
    atomic_fetch_sub(&c->busy[worker], 1);
}

static void loops_run_every_piece_once(void **state) {
    (void)state;
    const int thread_counts[] = {1, 2, 7};
    const int counts[] = {0, 1, 2, 3, 10, 1000};
    for (int t = 0; t < 3; t++) {
        vd_context *context = test_context(thread_counts[t], VD_ISA_AUTO);
        assert_int_equal(vd_context_threads(context), thread_counts[t]);
        for (int repeat = 0; repeat < 300; repeat++) {
            const int count = counts[repeat % 6];
            atomic_int seen[1000];
            memset(seen, 0, sizeof seen);
            counted c = {.seen = seen, .threads = thread_counts[t]};
            assert_ok(vd_parallel_for(context, NULL, count, count_piece, &c));
            for (int i = 0; i < count; i++) {
                assert_int_equal(seen[i], 1);
            }
            assert_false(c.clash);
        }
        vd_context_destroy(&context);
    }
}

static void loops_sleep_and_wake(void **state) {
    (void)state;
    vd_context *context = test_context(4, VD_ISA_AUTO);
    for (int repeat = 0; repeat < 20; repeat++) {
        atomic_int seen[8];
        memset(seen, 0, sizeof seen);
        counted c = {.seen = seen, .threads = 4};
        usleep(2000); /* long enough for the workers to stop spinning */
        assert_ok(vd_parallel_for(context, NULL, 8, count_piece, &c));
        for (int i = 0; i < 8; i++) {
            assert_int_equal(seen[i], 1);
        }
    }
    vd_context_destroy(&context);
}

static void jobs_cancel_and_report(void **state) {
    (void)state;
    for (int threads = 1; threads <= 3; threads++) {
        vd_context *context = test_context(threads, VD_ISA_AUTO);
        vd_job *job = NULL;
        assert_ok(vd_job_create(context, &job));
        atomic_int seen[1000];
        memset(seen, 0, sizeof seen);
        counted c = {.seen = seen, .threads = threads, .job = job, .cancel_at = 5};
        vd_status status = vd_parallel_for(context, job, 1000, count_piece, &c);
        assert_int_equal(status.code, VD_ERROR_CANCELLED);
        int done = 0;
        for (int i = 0; i < 1000; i++) {
            done += seen[i];
        }
        assert_true(done >= 1 && done < 1000);
        assert_true(fabs(vd_job_progress(job) - done / 1000.0) < 1e-9);
        assert_true(vd_job_stopped(job));
        vd_job_reset(job);
        assert_false(vd_job_stopped(job));
        c.cancel_at = -1;
        assert_ok(vd_parallel_for(context, job, 1000, count_piece, &c));
        assert_true(vd_job_progress(job) == 1.0);
        vd_job_set_time_limit(job, 1);
        usleep(10);
        status = vd_parallel_for(context, job, 10, count_piece, &c);
        assert_int_equal(status.code, VD_ERROR_CANCELLED);
        vd_job_set_time_limit(job, 0);
        assert_false(vd_job_stopped(job));
        assert_int_equal(vd_parallel_for(context, job, -1, count_piece, &c).code,
                         VD_ERROR_ARGUMENT);
        assert_int_equal(vd_parallel_for(context, job, 1, NULL, &c).code, VD_ERROR_ARGUMENT);
        vd_job_destroy(&job);
        assert_null(job);
        vd_context_destroy(&context);
    }
}

static void run_backwards(void *user, int count, vd_task_function *task, void *task_user) {
    ++*(int *)user;
    for (int i = count - 1; i >= 0; i--) {
        task(task_user, i, 0);
    }
}

static void callers_executor_is_used(void **state) {
    (void)state;
    int calls = 0;
    vd_context_def def = vd_context_def_default();
    def.executor = (vd_executor){&calls, 3, run_backwards};
    vd_context *context = NULL;
    assert_ok(vd_context_create(&def, &context));
    assert_int_equal(vd_context_threads(context), 3);
    atomic_int seen[4];
    memset(seen, 0, sizeof seen);
    counted c = {.seen = seen, .threads = 3};
    assert_ok(vd_parallel_for(context, NULL, 4, count_piece, &c));
    assert_int_equal(calls, 1);
    assert_int_equal(seen[3], 1);
    vd_context_destroy(&context);
}

/* ---- files ------------------------------------------------------------------------------------
 */

static char *scratch_path(const char *name) {
    static char path[512];
    snprintf(path, sizeof path, "%s/test-core", VEDUTA_BINARY_DIR);
    mkdir(path, 0777);
    snprintf(path, sizeof path, "%s/test-core/%s", VEDUTA_BINARY_DIR, name);
    return path;
}

static void write_text(vd_context *context, const char *path, const char *text) {
    vd_file file;
    assert_ok(vd_file_create(context, path, &file));
    vd_file_write(&file, text, strlen(text));
    assert_ok(vd_file_commit(&file));
}

static void files_are_replaced_whole_or_not_at_all(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    const char *path = scratch_path("whole.txt");
    write_text(context, path, "first");
    vd_file file;
    assert_ok(vd_file_create(context, path, &file));
    vd_file_write(&file, "second", 6);
    char beside[600];
    snprintf(beside, sizeof beside, "%s", file.beside);
    assert_int_equal(access(beside, F_OK), 0);
    vd_file_discard(&file);
    assert_int_not_equal(access(beside, F_OK), 0);
    void *data = NULL;
    size_t size = 0;
    assert_ok(vd_file_read(context, path, 100, &data, &size));
    assert_int_equal(size, 5);
    assert_string_equal(data, "first");
    vd_release(context, data);
    vd_status status = vd_file_read(context, path, 4, &data, &size);
    assert_int_equal(status.code, VD_ERROR_LIMIT);
    assert_ok(vd_file_read(context, path, 5, &data, &size));
    vd_release(context, data);
    struct stat info;
    stat(path, &info);
    mode_t mask = umask(0);
    umask(mask);
    assert_int_equal(info.st_mode & 0777, 0666 & ~mask);
    vd_context_destroy(&context);
}

static void file_errors_name_path_and_remedy(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    void *data;
    size_t size;
    vd_status status = vd_file_read(context, "/nonexistent/x.png", 100, &data, &size);
    assert_int_equal(status.code, VD_ERROR_IO);
    assert_non_null(strstr(status.message, "/nonexistent/x.png"));
    status = vd_file_read(context, VEDUTA_BINARY_DIR, 100, &data, &size);
    assert_int_equal(status.code, VD_ERROR_IO);
    status = vd_file_read(context, "/dev/zero", 100, &data, &size);
    assert_int_equal(status.code, VD_ERROR_IO);
    assert_non_null(strstr(status.message, "it is a device"));
    vd_file file;
    status = vd_file_create(context, "/nonexistent/y.png", &file);
    assert_int_equal(status.code, VD_ERROR_IO);
    assert_non_null(strstr(status.message, "create the folder"));
    assert_int_equal(vd_file_create(context, VEDUTA_BINARY_DIR, &file).code, VD_ERROR_IO);
    assert_ok(vd_file_create(context, "/dev/full", &file));
    for (int i = 0; i < 100; i++) {
        char block[8192] = {0};
        vd_file_write(&file, block, sizeof block);
    }
    status = vd_file_commit(&file);
    assert_int_equal(status.code, VD_ERROR_IO);
    assert_non_null(strstr(status.message, "space"));
    vd_context_destroy(&context);
}

static void large_files_and_odd_blocks_round_trip(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    const size_t size = 3000017;
    uint8_t *bytes = vd_allocate(context, size, 1);
    uint64_t random = 1;
    for (size_t i = 0; i < size; i++) {
        bytes[i] = (uint8_t)test_random(&random);
    }
    const char *path = scratch_path("large.bin");
    vd_file file;
    assert_ok(vd_file_create(context, path, &file));
    for (size_t at = 0; at < size;) {
        size_t block = test_random(&random) % 600000;
        block = block < size - at ? block : size - at;
        vd_file_write(&file, bytes + at, block);
        at += block;
    }
    assert_ok(vd_file_commit(&file));
    void *data;
    size_t got;
    assert_ok(vd_file_read(context, path, size, &data, &got));
    assert_int_equal(got, size);
    assert_memory_equal(data, bytes, size);
    vd_release(context, data);
    vd_release(context, bytes);
    unlink(path);
    vd_context_destroy(&context);
}

/* ---- numbers ----------------------------------------------------------------------------------
 */

static void numbers_read_like_strtod(void **state) {
    (void)state;
    uint64_t random = 7;
    for (int i = 0; i < 200000; i++) {
        char text[64];
        uint64_t bits = test_random(&random);
        double value;
        memcpy(&value, &bits, sizeof value);
        if (i % 2 == 0) {
            value = (test_uniform(&random) - 0.5) * 1e5;
        }
        if (!isfinite(value)) {
            continue;
        }
        snprintf(text, sizeof text, "%.*g", 1 + i % 20, value);
        vd_text t = vd_text_make(text, strlen(text));
        double got;
        assert_true(vd_text_number(&t, &got));
        assert_true(vd_text_done(&t));
        double expected = strtod(text, NULL);
        if (memcmp(&got, &expected, sizeof got) != 0) {
            fail_msg("%s reads as %.17g, not %.17g", text, got, expected);
        }
    }
}

static void numbers_stop_where_they_end(void **state) {
    (void)state;
    const struct {
        const char *text;
        bool number;
        double value;
        int rest;
    } cases[] = {{"  12 ", true, 12, 1},       {"-.5e1x", true, -5, 1},
                 {"2em", true, 2, 2},          {"1.2.3", true, 1.2, 2},
                 {"+7", true, 7, 0},           {"-", false, 0, 1},
                 {".", false, 0, 1},           {"", false, 0, 0},
                 {"abc", false, 0, 3},         {"1e400", true, INFINITY, 0},
                 {"-inf", true, -INFINITY, 0}, {"1e-400", true, 0, 0},
                 {"0x10", true, 0, 3},         {"1e999999999999", true, INFINITY, 0}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        vd_text t = vd_text_make(cases[i].text, strlen(cases[i].text));
        double got = 0;
        assert_int_equal(vd_text_number(&t, &got), cases[i].number);
        assert_true(got == cases[i].value);
        assert_int_equal(t.end - t.at, cases[i].rest);
    }
    vd_text t = vd_text_make("nan", 3);
    double got = 0;
    assert_true(vd_text_number(&t, &got) && isnan(got));
    t = vd_text_make("a bc\n  d", 8);
    char word[3];
    assert_true(vd_text_word(&t, word, sizeof word));
    assert_string_equal(word, "a");
    assert_true(vd_text_word(&t, word, sizeof word));
    assert_string_equal(word, "bc");
    assert_false(vd_text_word(&t, word, sizeof word));
    vd_text_next_line(&t);
    assert_int_equal(t.line, 2);
    assert_true(vd_text_word(&t, word, sizeof word));
    assert_string_equal(word, "d");
}

static void elementary_functions_are_accurate(void **state) {
    (void)state;
    uint64_t random = 3;
    for (int i = 0; i < 300000; i++) {
        double x = (test_uniform(&random) - 0.5) * (i % 2 ? 20 : 2000);
        assert_true(fabs(vd_sin(x) - sin(x)) <= 4e-16);
        assert_true(fabs(vd_cos(x) - cos(x)) <= 4e-16);
        double e = (test_uniform(&random) - 0.5) * 100;
        assert_true(fabs(vd_exp(e) - exp(e)) <= 1e-15 * exp(e));
        double y = test_uniform(&random) - 0.5, w = test_uniform(&random) - 0.5;
        assert_true(fabs(vd_atan2(y, w) - atan2(y, w)) <= 1e-15);
    }
    for (int i = 0; i < 10000; i++) {
        const double x = exp((test_uniform(&random) - 0.5) * 1400.0);
        assert_true(fabs(vd_log2(x) - log2(x)) <= 1e-13 + 2e-15 * fabs(log2(x)));
    }
    assert_true(vd_log2(1) == 0 && vd_log2(1024) == 10 && vd_log2(0x1p-1060) == -1022);
    assert_true(vd_sin(0) == 0 && vd_cos(0) == 1 && vd_exp(0) == 1);
    assert_true(fabs(vd_cos(VD_PI / 2) - cos(VD_PI / 2)) < 1e-20);
    assert_true(isnan(vd_sin(INFINITY)) && isnan(vd_cos(NAN)) && isnan(vd_exp(NAN)));
    assert_true(vd_exp(-1000) == 0 && isinf(vd_exp(1000)));
    assert_true(vd_atan2(0, 0) == 0 && vd_atan2(0, -1) == VD_PI && vd_atan2(1, 0) == VD_PI / 2);
}

static void quaternions_rotate(void **state) {
    (void)state;
    uint64_t random = 5;
    for (int i = 0; i < 1000; i++) {
        vd_vec3 axis = vd_vec3_normalize(vd_vec3_make(
            test_uniform(&random) - 0.5, test_uniform(&random) - 0.5, test_uniform(&random) - 0.5));
        double angle = (test_uniform(&random) - 0.5) * 6.28;
        vd_quat q = vd_quat_from_axis_angle(axis, angle);
        vd_vec3 x = vd_quat_rotate(q, vd_vec3_make(1, 0, 0));
        vd_vec3 y = vd_quat_rotate(q, vd_vec3_make(0, 1, 0));
        vd_vec3 z = vd_quat_rotate(q, vd_vec3_make(0, 0, 1));
        assert_true(fabs(vd_vec3_dot(x, y)) < 1e-14 && fabs(vd_vec3_length(z) - 1) < 1e-14);
        vd_vec3 c = vd_vec3_cross(x, y);
        assert_true(vd_vec3_length(vd_vec3_subtract(c, z)) < 1e-14);
        vd_quat p = vd_quat_from_axes(x, y, z);
        double same = fabs(p.x * q.x + p.y * q.y + p.z * q.z + p.w * q.w);
        assert_true(fabs(same - 1) < 1e-14);
        vd_quat twice = vd_quat_multiply(q, q);
        vd_vec3 v = vd_vec3_make(1, 2, 3);
        vd_vec3 a = vd_quat_rotate(twice, v), b = vd_quat_rotate(q, vd_quat_rotate(q, v));
        assert_true(vd_vec3_length(vd_vec3_subtract(a, b)) < 1e-13);
    }
    vd_quat quarter = vd_quat_from_axis_angle(vd_vec3_make(0, 0, 1), VD_PI / 2);
    vd_vec3 north = vd_quat_rotate(quarter, vd_vec3_make(1, 0, 0));
    assert_true(fabs(north.y - 1) < 1e-15);
    vd_quat zero = vd_quat_normalize((vd_quat){0, 0, 0, 0});
    assert_true(zero.w == 1.0);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(status_keeps_its_sentence),
        cmocka_unit_test(context_refuses_bad_definitions),
        cmocka_unit_test(every_failing_allocation_is_survived),
        cmocka_unit_test(memory_is_counted_and_aligned),
        cmocka_unit_test(strides_avoid_cache_aliasing),
        cmocka_unit_test(loops_run_every_piece_once),
        cmocka_unit_test(loops_sleep_and_wake),
        cmocka_unit_test(jobs_cancel_and_report),
        cmocka_unit_test(callers_executor_is_used),
        cmocka_unit_test(files_are_replaced_whole_or_not_at_all),
        cmocka_unit_test(file_errors_name_path_and_remedy),
        cmocka_unit_test(large_files_and_odd_blocks_round_trip),
        cmocka_unit_test(numbers_read_like_strtod),
        cmocka_unit_test(numbers_stop_where_they_end),
        cmocka_unit_test(elementary_functions_are_accurate),
        cmocka_unit_test(quaternions_rotate),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

/* bench.h: what the parts of `veduta bench` share.
 *
 * A case measures one thing in several ways (methods × threads × SIMD levels) and adds a result for
 * each. Every result carries the picture's hash: a time says nothing when the picture is wrong.
 */
#ifndef VEDUTA_APP_BENCH_H
#define VEDUTA_APP_BENCH_H

#include <stdbool.h>
#include <time.h>
#include <veduta/veduta.h>

#define BENCH_MAX_RESULTS 512
#define BENCH_MAX_THREADS 16

/* One line of the table and one object of the JSON's `results`. */
typedef struct bench_result {
    const char *case_name;
    char method[24];
    int threads;
    vd_isa isa;
    int width, height; /* 0, 0 where there is no picture */
    double median_ms, p99_ms, min_ms;
    size_t peak_bytes; /* most held by the context at once, map and frame included; 0 for start-up:
                          the child's size would count this process' own */
    bool has_hash;
    uint64_t hash;
    bool reference;    /* what the others of its case and SIMD level are compared with */
    bool same_picture; /* its hash must be the reference's */
    char note[32];     /* for the table only */
} bench_result;

typedef struct bench_run {
    int threads[BENCH_MAX_THREADS];
    int thread_count;
    vd_isa isas[VD_ISA_COUNT];
    int isa_count;
    int repeat; /* measured runs; 0: as many as fit into about two seconds */
    bool quiet; /* no progress on standard error */
    bench_result results[BENCH_MAX_RESULTS];
    int result_count;
} bench_run;

/* The thing measured. */
typedef vd_status bench_work(void *user);

/* Runs `work` once to warm up, then several times, and fills the times of *result from `clock`
 * (CLOCK_MONOTONIC, or CLOCK_PROCESS_CPUTIME_ID for work whose waiting does not count). Says on
 * standard error what runs. */
VD_MUST_USE vd_status bench_measure(bench_run *run, bench_work *work, void *user, clockid_t clock,
                                    bench_result *result);

/* Adds a result. Returns VD_ERROR_LIMIT when the table is full. */
VD_MUST_USE vd_status bench_add(bench_run *run, const bench_result *result);

typedef struct bench_case {
    const char *name;
    const char *help;
    vd_status (*function)(bench_run *run, const char *name);
} bench_case;

/* Returns case `index`, null past the last. */
const bench_case *bench_case_at(int index);

/* Makes the bench's own map: 1024² samples, heights 0 … 118, coloured by height; from integer noise
 * alone, so it is the same on every machine and needs no file. VD_HEIGHT_U8 is the classic
 * picture's, which wraps; VD_HEIGHT_F32 the lens methods', with the same heights, which ends at its
 * edge. */
VD_MUST_USE vd_status bench_map_create(vd_context *context, vd_height_type type,
                                       vd_heightfield **out);

#endif

/* bench.c: `veduta bench`, measured tables. */
#include "bench.h"
#include "commands.h"
#include "commit.h"
#include "options.h"

#include <inttypes.h>
#include <jansson.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { OPTION_JSON, OPTION_THREADS, OPTION_REPEAT, OPTION_ISA, OPTION_LIST, OPTION_HELP };

/* The most measured runs of one thing, and how long they may take together, in seconds. */
#define MOST_RUNS 1000
#define RUN_SECONDS 2.0

static const vd_option table[] = {
    {.key = "json",
     .group = "Options",
     .type = VD_OPTION_FILE,
     .argument = "FILE",
     .help = "write the results as JSON; - is standard output"},
    {.key = "threads",
     .group = "Options",
     .type = VD_OPTION_TEXT,
     .argument = "1,2",
     .fallback = "1,2",
     .help = "numbers of threads to measure with"},
    {.key = "repeat",
     .group = "Options",
     .type = VD_OPTION_INTEGER,
     .min = 0,
     .max = MOST_RUNS,
     .argument = "N",
     .fallback = "0",
     .help = "measured runs of each, after one to warm up; 0: what fits into two seconds, "
             "at least 5"},
    {.key = "isa",
     .group = "Options",
     .type = VD_OPTION_TEXT,
     .argument = "v2,v3,v4",
     .help = "SIMD levels to measure with; otherwise the best of this processor"},
    {.key = "list", .group = "Options", .type = VD_OPTION_SWITCH, .help = "list the cases and end"},
    {.key = "help",
     .group = "Options",
     .type = VD_OPTION_SWITCH,
     .letter = 'h',
     .help = "show this and end"},
};

/* ---- measuring --------------------------------------------------------------------------------*/

static double read_clock_ms(clockid_t clock) {
    struct timespec now;
    clock_gettime(clock, &now);
    return (double)now.tv_sec * 1e3 + (double)now.tv_nsec * 1e-6;
}

static int compare_times(const void *a, const void *b) {
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

vd_status bench_measure(bench_run *run, bench_work *work, void *user, clockid_t clock,
                        bench_result *result) {
    if (!run->quiet) {
        fprintf(stderr, "\r\033[K%s: %s, %d thread%s", result->case_name, result->method,
                result->threads, result->threads == 1 ? "" : "s");
    }
    double start_ms = read_clock_ms(CLOCK_MONOTONIC);
    vd_status status = work(user);
    double estimate_ms = read_clock_ms(CLOCK_MONOTONIC) - start_ms;
    int runs = run->repeat;
    if (runs == 0) {
        double fitting = RUN_SECONDS * 1e3 / (estimate_ms > 1e-3 ? estimate_ms : 1e-3);
        runs = fitting < 5 ? 5 : fitting > 200 ? 200 : (int)fitting;
    }
    double times_ms[MOST_RUNS];
    for (int i = 0; i < runs && status.code == VD_OK; i++) {
        start_ms = read_clock_ms(clock);
        status = work(user);
        times_ms[i] = read_clock_ms(clock) - start_ms;
    }
    if (!run->quiet) {
        fprintf(stderr, "\r\033[K");
    }
    if (status.code != VD_OK) {
        return status;
    }
    qsort(times_ms, (size_t)runs, sizeof times_ms[0], compare_times);
    result->min_ms = times_ms[0];
    result->median_ms = (times_ms[(runs - 1) / 2] + times_ms[runs / 2]) / 2;
    result->p99_ms = times_ms[(runs * 99 + 99) / 100 - 1]; /* nearest rank */
    return status;
}

vd_status bench_add(bench_run *run, const bench_result *result) {
    if (run->result_count == BENCH_MAX_RESULTS) {
        return vd_failure(VD_ERROR_LIMIT, "more than %d results; measure fewer cases at once",
                          BENCH_MAX_RESULTS);
    }
    run->results[run->result_count++] = *result;
    return vd_success();
}

/* ---- what comes out ---------------------------------------------------------------------------*/

/* The result that this one is compared with: null when its case has none. */
static const bench_result *reference_of(const bench_run *run, const bench_result *result) {
    for (int i = 0; i < run->result_count; i++) {
        const bench_result *other = &run->results[i];
        if (other->reference && strcmp(other->case_name, result->case_name) == 0 &&
            other->isa == result->isa) {
            return other;
        }
    }
    return NULL;
}

static void print_table(const bench_run *run, FILE *out) {
    fprintf(out, "%-15s %-10s %7s %-4s %10s %10s %10s %9s %9s  %-16s\n", "case", "method",
            "threads", "isa", "median ms", "p99 ms", "min ms", "speed", "peak MB", "picture");
    for (int i = 0; i < run->result_count; i++) {
        const bench_result *r = &run->results[i];
        const bench_result *reference = reference_of(run, r);
        char ratio[24] = "", peak[24] = "", picture[24] = "";
        if (reference != NULL && r->median_ms > 0) {
            snprintf(ratio, sizeof ratio, "%.2fx", reference->median_ms / r->median_ms);
        }
        if (r->peak_bytes > 0) {
            snprintf(peak, sizeof peak, "%.1f", (double)r->peak_bytes / 1e6);
        }
        if (r->has_hash) {
            snprintf(picture, sizeof picture, "%016" PRIx64, r->hash);
        }
        fprintf(out, "%-15s %-10s %7d %-4s %10.3f %10.3f %10.3f %9s %9s  %-16s%s%s\n", r->case_name,
                r->method, r->threads, vd_isa_name(r->isa), r->median_ms, r->p99_ms, r->min_ms,
                ratio, peak, picture, r->note[0] ? "  " : "", r->note);
    }
    fprintf(out, "speed: against the line of the case that says 1.00x, at the same SIMD level\n");
}

/* The processor's own name, from /proc/cpuinfo. */
static void read_cpu_name(char *out, size_t out_bytes) {
    snprintf(out, out_bytes, "unknown");
    FILE *file = fopen("/proc/cpuinfo", "r");
    if (file == NULL) {
        return;
    }
    char line[512];
    while (fgets(line, sizeof line, file) != NULL) {
        char *colon = strchr(line, ':');
        if (strncmp(line, "model name", 10) == 0 && colon != NULL) {
            colon += 1 + strspn(colon + 1, " \t");
            colon[strcspn(colon, "\n")] = '\0';
            snprintf(out, out_bytes, "%s", colon);
            break;
        }
    }
    fclose(file);
}

static json_t *result_as_json(const bench_result *r) {
    char hash[24];
    snprintf(hash, sizeof hash, "%016" PRIx64, r->hash);
    return json_pack("{s:s, s:s, s:i, s:s, s:i, s:i, s:f, s:f, s:f, s:I, s:o}", "case",
                     r->case_name, "method", r->method, "threads", r->threads, "isa",
                     vd_isa_name(r->isa), "width", r->width, "height", r->height, "median_ms",
                     r->median_ms, "p99_ms", r->p99_ms, "min_ms", r->min_ms, "peak_bytes",
                     (json_int_t)r->peak_bytes, "hash",
                     r->has_hash ? json_string(hash) : json_null());
}

static vd_status write_json(const bench_run *run, const char *path) {
    char cpu[256];
    read_cpu_name(cpu, sizeof cpu);
    json_t *results = json_array();
    for (int i = 0; i < run->result_count; i++) {
        json_array_append_new(results, result_as_json(&run->results[i]));
    }
    json_t *root =
        json_pack("{s:s, s:s, s:s, s:s, s:o}", "commit", VEDUTA_COMMIT, "compiler", VEDUTA_COMPILER,
                  "flags", VEDUTA_FLAGS, "cpu", cpu, "results", results);
    char *text = root ? json_dumps(root, JSON_INDENT(2) | JSON_REAL_PRECISION(7)) : NULL;
    json_decref(root);
    if (text == NULL) {
        return vd_failure(VD_ERROR_MEMORY, "out of memory while writing %.200s", path);
    }
    vd_status status = vd_write_text(path, text);
    free(text);
    return status;
}

/* Every method of a case must have drawn the reference's picture, on every SIMD level. */
static vd_status check_pictures(const bench_run *run) {
    for (int i = 0; i < run->result_count; i++) {
        const bench_result *r = &run->results[i];
        for (int j = 0; r->same_picture && j < i; j++) {
            const bench_result *first = &run->results[j];
            if (!first->same_picture || strcmp(first->case_name, r->case_name) != 0) {
                continue;
            }
            if (first->hash != r->hash) {
                return vd_failure(VD_ERROR_FORMAT,
                                  "case %s: the picture of %s with %d threads at %s differs from "
                                  "that of %s with %d at %s; this is a bug, please report it",
                                  r->case_name, r->method, r->threads, vd_isa_name(r->isa),
                                  first->method, first->threads, vd_isa_name(first->isa));
            }
            break;
        }
    }
    return vd_success();
}

/* ---- the command ------------------------------------------------------------------------------*/

static void print_cases(FILE *out) {
    const bench_case *found;
    for (int i = 0; (found = bench_case_at(i)) != NULL; i++) {
        fprintf(out, "  %-15s %s\n", found->name, found->help);
    }
}

static void print_help(void) {
    printf(
        "veduta bench: measure, and check that what is fast draws the same picture\n\n"
        "  veduta bench CASE… [--json FILE] [--threads 1,2] [--repeat N] [--isa v2,v3,v4]\n\n"
        "Prints a table: median, 99th percentile and minimum after a run to warm up. Ends with 1\n"
        "when pictures that must be equal are not.\n\nCases\n");
    print_cases(stdout);
    vd_options_print_help(table, (int)(sizeof table / sizeof table[0]), stdout);
    printf("\nExamples\n"
           "  veduta bench classic --threads 1,2 --json classic.json\n"
           "  veduta bench png startup\n");
}

static const bench_case *find_case(const char *name) {
    const char *names[64];
    int count = 0;
    const bench_case *found;
    for (; count < 64 && (found = bench_case_at(count)) != NULL; count++) {
        if (strcmp(found->name, name) == 0) {
            return found;
        }
        names[count] = found->name;
    }
    const char *nearest = vd_nearest_name(name, names, count);
    fprintf(stderr, "veduta: there is no case %s%s%s%s; `veduta bench --list` lists them\n", name,
            nearest ? ", did you mean " : "", nearest ? nearest : "", nearest ? "?" : "");
    return NULL;
}

/* Reads --threads and --isa; false, with a sentence said, when they are bad. */
static bool read_lists(const vd_options *options, bench_run *run) {
    double numbers[BENCH_MAX_THREADS];
    const char *threads = options->values[OPTION_THREADS].text;
    run->thread_count = vd_read_numbers(threads, numbers, BENCH_MAX_THREADS);
    bool good = run->thread_count > 0;
    for (int i = 0; i < run->thread_count; i++) {
        good = good && numbers[i] >= 1 && numbers[i] <= 1024 && numbers[i] == (int)numbers[i];
        run->threads[i] = good ? (int)numbers[i] : 1;
    }
    if (!good) {
        fprintf(stderr, "veduta: --threads %s: give numbers from 1 to 1024, such as 1,2\n",
                threads);
        return false;
    }
    const char *at = options->values[OPTION_ISA].text;
    if (at == NULL) {
        run->isas[run->isa_count++] = VD_ISA_AUTO;
        return true;
    }
    while (run->isa_count < VD_ISA_COUNT) {
        size_t length = strcspn(at, ",");
        int isa = VD_ISA_V2;
        while (isa < VD_ISA_COUNT && (strlen(vd_isa_name((vd_isa)isa)) != length ||
                                      strncmp(at, vd_isa_name((vd_isa)isa), length) != 0)) {
            isa++;
        }
        if (isa == VD_ISA_COUNT) {
            break;
        }
        run->isas[run->isa_count++] = (vd_isa)isa;
        if (at[length] == '\0') {
            return true;
        }
        at += length + 1;
    }
    fprintf(stderr, "veduta: --isa %s: give v2, v3, v4 or some of them, such as v2,v3\n",
            options->values[OPTION_ISA].text);
    return false;
}

/* Runs the cases, prints and writes what they gave. */
static vd_status run_cases(bench_run *run, const vd_options *options) {
    const char *json = options->values[OPTION_JSON].text;
    vd_status status = vd_success();
    for (int i = 0; i < options->input_count && status.code == VD_OK; i++) {
        const bench_case *chosen = find_case(options->inputs[i]);
        status = chosen->function(run, chosen->name);
    }
    if (status.code != VD_OK) {
        return status;
    }
    print_table(run, json != NULL && strcmp(json, "-") == 0 ? stderr : stdout);
    if (json != NULL) {
        status = write_json(run, json);
    }
    return status.code == VD_OK ? check_pictures(run) : status;
}

/* Parses and runs; the options and the run are released by the caller. */
static int bench(vd_options *options, bench_run *run, int argc, char **argv) {
    vd_status status = vd_options_parse(options, argc, argv);
    if (status.code != VD_OK) {
        fprintf(stderr, "veduta: %s\n", status.message);
        return status.code == VD_ERROR_ARGUMENT ? 2 : 1;
    }
    if (options->values[OPTION_HELP].number != 0) {
        print_help();
        return 0;
    }
    if (options->values[OPTION_LIST].number != 0) {
        print_cases(stdout);
        return 0;
    }
    if (options->input_count == 0) {
        fprintf(stderr, "veduta: bench needs at least one case, as in `veduta bench classic`; "
                        "`veduta bench --list` lists them\n");
        return 2;
    }
    for (int i = 0; i < options->input_count; i++) {
        if (find_case(options->inputs[i]) == NULL) {
            return 2;
        }
    }
    if (!read_lists(options, run)) {
        return 2;
    }
    run->repeat = (int)options->values[OPTION_REPEAT].number;
    run->quiet = isatty(STDERR_FILENO) == 0;
    status = run_cases(run, options);
    if (status.code != VD_OK) {
        fprintf(stderr, "veduta: %s\n", status.message);
        return 1;
    }
    return 0;
}

int vd_command_bench(int argc, char **argv) {
    vd_options options;
    vd_status status =
        vd_options_init(&options, "bench", table, (int)(sizeof table / sizeof table[0]));
    if (status.code != VD_OK) {
        fprintf(stderr, "veduta: %s\n", status.message);
        return 1;
    }
    bench_run *run = calloc(1, sizeof *run);
    int result = 1;
    if (run == NULL) {
        fprintf(stderr, "veduta: out of memory\n");
    } else {
        result = bench(&options, run, argc, argv);
    }
    free(run);
    vd_options_finish(&options);
    return result;
}

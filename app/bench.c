/* bench.c: `veduta bench`, measured tables. */
#include "bench.h"
#include "bench_raster.h"
#include "commands.h"
#include "options.h"

#include <fnmatch.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <time.h>
#include <unistd.h>

enum {
    OPTION_JSON,
    OPTION_PLOT,
    OPTION_THREADS,
    OPTION_REPEAT,
    OPTION_ISA,
    OPTION_MAP,
    OPTION_PARTICLES,
    OPTION_QUICK,
    OPTION_LIST,
    OPTION_HELP
};

/* The most measured runs of one thing, and how long they may take together, in seconds. */
#define MOST_RUNS 1000
#define MOST_AUTOMATIC_RUNS 200
#define RUN_SECONDS 2.0
#define LEAST_RUNS 5
#define MOST_CASES 128

static bool is_map_name(const char *text) {
    return strcmp(text, "mont-blanc") == 0 || strcmp(text, "mirrored") == 0 ||
           strcmp(text, "noise") == 0;
}

static const vd_option table[] = {
    {.key = "json",
     .group = "Options",
     .type = VD_OPTION_FILE,
     .argument = "FILE",
     .help = "write the results as JSON; - is standard output"},
    {.key = "plot",
     .group = "Options",
     .type = VD_OPTION_FILE,
     .argument = "DIR",
     .help = "draw every sweep with gnuplot: DIR/CASE.svg"},
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
             "at least 5 (sweeps and triangles 0.4 s, 3)"},
    {.key = "isa",
     .group = "Options",
     .type = VD_OPTION_TEXT,
     .argument = "v2,v3,v4",
     .help = "SIMD levels to measure with; otherwise the best of this processor"},
    {.key = "map",
     .group = "Options",
     .type = VD_OPTION_FILE,
     .argument = "NAME|FILE",
     .fallback = "mont-blanc",
     .is_name = is_map_name,
     .help = "the map under classic, shadow and lens cases: mont-blanc, mirrored (512x512 of it "
             "four times), noise or a picture of heights"},
    {.key = "particles",
     .group = "Options",
     .type = VD_OPTION_INTEGER,
     .min = 0,
     .max = 1e9,
     .argument = "N",
     .fallback = "0",
     .help = "particles of impostor-grain and remote-cloud; 0: 2,000,000"},
    {.key = "quick",
     .group = "Options",
     .type = VD_OPTION_SWITCH,
     .help =
         "the first three points of every sweep, triangles at 1024x1024 only: to try the bench, "
         "not to measure"},
    {.key = "list",
     .group = "Options",
     .type = VD_OPTION_SWITCH,
     .help = "list the cases and groups and end"},
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

double bench_wall_ms(void) {
    return read_clock_ms(CLOCK_MONOTONIC);
}

double bench_cpu_ms(void) {
    return read_clock_ms(CLOCK_PROCESS_CPUTIME_ID);
}

double bench_children_cpu_ms(void) {
    struct rusage usage;
    getrusage(RUSAGE_CHILDREN, &usage);
    return (double)(usage.ru_utime.tv_sec + usage.ru_stime.tv_sec) * 1e3 +
           (double)(usage.ru_utime.tv_usec + usage.ru_stime.tv_usec) * 1e-3;
}

static int compare_times(const void *a, const void *b) {
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

void bench_summarize(double *times_ms, int runs, bench_result *result) {
    qsort(times_ms, (size_t)runs, sizeof times_ms[0], compare_times);
    result->min_ms = times_ms[0];
    result->median_ms = (times_ms[(runs - 1) / 2] + times_ms[runs / 2]) / 2;
    result->p99_ms = times_ms[(runs * 99 + 99) / 100 - 1]; /* nearest rank */
}

void bench_say(const bench_run *run, const bench_result *result) {
    if (!run->quiet) {
        fprintf(stderr, "\r\033[K%s: %s, %d thread%s", result->of->name, result->method,
                result->threads, result->threads == 1 ? "" : "s");
    }
}

/* Measured runs of what took `estimate_ms` once. */
static int count_runs(const bench_run *run, double estimate_ms) {
    if (run->repeat > 0) {
        return run->repeat;
    }
    double fitting = run->seconds * 1e3 / (estimate_ms > 1e-3 ? estimate_ms : 1e-3);
    return fitting < run->least_runs       ? run->least_runs
           : fitting > MOST_AUTOMATIC_RUNS ? MOST_AUTOMATIC_RUNS
                                           : (int)fitting;
}

vd_status bench_measure(bench_run *run, bench_work *work, void *user, bench_clock *clock_ms,
                        bench_result *result) {
    bench_say(run, result);
    double start_ms = bench_wall_ms();
    vd_status status = work(user);
    int runs = count_runs(run, bench_wall_ms() - start_ms);
    double times_ms[MOST_RUNS];
    const double end_ms = bench_wall_ms() + run->most_seconds * 1e3;
    for (int i = 0; i < runs && status.code == VD_OK; i++) {
        if (i > 0 && run->repeat == 0 && bench_wall_ms() > end_ms) {
            runs = i;
            break;
        }
        start_ms = clock_ms();
        status = work(user);
        times_ms[i] = clock_ms() - start_ms;
    }
    if (!run->quiet) {
        fprintf(stderr, "\r\033[K");
    }
    if (status.code != VD_OK) {
        return status;
    }
    bench_summarize(times_ms, runs, result);
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

vd_status bench_add_published(bench_run *run, const bench_case *self) {
    vd_status status = vd_success();
    const bench_published *figure = self->published;
    for (; figure != NULL && figure->method != NULL && status.code == VD_OK; figure++) {
        bench_result result = bench_result_of(self, figure->method);
        result.published = true;
        result.width = self->width;
        result.height = self->rows;
        result.median_ms = 1e3 / figure->fps;
        snprintf(result.note, sizeof result.note, "published: %s", figure->note);
        status = bench_add(run, &result);
    }
    return status;
}

bench_result bench_result_of(const bench_case *self, const char *method) {
    bench_result result = {.of = self, .at = NAN, .threads = 1, .vs_peer = NAN};
    snprintf(result.method, sizeof result.method, "%s", method);
    return result;
}

double bench_target_fps(const bench_case *self, vd_isa isa, int threads) {
    if (threads != 2) {
        return 0;
    }
    return self->target_fps / (isa == VD_ISA_V4 ? 1 : isa == VD_ISA_V3 ? 2 : 5);
}

/* ---- the command ------------------------------------------------------------------------------*/

static void print_cases(FILE *out) {
    const bench_case *found;
    for (int i = 0; (found = bench_case_at(i)) != NULL; i++) {
        fprintf(out, "  %-30s %s\n", found->name, found->help);
    }
    fprintf(out, "\nGroups\n");
    const bench_group *group;
    for (int i = 0; (group = bench_group_at(i)) != NULL; i++) {
        fprintf(out, "  %-30s %s:\n", group->name, group->help);
        fprintf(out, "  %-30s   %s\n", "", group->members);
    }
}

static void print_help(void) {
    printf(
        "veduta bench: measure, and check that what is fast draws the same picture\n\n"
        "  veduta bench CASE… [--json FILE] [--plot DIR] [--threads 1,2] [--isa v2,v3,v4]\n\n"
        "Prints a table: median, 99th percentile and minimum after a run to warm up. Ends with 1\n"
        "when pictures that must be equal are not. CASE may be a pattern, such as 'dragon*'.\n\n"
        "Cases\n");
    print_cases(stdout);
    vd_options_print_help(table, (int)(sizeof table / sizeof table[0]), stdout);
    printf("\nExamples\n"
           "  veduta bench terrain --json terrain.json --plot plots\n"
           "  veduta bench classic-default --isa v2,v3,v4\n"
           "  veduta bench classic --map heights.png --threads 1,2,4\n"
           "  veduta bench 'dragon*-1024' --threads 2\n");
}

static const bench_case *find_case(const char *name) {
    const bench_case *found;
    for (int i = 0; (found = bench_case_at(i)) != NULL; i++) {
        if (strcmp(found->name, name) == 0) {
            return found;
        }
    }
    return NULL;
}

static const bench_group *find_group(const char *name) {
    const bench_group *found;
    for (int i = 0; (found = bench_group_at(i)) != NULL; i++) {
        if (strcmp(found->name, name) == 0) {
            return found;
        }
    }
    return NULL;
}

/* The cases to run, each once, in the order in which they were named. */
typedef struct selection {
    const bench_case *cases[MOST_CASES];
    int count;
} selection;

static void select_case(selection *selected, const bench_case *found) {
    for (int i = 0; i < selected->count; i++) {
        if (selected->cases[i] == found) {
            return;
        }
    }
    if (selected->count < MOST_CASES) {
        selected->cases[selected->count++] = found;
    }
}

/* Adds the cases that a pattern of the shell's fits, such as *-1024; false when none does. */
static bool select_pattern(selection *selected, const char *pattern) {
    const bench_case *found;
    bool any = false;
    for (int i = 0; (found = bench_case_at(i)) != NULL; i++) {
        if (fnmatch(pattern, found->name, 0) == 0) {
            select_case(selected, found);
            any = true;
        }
    }
    return any;
}

/* Adds a case, or the members of a group; false when there is no such name. */
static bool select_name(selection *selected, const char *name) {
    const bench_case *found = find_case(name);
    if (found != NULL) {
        select_case(selected, found);
        return true;
    }
    if (strpbrk(name, "*?[") != NULL) {
        return select_pattern(selected, name);
    }
    const bench_group *group = find_group(name);
    const char *at = group != NULL ? group->members : "";
    while (*at != '\0') {
        char member[64];
        size_t length = strcspn(at, " ");
        snprintf(member, sizeof member, "%.*s", (int)length, at);
        if (!select_name(selected, member)) {
            return false;
        }
        at += length + strspn(at + length, " ");
    }
    return group != NULL;
}

static void say_unknown(const char *name) {
    const char *names[2 * MOST_CASES];
    int count = 0;
    for (int i = 0; i < MOST_CASES && bench_case_at(i) != NULL; i++) {
        names[count++] = bench_case_at(i)->name;
    }
    for (int i = 0; i < MOST_CASES && bench_group_at(i) != NULL; i++) {
        names[count++] = bench_group_at(i)->name;
    }
    const char *nearest = vd_nearest_name(name, names, count);
    fprintf(stderr, "veduta: there is no case %s%s%s%s; `veduta bench --list` lists them\n", name,
            nearest ? ", did you mean " : "", nearest ? nearest : "", nearest ? "?" : "");
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
static vd_status run_cases(bench_run *run, const selection *selected, const vd_options *options) {
    const char *json = options->values[OPTION_JSON].text;
    const char *plot = options->values[OPTION_PLOT].text;
    vd_status status = plot != NULL ? bench_plot_prepare(plot) : vd_success();
    for (int i = 0; i < selected->count && status.code == VD_OK; i++) {
        run->seconds = RUN_SECONDS;
        run->least_runs = LEAST_RUNS;
        run->most_seconds = INFINITY;
        status = selected->cases[i]->function(run, selected->cases[i]);
    }
    if (status.code != VD_OK) {
        return status;
    }
    FILE *out = json != NULL && strcmp(json, "-") == 0 ? stderr : stdout;
    bench_print_table(run, out);
    bench_print_means(run, out);
    if (json != NULL) {
        status = bench_write_json(run, json);
    }
    if (status.code == VD_OK && plot != NULL) {
        status = bench_plot(run, plot);
    }
    if (status.code == VD_OK && plot != NULL) {
        status = bench_plot_raster(run, plot);
    }
    return status.code == VD_OK ? bench_check_pictures(run) : status;
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
    selection selected = {.count = 0};
    for (int i = 0; i < options->input_count; i++) {
        if (!select_name(&selected, options->inputs[i])) {
            say_unknown(options->inputs[i]);
            return 2;
        }
    }
    if (!read_lists(options, run)) {
        return 2;
    }
    run->repeat = (int)options->values[OPTION_REPEAT].number;
    run->map = options->values[OPTION_MAP].text;
    run->particles = (size_t)options->values[OPTION_PARTICLES].number;
    run->quick = options->values[OPTION_QUICK].number != 0;
    run->quiet = isatty(STDERR_FILENO) == 0;
    status = run_cases(run, &selected, options);
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

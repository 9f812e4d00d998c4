/* bench_report.c: what `veduta bench` measured, as a table and as JSON. */
#include "bench.h"
#include "bench_raster.h"
#include "commit.h"
#include "options.h"

#include <inttypes.h>
#include <jansson.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Whether two results belong to the same point of the same case. */
static bool same_point(const bench_result *a, const bench_result *b) {
    return a->of == b->of && (a->at == b->at || (isnan(a->at) && isnan(b->at)));
}

const bench_result *bench_reference_of(const bench_run *run, const bench_result *result) {
    for (int i = 0; i < run->result_count; i++) {
        const bench_result *other = &run->results[i];
        if (other->reference && same_point(other, result) && other->isa == result->isa) {
            return other;
        }
    }
    return NULL;
}

vd_status bench_check_pictures(const bench_run *run) {
    for (int i = 0; i < run->result_count; i++) {
        const bench_result *r = &run->results[i];
        for (int j = 0; r->same_picture && j < i; j++) {
            const bench_result *first = &run->results[j];
            if (!first->same_picture || !same_point(first, r) || first->picture != r->picture) {
                continue;
            }
            if (first->hash != r->hash) {
                return vd_failure(VD_ERROR_FORMAT,
                                  "case %s: the picture of %s with %d threads at %s differs from "
                                  "that of %s with %d at %s; this is a bug, please report it",
                                  r->of->name, r->method, r->threads, vd_isa_name(r->isa),
                                  first->method, first->threads, vd_isa_name(first->isa));
            }
            break;
        }
    }
    return vd_success();
}

/* ---- the table --------------------------------------------------------------------------------*/

/* A number with `decimals` (a time below 0.1 with two more), blank when it is not above 0. */
typedef struct cell {
    char text[24];
} cell;

static cell make_cell(double number, int decimals) {
    cell made = {""};
    if (number > 0) {
        snprintf(made.text, sizeof made.text, "%.*f", decimals == 3 && number < 0.1 ? 5 : decimals,
                 number);
    }
    return made;
}

static cell ratio_to_reference(const bench_run *run, const bench_result *r) {
    const bench_result *reference = bench_reference_of(run, r);
    cell made = {""};
    if (reference != NULL && r->median_ms > 0 && !r->published) {
        double ratio = reference->median_ms / r->median_ms;
        snprintf(made.text, sizeof made.text, "%.*fx", ratio < 99.995 ? 2 : 0, ratio);
    }
    return made;
}

/* Characters of the longest name of a case, at least `least`. */
static int widest_name(const bench_run *run, int least) {
    int widest = least;
    for (int i = 0; i < run->result_count; i++) {
        int length = (int)strlen(run->results[i].of->name);
        widest = length > widest ? length : widest;
    }
    return widest;
}

static void print_row(const bench_run *run, const bench_result *r, int name_width, FILE *out) {
    char at[16] = "", threads[16] = "", picture[24] = "";
    if (!isnan(r->at)) {
        snprintf(at, sizeof at, "%.0f", r->at);
    }
    if (!r->published) {
        snprintf(threads, sizeof threads, "%d", r->threads);
    }
    if (r->has_hash) {
        snprintf(picture, sizeof picture, "%016" PRIx64, r->hash);
    }
    double fps = r->median_ms > 0 ? 1e3 / r->median_ms : 0;
    fprintf(out, "%-*s %7s %-18s %7s %-4s %10s %10s %10s %9s %8s %7s %8s  %-16s%s%s\n", name_width,
            r->of->name, at, r->method, threads, r->published ? "" : vd_isa_name(r->isa),
            make_cell(r->median_ms, 3).text, make_cell(r->p99_ms, 3).text,
            make_cell(r->min_ms, 3).text, make_cell(fps, fps < 100 ? 2 : 0).text,
            ratio_to_reference(run, r).text, make_cell(r->target_fps, 0).text,
            make_cell((double)r->peak_bytes / 1e6, 1).text, picture, r->note[0] ? "  " : "",
            r->note);
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

/* Additions that wait for each other, 10^9 a second: the clock that the processor really ran at,
 * whatever it says, and without which times of two machines, or hours, cannot be compared. */
static double measure_clock(void) {
    enum { ADDITIONS = 1 << 25 };
    uint64_t sum = 0;
    const double begin = bench_cpu_ms();
    for (int i = 0; i < ADDITIONS; i++) {
        sum++;
        __asm__ volatile("" : "+r"(sum)); /* not to be added up beforehand */
    }
    return (double)sum * 1e-6 / (bench_cpu_ms() - begin);
}

void bench_print_table(const bench_run *run, FILE *out) {
    int name_width = widest_name(run, 21);
    fprintf(out, "%-*s %7s %-18s %7s %-4s %10s %10s %10s %9s %8s %7s %8s  %-16s\n", name_width,
            "case", "at", "method", "threads", "isa", "median ms", "p99 ms", "min ms", "fps",
            "speed", "target", "peak MB", "picture");
    for (int i = 0; i < run->result_count; i++) {
        print_row(run, &run->results[i], name_width, out);
    }
    fprintf(out, "fps: 1000 / median ms; target: the fps to reach with two threads; speed: against "
                 "the line of the case that says 1.00x, at the same SIMD level\n");
    char cpu[256];
    read_cpu_name(cpu, sizeof cpu);
    fprintf(out,
            "processor: %s; when it ended it did %.2f · 10^9 additions a second, each waiting "
            "for the one before\n",
            cpu, measure_clock());
}

/* ---- JSON -------------------------------------------------------------------------------------*/

/* A number, or null where there is none. */
static json_t *real_or_null(double number) {
    return number > 0 || number == 0 ? json_real(number) : json_null();
}

static json_t *count_or_null(uint64_t number) {
    return number > 0 ? json_integer((json_int_t)number) : json_null();
}

/* What only triangles have. */
static void add_raster(json_t *object, const bench_result *r) {
    json_object_set_new(object, "model", r->model != NULL ? json_string(r->model) : json_null());
    json_object_set_new(object, "fine_pixels", count_or_null((uint64_t)r->fine));
    json_object_set_new(object, "peak_resident_bytes", count_or_null(r->peak_resident_bytes));
    json_object_set_new(object, "output_bytes", count_or_null(r->output_bytes));
    json_object_set_new(object, "fragments", count_or_null(r->fragments));
    json_object_set_new(object, "shaded", count_or_null(r->shaded));
    json_object_set_new(object, "vs_llvmpipe", real_or_null(r->vs_peer));
}

/* What only codecs have: the time of a picture over links of 1, 10 and 100 MB/s. */
static void add_codec(json_t *object, const bench_result *r) {
    json_object_set_new(object, "limited_ms",
                        r->limited_ms[0] > 0 ? json_pack("[f, f, f]", r->limited_ms[0],
                                                         r->limited_ms[1], r->limited_ms[2])
                                             : json_null());
}

/* What others published has only a name, a size, a time and a note; the rest is null. */
static json_t *result_as_json(const bench_run *run, const bench_result *r) {
    char hash[24];
    snprintf(hash, sizeof hash, "%016" PRIx64, r->hash);
    const bench_result *reference = r->published ? NULL : bench_reference_of(run, r);
    bool ours = !r->published;
    json_t *object = json_pack(
        "{s:s, s:o, s:s, s:b, s:o, s:o, s:i, s:i, s:f, s:o, s:o, s:f, s:o, s:o, s:o, s:o, s:s}",
        "case", r->of->name, "at", real_or_null(r->at), "method", r->method, "published",
        r->published, "threads", ours ? json_integer(r->threads) : json_null(), "isa",
        ours ? json_string(vd_isa_name(r->isa)) : json_null(), "width", r->width, "height",
        r->height, "median_ms", r->median_ms, "p99_ms", real_or_null(ours ? r->p99_ms : NAN),
        "min_ms", real_or_null(ours ? r->min_ms : NAN), "fps",
        r->median_ms > 0 ? 1e3 / r->median_ms : 0.0, "speed",
        real_or_null(reference != NULL && r->median_ms > 0 ? reference->median_ms / r->median_ms
                                                           : NAN),
        "target_fps", real_or_null(r->target_fps > 0 ? r->target_fps : NAN), "peak_bytes",
        ours ? json_integer((json_int_t)r->peak_bytes) : json_null(), "hash",
        r->has_hash ? json_string(hash) : json_null(), "note", r->note);
    add_raster(object, r);
    add_codec(object, r);
    return object;
}

/* The means of all methods; of those with the most threads also by name alone. */
static void add_means(json_t *root, const bench_run *run) {
    bench_mean means[BENCH_MOST_MEANS];
    const int count = bench_means(run, means, BENCH_MOST_MEANS);
    json_t *all = json_array(), *by_name = json_object();
    int threads = 0;
    for (int i = 0; i < count; i++) {
        threads = means[i].first->threads > threads ? means[i].first->threads : threads;
    }
    for (int i = 0; i < count; i++) {
        const bench_mean *m = &means[i];
        const char *name = m->first->method;
        json_array_append_new(
            all, json_pack("{s:s, s:i, s:s, s:i, s:o, s:o, s:o, s:o, s:o}", "method", name,
                           "threads", m->first->threads, "isa", vd_isa_name(m->first->isa), "cells",
                           m->cells, "geomean", real_or_null(m->vs_peer), "least",
                           real_or_null(m->worst != NULL ? m->worst->vs_peer : NAN), "least_case",
                           m->worst != NULL ? json_string(m->worst->of->name) : json_null(),
                           "speed_up", real_or_null(m->speed_up), "memory_of_output_8192",
                           real_or_null(m->most_memory)));
        if (m->first->threads == threads && m->cells > 0 &&
            json_object_get(by_name, name) == NULL) {
            json_object_set_new(by_name, name, json_real(m->vs_peer));
        }
    }
    json_object_set_new(root, "geomean_vs_llvmpipe", by_name);
    json_object_set_new(root, "raster_means", all);
}

vd_status bench_write_json(const bench_run *run, const char *path) {
    char cpu[256];
    read_cpu_name(cpu, sizeof cpu);
    json_t *results = json_array();
    for (int i = 0; i < run->result_count; i++) {
        json_array_append_new(results, result_as_json(run, &run->results[i]));
    }
    json_t *root =
        json_pack("{s:s, s:s, s:s, s:s, s:f, s:s, s:o}", "commit", VEDUTA_COMMIT, "compiler",
                  VEDUTA_COMPILER, "flags", VEDUTA_FLAGS, "cpu", cpu, "additions_per_ns",
                  measure_clock(), "map", run->map, "results", results);
    if (root != NULL) {
        add_means(root, run);
    }
    char *text = root ? json_dumps(root, JSON_INDENT(2) | JSON_REAL_PRECISION(7)) : NULL;
    json_decref(root);
    if (text == NULL) {
        return vd_failure(VD_ERROR_MEMORY, "out of memory while writing %.200s", path);
    }
    vd_status status = vd_write_text(path, text);
    free(text);
    return status;
}

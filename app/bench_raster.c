/* bench_raster.c: the published models by every raster method, beside Mesa's llvmpipe.
 *
 * Frame: parallel projection along −z, the model as large as fits, 8-bit colour and float depth
 * written; grey = depth³, and Phong (methods that end in -phong). The models come from
 * script/bench-models; one that is not there is left out. The peer is the program veduta-llvmpipe
 * beside this one. A cell is a model, a size and a shading: the means over all of them are what the
 * bench is for.
 */
#include "bench_raster.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* ---- cells ------------------------------------------------------------------------------------*/

/* The peer and how its picture differs; false where there is none. */
static bool measure_peer(bench_run *run, const bench_case *self, bench_view *v,
                         const bench_model *m, const char *shading, const char *ending,
                         const char *picture, bench_result *peer) {
    char name[32];
    snprintf(name, sizeof name, "llvmpipe%s", ending);
    *peer = bench_result_of(self, name);
    return bench_peer_measure(run, v, m, shading, picture, peer);
}

/* The methods in the order of the table. */
static vd_status measure_methods(bench_run *run, const bench_case *self, bench_view *v,
                                 const bench_model *m, int shading, const char *ending,
                                 const bench_result *peer) {
    vd_status status = vd_success();
    for (int method = 0; method < VD_RASTER_REFERENCE && status.code == VD_OK; method++) {
        char name[32];
        v->def.method = (vd_raster_method)method;
        snprintf(name, sizeof name, "%s%s", vd_raster_method_name(v->def.method), ending);
        bench_result result = bench_result_of(self, name);
        result.picture = shading;
        status = bench_view_measure(run, v, m, &result);
        if (status.code == VD_OK && peer != NULL) {
            bench_result *added = &run->results[run->result_count - 1];
            added->vs_peer = peer->median_ms / added->median_ms;
            snprintf(added->note, sizeof added->note, "%.2f x llvmpipe", added->vs_peer);
        }
    }
    return status;
}

/* The peer first: the others are compared with it. */
static vd_status measure_shading(bench_run *run, const bench_case *self, bench_view *v,
                                 const bench_model *m, vd_shading shading, const char *picture) {
    const char *ending = shading == VD_SHADING_DEPTH ? "" : "-phong";
    bench_result peer;
    v->draw.shader = vd_shader_find(shading);
    const bool has_peer = measure_peer(run, self, v, m, vd_shading_name(shading), ending,
                                       picture[0] != '\0' ? picture : NULL, &peer);
    const int row = run->result_count;
    vd_status status = has_peer ? bench_add(run, &peer) : vd_success();
    if (status.code == VD_OK) {
        status = measure_methods(run, self, v, m, (int)shading, ending, has_peer ? &peer : NULL);
    }
    if (status.code == VD_OK && has_peer && picture[0] != '\0') {
        bench_result *added = &run->results[row];
        bench_peer_compare(v, picture, added->note, sizeof added->note);
    }
    return status;
}

/* A file for the peer's pixels; empty where none can be made. */
static void make_file(char path[64]) {
    snprintf(path, 64, "/tmp/veduta-bench-XXXXXX");
    const int file = mkstemp(path);
    if (file < 0) {
        path[0] = '\0';
    } else {
        close(file);
    }
}

vd_status bench_raster(bench_run *run, const bench_case *self) {
    static const vd_shading shadings[2] = {VD_SHADING_DEPTH, VD_SHADING_PHONG};
    char name[32], picture[64];
    bench_model m;
    snprintf(name, sizeof name, "%.*s", (int)strcspn(self->name, "-"), self->name);
    if ((run->quick && self->width > 1024) || !bench_model_read(bench_model_named(name), &m)) {
        return vd_success();
    }
    bench_raster_limits(run);
    make_file(picture);
    vd_status status = vd_success();
    for (int i = 0; i < run->isa_count; i++) {
        for (int t = 0; t < run->thread_count; t++) {
            for (int k = 0; k < 2 && status.code == VD_OK; k++) {
                bench_view v; /* anew: what one shading allocated is not another's peak */
                status = bench_view_init(&v, &m, 100, self->width, run->isas[i], run->threads[t]);
                if (status.code == VD_OK) {
                    status = measure_shading(run, self, &v, &m, shadings[k], picture);
                    bench_view_finish(&v);
                }
            }
        }
    }
    if (picture[0] != '\0') {
        unlink(picture);
    }
    bench_model_free(&m);
    return status;
}

/* ---- means ------------------------------------------------------------------------------------*/

static bool is_cell(const bench_result *r) {
    return r->of->function == bench_raster && strncmp(r->method, "llvmpipe", 8) != 0;
}

static const bench_result *with_one_thread(const bench_run *run, const bench_result *r) {
    for (int i = 0; i < run->result_count; i++) {
        const bench_result *other = &run->results[i];
        if (other->of == r->of && other->isa == r->isa && other->threads == 1 &&
            strcmp(other->method, r->method) == 0) {
            return other;
        }
    }
    return NULL;
}

#define MEMORY_SIDE 8192

static void add_cell(const bench_run *run, const bench_result *r, bench_mean *mean, double *sum,
                     double *speed_up_sum, int *speed_ups) {
    const bench_result *one = r->threads > 1 ? with_one_thread(run, r) : NULL;
    if (!isnan(r->vs_peer)) {
        *sum += log(r->vs_peer);
        mean->cells++;
        if (mean->worst == NULL || r->vs_peer < mean->worst->vs_peer) {
            mean->worst = r;
        }
    }
    if (one != NULL) {
        *speed_up_sum += log(one->median_ms / r->median_ms);
        ++*speed_ups;
    }
    if (r->width == MEMORY_SIDE) {
        const double ratio = (double)r->peak_bytes / (double)r->output_bytes;
        mean->most_memory = fmax(ratio, mean->most_memory); /* NaN at first: fmax takes the other */
    }
}

static bench_mean mean_of(const bench_run *run, const bench_result *first) {
    bench_mean mean = {.first = first, .most_memory = NAN};
    double sum = 0, speed_up_sum = 0;
    int speed_ups = 0;
    for (int i = 0; i < run->result_count; i++) {
        const bench_result *r = &run->results[i];
        if (is_cell(r) && strcmp(r->method, first->method) == 0 && r->threads == first->threads &&
            r->isa == first->isa) {
            add_cell(run, r, &mean, &sum, &speed_up_sum, &speed_ups);
        }
    }
    mean.vs_peer = mean.cells > 0 ? exp(sum / mean.cells) : NAN;
    mean.speed_up = speed_ups > 0 ? exp(speed_up_sum / speed_ups) : NAN;
    return mean;
}

int bench_means(const bench_run *run, bench_mean *out, int most) {
    int count = 0;
    for (int i = 0; i < run->result_count && count < most; i++) {
        const bench_result *r = &run->results[i];
        bool known = !is_cell(r);
        for (int k = 0; k < count && !known; k++) {
            known = strcmp(out[k].first->method, r->method) == 0 &&
                    out[k].first->threads == r->threads && out[k].first->isa == r->isa;
        }
        if (!known) {
            out[count++] = mean_of(run, r);
        }
    }
    return count;
}

static void print_number(double number, const char *format, int width, FILE *out) {
    char text[32] = "";
    if (!isnan(number)) {
        snprintf(text, sizeof text, format, number);
    }
    fprintf(out, " %*s", width, text);
}

void bench_print_means(const bench_run *run, FILE *out) {
    bench_mean means[BENCH_MOST_MEANS];
    const int count = bench_means(run, means, BENCH_MOST_MEANS);
    if (count == 0) {
        return;
    }
    fprintf(out,
            "\ntriangles, geometric means over cells (model, size)\n%-15s %7s %-4s %5s %11s %8s "
            "%-17s %8s %11s\n",
            "method", "threads", "isa", "cells", "x llvmpipe", "least", "there", "speed-up",
            "memory/out");
    for (int i = 0; i < count; i++) {
        const bench_mean *m = &means[i];
        fprintf(out, "%-15s %7d %-4s %5d", m->first->method, m->first->threads,
                vd_isa_name(m->first->isa), m->cells);
        print_number(m->vs_peer, "%.2f", 11, out);
        print_number(m->worst != NULL ? m->worst->vs_peer : NAN, "%.2f", 8, out);
        fprintf(out, " %-17s", m->worst != NULL ? m->worst->of->name : "");
        print_number(m->speed_up, "%.2f", 8, out);
        print_number(m->most_memory, "%.2f", 11, out);
        fprintf(out, "\n");
    }
    fprintf(out, "speed-up: against one thread; memory/out: most bytes held at 8192x8192, mesh and "
                 "frame among them, over the frame's\n");
}

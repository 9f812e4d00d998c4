/* bench_plot.c: the sweeps as SVG, drawn by gnuplot. */
#include "bench.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "gnuplot.h"

#define MOST_SERIES 32

vd_status bench_plot_prepare(const char *folder) {
    if (mkdir(folder, 0777) != 0 && errno != EEXIST) {
        return vd_failure(VD_ERROR_IO, "--plot: cannot make the folder %.200s: %s", folder,
                          strerror(errno));
    }
    if (access(folder, W_OK | X_OK) != 0) {
        return vd_failure(VD_ERROR_IO, "--plot: cannot write to the folder %.200s: %s", folder,
                          strerror(errno));
    }
    return vd_gnuplot_find();
}

/* ---- a script ---------------------------------------------------------------------------------*/

/* The rows of a sweep that share method, threads and SIMD level are one line of the plot. */
typedef struct series {
    const bench_result *first;
} series;

static bool same_series(const bench_result *a, const bench_result *b) {
    return strcmp(a->method, b->method) == 0 && a->threads == b->threads && a->isa == b->isa;
}

static int find_series(const bench_run *run, const bench_case *of, series *out) {
    int count = 0;
    for (int i = 0; i < run->result_count; i++) {
        const bench_result *r = &run->results[i];
        bool known = r->of != of || r->published;
        for (int j = 0; j < count && !known; j++) {
            known = same_series(out[j].first, r);
        }
        if (!known && count < MOST_SERIES) {
            out[count++].first = r;
        }
    }
    return count;
}

/* The same method has the same colour in every plot, one thread is dashed, more are solid. */
static const char *color_of(const char *method) {
    static const struct {
        const char *method, *color;
    } colors[] = {{"reference", "#666666"},
                  {"columns", "#c46a00"},
                  {"march", "#0060a8"},
                  {"shift", "#0060a8"}};
    for (size_t i = 0; i < sizeof colors / sizeof colors[0]; i++) {
        if (strcmp(colors[i].method, method) == 0) {
            return colors[i].color;
        }
    }
    return "#7a3b94";
}

/* Where a value stands on the axis. */
static double place_of(const bench_sweep *sweep, double value) {
    return sweep->linear ? value : log10(value);
}

/* The range, and ticks at the points; of neighbours too close to be read, the greater is named. */
static void write_ticks(const bench_sweep *sweep, int points, FILE *out) {
    double first = place_of(sweep, sweep->values[0]);
    double last = place_of(sweep, sweep->values[points - 1]);
    double margin = (last - first) * 0.03;
    fprintf(out, sweep->linear ? "set xrange [%.6g:%.6g]\n" : "set xrange [10**%.6g:10**%.6g]\n",
            first - margin, last + margin);
    fprintf(out, "set xtics (");
    double named = last + (last - first);
    for (int i = points - 1; i >= 0; i--) {
        double value = sweep->values[i], at = place_of(sweep, value);
        char label[16] = "";
        if (named - at > 0.092 * (last - first)) {
            named = at;
            bool round = value >= 1e4 && fmod(value, 1e3) == 0;
            snprintf(label, sizeof label,
                     value >= 1e6 ? "%.0f M"
                     : round      ? "%.0f k"
                                  : "%.0f",
                     value >= 1e6 ? value / 1e6
                     : round      ? value / 1e3
                                  : value);
        }
        fprintf(out, "%s\"%s\" %.9g", i < points - 1 ? ", " : "", label, value);
    }
    fprintf(out, ")\n");
}

static void write_axes(const bench_sweep *sweep, int points, FILE *out) {
    fprintf(out,
            "set terminal svg size 760,440 font 'sans-serif,13' background '#ffffff'\n"
            "set title \"%s\" noenhanced\nset xlabel \"%s\" noenhanced\n"
            "set ylabel \"median time, ms\"\nset key outside right top reverse Left samplen 2\n"
            "set grid xtics ytics lc rgb '#dddddd' lw 1 dt 1\nset border lc rgb '#888888'\n"
            "set tics textcolor rgb '#222222'\nset logscale y\nset format y '%%g'\n",
            sweep->title, sweep->axis);
    fprintf(out, sweep->linear ? "set format x '%%g'\n" : "set logscale x\n");
    write_ticks(sweep, points, out);
}

static void write_script(const bench_run *run, const bench_case *of, FILE *out) {
    series all[MOST_SERIES];
    int count = find_series(run, of, all);
    write_axes(of->sweep, bench_sweep_points(run, of->sweep), out);
    for (int s = 0; s < count; s++) {
        fprintf(out, "$data%d << EOD\n", s);
        for (int i = 0; i < run->result_count; i++) {
            const bench_result *r = &run->results[i];
            if (r->of == of && same_series(r, all[s].first)) {
                fprintf(out, "%.9g %.9g\n", r->at, r->median_ms);
            }
        }
        fprintf(out, "EOD\n");
    }
    fprintf(out, "plot ");
    for (int s = 0; s < count; s++) {
        const bench_result *r = all[s].first;
        char level[16] = "";
        if (run->isa_count > 1) {
            snprintf(level, sizeof level, ", %s", vd_isa_name(r->isa));
        }
        fprintf(out,
                "%s$data%d with linespoints lw 2 dt %d pt %d ps 0.6 lc rgb '%s' title '%s, %d"
                " thread%s%s'",
                s > 0 ? ", " : "", s, r->threads == 1 ? 2 : 1, 7, color_of(r->method), r->method,
                r->threads, r->threads == 1 ? "" : "s", level);
    }
    fprintf(out, "\n");
}

vd_status bench_gnuplot(FILE *script, const char *folder, const char *name) {
    char path[512];
    if (snprintf(path, sizeof path, "%s/%s.svg", folder, name) >= (int)sizeof path) {
        return vd_failure(VD_ERROR_ARGUMENT, "--plot: the folder's path is too long");
    }
    return vd_gnuplot_draw(script, path);
}

static vd_status plot_sweep(const bench_run *run, const bench_case *of, const char *folder) {
    FILE *script = tmpfile();
    if (script == NULL) {
        return vd_failure(VD_ERROR_IO, "cannot make a temporary file for gnuplot: %s",
                          strerror(errno));
    }
    write_script(run, of, script);
    const vd_status status = bench_gnuplot(script, folder, of->name);
    fclose(script);
    return status;
}

vd_status bench_plot(const bench_run *run, const char *folder) {
    vd_status status = vd_success();
    const bench_case *of;
    for (int c = 0; (of = bench_case_at(c)) != NULL && status.code == VD_OK; c++) {
        bool measured = false;
        for (int i = 0; i < run->result_count && of->sweep != NULL && !measured; i++) {
            measured = run->results[i].of == of;
        }
        if (measured) {
            status = plot_sweep(run, of, folder);
        }
    }
    return status;
}

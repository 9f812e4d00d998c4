/* bench_raster_plot.c: the triangle bench as SVG: one panel a model, one line a method.
 *
 *   raster-llvmpipe    how many times as fast as llvmpipe, against the picture's side
 *   raster-sizes       milliseconds of every method against the side
 *   raster-triangles   … against the share of the triangles
 *   raster-small       … against the largest small triangle
 *   raster-tiles       … against the tiles' side
 *
 * A plot whose rows were not measured is not drawn.
 */
#include "bench_raster.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define MOST_POINTS 16
#define MOST_LINES 16

/* One line of a panel. */
typedef struct line {
    char name[40];
    const char *color;
    int dash;
    int count;
    double x[MOST_POINTS], y[MOST_POINTS];
} line;

typedef struct plot {
    const char *name, *title, *x_axis, *y_axis;
    bench_function *function; /* of the cases whose rows are drawn */
    bool by_model;            /* a panel a model; else a line a model in two panels, by shading */
    bool linear;              /* the x axis */
    int width;                /* only pictures this wide; 0: all */
} plot;

static const plot plots[] = {
    {"raster-llvmpipe", "How many times as fast as llvmpipe: auto, two threads", "side, pixels",
     "times", bench_raster, false, false, 0},
    {"raster-sizes", "Time against the picture's side: depth shading", "side, pixels", "ms",
     bench_raster, true, false, 0},
    {"raster-triangles", "Time against the share of the triangles: 1024²", "% of the triangles",
     "ms", bench_raster_triangles, true, true, 1024},
    {"raster-small", "Time against the largest small triangle: 1024²", "pixels of its box", "ms",
     bench_raster_small, true, false, 0},
    {"raster-tiles", "Time against the tiles: 1024²", "side of a tile, pixels", "ms",
     bench_raster_tiles, true, false, 0},
};

/* The same method has the same colour in every plot. */
static const char *color_of(const char *name) {
    static const char *const colors[][2] = {
        {"llvmpipe", "#666666"},   {"auto", "#000000"},      {"scanline", "#c46a00"},
        {"immediate", "#7a3b94"},  {"tiled", "#0060a8"},     {"hybrid", "#2a8a3e"},
        {"bunny", "#c46a00"},      {"monkey", "#7a3b94"},    {"armadillo", "#2a8a3e"},
        {"dragon202k", "#0060a8"}, {"dragon871k", "#000000"}};
    for (size_t i = 0; i < sizeof colors / sizeof colors[0]; i++) {
        if (strcmp(colors[i][0], name) == 0) {
            return colors[i][1];
        }
    }
    return "#999999";
}

static bool is_phong(const bench_result *r) {
    return strstr(r->method, "-phong") != NULL;
}

/* Whether a row belongs to panel `panel` of the plot. */
static bool belongs(const plot *p, const bench_result *r, int panel, int threads) {
    if (r->of->function != p->function || r->threads != threads || r->model == NULL ||
        (p->width > 0 && r->width != p->width)) {
        return false;
    }
    if (p->by_model) {
        return !is_phong(r) && strcmp(r->model, bench_model_name(panel)) == 0;
    }
    return !isnan(r->vs_peer) && strncmp(r->method, "auto", 4) == 0 && is_phong(r) == (panel == 1);
}

static int find_lines(const bench_run *run, const plot *p, int panel, int threads, vd_isa isa,
                      line *lines) {
    int count = 0;
    for (int i = 0; i < run->result_count; i++) {
        const bench_result *r = &run->results[i];
        if (!belongs(p, r, panel, threads) || r->isa != isa) {
            continue;
        }
        const char *name = p->by_model ? r->method : r->model;
        int at = 0;
        while (at < count && strcmp(lines[at].name, name) != 0) {
            at++;
        }
        if (at == MOST_LINES) {
            continue;
        }
        if (at == count) {
            lines[count] = (line){.color = color_of(name), .dash = 1};
            snprintf(lines[count++].name, sizeof lines[0].name, "%s", name);
        }
        line *l = &lines[at];
        if (l->count < MOST_POINTS) {
            l->x[l->count] = isnan(r->at) ? r->width : r->at;
            l->y[l->count++] = p->by_model ? r->median_ms : r->vs_peer;
        }
    }
    return count > 0 && lines[0].count > 1 ? count : 0; /* one point is no line */
}

/* Ticks where points are. */
static void write_ticks(const line *l, FILE *out) {
    fprintf(out, "set xtics (");
    for (int i = 0; i < l->count; i++) {
        fprintf(out, "%s%.9g", i > 0 ? ", " : "", l->x[i]);
    }
    fprintf(out, ")\n");
}

/* Room beside the points, and above them for the key. */
static void write_ranges(const plot *p, const line *lines, int count, FILE *out) {
    double low = INFINITY, high = 0;
    for (int i = 0; i < count; i++) {
        for (int k = 0; k < lines[i].count; k++) {
            low = fmin(low, lines[i].y[k]);
            high = fmax(high, lines[i].y[k]);
        }
    }
    const double first = lines[0].x[0], last = lines[0].x[lines[0].count - 1];
    if (p->linear) {
        fprintf(out, "set xrange [%g:%g]\n", first - 10, last + 10);
    } else {
        fprintf(out, "set logscale x 2\nset xrange [%g:%g]\n", first / 1.2, last * 1.2);
    }
    fprintf(out, "set yrange [%g:%g]\n", low * 0.7, 3 * high * pow(high / low, 0.4));
}

static void write_panel(const plot *p, const char *title, const line *lines, int count, FILE *out) {
    for (int i = 0; i < count; i++) {
        fprintf(out, "$d%d << EOD\n", i);
        for (int k = 0; k < lines[i].count; k++) {
            fprintf(out, "%.9g %.9g\n", lines[i].x[k], lines[i].y[k]);
        }
        fprintf(out, "EOD\n");
    }
    fprintf(out, "set title \"%s\" noenhanced\n", title);
    write_ranges(p, lines, count, out);
    write_ticks(&lines[0], out);
    fprintf(out, "plot ");
    for (int i = 0; i < count; i++) {
        fprintf(out, "%s$d%d with linespoints lw 2 pt 7 ps 0.5 lc rgb '%s' title '%s'",
                i > 0 ? ", " : "", i, lines[i].color, lines[i].name);
    }
    fprintf(out, "\n");
}

static void write_head(const plot *p, int panels, FILE *out) {
    const int across = panels > 2 ? 3 : panels, down = (panels + across - 1) / across;
    fprintf(out,
            "set terminal svg size %d,%d font 'sans-serif,12' background '#ffffff'\n"
            "set multiplot layout %d,%d title \"%s\" noenhanced\n"
            "set xlabel \"%s\" noenhanced\nset ylabel \"%s\" noenhanced\n"
            "set key top left reverse Left samplen 1.5 spacing 0.9 font ',10'\n"
            "set grid xtics ytics lc rgb '#dddddd' lw 1 dt 1\nset border lc rgb '#888888'\n"
            "set tics textcolor rgb '#222222'\nset logscale y\nset format y '%%g'\n",
            across == 1 ? 520 : 340 * across, 300 * down + 40, down, across, p->title, p->x_axis,
            p->y_axis);
}

static vd_status draw(const bench_run *run, const plot *p, int threads, vd_isa isa,
                      const char *folder) {
    line *lines = calloc(MOST_LINES, sizeof *lines);
    FILE *script = tmpfile();
    vd_status status = vd_success();
    if (lines == NULL || script == NULL) {
        status = vd_failure(VD_ERROR_IO, "cannot make a temporary file for gnuplot: %s",
                            strerror(errno));
    }
    int panels = 0, drawn = 0;
    while (p->by_model && bench_model_name(panels) != NULL) {
        panels++;
    }
    panels = p->by_model ? panels : 2;
    int filled = 0;
    for (int i = 0; i < panels && status.code == VD_OK; i++) {
        memset(lines, 0, MOST_LINES * sizeof *lines);
        filled += find_lines(run, p, i, threads, isa, lines) > 0;
    }
    for (int i = 0; i < panels && filled > 0; i++) {
        memset(lines, 0, MOST_LINES * sizeof *lines);
        const int count = find_lines(run, p, i, threads, isa, lines);
        if (count > 0) {
            if (drawn++ == 0) {
                write_head(p, filled, script);
            }
            write_panel(p,
                        p->by_model ? bench_model_name(i)
                        : i == 0    ? "depth"
                                    : "Phong",
                        lines, count, script);
        }
    }
    if (drawn > 0) {
        fprintf(script, "unset multiplot\n");
        status = bench_gnuplot(script, folder, p->name);
    }
    if (script != NULL) {
        fclose(script);
    }
    free(lines);
    return status;
}

vd_status bench_plot_raster(const bench_run *run, const char *folder) {
    vd_status status = vd_success();
    int threads = 1;
    for (int i = 0; i < run->thread_count; i++) {
        threads = run->threads[i] > threads ? run->threads[i] : threads;
    }
    const vd_isa isa = run->isas[0] == VD_ISA_AUTO ? vd_isa_best() : run->isas[0];
    for (size_t i = 0; i < sizeof plots / sizeof plots[0] && status.code == VD_OK; i++) {
        status = draw(run, &plots[i], threads, isa, folder);
    }
    return status;
}

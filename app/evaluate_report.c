/* evaluate_report.c: what `veduta evaluate` found: for programs, for people, as a plot. */
#include <errno.h>
#include <string.h>

#include "evaluate.h"
#include "gnuplot.h"

static const char *const keys[VD_EVALUATED_COUNT] = {"impostors", "screen", "no_reuse", "direct"};
static const char *const names[VD_EVALUATED_COUNT] = {"impostors", "whole screens", "no reuse",
                                                      "direct"};

static bool runs(const vd_evaluation *e, int kind) {
    return kind >= (int)e->settings->first && kind <= (int)e->settings->last;
}

/* Without reuse a frame counts when all its pictures are new. */
static double fps_of(const vd_evaluation *e, int kind) {
    const vd_evaluated_figures *f = &e->of[kind];
    return (kind == VD_EVALUATED_NO_REUSE ? f->whole : (double)f->frames) / e->seconds;
}

static double megabytes_a_frame(const vd_evaluation *e, int kind) {
    const vd_evaluated_figures *f = &e->of[kind];
    const double frames = kind == VD_EVALUATED_NO_REUSE ? f->whole : (double)f->frames;
    return frames > 0.0 ? 1e-6 * (double)f->bytes / frames : 0.0;
}

static bool add(json_t *root, const char *key, json_t *value) {
    return json_object_set_new(root, key, value) == 0;
}

/* How long frames took is this machine's: not said of a virtual clock. */
static bool add_times(const vd_evaluation *e, json_t *root, int kind) {
    const vd_evaluated_figures *f = &e->of[kind];
    if (e->settings->is_virtual || kind == VD_EVALUATED_DIRECT) {
        return true;
    }
    const double frames = f->made > 0 ? (double)f->made : 1.0;
    return add(root, "frame_ms", json_real(1e3 * f->busy_s / frames)) &&
           add(root, "slowest_ms", json_real(1e3 * f->slowest_s)) &&
           (kind == VD_EVALUATED_SCREEN || add(root, "show_ms", json_real(1e3 * f->show_s)));
}

/* What only impostors have. */
static bool add_impostors(const vd_evaluation *e, json_t *root, int kind) {
    const vd_evaluated_figures *f = &e->of[kind];
    return kind == VD_EVALUATED_SCREEN || kind == VD_EVALUATED_DIRECT ||
           (add(root, "reuse", json_real(f->reuse)) &&
            add(root, "overdraw", json_real(f->overdraw)) &&
            add(root, "uploads_per_s", json_real((double)f->uploads / e->seconds)) &&
            add(root, "pixels_per_s", json_real((double)f->pixels / e->seconds)) &&
            add(root, "direct_objects", json_real(f->direct)) &&
            add(root, "impostors", json_real(f->shown)) &&
            add(root, "reused", json_real(f->reused)) &&
            add(root, "live", json_real(f->pictures)) &&
            add(root, "screen_error_px", json_real(f->error_px)) &&
            add(root, "failed", json_integer((json_int_t)f->failed)) &&
            add(root, "dropped", json_integer((json_int_t)f->dropped)));
}

/* Null of a program that did not run. */
static json_t *part_json(const vd_evaluation *e, int kind) {
    if (!runs(e, kind)) {
        return json_null();
    }
    const vd_evaluated_figures *f = &e->of[kind];
    json_t *root =
        json_pack("{s: f, s: f, s: f, s: f, s: f, s: f}", "fps", fps_of(e, kind), "error", f->error,
                  "worst_error", f->worst_error, "worst_time", f->worst_s, "bytes_per_s",
                  (double)f->bytes / e->seconds, "megabytes_per_frame", megabytes_a_frame(e, kind));
    if (root != NULL && !(add_impostors(e, root, kind) && add_times(e, root, kind))) {
        json_decref(root);
        return NULL;
    }
    return root;
}

static json_t *settings_json(const vd_evaluation *e) {
    const vd_evaluate_settings *s = e->settings;
    json_t *root = json_pack(
        "{s: i, s: i, s: i, s: i, s: f, s: f, s: f, s: f, s: f, s: f, s: f, s: f, s: b, s: f, s: "
        "I}",
        "width", s->render.width, "height", s->render.height, "samples", s->render.samples,
        "reference_samples", s->reference_samples, "most_px", s->impostors.most_px, "least_reuse",
        s->impostors.least_reuse, "fade", s->impostors.fade_s, "tolerance",
        s->impostors.tolerance_px, "bandwidth", s->impostors.link_bytes_per_s, "latency",
        s->impostors.link_latency_s, "rate", s->rate_hz, "compare", s->compare_hz, "virtual",
        (int)s->is_virtual, "seconds", e->seconds, "memory", (json_int_t)s->impostors.memory_bytes);
    const bool good =
        root != NULL && add(root, "codec", json_string(vd_evaluate_codec_name(s->codec))) &&
        (s->is_virtual
             ? add(root, "budget_pixels", json_integer((json_int_t)s->impostors.budget_pixels))
             : add(root, "budget", json_real(s->impostors.budget_s)) &&
                   add(root, "threads", json_integer(vd_context_threads(e->context))));
    if (!good) {
        json_decref(root);
        return NULL;
    }
    return root;
}

static json_t *series_json(const vd_evaluation *e) {
    json_t *root = json_object(), *times = json_array();
    for (int i = 0; i < e->compared; i++) {
        json_array_append_new(times, json_real(vd_evaluation_time(e, i)));
    }
    bool good = root != NULL && add(root, "time", times);
    for (int kind = (int)e->settings->first; kind <= (int)e->settings->last && good; kind++) {
        json_t *errors = json_array();
        for (int i = 0; i < e->compared; i++) {
            json_array_append_new(errors, json_real(e->of[kind].errors[i]));
        }
        good = add(root, keys[kind], errors);
    }
    if (!good) {
        json_decref(root);
        return NULL;
    }
    return root;
}

json_t *vd_evaluation_json(const vd_evaluation *e, bool series) {
    json_t *root = runs(e, VD_EVALUATED_IMPOSTORS)
                       ? part_json(e, VD_EVALUATED_IMPOSTORS)
                       : json_pack("{s: n, s: n, s: n, s: n, s: n, s: n}", "fps", "error", "reuse",
                                   "overdraw", "uploads_per_s", "direct_objects");
    bool good = root != NULL && add(root, "veduta", json_string(vd_version())) &&
                add(root, "screen", part_json(e, VD_EVALUATED_SCREEN)) &&
                add(root, "no_reuse", part_json(e, VD_EVALUATED_NO_REUSE)) &&
                add(root, "direct", part_json(e, VD_EVALUATED_DIRECT)) &&
                add(root, "settings", settings_json(e));
    good = good && (!series || add(root, "errors", series_json(e)));
    if (!good) {
        json_decref(root);
        return NULL;
    }
    return root;
}

/* What only impostors have; of those, unless they did not run. */
static bool print_impostors(const vd_evaluation *e) {
    const int kind =
        runs(e, VD_EVALUATED_IMPOSTORS) ? VD_EVALUATED_IMPOSTORS : (int)e->settings->first;
    const vd_evaluated_figures *f = &e->of[kind];
    bool good = true;
    if (kind != VD_EVALUATED_SCREEN && kind != VD_EVALUATED_DIRECT) {
        good =
            printf("\nreuse          %10.2f\noverdraw       %10.2f\nimpostors      %10.1f a frame\n"
                   "of these new   %10.1f a frame\nlive           %10.1f\n"
                   "drawn direct   %10.1f a frame\nuploads        %10.1f a second\n"
                   "dropped        %10llu\n",
                   f->reuse, f->overdraw, f->shown, f->shown - f->reused, f->pictures, f->direct,
                   (double)f->uploads / e->seconds, (unsigned long long)f->dropped) > 0;
    }
    if (!e->settings->is_virtual && f->made > 0) {
        good = good &&
               printf("a frame takes  %10.2f ms, %.2f at most; its quads %.2f\n",
                      1e3 * f->busy_s / (double)f->made, 1e3 * f->slowest_s, 1e3 * f->show_s) > 0;
    }
    return good;
}

bool vd_evaluation_print(const vd_evaluation *e) {
    const vd_evaluate_settings *s = e->settings;
    bool good = printf("%.4g s at %dx%d, tolerance %g px, ", e->seconds, s->render.width,
                       s->render.height, s->impostors.tolerance_px) > 0;
    good =
        good &&
        (s->impostors.link_bytes_per_s > 0.0
             ? printf("a link of %.4g MB/s and %.4g ms%s\n\n", 1e-6 * s->impostors.link_bytes_per_s,
                      1e3 * s->impostors.link_latency_s, s->is_virtual ? ", virtual clock" : "")
             : printf("no link%s\n\n", s->is_virtual ? ", virtual clock" : "")) > 0;
    good = good && printf("%-14s %10s %10s %10s %10s %10s\n", "", "frames/s", "error", "worst",
                          "MB/s", "MB/frame") > 0;
    for (int kind = (int)e->settings->first; kind <= (int)e->settings->last && good; kind++) {
        const vd_evaluated_figures *k = &e->of[kind];
        good = printf("%-14s %10.2f %10.4f %10.4f %10.3f %10.3f\n", names[kind], fps_of(e, kind),
                      k->error, k->worst_error, 1e-6 * (double)k->bytes / e->seconds,
                      megabytes_a_frame(e, kind)) > 0;
    }
    return good && print_impostors(e) && fflush(stdout) == 0;
}

vd_status vd_evaluation_plot(const vd_evaluation *e, const char *path) {
    static const char *const colors[VD_EVALUATED_COUNT] = {"#0060a8", "#c46a00", "#7a3b94",
                                                           "#555555"};
    FILE *script = tmpfile();
    if (script == NULL) {
        return vd_failure(VD_ERROR_IO, "cannot make a temporary file for gnuplot: %s",
                          strerror(errno));
    }
    fputs("set terminal svg size 760,440 font 'sans-serif,13' background '#ffffff'\n"
          "set xlabel \"time, s\" noenhanced\nset ylabel \"error e(t)\" noenhanced\n"
          "set key outside right top reverse Left samplen 2\n"
          "set grid xtics ytics lc rgb '#dddddd' lw 1 dt 1\nset border lc rgb '#888888'\n"
          "set tics textcolor rgb '#222222'\nset format y '%g'\n",
          script);
    fprintf(script, "set xrange [0:%.9g]\nset yrange [0:*]\n", e->seconds);
    for (int kind = (int)e->settings->first; kind <= (int)e->settings->last; kind++) {
        fprintf(script, "$data%d << EOD\n", kind);
        for (int i = 0; i < e->compared; i++) {
            fprintf(script, "%.9g %.9g\n", vd_evaluation_time(e, i), e->of[kind].errors[i]);
        }
        fprintf(script, "EOD\n");
    }
    fputs("plot ", script);
    for (int kind = (int)e->settings->first; kind <= (int)e->settings->last; kind++) {
        fprintf(script, "%s$data%d with lines lw 1.6 lc rgb '%s' title '%s, mean %.3f'",
                kind > (int)e->settings->first ? ", " : "", kind, colors[kind], names[kind],
                e->of[kind].error);
    }
    fputs("\n", script);
    const vd_status status = vd_gnuplot_draw(script, path);
    fclose(script);
    return status;
}

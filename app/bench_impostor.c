/* bench_impostor.c: impostors: deciding alone, what extremes cost, and frames along a flight.
 *
 * Frames stand at 1/60 s from each other, however long they take. A case's times are those of
 * updating and showing, wall milliseconds; bandwidths are of the work alone.
 */
#include "bench_forest.h"
#include "random.h"
#include "render_settings.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

enum { MOST_FRAMES = 1000 };

#define RATE_HZ 60.0

/* ---- deciding ---------------------------------------------------------------------------------*/

enum { SIDE = 316, FEW = 32 }; /* 99,856 objects */

typedef struct field {
    vd_context *context;
    vd_world *world;
    vd_world_renderer *renderer;
    vd_impostors *impostors;
    int width, height, side;
    int frame;
} field;

static void finish_field(field *f) {
    vd_impostors_destroy(&f->impostors);
    vd_world_renderer_destroy(&f->renderer);
    vd_world_destroy(&f->world);
    vd_context_destroy(&f->context);
}

/* Posts of 3 m, 10 m apart on the whole, over the plane z = 0. */
static vd_status plant(field *f, uint32_t picture) {
    uint64_t random = 1;
    vd_status status = vd_success();
    for (int i = 0; i < f->side * f->side && status.code == VD_OK; i++) {
        const double x = 10.0 * (i % f->side - 0.5 * f->side + vd_uniform(&random));
        const double y = 10.0 * (i / f->side - 0.5 * f->side + vd_uniform(&random));
        const vd_sprite_def def = {
            .picture = picture, .foot = {x, y, 0}, .width_m = 1.5, .height_m = 3.0};
        vd_object *object = NULL;
        status = vd_sprite_create(f->context, &def, &object);
        if (status.code == VD_OK) {
            status = vd_world_add(f->world, &object);
        }
        vd_object_destroy(f->context, &object);
    }
    return status;
}

static vd_status make_field(field *f, vd_isa isa, int threads) {
    static uint8_t texels[4 * 4 * 4];
    memset(texels, 255, sizeof texels);
    const vd_picture picture = {
        .width = 4, .height = 4, .channels = 4, .bits = 8, .stride_bytes = 16, .data = texels};
    vd_context_def def = vd_context_def_default();
    def.isa = isa;
    def.threads = threads;
    const vd_world_def world = vd_world_def_default();
    uint32_t number = 0;
    vd_status status = vd_context_create(&def, &f->context);
    if (status.code == VD_OK) {
        status = vd_world_create(f->context, &world, &f->world);
    }
    if (status.code == VD_OK) {
        status = vd_world_add_picture(f->world, &picture, &number);
    }
    if (status.code == VD_OK) {
        status = plant(f, number);
    }
    if (status.code == VD_OK) {
        status = vd_world_arrange(f->world, NULL);
    }
    return status.code == VD_OK
               ? vd_world_renderer_create(f->context, NULL, f->world, NULL, &f->renderer)
               : status;
}

/* The next update; the camera goes round over the field, of which it sees everything. */
static vd_status update_field(field *f, vd_impostor_stats *stats) {
    const double time_s = f->frame++ / RATE_HZ, turn = 0.01 * time_s, wide = 10.0 * f->side;
    vd_camera camera = {.projection = VD_PROJECTION_PERSPECTIVE, .near_m = 1.0};
    camera.eye = vd_vec3_make(wide * sin(turn), -wide * cos(turn), 0.6 * wide);
    camera.orientation = vd_orientation_look_at(camera.eye, vd_vec3_make(0, 0, 0));
    camera.lens = vd_lens_from_fov(40.0 * VD_RADIANS_PER_DEGREE, f->width, f->height);
    return vd_impostors_update(f->impostors, NULL, &camera, f->width, f->height, time_s, stats);
}

/* One picture a frame: `pictures`, after all of them have been made; else most are missing. What
 * is larger than 8 pixels is split, so that each object is decided by itself. */
static vd_status begin_field(field *f, bool pictures) {
    vd_impostor_def def = vd_impostor_def_default();
    vd_impostor_stats stats = {.waiting = 1};
    def.most_px = 8.0;
    def.budget_s = pictures ? 5.0 : 1e-9;
    def.settle = false;
    def.most_direct = 0;
    f->frame = 0;
    vd_status status = vd_impostors_create(f->context, f->world, f->renderer, &def, &f->impostors);
    for (int i = 0; (i < 3 || (pictures && stats.waiting > 0)) && status.code == VD_OK; i++) {
        status = update_field(f, &stats);
    }
    return status;
}

static vd_status measure_field(bench_run *run, const bench_case *self, field *f, bool pictures) {
    static double times_ms[MOST_FRAMES];
    bench_result result = bench_result_of(self, pictures ? "pictures" : "no pictures");
    result.threads = vd_context_threads(f->context);
    result.isa = vd_context_isa(f->context);
    result.width = f->width;
    result.height = f->height;
    result.target_fps = bench_target_fps(self, result.isa, result.threads);
    const int frames = run->repeat > 0 ? run->repeat : run->quick ? 3 : 100;
    vd_impostor_stats stats = {.shown = 0};
    bench_say(run, &result);
    vd_status status = begin_field(f, pictures);
    for (int i = 0; i < frames && status.code == VD_OK; i++) {
        status = update_field(f, &stats);
        times_ms[i] = 1e3 * stats.decide_s;
    }
    vd_impostors_destroy(&f->impostors);
    if (status.code != VD_OK) {
        return status;
    }
    bench_summarize(times_ms, frames, &result);
    const double objects = (double)(stats.shown + stats.direct);
    snprintf(result.note, sizeof result.note, "%.0f objects, %.0f nodes; %.3f us an object",
             objects, (double)stats.decided, 1e3 * result.median_ms / fmax(objects, 1.0));
    return bench_add(run, &result);
}

vd_status bench_impostor_decide(bench_run *run, const bench_case *self) {
    vd_status status = vd_success();
    for (int i = 0; i < run->isa_count; i++) {
        for (int t = 0; t < run->thread_count && status.code == VD_OK; t++) {
            field f = {.width = self->width, .height = self->rows};
            f.side = run->quick ? FEW : SIDE;
            status = make_field(&f, run->isas[i], run->threads[t]);
            for (int way = 0; way < 2 && status.code == VD_OK; way++) {
                status = measure_field(run, self, &f, way == 1);
            }
            finish_field(&f);
        }
    }
    return status;
}

/* ---- along the flight -------------------------------------------------------------------------*/

enum { WARM_FRAMES = 60 };

/* What a run of frames did, from the end of the warm-up on. */
typedef struct flight {
    vd_impostor_stats first, last;
    double draw_s, show_s, overdraw;      /* sums */
    double decide_ms, direct_ms, show_ms; /* medians */
    int frames;
} flight;

static double median_of(double *values, int count) {
    bench_result sorted;
    bench_summarize(values, count, &sorted);
    return sorted.median_ms;
}

/* Frames of the flight through impostors. Fills the times of *result: of updating and showing, with
 * the drawing of pictures or, as another machine does that, without. */
static vd_status fly(bench_run *run, bench_forest *w, const vd_impostor_def *def, vd_frame *frame,
                     bool with_drawing, bench_result *result, flight *out) {
    static double times_ms[MOST_FRAMES], decide_ms[MOST_FRAMES], direct_ms[MOST_FRAMES],
        show_ms[MOST_FRAMES];
    const int warm = run->quick ? 2 : WARM_FRAMES;
    const int frames = run->repeat > 0 ? run->repeat : run->quick ? 3 : BENCH_FLIGHT;
    *out = (flight){.frames = frames};
    vd_impostors *impostors = NULL;
    bench_say(run, result);
    vd_status status = vd_impostors_create(w->s.context, w->world, w->renderer, def, &impostors);
    for (int i = -warm; i < frames && status.code == VD_OK; i++) {
        const vd_camera camera = bench_forest_camera(w, i + warm);
        const double start_ms = bench_wall_ms();
        status = vd_impostors_update(impostors, NULL, &camera, frame->width, frame->height,
                                     (i + warm) / RATE_HZ, NULL);
        if (status.code == VD_OK) {
            status = vd_impostors_draw(impostors, NULL, &camera, frame, &out->last);
        }
        if (i < 0) {
            out->first = out->last;
            continue;
        }
        const vd_impostor_stats *now = &out->last;
        times_ms[i] = bench_wall_ms() - start_ms - (with_drawing ? 0.0 : 1e3 * now->draw_s);
        decide_ms[i] = 1e3 * now->decide_s;
        direct_ms[i] = 1e3 * now->direct_s;
        show_ms[i] = 1e3 * now->show_s;
        out->draw_s += now->draw_s;
        out->show_s += now->show_s;
        out->overdraw += now->overdraw / frames;
    }
    vd_impostors_destroy(&impostors);
    if (status.code == VD_OK) {
        bench_summarize(times_ms, frames, result);
        out->decide_ms = median_of(decide_ms, frames);
        out->direct_ms = median_of(direct_ms, frames);
        out->show_ms = median_of(show_ms, frames);
    }
    return status;
}

static bench_result result_of(const bench_case *self, const char *method, const bench_forest *w,
                              const vd_frame *frame) {
    bench_result result = bench_result_of(self, method);
    result.threads = vd_context_threads(w->s.context);
    result.isa = vd_context_isa(w->s.context);
    result.width = frame->width;
    result.height = frame->height;
    return result;
}

/* ---- extremes ---------------------------------------------------------------------------------*/

#define LINK_BYTES_PER_S 10e6
#define PIXELS_PER_BYTE 0.25 /* C_N: pictures go over the link as they are */

/* Lawlor 2004, §2.3: pixels a second that can be shown, B = min(B_R R, B_N C_N R, B_C) / D. Says
 * the least term, and what the frames needed. */
static void note_bandwidth(const flight *f, bench_result *result) {
    const double drawn = (double)(f->last.pixels_drawn - f->first.pixels_drawn);
    const double shown = (double)(f->last.pixels_shown - f->first.pixels_shown);
    const double pictures = (double)(f->last.uploads - f->first.uploads);
    const double reuse = drawn > 0.0 ? shown / drawn : (double)INFINITY;
    const double seconds = f->frames / RATE_HZ;
    const double terms[3] = {shown / fmax(f->draw_s, 1e-9), /* B_R R: drawn / draw_s · R */
                             LINK_BYTES_PER_S * PIXELS_PER_BYTE * reuse,
                             shown / fmax(f->show_s, 1e-9)};
    static const char *const names[3] = {"B_R R", "B_N C_N R", "B_C"};
    int least = 0;
    for (int i = 1; i < 3; i++) {
        least = terms[i] < terms[least] ? i : least;
    }
    snprintf(result->note, sizeof result->note,
             "R %.1f, D %.2f, %.0f up/s, %.2f Mpx/s; B %.3g Mpx/s by %s", reuse, f->overdraw,
             pictures / seconds, 1e-6 * drawn / seconds,
             1e-6 * terms[least] / fmax(f->overdraw, 1e-9), names[least]);
}

/* Slices of the view from before to behind, each as large as the screen and an eighth covered, that
 * never have to be made anew: what showing them takes (parallel planes). */
static vd_status measure_planes(bench_run *run, bench_forest *w, vd_frame *frame,
                                bench_result *result) {
    enum { PLANES = 32, BLOCK = 16 };
    static double times_ms[MOST_FRAMES];
    const int width = frame->width, height = frame->height;
    const int frames = run->repeat > 0 ? run->repeat : run->quick ? 3 : BENCH_FLIGHT;
    uint8_t *texels = calloc((size_t)width * (size_t)height, 4);
    vd_display *display = NULL;
    vd_status status = texels != NULL ? vd_display_create(w->s.context, &display)
                                      : vd_failure(VD_ERROR_MEMORY, "out of memory for planes");
    for (int i = 0; i < width * height && status.code == VD_OK; i++) {
        const unsigned block = (unsigned)(i % width / BLOCK + i / width / BLOCK * 5) * 2654435761u;
        memset(texels + 4 * (size_t)i, block >> 29 == 0 ? 255 : 0, 4);
    }
    bench_say(run, result);
    for (int i = 0; i < frames && status.code == VD_OK; i++) {
        vd_quad quads[PLANES];
        for (int k = 0; k < PLANES; k++) {
            const float depth = (float)(PLANES - k) * 50.0f, off = (float)(i % 16) / depth;
            const float x[4] = {0.0f, (float)width, (float)width, 0.0f};
            const float y[4] = {0.0f, 0.0f, (float)height, (float)height};
            quads[k] =
                (vd_quad){.picture = {texels, width, height, (size_t)width, {0}}, .opacity = 255};
            for (int c = 0; c < 4; c++) {
                quads[k].corners[c] =
                    (vd_quad_corner){(x[c] + off) * depth, (y[c] + off) * depth, depth};
            }
        }
        const double start_ms = bench_wall_ms();
        status = vd_display_draw(display, NULL, frame, quads, PLANES, NULL);
        times_ms[i] = bench_wall_ms() - start_ms;
    }
    if (status.code == VD_OK) {
        bench_summarize(times_ms, frames, result);
        const double shown = 1e-3 * PLANES * width * height / result->median_ms;
        snprintf(result->note, sizeof result->note, "D %d; B %.3g Mpx/s by B_C", PLANES,
                 shown / PLANES);
        status = bench_add(run, result);
    }
    vd_display_destroy(&display);
    free(texels);
    return status;
}

static vd_status measure_extremes(bench_run *run, const bench_case *self, bench_forest *w,
                                  vd_frame *frame) {
    static const struct {
        const char *method;
        double most_px, least_reuse;
    } ways[] = {{"large", 1e6, 0.0}, {"tiny", 8.0, 4.0}, {"usual", 192.0, 4.0}};
    vd_status status = vd_success();
    for (size_t i = 0; i < sizeof ways / sizeof ways[0] && status.code == VD_OK; i++) {
        vd_impostor_def def = vd_impostor_def_default();
        def.most_px = ways[i].most_px;
        def.least_reuse = ways[i].least_reuse;
        def.budget_s = 1.0; /* all that are wanted */
        bench_result result = result_of(self, ways[i].method, w, frame);
        flight f;
        status = fly(run, w, &def, frame, true, &result, &f);
        if (status.code == VD_OK) {
            note_bandwidth(&f, &result);
            status = bench_add(run, &result);
        }
    }
    bench_result result = result_of(self, "planes", w, frame);
    return status.code == VD_OK ? measure_planes(run, w, frame, &result) : status;
}

/* ---- the flight -------------------------------------------------------------------------------
 */

static vd_status measure_path(bench_run *run, const bench_case *self, bench_forest *w,
                              vd_frame *frame) {
    vd_impostor_def def = vd_impostor_def_default();
    def.remote = true;
    def.link_bytes_per_s = LINK_BYTES_PER_S;
    bench_result result = result_of(self, "update and show", w, frame);
    result.target_fps = bench_target_fps(self, result.isa, result.threads);
    flight f;
    const vd_status status = fly(run, w, &def, frame, false, &result, &f);
    snprintf(result.note, sizeof result.note,
             "%u shown, %u direct; ms: %.2f decide, %.1f direct, %.1f show", (unsigned)f.last.shown,
             (unsigned)f.last.direct, f.decide_ms, f.direct_ms, f.show_ms);
    return status.code == VD_OK ? bench_add(run, &result) : status;
}

/* ---- as in a window ---------------------------------------------------------------------------*/

/* Frames as a window shows them, at most 60 a second by the clock, from the first on, when nothing
 * has a picture yet. */
static vd_status show_in_time(bench_run *run, bench_forest *w, vd_frame *frame, bool background,
                              bench_result *result) {
    static double times_ms[MOST_FRAMES];
    const int frames = run->repeat > 0 ? run->repeat : run->quick ? 3 : BENCH_FLIGHT;
    const double interval_ms = 1e3 / RATE_HZ;
    vd_impostor_def def = vd_impostor_def_default();
    def.background = background;
    vd_impostors *impostors = NULL;
    vd_impostor_stats stats = {.shown = 0};
    double wrong_px = 0.0;
    int late = 0;
    bench_say(run, result);
    vd_status status = vd_impostors_create(w->s.context, w->world, w->renderer, &def, &impostors);
    const double begin_ms = bench_wall_ms();
    for (int i = 0; i < frames && status.code == VD_OK; i++) {
        const double start_ms = bench_wall_ms() - begin_ms;
        const vd_camera camera = bench_forest_camera(w, (int)(start_ms / interval_ms));
        status = vd_impostors_update(impostors, NULL, &camera, frame->width, frame->height,
                                     1e-3 * start_ms, NULL);
        if (status.code == VD_OK) {
            status = vd_impostors_draw(impostors, NULL, &camera, frame, &stats);
        }
        const double end_ms = bench_wall_ms() - begin_ms;
        times_ms[i] = end_ms - start_ms;
        late += times_ms[i] > interval_ms;
        wrong_px += stats.error_px / frames;
        const double next_ms = interval_ms * ceil(end_ms / interval_ms);
        const struct timespec rest = {0, (long)(1e6 * (next_ms - end_ms))};
        (void)nanosleep(&rest, NULL);
    }
    const double seconds = 1e-3 * (bench_wall_ms() - begin_ms);
    vd_impostors_destroy(&impostors);
    if (status.code == VD_OK) {
        bench_summarize(times_ms, frames, result);
        snprintf(result->note, sizeof result->note,
                 "%.1f frames/s, %d of %d longer than 1/60 s; %.1f up/s, error %.2f px",
                 frames / seconds, late, frames, (double)stats.uploads / seconds, wrong_px);
    }
    return status;
}

static vd_status measure_window(bench_run *run, const bench_case *self, bench_forest *w,
                                vd_frame *frame) {
    vd_status status = vd_success();
    for (int i = 0; i < 2 && status.code == VD_OK; i++) {
        bench_result result = result_of(self, i == 0 ? "in the frame" : "background", w, frame);
        result.target_fps = bench_target_fps(self, result.isa, result.threads);
        status = show_in_time(run, w, frame, i == 1, &result);
        status = status.code == VD_OK ? bench_add(run, &result) : status;
    }
    return status;
}

typedef vd_status measure_flight(bench_run *run, const bench_case *self, bench_forest *w,
                                 vd_frame *frame);

static vd_status for_each_level(bench_run *run, const bench_case *self, measure_flight *measure) {
    vd_status status = vd_success();
    for (int i = 0; i < run->isa_count; i++) {
        for (int t = 0; t < run->thread_count && status.code == VD_OK; t++) {
            bench_forest w;
            vd_frame *frame = NULL;
            status = bench_forest_init(&w, run, self->camera, NULL, run->isas[i], run->threads[t],
                                       self->width, self->rows);
            if (status.code == VD_OK) {
                status = bench_forest_renderer(&w, 1);
            }
            if (status.code == VD_OK) {
                status =
                    vd_frame_create(w.s.context, self->width, self->rows, VD_PLANE_DEPTH, &frame);
            }
            if (status.code == VD_OK) {
                status = measure(run, self, &w, frame);
            }
            vd_frame_destroy(&frame);
            bench_forest_finish(&w);
        }
    }
    return status;
}

vd_status bench_impostor_extremes(bench_run *run, const bench_case *self) {
    return for_each_level(run, self, measure_extremes);
}

vd_status bench_impostor_path(bench_run *run, const bench_case *self) {
    return for_each_level(run, self, measure_path);
}

vd_status bench_impostor_window(bench_run *run, const bench_case *self) {
    return for_each_level(run, self, measure_window);
}

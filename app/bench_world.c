/* bench_world.c: a world in motion: Mont Blanc with a forest on it, and a camera that flies. */
#include "bench_forest.h"

typedef struct world_scene {
    bench_forest f;
    vd_impostors *impostors; /* null: everything is drawn itself */
    vd_frame *deep;          /* a frame with depth, which they want */
    vd_world_stats stats;    /* of the last picture */
    vd_impostor_stats shown; /* likewise */
    int frame;
} world_scene;

/* The next picture of the flight. */
static vd_status draw_next(void *user) {
    world_scene *w = user;
    const vd_camera camera = bench_forest_camera(&w->f, w->frame++);
    if (w->impostors != NULL) {
        const vd_status status = vd_impostors_update(w->impostors, NULL, &camera, w->deep->width,
                                                     w->deep->height, w->frame / 60.0, NULL);
        return status.code == VD_OK
                   ? vd_impostors_draw(w->impostors, NULL, &camera, w->deep, &w->shown)
                   : status;
    }
    return vd_world_renderer_draw(w->f.renderer, NULL, &camera, w->f.s.frame, &w->stats);
}

/* Impostors, once round the flight, so that those that can be there are. */
static vd_status begin_impostors(world_scene *w) {
    vd_status status =
        vd_impostors_create(w->f.s.context, w->f.world, w->f.renderer, NULL, &w->impostors);
    if (status.code == VD_OK) {
        status = vd_frame_create(w->f.s.context, w->f.s.frame->width, w->f.s.frame->height,
                                 VD_PLANE_DEPTH, &w->deep);
    }
    for (int i = 0; i < 240 && status.code == VD_OK; i++) {
        status = draw_next(w);
    }
    return status;
}

static vd_status measure(bench_run *run, const bench_case *self, world_scene *w, const char *method,
                         int samples, bool impostors) {
    vd_status status = bench_forest_renderer(&w->f, samples);
    bench_result result = bench_result_of(self, method);
    result.threads = vd_context_threads(w->f.s.context);
    result.isa = vd_context_isa(w->f.s.context);
    result.width = w->f.s.frame->width;
    result.height = w->f.s.frame->height;
    if (samples == 1) {
        result.target_fps = bench_target_fps(self, result.isa, result.threads);
    }
    w->frame = 0;
    if (status.code == VD_OK && impostors) {
        status = begin_impostors(w);
    }
    if (status.code == VD_OK) {
        status = bench_measure(run, draw_next, w, bench_wall_ms, &result);
    }
    const vd_world_stats *t = &w->stats;
    snprintf(result.note, sizeof result.note, "%u of %u; ms: %.1f ground, %.1f prepare, %.1f rest",
             (unsigned)t->drawn, (unsigned)t->objects, 1e3 * t->ground_s, 1e3 * t->prepare_s,
             1e3 * (t->objects_s + t->finish_s));
    if (impostors) {
        const vd_impostor_stats *i = &w->shown;
        snprintf(result.note, sizeof result.note,
                 "%u shown, %u direct; ms: %.1f direct, %.1f shown, %.1f drawn", (unsigned)i->shown,
                 (unsigned)i->direct, 1e3 * i->direct_s, 1e3 * i->show_s, 1e3 * i->draw_s);
    }
    vd_impostors_destroy(&w->impostors);
    vd_frame_destroy(&w->deep);
    return status.code == VD_OK ? bench_add(run, &result) : status;
}

static vd_status measure_size(bench_run *run, const bench_case *self, vd_isa isa, int threads,
                              double scale, const char *method, int samples, bool impostors) {
    world_scene w = {.frame = 0};
    vd_status status =
        bench_forest_init(&w.f, run, self->camera, NULL, isa, threads,
                          (int)(self->width * scale + 0.5), (int)(self->rows * scale + 0.5));
    if (status.code == VD_OK) {
        status = measure(run, self, &w, method, samples, impostors);
    }
    bench_forest_finish(&w.f);
    return status;
}

vd_status bench_world(bench_run *run, const bench_case *self) {
    static const struct {
        const char *method;
        double scale;
        int samples;
        bool impostors;
    } ways[] = {{"moving, 3/4", 0.75, 1, false},
                {"moving", 1.0, 1, false},
                {"impostors, 3/4", 0.75, 1, true},
                {"impostors", 1.0, 1, true},
                {"still", 1.0, 4, false}};
    vd_status status = vd_success();
    for (int i = 0; i < run->isa_count; i++) {
        for (int t = 0; t < run->thread_count; t++) {
            for (size_t k = 0; k < sizeof ways / sizeof ways[0] && status.code == VD_OK; k++) {
                status = measure_size(run, self, run->isas[i], run->threads[t], ways[k].scale,
                                      ways[k].method, ways[k].samples, ways[k].impostors);
            }
        }
    }
    return status;
}

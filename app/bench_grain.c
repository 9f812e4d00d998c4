/* bench_grain.c: how many particles an impostor is best of (Lawlor 2004, table 5.5).
 *
 * A world of generated particles, of which a brick file is made in $TMPDIR (or /tmp), and a camera
 * that goes round it. Frames stand at 1/60 s from each other, however long they take.
 */
#include "bench_cloud.h"
#include "render_settings.h"

#include <math.h>
#include <unistd.h>

enum { PARTICLES = 2000000, FEW = 200000, FRAMES = 120, WARM_FRAMES = 60, COMPARE_EVERY = 20 };

#define RATE_HZ 60.0
#define SIDE_M 1000.0 /* of the cube that the particles fill */
#define TURN_S 240.0  /* once round */
#define RADIUS_M 2500.0
#define FOV_Y_DEG 28.0

typedef struct cloud {
    vd_context *context;
    vd_world *world;
    vd_world_renderer *renderer;
    vd_impostors *impostors;
    vd_frame *frame, *direct; /* as it is shown, and as it is drawn itself */
    size_t objects;
} cloud;

/* What a run of frames did. */
typedef struct tally {
    vd_impostor_stats first, last;
    double error, overdraw, shown, show_ms; /* means of a frame */
    int compared;
} tally;

static void finish(cloud *c) {
    vd_impostors_destroy(&c->impostors);
    vd_frame_destroy(&c->frame);
    vd_frame_destroy(&c->direct);
    vd_world_renderer_destroy(&c->renderer);
    vd_world_destroy(&c->world);
    vd_context_destroy(&c->context);
}

/* One picture for each object: were they spread evenly over the cube, an object would be as large
 * as the largest group that is one picture, and objects may be twice as large. */
static vd_impostor_def impostors_of(const bench_case *self, double share) {
    const double side_m = SIDE_M * cbrt(share < 1.0 ? share : 1.0);
    const double focal_px = 0.5 * self->rows / tan(0.5 * FOV_Y_DEG * VD_RADIANS_PER_DEGREE);
    vd_impostor_def def = vd_impostor_def_default();
    def.most_px = fmax(sqrt(3.0) * side_m * focal_px / RADIUS_M, 8.0);
    def.most_direct = 0;
    def.settle = false;
    return def;
}

static vd_status make_cloud(cloud *c, const bench_case *self, const char *path, uint64_t most,
                            size_t count, vd_isa isa, int threads) {
    const vd_impostor_def impostors = impostors_of(self, (double)most / (double)count);
    vd_context_def def = vd_context_def_default();
    def.isa = isa;
    def.threads = threads;
    const vd_world_def world = vd_world_def_default();
    vd_status status = vd_context_create(&def, &c->context);
    if (status.code == VD_OK) {
        status = vd_world_create(c->context, &world, &c->world);
    }
    if (status.code == VD_OK) {
        status = bench_cloud_add(c->context, c->world, path, false, most, &c->objects);
    }
    if (status.code == VD_OK) {
        status = vd_world_arrange(c->world, NULL);
    }
    if (status.code == VD_OK) {
        status = vd_world_renderer_create(c->context, NULL, c->world, NULL, &c->renderer);
    }
    if (status.code == VD_OK) {
        status = vd_impostors_create(c->context, c->world, c->renderer, &impostors, &c->impostors);
    }
    if (status.code == VD_OK) {
        status = vd_frame_create(c->context, self->width, self->rows, VD_PLANE_DEPTH, &c->frame);
    }
    return status.code == VD_OK
               ? vd_frame_create(c->context, self->width, self->rows, 0, &c->direct)
               : status;
}

static vd_camera orbit(const cloud *c, double time_s) {
    const double turn = 360.0 * VD_RADIANS_PER_DEGREE * time_s / TURN_S;
    vd_camera camera = {.projection = VD_PROJECTION_PERSPECTIVE, .near_m = 1.0};
    camera.eye = vd_vec3_make(RADIUS_M * sin(turn), -RADIUS_M * cos(turn), 0.3 * RADIUS_M);
    camera.orientation = vd_orientation_look_at(camera.eye, vd_vec3_make(0, 0, 0));
    camera.lens =
        vd_lens_from_fov(FOV_Y_DEG * VD_RADIANS_PER_DEGREE, c->frame->width, c->frame->height);
    return camera;
}

static vd_status show(cloud *c, const vd_camera *camera, double time_s, vd_impostor_stats *stats) {
    const vd_status status = vd_impostors_update(c->impostors, NULL, camera, c->frame->width,
                                                 c->frame->height, time_s, NULL);
    return status.code == VD_OK ? vd_impostors_draw(c->impostors, NULL, camera, c->frame, stats)
                                : status;
}

/* Makes all pictures of the first camera. */
static vd_status fill(cloud *c) {
    enum { MOST_UPDATES = 20000 };
    const vd_camera camera = orbit(c, 0.0);
    vd_impostor_stats stats = {.waiting = 1};
    vd_status status = vd_success();
    for (int i = 0; i < MOST_UPDATES && stats.waiting + stats.drawn > 0 && status.code == VD_OK;
         i++) {
        status = vd_impostors_update(c->impostors, NULL, &camera, c->frame->width, c->frame->height,
                                     0.0, &stats);
    }
    return status;
}

/* Frames of the orbit; every twentieth is compared, out of the time that counts. */
static vd_status run_orbit(cloud *c, int warm, int frames, double *times_ms, tally *t) {
    vd_status status = vd_success();
    for (int i = -warm; i < frames && status.code == VD_OK; i++) {
        const double time_s = (i + warm) / RATE_HZ;
        const vd_camera camera = orbit(c, time_s);
        const double start_ms = bench_wall_ms();
        status = show(c, &camera, time_s, &t->last);
        if (i < 0) {
            t->first = t->last;
            continue;
        }
        times_ms[i] = bench_wall_ms() - start_ms;
        t->shown += (double)t->last.shown / frames;
        t->overdraw += t->last.overdraw / frames;
        t->show_ms += 1e3 * t->last.show_s / frames;
        if (status.code == VD_OK && i % COMPARE_EVERY == 0) {
            status = vd_world_renderer_draw(c->renderer, NULL, &camera, c->direct, NULL);
            t->error += vd_frame_error(c->frame, c->direct);
            t->compared++;
        }
    }
    return status;
}

static vd_status measure_grain(bench_run *run, const bench_case *self, const char *path,
                               double most, size_t count, vd_isa isa, int threads) {
    enum { MOST_FRAMES = 1000 };
    static double times_ms[MOST_FRAMES];
    const int frames = run->repeat > 0 ? run->repeat : run->quick ? 3 : FRAMES;
    cloud c = {.objects = 0};
    tally t = {.compared = 0};
    bench_result result = bench_result_of(self, "impostors");
    vd_status status = make_cloud(&c, self, path, (uint64_t)most, count, isa, threads);
    if (status.code == VD_OK) {
        result.at = most;
        result.threads = vd_context_threads(c.context);
        result.isa = vd_context_isa(c.context);
        result.width = self->width;
        result.height = self->rows;
        result.target_fps = bench_target_fps(self, result.isa, result.threads);
        bench_say(run, &result);
        status = run->quick ? status : fill(&c);
    }
    if (status.code == VD_OK) {
        status = run_orbit(&c, run->quick ? 2 : WARM_FRAMES, frames, times_ms, &t);
        result.peak_bytes = vd_context_memory(c.context).bytes_peak;
    }
    const double objects = (double)c.objects;
    finish(&c);
    if (status.code != VD_OK) {
        return status;
    }
    bench_summarize(times_ms, frames, &result);
    const double seconds = frames / RATE_HZ;
    snprintf(result.note, sizeof result.note,
             "%.0f of %.0f, %.1f ms show, D %.1f, %.1f Mpx/s, %.0f up/s, e %.3f", t.shown, objects,
             t.show_ms, t.overdraw,
             1e-6 * (double)(t.last.pixels_drawn - t.first.pixels_drawn) / seconds,
             (double)(t.last.uploads - t.first.uploads) / seconds, t.error / fmax(t.compared, 1));
    return bench_add(run, &result);
}

vd_status bench_impostor_grain(bench_run *run, const bench_case *self) {
    const size_t count = run->particles > 0 ? run->particles : run->quick ? FEW : PARTICLES;
    const int points = bench_sweep_points(run, self->sweep);
    const vd_particles_place place = {.size = SIDE_M};
    char path[512];
    bench_cloud_path(path, sizeof path);
    vd_status status = bench_add_published(run, self);
    if (status.code == VD_OK) {
        status = bench_cloud_write(path, count, &place);
    }
    for (int i = 0; i < run->isa_count && status.code == VD_OK; i++) {
        for (int t = 0; t < run->thread_count && status.code == VD_OK; t++) {
            for (int p = 0; p < points && status.code == VD_OK; p++) {
                status = measure_grain(run, self, path, self->sweep->values[p], count, run->isas[i],
                                       run->threads[t]);
            }
        }
    }
    unlink(path);
    return status;
}

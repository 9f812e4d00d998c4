/* bench_bricks.c: particles from disk: importing them, and pictures from the octree.
 *
 * The particles are those of `veduta generate` with one attribute, written as raw floats into
 * $TMPDIR (or /tmp), imported there and drawn from there: 50 M of them, 1 M with --quick. A
 * picture's error is against drawing all particles, root mean square of 8-bit steps.
 */
#include "bench.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define DETAIL_PX 2.0 /* as a window would have it */

typedef struct bricks_scene {
    char raw[512], bricks_path[520];
    size_t count;
    vd_context *context;
    vd_bricks_report report;
    vd_bricks *bricks;
    vd_brick_view *view;
    vd_splatter *splatter;
    vd_frame *frame;
    vd_camera camera;
    vd_brick_view_def view_def;
    vd_splat_def splat_def;
    vd_brick_view_stats stats;
} bricks_scene;

static vd_status make_context(vd_isa isa, int threads, vd_context **out) {
    vd_context_def def = vd_context_def_default();
    def.threads = threads;
    def.isa = isa;
    return vd_context_create(&def, out);
}

/* Writes x, y, z, speed as floats. */
static vd_status write_raw(bricks_scene *s) {
    enum { ROWS = 65536 };
    static float rows[ROWS][4];
    vd_context *context = NULL;
    vd_particles *p = NULL;
    vd_status status = make_context(VD_ISA_AUTO, 0, &context);
    if (status.code == VD_OK) {
        status = vd_particles_generate(context, NULL, 1, s->count, &p);
    }
    FILE *file = status.code == VD_OK ? fopen(s->raw, "wb") : NULL;
    bool written = file != NULL;
    for (size_t from = 0; written && from < s->count; from += ROWS) {
        const size_t n = s->count - from < ROWS ? s->count - from : ROWS;
        for (size_t i = 0; i < n; i++) {
            rows[i][0] = p->x[from + i];
            rows[i][1] = p->y[from + i];
            rows[i][2] = p->z[from + i];
            rows[i][3] = p->speed[from + i];
        }
        written = fwrite(rows, sizeof rows[0], n, file) == n;
    }
    if (file != NULL) {
        written = fclose(file) == 0 && written;
    }
    vd_particles_destroy(&p);
    vd_context_destroy(&context);
    return status.code != VD_OK || written
               ? status
               : vd_failure(VD_ERROR_IO,
                            "cannot write %.200s; name a folder with 2 GB to spare by "
                            "the variable TMPDIR",
                            s->raw);
}

static vd_status import_raw(void *user) {
    bricks_scene *s = user;
    vd_particle_source_def def = vd_particle_source_def_default();
    def.raw = "f32";
    def.columns = "x,y,z,speed";
    vd_particle_source *source = NULL;
    vd_status status = vd_particle_source_open(s->context, s->raw, &def, &source);
    if (status.code == VD_OK) {
        status = vd_bricks_import(s->context, NULL, &source, 1, NULL, s->bricks_path, &s->report);
    }
    vd_particle_source_destroy(&source);
    return status;
}

static vd_status measure_import(bench_run *run, const bench_case *self, bricks_scene *s,
                                int threads) {
    bench_result result = bench_result_of(self, "import");
    vd_status status = make_context(VD_ISA_AUTO, threads, &s->context);
    if (status.code == VD_OK) {
        result.threads = vd_context_threads(s->context);
        status = import_raw(s); /* warms the disk's cache */
        const double wall = bench_wall_ms(), cpu = bench_cpu_ms();
        if (status.code == VD_OK) {
            status = import_raw(s);
        }
        result.median_ms = result.p99_ms = result.min_ms = bench_wall_ms() - wall;
        snprintf(result.note, sizeof result.note, "%.1f s of CPU, %.2f bytes a particle",
                 1e-3 * (bench_cpu_ms() - cpu),
                 (double)s->report.file_bytes / (double)s->report.count);
        result.peak_bytes = vd_context_memory(s->context).bytes_peak;
    }
    vd_context_destroy(&s->context);
    return status.code == VD_OK ? bench_add(run, &result) : status;
}

/* ---- pictures -----------------------------------------------------------------------------------
 */

static vd_status draw(void *user) {
    bricks_scene *s = user;
    vd_status status = vd_brick_view_update(s->view, NULL, &s->view_def, &s->camera,
                                            s->frame->width, s->frame->height, &s->stats);
    return status.code == VD_OK
               ? vd_splatter_render(s->splatter, NULL, &s->splat_def, &s->camera, s->view->splats,
                                    s->view->count, s->frame, NULL)
               : status;
}

static double rms_of(const vd_frame *a, const vd_frame *b) {
    double sum = 0.0;
    for (int y = 0; y < a->height; y++) {
        for (int x = 0; x < a->width; x++) {
            for (int c = 0; c < 3; c++) {
                const size_t at = 4 * ((size_t)y * a->stride + (size_t)x) + (size_t)c;
                const double d = (double)a->rgba[at] - (double)b->rgba[at];
                sum += d * d;
            }
        }
    }
    return sqrt(sum / (3.0 * a->width * a->height));
}

static void look(bricks_scene *s, vd_splat_mode mode) {
    s->view_def = vd_brick_view_def_default();
    s->splat_def = vd_splat_def_default();
    s->view_def.mode = s->splat_def.mode = mode;
    s->view_def.memory_bytes = (size_t)4 << 30;
    s->splat_def.background = (vd_rgba8){0, 0, 0, 255};
    s->splat_def.log = true;
    if (mode == VD_SPLAT_ALPHA) {
        s->view_def.color = VD_BRICK_COLOR_VALUE;
        s->view_def.attribute = vd_bricks_find(s->bricks, "speed");
        s->view_def.opacity = 0.5;
        s->view_def.radius_m = 2e-4;
        s->splat_def.range_min = 1e-3;
        s->splat_def.range_max = 1.0;
        s->splat_def.resort_rad = 0.01;
    } else {
        s->splat_def.range_min = 1.0;
        s->splat_def.range_max = 1e-4 * (double)s->count;
        s->splat_def.max_weight = (double)s->count; /* known: needs no look at all of them */
    }
}

static vd_status measure_mode(bench_run *run, const bench_case *self, bricks_scene *s,
                              vd_splat_mode mode) {
    vd_frame *all = NULL;
    look(s, mode);
    s->view_def.detail_px = -1.0;
    s->splat_def.max_weight = 0.0;
    vd_status status = draw(s);
    if (status.code == VD_OK) {
        all = s->frame;
        s->frame = NULL;
        status = vd_frame_create(s->context, all->width, all->height, 0, &s->frame);
    }
    s->view_def.detail_px = DETAIL_PX;
    bench_result result =
        bench_result_of(self, mode == VD_SPLAT_ALPHA ? "octree-alpha" : "octree-density");
    result.threads = vd_context_threads(s->context);
    result.isa = vd_context_isa(s->context);
    result.picture = (int)mode;
    if (status.code == VD_OK) {
        status = bench_measure(run, draw, s, bench_wall_ms, &result);
    }
    double cpu = (double)INFINITY;
    for (int i = 0; i < 5 && status.code == VD_OK; i++) {
        const double before = bench_cpu_ms();
        status = draw(s);
        cpu = fmin(cpu, bench_cpu_ms() - before);
    }
    if (status.code == VD_OK) {
        result.has_hash = result.same_picture = true;
        result.hash = vd_frame_hash(s->frame);
        result.target_fps = bench_target_fps(self, result.isa, result.threads);
        result.peak_bytes = vd_context_memory(s->context).bytes_peak;
        snprintf(result.note, sizeof result.note, "%.1f M drawn, RMS %.2f of 255, %.0f ms CPU",
                 1e-6 * (double)s->stats.particles, rms_of(all, s->frame), cpu);
        status = bench_add(run, &result);
    }
    vd_frame_destroy(&all);
    return status;
}

static vd_status measure_pictures(bench_run *run, const bench_case *self, bricks_scene *s,
                                  vd_isa isa, int threads) {
    vd_status status = make_context(isa, threads, &s->context);
    if (status.code == VD_OK) {
        status = vd_bricks_open(s->context, s->bricks_path, &s->bricks);
    }
    if (status.code == VD_OK) {
        status = vd_brick_view_create(s->context, s->bricks, &s->view);
    }
    if (status.code == VD_OK) {
        status = vd_splatter_create(s->context, &s->splatter);
    }
    if (status.code == VD_OK) {
        status = vd_frame_create(s->context, self->width, self->rows, 0, &s->frame);
    }
    s->camera = (vd_camera){.eye = {1.2, -1.5, 1.1}, .near_m = 1e-3, .far_m = 100.0};
    s->camera.orientation = vd_orientation_look_at(s->camera.eye, vd_vec3_make(0.0, 0.0, 0.0));
    s->camera.lens = vd_lens_from_fov(0.7, self->width, self->rows);
    static const vd_splat_mode modes[] = {VD_SPLAT_DENSITY, VD_SPLAT_ALPHA};
    for (int m = 0; m < 2 && status.code == VD_OK; m++) {
        status = measure_mode(run, self, s, modes[m]);
    }
    vd_frame_destroy(&s->frame);
    vd_splatter_destroy(&s->splatter);
    vd_brick_view_destroy(&s->view);
    vd_bricks_close(&s->bricks);
    vd_context_destroy(&s->context);
    return status;
}

vd_status bench_bricks(bench_run *run, const bench_case *self) {
    bricks_scene s = {.count = run->quick ? 1000000 : 50000000};
    const char *folder = getenv("TMPDIR");
    snprintf(s.raw, sizeof s.raw, "%.400s/veduta-bench-%d.f32", folder != NULL ? folder : "/tmp",
             (int)getpid());
    snprintf(s.bricks_path, sizeof s.bricks_path, "%s.vdp", s.raw);
    vd_status status = write_raw(&s);
    for (int t = 0; t < run->thread_count && status.code == VD_OK; t++) {
        status = measure_import(run, self, &s, run->threads[t]);
    }
    for (int i = 0; i < run->isa_count && status.code == VD_OK; i++) {
        for (int t = 0; t < run->thread_count && status.code == VD_OK; t++) {
            status = measure_pictures(run, self, &s, run->isas[i], run->threads[t]);
        }
    }
    unlink(s.raw);
    unlink(s.bricks_path);
    return status;
}

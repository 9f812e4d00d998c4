/* bench_sweep.c: time against one parameter at a time.
 *
 * The classic sweeps repeat those of the FutSpace thesis (§5.6, listing A.4): distance d, width m
 * and height l of the picture, the other two at 10, steps that grow by 0.005 from z0 = 1, eye and
 * horizon as published. Two of our plain CPU versions stand beside the march: `reference`, the
 * serial loops, and `columns`. The shadow sweeps repeat §6.2.
 */
#include "bench.h"
#include "render_settings.h"

/* Points are many, so each gets little time. */
#define POINT_SECONDS 0.4
#define POINT_RUNS 3
#define SUN_SECONDS 0.1 /* eight suns a point; the reference, a second each, once */

enum { QUICK_POINTS = 3 };

int bench_sweep_points(const bench_run *run, const bench_sweep *sweep) {
    return run->quick && sweep->count > QUICK_POINTS ? QUICK_POINTS : sweep->count;
}

/* Calls `point` at every value for every SIMD level and number of threads. */
typedef vd_status sweep_point(bench_run *run, const bench_case *self, double at, vd_isa isa, int t);

static vd_status walk(bench_run *run, const bench_case *self, sweep_point *point) {
    double seconds = run->seconds;
    int least_runs = run->least_runs;
    run->seconds = POINT_SECONDS;
    run->least_runs = POINT_RUNS;
    vd_status status = vd_success();
    for (int p = 0; p < bench_sweep_points(run, self->sweep); p++) {
        for (int i = 0; i < run->isa_count; i++) {
            for (int t = 0; t < run->thread_count && status.code == VD_OK; t++) {
                status = point(run, self, self->sweep->values[p], run->isas[i], t);
            }
        }
    }
    run->seconds = seconds;
    run->least_runs = least_runs;
    return status;
}

/* ---- classic ----------------------------------------------------------------------------------*/

static vd_status classic_point(bench_run *run, const bench_case *self, double at, vd_isa isa,
                               int t) {
    bench_parameter parameter = self->sweep->parameter;
    bool over_map = parameter == BENCH_MAP;
    int width = over_map ? 700 : parameter == BENCH_WIDTH ? (int)at : 10;
    int height = over_map ? 512 : parameter == BENCH_HEIGHT ? (int)at : 10;
    bench_scene s;
    vd_status status = bench_scene_init(&s, run, BENCH_MAP_CLASSIC, over_map ? (int)at : 0, isa,
                                        run->threads[t], width, height);
    if (status.code != VD_OK) {
        return status;
    }
    if (!over_map) {
        s.classic.step = 1;
        s.classic.growth = 0.005;
        s.classic.distance = parameter == BENCH_DISTANCE ? at : 10;
    }
    static const vd_classic_method methods[] = {VD_CLASSIC_REFERENCE, VD_CLASSIC_COLUMNS,
                                                VD_CLASSIC_MARCH};
    for (int m = t == 0 ? 0 : 1; m < 3 && status.code == VD_OK; m++) {
        bench_result result = bench_result_of(self, vd_classic_method_name(methods[m]));
        result.at = at;
        status = bench_classic_method(run, &s, methods[m], &result);
    }
    bench_scene_finish(&s);
    return status;
}

vd_status bench_sweep_classic(bench_run *run, const bench_case *self) {
    return walk(run, self, classic_point);
}

/* ---- shadows ----------------------------------------------------------------------------------*/

typedef struct shadow_work {
    vd_context *context;
    vd_heightfield *map;
    vd_shadow_def def;
    uint8_t *counts;
} shadow_work;

static vd_status count_shadows(void *user) {
    shadow_work *w = user;
    return vd_shadow_count(w->context, NULL, w->map, &w->def, w->counts, (size_t)w->map->width);
}

/* FNV-1a: what the counts are, for the table. */
static uint64_t hash_counts(const shadow_work *w) {
    uint64_t hash = 0xcbf29ce484222325u;
    size_t count = (size_t)w->map->width * (size_t)w->map->height;
    for (size_t i = 0; i < count; i++) {
        hash = (hash ^ w->counts[i]) * 0x100000001b3u;
    }
    return hash;
}

/* Measures one method. Over the sun's azimuths the slowest of the fast method counts, and the
 * reference, whose work does not depend on the sun, is measured there. */
static vd_status measure_shadow(bench_run *run, const bench_case *self, shadow_work *w, int threads,
                                int azimuths, double *slowest_azimuth_rad, bench_result *result) {
    bool reference = w->def.method == VD_SHADOW_REFERENCE;
    bench_result slowest = *result;
    slowest.min_ms = -1;
    for (int a = 0; a < (reference ? 1 : azimuths); a++) {
        bench_result one = *result;
        one.threads = reference ? 1 : threads;
        one.isa = vd_context_isa(w->context);
        one.width = w->map->width;
        one.height = w->map->height;
        one.reference = reference;
        if (azimuths > 1) {
            run->seconds = SUN_SECONDS;
            run->least_runs = reference ? 1 : POINT_RUNS;
        }
        w->def.azimuth_rad = reference      ? *slowest_azimuth_rad
                             : azimuths > 1 ? a * 45 * VD_RADIANS_PER_DEGREE
                                            : vd_shadow_def_default().azimuth_rad;
        vd_context_memory_reset_peak(w->context);
        vd_status status = bench_measure(run, count_shadows, w, bench_wall_ms, &one);
        if (status.code != VD_OK) {
            return status;
        }
        one.peak_bytes = vd_context_memory(w->context).bytes_peak;
        one.has_hash = true;
        one.same_picture = true;
        one.picture = (int)(w->def.azimuth_rad / VD_RADIANS_PER_DEGREE + 0.5);
        one.hash = hash_counts(w);
        if (azimuths > 1) {
            snprintf(one.note, sizeof one.note, "azimuth %.0f",
                     w->def.azimuth_rad / VD_RADIANS_PER_DEGREE);
        }
        if (one.min_ms > slowest.min_ms) { /* least times: a stolen moment is no worse sun */
            slowest = one;
            *slowest_azimuth_rad = w->def.azimuth_rad;
        }
    }
    if (!reference) {
        slowest.target_fps = bench_target_fps(self, slowest.isa, threads);
    }
    *result = slowest;
    return bench_add(run, &slowest);
}

static vd_status shadow_point(bench_run *run, const bench_case *self, double at, vd_isa isa,
                              int t) {
    bench_parameter parameter = self->sweep->parameter;
    bool over_sun = parameter == BENCH_SHADOW_SUN;
    int width = over_sun ? 0 : 128;
    int height = over_sun ? 0 : parameter == BENCH_SHADOW_ROWS ? (int)at : 128;
    shadow_work w = {.def = vd_shadow_def_default()};
    vd_context_def def = vd_context_def_default();
    def.threads = run->threads[t];
    def.isa = isa;
    vd_status status = vd_context_create(&def, &w.context);
    if (status.code != VD_OK) {
        return status;
    }
    status = bench_map_create(w.context, run->map, BENCH_MAP_CLASSIC, width, height, &w.map);
    if (status.code == VD_OK) {
        w.counts = vd_allocate(w.context, (size_t)w.map->width * (size_t)w.map->height, 1);
        status = w.counts != NULL ? status : vd_failure(VD_ERROR_MEMORY, "out of memory");
    }
    if (over_sun) {
        w.def.altitude_rad = at * VD_RADIANS_PER_DEGREE;
    } else {
        w.def.steps = parameter == BENCH_SHADOW_STEPS ? (int)at : 32;
    }
    double slowest_azimuth_rad = w.def.azimuth_rad;
    for (int m = 0; m < (t == 0 ? 2 : 1) && status.code == VD_OK; m++) {
        w.def.method = m == 0 ? VD_SHADOW_SHIFT : VD_SHADOW_REFERENCE;
        bench_result result = bench_result_of(self, m == 0 ? "shift" : "reference");
        result.at = at;
        status = measure_shadow(run, self, &w, run->threads[t], over_sun ? 8 : 1,
                                &slowest_azimuth_rad, &result);
    }
    vd_release(w.context, w.counts);
    vd_heightfield_destroy(w.context, &w.map);
    vd_context_destroy(&w.context);
    return status;
}

vd_status bench_sweep_shadow(bench_run *run, const bench_case *self) {
    return walk(run, self, shadow_point);
}

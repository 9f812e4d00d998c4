/* bench_raster_tables.c: the tables of the rasterization thesis (2026, §4.2) with our figures.
 *
 * | thesis | case             | varies |
 * |--------|------------------|--------------------------------------------------------------------|
 * | 1      | raster-levels    | SIMD levels and threads instead of its three machines | | 2, 3   |
 * raster-triangles | share of the triangles × size × architecture, time and memory      | | 4 |
 * raster-bins      | bins and fine tiles of the immediate method, no small triangles    | | 5 |
 * raster-small     | largest box of a small triangle, of the two methods that ask       | | 6 |
 * raster-tiles     | tiles of the two methods that sort; theirs are one level, no bins  | | §3.2 |
 * raster-resolve   | the three published ways to resolve depth                          |
 *
 * Depth shading throughout, with the run's last number of threads and first SIMD level where these
 * do not vary.
 */
#include "bench_raster.h"

#include <math.h>
#include <string.h>

enum { SIDE = 1024 };

/* What a row of a table sets. */
typedef struct setting {
    vd_raster_method method;
    int percent, size;
    vd_isa isa;
    int threads;
    int bin, fine, tile, small; /* 0: as the method has it */
    double at;                  /* what the table calls the row */
} setting;

static setting make_row(const bench_run *run, vd_raster_method method) {
    return (setting){.method = method,
                     .percent = 100,
                     .size = SIDE,
                     .isa = run->isas[0],
                     .threads = run->threads[run->thread_count - 1],
                     .at = NAN};
}

/* Pictures are equal where model, size and share are. */
static int picture_of(const bench_model *m, const setting *row) {
    int number = 0;
    while (bench_model_name(number) != NULL && bench_model_name(number) != m->name) {
        number++;
    }
    return (number * 65536 + row->size) * 128 + row->percent;
}

static vd_status measure(bench_run *run, const bench_case *self, bench_view *v,
                         const bench_model *m, const setting *row) {
    bench_result result = bench_result_of(self, vd_raster_method_name(row->method));
    v->def.method = row->method;
    v->def.bin_pixels = row->bin;
    v->def.fine_pixels = row->fine;
    v->def.tile_pixels = row->tile;
    v->def.small_pixels = row->small;
    result.at = row->at;
    result.fine = row->fine;
    result.picture = picture_of(m, row);
    int length = snprintf(result.note, sizeof result.note, "%s, %d²", m->name, row->size);
    if (row->fine > 0) {
        snprintf(result.note + length, sizeof result.note - (size_t)length, ", fine tiles of %d",
                 row->fine);
    }
    return bench_view_measure(run, v, m, &result);
}

/* Measures rows that share a view. */
static vd_status measure_rows(bench_run *run, const bench_case *self, const bench_model *m,
                              const setting *rows, int count) {
    bench_view v;
    vd_status status =
        bench_view_init(&v, m, rows[0].percent, rows[0].size, rows[0].isa, rows[0].threads);
    if (status.code != VD_OK) {
        return status;
    }
    for (int i = 0; i < count && status.code == VD_OK; i++) {
        status = measure(run, self, &v, m, &rows[i]);
    }
    bench_view_finish(&v);
    return status;
}

/* Calls `table` for every model that is there. */
typedef vd_status table_function(bench_run *run, const bench_case *self, const bench_model *m);

static vd_status for_models(bench_run *run, const bench_case *self, table_function *table) {
    vd_status status = vd_success();
    bench_raster_limits(run);
    for (int i = 0; bench_model_name(i) != NULL && status.code == VD_OK; i++) {
        bench_model m;
        if (bench_model_read(bench_model_name(i), &m)) {
            status = table(run, self, &m);
            bench_model_free(&m);
        }
    }
    return status;
}

/* ---- table 1 ----------------------------------------------------------------------------------*/

static vd_status levels_of(bench_run *run, const bench_case *self, const bench_model *m) {
    vd_status status = vd_success();
    for (int isa = VD_ISA_V2; isa <= (int)vd_isa_best(); isa++) {
        for (int t = 0; t < run->thread_count && status.code == VD_OK; t++) {
            setting rows[2] = {make_row(run, VD_RASTER_IMMEDIATE), make_row(run, VD_RASTER_AUTO)};
            for (int i = 0; i < 2; i++) {
                rows[i].isa = (vd_isa)isa;
                rows[i].threads = run->threads[t];
            }
            status = measure_rows(run, self, m, rows, 2);
        }
    }
    return status;
}

vd_status bench_raster_levels(bench_run *run, const bench_case *self) {
    return for_models(run, self, levels_of);
}

/* ---- tables 2 and 3 ---------------------------------------------------------------------------*/

/* The cell that measured all triangles of this run already, null where there is none. */
static const bench_result *cell_of(const bench_run *run, const bench_model *m, const setting *row) {
    for (int i = 0; i < run->result_count; i++) {
        const bench_result *r = &run->results[i];
        if (r->of->function == bench_raster && r->model == m->name && r->width == row->size &&
            r->threads == row->threads && (row->isa == VD_ISA_AUTO || r->isa == row->isa) &&
            strcmp(r->method, vd_raster_method_name(row->method)) == 0) {
            return r;
        }
    }
    return NULL;
}

static vd_status share_of(bench_run *run, const bench_case *self, const bench_model *m, int percent,
                          int size) {
    enum { METHODS = VD_RASTER_HYBRID - VD_RASTER_SCANLINE + 1 };
    setting rows[METHODS];
    const bench_result *cells[METHODS];
    bool known = percent == 100;
    for (int i = 0; i < METHODS; i++) {
        rows[i] = make_row(run, (vd_raster_method)(VD_RASTER_SCANLINE + i));
        rows[i].percent = percent;
        rows[i].size = size;
        rows[i].at = percent;
        cells[i] = cell_of(run, m, &rows[i]);
        known &= cells[i] != NULL;
    }
    if (!known) {
        return measure_rows(run, self, m, rows, METHODS);
    }
    vd_status status = vd_success();
    for (int i = 0; i < METHODS && status.code == VD_OK; i++) {
        bench_result result = *cells[i];
        result.of = self;
        result.at = percent;
        result.picture = picture_of(m, &rows[i]);
        result.vs_peer = NAN;
        snprintf(result.note, sizeof result.note, "%s, %d²", m->name, size);
        status = bench_add(run, &result);
    }
    return status;
}

static vd_status triangles_of(bench_run *run, const bench_case *self, const bench_model *m) {
    static const int percents[3] = {25, 50, 100};
    vd_status status = vd_success();
    for (int size = SIDE; size <= (run->quick ? SIDE : 8192); size *= 2) {
        for (int i = 0; i < 3 && status.code == VD_OK; i++) {
            status = share_of(run, self, m, percents[i], size);
        }
    }
    return status;
}

vd_status bench_raster_triangles(bench_run *run, const bench_case *self) {
    return for_models(run, self, triangles_of);
}

/* ---- table 4 ----------------------------------------------------------------------------------*/

/* The thesis' combinations and model. A box of one pixel is its own fine tile: no other triangle is
 * small. */
vd_status bench_raster_bins(bench_run *run, const bench_case *self) {
    static const int sides[7][2] = {{16, 4}, {32, 4},  {64, 4}, {32, 8},
                                    {64, 8}, {128, 8}, {64, 16}};
    enum { COUNT = sizeof sides / sizeof sides[0] };
    bench_model m;
    setting rows[COUNT + 1];
    for (int i = 0; i <= COUNT; i++) {
        rows[i] = make_row(run, VD_RASTER_IMMEDIATE);
        rows[i].at = rows[i].bin = i < COUNT ? sides[i][0] : 128;
        rows[i].fine = i < COUNT ? sides[i][1] : 16;
        rows[i].small = 1;
    }
    bench_raster_limits(run);
    if (!bench_model_read(bench_model_named("dragon202k"), &m)) {
        return vd_success();
    }
    const vd_status status = measure_rows(run, self, &m, rows, COUNT + 1);
    bench_model_free(&m);
    return status;
}

/* ---- tables 5 and 6 ---------------------------------------------------------------------------*/

static vd_status small_of(bench_run *run, const bench_case *self, const bench_model *m) {
    static const int pixels[5] = {1, 32, 64, 128, 256};
    setting rows[10];
    for (int i = 0; i < 10; i++) {
        rows[i] = make_row(run, i < 5 ? VD_RASTER_IMMEDIATE : VD_RASTER_HYBRID);
        rows[i].at = rows[i].small = pixels[i % 5];
    }
    return measure_rows(run, self, m, rows, 10);
}

vd_status bench_raster_small(bench_run *run, const bench_case *self) {
    return for_models(run, self, small_of);
}

static vd_status tiles_of(bench_run *run, const bench_case *self, const bench_model *m) {
    setting rows[10];
    for (int i = 0; i < 10; i++) {
        rows[i] = make_row(run, i < 5 ? VD_RASTER_TILED : VD_RASTER_HYBRID);
        rows[i].at = rows[i].tile = 16 << i % 5;
    }
    return measure_rows(run, self, m, rows, 10);
}

vd_status bench_raster_tiles(bench_run *run, const bench_case *self) {
    return for_models(run, self, tiles_of);
}

/* ---- §3.2 -------------------------------------------------------------------------------------*/

/* One line of veduta-resolve: way, median, minimum, bytes, fragments, shaded, differing pixels. */
static vd_status add_way(bench_run *run, const bench_case *self, const bench_view *v,
                         const bench_model *m, const char *ending, const char *line) {
    char way[20];
    double median, least;
    unsigned long long bytes, fragments, shaded, differing;
    if (sscanf(line, "%19s %lf %lf %llu %llu %llu %llu", way, &median, &least, &bytes, &fragments,
               &shaded, &differing) != 7) {
        return vd_failure(VD_ERROR_FORMAT, "veduta-resolve said: %.200s", line);
    }
    char name[32];
    snprintf(name, sizeof name, "%s%s", way, ending);
    bench_result result = bench_result_of(self, name);
    result.model = m->name;
    result.at = v->frame->width;
    result.isa = vd_context_isa(v->context);
    result.width = result.height = v->frame->width;
    result.median_ms = median;
    result.min_ms = least;
    result.p99_ms = NAN;
    result.peak_bytes = (size_t)bytes;
    result.output_bytes = (size_t)v->frame->width * (size_t)v->frame->height * 8;
    result.fragments = fragments;
    result.shaded = shaded;
    snprintf(result.note, sizeof result.note, "%s, %.2f of %.2f M coloured, same bytes", m->name,
             (double)shaded / 1e6, (double)fragments / 1e6);
    if (differing > 0) {
        return vd_failure(VD_ERROR_FORMAT,
                          "%s of %s at %d: %llu pixels differ from the visibility buffer's; this "
                          "is a bug, please report it",
                          name, m->name, v->frame->width, differing);
    }
    return bench_add(run, &result);
}

static vd_status resolve(bench_run *run, const bench_case *self, const bench_view *v,
                         const bench_model *m, vd_shading shading) {
    char program[640], command[1600], line[256];
    const vd_camera *c = &v->camera;
    if (!bench_program_beside("veduta-resolve", program, sizeof program) ||
        strchr(m->path, '\'') != NULL) {
        return vd_failure(VD_ERROR_IO, "veduta-resolve cannot be started with %.200s", m->path);
    }
    snprintf(command, sizeof command, "%s '%s' %d %s %.17g %.17g %.17g %.17g %.17g %.17g %d %g",
             program, m->path, v->frame->width, vd_shading_name(shading), c->eye.x, c->eye.y,
             c->eye.z, c->lens.fx, c->near_m, c->far_m,
             run->repeat > 0 ? run->repeat : run->least_runs, run->repeat > 0 ? 0.0 : run->seconds);
    FILE *pipe = popen(command, "r");
    if (pipe == NULL) {
        return vd_failure(VD_ERROR_IO, "cannot start veduta-resolve");
    }
    vd_status status = vd_success();
    while (status.code == VD_OK && fgets(line, sizeof line, pipe) != NULL) {
        status = add_way(run, self, v, m, shading == VD_SHADING_PHONG ? "-phong" : "", line);
    }
    if (pclose(pipe) != 0 && status.code == VD_OK) {
        status = vd_failure(VD_ERROR_IO, "veduta-resolve failed; it said why above");
    }
    return status;
}

static vd_status resolve_model(bench_run *run, const bench_case *self, const bench_model *m) {
    vd_status status = vd_success();
    /* Larger pictures only of the model that covers the most. */
    const int most = run->quick || strcmp(m->name, "bunny") != 0 ? SIDE : 4 * SIDE;
    for (int size = SIDE; size <= most && status.code == VD_OK; size *= 4) {
        bench_view v;
        status = bench_view_init(&v, m, 100, size, run->isas[0], 1);
        if (status.code != VD_OK) {
            return status;
        }
        status = resolve(run, self, &v, m, VD_SHADING_DEPTH);
        if (status.code == VD_OK) {
            status = resolve(run, self, &v, m, VD_SHADING_PHONG);
        }
        bench_view_finish(&v);
    }
    return status;
}

vd_status bench_raster_resolve(bench_run *run, const bench_case *self) {
    char program[640];
    if (!bench_program_beside("veduta-resolve", program, sizeof program)) {
        fprintf(stderr, "%s: left out: there is no veduta-resolve beside this program\n",
                self->name);
        return vd_success();
    }
    return for_models(run, self, resolve_model);
}

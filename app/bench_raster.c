/* bench_raster.c: the published models by every raster method, beside Mesa's llvmpipe.
 *
 * Frame: parallel projection along −z, the model as large as fits, 8-bit colour and float depth
 * written; grey = depth³, and Phong (methods that end in -phong). The models come from
 * script/bench-models (the environment's VEDUTA_BENCH_MODELS names the folder, build/models if it
 * does not); one that is not there is left out. The peer is the program veduta-llvmpipe beside this
 * one: the same mesh, matrix and shading, as many threads.
 */
#include "bench.h"

#include <libgen.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

typedef struct model {
    uint32_t vertex_count, triangle_count;
    float *positions;  /* [vertex_count][3] */
    uint32_t *indices; /* [triangle_count][3] */
} model;

/* One picture of a model. */
typedef struct view {
    vd_context *context;
    vd_mesh *mesh;
    vd_raster *raster;
    vd_frame *frame;
    vd_camera camera;
    vd_draw draw;
    vd_raster_def def;
} view;

/* ---- models -----------------------------------------------------------------------------------*/

/* The path of the model that a case's name, MODEL-SIZE, begins with. */
static void model_path(const bench_case *self, char *out, size_t bytes) {
    const char *folder = getenv("VEDUTA_BENCH_MODELS");
    const int length = (int)strcspn(self->name, "-");
    snprintf(out, bytes, "%s/%.*s.mesh", folder != NULL ? folder : "build/models", length,
             self->name);
}

static bool read_model(const char *path, model *m) {
    char magic[8];
    uint32_t counts[2];
    FILE *file = fopen(path, "rb");
    memset(m, 0, sizeof *m);
    if (file == NULL) {
        return false;
    }
    bool ok = fread(magic, 1, 8, file) == 8 && memcmp(magic, "VDBENCH1", 8) == 0 &&
              fread(counts, 4, 2, file) == 2 && counts[0] < 1u << 28 && counts[1] < 1u << 28;
    if (ok) {
        m->vertex_count = counts[0];
        m->triangle_count = counts[1];
        m->positions = malloc((size_t)counts[0] * 12 + 1);
        m->indices = malloc((size_t)counts[1] * 12 + 1);
        ok = m->positions != NULL && m->indices != NULL &&
             fread(m->positions, 12, counts[0], file) == counts[0] &&
             fread(m->indices, 12, counts[1], file) == counts[1];
    }
    fclose(file);
    return ok;
}

static void free_model(model *m) {
    free(m->positions);
    free(m->indices);
}

/* ---- views ------------------------------------------------------------------------------------*/

static void finish_view(view *v) {
    vd_frame_destroy(&v->frame);
    vd_raster_destroy(&v->raster);
    if (v->context != NULL) {
        vd_mesh_destroy(v->context, &v->mesh);
        vd_context_destroy(&v->context);
    }
}

/* Along −z, x to the right, y up; the wider side of the model fills the picture. */
static void set_camera(view *v, int size) {
    vd_vec3 min, max;
    vd_mesh_bounds(v->mesh, &min, &max);
    const double wide = max.x - min.x, high = max.y - min.y, deep = max.z - min.z;
    const double scale = size / (wide < high ? high : wide);
    v->camera =
        (vd_camera){.eye = {0.5 * (min.x + max.x), 0.5 * (min.y + max.y), max.z + 0.5 * deep},
                    .orientation = vd_quat_from_axes(vd_vec3_make(1, 0, 0), vd_vec3_make(0, -1, 0),
                                                     vd_vec3_make(0, 0, -1)),
                    .projection = VD_PROJECTION_ORTHOGRAPHIC,
                    .lens = {scale, scale, 0.5 * size, 0.5 * size},
                    .near_m = 0.1 * deep,
                    .far_m = 2.0 * deep};
}

static vd_status init_view(view *v, const model *m, int size, vd_isa isa, int threads) {
    memset(v, 0, sizeof *v);
    vd_context_def context_def = vd_context_def_default();
    context_def.isa = isa;
    context_def.threads = threads;
    vd_mesh_def mesh_def = vd_mesh_def_default();
    mesh_def.vertex_count = m->vertex_count;
    mesh_def.positions = m->positions;
    mesh_def.index_count = (size_t)m->triangle_count * 3;
    mesh_def.indices = m->indices;
    mesh_def.compute_normals = true;
    vd_status status = vd_context_create(&context_def, &v->context);
    if (status.code == VD_OK) {
        status = vd_mesh_create(v->context, &mesh_def, &v->mesh);
    }
    if (status.code == VD_OK) {
        status = vd_raster_create(v->context, &v->raster);
    }
    if (status.code == VD_OK) {
        status = vd_frame_create(v->context, size, size, VD_PLANE_DEPTH, &v->frame);
    }
    if (status.code != VD_OK) {
        finish_view(v);
        return status;
    }
    set_camera(v, size);
    v->draw = vd_draw_default();
    v->draw.mesh = v->mesh;
    v->def = vd_raster_def_default();
    v->def.background = (vd_rgba8){0, 0, 0, 255};
    return status;
}

static vd_status draw_view(void *user) {
    view *v = user;
    return vd_raster_render(v->raster, NULL, &v->def, &v->camera, &v->draw, 1, v->frame, NULL);
}

/* ---- the peer ---------------------------------------------------------------------------------*/

static int compare_times(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* The peer's command: program, model, size, shading, the 16 numbers of the matrix, runs. */
static bool peer_command(const view *v, const char *path, const char *shading, int threads,
                         int runs, char *out, size_t bytes) {
    char program[512], self[512];
    const ssize_t length = readlink("/proc/self/exe", self, sizeof self - 1);
    if (length < 0 || strchr(path, '\'') != NULL) {
        return false;
    }
    self[length] = '\0';
    snprintf(program, sizeof program, "%.480s/veduta-llvmpipe", dirname(self));
    if (access(program, X_OK) != 0 || strchr(program, '\'') != NULL) {
        return false;
    }
    const vd_matrix project = vd_camera_matrix(&v->camera);
    const vd_matrix move = vd_matrix_translation(vd_vec3_scale(v->camera.eye, -1.0));
    const vd_matrix m = vd_matrix_multiply(&project, &move);
    int at = snprintf(out, bytes, "LP_NUM_THREADS=%d '%s' '%s' %d %s", threads, program, path,
                      v->frame->width, shading);
    for (int i = 0; i < 16; i++) {
        at += snprintf(out + at, bytes - (size_t)at, " %.9g", m.m[i / 4][i % 4]);
    }
    at += snprintf(out + at, bytes - (size_t)at, " %d 2>/dev/null", runs);
    return at < (int)bytes;
}

enum { PEER_RUNS = 9 };

/* Measures llvmpipe; false where it cannot be. */
static bool measure_peer(const view *v, const char *path, const char *shading, int threads,
                         bench_result *result) {
    char command[2048];
    double times_ms[PEER_RUNS];
    int count = 0;
    if (!peer_command(v, path, shading, threads, PEER_RUNS, command, sizeof command)) {
        return false;
    }
    FILE *pipe = popen(command, "r");
    if (pipe == NULL) {
        return false;
    }
    while (count < PEER_RUNS && fscanf(pipe, "%lf", &times_ms[count]) == 1) {
        count++;
    }
    if (pclose(pipe) != 0 || count < PEER_RUNS) {
        return false;
    }
    qsort(times_ms, PEER_RUNS, sizeof times_ms[0], compare_times);
    result->min_ms = times_ms[0];
    result->median_ms = times_ms[PEER_RUNS / 2];
    result->p99_ms = times_ms[PEER_RUNS - 1];
    return true;
}

/* ---- cases ------------------------------------------------------------------------------------*/

/* All methods with one shading; `picture` numbers the shadings. The peer first: the others' notes
 * say how many times as fast they are. */
static vd_status measure_shading(bench_run *run, const bench_case *self, view *v, const char *path,
                                 int threads, int picture) {
    const vd_shading shading = picture == 0 ? VD_SHADING_DEPTH : VD_SHADING_PHONG;
    const char *ending = picture == 0 ? "" : "-phong";
    v->draw.shader = vd_shader_find(shading);
    char name[32];
    snprintf(name, sizeof name, "llvmpipe%s", ending);
    bench_result peer = bench_result_of(self, name);
    peer.threads = threads;
    peer.isa = vd_context_isa(v->context);
    peer.width = peer.height = self->width;
    const bool has_peer = measure_peer(v, path, vd_shading_name(shading), threads, &peer);
    vd_status status = has_peer ? bench_add(run, &peer) : vd_success();
    for (int m = 0; m < VD_RASTER_REFERENCE && status.code == VD_OK; m++) {
        v->def.method = (vd_raster_method)m;
        snprintf(name, sizeof name, "%s%s", vd_raster_method_name(v->def.method), ending);
        bench_result result = bench_result_of(self, name);
        result.threads = threads;
        result.isa = vd_context_isa(v->context);
        result.width = result.height = self->width;
        result.same_picture = true;
        result.picture = picture;
        vd_context_memory_reset_peak(v->context);
        status = bench_measure(run, draw_view, v, bench_wall_ms, &result);
        if (status.code == VD_OK) {
            result.peak_bytes = vd_context_memory(v->context).bytes_peak;
            result.has_hash = true;
            result.hash = vd_frame_hash(v->frame);
            if (has_peer) {
                snprintf(result.note, sizeof result.note, "%.2f x llvmpipe",
                         peer.median_ms / result.median_ms);
            }
            status = bench_add(run, &result);
        }
    }
    return status;
}

vd_status bench_raster(bench_run *run, const bench_case *self) {
    char path[512];
    model m;
    model_path(self, path, sizeof path);
    if (!read_model(path, &m)) {
        free_model(&m);
        fprintf(stderr, "%s: left out: there is no %s; script/bench-models fetches it\n",
                self->name, path);
        return vd_success();
    }
    vd_status status = vd_success();
    const bool skip = run->quick && self->width > 1024;
    for (int i = 0; i < run->isa_count && !skip && status.code == VD_OK; i++) {
        for (int t = 0; t < run->thread_count && status.code == VD_OK; t++) {
            for (int picture = 0; picture < 2 && status.code == VD_OK; picture++) {
                view v; /* anew: what one shading allocated is not another's peak */
                status = init_view(&v, &m, self->width, run->isas[i], run->threads[t]);
                if (status.code == VD_OK) {
                    status = measure_shading(run, self, &v, path, run->threads[t], picture);
                    finish_view(&v);
                }
            }
        }
    }
    free_model(&m);
    return status;
}

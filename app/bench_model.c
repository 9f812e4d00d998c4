/* bench_model.c: the published models and views of them. */
#include "../bench/mesh_file.h"
#include "bench_raster.h"

#include <malloc.h>
#include <stdlib.h>
#include <string.h>

/* The thesis' Penger and Lucy have no source among the distributions' packages and npm's. */
const char *bench_model_name(int index) {
    static const char *const names[] = {"bunny", "monkey", "armadillo", "dragon202k", "dragon871k"};
    return index >= 0 && index < (int)(sizeof names / sizeof names[0]) ? names[index] : NULL;
}

const char *bench_model_named(const char *name) {
    for (int i = 0; bench_model_name(i) != NULL; i++) {
        if (strcmp(bench_model_name(i), name) == 0) {
            return bench_model_name(i);
        }
    }
    return NULL;
}

/* ---- files ------------------------------------------------------------------------------------*/

static bool read_file(const char *path, bench_model *m) {
    mesh_file file = {0, 0, NULL, NULL};
    bool ok = mesh_file_read(path, &file);
    m->vertex_count = file.vertex_count;
    m->triangle_count = file.triangle_count;
    m->positions = file.positions;
    m->indices = file.indices;
    for (size_t i = 0; ok && i < (size_t)m->triangle_count * 3; i++) {
        ok = m->indices[i] < m->vertex_count;
    }
    return ok;
}

bool bench_model_read(const char *name, bench_model *m) {
    const char *folder = getenv("VEDUTA_BENCH_MODELS");
    memset(m, 0, sizeof *m);
    m->name = name;
    const int length = snprintf(m->path, sizeof m->path, "%s/%s.mesh",
                                folder != NULL ? folder : "build/models", name);
    if (length < (int)sizeof m->path && read_file(m->path, m)) {
        return true;
    }
    bench_model_free(m);
    fprintf(stderr, "%s: left out: there is no good %s; script/bench-models fetches it\n", name,
            m->path);
    return false;
}

void bench_model_free(bench_model *m) {
    free(m->positions);
    free(m->indices);
    m->positions = NULL;
    m->indices = NULL;
}

/* ---- fewer triangles --------------------------------------------------------------------------*/

/* Takes `percent` of the triangles, evenly, and numbers the vertices that they use anew. */
static bool thin(const bench_model *m, int percent, bench_model *out) {
    *out = *m;
    uint32_t *number = calloc((size_t)m->vertex_count + 1, sizeof *number); /* from 1; 0: unused */
    out->positions = malloc((size_t)m->vertex_count * 12 + 1);
    out->indices = malloc((size_t)m->triangle_count * 12 + 1);
    if (number == NULL || out->positions == NULL || out->indices == NULL) {
        free(number);
        bench_model_free(out);
        return false;
    }
    out->vertex_count = out->triangle_count = 0;
    for (uint64_t t = 0; t < m->triangle_count; t++) {
        if ((t + 1) * (uint64_t)percent / 100 == t * (uint64_t)percent / 100) {
            continue;
        }
        for (int k = 0; k < 3; k++) {
            const uint32_t old = m->indices[3 * t + (uint64_t)k];
            if (number[old] == 0) {
                memcpy(out->positions + 3 * (size_t)out->vertex_count,
                       m->positions + 3 * (size_t)old, 12);
                number[old] = ++out->vertex_count;
            }
            out->indices[3 * (size_t)out->triangle_count + (size_t)k] = number[old] - 1;
        }
        out->triangle_count++;
    }
    free(number);
    return true;
}

/* ---- views ------------------------------------------------------------------------------------*/

void bench_view_finish(bench_view *v) {
    vd_frame_destroy(&v->frame);
    vd_raster_destroy(&v->raster);
    if (v->context != NULL) {
        vd_mesh_destroy(v->context, &v->mesh);
        vd_context_destroy(&v->context);
    }
}

/* Along −z, x to the right, y up; the wider side of the model fills the picture. */
static void set_camera(bench_view *v, const bench_model *m, int size) {
    float low[3] = {0, 0, 0}, high[3] = {0, 0, 0};
    for (size_t i = 0; i < (size_t)m->vertex_count * 3; i++) {
        const float p = m->positions[i];
        low[i % 3] = i < 3 || p < low[i % 3] ? p : low[i % 3];
        high[i % 3] = i < 3 || p > high[i % 3] ? p : high[i % 3];
    }
    const double wide = (double)high[0] - low[0], tall = (double)high[1] - low[1];
    const double deep = (double)high[2] - low[2], scale = size / (wide < tall ? tall : wide);
    v->camera =
        (vd_camera){.eye = {0.5 * ((double)low[0] + high[0]), 0.5 * ((double)low[1] + high[1]),
                            high[2] + 0.5 * deep},
                    .orientation = vd_quat_from_axes(vd_vec3_make(1, 0, 0), vd_vec3_make(0, -1, 0),
                                                     vd_vec3_make(0, 0, -1)),
                    .projection = VD_PROJECTION_ORTHOGRAPHIC,
                    .lens = {scale, scale, 0.5 * size, 0.5 * size},
                    .near_m = 0.1 * deep,
                    .far_m = 2.0 * deep};
}

static vd_status make_mesh(bench_view *v, const bench_model *m) {
    vd_mesh_def def = vd_mesh_def_default();
    def.vertex_count = m->vertex_count;
    def.positions = m->positions;
    def.index_count = (size_t)m->triangle_count * 3;
    def.indices = m->indices;
    def.compute_normals = true;
    return vd_mesh_create(v->context, &def, &v->mesh);
}

vd_status bench_view_init(bench_view *v, const bench_model *m, int percent, int size, vd_isa isa,
                          int threads) {
    memset(v, 0, sizeof *v);
    vd_context_def context_def = vd_context_def_default();
    context_def.isa = isa;
    context_def.threads = threads;
    vd_status status = vd_context_create(&context_def, &v->context);
    if (status.code == VD_OK && percent < 100) {
        bench_model part;
        if (thin(m, percent, &part)) {
            status = make_mesh(v, &part);
            bench_model_free(&part);
        } else {
            status = vd_failure(VD_ERROR_MEMORY, "out of memory for a part of %s", m->name);
        }
    } else if (status.code == VD_OK) {
        status = make_mesh(v, m);
    }
    if (status.code == VD_OK) {
        status = vd_frame_create(v->context, size, size, VD_PLANE_DEPTH, &v->frame);
    }
    if (status.code != VD_OK) {
        bench_view_finish(v);
        return status;
    }
    set_camera(v, m, size);
    v->draw = vd_draw_default();
    v->draw.mesh = v->mesh;
    v->draw.shader = vd_shader_find(VD_SHADING_DEPTH);
    v->def = vd_raster_def_default();
    v->def.background = (vd_rgba8){0, 0, 0, 255};
    return status;
}

static vd_status draw_view(void *user) {
    bench_view *v = user;
    return vd_raster_render(v->raster, NULL, &v->def, &v->camera, &v->draw, 1, v->frame, NULL);
}

/* ---- memory -----------------------------------------------------------------------------------*/

/* Linux: the most memory that the process had counts anew. False where it cannot. */
static bool reset_resident_peak(void) {
    malloc_trim(0);
    FILE *file = fopen("/proc/self/clear_refs", "w");
    if (file == NULL) {
        return false;
    }
    const bool written = fputs("5", file) >= 0;
    return fclose(file) == 0 && written;
}

static size_t resident_peak(void) {
    char line[128];
    unsigned long long kilobytes = 0;
    FILE *file = fopen("/proc/self/status", "r");
    while (file != NULL && fgets(line, sizeof line, file) != NULL) {
        if (sscanf(line, "VmHWM: %llu", &kilobytes) == 1) {
            break;
        }
    }
    if (file != NULL) {
        fclose(file);
    }
    return (size_t)kilobytes * 1024;
}

vd_status bench_view_measure(bench_run *run, bench_view *v, const bench_model *m,
                             bench_result *result) {
    vd_raster_destroy(&v->raster);
    const bool resident = reset_resident_peak();
    vd_context_memory_reset_peak(v->context);
    result->model = m->name;
    result->threads = vd_context_threads(v->context);
    result->isa = vd_context_isa(v->context);
    result->width = result->height = v->frame->width;
    result->output_bytes = (size_t)v->frame->width * (size_t)v->frame->height *
                           (4 + sizeof *v->frame->depth); /* colour, depth */
    vd_status status = vd_raster_create(v->context, &v->raster);
    if (status.code == VD_OK) {
        status = bench_measure(run, draw_view, v, bench_wall_ms, result);
    }
    if (status.code != VD_OK) {
        return status;
    }
    result->peak_bytes = vd_context_memory(v->context).bytes_peak;
    result->peak_resident_bytes = resident ? resident_peak() : 0;
    result->has_hash = true;
    result->hash = vd_frame_hash(v->frame);
    result->same_picture = true;
    return bench_add(run, result);
}

#define LIMIT_SECONDS 0.4
#define LIMIT_MOST_SECONDS 1.0
#define LIMIT_RUNS 3

void bench_raster_limits(bench_run *run) {
    run->seconds = LIMIT_SECONDS;
    run->most_seconds = LIMIT_MOST_SECONDS;
    run->least_runs = LIMIT_RUNS;
}

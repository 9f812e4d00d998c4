/* resolve.c: the three published ways to resolve depth (2026 thesis, §3.2), side by side.
 *
 *   veduta-resolve MODEL.mesh SIZE depth|phong EYE_X EYE_Y EYE_Z SCALE NEAR FAR RUNS SECONDS
 *
 * All ways take the same samples from the same loop (triangles in order, the pixels of a triangle's
 * box that its edges leave), have the same plain shading, sixteen samples at a time, and run on one
 * thread over the whole picture: nothing differs but when colour is computed and what is kept.
 *
 *   visibility     depth and triangle a pixel; then every visible pixel is coloured once
 *   tuples         every sample is coloured; (depth, colour) of the nearest stays
 *   tuples-early   the same, but a sample behind what is there already is not coloured
 *   search         first depth alone, all samples kept in a list; then the list is searched for
 *                  samples whose depth is the pixel's, and these are coloured
 *   search-again   the same, but instead of keeping a list triangles are filled a second time
 *
 * Triangles come in order and equal depths keep the first, so all give the picture of
 * vd_raster_render to the byte; prints for each: name, median ms, least ms, bytes beside the
 * picture of colour and depth, samples covered, samples coloured, pixels that differ from
 * vd_raster_render. Times are from projected vertices to the finished picture.
 */
#include <time.h>
#include "mesh_file.h"
#include "raster/raster_edges.h"
#include "raster/raster_run.h"

typedef struct pictured {
    uint8_t *rgba; /* [size][size][4] */
    float *depth;  /* [size][size] */
} pictured;

/* A covered sample: what the search's list keeps. */
typedef struct sample {
    uint32_t at; /* pixel */
    float depth;
    uint32_t primitive;
} sample;

/* One way at work. */
typedef struct work {
    const vd_drawing *drawing;
    vd_visible window; /* of the whole picture: its size alone */
    int size;
    pictured out;
    uint32_t *primitive; /* [size][size], from 1: visibility; 1: coloured: search */
    sample *list;
    size_t list_count, list_room;
    sample queue[VD_BATCH];
    int queued;
    bool compare; /* a coloured sample is compared with what is there */
    vd_batch batch;
    uint64_t covered, shaded;
    void (*take)(struct work *, const sample *); /* what a covered sample does */
} work;

static void fail(const char *what) {
    fprintf(stderr, "veduta-resolve: %s\n", what);
    exit(1);
}

static double cpu_ms(void) {
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec * 1e3 + (double)t.tv_nsec * 1e-6;
}

static void *room(size_t count, size_t bytes) {
    void *memory = calloc(count + 1, bytes);
    if (memory == NULL) {
        fail("out of memory");
    }
    return memory;
}

/* ---- samples ----------------------------------------------------------------------------------*/

static float depth_at(const vd_setup *s, int x, int y) {
    const float dx = (float)(x * VD_SUBPIXELS - s->x[0]), dy = (float)(y * VD_SUBPIXELS - s->y[0]);
    float z = s->z0 + (dx * s->dz_dx + dy * s->dz_dy);
    z = z > s->z_min ? z : s->z_min;
    return z < s->z_max ? z : s->z_max;
}

static void fill(void *user, const vd_setup *s) {
    work *w = user;
    const vd_edges e = vd_edges_make(s, &w->window, 0);
    for (int y = e.y0; y <= e.y1; y++) {
        int64_t a = e.at[0] + e.x0 * e.dx[0] + y * e.dy[0];
        int64_t b = e.at[1] + e.x0 * e.dx[1] + y * e.dy[1];
        int64_t c = e.at[2] + e.x0 * e.dx[2] + y * e.dy[2];
        for (int x = e.x0; x <= e.x1; x++, a += e.dx[0], b += e.dx[1], c += e.dx[2]) {
            if ((a | b | c) >= 0) {
                const sample one = {(uint32_t)(y * w->size + x), depth_at(s, x, y),
                                    s->id - w->drawing->first_id};
                w->covered++;
                w->take(w, &one);
            }
        }
    }
}

static void fill_all(work *w) {
    for (uint32_t p = 0; p < w->drawing->primitive_count; p++) {
        vd_assemble(w->drawing, p, fill, w);
    }
}

/* ---- colours ----------------------------------------------------------------------------------*/

/* Colours what is queued. */
static void flush(work *w) {
    if (w->queued == 0) {
        return;
    }
    for (int lane = 0; lane < VD_BATCH; lane++) { /* the lanes left over repeat the last */
        const sample *s = &w->queue[lane < w->queued ? lane : w->queued - 1];
        vd_interpolate(w->drawing, s->primitive,
                       (int32_t)(s->at % (uint32_t)w->size) * VD_SUBPIXELS,
                       (int32_t)(s->at / (uint32_t)w->size) * VD_SUBPIXELS, lane, &w->batch);
        w->batch.depth[lane] = s->depth;
    }
    vd_batch_run(w->drawing, vd_drawing_material(w->drawing, 0), (1u << w->queued) - 1, &w->batch);
    for (int lane = 0; lane < w->queued; lane++) {
        const sample *s = &w->queue[lane];
        if (w->compare && !(s->depth > w->out.depth[s->at])) {
            continue;
        }
        w->out.depth[s->at] = s->depth;
        for (int c = 0; c < 4; c++) {
            const uint32_t v = (uint32_t)(w->batch.color[c][lane] * 65535.0f + 0.5f);
            w->out.rgba[4 * (size_t)s->at + (size_t)c] = vd_round_16_to_8(v);
        }
    }
    w->shaded += (uint64_t)w->queued;
    w->queued = 0;
}

static void color(work *w, const sample *s) {
    w->queue[w->queued++] = *s;
    if (w->queued == VD_BATCH) {
        flush(w);
    }
}

/* ---- ways -------------------------------------------------------------------------------------*/

static void take_visibility(work *w, const sample *s) {
    if (s->depth > w->out.depth[s->at]) {
        w->out.depth[s->at] = s->depth;
        w->primitive[s->at] = s->primitive + 1;
    }
}

static void visibility(work *w) {
    w->take = take_visibility;
    fill_all(w);
    for (uint32_t at = 0; at < (uint32_t)(w->size * w->size); at++) {
        if (w->primitive[at] != 0) {
            color(w, &(sample){at, w->out.depth[at], w->primitive[at] - 1});
        }
    }
    flush(w);
}

static void tuples(work *w) {
    w->compare = true;
    w->take = color;
    fill_all(w);
    flush(w);
}

static void take_early(work *w, const sample *s) {
    if (s->depth > w->out.depth[s->at]) {
        color(w, s);
    }
}

static void tuples_early(work *w) {
    w->compare = true;
    w->take = take_early;
    fill_all(w);
    flush(w);
}

static void take_depth(work *w, const sample *s) {
    if (s->depth > w->out.depth[s->at]) {
        w->out.depth[s->at] = s->depth;
    }
}

static void take_list(work *w, const sample *s) {
    take_depth(w, s);
    if (w->list_count == w->list_room) {
        w->list_room = 2 * w->list_room + 4096;
        w->list = realloc(w->list, w->list_room * sizeof *w->list);
        if (w->list == NULL) {
            fail("out of memory");
        }
    }
    w->list[w->list_count++] = *s;
}

/* Of equal depths the first. */
static void take_equal(work *w, const sample *s) {
    if (s->depth == w->out.depth[s->at] && w->primitive[s->at] == 0) {
        w->primitive[s->at] = 1;
        color(w, s);
    }
}

static void search(work *w) {
    w->take = take_list;
    fill_all(w);
    for (size_t i = 0; i < w->list_count; i++) {
        take_equal(w, &w->list[i]);
    }
    flush(w);
}

static void search_again(work *w) {
    w->take = take_depth;
    fill_all(w);
    w->take = take_equal;
    w->covered = 0;
    fill_all(w);
    flush(w);
}

/* What a way keeps beside the picture, in bytes a pixel; the list comes on top. */
static const struct way {
    const char *name;
    void (*run)(work *w);
    size_t pixel_bytes;
} ways[] = {{"visibility", visibility, sizeof(uint32_t)},
            {"tuples", tuples, 0},
            {"tuples-early", tuples_early, 0},
            {"search", search, 1},
            {"search-again", search_again, 1}};

/* ---- the picture ------------------------------------------------------------------------------*/

static void run_once(work *w, const struct way *way) {
    const size_t pixels = (size_t)w->size * (size_t)w->size;
    w->list_count = 0;
    w->covered = w->shaded = 0;
    w->queued = 0;
    w->compare = false;
    memset(w->out.depth, 0, pixels * sizeof *w->out.depth);
    memset(w->primitive, 0, pixels * sizeof *w->primitive);
    for (size_t i = 0; i < pixels; i++) {
        memcpy(w->out.rgba + 4 * i, (const uint8_t[4]){0, 0, 0, 255}, 4);
    }
    way->run(w);
}

static uint64_t count_differing(const work *w, const vd_frame *frame) {
    uint64_t differing = 0;
    for (int y = 0; y < w->size; y++) {
        for (int x = 0; x < w->size; x++) {
            const size_t here = (size_t)y * (size_t)w->size + (size_t)x;
            const size_t there = (size_t)y * frame->stride + (size_t)x;
            differing += memcmp(w->out.rgba + 4 * here, frame->rgba + 4 * there, 4) != 0 ||
                         w->out.depth[here] != frame->depth[there];
        }
    }
    return differing;
}

static int compare_times(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

enum { MOST_RUNS = 200 };

static void measure(work *w, const struct way *way, const vd_frame *frame, int least_runs,
                    double seconds) {
    double times_ms[MOST_RUNS];
    int count = 0;
    run_once(w, way);
    const double end_ms = cpu_ms() + seconds * 1e3;
    while (count < MOST_RUNS && (count < least_runs || cpu_ms() < end_ms)) {
        const double start = cpu_ms();
        run_once(w, way);
        times_ms[count++] = cpu_ms() - start;
    }
    qsort(times_ms, (size_t)count, sizeof times_ms[0], compare_times);
    const size_t bytes =
        (size_t)w->size * (size_t)w->size * way->pixel_bytes + w->list_count * sizeof *w->list;
    printf("%s %.4f %.4f %zu %llu %llu %llu\n", way->name,
           (times_ms[(count - 1) / 2] + times_ms[count / 2]) / 2, times_ms[0], bytes,
           (unsigned long long)w->covered, (unsigned long long)w->shaded,
           (unsigned long long)count_differing(w, frame));
    fflush(stdout);
}

static void check(vd_status status) {
    if (status.code != VD_OK) {
        fail(status.message);
    }
}

/* As `veduta bench` looks: along −z, y up. */
static vd_camera make_camera(char **numbers, int size) {
    double n[6];
    for (int i = 0; i < 6; i++) {
        n[i] = atof(numbers[i]);
    }
    return (vd_camera){.eye = {n[0], n[1], n[2]},
                       .orientation = vd_quat_from_axes(
                           vd_vec3_make(1, 0, 0), vd_vec3_make(0, -1, 0), vd_vec3_make(0, 0, -1)),
                       .projection = VD_PROJECTION_ORTHOGRAPHIC,
                       .lens = {n[3], n[3], 0.5 * size, 0.5 * size},
                       .near_m = n[4],
                       .far_m = n[5]};
}

/* The vertices projected, and the picture that all ways must give. */
static void draw_frame(vd_context *context, const vd_mesh *mesh, char **argv, vd_raster **raster,
                       vd_frame **frame) {
    const int size = atoi(argv[2]);
    const vd_camera camera = make_camera(argv + 4, size);
    vd_draw draw = vd_draw_default();
    draw.mesh = mesh;
    draw.shader =
        vd_shader_find(strcmp(argv[3], "phong") == 0 ? VD_SHADING_PHONG : VD_SHADING_DEPTH);
    vd_raster_def def = vd_raster_def_default();
    def.background = (vd_rgba8){0, 0, 0, 255};
    check(vd_frame_create(context, size, size, VD_PLANE_DEPTH, frame));
    check(vd_raster_create(context, raster));
    check(vd_raster_render(*raster, NULL, &def, &camera, &draw, 1, *frame, NULL));
}

int main(int argc, char **argv) {
    if (argc != 12) {
        fail("takes MODEL.mesh SIZE depth|phong EYE_X EYE_Y EYE_Z SCALE NEAR FAR RUNS SECONDS");
    }
    mesh_file file;
    const int size = atoi(argv[2]);
    if (!mesh_file_read(argv[1], &file) || size < 1 || size > 8192) {
        fail("cannot read the model, or the size is impossible");
    }
    vd_context_def context_def = vd_context_def_default();
    context_def.threads = 1;
    vd_context *context = NULL;
    check(vd_context_create(&context_def, &context));
    vd_mesh_def mesh_def = vd_mesh_def_default();
    mesh_def.vertex_count = file.vertex_count;
    mesh_def.positions = file.positions;
    mesh_def.index_count = (size_t)file.triangle_count * 3;
    mesh_def.indices = file.indices;
    mesh_def.compute_normals = true;
    vd_mesh *mesh = NULL;
    vd_frame *frame = NULL;
    vd_raster *raster = NULL;
    check(vd_mesh_create(context, &mesh_def, &mesh));
    draw_frame(context, mesh, argv, &raster, &frame);
    const size_t pixels = (size_t)size * (size_t)size;
    work *w = room(1, sizeof *w);
    w->drawing = &raster->scene.drawings[0];
    w->window = (vd_visible){.width = size, .height = size, .samples = 1};
    w->size = size;
    w->out = (pictured){room(pixels, 4), room(pixels, sizeof(float))};
    w->primitive = room(pixels, sizeof *w->primitive);
    for (size_t i = 0; i < sizeof ways / sizeof ways[0]; i++) {
        measure(w, &ways[i], frame, atoi(argv[10]), atof(argv[11]));
    }
    free(w->out.rgba);
    free(w->out.depth);
    free(w->primitive);
    free(w->list);
    free(w);
    vd_raster_destroy(&raster);
    vd_frame_destroy(&frame);
    vd_mesh_destroy(context, &mesh);
    vd_context_destroy(&context);
    free(file.positions);
    free(file.indices);
    return 0;
}

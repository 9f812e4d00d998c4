/* bench_raster.h: what the parts of the triangle bench share: models, views of them, the peer. */
#ifndef VEDUTA_APP_BENCH_RASTER_H
#define VEDUTA_APP_BENCH_RASTER_H

#include "bench.h"

/* A published model, as script/bench-models leaves it. */
typedef struct bench_model {
    const char *name;
    char path[512];
    uint32_t vertex_count, triangle_count;
    float *positions;  /* [vertex_count][3] */
    uint32_t *indices; /* [triangle_count][3] */
} bench_model;

/* Returns the name of model `index`, null past the last. */
const char *bench_model_name(int index);

/* Returns that very name, which stays; null when no model has it. */
const char *bench_model_named(const char *name);

/* Reads NAME.mesh from the folder that the environment's VEDUTA_BENCH_MODELS names, build/models if
 * it does not. False, with a sentence on standard error, when it is not there. */
bool bench_model_read(const char *name, bench_model *m);
void bench_model_free(bench_model *m);

/* One picture of a model: parallel projection along −z, the model as large as fits. */
typedef struct bench_view {
    vd_context *context;
    vd_mesh *mesh;
    vd_raster *raster;
    vd_frame *frame;
    vd_camera camera;
    vd_draw draw;
    vd_raster_def def;
} bench_view;

/* Of `percent` of the model's triangles, taken evenly from all of them, and the vertices they use.
 */
VD_MUST_USE vd_status bench_view_init(bench_view *v, const bench_model *m, int percent, int size,
                                      vd_isa isa, int threads);
void bench_view_finish(bench_view *v);

/* Measures the view by its def and shader, by a renderer of its own (so that the memory is this
 * method's alone), fills in everything but `at`, `picture`, `fine` and the note, and adds the
 * result. `result` comes from bench_result_of. */
VD_MUST_USE vd_status bench_view_measure(bench_run *run, bench_view *v, const bench_model *m,
                                         bench_result *result);

/* Sets how long one thing is measured, so that all triangle cases together end in ten minutes. */
void bench_raster_limits(bench_run *run);

/* ---- other programs ---------------------------------------------------------------------------*/

/* Writes the path of a program beside this one, in quotes for the shell. False when it is not there
 * or cannot be quoted. */
bool bench_program_beside(const char *name, char *out, size_t bytes);

/* Measures the view by Mesa's llvmpipe (the program veduta-llvmpipe) and adds a row to *result;
 * `picture`, when not null, is a file that gets its pixels, 8-bit RGBA. False where there is no
 * llvmpipe; why is said on standard error, once. */
bool bench_peer_measure(bench_run *run, const bench_view *v, const bench_model *m,
                        const char *shading, const char *picture, bench_result *result);

/* One sentence on how the pixels in the file and the view's frame differ. */
void bench_peer_compare(const bench_view *v, const char *picture, char *note, size_t bytes);

/* ---- means ------------------------------------------------------------------------------------*/

/* A method of one thread count and SIMD level over all its cells. */
typedef struct bench_mean {
    const bench_result *first; /* its method, threads, level */
    int cells;                 /* beside llvmpipe */
    double vs_peer;            /* geometric mean; NaN without cells */
    const bench_result *worst; /* the least of them */
    double speed_up;           /* geometric mean against one thread; NaN where not measured */
    double most_memory;        /* peak bytes over the output's, the worst of 8192²; NaN without */
} bench_mean;

/* Returns how many means of MODEL-SIZE cells were written to out[most]. */
#define BENCH_MOST_MEANS 128
int bench_means(const bench_run *run, bench_mean *out, int most);

void bench_print_means(const bench_run *run, FILE *out);

/* Draws DIR/raster-*.svg of what there is. */
VD_MUST_USE vd_status bench_plot_raster(const bench_run *run, const char *folder);

#endif

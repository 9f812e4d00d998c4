/* bench.h: what the parts of `veduta bench` share.
 *
 * A case measures one thing in several ways (methods × threads × SIMD levels) and adds a result for
 * each; a sweep does so at every value of one parameter. Every result that draws carries the
 * picture's hash: a time says nothing when the picture is wrong. All cases stand in one table,
 * bench_cases.c: a new one is a line there.
 */
#ifndef VEDUTA_APP_BENCH_H
#define VEDUTA_APP_BENCH_H

#include <stdbool.h>
#include <stdio.h>
#include <veduta/veduta.h>

#define BENCH_MAX_RESULTS 4096
#define BENCH_MAX_THREADS 16

typedef struct bench_case bench_case;

/* One line of the table and one object of the JSON's `results`. */
typedef struct bench_result {
    const bench_case *of;
    char method[32];
    double at; /* the value of a sweep's parameter; NaN elsewhere */
    int threads;
    vd_isa isa;
    int width, height; /* 0, 0 where there is no picture */
    double median_ms, p99_ms, min_ms;
    double target_fps; /* of docs/performance.md, for this row's SIMD level; 0: none */
    size_t peak_bytes; /* most held by the context at once, map and frame included; 0 for programs:
                          the child's size would count this process' own */
    size_t peak_resident_bytes; /* most resident memory of the process; 0: not measured */
    size_t output_bytes;        /* of the picture with its depths, or packed; 0: not looked at */
    bool has_hash;
    uint64_t hash;
    bool reference;    /* what the others of its case, SIMD level and parameter are compared with */
    bool same_picture; /* its hash must be that of the first such one with the same `picture` */
    int picture;       /* where a case has several, which */
    const char *model; /* of triangles; null elsewhere */
    int fine;          /* side of a bin's fine tiles; 0: as the method has it */
    uint64_t fragments, shaded; /* of ways to resolve depth: covered samples, coloured ones */
    double vs_peer;             /* how many times as fast as llvmpipe; NaN where not compared */
    double limited_ms[3];       /* of codecs: a picture over 1, 10, 100 MB/s; 0 elsewhere */
    bool published;             /* somebody else's figure: only median_ms and note hold */
    char note[96];
} bench_result;

typedef struct bench_run {
    int threads[BENCH_MAX_THREADS];
    int thread_count;
    vd_isa isas[VD_ISA_COUNT];
    int isa_count;
    int repeat;     /* measured runs; 0: as many as fit into `seconds`, at least `least_runs` */
    double seconds; /* for the runs of one thing */
    int least_runs;
    double most_seconds; /* after these no further run of the thing begins */
    size_t particles;    /* of impostor-grain; 0: as it has them */
    bool quick;          /* small sizes only: to try the bench itself */
    bool quiet;          /* no progress on standard error */
    const char *map;     /* "mont-blanc", "mirrored", "noise" or a picture file of heights */
    bench_result results[BENCH_MAX_RESULTS];
    int result_count;
    char peer_missing[160]; /* why llvmpipe is left out, as it was said */
} bench_run;

/* ---- cases ------------------------------------------------------------------------------------*/

typedef vd_status bench_function(bench_run *run, const bench_case *self);

/* A figure that others published for the same scene. */
typedef struct bench_published {
    const char *method, *note;
    double fps;
} bench_published;

/* Where the lens cases stand and look. Metres and degrees in the world of data/mont-blanc.png,
 * whose x is 75 m × column and whose y is −75 m × row. */
typedef struct bench_camera {
    double x, y, z, heading, pitch, fov_y;
} bench_camera;

/* What a sweep varies. */
typedef enum bench_parameter {
    BENCH_DISTANCE = 0,  /* of a classic picture of 10 × 10 pixels, steps growing by 0.005 */
    BENCH_WIDTH,         /* of one 10 pixels high, distance 10 */
    BENCH_HEIGHT,        /* of one 10 pixels wide, distance 10 */
    BENCH_MAP,           /* side of the map under the published scene */
    BENCH_SHADOW_ROWS,   /* q: rows of a map 128 wide, 32 steps */
    BENCH_SHADOW_STEPS,  /* d_c: steps on a map of 128² */
    BENCH_QUAD_SIDE,     /* pixels along a quad */
    BENCH_CODEC_SIDE,    /* pixels along a packed picture */
    BENCH_MESSAGE_BYTES, /* of a message over loopback */
    BENCH_GRAIN,         /* the most particles of an object */
    BENCH_SORT_LENGTH,   /* particles of a list that is sorted; many such lists */
    BENCH_SHADOW_SUN     /* altitude of the sun over a map of 1024², worst of 8 azimuths */
} bench_parameter;

typedef struct bench_sweep {
    bench_parameter parameter;
    const char *title, *axis; /* of the plot */
    bool linear;              /* the axis; otherwise logarithmic */
    int count;
    double values[8];
} bench_sweep;

struct bench_case {
    const char *name, *help;
    bench_function *function;
    int width, rows;                  /* of the picture */
    double eye, growth;               /* classic: height of the eye, growth of the steps */
    unsigned methods;                 /* classic: bit 1 << method of those beside `reference` */
    bool bilinear;                    /* classic: heights and colours between the samples */
    int map_side;                     /* 0: as it comes */
    const bench_camera *camera;       /* lens */
    const bench_sweep *sweep;         /* null: not a sweep */
    const bench_published *published; /* ends with a null method */
    double target_fps;                /* at v4 with two threads; 0: none */
};

/* A name for several cases. */
typedef struct bench_group {
    const char *name, *help;
    const char *members; /* names of cases and groups, separated by spaces */
} bench_group;

/* Returns case or group `index`, null past the last. */
const bench_case *bench_case_at(int index);
const bench_group *bench_group_at(int index);

bench_function bench_classic, bench_lens, bench_endless, bench_png, bench_startup, bench_cold,
    bench_memory, bench_bricks, bench_formula, bench_sharing, bench_counters, bench_raster,
    bench_raster_levels, bench_raster_triangles, bench_raster_bins, bench_raster_small,
    bench_raster_tiles, bench_raster_resolve, bench_splat, bench_splat_sort, bench_coverage,
    bench_sweep_classic, bench_sweep_shadow, bench_world, bench_quads, bench_quad_sides,
    bench_codec_tree, bench_codec_building, bench_codec_particles, bench_impostor_decide,
    bench_impostor_grain, bench_impostor_extremes, bench_impostor_path, bench_impostor_window,
    bench_remote, bench_remote_cloud, bench_remote_answer, bench_remote_clients,
    bench_remote_messages;

/* ---- measuring --------------------------------------------------------------------------------*/

/* The thing measured. */
typedef vd_status bench_work(void *user);

/* A clock, in milliseconds: of the wall, of this process' processor time, of its children's. */
typedef double bench_clock(void);
bench_clock bench_wall_ms, bench_cpu_ms, bench_children_cpu_ms;

/* Runs `work` once to warm up, then several times, and fills the times of *result. Says on standard
 * error what runs. */
VD_MUST_USE vd_status bench_measure(bench_run *run, bench_work *work, void *user,
                                    bench_clock *clock_ms, bench_result *result);

/* Fills the times of *result from `runs` measured ones, which it sorts. */
void bench_summarize(double *times_ms, int runs, bench_result *result);

/* Says on standard error what runs. */
void bench_say(const bench_run *run, const bench_result *result);

/* Adds a result. Returns VD_ERROR_LIMIT when the table is full. */
VD_MUST_USE vd_status bench_add(bench_run *run, const bench_result *result);

/* How many of a sweep's values this run measures. */
int bench_sweep_points(const bench_run *run, const bench_sweep *sweep);

/* Adds the case's published figures. */
VD_MUST_USE vd_status bench_add_published(bench_run *run, const bench_case *self);

/* Returns a result of a case with nothing measured yet. */
bench_result bench_result_of(const bench_case *self, const char *method);

/* Returns the case's target for a SIMD level and number of threads, 0 where it has none: on v3 half
 * of v4's, on v2 a fifth. */
double bench_target_fps(const bench_case *self, vd_isa isa, int threads);

/* The result that this one is compared with, null when there is none. */
const bench_result *bench_reference_of(const bench_run *run, const bench_result *result);

/* ---- scenes -----------------------------------------------------------------------------------*/

/* What a picture case works on: made anew for every SIMD level and thread count. */
typedef struct bench_scene {
    vd_context *context;
    vd_heightfield *map;
    vd_function *function; /* drawn in place of the map, or null */
    vd_frame *frame;
    vd_classic_def classic;
    vd_classic_method method;
    vd_classic_renderer *renderer; /* of the march, made when its turn comes */
    vd_terrain_def terrain;
    vd_terrain_renderer *terrain_renderer; /* of `terrain`, made anew for every method */
    vd_camera camera;
    vd_png_def png;
    vd_colormap colormap;
    char path[96];
} bench_scene;

/* How a scene's map is made. */
typedef enum bench_map_kind {
    BENCH_MAP_CLASSIC = 0, /* heights of 8 or 16 bits; wraps */
    BENCH_MAP_FLOAT,       /* the same as float, ends at its edge */
    BENCH_MAP_METRES       /* data/mont-blanc.png, 75 m: 657 × 544 float heights in metres */
} bench_map_kind;

/* Makes the map of --map at a size: sides of 0 keep its own; a larger map holds the same terrain
 * again and again, so that a wrapping one shows the same picture, to the byte; a smaller one takes
 * every n-th sample. Colours by height. */
VD_MUST_USE vd_status bench_map_create(vd_context *context, const char *map, bench_map_kind kind,
                                       int width, int height, vd_heightfield **out);

VD_MUST_USE vd_status bench_scene_init(bench_scene *s, const bench_run *run, bench_map_kind kind,
                                       int map_side, vd_isa isa, int threads, int width,
                                       int height);
void bench_scene_finish(bench_scene *s);

/* Measures one way to draw a scene and adds the result. */
VD_MUST_USE vd_status bench_picture(bench_run *run, bench_scene *s, bench_work *work,
                                    bench_result *result);

/* bench_work on a bench_scene: its classic def by its method, its terrain def; by renderers that
 * are kept from picture to picture. Made at the first picture. */
bench_work bench_draw_classic, bench_draw_terrain;

/* The lens cases' view of the bench's own map, one sample a pixel. */
void bench_set_lens_view(bench_scene *s);

/* A case's camera; everything that the renderer of terrain has, on. */
void bench_set_camera(bench_scene *s, const bench_camera *camera);
void bench_set_everything(bench_scene *s);

/* Measures the classic picture of a scene by one method; `result` comes from bench_result_of. */
VD_MUST_USE vd_status bench_classic_method(bench_run *run, bench_scene *s, vd_classic_method method,
                                           bench_result *result);

/* ---- what comes out ---------------------------------------------------------------------------*/

void bench_print_table(const bench_run *run, FILE *out);
VD_MUST_USE vd_status bench_write_json(const bench_run *run, const char *path);

/* Every result that says so must have its case's picture. Returns VD_ERROR_FORMAT. */
VD_MUST_USE vd_status bench_check_pictures(const bench_run *run);

/* Sees that gnuplot is there and makes the folder; before anything is measured. */
VD_MUST_USE vd_status bench_plot_prepare(const char *folder);

/* Writes FOLDER/NAME.svg for every sweep among the results. */
VD_MUST_USE vd_status bench_plot(const bench_run *run, const char *folder);

/* Runs a gnuplot script into FOLDER/NAME.svg. */
VD_MUST_USE vd_status bench_gnuplot(FILE *script, const char *folder, const char *name);

#endif

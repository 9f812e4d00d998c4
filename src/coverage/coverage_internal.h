/* coverage_internal.h: what the files of this room share.
 *
 *   layers ─ check ─► batches of some thousand layers, in order; of each
 *     trace    (chunks of layers, parallel)   transform, flatten, stroke ─► segments
 *     edges    clipped to the window, cut at bands of 32 rows ─► list [chunk][band]
 *     rows     (bands, parallel)  lists in the order of chunks ─► areas ─► spans ─► pixels
 *
 * One band has one writer, and its lists come in the order of the layers: the painter's order holds
 * whatever the number of threads.
 *
 * Positions are whole numbers of 2^-20 pixel ("units") relative to the window, kept in double,
 * which holds them exactly; an edge's x at a given y is rounded to units too, by one formula that
 * does not depend on where the edge is cut. So neighbours that share an edge agree on it, moving a
 * picture by whole pixels changes no byte, and areas, whole numbers of 2^-24, add up in any order.
 */
#ifndef VEDUTA_COVERAGE_COVERAGE_INTERNAL_H
#define VEDUTA_COVERAGE_COVERAGE_INTERNAL_H

#include <stdatomic.h>
#include <veduta/coverage.h>
#include "core/buffer.h"
#include "core/core.h"
#include "coverage/coverage_kernels.h"

#define VD_UNIT_BITS 20
#define VD_UNITS (1 << VD_UNIT_BITS) /* in a pixel */
#define VD_AREA_BITS 24
#define VD_BAND_ROWS 32
#define VD_MOST_PIXELS ((double)(1 << 29)) /* how far from the origin a position may be */

/* A fill of at most so many columns and rows and corners that is convex is summed in one piece,
 * band by band. */
#define VD_SMALL_PIXELS 62
#define VD_SMALL_STRIDE (VD_SMALL_PIXELS + 2)
#define VD_SMALL_CORNERS 32

/* The nearest whole number, of two the even one; |v| < 2^51. */
static inline double vd_snap(double v) {
    return v + 0x1.8p52 - 0x1.8p52;
}

/* ---- edges ----------------------------------------------------------------------------------- */

enum {
    VD_EDGE_SECOND = 1, /* counts for the second winding number: of a fill's expansion */
    VD_EDGE_LEFT = 2,   /* left of the window: stands at x = 0 */
    VD_EDGE_LEVEL = 4,  /* horizontal, from x to x + slope: encloses nothing, but connects */
    VD_EDGE_SMALL = 8   /* not an edge, but a vd_small */
};

/* What lists hold begins so. */
typedef struct vd_record {
    uint32_t shape;
    uint8_t kind;
    int8_t sign; /* edges: +1: the path goes down here, −1: up; small shapes: on their left */
    uint8_t corner_count, width; /* small shapes; of columns */
} vd_record;

/* The part within one band of a line that goes down. y, top and bottom from the band's top. */
typedef struct vd_edge {
    vd_record record;
    int32_t top, bottom; /* 0 … 32 pixels */
    double x, y;         /* a point of the line, perhaps far outside */
    double slope;        /* dx / dy */
} vd_edge;

static inline double vd_edge_at(const vd_edge *edge, int32_t y) {
    return edge->x + vd_snap(((double)y - edge->y) * edge->slope);
}

/* A corner of a small shape, units from its pixel's. */
typedef struct vd_corner {
    int32_t x, y;
} vd_corner;

/* A small shape: what drawing it takes, as it stands in its lists. */
typedef struct vd_small {
    vd_record record;
    uint16_t column, row; /* the pixel that the corners are relative to */
    uint16_t height;      /* rows */
    uint16_t unused;
    uint16_t color[4];
    vd_corner corners[VD_SMALL_CORNERS]; /* as many as there are */
} vd_small;

#define VD_BLOCK_BYTES 1008

/* A piece of a list: records one behind the other. */
typedef struct vd_edge_block {
    uint32_t next, used; /* bytes */
    uint64_t bytes[VD_BLOCK_BYTES / 8];
} vd_edge_block;

/* The records of one chunk of layers in one band: those of a shape one behind the other. */
typedef struct vd_edge_list {
    uint32_t first, last; /* blocks */
    uint32_t used;        /* bytes of the last one; 0: the list is empty */
    uint32_t edges;
} vd_edge_list;

/* One layer's fill or stroke: what drawing needs of the layer. Layers are large, and a million of
 * them are in no cache. */
typedef struct vd_shape {
    uint16_t color[4];
    uint8_t rule; /* vd_fill_rule */
} vd_shape;

/* A span, and what fills it without a shader. */
typedef struct vd_colored_span {
    vd_span span;
    const uint16_t *color;
} vd_colored_span;

/* ---- tracing --------------------------------------------------------------------------------- */

typedef struct vd_points {
    double (*at)[2];
    size_t count, capacity;
} vd_points;

/* Picture pixels; empty while min > max. */
typedef struct vd_box {
    double min_x, min_y, max_x, max_y;
} vd_box;

struct vd_rows;

/* Memory of a thread. */
typedef struct vd_coverage_worker {
    vd_box box; /* of the layers that it checked */
    vd_points line, dash;
    struct vd_rows *rows;
} vd_coverage_worker;

/* Takes a path apart into segments. With `segments` they are kept as they are, for the reference;
 * else they become edges in `lists`. */
typedef struct vd_tracer {
    struct vd_coverage *coverage;
    vd_coverage_worker *worker;
    vd_edge_list *lists;          /* [bands] of the chunk */
    vd_points *segments, *second; /* pairs of points; of a fill's expansion */
    int x, y;                     /* the window's corner, pixels */
    double width, height;         /* of the window, units */
    double tolerance;             /* units */
    double margin;                /* how far outside the window a line may still be seen */
    uint32_t shape;
    uint8_t kind; /* VD_EDGE_SECOND or 0 */
    bool out_of_memory;
} vd_tracer;

typedef struct vd_coverage_run vd_coverage_run;

/* A tracer into the window of a call; the caller sets lists or segments. */
void vd_tracer_init(vd_tracer *t, const vd_coverage_run *run, vd_coverage_worker *worker);

/* Rounds to units, but not for the reference. */
static inline double vd_trace_round(const vd_tracer *t, double v) {
    return t->segments != NULL ? v : vd_snap(v);
}

/* How far a stroke may reach from its line, pixels: half a width, times how far a corner or a
 * square end may stick out. */
static inline double vd_stroke_margin(const vd_stroke *stroke) {
    return 0.5 * stroke->width * (stroke->miter_limit == 0 ? 4 : stroke->miter_limit + 1);
}

/* Traces a layer's fill or stroke. */
void vd_trace_layer(vd_tracer *t, const vd_layer *layer, bool stroke, vd_shape *shape);

/* Strokes a polyline without equal neighbours. */
void vd_trace_stroke(vd_tracer *t, const vd_stroke *stroke, const double (*p)[2], size_t count,
                     bool closed);

/* Cuts a polyline into dashes and strokes them. */
void vd_trace_dashes(vd_tracer *t, const vd_stroke *stroke, const double (*p)[2], size_t count,
                     bool closed);

/* Adds a point; false, with t->out_of_memory set, when there is no memory. */
bool vd_trace_push(vd_tracer *t, vd_points *points, double x, double y);

/* Adds a small shape. */
void vd_trace_small(vd_tracer *t, const vd_small *small);

/* Adds a segment. */
void vd_trace_segment(vd_tracer *t, double x0, double y0, double x1, double y1);

/* ---- the rasterizer -------------------------------------------------------------------------- */

struct vd_coverage {
    vd_context *context;
    const vd_coverage_kernels *kernels;
    int thread_count;
    vd_coverage_worker *workers;

    vd_buffer block_memory, list_memory, shape_memory;
    vd_buffer canvas_memory; /* what a frame is drawn in: uint16_t [rows][columns][4] */
    vd_edge_block *blocks;
    size_t block_capacity;
    _Atomic uint32_t block_count; /* asked for; beyond the capacity none is given */
    vd_edge_list *lists;          /* [chunks][bands] */
    vd_shape *shapes;             /* [2 · layers of a batch] */
};

/* One call's. */
struct vd_coverage_run {
    vd_coverage *coverage;
    vd_job *job;
    vd_coverage_def def;
    const vd_layer *layers;
    size_t count;
    int x, y, width, height; /* the window */
    int bands;
    size_t first, batch_count; /* the batch */
    vd_span_function *function;
    void *user;        /* of the function */
    vd_target *target; /* what the function blends into, or null: a hint */
};

/* Draws a band's lists of the batch. */
void vd_rows_band(const vd_coverage_run *run, int chunks, int band, int worker);

/* Makes sure that all workers have memory for shapes of so many edges in a band, and rows so wide.
 */
VD_MUST_USE vd_status vd_rows_reserve(vd_coverage *coverage, size_t edges, size_t columns);
void vd_rows_release(vd_coverage *coverage);

/* Draws all layers by the reference. */
VD_MUST_USE vd_status vd_coverage_reference(vd_coverage_run *run);

#endif

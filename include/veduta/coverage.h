/* coverage.h: vector paths with exact edges: polygons, curves and strokes.
 *
 * A layer is a path with a fill, a stroke or both; layers are drawn in their order, each over what
 * is there. A pixel's coverage is the exact share of its area that lies inside (a box filter of one
 * pixel; Duff 1989, Lawlor 2004 §6.1.2): holes, self-intersections and both fill rules included.
 *
 *     const double corners[3][2] = {{10, 10}, {90, 30}, {40, 80}};
 *     vd_layer layer = vd_layer_default();
 *     layer.path.points = corners;
 *     layer.path.point_count = 3;
 *     status = vd_coverage_draw_frame(coverage, NULL, NULL, &layer, 1, frame);
 *
 * Positions are in picture pixels after the layer's transform: x to the right, y down, pixel (i, j)
 * is the square from (i, j) to (i + 1, j + 1). Colours are encoded, premultiplied, 65535 = 1, as in
 * a target; blending is "over" in encoded space. The pictures are the same bytes whatever the
 * number of threads and the SIMD level. docs/coverage.md has the method, its bound and figures.
 */
#ifndef VEDUTA_COVERAGE_H
#define VEDUTA_COVERAGE_H

#include <stdbool.h>
#include <veduta/job.h>
#include <veduta/target.h>

VD_BEGIN_DECLARATIONS

/* ---- paths ---------------------------------------------------------------------------------- */

typedef enum vd_path_verb {
    VD_PATH_MOVE = 0,  /* 1 point: starts a subpath */
    VD_PATH_LINE,      /* 1 point */
    VD_PATH_QUADRATIC, /* 2 points: control, end */
    VD_PATH_CUBIC,     /* 3 points: control, control, end */
    VD_PATH_CLOSE,     /* no point: a line to the subpath's start; joined there when stroked */
    VD_PATH_VERB_COUNT
} vd_path_verb;

/* Borrowed arrays. With verbs, the first must be VD_PATH_MOVE and their points must be as many as
 * there are; a fill closes every subpath by itself. Without verbs the points are the corners of one
 * polygon, or of a polyline if `open`. */
typedef struct vd_path {
    const double (*points)[2]; /* [point_count], x and y */
    size_t point_count;
    const uint8_t *verbs; /* [verb_count] of vd_path_verb, or null */
    size_t verb_count;
    bool open;
} vd_path;

/* x' = xx·x + xy·y + x0, y' = yx·x + yy·y + y0 */
typedef struct vd_affine {
    double xx, xy, x0, yx, yy, y0;
} vd_affine;

typedef enum vd_fill_rule {
    VD_FILL_RULE_NON_ZERO = 0, /* inside where the path winds around at all */
    VD_FILL_RULE_EVEN_ODD,     /* inside where it does so an odd number of times */
    VD_FILL_RULE_COUNT
} vd_fill_rule;

typedef enum vd_join { VD_JOIN_MITER = 0, VD_JOIN_ROUND, VD_JOIN_BEVEL, VD_JOIN_COUNT } vd_join;

typedef enum vd_cap { VD_CAP_BUTT = 0, VD_CAP_ROUND, VD_CAP_SQUARE, VD_CAP_COUNT } vd_cap;

#define VD_MAX_DASHES 16

/* A line along the path. A subpath of one point drawn twice is a dot, where the cap is one. */
typedef struct vd_stroke {
    double width; /* picture pixels, above 0, at most 65536; not scaled by the layer's transform */
    vd_join join;
    vd_cap cap;
    double miter_limit; /* 0: 4. A miter longer than this many widths becomes a bevel; 1 … 64 */
    double dashes[VD_MAX_DASHES]; /* lengths drawn and left out in turn, picture pixels */
    int dash_count;               /* even; 0: solid. All of them together at least 1/16 pixel */
    double dash_offset;           /* how far into the dashes each subpath begins */
    uint16_t color[4];
} vd_stroke;

/* A width of 1, miter joins, butt caps, opaque black. */
VD_API vd_stroke vd_stroke_default(void);

typedef struct vd_layer {
    vd_path path;
    vd_affine picture_from_path;
    vd_fill_rule rule;
    bool filled;
    uint16_t fill[4];
    /* The fill is grown by so many pixels on all sides, 0 … 16. Neighbouring polygons that are
     * drawn one over the other let the background through along their common edge, a quarter of it
     * at the worst. With ½ every pixel on an upright or level edge is wholly covered by one of the
     * two, with √½ every pixel on any edge; each polygon's outer edge moves by as much. Where the
     * background is known, vd_coverage_divide does better. */
    double expand;
    const vd_stroke *stroke; /* drawn over the fill; null: none */
} vd_layer;

/* Filled with opaque black by the non-zero rule, identity transform, no stroke, an empty path. */
VD_API vd_layer vd_layer_default(void);

/* ---- drawing -------------------------------------------------------------------------------- */

typedef enum vd_coverage_method {
    VD_COVERAGE_ROWS = 0,  /* signed areas, row by row */
    VD_COVERAGE_REFERENCE, /* every shape clipped to every pixel in double; one thread; slow */
    VD_COVERAGE_METHOD_COUNT
} vd_coverage_method;

/* Returns "rows" or "reference"; "unknown" for a value outside the enumeration. */
VD_API const char *vd_coverage_method_name(vd_coverage_method method);

typedef struct vd_coverage_def {
    vd_coverage_method method;
    double tolerance; /* 0: 1/64 pixel. Farthest that the lines of a curve or a round join may be
                         from it; a curve becomes at most 4096 lines */
} vd_coverage_def;

VD_API vd_coverage_def vd_coverage_def_default(void);

/* The working memory of a rasterizer, kept from picture to picture. One call at a time. */
typedef struct vd_coverage vd_coverage;

/* Returns VD_ERROR_MEMORY. */
VD_API VD_MUST_USE vd_status vd_coverage_create(vd_context *context, vd_coverage **out);
VD_API void vd_coverage_destroy(vd_coverage **coverage);

/* Draws `count` layers over the colours of a target's window, all samples of a pixel alike; depth
 * and id are neither tested nor written. `def` and `job` may be null. A second picture like the
 * first allocates nothing.
 *
 * With VD_COVERAGE_ROWS coverage differs from the true area by less than 16/65535 = 1/4096 as long
 * as no pixel holds more than 64 pixels' length of outline: positions are rounded to 2⁻²⁰ pixel,
 * areas to 2⁻²⁴, and the result to 1/65535. Windows of one picture that are drawn one by one agree
 * to 1/65535. Cost: what is outside the picture is passed over; a row's cost is its edges', sorted,
 * plus its edges' crossings, plus the pixels inside.
 *
 * Returns VD_ERROR_ARGUMENT (a null pointer, an impossible path or field, a position that is not
 * finite: the sentence names layer and field), VD_ERROR_LIMIT (a position farther than 2²⁹ pixels
 * after the transform), VD_ERROR_MEMORY, VD_ERROR_CANCELLED. But for the last nothing is drawn
 * then. */
VD_API VD_MUST_USE vd_status vd_coverage_draw(vd_coverage *coverage, vd_job *job,
                                              const vd_coverage_def *def, const vd_layer *layers,
                                              size_t count, vd_target *target);

/* The same over a frame's colours. Blends in 16 bits and rounds once at the end; pixels that no
 * layer's bounding box touches are left alone. */
VD_API VD_MUST_USE vd_status vd_coverage_draw_frame(vd_coverage *coverage, vd_job *job,
                                                    const vd_coverage_def *def,
                                                    const vd_layer *layers, size_t count,
                                                    vd_frame *frame);

/* After neighbouring polygons were drawn over a transparent target: takes out what is left of the
 * background where they meet, by dividing colour and alpha by alpha. Every pixel that is not wholly
 * transparent becomes opaque, those of the outermost edge too (Lawlor 2004 §6.1.2). */
VD_API void vd_coverage_divide(vd_target *target);

/* ---- spans ---------------------------------------------------------------------------------- */

/* Pixels of one row that a shape covers. */
typedef struct vd_span {
    int x, y, count;          /* picture pixels */
    const uint16_t *coverage; /* [count], 65535 = wholly covered; null: all are */
    size_t layer;             /* which of the layers */
    bool stroke;              /* its stroke, not its fill */
    int worker;               /* below the context's threads: two spans at once have different */
} vd_span;

typedef void vd_span_function(void *user, const vd_span *span);

/* Calls `function` for the spans of the layers within a window of the picture, in place of blending
 * their colours: any shader fills them. Spans of one row come in the order of the layers, and from
 * left to right within a fill or stroke; different rows may come from several threads at once.
 * Returns as vd_coverage_draw; VD_ERROR_ARGUMENT also for a window without pixels. */
VD_API VD_MUST_USE vd_status vd_coverage_spans(vd_coverage *coverage, vd_job *job,
                                               const vd_coverage_def *def, const vd_layer *layers,
                                               size_t count, int x, int y, int width, int height,
                                               vd_span_function *function, void *user);

/* Blends a colour over `pixels` ([span->count][4], the span's first pixel first) by a span's
 * coverage: s = color·coverage, pixels = s + pixels·(1 − s.alpha), each product rounded to nearest
 * and the sum cut at 65535. */
VD_API void vd_coverage_blend(const vd_coverage *coverage, const vd_span *span,
                              const uint16_t color[4], uint16_t *pixels);

/* The same with a colour of its own for every pixel: `colors` is [span->count][4]. */
VD_API void vd_coverage_blend_colors(const vd_coverage *coverage, const vd_span *span,
                                     const uint16_t (*colors)[4], uint16_t *pixels);

VD_END_DECLARATIONS

#endif

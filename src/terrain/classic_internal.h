/* classic_internal.h: what the methods of the classic picture share.
 *
 * The definition is in <veduta/classic.h>. Here it is cut into the pieces that every method puts
 * together in its own order: the walk through the slices, the cell under a sample point, the row it
 * projects to, the run of pixels it paints; and the two monoids of the scan method. Everything that
 * runs per sample is inline and takes the height type as a constant, so that no method pays for a
 * call or a switch that another one does not.
 */
#ifndef VEDUTA_TERRAIN_CLASSIC_INTERNAL_H
#define VEDUTA_TERRAIN_CLASSIC_INTERNAL_H

#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <veduta/classic.h>

/* Columns that share a cache line of the frame (16 pixels of 4 bytes): the smallest piece that two
 * threads can draw at once without writing to the same line. */
#define VD_CLASSIC_BLOCK 16

/* The bodies that take the height type as a constant. Left to itself gcc keeps one copy for all
 * types, with the switch inside the innermost loop, which costs a tenth. */
#define VD_CLASSIC_INLINE static inline __attribute__((always_inline))

/* A level of the map: what is read from a slice on that is far enough. Level 0 is the map itself.
 */
#define VD_CLASSIC_MAX_LEVELS 16

typedef struct vd_classic_level {
    const void *heights; /* [height][height_stride] */
    size_t height_stride;
    const vd_rgba8 *colors; /* [height][color_stride] */
    size_t color_stride;
    int width, height;
    int x_mask, y_mask; /* size − 1 where it is a power of two, else −1 */
    float scale;        /* 2^−level */
} vd_classic_level;

/* The levels of a map (classic_mip.c). */
typedef struct vd_classic_mips {
    vd_classic_level levels[VD_CLASSIC_MAX_LEVELS];
    int count;
    void *memory; /* of the levels above 0, or null */
} vd_classic_mips;

/* A def that has been checked and rounded, with the map and the frame it is drawn from and into. */
typedef struct vd_classic_setup {
    vd_context *context;
    vd_job *job; /* may be null */
    const vd_heightfield *map;
    vd_frame *frame;
    uint32_t background; /* opaque, as it stands in the frame */
    vd_height_type height_type;
    const void *heights; /* [map_height][height_stride] */
    size_t height_stride;
    const vd_rgba8 *colors; /* [map_height][color_stride] */
    size_t color_stride;
    int map_width, map_height;
    int x_mask, y_mask;       /* size − 1 where it is a power of two, else −1 */
    const float *direction_x; /* [width] d_i */
    const float *direction_y;
    float eye_x, eye_y, eye_height, horizon, scale;
    float z0, step;                      /* the constant schedule, in float */
    double z0_exact, step_exact, growth; /* the growing schedule, in double */
    uint32_t slice_count;
    bool linear, smooth;
    bool plain;                     /* no option but samples: level 0, nearest, flat */
    const vd_classic_level *levels; /* [level_count] */
    int level_count;                /* 1 without mip */
    float footprint;                /* samples of the map a column and unit of z */
} vd_classic_setup;

/* ---- the slices --------------------------------------------------------------------------------
 * A generator, not an array: 2^31 slices would take 8 GiB, and a slice costs one addition. */
typedef struct vd_classic_slice {
    uint32_t k;
    float z;
    float rise; /* scale / z: pixels of height per unit of height */
    double z_exact, step_exact;
    int level; /* of the map */
} vd_classic_slice;

/* Returns the level that a slice at z reads, not below `from`. */
static inline int vd_classic_level_at(const vd_classic_setup *setup, float z, int from) {
    while (from + 1 < setup->level_count && !((float)(1 << from) >= z * setup->footprint)) {
        from++;
    }
    return from;
}

static inline vd_classic_slice vd_classic_slice_first(const vd_classic_setup *setup) {
    vd_classic_slice slice = {.k = 0,
                              .z = setup->z0,
                              .rise = setup->scale / setup->z0,
                              .z_exact = setup->z0_exact,
                              .step_exact = setup->step_exact,
                              .level = vd_classic_level_at(setup, setup->z0, 0)};
    return slice;
}

static inline void vd_classic_slice_next(const vd_classic_setup *setup, vd_classic_slice *slice) {
    slice->k++;
    if (setup->growth == 0.0) {
        slice->z = setup->z0 + (float)slice->k * setup->step;
    } else {
        slice->step_exact += setup->growth;
        slice->z_exact += slice->step_exact;
        slice->z = (float)slice->z_exact;
    }
    slice->rise = setup->scale / slice->z;
    slice->level = vd_classic_level_at(setup, slice->z, slice->level);
}

/* The depth near / (view·z) for near = view·z0, in float. */
static inline float vd_classic_depth(const vd_classic_setup *setup, float z) {
    return setup->z0 / z;
}

/* ---- the cell under a point ------------------------------------------------------------------ */

/* floor(p) mod size for |p| >= 2^31, where every float is a whole number; −1 for NaN and infinity.
 * Out of line because no picture of a real map comes here. */
int vd_classic_wrap_far(float p, int size);

/* Returns floor(p) mod size, in [0, size), exactly, for every finite p; −1 for NaN and infinity,
 * which are not visible. `mask` is as in the setup. The conversion truncates, so that negative
 * fractions need one less; baseline x86-64 has no rounding instruction for floorf. */
VD_CLASSIC_INLINE int vd_classic_wrap(float p, int size, int mask) {
    if (!(fabsf(p) < 2147483648.0f)) {
        return vd_classic_wrap_far(p, size);
    }
    int32_t whole = (int32_t)p;
    whole -= (float)whole > p;
    if (mask >= 0) {
        return whole & mask;
    }
    int32_t rest = whole % size;
    return rest < 0 ? rest + size : rest;
}

VD_CLASSIC_INLINE float vd_classic_height(const vd_classic_setup *setup, vd_height_type type,
                                          int column, int row) {
    size_t index = (size_t)row * setup->height_stride + (size_t)column;
    switch (type) {
    case VD_HEIGHT_U8:
        return ((const uint8_t *)setup->heights)[index];
    case VD_HEIGHT_U16:
        return ((const uint16_t *)setup->heights)[index];
    default:
        return ((const float *)setup->heights)[index];
    }
}

/* trunc(v) saturated to int32. NaN gives the greatest row, which lies under every picture: not
 * visible. So does a hole, whose height is −infinity. */
VD_CLASSIC_INLINE int32_t vd_classic_truncate(float v) {
    if (!(v < 2147483648.0f)) {
        return INT32_MAX;
    }
    return v < -2147483648.0f ? INT32_MIN : (int32_t)v;
}

/* What column `column` of the picture sees of a slice: a cell of the map and the first row that it
 * covers. */
typedef struct vd_classic_sample {
    int32_t top; /* max(row, 0) */
    int cell_x, cell_y;
} vd_classic_sample;

VD_CLASSIC_INLINE vd_classic_sample vd_classic_look(const vd_classic_setup *setup,
                                                    const vd_classic_slice *slice, int column,
                                                    vd_height_type type) {
    float x = setup->eye_x + slice->z * setup->direction_x[column];
    float y = setup->eye_y + slice->z * setup->direction_y[column];
    int cell_x = vd_classic_wrap(x, setup->map_width, setup->x_mask);
    int cell_y = vd_classic_wrap(y, setup->map_height, setup->y_mask);
    vd_classic_sample sample = {INT32_MAX, cell_x, cell_y};
    if ((cell_x | cell_y) >= 0) {
        float height = vd_classic_height(setup, type, cell_x, cell_y);
        int32_t row =
            vd_classic_truncate((setup->eye_height - height) * slice->rise + setup->horizon);
        sample.top = row > 0 ? row : 0;
    }
    return sample;
}

static inline vd_rgba8 vd_classic_color(const vd_classic_setup *setup, int cell_x, int cell_y) {
    vd_rgba8 color = setup->colors[(size_t)cell_y * setup->color_stride + (size_t)cell_x];
    color.a = 255;
    return color;
}

/* ---- the pixels ------------------------------------------------------------------------------ */

static inline void vd_classic_put(vd_frame *frame, int column, int row, vd_rgba8 color,
                                  float depth) {
    size_t index = (size_t)row * frame->stride + (size_t)column;
    ((vd_rgba8 *)frame->rgba)[index] = color;
    if (frame->depth != NULL) {
        frame->depth[index] = depth;
    }
    if (frame->id != NULL) {
        frame->id[index] = 1;
    }
}

/* What a column remembers from slice to slice. */
typedef struct vd_classic_column {
    int32_t hidden; /* the last hidden row */
    vd_rgba8 color; /* of the previous visible sample; alpha 0 before the first (option smooth) */
} vd_classic_column;

/* Paints the pixels of a column from the sample's top to the last hidden row. */
void vd_classic_paint(const vd_classic_setup *setup, int column, vd_classic_sample sample,
                      int32_t hidden, float z);

/* The same for pictures that are not plain (classic_quality.c). */
void vd_classic_draw_slice_quality(const vd_classic_setup *setup, const vd_classic_slice *slice,
                                   int first, int count, vd_classic_column *columns);

/* Draws `count` columns of one slice from column `first` on; columns[i] is column first + i. */
VD_CLASSIC_INLINE void vd_classic_draw_slice(const vd_classic_setup *setup,
                                             const vd_classic_slice *slice, int first, int count,
                                             vd_classic_column *columns, vd_height_type type) {
    if (!setup->plain) {
        vd_classic_draw_slice_quality(setup, slice, first, count, columns);
        return;
    }
    for (int i = 0; i < count; i++) {
        vd_classic_sample sample = vd_classic_look(setup, slice, first + i, type);
        if (sample.top < columns[i].hidden) {
            vd_classic_paint(setup, first + i, sample, columns[i].hidden, slice->z);
            columns[i].hidden = sample.top;
        }
    }
}

/* ---- mixing ---------------------------------------------------------------------------------- */

static inline vd_rgba8 vd_classic_mix(vd_rgba8 a, vd_rgba8 b, uint32_t w) {
    vd_rgba8 mixed = {(uint8_t)((a.r * (256 - w) + b.r * w + 128) >> 8),
                      (uint8_t)((a.g * (256 - w) + b.g * w + 128) >> 8),
                      (uint8_t)((a.b * (256 - w) + b.b * w + 128) >> 8), 255};
    return mixed;
}

/* ---- the two monoids of the scan method --------------------------------------------------------
 * Their carrier is a colour-height pair, or none. The thesis has no "none": it clamps rows under
 * the bottom edge to the last row, and takes the background's colour to mean an empty pixel, so
 * that terrain of that colour is lost. Here emptiness is a flag of its own. */
typedef struct vd_classic_pair {
    vd_rgba8 color;
    float depth;
    int32_t row; /* in [0, picture height) */
    uint32_t occupied;
} vd_classic_pair;

/* The neutral element of both. */
static inline vd_classic_pair vd_classic_pair_none(void) {
    vd_classic_pair none = {{0, 0, 0, 0}, 0.0f, 0, 0};
    return none;
}

/* Of two pairs, `a` the nearer: the one that reaches higher up the picture; of equals the nearer.
 */
static inline vd_classic_pair vd_classic_occlude(vd_classic_pair a, vd_classic_pair b) {
    if (!b.occupied) {
        return a;
    }
    if (!a.occupied) {
        return b;
    }
    return a.row <= b.row ? a : b;
}

/* Of two pixels, `a` the upper: the lower one, unless it is empty. */
static inline vd_classic_pair vd_classic_fill(vd_classic_pair a, vd_classic_pair b) {
    return b.occupied ? b : a;
}

/* ---- the methods ------------------------------------------------------------------------------
 * Each draws over a frame that holds the background. Returns VD_ERROR_MEMORY, VD_ERROR_CANCELLED
 * and, from the scan, VD_ERROR_LIMIT. `counts` is never null; only the scan fills it. */
typedef vd_status vd_classic_draw_function(const vd_classic_setup *setup,
                                           vd_classic_counts *counts);

VD_MUST_USE vd_status vd_classic_draw_reference(const vd_classic_setup *setup,
                                                vd_classic_counts *counts);
VD_MUST_USE vd_status vd_classic_draw_slices(const vd_classic_setup *setup,
                                             vd_classic_counts *counts);
VD_MUST_USE vd_status vd_classic_draw_columns(const vd_classic_setup *setup,
                                              vd_classic_counts *counts);
VD_MUST_USE vd_status vd_classic_draw_scan(const vd_classic_setup *setup,
                                           vd_classic_counts *counts);

/* Checks the map alone. Returns VD_ERROR_ARGUMENT. */
VD_MUST_USE vd_status vd_classic_check_map(const vd_heightfield *map);

/* Checks everything that a def, a map and a frame can have wrong and gives the number of slices.
 * Returns VD_ERROR_ARGUMENT or VD_ERROR_LIMIT. */
VD_MUST_USE vd_status vd_classic_check(vd_context *context, const vd_heightfield *map,
                                       const vd_classic_def *def, const vd_frame *frame,
                                       uint64_t *slices);

/* Lists the levels of a map: level 0 alone, which takes no memory, or all. Returns
 * VD_ERROR_MEMORY. */
VD_MUST_USE vd_status vd_classic_mips_init(vd_context *context, const vd_heightfield *map, bool all,
                                           vd_classic_mips *out);
void vd_classic_mips_finish(vd_context *context, vd_classic_mips *mips);

/* One of the pictures that a picture is drawn from: the def's own, or, for samples, one that is
 * moved by a part of a pixel. */
typedef struct vd_classic_view {
    const vd_classic_def *def;
    double column, horizon; /* added to the columns and to the horizon */
    vd_frame *frame;
} vd_classic_view;

/* Rounds a checked def. `directions` has room for 2 × the frame's width. */
vd_classic_setup vd_classic_make_setup(vd_context *context, vd_job *job, const vd_heightfield *map,
                                       const vd_classic_mips *mips, const vd_classic_view *view,
                                       uint64_t slices, float *directions);

/* ---- samples (classic_samples.c) ------------------------------------------------------------- */

/* Memory that stays from picture to picture; zero at first. */
typedef struct vd_classic_resolver {
    size_t pixels;
    uint8_t *rgba;  /* [pixels][4] of one of the pictures */
    float *depth;   /* [pixels] */
    uint16_t *sums; /* [pixels][4] of the pictures; the fourth is 1 at an edge */
} vd_classic_resolver;

typedef vd_status vd_classic_draw_view(void *user, const vd_classic_view *view);

/* Draws a picture with the def's samples from pictures with one, by `draw`. Returns what draw does
 * or VD_ERROR_MEMORY. */
VD_MUST_USE vd_status vd_classic_resolve(vd_context *context, vd_classic_resolver *resolver,
                                         const vd_classic_def *def, vd_frame *frame,
                                         vd_classic_draw_view *draw, void *user);
void vd_classic_resolver_finish(vd_context *context, vd_classic_resolver *resolver);

/* Fills the frame with the background, depth and id with 0, and sets the frame's objects. */
void vd_classic_clear(vd_frame *frame, vd_rgba8 background);

/* Sets the frame's table of objects. */
void vd_classic_set_objects(vd_frame *frame);

/* A column of which nothing is hidden. */
static inline vd_classic_column vd_classic_column_first(const vd_classic_setup *setup) {
    vd_classic_column column = {setup->frame->height, {0, 0, 0, 0}};
    return column;
}

/* Returns `width` of them; null when memory is out. Vd_release. */
VD_MUST_USE vd_classic_column *vd_classic_columns_create(const vd_classic_setup *setup);

/* The one sentence for a stopped job. */
vd_status vd_classic_cancelled(void);

#endif

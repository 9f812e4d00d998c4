/* display_rows.h: what draws rows of a frame, without threads, files and memory of its own: the
 * part that is also built to WebAssembly. */
#ifndef VEDUTA_DISPLAY_ROWS_H
#define VEDUTA_DISPLAY_ROWS_H

#include "display/display_kernels.h"

/* A half-plane of the picture: a pixel's centre (x, y) is in it where a·x + b·y + c > 0, and where
 * that is 0 if `closed`. */
typedef struct vd_display_edge {
    double a, b, c;
    double inverse; /* 1 / a for a first guess; 0 where a is */
    bool closed;
} vd_display_edge;

enum { VD_DISPLAY_EDGES = 6, VD_DISPLAY_OPAQUE_EDGES = 4 };

/* A quad made ready: what is inside, and 1/w, u/w, v/w (texels) as planes over the picture. */
typedef struct vd_display_setup {
    const vd_quad *quad;
    vd_display_edge edges[VD_DISPLAY_EDGES];
    vd_display_edge opaque[VD_DISPLAY_OPAQUE_EDGES]; /* of what hides all that is behind */
    int edge_count, opaque_count;                    /* the latter 0: nothing is hidden */
    double u[3], v[3], inverse_w[3];
} vd_display_setup;

/* A quad that was made ready, and the rows that may have something of it: apart from the rest,
 * since every band looks at all of them. */
typedef struct vd_display_entry {
    const vd_display_setup *setup;
    int first_row, end_row;
} vd_display_entry;

/* Part of a quad's row that is seen; its numbers hold for `base` whatever is seen of it: the one
 * end of the row, `reach` pixels from the other. */
typedef struct vd_display_segment {
    const vd_display_setup *setup;
    int y, base, reach, begin, end;
    int opaque_begin, opaque_end; /* where the quad's texels are opaque; they meet: nowhere */
} vd_display_segment;

typedef struct vd_display_window {
    uint8_t *rgba; /* the whole frame's: aligned and as wide as the kernel's contract says */
    int width, height;
    size_t stride;      /* pixels */
    const float *depth; /* of the frame, tested against; null: it is not */
    float near_m;       /* depth is near_m / w */
} vd_display_window;

typedef struct vd_display_list {
    vd_display_window window;
    const vd_display_kernels *kernels;
    const vd_display_entry *entries; /* farthest first */
    int count;
    bool draw_hidden;
} vd_display_list;

/* What drawing `count` quads needs besides: `active` of that many entries, `segments` of
 * vd_display_segment_count(count). */
typedef struct vd_display_scratch {
    vd_display_entry *active;
    vd_display_segment *segments;
} vd_display_scratch;

/* How often a strip's rows may be split by what hides their middle; more is drawn in one. */
#define VD_DISPLAY_SPLITS 256

/* At least one row of all quads fits, several of those of a usual strip. */
static inline size_t vd_display_segment_count(int count) {
    return (size_t)count + 4096 + VD_DISPLAY_SPLITS;
}

/* Whether a quad's numbers may be used: corners finite, picture and opaque rectangle in range.
 * Else *field is what is wrong. */
bool vd_display_check(const vd_quad *quad, const char **field);

/* Makes a checked quad ready for a frame of `height` rows: *entry refers to *setup. Returns false
 * when nothing of it can be seen. */
bool vd_display_prepare(const vd_quad *quad, float near_m, int height, vd_display_setup *setup,
                        vd_display_entry *entry);

/* Draws the rows [first, end). */
void vd_display_rows(const vd_display_list *list, int first, int end, vd_display_scratch scratch);

#endif

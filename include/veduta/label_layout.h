/* label_layout.h: where names stand in a picture.
 *
 * Each label names a place and has a box. Labels are taken by priority, and each gets the first of
 * these spots that is free: above its place, right, left, below, then ever higher above it with a
 * leader, an upright line from the box to the place, as panorama posters have it. A label that
 * finds none is not shown. What comes out, whatever goes in:
 *
 *   - boxes are inside the picture and overlap neither each other nor the kept rectangles;
 *   - leaders cross no box, no other leader and nothing kept;
 *   - the place of a shown label is covered by nothing of another.
 *
 * Greedy placement by priority keeps the important names, which an optimum of all (Christensen,
 * Marks & Shieber 1995: simulated annealing) gives up for many others; and one more label of low
 * priority moves none of the others.
 */
#ifndef VEDUTA_LABEL_LAYOUT_H
#define VEDUTA_LABEL_LAYOUT_H

#include <stdbool.h>
#include <veduta/context.h>

VD_BEGIN_DECLARATIONS

#define VD_LABEL_LAYOUT_MAX ((size_t)1 << 24) /* labels, and kept rectangles, in a picture */

typedef enum vd_leader {
    VD_LEADER_NEVER = 0, /* beside its place or not at all */
    VD_LEADER_ALLOWED,   /* beside its place, else higher with a leader */
    VD_LEADER_ALWAYS,    /* with a leader: places behind a hill */
    VD_LEADER_COUNT
} vd_leader;

/* Picture pixels, y down. */
typedef struct vd_label_request {
    float x, y;          /* the place; outside the picture: not shown */
    float width, height; /* of the box: the text with some room around it; above 0 */
    double priority;     /* the greater comes first; of equals the one that stands first */
    vd_leader leader;
} vd_label_request;

typedef struct vd_label_spot {
    bool shown;
    bool leader;  /* a line from (x, box[3]) to the place */
    float box[4]; /* x0, y0, x1, y1; all 0 when it is not shown */
} vd_label_spot;

typedef struct vd_label_layout_def {
    int width, height;      /* of the picture */
    const float (*kept)[4]; /* [kept_count]: x0, y0, x1, y1; where no label may be: furniture */
    size_t kept_count;
    float margin;       /* between boxes and the picture's edge */
    float gap;          /* between a place and a box beside it */
    float mark;         /* half the side of the square about each place that others keep out of, as
                           large as the symbol that is drawn there; at most the gap */
    float leader_width; /* room that a leader takes */
    float rise;         /* from one height to the next; 0: half the box's own height */
    int rises;          /* how many heights are tried; 0: 16 */
    bool rise_first;    /* higher spots come before right, left and below. For panoramas: a crowd of
                           peaks along a ridge goes up into the sky and hides no other's place */
} vd_label_layout_def;

/* No picture yet, nothing kept, margin 4, gap 5, mark 3, leaders 2 wide. */
VD_API vd_label_layout_def vd_label_layout_def_default(void);

/* The working memory, kept from picture to picture. One call at a time. */
typedef struct vd_label_layout vd_label_layout;

/* *out is owned by the caller. Returns VD_ERROR_MEMORY. */
VD_API VD_MUST_USE vd_status vd_label_layout_create(vd_context *context, vd_label_layout **out);
VD_API void vd_label_layout_destroy(vd_label_layout **layout);

/* Finds a spot for each of `count` labels; spots is [count]. The same in gives the same out. Cost:
 * O(n log n) for sorting, then some looks at neighbours for each label: 10,000 labels take some
 * milliseconds. A second picture like the first allocates nothing. Returns VD_ERROR_ARGUMENT (names
 * the label and field: a number that is not finite, a box without size), VD_ERROR_LIMIT or
 * VD_ERROR_MEMORY; the spots are then undefined. */
VD_API VD_MUST_USE vd_status vd_label_layout_place(vd_label_layout *layout,
                                                   const vd_label_layout_def *def,
                                                   const vd_label_request *requests, size_t count,
                                                   vd_label_spot *spots);

VD_END_DECLARATIONS

#endif

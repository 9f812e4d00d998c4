/* brick_walk.h: what choosing and preparing bricks for a picture share. */
#ifndef VEDUTA_SPLAT_BRICK_WALK_H
#define VEDUTA_SPLAT_BRICK_WALK_H

#include <veduta/brick_view.h>

/* What is kept of a node: its numbers as floats, its order. */
typedef struct vd_kept_node {
    void *memory; /* null: nothing */
    size_t bytes;
    uint64_t used;     /* the update that last drew it */
    float radius_mean; /* root mean square */
    float *radius;     /* its own; null without */
    float *scaled;     /* radius, as it is drawn */
    float *value, *weight;
    vd_rgba8 *color;
    const uint8_t *classes;
    vd_splat_order order;
} vd_kept_node;

/* What of a node is drawn. */
typedef enum vd_mark {
    VD_MARK_NONE = 0,
    VD_MARK_PART, /* something below it */
    VD_MARK_WHOLE
} vd_mark;

struct vd_brick_view_parts {
    vd_context *context;
    vd_kept_node *kept; /* [node_count] */
    size_t kept_bytes;
    uint64_t update;
    vd_brick_view_def def; /* that kept numbers were made for */
    uint32_t *chosen;      /* [node_count]: of this update, back to front */
    uint32_t *parents;     /* [node_count]; of the root itself */
    uint8_t *marks;        /* [node_count]: vd_mark, with roots; all VD_MARK_NONE between updates */
    uint8_t *whole;        /* [node_count]: children that are VD_MARK_WHOLE */
    vd_status *statuses;   /* [threads] */
};

/* One walk. */
typedef struct vd_brick_walk {
    vd_brick_view *view;
    const vd_brick_view_def *def;
    const vd_camera *camera;
    vd_frustum frustum;
    vd_vec3 forward;
    double detail_px, margin; /* of boxes: the largest radius */
    double scale;             /* pixels a metre: over depth for perspective */
    uint32_t count;
    vd_brick_view_stats stats;
} vd_brick_walk;

/* ---- brick_walk.c ---------------------------------------------------------------------------- */

/* The parent of every node; the root's is itself. */
void vd_brick_find_parents(const vd_bricks *bricks, uint32_t *parents);

/* Chooses the nodes of a picture, back to front: fills parts->chosen, count and stats. */
void vd_brick_walk_run(vd_brick_walk *walk);

/* Distance along the view axis of a node's middle and, less than that, of its nearest corner. */
double vd_brick_walk_depth(const vd_brick_walk *walk, const vd_bricks_node *node, double *nearest);

/* Pixels of a metre at a depth. */
double vd_brick_walk_scale(const vd_brick_walk *walk, double depth);

/* A node's children, back to front; returns how many. */
uint32_t vd_brick_walk_children(const vd_brick_walk *walk, const vd_bricks_node *node,
                                uint32_t out[8]);

/* How far on the screen the data is from a node's particles that stand for it, pixels. */
double vd_brick_walk_spread(const vd_brick_walk *walk, const vd_bricks_node *node);

/* How much lower a node appears, metres: at its middle. */
double vd_brick_walk_drop(const vd_brick_walk *walk, const vd_bricks_node *node);

#endif

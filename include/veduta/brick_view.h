/* brick_view.h: which bricks a picture needs, as lists of splats.
 *
 * A view walks the octree of a brick file for a camera. Bricks outside the picture are passed over;
 * a node is drawn in place of everything below it once its particles stand nearer on the screen to
 * the data they stand for than a given part of a pixel. What is drawn comes back to front, by
 * octants, so alpha needs no sorting beyond the bricks. Opacities are such that a sample covers
 * what the particles that it stands for would: nothing pops as one comes nearer.
 *
 *     status = vd_brick_view_create(context, bricks, &view);
 *     status = vd_brick_view_update(view, NULL, &def, &camera, width, height, &stats);
 *     status = vd_splatter_render(splatter, NULL, &splat_def, &camera,
 *                                 view->splats, view->count, frame, NULL);
 */
#ifndef VEDUTA_BRICK_VIEW_H
#define VEDUTA_BRICK_VIEW_H

#include <veduta/bricks.h>
#include <veduta/splat.h>

VD_BEGIN_DECLARATIONS

typedef enum vd_brick_color {
    VD_BRICK_COLOR_CONSTANT = 0,
    VD_BRICK_COLOR_RGB,    /* the channels red, green, blue */
    VD_BRICK_COLOR_CLASS,  /* the category `attribute`, by the splat def's class colours */
    VD_BRICK_COLOR_VALUE,  /* the number `attribute`, by the splat def's colormap */
    VD_BRICK_COLOR_HEIGHT, /* z, by the colormap */
    VD_BRICK_COLOR_COUNT
} vd_brick_color;

typedef struct vd_brick_view_def {
    vd_splat_mode mode;
    vd_splat_kernel kernel;
    double detail_px; /* how far, root mean square, data may be on the screen from what stands for
                         it; 0: half a pixel; negative: everything is drawn, every leaf */
    vd_brick_color color;
    int attribute;       /* CLASS and VALUE */
    vd_rgba8 constant;   /* straight sRGB */
    double radius_m;     /* > 0: of all particles; 0: their own, or without one what the spacing of
                            particles suggests (densities: points) */
    double radius_scale; /* 0: 1 */
    double opacity;      /* 0: 1 */
    int weight;          /* density: the attribute that is added up; −1: 1 each */
    size_t memory_bytes; /* what may be kept from picture to picture; 0: 1 GiB */
    double drop_per_m2;  /* curvature: how much lower things appear, metres by squared metre of
                            distance; 0: flat */
    const uint32_t *roots; /* [root_count]: nodes of which they and what is below are drawn, and
                              nothing else; null: everything */
    size_t root_count;     /* with roots null not used */
    bool rest_hidden; /* what is below no root is not seen anyway: nodes above roots may stand for
                         them too */
} vd_brick_view_def;

/* Alpha, boxes, half a pixel, white, weight −1. */
VD_API vd_brick_view_def vd_brick_view_def_default(void);

typedef struct vd_brick_view_stats {
    uint64_t nodes, leaves; /* drawn; leaves among them */
    uint64_t particles;     /* in them */
    uint64_t stands_for;    /* particles of the data that they stand for */
    uint64_t culled;        /* particles of the data outside the picture; of the roots */
    uint64_t decoded;       /* nodes whose numbers were not kept from a picture before */
} vd_brick_view_stats;

typedef struct vd_brick_view {
    const vd_bricks *bricks;
    vd_splats *splats; /* [count], back to front; the view's, until the next update */
    int count;
    struct vd_brick_view_parts *parts;
} vd_brick_view;

/* *out is owned by the caller; `bricks` must outlive it. Updates run on `context`, which may be
 * another one than that of the bricks: each thread that looks at them needs a view and a context of
 * its own. Returns VD_ERROR_MEMORY. */
VD_API VD_MUST_USE vd_status vd_brick_view_create(vd_context *context, const vd_bricks *bricks,
                                                  vd_brick_view **out);
VD_API void vd_brick_view_destroy(vd_brick_view **view);

/* Chooses and prepares what a picture of a camera needs. Several roots come back to front as a
 * whole; where they are all of a node's children, that node may be drawn in their place. Numbers
 * and orders of drawing are kept from picture to picture within the memory allowed: the same
 * picture again allocates nothing. `job` and `stats` may be null. Returns VD_ERROR_ARGUMENT (names
 * the field), VD_ERROR_FORMAT (a damaged brick), VD_ERROR_MEMORY or VD_ERROR_CANCELLED. */
VD_API VD_MUST_USE vd_status vd_brick_view_update(vd_brick_view *view, vd_job *job,
                                                  const vd_brick_view_def *def,
                                                  const vd_camera *camera, int width, int height,
                                                  vd_brick_view_stats *stats);

/* Whether a def fits the bricks. Returns VD_ERROR_ARGUMENT (names the field). */
VD_API VD_MUST_USE vd_status vd_brick_view_check(const vd_bricks *bricks,
                                                 const vd_brick_view_def *def);

/* Returns how far from their middles particles of a def show at most, metres. */
VD_API double vd_brick_view_reach(const vd_bricks *bricks, const vd_brick_view_def *def);

/* Returns the radius that particles without one of their own are drawn with, metres. */
VD_API double vd_brick_view_radius(const vd_bricks *bricks);

VD_END_DECLARATIONS

#endif

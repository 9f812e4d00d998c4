/* splat.h: drawing particles as antialiased dots, by the hundred million.
 *
 *     vd_splats splats = vd_splats_default();
 *     splats.count = n;
 *     splats.x = x, splats.y = y, splats.z = z;
 *     splats.radius_m = 0.5f;
 *     status = vd_splatter_create(context, &splatter);
 *     status = vd_splatter_render(splatter, NULL, &def, &camera, &splats, 1, frame, NULL);
 *
 * A particle smaller than a pixel is a box of one pixel, spread with its exact coverage over the
 * four pixels it touches, its opacity scaled by its area; a larger one is a box, a disc or a kernel
 * (Lawlor 2004, §6.6.1.1). Positions are taken to 1/256 pixel. Blending is premultiplied, in
 * encoded space (color.h), at more than 16 bits a channel, and rounded once to 16 and once to 8.
 * The same bytes at every SIMD level and number of threads, and from the plain reference.
 */
#ifndef VEDUTA_SPLAT_H
#define VEDUTA_SPLAT_H

#include <veduta/camera.h>
#include <veduta/colormap.h>
#include <veduta/frame.h>
#include <veduta/job.h>
#include <veduta/matrix.h>

VD_BEGIN_DECLARATIONS

/* The most particles in one vd_splats. */
#define VD_SPLATS_MAX_COUNT 0x7fffff00u

/* How a particle of more than a pixel looks; its radius is r. The value at its middle is its
 * opacity. */
typedef enum vd_splat_kernel {
    VD_SPLAT_BOX = 0,  /* a square of 2r: exact coverage */
    VD_SPLAT_DISC,     /* a disc of radius r, its edge one pixel soft */
    VD_SPLAT_GAUSSIAN, /* exp(−d²/r²), cut at 2.5 r */
    VD_SPLAT_SPH, /* the cubic spline of smoothing length r (Monaghan 1992), support 2r, seen along
                     the line of sight */
    VD_SPLAT_KERNEL_COUNT
} vd_splat_kernel;

/* Returns "box", "disc", "gaussian" or "sph". */
VD_API const char *vd_splat_kernel_name(vd_splat_kernel kernel);

typedef enum vd_splat_mode {
    VD_SPLAT_ALPHA = 0, /* blended back to front */
    VD_SPLAT_DENSITY,   /* column density: weights are added up in fixed point; needs no order */
    VD_SPLAT_NEAREST,   /* opaque points with depth and id, as LiDAR viewers draw them */
    VD_SPLAT_MODE_COUNT
} vd_splat_mode;

/* Returns "alpha", "density" or "nearest". */
VD_API const char *vd_splat_mode_name(vd_splat_mode mode);

typedef enum vd_splat_method {
    VD_SPLAT_AUTO = 0,  /* the fast one */
    VD_SPLAT_REFERENCE, /* one particle and one pixel at a time */
    VD_SPLAT_METHOD_COUNT
} vd_splat_method;

/* An order of drawing that is kept from frame to frame: it depends on the direction of view only,
 * not on where the eye is. Zero it, give it memory; the renderer sorts when it must. */
typedef struct vd_splat_order {
    uint32_t *index; /* [count]: the caller's memory */
    float axis[3];   /* the direction it was sorted for, in the splats' own space; 0: none yet */
} vd_splat_order;

/* Particles as arrays of the caller's, which are only read. A brick, a cluster of leaves, a whole
 * file. Drawing is parallel over pieces of it, sorting over whole ones: bricks of 2¹⁰ to 2¹⁶
 * particles are best. */
typedef struct vd_splats {
    size_t count; /* at most VD_SPLATS_MAX_COUNT; 0 draws nothing */

    /* Where: world = anchor + transform × p, metres. p is (x, y, z), or with x16 etc. not null
     * origin + step × (x16, y16, z16). Particles with a coordinate that is not finite are skipped
     * and counted. */
    vd_vec3 anchor;
    const vd_matrix *transform; /* affine; null: none. Radii grow by the cube root of its volume */
    const float *x, *y, *z;     /* [count] */
    const uint16_t *x16, *y16, *z16; /* [count], quantised */
    float origin[3], step[3];
    bool has_bounds;      /* min and max hold all p that are finite: needless passes are saved */
    float min[3], max[3]; /* and what is outside the picture is not looked at */

    /* How large, metres; 0 draws points of no area: nothing, except by density. */
    const float *radius; /* [count]; null: radius_m for all */
    float radius_m;

    /* What colour: the first of these that is not null, else `constant`. Straight sRGB. */
    const vd_rgba8 *color;   /* [count] */
    const uint8_t *classes;  /* [count], looked up in the def's class_colors */
    const float *value;      /* [count], by the def's colormap; NaN is as the lowest */
    const uint16_t *value16; /* [count], the same quantised: value_origin + value_step × value16 */
    float value_origin, value_step;
    vd_rgba8 constant;
    float opacity; /* 0 … 1, on top of the colour's alpha */

    /* VD_SPLAT_DENSITY: what is added up. */
    const float *weight; /* [count]; null: 1. Negative and NaN count as 0 */

    vd_splat_order *order; /* null: sorted anew for every picture, in the renderer's memory */
    uint64_t object_id;    /* in the frame's table of ids */
} vd_splats;

/* No particles, identity, radius 0, opaque white, object id 1. */
VD_API vd_splats vd_splats_default(void);

/* Sets min, max and has_bounds from the finite positions; all 0 when there is none. */
VD_API void vd_splats_find_bounds(vd_splats *splats);

typedef struct vd_splat_def {
    vd_splat_mode mode;
    vd_splat_kernel kernel;
    vd_splat_method method;
    vd_rgba8 background; /* straight; alpha 0 is transparent */

    /* Values or densities become colours: by a map over a range. Densities are weight per pixel. */
    const vd_colormap *colormap; /* relative; null: viridis, for densities magma */
    double range_min, range_max; /* equal: the range of what is finite (and, by log, positive) */
    bool log;                    /* equal steps of colour are equal ratios */

    const vd_rgba8 *class_colors; /* [256]; null: the classes of LAS */
    double max_weight; /* density: the largest weight, which sets the fixed point (larger ones are
                          cut and counted); 0: found by looking at all of them */
    bool sort_splats;  /* alpha: order the list by the depth of the bounds' middles, farthest first;
                          else it is drawn as given, which must be back to front */
    bool keep_order;   /* alpha: draw the particles as they stand in their arrays */
    double resort_rad; /* kept orders are used while the view turned less than this; 0: exactly */
    bool over_frame;   /* alpha: draw over what the frame holds, in place of the background; where
                          the frame has depth, hidden by what is nearer. Its depth and id stay */
} vd_splat_def;

/* Everything zero: alpha, boxes, transparent black, automatic range. */
VD_API vd_splat_def vd_splat_def_default(void);

typedef struct vd_splat_stats {
    uint64_t splats;     /* given */
    uint64_t outside;    /* behind the near plane, beside the picture, or too small to count; dots
                            that the frame hides */
    uint64_t not_finite; /* a position or radius is not finite: skipped */
    uint64_t cut;        /* weights above max_weight */
    uint64_t sorted;     /* particles whose order was made anew */
    double value_min, value_max; /* the range that the colours stand for */
} vd_splat_stats;

/* A renderer: the memory that drawing needs, kept from frame to frame. One call at a time. */
typedef struct vd_splatter vd_splatter;

/* *out is owned by the caller. Returns VD_ERROR_MEMORY. */
VD_API VD_MUST_USE vd_status vd_splatter_create(vd_context *context, vd_splatter **out);
VD_API void vd_splatter_destroy(vd_splatter **splatter);

/* Draws `count` lists of particles into the frame, over the background: the colours always, depth
 * and id (where the frame has them) by VD_SPLAT_NEAREST, else 0. With `over_frame` a dot of up to a
 * pixel is drawn or not by the depth of its middle beside that of the pixel there, a larger one
 * pixel by pixel; over transparent black the picture is premultiplied, to be shown over others.
 * A second call with the same sizes allocates nothing. `job` and `stats` may be null. Cost:
 * O(particles + pixels of the large ones). Returns VD_ERROR_ARGUMENT (names the field),
 * VD_ERROR_LIMIT (too many particles or object ids), VD_ERROR_MEMORY, VD_ERROR_CANCELLED (the frame
 * is untouched then). A picture without anything is a success with stats->outside + not_finite =
 * splats. */
VD_API VD_MUST_USE vd_status vd_splatter_render(vd_splatter *splatter, vd_job *job,
                                                const vd_splat_def *def, const vd_camera *camera,
                                                const vd_splats *splats, int count, vd_frame *frame,
                                                vd_splat_stats *stats);

/* Brings the kept orders of the lists up to date for a camera, as rendering would: by a radix sort
 * of two passes over 22 bits of depth, stable (of equal keys the lower index first), in parallel
 * over the lists. Lists without an order are passed over. `sorted` (may be null) receives the
 * number of particles. Returns as vd_splatter_render. */
VD_API VD_MUST_USE vd_status vd_splatter_sort(vd_splatter *splatter, vd_job *job,
                                              const vd_splat_def *def, const vd_camera *camera,
                                              const vd_splats *splats, int count, uint64_t *sorted);

/* Draws a bar of the colours with the numbers they stand for into the lower right corner of a
 * frame: what the stats of the picture say. Nothing where the frame is too small for it. */
VD_API void vd_splat_draw_legend(vd_frame *frame, const vd_splat_def *def,
                                 const vd_splat_stats *stats);

/* The 18 colours that LAS files' classes are shown in (ASPRS 2019), grey beyond; [256]. */
VD_API void vd_splat_class_colors(vd_rgba8 out[256]);

VD_END_DECLARATIONS

#endif

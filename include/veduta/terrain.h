/* terrain.h: drawing a heightfield, or a function that has no end.
 *
 * The surface is bilinear within every cell of four neighbouring samples. A picture is, for each
 * sample position, the first point where its ray passes from the air into the ground. A ray that
 * starts in the ground, or that comes in under the surface at the map's edge or at a hole's edge,
 * sees nothing of the terrain. With curvature, a point at the horizontal distance d from the eye
 * appears lower by (1 − k)·d²/(2R), R = 6,371,008.8 m, k = 0.13.
 */
#ifndef VEDUTA_TERRAIN_H
#define VEDUTA_TERRAIN_H

#include <veduta/camera.h>
#include <veduta/colormap.h>
#include <veduta/function.h>
#include <veduta/job.h>
#include <veduta/light.h>
#include <veduta/target.h>

VD_BEGIN_DECLARATIONS

typedef enum vd_filter { VD_FILTER_NEAREST = 0, VD_FILTER_LINEAR, VD_FILTER_COUNT } vd_filter;

typedef enum vd_terrain_method {
    VD_TERRAIN_MARCH = 0, /* past blocks of cells that lie under the ray, by the maxima pyramid */
    VD_TERRAIN_RAYCAST,   /* the plain reference: one ray at a time through every cell */
    VD_TERRAIN_METHOD_COUNT
} vd_terrain_method;

/* Which pixels take all samples. */
typedef enum vd_antialias {
    VD_ANTIALIAS_EDGES = 0, /* those on a silhouette; others take one at their centre */
    VD_ANTIALIAS_EVERYWHERE,
    VD_ANTIALIAS_COUNT
} vd_antialias;

/* A rectangle of cells: cell (c, r) lies between the samples (c, r) and (c + 1, r + 1). */
typedef struct vd_terrain_window {
    int column, row, columns, rows;
} vd_terrain_window;

typedef struct vd_terrain_def {
    /* What is drawn: exactly one is set; not owned. A function is drawn wherever the camera looks,
     * from its values at a grid whose sample (c, r) lies at x = c·cell_m, y = −r·cell_m, and at
     * multiples of 2, 4, 8 … cells farther away (`mip`); its own colours come before the colour
     * map, which stretches over the heights within 2,048 cells of the origin. Of the options below
     * it has no shadows and no window. */
    const vd_heightfield *heightfield;
    const vd_function *function;
    double cell_m; /* of the function's finest cells, metres, above 0 */
    double far_m;  /* of the function: nothing is drawn beyond, along the view axis; 0: as far as it
                      makes a difference, at most 1,000 km unless the eye is higher than 4 km */
    const vd_colormap *colormap; /* colours by height where there are no colours; not owned */
    vd_light light;
    vd_terrain_method method;
    vd_filter filter; /* of the colours */
    bool mip;         /* coarser heights and colours far away, where a cell is a pixel */
    int samples;      /* 1, 4 or 8 a pixel */
    vd_antialias antialias;
    vd_terrain_window window; /* the cells that are drawn; columns 0: all */
    double exaggeration;      /* factor on heights; 1 is real */
    bool shading;             /* light the surface; off: plain colours */
    bool shadows;             /* the surface throws shadows on itself */
    bool curvature;           /* the Earth's, with refraction */
    bool sky;                 /* paint light's sky where nothing is hit; off: `background` */
    vd_rgba8 background;      /* straight; alpha 0 is transparent */
    uint64_t object_id;       /* the terrain's 64-bit id in the frame's table */
} vd_terrain_def;

/* Daylight from azimuth 315°, altitude 45°, no haze; linear filter, mip, 4 samples, exaggeration 1,
 * shading, shadows and sky on, curvature off, cell_m 1, object id 1. */
VD_API vd_terrain_def vd_terrain_def_default(void);

typedef struct vd_frame_stats {
    uint64_t samples; /* sample positions drawn */
    uint64_t hits;    /* of these, on the terrain */
} vd_frame_stats;

/* Returns "march" or "raycast". */
VD_API const char *vd_terrain_method_name(vd_terrain_method method);

/* Draws terrain and sky into the frame (all planes it has). `job` and `stats` may be null.
 * Returns VD_ERROR_ARGUMENT (names the field), VD_ERROR_MEMORY, VD_ERROR_CANCELLED (the frame then
 * holds the tiles that were finished). A picture without terrain is a success with stats->hits 0;
 * vd_terrain_explain_empty then says why. */
VD_API VD_MUST_USE vd_status vd_terrain_render(vd_context *context, vd_job *job,
                                               const vd_terrain_def *def, const vd_camera *camera,
                                               vd_frame *frame, vd_frame_stats *stats);

/* ---- many pictures of one terrain ------------------------------------------------------------
 * Of a heightfield, what does not depend on the camera is derived once: coarser heights, maxima,
 * colours with light and shadow in them; about 8 bytes a sample and 5.3 bytes a texel of the
 * colours. A function is sampled anew for every picture: a few samples a pixel for each doubling of
 * the distance, at 9.4 bytes, at most 2^26 of them. */
typedef struct vd_terrain_renderer vd_terrain_renderer;

/* Creates a renderer of `def`, whose heightfield or function must outlive it unchanged; *out is
 * owned by the caller. `job` may be null. Cost: some passes over the map. Returns VD_ERROR_ARGUMENT
 * (names the field), VD_ERROR_MEMORY or VD_ERROR_CANCELLED. */
VD_API VD_MUST_USE vd_status vd_terrain_renderer_create(vd_context *context, vd_job *job,
                                                        const vd_terrain_def *def,
                                                        vd_terrain_renderer **out);

/* Ends a renderer and sets *renderer to null. Null is accepted. */
VD_API void vd_terrain_renderer_destroy(vd_terrain_renderer **renderer);

/* Changes the light: a sun that moves. Cost: lighting and shadowing every sample of the map, some
 * nanoseconds each. Takes memory only while it works, and none where the colours are the map's own
 * samples and the map is not small. Returns VD_ERROR_ARGUMENT, VD_ERROR_MEMORY or
 * VD_ERROR_CANCELLED (colours are then unfinished). */
VD_API VD_MUST_USE vd_status vd_terrain_renderer_light(vd_terrain_renderer *renderer, vd_job *job,
                                                       const vd_light *light);

/* Changes samples a pixel, from the next picture on: fewer while a camera moves, all of them once
 * it rests. Returns VD_ERROR_ARGUMENT for anything but 1, 4 and 8. */
VD_API VD_MUST_USE vd_status vd_terrain_renderer_set_samples(vd_terrain_renderer *renderer,
                                                             int samples);

/* Draws as vd_terrain_render does. Allocates only when a picture, or what it shows of a function,
 * is larger than any before. One thread at a time. */
VD_API VD_MUST_USE vd_status vd_terrain_renderer_draw(vd_terrain_renderer *renderer, vd_job *job,
                                                      const vd_camera *camera, vd_frame *frame,
                                                      vd_frame_stats *stats);

/* Draws into a target together with others, every sample at its own place and by depth against what
 * is there (of equals, what is there stays); where nothing is, the sky or the background shows.
 * `target` is a window of the picture of the `camera`, its samples count, not the def's; `frame`
 * gives the frame id. Cost: a picture of one sample for each of the target's. Allocates when the
 * window is larger than any before. Returns VD_ERROR_ARGUMENT, VD_ERROR_LIMIT (no room for another
 * id), VD_ERROR_MEMORY or VD_ERROR_CANCELLED (some samples are then not drawn). */
VD_API VD_MUST_USE vd_status vd_terrain_renderer_composite(vd_terrain_renderer *renderer,
                                                           vd_job *job, const vd_camera *camera,
                                                           vd_frame *frame, vd_target *target,
                                                           vd_frame_stats *stats);

/* Estimates what vd_terrain_render will take by drawing a few spread tiles: wall seconds and the
 * most bytes held by the renderer at once (without frame and heightfield). */
VD_API VD_MUST_USE vd_status vd_terrain_estimate(vd_context *context, vd_job *job,
                                                 const vd_terrain_def *def, const vd_camera *camera,
                                                 int width, int height, double *seconds,
                                                 size_t *bytes);

/* Returns one sentence on why a camera sees none of the terrain: the camera is under ground, all
 * samples are missing, it looks away, or the terrain is behind the near plane or the horizon. */
VD_API vd_status vd_terrain_explain_empty(const vd_terrain_def *def, const vd_camera *camera,
                                          int width, int height);

/* Drops an apparent height by curvature and refraction at a horizontal distance, in metres. */
VD_API double vd_curvature_drop(double distance_m);

VD_END_DECLARATIONS

#endif

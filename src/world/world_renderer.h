/* world_renderer.h: the insides of a vd_world_renderer. */
#ifndef VEDUTA_WORLD_WORLD_RENDERER_H
#define VEDUTA_WORLD_WORLD_RENDERER_H

#include <veduta/label_layout.h>
#include "core/buffer.h"
#include "terrain/horizon_map.h"
#include "world/hill_shade.h"
#include "world/world_internal.h"
#include "world/world_shader.h"

struct vd_world_renderer {
    vd_context *context;
    const vd_world *world;
    vd_world_renderer_def def;
    vd_light light;
    int samples;
    vd_terrain_renderer *ground;
    vd_raster *raster;
    vd_coverage *coverage;
    float *costs;                  /* [world->node_count], seconds; 0: never drawn alone */
    vd_list draws, labels, clouds; /* of the last picture */
    bool has_labels, has_clouds;
    double cloud_detail;     /* factor on the detail of particles, above 1: coarser; 0: none */
    vd_splatter *splatter;   /* null until particles are drawn */
    vd_brick_view **views;   /* [assets]; each null until its particles are drawn; null without */
    vd_list roots;           /* uint32_t: of one asset in the last picture */
    vd_list cloud_runs;      /* see world_clouds.c */
    vd_sun_map *sun_map;     /* null: things throw no shadows */
    uint8_t *sun_states;     /* [entries]: vd_hill_shade_kind + 1 of each; 0: not asked yet */
    vd_world_light lighting; /* of the last picture */
    vd_world_uniforms uniforms[VD_HILL_SHADE_MIXED + 1]; /* by vd_hill_shade_kind */
    vd_frame *picture;                                   /* of the ground alone */
    size_t picture_pixels;                               /* that it has room for */
    vd_target *target;                                   /* a band of the picture */
    vd_buffer mix;                                       /* what is in the band's tiles */
    vd_target **tiles; /* [threads]: with one sample a pixel; null until one is drawn */
    int band_width, band_rows;
    vd_line_view lines;
    vd_horizon_map *horizon_map; /* null: the terrain hides nothing */
    vd_horizon *horizon;
    vd_buffer depth; /* of a picture with names or particles whose frame has none */
    struct {         /* see world_over.c */
        vd_label_layout *layout;
        vd_buffer requests, spots, which, parts, layers;
    } over;
};

/* ---- world_sun.c ----------------------------------------------------------------------------- */

/* Asks anew what the sun reaches, and draws the shadows that things throw. Returns VD_ERROR_MEMORY,
 * VD_ERROR_CANCELLED. */
VD_MUST_USE vd_status vd_world_sun_rise(vd_world_renderer *renderer, vd_job *job);

/* Aims the light at a camera. */
void vd_world_sun_aim(vd_world_renderer *renderer, const vd_camera *camera);

/* Uniforms of a placed object: in the sun, in the hills' shade, or on its edge. */
const vd_world_uniforms *vd_world_sun_on(vd_world_renderer *renderer, uint32_t entry);

/* Whether things throw shadows on the ground. */
bool vd_world_sun_throws(const vd_world_renderer *renderer);

/* ---- others ---------------------------------------------------------------------------------- */

/* What of a world a picture shows. */
typedef struct vd_world_part {
    const vd_terrain_window *ground; /* the cells that are drawn; null: all; VD_TERRAIN_NO_CELLS */
    const vd_cells *standing;        /* objects that stand on these cells: not labels, lines and
                                        particles; null: … */
    const vd_node *from;             /* … those below and at this node; null: … */
    const uint32_t *nodes;           /* … these placed ones, [count] */
    size_t count;
    bool bare; /* no shadows of things fall on the ground, as where nothing stands yet */
    bool mask; /* the ground hides what is behind and in it, and is transparent itself */
    bool sky;  /* where nothing is: the sky or the world's background; off: transparent black */
} vd_world_part;

/* Gathers single placed nodes for vd_world_draw_over: their labels and particles. */
VD_MUST_USE vd_status vd_world_begin_over(vd_world_renderer *renderer, const vd_camera *camera,
                                          const uint32_t *nodes, size_t count,
                                          const vd_frame *frame, vd_pass *pass,
                                          vd_world_stats *stats);

/* Gathers the particles at and below a node for vd_world_draw_clouds. */
VD_MUST_USE vd_status vd_world_begin_clouds(vd_world_renderer *renderer, const vd_camera *camera,
                                            const vd_node *from, const vd_frame *frame,
                                            vd_pass *pass, vd_world_stats *stats);

/* The cell of the terrain that an object stands on: under the middle of its bounds, or the nearest
 * to there that the map has. `sample_from_world` is affine, as vd_heightfield.world_from_sample. */
void vd_world_cell(const double sample_from_world[6], const vd_cells *map, double x, double y,
                   int *column, int *row);

/* The cells that a node's objects stand on, or of a group more than those. */
vd_cells vd_world_node_cells(const double sample_from_world[6], const vd_cells *map,
                             const vd_node *node);

/* What the terrain hides from a camera; null where it hides nothing. The renderer's, until it draws
 * or aims again. Returns VD_ERROR_CANCELLED. */
VD_MUST_USE vd_status vd_world_aim_horizon(vd_world_renderer *renderer, vd_job *job,
                                           const vd_camera *camera, int width, int height,
                                           const vd_horizon **out);

/* Walks the tree below a node and gathers what may be seen; with `standing` only what stands on
 * those cells of the terrain, which is a heightfield. Returns VD_ERROR_MEMORY. */
VD_MUST_USE vd_status vd_world_gather(vd_world_renderer *renderer, vd_pass *pass,
                                      const vd_node *from, const vd_cells *standing);

/* Gathers single placed nodes, without asking whether they are seen. */
VD_MUST_USE vd_status vd_world_gather_placed(vd_world_renderer *renderer, vd_pass *pass,
                                             const uint32_t *nodes, size_t count);

/* Draws a part of a world, without what lies over it; `pass` may then be handed to
 * vd_world_draw_over, while `camera` lives. */
VD_MUST_USE vd_status vd_world_draw_part(vd_world_renderer *renderer, vd_job *job,
                                         const vd_camera *camera, const vd_world_part *part,
                                         vd_frame *frame, vd_pass *pass, vd_world_stats *stats);

/* All cells of the terrain that are drawn. False when the terrain is none, or has no end. */
bool vd_world_cells(const vd_world_renderer *renderer, vd_cells *out);

/* Draws what was gathered into the frame, by bands of a target. */
VD_MUST_USE vd_status vd_world_composite(vd_world_renderer *renderer, vd_job *job,
                                         const vd_pass *pass, vd_frame *frame);

/* Draws the particles that were gathered over the frame, which must have depth. Returns what
 * vd_brick_view_update and vd_splatter_render do. */
VD_MUST_USE vd_status vd_world_draw_clouds(vd_world_renderer *renderer, vd_job *job,
                                           const vd_pass *pass, vd_frame *frame);

/* Ends what drawing particles keeps. */
void vd_world_release_clouds(vd_world_renderer *renderer);

/* Draws what lies over the picture: particles, names and the overlay. The frame must have depth. */
VD_MUST_USE vd_status vd_world_draw_over(vd_world_renderer *renderer, vd_job *job,
                                         const vd_pass *pass, vd_frame *frame);

#endif

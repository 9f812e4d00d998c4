/* world_renderer.h: the insides of a vd_world_renderer. */
#ifndef VEDUTA_WORLD_WORLD_RENDERER_H
#define VEDUTA_WORLD_WORLD_RENDERER_H

#include <veduta/label_layout.h>
#include "core/buffer.h"
#include "terrain/horizon.h"
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
    float *costs;          /* [world->node_count], seconds; 0: never drawn alone */
    vd_list draws, labels; /* of the last picture */
    bool has_labels;
    vd_sun_map *sun_map;     /* null: things throw no shadows */
    uint8_t *sun_states;     /* [entries]: vd_hill_shade_kind + 1 of each; 0: not asked yet */
    vd_world_light lighting; /* of the last picture */
    vd_world_uniforms uniforms[VD_HILL_SHADE_MIXED + 1]; /* by vd_hill_shade_kind */
    vd_frame *picture;                                   /* of the ground alone */
    vd_target *target;                                   /* a band of the picture */
    vd_buffer mix;                                       /* what is in the band's tiles */
    vd_target **tiles; /* [threads]: with one sample a pixel; null until one is drawn */
    int band_width, band_rows;
    vd_line_view lines;
    vd_horizon_map *horizon_map; /* null: the terrain hides nothing */
    vd_horizon *horizon;
    vd_buffer depth; /* of a picture with names whose frame has none */
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

/* Walks the tree below a node and gathers what may be seen. Returns VD_ERROR_MEMORY. */
VD_MUST_USE vd_status vd_world_gather(vd_world_renderer *renderer, vd_pass *pass,
                                      const vd_node *from);

/* Gathers single placed nodes, without asking whether they are seen. */
VD_MUST_USE vd_status vd_world_gather_placed(vd_world_renderer *renderer, vd_pass *pass,
                                             const uint32_t *nodes, size_t count);

/* Draws the ground and single placed nodes, without what lies over them; `pass` and `stats` may
 * then be handed to vd_world_draw_over. */
VD_MUST_USE vd_status vd_world_draw_nodes(vd_world_renderer *renderer, vd_job *job,
                                          const vd_camera *camera, const uint32_t *nodes,
                                          size_t count, vd_frame *frame, vd_pass *pass,
                                          vd_world_stats *stats);

/* Draws what was gathered into the frame, by bands of a target. */
VD_MUST_USE vd_status vd_world_composite(vd_world_renderer *renderer, vd_job *job,
                                         const vd_pass *pass, vd_frame *frame);

/* Draws what lies over the picture: names and the overlay. The frame must have depth. */
VD_MUST_USE vd_status vd_world_draw_over(vd_world_renderer *renderer, vd_job *job,
                                         const vd_pass *pass, vd_frame *frame);

#endif

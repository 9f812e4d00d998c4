/* pass.h: what is gathered for one picture. */
#ifndef VEDUTA_WORLD_PASS_H
#define VEDUTA_WORLD_PASS_H

#include <veduta/world.h>
#include "core/list.h"

typedef enum vd_asset_kind { VD_ASSET_MODEL = 0, VD_ASSET_PICTURE, VD_ASSET_BRICKS } vd_asset_kind;

typedef struct vd_line_view vd_line_view;
struct vd_horizon;

typedef struct vd_pass {
    vd_context *context;
    const vd_world *world;
    const vd_camera *camera;
    int width, height;
    bool ground;               /* the terrain is seen */
    bool bare;                 /* no shadows of things fall on it */
    bool mask;                 /* only in that it hides things: it is transparent */
    bool whole;                /* what was not gathered is not seen */
    vd_list *draws;            /* vd_draw */
    vd_list *labels;           /* const struct vd_label * */
    vd_list *clouds;           /* const struct vd_cloud * */
    const vd_line_view *lines; /* uniforms of lines */
    bool shading;              /* lit; else plain colours */
    const void *uniforms;      /* the light on what is being drawn: vd_world_uniforms */
    double drop_per_m2;        /* curvature: how much lower things appear, by squared distance */
    const struct vd_horizon *horizon; /* null: the terrain hides nothing */
    vd_world_stats *stats;
} vd_pass;

/* How much lower a place appears, metres. */
static inline double vd_pass_drop(const vd_pass *pass, vd_vec3 place) {
    const double x = place.x - pass->camera->eye.x, y = place.y - pass->camera->eye.y;
    return pass->drop_per_m2 * (x * x + y * y);
}

/* Returns VD_ERROR_MEMORY. */
static inline vd_status vd_pass_add_draw(vd_pass *pass, const vd_draw *draw) {
    vd_draw *to = vd_list_add(pass->context, pass->draws, 1, sizeof *to);
    if (to == NULL) {
        return vd_out_of_memory("a picture's draws", sizeof *to);
    }
    *to = *draw;
    return vd_success();
}

#endif

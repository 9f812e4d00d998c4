/* model_view.h: where the camera of a model's picture stands. */
#ifndef VEDUTA_APP_MODEL_VIEW_H
#define VEDUTA_APP_MODEL_VIEW_H

#include "view.h"

/* A model, placed in the world. */
typedef struct vd_placed_model {
    const vd_model *model;
    vd_matrix world_from_model;
    vd_vec3 min, max; /* of all of it, in the world */
} vd_placed_model;

/* Places a model with its up axis along the world's. */
vd_placed_model vd_place_model(const vd_model *model, vd_up up);

/* The settings of a model's picture without camera options: in front of it, a little to its left
 * and above, as near as it fits. */
vd_camera_settings vd_model_camera_default(void);

/* Length of the diagonal of the bounds. */
double vd_placed_diagonal(const vd_placed_model *placed);

/* Makes the camera, as vd_view_make does for terrain: without a distance all vertices are framed.
 * *nearest and *farthest receive the range of distances along the view axis. Returns
 * VD_ERROR_ARGUMENT. */
VD_MUST_USE vd_status vd_model_view_make(const vd_placed_model *placed,
                                         const vd_camera_settings *settings, int width, int height,
                                         vd_view *out, double *nearest, double *farthest);

/* Returns the camera in its spellings for --json; null when memory is out. */
json_t *vd_model_view_describe(const vd_view *view);

#endif

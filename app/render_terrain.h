/* render_terrain.h: elevation data loaded and described, for a picture and for many. */
#ifndef VEDUTA_APP_RENDER_TERRAIN_H
#define VEDUTA_APP_RENDER_TERRAIN_H

#include "render_run.h"
#include "scene.h"

/* Loads what the run's settings name and describes how it is drawn, haze aside. *scene must be
 * zeroed, and is finished by the caller also after a failure; `out` borrows it and the colormap. */
VD_MUST_USE vd_status vd_render_load_terrain(vd_render_run *run, vd_scene *scene,
                                             vd_colormap *colormap, vd_terrain_def *out);

/* The distance of --haze auto, for a camera so far outside the terrain's box. */
double vd_render_auto_haze(const vd_scene *scene, double clearance_m);

#endif

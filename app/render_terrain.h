/* render_terrain.h: the steps of a view of elevation data, for whoever draws more than one. */
#ifndef VEDUTA_APP_RENDER_TERRAIN_H
#define VEDUTA_APP_RENDER_TERRAIN_H

#include "render_run.h"
#include "scene.h"
#include "view.h"

/* Loads what the run's settings name (nothing: scene->terrain stays null) and describes how it is
 * drawn, haze aside: the first three of the steps below. *scene must be zeroed, and is finished by
 * the caller also after a failure; `out` borrows it and the colormap. */
VD_MUST_USE vd_status vd_render_load_terrain(vd_render_run *run, vd_scene *scene,
                                             vd_colormap *colormap, vd_terrain_def *out);

/* Loads what the settings name. */
VD_MUST_USE vd_status vd_render_terrain_load(vd_render_run *run, vd_scene *out);

/* Finds --colormap, or the one that suits the data where none was asked for. */
VD_MUST_USE vd_status vd_render_terrain_colormap(vd_context *context,
                                                 const vd_render_settings *settings,
                                                 const vd_scene *scene, vd_colormap *out);

/* What is drawn, without automatic haze. It points to the scene and the colormap. */
vd_terrain_def vd_render_terrain_def(const vd_render_settings *settings, const vd_scene *scene,
                                     const vd_colormap *colormap);

/* Makes the camera that the settings ask for, and settles in *def what depends on it: curvature and
 * automatic haze. */
VD_MUST_USE vd_status vd_render_terrain_view(vd_render_run *run, const vd_scene *scene,
                                             vd_terrain_def *def, vd_view *out);

/* The distance of --haze auto, for a camera so far outside the terrain's box. */
double vd_render_auto_haze(const vd_scene *scene, double clearance_m);

#endif

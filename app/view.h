/* view.h: from the camera options and a scene to a camera, and back to flags and JSON. */
#ifndef VEDUTA_APP_VIEW_H
#define VEDUTA_APP_VIEW_H

#include <jansson.h>

#include "render_settings.h"
#include "scene.h"

/* A camera, and the settings that lead to exactly this camera again: every position found or
 * converted on the way stands there as a number. */
typedef struct vd_view {
    vd_camera camera;
    vd_camera_settings exact;
    bool flattened; /* the curvature that would be on was left out: said beside the camera */
} vd_view;

/* The settings of a render command without camera options. */
vd_camera_settings vd_camera_settings_default(void);

/* Makes the camera of a picture. An orbit without a distance is framed: the nearest place from
 * which all of the terrain is in the picture. Returns VD_ERROR_ARGUMENT (a position outside the
 * map, or without georeference). */
VD_MUST_USE vd_status vd_view_make(const vd_scene *scene, const vd_camera_settings *settings,
                                   double exaggeration, bool curvature, int width, int height,
                                   vd_view *out);

/* Returns VD_ERROR_EMPTY when the camera is under ground, with what to do about it. */
VD_MUST_USE vd_status vd_view_check_ground(const vd_scene *scene, const vd_view *view,
                                           double exaggeration);

/* Metres from the eye to the nearest point of the terrain's box; 0 inside. */
double vd_view_clearance_m(const vd_scene *scene, const vd_view *view, double exaggeration);

/* Writes the flags that make the same camera, cut at out_bytes. */
void vd_view_flags(const vd_view *view, char *out, size_t out_bytes);

/* Returns the same as an options file; null when memory is out. */
json_t *vd_view_json(const vd_view *view);

/* Returns where the camera is in all three spellings, rounded as people want it; null when memory
 * is out. */
json_t *vd_view_describe(const vd_scene *scene, const vd_view *view, double exaggeration);

#endif

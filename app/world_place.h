/* world_place.h: putting a world's content where it belongs. */
#ifndef VEDUTA_APP_WORLD_PLACE_H
#define VEDUTA_APP_WORLD_PLACE_H

#include "geo_module.h"
#include "world_scene.h"

/* Adds everything that the run's content (null: nothing) and settings have to the scene's world,
 * which is not arranged then. Returns one sentence that names file and key: VD_ERROR_FORMAT (a
 * place off the map), what reading models, pictures and tracks returns, VD_ERROR_LIMIT,
 * VD_ERROR_MEMORY, VD_ERROR_CANCELLED. */
VD_MUST_USE vd_status vd_world_place(vd_world_scene *scene, const vd_render_run *run);

/* ---- for the files that do parts of it --------------------------------------------------------
 */

typedef struct vd_placer {
    vd_world_scene *scene;
    const vd_render_settings *settings;
    vd_job *job;
    const char *name; /* of the world file; null: there is none */
} vd_placer;

/* A failure: "world.json: objects[3]: WHAT". `key` is "--lines" where a flag said it. */
VD_MUST_USE vd_status vd_place_failure(const vd_placer *placer, const char *key,
                                       const vd_status *cause);

/* The ground as it is drawn; 0 in a world without terrain; −infinity off the map. */
double vd_place_ground(const vd_placer *placer, double x, double y);

/* The world's place of a spot; of the key's "at" or "position" when it is off the map. */
VD_MUST_USE vd_status vd_place_spot(const vd_placer *placer, const char *key,
                                    const vd_world_spot *spot, vd_vec3 *out);

/* Height at a place by a spot's rule; −infinity where there is no ground and it takes one. */
double vd_place_height(const vd_placer *placer, const vd_world_spot *spot, double x, double y);

/* Reads a vector file so that vd_place_feature_point understands its points. */
VD_MUST_USE vd_status vd_place_features(const vd_placer *placer, const char *key, const char *path,
                                        const char *property, vd_geo_module *geo,
                                        vd_features **out);
void vd_place_feature_point(const vd_placer *placer, const double point[3], double *x, double *y);

/* Adds an object, which is taken over in any case. */
VD_MUST_USE vd_status vd_place_add(const vd_placer *placer, vd_object *object);

VD_MUST_USE vd_status vd_place_lines(const vd_placer *placer, const vd_world_content *content);
VD_MUST_USE vd_status vd_place_particles(const vd_placer *placer, const vd_world_content *content);
VD_MUST_USE vd_status vd_place_labels(const vd_placer *placer, const vd_world_content *content);

#endif

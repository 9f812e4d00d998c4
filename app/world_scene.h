/* world_scene.h: a world, loaded and ready to be drawn: what `render`, `fly` and `view` share.
 *
 *     vd_render_run run = {.settings = &settings, .content = &content, .context = …, .job = …};
 *     status = vd_world_scene_load(&run, &scene);
 *     status = vd_world_scene_camera(scene, &run, &view);
 *     status = vd_world_scene_renderer(scene, job, &renderer);
 *     status = vd_world_renderer_draw(renderer, job, &view.camera, frame, &stats);
 *
 * An elevation file is a world with one thing in it. A world file (world_file.h) has more.
 */
#ifndef VEDUTA_APP_WORLD_SCENE_H
#define VEDUTA_APP_WORLD_SCENE_H

#include "render_terrain.h"

typedef struct vd_world_scene {
    vd_context *context;
    vd_scene scene; /* heights, georeference; no terrain: a world of objects alone */
    vd_colormap colormap;
    vd_terrain_def look;              /* terrain, light, sky. Its haze and curvature are settled by
                                         vd_world_scene_camera; after other changes vd_world_scene_relook */
    vd_world *world;                  /* arranged */
    size_t object_count;              /* in it, beside the terrain */
    vd_furniture *furniture;          /* null: none */
    struct vd_world_letters *letters; /* the furniture's font; null: none */
} vd_world_scene;

/* Loads terrain, models, pictures, fonts and tracks, and places what the run's content (null:
 * nothing but the terrain) and settings have. *out is owned by the caller and needs neither of them
 * any more. What is remarkable goes to the context's log; run->bad_use is set when a failure is the
 * command line's and not the data's. Cost: reading the files; some microseconds an instance. */
VD_MUST_USE vd_status vd_world_scene_load(vd_render_run *run, vd_world_scene **out);
void vd_world_scene_destroy(vd_world_scene **scene);

/* Makes the camera of the run's settings, and settles by it what is automatic: the haze, and
 * whether the Earth's curvature is left out. Renderers are created after that. Returns
 * VD_ERROR_ARGUMENT (a position outside the map, or without georeference) or VD_ERROR_EMPTY (the
 * camera is under ground). Many cameras: vd_render_auto_haze, then vd_world_scene_relook. */
VD_MUST_USE vd_status vd_world_scene_camera(vd_world_scene *scene, vd_render_run *run,
                                            vd_view *out);

/* Hands a changed `look` (light, filter, samples …) to the world: what the terrain is and the
 * exaggeration stay. It shows in renderers that are created after that. */
void vd_world_scene_relook(vd_world_scene *scene);

/* Makes the world anew for a `look` of another exaggeration, or of another formula: all that stands
 * on the ground is placed again. Renderers must have been destroyed. After a failure the scene may
 * only be rebuilt or destroyed. */
VD_MUST_USE vd_status vd_world_scene_rebuild(vd_world_scene *scene, vd_render_run *run);

/* Height of the ground at a place as it is drawn, metres; −infinity where there is none. A
 * vd_ground_function: `scene` is a vd_world_scene. Safe while another thread draws. */
double vd_world_scene_ground(void *scene, double x, double y);

/* Creates a renderer that also draws the world's title, arrow, bar and legend. It must be destroyed
 * before the scene; one at a time draws. */
VD_MUST_USE vd_status vd_world_scene_renderer(vd_world_scene *scene, vd_job *job,
                                              vd_world_renderer **out);

#endif

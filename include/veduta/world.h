/* world.h: objects, terrain, light and sky as one thing that is drawn into one frame.
 *
 *     status = vd_world_create(context, &def, &world);
 *     status = vd_world_add_model(world, model, &number);
 *     status = vd_instance_create(context, &instance, &object);
 *     status = vd_world_add(world, &object);
 *     status = vd_world_arrange(world, NULL);
 *     status = vd_world_renderer_create(context, NULL, world, NULL, &renderer);
 *     status = vd_world_renderer_draw(renderer, NULL, &camera, frame, NULL);
 *
 * Terrain, triangles, sprites and lines are composited sample by sample by depth. Particles are
 * blended over that, hidden by what is nearer; names and what else lies over a map are drawn over
 * the finished picture. Objects outside the picture or behind
 * the terrain's horizon cost a test of the group that they stand in.
 */
#ifndef VEDUTA_WORLD_H
#define VEDUTA_WORLD_H

#include <veduta/brick_view.h>
#include <veduta/furniture.h>
#include <veduta/model.h>
#include <veduta/object.h>
#include <veduta/terrain.h>

VD_BEGIN_DECLARATIONS

typedef struct vd_world vd_world;

/* ---- the world ------------------------------------------------------------------------------ */

typedef struct vd_world_def {
    /* Terrain, light, sky, haze, exaggeration, curvature. Neither a heightfield nor a function: no
     * terrain, the sky all around. What it points to is not owned and must outlive the world. */
    vd_terrain_def terrain;
} vd_world_def;

/* vd_terrain_def_default(). */
VD_API vd_world_def vd_world_def_default(void);

/* *out is owned by the caller. Returns VD_ERROR_ARGUMENT (names the field) or VD_ERROR_MEMORY. */
VD_API VD_MUST_USE vd_status vd_world_create(vd_context *context, const vd_world_def *def,
                                             vd_world **out);
VD_API void vd_world_destroy(vd_world **world);

/* Adds an asset and gives its number. A model is taken over on success (*model becomes null); a
 * picture is copied. Returns VD_ERROR_LIMIT (2^20 assets, a side above 16384) or VD_ERROR_MEMORY.
 */
VD_API VD_MUST_USE vd_status vd_world_add_model(vd_world *world, vd_model **model,
                                                uint32_t *number);
VD_API VD_MUST_USE vd_status vd_world_add_picture(vd_world *world, const vd_picture *picture,
                                                  uint32_t *number);

/* How the particles of a brick file look. They shine by themselves: sun, shadows and haze leave
 * them as they are. Fields are those of vd_brick_view_def and vd_splat_def. */
typedef struct vd_particle_look {
    vd_splat_kernel kernel;
    double detail_px; /* 0: half a pixel; negative: every particle is drawn, however far */
    vd_brick_color color;
    int attribute; /* CLASS and VALUE */
    vd_rgba8 constant;
    const vd_colormap *colormap; /* copied; relative; null: viridis */
    double range_min, range_max; /* equal: all that is in the file */
    bool log;
    double radius_m, radius_scale, opacity; /* 0: as vd_brick_view_def has it */
    size_t memory_bytes; /* of numbers that a renderer keeps of the file; 0: 1 GiB */
} vd_particle_look;

/* White discs of half a pixel's detail, of their own radius, opaque. */
VD_API vd_particle_look vd_particle_look_default(void);

/* Adds a brick file as an asset; `look` may be null. The open file is taken over on success
 * (*bricks becomes null): it is closed with the world. Its coordinates are the world's. Choosing
 * what to draw of it runs on the context that it was opened with: best the renderer's. Returns
 * VD_ERROR_ARGUMENT (names the look's field), VD_ERROR_LIMIT or VD_ERROR_MEMORY. */
VD_API VD_MUST_USE vd_status vd_world_add_bricks(vd_world *world, vd_bricks **bricks,
                                                 const vd_particle_look *look, uint32_t *number);

/* Places an asset of bricks: an object for each of the octree's largest parts of at most `most`
 * particles of the data (0: VD_WORLD_CLOUD_PARTICLES; where a brick alone has more, as many as it
 * has), so that each is culled by itself and may have an impostor. `count` (may be null) receives
 * how many. Returns as vd_world_add; some objects may then have been added. */
#define VD_WORLD_CLOUD_PARTICLES 100000 /* an impostor's best (Lawlor 2004, §6.6) */
VD_API VD_MUST_USE vd_status vd_world_add_particles(vd_world *world, uint32_t bricks, uint64_t most,
                                                    size_t *count);

/* Adds a placed object, taken over on success (*object becomes null). It is shown once the world is
 * arranged. Returns VD_ERROR_ARGUMENT (an asset that is not there or of the wrong sort),
 * VD_ERROR_LIMIT (2^24 objects) or VD_ERROR_MEMORY. */
VD_API VD_MUST_USE vd_status vd_world_add(vd_world *world, vd_object **object);

/* Makes the tree anew: objects that stand together come under one group, groups under groups, 16
 * and fewer to each; gives ids. The same objects added in the same order give the same tree. Cost:
 * O(n log n). Returns VD_ERROR_MEMORY or VD_ERROR_CANCELLED. */
VD_API VD_MUST_USE vd_status vd_world_arrange(vd_world *world, vd_job *job);

/* ---- its tree ------------------------------------------------------------------------------- */

/* Number of placed objects, without groups. */
VD_API size_t vd_world_object_count(const vd_world *world);

/* Number of particles in its brick files, placed or not. */
VD_API uint64_t vd_world_particle_count(const vd_world *world);

/* Returns an object by its id, null when there is none; it lives until the next arranging. */
VD_API const vd_object *vd_world_find(const vd_world *world, uint64_t id);

/* Number of children; those of the root for id 0. */
VD_API int vd_world_child_count(const vd_world *world, uint64_t id);

/* Bounds of everything but the terrain, metres; false when there is nothing. */
VD_API bool vd_world_bounds(const vd_world *world, vd_vec3 *min, vd_vec3 *max);

/* Height of the ground at a place as it is drawn (exaggerated), metres; −infinity where there is
 * none. Of a function: its value there. */
VD_API double vd_world_ground(const vd_world *world, double x, double y);

VD_API const vd_world_def *vd_world_look(const vd_world *world);

/* Changes how terrain, light and sky look; what the terrain is and its exaggeration stay as they
 * are. Renderers that are there keep what they were created with. */
VD_API void vd_world_set_look(vd_world *world, const vd_terrain_def *terrain);

/* ---- drawing it ----------------------------------------------------------------------------- */

typedef struct vd_world_renderer vd_world_renderer;

/* Makes what lies over a picture, such as vd_furniture_arrange does. What is given must live until
 * the picture is drawn. */
typedef vd_status vd_overlay_function(void *user, const vd_camera *camera, int width, int height,
                                      vd_overlay *out);

typedef struct vd_world_renderer_def {
    int samples; /* 1, 4, 8 a pixel; 0: the terrain's */
    bool hide_labels;
    vd_overlay_function *overlay; /* null: none */
    void *overlay_user;
} vd_world_renderer_def;

VD_API vd_world_renderer_def vd_world_renderer_def_default(void);

typedef struct vd_world_stats {
    vd_frame_stats terrain;
    uint64_t objects, drawn;  /* placed ones, and those that were neither culled nor too small */
    uint64_t outside, hidden; /* culled by the frustum; by the horizon */
    uint64_t too_small;       /* nothing of them reaches a sixteenth of a pixel */
    uint64_t triangles;       /* given to the rasterizer */
    uint64_t labels, labels_shown;
    uint64_t particles, particles_for; /* dots given to the splatter; what of the data they stand
                                          for */
    double prepare_s, ground_s, objects_s, finish_s; /* wall seconds of the stages */
} vd_world_stats;

/* Creates a renderer of an arranged world, which must outlive it unchanged; `def` may be null.
 * Cost: vd_terrain_renderer_create, shadows. Returns VD_ERROR_ARGUMENT, VD_ERROR_MEMORY or
 * VD_ERROR_CANCELLED. */
VD_API VD_MUST_USE vd_status vd_world_renderer_create(vd_context *context, vd_job *job,
                                                      const vd_world *world,
                                                      const vd_world_renderer_def *def,
                                                      vd_world_renderer **out);
VD_API void vd_world_renderer_destroy(vd_world_renderer **renderer);

/* Draws a picture of everything into the frame (all planes it has). Where particles lie over
 * something, depth and id are those of what is under them. Several brick files in one picture are
 * drawn one after the other, the farthest first. A second picture like the first allocates
 * nothing. `job` and `stats` may be null. Returns VD_ERROR_ARGUMENT, VD_ERROR_LIMIT,
 * VD_ERROR_FORMAT (a damaged brick), VD_ERROR_MEMORY or VD_ERROR_CANCELLED; after the last three
 * the frame holds part of a picture. */
VD_API VD_MUST_USE vd_status vd_world_renderer_draw(vd_world_renderer *renderer, vd_job *job,
                                                    const vd_camera *camera, vd_frame *frame,
                                                    vd_world_stats *stats);

/* Draws the overlay alone, over transparent black: what stays on screen whatever moves behind it.
 * *overlay tells where it is, until the next picture. Returns what the overlay's function does,
 * VD_ERROR_MEMORY or VD_ERROR_CANCELLED. */
VD_API VD_MUST_USE vd_status vd_world_renderer_draw_overlay(vd_world_renderer *renderer,
                                                            vd_job *job, const vd_camera *camera,
                                                            vd_frame *frame, vd_overlay *overlay);
VD_API bool vd_world_renderer_has_overlay(const vd_world_renderer *renderer);

/* Draws what stands at and below one id alone, over transparent black: what an impostor shows. */
VD_API VD_MUST_USE vd_status vd_world_renderer_draw_object(vd_world_renderer *renderer, vd_job *job,
                                                           const vd_camera *camera, uint64_t id,
                                                           vd_frame *frame, vd_world_stats *stats);

/* Returns the wall seconds that drawing what stands at and below an id has taken, smoothed: four
 * fifths of what it was and a fifth of the last; 0 before the first. */
VD_API double vd_world_renderer_cost(const vd_world_renderer *renderer, uint64_t id);

/* Changes the light: a sun that moves. Cost: vd_terrain_renderer_light, and the shadows of all
 * objects. */
VD_API VD_MUST_USE vd_status vd_world_renderer_light(vd_world_renderer *renderer, vd_job *job,
                                                     const vd_light *light);

/* Returns the light; borrowed. */
VD_API const vd_light *vd_world_renderer_get_light(const vd_world_renderer *renderer);

/* Changes samples a pixel, from the next picture on: 1, 4 or 8. */
VD_API VD_MUST_USE vd_status vd_world_renderer_set_samples(vd_world_renderer *renderer,
                                                           int samples);

VD_END_DECLARATIONS

#endif

/* world_renderer.c: pictures of a world. */
#include <math.h>
#include "core/core.h"
#include "image/image.h"
#include "terrain/lens_renderer.h"
#include "world/world_renderer.h"

vd_world_renderer_def vd_world_renderer_def_default(void) {
    vd_world_renderer_def def = {.samples = 0};
    return def;
}

static vd_status check_samples(int samples) {
    return vd_sample_offsets(samples) != NULL
               ? vd_success()
               : vd_failure(VD_ERROR_ARGUMENT,
                            "a world cannot be drawn with %d samples a pixel; give 1, 4 or 8",
                            samples);
}

static bool any_of(const vd_world *world, vd_object_kind kind) {
    bool any = false;
    for (size_t i = 0; i < world->entry_list.count && !any; i++) {
        any = world->entries[i].object->kind == (uint32_t)kind;
    }
    return any;
}

vd_status vd_world_renderer_create(vd_context *context, vd_job *job, const vd_world *world,
                                   const vd_world_renderer_def *def, vd_world_renderer **out) {
    if (world->nodes == NULL) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "a world must be arranged before it is drawn; call vd_world_arrange");
    }
    vd_world_renderer *renderer = vd_allocate_zero(context, 1, sizeof *renderer);
    if (renderer == NULL) {
        return vd_out_of_memory("a world's renderer", sizeof *renderer);
    }
    renderer->context = context;
    renderer->world = world;
    renderer->def = def != NULL ? *def : vd_world_renderer_def_default();
    renderer->samples =
        renderer->def.samples != 0 ? renderer->def.samples : world->def.terrain.samples;
    renderer->light = world->def.terrain.light;
    renderer->has_labels = !renderer->def.hide_labels && any_of(world, VD_OBJECT_LABEL);
    renderer->has_clouds = any_of(world, VD_OBJECT_PARTICLES);
    vd_terrain_def terrain = world->def.terrain;
    terrain.samples = renderer->samples;
    /* Without a terrain the first number is another's, and the last one nobody's. */
    terrain.object_id =
        vd_object_child_id(0, world->no_terrain == NULL ? 1 : VD_OBJECT_MAX_CHILDREN);
    vd_status status = check_samples(renderer->samples);
    renderer->costs = vd_allocate_zero(context, world->node_count, sizeof *renderer->costs);
    if (status.code == VD_OK && renderer->costs == NULL) {
        status = vd_out_of_memory("objects' costs", world->node_count * sizeof *renderer->costs);
    }
    if (status.code == VD_OK) {
        status = vd_terrain_renderer_create(context, job, &terrain, &renderer->ground);
    }
    if (status.code == VD_OK) {
        status = vd_raster_create(context, &renderer->raster);
    }
    if (status.code == VD_OK) {
        status = vd_coverage_create(context, &renderer->coverage);
    }
    if (status.code == VD_OK) {
        status = vd_label_layout_create(context, &renderer->over.layout);
    }
    if (status.code == VD_OK && terrain.heightfield != NULL && world->no_terrain == NULL) {
        status = vd_horizon_map_create(context, job, terrain.heightfield, &terrain.window,
                                       &renderer->horizon_map);
    }
    if (status.code == VD_OK) {
        status = vd_horizon_create(context, &renderer->horizon);
    }
    if (status.code == VD_OK) {
        status = vd_world_sun_rise(renderer, job);
    }
    if (status.code != VD_OK) {
        vd_world_renderer_destroy(&renderer);
        return status;
    }
    *out = renderer;
    return status;
}

void vd_world_renderer_destroy(vd_world_renderer **renderer_pointer) {
    vd_world_renderer *renderer = renderer_pointer != NULL ? *renderer_pointer : NULL;
    if (renderer == NULL) {
        return;
    }
    vd_sun_map_destroy(&renderer->sun_map);
    vd_release(renderer->context, renderer->sun_states);
    vd_horizon_map_destroy(&renderer->horizon_map);
    vd_horizon_destroy(&renderer->horizon);
    vd_label_layout_destroy(&renderer->over.layout);
    vd_world_release_clouds(renderer);
    vd_buffer *const buffers[] = {&renderer->depth,      &renderer->over.requests,
                                  &renderer->over.spots, &renderer->over.which,
                                  &renderer->over.parts, &renderer->over.layers};
    for (size_t i = 0; i < sizeof buffers / sizeof buffers[0]; i++) {
        vd_release(renderer->context, buffers[i]->memory);
    }
    for (int i = 0; renderer->tiles != NULL && i < vd_context_threads(renderer->context); i++) {
        vd_target_destroy(&renderer->tiles[i]);
    }
    vd_release(renderer->context, renderer->tiles);
    vd_target_destroy(&renderer->target);
    vd_frame_destroy(&renderer->picture);
    vd_release(renderer->context, renderer->mix.memory);
    vd_coverage_destroy(&renderer->coverage);
    vd_raster_destroy(&renderer->raster);
    vd_terrain_renderer_destroy(&renderer->ground);
    vd_release(renderer->context, renderer->costs);
    vd_release(renderer->context, renderer->draws.data);
    vd_release(renderer->context, renderer->labels.data);
    vd_release(renderer->context, renderer->clouds.data);
    vd_release(renderer->context, renderer);
    *renderer_pointer = NULL;
}

double vd_world_renderer_cost(const vd_world_renderer *renderer, uint64_t id) {
    const vd_node *node = vd_world_node(renderer->world, id);
    return node != NULL ? (double)renderer->costs[node - renderer->world->nodes] : 0.0;
}

vd_status vd_world_renderer_light(vd_world_renderer *renderer, vd_job *job, const vd_light *light) {
    const vd_status status = vd_terrain_renderer_light(renderer->ground, job, light);
    if (status.code != VD_OK) {
        return status;
    }
    renderer->light = *light;
    return vd_world_sun_rise(renderer, job);
}

const vd_light *vd_world_renderer_get_light(const vd_world_renderer *renderer) {
    return &renderer->light;
}

vd_status vd_world_renderer_set_samples(vd_world_renderer *renderer, int samples) {
    const vd_status status = check_samples(samples);
    if (status.code == VD_OK) {
        renderer->samples = renderer->ground->def.samples = samples;
    }
    return status;
}

/* Fewer objects are not worth a horizon. */
#define LEAST_HIDDEN 64

/* What does not hang on the tree: where lines are seen from. */
static void aim(vd_world_renderer *renderer, vd_pass *pass) {
    const bool flat = !renderer->world->def.terrain.curvature;
    pass->drop_per_m2 = flat ? 0.0 : vd_curvature_drop(1.0);
    renderer->lines = (vd_line_view){
        .eye = pass->camera->eye, .drop_per_m2 = pass->drop_per_m2, .nearer = 1.0f + 0x1p-9f};
    pass->lines = &renderer->lines;
    pass->shading = renderer->world->def.terrain.shading;
    vd_world_sun_aim(renderer, pass->camera);
}

vd_status vd_world_aim_horizon(vd_world_renderer *renderer, vd_job *job, const vd_camera *camera,
                               int width, int height, const vd_horizon **out) {
    vd_horizon_view view;
    *out = NULL;
    if (renderer->horizon_map == NULL) {
        return vd_success();
    }
    vd_horizon_view_of(&renderer->ground->def, camera, width, height, &view);
    *out = renderer->horizon;
    return vd_horizon_aim(renderer->horizon, job, renderer->horizon_map, &view);
}

/* What the terrain hides, of a whole world. */
static vd_status aim_horizon(vd_world_renderer *renderer, vd_job *job, vd_pass *pass) {
    return renderer->world->node_count >= LEAST_HIDDEN
               ? vd_world_aim_horizon(renderer, job, pass->camera, pass->width, pass->height,
                                      &pass->horizon)
               : vd_success();
}

static vd_pass begin_pass(vd_world_renderer *renderer, const vd_camera *camera,
                          const vd_frame *frame, vd_world_stats *stats) {
    renderer->draws.count = renderer->labels.count = renderer->clouds.count = 0;
    vd_pass pass = {.context = renderer->context,
                    .world = renderer->world,
                    .camera = camera,
                    .width = frame->width,
                    .height = frame->height,
                    .draws = &renderer->draws,
                    .labels = &renderer->labels,
                    .clouds = &renderer->clouds,
                    .stats = stats};
    aim(renderer, &pass);
    return pass;
}

/* Draws what was gathered. */
static vd_status draw_gathered(vd_world_renderer *renderer, vd_job *job, const vd_pass *pass,
                               vd_frame *frame) {
    if (renderer->draws.count > 0 || !pass->ground ||
        (vd_world_sun_throws(renderer) && !pass->bare)) {
        return vd_world_composite(renderer, job, pass, frame);
    }
    const uint64_t ground = vd_clock_ns();
    const vd_status status =
        vd_terrain_renderer_draw(renderer->ground, job, pass->camera, frame, &pass->stats->terrain);
    pass->stats->ground_s = 1e-9 * (double)(vd_clock_ns() - ground);
    return status;
}

/* Gathers and draws what stands at and below a node; the root's pictures have a ground, which
 * without a terrain is the sky. */
static vd_status draw(vd_world_renderer *renderer, vd_job *job, vd_pass *pass, const vd_node *from,
                      vd_frame *frame) {
    const bool whole = from == renderer->world->nodes;
    const uint64_t start = vd_clock_ns();
    vd_frame_forget_objects(frame);
    vd_status status = whole ? aim_horizon(renderer, job, pass) : vd_success();
    if (status.code == VD_OK) {
        status = vd_world_gather(renderer, pass, from, NULL);
    }
    pass->ground = pass->ground || whole;
    pass->whole = whole;
    pass->stats->prepare_s = 1e-9 * (double)(vd_clock_ns() - start);
    return status.code == VD_OK ? draw_gathered(renderer, job, pass, frame) : status;
}

/* How the ground is drawn for a while; returns how it was. */
static vd_terrain_def set_ground(vd_world_renderer *renderer, const vd_terrain_window *window,
                                 bool sky) {
    vd_terrain_def *look = &renderer->ground->def;
    const vd_terrain_def kept = *look;
    if (window != NULL) {
        look->window = *window;
    }
    if (!sky) {
        look->sky = false;
        look->background = (vd_rgba8){0, 0, 0, 0};
    }
    return kept;
}

vd_status vd_world_begin_over(vd_world_renderer *renderer, const vd_camera *camera,
                              const uint32_t *nodes, size_t count, const vd_frame *frame,
                              vd_pass *pass, vd_world_stats *stats) {
    *pass = begin_pass(renderer, camera, frame, stats);
    return vd_world_gather_placed(renderer, pass, nodes, count);
}

vd_status vd_world_begin_clouds(vd_world_renderer *renderer, const vd_camera *camera,
                                const vd_node *from, const vd_frame *frame, vd_pass *pass,
                                vd_world_stats *stats) {
    *pass = begin_pass(renderer, camera, frame, stats);
    return vd_world_gather(renderer, pass, from, NULL);
}

vd_status vd_world_draw_part(vd_world_renderer *renderer, vd_job *job, const vd_camera *camera,
                             const vd_world_part *part, vd_frame *frame, vd_pass *pass,
                             vd_world_stats *stats) {
    *pass = begin_pass(renderer, camera, frame, stats);
    pass->ground = true;
    pass->mask = part->mask;
    pass->bare = part->bare;
    vd_frame_forget_objects(frame);
    const vd_terrain_def kept = set_ground(renderer, part->ground, part->sky);
    const vd_node *from = part->standing != NULL ? renderer->world->nodes : part->from;
    vd_status status = from != NULL
                           ? vd_world_gather(renderer, pass, from, part->standing)
                           : vd_world_gather_placed(renderer, pass, part->nodes, part->count);
    if (status.code == VD_OK) {
        status = draw_gathered(renderer, job, pass, frame);
    }
    renderer->ground->def = kept;
    return status;
}

/* A picture and what lies over it, into a frame that has depth. */
static vd_status draw_all(vd_world_renderer *renderer, vd_job *job, const vd_camera *camera,
                          vd_frame *frame, vd_world_stats *stats) {
    vd_pass pass = begin_pass(renderer, camera, frame, stats);
    vd_status status = draw(renderer, job, &pass, renderer->world->nodes, frame);
    const uint64_t start = vd_clock_ns();
    if (status.code == VD_OK) {
        status = vd_world_draw_over(renderer, job, &pass, frame);
    }
    stats->finish_s += 1e-9 * (double)(vd_clock_ns() - start);
    return status;
}

/* Gives a frame a depth plane where things are drawn over it by depth and it has none. */
static vd_status lend_depth(vd_world_renderer *renderer, bool needed, vd_frame *frame, bool *lent) {
    vd_status status = vd_success();
    *lent = needed && frame->depth == NULL;
    if (*lent) {
        status = vd_buffer_reserve(renderer->context, &renderer->depth, "a picture's depth",
                                   frame->stride * (size_t)frame->height, sizeof(float));
        frame->depth = renderer->depth.memory;
    }
    return status;
}

vd_status vd_world_renderer_draw(vd_world_renderer *renderer, vd_job *job, const vd_camera *camera,
                                 vd_frame *frame, vd_world_stats *stats) {
    vd_world_stats own = {.objects = 0};
    vd_status status = vd_camera_validate(camera);
    bool lent = false;
    if (status.code == VD_OK) {
        status = lend_depth(renderer, renderer->has_labels || renderer->has_clouds, frame, &lent);
    }
    if (status.code == VD_OK) {
        status = draw_all(renderer, job, camera, frame, &own);
    }
    if (lent) {
        frame->depth = NULL;
    }
    if (stats != NULL) {
        *stats = own;
    }
    return status;
}

vd_status vd_world_renderer_draw_object(vd_world_renderer *renderer, vd_job *job,
                                        const vd_camera *camera, uint64_t id, vd_frame *frame,
                                        vd_world_stats *stats) {
    const vd_node *from = vd_world_node(renderer->world, id);
    if (from == NULL) {
        return vd_failure(VD_ERROR_ARGUMENT, "there is no object %016llx in the world",
                          (unsigned long long)id);
    }
    vd_status status = vd_camera_validate(camera);
    if (status.code != VD_OK) {
        return status;
    }
    vd_world_stats own = {.objects = 0};
    vd_pass pass = begin_pass(renderer, camera, frame, &own);
    const vd_terrain_def kept = set_ground(renderer, NULL, false);
    const uint64_t start = vd_clock_ns();
    bool lent = false;
    status = lend_depth(renderer, renderer->has_clouds, frame, &lent);
    if (status.code == VD_OK) {
        status = draw(renderer, job, &pass, from, frame);
    }
    if (status.code == VD_OK) {
        status = vd_world_draw_clouds(renderer, job, &pass, frame);
    }
    if (lent) {
        frame->depth = NULL;
    }
    const float seconds = 1e-9f * (float)(vd_clock_ns() - start);
    float *cost = &renderer->costs[from - renderer->world->nodes];
    *cost = *cost > 0.0f ? 0.8f * *cost + 0.2f * seconds : seconds;
    renderer->ground->def = kept;
    if (stats != NULL) {
        *stats = own;
    }
    return status;
}

/* lens_renderer.c: what a terrain's pictures share, and the two passes that draw one. */
#include "terrain/lens_renderer.h"
#include <string.h>
#include "core/core.h"
#include "image/image.h"

/* Counters of two workers never share a cache line. */
struct vd_lens_worker {
    _Alignas(64) vd_lens_counts counts;
};

static vd_status init(vd_context *context, vd_job *job, vd_terrain_renderer *renderer) {
    const vd_terrain_def *def = &renderer->def;
    const size_t threads = (size_t)vd_context_threads(context);
    renderer->workers = vd_allocate_zero(context, threads, sizeof *renderer->workers);
    if (renderer->workers == NULL) {
        return vd_out_of_memory("the terrain's workers", threads * sizeof *renderer->workers);
    }
    vd_lens_make_sky(&def->light, renderer->sky);
    renderer->kernels = def->method == VD_TERRAIN_RAYCAST
                            ? &vd_lens_methods_reference
                            : vd_lens_methods_for(vd_context_isa(context));
    if (def->function != NULL) {
        return vd_lens_function_init(context, job, def, &renderer->function);
    }
    if (def->method == VD_TERRAIN_RAYCAST) {
        vd_status status = vd_lens_map_init_reference(context, def, &renderer->map);
        return status.code == VD_OK ? vd_lens_map_light_reference(&renderer->map, def) : status;
    }
    vd_status status = vd_lens_map_init(context, job, def, &renderer->map);
    return status.code == VD_OK ? vd_lens_map_light(&renderer->map, job, def) : status;
}

const vd_lens_methods *vd_lens_methods_for(vd_isa isa) {
#if defined(__x86_64__)
    return isa == VD_ISA_V4   ? &vd_lens_methods_v4
           : isa == VD_ISA_V3 ? &vd_lens_methods_v3
                              : &vd_lens_methods_v2;
#else
    (void)isa;
    return &vd_lens_methods_v2;
#endif
}

vd_status vd_terrain_renderer_create(vd_context *context, vd_job *job, const vd_terrain_def *def,
                                     vd_terrain_renderer **out) {
    if (context == NULL || def == NULL || out == NULL) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "a terrain's renderer needs a context, a def and a place to put it");
    }
    vd_status status = vd_terrain_check(def);
    if (status.code != VD_OK) {
        return status;
    }
    vd_terrain_renderer *renderer = vd_allocate_zero(context, 1, sizeof *renderer);
    if (renderer == NULL) {
        return vd_out_of_memory("a terrain's renderer", sizeof *renderer);
    }
    renderer->context = context;
    renderer->def = *def;
    if (def->colormap != NULL) {
        renderer->colormap = *def->colormap;
        renderer->def.colormap = &renderer->colormap;
    }
    status = init(context, job, renderer);
    if (status.code != VD_OK) {
        vd_terrain_renderer_destroy(&renderer);
        return status;
    }
    *out = renderer;
    return status;
}

void vd_terrain_renderer_destroy(vd_terrain_renderer **renderer_in_out) {
    if (renderer_in_out == NULL || *renderer_in_out == NULL) {
        return;
    }
    vd_terrain_renderer *renderer = *renderer_in_out;
    *renderer_in_out = NULL;
    vd_lens_map_finish(&renderer->map);
    vd_lens_function_finish(&renderer->function);
    vd_frame_destroy(&renderer->window);
    vd_release(renderer->context, renderer->depth.memory);
    vd_release(renderer->context, renderer->starts.memory);
    vd_release(renderer->context, renderer->mixed.memory);
    vd_release(renderer->context, renderer->list.memory);
    vd_release(renderer->context, renderer->workers);
    vd_release(renderer->context, renderer);
}

vd_status vd_terrain_renderer_light(vd_terrain_renderer *renderer, vd_job *job,
                                    const vd_light *light) {
    vd_terrain_def def = renderer->def;
    def.light = *light;
    vd_status status = vd_terrain_check(&def);
    if (status.code != VD_OK) {
        return status;
    }
    renderer->def = def;
    vd_lens_make_sky(light, renderer->sky);
    if (def.function != NULL) {
        return status; /* lit with every picture */
    }
    return def.method == VD_TERRAIN_RAYCAST ? vd_lens_map_light_reference(&renderer->map, &def)
                                            : vd_lens_map_light(&renderer->map, job, &def);
}

vd_status vd_terrain_renderer_set_samples(vd_terrain_renderer *renderer, int samples) {
    vd_terrain_def def = renderer->def;
    def.samples = samples;
    vd_status status = vd_terrain_check(&def);
    if (status.code == VD_OK) {
        renderer->def = def;
    }
    return status;
}

vd_status vd_lens_prepare(vd_terrain_renderer *renderer, vd_job *job, const vd_camera *camera,
                          int width, int height) {
    if (renderer->def.function == NULL) {
        return vd_success();
    }
    return (renderer->def.method == VD_TERRAIN_RAYCAST ? vd_lens_function_aim_reference
                                                       : vd_lens_function_aim)(
        &renderer->function, job, &renderer->def, camera, width, height, &renderer->map);
}

typedef struct pass {
    const vd_lens_picture *picture;
    vd_kernel_lens *kernel;
    vd_lens_worker *workers;
    const vd_lens_tiles *tiles;
} pass;

static void draw_tile(void *user, int index, int worker) {
    const pass *p = user;
    const int tile =
        p->tiles->list != NULL ? p->tiles->list[index] : p->tiles->first + index * p->tiles->step;
    const int tiles_x = vd_lens_tile_count(p->picture->frame->width);
    p->kernel(p->picture, tile % tiles_x * VD_LENS_TILE, tile / tiles_x * VD_LENS_TILE,
              &p->workers[worker].counts);
}

static vd_status run(vd_terrain_renderer *renderer, vd_job *job, const vd_lens_picture *picture,
                     const vd_lens_tiles *tiles) {
    pass p = {picture, renderer->kernels->draw, renderer->workers, tiles};
    vd_status status = vd_parallel_for(renderer->context, job, tiles->count, draw_tile, &p);
    if (status.code == VD_OK && picture->view->samples > 1) {
        p.kernel = renderer->kernels->refine;
        status = vd_parallel_for(renderer->context, job, tiles->count, draw_tile, &p);
    }
    return status;
}

vd_status vd_lens_draw(vd_terrain_renderer *renderer, vd_job *job, const vd_camera *camera,
                       uint32_t terrain_id, const vd_lens_tiles *tiles, vd_frame *frame,
                       vd_frame_stats *stats) {
    vd_lens_picture picture;
    memset(&picture, 0, sizeof picture);
    picture.frame = frame;
    picture.depth_stride = vd_row_stride((size_t)frame->width, sizeof(float));
    picture.starts_stride = vd_row_stride((size_t)(frame->width + 3) / 4, sizeof(float));
    vd_status status =
        vd_buffer_reserve(renderer->context, &renderer->depth, "a picture's depths",
                          picture.depth_stride * (size_t)frame->height, sizeof *picture.depth);
    if (status.code == VD_OK) {
        status = vd_buffer_reserve(renderer->context, &renderer->starts, "a picture's beams",
                                   picture.starts_stride * (((size_t)frame->height + 3) / 4),
                                   sizeof *picture.starts);
    }
    if (status.code != VD_OK) {
        return status;
    }
    picture.depth = renderer->depth.memory;
    picture.starts = renderer->starts.memory;
    picture.view = &renderer->view;
    vd_lens_view_init(&renderer->map, &renderer->def, camera, frame->width, frame->height,
                      renderer->sky, &renderer->view);
    renderer->view.terrain_id = terrain_id;
    const int threads = vd_context_threads(renderer->context);
    memset(renderer->workers, 0, (size_t)threads * sizeof *renderer->workers);
    status = run(renderer, job, &picture, tiles);
    if (stats != NULL) {
        memset(stats, 0, sizeof *stats);
        for (int i = 0; i < threads; i++) {
            stats->samples += renderer->workers[i].counts.samples;
            stats->hits += renderer->workers[i].counts.hits;
        }
    }
    return status;
}

vd_status vd_terrain_renderer_draw(vd_terrain_renderer *renderer, vd_job *job,
                                   const vd_camera *camera, vd_frame *frame,
                                   vd_frame_stats *stats) {
    if (renderer == NULL || camera == NULL || frame == NULL) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "drawing a terrain needs a renderer, a camera and a frame");
    }
    uint32_t terrain_id = 0;
    vd_status status = vd_camera_validate(camera);
    if (status.code == VD_OK) {
        status = vd_frame_add_object(frame, renderer->def.object_id, &terrain_id);
    }
    if (status.code == VD_OK) {
        status = vd_lens_prepare(renderer, job, camera, frame->width, frame->height);
    }
    if (status.code != VD_OK) {
        return status;
    }
    const vd_lens_tiles all = {
        0, 1, vd_lens_tile_count(frame->width) * vd_lens_tile_count(frame->height), NULL};
    return vd_lens_draw(renderer, job, camera, terrain_id, &all, frame, stats);
}

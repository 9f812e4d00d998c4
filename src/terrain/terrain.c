/* Drawing a terrain: the loop over tiles that all lens methods share, and the colour of a sample.
 *
 * A tile is drawn into a small target of its worker's own (TILE² pixels × samples, about 64 KiB at
 * 4 samples: it stays in the second-level cache) and resolved into the frame, so a picture needs no
 * full-size sample buffer, and every pixel has one writer.
 */
#include <math.h>
#include <string.h>
#include "core/core.h"
#include "terrain/surface.h"

#define TILE 32

typedef struct worker_scratch {
    vd_target *target;
    uint64_t samples, hits;
    char padding[64]; /* counters of two workers never share a cache line */
} worker_scratch;

typedef struct render {
    const vd_terrain_def *def;
    const vd_camera *camera;
    vd_surface surface;
    vd_surface_cast_function *cast;
    vd_frame *frame;
    uint16_t background[4];
    uint32_t terrain_id;
    int tiles_x, first_tile, tile_step;
    worker_scratch *workers;
} render;

vd_terrain_def vd_terrain_def_default(void) {
    vd_terrain_def def;
    memset(&def, 0, sizeof def);
    def.light = vd_light_daylight(5.497787143782138, 0.7853981633974483);
    def.method = VD_TERRAIN_MARCH;
    def.filter = VD_FILTER_LINEAR;
    def.samples = 4;
    def.exaggeration = 1.0;
    def.shading = true;
    def.shadows = true;
    def.sky = true;
    def.object_id = 1;
    return def;
}

const char *vd_terrain_method_name(vd_terrain_method method) {
    static const char *const names[VD_TERRAIN_METHOD_COUNT] = {"march", "raycast"};
    return method >= 0 && method < VD_TERRAIN_METHOD_COUNT ? names[method] : "unknown";
}

static void encode(vd_linear color, uint16_t out[4]) {
    out[0] = vd_srgb_encode(color.r);
    out[1] = vd_srgb_encode(color.g);
    out[2] = vd_srgb_encode(color.b);
    out[3] = 65535;
}

/* Premultiplies in encoded space: 8-bit colour times 8-bit alpha, to 16 bits. */
static void premultiply(vd_rgba8 color, uint16_t out[4]) {
    const uint32_t channels[3] = {color.r, color.g, color.b};
    for (int i = 0; i < 3; i++) {
        out[i] = (uint16_t)((channels[i] * 257u * color.a + 127u) / 255u);
    }
    out[3] = (uint16_t)(color.a * 257u);
}

static bool sun_is_hidden(const render *r, const vd_surface_hit *hit, vd_vec3 sun) {
    const vd_surface *surface = &r->surface;
    const double *m = surface->heightfield->world_from_sample;
    vd_ray ray;
    ray.origin.x = m[0] + (hit->column * m[1] + hit->row * m[2]);
    ray.origin.y = m[3] + (hit->column * m[4] + hit->row * m[5]);
    ray.origin.z = hit->height + surface->lift;
    ray.direction = sun;
    vd_surface_hit blocker;
    return r->cast(surface, &ray, 0.0, 0.0, &blocker);
}

static void shade_hit(const render *r, const vd_ray *ray, const vd_surface_hit *hit,
                      uint16_t out[4]) {
    const vd_terrain_def *def = r->def;
    const vd_rgba8 encoded = vd_surface_color(def, hit);
    if (!def->shading && !(def->light.haze_m > 0.0)) {
        premultiply((vd_rgba8){encoded.r, encoded.g, encoded.b, 255}, out);
        return;
    }
    vd_linear color = vd_linear_from_rgba8(encoded);
    if (def->shading) {
        const vd_vec3 normal = vd_surface_normal(&r->surface, hit->column, hit->row);
        const vd_vec3 sun = def->light.sun_direction;
        float visible = 1.0f;
        if (def->shadows && sun.z > 0.0 && vd_vec3_dot(normal, sun) > 0.0 &&
            sun_is_hidden(r, hit, sun)) {
            visible = 0.0f;
        }
        color = vd_light_shade(&def->light, color, normal, visible);
    }
    color = vd_light_haze(&def->light, color, hit->t * vd_vec3_length(ray->direction));
    encode(color, out);
}

static void draw_sample(const render *r, vd_target *target, size_t index, double x, double y,
                        worker_scratch *scratch) {
    const vd_ray ray = vd_camera_ray(r->camera, x, y);
    vd_surface_hit hit;
    uint16_t *color = target->color + 4 * index;
    scratch->samples++;
    if (r->cast(&r->surface, &ray, r->camera->near_m, r->surface.curvature, &hit)) {
        scratch->hits++;
        shade_hit(r, &ray, &hit, color);
        target->depth[index] = vd_camera_depth(r->camera, hit.t);
        target->id[index] = r->terrain_id;
        return;
    }
    if (r->def->sky) {
        const double sine = ray.direction.z / vd_vec3_length(ray.direction);
        encode(vd_light_sky(&r->def->light, (float)sine), color);
    }
}

static void draw_tile(void *user, int index, int worker) {
    const render *r = user;
    worker_scratch *scratch = &r->workers[worker];
    vd_target *target = scratch->target;
    const int tile = r->first_tile + index * r->tile_step;
    target->x = tile % r->tiles_x * TILE;
    target->y = tile / r->tiles_x * TILE;
    target->width = r->frame->width - target->x < TILE ? r->frame->width - target->x : TILE;
    target->height = r->frame->height - target->y < TILE ? r->frame->height - target->y : TILE;
    vd_target_clear(target, r->background);
    const float(*offsets)[2] = vd_sample_offsets(target->samples);
    for (int s = 0; s < target->samples; s++) {
        for (int y = 0; y < target->height; y++) {
            for (int x = 0; x < target->width; x++) {
                const size_t sample =
                    (size_t)s * target->plane + (size_t)y * target->stride + (size_t)x;
                draw_sample(r, target, sample, target->x + x + (double)offsets[s][0],
                            target->y + y + (double)offsets[s][1], scratch);
            }
        }
    }
    vd_target_resolve(target, r->frame);
}

static vd_status check_def(const vd_terrain_def *def) {
    if (def->heightfield == NULL) {
        return vd_failure(VD_ERROR_ARGUMENT, "the terrain has no heightfield; set one");
    }
    if (def->method < 0 || def->method >= VD_TERRAIN_METHOD_COUNT) {
        return vd_failure(VD_ERROR_ARGUMENT, "the terrain's method %d is unknown",
                          (int)def->method);
    }
    if (def->filter < 0 || def->filter >= VD_FILTER_COUNT) {
        return vd_failure(VD_ERROR_ARGUMENT, "the terrain's filter %d is unknown",
                          (int)def->filter);
    }
    if (vd_sample_offsets(def->samples) == NULL) {
        return vd_failure(VD_ERROR_ARGUMENT, "the terrain's samples are %d; give 1, 4 or 8",
                          def->samples);
    }
    if (!(def->exaggeration > 0.0) || !isfinite(def->exaggeration)) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "the terrain's exaggeration is %g; give a finite number above 0",
                          def->exaggeration);
    }
    if (!(def->light.haze_m >= 0.0)) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "the terrain's haze distance is %g m; give 0 (no haze) or more",
                          def->light.haze_m);
    }
    return vd_success();
}

/* Returns the index of the terrain's object id in the frame's table, adding it if need be. */
static vd_status register_object(vd_frame *frame, uint64_t object_id, uint32_t *out) {
    const int capacity = (int)(sizeof frame->object_ids / sizeof frame->object_ids[0]);
    for (int i = 1; i < frame->object_count; i++) {
        if (frame->object_ids[i] == object_id) {
            *out = (uint32_t)i;
            return vd_success();
        }
    }
    if (frame->object_count >= capacity) {
        return vd_failure(VD_ERROR_LIMIT, "the frame's table of object ids is full (%d entries)",
                          capacity);
    }
    frame->object_ids[frame->object_count] = object_id;
    *out = (uint32_t)frame->object_count++;
    return vd_success();
}

static void release_workers(vd_context *context, render *r) {
    if (r->workers != NULL) {
        for (int i = 0; i < vd_context_threads(context); i++) {
            vd_target_destroy(&r->workers[i].target);
        }
        vd_release(context, r->workers);
    }
}

static vd_status create_workers(vd_context *context, render *r) {
    const int threads = vd_context_threads(context);
    r->workers = vd_allocate_zero(context, (size_t)threads, sizeof *r->workers);
    if (r->workers == NULL) {
        return vd_out_of_memory("the terrain's workers", (size_t)threads * sizeof *r->workers);
    }
    for (int i = 0; i < threads; i++) {
        vd_status status =
            vd_target_create(context, TILE, TILE, r->def->samples, &r->workers[i].target);
        if (status.code != VD_OK) {
            return status;
        }
    }
    return vd_success();
}

static vd_status render_init(const vd_terrain_def *def, const vd_camera *camera, render *r) {
    memset(r, 0, sizeof *r);
    vd_status status = check_def(def);
    if (status.code == VD_OK) {
        status = vd_camera_validate(camera);
    }
    if (status.code == VD_OK) {
        status = vd_surface_init(def, &r->surface);
    }
    r->cast = def->method == VD_TERRAIN_RAYCAST ? vd_surface_raycast : vd_surface_march;
    r->def = def;
    r->camera = camera;
    r->tile_step = 1;
    premultiply(def->background, r->background);
    return status;
}

static int tile_count(int pixels) {
    return (pixels + TILE - 1) / TILE;
}

/* Draws `count` tiles, tile_step apart, into r->frame. */
static vd_status draw_tiles(vd_context *context, vd_job *job, render *r, int count,
                            vd_frame_stats *stats) {
    vd_status status = create_workers(context, r);
    if (status.code == VD_OK) {
        status = vd_parallel_for(context, job, count, draw_tile, r);
    }
    if (r->workers != NULL && stats != NULL) {
        memset(stats, 0, sizeof *stats);
        for (int i = 0; i < vd_context_threads(context); i++) {
            stats->samples += r->workers[i].samples;
            stats->hits += r->workers[i].hits;
        }
    }
    release_workers(context, r);
    return status;
}

vd_status vd_terrain_render(vd_context *context, vd_job *job, const vd_terrain_def *def,
                            const vd_camera *camera, vd_frame *frame, vd_frame_stats *stats) {
    render r;
    vd_status status = render_init(def, camera, &r);
    if (status.code != VD_OK) {
        return status;
    }
    status = register_object(frame, def->object_id, &r.terrain_id);
    if (status.code != VD_OK) {
        return status;
    }
    r.frame = frame;
    r.tiles_x = tile_count(frame->width);
    return draw_tiles(context, job, &r, r.tiles_x * tile_count(frame->height), stats);
}

/* Draws every step-th of `tiles` tiles, in batches that are each spread over the whole picture, and
 * tells how long all tiles would take. What the tiles cost is their processor time, which hardly
 * depends on what else runs; how much longer that takes on the clock is the median of the batches,
 * so that a pause in one of them does not count. */
static vd_status measure_tiles(vd_context *context, vd_job *job, render *r, int tiles, int step,
                               double *seconds) {
    enum { MOST = 9, TILES_A_BATCH = 16 };
    const int count = (tiles + step - 1) / step;
    int batches = count / TILES_A_BATCH < MOST ? count / TILES_A_BATCH : MOST;
    batches = batches < 1 ? 1 : batches;
    double stretch[MOST], busy = 0.0, wall = 0.0;
    for (int b = 0; b < batches; b++) {
        r->first_tile = b * step;
        r->tile_step = batches * step;
        const uint64_t start_ns = vd_clock_ns(), start_busy_ns = vd_processor_ns();
        vd_status status = draw_tiles(context, job, r, (count - b + batches - 1) / batches, NULL);
        if (status.code != VD_OK) {
            return status;
        }
        const double busy_here = (double)(vd_processor_ns() - start_busy_ns);
        const double wall_here = (double)(vd_clock_ns() - start_ns);
        const double here = busy_here > 0.0 ? wall_here / busy_here : 1.0;
        int at = b; /* kept in order */
        for (; at > 0 && stretch[at - 1] > here; at--) {
            stretch[at] = stretch[at - 1];
        }
        stretch[at] = here;
        busy += busy_here;
        wall += wall_here;
    }
    const double ns = busy > 0.0 ? busy * stretch[batches / 2] : wall;
    *seconds = ns * 1e-9 * tiles / count;
    return vd_success();
}

vd_status vd_terrain_estimate(vd_context *context, vd_job *job, const vd_terrain_def *def,
                              const vd_camera *camera, int width, int height, double *seconds,
                              size_t *bytes) {
    render r;
    vd_status status = render_init(def, camera, &r);
    if (status.code != VD_OK) {
        return status;
    }
    vd_frame *frame = NULL;
    status = vd_frame_create(context, width, height, 0, &frame);
    if (status.code != VD_OK) {
        return status;
    }
    r.frame = frame;
    r.tiles_x = tile_count(width);
    const int tiles = r.tiles_x * tile_count(height);
    /* At least 192 tiles, and a step that does not walk down one column. */
    int step = tiles / 192 < 16 ? tiles / 192 : 16;
    step = step < 1 ? 1 : step;
    while (step > 1 && r.tiles_x % step == 0) {
        step--;
    }
    const size_t before = vd_context_memory(context).bytes_now;
    vd_context_memory_reset_peak(context);
    status = measure_tiles(context, job, &r, tiles, step, seconds);
    if (status.code == VD_OK) {
        *bytes = vd_context_memory(context).bytes_peak - before;
    }
    vd_frame_destroy(&frame);
    return status;
}

vd_status vd_terrain_explain_empty(const vd_terrain_def *def, const vd_camera *camera, int width,
                                   int height) {
    const vd_heightfield *h = def->heightfield;
    if (h->holes == (uint64_t)h->width * (uint64_t)h->height) {
        return vd_failure(VD_ERROR_EMPTY, "the picture is empty: every height is missing (nodata); "
                                          "check the file's nodata value");
    }
    const double ground = vd_heightfield_height_at(h, camera->eye.x, camera->eye.y);
    if (camera->eye.z < ground * def->exaggeration) {
        return vd_failure(VD_ERROR_EMPTY,
                          "the picture is empty: the camera is under ground, at %.10g m where the "
                          "ground is at %.10g m; raise it",
                          camera->eye.z, ground * def->exaggeration);
    }
    vd_vec3 min, max;
    vd_heightfield_bounds(h, &min, &max);
    min.z *= def->exaggeration;
    max.z *= def->exaggeration;
    vd_frustum frustum = vd_camera_frustum(camera, width, height);
    const bool touches = vd_frustum_touches_box(&frustum, min, max);
    frustum.planes[4].offset -= camera->near_m; /* the near plane, moved to the eye */
    if (!touches && vd_frustum_touches_box(&frustum, min, max)) {
        return vd_failure(VD_ERROR_EMPTY,
                          "the picture is empty: all of the terrain lies before the near plane, "
                          "%.10g m from the camera, where nothing is drawn; bring it nearer",
                          camera->near_m);
    }
    if (!touches) {
        return vd_failure(VD_ERROR_EMPTY,
                          "the picture is empty: the camera at %.10g, %.10g, %.10g m looks away "
                          "from the terrain (x %.10g … %.10g, y %.10g … %.10g m); turn or move it",
                          camera->eye.x, camera->eye.y, camera->eye.z, min.x, max.x, min.y, max.y);
    }
    if (camera->eye.z < max.z) {
        return vd_failure(VD_ERROR_EMPTY, "the picture is empty: no ray of the camera meets the "
                                          "terrain from above; raise it or look further down");
    }
    return vd_failure(VD_ERROR_EMPTY, "the picture is empty: the terrain is beside the view, under "
                                      "the horizon or in the missing samples; turn or move the "
                                      "camera");
}

/* raster.c: the renderer object, from draws to a finished frame. */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "image/blended.h"
#include "image/image.h"
#include "raster/raster_run.h"

/* ---- definitions ------------------------------------------------------------------------------*/

const char *vd_raster_method_name(vd_raster_method method) {
    static const char *const names[VD_RASTER_METHOD_COUNT] = {"auto",  "scanline", "immediate",
                                                              "tiled", "hybrid",   "reference"};
    return method >= 0 && method < VD_RASTER_METHOD_COUNT ? names[method] : "unknown";
}

vd_draw vd_draw_default(void) {
    vd_draw draw;
    memset(&draw, 0, sizeof draw);
    draw.world_from_mesh = vd_matrix_identity();
    draw.line_width = 1.0;
    draw.point_size = 1.0;
    draw.object_id = 1;
    return draw;
}

vd_raster_def vd_raster_def_default(void) {
    vd_raster_def def;
    memset(&def, 0, sizeof def);
    def.samples = 1;
    return def;
}

static bool is_size(int size) {
    return size == 0 || (size >= 16 && size <= VD_TILE_MAX && (size & (size - 1)) == 0);
}

static vd_status check_def(const vd_raster_def *def, const vd_camera *camera) {
    if (def->method < 0 || def->method >= VD_RASTER_METHOD_COUNT) {
        return vd_failure(VD_ERROR_ARGUMENT, "the raster method %d is unknown", (int)def->method);
    }
    if (vd_sample_offsets(def->samples) == NULL) {
        return vd_failure(VD_ERROR_ARGUMENT, "the raster's samples are %d; give 1, 4 or 8",
                          def->samples);
    }
    if (!is_size(def->bin_pixels) || !is_size(def->tile_pixels) || def->small_pixels < 0) {
        return vd_failure(
            VD_ERROR_ARGUMENT,
            "the raster's bins of %d, tiles of %d or small triangles of %d pixels are "
            "impossible; give powers of two from 16 to 256, or 0",
            def->bin_pixels, def->tile_pixels, def->small_pixels);
    }
    const int fine = def->fine_pixels, bin = def->bin_pixels;
    if (fine != 0 && ((fine != 4 && fine != 8 && fine != 16) || bin < fine || bin > 16 * fine)) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "the raster's fine tiles of %d pixels are impossible in bins of %d; give "
                          "4, 8 or 16 and bins of at most 16 a side, or 0",
                          fine, bin);
    }
    if (def->most_layers < 0) {
        return vd_failure(VD_ERROR_ARGUMENT, "the raster's most_layers is %d; give 0 for all",
                          def->most_layers);
    }
    if (!(def->far_m == 0.0 || (def->far_m > camera->near_m && isfinite(def->far_m)))) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "the raster's far distance is %g m; give more than the near distance, "
                          "%g m, or 0",
                          def->far_m, camera->near_m);
    }
    return vd_camera_validate(camera);
}

/* ---- memory -----------------------------------------------------------------------------------*/

vd_status vd_raster_create(vd_context *context, vd_raster **out) {
    vd_raster *raster = vd_allocate_zero(context, 1, sizeof *raster);
    if (raster == NULL) {
        return vd_out_of_memory("a raster", sizeof *raster);
    }
    raster->context = context;
    raster->thread_count = vd_context_threads(context);
    raster->workers =
        vd_allocate_zero(context, (size_t)raster->thread_count, sizeof *raster->workers);
    if (raster->workers == NULL) {
        vd_raster_destroy(&raster);
        return vd_out_of_memory("a raster's workers",
                                (size_t)vd_context_threads(context) * sizeof *raster->workers);
    }
    *out = raster;
    return vd_success();
}

void vd_raster_destroy(vd_raster **raster_in_out) {
    if (raster_in_out == NULL || *raster_in_out == NULL) {
        return;
    }
    vd_raster *raster = *raster_in_out;
    *raster_in_out = NULL;
    vd_context *context = raster->context;
    for (int i = 0; raster->workers != NULL && i < raster->thread_count; i++) {
        vd_worker_finish(context, &raster->workers[i]);
    }
    vd_release(context, raster->workers);
    for (int i = 0; i < raster->slot_count; i++) {
        vd_release(context, raster->slots[i].vertices.memory);
        vd_release(context, raster->slots[i].written.memory);
        vd_release(context, raster->slots[i].user.memory);
    }
    vd_release(context, raster->slots);
    vd_release(context, raster->drawings.memory);
    vd_release(context, raster->order.memory);
    vd_release(context, raster);
}

/* Memory for the vertices of draw `i`. */
static vd_status reserve_slot(vd_raster *raster, int i, vd_drawing *drawing) {
    vd_slot *slot = &raster->slots[i];
    const size_t stride = drawing->mesh->vertex_stride;
    const vd_shader *shader = drawing->shader;
    vd_status status = vd_buffer_reserve(raster->context, &slot->vertices, "projected vertices",
                                         stride, sizeof *drawing->vertices);
    drawing->vertices = slot->vertices.memory;
    if (status.code == VD_OK && shader->vertex != NULL) {
        status = vd_buffer_reserve(raster->context, &slot->written, "varyings",
                                   stride * (size_t)(shader->varying_count + 3), sizeof(float));
        drawing->written = slot->written.memory;
        drawing->groups = slot->written.memory;
    }
    if (status.code == VD_OK && shader->user_bytes > 0) {
        status = vd_buffer_reserve(raster->context, &slot->user, "varyings of the user's own",
                                   stride, shader->user_bytes);
        drawing->user = slot->user.memory;
    }
    return status;
}

static vd_status reserve_slots(vd_raster *raster, int count) {
    if (count <= raster->slot_count) {
        return vd_success();
    }
    vd_slot *slots = vd_allocate_zero(raster->context, (size_t)count, sizeof *slots);
    if (slots == NULL) {
        return vd_out_of_memory("a raster's draws", (size_t)count * sizeof *slots);
    }
    if (raster->slot_count > 0) {
        memcpy(slots, raster->slots, (size_t)raster->slot_count * sizeof *slots);
    }
    vd_release(raster->context, raster->slots);
    raster->slots = slots;
    raster->slot_count = count;
    return vd_success();
}

/* ---- preparing --------------------------------------------------------------------------------*/

/* The nearest that the bounds of a drawing come; more than all where they reach the camera. */
static float nearest_depth(const vd_drawing *drawing) {
    const vd_mesh *mesh = drawing->mesh;
    const float(*m)[4] = drawing->view.picture_from_mesh;
    float nearest = 0.0f;
    for (int corner = 0; corner < 8; corner++) {
        const float x = (corner & 1) != 0 ? mesh->max[0] : mesh->min[0];
        const float y = (corner & 2) != 0 ? mesh->max[1] : mesh->min[1];
        const float z = (corner & 4) != 0 ? mesh->max[2] : mesh->min[2];
        const float depth = m[2][0] * x + (m[2][1] * y + (m[2][2] * z + m[2][3]));
        const float w = m[3][0] * x + (m[3][1] * y + (m[3][2] * z + m[3][3]));
        const float here = w > 0.0f ? depth / w : INFINITY;
        nearest = here > nearest ? here : nearest;
    }
    return nearest;
}

static int compare_order(const void *a, const void *b) {
    const vd_order *x = a, *y = b;
    return x->nearest != y->nearest ? (x->nearest > y->nearest) - (x->nearest < y->nearest)
                                    : (x->drawing > y->drawing) - (x->drawing < y->drawing);
}

/* Lists are read newest first: what is sorted last is filled first, and hides the rest. */
static void sort_drawings(vd_scene *scene) {
    for (int i = 0; i < scene->drawing_count; i++) {
        scene->order[i] = (vd_order){nearest_depth(&scene->drawings[i]), i};
    }
    qsort(scene->order, (size_t)scene->drawing_count, sizeof *scene->order, compare_order);
}

static bool blends(const vd_draw *draw) {
    bool any = false;
    for (int i = 0; i < draw->material_count; i++) {
        any = any || draw->materials[i].blend;
    }
    return any;
}

static vd_status init_drawings(vd_raster *raster, const vd_raster_def *def, const vd_camera *camera,
                               const vd_draw *draws, int count, vd_frame *frame) {
    vd_status status = reserve_slots(raster, count);
    if (status.code == VD_OK) {
        status = vd_buffer_reserve(raster->context, &raster->drawings, "a raster's draws",
                                   (size_t)count + 1, sizeof(vd_drawing));
    }
    if (status.code == VD_OK) {
        status = vd_buffer_reserve(raster->context, &raster->order, "a raster's draws",
                                   (size_t)count + 1, sizeof(vd_order));
    }
    if (status.code != VD_OK) {
        return status;
    }
    vd_scene *scene = &raster->scene;
    scene->drawings = raster->drawings.memory;
    scene->order = raster->order.memory;
    scene->drawing_count = count;
    uint64_t next = 1;
    scene->blended = false;
    for (int i = 0; i < count; i++) {
        vd_drawing *drawing = &scene->drawings[i];
        status = vd_drawing_init(drawing, &draws[i], def, camera, frame->width, frame->height);
        if (status.code == VD_OK) {
            status = reserve_slot(raster, i, drawing);
        }
        if (status.code == VD_OK) {
            status = vd_frame_add_object(frame, draws[i].object_id, &drawing->frame_id);
        }
        if (status.code != VD_OK) {
            return status;
        }
        drawing->first_id = (uint32_t)next;
        next += drawing->primitive_count;
        scene->blended = scene->blended || (drawing->special && blends(&draws[i]));
        if (next > UINT32_MAX) {
            return vd_failure(VD_ERROR_LIMIT,
                              "the draws have more than %u primitives; draw them "
                              "in several pictures",
                              UINT32_MAX - 1);
        }
    }
    raster->primitives = next - 1;
    sort_drawings(scene);
    return status;
}

#define VERTICES_A_TASK 4096

typedef struct vertex_run {
    const vd_raster *raster;
    const vd_drawing *drawing;
} vertex_run;

static void run_vertices(void *user, int index, int worker) {
    const vertex_run *run = user;
    const uint32_t first = (uint32_t)index * VERTICES_A_TASK;
    const uint32_t left = run->drawing->mesh->vertex_count - first;
    (void)worker;
    run->raster->kernels->project(run->drawing, first,
                                  left < VERTICES_A_TASK ? left : VERTICES_A_TASK);
}

void vd_project_reference(const vd_drawing *drawing, uint32_t first, uint32_t count) {
    for (uint32_t at = first; at < first + count; at += VD_BATCH) {
        float picture[4][VD_BATCH] __attribute__((aligned(64)));
        const uint32_t left = first + count - at;
        vd_vertices_run(drawing, at, left < VD_BATCH ? (int)left : VD_BATCH, true, picture);
        for (int i = 0; i < VD_BATCH; i++) {
            const float p[4] = {picture[0][i], picture[1][i], picture[2][i], picture[3][i]};
            drawing->vertices[at + (uint32_t)i] = vd_project(drawing, p);
        }
    }
}

/* Premultiplies in encoded space: 8-bit colour times 8-bit alpha, to 16 bits. */
static void premultiply(vd_rgba8 color, uint16_t out[4]) {
    const uint32_t channels[3] = {color.r, color.g, color.b};
    for (int i = 0; i < 3; i++) {
        out[i] = (uint16_t)((channels[i] * 257u * color.a + 127u) / 255u);
    }
    out[3] = (uint16_t)(color.a * 257u);
}

vd_status vd_raster_prepare(vd_raster *raster, vd_job *job, const vd_raster_def *def,
                            const vd_camera *camera, const vd_draw *draws, int count,
                            vd_frame *frame) {
    vd_status status = check_def(def, camera);
    if (status.code == VD_OK && (count < 0 || (count > 0 && draws == NULL))) {
        status = vd_failure(VD_ERROR_ARGUMENT, "%d draws cannot be drawn", count);
    }
    if (status.code != VD_OK) {
        return status;
    }
    vd_scene *scene = &raster->scene;
    scene->samples = def->samples;
    scene->width = frame->width;
    scene->height = frame->height;
    premultiply(def->background, scene->background);
    raster->prepared = raster->bare = false;
    raster->most_passes = (def->most_layers + VD_BLENDED_LAYERS - 1) / VD_BLENDED_LAYERS;
    status = init_drawings(raster, def, camera, draws, count, frame);
    if (status.code == VD_OK) {
        status = vd_raster_choose(raster, def);
    }
    for (int i = 0; i < count && status.code == VD_OK; i++) {
        vertex_run run = {raster, &scene->drawings[i]};
        const uint32_t vertices = run.drawing->mesh->vertex_count;
        const int tasks = (int)((vertices + VERTICES_A_TASK - 1) / VERTICES_A_TASK);
        status = vd_parallel_for(raster->context, job, tasks, run_vertices, &run);
    }
    if (status.code == VD_OK) {
        status = vd_raster_limit(raster, job, def->most_pixels);
    }
    if (status.code == VD_OK) {
        status = vd_raster_sort(raster, job);
    }
    raster->prepared = status.code == VD_OK;
    return status;
}

/* ---- drawing ----------------------------------------------------------------------------------*/

/* Frames of more pixels do not fit the caches with all their planes. */
#define STREAM_PIXELS ((size_t)1 << 21)

/* Blends what is sorted to the tile over the worker's target. Returns the samples that show nothing
 * else. */
static uint64_t blend_tile(vd_raster *raster, vd_worker *worker, int x, int y) {
    vd_target *target = worker->target;
    int passes = 0;
    vd_target_begin_blended(target);
    do {
        vd_raster_add_blended(raster, worker, target, x, y);
    } while (vd_target_blend(target) && ++passes != raster->most_passes);
    uint64_t hits = 0;
    for (int s = 0; s < target->samples; s++) {
        for (int row = 0; row < target->height; row++) {
            const size_t at = (size_t)s * target->plane + (size_t)row * target->stride;
            for (int i = 0; i < target->width; i++) {
                hits += target->id[at + (size_t)i] == 0 &&
                        vd_blended_any(&target->blended[at + (size_t)i]);
            }
        }
    }
    return hits;
}

/* One sample a pixel goes to the frame at once. */
static void draw_tile(void *user, int index, int worker_index) {
    vd_raster *raster = user;
    vd_worker *worker = &raster->workers[worker_index];
    const int x = index % raster->tiles_x, y = index / raster->tiles_x;
    const vd_visible *visible = &worker->visible;
    if (visible->samples == 1 && vd_raster_is_empty(raster, x, y)) {
        vd_raster_place(raster, worker, x, y);
        raster->kernels->fill_frame(&raster->scene, visible, raster->frame, raster->stream);
        return;
    }
    const bool blends = vd_raster_blends(raster, x, y);
    vd_raster_see(raster, worker, x, y);
    vd_raster_forget(raster, x, y);
    if (raster->kernels->shade_frame != NULL && visible->samples == 1 && !blends) {
        worker->hits += raster->kernels->shade_frame(&raster->scene, visible, raster->frame,
                                                     worker->batch, raster->stream);
        return;
    }
    vd_target *target = worker->target;
    target->x = visible->x;
    target->y = visible->y;
    target->width = visible->width;
    target->height = visible->height;
    vd_target_clear(target, raster->scene.background);
    worker->hits += raster->kernels->shade(&raster->scene, visible, target, worker->batch);
    if (blends) {
        worker->hits += blend_tile(raster, worker, x, y);
    }
    vd_target_resolve(target, raster->frame);
}

vd_status vd_raster_render(vd_raster *raster, vd_job *job, const vd_raster_def *def,
                           const vd_camera *camera, const vd_draw *draws, int count,
                           vd_frame *frame, vd_raster_stats *stats) {
    for (int i = 0; i < raster->thread_count; i++) {
        raster->workers[i].hits = 0;
    }
    vd_status status = vd_raster_prepare(raster, job, def, camera, draws, count, frame);
    if (status.code != VD_OK) {
        return status;
    }
    raster->frame = frame;
    raster->bare = raster->kernels->shade_frame != NULL && def->samples == 1 && count == 1 &&
                   raster->scene.drawings[0].shader == vd_shader_find(VD_SHADING_DEPTH) &&
                   !raster->scene.drawings[0].special;
    raster->stream = (size_t)frame->width * (size_t)frame->height > STREAM_PIXELS;
    status =
        vd_parallel_for(raster->context, job, raster->tiles_x * raster->tiles_y, draw_tile, raster);
    raster->bare = false; /* targets want ids */
    if (stats != NULL) {
        memset(stats, 0, sizeof *stats);
        stats->primitives = raster->primitives;
        stats->covered = raster->covered;
        stats->left_out = raster->left_out;
        for (int i = 0; i < raster->thread_count; i++) {
            stats->hits += raster->workers[i].hits;
            stats->clipped += raster->workers[i].sorter.clipped;
            stats->drawn += raster->workers[i].sorter.drawn;
        }
    }
    return status;
}

/* ---- compositing ------------------------------------------------------------------------------*/

/* Drops the samples of the worker's window that are behind what the target has, and makes the
 * target's window of the same place and size. */
static void hide_behind(vd_visible *visible, const vd_target *target) {
    for (int s = 0; s < visible->samples; s++) {
        for (int y = 0; y < visible->height; y++) {
            const size_t at = (size_t)s * visible->plane + (size_t)y * visible->stride;
            const size_t there = (size_t)s * target->plane + (size_t)y * target->stride;
            for (int x = 0; x < visible->width; x++) {
                if (!(visible->depth[at + (size_t)x] > target->depth[there + (size_t)x])) {
                    visible->id[at + (size_t)x] = 0;
                }
            }
        }
    }
}

/* The part of `window` that lies in the target, as views of both. False when there is none. */
static bool overlap(const vd_visible *window, const vd_target *target, vd_visible *part,
                    vd_target *to) {
    const int x0 = window->x > target->x ? window->x : target->x;
    const int y0 = window->y > target->y ? window->y : target->y;
    const int window_right = window->x + window->width, right = target->x + target->width;
    const int window_bottom = window->y + window->height, bottom = target->y + target->height;
    const int x1 = window_right < right ? window_right : right;
    const int y1 = window_bottom < bottom ? window_bottom : bottom;
    if (x0 >= x1 || y0 >= y1) {
        return false;
    }
    *part = *window;
    *to = *target;
    part->x = to->x = x0;
    part->y = to->y = y0;
    part->width = to->width = x1 - x0;
    part->height = to->height = y1 - y0;
    const size_t from = (size_t)(y0 - window->y) * window->stride + (size_t)(x0 - window->x);
    const size_t at = (size_t)(y0 - target->y) * target->stride + (size_t)(x0 - target->x);
    part->depth += from;
    part->id += from;
    to->color += 4 * at;
    to->depth += at;
    to->id += at;
    to->blended = target->blended != NULL ? target->blended + at : NULL;
    return true;
}

bool vd_raster_window_any(const vd_raster *raster, const vd_target *window, bool *blends) {
    const int tile = raster->tile;
    bool any = false;
    *blends = false;
    for (int y = window->y / tile; y * tile < window->y + window->height; y++) {
        for (int x = window->x / tile; x * tile < window->x + window->width; x++) {
            if (x < raster->tiles_x && y < raster->tiles_y) {
                any = any || !vd_raster_is_empty(raster, x, y);
                *blends = *blends || vd_raster_blends(raster, x, y);
            }
        }
    }
    return any || *blends;
}

void vd_raster_draw(vd_raster *raster, vd_target *target, int worker_index) {
    if (!raster->prepared || target->samples != raster->scene.samples) {
        return;
    }
    vd_worker *worker = &raster->workers[worker_index];
    const int tile = raster->tile;
    for (int y = target->y / tile; y * tile < target->y + target->height; y++) {
        for (int x = target->x / tile; x * tile < target->x + target->width; x++) {
            vd_visible part;
            vd_target to;
            if (x >= raster->tiles_x || y >= raster->tiles_y) {
                continue;
            }
            vd_raster_see(raster, worker, x, y);
            if (overlap(&worker->visible, target, &part, &to)) {
                hide_behind(&part, &to);
                raster->kernels->shade(&raster->scene, &part, &to, worker->batch);
            }
        }
    }
}

void vd_raster_blend(vd_raster *raster, vd_target *target, int worker_index) {
    if (!raster->prepared || target->samples != raster->scene.samples || target->blended == NULL) {
        return;
    }
    vd_worker *worker = &raster->workers[worker_index];
    const int tile = raster->tile;
    for (int y = target->y / tile; y * tile < target->y + target->height; y++) {
        for (int x = target->x / tile; x * tile < target->x + target->width; x++) {
            vd_visible part;
            vd_target to;
            if (x >= raster->tiles_x || y >= raster->tiles_y || !vd_raster_blends(raster, x, y)) {
                continue;
            }
            vd_raster_place(raster, worker, x, y);
            if (overlap(&worker->visible, target, &part, &to)) {
                vd_raster_add_blended(raster, worker, &to, x, y);
            }
        }
    }
}

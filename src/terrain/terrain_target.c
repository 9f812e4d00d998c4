/* terrain_target.c: terrain among other things in a target.
 *
 * The lens methods draw frames: pixel centres first, then the samples of pixels on edges. Among
 * other things every sample counts, since where a wall stands in a slope the edge is neither's own.
 * A sample of all pixels is a picture of one sample a pixel through a lens whose principal point is
 * moved by the sample's place in the pixel, and a window of a picture one through a lens that is
 * moved by the window's corner. So the methods stay as they are, and what is here is a loop and a
 * depth test. It costs a picture a sample, where vd_terrain_render takes all samples on edges only.
 * A lens that is moved by a constant is rounded otherwise than a place in the picture: the samples
 * are not to the byte those of vd_terrain_render, nor do they hang on how a picture is cut into
 * windows by more than that rounding.
 */
#include <string.h>
#include "core/core.h"
#include "image/image.h"
#include "terrain/lens_renderer.h"

#define ROWS_A_TASK 64

typedef struct merging {
    const vd_frame *from;
    vd_target *to;
    int sample;
    uint32_t id;
    const uint8_t *mixed; /* [height][to->stride]: pixels that are merged; null: all */
} merging;

/* Puts one pixel of the terrain at a sample where it is nearer, or where nothing is. */
static inline void merge(vd_target *to, size_t at, const uint8_t *rgba, float depth, uint32_t id) {
    const bool nothing = to->id[at] == 0 && to->depth[at] == 0.0f;
    if (nothing || depth > to->depth[at]) {
        vd_terrain_place(to, at, rgba, depth, id);
    }
}

static void merge_row(const merging *m, int y) {
    const uint8_t *rgba = m->from->rgba + 4 * (size_t)y * m->from->stride;
    const float *depth = m->from->depth + (size_t)y * m->from->stride;
    const size_t row = (size_t)m->sample * m->to->plane + (size_t)y * m->to->stride;
    const uint8_t *mixed = m->mixed != NULL ? m->mixed + (size_t)y * m->to->stride : NULL;
    for (int x = 0; x < m->to->width; x++) {
        if (mixed == NULL || mixed[x] != 0) {
            merge(m->to, row + (size_t)x, rgba + 4 * x, depth[x], m->id);
        }
    }
}

static void merge_rows(void *user, int index, int worker) {
    const merging *m = user;
    (void)worker;
    for (int y = index * ROWS_A_TASK; y < (index + 1) * ROWS_A_TASK && y < m->to->height; y++) {
        merge_row(m, y);
    }
}

/* A frame of the target's size. */
static vd_status reserve_window(vd_terrain_renderer *renderer, const vd_target *target) {
    return vd_frame_fit(renderer->context, target->width, target->height, VD_PLANE_DEPTH,
                        &renderer->window, &renderer->window_pixels);
}

/* Draws one sample of the pixels in some tiles of the target's window, and merges them. */
static vd_status draw_sample(vd_terrain_renderer *renderer, vd_job *job, const vd_camera *camera,
                             const vd_lens_tiles *tiles, merging *m, vd_frame_stats *stats) {
    const float *offset = vd_sample_offsets(m->to->samples)[m->sample];
    vd_camera moved = *camera;
    moved.lens.cx -= m->to->x + ((double)offset[0] - 0.5);
    moved.lens.cy -= m->to->y + ((double)offset[1] - 0.5);
    const vd_frame *window = renderer->window;
    vd_status status = vd_lens_prepare(renderer, job, &moved, window->width, window->height);
    if (status.code != VD_OK) {
        return status;
    }
    status = vd_lens_draw(renderer, job, &moved, m->id, tiles, renderer->window, stats);
    return status.code != VD_OK
               ? status
               : vd_parallel_for(renderer->context, job,
                                 (window->height + ROWS_A_TASK - 1) / ROWS_A_TASK, merge_rows, m);
}

/* Draws all samples of some tiles. */
static vd_status draw_samples(vd_terrain_renderer *renderer, vd_job *job, const vd_camera *camera,
                              const vd_lens_tiles *tiles, merging *m, vd_frame_stats *stats) {
    vd_status status = vd_success();
    const int samples = renderer->def.samples;
    renderer->def.samples = 1;
    for (m->sample = 0; m->sample < m->to->samples && status.code == VD_OK; m->sample++) {
        vd_frame_stats one = {0, 0};
        m->from = renderer->window;
        status = draw_sample(renderer, job, camera, tiles, m, &one);
        stats->samples += one.samples;
        stats->hits += one.hits;
    }
    renderer->def.samples = samples;
    return status;
}

vd_status vd_terrain_renderer_composite(vd_terrain_renderer *renderer, vd_job *job,
                                        const vd_camera *camera, vd_frame *frame, vd_target *target,
                                        vd_frame_stats *stats) {
    if (renderer == NULL || camera == NULL || frame == NULL || target == NULL) {
        return vd_failure(VD_ERROR_ARGUMENT, "drawing a terrain into a target needs a renderer, a "
                                             "camera, a frame and a target");
    }
    merging m = {.to = target};
    vd_status status = vd_camera_validate(camera);
    if (status.code == VD_OK) {
        status = vd_frame_add_object(frame, renderer->def.object_id, &m.id);
    }
    if (status.code == VD_OK) {
        status = reserve_window(renderer, target);
    }
    vd_frame_stats sum = {0, 0};
    if (status.code == VD_OK) {
        const vd_lens_tiles all = {
            0, 1, vd_lens_tile_count(target->width) * vd_lens_tile_count(target->height), NULL};
        status = draw_samples(renderer, job, camera, &all, &m, &sum);
    }
    if (stats != NULL) {
        *stats = sum;
    }
    return status;
}

/* ---- among things -----------------------------------------------------------------------------
 * Where a picture of the terrain is there already only pixels that show something else, too, need
 * every sample: at an edge between a wall and a slope the samples decide, elsewhere the terrain's
 * own picture has done so. */

typedef struct mixing {
    const vd_frame *ground;
    const uint8_t *mix;
    vd_target *to;
    uint32_t id;
    int tiles_x;
    uint8_t *mixed; /* [height][to->stride] */
} mixing;

/* Marks the pixels of a part of a row that some sample shows something in. */
static void mark_things(const vd_target *to, size_t at, int count, uint8_t *mixed) {
    uint32_t ids[VD_TERRAIN_MIX_TILE] = {0};
    for (int s = 0; s < to->samples; s++) {
        const uint32_t *id = to->id + (size_t)s * to->plane + at;
        for (int x = 0; x < count; x++) {
            ids[x] |= id[x];
        }
    }
    for (int x = 0; x < count; x++) {
        mixed[x] = ids[x] != 0;
    }
}

/* Gives the ground's colour and depth to a sample of the pixels that are not mixed, which are
 * empty.
 */
static void place_ground(const mixing *m, size_t at, size_t ground, int count,
                         const uint8_t *mixed) {
    const uint8_t *rgba = m->ground->rgba + 4 * ground;
    const float *depth = m->ground->depth + ground;
    for (int x = 0; x < count; x++) {
        if (mixed[x] == 0) {
            vd_terrain_place(m->to, at + (size_t)x, rgba + 4 * x, depth[x], m->id);
        }
    }
}

/* The same with one sample a pixel, where it is nearer than what is there. */
static void merge_ground(const mixing *m, size_t at, size_t ground, int count) {
    uint8_t hidden[VD_TERRAIN_MIX_TILE];
    const float *depth = m->ground->depth + ground, *there = m->to->depth + at;
    for (int x = 0; x < count; x++) {
        hidden[x] = there[x] > 0.0f && !(depth[x] > there[x]);
    }
    place_ground(m, at, ground, count, hidden);
}

static void mix_row(const mixing *m, uint8_t mix, int x0, int y, int count) {
    const vd_target *to = m->to;
    const size_t at = (size_t)y * to->stride + (size_t)x0;
    const size_t ground = (size_t)(to->y + y) * m->ground->stride + (size_t)(to->x + x0);
    if (mix == VD_TERRAIN_MIX_NOTHING || to->samples == 1) {
        memset(m->mixed + at, 0, (size_t)count);
        if (mix != VD_TERRAIN_MIX_NOTHING) {
            merge_ground(m, at, ground, count);
        }
        return;
    }
    if (mix == VD_TERRAIN_MIX_BLENDED) {
        memset(m->mixed + at, 1, (size_t)count);
        return;
    }
    mark_things(to, at, count, m->mixed + at);
    for (int s = 0; s < to->samples; s++) {
        place_ground(m, (size_t)s * to->plane + at, ground, count, m->mixed + at);
    }
}

void vd_terrain_merge_picture(const vd_frame *ground, uint32_t terrain_id, vd_target *target) {
    const mixing m = {.ground = ground, .to = target, .id = terrain_id};
    for (int y = 0; y < target->height; y++) {
        merge_ground(&m, (size_t)y * target->stride,
                     (size_t)(target->y + y) * ground->stride + (size_t)target->x, target->width);
    }
}

/* Finds the pixels of a tile that are mixed, and gives the others the ground's. */
static void mix_tile(void *user, int index, int worker) {
    const mixing *m = user;
    const int x0 = index % m->tiles_x * VD_TERRAIN_MIX_TILE;
    const int y0 = index / m->tiles_x * VD_TERRAIN_MIX_TILE;
    const int left = m->to->width - x0;
    (void)worker;
    for (int y = y0; y < y0 + VD_TERRAIN_MIX_TILE && y < m->to->height; y++) {
        mix_row(m, m->mix[index], x0, y, left < VD_TERRAIN_MIX_TILE ? left : VD_TERRAIN_MIX_TILE);
    }
}

/* Lists the lens tiles that hold a mixed pixel. */
static int list_tiles(const mixing *m, int *list) {
    const int tiles_x = vd_lens_tile_count(m->to->width);
    const int tiles = tiles_x * vd_lens_tile_count(m->to->height);
    int count = 0;
    for (int t = 0; t < tiles; t++) {
        const int x0 = t % tiles_x * VD_LENS_TILE, y0 = t / tiles_x * VD_LENS_TILE;
        const int left = m->to->width - x0;
        const size_t columns = (size_t)(left < VD_LENS_TILE ? left : VD_LENS_TILE);
        bool any = false;
        for (int y = y0; y < y0 + VD_LENS_TILE && y < m->to->height && !any; y++) {
            any = memchr(m->mixed + (size_t)y * m->to->stride + (size_t)x0, 1, columns) != NULL;
        }
        if (any) {
            list[count++] = t;
        }
    }
    return count;
}

vd_status vd_terrain_composite_among(vd_terrain_renderer *renderer, vd_job *job,
                                     const vd_camera *camera, uint32_t terrain_id,
                                     const vd_frame *ground, const uint8_t *mix, vd_target *target,
                                     vd_frame_stats *stats) {
    const int tiles_x = (target->width + VD_TERRAIN_MIX_TILE - 1) / VD_TERRAIN_MIX_TILE;
    const int tiles_y = (target->height + VD_TERRAIN_MIX_TILE - 1) / VD_TERRAIN_MIX_TILE;
    const int lens_tiles = vd_lens_tile_count(target->width) * vd_lens_tile_count(target->height);
    vd_status status =
        vd_buffer_reserve(renderer->context, &renderer->mixed, "a picture's mixed pixels",
                          target->stride * (size_t)target->height, sizeof(uint8_t));
    if (status.code == VD_OK) {
        status = vd_buffer_reserve(renderer->context, &renderer->list, "a picture's tiles",
                                   (size_t)lens_tiles, sizeof(int));
    }
    if (status.code == VD_OK) {
        status = reserve_window(renderer, target);
    }
    if (status.code != VD_OK) {
        return status;
    }
    mixing m = {ground, mix, target, terrain_id, tiles_x, renderer->mixed.memory};
    status = vd_parallel_for(renderer->context, job, tiles_x * tiles_y, mix_tile, &m);
    vd_frame_stats sum = {0, 0};
    if (status.code == VD_OK && target->samples > 1) {
        int *list = renderer->list.memory;
        const vd_lens_tiles tiles = {0, 1, list_tiles(&m, list), list};
        merging merged = {.to = target, .id = terrain_id, .mixed = m.mixed};
        status = draw_samples(renderer, job, camera, &tiles, &merged, &sum);
    }
    stats->samples += sum.samples;
    stats->hits += sum.hits;
    return status;
}

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
#include "core/core.h"
#include "image/image.h"
#include "terrain/lens_renderer.h"

#define ROWS_A_TASK 64

typedef struct merging {
    const vd_frame *from;
    vd_target *to;
    int sample;
    uint32_t id;
} merging;

/* Puts a row of the window where it is nearer, or where nothing is. */
static void merge_row(const merging *m, int y) {
    const uint8_t *rgba = m->from->rgba + 4 * (size_t)y * m->from->stride;
    const float *depth = m->from->depth + (size_t)y * m->from->stride;
    const size_t row = (size_t)m->sample * m->to->plane + (size_t)y * m->to->stride;
    for (int x = 0; x < m->to->width; x++) {
        const size_t at = row + (size_t)x;
        const bool nothing = m->to->id[at] == 0 && m->to->depth[at] == 0.0f;
        if (!nothing && !(depth[x] > m->to->depth[at])) {
            continue;
        }
        for (int c = 0; c < 4; c++) {
            m->to->color[4 * at + (size_t)c] = (uint16_t)(rgba[4 * x + c] * 257u);
        }
        m->to->depth[at] = depth[x];
        m->to->id[at] = depth[x] > 0.0f ? m->id : 0;
    }
}

static void merge_rows(void *user, int index, int worker) {
    const merging *m = user;
    (void)worker;
    for (int y = index * ROWS_A_TASK; y < (index + 1) * ROWS_A_TASK && y < m->to->height; y++) {
        merge_row(m, y);
    }
}

/* A frame of at least the target's size, used up to it. */
static vd_status reserve_window(vd_terrain_renderer *renderer, const vd_target *target) {
    vd_frame *window = renderer->window;
    if (window != NULL &&
        (size_t)target->height * vd_frame_stride(target->width) <= renderer->window_pixels) {
        window->width = target->width;
        window->height = target->height;
        window->stride = vd_frame_stride(target->width);
        return vd_success();
    }
    vd_frame_destroy(&renderer->window);
    renderer->window_pixels = 0;
    vd_status status = vd_frame_create(renderer->context, target->width, target->height,
                                       VD_PLANE_DEPTH, &renderer->window);
    if (status.code == VD_OK) {
        renderer->window_pixels = (size_t)target->height * renderer->window->stride;
    }
    return status;
}

/* Draws one sample of all pixels of the target's window. */
static vd_status draw_sample(vd_terrain_renderer *renderer, vd_job *job, const vd_camera *camera,
                             merging *m, vd_frame_stats *stats) {
    const float *offset = vd_sample_offsets(m->to->samples)[m->sample];
    vd_camera moved = *camera;
    moved.lens.cx -= m->to->x + ((double)offset[0] - 0.5);
    moved.lens.cy -= m->to->y + ((double)offset[1] - 0.5);
    const vd_frame *window = renderer->window;
    vd_status status = vd_lens_prepare(renderer, job, &moved, window->width, window->height);
    if (status.code != VD_OK) {
        return status;
    }
    const vd_lens_tiles all = {
        0, 1, vd_lens_tile_count(window->width) * vd_lens_tile_count(window->height)};
    status = vd_lens_draw(renderer, job, &moved, m->id, &all, renderer->window, stats);
    return status.code != VD_OK
               ? status
               : vd_parallel_for(renderer->context, job,
                                 (window->height + ROWS_A_TASK - 1) / ROWS_A_TASK, merge_rows, m);
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
    const int samples = renderer->def.samples;
    renderer->def.samples = 1;
    for (m.sample = 0; m.sample < target->samples && status.code == VD_OK; m.sample++) {
        vd_frame_stats one = {0, 0};
        m.from = renderer->window;
        status = draw_sample(renderer, job, camera, &m, &one);
        sum.samples += one.samples;
        sum.hits += one.hits;
    }
    renderer->def.samples = samples;
    if (stats != NULL) {
        *stats = sum;
    }
    return status;
}

/* impostor_over.c: particles and names of what is drawn itself, over all else.
 *
 * Particles near the eye are large and soft, and it is their pixels that take the time: while they
 * take too long they are drawn smaller, and shown larger.
 */
#include <math.h>
#include <string.h>
#include "core/core.h"
#include "image/image.h"
#include "impostor/impostor_set.h"

/* Particles that are drawn themselves in a frame, or for a client in front: about these many, by
 * their detail. */
#define MOST_PARTICLES 1000000u
#define MOST_SENT 250000u
#define COARSEST 32.0

/* Of a frame's time; of a client's picture in front more, which is not drawn for every frame. */
#define CLOUDS_SHARE 0.35
#define SENT_SHARE 2.0

/* Their detail in the next frame, of which this one tells. */
static void refine_clouds(vd_impostors *set, uint64_t particles) {
    const uint64_t most = set->def.ship ? MOST_SENT : MOST_PARTICLES;
    if (particles > most && set->cloud_detail < COARSEST) {
        set->cloud_detail *= particles > 4 * most ? 4.0 : 1.5;
    } else if (particles < most / 4 && set->cloud_detail > 1.0) {
        set->cloud_detail = fmax(set->cloud_detail / 1.5, 1.0);
    }
}

/* Parts what is drawn itself into particles and the rest. */
static vd_status part_nodes(vd_impostors *set) {
    const uint32_t *direct = set->direct.data;
    set->over.count = 0;
    uint32_t *over = vd_list_add(set->context, &set->over, set->direct.count, sizeof *over);
    if (over == NULL) {
        return vd_out_of_memory("a picture's particles", set->direct.count * sizeof *over);
    }
    size_t clouds = 0, others = set->direct.count;
    for (size_t i = 0; i < set->direct.count; i++) {
        const bool cloud = set->world->nodes[direct[i]].kind == VD_OBJECT_PARTICLES;
        over[cloud ? clouds++ : --others] = direct[i];
    }
    set->clouds = clouds;
    return vd_success();
}

static vd_status draw_clouds_into(vd_impostors *set, vd_job *job, const vd_camera *camera,
                                  vd_frame *frame, vd_world_stats *stats) {
    vd_pass pass;
    vd_status status = vd_world_begin_over(set->renderer, camera, set->over.data, set->clouds,
                                           frame, &pass, stats);
    if (status.code == VD_OK) {
        set->renderer->cloud_detail = set->cloud_detail;
        status = vd_world_draw_clouds(set->renderer, job, &pass, frame);
        set->renderer->cloud_detail = 0.0;
    }
    return status;
}

static vd_status draw_clouds_coarsely(vd_impostors *set, vd_job *job, const vd_camera *camera,
                                      double scale, vd_frame *frame, vd_world_stats *stats) {
    const int width = (int)ceil(frame->width * scale), height = (int)ceil(frame->height * scale);
    const double x = (double)width / frame->width, y = (double)height / frame->height;
    vd_camera coarse = *camera;
    coarse.lens.cx *= x, coarse.lens.fx *= x;
    coarse.lens.cy *= y, coarse.lens.fy *= y;
    vd_status status = vd_frame_fit(set->context, width, height, VD_PLANE_DEPTH,
                                    &set->scratch->front, &set->scratch->front_pixels);
    if (status.code != VD_OK) {
        return status;
    }
    vd_frame *front = set->scratch->front;
    memset(front->rgba, 0, 4 * front->stride * (size_t)height);
    for (int row = 0; row < height; row++) {
        const int above = (int)((2 * (int64_t)row + 1) * frame->height / (2 * height));
        const float *from = frame->depth + (size_t)above * frame->stride;
        float *to = front->depth + (size_t)row * front->stride;
        for (int column = 0; column < width; column++) {
            to[column] = from[(2 * (int64_t)column + 1) * frame->width / (2 * width)];
        }
    }
    const int all[4] = {0, 0, frame->width, frame->height};
    status = draw_clouds_into(set, job, &coarse, front, stats);
    return status.code == VD_OK ? vd_impostors_enlarge(set, job, all, frame) : status;
}

static vd_status draw_clouds(vd_impostors *set, vd_job *job, const vd_camera *camera,
                             vd_frame *frame, vd_world_stats *stats) {
    const uint64_t start = vd_clock_ns();
    const double scale = vd_impostor_pace_scale(&set->clouds_pace);
    stats->particles = 0;
    const vd_status status = scale == 1.0
                                 ? draw_clouds_into(set, job, camera, frame, stats)
                                 : draw_clouds_coarsely(set, job, camera, scale, frame, stats);
    refine_clouds(set, stats->particles);
    vd_impostor_pace_learn(set, &set->clouds_pace, 1e-9 * (double)(vd_clock_ns() - start),
                           set->def.ship ? SENT_SHARE : CLOUDS_SHARE);
    return status;
}

vd_status vd_impostors_draw_over(vd_impostors *set, vd_job *job, const vd_camera *camera,
                                 vd_frame *frame, vd_world_stats *stats) {
    vd_pass pass;
    vd_status status = part_nodes(set);
    if (status.code == VD_OK && set->clouds > 0) {
        status = draw_clouds(set, job, camera, frame, stats);
    }
    if (status.code == VD_OK) {
        const uint32_t *over = set->over.data;
        status = vd_world_begin_over(set->renderer, camera, over + set->clouds,
                                     set->over.count - set->clouds, frame, &pass, stats);
    }
    return status.code == VD_OK ? vd_world_draw_over(set->renderer, job, &pass, frame) : status;
}

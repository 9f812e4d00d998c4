/* impostor_relief.c: the ground's depth, for what stands on no patch: patches have none.
 *
 * A client has no depth at all. Pictures of particles over ground are drawn for it without what the
 * ground hides, and are shown over the patches; those that come before something of the picture in
 * front are drawn into that, as is all that is no particle.
 */
#include <math.h>
#include <stddef.h>
#include <string.h>
#include "core/core.h"
#include "image/image.h"
#include "impostor/impostor_placed.h"
#include "terrain/lens_renderer.h"

/* Pixels a side of the screen to one of the ground's coarse depth. */
#define COARSE 4

vd_status vd_impostor_draw_relief(vd_context *context, vd_world_renderer *renderer, vd_job *job,
                                  const vd_camera *camera, double near_m, int margin,
                                  vd_impostor_relief *relief, vd_frame *frame) {
    const int width = (frame->width + COARSE - 1) / COARSE + 2 * margin;
    const int height = (frame->height + COARSE - 1) / COARSE + 2 * margin;
    const float scale = (float)(camera->near_m / near_m);
    vd_camera coarse = *camera;
    coarse.near_m = near_m;
    coarse.lens.fx /= COARSE, coarse.lens.fy /= COARSE;
    coarse.lens.cx = coarse.lens.cx / COARSE + margin;
    coarse.lens.cy = coarse.lens.cy / COARSE + margin;
    vd_status status =
        vd_frame_fit(context, width, height, VD_PLANE_DEPTH, &relief->frame, &relief->pixels);
    const int samples = renderer->samples;
    if (status.code == VD_OK) {
        status = vd_terrain_renderer_set_samples(renderer->ground, 1);
    }
    if (status.code == VD_OK) {
        status = vd_terrain_renderer_draw(renderer->ground, job, &coarse, relief->frame, NULL);
        renderer->ground->def.samples = samples;
    }
    for (int y = 0; y < frame->height && status.code == VD_OK; y++) {
        const float *from =
            relief->frame->depth + (size_t)(y / COARSE + margin) * relief->frame->stride + margin;
        float *to = frame->depth + (size_t)y * frame->stride;
        for (int x = 0; x < frame->width; x++) {
            to[x] = from[x / COARSE] * scale;
        }
    }
    return status;
}

vd_status vd_impostors_draw_relief(vd_impostors *set, vd_job *job, const vd_camera *camera,
                                   vd_frame *frame) {
    return vd_impostor_draw_relief(set->context, set->renderer, job, camera, camera->near_m, 0,
                                   &set->scratch->relief, frame);
}

/* ---- particles for a client -------------------------------------------------------------------*/

bool vd_impostor_is_apart(const vd_impostors *set, uint32_t node) {
    return set->def.ship && !vd_impostor_is_patch(set, node) && set->world->nodes[node].clouds &&
           (set->ground.count > 0 || !vd_impostors_shown_in_front(set));
}

bool vd_impostor_is_in_front(const vd_impostors *set, const vd_impostor_slot *slot) {
    return vd_impostors_shown_in_front(set) &&
           (slot->in_front || !vd_impostor_is_apart(set, slot->node));
}

/* Coarse pixels beyond a picture's edge: ground there may come before it soon. */
#define MARGIN 4

/* Whether ground at a place of the relief ends there for what lies farther than `front`. */
static bool is_edge(const vd_frame *relief, int x, int y, float front) {
    const float *at = relief->depth + (size_t)y * relief->stride + (size_t)x;
    return (x > 0 && at[-1] <= front) || (x + 1 < relief->width && at[1] <= front) ||
           (y > 0 && at[-(ptrdiff_t)relief->stride] <= front) ||
           (y + 1 < relief->height && at[relief->stride] <= front);
}

/* The nearest place of the ground before what is drawn, of those at its edges: elsewhere it hides
 * as much when it moves. */
static void find_hiding(const vd_impostor_draft *draft, const vd_frame *relief,
                        vd_impostor_picture *made) {
    const vd_camera *camera = &draft->camera;
    const float front = (float)(draft->near_m / draft->front_m);
    float nearest = front;
    for (int y = 0; y < relief->height; y++) {
        const float *depth = relief->depth + (size_t)y * relief->stride;
        for (int x = 0; x < relief->width; x++) {
            if (depth[x] > nearest && is_edge(relief, x, y, front)) {
                nearest = depth[x];
                const double z = draft->near_m / (double)nearest;
                const vd_ray ray =
                    vd_camera_ray(camera, COARSE * (x - MARGIN + 0.5), COARSE * (y - MARGIN + 0.5));
                made->hiding = vd_vec3_add(ray.origin, vd_vec3_scale(ray.direction, z));
                made->is_hidden = true;
            }
        }
    }
}

vd_status vd_impostor_draw_clouds(const vd_impostor_brush *brush, vd_job *job,
                                  vd_impostor_draft *draft, vd_frame *canvas) {
    vd_pass pass;
    vd_world_stats stats = {.objects = 0};
    const vd_node *node = brush->renderer->world->nodes + draft->node;
    const size_t pixels = canvas->stride * (size_t)canvas->height;
    vd_status status =
        vd_buffer_reserve(brush->context, brush->depth, "a picture's depth", pixels, sizeof(float));
    if (status.code != VD_OK) {
        return status;
    }
    canvas->depth = brush->depth->memory;
    memset(canvas->rgba, 0, 4 * pixels);
    status = vd_impostor_draw_relief(brush->context, brush->renderer, job, &draft->camera,
                                     draft->near_m, MARGIN, brush->relief, canvas);
    if (status.code == VD_OK) {
        find_hiding(draft, brush->relief->frame, &draft->picture);
        status =
            vd_world_begin_clouds(brush->renderer, &draft->camera, node, canvas, &pass, &stats);
    }
    if (status.code == VD_OK) {
        status = vd_world_draw_clouds(brush->renderer, job, &pass, canvas);
    }
    canvas->depth = NULL;
    return status;
}

/* Whether a picture comes before what a frame shows, at more than a little of it. */
static bool comes_before(const vd_impostor_picture *picture, const vd_camera *camera,
                         const vd_frame *frame) {
    enum { SIDE = 7 };
    vd_vec3 corners[4];
    int seen = 0, before = 0;
    vd_impostor_corners(picture, corners);
    const vd_vec3 right = vd_vec3_subtract(corners[1], corners[0]);
    const vd_vec3 down = vd_vec3_subtract(corners[3], corners[0]);
    for (int i = 0; i < SIDE * SIDE; i++) {
        const vd_vec3 across = vd_vec3_scale(right, (i % SIDE + 0.5) / SIDE);
        const vd_vec3 at = vd_vec3_add(vd_vec3_add(corners[0], across),
                                       vd_vec3_scale(down, (i / SIDE + 0.5) / SIDE));
        size_t pixel;
        float depth;
        if (vd_impostor_find_pixel(camera, frame, at, &pixel, &depth)) {
            seen++;
            before += frame->rgba[4 * pixel + 3] != 0 && frame->depth[pixel] < depth;
        }
    }
    return before > VD_IMPOSTOR_MOST_HIDDEN * seen;
}

void vd_impostors_part_objects(vd_impostors *set, const vd_camera *camera, const vd_frame *frame) {
    const uint32_t *shown = set->shown.data;
    for (size_t i = 0; i < set->shown.count; i++) {
        vd_impostor_slot *slot = vd_impostor_slot_at(set, shown[i]);
        slot->parted = slot->now.version;
        slot->in_front = slot->now.rgba != NULL && vd_impostor_is_apart(set, slot->node) &&
                         comes_before(&slot->now, camera, frame);
    }
}

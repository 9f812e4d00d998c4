/* impostor_still.c: the still picture.
 *
 * Pictures of parts, each with smooth edges, blend to a little less than all of it at once where
 * several edges share a pixel. So when the camera rests and all pictures are there, the whole is
 * reissued as one picture, aligned with the screen, pixel for pixel: what is drawn directly.
 */
#include <string.h>
#include "core/core.h"
#include "image/image.h"
#include "impostor/impostor_set.h"

/* After so long a still picture that could not be drawn is tried again. */
#define RETRY_S 2.0

static bool same_camera(const vd_camera *a, const vd_camera *b) {
    const vd_vec3 way = vd_vec3_subtract(a->eye, b->eye);
    const vd_quat p = a->orientation, q = b->orientation;
    return vd_vec3_dot(way, way) == 0.0 && p.x == q.x && p.y == q.y && p.z == q.z && p.w == q.w &&
           a->lens.fx == b->lens.fx && a->lens.fy == b->lens.fy && a->lens.cx == b->lens.cx &&
           a->lens.cy == b->lens.cy && a->near_m == b->near_m;
}

const vd_frame *vd_impostors_still_frame(const vd_impostors *set) {
    const vd_impostor_scratch *in = set->still_in;
    return set->has_still && in->still_of == set ? in->still : NULL;
}

/* What cannot be drawn is no failure of the update: things that are drawn themselves are set aside;
 * if it is none of these, all of it is tried again later. */
static vd_status give_up(vd_impostors *set, vd_job *job, const vd_camera *camera,
                         vd_status because) {
    const vd_status status =
        vd_impostors_set_aside(set, job, camera, set->still_in->still, because);
    if (status.code == VD_OK || status.code == VD_ERROR_MEMORY ||
        status.code == VD_ERROR_CANCELLED) {
        return status;
    }
    set->stats.failed++;
    set->still_retry_s = set->time_s + RETRY_S;
    return vd_success();
}

static vd_status draw_still(vd_impostors *set, vd_job *job, const vd_camera *camera, int width,
                            int height) {
    vd_impostor_scratch *in = set->still_in;
    vd_status status =
        vd_frame_fit(set->context, width, height, VD_PLANE_DEPTH, &in->still, &in->still_pixels);
    in->still_of = set;
    if (status.code == VD_OK) {
        status = vd_world_renderer_draw(set->renderer, job, camera, in->still, NULL);
        if (status.code != VD_OK) {
            return give_up(set, job, camera, status);
        }
    }
    if (status.code == VD_OK) {
        const size_t bytes = 4 * (size_t)width * (size_t)height;
        set->has_still = true;
        set->still_s = vd_impostors_send(set, bytes);
        set->stats.drawn++;
        set->stats.pixels_drawn += (uint64_t)width * (uint64_t)height;
    }
    return status;
}

vd_status vd_impostors_settle(vd_impostors *set, vd_job *job, const vd_camera *camera, int width,
                              int height) {
    const bool rests = set->resting > 0 && same_camera(camera, &set->rest_camera) &&
                       width == set->rest_width && height == set->rest_height;
    set->resting = rests ? set->resting + 1 : 1;
    set->rest_since_s = rests ? set->rest_since_s : set->time_s;
    set->rest_camera = *camera;
    set->rest_width = width;
    set->rest_height = height;
    set->has_still = rests && vd_impostors_still_frame(set) != NULL;
    /* What there is no memory for does not come. */
    const bool whole = set->stats.waiting == 0 && (set->missing == 0 || set->left_out > 0) &&
                       set->sending.count == 0 && set->painting == 0;
    if (!set->def.settle || set->has_still || !rests || !whole || set->def.no_reuse ||
        set->def.tolerance_px == 0.0 || set->time_s - set->rest_since_s < set->def.rest_s ||
        set->time_s < set->still_retry_s) {
        return vd_success();
    }
    return draw_still(set, job, camera, width, height);
}

bool vd_impostors_copy_still(const vd_impostors *set, const vd_camera *camera, vd_frame *frame) {
    const vd_frame *still = vd_impostors_still_frame(set);
    if (still == NULL || set->time_s < set->still_s || frame->width != set->rest_width ||
        frame->height != set->rest_height || !same_camera(camera, &set->rest_camera)) {
        return false;
    }
    const size_t width = (size_t)frame->width;
    vd_frame_forget_objects(frame);
    for (int y = 0; y < frame->height; y++) {
        const size_t from = (size_t)y * still->stride, to = (size_t)y * frame->stride;
        memcpy(frame->rgba + 4 * to, still->rgba + 4 * from, 4 * width);
        if (frame->depth != NULL) {
            memcpy(frame->depth + to, still->depth + from, width * sizeof(float));
        }
    }
    return true;
}

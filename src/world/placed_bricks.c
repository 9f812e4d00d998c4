/* placed_bricks.c: bricks of particles over a client's frame. Also built to WebAssembly.
 *
 * A brick may say what it likes: a million particles, each as large as the screen. So particles are
 * counted before anything is drawn, and so are the pixels that they will cover; what would be too
 * much is left out as a whole.
 */
#include <math.h>
#include "core/core.h"
#include "splat/brick_pack.h"
#include "splat/splat_internal.h"
#include "world/placed_bricks.h"

/* Lists of one kernel after the other: each begins with the whole picture. */
#define MOST_KERNELS 8

/* Metres that a particle reaches beyond its middle at most: it may stand for so many that it is
 * drawn larger, though then it is a pixel. */
double vd_placed_brick_reach(const vd_brick_block *brick) {
    const double own = brick->radius != NULL ? 65535.0 * (double)brick->head.radius_step
                                             : (double)brick->head.radius;
    return vd_splat_support((vd_splat_kernel)brick->head.kernel) * own;
}

void vd_placed_brick_box(const vd_brick_block *brick, vd_vec3 *min, vd_vec3 *max) {
    const float *step = brick->head.step;
    *min = brick->origin;
    *max = vd_vec3_add(*min, vd_vec3_make(65535.0 * (double)step[0], 65535.0 * (double)step[1],
                                          65535.0 * (double)step[2]));
}

void vd_placed_bricks_begin(vd_placed_bricks *b) {
    b->seen.count = b->splats.count = 0;
    b->radius_count = 0;
}

vd_status vd_placed_bricks_add(vd_placed_bricks *b, const vd_brick_block *brick,
                               vd_placed_account *account, bool *added) {
    account->particles += brick->head.count;
    *added = account->particles <= VD_PLACED_PARTICLES;
    if (!*added) {
        return vd_success();
    }
    const vd_brick_block **to = vd_list_add(b->context, &b->seen, 1, sizeof *to);
    if (to == NULL) {
        return vd_out_of_memory("bricks to be drawn", sizeof *to);
    }
    *to = brick;
    /* As many as whole lines of memory have, which the splatter reads. */
    b->radius_count += brick->radius != NULL ? (brick->head.count + 31) / 16 * 16 : 0;
    return vd_success();
}

void vd_placed_bricks_finish(vd_placed_bricks *b) {
    vd_splatter_destroy(&b->splatter);
    vd_release(b->context, b->seen.data);
    vd_release(b->context, b->splats.data);
    vd_release(b->context, b->radii.memory);
}

/* ---- lists ------------------------------------------------------------------------------------*/

/* How a brick stands before the camera. */
typedef struct stand {
    double middle, nearest; /* metres along the view axis */
    double focal, near_m;
} stand;

static stand stand_of(const vd_brick_block *brick, const vd_camera *camera) {
    vd_vec3 min, max;
    vd_placed_brick_box(brick, &min, &max);
    const vd_vec3 f = vd_quat_rotate(camera->orientation, vd_vec3_make(0.0, 0.0, 1.0));
    const vd_vec3 half = vd_vec3_scale(vd_vec3_subtract(max, min), 0.5);
    const double middle = vd_vec3_dot(f, vd_vec3_subtract(vd_vec3_add(min, half), camera->eye));
    const double fx = camera->lens.fx, fy = camera->lens.fy;
    return (stand){middle, middle - (fabs(f.x) * half.x + fabs(f.y) * half.y + fabs(f.z) * half.z),
                   fx > fy ? fx : fy, camera->near_m};
}

/* Pixels of a metre. */
static double scale_at(const stand *s, double depth) {
    return s->focal / (depth > s->near_m ? depth : s->near_m);
}

/* Pixels that one particle may cover. */
static double area_at(const stand *s, double reach, double depth, double most) {
    const double side = 2.0 * reach * scale_at(s, depth) + 1.0, area = side * side;
    return area < most ? area : most;
}

/* Pixels that a brick may cover: by its nearest corner, or where that is too much by each of its
 * particles. */
static double pixels_of(const vd_brick_block *brick, const stand *s, const vd_camera *camera,
                        double reach, double window, double room) {
    const double rough = brick->head.count * area_at(s, reach, s->nearest, window);
    if (rough <= room) {
        return rough;
    }
    const vd_vec3 f = vd_quat_rotate(camera->orientation, vd_vec3_make(0.0, 0.0, 1.0));
    const double at = vd_vec3_dot(f, vd_vec3_subtract(brick->origin, camera->eye));
    const float *step = brick->head.step;
    const double x = f.x * (double)step[0], y = f.y * (double)step[1], z = f.z * (double)step[2];
    double sum = 0.0;
    for (uint32_t i = 0; i < brick->head.count; i++) {
        const double depth = at + (x * brick->x[i] + y * brick->y[i] + z * brick->z[i]);
        sum += depth >= s->near_m ? area_at(s, reach, depth, window) : 0.0;
    }
    return sum;
}

static vd_splats splats_of(const vd_brick_block *brick, const stand *s, double *reach,
                           float *radii) {
    const vd_brick_block_head *h = &brick->head;
    vd_splats out = vd_splats_default();
    double factor;
    vd_brick_stand_in((double)h->radius, h->stands_for, (double)h->opacity, scale_at(s, s->middle),
                      scale_at(s, s->nearest), &factor, &out.opacity);
    out.count = h->count;
    out.anchor = brick->origin;
    out.x16 = brick->x;
    out.y16 = brick->y;
    out.z16 = brick->z;
    out.has_bounds = true;
    for (int k = 0; k < 3; k++) {
        out.step[k] = h->step[k];
        out.max[k] = 65535.0f * h->step[k];
    }
    out.color = brick->color;
    out.constant = h->color;
    out.radius_m = (float)((double)h->radius * factor);
    *reach = factor * vd_placed_brick_reach(brick);
    if (brick->radius != NULL) {
        const float each = (float)((double)h->radius_step * factor);
        for (uint32_t i = 0; i < h->count; i++) {
            radii[i] = each * (float)brick->radius[i];
        }
        out.radius = radii;
    }
    return out;
}

/* Makes the lists of what is seen: as far as there is room for their pixels, the nearest first. */
static vd_status make_lists(vd_placed_bricks *b, const vd_camera *camera, const vd_frame *frame,
                            double *room, uint32_t *kernels) {
    const vd_brick_block *const *seen = b->seen.data;
    const double all = (double)frame->width * (double)frame->height;
    size_t radii = 0, made = b->seen.count;
    vd_splats *lists = vd_list_add(b->context, &b->splats, made, sizeof *lists);
    if (lists == NULL) {
        return vd_out_of_memory("bricks to be drawn", made * sizeof *lists);
    }
    for (size_t i = b->seen.count; i-- > 0;) {
        const stand s = stand_of(seen[i], camera);
        double reach;
        const vd_splats list = splats_of(seen[i], &s, &reach, (float *)b->radii.memory + radii);
        const double pixels = pixels_of(seen[i], &s, camera, reach, all, *room);
        if (pixels > *room) {
            continue;
        }
        *room -= pixels;
        radii += list.radius != NULL ? (list.count + 31) / 16 * 16 : 0;
        lists[--made] = list;
        kernels[made] = seen[i]->head.kernel;
    }
    b->first = made;
    return vd_success();
}

static vd_status draw_lists(vd_placed_bricks *b, vd_job *job, const vd_camera *camera,
                            vd_frame *frame, const uint32_t *kernels) {
    const vd_splats *splats = b->splats.data;
    vd_splat_def def = vd_splat_def_default();
    vd_status status = vd_success();
    def.over_frame = true;
    int runs = 0;
    for (size_t i = b->first, end; i < b->splats.count && status.code == VD_OK; i = end) {
        for (end = i + 1; end < b->splats.count && kernels[end] == kernels[i]; end++) {
        }
        def.kernel = (vd_splat_kernel)kernels[i];
        status = runs++ < MOST_KERNELS ? vd_splatter_render(b->splatter, job, &def, camera,
                                                            splats + i, (int)(end - i), frame, NULL)
                                       : status;
    }
    return status;
}

vd_status vd_placed_bricks_draw(vd_placed_bricks *b, vd_job *job, const vd_camera *camera,
                                const vd_placed_window *window, vd_placed_account *account,
                                vd_frame *frame) {
    const double most = VD_PLACED_OVERDRAW * (double)window->width * (double)window->height;
    double room = most - (double)account->dots;
    vd_status status =
        b->splatter == NULL ? vd_splatter_create(b->context, &b->splatter) : vd_success();
    if (status.code == VD_OK) { /* and the kernels of the lists */
        status = vd_buffer_reserve(b->context, &b->radii, "sizes of particles",
                                   (size_t)b->radius_count + b->seen.count, sizeof(float));
    }
    if (status.code != VD_OK) {
        return status;
    }
    uint32_t *kernels = (uint32_t *)b->radii.memory + b->radius_count;
    status = make_lists(b, camera, frame, &room, kernels);
    account->dots = (uint64_t)(most - room);
    return status.code == VD_OK ? draw_lists(b, job, camera, frame, kernels) : status;
}

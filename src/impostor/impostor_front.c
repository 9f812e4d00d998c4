/* impostor_front.c: what is drawn itself: near ground and what stands on it, patches that have no
 * picture yet, lines.
 *
 * Each is drawn into a frame of its own, as large as it is on screen, and blended over the picture.
 * The front, which may fill the screen, is drawn smaller and shown larger while it takes too long.
 */
#include <math.h>
#include <string.h>
#include "core/core.h"
#include "image/image.h"
#include "impostor/impostor_set.h"
#include "terrain/lens_renderer.h"

/* Patches have no depth and lie behind what is drawn itself; lines are hidden by all ground. */
typedef enum merging_depth { DEPTH_NONE = 0, DEPTH_KEPT, DEPTH_TESTED } merging_depth;

/* A rectangle of a picture's pixels. */
typedef struct rectangle {
    int x0, y0, x1, y1;
} rectangle;

typedef struct merging {
    const vd_frame *from;
    vd_frame *to;
    rectangle in; /* where in it */
    merging_depth depth;
} merging;

#define MERGED_ROWS 16

/* As quads are. */
static void blend_over(const uint8_t *restrict from, uint8_t *restrict to, int pixels) {
    for (int i = 0; i < pixels; i++) {
        const unsigned rest = 255u - from[4 * i + 3];
        for (int k = 0; k < 4; k++) {
            to[4 * i + k] = vd_over(from[4 * i + k], to[4 * i + k], rest);
        }
    }
}

/* The coarse depth of ground is good for this factor. */
#define NEARER 1.02f

/* Blends a frame over a part of another. */
static void merge_rows(void *user, int index, int worker) {
    const merging *m = user;
    const int end = (index + 1) * MERGED_ROWS, width = m->from->width;
    (void)worker;
    for (int y = index * MERGED_ROWS; y < end && y < m->from->height; y++) {
        const uint8_t *from = m->from->rgba + 4 * (size_t)y * m->from->stride;
        const float *near = m->from->depth + (size_t)y * m->from->stride;
        const size_t at = (size_t)(m->in.y0 + y) * m->to->stride + (size_t)m->in.x0;
        uint8_t *to = m->to->rgba + 4 * at;
        float *depth = m->to->depth + at;
        for (int x = 0; m->depth == DEPTH_TESTED && x < width; x++) {
            if (near[x] * NEARER >= depth[x]) {
                blend_over(from + 4 * x, to + 4 * x, 1);
            }
        }
        for (int x = 0; m->depth == DEPTH_KEPT && x < width; x++) {
            depth[x] = depth[x] < near[x] ? near[x] : depth[x];
        }
        if (m->depth != DEPTH_TESTED) {
            blend_over(from, to, width);
        }
    }
}

/* Where a box is on screen, with a margin for edges: the ends of its edges, cut where they come
 * nearer than the near plane. */
static rectangle rectangle_of(const vd_camera *camera, const vd_frame *frame, vd_vec3 min,
                              vd_vec3 max) {
    const vd_quat q = camera->orientation, back = {-q.x, -q.y, -q.z, q.w};
    vd_vec3 at[8];
    double low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY};
    for (int i = 0; i < 8; i++) {
        const vd_vec3 corner =
            vd_vec3_make((i & 1) != 0 ? max.x : min.x, (i & 2) != 0 ? max.y : min.y,
                         (i & 4) != 0 ? max.z : min.z);
        at[i] = vd_quat_rotate(back, vd_vec3_subtract(corner, camera->eye));
    }
    for (int edge = 0; edge < 24; edge++) { /* both ends of twelve */
        const int axis = edge / 8, a = edge % 8, b = a ^ (1 << axis);
        vd_vec3 end = at[a];
        if (end.z < camera->near_m) {
            if (at[b].z < camera->near_m) {
                continue;
            }
            const double t = (camera->near_m - end.z) / fmax(at[b].z - end.z, 1e-12);
            end = vd_vec3_add(end, vd_vec3_scale(vd_vec3_subtract(at[b], end), t));
        }
        const double z = fmax(end.z, 1e-12);
        const double x = camera->lens.cx + camera->lens.fx * end.x / z;
        const double y = camera->lens.cy + camera->lens.fy * end.y / z;
        low[0] = fmin(low[0], x), high[0] = fmax(high[0], x);
        low[1] = fmin(low[1], y), high[1] = fmax(high[1], y);
    }
    return (rectangle){(int)fmin(fmax(floor(low[0]) - 2.0, 0.0), frame->width),
                       (int)fmin(fmax(floor(low[1]) - 2.0, 0.0), frame->height),
                       (int)fmax(fmin(ceil(high[0]) + 2.0, frame->width), 0.0),
                       (int)fmax(fmin(ceil(high[1]) + 2.0, frame->height), 0.0)};
}

/* Draws a part of the world into the front's frame. */
static vd_status draw_part(vd_impostors *set, vd_job *job, const vd_camera *camera,
                           const vd_world_part *part, int width, int height,
                           vd_world_stats *stats) {
    vd_pass pass;
    const int samples = set->renderer->samples;
    vd_status status = vd_frame_fit(set->context, width, height, VD_PLANE_DEPTH,
                                    &set->scratch->front, &set->scratch->front_pixels);
    if (status.code == VD_OK) {
        status = vd_world_renderer_set_samples(set->renderer, set->def.direct_samples);
    }
    if (status.code == VD_OK) {
        status =
            vd_world_draw_part(set->renderer, job, camera, part, set->scratch->front, &pass, stats);
        const vd_status back = vd_world_renderer_set_samples(set->renderer, samples);
        status = status.code == VD_OK ? back : status;
    }
    return status;
}

static vd_status merge_all(vd_impostors *set, vd_job *job, vd_task_function *rows, merging *m) {
    const int count = (m->in.y1 - m->in.y0 + MERGED_ROWS - 1) / MERGED_ROWS;
    return vd_parallel_for(set->context, job, count, rows, m);
}

/* Draws a part of the world over a rectangle of the frame. */
static vd_status draw_over(vd_impostors *set, vd_job *job, const vd_camera *camera,
                           const vd_world_part *part, rectangle in, merging_depth depth,
                           vd_frame *frame, vd_world_stats *stats) {
    vd_camera cut = *camera;
    cut.lens.cx -= in.x0;
    cut.lens.cy -= in.y0;
    if (in.x0 >= in.x1 || in.y0 >= in.y1) {
        return vd_success();
    }
    const vd_status status = draw_part(set, job, &cut, part, in.x1 - in.x0, in.y1 - in.y0, stats);
    merging m = {set->scratch->front, frame, in, depth};
    return status.code == VD_OK ? merge_all(set, job, merge_rows, &m) : status;
}

/* ---- the front, coarser when time is short ----------------------------------------------------*/

/* Of a frame's time, and with particles in it. */
#define SHARE 0.5
#define BOTH_SHARE 0.3

static const double scales[] = {1.0, 0.75, 0.5, 0.35};

double vd_impostor_pace_scale(const vd_impostor_pace *pace) {
    return scales[pace->level];
}

void vd_impostor_pace_learn(const vd_impostors *set, vd_impostor_pace *pace, double took_s,
                            double share) {
    enum { LEAST_FRAMES = 10, FEW_TURNS = 2 };
    const double most_s = share / set->def.rate_hz;
    const double finer = pace->level > 0 ? scales[pace->level - 1] / scales[pace->level] : 1.0;
    pace->frames++;
    if (set->def.budget_pixels > 0 || pace->frames < (set->def.ship ? FEW_TURNS : LEAST_FRAMES)) {
        return; /* a virtual clock does not look at the machine */
    }
    if (took_s > most_s && pace->level < pace->last) {
        pace->level++;
        pace->frames = 0;
    } else if (pace->level > 0 && took_s * finer * finer < 0.7 * most_s) {
        pace->level--;
        pace->frames = 0;
    }
}

vd_status vd_impostors_enlarge(vd_impostors *set, vd_job *job, const int in[4], vd_frame *frame) {
    const vd_frame *front = set->scratch->front;
    const float x0 = (float)in[0], y0 = (float)in[1], x1 = (float)in[2], y1 = (float)in[3];
    const vd_quad quad = {
        .corners = {{x0, y0, 1.0f}, {x1, y0, 1.0f}, {x1, y1, 1.0f}, {x0, y1, 1.0f}},
        .picture = {.rgba = front->rgba,
                    .width = front->width,
                    .height = front->height,
                    .stride = front->stride},
        .opacity = 255};
    return vd_display_draw(set->display, job, frame, &quad, 1, NULL);
}

/* The frame's depth from the front's, where that is nearer. */
static void keep_depth(void *user, int index, int worker) {
    const merging *m = user;
    const rectangle in = m->in;
    const int end = (index + 1) * MERGED_ROWS, rows = in.y1 - in.y0, width = in.x1 - in.x0;
    (void)worker;
    for (int y = index * MERGED_ROWS; y < end && y < rows; y++) {
        const float *near =
            m->from->depth + ((size_t)y * (size_t)m->from->height / (size_t)rows) * m->from->stride;
        float *depth = m->to->depth + (size_t)(in.y0 + y) * m->to->stride + (size_t)in.x0;
        for (int x = 0; x < width; x++) {
            const float at = near[(size_t)x * (size_t)m->from->width / (size_t)width];
            depth[x] = depth[x] < at ? at : depth[x];
        }
    }
}

/* As draw_over with DEPTH_KEPT, drawn smaller and shown larger. */
static vd_status draw_coarsely(vd_impostors *set, vd_job *job, const vd_camera *camera,
                               const vd_world_part *part, rectangle in, double scale,
                               vd_frame *frame, vd_world_stats *stats) {
    vd_camera cut = *camera;
    const int wide = in.x1 - in.x0, high = in.y1 - in.y0;
    if (wide <= 0 || high <= 0) {
        return vd_success();
    }
    const int width = (int)ceil(wide * scale) + 1, height = (int)ceil(high * scale) + 1;
    const double x = (double)width / wide, y = (double)height / high;
    cut.lens.cx = (cut.lens.cx - in.x0) * x, cut.lens.fx *= x;
    cut.lens.cy = (cut.lens.cy - in.y0) * y, cut.lens.fy *= y;
    vd_status status = draw_part(set, job, &cut, part, width, height, stats);
    merging m = {.from = set->scratch->front, .to = frame, .in = in};
    if (status.code == VD_OK) {
        status = merge_all(set, job, keep_depth, &m);
    }
    const int sides[4] = {in.x0, in.y0, in.x1, in.y1};
    return status.code == VD_OK ? vd_impostors_enlarge(set, job, sides, frame) : status;
}

/* Draws the front, and chooses how coarse the next one is. */
static vd_status draw_scaled(vd_impostors *set, vd_job *job, const vd_camera *camera,
                             const vd_world_part *part, rectangle in, vd_frame *frame,
                             vd_world_stats *stats) {
    const uint64_t start = vd_clock_ns();
    const double scale = vd_impostor_pace_scale(&set->front_pace);
    const vd_status status = scale == 1.0
                                 ? draw_over(set, job, camera, part, in, DEPTH_KEPT, frame, stats)
                                 : draw_coarsely(set, job, camera, part, in, scale, frame, stats);
    vd_impostor_pace_learn(set, &set->front_pace, 1e-9 * (double)(vd_clock_ns() - start),
                           set->clouds > 0 ? BOTH_SHARE : SHARE);
    return status;
}

vd_status vd_impostors_draw_patch(vd_impostors *set, vd_job *job, const vd_camera *camera,
                                  uint32_t node, vd_frame *frame, vd_world_stats *stats) {
    const uint32_t patch = vd_impostor_patch(set, node);
    const vd_cells cells = vd_ground_cells(&set->ground, patch);
    const vd_terrain_window window = vd_cells_window(&cells);
    vd_world_part part = {.ground = &window};
    const uint32_t placed = set->ground.patches[patch].placed;
    if (set->def.most_direct == 0 || set->shown_things + placed <= set->def.most_direct) {
        set->shown_things += placed;
        part.standing = &cells;
    } else {
        part.bare = true;
    }
    const vd_impostor_view view = {
        .camera = *camera,
        .drop_per_m2 = set->world->def.terrain.curvature ? vd_curvature_drop(1.0) : 0.0};
    vd_vec3 min, max;
    vd_impostor_bounds(set, &view, node, &min, &max);
    return draw_over(set, job, camera, &part, rectangle_of(camera, frame, min, max), DEPTH_NONE,
                     frame, stats);
}

/* Where the near ground and what stands on it are on screen. */
static rectangle near_rectangle(const vd_impostors *set, const vd_camera *camera,
                                const vd_frame *frame) {
    vd_vec3 min = vd_vec3_make(INFINITY, INFINITY, INFINITY), max = vd_vec3_scale(min, -1.0);
    if (set->any_near) {
        vd_ground_box(&set->ground, set->renderer, &set->near, &min, &max);
    }
    const uint32_t *direct = set->direct.data;
    for (size_t i = 0; i < set->direct.count; i++) {
        const vd_node *node = &set->world->nodes[direct[i]];
        if (!node->names) {
            min = vd_vec3_min(min, node->min);
            max = vd_vec3_max(max, node->max);
        }
    }
    if (!(min.x <= max.x)) {
        return (rectangle){0, 0, frame->width, frame->height};
    }
    if (set->world->def.terrain.curvature) {
        const double x = fmax(fabs(min.x - camera->eye.x), fabs(max.x - camera->eye.x));
        const double y = fmax(fabs(min.y - camera->eye.y), fabs(max.y - camera->eye.y));
        min.z -= vd_curvature_drop(1.0) * (x * x + y * y);
    }
    return rectangle_of(camera, frame, min, max);
}

vd_status vd_impostors_draw_front(vd_impostors *set, vd_job *job, const vd_camera *camera,
                                  vd_frame *frame, vd_world_stats *stats) {
    const vd_terrain_window none = VD_TERRAIN_NO_CELLS;
    const vd_terrain_window window = set->any_near ? vd_cells_window(&set->near) : none;
    const vd_world_part front = {
        .ground = &window, .nodes = set->direct.data, .count = set->direct.count};
    return set->any_near || set->direct.count > 0
               ? draw_scaled(set, job, camera, &front, near_rectangle(set, camera, frame), frame,
                             stats)
               : vd_success();
}

vd_status vd_impostors_draw_lines(vd_impostors *set, vd_job *job, const vd_camera *camera,
                                  vd_frame *frame, vd_world_stats *stats) {
    const vd_terrain_window none = VD_TERRAIN_NO_CELLS;
    const rectangle all = {0, 0, frame->width, frame->height};
    const vd_world_part lines = {
        .ground = &none, .nodes = set->lines.data, .count = set->lines.count, .bare = true};
    return set->lines.count > 0
               ? draw_over(set, job, camera, &lines, all, DEPTH_TESTED, frame, stats)
               : vd_success();
}

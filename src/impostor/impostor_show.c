/* impostor_show.c: impostors on the screen.
 *
 * First the ground and what is drawn itself, with depth; then the pictures, back to front, each
 * hidden where something of the first is nearer than its plane.
 */
#include <math.h>
#include <string.h>
#include "core/core.h"
#include "image/image.h"
#include "impostor/impostor_set.h"
#include "terrain/lens_renderer.h"

/* Corners of a picture, its transparent edge included. */
static void corners_of(const vd_impostor_picture *p, vd_vec3 out[4]) {
    const double *e = p->plane.extent;
    const double x = VD_IMPOSTOR_PAD * (e[2] - e[0]) / (p->width - 2 * VD_IMPOSTOR_PAD);
    const double y = VD_IMPOSTOR_PAD * (e[3] - e[1]) / (p->height - 2 * VD_IMPOSTOR_PAD);
    out[0] = vd_impostor_plane_at(&p->plane, e[0] - x, e[1] - y);
    out[1] = vd_impostor_plane_at(&p->plane, e[2] + x, e[1] - y);
    out[2] = vd_impostor_plane_at(&p->plane, e[2] + x, e[3] + y);
    out[3] = vd_impostor_plane_at(&p->plane, e[0] - x, e[3] + y);
}

/* How far a corner is inside one of the five planes: the near one and the frame's edges. */
static double inside(int plane, const double at[3], const vd_frame *frame, double near_m) {
    switch (plane) {
    case 0:
        return at[2] - near_m;
    case 1:
        return at[0];
    case 2:
        return frame->width * at[2] - at[0];
    case 3:
        return at[1];
    default:
        return frame->height * at[2] - at[1];
    }
}

/* Pixels of a frame that a quad covers: its outline clipped (Sutherland & Hodgman 1974). */
static double area_of(const vd_quad *quad, const vd_frame *frame, double near_m) {
    double points[2][32][3]; /* rounding may bend an outline: 3/2 as many corners a plane */
    int count = 4, from = 0;
    for (int i = 0; i < 4; i++) {
        points[0][i][0] = (double)quad->corners[i].x;
        points[0][i][1] = (double)quad->corners[i].y;
        points[0][i][2] = (double)quad->corners[i].w;
    }
    for (int plane = 0; plane < 5; plane++, from = 1 - from) {
        int made = 0;
        for (int i = 0; i < count; i++) {
            const double *a = points[from][i], *b = points[from][i + 1 < count ? i + 1 : 0];
            const double in_a = inside(plane, a, frame, near_m),
                         in_b = inside(plane, b, frame, near_m);
            if (in_a >= 0.0) {
                memcpy(points[1 - from][made++], a, sizeof points[0][0]);
            }
            if ((in_a < 0.0) != (in_b < 0.0)) {
                const double t = in_a / (in_a - in_b);
                for (int k = 0; k < 3; k++) {
                    points[1 - from][made][k] = a[k] + t * (b[k] - a[k]);
                }
                made++;
            }
        }
        count = made;
    }
    double twice = 0.0;
    for (int i = 0; i < count; i++) {
        const double *a = points[from][i], *b = points[from][i + 1 < count ? i + 1 : 0];
        twice += (a[0] * b[1] - b[0] * a[1]) / (a[2] * b[2]);
    }
    return 0.5 * fabs(twice);
}

static double overdraw_of(const vd_impostors *set, const vd_frame *frame, double near_m) {
    const vd_quad *quads = set->quads.data;
    const size_t step = set->def.show != VD_IMPOSTOR_SHOW_PICTURES ? 2 : 1; /* tints do not count */
    double pixels = 0.0;
    for (size_t i = 0; i < set->quads.count; i += step) {
        pixels += area_of(&quads[i], frame, near_m);
    }
    return pixels / ((double)frame->width * (double)frame->height);
}

static vd_status add_quad(vd_impostors *set, const vd_camera *camera, const vd_impostor_slot *slot,
                          const vd_impostor_picture *picture, uint8_t opacity) {
    vd_vec3 corners[4];
    vd_quad quad = {.picture = {.rgba = picture->rgba,
                                .width = picture->width,
                                .height = picture->height,
                                .stride = (size_t)picture->width},
                    .opacity = opacity};
    const vd_impostor_plane *plane = &picture->plane;
    quad.nearer = (float)(plane->distance_m / (plane->distance_m - plane->depth_m));
    for (int i = 0; i < 4; i++) {
        quad.picture.opaque[i] = picture->opaque[i];
    }
    corners_of(picture, corners);
    const vd_status status = vd_quad_place(&quad, camera, corners);
    if (status.code != VD_OK) {
        return vd_success(); /* too far away to be told from nothing */
    }
    const bool tinted = set->def.show != VD_IMPOSTOR_SHOW_PICTURES;
    vd_quad *to = vd_list_add(set->context, &set->quads, tinted ? 2 : 1, sizeof *to);
    if (to == NULL) {
        return vd_out_of_memory("a picture's impostors", sizeof *to);
    }
    to[0] = quad;
    if (tinted) {
        to[1] = quad;
        to[1].picture = vd_impostor_tint(set, slot);
    }
    set->stats.pixels_shown += (uint64_t)picture->width * (uint64_t)picture->height;
    return vd_success();
}

/* A picture, and while it is new the one that it takes the place of: the old one stays whole under
 * it until the new one is. */
static vd_status add_slot(vd_impostors *set, const vd_camera *camera, vd_impostor_slot *slot) {
    const double age = set->time_s - slot->born_s;
    const bool fades = slot->before.rgba != NULL && age < set->def.fade_s;
    vd_status status = vd_success();
    if (!fades) {
        vd_impostor_release(set, &slot->before);
    } else {
        status = add_quad(set, camera, slot, &slot->before, 255);
    }
    const double share = fades ? age / set->def.fade_s : 1.0;
    return status.code == VD_OK && slot->now.rgba != NULL
               ? add_quad(set, camera, slot, &slot->now, (uint8_t)(255.0 * share + 0.5))
               : status;
}

/* Shows the quads that were gathered, and forgets them. */
static vd_status show_quads(vd_impostors *set, vd_job *job, const vd_camera *camera,
                            bool test_depth, vd_frame *frame) {
    const uint64_t start = vd_clock_ns();
    vd_display_def def = vd_display_def_default();
    def.near_m = (float)camera->near_m;
    def.test_depth = test_depth;
    const vd_status status =
        vd_display_draw(set->display, job, frame, set->quads.data, (int)set->quads.count, &def);
    set->stats.overdraw += overdraw_of(set, frame, camera->near_m);
    set->stats.show_s += 1e-9 * (double)(vd_clock_ns() - start);
    set->quads.count = 0;
    return status;
}

/* ---- what is drawn itself ---------------------------------------------------------------------*/

/* Patches have no depth and lie behind what is drawn itself; lines are hidden by all ground. */
typedef enum merging_depth { DEPTH_NONE = 0, DEPTH_KEPT, DEPTH_TESTED } merging_depth;

typedef struct merging {
    const vd_frame *from;
    vd_frame *to;
    int x, y; /* where in it */
    merging_depth depth;
} merging;

#define MERGED_ROWS 16

/* Premultiplied over, as quads are: new + round(old·(255 − a) / 255). */
static void blend_over(const uint8_t *restrict from, uint8_t *restrict to, int pixels) {
    for (int i = 0; i < pixels; i++) {
        const unsigned rest = 255u - from[4 * i + 3];
        for (int k = 0; k < 4; k++) {
            const unsigned product = to[4 * i + k] * rest + 128u;
            to[4 * i + k] = (uint8_t)(from[4 * i + k] + ((product + (product >> 8)) >> 8));
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
        const size_t at = (size_t)(m->y + y) * m->to->stride + (size_t)m->x;
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

static vd_status reserve_front(vd_impostors *set, int width, int height) {
    const size_t pixels = vd_frame_stride(width) * (size_t)height;
    if (set->front == NULL || pixels > set->front_pixels) {
        vd_frame_destroy(&set->front);
        set->front_pixels = 0;
        const vd_status status =
            vd_frame_create(set->context, width, height, VD_PLANE_DEPTH, &set->front);
        if (status.code != VD_OK) {
            return status;
        }
        set->front_pixels = pixels;
    }
    set->front->width = width;
    set->front->height = height;
    set->front->stride = vd_frame_stride(width);
    return vd_success();
}

/* A rectangle of a picture's pixels. */
typedef struct rectangle {
    int x0, y0, x1, y1;
} rectangle;

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

/* Draws a part of the world over a rectangle of the frame; its depth too, if asked. */
static vd_status draw_over(vd_impostors *set, vd_job *job, const vd_camera *camera,
                           const vd_world_part *part, rectangle in, merging_depth depth,
                           vd_frame *frame, vd_world_stats *stats) {
    vd_pass pass;
    vd_camera cut = *camera;
    cut.lens.cx -= in.x0;
    cut.lens.cy -= in.y0;
    if (in.x0 >= in.x1 || in.y0 >= in.y1) {
        return vd_success();
    }
    const int samples = set->renderer->samples;
    vd_status status = reserve_front(set, in.x1 - in.x0, in.y1 - in.y0);
    if (status.code == VD_OK) {
        status = vd_world_renderer_set_samples(set->renderer, set->def.direct_samples);
    }
    if (status.code == VD_OK) {
        status = vd_world_draw_part(set->renderer, job, &cut, part, set->front, &pass, stats);
        const vd_status back = vd_world_renderer_set_samples(set->renderer, samples);
        status = status.code == VD_OK ? back : status;
    }
    if (status.code == VD_OK) {
        merging m = {set->front, frame, in.x0, in.y0, depth};
        status =
            vd_parallel_for(set->context, job, (set->front->height + MERGED_ROWS - 1) / MERGED_ROWS,
                            merge_rows, &m);
    }
    return status;
}

/* A patch that has no picture yet: its ground, and what stands on it if that is not too much. */
static vd_status draw_patch(vd_impostors *set, vd_job *job, const vd_camera *camera, uint32_t node,
                            vd_frame *frame, vd_world_stats *stats) {
    const uint32_t patch = vd_impostor_patch(set, node);
    const vd_cells cells = vd_ground_cells(&set->ground, patch);
    const vd_terrain_window window = vd_cells_window(&cells);
    vd_world_part part = {.ground = &window};
    const uint32_t placed = set->ground.patches[patch].placed;
    if (set->def.most_direct == 0 || set->shown_things + placed <= set->def.most_direct) {
        set->shown_things += placed;
        part.standing = &cells;
    }
    const vd_impostor_view view = {
        .camera = *camera,
        .drop_per_m2 = set->world->def.terrain.curvature ? vd_curvature_drop(1.0) : 0.0};
    vd_vec3 min, max;
    vd_impostor_bounds(set, &view, node, &min, &max);
    return draw_over(set, job, camera, &part, rectangle_of(camera, frame, min, max), DEPTH_NONE,
                     frame, stats);
}

/* Patches, back to front. */
static vd_status show_patches(vd_impostors *set, vd_job *job, const vd_camera *camera,
                              vd_frame *frame, vd_world_stats *stats) {
    const uint32_t *far = set->far.data;
    vd_status status = vd_success();
    set->shown_things = set->things;
    for (size_t i = 0; i < set->far.count && status.code == VD_OK; i++) {
        vd_impostor_slot *slot = vd_impostor_slot_at(set, far[i]);
        if (slot->now.rgba != NULL || slot->empty) {
            status = add_slot(set, camera, slot);
            continue;
        }
        status = show_quads(set, job, camera, false, frame);
        if (status.code == VD_OK) {
            status = draw_patch(set, job, camera, slot->node, frame, stats);
        }
    }
    return status.code == VD_OK ? show_quads(set, job, camera, false, frame) : status;
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

/* ---- what stands on no patch ------------------------------------------------------------------*/

/* Pixels a side of the screen to one of the ground's coarse depth. */
#define COARSE 4

/* The depth of all ground, for what does not stand on it. */
static vd_status draw_relief(vd_impostors *set, vd_job *job, const vd_camera *camera,
                             vd_frame *frame) {
    const int width = (frame->width + COARSE - 1) / COARSE;
    const int height = (frame->height + COARSE - 1) / COARSE;
    vd_camera coarse = *camera;
    coarse.lens.fx /= COARSE, coarse.lens.fy /= COARSE;
    coarse.lens.cx /= COARSE, coarse.lens.cy /= COARSE;
    vd_status status = vd_success();
    if (set->relief == NULL || set->relief->width != width || set->relief->height != height) {
        vd_frame_destroy(&set->relief);
        status = vd_frame_create(set->context, width, height, VD_PLANE_DEPTH, &set->relief);
    }
    const int samples = set->renderer->samples;
    if (status.code == VD_OK) {
        status = vd_terrain_renderer_set_samples(set->renderer->ground, 1);
    }
    if (status.code == VD_OK) {
        status = vd_terrain_renderer_draw(set->renderer->ground, job, &coarse, set->relief, NULL);
        set->renderer->ground->def.samples = samples;
    }
    for (int y = 0; y < frame->height && status.code == VD_OK; y++) {
        const float *from = set->relief->depth + (size_t)(y / COARSE) * set->relief->stride;
        float *to = frame->depth + (size_t)y * frame->stride;
        for (int x = 0; x < frame->width; x++) {
            to[x] = from[x / COARSE];
        }
    }
    return status;
}

/* Patches, and over them what is drawn itself: it is nearer than all patches. The sky comes under
 * all of it at the end, where it is seen. */
static vd_status draw_by_patches(vd_impostors *set, vd_job *job, const vd_camera *camera,
                                 vd_frame *frame, vd_world_stats *stats) {
    const vd_terrain_window none = VD_TERRAIN_NO_CELLS;
    const vd_terrain_window window = set->any_near ? vd_cells_window(&set->near) : none;
    const vd_world_part front = {
        .ground = &window, .nodes = set->direct.data, .count = set->direct.count};
    const vd_world_part lines = {
        .ground = &none, .nodes = set->lines.data, .count = set->lines.count};
    memset(frame->depth, 0, frame->stride * (size_t)frame->height * sizeof(float));
    memset(frame->rgba, 0, 4 * frame->stride * (size_t)frame->height);
    vd_frame_forget_objects(frame);
    vd_status status = show_patches(set, job, camera, frame, stats);
    if (status.code == VD_OK) {
        if (set->any_loose) {
            status = draw_relief(set, job, camera, frame);
        }
    }
    if (status.code == VD_OK && (set->any_near || set->direct.count > 0)) {
        status = draw_over(set, job, camera, &front, near_rectangle(set, camera, frame), DEPTH_KEPT,
                           frame, stats);
    }
    if (status.code == VD_OK && set->lines.count > 0) {
        status = draw_over(set, job, camera, &lines, (rectangle){0, 0, frame->width, frame->height},
                           DEPTH_TESTED, frame, stats);
    }
    return status;
}

/* Particles that are drawn themselves in a frame: about these many, by their detail. */
#define MOST_PARTICLES 1000000u
#define COARSEST 32.0

/* Their detail in the next frame, of which this one tells. */
static void refine_clouds(vd_impostors *set, uint64_t particles) {
    if (particles > MOST_PARTICLES && set->cloud_detail < COARSEST) {
        set->cloud_detail *= particles > 4 * MOST_PARTICLES ? 4.0 : 1.5;
    } else if (particles < MOST_PARTICLES / 4 && set->cloud_detail > 1.0) {
        set->cloud_detail = fmax(set->cloud_detail / 1.5, 1.0);
    }
}

/* All of it, into a frame that has depth. */
static vd_status draw_all(vd_impostors *set, vd_job *job, const vd_camera *camera,
                          vd_frame *frame) {
    const uint64_t start = vd_clock_ns();
    vd_pass pass;
    vd_world_stats own = {.objects = 0};
    const vd_world_part all = {.nodes = set->direct.data, .count = set->direct.count, .sky = true};
    set->stats.overdraw = set->stats.show_s = 0.0;
    set->quads.count = 0;
    vd_status status = set->ground.count > 0 ? draw_by_patches(set, job, camera, frame, &own)
                                             : vd_world_draw_part(set->renderer, job, camera, &all,
                                                                  frame, &pass, &own);
    set->stats.direct_s = 1e-9 * (double)(vd_clock_ns() - start) - set->stats.show_s;
    const uint32_t *shown = set->shown.data;
    for (size_t i = 0; i < set->shown.count && status.code == VD_OK; i++) {
        status = add_slot(set, camera, vd_impostor_slot_at(set, shown[i]));
    }
    if (status.code == VD_OK) {
        status = show_quads(set, job, camera, true, frame);
    }
    if (status.code == VD_OK && set->ground.count > 0) {
        status = vd_terrain_draw_under(set->renderer->ground, job, camera, frame);
    }
    if (status.code == VD_OK) {
        status = vd_world_begin_over(set->renderer, camera, set->direct.data, set->direct.count,
                                     frame, &pass, &own);
    }
    if (status.code == VD_OK) {
        set->renderer->cloud_detail = set->cloud_detail;
        own.particles = 0;
        status = vd_world_draw_over(set->renderer, job, &pass, frame);
        set->renderer->cloud_detail = 0.0;
        refine_clouds(set, own.particles);
    }
    return status;
}

vd_status vd_impostors_draw(vd_impostors *set, vd_job *job, const vd_camera *camera,
                            vd_frame *frame, vd_impostor_stats *stats) {
    vd_status status = vd_camera_validate(camera);
    const bool lend = frame->depth == NULL;
    if (status.code == VD_OK && lend) {
        status = vd_buffer_reserve(set->context, &set->depth, "a picture's depth",
                                   frame->stride * (size_t)frame->height, sizeof(float));
        frame->depth = set->depth.memory;
    }
    const bool still = set->def.show == VD_IMPOSTOR_SHOW_PICTURES && !set->frozen;
    if (status.code == VD_OK && !(still && vd_impostors_copy_still(set, camera, frame))) {
        status = draw_all(set, job, camera, frame);
        if (status.code != VD_OK) {
            status = vd_impostors_set_aside(set, job, camera, frame, status);
            status = status.code == VD_OK ? draw_all(set, job, camera, frame) : status;
        }
    }
    if (lend) {
        frame->depth = NULL;
    }
    if (stats != NULL) {
        *stats = set->stats;
    }
    return status;
}

/* impostor_show.c: impostors on the screen.
 *
 * First patches of the ground, back to front, without depth; over them what is drawn itself, with
 * depth; then pictures of objects, back to front, each hidden where something of that is nearer
 * than its plane. Sky, and ground between patches, come under all of it. A world without patches is
 * drawn itself first, ground and sky included.
 */
#include <math.h>
#include <string.h>
#include "core/core.h"
#include "image/image.h"
#include "impostor/impostor_set.h"
#include "terrain/lens_renderer.h"

/* Corners of a picture, its transparent edge included. */
void vd_impostor_corners(const vd_impostor_picture *p, vd_vec3 out[4]) {
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
    /* Along the line of sight. */
    const double away = vd_vec3_dot(vd_vec3_subtract(plane->eye, plane->origin), plane->normal);
    quad.nearer = (float)(away / fmax(away - plane->depth_m, 1e-3 * away));
    for (int i = 0; i < 4; i++) {
        quad.picture.opaque[i] = picture->opaque[i];
    }
    vd_impostor_corners(picture, corners);
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
            status = vd_impostors_draw_patch(set, job, camera, slot->node, frame, stats);
        }
    }
    return status.code == VD_OK ? show_quads(set, job, camera, false, frame) : status;
}

/* What is drawn itself, over patches: it is nearer than all of them. */
static vd_status draw_before_patches(vd_impostors *set, vd_job *job, const vd_camera *camera,
                                     vd_frame *frame, vd_world_stats *stats) {
    vd_status status = vd_success();
    if (set->any_loose) {
        status = vd_impostors_draw_relief(set, job, camera, frame);
    }
    if (status.code == VD_OK) {
        status = vd_impostors_draw_front(set, job, camera, frame, stats);
    }
    return status.code == VD_OK ? vd_impostors_draw_lines(set, job, camera, frame, stats) : status;
}

/* Patches, and what is before them. The sky comes under all of it at the end, where it is seen. */
static vd_status draw_by_patches(vd_impostors *set, vd_job *job, const vd_camera *camera,
                                 vd_frame *frame, vd_world_stats *stats) {
    memset(frame->depth, 0, frame->stride * (size_t)frame->height * sizeof(float));
    memset(frame->rgba, 0, 4 * frame->stride * (size_t)frame->height);
    vd_frame_forget_objects(frame);
    const vd_status status = show_patches(set, job, camera, frame, stats);
    return status.code == VD_OK ? draw_before_patches(set, job, camera, frame, stats) : status;
}

/* Object pictures, tested by depth; not those that a client has by themselves. */
static vd_status draw_objects(vd_impostors *set, vd_job *job, const vd_camera *camera,
                              vd_frame *frame) {
    const uint32_t *shown = set->shown.data;
    vd_status status = vd_success();
    for (size_t i = 0; i < set->shown.count && status.code == VD_OK; i++) {
        vd_impostor_slot *slot = vd_impostor_slot_at(set, shown[i]);
        if (!set->def.ship || vd_impostor_is_in_front(set, slot)) {
            status = add_slot(set, camera, slot);
        }
    }
    return status.code == VD_OK ? show_quads(set, job, camera, true, frame) : status;
}

bool vd_impostors_shown_in_front(const vd_impostors *set) {
    const vd_terrain_def *terrain = &set->world->def.terrain;
    return terrain->heightfield != NULL || terrain->function != NULL;
}

vd_status vd_impostors_draw_alone(vd_impostors *set, vd_job *job, const vd_camera *camera,
                                  vd_frame *frame) {
    vd_pass pass;
    vd_world_stats own = {.objects = 0};
    const size_t pixels = frame->stride * (size_t)frame->height;
    const vd_world_part all = {.nodes = set->direct.data, .count = set->direct.count};
    vd_overlay_function *const overlay = set->renderer->def.overlay;
    set->stats.overdraw = set->stats.show_s = 0.0;
    set->quads.count = 0;
    vd_status status = vd_success();
    if (set->ground.count > 0) {
        memset(frame->rgba, 0, 4 * pixels);
        memset(frame->depth, 0, pixels * sizeof(float));
        status = draw_before_patches(set, job, camera, frame, &own);
    } else {
        status = vd_world_draw_part(set->renderer, job, camera, &all, frame, &pass, &own);
    }
    if (status.code == VD_OK && vd_impostors_shown_in_front(set)) {
        vd_impostors_part_objects(set, camera, frame);
        status = draw_objects(set, job, camera, frame);
    }
    if (status.code == VD_OK) {
        set->renderer->def.overlay = NULL; /* it belongs to the screen and not to the world */
        status = vd_impostors_draw_over(set, job, camera, frame, &own);
        set->renderer->def.overlay = overlay;
    }
    return status;
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
    if (status.code == VD_OK) {
        status = draw_objects(set, job, camera, frame);
    }
    if (status.code == VD_OK && set->ground.count > 0) {
        status = vd_terrain_draw_under(set->renderer->ground, job, camera, !set->frozen, frame);
    }
    return status.code == VD_OK ? vd_impostors_draw_over(set, job, camera, frame, &own) : status;
}

vd_status vd_impostors_draw(vd_impostors *set, vd_job *job, const vd_camera *camera,
                            vd_frame *frame, vd_impostor_stats *stats) {
    vd_status status = vd_impostors_check(camera, frame->width, frame->height);
    const bool lend = frame->depth == NULL;
    if (status.code == VD_OK && lend) {
        status = vd_buffer_reserve(set->context, &set->depth, "a picture's depth",
                                   frame->stride * (size_t)frame->height, sizeof(float));
        frame->depth = set->depth.memory;
    }
    const bool still = set->def.show == VD_IMPOSTOR_SHOW_PICTURES && !set->frozen;
    const uint64_t start = vd_clock_ns();
    if (status.code == VD_OK && still && vd_impostors_copy_still(set, camera, frame)) {
        set->stats.overdraw = 1.0;
        set->stats.pixels_shown += (uint64_t)frame->width * (uint64_t)frame->height;
        set->stats.direct_s = 0.0;
        set->stats.show_s = 1e-9 * (double)(vd_clock_ns() - start);
    } else if (status.code == VD_OK) {
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

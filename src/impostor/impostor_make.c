/* impostor_make.c: drawing the picture of a node. */
#include <math.h>
#include <string.h>
#include "core/core.h"
#include "image/image.h"
#include "impostor/impostor_pool.h"

#define MOST_SIDE 2048

/* Pixels by which pictures of neighbouring patches overlap, besides what they may be wrong by. */
#define SKIRT_PX 4.0

/* The part of a side that is kept: what is on it, padded, and no less than one pixel. */
static void keep_side(int side, int *first, int *end) {
    enum { LEAST = 2 * VD_IMPOSTOR_PAD + 1 };
    *first = *first > VD_IMPOSTOR_PAD ? *first - VD_IMPOSTOR_PAD : 0;
    *end = *end + VD_IMPOSTOR_PAD < side ? *end + VD_IMPOSTOR_PAD : side;
    *end = *end - *first < LEAST ? *first + LEAST : *end;
    if (*end > side) {
        *first -= *end - side;
        *end = side;
    }
}

/* Copies what is on the canvas, without the transparent margins that bounds have around what they
 * bound; rgba stays null when memory is out. */
static void take_picture(const vd_impostor_brush *brush, vd_impostor_picture *made) {
    const vd_frame *c = *brush->canvas;
    int box[4] = {0, 0, c->width, c->height};
    made->empty = !vd_frame_shrink(c, box);
    if (made->empty) {
        box[2] = box[3] = 0;
    }
    keep_side(c->width, &box[0], &box[2]);
    keep_side(c->height, &box[1], &box[3]);
    const int x0 = box[0], y0 = box[1], x1 = box[2], y1 = box[3];
    double *e = made->plane.extent;
    const double wide = (e[2] - e[0]) / (c->width - 2 * VD_IMPOSTOR_PAD);
    const double high = (e[3] - e[1]) / (c->height - 2 * VD_IMPOSTOR_PAD);
    e[2] = e[0] + (x1 - 2 * VD_IMPOSTOR_PAD) * wide;
    e[3] = e[1] + (y1 - 2 * VD_IMPOSTOR_PAD) * high;
    e[0] += x0 * wide;
    e[1] += y0 * high;
    made->width = x1 - x0;
    made->height = y1 - y0;
    const size_t row = (size_t)made->width * 4;
    made->rgba = vd_allocate(brush->pictures, (size_t)made->height, row);
    for (int y = 0; y < made->height && made->rgba != NULL; y++) {
        const size_t from = (size_t)(y0 + y) * c->stride + (size_t)x0;
        memcpy(made->rgba + (size_t)y * row, c->rgba + 4 * from, row);
    }
}

/* Pixels of a side that is `metres` long on the plane; padded. */
static int side_of(double metres, const vd_impostor_plane *plane, double focal_px) {
    const double side = ceil(metres * focal_px / plane->distance_m) + 2 * VD_IMPOSTOR_PAD;
    return side < MOST_SIDE ? (side > 2 * VD_IMPOSTOR_PAD + 1 ? (int)side : 2 * VD_IMPOSTOR_PAD + 1)
                            : MOST_SIDE;
}

/* How many cells a patch's picture goes on beyond the patch, so that pictures of neighbours overlap
 * by some pixels, wrong as either may be. Only towards the eye: what is nearer is shown later and
 * covers it, with all that stands there. */
static void add_skirt(const vd_impostors *set, const vd_impostor_view *view,
                      const vd_impostor_plane *plane, vd_cells *cells) {
    const double *m = set->ground.world_from_sample;
    const double cell = fmin(hypot(m[1], m[4]), hypot(m[2], m[5]));
    const vd_vec3 sight = vd_vec3_subtract(view->eye, plane->origin);
    const double sine = fmax(fabs(sight.z) / vd_vec3_length(sight), 0.05);
    const double wanted = SKIRT_PX + 2.0 * set->def.tolerance_px;
    const double cells_wide = ceil(wanted * plane->distance_m / (view->focal_px * sine * cell));
    const int most = cells->c1 - cells->c0 + cells->r1 - cells->r0 + 2;
    const int width = cells_wide < most ? (int)cells_wide : most;
    const vd_cells *map = &set->ground.map;
    const vd_cells in = *cells;
    const unsigned sides = vd_impostor_sides(view, &in);
    if ((sides & 1u) != 0) {
        cells->c0 = in.c0 - width > map->c0 ? in.c0 - width : map->c0;
    }
    if ((sides & 2u) != 0) {
        cells->c1 = in.c1 + width < map->c1 ? in.c1 + width : map->c1;
    }
    if ((sides & 4u) != 0) {
        cells->r0 = in.r0 - width > map->r0 ? in.r0 - width : map->r0;
    }
    if ((sides & 8u) != 0) {
        cells->r1 = in.r1 + width < map->r1 ? in.r1 + width : map->r1;
    }
}

/* The cells that a node's bounds lie over: ground that they go into. */
static vd_cells cells_under(const vd_impostors *set, uint32_t node) {
    const vd_node *n = &set->world->nodes[node];
    vd_cells in = {0, 0, 0, 0};
    for (int i = 0; i < 4; i++) {
        int c, r;
        vd_world_cell(set->ground.sample_from_world, &set->ground.map,
                      (i & 1) != 0 ? n->max.x : n->min.x, (i & 2) != 0 ? n->max.y : n->min.y, &c,
                      &r);
        const vd_cells at = {c, r, c, r};
        in = i == 0 ? at : vd_cells_join(&in, &at);
    }
    return in;
}

/* The plane of a node's picture: the best one, or where that cannot be one that faces the eye. */
static bool fit_plane(const vd_impostors *set, const vd_impostor_view *view, uint32_t node,
                      vd_impostor_plane *out) {
    vd_vec3 points[VD_IMPOSTOR_POINTS], through, normal;
    const int count = vd_impostor_key_points(set, view, node, points);
    (void)vd_impostor_best_plane(set, view, node, &through, &normal);
    return vd_impostor_plane_fit(view->eye, through, normal, points, count, out) ||
           (vd_vec3_dot(normal, normal) > 0.0 &&
            vd_impostor_plane_fit(view->eye, through, vd_vec3_make(0, 0, 0), points, count, out));
}

/* Metres along the plane's line of sight to the nearest key point. */
static double front_of(const vd_impostors *set, const vd_impostor_view *view, uint32_t node,
                       const vd_impostor_plane *plane) {
    vd_vec3 points[VD_IMPOSTOR_POINTS];
    const int count = vd_impostor_key_points(set, view, node, points);
    double front = (double)INFINITY;
    for (int i = 0; i < count; i++) {
        front = fmin(front, vd_vec3_dot(vd_vec3_subtract(plane->eye, points[i]), plane->normal));
    }
    return fmax(front, view->camera.near_m);
}

bool vd_impostors_draft(vd_impostors *set, const vd_impostor_view *view,
                        const vd_impostor_slot *slot, vd_impostor_draft *out) {
    *out = (vd_impostor_draft){.node = slot->node, .status = vd_success()};
    vd_impostor_picture *made = &out->picture;
    made->focal_px = view->focal_px * view->detail;
    if (!fit_plane(set, view, slot->node, &made->plane)) {
        return false;
    }
    const double *e = made->plane.extent;
    made->width = side_of(e[2] - e[0], &made->plane, made->focal_px);
    made->height = side_of(e[3] - e[1], &made->plane, made->focal_px);
    made->version = ++set->versions;
    const double away =
        vd_vec3_dot(vd_vec3_subtract(view->eye, made->plane.origin), made->plane.normal);
    const double nearest = 0.2 * away; /* key points are farther: vd_impostor_plane_fit */
    out->camera = vd_impostor_plane_camera(&made->plane, made->width, made->height, VD_IMPOSTOR_PAD,
                                           fmax(nearest, 1e-3));
    if (vd_impostor_is_patch(set, slot->node)) {
        out->of = VD_DRAFT_PATCH;
        out->standing = vd_ground_cells(&set->ground, vd_impostor_patch(set, slot->node));
        out->ground = out->standing;
        add_skirt(set, view, &made->plane, &out->ground);
        made->sides = vd_impostor_sides(view, &out->standing);
    } else if (set->ground.count > 0 && vd_impostor_is_apart(set, slot->node)) {
        out->of = VD_DRAFT_CLOUDS;
        out->near_m = view->camera.near_m;
        out->front_m = front_of(set, view, slot->node, &made->plane);
    } else if (set->ground.count > 0 && set->world->nodes[slot->node].grounded) {
        out->of = VD_DRAFT_GROUNDED;
        out->ground = cells_under(set, slot->node);
    }
    return vd_camera_validate(&out->camera).code == VD_OK; /* without a side there is no lens */
}

static vd_status draw_node(const vd_impostor_brush *brush, vd_job *job, vd_impostor_draft *draft,
                           vd_frame *canvas) {
    vd_world_renderer *renderer = brush->renderer;
    if (draft->of == VD_DRAFT_CLOUDS) {
        return vd_impostor_draw_clouds(brush, job, draft, canvas);
    }
    const vd_node *node = renderer->world->nodes + draft->node; /* unless it is a patch */
    if (draft->of == VD_DRAFT_LOOSE) {
        return vd_world_renderer_draw_object(renderer, job, &draft->camera, node->id, canvas, NULL);
    }
    const vd_terrain_window window = vd_cells_window(&draft->ground);
    vd_world_part part = {.ground = &window};
    if (draft->of == VD_DRAFT_PATCH) {
        part.standing = &draft->standing;
    } else {
        part.from = node;
        part.mask = true;
    }
    vd_pass pass;
    vd_world_stats stats = {.objects = 0};
    return vd_world_draw_part(renderer, job, &draft->camera, &part, canvas, &pass, &stats);
}

void vd_impostor_paint(const vd_impostor_brush *brush, vd_job *job, vd_impostor_draft *draft) {
    vd_impostor_picture *made = &draft->picture;
    const int samples = brush->renderer->samples;
    vd_status status = vd_frame_fit(brush->context, made->width, made->height, 0, brush->canvas,
                                    brush->canvas_pixels);
    if (status.code == VD_OK) {
        status = vd_world_renderer_set_samples(brush->renderer, brush->samples);
    }
    if (status.code == VD_OK) {
        status = draw_node(brush, job, draft, *brush->canvas);
        const vd_status back = vd_world_renderer_set_samples(brush->renderer, samples);
        status = status.code == VD_OK ? back : status;
    }
    draft->status = status;
    if (status.code != VD_OK) {
        return;
    }
    take_picture(brush, made);
    if (made->rgba == NULL) {
        draft->status =
            vd_out_of_memory("an impostor", (size_t)made->width * (size_t)made->height * 4);
        return;
    }
    vd_quad_picture shown = {.rgba = made->rgba,
                             .width = made->width,
                             .height = made->height,
                             .stride = (size_t)made->width};
    vd_quad_picture_find_opaque(&shown);
    memcpy(made->opaque, shown.opaque, sizeof made->opaque);
}

/* Hands a picture over that the set now has. */
static vd_status keep(vd_impostors *set, vd_impostor_slot *slot, vd_impostor_picture *made) {
    set->stats.pictures++;
    set->bytes += vd_impostor_picture_bytes(made);
    return vd_impostors_take(set, slot, made);
}

vd_status vd_impostors_share(vd_impostors *set, const vd_impostor_view *view,
                             vd_impostor_slot *slot, bool *shared) {
    vd_impostor_picture found;
    *shared = !slot->changed && vd_impostor_pool_get(set, view, slot->node, &found);
    if (!*shared) {
        return vd_success();
    }
    set->stats.shared++;
    found.version = ++set->versions;
    return keep(set, slot, &found);
}

/* How fast it is believed what packing saves. */
#define PACKED_WEIGHT 0.05

/* Makes a picture what it is at the other end of a link. */
static void pack(vd_impostors *set, vd_impostor_picture *made) {
    if (set->def.pack == NULL || set->def.link_bytes_per_s == 0.0 || made->empty) {
        return;
    }
    made->packed = set->def.pack(set->def.pack_user, made->rgba, made->width, made->height);
    if (made->packed > 0) {
        const double share = (double)made->packed / (4.0 * made->width * made->height);
        set->packed_share += PACKED_WEIGHT * (share - set->packed_share);
    }
}

vd_status vd_impostors_hang(vd_impostors *set, vd_impostor_draft *draft) {
    vd_impostor_slot *slot = vd_impostor_slot_at(set, set->slot_of[draft->node] - 1);
    vd_impostor_picture *made = &draft->picture;
    if (vd_impostor_is_fatal(&draft->status)) {
        return draft->status;
    }
    if (draft->status.code != VD_OK) {
        vd_impostor_fail(set, slot);
        return vd_success();
    }
    pack(set, made);
    set->stats.drawn++;
    set->stats.pixels_drawn += (uint64_t)made->width * (uint64_t)made->height;
    vd_impostor_pool_put(set, slot->node, made);
    return keep(set, slot, made);
}

vd_status vd_impostors_make(vd_impostors *set, vd_job *job, const vd_impostor_view *view,
                            vd_impostor_slot *slot) {
    vd_impostor_draft draft;
    if (!vd_impostors_draft(set, view, slot, &draft)) {
        vd_impostor_fail(set, slot);
        return vd_success();
    }
    const vd_impostor_brush brush = {.context = set->context,
                                     .pictures = set->context,
                                     .renderer = set->renderer,
                                     .samples = set->def.samples,
                                     .canvas = &set->scratch->canvas,
                                     .canvas_pixels = &set->scratch->canvas_pixels,
                                     .relief = &set->scratch->relief,
                                     .depth = &set->depth};
    vd_impostor_paint(&brush, job, &draft);
    return vd_impostors_hang(set, &draft);
}

/* impostor_items.c: pictures for a client that has nothing else.
 *
 *   sky: six sides around the eye      patches, far to near      what is in front of all patches
 *   ┌──────────────────────────┐         ▱ ▱ ▱ ▱ ▱                    ┌──────┐
 *   │ so far that nobody sees  │           ▱ ▱ ▱                      │      │  one picture, as the
 *   │ that it does not move    │             ▱                        └──────┘  camera sees it
 *   └──────────────────────────┘
 *
 * A made picture waits in `sending` until it is delivered, and is shown from then on: what the
 * decision shows is what the client has. What is near lasts for next to no time as pictures of its
 * parts, each of its own depth; as one picture it costs the client one quad, and the link what it
 * would cost to send that part of the screen.
 */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "core/core.h"
#include "image/image.h"
#include "impostor/impostor_placed.h"
#include "impostor/impostor_pool.h"
#include "terrain/lens_renderer.h"

/* First bytes of ids. Objects begin with their number at the first level of the tree, which has
 * far fewer (vd_world_arrange). */
#define PATCH_IDS ((uint64_t)254 << 56)
#define EXTRA_IDS ((uint64_t)255 << 56)

/* Metres from the eye to each side of the sky. 6 km of way are a pixel at a focal length of 800. */
#define SKY_M 5e6
#define SKY_PX 128 /* a side; the sky is smooth */
#define SKY_PAD 2  /* pixels by which sides overlap */

/* What has no depth, names and particles, counts as so far away. */
#define FARTHEST_M 1e6

static uint64_t id_of(const vd_impostors *set, uint32_t node) {
    return vd_impostor_is_patch(set, node) ? PATCH_IDS | vd_impostor_patch(set, node)
                                           : set->world->nodes[node].id;
}

/* The slot of an id; null when there is none. */
static vd_impostor_slot *find_slot(const vd_impostors *set, uint64_t id) {
    uint32_t node;
    if ((id & EXTRA_IDS) == PATCH_IDS) {
        const uint64_t patch = id & ~EXTRA_IDS;
        if (patch >= set->ground.count) {
            return NULL;
        }
        node = (uint32_t)(set->world->node_count + patch);
    } else {
        const vd_node *found = vd_world_node(set->world, id);
        if (found == NULL) {
            return NULL;
        }
        node = (uint32_t)(found - set->world->nodes);
    }
    const uint32_t slot = set->slot_of[node];
    return slot != 0 ? vd_impostor_slot_at(set, slot - 1) : NULL;
}

/* ---- what was made ----------------------------------------------------------------------------*/

vd_status vd_impostors_add_item(vd_impostors *set, const vd_impostor_item *item) {
    vd_impostor_item *to = vd_list_add(set->context, &set->items, 1, sizeof *to);
    if (to == NULL) {
        return vd_out_of_memory("pictures for a client", sizeof *to);
    }
    *to = *item;
    return vd_success();
}

vd_status vd_impostors_fresh(vd_impostors *set, const vd_impostor_item **items, int *count) {
    const vd_impostor_sending *sending = set->sending.data;
    vd_status status = vd_success();
    set->items.count = 0;
    for (size_t i = 0; i < set->sending.count && status.code == VD_OK; i++) {
        const vd_impostor_picture *p = &sending[i].picture;
        const vd_impostor_slot *slot = vd_impostor_slot_at(set, sending[i].slot);
        vd_impostor_item item = {.id = id_of(set, slot->node),
                                 .version = p->version,
                                 .shared = p->pooled != NULL ? p->pooled->number : 0,
                                 .picture = {.rgba = p->rgba,
                                             .width = p->width,
                                             .height = p->height,
                                             .stride = (size_t)p->width}};
        memcpy(item.picture.opaque, p->opaque, sizeof p->opaque);
        vd_impostor_corners(p, item.corners);
        status = vd_impostors_add_item(set, &item);
    }
    *items = set->items.data;
    *count = (int)set->items.count;
    return status;
}

/* Takes an entry out of what waits; its picture is the caller's. */
static void take_out(vd_impostors *set, size_t index) {
    vd_impostor_sending *sending = set->sending.data;
    const vd_impostor_picture *p = &sending[index].picture;
    vd_impostor_slot_at(set, sending[index].slot)->coming = false;
    set->sending_bytes -= (size_t)p->width * (size_t)p->height * 4;
    set->sending.count--;
    memmove(sending + index, sending + index + 1, (set->sending.count - index) * sizeof *sending);
}

void vd_impostors_deliver(vd_impostors *set, uint64_t id, uint32_t version) {
    const vd_impostor_sending *sending = set->sending.data;
    for (int i = 0; i < VD_EXTRAS; i++) {
        vd_impostor_extra *extra = &set->extras[i];
        extra->delivered = extra->delivered || (extra->id == id && extra->version == version);
    }
    vd_impostors_deliver_placed(set, id, version);
    for (size_t i = 0; i < set->sending.count; i++) {
        if (sending[i].picture.version == version) {
            const vd_impostor_picture picture = sending[i].picture;
            vd_impostor_slot *slot = vd_impostor_slot_at(set, sending[i].slot);
            take_out(set, i);
            vd_impostors_replace(set, slot, &picture);
            slot->delivered = true;
            return;
        }
    }
}

void vd_impostors_forget_stale(vd_impostors *set) {
    if (!set->def.ship) {
        return;
    }
    vd_impostor_sending *sending = set->sending.data;
    for (size_t i = set->sending.count; i-- > 0;) {
        if (vd_impostor_slot_at(set, sending[i].slot)->asked != set->update) {
            vd_impostor_release(set, &sending[i].picture);
            sending[i].picture.rgba = NULL;
            take_out(set, i);
        }
    }
}

void vd_impostors_lose(vd_impostors *set, uint64_t id) {
    for (int i = 0; i < VD_EXTRAS; i++) {
        set->extras[i].delivered = set->extras[i].delivered && set->extras[i].id != id;
    }
    vd_impostors_lose_placed(set, id);
    vd_impostor_slot *slot = find_slot(set, id);
    if (slot != NULL) {
        vd_impostor_release(set, &slot->now);
        slot->delivered = slot->split = slot->empty = false;
    }
}

bool vd_impostors_holds(const vd_impostors *set, uint64_t id, uint32_t version) {
    for (int i = 0; i < VD_EXTRAS; i++) {
        const vd_impostor_extra *extra = &set->extras[i];
        if (extra->id == id) {
            return extra->delivered && extra->version == version;
        }
    }
    const vd_impostor_slot *slot = find_slot(set, id);
    return (slot != NULL && slot->delivered && slot->now.rgba != NULL &&
            slot->now.version == version) ||
           vd_impostors_holds_placed(set, id, version);
}

int vd_impostor_compare_ids(const void *a, const void *b) {
    const uint64_t x = *(const uint64_t *)a, y = *(const uint64_t *)b;
    return (x > y) - (x < y);
}

void vd_impostors_resume(vd_impostors *set, const uint64_t *ids, const uint32_t *versions,
                         int count) {
    for (uint32_t i = 0; i < set->slots.count + VD_EXTRAS; i++) {
        const bool is_slot = i < set->slots.count;
        const uint64_t id = is_slot ? id_of(set, vd_impostor_slot_at(set, i)->node)
                                    : set->extras[i - set->slots.count].id;
        const uint64_t *found =
            count > 0 ? bsearch(&id, ids, (size_t)count, sizeof *ids, vd_impostor_compare_ids)
                      : NULL;
        const bool delivered = is_slot ? vd_impostor_slot_at(set, i)->delivered
                                       : set->extras[i - set->slots.count].delivered;
        if (delivered && (found == NULL || !vd_impostors_holds(set, id, versions[found - ids]))) {
            vd_impostors_lose(set, id);
        }
    }
    vd_impostors_resume_placed(set, ids, versions, count);
}

void vd_impostors_set_tolerance(vd_impostors *set, double tolerance_px) {
    set->def.tolerance_px =
        isfinite(tolerance_px) && tolerance_px >= 0.0 ? tolerance_px : set->def.tolerance_px;
}

void vd_impostors_release_extras(vd_impostors *set) {
    for (int i = 0; i < VD_EXTRAS; i++) {
        if (set->extras[i].shared == 0) {
            vd_release(set->context, set->extras[i].rgba);
        }
        set->extras[i].rgba = NULL;
    }
}

/* ---- sky and front ----------------------------------------------------------------------------*/

static vd_status add_extra(vd_impostors *set, const vd_impostor_extra *extra) {
    const vd_impostor_item item = {
        .id = extra->id,
        .version = extra->version,
        .shared = extra->shared,
        .corners = {extra->corners[0], extra->corners[1], extra->corners[2], extra->corners[3]},
        .picture = {.rgba = extra->rgba,
                    .width = extra->width,
                    .height = extra->height,
                    .stride = (size_t)extra->width}};
    return vd_impostors_add_item(set, &item);
}

/* The picture of an extra is a rectangle, x0, y0, x1, y1, of a camera's, `z` metres before it. */
static void place(vd_impostors *set, vd_impostor_extra *extra, const vd_camera *camera,
                  const int r[4], double z) {
    for (int i = 0; i < 4; i++) {
        const double x = i == 1 || i == 2 ? r[2] : r[0], y = i >= 2 ? r[3] : r[1];
        const vd_vec3 at = {(x - camera->lens.cx) / camera->lens.fx * z,
                            (y - camera->lens.cy) / camera->lens.fy * z, z};
        extra->corners[i] = vd_vec3_add(camera->eye, vd_quat_rotate(camera->orientation, at));
    }
    extra->width = r[2] - r[0];
    extra->height = r[3] - r[1];
    extra->version = ++set->versions;
    extra->delivered = false;
}

/* Takes a rectangle of a frame as the picture of an extra. */
static vd_status take_rectangle(vd_impostors *set, vd_impostor_extra *extra,
                                const vd_camera *camera, const vd_frame *frame, const int r[4],
                                double z) {
    const int width = r[2] - r[0], height = r[3] - r[1];
    const size_t row = 4 * (size_t)width, bytes = row * (size_t)height;
    if (extra->rgba == NULL || extra->room < bytes) {
        vd_release(set->context, extra->rgba);
        extra->room = 0;
        extra->rgba = vd_allocate(set->context, 1, bytes);
        if (extra->rgba == NULL) {
            return vd_out_of_memory("a picture for a client", bytes);
        }
        extra->room = bytes;
    }
    for (int y = 0; y < height; y++) {
        const size_t from = (size_t)(r[1] + y) * frame->stride + (size_t)r[0];
        memcpy(extra->rgba + row * (size_t)y, frame->rgba + 4 * from, row);
    }
    place(set, extra, camera, r, z);
    return vd_success();
}

/* The frame that sky and front are drawn into. */
static vd_status reserve_frame(vd_impostors *set, int width, int height) {
    return vd_frame_fit(set->context, width, height, VD_PLANE_DEPTH, &set->scratch->wide,
                        &set->scratch->wide_pixels);
}

/* The six sides, each a little wider than a right angle so that they overlap. */
static vd_status draw_sky(vd_impostors *set, vd_job *job, vd_vec3 eye) {
    static const double angles[VD_SKY_SIDES][2] = {{0, 0}, {1, 0}, {2, 0}, {3, 0}, {0, 1}, {0, -1}};
    const double half_turn = 3.14159265358979323846, focal = 0.5 * (SKY_PX - 2 * SKY_PAD);
    const vd_terrain_window none = VD_TERRAIN_NO_CELLS;
    const vd_world_part sky = {.ground = &none, .bare = true, .sky = true};
    static const int all[4] = {0, 0, SKY_PX, SKY_PX};
    vd_camera camera = {.eye = eye,
                        .projection = VD_PROJECTION_PERSPECTIVE,
                        .lens = {focal, focal, 0.5 * SKY_PX, 0.5 * SKY_PX},
                        .near_m = 1.0};
    vd_frame *frame = NULL;
    vd_status status = vd_frame_create(set->context, SKY_PX, SKY_PX, VD_PLANE_DEPTH, &frame);
    for (int i = 0; i < VD_SKY_SIDES && status.code == VD_OK; i++) {
        vd_pass pass;
        vd_world_stats stats = {.objects = 0};
        vd_impostor_extra *extra = &set->extras[i];
        uint8_t **pooled = vd_impostor_pool_sky(set, i);
        camera.orientation = vd_orientation_from_angles(0.5 * half_turn * angles[i][0],
                                                        0.5 * half_turn * angles[i][1], 0.0);
        extra->id = EXTRA_IDS | (uint64_t)(i + 1);
        if (pooled == NULL || *pooled == NULL) {
            status = vd_world_draw_part(set->renderer, job, &camera, &sky, frame, &pass, &stats);
            status = status.code == VD_OK ? take_rectangle(set, extra, &camera, frame, all, SKY_M)
                                          : status;
        } else { /* it hangs on the direction alone */
            place(set, extra, &camera, all, SKY_M);
        }
        if (status.code == VD_OK && pooled != NULL) {
            *pooled = *pooled != NULL ? *pooled : extra->rgba;
            extra->rgba = *pooled;
            extra->shared = VD_POOLED_SKY + (uint64_t)i;
        }
    }
    vd_frame_destroy(&frame);
    set->sky_eye = eye;
    set->has_sky = status.code == VD_OK;
    return status;
}

static vd_status renew_sky(vd_impostors *set, vd_job *job, const vd_impostor_view *view) {
    const double way = vd_vec3_length(vd_vec3_subtract(view->camera.eye, set->sky_eye));
    const bool due =
        !set->has_sky || way / SKY_M * view->focal_px > fmax(set->def.tolerance_px, 0.5);
    vd_status status = due ? draw_sky(set, job, view->camera.eye) : vd_success();
    for (int i = 0; i < VD_SKY_SIDES && status.code == VD_OK; i++) {
        status = set->extras[i].delivered ? status : add_extra(set, &set->extras[i]);
    }
    return status;
}

/* FNV-1a (Fowler, Noll & Vo 1991) of what is in front. */
static uint64_t mix(uint64_t hash, uint64_t value) {
    for (int i = 0; i < 8; i++) {
        hash = (hash ^ ((value >> (8 * i)) & 255)) * 1099511628211u;
    }
    return hash;
}

static uint64_t contents_of(const vd_impostors *set, bool *any) {
    const vd_list *lists[] = {&set->direct, &set->lines};
    uint64_t hash = 14695981039346656037u;
    *any = set->any_near || (set->ground.count == 0 && vd_impostors_shown_in_front(set));
    /* Whether ground hides particles is looked at with what is in it. */
    *any = *any || (set->ground.count > 0 && set->placing.clouds.count > 0);
    if (set->any_near) {
        hash = mix(mix(hash, (uint64_t)set->near.c0), (uint64_t)set->near.r0);
        hash = mix(mix(hash, (uint64_t)set->near.c1), (uint64_t)set->near.r1);
    }
    for (int k = 0; k < 2; k++) {
        const uint32_t *nodes = lists[k]->data;
        hash = mix(hash, lists[k]->count);
        *any = *any || lists[k]->count > 0;
        for (size_t i = 0; i < lists[k]->count; i++) {
            hash = mix(hash, nodes[i]);
        }
    }
    const uint32_t *shown = set->shown.data;
    for (size_t i = 0; i < set->shown.count; i++) {
        const vd_impostor_slot *slot = vd_impostor_slot_at(set, shown[i]);
        if (vd_impostor_is_in_front(set, slot)) {
            hash = mix(hash, slot->now.version);
            *any = true;
        } else if (vd_impostors_shown_in_front(set) && slot->now.rgba != NULL &&
                   slot->parted != slot->now.version) {
            hash = mix(hash, slot->now.version); /* it may come before something of it */
        }
    }
    return hash;
}

/* Whether a view lies within what the picture in front was drawn of. */
static bool holds_view(const vd_impostor_front *front, const vd_camera *camera, int width,
                       int height) {
    for (int i = 0; i < 4; i++) {
        const vd_ray ray =
            vd_camera_ray(camera, (i & 1) != 0 ? width : 0, (i & 2) != 0 ? height : 0);
        double x, y, z;
        if (!vd_camera_project(&front->camera, vd_vec3_add(front->camera.eye, ray.direction), &x,
                               &y, &z) ||
            x < 0.0 || y < 0.0 || x > front->width || y > front->height) {
            return false;
        }
    }
    return true;
}

/* What of the front frame is not empty, grown by a pixel and by another where it would be too
 * narrow, and the range of depths there. False when all of it is. */
static bool measure(const vd_frame *frame, int r[4], float range[2]) {
    int box[4] = {0, 0, frame->width, frame->height};
    range[0] = (float)INFINITY;
    range[1] = 0.0f;
    if (!vd_frame_shrink(frame, box)) {
        return false;
    }
    for (int y = box[1]; y < box[3]; y++) {
        const uint8_t *rgba = frame->rgba + 4 * (size_t)y * frame->stride;
        const float *depth = frame->depth + (size_t)y * frame->stride;
        for (int x = box[0]; x < box[2]; x++) {
            if (rgba[4 * x + 3] != 0) {
                range[0] = depth[x] < range[0] ? depth[x] : range[0];
                range[1] = depth[x] > range[1] ? depth[x] : range[1];
            }
        }
    }
    const int sides[2] = {frame->width, frame->height};
    for (int k = 0; k < 2; k++) {
        r[k] = box[k] > 0 ? box[k] - 1 : 0;
        r[k + 2] = box[k + 2] + 1 < sides[k] ? box[k + 2] + 1 : sides[k];
        r[k] = r[k + 2] - r[k] < 2 && r[k] > 0 ? r[k] - 1 : r[k];
        if (r[k + 2] - r[k] < 2) {
            return false; /* of a screen of one pixel */
        }
    }
    return true;
}

/* Metres to the nearest particles that a client draws. */
static double nearest_cloud(const vd_impostors *set, const vd_camera *camera) {
    const vd_list *clouds = &set->placing.clouds;
    const double nearest =
        clouds->count > 0 ? vd_impostor_stand_at(set, *(const uint32_t *)clouds->data)->distance
                          : FARTHEST_M;
    return fmax(nearest, camera->near_m);
}

static vd_status draw_front(vd_impostors *set, vd_job *job, const vd_camera *camera, int width,
                            int height) {
    vd_impostor_extra *extra = &set->extras[VD_SKY_SIDES];
    vd_impostor_front *front = &set->in_front;
    const int x = (int)(set->def.spare * width), y = (int)(set->def.spare * height);
    vd_camera wide = *camera;
    wide.lens.cx += x;
    wide.lens.cy += y;
    front->camera = wide;
    front->width = width + 2 * x;
    front->height = height + 2 * y;
    vd_status status = reserve_frame(set, front->width, front->height);
    if (status.code == VD_OK) {
        status = vd_impostors_draw_alone(set, job, &wide, set->scratch->wide);
        if (status.code != VD_OK) {
            status = vd_impostors_set_aside(set, job, &wide, set->scratch->wide, status);
            status = status.code == VD_OK
                         ? vd_impostors_draw_alone(set, job, &wide, set->scratch->wide)
                         : status;
        }
    }
    if (status.code != VD_OK) {
        return status;
    }
    int r[4];
    float range[2];
    front->wanted = measure(set->scratch->wide, r, range);
    if (!front->wanted) {
        front->half_range = 0.5 / nearest_cloud(set, camera); /* what hides is looked at again */
        return status;
    }
    /* In the middle of the inverse distances nearest and farthest are as wrong. */
    const double near = camera->near_m, least = 1.0 / FARTHEST_M;
    const double low = fmax((double)range[0] / near, least);
    const double high = fmax((double)range[1] / near, low);
    front->half_range = 0.5 * (high - low);
    extra->id = EXTRA_IDS | VD_EXTRAS;
    set->stats.pixels_drawn += (uint64_t)(r[2] - r[0]) * (uint64_t)(r[3] - r[1]);
    return take_rectangle(set, extra, &wide, set->scratch->wide, r, 2.0 / (low + high));
}

static vd_status renew_front(vd_impostors *set, vd_job *job, const vd_impostor_view *view) {
    vd_impostor_front *front = &set->in_front;
    const vd_impostor_extra *extra = &set->extras[VD_SKY_SIDES];
    bool any = false;
    uint64_t contents = contents_of(set, &any);
    if (!any) {
        front->wanted = false;
        front->contents = 0;
        return vd_success();
    }
    const double way = vd_vec3_length(vd_vec3_subtract(view->camera.eye, front->camera.eye));
    const bool due = contents != front->contents || front->width == 0 ||
                     way * front->half_range * view->focal_px > set->def.tolerance_px ||
                     !holds_view(front, &view->camera, view->width, view->height);
    const uint64_t start = vd_clock_ns();
    vd_status status =
        due ? draw_front(set, job, &view->camera, view->width, view->height) : vd_success();
    const vd_frame *frame = set->scratch->wide;
    const bool hidden =
        due && status.code == VD_OK && vd_impostors_hide_placed(set, &front->camera, frame);
    if (hidden) {
        vd_impostors_unchoose_placed(set);
        status = vd_impostors_choose_placed(set, view);
    }
    if (hidden && status.code == VD_OK) {
        status = draw_front(set, job, &view->camera, view->width, view->height);
    }
    if (due) { /* what comes before something of it has just been told */
        contents = contents_of(set, &any);
    }
    set->stats.direct_s = due ? 1e-9 * (double)(vd_clock_ns() - start) : 0.0;
    front->contents = status.code == VD_OK ? contents : 0;
    return status.code == VD_OK && front->wanted && !extra->delivered ? add_extra(set, extra)
                                                                      : status;
}

vd_status vd_impostors_finish_order(vd_impostors *set, vd_job *job, const vd_impostor_item **items,
                                    int *count) {
    const vd_impostor_view view =
        vd_impostors_view(set, &set->rest_camera, set->rest_width, set->rest_height);
    set->items.count = 0;
    vd_status status = vd_impostors_decide(set, &view);
    if (status.code == VD_OK) {
        status = vd_impostors_choose_placed(set, &view);
    }
    if (status.code == VD_OK) {
        status = renew_sky(set, job, &view);
    }
    if (status.code == VD_OK) {
        status = renew_front(set, job, &view);
    }
    if (status.code == VD_OK) {
        status = vd_impostors_list_placed(set);
    }
    *items = set->items.data;
    *count = (int)set->items.count;
    return status;
}

/* ---- the order --------------------------------------------------------------------------------*/

vd_status vd_impostors_add_id(vd_impostors *set, uint64_t id) {
    uint64_t *to = vd_list_add(set->context, &set->ids, 1, sizeof *to);
    if (to == NULL) {
        return vd_out_of_memory("an order of pictures", sizeof *to);
    }
    *to = id;
    return vd_success();
}

/* Adds what a list has pictures of; counts the area of what it has none of, and of all. */
static vd_status add_list(vd_impostors *set, const vd_impostor_view *view, const vd_list *list,
                          double *missing, double *all) {
    const uint32_t *slots = list->data;
    vd_status status = vd_success();
    for (size_t i = 0; i < list->count && status.code == VD_OK; i++) {
        const vd_impostor_slot *slot = vd_impostor_slot_at(set, slots[i]);
        if (list == &set->shown && vd_impostor_is_in_front(set, slot)) {
            continue;
        }
        vd_vec3 min, max;
        vd_impostor_bounds(set, view, slot->node, &min, &max);
        const vd_vec3 size = vd_vec3_subtract(max, min);
        const vd_vec3 way =
            vd_vec3_subtract(vd_vec3_add(min, vd_vec3_scale(size, 0.5)), view->camera.eye);
        const double area = vd_vec3_dot(size, size) / fmax(vd_vec3_dot(way, way), 1e-9);
        *all += area;
        if (slot->now.rgba != NULL && slot->delivered) {
            status = vd_impostors_add_id(set, id_of(set, slot->node));
        } else if (!slot->empty && slot->left_out != set->update) {
            *missing += area;
        }
    }
    return status;
}

vd_status vd_impostors_order(vd_impostors *set, vd_impostor_order *out) {
    const vd_impostor_view view =
        vd_impostors_view(set, &set->rest_camera, set->rest_width, set->rest_height);
    const vd_impostor_extra *front = &set->extras[VD_SKY_SIDES];
    double missing = 0.0, all = 0.0;
    vd_status status = vd_success();
    set->ids.count = 0;
    for (int i = 0; i < VD_SKY_SIDES && status.code == VD_OK; i++) {
        status = set->extras[i].delivered ? vd_impostors_add_id(set, set->extras[i].id) : status;
    }
    if (status.code == VD_OK) {
        status = add_list(set, &view, &set->far, &missing, &all);
    }
    if (status.code == VD_OK) {
        status = add_list(set, &view, &set->shown, &missing, &all);
    }
    if (status.code == VD_OK && set->in_front.wanted && front->delivered) {
        status = vd_impostors_add_id(set, front->id);
    }
    if (status.code == VD_OK) {
        status = vd_impostors_order_placed(set);
    }
    *out = (vd_impostor_order){.ids = set->ids.data,
                               .count = (int)set->ids.count,
                               .missing = all > 0.0 ? missing / all : 0.0,
                               .error_px = set->stats.error_px};
    return status;
}

vd_status vd_impostors_gone(vd_impostors *set, const uint64_t **ids, int *count) {
    vd_status status = vd_success();
    set->ids.count = 0;
    for (uint32_t i = 0; i < set->slots.count && status.code == VD_OK; i++) {
        vd_impostor_slot *slot = vd_impostor_slot_at(set, i);
        if (slot->delivered && (slot->now.rgba == NULL || slot->empty)) {
            slot->delivered = false;
            status = vd_impostors_add_id(set, id_of(set, slot->node));
        }
    }
    if (status.code == VD_OK) {
        status = vd_impostors_gone_placed(set);
    }
    if (set->ids.count > 1) {
        qsort(set->ids.data, set->ids.count, sizeof(uint64_t), vd_impostor_compare_ids);
    }
    *ids = set->ids.data;
    *count = (int)set->ids.count;
    return status;
}

const vd_frame *vd_impostors_still(const vd_impostors *set) {
    return vd_impostors_settled(set) ? vd_impostors_still_frame(set) : NULL;
}

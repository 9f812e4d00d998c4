/* world_over.c: what lies over a picture: particles (world_clouds.c), names, their marks and
 * leaders, and the caller's map furniture.
 *
 * A name is seen when its place is: when the picture is not nearer there, in any of the nine pixels
 * around it, by more than a hundredth of the distance (peaks stand on the ground that hides them
 * when it is drawn by coarser cells far away). Names are not part of the target: they are as sharp
 * as the picture's pixels, and drawn once, over the mean of the samples.
 */
#include <math.h>
#include <string.h>
#include "core/core.h"
#include "world/world_renderer.h"

#define NEARER 1.01f
#define PADDING 3.0f
#define HALO 3.0
#define LAYERS_A_LABEL 4

/* What drawing a name borrows. */
typedef struct name_parts {
    vd_stroke halo, dark, light;
    double leader[2][2];
} name_parts;

static bool is_seen(const vd_frame *frame, double x, double y, float depth) {
    const int px = (int)floor(x), py = (int)floor(y);
    for (int j = py - 1; j <= py + 1; j++) {
        for (int i = px - 1; i <= px + 1; i++) {
            if (i >= 0 && j >= 0 && i < frame->width && j < frame->height &&
                !(frame->depth[(size_t)j * frame->stride + (size_t)i] > depth * NEARER)) {
                return true;
            }
        }
    }
    return false;
}

/* Which names ask for a spot. Returns how many; `which` tells whose request it is. */
static size_t ask(const vd_pass *pass, const vd_frame *frame, vd_label_request *requests,
                  uint32_t *which) {
    const vd_label *const *labels = pass->labels->data;
    size_t count = 0;
    for (size_t i = 0; i < pass->labels->count; i++) {
        const vd_label *label = labels[i];
        vd_vec3 place = label->head.anchor;
        double x, y, z;
        place.z -= vd_pass_drop(pass, place);
        if (!vd_camera_project(pass->camera, place, &x, &y, &z) || !(x >= 0.0 && y >= 0.0) ||
            !(x < frame->width && y < frame->height)) {
            continue;
        }
        const bool seen = is_seen(frame, x, y, vd_camera_depth(pass->camera, z));
        if (!seen && label->hidden == VD_LABEL_HIDE) {
            continue;
        }
        which[count] = (uint32_t)i;
        requests[count++] =
            (vd_label_request){.x = (float)x,
                               .y = (float)y,
                               .width = label->advance + 2.0f * PADDING,
                               .height = label->ascent + label->descent + 2.0f * PADDING,
                               .priority = label->priority,
                               .leader = seen ? VD_LEADER_ALLOWED : VD_LEADER_ALWAYS};
    }
    return count;
}

static vd_layer layer_of(vd_path path) {
    vd_layer layer = vd_layer_default();
    layer.path = path;
    layer.filled = false;
    return layer;
}

static vd_stroke stroke_of(double width, const uint16_t color[4]) {
    vd_stroke stroke = vd_stroke_default();
    stroke.width = width;
    stroke.join = VD_JOIN_ROUND;
    stroke.cap = VD_CAP_ROUND;
    memcpy(stroke.color, color, sizeof stroke.color);
    return stroke;
}

/* The layers of one name: halo under letters, dark under light for its leader, so that it shows on
 * snow and on forest. Without a leader it ends in a dot at its place. Returns how many. */
static size_t add_name(const vd_label *label, const vd_label_request *request,
                       const vd_label_spot *spot, name_parts *parts, vd_layer *out) {
    const float top = spot->leader ? spot->box[3] : request->y;
    const double ends[2][2] = {{(double)request->x, (double)top},
                               {(double)request->x, (double)request->y}};
    const vd_path leader = {
        .points = (const double(*)[2])parts->leader, .point_count = 2, .open = true};
    const vd_path letters = {.points = (const double(*)[2])label->points,
                             .point_count = label->point_count,
                             .verbs = vd_label_verbs(label),
                             .verb_count = label->verb_count};
    uint16_t halo[4], color[4];
    size_t count = 0;
    vd_layer_color(label->halo, halo);
    vd_layer_color(label->color, color);
    memcpy(parts->leader, ends, sizeof ends);
    parts->halo = stroke_of(HALO, halo);
    parts->dark = stroke_of(spot->leader ? 2.5 : 5.0, halo);
    parts->light = stroke_of(spot->leader ? 1.0 : 3.0, color);
    for (int i = 0; i < 2; i++) {
        out[count] = layer_of(leader);
        out[count++].stroke = i == 0 ? &parts->dark : &parts->light;
    }
    for (int i = 0; i < 2; i++) {
        out[count] = layer_of(letters);
        out[count].picture_from_path.x0 = (double)(spot->box[0] + PADDING);
        out[count].picture_from_path.y0 = (double)(spot->box[1] + PADDING + label->ascent);
        out[count].filled = i == 1;
        memcpy(out[count].fill, color, sizeof color);
        out[count++].stroke = i == 0 && label->halo.a > 0 ? &parts->halo : NULL;
    }
    return count;
}

/* ---- all of them ------------------------------------------------------------------------------*/

static vd_status reserve(vd_world_renderer *r, size_t labels, size_t layers) {
    struct {
        vd_buffer *buffer;
        size_t count, bytes;
    } wanted[] = {{&r->over.requests, labels, sizeof(vd_label_request)},
                  {&r->over.spots, labels, sizeof(vd_label_spot)},
                  {&r->over.which, labels, sizeof(uint32_t)},
                  {&r->over.parts, labels, sizeof(name_parts)},
                  {&r->over.layers, layers, sizeof(vd_layer)}};
    vd_status status = vd_success();
    for (size_t i = 0; i < sizeof wanted / sizeof wanted[0] && status.code == VD_OK; i++) {
        status = vd_buffer_reserve(r->context, wanted[i].buffer, "a picture's names",
                                   wanted[i].count + 1, wanted[i].bytes);
    }
    return status;
}

static vd_status place_names(vd_world_renderer *r, const vd_pass *pass, const vd_overlay *overlay,
                             const vd_frame *frame, size_t *count) {
    vd_label_layout_def def = vd_label_layout_def_default();
    def.width = frame->width;
    def.height = frame->height;
    def.kept = overlay->kept;
    def.kept_count = overlay->kept_count;
    def.rise_first = pass->camera->projection == VD_PROJECTION_PERSPECTIVE;
    *count = ask(pass, frame, r->over.requests.memory, r->over.which.memory);
    return vd_label_layout_place(r->over.layout, &def, r->over.requests.memory, *count,
                                 r->over.spots.memory);
}

vd_status vd_world_draw_over(vd_world_renderer *r, vd_job *job, const vd_pass *pass,
                             vd_frame *frame) {
    vd_overlay overlay = {.layer_count = 0};
    vd_status status = vd_world_draw_clouds(r, job, pass, frame);
    if (status.code == VD_OK && r->def.overlay != NULL) {
        status = r->def.overlay(r->def.overlay_user, pass->camera, frame->width, frame->height,
                                &overlay);
    }
    const size_t labels = pass->labels->count;
    if (status.code != VD_OK || labels + overlay.layer_count == 0) {
        return status;
    }
    status = reserve(r, labels, overlay.layer_count + labels * LAYERS_A_LABEL);
    size_t asked = 0, count = 0;
    if (status.code == VD_OK && labels > 0) {
        status = place_names(r, pass, &overlay, frame, &asked);
    }
    if (status.code != VD_OK) {
        return status;
    }
    const vd_label *const *all = pass->labels->data;
    const vd_label_request *requests = r->over.requests.memory;
    const vd_label_spot *spots = r->over.spots.memory;
    const uint32_t *which = r->over.which.memory;
    name_parts *parts = r->over.parts.memory;
    vd_layer *layers = r->over.layers.memory;
    for (size_t i = 0; i < asked; i++) {
        if (spots[i].shown) {
            count += add_name(all[which[i]], &requests[i], &spots[i], &parts[i], layers + count);
            pass->stats->labels_shown++;
        }
    }
    for (size_t i = 0; i < overlay.layer_count; i++) {
        layers[count++] = overlay.layers[i];
    }
    pass->stats->labels = labels;
    return vd_coverage_draw_frame(r->coverage, job, NULL, layers, count, frame);
}

vd_status vd_world_renderer_draw_overlay(vd_world_renderer *r, vd_job *job, const vd_camera *camera,
                                         vd_frame *frame, vd_overlay *overlay) {
    *overlay = (vd_overlay){.layer_count = 0};
    memset(frame->rgba, 0, 4 * frame->stride * (size_t)frame->height);
    vd_status status = vd_success();
    if (r->def.overlay != NULL) {
        status = r->def.overlay(r->def.overlay_user, camera, frame->width, frame->height, overlay);
    }
    return status.code == VD_OK && overlay->layer_count > 0
               ? vd_coverage_draw_frame(r->coverage, job, NULL, overlay->layers,
                                        overlay->layer_count, frame)
               : status;
}

bool vd_world_renderer_has_overlay(const vd_world_renderer *renderer) {
    return renderer->def.overlay != NULL;
}

/* session_overlay.c: map furniture of a client: title, arrow, bar, legend.
 *
 * Whole pictures have it drawn over them. Over pictures of objects it stands as a few small ones
 * that are fixed to the screen, cut out of a frame that has nothing else, and sent again where they
 * have changed: the arrow turns with the camera, the bar grows. Each has a place in a table whose
 * index is its id; one that is no longer shown keeps its place until another needs it.
 */
#include <math.h>
#include <string.h>
#include "image/image.h"
#include "remote/session_internal.h"

/* First byte as of sky and front. */
#define OVERLAY_IDS (((uint64_t)255 << 56) | 64)

/* Seconds between looks at it while the camera moves. */
#define RENEWED_S 0.2

/* Of a client's memory: one over this. */
#define MEMORY_SHARE 16

/* Pixels by which what is cut out may reach beyond what labels keep out of. */
#define MARGIN 4

size_t vd_session_overlay_bytes(const vd_session *s) {
    const size_t memory_bytes = s->hello.memory_bytes < s->def.memory_bytes
                                    ? (size_t)s->hello.memory_bytes
                                    : s->def.memory_bytes;
    return (s->hello.capabilities & VD_WIRE_FIXED) != 0 &&
                   vd_world_renderer_has_overlay(s->def.renderer)
               ? memory_bytes / MEMORY_SHARE
               : 0;
}

/* ---- cutting ----------------------------------------------------------------------------------*/

/* Makes a box as small as what there is in it, but of two texels a side at least, as pictures are;
 * false when that is nothing. */
static bool shrink(const vd_frame *frame, int box[4]) {
    if (!vd_frame_shrink(frame, box)) {
        return false;
    }
    for (int k = 0; k < 2; k++) {
        const int side = k == 0 ? frame->width : frame->height;
        box[k + 2] += box[k + 2] - box[k] < 2 && box[k + 2] < side;
        box[k] -= box[k + 2] - box[k] < 2 && box[k] > 0;
    }
    return box[2] - box[0] >= 2 && box[3] - box[1] >= 2;
}

static uint64_t hash_of(const vd_frame *frame, const int box[4]) {
    uint64_t hash = 14695981039346656037u; /* FNV-1a over pixels */
    for (int i = 0; i < 4; i++) {
        hash = (hash ^ (uint64_t)box[i]) * 1099511628211u;
    }
    for (int y = box[1]; y < box[3]; y++) {
        for (int x = box[0]; x < box[2]; x++) {
            uint32_t pixel;
            memcpy(&pixel, frame->rgba + 4 * ((size_t)y * frame->stride + (size_t)x), sizeof pixel);
            hash = (hash ^ pixel) * 1099511628211u;
        }
    }
    return hash;
}

static void clear(vd_frame *frame, const int box[4]) {
    for (int y = box[1]; y < box[3]; y++) {
        memset(frame->rgba + 4 * ((size_t)y * frame->stride + (size_t)box[0]), 0,
               4 * (size_t)(box[2] - box[0]));
    }
}

/* ---- parts ------------------------------------------------------------------------------------*/

/* How well a part's place would do for what stands in a box: one that is shown not at all, one that
 * is this already best, then what stood there, then a place that is free. */
static int fitness(const vd_session_part *p, const int box[4], uint64_t hash) {
    const bool overlaps =
        p->box[0] < box[2] && box[0] < p->box[2] && p->box[1] < box[3] && box[1] < p->box[3];
    return p->shown ? 0 : !p->held ? 2 : p->hash == hash ? 4 : overlaps ? 3 : 1;
}

/* The place for what stands in a box; null: all are taken. */
static vd_session_part *find_part(vd_session *s, const int box[4], uint64_t hash) {
    vd_session_part *best = NULL;
    int most = 0;
    for (int i = 0; i < VD_SESSION_PARTS; i++) {
        const int fits = fitness(&s->parts[i], box, hash);
        best = fits > most ? &s->parts[i] : best;
        most = fits > most ? fits : most;
    }
    return best;
}

/* Corners before the camera, one unit away by a lens whose focal length is the picture's height. */
static void place(const vd_session *s, const int box[4], vd_vec3 corners[4]) {
    const double height = s->camera.height, width = s->camera.width;
    for (int i = 0; i < 4; i++) {
        const double x = box[i == 1 || i == 2 ? 2 : 0], y = box[i >= 2 ? 3 : 1];
        corners[i] = vd_vec3_make((x - 0.5 * width) / height, (y - 0.5 * height) / height, 1.0);
    }
}

/* Sends what is in a box of the frame, unless the client has it. */
static void add_part(vd_session *s, vd_frame *frame, const int box[4], double now_s) {
    const uint64_t hash = hash_of(frame, box);
    const size_t bytes = 4 * (size_t)(box[2] - box[0]) * (size_t)(box[3] - box[1]);
    vd_session_part *part = find_part(s, box, hash);
    if (part == NULL) {
        return;
    }
    if (!part->held || part->hash != hash) {
        size_t all = bytes;
        for (int i = 0; i < VD_SESSION_PARTS; i++) {
            all += s->parts[i].held && &s->parts[i] != part ? s->parts[i].bytes : 0;
        }
        if (all > vd_session_overlay_bytes(s)) {
            return;
        }
        vd_impostor_item item = {
            .id = OVERLAY_IDS + (uint64_t)(part - s->parts),
            .version = ++s->part_version,
            .picture = {.rgba = frame->rgba + 4 * ((size_t)box[1] * frame->stride + (size_t)box[0]),
                        .width = box[2] - box[0],
                        .height = box[3] - box[1],
                        .stride = frame->stride}};
        place(s, box, item.corners);
        vd_session_add_fixed(s, &item, now_s);
        memcpy(part->box, box, sizeof part->box);
        part->hash = hash;
        part->bytes = bytes;
        part->held = true;
    }
    part->shown = true;
}

/* Cuts a box out of the frame. */
static void cut(vd_session *s, vd_frame *frame, const int around[4], double now_s) {
    int box[4];
    memcpy(box, around, sizeof box);
    if (shrink(frame, box)) {
        add_part(s, frame, box, now_s);
        clear(frame, around);
    }
}

static void cut_all(vd_session *s, vd_frame *frame, const vd_overlay *overlay, double now_s) {
    const int all[4] = {0, 0, frame->width, frame->height};
    for (int i = 0; i < VD_SESSION_PARTS; i++) {
        s->parts[i].shown = false;
    }
    for (size_t i = 0; i < overlay->kept_count && i + 1 < VD_SESSION_PARTS; i++) {
        int box[4];
        for (int k = 0; k < 4; k++) {
            const int side = all[k % 2 + 2];
            const double at = floor((double)overlay->kept[i][k]) + (k < 2 ? -MARGIN : MARGIN + 1);
            box[k] = at > 0.0 ? at < side ? (int)at : side : 0;
        }
        cut(s, frame, box, now_s);
    }
    cut(s, frame, all, now_s); /* what stands elsewhere */
}

/* ---- for the session --------------------------------------------------------------------------*/

vd_status vd_session_add_overlay(vd_session *s, vd_job *job, bool rests, double now_s) {
    const bool other_size =
        s->part_camera.width != s->camera.width || s->part_camera.height != s->camera.height;
    if (vd_session_overlay_bytes(s) == 0 ||
        (vd_session_same_view(&s->part_camera, &s->camera) && !s->part_lost) ||
        (!rests && !other_size && !s->part_lost && now_s - s->part_s < RENEWED_S)) {
        return vd_success();
    }
    vd_frame *frame = NULL;
    vd_overlay overlay = {.layer_count = 0};
    vd_status status = vd_session_screen_frame(s, &frame);
    if (status.code == VD_OK) {
        status = vd_world_renderer_draw_overlay(s->def.renderer, job, &s->camera.camera, frame,
                                                &overlay);
    }
    if (status.code == VD_OK) {
        cut_all(s, frame, &overlay, now_s);
        s->part_camera = s->camera;
        s->part_s = now_s;
        s->part_lost = false;
    }
    return status;
}

int vd_session_overlay_ids(const vd_session *s, uint64_t *ids) {
    int count = 0;
    for (int i = 0; i < VD_SESSION_PARTS; i++) {
        if (s->parts[i].shown && s->parts[i].held) {
            ids[count++] = OVERLAY_IDS + (uint64_t)i;
        }
    }
    return count;
}

void vd_session_lose_overlay(vd_session *s, uint64_t id) {
    if (id >= OVERLAY_IDS && id < OVERLAY_IDS + VD_SESSION_PARTS) {
        s->parts[id - OVERLAY_IDS].held = false;
        s->part_lost = true;
    }
}

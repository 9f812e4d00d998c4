/* session_work.c: what a client gets for its camera. */
#include <math.h>
#include <string.h>
#include "remote/session_internal.h"

/* Pictures of a turn, bytes: the window's share of what waits is decided anew after that. */
#define TURN_BYTES 90000

/* While more of the screen's area waits for its first pictures, a whole screen stands in. */
#define MOST_MISSING 0.15

/* How long a camera rests before its exact picture is drawn. */
#define REST_S 0.15

/* A turn that sent nothing, for a camera that stands still, is tried again after: */
#define IDLE_S 0.04

/* Of a client's memory, the part of models that it draws itself, and that of these with bricks of
 * particles: one over this. */
#define PLACED_SHARE 8
#define BRICKS_SHARE 4

/* A world has bricks for a client up to so many times the particles that it draws for a frame. Of
 * 50 million, a fraction that it can draw costs more pictures than it saves: a client's error over
 * 10 MB/s was 0.50 in place of 0.42. */
#define FEW 4

/* Turned, the view is wider than the screen by this share of it on each side. */
#define SPARE 0.12

#define LEAST_TOLERANCE_PX 0.25

/* What is shown from where it cannot be seen is endlessly wrong; numbers on the wire have an end.
 */
#define MOST_ERROR_PX 1e6

void vd_session_forget_pictures(vd_session *s) {
    vd_impostors_destroy(&s->set);
}

static bool make_set(vd_session *s) {
    vd_impostor_def def = vd_impostor_def_default();
    const size_t wanted = s->hello.memory_bytes < s->def.memory_bytes
                              ? (size_t)s->hello.memory_bytes
                              : s->def.memory_bytes;
    /* Sky and front are beside the pictures of objects. */
    size_t beside = ((size_t)1 << 19) + 7 * (size_t)s->camera.width * (size_t)s->camera.height;
    const bool models = (s->hello.capabilities & VD_WIRE_MODELS) != 0;
    def.placed_triangles = models ? def.placed_triangles : 0;
    const uint64_t particles = vd_world_particle_count(s->def.world);
    const bool few = particles > 0 && particles <= FEW * (uint64_t)s->hello.particles;
    def.placed_particles =
        few && (s->hello.capabilities & VD_WIRE_BRICKS) != 0 ? s->hello.particles : 0;
    if (models || def.placed_particles > 0) {
        def.placed_bytes = wanted / (def.placed_particles > 0 ? BRICKS_SHARE : PLACED_SHARE);
        beside += def.placed_bytes;
    }
    beside += vd_session_overlay_bytes(s);
    def.memory_bytes = wanted > beside + ((size_t)1 << 20) ? wanted - beside : (size_t)1 << 20;
    def.ship = true;
    def.spare = SPARE;
    def.budget_s = s->def.budget_s;
    def.rest_s = REST_S;
    def.first_version = s->def.seed;
    def.tolerance_px = fmax((double)s->settings.tolerance_px, LEAST_TOLERANCE_PX);
    vd_session_tools *tools = s->def.tools;
    vd_status status = vd_success();
    if (tools->like == NULL) {
        status = vd_impostors_create(s->context, s->def.world, s->def.renderer, NULL, &tools->like);
    }
    if (status.code == VD_OK) {
        def.like = tools->like;
        def.pool = tools->pool;
        status = vd_impostors_create(s->context, s->def.world, s->def.renderer, &def, &s->set);
    }
    if (status.code != VD_OK) {
        vd_session_fail(s, VD_WIRE_FAULT_INTERNAL, status.message);
    }
    return status.code == VD_OK;
}

/* Tells the client to forget what it holds of a world that nobody knows any more. */
static void drop_past(vd_session *s, double now_s) {
    int kept = 0;
    for (int i = 0; i < s->past_count; i++) {
        if (s->set == NULL || !vd_impostors_holds(s->set, s->past_ids[i], s->past_versions[i])) {
            s->past_ids[kept++] = s->past_ids[i];
        }
    }
    if (kept > 0) {
        const vd_wire_message drop = {.kind = VD_WIRE_DROP, .as.drop = {s->past_ids, kept}};
        vd_session_add(s, &drop, now_s);
        vd_session_flush(s, now_s);
    }
    s->past_count = 0;
    vd_release(s->context, s->past_ids);
    vd_release(s->context, s->past_versions);
    s->past_ids = NULL;
    s->past_versions = NULL;
}

/* ---- whole screens ----------------------------------------------------------------------------*/

vd_status vd_session_screen_frame(vd_session *s, vd_frame **out) {
    vd_session_tools *tools = s->def.tools;
    vd_status status = vd_success();
    if (tools->frame == NULL || tools->frame->width != s->camera.width ||
        tools->frame->height != s->camera.height) {
        vd_frame_destroy(&tools->frame);
        status =
            vd_frame_create(tools->context, s->camera.width, s->camera.height, 0, &tools->frame);
    }
    *out = tools->frame;
    return status;
}

static vd_status draw_screen(vd_session *s, vd_job *job) {
    vd_frame *frame = NULL;
    const vd_status status = vd_session_screen_frame(s, &frame);
    return status.code == VD_OK
               ? vd_world_renderer_draw(s->def.renderer, job, &s->camera.camera, frame, NULL)
               : status;
}

/* Sends the whole as it is for the newest camera. */
static vd_status send_screen(vd_session *s, vd_job *job, bool exact, double now_s) {
    const vd_status status = draw_screen(s, job);
    if (status.code == VD_OK) {
        s->exact = vd_session_send_screen(s, s->def.tools->frame, exact, now_s) && exact;
        s->screen = s->camera.sequence;
    }
    return status;
}

static vd_status work_screens(vd_session *s, vd_job *job, double now_s) {
    vd_status status = vd_success();
    s->ordered = false;
    if (s->screen != s->camera.sequence) {
        status = send_screen(s, job, false, now_s);
    } else if (!s->exact && now_s - s->camera_s >= REST_S) {
        status = send_screen(s, job, true, now_s);
    }
    return status;
}

/* ---- impostors --------------------------------------------------------------------------------*/

static vd_status send_gone(vd_session *s, double now_s) {
    const uint64_t *ids = NULL;
    int count = 0;
    const vd_status status = vd_impostors_gone(s->set, &ids, &count);
    if (status.code == VD_OK && count > 0) {
        const vd_wire_message drop = {.kind = VD_WIRE_DROP, .as.drop = {ids, count}};
        vd_session_add(s, &drop, now_s);
        vd_session_flush(s, now_s);
    }
    return status;
}

static vd_status send_fresh(vd_session *s, double now_s) {
    const vd_impostor_item *items = NULL;
    int count = 0;
    const vd_status status = vd_impostors_fresh(s->set, &items, &count);
    for (int i = 0; i < count && s->state == VD_SESSION_SERVING; i++) {
        if (s->turn_bytes + s->message_bytes > TURN_BYTES) {
            break;
        }
        vd_session_add_item(s, &items[i], now_s);
        if (s->state == VD_SESSION_SERVING) {
            vd_impostors_deliver(s->set, items[i].id, items[i].version);
        }
    }
    return status;
}

static uint64_t hash_of(const uint64_t *ids, int count) {
    uint64_t hash = 14695981039346656037u; /* FNV-1a over whole ids */
    for (int i = 0; i < count; i++) {
        hash = (hash ^ ids[i]) * 1099511628211u;
        hash ^= hash >> 29;
    }
    return hash ^ (uint64_t)count;
}

/* Adds what is fixed to the screen to an order, over all else. Returns VD_ERROR_MEMORY. */
static vd_status add_fixed(vd_session *s, vd_impostor_order *order) {
    uint64_t fixed[VD_SESSION_PARTS];
    const int count = vd_session_overlay_ids(s, fixed);
    if (count == 0) {
        return vd_success();
    }
    if (order->count + count > s->order_room) {
        const int room = 2 * (order->count + count);
        vd_release(s->context, s->order);
        s->order = vd_allocate(s->context, (size_t)room, sizeof *s->order);
        s->order_room = s->order != NULL ? room : 0;
        if (s->order == NULL) {
            return vd_failure(VD_ERROR_MEMORY, "not enough memory for an order; let fewer in");
        }
    }
    memcpy(s->order, order->ids, (size_t)order->count * sizeof *s->order);
    memcpy(s->order + order->count, fixed, (size_t)count * sizeof *s->order);
    order->ids = s->order;
    order->count += count;
    return vd_success();
}

/* A whole screen in place of an order. As long as it took to draw is then left to the pictures that
 * are missing: else a world that takes long to draw is never more than screens. */
static vd_status stand_in(vd_session *s, vd_job *job, double now_s) {
    const double start_s = vd_session_seconds();
    const vd_status status = send_screen(s, job, false, now_s);
    s->screen_again_s = now_s + 2.0 * (vd_session_seconds() - start_s);
    return status;
}

/* Orders what is shown, or a whole screen while too much of it is missing. */
static vd_status send_order(vd_session *s, vd_job *job, double now_s) {
    vd_impostor_order order;
    vd_status status = vd_impostors_order(s->set, &order);
    if (status.code != VD_OK) {
        return status;
    }
    s->stats.error_px = fmin(order.error_px, MOST_ERROR_PX);
    if (order.missing > MOST_MISSING) {
        s->ordered = false;
        return s->screen != s->camera.sequence && now_s >= s->screen_again_s
                   ? stand_in(s, job, now_s)
                   : status;
    }
    status = add_fixed(s, &order);
    if (status.code != VD_OK) {
        return status;
    }
    const uint64_t hash = hash_of(order.ids, order.count);
    if (!s->ordered || hash != s->order_hash) {
        const vd_wire_message message = {
            .kind = VD_WIRE_ORDER, .as.order = {s->camera.sequence, {order.ids, order.count}}};
        vd_session_add(s, &message, now_s);
        vd_session_flush(s, now_s); /* the ids are used again */
        s->ordered = true;
        s->order_hash = hash;
    }
    return status;
}

/* What models are lit by, before the first of them. */
static void send_light(vd_session *s, double now_s) {
    vd_wire_message message = {.kind = VD_WIRE_LIGHT};
    message.as.light.light = *vd_world_renderer_get_light(s->def.renderer);
    vd_session_add(s, &message, now_s);
    s->lit = true;
}

static vd_status work_impostors(vd_session *s, vd_job *job, double now_s) {
    const vd_impostor_item *items = NULL;
    int count = 0;
    vd_impostor_stats stats;
    if (s->set == NULL && !make_set(s)) {
        return vd_success();
    }
    if (!s->lit && (s->hello.capabilities & VD_WIRE_MODELS) != 0) {
        send_light(s, now_s);
    }
    vd_impostors_set_tolerance(s->set, fmax((double)s->settings.tolerance_px, LEAST_TOLERANCE_PX));
    vd_status status = vd_impostors_update(s->set, job, &s->camera.camera, s->camera.width,
                                           s->camera.height, now_s, &stats);
    if (status.code == VD_OK) { /* first: the client's memory is full */
        status = send_gone(s, now_s);
    }
    if (status.code == VD_OK) {
        status = send_fresh(s, now_s);
    }
    if (status.code == VD_OK && s->state == VD_SESSION_SERVING) {
        status = vd_impostors_finish_order(s->set, job, &items, &count);
    }
    for (int i = 0; i < count && s->state == VD_SESSION_SERVING; i++) {
        vd_session_add_item(s, &items[i], now_s);
        if (s->state == VD_SESSION_SERVING) {
            vd_impostors_deliver(s->set, items[i].id, items[i].version);
        }
    }
    const vd_frame *still = s->state == VD_SESSION_SERVING ? vd_impostors_still(s->set) : NULL;
    if (status.code == VD_OK && s->state == VD_SESSION_SERVING) {
        status = vd_session_add_overlay(s, job, still != NULL, now_s);
    }
    if (status.code == VD_OK && s->state == VD_SESSION_SERVING) {
        status = send_order(s, job, now_s);
    }
    still = s->state == VD_SESSION_SERVING ? still : NULL;
    if (status.code == VD_OK && still != NULL && !s->exact) {
        s->exact = true; /* one try: what is too large for a message stays as it is */
        (void)vd_session_send_screen(s, still, true, now_s);
    }
    s->stats.kept_bytes = stats.bytes;
    s->stats.shared = stats.shared;
    return status;
}

/* ---- a turn -----------------------------------------------------------------------------------*/

/* Once a second, when the exact picture is there, and to answer a camera for which there was
 * nothing else to say. */
static void tell_stats(vd_session *s, bool answer, double now_s) {
    if (!answer && now_s - s->told_s < 1.0) {
        return;
    }
    s->told_s = now_s;
    vd_wire_message message = {.kind = VD_WIRE_STATS};
    message.as.stats = (vd_wire_stats){.link_bytes_per_s = fmin(s->link.bytes_per_s, 1e12),
                                       .latency_s = s->stats.latency_s,
                                       .error_px = s->stats.error_px,
                                       .queued_bytes = s->link.in_flight,
                                       .clients = (uint64_t)s->clients};
    vd_session_say(s, &message);
}

bool vd_session_is_due(const vd_session *s, double now_s) {
    return s->state == VD_SESSION_SERVING && s->camera.sequence != 0 &&
           (s->camera_is_new || (now_s >= s->next_s && !s->exact)) &&
           vd_link_is_open(&s->link, now_s);
}

void vd_session_work(vd_session *s, vd_job *job, double now_s) {
    vd_session_watch(s, now_s);
    if (!vd_session_is_due(s, now_s)) {
        return;
    }
    const bool fresh = s->camera_is_new, was_exact = s->exact;
    s->camera_is_new = false;
    s->turn_bytes = 0;
    if (s->past_count > 0) {
        drop_past(s, now_s);
    }
    vd_status status = vd_success();
    vd_session_add_ground(s, now_s);
    if (!s->exact) {
        status = s->settings.mode == VD_WIRE_MODE_SCREENS ? work_screens(s, job, now_s)
                                                          : work_impostors(s, job, now_s);
    }
    if (status.code == VD_ERROR_CANCELLED) {
        s->camera_is_new = true; /* the server is about to end */
    } else if (status.code != VD_OK) {
        vd_session_fail(s, VD_WIRE_FAULT_INTERNAL, status.message);
    }
    if (s->state != VD_SESSION_SERVING) {
        return;
    }
    vd_session_flush(s, now_s);
    if (fresh && s->turn_bytes > 0) {
        s->stats.latency_s = now_s - s->camera_s;
    }
    s->next_s = s->turn_bytes > 0 ? now_s : now_s + IDLE_S;
    s->stats.settled = s->exact;
    s->stats.error_px = s->ordered && !s->exact ? s->stats.error_px : 0.0;
    tell_stats(s, (fresh && s->turn_bytes == 0) || (s->exact && !was_exact), now_s);
}

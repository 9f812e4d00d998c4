/* session.c: what a client says, and how long it may be silent. */
#include <math.h>
#include <stdio.h>
#include <string.h>
#include "remote/session_internal.h"

#define HELLO_S 5.0
#define QUIET_S 15.0
#define SILENT_S 30.0

/* Of pictures that no client has any more: those who come by later may want them. */
#define IDLE_BYTES ((size_t)16 << 20)

/* Messages a second; a client with a camera for each of 240 pictures a second says fewer. */
#define MOST_MESSAGES 2000

vd_session_def vd_session_def_default(void) {
    return (vd_session_def){
        .memory_bytes = (size_t)64 << 20, .budget_s = 15e-3, .most_pixels = (size_t)1 << 23};
}

vd_status vd_session_tools_init(vd_context *context, vd_session_tools *out) {
    *out = (vd_session_tools){.context = context, .costs = vd_codec_costs_default()};
    vd_status status = vd_wire_create(context, &out->wire);
    if (status.code == VD_OK) {
        status = vd_coder_create(context, &out->coder);
    }
    if (status.code == VD_OK) {
        status = vd_impostor_pool_create(context, IDLE_BYTES, &out->pool);
    }
    if (status.code != VD_OK) {
        vd_session_tools_finish(out);
    }
    return status;
}

void vd_session_tools_finish(vd_session_tools *tools) {
    if (tools->context != NULL) {
        vd_wire_destroy(&tools->wire);
        vd_coder_destroy(&tools->coder);
        vd_release(tools->context, tools->packed);
        vd_frame_destroy(&tools->frame);
        vd_impostors_destroy(&tools->like);
        vd_impostor_pool_destroy(&tools->pool);
        vd_packed_clear(tools->context, &tools->sent);
    }
    *tools = (vd_session_tools){.context = NULL};
}

vd_status vd_session_create(const vd_session_def *def, double now_s, vd_session **out) {
    vd_context *context = def->tools->context;
    vd_session *s = vd_allocate(context, 1, sizeof *s);
    uint8_t *arena = vd_allocate(context, VD_WIRE_BATCH_BYTES, 1);
    if (s == NULL || arena == NULL) {
        vd_release(context, s);
        vd_release(context, arena);
        return vd_failure(VD_ERROR_MEMORY, "not enough memory for one more client; let fewer in");
    }
    memset(s, 0, sizeof *s);
    s->def = *def;
    s->context = context;
    s->arena = arena;
    s->created_s = s->heard_s = s->pinged_s = s->told_s = s->counted_s = now_s;
    s->settings = (vd_wire_settings){.mode = VD_WIRE_MODE_IMPOSTORS, .tolerance_px = 1.0f};
    s->quality = 60;
    s->clients = 1;
    *out = s;
    return vd_success();
}

void vd_session_destroy(vd_session **session) {
    vd_session *s = *session;
    if (s == NULL) {
        return;
    }
    vd_packet_clear(s->context, &s->packets);
    vd_session_forget_pictures(s);
    vd_wire_buffer_release(s->context, &s->buffer);
    vd_release(s->context, s->past_ids);
    vd_release(s->context, s->past_versions);
    vd_release(s->context, s->arena);
    vd_release(s->context, s->order);
    vd_release(s->context, s);
    *session = NULL;
}

vd_packet *vd_session_take(vd_session *s) {
    return vd_packet_take(&s->packets);
}

void vd_session_stop(vd_session *s, vd_wire_reason reason, const char *sentence) {
    if (s->state != VD_SESSION_OVER) {
        const vd_wire_message bye = {.kind = VD_WIRE_BYE, .as.bye = {reason, sentence}};
        vd_session_say(s, &bye);
        s->state = VD_SESSION_OVER;
        vd_session_forget_pictures(s);
    }
}

bool vd_session_is_over(const vd_session *s) {
    return s->state == VD_SESSION_OVER;
}

bool vd_session_is_greeted(const vd_session *s) {
    return s->state == VD_SESSION_SERVING;
}

void vd_session_set_clients(vd_session *s, int clients) {
    s->clients = clients;
}

vd_session_stats vd_session_get_stats(const vd_session *s) {
    vd_session_stats stats = s->stats;
    stats.in_flight_bytes = s->link.in_flight;
    stats.window_bytes = vd_link_window(&s->link);
    stats.link_bytes_per_s = s->link.bytes_per_s;
    return stats;
}

/* ---- hello ------------------------------------------------------------------------------------*/

static bool refuse_size(vd_session *s, int width, int height) {
    if ((size_t)width * (size_t)height <= s->def.most_pixels) {
        return false;
    }
    char sentence[160];
    (void)snprintf(sentence, sizeof sentence,
                   "a screen of %d x %d pixels is more than the %zu that are drawn here; make the "
                   "window smaller",
                   width, height, s->def.most_pixels);
    vd_session_fail(s, VD_WIRE_FAULT_TOO_MUCH, sentence);
    return true;
}

bool vd_token_matches(const char *wanted, const char *given) {
    const size_t bytes = strlen(given), length = strlen(wanted);
    unsigned differs = (unsigned)(bytes ^ length);
    for (size_t i = 0; i < VD_WIRE_TOKEN_BYTES; i++) {
        const unsigned a = i < length ? (unsigned char)wanted[i] : 0;
        const unsigned b = i < bytes ? (unsigned char)given[i] : 0;
        differs |= a ^ b;
    }
    return differs == 0;
}

static void keep_past(vd_session *s, const vd_wire_hello *hello) {
    const size_t count = (size_t)hello->held.count;
    s->past_ids = vd_allocate(s->context, count, sizeof *s->past_ids);
    s->past_versions = vd_allocate(s->context, count, sizeof *s->past_versions);
    if (s->past_ids == NULL || s->past_versions == NULL) {
        vd_session_fail(s, VD_WIRE_FAULT_INTERNAL, "the server is out of memory; try again later");
        return;
    }
    memcpy(s->past_ids, hello->held.ids, count * sizeof *s->past_ids);
    memcpy(s->past_versions, hello->held_versions, count * sizeof *s->past_versions);
    s->past_count = hello->held.count;
}

static void greet(vd_session *s, const vd_wire_hello *hello) {
    if (hello->version != VD_WIRE_VERSION) {
        vd_session_fail(s, VD_WIRE_FAULT_VERSION,
                        "client and server are of different versions; load the page again");
        return;
    }
    const char *given = hello->token != NULL ? hello->token : "";
    if (s->def.token != NULL && !vd_token_matches(s->def.token, given)) {
        vd_session_fail(s, VD_WIRE_FAULT_TOKEN,
                        "the token is not the server's; open the whole address that it printed");
        return;
    }
    if (hello->memory_bytes < VD_SESSION_LEAST_MEMORY) {
        vd_session_fail(s, VD_WIRE_FAULT_TOO_MUCH,
                        "a client keeps 4 MiB of pictures at least; give it more memory");
        return;
    }
    if (refuse_size(s, hello->width, hello->height)) {
        return;
    }
    s->hello = *hello;
    s->hello.token = s->hello.name = NULL;
    s->hello.held = (vd_wire_ids){NULL, 0};
    s->hello.held_versions = NULL;
    if (hello->held.count > 0) {
        keep_past(s, hello);
    }
    if (s->state == VD_SESSION_ACCEPTED) {
        s->state = VD_SESSION_SERVING;
        const vd_wire_message answer = {
            .kind = VD_WIRE_HELLO,
            .as.hello = {.version = VD_WIRE_VERSION,
                         .capabilities = VD_CODEC_ALL | VD_WIRE_SCREENS | VD_WIRE_MODELS |
                                         VD_WIRE_HEIGHTS | VD_WIRE_FIXED | VD_WIRE_BRICKS,
                         .name = s->def.name}};
        vd_session_say(s, &answer);
    }
}

bool vd_session_wants_past(const vd_session *s) {
    return s->state == VD_SESSION_SERVING && s->past_count > 0 && s->set == NULL;
}

bool vd_session_takes_past(vd_session *s, vd_session *past) {
    int same = 0;
    const unsigned drawn = VD_WIRE_MODELS | VD_WIRE_BRICKS;
    if (((s->hello.capabilities ^ past->hello.capabilities) & drawn) != 0 ||
        s->hello.particles != past->hello.particles) {
        return false; /* it does not draw what it did, or more */
    }
    for (int i = 0; past->set != NULL && i < s->past_count; i++) {
        same += vd_impostors_holds(past->set, s->past_ids[i], s->past_versions[i]);
    }
    if (same == 0) {
        return false;
    }
    s->set = past->set;
    past->set = NULL;
    vd_impostors_resume(s->set, s->past_ids, s->past_versions, s->past_count);
    return true;
}

/* ---- the other messages -----------------------------------------------------------------------*/

bool vd_session_same_view(const vd_wire_camera *a, const vd_wire_camera *b) {
    const vd_camera *p = &a->camera, *q = &b->camera;
    return a->width == b->width && a->height == b->height && p->eye.x == q->eye.x &&
           p->eye.y == q->eye.y && p->eye.z == q->eye.z && p->orientation.x == q->orientation.x &&
           p->orientation.y == q->orientation.y && p->orientation.z == q->orientation.z &&
           p->orientation.w == q->orientation.w && p->lens.fx == q->lens.fx &&
           p->lens.fy == q->lens.fy && p->lens.cx == q->lens.cx && p->lens.cy == q->lens.cy &&
           p->near_m == q->near_m;
}

static void take_camera(vd_session *s, const vd_wire_camera *camera, double now_s) {
    if (camera->sequence <= s->camera.sequence) {
        vd_session_fail(s, VD_WIRE_FAULT_OUT_OF_TURN,
                        "a camera came whose number does not follow the last one's; count them up");
        return;
    }
    if (refuse_size(s, camera->width, camera->height)) {
        return;
    }
    s->stats.cameras++;
    if (!vd_session_same_view(camera, &s->camera)) {
        s->camera_s = now_s;
        s->exact = false;
    } else if (s->screen == s->camera.sequence) { /* under its old number it shows the same */
        s->screen = camera->sequence;
    }
    s->camera = *camera;
    s->camera_is_new = true;
}

static void take_settings(vd_session *s, const vd_wire_settings *settings) {
    const bool other_mode = settings->mode != s->settings.mode;
    s->settings = *settings;
    s->exact = false;
    s->camera_is_new = s->camera.sequence != 0;
    if (other_mode) {
        s->ordered = false;
        s->screen = 0;
    }
}

static void take(vd_session *s, const vd_wire_message *m, double now_s) {
    switch (m->kind) {
    case VD_WIRE_CAMERA:
        take_camera(s, &m->as.camera, now_s);
        break;
    case VD_WIRE_SETTINGS:
        take_settings(s, &m->as.settings);
        break;
    case VD_WIRE_ACKNOWLEDGE:
        if (!vd_link_acknowledged(&s->link, m->as.acknowledge.batch, now_s)) {
            vd_session_fail(s, VD_WIRE_FAULT_OUT_OF_TURN,
                            "a batch was acknowledged that was not sent, or was before");
        }
        break;
    case VD_WIRE_DROP:
        for (int i = 0; s->set != NULL && i < m->as.drop.count; i++) {
            vd_impostors_lose(s->set, m->as.drop.ids[i]);
            vd_session_lose_overlay(s, m->as.drop.ids[i]);
        }
        s->exact = false;
        break;
    case VD_WIRE_PING: {
        const vd_wire_message pong = {.kind = VD_WIRE_PONG, .as.pong = m->as.ping};
        vd_session_say(s, &pong);
        break;
    }
    case VD_WIRE_ERROR:
    case VD_WIRE_BYE:
        s->state = VD_SESSION_OVER;
        vd_session_forget_pictures(s);
        break;
    case VD_WIRE_HELLO:
        vd_session_fail(s, VD_WIRE_FAULT_OUT_OF_TURN, "hello is said once");
        break;
    default: /* of a newer version, or for people */
        break;
    }
}

/* Whether there are too many messages. */
static bool floods(vd_session *s, int count, double now_s) {
    if (now_s - s->counted_s >= 1.0) {
        s->counted_s = now_s;
        s->counted = 0;
    }
    s->counted += count;
    return s->counted > MOST_MESSAGES;
}

void vd_session_receive(vd_session *s, const void *data, size_t bytes, double now_s) {
    vd_wire_envelope envelope;
    if (s->state == VD_SESSION_OVER) {
        return;
    }
    const vd_status status =
        vd_wire_decode(s->def.tools->wire, VD_WIRE_CLIENT, data, bytes, &envelope);
    if (status.code != VD_OK) {
        vd_session_fail(s, VD_WIRE_FAULT_MALFORMED, status.message);
        return;
    }
    s->heard_s = now_s;
    if (floods(s, envelope.count, now_s)) {
        vd_session_fail(s, VD_WIRE_FAULT_TOO_MUCH,
                        "more than 2000 messages came in a second; send fewer");
        return;
    }
    for (int i = 0; i < envelope.count && s->state != VD_SESSION_OVER; i++) {
        const vd_wire_message *m = &envelope.messages[i];
        if (s->state == VD_SESSION_ACCEPTED && m->kind == VD_WIRE_HELLO) {
            greet(s, &m->as.hello);
        } else if (s->state == VD_SESSION_ACCEPTED) {
            vd_session_fail(s, VD_WIRE_FAULT_OUT_OF_TURN, "the first message is a hello");
        } else {
            take(s, m, now_s);
        }
    }
}

void vd_session_watch(vd_session *s, double now_s) {
    if (s->state == VD_SESSION_ACCEPTED && now_s - s->created_s > HELLO_S) {
        vd_session_fail(s, VD_WIRE_FAULT_SLOW, "no hello came within 5 s; connect again");
    } else if (s->state == VD_SESSION_SERVING && now_s - s->heard_s > SILENT_S) {
        vd_session_fail(s, VD_WIRE_FAULT_SLOW, "nothing came for 30 s; connect again");
    } else if (s->state == VD_SESSION_SERVING && s->link.count > 0 &&
               now_s - s->link.flights[s->link.first].sent_s > SILENT_S) {
        vd_session_fail(s, VD_WIRE_FAULT_SLOW,
                        "what was sent was not taken in for 30 s; connect again");
    } else if (s->state == VD_SESSION_SERVING && now_s - s->heard_s > QUIET_S &&
               now_s - s->pinged_s > QUIET_S) {
        s->pinged_s = now_s;
        const vd_wire_message ping = {.kind = VD_WIRE_PING, .as.ping = {(uint64_t)(now_s * 1e6)}};
        vd_session_say(s, &ping);
    }
}

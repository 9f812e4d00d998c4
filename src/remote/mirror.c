/* mirror.c: what a client says, and how it ends. */
#include "remote/mirror_internal.h"

#include <stdio.h>
#include <string.h>

#define HELLO_S 10.0
#define QUIET_S 15.0
#define SILENT_S 30.0

/* Of a server that sends much and takes nothing in. */
#define MOST_PACKETS 4096

/* That hello states before anybody has looked. */
#define USUAL_WIDTH 1280
#define USUAL_HEIGHT 720

vd_status vd_mirror_create(vd_context *context, const vd_mirror_def *def, vd_mirror **out) {
    const vd_wire_message settings = {.kind = VD_WIRE_SETTINGS, .as.settings = def->settings};
    vd_status status = vd_wire_check(VD_WIRE_CLIENT, &settings);
    if (status.code == VD_OK &&
        (def->memory_bytes < VD_SESSION_LEAST_MEMORY || def->memory_bytes > VD_WIRE_MOST_MEMORY)) {
        status = vd_failure(VD_ERROR_ARGUMENT,
                            "memory_bytes is %zu; give 4 MiB to 1 TiB for a client's pictures",
                            def->memory_bytes);
    }
    if (status.code == VD_OK && def->particles > VD_PLACED_PARTICLES) {
        status = vd_failure(VD_ERROR_ARGUMENT, "particles is %u; give 0 to %llu", def->particles,
                            (unsigned long long)VD_PLACED_PARTICLES);
    }
    if (status.code != VD_OK) {
        return status;
    }
    vd_mirror *m = vd_allocate(context, 1, sizeof *m);
    if (m == NULL) {
        return vd_failure(VD_ERROR_MEMORY, "not enough memory for a client; free some");
    }
    memset(m, 0, sizeof *m);
    m->context = context;
    m->def = *def;
    m->settings = def->settings;
    pthread_mutex_init(&m->lock, NULL);
    status = vd_wire_create(context, &m->wire);
    if (status.code == VD_OK) {
        status = vd_coder_create(context, &m->coder);
    }
    if (status.code == VD_OK) {
        status = vd_display_create(context, &m->display);
    }
    if (status.code == VD_OK) {
        status = vd_placer_create(context, &m->placer);
    }
    if (status.code != VD_OK) {
        vd_mirror_destroy(&m);
        return status;
    }
    *out = m;
    return status;
}

void vd_mirror_destroy(vd_mirror **mirror) {
    vd_mirror *m = *mirror;
    if (m == NULL) {
        return;
    }
    vd_packet_clear(m->context, &m->packets);
    vd_mirror_forget(m);
    vd_display_destroy(&m->display);
    vd_placer_destroy(&m->placer);
    vd_coder_destroy(&m->coder);
    vd_wire_destroy(&m->wire);
    vd_wire_buffer_release(m->context, &m->buffer);
    vd_release(m->context, m->held);
    vd_release(m->context, m->order);
    vd_release(m->context, m->ids);
    vd_release(m->context, m->versions);
    vd_release(m->context, m->quads);
    vd_release(m->context, m->placed);
    vd_release(m->context, m->behind);
    vd_release(m->context, m->drawn);
    pthread_mutex_destroy(&m->lock);
    vd_release(m->context, m);
    *mirror = NULL;
}

/* ---- packets ----------------------------------------------------------------------------------*/

vd_packet *vd_mirror_take(vd_mirror *m) {
    return vd_packet_take(&m->packets);
}

static bool post(vd_mirror *m, const vd_wire_message *message) {
    const vd_status status = vd_wire_encode(m->wire, VD_WIRE_CLIENT, 0, message, 1, &m->buffer);
    return status.code == VD_OK && vd_packet_put(m->context, &m->packets, &m->buffer);
}

void vd_mirror_end(vd_mirror *m, vd_client_state state, const char *sentence) {
    m->over = true;
    if (m->news.state < VD_CLIENT_REFUSED) {
        m->news.state = state;
        (void)snprintf(m->news.sentence, sizeof m->news.sentence, "%s", sentence);
        m->news.version++;
    }
}

static void end(vd_mirror *m, vd_client_state state, const char *sentence) {
    pthread_mutex_lock(&m->lock);
    vd_mirror_end(m, state, sentence);
    pthread_mutex_unlock(&m->lock);
}

void vd_mirror_say(vd_mirror *m, const vd_wire_message *message) {
    if (m->over) {
        return;
    }
    if (m->packets.count >= MOST_PACKETS) {
        end(m, VD_CLIENT_LOST, "the server sends without listening");
    } else if (!post(m, message)) {
        end(m, VD_CLIENT_LOST, "there is no memory for a message; close something");
    }
}

void vd_mirror_fail(vd_mirror *m, vd_wire_fault code, const char *sentence) {
    if (!m->over) {
        char said[VD_MESSAGE_BYTES];
        const vd_wire_message error = {.kind = VD_WIRE_ERROR, .as.error = {code, sentence}};
        (void)post(m, &error);
        (void)snprintf(said, sizeof said, "the server says what it may not: %.300s", sentence);
        end(m, VD_CLIENT_REFUSED, said);
    }
}

/* ---- the connection ---------------------------------------------------------------------------*/

/* Lists what is held; that none can be listed is no failure: all is sent again then. */
static int list_held(vd_mirror *m) {
    vd_release(m->context, m->ids);
    vd_release(m->context, m->versions);
    const size_t count = (size_t)m->held_count;
    m->ids = vd_allocate(m->context, count, sizeof *m->ids);
    m->versions = vd_allocate(m->context, count, sizeof *m->versions);
    if (m->ids == NULL || m->versions == NULL) {
        vd_mirror_forget(m);
        return 0;
    }
    for (size_t i = 0; i < count; i++) {
        m->ids[i] = m->held[i]->id;
        m->versions[i] = m->held[i]->version;
    }
    return m->held_count;
}

void vd_mirror_open(vd_mirror *m, double now_s) {
    vd_packet_clear(m->context, &m->packets); /* of the last connection */
    pthread_mutex_lock(&m->lock);
    const int held = list_held(m);
    const bool looked = m->wanted.width > 0;
    const unsigned models =
        (m->def.no_models ? 0 : VD_WIRE_MODELS) | (m->def.particles > 0 ? VD_WIRE_BRICKS : 0);
    const vd_wire_message hello = {.kind = VD_WIRE_HELLO,
                                   .as.hello = {.version = VD_WIRE_VERSION,
                                                .capabilities = VD_CODEC_ALL | VD_WIRE_SCREENS |
                                                                VD_WIRE_HEIGHTS | VD_WIRE_FIXED |
                                                                models,
                                                .token = m->def.token,
                                                .memory_bytes = m->def.memory_bytes,
                                                .particles = m->def.particles,
                                                .width = looked ? m->wanted.width : USUAL_WIDTH,
                                                .height = looked ? m->wanted.height : USUAL_HEIGHT,
                                                .name = m->def.name,
                                                .held = {m->ids, held},
                                                .held_versions = m->versions}};
    m->news.connections++;
    m->wanted_is_new = looked;
    m->settings_are_new = true;
    m->absurd = false;
    /* Whoever answers may show another world: what stands there is exact no more. */
    m->screen.exact = false;
    pthread_mutex_unlock(&m->lock);
    m->open = true;
    m->greeted = m->over = m->unanswered = m->measuring = false;
    m->batch = 0;
    m->opened_s = m->heard_s = m->pinged_s = now_s;
    vd_mirror_say(m, &hello);
}

void vd_mirror_lose(vd_mirror *m, const char *sentence) {
    m->open = m->greeted = false;
    end(m, VD_CLIENT_LOST, sentence);
}

void vd_mirror_refuse(vd_mirror *m, const char *sentence) {
    end(m, VD_CLIENT_REFUSED, sentence);
}

void vd_mirror_leave(vd_mirror *m) {
    if (m->open && !m->over) {
        const vd_wire_message bye = {.kind = VD_WIRE_BYE, .as.bye = {VD_WIRE_DONE, ""}};
        vd_mirror_say(m, &bye);
        m->over = true;
    }
}

bool vd_mirror_is_over(vd_mirror *m) {
    return m->over;
}

bool vd_mirror_may_open(vd_mirror *m) {
    pthread_mutex_lock(&m->lock);
    const bool may = m->news.state < VD_CLIENT_REFUSED;
    pthread_mutex_unlock(&m->lock);
    return may;
}

/* ---- cameras and settings ---------------------------------------------------------------------*/

bool vd_same_view(const vd_wire_camera *a, const vd_wire_camera *b) {
    const vd_camera *p = &a->camera, *q = &b->camera;
    return a->width == b->width && a->height == b->height && p->eye.x == q->eye.x &&
           p->eye.y == q->eye.y && p->eye.z == q->eye.z && p->orientation.x == q->orientation.x &&
           p->orientation.y == q->orientation.y && p->orientation.z == q->orientation.z &&
           p->orientation.w == q->orientation.w && p->lens.fx == q->lens.fx &&
           p->lens.fy == q->lens.fy && p->lens.cx == q->lens.cx && p->lens.cy == q->lens.cy &&
           p->near_m == q->near_m;
}

void vd_mirror_look(vd_mirror *m, const vd_camera *camera, int width, int height) {
    vd_wire_message message = {.kind = VD_WIRE_CAMERA,
                               .as.camera = {.sequence = 1, .width = width, .height = height}};
    message.as.camera.camera = *camera;
    message.as.camera.camera.far_m = 0.0;
    if (vd_wire_check(VD_WIRE_CLIENT, &message).code != VD_OK) {
        return;
    }
    pthread_mutex_lock(&m->lock);
    if (!vd_same_view(&m->wanted, &message.as.camera)) {
        m->wanted = message.as.camera;
        m->wanted_is_new = true;
    }
    pthread_mutex_unlock(&m->lock);
}

vd_status vd_mirror_set(vd_mirror *m, const vd_wire_settings *settings) {
    const vd_wire_message message = {.kind = VD_WIRE_SETTINGS, .as.settings = *settings};
    const vd_status status = vd_wire_check(VD_WIRE_CLIENT, &message);
    if (status.code == VD_OK) {
        pthread_mutex_lock(&m->lock);
        m->settings = *settings;
        m->settings_are_new = true;
        pthread_mutex_unlock(&m->lock);
    }
    return status;
}

static void watch(vd_mirror *m, double now_s) {
    if (!m->greeted && now_s - m->opened_s > HELLO_S) {
        end(m, VD_CLIENT_LOST, "the server does not answer");
    } else if (now_s - m->heard_s > SILENT_S) {
        end(m, VD_CLIENT_LOST, "nothing came from the server for 30 s");
    } else if (m->greeted && now_s - m->heard_s > QUIET_S && now_s - m->pinged_s > QUIET_S) {
        m->pinged_s = now_s;
        const vd_wire_message ping = {.kind = VD_WIRE_PING, .as.ping = {(uint64_t)(now_s * 1e6)}};
        vd_mirror_say(m, &ping);
    }
}

void vd_mirror_work(vd_mirror *m, double now_s) {
    if (!m->open || m->over) {
        return;
    }
    watch(m, now_s);
    if (!m->greeted || m->over) {
        return;
    }
    vd_wire_message settings = {.kind = VD_WIRE_SETTINGS}, camera = {.kind = VD_WIRE_CAMERA};
    pthread_mutex_lock(&m->lock);
    const bool absurd = m->absurd;
    m->absurd = false;
    pthread_mutex_unlock(&m->lock);
    if (absurd) {
        vd_mirror_fail(m, VD_WIRE_FAULT_TOO_MUCH,
                       "its pictures and models would fill the screen "
                       "a thousand times over; order fewer");
        return;
    }
    pthread_mutex_lock(&m->lock);
    const bool set = m->settings_are_new, look = m->wanted_is_new && !m->unanswered;
    settings.as.settings = m->settings;
    m->settings_are_new = false;
    if (look) {
        camera.as.camera = m->wanted;
        m->wanted_is_new = false;
        m->news.cameras++;
    }
    pthread_mutex_unlock(&m->lock);
    if (set) {
        vd_mirror_say(m, &settings);
    }
    if (look) {
        vd_wire_camera *c = &camera.as.camera;
        c->sequence = ++m->sequence;
        c->time_s = now_s;
        m->sent[m->sequence % VD_MIRROR_CAMERAS] = *c;
        const size_t pixels = (size_t)c->width * (size_t)c->height;
        m->most_pixels = pixels > m->most_pixels ? pixels : m->most_pixels;
        m->unanswered = m->measuring = true;
        m->camera_s = now_s;
        vd_mirror_say(m, &camera);
    }
}

/* ---- receiving --------------------------------------------------------------------------------*/

static void ended_by_server(vd_mirror *m, const vd_wire_message *message) {
    const bool error = message->kind == VD_WIRE_ERROR;
    const char *said = error ? message->as.error.sentence : message->as.bye.sentence;
    vd_client_state state = VD_CLIENT_LOST;
    if (error && message->as.error.code == VD_WIRE_FAULT_VERSION) {
        state = VD_CLIENT_MISMATCHED;
    } else if (error && message->as.error.code < VD_WIRE_FAULT_SLOW) {
        state = VD_CLIENT_REFUSED;
    } else if (!error && message->as.bye.reason != VD_WIRE_STOPPING) {
        state = VD_CLIENT_ENDED;
    }
    end(m, state,
        said != NULL && said[0] != '\0' ? said
        : error                         ? "the server gave up"
                                        : "the server has ended this");
}

static void greeted(vd_mirror *m, const vd_wire_hello *hello) {
    if (hello->version != VD_WIRE_VERSION) {
        end(m, VD_CLIENT_MISMATCHED,
            "server and client are of different versions; install the server's");
        return;
    }
    m->greeted = true;
    pthread_mutex_lock(&m->lock);
    m->news.state =
        m->order_count > 0 || m->screen.kept != NULL ? VD_CLIENT_SHOWING : VD_CLIENT_LOADING;
    m->news.sentence[0] = '\0';
    m->news.version++;
    pthread_mutex_unlock(&m->lock);
}

static void acknowledge(vd_mirror *m, uint32_t batch) {
    vd_wire_message message = {.kind = VD_WIRE_ACKNOWLEDGE, .as.acknowledge = {.batch = batch}};
    pthread_mutex_lock(&m->lock);
    message.as.acknowledge.held_bytes = m->news.held_bytes;
    m->news.batches++;
    pthread_mutex_unlock(&m->lock);
    m->batch = batch;
    m->unanswered = false;
    vd_mirror_say(m, &message);
}

static void take(vd_mirror *m, const vd_wire_message *message, double now_s) {
    if (message->kind == VD_WIRE_ERROR || message->kind == VD_WIRE_BYE) {
        ended_by_server(m, message);
    } else if (!m->greeted && message->kind == VD_WIRE_HELLO) {
        greeted(m, &message->as.hello);
    } else if (!m->greeted) {
        vd_mirror_fail(m, VD_WIRE_FAULT_OUT_OF_TURN, "the first message is a hello");
    } else {
        vd_mirror_take_message(m, message, now_s);
    }
}

void vd_mirror_receive(vd_mirror *m, const void *data, size_t bytes, double now_s) {
    vd_wire_envelope envelope;
    if (!m->open || m->over) {
        return;
    }
    const vd_status status = vd_wire_decode(m->wire, VD_WIRE_SERVER, data, bytes, &envelope);
    if (status.code != VD_OK) {
        vd_mirror_fail(m, VD_WIRE_FAULT_MALFORMED, status.message);
        return;
    }
    m->heard_s = now_s;
    pthread_mutex_lock(&m->lock);
    m->news.bytes += bytes;
    pthread_mutex_unlock(&m->lock);
    if (envelope.batch != 0 && envelope.batch <= m->batch) {
        vd_mirror_fail(m, VD_WIRE_FAULT_OUT_OF_TURN, "a batch's number does not follow the last's");
        return;
    }
    m->walked = 0;
    for (int i = 0; i < envelope.count && !m->over; i++) {
        take(m, &envelope.messages[i], now_s);
    }
    if (envelope.batch != 0 && !m->over) {
        acknowledge(m, envelope.batch);
    }
}

void vd_mirror_get_news(vd_mirror *m, vd_client_news *out) {
    pthread_mutex_lock(&m->lock);
    *out = m->news;
    out->held = m->held_count;
    out->ordered = m->order_count;
    pthread_mutex_unlock(&m->lock);
}

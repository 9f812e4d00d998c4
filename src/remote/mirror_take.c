/* mirror_take.c: what a server sends, into what is held and ordered. */
#include "remote/mirror_internal.h"

#include <string.h>

/* Ids that the replacements of an envelope walk over at most: a thousand of them, of a long order,
 * would hold up frames for a second. */
#define MOST_WALKED (1 << 22)

/* ---- what is held -----------------------------------------------------------------------------*/

size_t vd_mirror_bytes(const vd_held *held) {
    return held->kept != NULL ? held->kept->bytes : VD_WIRE_INSTANCE_BYTES;
}

void vd_mirror_release(vd_mirror *m, vd_kept *kept) {
    if (kept != NULL && --kept->references == 0) {
        vd_model_destroy(&kept->model);
        vd_brick_block_destroy(&kept->brick);
        vd_release(m->context, kept->rgba);
        vd_release(m->context, kept);
    }
}

/* Where an id is or would be. */
static int place_of(const vd_mirror *m, uint64_t id) {
    int low = 0, high = m->held_count;
    while (low < high) {
        const int middle = low + (high - low) / 2;
        if (m->held[middle]->id < id) {
            low = middle + 1;
        } else {
            high = middle;
        }
    }
    return low;
}

vd_held *vd_mirror_find(const vd_mirror *m, uint64_t id) {
    const int at = place_of(m, id);
    return at < m->held_count && m->held[at]->id == id ? m->held[at] : NULL;
}

static void remove_at(vd_mirror *m, int at) {
    vd_held *held = m->held[at];
    m->news.held_bytes -= vd_mirror_bytes(held);
    vd_mirror_release(m, held->kept);
    vd_release(m->context, held);
    m->held_count--;
    memmove(m->held + at, m->held + at + 1, (size_t)(m->held_count - at) * sizeof *m->held);
}

void vd_mirror_forget(vd_mirror *m) {
    while (m->held_count > 0) {
        remove_at(m, m->held_count - 1);
    }
    m->order_count = 0;
    vd_mirror_release(m, m->screen.kept);
    m->screen = (vd_mirror_screen){.kept = NULL};
}

/* Makes room for `count` elements of an array. */
static bool grow(vd_mirror *m, void **array, int *room, int count, size_t size) {
    if (*room > 0 && count <= *room) {
        return true;
    }
    const int more = count < 512 ? 1024 : 2 * count;
    void *made = vd_allocate(m->context, (size_t)more, size);
    if (made == NULL) {
        return false;
    }
    if (*room > 0) {
        memcpy(made, *array, (size_t)*room * size);
    }
    vd_release(m->context, *array);
    *array = made;
    *room = more;
    return true;
}

/* ---- pictures ---------------------------------------------------------------------------------*/

void vd_mirror_out_of_memory(vd_mirror *m) {
    pthread_mutex_lock(&m->lock);
    vd_mirror_end(m, VD_CLIENT_LOST, "there is no memory for a picture; close something");
    pthread_mutex_unlock(&m->lock);
}

/* Unpacks a picture; null after a failure that was told. */
static vd_kept *unpack(vd_mirror *m, vd_codec codec, const vd_wire_bytes *picture, int width,
                       int height) {
    vd_kept *kept = vd_allocate(m->context, 1, sizeof *kept);
    uint8_t *rgba = vd_allocate(m->context, 4 * (size_t)width, (size_t)height);
    if (kept == NULL || rgba == NULL) {
        vd_release(m->context, kept);
        vd_release(m->context, rgba);
        vd_mirror_out_of_memory(m);
        return NULL;
    }
    *kept = (vd_kept){.references = 1,
                      .bytes = 4 * (size_t)width * (size_t)height,
                      .width = width,
                      .height = height,
                      .rgba = rgba};
    const vd_status status = vd_coder_decode(m->coder, codec, picture->data, picture->bytes, width,
                                             height, rgba, (size_t)width);
    if (status.code != VD_OK) {
        vd_release(m->context, kept);
        vd_release(m->context, rgba);
        if (status.code == VD_ERROR_MEMORY) {
            vd_mirror_out_of_memory(m);
        } else {
            vd_mirror_fail(m, VD_WIRE_FAULT_MALFORMED, status.message);
        }
        return NULL;
    }
    return kept;
}

bool vd_mirror_fits(vd_mirror *m, uint64_t id, size_t bytes) {
    const vd_held *old = vd_mirror_find(m, id); /* only this thread changes what is held */
    const size_t before = m->news.held_bytes - (old != NULL ? vd_mirror_bytes(old) : 0);
    if (before + bytes > m->def.memory_bytes) {
        vd_mirror_fail(m, VD_WIRE_FAULT_TOO_MUCH,
                       "pictures take more memory than this client has; drop some before");
        return false;
    }
    if (old == NULL && m->held_count >= VD_WIRE_MAX_IDS) {
        vd_mirror_fail(m, VD_WIRE_FAULT_TOO_MUCH, "a client holds 65536 pictures at most");
        return false;
    }
    return true;
}

bool vd_mirror_hold(vd_mirror *m, const vd_held *given) {
    vd_held *made = vd_allocate(m->context, 1, sizeof *made);
    pthread_mutex_lock(&m->lock);
    if (made == NULL ||
        !grow(m, (void **)&m->held, &m->held_room, m->held_count + 1, sizeof *m->held)) {
        vd_mirror_release(m, given->kept);
        pthread_mutex_unlock(&m->lock);
        vd_release(m->context, made);
        vd_mirror_out_of_memory(m);
        return false;
    }
    *made = *given;
    if (vd_mirror_find(m, made->id) != NULL) {
        remove_at(m, place_of(m, made->id));
    }
    const int at = place_of(m, made->id);
    memmove(m->held + at + 1, m->held + at, (size_t)(m->held_count - at) * sizeof *m->held);
    m->held[at] = made;
    m->held_count++;
    vd_client_news *news = &m->news;
    news->held_bytes += vd_mirror_bytes(made);
    news->most_held_bytes =
        news->held_bytes > news->most_held_bytes ? news->held_bytes : news->most_held_bytes;
    news->version++;
    pthread_mutex_unlock(&m->lock);
    return true;
}

static void keep(vd_mirror *m, const vd_wire_impostor *p, double now_s) {
    vd_kept *kept = vd_mirror_fits(m, p->id, 4 * (size_t)p->width * (size_t)p->height)
                        ? unpack(m, p->codec, &p->picture, p->width, p->height)
                        : NULL;
    if (kept == NULL) {
        return;
    }
    vd_held made = {.id = p->id, .version = p->version, .fixed = p->fixed, .kept = kept};
    memcpy(made.opaque, p->opaque, sizeof made.opaque);
    for (int i = 0; i < 4; i++) {
        const float *c = p->corners[i];
        made.corners[i] =
            vd_vec3_add(p->origin, vd_vec3_make((double)c[0], (double)c[1], (double)c[2]));
    }
    if (!vd_mirror_hold(m, &made)) {
        return;
    }
    pthread_mutex_lock(&m->lock);
    m->news.pictures++;
    if (m->measuring) {
        m->news.answer_s = now_s - m->camera_s;
        m->news.answers++;
    }
    m->measuring = false;
    pthread_mutex_unlock(&m->lock);
}

static void take_screen(vd_mirror *m, const vd_wire_screen *s) {
    if (s->camera > m->sequence || (size_t)s->width * (size_t)s->height > m->most_pixels) {
        vd_mirror_fail(m, VD_WIRE_FAULT_OUT_OF_TURN, "a screen came that nobody has asked for");
        return;
    }
    vd_kept *kept = unpack(m, s->codec, &s->picture, s->width, s->height);
    if (kept == NULL) {
        return;
    }
    const vd_wire_camera *camera = &m->sent[s->camera % VD_MIRROR_CAMERAS];
    pthread_mutex_lock(&m->lock);
    vd_mirror_release(m, m->screen.kept);
    m->screen =
        (vd_mirror_screen){.kept = kept, .exact = s->exact, .known = camera->sequence == s->camera};
    m->screen.camera = *camera;
    m->news.screens++;
    m->news.version++;
    m->news.state = VD_CLIENT_SHOWING;
    pthread_mutex_unlock(&m->lock);
}

/* ---- order ------------------------------------------------------------------------------------*/

static void take_order(vd_mirror *m, const vd_wire_order *order) {
    const int count = order->ids.count;
    if (order->camera > m->sequence) {
        vd_mirror_fail(m, VD_WIRE_FAULT_OUT_OF_TURN, "an order is for a camera that was not sent");
        return;
    }
    pthread_mutex_lock(&m->lock);
    const bool room = grow(m, (void **)&m->order, &m->order_room, count, sizeof *m->order);
    if (room) {
        for (int i = 0; i < count; i++) {
            m->order[i] = order->ids.ids[i];
        }
        m->order_count = count;
        if (!m->screen.exact) { /* it stood in until now */
            vd_mirror_release(m, m->screen.kept);
            m->screen = (vd_mirror_screen){.kept = NULL};
        }
        m->news.version++;
        m->news.state = VD_CLIENT_SHOWING;
    }
    pthread_mutex_unlock(&m->lock);
    if (!room) {
        vd_mirror_out_of_memory(m);
    }
}

static bool is_among(const vd_wire_ids *ids, uint64_t id) {
    int low = 0, high = ids->count;
    while (low < high) {
        const int middle = low + (high - low) / 2;
        if (ids->ids[middle] < id) {
            low = middle + 1;
        } else {
            high = middle;
        }
    }
    return low < ids->count && ids->ids[low] == id;
}

/* Those that begin stand where the first that stops stood; in front of all where none did. */
static void take_replace(vd_mirror *m, const vd_wire_replace *r) {
    pthread_mutex_lock(&m->lock);
    uint64_t *made = NULL;
    const int most = m->order_count + r->in.count;
    const bool fit = most <= VD_WIRE_MAX_IDS && m->walked <= MOST_WALKED;
    m->walked += m->order_count;
    int room = 0, count = 0;
    const bool grown = fit && grow(m, (void **)&made, &room, most, sizeof *made);
    bool begun = false;
    for (int i = 0; grown && i <= m->order_count; i++) {
        const bool stops = i < m->order_count && is_among(&r->out, m->order[i]);
        if (!begun && (stops || i == m->order_count)) {
            for (int k = 0; k < r->in.count; k++) {
                made[count++] = r->in.ids[k];
            }
            begun = true;
        }
        if (!stops && i < m->order_count) {
            made[count++] = m->order[i];
        }
    }
    if (grown) {
        vd_release(m->context, m->order);
        m->order = made;
        m->order_room = room;
        m->order_count = count;
        m->news.version++;
    }
    pthread_mutex_unlock(&m->lock);
    if (!fit) {
        vd_mirror_fail(m, VD_WIRE_FAULT_TOO_MUCH,
                       "an order has 65536 pictures at most, and an envelope few "
                       "replacements of a long one");
    } else if (!grown) {
        vd_mirror_out_of_memory(m);
    }
}

/* One pass over both, which ascend: a list of all that is held must not take its square. */
static void drop(vd_mirror *m, const vd_wire_ids *ids) {
    pthread_mutex_lock(&m->lock);
    int kept = 0, next = 0;
    for (int i = 0; i < m->held_count; i++) {
        vd_held *held = m->held[i];
        while (next < ids->count && ids->ids[next] < held->id) {
            next++;
        }
        if (next < ids->count && ids->ids[next] == held->id) {
            m->news.held_bytes -= vd_mirror_bytes(held);
            vd_mirror_release(m, held->kept);
            vd_release(m->context, held);
        } else {
            m->held[kept++] = held;
        }
    }
    m->held_count = kept;
    m->news.version++;
    pthread_mutex_unlock(&m->lock);
}

void vd_mirror_take_message(vd_mirror *m, const vd_wire_message *message, double now_s) {
    switch (message->kind) {
    case VD_WIRE_IMPOSTOR:
        keep(m, &message->as.impostor, now_s);
        break;
    case VD_WIRE_ORDER:
        take_order(m, &message->as.order);
        break;
    case VD_WIRE_REPLACE:
        take_replace(m, &message->as.replace);
        break;
    case VD_WIRE_DROP:
        drop(m, &message->as.drop);
        break;
    case VD_WIRE_SCREEN:
        take_screen(m, &message->as.screen);
        break;
    case VD_WIRE_STATS:
        pthread_mutex_lock(&m->lock);
        m->news.last = message->as.stats;
        pthread_mutex_unlock(&m->lock);
        m->unanswered = false;
        break;
    case VD_WIRE_PING: {
        const vd_wire_message pong = {.kind = VD_WIRE_PONG, .as.pong = message->as.ping};
        vd_mirror_say(m, &pong);
        break;
    }
    case VD_WIRE_HELLO:
        vd_mirror_fail(m, VD_WIRE_FAULT_OUT_OF_TURN, "hello is said once");
        break;
    case VD_WIRE_GEOMETRY:
        vd_mirror_take_geometry(m, &message->as.geometry);
        break;
    case VD_WIRE_INSTANCE:
        vd_mirror_take_instance(m, &message->as.instance);
        break;
    case VD_WIRE_GROUND:
        vd_mirror_take_ground(m, &message->as.ground);
        break;
    case VD_WIRE_LIGHT:
        vd_mirror_take_light(m, &message->as.light.light);
        break;
    default: /* of a newer version */
        break;
    }
}

/* session_send.c: from pictures to packets. */
#include <math.h>
#include <string.h>
#include <time.h>
#include "remote/session_internal.h"

/* Of several messages together. */
#define BATCH_ROOM (VD_WIRE_BATCH_BYTES - VD_WIRE_HEAD_BYTES)

/* Screens that move: so many a second are to fit through the link. */
#define SCREENS_PER_S 20.0
#define LEAST_QUALITY 25
#define MOST_QUALITY 90
#define UNMEASURED_BYTES_PER_S 2e6

/* ---- packets ----------------------------------------------------------------------------------*/

static void end(vd_session *s) {
    s->state = VD_SESSION_OVER;
    s->message_count = 0;
    s->message_bytes = s->arena_used = 0;
    vd_session_forget_pictures(s);
}

/* Makes a packet of an envelope; false when that cannot be. */
static bool post(vd_session *s, uint32_t batch, const vd_wire_message *messages, int count) {
    const vd_status status =
        vd_wire_encode(s->def.tools->wire, VD_WIRE_SERVER, batch, messages, count, &s->buffer);
    if (status.code != VD_OK) {
        vd_log(s->context, VD_LOG_WARNING, "a client was let go: %.300s", status.message);
        return false;
    }
    if (!vd_packet_put(s->context, &s->packets, &s->buffer)) {
        return false;
    }
    s->stats.bytes_sent += s->buffer.bytes;
    return true;
}

void vd_session_say(vd_session *s, const vd_wire_message *message) {
    if (!post(s, 0, message, 1)) {
        end(s);
    }
}

void vd_session_fail(vd_session *s, vd_wire_fault code, const char *sentence) {
    if (s->state != VD_SESSION_OVER) {
        const vd_wire_message error = {.kind = VD_WIRE_ERROR, .as.error = {code, sentence}};
        (void)post(s, 0, &error, 1);
        end(s);
    }
}

/* ---- batches ----------------------------------------------------------------------------------*/

static void send(vd_session *s, const vd_wire_message *messages, int count, double now_s) {
    if (s->state == VD_SESSION_OVER) {
        return;
    }
    if (!post(s, s->batch + 1, messages, count)) {
        vd_session_fail(s, VD_WIRE_FAULT_INTERNAL,
                        "a picture could not be sent; connect again, or ask for a smaller screen");
        return;
    }
    const double wanted = s->settings.bytes_per_s, most = s->def.bytes_per_s;
    const double limit = wanted > 0.0 && (most <= 0.0 || wanted < most) ? wanted : most;
    s->batch++;
    s->turn_bytes += s->packets.last->bytes;
    s->stats.batches++;
    vd_link_sent(&s->link, s->batch, s->packets.last->bytes, limit, now_s);
}

void vd_session_flush(vd_session *s, double now_s) {
    if (s->message_count > 0) {
        send(s, s->messages, s->message_count, now_s);
    }
    s->message_count = 0;
    s->message_bytes = s->arena_used = 0;
}

void vd_session_add(vd_session *s, const vd_wire_message *message, double now_s) {
    const vd_status status = vd_wire_check(VD_WIRE_SERVER, message);
    if (status.code != VD_OK) {
        vd_log(s->context, VD_LOG_WARNING, "not sent: %.300s", status.message);
        return;
    }
    const size_t bytes = vd_wire_message_bytes(message);
    if (s->message_count == VD_SESSION_MESSAGES || s->message_bytes + bytes > BATCH_ROOM) {
        vd_session_flush(s, now_s);
    }
    if (bytes > BATCH_ROOM) {
        send(s, message, 1, now_s);
        return;
    }
    s->messages[s->message_count++] = *message;
    s->message_bytes += bytes;
}

/* ---- pictures ---------------------------------------------------------------------------------*/

unsigned vd_session_codecs(const vd_session *s) {
    const unsigned can = s->hello.capabilities & VD_CODEC_ALL;
    const unsigned wants = s->settings.codecs != 0 ? can & s->settings.codecs : can;
    return wants != 0 ? wants : VD_CODEC_BIT(VD_CODEC_RAW);
}

double vd_session_seconds(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

/* Room in the tools' memory; false when there is none. */
static bool reserve_packed(vd_session_tools *tools, size_t room) {
    if (room > tools->packed_bytes) {
        vd_release(tools->context, tools->packed);
        tools->packed = vd_allocate(tools->context, room, 1);
        tools->packed_bytes = tools->packed != NULL ? room : 0;
    }
    return tools->packed != NULL;
}

/* Packs into the tools' memory and learns what it cost. */
static vd_status pack(vd_session *s, const vd_codec_picture *picture, vd_encode_def *def,
                      vd_encoded *out) {
    vd_session_tools *tools = s->def.tools;
    const size_t room = vd_codec_bound(def->codec, picture->width, picture->height);
    if (!reserve_packed(tools, room)) {
        return vd_failure(VD_ERROR_MEMORY, "not enough memory to pack %zu bytes; free some", room);
    }
    const double start_s = vd_session_seconds();
    const vd_status status = vd_coder_encode(tools->coder, def, picture, tools->packed, room, out);
    if (status.code == VD_OK) {
        vd_codec_costs_learn(&tools->costs, out->codec,
                             (size_t)picture->width * (size_t)picture->height, out->bytes,
                             1e9 * (vd_session_seconds() - start_s), (double)NAN);
    }
    return status;
}

static vd_encode_def packing(const vd_session *s, bool lossless) {
    vd_encode_def def = vd_encode_def_default();
    def.allowed = vd_session_codecs(s);
    def.lossless = lossless;
    def.quality = s->settings.quality;
    def.link_bytes_per_s = s->link.bytes_per_s;
    def.costs = &s->def.tools->costs;
    return def;
}

/* Packs the picture of an impostor, unless it was packed before, for another client. Its bytes are
 * borrowed until the next packing. */
static vd_status pack_item(vd_session *s, const vd_impostor_item *item, bool lossless,
                           const uint8_t **data, vd_encoded *out) {
    vd_session_tools *tools = s->def.tools;
    const vd_quad_picture *p = &item->picture;
    const vd_codec_picture picture = {p->rgba, p->width, p->height, p->stride};
    vd_encode_def def = packing(s, lossless);
    def.codec = vd_codec_choose(def.costs, def.allowed, def.lossless, def.link_bytes_per_s,
                                p->width, p->height);
    const vd_packed *known = vd_packed_find(&tools->sent, item->shared, def.codec, def.quality);
    if (known != NULL) {
        *out = (vd_encoded){known->codec, known->bytes};
        *data = known->data;
        return vd_success();
    }
    const vd_status status = pack(s, &picture, &def, out);
    *data = tools->packed;
    if (status.code == VD_OK && s->clients > 1) {
        const vd_packed packed = {item->shared, def.codec, def.quality, out->bytes, tools->packed};
        vd_packed_keep(tools->context, &tools->sent, &packed);
    }
    return status;
}

/* Corners from the quad's middle: floats that are as small as they can be. */
static void place(const vd_vec3 corners[4], vd_wire_impostor *out) {
    out->origin = vd_vec3_scale(vd_vec3_add(corners[0], corners[2]), 0.5);
    for (int i = 0; i < 4; i++) {
        const vd_vec3 way = vd_vec3_subtract(corners[i], out->origin);
        out->corners[i][0] = (float)way.x;
        out->corners[i][1] = (float)way.y;
        out->corners[i][2] = (float)way.z;
    }
}

/* A model is larger than most pictures: it is packed where pictures are, and goes at once. */
static void add_model(vd_session *s, const vd_impostor_item *item, double now_s) {
    const size_t bytes = vd_model_packed_bytes(item->model);
    if (!reserve_packed(s->def.tools, bytes)) {
        vd_session_fail(s, VD_WIRE_FAULT_INTERNAL, "the server is out of memory; try again later");
        return;
    }
    vd_model_pack(item->model, s->def.tools->packed);
    vd_wire_message message = {.kind = VD_WIRE_GEOMETRY};
    message.as.geometry = (vd_wire_geometry){.id = item->id,
                                             .version = item->version,
                                             .kind = VD_WIRE_MODEL,
                                             .block = {s->def.tools->packed, bytes}};
    vd_session_add(s, &message, now_s);
    vd_session_flush(s, now_s); /* the memory is used again */
}

static void add_instance(vd_session *s, const vd_impostor_item *item, double now_s) {
    vd_wire_message message = {.kind = VD_WIRE_INSTANCE};
    message.as.instance = (vd_wire_instance){
        .id = item->id, .version = item->version, .model = item->model_id, .place = item->place};
    vd_session_add(s, &message, now_s);
}

/* The block is the set's until the turn ends. */
static void add_brick(vd_session *s, const vd_impostor_item *item, double now_s) {
    vd_wire_message message = {.kind = VD_WIRE_GEOMETRY};
    message.as.geometry = (vd_wire_geometry){.id = item->id,
                                             .version = item->version,
                                             .kind = VD_WIRE_BRICK,
                                             .origin = item->place.origin,
                                             .block = {item->block, item->block_bytes}};
    vd_session_add(s, &message, now_s);
}

static void add_picture(vd_session *s, const vd_impostor_item *item, bool fixed, double now_s) {
    const vd_quad_picture *p = &item->picture;
    const uint8_t *data = NULL;
    vd_encoded encoded;
    const vd_status status =
        pack_item(s, item, fixed || s->settings.quality == 100, &data, &encoded);
    if (status.code != VD_OK) {
        vd_session_fail(s, VD_WIRE_FAULT_INTERNAL, status.message);
        return;
    }
    vd_wire_message message = {.kind = VD_WIRE_IMPOSTOR};
    vd_wire_impostor *out = &message.as.impostor;
    *out = (vd_wire_impostor){.id = item->id,
                              .version = item->version,
                              .nearer = 1.0f,
                              .width = p->width,
                              .height = p->height,
                              .codec = encoded.codec,
                              .picture = {data, encoded.bytes},
                              .fixed = fixed};
    memcpy(out->opaque, p->opaque, sizeof out->opaque);
    place(item->corners, out);
    const size_t bytes = vd_wire_message_bytes(&message);
    if (s->message_bytes + bytes > BATCH_ROOM) {
        vd_session_flush(s, now_s);
    }
    if (bytes <= BATCH_ROOM) { /* kept until the batch is full */
        uint8_t *kept = s->arena + s->arena_used;
        memcpy(kept, data, encoded.bytes);
        out->picture.data = kept;
        s->arena_used += encoded.bytes;
    }
    s->stats.pictures++;
    vd_session_add(s, &message, now_s);
}

void vd_session_add_item(vd_session *s, const vd_impostor_item *item, double now_s) {
    switch (item->kind) {
    case VD_IMPOSTOR_MODEL:
        add_model(s, item, now_s);
        break;
    case VD_IMPOSTOR_INSTANCE:
        add_instance(s, item, now_s);
        break;
    case VD_IMPOSTOR_BRICK:
        add_brick(s, item, now_s);
        break;
    default:
        add_picture(s, item, false, now_s);
        break;
    }
}

void vd_session_add_fixed(vd_session *s, const vd_impostor_item *item, double now_s) {
    add_picture(s, item, true, now_s);
}

/* ---- screens ----------------------------------------------------------------------------------*/

/* The next one's quality: a step towards a size that the link takes SCREENS_PER_S times. */
static void adapt(vd_session *s, size_t bytes) {
    const double link = s->link.bytes_per_s > 0.0 ? s->link.bytes_per_s : UNMEASURED_BYTES_PER_S;
    const double limit =
        s->def.bytes_per_s > 0.0 && s->def.bytes_per_s < link ? s->def.bytes_per_s : link;
    const double wanted = limit / SCREENS_PER_S;
    const int most = s->settings.quality != 0 && s->settings.quality < MOST_QUALITY
                         ? s->settings.quality
                         : MOST_QUALITY;
    const int step = (double)bytes > 1.25 * wanted ? -7 : (double)bytes < 0.75 * wanted ? 4 : 0;
    s->quality += step;
    s->quality = s->quality > most ? most : s->quality;
    s->quality = s->quality < LEAST_QUALITY ? LEAST_QUALITY : s->quality;
}

bool vd_session_send_screen(vd_session *s, const vd_frame *frame, bool exact, double now_s) {
    const vd_codec_picture picture = {frame->rgba, frame->width, frame->height, frame->stride};
    const unsigned codecs = vd_session_codecs(s);
    vd_encode_def def = packing(s, exact);
    if (!exact) {
        def.quality = s->quality;
        def.codec = (codecs & VD_CODEC_BIT(VD_CODEC_JPEG)) != 0   ? VD_CODEC_JPEG
                    : (codecs & VD_CODEC_BIT(VD_CODEC_WEBP)) != 0 ? VD_CODEC_WEBP
                                                                  : VD_CODEC_AUTO;
    }
    vd_encoded encoded;
    const vd_status status = pack(s, &picture, &def, &encoded);
    if (status.code != VD_OK) {
        vd_session_fail(s, VD_WIRE_FAULT_INTERNAL, status.message);
        return false;
    }
    if (encoded.bytes > VD_WIRE_SCREEN_BYTES) {
        return false;
    }
    vd_wire_message message = {.kind = VD_WIRE_SCREEN};
    message.as.screen = (vd_wire_screen){.camera = s->camera.sequence,
                                         .codec = encoded.codec,
                                         .exact = exact && vd_codec_is_lossless(encoded.codec),
                                         .width = frame->width,
                                         .height = frame->height,
                                         .picture = {s->def.tools->packed, encoded.bytes}};
    vd_session_flush(s, now_s);
    vd_session_add(s, &message, now_s);
    vd_session_flush(s, now_s); /* the memory is used again */
    s->stats.screens++;
    if (!exact) {
        adapt(s, encoded.bytes);
    }
    return true;
}

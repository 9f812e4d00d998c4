/* Any bytes to a server's session and to the client's half: an end with a sentence, or they go on.
 *
 * The first byte: bit 0 to whom, bit 1 whether hello was said before, bit 2 whether the rest is one
 * envelope; else there are several, each behind two bytes with its length. */
#include <stdlib.h>
#include <string.h>
#include "remote/mirror.h"
#include "remote/session.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

enum { SIDE = 48 };

typedef struct lab {
    vd_context *context;
    vd_heightfield *map;
    vd_world *world;
    vd_world_renderer *renderer;
    vd_session_tools tools;
    vd_wire *wire;
    vd_wire_buffer buffer;
    vd_frame *frame;
    vd_camera camera;
} lab;

static void must(vd_status status) {
    if (status.code != VD_OK) {
        abort();
    }
}

/* Kept from input to input, as by a server. */
static lab *open_lab(void) {
    static lab l;
    static float heights[8 * 8];
    if (l.frame != NULL) {
        return &l;
    }
    const vd_context_def one = {.threads = 1};
    must(vd_context_create(&one, &l.context));
    vd_heightfield_def map = vd_heightfield_def_default();
    map.width = map.height = 8;
    map.height_stride = 8;
    map.type = VD_HEIGHT_F32;
    map.heights = heights;
    must(vd_heightfield_create(l.context, &map, &l.map));
    vd_world_def world = vd_world_def_default();
    world.terrain.heightfield = l.map;
    must(vd_world_create(l.context, &world, &l.world));
    must(vd_world_arrange(l.world, NULL));
    must(vd_world_renderer_create(l.context, NULL, l.world, NULL, &l.renderer));
    must(vd_session_tools_init(l.context, &l.tools));
    must(vd_wire_create(l.context, &l.wire));
    l.camera = (vd_camera){.eye = {4, -4, 9}, .near_m = 0.1};
    l.camera.orientation = vd_orientation_from_angles(0.0, -1.2, 0.0);
    l.camera.lens = vd_lens_from_fov(1.0, SIDE, SIDE);
    must(vd_frame_create(l.context, SIDE, SIDE, 0, &l.frame));
    return &l;
}

static void hello(lab *l, vd_wire_side from) {
    const vd_wire_message m = {.kind = VD_WIRE_HELLO,
                               .as.hello = {.version = VD_WIRE_VERSION,
                                            .capabilities = VD_CODEC_ALL | VD_WIRE_SCREENS,
                                            .memory_bytes = from == VD_WIRE_CLIENT ? 4u << 20 : 0,
                                            .width = from == VD_WIRE_CLIENT ? SIDE : 0,
                                            .height = from == VD_WIRE_CLIENT ? SIDE : 0}};
    must(vd_wire_encode(l->wire, from, 0, &m, 1, &l->buffer));
}

/* The next envelope of an input; false at its end. */
static bool next(const uint8_t **data, size_t *size, bool whole, const uint8_t **out,
                 size_t *bytes) {
    if (*size == 0) {
        return false;
    }
    *bytes = *size;
    *out = *data;
    if (!whole && *size > 2) {
        const size_t length = (size_t)(*data)[0] | (size_t)(*data)[1] << 8;
        *out = *data + 2;
        *bytes = length < *size - 2 ? length : *size - 2;
        *size -= 2;
        *data += 2;
    }
    *data += *bytes;
    *size -= *bytes;
    return true;
}

static void to_server(lab *l, const uint8_t *data, size_t size, bool greeted, bool whole) {
    vd_session_def def = vd_session_def_default();
    vd_session *session = NULL;
    double now_s = 1.0;
    def.world = l->world;
    def.renderer = l->renderer;
    def.tools = &l->tools;
    def.memory_bytes = (size_t)4 << 20;
    def.budget_s = 1e-3;
    def.most_pixels = (size_t)SIDE * SIDE; /* larger screens are refused, not drawn for minutes */
    must(vd_session_create(&def, now_s, &session));
    if (greeted) {
        hello(l, VD_WIRE_CLIENT);
        vd_session_receive(session, l->buffer.data, l->buffer.bytes, now_s);
    }
    const uint8_t *envelope;
    size_t bytes;
    for (int i = 0; i < 16 && next(&data, &size, whole, &envelope, &bytes); i++) {
        vd_session_receive(session, envelope, bytes, now_s);
        now_s += 0.2;
        vd_session_work(session, NULL, now_s);
        for (vd_packet *p = vd_session_take(session); p != NULL; p = vd_session_take(session)) {
            vd_wire_envelope said; /* what a server says is right whatever it heard */
            must(
                vd_wire_decode(l->wire, VD_WIRE_SERVER, p->data + VD_PACKET_HEAD, p->bytes, &said));
            vd_release(l->context, p);
        }
    }
    vd_session_destroy(&session);
}

static void to_client(lab *l, const uint8_t *data, size_t size, bool greeted, bool whole) {
    const vd_client_def usual = vd_client_def_default();
    const vd_mirror_def def = {
        .memory_bytes = (size_t)4 << 20, .settings = usual.settings, .particles = 4096};
    vd_mirror *mirror = NULL;
    vd_client_news news;
    double now_s = 1.0;
    must(vd_mirror_create(l->context, &def, &mirror));
    vd_mirror_look(mirror, &l->camera, SIDE, SIDE);
    vd_mirror_open(mirror, now_s);
    if (greeted) {
        hello(l, VD_WIRE_SERVER);
        vd_mirror_receive(mirror, l->buffer.data, l->buffer.bytes, now_s);
        vd_mirror_work(mirror, now_s);
    }
    const uint8_t *envelope;
    size_t bytes;
    for (int i = 0; i < 16 && next(&data, &size, whole, &envelope, &bytes); i++) {
        vd_mirror_receive(mirror, envelope, bytes, now_s += 0.2);
        vd_mirror_work(mirror, now_s);
        for (vd_packet *p = vd_mirror_take(mirror); p != NULL; p = vd_mirror_take(mirror)) {
            vd_wire_envelope said;
            must(
                vd_wire_decode(l->wire, VD_WIRE_CLIENT, p->data + VD_PACKET_HEAD, p->bytes, &said));
            vd_release(l->context, p);
        }
        must(vd_mirror_draw(mirror, NULL, &l->camera, l->frame, NULL));
    }
    vd_mirror_get_news(mirror, &news);
    if (news.held_bytes > def.memory_bytes ||
        (news.state >= VD_CLIENT_LOST && news.sentence[0] == '\0')) {
        abort();
    }
    vd_mirror_destroy(&mirror);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    if (size == 0) {
        return 0;
    }
    lab *l = open_lab();
    const bool greeted = (data[0] & 2) != 0, whole = (data[0] & 4) != 0;
    (data[0] & 1 ? to_client : to_server)(l, data + 1, size - 1, greeted, whole);
    return 0;
}

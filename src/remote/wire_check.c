/* wire_check.c: the bounds of every message (veduta.proto), for what is sent and what has come. */
#include <veduta/wire.h>

#include <math.h>
#include <string.h>
#include "core/utf8.h"

#define MOST_COORDINATE 1e9
#define MOST_CORNER 1e7
#define MOST_NUMBER 1e15
#define MOST_METRES 1e6 /* of an instance */
#define MOST_LIGHT 1e6
#define MOST_HAZE_M 1e12
#define UNIT_TOLERANCE 1e-6
#define SENTENCE_BYTES (VD_MESSAGE_BYTES)

/* ---- who says what ----------------------------------------------------------------------------*/

enum { C = 1 << VD_WIRE_CLIENT, S = 1 << VD_WIRE_SERVER };

static const struct {
    const char *name;
    int sides;
} kinds[VD_WIRE_KIND_COUNT] = {
    [VD_WIRE_NONE] = {"none", 0},         [VD_WIRE_HELLO] = {"hello", C | S},
    [VD_WIRE_CAMERA] = {"camera", C},     [VD_WIRE_IMPOSTOR] = {"impostor", S},
    [VD_WIRE_ORDER] = {"order", S},       [VD_WIRE_GEOMETRY] = {"geometry", S},
    [VD_WIRE_REPLACE] = {"replace", S},   [VD_WIRE_DROP] = {"drop", C | S},
    [VD_WIRE_SCREEN] = {"screen", S},     [VD_WIRE_ACKNOWLEDGE] = {"acknowledge", C},
    [VD_WIRE_STATS] = {"stats", C | S},   [VD_WIRE_ERROR] = {"error", C | S},
    [VD_WIRE_PING] = {"ping", C | S},     [VD_WIRE_PONG] = {"pong", C | S},
    [VD_WIRE_BYE] = {"bye", C | S},       [VD_WIRE_SETTINGS] = {"settings", C},
    [VD_WIRE_INSTANCE] = {"instance", S}, [VD_WIRE_LIGHT] = {"light", S},
    [VD_WIRE_GROUND] = {"ground", S},
};

const char *vd_wire_kind_name(vd_wire_kind kind) {
    return (unsigned)kind < VD_WIRE_KIND_COUNT ? kinds[kind].name : NULL;
}

bool vd_wire_may_send(vd_wire_side side, vd_wire_kind kind) {
    return (unsigned)kind < VD_WIRE_KIND_COUNT && (unsigned)side < VD_WIRE_SIDE_COUNT &&
           (kinds[kind].sides >> side & 1) != 0;
}

/* ---- numbers, strings, lists ------------------------------------------------------------------*/

/* `field` is "message.field". */
static vd_status check_number(const char *field, double value, double least, double most) {
    if (value >= least && value <= most) { /* false for NaN */
        return vd_success();
    }
    return vd_failure(VD_ERROR_ARGUMENT, "%s is %g; %g to %g is possible", field, value, least,
                      most);
}

static vd_status check_count(const char *field, uint64_t value, uint64_t least, uint64_t most) {
    if (value >= least && value <= most) {
        return vd_success();
    }
    return vd_failure(VD_ERROR_ARGUMENT, "%s is %llu; %llu to %llu is possible", field,
                      (unsigned long long)value, (unsigned long long)least,
                      (unsigned long long)most);
}

static vd_status check_text(const char *field, const char *text, size_t most) {
    if (text == NULL) {
        return vd_success();
    }
    size_t bytes = 0;
    for (int step; text[bytes] != '\0' && bytes <= most; bytes += (size_t)step) {
        step = vd_utf8_bytes(text + bytes);
        if (step == 0) {
            return vd_failure(VD_ERROR_ARGUMENT, "%s is not UTF-8 at byte %zu", field, bytes);
        }
    }
    return bytes <= most
               ? vd_success()
               : vd_failure(VD_ERROR_ARGUMENT, "%s is longer than %zu bytes", field, most);
}

static vd_status check_vector(const char *field, vd_vec3 v) {
    const double xyz[3] = {v.x, v.y, v.z};
    vd_status status = vd_success();
    for (int i = 0; i < 3 && status.code == VD_OK; i++) {
        status = check_number(field, xyz[i], -MOST_COORDINATE, MOST_COORDINATE);
    }
    return status;
}

static vd_status check_ids(const char *field, const vd_wire_ids *list, uint64_t least,
                           uint64_t most, bool ascending) {
    if (list->count < 0 || (list->count > 0 && list->ids == NULL)) {
        return vd_failure(VD_ERROR_ARGUMENT, "%s has a count of %d and no list", field,
                          list->count);
    }
    if ((uint64_t)list->count < least || (uint64_t)list->count > most) {
        return vd_failure(VD_ERROR_ARGUMENT, "%s has %d ids; %llu to %llu are possible", field,
                          list->count, (unsigned long long)least, (unsigned long long)most);
    }
    for (int i = 0; i < list->count; i++) {
        if (list->ids[i] == 0) {
            return vd_failure(VD_ERROR_ARGUMENT, "%s has the id 0 in place %d", field, i);
        }
        if (ascending && i > 0 && list->ids[i] <= list->ids[i - 1]) {
            return vd_failure(VD_ERROR_ARGUMENT, "%s does not ascend in place %d", field, i);
        }
    }
    return vd_success();
}

static vd_status check_id(const char *field, uint64_t id) {
    return id != 0 ? vd_success() : vd_failure(VD_ERROR_ARGUMENT, "%s is 0", field);
}

/* The size, codec and bytes of a picture: `fields` are "message.width", .height, .codec, .picture.
 */
static vd_status check_picture(const char *const fields[4], int width, int height, int least_side,
                               size_t most_pixels, vd_codec codec, const vd_wire_bytes *picture,
                               size_t most_bytes) {
    vd_status status = check_number(fields[0], width, least_side, VD_CODEC_MAX_SIDE);
    if (status.code == VD_OK) {
        status = check_number(fields[1], height, least_side, VD_CODEC_MAX_SIDE);
    }
    if (status.code == VD_OK && (size_t)width * (size_t)height > most_pixels) {
        status = vd_failure(VD_ERROR_ARGUMENT, "%s × height is %d × %d; %zu pixels are possible",
                            fields[0], width, height, most_pixels);
    }
    if (status.code == VD_OK) {
        status = check_number(fields[2], (double)codec, VD_CODEC_RAW, VD_CODEC_COUNT - 1);
    }
    if (status.code != VD_OK) {
        return status;
    }
    const size_t bound = vd_codec_bound(codec, width, height);
    const size_t most = bound < most_bytes ? bound : most_bytes;
    const size_t least = codec == VD_CODEC_RAW ? bound : 1;
    if (picture->data == NULL || picture->bytes < least || picture->bytes > most) {
        return vd_failure(
            VD_ERROR_ARGUMENT, "%s has %zu bytes; a %s picture of %d × %d pixels has %zu to %zu",
            fields[3], picture->bytes, vd_codec_name(codec), width, height, least, most);
    }
    return status;
}

/* ---- each message -----------------------------------------------------------------------------*/

/* Runs a check when those before it went well. */
#define THEN(check)                                                                                \
    if (status.code == VD_OK) {                                                                    \
        status = check;                                                                            \
    }

static vd_status check_hello(vd_wire_side side, const vd_wire_hello *m) {
    const bool client = side == VD_WIRE_CLIENT;
    const double most_side = client ? VD_CODEC_MAX_SIDE : 0;
    vd_status status = check_count("hello.version", m->version, 1, 65535);
    THEN(check_text("hello.token", m->token, client ? VD_WIRE_TOKEN_BYTES : 0))
    THEN(check_count("hello.memory_bytes", m->memory_bytes, client ? VD_WIRE_LEAST_MEMORY : 0,
                     client ? VD_WIRE_MOST_MEMORY : 0))
    THEN(check_count("hello.particles", m->particles, 0, client ? VD_PLACED_PARTICLES : 0))
    THEN(check_number("hello.width", m->width, client ? 1 : 0, most_side))
    THEN(check_number("hello.height", m->height, client ? 1 : 0, most_side))
    THEN(check_text("hello.name", m->name, VD_WIRE_TOKEN_BYTES))
    THEN(check_ids("hello.held_ids", &m->held, 0, client ? VD_WIRE_MAX_IDS : 0, true))
    if (status.code == VD_OK && m->held.count > 0 && m->held_versions == NULL) {
        status = vd_failure(VD_ERROR_ARGUMENT, "hello.held_versions is missing");
    }
    for (int i = 0; i < m->held.count && status.code == VD_OK; i++) {
        status = check_count("hello.held_versions", m->held_versions[i], 1, UINT32_MAX);
    }
    return status;
}

static vd_status check_camera(const vd_wire_camera *m) {
    const vd_camera *c = &m->camera;
    const vd_quat q = c->orientation;
    const double length = q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w;
    vd_status status = check_count("camera.sequence", m->sequence, 1, UINT32_MAX);
    THEN(check_vector("camera.eye", c->eye))
    THEN(check_number("camera.orientation's squared length", length, 1 - UNIT_TOLERANCE,
                      1 + UNIT_TOLERANCE))
    THEN(check_number("camera.projection", (double)c->projection, VD_PROJECTION_PERSPECTIVE,
                      VD_PROJECTION_PERSPECTIVE))
    THEN(check_number("camera.fx", c->lens.fx, 1e-3, 1e6))
    THEN(check_number("camera.fy", c->lens.fy, 1e-3, 1e6))
    THEN(check_number("camera.cx", c->lens.cx, -1e6, 1e6))
    THEN(check_number("camera.cy", c->lens.cy, -1e6, 1e6))
    THEN(check_number("camera.near", c->near_m, 1e-6, 1e6))
    THEN(check_number("camera.width", m->width, 1, VD_CODEC_MAX_SIDE))
    THEN(check_number("camera.height", m->height, 1, VD_CODEC_MAX_SIDE))
    THEN(check_number("camera.time", m->time_s, 0, 1e12))
    return status;
}

/* The third corner is the second and the fourth less the first. */
static vd_status check_corners(const float p[4][3]) {
    double longest = 0, largest = 0, off = 0;
    for (int k = 0; k < 3; k++) {
        for (int i = 0; i < 4; i++) {
            const vd_status status =
                check_number("impostor.corners", (double)p[i][k], -MOST_CORNER, MOST_CORNER);
            if (status.code != VD_OK) {
                return status;
            }
            largest = fmax(largest, fabs((double)p[i][k]));
        }
        const double along = fabs((double)p[1][k] - (double)p[0][k]);
        const double down = fabs((double)p[3][k] - (double)p[0][k]);
        longest = fmax(longest, fmax(along, down));
        off =
            fmax(off, fabs((double)p[2][k] - (double)p[1][k] - (double)p[3][k] + (double)p[0][k]));
    }
    if (off > 1e-3 * longest + 4e-7 * largest) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "impostor.corners are no parallelogram: the third is %g beside the "
                          "second and fourth less the first",
                          off);
    }
    return vd_success();
}

static vd_status check_impostor(const vd_wire_impostor *m) {
    static const char *const fields[4] = {"impostor.width", "impostor.height", "impostor.codec",
                                          "impostor.picture"};
    vd_status status = check_id("impostor.id", m->id);
    THEN(check_count("impostor.version", m->version, 1, UINT32_MAX))
    THEN(check_vector("impostor.origin", m->origin))
    THEN(check_corners(m->corners))
    THEN(check_number("impostor.nearer", (double)m->nearer, 1, 1e6))
    THEN(check_picture(fields, m->width, m->height, 2, VD_WIRE_IMPOSTOR_PIXELS, m->codec,
                       &m->picture, VD_WIRE_PICTURE_BYTES))
    for (int k = 0; k < 2; k++) { /* across, down */
        const int low = m->opaque[k], high = m->opaque[k + 2];
        if (status.code == VD_OK &&
            (low < 0 || low > high || high > (k == 0 ? m->width : m->height))) {
            status = vd_failure(VD_ERROR_ARGUMENT,
                                "impostor.opaque goes from %d to %d in a picture of %d × %d", low,
                                high, m->width, m->height);
        }
    }
    return status;
}

static vd_status check_geometry(const vd_wire_geometry *m) {
    vd_status status = check_id("geometry.id", m->id);
    THEN(check_count("geometry.version", m->version, 1, UINT32_MAX))
    THEN(check_number("geometry.kind", (double)m->kind, VD_WIRE_MODEL,
                      VD_WIRE_GEOMETRY_KIND_COUNT - 1))
    THEN(check_vector("geometry.origin", m->origin))
    THEN(check_count("geometry.block's bytes", m->block.data != NULL ? m->block.bytes : 0, 1,
                     VD_WIRE_PICTURE_BYTES))
    return status;
}

static vd_status check_instance(const vd_wire_instance *m) {
    vd_status status = check_id("instance.id", m->id);
    THEN(check_count("instance.version", m->version, 1, UINT32_MAX))
    THEN(check_id("instance.model", m->model))
    THEN(check_vector("instance.origin", m->place.origin))
    THEN(check_number("instance.sun", (double)m->place.sun, 0, 1))
    for (int i = 0; i < 9; i++) {
        THEN(check_number("instance.axes", (double)m->place.axes[i / 3][i % 3], -MOST_METRES,
                          MOST_METRES))
    }
    for (int i = 0; i < 3 && m->place.has_ground; i++) {
        THEN(check_number("instance.ground", (double)m->place.ground[i], -MOST_METRES, MOST_METRES))
    }
    return status;
}

static vd_status check_light(const vd_light *m) {
    const vd_linear colors[4] = {m->sun, m->ambient_up, m->ambient_down, m->horizon};
    const vd_vec3 d = m->sun_direction;
    vd_status status = check_vector("light.sun_direction", d);
    THEN(check_number("light.sun_direction's squared length", vd_vec3_dot(d, d), 1 - UNIT_TOLERANCE,
                      1 + UNIT_TOLERANCE))
    for (int i = 0; i < 4; i++) {
        THEN(check_number("light.colors", (double)colors[i].r, 0, MOST_LIGHT))
        THEN(check_number("light.colors", (double)colors[i].g, 0, MOST_LIGHT))
        THEN(check_number("light.colors", (double)colors[i].b, 0, MOST_LIGHT))
    }
    THEN(check_number("light.haze_m", m->haze_m, 0, MOST_HAZE_M))
    return status;
}

static vd_status check_ground(const vd_wire_ground *m) {
    vd_status status = check_number("ground.x", m->x, -MOST_COORDINATE, MOST_COORDINATE);
    THEN(check_number("ground.y", m->y, -MOST_COORDINATE, MOST_COORDINATE))
    THEN(check_number("ground.step", m->step_m, 1e-3, MOST_METRES))
    THEN(check_number("ground.columns", m->columns, 2, VD_WIRE_GROUND_SIDE))
    THEN(check_number("ground.rows", m->rows, 2, VD_WIRE_GROUND_SIDE))
    if (status.code == VD_OK && m->heights == NULL) {
        status = vd_failure(VD_ERROR_ARGUMENT, "ground.heights is missing");
    }
    for (int i = 0; status.code == VD_OK && i < m->columns * m->rows; i++) {
        status = check_number("ground.heights", (double)m->heights[i], -MOST_COORDINATE,
                              MOST_COORDINATE);
    }
    return status;
}

static vd_status check_replace(const vd_wire_replace *m) {
    vd_status status = check_ids("replace.out", &m->out, 0, VD_WIRE_MAX_REPLACED, true);
    THEN(check_ids("replace.in", &m->in, 0, VD_WIRE_MAX_REPLACED, true))
    if (status.code == VD_OK && m->out.count == 0 && m->in.count == 0) {
        status = vd_failure(VD_ERROR_ARGUMENT, "replace.out and .in are both empty");
    }
    for (int i = 0, o = 0; status.code == VD_OK && i < m->in.count && o < m->out.count;) {
        if (m->in.ids[i] == m->out.ids[o]) {
            status = vd_failure(VD_ERROR_ARGUMENT, "replace.in and .out both have the id %llu",
                                (unsigned long long)m->in.ids[i]);
        } else if (m->in.ids[i] < m->out.ids[o]) {
            i++;
        } else {
            o++;
        }
    }
    return status;
}

static vd_status check_screen(const vd_wire_screen *m) {
    static const char *const fields[4] = {"screen.width", "screen.height", "screen.codec",
                                          "screen.picture"};
    vd_status status = check_count("screen.camera", m->camera, 1, UINT32_MAX);
    THEN(check_picture(fields, m->width, m->height, 1, VD_CODEC_MAX_PIXELS, m->codec, &m->picture,
                       VD_WIRE_SCREEN_BYTES))
    if (status.code == VD_OK && m->exact && !vd_codec_is_lossless(m->codec)) {
        status = vd_failure(VD_ERROR_ARGUMENT, "screen.exact is said of a %s picture, which is not",
                            vd_codec_name(m->codec));
    }
    return status;
}

static vd_status check_stats(const vd_wire_stats *m) {
    vd_status status = check_number("stats.frames_per_s", m->frames_per_s, 0, MOST_NUMBER);
    THEN(check_number("stats.frame_p99_s", m->frame_p99_s, 0, MOST_NUMBER))
    THEN(check_number("stats.decode_s", m->decode_s, 0, MOST_NUMBER))
    THEN(check_number("stats.error_px", m->error_px, 0, MOST_NUMBER))
    THEN(check_number("stats.link_bytes_per_s", m->link_bytes_per_s, 0, MOST_NUMBER))
    THEN(check_number("stats.latency_s", m->latency_s, 0, MOST_NUMBER))
    THEN(check_count("stats.queued_bytes", m->queued_bytes, 0, (uint64_t)MOST_NUMBER))
    THEN(check_count("stats.shown", m->shown, 0, (uint64_t)MOST_NUMBER))
    THEN(check_count("stats.clients", m->clients, 0, (uint64_t)MOST_NUMBER))
    return status;
}

static vd_status check_settings(const vd_wire_settings *m) {
    vd_status status = check_number("settings.mode", (double)m->mode, VD_WIRE_MODE_IMPOSTORS,
                                    VD_WIRE_MODE_COUNT - 1);
    THEN(check_number("settings.tolerance_px", (double)m->tolerance_px, 0, 64))
    THEN(check_number("settings.quality", m->quality, 0, 100))
    THEN(check_number("settings.bytes_per_s", m->bytes_per_s, 0, 1e12))
    if (status.code == VD_OK && (m->codecs & ~(unsigned)VD_CODEC_ALL) != 0) {
        status = vd_failure(VD_ERROR_ARGUMENT, "settings.codecs is %#x; bits of %#x are possible",
                            m->codecs, (unsigned)VD_CODEC_ALL);
    }
    return status;
}

static vd_status check_ending(const char *code_field, unsigned code, unsigned count,
                              const char *text_field, const char *text) {
    vd_status status = check_count(code_field, code, 1, count - 1);
    THEN(check_text(text_field, text, SENTENCE_BYTES))
    return status;
}

static vd_status check_acknowledge(const vd_wire_acknowledge *m) {
    vd_status status = check_count("acknowledge.batch", m->batch, 1, UINT32_MAX);
    THEN(check_count("acknowledge.held_bytes", m->held_bytes, 0, VD_WIRE_MOST_MEMORY))
    return status;
}

static vd_status check_order(const vd_wire_order *m) {
    return check_ids("order.ids", &m->ids, 0, VD_WIRE_MAX_IDS, false);
}

vd_status vd_wire_check(vd_wire_side side, const vd_wire_message *message) {
    if (!vd_wire_may_send(side, message->kind)) {
        const char *name = vd_wire_kind_name(message->kind);
        return vd_failure(VD_ERROR_ARGUMENT, "the message %s is not for a %s to send",
                          name != NULL ? name : "of an unknown kind",
                          side == VD_WIRE_CLIENT ? "client" : "server");
    }
    switch (message->kind) {
    case VD_WIRE_HELLO:
        return check_hello(side, &message->as.hello);
    case VD_WIRE_CAMERA:
        return check_camera(&message->as.camera);
    case VD_WIRE_IMPOSTOR:
        return check_impostor(&message->as.impostor);
    case VD_WIRE_ORDER:
        return check_order(&message->as.order);
    case VD_WIRE_GEOMETRY:
        return check_geometry(&message->as.geometry);
    case VD_WIRE_INSTANCE:
        return check_instance(&message->as.instance);
    case VD_WIRE_LIGHT:
        return check_light(&message->as.light.light);
    case VD_WIRE_GROUND:
        return check_ground(&message->as.ground);
    case VD_WIRE_REPLACE:
        return check_replace(&message->as.replace);
    case VD_WIRE_DROP:
        return check_ids("drop.ids", &message->as.drop, 1, VD_WIRE_MAX_IDS, true);
    case VD_WIRE_SCREEN:
        return check_screen(&message->as.screen);
    case VD_WIRE_ACKNOWLEDGE:
        return check_acknowledge(&message->as.acknowledge);
    case VD_WIRE_STATS:
        return check_stats(&message->as.stats);
    case VD_WIRE_ERROR:
        return check_ending("error.code", (unsigned)message->as.error.code, VD_WIRE_FAULT_COUNT,
                            "error.sentence", message->as.error.sentence);
    case VD_WIRE_BYE:
        return check_ending("bye.reason", (unsigned)message->as.bye.reason, VD_WIRE_REASON_COUNT,
                            "bye.sentence", message->as.bye.sentence);
    case VD_WIRE_SETTINGS:
        return check_settings(&message->as.settings);
    default: /* ping, pong: any stamp will do */
        return vd_success();
    }
}

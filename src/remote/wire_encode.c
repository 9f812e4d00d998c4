/* wire_encode.c: our structs as protobuf-c's. Nothing is copied: protobuf-c only reads, though its
 * structs have no const. */
#include "remote/wire_messages.h"

#include <string.h>

static char *text_of(const char *text) {
    return text != NULL ? (char *)text : (char *)"";
}

static ProtobufCBinaryData bytes_of(const vd_wire_bytes *bytes) {
    return (ProtobufCBinaryData){bytes->bytes, (uint8_t *)bytes->data};
}

static Veduta__Wire__Vector *vector_of(vd_vec3 v, vd_wire_record *r) {
    veduta__wire__vector__init(&r->vector);
    r->vector.x = v.x;
    r->vector.y = v.y;
    r->vector.z = v.z;
    return &r->vector;
}

static void hello(const vd_wire_hello *m, vd_wire_record *r) {
    Veduta__Wire__Hello *to = r->message.hello = &r->body.hello;
    veduta__wire__hello__init(to);
    to->version = m->version;
    to->capabilities = m->capabilities;
    to->token = text_of(m->token);
    to->memory_bytes = m->memory_bytes;
    to->particles = m->particles;
    to->width = (uint32_t)m->width;
    to->height = (uint32_t)m->height;
    to->name = text_of(m->name);
    to->n_held_ids = to->n_held_versions = (size_t)m->held.count;
    to->held_ids = (uint64_t *)m->held.ids;
    to->held_versions = (uint32_t *)m->held_versions;
}

static void camera(const vd_wire_camera *m, vd_wire_record *r) {
    Veduta__Wire__Camera *to = r->message.camera = &r->body.camera;
    veduta__wire__camera__init(to);
    to->sequence = m->sequence;
    to->eye = vector_of(m->camera.eye, r);
    to->qx = m->camera.orientation.x;
    to->qy = m->camera.orientation.y;
    to->qz = m->camera.orientation.z;
    to->qw = m->camera.orientation.w;
    to->fx = m->camera.lens.fx;
    to->fy = m->camera.lens.fy;
    to->cx = m->camera.lens.cx;
    to->cy = m->camera.lens.cy;
    to->near = m->camera.near_m;
    to->width = (uint32_t)m->width;
    to->height = (uint32_t)m->height;
    to->time = m->time_s;
}

static void impostor(const vd_wire_impostor *m, vd_wire_record *r) {
    Veduta__Wire__Impostor *to = r->message.impostor = &r->body.impostor;
    veduta__wire__impostor__init(to);
    to->id = m->id;
    to->version = m->version;
    to->origin = vector_of(m->origin, r);
    to->n_corners = 12;
    to->corners = (float *)&m->corners[0][0];
    to->nearer = m->nearer;
    to->width = (uint32_t)m->width;
    to->height = (uint32_t)m->height;
    for (int i = 0; i < 4; i++) {
        r->opaque[i] = (uint32_t)m->opaque[i];
        to->n_opaque = m->opaque[i] != 0 ? 4 : to->n_opaque;
    }
    to->opaque = r->opaque;
    to->codec = (uint32_t)m->codec;
    to->picture = bytes_of(&m->picture);
    to->fixed = m->fixed;
}

static void order(const vd_wire_order *m, vd_wire_record *r) {
    Veduta__Wire__Order *to = r->message.order = &r->body.order;
    veduta__wire__order__init(to);
    to->camera = m->camera;
    to->n_ids = (size_t)m->ids.count;
    to->ids = (uint64_t *)m->ids.ids;
}

static void geometry(const vd_wire_geometry *m, vd_wire_record *r) {
    Veduta__Wire__Geometry *to = r->message.geometry = &r->body.geometry;
    veduta__wire__geometry__init(to);
    to->id = m->id;
    to->version = m->version;
    to->kind = (uint32_t)m->kind;
    to->origin = vector_of(m->origin, r);
    to->block = bytes_of(&m->block);
}

static void instance(const vd_wire_instance *m, vd_wire_record *r) {
    Veduta__Wire__Instance *to = r->message.instance = &r->body.instance;
    veduta__wire__instance__init(to);
    to->id = m->id;
    to->version = m->version;
    to->model = m->model;
    to->origin = vector_of(m->place.origin, r);
    to->n_axes = 9;
    to->axes = (float *)&m->place.axes[0][0];
    to->sun = m->place.sun;
    to->n_ground = m->place.has_ground ? 3 : 0;
    to->ground = (float *)m->place.ground;
}

static void light(const vd_light *m, vd_wire_record *r) {
    const vd_linear colors[4] = {m->sun, m->ambient_up, m->ambient_down, m->horizon};
    Veduta__Wire__Light *to = r->message.light = &r->body.light;
    veduta__wire__light__init(to);
    for (int i = 0; i < 4; i++) {
        r->colors[3 * i] = colors[i].r;
        r->colors[3 * i + 1] = colors[i].g;
        r->colors[3 * i + 2] = colors[i].b;
    }
    to->sun_direction = vector_of(m->sun_direction, r);
    to->n_colors = 12;
    to->colors = r->colors;
    to->haze_m = m->haze_m;
}

static void ground(const vd_wire_ground *m, vd_wire_record *r) {
    Veduta__Wire__Ground *to = r->message.ground = &r->body.ground;
    veduta__wire__ground__init(to);
    to->x = m->x;
    to->y = m->y;
    to->step = m->step_m;
    to->columns = (uint32_t)m->columns;
    to->rows = (uint32_t)m->rows;
    to->n_heights = (size_t)m->columns * (size_t)m->rows;
    to->heights = (float *)m->heights;
}

static void replace(const vd_wire_replace *m, vd_wire_record *r) {
    Veduta__Wire__Replace *to = r->message.replace = &r->body.replace;
    veduta__wire__replace__init(to);
    to->n_out = (size_t)m->out.count;
    to->out = (uint64_t *)m->out.ids;
    to->n_in = (size_t)m->in.count;
    to->in = (uint64_t *)m->in.ids;
}

static void drop(const vd_wire_ids *m, vd_wire_record *r) {
    Veduta__Wire__Drop *to = r->message.drop = &r->body.drop;
    veduta__wire__drop__init(to);
    to->n_ids = (size_t)m->count;
    to->ids = (uint64_t *)m->ids;
}

static void screen(const vd_wire_screen *m, vd_wire_record *r) {
    Veduta__Wire__Screen *to = r->message.screen = &r->body.screen;
    veduta__wire__screen__init(to);
    to->camera = m->camera;
    to->codec = (uint32_t)m->codec;
    to->exact = m->exact;
    to->width = (uint32_t)m->width;
    to->height = (uint32_t)m->height;
    to->picture = bytes_of(&m->picture);
}

static void acknowledge(const vd_wire_acknowledge *m, vd_wire_record *r) {
    Veduta__Wire__Acknowledge *to = r->message.acknowledge = &r->body.acknowledge;
    veduta__wire__acknowledge__init(to);
    to->batch = m->batch;
    to->held_bytes = m->held_bytes;
}

static void stats(const vd_wire_stats *m, vd_wire_record *r) {
    Veduta__Wire__Stats *to = r->message.stats = &r->body.stats;
    veduta__wire__stats__init(to);
    to->frames_per_s = m->frames_per_s;
    to->frame_p99_s = m->frame_p99_s;
    to->decode_s = m->decode_s;
    to->error_px = m->error_px;
    to->link_bytes_per_s = m->link_bytes_per_s;
    to->latency_s = m->latency_s;
    to->queued_bytes = m->queued_bytes;
    to->shown = m->shown;
    to->clients = m->clients;
}

static void error(const vd_wire_error *m, vd_wire_record *r) {
    Veduta__Wire__Error *to = r->message.error = &r->body.error;
    veduta__wire__error__init(to);
    to->code = (uint32_t)m->code;
    to->sentence = text_of(m->sentence);
}

static void ping(const vd_wire_ping *m, vd_wire_record *r) {
    Veduta__Wire__Ping *to = r->message.ping = &r->body.ping;
    veduta__wire__ping__init(to);
    to->stamp = m->stamp;
}

static void bye(const vd_wire_bye *m, vd_wire_record *r) {
    Veduta__Wire__Bye *to = r->message.bye = &r->body.bye;
    veduta__wire__bye__init(to);
    to->reason = (uint32_t)m->reason;
    to->sentence = text_of(m->sentence);
}

static void settings(const vd_wire_settings *m, vd_wire_record *r) {
    Veduta__Wire__Settings *to = r->message.settings = &r->body.settings;
    veduta__wire__settings__init(to);
    to->mode = (uint32_t)m->mode;
    to->tolerance_px = m->tolerance_px;
    to->quality = (uint32_t)m->quality;
    to->codecs = m->codecs;
    to->bytes_per_s = m->bytes_per_s;
}

void vd_wire_to_record(const vd_wire_message *m, vd_wire_record *r) {
    veduta__wire__message__init(&r->message);
    r->message.body_case = (Veduta__Wire__Message__BodyCase)m->kind;
    switch (m->kind) {
    case VD_WIRE_HELLO:
        hello(&m->as.hello, r);
        break;
    case VD_WIRE_CAMERA:
        camera(&m->as.camera, r);
        break;
    case VD_WIRE_IMPOSTOR:
        impostor(&m->as.impostor, r);
        break;
    case VD_WIRE_ORDER:
        order(&m->as.order, r);
        break;
    case VD_WIRE_GEOMETRY:
        geometry(&m->as.geometry, r);
        break;
    case VD_WIRE_INSTANCE:
        instance(&m->as.instance, r);
        break;
    case VD_WIRE_LIGHT:
        light(&m->as.light.light, r);
        break;
    case VD_WIRE_GROUND:
        ground(&m->as.ground, r);
        break;
    case VD_WIRE_REPLACE:
        replace(&m->as.replace, r);
        break;
    case VD_WIRE_DROP:
        drop(&m->as.drop, r);
        break;
    case VD_WIRE_SCREEN:
        screen(&m->as.screen, r);
        break;
    case VD_WIRE_ACKNOWLEDGE:
        acknowledge(&m->as.acknowledge, r);
        break;
    case VD_WIRE_STATS:
        stats(&m->as.stats, r);
        break;
    case VD_WIRE_ERROR:
        error(&m->as.error, r);
        break;
    case VD_WIRE_PING:
    case VD_WIRE_PONG: /* of one type, in one union */
        ping(&m->as.ping, r);
        break;
    case VD_WIRE_BYE:
        bye(&m->as.bye, r);
        break;
    case VD_WIRE_SETTINGS:
        settings(&m->as.settings, r);
        break;
    default:
        r->message.body_case = VEDUTA__WIRE__MESSAGE__BODY__NOT_SET;
        break;
    }
}

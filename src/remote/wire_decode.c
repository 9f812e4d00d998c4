/* wire_decode.c: protobuf-c's structs as ours. */
#include "remote/wire_messages.h"

#include <limits.h>
#include <string.h>

/* What does not fit becomes -1, which no bound has. */
static int int_of(uint32_t value) {
    return value <= INT_MAX ? (int)value : -1;
}

/* Lists are as long as the envelope at most, which is less than an int. */
static vd_wire_ids ids_of(const uint64_t *ids, size_t count) {
    return (vd_wire_ids){count > 0 ? ids : NULL, (int)count};
}

static vd_wire_bytes bytes_of(ProtobufCBinaryData data) {
    return (vd_wire_bytes){data.data, data.len};
}

static vd_status take_vector(const char *field, const Veduta__Wire__Vector *from, vd_vec3 *to) {
    if (from == NULL) {
        return vd_failure(VD_ERROR_ARGUMENT, "%s is missing", field);
    }
    *to = vd_vec3_make(from->x, from->y, from->z);
    return vd_success();
}

static vd_status hello(const Veduta__Wire__Hello *from, vd_wire_hello *m) {
    if (from->n_held_ids != from->n_held_versions) {
        return vd_failure(VD_ERROR_ARGUMENT, "hello.held_versions has %zu numbers for %zu ids",
                          from->n_held_versions, from->n_held_ids);
    }
    *m = (vd_wire_hello){.version = from->version,
                         .capabilities = from->capabilities,
                         .token = from->token,
                         .memory_bytes = from->memory_bytes,
                         .particles = from->particles,
                         .width = int_of(from->width),
                         .height = int_of(from->height),
                         .name = from->name,
                         .held = ids_of(from->held_ids, from->n_held_ids),
                         .held_versions = from->held_versions};
    return vd_success();
}

static vd_status camera(const Veduta__Wire__Camera *from, vd_wire_camera *m) {
    *m = (vd_wire_camera){.sequence = from->sequence,
                          .camera = {.orientation = {from->qx, from->qy, from->qz, from->qw},
                                     .projection = VD_PROJECTION_PERSPECTIVE,
                                     .lens = {from->fx, from->fy, from->cx, from->cy},
                                     .near_m = from->near},
                          .width = int_of(from->width),
                          .height = int_of(from->height),
                          .time_s = from->time};
    return take_vector("camera.eye", from->eye, &m->camera.eye);
}

static vd_status impostor(const Veduta__Wire__Impostor *from, vd_wire_impostor *m) {
    if (from->n_corners != 12) {
        return vd_failure(VD_ERROR_ARGUMENT, "impostor.corners has %zu numbers, not 12",
                          from->n_corners);
    }
    if (from->n_opaque != 0 && from->n_opaque != 4) {
        return vd_failure(VD_ERROR_ARGUMENT, "impostor.opaque has %zu numbers, neither 0 nor 4",
                          from->n_opaque);
    }
    *m = (vd_wire_impostor){.id = from->id,
                            .version = from->version,
                            .nearer = from->nearer,
                            .width = int_of(from->width),
                            .height = int_of(from->height),
                            .codec = (vd_codec)int_of(from->codec),
                            .picture = bytes_of(from->picture),
                            .fixed = from->fixed != 0};
    memcpy(m->corners, from->corners, sizeof m->corners);
    for (size_t i = 0; i < from->n_opaque; i++) {
        m->opaque[i] = int_of(from->opaque[i]);
    }
    return take_vector("impostor.origin", from->origin, &m->origin);
}

static vd_status geometry(const Veduta__Wire__Geometry *from, vd_wire_geometry *m) {
    *m = (vd_wire_geometry){.id = from->id,
                            .version = from->version,
                            .kind = (vd_wire_geometry_kind)int_of(from->kind),
                            .block = bytes_of(from->block)};
    return take_vector("geometry.origin", from->origin, &m->origin);
}

static vd_status instance(const Veduta__Wire__Instance *from, vd_wire_instance *m) {
    if (from->n_axes != 9) {
        return vd_failure(VD_ERROR_ARGUMENT, "instance.axes has %zu numbers, not 9", from->n_axes);
    }
    if (from->n_ground != 0 && from->n_ground != 3) {
        return vd_failure(VD_ERROR_ARGUMENT, "instance.ground has %zu numbers, neither 0 nor 3",
                          from->n_ground);
    }
    *m = (vd_wire_instance){.id = from->id,
                            .version = from->version,
                            .model = from->model,
                            .place = {.sun = from->sun, .has_ground = from->n_ground == 3}};
    memcpy(m->place.axes, from->axes, sizeof m->place.axes);
    if (m->place.has_ground) {
        memcpy(m->place.ground, from->ground, sizeof m->place.ground);
    }
    return take_vector("instance.origin", from->origin, &m->place.origin);
}

static vd_status light(const Veduta__Wire__Light *from, vd_light *m) {
    const float *c = from->colors;
    if (from->n_colors != 12) {
        return vd_failure(VD_ERROR_ARGUMENT, "light.colors has %zu numbers, not 12",
                          from->n_colors);
    }
    *m = (vd_light){.sun = {c[0], c[1], c[2]},
                    .ambient_up = {c[3], c[4], c[5]},
                    .ambient_down = {c[6], c[7], c[8]},
                    .horizon = {c[9], c[10], c[11]},
                    .haze_m = from->haze_m};
    return take_vector("light.sun_direction", from->sun_direction, &m->sun_direction);
}

static vd_status ground(const Veduta__Wire__Ground *from, vd_wire_ground *m) {
    *m = (vd_wire_ground){.x = from->x,
                          .y = from->y,
                          .step_m = from->step,
                          .columns = int_of(from->columns),
                          .rows = int_of(from->rows),
                          .heights = from->heights};
    if ((uint64_t)from->columns * from->rows != from->n_heights) {
        return vd_failure(VD_ERROR_ARGUMENT, "ground.heights has %zu numbers for %u × %u",
                          from->n_heights, from->columns, from->rows);
    }
    return vd_success();
}

static void screen(const Veduta__Wire__Screen *from, vd_wire_screen *m) {
    *m = (vd_wire_screen){.camera = from->camera,
                          .codec = (vd_codec)int_of(from->codec),
                          .exact = from->exact != 0,
                          .width = int_of(from->width),
                          .height = int_of(from->height),
                          .picture = bytes_of(from->picture)};
}

static void stats(const Veduta__Wire__Stats *from, vd_wire_stats *m) {
    *m = (vd_wire_stats){
        from->frames_per_s,     from->frame_p99_s, from->decode_s,     from->error_px,
        from->link_bytes_per_s, from->latency_s,   from->queued_bytes, from->shown,
        from->clients};
}

static void error(const Veduta__Wire__Error *from, vd_wire_error *m) {
    const bool known = from->code >= 1 && from->code < VD_WIRE_FAULT_COUNT;
    *m =
        (vd_wire_error){known ? (vd_wire_fault)from->code : VD_WIRE_FAULT_INTERNAL, from->sentence};
}

static void bye(const Veduta__Wire__Bye *from, vd_wire_bye *m) {
    const bool known = from->reason >= 1 && from->reason < VD_WIRE_REASON_COUNT;
    *m = (vd_wire_bye){known ? (vd_wire_reason)from->reason : VD_WIRE_DONE, from->sentence};
}

static void settings(const Veduta__Wire__Settings *from, vd_wire_settings *m) {
    *m = (vd_wire_settings){.mode = (vd_wire_mode)int_of(from->mode),
                            .tolerance_px = from->tolerance_px,
                            .quality = int_of(from->quality),
                            .codecs = from->codecs,
                            .bytes_per_s = from->bytes_per_s};
}

vd_status vd_wire_from_message(const Veduta__Wire__Message *from, vd_wire_message *m) {
    m->kind = (vd_wire_kind)from->body_case;
    switch (m->kind) {
    case VD_WIRE_HELLO:
        return hello(from->hello, &m->as.hello);
    case VD_WIRE_CAMERA:
        return camera(from->camera, &m->as.camera);
    case VD_WIRE_IMPOSTOR:
        return impostor(from->impostor, &m->as.impostor);
    case VD_WIRE_ORDER:
        m->as.order =
            (vd_wire_order){from->order->camera, ids_of(from->order->ids, from->order->n_ids)};
        break;
    case VD_WIRE_GEOMETRY:
        return geometry(from->geometry, &m->as.geometry);
    case VD_WIRE_INSTANCE:
        return instance(from->instance, &m->as.instance);
    case VD_WIRE_LIGHT:
        return light(from->light, &m->as.light.light);
    case VD_WIRE_GROUND:
        return ground(from->ground, &m->as.ground);
    case VD_WIRE_REPLACE:
        m->as.replace = (vd_wire_replace){ids_of(from->replace->out, from->replace->n_out),
                                          ids_of(from->replace->in, from->replace->n_in)};
        break;
    case VD_WIRE_DROP:
        m->as.drop = ids_of(from->drop->ids, from->drop->n_ids);
        break;
    case VD_WIRE_SCREEN:
        screen(from->screen, &m->as.screen);
        break;
    case VD_WIRE_ACKNOWLEDGE:
        m->as.acknowledge =
            (vd_wire_acknowledge){from->acknowledge->batch, from->acknowledge->held_bytes};
        break;
    case VD_WIRE_STATS:
        stats(from->stats, &m->as.stats);
        break;
    case VD_WIRE_ERROR:
        error(from->error, &m->as.error);
        break;
    case VD_WIRE_PING:
    case VD_WIRE_PONG: /* of one type, in one union */
        m->as.ping = (vd_wire_ping){from->ping->stamp};
        break;
    case VD_WIRE_BYE:
        bye(from->bye, &m->as.bye);
        break;
    case VD_WIRE_SETTINGS:
        settings(from->settings, &m->as.settings);
        break;
    default:
        m->kind = VD_WIRE_NONE;
        break;
    }
    return vd_success();
}

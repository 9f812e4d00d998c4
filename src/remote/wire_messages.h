/* wire_messages.h: between the structs of wire.h and those that protobuf-c generates. */
#ifndef VEDUTA_REMOTE_WIRE_MESSAGES_H
#define VEDUTA_REMOTE_WIRE_MESSAGES_H

#include <veduta/wire.h>
#include "remote/veduta.pb-c.h"

/* A message as protobuf-c wants it: its parts, which point at each other and into the caller's
 * arrays. Does not move once made. */
typedef struct vd_wire_record {
    Veduta__Wire__Message message;
    Veduta__Wire__Vector vector;
    uint32_t opaque[4];
    float colors[12];
    union {
        Veduta__Wire__Hello hello;
        Veduta__Wire__Camera camera;
        Veduta__Wire__Impostor impostor;
        Veduta__Wire__Order order;
        Veduta__Wire__Geometry geometry;
        Veduta__Wire__Replace replace;
        Veduta__Wire__Drop drop;
        Veduta__Wire__Screen screen;
        Veduta__Wire__Acknowledge acknowledge;
        Veduta__Wire__Stats stats;
        Veduta__Wire__Error error;
        Veduta__Wire__Ping ping;
        Veduta__Wire__Bye bye;
        Veduta__Wire__Settings settings;
        Veduta__Wire__Instance instance;
        Veduta__Wire__Light light;
        Veduta__Wire__Ground ground;
    } body;
} vd_wire_record;

/* Fills a record from a message that vd_wire_check takes. */
void vd_wire_to_record(const vd_wire_message *message, vd_wire_record *record);

/* Fills a message, which points into the generated one. Only what no struct of ours can hold is
 * checked (counts of lists that belong together, missing parts): vd_wire_check does the rest.
 * Returns VD_ERROR_ARGUMENT. */
VD_MUST_USE vd_status vd_wire_from_message(const Veduta__Wire__Message *from,
                                           vd_wire_message *message);

#endif

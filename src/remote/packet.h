/* packet.h: envelopes that wait to be sent, first come, first served. */
#ifndef VEDUTA_REMOTE_PACKET_H
#define VEDUTA_REMOTE_PACKET_H

#include <veduta/context.h>
#include <veduta/wire.h>

/* Bytes before an envelope, which a transport may write its own head into. */
#define VD_PACKET_HEAD 64

/* Something to be sent: released by vd_release. */
typedef struct vd_packet {
    struct vd_packet *next;
    size_t bytes;
    uint8_t data[]; /* VD_PACKET_HEAD, then [bytes] */
} vd_packet;

/* Zero it. */
typedef struct vd_packet_queue {
    vd_packet *first, *last;
    int count;
} vd_packet_queue;

/* Puts a copy of an envelope behind the others; false when memory is out. */
bool vd_packet_put(vd_context *context, vd_packet_queue *queue, const vd_wire_buffer *envelope);

/* The oldest packet, which is the caller's from now on; null: none. */
vd_packet *vd_packet_take(vd_packet_queue *queue);

void vd_packet_clear(vd_context *context, vd_packet_queue *queue);

#endif

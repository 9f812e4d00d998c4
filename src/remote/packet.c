#include "remote/packet.h"

#include <string.h>
#include "core/core.h"

bool vd_packet_put(vd_context *context, vd_packet_queue *queue, const vd_wire_buffer *envelope) {
    vd_packet *packet = vd_allocate(context, 1, sizeof *packet + VD_PACKET_HEAD + envelope->bytes);
    if (packet == NULL) {
        return false;
    }
    packet->next = NULL;
    packet->bytes = envelope->bytes;
    memcpy(packet->data + VD_PACKET_HEAD, envelope->data, envelope->bytes);
    if (queue->last != NULL) {
        queue->last->next = packet;
    } else {
        queue->first = packet;
    }
    queue->last = packet;
    queue->count++;
    return true;
}

vd_packet *vd_packet_take(vd_packet_queue *queue) {
    vd_packet *packet = queue->first;
    if (packet != NULL) {
        queue->first = packet->next;
        queue->last = queue->first != NULL ? queue->last : NULL;
        queue->count--;
        packet->next = NULL;
    }
    return packet;
}

void vd_packet_clear(vd_context *context, vd_packet_queue *queue) {
    for (vd_packet *packet = vd_packet_take(queue); packet != NULL;
         packet = vd_packet_take(queue)) {
        vd_release(context, packet);
    }
}

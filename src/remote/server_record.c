/* server_record.c: what a server and its first client say to each other, into a file
 * (docs/wire.md, "Recordings").
 *
 * Begun when that client has said hello, written by the rendering thread, beside the file until it
 * is whole. The token that it said is not written: recordings are handed around.
 */
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "remote/server_internal.h"

#if VEDUTA_HAVE_WEBSOCKETS

/* A recording that is as long is ended. */
#define MOST_BYTES ((uint64_t)4 << 30)

static char *beside(const char *path) {
    char *name = malloc(strlen(path) + 6);
    if (name != NULL) {
        (void)sprintf(name, "%s.part", path);
    }
    return name;
}

static void store_u32(uint8_t *out, uint32_t value) {
    for (int i = 0; i < 4; i++) {
        out[i] = (uint8_t)(value >> 8 * i);
    }
}

static void put(vd_recording *r, const void *data, size_t bytes) {
    r->failed = r->failed || fwrite(data, 1, bytes, r->file) != bytes;
    r->bytes += bytes;
}

vd_status vd_server_record(vd_server *server) {
    vd_recording *r = &server->recording;
    if (server->def.record == NULL) {
        return vd_success();
    }
    r->name = beside(server->def.record);
    if (r->name == NULL) {
        return vd_failure(VD_ERROR_MEMORY, "not enough memory for a server; free some");
    }
    r->file = fopen(r->name, "wb");
    if (r->file == NULL) {
        return vd_failure(VD_ERROR_IO, "cannot write %.200s: %s; name another file to record into",
                          r->name, strerror(errno));
    }
    put(r, "VDX\0\1\0\0\0", 8);
    return vd_success();
}

void vd_server_end_recording(vd_server *server, const vd_peer *peer) {
    vd_recording *r = &server->recording;
    if (r->file == NULL || r->peer != peer) {
        return;
    }
    const bool closed = fclose(r->file) == 0 && !r->failed;
    r->file = NULL;
    if (peer == NULL || !closed || rename(r->name, server->def.record) != 0) {
        vd_log(server->context, VD_LOG_WARNING, "%.200s was not recorded: %s", server->def.record,
               peer == NULL ? "no client came" : "it cannot be written");
        (void)remove(r->name);
    }
}

static void write_envelope(vd_server *server, vd_wire_side side, const void *data, size_t bytes) {
    vd_recording *r = &server->recording;
    uint8_t head[12];
    store_u32(head, (uint32_t)side);
    store_u32(head + 4, (uint32_t)(1e3 * (vd_server_now_s() - r->begun_s)));
    store_u32(head + 8, (uint32_t)bytes);
    put(r, head, sizeof head);
    put(r, data, bytes);
    if (r->failed || r->bytes > MOST_BYTES) {
        vd_server_end_recording(server, r->peer);
    }
}

/* Hello without its token. */
static void write_hello(vd_server *server, const vd_received *message) {
    vd_wire *wire = server->tools.wire;
    vd_wire_envelope envelope;
    vd_wire_buffer buffer = {0};
    vd_wire_message *copies = NULL;
    vd_status status =
        vd_wire_decode(wire, VD_WIRE_CLIENT, message->data, message->bytes, &envelope);
    if (status.code == VD_OK) {
        copies = malloc((size_t)envelope.count * sizeof *copies);
    }
    if (copies != NULL) {
        memcpy(copies, envelope.messages, (size_t)envelope.count * sizeof *copies);
        for (int i = 0; i < envelope.count; i++) {
            if (copies[i].kind == VD_WIRE_HELLO) {
                copies[i].as.hello.token = NULL;
            }
        }
        status = vd_wire_encode(wire, VD_WIRE_CLIENT, 0, copies, envelope.count, &buffer);
    }
    if (copies != NULL && status.code == VD_OK) {
        write_envelope(server, VD_WIRE_CLIENT, buffer.data, buffer.bytes);
    } else {
        server->recording.failed = true;
    }
    free(copies);
    vd_wire_buffer_release(server->context, &buffer);
}

void vd_server_record_message(vd_server *server, const vd_peer *peer, const vd_received *message) {
    vd_recording *r = &server->recording;
    if (r->file == NULL) {
        return;
    }
    if (r->peer == peer) {
        write_envelope(server, VD_WIRE_CLIENT, message->data, message->bytes);
    } else if (r->peer == NULL && vd_session_is_greeted(peer->session)) {
        r->peer = peer;
        r->begun_s = vd_server_now_s();
        write_hello(server, message);
    }
}

void vd_server_record_packet(vd_server *server, const vd_peer *peer, const vd_packet *packet) {
    if (server->recording.file != NULL && server->recording.peer == peer) {
        write_envelope(server, VD_WIRE_SERVER, packet->data + VD_PACKET_HEAD, packet->bytes);
    }
}

#endif

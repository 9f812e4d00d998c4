/* wire.c: envelopes.
 *
 * protobuf-c asks for memory piece by piece. Here it gets it from one block as large as the bytes
 * that came and 2 MiB: a message whose parts would take more (a few bytes can promise a great deal
 * of empty parts) is refused, and nothing is asked of the heap from one envelope to the next.
 */
#include "remote/wire_messages.h"

#include <string.h>

#define PARTS_BYTES ((size_t)2 << 20)
#define ALIGNMENT ((size_t)16)
#define MOST_HEAD ((size_t)4096)

/* Memory that is handed out from the front and taken back all at once. */
typedef struct arena {
    uint8_t *memory;
    size_t bytes, used;
    bool refused; /* something did not fit */
} arena;

struct vd_wire {
    vd_context *context;
    arena decoded, encoded;
};

static bool arena_reserve(vd_context *context, arena *a, size_t bytes) {
    a->used = 0;
    a->refused = false;
    if (bytes > a->bytes) {
        vd_release(context, a->memory);
        a->memory = vd_allocate(context, bytes, 1);
        a->bytes = a->memory != NULL ? bytes : 0;
    }
    return a->memory != NULL;
}

static void *arena_take(void *user, size_t bytes) {
    arena *a = user;
    if (bytes > a->bytes - a->used) {
        a->refused = true;
        return NULL;
    }
    void *taken = a->memory + a->used;
    const size_t step = (bytes + ALIGNMENT - 1) / ALIGNMENT * ALIGNMENT;
    a->used = step < a->bytes - a->used ? a->used + step : a->bytes;
    return taken;
}

static void arena_keep(void *user, void *memory) {
    (void)user;
    (void)memory;
}

vd_status vd_wire_create(vd_context *context, vd_wire **out) {
    vd_wire *wire = vd_allocate(context, 1, sizeof *wire);
    if (wire == NULL) {
        return vd_failure(VD_ERROR_MEMORY, "not enough memory for a wire; free some");
    }
    *wire = (vd_wire){.context = context};
    *out = wire;
    return vd_success();
}

void vd_wire_destroy(vd_wire **wire) {
    vd_wire *w = *wire;
    if (w != NULL) {
        vd_release(w->context, w->decoded.memory);
        vd_release(w->context, w->encoded.memory);
        vd_release(w->context, w);
    }
    *wire = NULL;
}

/* ---- the caller's buffer ----------------------------------------------------------------------*/

void vd_wire_buffer_release(vd_context *context, vd_wire_buffer *buffer) {
    vd_release(context, buffer->memory);
    *buffer = (vd_wire_buffer){.head_bytes = buffer->head_bytes};
}

/* Makes room for an envelope; it grows by half at least, as batches differ. */
static vd_status reserve(vd_context *context, vd_wire_buffer *buffer, size_t bytes) {
    if (buffer->head_bytes > MOST_HEAD) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "vd_wire_buffer.head_bytes is %zu; 0 to %zu is possible",
                          buffer->head_bytes, MOST_HEAD);
    }
    const size_t needed = buffer->head_bytes + bytes;
    if (needed > buffer->memory_bytes) {
        const size_t grown = buffer->memory_bytes + buffer->memory_bytes / 2;
        const size_t now = grown > needed ? grown : needed;
        vd_release(context, buffer->memory);
        buffer->memory = vd_allocate(context, now, 1);
        buffer->memory_bytes = buffer->memory != NULL ? now : 0;
        if (buffer->memory == NULL) {
            buffer->data = NULL;
            return vd_failure(VD_ERROR_MEMORY,
                              "not enough memory for the %zu bytes of an envelope; free some", now);
        }
    }
    buffer->data = buffer->memory + buffer->head_bytes;
    return vd_success();
}

/* ---- encoding ---------------------------------------------------------------------------------*/

static size_t varint_bytes(size_t value) {
    size_t bytes = 1;
    while (value >= 128) {
        value >>= 7;
        bytes++;
    }
    return bytes;
}

size_t vd_wire_message_bytes(const vd_wire_message *message) {
    vd_wire_record record;
    vd_wire_to_record(message, &record);
    const size_t bytes = protobuf_c_message_get_packed_size(&record.message.base);
    return 1 + varint_bytes(bytes) + bytes;
}

static vd_status check_all(vd_wire_side from, const vd_wire_message *messages, int count) {
    if (count < 1 || count > VD_WIRE_MAX_MESSAGES) {
        return vd_failure(VD_ERROR_ARGUMENT, "an envelope is to hold %d messages; give 1 to %d",
                          count, VD_WIRE_MAX_MESSAGES);
    }
    for (int i = 0; i < count; i++) {
        const vd_status status = vd_wire_check(from, &messages[i]);
        if (status.code != VD_OK) {
            return vd_failure(status.code, "cannot send message %d: %.300s", i, status.message);
        }
    }
    return vd_success();
}

static vd_status too_long(int count, size_t bytes) {
    return count > 1 ? vd_failure(VD_ERROR_LIMIT,
                                  "%d messages in one envelope take %zu bytes; %zu are possible: "
                                  "send some apart",
                                  count, bytes, VD_WIRE_BATCH_BYTES)
                     : vd_failure(VD_ERROR_LIMIT,
                                  "an envelope has %zu bytes; %zu are possible: send less", bytes,
                                  VD_WIRE_ENVELOPE_BYTES);
}

vd_status vd_wire_encode(vd_wire *wire, vd_wire_side from, uint32_t batch,
                         const vd_wire_message *messages, int count, vd_wire_buffer *buffer) {
    buffer->bytes = 0;
    vd_status status = check_all(from, messages, count);
    if (status.code != VD_OK) {
        return status;
    }
    arena *a = &wire->encoded;
    const size_t n = (size_t)count;
    if (!arena_reserve(wire->context, a,
                       n * (sizeof(vd_wire_record) + sizeof(void *)) + 2 * ALIGNMENT)) {
        return vd_failure(VD_ERROR_MEMORY, "not enough memory for %d messages; free some", count);
    }
    vd_wire_record *records = arena_take(a, n * sizeof *records);
    Veduta__Wire__Message **parts = arena_take(a, n * sizeof *parts);
    for (size_t i = 0; i < n; i++) {
        vd_wire_to_record(&messages[i], &records[i]);
        parts[i] = &records[i].message;
    }
    Veduta__Wire__Envelope envelope = VEDUTA__WIRE__ENVELOPE__INIT;
    envelope.batch = batch;
    envelope.n_messages = n;
    envelope.messages = parts;
    const size_t bytes = veduta__wire__envelope__get_packed_size(&envelope);
    if (bytes > (count > 1 ? VD_WIRE_BATCH_BYTES : VD_WIRE_ENVELOPE_BYTES)) {
        return too_long(count, bytes);
    }
    status = reserve(wire->context, buffer, bytes);
    if (status.code == VD_OK) {
        buffer->bytes = veduta__wire__envelope__pack(&envelope, buffer->data);
    }
    return status;
}

/* ---- decoding ---------------------------------------------------------------------------------*/

/* Turns what protobuf-c made into our messages, each of them checked. */
static vd_status take_messages(arena *a, vd_wire_side from, const Veduta__Wire__Envelope *envelope,
                               vd_wire_envelope *out) {
    const size_t count = envelope->n_messages;
    if (count < 1 || count > VD_WIRE_MAX_MESSAGES) {
        return vd_failure(VD_ERROR_FORMAT,
                          "an envelope came with %zu messages; 1 to %d are possible", count,
                          VD_WIRE_MAX_MESSAGES);
    }
    vd_wire_message *messages = arena_take(a, count * sizeof *messages);
    if (messages == NULL) {
        return vd_failure(VD_ERROR_FORMAT,
                          "an envelope came with more parts than it has bytes for");
    }
    for (size_t i = 0; i < count; i++) {
        vd_status status = vd_wire_from_message(envelope->messages[i], &messages[i]);
        if (status.code == VD_OK && messages[i].kind != VD_WIRE_NONE) {
            status = vd_wire_check(from, &messages[i]);
        }
        if (status.code != VD_OK) {
            return vd_failure(VD_ERROR_FORMAT, "cannot take message %zu: %.300s", i,
                              status.message);
        }
    }
    *out = (vd_wire_envelope){envelope->batch, (int)count, messages};
    return vd_success();
}

vd_status vd_wire_decode(vd_wire *wire, vd_wire_side from, const void *data, size_t bytes,
                         vd_wire_envelope *out) {
    if (bytes > VD_WIRE_ENVELOPE_BYTES) {
        return too_long(1, bytes);
    }
    arena *a = &wire->decoded;
    if (!arena_reserve(wire->context, a, bytes + PARTS_BYTES)) {
        return vd_failure(VD_ERROR_MEMORY,
                          "not enough memory for an envelope of %zu bytes; free some", bytes);
    }
    ProtobufCAllocator allocator = {arena_take, arena_keep, a};
    const Veduta__Wire__Envelope *envelope =
        veduta__wire__envelope__unpack(&allocator, bytes, data);
    if (envelope == NULL) {
        return a->refused ? vd_failure(VD_ERROR_FORMAT,
                                       "an envelope of %zu bytes came with more parts than that is "
                                       "enough for",
                                       bytes)
                          : vd_failure(VD_ERROR_FORMAT,
                                       "what came is not an envelope of messages, or damaged: %zu "
                                       "bytes; both sides need the same version",
                                       bytes);
    }
    if (envelope->n_messages > 1 && bytes > VD_WIRE_BATCH_BYTES) {
        return too_long((int)envelope->n_messages, bytes);
    }
    return take_messages(a, from, envelope, out);
}

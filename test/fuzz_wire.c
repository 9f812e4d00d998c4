/* Any bytes as an envelope, from either side: an error, or messages within every bound, which
 * encode again. The first byte says from whom. */
#include <stdlib.h>
#include <string.h>
#include <veduta/wire.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

/* Reads all that is pointed to, so that a sanitizer sees it. */
static unsigned look_at(const vd_wire_message *m) {
    unsigned sum = 0;
    const vd_wire_ids *ids = m->kind == VD_WIRE_ORDER  ? &m->as.order.ids
                             : m->kind == VD_WIRE_DROP ? &m->as.drop
                                                       : NULL;
    for (int i = 0; ids != NULL && i < ids->count; i++) {
        sum += (unsigned)ids->ids[i];
    }
    if (m->kind == VD_WIRE_HELLO) {
        sum += (unsigned)strlen(m->as.hello.token) + (unsigned)strlen(m->as.hello.name);
    }
    if (m->kind == VD_WIRE_IMPOSTOR) {
        sum += m->as.impostor.picture.data[m->as.impostor.picture.bytes - 1];
    }
    return sum;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    /* Kept from input to input, as a server does: what one leaves must not harm the next. */
    static vd_context *context;
    static vd_wire *wire;
    static vd_wire_buffer again;
    vd_context_def def = vd_context_def_default();
    def.threads = 1;
    if (wire == NULL && (vd_context_create(&def, &context).code != VD_OK ||
                         vd_wire_create(context, &wire).code != VD_OK)) {
        abort();
    }
    if (size == 0) {
        return 0;
    }
    const vd_wire_side side = (vd_wire_side)(data[0] & 1);
    vd_wire_envelope got;
    if (vd_wire_decode(wire, side, data + 1, size - 1, &got).code != VD_OK) {
        return 0;
    }
    unsigned sum = 0;
    bool known = true;
    for (int i = 0; i < got.count; i++) {
        known = known && got.messages[i].kind != VD_WIRE_NONE;
        sum += look_at(&got.messages[i]);
    }
    const vd_status status = vd_wire_encode(wire, side, got.batch, got.messages, got.count, &again);
    /* written out in full, fields that came empty may make it too long */
    if (known && status.code != VD_OK && status.code != VD_ERROR_LIMIT) {
        abort();
    }
    (void)sum;
    return 0;
}

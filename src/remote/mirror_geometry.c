/* mirror_geometry.c: what a server sends to be drawn here. */
#include "remote/mirror_internal.h"

#include <string.h>

/* Makes a model of a block, whose bytes lie anywhere. */
static vd_status unpack_model(vd_mirror *m, const vd_wire_bytes *block, vd_model **out) {
    uint8_t *aligned = vd_allocate(m->context, 1, block->bytes);
    if (aligned == NULL) {
        return vd_failure(VD_ERROR_MEMORY, "not enough memory for a model; free some");
    }
    memcpy(aligned, block->data, block->bytes);
    const vd_status status = vd_model_unpack(m->context, aligned, block->bytes, out);
    vd_release(m->context, aligned);
    return status;
}

/* Makes what a message holds; false after a failure that was told. */
static bool unpack(vd_mirror *m, const vd_wire_geometry *g, vd_kept *kept) {
    const vd_status status = g->kind == VD_WIRE_MODEL
                                 ? unpack_model(m, &g->block, &kept->model)
                                 : vd_brick_block_unpack(m->context, g->block.data, g->block.bytes,
                                                         g->origin, &kept->brick);
    if (status.code == VD_ERROR_MEMORY) {
        vd_mirror_out_of_memory(m);
    } else if (status.code != VD_OK) {
        vd_mirror_fail(m, VD_WIRE_FAULT_MALFORMED, status.message);
    }
    return status.code == VD_OK;
}

void vd_mirror_take_geometry(vd_mirror *m, const vd_wire_geometry *g) {
    if (g->kind == VD_WIRE_MODEL ? m->def.no_models : m->def.particles == 0) {
        vd_mirror_fail(m, VD_WIRE_FAULT_OUT_OF_TURN,
                       g->kind == VD_WIRE_MODEL ? "a model came, which this client does not draw"
                                                : "a brick came, which this client does not draw");
        return;
    }
    vd_kept made = {.references = 1, .bytes = g->block.bytes};
    if (!vd_mirror_fits(m, g->id, g->block.bytes) || !unpack(m, g, &made)) {
        return;
    }
    vd_kept *kept = vd_allocate(m->context, 1, sizeof *kept);
    if (kept == NULL) {
        vd_model_destroy(&made.model);
        vd_brick_block_destroy(&made.brick);
        vd_mirror_out_of_memory(m);
        return;
    }
    *kept = made;
    (void)vd_mirror_hold(m, &(vd_held){.id = g->id, .version = g->version, .kept = kept});
}

void vd_mirror_take_instance(vd_mirror *m, const vd_wire_instance *i) {
    if (vd_mirror_fits(m, i->id, VD_WIRE_INSTANCE_BYTES)) {
        (void)vd_mirror_hold(m, &(vd_held){.id = i->id, .version = i->version, .place = *i});
    }
}

void vd_mirror_take_light(vd_mirror *m, const vd_light *light) {
    pthread_mutex_lock(&m->lock);
    m->light = *light;
    m->has_light = true;
    m->news.version++;
    pthread_mutex_unlock(&m->lock);
}

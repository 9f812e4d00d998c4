/* impostor_change.c: objects that change.
 *
 * A world does not tell what becomes of it: who exchanges what an object shows says so here.
 */
#include "core/core.h"
#include "impostor/impostor_set.h"

/* What changes twice within so many updates does so all the time. */
#define CALM 8

bool vd_impostor_is_restless(const vd_impostors *set, uint32_t node) {
    const uint32_t known = set->slot_of[node];
    const vd_impostor_slot *slot = known != 0 ? vd_impostor_slot_at(set, known - 1) : NULL;
    return slot != NULL && slot->restless && set->update - slot->changes <= CALM;
}

static void change(vd_impostors *set, uint32_t node) {
    vd_impostor_slot *slot = vd_impostor_slot_of(set, node);
    if (slot == NULL) {
        return; /* no memory: it has no picture */
    }
    slot->restless = slot->changes > 0 && set->update - slot->changes <= CALM;
    slot->changes = set->update;
    slot->changed = slot->now.rgba != NULL || slot->coming || slot->empty;
    slot->since = set->versions;
    slot->empty = false;
}

void vd_impostors_change(vd_impostors *set, uint64_t id) {
    const vd_node *node = vd_world_node(set->world, id);
    if (node == NULL || set->update == 0) {
        return;
    }
    set->has_still = false;
    set->in_front.contents = 0;
    for (uint64_t at = id; at != 0; at = vd_object_parent_id(at)) {
        const vd_node *in = vd_world_node(set->world, at);
        if (in != NULL) {
            change(set, (uint32_t)(in - set->world->nodes));
        }
    }
    const vd_impostor_ground *g = &set->ground;
    const vd_cells cells = vd_world_node_cells(g->sample_from_world, &g->map, node);
    for (int level = 0; level < g->levels && g->count > 0 && node->grounded; level++) {
        const int side = g->side << level;
        for (int r = (cells.r0 - g->map.r0) / side; r <= (cells.r1 - g->map.r0) / side; r++) {
            for (int c = (cells.c0 - g->map.c0) / side; c <= (cells.c1 - g->map.c0) / side; c++) {
                change(set, (uint32_t)set->world->node_count + vd_ground_number(g, level, c, r));
            }
        }
    }
}

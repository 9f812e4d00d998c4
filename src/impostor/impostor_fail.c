/* impostor_fail.c: what cannot be drawn.
 *
 * A thing whose drawing fails, as a particle file that is damaged, must not take the picture of all
 * else with it. It is skipped, and tried again after 0.5 s, 1 s, 2 s … 32 s: it may be mended.
 */
#include "core/core.h"
#include "impostor/impostor_set.h"

vd_impostor_slot *vd_impostor_slot_of(vd_impostors *set, uint32_t node) {
    if (set->slot_of[node] == 0) {
        vd_impostor_slot *made = vd_list_add(set->context, &set->slots, 1, sizeof *made);
        if (made == NULL) {
            return NULL;
        }
        *made = (vd_impostor_slot){.node = node};
        set->slot_of[node] = (uint32_t)set->slots.count;
    }
    return vd_impostor_slot_at(set, set->slot_of[node] - 1);
}

void vd_impostor_fail(vd_impostors *set, vd_impostor_slot *slot) {
    const uint32_t doublings = slot->failures < 6 ? slot->failures : 6;
    slot->failures++;
    slot->retry_s = set->time_s + 0.5 * (double)(1u << doublings);
    set->stats.failed++;
}

/* Each alone, in a frame of the same size: a smaller one might leave out what is broken. */
vd_status vd_impostors_set_aside(vd_impostors *set, vd_job *job, const vd_camera *camera,
                                 const vd_frame *frame, vd_status because) {
    if (vd_impostor_is_fatal(&because)) {
        return because;
    }
    vd_frame *alone = NULL;
    uint32_t *direct = set->direct.data;
    size_t kept = 0, i = 0;
    vd_status status = vd_frame_create(set->context, frame->width, frame->height, 0, &alone);
    for (; i < set->direct.count && status.code == VD_OK; i++) {
        const uint32_t node = direct[i];
        const vd_status drawn = vd_world_renderer_draw_object(
            set->renderer, job, camera, set->world->nodes[node].id, alone, NULL);
        vd_impostor_slot *slot = NULL;
        if (vd_impostor_is_fatal(&drawn)) {
            status = drawn;
        } else if (drawn.code != VD_OK) {
            slot = vd_impostor_slot_of(set, node);
            status = slot != NULL ? status : vd_out_of_memory("an impostor", sizeof *slot);
        }
        if (slot != NULL) {
            vd_impostor_fail(set, slot);
        } else {
            direct[kept++] = node;
        }
    }
    const bool found = kept < i;
    while (i < set->direct.count) {
        direct[kept++] = direct[i++];
    }
    set->direct.count = kept;
    vd_frame_destroy(&alone);
    return status.code == VD_OK && !found ? because : status;
}

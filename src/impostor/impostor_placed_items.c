/* impostor_placed_items.c: models, their instances and bricks as a client gets, holds and loses
 * them.
 */
#include <stdlib.h>
#include "core/core.h"
#include "impostor/impostor_placed.h"

/* First bytes of ids; see impostor_items.c. */
#define MODEL_IDS ((uint64_t)253 << 56)
#define STAND_IDS ((uint64_t)252 << 56)
#define NUMBER(id) ((id) & (((uint64_t)1 << 56) - 1))

/* ---- handing it over --------------------------------------------------------------------------*/

static uint32_t number_of(const vd_impostors *set, const vd_impostor_stand *stand) {
    return ((const vd_instance *)set->world->entries[set->world->nodes[stand->node].entry].object)
        ->model;
}

static vd_status list_model(vd_impostors *set, uint32_t number) {
    vd_impostor_model *model = &set->placing.models[number];
    const vd_impostor_item *items = set->items.data;
    const uint64_t id = MODEL_IDS | (number + 1);
    for (size_t i = 0; i < set->items.count; i++) {
        if (items[i].id == id) {
            return vd_success();
        }
    }
    model->version = ++set->versions;
    return vd_impostors_add_item(set, &(vd_impostor_item){.kind = VD_IMPOSTOR_MODEL,
                                                          .model = set->world->assets[number].model,
                                                          .id = id,
                                                          .version = model->version});
}

vd_status vd_impostors_list_placed(vd_impostors *set) {
    const vd_impostor_placing *p = &set->placing;
    const uint32_t *chosen = p->chosen.data;
    vd_status status = vd_success();
    for (size_t i = 0; i < p->chosen.count && status.code == VD_OK; i++) {
        const uint32_t number = number_of(set, vd_impostor_stand_at(set, chosen[i]));
        status = p->models[number].delivered ? status : list_model(set, number);
    }
    for (size_t i = 0; i < p->chosen.count && status.code == VD_OK; i++) {
        const vd_impostor_stand *stand = vd_impostor_stand_at(set, chosen[i]);
        if (!stand->delivered) {
            status = vd_impostors_add_item(
                set, &(vd_impostor_item){.kind = VD_IMPOSTOR_INSTANCE,
                                         .model_id = MODEL_IDS | (number_of(set, stand) + 1),
                                         .place = stand->place,
                                         .id = STAND_IDS | stand->node,
                                         .version = stand->version});
        }
    }
    return status.code == VD_OK ? vd_impostors_list_bricks(set) : status;
}

vd_status vd_impostors_order_placed(vd_impostors *set) {
    const vd_impostor_placing *p = &set->placing;
    const uint32_t *chosen = p->chosen.data;
    vd_status status = vd_success();
    for (size_t i = p->chosen.count; i-- > 0 && status.code == VD_OK;) {
        const vd_impostor_stand *stand = vd_impostor_stand_at(set, chosen[i]);
        if (stand->delivered && p->models[number_of(set, stand)].delivered) {
            status = vd_impostors_add_id(set, STAND_IDS | stand->node);
        }
    }
    return status.code == VD_OK ? vd_impostors_order_bricks(set) : status;
}

vd_status vd_impostors_gone_placed(vd_impostors *set) {
    vd_impostor_placing *p = &set->placing;
    vd_status status = vd_success();
    for (uint32_t i = 0; i < p->stands.count && status.code == VD_OK; i++) {
        vd_impostor_stand *stand = vd_impostor_stand_at(set, i);
        if (stand->gone) {
            stand->gone = false;
            p->bytes -= VD_IMPOSTOR_INSTANCE_BYTES;
            status = vd_impostors_add_id(set, STAND_IDS | stand->node);
        }
    }
    for (uint32_t i = 0;
         p->models != NULL && i < vd_world_asset_count(set->world) && status.code == VD_OK; i++) {
        vd_impostor_model *model = &p->models[i];
        if (model->gone) {
            model->gone = false;
            p->bytes -= model->bytes;
            status = vd_impostors_add_id(set, MODEL_IDS | (i + 1));
        }
    }
    return status.code == VD_OK ? vd_impostors_gone_bricks(set) : status;
}

/* ---- what the client has ----------------------------------------------------------------------*/

/* The model or the stand of an id; null when it is not one of these. */
static vd_impostor_model *find_model(const vd_impostors *set, uint64_t id) {
    const uint64_t number = NUMBER(id);
    return id - number == MODEL_IDS && set->placing.models != NULL && number > 0 &&
                   number <= vd_world_asset_count(set->world)
               ? &set->placing.models[number - 1]
               : NULL;
}

static vd_impostor_stand *find_stand(const vd_impostors *set, uint64_t id) {
    const uint64_t node = NUMBER(id);
    return id - node == STAND_IDS && set->placing.stand_of != NULL &&
                   node < set->world->node_count && set->placing.stand_of[node] != 0
               ? vd_impostor_stand_at(set, set->placing.stand_of[node] - 1)
               : NULL;
}

void vd_impostors_deliver_placed(vd_impostors *set, uint64_t id, uint32_t version) {
    vd_impostor_model *model = find_model(set, id);
    vd_impostor_stand *stand = find_stand(set, id);
    if (model != NULL && !model->delivered && model->version == version) {
        model->delivered = true;
        set->placing.bytes += model->bytes;
    } else if (stand != NULL && !stand->delivered && stand->version == version) {
        stand->delivered = true;
        set->placing.bytes += VD_IMPOSTOR_INSTANCE_BYTES;
    }
    vd_impostor_brick *brick = vd_impostor_find_brick(set, id);
    if (brick != NULL && !brick->delivered && brick->version == version) {
        brick->delivered = true;
        set->placing.bytes += brick->bytes;
    }
}

void vd_impostors_lose_placed(vd_impostors *set, uint64_t id) {
    vd_impostor_model *model = find_model(set, id);
    vd_impostor_stand *stand = find_stand(set, id);
    if (model != NULL && model->delivered) {
        model->delivered = false;
        model->refused = true; /* or it would be sent again and again */
        set->placing.bytes -= model->bytes;
    } else if (stand != NULL && stand->delivered) {
        stand->delivered = false;
        set->placing.bytes -= VD_IMPOSTOR_INSTANCE_BYTES;
    }
    vd_impostor_brick *brick = vd_impostor_find_brick(set, id);
    if (brick != NULL && brick->delivered) {
        brick->delivered = false;
        brick->refused = true;
        set->placing.bytes -= brick->bytes;
    }
}

bool vd_impostors_holds_placed(const vd_impostors *set, uint64_t id, uint32_t version) {
    const vd_impostor_model *model = find_model(set, id);
    const vd_impostor_stand *stand = find_stand(set, id);
    const vd_impostor_brick *brick = vd_impostor_find_brick(set, id);
    return (model != NULL && model->delivered && model->version == version) ||
           (stand != NULL && stand->delivered && stand->version == version) ||
           (brick != NULL && brick->delivered && brick->version == version);
}

static bool is_held(const vd_impostors *set, uint64_t id, const uint64_t *ids,
                    const uint32_t *versions, int count) {
    const uint64_t *found =
        count > 0 ? bsearch(&id, ids, (size_t)count, sizeof *ids, vd_impostor_compare_ids) : NULL;
    return found != NULL && vd_impostors_holds_placed(set, id, versions[found - ids]);
}

void vd_impostors_resume_placed(vd_impostors *set, const uint64_t *ids, const uint32_t *versions,
                                int count) {
    const vd_impostor_placing *p = &set->placing;
    for (uint32_t i = 0; p->models != NULL && i < vd_world_asset_count(set->world); i++) {
        const uint64_t id = MODEL_IDS | (i + 1);
        if (!is_held(set, id, ids, versions, count)) {
            vd_impostors_lose_placed(set, id);
        }
        p->models[i].refused = false; /* it may have more room now */
    }
    for (uint32_t i = 0; i < p->stands.count; i++) {
        const uint64_t id = STAND_IDS | vd_impostor_stand_at(set, i)->node;
        if (!is_held(set, id, ids, versions, count)) {
            vd_impostors_lose_placed(set, id);
        }
    }
    for (uint32_t i = 0; i < p->bricks.count; i++) {
        vd_impostor_brick *brick = vd_impostor_brick_at(set, i);
        if (!is_held(set, vd_impostor_brick_id(brick), ids, versions, count)) {
            vd_impostors_lose_placed(set, vd_impostor_brick_id(brick));
        }
        brick->refused = false;
    }
}

void vd_impostors_release_placed(vd_impostors *set) {
    vd_impostor_placing *p = &set->placing;
    vd_release(set->context, p->models);
    vd_release(set->context, p->stand_of);
    vd_release(set->context, p->stands.data);
    vd_release(set->context, p->chosen.data);
    vd_release(set->context, p->before.data);
    vd_impostors_release_bricks(set);
    *p = (vd_impostor_placing){.bytes = 0};
}

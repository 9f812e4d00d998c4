/* object_group.c: what stands together, and the terrain: kinds that keep nothing but their head. */
#include "world/object_kinds.h"

static vd_status draw_nothing(vd_pass *pass, const vd_object *object, const void *live) {
    (void)pass;
    (void)object;
    (void)live;
    return vd_success();
}

static vd_status draw_ground(vd_pass *pass, const vd_object *object, const void *live) {
    (void)object;
    (void)live;
    pass->ground = true;
    return vd_success();
}

const vd_object_kind_entry vd_group_kind = {
    .name = "group", .least_bytes = sizeof(vd_object), .draw = draw_nothing};

const vd_object_kind_entry vd_terrain_kind = {
    .name = "terrain", .least_bytes = sizeof(vd_object), .draw = draw_ground};

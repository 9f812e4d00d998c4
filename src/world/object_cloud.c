/* object_cloud.c: particles of a part of a brick file. */
#include <math.h>
#include "world/object_kinds.h"
#include "world/world_internal.h"

vd_status vd_cloud_create(vd_context *context, const vd_cloud_def *def, vd_object **out) {
    vd_object *object = NULL;
    vd_status status = vd_object_make(context, VD_OBJECT_PARTICLES, sizeof(vd_cloud),
                                      vd_vec3_scale(vd_vec3_add(def->min, def->max), 0.5), &object);
    if (status.code != VD_OK) {
        return status;
    }
    vd_cloud *cloud = (vd_cloud *)object;
    cloud->bricks = def->bricks;
    cloud->root = def->root;
    const vd_vec3 low = vd_vec3_subtract(def->min, object->anchor);
    const vd_vec3 high = vd_vec3_subtract(def->max, object->anchor);
    vd_object_bound_first(object, (const double[3]){low.x, low.y, low.z});
    vd_object_bound_more(object, (const double[3]){high.x, high.y, high.z});
    status = vd_object_validate(object, sizeof *cloud);
    if (status.code != VD_OK ||
        !(def->min.x <= def->max.x && def->min.y <= def->max.y && def->min.z <= def->max.z)) {
        vd_object_destroy(context, &object);
        return vd_failure(VD_ERROR_ARGUMENT,
                          "the bounds of particles are not finite, turned around, or beyond %g m; "
                          "give other numbers",
                          VD_OBJECT_MAX_METRES);
    }
    *out = object;
    return vd_success();
}

static const char *check(const vd_object *object) {
    return object->size_bytes != sizeof(vd_cloud) ? "the size" : NULL;
}

static uint32_t asset(const vd_object *object, vd_asset_kind *kind) {
    *kind = VD_ASSET_BRICKS;
    return ((const vd_cloud *)object)->bricks;
}

/* Keeps nothing, but looks at what only the asset can tell. */
static vd_status open_cloud(vd_world *world, const vd_object *object, void **live) {
    const vd_cloud *cloud = (const vd_cloud *)object;
    const vd_bricks *bricks = world->assets[cloud->bricks].bricks->bricks;
    *live = NULL;
    return cloud->root < bricks->node_count
               ? vd_success()
               : vd_failure(VD_ERROR_ARGUMENT,
                            "there is no node %u in brick file %u of the world, which has %u; give "
                            "another root",
                            cloud->root, cloud->bricks, bricks->node_count);
}

static vd_status draw(vd_pass *pass, const vd_object *object, const void *live) {
    (void)live;
    const vd_cloud **to = vd_list_add(pass->context, pass->clouds, 1, sizeof *to);
    if (to == NULL) {
        return vd_out_of_memory("a picture's particles", sizeof *to);
    }
    *to = (const vd_cloud *)object;
    return vd_success();
}

const vd_object_kind_entry vd_cloud_kind = {.name = "particles",
                                            .least_bytes = sizeof(vd_cloud),
                                            .check = check,
                                            .asset = asset,
                                            .open = open_cloud,
                                            .draw = draw};

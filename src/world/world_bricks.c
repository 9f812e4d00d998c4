/* world_bricks.c: brick files as assets of a world, and their particles as its objects.
 *
 * An object is a subtree of the file's octree: there is nothing to copy, its numbers stay where
 * they lie in the mapped file, and how finely it is drawn is chosen for each picture anew. Cut at a
 * number of particles, not at a level, objects cost about the same to draw wherever the data is
 * dense.
 */
#include <math.h>
#include "world/world_internal.h"

vd_particle_look vd_particle_look_default(void) {
    return (vd_particle_look){
        .kernel = VD_SPLAT_DISC, .constant = {255, 255, 255, 255}, .attribute = -1};
}

void vd_brick_asset_destroy(vd_context *context, vd_brick_asset **asset) {
    if (*asset != NULL) {
        vd_bricks_close(&(*asset)->bricks);
        vd_release(context, *asset);
        *asset = NULL;
    }
}

/* The colours' range where the look leaves it open: that of the file, not of what a picture shows
 * of it, so that colours do not change as one moves. */
static void set_range(const vd_bricks *b, const vd_particle_look *look, vd_splat_def *splat) {
    splat->range_min = look->range_min;
    splat->range_max = look->range_max;
    if (look->range_max > look->range_min) {
        return;
    }
    if (look->color == VD_BRICK_COLOR_VALUE) {
        splat->range_min = b->attributes[look->attribute].min;
        splat->range_max = b->attributes[look->attribute].max;
    } else if (look->color == VD_BRICK_COLOR_HEIGHT) {
        splat->range_min = b->min[2];
        splat->range_max = b->max[2];
    }
    if (look->log && !(splat->range_min > 0.0)) {
        splat->range_min = 1e-6 * splat->range_max; /* as far as colours tell by logarithm */
    }
    if (!(splat->range_max > splat->range_min) || !(splat->range_min > 0.0 || !look->log)) {
        splat->range_min = look->log ? 1.0 : 0.0; /* one value, or none with a logarithm */
        splat->range_max = 2.0;
    }
}

static vd_status check_look(const vd_bricks *b, const vd_particle_look *look,
                            const vd_brick_view_def *view) {
    const vd_status status = vd_brick_view_check(b, view);
    if (status.code != VD_OK) {
        return status;
    }
    if ((unsigned)look->kernel >= VD_SPLAT_KERNEL_COUNT) {
        return vd_failure(VD_ERROR_ARGUMENT, "the particles' kernel %d is unknown",
                          (int)look->kernel);
    }
    if (!isfinite(look->range_min) || !isfinite(look->range_max) ||
        look->range_max < look->range_min ||
        (look->log && look->range_max > look->range_min && !(look->range_min > 0.0))) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "the particles' range of colours is %g to %g; give two finite numbers, "
                          "the lower one first, above 0 for a logarithm, or 0 and 0 for that of "
                          "the file",
                          look->range_min, look->range_max);
    }
    return status;
}

vd_status vd_world_add_bricks(vd_world *world, vd_bricks **bricks, const vd_particle_look *given,
                              uint32_t *number) {
    const vd_particle_look look = given != NULL ? *given : vd_particle_look_default();
    const vd_brick_view_def view = {.mode = VD_SPLAT_ALPHA,
                                    .kernel = look.kernel,
                                    .detail_px = look.detail_px,
                                    .color = look.color,
                                    .attribute = look.attribute,
                                    .constant = look.constant,
                                    .radius_m = look.radius_m,
                                    .radius_scale = look.radius_scale,
                                    .opacity = look.opacity,
                                    .weight = -1,
                                    .memory_bytes = look.memory_bytes};
    vd_status status = check_look(*bricks, &look, &view);
    if (status.code != VD_OK) {
        return status;
    }
    vd_asset asset = {.kind = VD_ASSET_BRICKS};
    vd_brick_asset *made = vd_allocate_zero(world->context, 1, sizeof *made);
    if (made == NULL) {
        return vd_out_of_memory("a brick file in a world", sizeof *made);
    }
    made->bricks = *bricks;
    made->view = view;
    made->splat = vd_splat_def_default();
    made->splat.kernel = look.kernel;
    made->splat.log = look.log;
    made->splat.over_frame = true;
    if (look.colormap != NULL) {
        made->colormap = *look.colormap;
        made->splat.colormap = &made->colormap;
    }
    set_range(*bricks, &look, &made->splat);
    asset.bricks = made;
    status = vd_world_add_asset(world, &asset, number);
    if (status.code != VD_OK) {
        vd_release(world->context, made);
        return status;
    }
    *bricks = NULL;
    return status;
}

/* ---- objects ----------------------------------------------------------------------------------*/

typedef struct cutting {
    vd_world *world;
    const vd_bricks *bricks;
    uint32_t asset;
    uint64_t most;
    double reach;
    size_t count;
} cutting;

static vd_status add_subtree(cutting *c, uint32_t root) {
    const vd_bricks_node *n = &c->bricks->nodes[root];
    const double reach = c->reach;
    const vd_cloud_def def = {
        .bricks = c->asset,
        .root = root,
        .min = vd_vec3_make(n->min[0] - reach, n->min[1] - reach, n->min[2] - reach),
        .max = vd_vec3_make(n->max[0] + reach, n->max[1] + reach, n->max[2] + reach)};
    vd_object *object = NULL;
    vd_status status = vd_cloud_create(c->world->context, &def, &object);
    if (status.code == VD_OK) {
        status = vd_world_add(c->world, &object);
    }
    vd_object_destroy(c->world->context, &object);
    c->count += status.code == VD_OK;
    return status;
}

/* At most as deep as the octree: 32 levels. */
static vd_status cut(cutting *c, uint32_t root) {
    const vd_bricks_node *n = &c->bricks->nodes[root];
    if (n->leaves <= c->most || n->child_count == 0) {
        return add_subtree(c, root);
    }
    vd_status status = vd_success();
    for (uint32_t i = 0; i < n->child_count && status.code == VD_OK; i++) {
        status = cut(c, n->child_first + i);
    }
    return status;
}

vd_status vd_world_add_particles(vd_world *world, uint32_t bricks, uint64_t most, size_t *count) {
    if (bricks >= vd_world_asset_count(world) || world->assets[bricks].kind != VD_ASSET_BRICKS) {
        return vd_failure(VD_ERROR_ARGUMENT, "there is no brick file %u in the world; add it first",
                          bricks);
    }
    vd_brick_asset *asset = world->assets[bricks].bricks;
    cutting c = {.world = world,
                 .bricks = asset->bricks,
                 .asset = bricks,
                 .most = most > 0 ? most : VD_WORLD_CLOUD_PARTICLES,
                 .reach = vd_brick_view_reach(asset->bricks, &asset->view)};
    const vd_status status = cut(&c, 0);
    asset->placed = asset->placed || status.code == VD_OK;
    if (count != NULL) {
        *count = c.count;
    }
    return status;
}

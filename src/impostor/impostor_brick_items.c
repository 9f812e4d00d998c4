/* impostor_brick_items.c: bricks of particles as a client gets, holds and loses them. */
#include <math.h>
#include "core/core.h"
#include "impostor/impostor_placed.h"
#include "splat/brick_pack.h"
#include "splat/brick_walk.h"

/* First byte of ids; see impostor_items.c. */
#define BRICK_IDS ((uint64_t)251 << 56)

/* Particles of an object that are looked at. */
#define LOOKED_AT 48

/* ---- files and bricks -------------------------------------------------------------------------*/

vd_status vd_impostors_open_file(vd_impostors *set, uint32_t asset) {
    vd_impostor_placing *p = &set->placing;
    if (p->files == NULL) {
        p->files =
            vd_allocate_zero(set->context, vd_world_asset_count(set->world), sizeof *p->files);
    }
    if (p->files == NULL) {
        return vd_impostor_no_memory();
    }
    vd_impostor_file *file = &p->files[asset];
    if (file->parents != NULL) {
        return vd_success();
    }
    const vd_bricks *bricks = vd_impostor_particles(set, asset)->bricks;
    uint32_t *parents = vd_allocate(set->context, bricks->node_count, sizeof *parents);
    file->brick_of = vd_allocate_zero(set->context, bricks->node_count, sizeof *file->brick_of);
    file->marks = vd_allocate_zero(set->context, bricks->node_count, 1);
    file->whole = vd_allocate_zero(set->context, bricks->node_count, 1);
    if (parents == NULL || file->brick_of == NULL || file->marks == NULL || file->whole == NULL) {
        vd_release(set->context, parents);
        vd_release(set->context, file->brick_of);
        vd_release(set->context, file->marks);
        vd_release(set->context, file->whole);
        *file = (vd_impostor_file){.parents = NULL};
        return vd_impostor_no_memory();
    }
    vd_brick_find_parents(bricks, parents);
    file->parents = parents;
    return vd_success();
}

void vd_impostors_release_bricks(vd_impostors *set) {
    vd_impostor_placing *p = &set->placing;
    for (uint32_t i = 0; p->files != NULL && i < vd_world_asset_count(set->world); i++) {
        vd_release(set->context, p->files[i].parents);
        vd_release(set->context, p->files[i].brick_of);
        vd_release(set->context, p->files[i].marks);
        vd_release(set->context, p->files[i].whole);
    }
    vd_release(set->context, p->files);
    vd_release(set->context, p->clouds.data);
    vd_release(set->context, p->bricks.data);
    vd_release(set->context, p->cut.data);
    vd_release(set->context, p->sent.data);
    vd_release(set->context, p->blocks.memory);
}

uint64_t vd_impostor_brick_id(const vd_impostor_brick *brick) {
    return BRICK_IDS | (uint64_t)brick->asset << 32 | brick->node;
}

vd_impostor_brick *vd_impostor_find_brick(const vd_impostors *set, uint64_t id) {
    const vd_impostor_placing *p = &set->placing;
    const uint64_t asset = (id & ~((uint64_t)255 << 56)) >> 32;
    const uint32_t node = (uint32_t)id;
    if (id >> 56 != BRICK_IDS >> 56 || p->files == NULL ||
        asset >= vd_world_asset_count(set->world) || p->files[asset].parents == NULL ||
        node >= vd_impostor_particles(set, (uint32_t)asset)->bricks->node_count ||
        p->files[asset].brick_of[node] == 0) {
        return NULL;
    }
    return vd_impostor_brick_at(set, p->files[asset].brick_of[node] - 1);
}

uint32_t vd_impostor_brick_of(vd_impostors *set, uint32_t asset, uint32_t node) {
    vd_impostor_file *file = &set->placing.files[asset];
    if (file->brick_of[node] == 0) {
        vd_impostor_brick *made = vd_list_add(set->context, &set->placing.bricks, 1, sizeof *made);
        if (made == NULL) {
            return 0;
        }
        *made = (vd_impostor_brick){
            .asset = asset,
            .node = node,
            .bytes = vd_brick_pack_bytes(vd_impostor_particles(set, asset)->bricks, node,
                                         &vd_impostor_particles(set, asset)->view)};
        file->brick_of[node] = (uint32_t)set->placing.bricks.count;
    }
    return file->brick_of[node];
}

/* ---- what is hidden ---------------------------------------------------------------------------*/

bool vd_impostor_cloud_is_hidden(const vd_impostors *set, const vd_impostor_stand *stand,
                                 const vd_camera *camera, const vd_frame *front) {
    const vd_cloud *cloud = vd_impostor_cloud(set, stand->node);
    vd_brick brick;
    int seen = 0, hidden = 0;
    if (vd_bricks_brick(vd_impostor_particles(set, cloud->bricks)->bricks, cloud->root, &brick)
            .code != VD_OK) {
        return true;
    }
    const uint32_t step = brick.count / LOOKED_AT + 1;
    for (uint32_t i = 0; i < brick.count; i += step) {
        const vd_vec3 at = {brick.origin[0] + brick.step[0] * brick.x[i],
                            brick.origin[1] + brick.step[1] * brick.y[i],
                            brick.origin[2] + brick.step[2] * brick.z[i]};
        vd_impostor_count_hidden(camera, front, at, &seen, &hidden);
    }
    return hidden > VD_IMPOSTOR_MOST_HIDDEN * seen;
}

/* ---- items ------------------------------------------------------------------------------------*/

/* How much lower a node appears than it is, where it is chosen first. */
static double drop_of(const vd_impostors *set, const vd_bricks_node *n) {
    const vd_impostor_view view =
        vd_impostors_view(set, &set->rest_camera, set->rest_width, set->rest_height);
    const double x = 0.5 * (n->min[0] + n->max[0]) - view.camera.eye.x;
    const double y = 0.5 * (n->min[1] + n->max[1]) - view.camera.eye.y;
    return view.drop_per_m2 * (x * x + y * y);
}

/* Packs a brick to `out`; what is damaged is left out, and its object skipped for a while. */
static vd_status list_brick(vd_impostors *set, vd_impostor_brick *b, uint8_t *out, size_t *bytes) {
    const vd_brick_asset *asset = vd_impostor_particles(set, b->asset);
    const vd_bricks_node *n = &asset->bricks->nodes[b->node];
    const vd_status status = vd_brick_pack(set->context, asset->bricks, b->node, &asset->view,
                                           &asset->splat, out, bytes);
    if (status.code == VD_ERROR_MEMORY) {
        return status;
    }
    if (status.code != VD_OK) {
        b->refused = true;
        *bytes = 0;
        return vd_success();
    }
    b->bytes = *bytes;
    b->version = ++set->versions;
    return vd_impostors_add_item(
        set, &(vd_impostor_item){
                 .kind = VD_IMPOSTOR_BRICK,
                 .place.origin = vd_vec3_make(n->min[0], n->min[1], n->min[2] - drop_of(set, n)),
                 .block = out,
                 .block_bytes = *bytes,
                 .id = vd_impostor_brick_id(b),
                 .version = b->version});
}

vd_status vd_impostors_list_bricks(vd_impostors *set) {
    vd_impostor_placing *p = &set->placing;
    const uint32_t *sent = p->sent.data;
    size_t bytes = 0;
    for (size_t i = 0; i < p->sent.count; i++) {
        bytes += vd_impostor_brick_at(set, sent[i])->bytes;
    }
    if (bytes == 0) {
        return vd_success();
    }
    vd_status status = vd_buffer_reserve(set->context, &p->blocks, "bricks for a client", bytes, 1);
    uint8_t *at = p->blocks.memory;
    for (size_t i = 0; i < p->sent.count && status.code == VD_OK; i++) {
        vd_impostor_brick *b = vd_impostor_brick_at(set, sent[i]);
        size_t took = 0;
        status = list_brick(set, b, at, &took);
        at += took;
    }
    return status;
}

vd_status vd_impostors_order_bricks(vd_impostors *set) {
    const vd_impostor_placing *p = &set->placing;
    const uint32_t *cut = p->cut.data;
    vd_status status = vd_success();
    for (size_t i = 0; i < p->cut.count && status.code == VD_OK; i++) {
        const vd_impostor_brick *b = vd_impostor_brick_at(set, cut[i]);
        if (b->delivered) {
            status = vd_impostors_add_id(set, vd_impostor_brick_id(b));
        }
    }
    return status;
}

void vd_impostors_give_up_bricks(vd_impostors *set) {
    for (uint32_t i = 0; i < set->placing.bricks.count; i++) {
        vd_impostor_brick *b = vd_impostor_brick_at(set, i);
        if (b->delivered && b->used != set->update) {
            b->gone = true;
            b->delivered = false;
        }
    }
}

vd_status vd_impostors_gone_bricks(vd_impostors *set) {
    vd_status status = vd_success();
    for (uint32_t i = 0; i < set->placing.bricks.count && status.code == VD_OK; i++) {
        vd_impostor_brick *b = vd_impostor_brick_at(set, i);
        if (b->gone) {
            b->gone = false;
            set->placing.bytes -= b->bytes;
            status = vd_impostors_add_id(set, vd_impostor_brick_id(b));
        }
    }
    return status;
}

/* world_arrange.c: the tree.
 *
 * Objects in the order of the Morton codes of their anchors (x and y, 32 bits each of the world's
 * extent), ties in the order in which they came; then particles, which fill space, in that of x, y
 * and z (21 bits each of theirs). Every 16 that follow each other become a group, every 16 groups
 * one, until 16 are left, which stand below the root. The terrain is the root's first child. So
 * 10^6 objects lie six levels deep, and ids have room for 255 children and eight levels. What
 * stands together is seen, hidden and drawn together.
 */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "core/core.h"
#include "world/world_internal.h"

#define FAN 16

typedef struct placed {
    uint64_t key;
    uint32_t entry;
    bool cloud;
} placed;

static int compare(const void *a, const void *b) {
    const placed *x = a, *y = b;
    if (x->cloud != y->cloud) {
        return x->cloud ? 1 : -1;
    }
    return x->key != y->key ? (x->key > y->key) - (x->key < y->key)
                            : (x->entry > y->entry) - (x->entry < y->entry);
}

/* Spreads 32 bits to every second of 64. */
static uint64_t spread(uint32_t bits) {
    uint64_t x = bits;
    x = (x | x << 16) & 0x0000ffff0000ffffu;
    x = (x | x << 8) & 0x00ff00ff00ff00ffu;
    x = (x | x << 4) & 0x0f0f0f0f0f0f0f0fu;
    x = (x | x << 2) & 0x3333333333333333u;
    return (x | x << 1) & 0x5555555555555555u;
}

/* Spreads 21 bits to every third of 63. */
static uint64_t spread_three(uint32_t bits) {
    uint64_t x = bits;
    x = (x | x << 32) & 0x001f00000000ffffu;
    x = (x | x << 16) & 0x001f0000ff0000ffu;
    x = (x | x << 8) & 0x100f00f00f00f00fu;
    x = (x | x << 4) & 0x10c30c30c30c30c3u;
    return (x | x << 2) & 0x1249249249249249u;
}

static uint32_t quantise(double at, double low, double scale, double most) {
    const double q = (at - low) * scale;
    return q >= most ? (uint32_t)most : q > 0.0 ? (uint32_t)q : 0u;
}

/* Where anchors of one kind lie. */
typedef struct extent {
    vd_vec3 min, max;
    bool any;
} extent;

static void grow(extent *in, vd_vec3 at) {
    in->min = in->any ? vd_vec3_min(in->min, at) : at;
    in->max = in->any ? vd_vec3_max(in->max, at) : at;
    in->any = true;
}

static uint64_t key_of(const extent *in, vd_vec3 at, bool cloud) {
    const double most = cloud ? 2097151.0 : 4294967295.0;
    const vd_vec3 size = vd_vec3_subtract(in->max, in->min);
    const double side = fmax(fmax(size.x, size.y), cloud ? size.z : 0.0);
    const double scale = side > 0.0 ? most / side : 0.0;
    const uint32_t x = quantise(at.x, in->min.x, scale, most);
    const uint32_t y = quantise(at.y, in->min.y, scale, most);
    const uint32_t z = quantise(at.z, in->min.z, scale, most);
    return cloud ? spread_three(x) | spread_three(y) << 1 | spread_three(z) << 2
                 : spread(x) | spread(y) << 1;
}

/* Objects but the terrain, sorted. Returns how many. */
static size_t sort_objects(const vd_world *world, placed *out) {
    extent in[2] = {{.any = false}, {.any = false}}; /* of others, of clouds */
    size_t count = 0;
    for (size_t i = 0; i < world->entry_list.count; i++) {
        const vd_object *object = world->entries[i].object;
        if (object->kind != VD_OBJECT_TERRAIN) {
            const bool cloud = object->kind == VD_OBJECT_PARTICLES;
            grow(&in[cloud], object->anchor);
            out[count++] = (placed){.entry = (uint32_t)i, .cloud = cloud};
        }
    }
    for (size_t i = 0; i < count; i++) {
        const vd_vec3 at = world->entries[out[i].entry].object->anchor;
        out[i].key = key_of(&in[out[i].cloud], at, out[i].cloud);
    }
    qsort(out, count, sizeof *out, compare);
    return count;
}

/* Nodes of each level, the placed objects' first. Returns the number of levels. */
static int count_levels(size_t count, size_t counts[VD_OBJECT_MAX_DEPTH]) {
    int levels = 0;
    counts[levels++] = count;
    while (counts[levels - 1] > FAN) {
        counts[levels] = (counts[levels - 1] + FAN - 1) / FAN;
        levels++;
    }
    return levels;
}

static vd_node leaf(const vd_world *world, uint32_t entry) {
    vd_node node = {.entry = entry, .placed = 1};
    const uint32_t kind = world->entries[entry].object->kind;
    node.kind = (uint8_t)kind;
    node.names = kind == VD_OBJECT_LABEL;
    node.loose = node.names || kind == VD_OBJECT_LINE || kind == VD_OBJECT_PARTICLES;
    node.grounded = !node.loose;
    node.clouds = kind == VD_OBJECT_PARTICLES;
    const vd_object *object = world->entries[entry].object;
    node.planed = object->plane[0] != 0 || object->plane[1] != 0 || object->plane[2] != 0;
    vd_object_bounds(object, &node.min, &node.max);
    return node;
}

/* Places the levels breadth first behind the root and the terrain, the top level first, and joins
 * them. */
static void fill_nodes(vd_world *world, const placed *order, const size_t *counts, int levels,
                       size_t terrain) {
    vd_node *nodes = world->nodes;
    size_t begin = 1 + terrain;
    nodes[0] = (vd_node){.first = 1, .count = (uint32_t)(terrain + counts[levels - 1])};
    for (int level = levels - 1; level >= 0; level--) {
        const size_t below = begin + counts[level];
        for (size_t i = 0; i < counts[level]; i++) {
            vd_node *node = &nodes[begin + i];
            if (level == 0) {
                *node = leaf(world, order[i].entry);
                continue;
            }
            const size_t left = counts[level - 1] - i * FAN;
            *node = (vd_node){.first = (uint32_t)(below + i * FAN),
                              .count = (uint32_t)(left < FAN ? left : FAN)};
        }
        begin = below;
    }
}

/* Ids and bounds: ids downwards, bounds upwards. */
static void settle_nodes(vd_world *world) {
    vd_node *nodes = world->nodes;
    for (size_t i = 0; i < world->node_count; i++) {
        for (uint32_t k = 0; k < nodes[i].count; k++) {
            nodes[nodes[i].first + k].id = vd_object_child_id(nodes[i].id, (int)k + 1);
        }
        if (nodes[i].count == 0 && i > 0) {
            world->entries[nodes[i].entry].object->id = nodes[i].id;
        }
    }
    for (size_t i = world->node_count; i-- > 0;) {
        for (uint32_t k = 0; k < nodes[i].count; k++) {
            const vd_node *child = &nodes[nodes[i].first + k];
            nodes[i].placed += child->placed;
            nodes[i].names = nodes[i].names || child->names;
            nodes[i].loose = nodes[i].loose || child->loose;
            nodes[i].grounded = nodes[i].grounded || child->grounded;
            nodes[i].clouds = (k == 0 || nodes[i].clouds) && child->clouds;
            nodes[i].min = k == 0 ? child->min : vd_vec3_min(nodes[i].min, child->min);
            nodes[i].max = k == 0 ? child->max : vd_vec3_max(nodes[i].max, child->max);
        }
    }
}

/* The heads of groups, for vd_world_find. */
static vd_status make_groups(vd_world *world) {
    vd_status status = vd_success();
    for (size_t i = 1; i < world->node_count && status.code == VD_OK; i++) {
        const vd_node *node = &world->nodes[i];
        if (node->count == 0) {
            continue;
        }
        vd_object *group = NULL;
        status = vd_object_make(world->context, VD_OBJECT_GROUP, sizeof *group,
                                vd_vec3_scale(vd_vec3_add(node->min, node->max), 0.5), &group);
        if (status.code == VD_OK) {
            const vd_vec3 low = vd_vec3_subtract(node->min, group->anchor);
            const vd_vec3 high = vd_vec3_subtract(node->max, group->anchor);
            group->id = node->id;
            vd_object_bound_first(group, (const double[3]){low.x, low.y, low.z});
            vd_object_bound_more(group, (const double[3]){high.x, high.y, high.z});
            world->groups[i] = group;
        }
    }
    return status;
}

vd_status vd_world_arrange(vd_world *world, vd_job *job) {
    if (world->nodes != NULL) {
        return vd_success();
    }
    if (vd_job_stopped(job)) {
        return vd_failure(VD_ERROR_CANCELLED, "cancelled");
    }
    const size_t entries = world->entry_list.count;
    placed *order = vd_allocate(world->context, entries + 1, sizeof *order);
    if (order == NULL) {
        return vd_out_of_memory("a world's tree", entries * sizeof *order);
    }
    size_t counts[VD_OBJECT_MAX_DEPTH], nodes = 1;
    const size_t count = sort_objects(world, order), terrain = entries - count;
    const int levels = count_levels(count, counts);
    for (int i = 0; i < levels; i++) {
        nodes += counts[i];
    }
    nodes += terrain;
    world->nodes = vd_allocate_zero(world->context, nodes, sizeof *world->nodes);
    world->groups = vd_allocate_zero(world->context, nodes, sizeof(vd_object *));
    if (world->nodes == NULL || world->groups == NULL) {
        vd_release(world->context, order);
        vd_world_disarrange(world);
        return vd_out_of_memory("a world's tree", nodes * sizeof *world->nodes);
    }
    world->node_count = nodes;
    if (terrain > 0) {
        world->nodes[1] = leaf(world, 0);
    }
    fill_nodes(world, order, counts, levels, terrain);
    settle_nodes(world);
    vd_release(world->context, order);
    const vd_status status = make_groups(world);
    if (status.code != VD_OK) {
        vd_world_disarrange(world);
    }
    return status;
}

/* world.c: what is in a world. */
#include <math.h>
#include <string.h>
#include "world/world_internal.h"
#include "world/world_shader.h"

#define MOST_ASSETS ((size_t)1 << 20)
#define MOST_OBJECTS ((size_t)1 << 24)

vd_world_def vd_world_def_default(void) {
    vd_world_def def = {.terrain = vd_terrain_def_default()};
    return def;
}

/* A square of a metre in the plane y = 0, seen from the south, its foot's middle at the origin. Lit
 * as level ground is: a picture has light of its own. */
static vd_status make_quad(vd_world *world) {
    static const float positions[4][3] = {
        {-0.5f, 0.0f, 0.0f}, {0.5f, 0.0f, 0.0f}, {0.5f, 0.0f, 1.0f}, {-0.5f, 0.0f, 1.0f}};
    static const float normals[4][3] = {{0, 0, 1}, {0, 0, 1}, {0, 0, 1}, {0, 0, 1}};
    static const float uvs[4][2] = {{0.0f, 1.0f}, {1.0f, 1.0f}, {1.0f, 0.0f}, {0.0f, 0.0f}};
    static const uint32_t indices[6] = {0, 1, 2, 0, 2, 3};
    vd_mesh_def def = vd_mesh_def_default();
    def.vertex_count = 4;
    def.positions = &positions[0][0];
    def.normals = &normals[0][0];
    def.uvs = &uvs[0][0];
    def.index_count = 6;
    def.indices = indices;
    return vd_mesh_create(world->context, &def, &world->quad);
}

/* A terrain of holes only, for worlds without one: what is drawn of it is the sky. */
static vd_status make_no_terrain(vd_world *world) {
    static const float holes[4] = {-INFINITY, -INFINITY, -INFINITY, -INFINITY};
    vd_heightfield_def def = vd_heightfield_def_default();
    def.width = def.height = 2;
    def.type = VD_HEIGHT_F32;
    def.heights = holes;
    def.height_stride = 2;
    const vd_status status = vd_heightfield_create(world->context, &def, &world->no_terrain);
    if (status.code == VD_OK) {
        world->def.terrain.heightfield = world->no_terrain;
        world->def.terrain.shadows = world->def.terrain.mip = false;
    }
    return status;
}

/* The terrain stands in the tree like everything else. */
static vd_status add_terrain(vd_world *world) {
    const vd_heightfield *h = world->def.terrain.heightfield;
    vd_vec3 min = {-1e9, -1e9, -1e5}, max = {1e9, 1e9, 1e5};
    if (h != NULL) {
        vd_heightfield_bounds(h, &min, &max);
        if (h->wraps != 0) {
            min.x = min.y = -1e9;
            max.x = max.y = 1e9;
        }
        min.z *= world->def.terrain.exaggeration;
        max.z *= world->def.terrain.exaggeration;
    }
    const vd_vec3 middle = vd_vec3_scale(vd_vec3_add(min, max), 0.5);
    vd_object *object = NULL;
    const vd_status status =
        vd_object_make(world->context, VD_OBJECT_TERRAIN, sizeof(vd_object), middle, &object);
    if (status.code != VD_OK) {
        return status;
    }
    const vd_vec3 low = vd_vec3_subtract(min, object->anchor);
    const vd_vec3 high = vd_vec3_subtract(max, object->anchor);
    vd_object_bound_first(object, (const double[3]){low.x, low.y, low.z});
    vd_object_bound_more(object, (const double[3]){high.x, high.y, high.z});
    return vd_world_add(world, &object);
}

vd_status vd_world_create(vd_context *context, const vd_world_def *def, vd_world **out) {
    vd_world *world = vd_allocate_zero(context, 1, sizeof *world);
    if (world == NULL) {
        return vd_out_of_memory("a world", sizeof *world);
    }
    world->context = context;
    world->def = def != NULL ? *def : vd_world_def_default();
    const bool empty =
        world->def.terrain.heightfield == NULL && world->def.terrain.function == NULL;
    vd_status status = make_quad(world);
    if (status.code == VD_OK) {
        status = empty ? make_no_terrain(world) : add_terrain(world);
    }
    if (status.code != VD_OK) {
        vd_world_destroy(&world);
        return status;
    }
    *out = world;
    return status;
}

void vd_world_disarrange(vd_world *world) {
    for (size_t i = 0; i < world->node_count; i++) {
        vd_object_destroy(world->context, &world->groups[i]);
    }
    vd_release(world->context, world->groups);
    vd_release(world->context, world->nodes);
    world->groups = NULL;
    world->nodes = NULL;
    world->node_count = 0;
}

void vd_world_destroy(vd_world **world_pointer) {
    vd_world *world = world_pointer != NULL ? *world_pointer : NULL;
    if (world == NULL) {
        return;
    }
    vd_world_disarrange(world);
    for (size_t i = 0; i < world->entry_list.count; i++) {
        vd_entry *entry = &world->entries[i];
        const vd_object_kind_entry *kind = vd_object_kinds[entry->object->kind];
        if (kind->close != NULL) {
            kind->close(world, entry->live);
        }
        vd_object_destroy(world->context, &entry->object);
    }
    for (size_t i = 0; i < vd_world_asset_count(world); i++) {
        vd_model_destroy(&world->assets[i].model);
        vd_texture_destroy(&world->assets[i].texture);
        vd_brick_asset_destroy(world->context, &world->assets[i].bricks);
    }
    vd_release(world->context, world->entry_list.data);
    vd_release(world->context, world->asset_list.data);
    vd_mesh_destroy(world->context, &world->quad);
    vd_heightfield_destroy(world->context, &world->no_terrain);
    vd_release(world->context, world);
    *world_pointer = NULL;
}

/* ---- assets -----------------------------------------------------------------------------------*/

vd_status vd_world_add_asset(vd_world *world, const vd_asset *asset, uint32_t *number) {
    if (vd_world_asset_count(world) >= MOST_ASSETS) {
        return vd_failure(VD_ERROR_LIMIT,
                          "a world holds at most %zu models, pictures and brick files",
                          MOST_ASSETS);
    }
    vd_asset *to = vd_list_add(world->context, &world->asset_list, 1, sizeof *to);
    if (to == NULL) {
        return vd_out_of_memory("a world's models", sizeof *to);
    }
    *to = *asset;
    world->assets = world->asset_list.data;
    *number = (uint32_t)vd_world_asset_count(world) - 1;
    return vd_success();
}

vd_status vd_world_add_model(vd_world *world, vd_model **model, uint32_t *number) {
    vd_asset asset = {.kind = VD_ASSET_MODEL, .model = *model};
    asset.draw_count = vd_model_draws(*model, asset.draws);
    for (int i = 0; i < asset.draw_count; i++) {
        asset.triangles += asset.draws[i].mesh->primitive_count;
        asset.shaders[i] = asset.draws[i].mesh->topology == VD_TOPOLOGY_TRIANGLES
                               ? vd_world_shader_for(&asset.draws[i], (*model)->has_colors)
                               : vd_shader_find(VD_SHADING_ALBEDO);
    }
    const vd_status status = vd_world_add_asset(world, &asset, number);
    if (status.code == VD_OK) {
        *model = NULL;
    }
    return status;
}

vd_status vd_world_add_picture(vd_world *world, const vd_picture *picture, uint32_t *number) {
    vd_asset asset = {.kind = VD_ASSET_PICTURE};
    vd_status status = vd_texture_create(world->context, picture, &asset.texture);
    if (status.code != VD_OK) {
        return status;
    }
    asset.solid = vd_material_default();
    asset.solid.albedo = (vd_linear){1.0f, 1.0f, 1.0f};
    asset.solid.specular = (vd_linear){0.0f, 0.0f, 0.0f};
    asset.solid.texture = asset.texture;
    asset.soft = asset.solid;
    asset.solid.alpha_test = 0.996f;
    asset.soft.blend = true;
    status = vd_world_add_asset(world, &asset, number);
    if (status.code != VD_OK) {
        vd_texture_destroy(&asset.texture);
    }
    return status;
}

/* ---- objects ----------------------------------------------------------------------------------*/

static vd_status check_asset(const vd_world *world, const vd_object *object) {
    static const char *const names[] = {"model", "picture", "brick file"};
    vd_asset_kind wanted = VD_ASSET_MODEL;
    const uint32_t number = vd_object_kinds[object->kind]->asset(object, &wanted);
    if (number < vd_world_asset_count(world) && world->assets[number].kind == wanted) {
        return vd_success();
    }
    return vd_failure(VD_ERROR_ARGUMENT, "there is no %s %u in the world; add it first",
                      names[wanted], number);
}

vd_status vd_world_add(vd_world *world, vd_object **object) {
    const vd_object_kind_entry *kind = vd_object_kinds[(*object)->kind];
    vd_status status = kind->asset != NULL ? check_asset(world, *object) : vd_success();
    if (status.code == VD_OK && world->entry_list.count >= MOST_OBJECTS) {
        status = vd_failure(VD_ERROR_LIMIT, "a world holds at most %zu objects", MOST_OBJECTS);
    }
    void *live = NULL;
    if (status.code == VD_OK && kind->open != NULL) {
        status = kind->open(world, *object, &live);
    }
    if (status.code != VD_OK) {
        return status;
    }
    vd_entry *to = vd_list_add(world->context, &world->entry_list, 1, sizeof *to);
    if (to == NULL) {
        if (kind->close != NULL) {
            kind->close(world, live);
        }
        return vd_out_of_memory("a world's objects", sizeof *to);
    }
    to->object = *object;
    to->live = live;
    world->entries = world->entry_list.data;
    vd_world_disarrange(world);
    *object = NULL;
    return status;
}

/* ---- asking -----------------------------------------------------------------------------------*/

const vd_world_def *vd_world_look(const vd_world *world) {
    return &world->def;
}

void vd_world_set_look(vd_world *world, const vd_terrain_def *terrain) {
    vd_terrain_def *own = &world->def.terrain;
    const vd_terrain_def old = *own;
    *own = *terrain;
    own->heightfield = old.heightfield;
    own->function = old.function;
    own->cell_m = old.cell_m;
    own->exaggeration = old.exaggeration;
    if (world->no_terrain != NULL) {
        own->shadows = own->mip = false;
    }
}

size_t vd_world_object_count(const vd_world *world) {
    return world->entry_list.count;
}

uint64_t vd_world_particle_count(const vd_world *world) {
    uint64_t count = 0;
    for (size_t i = 0; i < vd_world_asset_count(world); i++) {
        const vd_asset *asset = &world->assets[i];
        count += asset->kind == VD_ASSET_BRICKS ? asset->bricks->bricks->count : 0;
    }
    return count;
}

const vd_node *vd_world_node(const vd_world *world, uint64_t id) {
    const vd_node *node = world->nodes;
    for (; id != 0 && node != NULL; id <<= 8) {
        const uint32_t number = (uint32_t)(id >> 56);
        node =
            number >= 1 && number <= node->count ? &world->nodes[node->first + number - 1] : NULL;
    }
    return node;
}

const vd_object *vd_world_find(const vd_world *world, uint64_t id) {
    const vd_node *node = vd_world_node(world, id);
    return node == NULL       ? NULL
           : node->count == 0 ? world->entries[node->entry].object
                              : world->groups[node - world->nodes];
}

int vd_world_child_count(const vd_world *world, uint64_t id) {
    const vd_node *node = vd_world_node(world, id);
    return node != NULL ? (int)node->count : 0;
}

bool vd_world_bounds(const vd_world *world, vd_vec3 *min, vd_vec3 *max) {
    bool any = false;
    for (size_t i = 0; i < world->entry_list.count; i++) {
        vd_vec3 low, high;
        if (world->entries[i].object->kind == VD_OBJECT_TERRAIN) {
            continue;
        }
        vd_object_bounds(world->entries[i].object, &low, &high);
        *min = any ? vd_vec3_min(*min, low) : low;
        *max = any ? vd_vec3_max(*max, high) : high;
        any = true;
    }
    return any;
}

double vd_world_ground(const vd_world *world, double x, double y) {
    const vd_terrain_def *t = &world->def.terrain;
    if (t->function != NULL) {
        const float at[2] = {(float)x, (float)y};
        float height = 0.0f;
        vd_function_evaluate(t->function, 1, &at[0], &at[1], &height, NULL);
        return t->exaggeration * (double)height;
    }
    return t->exaggeration * vd_heightfield_height_at(t->heightfield, x, y);
}

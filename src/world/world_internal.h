/* world_internal.h: the insides of a vd_world.
 *
 * Placed objects stand in `entries` in the order in which they came. Arranging makes `nodes`: the
 * tree, breadth first, so that siblings lie side by side; node 0 is the root. What culling reads of
 * an object is repeated in its node: a walk over groups that are not seen touches nothing else.
 */
#ifndef VEDUTA_WORLD_WORLD_INTERNAL_H
#define VEDUTA_WORLD_WORLD_INTERNAL_H

#include "world/object_kinds.h"

/* Particles as an asset, and how they are drawn. */
typedef struct vd_brick_asset {
    vd_bricks *bricks; /* owned */
    vd_brick_view_def view;
    vd_splat_def splat; /* its colormap is the one here */
    vd_colormap colormap;
    bool placed; /* every particle stands in the world, below some object */
} vd_brick_asset;

typedef struct vd_asset {
    vd_asset_kind kind;
    vd_model *model;                             /* owned */
    vd_draw draws[VD_TOPOLOGY_COUNT];            /* of the model, in its own space */
    const vd_shader *shaders[VD_TOPOLOGY_COUNT]; /* that light them */
    int draw_count;
    uint64_t triangles;
    vd_texture *texture;     /* of the picture, owned */
    vd_material solid, soft; /* what of it covers wholly, and in part */
    vd_brick_asset *bricks;  /* owned */
} vd_asset;

typedef struct vd_entry {
    vd_object *object; /* owned */
    void *live;        /* what its kind has opened */
} vd_entry;

typedef struct vd_node {
    vd_vec3 min, max;
    uint32_t first, count; /* children: nodes; none: a placed object */
    uint32_t entry;        /* of a placed object */
    uint32_t placed;       /* placed objects below and here */
    uint8_t kind;          /* vd_object_kind; a group's is VD_OBJECT_GROUP */
    bool names;            /* a label among them */
    bool loose, grounded;  /* some are labels, lines, particles; some stand on the ground */
    bool clouds;           /* all are particles */
    bool planed;           /* a placed object that says in which plane its pictures lie */
    uint64_t id;
} vd_node;

struct vd_world {
    vd_context *context;
    vd_world_def def;
    vd_asset *assets; /* [asset_count] */
    vd_list asset_list, entry_list;
    vd_entry *entries;  /* [entry_count] */
    vd_node *nodes;     /* [node_count]; null until arranged */
    vd_object **groups; /* [node_count]: heads of groups, null for placed objects */
    size_t node_count;
    vd_mesh *quad;              /* one metre wide and high, the foot at the origin */
    vd_heightfield *no_terrain; /* all holes: draws the sky */
};

static inline size_t vd_world_asset_count(const vd_world *world) {
    return world->asset_list.count;
}

/* Adds an asset, which is copied. Returns VD_ERROR_LIMIT or VD_ERROR_MEMORY. */
VD_MUST_USE vd_status vd_world_add_asset(vd_world *world, const vd_asset *asset, uint32_t *number);

/* ---- world_bricks.c */
void vd_brick_asset_destroy(vd_context *context, vd_brick_asset **asset);

/* Forgets the tree. */
void vd_world_disarrange(vd_world *world);

/* The node of an id; null when there is none. */
const vd_node *vd_world_node(const vd_world *world, uint64_t id);

/* ---- what lines are drawn with --------------------------------------------------------------- */

typedef struct vd_line_live {
    vd_mesh *mesh;
    vd_material material;
} vd_line_live;

/* Lines on the ground must not sink into it: they are drawn a little nearer than they are. And a
 * line may be long, so each vertex is lowered by curvature. */
struct vd_line_view {
    vd_vec3 eye;
    double drop_per_m2;
    float nearer; /* factor on depth */
};

extern const vd_shader vd_line_shader;

#endif

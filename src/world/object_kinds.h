/* object_kinds.h: what tells one kind of object from another: a table with one entry a kind, each
 * in a file of its own. A new kind is a file and an entry. */
#ifndef VEDUTA_WORLD_OBJECT_KINDS_H
#define VEDUTA_WORLD_OBJECT_KINDS_H

#include <veduta/object.h>
#include "world/pass.h"

typedef struct vd_object_kind_entry {
    const char *name;
    size_t least_bytes; /* of a block */
    /* Checks what stands behind the head of a block from outside, whose size_bytes are there.
     * Returns null, or the name of the field that is wrong. */
    const char *(*check)(const vd_object *object);
    /* The number of the asset that it shows; null: kinds without one. */
    uint32_t (*asset)(const vd_object *object, vd_asset_kind *kind);
    /* Makes what drawing needs beyond the block, when the object comes into a world; null: nothing.
     */
    vd_status (*open)(vd_world *world, const vd_object *object, void **live);
    void (*close)(vd_world *world, void *live);
    /* Adds what is seen of it to a picture. */
    vd_status (*draw)(vd_pass *pass, const vd_object *object, const void *live);
    /* Null: the corners of the bounds. */
    int (*key_points)(const vd_object *object, vd_vec3 out[VD_OBJECT_KEY_POINTS]);
} vd_object_kind_entry;

extern const vd_object_kind_entry *const vd_object_kinds[VD_OBJECT_KIND_COUNT];

extern const vd_object_kind_entry vd_group_kind, vd_terrain_kind, vd_instance_kind, vd_sprite_kind,
    vd_line_kind, vd_label_kind, vd_cloud_kind;

/* Makes the head of a block of `size_bytes`, the rest cleared; *out is the caller's. The anchor is
 * rounded. Returns VD_ERROR_ARGUMENT (not finite, too far) or VD_ERROR_MEMORY. */
VD_MUST_USE vd_status vd_object_make(vd_context *context, vd_object_kind kind, size_t size_bytes,
                                     vd_vec3 anchor, vd_object **out);

/* The floats next to a double: not above it, not below it. */
float vd_below(double x);
float vd_above(double x);

/* Sets the bounds around points relative to the anchor: first, then others. */
void vd_object_bound_first(vd_object *object, const double point[3]);
void vd_object_bound_more(vd_object *object, const double point[3]);

/* ---- what the kinds keep ------------------------------------------------------------------- */

typedef struct vd_instance {
    vd_object head;
    uint32_t model;
    uint32_t shadowless;
    double linear[3][3];     /* world = anchor + linear · model */
    float least[3], most[3]; /* of the model, in its own space */
} vd_instance;

/* World from model, lowered by `drop_m`. */
vd_matrix vd_instance_place(const vd_instance *instance, double drop_m);

typedef struct vd_sprite {
    vd_object head;
    uint32_t picture;
    uint32_t tilts;
    double width_m, height_m;
} vd_sprite;

typedef struct vd_line {
    vd_object head;
    uint32_t count;
    uint32_t closed;
    double width_px;
    vd_rgba8 color;
    uint32_t reserved;
    float points[]; /* [count][3], relative to the anchor */
} vd_line;

typedef struct vd_label {
    vd_object head;
    uint32_t text_bytes, point_count, verb_count; /* text_bytes with its end */
    uint32_t hidden;
    float advance, ascent, descent;
    vd_rgba8 color, halo;
    uint32_t reserved;
    double priority;
    double points[]; /* [point_count][2], then verbs [verb_count], then the text */
} vd_label;

typedef struct vd_cloud {
    vd_object head;
    uint32_t bricks;
    uint32_t root; /* checked against the asset when it comes into a world */
} vd_cloud;

static inline const uint8_t *vd_label_verbs(const vd_label *label) {
    return (const uint8_t *)(label->points + 2 * (size_t)label->point_count);
}

static inline const char *vd_label_text(const vd_label *label) {
    return (const char *)vd_label_verbs(label) + label->verb_count;
}

#endif

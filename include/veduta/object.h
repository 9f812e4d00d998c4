/* object.h: what a world is made of.
 *
 * A vd_object is the head of one relocatable block: this struct, then what its kind keeps. There
 * are no pointers inside and none between objects: one names another by a number. So a block can be
 * mapped from a file, sent to a machine, kept in a cache, and checked before it is used.
 *
 * There are placed objects, which stand in the world's tree, and assets, which placed ones show: a
 * thousand instances name one model. An object's id is its path in the tree: eight levels of a byte
 * each, the first level the highest byte, children numbered from 1 (Lawlor 2004, §4.1).
 */
#ifndef VEDUTA_OBJECT_H
#define VEDUTA_OBJECT_H

#include <stdbool.h>
#include <veduta/color.h>
#include <veduta/coverage.h>
#include <veduta/matrix.h>

VD_BEGIN_DECLARATIONS

typedef enum vd_object_kind {
    VD_OBJECT_GROUP = 0, /* has children, shows nothing itself */
    VD_OBJECT_TERRAIN,   /* the world's terrain */
    VD_OBJECT_INSTANCE,  /* a model, placed by an affine transform */
    VD_OBJECT_SPRITE,    /* a picture that faces the viewer, anchored at its foot */
    VD_OBJECT_LINE,      /* a polyline of a width in pixels */
    VD_OBJECT_LABEL,     /* a name at a place */
    VD_OBJECT_PARTICLES, /* a part of a brick file: a node of its octree and all below it */
    VD_OBJECT_KIND_COUNT
} vd_object_kind;

/* Returns "group", "terrain", "instance", "sprite", "line", "label" or "particles". */
VD_API const char *vd_object_kind_name(vd_object_kind kind);

typedef struct vd_object {
    uint8_t magic[8];     /* "VDOBJECT" */
    uint32_t kind;        /* vd_object_kind */
    uint32_t version;     /* grows with every change that can be seen; from 1 */
    uint64_t size_bytes;  /* of the whole block */
    uint64_t id;          /* its path; 0 until it stands in a tree */
    vd_vec3 anchor;       /* metres, on multiples of 2^-10 */
    float min[3], max[3]; /* bounds relative to the anchor, metres */
    int16_t plane[3]; /* normal of the plane that pictures of it lie in, times 32767, as impostor.h
                         has them; zeros: the best one */
    uint16_t reserved;
} vd_object;

/* The largest bounds' half-extent and the farthest anchor, metres. */
#define VD_OBJECT_MAX_METRES 1e12

/* ---- ids ------------------------------------------------------------------------------------ */

#define VD_OBJECT_MAX_CHILDREN 255
#define VD_OBJECT_MAX_DEPTH 8

/* Returns the id of child `number` (1 … 255) of `parent` (0: the root); 0 when the parent is at the
 * deepest level. */
VD_API uint64_t vd_object_child_id(uint64_t parent, int number);

/* Returns the id of the parent; 0, the root, for one at the first level. */
VD_API uint64_t vd_object_parent_id(uint64_t id);

/* Returns how deep an id lies: 0 the root, 1 … 8. */
VD_API int vd_object_depth(uint64_t id);

/* Returns whether `id` is `ancestor` or stands below it. */
VD_API bool vd_object_is_within(uint64_t id, uint64_t ancestor);

/* ---- making them ------------------------------------------------------------------------------
 * Each fills in a new block; *out is owned by the caller, or by the world that it is added to, and
 * ended by vd_object_destroy. They return VD_ERROR_ARGUMENT (names the field: a number that is not
 * finite or too far away, a count of 0), VD_ERROR_LIMIT or VD_ERROR_MEMORY. Anchors are rounded to
 * multiples of 2^-10 m. */
VD_API void vd_object_destroy(vd_context *context, vd_object **object);

typedef struct vd_instance_def {
    uint32_t model;      /* number of the asset */
    vd_matrix transform; /* world from model, affine, metres */
    vd_vec3 min, max;    /* of the model, in its own space: vd_model_bounds */
    bool shadowless;     /* throws none */
    vd_vec3 plane;       /* world: normal, of any length, of the plane that pictures of it lie in
                            (impostor.h), such as a wall's; zero: the best one */
} vd_instance_def;

VD_API VD_MUST_USE vd_status vd_instance_create(vd_context *context, const vd_instance_def *def,
                                                vd_object **out);

typedef struct vd_sprite_def {
    uint32_t picture;         /* number of the asset */
    vd_vec3 foot;             /* world: middle of the lower edge */
    double width_m, height_m; /* above 0 */
    bool tilts;               /* faces the eye from above too; else it stays upright */
} vd_sprite_def;

VD_API VD_MUST_USE vd_status vd_sprite_create(vd_context *context, const vd_sprite_def *def,
                                              vd_object **out);

typedef struct vd_line_def {
    const vd_vec3 *points; /* [count], world */
    size_t count;          /* at least 2 */
    bool closed;           /* from the last to the first, too */
    double width_px;       /* above 0, at most 64 */
    vd_rgba8 color;        /* straight sRGB */
} vd_line_def;

VD_API VD_MUST_USE vd_status vd_line_create(vd_context *context, const vd_line_def *def,
                                            vd_object **out);

/* What becomes of a label whose place is hidden behind hills or things. */
typedef enum vd_label_hidden {
    VD_LABEL_HIDE = 0, /* it is not shown */
    VD_LABEL_SHOW,     /* it is shown, with a line to its place */
    VD_LABEL_HIDDEN_COUNT
} vd_label_hidden;

/* Letters are outlines: fonts are needed where a label is made (text.h), not where it is drawn. */
typedef struct vd_label_def {
    const char *text;               /* UTF-8, for people and for searching; at most 1,024 bytes */
    vd_vec3 place;                  /* world */
    vd_path outline;                /* pixels, y down, the baseline's beginning at (0, 0) */
    float advance, ascent, descent; /* pixels */
    vd_rgba8 color, halo;           /* straight sRGB; halo alpha 0: none */
    double priority; /* the greater is placed first; peaks: their prominence in metres */
    vd_label_hidden hidden;
} vd_label_def;

VD_API VD_MUST_USE vd_status vd_label_create(vd_context *context, const vd_label_def *def,
                                             vd_object **out);

/* vd_world_add_particles makes these. */
typedef struct vd_cloud_def {
    uint32_t bricks;  /* number of the asset */
    uint32_t root;    /* node of its octree */
    vd_vec3 min, max; /* of the particles below, world, their radii included */
} vd_cloud_def;

VD_API VD_MUST_USE vd_status vd_cloud_create(vd_context *context, const vd_cloud_def *def,
                                             vd_object **out);

/* ---- looking at them ------------------------------------------------------------------------ */

/* Bounds in the world, metres. */
VD_API void vd_object_bounds(const vd_object *object, vd_vec3 *min, vd_vec3 *max);

/* The sphere around them. */
VD_API void vd_object_sphere(const vd_object *object, vd_vec3 *centre, double *radius);

/* The points by which the object is judged when it is seen from elsewhere (Lawlor 2004, §2.2.3): as
 * its kind has it, else the eight corners of its bounds. Writes at most VD_OBJECT_KEY_POINTS and
 * returns how many. */
#define VD_OBJECT_KEY_POINTS 16
VD_API int vd_object_key_points(const vd_object *object, vd_vec3 out[VD_OBJECT_KEY_POINTS]);

/* ---- packing ----------------------------------------------------------------------------------
 * A packed object is its block, which may lie anywhere at a multiple of 64 bytes. */

/* Checks a block that came from outside (every size, offset and number); safe for any bytes.
 * Returns VD_ERROR_FORMAT with the field that is wrong. */
VD_API VD_MUST_USE vd_status vd_object_validate(const void *block, size_t size_bytes);

/* Copies a checked block into a new object. Returns VD_ERROR_FORMAT or VD_ERROR_MEMORY. */
VD_API VD_MUST_USE vd_status vd_object_unpack(vd_context *context, const void *block,
                                              size_t size_bytes, vd_object **out);

VD_END_DECLARATIONS

#endif

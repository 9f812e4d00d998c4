/* model_build.h: what readers fill in, and what makes meshes of it.
 *
 * A reader adds positions, and for each corner of a triangle the number of its position and, where
 * the file has them, of its texture coordinates and normal. Numbers are checked by the reader,
 * which knows the line; vd_model_build trusts them.
 */
#ifndef VEDUTA_MODEL_MODEL_BUILD_H
#define VEDUTA_MODEL_MODEL_BUILD_H

#include <veduta/model.h>
#include "core/core.h"
#include "core/list.h"

/* Coordinates beyond this are refused: no float can tell the neighbours of such places apart, and
 * no camera stands there (the program's --eye ends here too). */
#define VD_MODEL_FARTHEST 1e15

/* More positions or corners than this do not fit the meshes' numbers. */
#define VD_MODEL_MAX_COUNT ((size_t)VD_MESH_MAX_VERTICES)

#define VD_NO_INDEX UINT32_MAX

/* Which numbers a corner has beside its position's. */
typedef enum vd_by { VD_BY_NONE = 0, VD_BY_POSITION, VD_BY_CORNER } vd_by;

typedef struct vd_model_builder {
    vd_context *context;
    const char *path; /* in error sentences */
    /* What went wrong, where a function returned false: a vd_status is 400 bytes, and handing one
     * up through five calls for each of a million faces took longer than reading them. */
    vd_status failure;
    vd_model_def def;
    vd_model *model; /* format and z_up are the reader's to fill in */
    vd_vec3 anchor;  /* positions are relative to it; set by the first one */
    vd_by normals_by, uvs_by;
    vd_list positions;           /* float [3] */
    vd_list colors;              /* float [3], linear, by position; as many as positions, or none */
    vd_list normals;             /* float [3] */
    vd_list uvs;                 /* float [2], (0, 0) the texture's upper left */
    vd_list corners;             /* uint32_t position, three a triangle */
    vd_list corner_normals;      /* uint32_t, with VD_BY_CORNER; VD_NO_INDEX: none */
    vd_list corner_uvs;          /* uint32_t, likewise */
    vd_list triangle_materials;  /* uint32_t, one a triangle; empty: all 0 */
    vd_list line_ends;           /* uint32_t position, two a line */
    vd_list dots;                /* uint32_t position, one a point */
    uint32_t material;           /* of the triangles that vd_builder_add_polygon adds */
    vd_list polygon;             /* scratch of vd_builder_add_polygon */
    vd_list materials, surfaces; /* vd_material, vd_model_surface: side by side */
    vd_list textures, texture_names; /* vd_texture *, char *: likewise, owned */
} vd_model_builder;

VD_MUST_USE vd_status vd_builder_init(vd_model_builder *builder, vd_context *context,
                                      const char *path, const vd_model_def *def);

/* Releases what is left; the model too unless vd_model_build has handed it over. */
void vd_builder_finish(vd_model_builder *builder);

/* Keeps a failure and returns false. */
bool vd_builder_fail(vd_model_builder *builder, vd_status failure);

/* Adds a position. False when it is not finite, too far away, or memory is out: vd_builder_refuse
 * finds which, keeps that and returns false. */
static inline bool vd_builder_add_position(vd_model_builder *b, double x, double y, double z);
bool vd_builder_refuse(vd_model_builder *builder, const char *where, double x, double y, double z);

/* One corner of a polygon or line. */
typedef struct vd_corner {
    uint32_t position, uv, normal; /* VD_NO_INDEX: none */
} vd_corner;

/* Adds a polygon of at least three corners, cut into triangles; a triangle. False, with the failure
 * kept, when memory is out or there are too many. */
VD_MUST_USE bool vd_builder_add_polygon(vd_model_builder *builder, const vd_corner *corners,
                                        size_t count);
VD_MUST_USE bool vd_builder_add_triangle(vd_model_builder *builder, const vd_corner corner[3]);

/* Appends a material; its number goes to *out. Returns VD_ERROR_MEMORY or VD_ERROR_LIMIT. */
VD_MUST_USE vd_status vd_builder_add_material(vd_model_builder *builder,
                                              const vd_material *material,
                                              const vd_model_surface *surface, uint32_t *out);

/* Finds or reads a texture by its path; its number goes to *out. `owner` says who names it, such as
 * "material wood of cube.mtl". */
VD_MUST_USE vd_status vd_builder_add_texture_file(vd_model_builder *builder, const char *path,
                                                  const char *owner, int *out);

/* Adds a texture from a picture, which stays the caller's. */
VD_MUST_USE vd_status vd_builder_add_texture(vd_model_builder *builder, const vd_picture *picture,
                                             const char *name, int *out);

/* Where the textures' numbers and modes of the surfaces become pointers and flags of the materials,
 * normals are computed and meshes made. On success the model is the caller's. */
VD_MUST_USE vd_status vd_model_build(vd_model_builder *builder, vd_model **out);

/* Computes normals of all triangles: *normals receives float [3] each, and each corner's number
 * goes to corner_normals; a number belongs to one position only, numbers rise with positions'.
 * *owner receives that position. */
VD_MUST_USE vd_status vd_model_normals(vd_context *context, const float *positions,
                                       size_t position_count, const uint32_t *corners,
                                       size_t corner_count, vd_list *normals, vd_list *owner,
                                       uint32_t *corner_normals);

/* Cuts a polygon into count − 2 triangles: numbers 0 … count − 1 of corners, three each, to `out`.
 * `points` are [count][3]. Ears are clipped (Meisters 1975) up to 256 corners; larger polygons, for
 * which that would take too long, become fans. `left` is scratch of `count`. */
void vd_triangulate(const double (*points)[3], size_t count, uint32_t *left, uint32_t (*out)[3]);

/* Readers of one format each. */
VD_MUST_USE vd_status vd_ply_read(vd_model_builder *builder, const char *text, size_t size_bytes);
VD_MUST_USE vd_status vd_off_read(vd_model_builder *builder, const char *text, size_t size_bytes);
VD_MUST_USE vd_status vd_obj_read(vd_model_builder *builder, const char *text, size_t size_bytes);

/* Joins the folder of `path` and `name` into the context's memory ('\\' becomes '/', absolute names
 * stay); null when memory is out. */
VD_MUST_USE char *vd_beside(vd_context *context, const char *path, const char *name,
                            size_t name_bytes);

static inline bool vd_is_place(double v) {
    return v >= -VD_MODEL_FARTHEST && v <= VD_MODEL_FARTHEST;
}

/* Positions far from the origin are kept relative to a whole number near the first of them, so that
 * a model in map coordinates keeps its millimetres. */
static inline double vd_anchor_of(double v) {
    return v > -1024.0 && v < 1024.0 ? 0.0 : (double)(int64_t)v;
}

static inline bool vd_builder_add_position(vd_model_builder *b, double x, double y, double z) {
    if (!vd_is_place(x) || !vd_is_place(y) || !vd_is_place(z) ||
        b->positions.count >= VD_MODEL_MAX_COUNT) {
        return false;
    }
    if (b->positions.count == 0) {
        b->anchor = vd_vec3_make(vd_anchor_of(x), vd_anchor_of(y), vd_anchor_of(z));
    }
    float *to = vd_list_add(b->context, &b->positions, 1, 3 * sizeof(float));
    if (to == NULL) {
        return false;
    }
    to[0] = (float)(x - b->anchor.x);
    to[1] = (float)(y - b->anchor.y);
    to[2] = (float)(z - b->anchor.z);
    return true;
}

#endif

/* model.h: triangle models from files, ready to be drawn.
 *
 *     vd_model *model = NULL;
 *     vd_status status = vd_model_load(context, "dragon.ply", NULL, &model);
 *     if (status.code == VD_OK) {
 *         vd_draw draws[VD_TOPOLOGY_COUNT];
 *         int count = vd_model_draws(model, draws);
 *         status = vd_raster_render(raster, NULL, &def, &camera, draws, count, frame, NULL);
 *     }
 *
 * The core reads OBJ with its MTL, PLY and OFF itself; model_import.h (library veduta-model) reads
 * glTF, STL, FBX and what else assimp reads. Everything that a file holds ends up in at most three
 * meshes, by what is joined: triangles, lines, points. Nodes are flattened, polygons cut into
 * triangles (a polygon need not be convex), triangles sorted by material, and where the file has no
 * normals they are computed: for each corner over the triangles around its place that turn by less
 * than 40 degrees, weighted as in Max 1999 ("Weights for computing vertex normals from facet
 * normals", Journal of Graphics Tools 4(2)), so that round things look round and edges stay edges.
 */
#ifndef VEDUTA_MODEL_H
#define VEDUTA_MODEL_H

#include <veduta/raster.h>

VD_BEGIN_DECLARATIONS

/* glTF 2.0, §3.9.4. */
typedef enum vd_alpha_mode {
    VD_ALPHA_OPAQUE = 0,
    VD_ALPHA_MASK,  /* there, or not there below a cutoff */
    VD_ALPHA_BLEND, /* blended over what is behind */
    VD_ALPHA_MODE_COUNT
} vd_alpha_mode;

/* What a file says of a material beyond vd_material. */
typedef struct vd_model_surface {
    char name[64]; /* UTF-8, cut; empty when the file gives none */
    vd_alpha_mode alpha_mode;
    float alpha_cutoff; /* of VD_ALPHA_MASK */
    int texture;        /* index into vd_model.textures, −1: none */
} vd_model_surface;

typedef struct vd_model {
    vd_context *context;
    char format[32];                    /* for people: "PLY, binary" */
    bool z_up;                          /* which axis points up in files of this format by custom */
    vd_mesh *meshes[VD_TOPOLOGY_COUNT]; /* by vd_topology, owned; null where there is nothing */
    vd_material *materials;             /* [material_count], at least one; parts number them */
    vd_model_surface *surfaces;         /* [material_count] */
    int material_count;
    vd_texture **textures; /* [texture_count], owned */
    char **texture_names;  /* [texture_count]: path, or "embedded texture 0" */
    int texture_count;
    bool computed_normals;   /* the file had none for some triangle */
    bool has_colors;         /* the meshes' first three extra components are linear RGB by which
                                the material's albedo is multiplied */
    uint64_t flat_triangles; /* without area: kept, but they draw nothing */
} vd_model;

typedef struct vd_model_def {
    bool skip_textures; /* do not read them: materials have their plain colour */
} vd_model_def;

/* With textures. */
VD_API vd_model_def vd_model_def_default(void);

/* Reads OBJ, PLY or OFF, by the ending of the path: OBJ with the MTL files and textures that it
 * names, which stand relative to its own folder; PLY in ASCII or binary of either byte order,
 * vertices with normals, texture coordinates and colours, faces, triangle strips, edges, and where
 * there are none of these a cloud of points; OFF as text, with normals, colours and texture
 * coordinates of its vertices. `def` may be null. *out is owned by the caller. The log tells what
 * was left out, such as an MTL file that is not there. Returns VD_ERROR_UNSUPPORTED for another
 * ending (model_import.h may know it), VD_ERROR_IO (also for a texture that is not there),
 * VD_ERROR_FORMAT (damaged, an index out of range, a coordinate that is not a number: with the line
 * or element), VD_ERROR_LIMIT, VD_ERROR_EMPTY (no vertices) or VD_ERROR_MEMORY; on failure *out is
 * untouched. */
VD_API VD_MUST_USE vd_status vd_model_load(vd_context *context, const char *path,
                                           const vd_model_def *def, vd_model **out);

/* The same from memory: `path` gives the format, the folder of what else is read, and the name in
 * error sentences. */
VD_API VD_MUST_USE vd_status vd_model_decode(vd_context *context, const void *data,
                                             size_t size_bytes, const char *path,
                                             const vd_model_def *def, vd_model **out);

/* What a model is made of, for readers of other formats. Everything by vertex; triangles of one
 * place and material may have vertices of their own: they become one surface where normals are
 * computed. Arrays may be null where their count is 0 or the comment says so. */
typedef struct vd_model_source {
    const char *name;   /* of the file, in error sentences */
    const char *format; /* for people, at most 31 bytes */
    bool z_up;
    size_t vertex_count;
    const double (*positions)[3];       /* [vertex_count], metres */
    const float (*normals)[3];          /* [vertex_count], or null; (0, 0, 0): none */
    const float (*uvs)[2];              /* [vertex_count], or null; (0, 0) is the upper left */
    const float (*colors)[3];           /* [vertex_count], or null; linear */
    size_t triangle_count;              /* without triangles, lines and points it is a cloud */
    const uint32_t (*triangles)[3];     /* vertices */
    const uint32_t *triangle_materials; /* [triangle_count], or null: all 0 */
    size_t line_count;
    const uint32_t (*lines)[2];
    size_t point_count;
    const uint32_t *points;
    int material_count;               /* 0: one grey one */
    const vd_material *materials;     /* texture and filter are set from the surfaces */
    const vd_model_surface *surfaces; /* [material_count] */
    int texture_count;
    vd_texture *const *textures;      /* taken over on success */
    const char *const *texture_names; /* copied */
} vd_model_source;

/* Makes a model of copied arrays. Returns VD_ERROR_FORMAT (a position that is not finite or beyond
 * 1e15, a number out of range: the sentence opens with "cannot read NAME"), VD_ERROR_LIMIT,
 * VD_ERROR_EMPTY (no vertices) or VD_ERROR_MEMORY; the textures then stay the caller's. */
VD_API VD_MUST_USE vd_status vd_model_create(vd_context *context, const vd_model_source *source,
                                             vd_model **out);

VD_API void vd_model_destroy(vd_model **model);

/* ---- as a block -------------------------------------------------------------------------------
 * A model is also one relocatable block: meshes, materials and textures, found by offsets, to be
 * sent, kept, and read back to the same pictures. */

/* Returns the block's size, a multiple of 64 bytes. */
VD_API size_t vd_model_packed_bytes(const vd_model *model);

/* Writes the block: vd_model_packed_bytes at a multiple of 64 bytes. */
VD_API void vd_model_pack(const vd_model *model, void *block);

/* Checks a block, whatever its bytes are, and makes a model of it. *out is owned by the caller.
 * Returns VD_ERROR_FORMAT with what is wrong, VD_ERROR_ARGUMENT (not at a multiple of 64 bytes) or
 * VD_ERROR_MEMORY. */
VD_API VD_MUST_USE vd_status vd_model_unpack(vd_context *context, const void *block,
                                             size_t size_bytes, vd_model **out);

/* Bounds of everything in the file's own axes, in its own unit. */
VD_API void vd_model_bounds(const vd_model *model, vd_vec3 *min, vd_vec3 *max);

/* Fills in draws of all meshes with their materials, both faces drawn, and returns how many. They
 * point into the model. */
VD_API int vd_model_draws(const vd_model *model, vd_draw draws[VD_TOPOLOGY_COUNT]);

/* What is drawn where a file has no material: a warm grey, darker than vd_material_default, so that
 * light has room above it. */
VD_API vd_material vd_model_clay(void);

/* Returns the matrix that turns a model whose y axis points up into the world, where z does: the
 * model's front, +z, then faces south. */
VD_API vd_matrix vd_model_upright(void);

VD_END_DECLARATIONS

#endif

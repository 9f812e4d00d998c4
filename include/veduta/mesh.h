/* mesh.h: vertices and what joins them, as one relocatable block.
 *
 * A vd_mesh is the head of a single block of memory: this struct, then the arrays, found by offsets
 * from the block's beginning. There are no pointers inside: a block can be mapped from a file,
 * sent, cached. The arrays are
 *   positions   float [3][vertex_stride]                 x, y, z, metres relative to the anchor
 *   attributes  float [group_count][vertex_stride][4]    four components of a vertex side by side
 *   indices     uint32_t [index_count]
 *   parts       vd_mesh_part [part_count]
 * Positions stand in planes since they go through the projection sixteen vertices at a time. The
 * other attributes are read where a pixel is shaded, for sixteen different triangles at a time:
 * there one load of 16 bytes brings four components. The attributes are, in this order and as far
 * as the mesh has them: normal (3), texture coordinates (2), extra components.
 */
#ifndef VEDUTA_MESH_H
#define VEDUTA_MESH_H

#include <stdbool.h>
#include <veduta/context.h>
#include <veduta/vector.h>

VD_BEGIN_DECLARATIONS

/* The most vertices or indices of a mesh, and the most attribute components. */
#define VD_MESH_MAX_VERTICES 0x7fffff00u
#define VD_MESH_MAX_INDICES 0xc0000000u
#define VD_MESH_MAX_COMPONENTS 32

/* What the indices join. */
typedef enum vd_topology {
    VD_TOPOLOGY_TRIANGLES = 0, /* three a triangle */
    VD_TOPOLOGY_LINES,         /* two a line */
    VD_TOPOLOGY_POINTS,        /* one a point */
    VD_TOPOLOGY_COUNT
} vd_topology;

/* A run of primitives of one material. */
typedef struct vd_mesh_part {
    uint32_t first, count; /* primitives (triangles, lines or points) */
    uint32_t material;     /* index into the materials of the draw */
} vd_mesh_part;

typedef struct vd_mesh {
    uint8_t magic[8];     /* "VDMESH\0\1" */
    uint64_t size_bytes;  /* of the whole block */
    vd_vec3 anchor;       /* metres; positions are relative to it */
    float min[3], max[3]; /* bounds of the positions; 0, 0 without vertices */
    uint32_t topology;    /* vd_topology */
    uint32_t vertex_count, vertex_stride, index_count, primitive_count, part_count;
    int32_t component_count;   /* attribute components */
    int32_t group_count;       /* ceil(component_count / 4) */
    int32_t normal, uv, extra; /* first component of each; −1: the mesh has none */
    int32_t extra_count;
    uint64_t position_offset_bytes, attribute_offset_bytes, index_offset_bytes, part_offset_bytes;
} vd_mesh;

typedef struct vd_mesh_def {
    vd_vec3 anchor;
    vd_topology topology;
    size_t vertex_count;
    const float *positions;    /* [vertex_count][3] */
    const float *normals;      /* [vertex_count][3], or null */
    const float *uvs;          /* [vertex_count][2], or null; (0, 0) is the texture's upper left */
    const float *extra;        /* [vertex_count][extra_count], or null */
    int extra_count;           /* components a vertex in `extra` */
    size_t index_count;        /* a multiple of 3, 2 or 1 by topology */
    const uint32_t *indices;   /* [index_count]; null: 0, 1, 2 … vertex_count − 1 */
    const vd_mesh_part *parts; /* null: one part of material 0; else runs that follow each other
                                  and together are all primitives */
    int part_count;
    bool compute_normals; /* where `normals` is null: of the triangles around each vertex, each
                             weighted by its area (vertices that share a position but not an index
                             get normals of their own) */
} vd_mesh_def;

/* Everything zero: triangles around the origin, no attributes. */
VD_API vd_mesh_def vd_mesh_def_default(void);

/* Copies vertices and indices into a mesh; what `def` points to may go afterwards. *out is owned by
 * the caller. Degenerate primitives are kept; they draw nothing. Zero primitives are fine.
 * Returns VD_ERROR_ARGUMENT (an index out of range, a coordinate or attribute that is not finite, a
 * count that does not fit the topology, parts with gaps: the sentence says which and where),
 * VD_ERROR_LIMIT or VD_ERROR_MEMORY. */
VD_API VD_MUST_USE vd_status vd_mesh_create(vd_context *context, const vd_mesh_def *def,
                                            vd_mesh **out);
VD_API void vd_mesh_destroy(vd_context *context, vd_mesh **mesh);

/* Checks a block that came from outside (every offset and size, indices, parts, finite numbers,
 * bounds) before it is used as a mesh; safe for any bytes. Cost: a pass over the block. Returns
 * VD_ERROR_FORMAT with what is wrong, or VD_ERROR_ARGUMENT when it does not lie at a multiple of 64
 * bytes. */
VD_API VD_MUST_USE vd_status vd_mesh_validate(const void *block, size_t size_bytes);

/* Bounds in the world, in metres: anchor + min, anchor + max. */
VD_API void vd_mesh_bounds(const vd_mesh *mesh, vd_vec3 *min, vd_vec3 *max);

/* One plane of positions: axis 0, 1, 2 is x, y, z; [vertex_stride]. */
static inline const float *vd_mesh_positions(const vd_mesh *mesh, int axis) {
    const char *block = (const char *)(const void *)mesh + mesh->position_offset_bytes;
    return (const float *)(const void *)block + (size_t)axis * mesh->vertex_stride;
}

/* One group of four attribute components: [vertex_stride][4]. */
static inline const float *vd_mesh_attributes(const vd_mesh *mesh, int group) {
    const char *block = (const char *)(const void *)mesh + mesh->attribute_offset_bytes;
    return (const float *)(const void *)block + (size_t)group * mesh->vertex_stride * 4;
}

static inline const uint32_t *vd_mesh_indices(const vd_mesh *mesh) {
    const char *block = (const char *)(const void *)mesh + mesh->index_offset_bytes;
    return (const uint32_t *)(const void *)block;
}

static inline const vd_mesh_part *vd_mesh_parts(const vd_mesh *mesh) {
    const char *block = (const char *)(const void *)mesh + mesh->part_offset_bytes;
    return (const vd_mesh_part *)(const void *)block;
}

VD_END_DECLARATIONS

#endif

/* bricks.h: more particles than memory: the brick file (.vdp), and making one.
 *
 * A brick is a spatial block of particles, stored as arrays of quantised numbers that are drawn as
 * they lie in the mapped file. Bricks are the nodes of an octree: a leaf holds particles of the
 * data, an inner node a sample of its children, in which each particle stands for the same number
 * of particles of the data, so that drawing any cut through the tree draws the same area and the
 * same mass. docs/brick-format.md specifies the file to the byte.
 *
 *     status = vd_bricks_import(context, job, &source, 1, NULL, "scan.vdp", &report);
 *     status = vd_bricks_open(context, "scan.vdp", &bricks);
 *     status = vd_bricks_brick(bricks, 0, &brick);          the whole, coarsely
 *     vd_bricks_close(&bricks);
 */
#ifndef VEDUTA_BRICKS_H
#define VEDUTA_BRICKS_H

#include <veduta/job.h>
#include <veduta/particle_source.h>

VD_BEGIN_DECLARATIONS

/* ---- making -------------------------------------------------------------------------------------
 */

typedef struct vd_bricks_def {
    size_t memory_bytes;     /* about what importing may take; 0: 512 MiB; at least 64 MiB */
    uint32_t leaf_particles; /* the most in a brick; 0: 8192; 64 … 65536 */
    bool resume; /* keep the sorted part OUT.part when interrupted, and go on from one that is there
                    and fits the same sources */
} vd_bricks_def;

VD_API vd_bricks_def vd_bricks_def_default(void);

typedef struct vd_bricks_report {
    uint64_t count;          /* particles in the file */
    uint64_t skipped;        /* with a position that is not finite */
    uint64_t missing_values; /* attributes that were no number: set to the smallest there is */
    uint64_t resumed;        /* particles that an interrupted import had sorted */
    uint64_t file_bytes;
    uint64_t bricks;
} vd_bricks_report;

/* Writes all particles of the sources into a brick file: beside, renamed when it is whole. The
 * sources are read twice: once for the bounds, once to be sorted by Morton code, in parts that fit
 * the memory and go to OUT.part; then the parts are merged, and the tree is built from the merged
 * stream from the bottom up. Attributes that not all sources have are left out, which the log says.
 * `def` and `report` may be null. The file does not depend on the number of threads, nor on
 * memory_bytes. Cost: O(n log n), disk for 12 bytes a particle and 4 an attribute in OUT.part.
 * Returns what reading returns, VD_ERROR_ARGUMENT (no sources, a field of def), VD_ERROR_EMPTY
 * (nothing that can be drawn), VD_ERROR_LIMIT, VD_ERROR_IO, VD_ERROR_MEMORY or VD_ERROR_CANCELLED;
 * the file at `path` is then as it was. */
VD_API VD_MUST_USE vd_status vd_bricks_import(vd_context *context, vd_job *job,
                                              vd_particle_source *const *sources, int count,
                                              const vd_bricks_def *def, const char *path,
                                              vd_bricks_report *report);

/* ---- reading ------------------------------------------------------------------------------------
 */

/* How the numbers of an attribute are stored. */
typedef enum vd_brick_storage {
    VD_BRICK_U8 = 0, /* as they are */
    VD_BRICK_U16,
    VD_BRICK_LINEAR, /* 16 bits over the range of the brick */
    VD_BRICK_LOG,    /* the same, of the logarithm to the base 2 */
    VD_BRICK_STORAGE_COUNT
} vd_brick_storage;

/* An attribute as the file describes it: 128 bytes. */
typedef struct vd_bricks_attribute {
    char name[VD_ATTRIBUTE_NAME_BYTES];
    uint32_t kind;    /* vd_attribute_kind */
    uint32_t storage; /* vd_brick_storage */
    double min, max;  /* over all particles */
    double mean;
    uint64_t missing; /* values that were no number */
    uint8_t reserved[40];
} vd_bricks_attribute;

/* A node as it lies in the file: 128 bytes. Nodes are in breadth-first order: node 0 is the root,
 * children stand together behind their parent, in Morton order. */
typedef struct vd_bricks_node {
    double min[3], max[3]; /* of all particles of the data below, world */
    uint64_t offset;       /* of the brick in the file */
    uint64_t checksum;     /* XXH64 of its bytes */
    uint64_t leaves;       /* particles of the data below; a sample stands for leaves / count */
    uint32_t count;        /* particles in the brick */
    uint32_t bytes;        /* of the brick */
    uint32_t child_first;  /* 0 for a leaf */
    uint32_t child_count;  /* 0 … 8 */
    float spread;          /* root mean square distance of the data from its samples, metres */
    float radius_max;      /* of the samples, metres; 0 without radii */
    uint32_t level;        /* of its cell: 0 is the cube, each next one halves */
    uint32_t octant; /* among its siblings: a bit an axis, x the lowest; set: the upper half */
    uint8_t reserved[24];
} vd_bricks_node;

/* An open file, mapped; all for reading. */
typedef struct vd_bricks {
    vd_context *context;
    char *path;
    uint64_t count, skipped, stored; /* particles of the data, left out, in all bricks together */
    uint64_t file_bytes;
    double min[3], max[3]; /* of all particles */
    double spacing;        /* median distance of neighbours in Morton order, metres */
    uint32_t node_count, attribute_count;
    const vd_bricks_node *nodes;
    const vd_bricks_attribute *attributes;
    const char *crs; /* empty: not known */
    struct vd_bricks_map *map;
} vd_bricks;

/* Maps a brick file and checks its head and its tree: bricks themselves are checked when they are
 * first looked at. *out is owned by the caller. The file must not be changed while it is open; to
 * replace it by a renamed one is fine. Reading it is thread-safe.
 * Returns VD_ERROR_IO, VD_ERROR_FORMAT (not a brick file, damaged, cut short), VD_ERROR_UNSUPPORTED
 * (a version to come) or VD_ERROR_MEMORY. */
VD_API VD_MUST_USE vd_status vd_bricks_open(vd_context *context, const char *path, vd_bricks **out);
VD_API void vd_bricks_close(vd_bricks **bricks);

/* The same of a file in memory, which must be aligned to 8 bytes and stay. */
VD_API VD_MUST_USE vd_status vd_bricks_open_memory(vd_context *context, const void *data,
                                                   size_t size_bytes, const char *name,
                                                   vd_bricks **out);

/* A brick, looked at in place: world = origin + step × (x, y, z). */
typedef struct vd_brick {
    uint32_t count;
    double origin[3], step[3];
    const uint16_t *x, *y, *z;
    const void *values[VD_MAX_ATTRIBUTES]; /* uint8_t or uint16_t, by the attribute's storage */
    float low[VD_MAX_ATTRIBUTES];          /* LINEAR: value = low + step × stored; LOG: 2^that; */
    float value_step[VD_MAX_ATTRIBUTES];   /* U8 and U16: 0 and 1 */
} vd_brick;

/* Looks at a node's brick; its checksum is verified the first time. Returns VD_ERROR_FORMAT when it
 * does not hold. */
VD_API VD_MUST_USE vd_status vd_bricks_brick(const vd_bricks *bricks, uint32_t node, vd_brick *out);

/* Writes an attribute of all particles of a brick as numbers, [count]. */
VD_API void vd_bricks_values(const vd_bricks *bricks, const vd_brick *brick, int attribute,
                             float *out);

/* Returns the index of an attribute, −1 when there is none of that name. */
VD_API int vd_bricks_find(const vd_bricks *bricks, const char *name);

/* Verifies the checksum of every brick. Returns VD_ERROR_FORMAT, VD_ERROR_CANCELLED. */
VD_API VD_MUST_USE vd_status vd_bricks_verify(const vd_bricks *bricks, vd_job *job);

VD_END_DECLARATIONS

#endif

/* brick_import.h: the stages of an import, handed from one to the next.
 *
 *     sources ──scan──► bounds, ranges ──sort──► OUT.part: sorted runs ──merge──► tree ──► OUT
 *
 * A record is a particle on its way: three coordinates of 32 bits in the cube that holds all of
 * them, then its attributes as floats. Its key is the Morton code of the upper 21 bits of each
 * coordinate; records are sorted by key and, of equal keys, as they came, so the order does not
 * depend on how the input was cut into runs.
 *
 * Sorted runs and a merge, rather than distribution into cells: it needs no histogram, no recursion
 * where a cluster fills one cell, and its memory is the same for any distribution. */
#ifndef VEDUTA_SPLAT_BRICK_IMPORT_H
#define VEDUTA_SPLAT_BRICK_IMPORT_H

#include "core/file.h"
#include "splat/brick_format.h"

/* ---- what is read -------------------------------------------------------------------------------
 */

typedef struct vd_import_range {
    double min, max, sum;
    uint64_t numbers, missing;
} vd_import_range;

typedef struct vd_import_input {
    vd_particle_source *const *sources;
    int source_count;
    int attribute_count; /* those that all sources have */
    vd_attribute attributes[VD_MAX_ATTRIBUTES];
    uint64_t count, skipped; /* by scanning */
    double min[3], max[3];
    double cube_size; /* metres; > 0 */
    vd_import_range ranges[VD_MAX_ATTRIBUTES];
} vd_import_input;

/* Particles of any source, with the attributes of the whole. */
typedef struct vd_import_reader {
    vd_import_input *input;
    vd_particle_batch batch; /* its arrays are one allocation: memory */
    float *unwanted;         /* where attributes go that not all sources have */
    void *memory;
    int source; /* that is read now */
} vd_import_reader;

/* Finds the attributes that all sources have. Returns VD_ERROR_ARGUMENT without sources. */
VD_MUST_USE vd_status vd_import_begin(vd_context *context, vd_particle_source *const *sources,
                                      int count, vd_import_input *out);
VD_MUST_USE vd_status vd_import_reader_init(vd_context *context, vd_import_input *input,
                                            size_t capacity, vd_import_reader *out);
void vd_import_reader_finish(vd_context *context, vd_import_reader *reader);
/* Begins with the first source again. */
VD_MUST_USE vd_status vd_import_reader_rewind(vd_import_reader *reader);
/* Replaces the batch by the next particles: less than its capacity only at the end. */
VD_MUST_USE vd_status vd_import_reader_next(vd_import_reader *reader);

/* Reads everything once: counts, bounds, ranges. `progress` is told shares 0 … 1. */
typedef struct vd_import_progress {
    vd_job *job;
    double from, to; /* of the whole import */
} vd_import_progress;

void vd_import_report(const vd_import_progress *progress, double share);
VD_MUST_USE vd_status vd_import_scan(vd_context *context, vd_import_reader *reader,
                                     const vd_import_progress *progress);

/* ---- records ------------------------------------------------------------------------------------
 */

static inline size_t vd_record_bytes(int attribute_count) {
    return 12 + 4 * (size_t)attribute_count;
}

static inline uint64_t vd_morton_spread(uint32_t v) {
    uint64_t x = v & 0x1FFFFF;
    x = (x | x << 32) & 0x001F00000000FFFFu;
    x = (x | x << 16) & 0x001F0000FF0000FFu;
    x = (x | x << 8) & 0x100F00F00F00F00Fu;
    x = (x | x << 4) & 0x10C30C30C30C30C3u;
    return (x | x << 2) & 0x1249249249249249u;
}

/* The key of a record. */
static inline uint64_t vd_record_key(const uint32_t q[3]) {
    return vd_morton_spread(q[0] >> 11) | vd_morton_spread(q[1] >> 11) << 1 |
           vd_morton_spread(q[2] >> 11) << 2;
}

static inline uint32_t vd_cube_coordinate(double p, double min, double per_metre) {
    const double t = (p - min) * per_metre;
    return t >= 4294967295.0 ? 4294967295u : t > 0.0 ? (uint32_t)t : 0u;
}

/* ---- sorting ------------------------------------------------------------------------------------
 */

typedef struct vd_import_run {
    uint64_t begin, count; /* records in the work file */
} vd_import_run;

typedef struct vd_import_runs {
    vd_context *context;
    char *path;       /* OUT.part */
    char *state_path; /* OUT.part.state, written after each round when resuming is wanted */
    int descriptor;
    size_t record_bytes;
    uint64_t fingerprint; /* of sources and bounds */
    uint64_t consumed;    /* particles read, skipped ones among them */
    uint64_t records;
    vd_import_run *runs;
    uint32_t run_count, run_capacity;
} vd_import_runs;

VD_MUST_USE vd_status vd_import_runs_open(vd_context *context, const char *out_path, bool resume,
                                          const vd_import_input *input, vd_import_runs *out);
/* Sorts what is left of the sources into runs. */
VD_MUST_USE vd_status vd_import_sort(vd_import_runs *runs, const vd_import_input *input,
                                     size_t memory_bytes, bool resume,
                                     const vd_import_progress *progress);
/* Ends the runs; the files stay only with `keep`. */
void vd_import_runs_close(vd_import_runs *runs, bool keep);

/* Receives a record with its key, in order. */
typedef vd_status vd_record_function(void *user, uint64_t key, const uint8_t *record);
VD_MUST_USE vd_status vd_import_merge(vd_import_runs *runs, size_t memory_bytes,
                                      vd_record_function *take, void *user,
                                      const vd_import_progress *progress);

/* ---- the tree -----------------------------------------------------------------------------------
 */

typedef struct vd_tree vd_tree;

/* Begins the file at `path`. *out is owned by the caller. */
VD_MUST_USE vd_status vd_tree_create(vd_context *context, const vd_import_input *input,
                                     uint32_t leaf_particles, const char *path, vd_tree **out);
VD_MUST_USE vd_status vd_tree_add(vd_tree *tree, uint64_t key, const uint8_t *record);
/* Finishes the tree, writes the directory, renames the file into place. */
VD_MUST_USE vd_status vd_tree_commit(vd_tree *tree, const char *crs, vd_bricks_report *report);
/* Discards what was not committed. */
void vd_tree_destroy(vd_tree **tree);

/* Encodes a brick of `count` records into `out` (brick bytes, cleared), with the bounds in cube
 * coordinates that its positions are stored relative to. Returns the largest radius. */
typedef struct vd_brick_source {
    const uint8_t *records;
    uint32_t count;
    uint32_t min[3], max[3];
} vd_brick_source;

float vd_brick_encode(const vd_bricks_attribute *attributes, uint32_t attribute_count,
                      const vd_brick_source *source, uint8_t *out);

#endif

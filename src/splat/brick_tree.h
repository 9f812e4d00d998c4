/* brick_tree.h: what the files that build the tree share. */
#ifndef VEDUTA_SPLAT_BRICK_TREE_H
#define VEDUTA_SPLAT_BRICK_TREE_H

#include "splat/brick_import.h"

/* A place in the order of all particles: the digits of its key, eight to a digit, then those of its
 * number among the particles of the same key, so that the tree also divides a single point. */
typedef struct vd_tree_place {
    uint64_t key;
    uint32_t number;
} vd_tree_place;

#define VD_TREE_LEVELS 32 /* 21 of the key, 11 of the number */

/* How many digits two places have in common: the level of the smallest cell that holds both. */
static inline int vd_tree_common(vd_tree_place a, vd_tree_place b) {
    if (a.key != b.key) {
        return (__builtin_clzll(a.key ^ b.key) - 1) / 3;
    }
    return a.number != b.number ? 21 + (__builtin_clz(a.number ^ b.number) + 1) / 3
                                : VD_TREE_LEVELS;
}

/* The digit behind the first `level` ones: which child of a cell of that level holds the place. */
static inline uint32_t vd_tree_digit(vd_tree_place place, int level) {
    return level < 21 ? place.key >> (60 - 3 * level) & 7
                      : (uint32_t)((uint64_t)place.number >> (30 - 3 * (level - 21)) & 7);
}

/* A node whose parent is not made yet. */
typedef struct vd_tree_pending {
    vd_tree_place first;
    uint8_t *records; /* [count]: its particles */
    uint32_t count;
    uint32_t index; /* in the nodes as they were made */
    uint64_t leaves;
    double spread2;          /* mean square distance, cube coordinates */
    uint32_t min[3], max[3]; /* of the leaves below, cube coordinates */
} vd_tree_pending;

/* Samples the particles of `count` nodes, in order, into out->records (room for `most`): sets
 * records, count, leaves, spread2, min and max of `out`. */
void vd_tree_sample(const vd_bricks_attribute *attributes, uint32_t attribute_count,
                    const vd_tree_pending *children, uint32_t count, uint32_t most,
                    vd_tree_pending *out);

/* How many particles a parent of nodes with `total` particles has: an eighth, but where few
 * children would make it small, up to an eighth of `leaf_particles` and half of them. */
uint32_t vd_tree_sample_count(uint64_t total, uint32_t leaf_particles);

#endif

/* expand.h: irregular work as flat work.
 *
 * Sources have segments of elements, some of which are wanted. Expansion counts the wanted ones,
 * sums the counts, and then visits output i of all, in order, knowing source and element; any range
 * of outputs can be visited, so that one memory of fixed size serves any total (Henriksen et al.
 * 2019, flattening by expansion). The masked form tests each element once and remembers the result
 * as one bit (Siddique 2026, §3.1.2, expand_masked): for small, bounded segments. The filter tests
 * again when visiting, and takes segments of any size.
 */
#ifndef VEDUTA_CORE_EXPAND_H
#define VEDUTA_CORE_EXPAND_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define VD_MASK_BITS 256

/* A coverage mask of 8 to 256 bits; the words beyond its bits are 0. */
typedef struct vd_mask {
    uint64_t words[VD_MASK_BITS / 64];
} vd_mask;

static inline void vd_mask_set(vd_mask *mask, int bit) {
    mask->words[bit / 64] |= (uint64_t)1 << (bit % 64);
}

/* How many bits are set. */
static inline int vd_mask_rank(const vd_mask *mask, int bits) {
    int count = 0;
    for (int w = 0; w * 64 < bits; w++) {
        count += __builtin_popcountll(mask->words[w]);
    }
    return count;
}

/* The position of the k-th set bit, k from 0, which must exist: halves are skipped by their counts,
 * as wide as they are. */
static inline int vd_mask_select(const vd_mask *mask, int k) {
    int base = 0;
    const uint64_t *word = mask->words;
    for (int count; k >= (count = __builtin_popcountll(*word)); word++) {
        k -= count;
        base += 64;
    }
    uint64_t bits = *word;
    for (int half = 32; half >= 8; half /= 2) {
        const int low = __builtin_popcountll(bits & (((uint64_t)1 << half) - 1));
        if (k >= low) {
            k -= low;
            base += half;
            bits >>= half;
        }
    }
    for (; k > 0; k--) {
        bits &= bits - 1;
    }
    return base + __builtin_ctzll(bits);
}

/* What to expand. `user` is handed to all three. */
typedef struct vd_expand_def {
    uint32_t (*size)(const void *user, size_t source);
    bool (*predicate)(const void *user, size_t source, uint32_t element); /* null: all */
    void (*get)(void *user, size_t source, uint32_t element, uint64_t output);
    int bits; /* masked: the most elements of a segment, 8 … 256 */
} vd_expand_def;

/* Memory of the caller's for `count` sources. */
typedef struct vd_expansion {
    size_t count;
    vd_mask *masks;    /* [count], masked only */
    uint64_t *offsets; /* [count + 1]: the first output of each source, then the total */
} vd_expansion;

/* Counts the wanted elements; returns the total. Segments are cut at def->bits. */
uint64_t vd_expand_masked(const vd_expand_def *def, const void *user, vd_expansion *expansion);

/* Calls `get` for outputs from … to − 1 of a masked expansion. */
void vd_expand_masked_fill(const vd_expand_def *def, void *user, const vd_expansion *expansion,
                           uint64_t from, uint64_t to);

/* The same without masks. */
uint64_t vd_expand_filter(const vd_expand_def *def, const void *user, vd_expansion *expansion);
void vd_expand_filter_fill(const vd_expand_def *def, void *user, const vd_expansion *expansion,
                           uint64_t from, uint64_t to);

#endif

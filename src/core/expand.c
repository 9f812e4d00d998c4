#include <string.h>
#include "core/expand.h"

uint64_t vd_expand_masked(const vd_expand_def *def, const void *user, vd_expansion *expansion) {
    uint64_t total = 0;
    for (size_t i = 0; i < expansion->count; i++) {
        vd_mask *mask = &expansion->masks[i];
        uint32_t size = def->size(user, i);
        size = size < (uint32_t)def->bits ? size : (uint32_t)def->bits;
        memset(mask, 0, sizeof *mask);
        for (uint32_t k = 0; k < size; k++) {
            if (def->predicate == NULL || def->predicate(user, i, k)) {
                vd_mask_set(mask, (int)k);
            }
        }
        expansion->offsets[i] = total;
        total += (uint64_t)vd_mask_rank(mask, def->bits);
    }
    expansion->offsets[expansion->count] = total;
    return total;
}

/* The source that output `at` belongs to. */
static size_t source_of(const vd_expansion *expansion, uint64_t at) {
    size_t low = 0, high = expansion->count;
    while (high - low > 1) {
        const size_t middle = (low + high) / 2;
        if (expansion->offsets[middle] <= at) {
            low = middle;
        } else {
            high = middle;
        }
    }
    return low;
}

void vd_expand_masked_fill(const vd_expand_def *def, void *user, const vd_expansion *expansion,
                           uint64_t from, uint64_t to) {
    size_t source = from < to ? source_of(expansion, from) : 0;
    for (uint64_t at = from; at < to; at++) {
        while (expansion->offsets[source + 1] <= at) {
            source++;
        }
        const int k = (int)(at - expansion->offsets[source]);
        def->get(user, source, (uint32_t)vd_mask_select(&expansion->masks[source], k), at);
    }
}

uint64_t vd_expand_filter(const vd_expand_def *def, const void *user, vd_expansion *expansion) {
    uint64_t total = 0;
    for (size_t i = 0; i < expansion->count; i++) {
        const uint32_t size = def->size(user, i);
        expansion->offsets[i] = total;
        if (def->predicate == NULL) {
            total += size;
            continue;
        }
        for (uint32_t k = 0; k < size; k++) {
            total += def->predicate(user, i, k);
        }
    }
    expansion->offsets[expansion->count] = total;
    return total;
}

void vd_expand_filter_fill(const vd_expand_def *def, void *user, const vd_expansion *expansion,
                           uint64_t from, uint64_t to) {
    if (from >= to) {
        return;
    }
    for (size_t i = source_of(expansion, from); i < expansion->count; i++) {
        uint64_t at = expansion->offsets[i];
        if (at >= to) {
            return;
        }
        /* Without a predicate output and element go together. */
        uint32_t k = def->predicate == NULL && at < from ? (uint32_t)(from - at) : 0;
        at += k;
        for (; at < to && at < expansion->offsets[i + 1]; k++) {
            if (def->predicate == NULL || def->predicate(user, i, k)) {
                if (at >= from) {
                    def->get(user, i, k, at);
                }
                at++;
            }
        }
    }
}

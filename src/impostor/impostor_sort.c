/* impostor_sort.c: what is shown, the farthest first.
 *
 * By a radix sort of the distances' exponents and 22 bits of their mantissas, three passes of 11
 * bits, then by insertion, which puts right the few that agree in these. (qsort alone took a third
 * of the time that 10^5 objects were decided in.)
 */
#include <stdlib.h>
#include <string.h>
#include "core/core.h"
#include "impostor/impostor_set.h"

enum { DIGIT_BITS = 11, DIGITS = 1 << DIGIT_BITS, PASSES = 3, MANTISSA_LEFT = 52 - 22 };

/* Fewer are sorted sooner without counting digits. */
#define FEW 256

/* Steps of the insertion for each rank, on average, beyond which it is given up: many are at the
 * very same distance. */
#define MOST_STEPS 8

/* Whether `a` comes before `b`: it is farther, or as far with an earlier slot. */
static bool comes_before(const vd_impostor_rank *a, const vd_impostor_rank *b) {
    return a->distance2 != b->distance2 ? a->distance2 > b->distance2 : a->slot < b->slot;
}

static int compare(const void *a, const void *b) {
    return comes_before(b, a) - comes_before(a, b);
}

/* The farther, the smaller; distances are not negative. */
static uint64_t key_of(const vd_impostor_rank *rank) {
    uint64_t bits;
    memcpy(&bits, &rank->distance2, sizeof bits);
    return ~bits >> MANTISSA_LEFT;
}

/* One pass from `from` to `to`; false, with nothing done, when all have the same digit. */
static bool distribute(const vd_impostor_rank *from, vd_impostor_rank *to, size_t count, int pass,
                       size_t *begin) {
    const size_t first = key_of(&from[0]) >> (pass * DIGIT_BITS) & (DIGITS - 1);
    if (begin[first] == count) {
        return false;
    }
    size_t sum = 0;
    for (int i = 0; i < DIGITS; i++) {
        const size_t here = begin[i];
        begin[i] = sum;
        sum += here;
    }
    for (size_t i = 0; i < count; i++) {
        to[begin[key_of(&from[i]) >> (pass * DIGIT_BITS) & (DIGITS - 1)]++] = from[i];
    }
    return true;
}

/* Sorts ranks that nearly are; false when they are not near enough. */
static bool insert_all(vd_impostor_rank *ranks, size_t count) {
    size_t left = MOST_STEPS * count;
    for (size_t i = 1; i < count; i++) {
        const vd_impostor_rank made = ranks[i];
        size_t at = i;
        for (; at > 0 && left > 0 && comes_before(&made, &ranks[at - 1]); at--, left--) {
            ranks[at] = ranks[at - 1];
        }
        ranks[at] = made;
        if (left == 0) {
            return false;
        }
    }
    return true;
}

void vd_impostor_ranks_sort(vd_impostor_rank *ranks, vd_impostor_rank *room, size_t count) {
    if (count < FEW) {
        qsort(ranks, count, sizeof *ranks, compare);
        return;
    }
    size_t counts[PASSES][DIGITS];
    memset(counts, 0, sizeof counts);
    for (size_t i = 0; i < count; i++) {
        const uint64_t key = key_of(&ranks[i]);
        for (int pass = 0; pass < PASSES; pass++) {
            counts[pass][key >> (pass * DIGIT_BITS) & (DIGITS - 1)]++;
        }
    }
    vd_impostor_rank *from = ranks, *to = room;
    for (int pass = 0; pass < PASSES; pass++) {
        if (distribute(from, to, count, pass, counts[pass])) {
            vd_impostor_rank *const was = from;
            from = to;
            to = was;
        }
    }
    if (from != ranks) {
        memcpy(ranks, from, count * sizeof *ranks);
    }
    if (!insert_all(ranks, count)) {
        qsort(ranks, count, sizeof *ranks, compare);
    }
}

/* Things that stand side by side are told apart by their middles better than by their groups'. */
vd_status vd_impostors_sort_shown(vd_impostors *set) {
    const size_t count = set->ranks.count;
    vd_impostor_rank *ranks = set->ranks.data;
    uint32_t *shown = set->shown.data;
    if (count < 2) {
        return vd_success();
    }
    const vd_status status = vd_buffer_reserve(set->context, &set->order, "impostors' order", count,
                                               sizeof(vd_impostor_rank));
    if (status.code != VD_OK) {
        return status;
    }
    vd_impostor_ranks_sort(ranks, set->order.memory, count);
    for (size_t i = 0; i < count; i++) {
        shown[i] = ranks[i].slot;
    }
    return status;
}

/* splat_sort.c: back to front, by a radix sort.
 *
 * A brick's depths lie within a small range: as 1 + (back − depth) / range, a float in [1, 2), they
 * share one exponent, and the mantissa's upper 22 bits are the key: two passes of 11 bits (Lawlor
 * 2004, §6.6.2, takes bits of exponent and mantissa as they come; most of those are the same for
 * all particles of a far brick). Depth is measured along the view axis, so that the order holds
 * for every eye that looks in the same direction, and can be kept.
 *
 * A pass moves each element to where the counts of the digits say; both passes' digits are counted
 * when the keys are made. What moves in the first pass is (second digit, number), so that the
 * second does not look up keys at random places.
 */
#include <string.h>
#include "splat/splat_internal.h"

/* One array's number, as projection reads it. */
static float number_at(const float *at, const uint16_t *at16, size_t i) {
    return at16 != NULL ? (float)at16[i] : at[i];
}

uint32_t vd_splat_key(const vd_placing *placing, size_t i) {
    const vd_splats *s = placing->splats;
    const float *row = placing->row[2];
    const float z = (row[0] * number_at(s->x, s->x16, i) + row[1] * number_at(s->y, s->y16, i)) +
                    row[2] * number_at(s->z, s->z16, i);
    float t = (placing->z_back - z) * placing->z_scale;
    t = 0.0f < t ? t : 0.0f; /* NaN too */
    t = t < 1.0f - 0x1p-22f ? t : 1.0f - 0x1p-22f;
    t = 1.0f + t;
    uint32_t bits;
    memcpy(&bits, &t, sizeof bits);
    return (bits - 0x3F800000u) >> 1;
}

/* Few elements: by insertion. The tables of a radix sort would cost more than they save. */
static void sort_few(const uint32_t *keys, uint64_t *pairs, size_t count, uint32_t *index) {
    for (size_t i = 0; i < count; i++) {
        const uint64_t pair = (uint64_t)keys[i] << 32 | i;
        size_t at = i;
        for (; at > 0 && pairs[at - 1] > pair; at--) {
            pairs[at] = pairs[at - 1];
        }
        pairs[at] = pair;
    }
    for (size_t i = 0; i < count; i++) {
        index[i] = (uint32_t)pairs[i];
    }
}

void vd_sorter_run(vd_sorter *sorter, size_t count, uint32_t *index) {
    enum { DIGITS = 1 << VD_SORT_BITS };
    const uint32_t *keys = sorter->keys;
    if (count <= VD_SORT_SMALL) {
        sort_few(keys, sorter->pairs, count, index);
        return;
    }
    uint32_t *low = sorter->first[0], *high = sorter->first[1];
    memset(sorter->first, 0, sizeof sorter->first);
    for (size_t i = 0; i < count; i++) {
        low[keys[i] & (DIGITS - 1)]++;
        high[keys[i] >> VD_SORT_BITS]++;
    }
    uint32_t low_sum = 0, high_sum = 0;
    for (int d = 0; d < DIGITS; d++) {
        const uint32_t low_count = low[d], high_count = high[d];
        low[d] = low_sum;
        high[d] = high_sum;
        low_sum += low_count;
        high_sum += high_count;
    }
    uint64_t *pairs = sorter->pairs;
    for (size_t i = 0; i < count; i++) {
        const uint32_t key = keys[i];
        pairs[low[key & (DIGITS - 1)]++] = (uint64_t)(key >> VD_SORT_BITS) << 32 | (uint32_t)i;
    }
    for (size_t i = 0; i < count; i++) {
        index[high[pairs[i] >> 32]++] = (uint32_t)pairs[i];
    }
}

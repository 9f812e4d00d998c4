/* coverage_check.h: whether layers can be drawn, and where they lie. */
#ifndef VEDUTA_COVERAGE_COVERAGE_CHECK_H
#define VEDUTA_COVERAGE_COVERAGE_CHECK_H

#include "coverage/coverage_internal.h"

static inline vd_box vd_box_empty(void) {
    return (vd_box){0x1p40, 0x1p40, -0x1p40, -0x1p40};
}

static inline void vd_box_add(vd_box *box, const vd_box *other) {
    box->min_x = other->min_x < box->min_x ? other->min_x : box->min_x;
    box->min_y = other->min_y < box->min_y ? other->min_y : box->min_y;
    box->max_x = box->max_x < other->max_x ? other->max_x : box->max_x;
    box->max_y = box->max_y < other->max_y ? other->max_y : box->max_y;
}

/* True when a layer can be drawn; then *box is extended by what it may touch. Otherwise *why, which
 * may be null, says what is wrong with it; `index` is its number. */
bool vd_check_layer(const vd_layer *layer, size_t index, vd_box *box, vd_status *why);

#endif

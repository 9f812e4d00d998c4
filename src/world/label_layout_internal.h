/* label_layout_internal.h: what tests see of the placing of labels beyond the public API. */
#ifndef VEDUTA_WORLD_LABEL_LAYOUT_INTERNAL_H
#define VEDUTA_WORLD_LABEL_LAYOUT_INTERNAL_H

#include <veduta/label_layout.h>

/* Returns how many rectangles the last placing compared with others: its cost. */
uint64_t vd_label_layout_looks(const vd_label_layout *layout);

#endif

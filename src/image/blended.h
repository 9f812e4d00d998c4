/* blended.h: what a target's list of blended things holds of one sample. */
#ifndef VEDUTA_IMAGE_BLENDED_H
#define VEDUTA_IMAGE_BLENDED_H

#include <veduta/target.h>

#define VD_BLENDED_LAYERS 8

/* Things stand farthest first. `last` is the nearest that was blended already: what is not nearer
 * is not taken again. */
typedef struct vd_blended {
    uint64_t order[VD_BLENDED_LAYERS];
    uint16_t color[VD_BLENDED_LAYERS][4];
    float depth[VD_BLENDED_LAYERS];
    uint64_t last_order;
    float last_depth; /* below 0: nothing was */
    uint16_t count;
    bool more; /* than fitted */
} __attribute__((aligned(64))) vd_blended;

/* Whether anything was blended at the sample since the list was begun. */
static inline bool vd_blended_any(const vd_blended *sample) {
    return sample->last_depth >= 0.0f;
}

#endif

/* list.h: an array that grows and keeps what is in it. */
#ifndef VEDUTA_CORE_LIST_H
#define VEDUTA_CORE_LIST_H

#include "core/core.h"

/* All zero: nothing yet. `data` is released by vd_release. */
typedef struct vd_list {
    void *data;
    size_t count, capacity; /* elements */
} vd_list;

/* Makes room for `count` more elements of `size_bytes` each and returns the first of them; null
 * when memory is out. The list counts them as there. */
VD_MUST_USE void *vd_list_grow(vd_context *context, vd_list *list, size_t count, size_t size_bytes);

static inline void *vd_list_add(vd_context *context, vd_list *list, size_t count,
                                size_t size_bytes) {
    if (list->capacity - list->count >= count && list->data != NULL) {
        void *at = (char *)list->data + list->count * size_bytes;
        list->count += count;
        return at;
    }
    return vd_list_grow(context, list, count, size_bytes);
}

#endif

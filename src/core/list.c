#include "core/list.h"

#include <string.h>

void *vd_list_grow(vd_context *context, vd_list *list, size_t count, size_t size_bytes) {
    if (count > SIZE_MAX / 4 || list->count > SIZE_MAX / 4) {
        return NULL;
    }
    size_t capacity = list->capacity + list->capacity / 2 + 64;
    capacity = capacity > list->count + count ? capacity : list->count + count;
    void *data = vd_allocate(context, capacity, size_bytes);
    if (data == NULL) {
        return NULL;
    }
    if (list->count > 0) {
        memcpy(data, list->data, list->count * size_bytes);
    }
    vd_release(context, list->data);
    list->data = data;
    list->capacity = capacity;
    list->count += count;
    return (char *)data + (list->count - count) * size_bytes;
}

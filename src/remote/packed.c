/* packed.c: packed pictures that several clients are sent. */
#include "remote/packed.h"

#include <string.h>
#include <veduta/context.h>

const vd_packed *vd_packed_find(const vd_packed_cache *cache, uint64_t picture, vd_codec codec,
                                int quality) {
    for (int i = 0; i < VD_PACKED_MOST && picture != 0; i++) {
        const vd_packed *at = &cache->items[i];
        if (at->picture == picture && at->codec == codec && at->quality == quality) {
            return at;
        }
    }
    return NULL;
}

static void drop(vd_context *context, vd_packed_cache *cache, int index) {
    vd_packed *at = &cache->items[index];
    cache->bytes -= at->bytes;
    vd_release(context, at->data);
    *at = (vd_packed){.picture = 0};
}

void vd_packed_keep(vd_context *context, vd_packed_cache *cache, const vd_packed *packed) {
    uint8_t *data = packed->picture != 0 && packed->bytes < VD_PACKED_BYTES
                        ? vd_allocate(context, packed->bytes, 1)
                        : NULL;
    if (data == NULL) {
        return;
    }
    drop(context, cache, cache->next);
    for (int i = 1; cache->bytes + packed->bytes > VD_PACKED_BYTES; i++) {
        drop(context, cache, (cache->next + i) % VD_PACKED_MOST);
    }
    memcpy(data, packed->data, packed->bytes);
    vd_packed *to = &cache->items[cache->next];
    *to = *packed;
    to->data = data;
    cache->bytes += packed->bytes;
    cache->next = (cache->next + 1) % VD_PACKED_MOST;
}

void vd_packed_clear(vd_context *context, vd_packed_cache *cache) {
    for (int i = 0; i < VD_PACKED_MOST; i++) {
        drop(context, cache, i);
    }
}

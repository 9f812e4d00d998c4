/* packed.h: packed pictures that several clients are sent, so that each is packed once. */
#ifndef VEDUTA_REMOTE_PACKED_H
#define VEDUTA_REMOTE_PACKED_H

#include <veduta/codec.h>

/* Of all that are kept; and how many there may be. */
#define VD_PACKED_BYTES ((size_t)4 << 20)
#define VD_PACKED_MOST 512

typedef struct vd_packed {
    uint64_t picture; /* vd_impostor_item.shared; 0: nothing */
    vd_codec codec;
    int quality; /* that was asked for */
    size_t bytes;
    uint8_t *data;
} vd_packed;

/* Zero it. The oldest make room. */
typedef struct vd_packed_cache {
    vd_packed items[VD_PACKED_MOST]; /* a ring: */
    int next;                        /* is overwritten next; those behind it are the oldest */
    size_t bytes;
} vd_packed_cache;

/* Null: it is not there. Lives until the next keeping. */
const vd_packed *vd_packed_find(const vd_packed_cache *cache, uint64_t picture, vd_codec codec,
                                int quality);

/* Keeps a copy, unless memory is out or it is as large as all may be. */
void vd_packed_keep(vd_context *context, vd_packed_cache *cache, const vd_packed *packed);

void vd_packed_clear(vd_context *context, vd_packed_cache *cache);

#endif

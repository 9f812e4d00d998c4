/* buffer.h: memory of a renderer that grows with what it draws, and stays between pictures. */
#ifndef VEDUTA_CORE_BUFFER_H
#define VEDUTA_CORE_BUFFER_H

#include "core/core.h"

/* All zero: nothing yet. `memory` is released by vd_release. */
typedef struct vd_buffer {
    void *memory;
    size_t bytes;
} vd_buffer;

/* Makes room for count × size_bytes; what is in it is lost when it grows. On failure, which names
 * `what` the room was for, it holds nothing. */
VD_MUST_USE vd_status vd_buffer_reserve(vd_context *context, vd_buffer *buffer, const char *what,
                                        size_t count, size_t size_bytes);

#endif

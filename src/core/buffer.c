/* buffer.c: memory that grows. */
#include "core/buffer.h"

vd_status vd_buffer_reserve(vd_context *context, vd_buffer *buffer, const char *what, size_t count,
                            size_t size_bytes) {
    if (buffer->memory != NULL && count <= buffer->bytes / size_bytes) {
        return vd_success();
    }
    vd_release(context, buffer->memory);
    buffer->bytes = 0;
    buffer->memory = vd_allocate(context, count, size_bytes);
    if (buffer->memory == NULL) {
        return vd_out_of_memory(what, count * size_bytes);
    }
    buffer->bytes = count * size_bytes;
    return vd_success();
}

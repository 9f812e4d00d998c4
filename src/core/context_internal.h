/* context_internal.h: what a context is made of. For the files of this room only. */
#ifndef VEDUTA_CORE_CONTEXT_INTERNAL_H
#define VEDUTA_CORE_CONTEXT_INTERNAL_H

#include <stdatomic.h>
#include "core/core.h"

#define VD_MAX_THREADS 1024

typedef struct vd_pool vd_pool;

struct vd_context {
    vd_allocator allocator;
    vd_log_function *log;
    void *log_user;
    vd_isa isa;
    vd_executor executor;
    vd_pool *pool; /* null with a caller's executor */
    atomic_size_t bytes_now, bytes_peak;
    _Atomic uint64_t allocations;
};

/* The library's own pool of `threads` − 1 threads; the caller of a loop is the last one. */
VD_MUST_USE vd_status vd_pool_create(vd_context *context, int threads, vd_pool **out);
void vd_pool_destroy(vd_context *context, vd_pool **pool);
vd_executor vd_pool_executor(vd_pool *pool);

#endif

/* context.h: the one thing that every call hangs from.
 *
 * A vd_context holds the allocator, the log, the executor (threads) and the choice of SIMD level.
 * Nothing else in the library is shared or global. A context may be used from several threads at
 * once, with one rule: only one thread at a time may run a parallel call (vd_parallel_for and the
 * renderers above it); the others load, save and inspect.
 */
#ifndef VEDUTA_CONTEXT_H
#define VEDUTA_CONTEXT_H

#include <stddef.h>
#include <stdint.h>
#include <veduta/status.h>

VD_BEGIN_DECLARATIONS

typedef struct vd_context vd_context;

/* Where memory comes from. `allocate` returns 64-byte aligned memory or null; `release` gets back
 * the same pointer and size. Both may be called from several threads at once. */
typedef struct vd_allocator {
    void *user;
    void *(*allocate)(void *user, size_t size_bytes);
    void (*release)(void *user, void *memory, size_t size_bytes);
} vd_allocator;

typedef enum vd_log_level {
    VD_LOG_DEBUG = 0,
    VD_LOG_INFO,
    VD_LOG_WARNING,
    VD_LOG_LEVEL_COUNT
} vd_log_level;

/* Receives one sentence without a line break. May be called from several threads at once. */
typedef void vd_log_function(void *user, vd_log_level level, const char *sentence);

/* One piece of a parallel loop: `index` in [0, count), `worker` in [0, threads). Two pieces that
 * run at the same time have different workers, so `worker` may index scratch memory. */
typedef void vd_task_function(void *user, int index, int worker);

/* Runs loops. `run` calls task(task_user, i, worker) exactly once for every i in [0, count), in
 * any order, on at most `threads` threads, and returns when all calls have returned. */
typedef struct vd_executor {
    void *user;
    int threads;
    void (*run)(void *user, int count, vd_task_function *task, void *task_user);
} vd_executor;

/* SIMD levels, as the x86-64 psABI names them. Every level gives the same bytes. */
typedef enum vd_isa {
    VD_ISA_AUTO = 0, /* the best that this processor has */
    VD_ISA_V2,       /* SSE4.2; on other architectures the portable level */
    VD_ISA_V3,       /* AVX2 */
    VD_ISA_V4,       /* AVX-512 F, BW, CD, DQ, VL */
    VD_ISA_COUNT
} vd_isa;

typedef struct vd_context_def {
    vd_allocator allocator; /* all null: the C library's */
    vd_log_function *log;   /* null: silent */
    void *log_user;
    int threads;          /* 0: one per available processor; 1: no pool; at most 1024 */
    vd_executor executor; /* `run` null: the library's own pool of `threads` threads */
    vd_isa isa;           /* VD_ISA_AUTO: the environment variable VEDUTA_CPU (v2, v3, v4) if set,
                             else the best available */
} vd_context_def;

VD_API vd_context_def vd_context_def_default(void);

/* Creates a context. `def` may be null for the defaults. On success *out is owned by the caller
 * and ended by vd_context_destroy; on failure *out is untouched.
 * Returns VD_ERROR_ARGUMENT (threads out of range, a SIMD level that this processor lacks, an
 * unknown VEDUTA_CPU, an allocator or executor with only some of its functions) or
 * VD_ERROR_MEMORY (also when threads cannot be started). */
VD_API VD_MUST_USE vd_status vd_context_create(const vd_context_def *def, vd_context **out);

/* Ends the pool and frees the context; sets *context to null. Null and half-built are accepted.
 * Everything created from the context must have been destroyed before. */
VD_API void vd_context_destroy(vd_context **context);

VD_API int vd_context_threads(const vd_context *context);
VD_API vd_isa vd_context_isa(const vd_context *context);

/* Returns "auto", "v2", "v3" or "v4". */
VD_API const char *vd_isa_name(vd_isa isa);

/* Returns the best SIMD level of this processor (never VD_ISA_AUTO). */
VD_API vd_isa vd_isa_best(void);

/* Memory taken through the context's allocator: bytes held now, the most held since creation or the
 * last reset, and the number of allocations made so far. Thread-safe. */
typedef struct vd_memory_stats {
    size_t bytes_now;
    size_t bytes_peak;
    uint64_t allocations;
} vd_memory_stats;

VD_API vd_memory_stats vd_context_memory(const vd_context *context);
VD_API void vd_context_memory_reset_peak(vd_context *context);

/* Allocates count × size bytes, 64-byte aligned, not cleared. Returns null when the product
 * overflows or memory is out; a zero-sized request returns a valid, unique pointer.
 * vd_release accepts null. */
VD_API VD_MUST_USE void *vd_allocate(vd_context *context, size_t count, size_t size_bytes);
VD_API void vd_release(vd_context *context, void *memory);

/* Sends a formatted sentence to the context's log, if it has one. */
VD_API void vd_log(vd_context *context, vd_log_level level, const char *format, ...)
    VD_PRINTF(3, 4);

/* The library's version, such as "0.1.0". */
VD_API const char *vd_version(void);

VD_END_DECLARATIONS

#endif

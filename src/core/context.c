/* The context: allocator with accounting, log, SIMD level, and the executor that it owns. */
#define _GNU_SOURCE /* sched_getaffinity */
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>
#ifdef __linux__
#include <sched.h>
#include <sys/mman.h>
#endif
#include "core/context_internal.h"

/* Every block is preceded by one cache line that remembers its size. */
#define HEADER_BYTES 64

/* Large blocks are asked for in huge pages: one fault for 2 MiB instead of 512 for 4 KiB each (a
 * cold picture of 1920 × 1080: 14,700 faults became 3,000, a ninth of its time). What is left of a
 * block has a huge page too if that holds at most an eighth more memory, else small ones. */
#define HUGE_PAGE_BYTES ((size_t)2 << 20)

static void *default_allocate(void *user, size_t size_bytes) {
    (void)user;
    void *memory = NULL;
    const size_t rest = size_bytes % HUGE_PAGE_BYTES;
    size_t huge_bytes = size_bytes - rest;
    if (rest > 0 && HUGE_PAGE_BYTES - rest <= size_bytes / 8 &&
        huge_bytes <= SIZE_MAX - HUGE_PAGE_BYTES) {
        huge_bytes += HUGE_PAGE_BYTES;
        size_bytes = huge_bytes;
    }
    if (posix_memalign(&memory, huge_bytes > 0 ? HUGE_PAGE_BYTES : 64, size_bytes) != 0) {
        return NULL;
    }
#ifdef MADV_HUGEPAGE
    if (huge_bytes > 0) { /* advice: where it is not taken, the memory is as good */
        (void)madvise(memory, huge_bytes, MADV_HUGEPAGE);
    }
#endif
    return memory;
}

static void default_release(void *user, void *memory, size_t size_bytes) {
    (void)user;
    (void)size_bytes;
    free(memory);
}

vd_context_def vd_context_def_default(void) {
    vd_context_def def;
    memset(&def, 0, sizeof def);
    return def;
}

vd_context_def vd_context_def_like(const vd_context *context) {
    return (vd_context_def){.allocator = context->allocator,
                            .log = context->log,
                            .log_user = context->log_user,
                            .isa = context->isa};
}

const char *vd_isa_name(vd_isa isa) {
    static const char *const names[VD_ISA_COUNT] = {"auto", "v2", "v3", "v4"};
    return isa >= 0 && isa < VD_ISA_COUNT ? names[isa] : "unknown";
}

vd_isa vd_isa_best(void) {
#if defined(__x86_64__)
    __builtin_cpu_init();
    if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") &&
        __builtin_cpu_supports("bmi2")) {
        if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
            __builtin_cpu_supports("avx512cd") && __builtin_cpu_supports("avx512dq") &&
            __builtin_cpu_supports("avx512vl")) {
            return VD_ISA_V4;
        }
        return VD_ISA_V3;
    }
#endif
    return VD_ISA_V2;
}

static int available_processors(void) {
#ifdef __linux__
    cpu_set_t set;
    if (sched_getaffinity(0, sizeof set, &set) == 0) {
        return CPU_COUNT(&set);
    }
#endif
    long count = sysconf(_SC_NPROCESSORS_ONLN);
    return count < 1 ? 1 : (int)count;
}

static vd_status choose_isa(vd_isa wanted, vd_isa *out) {
    vd_isa best = vd_isa_best();
    if (wanted == VD_ISA_AUTO) {
        const char *name = getenv("VEDUTA_CPU");
        if (name == NULL || name[0] == '\0') {
            *out = best;
            return vd_success();
        }
        for (int i = VD_ISA_V2; i < VD_ISA_COUNT; i++) {
            if (strcmp(name, vd_isa_name((vd_isa)i)) == 0) {
                wanted = (vd_isa)i;
            }
        }
        if (wanted == VD_ISA_AUTO) {
            return vd_failure(VD_ERROR_ARGUMENT,
                              "VEDUTA_CPU is '%s', but must be v2, v3 or v4, or unset", name);
        }
    }
    if (wanted < VD_ISA_V2 || wanted > best) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "the SIMD level %s is not available here; this processor has up to %s",
                          vd_isa_name(wanted), vd_isa_name(best));
    }
    *out = wanted;
    return vd_success();
}

static vd_status check_def(const vd_context_def *def) {
    if (def->threads < 0 || def->threads > VD_MAX_THREADS) {
        return vd_failure(VD_ERROR_ARGUMENT, "threads is %d, but must be 0 (automatic) to %d",
                          def->threads, VD_MAX_THREADS);
    }
    if ((def->allocator.allocate == NULL) != (def->allocator.release == NULL)) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "the allocator has only one of its two functions; set both or none");
    }
    if (def->executor.run != NULL &&
        (def->executor.threads < 1 || def->executor.threads > VD_MAX_THREADS)) {
        return vd_failure(VD_ERROR_ARGUMENT, "the executor's threads are %d, but must be 1 to %d",
                          def->executor.threads, VD_MAX_THREADS);
    }
    return vd_success();
}

vd_status vd_context_create(const vd_context_def *def_or_null, vd_context **out) {
    vd_context_def def = def_or_null != NULL ? *def_or_null : vd_context_def_default();
    if (out == NULL) {
        return vd_failure(VD_ERROR_ARGUMENT, "vd_context_create needs a place for its result");
    }
    vd_status status = check_def(&def);
    if (status.code != VD_OK) {
        return status;
    }
    vd_isa isa = VD_ISA_AUTO;
    status = choose_isa(def.isa, &isa);
    if (status.code != VD_OK) {
        return status;
    }
    if (def.allocator.allocate == NULL) {
        def.allocator.allocate = default_allocate;
        def.allocator.release = default_release;
    }
    vd_context *context = def.allocator.allocate(def.allocator.user, sizeof *context);
    if (context == NULL) {
        return vd_out_of_memory("a context", sizeof *context);
    }
    memset(context, 0, sizeof *context);
    context->allocator = def.allocator;
    context->log = def.log;
    context->log_user = def.log_user;
    context->isa = isa;
    atomic_init(&context->bytes_now, 0);
    atomic_init(&context->bytes_peak, 0);
    atomic_init(&context->allocations, 0);
    if (def.executor.run != NULL) {
        context->executor = def.executor;
    } else {
        int threads = def.threads > 0 ? def.threads : available_processors();
        status = vd_pool_create(context, threads < VD_MAX_THREADS ? threads : VD_MAX_THREADS,
                                &context->pool);
        if (status.code != VD_OK) {
            vd_context_destroy(&context);
            return status;
        }
        context->executor = vd_pool_executor(context->pool);
    }
    *out = context;
    return vd_success();
}

void vd_context_destroy(vd_context **context) {
    if (context == NULL || *context == NULL) {
        return;
    }
    vd_context *old = *context;
    *context = NULL;
    vd_pool_destroy(old, &old->pool);
    vd_allocator allocator = old->allocator;
    allocator.release(allocator.user, old, sizeof *old);
}

int vd_context_threads(const vd_context *context) {
    return context->executor.threads;
}

vd_isa vd_context_isa(const vd_context *context) {
    return context->isa;
}

vd_memory_stats vd_context_memory(const vd_context *context) {
    vd_memory_stats stats = {atomic_load(&context->bytes_now), atomic_load(&context->bytes_peak),
                             atomic_load(&context->allocations)};
    return stats;
}

void vd_context_memory_reset_peak(vd_context *context) {
    atomic_store(&context->bytes_peak, atomic_load(&context->bytes_now));
}

void *vd_allocate(vd_context *context, size_t count, size_t size_bytes) {
    size_t total;
    if (__builtin_mul_overflow(count, size_bytes, &total) ||
        __builtin_add_overflow(total, (size_t)HEADER_BYTES, &total)) {
        return NULL;
    }
    uint8_t *block = context->allocator.allocate(context->allocator.user, total);
    if (block == NULL) {
        return NULL;
    }
    memcpy(block, &total, sizeof total);
    size_t now = atomic_fetch_add(&context->bytes_now, total) + total;
    size_t peak = atomic_load(&context->bytes_peak);
    while (now > peak && !atomic_compare_exchange_weak(&context->bytes_peak, &peak, now)) {
    }
    atomic_fetch_add(&context->allocations, 1);
    return block + HEADER_BYTES;
}

void *vd_allocate_zero(vd_context *context, size_t count, size_t size_bytes) {
    void *memory = vd_allocate(context, count, size_bytes);
    if (memory != NULL) {
        memset(memory, 0, count * size_bytes);
    }
    return memory;
}

void vd_release(vd_context *context, void *memory) {
    if (memory == NULL) {
        return;
    }
    uint8_t *block = (uint8_t *)memory - HEADER_BYTES;
    size_t total;
    memcpy(&total, block, sizeof total);
    atomic_fetch_sub(&context->bytes_now, total);
    context->allocator.release(context->allocator.user, block, total);
}

char *vd_copy_string(vd_context *context, const char *string) {
    size_t size_bytes = strlen(string) + 1;
    char *copy = vd_allocate(context, size_bytes, 1);
    if (copy != NULL) {
        memcpy(copy, string, size_bytes);
    }
    return copy;
}

vd_status vd_out_of_memory(const char *what, size_t size_bytes) {
    return vd_failure(VD_ERROR_MEMORY,
                      "not enough memory for %s (%zu bytes); free some or use a "
                      "smaller picture or map",
                      what, size_bytes);
}

size_t vd_row_stride(size_t width, size_t size_bytes) {
    size_t per_line = 64 / size_bytes;
    size_t stride = (width + per_line - 1) / per_line * per_line;
    if (stride * size_bytes % 1024 == 0) {
        stride += per_line;
    }
    return stride;
}

void vd_log(vd_context *context, vd_log_level level, const char *format, ...) {
    if (context->log == NULL) {
        return;
    }
    char sentence[512];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(sentence, sizeof sentence, format, arguments);
    va_end(arguments);
    context->log(context->log_user, level, sentence);
}

uint64_t vd_clock_ns(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (uint64_t)now.tv_sec * 1000000000u + (uint64_t)now.tv_nsec;
}

uint64_t vd_processor_ns(void) {
    struct timespec spent;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &spent);
    return (uint64_t)spent.tv_sec * 1000000000u + (uint64_t)spent.tv_nsec;
}

const char *vd_version(void) {
    return VEDUTA_VERSION;
}

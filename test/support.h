/* support.h: what several tests need: random numbers that are the same on every machine, a context
 * per thread count and SIMD level, and an allocator whose n-th call fails. */
#ifndef VEDUTA_TEST_SUPPORT_H
#define VEDUTA_TEST_SUPPORT_H

#include <setjmp.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include <cmocka.h>
#include <veduta/context.h>

/* SplitMix64 (Steele, Lea, Flood 2014). */
static inline uint64_t test_random(uint64_t *state) {
    uint64_t z = (*state += 0x9E3779B97F4A7C15u);
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    return z ^ (z >> 31);
}

/* Uniform in [0, 1). */
static inline double test_uniform(uint64_t *state) {
    return (double)(test_random(state) >> 11) * 0x1p-53;
}

/* True in the builds that run the suite on smaller scenes: `.ci/run` sets VEDUTA_TEST_REDUCED. */
static inline bool test_is_reduced(void) {
    return getenv("VEDUTA_TEST_REDUCED") != NULL;
}

/* Makes a folder of a test's own, whose name ends in XXXXXX until then, and goes there; leaves and
 * removes it. Return 0, or -1 when that cannot be. */
static inline int test_enter_folder(char *folder) {
    return mkdtemp(folder) != NULL && chdir(folder) == 0 ? 0 : -1;
}

static inline int test_leave_folder(const char *folder) {
    char command[512];
    snprintf(command, sizeof command, "rm -rf '%s'", folder);
    return chdir(VEDUTA_BINARY_DIR) == 0 && system(command) == 0 ? 0 : -1;
}

#define assert_ok(expression)                                                                      \
    do {                                                                                           \
        vd_status status_ = (expression);                                                          \
        if (status_.code != VD_OK) {                                                               \
            fail_msg("%s: %s (%s)", #expression, status_.message, vd_code_name(status_.code));     \
        }                                                                                          \
    } while (0)

static inline vd_context *test_context(int threads, vd_isa isa) {
    vd_context_def def = vd_context_def_default();
    def.threads = threads;
    def.isa = isa;
    vd_context *context = NULL;
    assert_ok(vd_context_create(&def, &context));
    return context;
}

/* An allocator that fails at its `fail_at`-th call (1-based; 0: never) and counts what is out.
 * Not thread-safe: for contexts of one thread. */
typedef struct test_allocator {
    int calls, fail_at, live;
} test_allocator;

static inline void *test_allocate(void *user, size_t size_bytes) {
    test_allocator *a = user;
    if (++a->calls == a->fail_at) {
        return NULL;
    }
    void *memory = NULL;
    if (posix_memalign(&memory, 64, size_bytes) != 0) {
        return NULL;
    }
    memset(memory, 0xA5, size_bytes);
    a->live++;
    return memory;
}

static inline void test_release(void *user, void *memory, size_t size_bytes) {
    (void)size_bytes;
    ((test_allocator *)user)->live--;
    free(memory);
}

/* Creates a single-threaded context on such an allocator. */
static inline vd_context *test_failing_context(test_allocator *allocator) {
    vd_context_def def = vd_context_def_default();
    def.threads = 1;
    def.allocator.user = allocator;
    def.allocator.allocate = test_allocate;
    def.allocator.release = test_release;
    vd_context *context = NULL;
    assert_ok(vd_context_create(&def, &context));
    return context;
}

#endif

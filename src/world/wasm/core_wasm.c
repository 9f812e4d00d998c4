/* core_wasm.c: what src/raster, src/model and src/world ask of the core and of libc, in
 * WebAssembly: one context, one thread, and memory in one arena whose size the page states once.
 *
 *   arena  │head│taken···│head│free··········│head│taken·│head│free···│     first fit; neighbours
 *                                                                          that are free become one
 */
#include <math.h>
#include <stdarg.h>
#include <string.h>
#include "core/core.h"
#include "world/wasm/placed_wasm.h"

#define HEAD_BYTES 64u
#define ALIGNED(bytes) (((bytes) + HEAD_BYTES - 1) & ~(uint64_t)(HEAD_BYTES - 1))

typedef struct block {
    uint32_t bytes; /* with this head: a multiple of HEAD_BYTES */
    uint32_t taken;
} block;

struct vd_context {
    uint8_t *arena;
    uint32_t bytes;
};

static struct vd_context only;

/* ---- memory -----------------------------------------------------------------------------------*/

vd_context *vd_wasm_context(size_t bytes) {
    if (only.arena == NULL && bytes >= HEAD_BYTES && bytes <= INT32_MAX) {
        only.bytes = (uint32_t)bytes & ~(HEAD_BYTES - 1);
        only.arena = (uint8_t *)vd_wasm_take(only.bytes);
        if (only.arena != NULL) {
            *(block *)only.arena = (block){only.bytes, 0};
        }
    }
    return only.arena != NULL ? &only : NULL;
}

static block *block_at(const vd_context *context, uint32_t at) {
    return (block *)(context->arena + at);
}

void *vd_allocate(vd_context *context, size_t count, size_t size_bytes) {
    const uint64_t wanted = ALIGNED((uint64_t)count * size_bytes + HEAD_BYTES);
    if (size_bytes > 0 && count > UINT32_MAX / size_bytes) {
        return NULL;
    }
    for (uint32_t at = 0; at < context->bytes; at += block_at(context, at)->bytes) {
        block *b = block_at(context, at);
        if (b->taken) {
            continue;
        }
        for (uint32_t next = at + b->bytes;
             next < context->bytes && !block_at(context, next)->taken; next = at + b->bytes) {
            b->bytes += block_at(context, next)->bytes;
        }
        if (b->bytes >= wanted) {
            if (b->bytes > wanted) {
                *block_at(context, at + (uint32_t)wanted) = (block){b->bytes - (uint32_t)wanted, 0};
            }
            *b = (block){(uint32_t)wanted, 1};
            return context->arena + at + HEAD_BYTES;
        }
    }
    return NULL;
}

void *vd_allocate_zero(vd_context *context, size_t count, size_t size_bytes) {
    void *made = vd_allocate(context, count, size_bytes);
    return made != NULL ? memset(made, 0, count * size_bytes) : NULL;
}

void vd_release(vd_context *context, void *memory) {
    (void)context;
    if (memory != NULL) {
        ((block *)((uint8_t *)memory - HEAD_BYTES))->taken = 0;
    }
}

char *vd_copy_string(vd_context *context, const char *string) {
    const size_t bytes = strlen(string) + 1;
    char *made = vd_allocate(context, bytes, 1);
    return made != NULL ? memcpy(made, string, bytes) : NULL;
}

size_t vd_row_stride(size_t width, size_t size_bytes) {
    const size_t line = 64 / size_bytes;
    return (width + line - 1) / line * line;
}

/* ---- one thread -------------------------------------------------------------------------------*/

int vd_context_threads(const vd_context *context) {
    (void)context;
    return 1;
}

vd_isa vd_context_isa(const vd_context *context) {
    (void)context;
    return VD_ISA_V2;
}

vd_status vd_parallel_for(vd_context *context, vd_job *job, int count, vd_task_function *task,
                          void *user) {
    (void)context;
    (void)job;
    for (int i = 0; i < count; i++) {
        task(user, i, 0);
    }
    return vd_success();
}

bool vd_job_stopped(const vd_job *job) {
    (void)job;
    return false;
}

void vd_job_report(vd_job *job, int done, int total) {
    (void)job;
    (void)done;
    (void)total;
}

void vd_log(vd_context *context, vd_log_level level, const char *format, ...) {
    (void)context;
    (void)level;
    (void)format;
}

/* ---- sentences --------------------------------------------------------------------------------*/

vd_status vd_success(void) {
    vd_status status;
    status.code = VD_OK;
    status.message[0] = '\0';
    return status;
}

/* Of the conversions only %s are filled in: numbers are for people who have the file. */
vd_status vd_failure(vd_code code, const char *format, ...) {
    vd_status status;
    size_t at = 0;
    va_list arguments;
    status.code = code;
    va_start(arguments, format);
    bool known = true; /* what came so far, or the place of the next argument is not */
    for (const char *f = format; *f != '\0' && at + 1 < sizeof status.message; f++) {
        if (f[0] == '%' && f[1] == 's' && known) {
            const char *text = va_arg(arguments, const char *);
            for (; *text != '\0' && at + 1 < sizeof status.message; text++) {
                status.message[at++] = *text;
            }
            f++;
        } else {
            known = known && *f != '%';
            status.message[at++] = *f;
        }
    }
    va_end(arguments);
    status.message[at] = '\0';
    return status;
}

vd_status vd_out_of_memory(const char *what, size_t size_bytes) {
    (void)size_bytes;
    return vd_failure(VD_ERROR_MEMORY, "not enough memory for %s", what);
}

/* ---- libc -------------------------------------------------------------------------------------*/

/* Or the compiler would see these loops for what they are, and call them. */
#define NO_BUILTIN(name) __attribute__((no_builtin(name)))

NO_BUILTIN("memmove") void *memmove(void *to, const void *from, size_t count) {
    unsigned char *t = to;
    const unsigned char *f = from;
    for (size_t i = 0; i < count; i++) {
        const size_t at = t < f ? i : count - 1 - i;
        t[at] = f[at];
    }
    return to;
}

NO_BUILTIN("memcmp") int memcmp(const void *left, const void *right, size_t count) {
    const unsigned char *l = left, *r = right;
    for (size_t i = 0; i < count; i++) {
        if (l[i] != r[i]) {
            return l[i] < r[i] ? -1 : 1;
        }
    }
    return 0;
}

/* By powers of two in steps that are normal numbers: exact where the result is one. */
double ldexp(double value, int exponent) {
    for (; exponent != 0;) {
        const int step = exponent > 1000 ? 1000 : exponent < -1000 ? -1000 : exponent;
        const uint64_t bits = (uint64_t)(step + 1023) << 52;
        double power;
        memcpy(&power, &bits, sizeof power);
        value *= power;
        exponent -= step;
    }
    return value;
}

NO_BUILTIN("strlen") size_t strlen(const char *text) {
    size_t count = 0;
    while (text[count] != '\0') {
        count++;
    }
    return count;
}

static void swap(uint8_t *a, uint8_t *b, size_t size) {
    for (size_t i = 0; i < size; i++) {
        const uint8_t kept = a[i];
        a[i] = b[i];
        b[i] = kept;
    }
}

/* Heapsort (Williams 1964): whatever the items, no worse than n log n. */
static void sift(uint8_t *items, size_t at, size_t count, size_t size,
                 int (*compare)(const void *, const void *)) {
    for (size_t child = 2 * at + 1; child < count; at = child, child = 2 * at + 1) {
        if (child + 1 < count && compare(items + child * size, items + (child + 1) * size) < 0) {
            child++;
        }
        if (compare(items + at * size, items + child * size) >= 0) {
            return;
        }
        swap(items + at * size, items + child * size, size);
    }
}

void qsort(void *items, size_t count, size_t size, int (*compare)(const void *, const void *)) {
    for (size_t i = count / 2; i-- > 0;) {
        sift(items, i, count, size, compare);
    }
    for (size_t end = count; end-- > 1;) {
        swap(items, (uint8_t *)items + end * size, size);
        sift(items, 0, end, size, compare);
    }
}

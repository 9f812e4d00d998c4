/* core.h: what the rooms above see of the core beyond the public API. */
#ifndef VEDUTA_CORE_CORE_H
#define VEDUTA_CORE_CORE_H

#include <stdint.h>
#include <veduta/context.h>
#include <veduta/job.h>

/* Monotonic time in nanoseconds. */
uint64_t vd_clock_ns(void);

/* Processor time of all threads of this process so far, in nanoseconds. */
uint64_t vd_processor_ns(void);

/* Sets the progress of a job (may be null) whose call is not one loop: `done` of `total` pieces. */
void vd_job_report(vd_job *job, int done, int total);

/* A def with a context's allocator, log and SIMD level, of another one for another thread. */
vd_context_def vd_context_def_like(const vd_context *context);

/* Allocates count × size bytes cleared to zero; else as vd_allocate. */
VD_MUST_USE void *vd_allocate_zero(vd_context *context, size_t count, size_t size_bytes);

/* Copies a string into the context's memory; null when memory is out. */
VD_MUST_USE char *vd_copy_string(vd_context *context, const char *string);

/* The one sentence for running out of memory: names what was being made and how much it takes. */
vd_status vd_out_of_memory(const char *what, size_t size_bytes);

/* Returns a row stride, in elements, for rows of `width` elements of `size_bytes` (1, 2, 4, 8):
 * a multiple of 64 bytes, never of 1 KiB (neighbouring rows would share cache sets). */
size_t vd_row_stride(size_t width, size_t size_bytes);

#endif

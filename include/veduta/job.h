/* job.h: a running call that can be cancelled, limited in time and watched, and the parallel loop.
 *
 * A job is made by the caller, handed to a long call (a render), and polled there once per tile.
 * Cancelling is a single atomic store: it may be done from any thread and from a signal handler.
 */
#ifndef VEDUTA_JOB_H
#define VEDUTA_JOB_H

#include <stdbool.h>
#include <veduta/context.h>

VD_BEGIN_DECLARATIONS

typedef struct vd_job vd_job;

/* Creates a job; *out is owned by the caller. Returns VD_ERROR_MEMORY. */
VD_API VD_MUST_USE vd_status vd_job_create(vd_context *context, vd_job **out);
VD_API void vd_job_destroy(vd_job **job);

/* Asks the running call to stop; it returns VD_ERROR_CANCELLED soon after. Any thread, and
 * async-signal-safe. Stays set until vd_job_reset. */
VD_API void vd_job_cancel(vd_job *job);

/* Sets the time, from now, after which the call stops by itself; 0 removes the limit. */
VD_API void vd_job_set_time_limit(vd_job *job, uint64_t time_ns);

/* Clears cancellation, time limit and progress, so that the job can be used for another call. */
VD_API void vd_job_reset(vd_job *job);

/* Returns the finished share of the running call, 0 … 1. Any thread. */
VD_API double vd_job_progress(const vd_job *job);

/* True once the job was cancelled or is past its time limit. A null job never stops. */
VD_API bool vd_job_stopped(const vd_job *job);

/* Runs task(user, index, worker) for every index in [0, count) on the context's executor, and
 * returns when all have returned. Polls `job` (may be null) before each piece; pieces that come
 * after a stop are skipped. Progress goes from 0 to 1 over the loop.
 * Not reentrant: a task must not call it, and only one thread at a time may.
 * Returns VD_ERROR_ARGUMENT (negative count, null task) or VD_ERROR_CANCELLED. */
VD_API VD_MUST_USE vd_status vd_parallel_for(vd_context *context, vd_job *job, int count,
                                             vd_task_function *task, void *user);

VD_END_DECLARATIONS

#endif

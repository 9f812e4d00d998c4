/* window_threads.h: a number of threads that can change while everything else stays.
 *
 * A context's number of threads is for life, and all that is made from it hangs on it. So the
 * window's context hands its loops to the pool of another, empty context, and that one is replaced.
 */
#ifndef VEDUTA_APP_WINDOW_THREADS_H
#define VEDUTA_APP_WINDOW_THREADS_H

#include <veduta/context.h>

typedef struct vd_threads {
    vd_context *pool; /* null: loops run on the calling thread */
    int most;         /* that the window's context has room for */
} vd_threads;

/* Finds how many there can be: one per processor, or `least` if that is more. */
VD_MUST_USE vd_status vd_threads_init(vd_threads *threads, int least);
void vd_threads_finish(vd_threads *threads);

/* The executor for the window's context. */
vd_executor vd_threads_executor(vd_threads *threads);

/* Sets how many run loops, 1 … most, between two loops. Returns VD_ERROR_MEMORY; then it stays as
 * it was. */
VD_MUST_USE vd_status vd_threads_set(vd_threads *threads, int count);

#endif

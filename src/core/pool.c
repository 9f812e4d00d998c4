/* The thread pool behind vd_parallel_for.
 *
 * A loop is published as one 64-bit ticket word: the loop's generation in the upper half, the next
 * index in the lower. Workers and the caller take indices by compare-and-swap on that word, so a
 * worker that wakes late finds either its own generation or nothing, never an index of a later loop
 * with an earlier loop's function.
 *
 *   caller   publish ── take, run, take, run … ── wait until finished == count
 *   worker   spin a little ── sleep on the condition ── woken ── take, run … ── spin a little
 *
 * Why not OpenMP: its runtime keeps a pool per calling thread and spins between regions (measured:
 * 487 ms of CPU a second at 60 regions a second, against 3 here). Why a bounded spin: on a busy
 * machine a spinning barrier loses whole scheduler quanta (2 ms frames took 12 to 24 ms).
 */
#include <pthread.h>
#include <sched.h>
#include <string.h>
#include "core/context_internal.h"

/* About 20 µs of polling before sleeping: longer than the gap between the loops of one frame,
 * shorter than anything a person or a battery notices. */
#define SPIN_ROUNDS 2000

typedef struct vd_worker {
    vd_pool *pool;
    pthread_t thread;
    int index;
} vd_worker;

struct vd_pool {
    int threads;                          /* including the caller's */
    int started;                          /* worker threads that exist */
    _Alignas(64) _Atomic uint64_t ticket; /* generation << 32 | next index */
    _Alignas(64) atomic_int finished;     /* indices done in this generation */
    atomic_int inside;                    /* workers between looking at a loop and leaving it */
    atomic_bool stopping;
    atomic_int sleepers;
    atomic_bool caller_sleeps;
    /* The loop; written only while no worker is inside. */
    int count;
    vd_task_function *task;
    void *task_user;
    pthread_mutex_t mutex;
    pthread_cond_t wake, done;
    vd_worker *workers;
};

static inline void pause_briefly(void) {
#if defined(__x86_64__)
    __builtin_ia32_pause();
#endif
}

/* Takes indices of generation `generation` until none is left. */
static void run_pieces(vd_pool *pool, uint32_t generation, int worker) {
    const int count = pool->count;
    uint64_t ticket = atomic_load_explicit(&pool->ticket, memory_order_acquire);
    for (;;) {
        if ((uint32_t)(ticket >> 32) != generation || (int)(uint32_t)ticket >= count) {
            return;
        }
        if (!atomic_compare_exchange_weak_explicit(&pool->ticket, &ticket, ticket + 1,
                                                   memory_order_acq_rel, memory_order_acquire)) {
            continue;
        }
        pool->task(pool->task_user, (int)(uint32_t)ticket, worker);
        if (atomic_fetch_add(&pool->finished, 1) + 1 == count &&
            atomic_load(&pool->caller_sleeps)) {
            pthread_mutex_lock(&pool->mutex);
            pthread_cond_signal(&pool->done);
            pthread_mutex_unlock(&pool->mutex);
        }
        ticket = atomic_load_explicit(&pool->ticket, memory_order_acquire);
    }
}

/* Waits for a generation other than `seen`; returns it. */
static uint32_t wait_for_loop(vd_pool *pool, uint32_t seen) {
    for (int i = 0; i < SPIN_ROUNDS; i++) {
        uint32_t generation = (uint32_t)(atomic_load(&pool->ticket) >> 32);
        if (generation != seen || atomic_load(&pool->stopping)) {
            return generation;
        }
        pause_briefly();
    }
    pthread_mutex_lock(&pool->mutex);
    atomic_fetch_add(&pool->sleepers, 1);
    uint32_t generation;
    while ((generation = (uint32_t)(atomic_load(&pool->ticket) >> 32)) == seen &&
           !atomic_load(&pool->stopping)) {
        pthread_cond_wait(&pool->wake, &pool->mutex);
    }
    atomic_fetch_sub(&pool->sleepers, 1);
    pthread_mutex_unlock(&pool->mutex);
    return generation;
}

static void *worker_main(void *argument) {
    vd_worker *worker = argument;
    vd_pool *pool = worker->pool;
    uint32_t seen = 0;
    while (!atomic_load(&pool->stopping)) {
        wait_for_loop(pool, seen);
        /* Announce first, look second: the publisher changes the loop only when nobody is inside,
         * so what is read below belongs to the generation that is read here. */
        atomic_fetch_add(&pool->inside, 1);
        uint32_t generation = (uint32_t)(atomic_load(&pool->ticket) >> 32);
        if (generation != seen && generation % 2 == 0) {
            run_pieces(pool, generation, worker->index);
            seen = generation;
        }
        atomic_fetch_sub(&pool->inside, 1);
        if (generation % 2 != 0) {
            pause_briefly(); /* a loop is being published right now */
        }
    }
    return NULL;
}

/* Waits until all indices are done: the last piece of another thread may be a long one. */
static void wait_for_workers(vd_pool *pool, int count) {
    for (int i = 0; i < SPIN_ROUNDS; i++) {
        if (atomic_load(&pool->finished) == count) {
            return;
        }
        pause_briefly();
    }
    pthread_mutex_lock(&pool->mutex);
    atomic_store(&pool->caller_sleeps, true);
    while (atomic_load(&pool->finished) < count) {
        pthread_cond_wait(&pool->done, &pool->mutex);
    }
    atomic_store(&pool->caller_sleeps, false);
    pthread_mutex_unlock(&pool->mutex);
}

/* Odd generations mean "being published": workers do not look at the loop then. */
static void pool_run(void *user, int count, vd_task_function *task, void *task_user) {
    vd_pool *pool = user;
    if (pool->started == 0 || count == 1) {
        for (int i = 0; i < count; i++) {
            task(task_user, i, 0);
        }
        return;
    }
    uint32_t generation = (uint32_t)(atomic_load(&pool->ticket) >> 32) + 1;
    atomic_store(&pool->ticket, (uint64_t)generation << 32);
    for (int i = 0; atomic_load(&pool->inside) > 0; i++) {
        if (i < SPIN_ROUNDS) {
            pause_briefly();
        } else {
            sched_yield();
        }
    }
    pool->count = count;
    pool->task = task;
    pool->task_user = task_user;
    atomic_store(&pool->finished, 0);
    generation++;
    atomic_store(&pool->ticket, (uint64_t)generation << 32);
    if (atomic_load(&pool->sleepers) > 0) {
        pthread_mutex_lock(&pool->mutex);
        pthread_cond_broadcast(&pool->wake);
        pthread_mutex_unlock(&pool->mutex);
    }
    run_pieces(pool, generation, 0);
    wait_for_workers(pool, count);
}

vd_executor vd_pool_executor(vd_pool *pool) {
    vd_executor executor = {pool, pool->threads, pool_run};
    return executor;
}

vd_status vd_pool_create(vd_context *context, int threads, vd_pool **out) {
    vd_pool *pool = vd_allocate_zero(context, 1, sizeof *pool);
    if (pool == NULL) {
        return vd_out_of_memory("a thread pool", sizeof *pool);
    }
    pool->threads = threads;
    pthread_mutex_init(&pool->mutex, NULL);
    pthread_cond_init(&pool->wake, NULL);
    pthread_cond_init(&pool->done, NULL);
    pool->workers = vd_allocate_zero(context, (size_t)threads, sizeof *pool->workers);
    if (pool->workers == NULL) {
        vd_pool_destroy(context, &pool);
        return vd_out_of_memory("a thread pool", (size_t)threads * sizeof *pool->workers);
    }
    for (int i = 1; i < threads; i++) {
        vd_worker *worker = &pool->workers[i];
        worker->pool = pool;
        worker->index = i;
        int error = pthread_create(&worker->thread, NULL, worker_main, worker);
        if (error != 0) {
            vd_pool_destroy(context, &pool);
            return vd_failure(VD_ERROR_MEMORY,
                              "cannot start thread %d of %d: %s; use fewer threads", i + 1, threads,
                              strerror(error));
        }
        pool->started++;
    }
    *out = pool;
    return vd_success();
}

void vd_pool_destroy(vd_context *context, vd_pool **pool_in_out) {
    vd_pool *pool = *pool_in_out;
    if (pool == NULL) {
        return;
    }
    *pool_in_out = NULL;
    atomic_store(&pool->stopping, true);
    pthread_mutex_lock(&pool->mutex);
    pthread_cond_broadcast(&pool->wake);
    pthread_mutex_unlock(&pool->mutex);
    for (int i = 1; i <= pool->started; i++) {
        pthread_join(pool->workers[i].thread, NULL);
    }
    pthread_cond_destroy(&pool->wake);
    pthread_cond_destroy(&pool->done);
    pthread_mutex_destroy(&pool->mutex);
    vd_release(context, pool->workers);
    vd_release(context, pool);
}

/* window_threads.c: loops of one context on the pool of another. */
#include "window_threads.h"

#include <veduta/job.h>

vd_status vd_threads_init(vd_threads *threads, int least) {
    *threads = (vd_threads){0};
    vd_context_def def = vd_context_def_default();
    vd_status status = vd_context_create(&def, &threads->pool);
    if (status.code == VD_OK) {
        const int processors = vd_context_threads(threads->pool);
        threads->most = processors > least ? processors : least;
    }
    return status;
}

void vd_threads_finish(vd_threads *threads) {
    vd_context_destroy(&threads->pool);
}

static void run(void *user, int count, vd_task_function *task, void *task_user) {
    vd_threads *threads = user;
    vd_status status = threads->pool != NULL
                           ? vd_parallel_for(threads->pool, NULL, count, task, task_user)
                           : vd_failure(VD_ERROR_ARGUMENT, "there is no pool");
    for (int i = 0; status.code != VD_OK && i < count; i++) {
        task(task_user, i, 0);
    }
}

vd_executor vd_threads_executor(vd_threads *threads) {
    return (vd_executor){threads, threads->most, run};
}

vd_status vd_threads_set(vd_threads *threads, int count) {
    if (threads->pool != NULL && vd_context_threads(threads->pool) == count) {
        return vd_success();
    }
    vd_context_def def = vd_context_def_default();
    def.threads = count;
    vd_context *made = NULL;
    vd_status status = vd_context_create(&def, &made);
    if (status.code == VD_OK) {
        vd_context_destroy(&threads->pool);
        threads->pool = made;
    }
    return status;
}

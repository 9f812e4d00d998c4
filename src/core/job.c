#include <stdatomic.h>
#include "core/context_internal.h"

struct vd_job {
    vd_context *context;
    atomic_bool cancelled;
    _Atomic uint64_t deadline_ns; /* 0: none */
    atomic_int done, total;
};

vd_status vd_job_create(vd_context *context, vd_job **out) {
    vd_job *job = vd_allocate(context, 1, sizeof *job);
    if (job == NULL) {
        return vd_out_of_memory("a job", sizeof *job);
    }
    job->context = context;
    atomic_init(&job->cancelled, false);
    atomic_init(&job->deadline_ns, 0);
    atomic_init(&job->done, 0);
    atomic_init(&job->total, 0);
    *out = job;
    return vd_success();
}

void vd_job_destroy(vd_job **job) {
    if (job != NULL && *job != NULL) {
        vd_release((*job)->context, *job);
        *job = NULL;
    }
}

void vd_job_cancel(vd_job *job) {
    atomic_store(&job->cancelled, true);
}

void vd_job_set_time_limit(vd_job *job, uint64_t time_ns) {
    atomic_store(&job->deadline_ns, time_ns == 0 ? 0 : vd_clock_ns() + time_ns);
}

void vd_job_reset(vd_job *job) {
    atomic_store(&job->cancelled, false);
    atomic_store(&job->deadline_ns, 0);
    vd_job_report(job, 0, 0);
}

void vd_job_report(vd_job *job, int done, int total) {
    if (job != NULL) {
        atomic_store(&job->total, total);
        atomic_store(&job->done, done);
    }
}

double vd_job_progress(const vd_job *job) {
    int total = atomic_load(&job->total);
    return total == 0 ? 0.0 : (double)atomic_load(&job->done) / total;
}

bool vd_job_stopped(const vd_job *job) {
    if (job == NULL) {
        return false;
    }
    if (atomic_load(&job->cancelled)) {
        return true;
    }
    uint64_t deadline_ns = atomic_load(&job->deadline_ns);
    return deadline_ns != 0 && vd_clock_ns() >= deadline_ns;
}

typedef struct loop {
    vd_job *job;
    vd_task_function *task;
    void *user;
    atomic_bool skipped;
} loop;

static void run_piece(void *user, int index, int worker) {
    loop *l = user;
    if (vd_job_stopped(l->job)) {
        atomic_store(&l->skipped, true);
        return;
    }
    l->task(l->user, index, worker);
    atomic_fetch_add(&l->job->done, 1);
}

vd_status vd_parallel_for(vd_context *context, vd_job *job, int count, vd_task_function *task,
                          void *user) {
    if (count < 0 || task == NULL) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "vd_parallel_for needs a function and a count of at least 0, not %d",
                          count);
    }
    if (count == 0) {
        return vd_success();
    }
    if (job == NULL) {
        context->executor.run(context->executor.user, count, task, user);
        return vd_success();
    }
    loop l = {job, task, user, false};
    vd_job_report(job, 0, count);
    context->executor.run(context->executor.user, count, run_piece, &l);
    if (atomic_load(&l.skipped)) {
        return vd_failure(VD_ERROR_CANCELLED, "the job was cancelled or ran out of time");
    }
    return vd_success();
}

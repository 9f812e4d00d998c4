/* impostor_painter.c: a thread that draws pictures while frames go on. */
#ifdef __linux__
#define _GNU_SOURCE
#include <sys/resource.h>
#endif
#include <pthread.h>
#include <string.h>
#include "core/core.h"
#include "impostor/impostor_painter.h"
#include "world/world_renderer.h"

/* Frames come first: where processors are few it draws when they rest. */
#define NICENESS 5

struct vd_impostor_painter {
    vd_context *pictures; /* the set's */
    const vd_world *world;
    vd_world_renderer_def renderer_def;
    vd_light light;
    int samples, threads;
    vd_context *context; /* of its own pool of threads */
    vd_job *job;
    pthread_t thread;
    pthread_mutex_t mutex;
    pthread_cond_t wake, done;
    /* Under the mutex: */
    bool stopping, busy;
    uint64_t spent_ns, most_ns; /* since it was asked last */
    vd_status status;           /* why it draws nothing at all */
    int asked, begun, finished;
    uint32_t drawing;                                                       /* node, while busy */
    vd_impostor_draft queue[VD_PAINTER_QUEUE], ready[VD_PAINTER_QUEUE + 1]; /* and one of before */
};

/* Draws one after the other until it is stopped. Entered and left with the mutex held. */
static void paint_all(vd_impostor_painter *p, const vd_impostor_brush *brush) {
    while (!p->stopping) {
        if (p->begun == p->asked || (p->begun > 0 && p->spent_ns > p->most_ns)) {
            pthread_cond_wait(&p->wake, &p->mutex);
            continue;
        }
        vd_impostor_draft draft = p->queue[p->begun++];
        p->busy = true;
        pthread_mutex_unlock(&p->mutex);
        const uint64_t start = vd_clock_ns();
        vd_impostor_paint(brush, p->job, &draft);
        const uint64_t took_ns = vd_clock_ns() - start;
        pthread_mutex_lock(&p->mutex);
        p->busy = false;
        p->spent_ns += took_ns;
        p->ready[p->finished++] = draft;
        pthread_cond_signal(&p->done);
    }
}

/* Its renderer is made here too: shadows of a large world take a while. */
static void *painter_main(void *user) {
    vd_impostor_painter *p = user;
    vd_world_renderer *renderer = NULL;
    vd_frame *canvas = NULL;
    size_t canvas_pixels = 0;
    vd_context_def def = vd_context_def_like(p->pictures);
    def.threads = p->threads;
#ifdef __linux__
    (void)setpriority(PRIO_PROCESS, 0, NICENESS); /* there: of this thread, and those it starts */
#endif
    vd_status status = vd_context_create(&def, &p->context);
    if (status.code == VD_OK) {
        status =
            vd_world_renderer_create(p->context, p->job, p->world, &p->renderer_def, &renderer);
    }
    if (status.code == VD_OK &&
        memcmp(&p->light, &p->world->def.terrain.light, sizeof p->light) != 0) {
        status = vd_world_renderer_light(renderer, p->job, &p->light);
    }
    const vd_impostor_brush brush = {.context = p->context,
                                     .pictures = p->pictures,
                                     .renderer = renderer,
                                     .samples = p->samples,
                                     .canvas = &canvas,
                                     .canvas_pixels = &canvas_pixels};
    pthread_mutex_lock(&p->mutex);
    p->status = status;
    if (status.code == VD_OK) {
        paint_all(p, &brush);
    }
    pthread_cond_signal(&p->done);
    pthread_mutex_unlock(&p->mutex);
    vd_frame_destroy(&canvas);
    vd_world_renderer_destroy(&renderer);
    vd_context_destroy(&p->context);
    return NULL;
}

vd_status vd_impostor_painter_create(const vd_impostors *set, vd_impostor_painter **out) {
    vd_impostor_painter *p = vd_allocate_zero(set->context, 1, sizeof *p);
    if (p == NULL) {
        return vd_out_of_memory("a thread that draws impostors", sizeof *p);
    }
    p->pictures = set->context;
    p->world = set->world;
    p->renderer_def = set->renderer->def;
    p->light = *vd_world_renderer_get_light(set->renderer);
    p->samples = set->def.samples;
    p->threads = set->def.background_threads > 0 ? set->def.background_threads
                                                 : (vd_context_threads(set->context) + 1) / 2;
    p->status = vd_success();
    const vd_status status = vd_job_create(set->context, &p->job);
    if (status.code != VD_OK) {
        vd_release(set->context, p);
        return status;
    }
    pthread_mutex_init(&p->mutex, NULL);
    pthread_cond_init(&p->wake, NULL);
    pthread_cond_init(&p->done, NULL);
    const int error = pthread_create(&p->thread, NULL, painter_main, p);
    if (error != 0) {
        p->pictures = NULL; /* there is nothing to join */
        vd_impostor_painter_destroy(set->context, &p);
        return vd_failure(VD_ERROR_MEMORY,
                          "cannot start a thread that draws impostors: %s; leave `background` off",
                          strerror(error));
    }
    *out = p;
    return vd_success();
}

void vd_impostor_painter_destroy(vd_context *context, vd_impostor_painter **painter) {
    vd_impostor_painter *p = *painter;
    if (p == NULL) {
        return;
    }
    if (p->pictures != NULL) {
        pthread_mutex_lock(&p->mutex);
        p->stopping = true;
        vd_job_cancel(p->job);
        pthread_cond_signal(&p->wake);
        pthread_mutex_unlock(&p->mutex);
        pthread_join(p->thread, NULL);
    }
    for (int i = 0; i < p->finished; i++) {
        vd_release(context, p->ready[i].picture.rgba);
    }
    pthread_cond_destroy(&p->wake);
    pthread_cond_destroy(&p->done);
    pthread_mutex_destroy(&p->mutex);
    vd_job_destroy(&p->job);
    vd_release(context, p);
    *painter = NULL;
}

/* ---- the set's side ---------------------------------------------------------------------------*/

static vd_impostor_slot *slot_of(vd_impostors *set, const vd_impostor_draft *draft) {
    return vd_impostor_slot_at(set, set->slot_of[draft->node] - 1);
}

vd_status vd_impostors_collect(vd_impostors *set) {
    vd_impostor_painter *p = set->painter;
    vd_impostor_draft ready[VD_PAINTER_QUEUE + 1];
    pthread_mutex_lock(&p->mutex);
    const vd_status began = p->status;
    const int count = p->finished;
    memcpy(ready, p->ready, (size_t)count * sizeof *ready);
    for (int i = p->begun; i < p->asked; i++) {
        slot_of(set, &p->queue[i])->coming = false;
    }
    p->finished = p->asked = p->begun = 0;
    set->painting = p->busy;
    pthread_mutex_unlock(&p->mutex);
    vd_status status = vd_success();
    for (int i = 0; i < count; i++) {
        slot_of(set, &ready[i])->coming = false;
        if (status.code == VD_OK) {
            status = vd_impostors_hang(set, &ready[i]);
        } else {
            vd_release(set->context, ready[i].picture.rgba);
        }
    }
    if (began.code != VD_OK) {
        vd_log(set->context, VD_LOG_WARNING, "impostors are drawn in the frames that show them: %s",
               began.message);
        vd_impostor_painter_destroy(set->context, &set->painter);
        set->painting = 0;
    }
    return status;
}

void vd_impostors_ask_painter(vd_impostors *set, const vd_impostor_view *view, double most_s) {
    vd_impostor_painter *p = set->painter;
    const vd_impostor_wish *wishes = set->wishes.data;
    vd_impostor_draft asked[VD_PAINTER_QUEUE];
    int count = 0;
    for (size_t i = 0; i < set->wishes.count && count < VD_PAINTER_QUEUE; i++) {
        vd_impostor_slot *slot = vd_impostor_slot_at(set, wishes[i].slot);
        if (slot->coming) {
            continue; /* as it was before it changed */
        }
        if (vd_impostors_draft(set, view, slot, &asked[count])) {
            slot->coming = true;
            count++;
        } else {
            vd_impostor_fail(set, slot);
        }
    }
    pthread_mutex_lock(&p->mutex);
    memcpy(p->queue, asked, (size_t)count * sizeof *asked);
    p->asked = count;
    p->begun = 0;
    p->spent_ns = 0;
    p->most_ns = (uint64_t)(1e9 * most_s);
    pthread_cond_signal(&p->wake);
    pthread_mutex_unlock(&p->mutex);
    set->painting += (size_t)count;
    set->stats.waiting = set->wishes.count - (size_t)count;
}

void vd_impostors_wait(vd_impostors *set) {
    vd_impostor_painter *p = set->painter;
    if (p == NULL) {
        return;
    }
    pthread_mutex_lock(&p->mutex);
    while (p->status.code == VD_OK && p->finished == 0 && (p->busy || p->begun < p->asked)) {
        pthread_cond_wait(&p->done, &p->mutex);
    }
    pthread_mutex_unlock(&p->mutex);
}

/* window_render.c: requests in, pictures out. */
#include "window_render.h"

#include <math.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

#include "run.h"
#include "view.h"
#include "window_pixels.h"
#include "window_threads.h"

typedef struct world {
    vd_world_state state;
    vd_window_scene scene; /* while ready */
    char failure[VD_WINDOW_TEXT];
    bool forgotten; /* to be ended by the render thread */
} world;

enum { FRESH = 4 }; /* beside the index of the picture between the threads */

struct vd_window_render {
    vd_window_render_def def;
    vd_threads threads;
    vd_context *context;
    vd_job *job;
    pthread_t thread;
    bool started;

    pthread_mutex_t lock; /* of all until the next heading */
    pthread_cond_t changed;
    vd_window_request request;
    uint64_t asked, done; /* numbers of requests; done: its finished picture is there */
    bool quit, refining;  /* refining: a picture that a new request cancels */
    world worlds[VD_WINDOW_WORLDS];
    const char *stage;
    bool failing;
    char failure[VD_WINDOW_TEXT];
    char shot_path[VD_WINDOW_TEXT]; /* wanted; else empty */
    char shot[VD_WINDOW_TEXT];
    int shots;

    /* The render thread's own. */
    vd_frame *frame;
    size_t frame_pixels; /* that it has room for */
    vd_pace pace;
    int drawn_world; /* of the last picture; −1: none yet */
    int back;

    /* Between the threads. */
    atomic_int middle; /* index, + FRESH */
    int front;         /* the event thread's */
    bool taken;        /* something was ever taken */
    vd_window_picture pictures[3];
};

/* ---- the event thread's side -------------------------------------------------------------------
 */

static void copy_request(vd_window_request *to, const vd_window_request *from) {
    *to = *from;
    to->settings.colormap = to->colormap;
    if (to->input[0] != '\0') {
        to->inputs = to->input;
        to->settings.inputs = &to->inputs;
        to->settings.input_count = 1;
    }
}

void vd_window_render_ask(vd_window_render *render, const vd_window_request *request) {
    pthread_mutex_lock(&render->lock);
    copy_request(&render->request, request);
    render->asked++;
    if (render->refining && render->shot_path[0] == '\0') {
        vd_job_cancel(render->job);
    }
    pthread_cond_signal(&render->changed);
    pthread_mutex_unlock(&render->lock);
}

void vd_window_render_forget(vd_window_render *render, int number) {
    pthread_mutex_lock(&render->lock);
    render->worlds[number].forgotten = true;
    pthread_mutex_unlock(&render->lock);
}

void vd_window_render_shoot(vd_window_render *render, const char *path) {
    pthread_mutex_lock(&render->lock);
    snprintf(render->shot_path, sizeof render->shot_path, "%s", path);
    pthread_cond_signal(&render->changed);
    pthread_mutex_unlock(&render->lock);
}

const vd_window_picture *vd_window_render_take(vd_window_render *render, bool *fresh) {
    *fresh = (atomic_load(&render->middle) & FRESH) != 0;
    if (*fresh) {
        render->front = atomic_exchange(&render->middle, render->front) & ~FRESH;
        render->taken = true;
    }
    return render->taken ? &render->pictures[render->front] : NULL;
}

void vd_window_render_news(vd_window_render *render, vd_window_news *out) {
    pthread_mutex_lock(&render->lock);
    const world *w = &render->worlds[render->request.world];
    *out = (vd_window_news){.state = w->state,
                            .stage = render->stage,
                            .progress = vd_job_progress(render->job),
                            .failing = w->state == VD_WORLD_FAILED || render->failing,
                            .idle = render->done == render->asked,
                            .shots = render->shots};
    memcpy(out->failure, w->state == VD_WORLD_FAILED ? w->failure : render->failure,
           sizeof out->failure);
    memcpy(out->shot, render->shot, sizeof out->shot);
    out->changes = w->state == VD_WORLD_READY && w->scene.news != NULL;
    if (out->changes) {
        w->scene.news(w->scene.user, &out->scene);
    }
    pthread_mutex_unlock(&render->lock);
}

bool vd_window_render_world(vd_window_render *render, int number, vd_camera_settings *start,
                            vd_look_defaults *defaults) {
    pthread_mutex_lock(&render->lock);
    const world *w = &render->worlds[number];
    const bool ready = w->state == VD_WORLD_READY && !w->forgotten;
    if (ready) {
        *start = w->scene.start;
        *defaults = (vd_look_defaults){.haze_m = w->scene.haze_m,
                                       .size_m = w->scene.size_m,
                                       .curvature = w->scene.curvature,
                                       .threads = render->threads.most};
    }
    pthread_mutex_unlock(&render->lock);
    return ready;
}

double vd_window_render_ground(vd_window_render *render, int number, double x, double y) {
    pthread_mutex_lock(&render->lock);
    const world *w = &render->worlds[number];
    const double ground =
        w->state == VD_WORLD_READY ? w->scene.ground(w->scene.user, x, y) : (double)-INFINITY;
    pthread_mutex_unlock(&render->lock);
    return ground;
}

int vd_window_render_most_threads(const vd_window_render *render) {
    return render->threads.most;
}

/* ---- the render thread -------------------------------------------------------------------------
 */

static void set_stage(void *user, const char *stage) {
    vd_window_render *render = user;
    pthread_mutex_lock(&render->lock);
    render->stage = stage;
    pthread_mutex_unlock(&render->lock);
    render->def.wake(render->def.wake_user);
}

/* Ends a world, so that nobody looks at it meanwhile. */
static void close_world(vd_window_render *render, world *w) {
    pthread_mutex_lock(&render->lock);
    const bool ready = w->state == VD_WORLD_READY;
    vd_window_scene scene = w->scene;
    w->state = VD_WORLD_NONE;
    w->forgotten = false;
    pthread_mutex_unlock(&render->lock);
    if (ready) {
        scene.destroy(scene.user);
    }
}

static void open_world(vd_window_render *render, world *w, const vd_window_request *request) {
    pthread_mutex_lock(&render->lock);
    w->state = VD_WORLD_LOADING;
    render->stage = "loading";
    vd_job_reset(render->job);
    if (render->quit) {
        vd_job_cancel(render->job);
    }
    pthread_mutex_unlock(&render->lock);
    vd_window_scene made;
    const bool first = w == render->worlds;
    vd_status status = first && render->def.remote != NULL
                           ? vd_window_remote_open(render->context, render->job, render->def.remote,
                                                   &request->settings, set_stage, render,
                                                   render->def.wake, render->def.wake_user, &made)
                           : vd_window_scene_open(render->context, render->job, &request->settings,
                                                  first ? render->def.content : NULL,
                                                  render->def.impostors, set_stage, render, &made);
    pthread_mutex_lock(&render->lock);
    w->state = status.code == VD_OK ? VD_WORLD_READY : VD_WORLD_FAILED;
    if (status.code == VD_OK) {
        w->scene = made;
    } else {
        snprintf(w->failure, sizeof w->failure, "%s", status.message);
        vd_log(render->context, VD_LOG_WARNING, "%s", status.message);
    }
    pthread_mutex_unlock(&render->lock);
    render->def.wake(render->def.wake_user);
}

/* A frame of this size: the one there is, where it has room. */
static vd_status reserve_frame(vd_window_render *render, int width, int height) {
    const size_t stride = vd_frame_stride(width), pixels = stride * (size_t)height;
    if (render->frame == NULL || pixels > render->frame_pixels) {
        vd_frame_destroy(&render->frame);
        vd_status status = vd_frame_create(render->context, width, height, 0, &render->frame);
        render->frame_pixels = status.code == VD_OK ? pixels : 0;
        return status;
    }
    render->frame->width = width;
    render->frame->height = height;
    render->frame->stride = stride;
    return vd_success();
}

static vd_status reserve_picture(vd_window_picture *picture, int width, int height) {
    const size_t pixels = (size_t)width * (size_t)height;
    if (pixels > picture->room) {
        free(picture->pixels);
        picture->pixels = malloc(pixels * sizeof picture->pixels[0]);
        picture->room = picture->pixels != NULL ? pixels : 0;
    }
    picture->width = width;
    picture->height = height;
    return picture->pixels != NULL
               ? vd_success()
               : vd_failure(VD_ERROR_MEMORY, "out of memory for a picture of %d x %d pixels", width,
                            height);
}

/* Draws one picture into the frame and converts it for the window. */
static vd_status draw(vd_window_render *render, const vd_window_request *request, bool exact,
                      vd_view *view) {
    vd_window_picture *picture = &render->pictures[render->back];
    const vd_window_scene *scene = &render->worlds[request->world].scene;
    const double scale = exact ? 1.0 : render->pace.scale;
    const int width = (int)fmax(1.0, floor(request->width * scale + 0.5));
    const int height = (int)fmax(1.0, floor(request->height * scale + 0.5));
    /* An eye in world metres is found without the scene. */
    static const vd_scene nowhere = {0};
    vd_status status = vd_view_make(&nowhere, &request->camera, request->settings.exaggeration,
                                    false, width, height, view);
    if (status.code == VD_OK) {
        status = reserve_frame(render, width, height);
    }
    if (status.code == VD_OK) {
        status = reserve_picture(picture, request->width, request->height);
    }
    const double start = vd_seconds_now();
    if (status.code == VD_OK) {
        status = scene->look(scene->user, render->job, &request->settings);
    }
    const double looked = vd_seconds_now();
    if (status.code == VD_OK) {
        const vd_window_way way = {exact ? VD_WINDOW_STILL : VD_WINDOW_MOVING, request->show,
                                   request->frozen};
        status = scene->draw(scene->user, render->job, &view->camera, &way, render->frame);
        picture->by_impostors = scene->impostors(scene->user, &picture->impostors);
    }
    const double drawn = vd_seconds_now();
    if (status.code == VD_OK) {
        status = vd_pixels_from_frame(render->context, render->frame, request->width,
                                      request->height, picture->pixels);
    }
    const double converted = vd_seconds_now();
    picture->look_s = looked - start;
    picture->draw_s = drawn - looked;
    picture->convert_s = converted - drawn;
    if (status.code == VD_OK && !exact) {
        vd_pace_note(&render->pace, converted - looked);
    }
    return status;
}

static void publish(vd_window_render *render, const vd_window_request *request, bool exact) {
    vd_window_picture *picture = &render->pictures[render->back];
    picture->exact = exact;
    picture->scale = exact ? 1.0 : (double)render->frame->width / request->width;
    picture->event_s = request->event_s;
    picture->world = request->world;
    render->back = atomic_exchange(&render->middle, render->back | FRESH) & ~FRESH;
    render->drawn_world = request->world;
}

/* Writes the frame as `veduta render` would, with the flags that draw it again. */
static void save_shot(vd_window_render *render, const vd_window_request *request,
                      const vd_view *view, const char *path) {
    char command[2400], software[40];
    snprintf(software, sizeof software, "veduta %s", vd_version());
    const bool remote = request->world == 0 && render->def.remote != NULL; /* its token is secret */
    snprintf(command, sizeof command, "veduta %s %s", remote ? "view --connect URL" : "render",
             request->flags);
    json_t *json = vd_view_json(view);
    char *camera = json != NULL ? json_dumps(json, JSON_COMPACT) : NULL;
    vd_picture_text text[] = {{"Software", software},
                              {"veduta:command", command},
                              {"veduta:camera", camera != NULL ? camera : "{}"}};
    vd_png_def png = vd_png_def_default();
    png.level = request->settings.png_level;
    png.text = text;
    png.text_count = 3;
    vd_status status = vd_frame_save_png(render->frame, path, &png);
    free(camera);
    json_decref(json);
    pthread_mutex_lock(&render->lock);
    if (status.code == VD_OK) {
        snprintf(render->shot, sizeof render->shot, "wrote %s, %dx%d", path, render->frame->width,
                 render->frame->height);
    } else {
        snprintf(render->shot, sizeof render->shot, "%s", status.message);
    }
    render->shots++;
    render->shot_path[0] = '\0';
    pthread_mutex_unlock(&render->lock);
}

/* One picture for the newest request; locked on entry and exit. */
static void serve(vd_window_render *render) {
    vd_window_request request;
    copy_request(&request, &render->request);
    const uint64_t number = render->asked;
    char shot_path[VD_WINDOW_TEXT];
    memcpy(shot_path, render->shot_path, sizeof shot_path);
    const bool shooting = shot_path[0] != '\0';
    /* Of a world that was not on show yet, something at once. */
    const bool exact = shooting || (!request.moving && render->drawn_world == request.world);
    vd_job_reset(render->job);
    if (render->quit) {
        vd_job_cancel(render->job);
    }
    render->refining = exact;
    pthread_mutex_unlock(&render->lock);

    vd_view view;
    vd_status status = vd_threads_set(&render->threads, request.threads);
    if (status.code == VD_OK) {
        status = draw(render, &request, exact, &view);
    }
    if (status.code == VD_OK) {
        publish(render, &request, exact);
    }
    if (status.code == VD_OK && shooting) {
        save_shot(render, &request, &view, shot_path);
    }

    pthread_mutex_lock(&render->lock);
    render->refining = false;
    if (status.code == VD_OK) {
        render->failing = false;
        render->done = exact ? number : render->done;
    } else if (status.code != VD_ERROR_CANCELLED) {
        if (!render->failing || strcmp(render->failure, status.message) != 0) {
            vd_log(render->context, VD_LOG_WARNING, "%s", status.message);
        }
        render->failing = true;
        snprintf(render->failure, sizeof render->failure, "%s", status.message);
        render->done = number; /* once is enough: the same would fail again */
        if (shooting) {
            snprintf(render->shot, sizeof render->shot, "%s", status.message);
            render->shots++;
            render->shot_path[0] = '\0';
        }
    }
}

static void *run(void *user) {
    vd_window_render *render = user;
    uint64_t quick = 0; /* the request whose moving picture is there */
    pthread_mutex_lock(&render->lock);
    while (!render->quit) {
        world *w = &render->worlds[render->request.world];
        const bool nothing_new =
            render->done == render->asked || (render->request.moving && quick == render->asked);
        if (render->asked == 0 || (nothing_new && render->shot_path[0] == '\0' && !w->forgotten) ||
            (w->state == VD_WORLD_FAILED && !w->forgotten && render->done == render->asked)) {
            pthread_cond_wait(&render->changed, &render->lock);
            continue;
        }
        if (w->forgotten || w->state == VD_WORLD_NONE) {
            vd_window_request request;
            copy_request(&request, &render->request);
            pthread_mutex_unlock(&render->lock);
            close_world(render, w);
            open_world(render, w, &request);
            render->drawn_world = -1;
            pthread_mutex_lock(&render->lock);
            /* Its camera is known now: the event thread asks for a picture. */
            render->done = w->state == VD_WORLD_READY ? render->asked : render->done;
            continue;
        }
        const uint64_t number = render->asked;
        if (w->state == VD_WORLD_READY) {
            serve(render);
        } else {
            render->done = render->asked;
            if (render->shot_path[0] != '\0') {
                snprintf(render->shot, sizeof render->shot, "there is no picture to write");
                render->shot_path[0] = '\0';
                render->shots++;
            }
        }
        quick = number;
        pthread_mutex_unlock(&render->lock);
        render->def.wake(render->def.wake_user);
        pthread_mutex_lock(&render->lock);
    }
    pthread_mutex_unlock(&render->lock);
    return NULL;
}

/* ---- beginning and end -------------------------------------------------------------------------
 */

vd_status vd_window_render_create(const vd_window_render_def *def, vd_window_render **out) {
    vd_window_render *render = calloc(1, sizeof *render);
    if (render == NULL) {
        return vd_failure(VD_ERROR_MEMORY, "out of memory at the start");
    }
    render->def = *def;
    render->pace = vd_pace_start(def->period_s);
    render->drawn_world = -1;
    render->back = 0;
    render->middle = 1;
    render->front = 2;
    render->stage = "loading";
    pthread_mutex_init(&render->lock, NULL);
    pthread_cond_init(&render->changed, NULL);
    vd_status status = vd_threads_init(&render->threads, def->threads);
    if (status.code == VD_OK && def->threads > 0) {
        status = vd_threads_set(&render->threads, def->threads);
    }
    if (status.code == VD_OK) {
        vd_context_def context = vd_context_def_default();
        context.log = def->log;
        context.log_user = def->log_user;
        context.executor = vd_threads_executor(&render->threads);
        status = vd_context_create(&context, &render->context);
    }
    if (status.code == VD_OK) {
        status = vd_job_create(render->context, &render->job);
    }
    if (status.code == VD_OK) {
        render->started = pthread_create(&render->thread, NULL, run, render) == 0;
        if (!render->started) {
            status = vd_failure(VD_ERROR_MEMORY, "cannot start a thread; end other programs");
        }
    }
    if (status.code != VD_OK) {
        vd_window_render_destroy(&render);
        return status;
    }
    *out = render;
    return status;
}

void vd_window_render_destroy(vd_window_render **render_in_out) {
    vd_window_render *render = *render_in_out;
    if (render == NULL) {
        return;
    }
    if (render->started) {
        pthread_mutex_lock(&render->lock);
        render->quit = true;
        vd_job_cancel(render->job);
        pthread_cond_signal(&render->changed);
        pthread_mutex_unlock(&render->lock);
        pthread_join(render->thread, NULL);
    }
    for (int i = 0; i < VD_WINDOW_WORLDS; i++) {
        close_world(render, &render->worlds[i]);
    }
    for (int i = 0; i < 3; i++) {
        free(render->pictures[i].pixels);
    }
    vd_frame_destroy(&render->frame);
    vd_job_destroy(&render->job);
    vd_context_destroy(&render->context);
    vd_threads_finish(&render->threads);
    pthread_cond_destroy(&render->changed);
    pthread_mutex_destroy(&render->lock);
    free(render);
    *render_in_out = NULL;
}

/* evaluate_run.c: four programs on one stream of viewpoints.
 *
 * Each has a clock of its own that runs while the program itself works, and is turned on to the
 * next thing that happens when it waits; drawing perfect frames and comparing takes none of it.
 * Nothing of a program works while it waits, so this is the run in real time that it would be
 * without being measured (§5.1.2 had to thin out and shrink its frames for that). With a virtual
 * clock work takes no time, and only the display's rate, the budgets and the link are left.
 *
 * Screens that are shipped are not kept while they are on their way: the viewpoint says what they
 * show, and the few that are compared are drawn again.
 */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "evaluate.h"

#define DISPLAY_HZ 60.0

/* A screen on the link. */
typedef struct shipped {
    double arrives_s;
    long viewpoint;
    size_t bytes;
} shipped;

enum { MOST_SHIPPED = 8192 }; /* 60 s of latency at DISPLAY_HZ, and more */

typedef struct program {
    vd_evaluation *e;
    vd_evaluated_figures *figures;
    double frame;            /* of the virtual clock's display */
    double begins_s;         /* when the next frame does */
    vd_frame *screen, *next; /* what is on screen; what is drawn */
    vd_impostors *impostors; /* null: screens are shipped, or */
    bool direct;             /* all is drawn in no time */
    bool waits;              /* `next` comes onto the screen, at */
    double done_s;
    double took_s;    /* a frame lately; virtually 0 */
    uint64_t uploads; /* before it */
    shipped *link;    /* [MOST_SHIPPED], a ring */
    int first, count;
    double link_free_s;
    long viewpoint, drawn; /* that is on screen; that `screen` shows; −1: none yet */
} program;

static long viewpoint_at(const vd_evaluation *e, double time_s) {
    return (long)floor(time_s * e->settings->rate_hz + 1e-6);
}

static vd_camera camera_of(const vd_evaluation *e, long viewpoint) {
    const vd_render_settings *s = &e->settings->render;
    vd_camera camera;
    vd_camera_path_at(e->path, (double)viewpoint / e->settings->rate_hz, s->width, s->height,
                      &camera);
    return camera;
}

/* Where the camera will be `ahead_s` after a viewpoint, by its last two hundredths of a second:
 * with constant velocity and turn. */
static vd_camera camera_ahead(const vd_evaluation *e, long viewpoint, double ahead_s) {
    const long back = (long)ceil(0.02 * e->settings->rate_hz);
    vd_camera camera = camera_of(e, viewpoint);
    if (viewpoint < back) {
        return camera;
    }
    const vd_camera old = camera_of(e, viewpoint - back);
    const double k = ahead_s * e->settings->rate_hz / (double)back;
    const vd_quat a = old.orientation, b = camera.orientation;
    const double sign = a.x * b.x + a.y * b.y + a.z * b.z + a.w * b.w < 0.0 ? -1.0 : 1.0;
    camera.eye = vd_vec3_add(camera.eye, vd_vec3_scale(vd_vec3_subtract(camera.eye, old.eye), k));
    camera.orientation =
        vd_quat_normalize((vd_quat){b.x + k * (b.x - sign * a.x), b.y + k * (b.y - sign * a.y),
                                    b.z + k * (b.z - sign * a.z), b.w + k * (b.w - sign * a.w)});
    return camera;
}

/* How far ahead: what is drawn now is shown from when it is done until the next frame is, and
 * compared with viewpoints that are half their time old. */
static double ahead_of(const vd_evaluation *e, double begins_s, double took_s) {
    const double rest_s = took_s > 1.0 / DISPLAY_HZ ? took_s : 1.0 / DISPLAY_HZ;
    return begins_s - viewpoint_at(e, begins_s) / e->settings->rate_hz + took_s + 0.5 * rest_s -
           0.5 / e->settings->rate_hz;
}

/* Spread over the frames' time by the golden ratio, so that no rate of frames is always met early
 * (§5.1.2: "sampling resonance"). */
double vd_evaluation_time(const vd_evaluation *e, int compared) {
    const double golden = 0.6180339887498949 * compared;
    const double time_s =
        (compared + 0.5) / e->settings->compare_hz + (golden - floor(golden)) / DISPLAY_HZ;
    return time_s < e->seconds ? time_s : e->seconds;
}

static void worked(program *p, double seconds) {
    p->figures->busy_s += seconds;
    p->figures->slowest_s = seconds > p->figures->slowest_s ? seconds : p->figures->slowest_s;
}

static double later(double a, double b) {
    return a > b ? a : b;
}

/* When the next frame may begin: by the display's rate, and not before the last is done. */
static double next_begin(program *p, double done_s) {
    p->frame++;
    if (p->e->settings
            ->is_virtual) { /* counted: a sum of sixtieths would be late for a comparison */
        while (p->frame / DISPLAY_HZ <= p->begins_s) {
            p->frame++;
        }
        return p->frame / DISPLAY_HZ;
    }
    return later(done_s, p->begins_s + 1.0 / DISPLAY_HZ);
}

/* ---- impostors --------------------------------------------------------------------------------*/

static void count_frame(program *p, const vd_impostor_stats *stats) {
    vd_evaluated_figures *f = p->figures;
    const double came = (double)(stats->uploads - p->uploads), shown = (double)stats->shown;
    p->uploads = stats->uploads;
    f->made++;
    if (p->begins_s >= p->e->seconds) {
        /* a frame too late to count */
    } else if (stats->shown > 0) {
        f->whole += came < shown ? came / shown : 1.0;
    } else {
        f->whole += stats->in_flight == 0 && stats->waiting == 0;
    }
    f->bytes = stats->bytes_sent;
    f->pixels = stats->pixels_sent;
    f->uploads = stats->uploads;
    f->failed = stats->failed;
    f->dropped = stats->dropped;
    f->reuse =
        stats->pixels_drawn > 0 ? (double)stats->pixels_shown / (double)stats->pixels_drawn : 0.0;
    f->overdraw += stats->overdraw;
    f->shown += shown;
    f->reused += (double)stats->reused;
    f->pictures += (double)stats->pictures;
    f->direct += (double)stats->direct;
    f->show_s += stats->show_s;
    f->error_px += stats->error_px;
}

/* Draws the frame that begins now. */
static vd_status show_impostors(program *p) {
    const vd_evaluation *e = p->e;
    const vd_camera camera =
        camera_ahead(e, viewpoint_at(e, p->begins_s), ahead_of(e, p->begins_s, p->took_s));
    vd_impostor_stats stats = {0};
    const double start = vd_seconds_now(), decoded = e->packer->decode_s;
    vd_status status = vd_impostors_update(p->impostors, e->job, &camera, p->next->width,
                                           p->next->height, p->begins_s, &stats);
    if (status.code == VD_OK) {
        status = vd_impostors_draw(p->impostors, e->job, &camera, p->next, &stats);
    }
    if (status.code != VD_OK) {
        return status;
    }
    /* Pictures are drawn and packed at the far end, which has a clock of its own:
     * vd_impostor_def.remote. They are unpacked here. */
    const double unpacked = e->packer->decode_s - decoded;
    const double drew = e->settings->impostors.remote ? stats.draw_s - unpacked : 0.0;
    const double took = vd_seconds_now() - start - drew;
    worked(p, took);
    count_frame(p, &stats);
    p->took_s = e->settings->is_virtual ? 0.0 : 0.8 * p->took_s + 0.2 * took;
    p->done_s = p->begins_s + (e->settings->is_virtual ? 0.0 : took);
    p->begins_s = next_begin(p, p->done_s);
    p->waits = true;
    return status;
}

/* Goes on until `screen` is what is on screen at a time. */
static vd_status impostors_until(program *p, double time_s) {
    vd_status status = vd_success();
    while (status.code == VD_OK) {
        if (p->waits) {
            if (p->done_s > time_s) {
                break;
            }
            vd_frame *shown = p->next;
            p->next = p->screen;
            p->screen = shown;
            p->waits = false;
            p->figures->frames += p->done_s < p->e->seconds;
        }
        if (p->begins_s > time_s) {
            break;
        }
        status = show_impostors(p);
    }
    return status;
}

/* ---- whole screens ----------------------------------------------------------------------------*/

/* Makes a frame what it is after the link; returns its bytes there. */
static size_t pass(const vd_evaluation *e, vd_frame *frame) {
    return vd_packer_pass(e->packer, frame->rgba, frame->width, frame->height, frame->stride);
}

/* Draws a screen and puts it on the link. The next one begins so that it is done when the link is
 * free for it: no earlier, since it would be older then. */
static vd_status ship_screen(program *p) {
    const vd_evaluation *e = p->e;
    const vd_evaluate_settings *s = e->settings;
    const long viewpoint = viewpoint_at(e, p->begins_s);
    vd_status status = vd_success();
    double took = 0.0, unpacked = e->packer->decode_s;
    size_t bytes = 4 * (size_t)s->render.width * (size_t)s->render.height;
    if (!s->is_virtual || e->packer->coder != NULL) {
        const vd_camera camera = camera_of(e, viewpoint);
        const double start = vd_seconds_now();
        status = vd_fly_draw(e->world, &camera, p->next);
        bytes = pass(e, p->next);
        took = vd_seconds_now() - start;
    }
    unpacked = s->is_virtual ? 0.0 : e->packer->decode_s - unpacked;
    took = s->is_virtual ? 0.0 : took - unpacked;
    if (!s->is_virtual) {
        worked(p, took);
        p->figures->made++;
    }
    const double done = p->begins_s + took;
    if (s->impostors.link_bytes_per_s > 0.0) {
        p->link_free_s =
            later(done, p->link_free_s) + (double)bytes / s->impostors.link_bytes_per_s;
    } else {
        p->link_free_s = done;
    }
    p->link[(p->first + p->count++) % MOST_SHIPPED] =
        (shipped){p->link_free_s + s->impostors.link_latency_s + unpacked, viewpoint, bytes};
    p->begins_s = later(next_begin(p, done), p->link_free_s - took);
    return status;
}

static vd_status screens_until(program *p, double time_s) {
    vd_status status = vd_success();
    while (status.code == VD_OK && p->begins_s <= time_s && p->count < MOST_SHIPPED) {
        status = ship_screen(p);
    }
    while (p->count > 0 && p->link[p->first].arrives_s <= time_s) {
        const bool counts = p->link[p->first].arrives_s < p->e->seconds;
        p->viewpoint = p->link[p->first].viewpoint;
        p->figures->bytes += counts ? p->link[p->first].bytes : 0u;
        p->first = (p->first + 1) % MOST_SHIPPED;
        p->count--;
        p->figures->frames += counts;
    }
    return status;
}

/* Draws what is on screen, to be compared. */
static vd_status redraw_screen(program *p) {
    if (p->viewpoint < 0 || p->viewpoint == p->drawn) {
        return vd_success();
    }
    const vd_camera camera = camera_of(p->e, p->viewpoint);
    p->drawn = p->viewpoint;
    const vd_status status = vd_fly_draw(p->e->world, &camera, p->screen);
    (void)pass(p->e, p->screen);
    return status;
}

/* ---- drawn directly ---------------------------------------------------------------------------*/

/* Draws what would be on screen, if nothing took any time: made for where the camera will be in the
 * middle of the time that it is shown. */
static vd_status draw_directly(program *p, double time_s) {
    const vd_evaluation *e = p->e;
    const double begins_s = floor(time_s * DISPLAY_HZ + 1e-6) / DISPLAY_HZ;
    const vd_camera camera = camera_ahead(e, viewpoint_at(e, begins_s), ahead_of(e, begins_s, 0.0));
    return vd_fly_draw(e->world, &camera, p->screen);
}

/* ---- comparing --------------------------------------------------------------------------------*/

static vd_status until(program *p, double time_s) {
    if (p->direct) {
        p->figures->frames = (uint64_t)floor(time_s * DISPLAY_HZ + 1e-6);
        return vd_success();
    }
    return p->impostors != NULL ? impostors_until(p, time_s) : screens_until(p, time_s);
}

/* Counts a comparison; the worst frame of the first program is kept. */
static void count_error(vd_evaluation *e, const program *p, int number, double error) {
    vd_evaluated_figures *f = p->figures;
    f->errors[number] = error;
    f->error += error;
    if (number > 0 && !(error > f->worst_error)) {
        return;
    }
    f->worst_error = error;
    f->worst_s = vd_evaluation_time(e, number);
    if (e->worst != NULL && f == &e->of[e->settings->first]) {
        memcpy(e->worst->rgba, p->screen->rgba, 4 * p->screen->stride * (size_t)p->screen->height);
    }
}

static vd_status draw_perfect(const vd_evaluation *e, const vd_camera *camera, vd_frame *perfect) {
    const vd_evaluate_settings *s = e->settings;
    vd_world_renderer *renderer = e->world->renderer;
    vd_status status = vd_world_renderer_set_samples(renderer, s->reference_samples);
    if (status.code == VD_OK) {
        status = vd_fly_draw(e->world, camera, perfect);
    }
    const vd_status back = vd_world_renderer_set_samples(renderer, s->render.samples);
    return status.code == VD_OK ? back : status;
}

static vd_status compare_all(vd_evaluation *e, program *programs, vd_frame *perfect, int number) {
    const double time_s = vd_evaluation_time(e, number);
    const vd_camera camera = camera_of(e, viewpoint_at(e, time_s));
    vd_status status = draw_perfect(e, &camera, perfect);
    for (int i = (int)e->settings->first; i <= (int)e->settings->last && status.code == VD_OK;
         i++) {
        program *p = &programs[i];
        status = until(p, time_s);
        if (status.code == VD_OK && p->impostors == NULL) {
            status = p->direct ? draw_directly(p, time_s) : redraw_screen(p);
        }
        if (status.code == VD_OK) {
            count_error(e, p, number, vd_frame_error(p->screen, perfect));
        }
    }
    return status;
}

static void show_progress(const vd_evaluation *e, double time_s, bool last) {
    if (!e->settings->render.quiet && isatty(STDERR_FILENO)) {
        fprintf(stderr, "\r%.1f of %.4g s \033[K%s", time_s, e->seconds, last ? "\r\033[K" : "");
    }
}

/* ---- a run ------------------------------------------------------------------------------------*/

static size_t pack_picture(void *user, uint8_t *rgba, int width, int height) {
    return vd_packer_pass(user, rgba, width, height, (size_t)width);
}

static vd_status begin_program(vd_evaluation *e, vd_evaluated kind, program *p) {
    const vd_render_settings *s = &e->settings->render;
    *p = (program){.e = e, .figures = &e->of[kind], .viewpoint = -1, .drawn = -1};
    p->figures->errors = calloc((size_t)e->compared, sizeof *p->figures->errors);
    if (p->figures->errors == NULL) {
        return vd_failure(VD_ERROR_MEMORY, "out of memory for %d comparisons", e->compared);
    }
    vd_status status = vd_frame_create(e->context, s->width, s->height, VD_PLANE_DEPTH, &p->screen);
    if (status.code == VD_OK) {
        status = vd_frame_create(e->context, s->width, s->height, VD_PLANE_DEPTH, &p->next);
    }
    if (status.code != VD_OK) {
        return status;
    }
    memset(p->screen->rgba, 0, 4 * p->screen->stride * (size_t)s->height);
    if (kind == VD_EVALUATED_SCREEN) {
        p->link = calloc(MOST_SHIPPED, sizeof *p->link);
        return p->link != NULL ? status : vd_failure(VD_ERROR_MEMORY, "out of memory for the link");
    }
    if (kind == VD_EVALUATED_DIRECT) {
        p->direct = true;
        return status;
    }
    vd_impostor_def def = e->settings->impostors;
    if (e->packer->coder != NULL) {
        def.pack = pack_picture;
        def.pack_user = e->packer;
    }
    def.no_reuse = kind == VD_EVALUATED_NO_REUSE;
    return vd_impostors_create(e->context, e->world->scene->world, e->world->renderer, &def,
                               &p->impostors);
}

static void end_program(program *p) {
    vd_impostors_destroy(&p->impostors);
    vd_frame_destroy(&p->screen);
    vd_frame_destroy(&p->next);
    free(p->link);
}

static void divide(vd_evaluation *e) {
    for (int i = 0; i < VD_EVALUATED_COUNT; i++) {
        vd_evaluated_figures *f = &e->of[i];
        const double frames = f->made > 0 ? (double)f->made : 1.0;
        f->error /= e->compared;
        f->overdraw /= frames;
        f->shown /= frames;
        f->reused /= frames;
        f->pictures /= frames;
        f->direct /= frames;
        f->show_s /= frames;
        f->error_px /= frames;
    }
}

vd_status vd_evaluation_run(vd_evaluation *e) {
    const vd_evaluate_settings *s = e->settings;
    program programs[VD_EVALUATED_COUNT];
    memset(programs, 0, sizeof programs);
    vd_frame *perfect = NULL;
    e->seconds = s->seconds > 0.0 ? s->seconds : vd_camera_path_duration(e->path);
    e->compared = (int)floor(e->seconds * s->compare_hz + 1e-6);
    e->compared = e->compared < 1 ? 1 : e->compared;
    vd_status status =
        vd_frame_create(e->context, s->render.width, s->render.height, VD_PLANE_DEPTH, &perfect);
    if (status.code == VD_OK && s->worst != NULL) {
        status = vd_frame_create(e->context, s->render.width, s->render.height, 0, &e->worst);
    }
    const int first = (int)s->first, last = (int)s->last;
    for (int i = first; i <= last && status.code == VD_OK; i++) {
        status = begin_program(e, (vd_evaluated)i, &programs[i]);
    }
    for (int number = 0; number < e->compared && status.code == VD_OK; number++) {
        show_progress(e, vd_evaluation_time(e, number), false);
        status = compare_all(e, programs, perfect, number);
    }
    for (int i = first; i <= last && status.code == VD_OK; i++) {
        status = until(&programs[i], e->seconds);
    }
    show_progress(e, e->seconds, true);
    for (int i = 0; i < VD_EVALUATED_COUNT; i++) {
        end_program(&programs[i]);
    }
    vd_frame_destroy(&perfect);
    divide(e);
    return status;
}

void vd_evaluation_finish(vd_evaluation *e) {
    for (int i = 0; i < VD_EVALUATED_COUNT; i++) {
        free(e->of[i].errors);
        e->of[i].errors = NULL;
    }
    vd_frame_destroy(&e->worst);
}

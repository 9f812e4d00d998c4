/* render_world.c: a view of a world: elevation data, and what stands on it. */
#include <string.h>

#include "render_impostors.h"

static json_t *describe_terrain(const vd_scene *scene) {
    const vd_heightfield *t = scene->terrain;
    const bool endless = scene->function != NULL; /* has no size */
    return json_pack("{s: i, s: i, s: f, s: f, s: I, s: s, s: b}", "width", endless ? 0 : t->width,
                     "height", endless ? 0 : t->height, "min_m", (double)t->min, "max_m",
                     (double)t->max, "missing", (json_int_t)scene->missing, "format", scene->format,
                     "georeferenced", (int)(scene->kind != VD_CRS_NONE));
}

static vd_status describe(vd_render_run *run, const vd_world_scene *w, const vd_view *view) {
    const vd_render_settings *s = run->settings;
    const bool has_terrain = w->scene.terrain != NULL;
    vd_view_flags(view, run->flags, sizeof run->flags);
    run->camera = vd_view_json(view);
    run->camera_all = s->json ? vd_view_describe(&w->scene, view, s->exaggeration) : NULL;
    run->terrain = has_terrain ? describe_terrain(&w->scene) : NULL;
    if (run->camera == NULL || (has_terrain && run->terrain == NULL) ||
        (s->json && run->camera_all == NULL)) {
        return vd_failure(VD_ERROR_MEMORY, "out of memory while describing the camera");
    }
    run->near_m = view->camera.near_m;
    run->far_m = view->camera.projection == VD_PROJECTION_ORTHOGRAPHIC ? view->camera.far_m : 0.0;
    return vd_success();
}

/* ---- what it will take ------------------------------------------------------------------------*/

/* Draws a picture of a part of the sides; the seconds of the second of two, since the first takes
 * the memory; where that took long it counts itself. */
static vd_status time_small(vd_render_run *run, vd_world_renderer *renderer, vd_camera camera,
                            int part, double *seconds, double *pixels) {
    const vd_render_settings *s = run->settings;
    const int width = (s->width + part - 1) / part, height = (s->height + part - 1) / part;
    vd_frame *frame = NULL;
    camera.lens.fx /= part;
    camera.lens.cx /= part;
    camera.lens.fy /= part;
    camera.lens.cy /= part;
    vd_status status = vd_frame_create(run->context, width, height, 0, &frame);
    *seconds = 0.0;
    for (int turn = 0; turn < 2 && *seconds < 1.0 && status.code == VD_OK; turn++) {
        const double start = vd_seconds_now();
        status = vd_world_renderer_draw(renderer, run->job, &camera, frame, NULL);
        *seconds = vd_seconds_now() - start;
    }
    *pixels = (double)width * height;
    vd_frame_destroy(&frame);
    return status;
}

/* Two small pictures tell what a world's objects and what its pixels cost. */
static vd_status estimate_objects(vd_render_run *run, vd_world_scene *w, const vd_camera *camera) {
    vd_world_renderer *renderer = NULL;
    double seconds[2], pixels[2];
    const double start = vd_seconds_now();
    vd_status status = vd_world_scene_renderer(w, run->job, &renderer);
    const double prepare = vd_seconds_now() - start;
    for (int i = 0; i < 2 && status.code == VD_OK; i++) {
        status = time_small(run, renderer, *camera, 4 >> i, &seconds[i], &pixels[i]);
    }
    const vd_process_memory drawn = vd_process_memory_now(); /* what objects take is there now */
    vd_world_renderer_destroy(&renderer);
    if (status.code != VD_OK) {
        return status;
    }
    const double all = (double)run->settings->width * run->settings->height;
    const double slope = pixels[1] > pixels[0] && seconds[1] > seconds[0]
                             ? (seconds[1] - seconds[0]) / (pixels[1] - pixels[0])
                             : seconds[1] / pixels[1];
    run->draw_seconds = prepare + seconds[1] + slope * (all - pixels[1]);
    vd_render_estimate_memory(run, &drawn, vd_render_frame_bytes(run->settings));
    return status;
}

static vd_status estimate(vd_render_run *run, vd_world_scene *w, const vd_camera *camera) {
    run->ready_seconds = vd_seconds_now() - run->start;
    if (w->object_count > 0) {
        return estimate_objects(run, w, camera);
    }
    size_t bytes = 0;
    vd_process_memory loaded = vd_process_memory_now();
    vd_status status =
        vd_terrain_estimate(run->context, run->job, &w->look, camera, run->settings->width,
                            run->settings->height, &run->draw_seconds, &bytes);
    vd_render_estimate_memory(run, &loaded, bytes);
    return status;
}

/* ---- the picture ------------------------------------------------------------------------------*/

/* Why nothing is seen, or that it is so all the same. */
static vd_status explain_empty(const vd_render_run *run, const vd_world_scene *w,
                               const vd_camera *camera) {
    const vd_render_settings *s = run->settings;
    const vd_heightfield *h = w->look.heightfield;
    char missing[80] = "", share[16];
    vd_status status =
        h != NULL || w->look.function != NULL
            ? vd_terrain_explain_empty(&w->look, camera, s->width, s->height)
            : vd_failure(VD_ERROR_EMPTY, "none of the world's objects is in the picture; turn the "
                                         "camera, or leave it out to have all of them");
    if (!s->allow_empty) {
        /* Where samples are missing the surface is open, and seen from its side there is none. */
        uint64_t all = h != NULL ? (uint64_t)h->width * (uint64_t)h->height : 0;
        if (h != NULL && h->holes > 0 && 100 * h->holes > all) {
            vd_write_share(h->holes, all, share);
            snprintf(missing, sizeof missing,
                     "%s of the samples are missing, which --missing fill closes; ", share);
        }
        return vd_failure(VD_ERROR_EMPTY,
                          "%.400s (%s--allow-empty writes the picture all the same)",
                          status.message, missing);
    }
    vd_log(run->context, VD_LOG_WARNING, "%.400s", status.message);
    return vd_success();
}

/* For --json; a world of one thing, the terrain, has none. */
static vd_status describe_objects(vd_render_run *run, const vd_world_scene *w,
                                  const vd_world_stats *stats) {
    if (w->object_count == 0) {
        return vd_success();
    }
    run->objects = json_pack(
        "{s: I, s: I, s: I, s: I, s: I, s: I, s: I, s: I, s: I, s: I}", "count",
        (json_int_t)stats->objects, "drawn", (json_int_t)stats->drawn, "outside",
        (json_int_t)stats->outside, "hidden", (json_int_t)stats->hidden, "too_small",
        (json_int_t)stats->too_small, "triangles", (json_int_t)stats->triangles, "labels",
        (json_int_t)stats->labels, "labels_shown", (json_int_t)stats->labels_shown, "particles",
        (json_int_t)stats->particles, "particles_for", (json_int_t)stats->particles_for);
    return run->objects != NULL
               ? vd_success()
               : vd_failure(VD_ERROR_MEMORY, "out of memory while describing the objects");
}

static vd_status draw(vd_render_run *run, vd_world_scene *w, const vd_camera *camera) {
    const vd_render_settings *s = run->settings;
    vd_status status = vd_render_make_frame(run);
    if (status.code != VD_OK) {
        return status;
    }
    vd_world_renderer *renderer = NULL;
    vd_world_stats stats = {.objects = 0};
    vd_progress progress;
    double start = vd_seconds_now();
    vd_progress_start(&progress, run->job, s->quiet);
    status = vd_world_scene_renderer(w, run->job, &renderer);
    bool empty = false;
    if (status.code == VD_OK) {
        status = s->impostors
                     ? vd_render_by_impostors(run, w, renderer, camera, &empty)
                     : vd_world_renderer_draw(renderer, run->job, camera, run->frame, &stats);
    }
    vd_world_renderer_destroy(&renderer);
    vd_progress_stop(&progress);
    run->draw_seconds = vd_seconds_now() - start;
    run->stats = stats.terrain;
    if (status.code == VD_OK && !s->impostors) {
        /* The terrain is one of the objects. */
        const uint64_t ground = w->scene.terrain != NULL ? 1 : 0;
        empty = stats.terrain.hits == 0 && stats.drawn <= ground;
        status = describe_objects(run, w, &stats);
    }
    return status.code == VD_OK && empty ? explain_empty(run, w, camera) : status;
}

vd_status vd_render_world(vd_render_run *run) {
    vd_world_scene *w = NULL;
    vd_view view;
    vd_status status = vd_world_scene_load(run, &w);
    if (status.code == VD_OK && vd_job_stopped(run->job)) {
        status = vd_failure(VD_ERROR_CANCELLED, "cancelled");
    }
    if (status.code == VD_OK) {
        status = vd_world_scene_camera(w, run, &view);
    }
    if (status.code == VD_OK) {
        status = describe(run, w, &view);
    }
    if (status.code == VD_OK) {
        status =
            run->settings->dry_run ? estimate(run, w, &view.camera) : draw(run, w, &view.camera);
    }
    vd_world_scene_destroy(&w);
    return status;
}

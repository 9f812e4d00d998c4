/* render_terrain.c: a view of elevation data. */
#include <math.h>
#include <string.h>
#include <unistd.h>

#include "render_run.h"
#include "scene.h"
#include "view.h"

static const double radians_per_degree = 3.14159265358979323846 / 180.0;

/* Auto haze: 37 % of the contrast is left at this many diagonals of the scene. A framed terrain is
 * then seen through 7 to 15 % of haze: distance is felt, and no colour is lost. */
static const double haze_diagonals = 8.0;

/* Finds --colormap: a built-in name, else a file. */
static vd_status find_colormap(vd_context *context, const char *name, vd_colormap *out) {
    if (vd_colormap_find(name, out)) {
        return vd_success();
    }
    if (access(name, R_OK) == 0 || strpbrk(name, "./") != NULL) {
        return vd_colormap_load(context, name, out);
    }
    const char *names[64];
    char list[256] = "";
    int count = 0;
    for (; count < 64 && vd_colormap_name(count) != NULL; count++) {
        names[count] = vd_colormap_name(count);
        size_t used = strlen(list);
        snprintf(list + used, sizeof list - used, "%s%s", count > 0 ? ", " : "", names[count]);
    }
    const char *nearest = vd_nearest_name(name, names, count);
    return vd_failure(VD_ERROR_ARGUMENT,
                      "--colormap: there is neither a colormap nor a file \"%.60s\"; %s%s%s", name,
                      nearest != NULL ? "did you mean " : "give a file, or one of ",
                      nearest != NULL ? nearest : list, nearest != NULL ? "?" : "");
}

static vd_light make_light(const vd_render_settings *s, double diagonal) {
    vd_light light = vd_light_daylight(s->sun_azimuth * radians_per_degree,
                                       s->sun_altitude * radians_per_degree);
    if (s->sky_colored) {
        light.zenith = light.horizon = light.nadir = vd_linear_from_rgba8(s->sky_color);
    }
    /* Haze belongs to a sky, and to distances that mean something. */
    bool hazy = s->sky && s->camera.projection == VD_PROJECTION_PERSPECTIVE;
    light.haze_m = s->haze == VD_HAZE_DISTANCE       ? s->haze_m
                   : s->haze == VD_HAZE_AUTO && hazy ? haze_diagonals * diagonal
                                                     : 0.0;
    return light;
}

static vd_terrain_def make_def(const vd_render_settings *s, const vd_scene *scene,
                               const vd_colormap *colormap) {
    vd_vec3 low, high;
    vd_heightfield_bounds(scene->terrain, &low, &high);
    vd_terrain_def def = vd_terrain_def_default();
    def.heightfield = scene->terrain;
    def.colormap = colormap;
    def.light = make_light(s, vd_vec3_length(vd_vec3_subtract(high, low)));
    def.filter = s->filter;
    def.samples = s->samples;
    def.exaggeration = s->exaggeration;
    def.shading = s->shading;
    def.shadows = s->shadows && s->shading;
    def.curvature = s->curvature < 0 ? vd_scene_is_curved(scene) : s->curvature != 0;
    def.sky = s->sky;
    def.background = s->background;
    return def;
}

static vd_status describe(vd_render_run *run, const vd_scene *scene, const vd_view *view) {
    const vd_render_settings *s = run->settings;
    const vd_heightfield *t = scene->terrain;
    vd_view_flags(view, run->flags, sizeof run->flags);
    run->camera = vd_view_json(view);
    run->camera_all = s->json ? vd_view_describe(scene, view, s->exaggeration) : NULL;
    run->terrain = json_pack("{s: i, s: i, s: f, s: f, s: I, s: s, s: b}", "width", t->width,
                             "height", t->height, "min_m", (double)t->min, "max_m", (double)t->max,
                             "missing", (json_int_t)scene->missing, "format", scene->format,
                             "georeferenced", (int)(scene->kind != VD_CRS_NONE));
    if (run->camera == NULL || run->terrain == NULL || (s->json && run->camera_all == NULL)) {
        return vd_failure(VD_ERROR_MEMORY, "out of memory while describing the camera");
    }
    run->near_m = view->camera.near_m;
    run->far_m = s->camera.projection == VD_PROJECTION_ORTHOGRAPHIC ? view->camera.far_m : 0.0;
    return vd_success();
}

static vd_status estimate(vd_render_run *run, const vd_terrain_def *def, const vd_camera *camera) {
    size_t bytes = 0;
    vd_process_memory loaded = vd_process_memory_now();
    run->ready_seconds = vd_seconds_now() - run->start;
    vd_status status =
        vd_terrain_estimate(run->context, run->job, def, camera, run->settings->width,
                            run->settings->height, &run->draw_seconds, &bytes);
    vd_render_estimate_memory(run, &loaded, bytes);
    return status;
}

static vd_status draw(vd_render_run *run, const vd_terrain_def *def, const vd_camera *camera) {
    const vd_render_settings *s = run->settings;
    vd_status status = vd_render_make_frame(run);
    if (status.code != VD_OK) {
        return status;
    }
    vd_progress progress;
    double start = vd_seconds_now();
    vd_progress_start(&progress, run->job, s->quiet);
    status = vd_terrain_render(run->context, run->job, def, camera, run->frame, &run->stats);
    vd_progress_stop(&progress);
    run->draw_seconds = vd_seconds_now() - start;
    if (status.code != VD_OK || run->stats.hits > 0) {
        return status;
    }
    status = vd_terrain_explain_empty(def, camera, s->width, s->height);
    if (!s->allow_empty) {
        return vd_failure(VD_ERROR_EMPTY, "%.300s (--allow-empty writes the picture all the same)",
                          status.message);
    }
    vd_log(run->context, VD_LOG_WARNING, "%.300s", status.message);
    return vd_success();
}

static vd_status draw_scene(vd_render_run *run, const vd_scene *scene,
                            const vd_colormap *colormap) {
    const vd_render_settings *s = run->settings;
    vd_terrain_def def = make_def(s, scene, colormap);
    vd_view view;
    vd_status status =
        vd_view_make(scene, &s->camera, s->exaggeration, def.curvature, s->width, s->height, &view);
    if (status.code == VD_OK && !s->allow_empty) {
        status = vd_view_check_ground(scene, &view, s->exaggeration);
    }
    if (status.code == VD_OK) {
        status = describe(run, scene, &view);
    }
    if (status.code != VD_OK) {
        return status;
    }
    return s->dry_run ? estimate(run, &def, &view.camera) : draw(run, &def, &view.camera);
}

vd_status vd_render_terrain(vd_render_run *run) {
    const vd_render_settings *s = run->settings;
    if (s->shading && s->sun_altitude < 0.0 && !s->allow_empty) {
        return vd_failure(VD_ERROR_EMPTY,
                          "the sun is %.4g degrees below the horizon and the "
                          "picture would be dark; raise --sun, or give --shading off "
                          "(--allow-empty draws it all the same)",
                          -s->sun_altitude);
    }
    vd_colormap colormap;
    vd_status status = find_colormap(run->context, s->colormap, &colormap);
    if (status.code != VD_OK) {
        run->bad_use = status.code == VD_ERROR_ARGUMENT;
        return status;
    }
    vd_scene_def def = {.inputs = s->inputs,
                        .input_count = s->input_count,
                        .dem = s->dem,
                        .has_cell_size = s->has_cell_size,
                        .band = s->band,
                        .fill_missing = s->fill_missing,
                        .color = s->color,
                        .bands = {s->bands[0], s->bands[1], s->bands[2]}};
    vd_scene scene = {0};
    status = vd_scene_load(run->context, &def, &scene);
    if (status.code == VD_OK && vd_job_stopped(run->job)) {
        status = vd_failure(VD_ERROR_CANCELLED, "cancelled");
    }
    if (status.code == VD_OK) {
        status = draw_scene(run, &scene, &colormap);
    }
    vd_scene_finish(&scene);
    return status;
}

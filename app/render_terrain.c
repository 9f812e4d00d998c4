/* render_terrain.c: the steps of a view of elevation data. */
#include <math.h>
#include <string.h>
#include <unistd.h>

#include "render_terrain.h"
#include "view.h"

/* Auto haze: 37 % of the contrast is left at this many diagonals of the scene. A framed terrain is
 * then seen through 7 to 15 % of haze: distance is felt, and no colour is lost. */
static const double haze_diagonals = 8.0;

/* From far away it grows with the way to the terrain, so that 60 % is left there at least. */
static const double haze_clearances = 2.0;

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

static vd_light make_light(const vd_render_settings *s) {
    vd_light light = vd_light_daylight(s->sun_azimuth * VD_RADIANS_PER_DEGREE,
                                       s->sun_altitude * VD_RADIANS_PER_DEGREE);
    if (s->sky_colored) {
        light.zenith = light.horizon = light.nadir = vd_linear_from_rgba8(s->sky_color);
    }
    light.haze_m = s->haze == VD_HAZE_DISTANCE ? s->haze_m : 0.0;
    return light;
}

vd_terrain_def vd_render_terrain_def(const vd_render_settings *s, const vd_scene *scene,
                                     const vd_colormap *colormap) {
    vd_terrain_def def = vd_terrain_def_default();
    if (scene->function != NULL) {
        def.function = scene->function;
        def.cell_m = scene->cell_m;
    } else {
        def.heightfield = scene->terrain;
    }
    def.colormap = colormap;
    def.light = make_light(s);
    def.method = s->terrain_method;
    def.filter = s->filter;
    def.samples = s->samples;
    def.exaggeration = s->exaggeration;
    def.shading = s->shading;
    def.shadows = s->shadows && s->shading;
    def.curvature =
        s->curvature < 0 ? scene->terrain != NULL && vd_scene_is_curved(scene) : s->curvature != 0;
    def.sky = s->sky;
    def.background = s->background;
    return def;
}

/* ---- where the camera stands ------------------------------------------------------------------
 */

/* Draws a thumbnail without light and tells which share of its samples show terrain. */
static vd_status probe(vd_render_run *run, const vd_terrain_def *def, const vd_camera *camera,
                       double *share) {
    const vd_render_settings *s = run->settings;
    double scale = fmin(1.0, sqrt(1024.0 / ((double)s->width * s->height)));
    int width = (int)fmax(1.0, s->width * scale), height = (int)fmax(1.0, s->height * scale);
    vd_terrain_def plain = *def;
    plain.shading = plain.shadows = false;
    plain.light.haze_m = 0.0;
    plain.samples = 4; /* beside the middle, where a single needle may stand */
    vd_camera small = *camera;
    small.near_m = fmin(small.near_m, 1e-3); /* what --near hides is no matter of the direction */
    double x = (double)width / s->width, y = (double)height / s->height;
    small.lens.fx *= x;
    small.lens.cx *= x;
    small.lens.fy *= y;
    small.lens.cy *= y;
    vd_frame *frame = NULL;
    vd_frame_stats stats = {0, 0};
    vd_status status = vd_frame_create(run->context, width, height, 0, &frame);
    if (status.code == VD_OK) {
        status = vd_terrain_render(run->context, run->job, &plain, &small, frame, &stats);
    }
    vd_frame_destroy(&frame);
    if (status.code == VD_OK) {
        *share = stats.samples > 0 ? (double)stats.hits / (double)stats.samples : 0.0;
    }
    return status;
}

/* Frames without curvature where the formula, made for the distances of one view on land, would
 * move the eye by more than a tenth of its distance: there it bends the map out of the picture. */
static vd_status flatten_far_view(vd_render_run *run, const vd_scene *scene, vd_terrain_def *def,
                                  vd_view *view) {
    const vd_render_settings *s = run->settings;
    vd_view flat;
    vd_status status =
        vd_view_make(scene, &s->camera, s->exaggeration, false, s->width, s->height, &flat);
    if (status.code != VD_OK) {
        return status;
    }
    double moved = vd_vec3_length(vd_vec3_subtract(view->camera.eye, flat.camera.eye));
    if (moved > 0.1 * flat.exact.distance_m) {
        flat.flattened = true;
        def->curvature = false;
        *view = flat;
        vd_log(run->context, VD_LOG_WARNING,
               "the camera stands %.4g km away, for which the Earth's curvature is left out "
               "(--curvature on keeps it)",
               1e-3 * flat.exact.distance_m);
    }
    return vd_success();
}

/* Looks from above where the framed view shows next to nothing and no elevation was asked for, as
 * with heights far larger than the map, of which only the open sides would be seen. Rays that
 * spread may still miss slopes that steep; parallel ones straight down miss nothing. */
static vd_status raise_empty_view(vd_render_run *run, const vd_scene *scene,
                                  const vd_terrain_def *def, vd_view *view) {
    static const double next_to_nothing = 0.002, plenty = 0.1;
    const vd_render_settings *s = run->settings;
    double share = 0.0, share_above = 0.0;
    vd_status status = probe(run, def, &view->camera, &share);
    if (status.code != VD_OK || share > next_to_nothing) {
        return status;
    }
    vd_camera_settings above = s->camera;
    vd_view raised;
    above.elevation = 90.0;
    for (int projection = above.projection; projection < VD_PROJECTION_COUNT; projection++) {
        above.projection = (vd_projection)projection;
        status = vd_view_make(scene, &above, s->exaggeration, def->curvature, s->width, s->height,
                              &raised);
        if (status.code == VD_OK) {
            status = probe(run, def, &raised.camera, &share_above);
        }
        if (status.code != VD_OK || share_above > plenty) {
            break;
        }
    }
    if (status.code == VD_OK && share_above > 2.0 * share) {
        raised.flattened = view->flattened;
        *view = raised;
        vd_log(
            run->context, VD_LOG_WARNING,
            "from %.4g degrees above the horizon the terrain would not be seen; the camera looks "
            "straight down%s (--elevation chooses)",
            s->camera.elevation,
            raised.exact.projection != s->camera.projection ? ", orthographic" : "");
    }
    return status;
}

double vd_render_auto_haze(const vd_scene *scene, double clearance_m) {
    vd_vec3 low, high;
    vd_heightfield_bounds(scene->terrain, &low, &high);
    return fmax(haze_diagonals * vd_vec3_length(vd_vec3_subtract(high, low)),
                haze_clearances * clearance_m);
}

/* Haze belongs to a sky, and to distances that mean something. */
static void settle_haze(const vd_render_settings *s, const vd_scene *scene, const vd_view *view,
                        vd_light *light) {
    if (s->haze == VD_HAZE_AUTO && s->sky && view->camera.projection == VD_PROJECTION_PERSPECTIVE) {
        light->haze_m =
            vd_render_auto_haze(scene, vd_view_clearance_m(scene, view, s->exaggeration));
    }
}

/* What is legal but surely not meant. */
static void warn(vd_render_run *run, const vd_scene *scene, const vd_terrain_def *def,
                 const vd_view *view) {
    const vd_render_settings *s = run->settings;
    vd_vec3 low, high;
    vd_heightfield_bounds(scene->terrain, &low, &high);
    double relief = (high.z - low.z) * s->exaggeration;
    double extent = fmax(high.x - low.x, high.y - low.y);
    if (extent > 0.0 && relief > 10.0 * extent) {
        vd_log(run->context, VD_LOG_WARNING,
               "the heights span %.4g m and the map only %.4g m; give %s--height-scale if that is "
               "not so",
               relief, extent, scene->kind == VD_CRS_NONE ? "--cell-size or " : "");
    }
    if (scene->function != NULL && s->shadows && s->shadows_given) {
        vd_log(run->context, VD_LOG_WARNING,
               "--shadows: a formula without end throws none; give --extent");
    }
    double clearance = vd_view_clearance_m(scene, view, s->exaggeration);
    if (def->light.haze_m > 0.0 && clearance > 3.0 * def->light.haze_m) {
        double left = 100.0 * exp(-clearance / def->light.haze_m);
        vd_log(run->context, VD_LOG_WARNING,
               "haze of %.4g km leaves %s%.2g %% of the contrast at the terrain's nearest point, "
               "%.4g km away; give a larger --haze, or a nearer camera",
               1e-3 * def->light.haze_m, left < 0.01 ? "less than " : "", fmax(left, 0.01),
               1e-3 * clearance);
    }
}

/* Where nothing else is asked for, a formula without end is seen from the south, a little down: the
 * relief around the origin is the lower half of the picture, the horizon lies over it. */
static vd_camera_settings endless_camera(const vd_render_settings *s, const vd_scene *scene) {
    static const double elevation = 10.0, reliefs = 8.0, least_cells = 200.0;
    vd_camera_settings camera = s->camera;
    double ground, relief;
    vd_scene_origin(scene, &ground, &relief);
    if (camera.target.kind == VD_POSITION_NONE) {
        camera.target = (vd_position){VD_POSITION_WORLD, {0.0, 0.0, ground * s->exaggeration}};
    }
    if (camera.spelling == VD_SPELLING_ORBIT && !camera.elevation_given) {
        camera.elevation = elevation;
    }
    if (camera.spelling == VD_SPELLING_ORBIT && camera.distance_m == 0.0) {
        camera.distance_m = fmax(reliefs * relief * s->exaggeration, least_cells * scene->cell_m);
    }
    return camera;
}

vd_status vd_render_terrain_view(vd_render_run *run, const vd_scene *scene, vd_terrain_def *def,
                                 vd_view *out) {
    const vd_render_settings *s = run->settings;
    if (scene->terrain ==
        NULL) { /* neither ground nor distances that haze would mean something for */
        return vd_view_make(scene, &s->camera, 1.0, false, s->width, s->height, out);
    }
    const vd_camera_settings endless =
        scene->function != NULL ? endless_camera(s, scene) : s->camera;
    const vd_camera_settings *camera = &endless;
    vd_view view;
    vd_status status =
        vd_view_make(scene, camera, s->exaggeration, def->curvature, s->width, s->height, &view);
    bool framed = camera->spelling == VD_SPELLING_ORBIT && camera->distance_m == 0.0;
    if (status.code == VD_OK && framed && def->curvature && s->curvature < 0) {
        status = flatten_far_view(run, scene, def, &view);
    }
    bool free_to_rise =
        framed && !camera->elevation_given && camera->target.kind == VD_POSITION_NONE;
    if (status.code == VD_OK && free_to_rise) {
        status = raise_empty_view(run, scene, def, &view);
    }
    if (status.code == VD_OK && !s->allow_empty) {
        status = vd_view_check_ground(scene, &view, s->exaggeration);
    }
    if (status.code == VD_OK) {
        settle_haze(s, scene, &view, &def->light);
        warn(run, scene, def, &view);
        *out = view;
    }
    return status;
}

/* Where the data reach from land to the sea floor, colours that stretch over all of it show neither
 * coast nor depth. No dry land lies below -500 m (the Dead Sea's shore is at -430 m). */
static void suggest_colormap(const vd_render_settings *s, const vd_scene *scene,
                             vd_colormap *colormap) {
    const vd_heightfield *t = scene->terrain;
    vd_colormap topo;
    if (!s->colormap_given && t != NULL && scene->kind != VD_CRS_NONE && t->min < -500.0f &&
        t->max > 0.0f && vd_colormap_find("topo", &topo)) {
        *colormap = topo;
    }
}

vd_status vd_render_terrain_colormap(vd_context *context, const vd_render_settings *s,
                                     const vd_scene *scene, vd_colormap *out) {
    vd_status status = find_colormap(context, s->colormap, out);
    if (status.code == VD_OK) {
        suggest_colormap(s, scene, out);
    }
    return status;
}

vd_status vd_render_terrain_load(vd_render_run *run, vd_scene *out) {
    const vd_render_settings *s = run->settings;
    vd_scene_def def = {.inputs = s->inputs,
                        .input_count = s->input_count,
                        .function = s->function,
                        .extent = {s->extent[0], s->extent[1], s->extent[2], s->extent[3]},
                        .dem = s->dem,
                        .has_cell_size = s->has_cell_size,
                        .band = s->band,
                        .fill_missing = s->fill_missing,
                        .color = s->color,
                        .bands = {s->bands[0], s->bands[1], s->bands[2]}};
    return vd_scene_load(run->context, &def, out);
}

vd_status vd_render_load_terrain(vd_render_run *run, vd_scene *scene, vd_colormap *colormap,
                                 vd_terrain_def *out) {
    const vd_render_settings *s = run->settings;
    if (s->shading && s->sun_altitude < 0.0 && !s->allow_empty) {
        return vd_failure(VD_ERROR_EMPTY,
                          "the sun is %.4g degrees below the horizon and the "
                          "picture would be dark; raise --sun, or give --shading off "
                          "(--allow-empty draws it all the same)",
                          -s->sun_altitude);
    }
    vd_status status = find_colormap(run->context, s->colormap, colormap);
    if (status.code != VD_OK) {
        run->bad_use = status.code == VD_ERROR_ARGUMENT;
        return status;
    }
    scene->context = run->context;
    if (s->input_count > 0 || s->function != NULL) {
        status = vd_render_terrain_load(run, scene);
    }
    if (status.code == VD_OK && vd_job_stopped(run->job)) {
        status = vd_failure(VD_ERROR_CANCELLED, "cancelled");
    }
    if (status.code == VD_OK) {
        suggest_colormap(s, scene, colormap);
        *out = vd_render_terrain_def(s, scene, colormap);
    }
    return status;
}

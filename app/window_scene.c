/* window_scene.c: elevation data in the window, by one terrain renderer that is kept. */
#include "window_scene.h"

#include <math.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

#include "render_terrain.h"

typedef struct terrain {
    vd_context *context;
    vd_scene scene;
    vd_terrain_renderer *renderer;
    vd_render_settings looked; /* as last taken over */
    char colormap[256];        /* its name there */
    double auto_haze_m;
    int auto_curvature;
    int samples;
    _Atomic double exaggeration; /* `ground` is asked from another thread */
} terrain;

static vd_status draw(void *user, vd_job *job, const vd_camera *camera, vd_window_quality quality,
                      vd_frame *frame) {
    terrain *t = user;
    vd_status status =
        vd_terrain_renderer_set_samples(t->renderer, quality == VD_WINDOW_MOVING ? 1 : t->samples);
    return status.code == VD_OK ? vd_terrain_renderer_draw(t->renderer, job, camera, frame, NULL)
                                : status;
}

static double ground(void *user, double x, double y) {
    const terrain *t = user;
    double height;
    if (t->scene.function != NULL) {
        const float fx = (float)x, fy = (float)y;
        float value;
        vd_function_evaluate(t->scene.function, 1, &fx, &fy, &value, NULL);
        height = value;
    } else {
        height = vd_heightfield_height_at(t->scene.terrain, x, y);
    }
    return isfinite(height) ? height * t->exaggeration : (double)-INFINITY;
}

/* Settings with what is automatic in them decided. */
static vd_render_settings settle(const terrain *t, const vd_render_settings *settings) {
    vd_render_settings s = *settings;
    if (s.haze == VD_HAZE_AUTO) {
        s.haze = t->auto_haze_m > 0.0 ? VD_HAZE_DISTANCE : VD_HAZE_OFF;
        s.haze_m = t->auto_haze_m;
    }
    if (s.curvature < 0) {
        s.curvature = t->auto_curvature;
    }
    return s;
}

/* Whether a renderer made for one can draw the other by a change of light and samples. */
static bool same_surface(const vd_render_settings *a, const vd_render_settings *b) {
    return a->exaggeration == b->exaggeration && a->filter == b->filter &&
           a->shading == b->shading && a->shadows == b->shadows && a->sky == b->sky &&
           a->sky_colored == b->sky_colored && a->curvature == b->curvature &&
           a->terrain_method == b->terrain_method && strcmp(a->colormap, b->colormap) == 0 &&
           a->colormap_given == b->colormap_given &&
           memcmp(&a->background, &b->background, sizeof a->background) == 0;
}

static bool same_light(const vd_render_settings *a, const vd_render_settings *b) {
    return a->sun_azimuth == b->sun_azimuth && a->sun_altitude == b->sun_altitude &&
           a->haze == b->haze && a->haze_m == b->haze_m;
}

static vd_status look(void *user, vd_job *job, const vd_render_settings *settings) {
    terrain *t = user;
    const vd_render_settings s = settle(t, settings);
    const bool surface = t->renderer != NULL && same_surface(&s, &t->looked);
    vd_colormap colormap;
    vd_status status = vd_success();
    if (!surface || !same_light(&s, &t->looked)) {
        status = vd_render_terrain_colormap(t->context, &s, &t->scene, &colormap);
    }
    if (status.code == VD_OK && !surface) {
        const vd_terrain_def def = vd_render_terrain_def(&s, &t->scene, &colormap);
        vd_terrain_renderer *made = NULL;
        status = vd_terrain_renderer_create(t->context, job, &def, &made);
        if (status.code == VD_OK) {
            vd_terrain_renderer_destroy(&t->renderer);
            t->renderer = made;
        }
    } else if (status.code == VD_OK && !same_light(&s, &t->looked)) {
        const vd_terrain_def def = vd_render_terrain_def(&s, &t->scene, &colormap);
        t->looked.sun_azimuth = NAN; /* a failure leaves colours unfinished: do them again */
        status = vd_terrain_renderer_light(t->renderer, job, &def.light);
    }
    if (status.code != VD_OK) {
        return status;
    }
    t->looked = s;
    snprintf(t->colormap, sizeof t->colormap, "%s", s.colormap);
    t->looked.colormap = t->colormap;
    t->samples = s.samples;
    t->exaggeration = s.exaggeration;
    return status;
}

static void destroy(void *user) {
    terrain *t = user;
    vd_terrain_renderer_destroy(&t->renderer);
    vd_scene_finish(&t->scene);
    free(t);
}

/* The first camera, spelled so that flying on from it changes what it should. */
static void start_from(const vd_view *view, double *size_m, vd_camera_settings *out) {
    const vd_camera *camera = &view->camera;
    double heading, pitch, roll;
    *out = view->exact;
    out->spelling = VD_SPELLING_ANGLES;
    out->projection = VD_PROJECTION_PERSPECTIVE;
    out->target.kind = VD_POSITION_NONE;
    vd_vec3 eye = camera->eye;
    if (camera->projection == VD_PROJECTION_ORTHOGRAPHIC) {
        /* Its eye stands far behind; perspective shows the same from the orbit's distance. */
        const vd_vec3 forward = vd_quat_rotate(camera->orientation, vd_vec3_make(0, 0, 1));
        const double *target = view->exact.target.v;
        eye = vd_vec3_subtract(vd_vec3_make(target[0], target[1], target[2]),
                               vd_vec3_scale(forward, view->exact.distance_m));
    }
    out->eye = (vd_position){VD_POSITION_WORLD, {eye.x, eye.y, eye.z}};
    vd_orientation_to_angles(camera->orientation, &heading, &pitch, &roll);
    out->heading = heading / VD_RADIANS_PER_DEGREE;
    out->pitch = pitch / VD_RADIANS_PER_DEGREE;
    out->roll = roll / VD_RADIANS_PER_DEGREE;
    *size_m = fmax(*size_m, 1e-3);
}

/* Finds the first camera and what the automatic settings come to. */
static vd_status settle_view(terrain *t, vd_job *job, const vd_render_settings *settings,
                             vd_window_scene *out) {
    vd_render_run run = {.settings = settings, .context = t->context, .job = job};
    vd_colormap colormap;
    vd_view view;
    vd_status status = vd_render_terrain_colormap(t->context, settings, &t->scene, &colormap);
    if (status.code != VD_OK) {
        return status;
    }
    vd_terrain_def def = vd_render_terrain_def(settings, &t->scene, &colormap);
    status = vd_render_terrain_view(&run, &t->scene, &def, &view);
    if (status.code != VD_OK) {
        return status;
    }
    vd_vec3 low, high;
    vd_heightfield_bounds(t->scene.terrain, &low, &high);
    out->size_m = vd_vec3_length(vd_vec3_subtract(high, low));
    start_from(&view, &out->size_m, &out->start);
    t->auto_haze_m = out->haze_m = def.light.haze_m;
    t->auto_curvature = out->curvature = def.curvature;
    return status;
}

vd_status vd_window_scene_open(vd_context *context, vd_job *job, const vd_render_settings *settings,
                               vd_window_stage_function *stage, void *stage_user,
                               vd_window_scene *out) {
    terrain *t = calloc(1, sizeof *t);
    if (t == NULL) {
        return vd_failure(VD_ERROR_MEMORY, "out of memory while opening a world");
    }
    t->context = context;
    vd_render_settings s = *settings;
    s.allow_empty = true; /* a camera that shows nothing can be flown on */
    vd_render_run run = {.settings = &s, .context = context, .job = job};
    vd_window_scene made = {
        .user = t, .draw = draw, .look = look, .ground = ground, .destroy = destroy};
    stage(stage_user, "reading");
    vd_status status = vd_render_terrain_load(&run, &t->scene);
    if (status.code == VD_OK) {
        stage(stage_user, "looking around");
        status = settle_view(t, job, &s, &made);
    }
    if (status.code == VD_OK) {
        vd_job_reset(job);
        stage(stage_user, "lighting");
        status = look(t, job, &s);
    }
    if (status.code != VD_OK) {
        destroy(t);
        return status;
    }
    *out = made;
    return status;
}

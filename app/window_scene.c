/* window_scene.c: a world in the window, by one renderer that is kept. */
#include "window_scene.h"

#include <math.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

#include "render_terrain.h"
#include "run.h"
#include "world_scene.h"

typedef struct world {
    vd_context *context;
    const vd_world_content *content;
    vd_world_scene *scene;
    vd_world_renderer *renderer;
    bool by_impostors; /* while moving */
    vd_impostor_def impostor_def;
    vd_impostors *impostors;   /* of the renderer; made when the camera first moves */
    vd_impostor_stats stats;   /* of the last picture by them */
    vd_render_settings looked; /* as last taken over */
    char colormap[256];        /* its name there */
    double auto_haze_m;
    int auto_curvature;
    int samples;
    _Atomic double exaggeration; /* `ground` is asked from another thread */
} world;

/* So many updates at most until a camera that rests has all its pictures. */
enum { MOST_UPDATES = 400 };

static vd_status draw_impostors(world *w, vd_job *job, const vd_camera *camera,
                                const vd_window_way *way, vd_frame *frame) {
    vd_status status = vd_success();
    const bool fresh = w->impostors == NULL;
    if (fresh) {
        status = vd_impostors_create(w->context, w->scene->world, w->renderer, &w->impostor_def,
                                     &w->impostors);
    }
    if (status.code == VD_OK) {
        status = vd_impostors_set_show(w->impostors, way->show);
    }
    if (status.code != VD_OK) {
        return status;
    }
    /* What is kept must have been there: after a change of light all are new. */
    vd_impostors_freeze(w->impostors, way->frozen && !fresh);
    bool again = true;
    for (int i = 0; i < MOST_UPDATES && again && status.code == VD_OK; i++) {
        status = vd_impostors_update(w->impostors, job, camera, frame->width, frame->height,
                                     vd_seconds_now(), &w->stats);
        again = way->quality == VD_WINDOW_STILL && !(way->frozen && !fresh) &&
                (w->stats.drawn > 0 || w->stats.waiting > 0 || w->stats.in_flight > 0);
        if (again && status.code == VD_OK) {
            vd_impostors_wait(w->impostors);
        }
    }
    return status.code == VD_OK ? vd_impostors_draw(w->impostors, job, camera, frame, &w->stats)
                                : status;
}

static vd_status draw(void *user, vd_job *job, const vd_camera *camera, const vd_window_way *way,
                      vd_frame *frame) {
    world *w = user;
    const bool moving = way->quality == VD_WINDOW_MOVING;
    const bool looked_at = way->show != VD_IMPOSTOR_SHOW_PICTURES || way->frozen;
    vd_status status = vd_world_renderer_set_samples(w->renderer, moving ? 1 : w->samples);
    if (status.code == VD_OK && w->by_impostors && (moving || looked_at) &&
        camera->projection == VD_PROJECTION_PERSPECTIVE) {
        return draw_impostors(w, job, camera, way, frame);
    }
    return status.code == VD_OK ? vd_world_renderer_draw(w->renderer, job, camera, frame, NULL)
                                : status;
}

static bool impostors(void *user, vd_impostor_stats *out) {
    const world *w = user;
    *out = w->stats;
    return w->impostors != NULL;
}

static double ground(void *user, double x, double y) {
    const world *w = user;
    const vd_scene *scene = &w->scene->scene; /* its heights stay when the world is made anew */
    double height = -(double)INFINITY;
    if (scene->function != NULL) {
        const float fx = (float)x, fy = (float)y;
        float value;
        vd_function_evaluate(scene->function, 1, &fx, &fy, &value, NULL);
        height = (double)value;
    } else if (scene->terrain != NULL) {
        height = vd_heightfield_height_at(scene->terrain, x, y);
    }
    return isfinite(height) ? height * w->exaggeration : (double)-INFINITY;
}

/* Settings with what is automatic in them decided. */
static vd_render_settings settle(const world *t, const vd_render_settings *settings) {
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

/* Takes over another surface: colours, filter, shadows, exaggeration, method. */
static vd_status change_surface(world *w, vd_job *job, const vd_render_settings *s) {
    vd_render_run run = {.settings = s, .content = w->content, .context = w->context, .job = job};
    vd_world_scene *scene = w->scene;
    const double before = scene->look.exaggeration;
    vd_world_renderer *made = NULL;
    vd_impostors_destroy(&w->impostors); /* a thread of theirs looks at all this */
    vd_status status = vd_render_terrain_colormap(w->context, s, &scene->scene, &scene->colormap);
    if (status.code != VD_OK) {
        return status;
    }
    scene->look = vd_render_terrain_def(s, &scene->scene, &scene->colormap);
    if (scene->look.exaggeration != before && w->renderer != NULL) {
        vd_world_renderer_destroy(&w->renderer);
        status = vd_world_scene_rebuild(scene, &run);
    } else {
        vd_world_scene_relook(scene);
    }
    if (status.code == VD_OK) {
        status = vd_world_scene_renderer(scene, job, &made);
    }
    if (status.code == VD_OK) {
        vd_world_renderer_destroy(&w->renderer);
        w->renderer = made;
    }
    return status;
}

static vd_status look(void *user, vd_job *job, const vd_render_settings *settings) {
    world *w = user;
    const vd_render_settings s = settle(w, settings);
    const bool surface = w->renderer != NULL && same_surface(&s, &w->looked);
    vd_status status = vd_success();
    if (!surface) {
        status = change_surface(w, job, &s);
    } else if (!same_light(&s, &w->looked)) {
        vd_world_scene *scene = w->scene;
        vd_impostors_destroy(&w->impostors); /* they show the old light */
        scene->look.light = vd_render_terrain_def(&s, &scene->scene, &scene->colormap).light;
        w->looked.sun_azimuth = NAN; /* a failure leaves colours unfinished: do them again */
        status = vd_world_renderer_light(w->renderer, job, &scene->look.light);
    }
    if (status.code != VD_OK) {
        return status;
    }
    w->looked = s;
    snprintf(w->colormap, sizeof w->colormap, "%s", s.colormap);
    w->looked.colormap = w->colormap;
    w->samples = s.samples;
    w->exaggeration = s.exaggeration;
    return status;
}

static void destroy(void *user) {
    world *w = user;
    vd_impostors_destroy(&w->impostors);
    vd_world_renderer_destroy(&w->renderer);
    vd_world_scene_destroy(&w->scene);
    free(w);
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
static vd_status settle_view(world *w, vd_render_run *run, vd_window_scene *out) {
    vd_view view;
    const vd_status status = vd_world_scene_camera(w->scene, run, &view);
    if (status.code != VD_OK) {
        return status;
    }
    vd_vec3 low = {0, 0, 0}, high = {0, 0, 0};
    if (w->scene->scene.terrain != NULL) {
        vd_heightfield_bounds(w->scene->scene.terrain, &low, &high);
    } else {
        (void)vd_world_bounds(w->scene->world, &low, &high);
    }
    out->size_m = vd_vec3_length(vd_vec3_subtract(high, low));
    start_from(&view, &out->size_m, &out->start);
    w->auto_haze_m = out->haze_m = w->scene->look.light.haze_m;
    w->auto_curvature = out->curvature = w->scene->look.curvature;
    return status;
}

vd_status vd_window_scene_open(vd_context *context, vd_job *job, const vd_render_settings *settings,
                               const vd_world_content *content, const vd_impostor_def *def,
                               vd_window_stage_function *stage, void *stage_user,
                               vd_window_scene *out) {
    world *w = calloc(1, sizeof *w);
    if (w == NULL) {
        return vd_failure(VD_ERROR_MEMORY, "out of memory while opening a world");
    }
    w->context = context;
    w->content = content;
    w->by_impostors = def != NULL;
    w->impostor_def = def != NULL ? *def : vd_impostor_def_default();
    vd_render_settings s = *settings;
    s.allow_empty = true; /* a camera that shows nothing can be flown on */
    vd_render_run run = {.settings = &s, .content = content, .context = context, .job = job};
    vd_window_scene made = {.user = w,
                            .draw = draw,
                            .impostors = impostors,
                            .look = look,
                            .ground = ground,
                            .destroy = destroy};
    stage(stage_user, "reading");
    vd_status status = vd_world_scene_load(&run, &w->scene);
    if (status.code == VD_OK) {
        stage(stage_user, "looking around");
        status = settle_view(w, &run, &made);
    }
    if (status.code == VD_OK) {
        vd_job_reset(job);
        stage(stage_user, "lighting");
        status = look(w, job, &s);
    }
    if (status.code != VD_OK) {
        destroy(w);
        return status;
    }
    *out = made;
    return status;
}

/* world_scene.c: from settings and a world's content to a world that can be drawn. */
#include "world_scene.h"

#include <stdlib.h>

#include "world_furniture.h"
#include "world_place.h"

/* Makes the world of what is loaded. */
static vd_status build(vd_world_scene *w, vd_render_run *run) {
    const vd_world_def def = {w->look};
    vd_status status = vd_world_create(w->context, &def, &w->world);
    if (status.code == VD_OK) {
        status = vd_world_place(w, run);
    }
    if (status.code == VD_OK) {
        status = vd_world_arrange(w->world, run->job);
    }
    if (status.code == VD_OK) {
        const size_t terrain = w->scene.terrain != NULL ? 1 : 0;
        w->object_count = vd_world_object_count(w->world) - terrain;
        status = vd_world_furnish(w, run);
    }
    return status;
}

static vd_status load(vd_world_scene *w, vd_render_run *run) {
    const vd_status status = vd_render_load_terrain(run, &w->scene, &w->colormap, &w->look);
    return status.code == VD_OK ? build(w, run) : status;
}

vd_status vd_world_scene_rebuild(vd_world_scene *scene, vd_render_run *run) {
    vd_world_unfurnish(scene);
    vd_world_destroy(&scene->world);
    return build(scene, run);
}

vd_status vd_world_scene_load(vd_render_run *run, vd_world_scene **out) {
    vd_world_scene *w = calloc(1, sizeof *w);
    if (w == NULL) {
        return vd_failure(VD_ERROR_MEMORY, "out of memory while loading a world");
    }
    w->context = run->context;
    const vd_status status = load(w, run);
    if (status.code != VD_OK) {
        vd_world_scene_destroy(&w);
        return status;
    }
    *out = w;
    return status;
}

void vd_world_scene_destroy(vd_world_scene **scene) {
    vd_world_scene *w = *scene;
    if (w != NULL) {
        vd_world_unfurnish(w);
        vd_world_destroy(&w->world);
        vd_scene_finish(&w->scene);
        free(w);
        *scene = NULL;
    }
}

vd_status vd_world_scene_camera(vd_world_scene *scene, vd_render_run *run, vd_view *out) {
    const vd_status status = vd_render_terrain_view(run, &scene->scene, &scene->look, out);
    if (status.code == VD_OK) {
        vd_world_scene_relook(scene);
    }
    return status;
}

void vd_world_scene_relook(vd_world_scene *scene) {
    vd_world_set_look(scene->world, &scene->look);
}

double vd_world_scene_ground(void *scene, double x, double y) {
    const vd_world_scene *w = scene;
    return vd_world_ground(w->world, x, y);
}

vd_status vd_world_scene_renderer(vd_world_scene *scene, vd_job *job, vd_world_renderer **out) {
    vd_world_renderer_def def = vd_world_renderer_def_default();
    if (scene->furniture != NULL) {
        def.overlay = vd_world_overlay;
        def.overlay_user = scene;
    }
    return vd_world_renderer_create(scene->context, job, scene->world, &def, out);
}

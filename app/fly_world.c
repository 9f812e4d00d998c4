/* fly_world.c: elevation data as what a camera flies through. */
#include "fly_world.h"

#include "view.h"

#include <math.h>

vd_status vd_fly_world_load(vd_render_run *run, vd_fly_world *out) {
    *out = (vd_fly_world){.run = run, .exaggeration = run->settings->exaggeration};
    return vd_render_load_terrain(run, &out->scene, &out->colormap, &out->def);
}

void vd_fly_world_finish(vd_fly_world *world) {
    vd_terrain_renderer_destroy(&world->renderer);
    vd_scene_finish(&world->scene);
}

double vd_fly_ground(void *user, double x, double y) {
    const vd_fly_world *world = user;
    if (world->scene.function != NULL) { /* it goes on beyond what stands for it in the scene */
        float height = 0.0f;
        const float at[2] = {(float)x, (float)y};
        vd_function_evaluate(world->scene.function, 1, &at[0], &at[1], &height, NULL);
        return (double)height * world->exaggeration;
    }
    return vd_heightfield_height_at(world->scene.terrain, x, y) * world->exaggeration;
}

/* The farthest that the path is from the terrain's box. */
static double farthest(const vd_fly_world *world, const vd_camera_path *path) {
    enum { PLACES = 256 };
    double most = 0.0;
    for (int i = 0; i <= PLACES; i++) {
        vd_view view = {.exact = {.fov = 0.0}};
        view.camera.eye = vd_camera_path_pose(path, vd_camera_path_duration(path) * i / PLACES).eye;
        double distance = vd_view_clearance_m(&world->scene, &view, world->exaggeration);
        most = distance > most ? distance : most;
    }
    return most;
}

vd_status vd_fly_world_prepare(vd_fly_world *world, const vd_camera_path *path) {
    const vd_render_settings *s = world->run->settings;
    if (s->haze == VD_HAZE_AUTO && s->sky) {
        world->def.light.haze_m = vd_render_auto_haze(&world->scene, farthest(world, path));
    }
    return vd_terrain_renderer_create(world->run->context, world->run->job, &world->def,
                                      &world->renderer);
}

vd_status vd_fly_draw(void *user, const vd_camera *camera, vd_frame *frame) {
    vd_fly_world *world = user;
    return vd_terrain_renderer_draw(world->renderer, world->run->job, camera, frame, NULL);
}

vd_status vd_fly_draw_map(vd_fly_world *world, const vd_camera *camera, vd_frame *frame) {
    vd_terrain_def def = world->def;
    def.curvature = def.sky = false;
    def.light.haze_m = 0.0;
    def.background = (vd_rgba8){238, 238, 232, 255};
    return vd_terrain_render(world->run->context, world->run->job, &def, camera, frame, NULL);
}

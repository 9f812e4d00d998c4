/* fly_world.c: a world as what a camera flies through. */
#include "fly_world.h"

#include "render_terrain.h"

vd_status vd_fly_world_load(vd_render_run *run, vd_fly_world *out) {
    *out = (vd_fly_world){.run = run};
    const vd_status status = vd_world_scene_load(run, &out->scene);
    if (status.code == VD_OK && out->scene->scene.terrain == NULL) {
        return vd_failure(VD_ERROR_EMPTY, "the world has no terrain to fly over; give \"terrain\" "
                                          "in its file, or an elevation file");
    }
    return status;
}

void vd_fly_world_finish(vd_fly_world *world) {
    vd_world_renderer_destroy(&world->renderer);
    vd_world_scene_destroy(&world->scene);
}

void vd_fly_world_bounds(const vd_fly_world *world, vd_vec3 *min, vd_vec3 *max) {
    const double exaggeration = world->run->settings->exaggeration;
    vd_heightfield_bounds(world->scene->scene.terrain, min, max);
    min->z *= exaggeration;
    max->z *= exaggeration;
}

/* The farthest that the path is from the terrain's box. */
static double farthest(const vd_fly_world *world, const vd_camera_path *path) {
    enum { PLACES = 256 };
    double most = 0.0;
    for (int i = 0; i <= PLACES; i++) {
        vd_view view = {.exact = {.fov = 0.0}};
        view.camera.eye = vd_camera_path_pose(path, vd_camera_path_duration(path) * i / PLACES).eye;
        double distance =
            vd_view_clearance_m(&world->scene->scene, &view, world->run->settings->exaggeration);
        most = distance > most ? distance : most;
    }
    return most;
}

vd_status vd_fly_world_prepare(vd_fly_world *world, const vd_camera_path *path) {
    const vd_render_settings *s = world->run->settings;
    if (s->haze == VD_HAZE_AUTO && s->sky) {
        world->scene->look.light.haze_m =
            vd_render_auto_haze(&world->scene->scene, farthest(world, path));
        vd_world_scene_relook(world->scene);
    }
    return vd_world_scene_renderer(world->scene, world->run->job, &world->renderer);
}

vd_status vd_fly_draw(void *user, const vd_camera *camera, vd_frame *frame) {
    vd_fly_world *world = user;
    return vd_world_renderer_draw(world->renderer, world->run->job, camera, frame, NULL);
}

vd_status vd_fly_draw_map(vd_fly_world *world, const vd_camera *camera, vd_frame *frame) {
    vd_terrain_def def = world->scene->look;
    def.curvature = def.sky = false;
    def.light.haze_m = 0.0;
    def.background = (vd_rgba8){238, 238, 232, 255};
    return vd_terrain_render(world->run->context, world->run->job, &def, camera, frame, NULL);
}

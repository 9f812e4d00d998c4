/* serve_world.h: what a client of `veduta serve` is told of a world, and its cameras. */
#ifndef VEDUTA_APP_SERVE_WORLD_H
#define VEDUTA_APP_SERVE_WORLD_H

#include "world_scene.h"

typedef struct vd_serve_world {
    const vd_render_settings *settings;
    vd_world_scene *scene;
    vd_view view; /* the first camera, for the settings' size */
    const char *name;
} vd_serve_world;

/* A vd_server_camera_function; `user` is a vd_serve_world. The text is X,Y,Z,HEADING,PITCH and
 * perhaps FOV: metres and degrees, as --eye, --heading, --pitch and --fov of `veduta render`. */
VD_MUST_USE vd_status vd_serve_camera(void *user, const char *text, int width, int height,
                                      vd_camera *out);

/* Returns /world.json, to be freed by the caller; null when memory is out. */
char *vd_serve_world_json(const vd_serve_world *world);

#endif

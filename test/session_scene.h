/* session_scene.h: hills with balls on them, as a server has them. */
#ifndef VEDUTA_TEST_SESSION_SCENE_H
#define VEDUTA_TEST_SESSION_SCENE_H

#include "remote/session.h"
#include "world_scenes.h"

typedef struct session_scene {
    vd_heightfield *map;
    vd_world *world;
    vd_world_renderer *renderer;
    vd_session_tools tools;
    vd_session_def def; /* of its sessions */
} session_scene;

/* Serves the scene's map and world. */
static inline void scene_serve(session_scene *s, vd_context *context, const char *token) {
    assert_ok(vd_world_renderer_create(context, NULL, s->world, NULL, &s->renderer));
    assert_ok(vd_session_tools_init(context, &s->tools));
    s->def = vd_session_def_default();
    s->def.world = s->world;
    s->def.renderer = s->renderer;
    s->def.tools = &s->tools;
    s->def.token = token;
    s->def.budget_s = 1.0;
}

static inline void scene_begin(session_scene *s, vd_context *context, const char *token) {
    const vd_vec3 middle = {0, 0, 0};
    s->map = hills(context, middle);
    s->world = make_world(context, s->map, middle, 200, 3);
    scene_serve(s, context, token);
}

/* After its sessions. */
static inline void scene_end(session_scene *s, vd_context *context) {
    vd_session_tools_finish(&s->tools);
    vd_world_renderer_destroy(&s->renderer);
    vd_world_destroy(&s->world);
    vd_heightfield_destroy(context, &s->map);
}

#endif

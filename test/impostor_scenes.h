/* impostor_scenes.h: a world by impostors, and whether each of its objects is shown once. */
#ifndef VEDUTA_TEST_IMPOSTOR_SCENES_H
#define VEDUTA_TEST_IMPOSTOR_SCENES_H

#include <math.h>
#include <unistd.h>
#include "impostor/impostor_set.h"
#include "particle_scenes.h"
#include "world_scenes.h"

typedef struct scene {
    vd_context *context;
    vd_heightfield *map;
    vd_world *world;
    vd_world_renderer *renderer;
    vd_impostors *set;
    double time_s;
} scene;

static inline void begin_with(scene *s, int threads, int balls, const vd_impostor_def *def) {
    const vd_vec3 middle = {0, 0, 0};
    s->context = test_context(threads, VD_ISA_AUTO);
    s->map = hills(s->context, middle);
    s->world = make_world(s->context, s->map, middle, balls, 3);
    s->time_s = 0.0;
    assert_ok(vd_world_renderer_create(s->context, NULL, s->world, NULL, &s->renderer));
    assert_ok(vd_impostors_create(s->context, s->world, s->renderer, def, &s->set));
}

/* Five balls on hills, and a cloud of 30,000 particles in objects of 1,000 in the file `path`. */
static inline void begin_cloud(scene *s, const char *path, vd_vec3 middle, vd_vec3 extent,
                               const vd_impostor_def *def) {
    const vd_vec3 origin = {0, 0, 0};
    const vd_particle_look look = cloud_look();
    *s = (scene){.context = test_context(2, VD_ISA_AUTO)};
    s->map = hills(s->context, origin);
    s->world = make_world(s->context, s->map, origin, 5, 3);
    vd_bricks *bricks = open_cloud(s->context, path, 30000, middle, extent, 200);
    assert_true(add_cloud(s->world, bricks, &look, 1000) > 30);
    assert_ok(vd_world_arrange(s->world, NULL));
    assert_ok(vd_world_renderer_create(s->context, NULL, s->world, NULL, &s->renderer));
    assert_ok(vd_impostors_create(s->context, s->world, s->renderer, def, &s->set));
}

static inline void begin(scene *s, int balls, const vd_impostor_def *def) {
    begin_with(s, 2, balls, def);
}

static inline void end(scene *s) {
    vd_impostors_destroy(&s->set);
    vd_world_renderer_destroy(&s->renderer);
    vd_world_destroy(&s->world);
    vd_heightfield_destroy(s->context, &s->map);
    vd_context_destroy(&s->context);
}

static inline vd_impostor_stats step(scene *s, const vd_camera *camera) {
    vd_impostor_stats stats;
    s->time_s += 1.0 / 60;
    assert_ok(vd_impostors_update(s->set, NULL, camera, WIDTH, HEIGHT, s->time_s, &stats));
    return stats;
}

static inline vd_impostor_def patient(void) {
    vd_impostor_def def = vd_impostor_def_default();
    def.budget_s = 100.0;
    def.least_reuse = 2.0;
    def.most_direct = 0;
    return def;
}

/* How often each placed object is shown: itself or as part of a picture. */
static inline void count_shown(const scene *s, uint32_t node, bool within, int *out) {
    const vd_node *n = &s->world->nodes[node];
    const uint32_t *shown = s->set->shown.data, *direct = s->set->direct.data;
    int times = within;
    for (size_t i = 0; i < s->set->shown.count; i++) {
        times += vd_impostor_slot_at(s->set, shown[i])->node == node;
    }
    for (size_t i = 0; i < s->set->direct.count; i++) {
        times += direct[i] == node;
    }
    assert_true(times <= 1);
    if (n->count == 0) {
        out[n->entry] += times;
    }
    for (uint32_t i = 0; i < n->count; i++) {
        count_shown(s, n->first + i, times > 0, out);
    }
}

/* The same by patches of the ground. */
static inline void count_on_patches(const scene *s, int *out) {
    const uint32_t *far = s->set->far.data;
    const vd_impostor_ground *g = &s->set->ground;
    for (size_t i = 0; i < s->set->far.count; i++) {
        const vd_cells cells = vd_ground_cells(
            g, vd_impostor_patch(s->set, vd_impostor_slot_at(s->set, far[i])->node));
        assert_false(s->set->any_near && vd_cells_overlap(&cells, &s->set->near));
        for (size_t n = 1; n < s->world->node_count; n++) {
            const vd_node *node = &s->world->nodes[n];
            const vd_cells at = vd_world_node_cells(g->sample_from_world, &g->map, node);
            out[node->entry] += node->count == 0 && node->grounded && vd_cells_hold(&cells, &at);
        }
    }
    const uint32_t *lines = s->set->lines.data;
    for (size_t i = 0; i < s->set->lines.count; i++) {
        out[s->world->nodes[lines[i]].entry]++;
    }
}

static inline void check_once(const scene *s, const vd_camera *camera) {
    static int times[4096];
    memset(times, 0, sizeof times);
    count_shown(s, 0, false, times);
    count_on_patches(s, times);
    const vd_frustum frustum = vd_camera_frustum(camera, WIDTH, HEIGHT);
    for (size_t i = 0; i < vd_world_object_count(s->world); i++) {
        const vd_object *object = s->world->entries[i].object;
        vd_vec3 min, max;
        vd_object_bounds(object, &min, &max);
        assert_true(times[i] <= 1);
        if (times[i] == 0 && object->kind != VD_OBJECT_TERRAIN &&
            vd_frustum_touches_box(&frustum, min, max)) {
            /* Only what a picture shows nothing of may be missing. */
            uint64_t id = object->id;
            bool empty = false;
            for (; id != 0 && !empty; id = vd_object_parent_id(id)) {
                const uint32_t node = (uint32_t)(vd_world_node(s->world, id) - s->world->nodes);
                empty = s->set->slot_of[node] != 0 &&
                        vd_impostor_slot_at(s->set, s->set->slot_of[node] - 1)->empty;
            }
            assert_true(empty);
        }
    }
}

#endif

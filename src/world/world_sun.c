/* world_sun.c: the sun on a world: what hills and things hide from it.
 *
 * Things are asked once whether hills hide the sun from them, when they are first drawn after the
 * sun has moved; those on a shadow's edge ask for every fragment. The shadows that things throw
 * stand in one map for the whole world (sun_map.h), drawn when the sun moves: no picture pays for
 * them but by looking them up.
 */
#include <string.h>
#include "core/core.h"
#include "world/world_renderer.h"

/* More casters than this throw no shadows: a map of 4096 texels would show none of them. */
#define MOST_CASTERS 262144

static bool casts(const vd_world_renderer *r, const vd_object *object) {
    return object->kind == VD_OBJECT_INSTANCE && !((const vd_instance *)object)->shadowless &&
           r->world->assets[((const vd_instance *)object)->model].draw_count > 0;
}

static const vd_heightfield *hills_of(const vd_world_renderer *r) {
    return r->world->no_terrain == NULL ? r->world->def.terrain.heightfield : NULL;
}

/* All casters as draws, in the list that pictures use, and the box around them. */
static vd_status gather_casters(vd_world_renderer *r, vd_vec3 *min, vd_vec3 *max) {
    size_t count = 0;
    r->draws.count = 0;
    for (size_t i = 0; i < r->world->entry_list.count; i++) {
        const vd_object *object = r->world->entries[i].object;
        if (!casts(r, object)) {
            continue;
        }
        if (++count > MOST_CASTERS) {
            r->draws.count = 0;
            vd_log(r->context, VD_LOG_WARNING, "more than %d things would throw shadows: none does",
                   MOST_CASTERS);
            return vd_success();
        }
        vd_vec3 low, high;
        const vd_instance *instance = (const vd_instance *)object;
        const vd_asset *model = &r->world->assets[instance->model];
        const vd_matrix place = vd_instance_place(instance, 0.0);
        vd_object_bounds(object, &low, &high);
        *min = count == 1 ? low : vd_vec3_min(*min, low);
        *max = count == 1 ? high : vd_vec3_max(*max, high);
        vd_draw *to = vd_list_add(r->context, &r->draws, (size_t)model->draw_count, sizeof *to);
        if (to == NULL) {
            return vd_out_of_memory("things that throw shadows", sizeof *to);
        }
        for (int k = 0; k < model->draw_count; k++) {
            to[k] = model->draws[k];
            to[k].world_from_mesh = place;
        }
    }
    return vd_success();
}

vd_status vd_world_sun_rise(vd_world_renderer *r, vd_job *job) {
    const vd_terrain_def *look = &r->world->def.terrain;
    const size_t entries = r->world->entry_list.count;
    if (r->sun_states == NULL) {
        r->sun_states = vd_allocate(r->context, entries + 1, sizeof *r->sun_states);
        if (r->sun_states == NULL) {
            return vd_out_of_memory("what the sun reaches", entries);
        }
    }
    memset(r->sun_states, 0, entries + 1);
    if (!look->shading || !look->shadows) {
        return vd_success();
    }
    vd_vec3 min = {0, 0, 0}, max = {0, 0, 0};
    vd_status status = gather_casters(r, &min, &max);
    if (status.code == VD_OK && r->sun_map == NULL && r->draws.count > 0) {
        status = vd_sun_map_create(r->context, &r->sun_map);
    }
    if (status.code == VD_OK && r->sun_map != NULL) {
        status = vd_sun_map_draw(r->sun_map, job, r->light.sun_direction, r->draws.data,
                                 (int)r->draws.count, min, max);
    }
    r->draws.count = 0;
    return status;
}

void vd_world_sun_aim(vd_world_renderer *r, const vd_camera *camera) {
    const vd_terrain_def *look = &r->world->def.terrain;
    vd_world_light_aim(&r->lighting, &r->light, camera, r->sun_map, hills_of(r), look->exaggeration,
                       look->curvature);
    for (int kind = VD_HILL_SHADE_LIT; kind <= VD_HILL_SHADE_MIXED; kind++) {
        r->uniforms[kind] =
            (vd_world_uniforms){.light = &r->lighting,
                                .sun_visible = kind == VD_HILL_SHADE_DARK ? 0.0f : 1.0f,
                                .mixed = kind == VD_HILL_SHADE_MIXED,
                                .receives = kind != VD_HILL_SHADE_DARK && r->sun_map != NULL};
    }
}

const vd_world_uniforms *vd_world_sun_on(vd_world_renderer *r, uint32_t entry) {
    const vd_terrain_def *look = &r->world->def.terrain;
    uint8_t *state = &r->sun_states[entry];
    if (*state == 0) {
        vd_vec3 min, max;
        float least, most;
        vd_object_bounds(r->world->entries[entry].object, &min, &max);
        const vd_heightfield *hills = look->shading && look->shadows ? hills_of(r) : NULL;
        const vd_hill_shade_kind kind =
            hills != NULL ? vd_hill_shade_box(hills, look->exaggeration, r->light.sun_direction,
                                              min, max, &least, &most)
                          : VD_HILL_SHADE_LIT;
        *state = (uint8_t)(kind + 1);
    }
    return &r->uniforms[*state - 1];
}

bool vd_world_sun_throws(const vd_world_renderer *r) {
    return r->sun_map != NULL && r->sun_map->side > 0;
}

/* world_gather.c: which objects a picture may show.
 *
 * From the root down: what lies outside the frustum, behind the terrain's horizon or is smaller
 * than a sixteenth of a pixel is left out with everything below it, before it costs anything.
 */
#include <math.h>
#include "world/world_renderer.h"

#define LEAST_PIXELS (1.0 / 16.0)

typedef struct gathering {
    vd_world_renderer *renderer;
    vd_pass *pass;
    vd_frustum frustum;
    vd_vec3 view; /* unit vector along the view axis */
} gathering;

/* Squared horizontal distances from the eye to the nearest and the farthest point of a box. */
static void distances(vd_vec3 eye, vd_vec3 min, vd_vec3 max, double *nearest, double *farthest) {
    const double x0 = min.x - eye.x, x1 = max.x - eye.x, y0 = min.y - eye.y, y1 = max.y - eye.y;
    const double nx = x0 > 0.0 ? x0 : x1 < 0.0 ? -x1 : 0.0;
    const double ny = y0 > 0.0 ? y0 : y1 < 0.0 ? -y1 : 0.0;
    const double fx = fmax(fabs(x0), fabs(x1)), fy = fmax(fabs(y0), fabs(y1));
    *nearest = nx * nx + ny * ny;
    *farthest = fx * fx + fy * fy;
}

/* Whether the box is too small to show. */
static bool is_too_small(const gathering *g, vd_vec3 min, vd_vec3 max) {
    const vd_camera *c = g->pass->camera;
    const double radius = 0.5 * vd_vec3_length(vd_vec3_subtract(max, min));
    double scale = fmax(c->lens.fx, c->lens.fy);
    if (c->projection == VD_PROJECTION_PERSPECTIVE) {
        const vd_vec3 middle = vd_vec3_scale(vd_vec3_add(min, max), 0.5);
        const double z = vd_vec3_dot(vd_vec3_subtract(middle, c->eye), g->view) - radius;
        if (!(z > c->near_m)) {
            return false;
        }
        scale /= z;
    }
    return 2.0 * radius * scale < LEAST_PIXELS;
}

static vd_status gather(const gathering *g, const vd_node *node);

static vd_status gather_placed(const gathering *g, const vd_node *node) {
    const vd_entry *entry = &g->renderer->world->entries[node->entry];
    g->pass->stats->drawn++;
    g->pass->uniforms = vd_world_sun_on(g->renderer, node->entry);
    return vd_object_kinds[entry->object->kind]->draw(g->pass, entry->object, entry->live);
}

static vd_status gather(const gathering *g, const vd_node *node) {
    const vd_world *world = g->renderer->world;
    vd_world_stats *stats = g->pass->stats;
    const bool placed = node->count == 0;
    const vd_object_kind kind =
        placed ? (vd_object_kind)world->entries[node->entry].object->kind : VD_OBJECT_GROUP;
    if (kind == VD_OBJECT_TERRAIN) {
        return gather_placed(g, node);
    }
    double nearest, farthest;
    vd_vec3 min = node->min, max = node->max;
    distances(g->pass->camera->eye, min, max, &nearest, &farthest);
    min.z -= g->pass->drop_per_m2 * farthest;
    max.z -= g->pass->drop_per_m2 * nearest;
    uint64_t *why = NULL;
    if (!vd_frustum_touches_box(&g->frustum, min, max)) {
        why = &stats->outside;
    } else if (!node->names && is_too_small(g, min, max)) {
        why = &stats->too_small;
    } else if (!node->names && g->pass->horizon != NULL &&
               vd_horizon_hides(g->pass->horizon, min, max)) {
        why = &stats->hidden;
    }
    if (why != NULL) {
        *why += node->placed;
        return vd_success();
    }
    if (placed) {
        return gather_placed(g, node);
    }
    vd_status status = vd_success();
    for (uint32_t i = 0; i < node->count && status.code == VD_OK; i++) {
        status = gather(g, &world->nodes[node->first + i]);
    }
    return status;
}

vd_status vd_world_gather(vd_world_renderer *renderer, vd_pass *pass, const vd_node *from) {
    gathering g = {.renderer = renderer, .pass = pass};
    const vd_camera *camera = pass->camera;
    g.frustum = vd_camera_frustum(camera, pass->width, pass->height);
    g.view = vd_quat_rotate(camera->orientation, vd_vec3_make(0, 0, 1));
    pass->stats->objects = from->placed;
    vd_status status = vd_success();
    if (from != renderer->world->nodes) {
        return gather(&g, from);
    }
    for (uint32_t i = 0; i < from->count && status.code == VD_OK; i++) {
        status = gather(&g, &renderer->world->nodes[from->first + i]);
    }
    return status;
}

vd_status vd_world_gather_placed(vd_world_renderer *renderer, vd_pass *pass, const uint32_t *nodes,
                                 size_t count) {
    const gathering g = {.renderer = renderer, .pass = pass};
    vd_status status = vd_success();
    for (size_t i = 0; i < count && status.code == VD_OK; i++) {
        status = gather_placed(&g, &renderer->world->nodes[nodes[i]]);
    }
    return status;
}

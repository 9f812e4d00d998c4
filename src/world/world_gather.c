/* world_gather.c: which objects a picture may show.
 *
 * From the root down: what lies outside the frustum, behind the terrain's horizon or is smaller
 * than a sixteenth of a pixel is left out with everything below it, before it costs anything; and
 * so is what does not stand on the ground that the picture is of, if it is of a piece of it.
 */
#include <math.h>
#include "terrain/heightfield_block.h"
#include "world/world_renderer.h"

#define LEAST_PIXELS (1.0 / 16.0)

typedef struct gathering {
    vd_world_renderer *renderer;
    vd_pass *pass;
    vd_frustum frustum;
    vd_vec3 view;             /* unit vector along the view axis */
    const vd_cells *standing; /* null: anywhere */
    vd_cells map;
    double sample_from_world[6];
} gathering;

static int clamp_cell(double at, int first, int last) {
    return at >= (double)last ? last : at > (double)first ? (int)floor(at) : first;
}

void vd_world_cell(const double m[6], const vd_cells *map, double x, double y, int *column,
                   int *row) {
    *column = clamp_cell(m[0] + x * m[1] + y * m[2], map->c0, map->c1);
    *row = clamp_cell(m[3] + x * m[4] + y * m[5], map->r0, map->r1);
}

bool vd_world_cells(const vd_world_renderer *renderer, vd_cells *out) {
    const vd_terrain_def *t = &renderer->world->def.terrain;
    if (renderer->horizon_map == NULL || t->heightfield->wraps != 0) {
        return false;
    }
    const vd_terrain_window all = {0, 0, t->heightfield->width - 1, t->heightfield->height - 1};
    const vd_terrain_window w = t->window.columns > 0 ? t->window : all;
    *out = (vd_cells){w.column, w.row, w.column + w.columns - 1, w.row + w.rows - 1};
    return true;
}

vd_cells vd_world_node_cells(const double sample_from_world[6], const vd_cells *map,
                             const vd_node *node) {
    vd_cells at = {0, 0, 0, 0};
    int c, r;
    if (node->count == 0) {
        vd_world_cell(sample_from_world, map, 0.5 * (node->min.x + node->max.x),
                      0.5 * (node->min.y + node->max.y), &c, &r);
        return (vd_cells){c, r, c, r};
    }
    for (int i = 0; i < 4; i++) {
        vd_world_cell(sample_from_world, map, (i & 1) != 0 ? node->max.x : node->min.x,
                      (i & 2) != 0 ? node->max.y : node->min.y, &c, &r);
        at.c0 = i == 0 || c < at.c0 ? c : at.c0;
        at.c1 = i == 0 || c > at.c1 ? c : at.c1;
        at.r0 = i == 0 || r < at.r0 ? r : at.r0;
        at.r1 = i == 0 || r > at.r1 ? r : at.r1;
    }
    return at;
}

/* Whether something below or here may stand on the cells asked for. */
static bool may_stand(const gathering *g, const vd_node *node) {
    const vd_cells at = vd_world_node_cells(g->sample_from_world, &g->map, node);
    const vd_cells *in = g->standing;
    return at.c0 <= in->c1 && at.c1 >= in->c0 && at.r0 <= in->r1 && at.r1 >= in->r0;
}

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
    if (node->kind == VD_OBJECT_TERRAIN) {
        return gather_placed(g, node);
    }
    if (g->standing != NULL && (!node->grounded || !may_stand(g, node))) {
        return vd_success();
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

vd_status vd_world_gather(vd_world_renderer *renderer, vd_pass *pass, const vd_node *from,
                          const vd_cells *standing) {
    gathering g = {.renderer = renderer, .pass = pass, .standing = standing};
    if (standing != NULL &&
        !(vd_world_cells(renderer, &g.map) &&
          vd_heightfield_invert(renderer->world->def.terrain.heightfield->world_from_sample,
                                g.sample_from_world))) {
        return vd_failure(VD_ERROR_ARGUMENT, "a terrain without cells has none to stand on");
    }
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

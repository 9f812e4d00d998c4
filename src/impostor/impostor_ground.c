#include "impostor/impostor_ground.h"

#include <math.h>
#include <string.h>
#include "core/core.h"
#include "terrain/heightfield_block.h"

/* The most leaves: with the levels above they take 42 MiB. */
#define MOST_LEAVES (1 << 19)

static void lay_out(vd_impostor_ground *g) {
    const int columns = g->map.c1 - g->map.c0 + 1, rows = g->map.r1 - g->map.r0 + 1;
    g->side = 1;
    while (((columns + g->side - 1) / g->side) * (double)((rows + g->side - 1) / g->side) >
           MOST_LEAVES) {
        g->side *= 2;
    }
    g->levels = 0;
    g->count = 0;
    int c = (columns + g->side - 1) / g->side, r = (rows + g->side - 1) / g->side;
    for (;;) {
        g->columns[g->levels] = c;
        g->rows[g->levels] = r;
        g->first[g->levels++] = g->count;
        g->count += (uint32_t)(c * r);
        if ((c == 1 && r == 1) || g->levels == VD_GROUND_LEVELS) {
            return;
        }
        c = (c + 1) / 2;
        r = (r + 1) / 2;
    }
}

vd_cells vd_ground_cells(const vd_impostor_ground *g, uint32_t patch) {
    const vd_patch *p = &g->patches[patch];
    const int side = g->side << p->level;
    vd_cells in = {g->map.c0 + p->column * side, g->map.r0 + p->row * side, 0, 0};
    in.c1 = in.c0 + side - 1 < g->map.c1 ? in.c0 + side - 1 : g->map.c1;
    in.r1 = in.r0 + side - 1 < g->map.r1 ? in.r0 + side - 1 : g->map.r1;
    return in;
}

static void place_of(const vd_impostor_ground *g, double c, double r, double *x, double *y) {
    const double *m = g->world_from_sample;
    *x = m[0] + c * m[1] + r * m[2];
    *y = m[3] + c * m[4] + r * m[5];
}

static void extend(vd_patch *p, const double low[3], const double high[3]) {
    for (int i = 0; i < 3; i++) {
        /* Rounded outwards. */
        const float l = nextafterf((float)low[i], -INFINITY),
                    h = nextafterf((float)high[i], INFINITY);
        p->min[i] = l < p->min[i] ? l : p->min[i];
        p->max[i] = h > p->max[i] ? h : p->max[i];
    }
}

static vd_patch nothing(int level, int column, int row) {
    vd_patch p = {.level = (uint16_t)level, .column = (uint16_t)column, .row = (uint16_t)row};
    for (int i = 0; i < 3; i++) {
        p.min[i] = INFINITY;
        p.max[i] = -INFINITY;
    }
    return p;
}

static bool is_empty(const vd_patch *p) {
    return !(p->min[0] <= p->max[0]);
}

void vd_ground_box(const vd_impostor_ground *g, const vd_world_renderer *renderer,
                   const vd_cells *cells, vd_vec3 *min, vd_vec3 *max) {
    const double scale = renderer->world->def.terrain.exaggeration;
    double low = (double)vd_horizon_lowest(renderer->horizon_map, *cells);
    const double high = (double)vd_horizon_highest(renderer->horizon_map, *cells);
    if (!(high > -INFINITY)) {
        return;
    }
    if (!(low > -INFINITY)) { /* beside a hole */
        low = (double)renderer->world->def.terrain.heightfield->min;
    }
    for (int i = 0; i < 4; i++) {
        double x, y;
        place_of(g, (i & 1) != 0 ? cells->c1 + 1 : cells->c0,
                 (i & 2) != 0 ? cells->r1 + 1 : cells->r0, &x, &y);
        *min = vd_vec3_min(*min, vd_vec3_make(x, y, low * scale));
        *max = vd_vec3_max(*max, vd_vec3_make(x, y, high * scale));
    }
}

static void add_ground(const vd_impostor_ground *g, const vd_world_renderer *renderer,
                       uint32_t leaf) {
    const vd_cells in = vd_ground_cells(g, leaf);
    vd_vec3 min = vd_vec3_make(INFINITY, INFINITY, INFINITY), max = vd_vec3_scale(min, -1.0);
    vd_ground_box(g, renderer, &in, &min, &max);
    if (min.x <= max.x) {
        min = vd_vec3_subtract(min, g->anchor);
        max = vd_vec3_subtract(max, g->anchor);
        extend(&g->patches[leaf], (const double[3]){min.x, min.y, min.z},
               (const double[3]){max.x, max.y, max.z});
    }
}

static void add_objects(const vd_impostor_ground *g, const vd_world *world) {
    for (size_t i = 0; i < world->node_count; i++) {
        const vd_node *node = &world->nodes[i];
        if (i == 0 || node->count > 0 || !node->grounded || node->kind == VD_OBJECT_TERRAIN) {
            continue;
        }
        const vd_cells at = vd_world_node_cells(g->sample_from_world, &g->map, node);
        const vd_vec3 min = vd_vec3_subtract(node->min, g->anchor);
        const vd_vec3 max = vd_vec3_subtract(node->max, g->anchor);
        vd_patch *p = &g->patches[vd_ground_number(g, 0, (at.c0 - g->map.c0) / g->side,
                                                   (at.r0 - g->map.r0) / g->side)];
        extend(p, (const double[3]){min.x, min.y, min.z}, (const double[3]){max.x, max.y, max.z});
        p->placed++;
    }
}

/* Children as they lie, without order. */
static int children_of(const vd_impostor_ground *g, const vd_patch *p, uint32_t out[4]) {
    int count = 0;
    for (int i = 0; i < 4 && p->level > 0; i++) {
        const int c = 2 * p->column + (i & 1), r = 2 * p->row + (i >> 1);
        if (c < g->columns[p->level - 1] && r < g->rows[p->level - 1]) {
            out[count++] = vd_ground_number(g, p->level - 1, c, r);
        }
    }
    return count;
}

int vd_ground_children(const vd_impostor_ground *g, uint32_t patch, double u, double v,
                       uint32_t out[4]) {
    const vd_patch *p = &g->patches[patch];
    const int count = children_of(g, p, out), side = g->side << p->level >> 1;
    const int near_column = 2 * p->column + (u >= g->map.c0 + (2 * p->column + 1) * side);
    const int near_row = 2 * p->row + (v >= g->map.r0 + (2 * p->row + 1) * side);
    int away[4] = {0};
    for (int i = 0; i < count; i++) {
        const vd_patch *child = &g->patches[out[i]];
        const int far = (child->column != near_column) + (child->row != near_row);
        const uint32_t number = out[i];
        int at = i;
        for (; at > 0 && away[at - 1] < far; at--) {
            out[at] = out[at - 1];
            away[at] = away[at - 1];
        }
        out[at] = number;
        away[at] = far;
    }
    return count;
}

static int add_corners(const vd_impostor_ground *g, const vd_patch *p, double drop, vd_vec3 *out) {
    if (is_empty(p)) {
        return 0;
    }
    for (int i = 0; i < 8; i++) {
        out[i] = vd_vec3_make(g->anchor.x + (double)((i & 1) != 0 ? p->max : p->min)[0],
                              g->anchor.y + (double)((i & 2) != 0 ? p->max : p->min)[1],
                              g->anchor.z + (double)((i & 4) != 0 ? p->max : p->min)[2] - drop);
    }
    return 8;
}

int vd_ground_key_points(const vd_impostor_ground *g, uint32_t patch, double drop,
                         vd_vec3 out[VD_GROUND_POINTS]) {
    uint32_t children[4];
    const vd_patch *p = &g->patches[patch];
    const int count = children_of(g, p, children);
    int points = count == 0 ? add_corners(g, p, drop, out) : 0;
    for (int i = 0; i < count; i++) {
        points += add_corners(g, &g->patches[children[i]], drop, out + points);
    }
    return points;
}

/* The plane through the ground's corners, and how far everything is from it. */
static void find_plane(const vd_impostor_ground *g, const vd_world *world, uint32_t patch) {
    vd_patch *p = &g->patches[patch];
    const vd_cells in = vd_ground_cells(g, patch);
    vd_vec3 at[4], points[VD_GROUND_POINTS];
    for (int i = 0; i < 4; i++) {
        place_of(g, (i & 1) != 0 ? in.c1 + 1 : in.c0, (i & 2) != 0 ? in.r1 + 1 : in.r0, &at[i].x,
                 &at[i].y);
        at[i].z = vd_world_ground(world, at[i].x, at[i].y);
        at[i].z = at[i].z > -INFINITY ? at[i].z : g->anchor.z + (double)p->min[2];
    }
    vd_vec3 normal = vd_vec3_normalize(
        vd_vec3_cross(vd_vec3_subtract(at[3], at[0]), vd_vec3_subtract(at[1], at[2])));
    normal = normal.z < 0.0 ? vd_vec3_scale(normal, -1.0) : normal;
    const vd_vec3 middle =
        vd_vec3_add(g->anchor, vd_vec3_make(0.5 * ((double)p->min[0] + (double)p->max[0]),
                                            0.5 * ((double)p->min[1] + (double)p->max[1]),
                                            0.5 * ((double)p->min[2] + (double)p->max[2])));
    double low = INFINITY, high = -INFINITY;
    const int count = vd_ground_key_points(g, patch, 0.0, points);
    for (int i = 0; i < count; i++) {
        const double off = vd_vec3_dot(vd_vec3_subtract(points[i], middle), normal);
        low = off < low ? off : low;
        high = off > high ? off : high;
    }
    p->normal[0] = (float)normal.x, p->normal[1] = (float)normal.y, p->normal[2] = (float)normal.z;
    p->middle = (float)(0.5 * (low + high));
    p->half = (float)(0.5 * (high - low));
}

static void settle(vd_impostor_ground *g, const vd_world *world) {
    for (uint32_t i = 0; i < g->count; i++) {
        vd_patch *p = &g->patches[i];
        uint32_t children[4];
        const int count = children_of(g, p, children);
        for (int k = 0; k < count; k++) {
            const vd_patch *child = &g->patches[children[k]];
            p->placed += child->placed;
            for (int axis = 0; axis < 3; axis++) {
                p->min[axis] = child->min[axis] < p->min[axis] ? child->min[axis] : p->min[axis];
                p->max[axis] = child->max[axis] > p->max[axis] ? child->max[axis] : p->max[axis];
            }
        }
        if (!is_empty(p)) {
            find_plane(g, world, i);
        }
    }
}

vd_status vd_impostor_ground_init(vd_context *context, const vd_world_renderer *renderer,
                                  vd_impostor_ground *out) {
    const vd_world *world = renderer->world;
    vd_impostor_ground g;
    memset(&g, 0, sizeof g);
    memset(out, 0, sizeof *out);
    if (!vd_world_cells(renderer, &g.map) ||
        !vd_heightfield_invert(world->def.terrain.heightfield->world_from_sample,
                               g.sample_from_world)) {
        return vd_success();
    }
    memcpy(g.world_from_sample, world->def.terrain.heightfield->world_from_sample,
           sizeof g.world_from_sample);
    lay_out(&g);
    vd_vec3 high;
    vd_heightfield_bounds(world->def.terrain.heightfield, &g.anchor, &high);
    g.anchor = vd_vec3_scale(vd_vec3_add(g.anchor, high), 0.5);
    g.patches = vd_allocate(context, g.count, sizeof *g.patches);
    if (g.patches == NULL) {
        return vd_out_of_memory("the ground's patches", g.count * sizeof *g.patches);
    }
    for (int level = 0; level < g.levels; level++) {
        for (int i = 0; i < g.columns[level] * g.rows[level]; i++) {
            g.patches[g.first[level] + (uint32_t)i] =
                nothing(level, i % g.columns[level], i / g.columns[level]);
        }
    }
    for (int i = 0; i < g.columns[0] * g.rows[0]; i++) {
        add_ground(&g, renderer, (uint32_t)i);
    }
    add_objects(&g, world);
    settle(&g, world);
    *out = g;
    return vd_success();
}

void vd_impostor_ground_finish(vd_context *context, vd_impostor_ground *ground) {
    vd_release(context, ground->patches);
    ground->patches = NULL;
}

bool vd_ground_may_hide(const vd_cells *a, const vd_cells *b, double u, double v) {
    return !((a->c0 > b->c1 && u <= a->c0) || (a->c1 < b->c0 && u >= a->c1 + 1) ||
             (a->r0 > b->r1 && v <= a->r0) || (a->r1 < b->r0 && v >= a->r1 + 1));
}

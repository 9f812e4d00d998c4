/* impostor_placed.c: what a client draws itself, out of what would be in the picture in front.
 *
 *      direct ──► instances of models ──► chosen, nearest first ──► front drawn without them
 *                 that fit the budget        ▲                              │ its depth
 *                                            └── not those that it hides ◄──┘
 *
 * The client has no ground and no shadows. So an instance is chosen only where next to nothing of
 * it is hidden by what is in front of it; it brings the plane of the ground that it stands on, and
 * its share of the sun. A model goes over once, with the first of its instances. Particles are
 * chosen in the same way, in impostor_bricks.c.
 */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "core/core.h"
#include "impostor/impostor_placed.h"

/* Models above that are left in the picture in front. */
#define MOST_MODEL_BYTES ((size_t)4 << 20)

/* Instances of an order. */
#define MOST_CHOSEN 512

/* Vertices that are looked at. */
#define VERTICES 96

/* What was left is not looked at again before the eye has moved by this share of the distance. */
#define MOVED 0.1

static const vd_entry *entry_of(const vd_impostors *set, uint32_t node) {
    return &set->world->entries[set->world->nodes[node].entry];
}

/* The number of the model of a node; false when it is none, or one that no client is to draw. */
static bool model_of(const vd_impostors *set, uint32_t node, uint32_t *number) {
    const vd_node *n = &set->world->nodes[node];
    if (n->count != 0 || n->kind != VD_OBJECT_INSTANCE || vd_impostor_is_skipped(set, node)) {
        return false;
    }
    *number = ((const vd_instance *)entry_of(set, node)->object)->model;
    if (set->placing.models == NULL) {
        return set->world->assets[*number].draw_count > 0;
    }
    vd_impostor_model *model = &set->placing.models[*number];
    const vd_asset *asset = &set->world->assets[*number];
    if (asset->draw_count > 0 && model->bytes == 0) {
        model->bytes = vd_model_packed_bytes(asset->model);
    }
    return asset->draw_count > 0 && !model->refused && model->bytes <= MOST_MODEL_BYTES &&
           model->bytes <= set->def.placed_bytes / 2;
}

static bool draws_models(const vd_impostors *set) {
    return set->def.placed_bytes > 0 && set->def.placed_triangles > 0 &&
           set->world->def.terrain.shading;
}

bool vd_impostors_may_place(const vd_impostors *set, uint32_t node) {
    uint32_t number;
    const vd_node *n = &set->world->nodes[node];
    const bool particles = set->def.placed_bytes > 0 && set->def.placed_particles > 0;
    if (n->count > 0) { /* a group is as its parts are */
        return particles && n->clouds;
    }
    const bool cloud = particles && n->kind == VD_OBJECT_PARTICLES;
    if (!cloud && (!draws_models(set) || !model_of(set, node, &number))) {
        return false;
    }
    const uint32_t stand = set->placing.stand_of != NULL ? set->placing.stand_of[node] : 0;
    return stand == 0 || !vd_impostor_stand_at(set, stand - 1)->left;
}

/* ---- where an instance stands, and in what light ----------------------------------------------*/

/* Vertices spread over a model's triangles, in the world. */
typedef struct sampling {
    const vd_mesh *mesh;
    vd_matrix place, normal;
    uint32_t step;
} sampling;

static sampling sample(const vd_asset *asset, const vd_matrix *place) {
    const vd_mesh *mesh = asset->draws[0].mesh;
    const uint32_t step = mesh->vertex_count / VERTICES;
    return (sampling){mesh, *place, vd_matrix_normal(place), step > 0 ? step : 1};
}

static vd_vec3 vertex_at(const sampling *s, uint32_t vertex) {
    const vd_vec3 p = {(double)vd_mesh_positions(s->mesh, 0)[vertex],
                       (double)vd_mesh_positions(s->mesh, 1)[vertex],
                       (double)vd_mesh_positions(s->mesh, 2)[vertex]};
    return vd_matrix_transform(&s->place, vd_vec3_add(s->mesh->anchor, p));
}

/* How a vertex's side lies to the sun: the cosine, 1 for a mesh without normals. */
static double facing(const sampling *s, uint32_t vertex, vd_vec3 sun, vd_vec3 *normal) {
    *normal = sun;
    if (s->mesh->normal < 0) {
        return 1.0;
    }
    const float *n =
        vd_mesh_attributes(s->mesh, s->mesh->normal / 4) + 4 * (size_t)vertex + s->mesh->normal % 4;
    const vd_vec3 there =
        vd_matrix_transform(&s->normal, vd_vec3_make((double)n[0], (double)n[1], (double)n[2]));
    const double length = vd_vec3_length(there);
    *normal = length > 0.0 ? vd_vec3_scale(there, 1.0 / length) : sun;
    return vd_vec3_dot(*normal, sun);
}

/* The share of the sun that reaches what faces it. */
static float sun_on(vd_impostors *set, uint32_t node, const sampling *s) {
    vd_world_renderer *r = set->renderer;
    const vd_world_uniforms *u = vd_world_sun_on(r, set->world->nodes[node].entry);
    const vd_sun_map *map =
        u->receives && r->sun_map != NULL && r->sun_map->side > 0 ? r->sun_map : NULL;
    const vd_terrain_def *look = &set->world->def.terrain;
    const vd_vec3 sun = r->light.sun_direction;
    double sum = 0.0, all = 0.0;
    for (uint32_t i = 0; i < s->mesh->vertex_count && (map != NULL || u->mixed); i += s->step) {
        vd_vec3 normal, at = vertex_at(s, i);
        const double cosine = facing(s, i, sun, &normal);
        if (!(cosine > 0.0)) {
            continue;
        }
        double share = (double)u->sun_visible;
        if (u->mixed && look->heightfield != NULL) {
            share = (double)vd_hill_shade(look->heightfield, look->exaggeration, sun, at);
        }
        if (map != NULL && share > 0.0) {
            const float sine = (float)sqrt(fmax(1.0 - cosine * cosine, 0.0));
            const double lift = (double)vd_sun_map_lift(map, 1.0f, sine);
            float place[3];
            vd_sun_map_place(map, vd_vec3_add(at, vd_vec3_scale(normal, lift)), place);
            share *= (double)vd_sun_map_share(map, place, map->texel_m);
        }
        sum += cosine * share;
        all += cosine;
    }
    return all > 0.0 ? (float)fmin(sum / all, 1.0) : u->sun_visible;
}

/* The plane of the ground under a box, if some of the ground is above its foot. */
static void stand_on_ground(const vd_impostors *set, vd_vec3 min, vd_vec3 max, double drop,
                            vd_place *place) {
    const vd_world *world = set->world;
    const double x = 0.5 * (min.x + max.x), y = 0.5 * (min.y + max.y);
    const double across = fmax(0.5 * (max.x - min.x), 0.01);
    const double along = fmax(0.5 * (max.y - min.y), 0.01);
    if (!vd_impostors_shown_in_front(set) || world->no_terrain != NULL) {
        return;
    }
    const double at[5] = {vd_world_ground(world, x, y), vd_world_ground(world, x - across, y),
                          vd_world_ground(world, x + across, y),
                          vd_world_ground(world, x, y - along),
                          vd_world_ground(world, x, y + along)};
    double highest = at[0], sum = 0.0;
    for (int i = 0; i < 5; i++) {
        highest = fmax(highest, at[i]);
        sum += at[i];
    }
    if (!isfinite(sum) || highest < min.z) {
        return;
    }
    const double east = (at[2] - at[1]) / (2.0 * across), north = (at[4] - at[3]) / (2.0 * along);
    const double middle = 0.2 * sum - drop;
    place->has_ground = true;
    place->ground[0] = (float)(middle + east * (place->origin.x - x) +
                               north * (place->origin.y - y) - place->origin.z);
    place->ground[1] = (float)east;
    place->ground[2] = (float)north;
}

static void place_stand(vd_impostors *set, const vd_impostor_view *view, vd_impostor_stand *stand) {
    const vd_object *object = entry_of(set, stand->node)->object;
    const vd_instance *instance = (const vd_instance *)object;
    const double x = object->anchor.x - view->camera.eye.x;
    const double y = object->anchor.y - view->camera.eye.y;
    const double drop = view->drop_per_m2 * (x * x + y * y);
    const vd_matrix place = vd_instance_place(instance, drop);
    const sampling s = sample(&set->world->assets[instance->model], &place);
    vd_vec3 min, max;
    vd_world_sun_aim(set->renderer, &view->camera);
    stand->place.origin = vd_vec3_make(place.m[0][3], place.m[1][3], place.m[2][3]);
    for (int r = 0; r < 3; r++) {
        for (int c = 0; c < 3; c++) {
            stand->place.axes[c][r] = (float)place.m[r][c];
        }
    }
    vd_object_bounds(object, &min, &max);
    min.z -= drop;
    stand->place.sun = sun_on(set, stand->node, &s);
    stand_on_ground(set, min, max, drop, &stand->place);
    stand->version = ++set->versions;
}

/* ---- choosing ---------------------------------------------------------------------------------*/

vd_status vd_impostors_begin_placing(vd_impostors *set) {
    vd_impostor_placing *p = &set->placing;
    const size_t models = vd_world_asset_count(set->world), nodes = set->world->node_count;
    if (p->models == NULL) {
        p->models = vd_allocate_zero(set->context, models, sizeof *p->models);
    }
    if (p->stand_of == NULL) {
        p->stand_of = vd_allocate_zero(set->context, nodes, sizeof *p->stand_of);
    }
    return p->models != NULL && p->stand_of != NULL
               ? vd_success()
               : vd_out_of_memory("what a client draws", nodes * sizeof *p->stand_of);
}

vd_impostor_stand *vd_impostor_stand_of(vd_impostors *set, uint32_t node, bool *made) {
    vd_impostor_placing *p = &set->placing;
    *made = p->stand_of[node] == 0;
    if (*made) {
        vd_impostor_stand *to = vd_list_add(set->context, &p->stands, 1, sizeof *to);
        if (to == NULL) {
            return NULL;
        }
        *to = (vd_impostor_stand){.node = node};
        p->stand_of[node] = (uint32_t)p->stands.count;
    }
    return vd_impostor_stand_at(set, p->stand_of[node] - 1);
}

/* Balls around both are compared. */
bool vd_impostor_is_behind_picture(const vd_impostors *set, const vd_impostor_view *view,
                                   const vd_node *node, double distance) {
    const uint32_t *shown = set->shown.data;
    const vd_vec3 eye = view->camera.eye;
    const vd_vec3 a = vd_vec3_subtract(vd_vec3_scale(vd_vec3_add(node->min, node->max), 0.5), eye);
    const double a_radius = 0.5 * vd_vec3_length(vd_vec3_subtract(node->max, node->min));
    for (size_t i = 0; i < set->shown.count; i++) {
        vd_vec3 min, max;
        const uint32_t other = vd_impostor_slot_at(set, shown[i])->node;
        if (!vd_impostor_is_patch(set, other) && set->world->nodes[other].loose &&
            !set->world->nodes[other].grounded && node->loose) {
            continue;
        }
        vd_impostor_bounds(set, view, other, &min, &max);
        const vd_vec3 b = vd_vec3_subtract(vd_vec3_scale(vd_vec3_add(min, max), 0.5), eye);
        const double radius = 0.5 * vd_vec3_length(vd_vec3_subtract(max, min));
        const double away = vd_vec3_length(b);
        if (away - radius < distance + a_radius &&
            vd_vec3_length(vd_vec3_subtract(vd_vec3_scale(a, 1.0 / fmax(distance, 1e-6)),
                                            vd_vec3_scale(b, 1.0 / fmax(away, 1e-6)))) <
                a_radius / fmax(distance, 1e-6) + radius / fmax(away, 1e-6)) {
            return true;
        }
    }
    return false;
}

void vd_impostor_leave(vd_impostor_stand *stand, vd_vec3 eye) {
    stand->left = true;
    stand->left_from = eye;
}

bool vd_impostor_was_left(vd_impostor_stand *stand, vd_vec3 eye) {
    const double moved = vd_vec3_length(vd_vec3_subtract(eye, stand->left_from));
    stand->left = stand->left && moved < MOVED * stand->distance;
    return stand->left;
}

static void give_up_model(vd_impostors *set, uint32_t number) {
    vd_impostor_model *model = &set->placing.models[number];
    model->gone = true;
    model->delivered = false;
}

/* Gives up what the order does not need, so that there is room later: the client has it until it is
 * told. */
static void give_up_unused(vd_impostors *set) {
    vd_impostor_placing *p = &set->placing;
    for (uint32_t i = 0; i < p->stands.count; i++) {
        vd_impostor_stand *stand = vd_impostor_stand_at(set, i);
        if (stand->delivered && !stand->chosen) {
            stand->gone = true;
            stand->delivered = false;
        }
    }
    for (uint32_t i = 0; i < vd_world_asset_count(set->world); i++) {
        if (p->models[i].delivered && p->models[i].used != set->update) {
            give_up_model(set, i);
        }
    }
    vd_impostors_give_up_bricks(set);
}

/* Whether a stand fits with what was chosen before it; what does not fit later either is left. */
static bool fits(vd_impostors *set, vd_vec3 eye, vd_impostor_spent *spent, vd_impostor_stand *stand,
                 uint32_t number) {
    vd_impostor_model *model = &set->placing.models[number];
    const bool fresh = !model->delivered && model->used != set->update;
    const size_t bytes =
        (stand->delivered ? 0 : VD_IMPOSTOR_INSTANCE_BYTES) + (fresh ? model->bytes : 0);
    const uint64_t triangles = spent->triangles + set->world->assets[number].triangles;
    const bool late =
        fresh &&
        (model->gone || (spent->fresh > 0 && spent->fresh + model->bytes > VD_IMPOSTOR_TURN_BYTES));
    const bool full = spent->bytes + bytes > set->def.placed_bytes;
    spent->full = spent->full || full;
    if (full || triangles > set->def.placed_triangles) {
        vd_impostor_leave(stand, eye);
    }
    if (late || stand->gone || stand->left) {
        return false;
    }
    spent->triangles = triangles;
    spent->bytes += bytes;
    spent->fresh += fresh ? model->bytes : 0;
    model->used = set->update;
    return true;
}

static int compare_ranks(const void *a, const void *b) {
    const vd_impostor_rank *x = a, *y = b;
    return x->distance2 != y->distance2
               ? (x->distance2 > y->distance2) - (x->distance2 < y->distance2)
               : (x->slot > y->slot) - (x->slot < y->slot);
}

vd_status vd_impostors_rank_placed(const vd_impostors *set, const vd_impostor_view *view,
                                   vd_object_kind kind, vd_list *ranks) {
    const uint32_t *direct = set->direct.data;
    for (size_t i = 0; i < set->direct.count; i++) {
        const vd_node *node = &set->world->nodes[direct[i]];
        if (node->kind != kind) {
            continue;
        }
        vd_impostor_rank *to = vd_list_add(set->context, ranks, 1, sizeof *to);
        if (to == NULL) {
            return vd_out_of_memory("what a client draws", sizeof *to);
        }
        const vd_vec3 way = vd_vec3_subtract(vd_vec3_scale(vd_vec3_add(node->min, node->max), 0.5),
                                             view->camera.eye);
        *to = (vd_impostor_rank){vd_vec3_dot(way, way), direct[i]};
    }
    if (ranks->count > 1) {
        qsort(ranks->data, ranks->count, sizeof(vd_impostor_rank), compare_ranks);
    }
    return vd_success();
}

static vd_status choose(vd_impostors *set, const vd_impostor_view *view, vd_impostor_spent *spent,
                        const vd_impostor_rank *rank) {
    vd_impostor_placing *p = &set->placing;
    const uint32_t node = rank->slot;
    uint32_t number = 0;
    bool made = false;
    if (!model_of(set, node, &number)) {
        return vd_success();
    }
    vd_impostor_stand *stand = vd_impostor_stand_of(set, node, &made);
    if (stand == NULL) {
        return vd_out_of_memory("what a client draws", sizeof *stand);
    }
    if (made) {
        place_stand(set, view, stand);
    }
    stand->distance = sqrt(rank->distance2);
    const vd_vec3 eye = view->camera.eye;
    if (vd_impostor_was_left(stand, eye)) {
        return vd_success();
    }
    if (p->chosen.count >= MOST_CHOSEN ||
        vd_impostor_is_behind_picture(set, view, &set->world->nodes[node], stand->distance)) {
        vd_impostor_leave(stand, eye);
        return vd_success();
    }
    if (!fits(set, eye, spent, stand, number)) {
        return vd_success();
    }
    uint32_t *to = vd_list_add(set->context, &p->chosen, 1, sizeof *to);
    if (to == NULL) {
        return vd_out_of_memory("what a client draws", sizeof *to);
    }
    *to = (uint32_t)(stand - (vd_impostor_stand *)p->stands.data);
    stand->chosen = true;
    return vd_success();
}

/* Leaves out of `direct` what is chosen. */
static void take_out(vd_impostors *set) {
    const vd_impostor_placing *p = &set->placing;
    uint32_t *direct = set->direct.data;
    size_t kept = 0;
    for (size_t i = 0; i < set->direct.count; i++) {
        const uint32_t stand = p->stand_of[direct[i]];
        if (stand == 0 || !vd_impostor_stand_at(set, stand - 1)->chosen) {
            direct[kept++] = direct[i];
        }
    }
    set->direct.count = kept;
}

static vd_status choose_models(vd_impostors *set, const vd_impostor_view *view,
                               vd_impostor_spent *spent) {
    vd_list ranks = {.data = NULL};
    vd_status status = vd_impostors_rank_placed(set, view, VD_OBJECT_INSTANCE, &ranks);
    for (size_t i = 0; i < ranks.count && status.code == VD_OK; i++) {
        status = choose(set, view, spent, (const vd_impostor_rank *)ranks.data + i);
    }
    vd_release(set->context, ranks.data);
    return status;
}

static vd_status keep_direct(vd_impostors *set) {
    vd_list *before = &set->placing.before;
    const size_t count = set->direct.count;
    before->count = 0;
    uint32_t *to = count > 0 ? vd_list_add(set->context, before, count, sizeof *to) : NULL;
    if (count > 0 && to == NULL) {
        return vd_out_of_memory("what a client draws", count * sizeof *to);
    }
    if (count > 0) {
        memcpy(to, set->direct.data, count * sizeof *to);
    }
    return vd_success();
}

vd_status vd_impostors_choose_placed(vd_impostors *set, const vd_impostor_view *view) {
    vd_impostor_placing *p = &set->placing;
    vd_impostor_spent spent = {.bytes = p->bytes};
    if (set->def.placed_bytes == 0) {
        return vd_success();
    }
    vd_status status = vd_impostors_begin_placing(set);
    if (status.code == VD_OK) {
        status = keep_direct(set);
    }
    for (uint32_t i = 0; i < p->stands.count; i++) {
        vd_impostor_stand_at(set, i)->chosen = false;
    }
    p->chosen.count = 0;
    if (status.code == VD_OK && draws_models(set)) {
        status = choose_models(set, view, &spent);
    }
    if (status.code == VD_OK) {
        status = vd_impostors_choose_bricks(set, view, &spent);
    }
    if (status.code == VD_OK) {
        take_out(set);
        if (spent.full) {
            give_up_unused(set);
        }
    }
    return status;
}

/* ---- what is hidden ---------------------------------------------------------------------------*/

bool vd_impostor_find_pixel(const vd_camera *camera, const vd_frame *frame, vd_vec3 at,
                            size_t *pixel, float *depth) {
    double x, y, z;
    if (!vd_camera_project(camera, at, &x, &y, &z) || !(x >= 0.0) || !(x < frame->width) ||
        !(y >= 0.0) || !(y < frame->height)) {
        return false;
    }
    *pixel = (size_t)y * frame->stride + (size_t)x;
    *depth = (float)(camera->near_m / z);
    return true;
}

void vd_impostor_count_hidden(const vd_camera *camera, const vd_frame *front, vd_vec3 at, int *seen,
                              int *hidden) {
    size_t pixel;
    float depth;
    if (vd_impostor_find_pixel(camera, front, at, &pixel, &depth)) {
        (*seen)++;
        *hidden += front->depth[pixel] > VD_IMPOSTOR_NEARER * depth ? 1 : 0;
    }
}

/* Whether more than a little of an instance is hidden by what a frame shows. */
static bool is_hidden(const vd_impostors *set, const vd_impostor_stand *stand,
                      const vd_camera *camera, const vd_frame *front) {
    const vd_instance *instance = (const vd_instance *)entry_of(set, stand->node)->object;
    const vd_vec3 origin = stand->place.origin;
    const vd_matrix place = vd_instance_place(instance, instance->head.anchor.z - origin.z);
    const sampling s = sample(&set->world->assets[instance->model], &place);
    const float *ground = stand->place.ground;
    int seen = 0, hidden = 0;
    for (uint32_t i = 0; i < s.mesh->vertex_count; i += s.step) {
        const vd_vec3 at = vertex_at(&s, i);
        if (stand->place.has_ground &&
            at.z - origin.z < (double)ground[0] + (double)ground[1] * (at.x - origin.x) +
                                  (double)ground[2] * (at.y - origin.y)) {
            continue;
        }
        vd_impostor_count_hidden(camera, front, at, &seen, &hidden);
    }
    return hidden > VD_IMPOSTOR_MOST_HIDDEN * seen;
}

typedef bool hidden_test(const vd_impostors *set, const vd_impostor_stand *stand,
                         const vd_camera *camera, const vd_frame *front);

/* Leaves those of a list that are hidden. */
static bool hide(vd_impostors *set, const vd_list *list, hidden_test *test, const vd_camera *camera,
                 const vd_frame *front) {
    const uint32_t *chosen = list->data;
    bool any = false;
    for (size_t i = 0; i < list->count; i++) {
        vd_impostor_stand *stand = vd_impostor_stand_at(set, chosen[i]);
        if (test(set, stand, camera, front)) {
            vd_impostor_leave(stand, camera->eye);
            any = true;
        }
    }
    return any;
}

bool vd_impostors_hide_placed(vd_impostors *set, const vd_camera *camera, const vd_frame *front) {
    const vd_impostor_placing *p = &set->placing;
    const bool models = hide(set, &p->chosen, is_hidden, camera, front);
    return hide(set, &p->clouds, vd_impostor_cloud_is_hidden, camera, front) || models;
}

void vd_impostors_unchoose_placed(vd_impostors *set) {
    const vd_list *before = &set->placing.before;
    memcpy(set->direct.data, before->data, before->count * sizeof(uint32_t));
    set->direct.count = before->count;
}

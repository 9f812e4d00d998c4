/* impostor_bricks.c: particles that a client draws itself.
 *
 *      direct ──► objects of particles ──► a cut through each file's octree, ──► order, back to
 *                 that it may draw         above and below these, finer where      front
 *                                          it is nearer
 *
 * The client gets nodes of the octree, each once, and of each turn no more than holds nothing up. A
 * node may stand above several objects, when all of these that are in sight are the client's. An
 * object is left out of the picture in front when the client has all nodes that stand for it, and
 * nodes are replaced by finer ones when it has all of these: both in one order. As for models, next
 * to nothing of an object may be hidden by what is in front of it.
 */
#include <math.h>
#include <stdlib.h>
#include "core/core.h"
#include "impostor/impostor_placed.h"
#include "splat/brick_pack.h"
#include "splat/brick_walk.h"
#include "splat/splat_internal.h"

/* How far, root mean square, data may be on the screen from what first stands for it, pixels. */
#define COARSE_PX 4.0

/* What a file's node is to a choice. Part: leads to what is of the order; whole: it, or all below
 * it that is in sight, may be the client's; taken: and the client has a cut of it; left: it has
 * not. */
enum { MARK_NONE = 0, MARK_PART, MARK_WHOLE, MARK_TAKEN, MARK_LEFT };

/* One file's nodes, as the camera sees them. */
typedef struct looking {
    uint32_t asset;
    const vd_bricks *bricks;
    vd_brick_view view; /* of the walk: its file alone */
    vd_brick_walk walk;
} looking;

/* A node of a cut that may be refined. */
typedef struct coarse {
    double worth; /* of refining it: the nearer, the more it hides */
    double size;  /* pixels */
    uint32_t brick;
} coarse;

typedef struct choosing {
    vd_impostors *set;
    const vd_impostor_view *view;
    vd_impostor_spent *spent;
    looking look;
    vd_list candidates; /* uint32_t stands, the nearest first */
    vd_list nodes;      /* uint32_t bricks of one node's cut */
    vd_list heap;       /* coarse, the most worth first */
    vd_list whole;      /* uint32_t bricks of the order */
} choosing;

static bool add_number(vd_impostors *set, vd_list *list, uint32_t number) {
    uint32_t *to = vd_list_add(set->context, list, 1, sizeof *to);
    if (to != NULL) {
        *to = number;
    }
    return to != NULL;
}

/* ---- cuts -------------------------------------------------------------------------------------*/

static void look_at(const vd_impostors *set, const vd_impostor_view *view, uint32_t asset,
                    looking *look) {
    const vd_brick_asset *a = vd_impostor_particles(set, asset);
    const vd_camera *c = &view->camera;
    *look = (looking){.asset = asset, .bricks = a->bricks, .view = {.bricks = a->bricks}};
    look->walk =
        (vd_brick_walk){.def = &a->view,
                        .camera = c,
                        .forward = vd_quat_rotate(c->orientation, vd_vec3_make(0.0, 0.0, 1.0)),
                        .scale = c->lens.fx > c->lens.fy ? c->lens.fx : c->lens.fy,
                        .margin = vd_brick_view_reach(a->bricks, &a->view)};
    look->walk.view = &look->view;
}

static bool is_in_sight(const choosing *c, uint32_t node) {
    const vd_bricks_node *n = &c->look.bricks->nodes[node];
    const double m = c->look.walk.margin;
    const vd_vec3 eye = c->view->camera.eye;
    const double x = fmax(fabs(n->min[0] - eye.x), fabs(n->max[0] - eye.x));
    const double y = fmax(fabs(n->min[1] - eye.y), fabs(n->max[1] - eye.y));
    const double drop = c->view->drop_per_m2 * (x * x + y * y);
    return vd_frustum_touches_box(&c->view->frustum,
                                  vd_vec3_make(n->min[0] - m, n->min[1] - m, n->min[2] - m - drop),
                                  vd_vec3_make(n->max[0] + m, n->max[1] + m, n->max[2] + m));
}

/* Pixels that a node's data is from what stands for it; 0 where that is not seen, or exact. */
static double size_of(const choosing *c, uint32_t node) {
    const vd_bricks_node *n = &c->look.bricks->nodes[node];
    return n->child_count > 0 && is_in_sight(c, node) ? vd_brick_walk_spread(&c->look.walk, n)
                                                      : 0.0;
}

/* What a node counts of the client's particles: where they are large on the screen more than they
 * are, since pixels are bounded, too. */
static uint64_t cost_of(const choosing *c, uint32_t node) {
    const vd_bricks_node *n = &c->look.bricks->nodes[node];
    const vd_vec3 size = {n->max[0] - n->min[0], n->max[1] - n->min[1], n->max[2] - n->min[2]};
    double nearest;
    const double middle = vd_brick_walk_depth(&c->look.walk, n, &nearest);
    const double depth = fmax(middle, 0.5 * vd_vec3_length(size));
    const double reach = vd_splat_support(c->look.walk.def->kernel) /
                         vd_splat_support(VD_SPLAT_GAUSSIAN) * c->look.walk.margin;
    const double side = 2.0 * reach * vd_brick_walk_scale(&c->look.walk, depth) + 1.0;
    const double most = 0.5 * VD_PLACED_OVERDRAW * c->view->width * c->view->height /
                        (double)c->set->def.placed_particles;
    return (uint64_t)(n->count * fmin(fmax(1.0, side * side / most), 1e9));
}

/* Whether more particles fit. */
static bool has_room(const choosing *c, uint64_t more) {
    return c->spent->particles + more <= c->set->def.placed_particles;
}

/* Adds the nodes of a node's cut of so many pixels. False, and *status, when memory is out, or when
 * there are more particles than there is room for; bricks may hold more than a block may. */
static bool cut(choosing *c, uint32_t node, double pixels, uint64_t *particles, vd_status *status) {
    const vd_bricks_node *n = &c->look.bricks->nodes[node];
    if (size_of(c, node) > pixels) {
        for (uint32_t i = 0; i < n->child_count; i++) {
            if (!cut(c, n->child_first + i, pixels, particles, status)) {
                return false;
            }
        }
        return true;
    }
    *particles += cost_of(c, node);
    if (n->count > VD_BRICK_BLOCK_MOST || !has_room(c, *particles)) {
        return false;
    }
    const uint32_t brick = vd_impostor_brick_of(c->set, c->look.asset, node);
    if (brick == 0 || !add_number(c->set, &c->nodes, brick - 1)) {
        *status = vd_impostor_no_memory();
        return false;
    }
    return true;
}

/* What some bricks are to the client. */
typedef struct needs {
    size_t bytes; /* that it has not */
    bool refused;
} needs;

static needs needs_of(const vd_impostors *set, const uint32_t *bricks, size_t count) {
    needs n = {.bytes = 0};
    for (size_t i = 0; i < count; i++) {
        const vd_impostor_brick *b = vd_impostor_brick_at(set, bricks[i]);
        const bool here = b->delivered || b->used == set->update;
        n.bytes += here ? 0 : b->bytes;
        n.refused = n.refused || b->refused;
    }
    return n;
}

/* Sends those of some bricks that the client has not, as far as this turn may; true when it then
 * has all of them. */
static bool take(choosing *c, const uint32_t *bricks, size_t count, vd_status *status) {
    vd_impostors *set = c->set;
    bool all = true;
    for (size_t i = 0; i < count && status->code == VD_OK; i++) {
        vd_impostor_brick *b = vd_impostor_brick_at(set, bricks[i]);
        const bool here = b->delivered || b->used == set->update;
        const size_t fresh = c->spent->fresh + b->bytes;
        if (!here && (b->gone || (c->spent->fresh > 0 && fresh > VD_IMPOSTOR_TURN_BYTES))) {
            all = false;
            continue;
        }
        if (!here) {
            c->spent->fresh = fresh;
            c->spent->bytes += b->bytes;
            *status =
                add_number(set, &set->placing.sent, bricks[i]) ? *status : vd_impostor_no_memory();
        }
        b->used = set->update;
    }
    return all;
}

static vd_status add_coarse(choosing *c, uint32_t brick) {
    const uint32_t node = vd_impostor_brick_at(c->set, brick)->node;
    const double size = size_of(c, node);
    double nearest;
    (void)vd_brick_walk_depth(&c->look.walk, &c->look.bricks->nodes[node], &nearest);
    const double worth = size / fmax(nearest, c->view->camera.near_m);
    coarse *heap = vd_list_add(c->set->context, &c->heap, 1, sizeof *heap);
    if (heap == NULL) {
        return vd_impostor_no_memory();
    }
    heap = c->heap.data;
    size_t at = c->heap.count - 1;
    for (; at > 0 && heap[(at - 1) / 2].worth < worth; at = (at - 1) / 2) {
        heap[at] = heap[(at - 1) / 2];
    }
    heap[at] = (coarse){worth, size, brick};
    return vd_success();
}

static coarse take_coarsest(choosing *c) {
    coarse *heap = c->heap.data;
    const coarse first = heap[0], last = heap[--c->heap.count];
    size_t at = 0;
    for (size_t child = 1; child < c->heap.count; child = 2 * at + 1) {
        child += child + 1 < c->heap.count && heap[child + 1].worth > heap[child].worth;
        if (last.worth >= heap[child].worth) {
            break;
        }
        heap[at] = heap[child];
        at = child;
    }
    heap[at] = last;
    return first;
}

/* ---- objects ----------------------------------------------------------------------------------*/

static vd_status look_at_file(choosing *c, uint32_t asset) {
    if (c->look.asset == asset) {
        return vd_success();
    }
    const vd_status status = vd_impostors_open_file(c->set, asset);
    if (status.code == VD_OK) {
        look_at(c->set, c->view, asset, &c->look);
    }
    return status;
}

/* Marks an object's node, and what is above it as far as all below that is in sight is marked. */
static void mark_whole(const choosing *c, uint32_t node) {
    const vd_impostor_file *file = &c->set->placing.files[c->look.asset];
    for (uint32_t at = node; file->marks[at] != MARK_WHOLE; at = file->parents[at]) {
        file->marks[at] = MARK_WHOLE;
        const uint32_t parent = file->parents[at];
        const vd_bricks_node *n = &c->look.bricks->nodes[parent];
        for (uint32_t i = 0; at != 0 && file->whole[parent] == 0 && i < n->child_count; i++) {
            file->whole[parent] += is_in_sight(c, n->child_first + i) ? 0 : 1;
        }
        if (at == 0 || ++file->whole[parent] < n->child_count) {
            break;
        }
    }
}

static uint32_t top_of(const vd_impostor_file *file, uint32_t node) {
    uint32_t at = node;
    while (at != 0 && file->marks[file->parents[at]] >= MARK_WHOLE) {
        at = file->parents[at];
    }
    return at;
}

static void unmark(const vd_impostor_file *file, uint32_t node) {
    for (uint32_t at = node;; at = file->parents[at]) {
        file->marks[at] = MARK_NONE;
        file->whole[at] = 0;
        if (at == 0) {
            break;
        }
    }
}

/* Adds an object to the candidates, unless something speaks against it. */
static vd_status add_candidate(choosing *c, const vd_impostor_rank *rank) {
    vd_impostors *set = c->set;
    const vd_cloud *cloud = vd_impostor_cloud(set, rank->slot);
    const vd_vec3 eye = c->view->camera.eye;
    bool made;
    vd_impostor_stand *stand = vd_impostor_stand_of(set, rank->slot, &made);
    if (stand == NULL) {
        return vd_impostor_no_memory();
    }
    stand->distance = sqrt(rank->distance2);
    if (vd_impostor_is_skipped(set, rank->slot) || vd_impostor_was_left(stand, eye)) {
        return vd_success();
    }
    if (vd_impostor_is_behind_picture(set, c->view, &set->world->nodes[rank->slot],
                                      stand->distance)) {
        vd_impostor_leave(stand, eye);
        return vd_success();
    }
    vd_status status = look_at_file(c, cloud->bricks);
    if (status.code == VD_OK) {
        mark_whole(c, cloud->root);
        status = add_number(set, &c->candidates,
                            (uint32_t)(stand - (vd_impostor_stand *)set->placing.stands.data))
                     ? status
                     : vd_impostor_no_memory();
    }
    return status;
}

/* Adds the nodes of the coarsest cut that the client has. False, and *status, likewise. */
static bool find_held(choosing *c, uint32_t node, uint64_t *particles, vd_status *status) {
    const vd_bricks_node *n = &c->look.bricks->nodes[node];
    const uint32_t known = c->set->placing.files[c->look.asset].brick_of[node];
    const vd_impostor_brick *b = known != 0 ? vd_impostor_brick_at(c->set, known - 1) : NULL;
    if (b != NULL && (b->delivered || b->used == c->set->update)) {
        *particles += cost_of(c, node);
        *status = add_number(c->set, &c->nodes, known - 1) ? *status : vd_impostor_no_memory();
        return status->code == VD_OK && has_room(c, *particles);
    }
    bool all = n->child_count > 0;
    for (uint32_t i = 0; all && i < n->child_count; i++) {
        all = find_held(c, n->child_first + i, particles, status);
    }
    return all;
}

/* Has what stands in `nodes` drawn by the client, which has all of it. */
static vd_status use_nodes(choosing *c, uint64_t particles) {
    vd_status status = vd_success();
    c->spent->particles += particles;
    for (size_t i = 0; i < c->nodes.count && status.code == VD_OK; i++) {
        const uint32_t brick = ((const uint32_t *)c->nodes.data)[i];
        vd_impostor_brick_at(c->set, brick)->used = c->set->update;
        status = add_coarse(c, brick);
    }
    return status;
}

/* Chooses a node if a cut of it fits, and sends what is missing of that. Until it is there the node
 * is drawn by what is, if that may be coarse: `anyway`. *taken: the client draws it; *never: nor
 * will it soon. */
static vd_status choose_node(choosing *c, uint32_t node, bool anyway, bool *taken, bool *never) {
    vd_impostors *set = c->set;
    vd_status status = vd_success();
    uint64_t particles = 0;
    c->nodes.count = 0;
    const bool fits = cut(c, node, COARSE_PX, &particles, &status);
    if (fits) {
        const needs n = needs_of(set, c->nodes.data, c->nodes.count);
        const bool full = c->spent->bytes + n.bytes > set->def.placed_bytes;
        c->spent->full = c->spent->full || full;
        *never = full || n.refused;
        *taken = !*never && take(c, c->nodes.data, c->nodes.count, &status);
    } else {
        *never = true;
    }
    if (!*taken && status.code == VD_OK && anyway) {
        particles = 0;
        c->nodes.count = 0;
        *taken = find_held(c, node, &particles, &status);
    }
    *never = *never && !*taken;
    return status.code == VD_OK && *taken ? use_nodes(c, particles) : status;
}

/* Chooses what stands for a candidate, unless that is settled; then the candidate itself. */
static vd_status choose_cloud(choosing *c, uint32_t number) {
    vd_impostors *set = c->set;
    vd_impostor_stand *stand = vd_impostor_stand_at(set, number);
    const vd_cloud *cloud = vd_impostor_cloud(set, stand->node);
    vd_status status = look_at_file(c, cloud->bricks);
    if (status.code != VD_OK) {
        return status;
    }
    vd_impostor_file *file = &set->placing.files[cloud->bricks];
    const uint32_t top = top_of(file, cloud->root);
    bool never = false;
    if (file->marks[top] == MARK_WHOLE) {
        bool taken = false;
        const bool anyway = stand->chosen_at > 0 && stand->chosen_at + 1 >= set->update;
        status = choose_node(c, top, anyway, &taken, &never);
        file->marks[top] = taken ? MARK_TAKEN : MARK_LEFT;
    }
    if (never) {
        vd_impostor_leave(stand, c->view->camera.eye);
    }
    stand->chosen = file->marks[top] == MARK_TAKEN;
    stand->chosen_at = stand->chosen ? set->update : stand->chosen_at;
    return status.code == VD_OK && stand->chosen && !add_number(set, &set->placing.clouds, number)
               ? vd_impostor_no_memory()
               : status;
}

/* ---- refining ---------------------------------------------------------------------------------*/

/* Lists a node's children, if they may be sent. *particles: how many more than the node's. */
static bool list_children(choosing *c, uint32_t node, uint64_t *particles, vd_status *status) {
    const vd_bricks_node *n = &c->look.bricks->nodes[node];
    uint64_t sum = 0;
    bool can = n->child_count > 0;
    c->nodes.count = 0;
    for (uint32_t i = n->child_first; can && i < n->child_first + n->child_count; i++) {
        const uint32_t brick = vd_impostor_brick_of(c->set, c->look.asset, i);
        sum += cost_of(c, i);
        can = brick != 0 && add_number(c->set, &c->nodes, brick - 1);
        *status = can ? *status : vd_impostor_no_memory();
        can = can && c->look.bricks->nodes[i].count <= VD_BRICK_BLOCK_MOST;
    }
    const uint64_t freed = cost_of(c, node);
    *particles = sum > freed ? sum - freed : 0;
    return can;
}

/* Puts a node's children in its place if they fit; else it is of the order as it is. */
static vd_status refine(choosing *c, const coarse *node) {
    vd_impostors *set = c->set;
    const vd_impostor_brick parent = *vd_impostor_brick_at(set, node->brick);
    const double detail = vd_impostor_particles(set, parent.asset)->view.detail_px;
    vd_status status = look_at_file(c, parent.asset); /* which is open */
    uint64_t particles = 0;
    bool can = node->size > (detail == 0.0 ? 0.5 : detail) &&
               list_children(c, parent.node, &particles, &status) && has_room(c, particles);
    if (can) {
        const needs more = needs_of(set, c->nodes.data, c->nodes.count);
        const bool full = c->spent->bytes + more.bytes > set->def.placed_bytes;
        c->spent->full = c->spent->full || full;
        can = !full && !more.refused && take(c, c->nodes.data, c->nodes.count, &status);
    }
    if (!can && status.code == VD_OK) {
        status = add_number(set, &c->whole, node->brick) ? status : vd_impostor_no_memory();
    }
    return can && status.code == VD_OK ? use_nodes(c, particles) : status;
}

/* ---- the order --------------------------------------------------------------------------------*/

/* Marks a node of the cut and what leads to it; `mark` MARK_NONE: takes that away again. */
static void mark(const vd_impostors *set, uint32_t brick, uint8_t mark) {
    const vd_impostor_brick *b = vd_impostor_brick_at(set, brick);
    const vd_impostor_file *file = &set->placing.files[b->asset];
    uint32_t at = b->node;
    file->marks[at] = mark;
    while (at != 0) {
        at = file->parents[at];
        file->marks[at] = mark != MARK_NONE ? MARK_PART : MARK_NONE;
    }
}

/* Adds what is marked at and below a node, back to front. At most as deep as the octree. */
static vd_status emit(vd_impostors *set, const looking *look, uint32_t node) {
    const vd_impostor_file *file = &set->placing.files[look->asset];
    vd_status status = vd_success();
    if (file->marks[node] == MARK_WHOLE) {
        return add_number(set, &set->placing.cut, file->brick_of[node] - 1)
                   ? status
                   : vd_impostor_no_memory();
    }
    uint32_t children[8];
    const uint32_t count =
        vd_brick_walk_children(&look->walk, &look->bricks->nodes[node], children);
    for (uint32_t i = 0; i < count && status.code == VD_OK; i++) {
        status = file->marks[children[i]] != MARK_NONE ? emit(set, look, children[i]) : status;
    }
    return status;
}

/* A file of which something is in the order. */
typedef struct run {
    double far;
    uint32_t asset;
} run;

static int compare_runs(const void *a, const void *b) {
    const run *x = a, *y = b;
    return x->far != y->far ? (x->far < y->far) - (x->far > y->far)
                            : (x->asset > y->asset) - (x->asset < y->asset);
}

/* Lists the files, the farthest first, by the middle of what of each is in the order. */
static vd_status find_runs(choosing *c, vd_list *runs) {
    const vd_impostors *set = c->set;
    const uint32_t *clouds = set->placing.clouds.data;
    for (uint32_t asset = 0; asset < vd_world_asset_count(set->world); asset++) {
        vd_vec3 min = {INFINITY, INFINITY, INFINITY}, max = {-INFINITY, -INFINITY, -INFINITY};
        bool any = false;
        const bool of_bricks = set->world->assets[asset].kind == VD_ASSET_BRICKS;
        for (size_t i = 0; of_bricks && i < set->placing.clouds.count; i++) {
            const uint32_t node = vd_impostor_stand_at(set, clouds[i])->node;
            if (vd_impostor_cloud(set, node)->bricks == asset) {
                min = vd_vec3_min(min, set->world->nodes[node].min);
                max = vd_vec3_max(max, set->world->nodes[node].max);
                any = true;
            }
        }
        if (any) {
            run *to = vd_list_add(set->context, runs, 1, sizeof *to);
            if (to == NULL) {
                return vd_impostor_no_memory();
            }
            const vd_vec3 way =
                vd_vec3_subtract(vd_vec3_scale(vd_vec3_add(min, max), 0.5), c->view->camera.eye);
            *to = (run){vd_vec3_dot(way, way), asset};
        }
    }
    if (runs->count > 1) {
        qsort(runs->data, runs->count, sizeof(run), compare_runs);
    }
    return vd_success();
}

/* Sorts what is of the order into the cut. */
static vd_status sort(choosing *c) {
    vd_impostors *set = c->set;
    const uint32_t *whole = c->whole.data;
    vd_list runs = {.data = NULL};
    vd_status status = find_runs(c, &runs);
    for (size_t i = 0; i < c->whole.count; i++) {
        mark(set, whole[i], MARK_WHOLE);
    }
    for (size_t i = 0; i < runs.count && status.code == VD_OK; i++) {
        look_at(set, c->view, ((const run *)runs.data)[i].asset, &c->look);
        status = emit(set, &c->look, 0);
    }
    for (size_t i = 0; i < c->whole.count; i++) {
        mark(set, whole[i], MARK_NONE);
    }
    vd_release(set->context, runs.data);
    return status;
}

/* What was to be sent in this turn, and is chosen anew. */
static void forget_sent(vd_impostors *set) {
    const uint32_t *sent = set->placing.sent.data;
    for (size_t i = 0; i < set->placing.sent.count; i++) {
        vd_impostor_brick *b = vd_impostor_brick_at(set, sent[i]);
        b->used = b->delivered ? b->used : 0;
    }
    set->placing.sent.count = 0;
}

static vd_status choose_all(choosing *c, const vd_list *ranks) {
    vd_impostors *set = c->set;
    vd_status status = vd_success();
    for (size_t i = 0; i < ranks->count && status.code == VD_OK; i++) {
        status = add_candidate(c, (const vd_impostor_rank *)ranks->data + i);
    }
    const uint32_t *candidates = c->candidates.data;
    for (size_t i = 0; i < c->candidates.count && status.code == VD_OK; i++) {
        status = choose_cloud(c, candidates[i]);
    }
    for (size_t i = 0; i < c->candidates.count; i++) {
        const vd_cloud *cloud =
            vd_impostor_cloud(set, vd_impostor_stand_at(set, candidates[i])->node);
        unmark(&set->placing.files[cloud->bricks], cloud->root);
    }
    while (c->heap.count > 0 && status.code == VD_OK) {
        const coarse next = take_coarsest(c);
        status = refine(c, &next);
    }
    return status.code == VD_OK ? sort(c) : status;
}

vd_status vd_impostors_choose_bricks(vd_impostors *set, const vd_impostor_view *view,
                                     vd_impostor_spent *spent) {
    vd_impostor_placing *p = &set->placing;
    choosing c = {.set = set, .view = view, .spent = spent, .look = {.asset = UINT32_MAX}};
    vd_list ranks = {.data = NULL};
    forget_sent(set);
    p->clouds.count = p->cut.count = 0;
    if (set->def.placed_particles == 0) {
        return vd_success();
    }
    vd_status status = vd_impostors_rank_placed(set, view, VD_OBJECT_PARTICLES, &ranks);
    if (status.code == VD_OK) {
        status = choose_all(&c, &ranks);
    }
    vd_release(set->context, ranks.data);
    vd_release(set->context, c.candidates.data);
    vd_release(set->context, c.nodes.data);
    vd_release(set->context, c.heap.data);
    vd_release(set->context, c.whole.data);
    return status;
}

/* impostor_decide.c: what is shown as what.
 *
 * From the root of the world's tree down, far children before near ones, so that what comes out is
 * back to front. A node is wanted as one picture when that would last (eq. 2.4) and is no larger
 * than is good; else its children are asked. What is wanted is shown only when its pictures are
 * there: until then what was shown goes on being shown, a parent for its children or children for
 * their parent, and both change places at once. Thresholds differ by a fifth between splitting and
 * merging, so that nothing flips to and fro.
 */
#include <math.h>
#include <stddef.h>
#include "core/core.h"
#include "impostor/impostor_placed.h"

#define HYSTERESIS 1.25

/* How much of the way straight ahead counts as sideways. */
#define FORWARD 0.25

/* Patches may be so many times larger than other pictures: more of them lie side by side. */
#define PATCH_SIZE 3.0

/* So many pictures of the largest size at least fit into the memory. */
#define LEAST_KEPT 8

/* How many times larger than it has to be near ground may stay. */
#define KEEP_NEAR 2.0

typedef enum wanted { NOTHING = 0, PICTURE, CHILDREN, ITSELF } wanted;

typedef struct deciding {
    vd_impostors *set;
    const vd_impostor_view *view;
    double most_px; /* of any picture: it must not fill the memory, nor be larger than the screen */
    double speed;   /* of the camera, metres a second */
    bool wishing;   /* pictures that are missing are asked for */
    double urgency; /* factor on what they are worth */
    const vd_frustum *seen; /* what lies wholly in it is not looked at again; null: all is */
    bool any_need;
    vd_cells need; /* ground that this walk found too near for pictures */
    vd_status status;
} deciding;

/* The slot of a node; null when memory is out. */
static vd_impostor_slot *slot_of(deciding *d, uint32_t node) {
    vd_impostor_slot *slot = vd_impostor_slot_of(d->set, node);
    if (slot == NULL) {
        d->status = vd_out_of_memory("an impostor", sizeof *slot);
    }
    return slot;
}

static void add_index(deciding *d, vd_list *list, uint32_t index) {
    uint32_t *to = vd_list_add(d->set->context, list, 1, sizeof *to);
    if (to == NULL) {
        d->status = vd_out_of_memory("a picture's impostors", sizeof *to);
        return;
    }
    *to = index;
}

/* ---- one node ---------------------------------------------------------------------------------*/

/* The radius of a ball round bounds, and the way from the eye to its middle. */
static double ball_of(const deciding *d, vd_vec3 min, vd_vec3 max, vd_vec3 *way) {
    *way = vd_vec3_subtract(vd_vec3_scale(vd_vec3_add(min, max), 0.5), d->view->eye);
    return 0.5 * vd_vec3_length(vd_vec3_subtract(max, min));
}

/* Whether the picture of a ball at the distance z is neither too large nor too near. */
static bool fits(const deciding *d, double radius, double z, double most_px, double loosen) {
    const double most = most_px < d->most_px ? most_px : d->most_px;
    return z > 1.5 * radius && 2.0 * radius * d->view->focal_px * loosen <= most * z;
}

/* Whether one picture of all of a node is good: it lasts for `least` frames, and is neither too
 * large nor too near. */
static bool is_good(const deciding *d, uint32_t index, vd_vec3 min, vd_vec3 max, double most_px,
                    double least, double loosen) {
    const vd_impostor_view *view = d->view;
    const vd_impostor_def *def = &d->set->def;
    vd_vec3 sight;
    const double radius = ball_of(d, min, max, &sight), z = vd_vec3_length(sight);
    if (!fits(d, radius, z, most_px * d->set->haste, loosen)) {
        return false;
    }
    vd_vec3 through, normal;
    const double depth = vd_impostor_best_plane(d->set, view, index, &through, &normal);
    const double along = vd_vec3_dot(view->velocity, sight) / z;
    const double across = d->speed * d->speed - along * along;
    const double aside = sqrt(across > 0.0 ? across : 0.0) + FORWARD * fabs(along);
    const double way =
        vd_impostor_free_way(z, depth, view->focal_px, fmax(def->tolerance_px, 0.01));
    return way * def->rate_hz * d->set->haste >= least * loosen * fmax(aside, def->speed_mps);
}

/* Where ground is shown by patches, their pictures have what stands on them: what stands on ground
 * that is drawn itself is left. PICTURE: any of it may be; CHILDREN: parts of it may. */
static wanted want_near(const deciding *d, const vd_node *node) {
    const vd_impostors *set = d->set;
    if (set->ground.count == 0 || !node->grounded) {
        return PICTURE;
    }
    const vd_cells at = vd_world_node_cells(set->ground.sample_from_world, &set->ground.map, node);
    if (!set->any_near || !vd_cells_overlap(&at, &set->near)) {
        return node->loose ? CHILDREN : NOTHING;
    }
    return vd_cells_hold(&set->near, &at) ? PICTURE : CHILDREN;
}

/* Whether a box is in the view that was decided before, all of it. */
static bool is_seen(const deciding *d, vd_vec3 min, vd_vec3 max) {
    for (int i = 0; i < 5 && d->seen != NULL; i++) {
        const vd_vec3 n = d->seen->planes[i].normal;
        const double least = n.x * (n.x > 0.0 ? min.x : max.x) + n.y * (n.y > 0.0 ? min.y : max.y) +
                             n.z * (n.z > 0.0 ? min.z : max.z);
        if (!(least >= d->seen->planes[i].offset)) {
            return false;
        }
    }
    return d->seen != NULL;
}

static wanted want(const deciding *d, uint32_t index, bool was_split) {
    const vd_node *node = &d->set->world->nodes[index];
    const bool placed = node->count == 0;
    const wanted parts = placed ? ITSELF : CHILDREN;
    vd_vec3 min, max;
    vd_impostor_bounds(d->set, d->view, index, &min, &max);
    if (!vd_frustum_touches_box(&d->view->frustum, min, max) || is_seen(d, min, max)) {
        return NOTHING;
    }
    if (placed) {
        if (node->kind == VD_OBJECT_TERRAIN) {
            return NOTHING; /* the ground is drawn with every picture */
        }
        if (node->kind == VD_OBJECT_LABEL) {
            return ITSELF; /* as large from afar as from near */
        }
    }
    const wanted near = want_near(d, node);
    if (near != PICTURE) {
        return near == CHILDREN ? parts : near;
    }
    if (node->names || node->kind == VD_OBJECT_LINE) {
        return parts;
    }
    const double most = placed ? 2.0 * d->set->def.most_px : d->set->def.most_px;
    const double least = d->set->def.least_reuse *
                         (vd_impostors_may_place(d->set, index) ? VD_IMPOSTOR_PLACED_REUSE : 1.0);
    /* Of what fails as a whole the parts may not. */
    return !vd_impostor_is_skipped(d->set, index) && !vd_impostor_is_restless(d->set, index) &&
                   is_good(d, index, min, max, most, least, was_split ? HYSTERESIS : 1.0)
               ? PICTURE
               : parts;
}

/* Asks for the picture of a node; false when there is none to show yet. Tells its screen error. */
static bool ask(deciding *d, uint32_t index, double *screen_error) {
    vd_impostors *set = d->set;
    vd_impostor_slot *slot = slot_of(d, index);
    if (slot == NULL) {
        return false;
    }
    const uint32_t number = set->slot_of[index] - 1;
    const double error = vd_impostor_error(set, d->view, slot);
    *screen_error = error;
    const bool wrong =
        !(error <= set->def.tolerance_px) || set->def.tolerance_px == 0.0 || set->def.no_reuse;
    if (wrong && d->wishing && slot->coming && !slot->changed) {
        slot->asked = set->update; /* still of use */
    } else if (wrong && d->wishing && slot->asked != set->update && set->time_s >= slot->retry_s) {
        slot->asked = set->update;
        vd_vec3 min, max, way;
        vd_impostor_bounds(set, d->view, index, &min, &max);
        const double radius = ball_of(d, min, max, &way);
        const double side = 2.0 * radius * d->view->focal_px / fmax(vd_vec3_length(way), 1e-9);
        const double shown = error < 1e3 ? error : 1e3;
        vd_impostor_wish *to = vd_list_add(set->context, &set->wishes, 1, sizeof *to);
        if (to == NULL) {
            d->status = vd_out_of_memory("an impostor", sizeof *to);
            return false;
        }
        *to = (vd_impostor_wish){number,
                                 vd_impostor_parallax(set, d->view, slot) <= set->def.tolerance_px,
                                 side * side, d->urgency * shown * side * side};
    }
    return slot->now.rgba != NULL || slot->empty;
}

static void add_rank(deciding *d, uint32_t index) {
    vd_impostors *set = d->set;
    vd_vec3 min, max;
    vd_impostor_bounds(set, d->view, index, &min, &max);
    const vd_vec3 to =
        vd_vec3_subtract(vd_vec3_scale(vd_vec3_add(min, max), 0.5), d->view->camera.eye);
    vd_impostor_rank *rank = vd_list_add(set->context, &set->ranks, 1, sizeof *rank);
    if (rank == NULL) {
        d->status = vd_out_of_memory("a picture's impostors", sizeof *rank);
        return;
    }
    *rank = (vd_impostor_rank){vd_vec3_dot(to, to), set->slot_of[index] - 1};
}

static void show(deciding *d, uint32_t index, double error, vd_list *list) {
    vd_impostor_slot *slot = slot_of(d, index);
    if (slot == NULL || slot->empty) {
        return;
    }
    slot->used = d->set->update;
    if (slot->now.rgba != NULL && d->view->horizon != NULL) {
        vd_vec3 min, max;
        vd_impostor_bounds(d->set, d->view, index, &min, &max);
        if (vd_horizon_hides(d->view->horizon, min, max)) {
            d->set->hidden++;
            return;
        }
    }
    slot->error_px = error;
    if (!vd_impostor_is_patch(d->set, index)) {
        d->set->any_loose = d->set->any_loose || d->set->world->nodes[index].loose;
    }
    if (slot->now.rgba != NULL && error > d->set->stats.error_px) {
        d->set->stats.error_px = error;
    }
    add_index(d, list, d->set->slot_of[index] - 1);
    if (list == &d->set->shown) {
        add_rank(d, index);
    }
}

/* What waits for its parts' pictures. */
static void show_stale(deciding *d, uint32_t index, vd_list *list) {
    const vd_impostor_slot *slot = slot_of(d, index);
    if (slot != NULL) {
        show(d, index, vd_impostor_error(d->set, d->view, slot), list);
    }
}

static void add_direct(deciding *d, uint32_t index) {
    vd_impostors *set = d->set;
    if (vd_impostor_is_skipped(set, index)) {
        set->missing++; /* never at rest: it may be mended */
        return;
    }
    const vd_node *node = &set->world->nodes[index];
    const bool line = node->kind == VD_OBJECT_LINE;
    set->any_loose = set->any_loose || node->loose;
    add_index(d, line && set->ground.count > 0 ? &set->lines : &set->direct, index);
}

/* Something that has no picture, though one would be good. Particles are drawn the coarser the more
 * there are; of others no more than are to be. */
static void add_wanting(deciding *d, uint32_t index) {
    vd_impostors *set = d->set;
    if (set->world->nodes[index].loose || set->def.most_direct == 0 ||
        set->things < set->def.most_direct) {
        set->things += !set->world->nodes[index].loose;
        add_direct(d, index);
    }
}

static bool has_picture(const vd_impostors *set, uint32_t index) {
    const uint32_t known = set->slot_of[index];
    return known != 0 && (vd_impostor_slot_at(set, known - 1)->now.rgba != NULL ||
                          vd_impostor_slot_at(set, known - 1)->empty);
}

/* ---- the tree ---------------------------------------------------------------------------------*/

static bool walk(deciding *d, uint32_t index, bool emit);

typedef struct far_child {
    double distance2;
    uint32_t index;
} far_child;

/* What of a slot is read soon: it lies anywhere, in as many cache lines as its picture's plane. */
static void fetch_slot(const vd_impostors *set, uint32_t index) {
    enum { LINE_BYTES = 64 };
    if (set->slot_of[index] != 0) {
        const char *slot = (const char *)vd_impostor_slot_at(set, set->slot_of[index] - 1);
        for (size_t at = 0; at < offsetof(vd_impostor_slot, before); at += LINE_BYTES) {
            __builtin_prefetch(slot + at);
        }
    }
}

/* Children, far ones first; of equals the later first. At most VD_OBJECT_MAX_CHILDREN. */
static uint32_t sort_children(const deciding *d, const vd_node *node, far_child *out) {
    for (uint32_t i = 0; i < node->count; i++) {
        const vd_node *child = &d->set->world->nodes[node->first + i];
        fetch_slot(d->set, node->first + i);
        const vd_vec3 middle = vd_vec3_scale(vd_vec3_add(child->min, child->max), 0.5);
        const vd_vec3 to = vd_vec3_subtract(middle, d->view->camera.eye);
        const far_child made = {vd_vec3_dot(to, to), node->first + i};
        uint32_t at = i;
        for (; at > 0 && out[at - 1].distance2 < made.distance2; at--) {
            out[at] = out[at - 1];
        }
        out[at] = made;
    }
    return node->count;
}

/* All children of a node; with `emit` they are shown. Returns whether all could be. */
static bool walk_children(deciding *d, uint32_t index, bool emit) {
    const vd_node *node = &d->set->world->nodes[index];
    far_child children[VD_OBJECT_MAX_CHILDREN];
    const uint32_t count = sort_children(d, node, children);
    bool all = true;
    for (uint32_t i = 0; i < count && d->status.code == VD_OK; i++) {
        all = walk(d, children[i].index, emit) && all;
    }
    return all;
}

/* Whether particles are first seen as a whole: of a client's many parts that have no picture yet
 * none is drawn itself, and they come one by one. */
static bool can_stand_in(const deciding *d, uint32_t index) {
    vd_vec3 min, max, way;
    if (!vd_impostor_is_apart(d->set, index) || vd_impostor_is_skipped(d->set, index)) {
        return false;
    }
    vd_impostor_bounds(d->set, d->view, index, &min, &max);
    const double radius = ball_of(d, min, max, &way);
    return fits(d, radius, vd_vec3_length(way), d->most_px, 1.0);
}

/* Whether a part that waits for its own parts will do in place of a whole: for a client that could
 * wait for all of them for long. */
static bool stands_in(deciding *d, uint32_t index) {
    vd_impostor_slot *slot = slot_of(d, index);
    if (slot == NULL || !d->set->def.ship) {
        return false;
    }
    slot->used = d->set->update; /* not to be given up before the whole */
    return true;
}

/* Decides a node; with `emit` what can be shown of it is. Returns whether it can be shown as it is
 * wanted. */
static bool walk(deciding *d, uint32_t index, bool emit) {
    vd_impostors *set = d->set;
    const uint32_t known = set->slot_of[index];
    const bool was_split = known != 0 && vd_impostor_slot_at(set, known - 1)->split;
    const wanted as = want(d, index, was_split);
    set->stats.decided++;
    if (as == NOTHING) {
        return true;
    }
    if (as == ITSELF) {
        if (emit) {
            add_direct(d, index);
        }
        return true;
    }
    if (as == PICTURE) {
        double error = 0.0;
        const bool ready = ask(d, index, &error);
        if (ready && emit) {
            show(d, index, error, &set->shown);
        }
        if (ready) {
            vd_impostor_slot_at(set, set->slot_of[index] - 1)->split = false;
            return true;
        }
        set->missing += emit;
        if (emit) { /* until it is there: what was shown, or the thing itself */
            if (set->world->nodes[index].count > 0) {
                const bool wishing = d->wishing;
                d->wishing = false;
                (void)walk_children(d, index, true);
                d->wishing = wishing;
            } else if (vd_impostor_is_apart(set, index)) {
                show(d, index, error, &set->shown); /* drawn itself it would be in front */
            } else if (d->status.code == VD_OK &&
                       vd_impostor_slot_at(set, set->slot_of[index] - 1)->failures == 0) {
                add_wanting(d, index);
            }
        }
        return false;
    }
    if (has_picture(set, index) && !was_split) { /* children first have to be ready */
        const bool ready = walk_children(d, index, false);
        if (!ready) {
            if (emit) {
                show_stale(d, index, &set->shown);
            }
            return !emit && stands_in(d, index);
        }
    }
    if (!was_split && !has_picture(set, index) && can_stand_in(d, index)) {
        double error = 0.0;
        (void)ask(d, index, &error);
        if (emit) {
            set->missing++;
            show(d, index, error, &set->shown);
        }
        return false;
    }
    vd_impostor_slot *slot = slot_of(d, index);
    if (slot == NULL) {
        return false;
    }
    slot->split = emit ? true : slot->split;
    return walk_children(d, index, emit);
}

/* ---- the ground -------------------------------------------------------------------------------*/

static void need(deciding *d, const vd_cells *cells) {
    d->need = d->any_need ? vd_cells_join(&d->need, cells) : *cells;
    d->any_need = true;
}

static bool walk_patch(deciding *d, uint32_t patch, bool emit);

static bool walk_quarters(deciding *d, uint32_t patch, bool emit) {
    uint32_t children[4];
    const int count = vd_ground_children(&d->set->ground, patch, d->view->u, d->view->v, children);
    bool all = true;
    for (int i = 0; i < count && d->status.code == VD_OK; i++) {
        all = walk_patch(d, children[i], emit) && all;
    }
    return all;
}

/* Shows a patch as one picture. Until there is one it is shown by its quarters, if it was before,
 * or else drawn itself in its place: what is shown has no picture then. */
static bool show_patch(deciding *d, uint32_t patch, bool was_split, bool emit) {
    vd_impostors *set = d->set;
    const uint32_t index = (uint32_t)set->world->node_count + patch;
    double error = 0.0;
    const bool ready = ask(d, index, &error);
    if (emit && !ready && was_split && d->status.code == VD_OK) {
        const bool wishing = d->wishing;
        d->wishing = false;
        (void)walk_quarters(d, patch, true);
        d->wishing = wishing;
    } else if (emit && d->status.code == VD_OK) {
        set->missing += !ready;
        show(d, index, error, &set->far);
        vd_impostor_slot_at(set, set->slot_of[index] - 1)->split = false;
    }
    return ready;
}

/* Decides a patch; with `emit` it is shown, or what is too near is added to the need.
 * Returns whether it can be shown as it is wanted. */
static bool walk_patch(deciding *d, uint32_t patch, bool emit) {
    vd_impostors *set = d->set;
    const vd_cells cells = vd_ground_cells(&set->ground, patch);
    const uint32_t index = (uint32_t)set->world->node_count + patch;
    const uint32_t known = set->slot_of[index];
    const bool was_split = known != 0 && vd_impostor_slot_at(set, known - 1)->split;
    const bool leaf = set->ground.patches[patch].level == 0;
    vd_vec3 min, max;
    set->stats.decided++;
    if (set->any_near && vd_cells_hold(&set->near, &cells)) {
        return true;
    }
    vd_impostor_bounds(set, d->view, index, &min, &max);
    if (!(min.x <= max.x) || !vd_frustum_touches_box(&d->view->frustum, min, max) ||
        is_seen(d, min, max)) {
        return true;
    }
    const bool forced = set->any_near && vd_cells_overlap(&set->near, &cells);
    if (!forced && is_good(d, index, min, max, PATCH_SIZE * set->def.most_px, set->def.least_reuse,
                           was_split ? HYSTERESIS : 1.0)) {
        return show_patch(d, patch, was_split, emit);
    }
    if (leaf) {
        if (emit) {
            need(d, &cells);
        }
        return true;
    }
    if (!forced && has_picture(set, index) && !was_split && !walk_quarters(d, patch, false)) {
        if (emit) {
            show_stale(d, index, &set->far);
        }
        return false;
    }
    vd_impostor_slot *slot = slot_of(d, index);
    if (slot == NULL) {
        return false;
    }
    slot->split = emit ? true : slot->split;
    return walk_quarters(d, patch, emit);
}

/* Patches that may hide some of the near ground are near ground too. */
static void need_hiding(deciding *d) {
    const vd_impostors *set = d->set;
    const uint32_t *far = set->far.data;
    for (size_t i = 0; i < set->far.count && set->any_near; i++) {
        const vd_cells cells = vd_ground_cells(
            &set->ground, vd_impostor_patch(set, vd_impostor_slot_at(set, far[i])->node));
        if (vd_ground_may_hide(&cells, &set->near, d->view->u, d->view->v)) {
            need(d, &cells);
        }
    }
}

static double area_of(const vd_cells *cells) {
    return (double)(cells->c1 - cells->c0 + 1) * (cells->r1 - cells->r0 + 1);
}

/* Earlier walks wished for patches that now are near ground, or are cut by it. */
static void forget_hidden_wishes(vd_impostors *set) {
    vd_impostor_wish *wishes = set->wishes.data;
    size_t kept = 0;
    for (size_t i = 0; i < set->wishes.count; i++) {
        vd_impostor_slot *slot = vd_impostor_slot_at(set, wishes[i].slot);
        const vd_cells cells = vd_ground_cells(&set->ground, vd_impostor_patch(set, slot->node));
        if (set->any_near && vd_cells_overlap(&set->near, &cells)) {
            slot->asked = 0;
        } else {
            wishes[kept++] = wishes[i];
        }
    }
    set->wishes.count = kept;
}

/* Near ground is one rectangle, that grows until it hides and is not hidden by patches. What it was
 * stays while it is not much larger than it has to be. Patches that it cuts are shown by quarters.
 */
static vd_status decide_ground(deciding *d) {
    enum { MOST_WALKS = 16 };
    vd_impostors *set = d->set;
    const bool any_before = set->any_near;
    const vd_cells before = set->near;
    set->any_near = false;
    for (int i = 0; i <= MOST_WALKS && d->status.code == VD_OK; i++) {
        d->any_need = false;
        set->far.count = set->missing = set->hidden = 0;
        set->stats.error_px = 0.0; /* of the last walk alone: what came before is not shown */
        (void)walk_patch(d, set->ground.count - 1, true);
        need_hiding(d);
        if (!d->any_need || (set->any_near && vd_cells_hold(&set->near, &d->need))) {
            break;
        }
        if (i == 0 && any_before && vd_cells_hold(&before, &d->need) &&
            area_of(&before) <= KEEP_NEAR * area_of(&d->need)) {
            d->need = before;
        }
        set->near = set->any_near ? vd_cells_join(&set->near, &d->need) : d->need;
        set->near = i + 1 < MOST_WALKS ? set->near : set->ground.map;
        set->any_near = true;
    }
    forget_hidden_wishes(set);
    return d->status;
}

/* ---- all of it --------------------------------------------------------------------------------*/

/* What is not seen yet is worth this much of what is. */
#define NOT_YET 0.01

/* Asks for pictures of what a turning camera will see, and shows nothing of it. */
static vd_status look_ahead(const deciding *now) {
    vd_impostor_view view = *now->view;
    view.frustum = view.ahead;
    deciding d = *now;
    d.view = &view;
    d.urgency = NOT_YET;
    d.seen = &now->view->frustum;
    if (d.set->ground.count > 0) {
        (void)walk_patch(&d, d.set->ground.count - 1, false);
    }
    if (d.status.code == VD_OK) {
        (void)walk_children(&d, 0, false);
    }
    return d.status;
}

vd_status vd_impostors_decide(vd_impostors *set, const vd_impostor_view *view) {
    const double memory_px = sqrt((double)set->def.memory_bytes / (4.0 * LEAST_KEPT));
    const double screen_px = view->width > view->height ? view->width : view->height;
    deciding d = {.set = set,
                  .view = view,
                  .most_px = memory_px < screen_px ? memory_px : screen_px,
                  .speed = vd_vec3_length(view->velocity),
                  .wishing = true,
                  .urgency = 1.0,
                  .status = vd_success()};
    set->far.count = set->shown.count = set->direct.count = set->lines.count = 0;
    set->wishes.count = set->ranks.count = 0;
    set->stats.decided = set->missing = set->hidden = 0;
    set->stats.error_px = 0.0;
    set->any_loose = false;
    set->things = 0;
    if (set->ground.count > 0) {
        (void)decide_ground(&d);
    }
    if (d.status.code == VD_OK) {
        (void)walk_children(&d, 0, true);
    }
    if (d.status.code == VD_OK && view->turning) {
        d.status = look_ahead(&d);
    }
    return d.status.code == VD_OK ? vd_impostors_sort_shown(set) : d.status;
}

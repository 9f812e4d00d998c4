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
#include "core/core.h"
#include "impostor/impostor_set.h"

#define HYSTERESIS 1.25

typedef enum wanted { NOTHING = 0, PICTURE, CHILDREN, ITSELF } wanted;

typedef struct deciding {
    vd_impostors *set;
    const vd_impostor_view *view;
    bool wishing; /* pictures that are missing are asked for */
    vd_status status;
} deciding;

void vd_impostor_bounds(const vd_impostors *set, const vd_impostor_view *view, uint32_t node,
                        vd_vec3 *min, vd_vec3 *max) {
    const vd_node *n = &set->world->nodes[node];
    const double x = 0.5 * (n->min.x + n->max.x) - view->camera.eye.x;
    const double y = 0.5 * (n->min.y + n->max.y) - view->camera.eye.y;
    const double drop = view->drop_per_m2 * (x * x + y * y);
    *min = n->min;
    *max = n->max;
    min->z -= drop;
    max->z -= drop;
}

static int corners_of(vd_vec3 min, vd_vec3 max, vd_vec3 out[8]) {
    for (int i = 0; i < 8; i++) {
        out[i] = vd_vec3_make((i & 1) != 0 ? max.x : min.x, (i & 2) != 0 ? max.y : min.y,
                              (i & 4) != 0 ? max.z : min.z);
    }
    return 8;
}

double vd_impostor_error(const vd_impostors *set, const vd_impostor_view *view,
                         const vd_impostor_slot *slot) {
    if (slot->now.rgba == NULL) {
        return (double)INFINITY;
    }
    vd_vec3 min, max, corners[8];
    vd_impostor_bounds(set, view, slot->node, &min, &max);
    const int count = corners_of(min, max, corners);
    const double error =
        vd_impostor_plane_error(&slot->now.plane, corners, count, view->eye, view->focal_px);
    /* A picture that is shown larger or smaller than it was made for. */
    const double then = slot->now.plane.distance_m / slot->now.focal_px;
    const double now =
        vd_vec3_length(vd_vec3_subtract(view->eye, slot->now.plane.origin)) / view->focal_px;
    const double ratio = then > now ? then / now : now / then;
    return ratio > 1.5 ? fmax(error, 2.0 * set->def.tolerance_px) : error;
}

/* Finds or makes the slot of a node; null when memory is out. */
static vd_impostor_slot *slot_of(deciding *d, uint32_t node) {
    vd_impostors *set = d->set;
    if (set->slot_of[node] == 0) {
        vd_impostor_slot *made = vd_list_add(set->context, &set->slots, 1, sizeof *made);
        if (made == NULL) {
            d->status = vd_out_of_memory("an impostor", sizeof *made);
            return NULL;
        }
        *made = (vd_impostor_slot){.node = node};
        set->slot_of[node] = (uint32_t)set->slots.count;
    }
    return vd_impostor_slot_at(set, set->slot_of[node] - 1);
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

static wanted want(const deciding *d, uint32_t index, bool was_split) {
    const vd_impostor_view *view = d->view;
    const vd_impostor_def *def = &d->set->def;
    const vd_node *node = &d->set->world->nodes[index];
    const bool placed = node->count == 0;
    const wanted parts = placed ? ITSELF : CHILDREN;
    vd_vec3 min, max;
    vd_impostor_bounds(d->set, view, index, &min, &max);
    if (!vd_frustum_touches_box(&view->frustum, min, max)) {
        return NOTHING;
    }
    if (placed) {
        const vd_object_kind kind =
            (vd_object_kind)d->set->world->entries[node->entry].object->kind;
        if (kind == VD_OBJECT_TERRAIN) {
            return NOTHING; /* the ground is drawn with every picture */
        }
        if (kind == VD_OBJECT_LINE || kind == VD_OBJECT_LABEL) {
            return ITSELF; /* as wide from afar as from near */
        }
    } else if (node->names) {
        return CHILDREN;
    }
    const vd_vec3 middle = vd_vec3_scale(vd_vec3_add(min, max), 0.5);
    const double radius = 0.5 * vd_vec3_length(vd_vec3_subtract(max, min));
    const double z = vd_vec3_length(vd_vec3_subtract(middle, view->eye));
    if (!(z > 1.5 * radius)) {
        return parts;
    }
    const double loosen = was_split ? HYSTERESIS : 1.0;
    const double size_px = 2.0 * radius * view->focal_px / z;
    const double way =
        vd_impostor_free_way(z, radius, view->focal_px, fmax(def->tolerance_px, 0.01));
    const double lasts = way * def->rate_hz / view->speed_mps;
    const double most = placed ? 2.0 * def->most_px : def->most_px;
    return size_px * loosen <= most && lasts >= def->least_reuse * loosen ? PICTURE : parts;
}

/* Asks for the picture of a node; false when there is none to show yet. */
static bool ask(deciding *d, uint32_t index) {
    vd_impostors *set = d->set;
    vd_impostor_slot *slot = slot_of(d, index);
    if (slot == NULL) {
        return false;
    }
    const uint32_t number = set->slot_of[index] - 1;
    const double error = vd_impostor_error(set, d->view, slot);
    const bool wrong =
        !(error <= set->def.tolerance_px) || set->def.tolerance_px == 0.0 || set->def.no_reuse;
    if (wrong && d->wishing && !slot->coming && slot->asked != set->update &&
        set->time_s >= slot->retry_s) {
        slot->asked = set->update;
        vd_vec3 min, max;
        vd_impostor_bounds(set, d->view, index, &min, &max);
        const double radius = 0.5 * vd_vec3_length(vd_vec3_subtract(max, min));
        const double z = vd_vec3_length(
            vd_vec3_subtract(vd_vec3_scale(vd_vec3_add(min, max), 0.5), d->view->eye));
        const double side = 2.0 * radius * d->view->focal_px / fmax(z, 1e-9);
        const double shown = error < 1e3 ? error : 1e3;
        vd_impostor_wish *to = vd_list_add(set->context, &set->wishes, 1, sizeof *to);
        if (to == NULL) {
            d->status = vd_out_of_memory("an impostor", sizeof *to);
            return false;
        }
        *to = (vd_impostor_wish){number, shown * side * side};
    }
    return slot->now.rgba != NULL || slot->empty;
}

static void show(deciding *d, uint32_t index) {
    vd_impostor_slot *slot = slot_of(d, index);
    if (slot == NULL || slot->empty) {
        return;
    }
    const double error = vd_impostor_error(d->set, d->view, slot);
    slot->used = d->set->update;
    d->set->stats.error_px = error > d->set->stats.error_px ? error : d->set->stats.error_px;
    add_index(d, &d->set->shown, d->set->slot_of[index] - 1);
}

/* ---- the tree ---------------------------------------------------------------------------------*/

static bool walk(deciding *d, uint32_t index, bool emit);

typedef struct far_child {
    double distance2;
    uint32_t index;
} far_child;

/* Children, far ones first; of equals the later first. At most VD_OBJECT_MAX_CHILDREN. */
static uint32_t sort_children(const deciding *d, const vd_node *node, far_child *out) {
    for (uint32_t i = 0; i < node->count; i++) {
        const vd_node *child = &d->set->world->nodes[node->first + i];
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
            add_index(d, &set->direct, index);
        }
        return true;
    }
    const bool has_picture = known != 0 && (vd_impostor_slot_at(set, known - 1)->now.rgba != NULL ||
                                            vd_impostor_slot_at(set, known - 1)->empty);
    if (as == PICTURE) {
        const bool ready = ask(d, index);
        if (ready && emit) {
            show(d, index);
        }
        if (ready) {
            vd_impostor_slot_at(set, set->slot_of[index] - 1)->split = false;
            return true;
        }
        if (emit) { /* until it is there: what was shown, or the thing itself */
            if (set->world->nodes[index].count > 0) {
                const bool wishing = d->wishing;
                d->wishing = false;
                (void)walk_children(d, index, true);
                d->wishing = wishing;
            } else {
                add_index(d, &set->direct, index);
            }
        }
        return false;
    }
    if (has_picture && !was_split) { /* children first have to be ready */
        const bool ready = walk_children(d, index, false);
        if (!ready) {
            if (emit) {
                show(d, index);
            }
            return false;
        }
    }
    vd_impostor_slot *slot = slot_of(d, index);
    if (slot == NULL) {
        return false;
    }
    slot->split = emit ? true : slot->split;
    return emit ? walk_children(d, index, true) : walk_children(d, index, false);
}

vd_status vd_impostors_decide(vd_impostors *set, const vd_impostor_view *view) {
    deciding d = {.set = set, .view = view, .wishing = true, .status = vd_success()};
    set->shown.count = set->direct.count = set->wishes.count = 0;
    set->stats.decided = 0;
    set->stats.error_px = 0.0;
    (void)walk_children(&d, 0, true);
    return d.status;
}

/* impostor_judge.c: by what a node is judged: its bounds, its key points, and the plane of its
 * picture; and how wrong that has become.
 */
#include <math.h>
#include "core/core.h"
#include "impostor/impostor_set.h"

/* A plane is not seen flatter than by the arc sine of this. */
#define LEAST_SINE 0.15

/* What faces the eye has the smallest rectangle: another plane must be this much shallower. */
#define MUCH_BETTER 0.6

/* Pictures are made anew when they are shown so many times as large or as small. */
#define MOST_RATIO 1.5

static double drop_at(const vd_impostor_view *view, double x, double y) {
    x -= view->camera.eye.x;
    y -= view->camera.eye.y;
    return view->drop_per_m2 * (x * x + y * y);
}

static double patch_drop(const vd_impostors *set, const vd_impostor_view *view,
                         const vd_patch *patch) {
    const vd_vec3 at = set->ground.anchor;
    return drop_at(view, at.x + 0.5 * ((double)patch->min[0] + (double)patch->max[0]),
                   at.y + 0.5 * ((double)patch->min[1] + (double)patch->max[1]));
}

void vd_impostor_bounds(const vd_impostors *set, const vd_impostor_view *view, uint32_t node,
                        vd_vec3 *min, vd_vec3 *max) {
    double drop;
    if (vd_impostor_is_patch(set, node)) {
        const vd_patch *p = &set->ground.patches[vd_impostor_patch(set, node)];
        const vd_vec3 at = set->ground.anchor;
        *min =
            vd_vec3_add(at, vd_vec3_make((double)p->min[0], (double)p->min[1], (double)p->min[2]));
        *max =
            vd_vec3_add(at, vd_vec3_make((double)p->max[0], (double)p->max[1], (double)p->max[2]));
        drop = patch_drop(set, view, p);
    } else {
        const vd_node *n = &set->world->nodes[node];
        *min = n->min;
        *max = n->max;
        drop = drop_at(view, 0.5 * (n->min.x + n->max.x), 0.5 * (n->min.y + n->max.y));
    }
    min->z -= drop;
    max->z -= drop;
}

int vd_impostor_key_points(const vd_impostors *set, const vd_impostor_view *view, uint32_t node,
                           vd_vec3 out[VD_IMPOSTOR_POINTS]) {
    if (vd_impostor_is_patch(set, node)) {
        const uint32_t patch = vd_impostor_patch(set, node);
        return vd_ground_key_points(&set->ground, patch,
                                    patch_drop(set, view, &set->ground.patches[patch]), out);
    }
    const vd_node *n = &set->world->nodes[node];
    vd_vec3 min, max;
    if (n->planed) { /* tighter than the bounds where it stands askew */
        const double drop = drop_at(view, 0.5 * (n->min.x + n->max.x), 0.5 * (n->min.y + n->max.y));
        const int count = vd_object_key_points(set->world->entries[n->entry].object, out);
        for (int i = 0; i < count; i++) {
            out[i].z -= drop;
        }
        return count;
    }
    vd_impostor_bounds(set, view, node, &min, &max);
    for (int i = 0; i < 8; i++) {
        out[i] = vd_vec3_make((i & 1) != 0 ? max.x : min.x, (i & 2) != 0 ? max.y : min.y,
                              (i & 4) != 0 ? max.z : min.z);
    }
    return 8;
}

/* The plane along a side of a box that is thin that way, such as a wall or a level place with
 * things on it; else the normal stays zero. */
static double best_side(vd_vec3 back, vd_vec3 half, double facing, vd_vec3 *normal) {
    const double to[3] = {back.x, back.y, back.z}, thin[3] = {half.x, half.y, half.z};
    double depth = MUCH_BETTER * facing;
    int side = -1;
    for (int i = 0; i < 3; i++) {
        const double sine = fabs(to[i]);
        if (sine > LEAST_SINE && thin[i] < depth * sine) {
            depth = thin[i] / sine;
            side = i;
        }
    }
    if (side < 0) {
        return facing;
    }
    const double sign = to[side] < 0.0 ? -1.0 : 1.0;
    *normal = vd_vec3_make(side == 0 ? sign : 0.0, side == 1 ? sign : 0.0, side == 2 ? sign : 0.0);
    return depth;
}

/* The plane that an object says, such as a wall's own; `facing` where it is seen from its edge. */
static double own_plane(const vd_impostors *set, const vd_impostor_view *view, uint32_t node,
                        vd_vec3 back, double facing, vd_vec3 *through, vd_vec3 *normal) {
    const int16_t *plane = set->world->entries[set->world->nodes[node].entry].object->plane;
    const vd_vec3 own = vd_vec3_normalize(vd_vec3_make(plane[0], plane[1], plane[2]));
    const double sine = vd_vec3_dot(own, back);
    if (!(fabs(sine) > LEAST_SINE)) {
        return facing;
    }
    vd_vec3 points[VD_IMPOSTOR_POINTS];
    const int count = vd_impostor_key_points(set, view, node, points);
    double least = (double)INFINITY, most = (double)-INFINITY;
    for (int i = 0; i < count; i++) {
        const double off = vd_vec3_dot(vd_vec3_subtract(points[i], *through), own);
        least = off < least ? off : least;
        most = off > most ? off : most;
    }
    *normal = sine < 0.0 ? vd_vec3_scale(own, -1.0) : own;
    *through = vd_vec3_add(*through, vd_vec3_scale(own, 0.5 * (least + most)));
    return 0.5 * (most - least) / fabs(sine);
}

double vd_impostor_best_plane(const vd_impostors *set, const vd_impostor_view *view, uint32_t node,
                              vd_vec3 *through, vd_vec3 *normal) {
    vd_vec3 min, max;
    vd_impostor_bounds(set, view, node, &min, &max);
    *through = vd_vec3_scale(vd_vec3_add(min, max), 0.5);
    *normal = vd_vec3_make(0, 0, 0);
    const vd_vec3 back = vd_vec3_normalize(vd_vec3_subtract(view->eye, *through));
    const vd_vec3 half = vd_vec3_scale(vd_vec3_subtract(max, min), 0.5);
    const double facing = fabs(back.x) * half.x + fabs(back.y) * half.y + fabs(back.z) * half.z;
    if (!vd_impostor_is_patch(set, node) && set->world->nodes[node].planed) {
        return own_plane(set, view, node, back, facing, through, normal);
    }
    if (!vd_impostor_is_patch(set, node)) {
        return best_side(back, half, facing, normal);
    }
    const vd_patch *p = &set->ground.patches[vd_impostor_patch(set, node)];
    const vd_vec3 up =
        vd_vec3_make((double)p->normal[0], (double)p->normal[1], (double)p->normal[2]);
    const double sine = vd_vec3_dot(up, back);
    if (!(sine > LEAST_SINE) || !((double)p->half < facing * sine)) {
        return facing;
    }
    *normal = up;
    *through = vd_vec3_add(*through, vd_vec3_scale(up, (double)p->middle));
    return (double)p->half / sine;
}

/* Whether the eye has come to a side of a patch where its picture ends with the patch: between it
 * and a neighbour's sky would show. */
static bool lacks_a_side(const vd_impostors *set, const vd_impostor_view *view, uint32_t node,
                         const vd_impostor_picture *picture) {
    if (!vd_impostor_is_patch(set, node)) {
        return false;
    }
    const vd_cells cells = vd_ground_cells(&set->ground, vd_impostor_patch(set, node));
    return (vd_impostor_sides(view, &cells) & ~picture->sides) != 0;
}

static double parallax(const vd_impostors *set, const vd_impostor_view *view, uint32_t node,
                       const vd_impostor_picture *picture) {
    vd_vec3 points[VD_IMPOSTOR_POINTS + 1];
    int count = vd_impostor_key_points(set, view, node, points);
    if (!vd_impostor_is_patch(set, node) && count == 8) {
        count = vd_impostor_plane_more_points(&picture->plane, points);
    }
    if (picture->is_hidden) {
        points[count++] = picture->hiding;
    }
    return vd_impostor_plane_error(&picture->plane, points, count, view->seen, view->focal_px);
}

double vd_impostor_parallax(const vd_impostors *set, const vd_impostor_view *view,
                            const vd_impostor_slot *slot) {
    return slot->now.rgba != NULL && !slot->changed ? parallax(set, view, slot->node, &slot->now)
                                                    : (double)INFINITY;
}

double vd_impostor_error(const vd_impostors *set, const vd_impostor_view *view,
                         const vd_impostor_slot *slot) {
    return slot->now.rgba != NULL && !slot->changed
               ? vd_impostor_picture_error(set, view, slot->node, &slot->now)
               : (double)INFINITY;
}

double vd_impostor_picture_error(const vd_impostors *set, const vd_impostor_view *view,
                                 uint32_t node, const vd_impostor_picture *picture) {
    const double error = parallax(set, view, node, picture);
    const double then = picture->plane.distance_m / picture->focal_px;
    const double now =
        vd_vec3_length(vd_vec3_subtract(view->seen, picture->plane.origin)) / view->focal_px;
    const double ratio = then > now ? then / now : now / then;
    return ratio > MOST_RATIO || lacks_a_side(set, view, node, picture)
               ? fmax(error, 2.0 * set->def.tolerance_px)
               : error;
}

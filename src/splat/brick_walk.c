/* brick_walk.c: from an octree and a camera to the nodes of a picture.
 *
 * Order. Cells of an octree do not overlap, so eight children are back to front when those on the
 * far side of each of the three planes between them come first: by the bits of their octants, a set
 * bit meaning far. The planes lie between the boxes of the children, and which side is far follows
 * from the eye (orthographic: from the direction of view).
 *
 * Tried: bricks in van der Corput order, of which any beginning is drawn, so that levels are as
 * fine as one likes. 50 M particles at two pixels: 4.9 M drawn in place of 10.5 M, but RMS 6.5 of
 * 255 (blended: 5.7) in place of 1.9 (2.7), since what is left out is not averaged in. */
#include <math.h>
#include "core/core.h"
#include "splat/brick_walk.h"

/* Children stand behind their parents, so this is one pass. */
void vd_brick_find_parents(const vd_bricks *bricks, uint32_t *parents) {
    parents[0] = 0;
    for (uint32_t i = 0; i < bricks->node_count; i++) {
        for (uint32_t c = 0; c < bricks->nodes[i].child_count; c++) {
            parents[bricks->nodes[i].child_first + c] = i;
        }
    }
}

static vd_vec3 box_middle(const vd_bricks_node *n) {
    return vd_vec3_make(0.5 * (n->min[0] + n->max[0]), 0.5 * (n->min[1] + n->max[1]),
                        0.5 * (n->min[2] + n->max[2]));
}

/* How much lower a node appears. */
double vd_brick_walk_drop(const vd_brick_walk *w, const vd_bricks_node *n) {
    const double x = 0.5 * (n->min[0] + n->max[0]) - w->camera->eye.x;
    const double y = 0.5 * (n->min[1] + n->max[1]) - w->camera->eye.y;
    return w->def->drop_per_m2 * (x * x + y * y);
}

/* The same of its nearest and its farthest corner. */
static void drops_of(const vd_brick_walk *w, const vd_bricks_node *n, double *least, double *most) {
    const double eye[2] = {w->camera->eye.x, w->camera->eye.y};
    *least = *most = 0.0;
    for (int k = 0; k < 2; k++) {
        const double low = n->min[k] - eye[k], high = n->max[k] - eye[k];
        const double near = low > 0.0 ? low : high < 0.0 ? high : 0.0;
        const double far = fabs(low) > fabs(high) ? low : high;
        *least += w->def->drop_per_m2 * (near * near);
        *most += w->def->drop_per_m2 * (far * far);
    }
}

/* Distance along the view axis of the box's middle and, less than that, of its nearest corner. */
double vd_brick_walk_depth(const vd_brick_walk *w, const vd_bricks_node *n, double *nearest) {
    const vd_vec3 f = w->forward;
    const double middle = vd_vec3_dot(f, vd_vec3_subtract(box_middle(n), w->camera->eye));
    const double half =
        0.5 * (fabs(f.x) * (n->max[0] - n->min[0]) + fabs(f.y) * (n->max[1] - n->min[1]) +
               fabs(f.z) * (n->max[2] - n->min[2]));
    *nearest = middle - half;
    return middle;
}

double vd_brick_walk_scale(const vd_brick_walk *w, double depth) {
    if (w->camera->projection == VD_PROJECTION_ORTHOGRAPHIC) {
        return w->scale;
    }
    return w->scale / (depth > w->camera->near_m ? depth : w->camera->near_m);
}

/* Which octants are on the far side of the planes between the children, as a mask of axes: a set
 * bit says that the upper side is far. */
static uint32_t far_sides(const vd_brick_walk *w, const vd_bricks_node *n) {
    const double eye[3] = {w->camera->eye.x, w->camera->eye.y, w->camera->eye.z};
    const double forward[3] = {w->forward.x, w->forward.y, w->forward.z};
    uint32_t far = 0;
    for (int k = 0; k < 3; k++) {
        double low = -(double)INFINITY, high = (double)INFINITY;
        for (uint32_t c = 0; c < n->child_count; c++) {
            const vd_bricks_node *child = &w->view->bricks->nodes[n->child_first + c];
            if ((child->octant >> k & 1) != 0) {
                high = child->min[k] < high ? child->min[k] : high;
            } else {
                low = child->max[k] > low ? child->max[k] : low;
            }
        }
        const bool flat = w->camera->projection == VD_PROJECTION_ORTHOGRAPHIC;
        const bool upper = flat ? forward[k] > 0.0 : eye[k] < 0.5 * (low + high);
        far |= (uint32_t)upper << k;
    }
    return far;
}

uint32_t vd_brick_walk_children(const vd_brick_walk *w, const vd_bricks_node *n, uint32_t out[8]) {
    const uint32_t far = far_sides(w, n);
    uint32_t count = 0;
    for (uint32_t order = 8; order-- > 0;) {
        for (uint32_t c = 0; c < n->child_count; c++) {
            /* A bit is set where the child is on the far side. */
            const uint32_t octant = w->view->bricks->nodes[n->child_first + c].octant;
            if ((~(octant ^ far) & 7) == order && count < 8) {
                out[count++] = n->child_first + c;
            }
        }
    }
    return count;
}

double vd_brick_walk_spread(const vd_brick_walk *w, const vd_bricks_node *n) {
    double nearest;
    (void)vd_brick_walk_depth(w, n, &nearest);
    return (double)n->spread * vd_brick_walk_scale(w, nearest);
}

/* `whole`: it stands below a root. */
static void choose(vd_brick_walk *w, uint32_t index, bool whole) {
    const vd_bricks_node *n = &w->view->bricks->nodes[index];
    const double m = w->margin;
    const vd_mark mark =
        w->def->roots != NULL && !whole ? (vd_mark)w->view->parts->marks[index] : VD_MARK_WHOLE;
    if (mark == VD_MARK_NONE) {
        return;
    }
    double least, most;
    drops_of(w, n, &least, &most);
    const vd_vec3 min = {n->min[0] - m, n->min[1] - m, n->min[2] - m - most};
    const vd_vec3 max = {n->max[0] + m, n->max[1] + m, n->max[2] + m - least};
    if (mark == VD_MARK_WHOLE && !vd_frustum_touches_box(&w->frustum, min, max)) {
        w->stats.culled += n->leaves;
        return;
    }
    const bool serves = mark == VD_MARK_WHOLE || w->def->rest_hidden;
    if (serves && (n->child_count == 0 || vd_brick_walk_spread(w, n) <= w->detail_px)) {
        w->view->parts->chosen[w->count++] = index;
        w->stats.nodes++;
        w->stats.leaves += n->child_count == 0;
        w->stats.particles += n->count;
        w->stats.stands_for += n->leaves;
        return;
    }
    uint32_t children[8];
    const uint32_t count = vd_brick_walk_children(w, n, children);
    for (uint32_t i = 0; i < count; i++) {
        choose(w, children[i], mark == VD_MARK_WHOLE);
    }
}

/* Marks the roots, what has them all below it, and what leads to them; `mark` false: takes all that
 * away again. Walking from the file's root along the marks is back to front whatever the roots. */
static void mark_roots(vd_brick_walk *w, bool mark) {
    struct vd_brick_view_parts *p = w->view->parts;
    const vd_bricks_node *nodes = w->view->bricks->nodes;
    for (size_t i = 0; i < w->def->root_count && mark; i++) {
        uint32_t at = w->def->roots[i];
        while (p->marks[at] != VD_MARK_WHOLE) {
            p->marks[at] = VD_MARK_WHOLE;
            const uint32_t parent = p->parents[at];
            if (at == 0 || ++p->whole[parent] < nodes[parent].child_count) {
                break;
            }
            at = parent;
        }
    }
    for (size_t i = 0; i < w->def->root_count; i++) {
        for (uint32_t at = w->def->roots[i];; at = p->parents[at]) {
            if (!mark) {
                p->marks[at] = VD_MARK_NONE;
                p->whole[at] = 0;
            } else if (p->marks[at] == VD_MARK_NONE) {
                p->marks[at] = VD_MARK_PART;
            }
            if (at == 0) {
                break;
            }
        }
    }
}

void vd_brick_walk_run(vd_brick_walk *w) {
    if (w->def->roots != NULL) {
        mark_roots(w, true);
    }
    choose(w, 0, false);
    if (w->def->roots != NULL) {
        mark_roots(w, false);
    }
}

/* brick_view.c: from an octree and a camera to lists of splats.
 *
 * Order. Cells of an octree do not overlap, so eight children are back to front when those on the
 * far side of each of the three planes between them come first: by the bits of their octants, a set
 * bit meaning far. The planes lie between the boxes of the children, and which side is far follows
 * from the eye (orthographic: from the direction of view).
 *
 * Opacity. A sample stands for k particles, each of which covers a share c of a pixel, opacity
 * times area, at most opacity. k of them, one over the other, cover 1 − (1 − c)^k; so much must the
 * sample. Its area grows with k as far as a pixel; the rest is its opacity. Keeping k·c instead,
 * the sum of the areas, is the same for small c; for dense clouds it would cover too much, by up to
 * 1 / e of a pixel.
 *
 * Tried: bricks in van der Corput order, of which any beginning is drawn, so that levels are as
 * fine as one likes. 50 M particles at two pixels: 4.9 M drawn in place of 10.5 M, but RMS 6.5 of
 * 255 (blended: 5.7) in place of 1.9 (2.7), since what is left out is not averaged in. */
#include <math.h>
#include <string.h>
#include "core/core.h"
#include "core/real.h"
#include "splat/brick_format.h"
#include <veduta/brick_view.h>

#define MEMORY_DEFAULT ((size_t)1 << 30)

/* What is kept of a node: its numbers as floats, its order. */
typedef struct kept_node {
    void *memory; /* null: nothing */
    size_t bytes;
    uint64_t used;     /* the update that last drew it */
    float radius_mean; /* root mean square */
    float *radius;     /* its own; null without */
    float *scaled;     /* radius, as it is drawn */
    float *value, *weight;
    vd_rgba8 *color;
    const uint8_t *classes;
    vd_splat_order order;
} kept_node;

struct vd_brick_view_parts {
    kept_node *kept; /* [node_count] */
    size_t kept_bytes;
    uint64_t update;
    vd_brick_view_def def; /* that kept numbers were made for */
    uint32_t *chosen;      /* [node_count]: of this update, back to front */
    vd_status *statuses;   /* [threads] */
};

/* One walk. */
typedef struct walk {
    vd_brick_view *view;
    const vd_brick_view_def *def;
    const vd_camera *camera;
    vd_frustum frustum;
    vd_vec3 forward;
    double detail_px, margin; /* of boxes: the largest radius */
    double scale;             /* pixels a metre: over depth for perspective */
    uint32_t count;
    vd_brick_view_stats stats;
} walk;

vd_brick_view_def vd_brick_view_def_default(void) {
    return (vd_brick_view_def){
        .detail_px = 0.5, .constant = {255, 255, 255, 255}, .weight = -1, .attribute = -1};
}

double vd_brick_view_radius(const vd_bricks *bricks) {
    /* Discs of this radius just meet on a surface that is sampled evenly. */
    return 0.7 * bricks->spacing;
}

vd_status vd_brick_view_create(const vd_bricks *bricks, vd_brick_view **out) {
    vd_context *context = bricks->context;
    const size_t threads = (size_t)vd_context_threads(context);
    vd_brick_view *view = vd_allocate_zero(context, 1, sizeof *view);
    struct vd_brick_view_parts *p = vd_allocate_zero(context, 1, sizeof *p);
    if (view != NULL && p != NULL) {
        view->bricks = bricks;
        view->parts = p;
        p->kept = vd_allocate_zero(context, bricks->node_count, sizeof *p->kept);
        p->chosen = vd_allocate(context, bricks->node_count, sizeof *p->chosen);
        p->statuses = vd_allocate(context, threads, sizeof *p->statuses);
        view->splats = vd_allocate(context, bricks->node_count, sizeof *view->splats);
        if (p->kept != NULL && p->chosen != NULL && view->splats != NULL && p->statuses != NULL) {
            *out = view;
            return vd_success();
        }
        vd_brick_view_destroy(&view);
    } else {
        vd_release(context, view);
        vd_release(context, p);
    }
    return vd_out_of_memory("a view of bricks", bricks->node_count * sizeof *view->splats);
}

static void forget(vd_brick_view *view, kept_node *k) {
    view->parts->kept_bytes -= k->bytes;
    vd_release(view->bricks->context, k->memory);
    memset(k, 0, sizeof *k);
}

static void forget_all(vd_brick_view *view) {
    for (uint32_t i = 0; view->parts->kept != NULL && i < view->bricks->node_count; i++) {
        forget(view, &view->parts->kept[i]);
    }
}

void vd_brick_view_destroy(vd_brick_view **view) {
    if (view == NULL || *view == NULL) {
        return;
    }
    vd_brick_view *v = *view;
    vd_context *context = v->bricks->context;
    forget_all(v);
    vd_release(context, v->parts->kept);
    vd_release(context, v->parts->chosen);
    vd_release(context, v->parts->statuses);
    vd_release(context, v->parts);
    vd_release(context, v->splats);
    vd_release(context, v);
    *view = NULL;
}

/* ---- choosing -----------------------------------------------------------------------------------
 */

static vd_vec3 box_middle(const vd_bricks_node *n) {
    return vd_vec3_make(0.5 * (n->min[0] + n->max[0]), 0.5 * (n->min[1] + n->max[1]),
                        0.5 * (n->min[2] + n->max[2]));
}

/* Distance along the view axis of the box's middle and, less than that, of its nearest corner. */
static double box_depth(const walk *w, const vd_bricks_node *n, double *nearest) {
    const vd_vec3 f = w->forward;
    const double middle = vd_vec3_dot(f, vd_vec3_subtract(box_middle(n), w->camera->eye));
    const double half =
        0.5 * (fabs(f.x) * (n->max[0] - n->min[0]) + fabs(f.y) * (n->max[1] - n->min[1]) +
               fabs(f.z) * (n->max[2] - n->min[2]));
    *nearest = middle - half;
    return middle;
}

static double pixels_per_metre(const walk *w, double depth) {
    if (w->camera->projection == VD_PROJECTION_ORTHOGRAPHIC) {
        return w->scale;
    }
    return w->scale / (depth > w->camera->near_m ? depth : w->camera->near_m);
}

/* Which octants are on the far side of the planes between the children, as a mask of axes: a set
 * bit says that the upper side is far. */
static uint32_t far_sides(const walk *w, const vd_bricks_node *n) {
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

static bool is_fine(const walk *w, const vd_bricks_node *n) {
    double nearest;
    (void)box_depth(w, n, &nearest);
    return (double)n->spread * pixels_per_metre(w, nearest) <= w->detail_px;
}

static void choose(walk *w, uint32_t index) {
    const vd_bricks_node *n = &w->view->bricks->nodes[index];
    const double m = w->margin;
    const vd_vec3 min = {n->min[0] - m, n->min[1] - m, n->min[2] - m};
    const vd_vec3 max = {n->max[0] + m, n->max[1] + m, n->max[2] + m};
    if (!vd_frustum_touches_box(&w->frustum, min, max)) {
        w->stats.culled += n->leaves;
        return;
    }
    if (n->child_count == 0 || is_fine(w, n)) {
        w->view->parts->chosen[w->count++] = index;
        w->stats.nodes++;
        w->stats.leaves += n->child_count == 0;
        w->stats.particles += n->count;
        w->stats.stands_for += n->leaves;
        return;
    }
    const uint32_t far = far_sides(w, n);
    for (uint32_t order = 8; order-- > 0;) {
        for (uint32_t c = 0; c < n->child_count; c++) {
            /* A bit is set where the child is on the far side. */
            const uint32_t octant = w->view->bricks->nodes[n->child_first + c].octant;
            if ((~(octant ^ far) & 7) == order) {
                choose(w, n->child_first + c);
            }
        }
    }
}

/* ---- preparing ----------------------------------------------------------------------------------
 */

typedef struct preparation {
    const walk *w;
    int red, green, blue, radius; /* attributes, −1 none */
} preparation;

static size_t kept_floats(const preparation *p) {
    const vd_brick_view_def *d = p->w->def;
    return (p->radius >= 0 ? 2u : 0u) + (d->color == VD_BRICK_COLOR_VALUE) +
           (d->color == VD_BRICK_COLOR_RGB) + (d->weight >= 0 || d->mode == VD_SPLAT_DENSITY) +
           (d->mode == VD_SPLAT_ALPHA);
}

static void fill_colors(const preparation *p, const vd_brick *brick, kept_node *k) {
    const uint8_t *r = brick->values[p->red], *g = brick->values[p->green],
                  *b = brick->values[p->blue];
    for (uint32_t i = 0; i < brick->count; i++) {
        k->color[i] = (vd_rgba8){r[i], g[i], b[i], 255};
    }
}

static void fill_kept(const preparation *p, const vd_brick *brick, const vd_bricks_node *n,
                      kept_node *k) {
    const vd_bricks *bricks = p->w->view->bricks;
    const vd_brick_view_def *d = p->w->def;
    float *at = k->memory;
    if (p->radius >= 0) {
        k->radius = at;
        k->scaled = at + brick->count;
        at += 2 * (size_t)brick->count;
        vd_bricks_values(bricks, brick, p->radius, k->radius);
        double sum = 0.0;
        for (uint32_t i = 0; i < brick->count; i++) {
            sum += (double)k->radius[i] * (double)k->radius[i];
        }
        k->radius_mean = (float)sqrt(sum / brick->count);
    }
    if (d->color == VD_BRICK_COLOR_VALUE) {
        k->value = at;
        at += brick->count;
        vd_bricks_values(bricks, brick, d->attribute, k->value);
    } else if (d->color == VD_BRICK_COLOR_RGB) {
        k->color = (vd_rgba8 *)at;
        at += brick->count;
        fill_colors(p, brick, k);
    } else if (d->color == VD_BRICK_COLOR_CLASS) {
        k->classes = brick->values[d->attribute];
    }
    if (d->weight >= 0 || d->mode == VD_SPLAT_DENSITY) {
        const float each = (float)((double)n->leaves / n->count);
        k->weight = at;
        at += brick->count;
        if (d->weight >= 0) {
            vd_bricks_values(bricks, brick, d->weight, k->weight);
        }
        for (uint32_t i = 0; i < brick->count; i++) {
            k->weight[i] = d->weight >= 0 ? each * k->weight[i] : each;
        }
    }
    if (d->mode == VD_SPLAT_ALPHA) {
        k->order.index = (uint32_t *)at;
    }
}

/* Sets radius and opacity of a list: see above. */
static void set_opacity(const walk *w, const vd_bricks_node *n, kept_node *k, vd_splats *s) {
    /* Densities of particles without a size are those of points. */
    const double suits =
        w->def->mode == VD_SPLAT_DENSITY ? 0.0 : vd_brick_view_radius(w->view->bricks);
    const double own = k->radius != NULL        ? (double)k->radius_mean
                       : w->def->radius_m > 0.0 ? w->def->radius_m
                                                : suits;
    const double grow = w->def->radius_scale > 0.0 ? w->def->radius_scale : 1.0;
    const double radius = own * grow;
    double nearest, factor = 1.0;
    const double pixels = pixels_per_metre(w, box_depth(w, n, &nearest));
    const double each = (double)n->leaves / n->count;
    const double opacity = w->def->opacity > 0.0 ? w->def->opacity : 1.0;
    s->opacity = (float)opacity;
    if (w->def->mode == VD_SPLAT_ALPHA && each > 1.0 && radius > 0.0) {
        const double side = 2.0 * radius * pixels;
        const double area = side < 1.0 ? side * side : 1.0;
        const double covered =
            opacity * area < 1.0
                ? 1.0 - vd_exp(each * 0.69314718055994530942 * vd_log2(1.0 - opacity * area))
                : 1.0;
        /* As far as a pixel, for the nearest of them: larger ones are drawn more slowly. */
        const double pixel = 1.0 / (2.0 * radius * pixels_per_metre(w, nearest));
        factor = sqrt(each) < pixel ? sqrt(each) : pixel > 1.0 ? pixel : 1.0;
        const double share = area * factor * factor < 1.0 ? area * factor * factor : 1.0;
        s->opacity = (float)(covered / share < 1.0 ? covered / share : 1.0);
    }
    s->radius_m = (float)(radius * factor);
    if (k->radius != NULL) {
        const float f = (float)(grow * factor);
        for (uint32_t i = 0; i < n->count; i++) {
            k->scaled[i] = f * k->radius[i];
        }
        s->radius = k->scaled;
    }
}

static void prepare_node(void *user, int index, int worker) {
    const preparation *p = user;
    const walk *w = p->w;
    struct vd_brick_view_parts *parts = w->view->parts;
    const uint32_t node = parts->chosen[index];
    const vd_bricks_node *n = &w->view->bricks->nodes[node];
    kept_node *k = &parts->kept[node];
    vd_brick brick;
    vd_status status = vd_bricks_brick(w->view->bricks, node, &brick);
    if (status.code != VD_OK) {
        parts->statuses[worker] = status;
        w->view->splats[index] = vd_splats_default();
        return;
    }
    if (k->used == 0) {
        fill_kept(p, &brick, n, k);
    }
    vd_splats s = vd_splats_default();
    s.count = n->count;
    s.anchor = vd_vec3_make(n->min[0], n->min[1], n->min[2]);
    s.x16 = brick.x;
    s.y16 = brick.y;
    s.z16 = brick.z;
    s.has_bounds = true;
    for (int a = 0; a < 3; a++) {
        s.step[a] = (float)brick.step[a];
        s.max[a] = (float)(n->max[a] - n->min[a]);
    }
    s.color = k->color;
    s.classes = k->classes;
    s.value = k->value;
    s.weight = k->weight;
    if (w->def->color == VD_BRICK_COLOR_HEIGHT) {
        s.value16 = brick.z;
        s.value_origin = (float)brick.origin[2];
        s.value_step = (float)brick.step[2];
    }
    s.constant = w->def->constant;
    s.order = k->order.index != NULL ? &k->order : NULL;
    set_opacity(w, n, k, &s);
    w->view->splats[index] = s;
}

/* Gives the chosen nodes memory; what was not drawn lately goes first when there is too much. */
static vd_status find_memory(walk *w, const preparation *p) {
    struct vd_brick_view_parts *parts = w->view->parts;
    const vd_bricks *bricks = w->view->bricks;
    const size_t each = 4 * kept_floats(p);
    const size_t most = w->def->memory_bytes > 0 ? w->def->memory_bytes : MEMORY_DEFAULT;
    parts->update++;
    size_t needed = 0;
    for (uint32_t i = 0; i < w->count; i++) {
        const kept_node *k = &parts->kept[parts->chosen[i]];
        needed += k->used == 0 ? each * bricks->nodes[parts->chosen[i]].count : 0;
    }
    if (parts->kept_bytes + needed > most) {
        for (uint32_t i = 0; i < w->count; i++) {
            kept_node *k = &parts->kept[parts->chosen[i]];
            k->used = k->used != 0 ? parts->update : 0;
        }
        for (uint32_t i = 0; i < bricks->node_count; i++) {
            kept_node *k = &parts->kept[i];
            if (k->used != 0 && k->used < parts->update) {
                forget(w->view, k);
            }
        }
    }
    for (uint32_t i = 0; i < w->count && each > 0; i++) {
        kept_node *k = &parts->kept[parts->chosen[i]];
        if (k->memory == NULL) {
            k->bytes = each * bricks->nodes[parts->chosen[i]].count;
            k->memory = vd_allocate(bricks->context, k->bytes, 1);
            if (k->memory == NULL) {
                k->bytes = 0;
                return vd_out_of_memory("bricks", needed);
            }
            parts->kept_bytes += k->bytes;
        }
    }
    return vd_success();
}

static vd_status prepare(walk *w, vd_job *job) {
    struct vd_brick_view_parts *parts = w->view->parts;
    const vd_bricks *bricks = w->view->bricks;
    preparation p = {w, vd_bricks_find(bricks, "red"), vd_bricks_find(bricks, "green"),
                     vd_bricks_find(bricks, "blue"), -1};
    for (uint32_t a = 0; a < bricks->attribute_count && w->def->radius_m <= 0.0; a++) {
        p.radius = bricks->attributes[a].kind == VD_ATTRIBUTE_RADIUS ? (int)a : p.radius;
    }
    vd_status status = find_memory(w, &p);
    if (status.code != VD_OK) {
        return status;
    }
    const int threads = vd_context_threads(bricks->context);
    for (int t = 0; t < threads; t++) {
        parts->statuses[t] = vd_success();
    }
    status = vd_parallel_for(bricks->context, job, (int)w->count, prepare_node, &p);
    for (int t = 0; t < threads && status.code == VD_OK; t++) {
        status = parts->statuses[t];
    }
    for (uint32_t i = 0; i < w->count && status.code == VD_OK; i++) {
        kept_node *k = &parts->kept[parts->chosen[i]];
        w->stats.decoded += k->used == 0;
        k->used = parts->update;
    }
    return status;
}

/* Whether numbers that were kept for one def serve another. */
static bool same_numbers(const vd_brick_view_def *a, const vd_brick_view_def *b) {
    return a->mode == b->mode && a->color == b->color && a->attribute == b->attribute &&
           a->weight == b->weight && (a->radius_m > 0.0) == (b->radius_m > 0.0);
}

static vd_status check(const vd_bricks *b, const vd_brick_view_def *d, int width, int height) {
    const int count = (int)b->attribute_count;
    const bool by_attribute = d->color == VD_BRICK_COLOR_CLASS || d->color == VD_BRICK_COLOR_VALUE;
    if (width < 1 || height < 1) {
        return vd_failure(VD_ERROR_ARGUMENT, "a picture has sides of at least 1, not %d and %d",
                          width, height);
    }
    if ((unsigned)d->color >= VD_BRICK_COLOR_COUNT ||
        (by_attribute && (d->attribute < 0 || d->attribute >= count)) || d->weight >= count) {
        return vd_failure(VD_ERROR_ARGUMENT, "a brick view's colour or weight names an attribute "
                                             "that the bricks do not have");
    }
    if (d->color == VD_BRICK_COLOR_CLASS && b->attributes[d->attribute].storage != VD_BRICK_U8) {
        return vd_failure(VD_ERROR_ARGUMENT, "%.40s is no class of 0 … 255; colour by its value",
                          b->attributes[d->attribute].name);
    }
    static const char *const channels[3] = {"red", "green", "blue"};
    bool colored = true;
    for (int c = 0; c < 3; c++) {
        const int at = vd_bricks_find(b, channels[c]);
        colored &= at >= 0 && b->attributes[at].storage == VD_BRICK_U8;
    }
    if (d->color == VD_BRICK_COLOR_RGB && !colored) {
        return vd_failure(VD_ERROR_ARGUMENT, "the bricks have no colours of their own");
    }
    if (!isfinite(d->radius_m) || !isfinite(d->radius_scale) || !isfinite(d->opacity) ||
        d->opacity > 1.0 || isnan(d->detail_px)) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "a brick view's radius, opacity or detail is no number "
                          "in its range");
    }
    return vd_success();
}

vd_status vd_brick_view_update(vd_brick_view *view, vd_job *job, const vd_brick_view_def *def,
                               const vd_camera *camera, int width, int height,
                               vd_brick_view_stats *stats) {
    const vd_bricks *bricks = view->bricks;
    vd_status status = check(bricks, def, width, height);
    if (status.code == VD_OK) {
        status = vd_camera_validate(camera);
    }
    if (status.code != VD_OK) {
        return status;
    }
    if (!same_numbers(def, &view->parts->def)) {
        forget_all(view);
    }
    view->parts->def = *def;
    const double fx = camera->lens.fx, fy = camera->lens.fy;
    walk w = {.view = view,
              .def = def,
              .camera = camera,
              .frustum = vd_camera_frustum(camera, width, height),
              .forward = vd_quat_rotate(camera->orientation, vd_vec3_make(0.0, 0.0, 1.0)),
              .detail_px = def->detail_px == 0.0 ? 0.5 : def->detail_px,
              .scale = fx > fy ? fx : fy};
    const double grow = def->radius_scale > 0.0 ? def->radius_scale : 1.0;
    double radius = def->radius_m > 0.0 ? def->radius_m : vd_brick_view_radius(bricks);
    for (uint32_t i = 0; i < bricks->node_count && def->radius_m <= 0.0; i++) {
        radius = (double)bricks->nodes[i].radius_max > radius ? (double)bricks->nodes[i].radius_max
                                                              : radius;
    }
    w.margin = 2.5 * grow * radius; /* the widest kernel */
    choose(&w, 0);
    status = prepare(&w, job);
    view->count = status.code == VD_OK ? (int)w.count : 0;
    if (status.code == VD_OK && stats != NULL) {
        *stats = w.stats;
    }
    return status;
}

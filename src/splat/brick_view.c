/* brick_view.c: from an octree and a camera to lists of splats. */
#include <math.h>
#include <string.h>
#include "core/core.h"
#include "splat/brick_pack.h"
#include "splat/brick_walk.h"
#include "splat/splat_internal.h"

#define MEMORY_DEFAULT ((size_t)1 << 30)

vd_brick_view_def vd_brick_view_def_default(void) {
    return (vd_brick_view_def){
        .detail_px = 0.5, .constant = {255, 255, 255, 255}, .weight = -1, .attribute = -1};
}

double vd_brick_view_radius(const vd_bricks *bricks) {
    /* Discs of this radius just meet on a surface that is sampled evenly. */
    return 0.7 * bricks->spacing;
}

vd_status vd_brick_view_create(vd_context *context, const vd_bricks *bricks, vd_brick_view **out) {
    const size_t threads = (size_t)vd_context_threads(context);
    vd_brick_view *view = vd_allocate_zero(context, 1, sizeof *view);
    struct vd_brick_view_parts *p = vd_allocate_zero(context, 1, sizeof *p);
    if (view != NULL && p != NULL) {
        view->bricks = bricks;
        view->parts = p;
        p->context = context;
        p->kept = vd_allocate_zero(context, bricks->node_count, sizeof *p->kept);
        p->chosen = vd_allocate(context, bricks->node_count, sizeof *p->chosen);
        p->statuses = vd_allocate(context, threads, sizeof *p->statuses);
        p->parents = vd_allocate(context, bricks->node_count, sizeof *p->parents);
        p->marks = vd_allocate_zero(context, bricks->node_count, 1);
        p->whole = vd_allocate_zero(context, bricks->node_count, 1);
        view->splats = vd_allocate(context, bricks->node_count, sizeof *view->splats);
        if (p->kept != NULL && p->chosen != NULL && view->splats != NULL && p->statuses != NULL &&
            p->parents != NULL && p->marks != NULL && p->whole != NULL) {
            vd_brick_find_parents(bricks, p->parents);
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

static void forget(vd_brick_view *view, vd_kept_node *k) {
    view->parts->kept_bytes -= k->bytes;
    vd_release(view->parts->context, k->memory);
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
    vd_context *context = v->parts->context;
    forget_all(v);
    vd_release(context, v->parts->kept);
    vd_release(context, v->parts->chosen);
    vd_release(context, v->parts->statuses);
    vd_release(context, v->parts->parents);
    vd_release(context, v->parts->marks);
    vd_release(context, v->parts->whole);
    vd_release(context, v->parts);
    vd_release(context, v->splats);
    vd_release(context, v);
    *view = NULL;
}

/* ---- preparing ----------------------------------------------------------------------------------
 */

typedef struct preparation {
    const vd_brick_walk *w;
    int red, green, blue, radius; /* attributes, −1 none */
} preparation;

static size_t kept_floats(const preparation *p) {
    const vd_brick_view_def *d = p->w->def;
    return (p->radius >= 0 ? 2u : 0u) + (d->color == VD_BRICK_COLOR_VALUE) +
           (d->color == VD_BRICK_COLOR_RGB) + (d->weight >= 0 || d->mode == VD_SPLAT_DENSITY) +
           (d->mode == VD_SPLAT_ALPHA);
}

static void fill_colors(const preparation *p, const vd_brick *brick, vd_kept_node *k) {
    const uint8_t *r = brick->values[p->red], *g = brick->values[p->green],
                  *b = brick->values[p->blue];
    for (uint32_t i = 0; i < brick->count; i++) {
        k->color[i] = (vd_rgba8){r[i], g[i], b[i], 255};
    }
}

static void fill_kept(const preparation *p, const vd_brick *brick, const vd_bricks_node *n,
                      vd_kept_node *k) {
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

/* Sets radius and opacity of a list: see brick_block.c. */
static void set_opacity(const vd_brick_walk *w, const vd_bricks_node *n, vd_kept_node *k,
                        vd_splats *s) {
    /* Densities of particles without a size are those of points. */
    const double suits =
        w->def->mode == VD_SPLAT_DENSITY ? 0.0 : vd_brick_view_radius(w->view->bricks);
    const double own = k->radius != NULL        ? (double)k->radius_mean
                       : w->def->radius_m > 0.0 ? w->def->radius_m
                                                : suits;
    const double grow = w->def->radius_scale > 0.0 ? w->def->radius_scale : 1.0;
    const double radius = own * grow;
    double nearest, factor = 1.0;
    const double pixels = vd_brick_walk_scale(w, vd_brick_walk_depth(w, n, &nearest));
    const double each = (double)n->leaves / n->count;
    const double opacity = w->def->opacity > 0.0 ? w->def->opacity : 1.0;
    s->opacity = (float)opacity;
    if (w->def->mode == VD_SPLAT_ALPHA) {
        vd_brick_stand_in(radius, each, opacity, pixels, vd_brick_walk_scale(w, nearest), &factor,
                          &s->opacity);
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
    const vd_brick_walk *w = p->w;
    struct vd_brick_view_parts *parts = w->view->parts;
    const uint32_t node = parts->chosen[index];
    const vd_bricks_node *n = &w->view->bricks->nodes[node];
    vd_kept_node *k = &parts->kept[node];
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
    s.anchor = vd_vec3_make(n->min[0], n->min[1], n->min[2] - vd_brick_walk_drop(w, n));
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
static vd_status find_memory(vd_brick_walk *w, const preparation *p) {
    struct vd_brick_view_parts *parts = w->view->parts;
    const vd_bricks *bricks = w->view->bricks;
    const size_t each = 4 * kept_floats(p);
    const size_t most = w->def->memory_bytes > 0 ? w->def->memory_bytes : MEMORY_DEFAULT;
    parts->update++;
    size_t needed = 0;
    for (uint32_t i = 0; i < w->count; i++) {
        const vd_kept_node *k = &parts->kept[parts->chosen[i]];
        needed += k->used == 0 ? each * bricks->nodes[parts->chosen[i]].count : 0;
    }
    if (parts->kept_bytes + needed > most) {
        for (uint32_t i = 0; i < w->count; i++) {
            vd_kept_node *k = &parts->kept[parts->chosen[i]];
            k->used = k->used != 0 ? parts->update : 0;
        }
        for (uint32_t i = 0; i < bricks->node_count; i++) {
            vd_kept_node *k = &parts->kept[i];
            if (k->used != 0 && k->used < parts->update) {
                forget(w->view, k);
            }
        }
    }
    for (uint32_t i = 0; i < w->count && each > 0; i++) {
        vd_kept_node *k = &parts->kept[parts->chosen[i]];
        if (k->memory == NULL) {
            k->bytes = each * bricks->nodes[parts->chosen[i]].count;
            k->memory = vd_allocate(parts->context, k->bytes, 1);
            if (k->memory == NULL) {
                k->bytes = 0;
                return vd_out_of_memory("bricks", needed);
            }
            parts->kept_bytes += k->bytes;
        }
    }
    return vd_success();
}

static vd_status prepare(vd_brick_walk *w, vd_job *job) {
    struct vd_brick_view_parts *parts = w->view->parts;
    const vd_bricks *bricks = w->view->bricks;
    preparation p = {w, vd_bricks_find(bricks, "red"), vd_bricks_find(bricks, "green"),
                     vd_bricks_find(bricks, "blue"), vd_brick_radius_of(bricks, w->def)};
    vd_status status = find_memory(w, &p);
    if (status.code != VD_OK) {
        return status;
    }
    const int threads = vd_context_threads(parts->context);
    for (int t = 0; t < threads; t++) {
        parts->statuses[t] = vd_success();
    }
    status = vd_parallel_for(parts->context, job, (int)w->count, prepare_node, &p);
    for (int t = 0; t < threads && status.code == VD_OK; t++) {
        status = parts->statuses[t];
    }
    for (uint32_t i = 0; i < w->count && status.code == VD_OK; i++) {
        vd_kept_node *k = &parts->kept[parts->chosen[i]];
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

static vd_status check_size(int width, int height) {
    return width >= 1 && height >= 1
               ? vd_success()
               : vd_failure(VD_ERROR_ARGUMENT, "a picture has sides of at least 1, not %d and %d",
                            width, height);
}

vd_status vd_brick_view_check(const vd_bricks *b, const vd_brick_view_def *d) {
    const int count = (int)b->attribute_count;
    const bool by_attribute = d->color == VD_BRICK_COLOR_CLASS || d->color == VD_BRICK_COLOR_VALUE;
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
        d->opacity > 1.0 || isnan(d->detail_px) || !isfinite(d->drop_per_m2)) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "a brick view's radius, opacity, detail or drop is no number "
                          "in its range");
    }
    for (size_t i = 0; d->roots != NULL && i < d->root_count; i++) {
        if (d->roots[i] >= b->node_count) {
            return vd_failure(VD_ERROR_ARGUMENT,
                              "a brick view's root %u is not among the %u nodes; give another",
                              d->roots[i], b->node_count);
        }
    }
    return vd_success();
}

double vd_brick_view_reach(const vd_bricks *bricks, const vd_brick_view_def *def) {
    const double grow = def->radius_scale > 0.0 ? def->radius_scale : 1.0;
    double radius = def->radius_m > 0.0 ? def->radius_m : vd_brick_view_radius(bricks);
    for (uint32_t i = 0; i < bricks->node_count && def->radius_m <= 0.0; i++) {
        radius = (double)bricks->nodes[i].radius_max > radius ? (double)bricks->nodes[i].radius_max
                                                              : radius;
    }
    return vd_splat_support(VD_SPLAT_GAUSSIAN) * grow * radius; /* the widest kernel */
}

vd_status vd_brick_view_update(vd_brick_view *view, vd_job *job, const vd_brick_view_def *def,
                               const vd_camera *camera, int width, int height,
                               vd_brick_view_stats *stats) {
    const vd_bricks *bricks = view->bricks;
    vd_status status = check_size(width, height);
    if (status.code == VD_OK) {
        status = vd_brick_view_check(bricks, def);
    }
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
    vd_brick_walk w = {.view = view,
                       .def = def,
                       .camera = camera,
                       .frustum = vd_camera_frustum(camera, width, height),
                       .forward = vd_quat_rotate(camera->orientation, vd_vec3_make(0.0, 0.0, 1.0)),
                       .detail_px = def->detail_px == 0.0 ? 0.5 : def->detail_px,
                       .scale = fx > fy ? fx : fy};
    w.margin = vd_brick_view_reach(bricks, def);
    vd_brick_walk_run(&w);
    status = prepare(&w, job);
    view->count = status.code == VD_OK ? (int)w.count : 0;
    if (status.code == VD_OK && stats != NULL) {
        *stats = w.stats;
    }
    return status;
}

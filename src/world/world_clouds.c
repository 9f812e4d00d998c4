/* world_clouds.c: particles in a world's picture.
 *
 * They are blended, and by the million: neither a target's samples nor its lists of blended things
 * are for them. When all else is in the frame, the subtrees that were gathered are walked as one
 * tree, which brings them back to front, and drawn over it by the splatter, which asks the frame's
 * depth what hides them. What covers in part between them and the eye, leaves of a sprite, glass,
 * is behind them then: the price of one pass.
 *
 * Files do not mix: each is drawn by itself, the farthest first.
 */
#include <math.h>
#include <stdlib.h>
#include "world/world_renderer.h"

/* What of one asset was gathered: clouds[first … first + count − 1]. */
typedef struct cloud_run {
    double far; /* the greater the farther */
    size_t first, count;
    uint32_t asset;
} cloud_run;

static int compare_clouds(const void *a, const void *b) {
    const vd_cloud *x = *(const vd_cloud *const *)a, *y = *(const vd_cloud *const *)b;
    return x->bricks != y->bricks ? (x->bricks > y->bricks) - (x->bricks < y->bricks)
                                  : (x->root > y->root) - (x->root < y->root);
}

static int compare_runs(const void *a, const void *b) {
    const cloud_run *x = a, *y = b;
    return x->far != y->far ? (x->far < y->far) - (x->far > y->far)
                            : (x->asset > y->asset) - (x->asset < y->asset);
}

/* How far the middle of a run's bounds is. */
static double distance_of(const vd_pass *pass, const vd_cloud *const *clouds, size_t count) {
    const vd_camera *camera = pass->camera;
    vd_vec3 min = {0, 0, 0}, max = {0, 0, 0};
    for (size_t i = 0; i < count; i++) {
        vd_vec3 low, high;
        vd_object_bounds(&clouds[i]->head, &low, &high);
        min = i > 0 ? vd_vec3_min(min, low) : low;
        max = i > 0 ? vd_vec3_max(max, high) : high;
    }
    const vd_vec3 middle = vd_vec3_scale(vd_vec3_add(min, max), 0.5);
    const vd_vec3 to = vd_vec3_subtract(middle, camera->eye);
    const vd_vec3 forward = vd_quat_rotate(camera->orientation, vd_vec3_make(0, 0, 1));
    return camera->projection == VD_PROJECTION_ORTHOGRAPHIC ? vd_vec3_dot(to, forward)
                                                            : vd_vec3_dot(to, to);
}

/* Sorts the clouds by asset and lists the assets, the farthest first. */
static vd_status find_runs(vd_world_renderer *r, const vd_pass *pass) {
    const vd_cloud **clouds = pass->clouds->data;
    const size_t count = pass->clouds->count;
    r->cloud_runs.count = 0;
    qsort(clouds, count, sizeof *clouds, compare_clouds);
    for (size_t first = 0, end; first < count; first = end) {
        end = first + 1;
        while (end < count && clouds[end]->bricks == clouds[first]->bricks) {
            end++;
        }
        cloud_run *run = vd_list_add(r->context, &r->cloud_runs, 1, sizeof *run);
        if (run == NULL) {
            return vd_out_of_memory("a picture's particles", sizeof *run);
        }
        *run = (cloud_run){.far = distance_of(pass, clouds + first, end - first),
                           .first = first,
                           .count = end - first,
                           .asset = clouds[first]->bricks};
    }
    qsort(r->cloud_runs.data, r->cloud_runs.count, sizeof(cloud_run), compare_runs);
    return vd_success();
}

static vd_status reserve(vd_world_renderer *r, uint32_t asset) {
    vd_status status = vd_success();
    if (r->splatter == NULL) {
        status = vd_splatter_create(r->context, &r->splatter);
    }
    if (status.code == VD_OK && r->views == NULL) {
        const size_t count = vd_world_asset_count(r->world);
        r->views = vd_allocate_zero(r->context, count, sizeof(vd_brick_view *));
        if (r->views == NULL) {
            return vd_out_of_memory("views of bricks", count * sizeof(vd_brick_view *));
        }
    }
    if (status.code == VD_OK && r->views[asset] == NULL) {
        status = vd_brick_view_create(r->context, r->world->assets[asset].bricks->bricks,
                                      &r->views[asset]);
    }
    return status;
}

static vd_status draw_run(vd_world_renderer *r, vd_job *job, const vd_pass *pass,
                          const cloud_run *run, vd_frame *frame) {
    const vd_cloud *const *clouds = pass->clouds->data;
    const vd_brick_asset *asset = r->world->assets[run->asset].bricks;
    vd_brick_view_stats stats;
    vd_status status = reserve(r, run->asset);
    if (status.code != VD_OK) {
        return status;
    }
    r->roots.count = 0;
    uint32_t *roots = vd_list_add(r->context, &r->roots, run->count, sizeof *roots);
    if (roots == NULL) {
        return vd_out_of_memory("a picture's particles", run->count * sizeof *roots);
    }
    for (size_t i = 0; i < run->count; i++) {
        roots[i] = clouds[run->first + i]->root;
    }
    vd_brick_view *view = r->views[run->asset];
    vd_brick_view_def def = asset->view;
    def.roots = roots;
    def.root_count = run->count;
    def.rest_hidden = pass->whole && asset->placed;
    def.drop_per_m2 = pass->drop_per_m2;
    if (r->cloud_detail > 1.0) {
        def.detail_px = r->cloud_detail * (def.detail_px > 0.0 ? def.detail_px : 0.5);
    }
    status =
        vd_brick_view_update(view, job, &def, pass->camera, frame->width, frame->height, &stats);
    if (status.code == VD_OK) {
        pass->stats->particles += stats.particles;
        pass->stats->particles_for += stats.stands_for;
        status = vd_splatter_render(r->splatter, job, &asset->splat, pass->camera, view->splats,
                                    view->count, frame, NULL);
    }
    return status;
}

vd_status vd_world_draw_clouds(vd_world_renderer *r, vd_job *job, const vd_pass *pass,
                               vd_frame *frame) {
    if (pass->clouds->count == 0) {
        return vd_success();
    }
    vd_status status = find_runs(r, pass);
    const cloud_run *runs = r->cloud_runs.data;
    for (size_t i = 0; i < r->cloud_runs.count && status.code == VD_OK; i++) {
        status = draw_run(r, job, pass, &runs[i], frame);
    }
    return status;
}

void vd_world_release_clouds(vd_world_renderer *r) {
    for (size_t i = 0; r->views != NULL && i < vd_world_asset_count(r->world); i++) {
        vd_brick_view_destroy(&r->views[i]);
    }
    vd_release(r->context, r->views);
    vd_release(r->context, r->roots.data);
    vd_release(r->context, r->cloud_runs.data);
    vd_splatter_destroy(&r->splatter);
}

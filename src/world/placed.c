/* placed.c: models, and bricks of particles, over a client's frame. Also built to WebAssembly. */
#include <veduta/placed.h>

#include <math.h>
#include <string.h>
#include "core/core.h"
#include "core/list.h"
#include "image/image.h"
#include "world/placed_bricks.h"
#include "world/world_shader.h"

/* As pictures of objects are drawn. */
#define SAMPLES 4

#define BLENDED_ROWS 16

struct vd_placer {
    vd_context *context;
    vd_raster *raster;
    vd_frame *frame;
    size_t frame_pixels;
    vd_list draws;   /* vd_draw */
    vd_list dresses; /* dress, by item */
    vd_placed_bricks bricks;
    vd_world_light light;
};

/* Pixels of the window. */
typedef struct rectangle {
    int x0, y0, x1, y1;
} rectangle;

vd_status vd_placer_create(vd_context *context, vd_placer **out) {
    vd_placer *g = vd_allocate_zero(context, 1, sizeof *g);
    if (g == NULL) {
        return vd_out_of_memory("drawing models", sizeof *g);
    }
    g->context = g->bricks.context = context;
    const vd_status status = vd_raster_create(context, &g->raster);
    if (status.code != VD_OK) {
        vd_placer_destroy(&g);
        return status;
    }
    *out = g;
    return status;
}

void vd_placer_destroy(vd_placer **placer) {
    vd_placer *g = *placer;
    if (g == NULL) {
        return;
    }
    *placer = NULL;
    vd_raster_destroy(&g->raster);
    vd_frame_destroy(&g->frame);
    vd_release(g->context, g->draws.data);
    vd_release(g->context, g->dresses.data);
    vd_placed_bricks_finish(&g->bricks);
    vd_release(g->context, g);
}

/* ---- where items are --------------------------------------------------------------------------*/

static vd_matrix matrix_of(const vd_place *place) {
    vd_matrix m = vd_matrix_translation(place->origin);
    for (int r = 0; r < 3; r++) {
        for (int c = 0; c < 3; c++) {
            m.m[r][c] = (double)place->axes[c][r];
        }
    }
    return m;
}

/* The box around a placed model. */
static void box_of(const vd_placed *item, const vd_matrix *matrix, vd_vec3 *min, vd_vec3 *max) {
    vd_vec3 low, high;
    vd_model_bounds(item->model, &low, &high);
    *min = vd_vec3_make(INFINITY, INFINITY, INFINITY);
    *max = vd_vec3_scale(*min, -1.0);
    for (int i = 0; i < 8; i++) {
        const vd_vec3 at = vd_matrix_transform(matrix, vd_vec3_make((i & 1) != 0 ? high.x : low.x,
                                                                    (i & 2) != 0 ? high.y : low.y,
                                                                    (i & 4) != 0 ? high.z : low.z));
        *min = vd_vec3_min(*min, at);
        *max = vd_vec3_max(*max, at);
    }
}

static int clamp(double at, int most) {
    return at > 0.0 ? at < most ? (int)at : most : 0; /* also of what is no number */
}

static rectangle join(rectangle a, rectangle b) {
    return (rectangle){a.x0 < b.x0 ? a.x0 : b.x0, a.y0 < b.y0 ? a.y0 : b.y0,
                       a.x1 > b.x1 ? a.x1 : b.x1, a.y1 > b.y1 ? a.y1 : b.y1};
}

/* Where a box is on screen, with a margin for edges; all of the window where some of it is nearer
 * than the near plane; empty where all is. */
static rectangle rectangle_of(const vd_camera *camera, const vd_placed_window *window, vd_vec3 min,
                              vd_vec3 max) {
    const vd_quat q = camera->orientation, back = {-q.x, -q.y, -q.z, q.w};
    double low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY};
    int behind = 0;
    for (int i = 0; i < 8; i++) {
        const vd_vec3 corner =
            vd_vec3_make((i & 1) != 0 ? max.x : min.x, (i & 2) != 0 ? max.y : min.y,
                         (i & 4) != 0 ? max.z : min.z);
        const vd_vec3 at = vd_quat_rotate(back, vd_vec3_subtract(corner, camera->eye));
        if (!(at.z > camera->near_m)) {
            behind++;
            continue;
        }
        const double p[2] = {camera->lens.cx + camera->lens.fx * at.x / at.z,
                             camera->lens.cy + camera->lens.fy * at.y / at.z};
        for (int k = 0; k < 2; k++) {
            low[k] = p[k] < low[k] ? p[k] : low[k];
            high[k] = p[k] > high[k] ? p[k] : high[k];
        }
    }
    if (behind == 8) {
        return (rectangle){window->width, window->height, 0, 0};
    }
    if (behind > 0) {
        return (rectangle){0, 0, window->width, window->height};
    }
    return (rectangle){
        clamp(floor(low[0]) - 1.0, window->width), clamp(floor(low[1]) - 1.0, window->height),
        clamp(floor(high[0]) + 2.0, window->width), clamp(floor(high[1]) + 2.0, window->height)};
}

/* ---- draws ------------------------------------------------------------------------------------*/

/* How the parts of an item are shaded. */
typedef struct dress {
    vd_world_uniforms world;                            /* first: what the world's shaders read */
    vd_shader shaders[VD_TOPOLOGY_COUNT];               /* by part, */
    vd_fragment_function *fragments[VD_TOPOLOGY_COUNT]; /* where they hang on the ground */
    float ground[4]; /* height over it: of a place in camera space, and at the eye */
} dress;

/* What is below the ground is there and transparent: what lies behind it is below too. */
static void hide_below(const vd_fragments *f, const float ground[4]) {
    const float *lens = f->view->lens;
    const float across = 1.0f / lens[0], down = 1.0f / lens[1];
    for (int i = 0; i < VD_BATCH; i++) {
        const float x = (f->x[i] - lens[2]) * across, y = (f->y[i] - lens[3]) * down;
        const float height = f->w[i] * (ground[0] * x + (ground[1] * y + ground[2])) + ground[3];
        f->color[3][i] = height < 0.0f ? 0.0f : f->color[3][i];
    }
}

#define SHADE_PART(name, part)                                                                     \
    static void name(const vd_fragments *f) {                                                      \
        const dress *d = f->uniforms;                                                              \
        d->fragments[part](f);                                                                     \
        hide_below(f, d->ground);                                                                  \
    }
SHADE_PART(shade_first, 0)
SHADE_PART(shade_second, 1)
SHADE_PART(shade_third, 2)

static void stand_on_ground(const vd_place *place, const vd_camera *camera, int count, dress *d) {
    static vd_fragment_function *const shade[VD_TOPOLOGY_COUNT] = {shade_first, shade_second,
                                                                   shade_third};
    const vd_vec3 up = {-(double)place->ground[1], -(double)place->ground[2], 1.0};
    for (int c = 0; c < 3; c++) {
        const vd_vec3 axis = vd_vec3_make(c == 0, c == 1, c == 2);
        d->ground[c] = (float)vd_vec3_dot(up, vd_quat_rotate(camera->orientation, axis));
    }
    d->ground[3] = (float)(vd_vec3_dot(up, vd_vec3_subtract(camera->eye, place->origin)) -
                           (double)place->ground[0]);
    for (int i = 0; i < count; i++) {
        d->fragments[i] = d->shaders[i].fragment;
        d->shaders[i].fragment = shade[i];
    }
}

static uint64_t cost_of(const vd_model *model) {
    uint64_t cost = 8; /* of a draw */
    for (int i = 0; i < VD_TOPOLOGY_COUNT; i++) {
        const vd_mesh *mesh = model->meshes[i];
        cost += mesh != NULL ? (uint64_t)mesh->primitive_count + mesh->vertex_count : 0;
    }
    return cost;
}

/* Adds what is drawn of an item; `d` is its own. */
static vd_status add_item(vd_placer *g, const vd_camera *camera, const vd_placed *item,
                          const vd_matrix *matrix, dress *d) {
    vd_draw parts[VD_TOPOLOGY_COUNT];
    const int count = vd_model_draws(item->model, parts);
    vd_draw *to = vd_list_add(g->context, &g->draws, (size_t)count, sizeof *to);
    if (to == NULL) {
        return vd_out_of_memory("models to be drawn", sizeof *to);
    }
    d->world = (vd_world_uniforms){.light = &g->light, .sun_visible = item->place.sun};
    for (int i = 0; i < count; i++) {
        d->shaders[i] = *vd_world_shader_for(&parts[i], item->model->has_colors);
        to[i] = parts[i];
        to[i].world_from_mesh = *matrix;
        to[i].shader = &d->shaders[i];
        to[i].uniforms = d;
    }
    if (item->place.has_ground) {
        stand_on_ground(&item->place, camera, count, d);
    }
    return vd_success();
}

/* Where a brick is on screen. */
static rectangle brick_rectangle(const vd_camera *camera, const vd_placed_window *window,
                                 const vd_brick_block *brick) {
    vd_vec3 min, max;
    const double reach = vd_placed_brick_reach(brick);
    vd_placed_brick_box(brick, &min, &max);
    const vd_vec3 around = vd_vec3_make(reach, reach, reach);
    return rectangle_of(camera, window, vd_vec3_subtract(min, around), vd_vec3_add(max, around));
}

static bool is_empty(rectangle r) {
    return r.x0 >= r.x1 || r.y0 >= r.y1;
}

/* What of the items is drawn. */
typedef struct gathered {
    rectangle in;
    int drawn;
} gathered;

/* Adds a model to what is drawn, if it is in sight and not too much. */
static vd_status gather_model(vd_placer *g, const vd_camera *camera, const vd_placed *item,
                              const vd_placed_window *window, dress *d, vd_placed_account *account,
                              gathered *to) {
    const vd_matrix matrix = matrix_of(&item->place);
    vd_vec3 min, max;
    box_of(item, &matrix, &min, &max);
    const rectangle at = rectangle_of(camera, window, min, max);
    if (is_empty(at)) {
        return vd_success();
    }
    account->primitives += cost_of(item->model);
    if (account->primitives > VD_PLACED_MOST) {
        return vd_success();
    }
    to->in = join(to->in, at);
    to->drawn++;
    return add_item(g, camera, item, &matrix, d);
}

static vd_status gather_brick(vd_placer *g, const vd_camera *camera, const vd_brick_block *brick,
                              const vd_placed_window *window, vd_placed_account *account,
                              gathered *to) {
    const rectangle at = brick_rectangle(camera, window, brick);
    bool added = false;
    if (is_empty(at)) {
        return vd_success();
    }
    const vd_status status = vd_placed_bricks_add(&g->bricks, brick, account, &added);
    if (added) {
        to->in = join(to->in, at);
        to->drawn++;
    }
    return status;
}

/* Gathers the draws of all items that may be seen, and where they are. */
static vd_status gather(vd_placer *g, const vd_camera *camera, const vd_placed *items, int count,
                        const vd_placed_window *window, vd_placed_account *account, gathered *to) {
    g->draws.count = g->dresses.count = 0;
    vd_placed_bricks_begin(&g->bricks);
    to->in = (rectangle){window->width, window->height, 0, 0};
    dress *dresses = vd_list_add(g->context, &g->dresses, (size_t)count, sizeof *dresses);
    if (dresses == NULL) {
        return vd_out_of_memory("models to be drawn", (size_t)count * sizeof *dresses);
    }
    vd_status status = vd_success();
    for (int i = 0; i < count && status.code == VD_OK; i++) {
        status = items[i].brick != NULL
                     ? gather_brick(g, camera, items[i].brick, window, account, to)
                     : gather_model(g, camera, &items[i], window, &dresses[i], account, to);
    }
    return status;
}

/* ---- blending ---------------------------------------------------------------------------------*/

typedef struct blending {
    const vd_frame *from;
    const vd_placed_window *to;
    rectangle in;
} blending;

static void blend_row(const uint8_t *restrict from, uint8_t *restrict to, int pixels) {
    for (int i = 0; i < pixels; i++) {
        const unsigned rest = 255u - from[4 * i + 3];
        for (int k = 0; k < 4 && rest < 255u; k++) {
            to[4 * i + k] = vd_over(from[4 * i + k], to[4 * i + k], rest);
        }
    }
}

static void blend_rows(void *user, int index, int worker) {
    const blending *b = user;
    const int end = (index + 1) * BLENDED_ROWS;
    (void)worker;
    for (int y = index * BLENDED_ROWS; y < end && y < b->from->height; y++) {
        const size_t at = (size_t)(b->in.y0 + y) * b->to->stride + (size_t)b->in.x0;
        blend_row(b->from->rgba + 4 * (size_t)y * b->from->stride, b->to->rgba + 4 * at,
                  b->from->width);
    }
}

/* ---- all of it --------------------------------------------------------------------------------*/

static uint64_t most_pixels(int width, int height) {
    return VD_PLACED_SCREENS * (uint64_t)width * (uint64_t)height;
}

bool vd_placed_is_absurd(const vd_placed_account *account, int width, int height) {
    return account->primitives > VD_PLACED_ABSURD * VD_PLACED_MOST ||
           account->pixels > VD_PLACED_ABSURD * most_pixels(width, height) ||
           account->particles > VD_PLACED_ABSURD * VD_PLACED_PARTICLES;
}

/* A frame of the rectangle's size, with depth if bricks are to be hidden by models. */
static vd_status fit_frame(vd_placer *g, int width, int height) {
    const bool deep = g->draws.count > 0 && g->bricks.seen.count > 0;
    if (deep && g->frame != NULL && g->frame->depth == NULL) {
        vd_frame_destroy(&g->frame);
    }
    return vd_frame_fit(g->context, width, height, deep ? VD_PLANE_DEPTH : 0, &g->frame,
                        &g->frame_pixels);
}

/* Draws the models that were gathered into the frame, transparent where there are none, and the
 * bricks over them. */
static vd_status draw_items(vd_placer *g, vd_job *job, const vd_camera *camera,
                            const vd_placed_window *window, vd_placed_account *account) {
    vd_frame frame = *g->frame;
    vd_status status = vd_success();
    if (g->draws.count > 0) {
        vd_raster_def def = vd_raster_def_default();
        vd_raster_stats stats = {.covered = 0};
        def.samples = SAMPLES;
        def.most_pixels = most_pixels(window->width, window->height) - account->pixels;
        def.most_layers = VD_PLACED_LAYERS;
        vd_frame_forget_objects(g->frame);
        status = vd_raster_render(g->raster, job, &def, camera, g->draws.data, (int)g->draws.count,
                                  g->frame, &stats);
        account->pixels += stats.covered;
    } else {
        memset(frame.rgba, 0, 4 * frame.stride * (size_t)frame.height);
        frame.depth = NULL;
    }
    return status.code == VD_OK && g->bricks.seen.count > 0
               ? vd_placed_bricks_draw(&g->bricks, job, camera, window, account, &frame)
               : status;
}

/* Draws what was gathered into a frame of its own and blends that over the window. */
static vd_status draw(vd_placer *g, vd_job *job, const vd_camera *camera,
                      const vd_placed_window *window, rectangle in, vd_placed_account *account) {
    const int height = in.y1 - in.y0;
    vd_status status = fit_frame(g, in.x1 - in.x0, height);
    if (status.code == VD_OK) {
        status = draw_items(g, job, camera, window, account);
    }
    if (status.code == VD_OK) {
        blending b = {g->frame, window, in};
        status = vd_parallel_for(g->context, NULL, (height + BLENDED_ROWS - 1) / BLENDED_ROWS,
                                 blend_rows, &b);
    }
    return status;
}

vd_status vd_placer_draw(vd_placer *g, vd_job *job, const vd_light *light, const vd_camera *camera,
                         const vd_placed *items, int count, const vd_placed_window *window,
                         vd_placed_account *account, int *drawn) {
    gathered what = {.drawn = 0};
    vd_placed_account own = {.runs = 0};
    account = account != NULL ? account : &own;
    const bool fits = account->runs++ < VD_PLACED_RUNS &&
                      account->pixels < most_pixels(window->width, window->height);
    vd_status status =
        fits && count > 0 ? gather(g, camera, items, count, window, account, &what) : vd_success();
    if (status.code == VD_OK && what.drawn > 0) {
        vd_camera cut = *camera;
        cut.lens.cx -= what.in.x0;
        cut.lens.cy -= what.in.y0;
        if (g->draws.count > 0) {
            vd_world_light_aim(&g->light, light, &cut, NULL, NULL, 1.0, false);
        }
        status = draw(g, job, &cut, window, what.in, account);
    }
    if (drawn != NULL) {
        *drawn = status.code == VD_OK ? what.drawn : 0;
    }
    return status;
}

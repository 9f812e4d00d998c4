/* raster_methods.c: the methods, and which of them draws a picture. */
#include <string.h>
#include "raster/raster_edges.h"
#include "raster/raster_run.h"

#define TILE 64

/* ---- the reference ----------------------------------------------------------------------------
 * The table of kernels made of the plain functions. */

static uint64_t shade_plainly(const vd_scene *scene, const vd_visible *visible, vd_target *target,
                              vd_batch *batch) {
    vd_reference_shade(scene, visible, target, batch);
    uint64_t hits = 0;
    for (int s = 0; s < visible->samples; s++) {
        for (int y = 0; y < visible->height; y++) {
            const size_t row = (size_t)s * visible->plane + (size_t)y * visible->stride;
            for (int x = 0; x < visible->width; x++) {
                hits += visible->id[row + (size_t)x] != 0;
            }
        }
    }
    return hits;
}

static void see_plainly(vd_raster *raster, vd_worker *worker) {
    vd_reference_visibility(&raster->scene, &worker->visible, worker->batch);
}

static const vd_raster_kernels plain_kernels = {.project = vd_project_reference,
                                                .shade = shade_plainly};

/* ---- sorting ----------------------------------------------------------------------------------*/

static void sort_tiled(vd_raster *raster, vd_worker *worker, const vd_drawing *drawing,
                       uint32_t first, uint32_t count) {
    raster->kernels->sort(&worker->sorter, drawing, first, count);
}

/* Notes the tiles that a triangle's box touches. */
static void touch_tiles(vd_worker *worker, const vd_setup *setup) {
    const vd_sorter *sorter = &worker->sorter;
    for (int s = 0; s < worker->window.samples; s++) {
        const vd_edges e = vd_edges_make(setup, &worker->window, s);
        for (int y = e.y0 >> sorter->tile_shift; y <= e.y1 >> sorter->tile_shift; y++) {
            for (int x = e.x0 >> sorter->tile_shift; x <= e.x1 >> sorter->tile_shift; x++) {
                sorter->touched[y * sorter->tiles_x + x] = 1;
            }
        }
    }
    worker->sorter.drawn++;
}

static void emit_scanline(void *user, const vd_setup *setup) {
    vd_worker *worker = user;
    touch_tiles(worker, setup);
    vd_scanline_fill(&worker->window, setup);
}

static void sort_scanline(vd_raster *raster, vd_worker *worker, const vd_drawing *drawing,
                          uint32_t first, uint32_t count) {
    (void)raster;
    for (uint32_t i = first; i < first + count; i++) {
        worker->sorter.clipped += vd_assemble(drawing, i, emit_scanline, worker);
    }
}

static void emit_immediate(void *user, const vd_setup *setup) {
    vd_worker *worker = user;
    touch_tiles(worker, setup);
    vd_immediate_add(worker->immediate, setup);
}

static void sort_immediate(vd_raster *raster, vd_worker *worker, const vd_drawing *drawing,
                           uint32_t first, uint32_t count) {
    vd_immediate_begin(worker->immediate, &worker->window, raster->bin, raster->fine,
                       worker->sorter.small_pixels);
    for (uint32_t i = first; i < first + count; i++) {
        worker->sorter.clipped += vd_assemble(drawing, i, emit_immediate, worker);
    }
    vd_immediate_flush(worker->immediate);
}

static const vd_method methods[VD_RASTER_METHOD_COUNT] = {
    [VD_RASTER_SCANLINE] = {sort_scanline, NULL, true},
    [VD_RASTER_IMMEDIATE] = {sort_immediate, NULL, true},
    [VD_RASTER_TILED] = {sort_tiled, NULL, false},
    [VD_RASTER_HYBRID] = {sort_tiled, NULL, true},
    [VD_RASTER_REFERENCE] = {NULL, see_plainly, false},
};

/* A mesh of a few thousand is shared too: a thread that sleeps while another sorts comes late for
 * the tiles. 1,024 for all took 5 % longer for the dragon of 871 k. */
#define PRIMITIVES_A_TASK 4096
#define PRIMITIVES_A_TASK_MIN 512
#define TASKS 8

static uint32_t primitives_a_task(const vd_drawing *drawing) {
    const uint32_t share = drawing->primitive_count / TASKS / VD_BATCH * VD_BATCH;
    return share < PRIMITIVES_A_TASK_MIN ? PRIMITIVES_A_TASK_MIN
           : share < PRIMITIVES_A_TASK   ? share
                                         : PRIMITIVES_A_TASK;
}

typedef struct sort_run {
    vd_raster *raster;
    const vd_drawing *drawing;
    uint32_t each; /* primitives a task */
} sort_run;

static void sort_some(void *user, int index, int worker) {
    const sort_run *run = user;
    const vd_drawing *drawing = run->drawing;
    vd_sorter *sorter = &run->raster->workers[worker].sorter;
    uint32_t first = (uint32_t)index * run->each;
    const uint32_t left = drawing->primitive_count - first;
    const uint32_t end = first + (left < run->each ? left : run->each);
    while (first < end) {
        uint32_t run_end;
        sorter->kind = vd_drawing_kind(drawing, first, &run_end);
        run_end = run_end < end ? run_end : end;
        if (sorter->kind == VD_KIND_SOLID) {
            run->raster->method->sort(run->raster, &run->raster->workers[worker], drawing, first,
                                      run_end - first);
        } else {
            for (uint32_t i = first; i < run_end; i++) {
                vd_sorter_add_primitive(sorter, drawing, i);
            }
        }
        first = run_end;
    }
}

static void clear_tile(vd_visible *window, int x, int y, int tile) {
    const int right = window->width - x * tile, down = window->height - y * tile;
    const int width = right < tile ? right : tile, height = down < tile ? down : tile;
    for (int s = 0; s < window->samples; s++) {
        for (int row = 0; row < height; row++) {
            const size_t at = (size_t)s * window->plane +
                              (size_t)(y * tile + row) * window->stride + (size_t)(x * tile);
            memset(window->depth + at, 0, (size_t)width * sizeof *window->depth);
            memset(window->id + at, 0, (size_t)width * sizeof *window->id);
        }
    }
}

void vd_raster_forget(vd_raster *raster, int x, int y) {
    const int tile = y * raster->tiles_x + x;
    for (int i = 0; raster->method->windows && i < raster->thread_count; i++) {
        vd_worker *worker = &raster->workers[i];
        if (worker->sorter.touched[tile] != 0) {
            clear_tile(&worker->window, x, y, raster->tile);
            worker->sorter.touched[tile] = 0;
        }
    }
}

/* Empties all lists; a tile's first block is one that is full. */
static void reset_sorter(vd_raster *raster, vd_worker *worker) {
    vd_sorter *sorter = &worker->sorter;
    const size_t tiles = (size_t)raster->tiles_x * (size_t)raster->tiles_y;
    vd_arena_reset(&sorter->arena);
    sorter->clipped = sorter->drawn = 0;
    vd_block *full = vd_arena_take(&sorter->arena, sizeof *full);
    if (full == NULL) {
        return;
    }
    full->next = NULL;
    full->drawing = NULL;
    full->count = VD_BLOCK_ENTRIES;
    for (size_t i = 0; i < tiles * VD_CLASSES; i++) {
        sorter->blocks[i] = full;
    }
    memset(sorter->links, 0, tiles * VD_KIND_COUNT * sizeof *sorter->links);
}

vd_status vd_raster_sort(vd_raster *raster, vd_job *job) {
    if (raster->method->sort == NULL) {
        return vd_success();
    }
    for (int i = 0; i < raster->thread_count; i++) {
        reset_sorter(raster, &raster->workers[i]);
        if (raster->workers[i].sorter.arena.failed) {
            return vd_out_of_memory("the tiles' lists", sizeof(vd_block));
        }
    }
    for (int y = 0; y < raster->tiles_y; y++) { /* what an earlier picture may have left */
        for (int x = 0; x < raster->tiles_x; x++) {
            vd_raster_forget(raster, x, y);
        }
    }
    vd_status status = vd_success();
    for (int i = 0; i < raster->scene.drawing_count && status.code == VD_OK; i++) {
        const vd_drawing *drawing = &raster->scene.drawings[raster->scene.order[i].drawing];
        sort_run run = {raster, drawing, primitives_a_task(drawing)};
        const int tasks = (int)(((uint64_t)drawing->primitive_count + run.each - 1) / run.each);
        status = vd_parallel_for(raster->context, job, tasks, sort_some, &run);
    }
    for (int i = 0; i < raster->thread_count && status.code == VD_OK; i++) {
        if (raster->workers[i].sorter.arena.failed) {
            status = vd_out_of_memory("the tiles' lists", sizeof(vd_block));
        }
    }
    return status;
}

/* ---- tiles ------------------------------------------------------------------------------------*/

void vd_raster_place(vd_raster *raster, vd_worker *worker, int x, int y) {
    vd_visible *visible = &worker->visible;
    const int tile = raster->tile;
    visible->x = x * tile;
    visible->y = y * tile;
    const int right = raster->scene.width - visible->x, down = raster->scene.height - visible->y;
    visible->width = right < tile ? right : tile;
    visible->height = down < tile ? down : tile;
}

static void clear_window(vd_visible *visible, bool several) {
    const size_t count = visible->plane * (size_t)visible->samples;
    memset(visible->depth, 0, count * sizeof *visible->depth);
    if (!visible->bare) {
        memset(visible->id, 0, count * sizeof *visible->id);
    }
    memset(visible->hidden, 0, sizeof visible->hidden);
    visible->hides = false;
    visible->since = several ? 0 : INT32_MIN; /* see find_hidden */
}

/* The triangles of one kind that a worker sorted to a tile. */
static const vd_link *first_link(const vd_raster *raster, int worker, int tile, vd_kind kind) {
    return raster->workers[worker].sorter.links[tile * VD_KIND_COUNT + (int)kind];
}

bool vd_raster_is_empty(const vd_raster *raster, int x, int y) {
    const int tile = y * raster->tiles_x + x;
    for (int i = 0; i < raster->thread_count; i++) {
        const vd_sorter *sorter = &raster->workers[i].sorter;
        bool any =
            raster->method->sort == NULL || (raster->method->windows && sorter->touched[tile] != 0);
        for (int kind = 0; kind < VD_KIND_COUNT && !any; kind++) {
            any = first_link(raster, i, tile, (vd_kind)kind) != NULL;
        }
        for (int class = 0; class < VD_CLASSES && !any; class ++) {
            any = sorter->blocks[tile * VD_CLASSES + class]->drawing != NULL;
        }
        if (any) {
            return false;
        }
    }
    return true;
}

void vd_raster_see(vd_raster *raster, vd_worker *worker, int x, int y) {
    vd_raster_place(raster, worker, x, y);
    worker->visible.bare = raster->bare;
    clear_window(&worker->visible, raster->scene.drawing_count > 1);
    if (raster->method->see != NULL) {
        raster->method->see(raster, worker);
    }
    if (raster->method->sort == NULL) {
        return;
    }
    vd_visible *visible = &worker->visible;
    const vd_raster_kernels *kernels = raster->kernels;
    const int tile = y * raster->tiles_x + x;
    /* Large triangles first: they hide most. */
    for (int i = 0; i < raster->thread_count; i++) {
        for (const vd_link *l = first_link(raster, i, tile, VD_KIND_SOLID); l != NULL;
             l = l->next) {
            for (int k = 0; k < l->count; k++) {
                kernels->fill_setup(visible, l->setups[k]);
            }
        }
    }
    for (int i = 0; i < raster->thread_count; i++) {
        vd_block *const *lists = raster->workers[i].sorter.blocks + (size_t)tile * VD_CLASSES;
        for (int class = 0; class < VD_CLASSES; class ++) {
            kernels->fill_blocks(visible, lists[class]);
        }
    }
    kernels->flush(visible);
    for (int i = 0; raster->method->windows && i < raster->thread_count; i++) {
        const vd_worker *other = &raster->workers[i];
        for (int s = 0; s < visible->samples && other->sorter.touched[tile] != 0; s++) {
            const size_t at = (size_t)s * other->window.plane +
                              (size_t)visible->y * other->window.stride + (size_t)visible->x;
            kernels->merge(visible, s, other->window.depth + at, other->window.id + at,
                           other->window.stride);
        }
    }
    for (int i = 0; i < raster->thread_count; i++) {
        for (const vd_link *l = first_link(raster, i, tile, VD_KIND_TESTED); l != NULL;
             l = l->next) {
            for (int k = 0; k < l->count; k++) {
                kernels->fill_tested(&raster->scene, visible, l->setups[k], worker->batch);
            }
        }
    }
}

bool vd_raster_blends(const vd_raster *raster, int x, int y) {
    bool any = raster->scene.blended && raster->method->sort == NULL;
    for (int i = 0; i < raster->thread_count && raster->scene.blended && !any; i++) {
        any = first_link(raster, i, y * raster->tiles_x + x, VD_KIND_BLENDED) != NULL;
    }
    return any;
}

void vd_raster_add_blended(vd_raster *raster, vd_worker *worker, vd_target *target, int x, int y) {
    if (raster->method->sort == NULL) {
        vd_reference_blend(&raster->scene, target, worker->batch);
        return;
    }
    const int tile = y * raster->tiles_x + x;
    for (int i = 0; i < raster->thread_count; i++) {
        for (const vd_link *l = first_link(raster, i, tile, VD_KIND_BLENDED); l != NULL;
             l = l->next) {
            for (int k = 0; k < l->count; k++) {
                raster->kernels->add_blended(&raster->scene, target, l->setups[k], worker->batch);
            }
        }
    }
}

/* ---- choosing ---------------------------------------------------------------------------------*/

void vd_worker_finish(vd_context *context, vd_worker *worker) {
    vd_arena_finish(&worker->sorter.arena);
    vd_release(context, worker->depth.memory);
    vd_release(context, worker->id.memory);
    vd_release(context, worker->blocks.memory);
    vd_release(context, worker->links.memory);
    vd_release(context, worker->touched.memory);
    vd_release(context, worker->window_depth.memory);
    vd_release(context, worker->window_id.memory);
    vd_release(context, worker->batch);
    vd_release(context, worker->pending);
    vd_immediate_destroy(context, worker->immediate);
    vd_target_destroy(&worker->target);
}

/* A window of the whole picture, all 0. */
static vd_status prepare_window(vd_raster *raster, vd_worker *worker) {
    vd_visible *window = &worker->window;
    const vd_scene *scene = &raster->scene;
    const size_t stride = vd_frame_stride(scene->width);
    const size_t plane = stride * (size_t)scene->height;
    const size_t tiles = (size_t)raster->tiles_x * (size_t)raster->tiles_y;
    worker->sorter.window = window;
    if (window->width == scene->width && window->height == scene->height &&
        window->samples == scene->samples && worker->window_tile == raster->tile) {
        worker->sorter.touched = worker->touched.memory;
        return vd_success();
    }
    memset(window, 0, sizeof *window);
    const size_t count = plane * (size_t)scene->samples + VD_FILL_SLACK;
    vd_context *context = raster->context;
    vd_status status = vd_buffer_reserve(context, &worker->window_depth, "a window", count, 4);
    if (status.code == VD_OK) {
        status = vd_buffer_reserve(context, &worker->window_id, "a window", count, 4);
    }
    if (status.code == VD_OK) {
        status = vd_buffer_reserve(context, &worker->touched, "a window's tiles", tiles, 1);
    }
    if (status.code != VD_OK) {
        return status;
    }
    memset(worker->window_depth.memory, 0, count * 4);
    memset(worker->window_id.memory, 0, count * 4);
    memset(worker->touched.memory, 0, tiles);
    worker->window_tile = raster->tile;
    worker->sorter.touched = worker->touched.memory;
    *window = (vd_visible){.width = scene->width,
                           .height = scene->height,
                           .samples = scene->samples,
                           .stride = stride,
                           .plane = plane,
                           .pending = worker->pending,
                           .depth = worker->window_depth.memory,
                           .id = worker->window_id.memory};
    return status;
}

static vd_status prepare_sorter(vd_raster *raster, vd_worker *worker, const vd_raster_def *def) {
    vd_context *context = raster->context;
    vd_sorter *sorter = &worker->sorter;
    const size_t tiles = (size_t)raster->tiles_x * (size_t)raster->tiles_y;
    vd_status status = vd_buffer_reserve(context, &worker->blocks, "the tiles' lists",
                                         tiles * VD_CLASSES, sizeof *sorter->blocks);
    if (status.code == VD_OK) {
        status = vd_buffer_reserve(context, &worker->links, "the tiles' lists",
                                   tiles * VD_KIND_COUNT, sizeof *sorter->links);
    }
    sorter->arena.context = context;
    sorter->blocks = worker->blocks.memory;
    sorter->links = worker->links.memory;
    sorter->tile_shift = __builtin_ctz((unsigned)raster->tile);
    sorter->tiles_x = raster->tiles_x;
    sorter->tiles_y = raster->tiles_y;
    sorter->width = raster->scene.width;
    sorter->height = raster->scene.height;
    sorter->samples = raster->scene.samples;
    sorter->small_pixels = def->small_pixels > 0 ? def->small_pixels : 128;
    sorter->window = NULL;
    if (status.code == VD_OK && raster->method->sort == sort_immediate &&
        worker->immediate == NULL) {
        worker->immediate = vd_immediate_create(context);
        if (worker->immediate == NULL) {
            return vd_out_of_memory("the stages of the immediate method", 1);
        }
    }
    if (status.code == VD_OK && raster->method->windows) {
        status = prepare_window(raster, worker);
    }
    return status;
}

static vd_status prepare_worker(vd_raster *raster, vd_worker *worker, const vd_raster_def *def) {
    vd_context *context = raster->context;
    vd_visible *visible = &worker->visible;
    const int tile = raster->tile, samples = raster->scene.samples;
    visible->samples = samples;
    visible->stride = (size_t)tile;
    visible->plane = (size_t)tile * (size_t)tile;
    visible->block_shift = __builtin_ctz((unsigned)(tile / VD_HIDE_BLOCKS));
    const size_t count = visible->plane * (size_t)samples + VD_FILL_SLACK;
    vd_status status = vd_buffer_reserve(context, &worker->depth, "a tile", count, sizeof(float));
    if (status.code == VD_OK) {
        status = vd_buffer_reserve(context, &worker->id, "a tile", count, sizeof(uint32_t));
    }
    if (status.code != VD_OK) {
        return status;
    }
    visible->depth = worker->depth.memory;
    visible->id = worker->id.memory;
    memset(visible->depth, 0, count * sizeof *visible->depth);
    memset(visible->id, 0, count * sizeof *visible->id);
    if (worker->batch == NULL) {
        worker->batch = vd_allocate_zero(context, 1, sizeof *worker->batch);
    }
    if (worker->pending == NULL) {
        worker->pending = vd_allocate_zero(context, 1, sizeof *worker->pending);
    }
    if (worker->batch == NULL || worker->pending == NULL) {
        return vd_out_of_memory("a batch of fragments",
                                sizeof *worker->batch + sizeof *worker->pending);
    }
    visible->pending = worker->pending;
    worker->window.pending = worker->pending; /* the two are never filled at once */
    if (worker->target != NULL && (worker->target->samples != samples ||
                                   worker->target->plane < vd_frame_stride(tile) * (size_t)tile)) {
        vd_target_destroy(&worker->target);
    }
    if (worker->target == NULL) {
        status = vd_target_create(context, tile, tile, samples, &worker->target);
    }
    if (status.code == VD_OK && raster->scene.blended) {
        status = vd_target_reserve_blended(worker->target);
    }
    if (status.code == VD_OK && raster->method->sort != NULL) {
        status = prepare_sorter(raster, worker, def);
    }
    return status;
}

const vd_raster_kernels *vd_raster_kernels_for(vd_isa isa) {
#if defined(__x86_64__)
    if (isa == VD_ISA_V4) {
        return &vd_raster_kernels_v4;
    }
    if (isa == VD_ISA_V3) {
        return &vd_raster_kernels_v3;
    }
#endif
    (void)isa;
    return &vd_raster_kernels_v2;
}

/* Tiles have won everywhere since their vertices are asked for in time. Before, windows of their
 * own paid for many tiny triangles in a picture that fits the caches (dragon of 871 k at
 * 1024²: 12.5 ms against 14.0; now against 11). */
static vd_raster_method choose_method(const vd_raster_def *def) {
    return def->method != VD_RASTER_AUTO ? def->method : VD_RASTER_TILED;
}

vd_status vd_raster_choose(vd_raster *raster, const vd_raster_def *def) {
    const vd_raster_method method = choose_method(def);
    raster->method = &methods[method];
    raster->kernels = method == VD_RASTER_REFERENCE
                          ? &plain_kernels
                          : vd_raster_kernels_for(vd_context_isa(raster->context));
    for (int i = 0; i < raster->scene.drawing_count; i++) {
        vd_drawing *drawing = &raster->scene.drawings[i];
        for (int k = 0; k < VD_SHADING_COUNT; k++) {
            if (drawing->shader == vd_shader_find((vd_shading)k) &&
                raster->kernels->fragments[k] != NULL) {
                drawing->fragment = raster->kernels->fragments[k];
            }
        }
    }
    raster->tile = def->tile_pixels > 0            ? def->tile_pixels
                   : method == VD_RASTER_REFERENCE ? 256
                                                   : TILE;
    raster->bin = def->bin_pixels > 0 ? def->bin_pixels : 32;
    raster->fine = def->fine_pixels > 0 ? def->fine_pixels : raster->bin <= 128 ? 8 : 16;
    raster->tiles_x = (raster->scene.width + raster->tile - 1) / raster->tile;
    raster->tiles_y = (raster->scene.height + raster->tile - 1) / raster->tile;
    vd_status status = vd_success();
    for (int i = 0; i < raster->thread_count && status.code == VD_OK; i++) {
        status = prepare_worker(raster, &raster->workers[i], def);
    }
    return status;
}

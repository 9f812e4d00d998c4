/* splat.c: the renderer object, from lists of particles to a finished frame. */
#include <string.h>
#include "image/image.h"
#include "splat/splat_run.h"

const vd_splat_kernels *vd_splat_kernels_for(vd_isa isa) {
#if defined(__x86_64__)
    if (isa == VD_ISA_V4) {
        return &vd_splat_kernels_v4;
    }
    if (isa == VD_ISA_V3) {
        return &vd_splat_kernels_v3;
    }
#endif
    (void)isa;
    return &vd_splat_kernels_v2;
}

/* ---- memory -----------------------------------------------------------------------------------*/

static void fill_shares(vd_splat_shares *shares) {
    for (int right = 0; right < 256; right++) {
        for (int c = 0; c < 8; c++) {
            (*shares)[right][c] = (float)(c < 4 ? 256 - right : right) * (1.0f / 256.0f);
        }
    }
}

vd_status vd_splatter_create(vd_context *context, vd_splatter **out) {
    vd_splatter *splatter = vd_allocate_zero(context, 1, sizeof *splatter);
    if (splatter == NULL) {
        return vd_out_of_memory("a splatter", sizeof *splatter);
    }
    const size_t threads = (size_t)vd_context_threads(context);
    splatter->context = context;
    splatter->thread_count = (int)threads;
    splatter->kernels = vd_splat_kernels_for(vd_context_isa(context));
    splatter->sorters = vd_allocate_zero(context, threads, sizeof *splatter->sorters);
    splatter->scratch = vd_allocate_zero(context, threads, sizeof *splatter->scratch);
    splatter->shares = vd_allocate(context, 1, sizeof *splatter->shares);
    splatter->in_a_row = vd_allocate(context, VD_CHUNK_PARTICLES, sizeof *splatter->in_a_row);
    const size_t capacity = VD_CHUNK_PARTICLES + 16;
    const size_t scratch_bytes =
        capacity * (sizeof(vd_splat_record) + sizeof(int32_t) + sizeof(uint32_t));
    vd_status status = vd_buffer_reserve(context, &splatter->scratch_memory,
                                         "scratch to project splats", threads, scratch_bytes);
    if (splatter->sorters == NULL || splatter->scratch == NULL || splatter->shares == NULL ||
        splatter->in_a_row == NULL) {
        status = vd_out_of_memory("a splatter's threads", threads * sizeof *splatter->sorters);
    }
    if (status.code != VD_OK) {
        vd_splatter_destroy(&splatter);
        return status;
    }
    char *at = splatter->scratch_memory.memory;
    for (size_t i = 0; i < threads; i++, at += scratch_bytes) {
        splatter->scratch[i].records = (vd_splat_record *)(void *)at;
        splatter->scratch[i].tiles = (int32_t *)(void *)(splatter->scratch[i].records + capacity);
        splatter->scratch[i].own_sequence =
            (uint32_t *)(void *)(splatter->scratch[i].tiles + capacity);
    }
    fill_shares(splatter->shares);
    for (uint32_t i = 0; i < VD_CHUNK_PARTICLES; i++) {
        splatter->in_a_row[i] = i;
    }
    vd_splat_profile_init(&splatter->profiles[0], VD_SPLAT_GAUSSIAN);
    vd_splat_profile_init(&splatter->profiles[1], VD_SPLAT_SPH);
    *out = splatter;
    return vd_success();
}

void vd_splatter_destroy(vd_splatter **splatter_in_out) {
    if (splatter_in_out == NULL || *splatter_in_out == NULL) {
        return;
    }
    vd_splatter *splatter = *splatter_in_out;
    *splatter_in_out = NULL;
    vd_context *context = splatter->context;
    const vd_buffer *memories[] = {&splatter->placing_memory, &splatter->sequence_memory,
                                   &splatter->order_memory,   &splatter->tile_memory,
                                   &splatter->touched_memory, &splatter->extreme_memory,
                                   &splatter->chunk_memory,   &splatter->sort_memory,
                                   &splatter->scratch_memory, &splatter->counter_memory};
    for (size_t i = 0; i < sizeof memories / sizeof memories[0]; i++) {
        vd_release(context, memories[i]->memory);
    }
    vd_release(context, splatter->sorters);
    vd_release(context, splatter->scratch);
    vd_release(context, splatter->shares);
    vd_release(context, splatter->in_a_row);
    vd_release(context, splatter);
}

static vd_status reserve_tiles(vd_splatter *splatter) {
    const size_t count = (size_t)splatter->picture.tile_count;
    const size_t pixel_bytes = splatter->picture.mode == VD_SPLAT_DENSITY ? sizeof(uint64_t) : 16;
    splatter->tile_bytes = (VD_TILE_PIXELS * pixel_bytes + 63) / 64 * 64;
    vd_status status = vd_buffer_reserve(splatter->context, &splatter->tile_memory,
                                         "a picture of splats", count, splatter->tile_bytes);
    if (status.code == VD_OK) {
        status = vd_buffer_reserve(splatter->context, &splatter->touched_memory,
                                   "a picture of splats", count, 1);
    }
    if (status.code == VD_OK) {
        status = vd_buffer_reserve(splatter->context, &splatter->extreme_memory,
                                   "a picture of splats", count, sizeof *splatter->extremes);
    }
    splatter->tiles = splatter->tile_memory.memory;
    splatter->touched = splatter->touched_memory.memory;
    splatter->extremes = splatter->extreme_memory.memory;
    if (status.code == VD_OK) {
        memset(splatter->touched, 0, count);
    }
    return status;
}

/* Gives the lists of the sequence their ids in the frame's table. */
static vd_status name_lists(vd_splatter *splatter, vd_frame *frame) {
    vd_status status = vd_success();
    const bool nearest = splatter->picture.mode == VD_SPLAT_NEAREST;
    for (int k = 0; nearest && k < splatter->sequence_count && status.code == VD_OK; k++) {
        vd_placing *p = &splatter->placings[splatter->sequence[k]];
        status = vd_frame_add_object(frame, p->splats->object_id, &p->frame_id);
    }
    return status;
}

/* ---- finishing --------------------------------------------------------------------------------*/

static void widen(uint64_t extremes[2], const uint64_t *sums, int count) {
    for (int i = 0; i < count; i++) {
        const uint64_t sum = sums[i];
        extremes[0] = sum > 0 && sum < extremes[0] ? sum : extremes[0];
        extremes[1] = sum > extremes[1] ? sum : extremes[1];
    }
}

/* A splat's faintest part is 2⁻¹⁶ of its weight: by logarithm, the range of the colours ends so far
 * below the greatest density. */
#define FAINTEST 1e-6f

/* The colours' range of a picture of densities whose def leaves it open. */
static void set_density_range(vd_splat_picture *picture, const vd_splat_def *def,
                              const uint64_t extremes[2]) {
    if (def->mode == VD_SPLAT_DENSITY && !(def->range_max > def->range_min)) {
        const float scale = picture->density_scale;
        const float high = (float)(int64_t)extremes[1] * scale;
        float low = def->log && high > 0.0f ? (float)(int64_t)extremes[0] * scale : 0.0f;
        low = low < high * FAINTEST && def->log ? high * FAINTEST : low;
        vd_splat_picture_set_range(picture, def, low, high);
    }
}

static void resolve_row(const vd_splatter *splatter, vd_kernel_splat_resolve *resolve,
                        const void *pixels, int x, int y, int count) {
    const vd_frame *frame = splatter->frame;
    const size_t at = (size_t)y * frame->stride + (size_t)x;
    const bool over = splatter->picture.over != NULL;
    resolve(&splatter->picture, pixels, count, frame->rgba + 4 * at,
            frame->depth != NULL && !over ? frame->depth + at : NULL,
            frame->id != NULL && !over ? frame->id + at : NULL);
}

/* Calls for each row of a tile that is in the picture. */
static void for_tile_rows(vd_splatter *splatter, int t, bool finish) {
    const vd_splat_picture *picture = &splatter->picture;
    const size_t pixel_bytes = picture->mode == VD_SPLAT_DENSITY ? sizeof(uint64_t) : 16;
    const int x = t % picture->tiles_x << VD_TILE_LOG2, y = t / picture->tiles_x << VD_TILE_LOG2;
    const int width = picture->width - x < VD_TILE_SIDE ? picture->width - x : VD_TILE_SIDE;
    const int height = picture->height - y < VD_TILE_SIDE ? picture->height - y : VD_TILE_SIDE;
    const char *pixels = vd_splatter_tile(splatter, t);
    for (int row = 0; row < height; row++) {
        const void *from = pixels + ((size_t)(row + 1) * VD_TILE_STRIDE + 1) * pixel_bytes;
        if (finish) {
            resolve_row(splatter, splatter->kernels->resolve, from, x, y + row, width);
        } else {
            widen(splatter->extremes[t], from, width);
        }
    }
}

static void measure_tile(void *user, int index, int worker) {
    vd_splatter *splatter = user;
    (void)worker;
    splatter->extremes[index][0] = UINT64_MAX;
    splatter->extremes[index][1] = 0;
    for_tile_rows(splatter, index, false);
}

static void resolve_tile(void *user, int index, int worker) {
    vd_splatter *splatter = user;
    (void)worker;
    if (splatter->picture.over == NULL || splatter->touched[index] != 0) {
        for_tile_rows(splatter, index, true);
    }
}

static vd_status finish(vd_splatter *splatter, const vd_splat_def *def) {
    const int tiles = splatter->picture.tile_count;
    vd_status status = vd_success();
    if (def->mode == VD_SPLAT_DENSITY && !(def->range_max > def->range_min)) {
        uint64_t all[2] = {UINT64_MAX, 0};
        status = vd_parallel_for(splatter->context, NULL, tiles, measure_tile, splatter);
        for (int t = 0; t < tiles; t++) {
            const uint64_t *of = splatter->extremes[t];
            all[0] = of[0] < all[0] ? of[0] : all[0];
            all[1] = of[1] > all[1] ? of[1] : all[1];
        }
        set_density_range(&splatter->picture, def, all);
    }
    if (status.code == VD_OK) {
        status = vd_parallel_for(splatter->context, NULL, tiles, resolve_tile, splatter);
    }
    return status;
}

/* ---- drawing ----------------------------------------------------------------------------------*/

static vd_status draw_by_tiles(vd_splatter *splatter, vd_job *job, const vd_splat_def *def,
                               vd_splat_counts *counts) {
    vd_status status = vd_splatter_order(splatter, job);
    if (status.code == VD_OK) {
        status = reserve_tiles(splatter);
    }
    if (status.code == VD_OK) {
        status = vd_splatter_draw(splatter, job, counts);
    }
    return status.code == VD_OK ? finish(splatter, def) : status;
}

static vd_status draw_plainly(vd_splatter *splatter, const vd_splat_def *def,
                              vd_splat_counts *counts) {
    const vd_splat_picture *picture = &splatter->picture;
    const size_t width = (size_t)picture->width, size = width * (size_t)picture->height;
    const size_t pixel_bytes = picture->mode == VD_SPLAT_DENSITY ? sizeof(uint64_t) : 16;
    size_t most = 1;
    for (int i = 0; i < splatter->list_count; i++) {
        const size_t of = splatter->lists[i].count;
        most = of > most ? of : most;
    }
    char *pixels = vd_allocate_zero(splatter->context, size, pixel_bytes);
    uint64_t *order = vd_allocate(splatter->context, most, 2 * sizeof *order);
    vd_status status = vd_success();
    if (pixels == NULL || order == NULL) {
        status = vd_out_of_memory("a reference picture of splats", size * pixel_bytes);
    } else {
        for (size_t i = 0; picture->mode == VD_SPLAT_ALPHA && i < size; i++) {
            vd_splat_first_color(picture, (int)(i % width), (int)(i / width),
                                 (float *)(void *)(pixels + i * pixel_bytes));
        }
        vd_splat_draw_reference(
            picture, splatter->placings, splatter->sequence, splatter->sequence_count,
            picture->mode == VD_SPLAT_ALPHA && !def->keep_order, order, pixels, counts);
        uint64_t extremes[2] = {UINT64_MAX, 0};
        for (int y = 0; picture->mode == VD_SPLAT_DENSITY && y < picture->height; y++) {
            widen(extremes, (const uint64_t *)(void *)pixels + (size_t)y * width, picture->width);
        }
        set_density_range(&splatter->picture, def, extremes);
        for (int y = 0; y < picture->height; y++) {
            resolve_row(splatter, vd_splat_resolve_reference,
                        pixels + (size_t)y * width * pixel_bytes, 0, y, picture->width);
        }
    }
    vd_release(splatter->context, order);
    vd_release(splatter->context, pixels);
    return status;
}

static void fill_stats(const vd_splatter *splatter, const vd_splat_counts *counts,
                       vd_splat_stats *stats) {
    memset(stats, 0, sizeof *stats);
    for (int i = 0; i < splatter->list_count; i++) {
        stats->splats += splatter->lists[i].count;
    }
    stats->not_finite = counts->not_finite;
    stats->outside = stats->splats - counts->drawn - counts->not_finite;
    stats->cut = counts->cut;
    stats->sorted = splatter->sorted;
    stats->value_min = splatter->picture.range_min;
    stats->value_max = splatter->picture.range_max;
}

vd_status vd_splatter_render(vd_splatter *splatter, vd_job *job, const vd_splat_def *def,
                             const vd_camera *camera, const vd_splats *splats, int count,
                             vd_frame *frame, vd_splat_stats *stats) {
    splatter->all = false;
    splatter->sorted = 0;
    vd_splat_counts counts = {0, 0, 0};
    vd_status status =
        vd_splatter_place(splatter, def, camera, splats, count, frame->width, frame->height);
    if (status.code == VD_OK) {
        status = name_lists(splatter, frame);
    }
    if (status.code == VD_OK) {
        splatter->frame = frame;
        splatter->picture.over = def->over_frame ? frame : NULL;
        splatter->picture.hider = def->over_frame ? frame->depth : NULL;
        splatter->picture.hider_stride = frame->stride;
        status = def->method == VD_SPLAT_REFERENCE ? draw_plainly(splatter, def, &counts)
                                                   : draw_by_tiles(splatter, job, def, &counts);
    }
    if (status.code == VD_OK && stats != NULL) {
        fill_stats(splatter, &counts, stats);
    }
    return status;
}

vd_status vd_splatter_sort(vd_splatter *splatter, vd_job *job, const vd_splat_def *def,
                           const vd_camera *camera, const vd_splats *splats, int count,
                           uint64_t *sorted) {
    vd_splat_def sorting = *def;
    sorting.mode = VD_SPLAT_ALPHA;
    sorting.keep_order = false;
    splatter->all = true;
    vd_status status = vd_splatter_place(splatter, &sorting, camera, splats, count, 1, 1);
    if (status.code == VD_OK) {
        status = vd_splatter_order(splatter, job);
    }
    if (status.code == VD_OK && sorted != NULL) {
        *sorted = splatter->sorted;
    }
    return status;
}

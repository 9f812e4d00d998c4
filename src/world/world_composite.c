/* world_composite.c: everything in one frame by depth.
 *
 * The picture is drawn in bands of a target, so that a band's samples stay near the processor and
 * memory does not grow with the picture. In each band, first all that the rasterizer draws, tile by
 * tile; then the ground, every sample at its own place, where it is nearer; then, tile by tile
 * again, the shadows that things throw on the ground, what is blended, and the mean of the samples
 * into the frame.
 */
#include "core/core.h"
#include "image/blended.h"
#include "world/world_renderer.h"

#define TILE 64
#define BAND_BYTES ((size_t)32 << 20)
#define BYTES_A_SAMPLE 16

typedef struct band {
    vd_world_renderer *renderer;
    const vd_pass *pass;
    vd_frame *frame;
    vd_target *target; /* the band */
    int tiles_x;
    bool blends;
} band;

/* The part of the band that is a task's: a view of it. */
static vd_target tile_of(const band *b, int index) {
    const vd_target *whole = b->target;
    vd_target tile = *whole;
    const int x = index % b->tiles_x * TILE, y = index / b->tiles_x * TILE;
    tile.x = whole->x + x;
    tile.y = whole->y + y;
    tile.width = whole->width - x < TILE ? whole->width - x : TILE;
    tile.height = whole->height - y < TILE ? whole->height - y : TILE;
    const size_t at = (size_t)y * whole->stride + (size_t)x;
    tile.color += 4 * at;
    tile.depth += at;
    tile.id += at;
    tile.blended = whole->blended != NULL ? whole->blended + at : NULL;
    return tile;
}

static void draw_things(void *user, int index, int worker) {
    static const uint16_t nothing[4] = {0, 0, 0, 0};
    const band *b = user;
    vd_target tile = tile_of(b, index);
    vd_target_clear(&tile, nothing);
    vd_raster_draw(b->renderer->raster, &tile, worker);
}

static void finish_tile(void *user, int index, int worker) {
    const band *b = user;
    vd_target tile = tile_of(b, index);
    if (b->blends) {
        vd_target_begin_blended(&tile);
        do {
            vd_raster_blend(b->renderer->raster, &tile, worker);
        } while (vd_target_blend(&tile));
    }
    vd_target_resolve(&tile, b->frame);
}

/* A target of the picture's width and as many rows as fit. */
static vd_status reserve_band(vd_world_renderer *renderer, const vd_frame *frame, bool blends) {
    const size_t row = vd_frame_stride(frame->width) * BYTES_A_SAMPLE * (size_t)renderer->samples;
    size_t rows = BAND_BYTES / row / TILE * TILE;
    rows = rows < TILE ? TILE : rows;
    rows = rows < (size_t)frame->height ? rows : (size_t)frame->height;
    const vd_target *old = renderer->target;
    vd_status status = vd_success();
    if (old == NULL || old->samples != renderer->samples || renderer->band_width != frame->width ||
        renderer->band_rows != (int)rows) {
        vd_target_destroy(&renderer->target);
        status = vd_target_create(renderer->context, frame->width, (int)rows, renderer->samples,
                                  &renderer->target);
        renderer->band_width = frame->width;
        renderer->band_rows = (int)rows;
    }
    if (status.code == VD_OK && blends) {
        status = vd_target_reserve_blended(renderer->target);
    }
    return status;
}

static bool any_blends(const vd_pass *pass) {
    const vd_draw *draws = pass->draws->data;
    bool any = false;
    for (size_t i = 0; i < pass->draws->count && !any; i++) {
        for (int m = 0; m < draws[i].material_count; m++) {
            any = any || draws[i].materials[m].blend;
        }
    }
    return any;
}

static vd_status draw_band(band *b, vd_job *job, int y, vd_world_stats *stats) {
    vd_world_renderer *r = b->renderer;
    const int left = b->frame->height - y;
    b->target->x = 0;
    b->target->y = y;
    b->target->width = b->frame->width;
    b->target->height = left < r->band_rows ? left : r->band_rows;
    b->tiles_x = (b->target->width + TILE - 1) / TILE;
    const int tiles = b->tiles_x * ((b->target->height + TILE - 1) / TILE);
    const uint64_t start = vd_clock_ns();
    vd_status status = vd_parallel_for(r->context, job, tiles, draw_things, b);
    const uint64_t things = vd_clock_ns();
    vd_frame_stats ground = {0, 0};
    if (status.code == VD_OK && b->pass->ground) {
        status = vd_terrain_renderer_composite(r->ground, job, b->pass->camera, b->frame, b->target,
                                               &ground);
    }
    const uint64_t grounds = vd_clock_ns();
    if (status.code == VD_OK) {
        status = vd_parallel_for(r->context, job, tiles, finish_tile, b);
    }
    stats->terrain.samples += ground.samples;
    stats->terrain.hits += ground.hits;
    stats->objects_s += 1e-9 * (double)(things - start);
    stats->ground_s += 1e-9 * (double)(grounds - things);
    stats->finish_s += 1e-9 * (double)(vd_clock_ns() - grounds);
    return status;
}

vd_status vd_world_composite(vd_world_renderer *renderer, vd_job *job, const vd_pass *pass,
                             vd_frame *frame) {
    vd_raster_def def = vd_raster_def_default();
    def.samples = renderer->samples;
    const uint64_t start = vd_clock_ns();
    vd_status status = vd_raster_prepare(renderer->raster, job, &def, pass->camera,
                                         pass->draws->data, (int)pass->draws->count, frame);
    band b = {.renderer = renderer, .pass = pass, .frame = frame, .blends = any_blends(pass)};
    if (status.code == VD_OK) {
        status = reserve_band(renderer, frame, b.blends);
    }
    pass->stats->prepare_s += 1e-9 * (double)(vd_clock_ns() - start);
    b.target = renderer->target;
    for (int y = 0; y < frame->height && status.code == VD_OK; y += renderer->band_rows) {
        status = draw_band(&b, job, y, pass->stats);
    }
    return status;
}

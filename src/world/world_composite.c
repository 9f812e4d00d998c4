/* world_composite.c: everything in one frame by depth.
 *
 * The terrain alone is drawn first, as a picture of its own: its silhouettes are smooth, and it
 * costs a few samples a pixel on them alone. What the rasterizer draws is then composited in bands
 * of a target, so that a band's samples stay near the processor and memory does not grow with the
 * picture. In a band, tiles in which nothing is rasterized are copied from the terrain's picture.
 * In others the rasterizer draws first; pixels of which it covers no sample take the terrain's
 * colour, all others take the terrain's samples at their own places, with the shadows that things
 * throw on them; then come what is blended, and the mean of the samples. The terrain's picture has
 * such shadows already.
 *
 * Taking every sample of the ground everywhere is four pictures of it in place of one and a part.
 * With one sample a pixel the terrain's picture has them all: each tile is then finished by one
 * worker, in a target that its first cache holds.
 */
#include <string.h>
#include "core/core.h"
#include "image/blended.h"
#include "image/image.h"
#include "raster/raster_run.h"
#include "terrain/lens_renderer.h"
#include "world/world_renderer.h"

#define TILE VD_TERRAIN_MIX_TILE
#define BAND_BYTES ((size_t)2 << 20) /* the second level of cache; 32 MiB took a sixth longer */
#define BYTES_A_SAMPLE 16

typedef struct band {
    vd_world_renderer *renderer;
    const vd_pass *pass;
    vd_frame *frame;
    vd_target *target; /* the band */
    uint32_t ground_id;
    int tiles_x;
    uint8_t *mix; /* by tile */
    bool blends;  /* anything anywhere */
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

/* What the rasterizer shows in a tile, which is drawn. */
static uint8_t draw_tile_things(const band *b, vd_target *tile, int worker) {
    static const uint16_t nothing[4] = {0, 0, 0, 0};
    bool blends = false;
    if (!vd_raster_window_any(b->renderer->raster, tile, &blends)) {
        return VD_TERRAIN_MIX_NOTHING;
    }
    vd_target_clear(tile, nothing);
    vd_raster_draw(b->renderer->raster, tile, worker);
    return blends ? VD_TERRAIN_MIX_BLENDED : VD_TERRAIN_MIX_THINGS;
}

static void draw_things(void *user, int index, int worker) {
    const band *b = user;
    vd_target tile = tile_of(b, index);
    b->mix[index] = draw_tile_things(b, &tile, worker);
}

/* Where nothing but the ground is seen. */
static void copy_ground(const band *b, const vd_target *tile) {
    const vd_frame *from = b->renderer->picture;
    vd_frame *to = b->frame;
    const size_t pixels = (size_t)tile->width;
    for (int y = tile->y; y < tile->y + tile->height; y++) {
        const size_t at = (size_t)y * to->stride + (size_t)tile->x;
        const float *depth = from->depth + (size_t)y * from->stride + (size_t)tile->x;
        memcpy(to->rgba + 4 * at, from->rgba + 4 * ((size_t)y * from->stride + (size_t)tile->x),
               4 * pixels);
        if (to->depth != NULL) {
            memcpy(to->depth + at, depth, pixels * sizeof *depth);
        }
        for (size_t x = 0; to->id != NULL && x < pixels; x++) {
            to->id[at + x] = depth[x] > 0.0f ? b->ground_id : 0;
        }
    }
}

static void clear_frame(const band *b, const vd_target *tile) {
    vd_frame *to = b->frame;
    for (int y = tile->y; y < tile->y + tile->height; y++) {
        const size_t at = (size_t)y * to->stride + (size_t)tile->x;
        memset(to->rgba + 4 * at, 0, 4 * (size_t)tile->width);
        if (to->depth != NULL) {
            memset(to->depth + at, 0, (size_t)tile->width * sizeof *to->depth);
        }
        if (to->id != NULL) {
            memset(to->id + at, 0, (size_t)tile->width * sizeof *to->id);
        }
    }
}

/* Whether any sample of a pixel shows something else than the ground. */
static bool shows_things(const band *b, const vd_target *tile, size_t at, bool list) {
    bool any = false;
    for (int s = 0; s < tile->samples && !any; s++) {
        const size_t sample = (size_t)s * tile->plane + at;
        any = (tile->id[sample] != 0 && tile->id[sample] != b->ground_id) ||
              (list && tile->blended[sample].count > 0);
    }
    return any;
}

/* Pixels whose things turned out to be hidden get the ground's own colour again: a picture must not
 * hang on what of the hidden was culled before. `shown` tells of the others. */
static void settle(const band *b, vd_target *tile, bool list, uint8_t shown[TILE * TILE]) {
    const vd_frame *ground = b->renderer->picture;
    for (int y = 0; y < tile->height; y++) {
        for (int x = 0; x < tile->width; x++) {
            const size_t at = (size_t)y * tile->stride + (size_t)x;
            const size_t from = (size_t)(tile->y + y) * ground->stride + (size_t)(tile->x + x);
            shown[y * TILE + x] = shows_things(b, tile, at, list);
            for (int s = 0; s < tile->samples && shown[y * TILE + x] == 0; s++) {
                vd_terrain_place(tile, (size_t)s * tile->plane + at, ground->rgba + 4 * from,
                                 ground->depth[from], b->ground_id);
            }
        }
    }
}

/* Makes the ground's samples transparent. */
static void clear_ground(const band *b, vd_target *tile) {
    static const uint16_t nothing[4] = {0, 0, 0, 0};
    for (int s = 0; s < tile->samples; s++) {
        for (int y = 0; y < tile->height; y++) {
            const size_t row = (size_t)s * tile->plane + (size_t)y * tile->stride;
            for (int x = 0; x < tile->width; x++) {
                if (tile->id[row + (size_t)x] == b->ground_id) {
                    memcpy(tile->color + 4 * (row + (size_t)x), nothing, sizeof nothing);
                }
            }
        }
    }
}

/* The ground's samples among things: shadows on them. The ground's own picture has its shadows;
 * with one sample a pixel there is nothing else. */
static void settle_ground(const band *b, vd_target *tile, bool list) {
    uint8_t shown[TILE * TILE];
    if (!b->pass->ground || tile->samples == 1) {
        return;
    }
    settle(b, tile, list, shown);
    if (b->pass->mask) {
        clear_ground(b, tile);
    } else if (vd_world_sun_throws(b->renderer)) {
        vd_world_shade_ground(&b->renderer->lighting, tile, b->ground_id, shown, TILE);
    }
}

/* Shadows, what is blended, and the means of the samples into the frame. */
static void finish(const band *b, vd_target *tile, uint8_t mix, int worker) {
    if (mix == VD_TERRAIN_MIX_NOTHING) {
        (b->pass->ground ? copy_ground : clear_frame)(b, tile);
        return;
    }
    if (mix == VD_TERRAIN_MIX_THINGS) {
        settle_ground(b, tile, false);
    } else {
        vd_target_begin_blended(tile);
        vd_raster_blend(b->renderer->raster, tile, worker);
        settle_ground(b, tile, true);
        while (vd_target_blend(tile)) {
            vd_raster_blend(b->renderer->raster, tile, worker);
        }
    }
    vd_target_resolve(tile, b->frame);
}

static void finish_tile(void *user, int index, int worker) {
    const band *b = user;
    vd_target tile = tile_of(b, index);
    finish(b, &tile, b->mix[index], worker);
}

/* ---- one sample a pixel -----------------------------------------------------------------------*/

/* All of a tile, in the worker's own target. */
static void draw_tile(void *user, int index, int worker) {
    const band *b = user;
    vd_target tile = *b->renderer->tiles[worker];
    tile.x = index % b->tiles_x * TILE;
    tile.y = index / b->tiles_x * TILE;
    tile.width = b->frame->width - tile.x < TILE ? b->frame->width - tile.x : TILE;
    tile.height = b->frame->height - tile.y < TILE ? b->frame->height - tile.y : TILE;
    const uint8_t mix = draw_tile_things(b, &tile, worker);
    if (mix != VD_TERRAIN_MIX_NOTHING && b->pass->ground) {
        vd_terrain_merge_picture(b->renderer->picture, b->ground_id, &tile);
    }
    finish(b, &tile, mix, worker);
}

static vd_status reserve_tiles(vd_world_renderer *r, bool blends) {
    const int threads = vd_context_threads(r->context);
    vd_status status = vd_success();
    if (r->tiles == NULL) {
        r->tiles = vd_allocate_zero(r->context, (size_t)threads, sizeof(vd_target *));
        if (r->tiles == NULL) {
            return vd_out_of_memory("a picture's tiles", (size_t)threads * sizeof(vd_target *));
        }
    }
    for (int i = 0; i < threads && status.code == VD_OK; i++) {
        if (r->tiles[i] == NULL) {
            status = vd_target_create(r->context, TILE, TILE, 1, &r->tiles[i]);
        }
        if (status.code == VD_OK && blends) {
            status = vd_target_reserve_blended(r->tiles[i]);
        }
    }
    return status;
}

static vd_status draw_tiles(band *b, vd_job *job, vd_world_stats *stats) {
    vd_world_renderer *r = b->renderer;
    const uint64_t start = vd_clock_ns();
    b->tiles_x = (b->frame->width + TILE - 1) / TILE;
    vd_status status = reserve_tiles(r, b->blends);
    if (status.code == VD_OK) {
        status = vd_parallel_for(r->context, job,
                                 b->tiles_x * ((b->frame->height + TILE - 1) / TILE), draw_tile, b);
    }
    stats->objects_s += 1e-9 * (double)(vd_clock_ns() - start);
    return status;
}

/* ---- more -------------------------------------------------------------------------------------*/

/* A target of the picture's width and as many rows as fit. */
static vd_status reserve_band(vd_world_renderer *renderer, const vd_frame *frame, bool blends) {
    const size_t row = vd_frame_stride(frame->width) * BYTES_A_SAMPLE * (size_t)renderer->samples;
    size_t rows = BAND_BYTES / row / TILE * TILE;
    rows = rows < TILE ? TILE : rows;
    rows = rows < (size_t)frame->height ? rows : (size_t)frame->height;
    const vd_target *old = renderer->target;
    vd_status status = vd_success();
    /* A wider one serves: impostors are drawn in all sizes. */
    if (old == NULL || old->samples != renderer->samples || renderer->band_width < frame->width ||
        (renderer->band_width == frame->width && renderer->band_rows < (int)rows)) {
        vd_target_destroy(&renderer->target);
        status = vd_target_create(renderer->context, frame->width, (int)rows, renderer->samples,
                                  &renderer->target);
        renderer->band_width = frame->width;
        renderer->band_rows = (int)rows;
    }
    if (status.code == VD_OK && blends) {
        status = vd_target_reserve_blended(renderer->target);
    }
    rows = (size_t)renderer->band_rows;
    const size_t tiles = ((size_t)frame->width + TILE - 1) / TILE * ((rows + TILE - 1) / TILE);
    return status.code != VD_OK ? status
                                : vd_buffer_reserve(renderer->context, &renderer->mix,
                                                    "a picture's tiles", tiles, sizeof(uint8_t));
}

/* Rows of a task that shades the terrain's picture. */
#define SHADE_ROWS 16

static void shade_rows(void *user, int index, int worker) {
    vd_world_renderer *r = user;
    const int y = index * SHADE_ROWS, left = r->picture->height - y;
    (void)worker;
    vd_world_shade_picture(&r->lighting, r->picture, r->picture, 0, y, r->picture->width,
                           left < SHADE_ROWS ? left : SHADE_ROWS);
}

/* The picture of the terrain alone, with depth, and the shadows of things on it. */
static vd_status draw_ground(vd_world_renderer *renderer, vd_job *job, const vd_pass *pass,
                             vd_frame *frame, uint32_t *id) {
    vd_status status = vd_frame_add_object(frame, renderer->ground->def.object_id, id);
    if (status.code == VD_OK) { /* impostors are drawn in all sizes */
        status = vd_frame_fit(renderer->context, frame->width, frame->height, VD_PLANE_DEPTH,
                              &renderer->picture, &renderer->picture_pixels);
    }
    if (status.code == VD_OK) {
        status = vd_terrain_renderer_draw(renderer->ground, job, pass->camera, renderer->picture,
                                          &pass->stats->terrain);
    }
    if (status.code == VD_OK && pass->mask) {
        vd_frame *picture = renderer->picture;
        memset(picture->rgba, 0, 4 * picture->stride * (size_t)picture->height);
        return status;
    }
    return status.code == VD_OK && vd_world_sun_throws(renderer)
               ? vd_parallel_for(renderer->context, job,
                                 (frame->height + SHADE_ROWS - 1) / SHADE_ROWS, shade_rows,
                                 renderer)
               : status;
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
    if (status.code == VD_OK && b->pass->ground) {
        status = vd_terrain_composite_among(r->ground, job, b->pass->camera, b->ground_id,
                                            r->picture, b->mix, b->target, &stats->terrain);
    }
    const uint64_t grounds = vd_clock_ns();
    if (status.code == VD_OK) {
        status = vd_parallel_for(r->context, job, tiles, finish_tile, b);
    }
    stats->objects_s += 1e-9 * (double)(things - start);
    stats->ground_s += 1e-9 * (double)(grounds - things);
    stats->finish_s += 1e-9 * (double)(vd_clock_ns() - grounds);
    return status;
}

vd_status vd_world_composite(vd_world_renderer *renderer, vd_job *job, const vd_pass *pass,
                             vd_frame *frame) {
    band b = {.renderer = renderer, .pass = pass, .frame = frame, .blends = any_blends(pass)};
    vd_raster_def def = vd_raster_def_default();
    def.samples = renderer->samples;
    const uint64_t start = vd_clock_ns();
    vd_status status = vd_success();
    if (pass->ground) {
        status = draw_ground(renderer, job, pass, frame, &b.ground_id);
    }
    const uint64_t ground = vd_clock_ns();
    if (status.code == VD_OK) {
        status = vd_raster_prepare(renderer->raster, job, &def, pass->camera, pass->draws->data,
                                   (int)pass->draws->count, frame);
    }
    pass->stats->ground_s += 1e-9 * (double)(ground - start);
    pass->stats->prepare_s += 1e-9 * (double)(vd_clock_ns() - ground);
    if (status.code == VD_OK && renderer->samples == 1) {
        return draw_tiles(&b, job, pass->stats);
    }
    if (status.code == VD_OK) {
        status = reserve_band(renderer, frame, b.blends);
    }
    b.target = renderer->target;
    b.mix = renderer->mix.memory;
    for (int y = 0; y < frame->height && status.code == VD_OK; y += renderer->band_rows) {
        status = draw_band(&b, job, y, pass->stats);
    }
    return status;
}

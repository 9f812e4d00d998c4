/* terrain_under.c: sky and ground, where a picture that is there already lets them through: the sky
 * over the hills, and ground between pieces of it that do not quite meet. */
#include "core/core.h"
#include "image/image.h"
#include "terrain/lens_renderer.h"

typedef struct under {
    const vd_frame *sky;
    vd_frame *frame;
    const int *list;
    int tiles_x;
} under;

/* A tile's rows and columns in a frame. */
static void tile_in(const vd_frame *frame, int tile, int tiles_x, int *x0, int *y0, int *x1,
                    int *y1) {
    *x0 = tile % tiles_x * VD_LENS_TILE;
    *y0 = tile / tiles_x * VD_LENS_TILE;
    *x1 = *x0 + VD_LENS_TILE < frame->width ? *x0 + VD_LENS_TILE : frame->width;
    *y1 = *y0 + VD_LENS_TILE < frame->height ? *y0 + VD_LENS_TILE : frame->height;
}

static bool is_opaque(const vd_frame *frame, int tile, int tiles_x) {
    int x0, y0, x1, y1;
    tile_in(frame, tile, tiles_x, &x0, &y0, &x1, &y1);
    unsigned all = 255;
    for (int y = y0; y < y1 && all == 255; y++) {
        const uint8_t *row = frame->rgba + 4 * ((size_t)y * frame->stride);
        for (int x = x0; x < x1; x++) {
            all &= row[4 * x + 3];
        }
    }
    return all == 255;
}

static void blend_tile(void *user, int index, int worker) {
    const under *u = user;
    int x0, y0, x1, y1;
    (void)worker;
    tile_in(u->frame, u->list[index], u->tiles_x, &x0, &y0, &x1, &y1);
    for (int y = y0; y < y1; y++) {
        const uint8_t *sky = u->sky->rgba + 4 * ((size_t)y * u->sky->stride);
        uint8_t *to = u->frame->rgba + 4 * ((size_t)y * u->frame->stride);
        for (int x = x0; x < x1; x++) {
            const unsigned rest = 255u - to[4 * x + 3];
            for (int k = 0; k < 4; k++) {
                to[4 * x + k] = vd_over(to[4 * x + k], sky[4 * x + k], rest);
            }
        }
    }
}

vd_status vd_terrain_draw_under(vd_terrain_renderer *renderer, vd_job *job, const vd_camera *camera,
                                bool ground, vd_frame *frame) {
    const int tiles_x = vd_lens_tile_count(frame->width);
    const int tiles = tiles_x * vd_lens_tile_count(frame->height);
    vd_status status = vd_buffer_reserve(renderer->context, &renderer->list, "a picture's tiles",
                                         (size_t)tiles, sizeof(int));
    if (status.code == VD_OK) {
        status = vd_frame_fit(renderer->context, frame->width, frame->height, VD_PLANE_DEPTH,
                              &renderer->window, &renderer->window_pixels);
    }
    if (status.code != VD_OK) {
        return status;
    }
    int *list = renderer->list.memory, count = 0;
    for (int tile = 0; tile < tiles; tile++) {
        list[count] = tile;
        count += !is_opaque(frame, tile, tiles_x);
    }
    const vd_terrain_def kept = renderer->def;
    const vd_lens_tiles seen = {0, 1, count, list};
    renderer->def.samples = 1;
    if (!ground) {
        renderer->def.window = VD_TERRAIN_NO_CELLS;
    }
    status = vd_lens_draw(renderer, job, camera, 0, &seen, renderer->window, NULL);
    renderer->def = kept;
    under u = {renderer->window, frame, list, tiles_x};
    return status.code == VD_OK ? vd_parallel_for(renderer->context, job, count, blend_tile, &u)
                                : status;
}

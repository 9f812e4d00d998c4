#include <string.h>
#include "raster/raster_lists.h"

#define SLAB_BYTES ((size_t)1 << 18)

/* ---- memory -----------------------------------------------------------------------------------*/

static bool add_slab(vd_arena *arena) {
    if (arena->slab_count == arena->slab_capacity) {
        const size_t capacity = arena->slab_capacity > 0 ? 2 * arena->slab_capacity : 64;
        uint8_t **slabs = vd_allocate(arena->context, capacity, sizeof *slabs);
        if (slabs == NULL) {
            return false;
        }
        if (arena->slab_count > 0) {
            memcpy(slabs, arena->slabs, arena->slab_count * sizeof *slabs);
        }
        vd_release(arena->context, arena->slabs);
        arena->slabs = slabs;
        arena->slab_capacity = capacity;
    }
    uint8_t *slab = vd_allocate(arena->context, SLAB_BYTES, 1);
    if (slab != NULL) {
        arena->slabs[arena->slab_count++] = slab;
    }
    return slab != NULL;
}

void *vd_arena_take(vd_arena *arena, size_t size_bytes) {
    size_bytes = (size_bytes + 63) / 64 * 64;
    if (arena->slab_count == 0 || arena->used + size_bytes > SLAB_BYTES) {
        if (arena->slab_count > 0 && arena->slab + 1 < arena->slab_count) {
            arena->slab++;
        } else if (!arena->failed && add_slab(arena)) {
            arena->slab = arena->slab_count - 1;
        } else {
            /* Whoever sees `failed` gives up; until then what is written has to go somewhere. */
            arena->failed = true;
        }
        arena->used = 0;
    }
    if (arena->slab_count == 0) {
        return NULL;
    }
    uint8_t *piece = arena->slabs[arena->slab] + arena->used;
    arena->used += size_bytes;
    return piece;
}

void vd_arena_reset(vd_arena *arena) {
    arena->slab = 0;
    arena->used = 0;
    arena->failed = false;
    if (arena->slab_count == 0 && !add_slab(arena)) {
        arena->failed = true;
    }
}

void vd_arena_finish(vd_arena *arena) {
    for (size_t i = 0; i < arena->slab_count; i++) {
        vd_release(arena->context, arena->slabs[i]);
    }
    vd_release(arena->context, arena->slabs);
    memset(arena, 0, sizeof *arena);
}

/* ---- lists ------------------------------------------------------------------------------------*/

vd_block *vd_sorter_block(vd_sorter *sorter, const vd_drawing *drawing, int list) {
    vd_block *block = vd_arena_take(&sorter->arena, sizeof *block);
    block->next = sorter->blocks[list];
    block->drawing = drawing;
    block->count = 0;
    sorter->blocks[list] = block;
    return block;
}

void vd_sorter_add_small(vd_sorter *sorter, const vd_drawing *drawing, uint32_t primitive,
                         int list) {
    vd_block *block = sorter->blocks[list];
    if (block->count == VD_BLOCK_ENTRIES || block->drawing != drawing) {
        block = vd_sorter_block(sorter, drawing, list);
    }
    block->primitives[block->count++] = primitive;
}

static void add_link(vd_sorter *sorter, const vd_setup *setup, int tile) {
    vd_link **list = &sorter->links[tile * VD_KIND_COUNT + (int)sorter->kind], *link = *list;
    if (link == NULL || link->count == VD_LINK_ENTRIES) {
        link = vd_arena_take(&sorter->arena, sizeof *link);
        link->next = *list;
        link->count = 0;
        *list = link;
    }
    link->setups[link->count++] = setup;
}

/* The tiles first … last on one axis whose samples a triangle may touch; false when none. A sample
 * is less than half a pixel from its pixel's centre. */
static bool tile_range(const int32_t v[3], int samples, int shift, int pixels, int *first,
                       int *last) {
    const int32_t slack = samples > 1 ? VD_SUBPIXELS / 2 : 0;
    int32_t min = v[0], max = v[0];
    for (int i = 1; i < 3; i++) {
        min = v[i] < min ? v[i] : min;
        max = v[i] > max ? v[i] : max;
    }
    int32_t low = (min - slack + VD_SUBPIXELS - 1) >> 8, high = (max + slack - 1) >> 8;
    low = low > 0 ? low : 0;
    high = high < pixels - 1 ? high : pixels - 1;
    *first = low >> shift;
    *last = high >> shift;
    return low <= high;
}

/* The greatest value that edge i takes on the square of `side` subpixels whose middle is (x, y). */
static int64_t edge_maximum(const vd_setup *s, int i, int64_t x, int64_t y, int64_t half) {
    const int j = (i + 1) % 3;
    const int64_t dx = (int64_t)s->x[j] - s->x[i], dy = (int64_t)s->y[j] - s->y[i];
    const int64_t reach = ((dx < 0 ? -dx : dx) + (dy < 0 ? -dy : dy)) * half;
    return dx * (y - s->y[i]) - dy * (x - s->x[i]) + reach;
}

void vd_sorter_add_setup(vd_sorter *sorter, const vd_setup *from) {
    int x0, x1, y0, y1;
    const int shift = sorter->tile_shift;
    if (!tile_range(from->x, sorter->samples, shift, sorter->width, &x0, &x1) ||
        !tile_range(from->y, sorter->samples, shift, sorter->height, &y0, &y1)) {
        return;
    }
    vd_setup *setup = vd_arena_take(&sorter->arena, sizeof *setup);
    *setup = *from;
    sorter->drawn++;
    const int64_t side = (int64_t)VD_SUBPIXELS << shift, half = side / 2;
    for (int y = y0; y <= y1; y++) {
        for (int x = x0; x <= x1; x++) {
            bool out = false;
            for (int i = 0; i < 3 && (x0 < x1 || y0 < y1); i++) {
                /* A tile's samples lie within it, and pixel centres within half a pixel of it. */
                out |= edge_maximum(setup, i, x * side + half - VD_SUBPIXELS / 2,
                                    y * side + half - VD_SUBPIXELS / 2, half) < 0;
            }
            if (!out) {
                add_link(sorter, setup, y * sorter->tiles_x + x);
            }
        }
    }
}

static void add_setup(void *user, const vd_setup *setup) {
    vd_sorter_add_setup(user, setup);
}

void vd_sorter_add_primitive(vd_sorter *sorter, const vd_drawing *drawing, uint32_t primitive) {
    sorter->clipped += vd_assemble(drawing, primitive, add_setup, sorter);
}

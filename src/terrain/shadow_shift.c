/* shadow_shift.c: the twin of the shadow counts, around its kernels: the map is cut into bands,
 * each band and what its rays can reach is copied into a slab, and blocks of 8 rows are counted in
 * parallel. Why: shadow_internal.h. */
#include <math.h>
#include <string.h>
#include "core/core.h"
#include "terrain/heightfield_block.h"
#include "terrain/shadow_internal.h"

typedef struct shift {
    const vd_heightfield *map;
    const vd_shadow_kernels *kernels;
    vd_shadow_slab slab;
    size_t sample_bytes, row_bytes, tile_count;
    uint8_t *rows; /* of the slab, from column −PAD */
    float *tiles;
    uint8_t *counts; /* of the band's first row */
    size_t stride;
    int above, below;         /* rows that rays reach up and down */
    int first_row, row_count; /* of the band in the map */
} shift;

static const vd_shadow_kernels *kernels_for(vd_isa isa) {
#if defined(__x86_64__)
    if (isa == VD_ISA_V4) {
        return &vd_shadow_kernels_v4;
    }
    if (isa == VD_ISA_V3) {
        return &vd_shadow_kernels_v3;
    }
#endif
    (void)isa;
    return &vd_shadow_kernels_v2;
}

static int wrapped(int64_t i, int n) {
    const int64_t rest = i % n;
    return (int)(rest < 0 ? rest + n : rest);
}

static int whole_blocks(int rows) {
    return (rows + VD_SHADOW_ROWS - 1) / VD_SHADOW_ROWS * VD_SHADOW_ROWS;
}

/* Fills samples with the lowest height of the type: whatever the ray's height, it is not under. */
static void fill_lowest(const shift *s, uint8_t *to, size_t samples) {
    memset(to, 0, samples * s->sample_bytes);
    if (s->map->height_type == VD_HEIGHT_F32) {
        float *heights = (float *)(void *)to;
        for (size_t i = 0; i < samples; i++) {
            heights[i] = -INFINITY;
        }
    }
}

static void copy_row(const shift *s, int row, uint8_t *to) {
    const vd_heightfield *map = s->map;
    const bool wraps = s->slab.plan->wraps;
    const size_t pitch = s->row_bytes / s->sample_bytes;
    if (!wraps && (row < 0 || row >= map->height)) {
        fill_lowest(s, to, pitch);
        return;
    }
    const size_t width = (size_t)map->width, bytes = s->sample_bytes;
    const uint8_t *from = (const uint8_t *)vd_heightfield_level_data(map, 0) +
                          (size_t)wrapped(row, map->height) * (size_t)map->levels[0].stride * bytes;
    memcpy(to + VD_SHADOW_PAD * bytes, from, width * bytes);
    if (!wraps) {
        fill_lowest(s, to, VD_SHADOW_PAD);
        fill_lowest(s, to + (VD_SHADOW_PAD + width) * bytes, pitch - VD_SHADOW_PAD - width);
        return;
    }
    for (int i = 0; i < VD_SHADOW_PAD; i++) {
        memcpy(to + (size_t)i * bytes,
               from + (size_t)wrapped(i - VD_SHADOW_PAD, map->width) * bytes, bytes);
    }
    for (size_t i = VD_SHADOW_PAD + width; i < pitch; i++) {
        memcpy(to + i * bytes, from + (i - VD_SHADOW_PAD) % width * bytes, bytes);
    }
}

/* Copies the rows of one row of tiles and measures them. */
static void prepare_tiles(void *user, int index, int worker) {
    const shift *s = user;
    (void)worker;
    const int slab_rows = s->above + whole_blocks(s->row_count) + s->below;
    const int first = index * VD_SHADOW_TILE_HEIGHT;
    const int end =
        first + VD_SHADOW_TILE_HEIGHT < slab_rows ? first + VD_SHADOW_TILE_HEIGHT : slab_rows;
    uint8_t *to = s->rows + (size_t)first * s->row_bytes;
    for (int row = first; row < end; row++) {
        copy_row(s, s->first_row - s->above + row, to + (size_t)(row - first) * s->row_bytes);
    }
    s->kernels->maxima[s->map->height_type](to, s->slab.pitch, end - first, s->tile_count,
                                            s->tiles + (size_t)index * s->tile_count);
}

static void count_block(void *user, int index, int worker) {
    const shift *s = user;
    (void)worker;
    const int row = index * VD_SHADOW_ROWS, left = s->row_count - row;
    s->kernels->count[s->map->height_type](
        &s->slab, row, left < VD_SHADOW_ROWS ? left : VD_SHADOW_ROWS, s->counts, s->stride);
}

/* Everything that is the same for all bands. */
static void init(shift *s, vd_context *context, const vd_heightfield *map,
                 const vd_shadow_plan *plan) {
    memset(s, 0, sizeof *s);
    s->map = map;
    s->kernels = kernels_for(vd_context_isa(context));
    s->sample_bytes = vd_height_bytes(map->height_type);
    s->slab.plan = plan;
    s->slab.width = map->width;
    s->slab.highest = map->max;
    s->slab.pitch = vd_row_stride((size_t)map->width + 2 * VD_SHADOW_PAD, s->sample_bytes);
    s->row_bytes = s->slab.pitch * s->sample_bytes;
    s->tile_count = s->slab.pitch / VD_SHADOW_TILE_WIDTH;
    /* The pitch of 2 or 4 byte samples need not be a multiple of a tile: the columns that count,
     * width + 2 PAD, must all lie in one. */
    if (s->tile_count * VD_SHADOW_TILE_WIDTH < (size_t)map->width + 2 * VD_SHADOW_PAD) {
        s->slab.pitch = (s->tile_count + 1) * VD_SHADOW_TILE_WIDTH;
        s->slab.pitch += s->slab.pitch * s->sample_bytes % 1024 == 0 ? VD_SHADOW_TILE_WIDTH : 0;
        s->row_bytes = s->slab.pitch * s->sample_bytes;
        s->tile_count = s->slab.pitch / VD_SHADOW_TILE_WIDTH;
    }
    s->slab.tile_pitch = s->tile_count;
    for (int k = 0; k < plan->steps; k++) {
        s->slab.dx[k] = plan->wraps ? wrapped(plan->dx[k], map->width) : plan->dx[k];
        s->slab.drop[k] = plan->t[k] < 65535.0f ? (uint32_t)plan->t[k] : 65535u;
        s->above = -plan->dy[k] > s->above ? -plan->dy[k] : s->above;
        s->below = plan->dy[k] > s->below ? plan->dy[k] : s->below;
    }
    s->slab.rows_above = s->above;
}

/* Rows of a band, a multiple of a block: never fewer than the rays reach, so that no more than half
 * of what is copied is copied again for the next band. */
static int band_rows(const shift *s, size_t slab_bytes) {
    const int reach = s->above + s->below;
    const int fitting = (int)(slab_bytes / s->row_bytes) - reach;
    int rows = fitting > reach ? fitting : reach;
    rows = rows > 1 ? rows : 1;
    return whole_blocks(rows < s->map->height ? rows : s->map->height);
}

static size_t rows_in_slab(const shift *s, int rows) {
    return (size_t)(s->above + rows + s->below);
}

/* Bytes of the tiles of a slab, whole cache lines. */
static size_t tile_bytes(const shift *s, int rows) {
    const size_t tile_rows =
        (rows_in_slab(s, rows) + VD_SHADOW_TILE_HEIGHT - 1) / VD_SHADOW_TILE_HEIGHT;
    return (tile_rows * s->tile_count * sizeof *s->tiles + 63) / 64 * 64;
}

static size_t working_bytes(const shift *s, int rows) {
    return tile_bytes(s, rows) + rows_in_slab(s, rows) * s->row_bytes;
}

static vd_status count_bands(vd_context *context, vd_job *job, shift *s, int rows,
                             uint8_t *counts) {
    vd_status status = vd_success();
    for (int first = 0; status.code == VD_OK && first < s->map->height; first += rows) {
        s->first_row = first;
        s->row_count = s->map->height - first < rows ? s->map->height - first : rows;
        s->counts = counts + (size_t)first * s->stride;
        const int slab_rows = s->above + whole_blocks(s->row_count) + s->below;
        status = vd_parallel_for(context, job,
                                 (slab_rows + VD_SHADOW_TILE_HEIGHT - 1) / VD_SHADOW_TILE_HEIGHT,
                                 prepare_tiles, s);
        if (status.code == VD_OK) {
            status = vd_parallel_for(context, job, whole_blocks(s->row_count) / VD_SHADOW_ROWS,
                                     count_block, s);
        }
    }
    return status;
}

vd_status vd_shadow_count_shift(vd_context *context, vd_job *job, const vd_heightfield *map,
                                const vd_shadow_plan *plan, uint8_t *counts, size_t stride) {
    if (plan->steps == 0) { /* nothing is high enough */
        for (int row = 0; row < map->height; row++) {
            memset(counts + (size_t)row * stride, 0, (size_t)map->width);
        }
        return vd_success();
    }
    shift s;
    init(&s, context, map, plan);
    s.stride = stride;
    int rows = band_rows(&s, plan->slab_bytes);
    if (working_bytes(&s, rows) > plan->scratch_bytes) {
        /* Fewer, if those fit: of what is lent, the tiles and rounding up to blocks take this. */
        const size_t aside = plan->scratch_bytes / 256 + VD_SHADOW_ROWS * s.row_bytes;
        const int fewer =
            band_rows(&s, plan->scratch_bytes > aside ? plan->scratch_bytes - aside : 0);
        rows = working_bytes(&s, fewer) <= plan->scratch_bytes ? fewer : rows;
    }
    const bool lent = working_bytes(&s, rows) <= plan->scratch_bytes;
    uint8_t *memory = lent ? plan->scratch : vd_allocate(context, working_bytes(&s, rows), 1);
    if (memory == NULL) {
        return vd_out_of_memory("the shadows' copy of the map", working_bytes(&s, rows));
    }
    s.tiles = (float *)(void *)memory;
    s.rows = memory + tile_bytes(&s, rows);
    s.slab.tiles = s.tiles;
    s.slab.origin = s.rows + (size_t)s.above * s.row_bytes + VD_SHADOW_PAD * s.sample_bytes;
    const vd_status status = count_bands(context, job, &s, rows, counts);
    if (!lent) {
        vd_release(context, memory);
    }
    return status;
}

/* splat_bins.c: from projected particles to tiles.
 *
 * The picture is cut into tiles of 128 × 128 pixels, each drawn by one thread at a time, so that
 * pixels need no locks and see their splats in order whatever the number of threads. Work goes in
 * two steps that overlap:
 *
 *   batch n + 1:  chunk, chunk, …   project about 8,192 particles, count them by tile, write
 *                                   16-byte records tile by tile
 *   batch n:      tile, tile, …     walk the chunks in order, blend the tile's records
 *
 * Both are tasks of one parallel loop, tiles first: a tile with half of all particles keeps one
 * thread busy while the others project. A batch's records (2 MB) stay in the caches, and of what
 * the tiles have drawn so far the 270 KB of floats that each thread works on.
 *
 * A chunk with more records than room (large splats over many tiles) fails; what comes before it is
 * drawn, and it is tried again with a quarter of its particles. So memory is bounded whatever
 * comes, and nothing is allocated while tasks run.
 */
#include <string.h>
#include "splat/splat_run.h"

/* ---- chunks -----------------------------------------------------------------------------------*/

static const vd_placing *list_at(const vd_splatter *splatter, int k) {
    return &splatter->placings[splatter->sequence[k]];
}

/* Moves a cursor on by up to `count` particles; returns by how many. */
static size_t advance(const vd_splatter *splatter, vd_splat_cursor *cursor, size_t count) {
    size_t done = 0;
    while (done < count && cursor->list < splatter->sequence_count) {
        const size_t left = list_at(splatter, cursor->list)->splats->count - cursor->at;
        const size_t step = left < count - done ? left : count - done;
        done += step;
        cursor->at += step;
        if (step == left) {
            cursor->list++;
            cursor->at = 0;
        }
    }
    return done;
}

/* The particles of a chunk that begins at a cursor: whole lists, as many as fit; of a list that
 * does not fit by itself a piece. */
static size_t measure_chunk(const vd_splatter *splatter, vd_splat_cursor cursor, size_t limit) {
    size_t count = list_at(splatter, cursor.list)->splats->count - cursor.at;
    for (int k = cursor.list + 1; k < splatter->sequence_count && count < VD_CHUNK_USUAL; k++) {
        const size_t more = list_at(splatter, k)->splats->count;
        if (count + more > VD_CHUNK_USUAL || count + more > limit) {
            break;
        }
        count += more;
    }
    return count < limit ? count : limit;
}

static void fill_batch(const vd_splatter *splatter, vd_splat_batch *batch, vd_splat_cursor cursor,
                       size_t limit) {
    batch->count = 0;
    while (batch->count < VD_BATCH_CHUNKS && cursor.list < splatter->sequence_count) {
        vd_splat_chunk *chunk = &batch->chunks[batch->count++];
        chunk->from = cursor;
        chunk->count = measure_chunk(splatter, cursor, limit);
        advance(splatter, &cursor, chunk->count);
    }
}

/* Parts of a chunk that are sorted side by side. */
enum { BIN_PARTS = 4 };

/* ---- bins -------------------------------------------------------------------------------------*/

/* The tiles that a large splat touches: [x0, x1) × [y0, y1). */
static void tile_box(const vd_splat_picture *picture, const vd_splat_large *large, int box[4]) {
    vd_splat_large_box(large, picture, box);
    box[0] >>= VD_TILE_LOG2;
    box[2] >>= VD_TILE_LOG2;
    box[1] = (box[1] + VD_TILE_SIDE - 1) >> VD_TILE_LOG2;
    box[3] = (box[3] + VD_TILE_SIDE - 1) >> VD_TILE_LOG2;
}

/* Counts a record that goes to several tiles. */
static void count_spread(const vd_splat_picture *picture, const vd_splat_scratch *scratch, int i,
                         uint32_t *counts) {
    const int32_t tile = scratch->tiles[i];
    if ((tile & VD_TILE_SPREAD) != 0) {
        int box[4];
        tile_box(picture, &scratch->large[scratch->records[i].head & ~VD_LARGE], box);
        for (int y = box[2]; y < box[3]; y++) {
            for (int x = box[0]; x < box[1]; x++) {
                counts[y * picture->tiles_x + x]++;
            }
        }
        return;
    }
    const int32_t t = tile & VD_TILE_MASK;
    counts[t]++;
    counts[t + 1] += (tile & VD_TILE_RIGHT) != 0;
    if ((tile & VD_TILE_DOWN) != 0) {
        counts[t + picture->tiles_x]++;
        counts[t + picture->tiles_x + 1] += (tile & VD_TILE_RIGHT) != 0;
    }
}

/* What binning a chunk reads and writes, in registers as far as they go. */
typedef struct binning {
    const vd_splat_picture *picture;
    const vd_splat_scratch *scratch;
    const uint32_t *sequence;
    const int32_t *tiles;
    const vd_splat_record *records;
    vd_splat_record *out;
    uint32_t tile_count;
} binning;

static inline void put(const binning *b, uint32_t *next, int tile, vd_splat_record record) {
    b->out[next[tile]++] = record;
}

/* Writes a record to several tiles: in each, where the splat is as seen from there. */
static void put_spread(const binning *b, uint32_t i, uint32_t *next) {
    const vd_splat_picture *picture = b->picture;
    const int32_t tile = b->tiles[i];
    vd_splat_record record = b->records[i];
    if ((tile & VD_TILE_SPREAD) != 0) {
        int box[4];
        tile_box(picture, &b->scratch->large[record.head & ~VD_LARGE], box);
        for (int y = box[2]; y < box[3]; y++) {
            for (int x = box[0]; x < box[1]; x++) {
                put(b, next, y * picture->tiles_x + x, record);
            }
        }
        return;
    }
    const int32_t t = tile & VD_TILE_MASK;
    const uint32_t head = record.head;
    put(b, next, t, record);
    if ((tile & VD_TILE_RIGHT) != 0) {
        record.head = head - VD_TILE_SIDE;
        put(b, next, t + 1, record);
    }
    if ((tile & VD_TILE_DOWN) != 0) {
        record.head = head - VD_TILE_SIDE * VD_TILE_STRIDE;
        put(b, next, t + picture->tiles_x, record);
        if ((tile & VD_TILE_RIGHT) != 0) {
            record.head -= VD_TILE_SIDE;
            put(b, next, t + picture->tiles_x + 1, record);
        }
    }
}

static inline void count_at(const binning *b, size_t k, uint32_t *counters) {
    const uint32_t i = b->sequence[k];
    const int32_t tile = b->tiles[i];
    if (__builtin_expect((uint32_t)tile < b->tile_count, 1)) {
        counters[tile]++;
    } else if ((uint32_t)tile != b->tile_count) {
        count_spread(b->picture, b->scratch, (int)i, counters);
    }
}

static inline void put_at(const binning *b, size_t k, uint32_t *next) {
    const uint32_t i = b->sequence[k];
    const int32_t tile = b->tiles[i];
    if (__builtin_expect((uint32_t)tile < b->tile_count, 1)) {
        put(b, next, tile, b->records[i]);
    } else if ((uint32_t)tile != b->tile_count) {
        put_spread(b, i, next);
    }
}

/* Sums up the counters of all parts: where each part's records of each tile begin. Returns how many
 * there are. */
static uint64_t sum_counters(const binning *b, uint32_t *counters, size_t stride,
                             vd_splat_chunk *chunk) {
    uint64_t sum = 0;
    chunk->first_tile = (int)b->tile_count;
    chunk->last_tile = -1;
    for (size_t t = 0; t < b->tile_count; t++) {
        const uint64_t before = sum;
        for (size_t p = 0; p < BIN_PARTS; p++) {
            const uint32_t count = counters[p * stride + t];
            counters[p * stride + t] = (uint32_t)sum;
            sum += count;
        }
        chunk->ends[t] = (uint32_t)sum;
        if (sum > before) {
            chunk->last_tile = (int)t;
            chunk->first_tile = (int)t < chunk->first_tile ? (int)t : chunk->first_tile;
        }
    }
    return sum;
}

/* All records go to one tile: half of the bricks of a dense scene. */
static void bin_uniform(const vd_splat_scratch *scratch, vd_splat_chunk *chunk) {
    const int tile = scratch->tile;
    chunk->failed = false;
    chunk->first_tile = chunk->last_tile = tile;
    chunk->ends[tile > 0 ? tile - 1 : 0] = 0;
    chunk->ends[tile] = (uint32_t)scratch->count;
    for (int k = 0; k < scratch->count; k++) {
        chunk->records[k] = scratch->records[scratch->sequence[k]];
    }
}

/* Sorts the scratch's records by tile, stable. Four parts of the sequence take turns, with counters
 * of their own: particles that follow each other are often in one tile, and adding to a counter
 * again right away waits for the first addition to get through memory. */
static void bin(const vd_splatter *splatter, const vd_splat_scratch *scratch,
                vd_splat_chunk *chunk) {
    const binning b = {&splatter->picture,
                       scratch,
                       scratch->sequence,
                       scratch->tiles,
                       scratch->records,
                       chunk->records,
                       (uint32_t)splatter->picture.tile_count};
    const size_t stride = (size_t)b.tile_count + 1, count = (size_t)scratch->count;
    const size_t part = count / BIN_PARTS;
    uint32_t *c = scratch->counters;
    memset(c, 0, BIN_PARTS * stride * sizeof *c);
    for (size_t k = 0; k < part; k++) {
        count_at(&b, k, c);
        count_at(&b, part + k, c + stride);
        count_at(&b, 2 * part + k, c + 2 * stride);
        count_at(&b, 3 * part + k, c + 3 * stride);
    }
    for (size_t k = BIN_PARTS * part; k < count; k++) {
        count_at(&b, k, c + 3 * stride);
    }
    chunk->failed = sum_counters(&b, c, stride, chunk) > splatter->chunk_records;
    if (chunk->failed) {
        return;
    }
    for (size_t k = 0; k < part; k++) {
        put_at(&b, k, c);
        put_at(&b, part + k, c + stride);
        put_at(&b, 2 * part + k, c + 2 * stride);
        put_at(&b, 3 * part + k, c + 3 * stride);
    }
    for (size_t k = BIN_PARTS * part; k < count; k++) {
        put_at(&b, k, c + 3 * stride);
    }
}

/* Projects a part of a list, all of the chunk where it is `alone`. A whole list is read in a row
 * and its records then taken in order: reading its arrays in drawing order took five times as long.
 */
static void project_part(const vd_splatter *splatter, const vd_placing *placing, size_t first,
                         size_t count, bool alone, vd_splat_scratch *scratch) {
    const bool whole = count == placing->splats->count;
    const uint32_t *order = whole ? placing->order : NULL;
    const uint32_t base = (uint32_t)scratch->count;
    if (alone) {
        scratch->sequence = order != NULL ? order : splatter->in_a_row;
    } else {
        for (uint32_t i = 0; i < count; i++) {
            scratch->own_sequence[base + i] = base + (order != NULL ? order[i] : i);
        }
        scratch->sequence = scratch->own_sequence;
    }
    splatter->kernels->project(&splatter->picture, placing, whole ? NULL : placing->order, first,
                               count, scratch);
}

static void project_chunk(vd_splatter *splatter, vd_splat_chunk *chunk, int worker) {
    vd_splat_scratch *scratch = &splatter->scratch[worker];
    memset(&scratch->counts, 0, sizeof scratch->counts);
    scratch->count = 0;
    scratch->large_count = 0;
    scratch->uniform = true;
    scratch->large = chunk->large;
    vd_splat_cursor cursor = chunk->from;
    for (size_t left = chunk->count; left > 0;) {
        const vd_placing *placing = list_at(splatter, cursor.list);
        const size_t of_list = placing->splats->count - cursor.at;
        const size_t count = of_list < left ? of_list : left;
        project_part(splatter, placing, cursor.at, count, count == chunk->count, scratch);
        left -= count;
        advance(splatter, &cursor, count);
    }
    if (scratch->uniform && (uint32_t)scratch->tile < (uint32_t)splatter->picture.tile_count) {
        bin_uniform(scratch, chunk);
    } else {
        bin(splatter, scratch, chunk);
    }
    chunk->counts = scratch->counts;
}

/* ---- tiles ------------------------------------------------------------------------------------*/

/* What a tile is before anything is drawn on it; its edge belongs to the neighbours. */
static void fill_tile(const vd_splat_picture *picture, int tile, float *pixels) {
    const int left = tile % picture->tiles_x << VD_TILE_LOG2;
    const int top = tile / picture->tiles_x << VD_TILE_LOG2;
    const int width = picture->width - left < VD_TILE_SIDE ? picture->width - left : VD_TILE_SIDE;
    const int height = picture->height - top < VD_TILE_SIDE ? picture->height - top : VD_TILE_SIDE;
    for (int i = 0; i < VD_TILE_PIXELS; i++) {
        memcpy(pixels + 4 * i, picture->background, sizeof picture->background);
    }
    for (int y = 0; y < height && picture->over != NULL; y++) {
        float *row = pixels + 4 * ((size_t)(y + 1) * VD_TILE_STRIDE + 1);
        for (int x = 0; x < width; x++) {
            vd_splat_first_color(picture, left + x, top + y, row + 4 * x);
        }
    }
}

void *vd_splatter_tile(vd_splatter *splatter, int tile) {
    char *pixels = splatter->tiles + (size_t)tile * splatter->tile_bytes;
    if (!splatter->touched[tile]) {
        splatter->touched[tile] = 1;
        if (splatter->picture.mode != VD_SPLAT_ALPHA) {
            memset(pixels, 0, splatter->tile_bytes);
            return pixels;
        }
        fill_tile(&splatter->picture, tile, (float *)(void *)pixels);
    }
    return pixels;
}

static void draw_tile(vd_splatter *splatter, int t) {
    const vd_splat_picture *picture = &splatter->picture;
    vd_splat_tile tile = {picture, t % picture->tiles_x << VD_TILE_LOG2,
                          t / picture->tiles_x << VD_TILE_LOG2, NULL};
    const vd_splat_batch *batch = splatter->drawing;
    for (int i = 0; i < batch->count; i++) {
        const vd_splat_chunk *chunk = &batch->chunks[i];
        if (t < chunk->first_tile || t > chunk->last_tile) {
            continue;
        }
        const uint32_t begin = t > 0 ? chunk->ends[t - 1] : 0, end = chunk->ends[t];
        if (begin < end) {
            tile.pixels = tile.pixels != NULL ? tile.pixels : vd_splatter_tile(splatter, t);
            splatter->kernels->blend[picture->mode](&tile, chunk->records + begin, end - begin,
                                                    chunk->large, splatter->shares);
        }
    }
}

/* ---- batches ----------------------------------------------------------------------------------*/

static void run_task(void *user, int index, int worker) {
    vd_splatter *splatter = user;
    const int tiles = splatter->drawing->count > 0 ? splatter->picture.tile_count : 0;
    if (index < tiles) {
        draw_tile(splatter, index);
    } else {
        project_chunk(splatter, &splatter->filling->chunks[index - tiles], worker);
    }
}

/* Counts what a filled batch projected and drops the chunks from the first failed one on. Returns
 * where the next batch begins; `limit` is the particles a chunk then has. */
static vd_splat_cursor settle(const vd_splatter *splatter, vd_splat_batch *batch,
                              vd_splat_cursor next, size_t *limit, vd_splat_counts *counts) {
    for (int i = 0; i < batch->count; i++) {
        const vd_splat_chunk *chunk = &batch->chunks[i];
        if (chunk->failed) {
            batch->count = i;
            *limit = chunk->count > 4 ? chunk->count / 4 : 1;
            return chunk->from;
        }
        counts->drawn += chunk->counts.drawn;
        counts->not_finite += chunk->counts.not_finite;
        counts->cut += chunk->counts.cut;
        next = chunk->from;
        advance(splatter, &next, chunk->count);
    }
    *limit = 2 * *limit < VD_CHUNK_PARTICLES ? 2 * *limit : VD_CHUNK_PARTICLES;
    return next;
}

static vd_status reserve_chunks(vd_splatter *splatter) {
    const vd_splat_picture *picture = &splatter->picture;
    const size_t tiles = (size_t)picture->tile_count;
    /* One splat must fit, over all tiles. */
    splatter->chunk_records = tiles > VD_CHUNK_RECORDS ? (uint32_t)tiles : VD_CHUNK_RECORDS;
    const size_t chunk_bytes =
        (splatter->chunk_records + VD_RECORDS_AHEAD) * sizeof(vd_splat_record) +
        VD_CHUNK_PARTICLES * sizeof(vd_splat_large) + (tiles + 15) / 16 * 16 * sizeof(uint32_t);
    vd_status status =
        vd_buffer_reserve(splatter->context, &splatter->chunk_memory,
                          "splats on their way to tiles", 2 * VD_BATCH_CHUNKS, chunk_bytes);
    if (status.code != VD_OK) {
        return status;
    }
    status = vd_buffer_reserve(splatter->context, &splatter->counter_memory, "counters of splats",
                               (size_t)splatter->thread_count * BIN_PARTS * (tiles + 1),
                               sizeof(uint32_t));
    if (status.code != VD_OK) {
        return status;
    }
    for (int i = 0; i < splatter->thread_count; i++) {
        splatter->scratch[i].counters =
            (uint32_t *)splatter->counter_memory.memory + (size_t)i * BIN_PARTS * (tiles + 1);
    }
    char *at = splatter->chunk_memory.memory;
    for (int i = 0; i < 2 * VD_BATCH_CHUNKS; i++, at += chunk_bytes) {
        vd_splat_chunk *chunk = &splatter->batches[i / VD_BATCH_CHUNKS].chunks[i % VD_BATCH_CHUNKS];
        chunk->records = (vd_splat_record *)(void *)at;
        chunk->large =
            (vd_splat_large *)(void *)(chunk->records + splatter->chunk_records + VD_RECORDS_AHEAD);
        chunk->ends = (uint32_t *)(void *)(chunk->large + VD_CHUNK_PARTICLES);
    }
    return status;
}

vd_status vd_splatter_draw(vd_splatter *splatter, vd_job *job, vd_splat_counts *counts) {
    vd_status status = reserve_chunks(splatter);
    if (status.code != VD_OK) {
        return status;
    }
    vd_splat_cursor next = {0, 0};
    size_t limit = VD_CHUNK_PARTICLES;
    splatter->filling = &splatter->batches[0];
    splatter->drawing = &splatter->batches[1];
    splatter->drawing->count = 0;
    for (;;) {
        fill_batch(splatter, splatter->filling, next, limit);
        if (splatter->filling->count == 0 && splatter->drawing->count == 0) {
            return status;
        }
        const int tiles = splatter->drawing->count > 0 ? splatter->picture.tile_count : 0;
        status = vd_parallel_for(splatter->context, NULL, tiles + splatter->filling->count,
                                 run_task, splatter);
        if (status.code == VD_OK && vd_job_stopped(job)) {
            status = vd_failure(VD_ERROR_CANCELLED, "the job was cancelled or ran out of time");
        }
        if (status.code != VD_OK) {
            return status;
        }
        next = settle(splatter, splatter->filling, next, &limit, counts);
        vd_splat_batch *filled = splatter->filling;
        splatter->filling = splatter->drawing;
        splatter->drawing = filled;
        vd_job_report(job, next.list, splatter->sequence_count);
    }
}

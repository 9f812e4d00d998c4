/* classic_march.inl: the march over wide.h. A file per SIMD level defines TABLE and includes this;
 * the table is the file's only external name.
 *
 * What is drawn. Along a column of the picture the hidden row only falls, so of everything that the
 * column's ray plane cuts, only what rises above the hidden row is seen. The map has a pyramid of
 * maxima; a cell of it whose maximum stays below the hidden row is passed in one step, all its
 * slices at once:
 *
 *      height                    ___ maximum of a coarse cell: under the ray at its end: passed
 *        eye ─┐                 │   │
 *             │`·-.             │ ▲ │         ___ under at neither end: down a level
 *             │    `·-. ray of the hidden row│   │
 *             │ ▟▙     `·-._____│___│________│_▲_│
 *             │▟██▙▟▙           │▟█▙│   ▟▙   │▟██│ …
 *             └──────────────────────────────────────► slices k
 *              seen             k       end
 *
 * One step of one column: find the cell of its level under slice k, and `end`, the last slice that
 * is surely in that cell; compute the row that the cell's maximum reaches at the worse of the two;
 *     not above the hidden row     go on at end + 1; up a level if the parent ends here too
 *     above, at level 0            that is the picture: note row and colour; go on at end + 1
 *     above, at a higher level     same slice, a level down
 * The level above all is the whole plane: passing it ends the column.
 *
 * Why it is exact. The row of a cell is computed by the picture's own formula, in its order and its
 * roundings: (eye − h)·(scale/z) + horizon. Each of these operations is monotone, roundings too, so
 * for a height h at most the maximum H and a slice at most `end` and at least k, the row is not
 * above the one of H at z_end (H under the eye: rows rise with z) or at z_k (H above the eye). No
 * margin, no second formula for level 0: there H is h, and all slices of a sample have its colour,
 * so that the highest of their rows is where its run begins. (With a depth plane each slice has a
 * depth of its own, and at level 0 `end` is k.)
 *
 * What needs a margin is `end` alone. With u = 2^−24, X the cell's edge, e the eye, d the
 * direction, all exact, the column is at the edge at k* = ((X − e)/d − z0)/step. The picture
 * computes the position of slice k with an error of at most 4u·z·|d| + u·|e|, which moves the
 * crossing by at most 4u·(k + z0/step) + u·|e|/(|d|·step)   slices. Here k_x = (X − e)·s + b with s
 * = (1 − 16u)/(d·step) and b = −z0/step − 4u·|e|/(|d|·step): rounding X − e, s, the product, b and
 * the sum takes less than 6u·(k* + z0/step) + u·|b| of what was put aside, at least 10u and 3u are
 * left, 4u and u are needed. X − e is a difference of floats below 2^22. Where d is so small that
 * the column never crosses a sample's edge between the first slice and the last (by the picture's
 * formula, and positions are monotone in k), s is 0. At 10^6 samples from the origin a position is
 * known to 1/16 only and slices near an edge are taken one by one: slow, not wrong. test_march.c
 * evaluates every slice that a sample of runs passes over.
 * A position times 2^−level is exact because nothing near float's smallest numbers comes here
 * (classic_march.c sees to it).
 *
 * Why this shape. A lane is a column and goes its own way: 90 % of the lanes of a step are alive
 * (700 × 512, default scene), though their levels and slices differ. What a step costs is waiting:
 * for heights from the second and third cache, then for the chain of operations behind them.
 * Several packets take turns, so that one works while another waits. What is found goes to a list,
 * colours are fetched a list at a time; a tile of 16 columns keeps only the first row of each run
 * and is spread downwards while it is written out.
 *
 * Tried (Zen 5, alternating runs, ratio of quartiles; faster is more than 1):
 *   parents asked only where they end with their child (tests per run seen, default / high map
 *     scene): 5.9 / 9.5, always up 7.1 / 11.8, two up 9.8 / 16.4, a level above after a sight
 *     6.4 / 9.7; two levels down 6.0 / 9.7; down by how far the cell rises 5.8 / 9.4, not worth it
 *   verifying `end` by the exact formula instead of a margin              0.97
 *   a branch around what is found                                         0.91 (v4), 0.80 (v2)
 *   dividing after the height has come, once instead of twice             0.95
 *   bytes of heights: core/wide.h
 *   on Zen 4: all packets locate and fetch before any decides, as the linear filter does   0.99
 *   1, 2, 4 packets in turns instead of 3 (v4)                            0.75, 0.98, 1.00
 *   the same on Zen 4: 3, 4, 6 packets 1.00; one division 0.98; 8 lanes (v3) 0.62
 *   colours in the rows of the map's block, default / from above          0.96 / 0.88
 *   writing tiles through the caches                                      0.93 (1920 × 1080: 0.88)
 *   strips of 4 columns instead of 8                                      1.00
 *   locating a step ahead and prefetching its height, 8 packets: map 1024² 0.85 to 0.95, 4096²
 *     1.13 to 1.26: done for maps that no second cache holds (classic_march.c)
 *   both levels of a cell and its child in one step: a quarter fewer steps of 1.4 times the work;
 *     not built
 */
#include <math.h>
#include <string.h>
#include "core/wide.h"
#include "terrain/classic_march.h"

#define LANES VD_WIDE_LANES
#define GROUPS (VD_MARCH_TILE / LANES)
#define SLOTS (LANES == 16 ? 3 : LANES == 8 ? 2 : 1)

/* Steps, or slices of the sweep, between two looks at the job: below a millisecond. */
#define POLL_STEPS 4096

/* For the proof in test_march.c: lanes of the mask pass over the slices from `first` to `end`, with
 * the hidden rows `hidden`. */
#ifndef VD_MARCH_SKIPPED
#define VD_MARCH_SKIPPED(setup, p, first, end, hidden, lanes)
#endif

/* ---- packets and slots ----------------------------------------------------------------------- */

/* Where a packet stands. */
typedef struct place {
    vd_wide_i32 index;       /* of the cell, in the map's heights */
    vd_wide_i32 column, row; /* the cell at its level */
    vd_wide_i32 up;          /* 1 where the cell's parent ends with it, else 0 */
    vd_wide_f32 end;         /* the last slice that is surely in the cell */
} place;

/* The heights of a cell and its right, lower and lower right neighbours. */
typedef struct patch {
    vd_wide_f32 h00, h10, h01, h11;
} patch;

/* LANES neighbouring columns, each somewhere on its own way. */
typedef struct packet {
    const vd_march_segment *segment;
    vd_wide_f32 k;      /* number of the next slice; behind the segment's last when it is done */
    vd_wide_f32 hidden; /* last hidden row */
    vd_wide_i32 level;
    vd_wide_f32 direction_x, direction_y;
    vd_wide_f32 slices_x, slices_y;   /* slices a sample of the map, signed, */
    vd_wide_f32 begin_x, begin_y;     /* s and b of the essay */
    vd_wide_f32 forward_x, forward_y; /* 1 where the coordinate grows, else 0 */
    vd_wide_i32 flip_x, flip_y;       /* 0 where it grows, else 1 */
    vd_wide_i32 pixel;                /* of the tiles' first row */
    place next;                       /* if located ahead */
    /* For the linear filter: the way of a slice, twice its product, and 2^−20 times the direction's
     * size. */
    vd_wide_f32 step_x, step_y, bend, unsure;
    patch four; /* where `next` is */
} packet;

/* A tile in hand. */
typedef struct slot {
    int tile;       /* −1: none */
    uint32_t alive; /* groups with columns that still see something */
    packet packets[GROUPS];
} slot;

/* Opaque, in the alpha of a pixel. */
#define OPAQUE 0xFF000000u

/* vd_classic_mix of pixels with alpha 255, two channels at a time; 0 <= w <= 256. */
VD_CLASSIC_INLINE vd_wide_u32 mix(vd_wide_u32 a, vd_wide_u32 b, vd_wide_u32 w) {
    const uint32_t even = 0x00FF00FFu, half = 0x00800080u;
    const vd_wide_u32 v = 256u - w;
    const vd_wide_u32 low = ((a & even) * v + (b & even) * w + half) >> 8 & even;
    const vd_wide_u32 high = ((a >> 8 & even) * v + (b >> 8 & even) * w + half) & ~even;
    return low | high;
}

/* ---- what is found --------------------------------------------------------------------------- */

/* Fetches the colours of the list and empties it into the tiles. */
static __attribute__((noinline)) void drain(const vd_march_map *map, vd_march_scratch *scratch,
                                            size_t count, bool deep) {
    const vd_rgba8 *from = map->height_type == VD_HEIGHT_U8 ? map->strips : map->colors;
    const uint32_t *colors = (const uint32_t *)(const void *)from;
    uint32_t *tiles = scratch->tiles;
    for (size_t i = 0; i < count; i++) {
        tiles[scratch->at[i]] = colors[scratch->from[i]] | OPAQUE;
    }
    if (deep) {
        for (size_t i = 0; i < count; i++) {
            scratch->depths[scratch->at[i]] = scratch->depth_of[i];
        }
    }
}

/* Adds the lanes of `seen` to the list; returns its new length. */
VD_CLASSIC_INLINE size_t found(const vd_march_picture *picture, const vd_march_map *map,
                               vd_march_scratch *scratch, size_t count, vd_wide_mask seen,
                               vd_wide_i32 row, vd_wide_i32 pixel, vd_wide_i32 from, vd_wide_f32 z,
                               bool deep) {
    if (__builtin_expect(count > VD_MARCH_BATCH - LANES, 0)) {
        drain(map, scratch, count, deep);
        count = 0;
    }
    /* Unsigned: the row of a lane that is not seen may be anything. */
    const vd_wide_u32 at = (vd_wide_u32)pixel + (vd_wide_u32)row * VD_MARCH_TILE;
    vd_wide_compress_i32(scratch->at + count, seen, (vd_wide_i32)at);
    vd_wide_compress_i32(scratch->from + count, seen, from);
    if (deep) {
        vd_wide_compress_i32((int32_t *)(void *)(scratch->depth_of + count), seen,
                             (vd_wide_i32)(picture->setup->z0 / z));
    }
    return count + (size_t)__builtin_popcount(vd_wide_bits(seen));
}

/* ---- the map --------------------------------------------------------------------------------- */

VD_CLASSIC_INLINE vd_wide_f32 gather_height(const vd_march_map *map, vd_wide_i32 index,
                                            vd_height_type type) {
    switch (type) {
    case VD_HEIGHT_U8:
        return __builtin_convertvector(vd_wide_gather_u8(map->heights, index), vd_wide_f32);
    case VD_HEIGHT_U16:
        return __builtin_convertvector(vd_wide_gather_u16(map->heights, index), vd_wide_f32);
    default:
        return vd_wide_gather_f32(map->heights, index);
    }
}

/* Whole numbers v, |v| < 2^23, modulo size. */
VD_CLASSIC_INLINE vd_wide_f32 wrap(vd_wide_f32 v, float size, float inverse) {
    vd_wide_f32 rest = v - vd_wide_floor_f32(v * inverse) * size;
    const vd_wide_f32 zero = vd_wide_splat_f32(0.0f), whole = vd_wide_splat_f32(size);
    rest = vd_wide_blend_f32(vd_wide_less_f32(rest, zero), rest + whole, rest);
    return vd_wide_blend_f32(vd_wide_less_f32(rest, whole), rest, rest - whole);
}

/* The extent of a cell along one axis, and its number at its level. */
typedef struct interval {
    vd_wide_f32 low, high;
    vd_wide_i32 cell;
} interval;

VD_CLASSIC_INLINE interval find_interval(vd_wide_f32 p, float size, float inverse_size,
                                         vd_wide_f32 cell, vd_wide_f32 inverse) {
    const vd_wide_f32 whole = vd_wide_floor_f32(p);
    const vd_wide_f32 rest = wrap(whole, size, inverse_size);
    const vd_wide_f32 number = vd_wide_floor_f32(rest * inverse);
    const vd_wide_f32 base = whole - rest;
    interval i;
    i.low = base + number * cell;
    i.high = vd_wide_min_f32(i.low + cell, base + size);
    i.cell = vd_wide_to_i32(number);
    return i;
}

/* ---- one step -------------------------------------------------------------------------------- */

/* Finds the cell of the packet's level under its next slice. */
VD_CLASSIC_INLINE place locate(const vd_march_picture *picture, const packet *p, bool power_of_two,
                               bool deep) {
    const vd_classic_setup *setup = picture->setup;
    const vd_march_segment *segment = p->segment;
    const vd_march_map *map = segment->map;
    const vd_wide_f32 k = p->k;
    const vd_wide_i32 level = p->level;
    place here;
    const vd_wide_f32 z = setup->z0 + k * setup->step;
    const vd_wide_f32 x = segment->eye_x + z * p->direction_x;
    const vd_wide_f32 y = segment->eye_y + z * p->direction_y;
    const vd_wide_f32 cell =
        LANES == 16 ? vd_wide_lookup_f32(map->cell, level) : vd_wide_exp2_i32(level);
    const vd_wide_f32 inverse =
        LANES == 16 ? vd_wide_lookup_f32(map->inverse, level) : vd_wide_exp2_i32(-level);

    /* The cell, and how far away its edges are. */
    vd_wide_f32 away_x, away_y;
    vd_wide_i32 column, row;
    if (power_of_two) {
        const vd_wide_f32 cell_x = vd_wide_floor_f32(x * inverse);
        const vd_wide_f32 cell_y = vd_wide_floor_f32(y * inverse);
        away_x =
            vd_wide_estimate_f32(cell_x + p->forward_x, cell, vd_wide_splat_f32(-segment->eye_x));
        away_y =
            vd_wide_estimate_f32(cell_y + p->forward_y, cell, vd_wide_splat_f32(-segment->eye_y));
        column = vd_wide_to_i32(cell_x);
        row = vd_wide_to_i32(cell_y);
    } else {
        const interval across =
            find_interval(x, (float)map->width, 1.0f / (float)map->width, cell, inverse);
        const interval along =
            find_interval(y, (float)map->height, 1.0f / (float)map->height, cell, inverse);
        away_x = across.low + p->forward_x * (across.high - across.low) - segment->eye_x;
        away_y = along.low + p->forward_y * (along.high - along.low) - segment->eye_y;
        column = across.cell;
        row = along.cell;
    }
    const vd_wide_f32 k_x = vd_wide_estimate_f32(away_x, p->slices_x, p->begin_x);
    const vd_wide_f32 k_y = vd_wide_estimate_f32(away_y, p->slices_y, p->begin_y);
    here.up =
        vd_wide_blend_i32(vd_wide_less_f32(k_x, k_y), column ^ p->flip_x, row ^ p->flip_y) & 1;
    vd_wide_i32 lead;
    if (power_of_two && LANES == 8) {
        const vd_wide_i32 mask_x = vd_wide_splat_i32(map->mask_x[0]) >> level;
        lead = vd_wide_splat_i32(map->mask_y[0]) >> level;
        column &= mask_x;
        row &= lead;
    } else {
        const vd_wide_i32 mask_x = vd_wide_lookup_i32(map->mask_x, level);
        lead = vd_wide_lookup_i32(map->mask_y, level);
        column = power_of_two ? column & mask_x : vd_wide_min_i32(column, mask_x);
        row = power_of_two ? row & lead : vd_wide_min_i32(row, lead);
    }
    here.index =
        vd_wide_lookup_i32(map->offset, level) + column + (row << 3) + (column & ~7) * lead;
    here.column = column;
    here.row = row;
    const vd_wide_f32 last = vd_wide_splat_f32(segment->last);
    const vd_wide_mask everything = vd_wide_equal_i32(level, vd_wide_splat_i32(map->everything));
    const vd_wide_f32 end = vd_wide_max_f32(vd_wide_floor_f32(vd_wide_min_f32(k_x, k_y)), k);
    here.end = vd_wide_blend_f32(everything, last, vd_wide_min_f32(end, last));
    if (deep) {
        const vd_wide_mask leaf = vd_wide_equal_i32(level, vd_wide_splat_i32(0));
        here.end = vd_wide_blend_f32(leaf, k, here.end);
    }
    return here;
}

/* Asks the caches for the height that the next step of the packet needs. */
VD_CLASSIC_INLINE void prefetch_height(const vd_march_map *map, vd_wide_i32 index,
                                       vd_height_type type) {
    const size_t bytes = type == VD_HEIGHT_U8 ? 1 : type == VD_HEIGHT_U16 ? 2 : 4;
    uint32_t at[LANES];
    memcpy(at, &index, sizeof at);
    for (int lane = 0; lane < LANES; lane++) {
        __builtin_prefetch((const uint8_t *)map->heights + bytes * at[lane]);
    }
}

/* Returns whether any lane still sees something. */
VD_CLASSIC_INLINE bool step(const vd_march_picture *picture, vd_march_scratch *scratch,
                            size_t *count, packet *p, vd_height_type type, bool power_of_two,
                            bool deep, bool ahead) {
    const vd_classic_setup *setup = picture->setup;
    const vd_march_segment *segment = p->segment;
    const vd_march_map *map = segment->map;
    const place here = ahead ? p->next : locate(picture, p, power_of_two, deep);
    const vd_wide_i32 index = here.index, up = here.up, level = p->level;
    const vd_wide_f32 k = p->k, end = here.end;
    const vd_wide_f32 height = gather_height(map, index, type);
    const vd_wide_mask leaf = vd_wide_equal_i32(level, vd_wide_splat_i32(0));
    const vd_wide_i32 everything = vd_wide_splat_i32(map->everything);
    const vd_wide_f32 past = vd_wide_splat_f32(segment->last + 1.0f);

    /* The highest row that anything in the cell reaches on the way through it. */
    const vd_wide_f32 below = setup->eye_height - height;
    const vd_wide_f32 z = setup->z0 + k * setup->step;
    const vd_wide_f32 z_end = setup->z0 + end * setup->step;
    const vd_wide_f32 rise_here = setup->scale / z, rise_end = setup->scale / z_end;
    const vd_wide_mask under = vd_wide_less_f32(below, vd_wide_splat_f32(0.0f));
    const vd_wide_f32 rise = vd_wide_blend_f32(under, rise_here, rise_end);
    const vd_wide_f32 z_worst = vd_wide_blend_f32(under, z, z_end);
    const vd_wide_f32 top = below * rise + setup->horizon;
    const vd_wide_mask visible = vd_wide_less_f32(top, p->hidden) & vd_wide_less_f32(k, past);
    const vd_wide_mask seen = visible & leaf;
    const vd_wide_mask down = visible & vd_wide_not(leaf);
    VD_MARCH_SKIPPED(setup, p, k, end, p->hidden, vd_wide_bits(vd_wide_not(visible)));

    const vd_wide_f32 zero = vd_wide_splat_f32(0.0f);
    const vd_wide_i32 first = vd_wide_to_i32(vd_wide_max_f32(top, zero));
    const vd_wide_i32 from =
        type == VD_HEIGHT_U8 ? index : here.column + here.row * map->color_stride;
    *count = found(picture, map, scratch, *count, seen, first, p->pixel, from, z_worst, deep);
    const vd_wide_f32 hidden =
        vd_wide_blend_f32(seen, __builtin_convertvector(first, vd_wide_f32), p->hidden);
    const vd_wide_f32 next = vd_wide_blend_f32(vd_wide_less_f32(zero, hidden), end + 1.0f, past);
    p->k = vd_wide_blend_f32(down, k, next);
    p->hidden = hidden;
    /* Up only where the parent ends too: on the way through it, it has been seen to be too high. */
    p->level = vd_wide_min_i32(
        vd_wide_add_where_i32(down, vd_wide_add_where_i32(vd_wide_not(visible), level, up),
                              vd_wide_splat_i32(-1)),
        everything);
    if (ahead) {
        p->next = locate(picture, p, power_of_two, deep);
        prefetch_height(map, p->next.index, type);
    }
    return vd_wide_bits(vd_wide_less_f32(p->k, past)) != 0;
}

#include "terrain/classic_march_linear.inl"
#include "terrain/classic_march_tile.inl"

/* ---- the march ------------------------------------------------------------------------------- */

VD_CLASSIC_INLINE void march(vd_march_picture *picture, vd_march_scratch *scratch,
                             vd_height_type type, bool power_of_two, bool deep, bool ahead,
                             bool linear) {
    slot slots[VD_MARCH_SLOTS];
    const int slot_count = ahead ? VD_MARCH_SLOTS : linear ? 2 * SLOTS : SLOTS;
    for (int i = 0; i < slot_count; i++) {
        begin_slot(picture, slots, i, power_of_two, deep, ahead);
    }
    /* What waits in the list is of the one map. */
    const vd_march_map *map = picture->segments[0].map;
    size_t count = 0;
    bool working = true;
    for (uint32_t steps = 1; working; steps++) {
        working = false;
        for (int i = 0; i < slot_count && linear; i++) {
            for (int group = 0; group < GROUPS && slots[i].tile >= 0; group++) {
                linear_look(picture, &slots[i].packets[group], type, power_of_two);
            }
        }
        for (int i = 0; i < slot_count; i++) {
            slot *s = &slots[i];
            if (s->tile < 0) {
                continue;
            }
            working = true;
            for (int group = 0; group < GROUPS; group++) {
                packet *p = &s->packets[group];
                if ((s->alive >> group & 1) == 0) {
                    continue;
                }
                if (__builtin_expect(p->segment->map != map, 0)) {
                    drain_list(map, scratch, count, deep, linear);
                    count = 0;
                    map = p->segment->map;
                }
                const bool alive =
                    linear ? linear_step(picture, scratch, &count, p, type)
                           : step(picture, scratch, &count, p, type, power_of_two, deep, ahead);
                if (!alive && next_segment(picture, p)) {
                    if (ahead) {
                        p->next = locate(picture, p, power_of_two, deep);
                    }
                } else if (!alive) {
                    s->alive &= ~(1u << group);
                }
            }
            if (s->alive == 0) {
                drain_list(map, scratch, count, deep, linear);
                count = 0;
                flush(picture, scratch, i, s->tile);
                begin_slot(picture, slots, i, power_of_two, deep, ahead);
            }
        }
        if (steps % POLL_STEPS == 0 && vd_job_stopped(picture->setup->job)) {
            atomic_store(&picture->interrupted, true);
            memset(scratch->tiles, 0,
                   sizeof *scratch->tiles * VD_MARCH_SLOTS * VD_MARCH_TILE *
                       (size_t)picture->setup->frame->height);
            return;
        }
    }
}

#include "terrain/classic_march_sweep.inl"

/* ---- one copy for each type, kind of map and wish for depth -----------------------------------
 */

#define COPY(name, type, power_of_two, deep)                                                       \
    static void march_##name(vd_march_picture *picture, vd_march_scratch *scratch) {               \
        march(picture, scratch, type, power_of_two, deep, false, false);                           \
    }                                                                                              \
    static void ahead_##name(vd_march_picture *picture, vd_march_scratch *scratch) {               \
        march(picture, scratch, type, power_of_two, deep, true, false);                            \
    }                                                                                              \
    static void sweep_##name(vd_march_picture *picture, vd_march_scratch *scratch) {               \
        sweep(picture, scratch, type, power_of_two, deep, false);                                  \
    }
#define LINEAR_COPY(name, type, power_of_two)                                                      \
    static void linear_##name(vd_march_picture *picture, vd_march_scratch *scratch) {              \
        march(picture, scratch, type, power_of_two, true, false, true);                            \
    }                                                                                              \
    static void linear_sweep_##name(vd_march_picture *picture, vd_march_scratch *scratch) {        \
        sweep(picture, scratch, type, power_of_two, true, true);                                   \
    }
#define COPIES(name, type)                                                                         \
    COPY(name##_any, type, false, false)                                                           \
    COPY(name##_any_deep, type, false, true)                                                       \
    COPY(name, type, true, false)                                                                  \
    COPY(name##_deep, type, true, true)                                                            \
    LINEAR_COPY(name##_any, type, false)                                                           \
    LINEAR_COPY(name, type, true)
#define ROW(kind, name)                                                                            \
    {                                                                                              \
        {kind##_##name##_any, kind##_##name##_any_deep}, {                                         \
            kind##_##name, kind##_##name##_deep                                                    \
        }                                                                                          \
    }
#define LINEAR_ROW(kind, name)                                                                     \
    { kind##_##name##_any, kind##_##name }

COPIES(u8, VD_HEIGHT_U8)
COPIES(u16, VD_HEIGHT_U16)
COPIES(f32, VD_HEIGHT_F32)

const vd_march_kernels TABLE = {
    {ROW(march, u8), ROW(march, u16), ROW(march, f32)},
    {ROW(ahead, u8), ROW(ahead, u16), ROW(ahead, f32)},
    {ROW(sweep, u8), ROW(sweep, u16), ROW(sweep, f32)},
    {LINEAR_ROW(linear, u8), LINEAR_ROW(linear, u16), LINEAR_ROW(linear, f32)},
    {LINEAR_ROW(linear_sweep, u8), LINEAR_ROW(linear_sweep, u16), LINEAR_ROW(linear_sweep, f32)}};

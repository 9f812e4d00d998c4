/* lens_march.inl: the plain ray caster's fast twin over wide.h: the same bytes. A file per SIMD
 * level defines TABLE and includes this; the table is the file's only external name.
 *
 * Pixels are drawn in blocks of 4 × 4. All rays of a block lie in a beam, an interval of u, of v
 * and a lower bound of w at every s. While the beam is narrower than a cell:
 *
 *      w ▲   beam                        two by two blocks of a level around the beam whose highest
 *        │ ═══╗                          ground is under it to where it comes out of them: passed,
 *        │    ╚═══╗  ┌────┐              then a level up; not under: a level down; at cells: every
 *        │        ╚══│═╗  │ not under    ray of the block is tested against each cell, whose four
 *        │  passed   │ ╚═ │              heights are the same for all lanes.
 *        └───────────┴────┴──► s
 *
 * What is left (wide beams, rays of both directions along an axis, silhouettes, edges' samples)
 * goes a ray a lane, through blocks (step_block) and cells (step_cell).
 *
 * Why it stays exact. A cell that matters is met by the reference's own formula with the
 * reference's own crossings, which come from the line's equation: the same bits however one came
 * there. A ray is in cell (i, j) for some s exactly if max(in, lo) < min(out, hi), so a cell can be
 * tested without walking to it; groups come from near to far, and within a rectangle a ray's cells
 * follow each other, so the first hit found is the first. A block is passed when the rays are above
 * its maximum by `margin + margin_s·s`: with u = 2^−24, positions are wrong by at most 4u·(|u| +
 * |ut|·s) cells, so the ground under a ray by that times the range of heights, and w by 4u·(|w| +
 * |w1|·s); both are below 2^−20 of what margins are made of (lens_view.c). Then the reference's f
 * is above 0 in all cells passed, and whether it remembers air or a hole from them does not matter:
 * the next cell shares an edge with them, under the ray as well or part of a hole. What beams and
 * blocks pass is proved by test_lens_march.c, which compares every byte.
 *
 * Tried (Zen 4, 1920 × 1080, one thread, valley / summit / straight down): a ray a lane from its
 * entry on 124 / 127 / 105 ms; a beam a block with cells for all rays at once 78 / 100 / 80 ms. A
 * step of 16 rays through a block or a cell takes about 190 cycles, most of them for loads of 16
 * addresses and for masks.
 */
#include "terrain/lens_near.inl"
#include "terrain/lens_colors.inl"

#define SQUARE 8 /* pixels a side: four blocks */
#define SQUARE_BLOCKS 4
#define TILE_SQUARES (VD_LENS_TILE / SQUARE)
#define TILE_BLOCKS (VD_LENS_TILE / BLOCK)

/* ---- pictures -------------------------------------------------------------------------------- */

/* A block's picture positions: pixel (x, y) of the block, from left to right, top to bottom. */
static const float block_x[BLOCK * BLOCK] = {0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2, 3, 0, 1, 2, 3};
static const float block_y[BLOCK * BLOCK] = {0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3};

/* Writes what of a block lies in the picture. */
static inline void put_block(const vd_lens_picture *picture, int x, int y, const uint32_t *color,
                             const float *depth) {
    vd_frame *frame = picture->frame;
    const int columns = frame->width - x < BLOCK ? frame->width - x : BLOCK;
    const int rows = frame->height - y < BLOCK ? frame->height - y : BLOCK;
    for (int row = 0; row < rows; row++) {
        const size_t at = (size_t)(y + row) * frame->stride + (size_t)x;
        float *depths = picture->depth + (size_t)(y + row) * picture->depth_stride + (size_t)x;
        memcpy(frame->rgba + 4 * at, color + BLOCK * row, (size_t)columns * sizeof *color);
        memcpy(depths, depth + BLOCK * row, (size_t)columns * sizeof *depth);
        if (frame->depth != NULL) {
            memcpy(frame->depth + at, depth + BLOCK * row, (size_t)columns * sizeof *depth);
        }
        for (int i = 0; frame->id != NULL && i < columns; i++) {
            frame->id[at + (size_t)i] =
                depth[BLOCK * row + i] > 0.0f ? picture->view->terrain_id : 0;
        }
    }
}

/* The packets of a square of pixels, those of a block of it one after the other. */
static inline void make_packets(const vd_lens_picture *picture, int x, int y, packet *p) {
    const f32 width = vd_wide_splat_f32((float)picture->frame->width);
    const f32 height = vd_wide_splat_f32((float)picture->frame->height);
    for (int at = 0; at < SQUARE_BLOCKS * PACKETS; at++, p++) {
        const int block = at / PACKETS, first = at % PACKETS * LANES;
        const float left = (float)(x + block % 2 * BLOCK) + 0.5f;
        const float top = (float)(y + block / 2 * BLOCK) + 0.5f;
        p->x = vd_wide_load_f32(block_x + first) + left;
        p->y = vd_wide_load_f32(block_y + first) + top;
        p->active = vd_wide_less_f32(p->x, width) & vd_wide_less_f32(p->y, height);
        make_rays(picture->view, p->x, p->y, &p->r);
        p->alive = p->active & vd_wide_less_f32(p->r.lo, p->r.hi);
        p->hits = p->active & vd_wide_not(p->active);
        p->s_hit = vd_wide_splat_f32(0.0f);
    }
}

static inline void shade_packet(const vd_lens_view *view, const packet *p, uint32_t *color,
                                float *depth, vd_lens_counts *counts) {
    i32 colors;
    f32 depths;
    shade(view, &p->r, p->active, p->hits, p->x, p->y, p->s_hit, &colors, &depths);
    counts->samples += (uint64_t)__builtin_popcount(vd_wide_bits(p->active));
    counts->hits += (uint64_t)__builtin_popcount(vd_wide_bits(p->hits));
    memcpy(color, &colors, sizeof colors);
    memcpy(depth, &depths, sizeof depths);
}

/* The beams of a tile's squares and of its blocks, and where the blocks' rays may first hit. */
typedef struct tile {
    tile_beams squares, blocks;
    float starts[TILE_BLOCKS * TILE_BLOCKS];
} tile;

/* Follows the rays of a square from s on: all of them behind the square's beam, then each block
 * behind its own, then each ray alone. */
static inline void walk_square(const vd_lens_view *view, const tile *t, int square,
                               const int blocks[SQUARE_BLOCKS], packet *p,
                               float touch[SQUARE_BLOCKS]) {
    float s = t->squares.s[square], common = INFINITY;
    for (int b = 0; b < SQUARE_BLOCKS; b++) {
        touch[b] = INFINITY;
    }
    for (int n = slab_of(view, s); n < view->slabs && any_alive(p, SQUARE_BLOCKS * PACKETS); n++) {
        const vd_lens_slab *slab = &view->slab[n];
        s = vd_lens_max(s, slab->begin);
        for (int at = 0; at < SQUARE_BLOCKS * PACKETS; at++) {
            begin_walk(slab, &p[at].r, &p[at].k);
            p[at].air = p[at].k.air | vd_wide_less_f32(p[at].k.lo, vd_wide_splat_f32(s));
        }
        if (!walk_near(slab, &t->squares, square, p, SQUARE_BLOCKS * PACKETS, &s, &common)) {
            break;
        }
        if (!(s < vd_lens_min(t->squares.hi[square], slab->end))) {
            continue;
        }
        for (int b = 0; b < SQUARE_BLOCKS; b++) {
            packet *q = p + b * PACKETS;
            float near = s;
            if (!any_alive(q, PACKETS)) {
                touch[b] = vd_lens_min(touch[b], s); /* nobody looked further */
                continue;
            }
            if (!walk_near(slab, &t->blocks, blocks[b], q, PACKETS, &near, &touch[b]) ||
                !(near < vd_lens_min(t->blocks.hi[blocks[b]], slab->end))) {
                continue;
            }
            touch[b] = vd_lens_min(touch[b], near);
            for (int at = 0; at < PACKETS; at++) {
                cast(view, &q[at].r, n, q[at].alive, vd_wide_splat_f32(near), q[at].air,
                     &q[at].hits, &q[at].s_hit);
                q[at].alive &= vd_wide_not(q[at].alive);
            }
        }
        s = slab->end;
    }
    for (int b = 0; b < SQUARE_BLOCKS; b++) {
        touch[b] = vd_lens_min(touch[b], vd_lens_min(common, s));
    }
}

/* Draws square number `square` of a tile, at (x, y). */
static inline void draw_square(const vd_lens_picture *picture, tile *t, int square, int x, int y,
                               vd_lens_counts *counts) {
    packet p[SQUARE_BLOCKS * PACKETS];
    make_packets(picture, x, y, p);
    const int first = square / TILE_SQUARES * 2 * TILE_BLOCKS + square % TILE_SQUARES * 2;
    const int blocks[SQUARE_BLOCKS] = {first, first + 1, first + TILE_BLOCKS,
                                       first + TILE_BLOCKS + 1};
    float touch[SQUARE_BLOCKS];
    walk_square(picture->view, t, square, blocks, p, touch);
    for (int b = 0; b < SQUARE_BLOCKS; b++) {
        const int left = x + b % 2 * BLOCK, top = y + b / 2 * BLOCK;
        t->starts[blocks[b]] = touch[b];
        if (left < picture->frame->width && top < picture->frame->height) {
            uint32_t color[BLOCK * BLOCK];
            float depth[BLOCK * BLOCK];
            for (int at = 0; at < PACKETS; at++) {
                shade_packet(picture->view, p + b * PACKETS + at, color + at * LANES,
                             depth + at * LANES, counts);
            }
            put_block(picture, left, top, color, depth);
        }
    }
}

static inline void store_beams(tile_beams *out, int at, const beams *b) {
    vd_wide_store_f32(out->u0 + at, b->u0);
    vd_wide_store_f32(out->u1 + at, b->u1);
    vd_wide_store_f32(out->ut0 + at, b->ut0);
    vd_wide_store_f32(out->ut1 + at, b->ut1);
    vd_wide_store_f32(out->v0 + at, b->v0);
    vd_wide_store_f32(out->v1 + at, b->v1);
    vd_wide_store_f32(out->vt0 + at, b->vt0);
    vd_wide_store_f32(out->vt1 + at, b->vt1);
    vd_wide_store_f32(out->w0 + at, b->w0);
    vd_wide_store_f32(out->w1 + at, b->w1);
    vd_wide_store_f32(out->w2 + at, b->w2);
    vd_wide_store_f32(out->w2_most + at, b->w2_most);
    vd_wide_store_f32(out->s + at, b->s);
    vd_wide_store_f32(out->hi + at, b->hi);
}

/* The beams of `side` × `side` squares of `size` pixels; those that are `aimed` from where they may
 * meet ground. */
static inline void make_tile_beams(const vd_lens_picture *picture, int tile_x, int tile_y, int side,
                                   int size, bool aimed, tile_beams *out) {
    const f32 width = vd_wide_splat_f32((float)picture->frame->width);
    const f32 height = vd_wide_splat_f32((float)picture->frame->height);
    for (int at = 0; at < side * side; at += LANES) {
        f32 x, y;
        for (int lane = 0; lane < LANES; lane++) {
            x[lane] = (float)(tile_x + (at + lane) % side * size);
            y[lane] = (float)(tile_y + (at + lane) / side * size);
        }
        beams b;
        make_beams(picture->view, x, y, (float)size, &b);
        if (aimed) {
            aim_beams(picture->view, vd_wide_less_f32(x, width) & vd_wide_less_f32(y, height), &b);
        }
        store_beams(out, at, &b);
    }
}

/* Keeps where the blocks' rays may first hit. */
static inline void put_starts(const vd_lens_picture *picture, int tile_x, int tile_y,
                              const tile *t) {
    const int columns = (picture->frame->width - tile_x + BLOCK - 1) / BLOCK;
    const int rows = (picture->frame->height - tile_y + BLOCK - 1) / BLOCK;
    for (int row = 0; row < TILE_BLOCKS && row < rows; row++) {
        float *to = picture->starts + (size_t)(tile_y / BLOCK + row) * picture->starts_stride +
                    (size_t)(tile_x / BLOCK);
        memcpy(to, t->starts + row * TILE_BLOCKS,
               sizeof *to * (size_t)(columns < TILE_BLOCKS ? columns : TILE_BLOCKS));
    }
}

static void draw(const vd_lens_picture *picture, int tile_x, int tile_y, vd_lens_counts *counts) {
    const vd_frame *frame = picture->frame;
    tile t;
    make_tile_beams(picture, tile_x, tile_y, TILE_SQUARES, SQUARE, true, &t.squares);
    make_tile_beams(picture, tile_x, tile_y, TILE_BLOCKS, BLOCK, false, &t.blocks);
    for (int square = 0; square < TILE_SQUARES * TILE_SQUARES; square++) {
        const int x = tile_x + square % TILE_SQUARES * SQUARE;
        const int y = tile_y + square / TILE_SQUARES * SQUARE;
        if (x < frame->width && y < frame->height) {
            draw_square(picture, &t, square, x, y, counts);
        }
    }
    put_starts(picture, tile_x, tile_y, &t);
}

/* ---- edges ----------------------------------------------------------------------------------- */

/* Whether depth bends between three neighbours. */
static inline mask bends(const vd_lens_view *view, f32 a, f32 b, f32 c) {
    const f32 most = vd_wide_max_f32(a, vd_wide_max_f32(b, c));
    return vd_wide_less_f32(most * view->edge_share + view->edge_least,
                            vd_wide_abs_f32((a - b) + (c - b)));
}

/* Collects the pixels of one row of a tile that lie on an edge; returns their number. */
static inline int find_edges(const vd_lens_picture *picture, int tile_x, int y, uint16_t *found) {
    const vd_lens_view *view = picture->view;
    const int width = picture->frame->width, height = picture->frame->height;
    const int columns = width - tile_x < VD_LENS_TILE ? width - tile_x : VD_LENS_TILE;
    const float *row = picture->depth + (size_t)y * picture->depth_stride + tile_x;
    const float *above = y > 0 ? row - picture->depth_stride : row;
    const float *below = y + 1 < height ? row + picture->depth_stride : row;
    /* Outside the picture is what is at its edge. Within a row of tiles only the first and the last
     * tile have such an edge. */
    float copy[3][VD_LENS_TILE + 2];
    if (tile_x == 0 || width <= tile_x + VD_LENS_TILE) {
        memset(copy, 0, sizeof copy);
        memcpy(copy[0] + 1, above, (size_t)columns * sizeof *above);
        memcpy(copy[1] + 1, row, (size_t)columns * sizeof *row);
        memcpy(copy[2] + 1, below, (size_t)columns * sizeof *below);
        copy[1][0] = tile_x > 0 ? row[-1] : row[0];
        copy[1][columns + 1] = tile_x + columns < width ? row[columns] : row[columns - 1];
        above = copy[0] + 1, row = copy[1] + 1, below = copy[2] + 1;
    }
    int count = 0;
    for (int x = 0; x < columns; x += LANES) {
        const f32 here = vd_wide_load_f32(row + x);
        const mask across =
            bends(view, vd_wide_load_f32(row + x - 1), here, vd_wide_load_f32(row + x + 1));
        const mask along =
            bends(view, vd_wide_load_f32(above + x), here, vd_wide_load_f32(below + x));
        const uint32_t all = (1u << LANES) - 1;
        uint32_t edges = view->everywhere ? all : vd_wide_bits(across | along);
        for (; edges != 0; edges &= edges - 1) {
            const int at = x + __builtin_ctz(edges);
            if (at < columns) {
                found[count++] = (uint16_t)at;
            }
        }
    }
    return count;
}

/* Draws `count` pixels of row y again. */
static void refine_pixels(const vd_lens_picture *picture, int tile_x, int y, const uint16_t *pixels,
                          int count, vd_lens_counts *counts) {
    const vd_lens_view *view = picture->view;
    vd_frame *frame = picture->frame;
    const int samples = view->samples;
    const float(*offsets)[2] = vd_sample_offsets(samples);
    /* Samples of all pixels one behind the other, LANES at a time. */
    enum { MOST = VD_LENS_TILE * 8 };
    uint32_t color[MOST + LANES];
    float depth[MOST + LANES];
    const int total = count * samples;
    for (int at = 0; at < total; at += LANES) {
        f32 x, y_positions, start;
        float nearest = INFINITY;
        for (int lane = 0; lane < LANES; lane++) {
            const int sample = at + lane < total ? at + lane : total - 1;
            const int pixel = tile_x + pixels[sample / samples];
            x[lane] = (float)pixel + offsets[sample % samples][0];
            y_positions[lane] = (float)y + offsets[sample % samples][1];
            start[lane] =
                picture->starts[(size_t)(y / BLOCK) * picture->starts_stride + pixel / BLOCK];
            nearest = vd_lens_min(nearest, start[lane]);
        }
        i32 colors;
        f32 depths;
        const mask active = vd_wide_equal_i32(vd_wide_splat_i32(0), vd_wide_splat_i32(0));
        mask hits = vd_wide_not(active);
        f32 s_hit = vd_wide_splat_f32(0.0f);
        rays r;
        make_rays(view, x, y_positions, &r);
        const int first = slab_of(view, nearest);
        if (first < view->slabs) {
            const f32 begin = vd_wide_splat_f32(view->slab[first].begin);
            const mask air = vd_wide_less_f32(r.lo, begin) |
                             vd_wide_less_f32(vd_wide_max_f32(r.lo, begin), start);
            cast(view, &r, first, active & vd_wide_less_f32(r.lo, r.hi), start, air, &hits, &s_hit);
        }
        shade(view, &r, active, hits, x, y_positions, s_hit, &colors, &depths);
        memcpy(color + at, &colors, sizeof colors);
        memcpy(depth + at, &depths, sizeof depths);
    }
    for (int p = 0; p < count; p++) {
        uint32_t sum[4] = {0, 0, 0, 0}, packed = 0;
        float nearest = 0.0f;
        for (int i = 0; i < samples; i++) {
            const uint32_t c = color[p * samples + i];
            for (int channel = 0; channel < 4; channel++) {
                sum[channel] += c >> (8 * channel) & 255;
            }
            nearest = vd_lens_max(nearest, depth[p * samples + i]);
        }
        for (int channel = 0; channel < 4; channel++) {
            packed |= (sum[channel] + (uint32_t)samples / 2) / (uint32_t)samples << (8 * channel);
        }
        const size_t to = (size_t)y * frame->stride + (size_t)(tile_x + pixels[p]);
        memcpy(frame->rgba + 4 * to, &packed, sizeof packed);
        if (frame->depth != NULL) {
            frame->depth[to] = nearest;
        }
        if (frame->id != NULL) {
            frame->id[to] = nearest > 0.0f ? view->terrain_id : 0;
        }
    }
    counts->samples += (uint64_t)total;
}

static void refine(const vd_lens_picture *picture, int tile_x, int tile_y, vd_lens_counts *counts) {
    for (int y = tile_y; y < tile_y + VD_LENS_TILE && y < picture->frame->height; y++) {
        uint16_t pixels[VD_LENS_TILE];
        const int count = find_edges(picture, tile_x, y, pixels);
        if (count > 0) {
            refine_pixels(picture, tile_x, y, pixels, count, counts);
        }
    }
}

const vd_lens_methods TABLE = {draw, refine};

/* lens_march.inl: the plain ray caster's fast twin over wide.h: the same bytes. A file per SIMD
 * level defines TABLE and includes this; the table is the file's only external name.
 *
 * A tile's pixels are drawn in squares of 8 × 8, a square in four blocks of 4 × 4. All rays of a
 * square lie in a beam, an interval of u, of v and a lower bound of w at every s:
 *
 *      w ▲   beam                        aimed      a beam a lane, through two by two blocks of the
 *        │ ═══╗                                     maxima, up a level where it passes, down where
 *        │    ╚═══╗  ┌────┐                         not, to where the finest it fits is in its way
 *        │        ╚══│═╗  │ not under    near       three by three cells around it; each that is
 *        │  passed   │ ╚═ │              ground     not under the beam's way through it is tested
 *        └───────────┴────┴──► s                    against all rays, its heights one for all lanes
 *
 * Where a square's beam is too wide for that each block goes on behind its own; where a block's is,
 * or its rays go both ways along an axis, every ray alone, a ray a lane, through blocks
 * (step_block) and cells (step_cell). Samples of pixels on edges go behind their block's beam as
 * well.
 *
 * Why it stays exact. A cell that matters is met by the reference's own formula with the
 * reference's own crossings, which come from the line's equation: the same bits however one came
 * there. A ray is in cell (i, j) for some s exactly if max(in, lo) < min(out, hi), so a cell can be
 * tested without walking to it; groups come from near to far, and within a group, row by row in the
 * beam's direction, a ray's cells follow each other, so the first hit found is the first. A block
 * is passed when the rays are above its maximum by `margin + margin_s·s`: with u = 2^−24, positions
 * are wrong by at most 4u·(|u| + |ut|·s) cells, so the ground under a ray by that times the range
 * of heights, and w by 4u·(|w| + |w1|·s); both are below 2^−20 of what margins are made of
 * (lens_view.c). Then the reference's f is above 0 in all cells passed, and whether it remembers
 * air or a hole from them does not matter: the next cell shares an edge with them, under the ray as
 * well or part of a hole. But a single cell is passed over only when all rays are known to be in
 * the air: one that came in under the ground beside it must not seem to have been. What beams
 * pass is proved by test_lens_proof.c, ray by ray, and by test_lens_march.c, byte by byte.
 *
 * Tried (Zen 4, 1920 × 1080, one thread, valley / summit / 60° down, ms):
 *      a ray a lane from its entry on                                          124 / 127 / 105
 *      a beam a block of 4 × 4, two by two cells for all its rays               80 /  96 /  71
 *      squares of 8 × 8, their beams aimed a beam a lane                        70 /  56 /  49
 *      samples of edges a block at a time behind its beam, not a ray a lane     50 /  45 /  44
 *      three by three cells, each bounded by itself, beams up to 1.75 cells     45 /  40 /  36
 *      texels of a magnified texture out of a window                            42 /  39 /  33
 * An upper bound of the beam, to end a group where all rays are under ground, found no cell less; a
 * beam raised to the rays that still look saves 2 % of the cells on silhouettes and is kept for
 * pictures of many of them. What remains, of 1,000 to 1,300 cycles for 16 pixels: testing cells
 * 28 % (4 to 8 cells, half of them ended by the first comparisons), colours 17 %, groups and walks
 * 15 %, making rays 7 %, aiming 4 %, finding edges and writing 6 %.
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

/* Copies `columns` of a block's row, which are mostly all of it. */
static inline void put_row(void *to, const void *from, int columns) {
    if (columns == BLOCK) {
        memcpy(to, from, BLOCK * sizeof(uint32_t));
    } else {
        memcpy(to, from, (size_t)columns * sizeof(uint32_t));
    }
}

/* Writes what of a block lies in the picture. */
static inline void put_block(const vd_lens_picture *picture, int x, int y, const uint32_t *color,
                             const float *depth) {
    vd_frame *frame = picture->frame;
    const int columns = frame->width - x < BLOCK ? frame->width - x : BLOCK;
    const int rows = frame->height - y < BLOCK ? frame->height - y : BLOCK;
    for (int row = 0; row < rows; row++) {
        const size_t at = (size_t)(y + row) * frame->stride + (size_t)x;
        float *depths = picture->depth + (size_t)(y + row) * picture->depth_stride + (size_t)x;
        put_row(frame->rgba + 4 * at, color + BLOCK * row, columns);
        put_row(depths, depth + BLOCK * row, columns);
        if (frame->depth != NULL) {
            put_row(frame->depth + at, depth + BLOCK * row, columns);
        }
        for (int i = 0; frame->id != NULL && i < columns; i++) {
            frame->id[at + (size_t)i] =
                depth[BLOCK * row + i] > 0.0f ? picture->view->terrain_id : 0;
        }
    }
}

/* The rays of a packet whose positions and active lanes are set; none has hit yet. */
static inline void begin_packet(const vd_lens_view *view, packet *p) {
    make_rays(view, p->x, p->y, &p->r);
    p->alive = p->active & vd_wide_less_f32(p->r.lo, p->r.hi);
    p->hits = p->active & vd_wide_not(p->active);
    p->s_hit = vd_wide_splat_f32(0.0f);
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
        begin_packet(picture->view, p);
    }
}

static inline void shade_packet(const vd_lens_view *view, const packet *p, uint32_t *color,
                                float *depth) {
    i32 colors;
    f32 depths;
    shade(view, &p->r, p->active, p->hits, p->x, p->y, p->s_hit, &colors, &depths);
    memcpy(color, &colors, sizeof colors);
    memcpy(depth, &depths, sizeof depths);
}

/* The beams of a tile's squares and of its blocks, and where the blocks' rays may first hit. */
typedef struct tile {
    tile_beams squares, blocks;
    float starts[TILE_BLOCKS * TILE_BLOCKS];
} tile;

/* The packets come into a slab, at s. */
static inline void enter_slab(const vd_lens_slab *slab, float s, packet *p, int count) {
    for (int at = 0; at < count; at++) {
        begin_walk(slab, &p[at].r, &p[at].k);
        p[at].air = p[at].k.air | vd_wide_less_f32(p[at].k.lo, vd_wide_splat_f32(s));
    }
}

/* Follows a block's packets through slab n from s on: behind the block's beam to where it is too
 * wide, and then each ray alone, also through the slabs that follow. */
static inline void walk_block(const vd_lens_view *view, int n, const tile_beams *blocks, int block,
                              packet *p, int count, float s, float *touch) {
    const vd_lens_slab *slab = &view->slab[n];
    if (!walk_near(slab, blocks, block, p, count, &s, touch) ||
        !(s < vd_lens_min(blocks->hi[block], slab->end))) {
        return;
    }
    *touch = vd_lens_min(*touch, s);
    for (int at = 0; at < count; at++) {
        cast(view, &p[at].r, n, p[at].alive, vd_wide_splat_f32(s), p[at].air, &p[at].hits,
             &p[at].s_hit);
        p[at].alive &= vd_wide_not(p[at].alive);
    }
}

/* Follows the rays of a square: all of them behind the square's beam, then each block. touch[b] is
 * where rays of block b may first hit, also such as nobody asked for. */
static inline void walk_square(const vd_lens_view *view, const tile *t, int square,
                               const int blocks[SQUARE_BLOCKS], packet *p,
                               float touch[SQUARE_BLOCKS]) {
    float s = t->squares.s[square], common = INFINITY;
    for (int b = 0; b < SQUARE_BLOCKS; b++) {
        touch[b] = INFINITY;
    }
    VD_LENS_PASSED(p, SQUARE_BLOCKS * PACKETS, -INFINITY, s);
    for (int n = slab_of(view, s); n < view->slabs && any_alive(p, SQUARE_BLOCKS * PACKETS); n++) {
        const vd_lens_slab *slab = &view->slab[n];
        s = vd_lens_max(s, slab->begin);
        enter_slab(slab, s, p, SQUARE_BLOCKS * PACKETS);
        if (!walk_near(slab, &t->squares, square, p, SQUARE_BLOCKS * PACKETS, &s, &common)) {
            break;
        }
        if (!(s < vd_lens_min(t->squares.hi[square], slab->end))) {
            continue;
        }
        for (int b = 0; b < SQUARE_BLOCKS; b++) {
            if (any_alive(p + b * PACKETS, PACKETS)) {
                walk_block(view, n, &t->blocks, blocks[b], p + b * PACKETS, PACKETS, s, &touch[b]);
            } else {
                touch[b] = vd_lens_min(touch[b], s); /* nobody looked further */
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
                const packet *q = p + b * PACKETS + at;
                shade_packet(picture->view, q, color + at * LANES, depth + at * LANES);
                counts->samples += (uint64_t)__builtin_popcount(vd_wide_bits(q->active));
                counts->hits += (uint64_t)__builtin_popcount(vd_wide_bits(q->hits));
            }
            put_block(picture, left, top, color, depth);
        }
    }
}

/* 1 / speed, 0 of one so slow that the way to anywhere is within SLACK. */
static inline void store_inverse(float *to, f32 speed) {
    const f32 zero = vd_wide_splat_f32(0.0f), still = vd_wide_splat_f32(2.0f * VD_LENS_STILL);
    vd_wide_store_f32(to, vd_wide_blend_f32(vd_wide_less_f32(still, vd_wide_abs_f32(speed)),
                                            1.0f / vd_wide_abs_f32(speed), zero));
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
    store_inverse(out->ui0 + at, b->ut0);
    store_inverse(out->ui1 + at, b->ut1);
    store_inverse(out->vi0 + at, b->vt0);
    store_inverse(out->vi1 + at, b->vt1);
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

/* The pixels of one row of a tile that lie on an edge: a bit each. */
static inline uint32_t find_edges(const vd_lens_picture *picture, int tile_x, int y) {
    const vd_lens_view *view = picture->view;
    const int width = picture->frame->width, height = picture->frame->height;
    const int columns = width - tile_x < VD_LENS_TILE ? width - tile_x : VD_LENS_TILE;
    const uint32_t all = UINT32_MAX >> (VD_LENS_TILE - columns);
    if (view->everywhere) {
        return all;
    }
    const float *row = picture->depth + (size_t)y * picture->depth_stride + tile_x;
    const float *above = y > 0 ? row - picture->depth_stride : row;
    const float *below = y + 1 < height ? row + picture->depth_stride : row;
    /* Outside the picture is what is at its edge. */
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
    uint32_t edges = 0;
    for (int x = 0; x < VD_LENS_TILE && x < columns; x += LANES) {
        const f32 here = vd_wide_load_f32(row + x);
        const mask across =
            bends(view, vd_wide_load_f32(row + x - 1), here, vd_wide_load_f32(row + x + 1));
        const mask along =
            bends(view, vd_wide_load_f32(above + x), here, vd_wide_load_f32(below + x));
        edges |= vd_wide_bits(across | along) << x;
    }
    return edges & all;
}

/* The samples of the pixels of a block, LANES at a time; the last packet repeats the last. */
static inline int make_samples(const vd_lens_view *view, int x, int y, const uint8_t *pixels,
                               int count, packet *p) {
    const int samples = view->samples, total = count * samples;
    const float(*offsets)[2] = vd_sample_offsets(samples);
    int made = 0;
    for (int at = 0; at < total; at += LANES, made++, p++) {
        for (int lane = 0; lane < LANES; lane++) {
            const int sample = at + lane < total ? at + lane : total - 1;
            const int pixel = pixels[sample / samples];
            p->x[lane] = (float)(x + pixel % BLOCK) + offsets[sample % samples][0];
            p->y[lane] = (float)(y + pixel / BLOCK) + offsets[sample % samples][1];
        }
        p->active = vd_wide_equal_i32(vd_wide_splat_i32(0), vd_wide_splat_i32(0));
        begin_packet(view, p);
    }
    return made;
}

/* The rounded mean of a pixel's samples, and the depth of the nearest. */
static inline void put_mean(const vd_lens_picture *picture, int x, int y, const uint32_t *color,
                            const float *depth) {
    vd_frame *frame = picture->frame;
    const uint32_t samples = (uint32_t)picture->view->samples;
    uint32_t sum[4] = {0, 0, 0, 0}, packed = 0;
    float nearest = 0.0f;
    for (uint32_t i = 0; i < samples; i++) {
        for (int channel = 0; channel < 4; channel++) {
            sum[channel] += color[i] >> (8 * channel) & 255;
        }
        nearest = vd_lens_max(nearest, depth[i]);
    }
    for (int channel = 0; channel < 4; channel++) {
        packed |= (sum[channel] + samples / 2) / samples << (8 * channel);
    }
    const size_t to = (size_t)y * frame->stride + (size_t)x;
    memcpy(frame->rgba + 4 * to, &packed, sizeof packed);
    if (frame->depth != NULL) {
        frame->depth[to] = nearest;
    }
    if (frame->id != NULL) {
        frame->id[to] = nearest > 0.0f ? picture->view->terrain_id : 0;
    }
}

/* Draws `count` pixels of the block at (x, y) again. */
static inline void refine_block(const vd_lens_picture *picture, const tile_beams *beam, int block,
                                int x, int y, const uint8_t *pixels, int count,
                                vd_lens_counts *counts) {
    enum { MOST = BLOCK * BLOCK * 8 };
    const vd_lens_view *view = picture->view;
    packet p[MOST / LANES];
    const int packets = make_samples(view, x, y, pixels, count, p);
    float s = picture->starts[(size_t)(y / BLOCK) * picture->starts_stride + x / BLOCK];
    VD_LENS_PASSED(p, packets, -INFINITY, s);
    for (int n = slab_of(view, s); n < view->slabs && any_alive(p, packets); n++) {
        float touch = INFINITY;
        s = vd_lens_max(s, view->slab[n].begin);
        enter_slab(&view->slab[n], s, p, packets);
        walk_block(view, n, beam, block, p, packets, s, &touch);
        s = view->slab[n].end;
    }
    uint32_t color[MOST];
    float depth[MOST];
    for (int at = 0; at < packets; at++) {
        shade_packet(view, p + at, color + at * LANES, depth + at * LANES);
    }
    for (int i = 0; i < count; i++) {
        put_mean(picture, x + pixels[i] % BLOCK, y + pixels[i] / BLOCK, color + i * view->samples,
                 depth + i * view->samples);
    }
    counts->samples += (uint64_t)(count * view->samples);
}

static void refine(const vd_lens_picture *picture, int tile_x, int tile_y, vd_lens_counts *counts) {
    uint32_t edges[VD_LENS_TILE] = {0}, any = 0;
    for (int row = 0; row < VD_LENS_TILE && tile_y + row < picture->frame->height; row++) {
        edges[row] = find_edges(picture, tile_x, tile_y + row);
        any |= edges[row];
    }
    if (any == 0) {
        return;
    }
    tile_beams beam;
    make_tile_beams(picture, tile_x, tile_y, TILE_BLOCKS, BLOCK, false, &beam);
    for (int block = 0; block < TILE_BLOCKS * TILE_BLOCKS; block++) {
        const int column = block % TILE_BLOCKS * BLOCK, row = block / TILE_BLOCKS * BLOCK;
        uint8_t pixels[BLOCK * BLOCK];
        int count = 0;
        for (int i = 0; i < BLOCK * BLOCK; i++) {
            pixels[count] = (uint8_t)i;
            count += edges[row + i / BLOCK] >> (column + i % BLOCK) & 1;
        }
        if (count > 0) {
            refine_block(picture, &beam, block, tile_x + column, tile_y + row, pixels, count,
                         counts);
        }
    }
}

const vd_lens_methods TABLE = {draw, refine};

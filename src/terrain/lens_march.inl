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
#include "terrain/lens_beams.inl"
#include "terrain/lens_colors.inl"

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

/* Draws the block at (x, y), number `at` of its tile. */
static inline void draw_block(const vd_lens_picture *picture, const tile_beams *beam, int at, int x,
                              int y, vd_lens_counts *counts) {
    const vd_lens_view *view = picture->view;
    const f32 width = vd_wide_splat_f32((float)picture->frame->width);
    const f32 height = vd_wide_splat_f32((float)picture->frame->height);
    const float start = beam->s[at];
    const int first = slab_of(view, start);
    uint32_t color[BLOCK * BLOCK];
    float depth[BLOCK * BLOCK];
    for (int packet = 0; packet < PACKETS; packet++) {
        const f32 px = vd_wide_load_f32(block_x + packet * LANES) + ((float)x + 0.5f);
        const f32 py = vd_wide_load_f32(block_y + packet * LANES) + ((float)y + 0.5f);
        const mask active = vd_wide_less_f32(px, width) & vd_wide_less_f32(py, height);
        mask hits = active & vd_wide_not(active);
        f32 s_hit = vd_wide_splat_f32(0.0f);
        rays r;
        make_rays(view, px, py, &r);
        if (first < view->slabs) {
            const vd_lens_slab *slab = &view->slab[first];
            walk k;
            begin_walk(slab, &r, &k);
            float s = vd_lens_max(start, slab->begin);
            mask air = k.air | vd_wide_less_f32(k.lo, vd_wide_splat_f32(s));
            mask alive = walk_near(slab, beam, at, &k, active & vd_wide_less_f32(r.lo, r.hi), &air,
                                   &s, &hits, &s_hit);
            if (vd_wide_bits(alive) != 0) {
                cast(view, &r, first, alive, vd_wide_splat_f32(s), air, &hits, &s_hit);
            }
        }
        i32 colors;
        f32 depths;
        shade(view, &r, active, hits, px, py, s_hit, &colors, &depths);
        counts->samples += (uint64_t)__builtin_popcount(vd_wide_bits(active));
        counts->hits += (uint64_t)__builtin_popcount(vd_wide_bits(hits));
        memcpy(color + packet * LANES, &colors, sizeof colors);
        memcpy(depth + packet * LANES, &depths, sizeof depths);
    }
    put_block(picture, x, y, color, depth);
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

/* Where the rays of each block of a tile may come over the map: `starts` of the picture. */
static inline void aim_tile(const vd_lens_picture *picture, int tile_x, int tile_y,
                            tile_beams *out) {
    enum { SIDE = VD_LENS_TILE / BLOCK };
    for (int at = 0; at < SIDE * SIDE; at += LANES) {
        f32 x, y;
        for (int lane = 0; lane < LANES; lane++) {
            x[lane] = (float)(tile_x + (at + lane) % SIDE * BLOCK);
            y[lane] = (float)(tile_y + (at + lane) / SIDE * BLOCK);
        }
        beams b;
        make_beams(picture->view, x, y, (float)BLOCK, &b);
        store_beams(out, at, &b);
    }
    const int columns = (picture->frame->width - tile_x + BLOCK - 1) / BLOCK;
    const int rows = (picture->frame->height - tile_y + BLOCK - 1) / BLOCK;
    for (int row = 0; row < SIDE && row < rows; row++) {
        float *to = picture->starts + (size_t)(tile_y / BLOCK + row) * picture->starts_stride +
                    (size_t)(tile_x / BLOCK);
        memcpy(to, out->s + row * SIDE, sizeof *to * (size_t)(columns < SIDE ? columns : SIDE));
    }
}

static void draw(const vd_lens_picture *picture, int tile_x, int tile_y, vd_lens_counts *counts) {
    enum { SIDE = VD_LENS_TILE / BLOCK };
    const vd_frame *frame = picture->frame;
    tile_beams beam;
    aim_tile(picture, tile_x, tile_y, &beam);
    for (int row = 0; row < SIDE && tile_y + row * BLOCK < frame->height; row++) {
        for (int column = 0; column < SIDE && tile_x + column * BLOCK < frame->width; column++) {
            draw_block(picture, &beam, row * SIDE + column, tile_x + column * BLOCK,
                       tile_y + row * BLOCK, counts);
        }
    }
}

/* ---- edges ----------------------------------------------------------------------------------- */

/* Appends the pixels of one row of a tile that lie on an edge; returns their number. */
static int find_edges(const vd_lens_picture *picture, int tile_x, int y, uint16_t *found) {
    const vd_lens_view *view = picture->view;
    const int width = picture->frame->width, height = picture->frame->height;
    const int columns = width - tile_x < VD_LENS_TILE ? width - tile_x : VD_LENS_TILE;
    const float *row = picture->depth + (size_t)y * picture->depth_stride + tile_x;
    const float *above = y > 0 ? row - picture->depth_stride : row;
    const float *below = y + 1 < height ? row + picture->depth_stride : row;
    float here[VD_LENS_TILE + 2];
    here[0] = tile_x > 0 ? row[-1] : row[0];
    memcpy(here + 1, row, (size_t)columns * sizeof *row);
    here[columns + 1] = tile_x + columns < width ? row[columns] : row[columns - 1];
    uint8_t edge[VD_LENS_TILE];
    for (int x = 0; x < columns; x++) {
        const float a = here[x], b = here[x + 1], c = here[x + 2], d = above[x], e = below[x];
        const float across = vd_lens_max(a, vd_lens_max(b, c));
        const float along = vd_lens_max(d, vd_lens_max(b, e));
        edge[x] = (across * view->edge_share + view->edge_least < fabsf((a - b) + (c - b))) |
                  (along * view->edge_share + view->edge_least < fabsf((d - b) + (e - b))) |
                  view->everywhere;
    }
    int count = 0;
    for (int x = 0; x < columns; x++) {
        found[count] = (uint16_t)x;
        count += edge[x];
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

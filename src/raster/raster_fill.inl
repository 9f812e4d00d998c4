/* raster_fill.inl: triangles into a window of the visibility buffer. Part of raster_kernels.inl.
 *
 * Small triangles are set up a vector of them at a time. Those of at most 4 × 4 samples are also
 * filled that way: the same sample of all of them at a time, what is covered is packed and goes one
 * by one, later, when loads do not wait for the packed stores any more. Of larger ones each row is
 * a vector of samples; for the narrow ones that was slower, since a vector load right behind
 * narrower stores to the same place waits for them. Depth and id stand in separate planes: packed
 * into 64 bits the same fill took 128 instead of 70 ms at 8192².
 *
 * Where a picture is made of depths alone (one draw, shaded by depth) ids are neither cleared nor
 * written nor compared: what shows something has a depth above 0, and a maximum needs no ties. That
 * is a quarter of the bunny at 1024², a tenth of the dragons.
 *
 * Triangles that do not fit 32 bits have the values of a 64-pixel wide strip's rows in 64 bits,
 * clamped to where they change sign within the strip.
 */

/* Corners of VD_WIDE_LANES triangles. */
typedef struct corners {
    vd_wide_i32 x[3], y[3];
    vd_wide_f32 z[3];
} corners;

/* Loads the corners of VD_WIDE_LANES triangles: lane i's indices stand at index + at[i], or at
 * index + 3·i where `at` is null. */
static inline void load_corners(const vd_drawing *drawing, const uint32_t *index,
                                const uint32_t *at, corners *out) {
    for (int i = 0; i < 3; i++) {
        vd_wide_i32 record[4];
        vd_wide_load_records(drawing->vertices, index + i, at, record);
        out->x[i] = record[0];
        out->y[i] = record[1];
        out->z[i] = (vd_wide_f32)record[2];
    }
}

static inline vd_wide_i32 min3(const vd_wide_i32 v[3]) {
    return vd_wide_min_i32(vd_wide_min_i32(v[0], v[1]), v[2]);
}

static inline vd_wide_i32 max3(const vd_wide_i32 v[3]) {
    return vd_wide_max_i32(vd_wide_max_i32(v[0], v[1]), v[2]);
}

/* Twice the area, positive for clockwise; right where the box is below VD_SMALL_SUBPIXELS. */
static inline vd_wide_i32 area_of(const corners *c) {
    const vd_wide_u32 *x = (const vd_wide_u32 *)c->x, *y = (const vd_wide_u32 *)c->y;
    return (vd_wide_i32)((x[1] - x[0]) * (y[2] - y[0]) - (x[2] - x[0]) * (y[1] - y[0]));
}

/* Which areas are kept; an area of 0 never is. */
static inline vd_wide_mask keep_areas(const vd_drawing *drawing, vd_wide_i32 area) {
    const vd_wide_i32 zero = vd_wide_splat_i32(0);
    vd_wide_mask keep = vd_wide_less_i32(zero, zero);
    if (drawing->keep_clockwise) {
        keep = vd_wide_or(keep, vd_wide_less_i32(zero, area));
    }
    if (drawing->keep_counter_clockwise) {
        keep = vd_wide_or(keep, vd_wide_less_i32(area, zero));
    }
    return keep;
}

/* Boxes of up to NARROW samples a side are filled across lanes. */
#define NARROW 4
#define MOST_PENDING (VD_PENDING - NARROW * NARROW * VD_WIDE_LANES - VD_WIDE_LANES)

/* Small triangles, set up: the inside is where all three edges are >= 0. Positions count from the
 * first sample of the window. */
typedef struct setups {
    int32_t x0[VD_WIDE_LANES], y0[VD_WIDE_LANES], x1[VD_WIDE_LANES], y1[VD_WIDE_LANES]; /* pixels */
    int32_t edge[3][VD_WIDE_LANES];                             /* at x0, y0 */
    int32_t step_x[3][VD_WIDE_LANES], step_y[3][VD_WIDE_LANES]; /* to the next pixel */
    int32_t from_x[VD_WIDE_LANES], from_y[VD_WIDE_LANES];       /* of x0, y0 from corner 0 */
    float z0[VD_WIDE_LANES], dz_dx[VD_WIDE_LANES], dz_dy[VD_WIDE_LANES];
    float z_min[VD_WIDE_LANES], z_max[VD_WIDE_LANES];
    uint32_t id[VD_WIDE_LANES];
} setups;

/* z0 + (dx·dz_dx + dy·dz_dy), clamped. `across` is dx·dz_dx, `down` is dy·dz_dy. */
static inline vd_wide_f32 plane_depth(vd_wide_f32 z0, vd_wide_f32 across, vd_wide_f32 down,
                                      vd_wide_f32 z_min, vd_wide_f32 z_max) {
    const vd_wide_f32 z = z0 + (across + down);
    return vd_wide_min_f32(vd_wide_max_f32(z, z_min), z_max);
}

/* Writes the pending samples, without a branch: whether one is nearer is as good as random. Depths
 * are not negative, so that they compare as integers; the lower id is the greater complement. */
static void flush(vd_visible *visible) {
    const vd_pending *f = visible->pending;
    float *depth = visible->depth;
    for (int i = 0; visible->bare && i < f->count; i++) {
        float *to = depth + f->at[i];
        *to = f->depth[i] > *to ? f->depth[i] : *to;
    }
    if (visible->bare) {
        visible->pending->count = 0;
        return;
    }
    uint32_t *id = visible->id;
    for (int i = 0; i < f->count; i++) {
        float *to_depth = depth + f->at[i];
        uint32_t *to_id = id + f->at[i];
        uint32_t now, old;
        memcpy(&now, &f->depth[i], sizeof now);
        memcpy(&old, to_depth, sizeof old);
        const uint64_t key = (uint64_t)now << 32 | ~f->id[i];
        const uint64_t old_key = (uint64_t)old << 32 | ~*to_id;
        const uint64_t best = key > old_key ? key : old_key;
        const uint32_t bits = (uint32_t)(best >> 32);
        memcpy(to_depth, &bits, sizeof bits);
        *to_id = ~(uint32_t)best;
    }
    visible->pending->count = 0;
}

/* Writes VD_WIDE_LANES samples in a row where `inside` and nearer. */
static inline vd_wide_f32 fill_row(float *depth, uint32_t *id, vd_wide_mask inside, vd_wide_f32 z,
                                   vd_wide_i32 name) {
    const vd_wide_f32 old = vd_wide_load_f32(depth);
    const vd_wide_i32 old_name = vd_wide_load_i32((const int32_t *)(const void *)id);
    const vd_wide_mask same = vd_wide_and(
        vd_wide_equal_f32(z, old), vd_wide_less_u32((vd_wide_u32)name, (vd_wide_u32)old_name));
    const vd_wide_mask nearer = vd_wide_and(inside, vd_wide_or(vd_wide_less_f32(old, z), same));
    const vd_wide_f32 now = vd_wide_blend_f32(nearer, z, old);
    vd_wide_store_f32(depth, now);
    vd_wide_store_i32((int32_t *)(void *)id, vd_wide_blend_i32(nearer, name, old_name));
    return now;
}

/* The same where nobody asks for ids. */
static inline vd_wide_f32 fill_row_bare(float *depth, vd_wide_mask inside, vd_wide_f32 z) {
    const vd_wide_f32 old = vd_wide_load_f32(depth);
    const vd_wide_f32 now = vd_wide_blend_f32(inside, vd_wide_max_f32(z, old), old);
    vd_wide_store_f32(depth, now);
    return now;
}

/* ---- small: rows ------------------------------------------------------------------------------*/

/* Vectors begin where the triangle does. At whole multiples of their width, for loads that match
 * the last triangle's stores, the armadillo at 1024² took 3.0 instead of 2.5 ms, more vectors. */
static void fill_rows(vd_visible *visible, size_t plane, const setups *s, int lane) {
    const vd_wide_i32 ramp = vd_wide_count_i32();
    const vd_wide_f32 z0 = vd_wide_splat_f32(s->z0[lane]);
    const vd_wide_f32 dz_dx = vd_wide_splat_f32(s->dz_dx[lane]);
    const vd_wide_f32 z_min = vd_wide_splat_f32(s->z_min[lane]);
    const vd_wide_f32 z_max = vd_wide_splat_f32(s->z_max[lane]);
    const float dz_dy = s->dz_dy[lane];
    const vd_wide_i32 name = vd_wide_splat_i32((int32_t)s->id[lane]);
    const int x0 = s->x0[lane], x1 = s->x1[lane], height = s->y1[lane] - s->y0[lane] + 1;
    const size_t stride = visible->stride;
    const bool bare = visible->bare;
    for (int x = x0; x <= x1; x += VD_WIDE_LANES) {
        const vd_wide_i32 right = ramp + (x - x0);
        vd_wide_i32 edge[3], step[3];
        for (int i = 0; i < 3; i++) {
            edge[i] = s->edge[i][lane] + right * s->step_x[i][lane];
            step[i] = vd_wide_splat_i32(s->step_y[i][lane]);
        }
        const vd_wide_f32 across = vd_wide_to_f32(s->from_x[lane] + right * VD_SUBPIXELS) * dz_dx;
        const vd_wide_mask exists = vd_wide_less_i32(ramp, vd_wide_splat_i32(x1 + 1 - x));
        const size_t at = plane + (size_t)s->y0[lane] * stride + (size_t)x;
        float *depth = visible->depth + at;
        uint32_t *id = visible->id + at;
        int32_t from_y = s->from_y[lane];
        for (int y = 0; y < height; y++) {
            const vd_wide_i32 outside = edge[0] | edge[1] | edge[2];
            const vd_wide_mask inside =
                vd_wide_and(exists, vd_wide_less_i32(vd_wide_splat_i32(-1), outside));
            if (vd_wide_bits(inside) != 0) {
                const vd_wide_f32 down = vd_wide_splat_f32((float)from_y * dz_dy);
                const vd_wide_f32 z = plane_depth(z0, across, down, z_min, z_max);
                if (bare) {
                    fill_row_bare(depth, inside, z);
                } else {
                    fill_row(depth, id, inside, z, name);
                }
            }
            for (int i = 0; i < 3; i++) {
                edge[i] += step[i];
            }
            from_y += VD_SUBPIXELS;
            depth += stride;
            id += stride;
        }
    }
}

/* ---- small: setting up ------------------------------------------------------------------------*/

/* The most that any lane of `mask` has of v, 1 … NARROW. */
static inline int most(vd_wide_mask mask, vd_wide_i32 v) {
    int n = 1;
    for (; n < NARROW; n++) {
        if (vd_wide_bits(vd_wide_and(mask, vd_wide_less_i32(vd_wide_splat_i32(n), v))) == 0) {
            break;
        }
    }
    return n;
}

/* All samples of narrow boxes: at each place the same sample of all triangles. */
static void fill_narrow(vd_visible *visible, size_t plane, vd_wide_mask mask,
                        const vd_wide_i32 box[4], const vd_wide_i32 edge[3],
                        const vd_wide_i32 step_x[3], const vd_wide_i32 step_y[3],
                        const vd_wide_i32 from[2], const vd_wide_f32 z[5], vd_wide_i32 name) {
    vd_pending *f = visible->pending;
    if (f->count > MOST_PENDING) {
        flush(visible);
    }
    int count = f->count;
    const vd_wide_i32 wide = box[2] - box[0] + 1, high = box[3] - box[1] + 1;
    const int columns = most(mask, wide), rows = most(mask, high);
    const int32_t stride = (int32_t)visible->stride;
    const bool bare = visible->bare;
    vd_wide_i32 at = box[1] * stride + box[0] + (int32_t)plane, e[3] = {edge[0], edge[1], edge[2]};
    for (int row = 0; row < rows; row++) {
        const vd_wide_f32 down = vd_wide_to_f32(from[1] + row * VD_SUBPIXELS) * z[2];
        const vd_wide_mask in_row =
            vd_wide_and(mask, vd_wide_less_i32(vd_wide_splat_i32(row), high));
        vd_wide_i32 e0 = e[0], e1 = e[1], e2 = e[2];
        for (int column = 0; column < columns; column++) {
            const vd_wide_mask here =
                vd_wide_and(in_row, vd_wide_less_i32(vd_wide_splat_i32(column), wide));
            const vd_wide_mask inside =
                vd_wide_and(here, vd_wide_less_i32(vd_wide_splat_i32(-1), e0 | e1 | e2));
            const vd_wide_f32 across = vd_wide_to_f32(from[0] + column * VD_SUBPIXELS) * z[1];
            const vd_wide_f32 depth = plane_depth(z[0], across, down, z[3], z[4]);
            vd_wide_compress_i32(f->at + count, inside, at + column);
            vd_wide_compress_i32((int32_t *)(void *)(f->depth + count), inside, (vd_wide_i32)depth);
            if (!bare) {
                vd_wide_compress_i32((int32_t *)(void *)(f->id + count), inside, name);
            }
            count += __builtin_popcount(vd_wide_bits(inside));
            e0 += step_x[0];
            e1 += step_x[1];
            e2 += step_x[2];
        }
        at += stride;
        for (int k = 0; k < 3; k++) {
            e[k] += step_y[k];
        }
    }
    f->count = count;
}

static inline void swap_where(vd_wide_mask mask, vd_wide_i32 *a, vd_wide_i32 *b) {
    const vd_wide_i32 old = *a;
    *a = vd_wide_blend_i32(mask, *b, old);
    *b = vd_wide_blend_i32(mask, old, *b);
}

/* ---- what is hidden ---------------------------------------------------------------------------
 * A tile knows a depth that all its samples are in front of, and the same of its 4 × 4 blocks
 * (Greene 1996, two levels); draws are filled nearest first. A triangle behind the blocks that its
 * box touches is not set up. Thirty bunnies one behind the other at 1024², whichever is drawn
 * first: 18.7 -> 13.9 ms; thirty dragons of 202 k: 132 -> 114, of which sorting, which comes
 * before, is half. A single mesh hides little of itself and paid 3 to 5 % for looking, so that
 * pictures of one draw do not look. Rejecting triangles already in the lists, by a depth and a
 * block that stand there for each: 162 instead of 138 ms for the dragons, since the lists are three
 * times as long.
 */

/* Finds the window's hidden depths. What is pending has no part in them, which only makes them
 * less. */
static void find_hidden(vd_visible *visible) {
    const int side = 1 << visible->block_shift;
    const vd_wide_i32 ramp = vd_wide_count_i32();
    const vd_wide_f32 most = vd_wide_splat_f32(2.0f);
    visible->hides = false;
    visible->since = 0;
    for (int s = 0; s < visible->samples; s++) {
        float all = 2.0f;
        for (int block = 0; block < VD_HIDE_BLOCKS * VD_HIDE_BLOCKS; block++) {
            const int x0 = block % VD_HIDE_BLOCKS * side, y0 = block / VD_HIDE_BLOCKS * side;
            const int right = visible->width - x0 < side ? visible->width - x0 : side;
            vd_wide_f32 least = most;
            for (int y = y0; y < y0 + side && y < visible->height; y++) {
                const float *row = visible->depth + (size_t)s * visible->plane +
                                   (size_t)y * visible->stride + (size_t)x0;
                for (int x = 0; x < right; x += VD_WIDE_LANES) {
                    const vd_wide_mask exists =
                        vd_wide_less_i32(ramp, vd_wide_splat_i32(right - x));
                    least = vd_wide_min_f32(
                        least, vd_wide_blend_f32(exists, vd_wide_load_f32(row + x), most));
                }
            }
            float lanes[VD_WIDE_LANES], value = 2.0f;
            vd_wide_store_f32(lanes, least);
            for (int i = 0; i < VD_WIDE_LANES; i++) {
                value = lanes[i] < value ? lanes[i] : value;
            }
            visible->hidden_blocks[s][block] = value;
            visible->hides = visible->hides || value > 0.0f;
            all = value < all ? value : all;
        }
        visible->hidden[s] = all;
    }
}

/* The depth behind which a box of samples is hidden. */
static inline vd_wide_f32 hidden_behind(const vd_visible *visible, int sample,
                                        const vd_wide_i32 box[4]) {
    const vd_wide_f32 all = vd_wide_splat_f32(visible->hidden[sample]);
    if (!visible->hides) {
        return all;
    }
    const float *table = visible->hidden_blocks[sample];
    const int shift = visible->block_shift;
    /* Of a box that is empty any block will do. */
    const vd_wide_i32 x0 = box[0] >> shift, y0 = (box[1] >> shift) * VD_HIDE_BLOCKS;
    const vd_wide_i32 x1 = box[2] >> shift, y1 = (box[3] >> shift) * VD_HIDE_BLOCKS;
    const vd_wide_f32 upper = vd_wide_min_f32(vd_wide_lookup_f32(table, (y0 + x0) & 15),
                                              vd_wide_lookup_f32(table, (y0 + x1) & 15));
    const vd_wide_f32 lower = vd_wide_min_f32(vd_wide_lookup_f32(table, (y1 + x0) & 15),
                                              vd_wide_lookup_f32(table, (y1 + x1) & 15));
    /* The corners' blocks are all there is to a box of up to a block's side. */
    const vd_wide_i32 side = vd_wide_splat_i32(1 << shift);
    const vd_wide_mask small = vd_wide_and(vd_wide_less_i32(box[2] - box[0], side),
                                           vd_wide_less_i32(box[3] - box[1], side));
    return vd_wide_blend_f32(small, vd_wide_min_f32(upper, lower), all);
}

/* Sets up and fills the triangles of `lanes` into one sample's plane. `c` counts from the window's
 * first sample. */
static void fill_batch(vd_visible *visible, int sample, const vd_drawing *drawing, corners c,
                       vd_wide_mask lanes, vd_wide_i32 name) {
    const size_t plane = (size_t)sample * visible->plane;
    const vd_wide_i32 zero = vd_wide_splat_i32(0);
    vd_wide_i32 box[4]; /* x0, y0, x1, y1: pixels with a sample in the box */
    box[0] = vd_wide_max_i32((min3(c.x) + (VD_SUBPIXELS - 1)) >> 8, zero);
    box[1] = vd_wide_max_i32((min3(c.y) + (VD_SUBPIXELS - 1)) >> 8, zero);
    box[2] = vd_wide_min_i32((max3(c.x) - 1) >> 8, vd_wide_splat_i32(visible->width - 1));
    box[3] = vd_wide_min_i32((max3(c.y) - 1) >> 8, vd_wide_splat_i32(visible->height - 1));
    vd_wide_i32 area = area_of(&c);
    const vd_wide_mask none =
        vd_wide_or(vd_wide_less_i32(box[2], box[0]), vd_wide_less_i32(box[3], box[1]));
    lanes = vd_wide_and(lanes, vd_wide_and(keep_areas(drawing, area), vd_wide_not(none)));
    const vd_wide_f32 z_max = vd_wide_max_f32(vd_wide_max_f32(c.z[0], c.z[1]), c.z[2]);
    const vd_wide_f32 z_min = vd_wide_min_f32(vd_wide_min_f32(c.z[0], c.z[1]), c.z[2]);
    lanes = vd_wide_and(lanes,
                        vd_wide_not(vd_wide_less_f32(z_max, hidden_behind(visible, sample, box))));
    if (vd_wide_bits(lanes) == 0) {
        return;
    }
    const vd_wide_mask turned = vd_wide_less_i32(area, zero);
    swap_where(turned, &c.x[1], &c.x[2]);
    swap_where(turned, &c.y[1], &c.y[2]);
    swap_where(turned, (vd_wide_i32 *)&c.z[1], (vd_wide_i32 *)&c.z[2]);
    area = vd_wide_blend_i32(turned, zero - area, area);
    vd_wide_i32 edge[3], step_x[3], step_y[3];
    const vd_wide_i32 at_x = box[0] << 8, at_y = box[1] << 8;
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3;
        const vd_wide_i32 dx = c.x[j] - c.x[i], dy = c.y[j] - c.y[i];
        /* Top-left: on the edge is in where dy < 0, or dy = 0 and dx > 0; all else needs 1 more. */
        const vd_wide_mask flat_top =
            vd_wide_and(vd_wide_equal_i32(dy, zero), vd_wide_less_i32(zero, dx));
        const vd_wide_mask owns = vd_wide_or(vd_wide_less_i32(dy, zero), flat_top);
        const vd_wide_i32 bias = vd_wide_blend_i32(owns, zero, vd_wide_splat_i32(-1));
        edge[i] = dx * (at_y - c.y[i]) - dy * (at_x - c.x[i]) + bias;
        step_x[i] = zero - (dy << 8);
        step_y[i] = dx << 8;
    }
    const vd_wide_f32 f = vd_wide_to_f32(area);
    const vd_wide_f32 z1 = c.z[1] - c.z[0], z2 = c.z[2] - c.z[0];
    const vd_wide_f32 x1 = vd_wide_to_f32(c.x[1] - c.x[0]), y1 = vd_wide_to_f32(c.y[1] - c.y[0]);
    const vd_wide_f32 x2 = vd_wide_to_f32(c.x[2] - c.x[0]), y2 = vd_wide_to_f32(c.y[2] - c.y[0]);
    const vd_wide_f32 z[5] = {c.z[0], (z1 * y2 - z2 * y1) / f, (z2 * x1 - z1 * x2) / f, z_min,
                              z_max};
    const vd_wide_i32 from[2] = {at_x - c.x[0], at_y - c.y[0]};
    const vd_wide_i32 limit = vd_wide_splat_i32(NARROW);
    const vd_wide_mask narrow =
        vd_wide_and(lanes, vd_wide_and(vd_wide_less_i32(box[2] - box[0], limit),
                                       vd_wide_less_i32(box[3] - box[1], limit)));
    if (vd_wide_bits(narrow) != 0) {
        fill_narrow(visible, plane, narrow, box, edge, step_x, step_y, from, z, name);
    }
    uint32_t rest = vd_wide_bits(lanes) & ~vd_wide_bits(narrow);
    if (rest == 0) {
        return;
    }
    setups s;
    vd_wide_store_i32(s.x0, box[0]);
    vd_wide_store_i32(s.y0, box[1]);
    vd_wide_store_i32(s.x1, box[2]);
    vd_wide_store_i32(s.y1, box[3]);
    for (int i = 0; i < 3; i++) {
        vd_wide_store_i32(s.edge[i], edge[i]);
        vd_wide_store_i32(s.step_x[i], step_x[i]);
        vd_wide_store_i32(s.step_y[i], step_y[i]);
    }
    vd_wide_store_i32(s.from_x, from[0]);
    vd_wide_store_i32(s.from_y, from[1]);
    vd_wide_store_f32(s.z0, z[0]);
    vd_wide_store_f32(s.dz_dx, z[1]);
    vd_wide_store_f32(s.dz_dy, z[2]);
    vd_wide_store_f32(s.z_min, z[3]);
    vd_wide_store_f32(s.z_max, z[4]);
    vd_wide_store_u32(s.id, (vd_wide_u32)name);
    for (; rest != 0; rest &= rest - 1) {
        fill_rows(visible, plane, &s, __builtin_ctz(rest));
    }
}

/* Fills up to VD_WIDE_LANES triangles. */
static inline void fill_few(vd_visible *visible, const vd_drawing *drawing,
                            const uint32_t *primitives, int count) {
    const vd_wide_mask lanes = vd_wide_less_i32(vd_wide_count_i32(), vd_wide_splat_i32(count));
    uint32_t at[VD_WIDE_LANES];
    int32_t names[VD_WIDE_LANES];
    for (int i = 0; i < VD_WIDE_LANES; i++) {
        const uint32_t p = primitives[i < count ? i : 0];
        names[i] = (int32_t)(drawing->first_id + p);
        at[i] = 3 * p;
    }
    corners c;
    load_corners(drawing, vd_mesh_indices(drawing->mesh), at, &c);
    const vd_wide_i32 name = vd_wide_load_i32(names);
    for (int s = 0; s < visible->samples; s++) {
        int32_t shift_x, shift_y;
        vd_sample_shift(visible->samples, s, &shift_x, &shift_y);
        corners moved = c;
        for (int i = 0; i < 3; i++) {
            moved.x[i] = c.x[i] - (visible->x * VD_SUBPIXELS + shift_x);
            moved.y[i] = c.y[i] - (visible->y * VD_SUBPIXELS + shift_y);
        }
        fill_batch(visible, s, drawing, moved, lanes, name);
    }
}

static void fill_small(vd_visible *visible, const vd_drawing *drawing, const uint32_t *primitives,
                       int count) {
    for (int first = 0; first < count; first += VD_WIDE_LANES) {
        fill_few(visible, drawing, primitives + first, count - first);
    }
}

/* A place in a chain of blocks. */
typedef struct cursor {
    const vd_block *block;
    int first;
} cursor;

static inline bool has_triangles(const cursor *c) {
    return c->block->drawing != NULL;
}

static inline int cursor_count(const cursor *c) {
    const int left = c->block->count - c->first;
    return left < VD_WIDE_LANES ? left : VD_WIDE_LANES;
}

static inline void cursor_move(cursor *c) {
    c->first += VD_WIDE_LANES;
    if (c->first >= c->block->count) {
        *c = (cursor){c->block->next, 0};
    }
}

static inline void prefetch_indices(cursor *c) {
    if (has_triangles(c)) {
        if (c->first == 0) {
            for (size_t at = 0; at < sizeof(vd_block); at += 64) {
                __builtin_prefetch((const char *)c->block->next + at);
            }
        }
        const uint32_t *index = vd_mesh_indices(c->block->drawing->mesh);
        for (int i = 0; i < cursor_count(c); i++) {
            __builtin_prefetch(index + 3 * (size_t)c->block->primitives[c->first + i]);
        }
        cursor_move(c);
    }
}

static inline void prefetch_vertices(cursor *c) {
    if (has_triangles(c)) {
        const vd_drawing *drawing = c->block->drawing;
        const uint32_t *index = vd_mesh_indices(drawing->mesh);
        for (int i = 0; i < cursor_count(c); i++) {
            const uint32_t *corner = index + 3 * (size_t)c->block->primitives[c->first + i];
            __builtin_prefetch(&drawing->vertices[corner[0]]);
            __builtin_prefetch(&drawing->vertices[corner[1]]);
            __builtin_prefetch(&drawing->vertices[corner[2]]);
        }
        cursor_move(c);
    }
}

/* After how many triangles of a picture of several draws it is looked for what they hide. */
#define HIDE_EVERY 256

/* How many triangles ahead of being filled vertices and indices are asked for. */
#define VERTICES_AHEAD (16 / VD_WIDE_LANES)
#define INDICES_AHEAD (32 / VD_WIDE_LANES)

/* A tile's triangles come from all over the mesh: their indices and then their vertices are asked
 * for in time. Without that, waiting for them was more than half of filling the dragon of 871 k
 * triangles at 1024². */
static void fill_blocks(vd_visible *visible, const vd_block *blocks) {
    cursor here = {blocks, 0}, vertices = here, indices = here;
    for (int i = 0; i < VERTICES_AHEAD + INDICES_AHEAD; i++) {
        prefetch_indices(&indices);
    }
    for (int i = 0; i < VERTICES_AHEAD; i++) {
        prefetch_vertices(&vertices);
    }
    while (has_triangles(&here)) {
        prefetch_indices(&indices);
        prefetch_vertices(&vertices);
        if (visible->since >= HIDE_EVERY) {
            find_hidden(visible);
        }
        visible->since += VD_WIDE_LANES;
        fill_few(visible, here.block->drawing, here.block->primitives + here.first,
                 here.block->count - here.first);
        cursor_move(&here);
    }
}

/* ---- any size ---------------------------------------------------------------------------------*/

/* One edge over a strip, in units in which a pixel's step is dx or dy: the sign is what counts, and
 * sample positions are whole pixels apart, so that the part below a pixel may be rounded down. */
typedef struct strip_edge {
    int64_t row; /* at the strip's first sample */
    int64_t dx, dy;
    bool everywhere; /* all samples are inside of it */
} strip_edge;

#define STRIP 64
#define ROW_LIMIT ((int64_t)1 << 30) /* above 63 steps of up to 2^24 */

/* Prepares the edges of a triangle for the samples of a strip. Returns false when one of them has
 * no sample inside. */
static bool strip_edges(const vd_setup *s, int32_t x, int32_t y, int width, int height,
                        strip_edge out[3]) {
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3;
        const int64_t dx = (int64_t)s->x[j] - s->x[i], dy = (int64_t)s->y[j] - s->y[i];
        const int64_t bias = dy < 0 || (dy == 0 && dx > 0) ? 0 : -1;
        const int64_t value = dx * ((int64_t)y - s->y[i]) - dy * ((int64_t)x - s->x[i]) + bias;
        const int64_t row = value >> 8;
        const int64_t across = -dy * (width - 1), down = dx * (height - 1);
        const int64_t least = row + (across < 0 ? across : 0) + (down < 0 ? down : 0);
        const int64_t most = row + (across > 0 ? across : 0) + (down > 0 ? down : 0);
        if (most < 0) {
            return false;
        }
        out[i] = (strip_edge){row, dx, dy, least >= 0};
    }
    return true;
}

/* The samples first … last of `count` from position `at` that lie in a triangle's box; last < first
 * when none. */
static void sample_range(const int32_t v[3], int32_t at, int count, int *first, int *last) {
    int32_t min = v[0], max = v[0];
    for (int i = 1; i < 3; i++) {
        min = v[i] < min ? v[i] : min;
        max = v[i] > max ? v[i] : max;
    }
    const int low = (min - at + VD_SUBPIXELS - 1) >> 8, high = (max - at - 1) >> 8;
    *first = low > 0 ? low : 0;
    *last = high < count - 1 ? high : count - 1;
}

/* A triangle over samples [from, from + STRIP) of all rows of one sample's plane of a window. */
typedef struct strip {
    const vd_setup *setup;
    int32_t x, y;                         /* of the first sample, in subpixels */
    int width;                            /* samples a row */
    int first_row, last_row, first, last; /* the samples in the triangle's box */
    bool all;                             /* every sample is inside */
    strip_edge edges[3];
    vd_wide_f32 across[STRIP / VD_WIDE_LANES];
    vd_wide_i32 slope[3][STRIP / VD_WIDE_LANES];
} strip;

/* Returns false when the triangle has no sample there. */
static inline bool strip_begin(const vd_visible *visible, int sample, const vd_setup *s, int from,
                               strip *out) {
    int32_t shift_x, shift_y;
    vd_sample_shift(visible->samples, sample, &shift_x, &shift_y);
    out->setup = s;
    out->x = (visible->x + from) * VD_SUBPIXELS + shift_x;
    out->y = visible->y * VD_SUBPIXELS + shift_y;
    const int left = visible->width - from;
    out->width = left < STRIP ? left : STRIP;
    if (!strip_edges(s, out->x, out->y, out->width, visible->height, out->edges)) {
        return false;
    }
    out->all = out->edges[0].everywhere && out->edges[1].everywhere && out->edges[2].everywhere;
    for (int k = 0; k < STRIP / VD_WIDE_LANES; k++) {
        const vd_wide_i32 at = vd_wide_count_i32() + k * VD_WIDE_LANES;
        out->across[k] = vd_wide_to_f32((out->x - s->x[0]) + at * VD_SUBPIXELS) * s->dz_dx;
        for (int i = 0; i < 3; i++) {
            out->slope[i][k] = at * (int32_t)-out->edges[i].dy;
        }
    }
    sample_range(s->y, out->y, visible->height, &out->first_row, &out->last_row);
    sample_range(s->x, out->x, out->width, &out->first, &out->last);
    return out->first <= out->last;
}

/* One row of a strip: the edges at its first sample, and what depth gets from its row. */
typedef struct strip_row {
    int32_t start[3];
    vd_wide_f32 down;
} strip_row;

static inline strip_row strip_row_at(const strip *t, int row) {
    strip_row r;
    for (int i = 0; i < 3; i++) {
        int64_t value = t->edges[i].row + row * t->edges[i].dx;
        value = value < ROW_LIMIT ? value : ROW_LIMIT;
        r.start[i] = (int32_t)(value > -ROW_LIMIT ? value : -ROW_LIMIT);
    }
    const float dy = (float)(t->y + row * VD_SUBPIXELS - t->setup->y[0]);
    r.down = vd_wide_splat_f32(dy * t->setup->dz_dy);
    return r;
}

/* Which samples of vector k of the row are inside. */
static inline vd_wide_mask strip_inside(const strip *t, const strip_row *r, int k) {
    const vd_wide_mask exists =
        vd_wide_less_i32(vd_wide_count_i32(), vd_wide_splat_i32(t->width - k * VD_WIDE_LANES));
    if (t->all) {
        return exists;
    }
    const vd_wide_i32 outside = (t->slope[0][k] + r->start[0]) | (t->slope[1][k] + r->start[1]) |
                                (t->slope[2][k] + r->start[2]);
    return vd_wide_and(exists, vd_wide_less_i32(vd_wide_splat_i32(-1), outside));
}

static inline vd_wide_f32 strip_depth(const strip *t, const strip_row *r, int k) {
    return plane_depth(vd_wide_splat_f32(t->setup->z0), t->across[k], r->down,
                       vd_wide_splat_f32(t->setup->z_min), vd_wide_splat_f32(t->setup->z_max));
}

/* Fills samples [from, from + STRIP) of all rows of one sample's plane. */
static void fill_strip(vd_visible *visible, int sample, const vd_setup *s, int from) {
    strip t;
    if (!strip_begin(visible, sample, s, from, &t)) {
        return;
    }
    const vd_wide_i32 name = vd_wide_splat_i32((int32_t)s->id);
    vd_wide_f32 farthest = vd_wide_splat_f32(2.0f);
    for (int row = t.first_row; row <= t.last_row; row++) {
        const strip_row r = strip_row_at(&t, row);
        const size_t at =
            (size_t)sample * visible->plane + (size_t)row * visible->stride + (size_t)from;
        for (int k = t.first / VD_WIDE_LANES; k * VD_WIDE_LANES <= t.last; k++) {
            const vd_wide_mask inside = strip_inside(&t, &r, k);
            if (!t.all && vd_wide_bits(inside) == 0) {
                continue;
            }
            const vd_wide_f32 z = strip_depth(&t, &r, k);
            float *depth = visible->depth + at + k * VD_WIDE_LANES;
            uint32_t *id = visible->id + at + k * VD_WIDE_LANES;
            const vd_wide_f32 now = visible->bare ? fill_row_bare(depth, inside, z)
                                                  : fill_row(depth, id, inside, z, name);
            farthest = vd_wide_min_f32(farthest, vd_wide_blend_f32(inside, now, farthest));
        }
    }
    if (t.all && visible->width <= STRIP) {
        float least[VD_WIDE_LANES];
        vd_wide_store_f32(least, farthest);
        float hidden = least[0];
        for (int i = 1; i < VD_WIDE_LANES; i++) {
            hidden = least[i] < hidden ? least[i] : hidden;
        }
        visible->hidden[sample] = hidden;
    }
}

static void fill_setup(vd_visible *visible, const vd_setup *setup) {
    for (int s = 0; s < visible->samples; s++) {
        if (setup->z_max < visible->hidden[s]) {
            continue;
        }
        for (int from = 0; from < visible->width; from += STRIP) {
            fill_strip(visible, s, setup, from);
        }
    }
}

/* ---- merging ----------------------------------------------------------------------------------*/

static void merge(vd_visible *visible, int sample, const float *depth, const uint32_t *id,
                  size_t stride) {
    const vd_wide_i32 ramp = vd_wide_count_i32();
    for (int y = 0; y < visible->height; y++) {
        const size_t at = (size_t)sample * visible->plane + (size_t)y * visible->stride;
        for (int x = 0; x < visible->width; x += VD_WIDE_LANES) {
            const vd_wide_mask exists =
                vd_wide_less_i32(ramp, vd_wide_splat_i32(visible->width - x));
            const size_t from = (size_t)y * stride + (size_t)x;
            fill_row(visible->depth + at + (size_t)x, visible->id + at + (size_t)x, exists,
                     vd_wide_load_f32(depth + from),
                     vd_wide_load_i32((const int32_t *)(const void *)(id + from)));
        }
    }
}

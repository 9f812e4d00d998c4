/* classic_march_linear.inl: the linear filter in the march; included by classic_march.inl.
 *
 * The way down the pyramid is the same, over maxima that include a cell's right and lower
 * neighbours: lerp(a, b, f) with 0 <= f <= 1 rounds monotonically and is therefore never above the
 * greater of two whole numbers below 2^16, nor, as the definition has it, a float above the
 * greatest of four. At level 0 there is no run of equal slices: each has its own height and colour.
 * So one is evaluated by the picture's own formula, and then as many of the patch between the four
 * samples are passed over as surely stay below the hidden row:
 *
 *     D(t)  height of the hidden row's ray over the surface, t slices after k; falls at most by
 *    ▲      `fall` a slice inside the patch
 *    │·-._
 *  D0│    `·-._        D0 − t·fall > 0   ⟹  not visible
 *    └─────────`·-──► t
 *
 * With u = 2^−24, S = (hidden − horizon)/scale, all exact, slice k is visible only if
 *     h > eye − z·S − z·(4u·|S| + 1.2u·hidden/scale)
 * (row < hidden; three roundings make the product, a fourth the sum). Along the column the surface
 * is φ = a + b·fx + c·fy + g·fx·fy with fx, fy linear in t. So D(t) = eye − z·S − φ is a parabola,
 * and it falls by no more than fall = step·S + max(φ'(0), φ'(T)) a slice, T = end − k. What the
 * picture computes differs from D by
 *     4u·z·|S| + 1.2u·z·hidden/scale   the row, as above
 *     4u·(|eye| + z·|S| + |h|)         D0 itself
 *     2·2u·z·|S|                       slices: z0 + k·step rounds twice, here and there
 *     8u·A                             the lerps, A = |a| + |b| + |c| + |g|
 *     (|b| + |c| + |g|)·(8u·z·(|dx| + |dy|) + 2u·(|ex| + |ey|))   positions, here and there: each
 *                                      is rounded three times, the eye's sum once
 *     16u·(z·|S| + A)                  fall: 8u of each of its parts, times t
 * all at the patch's end, where z is greatest: less than
 *     64u·(|eye| + z·(|S| + hidden/scale) + A) + (|b| + |c| + |g|)·2·(what stands above)
 * which is what is taken off D0. Where D0 is not greater, or anything is no number, slices are
 * taken one by one. test_march.c evaluates every slice that is passed over.
 *
 * A step does this for the lanes at level 0 and the pyramid's test for the others, without a
 * branch. Tried: a loop over a patch's slices inside the step, up to 4 of them for a gather of
 * heights (1920 × 1080, Zen 4: 7.4 ms; 5 of 16 lanes busy in it, and its exit never predicted);
 * pairs by loads of their own, stored with the packet until its second half, instead of a gather
 * instruction (Zen 4: 0.99 at v4, 0.98 at v3).
 */

VD_CLASSIC_INLINE vd_wide_f32 absolute(vd_wide_f32 v) {
    return (vd_wide_f32)((vd_wide_u32)v & 0x7FFFFFFFu);
}

/* Those of bytes stand together. */
VD_CLASSIC_INLINE patch gather_pairs(const vd_march_map *map, vd_wide_mask leaf, vd_wide_i32 column,
                                     vd_wide_i32 row, vd_wide_i32 level) {
    const vd_wide_i32 zero = vd_wide_splat_i32(0);
    const vd_wide_i32 index = vd_wide_lookup_i32(map->pair_offset, level) +
                              row * vd_wide_lookup_i32(map->pair_lead, level) + column +
                              vd_wide_blend_i32(leaf, zero, column);
    const vd_wide_u32 four = vd_wide_gather_pair_u16(map->pairs, index);
    patch p;
    p.h00 = __builtin_convertvector((vd_wide_i32)(four & 255u), vd_wide_f32);
    p.h01 = __builtin_convertvector((vd_wide_i32)(four >> 8 & 255u), vd_wide_f32);
    p.h10 = __builtin_convertvector((vd_wide_i32)(four >> 16 & 255u), vd_wide_f32);
    p.h11 = __builtin_convertvector((vd_wide_i32)(four >> 24), vd_wide_f32);
    return p;
}

/* Above level 0 (not `leaf`) all four are the cell's maximum. */
VD_CLASSIC_INLINE patch gather_patch(const vd_march_map *map, vd_wide_mask leaf, vd_wide_i32 column,
                                     vd_wide_i32 row, vd_wide_i32 level, vd_height_type type) {
    if (type == VD_HEIGHT_U8) {
        return gather_pairs(map, leaf, column, row, level);
    }
    const vd_wide_i32 zero = vd_wide_splat_i32(0), one = vd_wide_splat_i32(1);
    const vd_wide_i32 offset = vd_wide_lookup_i32(map->shared, level);
    const vd_wide_i32 lead = vd_wide_lookup_i32(map->mask_y, level);
    vd_wide_i32 right = column + one, lower = row + one;
    right = vd_wide_blend_i32(vd_wide_equal_i32(right, vd_wide_splat_i32(map->width)), zero, right);
    lower =
        vd_wide_blend_i32(vd_wide_equal_i32(lower, vd_wide_splat_i32(map->height)), zero, lower);
    right = vd_wide_blend_i32(leaf, right, column);
    lower = vd_wide_blend_i32(leaf, lower, row);
    const vd_wide_i32 here_x = offset + column + (column & ~7) * lead;
    const vd_wide_i32 right_x = offset + right + (right & ~7) * lead;
    patch p;
    p.h00 = gather_height(map, here_x + (row << 3), type);
    p.h10 = gather_height(map, right_x + (row << 3), type);
    p.h01 = gather_height(map, here_x + (lower << 3), type);
    p.h11 = gather_height(map, right_x + (lower << 3), type);
    return p;
}

VD_CLASSIC_INLINE vd_wide_f32 highest_of(const patch *p) {
    return vd_wide_max_f32(vd_wide_max_f32(p->h00, p->h10), vd_wide_max_f32(p->h01, p->h11));
}

VD_CLASSIC_INLINE vd_wide_f32 patch_height(const patch *p, vd_wide_f32 across, vd_wide_f32 down,
                                           vd_height_type type) {
    const vd_wide_f32 top = p->h00 + across * (p->h10 - p->h00);
    const vd_wide_f32 bottom = p->h01 + across * (p->h11 - p->h01);
    const vd_wide_f32 height = top + down * (bottom - top);
    if (type != VD_HEIGHT_F32) {
        return height; /* is never above the greatest */
    }
    const vd_wide_f32 highest = highest_of(p);
    return vd_wide_blend_f32(vd_wide_less_f32(highest, height), highest, height);
}

/* ---- what is found --------------------------------------------------------------------------- */

/* Mixes the colours of the list and empties it into the tiles. */
static __attribute__((noinline)) void linear_drain(const vd_march_map *map,
                                                   vd_march_scratch *scratch, size_t count) {
    const float *colors = (const float *)(const void *)map->colors; /* bits, never numbers */
    const vd_wide_i32 stride = vd_wide_splat_i32(map->color_stride);
    const vd_wide_i32 zero = vd_wide_splat_i32(0);
    const vd_wide_i32 width = vd_wide_splat_i32(map->width);
    const vd_wide_i32 height = vd_wide_splat_i32(map->height);
    memset(scratch->from + count, 0, LANES * sizeof *scratch->from);
    for (size_t i = 0; i < count; i += LANES) {
        vd_wide_u32 from, weights;
        memcpy(&from, scratch->from + i, sizeof from);
        memcpy(&weights, scratch->weights + i, sizeof weights);
        const vd_wide_i32 column = (vd_wide_i32)(from & 0xFFFFu), row = (vd_wide_i32)(from >> 16);
        vd_wide_i32 right = column + 1, lower = row + 1;
        right = vd_wide_blend_i32(vd_wide_equal_i32(right, width), zero, right);
        lower = vd_wide_blend_i32(vd_wide_equal_i32(lower, height), zero, lower);
        const vd_wide_i32 up = row * stride, down = lower * stride;
        const vd_wide_u32 c00 = (vd_wide_u32)vd_wide_gather_f32(colors, up + column);
        const vd_wide_u32 c10 = (vd_wide_u32)vd_wide_gather_f32(colors, up + right);
        const vd_wide_u32 c01 = (vd_wide_u32)vd_wide_gather_f32(colors, down + column);
        const vd_wide_u32 c11 = (vd_wide_u32)vd_wide_gather_f32(colors, down + right);
        const vd_wide_u32 across = weights & 0xFFFFu;
        const vd_wide_u32 mixed =
            mix(mix(c00, c10, across), mix(c01, c11, across), weights >> 16) | OPAQUE;
        memcpy(scratch->from + i, &mixed, sizeof mixed);
    }
    uint32_t *tiles = scratch->tiles;
    for (size_t i = 0; i < count; i++) {
        tiles[scratch->at[i]] = (uint32_t)scratch->from[i];
    }
    for (size_t i = 0; i < count && scratch->depths != NULL; i++) {
        scratch->depths[scratch->at[i]] = scratch->depth_of[i];
    }
}

VD_CLASSIC_INLINE void drain_list(const vd_march_map *map, vd_march_scratch *scratch, size_t count,
                                  bool deep, bool linear) {
    if (linear) {
        linear_drain(map, scratch, count);
    } else {
        drain(map, scratch, count, deep);
    }
}

/* Adds the lanes of `seen` to the list; returns its new length. */
VD_CLASSIC_INLINE size_t linear_found(const vd_march_picture *picture, const vd_march_map *map,
                                      vd_march_scratch *scratch, size_t count, vd_wide_mask seen,
                                      vd_wide_i32 first, vd_wide_i32 pixel, vd_wide_i32 column,
                                      vd_wide_i32 row, vd_wide_f32 across, vd_wide_f32 down,
                                      vd_wide_f32 z) {
    if (__builtin_expect(count > VD_MARCH_BATCH - LANES, 0)) {
        linear_drain(map, scratch, count);
        count = 0;
    }
    const vd_wide_u32 at = (vd_wide_u32)pixel + (vd_wide_u32)first * VD_MARCH_TILE;
    const vd_wide_i32 weights = vd_wide_to_i32(across * 256.0f) | vd_wide_to_i32(down * 256.0f)
                                                                      << 16;
    vd_wide_compress_i32(scratch->at + count, seen, (vd_wide_i32)at);
    vd_wide_compress_i32(scratch->from + count, seen, column | row << 16);
    vd_wide_compress_i32(scratch->weights + count, seen, weights);
    if (scratch->depths != NULL) {
        vd_wide_compress_i32((int32_t *)(void *)(scratch->depth_of + count), seen,
                             (vd_wide_i32)(picture->setup->z0 / z));
    }
    return count + (size_t)__builtin_popcount(vd_wide_bits(seen));
}

/* ---- one step -------------------------------------------------------------------------------- */

/* How many slices after `k`, up to `end`, surely stay below the hidden row, where the column is at
 * `across` and `down` in the patch, over which its height is `height`, at slice k. */
VD_CLASSIC_INLINE vd_wide_f32 count_hidden(const vd_march_picture *picture, const packet *p,
                                           const patch *four, vd_wide_f32 k, vd_wide_f32 end,
                                           vd_wide_f32 z, vd_wide_f32 z_end, vd_wide_f32 hidden,
                                           vd_wide_f32 across, vd_wide_f32 down, vd_wide_f32 height,
                                           vd_height_type type) {
    const vd_classic_setup *setup = picture->setup;
    const vd_march_segment *segment = p->segment;
    const vd_wide_f32 zero = vd_wide_splat_f32(0.0f);
    const vd_wide_f32 b = four->h10 - four->h00, c = four->h01 - four->h00;
    const vd_wide_f32 g = (four->h11 - four->h01) - b;
    const vd_wide_f32 slopes = absolute(b) + absolute(c) + absolute(g);
    const vd_wide_f32 slope = (hidden - setup->horizon) * picture->inverse_scale;
    const vd_wide_f32 position =
        z_end * p->unsure + 0x1p-22f * (fabsf(segment->eye_x) + fabsf(segment->eye_y));
    /* A of whole numbers is at most 5 times the greatest. */
    const vd_wide_f32 size =
        type == VD_HEIGHT_F32
            ? fabsf(setup->eye_height) + (absolute(four->h00) + slopes)
            : vd_wide_splat_f32(fabsf(setup->eye_height) + 5.0f * segment->map->highest);
    const vd_wide_f32 row = absolute(slope) + hidden * picture->inverse_scale;
    const vd_wide_f32 error = 0x1p-18f * (size + z_end * row) + slopes * position;
    const vd_wide_f32 over = ((setup->eye_height - z * slope) - height) - error;
    const vd_wide_f32 rising = p->step_x * (b + g * down) + p->step_y * (c + g * across);
    const vd_wide_f32 left = end - k;
    const vd_wide_f32 fall =
        setup->step * slope + rising + vd_wide_max_f32(g * p->bend * left, zero);
    /* Never falling: all that are left. */
    const vd_wide_f32 slices = vd_wide_min_f32(vd_wide_floor_f32(over / fall), left);
    const vd_wide_f32 many = vd_wide_blend_f32(vd_wide_less_f32(zero, fall), slices, left);
    return vd_wide_blend_f32(vd_wide_less_f32(zero, over), many, zero);
}

/* The first half of a step: where the packet is, and the heights there. All packets take it before
 * any takes the second, so that their chains of operations stand side by side. */
VD_CLASSIC_INLINE void linear_look(const vd_march_picture *picture, packet *p, vd_height_type type,
                                   bool power_of_two) {
    const vd_wide_mask leaf = vd_wide_equal_i32(p->level, vd_wide_splat_i32(0));
    p->next = locate(picture, p, power_of_two, false);
    p->four = gather_patch(p->segment->map, leaf, p->next.column, p->next.row, p->level, type);
}

/* Returns whether any lane still sees something in its segment. */
VD_CLASSIC_INLINE bool linear_step(const vd_march_picture *picture, vd_march_scratch *scratch,
                                   size_t *count, packet *p, vd_height_type type) {
    const vd_classic_setup *setup = picture->setup;
    const vd_march_segment *segment = p->segment;
    const vd_march_map *map = segment->map;
    const place here = p->next;
    const patch four = p->four;
    const vd_wide_f32 k = p->k, end = here.end;
    const vd_wide_f32 zero = vd_wide_splat_f32(0.0f), one = vd_wide_splat_f32(1.0f);
    const vd_wide_f32 past = vd_wide_splat_f32(segment->last + 1.0f);
    const vd_wide_mask leaf = vd_wide_equal_i32(p->level, vd_wide_splat_i32(0));

    /* The row of the slice itself, or the highest of anything in the cell: there the four are the
     * one maximum, which is what lies between them. */
    const vd_wide_f32 z = setup->z0 + k * setup->step;
    const vd_wide_f32 z_end = setup->z0 + end * setup->step;
    const vd_wide_f32 x = segment->eye_x + z * p->direction_x;
    const vd_wide_f32 y = segment->eye_y + z * p->direction_y;
    const vd_wide_f32 across = x - vd_wide_floor_f32(x), along = y - vd_wide_floor_f32(y);
    const vd_wide_f32 height = patch_height(&four, across, along, type);
    const vd_wide_f32 below = setup->eye_height - height;
    const vd_wide_mask nearest = leaf | vd_wide_less_f32(below, zero);
    const vd_wide_f32 top =
        below * (setup->scale / vd_wide_blend_f32(nearest, z, z_end)) + setup->horizon;
    const vd_wide_mask visible = vd_wide_less_f32(top, p->hidden) & vd_wide_less_f32(k, past);
    const vd_wide_mask seen = visible & leaf;
    const vd_wide_mask down = visible & vd_wide_not(leaf);
    const vd_wide_i32 first = vd_wide_to_i32(vd_wide_max_f32(top, zero));
    *count = linear_found(picture, map, scratch, *count, seen, first, p->pixel, here.column,
                          here.row, across, along, z);
    const vd_wide_f32 hidden =
        vd_wide_blend_f32(seen, __builtin_convertvector(first, vd_wide_f32), p->hidden);

    const vd_wide_f32 many =
        count_hidden(picture, p, &four, k, end, z, z_end, hidden, across, along, height, type);
    const vd_wide_f32 last = vd_wide_blend_f32(leaf, k + many, end);
    VD_MARCH_SKIPPED(setup, p, vd_wide_blend_f32(seen, k + one, k), last, hidden,
                     vd_wide_bits(vd_wide_not(down)));
    const vd_wide_mask stays = seen | vd_wide_less_f32(last, end);
    const vd_wide_f32 next = vd_wide_blend_f32(vd_wide_less_f32(zero, hidden), last + one, past);
    p->k = vd_wide_blend_f32(down, k, next);
    p->hidden = hidden;
    p->level = vd_wide_min_i32(
        vd_wide_add_where_i32(down,
                              vd_wide_add_where_i32(vd_wide_not(down | stays), p->level, here.up),
                              vd_wide_splat_i32(-1)),
        vd_wide_splat_i32(map->everything));
    return vd_wide_bits(vd_wide_less_f32(p->k, past)) != 0;
}

/* raster_sort.inl: culling and sorting triangles, a vector of them at a time. Part of
 * raster_kernels.inl. */

/* Small triangles on their way into the sorter's window. */
typedef struct queue {
    int count;
    uint32_t primitives[VD_BLOCK_ENTRIES + 2 * VD_WIDE_LANES];
} queue;

static void drain(vd_sorter *sorter, const vd_drawing *drawing, queue *q, bool all) {
    if (q->count >= VD_BLOCK_ENTRIES || (all && q->count > 0)) {
        fill_small(sorter->window, drawing, q->primitives, q->count);
        sorter->drawn += (uint64_t)q->count;
        q->count = 0;
    }
}

/* Boxes of triangles in tiles, by lane. */
typedef struct boxes {
    int32_t x0[VD_WIDE_LANES], y0[VD_WIDE_LANES], x1[VD_WIDE_LANES], y1[VD_WIDE_LANES];
} boxes;

static void add_to_tiles(vd_sorter *sorter, const vd_drawing *drawing, uint32_t first,
                         uint32_t bits, const boxes *b) {
    for (; bits != 0; bits &= bits - 1) {
        const int lane = __builtin_ctz(bits);
        for (int32_t y = b->y0[lane]; y <= b->y1[lane]; y++) {
            for (int32_t x = b->x0[lane]; x <= b->x1[lane]; x++) {
                vd_sorter_add_small(sorter, drawing, first + (uint32_t)lane,
                                    y * sorter->tiles_x + x);
            }
        }
    }
}

/* One tile each: the common case, without loops. */
static void add_to_one(vd_sorter *sorter, const vd_drawing *drawing, uint32_t first, uint32_t bits,
                       vd_wide_i32 tile) {
    int32_t tiles[VD_WIDE_LANES];
    vd_wide_store_i32(tiles, tile);
    vd_block *const *blocks = sorter->blocks;
    for (; bits != 0; bits &= bits - 1) {
        const int lane = __builtin_ctz(bits);
        vd_block *block = blocks[tiles[lane]];
        if (block->count == VD_BLOCK_ENTRIES || block->drawing != drawing) {
            block = vd_sorter_block(sorter, drawing, tiles[lane]);
        }
        block->primitives[block->count++] = first + (uint32_t)lane;
    }
}

static void touch(vd_sorter *sorter, uint32_t bits, const boxes *b) {
    for (; bits != 0; bits &= bits - 1) {
        const int lane = __builtin_ctz(bits);
        for (int32_t y = b->y0[lane]; y <= b->y1[lane]; y++) {
            for (int32_t x = b->x0[lane]; x <= b->x1[lane]; x++) {
                sorter->touched[y * sorter->tiles_x + x] = 1;
            }
        }
    }
}

static void sort_batch(vd_sorter *sorter, const vd_drawing *drawing, uint32_t first, uint32_t lanes,
                       queue *q) {
    corners c;
    load_corners(drawing, vd_mesh_indices(drawing->mesh) + 3 * (size_t)first, &c);
    const vd_wide_i32 x_min = min3(c.x), y_min = min3(c.y), x_max = max3(c.x), y_max = max3(c.y);
    /* Both sides below the limit, and no corner flagged. */
    const vd_wide_u32 side =
        ((vd_wide_u32)x_max - (vd_wide_u32)x_min) | ((vd_wide_u32)y_max - (vd_wide_u32)y_min);
    const vd_wide_u32 limit = (vd_wide_u32)vd_wide_splat_i32(VD_SMALL_SUBPIXELS);
    const vd_wide_mask flagged = vd_wide_less_i32(x_min, vd_wide_splat_i32(VD_FLAGGED));
    const uint32_t small =
        vd_wide_bits(vd_wide_less_u32(side, limit)) & ~vd_wide_bits(flagged) & lanes;
    const int slack = sorter->samples > 1 ? VD_SUBPIXELS / 2 : 0;
    const vd_wide_i32 zero = vd_wide_splat_i32(0);
    const vd_wide_i32 x0 = vd_wide_max_i32((x_min + (VD_SUBPIXELS - 1 - slack)) >> 8, zero);
    const vd_wide_i32 y0 = vd_wide_max_i32((y_min + (VD_SUBPIXELS - 1 - slack)) >> 8, zero);
    const vd_wide_i32 x1 =
        vd_wide_min_i32((x_max + (slack - 1)) >> 8, vd_wide_splat_i32(sorter->width - 1));
    const vd_wide_i32 y1 =
        vd_wide_min_i32((y_max + (slack - 1)) >> 8, vd_wide_splat_i32(sorter->height - 1));
    const vd_wide_mask none = vd_wide_or(vd_wide_less_i32(x1, x0), vd_wide_less_i32(y1, y0));
    uint32_t kept = vd_wide_bits(keep_areas(drawing, area_of(&c))) & ~vd_wide_bits(none) & small;
    for (uint32_t rest = lanes & ~small; rest != 0; rest &= rest - 1) {
        vd_sorter_add_primitive(sorter, drawing, first + (uint32_t)__builtin_ctz(rest));
    }
    if (kept == 0) {
        return;
    }
    const int shift = sorter->tile_shift;
    const vd_wide_i32 tx0 = x0 >> shift, ty0 = y0 >> shift, tx1 = x1 >> shift, ty1 = y1 >> shift;
    boxes b;
    vd_wide_store_i32(b.x0, tx0);
    vd_wide_store_i32(b.y0, ty0);
    vd_wide_store_i32(b.x1, tx1);
    vd_wide_store_i32(b.y1, ty1);
    if (sorter->window != NULL) {
        const vd_wide_i32 pixels = (x1 - x0 + 1) * (y1 - y0 + 1);
        const uint32_t now =
            kept & ~vd_wide_bits(vd_wide_less_i32(vd_wide_splat_i32(sorter->small_pixels), pixels));
        touch(sorter, now, &b);
        for (uint32_t bits = now; bits != 0; bits &= bits - 1) {
            q->primitives[q->count++] = first + (uint32_t)__builtin_ctz(bits);
        }
        drain(sorter, drawing, q, false);
        kept &= ~now;
    }
    sorter->drawn += (uint64_t)__builtin_popcount(kept);
    const uint32_t one =
        vd_wide_bits(vd_wide_and(vd_wide_equal_i32(tx0, tx1), vd_wide_equal_i32(ty0, ty1)));
    add_to_one(sorter, drawing, first, kept & one, ty0 * sorter->tiles_x + tx0);
    add_to_tiles(sorter, drawing, first, kept & ~one, &b);
}

static void sort(vd_sorter *sorter, const vd_drawing *drawing, uint32_t first, uint32_t count) {
    if (drawing->topology != VD_TOPOLOGY_TRIANGLES) {
        for (uint32_t i = first; i < first + count; i++) {
            vd_sorter_add_primitive(sorter, drawing, i);
        }
        return;
    }
    queue q;
    q.count = 0;
    for (uint32_t i = 0; i < count; i += VD_WIDE_LANES) {
        const uint32_t left = count - i;
        /* The indices behind the mesh's last are 0: they name a vertex, if there is any. */
        sort_batch(sorter, drawing, first + i, left < VD_WIDE_LANES ? (1u << left) - 1 : ALL_LANES,
                   &q);
    }
    drain(sorter, drawing, &q, true);
}

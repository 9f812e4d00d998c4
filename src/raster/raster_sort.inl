/* raster_sort.inl: culling and sorting triangles, a vector of them at a time. Part of
 * raster_kernels.inl. */

/* Small triangles of one class on their way into the sorter's window, and the tiles they touch. */
typedef struct queue {
    int count;
    uint32_t primitives[VD_BLOCK_ENTRIES + 2 * VD_WIDE_LANES];
} queue;

typedef struct queues {
    queue of[VD_CLASSES];
    vd_wide_i32 x0, y0, x1, y1; /* by lane, in tiles */
} queues;

static void queues_reset(queues *q) {
    q->x0 = q->y0 = vd_wide_splat_i32(INT32_MAX);
    q->x1 = q->y1 = vd_wide_splat_i32(-1);
}

/* Notes that the window has something in the tiles that the queued triangles touch. */
static void touch(vd_sorter *sorter, const queues *q) {
    int32_t x0[VD_WIDE_LANES], y0[VD_WIDE_LANES], x1[VD_WIDE_LANES], y1[VD_WIDE_LANES];
    vd_wide_store_i32(x0, q->x0);
    vd_wide_store_i32(y0, q->y0);
    vd_wide_store_i32(x1, q->x1);
    vd_wide_store_i32(y1, q->y1);
    for (int i = 1; i < VD_WIDE_LANES; i++) {
        x0[0] = x0[i] < x0[0] ? x0[i] : x0[0];
        y0[0] = y0[i] < y0[0] ? y0[i] : y0[0];
        x1[0] = x1[i] > x1[0] ? x1[i] : x1[0];
        y1[0] = y1[i] > y1[0] ? y1[i] : y1[0];
    }
    for (int32_t y = y0[0]; y <= y1[0]; y++) {
        for (int32_t x = x0[0]; x <= x1[0]; x++) {
            sorter->touched[y * sorter->tiles_x + x] = 1;
        }
    }
}

static void drain(vd_sorter *sorter, const vd_drawing *drawing, queue *q) {
    fill_small(sorter->window, drawing, q->primitives, q->count);
    sorter->drawn += (uint64_t)q->count;
    q->count = 0;
}

/* Boxes of triangles in pixels and tiles, and their classes. */
typedef struct boxes {
    vd_wide_i32 x0, y0, x1, y1;
    vd_wide_i32 tile_x0, tile_y0, tile_x1, tile_y1;
    vd_wide_i32 class;
} boxes;

/* Queues the triangles of the mask whose boxes are small enough; returns those. */
static vd_wide_mask enqueue(vd_sorter *sorter, const vd_drawing *drawing, uint32_t first,
                            vd_wide_mask mask, const boxes *b, queues *q) {
    /* Lanes of large triangles, which are not in the mask, may overflow. */
    const vd_wide_i32 pixels =
        (vd_wide_i32)((vd_wide_u32)(b->x1 - b->x0 + 1) * (vd_wide_u32)(b->y1 - b->y0 + 1));
    const vd_wide_mask now =
        vd_wide_and(mask, vd_wide_less_i32(pixels, vd_wide_splat_i32(sorter->small_pixels + 1)));
    const vd_wide_i32 primitives = vd_wide_count_i32() + (int32_t)first;
    q->x0 = vd_wide_blend_i32(now, vd_wide_min_i32(q->x0, b->tile_x0), q->x0);
    q->y0 = vd_wide_blend_i32(now, vd_wide_min_i32(q->y0, b->tile_y0), q->y0);
    q->x1 = vd_wide_blend_i32(now, vd_wide_max_i32(q->x1, b->tile_x1), q->x1);
    q->y1 = vd_wide_blend_i32(now, vd_wide_max_i32(q->y1, b->tile_y1), q->y1);
    for (int class = 0; class < VD_CLASSES; class ++) {
        queue *one = &q->of[class];
        const vd_wide_mask in =
            vd_wide_and(now, vd_wide_equal_i32(b->class, vd_wide_splat_i32(class)));
        vd_wide_compress_i32((int32_t *)one->primitives + one->count, in, primitives);
        one->count += __builtin_popcount(vd_wide_bits(in));
        if (one->count >= VD_BLOCK_ENTRIES) {
            touch(sorter, q);
            queues_reset(q);
            drain(sorter, drawing, one);
        }
    }
    return now;
}

/* Adds triangles to the lists of the tiles that they touch; most touch one. */
static void add_to_lists(vd_sorter *sorter, const vd_drawing *drawing, uint32_t first,
                         uint32_t bits, const boxes *b) {
    int32_t x0[VD_WIDE_LANES], y0[VD_WIDE_LANES], x1[VD_WIDE_LANES], y1[VD_WIDE_LANES];
    int32_t list[VD_WIDE_LANES], class[VD_WIDE_LANES];
    const vd_wide_mask one = vd_wide_and(vd_wide_equal_i32(b->tile_x0, b->tile_x1),
                                         vd_wide_equal_i32(b->tile_y0, b->tile_y1));
    vd_wide_store_i32(list, (b->tile_y0 * sorter->tiles_x + b->tile_x0) * VD_CLASSES + b->class);
    const uint32_t single = bits & vd_wide_bits(one);
    sorter->drawn += (uint64_t)__builtin_popcount(bits);
    for (uint32_t rest = single; rest != 0; rest &= rest - 1) {
        const int lane = __builtin_ctz(rest);
        vd_block *block = sorter->blocks[list[lane]];
        if (block->count == VD_BLOCK_ENTRIES || block->drawing != drawing) {
            block = vd_sorter_block(sorter, drawing, list[lane]);
        }
        block->primitives[block->count++] = first + (uint32_t)lane;
    }
    bits &= ~single;
    if (bits == 0) {
        return;
    }
    vd_wide_store_i32(x0, b->tile_x0);
    vd_wide_store_i32(y0, b->tile_y0);
    vd_wide_store_i32(x1, b->tile_x1);
    vd_wide_store_i32(y1, b->tile_y1);
    vd_wide_store_i32(class, b->class);
    for (; bits != 0; bits &= bits - 1) {
        const int lane = __builtin_ctz(bits);
        for (int32_t y = y0[lane]; y <= y1[lane]; y++) {
            for (int32_t x = x0[lane]; x <= x1[lane]; x++) {
                vd_sorter_add_small(sorter, drawing, first + (uint32_t)lane,
                                    (y * sorter->tiles_x + x) * VD_CLASSES + class[lane]);
            }
        }
    }
}

static void sort_batch(vd_sorter *sorter, const vd_drawing *drawing, uint32_t first, int left,
                       queues *q) {
    corners c;
    load_corners(drawing, vd_mesh_indices(drawing->mesh) + 3 * (size_t)first, NULL, &c);
    const vd_wide_i32 x_min = min3(c.x), y_min = min3(c.y), x_max = max3(c.x), y_max = max3(c.y);
    const vd_wide_mask exists = vd_wide_less_i32(vd_wide_count_i32(), vd_wide_splat_i32(left));
    /* Both sides below the limit, and no corner flagged. */
    const vd_wide_u32 side =
        ((vd_wide_u32)x_max - (vd_wide_u32)x_min) | ((vd_wide_u32)y_max - (vd_wide_u32)y_min);
    const vd_wide_u32 limit = (vd_wide_u32)vd_wide_splat_i32(VD_SMALL_SUBPIXELS);
    const vd_wide_mask flagged = vd_wide_less_i32(x_min, vd_wide_splat_i32(VD_FLAGGED));
    const vd_wide_mask small =
        vd_wide_and(exists, vd_wide_and(vd_wide_less_u32(side, limit), vd_wide_not(flagged)));
    uint32_t rest = vd_wide_bits(exists) & ~vd_wide_bits(small);
    for (; rest != 0; rest &= rest - 1) {
        vd_sorter_add_primitive(sorter, drawing, first + (uint32_t)__builtin_ctz(rest));
    }
    const int slack = sorter->samples > 1 ? VD_SUBPIXELS / 2 : 0;
    const vd_wide_i32 zero = vd_wide_splat_i32(0);
    boxes b;
    b.x0 = vd_wide_max_i32((x_min + (VD_SUBPIXELS - 1 - slack)) >> 8, zero);
    b.y0 = vd_wide_max_i32((y_min + (VD_SUBPIXELS - 1 - slack)) >> 8, zero);
    b.x1 = vd_wide_min_i32((x_max + (slack - 1)) >> 8, vd_wide_splat_i32(sorter->width - 1));
    b.y1 = vd_wide_min_i32((y_max + (slack - 1)) >> 8, vd_wide_splat_i32(sorter->height - 1));
    const vd_wide_mask none =
        vd_wide_or(vd_wide_less_i32(b.x1, b.x0), vd_wide_less_i32(b.y1, b.y0));
    vd_wide_mask kept =
        vd_wide_and(vd_wide_and(small, keep_areas(drawing, area_of(&c))), vd_wide_not(none));
    if (vd_wide_bits(kept) == 0) {
        return;
    }
    const int shift = sorter->tile_shift;
    b.tile_x0 = b.x0 >> shift;
    b.tile_y0 = b.y0 >> shift;
    b.tile_x1 = b.x1 >> shift;
    b.tile_y1 = b.y1 >> shift;
    const vd_wide_i32 more = vd_wide_max_i32(b.x1 - b.x0, b.y1 - b.y0);
    const vd_wide_i32 one = vd_wide_splat_i32(1);
    b.class = vd_wide_blend_i32(vd_wide_less_i32(one, more), one, zero);
    b.class = vd_wide_blend_i32(vd_wide_less_i32(vd_wide_splat_i32(NARROW - 1), more), one + one,
                                b.class);
    if (sorter->window != NULL) {
        kept = vd_wide_and(kept, vd_wide_not(enqueue(sorter, drawing, first, kept, &b, q)));
    }
    add_to_lists(sorter, drawing, first, vd_wide_bits(kept), &b);
}

static void sort(vd_sorter *sorter, const vd_drawing *drawing, uint32_t first, uint32_t count) {
    if (drawing->topology != VD_TOPOLOGY_TRIANGLES) {
        for (uint32_t i = first; i < first + count; i++) {
            vd_sorter_add_primitive(sorter, drawing, i);
        }
        return;
    }
    queues q;
    queues_reset(&q);
    for (int class = 0; class < VD_CLASSES; class ++) {
        q.of[class].count = 0;
    }
    for (uint32_t i = 0; i < count; i += VD_WIDE_LANES) {
        const uint32_t left = count - i;
        /* The indices behind the mesh's last are 0: they name a vertex, if there is any. */
        sort_batch(sorter, drawing, first + i, left < VD_WIDE_LANES ? (int)left : VD_WIDE_LANES,
                   &q);
    }
    for (int class = 0; class < VD_CLASSES; class ++) {
        if (q.of[class].count > 0) {
            touch(sorter, &q);
            drain(sorter, drawing, &q.of[class]);
        }
    }
    if (sorter->window != NULL) {
        flush(sorter->window);
    }
}

/* raster_alpha.inl: triangles whose alpha matters: tested ones into a window of the visibility
 * buffer, blended ones into a target's list. Part of raster_kernels.inl.
 *
 * Shading is deferred for what is opaque: visibility first, colours once. An alpha-tested fragment
 * breaks that order, since its colour decides whether it is visible at all. The ways out:
 *
 *   - keep all candidates of a sample until one passes: a list without a bound;
 *   - draw, shade, and where the winner fails draw again what was behind: passes without a bound;
 *   - shade before the depth is written. A sample takes the greatest (depth, id) of the fragments
 *     that pass; whether one passes depends on nothing but itself. So that is a maximum still, the
 *     order does not matter, every method and thread count agrees, and nothing is stored.
 *
 * The last is what is done here, after all opaque triangles of a tile are in: what they hide is
 * rejected by depth, sixteen samples at a time, before it costs a shading. What passes is shaded
 * again when it turns out to be visible, so that deferred shading remains the only place that makes
 * colours; the price is about two shadings a visible fragment. Samples are tested one by one at
 * their own places, which is what smooths the outline of a leaf.
 *
 * Both kinds come as vd_setup in lists of their own, in every method: windows of the whole picture
 * are for what is opaque.
 */

/* What is done with sixteen samples of a row of which some are covered. */
typedef struct visitor visitor;
typedef void visit_function(visitor *v, size_t at, int32_t x, int32_t y, uint32_t mask,
                            const float *z);

struct visitor {
    const vd_drawing *drawing;
    const vd_material *material;
    uint32_t id;
    vd_batch *batch;
    vd_visible *visible;
    vd_target *target;
};

static inline void visit_row(visitor *v, const vd_visible *window, const strip *t, int row,
                             size_t at, visit_function *function) {
    const strip_row r = strip_row_at(t, row);
    for (int group = t->first / VD_BATCH; group * VD_BATCH <= t->last; group++) {
        float z[VD_BATCH] __attribute__((aligned(64)));
        uint32_t mask = 0;
        for (int part = 0; part < PARTS; part++) {
            const int k = group * PARTS + part;
            mask |= vd_wide_bits(strip_inside(t, &r, k)) << (part * VD_WIDE_LANES);
            vd_wide_store_f32(z + part * VD_WIDE_LANES, strip_depth(t, &r, k));
        }
        if (mask != 0) {
            function(v, at + (size_t)row * window->stride + (size_t)(group * VD_BATCH),
                     t->x + group * VD_BATCH * VD_SUBPIXELS, t->y + row * VD_SUBPIXELS, mask, z);
        }
    }
}

static inline void visit_all(visitor *v, const vd_visible *window, const vd_setup *setup,
                             visit_function *function) {
    for (int s = 0; s < window->samples; s++) {
        for (int from = 0; from < window->width; from += STRIP) {
            strip t;
            if (!strip_begin(window, s, setup, from, &t)) {
                continue;
            }
            for (int row = t.first_row; row <= t.last_row; row++) {
                visit_row(v, window, &t, row, (size_t)s * window->plane + (size_t)from, function);
            }
        }
    }
}

static visitor visitor_of(const vd_scene *scene, const vd_setup *setup, vd_batch *batch) {
    visitor v = {.drawing = vd_scene_drawing(scene, setup->id), .id = setup->id, .batch = batch};
    v.material = vd_drawing_material(v.drawing, setup->id - v.drawing->first_id);
    return v;
}

/* Shades lanes of one triangle. Returns those whose alpha passes. */
static uint32_t run_lanes(visitor *v, int32_t x, int32_t y, uint32_t mask, const float *z) {
    const vd_wide_i32 primitive = vd_wide_splat_i32((int32_t)(v->id - v->drawing->first_id));
    for (int at = 0; at < VD_BATCH; at += VD_WIDE_LANES) {
        vd_wide_store_i32((int32_t *)(void *)(v->batch->primitive + at), primitive);
        vd_wide_store_f32(v->batch->depth + at, vd_wide_load_f32(z + at));
    }
    fill_lanes(v->drawing, x, y, v->batch);
    run_batch(v->drawing, v->material, mask, v->batch);
    uint32_t fails = 0;
    const vd_wide_f32 least = vd_wide_splat_f32(v->material->alpha_test);
    for (int at = 0; at < VD_BATCH; at += VD_WIDE_LANES) {
        const vd_wide_f32 alpha = vd_wide_load_f32(v->batch->color[3] + at);
        fails |= (vd_wide_bits(vd_wide_less_f32(alpha, least)) & ALL_LANES) << at;
    }
    return mask & ~fails;
}

/* ---- tested -----------------------------------------------------------------------------------*/

static void test_lanes(visitor *v, size_t at, int32_t x, int32_t y, uint32_t mask, const float *z) {
    float *depth = v->visible->depth + at;
    uint32_t *id = v->visible->id + at;
    const vd_wide_u32 name = (vd_wide_u32)vd_wide_splat_i32((int32_t)v->id);
    uint32_t nearer = 0;
    for (int part = 0; part < VD_BATCH; part += VD_WIDE_LANES) {
        const vd_wide_f32 now = vd_wide_load_f32(z + part), old = vd_wide_load_f32(depth + part);
        const vd_wide_mask first = vd_wide_and(vd_wide_equal_f32(now, old),
                                               vd_wide_less_u32(name, vd_wide_load_u32(id + part)));
        nearer |= vd_wide_bits(vd_wide_or(vd_wide_less_f32(old, now), first)) << part;
    }
    mask &= nearer;
    if (mask != 0) {
        mask = run_lanes(v, x, y, mask, z);
    }
    for (; mask != 0; mask &= mask - 1) {
        const int lane = __builtin_ctz(mask);
        depth[lane] = z[lane];
        id[lane] = v->id;
    }
}

static void fill_tested(const vd_scene *scene, vd_visible *visible, const vd_setup *setup,
                        vd_batch *batch) {
    visitor v = visitor_of(scene, setup, batch);
    v.visible = visible;
    visit_all(&v, visible, setup, test_lanes);
}

/* ---- blended ----------------------------------------------------------------------------------*/

static void add_lanes(visitor *v, size_t at, int32_t x, int32_t y, uint32_t mask, const float *z) {
    const float *depth = v->target->depth + at;
    uint16_t packed[VD_BATCH][4];
    for (uint32_t bits = mask; bits != 0; bits &= bits - 1) {
        const int lane = __builtin_ctz(bits);
        mask &= z[lane] >= depth[lane] ? ~0u : ~(1u << lane);
    }
    if (mask == 0) {
        return;
    }
    mask = run_lanes(v, x, y, mask, z);
    pack_16_bits((const float(*)[VD_BATCH])v->batch->color, packed);
    const uint64_t order = vd_blended_order(v->drawing, v->id);
    for (; mask != 0; mask &= mask - 1) {
        const int lane = __builtin_ctz(mask);
        if (packed[lane][3] > 0) {
            vd_target_add_blended(v->target, at + (size_t)lane, z[lane], order, packed[lane]);
        }
    }
}

static void add_blended(const vd_scene *scene, vd_target *target, const vd_setup *setup,
                        vd_batch *batch) {
    const vd_visible window = {.x = target->x,
                               .y = target->y,
                               .width = target->width,
                               .height = target->height,
                               .samples = target->samples,
                               .stride = target->stride,
                               .plane = target->plane};
    visitor v = visitor_of(scene, setup, batch);
    v.target = target;
    if (v.drawing->fragment != NULL) {
        visit_all(&v, &window, setup, add_lanes);
    }
}

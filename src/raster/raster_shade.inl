/* raster_shade.inl: from the visibility buffer to colours, sixteen pixels of a row at a time. Part
 * of raster_kernels.inl.
 *
 * The sixteen may all show different triangles: each lane has corners of its own. One load of a
 * corner's record, or of four of its attributes, is 16 bytes; turning sixteen of them into vectors
 * takes eight shuffles (wide_records.h). Gathering each component instead took 18 gathers for a
 * lit pixel, 3.5 to 8 ns. The arithmetic is raster_interpolate.c's, operation by operation.
 */

#define PARTS (VD_BATCH / VD_WIDE_LANES)

/* Corners of the lanes' triangles as shading wants them. */
typedef struct faces {
    vd_wide_f32 dx, dy; /* of the pixel from corner 0 */
    vd_wide_f32 x1, y1, x2, y2, inverse;
    vd_wide_f32 rw0, rw1, rw2;
} faces;

typedef struct wide_shares {
    vd_wide_f32 c1, c2;
} wide_shares;

static inline vd_wide_f32 clamp_f32(vd_wide_f32 v) {
    const vd_wide_f32 zero = vd_wide_splat_f32(0.0f), one = vd_wide_splat_f32(1.0f);
    return vd_wide_min_f32(vd_wide_max_f32(v, zero), one);
}

static inline wide_shares shares_at(const faces *f, float right, float down, bool inside) {
    const vd_wide_f32 dx = f->dx + right, dy = f->dy + down;
    vd_wide_f32 b1 = (dx * f->y2 - dy * f->x2) * f->inverse;
    vd_wide_f32 b2 = (dy * f->x1 - dx * f->y1) * f->inverse;
    if (inside) {
        b1 = clamp_f32(b1);
        b2 = clamp_f32(b2);
    }
    const vd_wide_f32 w = 1.0f / (f->rw0 + (b1 * (f->rw1 - f->rw0) + b2 * (f->rw2 - f->rw0)));
    return (wide_shares){b1 * f->rw1 * w, b2 * f->rw2 * w};
}

/* Values of one corner of the lanes' triangles; all alike where they are the same triangle. */
static inline void load_corner(const void *base, const uint32_t *index, const uint32_t *at,
                               bool same, vd_wide_i32 out[4]) {
    if (!same) {
        vd_wide_load_records(base, index, at, out);
        return;
    }
    int32_t record[4];
    memcpy(record, (const char *)base + 16 * (size_t)index[at[0]], sizeof record);
    for (int k = 0; k < 4; k++) {
        out[k] = vd_wide_splat_i32(record[k]);
    }
}

/* a − b, without a complaint about what a flagged corner makes of it. */
static inline vd_wide_f32 distance(vd_wide_i32 a, vd_wide_i32 b) {
    return vd_wide_to_f32((vd_wide_i32)((vd_wide_u32)a - (vd_wide_u32)b));
}

/* Loads the corners of one vector of lanes; returns the lanes that have a flagged one. */
static uint32_t load_faces(const vd_drawing *drawing, const uint32_t *at, bool same, vd_wide_i32 x,
                           vd_wide_i32 y, faces *f) {
    const uint32_t *index = vd_mesh_indices(drawing->mesh);
    vd_wide_i32 v[3][4];
    for (int i = 0; i < 3; i++) {
        load_corner(drawing->vertices, index + i, at, same, v[i]);
    }
    const vd_wide_i32 least = vd_wide_min_i32(vd_wide_min_i32(v[0][0], v[1][0]), v[2][0]);
    f->x1 = distance(v[1][0], v[0][0]);
    f->y1 = distance(v[1][1], v[0][1]);
    f->x2 = distance(v[2][0], v[0][0]);
    f->y2 = distance(v[2][1], v[0][1]);
    f->dx = distance(x, v[0][0]);
    f->dy = distance(y, v[0][1]);
    f->inverse = 1.0f / (f->x1 * f->y2 - f->x2 * f->y1);
    f->rw0 = (vd_wide_f32)v[0][3];
    f->rw1 = (vd_wide_f32)v[1][3];
    f->rw2 = (vd_wide_f32)v[2][3];
    return vd_wide_bits(vd_wide_less_i32(least, vd_wide_splat_i32(VD_FLAGGED)));
}

/* Interpolates all varyings of one vector of lanes, `part` of the batch. */
static void fill_part(const vd_drawing *drawing, const uint32_t *at, bool same, const faces *f,
                      int part, vd_batch *batch) {
    const uint32_t *index = vd_mesh_indices(drawing->mesh);
    const bool change = (drawing->inputs & VD_INPUT_DERIVATIVES) != 0;
    const wide_shares s = shares_at(f, 0.0f, 0.0f, true);
    wide_shares right = {s.c1, s.c2}, down = right;
    if (change) {
        const wide_shares here = shares_at(f, 0.0f, 0.0f, false);
        right = shares_at(f, (float)VD_SUBPIXELS, 0.0f, false);
        down = shares_at(f, 0.0f, (float)VD_SUBPIXELS, false);
        right = (wide_shares){right.c1 - here.c1, right.c2 - here.c2};
        down = (wide_shares){down.c1 - here.c1, down.c2 - here.c2};
    }
    const int to = part * VD_WIDE_LANES;
    vd_wide_i32 a[3][4];
    int loaded = -1;
    for (int k = 0; k < drawing->varying_count; k++) {
        const int c = drawing->component[k];
        if (c < 0) {
            vd_wide_store_f32(batch->varyings[k] + to, vd_wide_splat_f32(0.0f));
            vd_wide_store_f32(batch->varyings_dx[k] + to, vd_wide_splat_f32(0.0f));
            vd_wide_store_f32(batch->varyings_dy[k] + to, vd_wide_splat_f32(0.0f));
            continue;
        }
        if (c / 4 != loaded) {
            loaded = c / 4;
            const float *group = drawing->groups + (size_t)loaded * drawing->group_stride;
            for (int i = 0; i < 3; i++) {
                load_corner(group, index + i, at, same, a[i]);
            }
        }
        const vd_wide_f32 a0 = (vd_wide_f32)a[0][c % 4];
        const vd_wide_f32 a1 = (vd_wide_f32)a[1][c % 4] - a0;
        const vd_wide_f32 a2 = (vd_wide_f32)a[2][c % 4] - a0;
        vd_wide_store_f32(batch->varyings[k] + to, a0 + (s.c1 * a1 + s.c2 * a2));
        if (change) {
            vd_wide_store_f32(batch->varyings_dx[k] + to, right.c1 * a1 + right.c2 * a2);
            vd_wide_store_f32(batch->varyings_dy[k] + to, down.c1 * a1 + down.c2 * a2);
        }
    }
}

/* Fills the batch for the primitives of its lanes. (x, y): lane 0's position in subpixels. */
static void fill_lanes(const vd_drawing *drawing, int32_t x, int32_t y, vd_batch *batch) {
    const vd_shader *shader = drawing->shader;
    const vd_wide_i32 ramp = vd_wide_count_i32();
    const bool plain = drawing->topology == VD_TOPOLOGY_TRIANGLES && shader->user_bytes == 0 &&
                       (drawing->inputs & VD_INPUT_FACE_NORMAL) == 0;
    uint32_t by_hand = plain ? 0 : (1u << VD_BATCH) - 1;
    for (int part = 0; part < PARTS; part++) {
        const int at = part * VD_WIDE_LANES;
        const vd_wide_i32 px = x + (ramp + at) * VD_SUBPIXELS;
        vd_wide_store_f32(batch->x + at, vd_wide_to_f32(px) * (1.0f / 256.0f) + 0.5f);
        vd_wide_store_f32(batch->y + at, vd_wide_splat_f32((float)y * (1.0f / 256.0f) + 0.5f));
        if (!plain || drawing->varying_count == 0) {
            continue;
        }
        uint32_t index[VD_WIDE_LANES];
        const vd_wide_i32 primitive =
            vd_wide_load_i32((const int32_t *)(const void *)(batch->primitive + at));
        vd_wide_store_i32((int32_t *)(void *)index, primitive * 3);
        const vd_wide_i32 first = vd_wide_splat_i32((int32_t)batch->primitive[at]);
        const bool same = vd_wide_bits(vd_wide_equal_i32(primitive, first)) == ALL_LANES;
        faces f;
        by_hand |= load_faces(drawing, index, same, px, vd_wide_splat_i32(y), &f) << at;
        fill_part(drawing, index, same, &f, part, batch);
    }
    for (; by_hand != 0; by_hand &= by_hand - 1) {
        const int lane = __builtin_ctz(by_hand);
        vd_interpolate(drawing, batch->primitive[lane], x + lane * VD_SUBPIXELS, y, lane, batch);
    }
}

/* Runs the fragment function, as vd_batch_run. */
static void run_batch(const vd_drawing *drawing, const vd_material *material, uint32_t mask,
                      vd_batch *batch) {
    const unsigned inputs = drawing->inputs;
    const vd_mesh_view *view = &drawing->view;
    for (int at = 0; at < VD_BATCH; at += VD_WIDE_LANES) {
        for (int c = 0; c < 4; c++) {
            vd_wide_store_f32(batch->color[c] + at, vd_wide_splat_f32(c == 3 ? 1.0f : 0.0f));
        }
        vd_wide_f32 w = vd_wide_splat_f32(1.0f);
        if (!(view->far_m > 0.0f)) {
            w = view->near_m / vd_wide_load_f32(batch->depth + at);
        }
        vd_wide_store_f32(batch->w + at, w);
    }
    const bool change = (inputs & VD_INPUT_DERIVATIVES) != 0;
    const bool normal = (inputs & VD_INPUT_FACE_NORMAL) != 0;
    const vd_fragments fragments = {mask,
                                    drawing->draw.uniforms,
                                    view,
                                    drawing->mesh,
                                    material,
                                    (const float(*)[VD_BATCH])batch->varyings,
                                    change ? (const float(*)[VD_BATCH])batch->varyings_dx : NULL,
                                    change ? (const float(*)[VD_BATCH])batch->varyings_dy : NULL,
                                    normal ? (const float(*)[VD_BATCH])batch->normal : NULL,
                                    batch->user,
                                    batch->primitive,
                                    batch->x,
                                    batch->y,
                                    batch->depth,
                                    batch->w,
                                    batch->color};
    if (drawing->fragment != NULL) {
        drawing->fragment(&fragments);
    }
    if (vd_alpha_of_material(drawing, material)) {
        vd_surface_alpha(&fragments, drawing->uv);
    }
    for (int c = 0; c < 4; c++) {
        for (int at = 0; at < VD_BATCH; at += VD_WIDE_LANES) {
            /* max(v, 0) is 0 for what is not a number. */
            vd_wide_store_f32(batch->color[c] + at,
                              clamp_f32(vd_wide_load_f32(batch->color[c] + at)));
        }
    }
}

/* The lanes of `mask` that belong to the drawing and material of its first lane. */
static uint32_t same_surface(const vd_scene *scene, const uint32_t *id, uint32_t mask,
                             const vd_drawing **drawing_out, const vd_material **material_out) {
    const uint32_t first = id[__builtin_ctz(mask)];
    const vd_drawing *drawing = vd_scene_drawing(scene, first);
    const vd_material *material = vd_drawing_material(drawing, first - drawing->first_id);
    *drawing_out = drawing;
    *material_out = material;
    const bool one_part = drawing->draw.materials == NULL || drawing->mesh->part_count == 1;
    if (scene->drawing_count == 1 && one_part) {
        return mask;
    }
    uint32_t same = 0;
    for (uint32_t bits = mask; bits != 0; bits &= bits - 1) {
        const int lane = __builtin_ctz(bits);
        const uint32_t primitive = id[lane] - drawing->first_id;
        if (primitive < drawing->primitive_count &&
            (one_part || vd_drawing_material(drawing, primitive) == material)) {
            same |= 1u << lane;
        }
    }
    return same;
}

/* A vector of lanes of `mask`, `at` … of sixteen. */
static inline vd_wide_mask lanes_of(uint32_t mask, int at) {
    const vd_wide_i32 bit = vd_wide_splat_i32(1) << (vd_wide_count_i32() + at);
    const vd_wide_i32 set = bit & vd_wide_splat_i32((int32_t)mask);
    return vd_wide_not(vd_wide_equal_i32(set, vd_wide_splat_i32(0)));
}

/* Primitives and depths of the lanes of `mask` to the batch; other lanes get the first one's. */
static void spread_lanes(const vd_drawing *drawing, const uint32_t *id, const float *depth,
                         uint32_t mask, vd_batch *batch) {
    const int first = __builtin_ctz(mask);
    const vd_wide_i32 one_id = vd_wide_splat_i32((int32_t)id[first]);
    const vd_wide_f32 one_depth = vd_wide_splat_f32(depth[first]);
    for (int at = 0; at < VD_BATCH; at += VD_WIDE_LANES) {
        const vd_wide_mask lanes = lanes_of(mask, at);
        const vd_wide_i32 ids = vd_wide_blend_i32(
            lanes, vd_wide_load_i32((const int32_t *)(const void *)(id + at)), one_id);
        vd_wide_store_i32((int32_t *)(void *)(batch->primitive + at),
                          ids - (int32_t)drawing->first_id);
        vd_wide_store_f32(batch->depth + at,
                          vd_wide_blend_f32(lanes, vd_wide_load_f32(depth + at), one_depth));
    }
}

/* Shades the lanes of `mask`, at sample positions (x + lane pixels, y) in subpixels, into `out`.
 * What has no fragment function keeps what `out` has. Returns the lanes that were coloured. */
static uint32_t shade_group(const vd_scene *scene, const uint32_t *id, const float *depth,
                            uint32_t mask, int32_t x, int32_t y, vd_batch *batch,
                            float (*out)[VD_BATCH]) {
    uint32_t colored = 0;
    while (mask != 0) {
        const vd_drawing *drawing;
        const vd_material *material;
        const uint32_t part = same_surface(scene, id, mask, &drawing, &material);
        mask &= ~part;
        if (drawing->fragment == NULL) {
            continue;
        }
        spread_lanes(drawing, id, depth, part, batch);
        fill_lanes(drawing, x, y, batch);
        run_batch(drawing, material, part, batch);
        for (int at = 0; vd_material_kind(material) == VD_KIND_TESTED && at < VD_BATCH;
             at += VD_WIDE_LANES) {
            vd_wide_store_f32(batch->color[3] + at, vd_wide_splat_f32(1.0f));
        }
        colored |= part;
        if (colored == part && mask == 0) {
            memcpy(out, batch->color, sizeof batch->color);
            return colored;
        }
        for (uint32_t bits = part; bits != 0; bits &= bits - 1) {
            const int lane = __builtin_ctz(bits);
            for (int c = 0; c < 4; c++) {
                out[c][lane] = batch->color[c][lane];
            }
        }
    }
    return colored;
}

/* Encoded 0 … 1 to 16 bits, premultiplied; [4] vectors of channels for one part of a group. */
static inline void to_16_bits(const float (*color)[VD_BATCH], int at, vd_wide_u32 out[4]) {
    for (int c = 0; c < 4; c++) {
        out[c] = (vd_wide_u32)vd_wide_to_i32(vd_wide_load_f32(color[c] + at) * 65535.0f + 0.5f);
    }
    const vd_wide_i32 full = vd_wide_splat_i32(65535);
    if (vd_wide_bits(vd_wide_equal_i32((vd_wide_i32)out[3], full)) != ALL_LANES) {
        for (int c = 0; c < 3; c++) {
            for (int i = 0; i < VD_WIDE_LANES; i++) {
                out[c][i] = (out[c][i] * out[3][i] + 32767u) / 65535u;
            }
        }
    }
}

static inline vd_wide_u32 to_8_bits(vd_wide_u32 v) {
    return (v * 255u + 32895u) >> 16;
}

/* The frame ids of sixteen ids. */
static void frame_ids(const vd_scene *scene, const uint32_t *id, uint32_t mask, uint32_t *out) {
    const uint32_t only = scene->drawing_count > 0 ? scene->drawings[0].frame_id : 0;
    for (int i = 0; i < VD_BATCH; i++) {
        const bool here = (mask >> i & 1) != 0;
        out[i] = !here                       ? 0
                 : scene->drawing_count == 1 ? only
                                             : vd_scene_drawing(scene, id[i])->frame_id;
    }
}

/* The lanes whose id is not 0, of the first `count`. */
static inline uint32_t hit_lanes(const uint32_t *id, int count) {
    uint32_t mask = 0;
    for (int at = 0; at < VD_BATCH; at += VD_WIDE_LANES) {
        const vd_wide_i32 v = vd_wide_load_i32((const int32_t *)(const void *)(id + at));
        mask |= (~vd_wide_bits(vd_wide_equal_i32(v, vd_wide_splat_i32(0))) & ALL_LANES) << at;
    }
    return count < VD_BATCH ? mask & ((1u << count) - 1) : mask;
}

/* ---- any number of samples, into a target -----------------------------------------------------*/

static void pack_16_bits(const float (*color)[VD_BATCH], uint16_t (*packed)[4]) {
    for (int at = 0; at < VD_BATCH; at += VD_WIDE_LANES) {
        vd_wide_u32 c[4];
        to_16_bits(color, at, c);
        for (int i = 0; i < VD_WIDE_LANES; i++) {
            for (int k = 0; k < 4; k++) {
                packed[at + i][k] = (uint16_t)c[k][i];
            }
        }
    }
}

static void store_target(const float (*color)[VD_BATCH], uint32_t mask, uint16_t *to) {
    uint16_t packed[VD_BATCH][4];
    pack_16_bits(color, packed);
    for (; mask != 0; mask &= mask - 1) {
        const int lane = __builtin_ctz(mask);
        memcpy(to + 4 * lane, packed[lane], sizeof packed[lane]);
    }
}

/* The pixels of sixteen all of whose samples show one primitive, and their samples' mean depths. */
static uint32_t whole_pixels(const vd_visible *visible, size_t at, float *mean) {
    uint32_t whole = 0;
    for (int part = 0; part < VD_BATCH; part += VD_WIDE_LANES) {
        const size_t i = at + (size_t)part;
        const vd_wide_i32 id = vd_wide_load_i32((const int32_t *)(const void *)(visible->id + i));
        vd_wide_f32 sum = vd_wide_load_f32(visible->depth + i);
        uint32_t same = ALL_LANES;
        for (int s = 1; s < visible->samples; s++) {
            const size_t other = (size_t)s * visible->plane + i;
            const vd_wide_i32 v =
                vd_wide_load_i32((const int32_t *)(const void *)(visible->id + other));
            same &= vd_wide_bits(vd_wide_equal_i32(id, v));
            sum = sum + vd_wide_load_f32(visible->depth + other);
        }
        vd_wide_store_f32(mean + part, sum / (float)visible->samples);
        whole |= same << part;
    }
    return whole;
}

/* Depth and frame id of the samples that show something. */
static void store_hits(const vd_scene *scene, const uint32_t *id, const float *depth, uint32_t mask,
                       float *to_depth, uint32_t *to_id) {
    uint32_t names[VD_BATCH];
    frame_ids(scene, id, mask, names);
    for (; mask != 0; mask &= mask - 1) {
        const int lane = __builtin_ctz(mask);
        to_depth[lane] = depth[lane];
        to_id[lane] = names[lane];
    }
}

static uint64_t shade_pixels(const vd_scene *scene, const vd_visible *visible, int x, int y,
                             vd_target *target, vd_batch *batch) {
    float color[4][VD_BATCH] __attribute__((aligned(64))), mean[VD_BATCH];
    const size_t at = (size_t)y * visible->stride + (size_t)x;
    const size_t to = (size_t)y * target->stride + (size_t)x;
    const int left = visible->width - x;
    const int32_t px = (visible->x + x) * VD_SUBPIXELS, py = (visible->y + y) * VD_SUBPIXELS;
    uint32_t whole = whole_pixels(visible, at, mean), colored = 0;
    whole &= hit_lanes(visible->id + at, left);
    if (whole != 0) {
        colored = shade_group(scene, visible->id + at, mean, whole, px, py, batch, color);
    }
    uint64_t hits = 0;
    for (int s = 0; s < visible->samples; s++) {
        const size_t from = (size_t)s * visible->plane + at;
        const size_t out = (size_t)s * target->plane + to;
        const uint32_t mask = hit_lanes(visible->id + from, left);
        hits += (uint64_t)__builtin_popcount(mask);
        if (colored != 0) {
            store_target((const float(*)[VD_BATCH])color, colored, target->color + 4 * out);
        }
        store_hits(scene, visible->id + from, visible->depth + from, mask, target->depth + out,
                   target->id + out);
        if ((mask & ~whole) == 0) {
            continue;
        }
        int32_t shift_x, shift_y;
        vd_sample_shift(visible->samples, s, &shift_x, &shift_y);
        float own[4][VD_BATCH] __attribute__((aligned(64)));
        const uint32_t done = shade_group(scene, visible->id + from, visible->depth + from,
                                          mask & ~whole, px + shift_x, py + shift_y, batch, own);
        store_target((const float(*)[VD_BATCH])own, done, target->color + 4 * out);
    }
    return hits;
}

static uint64_t shade(const vd_scene *scene, const vd_visible *visible, vd_target *target,
                      vd_batch *batch) {
    uint64_t hits = 0;
    for (int y = 0; y < visible->height; y++) {
        for (int x = 0; x < visible->width; x += VD_BATCH) {
            hits += shade_pixels(scene, visible, x, y, target, batch);
        }
    }
    return hits;
}

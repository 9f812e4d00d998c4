/* raster_frame.inl: a window of one sample a pixel straight into a frame. Part of
 * raster_kernels.inl.
 *
 * At 8192² a picture is nothing but memory: rows go out by whole lines, past the caches where the
 * frame is larger than they are. Depth shading, which looks at nothing but the window, has a loop
 * of its own.
 */

static inline void store(void *to, vd_wide_i32 v, bool stream) {
    if (stream) {
        vd_wide_stream_i32(to, v);
    } else {
        memcpy(to, &v, sizeof v);
    }
}

/* Where sixteen pixels of a row go; null: nowhere. */
typedef struct places {
    uint8_t *rgba;
    float *depth;
    uint32_t *id;
} places;

static inline places places_of(const vd_frame *frame, int x, int y) {
    const size_t at = (size_t)y * frame->stride + (size_t)x;
    return (places){frame->rgba + 4 * at, frame->depth == NULL ? NULL : frame->depth + at,
                    frame->id == NULL ? NULL : frame->id + at};
}

static uint32_t background_8(const vd_scene *scene) {
    uint32_t out = 0;
    for (int c = 0; c < 4; c++) {
        out |= (uint32_t)vd_round_16_to_8(scene->background[c]) << (8 * c);
    }
    return out;
}

static void store_background(places to, uint32_t background, bool stream) {
    for (int at = 0; at < VD_BATCH; at += VD_WIDE_LANES) {
        store(to.rgba + 4 * at, vd_wide_splat_i32((int32_t)background), stream);
        if (to.depth != NULL) {
            store(to.depth + at, vd_wide_splat_i32(0), stream);
        }
        if (to.id != NULL) {
            store(to.id + at, vd_wide_splat_i32(0), stream);
        }
    }
}

static void store_group(const vd_scene *scene, const uint32_t *id, const float *depth,
                        uint32_t mask, uint32_t colored, const float (*color)[VD_BATCH],
                        uint32_t background, places to, bool stream) {
    uint32_t names[VD_BATCH] = {0};
    if (to.id != NULL) {
        frame_ids(scene, id, mask, names);
    }
    const vd_wide_i32 none = vd_wide_splat_i32(0);
    for (int at = 0; at < VD_BATCH; at += VD_WIDE_LANES) {
        vd_wide_u32 c[4];
        to_16_bits(color, at, c);
        vd_wide_i32 rgba = (vd_wide_i32)(to_8_bits(c[0]) | to_8_bits(c[1]) << 8 |
                                         to_8_bits(c[2]) << 16 | to_8_bits(c[3]) << 24);
        rgba =
            vd_wide_blend_i32(lanes_of(colored, at), rgba, vd_wide_splat_i32((int32_t)background));
        store(to.rgba + 4 * at, rgba, stream);
        if (to.depth != NULL) {
            const vd_wide_i32 d = (vd_wide_i32)vd_wide_load_f32(depth + at);
            store(to.depth + at, vd_wide_blend_i32(lanes_of(mask, at), d, none), stream);
        }
        if (to.id != NULL) {
            store(to.id + at, (vd_wide_i32)vd_wide_load_u32(names + at), stream);
        }
    }
}

static void fill_frame(const vd_scene *scene, const vd_visible *visible, vd_frame *frame,
                       bool stream) {
    const uint32_t background = background_8(scene);
    for (int y = 0; y < visible->height; y++) {
        for (int x = 0; x < visible->width; x += VD_BATCH) {
            store_background(places_of(frame, visible->x + x, visible->y + y), background, stream);
        }
    }
}

/* Depth shading of a scene of one draw: the window's own depths are all there is to it; what shows
 * something has a depth above 0. */
static uint64_t shade_depths(const vd_scene *scene, const vd_visible *visible, vd_frame *frame,
                             bool stream) {
    const vd_drawing *drawing = &scene->drawings[0];
    const vd_depth_range whole = {1.0f, 0.0f};
    const vd_depth_range *range = drawing->draw.uniforms != NULL ? drawing->draw.uniforms : &whole;
    const float scale = 1.0f / (range->nearest - range->farthest);
    const vd_wide_i32 background = vd_wide_splat_i32((int32_t)background_8(scene));
    const vd_wide_i32 frame_id = vd_wide_splat_i32((int32_t)drawing->frame_id);
    const vd_wide_i32 none = vd_wide_splat_i32(0), ramp = vd_wide_count_i32();
    vd_wide_i32 hits = none;
    for (int y = 0; y < visible->height; y++) {
        const size_t row = (size_t)y * visible->stride;
        const places to = places_of(frame, visible->x, visible->y + y);
        for (int x = 0; x < (visible->width + VD_BATCH - 1) / VD_BATCH * VD_BATCH;
             x += VD_WIDE_LANES) {
            const vd_wide_f32 depth = vd_wide_load_f32(visible->depth + row + x);
            const vd_wide_mask empty =
                vd_wide_or(vd_wide_equal_f32(depth, vd_wide_splat_f32(0.0f)),
                           vd_wide_less_i32(vd_wide_splat_i32(visible->width - 1 - x), ramp));
            const vd_wide_f32 grey = grey_of(depth, range->farthest, scale);
            const vd_wide_u32 v = to_8_bits((vd_wide_u32)vd_wide_to_i32(grey * 65535.0f + 0.5f));
            const vd_wide_i32 rgba = (vd_wide_i32)(v | v << 8 | v << 16 | 0xff000000u);
            store(to.rgba + 4 * x, vd_wide_blend_i32(empty, background, rgba), stream);
            if (to.depth != NULL) {
                store(to.depth + x, vd_wide_blend_i32(empty, none, (vd_wide_i32)depth), stream);
            }
            if (to.id != NULL) {
                store(to.id + x, vd_wide_blend_i32(empty, none, frame_id), stream);
            }
            hits = hits + vd_wide_blend_i32(empty, none, none + 1);
        }
    }
    int32_t sums[VD_WIDE_LANES];
    uint64_t sum = 0;
    vd_wide_store_i32(sums, hits);
    for (int i = 0; i < VD_WIDE_LANES; i++) {
        sum += (uint64_t)sums[i];
    }
    return sum;
}

/* raster_lit.inl: Phong without a texture, straight from the visibility buffer into the frame. Part
 * of raster_kernels.inl.
 *
 * This is what most pictures of models are, and what llvmpipe is good at: it fills triangle by
 * triangle, so that its attributes are plane equations that are set up once. A visibility buffer
 * has to find the triangle of each pixel again, and the general way (raster_shade.inl) puts all of
 * it through memory, in the form that fragment functions see. Here colours stay in registers, and
 * what belongs to a triangle stays in `face_lanes`, one for each column of vectors of the tile,
 * from row to row: of the next row's lanes only those that show another triangle are loaded anew.
 * Up to FEW triangles come one by one, scalar, into the lanes that show them; more, as with pixels
 * no smaller than triangles, all at once. The arithmetic is that of vd_interpolate and shaders.c.
 */

#define FEW 3

/* The triangles of one vector of lanes. */
typedef struct face_lanes {
    vd_wide_i32 id; /* 0: none yet */
    vd_wide_i32 x0, y0;
    vd_wide_f32 x1, y1, x2, y2, inverse;
    vd_wide_f32 rw0, rw1, rw2;
    vd_wide_f32 normal[3], to_1[3], to_2[3]; /* of corner 0, and from there to the others' */
    uint32_t flagged;                        /* lanes with a corner that has no place */
} face_lanes;

/* The surface that is being lit. */
typedef struct lit_surface {
    const vd_drawing *drawing;
    const vd_material *material;
    bool plain; /* can be lit here */
    bool parallel;
    lamps lamps;
} lit_surface;

static void set_surface(const vd_drawing *drawing, const vd_material *material, lit_surface *s) {
    const vd_phong *phong =
        drawing->draw.uniforms != NULL ? drawing->draw.uniforms : &vd_phong_standard;
    s->drawing = drawing;
    s->material = material;
    s->plain = drawing->fragment == fragments_phong && drawing->shader->vertex == NULL &&
               drawing->topology == VD_TOPOLOGY_TRIANGLES && material->texture == NULL &&
               material->alpha == 1.0f;
    if (s->plain) {
        s->parallel = drawing->view.far_m > 0.0f;
        s->lamps = lamps_of(&drawing->view, material, phong);
    }
}

static inline float attribute(const vd_drawing *drawing, int varying, uint32_t vertex) {
    const int c = drawing->component[varying];
    return drawing
        ->groups[(size_t)(c / 4) * drawing->group_stride + 4 * (size_t)vertex + (size_t)(c % 4)];
}

static inline vd_wide_f32 with(vd_wide_mask lanes, float v, vd_wide_f32 old) {
    return vd_wide_blend_f32(lanes, vd_wide_splat_f32(v), old);
}

static inline float apart(int32_t a, int32_t b) {
    return (float)(int32_t)((uint32_t)a - (uint32_t)b);
}

/* Puts one triangle into the lanes of the mask. */
static inline void put_face(const vd_drawing *drawing, int32_t id, vd_wide_mask lanes,
                            face_lanes *f) {
    const uint32_t *index =
        vd_mesh_indices(drawing->mesh) + 3 * (size_t)((uint32_t)id - drawing->first_id);
    const vd_vertex *v0 = &drawing->vertices[index[0]], *v1 = &drawing->vertices[index[1]];
    const vd_vertex *v2 = &drawing->vertices[index[2]];
    const float x1 = apart(v1->x, v0->x), y1 = apart(v1->y, v0->y);
    const float x2 = apart(v2->x, v0->x), y2 = apart(v2->y, v0->y);
    f->id = vd_wide_blend_i32(lanes, vd_wide_splat_i32(id), f->id);
    f->x0 = vd_wide_blend_i32(lanes, vd_wide_splat_i32(v0->x), f->x0);
    f->y0 = vd_wide_blend_i32(lanes, vd_wide_splat_i32(v0->y), f->y0);
    f->x1 = with(lanes, x1, f->x1);
    f->y1 = with(lanes, y1, f->y1);
    f->x2 = with(lanes, x2, f->x2);
    f->y2 = with(lanes, y2, f->y2);
    f->inverse = with(lanes, 1.0f / (x1 * y2 - x2 * y1), f->inverse);
    f->rw0 = with(lanes, v0->rw, f->rw0);
    f->rw1 = with(lanes, v1->rw, f->rw1);
    f->rw2 = with(lanes, v2->rw, f->rw2);
    for (int k = 0; k < 3; k++) {
        const float a = attribute(drawing, k, index[0]);
        f->normal[k] = with(lanes, a, f->normal[k]);
        f->to_1[k] = with(lanes, attribute(drawing, k, index[1]) - a, f->to_1[k]);
        f->to_2[k] = with(lanes, attribute(drawing, k, index[2]) - a, f->to_2[k]);
    }
    const bool flagged = v0->x < VD_FLAGGED || v1->x < VD_FLAGGED || v2->x < VD_FLAGGED;
    f->flagged = (f->flagged & ~vd_wide_bits(lanes)) | (flagged ? vd_wide_bits(lanes) : 0);
}

/* Loads the triangles of all lanes. */
static void load_all_faces(const vd_drawing *drawing, vd_wide_i32 id, face_lanes *f) {
    const uint32_t *index = vd_mesh_indices(drawing->mesh);
    const vd_wide_i32 zero = vd_wide_splat_i32(0);
    uint32_t at[VD_WIDE_LANES];
    faces loaded;
    vd_wide_i32 a[3][4];
    vd_wide_store_i32((int32_t *)(void *)at, (id - (int32_t)drawing->first_id) * 3);
    f->flagged = load_faces(drawing, at, false, zero, zero, &loaded);
    load_corner(drawing->vertices, index, at, false, a[0]);
    f->id = id;
    f->x0 = a[0][0];
    f->y0 = a[0][1];
    f->x1 = loaded.x1;
    f->y1 = loaded.y1;
    f->x2 = loaded.x2;
    f->y2 = loaded.y2;
    f->inverse = loaded.inverse;
    f->rw0 = loaded.rw0;
    f->rw1 = loaded.rw1;
    f->rw2 = loaded.rw2;
    int group = -1;
    for (int k = 0; k < 3; k++) {
        const int c = drawing->component[k];
        for (int i = 0; i < 3 && c / 4 != group; i++) {
            load_corner(drawing->groups + (size_t)(c / 4) * drawing->group_stride, index + i, at,
                        false, a[i]);
        }
        group = c / 4;
        f->normal[k] = (vd_wide_f32)a[0][c % 4];
        f->to_1[k] = (vd_wide_f32)a[1][c % 4] - f->normal[k];
        f->to_2[k] = (vd_wide_f32)a[2][c % 4] - f->normal[k];
    }
}

/* Makes the lanes those of the triangles `id`; where that is 0 they keep some triangle. */
static inline void seek_faces(const vd_drawing *drawing, const uint32_t *id, face_lanes *f) {
    const vd_wide_i32 zero = vd_wide_splat_i32(0);
    vd_wide_i32 wanted = vd_wide_load_i32((const int32_t *)(const void *)id);
    const vd_wide_mask none = vd_wide_equal_i32(wanted, zero);
    wanted = vd_wide_blend_i32(none, f->id, wanted);
    uint32_t changed = ~vd_wide_bits(vd_wide_equal_i32(wanted, f->id)) & ALL_LANES;
    if (changed == 0) {
        return;
    }
    const int32_t first = (int32_t)id[__builtin_ctz(changed)];
    wanted = vd_wide_blend_i32(vd_wide_equal_i32(wanted, zero), vd_wide_splat_i32(first), wanted);
    changed = ~vd_wide_bits(vd_wide_equal_i32(wanted, f->id)) & ALL_LANES;
    int32_t ids[VD_WIDE_LANES];
    vd_wide_store_i32(ids, wanted);
    for (int i = 0; i < FEW && changed != 0; i++) {
        const int32_t one = ids[__builtin_ctz(changed)];
        const vd_wide_mask lanes = vd_wide_equal_i32(wanted, vd_wide_splat_i32(one));
        put_face(drawing, one, lanes, f);
        changed &= ~vd_wide_bits(lanes);
    }
    if (changed != 0) {
        /* What a lane kept may belong to another drawing. */
        load_all_faces(drawing, vd_wide_blend_i32(none, vd_wide_splat_i32(first), wanted), f);
    }
}

/* One vector of pixels, 8 bits a channel. (x, y): the first one's position in subpixels. */
static inline vd_wide_i32 lit_pixels(const lit_surface *s, const face_lanes *f, int32_t x,
                                     int32_t y) {
    const vd_wide_i32 px = x + vd_wide_count_i32() * VD_SUBPIXELS;
    const vd_wide_f32 dx = distance(px, f->x0), dy = distance(vd_wide_splat_i32(y), f->y0);
    vd_wide_f32 c1 = clamp_f32((dx * f->y2 - dy * f->x2) * f->inverse);
    vd_wide_f32 c2 = clamp_f32((dy * f->x1 - dx * f->y1) * f->inverse);
    if (!s->parallel) { /* where it is, all rw are 1 */
        const vd_wide_f32 w = 1.0f / (f->rw0 + (c1 * (f->rw1 - f->rw0) + c2 * (f->rw2 - f->rw0)));
        c1 = c1 * f->rw1 * w;
        c2 = c2 * f->rw2 * w;
    }
    vd_wide_f32 normal[3], albedo[3], color[3];
    for (int k = 0; k < 3; k++) {
        normal[k] = f->normal[k] + (c1 * f->to_1[k] + c2 * f->to_2[k]);
        albedo[k] = vd_wide_splat_f32(s->lamps.albedo[k]);
    }
    const vd_wide_f32 at_x = vd_wide_to_f32(px) * (1.0f / 256.0f) + 0.5f;
    const vd_wide_f32 at_y = vd_wide_splat_f32((float)y * (1.0f / 256.0f) + 0.5f);
    light_lanes(&s->lamps, normal, at_x, at_y, s->parallel, albedo, color);
    vd_wide_u32 rgba = (vd_wide_u32)vd_wide_splat_i32((int32_t)0xff000000u);
    for (int c = 0; c < 3; c++) {
        const vd_wide_f32 v = clamp_f32(color[c]) * 65535.0f + 0.5f;
        rgba |= to_8_bits((vd_wide_u32)vd_wide_to_i32(v)) << (8 * c);
    }
    return (vd_wide_i32)rgba;
}

/* Whether all lanes of the mask show one surface that can be lit here; makes it the current one. */
static inline bool is_lit(const vd_scene *scene, const uint32_t *id, uint32_t mask,
                          lit_surface *s) {
    const vd_drawing *drawing = s->drawing;
    const vd_material *material = s->material;
    if (drawing == NULL || scene->drawing_count > 1 || drawing->mesh->part_count > 1) {
        if (same_surface(scene, id, mask, &drawing, &material) != mask) {
            return false;
        }
        if (drawing != s->drawing || material != s->material) {
            set_surface(drawing, material, s);
        }
    }
    return s->plain;
}

/* Sixteen pixels of a row. Returns false when they have to go the general way. */
static inline bool store_lit(const lit_surface *s, face_lanes *columns, const uint32_t *id,
                             const float *depth, uint32_t mask, int32_t x, int32_t y,
                             uint32_t background, places to, bool stream) {
    for (int part = 0; part < PARTS; part++) {
        const uint32_t here = mask >> (part * VD_WIDE_LANES) & ALL_LANES;
        if (here != 0) {
            seek_faces(s->drawing, id + part * VD_WIDE_LANES, &columns[part]);
        }
        if ((columns[part].flagged & here) != 0) {
            return false;
        }
    }
    const vd_wide_i32 none = vd_wide_splat_i32(0);
    for (int part = 0; part < PARTS; part++) {
        const int at = part * VD_WIDE_LANES;
        const vd_wide_mask lanes = lanes_of(mask, at);
        vd_wide_i32 rgba = vd_wide_splat_i32((int32_t)background);
        if ((mask >> at & ALL_LANES) != 0) {
            rgba = vd_wide_blend_i32(lanes, lit_pixels(s, &columns[part], x + at * VD_SUBPIXELS, y),
                                     rgba);
        }
        store(to.rgba + 4 * at, rgba, stream);
        if (to.depth != NULL) {
            const vd_wide_i32 d = (vd_wide_i32)vd_wide_load_f32(depth + at);
            store(to.depth + at, vd_wide_blend_i32(lanes, d, none), stream);
        }
        if (to.id != NULL) {
            const vd_wide_i32 name = vd_wide_splat_i32((int32_t)s->drawing->frame_id);
            store(to.id + at, vd_wide_blend_i32(lanes, name, none), stream);
        }
    }
    return true;
}

/* ---- all of a window
 * ---------------------------------------------------------------------------*/

static uint64_t shade_frame(const vd_scene *scene, const vd_visible *visible, vd_frame *frame,
                            vd_batch *batch, bool stream) {
    if (scene->drawing_count == 1 && scene->drawings[0].fragment == fragments_depth) {
        return shade_depths(scene, visible, frame, stream);
    }
    face_lanes columns[VD_TILE_MAX / VD_BATCH][PARTS];
    for (int i = 0; i < (visible->width + VD_BATCH - 1) / VD_BATCH; i++) {
        for (int part = 0; part < PARTS; part++) {
            columns[i][part].id = vd_wide_splat_i32(0);
            columns[i][part].flagged = 0;
        }
    }
    lit_surface lit = {.drawing = NULL};
    float color[4][VD_BATCH] __attribute__((aligned(64)));
    const uint32_t background = background_8(scene);
    uint64_t hits = 0;
    for (int y = 0; y < visible->height; y++) {
        for (int x = 0; x < visible->width; x += VD_BATCH) {
            const size_t at = (size_t)y * visible->stride + (size_t)x;
            const uint32_t *id = visible->id + at;
            const float *depth = visible->depth + at;
            const places to = places_of(frame, visible->x + x, visible->y + y);
            const uint32_t mask = hit_lanes(id, visible->width - x);
            if (mask == 0) {
                store_background(to, background, stream);
                continue;
            }
            hits += (uint64_t)__builtin_popcount(mask);
            const int32_t px = (visible->x + x) * VD_SUBPIXELS;
            const int32_t py = (visible->y + y) * VD_SUBPIXELS;
            if (is_lit(scene, id, mask, &lit) && store_lit(&lit, columns[x / VD_BATCH], id, depth,
                                                           mask, px, py, background, to, stream)) {
                continue;
            }
            const uint32_t colored = shade_group(scene, id, depth, mask, px, py, batch, color);
            store_group(scene, id, depth, mask, colored, (const float(*)[VD_BATCH])color,
                        background, to, stream);
        }
    }
    return hits;
}

/* raster_fragments.inl: the fragment functions that are there, a vector at a time. Part of
 * raster_kernels.inl. The arithmetic is that of shaders.c, operation by operation. */

/* By the terrain's polynomial: gathers from a table were half the time of lighting. */
static inline vd_wide_f32 encode_srgb(vd_wide_f32 linear) {
    const vd_wide_f32 v = clamp_f32(linear), s = vd_wide_sqrt_f32(v);
    const vd_wide_mask toe = vd_wide_less_f32(v, vd_wide_splat_f32(VD_SRGB_LINEAR_TOE));
    return vd_wide_blend_f32(toe, v * 12.92f, VD_SRGB_ENCODE(s));
}

static inline void turn(const float m[3][3], const vd_wide_f32 v[3], vd_wide_f32 out[3]) {
    for (int r = 0; r < 3; r++) {
        out[r] = (m[r][0] * v[0] + m[r][1] * v[1]) + m[r][2] * v[2];
    }
}

static inline vd_wide_f32 dot(const vd_wide_f32 a[3], const vd_wide_f32 b[3]) {
    return (a[0] * b[0] + a[1] * b[1]) + a[2] * b[2];
}

/* What lights a surface, the same for all its pixels. */
typedef struct lamps {
    const vd_mesh_view *view;
    int count, exponent;
    float to[4][3]; /* towards each light, in camera space; 0 where there is none */
    float color[4][3], ambient[3], albedo[3], specular[3], emission[3];
} lamps;

static void copy_color(vd_linear from, float to[3]) {
    to[0] = from.r;
    to[1] = from.g;
    to[2] = from.b;
}

static lamps lamps_of(const vd_mesh_view *view, const vd_material *m, const vd_phong *phong) {
    lamps l = {.view = view,
               .count = phong->light_count,
               .exponent = m->shininess > 1.0f ? (int)m->shininess : 1};
    for (int i = 0; i < l.count && i < 4; i++) {
        const float *d = phong->lights[i].direction;
        const float(*world)[3] = view->camera_from_world;
        for (int r = 0; r < 3; r++) {
            l.to[i][r] = (world[r][0] * d[0] + world[r][1] * d[1]) + world[r][2] * d[2];
        }
        copy_color(phong->lights[i].color, l.color[i]);
    }
    copy_color(phong->ambient, l.ambient);
    copy_color(m->albedo, l.albedo);
    copy_color(m->specular, l.specular);
    copy_color(m->emission, l.emission);
    return l;
}

/* Unit normals in camera space, turned towards the viewer, and, in perspective, unit vectors to the
 * viewer; in parallel projection that is (0, 0, −1). (x, y): pixel positions. */
static inline void orient(const lamps *l, const vd_wide_f32 normal[3], vd_wide_f32 x, vd_wide_f32 y,
                          bool parallel, vd_wide_f32 n[3], vd_wide_f32 eye[3]) {
    const vd_mesh_view *v = l->view;
    const vd_wide_f32 zero = vd_wide_splat_f32(0.0f), one = vd_wide_splat_f32(1.0f);
    turn(v->camera_from_normal, normal, n);
    vd_wide_f32 facing = -n[2];
    if (!parallel) {
        eye[0] = (v->lens[2] - x) / v->lens[0];
        eye[1] = (v->lens[3] - y) / v->lens[1];
        const vd_wide_f32 far = vd_wide_sqrt_f32((eye[0] * eye[0] + eye[1] * eye[1]) + 1.0f);
        eye[0] = eye[0] / far;
        eye[1] = eye[1] / far;
        eye[2] = -1.0f / far;
        facing = dot(n, eye);
    }
    const vd_wide_f32 length = vd_wide_sqrt_f32(dot(n, n));
    const vd_wide_f32 sign =
        vd_wide_blend_f32(vd_wide_less_f32(facing, zero), vd_wide_splat_f32(-1.0f), one);
    const vd_wide_f32 scale = sign / vd_wide_blend_f32(vd_wide_less_f32(zero, length), length, one);
    for (int r = 0; r < 3; r++) {
        n[r] = n[r] * scale;
    }
}

/* Adds light `i` to `sum`. */
static inline void add_light(const lamps *l, int i, const vd_wide_f32 n[3],
                             const vd_wide_f32 eye[3], bool parallel, const vd_wide_f32 albedo[3],
                             vd_wide_f32 sum[3]) {
    const float *to = l->to[i];
    const vd_wide_f32 zero = vd_wide_splat_f32(0.0f), one = vd_wide_splat_f32(1.0f);
    const vd_wide_f32 cosine = (n[0] * to[0] + n[1] * to[1]) + n[2] * to[2];
    const vd_wide_mask faces_it = vd_wide_less_f32(zero, cosine);
    if (vd_wide_bits(faces_it) == 0) {
        return;
    }
    /* The mirrored light 2(n·l)n − l, seen by the eye. */
    vd_wide_f32 mirrored = to[2] - 2.0f * cosine * n[2];
    if (!parallel) {
        mirrored = zero;
        for (int r = 0; r < 3; r++) {
            mirrored = mirrored + (2.0f * cosine * n[r] - to[r]) * eye[r];
        }
    }
    vd_wide_f32 base = mirrored, highlight = one;
    for (int exponent = l->exponent; exponent > 0; exponent /= 2) {
        highlight = exponent % 2 != 0 ? highlight * base : highlight;
        base = base * base;
    }
    highlight = vd_wide_blend_f32(vd_wide_less_f32(zero, mirrored), highlight, zero);
    for (int c = 0; c < 3; c++) {
        const vd_wide_f32 more =
            sum[c] + l->color[i][c] * (albedo[c] * cosine + l->specular[c] * highlight);
        sum[c] = vd_wide_blend_f32(faces_it, more, sum[c]);
    }
}

/* One vector of lit colours, encoded. */
static inline void light_lanes(const lamps *l, const vd_wide_f32 normal[3], vd_wide_f32 x,
                               vd_wide_f32 y, bool parallel, const vd_wide_f32 albedo[3],
                               vd_wide_f32 out[3]) {
    vd_wide_f32 n[3], eye[3], sum[3];
    for (int c = 0; c < 3; c++) {
        sum[c] = l->emission[c] + albedo[c] * l->ambient[c];
    }
    orient(l, normal, x, y, parallel, n, eye);
    for (int i = 0; i < l->count; i++) {
        add_light(l, i, n, eye, parallel, albedo, sum);
    }
    for (int c = 0; c < 3; c++) {
        out[c] = encode_srgb(sum[c]);
    }
}

static void light(const vd_fragments *f, const float (*normal)[VD_BATCH], int uv) {
    const vd_phong *phong = f->uniforms != NULL ? f->uniforms : &vd_phong_standard;
    const vd_material *m = f->material;
    const lamps l = lamps_of(f->view, m, phong);
    float textured[3][VD_BATCH] __attribute__((aligned(64)));
    if (m->texture != NULL) {
        vd_surface_albedo(f, uv, textured);
    }
    for (int at = 0; at < VD_BATCH; at += VD_WIDE_LANES) {
        vd_wide_f32 n[3], albedo[3], color[3];
        for (int c = 0; c < 3; c++) {
            albedo[c] = m->texture != NULL ? vd_wide_load_f32(textured[c] + at)
                                           : vd_wide_splat_f32(l.albedo[c]);
            n[c] = vd_wide_load_f32(normal[c] + at);
        }
        if (m->texture == NULL) {
            vd_wide_store_f32(f->color[3] + at, vd_wide_splat_f32(m->alpha));
        }
        const vd_wide_f32 x = vd_wide_load_f32(f->x + at), y = vd_wide_load_f32(f->y + at);
        light_lanes(&l, n, x, y, f->view->far_m > 0.0f, albedo, color);
        for (int c = 0; c < 3; c++) {
            vd_wide_store_f32(f->color[c] + at, color[c]);
        }
    }
}

static void fragments_phong(const vd_fragments *f) {
    light(f, f->varyings, 3);
}

static void fragments_flat(const vd_fragments *f) {
    light(f, f->normal, 0);
}

static inline vd_wide_f32 grey_of(vd_wide_f32 depth, float farthest, float scale) {
    const vd_wide_f32 t = clamp_f32((depth - farthest) * scale);
    return t * t * t;
}

static void fragments_depth(const vd_fragments *f) {
    const vd_depth_range whole = {1.0f, 0.0f};
    const vd_depth_range *range = f->uniforms != NULL ? f->uniforms : &whole;
    const float scale = 1.0f / (range->nearest - range->farthest);
    for (int at = 0; at < VD_BATCH; at += VD_WIDE_LANES) {
        const vd_wide_f32 grey = grey_of(vd_wide_load_f32(f->depth + at), range->farthest, scale);
        for (int c = 0; c < 3; c++) {
            vd_wide_store_f32(f->color[c] + at, grey);
        }
    }
}

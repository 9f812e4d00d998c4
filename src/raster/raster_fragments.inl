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

/* Unit normals in camera space, turned towards the viewer, and unit vectors to the viewer. */
static void orient(const vd_fragments *f, const float (*normal)[VD_BATCH], int at, vd_wide_f32 n[3],
                   vd_wide_f32 eye[3]) {
    const vd_mesh_view *v = f->view;
    const vd_wide_f32 zero = vd_wide_splat_f32(0.0f), one = vd_wide_splat_f32(1.0f);
    const vd_wide_f32 in[3] = {vd_wide_load_f32(normal[0] + at), vd_wide_load_f32(normal[1] + at),
                               vd_wide_load_f32(normal[2] + at)};
    turn(v->camera_from_normal, in, n);
    eye[0] = eye[1] = zero;
    eye[2] = vd_wide_splat_f32(-1.0f);
    if (!(v->far_m > 0.0f)) {
        eye[0] = (v->lens[2] - vd_wide_load_f32(f->x + at)) / v->lens[0];
        eye[1] = (v->lens[3] - vd_wide_load_f32(f->y + at)) / v->lens[1];
        const vd_wide_f32 far = vd_wide_sqrt_f32((eye[0] * eye[0] + eye[1] * eye[1]) + 1.0f);
        eye[0] = eye[0] / far;
        eye[1] = eye[1] / far;
        eye[2] = -1.0f / far;
    }
    const vd_wide_f32 length = vd_wide_sqrt_f32(dot(n, n));
    const vd_wide_f32 sign =
        vd_wide_blend_f32(vd_wide_less_f32(dot(n, eye), zero), vd_wide_splat_f32(-1.0f), one);
    const vd_wide_f32 scale = sign / vd_wide_blend_f32(vd_wide_less_f32(zero, length), length, one);
    for (int r = 0; r < 3; r++) {
        n[r] = n[r] * scale;
    }
}

static inline vd_wide_f32 power(vd_wide_f32 base, int exponent) {
    vd_wide_f32 result = vd_wide_splat_f32(1.0f);
    for (; exponent > 0; exponent /= 2) {
        result = exponent % 2 != 0 ? result * base : result;
        base = base * base;
    }
    return result;
}

/* Adds one light to `sum`. */
static void add_light(const vd_fragments *f, const vd_phong_light *light, const vd_wide_f32 n[3],
                      const vd_wide_f32 eye[3], const vd_wide_f32 albedo[3], vd_wide_f32 sum[3]) {
    const vd_material *m = f->material;
    const float specular[3] = {m->specular.r, m->specular.g, m->specular.b};
    const float lit[3] = {light->color.r, light->color.g, light->color.b};
    const int exponent = m->shininess > 1.0f ? (int)m->shininess : 1;
    const float(*world)[3] = f->view->camera_from_world;
    const vd_wide_f32 zero = vd_wide_splat_f32(0.0f);
    float to[3];
    for (int r = 0; r < 3; r++) {
        const float *d = light->direction;
        to[r] = (world[r][0] * d[0] + world[r][1] * d[1]) + world[r][2] * d[2];
    }
    const vd_wide_f32 cosine = (n[0] * to[0] + n[1] * to[1]) + n[2] * to[2];
    const vd_wide_mask faces_it = vd_wide_less_f32(zero, cosine);
    if (vd_wide_bits(faces_it) == 0) {
        return;
    }
    vd_wide_f32 mirrored = zero;
    for (int r = 0; r < 3; r++) {
        mirrored = mirrored + (2.0f * cosine * n[r] - to[r]) * eye[r];
    }
    const vd_wide_f32 highlight =
        vd_wide_blend_f32(vd_wide_less_f32(zero, mirrored), power(mirrored, exponent), zero);
    for (int c = 0; c < 3; c++) {
        const vd_wide_f32 more = sum[c] + lit[c] * (albedo[c] * cosine + specular[c] * highlight);
        sum[c] = vd_wide_blend_f32(faces_it, more, sum[c]);
    }
}

static void light(const vd_fragments *f, const float (*normal)[VD_BATCH], int uv) {
    const vd_phong *phong = f->uniforms != NULL ? f->uniforms : &vd_phong_standard;
    const vd_material *m = f->material;
    const float base[3] = {m->albedo.r, m->albedo.g, m->albedo.b};
    const float emission[3] = {m->emission.r, m->emission.g, m->emission.b};
    const float ambient[3] = {phong->ambient.r, phong->ambient.g, phong->ambient.b};
    float textured[3][VD_BATCH] __attribute__((aligned(64)));
    if (m->texture != NULL) {
        vd_surface_albedo(f, uv, textured);
    }
    for (int at = 0; at < VD_BATCH; at += VD_WIDE_LANES) {
        vd_wide_f32 n[3], eye[3], albedo[3], sum[3];
        for (int c = 0; c < 3; c++) {
            albedo[c] = m->texture != NULL ? vd_wide_load_f32(textured[c] + at)
                                           : vd_wide_splat_f32(base[c]);
            sum[c] = emission[c] + albedo[c] * ambient[c];
        }
        if (m->texture == NULL) {
            vd_wide_store_f32(f->color[3] + at, vd_wide_splat_f32(m->alpha));
        }
        orient(f, normal, at, n, eye);
        for (int l = 0; l < phong->light_count; l++) {
            add_light(f, &phong->lights[l], n, eye, albedo, sum);
        }
        for (int c = 0; c < 3; c++) {
            vd_wide_store_f32(f->color[c] + at, encode_srgb(sum[c]));
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

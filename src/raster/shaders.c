/* shaders.c: the fragment functions that are there. */
#include <string.h>
#include "raster/shader_math.h"

/* ---- colour -----------------------------------------------------------------------------------*/

/* Linear light of an encoded value 0 … 1, straight between the 256 exact ones. */
static float decode(float encoded) {
    const float at = encoded * 255.0f;
    const int low = (int)at < 254 ? (int)at : 254;
    const float a = vd_srgb_decode((uint8_t)low), b = vd_srgb_decode((uint8_t)(low + 1));
    return a + (at - (float)low) * (b - a);
}

/* The material's albedo under its texture, linear, and alpha into color[3]. `uv` is the first of
 * the texture coordinates among the varyings. */
void vd_surface_albedo(const vd_fragments *f, int uv, float (*albedo)[VD_BATCH]) {
    const vd_material *m = f->material;
    const float base[3] = {m->albedo.r, m->albedo.g, m->albedo.b};
    vd_shader_lanes texel[4];
    if (m->texture != NULL) {
        vd_texture_sample(m->texture, m->filter, f->varyings + uv,
                          f->varyings_dx == NULL ? NULL : f->varyings_dx + uv,
                          f->varyings_dy == NULL ? NULL : f->varyings_dy + uv, texel);
    }
    VD_EACH_LANE(i) {
        for (int c = 0; c < 3; c++) {
            albedo[c][i] = m->texture != NULL ? base[c] * decode(texel[c][i]) : base[c];
        }
        f->color[3][i] = m->texture != NULL ? m->alpha * texel[3][i] : m->alpha;
    }
}

void vd_surface_alpha(const vd_fragments *f, int uv) {
    vd_shader_lanes albedo[3];
    if (uv >= 0) {
        vd_surface_albedo(f, uv, albedo);
        return;
    }
    VD_EACH_LANE(i) {
        f->color[3][i] = f->material->alpha;
    }
}

/* ---- light ------------------------------------------------------------------------------------*/

const vd_phong vd_phong_standard = {
    .ambient = {0.12f, 0.13f, 0.15f},
    .lights = {{{-0.48f, -0.64f, 0.6f}, {0.85f, 0.83f, 0.8f}},
               {{0.8f, -0.6f, 0.0f}, {0.15f, 0.17f, 0.2f}}},
    .light_count = 2,
};

vd_phong vd_phong_default(void) {
    return vd_phong_standard;
}

static void turn(const float m[3][3], const float v[3], float out[3]) {
    for (int r = 0; r < 3; r++) {
        out[r] = (m[r][0] * v[0] + m[r][1] * v[1]) + m[r][2] * v[2];
    }
}

/* Unit normals in camera space, turned towards the viewer, and unit vectors to the viewer. */
static void orient(const vd_fragments *f, const float (*normal)[VD_BATCH], vd_shader_lanes n[3],
                   vd_shader_lanes to_eye[3]) {
    const vd_mesh_view *v = f->view;
    VD_EACH_LANE(i) {
        const float in[3] = {normal[0][i], normal[1][i], normal[2][i]};
        float out[3], eye[3] = {0.0f, 0.0f, -1.0f};
        turn(v->camera_from_normal, in, out);
        if (!(v->far_m > 0.0f)) {
            eye[0] = (v->lens[2] - f->x[i]) / v->lens[0];
            eye[1] = (v->lens[3] - f->y[i]) / v->lens[1];
            const float far = sqrtf((eye[0] * eye[0] + eye[1] * eye[1]) + 1.0f);
            eye[0] = eye[0] / far;
            eye[1] = eye[1] / far;
            eye[2] = -1.0f / far;
        }
        const float length = sqrtf((out[0] * out[0] + out[1] * out[1]) + out[2] * out[2]);
        const float facing =
            v->far_m > 0.0f ? -out[2] : (out[0] * eye[0] + out[1] * eye[1]) + out[2] * eye[2];
        const float scale = (facing < 0.0f ? -1.0f : 1.0f) / (length > 0.0f ? length : 1.0f);
        for (int r = 0; r < 3; r++) {
            n[r][i] = out[r] * scale;
            to_eye[r][i] = eye[r];
        }
    }
}

static void light(const vd_fragments *f, const float (*normal)[VD_BATCH], int uv) {
    const vd_phong *phong = f->uniforms != NULL ? f->uniforms : &vd_phong_standard;
    const vd_material *m = f->material;
    const float specular[3] = {m->specular.r, m->specular.g, m->specular.b};
    const float emission[3] = {m->emission.r, m->emission.g, m->emission.b};
    const float ambient[3] = {phong->ambient.r, phong->ambient.g, phong->ambient.b};
    const int exponent = m->shininess > 1.0f ? (int)m->shininess : 1;
    const bool parallel = f->view->far_m > 0.0f;
    vd_shader_lanes albedo[3], n[3], eye[3];
    vd_surface_albedo(f, uv, albedo);
    orient(f, normal, n, eye);
    VD_EACH_LANE(i) {
        float sum[3];
        for (int c = 0; c < 3; c++) {
            sum[c] = emission[c] + albedo[c][i] * ambient[c];
        }
        for (int l = 0; l < phong->light_count; l++) {
            float to[3];
            turn(f->view->camera_from_world, phong->lights[l].direction, to);
            const float cosine = (n[0][i] * to[0] + n[1][i] * to[1]) + n[2][i] * to[2];
            if (!(cosine > 0.0f)) {
                continue;
            }
            /* The mirrored light 2(n·l)n − l, seen by the eye. */
            float mirrored = 0.0f;
            for (int r = 0; r < 3; r++) {
                mirrored = mirrored + (2.0f * cosine * n[r][i] - to[r]) * eye[r][i];
            }
            mirrored = parallel ? to[2] - 2.0f * cosine * n[2][i] : mirrored;
            const float highlight = mirrored > 0.0f ? vd_shader_power(mirrored, exponent) : 0.0f;
            const vd_linear color = phong->lights[l].color;
            const float lit[3] = {color.r, color.g, color.b};
            for (int c = 0; c < 3; c++) {
                sum[c] = sum[c] + lit[c] * (albedo[c][i] * cosine + specular[c] * highlight);
            }
        }
        for (int c = 0; c < 3; c++) {
            f->color[c][i] = vd_shader_encode(sum[c]);
        }
    }
}

static void shade_phong(const vd_fragments *f) {
    light(f, f->varyings, 3);
}

static void shade_flat(const vd_fragments *f) {
    light(f, f->normal, 0);
}

/* ---- the others -------------------------------------------------------------------------------*/

static void shade_depth(const vd_fragments *f) {
    const vd_depth_range whole = {1.0f, 0.0f};
    const vd_depth_range *range = f->uniforms != NULL ? f->uniforms : &whole;
    const float scale = 1.0f / (range->nearest - range->farthest);
    VD_EACH_LANE(i) {
        const float t = vd_shader_clamp((f->depth[i] - range->farthest) * scale);
        f->color[0][i] = f->color[1][i] = f->color[2][i] = t * t * t;
    }
}

static void shade_normals(const vd_fragments *f) {
    VD_EACH_LANE(i) {
        const float in[3] = {f->varyings[0][i], f->varyings[1][i], f->varyings[2][i]};
        float n[3];
        turn(f->view->camera_from_normal, in, n);
        const float length = sqrtf((n[0] * n[0] + n[1] * n[1]) + n[2] * n[2]);
        const float half = length > 0.0f ? 0.5f / length : 0.0f;
        f->color[0][i] = 0.5f + n[0] * half;
        f->color[1][i] = 0.5f - n[1] * half;
        f->color[2][i] = 0.5f - n[2] * half;
    }
}

static void shade_uv(const vd_fragments *f) {
    VD_EACH_LANE(i) {
        f->color[0][i] = f->varyings[0][i] - floorf(f->varyings[0][i]);
        f->color[1][i] = f->varyings[1][i] - floorf(f->varyings[1][i]);
        f->color[2][i] = 0.0f;
    }
}

static void shade_id(const vd_fragments *f) {
    VD_EACH_LANE(i) {
        uint32_t h = (f->primitive[i] + 1) * 0x9E3779B1u; /* neighbours far apart */
        h ^= h >> 15;
        h *= 0x85EBCA77u;
        h ^= h >> 13;
        for (int c = 0; c < 3; c++) {
            f->color[c][i] = 0.25f + (float)(h >> (8 * c) & 255) * (0.75f / 255.0f);
        }
    }
}

static void shade_albedo(const vd_fragments *f) {
    vd_shader_lanes albedo[3];
    vd_surface_albedo(f, 0, albedo);
    VD_EACH_LANE(i) {
        for (int c = 0; c < 3; c++) {
            f->color[c][i] = vd_shader_encode(albedo[c][i]);
        }
    }
}

static const struct {
    const char *name;
    vd_shader shader;
} shadings[VD_SHADING_COUNT] = {
    [VD_SHADING_PHONG] = {"phong",
                          {.fragment = shade_phong,
                           .inputs = VD_INPUT_NORMAL | VD_INPUT_UV | VD_INPUT_DERIVATIVES}},
    [VD_SHADING_FLAT] = {"flat",
                         {.fragment = shade_flat,
                          .inputs = VD_INPUT_UV | VD_INPUT_DERIVATIVES | VD_INPUT_FACE_NORMAL}},
    [VD_SHADING_DEPTH] = {"depth", {.fragment = shade_depth}},
    [VD_SHADING_NORMALS] = {"normals", {.fragment = shade_normals, .inputs = VD_INPUT_NORMAL}},
    [VD_SHADING_UV] = {"uv", {.fragment = shade_uv, .inputs = VD_INPUT_UV}},
    [VD_SHADING_ID] = {"id", {.fragment = shade_id}},
    [VD_SHADING_ALBEDO] = {"albedo",
                           {.fragment = shade_albedo,
                            .inputs = VD_INPUT_UV | VD_INPUT_DERIVATIVES}},
};

const vd_shader *vd_shader_find(vd_shading shading) {
    return shading >= 0 && shading < VD_SHADING_COUNT ? &shadings[shading].shader : NULL;
}

const char *vd_shading_name(vd_shading shading) {
    return shading >= 0 && shading < VD_SHADING_COUNT ? shadings[shading].name : "unknown";
}

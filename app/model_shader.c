/* model_shader.c: the colours of scans and point clouds: diffuse light times what the vertices say.
 *
 * The library's shaders take colour from material and texture; this is what a user's own shader
 * looks like. Colours are linear, the mesh's extra components; the varyings are the normal, if it
 * is asked for, then those.
 */
#include "model_shader.h"

#include <math.h>

#define EACH_LANE(i) for (int i = 0; i < VD_BATCH; i++)

static float encode(float linear) {
    return (float)vd_srgb_encode(linear) * (1.0f / 65535.0f);
}

static void turn(const float m[3][3], const float v[3], float out[3]) {
    for (int r = 0; r < 3; r++) {
        out[r] = (m[r][0] * v[0] + m[r][1] * v[1]) + m[r][2] * v[2];
    }
}

/* What the lights give to a surface of each lane's normal, turned towards the viewer. */
static void light(const vd_fragments *f, const float (*normal)[VD_BATCH], float sum[3][VD_BATCH]) {
    const vd_phong *phong = f->uniforms;
    const vd_mesh_view *v = f->view;
    float to[4][3];
    for (int l = 0; l < phong->light_count; l++) {
        turn(v->camera_from_world, phong->lights[l].direction, to[l]);
    }
    EACH_LANE(i) {
        const float in[3] = {normal[0][i], normal[1][i], normal[2][i]};
        const bool flat = v->far_m > 0.0f;
        const float eye[3] = {flat ? 0.0f : (v->lens[2] - f->x[i]) / v->lens[0],
                              flat ? 0.0f : (v->lens[3] - f->y[i]) / v->lens[1], -1.0f};
        float n[3];
        turn(v->camera_from_normal, in, n);
        const float length = sqrtf((n[0] * n[0] + n[1] * n[1]) + n[2] * n[2]);
        const float facing = (n[0] * eye[0] + n[1] * eye[1]) + n[2] * eye[2];
        const float scale = (facing < 0.0f ? -1.0f : 1.0f) / (length > 0.0f ? length : 1.0f);
        sum[0][i] = phong->ambient.r;
        sum[1][i] = phong->ambient.g;
        sum[2][i] = phong->ambient.b;
        for (int l = 0; l < phong->light_count; l++) {
            const float dot = (n[0] * to[l][0] + n[1] * to[l][1]) + n[2] * to[l][2];
            const float cosine = dot * scale > 0.0f ? dot * scale : 0.0f;
            sum[0][i] = sum[0][i] + phong->lights[l].color.r * cosine;
            sum[1][i] = sum[1][i] + phong->lights[l].color.g * cosine;
            sum[2][i] = sum[2][i] + phong->lights[l].color.b * cosine;
        }
    }
}

static void write_color(const vd_fragments *f, const float (*rgb)[VD_BATCH],
                        const float (*lit)[VD_BATCH]) {
    const vd_material *m = f->material;
    const float albedo[3] = {m->albedo.r, m->albedo.g, m->albedo.b};
    const float emission[3] = {m->emission.r, m->emission.g, m->emission.b};
    for (int c = 0; c < 3; c++) {
        EACH_LANE(i) {
            const float color = albedo[c] * rgb[c][i];
            f->color[c][i] = encode(lit != NULL ? emission[c] + color * lit[c][i] : color);
        }
    }
    EACH_LANE(i) {
        f->color[3][i] = m->alpha;
    }
}

static void shade_phong(const vd_fragments *f) {
    float lit[3][VD_BATCH];
    light(f, f->varyings, lit);
    write_color(f, f->varyings + 3, (const float(*)[VD_BATCH])lit);
}

static void shade_flat(const vd_fragments *f) {
    float lit[3][VD_BATCH];
    light(f, f->normal, lit);
    write_color(f, f->varyings, (const float(*)[VD_BATCH])lit);
}

static void shade_albedo(const vd_fragments *f) {
    write_color(f, f->varyings, NULL);
}

const vd_shader *vd_colored_shader(vd_shading shading) {
    static const vd_shader phong = {.fragment = shade_phong,
                                    .inputs = VD_INPUT_NORMAL | VD_INPUT_EXTRA};
    static const vd_shader flat = {.fragment = shade_flat,
                                   .inputs = VD_INPUT_FACE_NORMAL | VD_INPUT_EXTRA};
    static const vd_shader albedo = {.fragment = shade_albedo, .inputs = VD_INPUT_EXTRA};
    return shading == VD_SHADING_PHONG    ? &phong
           : shading == VD_SHADING_FLAT   ? &flat
           : shading == VD_SHADING_ALBEDO ? &albedo
                                          : NULL;
}

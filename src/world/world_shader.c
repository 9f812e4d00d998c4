/* world_shader.c: fragment functions of a world's meshes. */
#include "world/world_shader.h"
#include "raster/shader_math.h"

/* Places in camera space. */
static void find_places(const vd_fragments *f, const vd_world_light *light,
                        vd_shader_lanes place[3]) {
    vd_shader_lanes z;
    VD_EACH_LANE(i) {
        z[i] = light->parallel ? (1.0f - f->depth[i]) * light->far_m : f->w[i];
    }
    vd_world_light_place(light, f->x, f->y, z, place);
}

/* Unit normals in camera space, turned towards the viewer. */
static void find_normals(const vd_fragments *f, const float (*normal)[VD_BATCH], bool parallel,
                         float place[3][VD_BATCH], vd_shader_lanes n[3]) {
    const float(*m)[3] = f->view->camera_from_normal;
    VD_EACH_LANE(i) {
        const float x = normal[0][i], y = normal[1][i], z = normal[2][i];
        const float a = (m[0][0] * x + m[0][1] * y) + m[0][2] * z;
        const float b = (m[1][0] * x + m[1][1] * y) + m[1][2] * z;
        const float c = (m[2][0] * x + m[2][1] * y) + m[2][2] * z;
        const float length = sqrtf((a * a + b * b) + c * c);
        const float away = parallel ? c : (a * place[0][i] + b * place[1][i]) + c * place[2][i];
        const float scale = (away > 0.0f ? -1.0f : 1.0f) / (length > 0.0f ? length : 1.0f);
        n[0][i] = a * scale;
        n[1][i] = b * scale;
        n[2][i] = c * scale;
    }
}

/* What hills and things leave of the sun, where it falls on the surface. */
static void find_visible(const vd_fragments *f, const vd_world_uniforms *uniforms,
                         float place[3][VD_BATCH], vd_shader_lanes n[3], const float *cosine,
                         vd_shader_lanes visible) {
    const vd_world_light *light = uniforms->light;
    uint32_t facing = 0;
    VD_EACH_LANE(i) {
        visible[i] = uniforms->sun_visible;
        facing |= (uint32_t)(cosine[i] > 0.0f) << i;
    }
    facing &= f->mask;
    for (uint32_t left = uniforms->mixed ? facing : 0; left != 0; left &= left - 1) {
        const int i = __builtin_ctz(left);
        visible[i] =
            vd_world_light_past_hills(light, (float[3]){place[0][i], place[1][i], place[2][i]});
    }
    if (!uniforms->receives || light->map == NULL || facing == 0) {
        return;
    }
    vd_shader_lanes lifted[3], width, share;
    VD_EACH_LANE(i) {
        const float square = 1.0f - cosine[i] * cosine[i];
        width[i] = vd_world_light_width(light, place[2][i]);
        const float lift =
            vd_sun_map_lift(light->map, width[i], sqrtf(square > 0.0f ? square : 0.0f));
        lifted[0][i] = place[0][i] + n[0][i] * lift;
        lifted[1][i] = place[1][i] + n[1][i] * lift;
        lifted[2][i] = place[2][i] + n[2][i] * lift;
    }
    (void)vd_world_light_shares(light, facing, lifted, width, share);
    VD_EACH_LANE(i) {
        visible[i] = visible[i] * share[i];
    }
}

/* The sun mirrored to the viewer, as vd_phong has it. */
static void add_highlight(const vd_fragments *f, const vd_world_light *light,
                          float place[3][VD_BATCH], vd_shader_lanes n[3], const float *cosine,
                          const float *visible, vd_shader_lanes sum[3]) {
    const vd_material *m = f->material;
    const float specular[3] = {m->specular.r, m->specular.g, m->specular.b};
    const int exponent = m->shininess > 1.0f ? (int)m->shininess : 1;
    VD_EACH_LANE(i) {
        const float x = place[0][i], y = place[1][i], z = place[2][i];
        const float scale = light->parallel ? 1.0f : 1.0f / sqrtf((x * x + y * y) + z * z);
        const float eye[3] = {light->parallel ? 0.0f : -x * scale,
                              light->parallel ? 0.0f : -y * scale,
                              light->parallel ? -1.0f : -z * scale};
        float mirrored = 0.0f;
        for (int r = 0; r < 3; r++) {
            mirrored = mirrored + (2.0f * cosine[i] * n[r][i] - light->to_sun[r]) * eye[r];
        }
        const bool seen = cosine[i] > 0.0f && mirrored > 0.0f;
        const float highlight = seen ? vd_shader_power(mirrored, exponent) * visible[i] : 0.0f;
        for (int c = 0; c < 3; c++) {
            sum[c][i] = sum[c][i] + specular[c] * highlight * light->sun[c];
        }
    }
}

static void shade(const vd_fragments *f, const float (*normal)[VD_BATCH], int uv, int extra) {
    const vd_world_uniforms *uniforms = f->uniforms;
    const vd_world_light *light = uniforms->light;
    const vd_material *m = f->material;
    const float emission[3] = {m->emission.r, m->emission.g, m->emission.b};
    vd_shader_lanes albedo[3], place[3], n[3], cosine, visible, sum[3];
    vd_surface_albedo(f, uv, albedo);
    find_places(f, light, place);
    find_normals(f, normal, light->parallel, place, n);
    const float *s = light->to_sun, *u = light->up;
    VD_EACH_LANE(i) {
        cosine[i] = (n[0][i] * s[0] + n[1][i] * s[1]) + n[2][i] * s[2];
    }
    find_visible(f, uniforms, place, n, cosine, visible);
    for (int c = 0; c < 3; c++) {
        VD_EACH_LANE(i) {
            const float up = (n[0][i] * u[0] + n[1][i] * u[1]) + n[2][i] * u[2];
            const float direct = cosine[i] > 0.0f ? cosine[i] * visible[i] : 0.0f;
            const float ambient = light->ambient[c] + light->ambient_more[c] * (0.5f + 0.5f * up);
            const float color =
                extra >= 0 ? albedo[c][i] * f->varyings[extra + c][i] : albedo[c][i];
            sum[c][i] = color * (light->sun[c] * direct + ambient) + emission[c];
        }
    }
    if (m->specular.r > 0.0f || m->specular.g > 0.0f || m->specular.b > 0.0f) {
        add_highlight(f, light, place, n, cosine, visible, sum);
    }
    vd_shader_lanes left;
    VD_EACH_LANE(i) {
        left[i] = light->haze != 0.0f
                      ? vd_world_light_left(light, place[0][i], place[1][i], place[2][i])
                      : 1.0f;
    }
    for (int c = 0; c < 3; c++) {
        VD_EACH_LANE(i) {
            const float color = vd_shader_encode(sum[c][i]);
            f->color[c][i] = color + (light->haze_color[c] - color) * (1.0f - left[i]);
        }
    }
}

static void shade_smooth(const vd_fragments *f) {
    shade(f, f->varyings, 3, -1);
}

static void shade_flat(const vd_fragments *f) {
    shade(f, f->normal, 0, -1);
}

static void shade_colored(const vd_fragments *f) {
    shade(f, f->varyings, 3, 5);
}

static void shade_flat_colored(const vd_fragments *f) {
    shade(f, f->normal, 0, 2);
}

#define TEXTURED (VD_INPUT_UV | VD_INPUT_DERIVATIVES)

const vd_shader vd_world_shader = {.fragment = shade_smooth, .inputs = VD_INPUT_NORMAL | TEXTURED};
const vd_shader vd_world_shader_flat = {.fragment = shade_flat,
                                        .inputs = VD_INPUT_FACE_NORMAL | TEXTURED};
/* Without a texture no varying is read but the normal. */
const vd_shader vd_world_shader_plain = {.fragment = shade_smooth, .inputs = VD_INPUT_NORMAL};
const vd_shader vd_world_shader_flat_plain = {.fragment = shade_flat,
                                              .inputs = VD_INPUT_FACE_NORMAL};
const vd_shader vd_world_shader_colored = {.fragment = shade_colored,
                                           .inputs = VD_INPUT_NORMAL | VD_INPUT_EXTRA | TEXTURED};
const vd_shader vd_world_shader_flat_colored = {
    .fragment = shade_flat_colored, .inputs = VD_INPUT_FACE_NORMAL | VD_INPUT_EXTRA | TEXTURED};

const vd_shader *vd_world_shader_for(const vd_draw *draw, bool colored) {
    const bool smooth = draw->mesh->normal >= 0;
    if (colored && draw->mesh->extra_count >= 3) {
        return smooth ? &vd_world_shader_colored : &vd_world_shader_flat_colored;
    }
    bool textured = false;
    for (int i = 0; i < draw->material_count; i++) {
        textured = textured || draw->materials[i].texture != NULL;
    }
    if (textured) {
        return smooth ? &vd_world_shader : &vd_world_shader_flat;
    }
    return smooth ? &vd_world_shader_plain : &vd_world_shader_flat_plain;
}

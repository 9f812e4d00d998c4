/* line_shader.c: lines over the ground: unlit, a little nearer than they are. */
#include "raster/shader_math.h"
#include "world/world_internal.h"

static void vertex(const vd_vertices *v) {
    const vd_line_view *line = v->uniforms;
    const float(*m)[4] = v->view->picture_from_mesh;
    const vd_vec3 eye = vd_vec3_subtract(line->eye, v->mesh->anchor);
    const float ex = (float)eye.x, ey = (float)eye.y, drop = (float)line->drop_per_m2;
    VD_EACH_LANE(i) {
        const float x = v->position[0][i], y = v->position[1][i];
        const float dx = x - ex, dy = y - ey;
        const float z = v->position[2][i] - drop * (dx * dx + dy * dy);
        for (int r = 0; r < 4; r++) {
            v->picture[r][i] = m[r][0] * x + (m[r][1] * y + (m[r][2] * z + m[r][3]));
        }
        v->picture[2][i] = v->picture[2][i] * line->nearer;
    }
}

static void fragment(const vd_fragments *f) {
    const vd_linear c = f->material->albedo;
    const float encoded[3] = {(float)vd_srgb_encode(c.r) / 65535.0f,
                              (float)vd_srgb_encode(c.g) / 65535.0f,
                              (float)vd_srgb_encode(c.b) / 65535.0f};
    VD_EACH_LANE(i) {
        for (int k = 0; k < 3; k++) {
            f->color[k][i] = encoded[k];
        }
        f->color[3][i] = f->material->alpha;
    }
}

const vd_shader vd_line_shader = {.vertex = vertex, .fragment = fragment};

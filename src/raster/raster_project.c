/* raster_project.c: from a draw and a camera to vertices in the picture. */
#include <math.h>
#include <string.h>
#include "raster/raster_internal.h"

/* ---- the view ---------------------------------------------------------------------------------*/

static bool finite_matrix(const vd_matrix *m) {
    for (int i = 0; i < 16; i++) {
        if (!isfinite(m->m[i / 4][i % 4])) {
            return false;
        }
    }
    return true;
}

/* The inverse of a rigid or affine map, rows of three and a translation. */
static void invert_affine(const vd_matrix *m, float out[3][4]) {
    const vd_matrix normal = vd_matrix_normal(m);
    double determinant = 0.0;
    for (int j = 0; j < 3; j++) {
        determinant += m->m[0][j] * normal.m[0][j];
    }
    for (int i = 0; i < 3; i++) {
        double moved = 0.0;
        for (int j = 0; j < 3; j++) {
            const double inverse = normal.m[j][i] / determinant;
            out[i][j] = (float)inverse;
            moved -= inverse * m->m[j][3];
        }
        out[i][3] = (float)moved;
    }
}

static void set_view(vd_drawing *drawing, const vd_camera *camera, int width, int height) {
    vd_mesh_view *view = &drawing->view;
    /* Everything large cancels in double: what is left is relative to the eye. */
    vd_matrix place = vd_matrix_translation(drawing->mesh->anchor);
    place = vd_matrix_multiply(&drawing->draw.world_from_mesh, &place);
    place.m[0][3] -= camera->eye.x;
    place.m[1][3] -= camera->eye.y;
    place.m[2][3] -= camera->eye.z;
    const vd_matrix project = vd_camera_matrix(camera);
    const vd_matrix picture = vd_matrix_multiply(&project, &place);
    const vd_quat q = camera->orientation;
    vd_matrix turn = vd_matrix_rotation((vd_quat){-q.x, -q.y, -q.z, q.w});
    turn = vd_matrix_multiply(&turn, &place);
    for (int i = 0; i < 4; i++) {
        for (int j = 0; j < 4; j++) {
            view->picture_from_mesh[i][j] = (float)picture.m[i][j];
            if (i < 3) {
                view->camera_from_mesh[i][j] = (float)turn.m[i][j];
            }
        }
    }
    invert_affine(&turn, view->mesh_from_camera);
    const vd_matrix normal = vd_matrix_normal(&turn);
    const vd_matrix world = vd_matrix_rotation((vd_quat){-q.x, -q.y, -q.z, q.w});
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) {
            view->camera_from_normal[i][j] = (float)normal.m[i][j];
            view->camera_from_world[i][j] = (float)world.m[i][j];
        }
    }
    view->lens[0] = (float)camera->lens.fx;
    view->lens[1] = (float)camera->lens.fy;
    view->lens[2] = (float)camera->lens.cx;
    view->lens[3] = (float)camera->lens.cy;
    view->near_m = (float)camera->near_m;
    view->far_m = camera->projection == VD_PROJECTION_ORTHOGRAPHIC ? (float)camera->far_m : 0.0f;
    view->width = width;
    view->height = height;
}

/* ---- the draw ---------------------------------------------------------------------------------*/

static vd_status check_draw(const vd_draw *draw) {
    if (draw->mesh == NULL) {
        return vd_failure(VD_ERROR_ARGUMENT, "a draw has no mesh; set one");
    }
    if (!finite_matrix(&draw->world_from_mesh)) {
        return vd_failure(VD_ERROR_ARGUMENT, "a draw's world_from_mesh has a number that is not "
                                             "finite");
    }
    if (draw->cull < 0 || draw->cull >= VD_CULL_COUNT || draw->winding < 0 ||
        draw->winding >= VD_WINDING_COUNT || draw->fill < 0 || draw->fill >= VD_FILL_COUNT) {
        return vd_failure(VD_ERROR_ARGUMENT, "a draw's cull %d, winding %d or fill %d is unknown",
                          (int)draw->cull, (int)draw->winding, (int)draw->fill);
    }
    if (!(draw->line_width > 0.0 && draw->line_width <= 1024.0) ||
        !(draw->point_size > 0.0 && draw->point_size <= 1024.0)) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "a draw's line width %g or point size %g is not in 0 … 1024 pixels",
                          draw->line_width, draw->point_size);
    }
    if (draw->material_count < 0 || (draw->material_count > 0 && draw->materials == NULL)) {
        return vd_failure(VD_ERROR_ARGUMENT, "a draw has %d materials, but does not give them",
                          draw->material_count);
    }
    return vd_success();
}

static vd_status check_parts(const vd_draw *draw) {
    const vd_mesh_part *parts = vd_mesh_parts(draw->mesh);
    for (uint32_t i = 0; draw->materials != NULL && i < draw->mesh->part_count; i++) {
        if (parts[i].material >= (uint32_t)draw->material_count) {
            return vd_failure(VD_ERROR_ARGUMENT,
                              "part %u of a mesh wants material %u, but the draw has %d", i,
                              parts[i].material, draw->material_count);
        }
    }
    return vd_success();
}

static vd_status check_materials(const vd_draw *draw) {
    for (int i = 0; draw->materials != NULL && i < draw->material_count; i++) {
        const vd_material *m = &draw->materials[i];
        if (m->filter < 0 || m->filter >= VD_TEXTURE_FILTER_COUNT) {
            return vd_failure(VD_ERROR_ARGUMENT, "material %d has the unknown filter %d", i,
                              (int)m->filter);
        }
        if (!(m->alpha_test >= 0.0f && m->alpha_test <= 1.0f)) {
            return vd_failure(VD_ERROR_ARGUMENT,
                              "material %d has the alpha test %g; give 0 … 1, 0 for none", i,
                              (double)m->alpha_test);
        }
    }
    return vd_success();
}

static vd_status check_shader(const vd_shader *shader, const vd_mesh *mesh) {
    if (shader->varying_count < 0 || shader->varying_count > VD_MAX_VARYINGS ||
        shader->user_bytes > VD_MAX_USER_BYTES) {
        return vd_failure(
            VD_ERROR_ARGUMENT,
            "a shader's %d varyings or %zu user bytes are too many; at most %d and %d",
            shader->varying_count, shader->user_bytes, VD_MAX_VARYINGS, VD_MAX_USER_BYTES);
    }
    if (shader->user_bytes > 0 &&
        (shader->vertex == NULL || shader->user_add == NULL || shader->user_scale == NULL)) {
        return vd_failure(VD_ERROR_ARGUMENT, "a shader has user data, but no vertex, add or scale "
                                             "function for it");
    }
    if (shader->vertex == NULL && (shader->inputs & VD_INPUT_NORMAL) != 0 && mesh->normal < 0) {
        return vd_failure(VD_ERROR_ARGUMENT, "a shader wants normals, but the mesh has none; set "
                                             "compute_normals when making it");
    }
    return vd_success();
}

static void add_varyings(vd_drawing *drawing, int first, int count) {
    for (int i = 0; i < count; i++) {
        drawing->component[drawing->varying_count++] = (int8_t)(first < 0 ? -1 : first + i);
    }
}

/* What alpha of tested and blended materials asks for. */
static void choose_alpha(vd_drawing *drawing) {
    const vd_shader *shader = drawing->shader;
    bool textured = false;
    for (int i = 0; drawing->draw.materials != NULL && i < drawing->draw.material_count; i++) {
        const vd_material *m = &drawing->draw.materials[i];
        if (vd_material_kind(m) != VD_KIND_SOLID) {
            drawing->special = true;
            textured = textured || m->texture != NULL;
        }
    }
    drawing->alpha_of_material =
        shader->fragment == NULL || shader == vd_shader_find(VD_SHADING_DEPTH) ||
        shader == vd_shader_find(VD_SHADING_NORMALS) || shader == vd_shader_find(VD_SHADING_UV) ||
        shader == vd_shader_find(VD_SHADING_ID);
    if (drawing->alpha_of_material && textured && shader->vertex == NULL) {
        drawing->inputs |= VD_INPUT_UV | VD_INPUT_DERIVATIVES;
    }
}

/* The lit shaders want texture coordinates and their changes for textures only. */
static unsigned choose_inputs(const vd_drawing *drawing) {
    const unsigned inputs = drawing->shader->inputs;
    const vd_shader *shader = drawing->shader;
    bool textured = shader != vd_shader_find(VD_SHADING_PHONG) &&
                    shader != vd_shader_find(VD_SHADING_FLAT) &&
                    shader != vd_shader_find(VD_SHADING_ALBEDO);
    for (int i = 0; drawing->draw.materials != NULL && i < drawing->draw.material_count; i++) {
        textured = textured || drawing->draw.materials[i].texture != NULL;
    }
    return textured ? inputs : inputs & ~(unsigned)(VD_INPUT_UV | VD_INPUT_DERIVATIVES);
}

static void choose_varyings(vd_drawing *drawing) {
    const vd_mesh *mesh = drawing->mesh;
    const vd_shader *shader = drawing->shader;
    drawing->varying_count = 0;
    drawing->uv = -1;
    if (shader->vertex != NULL) {
        add_varyings(drawing, 0, shader->varying_count);
        drawing->group_stride = (size_t)mesh->vertex_stride * 4;
        return; /* drawing->groups is set when there is memory */
    }
    if ((drawing->inputs & VD_INPUT_NORMAL) != 0) {
        add_varyings(drawing, mesh->normal, 3);
    }
    if ((drawing->inputs & VD_INPUT_UV) != 0) {
        drawing->uv = drawing->varying_count;
        add_varyings(drawing, mesh->uv, 2);
    }
    if ((drawing->inputs & VD_INPUT_EXTRA) != 0) {
        add_varyings(drawing, mesh->extra, mesh->extra_count);
    }
    drawing->groups = vd_mesh_attributes(mesh, 0);
    drawing->group_stride = (size_t)mesh->vertex_stride * 4;
}

/* Which way round a triangle may go in the picture. */
static void choose_culling(vd_drawing *drawing) {
    const vd_draw *draw = &drawing->draw;
    bool clockwise_front = draw->winding == VD_WINDING_CLOCKWISE;
    const bool all = draw->winding == VD_WINDING_EITHER || draw->cull == VD_CULL_NONE;
    if (draw->cull == VD_CULL_FRONT) {
        clockwise_front = !clockwise_front;
    }
    drawing->keep_clockwise = all || clockwise_front;
    drawing->keep_counter_clockwise = all || !clockwise_front;
    if (draw->winding == VD_WINDING_EITHER && draw->cull == VD_CULL_FRONT) {
        drawing->keep_clockwise = drawing->keep_counter_clockwise = false;
    }
}

static void choose_topology(vd_drawing *drawing) {
    const vd_mesh *mesh = drawing->mesh;
    drawing->topology = (vd_topology)mesh->topology;
    drawing->primitive_count = mesh->primitive_count;
    if (mesh->topology != VD_TOPOLOGY_TRIANGLES) {
        return;
    }
    if (drawing->draw.fill == VD_FILL_WIREFRAME) {
        drawing->topology = VD_TOPOLOGY_LINES;
        drawing->wireframe = true;
    } else if (drawing->draw.fill == VD_FILL_POINTS) {
        drawing->topology = VD_TOPOLOGY_POINTS;
        drawing->by_vertex = true;
        drawing->primitive_count = mesh->vertex_count;
    }
}

vd_status vd_drawing_init(vd_drawing *drawing, const vd_draw *draw, const vd_raster_def *def,
                          const vd_camera *camera, int width, int height) {
    memset(drawing, 0, sizeof *drawing);
    vd_status status = check_draw(draw);
    if (status.code == VD_OK) {
        status = check_parts(draw);
    }
    if (status.code == VD_OK) {
        status = check_materials(draw);
    }
    if (status.code != VD_OK) {
        return status;
    }
    drawing->draw = *draw;
    drawing->mesh = draw->mesh;
    drawing->shader = draw->shader;
    if (drawing->shader == NULL) {
        drawing->shader =
            vd_shader_find(draw->mesh->normal >= 0 ? VD_SHADING_PHONG : VD_SHADING_FLAT);
    }
    drawing->fragment = drawing->shader->fragment;
    status = check_shader(drawing->shader, draw->mesh);
    if (status.code != VD_OK) {
        return status;
    }
    drawing->inputs = choose_inputs(drawing);
    choose_alpha(drawing);
    choose_topology(drawing);
    choose_varyings(drawing);
    choose_culling(drawing);
    set_view(drawing, camera, width, height);
    if (camera->projection == VD_PROJECTION_ORTHOGRAPHIC) {
        drawing->depth_near = (float)(1.0 - camera->near_m / camera->far_m);
        drawing->depth_far = 0.0f;
    } else {
        drawing->depth_near = 1.0f;
        drawing->depth_far = def->far_m > 0.0 ? (float)(camera->near_m / def->far_m) : 0.0f;
    }
    return status;
}

/* ---- vertices ---------------------------------------------------------------------------------*/

static int32_t outside_code(const vd_drawing *drawing, const float p[4]) {
    const float width = (float)drawing->view.width, height = (float)drawing->view.height;
    if (!(isfinite(p[0]) && isfinite(p[1]) && isfinite(p[2]) && isfinite(p[3]))) {
        return VD_OUT_BAD;
    }
    return (p[0] < 0.0f ? VD_OUT_LEFT : 0) | (p[0] > width * p[3] ? VD_OUT_RIGHT : 0) |
           (p[1] < 0.0f ? VD_OUT_TOP : 0) | (p[1] > height * p[3] ? VD_OUT_BOTTOM : 0) |
           (p[2] > drawing->depth_near * p[3] ? VD_OUT_NEAR : 0) |
           (p[2] < drawing->depth_far * p[3] ? VD_OUT_FAR : 0) | VD_OUT_GUARD;
}

vd_vertex vd_project(const vd_drawing *drawing, const float p[4]) {
    const float rw = 1.0f / p[3];
    const float x = p[0] * rw, y = p[1] * rw;
    const float half_width = 0.5f * (float)drawing->view.width;
    const float half_height = 0.5f * (float)drawing->view.height;
    const vd_vertex v = {.z = p[2] * rw, .rw = rw};
    /* The same comparisons, in the same form, as in the kernels: false for NaN. */
    const bool inside = p[3] > 0.0f && v.z <= drawing->depth_near && v.z >= drawing->depth_far &&
                        fabsf(x - half_width) <= (float)VD_GUARD_PIXELS &&
                        fabsf(y - half_height) <= (float)VD_GUARD_PIXELS;
    if (!inside) {
        return (vd_vertex){INT32_MIN + outside_code(drawing, p), 0, 0.0f, 0.0f};
    }
    return (vd_vertex){(int32_t)floorf(x * 256.0f - 127.5f), (int32_t)floorf(y * 256.0f - 127.5f),
                       v.z, v.rw};
}

static void run_matrix(const vd_drawing *drawing, const float (*position)[VD_BATCH],
                       float (*picture)[VD_BATCH]) {
    for (int r = 0; r < 4; r++) {
        const float *m = drawing->view.picture_from_mesh[r];
        for (int i = 0; i < VD_BATCH; i++) {
            picture[r][i] =
                m[0] * position[0][i] + (m[1] * position[1][i] + (m[2] * position[2][i] + m[3]));
        }
    }
}

void vd_vertices_run(const vd_drawing *drawing, uint32_t first, int count, bool store,
                     float (*picture)[VD_BATCH]) {
    const vd_mesh *mesh = drawing->mesh;
    const vd_shader *shader = drawing->shader;
    float position[3][VD_BATCH] __attribute__((aligned(64)));
    for (int axis = 0; axis < 3; axis++) {
        memcpy(position[axis], vd_mesh_positions(mesh, axis) + first, sizeof position[axis]);
    }
    if (shader->vertex == NULL) {
        run_matrix(drawing, position, picture);
        return;
    }
    float attributes[VD_MESH_MAX_COMPONENTS][VD_BATCH] __attribute__((aligned(64)));
    float varyings[VD_MAX_VARYINGS][VD_BATCH] __attribute__((aligned(64)));
    uint8_t user[VD_BATCH * VD_MAX_USER_BYTES] __attribute__((aligned(64)));
    for (int c = 0; c < mesh->component_count; c++) {
        const float *from = vd_mesh_attributes(mesh, c / 4) + (size_t)first * 4 + c % 4;
        for (int i = 0; i < VD_BATCH; i++) {
            attributes[c][i] = from[4 * i];
        }
    }
    memset(varyings, 0, (size_t)shader->varying_count * sizeof varyings[0]);
    const vd_vertices batch = {count,
                               drawing->draw.uniforms,
                               &drawing->view,
                               mesh,
                               first,
                               (const float(*)[VD_BATCH])position,
                               (const float(*)[VD_BATCH])attributes,
                               picture,
                               varyings,
                               user};
    shader->vertex(&batch);
    if (!store) {
        return;
    }
    for (int k = 0; k < shader->varying_count; k++) {
        float *to =
            drawing->written + (size_t)(k / 4) * drawing->group_stride + (size_t)first * 4 + k % 4;
        for (int i = 0; i < VD_BATCH; i++) {
            to[4 * i] = varyings[k][i];
        }
    }
    if (shader->user_bytes > 0) {
        memcpy(drawing->user + (size_t)first * shader->user_bytes, user,
               VD_BATCH * shader->user_bytes);
    }
}

void vd_vertex_picture(const vd_drawing *drawing, uint32_t vertex, float picture[4]) {
    float batch[4][VD_BATCH] __attribute__((aligned(64)));
    const uint32_t first = vertex / VD_BATCH * VD_BATCH;
    const uint32_t left = drawing->mesh->vertex_count - first;
    vd_vertices_run(drawing, first, left < VD_BATCH ? (int)left : VD_BATCH, false, batch);
    for (int i = 0; i < 4; i++) {
        picture[i] = batch[i][vertex % VD_BATCH];
    }
}

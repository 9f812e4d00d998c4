/* wireframe.c: one mesh drawn three ways in one frame: solid and lit, as lines, as points.
 *
 *   wireframe [OUT.png]
 */
#include <stdio.h>
#include <veduta/veduta.h>

enum { SIDES = 24, RINGS = 40, VERTICES = SIDES * RINGS };

/* Points on a torus around z, by two angles that go round in steps: each next point of a circle is
 * the last one turned. */
static void make_torus(float positions[VERTICES][3], uint32_t indices[VERTICES][6]) {
    const vd_quat step = vd_quat_from_axis_angle(vd_vec3_make(0, 0, 1), 6.283185307179586 / RINGS);
    const vd_quat tilt = vd_quat_from_axis_angle(vd_vec3_make(0, 1, 0), 6.283185307179586 / SIDES);
    vd_vec3 around = {0.4, 0, 0};
    for (int side = 0; side < SIDES; side++, around = vd_quat_rotate(tilt, around)) {
        vd_vec3 p = vd_vec3_add(around, vd_vec3_make(1, 0, 0));
        for (int ring = 0; ring < RINGS; ring++, p = vd_quat_rotate(step, p)) {
            const int v = side * RINGS + ring, next = (ring + 1) % RINGS;
            const int below = (side + 1) % SIDES * RINGS;
            positions[v][0] = (float)p.x;
            positions[v][1] = (float)p.y;
            positions[v][2] = (float)p.z;
            const int quad[6] = {v, side * RINGS + next, below + next,
                                 v, below + next,        below + ring};
            for (int i = 0; i < 6; i++) {
                indices[v][i] = (uint32_t)quad[5 - i];
            }
        }
    }
}

static vd_status draw(vd_raster *raster, const vd_mesh *mesh, vd_frame *frame) {
    const vd_vec3 eye = {0, -8.5, 5}, target = {0, 0, 0};
    vd_camera camera = {.eye = eye,
                        .orientation = vd_orientation_look_at(eye, target),
                        .lens = vd_lens_from_fov(0.4, frame->width, frame->height),
                        .near_m = 0.1};
    vd_draw draws[3];
    for (int i = 0; i < 3; i++) {
        draws[i] = vd_draw_default();
        draws[i].mesh = mesh;
        draws[i].world_from_mesh = vd_matrix_translation(vd_vec3_make(2.8 * (i - 1), 0, 0));
        draws[i].fill = (vd_fill)i;
        draws[i].object_id = 1 + (uint64_t)i;
    }
    draws[1].shader = vd_shader_find(VD_SHADING_ALBEDO);
    draws[2].shader = vd_shader_find(VD_SHADING_NORMALS);
    draws[2].point_size = 3.0;
    vd_raster_def def = vd_raster_def_default();
    def.samples = 8;
    def.background = (vd_rgba8){20, 24, 32, 255};
    return vd_raster_render(raster, NULL, &def, &camera, draws, 3, frame, NULL);
}

int main(int argc, char **argv) {
    static float positions[VERTICES][3];
    static uint32_t indices[VERTICES][6];
    make_torus(positions, indices);
    vd_mesh_def mesh_def = vd_mesh_def_default();
    mesh_def.vertex_count = VERTICES;
    mesh_def.positions = positions[0];
    mesh_def.index_count = (size_t)VERTICES * 6;
    mesh_def.indices = indices[0];
    mesh_def.compute_normals = true;

    vd_context *context = NULL;
    vd_mesh *mesh = NULL;
    vd_raster *raster = NULL;
    vd_frame *frame = NULL;
    vd_status status = vd_context_create(NULL, &context);
    if (status.code == VD_OK) {
        status = vd_mesh_create(context, &mesh_def, &mesh);
    }
    if (status.code == VD_OK) {
        status = vd_raster_create(context, &raster);
    }
    if (status.code == VD_OK) {
        status = vd_frame_create(context, 960, 400, 0, &frame);
    }
    if (status.code == VD_OK) {
        status = draw(raster, mesh, frame);
    }
    if (status.code == VD_OK) {
        status = vd_frame_save_png(frame, argc > 1 ? argv[1] : "wireframe.png", NULL);
    }
    if (status.code != VD_OK) {
        fprintf(stderr, "wireframe: %s\n", status.message);
    }
    vd_frame_destroy(&frame);
    vd_raster_destroy(&raster);
    if (context != NULL) {
        vd_mesh_destroy(context, &mesh);
        vd_context_destroy(&context);
    }
    return status.code == VD_OK ? 0 : 1;
}

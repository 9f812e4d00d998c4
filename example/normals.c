/* normals.c: an octahedron's normals as colours: what points right is red, up green, to the viewer
 * blue.
 *
 *   normals [OUT.png]
 */
#include <stdio.h>
#include <stdlib.h>
#include <veduta/veduta.h>

static void must(vd_status status) {
    if (status.code != VD_OK) {
        fprintf(stderr, "normals: %s\n", status.message);
        exit(1);
    }
}

int main(int argc, char **argv) {
    static const float corners[6][3] = {{1, 0, 0},  {-1, 0, 0}, {0, 1, 0},
                                        {0, -1, 0}, {0, 0, 1},  {0, 0, -1}};
    static const uint32_t faces[8][3] = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4},
                                         {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
    vd_mesh_def mesh_def = vd_mesh_def_default();
    mesh_def.vertex_count = 6, mesh_def.positions = corners[0];
    mesh_def.index_count = 24, mesh_def.indices = faces[0];
    mesh_def.compute_normals = true;

    vd_context *context;
    vd_mesh *mesh;
    vd_raster *raster;
    vd_frame *frame;
    must(vd_context_create(NULL, &context));
    must(vd_mesh_create(context, &mesh_def, &mesh));
    must(vd_raster_create(context, &raster));
    must(vd_frame_create(context, 480, 480, 0, &frame));

    const vd_vec3 eye = {1.5, -4, 1.2}, target = {0, 0, 0};
    const vd_camera camera = {.eye = eye,
                              .orientation = vd_orientation_look_at(eye, target),
                              .lens = vd_lens_from_fov(0.6, 480, 480),
                              .near_m = 0.1};
    vd_draw draw = vd_draw_default();
    draw.mesh = mesh;
    draw.shader = vd_shader_find(VD_SHADING_NORMALS);
    vd_raster_def def = vd_raster_def_default();
    def.samples = 4;
    must(vd_raster_render(raster, NULL, &def, &camera, &draw, 1, frame, NULL));
    must(vd_frame_save_png(frame, argc > 1 ? argv[1] : "normals.png", NULL));

    vd_frame_destroy(&frame);
    vd_raster_destroy(&raster);
    vd_mesh_destroy(context, &mesh);
    vd_context_destroy(&context);
    return 0;
}

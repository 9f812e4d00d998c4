/* points.c: a spiral of points, each a coloured dot that is hidden by nearer ones.
 *
 *   points [OUT.png]
 */
#include <stdio.h>
#include <stdlib.h>
#include <veduta/veduta.h>

static void must(vd_status status) {
    if (status.code != VD_OK) {
        fprintf(stderr, "points: %s\n", status.message);
        exit(1);
    }
}

enum { COUNT = 600 };

int main(int argc, char **argv) {
    static float places[COUNT][3];
    const vd_quat turn = vd_quat_from_axis_angle(vd_vec3_make(0, 0, 1), 2.399963); /* golden */
    vd_vec3 p = {1, 0, 0};
    for (int i = 0; i < COUNT; i++, p = vd_quat_rotate(turn, p)) {
        const float share = (float)i / COUNT;
        places[i][0] = (float)p.x * (1.0f - share);
        places[i][1] = (float)p.y * (1.0f - share);
        places[i][2] = 2.0f * share - 0.8f;
    }
    vd_mesh_def mesh_def = vd_mesh_def_default();
    mesh_def.topology = VD_TOPOLOGY_POINTS;
    mesh_def.vertex_count = COUNT, mesh_def.positions = places[0];

    vd_context *context;
    vd_mesh *mesh;
    vd_raster *raster;
    vd_frame *frame;
    must(vd_context_create(NULL, &context));
    must(vd_mesh_create(context, &mesh_def, &mesh));
    must(vd_raster_create(context, &raster));
    must(vd_frame_create(context, 480, 480, 0, &frame));

    const vd_vec3 eye = {1.5, -4, 2.2}, target = {0, 0, 0};
    const vd_camera camera = {.eye = eye,
                              .orientation = vd_orientation_look_at(eye, target),
                              .lens = vd_lens_from_fov(0.6, 480, 480),
                              .near_m = 0.1};
    vd_draw draw = vd_draw_default();
    draw.mesh = mesh;
    draw.shader = vd_shader_find(VD_SHADING_ID);
    draw.point_size = 7.0;
    vd_raster_def def = vd_raster_def_default();
    def.samples = 8;
    must(vd_raster_render(raster, NULL, &def, &camera, &draw, 1, frame, NULL));
    must(vd_frame_save_png(frame, argc > 1 ? argv[1] : "points.png", NULL));

    vd_frame_destroy(&frame);
    vd_raster_destroy(&raster);
    vd_mesh_destroy(context, &mesh);
    vd_context_destroy(&context);
    return 0;
}

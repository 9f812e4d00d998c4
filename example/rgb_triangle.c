/* rgb_triangle.c: a triangle with a colour at each corner, by a shader of one's own.
 *
 *   rgb_triangle [OUT.png]
 */
#include <stdio.h>
#include <veduta/veduta.h>

/* A fragment's colour is what was interpolated between the corners. */
static void shade(const vd_fragments *f) {
    for (int c = 0; c < 3; c++) {
        for (int i = 0; i < VD_BATCH; i++) {
            f->color[c][i] = f->varyings[c][i];
        }
    }
}

int main(int argc, char **argv) {
    static const float positions[3][3] = {{-1, 0, -0.8f}, {1, 0, -0.8f}, {0, 0, 1}};
    static const float colors[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    static const vd_shader shader = {.fragment = shade, .inputs = VD_INPUT_EXTRA};
    vd_mesh_def mesh_def = vd_mesh_def_default();
    mesh_def.vertex_count = 3;
    mesh_def.positions = positions[0];
    mesh_def.extra = colors[0];
    mesh_def.extra_count = 3;

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
        status = vd_frame_create(context, 512, 512, 0, &frame);
    }
    if (status.code == VD_OK) {
        /* From the south, northwards: x is to the right and z up in the picture. */
        vd_camera camera = {.eye = {0, -3, 0},
                            .orientation = vd_orientation_from_angles(0, 0, 0),
                            .lens = vd_lens_from_fov(0.9, frame->width, frame->height),
                            .near_m = 0.1};
        vd_raster_def def = vd_raster_def_default();
        def.samples = 4;
        vd_draw draw = vd_draw_default();
        draw.mesh = mesh;
        draw.shader = &shader;
        status = vd_raster_render(raster, NULL, &def, &camera, &draw, 1, frame, NULL);
    }
    if (status.code == VD_OK) {
        status = vd_frame_save_png(frame, argc > 1 ? argv[1] : "rgb_triangle.png", NULL);
    }
    if (status.code != VD_OK) {
        fprintf(stderr, "rgb_triangle: %s\n", status.message);
    }
    vd_frame_destroy(&frame);
    vd_raster_destroy(&raster);
    if (context != NULL) {
        vd_mesh_destroy(context, &mesh);
        vd_context_destroy(&context);
    }
    return status.code == VD_OK ? 0 : 1;
}

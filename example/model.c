/* model.c: a model from a file (OBJ, PLY or OFF), framed by its bounds; without one, a house.
 *
 *   model [OUT.png [MODEL]]
 */
#include <stdio.h>
#include <string.h>
#include <veduta/veduta.h>

/* Two gables of five corners, walls and roof; y points up. */
static const char house[] = "v -3 0 2\nv 3 0 2\nv 3 3 2\nv 0 5 2\nv -3 3 2\n"
                            "v -3 0 -2\nv 3 0 -2\nv 3 3 -2\nv 0 5 -2\nv -3 3 -2\n"
                            "f 1 2 3 4 5\nf 7 6 10 9 8\nf 2 7 8 3\nf 6 1 5 10\n"
                            "f 3 8 9 4\nf 5 4 9 10\n";

static vd_status draw(vd_context *context, const vd_model *model, vd_frame *frame) {
    /* The model's y axis becomes the world's z axis; its front then faces south. */
    vd_draw draws[VD_TOPOLOGY_COUNT];
    const int count = vd_model_draws(model, draws);
    vd_vec3 min = {0, 0, 0}, max = {0, 0, 0};
    vd_model_bounds(model, &min, &max);
    for (int i = 0; i < count; i++) {
        draws[i].world_from_mesh = vd_model_upright();
    }
    const double size = vd_vec3_length(vd_vec3_subtract(max, min));
    const vd_matrix upright = vd_model_upright();
    const vd_vec3 middle = vd_matrix_transform(&upright, vd_vec3_scale(vd_vec3_add(min, max), 0.5));
    const vd_vec3 eye = vd_vec3_add(middle, vd_vec3_scale(vd_vec3_make(0.6, -1.2, 0.5), size));
    const vd_camera camera = {.eye = eye,
                              .orientation = vd_orientation_look_at(eye, middle),
                              .lens = vd_lens_from_fov(0.7, frame->width, frame->height),
                              .near_m = 1e-3 * size};
    vd_raster_def def = vd_raster_def_default();
    def.samples = 8;
    def.background = (vd_rgba8){200, 212, 226, 255};
    vd_raster *raster = NULL;
    vd_status status = vd_raster_create(context, &raster);
    if (status.code == VD_OK) {
        status = vd_raster_render(raster, NULL, &def, &camera, draws, count, frame, NULL);
    }
    vd_raster_destroy(&raster);
    return status;
}

int main(int argc, char **argv) {
    vd_context *context = NULL;
    vd_model *model = NULL;
    vd_frame *frame = NULL;
    vd_status status = vd_context_create(NULL, &context);
    if (status.code == VD_OK) {
        status = argc > 2
                     ? vd_model_load(context, argv[2], NULL, &model)
                     : vd_model_decode(context, house, strlen(house), "house.obj", NULL, &model);
    }
    if (status.code == VD_OK) {
        status = vd_frame_create(context, 640, 480, 0, &frame);
    }
    if (status.code == VD_OK) {
        status = draw(context, model, frame);
    }
    if (status.code == VD_OK) {
        status = vd_frame_save_png(frame, argc > 1 ? argv[1] : "model.png", NULL);
    }
    if (status.code != VD_OK) {
        fprintf(stderr, "model: %s\n", status.message);
    }
    vd_frame_destroy(&frame);
    vd_model_destroy(&model);
    vd_context_destroy(&context);
    return status.code == VD_OK ? 0 : 1;
}

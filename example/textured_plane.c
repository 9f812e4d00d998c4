/* textured_plane.c: a textured ground in perspective, by one of the four filters.
 *
 *   textured_plane [OUT.png [nearest|bilinear|trilinear|anisotropic]]
 */
#include <stdio.h>
#include <string.h>
#include <veduta/veduta.h>

enum { TEXELS = 256 };

/* A chessboard with a rim. */
static vd_status make_texture(vd_context *context, vd_texture **out) {
    vd_picture *picture = NULL;
    vd_status status = vd_picture_create(context, TEXELS, TEXELS, 3, 8, &picture);
    if (status.code != VD_OK) {
        return status;
    }
    for (int y = 0; y < TEXELS; y++) {
        uint8_t *row = (uint8_t *)picture->data + (size_t)y * picture->stride_bytes;
        for (int x = 0; x < TEXELS; x++) {
            const int dark = (x / 32 + y / 32) % 2;
            const int rim = x % 32 < 2 || y % 32 < 2;
            row[3 * x] = rim ? 230 : dark ? 40 : 200;
            row[3 * x + 1] = rim ? 160 : dark ? 70 : 200;
            row[3 * x + 2] = rim ? 60 : dark ? 110 : 190;
        }
    }
    status = vd_texture_create(context, picture, out);
    vd_picture_destroy(&picture);
    return status;
}

static vd_status draw(vd_context *context, const vd_mesh *mesh, const vd_texture *texture,
                      vd_texture_filter filter, const char *path) {
    vd_raster *raster = NULL;
    vd_frame *frame = NULL;
    vd_material material = vd_material_default();
    material.albedo = (vd_linear){1, 1, 1};
    material.texture = texture;
    material.filter = filter;
    vd_draw ground = vd_draw_default();
    ground.mesh = mesh;
    ground.shader = vd_shader_find(VD_SHADING_ALBEDO);
    ground.materials = &material;
    ground.material_count = 1;
    vd_status status = vd_raster_create(context, &raster);
    if (status.code == VD_OK) {
        status = vd_frame_create(context, 640, 360, 0, &frame);
    }
    if (status.code == VD_OK) {
        vd_camera camera = {.eye = {0, 0, 1.6},
                            .orientation = vd_orientation_from_angles(0.4, -0.15, 0),
                            .lens = vd_lens_from_fov(0.8, frame->width, frame->height),
                            .near_m = 0.1};
        vd_raster_def def = vd_raster_def_default();
        def.background = (vd_rgba8){170, 200, 230, 255};
        status = vd_raster_render(raster, NULL, &def, &camera, &ground, 1, frame, NULL);
    }
    if (status.code == VD_OK) {
        status = vd_frame_save_png(frame, path, NULL);
    }
    vd_frame_destroy(&frame);
    vd_raster_destroy(&raster);
    return status;
}

int main(int argc, char **argv) {
    static const float positions[4][3] = {
        {-200, -200, 0}, {200, -200, 0}, {200, 200, 0}, {-200, 200, 0}};
    static const float uvs[4][2] = {{0, 100}, {100, 100}, {100, 0}, {0, 0}};
    static const uint32_t indices[6] = {0, 1, 2, 0, 2, 3};
    vd_texture_filter filter = VD_TEXTURE_ANISOTROPIC;
    for (int f = 0; f < VD_TEXTURE_FILTER_COUNT && argc > 2; f++) {
        if (strcmp(argv[2], vd_texture_filter_name((vd_texture_filter)f)) == 0) {
            filter = (vd_texture_filter)f;
        }
    }
    vd_mesh_def mesh_def = vd_mesh_def_default();
    mesh_def.vertex_count = 4;
    mesh_def.positions = positions[0];
    mesh_def.uvs = uvs[0];
    mesh_def.index_count = 6;
    mesh_def.indices = indices;

    vd_context *context = NULL;
    vd_mesh *mesh = NULL;
    vd_texture *texture = NULL;
    vd_status status = vd_context_create(NULL, &context);
    if (status.code == VD_OK) {
        status = vd_mesh_create(context, &mesh_def, &mesh);
    }
    if (status.code == VD_OK) {
        status = make_texture(context, &texture);
    }
    if (status.code == VD_OK) {
        status = draw(context, mesh, texture, filter, argc > 1 ? argv[1] : "textured_plane.png");
    }
    if (status.code != VD_OK) {
        fprintf(stderr, "textured_plane: %s\n", status.message);
    }
    vd_texture_destroy(&texture);
    if (context != NULL) {
        vd_mesh_destroy(context, &mesh);
        vd_context_destroy(&context);
    }
    return status.code == VD_OK ? 0 : 1;
}

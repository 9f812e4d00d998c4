/* several_objects.c: several objects in one frame, each with another of the shaders that are there:
 * depth, flat, normals, lit.
 *
 *   several_objects [OUT.png]
 */
#include <stdio.h>
#include <veduta/veduta.h>

/* An octahedron whose faces are split in four again and again, pushed out onto a sphere. */
enum { SPLITS = 4, TRIANGLES = 8 << (2 * SPLITS) };

static void split(const vd_vec3 corners[3], int times, float (*out)[3], size_t *count) {
    if (times == 0) {
        for (int i = 0; i < 3; i++, ++*count) {
            out[*count][0] = (float)corners[i].x;
            out[*count][1] = (float)corners[i].y;
            out[*count][2] = (float)corners[i].z;
        }
        return;
    }
    vd_vec3 middle[3];
    for (int i = 0; i < 3; i++) {
        middle[i] = vd_vec3_normalize(vd_vec3_add(corners[i], corners[(i + 1) % 3]));
    }
    for (int i = 0; i < 3; i++) {
        const vd_vec3 part[3] = {corners[i], middle[i], middle[(i + 2) % 3]};
        split(part, times - 1, out, count);
    }
    split(middle, times - 1, out, count);
}

static void make_ball(float (*out)[3]) {
    size_t count = 0;
    for (int octant = 0; octant < 8; octant++) {
        const double x = octant & 1 ? -1 : 1, y = octant & 2 ? -1 : 1, z = octant & 4 ? -1 : 1;
        vd_vec3 face[3] = {{x, 0, 0}, {0, y, 0}, {0, 0, z}};
        if (x * y * z < 0) { /* counter-clockwise from outside */
            const vd_vec3 swap = face[1];
            face[1] = face[2];
            face[2] = swap;
        }
        split(face, SPLITS, out, &count);
    }
}

static vd_status draw(vd_raster *raster, const vd_mesh *mesh, vd_frame *frame) {
    static const vd_shading shadings[4] = {VD_SHADING_DEPTH, VD_SHADING_FLAT, VD_SHADING_NORMALS,
                                           VD_SHADING_PHONG};
    const vd_depth_range range = {1.0f / 6.2f, 1.0f / 9.0f}; /* near over distance */
    vd_draw draws[4];
    for (int i = 0; i < 4; i++) {
        draws[i] = vd_draw_default();
        draws[i].mesh = mesh;
        draws[i].shader = vd_shader_find(shadings[i]);
        draws[i].uniforms = i == 0 ? &range : NULL;
        draws[i].world_from_mesh = vd_matrix_translation(vd_vec3_make(2.15 * i - 3.2, 0.4 * i, 0));
        draws[i].object_id = 1 + (uint64_t)i;
    }
    const vd_camera camera = {.eye = {0, -7.5, 0},
                              .orientation = vd_orientation_from_angles(0, 0, 0),
                              .lens = vd_lens_from_fov(0.4, frame->width, frame->height),
                              .near_m = 1.0};
    vd_raster_def def = vd_raster_def_default();
    def.samples = 4;
    def.background = (vd_rgba8){20, 24, 32, 255};
    return vd_raster_render(raster, NULL, &def, &camera, draws, 4, frame, NULL);
}

int main(int argc, char **argv) {
    static float positions[TRIANGLES * 3][3];
    make_ball(positions);
    vd_mesh_def mesh_def = vd_mesh_def_default();
    mesh_def.vertex_count = (size_t)TRIANGLES * 3;
    mesh_def.positions = positions[0];
    mesh_def.normals = positions[0]; /* on a unit ball they are the same */

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
        status = vd_frame_create(context, 960, 320, 0, &frame);
    }
    if (status.code == VD_OK) {
        status = draw(raster, mesh, frame);
    }
    if (status.code == VD_OK) {
        status = vd_frame_save_png(frame, argc > 1 ? argv[1] : "several_objects.png", NULL);
    }
    if (status.code != VD_OK) {
        fprintf(stderr, "several_objects: %s\n", status.message);
    }
    vd_frame_destroy(&frame);
    vd_raster_destroy(&raster);
    if (context != NULL) {
        vd_mesh_destroy(context, &mesh);
        vd_context_destroy(&context);
    }
    return status.code == VD_OK ? 0 : 1;
}

/* All methods give the bytes of the brute-force reference, at every SIMD level and thread count. */
#include "raster_scenes.h"

static void random_soup(vd_context *context, int width, int height, int samples, size_t triangles,
                        uint64_t seed) {
    float *positions = malloc(triangles * 9 * sizeof *positions);
    random_triangles(&seed, width, height, positions, triangles);
    vd_mesh *mesh = soup(context, positions, triangles * 3);
    vd_draw draw = vd_draw_default();
    draw.mesh = mesh;
    draw.cull = VD_CULL_NONE;
    draw.shader = vd_shader_find(VD_SHADING_ID);
    vd_camera camera = flat_camera();
    vd_raster_def def = vd_raster_def_default();
    def.samples = samples;
    def.background = (vd_rgba8){40, 80, 120, 200};
    compare_all(&def, &camera, &draw, 1, width, height);
    if (samples == 1) { /* depth alone goes a shorter way */
        draw.shader = vd_shader_find(VD_SHADING_DEPTH);
        compare_all(&def, &camera, &draw, 1, width, height);
    }
    vd_mesh_destroy(context, &mesh);
    free(positions);
}

static void random_triangles_agree(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    static const int sizes[][2] = {{1, 1}, {2, 7}, {64, 64}, {65, 63}, {200, 131}, {130, 400}};
    for (size_t i = 0; i < sizeof sizes / sizeof sizes[0]; i++) {
        random_soup(context, sizes[i][0], sizes[i][1], 1, test_is_reduced() ? 60 : 1500, 77 + i);
        random_soup(context, sizes[i][0], sizes[i][1], i % 2 == 0 ? 4 : 8,
                    test_is_reduced() ? 25 : 150, 99 + i);
    }
    vd_context_destroy(&context);
}

/* Whatever the bench sets: bins, fine tiles, tiles and what is small change no byte. */
static void sizes_change_nothing(void **state) {
    (void)state;
    static const int sizes[][4] = {/* bin, fine, tile, small */
                                   {16, 4, 16, 1},   {64, 4, 32, 32},    {32, 8, 128, 256},
                                   {128, 8, 256, 7}, {256, 16, 64, 500}, {16, 16, 16, 100000}};
    vd_context *context = test_context(2, VD_ISA_AUTO);
    enum { WIDTH = 300, HEIGHT = 170, TRIANGLES = 400 };
    const size_t count = test_is_reduced() ? 60 : TRIANGLES;
    float positions[9 * TRIANGLES];
    uint64_t seed = 5;
    random_triangles(&seed, WIDTH, HEIGHT, positions, count);
    vd_mesh *mesh = soup(context, positions, count * 3);
    vd_draw draw = vd_draw_default();
    draw.mesh = mesh;
    draw.cull = VD_CULL_NONE;
    draw.shader = vd_shader_find(VD_SHADING_ID);
    const vd_camera camera = flat_camera();
    vd_raster_def def = vd_raster_def_default();
    vd_frame *expected = draw_frame(context, &def, &camera, &draw, 1, WIDTH, HEIGHT, NULL);
    for (size_t i = 0; i < sizeof sizes / sizeof sizes[0]; i++) {
        for (int m = 0; m < VD_RASTER_METHOD_COUNT; m++) {
            def.method = (vd_raster_method)m;
            def.bin_pixels = sizes[i][0];
            def.fine_pixels = sizes[i][1];
            def.tile_pixels = sizes[i][2];
            def.small_pixels = sizes[i][3];
            vd_frame *frame = draw_frame(context, &def, &camera, &draw, 1, WIDTH, HEIGHT, NULL);
            assert_same_frames(frame, expected);
            vd_frame_destroy(&frame);
        }
    }
    vd_frame_destroy(&expected);
    vd_mesh_destroy(context, &mesh);
    vd_context_destroy(&context);
}

static void spheres_agree(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    vd_mesh *near =
        sphere(context, 20, 40, 1.0, vd_vec3_make(0.1, 0, 1.2)); /* through the near plane */
    const int part = test_is_reduced() ? 2 : 1;
    vd_mesh *far = sphere(context, 60 / part, 80 / part, 1.0, vd_vec3_make(0.5, 0.3, 4));
    static const vd_shading shadings[] = {VD_SHADING_PHONG, VD_SHADING_FLAT,    VD_SHADING_DEPTH,
                                          VD_SHADING_UV,    VD_SHADING_NORMALS, VD_SHADING_ID};
    const vd_camera camera = plain_camera(150, 100, 90.0, 0.5);
    for (size_t i = 0; i < sizeof shadings / sizeof shadings[0]; i++) {
        vd_draw draws[3] = {vd_draw_default(), vd_draw_default(), vd_draw_default()};
        for (int k = 0; k < 3; k++) {
            draws[k].mesh = k == 0 ? near : far;
            draws[k].shader = vd_shader_find(shadings[(i + (size_t)k) % 6]);
            draws[k].cull = k == 0 ? VD_CULL_NONE : VD_CULL_BACK;
            draws[k].object_id = 10 + (uint64_t)k;
        }
        draws[2].fill = i % 2 == 0 ? VD_FILL_WIREFRAME : VD_FILL_POINTS;
        draws[2].line_width = 1.5;
        draws[2].point_size = 3.0;
        vd_raster_def def = vd_raster_def_default();
        def.samples = i % 3 == 0 ? 1 : i % 3 == 1 ? 4 : 8;
        def.far_m = i % 2 == 0 ? 0.0 : 4.2;
        compare_all(&def, &camera, draws, 3, 150, 100);
    }
    vd_mesh_destroy(context, &near);
    vd_mesh_destroy(context, &far);
    vd_context_destroy(&context);
}

/* Phong goes a way of its own: one surface and several, both projections, lights of all numbers. */
static void lit_surfaces_agree(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    vd_mesh *coarse = sphere(context, 7, 9, 1.0, vd_vec3_make(0, 0.1, 3));
    vd_mesh *near = sphere(context, 12, 16, 1.0, vd_vec3_make(0.1, 0, 1.2));
    const int part = test_is_reduced() ? 2 : 1;
    vd_mesh *fine = sphere(context, 70 / part, 90 / part, 0.4, vd_vec3_make(0.3, 0.2, 2));
    vd_material materials[2] = {vd_material_default(), vd_material_default()};
    vd_phong phong = vd_phong_default();
    for (int round = 0; round < 8; round++) {
        vd_draw draws[3] = {vd_draw_default(), vd_draw_default(), vd_draw_default()};
        for (int k = 0; k < 3; k++) {
            draws[k].mesh = k == 0 ? (round % 4 == 3 ? near : coarse) : k == 1 ? fine : near;
            draws[k].shader = vd_shader_find(VD_SHADING_PHONG);
            draws[k].cull = VD_CULL_NONE;
            draws[k].materials = &materials[k % 2];
            draws[k].material_count = 1;
            draws[k].uniforms = round < 2 ? NULL : &phong;
        }
        phong.light_count = round % 5;
        phong.lights[2] = phong.lights[0];
        phong.lights[3] = phong.lights[1];
        phong.lights[2].direction[1] = 0.9f;
        materials[1].alpha = round == 6 ? 0.5f : 1.0f;
        materials[1].shininess = (float)(5 * round);
        materials[1].emission = (vd_linear){0.1f, 0.0f, 0.02f};
        vd_camera camera = plain_camera(140, 90, round % 4 == 3 ? 90.0 : 120.0, 0.5);
        if (round % 2 == 0) {
            camera.projection = VD_PROJECTION_ORTHOGRAPHIC;
            camera.lens = (vd_lens){40, 40, 70, 45};
            camera.far_m = 6.0;
        }
        vd_raster_def def = vd_raster_def_default();
        def.samples = round == 7 ? 4 : 1;
        compare_all(&def, &camera, draws, round < 5 ? 1 + round % 2 : 3, 140, 90);
    }
    vd_mesh_destroy(context, &coarse);
    vd_mesh_destroy(context, &near);
    vd_mesh_destroy(context, &fine);
    vd_context_destroy(&context);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(random_triangles_agree),
        cmocka_unit_test(sizes_change_nothing),
        cmocka_unit_test(spheres_agree),
        cmocka_unit_test(lit_surfaces_agree),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

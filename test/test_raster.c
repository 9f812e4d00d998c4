/* Drawing meshes: coverage, depth order, culling, shading, bad input. */
#include "raster_scenes.h"

static vd_raster_def reference_def(void) {
    vd_raster_def def = vd_raster_def_default();
    def.method = VD_RASTER_REFERENCE;
    def.background = (vd_rgba8){0, 0, 0, 255};
    return def;
}

static void a_triangle_is_drawn(void **state) {
    (void)state;
    vd_context *context = test_context(2, VD_ISA_AUTO);
    const float p[9] = {1, 1, 0.5f, 1, 9, 0.5f, 9, 1, 0.25f};
    vd_mesh *mesh = soup(context, p, 3);
    vd_draw draw = vd_draw_default();
    draw.mesh = mesh;
    draw.shader = vd_shader_find(VD_SHADING_DEPTH);
    vd_camera camera = flat_camera();
    vd_raster_def def = reference_def();
    vd_raster_stats stats;
    vd_frame *frame = draw_frame(context, &def, &camera, &draw, 1, 10, 10, &stats);
    assert_int_equal(stats.hits, 28); /* 7 + 6 + … + 1: the centres on the diagonal are not its */
    assert_int_equal(stats.primitives, 1);
    assert_int_equal(frame->id[1 * frame->stride + 1], 1);
    assert_int_equal(frame->id[0], 0);
    const float z = frame->depth[1 * frame->stride + 1];
    assert_true(fabsf(z - (0.5f + 0.25f / 16)) < 1e-6f);
    const uint8_t *pixel = frame->rgba + 4 * (frame->stride + 1);
    assert_int_equal(pixel[0], (int)(255.0f * z * z * z + 0.5f));
    assert_int_equal(pixel[3], 255);
    vd_frame_destroy(&frame);
    draw.cull = VD_CULL_FRONT;
    frame = draw_frame(context, &def, &camera, &draw, 1, 10, 10, &stats);
    assert_int_equal(stats.hits, 0);
    assert_int_equal(vd_raster_explain_empty(&def, &camera, &draw, 1, 10, 10).code, VD_ERROR_EMPTY);
    vd_frame_destroy(&frame);
    vd_mesh_destroy(context, &mesh);
    vd_context_destroy(&context);
}

static void a_lit_sphere_is_round(void **state) {
    (void)state;
    vd_context *context = test_context(2, VD_ISA_AUTO);
    vd_mesh *mesh = sphere(context, 24, 48, 1.0, vd_vec3_make(0, 0, 5));
    vd_draw draw = vd_draw_default();
    draw.mesh = mesh;
    draw.winding = VD_WINDING_EITHER;
    vd_camera camera = plain_camera(64, 64, 100.0, 0.1);
    vd_raster_def def = reference_def();
    vd_raster_stats stats;
    for (int samples = 1; samples <= 8; samples = samples == 1 ? 4 : samples + 4) {
        def.samples = samples;
        vd_frame *frame = draw_frame(context, &def, &camera, &draw, 1, 64, 64, &stats);
        const double radius2 = 100.0 * 100.0 / 24.0; /* of the outline: f / sqrt(d² − r²) */
        const double area = 3.14159265 * radius2 * samples;
        assert_true(fabs((double)stats.hits - area) < 0.03 * area);
        const size_t middle = 32 * frame->stride + 32;
        assert_true(fabsf(frame->depth[middle] - 0.1f / 4.0f) < 1e-4f);
        assert_true(frame->rgba[4 * middle] > 20);
        vd_frame_destroy(&frame);
    }
    vd_mesh_destroy(context, &mesh);
    vd_context_destroy(&context);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_triangle_is_drawn),
        cmocka_unit_test(a_lit_sphere_is_round),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

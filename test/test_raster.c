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

/* ---- bad input --------------------------------------------------------------------------------*/

static void expect_bad_mesh(vd_context *context, const vd_mesh_def *def, vd_code code,
                            const char *word) {
    vd_mesh *mesh = NULL;
    const vd_status status = vd_mesh_create(context, def, &mesh);
    assert_int_equal(status.code, code);
    assert_non_null(strstr(status.message, word));
    assert_null(mesh);
}

static void bad_meshes_are_refused(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    float p[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
    uint32_t indices[4] = {0, 1, 2, 3};
    vd_mesh_def good = vd_mesh_def_default();
    good.vertex_count = 3;
    good.positions = p;
    good.indices = indices;
    good.index_count = 3;
    vd_mesh_def def = good;
    def.index_count = 2;
    expect_bad_mesh(context, &def, VD_ERROR_ARGUMENT, "multiple of 3");
    def = good;
    indices[2] = 3;
    expect_bad_mesh(context, &def, VD_ERROR_ARGUMENT, "index 2 of the mesh is 3");
    indices[2] = 2;
    p[4] = NAN;
    expect_bad_mesh(context, &def, VD_ERROR_ARGUMENT, "position of vertex 1");
    p[4] = 0;
    def.positions = NULL;
    expect_bad_mesh(context, &def, VD_ERROR_ARGUMENT, "no positions");
    def = good;
    def.anchor.y = INFINITY;
    expect_bad_mesh(context, &def, VD_ERROR_ARGUMENT, "anchor");
    def = good;
    def.vertex_count = (size_t)1 << 40;
    expect_bad_mesh(context, &def, VD_ERROR_LIMIT, "too large");
    def = good;
    def.extra_count = 40;
    def.extra = p;
    expect_bad_mesh(context, &def, VD_ERROR_ARGUMENT, "extra");
    def = good;
    const vd_mesh_part gap[2] = {{0, 0, 0}, {1, 1, 0}};
    def.parts = gap;
    def.part_count = 2;
    expect_bad_mesh(context, &def, VD_ERROR_ARGUMENT, "begins at primitive 1");
    def.topology = VD_TOPOLOGY_COUNT;
    expect_bad_mesh(context, &def, VD_ERROR_ARGUMENT, "topology");
    vd_context_destroy(&context);
}

/* One field wrong, in a definition that is right otherwise. */
static void bad_draws_are_refused(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    const float p[9] = {1, 1, 0, 1, 9, 0, 9, 1, 0};
    vd_mesh *mesh = soup(context, p, 3);
    vd_raster *raster = NULL;
    vd_frame *frame = NULL;
    assert_ok(vd_raster_create(context, &raster));
    assert_ok(vd_frame_create(context, 8, 8, 0, &frame));
    vd_material material = vd_material_default();
    const vd_shader many = {.varying_count = 1000};
    for (int wrong = 0; wrong <= 13; wrong++) {
        vd_draw draw = vd_draw_default();
        vd_raster_def def = vd_raster_def_default();
        vd_camera camera = flat_camera();
        draw.mesh = wrong == 0 ? NULL : mesh;
        draw.world_from_mesh.m[1][2] = wrong == 1 ? (double)NAN : 0.0;
        draw.cull = wrong == 2 ? VD_CULL_COUNT : VD_CULL_BACK;
        draw.line_width = wrong == 3 ? -1.0 : 1.0;
        draw.material_count = wrong == 4 ? 3 : 0;
        draw.shader = wrong == 5 ? vd_shader_find(VD_SHADING_NORMALS) : wrong == 6 ? &many : NULL;
        def.samples = wrong == 7 ? 2 : 1;
        def.method = wrong == 8 ? VD_RASTER_METHOD_COUNT : VD_RASTER_AUTO;
        def.far_m = wrong == 9 ? -1.0 : 0.0;
        camera.near_m = wrong == 10 ? (double)NAN : camera.near_m;
        def.tile_pixels = wrong == 11 ? 48 : 0;
        def.fine_pixels = wrong == 13 ? 8 : 0; /* in bins of 0 */
        if (wrong == 12) {
            material.alpha_test = 1.5f;
            draw.materials = &material;
            draw.material_count = 1;
        }
        const vd_status status =
            vd_raster_render(raster, NULL, &def, &camera, &draw, 1, frame, NULL);
        assert_int_equal(status.code, VD_ERROR_ARGUMENT);
        assert_true(strlen(status.message) > 20);
    }
    for (uint64_t i = 0; i < 100; i++) { /* the frame's table of ids grows */
        vd_draw draw = vd_draw_default();
        const vd_raster_def def = vd_raster_def_default();
        const vd_camera camera = flat_camera();
        draw.mesh = mesh;
        draw.object_id = 100 + i;
        const vd_status status =
            vd_raster_render(raster, NULL, &def, &camera, &draw, 1, frame, NULL);
        assert_int_equal(status.code, VD_OK);
        assert_int_equal(frame->object_count, i + 2);
    }
    vd_frame_destroy(&frame);
    vd_raster_destroy(&raster);
    vd_mesh_destroy(context, &mesh);
    vd_context_destroy(&context);
}

static void degenerate_meshes_draw_nothing(void **state) {
    (void)state;
    vd_context *context = test_context(2, VD_ISA_AUTO);
    enum { COUNT = 300000 };
    float *p = malloc(COUNT * 3 * sizeof *p);
    for (size_t i = 0; i < COUNT; i++) { /* points, lines, and what is too large for floats */
        p[3 * i] = i % 9 < 3 ? 5.0f : i % 9 < 6 ? (float)(i % 3) : 3e38f;
        p[3 * i + 1] = i % 9 < 6 ? p[3 * i] : -3e38f;
        p[3 * i + 2] = 0.5f;
    }
    vd_mesh *mesh = soup(context, p, COUNT);
    vd_mesh *none = soup(context, p, 0);
    vd_draw draw = vd_draw_default();
    draw.mesh = mesh;
    draw.cull = VD_CULL_NONE;
    const vd_camera camera = flat_camera();
    vd_raster_def def = vd_raster_def_default();
    vd_raster_stats stats;
    for (int m = 0; m < VD_RASTER_METHOD_COUNT; m++) {
        def.method = (vd_raster_method)m;
        def.tile_pixels = 16;
        vd_frame *frame = draw_frame(context, &def, &camera, &draw, 1, 16, 16, &stats);
        assert_int_equal(stats.hits, 0);
        vd_frame_destroy(&frame);
    }
    vd_draw empty = draw;
    empty.mesh = none;
    vd_frame *frame = draw_frame(context, &def, &camera, &empty, 1, 16, 16, &stats);
    assert_int_equal(stats.hits, 0);
    assert_non_null(
        strstr(vd_raster_explain_empty(&def, &camera, &empty, 1, 16, 16).message, "no triangle"));
    vd_frame_destroy(&frame);
    frame = draw_frame(context, &def, &camera, NULL, 0, 16, 16, &stats);
    assert_int_equal(stats.primitives, 0);
    vd_frame_destroy(&frame);
    vd_mesh_destroy(context, &mesh);
    vd_mesh_destroy(context, &none);
    vd_context_destroy(&context);
    free(p);
}

/* ---- memory -----------------------------------------------------------------------------------*/

/* Makes a mesh and a picture of it in every way. */
static vd_status draw_everything(vd_context *context) {
    const float p[18] = {1, 1, 0.5f, 1, 900, 0.5f, 900, 1, 0.25f,
                         2, 2, 0.1f, 2, 4,   0.1f, 4,   2, 0.1f};
    vd_mesh_def mesh_def = vd_mesh_def_default();
    mesh_def.vertex_count = 6;
    mesh_def.positions = p;
    mesh_def.compute_normals = true;
    vd_mesh *mesh = NULL;
    vd_raster *raster = NULL;
    vd_frame *frame = NULL;
    const vd_camera camera = flat_camera();
    vd_status status = vd_mesh_create(context, &mesh_def, &mesh);
    if (status.code == VD_OK) {
        status = vd_raster_create(context, &raster);
    }
    if (status.code == VD_OK) {
        status = vd_frame_create(context, 40, 40, 0, &frame);
    }
    for (int m = 0; m < VD_RASTER_METHOD_COUNT && status.code == VD_OK; m++) {
        vd_raster_def def = vd_raster_def_default();
        def.method = (vd_raster_method)m;
        def.samples = m % 2 == 0 ? 1 : 4;
        vd_draw draw = vd_draw_default();
        draw.mesh = mesh;
        vd_material material = vd_material_default();
        material.blend = m >= VD_RASTER_TILED;
        draw.materials = &material;
        draw.material_count = 1;
        status = vd_raster_render(raster, NULL, &def, &camera, &draw, 1, frame, NULL);
    }
    vd_frame_destroy(&frame);
    vd_raster_destroy(&raster);
    vd_mesh_destroy(context, &mesh);
    return status;
}

static void every_allocation_may_fail(void **state) {
    (void)state;
    for (int n = 1;; n++) {
        test_allocator allocator = {0, 0, 0};
        vd_context *context = test_failing_context(&allocator);
        const int before = allocator.live;
        allocator.fail_at = allocator.calls + n;
        const vd_status status = draw_everything(context);
        assert_true(status.code == VD_OK || status.code == VD_ERROR_MEMORY);
        assert_int_equal(allocator.live, before);
        vd_context_destroy(&context);
        if (status.code == VD_OK) {
            assert_true(n > 20);
            return;
        }
    }
}

static void a_warm_frame_allocates_nothing(void **state) {
    (void)state;
    vd_context *context = test_context(2, VD_ISA_AUTO);
    vd_mesh *mesh = sphere(context, 40, 80, 1.0, vd_vec3_make(0, 0, 4));
    vd_raster *raster = NULL;
    vd_frame *frame = NULL;
    assert_ok(vd_raster_create(context, &raster));
    assert_ok(vd_frame_create(context, 200, 150, VD_PLANE_DEPTH, &frame));
    vd_draw draw = vd_draw_default();
    draw.mesh = mesh;
    vd_material material = vd_material_default();
    draw.materials = &material;
    draw.material_count = 1;
    const vd_camera camera = plain_camera(200, 150, 180.0, 0.1);
    for (int round = 0; round < 3 * VD_RASTER_REFERENCE; round++) {
        vd_raster_def def = vd_raster_def_default();
        def.method = (vd_raster_method)(round / 3);
        material.blend = round % 3 == 1;
        material.alpha_test = round % 3 == 2 ? 0.5f : 0.0f;
        uint64_t before = 0;
        for (int i = 0; i < 20; i++) { /* threads may share the work differently at first */
            before = vd_context_memory(context).allocations;
            assert_ok(vd_raster_render(raster, NULL, &def, &camera, &draw, 1, frame, NULL));
        }
        assert_int_equal(vd_context_memory(context).allocations, before);
    }
    vd_frame_destroy(&frame);
    vd_raster_destroy(&raster);
    vd_mesh_destroy(context, &mesh);
    vd_context_destroy(&context);
}

/* ---- shaders of one's own ---------------------------------------------------------------------*/

/* Moves vertices, and hands on a colour as bytes and as floats. */
static void move_vertices(const vd_vertices *v) {
    const float *offset = v->uniforms;
    for (int i = 0; i < VD_BATCH; i++) {
        for (int r = 0; r < 4; r++) {
            const float *m = v->view->picture_from_mesh[r];
            v->picture[r][i] = m[0] * (v->position[0][i] + offset[0]) +
                               (m[1] * v->position[1][i] + (m[2] * v->position[2][i] + m[3]));
        }
        v->varyings[0][i] = v->attributes[0][i];
        ((double *)v->user)[i] = (double)v->attributes[0][i];
    }
}

static void add_double(void *out, const void *a, const void *b) {
    *(double *)out = *(const double *)a + *(const double *)b;
}

static void scale_double(void *out, const void *a, float factor) {
    *(double *)out = *(const double *)a * (double)factor;
}

static void show_both(const vd_fragments *f) {
    for (int i = 0; i < VD_BATCH; i++) {
        f->color[0][i] = f->varyings[0][i];
        f->color[1][i] = (float)((const double *)f->user)[i];
    }
}

static void shaders_may_be_ones_own(void **state) {
    (void)state;
    static const vd_shader shader = {.vertex = move_vertices,
                                     .fragment = show_both,
                                     .varying_count = 1,
                                     .user_bytes = sizeof(double),
                                     .user_add = add_double,
                                     .user_scale = scale_double};
    vd_context *context = test_context(2, VD_ISA_AUTO);
    const float p[9] = {1, 1, 0.5f, 1, 99, 0.5f, 99, 1, 0.25f}, extra[3] = {0.0f, 0.5f, 1.0f};
    vd_mesh_def mesh_def = vd_mesh_def_default();
    mesh_def.vertex_count = 3;
    mesh_def.positions = p;
    mesh_def.extra = extra;
    mesh_def.extra_count = 1;
    vd_mesh *mesh = NULL;
    assert_ok(vd_mesh_create(context, &mesh_def, &mesh));
    const float offset[1] = {10.0f};
    vd_draw draw = vd_draw_default();
    draw.mesh = mesh;
    draw.shader = &shader;
    draw.uniforms = offset;
    const vd_camera camera = flat_camera();
    const vd_raster_def def = vd_raster_def_default();
    vd_frame *frame = draw_frame(context, &def, &camera, &draw, 1, 110, 100, NULL);
    assert_int_equal(frame->id[50 * frame->stride + 5], 0); /* moved to the right */
    for (int y = 2; y < 90; y += 7) {
        for (int x = 12; x + y < 105; x += 5) {
            const uint8_t *c = frame->rgba + 4 * ((size_t)y * frame->stride + (size_t)x);
            const double wanted = 255 * ((x + 0.5 - 11) / 98 + 0.5 * (y + 0.5 - 1) / 98);
            assert_true(fabs(c[0] - wanted) <= 1.0);
            assert_true(abs(c[0] - c[1]) <= 1);
        }
    }
    vd_frame_destroy(&frame);
    vd_mesh_destroy(context, &mesh);
    vd_context_destroy(&context);
}

static void matrices_move_and_turn(void **state) {
    (void)state;
    const vd_quat quarter = vd_quat_from_axis_angle(vd_vec3_make(0, 0, 1), 1.5707963267948966);
    const vd_quat none = {0, 0, 0, 1};
    const vd_matrix rotation = vd_matrix_rotation(quarter);
    const vd_matrix move = vd_matrix_translation(vd_vec3_make(1, 2, 3));
    const vd_matrix both = vd_matrix_multiply(&move, &rotation);
    const vd_vec3 p = vd_matrix_transform(&both, vd_vec3_make(1, 0, 0));
    assert_true(fabs(p.x - 1) < 1e-12 && fabs(p.y - 3) < 1e-12 && fabs(p.z - 3) < 1e-12);
    /* Half way of a quarter turn is an eighth, by either sign of the quaternion. */
    for (int sign = -1; sign <= 1; sign += 2) {
        const vd_quat b = {sign * quarter.x, sign * quarter.y, sign * quarter.z, sign * quarter.w};
        const vd_vec3 v = vd_quat_rotate(vd_quat_slerp(none, b, 0.5), vd_vec3_make(1, 0, 0));
        assert_true(fabs(v.x - sqrt(0.5)) < 1e-12 && fabs(v.y - sqrt(0.5)) < 1e-12);
    }
    /* A normal stays at right angles to its surface under shear and mirroring. */
    vd_matrix shear = vd_matrix_shearing(0.5, 0, 0, 0.25, 0, 0);
    const vd_matrix scale = vd_matrix_scaling(vd_vec3_make(-2, 3, 0.5));
    shear = vd_matrix_multiply(&shear, &scale);
    const vd_matrix normal = vd_matrix_normal(&shear);
    const vd_vec3 u = {1, 2, 0}, v = {0, 1, 5}, n = vd_vec3_cross(u, v);
    const vd_vec3 moved = vd_matrix_transform(&normal, n);
    assert_true(fabs(vd_vec3_dot(moved, vd_matrix_transform(&shear, u))) < 1e-9);
    assert_true(fabs(vd_vec3_dot(moved, vd_matrix_transform(&shear, v))) < 1e-9);
    assert_true(vd_vec3_dot(moved, vd_matrix_transform(&shear, n)) > 0);
    /* The camera's matrix is its projection. */
    for (int projection = 0; projection < VD_PROJECTION_COUNT; projection++) {
        vd_camera camera = {.eye = {100, 200, 300},
                            .orientation = vd_orientation_from_angles(0.3, -0.2, 0.1),
                            .projection = (vd_projection)projection,
                            .lens = {50, 60, 20, 90},
                            .near_m = 0.5,
                            .far_m = 100};
        const vd_vec3 point = {105, 230, 290};
        double x, y, z;
        assert_true(vd_camera_project(&camera, point, &x, &y, &z));
        const vd_matrix m = vd_camera_matrix(&camera);
        const vd_vec3 r = vd_vec3_subtract(point, camera.eye);
        double h[4];
        for (int i = 0; i < 4; i++) {
            h[i] = m.m[i][0] * r.x + m.m[i][1] * r.y + m.m[i][2] * r.z + m.m[i][3];
        }
        assert_true(fabs(h[0] / h[3] - x) < 1e-9 && fabs(h[1] / h[3] - y) < 1e-9);
        assert_true(fabs(h[2] / h[3] - (double)vd_camera_depth(&camera, z)) < 1e-7);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_triangle_is_drawn),
        cmocka_unit_test(a_lit_sphere_is_round),
        cmocka_unit_test(bad_meshes_are_refused),
        cmocka_unit_test(bad_draws_are_refused),
        cmocka_unit_test(degenerate_meshes_draw_nothing),
        cmocka_unit_test(every_allocation_may_fail),
        cmocka_unit_test(a_warm_frame_allocates_nothing),
        cmocka_unit_test(shaders_may_be_ones_own),
        cmocka_unit_test(matrices_move_and_turn),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

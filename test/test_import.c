/* test_import.c: models through assimp. */
#include "support.h"

#include <math.h>
#include <stdio.h>
#include <veduta/model_import.h>

#define MODELS VEDUTA_SOURCE_DIR "/test/models/"

static vd_model *import(vd_context *context, const char *name) {
    char path[512];
    vd_model *model = NULL;
    (void)snprintf(path, sizeof path, "%s%s", MODELS, name);
    assert_ok(vd_model_import(context, path, NULL, &model));
    return model;
}

/* Nodes are flattened: one cube moved, one turned, halved and mirrored. Normals of the file point
 * outwards, also on the mirrored one, and its triangles go round the right way. */
static void test_nodes(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    vd_model *model = import(context, "cube.glb");
    const vd_mesh *mesh = model->meshes[VD_TOPOLOGY_TRIANGLES];
    assert_non_null(mesh);
    assert_int_equal(mesh->primitive_count, 24);
    assert_int_equal(mesh->vertex_count, 48);
    assert_false(model->computed_normals || model->z_up);
    const float *normals = vd_mesh_attributes(mesh, 0);
    for (uint32_t t = 0; t < mesh->primitive_count; t++) {
        vd_vec3 p[3];
        for (int k = 0; k < 3; k++) {
            const uint32_t v = vd_mesh_indices(mesh)[3 * t + (uint32_t)k];
            p[k] = vd_vec3_make((double)vd_mesh_positions(mesh, 0)[v],
                                (double)vd_mesh_positions(mesh, 1)[v],
                                (double)vd_mesh_positions(mesh, 2)[v]);
        }
        const vd_vec3 face = vd_vec3_normalize(
            vd_vec3_cross(vd_vec3_subtract(p[1], p[0]), vd_vec3_subtract(p[2], p[0])));
        const vd_vec3 middle = {p[0].x > 0.5 ? 1.5 : -1.5, 0.0, 0.0};
        assert_true(vd_vec3_dot(face, vd_vec3_subtract(p[0], middle)) > 0.0);
        const float *n = normals + 4 * (size_t)vd_mesh_indices(mesh)[3 * t];
        const vd_vec3 normal = {(double)n[0], (double)n[1], (double)n[2]};
        assert_true(vd_vec3_dot(face, normal) > 0.9999);
    }
    vd_model_destroy(&model);
    vd_context_destroy(&context);
}

static void test_materials(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    vd_model *model = import(context, "cube.glb");
    const vd_mesh *mesh = model->meshes[VD_TOPOLOGY_TRIANGLES];
    const uint32_t material = vd_mesh_parts(mesh)[0].material;
    const vd_model_surface *surface = &model->surfaces[material];
    assert_string_equal(surface->name, "crate");
    assert_int_equal(surface->alpha_mode, VD_ALPHA_MASK);
    assert_true(surface->alpha_cutoff == 0.5f);
    assert_int_equal(model->texture_count, 1);
    assert_ptr_equal(model->materials[material].texture, model->textures[0]);
    int width = 0, height = 0;
    (void)vd_texture_level_texels(model->textures[0], 0, &width, &height);
    assert_true(width == 16 && height == 16);
    /* glTF's texture coordinates are from the upper left, as ours: the first quad's first corner.
     */
    assert_true(mesh->uv == 3);
    const float *u = vd_mesh_attributes(mesh, 0), *v = vd_mesh_attributes(mesh, 1);
    assert_true(u[3] == 0.0f && v[0] == 1.0f);
    vd_model_destroy(&model);
    vd_context_destroy(&context);
}

/* STL gives each triangle vertices of its own; assimp's normals of a cube are one a face. */
static void test_stl(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    static const char *const names[] = {"cube.stl", "cube-ascii.stl"};
    for (int i = 0; i < 2; i++) {
        vd_model *model = import(context, names[i]);
        assert_true(model->z_up);
        assert_int_equal(model->meshes[VD_TOPOLOGY_TRIANGLES]->primitive_count, 12);
        vd_vec3 min, max;
        vd_model_bounds(model, &min, &max);
        assert_true(min.x == -1.0 && max.z == 1.0);
        vd_model_destroy(&model);
    }
    vd_context_destroy(&context);
}

/* Every allocation of ours may fail; what assimp allocates is its own. */
static void test_out_of_memory(void **state) {
    (void)state;
    bool done = false;
    for (int fail_at = 1; !done; fail_at++) {
        test_allocator allocator = {0, 0, 0};
        vd_context *context = test_failing_context(&allocator);
        const int live = allocator.live;
        allocator.fail_at = allocator.calls + fail_at;
        vd_model *model = NULL;
        vd_status status = vd_model_import(context, MODELS "cube.glb", NULL, &model);
        done = status.code == VD_OK;
        assert_true(done || status.code == VD_ERROR_MEMORY);
        vd_model_destroy(&model);
        assert_int_equal(allocator.live, live);
        allocator.fail_at = 0;
        vd_context_destroy(&context);
        assert_true(fail_at < 1000);
    }
}

static void test_bad(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    vd_model *model = NULL;
    vd_status status = vd_model_import(context, "nowhere.glb", NULL, &model);
    assert_int_equal(status.code, VD_ERROR_IO);
    status = vd_model_import(context, MODELS, NULL, &model);
    assert_int_equal(status.code, VD_ERROR_IO);
    status =
        vd_model_import(context, VEDUTA_SOURCE_DIR "/test/corpus/model/text.fbx", NULL, &model);
    assert_int_equal(status.code, VD_ERROR_FORMAT);
    assert_non_null(strstr(status.message, "assimp says"));
    assert_null(model);
    vd_context_destroy(&context);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_nodes),         cmocka_unit_test(test_materials),
        cmocka_unit_test(test_stl),           cmocka_unit_test(test_bad),
        cmocka_unit_test(test_out_of_memory),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

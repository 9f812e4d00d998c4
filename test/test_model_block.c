/* Models as blocks: there and back, and what is damaged. */
#include <veduta/model.h>
#include "raster_scenes.h"

static vd_model *load(vd_context *context, const char *name) {
    char path[512];
    vd_model *model = NULL;
    (void)snprintf(path, sizeof path, "%s/test/models/%s", VEDUTA_SOURCE_DIR, name);
    assert_ok(vd_model_load(context, path, NULL, &model));
    return model;
}

static vd_frame *draw_model(vd_context *context, const vd_model *model) {
    vd_draw draws[VD_TOPOLOGY_COUNT];
    const int count = vd_model_draws(model, draws);
    vd_raster_def def = vd_raster_def_default();
    def.samples = 4;
    vd_vec3 min, max;
    vd_model_bounds(model, &min, &max);
    const double size = vd_vec3_length(vd_vec3_subtract(max, min));
    vd_camera camera = {.near_m = 0.01 * size};
    camera.eye = vd_vec3_add(max, vd_vec3_make(size, -1.5 * size, size));
    camera.orientation =
        vd_orientation_look_at(camera.eye, vd_vec3_scale(vd_vec3_add(min, max), 0.5));
    camera.lens = vd_lens_from_fov(0.6, 90, 70);
    return draw_frame(context, &def, &camera, draws, count, 90, 70, NULL);
}

static const char *const names[] = {"cube.obj", "glass.obj", "cube-little.ply", "cloud.ply",
                                    "cube.off"};
enum { NAMES = sizeof names / sizeof names[0] };

static void blocks_draw_the_same(void **state) {
    (void)state;
    vd_context *context = test_context(2, VD_ISA_AUTO);
    for (int i = 0; i < NAMES; i++) {
        vd_model *model = load(context, names[i]), *back = NULL;
        const size_t size = vd_model_packed_bytes(model);
        assert_true(size % 64 == 0);
        uint8_t *block = vd_allocate(context, 1, size), *again = vd_allocate(context, 1, size);
        vd_model_pack(model, block);
        assert_ok(vd_model_unpack(context, block, size, &back));
        assert_string_equal(back->format, model->format);
        assert_int_equal(back->material_count, model->material_count);
        assert_int_equal(back->texture_count, model->texture_count);
        vd_model_pack(back, again); /* nothing was lost on the way */
        assert_int_equal(vd_model_packed_bytes(back), size);
        assert_memory_equal(again, block, size);
        vd_frame *a = draw_model(context, model), *b = draw_model(context, back);
        assert_same_frames(a, b);
        vd_frame_destroy(&a);
        vd_frame_destroy(&b);
        vd_release(context, block);
        vd_release(context, again);
        vd_model_destroy(&model);
        vd_model_destroy(&back);
    }
    vd_context_destroy(&context);
}

/* The checksum sees every change; behind it the numbers are looked at, too. */
static void damaged_blocks_are_refused(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    uint64_t random = 3;
    for (int i = 0; i < NAMES; i++) {
        vd_model *model = load(context, names[i]), *back = NULL;
        const size_t size = vd_model_packed_bytes(model);
        uint8_t *block = vd_allocate(context, 1, size + 64);
        vd_model_pack(model, block);
        assert_int_equal(vd_model_unpack(context, block + 8, size, &back).code, VD_ERROR_ARGUMENT);
        for (size_t cut = 0; cut < size; cut += 1 + size / 40) {
            assert_int_equal(vd_model_unpack(context, block, cut, &back).code, VD_ERROR_FORMAT);
        }
        for (int k = 0; k < 500; k++) {
            const size_t at = test_random(&random) % size;
            const uint8_t was = block[at];
            block[at] = (uint8_t)(was ^ (1 + test_random(&random) % 255));
            assert_int_equal(vd_model_unpack(context, block, size, &back).code, VD_ERROR_FORMAT);
            block[at] = was;
        }
        assert_null(back);
        vd_release(context, block);
        vd_model_destroy(&model);
    }
    vd_context_destroy(&context);
}

/* A mesh alone has no checksum: any byte may be changed, and what passes can be drawn. */
static void damaged_meshes_are_harmless(void **state) {
    (void)state;
    vd_context *context = test_context(1, VD_ISA_AUTO);
    vd_model *model = load(context, "glass.obj");
    const vd_mesh *mesh = model->meshes[VD_TOPOLOGY_TRIANGLES];
    const size_t size = mesh->size_bytes;
    vd_mesh *copy = vd_allocate(context, 1, size);
    uint64_t random = 8;
    int passed = 0;
    assert_ok(vd_mesh_validate(mesh, size));
    assert_int_equal(vd_mesh_validate((const uint8_t *)mesh + 4, size).code, VD_ERROR_ARGUMENT);
    for (int k = 0; k < 20000; k++) {
        memcpy(copy, mesh, size);
        /* Mostly the head, where offsets stand. */
        const size_t within = k % 3 == 0 ? size : sizeof *mesh;
        ((uint8_t *)copy)[test_random(&random) % within] = (uint8_t)test_random(&random);
        const vd_status status = vd_mesh_validate(copy, size);
        assert_true(status.code == VD_OK || status.code == VD_ERROR_FORMAT);
        for (size_t i = 0; status.code == VD_OK && i < copy->index_count; i++) {
            assert_true(vd_mesh_indices(copy)[i] < mesh->vertex_count);
        }
        passed += status.code == VD_OK;
    }
    assert_true(passed > 0 && passed < 15000);
    /* Behind the last primitive: it is read with that. */
    memcpy(copy, mesh, size);
    ((uint32_t *)(uintptr_t)vd_mesh_indices(copy))[copy->index_count + 5] = UINT32_MAX;
    assert_int_equal(vd_mesh_validate(copy, size).code, VD_ERROR_FORMAT);
    vd_release(context, copy);
    vd_model_destroy(&model);
    vd_context_destroy(&context);
}

static void memory_may_run_out(void **state) {
    (void)state;
    vd_context *keeper = test_context(1, VD_ISA_AUTO);
    vd_model *model = load(keeper, "cube.obj");
    const size_t size = vd_model_packed_bytes(model);
    uint8_t *block = vd_allocate(keeper, 1, size);
    vd_model_pack(model, block);
    for (int n = 1;; n++) {
        test_allocator allocator = {0};
        vd_context *context = test_failing_context(&allocator);
        vd_model *back = NULL;
        const int before = allocator.calls;
        allocator.fail_at = before + n;
        const vd_status status = vd_model_unpack(context, block, size, &back);
        allocator.fail_at = 0;
        if (status.code == VD_OK) {
            vd_model_destroy(&back);
        } else {
            assert_int_equal(status.code, VD_ERROR_MEMORY);
            assert_null(back);
        }
        vd_context_destroy(&context);
        assert_int_equal(allocator.live, 0);
        if (status.code == VD_OK) {
            assert_true(n > 5);
            break;
        }
    }
    vd_release(keeper, block);
    vd_model_destroy(&model);
    vd_context_destroy(&keeper);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(blocks_draw_the_same),
        cmocka_unit_test(damaged_blocks_are_refused),
        cmocka_unit_test(damaged_meshes_are_harmless),
        cmocka_unit_test(memory_may_run_out),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

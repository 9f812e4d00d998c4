/* fuzz_model.h: any bytes as a model: an error, or a model that is consistent. */
#ifndef VEDUTA_TEST_FUZZ_MODEL_H
#define VEDUTA_TEST_FUZZ_MODEL_H

#include <math.h>
#include <stdlib.h>
#include <veduta/model.h>

static inline void fuzz_check_mesh(const vd_model *model, const vd_mesh *mesh) {
    const uint32_t *indices = vd_mesh_indices(mesh);
    for (uint32_t i = 0; i < mesh->index_count; i++) {
        if (indices[i] >= mesh->vertex_count) {
            abort();
        }
    }
    for (uint32_t p = 0; p < mesh->part_count; p++) {
        if (vd_mesh_parts(mesh)[p].material >= (uint32_t)model->material_count) {
            abort();
        }
    }
    for (int axis = 0; axis < 3; axis++) {
        for (uint32_t i = 0; i < mesh->vertex_count; i++) {
            if (!isfinite(vd_mesh_positions(mesh, axis)[i])) {
                abort();
            }
        }
    }
}

static inline int fuzz_model(const char *name, const uint8_t *data, size_t size) {
    vd_context_def def = vd_context_def_default();
    def.threads = 1;
    vd_context *context = NULL;
    vd_model *model = NULL;
    const vd_model_def plain = {.skip_textures = true};
    if (vd_context_create(&def, &context).code != VD_OK) {
        return 0;
    }
    vd_status status = vd_model_decode(context, data, size, name, &plain, &model);
    if ((status.code == VD_OK) != (model != NULL)) {
        abort();
    }
    for (int i = 0; model != NULL && i < VD_TOPOLOGY_COUNT; i++) {
        if (model->meshes[i] != NULL) {
            fuzz_check_mesh(model, model->meshes[i]);
        }
    }
    vd_model_destroy(&model);
    vd_context_destroy(&context);
    return 0;
}

#endif

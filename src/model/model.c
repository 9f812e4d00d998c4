/* model.c: models as a whole: which reader a file belongs to, what is done with one. */
#include <string.h>
#include "core/file.h"
#include "model/model_build.h"

/* Beyond what a mesh's numbers hold in any format. */
#define FILE_LIMIT_BYTES (SIZE_MAX >> 28) /* 64 GiB */

vd_model_def vd_model_def_default(void) {
    return (vd_model_def){false};
}

void vd_model_destroy(vd_model **model_in_out) {
    if (model_in_out == NULL || *model_in_out == NULL) {
        return;
    }
    vd_model *model = *model_in_out;
    vd_context *context = model->context;
    *model_in_out = NULL;
    for (int i = 0; i < VD_TOPOLOGY_COUNT; i++) {
        vd_mesh_destroy(context, &model->meshes[i]);
    }
    for (int i = 0; i < model->texture_count; i++) {
        vd_texture_destroy(&model->textures[i]);
        vd_release(context, model->texture_names[i]);
    }
    vd_release(context, model->materials);
    vd_release(context, model->surfaces);
    vd_release(context, model->textures);
    vd_release(context, model->texture_names);
    vd_release(context, model);
}

/* ---- reading ----------------------------------------------------------------------------------*/

typedef vd_status read_function(vd_model_builder *builder, const char *text, size_t size_bytes);

static read_function *find_reader(const char *path) {
    return vd_path_ends_in(path, ".ply")   ? vd_ply_read
           : vd_path_ends_in(path, ".obj") ? vd_obj_read
           : vd_path_ends_in(path, ".off") ? vd_off_read
                                           : NULL;
}

static vd_status unsupported(const char *path) {
    return vd_failure(
        VD_ERROR_UNSUPPORTED,
        "cannot read %.200s: its name ends in none of .obj, .ply and .off; convert it to one "
        "of them",
        path);
}

vd_status vd_model_decode(vd_context *context, const void *data, size_t size_bytes,
                          const char *path, const vd_model_def *def, vd_model **out) {
    read_function *read = find_reader(path);
    if (read == NULL) {
        return unsupported(path);
    }
    if (size_bytes == 0) {
        return vd_failure(VD_ERROR_FORMAT, "cannot read %.200s: it is empty; get the file again",
                          path);
    }
    vd_model_builder builder;
    vd_status status = vd_builder_init(&builder, context, path, def);
    if (status.code == VD_OK) {
        status = read(&builder, data, size_bytes);
    }
    if (status.code == VD_OK) {
        status = vd_model_build(&builder, out);
    }
    vd_builder_finish(&builder);
    return status;
}

vd_status vd_model_load(vd_context *context, const char *path, const vd_model_def *def,
                        vd_model **out) {
    if (find_reader(path) == NULL) {
        return unsupported(path);
    }
    void *data = NULL;
    size_t size_bytes = 0;
    vd_status status = vd_file_read(context, path, FILE_LIMIT_BYTES, &data, &size_bytes);
    if (status.code == VD_OK) {
        status = vd_model_decode(context, data, size_bytes, path, def, out);
        vd_release(context, data);
    }
    return status;
}

/* ---- using ------------------------------------------------------------------------------------*/

void vd_model_bounds(const vd_model *model, vd_vec3 *min, vd_vec3 *max) {
    bool any = false;
    for (int i = 0; i < VD_TOPOLOGY_COUNT; i++) {
        if (model->meshes[i] == NULL || model->meshes[i]->vertex_count == 0) {
            continue;
        }
        vd_vec3 low, high;
        vd_mesh_bounds(model->meshes[i], &low, &high);
        min->x = any && min->x < low.x ? min->x : low.x;
        min->y = any && min->y < low.y ? min->y : low.y;
        min->z = any && min->z < low.z ? min->z : low.z;
        max->x = any && max->x > high.x ? max->x : high.x;
        max->y = any && max->y > high.y ? max->y : high.y;
        max->z = any && max->z > high.z ? max->z : high.z;
        any = true;
    }
}

int vd_model_draws(const vd_model *model, vd_draw draws[VD_TOPOLOGY_COUNT]) {
    int count = 0;
    for (int i = 0; i < VD_TOPOLOGY_COUNT; i++) {
        const vd_mesh *mesh = model->meshes[i];
        if (mesh == NULL) {
            continue;
        }
        vd_draw *draw = &draws[count++];
        *draw = vd_draw_default();
        draw->mesh = mesh;
        draw->materials = model->materials;
        draw->material_count = model->material_count;
        draw->cull = VD_CULL_NONE;
        if (mesh->normal < 0) {
            draw->shader = vd_shader_find(VD_SHADING_ALBEDO);
        }
    }
    return count;
}

vd_material vd_model_clay(void) {
    vd_material clay = vd_material_default();
    clay.albedo = (vd_linear){0.60f, 0.57f, 0.53f};
    return clay;
}

vd_matrix vd_model_upright(void) {
    return (vd_matrix){{{1, 0, 0, 0}, {0, 0, -1, 0}, {0, 1, 0, 0}, {0, 0, 0, 1}}};
}

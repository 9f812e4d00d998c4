/* model_builder.c: what readers add to a model. */
#include <string.h>
#include "model/model_build.h"

vd_status vd_builder_init(vd_model_builder *builder, vd_context *context, const char *path,
                          const vd_model_def *def) {
    memset(builder, 0, sizeof *builder);
    builder->context = context;
    builder->path = path;
    builder->def = def != NULL ? *def : vd_model_def_default();
    builder->model = vd_allocate_zero(context, 1, sizeof *builder->model);
    if (builder->model == NULL) {
        return vd_out_of_memory("a model", sizeof *builder->model);
    }
    builder->model->context = context;
    return vd_success();
}

void vd_builder_finish(vd_model_builder *builder) {
    vd_list *lists[] = {&builder->positions,    &builder->colors,
                        &builder->normals,      &builder->uvs,
                        &builder->corners,      &builder->corner_normals,
                        &builder->corner_uvs,   &builder->line_ends,
                        &builder->dots,         &builder->triangle_materials,
                        &builder->polygon,      &builder->materials,
                        &builder->surfaces,     &builder->textures,
                        &builder->texture_names};
    /* Empty when vd_model_build has handed them over. */
    vd_texture **textures = builder->textures.data;
    char **names = builder->texture_names.data;
    for (size_t i = 0; i < builder->textures.count; i++) {
        vd_texture_destroy(&textures[i]);
    }
    for (size_t i = 0; i < builder->texture_names.count; i++) {
        vd_release(builder->context, names[i]);
    }
    for (size_t i = 0; i < sizeof lists / sizeof lists[0]; i++) {
        vd_release(builder->context, lists[i]->data);
    }
    vd_model_destroy(&builder->model);
}

bool vd_builder_fail(vd_model_builder *builder, vd_status failure) {
    builder->failure = failure;
    return false;
}

bool vd_builder_refuse(vd_model_builder *builder, const char *where, double x, double y, double z) {
    const double v[3] = {x, y, z};
    for (int i = 0; i < 3; i++) {
        if (!vd_is_place(v[i])) {
            return vd_builder_fail(
                builder,
                vd_failure(
                    VD_ERROR_FORMAT,
                    "cannot read %.160s: %s has the %c coordinate %g, which is %s; remove it "
                    "or give a place",
                    builder->path, where, "xyz"[i], v[i],
                    v[i] != v[i] ? "not a number" : "beyond 1e15"));
        }
    }
    return vd_builder_fail(
        builder,
        builder->positions.count >= VD_MODEL_MAX_COUNT
            ? vd_failure(VD_ERROR_LIMIT,
                         "cannot read %.160s: it has more than %zu vertices; split it",
                         builder->path, VD_MODEL_MAX_COUNT)
            : vd_out_of_memory("a model's vertices", builder->positions.count * 3 * sizeof(float)));
}

/* ---- triangles --------------------------------------------------------------------------------*/

static bool out_of_corners(vd_model_builder *b) {
    return vd_builder_fail(
        b, b->corners.count >= VD_MODEL_MAX_COUNT
               ? vd_failure(VD_ERROR_LIMIT,
                            "cannot read %.160s: it has more than %zu triangles; split it", b->path,
                            VD_MODEL_MAX_COUNT / 3)
               : vd_out_of_memory("a model's triangles", b->corners.count * sizeof(uint32_t)));
}

/* Adds a triangle's numbers of texture coordinates or normals; before the first one that has any,
 * VD_NO_INDEX for all triangles so far. */
static bool add_numbers(vd_model_builder *b, vd_list *list, vd_by *by, const uint32_t numbers[3]) {
    const bool any =
        numbers[0] != VD_NO_INDEX || numbers[1] != VD_NO_INDEX || numbers[2] != VD_NO_INDEX;
    if (*by == VD_BY_POSITION || (*by == VD_BY_NONE && !any)) {
        return true;
    }
    *by = VD_BY_CORNER;
    const size_t missing = b->corners.count - list->count;
    uint32_t *to = vd_list_add(b->context, list, missing, sizeof *to);
    if (to == NULL) {
        return false;
    }
    memset(to, 0xff, (missing - 3) * sizeof *to);
    memcpy(to + missing - 3, numbers, 3 * sizeof *to);
    return true;
}

bool vd_builder_add_triangle(vd_model_builder *b, const vd_corner c[3]) {
    uint32_t *to = b->corners.count >= VD_MODEL_MAX_COUNT
                       ? NULL
                       : vd_list_add(b->context, &b->corners, 3, sizeof *to);
    if (to == NULL) {
        return out_of_corners(b);
    }
    for (int i = 0; i < 3; i++) {
        to[i] = c[i].position;
    }
    const uint32_t uvs[3] = {c[0].uv, c[1].uv, c[2].uv};
    const uint32_t normals[3] = {c[0].normal, c[1].normal, c[2].normal};
    if (!add_numbers(b, &b->corner_uvs, &b->uvs_by, uvs) ||
        !add_numbers(b, &b->corner_normals, &b->normals_by, normals)) {
        return out_of_corners(b);
    }
    if (b->material == 0 && b->triangle_materials.count == 0) {
        return true;
    }
    const size_t missing = b->corners.count / 3 - b->triangle_materials.count;
    uint32_t *material = vd_list_add(b->context, &b->triangle_materials, missing, sizeof *material);
    if (material == NULL) {
        return out_of_corners(b);
    }
    memset(material, 0, (missing - 1) * sizeof *material);
    material[missing - 1] = b->material;
    return true;
}

bool vd_builder_add_polygon(vd_model_builder *b, const vd_corner *corners, size_t count) {
    if (count == 3) {
        return vd_builder_add_triangle(b, corners);
    }
    b->polygon.count = 0;
    const size_t bytes = sizeof(double[3]) + sizeof(uint32_t) + sizeof(uint32_t[3]);
    double(*points)[3] = vd_list_add(b->context, &b->polygon, count, bytes);
    if (points == NULL) {
        return vd_builder_fail(b, vd_out_of_memory("a polygon", count * bytes));
    }
    uint32_t(*triangles)[3] = (uint32_t(*)[3])(void *)(points + count);
    uint32_t *left = (uint32_t *)(void *)(triangles + count);
    const float *positions = b->positions.data;
    for (size_t i = 0; i < count; i++) {
        for (size_t k = 0; k < 3; k++) {
            points[i][k] = (double)positions[3 * (size_t)corners[i].position + k];
        }
    }
    vd_triangulate((const double(*)[3])points, count, left, triangles);
    bool added = true;
    for (size_t t = 0; t + 2 < count && added; t++) {
        const vd_corner triangle[3] = {corners[triangles[t][0]], corners[triangles[t][1]],
                                       corners[triangles[t][2]]};
        added = vd_builder_add_triangle(b, triangle);
    }
    return added;
}

/* ---- materials and textures -------------------------------------------------------------------*/

vd_status vd_builder_add_material(vd_model_builder *builder, const vd_material *material,
                                  const vd_model_surface *surface, uint32_t *out) {
    vd_material *to = vd_list_add(builder->context, &builder->materials, 1, sizeof *to);
    vd_model_surface *about = vd_list_add(builder->context, &builder->surfaces, 1, sizeof *about);
    if (to == NULL || about == NULL) {
        return vd_out_of_memory("a model's materials", builder->materials.count * sizeof *to);
    }
    *to = *material;
    *about = *surface;
    *out = (uint32_t)(builder->materials.count - 1);
    return vd_success();
}

vd_status vd_builder_add_texture(vd_model_builder *builder, const vd_picture *picture,
                                 const char *name, int *out) {
    vd_context *context = builder->context;
    vd_texture *texture = NULL;
    vd_status status = vd_texture_create(context, picture, &texture);
    if (status.code == VD_ERROR_LIMIT) {
        return vd_failure(VD_ERROR_LIMIT, "cannot use the texture %.160s: %.160s", name,
                          status.message);
    }
    if (status.code != VD_OK) {
        return status;
    }
    vd_texture **to = vd_list_add(context, &builder->textures, 1, sizeof *to);
    char **to_name = vd_list_add(context, &builder->texture_names, 1, sizeof *to_name);
    if (to_name != NULL) {
        *to_name = vd_copy_string(context, name);
    }
    if (to == NULL) {
        vd_texture_destroy(&texture);
    } else {
        *to = texture;
    }
    if (to == NULL || to_name == NULL || *to_name == NULL) {
        return vd_out_of_memory("a model's textures", builder->textures.count * sizeof *to);
    }
    *out = (int)builder->textures.count - 1;
    return vd_success();
}

vd_status vd_builder_add_texture_file(vd_model_builder *builder, const char *path,
                                      const char *owner, int *out) {
    char *const *names = builder->texture_names.data;
    for (size_t i = 0; i < builder->texture_names.count; i++) {
        if (strcmp(names[i], path) == 0) {
            *out = (int)i;
            return vd_success();
        }
    }
    vd_picture *picture = NULL;
    vd_status status = vd_picture_load(builder->context, path, &picture);
    if (status.code == VD_ERROR_MEMORY) {
        return status;
    }
    if (status.code != VD_OK) {
        /* Unsupported is the model's own word for another reader. */
        return vd_failure(status.code == VD_ERROR_UNSUPPORTED ? VD_ERROR_FORMAT : status.code,
                          "%.250s; it is the texture of %.100s", status.message, owner);
    }
    status = vd_builder_add_texture(builder, picture, path, out);
    vd_picture_destroy(&picture);
    return status;
}

char *vd_beside(vd_context *context, const char *path, const char *name, size_t name_bytes) {
    const char *slash = strrchr(path, '/');
    const bool absolute = name_bytes > 0 && (name[0] == '/' || name[0] == '\\');
    const size_t folder = slash != NULL && !absolute ? (size_t)(slash - path) + 1 : 0;
    char *joined = vd_allocate(context, folder + name_bytes + 1, 1);
    if (joined != NULL) {
        memcpy(joined, path, folder);
        for (size_t i = 0; i < name_bytes; i++) {
            joined[folder + i] = name[i] == '\\' ? '/' : name[i];
        }
        joined[folder + name_bytes] = '\0';
    }
    return joined;
}

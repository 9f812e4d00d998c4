/* model_create.c: a model from arrays. */
#include <math.h>
#include <stdio.h>
#include <string.h>
#include "model/model_build.h"

static vd_status no_memory(const vd_model_source *source) {
    return vd_out_of_memory("a model's vertices", source->vertex_count * 12);
}

static vd_status copy_vertices(vd_model_builder *b, const vd_model_source *source) {
    const size_t count = source->vertex_count;
    for (size_t i = 0; i < count; i++) {
        const double *p = source->positions[i];
        if (!vd_builder_add_position(b, p[0], p[1], p[2])) {
            char where[48];
            (void)snprintf(where, sizeof where, "vertex %zu", i);
            (void)vd_builder_refuse(b, where, p[0], p[1], p[2]);
            return b->failure;
        }
    }
    const struct {
        const void *from;
        vd_list *to;
        size_t components;
        vd_by *by;
    } attributes[] = {{source->normals, &b->normals, 3, &b->normals_by},
                      {source->uvs, &b->uvs, 2, &b->uvs_by},
                      {source->colors, &b->colors, 3, NULL}};
    for (size_t k = 0; k < sizeof attributes / sizeof attributes[0]; k++) {
        const size_t components = attributes[k].components;
        if (attributes[k].from == NULL || count == 0) {
            continue;
        }
        float *to = vd_list_add(b->context, attributes[k].to, count, components * sizeof *to);
        if (to == NULL) {
            return no_memory(source);
        }
        const float *from = attributes[k].from;
        for (size_t i = 0; i < count * components; i++) {
            to[i] = fabsf(from[i]) < 1e6f ? from[i] : 0.0f; /* what is no number counts as none */
        }
        if (attributes[k].by != NULL) {
            *attributes[k].by = VD_BY_POSITION;
        }
    }
    return vd_success();
}

/* Copies `count` numbers of what is `width` numbers each, all below the vertices' count. */
static vd_status copy_numbers(vd_model_builder *b, const vd_model_source *source, const char *what,
                              const uint32_t *from, size_t count, size_t width, vd_list *to) {
    if (count > VD_MODEL_MAX_COUNT / width) {
        return vd_failure(VD_ERROR_LIMIT,
                          "cannot read %.160s: it has %zu %ss, more than %zu; split it", b->path,
                          count, what, VD_MODEL_MAX_COUNT / width);
    }
    uint32_t *numbers =
        count > 0 ? vd_list_add(b->context, to, count * width, sizeof *numbers) : NULL;
    if (count > 0 && numbers == NULL) {
        return no_memory(source);
    }
    for (size_t i = 0; i < count * width; i++) {
        if (from[i] >= source->vertex_count) {
            return vd_failure(VD_ERROR_FORMAT,
                              "cannot read %.160s: %s %zu names vertex %u, but there are only %zu; "
                              "get the file again",
                              b->path, what, i / width, from[i], source->vertex_count);
        }
        numbers[i] = from[i];
    }
    return vd_success();
}

static vd_status copy_materials(vd_model_builder *b, const vd_model_source *source) {
    vd_status status = vd_success();
    for (int i = 0; i < source->material_count && status.code == VD_OK; i++) {
        uint32_t number = 0;
        const int texture = source->surfaces[i].texture;
        if (texture >= source->texture_count) {
            return vd_failure(
                VD_ERROR_FORMAT,
                "cannot read %.160s: material %d names texture %d of %d; get the file "
                "again",
                b->path, i, texture, source->texture_count);
        }
        status = vd_builder_add_material(b, &source->materials[i], &source->surfaces[i], &number);
    }
    const size_t triangles = source->triangle_count;
    if (status.code != VD_OK || source->triangle_materials == NULL || triangles == 0) {
        return status;
    }
    uint32_t *to = vd_list_add(b->context, &b->triangle_materials, triangles, sizeof *to);
    if (to == NULL) {
        return no_memory(source);
    }
    for (size_t t = 0; t < triangles; t++) {
        to[t] = source->triangle_materials[t];
        if (to[t] > 0 && to[t] >= (uint32_t)source->material_count) {
            return vd_failure(
                VD_ERROR_FORMAT,
                "cannot read %.160s: triangle %zu has material %u of %d; get the file "
                "again",
                b->path, t, to[t], source->material_count);
        }
    }
    return status;
}

/* Textures last: nothing fails after them but memory, and then they are the caller's again. */
static vd_status lend_textures(vd_model_builder *b, const vd_model_source *source) {
    for (int i = 0; i < source->texture_count; i++) {
        char **name = vd_list_add(b->context, &b->texture_names, 1, sizeof *name);
        vd_texture **texture = vd_list_add(b->context, &b->textures, 1, sizeof *texture);
        if (name != NULL) {
            *name = vd_copy_string(b->context, source->texture_names[i]);
        }
        if (texture != NULL) {
            *texture = source->textures[i];
        }
        if (name == NULL || texture == NULL || *name == NULL) {
            return no_memory(source);
        }
    }
    return vd_success();
}

vd_status vd_model_create(vd_context *context, const vd_model_source *source, vd_model **out) {
    vd_model_builder b;
    vd_status status = vd_builder_init(&b, context, source->name, NULL);
    if (status.code != VD_OK) {
        return status;
    }
    (void)snprintf(b.model->format, sizeof b.model->format, "%s", source->format);
    b.model->z_up = source->z_up;
    status = copy_vertices(&b, source);
    if (status.code == VD_OK) {
        status = copy_numbers(&b, source, "triangle", (const uint32_t *)source->triangles,
                              source->triangle_count, 3, &b.corners);
    }
    if (status.code == VD_OK) {
        status = copy_numbers(&b, source, "line", (const uint32_t *)source->lines,
                              source->line_count, 2, &b.line_ends);
    }
    if (status.code == VD_OK) {
        status = copy_numbers(&b, source, "point", source->points, source->point_count, 1, &b.dots);
    }
    if (status.code == VD_OK) {
        status = copy_materials(&b, source);
    }
    if (status.code == VD_OK) {
        status = lend_textures(&b, source);
    }
    if (status.code == VD_OK) {
        status = vd_model_build(&b, out);
    }
    b.textures.count = status.code == VD_OK ? b.textures.count : 0;
    vd_builder_finish(&b);
    return status;
}

/* mesh.c: a mesh's block, made from a caller's arrays. */
#include <math.h>
#include <string.h>
#include <veduta/mesh.h>
#include "core/core.h"

static const uint8_t magic[8] = {'V', 'D', 'M', 'E', 'S', 'H', 0, 1};

vd_mesh_def vd_mesh_def_default(void) {
    vd_mesh_def def;
    memset(&def, 0, sizeof def);
    return def;
}

static size_t round_up(size_t bytes) {
    return (bytes + 63) / 64 * 64;
}

static size_t corners(vd_topology topology) {
    return topology == VD_TOPOLOGY_TRIANGLES ? 3 : topology == VD_TOPOLOGY_LINES ? 2 : 1;
}

static vd_status check_finite(const char *what, const float *values, size_t count, int components) {
    for (size_t i = 0; values != NULL && i < count * (size_t)components; i++) {
        if (!isfinite(values[i])) {
            return vd_failure(VD_ERROR_ARGUMENT,
                              "the mesh's %s of vertex %zu is %g in component %zu; remove the "
                              "vertex or give a finite number",
                              what, i / (size_t)components, (double)values[i],
                              i % (size_t)components);
        }
    }
    return vd_success();
}

static vd_status check_counts(const vd_mesh_def *def, size_t index_count) {
    if (def->topology < 0 || def->topology >= VD_TOPOLOGY_COUNT) {
        return vd_failure(VD_ERROR_ARGUMENT, "the mesh's topology %d is unknown",
                          (int)def->topology);
    }
    if (def->vertex_count > VD_MESH_MAX_VERTICES || index_count > VD_MESH_MAX_INDICES) {
        return vd_failure(VD_ERROR_LIMIT,
                          "a mesh of %zu vertices and %zu indices is too large; at most %u and %u "
                          "are possible: split it",
                          def->vertex_count, index_count, VD_MESH_MAX_VERTICES,
                          VD_MESH_MAX_INDICES);
    }
    if (def->vertex_count > 0 && def->positions == NULL) {
        return vd_failure(VD_ERROR_ARGUMENT, "the mesh has %zu vertices but no positions; set them",
                          def->vertex_count);
    }
    if (index_count % corners(def->topology) != 0) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "the mesh has %zu indices, which is no multiple of %zu; the last "
                          "primitive lacks some",
                          index_count, corners(def->topology));
    }
    if (def->extra_count < 0 || def->extra_count > VD_MESH_MAX_COMPONENTS - 5 ||
        (def->extra_count > 0) != (def->extra != NULL)) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "the mesh has %d extra components%s; give 0 to %d, and their values",
                          def->extra_count, def->extra == NULL ? " without values" : "",
                          VD_MESH_MAX_COMPONENTS - 5);
    }
    if (!isfinite(def->anchor.x) || !isfinite(def->anchor.y) || !isfinite(def->anchor.z)) {
        return vd_failure(VD_ERROR_ARGUMENT, "the mesh's anchor is not finite; give metres");
    }
    return vd_success();
}

static vd_status check_parts(const vd_mesh_def *def, size_t primitives) {
    size_t at = 0;
    for (int i = 0; i < def->part_count; i++) {
        if (def->parts[i].first != at) {
            return vd_failure(VD_ERROR_ARGUMENT,
                              "part %d of the mesh begins at primitive %u instead of %zu; parts "
                              "must follow each other",
                              i, def->parts[i].first, at);
        }
        at += def->parts[i].count;
    }
    if (def->part_count < 0 || (def->part_count > 0 && (def->parts == NULL || at != primitives))) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "the %d parts of the mesh have %zu primitives of %zu; they must have all",
                          def->part_count, at, primitives);
    }
    return vd_success();
}

static vd_status check_def(const vd_mesh_def *def, size_t index_count) {
    vd_status status = check_counts(def, index_count);
    if (status.code == VD_OK) {
        status = check_parts(def, index_count / corners(def->topology));
    }
    for (size_t i = 0; def->indices != NULL && status.code == VD_OK && i < index_count; i++) {
        if (def->indices[i] >= def->vertex_count) {
            return vd_failure(VD_ERROR_ARGUMENT,
                              "index %zu of the mesh is %u, but there are only %zu vertices", i,
                              def->indices[i], def->vertex_count);
        }
    }
    if (status.code == VD_OK) {
        status = check_finite("position", def->positions, def->vertex_count, 3);
    }
    if (status.code == VD_OK) {
        status = check_finite("normal", def->normals, def->vertex_count, 3);
    }
    if (status.code == VD_OK) {
        status = check_finite("texture position", def->uvs, def->vertex_count, 2);
    }
    if (status.code == VD_OK) {
        status = check_finite("extra attribute", def->extra, def->vertex_count, def->extra_count);
    }
    return status;
}

/* Fills in the head: which components there are, and where the arrays stand. */
static void lay_out(const vd_mesh_def *def, size_t index_count, vd_mesh *head) {
    const bool normals =
        def->normals != NULL || (def->compute_normals && def->topology == VD_TOPOLOGY_TRIANGLES);
    memset(head, 0, sizeof *head);
    memcpy(head->magic, magic, sizeof magic);
    head->anchor = def->anchor;
    head->topology = (uint32_t)def->topology;
    head->vertex_count = (uint32_t)def->vertex_count;
    head->vertex_stride = (uint32_t)(round_up(def->vertex_count * 4) / 4);
    head->index_count = (uint32_t)index_count;
    head->primitive_count = (uint32_t)(index_count / corners(def->topology));
    head->part_count = def->part_count > 0 ? (uint32_t)def->part_count : 1;
    int component = 0;
    head->normal = normals ? component : -1;
    component += normals ? 3 : 0;
    head->uv = def->uvs != NULL ? component : -1;
    component += def->uvs != NULL ? 2 : 0;
    head->extra = def->extra != NULL ? component : -1;
    head->extra_count = def->extra_count;
    component += def->extra_count;
    head->component_count = component;
    head->group_count = (component + 3) / 4;
    head->position_offset_bytes = round_up(sizeof *head);
    head->attribute_offset_bytes =
        head->position_offset_bytes + (uint64_t)head->vertex_stride * 3 * sizeof(float);
    head->index_offset_bytes = head->attribute_offset_bytes + (uint64_t)head->vertex_stride *
                                                                  (uint64_t)head->group_count * 4 *
                                                                  sizeof(float);
    /* Sixteen primitives' indices may be read at once. */
    head->part_offset_bytes =
        head->index_offset_bytes + round_up((index_count + 3 * 16) * sizeof(uint32_t));
    head->size_bytes = round_up(head->part_offset_bytes + head->part_count * sizeof(vd_mesh_part));
}

/* Copies `components` values of each vertex to consecutive components of the groups. */
static void copy_components(vd_mesh *mesh, int first, const float *from, int components) {
    for (int c = 0; c < components; c++) {
        float *to = (float *)(uintptr_t)vd_mesh_attributes(mesh, (first + c) / 4) + (first + c) % 4;
        for (size_t i = 0; i < mesh->vertex_count; i++) {
            to[4 * i] = from[i * (size_t)components + (size_t)c];
        }
    }
}

static vd_vec3 position(const vd_mesh *mesh, uint32_t vertex) {
    return vd_vec3_make((double)vd_mesh_positions(mesh, 0)[vertex],
                        (double)vd_mesh_positions(mesh, 1)[vertex],
                        (double)vd_mesh_positions(mesh, 2)[vertex]);
}

/* The cross product of two sides is as long as twice the area: adding them weighs by area. */
static vd_status compute_normals(vd_context *context, vd_mesh *mesh) {
    const uint32_t *indices = vd_mesh_indices(mesh);
    vd_vec3 *sums = vd_allocate_zero(context, mesh->vertex_count, sizeof *sums);
    if (sums == NULL) {
        return vd_out_of_memory("a mesh's normals", mesh->vertex_count * sizeof *sums);
    }
    for (size_t i = 0; i < mesh->index_count; i += 3) {
        const vd_vec3 a = position(mesh, indices[i]);
        const vd_vec3 cross = vd_vec3_cross(vd_vec3_subtract(position(mesh, indices[i + 1]), a),
                                            vd_vec3_subtract(position(mesh, indices[i + 2]), a));
        for (size_t k = i; k < i + 3; k++) {
            sums[indices[k]] = vd_vec3_add(sums[indices[k]], cross);
        }
    }
    float *to = (float *)(uintptr_t)vd_mesh_attributes(mesh, 0);
    for (size_t i = 0; i < mesh->vertex_count; i++) {
        vd_vec3 normal = vd_vec3_normalize(sums[i]);
        to[4 * i] = (float)normal.x;
        to[4 * i + 1] = (float)normal.y;
        to[4 * i + 2] = (float)normal.z;
    }
    vd_release(context, sums);
    return vd_success();
}

static void copy_positions(const vd_mesh_def *def, vd_mesh *mesh) {
    for (int axis = 0; axis < 3 && mesh->vertex_count > 0; axis++) {
        float *to = (float *)(uintptr_t)vd_mesh_positions(mesh, axis);
        float min = def->positions[axis], max = min;
        for (size_t i = 0; i < mesh->vertex_stride; i++) {
            /* What fills the last batch repeats the last vertex. */
            const size_t from = i < mesh->vertex_count ? i : mesh->vertex_count - 1;
            to[i] = def->positions[3 * from + (size_t)axis];
            min = min < to[i] ? min : to[i];
            max = max < to[i] ? to[i] : max;
        }
        mesh->min[axis] = min;
        mesh->max[axis] = max;
    }
}

vd_status vd_mesh_create(vd_context *context, const vd_mesh_def *def, vd_mesh **out) {
    const size_t index_count = def->indices != NULL ? def->index_count : def->vertex_count;
    vd_status status = check_def(def, index_count);
    if (status.code != VD_OK) {
        return status;
    }
    vd_mesh head;
    lay_out(def, index_count, &head);
    vd_mesh *mesh = vd_allocate_zero(context, (size_t)head.size_bytes, 1);
    if (mesh == NULL) {
        return vd_out_of_memory("a mesh", (size_t)head.size_bytes);
    }
    *mesh = head;
    copy_positions(def, mesh);
    uint32_t *indices = (uint32_t *)(uintptr_t)vd_mesh_indices(mesh);
    for (size_t i = 0; i < index_count; i++) {
        indices[i] = def->indices != NULL ? def->indices[i] : (uint32_t)i;
    }
    vd_mesh_part *parts = (vd_mesh_part *)(uintptr_t)vd_mesh_parts(mesh);
    parts[0] = (vd_mesh_part){0, mesh->primitive_count, 0};
    for (int i = 0; i < def->part_count; i++) {
        parts[i] = def->parts[i];
    }
    if (def->normals != NULL) {
        copy_components(mesh, mesh->normal, def->normals, 3);
    } else if (mesh->normal >= 0) {
        status = compute_normals(context, mesh);
    }
    if (def->uvs != NULL) {
        copy_components(mesh, mesh->uv, def->uvs, 2);
    }
    if (def->extra != NULL) {
        copy_components(mesh, mesh->extra, def->extra, def->extra_count);
    }
    if (status.code != VD_OK) {
        vd_release(context, mesh);
        return status;
    }
    *out = mesh;
    return status;
}

/* ---- from outside -----------------------------------------------------------------------------*/

/* Whether a head is the one that its counts lead to. */
static bool head_fits(const vd_mesh *head, size_t size_bytes) {
    if (head->topology >= VD_TOPOLOGY_COUNT || head->vertex_count > VD_MESH_MAX_VERTICES ||
        head->index_count > VD_MESH_MAX_INDICES || head->extra_count < 0 ||
        head->extra_count > VD_MESH_MAX_COMPONENTS - 5 || head->part_count < 1 ||
        head->part_count > INT32_MAX || head->index_count % corners(head->topology) != 0) {
        return false;
    }
    static const float there = 0.0f;
    vd_mesh_def def = vd_mesh_def_default();
    def.anchor = head->anchor;
    def.topology = (vd_topology)head->topology;
    def.vertex_count = head->vertex_count;
    def.part_count = (int)head->part_count;
    def.normals = head->normal >= 0 ? &there : NULL;
    def.uvs = head->uv >= 0 ? &there : NULL;
    def.extra = head->extra >= 0 ? &there : NULL;
    def.extra_count = head->extra_count;
    vd_mesh expected;
    lay_out(&def, head->index_count, &expected);
    for (int i = 0; i < 3; i++) {
        expected.min[i] = head->min[i];
        expected.max[i] = head->max[i];
    }
    return memcmp(&expected, head, sizeof expected) == 0 && expected.size_bytes == size_bytes &&
           isfinite(head->anchor.x) && isfinite(head->anchor.y) && isfinite(head->anchor.z);
}

static bool positions_fit(const vd_mesh *mesh) {
    bool fit = true;
    for (int axis = 0; axis < 3; axis++) {
        const float *p = vd_mesh_positions(mesh, axis);
        float min = mesh->vertex_count > 0 ? p[0] : 0.0f, max = min;
        for (size_t i = 0; i < mesh->vertex_stride; i++) {
            fit = fit && isfinite(p[i]);
            min = p[i] < min ? p[i] : min;
            max = p[i] > max ? p[i] : max;
        }
        fit = fit && min == mesh->min[axis] && max == mesh->max[axis];
    }
    const float *attributes = vd_mesh_attributes(mesh, 0);
    const size_t count = (size_t)mesh->group_count * mesh->vertex_stride * 4;
    for (size_t i = 0; i < count && fit; i++) {
        fit = isfinite(attributes[i]);
    }
    return fit;
}

/* Indices behind the last primitive are read with it: 0, as they were made. */
static bool primitives_fit(const vd_mesh *mesh) {
    const uint32_t *indices = vd_mesh_indices(mesh);
    const size_t bytes = (size_t)(mesh->part_offset_bytes - mesh->index_offset_bytes);
    bool fit = true;
    for (size_t i = 0; i < bytes / sizeof *indices && fit; i++) {
        fit = i < mesh->index_count ? indices[i] < mesh->vertex_count : indices[i] == 0;
    }
    uint64_t at = 0;
    for (uint32_t i = 0; i < mesh->part_count && fit; i++) {
        fit = vd_mesh_parts(mesh)[i].first == at;
        at += vd_mesh_parts(mesh)[i].count;
    }
    return fit && at == mesh->primitive_count;
}

vd_status vd_mesh_validate(const void *block, size_t size_bytes) {
    if ((uintptr_t)block % 64 != 0) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "a mesh's block lies at no multiple of 64 bytes; copy it to one");
    }
    const vd_mesh *mesh = block;
    const char *wrong = size_bytes < sizeof *mesh || memcmp(mesh->magic, magic, sizeof magic) != 0
                            ? "beginning"
                        : !head_fits(mesh, size_bytes) ? "head"
                        : !positions_fit(mesh)         ? "vertices"
                        : !primitives_fit(mesh)        ? "primitives"
                                                       : NULL;
    return wrong == NULL ? vd_success()
                         : vd_failure(VD_ERROR_FORMAT,
                                      "a mesh's block is damaged: its %s cannot be so; write or "
                                      "send it again",
                                      wrong);
}

void vd_mesh_destroy(vd_context *context, vd_mesh **mesh) {
    if (mesh != NULL) {
        vd_release(context, *mesh);
        *mesh = NULL;
    }
}

void vd_mesh_bounds(const vd_mesh *mesh, vd_vec3 *min, vd_vec3 *max) {
    const vd_vec3 a = mesh->anchor;
    *min = vd_vec3_make(a.x + (double)mesh->min[0], a.y + (double)mesh->min[1],
                        a.z + (double)mesh->min[2]);
    *max = vd_vec3_make(a.x + (double)mesh->max[0], a.y + (double)mesh->max[1],
                        a.z + (double)mesh->max[2]);
}

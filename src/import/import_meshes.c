/* import_meshes.c: nodes flattened: each mesh where its node places it, once for every node. */
#include <math.h>
#include <string.h>

#include "import/import.h"
#include <assimp/cimport.h>

/* Deeper trees are taken for broken files; ours are walked by recursion. */
#define DEEPEST 512

/* Beyond what the model takes; instances may multiply. */
#define MOST_VERTICES ((size_t)VD_MESH_MAX_VERTICES)

static struct aiMatrix4x4 multiply(const struct aiMatrix4x4 *a, const struct aiMatrix4x4 *b) {
    struct aiMatrix4x4 out = *a;
    aiMultiplyMatrix4(&out, b);
    return out;
}

typedef vd_status visit_function(vd_import *import, const struct aiMesh *mesh,
                                 const struct aiMatrix4x4 *world);

static vd_status walk(vd_import *import, const struct aiNode *node,
                      const struct aiMatrix4x4 *parent, int depth, visit_function *visit) {
    if (depth > DEEPEST) {
        return vd_failure(
            VD_ERROR_FORMAT,
            "cannot read %.200s: its nodes are nested more than %d deep; get the file "
            "again",
            import->path, DEEPEST);
    }
    const struct aiMatrix4x4 world = multiply(parent, &node->mTransformation);
    vd_status status = vd_success();
    for (unsigned i = 0; i < node->mNumMeshes && status.code == VD_OK; i++) {
        if (node->mMeshes[i] < import->scene->mNumMeshes) {
            status = visit(import, import->scene->mMeshes[node->mMeshes[i]], &world);
        }
    }
    for (unsigned i = 0; i < node->mNumChildren && status.code == VD_OK; i++) {
        status = walk(import, node->mChildren[i], &world, depth + 1, visit);
    }
    return status;
}

/* ---- first pass: how much there is ------------------------------------------------------------*/

static vd_status count_mesh(vd_import *import, const struct aiMesh *mesh,
                            const struct aiMatrix4x4 *world) {
    (void)world;
    import->vertex_count += mesh->mNumVertices;
    for (unsigned f = 0; f < mesh->mNumFaces; f++) {
        const unsigned corners = mesh->mFaces[f].mNumIndices;
        import->triangle_count += corners >= 3 ? corners - 2 : 0;
        import->line_count += corners == 2;
        import->point_count += corners == 1;
    }
    if (import->vertex_count > MOST_VERTICES || import->triangle_count > MOST_VERTICES) {
        return vd_failure(
            VD_ERROR_LIMIT,
            "cannot read %.200s: with all its instances it has more than %zu vertices "
            "or triangles; split it",
            import->path, MOST_VERTICES);
    }
    return vd_success();
}

/* ---- second pass: collecting ------------------------------------------------------------------*/

static void transform(const struct aiMatrix4x4 *m, const struct aiVector3D *v, double out[3]) {
    const double x = (double)v->x, y = (double)v->y, z = (double)v->z;
    out[0] = (double)m->a1 * x + (double)m->a2 * y + (double)m->a3 * z + (double)m->a4;
    out[1] = (double)m->b1 * x + (double)m->b2 * y + (double)m->b3 * z + (double)m->b4;
    out[2] = (double)m->c1 * x + (double)m->c2 * y + (double)m->c3 * z + (double)m->c4;
}

/* The matrix's cofactors: the inverse transpose times the determinant, whose sign turns the normals
 * of mirrored meshes; returns the determinant. */
static double cofactors(const struct aiMatrix4x4 *m, double out[3][3]) {
    const double r[3][3] = {{(double)m->a1, (double)m->a2, (double)m->a3},
                            {(double)m->b1, (double)m->b2, (double)m->b3},
                            {(double)m->c1, (double)m->c2, (double)m->c3}};
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < 3; k++) {
            const int i1 = (i + 1) % 3, i2 = (i + 2) % 3, k1 = (k + 1) % 3, k2 = (k + 2) % 3;
            out[i][k] = r[i1][k1] * r[i2][k2] - r[i1][k2] * r[i2][k1];
        }
    }
    const double determinant = r[0][0] * out[0][0] + r[0][1] * out[0][1] + r[0][2] * out[0][2];
    for (int i = 0; i < 9 && determinant < 0.0; i++) {
        out[i / 3][i % 3] = -out[i / 3][i % 3];
    }
    return determinant;
}

static void turn_normal(const double m[3][3], const struct aiVector3D *n, float out[3]) {
    const vd_vec3 v = {(double)n->x, (double)n->y, (double)n->z};
    const vd_vec3 turned = {m[0][0] * v.x + m[0][1] * v.y + m[0][2] * v.z,
                            m[1][0] * v.x + m[1][1] * v.y + m[1][2] * v.z,
                            m[2][0] * v.x + m[2][1] * v.y + m[2][2] * v.z};
    const vd_vec3 unit = vd_vec3_normalize(turned);
    out[0] = (float)unit.x;
    out[1] = (float)unit.y;
    out[2] = (float)unit.z;
}

static float linear(const vd_import *import, float v) {
    if (import->linear_colors) {
        return v > 0.0f ? v < 1.0f ? v : 1.0f : 0.0f;
    }
    return vd_srgb_decode((uint8_t)(v > 0.0f ? v < 1.0f ? 255.0f * v + 0.5f : 255.0f : 0.0f));
}

static void collect_vertices(vd_import *import, const struct aiMesh *mesh,
                             const struct aiMatrix4x4 *world, const double normal_matrix[3][3]) {
    for (unsigned i = 0; i < mesh->mNumVertices; i++) {
        const size_t v = import->vertex_count + i;
        transform(world, &mesh->mVertices[i], import->positions[v]);
        if (mesh->mNormals != NULL) {
            turn_normal(normal_matrix, &mesh->mNormals[i], import->normals[v]);
        }
        if (mesh->mTextureCoords[0] != NULL) {
            import->uvs[v][0] = mesh->mTextureCoords[0][i].x;
            import->uvs[v][1] = 1.0f - mesh->mTextureCoords[0][i].y;
        }
        if (import->colors != NULL) {
            const struct aiColor4D *c = mesh->mColors[0] != NULL ? &mesh->mColors[0][i] : NULL;
            import->colors[v][0] = c != NULL ? linear(import, c->r) : 1.0f;
            import->colors[v][1] = c != NULL ? linear(import, c->g) : 1.0f;
            import->colors[v][2] = c != NULL ? linear(import, c->b) : 1.0f;
        }
    }
}

static vd_status bad_index(const vd_import *import, const struct aiMesh *mesh, unsigned face) {
    return vd_failure(VD_ERROR_FORMAT,
                      "cannot read %.160s: face %u of mesh \"%.60s\" names a vertex that is not "
                      "there (it has %u); get the file again",
                      import->path, face, mesh->mName.data, mesh->mNumVertices);
}

/* Adds a mesh; one that its node mirrors has its triangles turned round. */
static vd_status collect_mesh(vd_import *import, const struct aiMesh *mesh,
                              const struct aiMatrix4x4 *world) {
    double normal_matrix[3][3];
    const bool mirrored = cofactors(world, normal_matrix) < 0.0;
    collect_vertices(import, mesh, world, (const double(*)[3])normal_matrix);
    const uint32_t base = (uint32_t)import->vertex_count;
    for (unsigned f = 0; f < mesh->mNumFaces; f++) {
        const struct aiFace *face = &mesh->mFaces[f];
        for (unsigned k = 0; k < face->mNumIndices; k++) {
            if (face->mIndices[k] >= mesh->mNumVertices) {
                return bad_index(import, mesh, f);
            }
        }
        const unsigned *i = face->mIndices;
        if (face->mNumIndices == 1) {
            import->points[import->point_count++] = base + i[0];
        } else if (face->mNumIndices == 2) {
            import->lines[import->line_count][0] = base + i[0];
            import->lines[import->line_count++][1] = base + i[1];
        }
        for (unsigned k = 2; k < face->mNumIndices; k++) {
            const size_t t = import->triangle_count++;
            import->triangles[t][0] = base + i[0];
            import->triangles[t][1] = base + i[mirrored ? k : k - 1];
            import->triangles[t][2] = base + i[mirrored ? k - 1 : k];
            import->triangle_materials[t] = mesh->mMaterialIndex;
        }
    }
    import->vertex_count += mesh->mNumVertices;
    return vd_success();
}

/* ---- both -------------------------------------------------------------------------------------*/

static bool allocate(vd_import *import) {
    bool normals = false, uvs = false, colors = false;
    for (unsigned i = 0; i < import->scene->mNumMeshes; i++) {
        const struct aiMesh *mesh = import->scene->mMeshes[i];
        normals = normals || mesh->mNormals != NULL;
        uvs = uvs || mesh->mTextureCoords[0] != NULL;
        colors = colors || mesh->mColors[0] != NULL;
    }
    const size_t v = import->vertex_count, t = import->triangle_count;
    const struct {
        bool wanted;
        void **to;
        size_t count, size_bytes;
    } arrays[] = {{true, (void **)&import->positions, v, sizeof *import->positions},
                  {normals, (void **)&import->normals, v, sizeof *import->normals},
                  {uvs, (void **)&import->uvs, v, sizeof *import->uvs},
                  {colors, (void **)&import->colors, v, sizeof *import->colors},
                  {true, (void **)&import->triangles, t, sizeof *import->triangles},
                  {true, (void **)&import->triangle_materials, t, sizeof(uint32_t)},
                  {true, (void **)&import->lines, import->line_count, sizeof *import->lines},
                  {true, (void **)&import->points, import->point_count, sizeof(uint32_t)}};
    for (size_t i = 0; i < sizeof arrays / sizeof arrays[0]; i++) {
        if (!arrays[i].wanted) {
            continue;
        }
        void *memory = vd_allocate(import->context, arrays[i].count, arrays[i].size_bytes);
        if (memory == NULL) {
            return false;
        }
        memset(memory, 0, arrays[i].count * arrays[i].size_bytes);
        memcpy(arrays[i].to, &memory, sizeof memory);
    }
    return true;
}

vd_status vd_import_meshes(vd_import *import) {
    struct aiMatrix4x4 identity;
    aiIdentityMatrix4(&identity);
    if (import->scene->mRootNode == NULL) {
        return vd_success();
    }
    vd_status status = walk(import, import->scene->mRootNode, &identity, 0, count_mesh);
    if (status.code == VD_OK && !allocate(import)) {
        status = vd_failure(VD_ERROR_MEMORY, "out of memory for the %zu vertices of %.200s",
                            import->vertex_count, import->path);
    }
    import->vertex_count = import->triangle_count = import->line_count = import->point_count = 0;
    return status.code == VD_OK ? walk(import, import->scene->mRootNode, &identity, 0, collect_mesh)
                                : status;
}

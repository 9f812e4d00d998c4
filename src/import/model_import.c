/* model_import.c: a file through assimp into a model.
 *
 * assimp is asked for as little as possible: polygons into triangles, nothing else. Normals are
 * computed by vd_model_create, the same for every format; joining equal vertices, which assimp does
 * by comparing all their attributes, takes it 780 ms for the 871 k dragon, and vd_model_create
 * finds equal positions in a hash table while it computes normals.
 */
#include <veduta/model_import.h>

#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>

#include "core/file.h"
#include "import/import.h"
#include <assimp/cimport.h>
#include <assimp/postprocess.h>

static void finish(vd_import *import, bool taken) {
    vd_context *context = import->context;
    for (int i = 0; i < import->texture_count && !taken; i++) {
        vd_texture_destroy(&import->textures[i]);
    }
    void *memory[] = {import->materials, import->surfaces,
                      import->textures,  import->texture_names,
                      import->positions, import->normals,
                      import->uvs,       import->colors,
                      import->triangles, import->triangle_materials,
                      import->lines,     import->points};
    for (size_t i = 0; i < sizeof memory / sizeof memory[0]; i++) {
        vd_release(context, memory[i]);
    }
    aiReleaseImport(import->scene);
}

/* Which axis is up: what the file says (FBX), else the custom of its format. */
static bool is_z_up(const vd_import *import) {
    const struct aiMetadata *data = import->scene->mMetaData;
    for (unsigned i = 0; data != NULL && i < data->mNumProperties; i++) {
        if (strcmp(data->mKeys[i].data, "UpAxis") == 0 && data->mValues[i].mType == AI_INT32) {
            return *(const int32_t *)data->mValues[i].mData == 2;
        }
    }
    return vd_path_ends_in(import->path, ".stl") || vd_path_ends_in(import->path, ".3mf");
}

static vd_status create(const vd_import *import, vd_model **out) {
    char format[32];
    const char *dot = strrchr(import->path, '.');
    size_t n = 0;
    for (dot = dot != NULL ? dot + 1 : ""; dot[n] != '\0' && n + 1 < 12; n++) {
        format[n] = (char)(dot[n] >= 'a' && dot[n] <= 'z' ? dot[n] - 32 : dot[n]);
    }
    (void)snprintf(format + n, sizeof format - n, ", by assimp");
    const char **names = vd_allocate(import->context, (size_t)import->texture_count, sizeof *names);
    if (names == NULL) {
        return vd_failure(VD_ERROR_MEMORY, "out of memory for %d textures", import->texture_count);
    }
    for (int i = 0; i < import->texture_count; i++) {
        names[i] = import->texture_names[i];
    }
    const vd_model_source source = {
        .name = import->path,
        .format = format,
        .z_up = is_z_up(import),
        .vertex_count = import->vertex_count,
        .positions = (const double(*)[3])import->positions,
        .normals = (const float(*)[3])import->normals,
        .uvs = (const float(*)[2])import->uvs,
        .colors = (const float(*)[3])import->colors,
        .triangle_count = import->triangle_count,
        .triangles = (const uint32_t(*)[3])import->triangles,
        .triangle_materials = import->scene->mNumMaterials > 0 ? import->triangle_materials : NULL,
        .line_count = import->line_count,
        .lines = (const uint32_t(*)[2])import->lines,
        .point_count = import->point_count,
        .points = import->points,
        .material_count = (int)import->scene->mNumMaterials,
        .materials = import->materials,
        .surfaces = import->surfaces,
        .texture_count = import->texture_count,
        .textures = import->textures,
        .texture_names = names,
    };
    vd_status status = vd_model_create(import->context, &source, out);
    vd_release(import->context, names);
    return status;
}

/* What cannot be opened is said before assimp, which calls every such file unknown, has its say. */
static vd_status check_file(const char *path) {
    struct stat info;
    FILE *file = fopen(path, "rb");
    const int error = errno;
    if (file == NULL) {
        return vd_failure(VD_ERROR_IO, "cannot read %.200s: %s; check the path", path,
                          strerror(error));
    }
    const bool regular = fstat(fileno(file), &info) == 0 && S_ISREG(info.st_mode);
    const bool empty = regular && info.st_size == 0;
    (void)fclose(file);
    return !regular ? vd_failure(VD_ERROR_IO, "cannot read %.200s: it is no regular file; name one",
                                 path)
           : empty  ? vd_failure(VD_ERROR_FORMAT,
                                 "cannot read %.200s: it is empty; get the file again", path)
                    : vd_success();
}

vd_status vd_model_import(vd_context *context, const char *path, const vd_model_def *def,
                          vd_model **out) {
    vd_status status = check_file(path);
    if (status.code != VD_OK) {
        return status;
    }
    vd_import import = {.context = context,
                        .path = path,
                        .skip_textures = def != NULL && def->skip_textures,
                        .linear_colors = vd_path_ends_in(path, ".gltf") ||
                                         vd_path_ends_in(path, ".glb") ||
                                         vd_path_ends_in(path, ".vrm")};
    import.scene = aiImportFile(path, aiProcess_Triangulate);
    if (import.scene == NULL) {
        char words[160];
        (void)snprintf(words, sizeof words, "%.159s", aiGetErrorString());
        for (char *c = words; *c != '\0'; c++) {
            *c = *c == '\n' || *c == '\r' ? ' ' : *c;
        }
        return vd_failure(VD_ERROR_FORMAT,
                          "cannot read %.160s: assimp says \"%s\"; get the file again, or convert "
                          "it to PLY",
                          path, words);
    }
    status = vd_import_materials(&import);
    if (status.code == VD_OK) {
        status = vd_import_meshes(&import);
    }
    if (status.code == VD_OK) {
        status = create(&import, out);
    }
    finish(&import, status.code == VD_OK);
    return status;
}

/* import_materials.c: what assimp says of materials, as far as it is drawn. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "import/import.h"
#include <assimp/GltfMaterial.h>
#include <assimp/cimport.h>

static float decode(const vd_import *import, float v) {
    if (import->linear_colors) {
        return v > 0.0f ? v < 1.0f ? v : 1.0f : 0.0f;
    }
    return vd_srgb_decode((uint8_t)(v > 0.0f ? v < 1.0f ? 255.0f * v + 0.5f : 255.0f : 0.0f));
}

static bool read_color(const vd_import *import, const struct aiMaterial *from, const char *key,
                       vd_linear *out, float *alpha) {
    struct aiColor4D c;
    if (aiGetMaterialColor(from, key, 0, 0, &c) != aiReturn_SUCCESS) {
        return false;
    }
    *out = (vd_linear){decode(import, c.r), decode(import, c.g), decode(import, c.b)};
    if (alpha != NULL && c.a >= 0.0f && c.a <= 1.0f) {
        *alpha = c.a;
    }
    return true;
}

static bool read_float(const struct aiMaterial *from, const char *key, float *out) {
    float v = 0.0f;
    if (aiGetMaterialFloatArray(from, key, 0, 0, &v, NULL) != aiReturn_SUCCESS || !isfinite(v)) {
        return false;
    }
    *out = v;
    return true;
}

/* glTF's metal and roughness as the highlight of Phong that comes nearest: the exponent has the
 * same width (Walter et al. 2007, eq. 31, with the square of roughness as its width), metals take
 * their colour into the highlight and leave less for the rest. */
static void use_roughness(const struct aiMaterial *from, vd_material *m) {
    float metal = 0.0f, rough = 0.0f;
    if (!read_float(from, "$mat.roughnessFactor", &rough)) {
        return;
    }
    (void)read_float(from, "$mat.metallicFactor", &metal);
    metal = metal > 0.0f ? metal < 1.0f ? metal : 1.0f : 0.0f;
    rough = rough > 0.05f ? rough < 1.0f ? rough : 1.0f : 0.05f;
    const float width = rough * rough, shine = 1.0f - rough;
    const float exponent = 2.0f / (width * width) - 2.0f;
    m->shininess = exponent > 1.0f ? exponent < 1024.0f ? exponent : 1024.0f : 1.0f;
    m->specular = (vd_linear){shine * (0.04f + metal * (m->albedo.r - 0.04f)),
                              shine * (0.04f + metal * (m->albedo.g - 0.04f)),
                              shine * (0.04f + metal * (m->albedo.b - 0.04f))};
    const float rest = 1.0f - 0.5f * metal * shine;
    m->albedo = (vd_linear){rest * m->albedo.r, rest * m->albedo.g, rest * m->albedo.b};
}

static void read_alpha(const struct aiMaterial *from, vd_material *m, vd_model_surface *s) {
    struct aiString mode;
    float opacity = 1.0f;
    if (read_float(from, "$mat.opacity", &opacity) && opacity >= 0.0f && opacity < 1.0f) {
        m->alpha = opacity;
        s->alpha_mode = VD_ALPHA_BLEND;
    }
    if (aiGetMaterialString(from, AI_MATKEY_GLTF_ALPHAMODE, &mode) == aiReturn_SUCCESS) {
        s->alpha_mode = strcmp(mode.data, "MASK") == 0    ? VD_ALPHA_MASK
                        : strcmp(mode.data, "BLEND") == 0 ? VD_ALPHA_BLEND
                                                          : VD_ALPHA_OPAQUE;
        s->alpha_cutoff = 0.5f;
        (void)read_float(from, "$mat.gltf.alphaCutoff", &s->alpha_cutoff);
    }
}

static void read_material(const vd_import *import, const struct aiMaterial *from, vd_material *m,
                          vd_model_surface *s) {
    struct aiString name;
    *m = vd_material_default();
    *s = (vd_model_surface){.texture = -1};
    if (aiGetMaterialString(from, AI_MATKEY_NAME, &name) == aiReturn_SUCCESS) {
        (void)snprintf(s->name, sizeof s->name, "%.63s", name.data);
    }
    m->specular = (vd_linear){0, 0, 0};
    if (!read_color(import, from, "$clr.base", &m->albedo, &m->alpha)) {
        (void)read_color(import, from, "$clr.diffuse", &m->albedo, NULL);
        (void)read_color(import, from, "$clr.specular", &m->specular, NULL);
        float shininess = 0.0f;
        if (read_float(from, "$mat.shininess", &shininess) && shininess > 1.0f) {
            m->shininess = shininess < 1024.0f ? shininess : 1024.0f;
        } else {
            m->specular = (vd_linear){0, 0, 0}; /* assimp's default is white without an exponent */
        }
    }
    (void)read_color(import, from, "$clr.emissive", &m->emission, NULL);
    if (strcmp(s->name, AI_DEFAULT_MATERIAL_NAME) == 0) {
        *m = vd_model_clay(); /* what assimp gives to formats without materials */
    }
    use_roughness(from, m);
    read_alpha(from, m, s);
}

/* ---- textures ---------------------------------------------------------------------------------*/

/* Raw texels: BGRA in bytes. */
static vd_status from_texels(vd_import *import, const struct aiTexture *t, vd_picture **out) {
    if (t->mWidth > VD_MAX_SIDE || t->mHeight > VD_MAX_SIDE) {
        return vd_failure(VD_ERROR_LIMIT, "an embedded texture of %u × %u texels is too large",
                          t->mWidth, t->mHeight);
    }
    vd_status status =
        vd_picture_create(import->context, (int)t->mWidth, (int)t->mHeight, 4, 8, out);
    for (unsigned y = 0; y < t->mHeight && status.code == VD_OK; y++) {
        uint8_t *row = (uint8_t *)(*out)->data + y * (*out)->stride_bytes;
        for (unsigned x = 0; x < t->mWidth; x++) {
            const struct aiTexel c = t->pcData[(size_t)y * t->mWidth + x];
            row[4 * x] = c.r;
            row[4 * x + 1] = c.g;
            row[4 * x + 2] = c.b;
            row[4 * x + 3] = c.a;
        }
    }
    return status;
}

/* Finds an embedded texture: *N is its number, else the name is a file's that was packed. */
static const struct aiTexture *find_embedded(const struct aiScene *scene, const char *name) {
    if (name[0] == '*') {
        const unsigned long number = strtoul(name + 1, NULL, 10);
        return number < scene->mNumTextures ? scene->mTextures[number] : NULL;
    }
    for (unsigned i = 0; i < scene->mNumTextures; i++) {
        if (strcmp(scene->mTextures[i]->mFilename.data, name) == 0) {
            return scene->mTextures[i];
        }
    }
    return NULL;
}

/* Loads what a material names: embedded, or a file beside the model. */
static vd_status load_picture(vd_import *import, const char *name, char shown[256],
                              vd_picture **out) {
    const struct aiTexture *embedded = find_embedded(import->scene, name);
    if (embedded != NULL) {
        (void)snprintf(shown, 256, "embedded texture %.200s",
                       embedded->mFilename.length > 0 ? embedded->mFilename.data : name + 1);
        return embedded->mHeight == 0 ? vd_picture_decode(import->context, embedded->pcData,
                                                          embedded->mWidth, shown, out)
                                      : from_texels(import, embedded, out);
    }
    const char *slash = strrchr(import->path, '/');
    const bool absolute = name[0] == '/' || name[0] == '\\';
    const int folder = slash != NULL && !absolute ? (int)(slash - import->path) + 1 : 0;
    if (snprintf(shown, 256, "%.*s%.255s", folder, import->path, name) >= 256) {
        return vd_failure(VD_ERROR_LIMIT, "the path of the texture %.100s is too long", name);
    }
    for (char *c = shown; *c != '\0'; c++) {
        *c = *c == '\\' ? '/' : *c;
    }
    return vd_picture_load(import->context, shown, out);
}

static vd_status add_texture(vd_import *import, const char *name, vd_model_surface *s) {
    char shown[256];
    vd_picture *picture = NULL;
    vd_status status = load_picture(import, name, shown, &picture);
    for (int i = 0; i < import->texture_count && status.code == VD_OK; i++) {
        if (strcmp(import->texture_names[i], shown) == 0) {
            s->texture = i;
            vd_picture_destroy(&picture);
            return status;
        }
    }
    const int at = import->texture_count;
    if (status.code == VD_OK) {
        status = vd_texture_create(import->context, picture, &import->textures[at]);
    }
    vd_picture_destroy(&picture);
    if (status.code == VD_OK) {
        memcpy(import->texture_names[at], shown, sizeof shown);
        s->texture = at;
        import->texture_count++;
    } else if (status.code != VD_ERROR_MEMORY) {
        status = vd_failure(status.code, "%.230s; it is the texture of material \"%.30s\" of %.80s",
                            status.message, s->name, import->path);
    }
    return status;
}

static vd_status read_texture(vd_import *import, const struct aiMaterial *from, vd_material *m,
                              vd_model_surface *s) {
    struct aiString name;
    if (aiGetMaterialTexture(from, aiTextureType_BASE_COLOR, 0, &name, NULL, NULL, NULL, NULL, NULL,
                             NULL) != aiReturn_SUCCESS &&
        aiGetMaterialTexture(from, aiTextureType_DIFFUSE, 0, &name, NULL, NULL, NULL, NULL, NULL,
                             NULL) != aiReturn_SUCCESS) {
        return vd_success();
    }
    if (name.length == 0) {
        return vd_success();
    }
    if (!(m->albedo.r > 0.0f || m->albedo.g > 0.0f || m->albedo.b > 0.0f)) {
        m->albedo = (vd_linear){1, 1, 1}; /* black times any texture is black */
    }
    return add_texture(import, name.data, s);
}

vd_status vd_import_materials(vd_import *import) {
    const size_t count = import->scene->mNumMaterials;
    vd_context *context = import->context;
    import->materials = vd_allocate(context, count, sizeof *import->materials);
    import->surfaces = vd_allocate(context, count, sizeof *import->surfaces);
    import->textures = vd_allocate(context, count, sizeof *import->textures);
    import->texture_names = vd_allocate(context, count, sizeof *import->texture_names);
    if (import->materials == NULL || import->surfaces == NULL || import->textures == NULL ||
        import->texture_names == NULL) {
        return vd_failure(VD_ERROR_MEMORY, "out of memory for the %zu materials of %.200s", count,
                          import->path);
    }
    vd_status status = vd_success();
    for (size_t i = 0; i < count && status.code == VD_OK; i++) {
        const struct aiMaterial *from = import->scene->mMaterials[i];
        read_material(import, from, &import->materials[i], &import->surfaces[i]);
        if (!import->skip_textures) {
            status = read_texture(import, from, &import->materials[i], &import->surfaces[i]);
        }
    }
    return status;
}

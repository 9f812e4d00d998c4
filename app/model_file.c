/* model_file.c: which reader reads which model. */
#include "model_file.h"

#include <stdio.h>
#include <string.h>
#include <unistd.h>

#if defined(VEDUTA_MODEL_LINKED)

#include <veduta/model_import.h>

static vd_status import(vd_context *context, const char *path, const vd_model_def *def,
                        vd_model **out) {
    return vd_model_import(context, path, def, out);
}

#elif defined(VEDUTA_MODEL_LIBRARY)

#include <dlfcn.h>
#include <signal.h>

/* assimp's readers of some formats crash on some broken files. That ends this program, but with the
 * sentence that everything from outside gets. Under a sanitizer assimp is linked instead, and this
 * is not here. */
static char crash_sentence[512];
static const int crashes[] = {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT};
enum { CRASHES = sizeof crashes / sizeof crashes[0] };

static void say_crashed(int number) {
    (void)number;
    if (write(STDERR_FILENO, crash_sentence, strlen(crash_sentence)) < 0) {
        _exit(1); /* nowhere to say it */
    }
    _exit(1);
}

/* Sets or, with `before` given back, unsets the handlers; on a stack of their own, since endless
 * recursion is one of the crashes. */
static void guard(const char *path, struct sigaction before[CRASHES]) {
    static char stack[1 << 16];
    const stack_t alternative = {.ss_sp = stack, .ss_size = sizeof stack};
    (void)snprintf(
        crash_sentence, sizeof crash_sentence,
        "veduta: cannot read %.300s: assimp crashed on it, so it is damaged; get the file "
        "again, or convert it to PLY\n",
        path);
    (void)sigaltstack(&alternative, NULL);
    for (int i = 0; i < CRASHES; i++) {
        struct sigaction action = {.sa_handler = say_crashed, .sa_flags = SA_ONSTACK};
        (void)sigaction(crashes[i], &action, &before[i]);
    }
}

static void unguard(const struct sigaction before[CRASHES]) {
    for (int i = 0; i < CRASHES; i++) {
        (void)sigaction(crashes[i], &before[i], NULL);
    }
}

static vd_status import(vd_context *context, const char *path, const vd_model_def *def,
                        vd_model **out) {
    vd_status (*function)(vd_context *, const char *, const vd_model_def *, vd_model **);
    void *library = dlopen(VEDUTA_MODEL_LIBRARY, RTLD_NOW | RTLD_LOCAL);
    if (library == NULL) {
        return vd_failure(VD_ERROR_UNSUPPORTED,
                          "cannot read %.120s without assimp, and %s does not load (%.100s); "
                          "install veduta-model and assimp, or convert the file to OBJ or PLY",
                          path, VEDUTA_MODEL_LIBRARY, dlerror());
    }
    void *address = dlsym(library, "vd_model_import");
    if (address == NULL) {
        return vd_failure(VD_ERROR_UNSUPPORTED,
                          "cannot read %.120s: %s lacks vd_model_import; install the veduta-model "
                          "of version %s",
                          path, VEDUTA_MODEL_LIBRARY, vd_version());
    }
    memcpy(&function, &address, sizeof address);
    struct sigaction before[CRASHES];
    guard(path, before);
    const vd_status status = function(context, path, def, out);
    unguard(before);
    return status;
}

#else

static vd_status import(vd_context *context, const char *path, const vd_model_def *def,
                        vd_model **out) {
    (void)context;
    (void)def;
    (void)out;
    return vd_failure(VD_ERROR_UNSUPPORTED,
                      "cannot read %.200s: this veduta was built without assimp and reads OBJ, PLY "
                      "and OFF only; convert the file, or install libassimp-dev and build with "
                      "VEDUTA_MODEL=ON",
                      path);
}

#endif

vd_status vd_model_open(vd_context *context, const char *path, bool skip_textures, vd_model **out) {
    vd_model_def def = vd_model_def_default();
    def.skip_textures = skip_textures;
    vd_status status = vd_model_load(context, path, &def, out);
    if (status.code == VD_ERROR_UNSUPPORTED) {
        /* What cannot be opened is said here once for all of assimp's readers. */
        if (access(path, R_OK) != 0) {
            return vd_failure(VD_ERROR_IO, "cannot read %.200s: %s; check the name", path,
                              "no such file, or not permitted");
        }
        status = import(context, path, &def, out);
    }
    const bool texture = strstr(status.message, "; it is the texture of ") != NULL;
    if (status.code != VD_OK && texture && !skip_textures) {
        return vd_failure(status.code, "%.330s (--texture none does without)", status.message);
    }
    return status;
}

int vd_model_used_materials(const vd_model *model) {
    const vd_mesh *mesh = model->meshes[VD_TOPOLOGY_TRIANGLES];
    return mesh != NULL ? (int)mesh->part_count : 1;
}

json_t *vd_model_describe(const vd_model *model) {
    json_int_t counts[VD_TOPOLOGY_COUNT] = {0, 0, 0}, vertices = 0;
    bool uv = false, normals = false;
    for (int i = 0; i < VD_TOPOLOGY_COUNT; i++) {
        const vd_mesh *mesh = model->meshes[i];
        if (mesh != NULL) {
            counts[i] = mesh->primitive_count;
            vertices += mesh->vertex_count;
            uv = uv || mesh->uv >= 0;
            normals = normals || mesh->normal >= 0;
        }
    }
    json_t *textures = json_array();
    bool failed = textures == NULL;
    for (int i = 0; i < model->texture_count; i++) {
        int width = 0, height = 0;
        vd_texture_level_texels(model->textures[i], 0, &width, &height);
        json_t *one = json_pack("{s: s, s: i, s: i}", "name", model->texture_names[i], "width",
                                width, "height", height);
        failed |= json_array_append_new(textures, one) != 0;
    }
    vd_vec3 min = {0, 0, 0}, max = {0, 0, 0};
    vd_model_bounds(model, &min, &max);
    json_t *root = json_pack(
        "{s: s, s: I, s: I, s: I, s: I, s: I, s: i, s: o, s: s, s: b, s: b, s: s, s: [f, f, f], "
        "s: [f, f, f]}",
        "format", model->format, "vertices", vertices, "triangles", counts[0], "lines", counts[1],
        "points", counts[2], "flat_triangles", (json_int_t)model->flat_triangles, "materials",
        vd_model_used_materials(model), "textures", textures, "normals",
        model->computed_normals ? "computed"
        : normals               ? "file"
                                : "none",
        "texture_coordinates", (int)uv, "colors", (int)model->has_colors, "up",
        model->z_up ? "z" : "y", "min", min.x, min.y, min.z, "max", max.x, max.y, max.z);
    if (failed) {
        json_decref(root);
        return NULL;
    }
    return root;
}

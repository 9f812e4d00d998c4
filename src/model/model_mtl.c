/* model_mtl.c: MTL: colours, highlights, transparency and the texture of the colour.
 *
 * Colours are taken as sRGB-encoded, as everything in files is here. Of textures only map_Kd is
 * read, with its options read past; map_d, nearly always the same picture's alpha and leaves, makes
 * that alpha count: tested at a half, as d below 1 makes it blend.
 */
#include "model/model_mtl.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "core/file.h"
#include "model/model_text.h"

#define FILE_LIMIT_BYTES ((size_t)64 << 20)

typedef struct entry {
    char *name, *texture, *file; /* owned; texture null where there is none */
    vd_material material;
    vd_alpha_mode alpha_mode;
    uint32_t number; /* in the builder; VD_NO_INDEX: not used yet */
} entry;

typedef struct mtl {
    vd_mtl_library *library;
    vd_model_builder *builder;
    const char *path;
    vd_text text;
    entry *now; /* null before the first newmtl */
} mtl;

static float decode(double v) {
    return vd_srgb_decode((uint8_t)(v > 0.0 ? v < 1.0 ? 255.0 * v + 0.5 : 255.0 : 0.0));
}

static char *copy_bytes(vd_context *context, const char *text, size_t bytes) {
    char *copy = vd_allocate(context, bytes + 1, 1);
    if (copy != NULL) {
        memcpy(copy, text, bytes);
        copy[bytes] = '\0';
    }
    return copy;
}

/* The rest of the line without blanks at its ends. */
static size_t rest_of_line(const vd_text *text, const char **out) {
    vd_text t = *text;
    vd_skip_spaces(&t);
    const char *end = t.at;
    while (end < t.end && *end != '\n') {
        end++;
    }
    while (end > t.at && (end[-1] == ' ' || end[-1] == '\t' || end[-1] == '\r')) {
        end--;
    }
    *out = t.at;
    return (size_t)(end - t.at);
}

/* ---- statements -------------------------------------------------------------------------------*/

static vd_status begin_material(mtl *m) {
    vd_context *context = m->builder->context;
    const char *name;
    const size_t bytes = rest_of_line(&m->text, &name);
    entry *e = vd_list_add(context, &m->library->entries, 1, sizeof *e);
    m->now = e;
    if (e == NULL) {
        return vd_out_of_memory("materials", m->library->entries.count * sizeof *e);
    }
    memset(e, 0, sizeof *e);
    e->material = vd_material_default();
    e->material.specular = (vd_linear){0, 0, 0};
    e->number = VD_NO_INDEX;
    e->name = copy_bytes(context, name, bytes);
    e->file = vd_copy_string(context, m->path);
    return e->name != NULL && e->file != NULL ? vd_success()
                                              : vd_out_of_memory("a material's name", bytes);
}

/* Reads one or three numbers as a colour; what is no number leaves it as it was. */
static void read_color(mtl *m, vd_linear *out) {
    double v[3];
    if (!vd_read_real(&m->text, &v[0])) {
        return;
    }
    v[1] = v[2] = v[0];
    if (vd_read_real(&m->text, &v[1]) && !vd_read_real(&m->text, &v[2])) {
        v[2] = v[0];
    }
    *out = (vd_linear){decode(v[0]), decode(v[1]), decode(v[2])};
}

static void read_alpha(mtl *m, bool inverted) {
    double v = 1.0;
    if (vd_read_real(&m->text, &v) && v >= 0.0 && v <= 1.0) {
        m->now->material.alpha = (float)(inverted ? 1.0 - v : v);
        if (m->now->material.alpha < 1.0f) {
            m->now->alpha_mode = VD_ALPHA_BLEND;
        }
    }
}

/* The file's name behind the options, such as -s 1 1 1 or -bm 0.5: what begins with a minus, then
 * words that are numbers, on or off. */
static vd_status read_texture(mtl *m) {
    vd_text t = m->text;
    for (;;) {
        vd_skip_spaces(&t);
        if (vd_text_done(&t) || *t.at != '-') {
            break;
        }
        char word[64];
        vd_text_word(&t, word, sizeof word);
        for (;;) {
            vd_text next = t;
            double number;
            if (vd_read_real(&t, &number) && (vd_text_done(&t) || strchr(" \t\r\n", *t.at))) {
                continue;
            }
            t = next;
            vd_text_word(&next, word, sizeof word);
            if (strcmp(word, "on") != 0 && strcmp(word, "off") != 0) {
                break;
            }
            t = next;
        }
    }
    const char *name;
    const size_t bytes = rest_of_line(&t, &name);
    vd_context *context = m->builder->context;
    if (bytes > 0) {
        vd_release(context, m->now->texture);
        m->now->texture = vd_beside(context, m->path, name, bytes);
    }
    return bytes == 0 || m->now->texture != NULL ? vd_success()
                                                 : vd_out_of_memory("a texture's name", bytes);
}

static vd_status read_statement(mtl *m) {
    char word[16];
    if (!vd_text_word(&m->text, word, sizeof word)) {
        return vd_success();
    }
    if (strcmp(word, "newmtl") == 0) {
        return begin_material(m);
    }
    if (m->now == NULL) {
        return vd_success();
    }
    vd_material *material = &m->now->material;
    double v = 0.0;
    if (strcmp(word, "Kd") == 0) {
        read_color(m, &material->albedo);
    } else if (strcmp(word, "Ks") == 0) {
        read_color(m, &material->specular);
    } else if (strcmp(word, "Ke") == 0) {
        read_color(m, &material->emission);
    } else if (strcmp(word, "Ns") == 0 && vd_read_real(&m->text, &v)) {
        material->shininess = (float)(v > 1.0 ? v < 1024.0 ? v : 1024.0 : 1.0);
    } else if (strcmp(word, "d") == 0 || strcmp(word, "Tr") == 0) {
        read_alpha(m, word[0] == 'T');
    } else if (strcmp(word, "map_Kd") == 0) {
        return read_texture(m);
    } else if (strcmp(word, "map_d") == 0 && m->now->alpha_mode == VD_ALPHA_OPAQUE) {
        m->now->alpha_mode = VD_ALPHA_MASK;
    }
    return vd_success();
}

/* ---- libraries --------------------------------------------------------------------------------*/

static int compare_entries(const void *a, const void *b) {
    return strcmp(((const entry *)a)->name, ((const entry *)b)->name);
}

vd_status vd_mtl_load(vd_mtl_library *library, vd_model_builder *builder, const char *name,
                      size_t name_bytes) {
    vd_context *context = builder->context;
    char *path = vd_beside(context, builder->path, name, name_bytes);
    void *data = NULL;
    size_t size_bytes = 0;
    if (path == NULL) {
        return vd_out_of_memory("a path", name_bytes);
    }
    vd_status status = vd_file_read(context, path, FILE_LIMIT_BYTES, &data, &size_bytes);
    if (status.code == VD_ERROR_IO) {
        vd_log(context, VD_LOG_WARNING, "%.250s; its materials are drawn grey", status.message);
        vd_release(context, path);
        return vd_success();
    }
    mtl m = {library, builder, path, vd_text_make(data, size_bytes), NULL};
    while (status.code == VD_OK && !vd_text_done(&m.text)) {
        status = read_statement(&m);
        vd_text_next_line(&m.text);
    }
    if (status.code == VD_OK && library->entries.count > 0) {
        qsort(library->entries.data, library->entries.count, sizeof(entry), compare_entries);
    }
    vd_release(context, data);
    vd_release(context, path);
    return status;
}

/* Adds a material that is used for the first time. */
static vd_status add_entry(vd_model_builder *builder, entry *e) {
    vd_model_surface surface = {.texture = -1, .alpha_mode = e->alpha_mode, .alpha_cutoff = 0.5f};
    const size_t length = strlen(e->name);
    memcpy(surface.name, e->name, length < sizeof surface.name ? length : sizeof surface.name - 1);
    vd_status status = vd_success();
    if (e->texture != NULL && !builder->def.skip_textures) {
        char owner[160];
        snprintf(owner, sizeof owner, "material \"%.40s\" of %.90s", e->name, e->file);
        status = vd_builder_add_texture_file(builder, e->texture, owner, &surface.texture);
        const vd_linear c = e->material.albedo;
        if (!(c.r > 0.0f || c.g > 0.0f || c.b > 0.0f)) {
            e->material.albedo = (vd_linear){1, 1, 1}; /* black times any texture is black */
        }
    }
    return status.code == VD_OK
               ? vd_builder_add_material(builder, &e->material, &surface, &e->number)
               : status;
}

vd_status vd_mtl_find(vd_mtl_library *library, vd_model_builder *builder, const char *name,
                      size_t name_bytes, uint32_t *out) {
    entry *entries = library->entries.data;
    size_t low = 0, high = library->entries.count;
    while (low < high) {
        const size_t middle = low + (high - low) / 2;
        const char *there = entries[middle].name;
        const int order = strncmp(there, name, name_bytes);
        if (order < 0) {
            low = middle + 1;
        } else {
            high = middle;
        }
    }
    if (low < library->entries.count && strncmp(entries[low].name, name, name_bytes) == 0 &&
        entries[low].name[name_bytes] == '\0') {
        vd_status status = vd_success();
        if (entries[low].number == VD_NO_INDEX) {
            status = add_entry(builder, &entries[low]);
        }
        *out = entries[low].number;
        return status;
    }
    if (!library->warned && library->entries.count > 0) {
        vd_log(
            builder->context, VD_LOG_WARNING,
            "%.160s uses the material \"%.*s\", which its MTL files do not have; it is drawn grey",
            builder->path, (int)(name_bytes < 60 ? name_bytes : 60), name);
        library->warned = true;
    }
    *out = 0; /* the builder's first is the default */
    return vd_success();
}

void vd_mtl_finish(vd_mtl_library *library, vd_context *context) {
    entry *entries = library->entries.data;
    for (size_t i = 0; i < library->entries.count; i++) {
        vd_release(context, entries[i].name);
        vd_release(context, entries[i].texture);
        vd_release(context, entries[i].file);
    }
    vd_release(context, library->entries.data);
}

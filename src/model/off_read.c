/* off_read.c: OFF, the Object File Format of Geomview: OFF, with N normals, C colours, ST texture
 * coordinates in front of it.
 *
 * Here for the sake of broken files, not of speed (assimp takes 90 ms for the 871 k dragon): assimp
 * 5.2 leaves out faces whose indices are out of range without a word, and where the header promises
 * 800 million vertices it makes them.
 */
#include <math.h>
#include <stdio.h>
#include <string.h>
#include "model/model_build.h"
#include "model/model_text.h"

typedef struct off {
    vd_model_builder *builder;
    vd_text text;
    bool normals, colors, uvs;
    int64_t vertex_count;
    vd_list polygon; /* vd_corner */
} off;

static bool bad_line(const off *o, const char *what) {
    return vd_builder_fail(o->builder,
                           vd_failure(VD_ERROR_FORMAT,
                                      "cannot read %.160s: line %d %s; get the file again",
                                      o->builder->path, o->text.line, what));
}

/* Moves to the next line that has something beside a comment. */
static void next_line(off *o) {
    do {
        vd_text_skip_lines(&o->text);
        if (!vd_text_done(&o->text) && *o->text.at == '#') {
            vd_text_next_line(&o->text);
        }
    } while (!vd_text_done(&o->text) &&
             (*o->text.at == '#' || *o->text.at == '\n' || *o->text.at == '\r'));
}

/* [ST][C][N]OFF, which may be missing; 4OFF and nOFF are of other dimensions. */
static bool read_head(off *o, int64_t *faces) {
    next_line(o);
    vd_text before = o->text;
    char word[16];
    (void)vd_text_word(&o->text, word, sizeof word);
    const size_t length = strlen(word);
    if (length >= 3 && strcmp(word + length - 3, "OFF") == 0) {
        for (size_t i = 0; i + 3 < length; i++) {
            o->uvs = o->uvs || word[i] == 'S';
            o->colors = o->colors || word[i] == 'C';
            o->normals = o->normals || word[i] == 'N';
            if (strchr("STCN", word[i]) == NULL) {
                return bad_line(o, "says that it has other than three dimensions");
            }
        }
        next_line(o);
        before = o->text;
    }
    o->text = before;
    if (o->text.end - o->text.at >= 6 && memcmp(o->text.at, "BINARY", 6) == 0) {
        return vd_builder_fail(
            o->builder,
            vd_failure(VD_ERROR_FORMAT,
                       "cannot read %.200s: it is binary OFF; save it as text or as PLY",
                       o->builder->path));
    }
    if (!vd_read_integer(&o->text, &o->vertex_count) || !vd_read_integer(&o->text, faces) ||
        o->vertex_count < 0 || *faces < 0) {
        return bad_line(o, "does not give the numbers of vertices and faces");
    }
    vd_text_next_line(&o->text);
    /* A vertex takes six bytes, a face four. */
    const int64_t left = o->text.end - o->text.at;
    if (o->vertex_count > left / 6 + 1 || *faces > left / 4 + 1) {
        return vd_builder_fail(
            o->builder,
            vd_failure(VD_ERROR_FORMAT,
                       "cannot read %.160s: it promises %lld vertices and %lld faces, for which "
                       "the file is too short; get the file again",
                       o->builder->path, (long long)o->vertex_count, (long long)*faces));
    }
    return true;
}

static bool add_floats(off *o, vd_list *list, const double *values, size_t count) {
    float *to = vd_list_add(o->builder->context, list, 1, count * sizeof *to);
    for (size_t i = 0; i < count && to != NULL; i++) {
        /* What is no direction or place counts as none. */
        to[i] = fabs(values[i]) < 1e6 ? (float)values[i] : 0.0f;
    }
    return to != NULL;
}

static bool add_color(off *o, const double c[3]) {
    float *to = vd_list_add(o->builder->context, &o->builder->colors, 1, 3 * sizeof *to);
    const double scale = c[0] > 1.0 || c[1] > 1.0 || c[2] > 1.0 ? 1.0 : 255.0;
    for (int i = 0; i < 3 && to != NULL; i++) {
        const double v = c[i] * scale;
        to[i] = vd_srgb_decode((uint8_t)(v > 0.0 ? v < 255.0 ? v + 0.5 : 255.0 : 0.0));
    }
    return to != NULL;
}

static bool read_vertex(off *o) {
    double v[12] = {0.0};
    const int wanted = 3 + 3 * o->normals + 3 * o->colors + 2 * o->uvs;
    vd_model_builder *b = o->builder;
    int count = 0;
    while (count < 12 && vd_read_real(&o->text, &v[count])) {
        count++;
    }
    if (count < wanted) {
        return bad_line(o, vd_text_done(&o->text) ? "is the last: vertices are missing"
                                                  : "has too few numbers for a vertex");
    }
    if (!vd_builder_add_position(b, v[0], v[1], v[2])) {
        char where[32];
        (void)snprintf(where, sizeof where, "line %d", o->text.line);
        return vd_builder_refuse(b, where, v[0], v[1], v[2]);
    }
    const double *at = v + 3;
    bool fits = true;
    if (o->normals) {
        fits = add_floats(o, &b->normals, at, 3);
        at += 3;
    }
    if (o->colors) {
        fits = fits && add_color(o, at);
        at = v + count - 2; /* with or without alpha */
    }
    if (o->uvs) {
        const double uv[2] = {at[0], 1.0 - at[1]};
        fits = fits && add_floats(o, &b->uvs, uv, 2);
    }
    return fits ||
           vd_builder_fail(b, vd_out_of_memory("a model's vertices", b->positions.count * 12));
}

static bool read_face(off *o) {
    int64_t count = 0;
    if (!vd_read_integer(&o->text, &count)) {
        return bad_line(o, vd_text_done(&o->text) ? "is the last: faces are missing"
                                                  : "does not begin with a number of corners");
    }
    if (count < 0 || count > (o->text.end - o->text.at) / 2 + 1) {
        return bad_line(o, "has more corners than the file has numbers");
    }
    o->polygon.count = 0;
    vd_corner *corners =
        vd_list_add(o->builder->context, &o->polygon, (size_t)count, sizeof *corners);
    if (corners == NULL) {
        return vd_builder_fail(o->builder,
                               vd_out_of_memory("a face", (size_t)count * sizeof *corners));
    }
    for (int64_t i = 0; i < count; i++) {
        int64_t index = 0;
        if (!vd_read_integer(&o->text, &index)) {
            return bad_line(o, "has too few corners");
        }
        if (index < 0 || index >= o->vertex_count) {
            char what[96];
            (void)snprintf(what, sizeof what, "names vertex %lld, but there are only %lld",
                           (long long)index, (long long)o->vertex_count);
            return bad_line(o, what);
        }
        corners[i] = (vd_corner){(uint32_t)index, VD_NO_INDEX, VD_NO_INDEX};
    }
    return count < 3 || vd_builder_add_polygon(o->builder, corners, (size_t)count);
}

vd_status vd_off_read(vd_model_builder *builder, const char *text, size_t size_bytes) {
    off o = {.builder = builder, .text = vd_text_make(text, size_bytes)};
    int64_t faces = 0;
    strcpy(builder->model->format, "OFF");
    bool read = read_head(&o, &faces);
    builder->normals_by = o.normals ? VD_BY_POSITION : VD_BY_NONE;
    builder->uvs_by = o.uvs ? VD_BY_POSITION : VD_BY_NONE;
    for (int64_t i = 0; i < o.vertex_count && read; i++) {
        next_line(&o);
        read = read_vertex(&o);
        vd_text_next_line(&o.text);
    }
    for (int64_t i = 0; i < faces && read; i++) {
        next_line(&o);
        read = read_face(&o);
        vd_text_next_line(&o.text); /* colours of faces are read past */
    }
    vd_release(builder->context, o.polygon.data);
    vd_status status = read ? vd_success() : builder->failure;
    if (status.code == VD_OK) {
        vd_material material = vd_model_clay();
        const vd_model_surface surface = {.texture = -1};
        uint32_t first = 0;
        if (o.colors) {
            material.albedo = (vd_linear){1, 1, 1};
        }
        status = vd_builder_add_material(builder, &material, &surface, &first);
    }
    return status;
}

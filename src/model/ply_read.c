/* ply_read.c: PLY (Turk 1994), in ASCII and in binary of either byte order.
 *
 * The header says which numbers each element has; every one of them is read by one function, which
 * hands it to what its name stands for. Counts are held against the bytes that are left before
 * anything is made of them: a header of 200 bytes may promise four billion vertices.
 *
 * Reading the 871 k dragon on one thread of Zen 4, in CPU milliseconds: assimp 5.2 171 (ASCII) and
 * 119 (binary), a floor that does nothing but find the numbers 45 and 3.4. That is 3.8 and 35 times
 * the floor, and past five times it a reader of our own was called for: this one takes 2 and 5
 * times the floor. What follows for every reader (equal positions, normals, the mesh) takes about
 * as long as assimp takes to read.
 */
#include <math.h>
#include <stdio.h>
#include <string.h>
#include "model/ply.h"

/* Corners of one face; strips may be longer and are read as they come. */
#define MOST_IN_LIST 65536

/* ---- numbers ----------------------------------------------------------------------------------*/

static bool bad_element(const vd_ply *p, const char *what) {
    char where[32] = "";
    if (p->ascii) {
        (void)snprintf(where, sizeof where, " (line %d)", p->text.line);
    }
    return vd_builder_fail(
        p->builder,
        vd_failure(VD_ERROR_FORMAT, "cannot read %.160s: %s %llu%s %s; get the file again",
                   p->builder->path, p->now->name, (unsigned long long)p->at, where, what));
}

static bool no_memory(const vd_ply *p, const char *what, size_t bytes) {
    return vd_builder_fail(p->builder, vd_out_of_memory(what, bytes));
}

static inline bool read_binary(vd_ply *p, vd_number_type type, double *out) {
    const int bytes = vd_number_bytes(type);
    if (p->text.end - p->text.at < bytes) {
        return false;
    }
    *out = vd_number_read(p->text.at, type, p->swapped);
    p->text.at += bytes;
    return true;
}

static inline bool read_number(vd_ply *p, vd_number_type type, double *out) {
    if (!p->ascii) {
        return read_binary(p, type, out);
    }
    vd_skip_spaces(&p->text);
    if (p->text.at < p->text.end && *p->text.at == '\n') {
        vd_text_skip_lines(&p->text);
    }
    return vd_read_real(&p->text, out);
}

/* Reads a list's count, held against what is left: a number takes two bytes of text or its own. */
static bool read_count(vd_ply *p, const vd_ply_property *q, size_t *out) {
    double count = 0.0;
    if (!read_number(p, q->count_type, &count)) {
        return bad_element(p, "ends too early");
    }
    const size_t left = (size_t)(p->text.end - p->text.at);
    const size_t most = p->ascii ? left / 2 + 1 : left / (size_t)vd_number_bytes(q->type);
    if (!(count >= 0.0 && count <= (double)most) || count != (double)(size_t)count) {
        return bad_element(p, "has a list longer than the file");
    }
    *out = (size_t)count;
    return true;
}

/* Reads a list into `to`, or past it where that is null. */
static bool read_list(vd_ply *p, const vd_ply_property *q, vd_list *to) {
    size_t count = 0;
    double *values = NULL;
    if (!read_count(p, q, &count)) {
        return false;
    }
    if (to != NULL) {
        to->count = 0;
        values = vd_list_add(p->builder->context, to, count, sizeof *values);
        if (values == NULL) {
            return no_memory(p, "a face", count * sizeof *values);
        }
    }
    for (size_t i = 0; i < count; i++) {
        double value = 0.0;
        if (!read_number(p, q->type, &value)) {
            return bad_element(p, "ends too early");
        }
        if (values != NULL) {
            values[i] = value;
        }
    }
    return true;
}

/* Reads all properties of one element: numbers to `values` by their use, lists to p->list and
 * p->texcoords. */
static bool read_properties(vd_ply *p, const vd_ply_element *e, double values[USE_COUNT]) {
    for (int i = 0; i < e->property_count; i++) {
        const vd_ply_property *q = &e->properties[i];
        if (!q->is_list) {
            if (!read_number(p, q->type, &values[q->use])) {
                return bad_element(p, vd_text_done(&p->text) ? "ends too early"
                                                             : "has something that is no number");
            }
            continue;
        }
        if (!read_list(p, q,
                       q->use == USE_CORNERS    ? &p->list
                       : q->use == USE_TEXCOORD ? &p->texcoords
                                                : NULL)) {
            return false;
        }
    }
    return true;
}

/* ---- elements ---------------------------------------------------------------------------------*/

static float linear_channel(const vd_ply_element *e, double v) {
    for (int i = 0; i < e->property_count; i++) {
        if (e->properties[i].use == USE_RED && e->properties[i].type >= VD_NUMBER_F32) {
            v *= 255.0;
        } else if (e->properties[i].use == USE_RED && e->properties[i].type == VD_NUMBER_U16) {
            v /= 257.0;
        }
    }
    return vd_srgb_decode((uint8_t)(v > 0.0 ? v < 255.0 ? v + 0.5 : 255.0 : 0.0));
}

static bool add_floats(vd_ply *p, vd_list *list, const double *values, size_t count) {
    float *to = vd_list_add(p->builder->context, list, 1, count * sizeof *to);
    for (size_t i = 0; i < count && to != NULL; i++) {
        to[i] = (float)values[i];
    }
    return to != NULL;
}

static bool read_vertex(vd_ply *p, const vd_ply_element *e) {
    vd_model_builder *b = p->builder;
    double v[USE_COUNT] = {0.0};
    if (!read_properties(p, e, v)) {
        return false;
    }
    if (!vd_builder_add_position(b, v[USE_X], v[USE_Y], v[USE_Z])) {
        char where[64];
        (void)snprintf(where, sizeof where, "vertex %llu", (unsigned long long)p->at);
        return vd_builder_refuse(b, where, v[USE_X], v[USE_Y], v[USE_Z]);
    }
    bool fits = true;
    if (b->normals_by == VD_BY_POSITION) {
        /* One that is no direction counts as none; then all are computed. */
        double n[3] = {v[USE_NX], v[USE_NY], v[USE_NZ]};
        for (int i = 0; i < 3; i++) {
            n[i] = n[i] >= -1e6 && n[i] <= 1e6 ? n[i] : 0.0;
        }
        fits = add_floats(p, &b->normals, n, 3);
    }
    if (b->uvs_by == VD_BY_POSITION) {
        const double uv[2] = {v[USE_U], 1.0 - v[USE_V]};
        if (!(fabs(uv[0]) < 1e6 && fabs(uv[1]) < 1e6)) {
            return bad_element(p, "has texture coordinates that are no place in a texture");
        }
        fits = fits && add_floats(p, &b->uvs, uv, 2);
    }
    if (e->has[USE_RED] && e->has[USE_GREEN] && e->has[USE_BLUE]) {
        const double rgb[3] = {(double)linear_channel(e, v[USE_RED]),
                               (double)linear_channel(e, v[USE_GREEN]),
                               (double)linear_channel(e, v[USE_BLUE])};
        fits = fits && add_floats(p, &b->colors, rgb, 3);
    }
    return fits || no_memory(p, "a model's vertices", b->positions.count * 12);
}

/* Reads a vertex number; strips may have −1 beside. */
static bool to_vertex(const vd_ply *p, double number, uint32_t *out) {
    if (!(number >= 0.0 && number < (double)p->vertex_count) ||
        number != (double)(uint32_t)number) {
        return false;
    }
    *out = (uint32_t)number;
    return true;
}

static bool bad_index(const vd_ply *p, double number) {
    char what[96];
    (void)snprintf(what, sizeof what, "names vertex %.17g, but there are only %u", number,
                   p->vertex_count);
    return bad_element(p, what);
}

static bool add_texcoord(vd_ply *p, const double uv[2], uint32_t *out) {
    vd_model_builder *b = p->builder;
    const double flipped[2] = {uv[0], 1.0 - uv[1]};
    *out = (uint32_t)b->uvs.count;
    if (!(fabs(flipped[0]) < 1e6 && fabs(flipped[1]) < 1e6)) {
        return bad_element(p, "has texture coordinates that are no place in a texture");
    }
    return add_floats(p, &b->uvs, flipped, 2) ||
           no_memory(p, "texture coordinates", b->uvs.count * 8);
}

static bool read_face(vd_ply *p, const vd_ply_element *e) {
    vd_model_builder *b = p->builder;
    double values[USE_COUNT];
    p->list.count = p->texcoords.count = p->corners.count = 0;
    if (!read_properties(p, e, values)) {
        return false;
    }
    const size_t count = p->list.count;
    if (count < 3) {
        return true; /* covers nothing */
    }
    if (count > MOST_IN_LIST) {
        return bad_element(p, "has more than 65536 corners");
    }
    vd_corner *corners = vd_list_add(b->context, &p->corners, count, sizeof *corners);
    if (corners == NULL) {
        return no_memory(p, "a face", count * sizeof *corners);
    }
    const double *list = p->list.data, *uv = p->texcoords.data;
    const bool textured = b->uvs_by != VD_BY_POSITION && p->texcoords.count == 2 * count;
    for (size_t i = 0; i < count; i++) {
        corners[i] = (vd_corner){0, VD_NO_INDEX, VD_NO_INDEX};
        if (!to_vertex(p, list[i], &corners[i].position)) {
            return bad_index(p, list[i]);
        }
        if (textured && !add_texcoord(p, uv + 2 * i, &corners[i].uv)) {
            return false;
        }
    }
    return vd_builder_add_polygon(b, corners, count);
}

/* What most files have: a byte 3 and three numbers of four bytes, as this machine stores them.
 * False leaves the face to read_face. */
static inline bool read_plain_triangle(vd_ply *p) {
    uint32_t v[3];
    if (p->text.end - p->text.at < 13 || *p->text.at != 3) {
        return false;
    }
    memcpy(v, p->text.at + 1, sizeof v);
    if (v[0] >= p->vertex_count || v[1] >= p->vertex_count || v[2] >= p->vertex_count) {
        return false;
    }
    const vd_corner corners[3] = {{v[0], VD_NO_INDEX, VD_NO_INDEX},
                                  {v[1], VD_NO_INDEX, VD_NO_INDEX},
                                  {v[2], VD_NO_INDEX, VD_NO_INDEX}};
    if (!vd_builder_add_triangle(p->builder, corners)) {
        return false; /* read_face fails again, with the sentence */
    }
    p->text.at += 13;
    return true;
}

static bool has_plain_triangles(const vd_ply *p, const vd_ply_element *e) {
    const vd_ply_property *q = &e->properties[0];
    return e->kind == FACE && !p->ascii && !p->swapped && e->property_count == 1 &&
           q->use == USE_CORNERS &&
           (q->count_type == VD_NUMBER_U8 || q->count_type == VD_NUMBER_I8) &&
           (q->type == VD_NUMBER_I32 || q->type == VD_NUMBER_U32);
}

/* A run of triangles, each of the last three numbers, every other one turned round; −1 begins a new
 * run. */
static bool read_strip(vd_ply *p, const vd_ply_element *e) {
    double values[USE_COUNT];
    p->list.count = 0;
    if (!read_properties(p, e, values)) {
        return false;
    }
    const double *list = p->list.data;
    size_t start = 0;
    for (size_t i = 0; i < p->list.count; i++) {
        uint32_t v[3] = {0, 0, 0};
        if (list[i] == -1.0) {
            start = i + 1;
            continue;
        }
        if (!to_vertex(p, list[i], &v[2])) {
            return bad_index(p, list[i]);
        }
        if (i < start + 2 || !to_vertex(p, list[i - 1], &v[1]) ||
            !to_vertex(p, list[i - 2], &v[0]) || v[0] == v[1] || v[1] == v[2] || v[0] == v[2]) {
            continue;
        }
        const bool turned = (i - start) % 2 != 0;
        const vd_corner triangle[3] = {{v[turned], VD_NO_INDEX, VD_NO_INDEX},
                                       {v[!turned], VD_NO_INDEX, VD_NO_INDEX},
                                       {v[2], VD_NO_INDEX, VD_NO_INDEX}};
        if (!vd_builder_add_triangle(p->builder, triangle)) {
            return false;
        }
    }
    return true;
}

static bool read_edge(vd_ply *p, const vd_ply_element *e) {
    double values[USE_COUNT] = {0.0};
    if (!read_properties(p, e, values)) {
        return false;
    }
    if (!e->has[USE_FIRST] || !e->has[USE_SECOND]) {
        return true;
    }
    uint32_t *to = vd_list_add(p->builder->context, &p->builder->line_ends, 2, sizeof *to);
    if (to == NULL) {
        return no_memory(p, "a model's lines", p->builder->line_ends.count * sizeof *to);
    }
    for (int i = 0; i < 2; i++) {
        if (!to_vertex(p, values[USE_FIRST + i], &to[i])) {
            return bad_index(p, values[USE_FIRST + i]);
        }
    }
    return true;
}

static bool read_other(vd_ply *p, const vd_ply_element *e) {
    double values[USE_COUNT];
    return read_properties(p, e, values);
}

/* The fewest bytes that one element takes. */
static size_t least_bytes(const vd_ply *p, const vd_ply_element *e) {
    size_t bytes = 0;
    for (int i = 0; i < e->property_count; i++) {
        const vd_ply_property *q = &e->properties[i];
        bytes += p->ascii ? 2 : (size_t)vd_number_bytes(q->is_list ? q->count_type : q->type);
    }
    return bytes;
}

static bool read_elements(vd_ply *p, const vd_ply_element *e) {
    static bool (*const readers[])(vd_ply *, const vd_ply_element *) = {
        [OTHER] = read_other, [VERTEX] = read_vertex, [FACE] = read_face,
        [STRIP] = read_strip, [EDGE] = read_edge,
    };
    p->now = e;
    p->at = 0;
    const size_t bytes = least_bytes(p, e), left = (size_t)(p->text.end - p->text.at) + 1;
    if (e->count > 0 && (bytes == 0 || e->count > left / bytes)) {
        return vd_builder_fail(
            p->builder,
            vd_failure(
                VD_ERROR_FORMAT,
                "cannot read %.160s: its header promises %llu of \"%s\", for which the file is "
                "too short; get the file again",
                p->builder->path, (unsigned long long)e->count, e->name));
    }
    const bool plain = has_plain_triangles(p, e);
    for (; p->at < e->count; p->at++) {
        if (!(plain && read_plain_triangle(p)) && !readers[e->kind](p, e)) {
            return false;
        }
    }
    return true;
}

/* ---- the file ---------------------------------------------------------------------------------*/

static vd_status add_material(vd_ply *p) {
    vd_model_builder *b = p->builder;
    vd_material material = vd_model_clay();
    vd_model_surface surface = {.texture = -1};
    vd_status status = vd_success();
    if (p->texture[0] != '\0' && !b->def.skip_textures && b->uvs_by != VD_BY_NONE) {
        char *path = vd_beside(b->context, b->path, p->texture, strlen(p->texture));
        status = path == NULL ? vd_out_of_memory("a path", strlen(b->path))
                              : vd_builder_add_texture_file(b, path, b->path, &surface.texture);
        vd_release(b->context, path);
        material.albedo = (vd_linear){1, 1, 1};
    }
    if (b->colors.count > 0) {
        material.albedo = (vd_linear){1, 1, 1};
    }
    uint32_t first = 0;
    return status.code == VD_OK ? vd_builder_add_material(b, &material, &surface, &first) : status;
}

vd_status vd_ply_read(vd_model_builder *builder, const char *text, size_t size_bytes) {
    vd_ply p = {.builder = builder, .text = vd_text_make(text, size_bytes)};
    vd_status status = vd_ply_read_header(&p);
    const vd_ply_element *vertices = NULL;
    for (int i = 0; i < p.element_count; i++) {
        vertices = p.elements[i].kind == VERTEX ? &p.elements[i] : vertices;
    }
    if (status.code == VD_OK && (vertices == NULL || !vertices->has[USE_X] ||
                                 !vertices->has[USE_Y] || !vertices->has[USE_Z])) {
        status = vd_failure(VD_ERROR_FORMAT,
                            "cannot read %.200s: its header has no vertices with x, y and z; it "
                            "holds no model",
                            builder->path);
    }
    if (status.code == VD_OK) {
        const bool *has = vertices->has;
        p.vertex_count = vertices->count < UINT32_MAX ? (uint32_t)vertices->count : UINT32_MAX;
        builder->normals_by =
            has[USE_NX] && has[USE_NY] && has[USE_NZ] ? VD_BY_POSITION : VD_BY_NONE;
        builder->uvs_by = has[USE_U] && has[USE_V] ? VD_BY_POSITION : VD_BY_NONE;
    }
    for (int i = 0; i < p.element_count && status.code == VD_OK; i++) {
        /* Faces may stand before the vertices; positions are needed to cut polygons. */
        if (&p.elements[i] < vertices && p.elements[i].kind != OTHER) {
            status = vd_failure(VD_ERROR_FORMAT,
                                "cannot read %.200s: its faces stand before its vertices; save it "
                                "with vertices first",
                                builder->path);
        } else if (!read_elements(&p, &p.elements[i])) {
            status = builder->failure;
        }
    }
    if (status.code == VD_OK) {
        status = add_material(&p);
    }
    vd_release(builder->context, p.list.data);
    vd_release(builder->context, p.texcoords.data);
    vd_release(builder->context, p.corners.data);
    return status;
}

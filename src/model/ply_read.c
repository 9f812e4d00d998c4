/* ply_read.c: PLY (Turk 1994), in ASCII and in binary of either byte order.
 *
 * The header says which numbers each element has; every one of them is read by one function, which
 * hands it to what its name stands for. Counts are held against the bytes that are left before
 * anything is made of them: a header of 200 bytes may promise four billion vertices.
 *
 * Reading the 871 k dragon on one thread of Zen 4, in CPU milliseconds: assimp 5.2 171 (ASCII) and
 * 119 (binary), a floor that does nothing but find the numbers 45 and 3.4. That is 3.8 and 35 times
 * the floor, and past five times it a reader of our own was called for; DRAGON_FIGURES.
 */
#include <math.h>
#include <stdio.h>
#include <string.h>
#include "model/ply.h"

#define MOST_IN_LIST                                                                               \
    65536 /* corners of one face; strips may be longer and are read as they come                   \
           */

static const size_t type_bytes[TYPE_COUNT] = {1, 1, 2, 2, 4, 4, 4, 8};

/* ---- numbers ----------------------------------------------------------------------------------*/

static vd_status bad_element(const vd_ply *p, const char *what) {
    char where[32] = "";
    if (p->ascii) {
        snprintf(where, sizeof where, " (line %d)", p->text.line);
    }
    return vd_failure(VD_ERROR_FORMAT, "cannot read %.160s: %s %llu%s %s; get the file again",
                      p->builder->path, p->now->name, (unsigned long long)p->at, where, what);
}

static bool read_binary(vd_ply *p, vd_ply_number type, double *out) {
    const size_t bytes = type_bytes[type];
    union {
        uint8_t bytes[8];
        int8_t i8;
        uint8_t u8;
        int16_t i16;
        uint16_t u16;
        int32_t i32;
        uint32_t u32;
        float f32;
        double f64;
    } v;
    if ((size_t)(p->text.end - p->text.at) < bytes) {
        return false;
    }
    for (size_t i = 0; i < bytes; i++) {
        v.bytes[i] = (uint8_t)p->text.at[p->swapped ? bytes - 1 - i : i];
    }
    p->text.at += bytes;
    switch (type) {
    case I8:
        *out = v.i8;
        break;
    case U8:
        *out = v.u8;
        break;
    case I16:
        *out = v.i16;
        break;
    case U16:
        *out = v.u16;
        break;
    case I32:
        *out = v.i32;
        break;
    case U32:
        *out = v.u32;
        break;
    case F32:
        *out = (double)v.f32;
        break;
    default:
        *out = v.f64;
        break;
    }
    return true;
}

static inline bool read_number(vd_ply *p, vd_ply_number type, double *out) {
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
static vd_status read_count(vd_ply *p, const vd_ply_property *q, size_t *out) {
    double count = 0.0;
    if (!read_number(p, q->count_type, &count)) {
        return bad_element(p, "ends too early");
    }
    const size_t left = (size_t)(p->text.end - p->text.at);
    const size_t most = p->ascii ? left / 2 + 1 : left / type_bytes[q->type];
    if (!(count >= 0.0 && count <= (double)most) || count != (double)(size_t)count) {
        return bad_element(p, "has a list longer than the file");
    }
    *out = (size_t)count;
    return vd_success();
}

/* Reads a list into `to`, or past it where that is null. */
static vd_status read_list(vd_ply *p, const vd_ply_property *q, vd_list *to) {
    size_t count = 0;
    vd_status status = read_count(p, q, &count);
    double *values = NULL;
    if (status.code == VD_OK && to != NULL) {
        to->count = 0;
        values = vd_list_add(p->builder->context, to, count, sizeof *values);
        status = values == NULL ? vd_out_of_memory("a face", count * sizeof *values) : status;
    }
    for (size_t i = 0; i < count && status.code == VD_OK; i++) {
        double value = 0.0;
        if (!read_number(p, q->type, &value)) {
            return bad_element(p, "ends too early");
        }
        if (values != NULL) {
            values[i] = value;
        }
    }
    return status;
}

/* Reads all properties of one element: numbers to `values` by their use, lists to p->list and
 * p->texcoords. */
static vd_status read_properties(vd_ply *p, const vd_ply_element *e, double values[USE_COUNT]) {
    for (int i = 0; i < e->property_count; i++) {
        const vd_ply_property *q = &e->properties[i];
        if (!q->is_list) {
            if (!read_number(p, q->type, &values[q->use])) {
                return bad_element(p, vd_text_done(&p->text) ? "ends too early"
                                                             : "has something that is no number");
            }
            continue;
        }
        vd_status status = read_list(p, q,
                                     q->use == USE_CORNERS    ? &p->list
                                     : q->use == USE_TEXCOORD ? &p->texcoords
                                                              : NULL);
        if (status.code != VD_OK) {
            return status;
        }
    }
    return vd_success();
}

/* ---- elements ---------------------------------------------------------------------------------*/

static float linear_channel(const vd_ply_element *e, double v) {
    for (int i = 0; i < e->property_count; i++) {
        if (e->properties[i].use == USE_RED && e->properties[i].type >= F32) {
            v *= 255.0;
        } else if (e->properties[i].use == USE_RED && e->properties[i].type == U16) {
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

static vd_status read_vertex(vd_ply *p, const vd_ply_element *e) {
    vd_model_builder *b = p->builder;
    double v[USE_COUNT] = {0.0};
    vd_status status = read_properties(p, e, v);
    if (status.code != VD_OK) {
        return status;
    }
    if (!vd_builder_add_position(b, v[USE_X], v[USE_Y], v[USE_Z])) {
        char where[64];
        snprintf(where, sizeof where, "vertex %llu", (unsigned long long)p->at);
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
    return fits ? status : vd_out_of_memory("a model's vertices", b->positions.count * 12);
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

static vd_status bad_index(const vd_ply *p, double number) {
    char what[96];
    snprintf(what, sizeof what, "names vertex %.17g, but there are only %u", number,
             p->vertex_count);
    return bad_element(p, what);
}

static vd_status read_face(vd_ply *p, const vd_ply_element *e) {
    vd_model_builder *b = p->builder;
    double values[USE_COUNT];
    p->list.count = p->texcoords.count = 0;
    vd_status status = read_properties(p, e, values);
    const size_t count = p->list.count;
    if (status.code != VD_OK || count < 3) {
        return status; /* a face of fewer corners covers nothing */
    }
    if (count > MOST_IN_LIST) {
        return bad_element(p, "has more than 65536 corners");
    }
    vd_corner few[8], *corners = few;
    if (count > 8) {
        corners = vd_allocate(b->context, count, sizeof *corners);
        if (corners == NULL) {
            return vd_out_of_memory("a face", count * sizeof *corners);
        }
    }
    const double *list = p->list.data, *uv = p->texcoords.data;
    const bool textured = b->uvs_by != VD_BY_POSITION && p->texcoords.count == 2 * count;
    for (size_t i = 0; i < count && status.code == VD_OK; i++) {
        corners[i] = (vd_corner){0, VD_NO_INDEX, VD_NO_INDEX};
        if (!to_vertex(p, list[i], &corners[i].position)) {
            status = bad_index(p, list[i]);
        }
        if (textured && status.code == VD_OK) {
            const double flipped[2] = {uv[2 * i], 1.0 - uv[2 * i + 1]};
            corners[i].uv = (uint32_t)b->uvs.count;
            if (!(fabs(flipped[0]) < 1e6 && fabs(flipped[1]) < 1e6)) {
                status = bad_element(p, "has texture coordinates that are no place in a texture");
            } else if (!add_floats(p, &b->uvs, flipped, 2)) {
                status = vd_out_of_memory("texture coordinates", b->uvs.count * 8);
            }
        }
    }
    if (status.code == VD_OK) {
        status = vd_builder_add_polygon(b, corners, count);
    }
    if (corners != few) {
        vd_release(b->context, corners);
    }
    return status;
}

/* A run of triangles, each of the last three numbers, every other one turned round; −1 begins a new
 * run. */
static vd_status read_strip(vd_ply *p, const vd_ply_element *e) {
    double values[USE_COUNT];
    p->list.count = 0;
    vd_status status = read_properties(p, e, values);
    const double *list = p->list.data;
    size_t start = 0;
    for (size_t i = 0; i < p->list.count && status.code == VD_OK; i++) {
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
        status = vd_builder_add_triangle(p->builder, triangle);
    }
    return status;
}

static vd_status read_edge(vd_ply *p, const vd_ply_element *e) {
    double values[USE_COUNT] = {0.0};
    vd_status status = read_properties(p, e, values);
    if (status.code != VD_OK || !e->has[USE_FIRST] || !e->has[USE_SECOND]) {
        return status;
    }
    uint32_t *to = vd_list_add(p->builder->context, &p->builder->line_ends, 2, sizeof *to);
    if (to == NULL) {
        return vd_out_of_memory("a model's lines", p->builder->line_ends.count * sizeof *to);
    }
    for (int i = 0; i < 2; i++) {
        if (!to_vertex(p, values[USE_FIRST + i], &to[i])) {
            return bad_index(p, values[USE_FIRST + i]);
        }
    }
    return status;
}

static vd_status read_other(vd_ply *p, const vd_ply_element *e) {
    double values[USE_COUNT];
    return read_properties(p, e, values);
}

/* The fewest bytes that one element takes. */
static size_t least_bytes(const vd_ply *p, const vd_ply_element *e) {
    size_t bytes = 0;
    for (int i = 0; i < e->property_count; i++) {
        const vd_ply_property *q = &e->properties[i];
        bytes += p->ascii ? 2 : type_bytes[q->is_list ? q->count_type : q->type];
    }
    return bytes;
}

static vd_status read_elements(vd_ply *p, const vd_ply_element *e) {
    static vd_status (*const readers[])(vd_ply *, const vd_ply_element *) = {
        [OTHER] = read_other, [VERTEX] = read_vertex, [FACE] = read_face,
        [STRIP] = read_strip, [EDGE] = read_edge,
    };
    p->now = e;
    p->at = 0;
    const size_t bytes = least_bytes(p, e), left = (size_t)(p->text.end - p->text.at) + 1;
    if (e->count > 0 && (bytes == 0 || e->count > left / bytes)) {
        return vd_failure(VD_ERROR_FORMAT,
                          "cannot read %.160s: its header promises %llu of \"%s\", for which the "
                          "file is too short; get the file again",
                          p->builder->path, (unsigned long long)e->count, e->name);
    }
    vd_status status = vd_success();
    for (; p->at < e->count && status.code == VD_OK; p->at++) {
        status = readers[e->kind](p, e);
    }
    return status;
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
        const bool early = &p.elements[i] < vertices && p.elements[i].kind != OTHER;
        status = early ? vd_failure(VD_ERROR_FORMAT,
                                    "cannot read %.200s: its faces stand before its vertices; save "
                                    "it with vertices first",
                                    builder->path)
                       : read_elements(&p, &p.elements[i]);
    }
    if (status.code == VD_OK) {
        status = add_material(&p);
    }
    vd_release(builder->context, p.list.data);
    vd_release(builder->context, p.texcoords.data);
    return status;
}

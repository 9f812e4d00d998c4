/* source_ply.c: point clouds in PLY (Turk 1994): ascii and binary in both byte orders.
 *
 * Particles are the elements named "vertex". Elements before them are passed over; a list among a
 * vertex's properties is refused. A file with faces is a mesh and is refused by name. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "core/core.h"
#include "core/text.h"
#include "splat/source_input.h"

#define HEAD_MOST ((size_t)64 << 10)
#define MAX_PROPERTIES 256

typedef struct ply {
    vd_context *context;
    vd_input input;
    bool ascii, big_endian;
    uint64_t begin, count, next;
    size_t stride;      /* binary */
    int property_count; /* ascii: numbers a line */
    int field_count;
    vd_field fields[3 + VD_MAX_ATTRIBUTES];
    int column_field[MAX_PROPERTIES]; /* ascii: which field a number is, −1 none */
} ply;

/* The header, line by line. */
typedef struct ply_head {
    char *text;
    vd_text at;
    bool in_vertex, seen_vertex, format_seen;
    uint64_t skipped_bytes, skipped_lines; /* of elements before the vertices */
    uint64_t element_count;
    size_t element_stride;
    char names[MAX_PROPERTIES][VD_ATTRIBUTE_NAME_BYTES];
    vd_number_type types[MAX_PROPERTIES];
} ply_head;

static vd_status bad(const ply *p, const char *what) {
    return vd_failure(VD_ERROR_FORMAT, "cannot read %.160s: %.160s; check the file", p->input.name,
                      what);
}

static vd_status ended(const ply *p) {
    return vd_failure(VD_ERROR_FORMAT,
                      "cannot read %.200s: it ends after %llu of %llu vertices; get the whole file",
                      p->input.name, (unsigned long long)p->next, (unsigned long long)p->count);
}

static size_t records_now(const ply *p, const vd_particle_batch *batch) {
    const size_t room = batch->capacity - batch->count;
    return room < p->count - p->next ? room : (size_t)(p->count - p->next);
}

static vd_status read_binary(ply *p, vd_particle_batch *batch) {
    while (p->next < p->count && batch->count < batch->capacity) {
        vd_status status = vd_input_fill(&p->input, p->stride);
        if (status.code != VD_OK) {
            return status;
        }
        size_t records = (size_t)(p->input.end - p->input.at) / p->stride;
        const size_t most = records_now(p, batch);
        records = records < most ? records : most;
        if (records == 0) {
            return ended(p);
        }
        vd_fields_read(p->fields, p->field_count, p->big_endian, p->input.at, p->stride, records,
                       batch);
        p->input.at += records * p->stride;
        p->next += records;
    }
    return vd_success();
}

/* Reads one vertex's numbers into the batch's place `i`. */
static bool read_numbers(const ply *p, vd_text *text, vd_particle_batch *batch, size_t i) {
    double *const places[3] = {batch->x, batch->y, batch->z};
    for (int c = 0; c < p->property_count; c++) {
        double value;
        vd_text_skip_lines(text);
        if (!vd_text_number(text, &value)) {
            return false;
        }
        if (p->column_field[c] < 0) {
            continue;
        }
        const vd_field *field = &p->fields[p->column_field[c]];
        if (field->target < 3) {
            places[field->target][i] = value;
        } else {
            batch->values[field->target - 3][i] = (float)(value * field->scale);
        }
    }
    return true;
}

static vd_status read_ascii(ply *p, vd_particle_batch *batch) {
    while (p->next < p->count && batch->count < batch->capacity) {
        /* No line of a sane file is longer. */
        vd_status status = vd_input_fill(&p->input, HEAD_MOST);
        if (status.code != VD_OK) {
            return status;
        }
        vd_text text =
            vd_text_make((const char *)p->input.at, (size_t)(p->input.end - p->input.at));
        vd_text_skip_lines(&text);
        if (vd_text_done(&text)) {
            return ended(p);
        }
        if (!read_numbers(p, &text, batch, batch->count)) {
            char what[80];
            snprintf(what, sizeof what, "vertex %llu is not %d numbers",
                     (unsigned long long)p->next, p->property_count);
            return bad(p, what);
        }
        p->input.at = (const uint8_t *)text.at;
        batch->count++;
        p->next++;
    }
    return vd_success();
}

static vd_status ply_read(void *user, vd_particle_batch *batch) {
    ply *p = user;
    return p->ascii ? read_ascii(p, batch) : read_binary(p, batch);
}

static vd_status ply_rewind(void *user) {
    ply *p = user;
    p->next = 0;
    vd_input_seek(&p->input, p->begin);
    return vd_success();
}

static double ply_progress(void *user) {
    const ply *p = user;
    return p->count == 0 ? 1.0 : (double)p->next / (double)p->count;
}

static void ply_close(void *user) {
    ply *p = user;
    vd_input_close(&p->input);
    vd_release(p->context, p);
}

static const vd_particle_reader reader = {ply_read, ply_rewind, ply_progress, ply_close};

static vd_status read_format(ply *p, ply_head *h) {
    char word[32] = "";
    (void)vd_text_word(&h->at, word, sizeof word);
    p->ascii = strcmp(word, "ascii") == 0;
    p->big_endian = strcmp(word, "binary_big_endian") == 0;
    h->format_seen = true;
    return p->ascii || p->big_endian || strcmp(word, "binary_little_endian") == 0
               ? vd_success()
               : bad(p, "its format is none of ascii, binary_little_endian, binary_big_endian");
}

/* "element NAME COUNT". What came before the vertices is passed over in the data. */
static vd_status read_element(ply *p, ply_head *h) {
    char word[32] = "";
    double count = -1.0;
    if (!vd_text_word(&h->at, word, sizeof word) || !vd_text_number(&h->at, &count) ||
        !(count >= 0.0 && count < 0x1p53)) {
        return bad(p, "an element has no count");
    }
    if (strcmp(word, "face") == 0 && count > 0.0) {
        return vd_failure(VD_ERROR_UNSUPPORTED,
                          "cannot read %.200s as particles: it has %.0f faces, so it is a mesh",
                          p->input.name, count);
    }
    if (!h->seen_vertex && h->element_stride > 0 &&
        h->element_count > UINT32_MAX / h->element_stride * 1024u) {
        return bad(p, "there is too much before its vertices");
    }
    if (!h->seen_vertex) {
        h->skipped_bytes += h->element_count * h->element_stride;
        h->skipped_lines += h->element_stride > 0 ? h->element_count : 0;
    }
    h->in_vertex = strcmp(word, "vertex") == 0 && !h->seen_vertex;
    h->seen_vertex |= h->in_vertex;
    h->element_count = (uint64_t)count;
    h->element_stride = 0;
    p->count = h->in_vertex ? h->element_count : p->count;
    return vd_success();
}

static vd_status read_property(ply *p, ply_head *h) {
    char word[32] = "";
    vd_number_type type = VD_NUMBER_U8;
    (void)vd_text_word(&h->at, word, sizeof word);
    const bool list = strcmp(word, "list") == 0;
    if (!list && !vd_number_of_ply(word, &type)) {
        return bad(p, "a property is of a type that PLY does not have");
    }
    if (list && (h->in_vertex || !h->seen_vertex)) {
        return bad(p, "there is a list among or before its vertices");
    }
    if (h->in_vertex) {
        if (p->property_count == MAX_PROPERTIES) {
            return bad(p, "a vertex has more than 256 properties");
        }
        h->types[p->property_count] = type;
        (void)vd_text_word(&h->at, h->names[p->property_count++], VD_ATTRIBUTE_NAME_BYTES);
        p->stride += (size_t)vd_number_bytes(type);
    }
    h->element_stride += (size_t)vd_number_bytes(type);
    return vd_success();
}

static vd_status read_line(ply *p, ply_head *h, bool *done) {
    char word[32] = "";
    vd_text_skip_blanks(&h->at);
    (void)vd_text_word(&h->at, word, sizeof word);
    vd_status status = vd_success();
    if (strcmp(word, "format") == 0) {
        status = read_format(p, h);
    } else if (strcmp(word, "element") == 0) {
        status = read_element(p, h);
    } else if (strcmp(word, "property") == 0) {
        status = read_property(p, h);
    } else if (strcmp(word, "end_header") == 0) {
        *done = true;
    }
    vd_text_next_line(&h->at);
    return status;
}

static vd_status read_head(ply *p, ply_head *h) {
    h->text = vd_allocate(p->context, HEAD_MOST, 1);
    if (h->text == NULL) {
        return vd_out_of_memory(p->input.name, HEAD_MOST);
    }
    h->at = vd_text_make(h->text, vd_input_peek(&p->input, 0, h->text, HEAD_MOST));
    bool done = false;
    while (!done) {
        if (vd_text_done(&h->at)) {
            return bad(p, "its header has no end within 64 KiB");
        }
        vd_status status = read_line(p, h, &done);
        if (status.code != VD_OK) {
            return status;
        }
    }
    if (!h->format_seen || !h->seen_vertex) {
        return bad(p, h->format_seen ? "it has no vertices" : "its header names no format");
    }
    p->begin = (uint64_t)(h->at.at - h->text) + (p->ascii ? 0 : h->skipped_bytes);
    for (uint64_t i = 0; p->ascii && i < h->skipped_lines; i++) {
        vd_text_next_line(&h->at);
        if (vd_text_done(&h->at)) {
            return bad(p, "its vertices do not begin within 64 KiB");
        }
        p->begin = (uint64_t)(h->at.at - h->text);
    }
    if (!p->ascii &&
        (p->begin > p->input.size_bytes ||
         p->count > (p->input.size_bytes - p->begin) / (p->stride > 0 ? p->stride : 1))) {
        return vd_failure(VD_ERROR_FORMAT,
                          "cannot read %.200s: its header promises %llu vertices and the file is "
                          "too short for them; get the whole file",
                          p->input.name, (unsigned long long)p->count);
    }
    return vd_success();
}

/* Gives each property its place; false when x, y or z is not there. */
static bool place_properties(ply *p, const ply_head *h, vd_particle_source *source) {
    int offset = 0;
    unsigned placed = 0;
    for (int c = 0; c < p->property_count; c++) {
        const char *name = h->names[c];
        vd_field field = {offset, h->types[c], -1, 1.0};
        offset += vd_number_bytes(h->types[c]);
        p->column_field[c] = -1;
        if (name[0] >= 'x' && name[0] <= 'z' && name[1] == '\0') {
            field.target = name[0] - 'x';
            placed |= 1u << field.target;
        } else {
            vd_attribute_kind kind;
            const char *usual = vd_attribute_usual_name(name, &kind);
            if (kind == VD_ATTRIBUTE_CHANNEL && h->types[c] >= VD_NUMBER_F32) {
                field.scale = 255.0;
            } else if (kind == VD_ATTRIBUTE_CHANNEL && h->types[c] == VD_NUMBER_U16) {
                field.scale = 1.0 / 257.0;
            }
            const int index = vd_particle_source_add(source, usual, kind);
            field.target = index < 0 ? -1 : 3 + index;
        }
        if (field.target >= 0 && p->field_count < 3 + VD_MAX_ATTRIBUTES) {
            p->column_field[c] = p->field_count;
            p->fields[p->field_count++] = field;
        }
    }
    return placed == 7;
}

vd_status vd_ply_open(vd_context *context, const char *path, vd_input input,
                      vd_particle_source **out) {
    ply *p = vd_allocate_zero(context, 1, sizeof *p);
    ply_head *h = vd_allocate_zero(context, 1, sizeof *h);
    vd_status status = p == NULL || h == NULL ? vd_out_of_memory(path, sizeof *h) : vd_success();
    vd_particle_source *source = NULL;
    if (status.code == VD_OK) {
        p->context = context;
        p->input = input;
        status = read_head(p, h);
        if (status.code == VD_OK) {
            status = vd_particle_source_create(context, path, &reader, p, &source);
        } else {
            ply_close(p);
        }
    } else {
        vd_input_close(&input);
        vd_release(context, p);
    }
    if (status.code == VD_OK) {
        p->input.name = source->path;
        source->count = p->count;
        snprintf(source->format, sizeof source->format, "PLY, %s",
                 p->ascii        ? "ascii"
                 : p->big_endian ? "big-endian"
                                 : "little-endian");
        if (place_properties(p, h, source)) {
            (void)ply_rewind(p);
            *out = source;
        } else {
            status = bad(p, "its vertices lack x, y or z");
            vd_particle_source_destroy(&source);
        }
    }
    if (h != NULL) {
        vd_release(context, h->text);
    }
    vd_release(context, h);
    return status;
}

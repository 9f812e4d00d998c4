/* source_raw.c: raw numbers, particle after particle, all of one type. */
#include <stdio.h>
#include <string.h>
#include "core/core.h"
#include "splat/source_input.h"

typedef struct raw {
    vd_context *context;
    vd_input input;
    bool big_endian;
    uint64_t begin, count, next;
    size_t stride;
    int field_count;
    vd_field fields[3 + VD_MAX_ATTRIBUTES];
} raw;

static vd_status raw_read(void *user, vd_particle_batch *batch) {
    raw *r = user;
    while (r->next < r->count && batch->count < batch->capacity) {
        vd_status status = vd_input_fill(&r->input, r->stride);
        if (status.code != VD_OK) {
            return status;
        }
        size_t records = (size_t)(r->input.end - r->input.at) / r->stride;
        const size_t room = batch->capacity - batch->count;
        records = records < room ? records : room;
        records = records < r->count - r->next ? records : (size_t)(r->count - r->next);
        if (records == 0) {
            return vd_failure(VD_ERROR_IO,
                              "cannot read %.200s: it became shorter while it was "
                              "read; begin again",
                              r->input.name);
        }
        vd_fields_read(r->fields, r->field_count, r->big_endian, r->input.at, r->stride, records,
                       batch);
        r->input.at += records * r->stride;
        r->next += records;
    }
    return vd_success();
}

static vd_status raw_rewind(void *user) {
    raw *r = user;
    r->next = 0;
    vd_input_seek(&r->input, r->begin);
    return vd_success();
}

static double raw_progress(void *user) {
    const raw *r = user;
    return r->count == 0 ? 1.0 : (double)r->next / (double)r->count;
}

static void raw_close(void *user) {
    raw *r = user;
    vd_input_close(&r->input);
    vd_release(r->context, r);
}

static const vd_particle_reader reader = {raw_read, raw_rewind, raw_progress, raw_close};

static bool find_type(const char *name, vd_number_type *out) {
    static const char *const names[VD_NUMBER_COUNT] = {"i8",  "u8",  "i16", "u16",
                                                       "i32", "u32", "f32", "f64"};
    for (int t = 0; t < VD_NUMBER_COUNT; t++) {
        if (strcmp(name, names[t]) == 0) {
            *out = (vd_number_type)t;
            return true;
        }
    }
    return false;
}

/* Lays the columns out; false when x, y and z are not all there or there are too many. */
static bool lay_out(raw *r, const char *columns, vd_number_type type, vd_particle_source *source) {
    unsigned placed = 0;
    for (const char *at = columns;; at++) {
        const size_t length = strcspn(at, ",");
        char name[VD_ATTRIBUTE_NAME_BYTES];
        snprintf(name, sizeof name, "%.*s", (int)(length < sizeof name ? length : sizeof name - 1),
                 at);
        vd_field field = {(int)r->stride, type, -1, 1.0};
        if (name[0] >= 'x' && name[0] <= 'z' && name[1] == '\0') {
            field.target = name[0] - 'x';
            placed |= 1u << field.target;
        } else if (name[0] != '\0' && strcmp(name, "-") != 0) {
            vd_attribute_kind kind;
            const char *usual = vd_attribute_usual_name(name, &kind);
            const int index = vd_particle_source_add(source, usual, kind);
            field.target = index < 0 ? -1 : 3 + index;
        }
        r->stride += (size_t)vd_number_bytes(type);
        if (r->stride > 4096) {
            return false;
        }
        if (field.target >= 0 && r->field_count < 3 + VD_MAX_ATTRIBUTES) {
            r->fields[r->field_count++] = field;
        }
        at += length;
        if (*at == '\0') {
            return placed == 7;
        }
    }
}

static vd_status begin_raw(raw *r, const vd_particle_source_def *def, vd_particle_source *source) {
    vd_number_type type;
    if (!find_type(def->raw, &type)) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "cannot read %.160s: raw numbers are i8, u8, i16, u16, i32, u32, f32 or "
                          "f64, not %.20s",
                          source->path, def->raw);
    }
    if (!lay_out(r, def->columns != NULL ? def->columns : "x,y,z", type, source)) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "cannot read %.160s: the columns need x, y and z, as in "
                          "--columns x,y,z,mass, and may not be hundreds",
                          source->path);
    }
    if (def->raw_offset_bytes > r->input.size_bytes ||
        (r->input.size_bytes - def->raw_offset_bytes) % r->stride != 0) {
        return vd_failure(VD_ERROR_FORMAT,
                          "cannot read %.160s: its %llu bytes are not whole particles of %zu; "
                          "check the columns and the type",
                          source->path, (unsigned long long)r->input.size_bytes, r->stride);
    }
    r->begin = def->raw_offset_bytes;
    r->big_endian = def->raw_big_endian;
    r->count = (r->input.size_bytes - r->begin) / r->stride;
    source->count = r->count;
    snprintf(source->format, sizeof source->format, "raw %s, %zu bytes a particle", def->raw,
             r->stride);
    return raw_rewind(r);
}

vd_status vd_raw_open(vd_context *context, const char *path, vd_input input,
                      const vd_particle_source_def *def, vd_particle_source **out) {
    raw *r = vd_allocate_zero(context, 1, sizeof *r);
    if (r == NULL) {
        vd_input_close(&input);
        return vd_out_of_memory(path, sizeof *r);
    }
    r->context = context;
    r->input = input;
    vd_particle_source *source;
    vd_status status = vd_particle_source_create(context, path, &reader, r, &source);
    if (status.code != VD_OK) {
        return status;
    }
    r->input.name = source->path;
    status = begin_raw(r, def, source);
    if (status.code != VD_OK) {
        vd_particle_source_destroy(&source);
        return status;
    }
    *out = source;
    return vd_success();
}

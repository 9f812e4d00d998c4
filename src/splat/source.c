/* source.c: what all sources share, and telling files apart. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>
#include "core/core.h"
#include "splat/source_input.h"

const char *vd_attribute_kind_name(vd_attribute_kind kind) {
    static const char *const names[] = {"scalar", "category", "channel", "radius"};
    return (unsigned)kind < VD_ATTRIBUTE_KIND_COUNT ? names[kind] : "unknown";
}

vd_particle_source_def vd_particle_source_def_default(void) {
    return (vd_particle_source_def){0};
}

/* ---- sources ------------------------------------------------------------------------------------
 */

vd_status vd_particle_source_create(vd_context *context, const char *path,
                                    const vd_particle_reader *reader, void *user,
                                    vd_particle_source **out) {
    vd_particle_source *source = vd_allocate_zero(context, 1, sizeof *source);
    char *copy = source != NULL ? vd_copy_string(context, path) : NULL;
    if (copy == NULL) {
        vd_release(context, source);
        reader->close(user);
        return vd_out_of_memory(path, sizeof *source);
    }
    source->context = context;
    source->path = copy;
    source->reader = reader;
    source->user = user;
    *out = source;
    return vd_success();
}

void vd_particle_source_destroy(vd_particle_source **source) {
    if (source == NULL || *source == NULL) {
        return;
    }
    vd_particle_source *s = *source;
    s->reader->close(s->user);
    vd_release(s->context, s->path);
    vd_release(s->context, s->crs);
    vd_release(s->context, s);
    *source = NULL;
}

vd_status vd_particle_source_read(vd_particle_source *source, vd_particle_batch *batch) {
    return source->reader->read(source->user, batch);
}

vd_status vd_particle_source_rewind(vd_particle_source *source) {
    return source->reader->rewind(source->user);
}

double vd_particle_source_progress(const vd_particle_source *source) {
    return source->reader->progress(source->user);
}

int vd_particle_source_find(const vd_particle_source *source, const char *name) {
    for (int i = 0; i < source->attribute_count; i++) {
        if (strcmp(source->attributes[i].name, name) == 0) {
            return i;
        }
    }
    return -1;
}

int vd_particle_source_add(vd_particle_source *source, const char *name, vd_attribute_kind kind) {
    if (source->attribute_count == VD_MAX_ATTRIBUTES) {
        return -1;
    }
    vd_attribute *a = &source->attributes[source->attribute_count];
    snprintf(a->name, sizeof a->name, "%.*s", VD_ATTRIBUTE_NAME_BYTES - 4, name);
    for (unsigned n = 2; vd_particle_source_find(source, a->name) >= 0; n++) {
        snprintf(a->name, sizeof a->name, "%.*s%u", VD_ATTRIBUTE_NAME_BYTES - 4, name, n % 100);
    }
    for (int i = 0; i < source->attribute_count && kind == VD_ATTRIBUTE_RADIUS; i++) {
        if (source->attributes[i].kind == VD_ATTRIBUTE_RADIUS) {
            kind = VD_ATTRIBUTE_SCALAR;
        }
    }
    a->kind = kind;
    return source->attribute_count++;
}

const char *vd_attribute_usual_name(const char *name, vd_attribute_kind *kind) {
    static const struct {
        const char *name, *usual;
        vd_attribute_kind kind;
    } known[] = {
        {"red", "red", VD_ATTRIBUTE_CHANNEL},
        {"r", "red", VD_ATTRIBUTE_CHANNEL},
        {"diffuse_red", "red", VD_ATTRIBUTE_CHANNEL},
        {"green", "green", VD_ATTRIBUTE_CHANNEL},
        {"g", "green", VD_ATTRIBUTE_CHANNEL},
        {"blue", "blue", VD_ATTRIBUTE_CHANNEL},
        {"b", "blue", VD_ATTRIBUTE_CHANNEL},
        {"class", "class", VD_ATTRIBUTE_CATEGORY},
        {"diffuse_green", "green", VD_ATTRIBUTE_CHANNEL},
        {"diffuse_blue", "blue", VD_ATTRIBUTE_CHANNEL},
        {"classification", "class", VD_ATTRIBUTE_CATEGORY},
        {"label", "label", VD_ATTRIBUTE_CATEGORY},
        {"radius", "radius", VD_ATTRIBUTE_RADIUS},
        {"hsml", "radius", VD_ATTRIBUTE_RADIUS},
        {"size", "radius", VD_ATTRIBUTE_RADIUS},
        {"smoothinglength", "radius", VD_ATTRIBUTE_RADIUS},
        {"mass", "mass", VD_ATTRIBUTE_SCALAR},
        {"masses", "mass", VD_ATTRIBUTE_SCALAR},
    };
    for (size_t i = 0; i < sizeof known / sizeof known[0]; i++) {
        if (strcasecmp(name, known[i].name) == 0) {
            *kind = known[i].kind;
            return known[i].usual;
        }
    }
    *kind = VD_ATTRIBUTE_SCALAR;
    return name;
}

/* ---- telling files apart ------------------------------------------------------------------------
 */

static bool is_hdf5(const uint8_t *head, size_t bytes) {
    return bytes >= 8 && memcmp(head, "\x89HDF\r\n\x1a\n", 8) == 0;
}

/* Whether the head of a PLY names faces that are not 0. */
static bool has_faces(const char *head) {
    const char *at = strstr(head, "element face ");
    const char *end = strstr(head, "end_header");
    return at != NULL && (end == NULL || at < end) && strtod(at + 13, NULL) != 0.0;
}

static bool ends_like_text(const char *path) {
    static const char *const endings[] = {".csv", ".tsv", ".txt", ".xyz", ".pts", ".dat"};
    const char *dot = strrchr(path, '.');
    for (size_t i = 0; dot != NULL && i < sizeof endings / sizeof endings[0]; i++) {
        if (strcasecmp(dot, endings[i]) == 0) {
            return true;
        }
    }
    return false;
}

vd_particle_file vd_particle_file_probe(const char *path) {
    char head[4097] = {0};
    struct stat info;
    /* A pipe would lose what is read of it. */
    FILE *file = stat(path, &info) == 0 && S_ISREG(info.st_mode) ? fopen(path, "rb") : NULL;
    if (file == NULL) {
        return VD_PARTICLE_FILE_NONE;
    }
    const size_t got = fread(head, 1, sizeof head - 1, file);
    fclose(file);
    if (got >= 8 && memcmp(head, "VDBRICKS", 8) == 0) {
        return VD_PARTICLE_FILE_BRICKS;
    }
    if (got >= 4 && memcmp(head, "LASF", 4) == 0) {
        return VD_PARTICLE_FILE_LAS;
    }
    if (is_hdf5((const uint8_t *)head, got)) {
        return VD_PARTICLE_FILE_HDF5;
    }
    if (got >= 4 && memcmp(head, "ply", 3) == 0 && (head[3] == '\n' || head[3] == '\r')) {
        return has_faces(head) ? VD_PARTICLE_FILE_NONE : VD_PARTICLE_FILE_PLY;
    }
    if (strncasecmp(head, "ncols", 5) == 0 || strncmp(head, "DSAA", 4) == 0) {
        return VD_PARTICLE_FILE_NONE; /* a grid of heights: ESRI ASCII, Surfer */
    }
    return ends_like_text(path) ? VD_PARTICLE_FILE_TEXT : VD_PARTICLE_FILE_NONE;
}

static vd_status open_input(vd_context *context, const char *path, vd_input input,
                            const vd_particle_source_def *def, vd_particle_source **out) {
    const vd_particle_source_def none = vd_particle_source_def_default();
    def = def != NULL ? def : &none;
    uint8_t head[8];
    const size_t got = vd_input_peek(&input, 0, head, sizeof head);
    if (def->raw != NULL) {
        return vd_raw_open(context, path, input, def, out);
    }
    if (got >= 4 && memcmp(head, "LASF", 4) == 0) {
        return vd_las_open(context, path, input, out);
    }
    if (got >= 4 && memcmp(head, "ply", 3) == 0 && (head[3] == '\n' || head[3] == '\r')) {
        return vd_ply_open(context, path, input, out);
    }
    vd_status status = vd_success();
    if (is_hdf5(head, got)) {
        status = vd_failure(VD_ERROR_UNSUPPORTED,
                            "cannot read %.250s: it is an HDF5 file, which is read by a part of "
                            "its own; build with VEDUTA_HDF5=ON",
                            path);
    } else if (got >= 8 && memcmp(head, "VDBRICKS", 8) == 0) {
        status = vd_failure(VD_ERROR_UNSUPPORTED,
                            "cannot read %.250s as particles: it is a brick file already; draw it "
                            "as it is",
                            path);
    } else if (got == 0) {
        status =
            vd_failure(VD_ERROR_FORMAT, "cannot read %.250s: it is empty; check the file", path);
    }
    if (status.code != VD_OK) {
        vd_input_close(&input);
        return status;
    }
    return vd_columns_open(context, path, input, def, out);
}

vd_status vd_particle_source_open(vd_context *context, const char *path,
                                  const vd_particle_source_def *def, vd_particle_source **out) {
    vd_input input;
    vd_status status = vd_input_open(context, path, &input);
    return status.code == VD_OK ? open_input(context, path, input, def, out) : status;
}

vd_status vd_particle_source_open_memory(vd_context *context, const void *data, size_t size_bytes,
                                         const char *name, const vd_particle_source_def *def,
                                         vd_particle_source **out) {
    vd_input input;
    vd_input_from_memory(context, data, size_bytes, name, &input);
    return open_input(context, name, input, def, out);
}

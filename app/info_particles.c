/* info_particles.c: what a file of particles holds. */
#include "info_particles.h"

#include <math.h>
#include <string.h>

#include "particle_file.h"
#include "run.h"

enum { BATCH = 65536 };

/* What is printed of any file. */
typedef struct facts {
    const char *path, *crs;
    char format[64];
    uint64_t count, skipped;
    double min[3], max[3];
    int attribute_count;
    struct {
        const char *name, *kind, *storage; /* storage null but for bricks */
        double min, max;
    } attributes[VD_MAX_ATTRIBUTES];
    const vd_bricks *bricks; /* null for other files */
} facts;

static bool print_people(const facts *f) {
    printf("file        %s\n", f->path);
    printf("format      %s\n", f->format);
    printf("particles   %llu\n", (unsigned long long)f->count);
    if (f->skipped > 0) {
        printf("left out    %llu, with a position that is NaN or infinite\n",
               (unsigned long long)f->skipped);
    }
    if (f->bricks != NULL) {
        printf("bricks      %u, %.2f bytes a particle\n", f->bricks->node_count,
               (double)f->bricks->file_bytes / (double)f->bricks->count);
        printf("spacing     %.6g, the median of neighbours\n", f->bricks->spacing);
    }
    if (f->crs != NULL && f->crs[0] != '\0') {
        const char *quote = strchr(f->crs, '"');
        const char *name = quote != NULL ? quote + 1 : f->crs;
        printf("CRS         %.*s\n", (int)strcspn(name, "\""), name);
    }
    for (int k = 0; k < 3 && f->count > 0; k++) {
        printf("%c           %.10g to %.10g\n", 'x' + k, f->min[k], f->max[k]);
    }
    for (int a = 0; a < f->attribute_count; a++) {
        printf("%-11s %.6g to %.6g, %s%s%s\n", f->attributes[a].name, f->attributes[a].min,
               f->attributes[a].max, f->attributes[a].kind,
               f->attributes[a].storage != NULL ? ", stored as " : "",
               f->attributes[a].storage != NULL ? f->attributes[a].storage : "");
    }
    return fflush(stdout) == 0 && !ferror(stdout);
}

static bool print_facts_json(const facts *f) {
    json_t *attributes = json_array();
    for (int a = 0; a < f->attribute_count; a++) {
        json_array_append_new(attributes,
                              json_pack("{s: s, s: s, s: f, s: f}", "name", f->attributes[a].name,
                                        "kind", f->attributes[a].kind, "min", f->attributes[a].min,
                                        "max", f->attributes[a].max));
    }
    json_t *root =
        json_pack("{s: s, s: s, s: I, s: I, s: s, s: o}", "file", f->path, "format", f->format,
                  "particles", (json_int_t)f->count, "skipped", (json_int_t)f->skipped, "crs",
                  f->crs != NULL ? f->crs : "", "attributes", attributes);
    bool failed = root == NULL;
    if (f->count > 0) {
        failed |= json_object_set_new(root, "min",
                                      json_pack("[f, f, f]", f->min[0], f->min[1], f->min[2])) != 0;
        failed |= json_object_set_new(root, "max",
                                      json_pack("[f, f, f]", f->max[0], f->max[1], f->max[2])) != 0;
    }
    if (f->bricks != NULL) {
        failed |= json_object_set_new(root, "bricks", json_integer(f->bricks->node_count)) != 0;
        failed |= json_object_set_new(root, "file_bytes",
                                      json_integer((json_int_t)f->bricks->file_bytes)) != 0;
        failed |= json_object_set_new(root, "spacing", json_real(f->bricks->spacing)) != 0;
    }
    const bool printed = !failed && vd_print_json(root);
    json_decref(root);
    return printed;
}

static vd_status print_facts(const facts *f, bool json) {
    return (json ? print_facts_json(f) : print_people(f))
               ? vd_success()
               : vd_failure(VD_ERROR_IO, "cannot write to standard output; check the pipe");
}

static vd_status describe_bricks(vd_context *context, const char *path, bool json) {
    static const char *const storages[] = {"8 bits", "16 bits", "16 bits of the brick's range",
                                           "16 bits of the logarithm"};
    vd_bricks *b = NULL;
    vd_status status = vd_bricks_open(context, path, &b);
    if (status.code != VD_OK) {
        return status;
    }
    status = vd_bricks_verify(b, NULL);
    facts f = {.path = path,
               .format = "bricks, version 1",
               .crs = b->crs,
               .count = b->count,
               .skipped = b->skipped,
               .attribute_count = (int)b->attribute_count,
               .bricks = b};
    memcpy(f.min, b->min, sizeof f.min);
    memcpy(f.max, b->max, sizeof f.max);
    for (uint32_t a = 0; a < b->attribute_count; a++) {
        const vd_bricks_attribute *t = &b->attributes[a];
        f.attributes[a].name = t->name;
        f.attributes[a].kind = vd_attribute_kind_name((vd_attribute_kind)t->kind);
        f.attributes[a].storage = storages[t->storage];
        f.attributes[a].min = t->min;
        f.attributes[a].max = t->max;
    }
    if (status.code == VD_OK) {
        status = print_facts(&f, json);
    }
    vd_bricks_close(&b);
    return status;
}

static void add_batch(facts *f, const vd_particle_batch *b) {
    const double *const axes[3] = {b->x, b->y, b->z};
    for (size_t i = 0; i < b->count; i++) {
        if (!isfinite(b->x[i]) || !isfinite(b->y[i]) || !isfinite(b->z[i])) {
            f->skipped++;
            continue;
        }
        for (int k = 0; k < 3; k++) {
            f->min[k] = f->count == 0 ? axes[k][i] : fmin(f->min[k], axes[k][i]);
            f->max[k] = f->count == 0 ? axes[k][i] : fmax(f->max[k], axes[k][i]);
        }
        for (int a = 0; a < f->attribute_count; a++) {
            const double v = (double)b->values[a][i]; /* fmin passes NaN over */
            f->attributes[a].min = f->count == 0 ? v : fmin(f->attributes[a].min, v);
            f->attributes[a].max = f->count == 0 ? v : fmax(f->attributes[a].max, v);
        }
        f->count++;
    }
}

static vd_status read_through(vd_context *context, vd_particle_source *source, facts *f) {
    const size_t columns = 6 + (size_t)source->attribute_count;
    float *memory = vd_allocate(context, BATCH * columns, sizeof *memory);
    if (memory == NULL) {
        return vd_failure(VD_ERROR_MEMORY, "out of memory");
    }
    vd_particle_batch batch = {.capacity = BATCH, .x = (double *)memory};
    batch.y = batch.x + BATCH;
    batch.z = batch.y + BATCH;
    for (int a = 0; a < source->attribute_count; a++) {
        batch.values[a] = memory + (size_t)(6 + a) * BATCH;
    }
    vd_status status;
    do {
        batch.count = 0;
        status = vd_particle_source_read(source, &batch);
        add_batch(f, &batch);
    } while (status.code == VD_OK && batch.count > 0);
    vd_release(context, memory);
    for (int a = 0; a < f->attribute_count; a++) {
        /* JSON has no NaN: an attribute without a number has the range 0 … 0. */
        f->attributes[a].min = isfinite(f->attributes[a].min) ? f->attributes[a].min : 0.0;
        f->attributes[a].max = isfinite(f->attributes[a].max) ? f->attributes[a].max : 0.0;
    }
    return status;
}

vd_status vd_info_particles(vd_context *context, const char *path, bool json) {
    if (vd_particle_file_probe(path) == VD_PARTICLE_FILE_BRICKS) {
        return describe_bricks(context, path, json);
    }
    vd_particle_source **sources = NULL;
    vd_status status = vd_particle_files_open(context, &path, 1, NULL, -1, &sources);
    if (status.code != VD_OK) {
        return status;
    }
    vd_particle_source *source = sources[0];
    facts f = {.path = path, .crs = source->crs, .attribute_count = source->attribute_count};
    memcpy(f.format, source->format, sizeof f.format);
    for (int a = 0; a < source->attribute_count; a++) {
        f.attributes[a].name = source->attributes[a].name;
        f.attributes[a].kind = vd_attribute_kind_name(source->attributes[a].kind);
    }
    status = read_through(context, source, &f);
    if (status.code == VD_OK) {
        status = print_facts(&f, json);
    }
    vd_particle_files_close(context, &sources, 1);
    return status;
}

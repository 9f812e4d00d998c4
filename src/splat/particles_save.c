/* particles_save.c: particles as PLY, text or raw numbers. */
#include <stdio.h>
#include <string.h>
#include <veduta/particles.h>
#include "core/file.h"

typedef enum form { FORM_PLY = 0, FORM_CSV, FORM_RAW, FORM_COUNT } form;

static bool ends_with(const char *text, const char *ending) {
    const size_t length = strlen(text), of = strlen(ending);
    return length >= of && strcmp(text + length - of, ending) == 0;
}

static form form_of(const char *path) {
    return ends_with(path, ".ply")                              ? FORM_PLY
           : ends_with(path, ".csv") || strcmp(path, "-") == 0  ? FORM_CSV
           : ends_with(path, ".raw") || ends_with(path, ".f32") ? FORM_RAW
                                                                : FORM_COUNT;
}

static void write_head(vd_file *file, form as, size_t count) {
    char text[320];
    int length = 0;
    if (as == FORM_PLY) {
        length = snprintf(text, sizeof text,
                          "ply\nformat binary_little_endian 1.0\nelement vertex %zu\n"
                          "property float x\nproperty float y\nproperty float z\n"
                          "property float radius\nproperty float mass\nproperty float speed\n"
                          "property uchar class\nend_header\n",
                          count);
    } else if (as == FORM_CSV) {
        length = snprintf(text, sizeof text, "x,y,z,radius,mass,speed,class\n");
    }
    vd_file_write(file, text, (size_t)length);
}

/* Four bytes, the lowest first. */
static void put_float(unsigned char *to, float v) {
    uint32_t bits;
    memcpy(&bits, &v, sizeof bits);
    for (int i = 0; i < 4; i++) {
        to[i] = (unsigned char)(bits >> (8 * i));
    }
}

static void write_particle(vd_file *file, form as, const vd_particles *p, size_t i) {
    const float numbers[6] = {p->x[i], p->y[i], p->z[i], p->radius[i], p->mass[i], p->speed[i]};
    if (as == FORM_CSV) {
        char line[160];
        const int length =
            snprintf(line, sizeof line, "%.9g,%.9g,%.9g,%.9g,%.9g,%.9g,%d\n", (double)numbers[0],
                     (double)numbers[1], (double)numbers[2], (double)numbers[3], (double)numbers[4],
                     (double)numbers[5], p->classes[i]);
        vd_file_write(file, line, (size_t)length);
        return;
    }
    unsigned char record[25];
    for (int k = 0; k < 6; k++) {
        put_float(record + 4 * k, numbers[k]);
    }
    record[24] = p->classes[i];
    vd_file_write(file, record, as == FORM_PLY ? 25 : 24);
}

vd_status vd_particles_save(const vd_particles *particles, const char *path) {
    const form as = form_of(path);
    if (as == FORM_COUNT) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "cannot write particles to %.200s: the ending says nothing; give .ply, "
                          ".csv, .raw or .f32",
                          path);
    }
    vd_file file;
    vd_status status = vd_file_create(particles->context, path, &file);
    if (status.code != VD_OK) {
        return status;
    }
    write_head(&file, as, particles->count);
    for (size_t i = 0; i < particles->count; i++) {
        write_particle(&file, as, particles, i);
    }
    return vd_file_commit(&file);
}

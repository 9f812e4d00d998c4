/* mesh_file.h: reads what bench/models.mjs writes. */
#ifndef VEDUTA_BENCH_MESH_FILE_H
#define VEDUTA_BENCH_MESH_FILE_H

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct mesh_file {
    uint32_t vertex_count, triangle_count;
    float *positions;  /* [vertex_count][3] */
    uint32_t *indices; /* [triangle_count][3] */
} mesh_file;

/* False when it is not there or not whole; arrays that are not null are then freed by the caller
 * too. */
static inline bool mesh_file_read(const char *path, mesh_file *m) {
    char magic[8];
    uint32_t counts[2];
    FILE *file = fopen(path, "rb");
    if (file == NULL) {
        return false;
    }
    bool ok = fread(magic, 1, 8, file) == 8 && memcmp(magic, "VDBENCH1", 8) == 0 &&
              fread(counts, 4, 2, file) == 2 && counts[0] < 1u << 28 && counts[1] < 1u << 28;
    if (ok) {
        m->vertex_count = counts[0];
        m->triangle_count = counts[1];
        m->positions = malloc((size_t)counts[0] * 12 + 1);
        m->indices = malloc((size_t)counts[1] * 12 + 1);
        ok = m->positions != NULL && m->indices != NULL &&
             fread(m->positions, 12, counts[0], file) == counts[0] &&
             fread(m->indices, 12, counts[1], file) == counts[1];
    }
    fclose(file);
    return ok;
}

#endif

/* particle_file.c: which reader a file of particles goes to. */
#include "particle_file.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "snapshot_module.h"

vd_status vd_particle_files_open(vd_context *context, const char *const *paths, int count,
                                 const vd_particle_source_def *def, int type,
                                 vd_particle_source ***out) {
    vd_particle_source **sources = vd_allocate(context, (size_t)count, sizeof *sources);
    if (sources == NULL) {
        return vd_failure(VD_ERROR_MEMORY, "out of memory");
    }
    vd_status status = vd_success();
    int opened = 0;
    while (opened < count && status.code == VD_OK) {
        /* One file of a snapshot names all of it; several are what they are. */
        const vd_snapshot_def snapshot = {.type = type, .whole = count == 1};
        status = vd_particle_file_probe(paths[opened]) == VD_PARTICLE_FILE_HDF5
                     ? vd_snapshot_module_open(context, paths[opened], &snapshot, &sources[opened])
                     : vd_particle_source_open(context, paths[opened], def, &sources[opened]);
        opened += status.code == VD_OK;
    }
    if (status.code != VD_OK) {
        vd_particle_files_close(context, &sources, opened);
        return status;
    }
    *out = sources;
    return status;
}

void vd_particle_files_close(vd_context *context, vd_particle_source ***sources, int count) {
    for (int i = 0; *sources != NULL && i < count; i++) {
        vd_particle_source_destroy(&(*sources)[i]);
    }
    vd_release(context, *sources);
    *sources = NULL;
}

static vd_status import_unnamed(vd_context *context, vd_job *job,
                                vd_particle_source *const *sources, int count, vd_bricks **out) {
    const char *folder = getenv("TMPDIR");
    char path[4096];
    snprintf(path, sizeof path, "%s/veduta-XXXXXX",
             folder != NULL && strlen(folder) < 4000 ? folder : "/tmp");
    const int descriptor = mkstemp(path);
    if (descriptor < 0) {
        return vd_failure(VD_ERROR_IO,
                          "cannot make a file in %.200s to sort particles in: %s; name another "
                          "folder by the variable TMPDIR",
                          path, strerror(errno));
    }
    close(descriptor);
    vd_bricks_report report;
    vd_status status = vd_bricks_import(context, job, sources, count, NULL, path, &report);
    if (status.code == VD_OK) {
        status = vd_bricks_open(context, path, out);
        if (report.skipped > 0) {
            fprintf(stderr,
                    "veduta: note: %llu particles were left out: their positions are NaN or "
                    "infinite\n",
                    (unsigned long long)report.skipped);
        }
    }
    unlink(path);
    return status;
}

vd_status vd_particle_files_bricks(vd_context *context, vd_job *job, const char *const *paths,
                                   int count, const vd_particle_source_def *def, int type,
                                   vd_bricks **out, char format[64]) {
    if (vd_particle_file_probe(paths[0]) == VD_PARTICLE_FILE_BRICKS) {
        snprintf(format, 64, "bricks");
        return count == 1 ? vd_bricks_open(context, paths[0], out)
                          : vd_failure(VD_ERROR_ARGUMENT,
                                       "one brick file is drawn at a time, %d given; import the "
                                       "files that they were made from into one",
                                       count);
    }
    vd_particle_source **sources = NULL;
    vd_status status = vd_particle_files_open(context, paths, count, def, type, &sources);
    if (status.code == VD_OK) {
        snprintf(format, 64, "%s", sources[0]->format);
        status = import_unnamed(context, job, sources, count, out);
    }
    vd_particle_files_close(context, &sources, count);
    return status;
}

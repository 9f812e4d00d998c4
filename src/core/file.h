/* file.h: whole files in, whole files out.
 *
 * Reading takes all of a file (or standard input, "-") into memory, up to a limit. Writing goes to
 * a temporary file beside the destination, which is renamed over it only when everything was
 * written; until then, and after any failure, what was there before is untouched.
 */
#ifndef VEDUTA_CORE_FILE_H
#define VEDUTA_CORE_FILE_H

#include <stdbool.h>
#include <string.h>
#include <veduta/context.h>

/* Whether a path ends in `ending`, which is in small letters; those of the path may be capital. */
static inline bool vd_path_ends_in(const char *path, const char *ending) {
    const size_t length = strlen(path), tail = strlen(ending);
    for (size_t i = 0; i < tail && length >= tail; i++) {
        const char c = path[length - tail + i];
        if ((c >= 'A' && c <= 'Z' ? c + 32 : c) != ending[i]) {
            return false;
        }
    }
    return length >= tail;
}

/* Reads `path` into *data (owned by the caller, vd_release; one NUL byte follows the contents).
 * Returns VD_ERROR_IO (also for devices, which may never end), VD_ERROR_LIMIT (more than
 * limit_bytes) or VD_ERROR_MEMORY. */
VD_MUST_USE vd_status vd_file_read(vd_context *context, const char *path, size_t limit_bytes,
                                   void **data, size_t *size_bytes);

/* A file being written. Caller storage; init by vd_file_create, ended by exactly one of
 * vd_file_commit and vd_file_discard. */
typedef struct vd_file {
    vd_context *context;
    int descriptor;
    int error;    /* errno of the first failed write; later writes are dropped */
    char *path;   /* the destination */
    char *beside; /* the temporary file; null for standard output and special files */
    uint8_t *buffer;
    size_t buffered;
} vd_file;

VD_MUST_USE vd_status vd_file_create(vd_context *context, const char *path, vd_file *out);

/* Appends bytes. Failures are kept and reported by vd_file_commit. */
void vd_file_write(vd_file *file, const void *data, size_t size_bytes);

/* Overwrites bytes that were written before. Only for regular files; failures as above. */
void vd_file_write_at(vd_file *file, uint64_t offset, const void *data, size_t size_bytes);

/* Flushes, checks and renames into place. On failure nothing is left beside. */
VD_MUST_USE vd_status vd_file_commit(vd_file *file);
void vd_file_discard(vd_file *file);

#endif

#define _GNU_SOURCE /* mkostemp */
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>
#include "core/file.h"
#include "core/core.h"

#define BUFFER_BYTES ((size_t)256 << 10)

static vd_status read_failure(const char *path, int error) {
    const char *remedy = error == ENOENT   ? "check the path"
                         : error == EACCES ? "check its permissions"
                         : error == EISDIR ? "name a file inside it"
                                           : "check the disk and try again";
    return vd_failure(VD_ERROR_IO, "cannot read %s: %s; %s", path, strerror(error), remedy);
}

/* Reads everything that is left in `descriptor` into a growing buffer. `hint` is the expected size.
 */
static vd_status read_all(vd_context *context, const char *path, int descriptor, size_t hint,
                          size_t limit_bytes, void **data, size_t *size_bytes) {
    size_t capacity = (hint < limit_bytes ? hint : limit_bytes) + 1, size = 0;
    uint8_t *buffer = vd_allocate(context, capacity + 1, 1);
    if (buffer == NULL) {
        return vd_out_of_memory(path, capacity);
    }
    for (;;) {
        ssize_t got = read(descriptor, buffer + size, capacity - size);
        if (got < 0 && errno == EINTR) {
            continue;
        }
        if (got < 0) {
            vd_status status = read_failure(path, errno);
            vd_release(context, buffer);
            return status;
        }
        if (got == 0) {
            break;
        }
        size += (size_t)got;
        if (size > limit_bytes) {
            vd_release(context, buffer);
            return vd_failure(VD_ERROR_LIMIT,
                              "cannot read %s: it is larger than the %zu bytes that "
                              "are accepted; use a smaller file",
                              path, limit_bytes);
        }
        if (size == capacity) {
            size_t larger = capacity * 2 < limit_bytes ? capacity * 2 : limit_bytes + 1;
            uint8_t *grown = vd_allocate(context, larger + 1, 1);
            if (grown == NULL) {
                vd_release(context, buffer);
                return vd_out_of_memory(path, larger);
            }
            memcpy(grown, buffer, size);
            vd_release(context, buffer);
            buffer = grown;
            capacity = larger;
        }
    }
    buffer[size] = 0;
    *data = buffer;
    *size_bytes = size;
    return vd_success();
}

vd_status vd_file_read(vd_context *context, const char *path, size_t limit_bytes, void **data,
                       size_t *size_bytes) {
    if (strcmp(path, "-") == 0) {
        return read_all(context, "standard input", STDIN_FILENO, BUFFER_BYTES, limit_bytes, data,
                        size_bytes);
    }
    int descriptor = open(path, O_RDONLY | O_CLOEXEC);
    if (descriptor < 0) {
        return read_failure(path, errno);
    }
    struct stat info;
    vd_status status;
    if (fstat(descriptor, &info) != 0) {
        status = read_failure(path, errno);
    } else if (S_ISDIR(info.st_mode)) {
        status = read_failure(path, EISDIR);
    } else if (S_ISCHR(info.st_mode) || S_ISBLK(info.st_mode)) {
        /* /dev/zero never ends, a terminal or a disk is surely a mistake; pipes are read. */
        status = vd_failure(VD_ERROR_IO,
                            "cannot read %s: it is a device, not a file; name a file, a pipe, or - "
                            "for standard input",
                            path);
    } else {
        size_t hint = S_ISREG(info.st_mode) && info.st_size >= 0 ? (size_t)info.st_size : 65536;
        status = read_all(context, path, descriptor, hint, limit_bytes, data, size_bytes);
    }
    close(descriptor);
    return status;
}

static vd_status write_failure(const char *path, int error) {
    const char *remedy = error == ENOENT || error == ENOTDIR  ? "create the folder first"
                         : error == EACCES || error == EROFS  ? "choose a folder you may write to"
                         : error == ENOSPC || error == EDQUOT ? "free some space"
                         : error == EISDIR                    ? "name a file inside it"
                         : error == EPIPE ? "let the command behind the pipe read to the end"
                                          : "check the disk and try again";
    return vd_failure(VD_ERROR_IO, "cannot write %s: %s; %s",
                      strcmp(path, "-") == 0 ? "standard output" : path, strerror(error), remedy);
}

static void release_parts(vd_file *file) {
    vd_release(file->context, file->path);
    vd_release(file->context, file->beside);
    vd_release(file->context, file->buffer);
    memset(file, 0, sizeof *file);
    file->descriptor = -1;
}

/* Lets the destination be what a symbolic link points to, so that the link stays. One that points
 * nowhere is replaced. */
static int follow_link(vd_file *file) {
    struct stat info;
    if (lstat(file->path, &info) != 0 || !S_ISLNK(info.st_mode)) {
        return 0;
    }
    char *target = realpath(file->path, NULL);
    if (target == NULL) {
        return errno == ENOMEM ? ENOMEM : 0;
    }
    char *copy = vd_copy_string(file->context, target);
    free(target);
    if (copy == NULL) {
        return ENOMEM;
    }
    vd_release(file->context, file->path);
    file->path = copy;
    return 0;
}

/* Opens the place that bytes go to; devices, pipes and standard output are written directly. */
static int open_destination(vd_file *file) {
    if (strcmp(file->path, "-") == 0) {
        file->descriptor = dup(STDOUT_FILENO);
        return file->descriptor < 0 ? errno : 0;
    }
    if (follow_link(file) != 0) {
        return ENOMEM;
    }
    struct stat info;
    if (stat(file->path, &info) == 0) {
        if (S_ISDIR(info.st_mode)) {
            return EISDIR;
        }
        if (!S_ISREG(info.st_mode)) {
            file->descriptor = open(file->path, O_WRONLY | O_CLOEXEC);
            return file->descriptor < 0 ? errno : 0;
        }
    }
    size_t length = strlen(file->path);
    file->beside = vd_allocate(file->context, length + 12, 1);
    if (file->beside == NULL) {
        return ENOMEM;
    }
    snprintf(file->beside, length + 12, "%s.XXXXXX", file->path);
    file->descriptor = mkostemp(file->beside, O_CLOEXEC);
    if (file->descriptor < 0) {
        int error = errno;
        vd_release(file->context, file->beside);
        file->beside = NULL;
        return error;
    }
    mode_t mask = umask(0);
    umask(mask);
    /* mkostemp makes private files; a picture gets the permissions that any new file would. */
    (void)fchmod(file->descriptor, 0666 & ~mask);
    return 0;
}

vd_status vd_file_create(vd_context *context, const char *path, vd_file *out) {
    vd_file file;
    memset(&file, 0, sizeof file);
    file.context = context;
    file.descriptor = -1;
    file.path = vd_copy_string(context, path);
    file.buffer = vd_allocate(context, BUFFER_BYTES, 1);
    if (file.path == NULL || file.buffer == NULL) {
        release_parts(&file);
        return vd_out_of_memory(path, BUFFER_BYTES);
    }
    int error = open_destination(&file);
    if (error != 0) {
        release_parts(&file);
        return error == ENOMEM ? vd_out_of_memory(path, strlen(path)) : write_failure(path, error);
    }
    *out = file;
    return vd_success();
}

static void write_now(vd_file *file, const uint8_t *data, size_t size_bytes) {
    while (size_bytes > 0 && file->error == 0) {
        ssize_t written = write(file->descriptor, data, size_bytes);
        if (written < 0) {
            file->error = errno == EINTR ? 0 : errno;
            continue;
        }
        data += written;
        size_bytes -= (size_t)written;
    }
}

void vd_file_write(vd_file *file, const void *data, size_t size_bytes) {
    if (file->buffered + size_bytes > BUFFER_BYTES) {
        write_now(file, file->buffer, file->buffered);
        file->buffered = 0;
    }
    if (size_bytes > BUFFER_BYTES) {
        write_now(file, data, size_bytes);
        return;
    }
    memcpy(file->buffer + file->buffered, data, size_bytes);
    file->buffered += size_bytes;
}

void vd_file_write_at(vd_file *file, uint64_t offset, const void *data, size_t size_bytes) {
    write_now(file, file->buffer, file->buffered);
    file->buffered = 0;
    const uint8_t *at = data;
    while (size_bytes > 0 && file->error == 0) {
        ssize_t written = pwrite(file->descriptor, at, size_bytes, (off_t)offset);
        if (written < 0) {
            file->error = errno == EINTR ? 0 : errno;
            continue;
        }
        at += written;
        offset += (uint64_t)written;
        size_bytes -= (size_t)written;
    }
}

vd_status vd_file_commit(vd_file *file) {
    write_now(file, file->buffer, file->buffered);
    file->buffered = 0;
    int error = file->error;
    if (close(file->descriptor) != 0 && error == 0) {
        error = errno;
    }
    file->descriptor = -1;
    if (error == 0 && file->beside != NULL && rename(file->beside, file->path) != 0) {
        error = errno;
    }
    vd_status status = error == 0 ? vd_success() : write_failure(file->path, error);
    if (error != 0 && file->beside != NULL) {
        unlink(file->beside);
    }
    release_parts(file);
    return status;
}

void vd_file_discard(vd_file *file) {
    if (file->descriptor >= 0) {
        close(file->descriptor);
    }
    if (file->beside != NULL) {
        unlink(file->beside);
    }
    release_parts(file);
}

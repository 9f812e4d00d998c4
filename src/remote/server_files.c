/* server_files.c: the page, read once.
 *
 * What is served is a table of what was there at the start, found by exact name: no path of a
 * request ever reaches the file system.
 */
#include <dirent.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include "remote/server_internal.h"

enum { MOST_FILES = 512, MOST_DEPTH = 6 };

#define MOST_BYTES ((size_t)64 << 20)

static const char missing_page[] =
    "<!doctype html>\n<html lang=\"en\"><meta charset=\"utf-8\"><title>Veduta</title>\n"
    "<h1>Veduta</h1>\n<p>This server has no page: its folder was not found when it started. Name "
    "it "
    "with <code>veduta serve --root FOLDER</code>. The socket and <a href=\"/health\">/health</a> "
    "work without it.</p>\n</html>\n";

static const char *type_of(const char *path) {
    static const char *const types[][2] = {
        {".html", "text/html; charset=utf-8"},
        {".js", "text/javascript; charset=utf-8"},
        {".mjs", "text/javascript; charset=utf-8"},
        {".css", "text/css; charset=utf-8"},
        {".json", "application/json"},
        {".map", "application/json"},
        {".webmanifest", "application/manifest+json"},
        {".wasm", "application/wasm"},
        {".svg", "image/svg+xml"},
        {".png", "image/png"},
        {".jpg", "image/jpeg"},
        {".webp", "image/webp"},
        {".ico", "image/x-icon"},
        {".woff2", "font/woff2"},
        {".txt", "text/plain; charset=utf-8"},
    };
    const size_t length = strlen(path);
    for (size_t i = 0; i < sizeof types / sizeof types[0]; i++) {
        const size_t ending = strlen(types[i][0]);
        if (length > ending && strcmp(path + length - ending, types[i][0]) == 0) {
            return types[i][1];
        }
    }
    return "application/octet-stream";
}

static vd_status add(vd_server *server, const char *path, uint8_t *data, size_t bytes) {
    char *name = malloc(strlen(path) + 1);
    if (name == NULL) {
        free(data);
        return vd_failure(VD_ERROR_MEMORY, "not enough memory for the page; free some");
    }
    strcpy(name, path);
    server->files[server->file_count++] = (vd_server_file){name, type_of(name), data, bytes};
    return vd_success();
}

static vd_status read_file(vd_server *server, const char *from, const char *path, size_t bytes,
                           size_t *all) {
    FILE *file = fopen(from, "rb");
    uint8_t *data = malloc(bytes + 1);
    vd_status status = vd_success();
    *all += bytes;
    if (file == NULL) {
        status = vd_failure(VD_ERROR_IO, "cannot read %.200s: %s; check its permissions", from,
                            strerror(errno));
    } else if (data == NULL) {
        status = vd_failure(VD_ERROR_MEMORY, "not enough memory for %.200s; free some", from);
    } else if (fread(data, 1, bytes, file) != bytes) {
        status = vd_failure(VD_ERROR_IO, "cannot read %.200s: it became shorter; try again", from);
    }
    if (file != NULL) {
        (void)fclose(file);
    }
    if (status.code != VD_OK) {
        free(data);
        return status;
    }
    return add(server, path, data, bytes);
}

/* Links and names that begin with a dot are left out. */
static vd_status read_folder(vd_server *server, const char *path, int depth, size_t *all) {
    char from[1024], inside[512];
    (void)snprintf(from, sizeof from, "%s%s", server->def.root, path);
    DIR *folder = opendir(from);
    if (folder == NULL) {
        return vd_failure(VD_ERROR_IO, "cannot read the folder %.200s: %s; check its permissions",
                          from, strerror(errno));
    }
    vd_status status = vd_success();
    for (struct dirent *entry = readdir(folder); entry != NULL && status.code == VD_OK;
         entry = readdir(folder)) {
        struct stat info;
        if (entry->d_name[0] == '.' ||
            snprintf(inside, sizeof inside, "%s/%s", path, entry->d_name) >= (int)sizeof inside ||
            snprintf(from, sizeof from, "%s%s", server->def.root, inside) >= (int)sizeof from ||
            lstat(from, &info) != 0) {
            continue;
        }
        if (S_ISDIR(info.st_mode) && depth < MOST_DEPTH) {
            status = read_folder(server, inside, depth + 1, all);
        } else if (S_ISREG(info.st_mode)) {
            if (server->file_count == MOST_FILES || (size_t)info.st_size > MOST_BYTES - *all) {
                status = vd_failure(VD_ERROR_LIMIT,
                                    "the page at %.200s has more than %d files or 64 MiB; name "
                                    "the folder of the page alone",
                                    server->def.root, (int)MOST_FILES);
            } else {
                status = read_file(server, from, inside, (size_t)info.st_size, all);
            }
        }
    }
    (void)closedir(folder);
    return status;
}

vd_status vd_server_read_files(vd_server *server) {
    struct stat info;
    size_t all = 0;
    server->files = calloc(MOST_FILES + 1, sizeof *server->files);
    if (server->files == NULL) {
        return vd_failure(VD_ERROR_MEMORY, "not enough memory for the page; free some");
    }
    if (server->def.root != NULL && stat(server->def.root, &info) == 0) {
        const vd_status status = read_folder(server, "", 0, &all);
        if (status.code != VD_OK) {
            return status;
        }
    }
    server->has_page = vd_server_find_file(server, "/index.html") != NULL;
    if (server->has_page) {
        return vd_success();
    }
    uint8_t *data = malloc(sizeof missing_page);
    if (data == NULL) {
        return vd_failure(VD_ERROR_MEMORY, "not enough memory for the page; free some");
    }
    memcpy(data, missing_page, sizeof missing_page);
    return add(server, "/index.html", data, sizeof missing_page - 1);
}

void vd_server_forget_files(vd_server *server) {
    for (size_t i = 0; i < server->file_count; i++) {
        free(server->files[i].path);
        free(server->files[i].data);
    }
    free(server->files);
    server->files = NULL;
    server->file_count = 0;
}

const vd_server_file *vd_server_find_file(const vd_server *server, const char *path) {
    const char *name = strcmp(path, "/") == 0 ? "/index.html" : path;
    for (size_t i = 0; i < server->file_count; i++) {
        if (strcmp(server->files[i].path, name) == 0) {
            return &server->files[i];
        }
    }
    return NULL;
}

/* options_json.h: options and JSON values, for files that hold more than options. */
#ifndef VEDUTA_APP_OPTIONS_JSON_H
#define VEDUTA_APP_OPTIONS_JSON_H

#include <jansson.h>

#include "options.h"

/* Reads JSON from a file, or from standard input for "-"; the caller decrefs *out. An options file
 * has at most 1 MiB, a world file (what has "veduta_world" in its first MiB) 1 GiB. Returns
 * VD_ERROR_IO, VD_ERROR_FORMAT (with line and column), VD_ERROR_LIMIT or VD_ERROR_MEMORY. */
VD_MUST_USE vd_status vd_json_load(const char *path, json_t **out);

/* Writes the folder of a path: "" where it names none. */
void vd_folder_of(const char *path, char out[4096]);

/* Returns folder/path, or a copy of path when it is absolute, "-", or there is no folder; the
 * caller frees it. Null when memory is out. */
char *vd_join_path(const char *folder, const char *path);

/* Sets an option as an options file does: lists as texts with commas, paths relative to `folder`.
 * Returns VD_ERROR_ARGUMENT, whose sentence opens with the flag's name, or VD_ERROR_MEMORY. */
VD_MUST_USE vd_status vd_options_set_json(vd_options *options, int index, const json_t *value,
                                          const char *folder);

/* Reads an options file's root; see vd_options_read_json. */
VD_MUST_USE vd_status vd_options_read_root(vd_options *options, const json_t *root,
                                           const char *name, const char *folder);

/* Returns an option's value as it stands in the file of this name, or a path as it stands there: a
 * path relative to the working folder becomes absolute where the file lies in another. Null when
 * memory is out. */
json_t *vd_option_json(const vd_options *options, int index, const char *file);
json_t *vd_path_json(const char *path, const char *file);

/* Writes JSON to a file so that every real in it reads back the same. */
VD_MUST_USE vd_status vd_json_save(const json_t *root, const char *path);

#endif

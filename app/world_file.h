/* world_file.h: worlds as JSON files: docs/world.md.
 *
 * What says how terrain, light and camera are stands in the option table already: a world file sets
 * these options, as an options file does, so that flags win over it. What stands on the terrain
 * goes to the content.
 */
#ifndef VEDUTA_APP_WORLD_FILE_H
#define VEDUTA_APP_WORLD_FILE_H

#include "world_content.h"

/* The version that is read and written. */
#define VD_WORLD_VERSION 1

/* Reads a world file, which has the key "veduta_world", or else an options file ("-": standard
 * input). The flags must have been parsed: --camera chooses among the file's cameras, and for
 * --save-world the file's lists are kept. Without content (null) these are left out, which
 * options->note then says. Returns what vd_json_load and vd_options_read_json do;
 * for a world VD_ERROR_FORMAT with a sentence that names file and key, VD_ERROR_UNSUPPORTED (a
 * later version) or VD_ERROR_ARGUMENT (two worlds, no such camera). */
VD_MUST_USE vd_status vd_world_file_load(vd_options *options, const char *path,
                                         vd_world_content *content);

/* Lets a sentence about an option that a world file has set name the file. */
vd_status vd_world_file_blame(const vd_options *options, const vd_world_content *content,
                              const vd_status *status);

/* Writes options and content as a world file that gives the same picture. */
VD_MUST_USE vd_status vd_world_file_save(const vd_options *options, const vd_world_content *content,
                                         const char *path);

/* ---- which key is which option ----------------------------------------------------------------
 */

typedef struct vd_world_option {
    const char *key; /* in the file */
    const char *option;
} vd_world_option;

/* Lists end with null. */
extern const vd_world_option vd_world_root_options[], vd_world_terrain_options[],
    vd_world_picture_options[], vd_world_camera_options[];

#endif

/* world_save.c: --save-world. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "options_json.h"
#include "world_file.h"

/* The camera's name where the world has none. */
static const char default_camera[] = "main";

/* Texts that are lists of numbers, as a list; others, and what has units in it, as they are. */
static json_t *value_of(const vd_options *options, int index, const char *file) {
    double numbers[4];
    const vd_option *option = &options->table[index];
    const char *text = options->values[index].text;
    const bool list = option->type == VD_OPTION_TEXT && index != OPTION_TITLE;
    const int count = list ? vd_read_numbers(text, numbers, 4) : 0;
    if (count < 2) {
        return vd_option_json(options, index, file);
    }
    json_t *made = json_array();
    for (int i = 0; i < count; i++) {
        const bool whole = numbers[i] == floor(numbers[i]) && fabs(numbers[i]) < 1e15;
        json_t *number = whole ? json_integer((json_int_t)numbers[i]) : json_real(numbers[i]);
        if (json_array_append_new(made, number) != 0) {
            json_decref(made);
            return NULL;
        }
    }
    return made;
}

/* Adds the options of a section that were given. */
static json_t *section(const vd_options *options, const vd_world_option *pairs, json_t *to,
                       const char *file, bool *failed) {
    for (int i = 0; pairs[i].key != NULL; i++) {
        const int index = vd_options_find(options, pairs[i].option);
        if (index >= 0 && vd_options_given(options, index)) {
            json_t *value = value_of(options, index, file);
            *failed |= json_object_set_new(to, pairs[i].key, value) != 0;
        }
    }
    return to;
}

static void add_section(json_t *root, const char *key, json_t *value, bool *failed) {
    if (json_object_size(value) > 0) {
        *failed |= json_object_set(root, key, value) != 0;
    }
    json_decref(value);
}

/* A path of the world's file as a path of the new one. */
static void move_path(json_t *object, const char *key, const char *folder, const char *file,
                      bool *failed) {
    json_t *value = json_object_get(object, key);
    if (json_is_string(value)) {
        char *joined = vd_join_path(folder, json_string_value(value));
        json_t *moved = joined != NULL ? vd_path_json(joined, file) : NULL;
        *failed |= json_object_set_new(object, key, moved) != 0;
        free(joined);
    }
}

/* A list of the world's file, its paths moved; an empty one where it has none. */
static json_t *moved_list(const vd_world_content *content, const char *key, const char *file,
                          bool *failed) {
    static const char *const paths[] = {"mesh", "picture", "file", "instances"};
    const json_t *list = content->root != NULL ? json_object_get(content->root, key) : NULL;
    json_t *made = list != NULL ? json_deep_copy(list) : json_array();
    size_t index;
    json_t *item;
    json_array_foreach(made, index, item) {
        for (size_t i = 0; i < sizeof paths / sizeof paths[0]; i++) {
            move_path(item, paths[i], content->folder, file, failed);
        }
        vd_colormap map;
        const char *colors = json_string_value(json_object_get(item, "colormap"));
        if (colors != NULL && !vd_colormap_find(colors, &map)) {
            move_path(item, "colormap", content->folder, file, failed);
        }
    }
    *failed |= made == NULL;
    return made;
}

static void add_list(json_t *root, const char *key, json_t *list, bool *failed) {
    if (json_array_size(list) > 0) {
        *failed |= json_object_set(root, key, list) != 0;
    }
    json_decref(list);
}

/* Adds {"file": PATH} where an option names one. */
static void add_file(json_t *list, const vd_options *options, int option, const char *file,
                     bool *failed) {
    const char *path = options->values[option].text;
    if (path != NULL) {
        json_t *item = json_pack("{s: o}", "file", vd_path_json(path, file));
        *failed |= json_array_append_new(list, item) != 0;
    }
}

/* The labels, with those of the flags in place of the file's where both say it. */
static json_t *labels(const vd_options *options, const vd_world_content *content, const char *file,
                      bool *failed) {
    json_t *list = moved_list(content, "labels", file, failed);
    for (size_t i = json_array_size(list); i-- > 0;) {
        if (json_object_get(json_array_get(list, i), "peaks") != NULL) {
            *failed |= json_array_remove(list, i) != 0;
        }
    }
    add_file(list, options, OPTION_LABELS, file, failed);
    const int count = (int)options->values[OPTION_LABEL_PEAKS].number;
    if (count > 0) {
        const bool show = content->peaks_hidden == VD_LABEL_SHOW;
        json_t *peaks = json_pack("{s: i, s: s}", "peaks", count, "hidden", show ? "show" : "hide");
        *failed |= json_array_append_new(list, peaks) != 0;
    }
    return list;
}

static void add_terrain(json_t *root, const vd_options *options, const char *file, bool *failed) {
    json_t *terrain = json_object();
    if (options->input_count > 0) {
        json_t *heights = json_array();
        for (int i = 0; i < options->input_count; i++) {
            *failed |= json_array_append_new(heights, vd_path_json(options->inputs[i], file)) != 0;
        }
        *failed |= json_object_set_new(terrain, "heights", heights) != 0;
    }
    section(options, vd_world_terrain_options, terrain, file, failed);
    add_section(root, "terrain", terrain, failed);
}

/* The camera as the flags left it, among the others of the file. */
static void add_cameras(json_t *root, const vd_options *options, const vd_world_content *content,
                        const char *file, bool *failed) {
    const json_t *old = content->root != NULL ? json_object_get(content->root, "cameras") : NULL;
    json_t *cameras = old != NULL ? json_deep_copy(old) : json_object();
    json_t *own = section(options, vd_world_camera_options, json_object(), file, failed);
    const char *name = content->camera != NULL ? content->camera : default_camera;
    if (content->camera == NULL && json_object_size(own) == 0) {
        json_decref(own); /* it is framed, and nothing is said of it */
    } else {
        *failed |= json_object_set_new(cameras, name, own) != 0;
        *failed |= json_object_set_new(root, "camera", json_string(name)) != 0;
    }
    add_section(root, "cameras", cameras, failed);
}

vd_status vd_world_file_save(const vd_options *options, const vd_world_content *content,
                             const char *path) {
    bool failed = false;
    json_t *root = json_pack("{s: i}", "veduta_world", VD_WORLD_VERSION);
    add_terrain(root, options, path, &failed);
    add_section(root, "picture",
                section(options, vd_world_picture_options, json_object(), path, &failed), &failed);
    section(options, vd_world_root_options, root, path, &failed);
    if (content->legend_title != NULL && options->values[OPTION_LEGEND].number != 0.0) {
        failed |= json_object_set_new(root, "legend", json_string(content->legend_title)) != 0;
    }
    add_cameras(root, options, content, path, &failed);
    add_list(root, "objects", moved_list(content, "objects", path, &failed), &failed);
    add_list(root, "sprites", moved_list(content, "sprites", path, &failed), &failed);
    json_t *lines = moved_list(content, "lines", path, &failed);
    add_file(lines, options, OPTION_LINES, path, &failed);
    add_list(root, "lines", lines, &failed);
    add_list(root, "particles", moved_list(content, "particles", path, &failed), &failed);
    add_list(root, "labels", labels(options, content, path, &failed), &failed);
    const vd_status status = vd_json_save(failed ? NULL : root, path);
    json_decref(root);
    return status;
}

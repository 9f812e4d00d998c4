/* world_file.c: reading worlds. */
#include "world_file.h"

#include <stdlib.h>
#include <string.h>

#include "options_json.h"
#include "world_reader.h"

const vd_world_option vd_world_root_options[] = {
    {"sun", "sun"},
    {"sky", "sky"},
    {"haze", "haze"},
    {"shadows", "shadows"},
    {"shading", "shading"},
    {"curvature", "curvature"},
    {"background", "background"},
    {"title", "title"},
    {"north_arrow", "north-arrow"},
    {"scale_bar", "scale-bar"},
    {"legend", "legend"},
    {NULL, NULL},
};

const vd_world_option vd_world_terrain_options[] = {
    {"colors", "color"},
    {"colormap", "colormap"},
    {"exaggeration", "exaggerate"},
    {"function", "function"},
    {"extent", "extent"},
    {"cell_size", "cell-size"},
    {"missing", "missing"},
    {"nodata", "nodata"},
    {"height_scale", "height-scale"},
    {"height_offset", "height-offset"},
    {"height_encoding", "height-encoding"},
    {"raw", "raw"},
    {"band", "band"},
    {"bands", "bands"},
    {NULL, NULL},
};

const vd_world_option vd_world_picture_options[] = {
    {"size", "size"},     {"samples", "samples"}, {"filter", "filter"},
    {"preset", "preset"}, {"method", "method"},   {"allow_empty", "allow-empty"},
    {NULL, NULL},
};

const vd_world_option vd_world_camera_options[] = {
    {"azimuth", "azimuth"},   {"elevation", "elevation"},
    {"distance", "distance"}, {"eye", "eye"},
    {"target", "target"},     {"heading", "heading"},
    {"pitch", "pitch"},       {"roll", "roll"},
    {"fov", "fov"},           {"projection", "projection"},
    {"near", "near"},         {NULL, NULL},
};

/* What of a file's own keys is no option. */
static const char *const root_names[] = {"veduta_world", "terrain",  "picture", "cameras",
                                         "camera",       "objects",  "sprites", "lines",
                                         "labels",       "particles"};

enum { ROOT_NAMES = sizeof root_names / sizeof root_names[0], MOST_NAMES = 32 };

/* Sets one option from a value. What the table says of the flag is said of the key. */
static void set_option(vd_world_reader *r, vd_options *options, const vd_world_option *pair,
                       const json_t *value) {
    const int index = vd_options_find(options, pair->option);
    if (index < 0) {
        return; /* another command's table, which has no use for it */
    }
    const vd_status status = vd_options_set_json(options, index, value, r->content->folder);
    if (status.code == VD_ERROR_ARGUMENT) {
        const size_t flag = strlen(pair->option) + 4; /* "--" and ": " */
        const char *what = status.message;
        what += strlen(what) > flag && what[flag - 2] == ':' ? flag : 0;
        vd_world_fail(r, pair->key, "%s", what);
    } else if (status.code != VD_OK) {
        r->status = status;
    }
}

/* Reads an object all of whose keys are options, beside `more`. */
static void read_options(vd_world_reader *r, vd_options *options, const vd_world_option *pairs,
                         const char *const *more, int more_count) {
    const char *names[MOST_NAMES] = {NULL};
    int count = 0;
    for (; count < more_count; count++) {
        names[count] = more[count];
    }
    for (int i = 0; pairs[i].key != NULL; i++) {
        names[count++] = pairs[i].key;
        const json_t *value = vd_world_value(r, pairs[i].key);
        if (value != NULL) {
            set_option(r, options, &pairs[i], value);
        }
    }
    vd_world_check_keys(r, names);
}

/* Reads such an object under a key. */
static void read_section(vd_world_reader *file, const char *key, vd_options *options,
                         const vd_world_option *pairs, const char *const *more, int more_count) {
    const json_t *value = vd_world_value(file, key);
    if (value == NULL) {
        return;
    }
    if (!json_is_object(value)) {
        vd_world_fail(file, key, "it is not an object; give one: {\"key\": value, …}");
        return;
    }
    vd_world_reader r = {.content = file->content, .object = value, .item = key};
    read_options(&r, options, pairs, more, more_count);
    file->status = r.status;
}

/* "heights": a file or several. */
static void read_heights(vd_world_reader *file, vd_options *options) {
    const json_t *terrain = vd_world_value(file, "terrain");
    const json_t *heights = json_object_get(terrain, "heights");
    const bool one = json_is_string(heights);
    const size_t count = one ? 1 : json_array_size(heights);
    if (heights == NULL) {
        return;
    }
    if (count == 0) {
        vd_world_fail(file, "terrain.heights", "it is neither a file nor a list of them; give one");
    }
    for (size_t i = 0; i < count && file->status.code == VD_OK; i++) {
        const json_t *name = one ? heights : json_array_get(heights, i);
        if (!json_is_string(name) || json_string_length(name) == 0) {
            vd_world_fail(file, "terrain.heights", "item %zu is not the name of a file; give one",
                          i + 1);
            return;
        }
        char *path = vd_join_path(file->content->folder, json_string_value(name));
        if (path == NULL) {
            vd_world_fail_memory(file);
            return;
        }
        file->status = vd_options_add_input(options, path, VD_SOURCE_FILE);
        free(path);
    }
}

/* "legend": true, or what stands over it. */
static void read_legend(vd_world_reader *file, vd_options *options) {
    const json_t *legend = vd_world_value(file, "legend");
    static const vd_world_option pair = {"legend", "legend"};
    if (json_is_string(legend) && json_string_length(legend) > 0) {
        file->content->legend_title = vd_world_text(file, "legend");
        set_option(file, options, &pair, json_true());
    } else if (legend != NULL) {
        set_option(file, options, &pair, legend);
    }
}

/* "labels": [{"peaks": N}] is --label-peaks. */
static void read_peaks(vd_world_reader *file, vd_options *options) {
    static const vd_world_option pair = {"labels.peaks", "label-peaks"};
    const json_t *list = vd_world_value(file, "labels");
    for (size_t i = 0; i < json_array_size(list) && file->status.code == VD_OK; i++) {
        const json_t *peaks = json_object_get(json_array_get(list, i), "peaks");
        if (peaks != NULL) {
            set_option(file, options, &pair, peaks);
        }
    }
}

static vd_status no_camera(const vd_world_content *content, const json_t *cameras,
                           const char *wanted, bool by_flag) {
    const char *names[64], *nearest = NULL, *key;
    char list[160] = "";
    int count = 0;
    json_t *value;
    json_object_foreach((json_t *)cameras, key, value) {
        if (count < 64) {
            names[count++] = key;
            const size_t used = strlen(list);
            snprintf(list + used, sizeof list - used, "%s%.40s", used > 0 ? ", " : "", key);
        }
    }
    nearest = vd_nearest_name(wanted, names, count);
    const char *remedy = nearest != NULL ? "did you mean " : count > 0 ? "it has " : "it has none";
    return vd_failure(by_flag ? VD_ERROR_ARGUMENT : VD_ERROR_FORMAT,
                      "%s%.120s: %sthere is no camera \"%.60s\"; %s%s%s",
                      by_flag ? "--camera: " : "", content->name, by_flag ? "" : "camera: ", wanted,
                      remedy, nearest != NULL ? nearest : list, nearest != NULL ? "?" : "");
}

/* Sets the options of the camera that --camera or the file's "camera" names, and checks others. */
static void read_cameras(vd_world_reader *file, vd_options *options) {
    const int flag = vd_options_find(options, "camera");
    const char *by_flag = flag >= 0 ? options->values[flag].text : NULL;
    const char *by_file = vd_world_text(file, "camera");
    const char *wanted = by_flag != NULL ? by_flag : by_file;
    const json_t *cameras = vd_world_value(file, "cameras");
    const char *key;
    json_t *value;
    if (cameras != NULL && !json_is_object(cameras)) {
        vd_world_fail(file, "cameras",
                      "it is not an object; give one: {\"name\": {\"azimuth\": …}, …}");
    }
    json_object_foreach((json_t *)cameras, key, value) {
        char item[64];
        snprintf(item, sizeof item, "cameras.%.50s", key);
        vd_world_reader r = {.content = file->content, .object = value, .item = item};
        if (!json_is_object(value)) {
            vd_world_fail(&r, "", "it is not an object; give one: {\"azimuth\": …}");
        } else if (wanted != NULL && strcmp(key, wanted) == 0) {
            read_options(&r, options, vd_world_camera_options, NULL, 0);
        }
        if (file->status.code == VD_OK) {
            file->status = r.status;
        }
    }
    if (file->status.code == VD_OK && wanted != NULL && json_object_get(cameras, wanted) == NULL) {
        file->status = no_camera(file->content, cameras, wanted, by_flag != NULL);
    }
    if (file->status.code == VD_OK && wanted != NULL) {
        char *kept = vd_world_keep(file, strlen(wanted) + 1, 1);
        if (kept != NULL) {
            strcpy(kept, wanted);
            file->content->camera = kept;
        }
    }
}

static vd_status check_version(const vd_world_content *content, const json_t *root) {
    const json_t *version = json_object_get(root, "veduta_world");
    if (!json_is_integer(version) || json_integer_value(version) < 1) {
        return vd_failure(VD_ERROR_FORMAT, "%.200s: veduta_world: it is not a version; give %d",
                          content->name, VD_WORLD_VERSION);
    }
    if (json_integer_value(version) > VD_WORLD_VERSION) {
        return vd_failure(VD_ERROR_UNSUPPORTED,
                          "%.200s: veduta_world: it is of version %lld, and veduta %s reads up to "
                          "%d; get a newer veduta",
                          content->name, (long long)json_integer_value(version), vd_version(),
                          VD_WORLD_VERSION);
    }
    return vd_success();
}

static vd_status read_root(vd_options *options, vd_world_content *content, const json_t *root) {
    static const char *const terrain_more[] = {"heights"};
    /* The legend may be a text, which its option may not. */
    const vd_world_option *others = vd_world_root_options;
    vd_world_option pairs[MOST_NAMES] = {{NULL, NULL}};
    const char *names[MOST_NAMES] = {NULL};
    int count = 0;
    for (int i = 0; i < ROOT_NAMES; i++) {
        names[i] = root_names[i];
    }
    names[ROOT_NAMES] = "legend";
    for (int i = 0; others[i].key != NULL; i++) {
        if (strcmp(others[i].key, "legend") != 0) {
            pairs[count++] = others[i];
        }
    }
    vd_world_reader file = {.content = content, .object = root, .item = ""};
    file.status = check_version(content, root);
    read_options(&file, options, pairs, names, ROOT_NAMES + 1);
    read_section(&file, "terrain", options, vd_world_terrain_options, terrain_more, 1);
    read_section(&file, "picture", options, vd_world_picture_options, NULL, 0);
    read_heights(&file, options);
    read_legend(&file, options);
    read_cameras(&file, options);
    if (file.status.code == VD_OK) {
        file.status = vd_world_content_read(content, root);
    }
    read_peaks(&file, options);
    options->world = true;
    return file.status;
}

static vd_status read_world(vd_options *options, const char *path, vd_world_content *content,
                            json_t *root) {
    char folder[4096];
    if (content->name != NULL) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "%.140s and %.140s are both worlds, and one is drawn; name one of them",
                          content->name, path);
    }
    vd_folder_of(path, folder);
    content->name = strdup(path);
    content->folder = strdup(folder);
    if (content->name == NULL || content->folder == NULL) {
        return vd_failure(VD_ERROR_MEMORY, "out of memory while reading %.200s", path);
    }
    const vd_status status = read_root(options, content, root);
    const int save = vd_options_find(options, "save-world");
    if (save >= 0 && options->values[save].text != NULL) {
        content->root = json_incref(root);
    }
    return status;
}

vd_status vd_world_file_load(vd_options *options, const char *path, vd_world_content *content) {
    vd_world_content unused = {.name = NULL};
    json_t *root = NULL;
    vd_status status = vd_json_load(path, &root);
    if (status.code == VD_OK && json_object_get(root, "veduta_world") != NULL) {
        status = read_world(options, path, content != NULL ? content : &unused, root);
    } else if (status.code == VD_OK) {
        char folder[4096];
        vd_folder_of(path, folder);
        status = vd_options_read_root(options, root, path, folder);
    }
    if (status.code == VD_OK && vd_world_content_any(&unused)) {
        snprintf(
            options->note, sizeof options->note,
            "%.160s: `veduta %s` does not draw its objects, sprites, lines, labels and particles",
            path, options->command);
    }
    vd_world_content_finish(&unused);
    json_decref(root);
    return status;
}

vd_status vd_world_file_blame(const vd_options *options, const vd_world_content *content,
                              const vd_status *status) {
    char key[64];
    const char *message = status->message;
    const size_t length = strncmp(message, "--", 2) == 0 ? strcspn(message + 2, ": ") : 0;
    if (content == NULL || content->name == NULL || status->code != VD_ERROR_ARGUMENT ||
        length == 0 || length >= sizeof key) {
        return *status;
    }
    memcpy(key, message + 2, length);
    key[length] = '\0';
    const int index = vd_options_find(options, key);
    return index >= 0 && options->values[index].source == VD_SOURCE_FILE
               ? vd_failure(VD_ERROR_FORMAT, "%.100s: %.270s", content->name, message)
               : *status;
}

/* options_json.c: a JSON file in place of flags, and --save. */
#define _GNU_SOURCE /* memmem */
#include "options_json.h"

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include <veduta/context.h>

/* A text that grows; `failed` is set when memory ran out and then nothing more is added. */
typedef struct growing_text {
    char *text;
    size_t length, capacity;
    bool failed;
} growing_text;

static void append(growing_text *out, const char *piece) {
    size_t length = strlen(piece);
    if (out->failed) {
        return;
    }
    if (out->length + length + 1 > out->capacity) {
        size_t capacity = 2 * (out->length + length + 1);
        char *longer = realloc(out->text, capacity);
        if (longer == NULL) {
            out->failed = true;
            return;
        }
        out->text = longer;
        out->capacity = capacity;
    }
    memcpy(out->text + out->length, piece, length + 1);
    out->length += length;
}

/* Appends a string, number or truth value as a flag would spell it; false for anything else. */
static bool append_scalar(growing_text *out, const json_t *value) {
    char number[40];
    if (json_is_string(value)) {
        append(out, json_string_value(value));
    } else if (json_is_integer(value)) {
        snprintf(number, sizeof number, "%" JSON_INTEGER_FORMAT, json_integer_value(value));
        append(out, number);
    } else if (json_is_real(value)) {
        snprintf(number, sizeof number, "%.17g", json_real_value(value));
        append(out, number);
    } else if (json_is_boolean(value)) {
        append(out, json_is_true(value) ? "on" : "off");
    } else {
        return false;
    }
    return true;
}

/* Spells any JSON value as the text of a flag: lists with commas, objects as KEY=VALUE,…. */
static bool append_value(growing_text *out, const json_t *value) {
    append(out, "");
    if (json_is_array(value)) {
        size_t index;
        json_t *item;
        json_array_foreach(value, index, item) {
            append(out, index > 0 ? "," : "");
            if (!append_scalar(out, item)) {
                return false;
            }
        }
        return true;
    }
    if (json_is_object(value)) {
        const char *key;
        json_t *item;
        const char *separator = "";
        json_object_foreach((json_t *)value, key, item) {
            append(out, separator);
            append(out, key);
            append(out, "=");
            if (!append_scalar(out, item)) {
                return false;
            }
            separator = ",";
        }
        return true;
    }
    return append_scalar(out, value);
}

char *vd_join_path(const char *folder, const char *path) {
    if (folder[0] == '\0' || path[0] == '/' || strcmp(path, "-") == 0) {
        return strdup(path);
    }
    size_t length = strlen(folder) + strlen(path) + 2;
    char *joined = malloc(length);
    if (joined != NULL) {
        snprintf(joined, length, "%s/%s", folder, path);
    }
    return joined;
}

static bool is_path(const vd_option *option, const char *text) {
    return option->type == VD_OPTION_FILE && (option->is_name == NULL || !option->is_name(text));
}

static vd_status out_of_memory(const char *name) {
    return vd_failure(VD_ERROR_MEMORY, "out of memory while reading %.200s", name);
}

static vd_status read_inputs(vd_options *options, const json_t *list, const char *name,
                             const char *folder) {
    size_t index;
    json_t *item;
    if (!json_is_array(list)) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "%.200s: \"inputs\" is not a list; give file names, as [\"dem.tif\"]",
                          name);
    }
    json_array_foreach(list, index, item) {
        if (!json_is_string(item) || json_string_length(item) == 0) {
            return vd_failure(VD_ERROR_ARGUMENT,
                              "%.200s: \"inputs\" item %zu is not a file name; give a string", name,
                              index + 1);
        }
        char *path = vd_join_path(folder, json_string_value(item));
        if (path == NULL) {
            return out_of_memory(name);
        }
        vd_status status = vd_options_add_input(options, path, VD_SOURCE_FILE);
        free(path);
        if (status.code != VD_OK) {
            return status;
        }
    }
    return vd_success();
}

static vd_status unknown_key(const vd_options *options, const char *key, const char *name) {
    const char *names[128];
    int count = 0;
    for (int i = 0; i < options->count && count < 126; i++) {
        if (!options->table[i].transient) {
            names[count++] = options->table[i].key;
        }
    }
    names[count++] = "inputs";
    const char *nearest = vd_nearest_name(key, names, count);
    if (nearest != NULL) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "%.200s: there is no key \"%.60s\"; did you mean "
                          "\"%s\"?",
                          name, key, nearest);
    }
    return vd_failure(VD_ERROR_ARGUMENT,
                      "%.200s: there is no key \"%.60s\"; the keys are those "
                      "of `veduta %s --help`",
                      name, key, options->command);
}

/* Reads up to three numbers with dots between, such as 0.1.0; what lacks counts as 0. */
static void read_version(const char *text, long out[3]) {
    for (int i = 0; i < 3; i++) {
        char *end = NULL;
        out[i] = strtol(text, &end, 10);
        text = end + (*end == '.');
    }
}

/* A file of a later version may mean what this one does not know. */
static void note_version(vd_options *options, const json_t *version, const char *name) {
    if (!json_is_string(version)) {
        return;
    }
    const char *text = json_string_value(version);
    long theirs[3], ours[3];
    read_version(text, theirs);
    read_version(vd_version(), ours);
    int i = theirs[0] == ours[0] ? 1 : 0; /* the third number changes no meaning */
    if (theirs[i] > ours[i]) {
        snprintf(options->note, sizeof options->note,
                 "%.120s was written by veduta %.20s, which is newer than this %.20s; it may not "
                 "give the same picture",
                 name, text, vd_version());
    }
}

vd_status vd_options_set_json(vd_options *options, int index, const json_t *value,
                              const char *folder) {
    const vd_option *option = &options->table[index];
    growing_text text = {0};
    vd_status status = vd_success();
    if (!append_value(&text, value)) {
        status = vd_failure(VD_ERROR_ARGUMENT,
                            "--%s: the value of \"%s\" is neither a text, a number, true, false "
                            "nor a list of them; give one",
                            option->key, option->key);
    } else if (text.failed) {
        status = out_of_memory("options");
    } else {
        char *spelled =
            is_path(option, text.text) ? vd_join_path(folder, text.text) : strdup(text.text);
        status = spelled == NULL ? out_of_memory("options")
                                 : vd_options_set(options, index, spelled, VD_SOURCE_FILE);
        free(spelled);
    }
    free(text.text);
    return status;
}

static vd_status read_key(vd_options *options, const char *key, const json_t *value,
                          const char *name, const char *folder) {
    if (strcmp(key, "veduta") == 0) {
        note_version(options, value, name);
        return vd_success();
    }
    if (strcmp(key, "inputs") == 0) {
        return read_inputs(options, value, name, folder);
    }
    int index = vd_options_find(options, key);
    if (index < 0 || options->table[index].transient) {
        return unknown_key(options, key, name);
    }
    vd_status status = vd_options_set_json(options, index, value, folder);
    return status.code != VD_ERROR_ARGUMENT
               ? status
               : vd_failure(VD_ERROR_ARGUMENT, "%.120s: %.240s", name, status.message);
}

vd_status vd_options_read_root(vd_options *options, const json_t *root, const char *name,
                               const char *folder) {
    vd_status status = vd_success();
    if (json_object_get(root, "veduta_path") != NULL) {
        status = vd_failure(VD_ERROR_FORMAT,
                            "%.200s is a camera path, not what it flies over; name it last, as in "
                            "`veduta fly world.json path.json`",
                            name);
    } else if (json_object_get(root, "veduta") == NULL) {
        status = vd_failure(VD_ERROR_FORMAT,
                            "cannot read %.200s: it is JSON but not an options "
                            "file, which has the key \"veduta\"; `veduta %s --save` writes one",
                            name, options->command);
    }
    const char *key;
    json_t *value;
    json_object_foreach((json_t *)root, key, value) {
        if (status.code != VD_OK) {
            break;
        }
        status = read_key(options, key, value, name, folder);
    }
    return status;
}

static vd_status parse(const char *text, size_t size_bytes, const char *name, json_t **out) {
    json_error_t error;
    json_t *root = json_loadb(text, size_bytes, JSON_REJECT_DUPLICATES, &error);
    if (root == NULL) {
        return vd_failure(VD_ERROR_FORMAT,
                          "cannot read %.160s: line %d, column %d: %.100s; correct "
                          "the JSON",
                          name, error.line, error.column, error.text);
    }
    *out = root;
    return vd_success();
}

vd_status vd_options_read_json(vd_options *options, const char *text, size_t size_bytes,
                               const char *name, const char *folder) {
    json_t *root = NULL;
    vd_status status = parse(text, size_bytes, name, &root);
    if (status.code == VD_OK) {
        status = vd_options_read_root(options, root, name, folder);
    }
    json_decref(root);
    return status;
}

/* ---- files ------------------------------------------------------------------------------------*/

#define MOST_OPTION_BYTES ((size_t)1 << 20)
#define MOST_WORLD_BYTES ((size_t)1 << 30)

/* A text that goes on behind its first MiB is a world's, or none of ours. */
static bool names_world(const char *text, size_t size_bytes) {
    static const char key[] = "\"veduta_world\"";
    return memmem(text, size_bytes, key, sizeof key - 1) != NULL;
}

/* Reads an open file to its end, MiB by MiB, growing; the caller frees *out in any case. */
static vd_status read_all(FILE *file, const char *path, char **out, size_t *size_bytes) {
    size_t capacity = MOST_OPTION_BYTES + 1, length = 0;
    for (;;) {
        char *longer = realloc(*out, capacity);
        if (longer == NULL) {
            return out_of_memory(path);
        }
        *out = longer;
        length += fread(longer + length, 1, capacity - length, file);
        if (ferror(file) != 0) {
            return vd_failure(VD_ERROR_IO, "cannot read %.200s: %s; check the file", path,
                              strerror(errno));
        }
        if (length < capacity) {
            break;
        }
        const bool world = names_world(longer, MOST_OPTION_BYTES);
        if (!world || capacity > MOST_WORLD_BYTES) {
            return vd_failure(VD_ERROR_LIMIT,
                              "cannot read %.200s: it is larger than %zu bytes, which no %s file "
                              "is; check the path",
                              path, world ? MOST_WORLD_BYTES : MOST_OPTION_BYTES,
                              world ? "world" : "options");
        }
        capacity *= 2;
    }
    *size_bytes = length;
    return vd_success();
}

vd_status vd_json_load(const char *path, json_t **out) {
    bool standard = strcmp(path, "-") == 0;
    FILE *file = standard ? stdin : fopen(path, "rb");
    if (file == NULL) {
        return vd_failure(VD_ERROR_IO, "cannot read %.200s: %s; check the path", path,
                          strerror(errno));
    }
    char *text = NULL;
    size_t size_bytes = 0;
    vd_status status = read_all(file, path, &text, &size_bytes);
    if (!standard) {
        fclose(file);
    }
    if (status.code == VD_OK) {
        status = parse(text, size_bytes, path, out);
    }
    free(text);
    return status;
}

void vd_folder_of(const char *path, char out[4096]) {
    const char *slash = strrchr(path, '/');
    out[0] = '\0';
    if (slash != NULL && (size_t)(slash - path) + 1 < 4096) {
        size_t length = slash == path ? 1 : (size_t)(slash - path);
        memcpy(out, path, length);
        out[length] = '\0';
    }
}

vd_status vd_options_load_json(vd_options *options, const char *path) {
    json_t *root = NULL;
    vd_status status = vd_json_load(path, &root);
    if (status.code == VD_OK) {
        char folder[4096];
        vd_folder_of(path, folder);
        status = vd_options_read_root(options, root, path, folder);
    }
    json_decref(root);
    return status;
}

/* Paths in a saved file are read relative to it. One that was given relative to the working folder
 * stays as it is when the file lies there, and becomes absolute otherwise. */
json_t *vd_path_json(const char *path, const char *file) {
    char folder[4096];
    if (strchr(file, '/') == NULL || path[0] == '/' || strcmp(path, "-") == 0 ||
        getcwd(folder, sizeof folder) == NULL) {
        return json_string(path);
    }
    char *joined = vd_join_path(folder, path);
    json_t *made = joined != NULL ? json_string(joined) : NULL;
    free(joined);
    return made;
}

json_t *vd_option_json(const vd_options *options, int index, const char *file) {
    const vd_option *option = &options->table[index];
    const vd_option_value *value = &options->values[index];
    switch (option->type) {
    case VD_OPTION_SWITCH:
    case VD_OPTION_FLAG:
        return value->number > 1.0 ? json_string(value->text) : json_boolean(value->number != 0.0);
    case VD_OPTION_INTEGER:
        return json_integer((json_int_t)value->number);
    case VD_OPTION_REAL:
        if (value->number == floor(value->number) && fabs(value->number) < 1e15) {
            return json_integer((json_int_t)value->number);
        }
        return json_real(value->number);
    default:
        return is_path(option, value->text) ? vd_path_json(value->text, file)
                                            : json_string(value->text);
    }
}

/* The digits with which every real in a value reads back the same, at least `digits`. */
static size_t digits_needed(const json_t *value, size_t digits) {
    char text[40];
    size_t index;
    const char *key;
    json_t *item;
    const double number = json_real_value(value);
    while (digits < 17 && (snprintf(text, sizeof text, "%.*g", (int)digits, number),
                           strtod(text, NULL) != number)) {
        digits++;
    }
    json_array_foreach(value, index, item) {
        digits = digits < 17 ? digits_needed(item, digits) : digits;
    }
    json_object_foreach((json_t *)value, key, item) {
        digits = digits < 17 ? digits_needed(item, digits) : digits;
    }
    return digits;
}

vd_status vd_json_save(const json_t *root, const char *path) {
    const size_t precision = digits_needed(root, 15);
    char *text =
        root != NULL ? json_dumps(root, JSON_INDENT(2) | JSON_REAL_PRECISION(precision)) : NULL;
    if (text == NULL) {
        return vd_failure(VD_ERROR_MEMORY,
                          "cannot write %.200s: out of memory, or a text that is "
                          "not UTF-8; use other file names",
                          path);
    }
    vd_status status = vd_write_text(path, text);
    free(text);
    return status;
}

vd_status vd_options_save_json(const vd_options *options, const char *path) {
    json_t *root = json_object();
    json_t *inputs = json_array();
    bool failed = json_object_set_new(root, "veduta", json_string(vd_version())) != 0;
    for (int i = 0; i < options->input_count; i++) {
        failed |= json_array_append_new(inputs, vd_path_json(options->inputs[i], path)) != 0;
    }
    failed |= json_object_set_new(root, "inputs", inputs) != 0;
    for (int i = 0; i < options->count; i++) {
        const vd_option *option = &options->table[i];
        if (vd_options_given(options, i) && !option->transient) {
            json_t *value = vd_option_json(options, i, path);
            failed |= json_object_set_new(root, option->key, value) != 0;
        }
    }
    vd_status status = vd_json_save(failed ? NULL : root, path);
    json_decref(root);
    return status;
}

vd_status vd_write_text(const char *path, const char *text) {
    bool standard = strcmp(path, "-") == 0;
    size_t length = strlen(path) + 16;
    char *beside = malloc(length);
    if (beside == NULL) {
        return vd_failure(VD_ERROR_MEMORY, "cannot write %.200s: out of memory", path);
    }
    snprintf(beside, length, "%s.%ld.part", path, (long)getpid());
    FILE *file = standard ? stdout : fopen(beside, "wb");
    bool failed = file == NULL || fputs(text, file) < 0 || fputc('\n', file) == EOF;
    failed = (file != NULL && fflush(file) != 0) || failed;
    int error = errno;
    if (!standard && file != NULL) {
        failed = fclose(file) != 0 || failed;
        if (!failed && rename(beside, path) != 0) {
            failed = true;
            error = errno;
        }
        if (failed) {
            remove(beside);
        }
    }
    free(beside);
    return failed ? vd_failure(VD_ERROR_IO, "cannot write %.200s: %s; check the path and the disk",
                               path, strerror(error))
                  : vd_success();
}

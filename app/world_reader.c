/* world_reader.c: values out of a world file's JSON. */
#include "world_reader.h"

#include <math.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include "options_json.h"

/* More warnings than this say the same again and again. */
enum { MOST_WARNINGS = 16 };

void vd_world_fail(vd_world_reader *reader, const char *key, const char *format, ...) {
    if (reader->status.code != VD_OK) {
        return;
    }
    char what[VD_MESSAGE_BYTES];
    va_list list;
    va_start(list, format);
    vsnprintf(what, sizeof what, format, list);
    va_end(list);
    reader->status = vd_failure(VD_ERROR_FORMAT, "%.140s: %s%s%.40s%s%s", reader->content->name,
                                reader->item, reader->item[0] != '\0' && key[0] != '\0' ? "." : "",
                                key, reader->item[0] != '\0' || key[0] != '\0' ? ": " : "", what);
}

void vd_world_fail_memory(vd_world_reader *reader) {
    if (reader->status.code == VD_OK) {
        reader->status =
            vd_failure(VD_ERROR_MEMORY, "out of memory while reading %.200s; use a smaller world",
                       reader->content->name);
    }
}

void *vd_world_keep(vd_world_reader *reader, size_t count, size_t size) {
    vd_world_content *c = reader->content;
    if (reader->status.code != VD_OK) {
        return NULL;
    }
    void **longer = c->owned;
    if ((c->owned_count & (c->owned_count + 1)) == 0) { /* room for 1, 3, 7, 15 … */
        longer = realloc(c->owned, (2 * c->owned_count + 1) * sizeof *longer);
    }
    void *made = longer != NULL ? calloc(count > 0 ? count : 1, size) : NULL;
    if (longer != NULL) {
        c->owned = longer;
    }
    if (made == NULL) {
        vd_world_fail_memory(reader);
        return NULL;
    }
    c->owned[c->owned_count++] = made;
    return made;
}

void vd_world_warn(vd_world_reader *reader, const char *format, ...) {
    vd_world_content *c = reader->content;
    char sentence[VD_MESSAGE_BYTES];
    va_list list;
    va_start(list, format);
    vsnprintf(sentence, sizeof sentence, format, list);
    va_end(list);
    if (c->warning_count == MOST_WARNINGS) {
        return;
    }
    char **longer = realloc(c->warnings, (c->warning_count + 1) * sizeof *longer);
    char *copy = strdup(sentence);
    if (longer != NULL) {
        c->warnings = longer;
    }
    if (longer == NULL || copy == NULL) {
        free(copy);
        vd_world_fail_memory(reader);
        return;
    }
    c->warnings[c->warning_count++] = copy;
}

void vd_world_check_keys(vd_world_reader *reader, const char *const *names) {
    int count = 0;
    while (names[count] != NULL) {
        count++;
    }
    const char *key;
    json_t *value;
    json_object_foreach((json_t *)reader->object, key, value) {
        bool known = false;
        for (int i = 0; i < count && !known; i++) {
            known = strcmp(names[i], key) == 0;
        }
        if (known) {
            continue;
        }
        const char *nearest = vd_nearest_name(key, names, count);
        vd_world_warn(reader, "%.140s: %s%sthere is no key \"%.60s\"%s%s%s, and it is not used",
                      reader->content->name, reader->item, reader->item[0] != '\0' ? ": " : "", key,
                      nearest != NULL ? " (did you mean \"" : "", nearest != NULL ? nearest : "",
                      nearest != NULL ? "\"?)" : "");
    }
}

const json_t *vd_world_value(const vd_world_reader *reader, const char *key) {
    return reader->status.code == VD_OK ? json_object_get(reader->object, key) : NULL;
}

const char *vd_world_text(vd_world_reader *reader, const char *key) {
    const json_t *value = vd_world_value(reader, key);
    if (value == NULL) {
        return NULL;
    }
    if (!json_is_string(value) || json_string_length(value) == 0) {
        vd_world_fail(reader, key, "it is not a text; give one, in quotes");
        return NULL;
    }
    const size_t bytes = json_string_length(value) + 1;
    char *copy = vd_world_keep(reader, bytes, 1);
    if (copy != NULL) {
        memcpy(copy, json_string_value(value), bytes);
    }
    return copy;
}

const char *vd_world_path(vd_world_reader *reader, const char *key) {
    const json_t *value = vd_world_value(reader, key);
    if (value == NULL) {
        return NULL;
    }
    if (!json_is_string(value) || json_string_length(value) == 0) {
        vd_world_fail(reader, key, "it is not the name of a file; give one, in quotes");
        return NULL;
    }
    char *joined = vd_join_path(reader->content->folder, json_string_value(value));
    char *kept = joined != NULL ? vd_world_keep(reader, strlen(joined) + 1, 1) : NULL;
    if (joined == NULL) {
        vd_world_fail_memory(reader);
    } else if (kept != NULL) {
        memcpy(kept, joined, strlen(joined) + 1);
    }
    free(joined);
    return kept;
}

bool vd_world_number(vd_world_reader *reader, const char *key, double min, double max,
                     double *out) {
    const json_t *value = vd_world_value(reader, key);
    if (value == NULL) {
        return false;
    }
    const double number = json_number_value(value);
    if (!json_is_number(value) || !(number >= min && number <= max)) {
        vd_world_fail(reader, key, "it is not a number from %g to %g; give one", min, max);
        return false;
    }
    *out = number;
    return true;
}

void vd_world_bool(vd_world_reader *reader, const char *key, bool *out) {
    const json_t *value = vd_world_value(reader, key);
    if (value != NULL && !json_is_boolean(value)) {
        vd_world_fail(reader, key, "it is neither true nor false; give one, without quotes");
    } else if (value != NULL) {
        *out = json_is_true(value);
    }
}

void vd_world_color(vd_world_reader *reader, const char *key, vd_rgba8 *out) {
    const json_t *value = vd_world_value(reader, key);
    if (value != NULL &&
        (!json_is_string(value) || !vd_read_color(json_string_value(value), out))) {
        vd_world_fail(reader, key, "it is not a colour; give \"RRGGBB\" in hexadecimal");
    }
}

void vd_world_word(vd_world_reader *reader, const char *key, const char *words, int *out) {
    const json_t *value = vd_world_value(reader, key);
    const char *typed = json_string_value(value);
    if (value == NULL) {
        return;
    }
    const char *at = words;
    for (int index = 0; typed != NULL && *at != '\0'; index++) {
        const size_t span = strcspn(at, "|");
        if (strlen(typed) == span && strncmp(at, typed, span) == 0) {
            *out = index;
            return;
        }
        at += span + (at[span] == '|');
    }
    vd_world_fail(reader, key, "\"%.40s\" is none of %s; give one of them",
                  typed != NULL ? typed : "?", words);
}

/* Reads a list of numbers; returns how many there are, −1 when it is anything else. */
static int numbers_of(const json_t *list, int least, int most, double *out) {
    const size_t size = json_array_size(list);
    if (!json_is_array(list) || size < (size_t)least || size > (size_t)most) {
        return -1;
    }
    for (size_t i = 0; i < size; i++) {
        const json_t *value = json_array_get(list, i);
        if (!json_is_number(value) || !isfinite(json_number_value(value))) {
            return -1;
        }
        out[i] = json_number_value(value);
    }
    return (int)size;
}

static void fail_numbers(vd_world_reader *reader, const char *key, size_t row, int least,
                         int most) {
    char which[40] = "it", counts[32];
    if (row > 0) {
        snprintf(which, sizeof which, "item %zu", row);
    }
    snprintf(counts, sizeof counts, least < most ? "%d to %d" : "%d", least, most);
    vd_world_fail(reader, key, "%s is not a list of %s numbers; give one", which, counts);
}

int vd_world_numbers(vd_world_reader *reader, const char *key, int least, int most, double *out) {
    const json_t *value = vd_world_value(reader, key);
    const int count = value != NULL ? numbers_of(value, least, most, out) : 0;
    if (count < 0) {
        fail_numbers(reader, key, 0, least, most);
    }
    return count < 0 ? 0 : count;
}

size_t vd_world_rows(vd_world_reader *reader, const char *key, int least, int most,
                     const double *rest, double **out) {
    const json_t *value = vd_world_value(reader, key);
    const size_t count = json_array_size(value), width = (size_t)most;
    if (value != NULL && (!json_is_array(value) || count == 0)) {
        vd_world_fail(reader, key, "it is not a list of lists of numbers; give one");
    } else if (count > VD_WORLD_MOST) {
        vd_world_fail(reader, key, "%zu are more than %zu; leave some out", count, VD_WORLD_MOST);
    }
    double *rows = value != NULL ? vd_world_keep(reader, count, width * sizeof *rows) : NULL;
    for (size_t i = 0; rows != NULL && i < count; i++) {
        double *row = rows + i * width;
        if (rest != NULL) {
            memcpy(row, rest, width * sizeof *row);
        }
        if (numbers_of(json_array_get(value, i), least, most, row) < 0) {
            fail_numbers(reader, key, i + 1, least, most);
            return 0;
        }
    }
    *out = rows;
    return rows != NULL ? count : 0;
}

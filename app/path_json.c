/* path_json.c: fields of a JSON path. */
#include "path_json.h"

#include <math.h>
#include <string.h>

#include "options.h"

void vd_path_fail(vd_path_reader *reader, vd_code code, const char *sentence) {
    if (reader->status.code == VD_OK) {
        reader->status = vd_failure(code, "%.160s: %s%s%.180s", reader->file, reader->where,
                                    reader->where[0] != '\0' ? ": " : "", sentence);
    }
}

double vd_path_number(vd_path_reader *reader, const json_t *object, const char *key,
                      double fallback, double min, double max) {
    const json_t *value = json_object_get(object, key);
    if (value == NULL) {
        return fallback;
    }
    double number = json_is_number(value) ? json_number_value(value) : (double)NAN;
    if (!(number >= min && number <= max)) {
        char sentence[160];
        snprintf(sentence, sizeof sentence, "\"%s\" is %s; give %g to %g", key,
                 json_is_number(value) ? "out of range" : "not a number", min, max);
        vd_path_fail(reader, VD_ERROR_ARGUMENT, sentence);
        return fallback;
    }
    return number;
}

int vd_path_numbers(vd_path_reader *reader, const json_t *object, const char *key, int least,
                    int most, double *out) {
    const json_t *list = json_object_get(object, key);
    if (list == NULL) {
        return 0;
    }
    const int count = json_is_array(list) ? (int)json_array_size(list) : -1;
    bool right = count >= least && count <= most;
    for (int i = 0; i < count && right; i++) {
        const json_t *item = json_array_get(list, (size_t)i);
        out[i] = json_is_number(item) ? json_number_value(item) : (double)NAN;
        right = fabs(out[i]) <= 1e15;
    }
    if (!right) {
        char sentence[160];
        snprintf(sentence, sizeof sentence, "\"%s\" is not a list of %d%s numbers; give one", key,
                 least, most > least ? " or more" : "");
        vd_path_fail(reader, VD_ERROR_ARGUMENT, sentence);
        return 0;
    }
    return count;
}

bool vd_path_truth(vd_path_reader *reader, const json_t *object, const char *key, bool fallback) {
    const json_t *value = json_object_get(object, key);
    if (value != NULL && !json_is_boolean(value)) {
        char sentence[100];
        snprintf(sentence, sizeof sentence, "\"%s\" is neither true nor false; give one", key);
        vd_path_fail(reader, VD_ERROR_ARGUMENT, sentence);
    }
    return json_is_boolean(value) ? json_is_true(value) : fallback;
}

void vd_path_check_keys(vd_path_reader *reader, json_t *object, const char *const *names,
                        int count) {
    const char *key;
    json_t *value;
    json_object_foreach(object, key, value) {
        bool known = false;
        for (int i = 0; i < count; i++) {
            known = known || strcmp(key, names[i]) == 0;
        }
        if (!known) {
            const char *nearest = vd_nearest_name(key, names, count);
            vd_log(reader->context, VD_LOG_WARNING, "%.160s: %s%s\"%.40s\" is not known%s%s%s",
                   reader->file, reader->where, reader->where[0] != '\0' ? ": " : "", key,
                   nearest != NULL ? "; did you mean \"" : " and not read",
                   nearest != NULL ? nearest : "", nearest != NULL ? "\"?" : "");
        }
    }
}

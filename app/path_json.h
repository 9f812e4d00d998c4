/* path_json.h: fields of a JSON path, each with a sentence for what is wrong with it. */
#ifndef VEDUTA_APP_PATH_JSON_H
#define VEDUTA_APP_PATH_JSON_H

#include <jansson.h>
#include <stdbool.h>
#include <veduta/context.h>

/* Where in a file something is read, and the first failure there. */
typedef struct vd_path_reader {
    vd_context *context;
    const char *file;
    char where[48]; /* "keyframe 3", "orbit", … */
    vd_status status;
} vd_path_reader;

/* Returns a number of an object, `fallback` where it is missing. What is no number, or not between
 * min and max, becomes the reader's failure. */
double vd_path_number(vd_path_reader *reader, const json_t *object, const char *key,
                      double fallback, double min, double max);

/* Reads a list of `least` to `most` numbers; returns how many, 0 where the key is missing or wrong
 * (then with a failure). */
int vd_path_numbers(vd_path_reader *reader, const json_t *object, const char *key, int least,
                    int most, double *out);

/* Returns true, false, or `fallback` where the key is missing. */
bool vd_path_truth(vd_path_reader *reader, const json_t *object, const char *key, bool fallback);

/* Logs a warning for every key that is none of `names`, with the nearest of them. */
void vd_path_check_keys(vd_path_reader *reader, json_t *object, const char *const *names,
                        int count);

/* Sets the reader's failure, unless there is one, and returns it. */
void vd_path_fail(vd_path_reader *reader, vd_code code, const char *sentence);

#endif

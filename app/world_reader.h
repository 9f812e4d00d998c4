/* world_reader.h: values out of a world file's JSON, with sentences that name file and key.
 *
 * A reader keeps the first failure; after that every call does nothing. So a list of keys is read
 * without a test behind each.
 */
#ifndef VEDUTA_APP_WORLD_READER_H
#define VEDUTA_APP_WORLD_READER_H

#include "world_content.h"

typedef struct vd_world_reader {
    vd_world_content *content; /* takes over what is read, and the warnings */
    const json_t *object;      /* what is being read */
    const char *item;          /* its name, "objects[3]"; "" for the file's own keys */
    vd_status status;
} vd_world_reader;

/* Notes a failure: "world.json: objects[3].at: WHAT". `key` may be "". */
void vd_world_fail(vd_world_reader *reader, const char *key, const char *format, ...)
    VD_PRINTF(3, 4);

/* Notes that memory is out. */
void vd_world_fail_memory(vd_world_reader *reader);

/* Keeps a warning: a sentence for the log. */
void vd_world_warn(vd_world_reader *reader, const char *format, ...) VD_PRINTF(2, 3);

/* Warns of each key that is none of `names`, a list that ends with null. */
void vd_world_check_keys(vd_world_reader *reader, const char *const *names);

/* Memory that lives as long as the content; null (and a failure) when there is none. */
void *vd_world_keep(vd_world_reader *reader, size_t count, size_t size);

/* Each gives what stands under `key`; what is not there is null, false, or leaves *out alone. */
const json_t *vd_world_value(const vd_world_reader *reader, const char *key);
const char *vd_world_text(vd_world_reader *reader, const char *key);
const char *vd_world_path(vd_world_reader *reader, const char *key); /* made relative to here */
bool vd_world_number(vd_world_reader *reader, const char *key, double min, double max, double *out);
void vd_world_bool(vd_world_reader *reader, const char *key, bool *out);
void vd_world_color(vd_world_reader *reader, const char *key, vd_rgba8 *out);

/* One of the words of "first|second"; its index goes to *out. */
void vd_world_word(vd_world_reader *reader, const char *key, const char *words, int *out);

/* A list of `least` to `most` finite numbers; returns how many, 0 when it is not there. */
int vd_world_numbers(vd_world_reader *reader, const char *key, int least, int most, double *out);

/* A list of lists of `least` to `most` numbers, of which those not given stay as in `rest`; returns
 * the count, and [count][most] numbers that live as long as the content. */
size_t vd_world_rows(vd_world_reader *reader, const char *key, int least, int most,
                     const double *rest, double **out);

#endif

/* options.h: one table of options, and everything that follows from it.
 *
 * A subcommand describes its options in a table; the parser, the range checks, the nearest-name
 * suggestion, --help, the JSON file that stands in place of flags and --save all read that table
 * and nothing else. Values are kept as text, as they were given, with the number beside it where
 * the type has one; what a text means (a size, a colour, a camera position) is the subcommand's.
 *
 * Who wins when an option is given several times: a flag over an options file over a preset over
 * the table's default; within one of these the last.
 */
#ifndef VEDUTA_APP_OPTIONS_H
#define VEDUTA_APP_OPTIONS_H

#include <stdbool.h>
#include <stdio.h>
#include <veduta/status.h>

typedef enum vd_option_type {
    VD_OPTION_SWITCH = 0, /* no value on the command line; true or false in JSON */
    VD_OPTION_FLAG,       /* on or off; without a value: on; `argument` may list further words */
    VD_OPTION_INTEGER,    /* min … max */
    VD_OPTION_REAL,       /* min … max */
    VD_OPTION_DISTANCE,   /* metres, min … max; the endings m, km and ft are understood */
    VD_OPTION_CHOICE,     /* one of the words in `argument`, separated by | */
    VD_OPTION_TEXT,       /* checked by the subcommand */
    VD_OPTION_FILE,       /* a path; in an options file relative to that file */
    VD_OPTION_TYPE_COUNT
} vd_option_type;

typedef struct vd_option {
    const char *key;   /* the long name, without dashes */
    const char *group; /* heading in --help */
    vd_option_type type;
    char letter;     /* the short form, or 0 */
    bool transient;  /* about this run, not about the picture: not allowed in files, not saved */
    double min, max; /* INTEGER, REAL and DISTANCE; both 0: any finite number */
    const char *fallback; /* the default as text; null: none */
    const char *argument; /* how --help writes the value, such as "AZ,ALT"; null: none */
    const char *unit;     /* of the value, such as "degrees"; null: none */
    const char *help;
    bool (*is_name)(const char *text); /* FILE that may also be a name: true when it is one */
} vd_option;

typedef enum vd_option_source {
    VD_SOURCE_DEFAULT = 0,
    VD_SOURCE_PRESET,
    VD_SOURCE_FILE,
    VD_SOURCE_FLAG
} vd_option_source;

typedef struct vd_option_value {
    vd_option_source source;
    char *text;    /* owned; null when there is neither a value nor a default */
    double number; /* INTEGER, REAL, DISTANCE in metres; SWITCH and FLAG: 0 or 1, a FLAG's
                      further words 2, 3 …; CHOICE: index */
} vd_option_value;

typedef struct vd_options {
    const char *command; /* "render", for error sentences */
    const vd_option *table;
    int count;
    vd_option_value *values; /* [count] */
    char **inputs;           /* what is not an option: files */
    int input_count;
    vd_option_source input_source;
    bool world;     /* a world file was read: there may be something to draw without inputs */
    char note[320]; /* what reading a file found remarkable, one sentence; else empty */
} vd_options;

/* Fills the values with the table's defaults. Returns VD_ERROR_MEMORY. */
VD_MUST_USE vd_status vd_options_init(vd_options *options, const char *command,
                                      const vd_option *table, int count);
void vd_options_finish(vd_options *options);

/* Reads the arguments behind argv[0]. An option that is unknown, lacks its value or has a bad one
 * gives VD_ERROR_ARGUMENT, which is bad use; also returns VD_ERROR_MEMORY. */
VD_MUST_USE vd_status vd_options_parse(vd_options *options, int argc, char **argv);

/* Sets one option from text, unless it already has a value from a stronger source. */
VD_MUST_USE vd_status vd_options_set(vd_options *options, int index, const char *text,
                                     vd_option_source source);

/* Sets an option back to its default when its value is from an options file. */
VD_MUST_USE vd_status vd_options_drop_file_value(vd_options *options, int index);

VD_MUST_USE vd_status vd_options_add_input(vd_options *options, const char *path,
                                           vd_option_source source);

/* Returns the index of a long name, −1 when there is none. */
int vd_options_find(const vd_options *options, const char *key);

/* True when the option was given by a flag or a file. */
bool vd_options_given(const vd_options *options, int index);

/* Reads options and inputs from a JSON object: the same keys as the flags, without dashes. Values
 * are strings, numbers, true and false, lists of numbers or words ("sun": [315, 45]) and, for
 * KEY=VALUE texts, objects. The key "veduta" must be there: the version that wrote it; a newer
 * one than this is noted. `name` is
 * what error sentences call it, `folder` what relative paths start from ("" for none).
 * Returns VD_ERROR_FORMAT (not JSON), VD_ERROR_ARGUMENT (a key or value that a flag could not be
 * either) or VD_ERROR_MEMORY. */
VD_MUST_USE vd_status vd_options_read_json(vd_options *options, const char *text, size_t size_bytes,
                                           const char *name, const char *folder);

/* The same from a file; "-" is standard input. Also returns VD_ERROR_IO and VD_ERROR_LIMIT. */
VD_MUST_USE vd_status vd_options_load_json(vd_options *options, const char *path);

/* Writes what was given, in the table's order, so that the file alone gives the same picture. */
VD_MUST_USE vd_status vd_options_save_json(const vd_options *options, const char *path);

/* Prints the table, by groups in order of appearance. */
void vd_options_print_help(const vd_option *table, int count, FILE *out);

/* Returns the nearest of `count` names to a mistyped one, null when none is near. */
const char *vd_nearest_name(const char *typed, const char *const *names, int count);

/* Reads a finite number that makes up all of the text; false otherwise. */
bool vd_read_number(const char *text, double *out);

/* Writes a number with the fewest digits, at least 15, that read back as the same number. */
void vd_write_number(double number, char out[32]);

/* Reads a distance in metres: a number with the ending m, km, ft or none. */
bool vd_read_distance(const char *text, double *out);

/* Reads up to `most` finite numbers separated by commas, all of the text; returns how many, −1 when
 * the text is anything else. */
int vd_read_numbers(const char *text, double *out, int most);

/* Reads an option's time, seconds or with the ending ms or s, or number of bytes, with the endings
 * k, M and G (thousands). Returns VD_ERROR_ARGUMENT naming the option. */
VD_MUST_USE vd_status vd_option_seconds(const vd_options *options, int index, double least,
                                        double most, double *out);
VD_MUST_USE vd_status vd_option_bytes(const vd_options *options, int index, double least,
                                      double most, double *out);

/* Writes a text to a file, beside and renamed, or to standard output for "-". */
VD_MUST_USE vd_status vd_write_text(const char *path, const char *text);

#endif

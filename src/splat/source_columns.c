/* source_columns.c: particles in columns of text, and raw numbers.
 *
 * The separator is what the first line of data shows: comma, semicolon, tab, else blanks. Names
 * come from the caller, from a first line that is not numbers, or from a comment before the data
 * with as many words as there are columns; without any the columns are x, y, z and the rest are
 * passed over as column4, column5 … A column whose first value is no number is passed over. */
#include <math.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>
#include "core/core.h"
#include "core/real.h"
#include "core/text.h"
#include "splat/source_input.h"

#define LINE_MOST ((size_t)64 << 10)
#define MAX_COLUMNS 256

/* What a column is beside x, y, z and attributes: places in `numbers` below. */
enum { PLACE_X = 0, PLACE_Y, PLACE_Z, PLACE_RA, PLACE_DEC, PLACE_DISTANCE, PLACE_PARALLAX };
enum { PLACE_COUNT = 7 };

typedef struct columns {
    vd_context *context;
    vd_input input;
    char separator; /* ' ': any blanks */
    int column_count;
    int target[MAX_COLUMNS]; /* < PLACE_COUNT: a place; else an attribute; −1: passed over */
    double ra_scale;         /* to degrees */
    bool spherical;
    uint64_t begin;
    int first_line;
    int line; /* 1-based, of the next row */
} columns;

static bool is_comment(const char *at, const char *end) {
    return at < end && (*at == '#' || (end - at > 1 && at[0] == '/' && at[1] == '/'));
}

/* The end of the line that begins at `at`, without its break. */
static const char *line_end(const char *at, const char *end) {
    const char *stop = memchr(at, '\n', (size_t)(end - at));
    stop = stop != NULL ? stop : end;
    return stop > at && stop[-1] == '\r' ? stop - 1 : stop;
}

/* Cuts the next field off a line: [*from, *to) without blanks and quotes. False at the line's end.
 */
static bool next_field(char separator, const char **at, const char *end, const char **from,
                       const char **to) {
    const char *p = *at;
    while (p < end && (*p == ' ' || (separator != '\t' && *p == '\t'))) {
        p++;
    }
    if (p >= end && (separator == ' ' || *at > end)) {
        return false;
    }
    const char *stop;
    if (p < end && *p == '"') {
        const char *quote = memchr(p + 1, '"', (size_t)(end - p - 1));
        stop = quote != NULL ? quote : end;
        *from = p + 1;
        *to = stop;
        p = stop < end ? stop + 1 : end;
        while (p < end && *p != separator && !(separator == ' ' && *p == '\t')) {
            p++;
        }
    } else {
        *from = p;
        while (p < end && *p != separator && !(separator == ' ' && *p == '\t')) {
            p++;
        }
        stop = p;
        while (stop > *from && (stop[-1] == ' ' || stop[-1] == '\t')) {
            stop--;
        }
        *to = stop;
    }
    *at = p + 1; /* behind the end after the last field */
    return true;
}

/* NaN for an empty field and for what is no number. */
static double field_number(const char *from, const char *to) {
    vd_text text = vd_text_make(from, (size_t)(to - from));
    double value;
    if (!vd_text_number(&text, &value)) {
        return (double)NAN;
    }
    return text.at == to ? value : (double)NAN;
}

static bool field_is_number(const char *from, const char *to) {
    vd_text text = vd_text_make(from, (size_t)(to - from));
    double value;
    return from == to || (vd_text_number(&text, &value) && text.at == to);
}

static vd_status bad_line(const columns *c, const char *what) {
    return vd_failure(VD_ERROR_FORMAT, "cannot read %.160s: line %d %.140s; check the file",
                      c->input.name, c->line, what);
}

static void place(const columns *c, const double *numbers, vd_particle_batch *batch, size_t i) {
    if (!c->spherical) {
        batch->x[i] = numbers[PLACE_X];
        batch->y[i] = numbers[PLACE_Y];
        batch->z[i] = numbers[PLACE_Z];
        return;
    }
    const double ra = vd_radians(c->ra_scale * numbers[PLACE_RA]);
    const double dec = vd_radians(numbers[PLACE_DEC]);
    double distance = numbers[PLACE_DISTANCE];
    if (numbers[PLACE_PARALLAX] != 0.0) {
        /* Milliarcseconds; one that is not positive says nothing about where the star is. */
        const double p = numbers[PLACE_PARALLAX];
        distance = p > 0.0 ? 1000.0 / p : (double)NAN;
    }
    batch->x[i] = distance * vd_cos(dec) * vd_cos(ra);
    batch->y[i] = distance * vd_cos(dec) * vd_sin(ra);
    batch->z[i] = distance * vd_sin(dec);
}

static vd_status read_row(columns *c, const char *at, const char *end, vd_particle_batch *batch) {
    double numbers[PLACE_COUNT] = {[PLACE_DISTANCE] = 1.0};
    const size_t i = batch->count;
    int column = 0;
    const char *from, *to;
    while (next_field(c->separator, &at, end, &from, &to)) {
        const int target = column < c->column_count ? c->target[column] : -1;
        column++;
        if (target < 0) {
            continue;
        }
        const double value = field_number(from, to);
        if (target < PLACE_COUNT) {
            numbers[target] = value;
        } else {
            batch->values[target - PLACE_COUNT][i] = (float)value;
        }
    }
    if (column != c->column_count) {
        char what[80];
        snprintf(what, sizeof what, "has %d columns where the first has %d", column,
                 c->column_count);
        return bad_line(c, what);
    }
    place(c, numbers, batch, i);
    batch->count++;
    return vd_success();
}

static vd_status columns_read(void *user, vd_particle_batch *batch) {
    columns *c = user;
    while (batch->count < batch->capacity) {
        vd_status status = vd_input_fill(&c->input, LINE_MOST);
        if (status.code != VD_OK) {
            return status;
        }
        const char *at = (const char *)c->input.at, *end = (const char *)c->input.end;
        if (at >= end) {
            return vd_success();
        }
        const char *stop = line_end(at, end);
        if (stop == end && c->input.next < c->input.size_bytes) {
            return bad_line(c, "is longer than 64 KiB");
        }
        const char *first = at;
        while (first < stop && (*first == ' ' || *first == '\t')) {
            first++;
        }
        if (first < stop && !is_comment(first, stop)) {
            status = read_row(c, at, stop, batch);
            if (status.code != VD_OK) {
                return status;
            }
        }
        const char *next = memchr(stop, '\n', (size_t)(end - stop));
        c->input.at = (const uint8_t *)(next != NULL ? next + 1 : end);
        c->line++;
    }
    return vd_success();
}

static vd_status columns_rewind(void *user) {
    columns *c = user;
    vd_input_seek(&c->input, c->begin);
    c->line = c->first_line;
    return vd_success();
}

static double columns_progress(void *user) {
    const columns *c = user;
    return c->input.size_bytes == 0
               ? 1.0
               : (double)vd_input_tell(&c->input) / (double)c->input.size_bytes;
}

static void columns_close(void *user) {
    columns *c = user;
    vd_input_close(&c->input);
    vd_release(c->context, c);
}

static const vd_particle_reader reader = {columns_read, columns_rewind, columns_progress,
                                          columns_close};

/* ---- the head -----------------------------------------------------------------------------------
 */

typedef char name_list[MAX_COLUMNS][VD_ATTRIBUTE_NAME_BYTES];

static int split_names(char separator, const char *at, const char *end, name_list names) {
    int count = 0;
    const char *from, *to;
    while (count < MAX_COLUMNS && next_field(separator, &at, end, &from, &to)) {
        snprintf(names[count++], VD_ATTRIBUTE_NAME_BYTES, "%.*s",
                 to - from < VD_ATTRIBUTE_NAME_BYTES ? (int)(to - from)
                                                     : VD_ATTRIBUTE_NAME_BYTES - 1,
                 from);
    }
    return count;
}

static char find_separator(const char *at, const char *end) {
    const char *const order = ",;\t";
    for (int i = 0; i < 3; i++) {
        if (memchr(at, order[i], (size_t)(end - at)) != NULL) {
            return order[i];
        }
    }
    return ' ';
}

static int find_place(const char *name) {
    static const struct {
        const char *name;
        int place;
    } known[] = {
        {"x", PLACE_X},
        {"y", PLACE_Y},
        {"z", PLACE_Z},
        {"pos_x", PLACE_X},
        {"pos_y", PLACE_Y},
        {"pos_z", PLACE_Z},
        {"east", PLACE_X},
        {"north", PLACE_Y},
        {"up", PLACE_Z},
        {"easting", PLACE_X},
        {"northing", PLACE_Y},
        {"elevation", PLACE_Z},
        {"ra", PLACE_RA},
        {"ra_hours", PLACE_RA},
        {"dec", PLACE_DEC},
        {"dist", PLACE_DISTANCE},
        {"distance", PLACE_DISTANCE},
        {"parallax", PLACE_PARALLAX},
        {"plx", PLACE_PARALLAX},
    };
    for (size_t i = 0; i < sizeof known / sizeof known[0]; i++) {
        if (strcasecmp(name, known[i].name) == 0) {
            return known[i].place;
        }
    }
    return -1;
}

/* Gives each named column its target; `values` is the first line of data. */
static vd_status place_columns(columns *c, name_list names, const char *at, const char *end,
                               vd_particle_source *source) {
    unsigned placed = 0;
    const char *from, *to;
    for (int i = 0; i < c->column_count && next_field(c->separator, &at, end, &from, &to); i++) {
        const int spot = find_place(names[i]);
        c->target[i] = -1;
        if (spot >= 0 && (placed >> spot & 1) == 0) {
            c->target[i] = spot;
            placed |= 1u << spot;
            c->ra_scale =
                spot == PLACE_RA && strcasecmp(names[i], "ra_hours") == 0 ? 15.0 : c->ra_scale;
        } else if (spot < 0 && names[i][0] != '\0' && strcmp(names[i], "-") != 0 &&
                   field_is_number(from, to)) {
            vd_attribute_kind kind;
            const char *usual = vd_attribute_usual_name(names[i], &kind);
            const int index = vd_particle_source_add(source, usual, kind);
            c->target[i] = index < 0 ? -1 : PLACE_COUNT + index;
        }
    }
    c->spherical = (placed & 7) != 7;
    if (c->spherical && (placed >> PLACE_RA & 3) != 3) {
        return vd_failure(VD_ERROR_FORMAT,
                          "cannot read %.160s: its columns do not tell x, y and z (or ra and dec); "
                          "name them in order with --columns x,y,z,…",
                          c->input.name);
    }
    for (int i = 0; i < c->column_count && !c->spherical; i++) {
        /* A distance beside x, y, z is an attribute like any other. */
        if (c->target[i] > PLACE_Z && c->target[i] < PLACE_COUNT) {
            const int index = vd_particle_source_add(source, names[i], VD_ATTRIBUTE_SCALAR);
            c->target[i] = index < 0 ? -1 : PLACE_COUNT + index;
        }
    }
    return vd_success();
}

/* Where the head's parts are. */
typedef struct head {
    const char *comment, *comment_end; /* the last comment before the data, null: none */
    const char *title, *title_end;     /* a line of names */
    const char *data, *data_end;       /* the first line of data, null: none */
    int data_line;
} head;

static bool is_title(const char *at, const char *end) {
    const char separator = find_separator(at, end);
    const char *from, *to;
    bool words = false;
    while (next_field(separator, &at, end, &from, &to)) {
        words |= !field_is_number(from, to);
    }
    return words;
}

static int count_fields(const char *at, const char *end) {
    const char separator = find_separator(at, end);
    const char *from, *to;
    int count = 0;
    while (next_field(separator, &at, end, &from, &to)) {
        count++;
    }
    return count;
}

static head read_head(const char *text, size_t bytes) {
    head h = {0};
    const char *at = text, *end = text + bytes;
    for (int line = 1; at < end && h.data == NULL; line++) {
        const char *stop = line_end(at, end), *first = at;
        while (first < stop && (*first == ' ' || *first == '\t')) {
            first++;
        }
        if (is_comment(first, stop)) {
            h.comment = first + (*first == '#' ? 1 : 2);
            h.comment_end = stop;
        } else if (first < stop && h.title == NULL && is_title(first, stop)) {
            h.title = first;
            h.title_end = stop;
        } else if (first < stop && (count_fields(first, stop) > 1 || h.title != NULL)) {
            h.data = at; /* a line of one number is the count of a .pts file */
            h.data_end = stop;
            h.data_line = line;
        }
        const char *next = memchr(stop, '\n', (size_t)(end - stop));
        at = next != NULL ? next + 1 : end;
    }
    return h;
}

static vd_status name_columns(columns *c, const head *h, const vd_particle_source_def *def,
                              vd_particle_source *source) {
    char(*names)[VD_ATTRIBUTE_NAME_BYTES] = vd_allocate_zero(c->context, 1, sizeof(name_list));
    if (names == NULL) {
        return vd_out_of_memory(source->path, sizeof(name_list));
    }
    const char *line = h->data != NULL ? h->data : h->title;
    const char *end = h->data != NULL ? h->data_end : h->title_end;
    vd_status status = vd_success();
    c->separator = find_separator(line, end);
    c->column_count = count_fields(line, end);
    int named = 0;
    if (def->columns != NULL) {
        named = split_names(',', def->columns, def->columns + strlen(def->columns), names);
    } else if (h->title != NULL) {
        named = split_names(find_separator(h->title, h->title_end), h->title, h->title_end, names);
    } else if (h->comment != NULL) {
        named = split_names(find_separator(h->comment, h->comment_end), h->comment, h->comment_end,
                            names);
        named = named == c->column_count ? named : 0;
    }
    if (named == 0) {
        for (; named < c->column_count && named < MAX_COLUMNS; named++) {
            if (named < 3) {
                snprintf(names[named], sizeof names[named], "%c", "xyz"[named]);
            } else {
                snprintf(names[named], sizeof names[named], "column%d", named + 1);
            }
        }
    }
    if (c->column_count > MAX_COLUMNS || named != c->column_count) {
        status = vd_failure(def->columns != NULL ? VD_ERROR_ARGUMENT : VD_ERROR_FORMAT,
                            "cannot read %.160s: it has %d columns (256 at most) and %d names; "
                            "name each with --columns, - for those to pass over",
                            source->path, c->column_count, named);
    } else {
        status = place_columns(c, names, line, end, source);
    }
    vd_release(c->context, names);
    return status;
}

static const char *separator_name(char separator) {
    return separator == ','    ? "commas"
           : separator == ';'  ? "semicolons"
           : separator == '\t' ? "tabs"
                               : "blanks";
}

static vd_status begin_columns(columns *c, const vd_particle_source_def *def,
                               vd_particle_source *source) {
    vd_status status = vd_input_fill(&c->input, LINE_MOST);
    if (status.code != VD_OK) {
        return status;
    }
    const char *text = (const char *)c->input.at;
    const size_t bytes = (size_t)(c->input.end - c->input.at);
    const size_t looked_at = bytes < LINE_MOST ? bytes : LINE_MOST;
    if (memchr(text, '\0', looked_at) != NULL) {
        return vd_failure(VD_ERROR_UNSUPPORTED,
                          "cannot read %.200s: it is neither LAS, PLY, HDF5 nor text; convert it, "
                          "or say what numbers it is made of with --raw",
                          source->path);
    }
    const head h = read_head(text, looked_at);
    if (h.data == NULL && h.title == NULL) {
        return vd_failure(VD_ERROR_FORMAT,
                          "cannot read %.200s: there are no rows of numbers in its first 64 KiB; "
                          "check the file",
                          source->path);
    }
    status = name_columns(c, &h, def, source);
    c->begin = h.data != NULL ? (uint64_t)(h.data - text) : c->input.size_bytes;
    c->first_line = h.data_line;
    snprintf(source->format, sizeof source->format, "text, %d columns separated by %s",
             c->column_count, separator_name(c->separator));
    return status.code == VD_OK ? columns_rewind(c) : status;
}

vd_status vd_columns_open(vd_context *context, const char *path, vd_input input,
                          const vd_particle_source_def *def, vd_particle_source **out) {
    columns *c = vd_allocate_zero(context, 1, sizeof *c);
    if (c == NULL) {
        vd_input_close(&input);
        return vd_out_of_memory(path, sizeof *c);
    }
    c->context = context;
    c->input = input;
    c->ra_scale = 1.0;
    vd_particle_source *source;
    vd_status status = vd_particle_source_create(context, path, &reader, c, &source);
    if (status.code != VD_OK) {
        return status;
    }
    c->input.name = source->path;
    status = begin_columns(c, def, source);
    if (status.code != VD_OK) {
        vd_particle_source_destroy(&source);
        return status;
    }
    *out = source;
    return vd_success();
}

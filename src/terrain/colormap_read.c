/* colormap_read.c: colour maps from files.
 *
 * GMT .cpt: lines "z0 colour z1 colour", the colours at both ends of a slice, and B, F and N for
 * below, above and missing. "# COLOR_MODEL" says how three bare numbers are meant; "# RANGE" and
 * "# HINGE" what a map normalised to 0 … 1 (−1 … 1) is stretched to. (GMT 6 docs, "Color palette
 * tables".)
 *
 * gdaldem color-relief: lines "value r g b [a]" or "value name", in any order, separated by blanks,
 * commas or colons; values may be percentages of the data's range, nv is the missing value.
 * (GDAL docs, gdaldem; QGIS writes the same with one line more.)
 */
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include "core/file.h"
#include "core/text.h"
#include "terrain/colormap_internal.h"

#define MAX_FIELDS 12

/* A map of 1,024 stops has some 60 KB of text; anything far beyond is another kind of file. */
static const size_t limit_bytes = (size_t)16 << 20;

/* Pieces that a slice between two hues is cut into: hue is not linear in red, green, blue. */
static const int hue_pieces = 12;

typedef struct map_reader {
    const char *name;
    int line; /* 1-based, of the line in hand */
    int count;
    vd_colormap *map;
    bool absolute, percent; /* gdaldem: kinds of values seen */
    bool hsv, hue_path;     /* GMT: bare numbers are HSV; interpolate along the hue */
    bool has_range, hinged;
    double range[2], hinge;
    bool has_below, has_above;
    vd_rgba8 below, above;
} map_reader;

static vd_status fault(const map_reader *reader, const char *format, ...) VD_PRINTF(2, 3);

static vd_status fault(const map_reader *reader, const char *format, ...) {
    char what[200];
    va_list arguments;
    va_start(arguments, format);
    (void)vsnprintf(what, sizeof what, format, arguments);
    va_end(arguments);
    return vd_failure(VD_ERROR_FORMAT, "cannot read %s: line %d %s", reader->name, reader->line,
                      what);
}

static bool is_one_of(char c, const char *set) {
    return c != '\0' && strchr(set, c) != NULL;
}

/* Cuts a line into fields; returns how many, at most MAX_FIELDS. */
static int split_line(vd_field line, const char *separators, vd_field fields[MAX_FIELDS]) {
    int count = 0;
    size_t i = 0;
    while (count < MAX_FIELDS) {
        while (i < line.length && is_one_of(line.at[i], separators)) {
            i++;
        }
        size_t begin = i;
        while (i < line.length && !is_one_of(line.at[i], separators)) {
            i++;
        }
        if (i == begin) {
            break;
        }
        fields[count++] = (vd_field){line.at + begin, i - begin};
    }
    return count;
}

/* Takes the next line, without its break and leading blanks. */
static bool next_line(vd_text *text, vd_field *line) {
    if (vd_text_done(text)) {
        return false;
    }
    vd_text_skip_blanks(text);
    line->at = text->at;
    vd_text_next_line(text);
    const char *end = text->at;
    while (end > line->at && (end[-1] == '\n' || end[-1] == '\r')) {
        end--;
    }
    line->length = (size_t)(end - line->at);
    return true;
}

static bool has_text(vd_field line, const char *what) {
    size_t n = strlen(what);
    for (size_t i = 0; i + n <= line.length; i++) {
        if (memcmp(line.at + i, what, n) == 0) {
            return true;
        }
    }
    return false;
}

static bool is_letter(vd_field field, const char *letters) {
    return field.length == 1 && is_one_of(field.at[0], letters);
}

static vd_status add_stop(map_reader *reader, double value, vd_rgba8 color) {
    vd_colormap_stop *stops = reader->map->stops;
    if (!isfinite(value)) {
        return fault(reader, "has a value that is not finite; correct the line");
    }
    if (reader->count > 0 && stops[reader->count - 1].value == value &&
        memcmp(&stops[reader->count - 1].color, &color, sizeof color) == 0) {
        return vd_success();
    }
    if (reader->count == VD_COLORMAP_MAX_STOPS) {
        return vd_failure(VD_ERROR_LIMIT,
                          "cannot read %s: it has more than %d stops, on line %d; use fewer",
                          reader->name, VD_COLORMAP_MAX_STOPS, reader->line);
    }
    stops[reader->count++] = (vd_colormap_stop){value, color};
    return vd_success();
}

/* ---- GMT ------------------------------------------------------------------------------------- */

/* Reads the number after '=', '/' or blanks behind `key` in a comment. */
static bool comment_numbers(vd_field line, const char *key, double *values, int count) {
    size_t n = strlen(key), i = 0;
    while (i + n <= line.length && memcmp(line.at + i, key, n) != 0) {
        i++;
    }
    if (i + n > line.length) {
        return false;
    }
    vd_text text = vd_text_make(line.at + i + n, line.length - i - n);
    for (int k = 0; k < count; k++) {
        while (!vd_text_done(&text) && is_one_of(*text.at, " \t=/")) {
            text.at++;
        }
        if (!vd_text_number(&text, &values[k]) || !isfinite(values[k])) {
            return false;
        }
    }
    return true;
}

static void read_gmt_comment(map_reader *reader, vd_field line) {
    double range[2];
    if (has_text(line, "COLOR_MODEL")) {
        reader->hue_path = has_text(line, "+HSV") || has_text(line, "hsv");
        reader->hsv = reader->hue_path || has_text(line, "HSV");
    } else if (comment_numbers(line, "RANGE", range, 2) && range[0] < range[1]) {
        reader->has_range = true;
        reader->range[0] = range[0];
        reader->range[1] = range[1];
    } else if (has_text(line, "HINGE")) {
        reader->hinged = true;
        (void)comment_numbers(line, "HINGE", &reader->hinge, 1);
    }
}

static vd_status add_slice(map_reader *reader, double z0, const vd_file_color *c0, double z1,
                           const vd_file_color *c1) {
    vd_status status = add_stop(reader, z0, c0->rgba);
    bool along_hue = reader->hue_path && c0->is_hsv && c1->is_hsv;
    for (int i = 1; along_hue && i < hue_pieces && status.code == VD_OK; i++) {
        double t = (double)i / hue_pieces, hsv[3];
        for (int k = 0; k < 3; k++) {
            hsv[k] = c0->hsv[k] + t * (c1->hsv[k] - c0->hsv[k]);
        }
        status = add_stop(reader, z0 + t * (z1 - z0), vd_color_from_hsv(hsv[0], hsv[1], hsv[2]));
    }
    return status.code == VD_OK ? add_stop(reader, z1, c1->rgba) : status;
}

static bool gmt_color(const map_reader *reader, const vd_field *fields, int count,
                      vd_file_color *out) {
    return count == 3 ? vd_fields_color(fields, reader->hsv, out)
                      : count == 1 && vd_field_color(fields[0], VD_COLORMAP_GMT, out);
}

static vd_status read_gmt_special(map_reader *reader, const vd_field *fields, int count) {
    vd_file_color color;
    if (!gmt_color(reader, fields + 1, count - 1, &color)) {
        return fault(reader, "needs one colour after %c; correct the line", fields[0].at[0]);
    }
    if (fields[0].at[0] == 'B') {
        reader->below = color.rgba;
        reader->has_below = true;
    } else if (fields[0].at[0] == 'F') {
        reader->above = color.rgba;
        reader->has_above = true;
    }
    return vd_success(); /* N: missing heights are holes and have no colour */
}

static vd_status read_gmt_line(map_reader *reader, vd_field line) {
    vd_field fields[MAX_FIELDS];
    const char *label = memchr(line.at, ';', line.length);
    line.length = label ? (size_t)(label - line.at) : line.length;
    int count = split_line(line, " \t\r\f\v", fields);
    if (count > 1 && is_letter(fields[0], "BFN")) {
        return read_gmt_special(reader, fields, count);
    }
    if (count > 4 && is_letter(fields[count - 1], "LUB")) {
        count--; /* which ends of the slice to annotate */
    }
    if (count != 4 && count != 8) {
        return fault(reader, "has %d fields, a slice is \"z0 colour z1 colour\"; correct the line",
                     count);
    }
    double z0, z1;
    vd_file_color c0, c1;
    int half = count / 2;
    if (!vd_field_number(fields[0], &z0) || !vd_field_number(fields[half], &z1)) {
        return fault(reader, "needs numbers for z0 and z1; correct the line");
    }
    if (!gmt_color(reader, fields + 1, half - 1, &c0) ||
        !gmt_color(reader, fields + half + 1, half - 1, &c1)) {
        return fault(reader, "has a colour that is neither a name, r/g/b, #RRGGBB nor h-s-v; "
                             "correct the line");
    }
    double last = reader->count > 0 ? reader->map->stops[reader->count - 1].value : z0;
    if (!(z0 < z1) || !(last <= z0)) {
        return fault(reader,
                     "has z0 = %g and z1 = %g after %g, slices must ascend; correct the line", z0,
                     z1, last);
    }
    return add_slice(reader, z0, &c0, z1, &c1);
}

/* Normalised maps are stretched to their range, each side of the hinge by itself; without a range
 * they are relative to the data's. */
static void place_gmt_values(map_reader *reader) {
    vd_colormap_stop *stops = reader->map->stops;
    double first = stops[0].value, last = stops[reader->count - 1].value;
    bool both_sides = first == -1.0 && last == 1.0;
    if (!both_sides && !(first == 0.0 && last == 1.0)) {
        return;
    }
    const double *range = reader->range;
    bool hinged =
        reader->hinged && both_sides && range[0] < reader->hinge && reader->hinge < range[1];
    for (int i = 0; i < reader->count; i++) {
        double v = both_sides ? 0.5 * (stops[i].value + 1.0) : stops[i].value;
        if (reader->has_range && hinged) {
            double z = stops[i].value;
            v = z < 0.0 ? reader->hinge + z * (reader->hinge - range[0])
                        : reader->hinge + z * (range[1] - reader->hinge);
        } else if (reader->has_range) {
            v = range[0] + v * (range[1] - range[0]);
        }
        stops[i].value = v;
    }
    reader->map->relative = !reader->has_range;
}

/* Colours for what lies beyond the ends: a step right behind each end. */
static vd_status add_ends(map_reader *reader) {
    vd_colormap_stop *stops = reader->map->stops;
    int extra = (reader->has_below ? 1 : 0) + (reader->has_above ? 1 : 0);
    if (reader->map->relative || extra == 0) {
        return vd_success();
    }
    if (reader->count + extra > VD_COLORMAP_MAX_STOPS) {
        return vd_failure(VD_ERROR_LIMIT, "cannot read %s: it has more than %d stops; use fewer",
                          reader->name, VD_COLORMAP_MAX_STOPS);
    }
    if (reader->has_below) {
        memmove(stops + 1, stops, (size_t)reader->count * sizeof *stops);
        stops[0] = (vd_colormap_stop){nextafter(stops[1].value, -INFINITY), reader->below};
        reader->count++;
    }
    if (reader->has_above) {
        double beyond = nextafter(stops[reader->count - 1].value, INFINITY);
        stops[reader->count++] = (vd_colormap_stop){beyond, reader->above};
    }
    return vd_success();
}

/* ---- gdaldem --------------------------------------------------------------------------------- */

static vd_status read_gdaldem_line(map_reader *reader, vd_field line) {
    vd_field fields[MAX_FIELDS];
    int count = split_line(line, " \t\r\f\v,:", fields);
    if (count == 0) {
        return vd_success();
    }
    if (has_text(fields[0], "INTERPOLATION")) { /* QGIS' second line */
        return count > 1 && has_text(fields[1], "INTERPOLATED")
                   ? vd_success()
                   : fault(reader, "asks for colours without interpolation; export the map with "
                                   "linear interpolation");
    }
    bool missing =
        fields[0].length == 2 && (fields[0].at[0] | 0x20) == 'n' && (fields[0].at[1] | 0x20) == 'v';
    vd_field number = fields[0];
    bool percent = number.length > 1 && number.at[number.length - 1] == '%';
    number.length -= percent;
    double value = 0.0, alpha = 255.0;
    if (!missing && !vd_field_number(number, &value)) {
        return fault(reader, "must begin with a value, a percentage or nv; correct the line");
    }
    vd_file_color color;
    bool good = count >= 4 && vd_fields_color(fields + 1, false, &color);
    if (good && count > 4) {
        good = vd_field_number(fields[4], &alpha) && alpha >= 0.0 && alpha <= 255.0;
        color.rgba.a = good ? (uint8_t)floor(alpha + 0.5) : 255;
    } else if (!good) {
        double grey;
        good = count >= 2 && !vd_field_number(fields[1], &grey) &&
               vd_field_color(fields[1], VD_COLORMAP_GDALDEM, &color);
    }
    if (!good) {
        return fault(reader, "needs red, green and blue of 0 … 255, or a colour's name, after the "
                             "value; correct the line");
    }
    if (missing) {
        return vd_success();
    }
    reader->percent |= percent;
    reader->absolute |= !percent;
    if (reader->percent && reader->absolute) {
        return fault(reader, "mixes percentages with values; use one of them");
    }
    return add_stop(reader, percent ? value / 100.0 : value, color.rgba);
}

/* Stable, so that two stops of one value keep their order: a step. */
static void sort_stops(vd_colormap_stop *stops, int count) {
    for (int i = 1; i < count; i++) {
        vd_colormap_stop stop = stops[i];
        int k = i;
        for (; k > 0 && stops[k - 1].value > stop.value; k--) {
            stops[k] = stops[k - 1];
        }
        stops[k] = stop;
    }
}

/* ---- both ------------------------------------------------------------------------------------ */

/* Tells a .cpt from a gdaldem text: by its COLOR_MODEL, its B, F, N lines or its slices. */
static bool is_gmt(vd_text text, const char *name) {
    size_t length = strlen(name);
    if (length >= 4 &&
        (memcmp(name + length - 4, ".cpt", 4) == 0 || memcmp(name + length - 4, ".CPT", 4) == 0)) {
        return true;
    }
    vd_field line, fields[MAX_FIELDS];
    while (next_line(&text, &line)) {
        if (line.length > 0 && line.at[0] == '#') {
            if (has_text(line, "COLOR_MODEL")) {
                return true;
            }
            continue;
        }
        int count = split_line(line, " \t\r\f\v", fields);
        double number;
        bool slashes = count > 1 && has_text(fields[1], "/");
        bool slice = count >= 4 && !vd_field_number(fields[1], &number) &&
                     vd_field_number(fields[2], &number);
        bool columns = count >= 8 && vd_field_number(fields[7], &number);
        if (slashes || slice || columns || (count > 1 && is_letter(fields[0], "BFN"))) {
            return true;
        }
    }
    return false;
}

vd_status vd_colormap_decode(const char *text, size_t size_bytes, const char *name,
                             vd_colormap *out) {
    if ((!text && size_bytes > 0) || !name || !out) {
        return vd_failure(VD_ERROR_ARGUMENT, "vd_colormap_decode: no argument may be null");
    }
    vd_colormap map;
    memset(&map, 0, sizeof map);
    map_reader reader = {.name = name, .line = 1, .map = &map};
    vd_text rest = vd_text_make(size_bytes > 0 ? text : "", size_bytes);
    bool gmt = is_gmt(rest, name);
    vd_status status = vd_success();
    vd_field line;
    while (status.code == VD_OK && (reader.line = rest.line, next_line(&rest, &line))) {
        if (line.length == 0) {
            continue;
        }
        if (line.at[0] == '#' || (!gmt && line.at[0] == '/')) {
            if (gmt) {
                read_gmt_comment(&reader, line);
            }
            continue;
        }
        status = gmt ? read_gmt_line(&reader, line) : read_gdaldem_line(&reader, line);
    }
    if (status.code == VD_OK && reader.count == 0) {
        status = vd_failure(VD_ERROR_FORMAT,
                            "cannot read %s: it has no colours; give a GMT .cpt or a gdaldem "
                            "color-relief text",
                            name);
    }
    if (status.code == VD_OK && gmt) {
        place_gmt_values(&reader);
        status = add_ends(&reader);
    }
    if (status.code != VD_OK) {
        return status;
    }
    if (!gmt) {
        sort_stops(map.stops, reader.count);
        map.relative = reader.percent;
    }
    map.count = reader.count;
    *out = map;
    return vd_success();
}

vd_status vd_colormap_load(vd_context *context, const char *path, vd_colormap *out) {
    if (!context || !path || !out) {
        return vd_failure(VD_ERROR_ARGUMENT, "vd_colormap_load: no argument may be null");
    }
    void *data = NULL;
    size_t size_bytes = 0;
    vd_status status = vd_file_read(context, path, limit_bytes, &data, &size_bytes);
    if (status.code != VD_OK) {
        return status;
    }
    const char *name = strcmp(path, "-") == 0 ? "standard input" : path;
    status = vd_colormap_decode(data, size_bytes, name, out);
    vd_release(context, data);
    return status;
}

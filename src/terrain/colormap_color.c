/* colormap_color.c: colours as colour map files write them. */
#include <math.h>
#include "core/text.h"
#include "terrain/colormap_internal.h"

bool vd_field_number(vd_field field, double *out) {
    vd_text text = vd_text_make(field.at, field.length);
    double value;
    if (field.length == 0 || !vd_text_number(&text, &value) || !vd_text_done(&text)) {
        return false;
    }
    *out = value;
    return true;
}

static bool level_from(double value, uint8_t *out) {
    if (!(value >= 0.0 && value <= 255.0)) {
        return false;
    }
    *out = (uint8_t)floor(value + 0.5);
    return true;
}

/* Smith 1978, "Color gamut transform pairs". */
vd_rgba8 vd_color_from_hsv(double hue_deg, double saturation, double value) {
    double sector = hue_deg / 60.0 - 6.0 * floor(hue_deg / 360.0);
    double f = sector - floor(sector);
    double p = value * (1.0 - saturation), q = value * (1.0 - saturation * f);
    double t = value * (1.0 - saturation * (1.0 - f));
    const double table[6][3] = {{value, t, p}, {q, value, p}, {p, value, t},
                                {p, q, value}, {t, p, value}, {value, p, q}};
    const double *c = table[(int)floor(sector) % 6];
    return (vd_rgba8){(uint8_t)floor(c[0] * 255.0 + 0.5), (uint8_t)floor(c[1] * 255.0 + 0.5),
                      (uint8_t)floor(c[2] * 255.0 + 0.5), 255};
}

static bool from_hsv(const double v[3], vd_file_color *out) {
    if (!(v[0] >= 0.0 && v[0] <= 360.0 && v[1] >= 0.0 && v[1] <= 1.0 && v[2] >= 0.0 &&
          v[2] <= 1.0)) {
        return false;
    }
    out->is_hsv = true;
    for (int i = 0; i < 3; i++) {
        out->hsv[i] = v[i];
    }
    out->rgba = vd_color_from_hsv(v[0], v[1], v[2]);
    return true;
}

static bool from_rgb(const double v[3], vd_file_color *out) {
    out->is_hsv = false;
    out->rgba.a = 255;
    return level_from(v[0], &out->rgba.r) && level_from(v[1], &out->rgba.g) &&
           level_from(v[2], &out->rgba.b);
}

/* Cyan, magenta, yellow and black in percent. */
static bool from_cmyk(const double v[4], vd_file_color *out) {
    double rgb[3];
    for (int i = 0; i < 3; i++) {
        rgb[i] = 255.0 * (1.0 - v[i] / 100.0) * (1.0 - v[3] / 100.0);
        if (!(v[i] >= 0.0 && v[i] <= 100.0 && v[3] >= 0.0 && v[3] <= 100.0)) {
            return false;
        }
    }
    return from_rgb(rgb, out);
}

static int hex_digit(char c) {
    if (c >= '0' && c <= '9') {
        return c - '0';
    }
    c = (char)(c | 0x20);
    return c >= 'a' && c <= 'f' ? c - 'a' + 10 : -1;
}

static bool from_hex(vd_field field, vd_file_color *out) {
    uint8_t level[3];
    size_t digits = field.length - 1;
    if (digits != 3 && digits != 6) {
        return false;
    }
    for (size_t i = 0; i < 3; i++) {
        int high = hex_digit(field.at[1 + i * digits / 3]);
        int low = hex_digit(field.at[1 + i * digits / 3 + (digits == 6)]);
        if (high < 0 || low < 0) {
            return false;
        }
        level[i] = (uint8_t)(high * 16 + low);
    }
    out->is_hsv = false;
    out->rgba = (vd_rgba8){level[0], level[1], level[2], 255};
    return true;
}

/* Splits a field at a separator into numbers; returns how many, 0 when one is not a number. */
static int split(vd_field field, char separator, double values[4]) {
    int count = 0;
    size_t begin = 0;
    for (size_t i = 0; i <= field.length; i++) {
        if (i < field.length && field.at[i] != separator) {
            continue;
        }
        vd_field part = {field.at + begin, i - begin};
        if (count == 4 || !vd_field_number(part, &values[count])) {
            return 0;
        }
        count++;
        begin = i + 1;
    }
    return count;
}

static bool opaque_color(vd_field field, vd_colormap_dialect dialect, vd_file_color *out) {
    double v[4];
    if (field.length == 0) {
        return false;
    }
    if (field.at[0] == '#') {
        return from_hex(field, out);
    }
    int count = split(field, '/', v);
    if (count == 1) {
        v[1] = v[2] = v[0];
        return from_rgb(v, out);
    }
    if (count == 3) {
        return from_rgb(v, out);
    }
    if (count == 4) {
        return from_cmyk(v, out);
    }
    if (split(field, '-', v) == 3) {
        return from_hsv(v, out);
    }
    out->is_hsv = false;
    return vd_color_find(field, dialect, &out->rgba);
}

bool vd_field_color(vd_field field, vd_colormap_dialect dialect, vd_file_color *out) {
    if (field.length == 1 && field.at[0] == '-') {
        out->is_hsv = false;
        out->rgba = (vd_rgba8){0, 0, 0, 0};
        return true;
    }
    size_t at = 0;
    while (at < field.length && field.at[at] != '@') {
        at++;
    }
    vd_field color = {field.at, at};
    if (!opaque_color(color, dialect, out)) {
        return false;
    }
    if (at < field.length) {
        vd_field rest = {field.at + at + 1, field.length - at - 1};
        double transparency;
        if (!vd_field_number(rest, &transparency)) {
            return false;
        }
        return level_from(255.0 * (1.0 - transparency / 100.0), &out->rgba.a);
    }
    return true;
}

bool vd_fields_color(const vd_field fields[3], bool hsv, vd_file_color *out) {
    double v[3];
    for (int i = 0; i < 3; i++) {
        if (!vd_field_number(fields[i], &v[i])) {
            return false;
        }
    }
    return hsv ? from_hsv(v, out) : from_rgb(v, out);
}

/* window_look.c: live options from the option table. */
#include "window_look.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* What the option table does not say: the part of a value, and the range of a slider where the
 * option's own is too wide for one. Both 0: the table's. */
static const struct {
    int option;
    const char *part;
    bool slider, logarithmic;
    double min, max;
} lives[VD_LIVE_COUNT] = {
    [VD_LIVE_SUN_AZIMUTH] = {OPTION_SUN, "azimuth", true, false, 0.0, 360.0},
    [VD_LIVE_SUN_ALTITUDE] = {OPTION_SUN, "altitude", true, false, 0.0, 90.0},
    [VD_LIVE_HAZE] = {OPTION_HAZE, NULL, true, true, 0.0, 0.0},
    [VD_LIVE_EXAGGERATE] = {OPTION_EXAGGERATE, NULL, true, true, 0.05, 20.0},
    [VD_LIVE_FOV] = {OPTION_FOV, NULL, true, false, 5.0, 140.0},
    [VD_LIVE_SAMPLES] = {OPTION_SAMPLES, NULL, false, false, 0.0, 0.0},
    [VD_LIVE_FILTER] = {OPTION_FILTER, NULL, false, false, 0.0, 0.0},
    [VD_LIVE_SHADOWS] = {OPTION_SHADOWS, NULL, false, false, 0.0, 0.0},
    [VD_LIVE_SHADING] = {OPTION_SHADING, NULL, false, false, 0.0, 0.0},
    [VD_LIVE_SKY] = {OPTION_SKY, NULL, false, false, 0.0, 0.0},
    [VD_LIVE_CURVATURE] = {OPTION_CURVATURE, NULL, false, false, 0.0, 0.0},
    [VD_LIVE_COLORMAP] = {OPTION_COLORMAP, NULL, false, false, 0.0, 0.0},
    [VD_LIVE_METHOD] = {OPTION_METHOD, NULL, false, false, 0.0, 0.0},
    [VD_LIVE_THREADS] = {OPTION_THREADS, NULL, true, false, 1.0, 0.0},
};

int vd_live_option(vd_live live) {
    return lives[live].option;
}

bool vd_live_is_slider(vd_live live) {
    return lives[live].slider;
}

void vd_live_label(vd_live live, char out[40]) {
    const char *part = lives[live].part;
    snprintf(out, 40, "%s%s%s", vd_render_table[lives[live].option].key, part != NULL ? " " : "",
             part != NULL ? part : "");
}

static void range(const vd_look_defaults *defaults, vd_live live, double *min, double *max) {
    const vd_option *option = &vd_render_table[lives[live].option];
    const bool own = lives[live].max > lives[live].min;
    *min = own ? lives[live].min : option->min;
    *max = own ? lives[live].max : option->max;
    if (live == VD_LIVE_HAZE) {
        *min = 0.05 * defaults->size_m;
        *max = 100.0 * defaults->size_m;
    } else if (live == VD_LIVE_THREADS) {
        *min = 1.0;
        *max = defaults->threads;
    }
}

double vd_live_number(const vd_options *options, const vd_look_defaults *defaults, vd_live live) {
    const vd_option_value *value = &options->values[lives[live].option];
    double sun[2] = {0.0, 0.0}, metres;
    switch (live) {
    case VD_LIVE_SUN_AZIMUTH:
    case VD_LIVE_SUN_ALTITUDE:
        return vd_read_numbers(value->text, sun, 2) == 2 ? sun[live - VD_LIVE_SUN_AZIMUTH] : 0.0;
    case VD_LIVE_HAZE:
        if (strcmp(value->text, "auto") == 0 || strcmp(value->text, "on") == 0) {
            return defaults->haze_m;
        }
        return vd_read_distance(value->text, &metres) ? metres : 0.0;
    case VD_LIVE_THREADS:
        return value->number > 0.0 ? value->number : defaults->threads;
    default:
        return value->number;
    }
}

double vd_live_position(const vd_options *options, const vd_look_defaults *defaults, vd_live live) {
    double min, max;
    range(defaults, live, &min, &max);
    double value = vd_live_number(options, defaults, live);
    if (lives[live].logarithmic) {
        if (value <= 0.0) {
            return 1.0; /* haze off: one sees without end */
        }
        value = log(value);
        min = log(min);
        max = log(max);
    }
    const double position = max > min ? (value - min) / (max - min) : 0.0;
    return position < 0.0 ? 0.0 : position > 1.0 ? 1.0 : position;
}

vd_status vd_live_set_number(vd_options *options, vd_live live, double value) {
    const int option = lives[live].option;
    char text[80], number[32], other[32];
    vd_write_number(value, number);
    double sun[2];
    if (option == OPTION_SUN && vd_read_numbers(options->values[option].text, sun, 2) == 2) {
        vd_write_number(sun[live == VD_LIVE_SUN_AZIMUTH], other);
        snprintf(text, sizeof text, "%s,%s", live == VD_LIVE_SUN_AZIMUTH ? number : other,
                 live == VD_LIVE_SUN_AZIMUTH ? other : number);
    } else {
        snprintf(text, sizeof text, "%s", number);
    }
    return vd_options_set(options, option, text, VD_SOURCE_FLAG);
}

/* Rounds to three digits: a slider's pixels say no more, and flags stay short. */
static double shorten(double value) {
    char text[32];
    snprintf(text, sizeof text, "%.3g", value);
    return strtod(text, NULL);
}

vd_status vd_live_set_position(vd_options *options, const vd_look_defaults *defaults, vd_live live,
                               double position) {
    double min, max;
    range(defaults, live, &min, &max);
    double value = lives[live].logarithmic ? min * exp(position * log(max / min))
                                           : min + position * (max - min);
    value = live == VD_LIVE_THREADS ? floor(value + 0.5) : shorten(value);
    return vd_live_set_number(options, live, value);
}

/* The words of a choice: as the table lists them, or as the library does. Returns how many. */
static int words_of(vd_live live, char words[64][32]) {
    int count = 0;
    if (live == VD_LIVE_COLORMAP) {
        for (; count < 64 && vd_colormap_name(count) != NULL; count++) {
            snprintf(words[count], 32, "%s", vd_colormap_name(count));
        }
    } else if (live == VD_LIVE_METHOD) {
        for (; count < VD_TERRAIN_METHOD_COUNT; count++) {
            snprintf(words[count], 32, "%s", vd_terrain_method_name((vd_terrain_method)count));
        }
    } else if (vd_render_table[lives[live].option].type == VD_OPTION_CHOICE) {
        const char *at = vd_render_table[lives[live].option].argument;
        /* Of the filters only the first two are for terrain. */
        for (int most = live == VD_LIVE_FILTER ? 2 : 64; count < most && *at != '\0'; count++) {
            const int length = (int)strcspn(at, "|");
            snprintf(words[count], 32, "%.*s", length, at);
            at += length + (at[length] == '|');
        }
    } else {
        snprintf(words[count++], 32, "off");
        snprintf(words[count++], 32, "on");
    }
    return count;
}

/* Which word an option stands at; −1 for another, such as a file's name. */
static int word_now(const vd_options *options, const vd_look_defaults *defaults, vd_live live,
                    char words[64][32], int count) {
    const vd_option_value *value = &options->values[lives[live].option];
    if (live == VD_LIVE_CURVATURE && value->text == NULL) {
        return defaults->curvature;
    }
    if (vd_render_table[lives[live].option].type == VD_OPTION_FLAG) {
        return value->number != 0.0;
    }
    if (live == VD_LIVE_METHOD && strcmp(value->text, "auto") == 0) {
        return VD_TERRAIN_MARCH;
    }
    for (int i = 0; i < count; i++) {
        if (strcmp(words[i], value->text) == 0) {
            return i;
        }
    }
    return -1;
}

vd_status vd_live_next(vd_options *options, const vd_look_defaults *defaults, vd_live live,
                       int step) {
    char words[64][32];
    const int count = words_of(live, words);
    const int now = word_now(options, defaults, live, words, count);
    return vd_options_set(options, lives[live].option, words[(now + step + count) % count],
                          VD_SOURCE_FLAG);
}

void vd_live_value(const vd_options *options, const vd_look_defaults *defaults, vd_live live,
                   char out[64]) {
    if (vd_live_is_slider(live)) {
        const double value = vd_live_number(options, defaults, live);
        if (live == VD_LIVE_HAZE) {
            if (value <= 0.0) {
                snprintf(out, 64, "off");
            } else {
                const bool near = value < 1e4;
                snprintf(out, 64, near || value >= 1e6 ? "%.0f %s" : "%.1f %s",
                         near ? value : 1e-3 * value, near ? "m" : "km");
            }
            return;
        }
        /* The unit's first word: "degrees" of "degrees clockwise from north". */
        const char *unit = vd_render_table[lives[live].option].unit;
        snprintf(out, 64, "%.4g%s%.*s", value, unit != NULL ? " " : "",
                 unit != NULL ? (int)strcspn(unit, " ,") : 0, unit != NULL ? unit : "");
        return;
    }
    char words[64][32];
    const int count = words_of(live, words);
    const int now = word_now(options, defaults, live, words, count);
    snprintf(out, 64, "%.63s", now >= 0 ? words[now] : options->values[lives[live].option].text);
}

static void add_flag(char *out, size_t out_bytes, const char *key, const char *value) {
    const size_t used = strlen(out);
    static const char plain[] = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ"
                                "0123456789-_=+,.:/@%";
    const bool quote = value[strspn(value, plain)] != '\0' && strchr(value, '\'') == NULL;
    snprintf(out + used, out_bytes - used, " --%s%s%s%s%s", key, value[0] != '\0' ? " " : "",
             quote ? "'" : "", value, quote ? "'" : "");
}

void vd_look_flags(const vd_options *options, const vd_look_defaults *defaults, char *out,
                   size_t out_bytes) {
    out[0] = '\0';
    for (int i = 0; i < OPTION_COUNT; i++) {
        const vd_option *option = &vd_render_table[i];
        const vd_option_value *value = &options->values[i];
        const bool camera = i >= OPTION_AZIMUTH && i <= OPTION_PRINT_CAMERA;
        if (value->source == VD_SOURCE_DEFAULT || value->text == NULL || camera ||
            option->transient || i == OPTION_OUTPUT || i == OPTION_SIZE || i == OPTION_PRESET ||
            i == OPTION_THREADS || i == OPTION_ALLOW_EMPTY || i == OPTION_HAZE) {
            continue;
        }
        add_flag(out, out_bytes, option->key, option->type == VD_OPTION_SWITCH ? "" : value->text);
    }
    char number[32];
    const double haze_m = vd_live_number(options, defaults, VD_LIVE_HAZE);
    vd_write_number(haze_m, number);
    add_flag(out, out_bytes, "haze", haze_m > 0.0 ? number : "off");
    if (options->values[OPTION_CURVATURE].text == NULL) {
        add_flag(out, out_bytes, "curvature", defaults->curvature ? "on" : "off");
    }
}

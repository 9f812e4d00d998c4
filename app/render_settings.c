/* render_settings.c: what the texts of the render options mean. */
#include "render_settings.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const char *text_of(const vd_options *options, int index) {
    return options->values[index].text;
}

static double number_of(const vd_options *options, int index) {
    return options->values[index].number;
}

static bool is_on(const vd_options *options, int index) {
    return options->values[index].text != NULL && options->values[index].number != 0.0;
}

/* Reads a run of 1 to 9 digits and moves behind it; −1 when there is none. */
static long read_digits(const char **at) {
    size_t digits = strspn(*at, "0123456789");
    if (digits == 0 || digits > 9) {
        return -1;
    }
    long value = strtol(*at, NULL, 10);
    *at += digits;
    return value;
}

/* Reads WxH and moves behind it; both sides 1 to VD_MAX_SIDE. */
static bool read_size(const char **at, int *width, int *height) {
    long w = read_digits(at);
    if (w < 1 || w > VD_MAX_SIDE || **at != 'x') {
        return false;
    }
    (*at)++;
    long h = read_digits(at);
    if (h < 1 || h > VD_MAX_SIDE) {
        return false;
    }
    *width = (int)w;
    *height = (int)h;
    return true;
}

bool vd_read_color(const char *text, vd_rgba8 *out) {
    text += text[0] == '#';
    if (strlen(text) != 6 || strspn(text, "0123456789abcdefABCDEF") != 6) {
        return false;
    }
    unsigned long bits = strtoul(text, NULL, 16);
    *out = (vd_rgba8){(uint8_t)(bits >> 16), (uint8_t)(bits >> 8), (uint8_t)bits, 255};
    return true;
}

bool vd_ends_with(const char *text, const char *ending) {
    size_t length = strlen(text), tail = strlen(ending);
    return length >= tail && strcmp(text + length - tail, ending) == 0;
}

/* ---- picture ----------------------------------------------------------------------------------
 */

static vd_status read_output(const vd_options *options, vd_render_settings *out) {
    out->output = text_of(options, OPTION_OUTPUT);
    out->depth = text_of(options, OPTION_DEPTH);
    out->ids = text_of(options, OPTION_IDS);
    const char *slash = strrchr(out->output, '/');
    const char *dot = strrchr(slash != NULL ? slash : out->output, '.');
    if (dot != NULL && dot[1] != '\0' && strcmp(dot, ".png") != 0 && strcmp(dot, ".PNG") != 0) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "--output: %.200s does not end in .png; pictures are written as PNG only",
                          out->output);
    }
    if (out->depth != NULL && !vd_ends_with(out->depth, ".exr") &&
        !vd_ends_with(out->depth, ".pfm") && !vd_ends_with(out->depth, ".png")) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "--depth: %.200s ends in none of .exr, .pfm and .png; name one of them",
                          out->depth);
    }
    if (out->ids != NULL && !vd_ends_with(out->ids, ".png")) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "--ids: %.200s does not end in .png; name one that "
                          "does",
                          out->ids);
    }
    out->print_camera = is_on(options, OPTION_PRINT_CAMERA);
    out->dry_run = is_on(options, OPTION_DRY_RUN);
    out->allow_empty = is_on(options, OPTION_ALLOW_EMPTY);
    out->json = is_on(options, OPTION_JSON);
    out->quiet = is_on(options, OPTION_QUIET);
    if (strcmp(out->output, "-") == 0 && !out->dry_run && (out->json || out->print_camera)) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "--output - and --%s both want standard output; "
                          "write the picture to a file",
                          out->json ? "json" : "print-camera");
    }
    return vd_success();
}

static vd_status read_picture(const vd_options *options, vd_render_settings *out) {
    bool given = vd_options_given(options, OPTION_SIZE);
    const char *size = given || !out->classic ? text_of(options, OPTION_SIZE) : "700x512";
    const char *at = size;
    if (!read_size(&at, &out->width, &out->height) || *at != '\0') {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "--size: \"%.40s\" is not a size; give WIDTHxHEIGHT in pixels, each 1 to "
                          "%d, such as 1920x1080",
                          size, VD_MAX_SIDE);
    }
    if ((size_t)out->width * (size_t)out->height > VD_MAX_PIXELS) {
        return vd_failure(VD_ERROR_ARGUMENT, "--size: %.40s is more than %zu pixels; give less",
                          size, VD_MAX_PIXELS);
    }
    static const int samples[] = {1, 4, 8};
    out->samples = samples[(int)number_of(options, OPTION_SAMPLES)];
    out->filter = number_of(options, OPTION_FILTER) == 0.0 ? VD_FILTER_NEAREST : VD_FILTER_LINEAR;
    out->threads = (int)number_of(options, OPTION_THREADS);
    out->png_level = (int)number_of(options, OPTION_PNG_LEVEL);
    return vd_success();
}

/* Appends "name, " to a list. */
static void append_name(char *list, size_t list_bytes, const char *name) {
    const size_t used = strlen(list);
    snprintf(list + used, list_bytes - used, "%s%s", used > 0 ? ", " : "", name);
}

static vd_status read_method(const vd_options *options, vd_render_settings *out) {
    const char *method = text_of(options, OPTION_METHOD);
    const bool automatic = strcmp(method, "auto") == 0;
    char lens[80] = "", classic[160] = "";
    bool lens_found = automatic, classic_found = automatic;
    out->terrain_method = VD_TERRAIN_MARCH;
    out->classic_method = VD_CLASSIC_MARCH;
    for (int i = 0; i < VD_TERRAIN_METHOD_COUNT; i++) {
        const char *name = vd_terrain_method_name((vd_terrain_method)i);
        append_name(lens, sizeof lens, name);
        if (strcmp(method, name) == 0) {
            out->terrain_method = (vd_terrain_method)i;
            lens_found = true;
        }
    }
    for (int i = 0; i < VD_CLASSIC_METHOD_COUNT; i++) {
        const char *name = vd_classic_method_name((vd_classic_method)i);
        append_name(classic, sizeof classic, name);
        if (strcmp(method, name) == 0) {
            out->classic_method = (vd_classic_method)i;
            classic_found = true;
        }
    }
    if (out->classic ? classic_found : lens_found) {
        return vd_success();
    }
    if (classic_found) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "--method: %s draws the classic picture only; add --classic, or give "
                          "one of %s",
                          method, lens);
    }
    return vd_failure(VD_ERROR_ARGUMENT, "--method: there is no \"%.40s\"%s; give one of %s%s%s",
                      method, out->classic ? " for --classic" : "", out->classic ? classic : lens,
                      out->classic ? "" : "; with --classic ", out->classic ? "" : classic);
}

/* ---- look -------------------------------------------------------------------------------------
 */

static vd_status read_sky(const vd_options *options, vd_render_settings *out) {
    const char *sky = text_of(options, OPTION_SKY);
    const char *background = text_of(options, OPTION_BACKGROUND);
    if (background != NULL && strcmp(background, "transparent") != 0 &&
        !vd_read_color(background, &out->background)) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "--background: \"%.40s\" is not a colour; give RRGGBB "
                          "in hexadecimal, such as 9090E0, or transparent",
                          background);
    }
    out->sky = strcmp(sky, "off") != 0;
    if (out->sky && strcmp(sky, "on") != 0) {
        out->sky_colored = true;
        if (!vd_read_color(sky, &out->sky_color)) {
            return vd_failure(VD_ERROR_ARGUMENT,
                              "--sky: \"%.40s\" is neither on, off nor a "
                              "colour; give one, such as 9090E0",
                              sky);
        }
    }
    if (background != NULL) {
        if (out->sky && vd_options_given(options, OPTION_SKY)) {
            return vd_failure(VD_ERROR_ARGUMENT, "--background shows only without a sky; leave out "
                                                 "--sky or --background");
        }
        out->sky = false;
    }
    return vd_success();
}

static vd_status read_look(const vd_options *options, vd_render_settings *out) {
    double sun[2];
    if (vd_read_numbers(text_of(options, OPTION_SUN), sun, 2) != 2 || sun[0] < -360.0 ||
        sun[0] > 360.0 || sun[1] < -90.0 || sun[1] > 90.0) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "--sun: \"%.40s\" is not a direction; give AZ,ALT in "
                          "degrees, -360 to 360 and -90 to 90, such as 315,45",
                          text_of(options, OPTION_SUN));
    }
    out->sun_azimuth = sun[0];
    out->sun_altitude = sun[1];
    out->color = text_of(options, OPTION_COLOR);
    out->colormap = text_of(options, OPTION_COLORMAP);
    out->colormap_given = vd_options_given(options, OPTION_COLORMAP);
    if (out->color != NULL && vd_options_given(options, OPTION_COLORMAP)) {
        return vd_failure(VD_ERROR_ARGUMENT, "--color and --colormap both say how the terrain is "
                                             "coloured; give one of them");
    }
    out->shadows = is_on(options, OPTION_SHADOWS);
    out->shadows_given = vd_options_given(options, OPTION_SHADOWS);
    out->shadow_curve =
        number_of(options, OPTION_SHADOWS) == 3.0 ? VD_SHADOW_PUBLISHED : VD_SHADOW_SOFT;
    if (!out->classic && number_of(options, OPTION_SHADOWS) > 1.0) {
        return vd_failure(VD_ERROR_ARGUMENT, "--shadows %s belongs to --classic; give on or off",
                          text_of(options, OPTION_SHADOWS));
    }
    out->shading = is_on(options, OPTION_SHADING);
    out->exaggeration = number_of(options, OPTION_EXAGGERATE);
    out->curvature = vd_options_given(options, OPTION_CURVATURE)
                         ? (int)number_of(options, OPTION_CURVATURE)
                         : -1;
    const char *haze = text_of(options, OPTION_HAZE);
    if (strcmp(haze, "off") == 0) {
        out->haze = VD_HAZE_OFF;
    } else if (strcmp(haze, "auto") != 0 && strcmp(haze, "on") != 0) {
        out->haze = VD_HAZE_DISTANCE;
        if (!vd_read_distance(haze, &out->haze_m) || out->haze_m <= 0.0) {
            return vd_failure(VD_ERROR_ARGUMENT,
                              "--haze: \"%.40s\" is neither auto, off nor a "
                              "distance; give one, such as 20km",
                              haze);
        }
    }
    return read_sky(options, out);
}

/* ---- data -------------------------------------------------------------------------------------
 */

/* Reads WxH:TYPE[:big][:SKIP]. */
static bool read_raw(const char *text, vd_dem_def *dem) {
    static const char *const types[] = {"u8", "i16", "u16", "i32", "f32", "f64"};
    const char *at = text;
    if (!read_size(&at, &dem->raw_width, &dem->raw_height) || *at != ':') {
        return false;
    }
    for (int field = 0; *at == ':'; field++) {
        at++;
        size_t length = strcspn(at, ":");
        bool known = false;
        for (size_t i = 0; field == 0 && i < sizeof types / sizeof types[0]; i++) {
            if (strlen(types[i]) == length && strncmp(at, types[i], length) == 0) {
                strcpy(dem->raw_type, types[i]);
                known = true;
            }
        }
        if (field > 0 && length == 3 && strncmp(at, "big", 3) == 0) {
            dem->raw_big_endian = known = true;
        } else if (field > 0 && length > 0 && strspn(at, "0123456789") == length && length < 16) {
            dem->raw_offset_bytes = (size_t)strtoull(at, NULL, 10);
            known = true;
        }
        if (!known) {
            return false;
        }
        at += length;
    }
    return *at == '\0';
}

static vd_status read_data(const vd_options *options, vd_render_settings *out) {
    out->dem = vd_dem_def_default();
    out->dem.encoding = (vd_height_encoding)number_of(options, OPTION_HEIGHT_ENCODING);
    out->dem.height_offset_m = number_of(options, OPTION_HEIGHT_OFFSET);
    out->dem.has_nodata = vd_options_given(options, OPTION_NODATA);
    out->dem.nodata = number_of(options, OPTION_NODATA);
    out->has_cell_size = vd_options_given(options, OPTION_CELL_SIZE);
    if (out->has_cell_size) {
        out->dem.cell_size_m = number_of(options, OPTION_CELL_SIZE);
    }
    if (vd_options_given(options, OPTION_HEIGHT_SCALE)) {
        out->dem.height_scale = number_of(options, OPTION_HEIGHT_SCALE);
        if (out->dem.height_scale == 0.0) {
            return vd_failure(VD_ERROR_ARGUMENT, "--height-scale: 0 would make everything flat; "
                                                 "give another factor");
        }
    }
    const char *raw = text_of(options, OPTION_RAW), *bands = text_of(options, OPTION_BANDS);
    if (raw != NULL && !read_raw(raw, &out->dem)) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "--raw: \"%.60s\" is not understood; give "
                          "WxH:TYPE[:big][:SKIP] with u8, i16, u16, i32, f32 or f64, such as "
                          "1201x1201:i16:big",
                          raw);
    }
    const char *extent = text_of(options, OPTION_EXTENT);
    const double *e = out->extent;
    if (extent != NULL &&
        (vd_read_numbers(extent, out->extent, 4) != 4 || !(e[0] < e[2]) || !(e[1] < e[3]) ||
         !(fabs(e[0]) < 1e9 && fabs(e[1]) < 1e9 && fabs(e[2]) < 1e9 && fabs(e[3]) < 1e9))) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "--extent: \"%.80s\" is not a rectangle; give X0,Y0,X1,Y1 in metres "
                          "(below 1e9) with X0 < X1 and Y0 < Y1",
                          extent);
    }
    out->fill_missing = number_of(options, OPTION_MISSING) != 0.0;
    out->band = (int)number_of(options, OPTION_BAND);
    double numbers[3] = {0.0, 0.0, 0.0};
    bool right = bands == NULL || vd_read_numbers(bands, numbers, 3) == 3;
    for (int i = 0; i < 3; i++) {
        right = right && numbers[i] >= (bands != NULL ? 1.0 : 0.0) && numbers[i] <= 65535.0;
        out->bands[i] = right ? (int)numbers[i] : 0;
    }
    if (!right) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "--bands: \"%.40s\" is not three band numbers; give "
                          "R,G,B, the first band being 1, such as 3,2,1",
                          bands);
    }
    return vd_success();
}

/* ---- classic ----------------------------------------------------------------------------------
 */

static vd_status read_classic_key(const char *pair, vd_classic_def *def, double *yaw) {
    double mip = def->mip, smooth = def->smooth;
    const struct {
        const char *key;
        double *value;
    } keys[] = {
        {"x", &def->x},
        {"y", &def->y},
        {"height", &def->height},
        {"yaw", yaw},
        {"horizon", &def->horizon},
        {"scale", &def->scale},
        {"view", &def->view},
        {"distance", &def->distance},
        {"z0", &def->z0},
        {"step", &def->step},
        {"growth", &def->growth},
        {"mip", &mip},
        {"smooth", &smooth},
    };
    enum { KEY_COUNT = sizeof keys / sizeof keys[0] };
    const char *names[KEY_COUNT];
    char key[32];
    size_t length = strcspn(pair, "=");
    snprintf(key, sizeof key, "%.*s", (int)(length < 31 ? length : 31), pair);
    for (int i = 0; i < KEY_COUNT; i++) {
        names[i] = keys[i].key;
        if (strcmp(key, keys[i].key) != 0) {
            continue;
        }
        if (pair[length] != '=' || !vd_read_number(pair + length + 1, keys[i].value)) {
            return vd_failure(VD_ERROR_ARGUMENT,
                              "--classic: \"%.60s\" is not KEY=NUMBER; give "
                              "one, such as %s=1",
                              pair, key);
        }
        if ((mip != 0.0 && mip != 1.0) || (smooth != 0.0 && smooth != 1.0)) {
            return vd_failure(VD_ERROR_ARGUMENT, "--classic: %s is on or off; give %s=1 or %s=0",
                              key, key, key);
        }
        def->yaw_rad = *yaw * VD_RADIANS_PER_DEGREE;
        def->mip = mip != 0.0;
        def->smooth = smooth != 0.0;
        return vd_success();
    }
    const char *nearest = vd_nearest_name(key, names, KEY_COUNT);
    return vd_failure(VD_ERROR_ARGUMENT, "--classic: there is no key \"%s\"; %s%s", key,
                      nearest != NULL ? "did you mean "
                                      : "the keys are x, y, height, yaw, horizon, "
                                        "scale, view, distance, z0, step, growth, mip and smooth",
                      nearest != NULL ? nearest : "");
}

/* The classic picture has neither light nor sky: what asks for them is bad use, what switches them
 * off is not. */
static vd_status refuse_in_classic(const vd_options *options) {
    static const int never[] = {
        OPTION_EXAGGERATE,   OPTION_AZIMUTH,       OPTION_ELEVATION,       OPTION_DISTANCE,
        OPTION_EYE,          OPTION_TARGET,        OPTION_HEADING,         OPTION_PITCH,
        OPTION_ROLL,         OPTION_FOV,           OPTION_PROJECTION,      OPTION_NEAR,
        OPTION_MISSING,      OPTION_NODATA,        OPTION_CELL_SIZE,       OPTION_RAW,
        OPTION_HEIGHT_SCALE, OPTION_HEIGHT_OFFSET, OPTION_HEIGHT_ENCODING, OPTION_BAND,
        OPTION_BANDS,        OPTION_FUNCTION,      OPTION_EXTENT,          OPTION_LINES,
        OPTION_LABELS,       OPTION_LABEL_PEAKS,   OPTION_TITLE,           OPTION_NORTH_ARROW,
        OPTION_SCALE_BAR,    OPTION_LEGEND,
    };
    static const struct {
        int option;
        const char *off;
    } only_off[] = {{OPTION_SHADING, "off"},
                    {OPTION_HAZE, "off"},
                    {OPTION_SKY, "off"},
                    {OPTION_CURVATURE, "off"}};
    for (size_t i = 0; i < sizeof never / sizeof never[0]; i++) {
        if (vd_options_given(options, never[i])) {
            return vd_failure(VD_ERROR_ARGUMENT, "--%s does not apply to --classic; leave it out",
                              options->table[never[i]].key);
        }
    }
    for (size_t i = 0; i < sizeof only_off / sizeof only_off[0]; i++) {
        int option = only_off[i].option;
        if (vd_options_given(options, option) &&
            strcmp(text_of(options, option), only_off[i].off) != 0 &&
            !(options->table[option].type == VD_OPTION_FLAG && !is_on(options, option))) {
            return vd_failure(VD_ERROR_ARGUMENT, "--%s can only be %s with --classic; leave it out",
                              options->table[option].key, only_off[i].off);
        }
    }
    return vd_success();
}

static vd_status read_classic(const vd_options *options, vd_render_settings *out) {
    vd_status status = refuse_in_classic(options);
    out->shadows = out->shadows && out->shadows_given;
    if (status.code == VD_OK && vd_options_given(options, OPTION_SUN) && !out->shadows) {
        status = vd_failure(VD_ERROR_ARGUMENT,
                            "--sun lights the classic picture only with --shadows; give both");
    }
    if (status.code == VD_OK && out->shadows && out->sun_altitude < 0.0) {
        status = vd_failure(VD_ERROR_ARGUMENT,
                            "--sun: the altitude is %.10g, and no sun below the horizon throws "
                            "shadows; give 0 to 90",
                            out->sun_altitude);
    }
    out->classic_def = vd_classic_def_default();
    const char *at = text_of(options, OPTION_CLASSIC);
    while (status.code == VD_OK && *at != '\0') {
        char pair[96];
        size_t length = strcspn(at, ",");
        snprintf(pair, sizeof pair, "%.*s", (int)(length < 95 ? length : 95), at);
        status = read_classic_key(pair, &out->classic_def, &out->classic_yaw);
        at += length + (at[length] == ',');
        at += strspn(at, " ");
    }
    if (status.code != VD_OK) {
        return status;
    }
    if (vd_options_given(options, OPTION_FILTER)) {
        out->classic_def.filter = out->filter;
    }
    if (vd_options_given(options, OPTION_SAMPLES)) {
        out->classic_def.samples = out->samples;
    }
    if (vd_options_given(options, OPTION_BACKGROUND)) {
        out->classic_def.background = out->background;
        if (out->background.a == 0) {
            return vd_failure(VD_ERROR_ARGUMENT, "--background: the classic picture has no "
                                                 "transparency; give RRGGBB");
        }
    }
    return vd_success();
}

/* Whether the input is a model, which is drawn alone. */
static vd_status read_model(vd_render_settings *out) {
    out->is_model = !out->classic && out->function == NULL && out->input_count > 0;
    for (int i = 0; i < out->input_count; i++) {
        out->is_model = out->is_model && vd_is_model_name(out->inputs[i], NULL);
        if (out->world && vd_is_model_name(out->inputs[i], NULL)) {
            return vd_failure(VD_ERROR_ARGUMENT,
                              "%.160s is a model, not heights; a world has it among its "
                              "\"objects\"",
                              out->inputs[i]);
        }
        if (out->input_count > 1 && vd_is_model_name(out->inputs[i], NULL)) {
            return vd_failure(VD_ERROR_ARGUMENT,
                              "%.160s is a model, which is drawn alone; name it without the other "
                              "files",
                              out->inputs[i]);
        }
    }
    return vd_success();
}

/* What the picture is made from: files, or for the classic one --height. */
static vd_status read_inputs(const vd_options *options, vd_render_settings *out) {
    const char *height = text_of(options, OPTION_HEIGHT);
    out->function = text_of(options, OPTION_FUNCTION);
    out->inputs = (const char *const *)options->inputs;
    out->input_count = options->input_count;
    if (!out->classic && height != NULL) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "--height belongs to --classic; name elevation files "
                          "without an option: veduta render %.120s",
                          height);
    }
    if (height != NULL && out->input_count > 0) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "--height and %.120s both give the heights; name one "
                          "of them",
                          out->inputs[0]);
    }
    if (height != NULL) {
        out->inputs = (const char *const *)&options->values[OPTION_HEIGHT].text;
        out->input_count = 1;
    }
    if (out->function != NULL && (out->input_count > 0 || text_of(options, OPTION_COLOR) != NULL)) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "--function makes heights and colours itself; leave out %.120s",
                          out->input_count > 0 ? out->inputs[0] : "--color");
    }
    out->world = options->world;
    if (out->world && out->classic) {
        return vd_failure(VD_ERROR_ARGUMENT, "--classic draws a map of its own; leave out the "
                                             "world file");
    }
    if (out->input_count == 0 && out->function == NULL && !out->world) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "there is nothing to render; name an elevation file, "
                          "as in `veduta render %s`",
                          out->classic ? "--classic x=512 --height "
                                         "map.png"
                                       : "dem.tif");
    }
    if (out->classic && out->input_count > 1) {
        return vd_failure(VD_ERROR_ARGUMENT, "--classic draws one map; name one height picture");
    }
    vd_status status = read_model(out);
    if (status.code != VD_OK) {
        return status;
    }
    const char *color = text_of(options, OPTION_COLOR), *file = text_of(options, OPTION_OPTIONS);
    int standard =
        (color != NULL && strcmp(color, "-") == 0) + (file != NULL && strcmp(file, "-") == 0);
    for (int i = 0; i < out->input_count; i++) {
        standard += strcmp(out->inputs[i], "-") == 0;
    }
    if (standard > 1) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "standard input (-) is named %d times and can be read "
                          "once; name files",
                          standard);
    }
    return vd_success();
}

vd_status vd_render_settings_read(const vd_options *options, vd_render_settings *out) {
    vd_render_settings made = {.background = {0, 0, 0, 0}};
    made.classic = vd_options_given(options, OPTION_CLASSIC);
    vd_status status = read_inputs(options, &made);
    if (status.code == VD_OK) {
        status = read_output(options, &made);
    }
    if (status.code == VD_OK) {
        status = read_picture(options, &made);
    }
    if (status.code == VD_OK) {
        status = read_method(options, &made);
    }
    if (status.code == VD_OK) {
        status = read_look(options, &made);
    }
    if (status.code == VD_OK) {
        status = vd_camera_settings_read(options, &made.camera);
    }
    if (status.code == VD_OK) {
        status = read_data(options, &made);
    }
    if (status.code == VD_OK) {
        status = vd_world_settings_read(options, &made);
    }
    if (status.code == VD_OK && made.classic) {
        status = read_classic(options, &made);
    }
    if (status.code == VD_OK) {
        status = vd_model_settings_read(options, &made);
    }
    if (status.code == VD_OK) {
        status = vd_impostor_settings_read(options, &made);
    }
    if (status.code == VD_OK) {
        *out = made;
    }
    return status;
}

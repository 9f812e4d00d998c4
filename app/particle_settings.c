/* particle_settings.c: the table of the options of particles, and reading them. */
#include "particle_settings.h"

#include <stdlib.h>
#include <string.h>

static bool is_colormap_name(const char *text) {
    vd_colormap map;
    return vd_colormap_find(text, &map);
}

#define PICTURE "Picture"
#define LOOK "Look"
#define CAMERA "Camera"
#define DATA "Data: what a file does not say itself"
#define RUN "This run"
#define OPTION(index, name, heading, kind, ...)                                                    \
    [PARTICLES_##index] = {.key = name, .group = heading, .type = VD_OPTION_##kind, __VA_ARGS__}

const vd_option vd_particles_table[PARTICLES_COUNT] = {
    OPTION(OUTPUT, "output", PICTURE, FILE, .letter = 'o', .argument = "FILE.png",
           .fallback = "veduta.png", .help = "where the picture goes; - is standard output"),
    OPTION(SIZE, "size", PICTURE, TEXT, .letter = 's', .argument = "WxH", .unit = "pixels",
           .fallback = "1920x1080", .help = "width and height of the picture, each 1 to 65535"),
    OPTION(PNG_LEVEL, "png-level", PICTURE, INTEGER, .argument = "N", .max = 9,
           .unit = "zlib level", .fallback = "1", .help = "how hard to compress: 0 not at all"),

    OPTION(COLOR_BY, "color-by", LOOK, TEXT, .argument = "NAME",
           .help = "an attribute, rgb, or height; by default rgb, class or height for scans, what "
                   "--mode density adds up for the rest"),
    OPTION(COLORMAP, "colormap", LOOK, FILE, .argument = "NAME|FILE", .is_name = is_colormap_name,
           .help = "colours of numbers: viridis, magma, terrain, grey, …, a GMT .cpt or a gdaldem "
                   "color-relief text; stretched over the range"),
    OPTION(RANGE, "range", LOOK, TEXT, .argument = "MIN,MAX|auto", .fallback = "auto",
           .help = "numbers that the ends of the colours stand for"),
    OPTION(LOG, "log", LOOK, FLAG,
           .help = "equal steps of colour are equal ratios; by default on for densities"),
    OPTION(MODE, "mode", LOOK, CHOICE, .argument = "alpha|density|nearest",
           .help = "blended back to front, added up along the line of sight, or the nearest alone; "
                   "by default nearest for scans and density for the rest, alpha with --color-by"),
    OPTION(KERNEL, "kernel", LOOK, CHOICE, .argument = "box|disc|gaussian|sph",
           .help = "how a particle of more than a pixel looks; by default disc, for densities sph "
                   "where there are radii, else box"),
    OPTION(RADIUS, "radius", LOOK, REAL, .argument = "R", .max = 1e300,
           .unit = "the file's unit of length", .fallback = "0",
           .help = "of all particles; 0: their own, with --mode alpha what suits their spacing"),
    OPTION(RADIUS_SCALE, "radius-scale", LOOK, REAL, .argument = "FACTOR", .min = 1e-6, .max = 1e6,
           .fallback = "1",
           .help = "larger or smaller particles; also takes their own radii with --mode alpha"),
    OPTION(OPACITY, "opacity", LOOK, REAL, .argument = "A", .min = 1e-6, .max = 1, .fallback = "1",
           .help = "of particles, with --mode alpha"),
    OPTION(WEIGHT, "weight", LOOK, TEXT, .argument = "NAME",
           .help = "what densities add up: an attribute, or count; by default mass where there is "
                   "one"),
    OPTION(SHADING, "shading", LOOK, FLAG, .fallback = "on",
           .help = "darken what stands behind its neighbours, with --mode nearest"),
    OPTION(BACKGROUND, "background", LOOK, TEXT, .argument = "RRGGBB|none",
           .help = "what is behind; none: transparent; by default nearly black"),
    OPTION(LEGEND, "legend", LOOK, FLAG,
           .help = "a bar of the colours with their numbers; by default on where there are any"),
    OPTION(DETAIL, "detail", LOOK, REAL, .argument = "PX", .max = 1e6, .unit = "pixels",
           .fallback = "0.5",
           .help = "how far from its place a particle may be drawn by one that stands for it; 0: "
                   "all particles are drawn"),

    OPTION(AZIMUTH, "azimuth", CAMERA, REAL, .argument = "DEG", .min = -720, .max = 720,
           .unit = "degrees", .fallback = "0",
           .help = "where the camera looks, clockwise from north (y)"),
    OPTION(ELEVATION, "elevation", CAMERA, REAL, .argument = "DEG", .min = -90, .max = 90,
           .unit = "degrees", .fallback = "35", .help = "how far it looks down"),
    OPTION(DISTANCE, "distance", CAMERA, DISTANCE, .argument = "D", .max = 1e300,
           .help = "from the target; by default all particles are in the picture"),
    OPTION(EYE, "eye", CAMERA, TEXT, .argument = "X,Y,Z",
           .help = "where the camera is, in place of azimuth, elevation and distance"),
    OPTION(TARGET, "target", CAMERA, TEXT, .argument = "X,Y,Z",
           .help = "what it looks at; by default the middle of the particles"),
    OPTION(FOV, "fov", CAMERA, REAL, .argument = "DEG", .min = 0.001, .max = 170, .unit = "degrees",
           .fallback = "40", .help = "vertical field of view"),
    OPTION(PROJECTION, "projection", CAMERA, CHOICE, .argument = "perspective|orthographic",
           .fallback = "perspective", .help = "orthographic has no vanishing points"),

    OPTION(COLUMNS, "columns", DATA, TEXT, .argument = "NAME,…",
           .help = "names of the columns of text or raw files; - passes one over"),
    OPTION(RAW, "raw", DATA, TEXT, .argument = "TYPE",
           .help = "the file is raw numbers of this type: f32, f64, i16, …"),

    OPTION(TYPE, "type", DATA, INTEGER, .argument = "N", .min = -1, .max = 5, .fallback = "-1",
           .help = "of snapshots: PartType0 (gas) to PartType5; -1: the first there is"),

    OPTION(THREADS, "threads", RUN, INTEGER, .letter = 't', .argument = "N", .max = 1024,
           .unit = "threads", .fallback = "0",
           .help = "how many draw at once; 0: one per processor; the picture is the same"),
    OPTION(JSON, "json", RUN, SWITCH, .letter = 'j', .help = "say what was done as JSON"),
    OPTION(QUIET, "quiet", RUN, SWITCH, .letter = 'q', .help = "no progress, no notes"),
    OPTION(HELP, "help", RUN, SWITCH, .letter = 'h', .help = "this page"),
};

static vd_status bad(const char *option, const char *value, const char *wanted) {
    return vd_failure(VD_ERROR_ARGUMENT, "--%s is %s, not \"%.100s\"", option, wanted, value);
}

static const char *text_of(const vd_options *o, int index) {
    return o->values[index].text;
}

static int choice_of(const vd_options *o, int index) {
    return vd_options_given(o, index) ? (int)o->values[index].number : -1;
}

static vd_status read_vector(const vd_options *o, int index, bool *has, vd_vec3 *out) {
    double v[3];
    const char *text = text_of(o, index);
    *has = text != NULL;
    if (text == NULL) {
        return vd_success();
    }
    if (vd_read_numbers(text, v, 3) != 3) {
        return bad(o->table[index].key, text, "three numbers, as in 1,2,3");
    }
    *out = vd_vec3_make(v[0], v[1], v[2]);
    return vd_success();
}

static bool read_size(const char *text, int *width, int *height) {
    char *end;
    const long w = strtol(text, &end, 10);
    if (end == text || (*end != 'x' && *end != 'X')) {
        return false;
    }
    const char *second = end + 1;
    const long h = strtol(second, &end, 10);
    *width = (int)w;
    *height = (int)h;
    return end != second && *end == '\0' && w >= 1 && w <= VD_MAX_SIDE && h >= 1 &&
           h <= VD_MAX_SIDE;
}

static bool read_color(const char *text, vd_rgba8 *out) {
    text += *text == '#';
    char *end;
    const unsigned long rgb = strtoul(text, &end, 16);
    *out = (vd_rgba8){(uint8_t)(rgb >> 16), (uint8_t)(rgb >> 8), (uint8_t)rgb, 255};
    return strlen(text) == 6 && *end == '\0' && strspn(text, "0123456789abcdefABCDEF") == 6;
}

static vd_status read_look(vd_context *context, const vd_options *o, vd_particle_settings *s) {
    const char *range = text_of(o, PARTICLES_RANGE), *map = text_of(o, PARTICLES_COLORMAP);
    if (strcmp(range, "auto") != 0 &&
        (vd_read_numbers(range, s->range, 2) != 2 || !(s->range[0] < s->range[1]))) {
        return bad("range", range, "auto, or two rising numbers, as in 0.1,100");
    }
    s->log = choice_of(o, PARTICLES_LOG);
    if (s->log == 1 && s->range[0] < s->range[1] && !(s->range[0] > 0.0)) {
        return bad("range", range, "of positive numbers with --log");
    }
    s->mode = choice_of(o, PARTICLES_MODE);
    s->shading = o->values[PARTICLES_SHADING].number != 0.0;
    s->radius_scale_given = vd_options_given(o, PARTICLES_RADIUS_SCALE);
    s->kernel = choice_of(o, PARTICLES_KERNEL);
    s->legend = choice_of(o, PARTICLES_LEGEND);
    const char *background = text_of(o, PARTICLES_BACKGROUND);
    s->background_given = background != NULL;
    if (background != NULL && strcmp(background, "none") != 0 &&
        !read_color(background, &s->background)) {
        return bad("background", background, "none or RRGGBB, as in 202830");
    }
    s->colormap_given = map != NULL;
    if (map != NULL && !vd_colormap_find(map, &s->colormap)) {
        return vd_colormap_load(context, map, &s->colormap);
    }
    return vd_success();
}

vd_status vd_particle_settings_read(vd_context *context, const vd_options *o,
                                    vd_particle_settings *out) {
    vd_particle_settings s = {.color_by = text_of(o, PARTICLES_COLOR_BY),
                              .weight = text_of(o, PARTICLES_WEIGHT),
                              .radius_m = o->values[PARTICLES_RADIUS].number,
                              .radius_scale = o->values[PARTICLES_RADIUS_SCALE].number,
                              .opacity = o->values[PARTICLES_OPACITY].number,
                              .detail_px = o->values[PARTICLES_DETAIL].number,
                              .azimuth = o->values[PARTICLES_AZIMUTH].number,
                              .elevation = o->values[PARTICLES_ELEVATION].number,
                              .distance_m = o->values[PARTICLES_DISTANCE].number,
                              .fov = o->values[PARTICLES_FOV].number,
                              .projection = (vd_projection)o->values[PARTICLES_PROJECTION].number};
    s.source.columns = text_of(o, PARTICLES_COLUMNS);
    s.source.raw = text_of(o, PARTICLES_RAW);
    if (!read_size(text_of(o, PARTICLES_SIZE), &s.width, &s.height)) {
        return bad("size", text_of(o, PARTICLES_SIZE), "WxH with sides of 1 to 65535");
    }
    vd_status status = read_look(context, o, &s);
    if (status.code == VD_OK) {
        status = read_vector(o, PARTICLES_EYE, &s.has_eye, &s.eye);
    }
    if (status.code == VD_OK) {
        status = read_vector(o, PARTICLES_TARGET, &s.has_target, &s.target);
    }
    const int orbit[] = {PARTICLES_AZIMUTH, PARTICLES_ELEVATION, PARTICLES_DISTANCE};
    for (int i = 0; i < 3 && status.code == VD_OK && s.has_eye; i++) {
        if (vd_options_given(o, orbit[i])) {
            status = vd_failure(VD_ERROR_ARGUMENT,
                                "--eye and --%s are different ways of saying "
                                "where the camera is; give one of them",
                                o->table[orbit[i]].key);
        }
    }
    *out = s;
    return status;
}

/* info.c: `veduta info`: what a file of elevations, a model or particles holds. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "commands.h"
#include "info_model.h"
#include "info_particles.h"
#include "png_text.h"
#include "run.h"
#include "scene.h"
#include "view.h"

enum {
    INFO_BAND,
    INFO_NODATA,
    INFO_CELL_SIZE,
    INFO_HEIGHT_SCALE,
    INFO_HEIGHT_ENCODING,
    INFO_JSON,
    INFO_HELP,
    INFO_COUNT
};

static const vd_option table[INFO_COUNT] = {
    [INFO_BAND] = {.key = "band",
                   .group = "Options",
                   .type = VD_OPTION_INTEGER,
                   .argument = "N",
                   .max = 65535,
                   .unit = "1 is the first",
                   .fallback = "0",
                   .help = "band that holds the heights (with GDAL); 0: the first"},
    [INFO_NODATA] = {.key = "nodata",
                     .group = "Options",
                     .type = VD_OPTION_REAL,
                     .argument = "VALUE",
                     .unit = "stored value",
                     .help = "treat this value as missing, beside what the file says"},
    [INFO_CELL_SIZE] = {.key = "cell-size",
                        .group = "Options",
                        .type = VD_OPTION_DISTANCE,
                        .argument = "D",
                        .min = 1e-9,
                        .max = 1e9,
                        .unit = "metres",
                        .help =
                            "spacing of the samples of files without georeference; by default 1"},
    [INFO_HEIGHT_SCALE] = {.key = "height-scale",
                           .group = "Options",
                           .type = VD_OPTION_REAL,
                           .argument = "FACTOR",
                           .unit = "metres per stored unit",
                           .help = "factor on stored heights; by default the file's unit, else 1"},
    [INFO_HEIGHT_ENCODING] = {.key = "height-encoding",
                              .group = "Options",
                              .type = VD_OPTION_CHOICE,
                              .argument = "grey|rgb24|terrarium|mapbox",
                              .fallback = "grey",
                              .help = "how pictures hold heights"},
    [INFO_JSON] = {.key = "json",
                   .group = "Options",
                   .type = VD_OPTION_SWITCH,
                   .letter = 'j',
                   .help = "print JSON"},
    [INFO_HELP] = {.key = "help",
                   .group = "Options",
                   .type = VD_OPTION_SWITCH,
                   .letter = 'h',
                   .help = "this page"},
};

/* What is printed, as people or scripts want it. */
typedef struct facts {
    const char *file;
    int width, height;
    double cell_x_m, cell_y_m; /* spacing of columns and rows on the ground */
    double min, max;
    double latitude, longitude; /* of the middle; NaN without georeference */
    const vd_scene *scene;
    char flags[1024];
    json_t *view, *text;
} facts;

static double length2(double x, double y) {
    return sqrt(x * x + y * y);
}

/* The suggested view: the framed one, in numbers rounded to what a person would type. */
static vd_status suggest_view(facts *f) {
    vd_camera_settings settings = vd_camera_settings_default();
    vd_view view;
    bool curvature = vd_scene_is_curved(f->scene);
    vd_status status = vd_view_make(f->scene, &settings, 1.0, curvature, 1920, 1080, &view);
    if (status.code != VD_OK) {
        return status;
    }
    vd_camera_settings *exact = &view.exact;
    if (exact->distance_m > 100.0) { /* whole metres, where they are small beside the scene */
        exact->distance_m = ceil(exact->distance_m);
        for (int i = 0; i < 3; i++) {
            exact->target.v[i] = floor(exact->target.v[i] + 0.5);
        }
    }
    const double *t = exact->target.v;
    snprintf(f->flags, sizeof f->flags,
             "--target %.10g,%.10g,%.10g --azimuth %g --elevation %g --distance %.10g", t[0], t[1],
             t[2], exact->azimuth, exact->elevation, exact->distance_m);
    f->view =
        json_pack("{s: [f, f, f], s: f, s: f, s: f}", "target", t[0], t[1], t[2], "azimuth",
                  exact->azimuth, "elevation", exact->elevation, "distance", exact->distance_m);
    return f->view != NULL ? status : vd_failure(VD_ERROR_MEMORY, "out of memory");
}

static void gather(facts *f, const vd_scene *scene) {
    const vd_heightfield *t = scene->terrain;
    const double *w = t->world_from_sample;
    f->scene = scene;
    f->width = t->width;
    f->height = t->height;
    f->cell_x_m = length2(w[1], w[4]);
    f->cell_y_m = length2(w[2], w[5]);
    f->min = t->min;
    f->max = t->max;
    f->latitude = f->longitude = NAN;
    double column = 0.5 * (t->width - 1), row = 0.5 * (t->height - 1);
    double x = w[0] + column * w[1] + row * w[2], y = w[3] + column * w[4] + row * w[5];
    double latitude = 0.0, longitude = 0.0;
    if (vd_scene_latlon_from_world(scene, x, y, &latitude, &longitude).code == VD_OK) {
        f->latitude = latitude;
        f->longitude = longitude;
    }
}

static const char *kind_name(vd_crs_kind kind) {
    return kind == VD_CRS_GEOGRAPHIC  ? "geographic (degrees)"
           : kind == VD_CRS_PROJECTED ? "projected"
                                      : "none";
}

/* The name of a CRS: the first quoted text of a WKT, a code as it is. */
static void crs_name(const vd_scene *scene, char *out, size_t out_bytes) {
    const char *crs = scene->crs != NULL ? scene->crs : "";
    const char *quote = strchr(crs, '"');
    if (quote != NULL) {
        snprintf(out, out_bytes, "%.*s", (int)strcspn(quote + 1, "\""), quote + 1);
    } else {
        snprintf(out, out_bytes, "%.100s", crs);
    }
}

static bool print_people(const facts *f) {
    char crs[128], missing[16];
    vd_write_share(f->scene->missing, (uint64_t)f->width * (uint64_t)f->height, missing);
    crs_name(f->scene, crs, sizeof crs);
    printf("file        %s\n", f->file);
    printf("format      %s\n", f->scene->format);
    printf("size        %d x %d samples, %s\n", f->width, f->height, f->scene->height_type);
    printf("unit        %s\n",
           f->scene->height_unit[0] != '\0' ? f->scene->height_unit : "not given; taken as metres");
    printf("CRS         %s%s%s\n", kind_name(f->scene->kind), crs[0] != '\0' ? ", " : "", crs);
    printf("cell size   %.6g x %.6g m\n", f->cell_x_m, f->cell_y_m);
    printf("extent      %.6g x %.6g km\n", 1e-3 * f->cell_x_m * (f->width - 1),
           1e-3 * f->cell_y_m * (f->height - 1));
    if (isfinite(f->latitude)) {
        printf("middle      %.6f,%.6f (latitude, longitude)\n", f->latitude, f->longitude);
    }
    printf("heights     %.6g to %.6g m\n", f->min, f->max);
    printf("missing     %llu samples (%s)\n", (unsigned long long)f->scene->missing, missing);
    printf("view        %s\n", f->flags);
    const char *key;
    json_t *value;
    json_object_foreach(f->text, key, value) {
        printf("%-11s %s\n", key, json_string_value(value));
    }
    return fflush(stdout) == 0 && !ferror(stdout);
}

static bool print_facts_json(const facts *f, const vd_notes *notes) {
    static const char *const kinds[] = {"none", "geographic", "projected"};
    char crs[128];
    crs_name(f->scene, crs, sizeof crs);
    json_t *root = json_pack(
        "{s: s, s: s, s: i, s: i, s: s, s: s, s: s, s: s, s: [f, f], s: f, s: f, s: I, s: f, s: O, "
        "s: s, s: O, s: O}",
        "file", f->file, "format", f->scene->format, "width", f->width, "height", f->height, "type",
        f->scene->height_type, "unit", f->scene->height_unit, "crs_kind",
        kinds[f->scene->kind < VD_CRS_KIND_COUNT ? f->scene->kind : 0], "crs", crs, "cell_size_m",
        f->cell_x_m, f->cell_y_m, "min_m", f->min, "max_m", f->max, "missing",
        (json_int_t)f->scene->missing, "missing_share",
        (double)f->scene->missing / ((double)f->width * f->height), "view", f->view, "view_flags",
        f->flags, "text", f->text, "warnings", notes->list);
    bool failed = root == NULL;
    if (isfinite(f->latitude)) {
        json_t *middle =
            json_pack("{s: f, s: f}", "latitude", f->latitude, "longitude", f->longitude);
        failed |= json_object_set_new(root, "middle", middle) != 0;
    }
    bool printed = !failed && vd_print_json(root);
    json_decref(root);
    return printed;
}

static vd_scene_def scene_def(const vd_options *options) {
    vd_scene_def def = {.inputs = (const char *const *)options->inputs,
                        .input_count = options->input_count,
                        .dem = vd_dem_def_default()};
    def.band = (int)options->values[INFO_BAND].number;
    def.dem.encoding = (vd_height_encoding)options->values[INFO_HEIGHT_ENCODING].number;
    def.dem.has_nodata = vd_options_given(options, INFO_NODATA);
    def.dem.nodata = options->values[INFO_NODATA].number;
    def.has_cell_size = vd_options_given(options, INFO_CELL_SIZE);
    def.dem.cell_size_m = options->values[INFO_CELL_SIZE].number;
    def.dem.height_scale = options->values[INFO_HEIGHT_SCALE].number;
    return def;
}

static vd_status run_info(const vd_options *options, vd_context *context, vd_notes *notes) {
    if (options->input_count == 1 &&
        vd_particle_file_probe(options->inputs[0]) != VD_PARTICLE_FILE_NONE) {
        return vd_info_particles(context, options->inputs[0],
                                 options->values[INFO_JSON].number != 0.0);
    }
    if (vd_is_model_name(options->inputs[0], NULL)) {
        return vd_info_model(context, options->inputs[0], options->values[INFO_JSON].number != 0.0,
                             notes);
    }
    vd_scene_def def = scene_def(options);
    vd_scene scene = {0};
    facts f = {.file = options->inputs[0]};
    vd_status status = vd_scene_load(context, &def, &scene);
    if (status.code != VD_OK) {
        return status;
    }
    gather(&f, &scene);
    f.text = vd_png_read_text(options->inputs[0]);
    status = suggest_view(&f);
    if (status.code == VD_OK) {
        bool printed = options->values[INFO_JSON].number != 0.0 ? print_facts_json(&f, notes)
                                                                : print_people(&f);
        if (!printed) {
            status = vd_failure(VD_ERROR_IO, "cannot write to standard output; check the pipe");
        }
    }
    json_decref(f.view);
    json_decref(f.text);
    vd_scene_finish(&scene);
    return status;
}

static void print_help(void) {
    fputs(
        "usage: veduta info [OPTIONS] FILE…\n\n"
        "Says what an elevation file holds: size, type, unit, CRS, cell size, range, missing\n"
        "samples, and the flags of a view that frames it. Of a picture that veduta wrote it also\n"
        "prints the command and the camera. Several files are taken as one terrain. Of a model it\n"
        "says how many vertices, triangles, materials and textures it has, and how large it is;\n"
        "of particles how many there are, where, and the ranges of their attributes.\n",
        stdout);
    vd_options_print_help(table, INFO_COUNT, stdout);
    fputs("\nexamples\n  veduta info dem.tif\n  veduta info N45E006.hgt --json\n"
          "  veduta info dragon.ply\n",
          stdout);
}

int vd_command_info(int argc, char **argv) {
    vd_options options;
    vd_notes notes;
    vd_context *context = NULL;
    vd_status status = vd_options_init(&options, "info", table, INFO_COUNT);
    if (status.code != VD_OK) {
        return vd_report(&status, 1);
    }
    status = vd_options_parse(&options, argc, argv);
    bool help = status.code == VD_OK && options.values[INFO_HELP].number != 0.0;
    for (int i = 0; i < options.input_count && status.code == VD_OK; i++) {
        if (options.input_count > 1 && vd_is_model_name(options.inputs[i], NULL)) {
            status = vd_failure(VD_ERROR_ARGUMENT, "%.200s is a model; name it alone",
                                options.inputs[i]);
        }
    }
    if (status.code == VD_OK && !help && options.input_count == 0) {
        status = vd_failure(VD_ERROR_ARGUMENT, "there is no file; name one, as in `veduta info "
                                               "dem.tif`");
    }
    if (help || status.code != VD_OK) {
        if (help) {
            print_help();
        }
        vd_options_finish(&options);
        return help ? 0 : vd_report(&status, status.code == VD_ERROR_ARGUMENT ? 2 : 1);
    }
    int code = 1;
    status = vd_notes_init(&notes, false);
    if (status.code == VD_OK) {
        vd_context_def def = vd_context_def_default();
        def.threads = 1;
        def.log = vd_notes_log;
        def.log_user = &notes;
        status = vd_context_create(&def, &context);
        code = status.code == VD_ERROR_ARGUMENT ? 2 : 1; /* VEDUTA_CPU is the user's */
        if (status.code == VD_OK) {
            status = run_info(&options, context, &notes);
        }
        vd_context_destroy(&context);
        vd_notes_finish(&notes);
    }
    vd_options_finish(&options);
    return status.code == VD_OK ? 0 : vd_report(&status, code);
}

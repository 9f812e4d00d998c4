/* render_particles.c: `veduta render` of particles. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "commands.h"
#include "particle_camera.h"
#include "particle_color.h"
#include "particle_file.h"
#include "particle_shade.h"
#include "render_settings.h"
#include "run.h"

/* One run. */
typedef struct particle_run {
    const vd_options *options;
    vd_particle_settings settings;
    vd_context *context;
    vd_job *job;
    vd_bricks *bricks;
    char format[64];
    vd_brick_view_def view_def;
    vd_splat_def splat_def;
    vd_colormap colormap;
    bool legend;
    const char *color_name;
    vd_camera camera;
    vd_brick_view_stats view_stats;
    vd_splat_stats splat_stats;
    double draw_seconds;
} particle_run;

/* ---- what is drawn how --------------------------------------------------------------------------
 */

/* Colours by what was asked for, else by what there is. */
static vd_status choose_color(particle_run *run) {
    const vd_bricks *b = run->bricks;
    vd_brick_view_def *d = &run->view_def;
    const char *name = run->settings.color_by;
    const bool scan = strncmp(run->format, "LAS", 3) == 0 ||
                      (vd_bricks_find(b, "class") >= 0 && vd_bricks_find(b, "mass") < 0);
    const bool added_up =
        run->settings.mode == VD_SPLAT_DENSITY ||
        (run->settings.mode < 0 && name == NULL && !scan && !vd_particle_has_colors(b));
    if (added_up) {
        d->mode = VD_SPLAT_DENSITY;
        run->color_name = "density";
        return vd_success();
    }
    const vd_status status =
        vd_particle_color(b, name, run->settings.colormap_given, d, &run->color_name);
    if (status.code != VD_OK) {
        return vd_failure(status.code, "--color-by: %.400s", status.message);
    }
    d->mode = scan || vd_particle_has_colors(b) ? VD_SPLAT_NEAREST : VD_SPLAT_ALPHA;
    return vd_success();
}

static vd_status choose_weight(particle_run *run) {
    const char *name = run->settings.weight;
    run->view_def.weight = vd_bricks_find(run->bricks, name != NULL ? name : "mass");
    if (name != NULL && strcmp(name, "count") != 0 && run->view_def.weight < 0) {
        const vd_status status = vd_particle_no_attribute(run->bricks, name);
        return vd_failure(status.code, "--weight: %.400s", status.message);
    }
    if (run->view_def.mode != VD_SPLAT_DENSITY) {
        run->view_def.weight = -1;
    }
    return vd_success();
}

static bool has_radii(const vd_bricks *b) {
    for (uint32_t a = 0; a < b->attribute_count; a++) {
        if (b->attributes[a].kind == VD_ATTRIBUTE_RADIUS) {
            return true;
        }
    }
    return false;
}

static vd_status choose_look(particle_run *run) {
    const vd_particle_settings *s = &run->settings;
    vd_brick_view_def *d = &run->view_def;
    vd_splat_def *p = &run->splat_def;
    *d = vd_brick_view_def_default();
    *p = vd_splat_def_default();
    vd_status status = choose_color(run);
    if (status.code == VD_OK && s->mode == VD_SPLAT_DENSITY && s->color_by != NULL) {
        status = vd_failure(VD_ERROR_ARGUMENT, "--mode density has the colours of what is added "
                                               "up, which --weight names; leave --color-by out");
    }
    d->mode = s->mode >= 0 ? (vd_splat_mode)s->mode : d->mode;
    if (status.code == VD_OK) {
        status = choose_weight(run);
    }
    const bool density = d->mode == VD_SPLAT_DENSITY;
    d->kernel = s->kernel >= 0                      ? (vd_splat_kernel)s->kernel
                : density && has_radii(run->bricks) ? VD_SPLAT_SPH
                : density                           ? VD_SPLAT_BOX
                                                    : VD_SPLAT_DISC;
    d->detail_px = s->detail_px > 0.0 ? s->detail_px : -1.0;
    d->radius_m = s->radius_m;
    if (d->mode == VD_SPLAT_ALPHA && s->radius_m <= 0.0 && !s->radius_scale_given) {
        /* Smoothing lengths overlap dozens of times: blended, they would be fog. */
        d->radius_m = vd_brick_view_radius(run->bricks);
    }
    d->radius_scale = s->radius_scale;
    d->opacity = s->opacity;
    const bool numbers =
        density || d->color == VD_BRICK_COLOR_VALUE || d->color == VD_BRICK_COLOR_HEIGHT;
    if (s->colormap_given) {
        run->colormap = s->colormap;
    } else if (!vd_colormap_find(density ? "magma" : "viridis", &run->colormap)) {
        return vd_failure(VD_ERROR_ARGUMENT, "there is no colour map");
    }
    vd_particle_stretch(&run->colormap);
    p->mode = d->mode;
    p->kernel = d->kernel;
    p->colormap = &run->colormap;
    p->range_min = s->range[0];
    p->range_max = s->range[1];
    p->log = s->log >= 0 ? s->log != 0 : density;
    p->background = s->background_given ? s->background : (vd_rgba8){12, 14, 18, 255};
    if (density && !s->background_given) {
        p->background = (vd_rgba8){0, 0, 0, 255};
    }
    run->legend = s->legend >= 0 ? s->legend != 0 : numbers;
    return status;
}

/* How large particles are drawn, about. */
static double drawn_radius(const particle_run *run) {
    const vd_bricks *b = run->bricks;
    const vd_brick_view_def *d = &run->view_def;
    double radius = d->mode == VD_SPLAT_DENSITY ? 0.0 : vd_brick_view_radius(b);
    for (uint32_t a = 0; a < b->attribute_count; a++) {
        radius = b->attributes[a].kind == VD_ATTRIBUTE_RADIUS ? b->attributes[a].mean : radius;
    }
    return d->radius_scale * (d->radius_m > 0.0 ? d->radius_m : radius);
}

/* ---- drawing ------------------------------------------------------------------------------------
 */

static vd_status draw(particle_run *run, vd_frame **frame) {
    const vd_particle_settings *s = &run->settings;
    vd_brick_view *view = NULL;
    vd_splatter *splatter = NULL;
    const unsigned planes = run->view_def.mode == VD_SPLAT_NEAREST ? VD_PLANE_DEPTH : 0u;
    vd_status status = vd_frame_create(run->context, s->width, s->height, planes, frame);
    if (status.code == VD_OK) {
        status = vd_brick_view_create(run->context, run->bricks, &view);
    }
    if (status.code == VD_OK) {
        status = vd_splatter_create(run->context, &splatter);
    }
    const double start = vd_seconds_now();
    if (status.code == VD_OK) {
        status = vd_brick_view_update(view, run->job, &run->view_def, &run->camera, s->width,
                                      s->height, &run->view_stats);
    }
    if (status.code == VD_OK) {
        status = vd_splatter_render(splatter, run->job, &run->splat_def, &run->camera, view->splats,
                                    view->count, *frame, &run->splat_stats);
    }
    vd_splat_def *p = &run->splat_def;
    const double floor_of_range = 1e-6 * run->splat_stats.value_max;
    if (status.code == VD_OK && p->mode == VD_SPLAT_DENSITY && p->log &&
        !(p->range_min < p->range_max) && floor_of_range > 0.0 &&
        (run->splat_stats.value_min < floor_of_range ||
         run->splat_stats.value_min >= run->splat_stats.value_max)) {
        /* The faintest rim of one kernel would take half of the colours; a single value none. */
        p->range_min = floor_of_range;
        p->range_max = run->splat_stats.value_max;
        status = vd_splatter_render(splatter, run->job, p, &run->camera, view->splats, view->count,
                                    *frame, &run->splat_stats);
    }
    if (status.code == VD_OK && planes != 0 && run->settings.shading) {
        status = vd_particle_shade(run->context, *frame, &run->camera);
    }
    run->draw_seconds = vd_seconds_now() - start;
    if (status.code == VD_OK && run->legend) {
        vd_splat_draw_legend(*frame, &run->splat_def, &run->splat_stats);
    }
    if (status.code == VD_OK &&
        (run->view_stats.nodes == 0 || run->splat_stats.outside == run->splat_stats.splats)) {
        status = vd_failure(VD_ERROR_EMPTY, "the camera sees no particles; leave --eye and "
                                            "--distance out to have all of them in the picture");
    }
    vd_splatter_destroy(&splatter);
    vd_brick_view_destroy(&view);
    return status;
}

static bool print_report(const particle_run *run, const vd_frame *frame, double seconds) {
    char hash[24];
    const vd_quat q = run->camera.orientation;
    const vd_vec3 e = run->camera.eye;
    double heading, pitch, roll;
    vd_orientation_to_angles(q, &heading, &pitch, &roll);
    snprintf(hash, sizeof hash, "%016llx", (unsigned long long)vd_frame_hash(frame));
    json_t *root = json_pack(
        "{s: s, s: i, s: i, s: f, s: f, s: s, s: s, s: s, s: s, s: I, s: I, s: I, s: I, s: [f, f], "
        "s: {s: [f, f, f], s: f, s: f}}",
        "output", run->options->values[PARTICLES_OUTPUT].text, "width", run->settings.width,
        "height", run->settings.height, "seconds", seconds, "draw_seconds", run->draw_seconds,
        "hash", hash, "mode", vd_splat_mode_name(run->view_def.mode), "kernel",
        vd_splat_kernel_name(run->view_def.kernel), "color_by", run->color_name, "particles",
        (json_int_t)run->bricks->count, "drawn", (json_int_t)run->view_stats.particles, "stand_for",
        (json_int_t)run->view_stats.stands_for, "bricks", (json_int_t)run->view_stats.nodes,
        "range", run->splat_stats.value_min, run->splat_stats.value_max, "camera", "eye", e.x, e.y,
        e.z, "heading", heading * 180.0 / 3.14159265358979323846, "pitch",
        pitch * 180.0 / 3.14159265358979323846);
    const bool printed = root != NULL && vd_print_json(root);
    json_decref(root);
    return printed;
}

static vd_status save(particle_run *run, const vd_frame *frame, const char *command) {
    const vd_option_value *v = run->options->values;
    char software[40];
    snprintf(software, sizeof software, "veduta %s", vd_version());
    const vd_picture_text text[] = {{"Software", software}, {"veduta:command", command}};
    vd_png_def png = vd_png_def_default();
    png.level = (int)v[PARTICLES_PNG_LEVEL].number;
    png.text = text;
    png.text_count = 2;
    return vd_frame_save_png(frame, v[PARTICLES_OUTPUT].text, &png);
}

static vd_status run_particles(particle_run *run, const char *command, double start) {
    const vd_options *o = run->options;
    const vd_option_value *v = o->values;
    const char *const *paths = (const char *const *)o->inputs;
    const bool quiet = v[PARTICLES_QUIET].number != 0.0;
    vd_frame *frame = NULL;
    vd_progress progress;
    vd_progress_start(&progress, run->job, quiet);
    vd_status status = vd_particle_files_bricks(
        run->context, run->job, paths, o->input_count, &run->settings.source,
        (int)v[PARTICLES_TYPE].number, &run->bricks, run->format);
    if (status.code == VD_OK) {
        status = choose_look(run);
    }
    if (status.code == VD_OK) {
        status = vd_particle_camera(run->bricks, &run->settings, drawn_radius(run), &run->camera);
    }
    if (status.code == VD_OK) {
        status = draw(run, &frame);
    }
    vd_progress_stop(&progress);
    if (status.code == VD_OK) {
        status = save(run, frame, command);
    }
    const double seconds = vd_seconds_now() - start;
    if (status.code == VD_OK && v[PARTICLES_JSON].number != 0.0 &&
        !print_report(run, frame, seconds)) {
        status = vd_failure(VD_ERROR_IO, "cannot write to standard output; check the pipe");
    }
    if (status.code == VD_OK && !quiet) {
        fprintf(stderr, "veduta: wrote %s, %dx%d, %llu of %llu particles by %s as %s, in %.2f s\n",
                v[PARTICLES_OUTPUT].text, run->settings.width, run->settings.height,
                (unsigned long long)run->view_stats.particles,
                (unsigned long long)run->view_stats.stands_for, run->color_name,
                vd_splat_mode_name(run->view_def.mode), seconds);
    }
    vd_frame_destroy(&frame);
    vd_bricks_close(&run->bricks);
    return status.code == VD_ERROR_CANCELLED
               ? vd_failure(VD_ERROR_CANCELLED, "interrupted; nothing was written")
               : status;
}

static void print_help(void) {
    fputs(
        "usage: veduta render [OPTIONS] FILE… [-o view.png]\n\n"
        "Draws particles: brick files (.vdp, made by `veduta import particles`), LAS, PLY without\n"
        "faces, CSV and other text, HDF5 snapshots. What is no brick file is sorted into one\n"
        "first, which goes with the picture.\n",
        stdout);
    vd_options_print_help(vd_particles_table, PARTICLES_COUNT, stdout);
    fputs("\nexamples\n"
          "  veduta render scan.las\n"
          "  veduta render snap.vdp --elevation 0 --range 1e-6,1e-2 -o snap.png\n"
          "  veduta render snap.vdp --color-by temperature --log --opacity 0.1\n"
          "  veduta render stars.csv --columns x,y,z,-,mag --color-by mag --colormap viridis\n",
          stdout);
}

static int start_particles(const vd_options *options, const char *command, double start) {
    vd_notes notes;
    particle_run run = {.options = options};
    vd_status status = vd_notes_init(&notes, options->values[PARTICLES_QUIET].number != 0.0);
    if (status.code != VD_OK) {
        return vd_report(&status, 1);
    }
    vd_catch_signals();
    status = vd_work_begin(&notes, (int)options->values[PARTICLES_THREADS].number, &run.context,
                           &run.job);
    if (status.code == VD_OK) {
        status = vd_particle_settings_read(run.context, options, &run.settings);
    }
    if (status.code == VD_OK) {
        status = vd_check_output("output", options->values[PARTICLES_OUTPUT].text,
                                 (const char *const *)options->inputs, options->input_count);
    }
    if (status.code == VD_OK) {
        vd_cancel_on_signal(run.job);
        status = run_particles(&run, command, start);
        vd_cancel_on_signal(NULL);
    }
    vd_work_end(&notes, &run.context, &run.job);
    return status.code == VD_OK ? 0 : vd_report(&status, status.code == VD_ERROR_ARGUMENT ? 2 : 1);
}

static bool in_table(const vd_option *table, int count, const char *name, size_t length) {
    for (int i = 0; i < count; i++) {
        if (strlen(table[i].key) == length && strncmp(table[i].key, name, length) == 0) {
            return true;
        }
    }
    return false;
}

/* An option among the arguments that worlds and models have and particles have not; null: none. */
static const char *find_other_option(int argc, char **argv) {
    for (int i = 1; i < argc; i++) {
        const char *name = argv[i] + 2;
        if (strncmp(argv[i], "--", 2) == 0 &&
            !in_table(vd_particles_table, PARTICLES_COUNT, name, strcspn(name, "=")) &&
            in_table(vd_render_table, OPTION_COUNT, name, strcspn(name, "="))) {
            return argv[i];
        }
    }
    return NULL;
}

bool vd_render_is_of_particles(int argc, char **argv) {
    for (int i = 1; i < argc; i++) {
        const bool follows_output =
            strcmp(argv[i - 1], "-o") == 0 || strcmp(argv[i - 1], "--output") == 0;
        if (argv[i][0] != '-' && !follows_output) {
            const vd_particle_file kind = vd_particle_file_probe(argv[i]);
            if (kind != VD_PARTICLE_FILE_NONE) {
                /* A PLY of points is a model too, and is drawn as one when --depth, --ids,
                 * --point-size or the like is asked for. */
                return kind != VD_PARTICLE_FILE_PLY || find_other_option(argc, argv) == NULL;
            }
        }
        /* Raw heights say their size, as in --raw 512x512:f32. */
        const char *raw = strncmp(argv[i], "--raw=", 6) == 0 ? argv[i] + 6
                          : strcmp(argv[i], "--raw") == 0    ? argv[i + 1]
                                                             : NULL;
        if (raw != NULL && strchr(raw, ':') == NULL) {
            return true;
        }
    }
    return false;
}

int vd_command_render_particles(int argc, char **argv) {
    const double start = vd_seconds_now();
    vd_options options;
    vd_status status = vd_options_init(&options, "render", vd_particles_table, PARTICLES_COUNT);
    if (status.code != VD_OK) {
        return vd_report(&status, 1);
    }
    status = vd_options_parse(&options, argc, argv);
    const char *other = status.code == VD_ERROR_ARGUMENT ? find_other_option(argc, argv) : NULL;
    if (other != NULL) {
        status = vd_failure(VD_ERROR_ARGUMENT,
                            "%.*s does not apply to particles alone; leave it out, or name a world "
                            "file that has them among its \"particles\"",
                            (int)strcspn(other, "="), other);
    }
    const bool help = status.code == VD_OK && options.values[PARTICLES_HELP].number != 0.0;
    char *command = vd_quote_command("veduta", argc, argv);
    int code = 0;
    if (help) {
        print_help();
    } else if (status.code != VD_OK) {
        code = vd_report(&status, status.code == VD_ERROR_ARGUMENT ? 2 : 1);
    } else {
        code = start_particles(&options, command != NULL ? command : "veduta render", start);
    }
    free(command);
    vd_options_finish(&options);
    return code;
}

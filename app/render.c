/* render.c: `veduta render`: options in, picture out. */
#include <stdlib.h>
#include <string.h>

#include "commands.h"
#include "render_run.h"
#include "world_file.h"

static void print_help(void) {
    fputs(
        "usage: veduta render [OPTIONS] HEIGHTS… [-o view.png]\n"
        "       veduta render [OPTIONS] MODEL [-o view.png]\n"
        "       veduta render --classic KEY=VALUE,… --height H.png --color C.png [-o view.png]\n"
        "       veduta render WORLD.json|OPTIONS.json\n\n"
        "Draws a view of elevation data: PNG, PGM, .hgt, ESRI ASCII and raw files, and with GDAL\n"
        "everything that it reads; - is standard input, for what needs neither name nor GDAL.\n"
        "Several files become one terrain. Or of a model: OBJ, PLY and OFF, and with assimp STL,\n"
        "glTF, FBX, COLLADA and others. An option may be written --name VALUE or --name=VALUE.\n"
        "Particles (.vdp, LAS, PLY without faces, text, HDF5 snapshots) have options of their "
        "own:\n"
        "veduta render FILE.las --help\n",
        stdout);
    vd_options_print_help(vd_render_table, OPTION_COUNT, stdout);
    fputs("\nexamples\n"
          "  veduta render dem.tif\n"
          "  veduta render N45E006.hgt N45E007.hgt --azimuth 200 --elevation 20 -o alps.png\n"
          "  veduta render dem.tif --color landsat.tif --bands 3,2,1 --exaggerate 2\n"
          "  veduta render dem.tif --eye 45.8786,6.8873,2m --target 45.8326,6.8652 --fov 30\n"
          "  veduta render dragon.ply -o dragon.png\n"
          "  veduta render bunny.obj --wireframe --azimuth 40 --background transparent\n"
          "  veduta render world.json --impostors --show bounds\n"
          "  veduta render heights.png --height-encoding terrarium --cell-size 30\n"
          "  veduta render dem.tif --sun 90,10 --save dawn.json; veduta render dawn.json -s "
          "640x360\n",
          stdout);
}

static bool is_options_file(const char *path) {
    size_t length = strlen(path);
    return length > 5 && strcmp(path + length - 5, ".json") == 0;
}

vd_status vd_render_read_files(vd_options *options, vd_world_content *content) {
    char **named = options->inputs;
    int count = options->input_count;
    vd_status status = vd_success();
    options->inputs = NULL;
    options->input_count = 0;
    options->input_source = VD_SOURCE_DEFAULT;
    if (options->values[OPTION_OPTIONS].text != NULL) {
        status = vd_world_file_load(options, options->values[OPTION_OPTIONS].text, content);
    }
    for (int i = 0; i < count && status.code == VD_OK; i++) {
        if (is_options_file(named[i])) {
            status = vd_world_file_load(options, named[i], content);
        }
    }
    /* Inputs of the command line replace those of the files. */
    for (int i = 0; i < count; i++) {
        if (!is_options_file(named[i]) && status.code == VD_OK) {
            status = vd_options_add_input(options, named[i], VD_SOURCE_FLAG);
        }
        free(named[i]);
    }
    free(named);
    if (status.code == VD_OK) {
        status = vd_render_prefer_flags(options);
    }
    return status.code == VD_OK ? vd_render_apply_preset(options) : status;
}

vd_status vd_render_read_options(int argc, char **argv, vd_options *options,
                                 vd_render_settings *settings, vd_world_content *content,
                                 bool *help) {
    vd_status status = vd_options_parse(options, argc, argv);
    *help = status.code == VD_OK && options->values[OPTION_HELP].number != 0.0;
    if (status.code != VD_OK || *help) {
        return status;
    }
    return vd_render_read_parsed(options, settings, content);
}

vd_status vd_render_read_parsed(vd_options *options, vd_render_settings *settings,
                                vd_world_content *content) {
    vd_status status = vd_render_read_files(options, content);
    if (status.code == VD_OK) {
        status = vd_render_settings_read(options, settings);
    }
    return vd_world_file_blame(options, content, &status);
}

bool vd_render_take_path(vd_options *options, char **path, bool *nothing) {
    const bool drawn = options->values[OPTION_FUNCTION].text != NULL ||
                       options->values[OPTION_OPTIONS].text != NULL;
    *nothing = options->input_count == 0 && !drawn;
    if (options->input_count < (drawn ? 1 : 2)) {
        return false;
    }
    *path = options->inputs[--options->input_count];
    return true;
}

vd_status vd_render_check_output(const vd_render_settings *s, const char *also, const char *option,
                                 const char *path) {
    const char *read[68] = {s->color, s->model.texture, also};
    int count = 3;
    for (int i = 0; i < s->input_count && count < 68; i++) {
        read[count++] = s->inputs[i];
    }
    return path != NULL ? vd_check_output(option, path, read, count) : vd_success();
}

/* What would be refused after a long run is refused before it. */
static vd_status check_outputs(const vd_render_settings *s, const char *save,
                               const char *save_world) {
    const struct {
        const char *option, *path;
        bool text; /* not a picture: standard output may be a terminal */
    } outputs[] = {{"output", s->dry_run ? NULL : s->output, false},
                   {"depth", s->dry_run ? NULL : s->depth, false},
                   {"ids", s->dry_run ? NULL : s->ids, false},
                   {"save", save, true},
                   {"save-world", save_world, true}};
    vd_status status = vd_success();
    for (int i = 0; i < 5 && status.code == VD_OK; i++) {
        const char *path = outputs[i].path;
        if (!outputs[i].text || path == NULL || strcmp(path, "-") != 0) {
            status = vd_render_check_output(s, NULL, outputs[i].option, path);
        }
    }
    const char *written[] = {s->output, s->depth, s->ids, save, save_world};
    for (int i = 0; i < 5 && status.code == VD_OK; i++) {
        for (int j = 0; j < i; j++) {
            if (written[i] != NULL && written[j] != NULL && vd_same_place(written[i], written[j])) {
                return vd_failure(VD_ERROR_ARGUMENT,
                                  "two results would go to %.200s; name "
                                  "different files",
                                  strcmp(written[i], "-") == 0 ? "standard output" : written[i]);
            }
        }
    }
    return status;
}

vd_status vd_render_make_frame(vd_render_run *run) {
    const vd_render_settings *s = run->settings;
    /* Impostors are tested by depth. */
    unsigned planes = (s->depth != NULL || s->impostors ? VD_PLANE_DEPTH : 0u) |
                      (s->ids != NULL ? VD_PLANE_ID : 0u);
    return vd_frame_create(run->context, s->width, s->height, planes, &run->frame);
}

size_t vd_render_frame_bytes(const vd_render_settings *s) {
    size_t pixels = vd_frame_stride(s->width) * (size_t)s->height;
    size_t planes = 1 + (s->depth != NULL) + (s->ids != NULL);
    return pixels * 4 * planes + pixels; /* the PNG is small beside it: a byte per pixel */
}

void vd_render_estimate_memory(vd_render_run *run, const vd_process_memory *loaded,
                               size_t drawing_bytes) {
    size_t drawing = loaded->now_bytes + drawing_bytes + vd_render_frame_bytes(run->settings);
    run->estimated_bytes = drawing > loaded->peak_bytes ? drawing : loaded->peak_bytes;
}

static vd_status save(vd_render_run *run, const char *command) {
    const vd_render_settings *s = run->settings;
    char software[40];
    snprintf(software, sizeof software, "veduta %s", vd_version());
    char *camera = json_dumps(run->camera, JSON_COMPACT);
    vd_picture_text text[] = {{"Software", software},
                              {"veduta:command", command},
                              {"veduta:camera", camera != NULL ? camera : "{}"}};
    vd_png_def png = vd_png_def_default();
    png.level = s->png_level;
    png.text = text;
    png.text_count = 3;
    vd_status status = vd_frame_save_png(run->frame, s->output, &png);
    if (status.code == VD_OK && s->depth != NULL) {
        status = vd_frame_save_depth(run->frame, run->near_m, run->far_m, s->depth);
    }
    if (status.code == VD_OK && s->ids != NULL) {
        status = vd_frame_save_ids(run->frame, s->ids);
    }
    free(camera);
    return status;
}

static bool report_json(const vd_render_run *run, double seconds) {
    const vd_render_settings *s = run->settings;
    vd_memory_stats memory = vd_context_memory(run->context);
    json_t *root = json_pack(
        "{s: s, s: i, s: i, s: f, s: f, s: O?, s: O*, s: O*, s: O*, s: O*, s: O}", "veduta",
        vd_version(), "width", s->width, "height", s->height, "seconds", seconds, "draw_seconds",
        run->draw_seconds, "camera", run->camera_all, "terrain", run->terrain, "model", run->model,
        "objects", run->objects, "impostors", run->impostors, "warnings", run->notes.list);
    bool failed = root == NULL;
    if (s->dry_run) {
        json_int_t bytes = (json_int_t)run->estimated_bytes;
        failed |= json_object_set_new(root, "dry_run", json_true()) != 0;
        failed |= json_object_set_new(root, "memory_bytes", json_integer(bytes)) != 0;
    } else {
        char hash[24];
        snprintf(hash, sizeof hash, "%016llx", (unsigned long long)vd_frame_hash(run->frame));
        json_int_t peak = (json_int_t)memory.bytes_peak;
        failed |= json_object_set_new(root, "output", json_string(s->output)) != 0;
        failed |= json_object_set_new(root, "hash", json_string(hash)) != 0;
        failed |= json_object_set_new(root, "memory_peak_bytes", json_integer(peak)) != 0;
        json_t *stats = json_pack("{s: I, s: I}", "samples", (json_int_t)run->stats.samples, "hits",
                                  (json_int_t)run->stats.hits);
        failed |= json_object_set_new(root, "stats", stats) != 0;
    }
    bool printed = !failed && vd_print_json(root);
    json_decref(root);
    return printed;
}

/* Says what was done: JSON or the camera on standard output, a line for people on standard error.
 */
static vd_status report(const vd_render_run *run) {
    const vd_render_settings *s = run->settings;
    double seconds = vd_seconds_now() - run->start;
    if (s->dry_run) {
        /* Writing: 25 ns a pixel, measured at level 1. */
        seconds = run->ready_seconds + run->draw_seconds + 25e-9 * s->width * s->height;
    }
    bool printed = true;
    if (s->json) {
        printed = report_json(run, seconds);
    } else if (s->print_camera) {
        printed = printf("%s\n", run->flags) > 0 && vd_print_json(run->camera);
    }
    if (s->dry_run && !s->json) {
        printed = printed &&
                  printf("%.2f seconds, %.1f MiB of memory\n", seconds,
                         (double)run->estimated_bytes / 1048576.0) > 0 &&
                  fflush(stdout) == 0;
    } else if (!s->quiet && !s->dry_run) {
        fprintf(stderr, "veduta: wrote %s, %dx%d, in %.2f s\n", s->output, s->width, s->height,
                seconds);
    }
    return printed ? vd_success()
                   : vd_failure(VD_ERROR_IO, "cannot write to standard output; check the pipe");
}

static vd_status draw_and_save(vd_render_run *run, const char *command) {
    const vd_render_settings *s = run->settings;
    vd_status status = s->classic    ? vd_render_classic(run)
                       : s->is_model ? vd_render_model(run)
                                     : vd_render_world(run);
    if (status.code == VD_OK && vd_job_stopped(run->job)) {
        status = vd_failure(VD_ERROR_CANCELLED, "cancelled");
    }
    if (status.code == VD_OK && run->frame != NULL) {
        status = save(run, command);
    }
    if (status.code == VD_OK) {
        status = report(run);
    }
    if (status.code == VD_ERROR_CANCELLED) {
        status = vd_failure(VD_ERROR_CANCELLED, "interrupted; nothing was written");
    }
    return status;
}

vd_status vd_render_notes_begin(vd_notes *notes, bool quiet, const char *note,
                                const vd_world_content *content) {
    const vd_status status = vd_notes_init(notes, quiet);
    if (status.code == VD_OK && note[0] != '\0') {
        vd_notes_log(notes, VD_LOG_WARNING, note);
    }
    for (size_t i = 0; i < content->warning_count && status.code == VD_OK; i++) {
        vd_notes_log(notes, VD_LOG_WARNING, content->warnings[i]);
    }
    return status;
}

vd_status vd_render_run_begin(vd_render_run *run, const char *note) {
    const vd_render_settings *s = run->settings;
    vd_status status = vd_render_notes_begin(&run->notes, s->quiet, note, run->content);
    if (status.code == VD_OK) {
        run->has_notes = true;
        status = vd_work_begin(&run->notes, s->threads, &run->context, &run->job);
        run->bad_use = status.code == VD_ERROR_ARGUMENT; /* VEDUTA_CPU */
        vd_cancel_on_signal(run->job);
    }
    return status;
}

int vd_render_run_end(vd_render_run *run, const vd_status *status) {
    vd_cancel_on_signal(NULL);
    const int code = status->code == VD_OK ? 0 : vd_report(status, run->bad_use ? 2 : 1);
    json_decref(run->camera);
    json_decref(run->camera_all);
    json_decref(run->terrain);
    json_decref(run->model);
    json_decref(run->objects);
    json_decref(run->impostors);
    vd_frame_destroy(&run->frame);
    if (run->has_notes) {
        vd_work_end(&run->notes, &run->context, &run->job);
    }
    return code;
}

static int run_render(const vd_render_settings *settings, const vd_world_content *content,
                      const char *command, const char *note, double start) {
    vd_render_run run = {.settings = settings, .content = content, .start = start};
    vd_status status = vd_render_run_begin(&run, note);
    if (status.code == VD_OK) {
        status = draw_and_save(&run, command);
    }
    return vd_render_run_end(&run, &status);
}

int vd_command_render(int argc, char **argv) {
    if (vd_render_is_of_particles(argc, argv)) {
        return vd_command_render_particles(argc, argv);
    }
    double start = vd_seconds_now();
    vd_options options;
    vd_render_settings settings;
    vd_world_content content = {.name = NULL};
    bool help = false;
    vd_status status = vd_options_init(&options, "render", vd_render_table, OPTION_COUNT);
    if (status.code != VD_OK) {
        return vd_report(&status, 1);
    }
    status = vd_render_read_options(argc, argv, &options, &settings, &content, &help);
    const char *saved = options.values[OPTION_SAVE].text;
    const char *saved_world = options.values[OPTION_SAVE_WORLD].text;
    if (status.code == VD_OK && !help) {
        status = check_outputs(&settings, saved, saved_world);
    }
    vd_catch_signals();
    if (status.code == VD_OK && !help && saved != NULL) {
        status = vd_options_save_json(&options, saved);
    }
    if (status.code == VD_OK && !help && saved_world != NULL) {
        status = vd_world_file_save(&options, &content, saved_world);
    }
    int code = status.code == VD_ERROR_ARGUMENT ? 2 : 1;
    char *command = vd_quote_command("veduta", argc, argv);
    if (help) {
        print_help();
        code = 0;
    } else if (status.code != VD_OK) {
        vd_report(&status, code);
    } else {
        code = run_render(&settings, &content, command != NULL ? command : "veduta render",
                          options.note, start);
    }
    free(command);
    vd_world_content_finish(&content);
    vd_options_finish(&options);
    return code;
}

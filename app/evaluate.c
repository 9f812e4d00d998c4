/* evaluate.c: `veduta evaluate`: how good impostors are, along a camera path. */
#include <stdlib.h>
#include <string.h>

#include "commands.h"
#include "evaluate.h"
#include "gnuplot.h"
#include "world_file.h"

/* One run. */
typedef struct evaluating {
    const vd_evaluate_settings *settings;
    vd_render_run run;
    vd_fly_world world;
    vd_camera_path *path;
    vd_packer packer;
    vd_evaluation evaluation;
} evaluating;

static void print_help(void) {
    fputs(
        "usage: veduta evaluate [OPTIONS] WORLD.json|HEIGHTS… PATH\n\n"
        "Moves a camera along a PATH (docs/fly.md) and measures how far what is on screen is from\n"
        "what should be, with three ways of showing a world over a slow link: impostors, whole\n"
        "screens, and impostors without reuse; and with frames that are drawn directly, in no\n"
        "time, of which all that is wrong is that a display shows 60 a second. The error of a\n"
        "frame is the root of the mean squared difference over 0.1 (Lawlor 2004, eq. 5.1).\n"
        "docs/impostors.md says more.\n",
        stdout);
    vd_evaluate_print_help();
    fputs(
        "\nexamples\n"
        "  veduta evaluate forest/forest.json data/paths/orbit.json\n"
        "  veduta evaluate forest/forest.json data/paths/walk.json --bandwidth 2M --latency 50ms\n"
        "  veduta evaluate world.json path.json -o report.json --plot error.svg --worst "
        "worst.png\n"
        "  veduta evaluate world.json path.json --virtual --json\n"
        "  veduta evaluate world.json path.json --only impostors --most-px 64 "
        "--reference-samples 8\n",
        stdout);
}

static vd_status load(evaluating *v) {
    const vd_evaluate_settings *s = v->settings;
    vd_path_notes notes;
    vd_path_clearance clearance;
    vd_status status = vd_fly_world_load(&v->run, &v->world);
    if (status.code == VD_OK) {
        status = vd_path_load(v->run.context, s->path_file, &s->path, &v->world.scene->scene,
                              vd_world_scene_ground, v->world.scene, &notes, &v->path);
    }
    if (status.code == VD_OK && notes.clearance_m > 0.0) {
        status = vd_camera_path_clear(v->path, vd_world_scene_ground, v->world.scene,
                                      notes.clearance_m, &clearance);
    }
    return status.code == VD_OK ? vd_fly_world_prepare(&v->world, v->path) : status;
}

static vd_status write_report(const evaluating *v) {
    json_t *root = vd_evaluation_json(&v->evaluation, true);
    char *text = root != NULL ? json_dumps(root, JSON_INDENT(1) | JSON_REAL_PRECISION(9)) : NULL;
    json_decref(root);
    if (text == NULL) {
        return vd_failure(VD_ERROR_MEMORY, "out of memory for the report");
    }
    const vd_status status = vd_write_text(v->settings->output, text);
    free(text);
    return status;
}

static vd_status print_result(const evaluating *v) {
    bool printed = false;
    if (v->settings->render.json) {
        json_t *root = vd_evaluation_json(&v->evaluation, false);
        printed = root != NULL && vd_print_json(root);
        json_decref(root);
    } else {
        printed = vd_evaluation_print(&v->evaluation);
    }
    return printed ? vd_success()
                   : vd_failure(VD_ERROR_IO, "cannot write to standard output; check the pipe");
}

static vd_status evaluate(evaluating *v) {
    const vd_evaluate_settings *s = v->settings;
    vd_status status = s->plot != NULL ? vd_gnuplot_find() : vd_success();
    if (status.code == VD_OK) {
        status = vd_packer_init(v->run.context, s, &v->packer);
    }
    if (status.code == VD_OK) {
        status = load(v);
    }
    if (status.code != VD_OK) {
        return status;
    }
    v->evaluation = (vd_evaluation){.settings = s,
                                    .context = v->run.context,
                                    .job = v->run.job,
                                    .world = &v->world,
                                    .path = v->path,
                                    .packer = &v->packer};
    status = vd_evaluation_run(&v->evaluation);
    if (status.code == VD_OK && s->output != NULL) {
        status = write_report(v);
    }
    if (status.code == VD_OK && s->plot != NULL) {
        status = vd_evaluation_plot(&v->evaluation, s->plot);
    }
    if (status.code == VD_OK && s->worst != NULL) {
        status = vd_frame_save_png(v->evaluation.worst, s->worst, NULL);
    }
    const bool taken = s->output != NULL && strcmp(s->output, "-") == 0;
    return status.code == VD_OK && !taken ? print_result(v) : status;
}

/* What would be refused after a long run is refused before it. */
static vd_status check_outputs(const vd_evaluate_settings *s) {
    const struct {
        const char *option, *path;
    } outputs[] = {{"output", s->output}, {"plot", s->plot}, {"worst", s->worst}};
    vd_status status = vd_success();
    for (int i = 0; i < 3 && status.code == VD_OK; i++) {
        if (outputs[i].path != NULL && strcmp(outputs[i].path, "-") != 0) {
            status = vd_render_check_output(&s->render, s->path_file, outputs[i].option,
                                            outputs[i].path);
        }
    }
    return status;
}

static int run_evaluate(const vd_evaluate_settings *settings, const vd_world_content *content,
                        const char *note) {
    evaluating v = {.settings = settings};
    v.run = (vd_render_run){.settings = &settings->render, .content = content};
    vd_status status = vd_render_run_begin(&v.run, note);
    if (status.code == VD_OK) {
        status = evaluate(&v);
        if (status.code == VD_ERROR_CANCELLED) {
            status = vd_failure(VD_ERROR_CANCELLED, "interrupted; nothing was written");
        }
    }
    vd_evaluation_finish(&v.evaluation);
    vd_packer_finish(&v.packer);
    vd_camera_path_destroy(&v.path);
    vd_fly_world_finish(&v.world);
    return vd_render_run_end(&v.run, &status);
}

/* The last of the inputs is the path; it is taken from them. */
static vd_status take_path(vd_options *options, char **path) {
    bool nothing;
    if (!vd_render_take_path(options, path, &nothing)) {
        return vd_failure(VD_ERROR_ARGUMENT, "%s, as in `veduta evaluate world.json path.json`",
                          nothing ? "there is nothing to measure; name a world and a path"
                                  : "there is no path; name one behind the world");
    }
    return vd_success();
}

static vd_status read_settings(int argc, char **argv, vd_options *options,
                               vd_world_content *content, char **path, vd_evaluate_settings *out,
                               bool *help) {
    vd_status status = vd_options_parse(options, argc, argv);
    *help = status.code == VD_OK && options->values[OPTION_HELP].number != 0.0;
    if (status.code != VD_OK || *help) {
        return status;
    }
    status = take_path(options, path);
    if (status.code == VD_OK) {
        status = vd_render_read_files(options, content);
    }
    if (status.code == VD_OK) {
        status = vd_evaluate_settings_read(options, *path, out);
    }
    if (status.code == VD_OK) {
        status = check_outputs(out);
    }
    return vd_world_file_blame(options, content, &status);
}

int vd_command_evaluate(int argc, char **argv) {
    vd_option table[EVALUATE_COUNT];
    vd_options options;
    vd_evaluate_settings settings;
    vd_world_content content = {.name = NULL};
    char *path = NULL;
    bool help = false;
    vd_evaluate_make_table(table);
    vd_status status = vd_options_init(&options, "evaluate", table, EVALUATE_COUNT);
    if (status.code != VD_OK) {
        return vd_report(&status, 1);
    }
    status = read_settings(argc, argv, &options, &content, &path, &settings, &help);
    int code = status.code == VD_ERROR_ARGUMENT ? 2 : 1;
    vd_catch_signals();
    if (help) {
        print_help();
        code = 0;
    } else if (status.code != VD_OK) {
        vd_report(&status, code);
    } else {
        code = run_evaluate(&settings, &content, options.note);
    }
    free(path);
    vd_world_content_finish(&content);
    vd_options_finish(&options);
    return code;
}

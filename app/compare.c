/* compare.c: `veduta compare`: how two pictures differ. */
#include <math.h>
#include <string.h>

#include "commands.h"
#include "options.h"
#include "run.h"

enum { COMPARE_TOLERANCE, COMPARE_DIFF, COMPARE_JSON, COMPARE_HELP, COMPARE_COUNT };

static const vd_option table[COMPARE_COUNT] = {
    [COMPARE_TOLERANCE] = {.key = "tolerance",
                           .group = "Options",
                           .type = VD_OPTION_REAL,
                           .argument = "N",
                           .max = 255,
                           .unit = "8-bit steps of one channel",
                           .fallback = "0",
                           .help = "differences up to this do not count"},
    [COMPARE_DIFF] = {.key = "diff",
                      .group = "Options",
                      .type = VD_OPTION_FILE,
                      .letter = 'd',
                      .argument = "FILE.png",
                      .help = "write the difference as a picture, eight times enlarged"},
    [COMPARE_JSON] = {.key = "json",
                      .group = "Options",
                      .type = VD_OPTION_SWITCH,
                      .letter = 'j',
                      .help = "print JSON"},
    [COMPARE_HELP] = {.key = "help",
                      .group = "Options",
                      .type = VD_OPTION_SWITCH,
                      .letter = 'h',
                      .help = "this page"},
};

static void print_help(void) {
    fputs("usage: veduta compare [OPTIONS] A B\n\n"
          "Compares two pictures of one size: root of the mean squared difference, largest\n"
          "difference of a channel, peak signal-to-noise ratio, differing pixels. Exit status 0\n"
          "when no pixel differs by more than the tolerance, 1 otherwise.\n",
          stdout);
    vd_options_print_help(table, COMPARE_COUNT, stdout);
    fputs("\nexamples\n  veduta compare a.png b.png\n"
          "  veduta compare a.png b.png --tolerance 2 --diff difference.png --json\n",
          stdout);
}

static bool print_comparison(const vd_options *options, const vd_comparison *c) {
    bool same = c->differing_pixels == 0;
    if (options->values[COMPARE_JSON].number == 0.0) {
        char psnr[32];
        snprintf(psnr, sizeof psnr, isfinite(c->psnr_db) ? "%.2f dB" : "infinite", c->psnr_db);
        printf("RMS %.4f, maximum %.6g, PSNR %s, %llu of %llu pixels differ\n", c->rms, c->maximum,
               psnr, (unsigned long long)c->differing_pixels, (unsigned long long)c->pixels);
        return fflush(stdout) == 0 && !ferror(stdout);
    }
    /* JSON has no infinity: identical pictures have the PSNR null. */
    json_t *psnr = isfinite(c->psnr_db) ? json_real(c->psnr_db) : json_null();
    json_t *root = json_pack("{s: b, s: f, s: f, s: o, s: I, s: I, s: f}", "same", (int)same, "rms",
                             c->rms, "maximum", c->maximum, "psnr_db", psnr, "differing_pixels",
                             (json_int_t)c->differing_pixels, "pixels", (json_int_t)c->pixels,
                             "tolerance", options->values[COMPARE_TOLERANCE].number);
    bool printed = vd_print_json(root);
    json_decref(root);
    return printed;
}

static vd_status run_compare(const vd_options *options, vd_context *context, bool *same) {
    const char *const *inputs = (const char *const *)options->inputs;
    const char *diff = options->values[COMPARE_DIFF].text;
    vd_picture *a = NULL, *b = NULL, *difference = NULL;
    vd_comparison comparison;
    vd_status status = diff != NULL ? vd_check_output("diff", diff, inputs, 2) : vd_success();
    if (status.code == VD_OK) {
        status = vd_picture_load(context, inputs[0], &a);
    }
    if (status.code == VD_OK) {
        status = vd_picture_load(context, inputs[1], &b);
    }
    if (status.code == VD_OK && (a->width != b->width || a->height != b->height)) {
        status = vd_failure(VD_ERROR_ARGUMENT,
                            "cannot compare %.120s (%dx%d) with %.120s (%dx%d): "
                            "the sizes differ; give two pictures of one size",
                            inputs[0], a->width, a->height, inputs[1], b->width, b->height);
    }
    if (status.code == VD_OK) {
        status = vd_picture_compare(a, b, options->values[COMPARE_TOLERANCE].number, &comparison,
                                    diff != NULL ? &difference : NULL);
    }
    if (status.code == VD_OK && diff != NULL) {
        status = vd_picture_save_png(difference, diff, NULL);
    }
    if (status.code == VD_OK) {
        *same = comparison.differing_pixels == 0;
        if (!print_comparison(options, &comparison)) {
            status = vd_failure(VD_ERROR_IO, "cannot write to standard output; check the pipe");
        }
    }
    vd_picture_destroy(&difference);
    vd_picture_destroy(&b);
    vd_picture_destroy(&a);
    return status;
}

int vd_command_compare(int argc, char **argv) {
    vd_options options;
    vd_status status = vd_options_init(&options, "compare", table, COMPARE_COUNT);
    if (status.code != VD_OK) {
        return vd_report(&status, 1);
    }
    status = vd_options_parse(&options, argc, argv);
    bool help = status.code == VD_OK && options.values[COMPARE_HELP].number != 0.0;
    if (status.code == VD_OK && !help && options.input_count != 2) {
        status = vd_failure(VD_ERROR_ARGUMENT,
                            "two pictures are compared, %d given; name two, as in `veduta "
                            "compare a.png b.png`",
                            options.input_count);
    }
    int code = 0;
    bool same = false;
    if (help) {
        print_help();
    } else if (status.code != VD_OK) {
        code = vd_report(&status, status.code == VD_ERROR_ARGUMENT ? 2 : 1);
    } else {
        vd_context *context = NULL;
        vd_context_def def = vd_context_def_default();
        def.threads = 1;
        status = vd_context_create(&def, &context);
        int failed = status.code == VD_ERROR_ARGUMENT ? 2 : 1; /* VEDUTA_CPU is the user's */
        if (status.code == VD_OK) {
            status = run_compare(&options, context, &same);
        }
        vd_context_destroy(&context);
        code = status.code != VD_OK ? vd_report(&status, failed) : same ? 0 : 1;
    }
    vd_options_finish(&options);
    return code;
}

/* generate.c: `veduta generate`: synthetic data. */
#include <string.h>

#include "commands.h"
#include "generator.h"
#include "options.h"
#include "particles_bricks.h"
#include "run.h"

enum {
    GENERATE_OUTPUT,
    GENERATE_COUNT_OF,
    GENERATE_SEED,
    GENERATE_THREADS,
    GENERATE_HELP,
    GENERATE_COUNT
};

static const vd_option table[GENERATE_COUNT] = {
    [GENERATE_OUTPUT] =
        {.key = "output",
         .group = "Options",
         .type = VD_OPTION_FILE,
         .letter = 'o',
         .argument = "FILE",
         .fallback = "particles.ply",
         .help = "where the particles go: .vdp (bricks), .ply, .csv or .raw (floats x, y, z, "
                 "radius, mass, speed); - is standard output, as text"},
    [GENERATE_COUNT_OF] = {.key = "count",
                           .group = "Options",
                           .type = VD_OPTION_INTEGER,
                           .letter = 'n',
                           .argument = "N",
                           .max = VD_SPLATS_MAX_COUNT,
                           .unit = "particles",
                           .fallback = "1000000",
                           .help = "how many"},
    [GENERATE_SEED] = {.key = "seed",
                       .group = "Options",
                       .type = VD_OPTION_INTEGER,
                       .argument = "N",
                       .max = 9007199254740992.0,
                       .fallback = "1",
                       .help =
                           "another number gives another snapshot; the same one the same bytes"},
    [GENERATE_THREADS] = {.key = "threads",
                          .group = "Options",
                          .type = VD_OPTION_INTEGER,
                          .letter = 't',
                          .argument = "N",
                          .max = 1024,
                          .unit = "threads",
                          .fallback = "0",
                          .help = "how many work at once; 0: one per processor"},
    [GENERATE_HELP] = {.key = "help",
                       .group = "Options",
                       .type = VD_OPTION_SWITCH,
                       .letter = 'h',
                       .help = "this page"},
};

static void print_help(void) {
    fputs("usage: veduta generate particles [OPTIONS]\n"
          "       veduta generate forest HEIGHTS... [OPTIONS]   (it has a --help of its own)\n\n"
          "Makes a snapshot as galaxy simulations do: Plummer spheres on the knots of a web of\n"
          "filaments, in a cube of side 1.\n",
          stdout);
    vd_options_print_help(table, GENERATE_COUNT, stdout);
    fputs("\nexamples\n  veduta generate particles -o snapshot.ply\n"
          "  veduta generate particles --count 50000000 --seed 7 -o large.raw\n",
          stdout);
}

static vd_status generate(const vd_options *options, vd_context *context) {
    const vd_option_value *v = options->values;
    vd_particles *particles = NULL;
    vd_status status = vd_particles_generate(context, NULL, (uint64_t)v[GENERATE_SEED].number,
                                             (size_t)v[GENERATE_COUNT_OF].number, &particles);
    if (status.code == VD_OK) {
        const char *path = v[GENERATE_OUTPUT].text, *dot = strrchr(path, '.');
        vd_bricks_report report;
        status = dot != NULL && strcmp(dot, ".vdp") == 0
                     ? vd_particles_to_bricks(context, NULL, particles, path, &report)
                     : vd_particles_save(particles, path);
    }
    vd_particles_destroy(&particles);
    return status;
}

static vd_status check(const vd_options *options) {
    return options->input_count == 1 && strcmp(options->inputs[0], "particles") == 0
               ? vd_success()
               : vd_failure(VD_ERROR_ARGUMENT, "say what to generate: `veduta generate particles`, "
                                               "or `veduta generate forest HEIGHTS`");
}

static const vd_generator particles = {.table = table,
                                       .count = GENERATE_COUNT,
                                       .threads = GENERATE_THREADS,
                                       .help = GENERATE_HELP,
                                       .print_help = print_help,
                                       .check = check,
                                       .generate = generate};

int vd_command_generate(int argc, char **argv) {
    const vd_generator *g =
        argc > 1 && strcmp(argv[1], "forest") == 0 ? &vd_generate_forest : &particles;
    vd_options options;
    vd_status status = vd_options_init(&options, "generate", g->table, g->count);
    if (status.code != VD_OK) {
        return vd_report(&status, 1);
    }
    status = vd_options_parse(&options, argc, argv);
    const bool help = status.code == VD_OK && options.values[g->help].number != 0.0;
    if (status.code == VD_OK && !help) {
        status = g->check(&options);
    }
    if (help) {
        g->print_help();
    } else if (status.code == VD_OK) {
        vd_context *context = NULL;
        vd_context_def def = vd_context_def_default();
        def.threads = (int)options.values[g->threads].number;
        status = vd_context_create(&def, &context);
        if (status.code == VD_OK) {
            status = g->generate(&options, context);
        }
        vd_context_destroy(&context);
    }
    const int code =
        status.code == VD_OK ? 0 : vd_report(&status, status.code == VD_ERROR_ARGUMENT ? 2 : 1);
    vd_options_finish(&options);
    return code;
}

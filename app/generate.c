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
    GENERATE_CENTER,
    GENERATE_SIZE,
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
    [GENERATE_CENTER] = {.key = "center",
                         .group = "Options",
                         .type = VD_OPTION_TEXT,
                         .argument = "X,Y,Z",
                         .unit = "metres",
                         .fallback = "0,0,0",
                         .help = "the middle of the cube, such as a place of a terrain's world"},
    [GENERATE_SIZE] = {.key = "size",
                       .group = "Options",
                       .type = VD_OPTION_DISTANCE,
                       .argument = "D",
                       .min = 1e-9,
                       .max = 1e12,
                       .unit = "metres",
                       .fallback = "1",
                       .help = "its side"},
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
          "filaments, in a cube.\n",
          stdout);
    vd_options_print_help(table, GENERATE_COUNT, stdout);
    fputs("\nexamples\n  veduta generate particles -o snapshot.ply\n"
          "  veduta generate particles --count 50000000 --seed 7 -o large.raw\n"
          "  veduta generate particles -o cloud.vdp --center -430,12640,3500 --size 2km\n",
          stdout);
}

static vd_status read_place(const vd_options *options, vd_particles_place *out) {
    double place[3];
    const char *text = options->values[GENERATE_CENTER].text;
    if (vd_read_numbers(text, place, 3) != 3) {
        return vd_failure(
            VD_ERROR_ARGUMENT,
            "--center: %.60s is no place; give x, y and z in metres, such as --center "
            "1200,-300,2000",
            text);
    }
    *out = (vd_particles_place){vd_vec3_make(place[0], place[1], place[2]),
                                options->values[GENERATE_SIZE].number};
    return vd_success();
}

static vd_status generate(const vd_options *options, vd_context *context) {
    const vd_option_value *v = options->values;
    vd_particles *particles = NULL;
    vd_particles_place place;
    vd_status status = read_place(options, &place);
    if (status.code != VD_OK) {
        return status;
    }
    status = vd_particles_generate(context, NULL, (uint64_t)v[GENERATE_SEED].number,
                                   (size_t)v[GENERATE_COUNT_OF].number, &particles);
    if (status.code == VD_OK) {
        const char *path = v[GENERATE_OUTPUT].text, *dot = strrchr(path, '.');
        vd_bricks_report report;
        if (dot != NULL && strcmp(dot, ".vdp") == 0) {
            status = vd_particles_to_bricks(context, NULL, particles, &place, path, &report);
        } else {
            vd_particles_move(particles, &place);
            status = vd_particles_save(particles, path);
        }
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

/* import.c: `veduta import`: data becomes blocks of ours. */
#include <string.h>

#include "commands.h"
#include "options.h"
#include "particle_file.h"
#include "run.h"

enum {
    IMPORT_OUTPUT,
    IMPORT_COLUMNS,
    IMPORT_RAW,
    IMPORT_BIG_ENDIAN,
    IMPORT_SKIP,
    IMPORT_TYPE,
    IMPORT_RESUME,
    IMPORT_MEMORY,
    IMPORT_BRICK,
    IMPORT_THREADS,
    IMPORT_JSON,
    IMPORT_QUIET,
    IMPORT_HELP,
    IMPORT_COUNT
};

static const vd_option table[IMPORT_COUNT] = {
    [IMPORT_OUTPUT] = {.key = "output",
                       .group = "Options",
                       .type = VD_OPTION_FILE,
                       .letter = 'o',
                       .argument = "FILE.vdp",
                       .help = "where the bricks go"},
    [IMPORT_COLUMNS] = {.key = "columns",
                        .group = "Options",
                        .type = VD_OPTION_TEXT,
                        .argument = "NAME,…",
                        .help = "names of the columns of text or raw files; x, y and z must be "
                                "among them; - passes one over"},
    [IMPORT_RAW] = {.key = "raw",
                    .group = "Options",
                    .type = VD_OPTION_TEXT,
                    .argument = "TYPE",
                    .help = "the file is raw numbers of this type: f32, f64, i8, u8, i16, u16, "
                            "i32, u32"},
    [IMPORT_BIG_ENDIAN] = {.key = "big-endian",
                           .group = "Options",
                           .type = VD_OPTION_SWITCH,
                           .help = "raw numbers begin with their highest byte"},
    [IMPORT_SKIP] = {.key = "skip",
                     .group = "Options",
                     .type = VD_OPTION_REAL,
                     .argument = "N",
                     .max = 9e15,
                     .unit = "bytes",
                     .fallback = "0",
                     .help = "what comes before raw numbers"},
    [IMPORT_TYPE] = {.key = "type",
                     .group = "Options",
                     .type = VD_OPTION_INTEGER,
                     .argument = "N",
                     .min = -1,
                     .max = 5,
                     .fallback = "-1",
                     .help = "of snapshots: PartType0 (gas) to PartType5; -1: the first there is"},
    [IMPORT_RESUME] = {.key = "resume",
                       .group = "Options",
                       .type = VD_OPTION_SWITCH,
                       .help = "keep what is sorted (FILE.vdp.part) when interrupted, and go on "
                               "from what an interrupted import kept"},
    [IMPORT_MEMORY] = {.key = "memory",
                       .group = "Options",
                       .type = VD_OPTION_INTEGER,
                       .argument = "MIB",
                       .min = 64,
                       .max = 1048576,
                       .unit = "MiB",
                       .fallback = "512",
                       .help = "about how much memory importing may take"},
    [IMPORT_BRICK] = {.key = "brick",
                      .group = "Options",
                      .type = VD_OPTION_INTEGER,
                      .argument = "N",
                      .min = 64,
                      .max = 65536,
                      .unit = "particles",
                      .fallback = "8192",
                      .help = "the most in one brick"},
    [IMPORT_THREADS] = {.key = "threads",
                        .group = "Options",
                        .type = VD_OPTION_INTEGER,
                        .letter = 't',
                        .argument = "N",
                        .max = 1024,
                        .unit = "threads",
                        .fallback = "0",
                        .help =
                            "how many sort at once; 0: one per processor; the file is the same"},
    [IMPORT_JSON] = {.key = "json",
                     .group = "Options",
                     .type = VD_OPTION_SWITCH,
                     .letter = 'j',
                     .help = "print JSON"},
    [IMPORT_QUIET] = {.key = "quiet",
                      .group = "Options",
                      .type = VD_OPTION_SWITCH,
                      .letter = 'q',
                      .help = "no progress, no notes"},
    [IMPORT_HELP] = {.key = "help",
                     .group = "Options",
                     .type = VD_OPTION_SWITCH,
                     .letter = 'h',
                     .help = "this page"},
};

static void print_help(void) {
    fputs("usage: veduta import particles [OPTIONS] FILE… -o OUT.vdp\n\n"
          "Sorts particles into bricks, which are drawn from disk however many they are: LAS, PLY\n"
          "without faces, CSV and other columns of text, raw numbers, HDF5 snapshots (Gadget,\n"
          "AREPO, SWIFT). Several files become one. Particles whose position is NaN or infinite\n"
          "are left out and counted. Needs about as much disk as the particles take, beside the\n"
          "output, until it is done.\n",
          stdout);
    vd_options_print_help(table, IMPORT_COUNT, stdout);
    fputs("\nexamples\n"
          "  veduta import particles scan.las -o scan.vdp\n"
          "  veduta import particles snap_099.*.hdf5 -o snap.vdp --resume\n"
          "  veduta import particles stars.txt --columns x,y,z,-,mass -o stars.vdp\n"
          "  veduta import particles points.f32 --raw f32 --columns x,y,z,mass -o points.vdp\n",
          stdout);
}

static bool print_report(const vd_bricks_report *r, const char *output, double seconds) {
    const double each = r->count > 0 ? (double)r->file_bytes / (double)r->count : 0.0;
    json_t *root = json_pack(
        "{s: s, s: I, s: I, s: I, s: I, s: I, s: I, s: f, s: f, s: I}", "output", output,
        "particles", (json_int_t)r->count, "skipped", (json_int_t)r->skipped, "missing_values",
        (json_int_t)r->missing_values, "resumed", (json_int_t)r->resumed, "bricks",
        (json_int_t)r->bricks, "file_bytes", (json_int_t)r->file_bytes, "bytes_per_particle", each,
        "seconds", seconds, "memory_peak_bytes", (json_int_t)vd_process_memory_now().peak_bytes);
    const bool printed = root != NULL && vd_print_json(root);
    json_decref(root);
    return printed;
}

static void say_report(const vd_bricks_report *r, const char *output, double seconds) {
    if (r->skipped > 0) {
        fprintf(stderr,
                "veduta: note: %llu particles were left out: their positions are NaN or infinite\n",
                (unsigned long long)r->skipped);
    }
    if (r->missing_values > 0) {
        fprintf(stderr,
                "veduta: note: %llu values are no numbers; the smallest of their kind stands for "
                "them\n",
                (unsigned long long)r->missing_values);
    }
    fprintf(stderr,
            "veduta: wrote %s: %llu particles in %llu bricks, %.2f bytes each, in %.2f s, %.0f "
            "MiB of memory\n",
            output, (unsigned long long)r->count, (unsigned long long)r->bricks,
            (double)r->file_bytes / (double)r->count, seconds,
            (double)vd_process_memory_now().peak_bytes / 1048576.0);
}

static vd_status run_import(const vd_options *options, vd_context *context, vd_job *job,
                            double start) {
    const vd_option_value *v = options->values;
    const char *const *paths = (const char *const *)options->inputs + 1;
    const int count = options->input_count - 1;
    const bool quiet = v[IMPORT_QUIET].number != 0.0;
    vd_particle_source_def source_def = vd_particle_source_def_default();
    source_def.columns = v[IMPORT_COLUMNS].text;
    source_def.raw = v[IMPORT_RAW].text;
    source_def.raw_big_endian = v[IMPORT_BIG_ENDIAN].number != 0.0;
    source_def.raw_offset_bytes = (uint64_t)v[IMPORT_SKIP].number;
    vd_bricks_def def = vd_bricks_def_default();
    def.memory_bytes = (size_t)v[IMPORT_MEMORY].number << 20;
    def.leaf_particles = (uint32_t)v[IMPORT_BRICK].number;
    def.resume = v[IMPORT_RESUME].number != 0.0;
    vd_particle_source **sources = NULL;
    vd_bricks_report report = {0};
    const char *output = v[IMPORT_OUTPUT].text;
    vd_status status = vd_check_output("output", output, paths, count);
    if (status.code == VD_OK) {
        status = vd_particle_files_open(context, paths, count, &source_def,
                                        (int)v[IMPORT_TYPE].number, &sources);
    }
    if (status.code == VD_OK) {
        vd_progress progress;
        vd_progress_start(&progress, job, quiet);
        status = vd_bricks_import(context, job, sources, count, &def, output, &report);
        vd_progress_stop(&progress);
    }
    vd_particle_files_close(context, &sources, count);
    if (status.code == VD_ERROR_CANCELLED) {
        status =
            vd_failure(VD_ERROR_CANCELLED, "interrupted; %s",
                       def.resume ? "what is sorted was kept for --resume" : "nothing was written");
    }
    if (status.code != VD_OK) {
        return status;
    }
    const double seconds = vd_seconds_now() - start;
    if (!quiet) {
        say_report(&report, output, seconds);
    }
    return v[IMPORT_JSON].number == 0.0 || print_report(&report, output, seconds)
               ? vd_success()
               : vd_failure(VD_ERROR_IO, "cannot write to standard output; check the pipe");
}

static vd_status check_use(const vd_options *options) {
    if (options->input_count == 0 || strcmp(options->inputs[0], "particles") != 0) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "say what to import, as in `veduta import particles scan.las -o "
                          "scan.vdp`; particles are all there is yet");
    }
    if (options->input_count == 1) {
        return vd_failure(VD_ERROR_ARGUMENT, "there is no file to import; name one, as in `veduta "
                                             "import particles scan.las -o scan.vdp`");
    }
    if (options->values[IMPORT_OUTPUT].text == NULL) {
        return vd_failure(VD_ERROR_ARGUMENT, "say where the bricks go, as in -o scan.vdp");
    }
    if (strcmp(options->values[IMPORT_OUTPUT].text, "-") == 0) {
        return vd_failure(VD_ERROR_ARGUMENT, "bricks are written to a file, not to standard "
                                             "output; name one, as in -o scan.vdp");
    }
    return vd_success();
}

static int start_import(const vd_options *options) {
    const double start = vd_seconds_now();
    vd_notes notes;
    vd_context *context = NULL;
    vd_job *job = NULL;
    vd_status status = vd_notes_init(&notes, options->values[IMPORT_QUIET].number != 0.0);
    if (status.code != VD_OK) {
        return vd_report(&status, 1);
    }
    vd_catch_signals();
    status = vd_work_begin(&notes, (int)options->values[IMPORT_THREADS].number, &context, &job);
    if (status.code == VD_OK) {
        vd_cancel_on_signal(job);
        status = run_import(options, context, job, start);
        vd_cancel_on_signal(NULL);
    }
    vd_work_end(&notes, &context, &job);
    return status.code == VD_OK ? 0 : vd_report(&status, status.code == VD_ERROR_ARGUMENT ? 2 : 1);
}

int vd_command_import(int argc, char **argv) {
    vd_options options;
    vd_status status = vd_options_init(&options, "import", table, IMPORT_COUNT);
    if (status.code != VD_OK) {
        return vd_report(&status, 1);
    }
    status = vd_options_parse(&options, argc, argv);
    const bool help = status.code == VD_OK && options.values[IMPORT_HELP].number != 0.0;
    if (status.code == VD_OK && !help) {
        status = check_use(&options);
    }
    int code = 0;
    if (help) {
        print_help();
    } else if (status.code != VD_OK) {
        code = vd_report(&status, status.code == VD_ERROR_ARGUMENT ? 2 : 1);
    } else {
        code = start_import(&options);
    }
    vd_options_finish(&options);
    return code;
}

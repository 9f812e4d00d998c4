/* evaluate_settings.c: the option table of `veduta evaluate` and what it means. */
#include <math.h>
#include <string.h>

#include "evaluate.h"
#include "fly_settings.h"

#define MEASURE "Measure"
#define DISPLAYED "Impostors and link"

/* The words of --codec, in this order. */
#define CODECS "raw|auto|runs|runs-zstd|png|jpeg|webp|webp-lossless"

static const struct {
    const char *name;
    vd_codec codec;
} codecs[] = {{"raw", VD_CODEC_RAW},   {"auto", VD_CODEC_AUTO},
              {"runs", VD_CODEC_RUNS}, {"runs-zstd", VD_CODEC_RUNS_ZSTD},
              {"png", VD_CODEC_PNG},   {"jpeg", VD_CODEC_JPEG},
              {"webp", VD_CODEC_WEBP}, {"webp-lossless", VD_CODEC_WEBP_LOSSLESS}};

const char *vd_evaluate_codec_name(vd_codec codec) {
    size_t i = 0;
    while (codecs[i].codec != codec) {
        i++;
    }
    return codecs[i].name;
}

/* Of a virtual clock, what a second of drawing makes. */
#define VIRTUAL_PIXELS_PER_S 4e6

static const vd_option own[EVALUATE_COUNT - OPTION_COUNT] = {
    [EVALUATE_TOLERANCE -
     OPTION_COUNT] = {.key = "tolerance",
                      .group = DISPLAYED,
                      .type = VD_OPTION_REAL,
                      .argument = "PX",
                      .min = 0,
                      .max = 1000,
                      .unit = "pixels",
                      .fallback = "1",
                      .help = "how wrong a picture may become before it is drawn anew; 0: always"},
    [EVALUATE_BUDGET -
        OPTION_COUNT] = {.key = "budget",
                         .group = DISPLAYED,
                         .type = VD_OPTION_TEXT,
                         .argument = "T",
                         .unit = "seconds, or with ending: 5ms",
                         .fallback = "5ms",
                         .help = "how long pictures are drawn for every frame that is shown"},
    [EVALUATE_MEMORY - OPTION_COUNT] = {.key = "memory",
                                        .group = DISPLAYED,
                                        .type = VD_OPTION_TEXT,
                                        .argument = "B",
                                        .unit = "bytes, or with ending: 64M",
                                        .fallback = "268435456",
                                        .help = "what pictures may take"},
    [EVALUATE_MOST_PX -
        OPTION_COUNT] = {.key = "most-px",
                         .group = DISPLAYED,
                         .type = VD_OPTION_REAL,
                         .argument = "N",
                         .min = 8,
                         .max = 65535,
                         .unit = "pixels",
                         .fallback = "192",
                         .help = "side of a picture; what is larger on screen is shown in parts"},
    [EVALUATE_LEAST_REUSE -
        OPTION_COUNT] = {.key = "least-reuse",
                         .group = DISPLAYED,
                         .type = VD_OPTION_REAL,
                         .argument = "N",
                         .max = 1e6,
                         .unit = "frames",
                         .fallback = "4",
                         .help = "what would last shorter is shown in parts, or drawn itself"},
    [EVALUATE_FADE - OPTION_COUNT] = {.key = "fade",
                                      .group = DISPLAYED,
                                      .type = VD_OPTION_TEXT,
                                      .argument = "T",
                                      .unit = "seconds, or with ending: 100ms",
                                      .fallback = "0",
                                      .help = "over which a new picture takes the place of an old "
                                              "one; 0: at once"},
    [EVALUATE_BANDWIDTH - OPTION_COUNT] =
        {.key = "bandwidth",
         .group = DISPLAYED,
         .type = VD_OPTION_TEXT,
         .argument = "B",
         .unit = "bytes a second, or with ending: 10M",
         .fallback = "10M",
         .help = "of the simulated link that pictures and whole screens come over; 0: no link"},
    [EVALUATE_LATENCY - OPTION_COUNT] = {.key = "latency",
                                         .group = DISPLAYED,
                                         .type = VD_OPTION_TEXT,
                                         .argument = "T",
                                         .unit = "seconds, or with ending: 20ms",
                                         .fallback = "0",
                                         .help = "how long what was sent takes to arrive"},
    [EVALUATE_CODEC - OPTION_COUNT] = {.key = "codec",
                                       .group = DISPLAYED,
                                       .type = VD_OPTION_CHOICE,
                                       .argument = CODECS,
                                       .fallback = "raw",
                                       .help = "how pictures and screens are packed for the link; "
                                               "auto: as a server would"},
    [EVALUATE_QUALITY - OPTION_COUNT] = {.key = "quality",
                                         .group = DISPLAYED,
                                         .type = VD_OPTION_INTEGER,
                                         .argument = "N",
                                         .min = 1,
                                         .max = 100,
                                         .fallback = "85",
                                         .help = "of JPEG and WebP"},

    [EVALUATE_RATE - OPTION_COUNT] = {.key = "rate",
                                      .group = MEASURE,
                                      .type = VD_OPTION_REAL,
                                      .argument = "HZ",
                                      .min = 0.1,
                                      .max = 10000,
                                      .unit = "a second",
                                      .fallback = "100",
                                      .help = "viewpoints of the stream"},
    [EVALUATE_SECONDS - OPTION_COUNT] = {.key = "seconds",
                                         .group = MEASURE,
                                         .type = VD_OPTION_REAL,
                                         .argument = "S",
                                         .min = 0.1,
                                         .max = 86400,
                                         .unit = "seconds",
                                         .help = "how long; by default as long as the path"},
    [EVALUATE_COMPARE -
        OPTION_COUNT] = {.key = "compare",
                         .group = MEASURE,
                         .type = VD_OPTION_REAL,
                         .argument = "HZ",
                         .min = 0.1,
                         .max = 1000,
                         .unit = "a second",
                         .fallback = "10",
                         .help = "how often what is on screen is compared with the perfect frame"},
    [EVALUATE_ONLY - OPTION_COUNT] = {.key = "only",
                                      .group = MEASURE,
                                      .type = VD_OPTION_CHOICE,
                                      .argument = "impostors|screen|no-reuse|direct",
                                      .help = "run one of the four, and say null of the others"},
    [EVALUATE_REFERENCE_SAMPLES -
        OPTION_COUNT] = {.key = "reference-samples",
                         .group = MEASURE,
                         .type = VD_OPTION_CHOICE,
                         .argument = "1|4|8",
                         .unit = "per pixel",
                         .help = "of the perfect frames; by default as many as --samples"},
    [EVALUATE_VIRTUAL - OPTION_COUNT] =
        {.key = "virtual",
         .group = MEASURE,
         .type = VD_OPTION_SWITCH,
         .help = "a virtual clock: 60 frames a second, drawing takes no time but --budget is kept "
                 "as 4 million pixels of pictures a second; the same result on every machine"},
    [EVALUATE_ONE_MACHINE - OPTION_COUNT] =
        {.key = "one-machine",
         .group = MEASURE,
         .type = VD_OPTION_SWITCH,
         .help = "frames wait for the drawing of pictures, as when both ends of the link are one "
                 "machine; not given, the far end draws while this one shows"},
    [EVALUATE_OUTPUT - OPTION_COUNT] =
        {.key = "output",
         .group = MEASURE,
         .type = VD_OPTION_FILE,
         .letter = 'o',
         .argument = "FILE.json",
         .transient = true,
         .help = "the result, with the error of every comparison; - is standard output"},
    [EVALUATE_PLOT - OPTION_COUNT] = {.key = "plot",
                                      .group = MEASURE,
                                      .type = VD_OPTION_FILE,
                                      .argument = "FILE.svg",
                                      .transient = true,
                                      .help = "the error over time, drawn by gnuplot"},
    [EVALUATE_WORST -
        OPTION_COUNT] = {.key = "worst",
                         .group = MEASURE,
                         .type = VD_OPTION_FILE,
                         .argument = "FILE.png",
                         .transient = true,
                         .help = "the frame of impostors (or of --only) whose error was greatest"},
};

static bool left_out(int option) {
    return (option < OPTION_COUNT && vd_fly_leaves_out(option)) || option == OPTION_DRY_RUN ||
           option == OPTION_SAVE_WORLD || option == OPTION_PNG_LEVEL;
}

void vd_evaluate_make_table(vd_option table[EVALUATE_COUNT]) {
    for (int i = 0; i < EVALUATE_COUNT; i++) {
        table[i] = i < OPTION_COUNT ? vd_render_table[i] : own[i - OPTION_COUNT];
        const bool taken = i == OPTION_OUTPUT || i == OPTION_PITCH || i == OPTION_DRY_RUN ||
                           i == OPTION_SAVE_WORLD || i == OPTION_PNG_LEVEL ||
                           i == OPTION_IMPOSTORS || i == OPTION_TOLERANCE || i == OPTION_SHOW;
        if (taken) {
            table[i].key = " "; /* a name that no one can give; its default stays */
            table[i].letter = 0;
        }
    }
    table[OPTION_SIZE].fallback = "1280x720";
    table[OPTION_FOV].fallback = NULL;
    table[OPTION_FOV].help = "field of view, top to bottom, where the path says none; by default "
                             "50, of an orbit 40";
    table[OPTION_NEAR].help = "nothing nearer is drawn";
    table[OPTION_ALLOW_EMPTY].help = "also in the dark, the sun below the horizon";
}

void vd_evaluate_print_help(void) {
    vd_option table[EVALUATE_COUNT], shown[EVALUATE_COUNT];
    vd_evaluate_make_table(table);
    int count = 0;
    for (int pass = 0; pass < 2; pass++) { /* its own first */
        for (int i = pass == 0 ? OPTION_COUNT : 0; i < (pass == 0 ? EVALUATE_COUNT : OPTION_COUNT);
             i++) {
            if (!left_out(i)) {
                shown[count] = table[i];
                if (strncmp(shown[count].group, "Camera", 6) == 0) {
                    shown[count].group = MEASURE;
                }
                count++;
            }
        }
    }
    vd_options_print_help(shown, count, stdout);
}

static vd_status read_impostors(const vd_options *options, vd_evaluate_settings *out) {
    vd_impostor_def def = vd_impostor_def_default();
    double bytes = 0.0;
    def.tolerance_px = options->values[EVALUATE_TOLERANCE].number;
    def.samples = out->render.samples;
    def.most_px = options->values[EVALUATE_MOST_PX].number;
    def.least_reuse = options->values[EVALUATE_LEAST_REUSE].number;
    vd_status status = vd_option_seconds(options, EVALUATE_BUDGET, 1e-6, 1e6, &def.budget_s);
    if (status.code == VD_OK) {
        status = vd_option_seconds(options, EVALUATE_LATENCY, 0.0, 60.0, &def.link_latency_s);
    }
    if (status.code == VD_OK) {
        status = vd_option_seconds(options, EVALUATE_FADE, 0.0, 60.0, &def.fade_s);
    }
    if (status.code == VD_OK) {
        status = vd_option_bytes(options, EVALUATE_BANDWIDTH, 0.0, 1e15, &def.link_bytes_per_s);
    }
    if (status.code == VD_OK && def.link_bytes_per_s > 0.0 && def.link_bytes_per_s < 1.0) {
        status = vd_failure(VD_ERROR_ARGUMENT,
                            "--bandwidth: a link of %g bytes a second brings "
                            "nothing; give 1 or more, or 0 for no link",
                            def.link_bytes_per_s);
    }
    if (status.code == VD_OK) {
        status = vd_option_bytes(options, EVALUATE_MEMORY, 1048576.0, 1e15, &bytes);
    }
    def.memory_bytes = (size_t)bytes;
    def.remote = def.link_bytes_per_s > 0.0 && !out->is_virtual &&
                 options->values[EVALUATE_ONE_MACHINE].number == 0.0;
    if (out->is_virtual) {
        const double pixels = def.budget_s * VIRTUAL_PIXELS_PER_S;
        def.budget_pixels = pixels > 1.0 ? (size_t)pixels : 1;
        def.budget_s = 1e9;
    }
    out->codec = codecs[(int)options->values[EVALUATE_CODEC].number].codec;
    out->quality = (int)options->values[EVALUATE_QUALITY].number;
    out->impostors = def;
    return status;
}

/* Which programs run, and what they are compared with. */
static void read_programs(const vd_options *options, vd_evaluate_settings *out) {
    static const int samples[] = {1, 4, 8};
    const bool one = vd_options_given(options, EVALUATE_ONLY);
    out->first = one ? (vd_evaluated)options->values[EVALUATE_ONLY].number : VD_EVALUATED_IMPOSTORS;
    out->last = one ? out->first : VD_EVALUATED_DIRECT;
    out->reference_samples = vd_options_given(options, EVALUATE_REFERENCE_SAMPLES)
                                 ? samples[(int)options->values[EVALUATE_REFERENCE_SAMPLES].number]
                                 : out->render.samples;
}

vd_status vd_evaluate_settings_read(const vd_options *options, const char *path_file,
                                    vd_evaluate_settings *out) {
    *out = (vd_evaluate_settings){.path_file = path_file, .path = vd_path_settings_default()};
    vd_status status = vd_fly_refuse(options);
    if (status.code == VD_OK) {
        status = vd_render_settings_read(options, &out->render);
    }
    if (status.code == VD_OK && out->render.is_model) {
        status = vd_failure(VD_ERROR_ARGUMENT,
                            "%.160s is a model; `veduta evaluate` takes a world file, or elevation "
                            "data",
                            out->render.inputs[0]);
    }
    if (status.code != VD_OK) {
        return status;
    }
    out->path.fov =
        vd_options_given(options, OPTION_FOV) ? options->values[OPTION_FOV].number : (double)NAN;
    out->path.near_m = options->values[OPTION_NEAR].number;
    out->path.exaggeration = out->render.exaggeration;
    out->output = options->values[EVALUATE_OUTPUT].text;
    out->plot = options->values[EVALUATE_PLOT].text;
    out->worst = options->values[EVALUATE_WORST].text;
    out->rate_hz = options->values[EVALUATE_RATE].number;
    out->compare_hz = options->values[EVALUATE_COMPARE].number;
    out->seconds = vd_options_given(options, EVALUATE_SECONDS)
                       ? options->values[EVALUATE_SECONDS].number
                       : 0.0;
    read_programs(options, out);
    out->is_virtual = options->values[EVALUATE_VIRTUAL].number != 0.0;
    const char *const pictures[] = {out->worst, ".png"}, *const plots[] = {out->plot, ".svg"};
    const char *const *const named[] = {pictures, plots};
    for (int i = 0; i < 2; i++) {
        if (named[i][0] != NULL && !vd_ends_with(named[i][0], named[i][1])) {
            return vd_failure(VD_ERROR_ARGUMENT, "--%s: %.160s does not end in %s",
                              i == 0 ? "worst" : "plot", named[i][0], named[i][1]);
        }
    }
    return read_impostors(options, out);
}

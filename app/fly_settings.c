/* fly_settings.c: the option table of `veduta fly` and what it means. */
#include "fly_settings.h"

#include <math.h>
#include <string.h>
#include <sys/stat.h>

#define FLIGHT "Flight"
#define TRACK "Track: a way over the ground"
#define RUN "This run"

static const vd_option own[FLY_COUNT - OPTION_COUNT] = {
    [FLY_OUTPUT - OPTION_COUNT] =
        {.key = "output",
         .group = FLIGHT,
         .type = VD_OPTION_FILE,
         .letter = 'o',
         .argument = "FILE",
         .fallback = "fly.mp4",
         .help = "where it goes: .mp4 (H.264), .webm (VP9) or .gif, through the ffmpeg program, or "
                 "numbered pictures: frame-{:05}.png; with --preview a map, .png"},
    [FLY_FPS - OPTION_COUNT] = {.key = "fps",
                                .group = FLIGHT,
                                .type = VD_OPTION_REAL,
                                .argument = "N",
                                .min = 0.01,
                                .max = 1000,
                                .unit = "frames per second",
                                .fallback = "30",
                                .help = "frame rate"},
    [FLY_DURATION -
        OPTION_COUNT] = {.key = "duration",
                         .group = FLIGHT,
                         .type = VD_OPTION_REAL,
                         .argument = "S",
                         .min = 0.001,
                         .max = 1e6,
                         .unit = "seconds",
                         .help =
                             "how long the flight takes; the path's own times are stretched to it"},
    [FLY_QUALITY - OPTION_COUNT] =
        {.key = "quality",
         .group = FLIGHT,
         .type = VD_OPTION_INTEGER,
         .argument = "Q",
         .min = 1,
         .max = 100,
         .fallback = "75",
         .help = "of the video: 1 smallest, 100 best (H.264: crf 40 to 14; VP9: 56 to 16; GIF: 16 "
                 "to 256 colours)"},
    [FLY_FRAMES - OPTION_COUNT] =
        {.key = "frames",
         .group = FLIGHT,
         .type = VD_OPTION_FILE,
         .argument = "FOLDER|NAME",
         .help = "beside the video keep every frame as a picture: in a folder, or by a name such "
                 "as shots/{:05}.png; --resume then makes the video again without drawing"},
    [FLY_RESUME - OPTION_COUNT] =
        {.key = "resume",
         .group = FLIGHT,
         .type = VD_OPTION_SWITCH,
         .transient = true,
         .help = "take the pictures that are there already, of the same look, camera and size"},
    [FLY_ORBIT - OPTION_COUNT] = {.key = "orbit",
                                  .group = FLIGHT,
                                  .type = VD_OPTION_SWITCH,
                                  .help = "once around all of it; no PATH is named then"},
    [FLY_CLEARANCE - OPTION_COUNT] =
        {.key = "clearance",
         .group = FLIGHT,
         .type = VD_OPTION_DISTANCE,
         .argument = "D",
         .min = 0,
         .max = 1e9,
         .unit = "metres",
         .help = "the path is lifted, softly, where it comes nearer to the ground; 0: as it is; "
                 "by default 10, or half of a lower track's height"},

    [FLY_SPEED - OPTION_COUNT] = {.key = "speed",
                                  .group = TRACK,
                                  .type = VD_OPTION_REAL,
                                  .argument = "V",
                                  .min = 1e-6,
                                  .max = 1e9,
                                  .unit = "metres per second",
                                  .help = "of the flight, unless --duration says it; also of "
                                          "keyframes without times; by default 40"},
    [FLY_ABOVE - OPTION_COUNT] = {.key = "above",
                                  .group = TRACK,
                                  .type = VD_OPTION_DISTANCE,
                                  .argument = "D",
                                  .min = -1e6,
                                  .max = 1e9,
                                  .unit = "metres",
                                  .help = "how high above the ground; by default 100"},
    [FLY_AHEAD - OPTION_COUNT] = {.key = "look-ahead",
                                  .group = TRACK,
                                  .type = VD_OPTION_REAL,
                                  .argument = "S",
                                  .min = 0.001,
                                  .max = 1e6,
                                  .unit = "seconds",
                                  .help = "the camera looks where it will be then; by default 4"},
    [FLY_SMOOTH -
        OPTION_COUNT] = {.key = "smooth",
                         .group = TRACK,
                         .type = VD_OPTION_REAL,
                         .argument = "S",
                         .min = 0,
                         .max = 1e6,
                         .unit = "seconds",
                         .help = "over how long corners and bumps are smoothed; by default 1.5"},
    [FLY_PITCH - OPTION_COUNT] = {.key = "pitch",
                                  .group = TRACK,
                                  .type = VD_OPTION_REAL,
                                  .argument = "A",
                                  .min = -90,
                                  .max = 90,
                                  .unit = "degrees",
                                  .help = "of the view: -90 is straight down; by default -10"},

    [FLY_PREVIEW - OPTION_COUNT] =
        {.key = "preview",
         .group = RUN,
         .type = VD_OPTION_SWITCH,
         .transient = true,
         .help = "only say how long the path is and how near it comes to the ground, and with -o "
                 "map.png draw it on a map"},
    [FLY_PROGRESS -
        OPTION_COUNT] = {.key = "progress",
                         .group = RUN,
                         .type = VD_OPTION_CHOICE,
                         .argument = "auto|json|off",
                         .transient = true,
                         .fallback = "auto",
                         .help = "auto: a line on a terminal; json: lines on standard output"},
    [FLY_IN_FLIGHT - OPTION_COUNT] =
        {.key = "in-flight",
         .group = RUN,
         .type = VD_OPTION_INTEGER,
         .argument = "N",
         .min = 1,
         .max = 16,
         .unit = "frames",
         .transient = true,
         .fallback = "3",
         .help = "how many frames are drawn or encoded at once; 1: one after the other"},
};

/* Options of `render` whose words mean another thing here, or nothing. */
static const int hidden[] = {OPTION_OUTPUT, OPTION_PITCH};
static const int refused[] = {
    OPTION_DEPTH,    OPTION_IDS,          OPTION_AZIMUTH,      OPTION_ELEVATION,
    OPTION_DISTANCE, OPTION_EYE,          OPTION_TARGET,       OPTION_HEADING,
    OPTION_ROLL,     OPTION_PROJECTION,   OPTION_PRINT_CAMERA, OPTION_CLASSIC,
    OPTION_HEIGHT,   OPTION_SHADE,        OPTION_TEXTURE,      OPTION_WIREFRAME,
    OPTION_POINTS,   OPTION_SHOW_NORMALS, OPTION_LINE_WIDTH,   OPTION_POINT_SIZE,
    OPTION_CULL,     OPTION_WINDING,      OPTION_UP,           OPTION_FAR,
    OPTION_RASTER,   OPTION_SAVE,         OPTION_IMPOSTORS,    OPTION_TOLERANCE,
    OPTION_SHOW};

static bool is_among(int option, const int *list, size_t count) {
    for (size_t i = 0; i < count; i++) {
        if (list[i] == option) {
            return true;
        }
    }
    return false;
}

void vd_fly_make_table(vd_option table[FLY_COUNT]) {
    for (int i = 0; i < FLY_COUNT; i++) {
        table[i] = i < OPTION_COUNT ? vd_render_table[i] : own[i - OPTION_COUNT];
        if (is_among(i, hidden, sizeof hidden / sizeof hidden[0])) {
            table[i].key = " "; /* a name that no one can give; its default stays */
            table[i].letter = 0;
        }
    }
    table[OPTION_DRY_RUN].help =
        "only say how many frames, seconds, megabytes and how much memory it would take";
    table[OPTION_FOV].fallback = NULL;
    table[OPTION_FOV].help = "field of view, top to bottom, where the path says none; by default "
                             "50, of an orbit 40";
    table[OPTION_NEAR].help = "nothing nearer is drawn";
    table[OPTION_ALLOW_EMPTY].help = "fly also in the dark, the sun below the horizon";
}

void vd_fly_print_help(void) {
    vd_option table[FLY_COUNT], shown[FLY_COUNT];
    vd_fly_make_table(table);
    int count = 0;
    for (int pass = 0; pass < 2; pass++) { /* its own first */
        for (int i = pass == 0 ? OPTION_COUNT : 0; i < (pass == 0 ? FLY_COUNT : OPTION_COUNT);
             i++) {
            if (!vd_fly_leaves_out(i)) {
                shown[count] = table[i];
                if (strncmp(shown[count].group, "Camera", 6) == 0) {
                    shown[count].group = FLIGHT;
                }
                count++;
            }
        }
    }
    vd_options_print_help(shown, count, stdout);
}

bool vd_fly_leaves_out(int option) {
    return is_among(option, hidden, sizeof hidden / sizeof hidden[0]) ||
           is_among(option, refused, sizeof refused / sizeof refused[0]);
}

vd_status vd_fly_refuse(const vd_options *options) {
    for (size_t i = 0; i < sizeof refused / sizeof refused[0]; i++) {
        /* A world's own camera is for its pictures, and no mistake here. */
        if (options->values[refused[i]].source > VD_SOURCE_FILE) {
            const bool camera = strncmp(options->table[refused[i]].group, "Camera", 6) == 0;
            return vd_failure(VD_ERROR_ARGUMENT, "--%s belongs to `veduta render`; %s",
                              options->table[refused[i]].key,
                              camera ? "here the path says where the camera is" : "leave it out");
        }
    }
    return vd_success();
}

static double number_or_nan(const vd_options *options, int index) {
    return vd_options_given(options, index) ? options->values[index].number : (double)NAN;
}

/* A number that changes with everything that the pictures' look follows from (FNV-1a). */
static void find_look(const vd_options *options, int inputs, char out[24]) {
    uint64_t hash = 0xcbf29ce484222325u;
    for (int i = 0; i < OPTION_COUNT + inputs; i++) {
        const bool option = i < OPTION_COUNT;
        if (option && (options->table[i].transient || i == OPTION_THREADS ||
                       i == OPTION_PNG_LEVEL || i == OPTION_OPTIONS || i == OPTION_PRESET)) {
            continue;
        }
        char text[512] = "";
        struct stat info;
        if (option) {
            snprintf(text, sizeof text, "%s",
                     options->values[i].text != NULL ? options->values[i].text : "");
        } else if (stat(options->inputs[i - OPTION_COUNT], &info) == 0) {
            snprintf(text, sizeof text, "%lld %lld", (long long)info.st_size,
                     (long long)info.st_mtime);
        }
        for (const char *c = text;; c++) {
            hash = (hash ^ (unsigned char)*c) * 0x100000001b3u;
            if (*c == '\0') {
                break;
            }
        }
    }
    snprintf(out, 24, "%016llx", (unsigned long long)hash);
}

static vd_status read_flight(const vd_options *options, vd_fly_settings *out) {
    out->output = options->values[FLY_OUTPUT].text;
    out->resume = options->values[FLY_RESUME].number != 0.0;
    out->preview = options->values[FLY_PREVIEW].number != 0.0;
    out->progress = (vd_fly_progress)options->values[FLY_PROGRESS].number;
    out->in_flight = (int)options->values[FLY_IN_FLIGHT].number;
    out->video = (vd_video_def){.path = out->output,
                                .width = out->render.width,
                                .height = out->render.height,
                                .fps = options->values[FLY_FPS].number,
                                .quality = (int)options->values[FLY_QUALITY].number};
    vd_path_settings path = vd_path_settings_default();
    path.duration_s = number_or_nan(options, FLY_DURATION);
    path.speed_mps = number_or_nan(options, FLY_SPEED);
    path.height_m = number_or_nan(options, FLY_ABOVE);
    path.look_ahead_s = number_or_nan(options, FLY_AHEAD);
    path.smooth_s = number_or_nan(options, FLY_SMOOTH);
    path.pitch = number_or_nan(options, FLY_PITCH);
    path.fov = number_or_nan(options, OPTION_FOV);
    path.clearance_m = number_or_nan(options, FLY_CLEARANCE);
    path.near_m = options->values[OPTION_NEAR].number;
    path.exaggeration = out->render.exaggeration;
    out->path = path;
    if (out->preview) {
        out->output = vd_options_given(options, FLY_OUTPUT) ? out->output : NULL;
        return out->output == NULL || vd_ends_with(out->output, ".png")
                   ? vd_success()
                   : vd_failure(VD_ERROR_ARGUMENT,
                                "--output: the map of --preview is a PNG, and %.160s does not end "
                                "in .png",
                                out->output);
    }
    vd_status status = vd_video_kind_of("output", out->output, &out->video.kind);
    if (status.code == VD_OK) {
        status = vd_video_check(&out->video);
    }
    return status;
}

/* Where the pictures go: those of --frames, or the output itself. */
static vd_status read_frames(const vd_options *options, vd_fly_settings *out) {
    const char *frames = options->values[FLY_FRAMES].text;
    const bool pictures = !out->preview && out->video.kind == VD_VIDEO_FRAMES;
    if (frames != NULL && pictures) {
        return vd_failure(VD_ERROR_ARGUMENT, "--frames: the output is pictures already; leave it "
                                             "out");
    }
    out->frames = pictures ? out->output : frames;
    if (frames != NULL && !vd_ends_with(frames, ".png")) {
        struct stat info;
        if (stat(frames, &info) != 0 || !S_ISDIR(info.st_mode)) {
            return vd_failure(VD_ERROR_ARGUMENT,
                              "--frames: %.160s is neither a folder nor a name with a number, such "
                              "as shots/{:05}.png; make the folder first",
                              frames);
        }
        snprintf(out->pattern, sizeof out->pattern, "%s/frame-{:05}.png", frames);
        out->frames = out->pattern;
    } else if (frames != NULL) {
        vd_video_kind kind;
        vd_status status = vd_video_kind_of("frames", frames, &kind);
        if (status.code != VD_OK) {
            return status;
        }
    }
    if (out->resume && !out->preview && out->frames == NULL) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "--resume: a video cannot be continued, its pictures can; give --frames "
                          "FOLDER, now and in the run before, or write numbered pictures");
    }
    return vd_success();
}

vd_status vd_fly_settings_read(vd_options *options, const char *path_file, vd_fly_settings *out) {
    *out = (vd_fly_settings){.path_file = path_file};
    vd_status status = vd_fly_refuse(options);
    if (status.code == VD_OK) {
        status = vd_render_settings_read(options, &out->render);
    }
    if (status.code == VD_OK && out->render.is_model) {
        status = vd_failure(VD_ERROR_ARGUMENT,
                            "%.160s is a model; `veduta fly` takes elevation data, or a world file "
                            "with models in it",
                            out->render.inputs[0]);
    }
    if (status.code == VD_OK) {
        find_look(options, options->input_count, out->look);
        status = read_flight(options, out);
    }
    if (status.code == VD_OK) {
        status = read_frames(options, out);
    }
    return status;
}

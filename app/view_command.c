/* view_command.c: `veduta view`: the options of `veduta render`, and a window in place of a file.
 */
#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "commands.h"
#include "render_run.h"
#include "window.h"

enum {
    VIEW_JOIN = OPTION_COUNT,
    VIEW_FULL_SCREEN,
    VIEW_BUDGET,
    VIEW_FRAMES,
    VIEW_CONNECT,
    VIEW_INSECURE,
    VIEW_MEMORY,
    VIEW_COUNT
};

#define WINDOW "Window"
#define IMPOSTORS "Impostors"
#define SERVER "Server"

static const vd_option own[VIEW_COUNT - OPTION_COUNT] = {
    {.key = "join",
     .group = WINDOW,
     .type = VD_OPTION_SWITCH,
     .help = "all files together are one world, as with `veduta render`; else each is one, and the "
             "keys 1 to 9 switch"},
    {.key = "full-screen",
     .group = WINDOW,
     .type = VD_OPTION_SWITCH,
     .help = "begin with a window as large as the screen (F11)"},
    {.key = "budget",
     .group = IMPOSTORS,
     .type = VD_OPTION_TEXT,
     .argument = "T",
     .unit = "seconds, or with ending: 5ms",
     .fallback = "5ms",
     .help = "how long pictures are drawn for every frame that is shown"},
    {.key = "frames",
     .group = WINDOW,
     .type = VD_OPTION_INTEGER,
     .argument = "N",
     .max = 1e9,
     .unit = "pictures",
     .fallback = "0",
     .help = "draw without pause, end after so many and say how long they took; 0: until closed"},
    {.key = "connect",
     .group = SERVER,
     .type = VD_OPTION_TEXT,
     .argument = "URL",
     .transient = true,
     .help = "show the world of a server: the line that `veduta serve` printed, with its token"},
    {.key = "insecure",
     .group = SERVER,
     .type = VD_OPTION_SWITCH,
     .transient = true,
     .help = "take any certificate of an https server, such as one that it made itself"},
    {.key = "memory",
     .group = SERVER,
     .type = VD_OPTION_TEXT,
     .argument = "B",
     .unit = "bytes, or with ending: 64M",
     .fallback = "64M",
     .help = "most that the server's pictures take here"},
};

/* Options of `veduta render` that say nothing about a window. */
static bool is_for_window(int option) {
    return option != OPTION_OUTPUT && option != OPTION_DEPTH && option != OPTION_IDS &&
           option != OPTION_PROJECTION && option != OPTION_PRINT_CAMERA &&
           option != OPTION_CLASSIC && option != OPTION_HEIGHT && option != OPTION_SAVE &&
           option != OPTION_DRY_RUN && option != OPTION_ALLOW_EMPTY && option != OPTION_JSON &&
           !(option >= OPTION_SHADE && option <= OPTION_RASTER);
}

static void make_table(vd_option table[VIEW_COUNT]) {
    memcpy(table, vd_render_table, sizeof vd_render_table);
    memcpy(table + OPTION_COUNT, own, sizeof own);
    table[OPTION_SIZE].fallback = "1280x720";
    table[OPTION_SIZE].help = "width and height of the window at first";
    table[OPTION_IMPOSTORS].group = table[OPTION_TOLERANCE].group = IMPOSTORS;
    table[OPTION_SHOW].group = IMPOSTORS;
    table[OPTION_IMPOSTORS].help = "while the camera moves pictures stand in for things as long as "
                                   "they are right (docs/impostors.md)";
    table[OPTION_SHOW].help = "what lies over each at first: where it is, how old or how wrong (V)";
}

static void print_help(const vd_option *table) {
    vd_option shown[VIEW_COUNT];
    int count = 0;
    for (int i = OPTION_COUNT; i < VIEW_COUNT; i++) {
        shown[count++] = table[i];
    }
    for (int i = 0; i < OPTION_COUNT; i++) {
        if (is_for_window(i)) {
            shown[count++] = table[i];
        }
    }
    fputs("usage: veduta view [OPTIONS] HEIGHTS…|WORLD.json\n"
          "       veduta view --connect URL\n\n"
          "Opens a window to fly through elevation data or a world: what `veduta render` reads. H\n"
          "in the window lists its keys. With --connect the world is a server's (`veduta serve`):\n"
          "its pictures are shown here.\n",
          stdout);
    vd_options_print_help(shown, count, stdout);
    fputs("\nexamples\n"
          "  veduta view dem.tif\n"
          "  veduta view world.json\n"
          "  veduta view before.tif after.tif --color landsat.tif\n"
          "  veduta view --join N45E006.hgt N45E007.hgt --sun 90,10\n"
          "  veduta view --connect 'http://127.0.0.1:8080/#token=5c1b9e'\n",
          stdout);
}

/* A world file is one world, of however many elevation files. */
static bool joins(const vd_options *options, const vd_world_content *content) {
    return options->values[VIEW_JOIN].number != 0.0 || content->name != NULL;
}

/* What can be refused before a window is there. */
static vd_status check(const vd_options *options, const vd_render_settings *settings,
                       const vd_world_content *content) {
    for (int i = 0; i < OPTION_COUNT; i++) {
        if (!is_for_window(i) && i != OPTION_ALLOW_EMPTY && vd_options_given(options, i)) {
            return vd_failure(VD_ERROR_ARGUMENT,
                              "--%s does not apply to a window; leave it out, or give it to "
                              "`veduta render`",
                              options->table[i].key);
        }
    }
    if (!joins(options, content) && settings->input_count > 9) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "%d worlds are more than the keys 1 to 9 switch between; name fewer, or "
                          "add --join",
                          settings->input_count);
    }
    if (settings->is_model) {
        return vd_failure(VD_ERROR_UNSUPPORTED,
                          "%.200s is a model, which the window does not show; draw it with "
                          "`veduta render`",
                          settings->inputs[0]);
    }
    for (int i = 0; i < settings->input_count; i++) {
        const char *input = settings->inputs[i];
        /* GDAL's own names, such as /vsizip/…, are no files. */
        if (strncmp(input, "/vsi", 4) != 0 && strchr(input, ':') == NULL &&
            strcmp(input, "-") != 0 && access(input, R_OK) != 0) {
            return vd_failure(VD_ERROR_IO, "cannot read %.200s: %s; check the name", input,
                              strerror(errno));
        }
    }
    return vd_success();
}

/* Of a server's world only what the window itself does is asked for here. */
static vd_status read_connection(vd_options *options, vd_render_settings *settings) {
    static const int elsewhere[] = {OPTION_FUNCTION, OPTION_OPTIONS, OPTION_IMPOSTORS,
                                    OPTION_SHOW,     VIEW_JOIN,      VIEW_BUDGET};
    if (options->input_count > 0) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "--connect shows the world of a server; leave out %.200s",
                          options->inputs[0]);
    }
    for (size_t i = 0; i < sizeof elsewhere / sizeof elsewhere[0]; i++) {
        if (vd_options_given(options, elsewhere[i])) {
            return vd_failure(VD_ERROR_ARGUMENT,
                              "--%s does not apply to the world of a server; leave it out",
                              options->table[elsewhere[i]].key);
        }
    }
    options->world = true; /* there is something to be seen, though no file was named */
    options->values[OPTION_IMPOSTORS].number = 1.0; /* so --tolerance means something */
    return vd_render_settings_read(options, settings);
}

static vd_status read_options(int argc, char **argv, vd_options *options,
                              vd_render_settings *settings, vd_world_content *content, bool *help) {
    vd_status status = vd_options_parse(options, argc, argv);
    *help = status.code == VD_OK && options->values[OPTION_HELP].number != 0.0;
    if (status.code != VD_OK || *help) {
        return status;
    }
    if (options->values[VIEW_CONNECT].text != NULL) {
        return read_connection(options, settings);
    }
    if (vd_options_given(options, VIEW_INSECURE) || vd_options_given(options, VIEW_MEMORY)) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "--insecure and --memory are about a server; add --connect, or leave "
                          "them out");
    }
    return vd_render_read_parsed(options, settings, content);
}

/* How impostors are shown; the window itself draws the picture of a camera that rests. */
static vd_status read_impostors(const vd_options *options, const vd_render_settings *settings,
                                vd_impostor_def *out) {
    *out = vd_impostor_def_default();
    out->tolerance_px = settings->tolerance_px;
    out->samples = settings->samples;
    out->show = settings->show;
    out->settle = false;
    out->background = true;
    out->background_threads = settings->threads > 0 ? (settings->threads + 1) / 2 : 0;
    if (!settings->impostors && vd_options_given(options, VIEW_BUDGET)) {
        return vd_failure(VD_ERROR_ARGUMENT, "--budget is about impostors, and there are none; add "
                                             "--impostors, or leave it out");
    }
    return vd_option_seconds(options, VIEW_BUDGET, 1e-6, 1e6, &out->budget_s);
}

static vd_status run(vd_options *options, const vd_render_settings *settings,
                     const vd_world_content *content, const vd_impostor_def *impostors) {
    vd_notes notes;
    const bool connect = options->values[VIEW_CONNECT].text != NULL;
    vd_window_remote remote = {.url = options->values[VIEW_CONNECT].text,
                               .insecure = options->values[VIEW_INSECURE].number != 0.0};
    vd_status status = vd_option_bytes(options, VIEW_MEMORY, 4194304.0, 1e12, &remote.memory_bytes);
    if (status.code != VD_OK) {
        return status;
    }
    status = vd_render_notes_begin(&notes, settings->quiet, options->note, content);
    if (status.code != VD_OK) {
        return status;
    }
    const vd_window_def def = {.options = options,
                               .impostors = settings->impostors && !connect ? impostors : NULL,
                               .remote = connect ? &remote : NULL,
                               .settings = *settings,
                               .content = content,
                               .join = joins(options, content),
                               .full_screen = options->values[VIEW_FULL_SCREEN].number != 0.0,
                               .frames = (int)options->values[VIEW_FRAMES].number,
                               .notes = &notes};
    status = vd_window_run(&def);
    vd_notes_finish(&notes);
    return status;
}

int vd_command_view(int argc, char **argv) {
    vd_option table[VIEW_COUNT];
    vd_options options;
    vd_render_settings settings;
    vd_world_content content = {.name = NULL};
    bool help = false;
    make_table(table);
    vd_status status = vd_options_init(&options, "view", table, VIEW_COUNT);
    if (status.code != VD_OK) {
        return vd_report(&status, 1);
    }
    status = read_options(argc, argv, &options, &settings, &content, &help);
    vd_impostor_def impostors;
    if (status.code == VD_OK && !help) {
        status = read_impostors(&options, &settings, &impostors);
    }
    if (status.code == VD_OK && !help) {
        status = check(&options, &settings, &content);
    }
    int code = status.code == VD_ERROR_ARGUMENT ? 2 : 1;
    if (help) {
        print_help(table);
    } else if (status.code == VD_OK) {
        status = run(&options, &settings, &content, &impostors);
        code = status.code == VD_ERROR_ARGUMENT ? 2 : 1;
    }
    code = status.code == VD_OK ? 0 : vd_report(&status, code);
    vd_world_content_finish(&content);
    vd_options_finish(&options);
    return code;
}

/* main.c: the veduta program: finds the subcommand and runs it. */
#include <stdio.h>
#include <string.h>
#include <veduta/context.h>

#include "commands.h"
#include "options.h"

typedef struct command {
    const char *name;
    const char *help;
    int (*run)(int argc, char **argv);
} command;

static const command commands[] = {
    {"render", "a picture of elevation data, a model, or particles", vd_command_render},
    {"fly", "a video along a camera path over elevation data", vd_command_fly},
    {"view", "a window to fly through elevation data", vd_command_view},
    {"serve", "a world for browsers at the far end of a link", vd_command_serve},
    {"import", "data into blocks of ours: particles into bricks", vd_command_import},
    {"info", "what a file of elevations, a model or particles holds", vd_command_info},
    {"evaluate", "how good impostors are along a camera path", vd_command_evaluate},
    {"compare", "how two pictures differ", vd_command_compare},
    {"replay", "what a server and a client said to each other", vd_command_replay},
    {"generate", "synthetic data for trying things out", vd_command_generate},
    {"bench", "measured tables", vd_command_bench},
};
enum { COMMAND_COUNT = sizeof commands / sizeof commands[0] };

static void print_help(FILE *out) {
    fputs("veduta: views of large outdoor worlds, drawn on the CPU\n\n"
          "usage: veduta COMMAND [OPTIONS] FILE…\n\ncommands\n",
          out);
    for (int i = 0; i < COMMAND_COUNT; i++) {
        fprintf(out, "  %-10s %s\n", commands[i].name, commands[i].help);
    }
    fputs("\noptions\n"
          "  -h, --help       this page; `veduta COMMAND --help` for a command's options\n"
          "  -V, --version    the version\n\n"
          "examples\n"
          "  veduta render dem.tif -o view.png\n"
          "  veduta render N45E006.hgt N45E007.hgt --sun 270,20 --shadows on -o evening.png\n"
          "  veduta render dragon.ply -o dragon.png\n"
          "  veduta fly dem.tif --orbit -o orbit.mp4\n"
          "  veduta info dem.tif\n\n"
          "exit status: 0 done, 1 failed (bad data), 2 bad use\n",
          out);
}

static const command *find_command(const char *name) {
    for (int i = 0; i < COMMAND_COUNT; i++) {
        if (strcmp(name, commands[i].name) == 0) {
            return &commands[i];
        }
    }
    return NULL;
}

static int unknown_command(const char *name) {
    const char *names[COMMAND_COUNT + 1];
    for (int i = 0; i < COMMAND_COUNT; i++) {
        names[i] = commands[i].name;
    }
    names[COMMAND_COUNT] = "help";
    const char *nearest = vd_nearest_name(name, names, COMMAND_COUNT + 1);
    if (nearest != NULL) {
        fprintf(stderr, "veduta: there is no command \"%s\"; did you mean \"%s\"?\n", name,
                nearest);
    } else {
        fprintf(stderr, "veduta: there is no command \"%s\"; `veduta --help` lists them\n", name);
    }
    return 2;
}

/* `veduta help [COMMAND]`. */
static int help(int argc, char **argv) {
    if (argc < 2) {
        print_help(stdout);
        return 0;
    }
    const command *found = find_command(argv[1]);
    if (found == NULL) {
        return unknown_command(argv[1]);
    }
    char option[] = "--help";
    char *arguments[] = {argv[1], option, NULL};
    return found->run(2, arguments);
}

int main(int argc, char **argv) {
    if (argc < 2) {
        print_help(stderr);
        return 2;
    }
    const char *name = argv[1];
    if (strcmp(name, "--version") == 0 || strcmp(name, "-V") == 0) {
        printf("veduta %s\n", vd_version());
        return 0;
    }
    if (strcmp(name, "--help") == 0 || strcmp(name, "-h") == 0) {
        print_help(stdout);
        return 0;
    }
    if (strcmp(name, "help") == 0) {
        return help(argc - 1, argv + 1);
    }
    if (name[0] == '-') {
        fprintf(stderr,
                "veduta: the command comes first, as in `veduta render %s …`; "
                "`veduta --help` lists the commands\n",
                name);
        return 2;
    }
    const command *found = find_command(name);
    return found != NULL ? found->run(argc - 1, argv + 1) : unknown_command(name);
}

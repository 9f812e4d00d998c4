/* commands.h: the subcommands of the program. Each takes its own argument vector, argv[0] being the
 * subcommand's name, and returns the exit status: 0 done, 1 failed (bad data), 2 bad use. */
#ifndef VEDUTA_APP_COMMANDS_H
#define VEDUTA_APP_COMMANDS_H

#include <stdbool.h>

int vd_command_render(int argc, char **argv);
/* `veduta render` of particles has options of its own: one of its inputs is a file of particles. */
bool vd_render_is_of_particles(int argc, char **argv);
int vd_command_render_particles(int argc, char **argv);
int vd_command_fly(int argc, char **argv);
int vd_command_evaluate(int argc, char **argv);
int vd_command_view(int argc, char **argv);
int vd_command_serve(int argc, char **argv);
int vd_command_replay(int argc, char **argv);
int vd_command_import(int argc, char **argv);
int vd_command_info(int argc, char **argv);
int vd_command_compare(int argc, char **argv);
int vd_command_generate(int argc, char **argv);
int vd_command_bench(int argc, char **argv);

#endif

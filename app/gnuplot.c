/* gnuplot.c: runs gnuplot.
 *
 * The script goes to gnuplot through a temporary file as its standard input, and its standard
 * output is the picture: no path has to be quoted, and a gnuplot that ends early breaks no pipe.
 */
#include "gnuplot.h"

#include <errno.h>
#include <fcntl.h>
#include <spawn.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

#define NO_GNUPLOT "--plot needs gnuplot, which is not installed (Debian: gnuplot-nox)"

extern char **environ;

/* Runs gnuplot; `script` < 0: only --version. Standard output goes to `out`. */
static vd_status run_gnuplot(int script, const char *out) {
    char program[] = "gnuplot", version[] = "--version";
    char *arguments[] = {program, script < 0 ? version : NULL, NULL};
    posix_spawn_file_actions_t actions;
    pid_t child = 0;
    int error = posix_spawn_file_actions_init(&actions);
    if (error == 0) {
        error = posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, out,
                                                 O_WRONLY | O_CREAT | O_TRUNC, 0666);
        if (error == 0 && script >= 0) {
            error = posix_spawn_file_actions_adddup2(&actions, script, STDIN_FILENO);
        }
        if (error == 0) {
            error = posix_spawnp(&child, program, &actions, NULL, arguments, environ);
        }
        posix_spawn_file_actions_destroy(&actions);
    }
    if (error == ENOENT) {
        return vd_failure(VD_ERROR_UNSUPPORTED, NO_GNUPLOT);
    }
    if (error != 0) {
        return vd_failure(VD_ERROR_IO, "cannot start gnuplot: %s", strerror(error));
    }
    int state = 0;
    if (waitpid(child, &state, 0) != child || !WIFEXITED(state) || WEXITSTATUS(state) != 0) {
        return WIFEXITED(state) && WEXITSTATUS(state) == 127
                   ? vd_failure(VD_ERROR_UNSUPPORTED, NO_GNUPLOT)
                   : vd_failure(VD_ERROR_IO, "gnuplot did not end well");
    }
    return vd_success();
}

vd_status vd_gnuplot_find(void) {
    return run_gnuplot(-1, "/dev/null");
}

vd_status vd_gnuplot_draw(FILE *script, const char *path) {
    char part[4200];
    if (snprintf(part, sizeof part, "%s.part", path) >= (int)sizeof part) {
        return vd_failure(VD_ERROR_ARGUMENT, "--plot: the path is too long");
    }
    vd_status status = vd_success();
    if (fflush(script) != 0 || fseek(script, 0, SEEK_SET) != 0) {
        status = vd_failure(VD_ERROR_IO, "cannot write a temporary file for gnuplot: %s",
                            strerror(errno));
    }
    if (status.code == VD_OK) {
        status = run_gnuplot(fileno(script), part);
    }
    if (status.code == VD_OK && rename(part, path) != 0) {
        status = vd_failure(VD_ERROR_IO, "cannot write %.200s: %s", path, strerror(errno));
    }
    if (status.code != VD_OK) {
        unlink(part);
    }
    return status;
}

/* app_support.h: the program from outside, by lines of the shell. */
#ifndef VEDUTA_TEST_APP_SUPPORT_H
#define VEDUTA_TEST_APP_SUPPORT_H

#include "support.h"

#include <stdio.h>
#include <sys/wait.h>

#ifndef APP_LIMIT_S
#define APP_LIMIT_S 300 /* of a run */
#endif

/* What the last run printed. */
static char out[1 << 16], err[1 << 13];

static inline void read_back(const char *path, char *to, size_t bytes) {
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    to[fread(to, 1, bytes - 1, file)] = '\0';
    (void)fclose(file);
}

/* Runs `veduta ARGUMENTS` under a time limit; returns the exit status. */
static inline int run(const char *environment, const char *arguments) {
    char command[4096];
    (void)snprintf(command, sizeof command, "%s timeout %d '%s/veduta' %s >out.txt 2>err.txt",
                   environment, APP_LIMIT_S, VEDUTA_BINARY_DIR, arguments);
    const int status = system(command);
    read_back("out.txt", out, sizeof out);
    read_back("err.txt", err, sizeof err);
    assert_true(WIFEXITED(status));
    return WEXITSTATUS(status);
}

static inline void write_file(const char *name, const char *text) {
    FILE *file = fopen(name, "wb");
    assert_non_null(file);
    assert_true(fputs(text, file) >= 0);
    assert_int_equal(fclose(file), 0);
}

#endif

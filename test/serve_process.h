/* serve_process.h: `veduta serve` as a process of a test's. */
#ifndef VEDUTA_TEST_SERVE_PROCESS_H
#define VEDUTA_TEST_SERVE_PROCESS_H

#include <fcntl.h>
#include <signal.h>
#include <time.h>
#include <unistd.h>
#include "app_support.h"

typedef struct serve_process {
    pid_t id;
    int port;
    char token[300];
} serve_process;

/* Starts it in the current folder, where server.txt gets what it complains of, and waits for its
 * address. */
static inline void serve_start(serve_process *server, const char *options) {
    char command[1024], line[512] = "";
    (void)snprintf(command, sizeof command, "exec '%s/veduta' serve -q %s", VEDUTA_BINARY_DIR,
                   options);
    int ends[2];
    assert_int_equal(pipe(ends), 0);
    server->id = fork();
    assert_true(server->id >= 0);
    if (server->id == 0) {
        const int errors = open("server.txt", O_WRONLY | O_CREAT | O_TRUNC, 0600);
        (void)dup2(ends[1], 1);
        (void)dup2(errors, 2);
        (void)close(ends[0]);
        (void)close(ends[1]);
        execl("/bin/sh", "sh", "-c", command, (char *)NULL);
        _exit(127);
    }
    (void)close(ends[1]);
    FILE *from = fdopen(ends[0], "r");
    if (fgets(line, sizeof line, from) == NULL) {
        read_back("server.txt", err, sizeof err);
        fail_msg("no address: %s", err);
    }
    (void)fclose(from);
    const char *colon = strrchr(line, ':'), *hash = strstr(line, "/#token=");
    assert_non_null(hash);
    server->port = atoi(colon + 1);
    assert_int_equal(sscanf(hash, "/#token=%299s", server->token), 1);
}

/* Ends it by a signal; returns its exit status. */
static inline int serve_stop(const serve_process *server, int signal_number) {
    int status = 0;
    assert_int_equal(kill(server->id, signal_number), 0);
    for (int i = 0; i < 1000 && waitpid(server->id, &status, WNOHANG) == 0; i++) {
        nanosleep(&(struct timespec){0, 10000000}, NULL);
    }
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

#endif

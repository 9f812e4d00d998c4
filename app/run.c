/* run.c: notes, progress, interruption, output checks. */
#include "run.h"

#include <errno.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

int vd_report(const vd_status *status, int code) {
    fprintf(stderr, "veduta: %s\n", status->message);
    return code;
}

double vd_seconds_now(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

double vd_processor_seconds_now(void) {
    struct timespec spent;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &spent);
    return (double)spent.tv_sec + 1e-9 * (double)spent.tv_nsec;
}

vd_process_memory vd_process_memory_now(void) {
    vd_process_memory memory = {0};
    struct rusage usage;
    if (getrusage(RUSAGE_SELF, &usage) == 0) {
        memory.peak_bytes = (size_t)usage.ru_maxrss * 1024;
    }
    unsigned long long pages = 0;
    FILE *file = fopen("/proc/self/statm", "r");
    if (file == NULL || fscanf(file, "%*u %llu", &pages) != 1) {
        pages = 0;
    }
    if (file != NULL) {
        fclose(file);
    }
    long page_bytes = sysconf(_SC_PAGESIZE);
    memory.now_bytes =
        pages > 0 && page_bytes > 0 ? (size_t)pages * (size_t)page_bytes : memory.peak_bytes;
    return memory;
}

/* ---- notes ------------------------------------------------------------------------------------
 */

vd_status vd_notes_init(vd_notes *notes, bool quiet) {
    *notes = (vd_notes){.quiet = quiet, .list = json_array()};
    if (notes->list == NULL || pthread_mutex_init(&notes->lock, NULL) != 0) {
        json_decref(notes->list);
        return vd_failure(VD_ERROR_MEMORY, "out of memory at the start");
    }
    return vd_success();
}

void vd_notes_finish(vd_notes *notes) {
    json_decref(notes->list);
    pthread_mutex_destroy(&notes->lock);
}

vd_status vd_work_begin(vd_notes *notes, int threads, vd_context **context, vd_job **job) {
    vd_context_def def = vd_context_def_default();
    def.threads = threads;
    def.log = vd_notes_log;
    def.log_user = notes;
    *job = NULL;
    vd_status status = vd_context_create(&def, context);
    if (status.code == VD_OK) {
        status = vd_job_create(*context, job);
        if (status.code != VD_OK) {
            vd_context_destroy(context);
        }
    } else {
        *context = NULL;
    }
    return status;
}

void vd_work_end(vd_notes *notes, vd_context **context, vd_job **job) {
    vd_job_destroy(job);
    vd_context_destroy(context);
    vd_notes_finish(notes);
}

void vd_notes_log(void *user, vd_log_level level, const char *sentence) {
    vd_notes *notes = user;
    if (level == VD_LOG_DEBUG) {
        return;
    }
    pthread_mutex_lock(&notes->lock);
    json_array_append_new(notes->list, json_string(sentence));
    if (!notes->quiet) {
        fprintf(stderr, "veduta: note: %s\n", sentence);
    }
    pthread_mutex_unlock(&notes->lock);
}

/* ---- interruption -----------------------------------------------------------------------------
 */

/* A signal handler reaches nothing but globals; vd_job_cancel is async-signal-safe. The kernel may
 * run the handler on a thread of the pool, so volatile is not enough: these are atomic. */
static vd_job *_Atomic signalled_job;
static atomic_bool signalled;

static void on_signal(int number) {
    (void)number;
    signalled = true;
    vd_job *job = signalled_job;
    if (job != NULL) {
        vd_job_cancel(job);
    }
}

void vd_catch_signals(void) {
    struct sigaction action = {.sa_handler = on_signal, .sa_flags = (int)SA_RESETHAND};
    struct sigaction ignore = {.sa_handler = SIG_IGN};
    sigemptyset(&action.sa_mask);
    sigemptyset(&ignore.sa_mask);
    sigaction(SIGINT, &action, NULL);
    sigaction(SIGTERM, &action, NULL);
    sigaction(SIGPIPE, &ignore, NULL);
}

void vd_cancel_on_signal(vd_job *job) {
    signalled_job = job;
    if (job != NULL && signalled) {
        vd_job_cancel(job);
    }
}

/* ---- progress ---------------------------------------------------------------------------------
 */

static void *show_progress(void *user) {
    vd_progress *progress = user;
    double start = vd_seconds_now();
    pthread_mutex_lock(&progress->lock);
    while (!progress->stop) {
        struct timespec until;
        clock_gettime(CLOCK_REALTIME, &until);
        until.tv_nsec += 200 * 1000 * 1000;
        until.tv_sec += until.tv_nsec / 1000000000;
        until.tv_nsec %= 1000000000;
        pthread_cond_timedwait(&progress->ended, &progress->lock, &until);
        double share = vd_job_progress(progress->job);
        double spent = vd_seconds_now() - start;
        if (!progress->stop && share > 0.0) {
            static const char bar[] = "########################";
            int filled = (int)(share * 24.0);
            fprintf(stderr, "\rworking [%-24.*s] %3.0f %%, %.0f s left \033[K", filled, bar,
                    100.0 * share, spent / share - spent);
        }
    }
    pthread_mutex_unlock(&progress->lock);
    fputs("\r\033[K", stderr);
    return NULL;
}

void vd_progress_start(vd_progress *progress, const vd_job *job, bool quiet) {
    *progress = (vd_progress){.job = job};
    if (quiet || !isatty(STDERR_FILENO)) {
        return;
    }
    pthread_mutex_init(&progress->lock, NULL);
    pthread_cond_init(&progress->ended, NULL);
    progress->running = pthread_create(&progress->thread, NULL, show_progress, progress) == 0;
}

void vd_progress_stop(vd_progress *progress) {
    if (!progress->running) {
        return;
    }
    pthread_mutex_lock(&progress->lock);
    progress->stop = true;
    pthread_cond_signal(&progress->ended);
    pthread_mutex_unlock(&progress->lock);
    pthread_join(progress->thread, NULL);
    pthread_cond_destroy(&progress->ended);
    pthread_mutex_destroy(&progress->lock);
    progress->running = false;
}

/* ---- results ----------------------------------------------------------------------------------
 */

static bool same_file(const struct stat *a, const char *path) {
    struct stat b;
    return path != NULL && strcmp(path, "-") != 0 && stat(path, &b) == 0 && a->st_dev == b.st_dev &&
           a->st_ino == b.st_ino;
}

/* The part of a path behind its folder, which is written to `folder`. */
static const char *split_path(const char *path, char folder[4096]) {
    const char *slash = strrchr(path, '/');
    int length = slash == path ? 1 : slash != NULL ? (int)(slash - path) : 0;
    snprintf(folder, 4096, "%.*s", length > 0 ? length : 1, length > 0 ? path : ".");
    return slash != NULL ? slash + 1 : path;
}

bool vd_same_place(const char *one, const char *other) {
    if (strcmp(one, "-") == 0 || strcmp(other, "-") == 0) {
        return strcmp(one, other) == 0;
    }
    char folder[4096], folder_of_other[4096];
    struct stat there;
    return strcmp(split_path(one, folder), split_path(other, folder_of_other)) == 0 &&
           (strcmp(folder, folder_of_other) == 0 ||
            (stat(folder, &there) == 0 && same_file(&there, folder_of_other)));
}

vd_status vd_check_output(const char *option, const char *path, const char *const *inputs,
                          int count) {
    if (strcmp(path, "-") == 0) {
        return isatty(STDOUT_FILENO) ? vd_failure(VD_ERROR_ARGUMENT,
                                                  "--%s - would write a picture to the terminal; "
                                                  "send it into a file or a pipe",
                                                  option)
                                     : vd_success();
    }
    struct stat there;
    if (stat(path, &there) == 0) {
        if (S_ISDIR(there.st_mode)) {
            return vd_failure(VD_ERROR_IO, "cannot write %.200s: it is a folder; name a file in it",
                              path);
        }
        for (int i = 0; i < count; i++) {
            if (S_ISREG(there.st_mode) && same_file(&there, inputs[i])) {
                return vd_failure(VD_ERROR_ARGUMENT,
                                  "--%s: %.200s is also read and would be "
                                  "overwritten; name another file",
                                  option, path);
            }
        }
        if (!S_ISREG(there.st_mode)) {
            return access(path, W_OK) == 0
                       ? vd_success()
                       : vd_failure(VD_ERROR_IO, "cannot write %.200s: %s; choose another file",
                                    path, strerror(errno));
        }
    }
    char folder[4096];
    (void)split_path(path, folder);
    if (stat(folder, &there) != 0 || !S_ISDIR(there.st_mode)) {
        return vd_failure(VD_ERROR_IO,
                          "cannot write %.160s: there is no folder %.160s; make it "
                          "first",
                          path, folder);
    }
    if (access(folder, W_OK | X_OK) != 0) {
        return vd_failure(VD_ERROR_IO,
                          "cannot write %.160s: the folder %.160s does not allow it; "
                          "choose another",
                          path, folder);
    }
    return vd_success();
}

char *vd_quote_command(const char *program, int argc, char **argv) {
    size_t size = strlen(program) + 1;
    for (int i = 0; i < argc; i++) {
        size += 4 * strlen(argv[i]) + 3;
    }
    char *text = malloc(size);
    if (text == NULL) {
        return NULL;
    }
    char *at = text + snprintf(text, size, "%s", program);
    for (int i = 0; i < argc; i++) {
        static const char plain[] = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ"
                                    "0123456789-_=+,.:/@%";
        bool quote = argv[i][0] == '\0' || argv[i][strspn(argv[i], plain)] != '\0';
        *at++ = ' ';
        if (quote) {
            *at++ = '\'';
        }
        for (const char *c = argv[i]; *c != '\0'; c++) {
            if (*c == '\'') {
                at += snprintf(at, 5, "'\\''");
            } else {
                *at++ = *c;
            }
        }
        if (quote) {
            *at++ = '\'';
        }
    }
    *at = '\0';
    return text;
}

bool vd_print_json(const json_t *root) {
    bool printed = root != NULL && json_dumpf(root, stdout, JSON_INDENT(2)) == 0;
    return printed && putchar('\n') != EOF && fflush(stdout) == 0;
}

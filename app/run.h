/* run.h: what long commands share: notes, progress, interruption, and a look at where the results
 * are to go before anything takes long. */
#ifndef VEDUTA_APP_RUN_H
#define VEDUTA_APP_RUN_H

#include <jansson.h>
#include <pthread.h>
#include <veduta/veduta.h>

/* Prints "veduta: SENTENCE" to standard error and returns `code`. */
int vd_report(const vd_status *status, int code);

/* Seconds of a clock that only goes forward. */
double vd_seconds_now(void);

/* Seconds that processors have spent on this process, all threads together. */
double vd_processor_seconds_now(void);

/* Memory that this process holds, its code and libraries included: now, and the most so far. */
typedef struct vd_process_memory {
    size_t now_bytes, peak_bytes;
} vd_process_memory;

vd_process_memory vd_process_memory_now(void);

/* The library's log: notes go to standard error unless `quiet`, and are kept for --json. */
typedef struct vd_notes {
    pthread_mutex_t lock;
    json_t *list;
    bool quiet;
} vd_notes;

VD_MUST_USE vd_status vd_notes_init(vd_notes *notes, bool quiet);
void vd_notes_finish(vd_notes *notes);
void vd_notes_log(void *user, vd_log_level level, const char *sentence);

/* Makes what a long command works with: a context of so many threads (0: one per processor) that
 * logs to `notes`, and a job. On failure, VD_ERROR_ARGUMENT where VEDUTA_CPU is at fault, both are
 * null. */
VD_MUST_USE vd_status vd_work_begin(vd_notes *notes, int threads, vd_context **context,
                                    vd_job **job);

/* Ends these, also after a failure, and the notes. */
void vd_work_end(vd_notes *notes, vd_context **context, vd_job **job);

/* From here on SIGINT and SIGTERM are kept for a job to come; a second one ends the program, and a
 * closed pipe is a write error like any other. */
void vd_catch_signals(void);

/* Lets those signals cancel a job, at once if one came before. Null takes the job away. */
void vd_cancel_on_signal(vd_job *job);

/* A line with the finished share and the time left, shown only on a terminal. */
typedef struct vd_progress {
    const vd_job *job;
    pthread_t thread;
    pthread_mutex_t lock;
    pthread_cond_t ended;
    bool running, stop;
} vd_progress;

void vd_progress_start(vd_progress *progress, const vd_job *job, bool quiet);
void vd_progress_stop(vd_progress *progress);

/* Whether two paths that may not exist yet name one file: the same name in the same folder. */
bool vd_same_place(const char *one, const char *other);

/* Checks that `path` can be written: its folder is there and lets files be made, it is no folder
 * itself, and it is none of the `count` files in `inputs` (null entries are skipped). */
VD_MUST_USE vd_status vd_check_output(const char *option, const char *path,
                                      const char *const *inputs, int count);

/* Returns the command line as a shell would read it again; the caller frees it. Null when memory is
 * out. */
char *vd_quote_command(const char *program, int argc, char **argv);

/* Prints JSON to standard output with a line break; false when that fails. */
bool vd_print_json(const json_t *root);

#endif

/* bench_peer.c: the triangle bench's peer, Mesa's llvmpipe, in a program of its own.
 *
 * It draws the same mesh by the same matrix with the same shading into 8-bit colour and float depth
 * of its own, as many threads (Mesa's LP_NUM_THREADS counts those that fill; its vertices are
 * shaded by one more), until glFinish returns; nothing is read back while the clock runs.
 */
#include "bench_raster.h"

#include <libgen.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

#define REMEDY "Debian: libegl-dev, libgles-dev, libgl1-mesa-dri"

enum { MOST_PEER_RUNS = 200 };

bool bench_program_beside(const char *name, char *out, size_t bytes) {
    char self[512], path[600];
    const ssize_t length = readlink("/proc/self/exe", self, sizeof self - 1);
    if (length < 0) {
        return false;
    }
    self[length] = '\0';
    snprintf(path, sizeof path, "%s/%s", dirname(self), name);
    return access(path, X_OK) == 0 && strchr(path, '\'') == NULL &&
           snprintf(out, bytes, "'%s'", path) < (int)bytes;
}

/* Says why there is no peer, unless it was said. */
static bool leave_out(bench_run *run, const char *why) {
    if (strncmp(run->peer_missing, why, sizeof run->peer_missing - 1) != 0) {
        snprintf(run->peer_missing, sizeof run->peer_missing, "%s", why);
        fprintf(stderr, "llvmpipe is left out: %s (" REMEDY ")\n", why);
    }
    return false;
}

static int compare_times(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Program, model, size, shading, the 16 numbers of the matrix, runs, seconds, file of pixels. */
static bool write_command(const bench_run *run, const bench_view *v, const bench_model *m,
                          const char *shading, const char *picture, int threads, char *out,
                          size_t bytes) {
    char program[640];
    if (!bench_program_beside("veduta-llvmpipe", program, sizeof program) ||
        strchr(m->path, '\'') != NULL) {
        return false;
    }
    const vd_matrix project = vd_camera_matrix(&v->camera);
    const vd_matrix move = vd_matrix_translation(vd_vec3_scale(v->camera.eye, -1.0));
    const vd_matrix matrix = vd_matrix_multiply(&project, &move);
    int at = snprintf(out, bytes, "LP_NUM_THREADS=%d %s '%s' %d %s", threads, program, m->path,
                      v->frame->width, shading);
    for (int i = 0; i < 16 && at < (int)bytes; i++) {
        at += snprintf(out + at, bytes - (size_t)at, " %.9g", matrix.m[i / 4][i % 4]);
    }
    if (at < (int)bytes) {
        at += snprintf(out + at, bytes - (size_t)at, " %d %g %s%s%s 2>&1",
                       run->repeat > 0 ? run->repeat : run->least_runs,
                       run->repeat > 0 ? 0.0 : run->seconds, picture != NULL ? "'" : "",
                       picture != NULL ? picture : "", picture != NULL ? "'" : "");
    }
    return at < (int)bytes;
}

/* Reads the peer's lines: times, "peak BYTES", or why it failed. */
static int read_times(FILE *pipe, double times_ms[MOST_PEER_RUNS], bench_result *result,
                      char why[160]) {
    char line[256];
    int count = 0;
    unsigned long long bytes;
    while (fgets(line, sizeof line, pipe) != NULL) {
        char *end;
        const double number = strtod(line, &end);
        line[strcspn(line, "\n")] = '\0';
        if (end != line && count < MOST_PEER_RUNS) {
            times_ms[count++] = number;
        } else if (sscanf(line, "peak %llu", &bytes) == 1) {
            result->peak_resident_bytes = (size_t)bytes;
        } else if (strncmp(line, "veduta-llvmpipe: ", 17) == 0) {
            snprintf(why, 160, "%.150s", line + 17);
        }
    }
    return count;
}

bool bench_peer_measure(bench_run *run, const bench_view *v, const bench_model *m,
                        const char *shading, const char *picture, bench_result *result) {
    char command[2048], why[160] = "it ended early";
    double times_ms[MOST_PEER_RUNS];
    const int threads = vd_context_threads(v->context);
    if (!write_command(run, v, m, shading, picture, threads, command, sizeof command)) {
        return leave_out(run, "there is no veduta-llvmpipe beside this program; it is built where "
                              "EGL and OpenGL ES are");
    }
    FILE *pipe = popen(command, "r");
    if (pipe == NULL) {
        return leave_out(run, "its program does not start");
    }
    result->model = m->name;
    result->threads = threads;
    result->isa = vd_context_isa(v->context);
    result->width = result->height = v->frame->width;
    result->output_bytes = (size_t)v->frame->width * (size_t)v->frame->height * 8;
    const int count = read_times(pipe, times_ms, result, why);
    const int status = pclose(pipe);
    if (status != 0 || count == 0) {
        return leave_out(run, why);
    }
    qsort(times_ms, (size_t)count, sizeof times_ms[0], compare_times);
    result->min_ms = times_ms[0];
    result->median_ms = (times_ms[(count - 1) / 2] + times_ms[count / 2]) / 2;
    result->p99_ms = times_ms[(count * 99 + 99) / 100 - 1];
    return true;
}

void bench_peer_compare(const bench_view *v, const char *picture, char *note, size_t bytes) {
    const size_t width = (size_t)v->frame->width;
    uint8_t *row = malloc(width * 4);
    FILE *file = fopen(picture, "rb");
    unsigned long long coverage = 0, beyond = 0;
    int worst = 0;
    bool ok = row != NULL && file != NULL;
    for (size_t y = 0; ok && y < width; y++) {
        ok = fread(row, 4, width, file) == width;
        for (size_t x = 0; ok && x < width; x++) {
            const size_t at = y * v->frame->stride + x;
            const uint8_t *mine = v->frame->rgba + 4 * at, *theirs = row + 4 * x;
            coverage += (v->frame->depth[at] > 0) != (theirs[0] > 0 || theirs[1] > 0 || theirs[2]);
            int apart = 0;
            for (int c = 0; c < 3; c++) {
                const int difference = abs(mine[c] - theirs[c]);
                apart = difference > apart ? difference : apart;
            }
            worst = apart > worst ? apart : worst;
            beyond += apart > 4;
        }
    }
    if (file != NULL) {
        fclose(file);
    }
    free(row);
    if (ok) {
        snprintf(note, bytes, "coverage differs at %llu, levels by <= %d, > 4 at %llu", coverage,
                 worst, beyond);
    }
}

/* bench_program.c: what concerns the program and its files: PNG, starting, a cold picture. */
#include "bench.h"

#include <errno.h>
#include <fcntl.h>
#include <spawn.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

extern char **environ;

/* A folder of our own for files that are measured. */
static vd_status make_folder(const bench_case *self, char folder[48]) {
    const char *base = getenv("TMPDIR");
    if (snprintf(folder, 48, "%s/veduta-bench-XXXXXX", base ? base : "/tmp") >= 48) {
        return vd_failure(VD_ERROR_ARGUMENT, "TMPDIR is too long for the case %s: %.100s",
                          self->name, base);
    }
    if (mkdtemp(folder) == NULL) {
        return vd_failure(VD_ERROR_IO, "cannot make the folder %s: %s; set TMPDIR", folder,
                          strerror(errno));
    }
    return vd_success();
}

/* ---- png --------------------------------------------------------------------------------------*/

static vd_status write_png(void *user) {
    bench_scene *s = user;
    return vd_frame_save_png(s->frame, s->path, &s->png);
}

/* Writes the rendered frame at every level worth knowing. */
static vd_status measure_png_levels(bench_run *run, bench_scene *s, const bench_case *self) {
    static const int levels[] = {0, 1, 2, 3, 6, 9};
    s->png = vd_png_def_default();
    int standard = s->png.level;
    vd_status status = vd_success();
    for (size_t i = 0; i < sizeof levels / sizeof levels[0] && status.code == VD_OK; i++) {
        s->png.level = levels[i];
        bench_result result = bench_result_of(self, "");
        snprintf(result.method, sizeof result.method, "level-%d", levels[i]);
        result.isa = vd_context_isa(s->context);
        result.width = s->frame->width;
        result.height = s->frame->height;
        result.reference = levels[i] == standard;
        vd_context_memory_reset_peak(s->context);
        status = bench_measure(run, write_png, s, bench_cpu_ms, &result);
        struct stat file;
        if (status.code == VD_OK && stat(s->path, &file) == 0) {
            snprintf(result.note, sizeof result.note, "CPU, %.2f MB%s", (double)file.st_size / 1e6,
                     levels[i] == standard ? ", default" : "");
            result.peak_bytes = vd_context_memory(s->context).bytes_peak;
            result.has_hash = true;
            result.hash = vd_frame_hash(s->frame);
            status = bench_add(run, &result);
        }
    }
    return status;
}

vd_status bench_png(bench_run *run, const bench_case *self) {
    char folder[48];
    vd_status status = make_folder(self, folder);
    if (status.code != VD_OK) {
        return status;
    }
    bench_scene s;
    status = bench_scene_init(&s, run, BENCH_MAP_FLOAT, 0, VD_ISA_AUTO, 0, self->width, self->rows);
    if (status.code == VD_OK) {
        snprintf(s.path, sizeof s.path, "%s/frame.png", folder);
        bench_set_lens_view(&s);
        status = bench_draw_terrain(&s);
        if (status.code == VD_OK) {
            status = measure_png_levels(run, &s, self);
        }
        unlink(s.path);
        bench_scene_finish(&s);
    }
    rmdir(folder);
    return status;
}

/* ---- programs ---------------------------------------------------------------------------------*/

/* Runs this program with arguments (the first is filled in), silently, and waits for it. */
static vd_status run_self(char *const *options) {
    char program[] = "/proc/self/exe";
    char *arguments[16] = {program};
    for (int i = 0; options[i] != NULL && i < 14; i++) {
        arguments[i + 1] = options[i];
    }
    posix_spawn_file_actions_t actions;
    pid_t child = 0;
    int error = posix_spawn_file_actions_init(&actions);
    if (error == 0) {
        error = posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
        if (error == 0) {
            error = posix_spawn(&child, program, &actions, NULL, arguments, environ);
        }
        posix_spawn_file_actions_destroy(&actions);
    }
    if (error != 0) {
        return vd_failure(VD_ERROR_IO, "cannot start %s: %s", program, strerror(error));
    }
    int state = 0;
    if (waitpid(child, &state, 0) != child || !WIFEXITED(state) || WEXITSTATUS(state) != 0) {
        return vd_failure(VD_ERROR_IO, "%s %s did not end well", program, options[0]);
    }
    return vd_success();
}

static vd_status show_version(void *user) {
    (void)user;
    char option[] = "--version";
    char *options[] = {option, NULL};
    return run_self(options);
}

vd_status bench_startup(bench_run *run, const bench_case *self) {
    bench_result result = bench_result_of(self, "version");
    result.isa = vd_isa_best();
    vd_status status = bench_measure(run, show_version, NULL, bench_wall_ms, &result);
    return status.code == VD_OK ? bench_add(run, &result) : status;
}

/* ---- cold -------------------------------------------------------------------------------------*/

enum { HGT_SIDE = 1201, HGT_METRES = 37 /* of one step of height: 118 of them are Mont Blanc */ };

typedef struct cold {
    char hgt[96], png[96], size[24], threads[16];
} cold;

/* Writes the bench's map as an .hgt tile: 1201² big-endian metres, 3″ a sample. */
static vd_status write_hgt(const bench_run *run, const char *path) {
    vd_context *context = NULL;
    vd_heightfield *map = NULL;
    uint8_t *bytes = NULL;
    vd_status status = vd_context_create(NULL, &context);
    if (status.code == VD_OK) {
        status = bench_map_create(context, run->map, BENCH_MAP_CLASSIC, HGT_SIDE, HGT_SIDE, &map);
    }
    if (status.code == VD_OK) {
        bytes = vd_allocate(context, (size_t)HGT_SIDE * HGT_SIDE, 2);
        status = bytes != NULL ? status : vd_failure(VD_ERROR_MEMORY, "out of memory for the tile");
    }
    for (int i = 0; status.code == VD_OK && i < HGT_SIDE * HGT_SIDE; i++) {
        int metres = (int)vd_heightfield_at(map, i % HGT_SIDE, i / HGT_SIDE) * HGT_METRES;
        bytes[2 * i] = (uint8_t)(metres >> 8);
        bytes[2 * i + 1] = (uint8_t)metres;
    }
    if (status.code == VD_OK) {
        FILE *file = fopen(path, "wb");
        size_t count = (size_t)HGT_SIDE * HGT_SIDE * 2;
        bool written = file != NULL && fwrite(bytes, 1, count, file) == count;
        if (file != NULL && fclose(file) != 0) {
            written = false;
        }
        if (!written) {
            status = vd_failure(VD_ERROR_IO, "cannot write %s: %s", path, strerror(errno));
        }
    }
    vd_release(context, bytes);
    if (context != NULL) {
        vd_heightfield_destroy(context, &map);
    }
    vd_context_destroy(&context);
    return status;
}

static vd_status render_cold(void *user) {
    cold *c = user;
    char render[] = "render", output[] = "-o", size[] = "--size", threads[] = "--threads",
         quiet[] = "--quiet";
    char *options[] = {render,  c->hgt,  output,     c->png, size,
                       c->size, threads, c->threads, quiet,  NULL};
    return run_self(options);
}

vd_status bench_cold(bench_run *run, const bench_case *self) {
    char folder[48];
    vd_status status = make_folder(self, folder);
    if (status.code != VD_OK) {
        return status;
    }
    cold c;
    snprintf(c.hgt, sizeof c.hgt, "%s/N45E006.hgt", folder);
    snprintf(c.png, sizeof c.png, "%s/frame.png", folder);
    snprintf(c.size, sizeof c.size, "%dx%d", self->width, self->rows);
    status = write_hgt(run, c.hgt);
    for (int t = 0; t < run->thread_count && status.code == VD_OK; t++) {
        snprintf(c.threads, sizeof c.threads, "%d", run->threads[t]);
        bench_result result = bench_result_of(self, "render");
        result.threads = run->threads[t];
        result.isa = vd_isa_best();
        result.width = self->width;
        result.height = self->rows;
        result.target_fps = bench_target_fps(self, result.isa, result.threads);
        snprintf(result.note, sizeof result.note, "CPU");
        status = bench_measure(run, render_cold, &c, bench_children_cpu_ms, &result);
        if (status.code == VD_OK) {
            status = bench_add(run, &result);
        }
    }
    unlink(c.hgt);
    unlink(c.png);
    rmdir(folder);
    return status;
}

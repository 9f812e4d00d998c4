/* bench_program.c: what concerns the program and its files: PNG, starting, a cold picture. */
#include "bench.h"
#include "geo_module.h"

#include <errno.h>
#include <fcntl.h>
#include <spawn.h>
#include <stddef.h>
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

enum {
    HGT_SIDE = 1201,
    TIFF_SIDE = 2048,
    STEP_METRES = 37, /* of one step of height: 118 of them are Mont Blanc */
    CELL_METRES = 93, /* of the bench's map */
    UTM_ZONE_32N = 32632
};

typedef struct cold {
    char input[96], png[96], size[24], threads[16];
} cold;

/* Little-endian, as the file says; so is every processor that this runs on. */
typedef struct tiff_entry {
    uint16_t tag, type;
    uint32_t count, value; /* or the offset of the values */
} tiff_entry;

/* What stands before the heights of a GeoTIFF as GDAL writes it: one row a strip, no compression.
 */
typedef struct tiff_head {
    uint8_t order[2];
    uint16_t magic;
    uint32_t first;
    uint16_t padding[2]; /* so that numbers stand where their sizes want them */
    double scale[3], tie[6];
    uint16_t keys[4 * 4];
    uint32_t offsets[TIFF_SIDE], counts[TIFF_SIDE];
    uint16_t more_padding, entry_count;
    tiff_entry entries[13];
    uint32_t next;
} tiff_head;

static void fill_tiff_head(tiff_head *head) {
    enum { SHORT = 3, LONG = 4, DOUBLE = 12 };
    memset(head, 0, sizeof *head);
    memcpy(head->order, "II", 2);
    head->magic = 42;
    head->first = offsetof(tiff_head, entry_count);
    head->scale[0] = head->scale[1] = CELL_METRES;
    head->tie[3] = 310350; /* east and north of the upper left corner */
    head->tie[4] = 5095575;
    /* GeoTIFF keys: version 1.1.0; projected, samples are areas, the CRS. */
    const uint16_t keys[16] = {1,    1, 0, 3, 1024, 0, 1, 1, /* */
                               1025, 0, 1, 1, 3072, 0, 1, UTM_ZONE_32N};
    memcpy(head->keys, keys, sizeof keys);
    for (int row = 0; row < TIFF_SIDE; row++) {
        head->counts[row] = TIFF_SIDE * sizeof(float);
        head->offsets[row] = (uint32_t)(sizeof *head + (size_t)row * TIFF_SIDE * sizeof(float));
    }
    const tiff_entry entries[13] = {
        {256, LONG, 1, TIFF_SIDE},                            /* width */
        {257, LONG, 1, TIFF_SIDE},                            /* height */
        {258, SHORT, 1, 32},                                  /* bits a sample */
        {259, SHORT, 1, 1},                                   /* no compression */
        {262, SHORT, 1, 1},                                   /* black is 0 */
        {273, LONG, TIFF_SIDE, offsetof(tiff_head, offsets)}, /* of the strips */
        {277, SHORT, 1, 1},                                   /* samples a pixel */
        {278, LONG, 1, 1},                                    /* rows a strip */
        {279, LONG, TIFF_SIDE, offsetof(tiff_head, counts)},  /* bytes of the strips */
        {339, SHORT, 1, 3},                                   /* float */
        {33550, DOUBLE, 3, offsetof(tiff_head, scale)},       /* of a pixel */
        {33922, DOUBLE, 6, offsetof(tiff_head, tie)},         /* pixel to place */
        {34735, SHORT, 16, offsetof(tiff_head, keys)},
    };
    memcpy(head->entries, entries, sizeof entries);
    head->entry_count = 13;
}

/* Writes one row of the map in metres: big-endian 16 bits, or floats. */
static bool write_row(FILE *file, const vd_heightfield *map, int row, bool tiff) {
    union {
        uint8_t bytes[2 * HGT_SIDE];
        float metres[TIFF_SIDE];
    } out;
    for (int i = 0; i < map->width; i++) {
        float metres = vd_heightfield_at(map, i, row) * STEP_METRES;
        if (tiff) {
            out.metres[i] = metres;
        } else {
            out.bytes[2 * i] = (uint8_t)((int)metres >> 8);
            out.bytes[2 * i + 1] = (uint8_t)(int)metres;
        }
    }
    size_t count = (size_t)map->width * (tiff ? sizeof(float) : 2);
    return fwrite(&out, 1, count, file) == count;
}

/* Writes the bench's map, an .hgt tile of 1201², 3″ a sample, or a GeoTIFF of 2048² floats. */
static vd_status write_cold_map(const bench_run *run, const char *path, bool tiff) {
    vd_context *context = NULL;
    vd_heightfield *map = NULL;
    int side = tiff ? TIFF_SIDE : HGT_SIDE;
    vd_status status = vd_context_create(NULL, &context);
    if (status.code != VD_OK) {
        return status;
    }
    status = bench_map_create(context, run->map, BENCH_MAP_CLASSIC, side, side, &map);
    if (status.code == VD_OK) {
        FILE *file = fopen(path, "wb");
        bool written = file != NULL;
        if (written && tiff) {
            tiff_head head;
            fill_tiff_head(&head);
            written = fwrite(&head, sizeof head, 1, file) == 1;
        }
        for (int row = 0; row < side && written; row++) {
            written = write_row(file, map, row, tiff);
        }
        if (file != NULL && fclose(file) != 0) {
            written = false;
        }
        if (!written) {
            status = vd_failure(VD_ERROR_IO, "cannot write %s: %s", path, strerror(errno));
        }
    }
    vd_heightfield_destroy(context, &map);
    vd_context_destroy(&context);
    return status;
}

static vd_status render_cold(void *user) {
    cold *c = user;
    char render[] = "render", output[] = "-o", size[] = "--size", threads[] = "--threads",
         quiet[] = "--quiet";
    char *options[] = {render,  c->input, output,     c->png, size,
                       c->size, threads,  c->threads, quiet,  NULL};
    return run_self(options);
}

/* One file in, by every number of threads. */
static vd_status measure_cold(bench_run *run, const bench_case *self, const char *folder,
                              bool tiff) {
    cold c;
    snprintf(c.input, sizeof c.input, "%s/%s", folder, tiff ? "heights.tif" : "N45E006.hgt");
    snprintf(c.png, sizeof c.png, "%s/frame.png", folder);
    snprintf(c.size, sizeof c.size, "%dx%d", self->width, self->rows);
    vd_status status = write_cold_map(run, c.input, tiff);
    for (int t = 0; t < run->thread_count && status.code == VD_OK; t++) {
        snprintf(c.threads, sizeof c.threads, "%d", run->threads[t]);
        bench_result result = bench_result_of(self, tiff ? "geotiff" : "hgt");
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
    unlink(c.input);
    unlink(c.png);
    return status;
}

vd_status bench_cold(bench_run *run, const bench_case *self) {
    char folder[48];
    vd_status status = make_folder(self, folder);
    if (status.code != VD_OK) {
        return status;
    }
    status = measure_cold(run, self, folder, false);
    vd_geo_module geo;
    if (status.code == VD_OK && vd_geo_module_open("read GeoTIFF", &geo).code == VD_OK) {
        status = measure_cold(run, self, folder, true);
    }
    rmdir(folder);
    return status;
}

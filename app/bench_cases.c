/* bench_cases.c: what `veduta bench` can measure. */
#include "bench.h"

#include <errno.h>
#include <fcntl.h>
#include <spawn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

/* The published picture's size. */
enum { CLASSIC_WIDTH = 700, CLASSIC_HEIGHT = 512 };

/* What a picture case works on: made anew for every SIMD level and thread count. */
typedef struct scene {
    vd_context *context;
    vd_heightfield *map;
    vd_frame *frame;
    vd_classic_def classic;
    vd_classic_method method;
    vd_classic_renderer *renderer; /* of the march, made once per map */
    vd_terrain_def terrain;
    vd_camera camera;
    vd_png_def png;
    char path[64];
} scene;

static void scene_finish(scene *s) {
    if (s->context != NULL) {
        vd_classic_renderer_destroy(&s->renderer);
        vd_frame_destroy(&s->frame);
        vd_heightfield_destroy(s->context, &s->map);
        vd_context_destroy(&s->context);
    }
}

static vd_status scene_init(scene *s, vd_height_type type, vd_isa isa, int threads, int width,
                            int height) {
    memset(s, 0, sizeof *s);
    vd_context_def def = vd_context_def_default();
    def.threads = threads;
    def.isa = isa;
    vd_status status = vd_context_create(&def, &s->context);
    if (status.code == VD_OK) {
        status = bench_map_create(s->context, type, &s->map);
    }
    if (status.code == VD_OK) {
        status = vd_frame_create(s->context, width, height, 0, &s->frame);
    }
    if (status.code != VD_OK) {
        scene_finish(s);
        return status;
    }
    s->classic = vd_classic_def_default();
    s->terrain = vd_terrain_def_default();
    s->terrain.heightfield = s->map;
    return status;
}

/* Measures one method on a scene and adds the result; `method` names it. */
static vd_status measure_picture(bench_run *run, scene *s, bench_work *work, bench_result *result,
                                 const char *method) {
    snprintf(result->method, sizeof result->method, "%s", method);
    result->threads = vd_context_threads(s->context);
    result->isa = vd_context_isa(s->context);
    result->width = s->frame->width;
    result->height = s->frame->height;
    vd_context_memory_reset_peak(s->context);
    vd_status status = bench_measure(run, work, s, CLOCK_MONOTONIC, result);
    if (status.code != VD_OK) {
        return status;
    }
    result->peak_bytes = vd_context_memory(s->context).bytes_peak;
    result->has_hash = true;
    result->hash = vd_frame_hash(s->frame);
    return bench_add(run, result);
}

static vd_status render_classic(void *user) {
    scene *s = user;
    if (s->method == VD_CLASSIC_MARCH) {
        return vd_classic_renderer_draw(s->renderer, NULL, &s->classic, s->frame);
    }
    return vd_classic_render(s->context, NULL, s->map, &s->classic, s->method, s->frame, NULL);
}

static vd_status render_terrain(void *user) {
    scene *s = user;
    return vd_terrain_render(s->context, NULL, &s->terrain, &s->camera, s->frame, NULL);
}

/* ---- classic ----------------------------------------------------------------------------------*/

/* One view of the map at one SIMD level and number of threads, by several methods. */
typedef struct classic_view {
    const char *name;
    double height, growth; /* of the eye; of the steps */
    int width, rows;
} classic_view;

/* The same view with the lens renderer: plain colours, one sample, as the classic picture has it.
 * Another picture, since its surface is bilinear, has no slices and ends at the map's edge. */
static vd_status measure_classic_raycast(bench_run *run, const classic_view *view, vd_isa isa,
                                         int threads) {
    scene s;
    vd_status status = scene_init(&s, VD_HEIGHT_F32, isa, threads, view->width, view->rows);
    if (status.code != VD_OK) {
        return status;
    }
    s.camera = vd_classic_camera(&s.classic, s.frame->width, s.frame->height);
    s.terrain.method = VD_TERRAIN_RAYCAST;
    s.terrain.filter = VD_FILTER_NEAREST;
    s.terrain.samples = 1;
    s.terrain.shading = false;
    s.terrain.shadows = false;
    s.terrain.sky = false;
    s.terrain.background = s.classic.background;
    bench_result result = {.case_name = view->name};
    status = measure_picture(run, &s, render_terrain, &result, "raycast");
    scene_finish(&s);
    return status;
}

/* The methods from `first` to `last`. */
static vd_status measure_classic(bench_run *run, const classic_view *view, vd_isa isa, int threads,
                                 vd_classic_method first, vd_classic_method last) {
    scene s;
    vd_status status = scene_init(&s, VD_HEIGHT_U8, isa, threads, view->width, view->rows);
    if (status.code != VD_OK) {
        return status;
    }
    s.classic.height = view->height;
    if (view->growth > 0) {
        s.classic.step = 1;
        s.classic.growth = view->growth;
        s.classic.distance = 800;
    }
    for (int m = first; m <= (int)last && status.code == VD_OK; m++) {
        s.method = (vd_classic_method)m;
        if (m == VD_CLASSIC_MARCH) {
            status = vd_classic_renderer_create(s.context, s.map, &s.renderer);
            if (status.code != VD_OK) {
                break;
            }
        }
        bench_result result = {
            .case_name = view->name, .reference = m == VD_CLASSIC_REFERENCE, .same_picture = true};
        status =
            measure_picture(run, &s, render_classic, &result, vd_classic_method_name(s.method));
    }
    scene_finish(&s);
    return status;
}

/* The reference on one thread (it is serial), then the methods from `first` on. */
static vd_status measure_view(bench_run *run, const classic_view *view, vd_classic_method first) {
    vd_status status = vd_success();
    for (int i = 0; i < run->isa_count && status.code == VD_OK; i++) {
        status =
            measure_classic(run, view, run->isas[i], 1, VD_CLASSIC_REFERENCE, VD_CLASSIC_REFERENCE);
        for (int t = 0; t < run->thread_count && status.code == VD_OK; t++) {
            status = measure_classic(run, view, run->isas[i], run->threads[t], first,
                                     VD_CLASSIC_METHOD_COUNT - 1);
            if (status.code == VD_OK && first <= VD_CLASSIC_SLICES) {
                status = measure_classic_raycast(run, view, run->isas[i], run->threads[t]);
            }
        }
    }
    return status;
}

static vd_status case_classic(bench_run *run, const char *name) {
    const classic_view view = {name, 78, 0, CLASSIC_WIDTH, CLASSIC_HEIGHT};
    return measure_view(run, &view, VD_CLASSIC_SLICES);
}

static vd_status case_classic_high(bench_run *run, const char *name) {
    const classic_view view = {name, 200, 0, CLASSIC_WIDTH, CLASSIC_HEIGHT};
    return measure_view(run, &view, VD_CLASSIC_MARCH);
}

static vd_status case_classic_1080p(bench_run *run, const char *name) {
    const classic_view view = {name, 78, 0, 1920, 1080};
    return measure_view(run, &view, VD_CLASSIC_MARCH);
}

static vd_status case_classic_high_1080p(bench_run *run, const char *name) {
    const classic_view view = {name, 200, 0, 1920, 1080};
    return measure_view(run, &view, VD_CLASSIC_MARCH);
}

static vd_status case_classic_growth(bench_run *run, const char *name) {
    const classic_view view = {name, 78, 0.005, CLASSIC_WIDTH, CLASSIC_HEIGHT};
    return measure_view(run, &view, VD_CLASSIC_COLUMNS);
}

/* ---- lens -------------------------------------------------------------------------------------*/

/* A view over the map from above its southern half, northwards and a little down. */
static void set_lens_view(scene *s) {
    const double degree = 3.14159265358979323846 / 180.0;
    s->camera.eye = vd_vec3_make(512.0, -900.0, 180.0);
    s->camera.orientation = vd_orientation_from_angles(0.0, -18.0 * degree, 0.0);
    s->camera.projection = VD_PROJECTION_PERSPECTIVE;
    s->camera.lens = vd_lens_from_fov(50.0 * degree, s->frame->width, s->frame->height);
    s->camera.near_m = 1.0;
}

/* The plain ray caster on one thread, then both methods on every number of threads. */
static vd_status case_lens(bench_run *run, const char *name) {
    vd_status status = vd_success();
    for (int i = 0; i < run->isa_count && status.code == VD_OK; i++) {
        for (int t = 0; t < run->thread_count && status.code == VD_OK; t++) {
            scene s;
            status = scene_init(&s, VD_HEIGHT_F32, run->isas[i], run->threads[t], CLASSIC_WIDTH,
                                CLASSIC_HEIGHT);
            if (status.code != VD_OK) {
                break;
            }
            set_lens_view(&s);
            s.terrain.samples = 1;
            for (int m = VD_TERRAIN_METHOD_COUNT - 1; m >= 0 && status.code == VD_OK; m--) {
                s.terrain.method = (vd_terrain_method)m;
                bench_result result = {.case_name = name,
                                       .reference = t == 0 && m == VD_TERRAIN_RAYCAST,
                                       .same_picture = true};
                status = measure_picture(run, &s, render_terrain, &result,
                                         vd_terrain_method_name(s.terrain.method));
            }
            scene_finish(&s);
        }
    }
    return status;
}

/* ---- png --------------------------------------------------------------------------------------*/

static vd_status write_png(void *user) {
    scene *s = user;
    return vd_frame_save_png(s->frame, s->path, &s->png);
}

/* Writes the rendered frame at every level worth knowing, to a folder of its own. */
static vd_status measure_png_levels(bench_run *run, scene *s, const char *name) {
    static const int levels[] = {0, 1, 2, 3, 6, 9};
    s->png = vd_png_def_default();
    int standard = s->png.level;
    vd_status status = vd_success();
    for (size_t i = 0; i < sizeof levels / sizeof levels[0] && status.code == VD_OK; i++) {
        s->png.level = levels[i];
        bench_result result = {.case_name = name, .threads = 1, .isa = vd_context_isa(s->context)};
        snprintf(result.method, sizeof result.method, "level-%d", levels[i]);
        result.width = s->frame->width;
        result.height = s->frame->height;
        result.reference = levels[i] == standard;
        vd_context_memory_reset_peak(s->context);
        status = bench_measure(run, write_png, s, CLOCK_PROCESS_CPUTIME_ID, &result);
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

static vd_status case_png(bench_run *run, const char *name) {
    const char *base = getenv("TMPDIR");
    char folder[48];
    if (snprintf(folder, sizeof folder, "%s/veduta-bench-XXXXXX", base ? base : "/tmp") >=
        (int)sizeof folder) {
        return vd_failure(VD_ERROR_ARGUMENT, "TMPDIR is too long for the png case: %.100s", base);
    }
    if (mkdtemp(folder) == NULL) {
        return vd_failure(VD_ERROR_IO, "cannot make the folder %s: %s; set TMPDIR", folder,
                          strerror(errno));
    }
    scene s;
    vd_status status = scene_init(&s, VD_HEIGHT_F32, VD_ISA_AUTO, 0, 1920, 1080);
    if (status.code == VD_OK) {
        snprintf(s.path, sizeof s.path, "%s/frame.png", folder);
        set_lens_view(&s);
        s.terrain.samples = 1;
        status = render_terrain(&s);
        if (status.code == VD_OK) {
            status = measure_png_levels(run, &s, name);
        }
        unlink(s.path);
        scene_finish(&s);
    }
    rmdir(folder);
    return status;
}

/* ---- startup ----------------------------------------------------------------------------------*/

extern char **environ;

/* Runs this program with --version and waits for it. */
static vd_status start_program(void *user) {
    (void)user;
    char program[] = "/proc/self/exe", option[] = "--version";
    char *arguments[] = {program, option, NULL};
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
        return vd_failure(VD_ERROR_IO, "%s --version did not end well", program);
    }
    return vd_success();
}

static vd_status case_startup(bench_run *run, const char *name) {
    bench_result result = {.case_name = name, .threads = 1, .isa = vd_isa_best()};
    snprintf(result.method, sizeof result.method, "version");
    vd_status status = bench_measure(run, start_program, NULL, CLOCK_MONOTONIC, &result);
    return status.code == VD_OK ? bench_add(run, &result) : status;
}

const bench_case *bench_case_at(int index) {
    static const bench_case cases[] = {
        {"classic", "the published Voxel Space scene: 99,990 slices, all methods", case_classic},
        {"classic-growth", "the schedule of 1992: distance 800, steps that grow by 0.005",
         case_classic_growth},
        {"classic-high", "the same scene seen from above everything", case_classic_high},
        {"classic-1080p", "the published scene, 1920x1080", case_classic_1080p},
        {"classic-high-1080p", "from above everything, 1920x1080", case_classic_high_1080p},
        {"lens", "a lens view with light and shadows, one sample a pixel", case_lens},
        {"png", "writing a 1920x1080 picture, by zlib level; CPU time", case_png},
        {"startup", "starting the program until it ends, with --version", case_startup},
    };
    return index >= 0 && index < (int)(sizeof cases / sizeof cases[0]) ? &cases[index] : NULL;
}

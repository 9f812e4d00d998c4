/* fly.c: `veduta fly`: a camera path over a world, as a video. */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "commands.h"
#include "fly_preview.h"
#include "fly_run.h"
#include "world_file.h"

/* One run of `veduta fly`. */
typedef struct fly {
    const vd_fly_settings *settings;
    vd_render_run run;
    vd_fly_world world;
    vd_camera_path *path;
    vd_path_notes path_notes;
    vd_path_clearance clearance;
    vd_flight flight;
    vd_flight_result result;
} fly;

static void print_help(void) {
    fputs("usage: veduta fly [OPTIONS] HEIGHTS…|WORLD.json PATH [-o fly.mp4]\n"
          "       veduta fly [OPTIONS] HEIGHTS…|WORLD.json --orbit [-o fly.mp4]\n\n"
          "Flies a camera over what `veduta render` takes, models aside, along a PATH: keyframes,\n"
          "an orbit or a track as JSON (docs/fly.md), or a GPX, KML or GeoJSON track. Videos are\n"
          "made by the ffmpeg program; numbered pictures need none. Ctrl-C leaves a video of the\n"
          "frames so far.\n",
          stdout);
    vd_fly_print_help();
    fputs("\nexamples\n"
          "  veduta fly dem.tif --orbit -o orbit.mp4\n"
          "  veduta fly world.json path.json -o fly.mp4\n"
          "  veduta fly dem.tif path.json --preview -o map.png\n"
          "  veduta fly dem.tif hike.gpx --above 150 --speed 60 -s 1280x720 -o hike.webm\n"
          "  veduta fly dem.tif path.json --dry-run\n"
          "  veduta fly dem.tif path.json -o frame-{:05}.png --resume\n"
          "  veduta fly dem.tif path.json -o fly.mp4 --frames shots --resume --quality 90\n",
          stdout);
}

/* ---- what is said -----------------------------------------------------------------------------
 */

static json_t *clearance_json(const vd_path_clearance *c) {
    return c->has_ground ? json_pack("{s: f, s: f, s: f, s: f}", "lowest_m", c->lowest_m, "time",
                                     c->time_s, "lifted_m", c->lift_m, "before_m", c->unlifted_m)
                         : json_null();
}

/* What is known of the flight before it: for --json. */
static json_t *describe(const fly *f) {
    const vd_fly_settings *s = f->settings;
    return json_pack("{s: s, s: s, s: i, s: b, s: f, s: f, s: i, s: f, s: i, s: i, s: o, s: O}",
                     "veduta", vd_version(), "path", f->path_notes.kind, "keyframes",
                     vd_camera_path_keyframe_count(f->path), "loop",
                     (int)vd_camera_path_loops(f->path), "length_m", vd_camera_path_length(f->path),
                     "duration", vd_camera_path_duration(f->path), "frames", f->flight.count, "fps",
                     s->video.fps, "width", s->render.width, "height", s->render.height,
                     "clearance", clearance_json(&f->clearance), "warnings", f->run.notes.list);
}

static vd_status print_failure(void) {
    return vd_failure(VD_ERROR_IO, "cannot write to standard output; check the pipe");
}

static vd_status print_json(json_t *root) {
    bool printed = root != NULL && vd_print_json(root);
    json_decref(root);
    return printed ? vd_success() : print_failure();
}

static void write_distance(double metres, char out[32]) {
    if (fabs(metres) >= 10000.0) {
        snprintf(out, 32, "%.1f km", 1e-3 * metres);
    } else {
        snprintf(out, 32, "%.4g m", metres);
    }
}

static vd_status preview(fly *f) {
    const vd_fly_settings *s = f->settings;
    vd_status status = vd_success();
    if (s->output != NULL) {
        status = vd_fly_save_map(&f->world, f->path, s->output);
    }
    if (status.code != VD_OK || s->render.json) {
        return status.code != VD_OK ? status : print_json(describe(f));
    }
    char length[32], lowest[32], lift[32];
    const double duration = vd_camera_path_duration(f->path);
    write_distance(vd_camera_path_length(f->path), length);
    write_distance(f->clearance.lowest_m, lowest);
    write_distance(f->clearance.lift_m, lift);
    bool good = printf("path        %s, %d keyframes%s\nlength      %s\nduration    %.4g s, %d "
                       "frames of %dx%d at %.4g a second, mean speed %.4g m/s\n",
                       f->path_notes.kind, vd_camera_path_keyframe_count(f->path),
                       vd_camera_path_loops(f->path) ? ", a loop" : "", length, duration,
                       f->flight.count, s->render.width, s->render.height, s->video.fps,
                       vd_camera_path_length(f->path) / duration) > 0;
    if (!f->clearance.has_ground) {
        good = good && printf("clearance   no ground lies under the path\n") > 0;
    } else {
        good = good &&
               printf("clearance   %s at the lowest, at %.4g s", lowest, f->clearance.time_s) > 0;
        good = good && (f->clearance.lift_m > 0.0
                            ? printf("; lifted by up to %s, else it would be %.4g m\n", lift,
                                     f->clearance.unlifted_m)
                            : printf("\n")) > 0;
    }
    return good && fflush(stdout) == 0 ? vd_success() : print_failure();
}

/* ---- dry run ----------------------------------------------------------------------------------
 */

/* Frames that will be drawn: cameras that differ from the one before, and that are not there yet.
 */
static int count_to_draw(const fly *f, int *there) {
    vd_camera last = {.near_m = 0.0};
    int drawn = 0;
    *there = 0;
    for (int i = 0; i < f->flight.count; i++) {
        const vd_camera camera = vd_flight_camera(&f->flight, i);
        char name[4096];
        if (f->settings->resume && vd_frame_name(f->settings->frames, i, name, sizeof name) &&
            vd_flight_has_picture(&f->flight, name, &camera)) {
            ++*there;
        } else {
            drawn += i == 0 || !vd_camera_same(&camera, &last);
        }
        last = camera;
    }
    return drawn;
}

/* Rough: seconds of a frame's encoding on one processor and the bytes it takes, measured on
 * mountains at 1920 × 1080. */
static void estimate_encoding(const vd_fly_settings *s, double *seconds, double *bytes) {
    static const double time_ns[] = {[VD_VIDEO_MP4] = 25.0,
                                     [VD_VIDEO_WEBM] = 75.0,
                                     [VD_VIDEO_GIF] = 45.0,
                                     [VD_VIDEO_FRAMES] = 15.0};
    static const double bits[] = {[VD_VIDEO_MP4] = 0.1,
                                  [VD_VIDEO_WEBM] = 0.08,
                                  [VD_VIDEO_GIF] = 3.0,
                                  [VD_VIDEO_FRAMES] = 4.0};
    const double pixels = (double)s->render.width * s->render.height;
    /* Every 6 of crf doubles: 26 of them lie between 1 and 100. */
    const double quality =
        s->video.kind < VD_VIDEO_GIF ? exp2((s->video.quality - 75) * (26.0 / 99.0 / 6.0)) : 1.0;
    *seconds = 1e-9 * pixels * time_ns[s->video.kind];
    *bytes = pixels / 8.0 * bits[s->video.kind] * quality;
    if (s->frames != NULL && s->video.kind != VD_VIDEO_FRAMES) {
        *seconds += 1e-9 * pixels * time_ns[VD_VIDEO_FRAMES];
        *bytes += pixels / 8.0 * bits[VD_VIDEO_FRAMES];
    }
}

/* Draws the first, the middle and the last frame; returns the mean of their seconds. */
static vd_status draw_samples(fly *f, double *seconds) {
    enum { SAMPLES = 3 };
    const vd_fly_settings *s = f->settings;
    vd_frame *frame = NULL;
    vd_status status =
        vd_frame_create(f->run.context, s->render.width, s->render.height, 0, &frame);
    double sum = 0.0;
    for (int i = -1; i < SAMPLES && status.code == VD_OK; i++) { /* once to get warm */
        const int number = (int)((double)(i < 0 ? 0 : i) * (f->flight.count - 1) / (SAMPLES - 1));
        const vd_camera camera = vd_flight_camera(&f->flight, number);
        const double start = vd_seconds_now();
        status = f->flight.draw(f->flight.draw_user, &camera, frame);
        sum += i < 0 ? 0.0 : vd_seconds_now() - start;
    }
    vd_frame_destroy(&frame);
    *seconds = sum / SAMPLES;
    return status;
}

static vd_status dry_run(fly *f) {
    const vd_fly_settings *s = f->settings;
    double draw_seconds = 0.0, encode_seconds, frame_bytes;
    const double ready = vd_seconds_now() - f->run.start;
    vd_status status = draw_samples(f, &draw_seconds);
    if (status.code != VD_OK) {
        return status;
    }
    int there = 0;
    const int drawn = count_to_draw(f, &there), threads = vd_context_threads(f->run.context);
    estimate_encoding(s, &encode_seconds, &frame_bytes);
    const double encoded =
        s->video.kind == VD_VIDEO_FRAMES ? f->flight.count - there : f->flight.count;
    const double seconds = ready + drawn * draw_seconds + encoded * encode_seconds / threads;
    const double bytes = f->flight.count * frame_bytes;
    const size_t memory = vd_process_memory_now().peak_bytes + vd_flight_frame_bytes(&f->flight);
    if (s->render.json) {
        json_t *root = describe(f);
        bool failed = root == NULL;
        failed |= json_object_set_new(root, "dry_run", json_true()) != 0;
        failed |= json_object_set_new(root, "seconds", json_real(seconds)) != 0;
        failed |= json_object_set_new(root, "frame_seconds", json_real(draw_seconds)) != 0;
        failed |= json_object_set_new(root, "drawn", json_integer(drawn)) != 0;
        failed |= json_object_set_new(root, "taken", json_integer(there)) != 0;
        failed |= json_object_set_new(root, "memory_bytes", json_integer((json_int_t)memory)) != 0;
        failed |= json_object_set_new(root, "output_bytes", json_integer((json_int_t)bytes)) != 0;
        if (failed) {
            json_decref(root);
            root = NULL;
        }
        return print_json(root);
    }
    const bool good =
        printf("%d frames, %.0f seconds, %.0f MiB of memory, about %.1f MB\n", f->flight.count,
               ceil(seconds), (double)memory / 1048576.0, 1e-6 * bytes) > 0;
    return good && fflush(stdout) == 0 ? vd_success() : print_failure();
}

/* ---- the flight -------------------------------------------------------------------------------
 */

static vd_status report(const fly *f) {
    const vd_fly_settings *s = f->settings;
    const vd_flight_result *r = &f->result;
    if (s->render.json) {
        json_t *root = describe(f);
        const double share =
            r->processor_seconds / (r->seconds * vd_context_threads(f->run.context));
        json_t *all = json_pack("{s: s, s: i, s: i, s: i, s: i, s: I, s: f, s: f, s: f, s: I}",
                                "output", s->output, "done", r->done, "drawn", r->drawn, "repeated",
                                r->repeated, "taken", r->taken, "bytes", (json_int_t)r->bytes,
                                "seconds", vd_seconds_now() - f->run.start, "flight_seconds",
                                r->seconds, "processor_share", share, "memory_peak_bytes",
                                (json_int_t)vd_context_memory(f->run.context).bytes_peak);
        const bool failed = root == NULL || all == NULL || json_object_update(root, all) != 0;
        json_decref(all);
        if (failed) {
            json_decref(root);
            root = NULL;
        }
        return print_json(root);
    }
    if (!s->render.quiet) {
        char notes[80] = "";
        if (r->taken > 0 || r->repeated > 0) {
            snprintf(notes, sizeof notes, " (%d drawn, %d there already, %d unchanged)", r->drawn,
                     r->taken, r->repeated);
        }
        fprintf(stderr, "veduta: wrote %s, %d frames of %dx%d%s, %.4g s, %.1f MB, in %.1f s\n",
                s->output, r->done, s->render.width, s->render.height, notes,
                r->done / s->video.fps, 1e-6 * (double)r->bytes, vd_seconds_now() - f->run.start);
    }
    return vd_success();
}

/* An interruption leaves what there is, and says what that is. */
static vd_status interrupted(const fly *f) {
    const vd_fly_settings *s = f->settings;
    const int done = f->result.done;
    if (done == 0) {
        return vd_failure(VD_ERROR_CANCELLED, "interrupted; nothing was written");
    }
    return vd_failure(VD_ERROR_CANCELLED, "interrupted; %.160s holds the first %d of %d frames%s",
                      s->output, done, f->flight.count,
                      s->frames != NULL ? "; --resume goes on from there" : "");
}

static vd_status load(fly *f) {
    const vd_fly_settings *s = f->settings;
    vd_status status = vd_fly_world_load(&f->run, &f->world);
    if (status.code == VD_OK) {
        status = vd_path_load(f->run.context, s->path_file, &s->path, &f->world.scene->scene,
                              vd_world_scene_ground, f->world.scene, &f->path_notes, &f->path);
    }
    if (status.code == VD_OK) {
        status = f->path_notes.clearance_m > 0.0
                     ? vd_camera_path_clear(f->path, vd_world_scene_ground, f->world.scene,
                                            f->path_notes.clearance_m, &f->clearance)
                     : vd_success();
    }
    if (status.code == VD_OK && !(f->path_notes.clearance_m > 0.0)) {
        f->clearance = vd_camera_path_measure(f->path, vd_world_scene_ground, f->world.scene, 0.0);
    }
    return status;
}

static vd_status fly_on(fly *f, const char *command) {
    const vd_fly_settings *s = f->settings;
    vd_status status = load(f);
    if (status.code != VD_OK) {
        return status;
    }
    f->flight = (vd_flight){.context = f->run.context,
                            .job = f->run.job,
                            .settings = s,
                            .path = f->path,
                            .draw = vd_fly_draw,
                            .draw_user = &f->world,
                            .command = command,
                            .count = vd_flight_count(f->path, s->video.fps)};
    if (s->preview) {
        return preview(f);
    }
    status = vd_fly_world_prepare(&f->world, f->path);
    if (status.code != VD_OK) {
        return status;
    }
    snprintf(f->flight.look, sizeof f->flight.look, "%s %.17g", s->look,
             f->world.scene->look.light.haze_m);
    if (s->render.dry_run) {
        return dry_run(f);
    }
    status = vd_flight_run(&f->flight, &f->result);
    if (status.code == VD_ERROR_CANCELLED) {
        return interrupted(f);
    }
    return status.code == VD_OK ? report(f) : status;
}

/* What would be refused after a long run is refused before it. */
static vd_status check_outputs(const vd_fly_settings *s) {
    char name[4096];
    vd_status status = vd_success();
    const bool pictures = !s->preview && s->video.kind == VD_VIDEO_FRAMES;
    if (s->output != NULL && !s->render.dry_run && !pictures) {
        status = vd_render_check_output(&s->render, s->path_file, "output", s->output);
    }
    if (status.code == VD_OK && s->frames != NULL && !s->render.dry_run && !s->preview &&
        vd_frame_name(s->frames, 0, name, sizeof name)) {
        status =
            vd_render_check_output(&s->render, s->path_file, pictures ? "output" : "frames", name);
    }
    return status;
}

static int run_fly(const vd_fly_settings *settings, const vd_world_content *content,
                   const char *command, const char *note, double start) {
    fly f = {.settings = settings};
    f.run = (vd_render_run){.settings = &settings->render, .content = content, .start = start};
    vd_status status = vd_render_run_begin(&f.run, note);
    if (status.code == VD_OK) {
        status = fly_on(&f, command);
        if (status.code == VD_ERROR_CANCELLED && f.result.done == 0) {
            status = vd_failure(VD_ERROR_CANCELLED, "interrupted; nothing was written");
        }
    }
    vd_camera_path_destroy(&f.path);
    vd_fly_world_finish(&f.world);
    return vd_render_run_end(&f.run, &status);
}

/* The last of the inputs is the path; it is taken from them. Null for an orbit. */
static vd_status take_path(vd_options *options, char **path) {
    *path = NULL;
    if (options->values[FLY_ORBIT].number != 0.0) {
        const char *last =
            options->input_count > 1 ? options->inputs[options->input_count - 1] : "";
        return vd_ends_with(last, ".json")
                   ? vd_failure(VD_ERROR_ARGUMENT,
                                "--orbit and %.160s are two paths; give one of them", last)
                   : vd_success();
    }
    bool nothing;
    if (!vd_render_take_path(options, path, &nothing)) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "%s; name %s, as in `veduta fly dem.tif path.json -o out.mp4`",
                          nothing ? "there is nothing to fly over" : "there is no path",
                          nothing ? "an elevation file or a world, and a path"
                                  : "one behind the elevation file or world, or give --orbit");
    }
    return vd_success();
}

static vd_status read_settings(int argc, char **argv, vd_options *options,
                               vd_world_content *content, char **path, vd_fly_settings *out,
                               bool *help) {
    vd_status status = vd_options_parse(options, argc, argv);
    *help = status.code == VD_OK && options->values[OPTION_HELP].number != 0.0;
    if (status.code != VD_OK || *help) {
        return status;
    }
    status = take_path(options, path);
    if (status.code == VD_OK) {
        status = vd_render_read_files(options, content);
    }
    if (status.code == VD_OK) {
        status = vd_fly_settings_read(options, *path, out);
    }
    return vd_world_file_blame(options, content, &status);
}

int vd_command_fly(int argc, char **argv) {
    const double start = vd_seconds_now();
    vd_option table[FLY_COUNT];
    vd_options options;
    vd_fly_settings settings;
    vd_world_content content = {.name = NULL};
    char *path = NULL;
    bool help = false;
    vd_fly_make_table(table);
    vd_status status = vd_options_init(&options, "fly", table, FLY_COUNT);
    if (status.code != VD_OK) {
        return vd_report(&status, 1);
    }
    status = read_settings(argc, argv, &options, &content, &path, &settings, &help);
    int code = status.code == VD_ERROR_ARGUMENT ? 2 : 1;
    if (status.code == VD_OK && !help) {
        status = check_outputs(&settings);
        code = status.code == VD_ERROR_ARGUMENT ? 2 : 1;
    }
    vd_catch_signals();
    char *command = vd_quote_command("veduta", argc, argv);
    if (help) {
        print_help();
        code = 0;
    } else if (status.code != VD_OK) {
        vd_report(&status, code);
    } else {
        code = run_fly(&settings, &content, command != NULL ? command : "veduta fly", options.note,
                       start);
    }
    free(command);
    free(path);
    vd_world_content_finish(&content);
    vd_options_finish(&options);
    return code;
}

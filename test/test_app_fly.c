/* test_app_fly.c: `veduta fly` from outside: the videos as ffprobe sees them, interruption,
 * continuation, the path's figures, and what is refused. Tests of videos need ffmpeg and ffprobe,
 * and are skipped without. */
#include "support.h"

#include <dirent.h>
#include <fcntl.h>
#include <math.h>
#include <signal.h>
#include <spawn.h>
#include <stdio.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>
#include <veduta/picture.h>

extern char **environ;

static const char *const program = VEDUTA_BINARY_DIR "/veduta";
static const char *const dem = VEDUTA_SOURCE_DIR "/data/mont-blanc.png";

/* One run: exit status and what it printed. */
static struct {
    int status;
    char out[1 << 16], err[1 << 14];
} last;

static void read_back(const char *path, char *out, size_t out_bytes) {
    FILE *file = fopen(path, "rb");
    size_t length = file != NULL ? fread(out, 1, out_bytes - 1, file) : 0;
    out[length] = '\0';
    if (file != NULL) {
        fclose(file);
    }
}

/* Starts a program; the first argument is its name. */
static pid_t start(const char *const *arguments, int count) {
    char *argv[48] = {NULL};
    for (int i = 0; i < count; i++) {
        argv[i] = (char *)arguments[i];
    }
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_addopen(&actions, 0, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_addopen(&actions, 1, "out.txt", O_WRONLY | O_CREAT | O_TRUNC, 0644);
    posix_spawn_file_actions_addopen(&actions, 2, "err.txt", O_WRONLY | O_CREAT | O_TRUNC, 0644);
    pid_t child = 0;
    int error = posix_spawnp(&child, argv[0], &actions, NULL, argv, environ);
    posix_spawn_file_actions_destroy(&actions);
    return error == 0 ? child : 0;
}

static int finish(pid_t child) {
    int status = 0;
    if (child == 0) {
        return last.status = 127;
    }
    assert_int_equal(waitpid(child, &status, 0), child);
    last.status = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    read_back("out.txt", last.out, sizeof last.out);
    read_back("err.txt", last.err, sizeof last.err);
    return last.status;
}

/* Every run: the small world first. Each sample is 70 m wide. */
#define FLY_START(...)                                                                             \
    start((const char *[]){program, "fly", dem, "--cell-size", "70", "-s", "64x36", __VA_ARGS__},  \
          (int)(sizeof((const char *[]){program, "fly", dem, "--cell-size", "70", "-s", "64x36",   \
                                        __VA_ARGS__}) /                                            \
                sizeof(char *)))
#define FLY(...) finish(FLY_START(__VA_ARGS__))
#define CALL(...)                                                                                  \
    finish(start((const char *[]){__VA_ARGS__},                                                    \
                 (int)(sizeof((const char *[]){__VA_ARGS__}) / sizeof(char *))))

static void expect_text(const char *text, const char *part) {
    if (strstr(text, part) == NULL) {
        fail_msg("\"%s\" is not in: %.600s%.600s", part, text, last.err);
    }
}

static void expect_success(int status) {
    if (status != 0) {
        fail_msg("exit status %d: %s", status, last.err);
    }
}

#define SUCCEEDS(...) expect_success(FLY(__VA_ARGS__))

/* Expects one sentence that holds `part`, and nothing on standard output. */
static void expect_failure(int got, int status, const char *part) {
    expect_text(last.err, part);
    assert_int_equal(got, status);
    assert_string_equal(last.out, "");
    const char *line = strstr(last.err, "veduta: ");
    assert_ptr_equal(line, last.err);
}

#define FAILS(status, part, ...) expect_failure(FLY(__VA_ARGS__), status, part)

static bool exists(const char *path) {
    return access(path, F_OK) == 0;
}

static void write_file(const char *path, const char *text) {
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    assert_true(fputs(text, file) >= 0);
    fclose(file);
}

/* The number behind "key": in the last run's JSON, or behind key= in ffprobe's words. */
static double number_of(const char *key) {
    const char *at = strstr(last.out, key);
    if (at == NULL) {
        fail_msg("%s is not in: %.400s", key, last.out);
        return 0.0;
    }
    return strtod(at + strlen(key), NULL);
}

static bool has_ffmpeg(void) {
    return CALL("ffprobe", "-version") == 0 && CALL("ffmpeg", "-version") == 0;
}

#define NEEDS_FFMPEG()                                                                             \
    if (!has_ffmpeg()) {                                                                           \
        skip();                                                                                    \
    }

/* Decodes all of a video: expects no complaint, and returns how many frames it has. */
static int probe(const char *path, const char *codec, double fps) {
    expect_success(CALL("ffmpeg", "-v", "error", "-i", path, "-f", "null", "-"));
    assert_string_equal(last.err, "");
    expect_success(CALL("ffprobe", "-v", "error", "-count_frames", "-select_streams", "v:0",
                        "-show_entries",
                        "stream=codec_name,width,height,nb_read_frames:format=duration", "-of",
                        "default=noprint_wrappers=1", path));
    expect_text(last.out, codec);
    assert_int_equal((int)number_of("width="), 64);
    assert_int_equal((int)number_of("height="), 36);
    int frames = (int)number_of("nb_read_frames=");
    double duration = number_of("duration=");
    if (fabs(duration - frames / fps) > 0.021) { /* GIF counts hundredths, WebM thousandths */
        fail_msg("%s: %g s for %d frames", path, duration, frames);
    }
    return frames;
}

static uint64_t picture_hash(const char *path) {
    vd_context *context = NULL;
    vd_picture *picture = NULL;
    assert_ok(vd_context_create(NULL, &context));
    assert_ok(vd_picture_load(context, path, &picture));
    uint64_t hash = 1469598103934665603u;
    for (int y = 0; y < picture->height; y++) {
        for (int x = 0; x < picture->width; x++) {
            vd_rgba8 c = vd_picture_color(picture, x, y);
            hash = (hash ^ c.r) * 1099511628211u;
            hash = (hash ^ c.g) * 1099511628211u;
            hash = (hash ^ c.b) * 1099511628211u;
        }
    }
    vd_picture_destroy(&picture);
    vd_context_destroy(&context);
    return hash;
}

/* A flight of 4 s at 400 m/s. */
static const char path_json[] =
    "{\"veduta_path\": 1, \"speed\": 400, \"ease\": false, \"keyframes\": [\n"
    " {\"eye\": [20000, -20000], \"height\": 900, \"pitch\": -20},\n"
    " {\"eye\": [20500, -19500], \"height\": 900, \"pitch\": -20},\n"
    " {\"eye\": [21000, -19500], \"height\": 900, \"pitch\": -25, \"fov\": 60},\n"
    " {\"eye\": [21300, -19100], \"height\": 900, \"heading\": 70}]}\n";

/* ---- the tests --------------------------------------------------------------------------------
 */

static void videos_are_what_they_should_be(void **state) {
    (void)state;
    NEEDS_FFMPEG();
    SUCCEEDS("--orbit", "--duration", "1", "--fps", "12", "-o", "a.mp4");
    expect_text(last.err, "wrote a.mp4, 12 frames of 64x36, 1 s");
    assert_string_equal(last.out, "");
    assert_int_equal(probe("a.mp4", "codec_name=h264", 12), 12);
    SUCCEEDS("--orbit", "--duration", "1", "--fps", "12", "-o", "a.webm", "--quality", "40");
    assert_int_equal(probe("a.webm", "codec_name=vp9", 12), 12);
    SUCCEEDS("--orbit", "--duration", "1", "--fps", "10", "-o", "a.gif", "-q");
    assert_int_equal(probe("a.gif", "codec_name=gif", 10), 10);
    assert_string_equal(last.err, "");
    /* Nothing is left beside them. */
    DIR *folder = opendir(".");
    for (struct dirent *e = readdir(folder); e != NULL; e = readdir(folder)) {
        assert_null(strstr(e->d_name, ".part"));
    }
    closedir(folder);
}

/* The colours of a video are those of the pictures. */
static void colors_are_kept(void **state) {
    (void)state;
    NEEDS_FFMPEG();
    SUCCEEDS("--orbit", "--duration", "0.5", "--fps", "8", "-o", "c.mp4", "--quality", "100");
    SUCCEEDS("--orbit", "--duration", "0.5", "--fps", "8", "-o", "c-%03d.png");
    expect_success(CALL("ffmpeg", "-v", "error", "-y", "-i", "c.mp4", "-frames:v", "1", "-update",
                        "1", "-vf", "scale=in_color_matrix=bt709:in_range=tv", "back.png"));
    assert_true(CALL(program, "compare", "c-000.png", "back.png", "--json") <= 1); /* 1: differ */
    if (number_of("\"rms\": ") > 6.0) {
        fail_msg("the video's colours are off: %.400s", last.out);
    }
}

static void pictures_are_numbered(void **state) {
    (void)state;
    write_file("path.json", path_json);
    SUCCEEDS("path.json", "--fps", "5", "--duration", "1", "-o", "n{:03}.png");
    assert_true(exists("n000.png") && exists("n004.png") && !exists("n005.png"));
    SUCCEEDS("path.json", "--fps", "5", "--duration", "1", "-o", "p%02d.png", "--json");
    assert_int_equal((int)number_of("\"done\": "), 5);
    assert_int_equal((int)number_of("\"frames\": "), 5);
    assert_int_equal(picture_hash("n003.png"), picture_hash("p03.png"));
}

/* The same bytes whatever overlaps, and however many threads. */
static void frames_do_not_depend_on_the_overlap(void **state) {
    (void)state;
    write_file("path.json", path_json);
    SUCCEEDS("path.json", "--fps", "4", "--duration", "2", "-o", "one{}.png", "--in-flight", "1",
             "--threads", "1");
    SUCCEEDS("path.json", "--fps", "4", "--duration", "2", "-o", "many{}.png", "--in-flight", "8",
             "--threads", "5");
    for (int i = 0; i < 8; i++) {
        char one[32], many[32];
        snprintf(one, sizeof one, "one%d.png", i);
        snprintf(many, sizeof many, "many%d.png", i);
        assert_int_equal(picture_hash(one), picture_hash(many));
    }
}

static void interruption_leaves_a_video(void **state) {
    (void)state;
    NEEDS_FFMPEG();
    static const char *const names[][2] = {
        {"i.mp4", "codec_name=h264"}, {"i.webm", "codec_name=vp9"}, {"i.gif", "codec_name=gif"}};
    for (int kind = 0; kind < (test_is_reduced() ? 1 : 3); kind++) {
        pid_t child = FLY_START("--orbit", "--duration", "10000", "--fps", "10", "-o",
                                names[kind][0], "--progress", "json");
        struct stat info;
        for (int i = 0; i < 400; i++) { /* until it says that frames are done */
            nanosleep(&(struct timespec){0, 50 * 1000 * 1000}, NULL);
            if (stat("out.txt", &info) == 0 && info.st_size > 200) {
                break;
            }
        }
        assert_false(exists(names[kind][0]));
        kill(child, SIGINT);
        assert_int_equal(finish(child), 1);
        expect_text(last.err, "veduta: interrupted; i.");
        const char *first = strstr(last.err, "the first ");
        assert_non_null(first);
        int frames = (int)strtol(first + 10, NULL, 10);
        assert_true(frames > 0);
        assert_int_equal(probe(names[kind][0], names[kind][1], 10), frames);
    }
}

/* Stopped by any means and continued, the pictures are the same, and those that were there were not
 * drawn again. */
static void resume_gives_the_same_pictures(void **state) {
    (void)state;
    write_file("path.json", path_json);
    SUCCEEDS("path.json", "--fps", "5", "--duration", "2", "-o", "r{:03}.png");
    uint64_t hashes[10];
    for (int i = 0; i < 10; i++) {
        char name[32];
        snprintf(name, sizeof name, "r%03d.png", i);
        hashes[i] = picture_hash(name);
        if (i == 2 || i == 7) {
            unlink(name);
        }
    }
    assert_int_equal(truncate("r005.png", 900), 0); /* as a full disk would leave it */
    SUCCEEDS("path.json", "--fps", "5", "--duration", "2", "-o", "r{:03}.png", "--resume",
             "--json");
    assert_int_equal((int)number_of("\"drawn\": "), 3);
    assert_int_equal((int)number_of("\"taken\": "), 7);
    for (int i = 0; i < 10; i++) {
        char name[32];
        snprintf(name, sizeof name, "r%03d.png", i);
        assert_int_equal(picture_hash(name), hashes[i]);
    }
    /* Pictures of another look, camera or size are not taken for these. */
    SUCCEEDS("path.json", "--fps", "5", "--duration", "2", "-o", "r{:03}.png", "--resume", "--json",
             "--sun", "100,30");
    assert_int_equal((int)number_of("\"taken\": "), 0);
    SUCCEEDS("path.json", "--fps", "5", "--duration", "2.4", "-o", "r{:03}.png", "--resume",
             "--json", "--sun", "100,30");
    assert_true((int)number_of("\"taken\": ") <= 1); /* the first has the same camera */
}

/* A video from the pictures of another, without drawing. */
static void frames_are_encoded_again(void **state) {
    (void)state;
    NEEDS_FFMPEG();
    write_file("path.json", path_json);
    mkdir("shots", 0755);
    SUCCEEDS("path.json", "--fps", "5", "--duration", "2", "-o", "s.mp4", "--frames", "shots");
    assert_true(exists("shots/frame-00009.png"));
    assert_int_equal(probe("s.mp4", "h264", 5), 10);
    unlink("shots/frame-00004.png");
    SUCCEEDS("path.json", "--fps", "5", "--duration", "2", "-o", "s.webm", "--frames", "shots",
             "--resume", "--json", "--quality", "90");
    assert_int_equal((int)number_of("\"drawn\": "), 1);
    assert_int_equal((int)number_of("\"taken\": "), 9);
    assert_true(exists("shots/frame-00004.png"));
    assert_int_equal(probe("s.webm", "vp9", 5), 10);
    FAILS(2, "--resume: a video cannot be continued", "path.json", "-o", "s.mp4", "--resume");
    FAILS(2, "--frames: the output is pictures already", "path.json", "-o", "{}.png", "--frames",
          "shots");
    FAILS(2, "neither a folder nor a name", "path.json", "-o", "s.mp4", "--frames", "none");
}

static void resting_cameras_are_drawn_once(void **state) {
    (void)state;
    write_file("rest.json",
               "{\"veduta_path\": 1, \"ease\": false, \"keyframes\": ["
               "{\"time\": 0, \"eye\": [20000, -20000, 6000], \"heading\": 0, \"pitch\": -30},"
               "{\"time\": 2, \"eye\": [20000, -20000, 6000], \"heading\": 0, \"pitch\": -30},"
               "{\"time\": 3, \"eye\": [21000, -20000, 6000], \"heading\": 0, \"pitch\": -30}]}");
    SUCCEEDS("rest.json", "--fps", "5", "-o", "t{:02}.png", "--json");
    assert_int_equal((int)number_of("\"frames\": "), 15);
    assert_int_equal((int)number_of("\"repeated\": "), 10);
    assert_int_equal((int)number_of("\"drawn\": "), 5);
    assert_int_equal(picture_hash("t00.png"), picture_hash("t10.png"));
    assert_int_not_equal(picture_hash("t10.png"), picture_hash("t11.png"));
}

static void preview_says_length_and_clearance(void **state) {
    (void)state;
    write_file("path.json", path_json);
    SUCCEEDS("path.json", "--preview", "-o", "map.png");
    expect_text(last.out, "path        keyframes, 4 keyframes\n");
    expect_text(last.out, "length      1");
    expect_text(last.out, "clearance   ");
    assert_true(exists("map.png"));
    SUCCEEDS("path.json", "--preview", "--json");
    double length = number_of("\"length_m\": "), duration = number_of("\"duration\": ");
    assert_true(length > 1700.0 && length < 2500.0);
    assert_true(fabs(duration - length / 400.0) < 0.02 * duration);
    double before = number_of("\"before_m\": ");
    assert_true(before > 100.0);
    SUCCEEDS("path.json", "--preview", "--json", "--clearance", "1500");
    assert_true(number_of("\"lowest_m\": ") >= 1500.0);
    assert_true(number_of("\"before_m\": ") == before);
    assert_true(number_of("\"lifted_m\": ") >= 1500.0 - before - 1.0);
    FAILS(2, "is a PNG", "path.json", "--preview", "-o", "map.mp4");
}

/* Memory does not grow with the path: forty frames take what four hundred do. */
static void memory_is_flat(void **state) {
    (void)state;
    write_file("path.json", path_json);
    double peaks[2];
    for (int i = 0; i < 2; i++) {
        SUCCEEDS("path.json", "-o", "flat.mp4", "-s", "64x36", "--fps", "40", "--duration",
                 i == 0              ? "1"
                 : test_is_reduced() ? "3"
                                     : "10",
                 "--json");
        assert_int_equal((int)number_of("\"frames\": "), i == 0              ? 40
                                                         : test_is_reduced() ? 120
                                                                             : 400);
        peaks[i] = number_of("\"memory_peak_bytes\": ");
    }
    assert_true(peaks[0] > 1e5 && peaks[1] == peaks[0]);
}

static void dry_runs_write_nothing(void **state) {
    (void)state;
    write_file("path.json", path_json);
    SUCCEEDS("path.json", "--dry-run", "-o", "dry{}.png", "--fps", "10");
    expect_text(last.out, " frames, ");
    expect_text(last.out, " MiB of memory, about ");
    assert_false(exists("dry0.png"));
    SUCCEEDS("path.json", "-n", "-o", "dry{}.png", "--json", "--duration", "3");
    assert_int_equal((int)number_of("\"frames\": "), 90);
    assert_true(number_of("\"output_bytes\": ") > 1000.0);
}

static void progress_is_json_lines(void **state) {
    (void)state;
    SUCCEEDS("--orbit", "--duration", "1", "--fps", "6", "-o", "j{}.png", "--progress", "json");
    char *tail = strstr(last.out, "{\"frame\": 6, \"frames\": 6, \"seconds\": ");
    assert_non_null(tail);
    assert_true(number_of("\"seconds_left\": ") >= 0.0);
}

static void tracks_are_walked(void **state) {
    (void)state;
    write_file("track.json", "{\"veduta_path\": 1, \"track\": {\"height\": 250, \"speed\": 300, "
                             "\"points\": [[15000, -15000], [16500, -15500], [17000, -17000], "
                             "[19000, -16800]]}}");
    SUCCEEDS("track.json", "--preview", "--json");
    assert_true(number_of("\"length_m\": ") > 4500.0);
    assert_true(number_of("\"lowest_m\": ") >= 10.0);
    SUCCEEDS("track.json", "--fps", "2", "--duration", "1.5", "--above", "2", "-o", "w{}.png",
             "--json");
    assert_true(number_of("\"lowest_m\": ") >= 1.0);
    assert_int_equal((int)number_of("\"done\": "), 3);
}

static const char *const dem_tif = VEDUTA_SOURCE_DIR "/data/mont-blanc.tif";

/* Tracks as GPX and GeoJSON, with heights and without, over a map that says where it lies. */
static void track_files_are_walked(void **state) {
    (void)state;
    if (CALL(program, "info", dem_tif) != 0) {
        skip(); /* without GDAL */
    }
    write_file("hike.gpx",
               "<?xml version=\"1.0\"?><gpx version=\"1.1\" creator=\"t\" "
               "xmlns=\"http://www.topografix.com/GPX/1/1\"><wpt lat=\"45.9\" lon=\"6.85\"/>"
               "<trk><name>up</name><trkseg><trkpt lat=\"45.87\" lon=\"6.80\"/><trkpt "
               "lat=\"45.88\" lon=\"6.83\"/></trkseg><trkseg><trkpt lat=\"45.885\" "
               "lon=\"6.85\"/><trkpt lat=\"45.89\" lon=\"6.87\"/></trkseg></trk></gpx>");
    write_file("hike.geojson",
               "{\"type\": \"LineString\", \"coordinates\": [[6.80, 45.87, 9000], [6.83, 45.88, "
               "9000], [6.85, 45.885, 9000], [6.87, 45.89, 9000]]}");
    write_file("places.geojson", "{\"type\": \"Point\", \"coordinates\": [6.8, 45.87]}");
    static const char *const files[] = {"hike.gpx", "hike.geojson"};
    double lengths[2];
    for (int i = 0; i < 2; i++) { /* above the ground both, whatever heights they have */
        expect_success(CALL(program, "fly", dem_tif, files[i], "--preview", "--json", "--above",
                            "300", "--clearance", "0"));
        lengths[i] = number_of("\"length_m\": ");
        assert_true(number_of("\"lowest_m\": ") > 30.0 && number_of("\"lowest_m\": ") < 301.0);
    }
    assert_true(lengths[0] > 5500.0 && fabs(lengths[0] - lengths[1]) < 1.0);
    write_file("own.json", "{\"veduta_path\": 1, \"track\": {\"file\": \"hike.geojson\", "
                           "\"own_heights\": true, \"height\": 10}}");
    expect_success(CALL(program, "fly", dem_tif, "own.json", "--preview", "--json"));
    assert_true(number_of("\"lowest_m\": ") > 4000.0);
    expect_success(CALL(program, "fly", dem_tif, "hike.gpx", "-s", "32x18", "--fps", "1",
                        "--duration", "2", "-o", "g{}.png"));
    assert_true(exists("g1.png"));
    assert_int_equal(CALL(program, "fly", dem_tif, "places.geojson", "--preview"), 1);
    expect_text(last.err, "places.geojson holds no track");
    assert_int_equal(CALL(program, "fly", dem, "hike.gpx", "--preview"), 1);
    expect_text(last.err, "no georeference");
    /* Keyframes by longitude and latitude. */
    write_file("at.json", "{\"veduta_path\": 1, \"keyframes\": [{\"at\": [6.80, 45.87], "
                          "\"height\": 900, \"look_at\": [6.865, 45.8326]}, {\"at\": [6.87, "
                          "45.89], \"masl\": 4000, \"look_at\": [6.865, 45.8326]}]}");
    expect_success(CALL(program, "fly", dem_tif, "at.json", "--preview", "--json"));
    assert_true(number_of("\"length_m\": ") > 5500.0);
}

/* ---- what is refused --------------------------------------------------------------------------
 */

static void ffmpeg_may_be_missing(void **state) {
    (void)state;
    char *path = strdup(getenv("PATH"));
    assert_non_null(path);
    setenv("PATH", "/nowhere", 1);
    int got = FLY("--orbit", "-o", "m.mp4");
    bool named = strstr(last.err, "apt install ffmpeg") != NULL &&
                 strstr(last.err, "frame-{:05}.png") != NULL;
    int pictures = FLY("--orbit", "--duration", "0.2", "--fps", "5", "-o", "m{}.png");
    setenv("PATH", path, 1);
    free(path);
    assert_int_equal(got, 1);
    assert_true(named);
    assert_int_equal(pictures, 0);
}

/* An ffmpeg that fails: its words are told, and no file is left. */
static void ffmpeg_may_fail(void **state) {
    (void)state;
    char *path = strdup(getenv("PATH"));
    assert_non_null(path);
    mkdir("bin", 0755);
    write_file("bin/ffmpeg", "#!/bin/sh\necho 'Unknown encoder libx264' >&2\nexit 3\n");
    chmod("bin/ffmpeg", 0755);
    char folder[4096], both[8192];
    assert_non_null(getcwd(folder, sizeof folder));
    snprintf(both, sizeof both, "%s/bin:%s", folder, path);
    setenv("PATH", both, 1);
    int got = FLY("--orbit", "--duration", "1", "-o", "x.mp4");
    setenv("PATH", path, 1);
    free(path);
    expect_failure(got, 1, "failed with status 3: Unknown encoder libx264");
    assert_false(exists("x.mp4"));
}

static void bad_use_is_refused(void **state) {
    (void)state;
    write_file("path.json", path_json);
    FAILS(2, "there is no path", "-o", "x.mp4");
    FAILS(2, "are two paths", "path.json", "--orbit");
    FAILS(2, "ends in none of .mp4", "path.json", "-o", "x.avi");
    FAILS(2, "no place for the frame's number", "path.json", "-o", "x.png");
    FAILS(2, "or several", "path.json", "-o", "x{}{}.png");
    FAILS(2, "here the path says where the camera is", "path.json", "--azimuth", "30");
    FAILS(2, "leave it out", "path.json", "--wireframe");
    FAILS(2, "did you mean --fps", "path.json", "--fpz", "30");
    FAILS(2, "--quality: 0 is out of range", "path.json", "--quality", "0");
    FAILS(1, "there is no folder", "path.json", "-o", "nowhere/x{}.png");
    if (has_ffmpeg()) {
        FAILS(2, "give 66x36", "path.json", "-s", "65x36", "-o", "x.mp4");
    }
    expect_success(CALL(program, "fly", "--help"));
    expect_text(last.out, "--look-ahead");
    assert_null(strstr(last.out, "--azimuth"));
}

static void bad_paths_are_refused(void **state) {
    (void)state;
    static const struct {
        const char *json, *part;
    } cases[] = {
        {"{\"veduta_path\": 1, \"keyframes\": [", "line 1, column"},
        {"[1, 2]", "\"veduta_path\": 1 is missing"},
        {"{\"veduta_path\": 2, \"orbit\": {}}", "is not 1"},
        {"{\"veduta_path\": 1}", "no way to fly"},
        {"{\"veduta_path\": 1, \"orbit\": {}, \"keyframes\": []}", "several ways"},
        {"{\"veduta_path\": 1, \"keyframes\": []}", "two keyframes at least and has 0"},
        {"{\"veduta_path\": 1, \"keyframes\": [{\"eye\": [1, 2, 3]}]}", "at least and has 1"},
        {"{\"veduta_path\": 1, \"keyframes\": [{\"eye\": [1, 2, 3]}, 5]}", "keyframe 2: it is not"},
        {"{\"veduta_path\": 1, \"keyframes\": [{\"eye\": [9000, -9000, 9000]}, {\"eye\": [9000, "
         "-9000, 9000]}]}",
         "keyframes 1 and 2 are at the same place"},
        {"{\"veduta_path\": 1, \"keyframes\": [{\"eye\": \"here\"}]}", "\"eye\" is not a list"},
        {"{\"veduta_path\": 1, \"keyframes\": [{\"time\": 1}]}", "where the camera is"},
        {"{\"veduta_path\": 1, \"keyframes\": [{\"eye\": [1, 2]}]}",
         "keyframe 1: there is no ground"},
        {"{\"veduta_path\": 1, \"keyframes\": [{\"at\": [6.8, 45.8], \"height\": 100}]}",
         "no georeference"},
        {"{\"veduta_path\": 1, \"keyframes\": [{\"at\": [680, 458]}]}", "not on the Earth"},
        {"{\"veduta_path\": 1, \"keyframes\": [{\"eye\": [1, 2, 3], \"fov\": 190}]}",
         "\"fov\" is out of range; give 0.001 to 179"},
        {"{\"veduta_path\": 1, \"keyframes\": [{\"eye\": [1, 2, 3], \"time\": 0}, {\"eye\": [1, 2, "
         "4]}]}",
         "it has no \"time\""},
        {"{\"veduta_path\": 1, \"keyframes\": [{\"eye\": [1, 2, 3], \"time\": 5}, {\"eye\": [1, 2, "
         "4], \"time\": 5}]}",
         "is not after keyframe 1's"},
        {"{\"veduta_path\": 1, \"loop\": 3, \"orbit\": {}}", "neither true nor false"},
        {"{\"veduta_path\": 1, \"orbit\": {\"radius\": 0}}", "orbit: \"radius\" is out of range"},
        {"{\"veduta_path\": 1, \"orbit\": {\"turns\": 0}}", "turns is 0"},
        {"{\"veduta_path\": 1, \"track\": {}}", "track: it has no points"},
        {"{\"veduta_path\": 1, \"track\": {\"points\": [[9000, -9000]]}}", "the track has 1 point"},
        {"{\"veduta_path\": 1, \"track\": {\"points\": [[9000, -9000], [9000, -9000]]}}",
         "at one place"},
        {"{\"veduta_path\": 1, \"track\": {\"points\": [[9000, -9000], [9000]]}}",
         "point 2 is not"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        write_file("bad.json", cases[i].json);
        FAILS(1, cases[i].part, "bad.json", "--preview");
        expect_text(last.err, "bad.json");
    }
    FAILS(1, "cannot read none.json", "none.json", "--preview");
    /* A misspelled key is told, with the nearest one. */
    write_file("near.json", "{\"veduta_path\": 1, \"orbit\": {\"raduis\": 3000}}");
    SUCCEEDS("near.json", "--preview");
    expect_text(last.err, "\"raduis\" is not known; did you mean \"radius\"?");
}

static int set_up(void **state) {
    (void)state;
    static char folder[] = VEDUTA_BINARY_DIR "/test-app-fly-XXXXXX";
    return mkdtemp(folder) == NULL || chdir(folder) != 0;
}

static int tear_down(void **state) {
    (void)state;
    char folder[4096], command[4200];
    if (getcwd(folder, sizeof folder) == NULL || strstr(folder, "/test-app-fly-") == NULL) {
        return 1;
    }
    snprintf(command, sizeof command, "rm -rf '%s'", folder);
    return chdir("/") != 0 || system(command) != 0;
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(videos_are_what_they_should_be),
        cmocka_unit_test(colors_are_kept),
        cmocka_unit_test(pictures_are_numbered),
        cmocka_unit_test(frames_do_not_depend_on_the_overlap),
        cmocka_unit_test(interruption_leaves_a_video),
        cmocka_unit_test(resume_gives_the_same_pictures),
        cmocka_unit_test(frames_are_encoded_again),
        cmocka_unit_test(resting_cameras_are_drawn_once),
        cmocka_unit_test(preview_says_length_and_clearance),
        cmocka_unit_test(memory_is_flat),
        cmocka_unit_test(dry_runs_write_nothing),
        cmocka_unit_test(progress_is_json_lines),
        cmocka_unit_test(tracks_are_walked),
        cmocka_unit_test(track_files_are_walked),
        cmocka_unit_test(ffmpeg_may_be_missing),
        cmocka_unit_test(ffmpeg_may_fail),
        cmocka_unit_test(bad_use_is_refused),
        cmocka_unit_test(bad_paths_are_refused),
    };
    return cmocka_run_group_tests(tests, set_up, tear_down);
}

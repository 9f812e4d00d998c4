/* video.c: the ffmpeg program at the far end of a pipe. */
#define _GNU_SOURCE /* pipe2, F_SETPIPE_SZ */
#include "video.h"

#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include "render_settings.h"

extern char **environ;

/* ---- names ------------------------------------------------------------------------------------
 */

/* Finds the next place for a number: {}, {:05}, %d, %05d. Returns its first byte and, behind it,
 * where it ends and how many digits it wants; null when there is none. */
static const char *find_number(const char *text, const char **end, int *digits) {
    for (const char *at = text; *at != '\0'; at++) {
        const char *p = at + 1;
        if (*at == '{') {
            p += *p == ':';
        } else if (*at != '%') {
            continue;
        }
        int wide = 0, length = 0;
        for (; *p >= '0' && *p <= '9' && length < 3; p++, length++) {
            wide = 10 * wide + (*p - '0');
        }
        if (*p == (*at == '{' ? '}' : 'd') && wide <= 12) {
            *end = p + 1;
            *digits = wide;
            return at;
        }
    }
    return NULL;
}

bool vd_frame_name(const char *pattern, int number, char *out, size_t out_bytes) {
    const char *end = NULL, *more = NULL;
    int digits = 0, unused = 0;
    const char *at = find_number(pattern, &end, &digits);
    if (at == NULL || find_number(end, &more, &unused) != NULL) {
        return false;
    }
    int length =
        snprintf(out, out_bytes, "%.*s%0*d%s", (int)(at - pattern), pattern, digits, number, end);
    return length >= 0 && (size_t)length < out_bytes;
}

static const struct {
    const char *ending, *format;
} kinds[] = {[VD_VIDEO_MP4] = {".mp4", "mp4"},
             [VD_VIDEO_WEBM] = {".webm", "webm"},
             [VD_VIDEO_GIF] = {".gif", "gif"},
             [VD_VIDEO_FRAMES] = {".png", NULL}};

vd_status vd_video_kind_of(const char *option, const char *path, vd_video_kind *out) {
    for (int kind = 0; kind < VD_VIDEO_KIND_COUNT; kind++) {
        if (!vd_ends_with(path, kinds[kind].ending)) {
            continue;
        }
        char name[4096];
        if (kind == VD_VIDEO_FRAMES && !vd_frame_name(path, 0, name, sizeof name)) {
            return vd_failure(VD_ERROR_ARGUMENT,
                              "--%s: %.160s has no place for the frame's number, or several; give "
                              "one such as frame-{:05}.png, or a video's name: .mp4, .webm, .gif",
                              option, path);
        }
        *out = (vd_video_kind)kind;
        return vd_success();
    }
    return vd_failure(VD_ERROR_ARGUMENT,
                      "--%s: %.160s ends in none of .mp4, .webm, .gif and .png; give one of them "
                      "(numbered pictures: frame-{:05}.png)",
                      option, path);
}

/* ---- ffmpeg -----------------------------------------------------------------------------------
 */

static vd_status no_ffmpeg(void) {
    return vd_failure(VD_ERROR_UNSUPPORTED,
                      "there is no ffmpeg program, which writes .mp4, .webm and .gif; install it "
                      "(apt install ffmpeg), or write numbered pictures, which need none: -o "
                      "frame-{:05}.png");
}

/* Whether PATH leads to an ffmpeg. */
static bool find_ffmpeg(void) {
    const char *path = getenv("PATH");
    for (path = path != NULL ? path : "/usr/local/bin:/usr/bin:/bin";; path++) {
        size_t length = strcspn(path, ":");
        char name[4096];
        snprintf(name, sizeof name, "%.*s%sffmpeg", (int)length, path, length > 0 ? "/" : "");
        struct stat info;
        if (stat(name, &info) == 0 && S_ISREG(info.st_mode) && access(name, X_OK) == 0) {
            return true;
        }
        path += length;
        if (*path == '\0') {
            return false;
        }
    }
}

vd_status vd_video_check(const vd_video_def *def) {
    if (def->kind == VD_VIDEO_FRAMES) {
        return vd_success();
    }
    const int w = def->width, h = def->height;
    if (def->kind != VD_VIDEO_GIF && (w % 2 != 0 || h % 2 != 0)) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "--size: %s video (4:2:0) has even sides only, and %dx%d is not; give "
                          "%dx%d, or write numbered pictures",
                          kinds[def->kind].ending, w, h, w + w % 2, h + h % 2);
    }
    if (w > 16384 || h > 16384) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "--size: %dx%d is more than the 16384 a side that video players know; "
                          "give less, or write numbered pictures",
                          w, h);
    }
    return find_ffmpeg() ? vd_success() : no_ffmpeg();
}

struct vd_video {
    vd_video_kind kind;
    char *path, *beside; /* owned */
    pid_t child;
    int pipe;       /* -1 once closed */
    FILE *messages; /* what ffmpeg says on standard error: a file without a name */
    uint8_t *rows;  /* a frame without the gaps between its rows */
    size_t frame_bytes;
    long frames;
};

/* The quality of 1 … 100 on an encoder's scale. */
static int scaled(int quality, double worst, double best) {
    return (int)(worst + (best - worst) * (quality - 1) / 99.0 + 0.5);
}

enum { MOST_ARGUMENTS = 48, TEXT_BYTES = 4200 };

typedef struct arguments {
    char *list[MOST_ARGUMENTS];
    int count;
    char size[32], rate[32], crf[16], filter[256], output[TEXT_BYTES];
} arguments;

static void add(arguments *a, const char *const *words, int count) {
    for (int i = 0; i < count && a->count + 1 < MOST_ARGUMENTS; i++) {
        a->list[a->count++] = (char *)words[i];
    }
    a->list[a->count] = NULL;
}

#define ADD(a, ...)                                                                                \
    add(a, (const char *[]){__VA_ARGS__},                                                          \
        (int)(sizeof((const char *[]){__VA_ARGS__}) / sizeof(char *)))

/* Our colours are sRGB. Video of today is BT.709 in the narrow range and says so: without these
 * words ffmpeg converts by BT.601, and players show other greens. */
static const char narrow[] =
    "scale=out_color_matrix=bt709:out_range=tv:flags=bicubic+accurate_rnd+full_chroma_int,"
    "format=yuv420p";

static void add_colors(arguments *a) {
    ADD(a, "-vf", narrow, "-colorspace", "bt709", "-color_primaries", "bt709", "-color_trc",
        "bt709", "-color_range", "tv");
}

static void make_arguments(const vd_video_def *def, const char *beside, arguments *a) {
    snprintf(a->size, sizeof a->size, "%dx%d", def->width, def->height);
    snprintf(a->rate, sizeof a->rate, "%.10g", def->fps);
    snprintf(a->output, sizeof a->output, "file:%s", beside);
    ADD(a, "ffmpeg", "-hide_banner", "-loglevel", "error", "-nostdin", "-y", "-f", "rawvideo",
        "-pixel_format", "rgb0", "-video_size", a->size, "-framerate", a->rate, "-i", "pipe:0");
    switch (def->kind) {
    case VD_VIDEO_WEBM:
        snprintf(a->crf, sizeof a->crf, "%d", scaled(def->quality, 56, 16));
        add_colors(a);
        ADD(a, "-c:v", "libvpx-vp9", "-b:v", "0", "-crf", a->crf, "-deadline", "good", "-cpu-used",
            "4", "-row-mt", "1");
        break;
    case VD_VIDEO_GIF:
        /* A palette for each frame: one for all of them would keep all of them in memory. The
         * ordered dither stands still where the picture does. */
        snprintf(a->filter, sizeof a->filter,
                 "split[a][b];[a]palettegen=stats_mode=single:max_colors=%d[p];[b][p]paletteuse="
                 "new=1:dither=bayer:bayer_scale=3",
                 scaled(def->quality, 16, 256));
        ADD(a, "-filter_complex", a->filter, "-loop", "0");
        break;
    default:
        /* Of the presets veryfast: half of fast's time for the same bytes at 0.9938 against 0.9945
         * of SSIM, on mountains at 1920 x 1080. The index comes to the front when the file is
         * complete, for players on the web; an interruption completes it too. */
        snprintf(a->crf, sizeof a->crf, "%d", scaled(def->quality, 40, 14));
        add_colors(a);
        ADD(a, "-c:v", "libx264", "-preset", "veryfast", "-crf", a->crf, "-movflags", "+faststart");
        break;
    }
    ADD(a, "-f", kinds[def->kind].format, a->output);
}

/* Starts the program with the pipe as its standard input. It gets a process group of its own, so
 * that Ctrl-C reaches us alone and it sees no more than the end of its input. */
static int spawn(vd_video *video, char *const *list, int read_end) {
    posix_spawn_file_actions_t actions;
    posix_spawnattr_t attributes;
    sigset_t usual;
    sigemptyset(&usual);
    sigaddset(&usual, SIGPIPE);
    sigaddset(&usual, SIGINT);
    sigaddset(&usual, SIGTERM);
    posix_spawn_file_actions_init(&actions);
    posix_spawnattr_init(&attributes);
    posix_spawn_file_actions_adddup2(&actions, read_end, STDIN_FILENO);
    posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
    posix_spawn_file_actions_adddup2(&actions, fileno(video->messages), STDERR_FILENO);
    posix_spawnattr_setsigdefault(&attributes, &usual);
    posix_spawnattr_setpgroup(&attributes, 0);
    posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGDEF | POSIX_SPAWN_SETPGROUP);
    int error = posix_spawnp(&video->child, list[0], &actions, &attributes, list, environ);
    posix_spawnattr_destroy(&attributes);
    posix_spawn_file_actions_destroy(&actions);
    return error;
}

static void release(vd_video *video) {
    if (video->messages != NULL) {
        fclose(video->messages);
    }
    if (video->pipe >= 0) {
        close(video->pipe);
    }
    free(video->rows);
    free(video->beside);
    free(video->path);
    free(video);
}

vd_status vd_video_open(const vd_video_def *def, vd_video **out) {
    vd_video *video = calloc(1, sizeof *video);
    if (video == NULL) {
        return vd_failure(VD_ERROR_MEMORY, "out of memory while starting ffmpeg");
    }
    const size_t name_bytes = strlen(def->path) + 32;
    video->kind = def->kind;
    video->pipe = -1;
    video->frame_bytes = 4 * (size_t)def->width * (size_t)def->height;
    video->rows = malloc(video->frame_bytes);
    video->path = strdup(def->path);
    video->beside = malloc(name_bytes);
    if (video->rows == NULL || video->path == NULL || video->beside == NULL ||
        name_bytes + 8 > TEXT_BYTES) {
        release(video);
        return vd_failure(VD_ERROR_MEMORY, "out of memory while starting ffmpeg");
    }
    snprintf(video->beside, name_bytes, "%s.%ld.part", def->path, (long)getpid());
    arguments a = {.count = 0};
    make_arguments(def, video->beside, &a);
    int ends[2], error;
    video->messages = tmpfile();
    if (video->messages == NULL || pipe2(ends, O_CLOEXEC) != 0) {
        error = errno;
        release(video);
        return vd_failure(VD_ERROR_IO,
                          "cannot start ffmpeg: %s; check the folder for temporary "
                          "files and the limit of open ones",
                          strerror(error));
    }
    (void)fcntl(fileno(video->messages), F_SETFD, FD_CLOEXEC);
    (void)fcntl(ends[1], F_SETPIPE_SZ, 1 << 20); /* fewer switches; smaller works too */
    error = spawn(video, a.list, ends[0]);
    close(ends[0]);
    video->pipe = ends[1];
    if (error != 0) {
        release(video);
        return error == ENOENT ? no_ffmpeg()
                               : vd_failure(VD_ERROR_IO,
                                            "cannot start ffmpeg: %s; check the program, or write "
                                            "numbered pictures",
                                            strerror(error));
    }
    *out = video;
    return vd_success();
}

/* The last lines that ffmpeg said, in one. */
static void last_words(vd_video *video, char *out, size_t out_bytes) {
    long end = fseek(video->messages, 0, SEEK_END) == 0 ? ftell(video->messages) : 0;
    long most = (long)out_bytes - 1, from = end > most ? end - most : 0;
    size_t length = 0;
    if (end > 0 && fseek(video->messages, from, SEEK_SET) == 0) {
        length = fread(out, 1, (size_t)(end - from), video->messages);
    }
    while (length > 0 && (out[length - 1] == '\n' || out[length - 1] == ' ')) {
        length--;
    }
    out[length] = '\0';
    for (char *c = out; *c != '\0'; c++) {
        *c = (unsigned char)*c < ' ' ? ' ' : *c;
    }
    if (length == 0) {
        snprintf(out, out_bytes, "it said nothing");
    }
}

/* Closes the pipe, waits, and tells how ffmpeg ended. */
static vd_status wait_for_end(vd_video *video) {
    close(video->pipe);
    video->pipe = -1;
    int state = 0;
    pid_t ended;
    do {
        ended = waitpid(video->child, &state, 0);
    } while (ended < 0 && errno == EINTR);
    video->child = 0;
    if (ended > 0 && WIFEXITED(state) && WEXITSTATUS(state) == 0) {
        return vd_success();
    }
    char said[200], how[48];
    last_words(video, said, sizeof said);
    if (ended > 0 && WIFSIGNALED(state)) {
        snprintf(how, sizeof how, "was ended by signal %d", WTERMSIG(state));
    } else {
        snprintf(how, sizeof how, "failed with status %d", ended > 0 ? WEXITSTATUS(state) : -1);
    }
    return vd_failure(VD_ERROR_IO, "ffmpeg %s: %.190s; check its version and the disk", how, said);
}

vd_status vd_video_write(vd_video *video, const vd_frame *frame) {
    const size_t row_bytes = 4 * (size_t)frame->width;
    for (int y = 0; y < frame->height; y++) {
        memcpy(video->rows + (size_t)y * row_bytes, frame->rgba + 4 * frame->stride * (size_t)y,
               row_bytes);
    }
    for (size_t done = 0; done < video->frame_bytes;) {
        ssize_t wrote = write(video->pipe, video->rows + done, video->frame_bytes - done);
        if (wrote < 0 && errno == EINTR) {
            continue;
        }
        if (wrote < 0) {
            const int error = errno;
            vd_status status = wait_for_end(video);
            return status.code != VD_OK ? status
                                        : vd_failure(VD_ERROR_IO,
                                                     "ffmpeg takes no more frames: %s; check its "
                                                     "version and the disk",
                                                     strerror(error));
        }
        done += (size_t)wrote;
    }
    video->frames++;
    return vd_success();
}

uint64_t vd_video_bytes(const vd_video *video) {
    struct stat info;
    return stat(video->beside, &info) == 0 ? (uint64_t)info.st_size : 0;
}

vd_status vd_video_finish(vd_video **pointer, uint64_t *bytes) {
    vd_video *video = *pointer;
    *pointer = NULL;
    vd_status status = vd_success();
    if (video->child == 0) {
        status = vd_failure(VD_ERROR_IO, "ffmpeg ended too early");
    } else if (video->frames == 0) { /* it would complain that there is nothing to encode */
        kill(video->child, SIGTERM);
        (void)wait_for_end(video);
    } else {
        status = wait_for_end(video);
    }
    if (bytes != NULL) {
        *bytes = vd_video_bytes(video);
    }
    if (status.code != VD_OK || video->frames == 0) {
        unlink(video->beside);
    } else if (rename(video->beside, video->path) != 0) {
        status = vd_failure(VD_ERROR_IO, "cannot write %.160s: %s; choose another file",
                            video->path, strerror(errno));
        unlink(video->beside);
    }
    release(video);
    return status;
}

/* fly_run.c: a ring of frames between one thread that draws and others that encode. */
#include "fly_run.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include "png_text.h"

enum { MOST_SLOTS = 18, MOST_ITEMS = 32, MOST_ENCODERS = 8 };

/* A frame to be handed over. Several items may be of one slot: a camera that rests. */
typedef struct item {
    int slot, number;
    bool save; /* as a picture */
} item;

typedef struct flying {
    const vd_flight *flight;
    vd_flight_result result;
    double start;

    pthread_mutex_t lock; /* guards all below */
    pthread_cond_t changed;
    vd_frame *slots[MOST_SLOTS];
    int users[MOST_SLOTS]; /* items of it that are not done */
    int slot_count;
    item items[MOST_ITEMS];
    int first_item, item_count;
    bool ended;       /* no more items come */
    vd_status failed; /* of an encoder; then the rest is dropped */
    double shown;     /* when progress was shown last */

    vd_video *video; /* null: pictures alone */
    pthread_t encoders[MOST_ENCODERS];
    int encoder_count;
} flying;

int vd_flight_count(const vd_camera_path *path, double fps) {
    double frames = floor(vd_camera_path_duration(path) * fps + 0.5);
    return frames < 1.0 ? 1 : frames > 1e9 ? 1000000000 : (int)frames;
}

vd_camera vd_flight_camera(const vd_flight *flight, int number) {
    const vd_fly_settings *s = flight->settings;
    vd_camera camera;
    vd_camera_path_at(flight->path, number / s->video.fps, s->render.width, s->render.height,
                      &camera);
    return camera;
}

bool vd_camera_same(const vd_camera *a, const vd_camera *b) {
    const vd_quat p = a->orientation, q = b->orientation;
    const vd_lens k = a->lens, l = b->lens;
    return a->eye.x == b->eye.x && a->eye.y == b->eye.y && a->eye.z == b->eye.z && p.x == q.x &&
           p.y == q.y && p.z == q.z && p.w == q.w && k.fx == l.fx && k.fy == l.fy && k.cx == l.cx &&
           k.cy == l.cy && a->near_m == b->near_m && a->far_m == b->far_m &&
           a->projection == b->projection;
}

static int slot_count(const vd_flight *flight) {
    return flight->settings->in_flight;
}

size_t vd_flight_frame_bytes(const vd_flight *flight) {
    const vd_render_settings *s = &flight->settings->render;
    return (size_t)slot_count(flight) * 4 * vd_frame_stride(s->width) * (size_t)s->height;
}

/* ---- pictures that stay -----------------------------------------------------------------------
 */

static void write_identity(const vd_flight *flight, const vd_camera *c, char out[512]) {
    snprintf(out, 512, "%s %.17g %.17g %.17g %.17g %.17g %.17g %.17g %.17g %.17g", flight->look,
             c->eye.x, c->eye.y, c->eye.z, c->orientation.x, c->orientation.y, c->orientation.z,
             c->orientation.w, c->lens.fy, c->near_m);
}

/* Reads the size out of a PNG's head, and whether its last chunk is there. */
static bool read_head(const char *path, int *width, int *height) {
    static const unsigned char last[8] = {'I', 'E', 'N', 'D', 0xAE, 0x42, 0x60, 0x82};
    unsigned char b[24], end[8];
    FILE *file = fopen(path, "rb");
    bool complete = file != NULL && fread(b, 1, sizeof b, file) == sizeof b &&
                    memcmp(b, "\x89PNG\r\n\x1a\n", 8) == 0 && fseek(file, -8, SEEK_END) == 0 &&
                    fread(end, 1, sizeof end, file) == sizeof end &&
                    memcmp(end, last, sizeof end) == 0;
    if (complete) {
        *width = b[16] << 24 | b[17] << 16 | b[18] << 8 | b[19];
        *height = b[20] << 24 | b[21] << 16 | b[22] << 8 | b[23];
    }
    if (file != NULL) {
        fclose(file);
    }
    return complete;
}

bool vd_flight_has_picture(const vd_flight *flight, const char *path, const vd_camera *camera) {
    const vd_render_settings *s = &flight->settings->render;
    int width = 0, height = 0;
    if (!read_head(path, &width, &height) || width != s->width || height != s->height) {
        return false;
    }
    char wanted[512];
    write_identity(flight, camera, wanted);
    json_t *text = vd_png_read_text(path);
    const char *found = json_string_value(json_object_get(text, "veduta:frame"));
    bool same = found != NULL && strcmp(found, wanted) == 0;
    json_decref(text);
    return same;
}

/* Reads a picture into a frame as it was drawn. */
static vd_status load_picture(vd_context *context, const char *path, vd_frame *frame) {
    vd_picture *picture = NULL;
    vd_status status = vd_picture_load(context, path, &picture);
    if (status.code != VD_OK) {
        return status;
    }
    if (picture->width != frame->width || picture->height != frame->height) {
        vd_picture_destroy(&picture);
        return vd_failure(VD_ERROR_FORMAT, "%.200s has changed its size; remove it", path);
    }
    for (int y = 0; y < frame->height; y++) {
        uint8_t *to = frame->rgba + 4 * frame->stride * (size_t)y;
        for (int x = 0; x < frame->width; x++) {
            const vd_rgba8 c = vd_picture_color(picture, x, y);
            to[4 * x] = (uint8_t)((c.r * c.a + 127) / 255);
            to[4 * x + 1] = (uint8_t)((c.g * c.a + 127) / 255);
            to[4 * x + 2] = (uint8_t)((c.b * c.a + 127) / 255);
            to[4 * x + 3] = c.a;
        }
    }
    vd_picture_destroy(&picture);
    return vd_success();
}

static vd_status save_picture(flying *f, const vd_frame *frame, int number, uint64_t *bytes) {
    const vd_fly_settings *s = f->flight->settings;
    char name[4096], identity[512], software[40];
    (void)vd_frame_name(s->frames, number, name, sizeof name); /* checked before */
    const vd_camera camera = vd_flight_camera(f->flight, number);
    write_identity(f->flight, &camera, identity);
    snprintf(software, sizeof software, "veduta %s", vd_version());
    const vd_picture_text text[] = {
        {"Software", software}, {"veduta:command", f->flight->command}, {"veduta:frame", identity}};
    vd_png_def png = vd_png_def_default();
    png.level = s->render.png_level;
    png.text = text;
    png.text_count = 3;
    vd_status status = vd_frame_save_png(frame, name, &png);
    struct stat info;
    *bytes = status.code == VD_OK && stat(name, &info) == 0 ? (uint64_t)info.st_size : 0;
    return status;
}

/* ---- progress ---------------------------------------------------------------------------------
 */

/* Says how far it is, five times a second at most; with the lock held. */
static void show_progress(flying *f, bool last) {
    const vd_fly_settings *s = f->flight->settings;
    const double now = vd_seconds_now(), spent = now - f->start;
    if (!last && now - f->shown < 0.2) {
        return;
    }
    f->shown = now;
    const int done = f->result.done, count = f->flight->count;
    const double left = done > 0 ? spent * (count - done) / done : 0.0;
    const uint64_t bytes = f->video != NULL ? vd_video_bytes(f->video) : f->result.bytes;
    if (s->progress == VD_FLY_PROGRESS_JSON) {
        printf("{\"frame\": %d, \"frames\": %d, \"seconds\": %.3f, \"seconds_left\": %.3f, "
               "\"bytes\": %llu}\n",
               done, count, spent, left, (unsigned long long)bytes);
        fflush(stdout);
    } else if (s->progress == VD_FLY_PROGRESS_AUTO && !s->render.quiet && isatty(STDERR_FILENO)) {
        fprintf(stderr, "\rframe %d of %d, %.0f %%, %.0f s left, %.1f MB \033[K%s", done, count,
                100.0 * done / count, left, 1e-6 * (double)bytes, last ? "\r\033[K" : "");
    }
}

/* ---- encoding ---------------------------------------------------------------------------------
 */

static vd_status encode(flying *f, item it, uint64_t *bytes) {
    const vd_frame *frame = f->slots[it.slot];
    vd_status status = vd_success();
    if (it.save) {
        status = save_picture(f, frame, it.number, bytes);
    }
    if (status.code == VD_OK && f->video != NULL) {
        status = vd_video_write(f->video, frame);
    }
    return status;
}

static void *run_encoder(void *user) {
    flying *f = user;
    pthread_mutex_lock(&f->lock);
    for (;;) {
        while (f->item_count == 0 && !f->ended) {
            pthread_cond_wait(&f->changed, &f->lock);
        }
        if (f->item_count == 0) {
            break;
        }
        const item it = f->items[f->first_item];
        f->first_item = (f->first_item + 1) % MOST_ITEMS;
        f->item_count--;
        pthread_cond_broadcast(&f->changed);
        const bool drop = f->failed.code != VD_OK;
        pthread_mutex_unlock(&f->lock);
        uint64_t bytes = 0;
        vd_status status = drop ? vd_success() : encode(f, it, &bytes);
        pthread_mutex_lock(&f->lock);
        if (status.code != VD_OK && f->failed.code == VD_OK) {
            f->failed = status;
        }
        f->users[it.slot]--;
        f->result.bytes += bytes;
        f->result.done += status.code == VD_OK && !drop;
        show_progress(f, false);
        pthread_cond_broadcast(&f->changed);
    }
    pthread_mutex_unlock(&f->lock);
    return NULL;
}

/* ---- drawing ----------------------------------------------------------------------------------
 */

/* Waits for a frame that no one uses, another one than `keep` if there is one. -1: an encoder
 * failed. */
static int wait_for_slot(flying *f, int keep) {
    int found = -1;
    pthread_mutex_lock(&f->lock);
    while (f->failed.code == VD_OK) {
        for (int i = 0; i < f->slot_count && found < 0; i++) {
            found = f->users[i] == 0 && (i != keep || f->slot_count == 1) ? i : -1;
        }
        if (found >= 0) {
            break;
        }
        pthread_cond_wait(&f->changed, &f->lock);
    }
    pthread_mutex_unlock(&f->lock);
    return found;
}

/* False: an encoder failed. */
static bool hand_over(flying *f, item it) {
    pthread_mutex_lock(&f->lock);
    while (f->item_count == MOST_ITEMS && f->failed.code == VD_OK) {
        pthread_cond_wait(&f->changed, &f->lock);
    }
    const bool good = f->failed.code == VD_OK;
    if (good) {
        f->items[(f->first_item + f->item_count++) % MOST_ITEMS] = it;
        f->users[it.slot]++;
        pthread_cond_broadcast(&f->changed);
    }
    pthread_mutex_unlock(&f->lock);
    return good;
}

static void count_one(flying *f, int *which, bool done) {
    pthread_mutex_lock(&f->lock);
    ++*which;
    if (done) {
        f->result.done++;
        show_progress(f, false);
    }
    pthread_mutex_unlock(&f->lock);
}

/* Draws frame after frame. Returns the drawing's own failure. */
static vd_status draw_all(flying *f) {
    const vd_flight *flight = f->flight;
    const vd_fly_settings *s = flight->settings;
    int slot = -1; /* the last frame's, while it holds it */
    vd_camera last = {.near_m = 0.0};
    for (int number = 0; number < flight->count; number++) {
        if (vd_job_stopped(flight->job)) {
            return vd_failure(VD_ERROR_CANCELLED, "cancelled");
        }
        const vd_camera camera = vd_flight_camera(flight, number);
        char name[4096] = "";
        if (s->frames != NULL && !vd_frame_name(s->frames, number, name, sizeof name)) {
            return vd_failure(VD_ERROR_ARGUMENT, "the name of frame %d is too long", number);
        }
        const bool there = s->resume && vd_flight_has_picture(flight, name, &camera);
        if (there && f->video == NULL) {
            count_one(f, &f->result.taken, true);
            slot = -1;
            continue;
        }
        item it = {.number = number, .save = s->frames != NULL && !there};
        if (slot < 0 || !vd_camera_same(&camera, &last)) {
            slot = wait_for_slot(f, slot);
            if (slot < 0) {
                return vd_success();
            }
            vd_frame *frame = f->slots[slot];
            vd_status status = there ? load_picture(flight->context, name, frame)
                                     : flight->draw(flight->draw_user, &camera, frame);
            if (status.code != VD_OK) {
                return status;
            }
            count_one(f, there ? &f->result.taken : &f->result.drawn, false);
        } else {
            count_one(f, &f->result.repeated, false);
        }
        it.slot = slot;
        last = camera;
        if (!hand_over(f, it)) {
            return vd_success();
        }
    }
    return vd_success();
}

/* ---- begin and end ----------------------------------------------------------------------------
 */

static double children_seconds(void) {
    struct rusage usage;
    if (getrusage(RUSAGE_CHILDREN, &usage) != 0) {
        return 0.0;
    }
    return (double)(usage.ru_utime.tv_sec + usage.ru_stime.tv_sec) +
           1e-6 * (double)(usage.ru_utime.tv_usec + usage.ru_stime.tv_usec);
}

static vd_status begin(flying *f) {
    const vd_flight *flight = f->flight;
    const vd_fly_settings *s = flight->settings;
    vd_status status = vd_success();
    f->slot_count = slot_count(flight);
    for (int i = 0; i < f->slot_count && status.code == VD_OK; i++) {
        status =
            vd_frame_create(flight->context, s->render.width, s->render.height, 0, &f->slots[i]);
    }
    if (status.code == VD_OK && s->video.kind != VD_VIDEO_FRAMES) {
        status = vd_video_open(&s->video, &f->video);
    }
    /* The pipe takes frames in their order; pictures are written by as many threads as draw, if
     * there are frames for them: compressing one takes longer than drawing it. */
    int most = f->video != NULL ? 1 : vd_context_threads(flight->context);
    most = most < f->slot_count - 1 ? most : f->slot_count - 1;
    most = most < 1 ? 1 : most > MOST_ENCODERS ? MOST_ENCODERS : most;
    while (status.code == VD_OK && f->encoder_count < most) {
        if (pthread_create(&f->encoders[f->encoder_count], NULL, run_encoder, f) == 0) {
            f->encoder_count++;
        } else if (f->encoder_count == 0) {
            status = vd_failure(VD_ERROR_MEMORY, "cannot start a thread; raise the limit of them");
        } else {
            break;
        }
    }
    return status;
}

vd_status vd_flight_run(const vd_flight *flight, vd_flight_result *out) {
    flying f = {.flight = flight, .start = vd_seconds_now(), .failed = vd_success()};
    const double used = vd_processor_seconds_now() + children_seconds();
    pthread_mutex_init(&f.lock, NULL);
    pthread_cond_init(&f.changed, NULL);
    vd_status status = begin(&f);
    if (status.code == VD_OK) {
        status = draw_all(&f);
    }
    pthread_mutex_lock(&f.lock);
    f.ended = true;
    pthread_cond_broadcast(&f.changed);
    pthread_mutex_unlock(&f.lock);
    for (int i = 0; i < f.encoder_count; i++) {
        pthread_join(f.encoders[i], NULL);
    }
    if (f.failed.code != VD_OK) {
        status = f.failed;
    }
    show_progress(&f, true);
    if (f.video != NULL) {
        uint64_t bytes = 0;
        vd_status finished = vd_video_finish(&f.video, &bytes);
        f.result.bytes = bytes; /* of the video alone */
        if (finished.code != VD_OK && (status.code == VD_OK || status.code == VD_ERROR_CANCELLED)) {
            status = finished;
        }
    }
    for (int i = 0; i < f.slot_count; i++) {
        vd_frame_destroy(&f.slots[i]);
    }
    pthread_cond_destroy(&f.changed);
    pthread_mutex_destroy(&f.lock);
    f.result.seconds = vd_seconds_now() - f.start;
    f.result.processor_seconds = vd_processor_seconds_now() + children_seconds() - used;
    *out = f.result;
    return status;
}

/* window_path.c: every frame of a flight, as keyframes. */
#include "window_path.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* Frames are farther apart than this, seconds: two at one time are no path. */
static const double apart_s = 1e-4;

bool vd_recording_begin(vd_recording *recording, double now_s, const vd_motion_state *state,
                        double roll) {
    enum { FIRST = 1024 };
    *recording = (vd_recording){.start_s = now_s, .roll = roll, .every = 1};
    recording->frames = malloc(FIRST * sizeof recording->frames[0]);
    if (recording->frames == NULL) {
        return false;
    }
    recording->room = FIRST;
    recording->on = true;
    vd_recording_note(recording, now_s, state);
    return true;
}

static bool same_place(const vd_recorded *a, const vd_recorded *b) {
    return a->eye[0] == b->eye[0] && a->eye[1] == b->eye[1] && a->eye[2] == b->eye[2] &&
           a->heading == b->heading && a->pitch == b->pitch && a->fov == b->fov;
}

/* Whether a recording ends with a rest: a third frame there would say no more. */
static bool rests(const vd_recording *r) {
    return r->count > 1 && same_place(&r->frames[r->count - 1], &r->frames[r->count - 2]);
}

/* Keeps every second frame, the first and the last; and where asked those between which the camera
 * rests, since it would drift over their time without one of them. */
static void thin(vd_recording *r, bool keep_rests) {
    int kept = 0;
    bool rested = false;
    for (int i = 0; i < r->count; i++) {
        const bool last = i + 1 == r->count;
        const bool resting = !last && same_place(&r->frames[i], &r->frames[i + 1]);
        if (i % 2 == 0 || last || (keep_rests && (resting || rested))) {
            r->frames[kept++] = r->frames[i];
        }
        rested = resting;
    }
    r->count = kept;
}

static void halve(vd_recording *r) {
    const int most = r->count / 4 * 3;
    thin(r, true);
    while (r->count > most) { /* of rests and nothing else */
        thin(r, false);
    }
    r->every *= 2;
}

static void make_room(vd_recording *r) {
    if (r->count < r->room) {
        return;
    }
    vd_recorded *more = r->room < VD_RECORDING_FRAMES
                            ? realloc(r->frames, 2 * (size_t)r->room * sizeof r->frames[0])
                            : NULL;
    if (more == NULL) {
        halve(r);
        return;
    }
    r->frames = more;
    r->room *= 2;
}

static void add(vd_recording *r, const vd_recorded *frame) {
    vd_recorded *last = r->count > 0 ? &r->frames[r->count - 1] : NULL;
    if (last != NULL && frame->time_s < last->time_s + apart_s) {
        return;
    }
    if (last != NULL && rests(r) && same_place(frame, last)) {
        last->time_s = frame->time_s;
        return;
    }
    /* The newest frame is always kept, and of those before one of so many. */
    if (r->count > 1 && r->since < r->every && !rests(r) && !same_place(frame, last)) {
        *last = *frame;
        r->since++;
        return;
    }
    make_room(r);
    r->frames[r->count++] = *frame;
    r->since = 1;
}

void vd_recording_note(vd_recording *recording, double now_s, const vd_motion_state *state) {
    if (recording->on) {
        const vd_recorded frame = {now_s - recording->start_s,
                                   {state->eye[0], state->eye[1], state->eye[2]},
                                   state->heading,
                                   state->pitch,
                                   state->fov};
        add(recording, &frame);
    }
}

void vd_recording_hold(vd_recording *recording, double until_s) {
    if (recording->on) {
        vd_recorded frame = recording->frames[recording->count - 1];
        frame.time_s = until_s - recording->start_s;
        add(recording, &frame);
    }
}

vd_status vd_recording_end(vd_recording *recording, const char *path) {
    enum { HEAD = 128, LINE = 320 };
    const vd_recording r = *recording;
    const size_t bytes = HEAD + LINE * (size_t)r.count;
    char *text = malloc(bytes);
    vd_status status = vd_failure(VD_ERROR_MEMORY, "out of memory for the path");
    if (text != NULL) {
        size_t at = (size_t)snprintf(
            text, bytes,
            "{\"veduta_path\": 1, \"ease\": false, \"clearance\": 0, \"keyframes\": [\n");
        for (int i = 0; i < r.count; i++) {
            const vd_recorded *f = &r.frames[i];
            at += (size_t)snprintf(
                text + at, bytes - at,
                "{\"time\": %.17g, \"eye\": [%.17g, %.17g, %.17g], \"heading\": %.17g, "
                "\"pitch\": %.17g, \"roll\": %.17g, \"fov\": %.17g}%s\n",
                f->time_s, f->eye[0], f->eye[1], f->eye[2], f->heading, f->pitch, r.roll, f->fov,
                i + 1 < r.count ? "," : "");
        }
        (void)snprintf(text + at, bytes - at, "]}");
        status = vd_write_text(path, text);
    }
    free(text);
    vd_recording_finish(recording);
    return status;
}

void vd_recording_finish(vd_recording *recording) {
    free(recording->frames);
    *recording = (vd_recording){.on = false};
}

void vd_new_file_name(const char *name, const char *ending, char *out, size_t out_bytes) {
    for (int i = 1; i < 10000; i++) {
        snprintf(out, out_bytes, "%s-%04d.%s", name, i, ending);
        if (access(out, F_OK) != 0) {
            return;
        }
    }
}

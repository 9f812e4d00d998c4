/* window_path.c: keyframes of a flight. */
#include "window_path.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

bool vd_recording_begin(vd_recording *recording, double now_s) {
    *recording = (vd_recording){.keyframes = json_array(), .start_s = now_s, .last_s = -1.0};
    return recording->keyframes != NULL;
}

void vd_recording_note(vd_recording *recording, double now_s, const vd_motion_state *state,
                       bool always) {
    const double time = recording->last_s < 0.0 ? 0.0 : now_s - recording->start_s;
    if (recording->keyframes == NULL ||
        (recording->last_s >= 0.0 && !always && time < recording->last_s + 0.5)) {
        return;
    }
    if (recording->last_s >= 0.0 && time <= recording->last_s) {
        return; /* two at one time are no path */
    }
    json_array_append_new(recording->keyframes,
                          json_pack("{s: f, s: [f, f, f], s: f, s: f, s: f}", "time", time, "eye",
                                    state->eye[0], state->eye[1], state->eye[2], "heading",
                                    state->heading, "pitch", state->pitch, "fov", state->fov));
    recording->last_s = time;
}

vd_status vd_recording_end(vd_recording *recording, const char *path) {
    json_t *root = json_pack("{s: i, s: o}", "veduta_path", 1, "keyframes", recording->keyframes);
    *recording = (vd_recording){0};
    char *text = root != NULL ? json_dumps(root, JSON_INDENT(2)) : NULL;
    vd_status status = text != NULL ? vd_write_text(path, text)
                                    : vd_failure(VD_ERROR_MEMORY, "out of memory for the path");
    free(text);
    json_decref(root);
    return status;
}

void vd_new_file_name(const char *name, const char *ending, char *out, size_t out_bytes) {
    for (int i = 1; i < 10000; i++) {
        snprintf(out, out_bytes, "%s-%04d.%s", name, i, ending);
        if (access(out, F_OK) != 0) {
            return;
        }
    }
}

#include <float.h>
#include <math.h>
#include <veduta/display.h>
#include "core/core.h"
#include "display/display_rows.h"

/* Rows of a band: few enough that two threads end together, many enough that finding the quads of a
 * band costs little. */
#define BAND_ROWS 16
#define MAX_QUADS (1 << 24)

vd_display_def vd_display_def_default(void) {
    return (vd_display_def){.near_m = 0.01f, .draw_hidden = false};
}

vd_status vd_quad_place(vd_quad *quad, const vd_camera *camera, const vd_vec3 corners[4]) {
    const vd_matrix matrix = vd_camera_matrix(camera);
    vd_quad_corner placed[4];
    for (int i = 0; i < 4; i++) {
        const vd_vec3 p = vd_vec3_subtract(corners[i], camera->eye);
        double at[3];
        for (int j = 0; j < 3; j++) {
            const double *row = matrix.m[j == 2 ? 3 : j];
            at[j] = row[0] * p.x + row[1] * p.y + row[2] * p.z + row[3];
            if (!(fabs(at[j]) <= (double)FLT_MAX)) {
                return vd_failure(VD_ERROR_ARGUMENT,
                                  "cannot place a quad: corner %d is not finite or too far away; "
                                  "leave the object out",
                                  i);
            }
        }
        placed[i] = (vd_quad_corner){(float)at[0], (float)at[1], (float)at[2]};
    }
    for (int i = 0; i < 4; i++) {
        quad->corners[i] = placed[i];
    }
    return vd_success();
}

/* Whether alpha is 255 in all of a row's or column's texels from `at` on, `step` bytes apart. */
static bool all_opaque(const uint8_t *at, size_t step, int count) {
    for (int i = 0; i < count; i++) {
        if (at[3 + step * (size_t)i] != 255) {
            return false;
        }
    }
    return true;
}

void vd_quad_picture_find_opaque(vd_quad_picture *picture) {
    const size_t pitch = 4 * picture->stride;
    int box[4] = {picture->width / 2, picture->height / 2, picture->width / 2, picture->height / 2};
    bool grows[4] = {true, true, true, true};
    if (picture->rgba[pitch * (size_t)box[1] + 4 * (size_t)box[0] + 3] == 255) {
        box[2]++;
        box[3]++;
        while (grows[0] || grows[1] || grows[2] || grows[3]) {
            for (int side = 0; side < 4; side++) {
                const int at = side < 2 ? box[side] - 1 : box[side];
                const bool columns = side % 2 == 0;
                const int left = columns ? at : box[0], top = columns ? box[1] : at;
                grows[side] =
                    grows[side] && at >= 0 && at < (columns ? picture->width : picture->height) &&
                    all_opaque(picture->rgba + pitch * (size_t)top + 4 * (size_t)left,
                               columns ? pitch : 4, columns ? box[3] - box[1] : box[2] - box[0]);
                box[side] += !grows[side] ? 0 : side < 2 ? -1 : 1;
            }
        }
    }
    for (int side = 0; side < 4; side++) {
        picture->opaque[side] = box[2] > box[0] ? box[side] : 0;
    }
}

/* ---- drawing in bands -------------------------------------------------------------------------*/

struct vd_display {
    vd_context *context;
    vd_display_list list; /* of the frame being drawn */
    vd_display_setup *setups;
    int capacity;                 /* quads that fit */
    vd_display_entry *entries;    /* of those to be seen */
    vd_display_entry *active;     /* [worker][capacity] */
    vd_display_segment *segments; /* [worker][vd_display_segment_count] */
};

vd_status vd_display_create(vd_context *context, vd_display **out) {
    vd_display *display = vd_allocate_zero(context, 1, sizeof *display);
    if (display == NULL) {
        return vd_out_of_memory("a display", sizeof *display);
    }
    display->context = context;
    *out = display;
    return vd_success();
}

static void release_lists(vd_display *display) {
    vd_release(display->context, display->segments);
    vd_release(display->context, display->active);
    vd_release(display->context, display->entries);
    vd_release(display->context, display->setups);
    display->segments = NULL;
    display->active = NULL;
    display->entries = NULL;
    display->setups = NULL;
    display->capacity = 0;
}

void vd_display_destroy(vd_display **display) {
    if (*display != NULL) {
        release_lists(*display);
        vd_release((*display)->context, *display);
        *display = NULL;
    }
}

/* Makes room for `count` quads; a quarter more than asked, so that a slowly growing world does not
 * allocate every frame. */
static vd_status reserve(vd_display *display, int count) {
    if (count <= display->capacity) {
        return vd_success();
    }
    const size_t threads = (size_t)vd_context_threads(display->context);
    const int capacity = count + count / 4;
    release_lists(display);
    display->setups = vd_allocate(display->context, (size_t)capacity, sizeof *display->setups);
    display->entries = vd_allocate(display->context, (size_t)capacity, sizeof *display->entries);
    display->active =
        vd_allocate(display->context, threads * (size_t)capacity, sizeof *display->active);
    display->segments = vd_allocate(display->context, threads * vd_display_segment_count(capacity),
                                    sizeof *display->segments);
    if (display->setups == NULL || display->entries == NULL || display->active == NULL ||
        display->segments == NULL) {
        release_lists(display);
        return vd_out_of_memory("quads", (size_t)capacity * sizeof *display->setups);
    }
    display->capacity = capacity;
    return vd_success();
}

static void draw_band(void *user, int index, int worker) {
    const vd_display *display = user;
    const vd_display_list *list = &display->list;
    const int first = index * BAND_ROWS, end = first + BAND_ROWS;
    const vd_display_scratch scratch = {
        display->active + (size_t)worker * (size_t)display->capacity,
        display->segments + (size_t)worker * vd_display_segment_count(display->capacity)};
    vd_display_rows(list, first, end < list->window.height ? end : list->window.height, scratch);
}

static vd_status check_quads(const vd_quad *quads, int count, const vd_display_def *def) {
    if (!(def->near_m > 0.0f) || !(def->near_m <= FLT_MAX)) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "cannot draw quads: near_m is %g; it must be above 0 and finite",
                          (double)def->near_m);
    }
    if (count < 0 || count > MAX_QUADS) {
        return vd_failure(count < 0 ? VD_ERROR_ARGUMENT : VD_ERROR_LIMIT,
                          "cannot draw %d quads: 0 to %d are; draw them in parts", count,
                          MAX_QUADS);
    }
    for (int i = 0; i < count; i++) {
        const char *field;
        if (!vd_display_check(&quads[i], &field)) {
            return vd_failure(VD_ERROR_ARGUMENT, "cannot draw quad %d: %s; leave it out", i, field);
        }
    }
    return vd_success();
}

vd_status vd_display_draw(vd_display *display, vd_job *job, vd_frame *frame, const vd_quad *quads,
                          int count, const vd_display_def *def) {
    const vd_display_def defaults = vd_display_def_default();
    def = def == NULL ? &defaults : def;
    vd_status status = check_quads(quads, count, def);
    if (status.code == VD_OK && def->test_depth && frame->depth == NULL) {
        status = vd_failure(VD_ERROR_ARGUMENT, "cannot test depth: the frame has none; create it "
                                               "with VD_PLANE_DEPTH");
    }
    if (status.code == VD_OK) {
        status = reserve(display, count);
    }
    if (status.code != VD_OK || count == 0) {
        return status;
    }
    display->list =
        (vd_display_list){.window = {.rgba = frame->rgba,
                                     .width = frame->width,
                                     .height = frame->height,
                                     .stride = frame->stride},
                          .kernels = vd_display_kernels_for(vd_context_isa(display->context)),
                          .entries = display->entries,
                          .draw_hidden = def->draw_hidden || def->test_depth};
    if (def->test_depth) {
        display->list.window.depth = frame->depth;
        display->list.window.near_m = def->near_m;
    }
    for (int i = 0; i < count; i++) {
        const int next = display->list.count;
        if (vd_display_prepare(&quads[i], def->near_m, frame->height, &display->setups[next],
                               &display->entries[next])) {
            display->list.count++;
        }
    }
    const int bands = (frame->height + BAND_ROWS - 1) / BAND_ROWS;
    return vd_parallel_for(display->context, job, bands, draw_band, display);
}

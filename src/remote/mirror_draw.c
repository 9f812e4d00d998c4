/* mirror_draw.c: what is held, into a frame. */
#include "remote/mirror_internal.h"

#include <string.h>

/* How far before the eye a screen stands that is shown turned: it has no depth. */
#define SCREEN_M 1000.0

static bool make_room(vd_mirror *m, int count) {
    if (count <= m->quad_room) {
        return true;
    }
    vd_release(m->context, m->quads);
    vd_release(m->context, m->placed);
    vd_release(m->context, m->behind);
    vd_release(m->context, m->drawn);
    const size_t room = 2 * (size_t)count;
    m->quads = vd_allocate(m->context, room, sizeof *m->quads);
    m->placed = vd_allocate(m->context, room, sizeof *m->placed);
    m->behind = vd_allocate(m->context, room, sizeof *m->behind);
    m->drawn = vd_allocate(m->context, room, sizeof *m->drawn);
    m->quad_room = m->quads != NULL && m->placed != NULL && m->behind != NULL && m->drawn != NULL
                       ? (int)room
                       : 0;
    return m->quad_room > 0;
}

/* What is drawn of an order. */
typedef struct gathered {
    int quads, placed, kept;
    vd_light light;
    int width, height; /* of the frame */
    double pixels;     /* that quads cover, those too that are left out for it */
    vd_placed_account account;
} gathered;

static double screens(const gathered *s, double count) {
    return count * s->width * s->height;
}

/* Adds a quad; one that no camera could show is left out. */
static void add(vd_mirror *m, gathered *s, vd_kept *kept, const int opaque[4],
                const vd_camera *camera, const vd_vec3 corners[4]) {
    vd_quad *quad = &m->quads[s->quads];
    *quad = (vd_quad){.picture = {.rgba = kept->rgba,
                                  .width = kept->width,
                                  .height = kept->height,
                                  .stride = (size_t)kept->width},
                      .opacity = 255};
    memcpy(quad->picture.opaque, opaque, sizeof quad->picture.opaque);
    if (kept->width < 2 || kept->height < 2 || kept->width > VD_MAX_SIDE ||
        kept->height > VD_MAX_SIDE || vd_quad_place(quad, camera, corners).code != VD_OK) {
        return;
    }
    s->pixels += vd_quad_pixels(quad, vd_display_def_default().near_m, s->width, s->height);
    if (s->pixels > screens(s, VD_DISPLAY_MOST_SCREENS)) {
        return;
    }
    kept->references++;
    m->drawn[s->kept++] = kept;
    s->quads++;
}

/* Adds a placed model; one whose model or light has not come is left out. */
static void add_placed(vd_mirror *m, gathered *s, const vd_wire_instance *place) {
    const vd_held *model = vd_mirror_find(m, place->model);
    if (model == NULL || model->kept == NULL || model->kept->model == NULL || !m->has_light) {
        return;
    }
    m->placed[s->placed] = (vd_placed){.model = model->kept->model, .place = place->place};
    m->behind[s->placed++] = s->quads;
    model->kept->references++;
    m->drawn[s->kept++] = model->kept;
}

static void add_brick(vd_mirror *m, gathered *s, vd_kept *kept) {
    m->placed[s->placed] = (vd_placed){.brick = kept->brick};
    m->behind[s->placed++] = s->quads;
    kept->references++;
    m->drawn[s->kept++] = kept;
}

/* A screen as its camera saw it, from the eye of this one: right where that has turned alone. */
static void add_screen(vd_mirror *m, gathered *to, const vd_camera *camera) {
    const vd_mirror_screen *s = &m->screen;
    const vd_camera *from = s->known ? &s->camera.camera : camera;
    const double width = s->known ? s->camera.width : s->kept->width;
    const double height = s->known ? s->camera.height : s->kept->height;
    const int opaque[4] = {0, 0, s->kept->width, s->kept->height};
    const vd_lens *lens = &from->lens;
    vd_vec3 corners[4];
    for (int i = 0; i < 4; i++) {
        const double x = i == 1 || i == 2 ? width : 0.0, y = i >= 2 ? height : 0.0;
        const vd_vec3 ray = vd_vec3_make((x - lens->cx) / lens->fx, (y - lens->cy) / lens->fy, 1.0);
        corners[i] = vd_vec3_add(camera->eye,
                                 vd_vec3_scale(vd_quat_rotate(from->orientation, ray), SCREEN_M));
    }
    /* Lossy screens are opaque as exact ones are; a promise that only hides what is behind. */
    add(m, to, s->kept, opaque, camera, corners);
}

/* That pictures are before which are fixed to the screen. */
static vd_camera fixed_camera(const vd_frame *frame) {
    const double width = frame->width, height = frame->height;
    return (vd_camera){.orientation = {0.0, 0.0, 0.0, 1.0},
                       .projection = VD_PROJECTION_PERSPECTIVE,
                       .lens = {height, height, 0.5 * width, 0.5 * height},
                       .near_m = 1e-3};
}

/* What is to be drawn, farthest first. */
static gathered gather(vd_mirror *m, const vd_camera *camera, const vd_frame *frame, bool screen) {
    gathered s = {.light = m->light, .width = frame->width, .height = frame->height};
    const vd_camera fixed = fixed_camera(frame);
    if (screen) {
        add_screen(m, &s, camera);
        return s;
    }
    for (int i = 0; i < m->order_count; i++) {
        const vd_held *held = vd_mirror_find(m, m->order[i]);
        if (held != NULL && held->kept == NULL) {
            add_placed(m, &s, &held->place);
        } else if (held != NULL && held->kept->brick != NULL) {
            add_brick(m, &s, held->kept);
        } else if (held != NULL && held->kept->rgba != NULL) { /* models are shown by places */
            add(m, &s, held->kept, held->opaque, held->fixed ? &fixed : camera, held->corners);
        }
    }
    return s;
}

/* Draws runs of quads and of models and bricks in turn, as the order has them. */
static vd_status draw_all(vd_mirror *m, vd_job *job, const vd_camera *camera, vd_frame *frame,
                          gathered *s, int *models) {
    const vd_placed_window window = {frame->rgba, frame->width, frame->height, frame->stride};
    vd_status status = vd_success();
    memset(frame->rgba, 0, 4 * frame->stride * (size_t)frame->height);
    for (int q = 0, i = 0; status.code == VD_OK && (q < s->quads || i < s->placed);) {
        const int until = i < s->placed ? m->behind[i] : s->quads;
        int run = 0, drawn = 0;
        while (i + run < s->placed && m->behind[i + run] == until) {
            run++;
        }
        if (until > q) {
            status = vd_display_draw(m->display, job, frame, m->quads + q, until - q, NULL);
        }
        if (status.code == VD_OK && run > 0) {
            status = vd_placer_draw(m->placer, job, &s->light, camera, m->placed + i, run, &window,
                                    &s->account, &drawn);
        }
        *models += drawn;
        q = until;
        i += run;
    }
    return status;
}

static bool is_absurd(const gathered *s) {
    return s->pixels > screens(s, VD_DISPLAY_ABSURD_SCREENS) ||
           vd_placed_is_absurd(&s->account, s->width, s->height);
}

static void copy(const vd_kept *from, vd_frame *to) {
    for (int y = 0; y < from->height; y++) {
        memcpy(to->rgba + 4 * to->stride * (size_t)y,
               from->rgba + 4 * (size_t)from->width * (size_t)y, 4 * (size_t)from->width);
    }
}

vd_status vd_mirror_draw(vd_mirror *m, vd_job *job, const vd_camera *camera, vd_frame *frame,
                         vd_client_shown *shown) {
    vd_wire_camera view = {.width = frame->width, .height = frame->height};
    view.camera = *camera;
    vd_client_shown made = {.quads = 0};
    vd_kept *whole = NULL;
    gathered what = {.quads = 0};
    pthread_mutex_lock(&m->lock);
    const vd_mirror_screen *s = &m->screen;
    const bool same = s->kept != NULL && s->known && vd_same_view(&s->camera, &view) &&
                      s->kept->width == frame->width && s->kept->height == frame->height;
    made.screen = s->kept != NULL && (same || !s->exact || m->order_count == 0);
    made.exact = same && s->exact;
    const bool room = make_room(m, m->order_count + 1);
    if (same) {
        whole = s->kept;
        whole->references++;
    } else if (room) {
        what = gather(m, camera, frame, made.screen);
    }
    pthread_mutex_unlock(&m->lock);
    vd_status status =
        room ? vd_success()
             : vd_failure(VD_ERROR_MEMORY, "not enough memory to draw pictures; free some");
    if (whole != NULL) {
        copy(whole, frame);
    } else if (room) {
        status = draw_all(m, job, camera, frame, &what, &made.models);
    }
    made.quads = made.screen ? 0 : what.quads;
    pthread_mutex_lock(&m->lock);
    vd_mirror_release(m, whole);
    for (int i = 0; i < what.kept; i++) {
        vd_mirror_release(m, m->drawn[i]);
    }
    if (is_absurd(&what)) { /* the thread of the connection tells the server */
        m->absurd = true;
        m->order_count = 0;
    }
    pthread_mutex_unlock(&m->lock);
    if (shown != NULL) {
        *shown = made;
    }
    return status;
}

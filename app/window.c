/* window.c: the event thread: what is seen, asked for and shown. */
#include "window.h"

#if !defined(VEDUTA_SDL_LIBRARY)

vd_status vd_window_run(const vd_window_def *def) {
    (void)def;
    return vd_failure(VD_ERROR_UNSUPPORTED,
                      "this veduta was built without SDL2 and has no window; build with "
                      "VEDUTA_SDL=ON, or draw pictures with `veduta render`");
}

#else

#include <math.h>
#include <signal.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "view.h"
#include "window_state.h"

/* Seconds without a change after which the camera rests. */
static const double rest_after = 0.12;

/* Seconds that a note stays. */
static const double note_for = 4.0;

void vd_window_note(vd_window *w, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(w->note, sizeof w->note, format, arguments);
    va_end(arguments);
    w->note_until_s = vd_seconds_now() + note_for;
}

void vd_window_touch(vd_window *w) {
    w->changed = true;
    w->still_sent = false;
    w->change_s = vd_seconds_now();
}

/* ---- options -----------------------------------------------------------------------------------
 */

/* Reads the settings anew and takes over what motion has its own copy of. */
static vd_status read_settings(vd_window *w) {
    vd_render_settings read;
    vd_status status = vd_render_settings_read(w->options, &read);
    if (status.code == VD_OK) {
        w->settings = read;
        vd_window_world *world = &w->worlds[w->world];
        world->state.fov = read.camera.fov;
        world->state.exaggeration = read.exaggeration;
        world->state.haze_m = vd_live_number(w->options, &world->defaults, VD_LIVE_HAZE);
        const double threads = vd_live_number(w->options, &world->defaults, VD_LIVE_THREADS);
        w->threads = threads >= 1.0 ? (int)threads : w->threads;
    }
    return status;
}

vd_option_value vd_window_keep(const vd_window *w, vd_live live) {
    vd_option_value kept = w->options->values[vd_live_option(live)];
    kept.text = kept.text != NULL ? strdup(kept.text) : NULL;
    return kept;
}

void vd_window_options_changed(vd_window *w, vd_status status, vd_live live,
                               vd_option_value before) {
    if (status.code == VD_OK) {
        status = read_settings(w);
    }
    if (status.code != VD_OK) {
        vd_window_note(w, "%s", status.message);
        vd_option_value *value = &w->options->values[vd_live_option(live)];
        free(value->text);
        *value = before;
        before.text = NULL;
        (void)read_settings(w).code; /* they were right before */
    }
    free(before.text);
    vd_window_touch(w);
}

void vd_window_set_live(vd_window *w, vd_live live, double value) {
    const vd_option_value before = vd_window_keep(w, live);
    vd_window_options_changed(w, vd_live_set_number(w->options, live, value), live, before);
}

void vd_window_next_word(vd_window *w, vd_live live, int step) {
    const vd_option_value before = vd_window_keep(w, live);
    vd_status status = vd_live_next(w->options, &w->worlds[w->world].defaults, live, step);
    vd_window_options_changed(w, status, live, before);
}

/* ---- requests ----------------------------------------------------------------------------------
 */

static vd_camera_settings camera_now(const vd_window *w) {
    const vd_window_world *world = &w->worlds[w->world];
    vd_camera_settings camera = world->camera;
    camera.eye = (vd_position){VD_POSITION_WORLD,
                               {world->state.eye[0], world->state.eye[1], world->state.eye[2]}};
    camera.heading = world->state.heading;
    camera.pitch = world->state.pitch;
    camera.fov = world->state.fov;
    return camera;
}

void vd_window_flags(const vd_window *w, char *out, size_t out_bytes) {
    const vd_view view = {.exact = camera_now(w)};
    char look[1024];
    vd_view_flags(&view, out, out_bytes);
    vd_look_flags(w->options, &w->worlds[w->world].defaults, look, sizeof look);
    const size_t used = strlen(out);
    snprintf(out + used, out_bytes - used, " --size %dx%d%s", w->width, w->height, look);
    if (w->def->impostors != NULL && w->show != VD_IMPOSTOR_SHOW_PICTURES) {
        const size_t end = strlen(out);
        snprintf(out + end, out_bytes - end, " --impostors --show %s --tolerance %.10g",
                 vd_impostor_show_name(w->show), w->settings.tolerance_px);
    }
}

static void ask(vd_window *w, bool moving) {
    const vd_window_world *world = &w->worlds[w->world];
    vd_window_request request = {.world = w->world,
                                 .settings = w->settings,
                                 .camera = camera_now(w),
                                 .width = w->width,
                                 .height = w->height,
                                 .moving = moving,
                                 .show = w->show,
                                 .frozen = w->frozen,
                                 .threads = w->threads,
                                 .event_s = w->change_s};
    snprintf(request.input, sizeof request.input, "%s", world->input != NULL ? world->input : "");
    snprintf(request.colormap, sizeof request.colormap, "%s", w->settings.colormap);
    if (world->entered) {
        char flags[1800];
        vd_window_flags(w, flags, sizeof flags);
        char *inputs = world->input != NULL
                           ? vd_quote_command(flags, 1, (char **)(uintptr_t)&world->input)
                           : vd_quote_command(flags, w->settings.input_count,
                                              (char **)(uintptr_t)w->settings.inputs);
        snprintf(request.flags, sizeof request.flags, "%s", inputs != NULL ? inputs : flags);
        free(inputs);
    }
    vd_window_render_ask(w->render, &request);
}

/* A world whose camera has become known is looked at from there. */
static void enter_when_ready(vd_window *w) {
    vd_window_world *world = &w->worlds[w->world];
    vd_camera_settings start;
    if (world->entered || !vd_window_render_world(w->render, w->world, &start, &world->defaults)) {
        return;
    }
    world->entered = true;
    world->camera = start;
    if (w->world == 0 && w->def->remote != NULL &&
        !vd_options_given(w->options, vd_live_option(VD_LIVE_FOV))) {
        vd_window_set_live(w, VD_LIVE_FOV, start.fov);
    }
    world->state = (vd_motion_state){.eye = {start.eye.v[0], start.eye.v[1], start.eye.v[2]},
                                     .heading = start.heading,
                                     .pitch = start.pitch};
    (void)read_settings(w).code; /* were read before */
    vd_window_touch(w);
    w->change_s -= rest_after; /* nothing moves: the finished picture follows the first */
}

void vd_window_enter(vd_window *w, int number) {
    w->world = number;
    const vd_window_world *world = &w->worlds[number];
    const char *name = world->input != NULL ? strrchr(world->input, '/') : NULL;
    char title[300];
    snprintf(title, sizeof title, "%.255s - veduta",
             name != NULL                   ? name + 1
             : world->input != NULL         ? world->input
             : w->settings.function != NULL ? w->settings.function
             : w->def->remote != NULL       ? "a server's world"
                                            : "several files");
    w->sdl.SetWindowTitle(w->handle, title);
    w->motion = vd_motion_start();
    (void)read_settings(w).code; /* were read before */
    vd_window_touch(w);
    ask(w, false); /* opens it, if it is not open */
}

void vd_window_open(vd_window *w, const char *path) {
    if (vd_is_model_name(path, NULL)) {
        vd_window_note(w, "%.200s is a model; `veduta render` draws it", path);
        return;
    }
    const int place = w->world_count < VD_WINDOW_WORLDS ? w->world_count++ : w->world;
    vd_window_world *world = &w->worlds[place];
    char *copy = strdup(path);
    if (copy == NULL) {
        return;
    }
    const vd_look_defaults defaults = w->worlds[0].defaults;
    free(world->dropped);
    *world = (vd_window_world){.input = copy, .dropped = copy, .defaults = defaults};
    vd_window_render_forget(w->render, place);
    vd_window_enter(w, place);
}

/* ---- time --------------------------------------------------------------------------------------
 */

static double ground_below(void *user, double x, double y) {
    const vd_window *w = user;
    return vd_window_render_ground(w->render, w->world, x, y);
}

/* The sun over 46 degrees north in May, an hour a second from sunrise to sunset. */
static void move_sun(vd_window *w, double seconds) {
    const double latitude = 46.0 * VD_RADIANS_PER_DEGREE, tilt = 18.0 * VD_RADIANS_PER_DEGREE;
    w->sun_hour += seconds;
    double altitude = -1.0, azimuth = 0.0;
    for (int i = 0; i < 2 && altitude < 1.0; i++) {
        const double turn = (w->sun_hour - 12.0) * 15.0 * VD_RADIANS_PER_DEGREE;
        altitude = asin(sin(latitude) * sin(tilt) + cos(latitude) * cos(tilt) * cos(turn)) /
                   VD_RADIANS_PER_DEGREE;
        azimuth = 180.0 + atan2(sin(turn), cos(turn) * sin(latitude) - tan(tilt) * cos(latitude)) /
                              VD_RADIANS_PER_DEGREE;
        w->sun_hour = altitude < 1.0 ? 5.3 : w->sun_hour;
    }
    vd_window_set_live(w, VD_LIVE_SUN_AZIMUTH, floor(100.0 * azimuth) / 100.0);
    vd_window_set_live(w, VD_LIVE_SUN_ALTITUDE, floor(100.0 * altitude) / 100.0);
}

/* Moves the camera by `seconds`, and the options that keys move with it. */
static void move_camera(vd_window *w, double seconds) {
    vd_window_world *world = &w->worlds[w->world];
    const vd_motion_world around = {ground_below, w, world->defaults.size_m};
    const vd_motion_state before = world->state;
    vd_motion_advance(&w->motion, &around, seconds, &world->state);
    const vd_motion_state after = world->state;
    if (after.fov != before.fov) {
        vd_window_set_live(w, VD_LIVE_FOV, after.fov);
    }
    if (after.exaggeration != before.exaggeration) {
        vd_window_set_live(w, VD_LIVE_EXAGGERATE, after.exaggeration);
    }
    if (after.haze_m != before.haze_m) {
        vd_window_set_live(w, VD_LIVE_HAZE, after.haze_m);
    }
}

static bool active(const vd_window *w) {
    return w->worlds[w->world].entered && !w->hidden &&
           (w->changed || vd_motion_active(&w->motion) || w->sun_moves || w->def->frames > 0);
}

/* One step of the display's clock, when it is due. */
static void tick(vd_window *w) {
    const double now = vd_seconds_now();
    vd_window_world *world = &w->worlds[w->world];
    if (!world->entered || w->hidden) {
        return;
    }
    if (active(w)) {
        if (now < w->next_tick_s) {
            return;
        }
        const bool first = w->next_tick_s + 2.0 * w->period_s < now;
        const double seconds = first ? w->period_s : fmin(now - w->tick_s, 0.1);
        w->next_tick_s = first ? now + w->period_s : w->next_tick_s + w->period_s;
        w->tick_s = now;
        if (first) {
            vd_recording_hold(&w->recording, now - seconds);
        }
        if (vd_motion_active(&w->motion)) {
            move_camera(w, seconds);
            vd_window_touch(w);
        } else {
            const vd_motion_world around = {ground_below, w, world->defaults.size_m};
            vd_motion_clear_ground(&around, &world->state);
        }
        vd_recording_note(&w->recording, now, &world->state);
        if (w->sun_moves) {
            move_sun(w, seconds);
        }
        if (w->def->frames > 0) {
            vd_window_touch(w);
        }
        ask(w, now - w->change_s < rest_after);
        w->changed = false;
    } else if (!w->still_sent && now - w->change_s >= rest_after) {
        ask(w, false);
        w->still_sent = true;
    }
}

/* Seconds until something is due; −1: only when something happens. */
static double wait_seconds(const vd_window *w, const vd_window_news *news) {
    const double now = vd_seconds_now();
    double until = INFINITY;
    if (active(w)) {
        until = w->next_tick_s;
    } else if (!w->still_sent && w->worlds[w->world].entered && !w->hidden) {
        until = w->change_s + rest_after;
    }
    if (news->state == VD_WORLD_LOADING) {
        until = fmin(until, now + 0.05);
    }
    if (w->note[0] != '\0') {
        until = fmin(until, w->note_until_s);
    }
    if (news->changes && news->scene.state[0] != '\0' && !news->scene.failed) {
        until = fmin(until, now + 0.25); /* its seconds are counted down */
    }
    return isinf(until) ? -1.0 : fmax(0.0, until - now);
}

/* ---- the loop ----------------------------------------------------------------------------------
 */

static void take_size(vd_window *w) {
    const SDL_Surface *surface = w->sdl.GetWindowSurface(w->handle);
    if (surface != NULL && (surface->w != w->width || surface->h != w->height)) {
        w->width = surface->w;
        w->height = surface->h;
        vd_window_touch(w);
    }
    w->expose = true;
}

static void handle(vd_window *w, const SDL_Event *event) {
    if (event->type == w->wake_type) {
        atomic_store(&w->woken, false);
    } else if (event->type == SDL_QUIT) {
        w->running = false;
    } else if (event->type == SDL_WINDOWEVENT) {
        if (event->window.event == SDL_WINDOWEVENT_SIZE_CHANGED ||
            event->window.event == SDL_WINDOWEVENT_EXPOSED) {
            take_size(w);
        }
        w->hidden = event->window.event == SDL_WINDOWEVENT_MINIMIZED ||
                    (w->hidden && event->window.event != SDL_WINDOWEVENT_RESTORED &&
                     event->window.event != SDL_WINDOWEVENT_SHOWN);
    }
    vd_window_handle(w, event);
}

/* Waits for an event; false when the time is over. */
static bool wait_event(vd_window *w, double seconds, SDL_Event *event) {
    if (seconds < 0.0) {
        return w->sdl.WaitEvent(event) != 0;
    }
    const int whole = (int)(1e3 * seconds);
    if (whole > 0) {
        return w->sdl.WaitEventTimeout(event, whole) != 0;
    }
    if (w->sdl.PollEvent(event)) {
        return true;
    }
    const struct timespec rest = {0, (long)(1e9 * seconds)};
    nanosleep(&rest, NULL); /* less than a millisecond, which SDL cannot wait for */
    return false;
}

/* Returns when the window is closed; a failure only where nobody looks at it (--frames). */
static vd_status loop(vd_window *w) {
    vd_window_news news;
    vd_window_render_news(w->render, &news);
    while (w->running) {
        SDL_Event event;
        if (wait_event(w, wait_seconds(w, &news), &event)) {
            do {
                handle(w, &event);
            } while (w->sdl.PollEvent(&event));
        }
        enter_when_ready(w);
        tick(w);
        vd_window_render_news(w->render, &news);
        if (news.changes && news.scene.version != w->seen) {
            w->seen = news.scene.version;
            vd_window_touch(w);
        }
        vd_window_update_cards(w, &news);
        vd_window_show(w);
        if (w->def->frames > 0 && news.failing) {
            return vd_failure(VD_ERROR_IO, "%s", news.failure);
        }
    }
    return vd_success();
}

/* ---- beginning and end -------------------------------------------------------------------------
 */

/* Called by the render thread. */
static void wake(void *user) {
    vd_window *w = user;
    if (!atomic_exchange(&w->woken, true)) {
        SDL_Event event;
        memset(&event, 0, sizeof event);
        event.type = w->wake_type;
        w->sdl.PushEvent(&event);
    }
}

/* SIGINT and SIGTERM are kept from all threads but this one, which makes events of them: a handler
 * may do nothing that would wake the event thread. */
typedef struct signals {
    vd_window *window;
    pthread_t thread;
    sigset_t caught, before;
    atomic_bool ended;
    bool started;
} signals;

static void *wait_for_signals(void *user) {
    signals *s = user;
    int number;
    while (sigwait(&s->caught, &number) == 0 && !s->ended) {
        SDL_Event event;
        memset(&event, 0, sizeof event);
        event.type = SDL_QUIT;
        s->window->sdl.PushEvent(&event);
    }
    return NULL;
}

static void signals_begin(signals *s, vd_window *window) {
    s->window = window;
    sigemptyset(&s->caught);
    sigaddset(&s->caught, SIGINT);
    sigaddset(&s->caught, SIGTERM);
    pthread_sigmask(SIG_BLOCK, &s->caught, &s->before);
    s->started = pthread_create(&s->thread, NULL, wait_for_signals, s) == 0;
}

static void signals_end(signals *s) {
    if (s->started) {
        s->ended = true;
        pthread_kill(s->thread, SIGTERM);
        pthread_join(s->thread, NULL);
    }
    pthread_sigmask(SIG_SETMASK, &s->before, NULL);
}

static vd_status no_window(const char *reason) {
    return vd_failure(
        VD_ERROR_IO,
        "cannot open a window: %.160s; set DISPLAY or WAYLAND_DISPLAY to one, or draw "
        "pictures with `veduta render`",
        reason);
}

/* Asked before SDL, whose drivers print what they miss. */
static bool has_display(void) {
#if defined(__linux__)
    return getenv("DISPLAY") != NULL || getenv("WAYLAND_DISPLAY") != NULL ||
           getenv("SDL_VIDEODRIVER") != NULL;
#else
    return true;
#endif
}

static vd_status open_window(vd_window *w) {
    w->sdl.SetHint(SDL_HINT_NO_SIGNAL_HANDLERS, "1");
    w->sdl.SetHint(SDL_HINT_VIDEO_X11_NET_WM_BYPASS_COMPOSITOR, "0");
    /* The picture is made on the CPU: it goes to the screen without OpenGL. */
    w->sdl.SetHint(SDL_HINT_FRAMEBUFFER_ACCELERATION, "0");
    if (!has_display()) {
        return no_window("there is no display");
    }
    if (getenv("DISPLAY") != NULL && getenv("WAYLAND_DISPLAY") == NULL) {
        w->sdl.SetHint(SDL_HINT_VIDEODRIVER, "x11"); /* looking for Wayland prints, too */
    }
    if (w->sdl.Init(SDL_INIT_VIDEO) != 0) {
        return no_window(w->sdl.GetError());
    }
    /* Where no display answers SDL takes a driver that shows nothing. */
    const char *driver = w->sdl.GetCurrentVideoDriver();
    if (getenv("SDL_VIDEODRIVER") == NULL &&
        (driver == NULL || strcmp(driver, "offscreen") == 0 || strcmp(driver, "dummy") == 0 ||
         strcmp(driver, "evdev") == 0)) {
        return no_window("the display does not answer");
    }
    w->wake_type = w->sdl.RegisterEvents(1);
    Uint32 flags = SDL_WINDOW_RESIZABLE | SDL_WINDOW_ALLOW_HIGHDPI;
    flags |= w->def->full_screen ? (Uint32)SDL_WINDOW_FULLSCREEN_DESKTOP : 0u;
    w->full_screen = w->def->full_screen;
    w->handle = w->sdl.CreateWindow("veduta", SDL_WINDOWPOS_CENTERED, SDL_WINDOWPOS_CENTERED,
                                    w->settings.width, w->settings.height, flags);
    const SDL_Surface *surface = w->handle != NULL ? w->sdl.GetWindowSurface(w->handle) : NULL;
    if (surface == NULL) {
        return vd_failure(VD_ERROR_IO, "cannot open a window: %.200s; try a smaller --size",
                          w->sdl.GetError());
    }
    w->width = surface->w;
    w->height = surface->h;
    w->sdl.SetWindowMinimumSize(w->handle, 160, 90);
    SDL_DisplayMode mode;
    const int display = w->sdl.GetWindowDisplayIndex(w->handle);
    const bool known = display >= 0 && w->sdl.GetCurrentDisplayMode(display, &mode) == 0 &&
                       mode.refresh_rate >= 20 && mode.refresh_rate <= 500;
    w->period_s = 1.0 / (known ? mode.refresh_rate : 60);
    return vd_success();
}

/* Makes what stands behind the window. */
static vd_status furnish(vd_window *w) {
    int window_width, window_height;
    w->sdl.GetWindowSize(w->handle, &window_width, &window_height);
    vd_context_def context = vd_context_def_default();
    context.threads = 1;
    vd_status status = vd_context_create(&context, &w->context);
    if (status.code == VD_OK) {
        const double scale = window_width > 0 ? (double)w->width / window_width : 1.0;
        w->cards = vd_cards_create(w->context, scale);
        if (w->cards == NULL) {
            status = vd_failure(VD_ERROR_MEMORY, "out of memory at the start");
        }
    }
    if (status.code == VD_OK) {
        const vd_window_render_def render = {.threads = w->settings.threads,
                                             .content = w->def->content,
                                             .impostors = w->def->impostors,
                                             .remote = w->def->remote,
                                             .period_s = w->period_s,
                                             .wake = wake,
                                             .wake_user = w,
                                             .log = vd_notes_log,
                                             .log_user = w->def->notes};
        status = vd_window_render_create(&render, &w->render);
    }
    return status;
}

/* Ends all but SDL, which ends with the program. It wakes the event thread by a message to the
 * window over a second connection; one that is still under way when the window is destroyed is an
 * error for which Xlib ends the program with status 1. */
static void clear_up(vd_window *w) {
    vd_window_render_destroy(&w->render);
    vd_cards_destroy(&w->cards);
    vd_context_destroy(&w->context);
    vd_recording_finish(&w->recording);
    free(w->compose);
    for (int i = 0; i < VD_WINDOW_WORLDS; i++) {
        free(w->worlds[i].dropped);
    }
}

static void name_worlds(vd_window *w) {
    const vd_render_settings *s = &w->def->settings;
    w->world_count = w->def->join || s->input_count == 0 ? 1 : s->input_count;
    w->world_count = w->world_count < VD_WINDOW_WORLDS ? w->world_count : VD_WINDOW_WORLDS;
    for (int i = 0; i < w->world_count; i++) {
        w->worlds[i].input = w->def->join || s->input_count == 0 ? NULL : s->inputs[i];
        w->worlds[i].defaults.threads = vd_window_render_most_threads(w->render);
        w->worlds[i].defaults.size_m = 1.0;
    }
}

static void report(const vd_window *w) {
    if (w->def->frames > 0) {
        fprintf(stderr, "veduta: %d pictures, p50 %.2f ms, p99 %.2f ms, shown after %.2f ms\n",
                w->pictures, 1e3 * vd_times_share(&w->frame_times, 0.5),
                1e3 * vd_times_share(&w->frame_times, 0.99),
                1e3 * vd_times_share(&w->latencies, 0.99));
    }
}

vd_status vd_window_run(const vd_window_def *def) {
    vd_window *w = calloc(1, sizeof *w);
    if (w == NULL) {
        return vd_failure(VD_ERROR_MEMORY, "out of memory at the start");
    }
    w->def = def;
    w->options = def->options;
    w->settings = def->settings;
    w->show = def->impostors != NULL ? def->settings.show : VD_IMPOSTOR_SHOW_PICTURES;
    w->motion = vd_motion_start();
    w->sliding = VD_LIVE_COUNT;
    w->running = true;
    w->sun_hour = 5.3;
    vd_status status = vd_sdl_open(&w->sdl);
    const bool opened = status.code == VD_OK;
    signals caught = {0};
    if (opened) {
        signals_begin(&caught, w);
        status = open_window(w);
    }
    if (status.code == VD_OK) {
        status = furnish(w);
    }
    if (status.code == VD_OK) {
        name_worlds(w);
        w->threads = w->settings.threads > 0 ? w->settings.threads
                                             : vd_window_render_most_threads(w->render);
        vd_window_enter(w, 0);
        status = loop(w);
        report(w);
    }
    clear_up(w);
    if (opened) {
        signals_end(&caught);
    }
    free(w);
    return status;
}

#endif

/* window_keys.c: what keys and the mouse do. */
#if defined(VEDUTA_SDL_LIBRARY)

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "window_state.h"

/* Keys that are held: those of the published engines. */
static const struct {
    SDL_Keycode key;
    vd_motion_axis axis;
    double direction;
} held_keys[] = {
    {SDLK_w, VD_MOTION_FORWARD, 1},  {SDLK_UP, VD_MOTION_FORWARD, 1},
    {SDLK_s, VD_MOTION_FORWARD, -1}, {SDLK_DOWN, VD_MOTION_FORWARD, -1},
    {SDLK_a, VD_MOTION_TURN, -1},    {SDLK_LEFT, VD_MOTION_TURN, -1},
    {SDLK_d, VD_MOTION_TURN, 1},     {SDLK_RIGHT, VD_MOTION_TURN, 1},
    {SDLK_r, VD_MOTION_RISE, 1},     {SDLK_f, VD_MOTION_RISE, -1},
    {SDLK_e, VD_MOTION_LOOK, 1},     {SDLK_q, VD_MOTION_LOOK, -1},
    {SDLK_u, VD_MOTION_FOV, 1},      {SDLK_j, VD_MOTION_FOV, -1},
    {SDLK_i, VD_MOTION_HEIGHTS, 1},  {SDLK_k, VD_MOTION_HEIGHTS, -1},
    {SDLK_o, VD_MOTION_HAZE, 1},     {SDLK_l, VD_MOTION_HAZE, -1},
};
_Static_assert(sizeof held_keys / sizeof held_keys[0] == VD_WINDOW_HELD, "a flag for every key");

/* A key that was only touched moves by this share of a full speed, dying down. */
static const double nudge = 0.5;

static void set_wanted(vd_window *w) {
    memset(w->motion.wanted, 0, sizeof w->motion.wanted);
    for (int i = 0; i < VD_WINDOW_HELD; i++) {
        if (w->held[i]) {
            double *wanted = &w->motion.wanted[held_keys[i].axis];
            *wanted = fmax(-1.0, fmin(1.0, *wanted + held_keys[i].direction));
        }
    }
}

/* Takes a key that is held; false when it is none. */
static bool hold(vd_window *w, SDL_Keycode key, bool down) {
    for (int i = 0; i < VD_WINDOW_HELD; i++) {
        if (held_keys[i].key != key) {
            continue;
        }
        if (down && !w->held[i] && w->worlds[w->world].entered) {
            double *speed = &w->motion.speed[held_keys[i].axis];
            *speed = fmax(-1.0, fmin(1.0, *speed + nudge * held_keys[i].direction));
            vd_window_touch(w);
        }
        w->held[i] = down && w->worlds[w->world].entered;
        set_wanted(w);
        return true;
    }
    return false;
}

/* ---- keys that do something once ---------------------------------------------------------------
 */

static void toggle_card(vd_window *w, vd_card card) {
    if (vd_cards_shown(w->cards, card)) {
        vd_cards_hide(w->cards, card);
    } else if (card == VD_CARD_HELP) {
        vd_cards_hide(w->cards, VD_CARD_PANEL); /* there is room for one of them */
        vd_cards_show_help(w->cards);
    } else if (card == VD_CARD_PANEL) {
        vd_cards_hide(w->cards, VD_CARD_HELP);
        vd_cards_show_panel(w->cards, w->options, &w->worlds[w->world].defaults, w->sliding);
    } else {
        const vd_card_times none = {.frames = &w->frame_times,
                                    .period_s = w->period_s,
                                    .scale = 1.0,
                                    .width = w->width,
                                    .height = w->height,
                                    .threads = w->threads};
        vd_cards_show_times(w->cards, &none);
    }
}

static void print_camera(vd_window *w) {
    char flags[2048];
    if (!w->worlds[w->world].entered) {
        return;
    }
    vd_window_flags(w, flags, sizeof flags);
    printf("%s\n", flags);
    fflush(stdout);
    vd_window_note(w, w->sdl.SetClipboardText(flags) == 0
                          ? "the camera's flags are printed and copied"
                          : "the camera's flags are printed; the clipboard did not take them");
}

static void shoot(vd_window *w) {
    char path[64];
    if (!w->worlds[w->world].entered) {
        return;
    }
    vd_new_file_name("veduta-view", "png", path, sizeof path);
    vd_window_render_shoot(w->render, path);
}

static void record(vd_window *w) {
    vd_window_world *world = &w->worlds[w->world];
    if (!world->entered) {
        return;
    }
    const double now = vd_seconds_now();
    if (!w->recording.on) {
        const bool begun =
            vd_recording_begin(&w->recording, now, &world->state, world->camera.roll);
        vd_window_note(w, begun ? "recording a path; F9 ends it" : "out of memory for a path");
        return;
    }
    char path[64];
    vd_new_file_name("veduta-path", "json", path, sizeof path);
    vd_recording_hold(&w->recording, now - w->period_s);
    vd_recording_note(&w->recording, now, &world->state);
    vd_status status = vd_recording_end(&w->recording, path);
    if (status.code == VD_OK) {
        vd_window_note(w, "wrote %s", path);
        fprintf(stderr, "veduta: wrote %s\n", path);
    } else {
        vd_window_note(w, "%s", status.message);
    }
}

static void change_threads(vd_window *w, int by) {
    const int most = vd_window_render_most_threads(w->render);
    int threads = w->threads + by;
    threads = threads < 1 ? 1 : threads > most ? most : threads;
    vd_window_set_live(w, VD_LIVE_THREADS, threads);
    vd_window_note(w, "%d thread%s", threads, threads == 1 ? "" : "s");
}

static void next_method(vd_window *w) {
    char value[64];
    vd_window_next_word(w, VD_LIVE_METHOD, 1);
    vd_live_value(w->options, &w->worlds[w->world].defaults, VD_LIVE_METHOD, value);
    vd_window_note(w, "method %s", value);
}

static void toggle_full_screen(vd_window *w) {
    w->full_screen = !w->full_screen;
    if (w->full_screen) {
        w->sdl.GetWindowSize(w->handle, &w->small_width, &w->small_height);
    }
    w->sdl.SetWindowFullscreen(w->handle,
                               w->full_screen ? (Uint32)SDL_WINDOW_FULLSCREEN_DESKTOP : 0u);
    if (!w->full_screen && w->small_width > 0) {
        /* Without a window manager nobody else does. */
        w->sdl.SetWindowSize(w->handle, w->small_width, w->small_height);
    }
}

static void toggle_sun(vd_window *w) {
    w->sun_moves = !w->sun_moves && w->worlds[w->world].entered;
    vd_window_note(w, w->sun_moves ? "the sun moves, an hour a second" : "the sun stands still");
    vd_window_touch(w);
}

/* What lies over impostors, and whether they are kept while the camera moves. */
static void look_at_impostors(vd_window *w, SDL_Keycode key) {
    if (w->def->impostors == NULL) {
        vd_window_note(w, "there are no impostors; begin with veduta view --impostors");
        return;
    }
    if (key == SDLK_v) {
        w->show = (vd_impostor_show)((w->show + 1) % VD_IMPOSTOR_SHOW_COUNT);
        vd_window_note(w, "over impostors: %s",
                       w->show != VD_IMPOSTOR_SHOW_PICTURES ? vd_impostor_show_name(w->show)
                                                            : "nothing");
    } else {
        w->frozen = !w->frozen;
        vd_window_note(w, w->frozen ? "impostors are kept as they are" : "impostors follow again");
    }
    vd_window_touch(w);
}

static void press(vd_window *w, SDL_Keycode key) {
    if (key >= SDLK_1 && key <= SDLK_9) {
        const int number = (int)(key - SDLK_1);
        if (number < w->world_count) {
            vd_window_enter(w, number);
        } else {
            vd_window_note(w, "there is no world %d; name more files, or drop them here",
                           number + 1);
        }
        return;
    }
    switch (key) {
    case SDLK_ESCAPE:
        w->running = false;
        break;
    case SDLK_h:
    case SDLK_F1:
        toggle_card(w, VD_CARD_HELP);
        break;
    case SDLK_p:
        toggle_card(w, VD_CARD_PANEL);
        break;
    case SDLK_TAB:
        toggle_card(w, VD_CARD_TIMES);
        break;
    case SDLK_c:
        print_camera(w);
        break;
    case SDLK_t:
        toggle_sun(w);
        break;
    case SDLK_m:
        next_method(w);
        break;
    case SDLK_v:
    case SDLK_x:
        look_at_impostors(w, key);
        break;
    case SDLK_LEFTBRACKET:
    case SDLK_RIGHTBRACKET:
        change_threads(w, key == SDLK_LEFTBRACKET ? -1 : 1);
        break;
    case SDLK_F9:
        record(w);
        break;
    case SDLK_F11:
        toggle_full_screen(w);
        break;
    case SDLK_F12:
        shoot(w);
        break;
    default:
        break;
    }
}

/* ---- mouse -------------------------------------------------------------------------------------
 */

/* Mouse positions are in the window's units, the panel in the surface's pixels. */
static int to_pixels(const vd_window *w, int position) {
    int width, height;
    w->sdl.GetWindowSize(w->handle, &width, &height);
    return width > 0 ? position * w->width / width : position;
}

static void slide(vd_window *w, vd_live live, double position) {
    const vd_option_value before = vd_window_keep(w, live);
    vd_status status =
        vd_live_set_position(w->options, &w->worlds[w->world].defaults, live, position);
    vd_window_options_changed(w, status, live, before);
}

static void button(vd_window *w, const SDL_MouseButtonEvent *event) {
    if (event->type == SDL_MOUSEBUTTONUP) {
        w->looking = false;
        w->sliding = VD_LIVE_COUNT;
        return;
    }
    vd_live live;
    double position;
    if (!w->worlds[w->world].entered) {
        return;
    }
    if (!vd_cards_panel_at(w->cards, to_pixels(w, event->x), to_pixels(w, event->y), &live,
                           &position)) {
        w->looking = true;
    } else if (live != VD_LIVE_COUNT && vd_live_is_slider(live)) {
        w->sliding = live;
        slide(w, live, position);
    } else if (live != VD_LIVE_COUNT) {
        vd_window_next_word(w, live, event->button == SDL_BUTTON_RIGHT ? -1 : 1);
    }
}

static void mouse_moved(vd_window *w, const SDL_MouseMotionEvent *event) {
    vd_window_world *world = &w->worlds[w->world];
    vd_live live;
    double position;
    if (w->sliding != VD_LIVE_COUNT) {
        if (vd_cards_panel_at(w->cards, to_pixels(w, event->x), to_pixels(w, event->y), &live,
                              &position)) {
            slide(w, w->sliding, position);
        }
    } else if (w->looking && world->entered) {
        /* What is in the picture's middle follows the mouse. */
        int width, height;
        w->sdl.GetWindowSize(w->handle, &width, &height);
        const double degrees = height > 0 ? world->state.fov / height : 0.1;
        vd_motion_turn(&world->state, -event->xrel * degrees, event->yrel * degrees);
        vd_window_touch(w);
    }
}

static void wheel(vd_window *w, const SDL_MouseWheelEvent *event) {
    w->motion.pace = fmax(1.0 / 64.0, fmin(64.0, w->motion.pace * pow(1.25, event->y)));
    vd_window_note(w, "speed × %.2f", w->motion.pace);
}

void vd_window_handle(vd_window *w, const SDL_Event *event) {
    switch (event->type) {
    case SDL_KEYDOWN:
        if (!hold(w, event->key.keysym.sym, true) && event->key.repeat == 0) {
            press(w, event->key.keysym.sym);
        }
        break;
    case SDL_KEYUP:
        (void)hold(w, event->key.keysym.sym, false);
        break;
    case SDL_WINDOWEVENT:
        if (event->window.event == SDL_WINDOWEVENT_FOCUS_LOST) {
            memset(w->held, 0, sizeof w->held);
            set_wanted(w);
        }
        break;
    case SDL_MOUSEBUTTONDOWN:
    case SDL_MOUSEBUTTONUP:
        button(w, &event->button);
        break;
    case SDL_MOUSEMOTION:
        mouse_moved(w, &event->motion);
        break;
    case SDL_MOUSEWHEEL:
        wheel(w, &event->wheel);
        break;
    case SDL_DROPFILE:
        vd_window_open(w, event->drop.file);
        w->sdl.free(event->drop.file);
        break;
    default:
        break;
    }
}

#else

typedef int vd_window_keys_without_sdl; /* a translation unit holds something */

#endif

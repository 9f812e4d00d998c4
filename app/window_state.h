/* window_state.h: the insides of the window, for the event thread's files. */
#ifndef VEDUTA_APP_WINDOW_STATE_H
#define VEDUTA_APP_WINDOW_STATE_H

#include <pthread.h>
#include <stdatomic.h>

#include "window.h"
#include "window_cards.h"
#include "window_motion.h"
#include "window_path.h"
#include "window_render.h"
#include "window_sdl.h"

/* One of the worlds, by the keys 1 … 9. */
typedef struct vd_window_world {
    const char *input;         /* null: what the whole command line says (--join, --function) */
    char *dropped;             /* owned: the input, when it was dropped on the window */
    bool entered;              /* its camera and defaults are known */
    vd_camera_settings camera; /* roll and near */
    vd_motion_state state;
    vd_look_defaults defaults;
} vd_window_world;

/* What a key does while it is held; a pair of keys is an axis. */
enum { VD_WINDOW_HELD = 18 };

typedef struct vd_window {
    const vd_window_def *def;
    vd_options *options;
    vd_render_settings settings; /* read from the options */

    vd_sdl sdl;
    SDL_Window *handle;
    Uint32 wake_type;
    atomic_bool woken; /* an event of that type is in the queue */
    uint32_t *compose; /* where the surface's format is not ours */
    size_t compose_room;

    vd_context *context; /* of one thread, for the cards */
    vd_cards *cards;
    unsigned cards_shown; /* version */
    vd_window_render *render;

    vd_window_world worlds[VD_WINDOW_WORLDS];
    int world, world_count;
    int width, height, threads;

    vd_motion motion;
    bool held[VD_WINDOW_HELD];
    bool looking;          /* the mouse turns the camera */
    vd_live sliding;       /* the mouse moves this slider; VD_LIVE_COUNT: none */
    vd_impostor_show show; /* over impostors */
    bool frozen;           /* they are kept as they are */
    bool sun_moves;
    double sun_hour;
    vd_recording recording;

    bool running, full_screen, hidden;
    int small_width, small_height; /* of the window before it filled the screen, its units */
    bool changed;                  /* something to be drawn since the last request */
    bool still_sent;               /* the finished picture was asked for */
    bool expose;                   /* the surface must be filled again */
    double change_s, tick_s, next_tick_s, period_s;

    char note[VD_WINDOW_TEXT]; /* a sentence shown for some seconds */
    double note_until_s;
    int shots_seen;
    uint64_t seen;             /* version of what a scene that changes by itself has shown */
    char remote_lines[2][100]; /* what is said of it beside the frame times */
    bool changes;

    vd_times frame_times, latencies; /* of moving pictures */
    double shown_s, show_s, latency_s;
    int pictures;
} vd_window;

/* window_keys.c: takes an event. */
void vd_window_handle(vd_window *window, const SDL_Event *event);

/* window_show.c: says on the cards what there is to say, and shows what is new. */
void vd_window_update_cards(vd_window *window, const vd_window_news *news);
void vd_window_show(vd_window *window);

/* window.c: what keys do to it. */

/* Something changes now: a picture is wanted, and the finished one later. */
void vd_window_touch(vd_window *window);

/* Shows a sentence for some seconds. */
void vd_window_note(vd_window *window, const char *format, ...) VD_PRINTF(2, 3);

/* Keeps an option's value before it is set. */
vd_option_value vd_window_keep(const vd_window *window, vd_live live);

/* Reads the settings again after an option was set (`status` of that); says so and takes the option
 * back where that cannot be. `before` is taken over. */
void vd_window_options_changed(vd_window *window, vd_status status, vd_live live,
                               vd_option_value before);

/* Sets a slider in its option's unit. */
void vd_window_set_live(vd_window *window, vd_live live, double value);

/* Takes the next word of an option. */
void vd_window_next_word(vd_window *window, vd_live live, int step);

/* Shows another world. */
void vd_window_enter(vd_window *window, int world);

/* Opens a file in the next free place. */
void vd_window_open(vd_window *window, const char *path);

/* Writes the flags of what is seen now. */
void vd_window_flags(const vd_window *window, char *out, size_t out_bytes);

#endif

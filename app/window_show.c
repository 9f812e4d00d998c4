/* window_show.c: the newest picture and the cards over it, onto the window's surface. */
#if defined(VEDUTA_SDL_LIBRARY)

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "window_state.h"

void vd_window_update_cards(vd_window *w, const vd_window_news *news) {
    char sentence[VD_WINDOW_TEXT + 80];
    const double now = vd_seconds_now();
    if (news->shots != w->shots_seen) {
        w->shots_seen = news->shots;
        vd_window_note(w, "%s", news->shot);
        fprintf(stderr, "veduta: %s\n", news->shot);
    }
    if (w->note[0] != '\0' && now >= w->note_until_s) {
        w->note[0] = '\0';
    }
    if (news->state == VD_WORLD_LOADING || news->state == VD_WORLD_NONE) {
        const char *input = w->worlds[w->world].input;
        snprintf(sentence, sizeof sentence, "%s %.300s %3.0f %%", news->stage,
                 input != NULL ? input : "the world", 100.0 * news->progress);
        vd_cards_show_message(w->cards, sentence, news->progress, false);
    } else if (w->note[0] != '\0') {
        vd_cards_show_message(w->cards, w->note, -1.0, false);
    } else if (news->changes && news->scene.state[0] != '\0') {
        vd_cards_show_message(w->cards, news->scene.state, -1.0, news->scene.failed);
    } else if (news->failing) {
        vd_cards_show_message(w->cards, news->failure, -1.0, true);
    } else {
        vd_cards_hide(w->cards, VD_CARD_MESSAGE);
    }
    w->changes = news->changes;
    memcpy(w->remote_lines, news->scene.lines, sizeof w->remote_lines);
    if (vd_cards_shown(w->cards, VD_CARD_PANEL)) {
        vd_cards_show_panel(w->cards, w->options, &w->worlds[w->world].defaults, w->sliding);
    }
}

static void update_times(vd_window *w, const vd_window_picture *picture) {
    if (picture == NULL || !vd_cards_shown(w->cards, VD_CARD_TIMES)) {
        return;
    }
    const vd_card_times times = {.frames = &w->frame_times,
                                 .period_s = w->period_s,
                                 .scale = picture->scale,
                                 .look_s = picture->look_s,
                                 .draw_s = picture->draw_s,
                                 .convert_s = picture->convert_s,
                                 .show_s = w->show_s,
                                 .latency_s = w->latency_s,
                                 .width = picture->width,
                                 .height = picture->height,
                                 .threads = w->threads,
                                 .impostors = picture->by_impostors ? &picture->impostors : NULL,
                                 .remote = w->changes ? w->remote_lines : NULL,
                                 .frozen = w->frozen};
    vd_cards_show_times(w->cards, &times);
}

/* Copies a picture to the surface; one of another size, as just after resizing, is stretched. */
static void copy_picture(const vd_window_picture *p, uint32_t *to, size_t stride, int width,
                         int height) {
    for (int y = 0; y < height; y++) {
        uint32_t *row = to + (size_t)y * stride;
        if (p == NULL) {
            for (int x = 0; x < width; x++) {
                row[x] = 0xFF182028u;
            }
            continue;
        }
        const uint32_t *from =
            p->pixels + (size_t)((int64_t)y * p->height / height) * (size_t)p->width;
        if (p->width == width) {
            memcpy(row, from, (size_t)width * sizeof row[0]);
            continue;
        }
        for (int x = 0; x < width; x++) {
            row[x] = from[(int64_t)x * p->width / width];
        }
    }
}

/* Whether a surface's pixels are 0x??RRGGBB. */
static bool is_ours(Uint32 format) {
    return format == SDL_PIXELFORMAT_RGB888 || format == SDL_PIXELFORMAT_ARGB8888;
}

static void fill_surface(vd_window *w, const vd_window_picture *picture) {
    SDL_Surface *surface = w->sdl.GetWindowSurface(w->handle);
    if (surface == NULL || w->sdl.LockSurface(surface) != 0) {
        return;
    }
    const int width = surface->w, height = surface->h;
    uint32_t *pixels = surface->pixels;
    size_t stride = (size_t)surface->pitch / sizeof pixels[0];
    const bool ours = is_ours(surface->format->format);
    if (!ours) {
        const size_t count = (size_t)width * (size_t)height;
        if (count > w->compose_room) {
            free(w->compose);
            w->compose = malloc(count * sizeof w->compose[0]);
            w->compose_room = w->compose != NULL ? count : 0;
        }
        pixels = w->compose;
        stride = (size_t)width;
    }
    if (pixels != NULL) {
        copy_picture(picture, pixels, stride, width, height);
        vd_cards_lay(w->cards, pixels, stride, width, height);
        if (!ours) {
            w->sdl.ConvertPixels(width, height, SDL_PIXELFORMAT_RGB888, pixels, width * 4,
                                 surface->format->format, surface->pixels, surface->pitch);
        }
    }
    w->sdl.UnlockSurface(surface);
    w->sdl.UpdateWindowSurface(w->handle);
}

void vd_window_show(vd_window *w) {
    bool fresh;
    const vd_window_picture *picture = vd_window_render_take(w->render, &fresh);
    if (fresh) {
        update_times(w, picture);
    }
    if (!fresh && !w->expose && w->cards_shown == vd_cards_version(w->cards)) {
        return;
    }
    const double start = vd_seconds_now();
    fill_surface(w, picture);
    const double now = vd_seconds_now();
    w->cards_shown = vd_cards_version(w->cards);
    w->expose = false;
    w->show_s = now - start;
    if (fresh) {
        w->pictures++;
        w->latency_s = now - picture->event_s;
        if (!picture->exact && now - w->shown_s < 0.25) {
            vd_times_add(&w->frame_times, now - w->shown_s);
            vd_times_add(&w->latencies, w->latency_s);
        }
        w->shown_s = now;
        if (w->def->frames > 0 && w->pictures >= w->def->frames) {
            w->running = false;
        }
    }
}

#else

typedef int vd_window_show_without_sdl; /* a translation unit holds something */

#endif

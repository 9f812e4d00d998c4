/* window_cards.h: what the window lays over its picture: help, options, times, and sentences. Cards
 * are pictures of their own, drawn when what they say changes and laid over what is shown; the
 * renderer's frames know nothing of them, so they are in no screenshot. */
#ifndef VEDUTA_APP_WINDOW_CARDS_H
#define VEDUTA_APP_WINDOW_CARDS_H

#include "window_look.h"
#include "window_pace.h"

typedef enum vd_card {
    VD_CARD_HELP = 0,
    VD_CARD_PANEL,
    VD_CARD_TIMES,
    VD_CARD_MESSAGE,
    VD_CARD_COUNT
} vd_card;

typedef struct vd_cards vd_cards;

/* `scale`: pixels of the window's surface for one of its units (2 on many high-resolution
 * displays). Returns null when memory is out. */
vd_cards *vd_cards_create(vd_context *context, double scale);
void vd_cards_destroy(vd_cards **cards);

/* Every change of what can be seen adds one. */
unsigned vd_cards_version(const vd_cards *cards);

void vd_cards_hide(vd_cards *cards, vd_card card);
bool vd_cards_shown(const vd_cards *cards, vd_card card);

/* The list of keys. */
void vd_cards_show_help(vd_cards *cards);

/* The live options. `current` is the one under the mouse; VD_LIVE_COUNT: none. */
void vd_cards_show_panel(vd_cards *cards, const vd_options *options,
                         const vd_look_defaults *defaults, vd_live current);

/* Finds the option at a pixel of the surface, and where on its slider, 0 … 1. */
bool vd_cards_panel_at(const vd_cards *cards, int x, int y, vd_live *live, double *position);

typedef struct vd_card_times {
    const vd_times *frames; /* from one moving picture to the next */
    double period_s;        /* of the display */
    double scale;           /* of the last moving picture's side */
    double look_s, draw_s, convert_s, show_s, latency_s;
    int width, height, threads;
    const vd_impostor_stats *impostors; /* null: none */
    const char (*remote)[100];          /* [2] lines about a server's world; null: none */
    bool frozen;
} vd_card_times;

void vd_cards_show_times(vd_cards *cards, const vd_card_times *times);

/* What is said of impostors: how many are what, how many are kept and new, how well they do; and
 * last, where something could not be drawn, that. Returns how many lines: 3, or 4 with failures. */
#define VD_CARD_IMPOSTOR_LINES 4
int vd_cards_impostor_lines(const vd_impostor_stats *stats, bool frozen,
                            char lines[VD_CARD_IMPOSTOR_LINES][100]);

/* A sentence in the middle below; `share` 0 … 1 draws a bar of progress under it, below 0 none. */
void vd_cards_show_message(vd_cards *cards, const char *sentence, double share, bool failure);

/* Lays all cards over the surface's pixels. */
void vd_cards_lay(vd_cards *cards, uint32_t *pixels, size_t stride, int width, int height);

#endif

/* window_cards.c: drawing the cards. */
#include "window_cards.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "window_pixels.h"
#include "window_text.h"

static const vd_rgba8 paper = {16, 20, 26, 205}, ink = {236, 240, 244, 255},
                      faint = {150, 160, 172, 255}, blue = {96, 168, 240, 255},
                      dark = {60, 68, 80, 255}, orange = {255, 168, 88, 255};

typedef struct card {
    vd_frame *frame;
    bool shown;
    char said[VD_LIVE_COUNT * 120]; /* what is drawn, so that the same is not drawn again */
    int x, y;                       /* on the surface, when it was last laid */
} card;

struct vd_cards {
    vd_context *context;
    vd_canvas *canvas;
    double scale;
    unsigned version;
    card cards[VD_CARD_COUNT];
};

vd_cards *vd_cards_create(vd_context *context, double scale) {
    vd_cards *cards = calloc(1, sizeof *cards);
    if (cards == NULL) {
        return NULL;
    }
    cards->context = context;
    cards->scale = scale > 1.0 ? scale : 1.0;
    cards->canvas = vd_canvas_create(context);
    if (cards->canvas == NULL) {
        vd_cards_destroy(&cards);
    }
    return cards;
}

void vd_cards_destroy(vd_cards **cards) {
    if (*cards != NULL) {
        for (int i = 0; i < VD_CARD_COUNT; i++) {
            vd_frame_destroy(&(*cards)->cards[i].frame);
        }
        vd_canvas_destroy(&(*cards)->canvas);
        free(*cards);
    }
    *cards = NULL;
}

unsigned vd_cards_version(const vd_cards *cards) {
    return cards->version;
}

bool vd_cards_shown(const vd_cards *cards, vd_card which) {
    return cards->cards[which].shown;
}

void vd_cards_hide(vd_cards *cards, vd_card which) {
    cards->version += cards->cards[which].shown;
    cards->cards[which].shown = false;
}

/* Whether a card shows this already; remembers it else. */
static bool says(vd_cards *cards, vd_card which, const char *what) {
    card *c = &cards->cards[which];
    if (c->shown && strcmp(c->said, what) == 0) {
        return true;
    }
    snprintf(c->said, sizeof c->said, "%s", what);
    return false;
}

/* Begins a card of a size in the window's units: an empty frame and its paper. */
static bool begin(vd_cards *cards, vd_card which, double width, double height) {
    card *c = &cards->cards[which];
    const int w = (int)ceil(width * cards->scale), h = (int)ceil(height * cards->scale);
    if (c->frame == NULL || c->frame->width != w || c->frame->height != h) {
        vd_frame_destroy(&c->frame);
        vd_status status = vd_frame_create(cards->context, w, h, 0, &c->frame);
        if (status.code != VD_OK) {
            c->shown = false; /* without memory for letters there is none to say so */
            return false;
        }
    }
    memset(c->frame->rgba, 0, 4 * c->frame->stride * (size_t)h);
    vd_canvas_clear(cards->canvas);
    vd_canvas_box(cards->canvas, 0, 0, w, h, paper);
    return true;
}

static void finish(vd_cards *cards, vd_card which) {
    card *c = &cards->cards[which];
    vd_status status = vd_canvas_draw(cards->canvas, c->frame);
    c->shown = status.code == VD_OK;
    cards->version++;
}

/* Text in the window's units. */
static void put(vd_cards *cards, double x, double y, double size, vd_rgba8 color,
                const char *text) {
    vd_window_text(cards->canvas, x * cards->scale, y * cards->scale, size * cards->scale, color,
                   text);
}

static void box(vd_cards *cards, double x, double y, double width, double height, vd_rgba8 color) {
    const double s = cards->scale;
    vd_canvas_box(cards->canvas, x * s, y * s, width * s, height * s, color);
}

/* ---- help --------------------------------------------------------------------------------------
 */

void vd_cards_show_help(vd_cards *cards) {
    static const char *const lines[][2] = {
        {"W S  ↑ ↓", "forward, back"},
        {"A D  ← →", "turn left, right"},
        {"R F", "up, down"},
        {"E Q", "look up, down"},
        {"drag", "look around"},
        {"wheel", "fly faster, slower"},
        {"U J", "wider, narrower view"},
        {"I K", "higher, lower mountains"},
        {"O L", "see farther, less far"},
        {"1 … 9", "the worlds on the command line"},
        {"drop a file", "opens it"},
        {"P", "options"},
        {"T", "the sun moves"},
        {"M", "method"},
        {"V", "impostors: bounds, age, error"},
        {"X", "impostors are kept, the camera moves"},
        {"[ ]", "threads"},
        {"C", "print and copy the camera as flags"},
        {"F9", "record a path, and end it"},
        {"F12", "screenshot"},
        {"Tab", "frame times"},
        {"F11", "full screen"},
        {"H  F1", "this page"},
        {"Esc", "end"},
    };
    enum { LINES = sizeof lines / sizeof lines[0] };
    if (says(cards, VD_CARD_HELP, "help") || !begin(cards, VD_CARD_HELP, 500, 34 + 21.0 * LINES)) {
        return;
    }
    for (int i = 0; i < LINES; i++) {
        put(cards, 20, 34 + 21.0 * i, 10, blue, lines[i][0]);
        put(cards, 150, 34 + 21.0 * i, 10, ink, lines[i][1]);
    }
    finish(cards, VD_CARD_HELP);
}

/* ---- options -----------------------------------------------------------------------------------
 */

/* Of the panel, in the window's units. */
static const double row_height = 24, panel_top = 14, panel_width = 470, slider_left = 170,
                    slider_width = 170, value_left = 356;

void vd_cards_show_panel(vd_cards *cards, const vd_options *options,
                         const vd_look_defaults *defaults, vd_live current) {
    char said[sizeof cards->cards[0].said];
    int used = 0;
    for (int i = 0; i < VD_LIVE_COUNT; i++) {
        char value[64];
        vd_live_value(options, defaults, (vd_live)i, value);
        used += snprintf(said + used, sizeof said - (size_t)used, "%s%s|", value,
                         i == (int)current ? "*" : "");
    }
    if (says(cards, VD_CARD_PANEL, said) ||
        !begin(cards, VD_CARD_PANEL, panel_width, 2 * panel_top + row_height * VD_LIVE_COUNT)) {
        return;
    }
    for (int i = 0; i < VD_LIVE_COUNT; i++) {
        const vd_live live = (vd_live)i;
        const double y = panel_top + row_height * (i + 0.5);
        char label[40], value[64];
        vd_live_label(live, label);
        vd_live_value(options, defaults, live, value);
        if (live == current) {
            box(cards, 6, y - row_height / 2, panel_width - 12, row_height, dark);
        }
        put(cards, 18, y + 5, 10, ink, label);
        if (vd_live_is_slider(live)) {
            const double at = vd_live_position(options, defaults, live) * slider_width;
            box(cards, slider_left, y - 2, slider_width, 4, faint);
            box(cards, slider_left, y - 2, at, 4, blue);
            box(cards, slider_left + at - 3, y - 8, 6, 16, ink);
            put(cards, value_left, y + 5, 10, blue, value);
        } else {
            put(cards, slider_left, y + 5, 10, blue, value);
        }
    }
    finish(cards, VD_CARD_PANEL);
}

bool vd_cards_panel_at(const vd_cards *cards, int x, int y, vd_live *live, double *position) {
    const card *c = &cards->cards[VD_CARD_PANEL];
    if (!c->shown || c->frame == NULL || x < c->x || y < c->y || x >= c->x + c->frame->width ||
        y >= c->y + c->frame->height) {
        return false;
    }
    const double row = ((y - c->y) / cards->scale - panel_top) / row_height;
    const double at = ((x - c->x) / cards->scale - slider_left) / slider_width;
    *live = row < 0.0 || row >= VD_LIVE_COUNT ? VD_LIVE_COUNT : (vd_live)(int)row;
    *position = at < 0.0 ? 0.0 : at > 1.0 ? 1.0 : at;
    return true;
}

/* ---- times -------------------------------------------------------------------------------------
 */

int vd_cards_impostor_lines(const vd_impostor_stats *s, bool frozen,
                            char lines[VD_CARD_IMPOSTOR_LINES][100]) {
    enum { BYTES = 100 };
    const double drawn = s->pixels_drawn > 0 ? (double)s->pixels_drawn : 1.0;
    (void)snprintf(lines[0], BYTES, "%llu shown  %llu direct  %llu waiting%s",
                   (unsigned long long)s->shown, (unsigned long long)s->direct,
                   (unsigned long long)s->waiting, frozen ? "  kept" : "");
    (void)snprintf(lines[1], BYTES, "%llu drawn  %llu reused  %llu live",
                   (unsigned long long)s->drawn, (unsigned long long)s->reused,
                   (unsigned long long)s->pictures);
    (void)snprintf(lines[2], BYTES, "R %.1f  D %.2f  %.2f px  %llu dropped",
                   (double)s->pixels_shown / drawn, s->overdraw, s->error_px,
                   (unsigned long long)s->dropped);
    (void)snprintf(lines[3], BYTES, "%llu failed", (unsigned long long)s->failed);
    return s->failed > 0 ? 4 : 3;
}

void vd_cards_show_times(vd_cards *cards, const vd_card_times *t) {
    const double width = 2.0 * VD_TIMES_COUNT / 2 + 40, top = 20, graph = 90;
    char impostors[VD_CARD_IMPOSTOR_LINES][100];
    const int lines = t->impostors != NULL
                          ? vd_cards_impostor_lines(t->impostors, t->frozen, impostors)
                      : t->remote != NULL ? 2
                                          : 0;
    if (!begin(cards, VD_CARD_TIMES, width, 210 + 19 * lines + (lines > 0 ? 2 : 0))) {
        return;
    }
    cards->cards[VD_CARD_TIMES].said[0] = '\0';
    /* The graph's height is three of the display's periods. */
    const double per_second = graph / (3.0 * t->period_s);
    for (int i = 0; i < t->frames->count; i++) {
        const int at = (t->frames->next - t->frames->count + i + VD_TIMES_COUNT) % VD_TIMES_COUNT;
        const double seconds = (double)t->frames->seconds[at];
        const double height = fmin(graph, seconds * per_second);
        box(cards, 20 + i, top + graph - height, 1, height,
            seconds > 1.5 * t->period_s ? orange : blue);
    }
    box(cards, 20, top + graph * 2.0 / 3.0, VD_TIMES_COUNT, 1, faint);
    char line[160];
    snprintf(line, sizeof line, "p50 %.1f ms  p99 %.1f ms", 1e3 * vd_times_share(t->frames, 0.5),
             1e3 * vd_times_share(t->frames, 0.99));
    put(cards, 20, top + graph + 22, 9, ink, line);
    snprintf(line, sizeof line, "%dx%d × %.2f  %d threads", t->width, t->height, t->scale,
             t->threads);
    put(cards, 20, top + graph + 41, 9, ink, line);
    snprintf(line, sizeof line, "light %.1f draw %.1f", 1e3 * t->look_s, 1e3 * t->draw_s);
    put(cards, 20, top + graph + 60, 9, faint, line);
    snprintf(line, sizeof line, "convert %.1f show %.1f late %.1f", 1e3 * t->convert_s,
             1e3 * t->show_s, 1e3 * t->latency_s);
    put(cards, 20, top + graph + 79, 9, faint, line);
    for (int i = 0; i < lines; i++) {
        put(cards, 20, top + graph + 98 + 19 * i, 9, i == 3 ? orange : ink,
            t->impostors != NULL ? impostors[i] : t->remote[i]);
    }
    finish(cards, VD_CARD_TIMES);
}

/* ---- sentences ---------------------------------------------------------------------------------
 */

enum { MOST_LINES = 8, LINE_BYTES = 160 };

/* Breaks a text at spaces into lines that are no wider. Returns how many. */
static int wrap(vd_canvas *canvas, const char *text, double size, double width,
                char lines[MOST_LINES][LINE_BYTES]) {
    int count = 0;
    while (*text != '\0' && count < MOST_LINES) {
        int taken = 0, good = 0;
        char *line = lines[count++];
        while (text[taken] != '\0' && taken < LINE_BYTES - 1) {
            const int next = taken + 1 + (int)strcspn(text + taken + 1, " ");
            snprintf(line, LINE_BYTES, "%.*s", next < LINE_BYTES ? next : LINE_BYTES - 1, text);
            if (good > 0 && vd_window_text_width(canvas, size, line) > width) {
                break;
            }
            good = taken = next;
        }
        good = good < LINE_BYTES ? good : LINE_BYTES - 1;
        snprintf(line, LINE_BYTES, "%.*s", good, text);
        text += good;
        text += strspn(text, " ");
    }
    return count;
}

void vd_cards_show_message(vd_cards *cards, const char *sentence, double share, bool failure) {
    enum { SIZE = 10, WIDTH = 560, STEP = 20 };
    char said[600];
    snprintf(said, sizeof said, "%s|%.2f|%d", sentence, share, failure);
    if (says(cards, VD_CARD_MESSAGE, said)) {
        return;
    }
    char lines[MOST_LINES][LINE_BYTES];
    const int count = wrap(cards->canvas, sentence, SIZE, WIDTH, lines);
    double width = share >= 0.0 ? 240 : 40;
    for (int i = 0; i < count; i++) {
        width = fmax(width, vd_window_text_width(cards->canvas, SIZE, lines[i]));
    }
    const double height = 26 + STEP * count + (share >= 0.0 ? 16 : 0);
    if (!begin(cards, VD_CARD_MESSAGE, width + 40, height)) {
        return;
    }
    for (int i = 0; i < count; i++) {
        put(cards, 20, 28.0 + STEP * i, SIZE, failure ? orange : ink, lines[i]);
    }
    if (share >= 0.0) {
        box(cards, 20, height - 18, width, 4, faint);
        box(cards, 20, height - 18, width * fmin(share, 1.0), 4, blue);
    }
    finish(cards, VD_CARD_MESSAGE);
}

void vd_cards_lay(vd_cards *cards, uint32_t *pixels, size_t stride, int width, int height) {
    for (int i = 0; i < VD_CARD_COUNT; i++) {
        card *c = &cards->cards[i];
        if (!c->shown) {
            continue;
        }
        const int margin = (int)(16 * cards->scale), w = c->frame->width, h = c->frame->height;
        c->x = i == VD_CARD_PANEL   ? margin
               : i == VD_CARD_TIMES ? width - w - margin
                                    : (width - w) / 2;
        c->y = i == VD_CARD_PANEL || i == VD_CARD_TIMES ? margin
               : i == VD_CARD_HELP                      ? (height - h) / 2
                                                        : height - h - margin;
        vd_pixels_lay_over(pixels, stride, width, height, c->frame, c->x, c->y);
    }
}

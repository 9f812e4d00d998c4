/* splat_legend.c: a bar of colours and what they stand for. */
#include <stdio.h>
#include <string.h>
#include "core/real.h"
#include "splat/splat_internal.h"

/* Digits of 3 × 5 pixels, a row each octal digit from the top. */
static int glyph_rows(char c) {
    static const char known[] = "0123456789-+.e";
    static const int rows[] = {075557, 026227, 071747, 071717, 055711, 074717, 074757,
                               071111, 075757, 075717, 000700, 002720, 000002, 007747};
    const char *at = strchr(known, c);
    return at != NULL && c != '\0' ? rows[at - known] : 0;
}

static void fill(vd_frame *frame, int x, int y, int width, int height, uint32_t color) {
    for (int row = y; row < y + height; row++) {
        for (int column = x; column < x + width; column++) {
            if (row >= 0 && row < frame->height && column >= 0 && column < frame->width) {
                memcpy(frame->rgba + 4 * ((size_t)row * frame->stride + (size_t)column), &color, 4);
            }
        }
    }
}

#define WHITE 0xFFFFFFFFu
#define BLACK 0xFF000000u

/* Writes a text whose lower right corner is at (x, y). */
static void write_text(vd_frame *frame, int x, int y, int scale, const char *text) {
    const int length = (int)strlen(text);
    for (int i = 0; i < length; i++) {
        const int rows = glyph_rows(text[i]);
        const int left = x - (length - i) * 4 * scale, top = y - 5 * scale;
        for (int bit = 0; bit < 15; bit++) {
            if ((rows >> (14 - bit) & 1) != 0) {
                fill(frame, left + bit % 3 * scale, top + bit / 3 * scale, scale, scale, WHITE);
            }
        }
    }
}

void vd_splat_draw_legend(vd_frame *frame, const vd_splat_def *def, const vd_splat_stats *stats) {
    enum { LABELS = 5 };
    const int scale = frame->height >= 1400 ? 4 : frame->height >= 700 ? 3 : 2;
    const int height = frame->height / 3 / (LABELS - 1) * (LABELS - 1), width = 6 * scale;
    const int line = 5 * scale;
    if (height < LABELS * 2 * line || !(stats->value_max > stats->value_min)) {
        return;
    }
    vd_splat_picture picture;
    memset(&picture, 0, sizeof picture);
    vd_splat_picture_set_range(&picture, def, stats->value_min, stats->value_max);
    const double low = picture.value_low, step = (VD_PALETTE_COLORS - 1) / picture.value_scale;
    char labels[LABELS][32];
    int longest = 0;
    for (int i = 0; i < LABELS; i++) {
        const double at = low + step * i / (LABELS - 1);
        const int length = snprintf(labels[i], sizeof labels[i], "%.3g",
                                    def->log ? vd_exp(at * 0.6931471805599453) : at);
        longest = length > longest ? length : longest;
    }
    const int box_width = width + (longest * 4 + 6) * scale;
    if (frame->width < 2 * box_width) {
        return;
    }
    const int x = frame->width - 2 * scale - width, y = frame->height - height - 2 * line;
    fill(frame, frame->width - box_width, y - line, box_width, height + 3 * line, BLACK);
    for (int row = 0; row < height; row++) {
        const int at = (height - 1 - row) * (VD_PALETTE_COLORS - 1) / (height - 1);
        fill(frame, x, y + row, width, 1, picture.density_colors[at] | BLACK);
    }
    for (int i = 0; i < LABELS; i++) {
        const int middle = y + height - height * i / (LABELS - 1);
        fill(frame, x - scale, middle - scale / 2, scale, scale, WHITE);
        write_text(frame, x - scale, middle + (line + 1) / 2, scale, labels[i]);
    }
}

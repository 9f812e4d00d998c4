/* compare.c: how two pictures differ. Sums are whole numbers, so their order does not matter. */
#include <veduta/picture.h>

#include <math.h>
#include <stdlib.h>

#include "core/core.h"
#include "image/image.h"

/* Spreads a row to RGBA in units of `bits`: grey to all three, opaque without alpha. */
static void expand_row(const vd_picture *picture, int y, int bits, uint16_t *out) {
    const uint8_t *bytes = vd_picture_row(picture, y);
    const uint16_t *words = vd_picture_row(picture, y);
    const int channels = picture->channels;
    const size_t color_step = channels >= 3 ? 1 : 0;
    const bool alpha = channels == 2 || channels == 4;
    for (int x = 0; x < picture->width; x++, out += 4) {
        const size_t first = (size_t)x * (size_t)channels;
        uint16_t value[4];
        for (int c = 0; c < channels; c++) {
            const size_t i = first + (size_t)c;
            value[c] = picture->bits == 8 ? bytes[i]
                       : bits == 8        ? vd_round_16_to_8(words[i])
                                          : words[i];
        }
        out[0] = value[0];
        out[1] = value[color_step];
        out[2] = value[2 * color_step];
        out[3] = alpha ? value[channels - 1] : (uint16_t)((1 << bits) - 1);
    }
}

typedef struct difference_sums {
    uint64_t squares; /* below 2^32 · 4 · VD_MAX_PIXELS = 2^63 */
    uint64_t differing;
    uint32_t maximum;
} difference_sums;

static void add_row(const uint16_t *a, const uint16_t *b, int width, int channels, double tolerance,
                    difference_sums *sums) {
    for (int x = 0; x < width; x++) {
        uint32_t largest = 0;
        for (int c = 0; c < channels; c++) {
            const uint32_t d = (uint32_t)abs((int)a[4 * x + c] - (int)b[4 * x + c]);
            sums->squares += (uint64_t)d * d;
            largest = d > largest ? d : largest;
        }
        sums->maximum = largest > sums->maximum ? largest : sums->maximum;
        sums->differing += (double)largest > tolerance;
    }
}

static void write_difference(const uint16_t *a, const uint16_t *b, int width, uint32_t unit,
                             uint8_t *out) {
    for (int x = 0; x < width; x++) {
        for (int c = 0; c < 3; c++) {
            const uint32_t d = (uint32_t)abs((int)a[4 * x + c] - (int)b[4 * x + c]);
            const uint32_t shown = (8 * d + unit / 2) / unit;
            out[3 * x + c] = (uint8_t)(shown < 255 ? shown : 255);
        }
    }
}

static vd_status check_pair(const vd_picture *a, const vd_picture *b, double tolerance) {
    if (a->width != b->width || a->height != b->height) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "cannot compare pictures of %d × %d and %d × %d pixels; make them the "
                          "same size",
                          a->width, a->height, b->width, b->height);
    }
    if (!(tolerance >= 0.0)) {
        return vd_failure(VD_ERROR_ARGUMENT,
                          "cannot compare pictures with the tolerance %g; give 0 to 255",
                          tolerance);
    }
    return vd_success();
}

vd_status vd_picture_compare(const vd_picture *a, const vd_picture *b, double tolerance,
                             vd_comparison *out, vd_picture **difference) {
    vd_status status = check_pair(a, b, tolerance);
    if (status.code != VD_OK) {
        return status;
    }
    const int bits = a->bits == 16 && b->bits == 16 ? 16 : 8;
    const uint32_t unit = bits == 16 ? 257 : 1; /* of one 8-bit step */
    const int channels = a->channels % 2 == 0 || b->channels % 2 == 0 ? 4 : 3;
    const size_t row_values = (size_t)a->width * 4;
    vd_picture *picture = NULL;
    if (difference) {
        status = vd_picture_create(a->context, a->width, a->height, 3, 8, &picture);
        if (status.code != VD_OK) {
            return status;
        }
    }
    uint16_t *rows = vd_allocate(a->context, 2 * row_values, sizeof *rows);
    if (!rows) {
        vd_picture_destroy(&picture);
        return vd_out_of_memory("comparing pictures", 2 * row_values * sizeof *rows);
    }
    difference_sums sums = {0, 0, 0};
    for (int y = 0; y < a->height; y++) {
        expand_row(a, y, bits, rows);
        expand_row(b, y, bits, rows + row_values);
        add_row(rows, rows + row_values, a->width, channels, tolerance * unit, &sums);
        if (picture) {
            write_difference(rows, rows + row_values, a->width, unit, vd_picture_row(picture, y));
        }
    }
    vd_release(a->context, rows);

    const uint64_t pixels = (uint64_t)a->width * (uint64_t)a->height;
    out->rms = sqrt((double)sums.squares / ((double)pixels * channels)) / unit;
    out->maximum = (double)sums.maximum / unit;
    out->psnr_db = sums.squares ? 20.0 * log10(255.0 / out->rms) : INFINITY;
    out->differing_pixels = sums.differing;
    out->pixels = pixels;
    if (difference) {
        *difference = picture;
    }
    return vd_success();
}
